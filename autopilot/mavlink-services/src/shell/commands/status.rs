//! `status`: the flight, the references, the compensator, the effectors.

use std::fmt::Write as _;

use flight_control::CompensatorMode;
use icd::EffectorList;
use icd::sensors::SensorKind;

use crate::Shared;
use crate::aircraft::{Aircraft, Phase};
use crate::shell::commands::{Answer, Output, usage};
use crate::wall_time::WallTime;
use flight_management::event::{Axis, Snapshot};
use flight_management::event_text::verdict_text;

pub(super) fn run(arguments: &[&str], _: WallTime, shared: &mut Shared) -> Answer {
    if !arguments.is_empty() {
        return Err(usage("status"));
    }
    let shared = &shared;
    let mut text = String::new();
    let _ = writeln!(text, "Aircraft: {}", phase(&shared.aircraft));
    let holder =
        shared.control.holder().map_or("nobody".into(), |system| format!("system {system}"));
    let _ = writeln!(text, "Control: {holder}");
    if let Some(state) = shared.aircraft.snapshot() {
        flight(&mut text, state, &shared.aircraft);
        compensator(&mut text, state, shared.parameters.gains.selection.compensator);
        isolation(&mut text, state, shared.effectors());
        effectors(&mut text, state, shared.effectors());
    }
    if let Some(script) = shared.scripts.running() {
        let _ = writeln!(text, "Script: {} runs", script.name());
    }
    text.push_str(&super::faults(shared));
    Ok(Output::text(text))
}

fn phase(aircraft: &Aircraft) -> &'static str {
    match (aircraft.phase(), aircraft.is_terminated()) {
        (Phase::NoFlight, _) => "none is connected",
        (Phase::Flying, false) => "in the air",
        (Phase::Flying, true) => "in the air, flight terminated",
        (Phase::OnGround, _) => "on the ground, the flight is over",
        (Phase::Lost, _) => "lost, no packet for a second",
    }
}

fn flight(text: &mut String, state: &Snapshot, aircraft: &Aircraft) {
    let (motion, demand) = (state.motion(), &state.demand);
    let euler = motion.attitude;
    let velocity = motion.velocity.0;
    let course = libm::atan2(velocity.y, velocity.x).to_degrees().rem_euclid(360.0);
    let _ = writeln!(text, "Time: {}, mode {}", state.time, aircraft.mode());
    let alive = state.motion().alive(&state.sensors);
    let dead = SensorKind::ALL.into_iter().zip(alive).filter(|(_, alive)| !alive);
    let dead: Vec<&str> = dead.map(|(sensor, _)| sensor.name()).collect();
    if !dead.is_empty() {
        let _ = writeln!(text, "Without valid samples: {}", dead.join(", "));
    }
    let _ = writeln!(
        text,
        "Position: {} deg, {} deg, altitude {} m",
        fixed(5, motion.latitude_rad.to_degrees()),
        fixed(5, motion.longitude_rad.to_degrees()),
        fixed(1, motion.altitude_m)
    );
    let _ = writeln!(
        text,
        "Motion: true airspeed {} m/s, climb {} m/s, course {} deg",
        fixed(1, motion.airspeed_m_s),
        fixed(1, motion.climb_rate_m_s()),
        fixed(1, course)
    );
    let _ = writeln!(
        text,
        "Attitude: roll {} deg, pitch {} deg, yaw {} deg",
        fixed(1, euler.phi.to_degrees()),
        fixed(1, euler.theta.to_degrees()),
        fixed(1, euler.psi.to_degrees().rem_euclid(360.0))
    );
    let _ = writeln!(
        text,
        "References: altitude {} m, true airspeed {} m/s, roll {} deg",
        fixed(1, demand.altitude_m),
        fixed(1, demand.airspeed_m_s),
        fixed(1, demand.roll_rad.to_degrees())
    );
}

fn compensator(text: &mut String, state: &Snapshot, mode: CompensatorMode) {
    let log = &state.log;
    let mode = match mode {
        CompensatorMode::Off => "off",
        CompensatorMode::Armed => "armed",
        CompensatorMode::AlwaysOn => "always on",
    };
    let seen = if log.compensator_active { "a fault is seen" } else { "no fault is seen" };
    let _ = writeln!(text, "Compensator: {mode}, {seen}, fade {}", fixed(2, log.fade));
    let _ = writeln!(text, "axis   estimate rad/s^2   level  authority");
    for (axis, z2, level) in [
        (Axis::Roll, log.z2.x, log.levels.x),
        (Axis::Pitch, log.z2.y, log.levels.y),
        (Axis::Yaw, log.z2.z, log.levels.z),
    ] {
        let left = axis.authority_pct(&log.authority);
        let (z2, level, left) = (fixed(4, z2), fixed(2, level), fixed(0, left));
        let _ = writeln!(text, "{:<6} {z2:>16} {level:>7} {left:>8} %", axis.name());
    }
}

fn isolation(text: &mut String, state: &Snapshot, list: &EffectorList) {
    let verdict = state.log.isolation.verdict.as_ref();
    let verdict = verdict.map_or("no effector is named".into(), |v| verdict_text(v, list));
    let _ = writeln!(text, "Isolation: {verdict}");
}

fn effectors(text: &mut String, state: &Snapshot, list: &EffectorList) {
    let log = &state.log;
    let _ = writeln!(text, "effector         command   modelled");
    for effector in list.all() {
        let largest = log.commands[effector].abs().max(log.modelled[effector].abs());
        let (scale, unit) = list.shown_unit(effector, largest);
        let commanded = fixed(2, log.commands[effector] * scale);
        let modelled = fixed(2, log.modelled[effector] * scale);
        let limit = if log.limited.contains(effector) { "  at its limit" } else { "" };
        let _ = writeln!(
            text,
            "{:<14} {commanded:>9}  {modelled:>9} {unit}{limit}",
            list.name(effector)
        );
    }
}

/// With this many decimal places; zero has no sign.
fn fixed(digits: usize, value: f64) -> String {
    let text = format!("{value:.digits$}");
    let is_zero = |digits: &&str| digits.bytes().all(|byte| matches!(byte, b'0' | b'.'));
    match text.strip_prefix('-').filter(is_zero) {
        Some(zero) => zero.to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::fixed;

    #[test]
    fn a_zero_has_no_sign_and_everything_else_keeps_it() {
        for (digits, value, text) in [
            (2, -0.004, "0.00"),
            (0, -0.0, "0"),
            (2, -0.006, "-0.01"),
            (1, -10.0, "-10.0"),
            (1, 3.0, "3.0"),
            (1, f64::NAN, "NaN"),
        ] {
            assert_eq!(fixed(digits, value), text, "{value}");
        }
    }
}
