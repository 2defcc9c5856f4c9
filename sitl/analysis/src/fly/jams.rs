//! `sitl study jams`: every surface jammed at parts of its travel to either side, without and with the compensator, as a table.

use std::fmt::Write as _;
use std::path::PathBuf;

use autopilot::own_law::OwnLaw;
use autopilot::run::LawArgs;
use flight_control::CompensatorMode;
use host_io::file;
use icd::EffectorKind;
use icd::units::DEG;
use plant_sim::Airframe;

use super::judge::{self, Keep};
use super::outcome::Outcome;
use crate::builder::{SetupBuilder, SetupOptions};
use crate::closed_loop::FlightSetup;
use crate::configuration::{AircraftArgs, Named};
use crate::linearize::Condition;
use crate::problem::{At as _, Problem};
use crate::runner;

/// Where surfaces are jammed, of the travel to the one side and to the other.
const PARTS: [f64; 6] = [-1.0, -0.5, -0.25, 0.25, 0.5, 1.0];
/// When they are jammed, s.
const ONSET_S: f64 = 1.0;
/// First line of a table, by which this program knows what it may write over.
const MARK: &str = "<!-- Written by `sitl study jams`; do not edit. -->";

/// Options of `sitl study jams`.
#[derive(Debug, Clone, clap::Args)]
pub struct JamsArgs {
    /// Aircraft and settings.
    #[command(flatten)]
    aircraft: AircraftArgs,
    /// Main controller, estimator of the compensator, gains.
    #[command(flatten)]
    laws: LawArgs,
    /// Flight condition instead of the design point; may be repeated
    #[arg(long, value_name = "ALTITUDE_M,AIRSPEED_M_S", allow_hyphen_values = true)]
    at: Vec<Condition>,
    /// File for the table, in Markdown [default: the standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl JamsArgs {
    /// Takes a law that the program brings.
    pub fn bring(&mut self, own: &OwnLaw) {
        self.laws.bring(own);
    }

    fn options(&self) -> SetupOptions {
        let (aircraft, laws) = (self.aircraft.clone(), self.laws.clone());
        SetupOptions { aircraft, laws, ..SetupOptions::default() }
    }
}

/// A surface that is jammed.
#[derive(Debug, Clone)]
struct Jam {
    key: String,
    name: String,
    angle_deg: f64,
}

/// Flies and writes.
pub fn run(args: &JamsArgs) -> Result<(), Problem> {
    if let Some(path) = &args.out {
        file::can_write(path, MARK.as_bytes()).at(format_args!("--out {}", path.display()))?;
    }
    let builder = args.options().builder()?;
    let airframe = &builder.airframe;
    let start = &airframe.design_point;
    let design = Condition { altitude_m: start.altitude_m, airspeed_m_s: start.airspeed_m_s };
    let conditions = if args.at.is_empty() { vec![design] } else { args.at.clone() };
    let jams = jams(airframe);
    let mut setups = Vec::new();
    for condition in &conditions {
        for jam in &jams {
            for is_armed in [false, true] {
                setups.push(jam.setup(&builder, condition, is_armed)?);
            }
        }
    }
    let fly =
        |setup: &FlightSetup| judge::fly(setup, true, Keep::default()).map(|(flown, _)| flown);
    let flown = runner::map_quietly("jams", &setups, fly);
    let flown: Vec<Outcome> = flown.into_iter().collect::<Result<_, Problem>>()?;
    let mut text = format!("{MARK}\n");
    for (condition, flown) in conditions.iter().zip(flown.chunks(2 * jams.len())) {
        let Condition { altitude_m, airspeed_m_s } = condition;
        let _ = writeln!(text, "\n{} at {airspeed_m_s} m/s and {altitude_m} m:\n", airframe.name);
        text += HEADING;
        for (jam, flown) in jams.iter().zip(flown.chunks(2)) {
            let Jam { name, angle_deg, .. } = jam;
            let _ = write!(text, "| {name} {angle_deg:+.1} |");
            for outcome in flown {
                let _ = write!(text, " {} |", cell(outcome));
            }
            text.push('\n');
        }
    }
    let Some(path) = &args.out else {
        print_text!("{text}");
        return Ok(());
    };
    file::write(path, text.as_bytes(), MARK.as_bytes())
        .at(format_args!("--out {}", path.display()))?;
    print_line!("wrote {}", path.display());
    Ok(())
}

const HEADING: &str = "| jammed at, deg | without the compensator | with it |\n|---|---|---|\n";

/// Every surface at every part of its travel.
fn jams(airframe: &Airframe) -> Vec<Jam> {
    let list = &airframe.effectors;
    let surfaces = list.all().filter(|e| list.kind(*e).is_some_and(EffectorKind::is_surface));
    let jam = |effector| {
        let servo = &airframe.servos[effector];
        PARTS.map(|part: f64| Jam {
            key: list.key(effector).to_owned(),
            name: list.name(effector).to_owned(),
            angle_deg: (part.abs() * if part < 0.0 { servo.min } else { servo.max }) / DEG,
        })
    };
    surfaces.flat_map(jam).collect()
}

/// What became of a flight.
fn cell(outcome: &Outcome) -> String {
    match outcome.loss {
        Some(loss) => format!("lost at {:.1} s, {}", loss.at_s, loss.by),
        None => {
            // The measures are reference minus true value; plus zero makes a rounded zero positive.
            let off = |name: &str, unit: f64| {
                let value = outcome.metric(name).unwrap_or(f64::NAN);
                (-value / unit).round() + 0.0
            };
            let roll_deg = off("steady_offset_roll", 0.1 * DEG) / 10.0;
            let altitude_m = off("steady_offset_altitude", 1.0);
            format!("kept, roll {roll_deg:+.1} deg, altitude {altitude_m:+.0} m")
        }
    }
}

impl Jam {
    /// The flight with this jam, without or with the compensator.
    fn setup(
        &self,
        builder: &SetupBuilder,
        at: &Condition,
        is_armed: bool,
    ) -> Result<FlightSetup, Problem> {
        let Condition { altitude_m, airspeed_m_s } = at;
        let Self { key, angle_deg, .. } = self;
        let scenario = format!(
            "[plant]\nseed = 1\nearth = \"flat\"\n[plant.start]\naltitude_m = {altitude_m:?}\nairspeed_m_s = {airspeed_m_s:?}\n\
             [[plant.fault]]\neffector = \"{key}\"\nkind = \"stuck_at\"\nangle_deg = {angle_deg:?}\nonset_s = {ONSET_S:?}\n"
        );
        let name = format!("{key} jammed at {angle_deg} deg");
        let ftc = if is_armed { CompensatorMode::Armed } else { CompensatorMode::Off };
        let mut setup = builder.setup(&Named { name, text: scenario.into() }, &[])?;
        setup.parameters.gains.selection.compensator = ftc;
        Ok(setup)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_surface_is_jammed_at_six_places_up_to_the_ends_of_its_travel() {
        let jams = jams(&Airframe::paper());
        assert_eq!(jams.len(), 5 * PARTS.len());
        let angles = [-30.0, -15.0, -7.5, 7.5, 15.0, 30.0];
        assert_eq!(jams[12].name, "left elevator");
        for (jam, angle_deg) in jams[12..18].iter().zip(angles) {
            assert!((jam.angle_deg - angle_deg).abs() < 1.0e-9, "{jam:?}");
        }
    }
}
