//! The text of each event, and its severity.
//!
//! CRITICAL is for what a pilot must see at once: QGroundControl opens its banner for ERROR and worse, shows WARNING
//! and NOTICE in orange, and the rest plainly. So good news and answers are INFO.

use flight_control::CompensatorMode;
use flight_control::isolation::{Verdict, evidence::Behaviour};
use icd::EffectorList;
use icd::fault::{FaultEntry, FaultState};
use icd::pace::Pace;
use icd::sensors::SensorKind;

use crate::event::{EventKind, Limit, Limits};
use crate::parameters::Parameters;
use crate::script::{NotBegun, Script, ScriptEvent};
use crate::vehicle::failsafe::{Failsafe, FuelLevel};
use crate::vehicle::fence::{Breach, FenceChange};
use crate::vehicle::{LinkLossAction, VehicleEvent};
use Severity::{Critical, Emergency, Info, Warning};

/// Importance of a text, with the numbers of syslog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The flight is over.
    Emergency = 0,
    /// A pilot must see it at once.
    Critical = 2,
    /// A state has become worse.
    Warning = 4,
    /// Good news and answers.
    Info = 6,
}

/// Severity and text of an event; `None` where it has none here. The events of scripts need the script: [`of_script`].
pub fn of_event(
    kind: &EventKind,
    parameters: &Parameters,
    effectors: &EffectorList,
) -> Option<(Severity, String)> {
    let compensator_off = parameters.gains.selection.compensator == CompensatorMode::Off;
    Some(match *kind {
        EventKind::Outcome { .. } | EventKind::Script { .. } => return None,
        EventKind::FlightBegan { joined_in_flight: false } => (Info, "Flight began".into()),
        EventKind::FlightBegan { joined_in_flight: true } => {
            (Info, "Joined a flight under way".into())
        }
        EventKind::Vehicle(event) => return vehicle_text(event),
        EventKind::CompensatorActive { axis, .. } if compensator_off => {
            (Critical, format!("Fault detected: {} (compensator off)", axis.key()))
        }
        EventKind::CompensatorActive { axis, at_limit } => {
            (Critical, format!("Compensator active: {}{}", axis.key(), limits_text(at_limit)))
        }
        EventKind::CompensatorReleased { .. } if compensator_off => {
            (Info, "Fault no longer detected".into())
        }
        EventKind::CompensatorReleased { after } => {
            (Info, format!("Compensator released after {:.1} s", after.as_secs_f64()))
        }
        EventKind::AuthorityExhausted { axis, by } => {
            let by = match by {
                Limit::Thrust => "too little thrust".into(),
                limit => format!("{} at limit", limit.key()),
            };
            // The banner of the compensator is there already, or no fault is seen.
            (Warning, format!("No authority left: {}, {by}", axis.key()))
        }
        EventKind::AuthorityRestored(axis) => (Info, format!("Authority restored: {}", axis.key())),
        EventKind::Saturated(limit) => {
            // Full or idle thrust is normal in a climb, a descent or after a change of speed.
            let is_normal = limit == Limit::Thrust;
            let severity = if is_normal { Info } else { Warning };
            (severity, format!("Saturated: {}", limit.key()))
        }
        EventKind::SaturationEnded(limit) => {
            (Info, format!("No longer saturated: {}", limit.key()))
        }
        EventKind::AltitudeNotHeld(limit) => {
            (Warning, format!("Altitude not held: {} at its limit", limit.key()))
        }
        EventKind::AltitudeHeld => (Info, "Altitude held again".into()),
        EventKind::ThrustFloorTaken => {
            (Warning, "Thrust floor: the compensation needs the thrust".into())
        }
        EventKind::ThrustFloorReleased => (Info, "Thrust floor no longer needed".into()),
        EventKind::CompensatorYields => {
            (Warning, "Compensator yields: its action oscillates".into())
        }
        EventKind::CompensatorResumes => (Info, "Compensator acts in full again".into()),
        EventKind::Isolated(ref verdict) => {
            (Warning, format!("Isolated: {}", verdict_text(verdict, effectors)))
        }
        EventKind::IsolationWithdrawn => (Info, "Isolation: no effector is named now".into()),
        EventKind::SensorLost(sensor) => (Warning, format!("{} lost", sensor_text(sensor))),
        EventKind::SensorBack(sensor) => (Info, format!("{} is back", sensor_text(sensor))),
        EventKind::Fault(ref entry) => return fault_text(entry, effectors),
        EventKind::GroundContact => (Emergency, "Ground contact: the flight is over".into()),
        EventKind::PlantLost => (Warning, "Plant link lost: simulation time stands still".into()),
        EventKind::LogRemoved => (Warning, "Flight log was removed: not recording".into()),
        EventKind::PlantBack => (Info, "Plant link is back".into()),
        EventKind::EventsLost(lost) => {
            (Warning, format!("{lost} events were lost: fault list refreshed"))
        }
        EventKind::Paced(pace) => match pace {
            Pace::Pause => (Info, "Simulation paused".into()),
            Pace::Run => (Info, "Simulation runs".into()),
            Pace::Step(periods) => (Info, format!("Simulation steps: {periods}")),
            Pace::Speed(speed) => (Info, format!("Simulation speed: x{speed}")),
        },
    })
}

/// Reports of the vehicle.
fn vehicle_text(event: VehicleEvent) -> Option<(Severity, String)> {
    Some(match event {
        VehicleEvent::Mode(mode) => (Info, format!("Mode {mode}")),
        // Ground stations get messages of their own for these.
        VehicleEvent::PlanItem(_)
        | VehicleEvent::ItemReached(_)
        | VehicleEvent::ItemPassed(_)
        | VehicleEvent::Home(_) => return None,
        VehicleEvent::Fence(FenceChange::Breached(breach)) => {
            let how = match breach {
                Breach::Outside => "outside of every inclusion area",
                Breach::Exclusion => "in an exclusion area",
                Breach::High => "above GF_MAX_VER_DIST",
                Breach::Low => "below GF_MIN_VER_DIST",
            };
            (Critical, format!("Fence breached: {how}"))
        }
        VehicleEvent::Fence(FenceChange::Back) => (Info, "Back inside the fence".into()),
        VehicleEvent::Failsafe { failsafe, is_there } => failsafe_text(failsafe, is_there),
        VehicleEvent::PlanComplete => (Info, "Mission complete".into()),
        VehicleEvent::Terminated => {
            (Emergency, "Flight terminated: engine off, surfaces hard over".into())
        }
        VehicleEvent::Armed(true) => (Info, "Armed".into()),
        VehicleEvent::Armed(false) => (Info, "Disarmed".into()),
        VehicleEvent::LiftOff => (Info, "Takeoff: in the air".into()),
        VehicleEvent::TouchDown => (Info, "Touchdown".into()),
        VehicleEvent::GoAround => (Warning, "Go-around: the approach was not stable".into()),
        VehicleEvent::TakeoffAborted => (Warning, "Takeoff aborted".into()),
        VehicleEvent::LinkLost(action) => {
            let action = match action {
                LinkLossAction::Continue => "the flight goes on",
                LinkLossAction::Hold => "Hold",
                LinkLossAction::Return => "Return",
            };
            (Warning, format!("Ground station lost: {action}"))
        }
        VehicleEvent::LinkBack(mode) => (Info, format!("Ground station is back: {mode}")),
    })
}

fn failsafe_text(failsafe: Failsafe, is_there: bool) -> (Severity, String) {
    let (begins, ends) = match failsafe {
        Failsafe::PositionLost => ("Position lost: circling", "Position is back"),
        Failsafe::EngineFailed => ("Engine failed: gliding", "Engine is back"),
        Failsafe::Fuel(FuelLevel::Enough | FuelLevel::Low) => ("Fuel low", "Fuel no longer low"),
        Failsafe::Fuel(FuelLevel::Critical) => ("Fuel critical", "Fuel no longer critical"),
        Failsafe::Fuel(FuelLevel::Emergency) => ("Fuel almost gone", "Fuel no longer almost gone"),
    };
    if is_there { (Critical, begins.into()) } else { (Info, ends.into()) }
}

/// `left elevator stuck at 30.0 deg, 97 %`.
pub fn verdict_text(verdict: &Verdict, effectors: &EffectorList) -> String {
    let each = verdict.effectors.into_iter().zip(verdict.values).filter_map(|(effector, value)| {
        let name = effectors.name(effector?);
        // Without minus zero.
        let deg = (10.0 * value.to_degrees()).round() / 10.0 + 0.0;
        let how = match verdict.behaviour {
            Behaviour::Stuck => format!("stuck at {deg:.1} deg"),
            Behaviour::Reduced => format!("has {:.0} % of its effect", 100.0 * value),
            Behaviour::Biased => format!("off by {deg:.1} deg"),
            Behaviour::Irregular => "moves by itself".into(),
        };
        Some(format!("{name} {how}"))
    });
    let each: Vec<String> = each.collect();
    // Never certain.
    format!("{}, {:.0} %", each.join(" and "), (100.0 * verdict.confidence).floor().min(99.0))
}

/// What a pilot misses without a sensor.
fn sensor_text(sensor: SensorKind) -> &'static str {
    match sensor {
        SensorKind::Gyro => "Gyro",
        SensorKind::Accelerometer => "Accelerometer",
        SensorKind::Attitude => "Attitude unit",
        SensorKind::Gnss => "GNSS",
        SensorKind::Barometer => "Barometer",
        SensorKind::Pitot => "Airspeed",
        SensorKind::Vanes => "Vanes",
        SensorKind::EngineMonitor => "Engine monitor",
        SensorKind::Magnetometer => "Magnetometer",
        SensorKind::RadarAltimeter => "Radar altimeter",
        SensorKind::WeightOnWheels => "Weight on wheels",
        SensorKind::FuelGauge => "Fuel gauge",
    }
}

/// `, nozzle yaw at limit`; empty if there is no limit.
fn limits_text(limits: Limits) -> String {
    let names: Vec<&str> = limits.iter().map(Limit::key).collect();
    match &names[..] {
        [] => String::new(),
        [name] => format!(", {name} at limit"),
        [first @ .., last] => format!(", {} and {last} at limit", first.join(", ")),
    }
}

/// A fault that begins or ends. The answer to the request reports scheduled and cancelled faults.
fn fault_text(entry: &FaultEntry, effectors: &EffectorList) -> Option<(Severity, String)> {
    let FaultEntry { target, kind, timing, state, .. } = *entry;
    let kind = kind.described(target.class(effectors));
    let target = target.name(effectors);
    let cleared = format!("Cleared: {target} {kind}");
    Some(match state {
        FaultState::Active { since } => {
            let since_s = since.as_seconds();
            let text = format!("Injected: {target} {kind}, from {since_s} s{timing}");
            (Warning, text)
        }
        FaultState::Ended { .. } => (Info, cleared),
        FaultState::Resting { next, .. } => {
            let next_s = next.as_seconds();
            (Info, format!("{cleared}, again at {next_s} s"))
        }
        FaultState::Scheduled { .. } | FaultState::Cancelled { .. } => return None,
    })
}

/// Severity and text of a script event; `script` is unknown if it was uploaded before this process began.
pub fn of_script(script: Option<&Script>, event: ScriptEvent) -> (Severity, String) {
    let name = script.map_or("?", Script::name);
    let words = |number: u16| {
        let line = script.and_then(|script| script.line(number));
        line.map_or("", |line| line.text.as_str())
    };
    match event {
        ScriptEvent::Began => (Info, format!("Script began: {name}")),
        ScriptEvent::NotBegun(NotBegun::JoinedInFlight) => {
            (Warning, format!("Script not begun: {name}, the flight was under way"))
        }
        ScriptEvent::NotBegun(NotBegun::FaultInjectionOff) => {
            let why = "it has faults, and fault injection is off (SYS_FAILURE_EN 0)";
            (Warning, format!("Script not begun: {name}, {why}"))
        }
        ScriptEvent::Line(line) => match script.and_then(|script| script.line(line)?.words()) {
            Some(text) => (Info, format!("Script: {text}")),
            None => (Info, format!("Script {line}: {}", words(line))),
        },
        ScriptEvent::LineRefused { line, why } => {
            let none = EffectorList::default();
            let why = why.described(script.map_or(&none, Script::effectors));
            let text = format!("Script {line} refused: {why} ({})", words(line));
            (Warning, text)
        }
        ScriptEvent::Done => (Info, format!("Script done: {name}")),
        ScriptEvent::Stopped => (Info, format!("Script stopped: {name}")),
    }
}

#[cfg(test)]
mod tests;
