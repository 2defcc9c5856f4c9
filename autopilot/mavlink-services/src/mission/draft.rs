//! A list during upload: all its items are received, then it is checked as a whole and takes effect as a whole.
//!
//! An item's command becomes an [`Action`]; its fields are finite numbers in range, or the reason of a refusal. All that is
//! wrong is listed. Notes report the differences between an accepted item and its flight, once, when the plan is in force.

pub use ::mavlink::dialects::common::MavMissionResult as R;
pub use ::mavlink::dialects::common::MavMissionResult::{
    MAV_MISSION_INVALID_PARAM1 as P1, MAV_MISSION_INVALID_PARAM2 as P2,
    MAV_MISSION_INVALID_PARAM3 as P3, MAV_MISSION_INVALID_PARAM4 as P4,
    MAV_MISSION_INVALID_PARAM5_X as X, MAV_MISSION_INVALID_PARAM6_Y as Y,
    MAV_MISSION_INVALID_PARAM7 as Z,
};

use super::commands::*;
use crate::codec::MissionItem;
use crate::convert;
use crate::mission::Stored;
use flight_management::command::VehicleCommand;
use flight_management::parameters::ReferenceLimits;
use flight_management::vehicle::geodesy::{Horizon, Site};
use flight_management::vehicle::plan::{
    Action, Circle, Item, Plan, Point, SteepGlide, TightCorner, WaitCondition,
};
use flight_management::vehicle::rules::Rules;
use flight_management::vehicle::{Airspeed, Place, Reference, Reposition, VehicleRefusal};

/// Longest leg, m. A longer one ends on another continent: latitude and longitude exchanged, or a plan
/// for another aircraft.
const LEG_MAX_M: f64 = 5.0e6;

/// Items received, in order.
#[derive(Debug)]
pub struct Draft {
    /// Number of items to come in all.
    pub count: u16,
    items: Vec<MissionItem<i32>>,
}

impl Draft {
    /// Waits for this many items.
    pub fn new(count: u16, most: usize) -> Result<Self, Rejected> {
        if usize::from(count) > most {
            return Err(Rejected {
                result: R::MAV_MISSION_NO_SPACE,
                reason: format!("{count} items are more than {most}"),
            });
        }
        Ok(Self { count, items: Vec::new() })
    }

    /// The item to request next.
    pub fn next(&self) -> u16 {
        u16::try_from(self.items.len()).unwrap_or(u16::MAX)
    }

    /// All items have been received.
    pub fn is_complete(&self) -> bool {
        self.next() >= self.count
    }

    /// Adds the next item.
    pub fn take(&mut self, item: &MissionItem<i32>) {
        self.items.push(*item);
    }

    /// The items.
    pub fn finish(self) -> Vec<MissionItem<i32>> {
        self.items
    }
}

/// A plan that can be flown.
#[derive(Debug)]
pub struct Finished {
    pub stored: Stored,
    pub plan: Plan,
    /// Differences between the two.
    pub notes: Notes,
}

/// Place and airspeed of the aircraft, or where the items before have led.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlanContext {
    pub place: Option<Place>,
    pub airspeed: Option<Airspeed>,
    /// Altitude of the home of the plan above sea level, m, where its items do not have it.
    pub home_m: Option<f64>,
}

/// A plan during its check.
struct PlanCheck<'a> {
    rules: &'a Rules,
    /// Altitude of home in the frames above sea level, m: it is on the ground, at altitude zero here.
    home_m: f64,
    present: PlanContext,
    notes: Notes,
    /// All that is wrong, by the number of the item.
    problems: Vec<(u16, Rejected)>,
}

/// The plan that these items are, or all that is wrong with them, at least one problem.
///
/// An item 0 that is the home position of a file (`QGC WPL 110`) leads to item 1, so that the targets of jumps stay right. A
/// plan with a home of its own has none there.
pub fn check(
    items: Vec<MissionItem<i32>>,
    present: PlanContext,
    rules: &Rules,
) -> Result<Finished, Vec<Rejected>> {
    let home = if present.home_m.is_none() { home_of(&items, rules) } else { None };
    let home_m = present.home_m.or(home.and_then(elevation)).unwrap_or(0.0);
    let has_home = home.is_some();
    let (notes, problems) = (Notes::default(), Vec::new());
    let mut check = PlanCheck { rules, home_m, present, notes, problems };
    let mut actions = Vec::with_capacity(items.len());
    for (seq, item) in (0_u16..).zip(&items) {
        let action = if seq == 0 && has_home {
            check.notes.add(Note::Home, 0);
            Ok(Action::Jump { to: 1, times: None })
        } else {
            jump_of_tag(item, &items).map_or_else(|| check.action(item, seq), Ok)
        };
        let action = action.and_then(|action| check.follow(item, seq, action));
        actions.push(action.unwrap_or_else(|rejected| {
            check.problems.push((seq, rejected));
            Action::Nothing
        }));
    }
    let item = |(action, item): (Action, &MissionItem<i32>)| Item {
        action,
        autocontinue: item.words.autocontinue,
    };
    let plan = Plan { id: 0, items: actions.into_iter().zip(&items).map(item).collect() };
    let PlanCheck { mut notes, mut problems, .. } = check;
    for (seq, refusal) in plan.problems(rules) {
        let command = items.get(usize::from(seq)).map_or(0, |item| item.words.command);
        problems.push((seq, of_limits(command, &refusal)));
    }
    if problems.is_empty() {
        if let Some(airspeed) = present.airspeed {
            for corner in plan.tight_corners(airspeed, rules) {
                notes.add(Note::Corner(corner), corner.item);
            }
        }
        for glide in plan.steep_glides(rules) {
            notes.add(Note::Glide(glide), glide.item);
        }
        let stored = Stored::new(items);
        return Ok(Finished { plan: Plan { id: stored.id, ..plan }, stored, notes });
    }
    Err(Rejected::all(problems, &items))
}

/// Altitude of the home of a plan above sea level, m; 0 without one.
pub fn home_altitude_m(items: &[MissionItem<i32>], rules: &Rules) -> f64 {
    home_of(items, rules).and_then(elevation).unwrap_or(0.0)
}

fn elevation(home: &MissionItem<i32>) -> Option<f64> {
    // Above what an altitude above home counts from, nobody says.
    let home_m = is_absolute(home).then(|| convert::decimal(home.z));
    home_m.filter(|home_m| home_m.is_finite())
}

/// Item 0, if it is home. The first item that is flown decides: a waypoint where that item is absolute too and the altitude
/// could be flown, else home.
fn home_of<'a>(items: &'a [MissionItem<i32>], rules: &Rules) -> Option<&'a MissionItem<i32>> {
    let [first, others @ ..] = items else { return None };
    // A plan of one item has nothing behind its home that could be flown.
    if others.is_empty() || !may_be_home(items) {
        return None;
    }
    let is_low = first.z <= 0.0 || f64::from(first.z) < rules.limits.altitude_min_m;
    let shows_waypoint = |item: &MissionItem<i32>| is_absolute(item) && !takes_off(item) && !is_low;
    (!first_flown(others).is_some_and(shows_waypoint)).then_some(first)
}

fn first_flown(items: &[MissionItem<i32>]) -> Option<&MissionItem<i32>> {
    items.iter().find(|item| !is_immediate(item))
}

fn takes_off(item: &MissionItem<i32>) -> bool {
    [TAKEOFF, VTOL_TAKEOFF].contains(&item.words.command)
}

/// A problem that the limits of the aircraft show.
pub fn of_limits(command: u16, refusal: &VehicleRefusal) -> Rejected {
    let result = match *refusal {
        VehicleRefusal::OutOfRange { what, .. } => match what {
            "latitude" => X,
            "longitude" => Y,
            "radius" if command != LOITER_TO_ALTITUDE => P3,
            "number of turns" | "time" | "distance" => P1,
            what if what.ends_with("altitude") => Z,
            _ => P2,
        },
        VehicleRefusal::NoSuchItem { item, items } => {
            let last = items.saturating_sub(1);
            return Rejected::param(P1, format!("jump to item {item} is outside 0 to {last}"));
        }
        _ => R::MAV_MISSION_INVALID,
    };
    Rejected { result, reason: refusal.to_string() }
}

/// The jump to a tag (DO_JUMP_TAG) as one to the item behind it; none if this is no such item, or the tag does not exist.
fn jump_of_tag(item: &MissionItem<i32>, items: &[MissionItem<i32>]) -> Option<Action> {
    let [tag, times, ..] = item.params;
    let is_it =
        |other: &MissionItem<i32>| other.words.command == JUMP_TAG && other.params[0] == tag;
    let place = items.iter().position(is_it).filter(|_| item.words.command == DO_JUMP_TAG)?;
    jump(place as f32, times).ok()
}

impl PlanCheck<'_> {
    /// Checks an action against the earlier ones, and records what it changes for the later ones. A delay is flown at the point
    /// before it.
    fn follow(
        &mut self,
        item: &MissionItem<i32>,
        seq: u16,
        mut action: Action,
    ) -> Result<Action, Rejected> {
        if let (DELAY, Action::LoiterTime { circle, .. }) = (item.words.command, &mut action) {
            circle.centre.place = self.present.place;
        }
        self.go_to(action.place())?;
        if let Some(circle) = action.circle() {
            self.circle(circle, seq);
        }
        if let Action::ChangeSpeed { airspeed } = action {
            self.present.airspeed = Some(airspeed);
        }
        Ok(action)
    }

    fn go_to(&mut self, place: Option<Place>) -> Result<(), Rejected> {
        let (Some(from), Some(to)) = (self.present.place, place) else {
            self.present.place = place.or(self.present.place);
            return Ok(());
        };
        let distance_m = Horizon::at(from).offset(&Site::at(to)).norm();
        if distance_m > LEG_MAX_M {
            let (way_km, most_km) = (distance_m / 1.0e3, LEG_MAX_M / 1.0e3);
            let reason = format!("the way there, {way_km:.0} km, is longer than {most_km:.0} km");
            return Err(Rejected::param(X, reason));
        }
        self.present.place = Some(to);
        Ok(())
    }

    /// A circle that is too small at the airspeed it will have is widened.
    fn circle(&mut self, circle: &Circle, seq: u16) {
        let rules = self.rules;
        let (Some(radius_m), Some(airspeed)) = (circle.radius_m, self.present.airspeed) else {
            return;
        };
        // Higher up the true airspeed is larger, so the note claims no more than is certain.
        let altitude_m = circle.centre.altitude_m.unwrap_or(rules.limits.altitude_min_m);
        let airspeed_m_s = airspeed.true_m_s(altitude_m);
        let needed_m = rules.smallest_circle_m(airspeed_m_s);
        if radius_m < needed_m {
            self.notes.add(Note::Widened { airspeed_m_s, radius_m: needed_m }, seq);
        }
    }

    /// The action of an item.
    fn action(&mut self, item: &MissionItem<i32>, seq: u16) -> Result<Action, Rejected> {
        let [p1, p2, p3, p4] = item.params;
        match item.words.command {
            WAYPOINT => self.waypoint(item, seq),
            SPLINE_WAYPOINT | ARC_WAYPOINT => {
                self.notes.add(Note::Straight, seq);
                let point = self.point(item, seq, Zeros::AreThere)?;
                Ok(Action::Waypoint { point, acceptance_m: None })
            }
            LOITER_UNLIMITED => Ok(Action::LoiterUnlimited(self.loiter(item, seq, P3, p3)?)),
            LOITER_TURNS => {
                number(P2, HEADING, p2)?;
                let turns = positive(P1, "number of turns", p1)?;
                Ok(Action::LoiterTurns { circle: self.loiter(item, seq, P3, p3)?, turns })
            }
            LOITER_TIME => {
                number(P2, HEADING, p2)?;
                let seconds = positive(P1, "time", p1)?;
                Ok(Action::LoiterTime { circle: self.loiter(item, seq, P3, p3)?, seconds })
            }
            LOITER_TO_ALTITUDE => {
                number(P1, HEADING, p1)?;
                self.needed_altitude(item, seq)?;
                Ok(Action::LoiterToAltitude(self.loiter(item, seq, P2, p2)?))
            }
            RETURN => Ok(Action::Return),
            TAKEOFF | VTOL_TAKEOFF => {
                place(item, Zeros::AreHere)?;
                Ok(Action::Takeoff { altitude_m: self.needed_altitude(item, seq)? })
            }
            LAND | VTOL_LAND => self.land(item, seq),
            CHANGE_ALTITUDE => {
                // Whether to climb or to descend follows from where the aircraft is.
                let direction = number(P1, "direction", p1)?;
                if direction.is_some_and(|way| ![0.0, 1.0, 2.0].contains(&way)) {
                    return Err(Rejected::param(P1, format!("direction {p1} is not 0, 1 or 2")));
                }
                Ok(Action::ChangeAltitude { altitude_m: self.needed_altitude(item, seq)? })
            }
            DELAY => delay(p1, [p2, p3, p4]),
            CONDITION_DELAY => Ok(Action::Wait(WaitCondition::Seconds(positive(P1, "delay", p1)?))),
            CONDITION_DISTANCE => {
                Ok(Action::Wait(WaitCondition::Within(positive(P1, "distance", p1)?)))
            }
            CONDITION_YAW => {
                self.notes.add(Note::Yaw, seq);
                Ok(Action::Nothing)
            }
            JUMP => jump(p1, p2),
            DO_JUMP_TAG => {
                jump(p1, p2)?;
                Err(Rejected::param(P1, format!("there is no JUMP_TAG ({JUMP_TAG}) {p1}")))
            }
            CHANGE_SPEED => self.change_speed(item.params, seq),
            SET_HOME if p1 == 1.0 => Ok(Action::SetHome { place: None }),
            SET_HOME => match place(item, Zeros::AreThere)? {
                Some(place) => Ok(Action::SetHome { place: Some(place) }),
                None => Err(Rejected::param(X, "it needs a place, or p1 = 1")),
            },
            FENCE_ENABLE => match number(P1, "p1", p1)?.unwrap_or(0.0) {
                0.0 => Ok(Action::EnableFence(false)),
                1.0 => Ok(Action::EnableFence(true)),
                // 2 switches off the lowest altitude only.
                _ => Ok(Action::Nothing),
            },
            LAND_START => Ok(Action::LandStart),
            RETURN_PATH_START | JUMP_TAG | VTOL_TRANSITION => Ok(Action::Nothing),
            command if is_for_equipment(command) => Ok(Action::Pass),
            DO_CHANGE_ALTITUDE => {
                let reason = "not for plans; use NAV_CONTINUE_AND_CHANGE_ALT (30)";
                Err(Rejected::unsupported(reason))
            }
            _ => Err(Rejected::unsupported("not flown by this aircraft")),
        }
    }

    /// p1 hold time, p2 acceptance radius, p3 pass radius, p4 yaw.
    ///
    /// An acceptance radius below the parameter is ignored: the turn would begin behind the point, kilometres
    /// off the next leg. MAVSDK sends one to three metres where its user has chosen none.
    fn waypoint(&mut self, item: &MissionItem<i32>, seq: u16) -> Result<Action, Rejected> {
        let [hold, acceptance, pass, _] = item.params;
        if positive(P1, "hold time", hold)? > 0.0 {
            self.notes.add(Note::HoldTime, seq);
        }
        if number(P3, "pass radius", pass)?.is_some_and(|radius| radius != 0.0) {
            self.notes.add(Note::Pass, seq);
        }
        let acceptance_m = positive(P2, "acceptance radius", acceptance)?;
        let is_used = acceptance_m >= self.rules.navigation.acceptance_m;
        if acceptance_m > 0.0 && !is_used {
            self.notes.add(Note::Acceptance, seq);
        }
        Ok(Action::Waypoint {
            point: self.point(item, seq, Zeros::AreThere)?,
            acceptance_m: is_used.then_some(acceptance_m),
        })
    }

    /// p1 altitude of a go-around above the ground; the aircraft glides to the place.
    fn land(&mut self, item: &MissionItem<i32>, seq: u16) -> Result<Action, Rejected> {
        let abort_m = number(P1, "altitude of a go-around", item.params[0])?;
        let place = place(item, Zeros::AreHere)?.ok_or_else(no_place)?;
        let ground_m = self.rules.ground_m;
        let altitude_m = self.altitude(item, seq)?.unwrap_or(ground_m);
        let abort_m = abort_m.filter(|abort_m| *abort_m > 0.0).map(|abort_m| abort_m + ground_m);
        Ok(Action::Land { place, altitude_m, abort_m })
    }

    /// A circle around the place of the item; the sign of its radius is the direction. Without a radius it uses
    /// that of the parameters. Without a place, an altitude of zero is none either.
    fn loiter(
        &mut self,
        item: &MissionItem<i32>,
        seq: u16,
        param: R,
        radius: f32,
    ) -> Result<Circle, Rejected> {
        let radius_m = number(param, "radius", radius)?.filter(|radius| *radius != 0.0);
        let mut centre = self.point(item, seq, Zeros::AreHere)?;
        if centre.place.is_none() && item.z == 0.0 {
            centre.altitude_m = None;
        }
        Ok(Circle {
            centre,
            // Every radius below the smallest that can be flown is widened.
            radius_m: radius_m.map(|radius| radius.abs().max(1.0)),
            clockwise: radius_m.is_none_or(|radius| radius > 0.0),
        })
    }

    /// p1 type, p2 speed, p3 throttle, p4 relative.
    fn change_speed(
        &mut self,
        [kind, speed, throttle, relative]: [f32; 4],
        seq: u16,
    ) -> Result<Action, Rejected> {
        let is_ground_speed = match number(P1, "type of speed", kind)? {
            None | Some(AIRSPEED) => false,
            Some(GROUND_SPEED) => true,
            Some(_) => {
                return Err(Rejected::param(P1, format!("type of speed {kind} is not 0 or 1")));
            }
        };
        // 0, -1 and NaN all mean that none is given.
        if number(P3, "throttle", throttle)?.is_some_and(|throttle| throttle > 0.0) {
            self.notes.add(Note::Throttle, seq);
        }
        none(P4, relative, "only an absolute speed (p4 = 0)")?;
        // 0, -1 (no change) and -2 (default) leave it as it is.
        let Some(speed) = number(P2, "speed", speed)?.filter(|speed| *speed > 0.0) else {
            return Ok(Action::Nothing);
        };
        if is_ground_speed {
            self.notes.add(Note::GroundSpeed, seq);
        }
        let airspeed = if is_ground_speed { Airspeed::True } else { Airspeed::Calibrated };
        Ok(Action::ChangeSpeed { airspeed: airspeed(speed) })
    }

    /// The place and the altitude of an item; values not given stay unchanged.
    fn point(
        &mut self,
        item: &MissionItem<i32>,
        seq: u16,
        zeros: Zeros,
    ) -> Result<Point, Rejected> {
        Ok(Point { place: place(item, zeros)?, altitude_m: self.altitude(item, seq)? })
    }

    /// The altitude of an item above the ellipsoid, m. That above sea level counts from home, where the plan has one.
    fn altitude(&mut self, item: &MissionItem<i32>, seq: u16) -> Result<Option<f64>, Rejected> {
        let altitude_m = altitude(item)?;
        if altitude_m.is_some() && TERRAIN_FRAMES.contains(&item.words.frame) {
            self.notes.add(Note::Terrain, seq);
        }
        if altitude_m.is_some() && self.home_m != 0.0 && is_absolute(item) {
            self.notes.add(Note::SeaLevel, seq);
        }
        let zero_m = zero_m(item, self.home_m, self.rules.ground_m);
        Ok(altitude_m.map(|altitude_m| altitude_m + zero_m))
    }

    /// The altitude of an item that requires one.
    fn needed_altitude(&mut self, item: &MissionItem<i32>, seq: u16) -> Result<f64, Rejected> {
        self.altitude(item, seq)?.ok_or_else(|| Rejected::param(Z, "it needs an altitude"))
    }
}

/// The aircraft leaves circles with the nose to the next point, whatever the item has here.
const HEADING: &str = "heading required";
const AIRSPEED: f64 = 0.0;
const GROUND_SPEED: f64 = 1.0;

/// p1 seconds; the fields for a time of day are not supported.
fn delay(seconds: f32, clock: [f32; 3]) -> Result<Action, Rejected> {
    // The definition marks unused fields with -1; NaN fails the comparison too.
    for (param, value) in [P2, P3, P4].into_iter().zip(clock) {
        if value >= 0.0 {
            return Err(Rejected::param(param, "only a delay in seconds, not to a time of day"));
        }
    }
    let centre = Point { place: None, altitude_m: None };
    let circle = Circle { centre, radius_m: None, clockwise: true };
    Ok(Action::LoiterTime { circle, seconds: positive(P1, "delay", seconds)? })
}

/// p1 item, p2 number of jumps; negative for always.
fn jump(to: f32, times: f32) -> Result<Action, Rejected> {
    let to = word(P1, "jump to item", to)?;
    let times = if times < 0.0 { None } else { Some(word(P2, "number of jumps", times)?) };
    Ok(Action::Jump { to, times })
}

/// The first item of a file of waypoints (`QGC WPL 110`) is the home position, with this form. A waypoint for PX4 has no
/// yaw (NaN) as its last parameter where nobody has given one. No waypoint is flown on the ground, nor before a takeoff.
pub fn may_be_home(items: &[MissionItem<i32>]) -> bool {
    let [item, others @ ..] = items else { return false };
    let is_below = item.z == 0.0 || first_flown(others).is_some_and(takes_off);
    let is_on_ground = convert::GLOBAL_FRAMES.contains(&item.words.frame) && is_below;
    item.words.command == WAYPOINT && (is_absolute(item) || is_on_ground) && item.params == [0.0; 4]
}

/// The item is not flown: the next one begins at once.
fn is_immediate(item: &MissionItem<i32>) -> bool {
    let command = item.words.command;
    [JUMP, CHANGE_SPEED, SET_HOME, JUMP_TAG].contains(&command) || is_for_equipment(command)
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
pub fn guided_command(
    item: &MissionItem<i32>,
    limits: &ReferenceLimits,
) -> Result<VehicleCommand, Rejected> {
    if item.words.command != WAYPOINT {
        return Err(Rejected::unsupported("a guided item is a NAV_WAYPOINT (16)"));
    }
    let altitude_m = altitude(item)?;
    if let Some(altitude_m) = altitude_m {
        let checked = limits.check(Reference::Altitude(altitude_m), altitude_m);
        checked.map_err(|refusal| Rejected::param(Z, refusal.to_string()))?;
    }
    if item.words.current == GUIDED_ALTITUDE {
        let altitude_m = altitude_m.ok_or_else(|| Rejected::param(Z, "it needs an altitude"))?;
        return Ok(VehicleCommand::Refer(Reference::Altitude(altitude_m)));
    }
    let place = place(item, Zeros::AreThere)?;
    if place.is_none() {
        return Err(Rejected::param(X, "a guided item needs a place"));
    }
    Ok(VehicleCommand::Reposition(Reposition {
        place,
        altitude_m,
        change_mode: true,
        ..Reposition::default()
    }))
}

/// "Not given" in x and y.
const NOT_GIVEN: i32 = i32::MAX;

/// Whether latitude and longitude zero mean the place of the aircraft, as the definitions say for circles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Zeros {
    /// They mean the aircraft's place.
    AreHere,
    /// They mean that point, in the Atlantic.
    AreThere,
}

/// A number; `None` for NaN, which means "not given".
pub fn number(param: R, what: &str, value: f32) -> Result<Option<f64>, Rejected> {
    if value.is_infinite() {
        return Err(Rejected::param(param, format!("{what} is not finite")));
    }
    Ok((!value.is_nan()).then(|| convert::decimal(value)))
}

/// A number that is not negative; zero if not given.
fn positive(param: R, what: &str, value: f32) -> Result<f64, Rejected> {
    let number = number(param, what, value)?.unwrap_or(0.0);
    if number < 0.0 {
        return Err(Rejected::param(param, format!("{what} {number} is below 0")));
    }
    Ok(number)
}

/// A number that must be zero or not given; `reason` explains why.
fn none(param: R, value: f32, reason: &str) -> Result<(), Rejected> {
    if value.is_nan() || value == 0.0 {
        Ok(())
    } else {
        Err(Rejected::param(param, format!("{reason} ({value})")))
    }
}

/// A whole number of up to 16 bits.
pub fn word(param: R, what: &str, value: f32) -> Result<u16, Rejected> {
    convert::whole_number(value.into()).ok_or_else(|| {
        Rejected::param(param, format!("{what} {value} is no whole number of 0 to 65535"))
    })
}

/// The altitude in the frame of an item, m.
pub fn altitude(item: &MissionItem<i32>) -> Result<Option<f64>, Rejected> {
    check_frame(item)?;
    number(Z, "altitude", item.z)
}

fn place(item: &MissionItem<i32>, zeros: Zeros) -> Result<Option<Place>, Rejected> {
    check_frame(item)?;
    match (item.x, item.y) {
        (NOT_GIVEN, NOT_GIVEN) => return Ok(None),
        (0, 0) if zeros == Zeros::AreHere => return Ok(None),
        (NOT_GIVEN, _) => return Err(Rejected::param(X, "a longitude without latitude")),
        (_, NOT_GIVEN) => return Err(Rejected::param(Y, "a latitude without longitude")),
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
        latitude_rad: angle(X, "latitude", item.x, 90.0)?,
        longitude_rad: angle(Y, "longitude", item.y, 180.0)?,
    }))
}

/// MAV_FRAME of altitudes above the terrain, which is level here, at the altitude of home.
const TERRAIN_FRAMES: [u8; 2] = [10, 11];

fn no_place() -> Rejected {
    Rejected::param(X, "it needs a place")
}

/// The place of an item that requires one.
pub fn needed_place(item: &MissionItem<i32>) -> Result<Place, Rejected> {
    place(item, Zeros::AreThere)?.ok_or_else(no_place)
}

/// Where the altitudes of an item count from, m above the ellipsoid. Home is on the ground of the flight, which the plan may have
/// at another altitude.
pub fn zero_m(item: &MissionItem<i32>, home_m: f64, ground_m: f64) -> f64 {
    match is_absolute(item) {
        true if home_m == 0.0 => 0.0,
        true => ground_m - home_m,
        false => ground_m,
    }
}

/// Whether the altitude is above mean sea level.
fn is_absolute(item: &MissionItem<i32>) -> bool {
    convert::FRAMES_SEA_LEVEL.contains(&item.words.frame)
}

fn check_frame(item: &MissionItem<i32>) -> Result<(), Rejected> {
    let frame = item.words.frame;
    if convert::GLOBAL_FRAMES.contains(&frame) {
        return Ok(());
    }
    let reason = format!("frame {frame} is not 0, 3, 5, 6, 10 or 11");
    Err(Rejected { result: R::MAV_MISSION_UNSUPPORTED_FRAME, reason })
}

#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    pub result: R,
    pub reason: String,
}

impl Rejected {
    /// A parameter with a value that cannot be flown, by the result for it.
    pub fn param(result: R, reason: impl Into<String>) -> Self {
        Self { result, reason: reason.into() }
    }

    /// The problems of items in their order, each with item and command.
    pub fn all(mut problems: Vec<(u16, Self)>, items: &[MissionItem<i32>]) -> Vec<Self> {
        // Stable: of one item in the order in which they were found.
        problems.sort_by_key(|(seq, _)| *seq);
        problems.into_iter().map(|(seq, rejected)| rejected.at(seq, items)).collect()
    }

    /// The same with item and command.
    fn at(self, seq: u16, items: &[MissionItem<i32>]) -> Self {
        let command = items.get(usize::from(seq)).map_or(0, |item| item.words.command);
        Self { reason: format!("item {seq}: {}: {}", named(command), self.reason), ..self }
    }

    pub fn unsupported(reason: impl Into<String>) -> Self {
        Self { result: R::MAV_MISSION_UNSUPPORTED, reason: reason.into() }
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
    Throttle,
    /// A waypoint with a pass radius.
    Pass,
    /// A spline or an arc.
    Straight,
    Yaw,
    /// An altitude above the terrain.
    Terrain,
    /// An altitude above sea level in a plan with a home above it.
    SeaLevel,
    /// A circle too small for this airspeed, m/s; it needs this radius, m.
    Widened {
        /// True airspeed when the circle begins, m/s.
        airspeed_m_s: f64,
        /// Smallest radius, m.
        radius_m: f64,
    },
    /// A corner that is too tight for its airspeed.
    Corner(TightCorner),
    /// A landing from too high.
    Glide(SteepGlide),
}

impl Note {
    fn text(self) -> String {
        match self {
            Self::Home => "taken as home and not flown".into(),
            Self::HoldTime => "hold time is not flown, a wing cannot stand still".into(),
            Self::Acceptance => "acceptance radius is below NAV_ACC_RAD and not used".into(),
            Self::GroundSpeed => "ground speed is flown as true airspeed".into(),
            Self::Throttle => "throttle is not used, the speed has its own law".into(),
            Self::Pass => "pass radius is not used, the aircraft flies through the point".into(),
            Self::Straight => "flown straight to its point".into(),
            Self::Yaw => "a wing does not turn on the spot: not used".into(),
            Self::Terrain => "altitude above terrain counts from home".into(),
            Self::SeaLevel => "altitude above sea level counts from the home of the plan".into(),
            Self::Widened { airspeed_m_s, radius_m } => {
                format!("at {airspeed_m_s:.0} m/s the circle needs {radius_m:.0} m and is widened")
            }
            Self::Corner(TightCorner { leg_m, needed_m, airspeed_m_s, .. }) => format!(
                "at {airspeed_m_s:.0} m/s the turn needs legs of {needed_m:.0} m, has {leg_m:.0} m and is flown wide"
            ),
            Self::Glide(SteepGlide { height_m, distance_m, needed_m, .. }) => format!(
                "from {height_m:.0} m above it the glide needs {needed_m:.0} m, has {distance_m:.0} m and leads behind the point"
            ),
        }
    }
}

/// Items that a note names.
const NAMED_MAX: usize = 8;

/// The notes of a plan, one of each kind, with the items: all of them matter where the path is another one.
#[derive(Debug, Clone, Default)]
pub struct Notes(Vec<(Note, Vec<u16>)>);

impl Notes {
    /// Adds a note about an item.
    pub fn add(&mut self, note: Note, item: u16) {
        let same = |known: &&mut (Note, Vec<u16>)| {
            core::mem::discriminant(&known.0) == core::mem::discriminant(&note)
        };
        match self.0.iter_mut().find(same) {
            Some((_, items)) => items.push(item),
            None => self.0.push((note, vec![item])),
        }
    }

    /// The notes as texts.
    pub fn texts(&self) -> impl Iterator<Item = String> + '_ {
        self.0.iter().map(|(note, items)| {
            let named = if matches!(note, Note::Corner(_)) { NAMED_MAX } else { 1 };
            let plural = if items.len() > 1 && named > 1 { "s" } else { "" };
            let names: Vec<_> = items.iter().take(named).map(u16::to_string).collect();
            let more = match items.len().saturating_sub(named) {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            format!("Mission item{plural} {}{more}: {}", names.join(", "), note.text())
        })
    }
}
