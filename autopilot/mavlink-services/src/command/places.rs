//! Go somewhere and circle there; pause.

use super::fields::{airspeed, byte, flag, location, location_or_here, number, signed_radius};
use super::{Asking, Decision};
use crate::codec::CommandMessage;
use crate::context::Context;
use crate::refused::Refused;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::{Mode, Reposition, Rules};

/// MAV_DO_REPOSITION_FLAGS_CHANGE_MODE.
const CHANGE_MODE: u8 = 1;

/// DO_REPOSITION: p1 speed, p2 flags, p3 radius, p4 direction, p5 to p7 location. What is not given stays
/// as it is; without anything it means "circle here".
pub fn reposition(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [speed, flags, radius, direction, ..] = command.params;
    let flags = if flags.is_nan() { 0 } else { byte("flags p2", flags)? };
    let change_mode = flags & CHANGE_MODE != 0;
    if !change_mode && asking.ctx.aircraft.mode() != Mode::Hold {
        return Err(Refused::denied(
            "Reposition refused: it needs Hold, or bit 0 of p2 to change to it",
        ));
    }
    let radius_m = number("radius p3", radius)?.filter(|radius| *radius != 0.0);
    if radius_m.is_some_and(|radius| radius < 0.0) {
        return Err(Refused::denied(
            "Reposition refused: the radius p3 is negative; p4 = 1 turns left",
        ));
    }
    // Some ground stations send a yaw angle here: only the exact numbers mean a direction.
    let clockwise = match number("direction p4", direction)? {
        Some(0.0) => Some(true),
        Some(1.0) => Some(false),
        _ => None,
    };
    let target = location(command, asking.ctx)?;
    let airspeed_m_s = kept_or_airspeed(speed, asking.ctx)?;
    Ok(ask(
        Reposition {
            place: target.place,
            altitude_m: target.altitude_m,
            radius_m,
            clockwise,
            airspeed_m_s,
            change_mode,
        },
        asking.ctx,
    ))
}

/// A speed; below zero and NaN leave it as it is.
fn kept_or_airspeed(speed: f32, ctx: &Context) -> Result<Option<f64>, Refused> {
    let speed = number("speed", speed)?.filter(|speed| *speed >= 0.0);
    speed.map(|speed| airspeed(speed, ctx)).transpose()
}

/// DO_ORBIT: p1 radius, positive clockwise, p2 speed, p3 where the nose points (always along the circle),
/// p4 how far, p5 to p7 centre.
pub fn orbit(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [radius, speed, _, arc, ..] = command.params;
    let (radius_m, clockwise) = signed_radius("radius p1", radius)?;
    if number("p4", arc)?.is_some_and(|arc| arc != 0.0) {
        return Err(Refused::denied("Orbit refused: only without an end (p4 = 0)"));
    }
    let centre = location(command, asking.ctx)?;
    let airspeed_m_s = kept_or_airspeed(speed, asking.ctx)?;
    Ok(ask(
        Reposition {
            place: centre.place,
            altitude_m: centre.altitude_m,
            radius_m,
            clockwise,
            airspeed_m_s,
            change_mode: true,
        },
        asking.ctx,
    ))
}

/// NAV_LOITER_UNLIM: p3 radius, positive clockwise, p5 to p7 centre, zeros for "here".
pub fn loiter(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [_, _, radius, ..] = command.params;
    circle(command, radius, asking.ctx)
}

/// NAV_LOITER_TO_ALT: p2 radius, positive clockwise, p5 to p7 centre, zeros for "here". The aircraft stays.
pub fn loiter_to_altitude(
    command: &CommandMessage,
    asking: &mut Asking,
) -> Result<Decision, Refused> {
    let [_, radius, ..] = command.params;
    circle(command, radius, asking.ctx)
}

fn circle(command: &CommandMessage, radius: f32, ctx: &Context) -> Result<Decision, Refused> {
    let (radius_m, clockwise) = signed_radius("radius", radius)?;
    let centre = location_or_here(command, ctx)?;
    Ok(ask(
        Reposition {
            place: centre.place,
            altitude_m: centre.altitude_m,
            radius_m,
            clockwise,
            airspeed_m_s: None,
            change_mode: true,
        },
        ctx,
    ))
}

/// Asks for it; a circle that is too small for the airspeed is told of. In wind it becomes wider still.
fn ask(wanted: Reposition, ctx: &Context) -> Decision {
    let rules = Rules::new(ctx.parameters.limits, ctx.parameters.navigation, &ctx.parameters.gains);
    let now_m_s = ctx.aircraft.snapshot().map(|state| state.demand.airspeed_m_s);
    let least_m = wanted.airspeed_m_s.or(now_m_s).map(|speed| rules.smallest_circle_m(speed));
    let widened = wanted.radius_m.zip(least_m).filter(|(asked_m, least_m)| asked_m < least_m);
    let note = widened
        .map(|(asked_m, least_m)| format!("Radius {asked_m:.0} m is flown as {least_m:.0} m"));
    Decision::ask(VehicleCommand::Reposition(wanted)).noting(note)
}

/// DO_PAUSE_CONTINUE: p1 0 circles here, 1 goes on with a paused plan.
pub fn pause_or_continue(command: &CommandMessage, _: &mut Asking) -> Result<Decision, Refused> {
    if !flag("p1", command.params[0])? {
        return Ok(Decision::ask(VehicleCommand::Reposition(Reposition {
            change_mode: true,
            ..Reposition::default()
        })));
    }
    Ok(Decision::ask(VehicleCommand::Continue))
}
