//! Inputs in words, for the texts of a flight log.

use flight_management::command::Configuration;
use flight_management::command::ScriptCommand;
use flight_management::command::VehicleCommand;
use icd::fault::CATALOGUE;
use icd::fault::PlantAction;
use icd::pace::Pace;
use icd::{EffectorList, FaultRequest};

use flight_management::command::Command;
use flight_management::vehicle::Reference;

/// Whether it comes in a stream (setpoints, sticks), which would fill the log.
#[must_use]
pub const fn is_stream(command: &Command) -> bool {
    matches!(
        command,
        Command::Vehicle(VehicleCommand::Setpoint(_)) | Command::Vehicle(VehicleCommand::Sticks(_))
    )
}

/// What the codes of faults mean: `1 stuck_here, 2 stuck_at jump, ...`.
#[must_use]
pub fn fault_kinds() -> String {
    let all = CATALOGUE.iter().flat_map(|kind| {
        let alternatives = kind.choice.map_or(&[][..], |choice| choice.alternatives);
        (kind.code..kind.code + kind.alternatives()).enumerate().map(move |(place, code)| {
            let alternative = alternatives.get(place).map_or("", |one| one.key);
            format!("{code} {} {alternative}", kind.key).trim_end().to_owned()
        })
    });
    all.collect::<Vec<_>>().join(", ")
}

/// What an operator commanded of an aircraft with these effectors; `None` for streams.
#[must_use]
pub fn command(command: &Command, effectors: &EffectorList) -> Option<String> {
    Some(match command {
        Command::Vehicle(VehicleCommand::Setpoint(_))
        | Command::Vehicle(VehicleCommand::Sticks(_)) => return None,
        Command::Vehicle(VehicleCommand::Mode(mode)) => format!("mode {mode}"),
        Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(m))) => {
            format!("altitude {m:.1} m")
        }
        Command::Vehicle(VehicleCommand::Refer(Reference::Airspeed(m_s))) => {
            format!("airspeed {m_s:.1} m/s")
        }
        Command::Vehicle(VehicleCommand::Refer(Reference::Roll(rad))) => {
            format!("roll {:.1} deg", rad.to_degrees())
        }
        Command::Vehicle(VehicleCommand::Refer(Reference::Course(rad))) => {
            format!("course {:.1} deg", rad.to_degrees())
        }
        Command::Configuration(Configuration::Gains(_)) => "gains".to_owned(),
        Command::Configuration(Configuration::Limits(_)) => "limits of references".to_owned(),
        Command::Configuration(Configuration::Navigation(_)) => {
            "parameters of the guidance".to_owned()
        }
        Command::Plant(PlantAction::Fault(FaultRequest::Inject { target, kind, timing })) => {
            let kind = kind.described(target.class(effectors));
            format!("fault: {} {kind}{timing}", target.name(effectors))
        }
        Command::Plant(PlantAction::Fault(FaultRequest::Clear { target })) => {
            format!("mend {}", target.name(effectors))
        }
        Command::Plant(PlantAction::Fault(FaultRequest::ClearAll)) => "mend everything".to_owned(),
        Command::Plant(PlantAction::Restart) => "new flight".to_owned(),
        Command::Vehicle(VehicleCommand::Reposition(_)) => "reposition".to_owned(),
        Command::Vehicle(VehicleCommand::Plan(plan)) => {
            format!("plan of {} items", plan.items.len())
        }
        Command::Vehicle(VehicleCommand::PlanItem(item)) => format!("item {item} of the plan"),
        Command::Vehicle(VehicleCommand::Continue) => "go on with the plan".to_owned(),
        Command::Vehicle(VehicleCommand::Home(_)) => "home".to_owned(),
        Command::Vehicle(VehicleCommand::Terminate) => "terminate the flight".to_owned(),
        Command::Vehicle(VehicleCommand::LinkLost(_)) => "the ground station is silent".to_owned(),
        Command::Vehicle(VehicleCommand::LinkBack) => "the ground station is back".to_owned(),
        Command::Plant(PlantAction::ListFaults) => "the autopilot asks for the faults".to_owned(),
        Command::Script(ScriptCommand::Run(script)) => format!("script {}", script.name()),
        Command::Script(ScriptCommand::Stop) => "stop the script".to_owned(),
        Command::Configuration(Configuration::FaultInjection(true)) => {
            "fault injection allowed".to_owned()
        }
        Command::Configuration(Configuration::FaultInjection(false)) => {
            "fault injection refused".to_owned()
        }
        Command::Plant(PlantAction::Pace(Pace::Pause)) => "pause".to_owned(),
        Command::Plant(PlantAction::Pace(Pace::Run)) => "run".to_owned(),
        Command::Plant(PlantAction::Pace(Pace::Step(periods))) => format!("step {periods} periods"),
        Command::Plant(PlantAction::Pace(Pace::Speed(speed))) => format!("speed x{speed}"),
    })
}
