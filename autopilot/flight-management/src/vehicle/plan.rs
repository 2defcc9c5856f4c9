//! A plan: the items that Mission flies. It is checked as a whole before it replaces another.

pub use super::request::Progress;
use super::request::{Airspeed, Place};
use crate::vehicle::VehicleRefusal;
use crate::vehicle::rules::{RADIUS_MAX_M, Rules, check_radius, within};
use serde::{Deserialize, Serialize};

/// Items that a plan may have.
pub const ITEMS_MAX: usize = 1000;

/// A whole plan. It is replaced as a whole or not at all.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Plan {
    /// Number of this version of the plan, zero only if it is empty.
    pub id: u32,
    /// The items, in order from 0.
    pub items: Vec<Item>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Item {
    /// Action of the item.
    pub action: Action,
    /// Whether to continue with the next item; otherwise circle there.
    pub autocontinue: bool,
}

/// A point to fly to. `None` leaves a value unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Location; `None`: the position of the aircraft when the item begins.
    pub place: Option<Place>,
    /// Altitude above the ellipsoid, m; `None`: the altitude reference of the item before.
    pub altitude_m: Option<f64>,
}

/// A circle around a point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Circle {
    pub centre: Point,
    /// Radius, m, positive; `None`: the parameter `NAV_LOITER_RAD`.
    pub radius_m: Option<f64>,
    /// Direction, seen from above.
    pub clockwise: bool,
}

/// Action of an item.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// Fly along the leg to this point (NAV_WAYPOINT).
    Waypoint {
        point: Point,
        /// Acceptance radius, m; `None`: scales with the speed.
        acceptance_m: Option<f64>,
    },
    /// Circle without end (NAV_LOITER_UNLIM).
    LoiterUnlimited(Circle),
    /// Circle some turns (NAV_LOITER_TURNS).
    LoiterTurns { circle: Circle, turns: f64 },
    /// Circle for some time after the circle is reached (NAV_LOITER_TIME).
    LoiterTime {
        circle: Circle,
        /// Simulation time, s.
        seconds: f64,
    },
    /// Circle until the altitude of the centre is reached (NAV_LOITER_TO_ALT).
    LoiterToAltitude(Circle),
    /// New airspeed reference (DO_CHANGE_SPEED).
    ChangeSpeed { airspeed: Airspeed },
    /// Climb or descend on the present course until the altitude is reached (NAV_CONTINUE_AND_CHANGE_ALT).
    ChangeAltitude {
        /// Altitude above the ellipsoid, m.
        altitude_m: f64,
    },
    /// Continue with another item (DO_JUMP).
    Jump {
        to: u16,
        /// Number of jumps; `None`: always.
        times: Option<u16>,
    },
    /// Fly home and circle there (NAV_RETURN_TO_LAUNCH).
    Return,
}

/// Most turns of a circle.
const TURNS_MAX: f64 = 1_000.0;
/// Longest time on a circle, s: a day.
const SECONDS_MAX: f64 = 86_400.0;

impl Plan {
    /// Checks every item against the limits.
    pub fn check(&self, rules: &Rules) -> Result<(), VehicleRefusal> {
        let count = self.items.len();
        if count > ITEMS_MAX {
            return Err(VehicleRefusal::PlanTooLong { items: count, max: ITEMS_MAX });
        }
        for (number, item) in (0_u16..).zip(&self.items) {
            item.action.check(rules).map_err(|refusal| match refusal {
                VehicleRefusal::OutOfRange { what, unit, value, min, max } => {
                    VehicleRefusal::ItemOutOfRange { item: number, what, unit, value, min, max }
                }
                other => other,
            })?;
            if let Action::Jump { to, times } = item.action {
                self.check_jump(number, to, times)?;
            }
        }
        Ok(())
    }

    /// Checks that a jump arrives and, if it has no end, does not return to itself without an item flown between. Counted
    /// jumps are used up in the end and lead elsewhere then.
    fn check_jump(&self, number: u16, to: u16, times: Option<u16>) -> Result<(), VehicleRefusal> {
        if usize::from(to) >= self.items.len() {
            return Err(VehicleRefusal::NoSuchItem { item: to, items: self.count() });
        }
        if times.is_some() {
            return Ok(());
        }
        let mut at = to;
        // After as many steps as there are items, the jumps have come round.
        for _ in 0..self.items.len() {
            let Some(item) = self.items.get(usize::from(at)) else { return Ok(()) };
            match item.action {
                Action::Jump { to, times: None } => at = to,
                Action::Jump { times: Some(_), .. } => at += 1,
                Action::ChangeSpeed { .. } if item.autocontinue => at += 1,
                _ => return Ok(()),
            }
        }
        Err(VehicleRefusal::EndlessJump { item: number })
    }

    /// How many items there are.
    pub fn count(&self) -> u16 {
        u16::try_from(self.items.len()).unwrap_or(u16::MAX)
    }
}

impl Action {
    /// The circle of an item that is one.
    pub const fn circle(&self) -> Option<&Circle> {
        match self {
            Self::LoiterUnlimited(circle)
            | Self::LoiterToAltitude(circle)
            | Self::LoiterTurns { circle, .. }
            | Self::LoiterTime { circle, .. } => Some(circle),
            _ => None,
        }
    }

    fn check(&self, rules: &Rules) -> Result<(), VehicleRefusal> {
        if let Some(Circle { centre, radius_m, .. }) = self.circle() {
            rules.check_some(centre.place, centre.altitude_m)?;
            check_radius(*radius_m)?;
        }
        match *self {
            Self::Waypoint { point, acceptance_m } => {
                rules.check_some(point.place, point.altitude_m)?;
                let acceptance_m = acceptance_m.unwrap_or(0.0);
                within("acceptance radius", "m", acceptance_m, (0.0, RADIUS_MAX_M))
            }
            Self::LoiterTurns { turns, .. } => {
                within("number of turns", "turns", turns, (0.0, TURNS_MAX))
            }
            Self::LoiterTime { seconds, .. } => within("time", "s", seconds, (0.0, SECONDS_MAX)),
            Self::ChangeSpeed { airspeed } => rules.limits.check_airspeed(airspeed),
            Self::ChangeAltitude { altitude_m } => rules.check_some(None, Some(altitude_m)),
            Self::LoiterUnlimited(_)
            | Self::LoiterToAltitude(_)
            | Self::Jump { .. }
            | Self::Return => Ok(()),
        }
    }
}
