//! Inputs in words, for the texts of a flight log.

use icd::fault::CATALOGUE;
use icd::pace::Pace;
use icd::{EffectorList, FaultRequest};

use flight_management::event::Command;
use flight_management::vehicle::Reference;

/// Whether it comes in a stream (setpoints, sticks), which would fill the log.
#[must_use]
pub const fn is_stream(command: &Command) -> bool {
    matches!(command, Command::Setpoint(_) | Command::Sticks(_))
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
        Command::Setpoint(_) | Command::Sticks(_) => return None,
        Command::Mode(mode) => format!("mode {mode}"),
        Command::Refer(Reference::Altitude(m)) => format!("altitude {m:.1} m"),
        Command::Refer(Reference::Airspeed(m_s)) => format!("airspeed {m_s:.1} m/s"),
        Command::Refer(Reference::Roll(rad)) => format!("roll {:.1} deg", rad.to_degrees()),
        Command::Refer(Reference::Course(rad)) => format!("course {:.1} deg", rad.to_degrees()),
        Command::Gains(_) => "gains".to_owned(),
        Command::Limits(_) => "limits of references".to_owned(),
        Command::Navigation(_) => "parameters of the guidance".to_owned(),
        Command::Fault(FaultRequest::Inject { target, kind, timing }) => {
            let kind = kind.described(target.class(effectors));
            format!("fault: {} {kind}{timing}", target.name(effectors))
        }
        Command::Fault(FaultRequest::Clear { target }) => {
            format!("mend {}", target.name(effectors))
        }
        Command::Fault(FaultRequest::ClearAll) => "mend everything".to_owned(),
        Command::Restart => "new flight".to_owned(),
        Command::Reposition(_) => "reposition".to_owned(),
        Command::Plan(plan) => format!("plan of {} items", plan.items.len()),
        Command::PlanItem(item) => format!("item {item} of the plan"),
        Command::Continue => "go on with the plan".to_owned(),
        Command::Home(_) => "home".to_owned(),
        Command::Terminate => "terminate the flight".to_owned(),
        Command::LinkLost(_) => "the ground station is silent".to_owned(),
        Command::LinkBack => "the ground station is back".to_owned(),
        Command::ListFaults => "the autopilot asks for the faults".to_owned(),
        Command::Script(script) => format!("script {}", script.name()),
        Command::StopScript => "stop the script".to_owned(),
        Command::FaultInjection(true) => "fault injection allowed".to_owned(),
        Command::FaultInjection(false) => "fault injection refused".to_owned(),
        Command::Pace(Pace::Pause) => "pause".to_owned(),
        Command::Pace(Pace::Run) => "run".to_owned(),
        Command::Pace(Pace::Step(periods)) => format!("step {periods} periods"),
        Command::Pace(Pace::Speed(speed)) => format!("speed x{speed}"),
    })
}
