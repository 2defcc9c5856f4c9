//! A plan: the items that Mission flies. It is checked as a whole before it replaces another.

pub use super::request::Progress;
use super::request::{Airspeed, Place};
use crate::vehicle::VehicleRefusal;
use crate::vehicle::geodesy::{Horizon, Site};
use crate::vehicle::rules::{
    LEG_SHARE, RADIUS_MAX_M, Rules, STEEPEST_GLIDE, check_place, check_radius, turn_rad, within,
};
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
    /// Return, as the mode (NAV_RETURN_TO_LAUNCH).
    Return,
    /// Climb straight ahead to this altitude above the ellipsoid, m (NAV_TAKEOFF). Nothing if the aircraft is there already.
    Takeoff { altitude_m: f64 },
    /// Glide to this point and land (NAV_LAND).
    Land {
        place: Place,
        /// Altitude of the point, m.
        altitude_m: f64,
        /// Altitude of a go-around, m; `None`: that at which the approach began.
        abort_m: Option<f64>,
    },
    /// Beginning of a landing; nothing by itself (DO_LAND_START).
    LandStart,
    /// Has a meaning for other vehicles or for other items only.
    Nothing,
    /// For equipment that is not on board: flown past and reported.
    Pass,
    /// Move home, to the place of the aircraft if there is none (DO_SET_HOME).
    SetHome { place: Option<Place> },
    /// Switch the fence on or off (DO_FENCE_ENABLE).
    EnableFence(bool),
    /// The items without a place that follow wait until then; the aircraft flies to the next point meanwhile.
    Wait(WaitCondition),
}

/// Condition of an item that holds up others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum WaitCondition {
    /// Simulation time, s (CONDITION_DELAY).
    Seconds(f64),
    /// Distance to the next point, m (CONDITION_DISTANCE).
    Within(f64),
}

/// A waypoint whose legs are too short for the turn: the aircraft passes it wide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TightCorner {
    pub item: u16,
    /// The shorter of its two legs, m.
    pub leg_m: f64,
    /// What the turn needs, m.
    pub needed_m: f64,
    /// True airspeed there, m/s.
    pub airspeed_m_s: f64,
}

/// A landing whose glide is steeper than the steepest that is flown: the aircraft lands behind the point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteepGlide {
    pub item: u16,
    /// Where it begins: height above the landing point and distance from it, m.
    pub height_m: f64,
    pub distance_m: f64,
    /// Distance that it needs, m.
    pub needed_m: f64,
}

/// Most turns of a circle.
const TURNS_MAX: f64 = 1_000.0;
/// Longest time on a circle, s: a day.
const SECONDS_MAX: f64 = 86_400.0;
/// Largest distance of a condition, m: half way round the Earth.
const DISTANCE_MAX_M: f64 = 2.0e7;

/// A landing point is on the ground within this, m: plans have their altitudes from maps.
const ON_GROUND_M: f64 = 10.0;

impl Plan {
    /// Checks every item against the limits; the first problem.
    pub fn check(&self, rules: &Rules) -> Result<(), VehicleRefusal> {
        let count = self.items.len();
        if count > ITEMS_MAX {
            return Err(VehicleRefusal::PlanTooLong { items: count, max: ITEMS_MAX });
        }
        self.problems(rules).next().map_or(Ok(()), |(item, refusal)| {
            Err(match refusal {
                VehicleRefusal::OutOfRange { what, unit, value, min, max } => {
                    VehicleRefusal::ItemOutOfRange { item, what, unit, value, min, max }
                }
                other => other,
            })
        })
    }

    /// What is wrong, by the number of the item.
    pub fn problems(&self, rules: &Rules) -> impl Iterator<Item = (u16, VehicleRefusal)> {
        (0_u16..).zip(&self.items).filter_map(|(number, item)| {
            let checked = match item.action {
                Action::Jump { to, times } => self.check_jump(number, to, times),
                action if self.is_near_ground(number, rules) => action.check(&rules.near_ground()),
                action => action.check(rules),
            };
            checked.err().map(|refusal| (number, refusal))
        })
    }

    /// Whether an item below the altitude limit follows a takeoff or leads to a landing: between them are only items
    /// that are as low, or have no altitude.
    pub fn is_near_ground(&self, number: u16, rules: &Rules) -> bool {
        let low = |item: &&Item| {
            item.action.altitude_m().is_none_or(|altitude| altitude < rules.limits.altitude_min_m)
        };
        let (before, behind) = self.items.split_at(usize::from(number).min(self.items.len()));
        let is_takeoff = |item: &Item| matches!(item.action, Action::Takeoff { .. });
        let is_landing = |item: &Item| matches!(item.action, Action::Land { .. });
        behind.first().is_some_and(|item| low(&item))
            && (before.iter().rev().take_while(low).any(is_takeoff)
                || behind.iter().take_while(low).any(|item| is_takeoff(item) || is_landing(item)))
    }

    /// The waypoints between legs that are too short for the turn, in still air; the plan begins at this airspeed.
    pub fn tight_corners(&self, airspeed: Airspeed, rules: &Rules) -> Vec<TightCorner> {
        let (mut airspeed, mut from, mut corners) = (airspeed, None, Vec::new());
        for (item, Item { action, autocontinue }) in (0_u16..).zip(&self.items) {
            match *action {
                Action::ChangeSpeed { airspeed: new } => airspeed = new,
                Action::Waypoint { point, acceptance_m } => {
                    let next = self.place_behind(item).filter(|_| *autocontinue);
                    if let (Some(from), Some(at), Some(next), None) =
                        (from, point.place, next, acceptance_m)
                    {
                        let altitude_m = point.altitude_m.unwrap_or(rules.limits.altitude_min_m);
                        let airspeed_m_s = rules.nearest_airspeed_m_s(airspeed, altitude_m);
                        let horizon = Horizon::at(at);
                        let [along, onwards] = [from, next].map(|to| horizon.offset(&Site::at(to)));
                        let leg_m = along.norm().min(onwards.norm());
                        let turn_rad = turn_rad(&-along.normalize(), &onwards.normalize());
                        let needed_m = rules.turn_lead_m(turn_rad, airspeed_m_s) / LEG_SHARE;
                        // Two points at one place are no corner.
                        if (1.0..needed_m).contains(&leg_m) {
                            corners.push(TightCorner { item, leg_m, needed_m, airspeed_m_s });
                        }
                    }
                    from = point.place;
                }
                action if action.is_immediate() || matches!(action, Action::Jump { .. }) => {}
                _ => from = None,
            }
        }
        corners
    }

    /// The landings that are too high above their point where the glide begins.
    pub fn steep_glides(&self, rules: &Rules) -> impl Iterator<Item = SteepGlide> {
        let steepest =
            libm::tan(rules.navigation.landing_angle_deg.to_radians()).max(STEEPEST_GLIDE);
        (0_u16..).zip(&self.items).filter_map(move |(number, item)| {
            let Action::Land { place, altitude_m, .. } = item.action else { return None };
            let before = self.items.iter().take(usize::from(number));
            let from = { before }.rfind(|item| !item.action.is_immediate())?;
            let height_m = from.action.altitude_m()? - altitude_m;
            let distance_m = Horizon::at(place).offset(&Site::at(from.action.place()?)).norm();
            let needed_m = height_m / steepest;
            (needed_m > distance_m).then_some(SteepGlide {
                item: number,
                height_m,
                distance_m,
                needed_m,
            })
        })
    }

    /// The place of the next item that is flown, where a jump is made.
    fn place_behind(&self, item: u16) -> Option<Place> {
        let mut at = item.saturating_add(1);
        // After as many steps as there are items, the jumps have come round.
        for _ in 0..self.items.len() {
            at = match self.items.get(usize::from(at))?.action {
                Action::Jump { times: Some(0), .. } => at.saturating_add(1),
                Action::Jump { to, .. } => to,
                action if action.is_immediate() => at.saturating_add(1),
                action => return action.place(),
            };
        }
        None
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
                action if action.is_immediate() && item.autocontinue => at += 1,
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

    /// The place that the item flies to.
    pub const fn place(&self) -> Option<Place> {
        match (self, self.circle()) {
            (Self::Waypoint { point, .. }, _) => point.place,
            (Self::Land { place, .. }, _) => Some(*place),
            (_, Some(circle)) => circle.centre.place,
            _ => None,
        }
    }

    /// The altitude that the item flies to, m.
    pub const fn altitude_m(&self) -> Option<f64> {
        match (self, self.circle()) {
            (Self::Waypoint { point, .. }, _) => point.altitude_m,
            (
                Self::Land { altitude_m, .. }
                | Self::Takeoff { altitude_m }
                | Self::ChangeAltitude { altitude_m },
                _,
            ) => Some(*altitude_m),
            (_, Some(circle)) => circle.centre.altitude_m,
            _ => None,
        }
    }

    /// The item takes no time: the next one begins at once.
    pub const fn is_immediate(&self) -> bool {
        matches!(
            self,
            Self::ChangeSpeed { .. }
                | Self::LandStart
                | Self::Nothing
                | Self::Pass
                | Self::SetHome { .. }
                | Self::EnableFence(_)
                | Self::Wait(_)
        )
    }

    fn check(&self, rules: &Rules) -> Result<(), VehicleRefusal> {
        if let Self::Land { place, altitude_m, abort_m } = *self {
            check_place(place)?;
            let ground = (rules.ground_m - ON_GROUND_M, rules.ground_m + ON_GROUND_M);
            within("landing point: altitude", "m", altitude_m, ground)?;
            return rules.check_some(None, abort_m);
        }
        rules.check_some(self.place(), self.altitude_m())?;
        check_radius(self.circle().and_then(|circle| circle.radius_m))?;
        match *self {
            Self::Waypoint { acceptance_m, .. } => {
                let acceptance_m = acceptance_m.unwrap_or(0.0);
                within("acceptance radius", "m", acceptance_m, (0.0, RADIUS_MAX_M))
            }
            Self::LoiterTurns { turns, .. } => {
                within("number of turns", "turns", turns, (0.0, TURNS_MAX))
            }
            Self::LoiterTime { seconds, .. } | Self::Wait(WaitCondition::Seconds(seconds)) => {
                within("time", "s", seconds, (0.0, SECONDS_MAX))
            }
            Self::Wait(WaitCondition::Within(metres)) => {
                within("distance", "m", metres, (0.0, DISTANCE_MAX_M))
            }
            Self::ChangeSpeed { airspeed } => rules.limits.check_airspeed(airspeed),
            Self::SetHome { place } => rules.check_some(place, None),
            _ => Ok(()),
        }
    }
}
