//! What is read of a setpoint.
//!
//! | message | fields that are used | flown as |
//! |---|---|---|
//! | SET_ATTITUDE_TARGET | roll of q | roll angle; altitude and airspeed references stay |
//! | SET_POSITION_TARGET_GLOBAL_INT | latitude, longitude, altitude if given | fly there and circle |
//! | SET_POSITION_TARGET_LOCAL_NED | x, y, z | the same in the local axes of the flight |
//! | both, with the position ignored | velocity | course, airspeed, climb rate |
//! | SET_POSITION_TARGET_LOCAL_NED in a body frame | velocity | the same, from the heading when it comes |
//!
//! A position counts before a velocity. Body rates, thrust, pitch, yaw, yaw rate and accelerations are not
//! used. What is outside the limits of the references is flown at the limit, and that is said.

use core::fmt;

use ::mavlink::dialects::common::{AttitudeTargetTypemask, SET_ATTITUDE_TARGET_DATA};
use icd::Ned;

use crate::codec::PositionTarget;
use crate::convert;
use flight_management::parameters::Parameters;
use flight_management::vehicle::{Place, Setpoint};

/// POSITION_TARGET_TYPEMASK: ignored fields.
const XY: u16 = 1 | 2;
const Z: u16 = 4;
const VELOCITY_XY: u16 = 8 | 16;
const VELOCITY_Z: u16 = 32;
/// MAV_FRAME with the altitude above sea level, above home and above the ground. Home is on the ground, and
/// the ground is at altitude zero, so that they are the same here.
const GLOBAL_FRAMES: [u8; 6] = [0, 3, 5, 6, 10, 11];
/// MAV_FRAME_LOCAL_NED.
const LOCAL_NED: u8 = 1;
/// MAV_FRAME_BODY_NED and MAV_FRAME_BODY_FRD: forward, right and down of a level aircraft with this heading.
const BODY_FRAMES: [u8; 2] = [8, 12];
/// Below this a velocity has no course, m/s.
const STANDING_M_S: f64 = 1.0;
/// A hair inside the roll limit, since the vehicle compares in degrees and a conversion there and back rounds.
const INSIDE: f64 = 1.0 - 1.0e-12;

/// A setpoint that can be flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Read {
    /// The setpoint, within the limits.
    pub setpoint: Setpoint,
    /// Another value was asked for.
    pub limited: Option<Limited>,
}

/// A value that was limited.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limited {
    what: &'static str,
    unit: &'static str,
    asked: f64,
    flown: f64,
}

impl fmt::Display for Limited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, unit, asked, flown } = self;
        write!(f, "{what} {asked:.1} {unit} is flown as {flown:.1} {unit}")
    }
}

/// Why a setpoint cannot be flown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unusable(pub &'static str);

/// Limits values and remembers the first one that was beyond.
#[derive(Default)]
struct Limiter(Option<Limited>);

impl Limiter {
    fn limit(
        &mut self,
        what: &'static str,
        unit: &'static str,
        asked: f64,
        (min, max): (f64, f64),
    ) -> f64 {
        let flown = asked.max(min).min(max);
        if asked < min || asked > max {
            self.0 = self.0.or(Some(Limited { what, unit, asked, flown }));
        }
        flown
    }

    fn read(self, setpoint: Setpoint) -> Read {
        Read { setpoint, limited: self.0 }
    }
}

/// SET_ATTITUDE_TARGET.
///
/// # Errors
/// The attitude is ignored or no attitude.
pub fn of_attitude(
    data: &SET_ATTITUDE_TARGET_DATA,
    parameters: &Parameters,
) -> Result<Read, Unusable> {
    if data.type_mask.contains(AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE) {
        return Err(Unusable("the attitude is marked as ignored"));
    }
    let euler = convert::euler_of(data.q).ok_or(Unusable("q is no unit quaternion"))?;
    let mut limiter = Limiter::default();
    let limit_deg = parameters.limits.roll_max_deg;
    limiter.limit("roll", "deg", euler.phi.to_degrees(), (-limit_deg, limit_deg));
    let limit = convert::radians(limit_deg) * INSIDE;
    Ok(limiter.read(Setpoint::Roll(euler.phi.clamp(-limit, limit))))
}

/// SET_POSITION_TARGET_GLOBAL_INT.
///
/// # Errors
/// A frame that is not global, no position and no velocity, or values that are none.
pub fn of_global(target: &PositionTarget<i32>, parameters: &Parameters) -> Result<Read, Unusable> {
    if !GLOBAL_FRAMES.contains(&target.frame) {
        return Err(Unusable("the frame is none of 0, 3, 5, 6, 10 and 11"));
    }
    if !uses_position(target.ignored)? {
        return of_velocity(target.velocity, 0.0, target.ignored, parameters);
    }
    let latitude = convert::degrees_of_e7(target.x);
    let longitude = convert::degrees_of_e7(target.y);
    if latitude.abs() > 90.0 || longitude.abs() > 180.0 {
        return Err(Unusable("latitude and longitude are no place on the Earth"));
    }
    let mut limiter = Limiter::default();
    let altitude_m = if target.ignored & Z == 0 {
        let limits = &parameters.limits;
        let range = (limits.altitude_min_m, limits.altitude_max_m);
        Some(limiter.limit("altitude", "m", finite(target.z)?, range))
    } else {
        None
    };
    let place = Place {
        latitude_rad: convert::radians(latitude),
        longitude_rad: convert::radians(longitude),
    };
    Ok(limiter.read(Setpoint::Position { place, altitude_m }))
}

/// SET_POSITION_TARGET_LOCAL_NED, with the heading of the aircraft, rad from north, if it is known.
///
/// # Errors
/// A frame that is neither the local one nor one of the body, a position in a frame of the body, no position and no velocity, or values that are none.
pub fn of_local(
    target: &PositionTarget<f32>,
    heading_rad: Option<f64>,
    parameters: &Parameters,
) -> Result<Read, Unusable> {
    let forward_rad = match target.frame {
        LOCAL_NED => 0.0,
        frame if BODY_FRAMES.contains(&frame) => {
            heading_rad.ok_or(Unusable("the heading is not known yet"))?
        }
        _ => return Err(Unusable("the frame is none of 1, 8 and 12")),
    };
    if !uses_position(target.ignored)? {
        return of_velocity(target.velocity, forward_rad, target.ignored, parameters);
    }
    if target.frame != LOCAL_NED {
        return Err(Unusable("a position needs frame 1 (local NED), not one of the body"));
    }
    if target.ignored & Z != 0 {
        return Err(Unusable("a local position needs x, y and z"));
    }
    let position = Ned::new(finite(target.x)?, finite(target.y)?, finite(target.z)?);
    Ok(Limiter::default().read(Setpoint::LocalPosition(position)))
}

/// Whether a place is given.
fn uses_position(ignored: u16) -> Result<bool, Unusable> {
    match (ignored & XY, ignored & Z) {
        (0, _) => Ok(true),
        (XY, Z) => Ok(false),
        (XY, _) => Err(Unusable("an altitude needs a place")),
        _ => Err(Unusable("x and y only together")),
    }
}

/// A velocity forward, right and down, where forward has this angle from north.
fn of_velocity(
    [forward, right, down]: [f32; 3],
    forward_rad: f64,
    ignored: u16,
    parameters: &Parameters,
) -> Result<Read, Unusable> {
    let mut limiter = Limiter::default();
    let limits = &parameters.limits;
    let (course_rad, speed_m_s) = match ignored & VELOCITY_XY {
        0 => {
            let (forward, right) = (finite(forward)?, finite(right)?);
            let (sin, cos) = libm::sincos(forward_rad);
            let north = forward * cos - right * sin;
            let east = forward * sin + right * cos;
            let speed = libm::hypot(north, east);
            if speed < STANDING_M_S {
                return Err(Unusable("a plane cannot stand still"));
            }
            let range = (limits.airspeed_min_m_s, limits.airspeed_max_m_s);
            let speed = limiter.limit("speed", "m/s", speed, range);
            (Some(libm::atan2(east, north)), Some(speed))
        }
        VELOCITY_XY => (None, None),
        _ => return Err(Unusable("velocity north and east only together")),
    };
    let climb_m_s = if ignored & VELOCITY_Z == 0 {
        let limit = parameters.navigation.climb_max_m_s;
        limiter.limit("climb", "m/s", 0.0 - finite(down)?, (-limit, limit))
    } else if course_rad.is_none() {
        return Err(Unusable("neither position nor velocity is given"));
    } else {
        0.0
    };
    Ok(limiter.read(Setpoint::Velocity { course_rad, speed_m_s, climb_m_s }))
}

fn finite(value: f32) -> Result<f64, Unusable> {
    if value.is_finite() { Ok(f64::from(value)) } else { Err(Unusable("a value is not finite")) }
}
