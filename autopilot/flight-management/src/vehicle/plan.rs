//! A plan: what Mission flies, item by item.

use super::request::Place;
use serde::{Deserialize, Serialize};

mod check;

/// Items that a plan may have.
pub const ITEMS_MAX: usize = 1000;

/// A whole plan. It is replaced as a whole or not at all.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Plan {
    /// Number of this version of the plan, never zero unless it is empty.
    pub id: u32,
    /// The items in their order, from 0.
    pub items: Vec<Item>,
}

/// One item.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Item {
    /// What to do.
    pub action: Action,
    /// Go on with the next item; otherwise circle there.
    pub autocontinue: bool,
}

/// A point to fly to. What is `None` stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Where; `None`: where the aircraft is when the item begins.
    pub place: Option<Place>,
    /// Altitude above the ellipsoid, m; `None`: the altitude reference of the item before.
    pub altitude_m: Option<f64>,
}

/// A circle around a point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Circle {
    /// Its centre.
    pub centre: Point,
    /// Radius, m, positive; `None`: the parameter `NAV_LOITER_RAD`.
    pub radius_m: Option<f64>,
    /// Direction, seen from above.
    pub clockwise: bool,
}

/// What an item asks for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// Fly along the leg to this point (NAV_WAYPOINT).
    Waypoint {
        /// The point.
        point: Point,
        /// Acceptance radius, m; `None`: scales with the speed.
        acceptance_m: Option<f64>,
    },
    /// Circle for good (NAV_LOITER_UNLIM).
    LoiterUnlimited(Circle),
    /// Circle some turns (NAV_LOITER_TURNS).
    LoiterTurns {
        /// The circle.
        circle: Circle,
        /// How many turns.
        turns: f64,
    },
    /// Circle for some time after the circle is reached (NAV_LOITER_TIME).
    LoiterTime {
        /// The circle.
        circle: Circle,
        /// Simulation time, s.
        seconds: f64,
    },
    /// Circle until the altitude of the centre is reached (NAV_LOITER_TO_ALT).
    LoiterToAltitude(Circle),
    /// New airspeed reference (DO_CHANGE_SPEED).
    ChangeSpeed {
        /// True airspeed, m/s.
        airspeed_m_s: f64,
    },
    /// Climb or descend on the present course until the altitude is reached (NAV_CONTINUE_AND_CHANGE_ALT).
    ChangeAltitude {
        /// Altitude above the ellipsoid, m.
        altitude_m: f64,
    },
    /// Go on with another item (DO_JUMP).
    Jump {
        /// Which item.
        to: u16,
        /// How many times; `None`: always.
        times: Option<u16>,
    },
    /// Fly home and circle there (NAV_RETURN_TO_LAUNCH).
    Return,
}

/// How far a plan has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Progress {
    /// There is no plan.
    #[default]
    NoPlan,
    /// It has not been begun since it was loaded.
    NotStarted,
    /// Mission flies it.
    Active,
    /// It was begun and another mode flies now.
    Paused,
    /// The last item is done.
    Complete,
}
