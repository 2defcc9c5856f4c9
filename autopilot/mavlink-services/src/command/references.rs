//! Altitude, speed and course references.

use super::fields::{above_ellipsoid, airspeed, byte, number, unused_rate, within};
use super::{Asking, Decision};
use crate::codec::CommandMessage;
use crate::context::Context;
use crate::convert;
use crate::refused::Refused;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Reference;

/// SPEED_TYPE.
const AIRSPEED: u8 = 0;
const GROUND_SPEED: u8 = 1;
/// HEADING_TYPE.
const COURSE: u8 = 0;
const HEADING: u8 = 1;
const HEADING_DEFAULT: u8 = 2;
/// "No change" and "back to the default" in DO_CHANGE_SPEED.
const NO_CHANGE: f32 = -1.0;
const DEFAULT: f32 = -2.0;

/// What is said when a ground speed was asked for.
const GROUND_SPEED_NOTE: &str = "A ground speed is flown as airspeed: wind is not corrected";

/// DO_CHANGE_ALTITUDE: p1 altitude, p2 frame.
pub fn change_altitude(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [altitude, frame, ..] = command.params;
    refer_altitude(altitude, byte("frame p2", frame)?, asking.ctx)
}

/// GUIDED_CHANGE_ALTITUDE: p3 rate, p7 altitude in the frame of the COMMAND_INT.
pub fn guided_altitude(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [_, _, rate, _, _, _, altitude] = command.params;
    let has_rate = unused_rate("the rate p3", rate)?;
    let decision = refer_altitude(altitude, command.frame.unwrap_or(0), asking.ctx)?;
    let note = "The rate is not used: ALT_ERR_MAX sets the climb rate";
    Ok(decision.noting(has_rate.then(|| note.to_owned())))
}

fn refer_altitude(altitude: f32, frame: u8, ctx: &Context) -> Result<Decision, Refused> {
    // Of this command the altitude is all, so that it must be there.
    let altitude_m = above_ellipsoid(convert::decimal(altitude), frame, ctx)?;
    Ok(Decision::ask(VehicleCommand::Refer(Reference::Altitude(altitude_m))))
}

/// DO_CHANGE_SPEED: p1 type, p2 speed, p3 throttle, p4 relative (once, now reserved).
pub fn change_speed(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [kind, speed, throttle, relative, ..] = command.params;
    let note = speed_note(kind)?;
    // MAVProxy sends 0 for "no throttle given", QGroundControl -1, MAVSDK NaN.
    if throttle > 0.0 || throttle.is_infinite() {
        return Err(Refused::denied("Speed refused: there is no throttle reference (p3)"));
    }
    if !relative.is_nan() && relative != 0.0 {
        return Err(Refused::denied("Speed refused: only an absolute speed (p4 = 0)"));
    }
    if speed == DEFAULT {
        return Err(Refused::denied("Speed refused: there is no default speed (p2 = -2)"));
    }
    if speed.is_nan() || speed == NO_CHANGE {
        return Ok(Decision::accept());
    }
    refer_airspeed(speed, note, asking.ctx)
}

/// GUIDED_CHANGE_SPEED: p1 type, p2 speed, p3 rate.
pub fn guided_speed(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [kind, speed, rate, ..] = command.params;
    let mut note = speed_note(kind)?;
    if unused_rate("the rate p3", rate)? {
        let rate_note = "The rate is not used: the engine sets the acceleration";
        note = Some(note.map_or(rate_note.into(), |note| format!("{note}. {rate_note}")));
    }
    refer_airspeed(speed, note, asking.ctx)
}

fn speed_note(kind: f32) -> Result<Option<String>, Refused> {
    match byte("type of speed p1", kind)? {
        AIRSPEED => Ok(None),
        GROUND_SPEED => Ok(Some(GROUND_SPEED_NOTE.into())),
        other => Err(Refused::denied(format!(
            "Speed refused: type p1 = {other} is not 0 airspeed or 1 ground speed"
        ))),
    }
}

fn refer_airspeed(speed: f32, note: Option<String>, ctx: &Context) -> Result<Decision, Refused> {
    let airspeed_m_s = airspeed(convert::decimal(speed), ctx)?;
    Ok(Decision::ask(VehicleCommand::Refer(Reference::Airspeed(airspeed_m_s))).noting(note))
}

/// GUIDED_CHANGE_HEADING: p1 type, p2 heading, p3 rate.
pub fn guided_heading(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [kind, heading, rate, ..] = command.params;
    let mut notes = Vec::new();
    match byte("type of heading p1", kind)? {
        COURSE | HEADING_DEFAULT => {}
        HEADING => notes.push("A heading is flown as course over the ground"),
        other => {
            return Err(Refused::denied(format!(
                "Heading refused: type p1 = {other} is not 0 course, 1 heading or 2 default"
            )));
        }
    }
    if unused_rate("the rate p3", rate)? {
        notes.push("The rate is not used: the bank angle has its own limit");
    }
    let Some(degrees) = number("heading p2", heading)? else {
        return Err(Refused::denied("Heading refused: no heading (p2)"));
    };
    if !(0.0..=360.0).contains(&degrees) {
        return Err(Refused::denied(format!(
            "Heading refused: {degrees} deg is outside 0 to 360 deg"
        )));
    }
    let course = Reference::Course(convert::radians(degrees % 360.0));
    within(course, asking.ctx)?;
    let note = (!notes.is_empty()).then(|| notes.join(". "));
    Ok(Decision::ask(VehicleCommand::Refer(course)).noting(note))
}
