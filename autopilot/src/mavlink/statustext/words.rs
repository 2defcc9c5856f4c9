//! What each event says, and how much it matters.
//!
//! CRITICAL is what a pilot must see at once: QGroundControl opens its banner for ERROR and worse, shows WARNING
//! and NOTICE in orange, and the rest plainly. So good news and answers are INFO.

use ::mavlink::dialects::common::MavSeverity;
use flight_control::CompensatorMode;
use icd::EffectorList;
use icd::fault::{FaultEntry, FaultState};
use icd::pace::Pace;

use crate::event::{EventKind, Limit, Limits};
use crate::mavlink::aircraft::Phase;
use crate::parameters::Parameters;
use crate::vehicle::LinkLossAction;

/// Importance (number of syslog) and words of an event, for the flight log; `None` if it is not told.
#[must_use]
pub fn words(
    kind: &EventKind,
    parameters: &Parameters,
    effectors: &EffectorList,
) -> Option<(u8, String)> {
    text_of(kind, parameters, effectors).map(|(severity, text)| (severity as u8, text))
}

pub(super) fn text_of(
    kind: &EventKind,
    parameters: &Parameters,
    effectors: &EffectorList,
) -> Option<(MavSeverity, String)> {
    use MavSeverity as S;
    let compensator_off = parameters.gains.selection.compensator == CompensatorMode::Off;
    Some(match *kind {
        // Those of scripts need the script: [`super::scripts`].
        EventKind::Outcome { .. } | EventKind::Script { .. } => return None,
        EventKind::FlightBegan { joined_in_flight: false } => {
            (S::MAV_SEVERITY_INFO, "Flight began".into())
        }
        EventKind::FlightBegan { joined_in_flight: true } => {
            (S::MAV_SEVERITY_INFO, "Joined a flight under way".into())
        }
        EventKind::Mode(mode) => (S::MAV_SEVERITY_INFO, format!("Mode {mode}")),
        EventKind::CompensatorActive { axis, .. } if compensator_off => {
            (S::MAV_SEVERITY_CRITICAL, format!("Fault detected: {} (compensator off)", axis.name()))
        }
        EventKind::CompensatorActive { axis, at_limit } => {
            let text = format!("Compensator active: {}{}", axis.name(), limits_text(at_limit));
            (S::MAV_SEVERITY_CRITICAL, text)
        }
        EventKind::CompensatorReleased { .. } if compensator_off => {
            (S::MAV_SEVERITY_INFO, "Fault no longer detected".into())
        }
        EventKind::CompensatorReleased { after } => {
            let text = format!("Compensator released after {:.1} s", after.as_secs_f64());
            (S::MAV_SEVERITY_INFO, text)
        }
        EventKind::AuthorityExhausted { axis, by } => {
            let by = match by {
                Limit::Thrust => "too little thrust".into(),
                limit => format!("{} at limit", limit.name()),
            };
            (S::MAV_SEVERITY_CRITICAL, format!("No authority left: {}, {by}", axis.name()))
        }
        EventKind::AuthorityRestored(axis) => {
            (S::MAV_SEVERITY_INFO, format!("Authority restored: {}", axis.name()))
        }
        EventKind::Saturated(limit) => {
            // Full or idle thrust is normal in a climb, a descent or after a change of speed.
            let is_normal = limit == Limit::Thrust;
            let severity = if is_normal { S::MAV_SEVERITY_INFO } else { S::MAV_SEVERITY_WARNING };
            (severity, format!("Saturated: {}", limit.name()))
        }
        EventKind::SaturationEnded(limit) => {
            (S::MAV_SEVERITY_INFO, format!("No longer saturated: {}", limit.name()))
        }
        EventKind::AltitudeNotHeld(limit) => {
            let text = format!("Altitude not held: {} at its limit", limit.name());
            (S::MAV_SEVERITY_WARNING, text)
        }
        EventKind::AltitudeHeld => (S::MAV_SEVERITY_INFO, "Altitude held again".into()),
        EventKind::Fault(ref entry) => return fault_text(entry, effectors),
        EventKind::GroundContact => {
            (S::MAV_SEVERITY_EMERGENCY, "Ground contact: the flight is over".into())
        }
        EventKind::PlantLost => {
            (S::MAV_SEVERITY_WARNING, "Plant link lost: simulation time stands still".into())
        }
        EventKind::LogRemoved => {
            (S::MAV_SEVERITY_WARNING, "Flight log was removed: not recording".into())
        }
        EventKind::PlantBack => (S::MAV_SEVERITY_INFO, "Plant link is back".into()),
        EventKind::EventsLost(lost) => (
            S::MAV_SEVERITY_WARNING,
            format!("{lost} events were lost: the faults are listed anew"),
        ),
        EventKind::PlanItem(_) | EventKind::ItemReached(_) | EventKind::Home(_) => return None,
        EventKind::PlanComplete => (S::MAV_SEVERITY_INFO, "Mission complete".into()),
        EventKind::Terminated => {
            (S::MAV_SEVERITY_EMERGENCY, "Flight terminated: engine off, surfaces hard over".into())
        }
        EventKind::LinkLost(action) => {
            let action = match action {
                LinkLossAction::Continue => "the flight goes on",
                LinkLossAction::Hold => "Hold",
                LinkLossAction::Return => "Return",
            };
            (S::MAV_SEVERITY_WARNING, format!("Ground station lost: {action}"))
        }
        EventKind::LinkBack(mode) => {
            (S::MAV_SEVERITY_INFO, format!("Ground station is back: {mode}"))
        }
        EventKind::Paced(pace) => match pace {
            Pace::Pause => (S::MAV_SEVERITY_INFO, "Simulation paused".into()),
            Pace::Run => (S::MAV_SEVERITY_INFO, "Simulation runs".into()),
            Pace::Step(periods) => (S::MAV_SEVERITY_INFO, format!("Simulation steps: {periods}")),
            Pace::Speed(speed) => (S::MAV_SEVERITY_INFO, format!("Simulation speed: x{speed}")),
        },
    })
}

/// Importance and words of the end of the process.
#[must_use]
pub fn text_of_end(phase: Phase) -> (MavSeverity, &'static str) {
    match phase {
        Phase::Lost => {
            (MavSeverity::MAV_SEVERITY_CRITICAL, "The simulation ends: the plant does not answer")
        }
        _ => (MavSeverity::MAV_SEVERITY_INFO, "The simulation ends"),
    }
}

/// `, nozzle yaw at limit`; nothing where nothing is.
fn limits_text(limits: Limits) -> String {
    let names: Vec<&str> = limits.iter().map(Limit::name).collect();
    match &names[..] {
        [] => String::new(),
        [name] => format!(", {name} at limit"),
        [first @ .., last] => format!(", {} and {last} at limit", first.join(", ")),
    }
}

/// A fault that begins or ends. What is scheduled or cancelled is told with the answer to the order.
fn fault_text(entry: &FaultEntry, effectors: &EffectorList) -> Option<(MavSeverity, String)> {
    let FaultEntry { target, kind, timing, state, .. } = *entry;
    let kind = kind.described(target.class(effectors));
    let target = target.name(effectors);
    let cleared = format!("Cleared: {target} {kind}");
    Some(match state {
        FaultState::Active { since } => {
            let since_s = since.as_seconds();
            let text = format!("Injected: {target} {kind}, from {since_s} s{timing}");
            (MavSeverity::MAV_SEVERITY_WARNING, text)
        }
        FaultState::Ended { .. } => (MavSeverity::MAV_SEVERITY_INFO, cleared),
        FaultState::Resting { next, .. } => {
            let next_s = next.as_seconds();
            (MavSeverity::MAV_SEVERITY_INFO, format!("{cleared}, again at {next_s} s"))
        }
        FaultState::Scheduled { .. } | FaultState::Cancelled { .. } => return None,
    })
}

#[cfg(test)]
mod tests;
