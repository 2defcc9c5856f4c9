//! Items that are no part of a plan: the old way to send an aircraft to a place or to an altitude.

use super::action::WAYPOINT;
use super::fields::{Zeros, needed_altitude, point};
use super::rejected::{Param, Rejected};
use crate::codec::MissionItem;
use flight_management::command::VehicleCommand;
use flight_management::parameters::ReferenceLimits;
use flight_management::vehicle::{Reference, Reposition};

/// `current` of an item that says where to go.
const GO_TO: u8 = 2;
/// `current` of an item that says how high to fly.
const CHANGE_ALTITUDE: u8 = 3;

/// The item is no part of a plan.
#[must_use]
pub fn is_guided(item: &MissionItem<i32>) -> bool {
    [GO_TO, CHANGE_ALTITUDE].contains(&item.words.current)
}

/// What a guided item asks for.
///
/// # Errors
/// Another command than NAV_WAYPOINT, values that cannot be flown.
pub fn command(
    item: &MissionItem<i32>,
    limits: &ReferenceLimits,
) -> Result<VehicleCommand, Rejected> {
    if item.words.command != WAYPOINT {
        return Err(Rejected::unsupported("a guided item is a NAV_WAYPOINT (16)"));
    }
    if item.words.current == CHANGE_ALTITUDE {
        return Ok(VehicleCommand::Refer(Reference::Altitude(needed_altitude(item, limits)?)));
    }
    let point = point(item, Zeros::AreThere, limits)?;
    if point.place.is_none() {
        return Err(Rejected::param(Param::X, "a guided item needs a place"));
    }
    Ok(VehicleCommand::Reposition(Reposition {
        place: point.place,
        altitude_m: point.altitude_m,
        change_mode: true,
        ..Reposition::default()
    }))
}
