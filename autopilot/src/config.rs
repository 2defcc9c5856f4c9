//! Files that the autopilot reads at start: its model of the aircraft, its part of a scenario, scripts.
//!
//! Their texts are parsed by [`crate::configuration`], without files.

use std::path::Path;

use aircraft::DEFAULT_NAME;
use flight_control::gains::tunables;
use flight_control::{AircraftModel, MainLaw};
use host_io::file::{self, FileProblem};
use host_io::problem::{At as _, Problem};
use icd::EffectorList;

pub use flight_management::configuration::*;
use flight_management::parameters::{Parameters, table};
use flight_management::script::{Script, TEXT_MAX};

/// Reads a whole text file.
pub fn read(path: &Path) -> Result<String, Problem> {
    file::read_text(path, file::TEXT_MAX).at(path.display())
}

/// The model that comes with the program under this name, or else the model in this file.
pub fn named_model(name: &Path) -> Result<Model, Problem> {
    let read = file::shipped_or_read(name, aircraft::MODELS);
    let (file, text) = read.at(format_args!("--model {}", name.display()))?;
    Ok(model(&file, &text)?)
}

/// Reads a script for an aircraft with these effectors; a file over the limit is not read.
pub fn script_file(path: &Path, effectors: &EffectorList) -> Result<Script, Problem> {
    let name = path.display().to_string();
    match file::read_text(path, TEXT_MAX as u64) {
        Ok(text) => Ok(Script::parse(&name, &text, effectors)?),
        Err(FileProblem::TooLong { bytes, .. }) => Err(Script::too_long(&name, bytes).into()),
        Err(problem) => Err(problem).at(format_args!("--script {name}")),
    }
}

/// Parameters whose values depend on the aircraft, whatever law flies.
const OF_EVERY_LAW: [&str; 18] = [
    "ALT_SLEW",
    "ROL_LAG",
    "REF_ALT_MIN",
    "REF_ALT_MAX",
    "FW_AIRSPD_MIN",
    "FW_AIRSPD_MAX",
    "FW_L1_PERIOD",
    "FW_PN_R_SLEW_MAX",
    "NAV_LOITER_RAD",
    "NAV_ACC_RAD",
    "NAV_CLIMB_MAX",
    "RTL_RETURN_ALT",
    "MIS_TAKEOFF_ALT",
    "GND_ATT",
    "GND_STEER",
    "ACT_LVL_P",
    "ACT_LVL_Q",
    "ACT_LVL_R",
];

/// Names of the parameters that depend on the aircraft and matter for a law.
pub fn of_aircraft(law: MainLaw) -> impl Iterator<Item = &'static str> {
    let groups: &[&str] = match law {
        MainLaw::Pid | MainLaw::PidGangedNozzle => &["ALT", "ROL", "YAW", "SPD"],
        MainLaw::Ndi => &["NDI"],
        MainLaw::Lqr => &["LQR"],
        MainLaw::Own => &[],
    };
    let of_law = tunables().map(|gain| gain.name).filter(move |name| {
        let is_group = |group: &&str| name.split('_').next() == Some(*group);
        groups.iter().any(is_group) && !OF_EVERY_LAW.contains(name)
    });
    OF_EVERY_LAW.into_iter().chain(of_law)
}

/// Tells the operator that another aircraft flies with values of the jet; `None` where it has its own.
pub fn inherited(aircraft: &AircraftModel, parameters: &Parameters) -> Option<String> {
    let is_jets = |name: &&str| {
        let row = table().iter().find(|row| row.name == *name);
        row.is_some_and(|row| row.value(parameters).to_bits() == row.default_value().to_bits())
    };
    let names: Vec<&str> = of_aircraft(parameters.gains.selection.main).filter(is_jets).collect();
    if aircraft.aircraft.as_str() == DEFAULT_NAME || names.is_empty() {
        return None;
    }
    Some(format!(
        "{} has the values of {DEFAULT_NAME} for {}; `sitl aircraft new` finds its own",
        aircraft.aircraft,
        names.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use aircraft::DEFAULT_MODEL;

    #[test]
    fn what_another_aircraft_has_of_the_jet_is_named() {
        let other = DEFAULT_MODEL.replace("aircraft = \"tvc_jet\"", "aircraft = \"kite\"");
        let kite = model("kite.toml", &other).unwrap();
        let note = inherited(&kite.aircraft, &kite.defaults).unwrap();
        assert!(
            note.starts_with("kite has the values of tvc_jet for ALT_SLEW, ROL_LAG, "),
            "{note}"
        );
        assert!(note.contains(" YAW_KR, ") && !note.contains("NDI_"), "{note}");
        let mut all_own = kite.defaults;
        for name in of_aircraft(MainLaw::Pid) {
            let row = table().iter().find(|row| row.name == name).unwrap();
            all_own.set(name, 0.9 * row.value(&kite.defaults)).unwrap();
        }
        assert_eq!(inherited(&kite.aircraft, &all_own), None);
        let jet = model("jet.toml", DEFAULT_MODEL).unwrap();
        assert_eq!(inherited(&jet.aircraft, &jet.defaults), None);
    }
}
