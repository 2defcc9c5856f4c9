//! Altitude, speed and course references.

use crate::codec::{CommandError, CommandMessage};
use crate::command::fields::{
    above_ellipsoid, airspeed, byte, ground_speed, number, unused_rate, within,
};
use crate::command::{Caller, Decision};
use crate::{Shared, convert};
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Reference;

const AIRSPEED: u8 = 0;
const GROUND_SPEED: u8 = 1;
const COURSE: u8 = 0;
const HEADING: u8 = 1;
const HEADING_DEFAULT: u8 = 2;
/// "No change" and "back to the default" in DO_CHANGE_SPEED.
const NO_CHANGE: f32 = -1.0;
const DEFAULT: f32 = -2.0;

/// The note on a ground speed.
const GROUND_SPEED_NOTE: &str = "A ground speed is flown as true airspeed: wind is not corrected";

/// DO_CHANGE_ALTITUDE: p1 altitude, p2 frame.
pub fn change_altitude(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [altitude, frame, ..] = command.params;
    refer_altitude(altitude, byte("frame p2", frame)?, caller.shared)
}

/// GUIDED_CHANGE_ALTITUDE: p3 rate, p7 altitude in the frame of the COMMAND_INT.
pub fn guided_altitude(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [_, _, rate, _, _, _, altitude] = command.params;
    let has_rate = unused_rate("the rate p3", rate)?;
    let decision = refer_altitude(altitude, command.frame.unwrap_or(0), caller.shared)?;
    let note = "The rate is not used: ALT_ERR_MAX sets the climb rate";
    Ok(decision.with_note(has_rate.then(|| note.to_owned())))
}

fn refer_altitude(altitude: f32, frame: u8, shared: &Shared) -> Result<Decision, CommandError> {
    // Altitude is the only content of this command, so it must be given.
    let altitude_m = above_ellipsoid(convert::decimal(altitude), frame, shared)?;
    Ok(Decision::pass_on(VehicleCommand::Refer(Reference::Altitude(altitude_m))))
}

/// DO_CHANGE_SPEED: p1 type, p2 speed, p3 throttle, p4 relative (once, now reserved).
pub fn change_speed(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [kind, speed, throttle, relative, ..] = command.params;
    let kind = speed_kind(kind)?;
    // MAVProxy sends 0 for "no throttle given", QGroundControl -1, MAVSDK NaN.
    if throttle > 0.0 || throttle.is_infinite() {
        return Err(CommandError::denied("Speed refused: there is no throttle reference (p3)"));
    }
    if !relative.is_nan() && relative != 0.0 {
        return Err(CommandError::denied("Speed refused: only an absolute speed (p4 = 0)"));
    }
    if speed == DEFAULT {
        return Err(CommandError::denied("Speed refused: there is no default speed (p2 = -2)"));
    }
    if speed.is_nan() || speed == NO_CHANGE {
        return Ok(Decision::accept());
    }
    refer_airspeed(speed, kind, None, caller.shared)
}

/// GUIDED_CHANGE_SPEED: p1 type, p2 speed, p3 rate.
pub fn guided_speed(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [kind, speed, rate, ..] = command.params;
    let kind = speed_kind(kind)?;
    let has_rate = unused_rate("the rate p3", rate)?;
    let note = "The rate is not used: the engine sets the acceleration";
    refer_airspeed(speed, kind, has_rate.then_some(note), caller.shared)
}

fn speed_kind(kind: f32) -> Result<u8, CommandError> {
    match byte("type of speed p1", kind)? {
        kind @ (AIRSPEED | GROUND_SPEED) => Ok(kind),
        other => Err(CommandError::denied(format!(
            "Speed refused: type p1 = {other} is not 0 airspeed or 1 ground speed"
        ))),
    }
}

fn refer_airspeed(
    speed: f32,
    kind: u8,
    note: Option<&str>,
    shared: &Shared,
) -> Result<Decision, CommandError> {
    let speed = convert::decimal(speed);
    let (airspeed_m_s, ground) = match kind {
        GROUND_SPEED => (ground_speed(speed, shared)?, Some(GROUND_SPEED_NOTE)),
        _ => (airspeed(speed, shared)?, None),
    };
    let notes: Vec<&str> = ground.into_iter().chain(note).collect();
    let note = (!notes.is_empty()).then(|| notes.join(". "));
    Ok(Decision::pass_on(VehicleCommand::Refer(Reference::Airspeed(airspeed_m_s))).with_note(note))
}

/// GUIDED_CHANGE_HEADING: p1 type, p2 heading, p3 rate.
pub fn guided_heading(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [kind, heading, rate, ..] = command.params;
    let mut notes = Vec::new();
    match byte("type of heading p1", kind)? {
        COURSE | HEADING_DEFAULT => {}
        HEADING => notes.push("A heading is flown as course over the ground"),
        other => {
            return Err(CommandError::denied(format!(
                "Heading refused: type p1 = {other} is not 0 course, 1 heading or 2 default"
            )));
        }
    }
    if unused_rate("the rate p3", rate)? {
        notes.push("The rate is not used: the bank angle has its own limit");
    }
    let Some(degrees) = number("heading p2", heading)? else {
        return Err(CommandError::denied("Heading refused: no heading (p2)"));
    };
    if !(0.0..=360.0).contains(&degrees) {
        return Err(CommandError::denied(format!(
            "Heading refused: {degrees} deg is outside 0 to 360 deg"
        )));
    }
    let course = Reference::Course(convert::radians(degrees % 360.0));
    within(course, caller.shared)?;
    let note = (!notes.is_empty()).then(|| notes.join(". "));
    Ok(Decision::pass_on(VehicleCommand::Refer(course)).with_note(note))
}
