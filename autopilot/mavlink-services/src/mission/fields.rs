//! Fields of an item: finite numbers in range, or a reason; and notes on differences between an accepted item and its
//! flight, reported once, when the plan is in force.

use ::mavlink::dialects::common::MavMissionResult as R;

use crate::codec::MissionItem;
use crate::convert;
use flight_management::parameters::ReferenceLimits;
use flight_management::vehicle::plan::Point;
use flight_management::vehicle::{Place, Reference};

/// MAV_FRAME of altitudes above mean sea level (the ellipsoid here) and above home. Home is on the ground,
/// and the ground is at altitude zero, so the two are the same.
const FRAMES_WITH_ALTITUDE: [u8; 4] = [ABSOLUTE[0], ABSOLUTE[1], 3, 6];
/// Those of altitudes above mean sea level.
const ABSOLUTE: [u8; 2] = [0, 5];
/// "Not given" in x and y.
const NOT_GIVEN: i32 = i32::MAX;

/// Whether latitude and longitude zero mean the place of the aircraft, as the definitions say for circles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zeros {
    /// They mean the aircraft's place.
    AreHere,
    /// They mean that point, in the Atlantic.
    AreThere,
}

/// A number; `None` for NaN, which means "not given".
pub fn number(param: Param, what: &str, value: f32) -> Result<Option<f64>, Rejected> {
    if value.is_infinite() {
        return Err(Rejected::param(param, format!("{what} is not finite")));
    }
    Ok((!value.is_nan()).then(|| convert::decimal(value)))
}

/// A number that is not negative; zero if not given.
pub fn positive(param: Param, what: &str, value: f32) -> Result<f64, Rejected> {
    let number = number(param, what, value)?.unwrap_or(0.0);
    if number < 0.0 {
        return Err(Rejected::param(param, format!("{what} {number} is below 0")));
    }
    Ok(number)
}

/// A number that must be zero or not given; `reason` explains why.
pub fn none(param: Param, value: f32, reason: &str) -> Result<(), Rejected> {
    if value.is_nan() || value == 0.0 {
        Ok(())
    } else {
        Err(Rejected::param(param, format!("{reason} ({value})")))
    }
}

/// A number that must be 0, 1 or not given.
pub fn flag(param: Param, what: &str, value: f32) -> Result<bool, Rejected> {
    if value.is_nan() || value == 0.0 {
        Ok(false)
    } else if value == 1.0 {
        Ok(true)
    } else {
        Err(Rejected::param(param, format!("{what} {value} is not 0 or 1")))
    }
}

/// A whole number of up to 16 bits.
pub fn word(param: Param, what: &str, value: f32) -> Result<u16, Rejected> {
    if value.fract() == 0.0 && (0.0..=65_535.0).contains(&value) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as just checked"
        )]
        return Ok(value as u16);
    }
    Err(Rejected::param(param, format!("{what} {value} is no whole number of 0 to 65535")))
}

/// The place and the altitude of an item; values not given stay unchanged.
///
/// # Errors
/// A frame without altitudes, one coordinate without the other, a point not on the Earth, an altitude outside
/// the limits.
pub fn point(
    item: &MissionItem<i32>,
    zeros: Zeros,
    limits: &ReferenceLimits,
) -> Result<Point, Rejected> {
    Ok(Point { place: place(item, zeros)?, altitude_m: altitude(item, limits)? })
}

/// The altitude of an item above the ellipsoid, m.
pub fn altitude(
    item: &MissionItem<i32>,
    limits: &ReferenceLimits,
) -> Result<Option<f64>, Rejected> {
    check_frame(item)?;
    let altitude_m = number(Param::Z, "altitude", item.z)?;
    let checked =
        altitude_m.map_or(Ok(()), |value| limits.check(Reference::Altitude(value), value));
    checked.map_err(|refusal| Rejected::param(Param::Z, refusal.to_string()))?;
    Ok(altitude_m)
}

/// The altitude of an item that requires one.
pub fn needed_altitude(item: &MissionItem<i32>, limits: &ReferenceLimits) -> Result<f64, Rejected> {
    altitude(item, limits)?.ok_or_else(|| Rejected::param(Param::Z, "it needs an altitude"))
}

fn place(item: &MissionItem<i32>, zeros: Zeros) -> Result<Option<Place>, Rejected> {
    check_frame(item)?;
    match (item.x, item.y) {
        (NOT_GIVEN, NOT_GIVEN) => return Ok(None),
        (0, 0) if zeros == Zeros::AreHere => return Ok(None),
        (NOT_GIVEN, _) => return Err(Rejected::param(Param::X, "a longitude without latitude")),
        (_, NOT_GIVEN) => return Err(Rejected::param(Param::Y, "a latitude without longitude")),
        _ => {}
    }
    let angle = |param, what, e7, max: f64| {
        let degrees = convert::degrees_of_e7(e7);
        if degrees.abs() > max {
            let reason = format!("{what} {degrees:.7} deg is outside -{max} to {max} deg");
            return Err(Rejected::param(param, reason));
        }
        Ok(convert::radians(degrees))
    };
    Ok(Some(Place {
        latitude_rad: angle(Param::X, "latitude", item.x, 90.0)?,
        longitude_rad: angle(Param::Y, "longitude", item.y, 180.0)?,
    }))
}

/// Whether the altitude is above mean sea level.
pub fn is_absolute(item: &MissionItem<i32>) -> bool {
    ABSOLUTE.contains(&item.words.frame)
}

fn check_frame(item: &MissionItem<i32>) -> Result<(), Rejected> {
    let frame = item.words.frame;
    if FRAMES_WITH_ALTITUDE.contains(&frame) { Ok(()) } else { Err(Rejected::frame(frame)) }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    pub result: R,
    pub reason: String,
}

/// The parameters of an item, by their number in the protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Param {
    /// param1.
    P1,
    /// param2.
    P2,
    /// param3.
    P3,
    /// param4.
    P4,
    X,
    Y,
    Z,
}

impl Param {
    /// The MAV_MISSION_RESULT for the parameter.
    const fn result(self) -> R {
        match self {
            Self::P1 => R::MAV_MISSION_INVALID_PARAM1,
            Self::P2 => R::MAV_MISSION_INVALID_PARAM2,
            Self::P3 => R::MAV_MISSION_INVALID_PARAM3,
            Self::P4 => R::MAV_MISSION_INVALID_PARAM4,
            Self::X => R::MAV_MISSION_INVALID_PARAM5_X,
            Self::Y => R::MAV_MISSION_INVALID_PARAM6_Y,
            Self::Z => R::MAV_MISSION_INVALID_PARAM7,
        }
    }
}

impl Rejected {
    /// A parameter with a value that cannot be flown.
    pub fn param(param: Param, reason: impl Into<String>) -> Self {
        Self { result: param.result(), reason: reason.into() }
    }

    pub fn unsupported(reason: impl Into<String>) -> Self {
        Self { result: R::MAV_MISSION_UNSUPPORTED, reason: reason.into() }
    }

    /// A frame that gives no altitude.
    pub fn frame(frame: u8) -> Self {
        let reason = format!("frame {frame} is not 0, 3, 5 or 6");
        Self { result: R::MAV_MISSION_UNSUPPORTED_FRAME, reason }
    }

    /// The same refusal, with the number of an item of a plan.
    #[must_use]
    pub fn of_item(self, seq: u16) -> Self {
        Self { reason: format!("item {seq}: {}", self.reason), ..self }
    }
}

/// One kind of difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Note {
    /// The home position of a file of waypoints.
    Home,
    /// A waypoint with a hold time.
    HoldTime,
    /// An acceptance radius below the parameter `NAV_ACC_RAD`.
    Acceptance,
    /// A speed over the ground.
    GroundSpeed,
    Takeoff,
    /// A circle too small for this airspeed, m/s; it needs this radius, m.
    Widened {
        /// True airspeed when the circle begins, m/s.
        airspeed_m_s: f64,
        /// Smallest radius, m.
        radius_m: f64,
    },
}

impl Note {
    fn text(self) -> String {
        match self {
            Self::Home => "taken as home and not flown".into(),
            Self::HoldTime => "hold time is not flown, a wing cannot stand still".into(),
            Self::Acceptance => "acceptance radius is below NAV_ACC_RAD and not used".into(),
            Self::GroundSpeed => "ground speed is flown as true airspeed".into(),
            Self::Takeoff => "takeoff is flown as a waypoint".into(),
            Self::Widened { airspeed_m_s, radius_m } => {
                format!("at {airspeed_m_s:.0} m/s the circle needs {radius_m:.0} m and is widened")
            }
        }
    }
}

/// The notes of a plan, one of each kind.
#[derive(Debug, Clone, Default)]
pub struct Notes(Vec<(Note, u16, u16)>);

impl Notes {
    /// Adds a note about an item.
    pub fn add(&mut self, note: Note, item: u16) {
        let same = |known: &&mut (Note, u16, u16)| {
            core::mem::discriminant(&known.0) == core::mem::discriminant(&note)
        };
        match self.0.iter_mut().find(same) {
            Some((_, _, more)) => *more += 1,
            None => self.0.push((note, item, 0)),
        }
    }

    /// The notes as texts.
    pub fn texts(&self) -> impl Iterator<Item = String> + '_ {
        self.0.iter().map(|(note, item, more)| match more {
            0 => format!("Mission item {item}: {}", note.text()),
            _ => format!("Mission item {item} and {more} more: {}", note.text()),
        })
    }
}
