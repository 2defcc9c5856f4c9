//! Parameters of commands: finite numbers in range, or a reason.

use ::mavlink::dialects::common::MavResult;

use crate::Shared;
use crate::codec::{CommandError, CommandMessage};
use crate::convert;
use flight_management::vehicle::{Airspeed, Place, Reference, VehicleRefusal};

/// MAV_FRAME of altitudes above mean sea level (the ellipsoid here).
const FRAMES_SEA_LEVEL: [u8; 2] = [0, 5];
/// MAV_FRAME of altitudes above home. Home is on the ground, and the ground is at altitude zero.
const FRAMES_ABOVE_HOME: [u8; 2] = [3, 6];
/// MAV_FRAME_GLOBAL, the frame of a COMMAND_LONG.
const FRAME_GLOBAL: u8 = 0;
/// "Not given" in x and y of a COMMAND_INT.
const NOT_GIVEN: i32 = i32::MAX;

/// A parameter that encodes a small whole number.
pub fn byte(what: &str, value: f32) -> Result<u8, CommandError> {
    if value.fract() == 0.0 && (0.0..=255.0).contains(&value) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as just checked"
        )]
        return Ok(value as u8);
    }
    Err(CommandError::denied(format!("Refused: {what} {value} is no whole number of 0 to 255")))
}

/// A parameter that encodes a whole number of up to 16 bits; NaN is "not given".
pub fn word(what: &str, value: f32) -> Result<Option<u16>, CommandError> {
    if value.is_nan() {
        return Ok(None);
    }
    if value.fract() == 0.0 && (0.0..=65_535.0).contains(&value) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as just checked"
        )]
        return Ok(Some(value as u16));
    }
    Err(CommandError::denied(format!("Refused: {what} {value} is no whole number of 0 to 65535")))
}

/// A parameter that is 0 or 1.
pub fn flag(what: &str, value: f32) -> Result<bool, CommandError> {
    if value == 0.0 {
        Ok(false)
    } else if value == 1.0 {
        Ok(true)
    } else {
        Err(CommandError::denied(format!("Refused: {what} = {value} is not 0 or 1")))
    }
}

/// A number, with NaN for "not given".
pub fn number(what: &str, value: f32) -> Result<Option<f64>, CommandError> {
    if value.is_infinite() {
        return Err(CommandError::denied(format!("Refused: {what} is not finite")));
    }
    Ok((!value.is_nan()).then(|| convert::decimal(value)))
}

/// A rate of change, which the aircraft does not follow: whether the command gives one.
pub fn unused_rate(what: &str, value: f32) -> Result<bool, CommandError> {
    if value.is_infinite() || value < 0.0 {
        return Err(CommandError::denied(format!("Refused: {what} {value} is no rate")));
    }
    Ok(value > 0.0)
}

/// Target point of a command; NaN, or the largest integer in a COMMAND_INT, leaves a value unchanged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// Both coordinates or neither.
    pub place: Option<Place>,
    /// Altitude above the ellipsoid, m, within the limits.
    pub altitude_m: Option<f64>,
}

/// The location in parameters 5 to 7.
///
/// # Errors
/// A frame without altitudes above sea level or home, one coordinate without the other, values outside
/// the Earth or the limits of the references.
pub fn location(command: &CommandMessage, shared: &Shared) -> Result<Location, CommandError> {
    let [_, _, _, _, _, _, z] = command.params;
    let place = place(command)?;
    let altitude_m = number("altitude p7", z)?
        .map(|altitude| above_ellipsoid(altitude, command.frame.unwrap_or(FRAME_GLOBAL), shared))
        .transpose()?;
    Ok(Location { place, altitude_m })
}

/// As [`location`], with latitude and longitude zero for "here"; an altitude of zero then stays as it is.
pub fn location_or_here(
    command: &CommandMessage,
    shared: &Shared,
) -> Result<Location, CommandError> {
    let [_, _, _, _, x, y, z] = command.params;
    let is_here = match command.xy {
        Some(xy) => xy == [0, 0],
        None => x == 0.0 && y == 0.0,
    };
    if !is_here {
        return location(command, shared);
    }
    let mut elsewhere = *command;
    elsewhere.xy = command.xy.map(|_| [NOT_GIVEN; 2]);
    elsewhere.params[4] = f32::NAN;
    elsewhere.params[5] = f32::NAN;
    if z == 0.0 {
        elsewhere.params[6] = f32::NAN;
    }
    location(&elsewhere, shared)
}

/// The place in parameters 5 and 6.
///
/// # Errors
/// A frame that is not global, one coordinate without the other, or none on the Earth.
pub fn place(command: &CommandMessage) -> Result<Option<Place>, CommandError> {
    check_frame(command.frame.unwrap_or(FRAME_GLOBAL))?;
    let (latitude, longitude) = match command.xy {
        Some([x, y]) => (degrees(x), degrees(y)),
        None => {
            let [_, _, _, _, x, y, _] = command.params;
            (number("latitude p5", x)?, number("longitude p6", y)?)
        }
    };
    match (latitude, longitude) {
        (None, None) => Ok(None),
        (Some(latitude), Some(longitude)) => on_earth(latitude, longitude).map(Some),
        _ => Err(CommandError::denied("Refused: latitude and longitude only together")),
    }
}

/// A place by degrees.
pub fn on_earth(latitude_deg: f64, longitude_deg: f64) -> Result<Place, CommandError> {
    if !(-90.0..=90.0).contains(&latitude_deg) || !(-180.0..=180.0).contains(&longitude_deg) {
        return Err(CommandError::denied(format!(
            "Refused: {latitude_deg:.7} {longitude_deg:.7} deg is no place on the Earth"
        )));
    }
    Ok(Place {
        latitude_rad: convert::radians(latitude_deg),
        longitude_rad: convert::radians(longitude_deg),
    })
}

fn degrees(e7: i32) -> Option<f64> {
    (e7 != NOT_GIVEN).then(|| convert::degrees_of_e7(e7))
}

fn check_frame(frame: u8) -> Result<(), CommandError> {
    if FRAMES_SEA_LEVEL.contains(&frame) || FRAMES_ABOVE_HOME.contains(&frame) {
        return Ok(());
    }
    Err(CommandError {
        result: MavResult::MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME,
        reason: Some(format!("Refused: frame {frame} is not 0, 3, 5 or 6")),
    })
}

/// An altitude of some frame as altitude above the ellipsoid, m, within the limits.
///
/// # Errors
/// Another frame than those above sea level and above home, or an altitude outside the limits.
pub fn above_ellipsoid(altitude_m: f64, frame: u8, shared: &Shared) -> Result<f64, CommandError> {
    check_frame(frame)?;
    within(Reference::Altitude(altitude_m), shared)?;
    Ok(altitude_m)
}

/// True airspeed of a calibrated one within the limits, m/s, at the altitude reference.
pub fn airspeed(calibrated_m_s: f64, shared: &Shared) -> Result<f64, CommandError> {
    let airspeed = Airspeed::Calibrated(calibrated_m_s);
    shared.parameters.limits.check_airspeed(airspeed).map_err(denied)?;
    Ok(airspeed.true_m_s(shared.aircraft.altitude_reference_m()))
}

/// A speed over the ground, m/s, which is flown as true airspeed, within the limits.
pub fn ground_speed(speed_m_s: f64, shared: &Shared) -> Result<f64, CommandError> {
    within(Reference::Airspeed(speed_m_s), shared)?;
    Ok(speed_m_s)
}

/// The vehicle checks again; a check here gives the text at once.
pub fn within(reference: Reference, shared: &Shared) -> Result<(), CommandError> {
    let altitude_m = shared.aircraft.altitude_reference_m();
    shared.parameters.limits.check(reference, altitude_m).map_err(denied)
}

fn denied(refusal: VehicleRefusal) -> CommandError {
    CommandError::denied(format!("Refused: {refusal}"))
}

/// Radius of a circle, m, and whether the direction is clockwise; 0 and NaN leave both unchanged.
pub fn signed_radius(what: &str, value: f32) -> Result<(Option<f64>, Option<bool>), CommandError> {
    let radius = number(what, value)?.filter(|radius| *radius != 0.0);
    Ok((radius.map(f64::abs), radius.map(|radius| radius > 0.0)))
}
