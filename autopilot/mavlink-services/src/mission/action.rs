//! Meaning of a mission item: MAV_CMD to [`Action`].

use crate::codec::MissionItem;
use crate::mission::fields::{
    Note, Param, Rejected, Zeros, flag, is_absolute, needed_altitude, none, number, point,
    positive, word,
};
use flight_management::command::VehicleCommand;
use flight_management::parameters::ReferenceLimits;
use flight_management::vehicle::plan::{Action, Circle, Point};
use flight_management::vehicle::rules::Rules;
use flight_management::vehicle::{Airspeed, Reference, Reposition};

/// NAV_WAYPOINT; also the command of guided items.
pub const WAYPOINT: u16 = 16;
const LOITER_UNLIMITED: u16 = 17;
const LOITER_TURNS: u16 = 18;
const LOITER_TIME: u16 = 19;
const RETURN: u16 = 20;
const LAND: u16 = 21;
const TAKEOFF: u16 = 22;
const CHANGE_ALTITUDE: u16 = 30;
const LOITER_TO_ALTITUDE: u16 = 31;
pub const DELAY: u16 = 93;
const JUMP: u16 = 177;
const CHANGE_SPEED: u16 = 178;
const DO_CHANGE_ALTITUDE: u16 = 186;

/// The aircraft leaves circles with the nose to the next point, whether the item requests it or not.
const HEADING: &str = "heading required";
const AIRSPEED: f64 = 0.0;
const GROUND_SPEED: f64 = 1.0;

/// The action of an item. `note` receives what is flown in another way than the item says.
///
/// # Errors
/// [`Rejected`]: the command is not supported, or not with these values.
pub fn of(
    item: &MissionItem<i32>,
    rules: &Rules,
    note: &mut impl FnMut(Note),
) -> Result<Action, Rejected> {
    let limits = &rules.limits;
    let [p1, p2, p3, p4] = item.params;
    match item.words.command {
        WAYPOINT => waypoint(item, rules, note),
        LOITER_UNLIMITED => Ok(Action::LoiterUnlimited(circle(item, Param::P3, p3, rules)?)),
        LOITER_TURNS => {
            flag(Param::P2, HEADING, p2)?;
            let turns = positive(Param::P1, "number of turns", p1)?;
            Ok(Action::LoiterTurns { circle: circle(item, Param::P3, p3, rules)?, turns })
        }
        LOITER_TIME => {
            flag(Param::P2, HEADING, p2)?;
            let seconds = positive(Param::P1, "time", p1)?;
            let circle = circle(item, Param::P3, p3, rules)?;
            Ok(Action::LoiterTime { circle, seconds })
        }
        LOITER_TO_ALTITUDE => {
            flag(Param::P1, HEADING, p1)?;
            needed_altitude(item, limits)?;
            Ok(Action::LoiterToAltitude(circle(item, Param::P2, p2, rules)?))
        }
        RETURN => Ok(Action::Return),
        TAKEOFF => takeoff(item, rules, note),
        CHANGE_ALTITUDE => {
            // Whether to climb or to descend follows from where the aircraft is.
            if number(Param::P1, "direction", p1)?
                .is_some_and(|way| ![0.0, 1.0, 2.0].contains(&way))
            {
                return Err(Rejected::param(Param::P1, format!("direction {p1} is not 0, 1 or 2")));
            }
            Ok(Action::ChangeAltitude { altitude_m: needed_altitude(item, limits)? })
        }
        DELAY => delay(p1, [p2, p3, p4]),
        JUMP => jump(p1, p2),
        CHANGE_SPEED => change_speed(item.params, rules, note),
        LAND => Err(Rejected::unsupported("there is no landing; end with a circle (17) or 20")),
        DO_CHANGE_ALTITUDE => Err(Rejected::unsupported(
            "command 186 is not for plans; use NAV_CONTINUE_AND_CHANGE_ALT (30)",
        )),
        other => Err(Rejected::unsupported(format!("command {other} is not flown"))),
    }
}

/// p1 hold time, p2 acceptance radius, p3 pass radius, p4 yaw.
///
/// An acceptance radius below the parameter is ignored: the turn would begin behind the point, kilometres
/// off the next leg. MAVSDK sends one to three metres where its user has chosen none.
fn waypoint(
    item: &MissionItem<i32>,
    rules: &Rules,
    note: &mut impl FnMut(Note),
) -> Result<Action, Rejected> {
    let [hold, acceptance, pass, _] = item.params;
    if positive(Param::P1, "hold time", hold)? > 0.0 {
        note(Note::HoldTime);
    }
    none(Param::P3, pass, "only points to fly through, no pass radius")?;
    let acceptance_m = positive(Param::P2, "acceptance radius", acceptance)?;
    let is_used = acceptance_m >= rules.navigation.acceptance_m;
    if acceptance_m > 0.0 && !is_used {
        note(Note::Acceptance);
    }
    Ok(Action::Waypoint {
        point: point(item, Zeros::AreThere, &rules.limits)?,
        acceptance_m: is_used.then_some(acceptance_m),
    })
}

/// The aircraft flies already: it flies to the point, or without a point to the altitude.
fn takeoff(
    item: &MissionItem<i32>,
    rules: &Rules,
    note: &mut impl FnMut(Note),
) -> Result<Action, Rejected> {
    let point = point(item, Zeros::AreHere, &rules.limits)?;
    note(Note::Takeoff);
    if point.place.is_some() {
        return Ok(Action::Waypoint { point, acceptance_m: None });
    }
    Ok(Action::ChangeAltitude { altitude_m: needed_altitude(item, &rules.limits)? })
}

/// A circle around the place of the item; the sign of its radius is the direction. Without a radius it uses
/// that of the parameters; a radius that no allowed speed and bank can fly is refused.
fn circle(
    item: &MissionItem<i32>,
    param: Param,
    radius: f32,
    rules: &Rules,
) -> Result<Circle, Rejected> {
    let radius_m = number(param, "radius", radius)?.filter(|radius| *radius != 0.0);
    let [slowest_m_s, _] = rules.limits.airspeeds_m_s(rules.limits.altitude_min_m);
    let least_m = rules.smallest_circle_m(slowest_m_s);
    if radius_m.is_some_and(|radius| radius.abs() < least_m) {
        let reason = format!("radius {radius} m cannot be flown, it is below {least_m:.0} m");
        return Err(Rejected::param(param, reason));
    }
    Ok(Circle {
        centre: point(item, Zeros::AreHere, &rules.limits)?,
        radius_m: radius_m.map(f64::abs),
        clockwise: radius_m.is_none_or(|radius| radius > 0.0),
    })
}

/// p1 seconds; the fields for a time of day are not supported.
fn delay(seconds: f32, clock: [f32; 3]) -> Result<Action, Rejected> {
    for (param, value) in [Param::P2, Param::P3, Param::P4].into_iter().zip(clock) {
        if value >= 0.0 {
            return Err(Rejected::param(param, "only a delay in seconds, not to a time of day"));
        }
    }
    let centre = Point { place: None, altitude_m: None };
    let circle = Circle { centre, radius_m: None, clockwise: true };
    Ok(Action::LoiterTime { circle, seconds: positive(Param::P1, "delay", seconds)? })
}

/// p1 item, p2 number of jumps; negative for always.
fn jump(to: f32, times: f32) -> Result<Action, Rejected> {
    let to = word(Param::P1, "jump to item", to)?;
    let times = if times < 0.0 { None } else { Some(word(Param::P2, "number of jumps", times)?) };
    Ok(Action::Jump { to, times })
}

/// p1 type, p2 speed, p3 throttle, p4 relative.
fn change_speed(
    [kind, speed, throttle, relative]: [f32; 4],
    rules: &Rules,
    note: &mut impl FnMut(Note),
) -> Result<Action, Rejected> {
    let airspeed: fn(f64) -> Airspeed = match number(Param::P1, "type of speed", kind)? {
        None | Some(AIRSPEED) => Airspeed::Calibrated,
        Some(GROUND_SPEED) => {
            note(Note::GroundSpeed);
            Airspeed::True
        }
        Some(_) => {
            return Err(Rejected::param(Param::P1, format!("type of speed {kind} is not 0 or 1")));
        }
    };
    if throttle > 0.0 {
        return Err(Rejected::param(Param::P3, "there is no throttle reference (p3)"));
    }
    none(Param::P4, relative, "only an absolute speed (p4 = 0)")?;
    let Some(airspeed) = number(Param::P2, "speed", speed)?.map(airspeed) else {
        return Err(Rejected::param(Param::P2, "it needs a speed"));
    };
    let checked = rules.limits.check_airspeed(airspeed);
    checked.map_err(|refusal| Rejected::param(Param::P2, refusal.to_string()))?;
    Ok(Action::ChangeSpeed { airspeed })
}

/// The first item of a file of waypoints (`QGC WPL 110`) is the home position, with this form. A waypoint for PX4 has no
/// yaw (NaN) as its last parameter where nobody has given one.
pub fn may_be_home(item: &MissionItem<i32>) -> bool {
    item.words.command == WAYPOINT && is_absolute(item) && item.params == [0.0; 4]
}

/// The item is not flown: the next one begins at once.
pub fn is_immediate(item: &MissionItem<i32>) -> bool {
    [JUMP, CHANGE_SPEED].contains(&item.words.command)
}

/// `current` of a guided target.
const GO_TO: u8 = 2;
/// `current` of an altitude change.
const GUIDED_ALTITUDE: u8 = 3;

/// The item does not belong to a plan.
pub fn is_guided(item: &MissionItem<i32>) -> bool {
    [GO_TO, GUIDED_ALTITUDE].contains(&item.words.current)
}

/// The guided command of an item.
///
/// # Errors
/// A command other than NAV_WAYPOINT, or values that cannot be flown.
pub fn guided_command(
    item: &MissionItem<i32>,
    limits: &ReferenceLimits,
) -> Result<VehicleCommand, Rejected> {
    if item.words.command != WAYPOINT {
        return Err(Rejected::unsupported("a guided item is a NAV_WAYPOINT (16)"));
    }
    if item.words.current == GUIDED_ALTITUDE {
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
