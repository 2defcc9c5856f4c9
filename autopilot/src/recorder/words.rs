//! Inputs in words, for the texts of a flight log.

use icd::fault::CATALOGUE;
use icd::pace::Pace;
use icd::{EffectorList, FaultRequest};

use crate::event::Wish;
use crate::vehicle::Reference;

/// Whether it comes in a stream (setpoints, sticks), which would fill the log.
#[must_use]
pub const fn is_stream(wish: &Wish) -> bool {
    matches!(wish, Wish::Setpoint(_) | Wish::Sticks(_))
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

/// What an operator wished of an aircraft with these effectors; `None` for streams.
#[must_use]
pub fn wish(wish: &Wish, effectors: &EffectorList) -> Option<String> {
    Some(match wish {
        Wish::Setpoint(_) | Wish::Sticks(_) => return None,
        Wish::Mode(mode) => format!("mode {mode}"),
        Wish::Refer(Reference::Altitude(m)) => format!("altitude {m:.1} m"),
        Wish::Refer(Reference::Airspeed(m_s)) => format!("airspeed {m_s:.1} m/s"),
        Wish::Refer(Reference::Roll(rad)) => format!("roll {:.1} deg", rad.to_degrees()),
        Wish::Refer(Reference::Course(rad)) => format!("course {:.1} deg", rad.to_degrees()),
        Wish::Gains(_) => "gains".to_owned(),
        Wish::Limits(_) => "limits of references".to_owned(),
        Wish::Navigation(_) => "parameters of the guidance".to_owned(),
        Wish::Fault(FaultRequest::Inject { target, kind, timing }) => {
            let kind = kind.described(target.class(effectors));
            format!("fault: {} {kind}{timing}", target.name(effectors))
        }
        Wish::Fault(FaultRequest::Clear { target }) => format!("mend {}", target.name(effectors)),
        Wish::Fault(FaultRequest::ClearAll) => "mend everything".to_owned(),
        Wish::Restart => "new flight".to_owned(),
        Wish::Reposition(_) => "reposition".to_owned(),
        Wish::Plan(plan) => format!("plan of {} items", plan.items.len()),
        Wish::PlanItem(item) => format!("item {item} of the plan"),
        Wish::Continue => "go on with the plan".to_owned(),
        Wish::Home(_) => "home".to_owned(),
        Wish::Terminate => "terminate the flight".to_owned(),
        Wish::LinkLost(_) => "the ground station is silent".to_owned(),
        Wish::LinkBack => "the ground station is back".to_owned(),
        Wish::ListFaults => "the autopilot asks for the faults".to_owned(),
        Wish::Script(script) => format!("script {}", script.name()),
        Wish::StopScript => "stop the script".to_owned(),
        Wish::FaultInjection(true) => "fault injection allowed".to_owned(),
        Wish::FaultInjection(false) => "fault injection refused".to_owned(),
        Wish::Pace(Pace::Pause) => "pause".to_owned(),
        Wish::Pace(Pace::Run) => "run".to_owned(),
        Wish::Pace(Pace::Step(periods)) => format!("step {periods} periods"),
        Wish::Pace(Pace::Speed(speed)) => format!("speed x{speed}"),
    })
}
