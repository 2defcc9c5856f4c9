//! `status`: the flight, the references, the compensator, the effectors.

use std::fmt::Write as _;

use flight_control::CompensatorMode;
use icd::Effector;

use super::{Answer, Asking, Order, list, usage};
use crate::event::{Axis, Snapshot};
use crate::mavlink::aircraft::{Aircraft, Phase};
use crate::mavlink::telemetry::is_saturated;

pub(super) fn run(arguments: &[&str], asking: &mut Asking) -> Answer {
    if !arguments.is_empty() {
        return Err(usage("status"));
    }
    let ctx = &asking.ctx;
    let mut said = String::new();
    let _ = writeln!(said, "Aircraft: {}", phase(ctx.aircraft));
    let holder = ctx.control.holder().map_or("nobody".into(), |system| format!("system {system}"));
    let _ = writeln!(said, "Control: {holder}");
    if let Some(state) = ctx.aircraft.snapshot() {
        flight(&mut said, state, ctx.aircraft);
        compensator(&mut said, state, ctx.parameters.gains.selection.compensator);
        effectors(&mut said, state);
    }
    said.push_str(&list::text(asking));
    Ok(Order::say(said))
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

fn flight(said: &mut String, state: &Snapshot, aircraft: &Aircraft) {
    let (sensors, demand) = (&state.sensors, &state.demand);
    let euler = sensors.attitude.euler();
    let velocity = sensors.velocity.0;
    let course = libm::atan2(velocity.y, velocity.x).to_degrees().rem_euclid(360.0);
    let _ = writeln!(said, "Time: {}, mode {}", state.time, aircraft.mode());
    let _ = writeln!(
        said,
        "Position: {:.5} deg, {:.5} deg, altitude {:.1} m",
        sensors.latitude_rad.to_degrees(),
        sensors.longitude_rad.to_degrees(),
        sensors.altitude_m
    );
    let _ = writeln!(
        said,
        "Motion: airspeed {:.1} m/s, climb {:.1} m/s, course {course:.1} deg",
        sensors.airspeed_m_s, -velocity.z
    );
    let _ = writeln!(
        said,
        "Attitude: roll {:.1} deg, pitch {:.1} deg, yaw {:.1} deg",
        euler.phi.to_degrees(),
        euler.theta.to_degrees(),
        euler.psi.to_degrees().rem_euclid(360.0)
    );
    let _ = writeln!(
        said,
        "References: altitude {:.1} m, airspeed {:.1} m/s, roll {:.1} deg",
        demand.altitude_m,
        demand.airspeed_m_s,
        demand.roll_rad.to_degrees()
    );
}

fn compensator(said: &mut String, state: &Snapshot, mode: CompensatorMode) {
    let log = &state.log;
    let mode = match mode {
        CompensatorMode::Off => "off",
        CompensatorMode::Armed => "armed",
        CompensatorMode::AlwaysOn => "always on",
    };
    let seen = if log.compensator_active { "a fault is seen" } else { "no fault is seen" };
    let _ = writeln!(said, "Compensator: {mode}, {seen}, fade {:.2}", log.fade);
    let _ = writeln!(said, "axis   estimate rad/s^2   level  authority");
    for (axis, z2, level) in [
        (Axis::Roll, log.z2.x, log.levels.x),
        (Axis::Pitch, log.z2.y, log.levels.y),
        (Axis::Yaw, log.z2.z, log.levels.z),
    ] {
        let left = axis.authority_pct(&log.authority);
        let _ = writeln!(said, "{:<6} {z2:>16.4} {level:>7.2} {left:>8.0} %", axis.name());
    }
}

fn effectors(said: &mut String, state: &Snapshot) {
    let log = &state.log;
    let _ = writeln!(said, "effector         command   modelled");
    for effector in Effector::ALL {
        let (scale, unit) =
            if effector.is_angle() { (1.0_f64.to_degrees(), "deg") } else { (1.0e-3, "kN") };
        let (told, modelled) = (log.commands[effector] * scale, log.modelled[effector] * scale);
        let limit = if is_saturated(&log.health, effector) { "  at its limit" } else { "" };
        let _ =
            writeln!(said, "{:<14} {told:>9.2}  {modelled:>9.2} {unit}{limit}", effector.name());
    }
}
