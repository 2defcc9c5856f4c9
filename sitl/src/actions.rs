//! `sitl aircraft actions`: buttons of QGroundControl that break something, for any aircraft.
//!
//! Each button is one MAV_CMD_USER_1 (docs/commands.md, section Faults). The syntax of a fault is that of scripts.

use host_io::print_line;
use std::path::PathBuf;

use autopilot::script::{Action, Script};
use host_io::folder::OutFolder;
use host_io::problem::{At as _, Problem, problem};
use icd::fault::{FaultKind, Measure, Onset, Target, TargetClass, Timing, check};
use icd::{Effector, EffectorKind, FaultRequest, LateralSide};
use plant_sim::Airframe;
use serde_json::json;

use lab_engine::configuration::AircraftArgs;
use lab_engine::settings;

/// MAV_CMD_USER_1.
const USER_1: u16 = 31_010;
/// QGroundControl shows three at a time: there are not many more.
const BUTTONS_MAX: usize = 12;

/// The files: name, key `fileType`, whether an action has a description. 5.x reads the first one, 4.3 and 4.4 the other.
const FILES: [(&str, &str, bool); 2] = [
    ("MavlinkActions.json", "MavlinkActions", true),
    ("CustomActions.json", "CustomActions", false),
];

/// Options of `sitl aircraft actions`.
#[derive(Debug, Clone, clap::Args)]
pub struct ActionsArgs {
    /// Aircraft and settings.
    #[command(flatten)]
    aircraft: AircraftArgs,
    /// A button: what follows `fail` or `clear` in a script, with a label and a colon before it if it shall have another one;
    /// may be repeated [default: half the travel of the first elevator, rudder and aileron, and everything OK]
    #[arg(long = "fault", value_name = "[LABEL:]WORDS")]
    faults: Vec<String>,
    /// Folder for MavlinkActions.json (QGroundControl 5.x) and CustomActions.json (4.3, 4.4)
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// A button.
#[derive(Debug, Clone, PartialEq)]
struct Button {
    label: String,
    description: String,
    params: [f64; 7],
}

/// Writes both files.
pub fn run(args: &ActionsArgs) -> Result<(), Problem> {
    args.aircraft.check_read(&[settings::Target::Airframe])?;
    let buttons = args.buttons(&args.aircraft.airframe()?)?;
    let folder = OutFolder::create(&args.out)?;
    for (name, file_type, described) in FILES {
        let content = text(&buttons, file_type, described);
        folder.write(name, content.as_bytes())?;
        print_line!("wrote {}", folder.path().join(name).display());
    }
    Ok(())
}

impl ActionsArgs {
    fn buttons(&self, airframe: &Airframe) -> Result<Vec<Button>, Problem> {
        if self.faults.len() > BUTTONS_MAX {
            let count = self.faults.len();
            return Err(problem!("--fault: {count} buttons, at most {BUTTONS_MAX}"));
        }
        let defaults = default_faults(airframe);
        let faults = if self.faults.is_empty() { &defaults } else { &self.faults };
        faults
            .iter()
            .map(|fault| button(fault, airframe).at(format!("--fault `{fault}`")))
            .collect()
    }
}

/// Half the travel of the first of each kind of surface that turns the aircraft, and everything mended.
fn default_faults(airframe: &Airframe) -> Vec<String> {
    let list = &airframe.effectors;
    let half = |kind: EffectorKind| {
        let first = list.find(kind, LateralSide::Left).or_else(|| list.of_kind(kind).next())?;
        let degrees = (0.5 * airframe.servos[first].max).to_degrees();
        Some(format!("{} stuck at {degrees:.1} deg", list.name(first)))
    };
    use EffectorKind::{Aileron, Elevator, Elevon, Rudder, Ruddervator};
    let kinds = [Elevator, Elevon, Ruddervator, Rudder, Aileron];
    let mut faults: Vec<String> = kinds.into_iter().filter_map(half).collect();
    // QGroundControl shows three buttons at a time, and the repair should be one of them.
    faults.insert(faults.len().min(2), "Everything OK: all".to_owned());
    faults
}

/// Reads `[LABEL:]WORDS`.
fn button(text: &str, airframe: &Airframe) -> Result<Button, Problem> {
    let (label, words) = match text.split_once(':') {
        Some((label, words)) => (label.trim().to_owned(), words.trim()),
        None => (capital(text.trim()), text.trim()),
    };
    if label.is_empty() || words.contains('\n') {
        return Err(problem!("a button has a label and one line"));
    }
    let list = &airframe.effectors;
    let verb = if words == "all" { "clear" } else { "fail" };
    let script = Script::parse("--fault", &format!("{verb} {words}"), list)?;
    let Some(Action::Fault(request)) = script.lines().next().map(|line| line.action) else {
        return Err(problem!("this is no fault"));
    };
    let params = match request {
        // Unit -1 with type and instance 0 clears the faults of effectors, sensors and parts
        // (docs/commands.md).
        FaultRequest::ClearAll => [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        FaultRequest::Inject { target: Target::Effector(effector), kind, timing } => {
            let reach = airframe.servos[effector].reach(Target::from(effector).class(list));
            let class = reach.class;
            check(&kind, &timing, &reach)
                .map_err(|refusal| problem!("{}", refusal.described(class)))?;
            params(airframe, effector, &kind, &timing).map_err(Problem::new)?
        }
        _ => return Err(problem!("this is no fault of an effector")),
    };
    Ok(Button { label, description: format!("{verb} {words}"), params })
}

/// Parameters of USER_1: unit, type, instance, kind of value, value, ramp.
fn params(
    airframe: &Airframe,
    effector: Effector,
    kind: &FaultKind,
    timing: &Timing,
) -> Result<[f64; 7], &'static str> {
    let list = &airframe.effectors;
    let info = kind.info();
    let is_bare = Timing { ramp_s: 0.0, ..*timing } == Timing::from_onset(Onset::AtOnce);
    if !is_bare {
        return Err(
            "a button has no duration and no repetition: they are the parameters FLT_DUR_S and FLT_RPT_S",
        );
    }
    // USER_1 means the usual alternative of a kind; any other one is chosen by a parameter.
    let usual = info.choice.and_then(|choice| choice.default).unwrap_or(0);
    let is_other = info.size().is_some() && kind.code() != info.code + usual;
    if info.numbers.len() > 1 || is_other {
        return Err("a button has one number: the others are parameters FLT_*");
    }
    let is_angle = list.is_angle(effector);
    let (unit, _) = Target::from(effector).unit(list);
    let (code, value) = match (info.mavlink.user_1, info.size()) {
        (Some(code), Some((place, number))) => {
            let class = if is_angle { TargetClass::Angle } else { TargetClass::Thrust };
            let si = kind.values()[place];
            let measure = number.quantity.measure();
            let value = match measure {
                // The engine's sizes are percent of its largest thrust, and delays are seconds.
                Measure::Position | Measure::Speed if !is_angle => {
                    100.0 * si / airframe.servos[effector].max
                }
                Measure::Milliseconds => si,
                other => other.unit(class).from_si(si),
            };
            (code, value)
        }
        (Some(code), None) => {
            let place = usize::from(kind.code() - info.code);
            let choice = info.choice.and_then(|choice| choice.alternatives.get(place)?.value);
            (code, choice.map_or(0.0, |(_, number)| number))
        }
        (None, _) if info.mavlink.failure_type.mode().is_some() => {
            return Err("USER_1 has no number for this kind: it is chosen by a parameter FLT_*");
        }
        (None, _) => (0, 0.0),
    };
    let failure_type = f64::from(info.mavlink.failure_type.code());
    let instance = f64::from(list.instance(effector));
    // A button shows what was typed, not what a division left of it.
    let value = (value * 1.0e6).round() / 1.0e6;
    Ok([f64::from(unit), failure_type, instance, f64::from(code), value, timing.ramp_s, 0.0])
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().collect::<String>() + letters.as_str()
    })
}

/// One action on each line.
fn text(buttons: &[Button], file_type: &str, described: bool) -> String {
    let lines: Vec<String> =
        buttons.iter().map(|button| format!("    {}", action(button, described))).collect();
    format!(
        "{{\n  \"version\": 1,\n  \"fileType\": \"{file_type}\",\n  \"actions\": [\n{}\n  ]\n}}\n",
        lines.join(",\n")
    )
}

fn action(button: &Button, described: bool) -> String {
    let mut pairs = vec![("label".to_owned(), json!(button.label).to_string())];
    if described {
        pairs.push(("description".to_owned(), json!(button.description).to_string()));
    }
    pairs.push(("mavCmd".to_owned(), USER_1.to_string()));
    // The autopilot's component, MAV_COMP_ID_AUTOPILOT1: a camera would not answer.
    pairs.push(("compId".to_owned(), "1".to_owned()));
    // What is not given is sent as zero.
    let used = button.params.iter().rposition(|param| *param != 0.0).map_or(0, |last| last + 1);
    // Unit, type and instance say what breaks, so they stand in the file even where they are zero.
    for (number, param) in (1..).zip(&button.params[..used.max(3)]) {
        pairs.push((format!("param{number}"), param.to_string()));
    }
    let pairs: Vec<String> =
        pairs.into_iter().map(|(key, value)| format!("\"{key}\": {value}")).collect();
    format!("{{{}}}", pairs.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant_sim::ReadAirframe as _;

    /// With these the files in the repository were written.
    const SHIPPED: [&str; 6] = [
        "Left elevator at 30 deg: left elevator stuck at 30 deg",
        "Rudder at 7 deg: rudder stuck at 7 deg",
        "Everything OK: all",
        "Left elevator hard over: left elevator hard over positive",
        "Left aileron half effect: left aileron 50 % left, ramp 5 s",
        "Engine half thrust: engine 50 % left",
    ];

    fn args(faults: &[&str]) -> ActionsArgs {
        ActionsArgs {
            aircraft: AircraftArgs::default(),
            faults: faults.iter().map(ToString::to_string).collect(),
            out: PathBuf::new(),
        }
    }

    #[test]
    fn the_files_of_the_repository_are_what_the_command_writes() {
        let buttons = args(&SHIPPED).buttons(&Airframe::paper()).unwrap();
        let files = [
            include_str!("../../gcs-scripts/qgroundcontrol/MavlinkActions.json"),
            include_str!("../../gcs-scripts/qgroundcontrol/CustomActions.json"),
        ];
        for ((_, file_type, described), shipped) in FILES.into_iter().zip(files) {
            assert_eq!(text(&buttons, file_type, described), shipped);
        }
    }

    #[test]
    fn another_aircraft_gets_its_own_buttons() {
        let file = aircraft::AEROSONDE_AIRFRAME;
        let airframe = Airframe::from_toml("aerosonde.toml", file).unwrap();
        let buttons = args(&[]).buttons(&airframe).unwrap();
        let labels: Vec<&str> = buttons.iter().map(|button| button.label.as_str()).collect();
        assert_eq!(
            labels,
            [
                "Left elevator stuck at 12.5 deg",
                "Rudder stuck at 12.5 deg",
                "Everything OK",
                "Left aileron stuck at 12.5 deg"
            ]
        );
        assert_eq!(buttons[0].params, [102.0, 2.0, 3.0, 1.0, 12.5, 0.0, 0.0]);
    }

    #[test]
    fn an_entry_that_cannot_be_a_button_is_refused_with_the_reason() {
        let refusal =
            |fault: &str| args(&[fault]).buttons(&Airframe::paper()).unwrap_err().to_string();
        assert!(refusal("left wing stuck at 3 deg").contains("`left wing stuck at 3 deg`"));
        assert!(refusal("rudder stuck at 300 deg").contains("300"));
        assert!(refusal("rudder stuck").contains("FLT_"));
        assert!(refusal("rudder stuck at 3 deg, for 5 s").contains("FLT_DUR_S"));
        assert!(refusal("rudder stuck at 31 deg").contains("angle 31 deg is outside"));
        assert!(refusal("engine limited to 900 kN").contains("kN is outside"));
        for two in ["oscillating 5 deg at 3 Hz", "stuck at 10 deg at the actuator's rate"] {
            assert!(refusal(&format!("rudder {two}")).contains("one number"), "{two}");
        }
        assert!(refusal(": all").contains("label"));
        let many = ["Everything OK: all"; BUTTONS_MAX + 1];
        assert!(args(&many).buttons(&Airframe::paper()).is_err());
    }
}
