//! A plan during upload: every item is checked on receipt, and the whole plan takes effect at the end.
//!
//! An item's command becomes an [`Action`]; its fields are finite numbers in range, or the reason of a refusal. Notes report
//! the differences between an accepted item and its flight, once, when the plan is in force.

use ::mavlink::dialects::common::MavMissionResult as R;
use ::mavlink::dialects::common::MavMissionResult::{
    MAV_MISSION_INVALID_PARAM1 as P1, MAV_MISSION_INVALID_PARAM2 as P2,
    MAV_MISSION_INVALID_PARAM3 as P3, MAV_MISSION_INVALID_PARAM4 as P4,
    MAV_MISSION_INVALID_PARAM5_X as X, MAV_MISSION_INVALID_PARAM6_Y as Y,
    MAV_MISSION_INVALID_PARAM7 as Z,
};

use crate::codec::MissionItem;
use crate::convert;
use crate::mission::Stored;
use flight_management::command::VehicleCommand;
use flight_management::parameters::ReferenceLimits;
use flight_management::vehicle::geodesy::{Horizon, Site};
use flight_management::vehicle::plan::{Action, Circle, ITEMS_MAX, Item, Plan, Point};
use flight_management::vehicle::rules::Rules;
use flight_management::vehicle::{Airspeed, Place, Reference, Reposition};

/// Longest leg, m. A longer one ends on another continent: latitude and longitude exchanged, or a plan
/// for another aircraft.
const LEG_MAX_M: f64 = 5.0e6;

/// Items received, in order.
#[derive(Debug)]
pub struct Draft {
    /// Number of items to come in all.
    pub count: u16,
    wire: Vec<MissionItem<i32>>,
    items: Vec<Item>,
    /// Item 0, taken as home until an item shows that it is a waypoint.
    home: Option<MissionItem<i32>>,
    /// The last point so far.
    place: Option<Place>,
    /// Airspeed reference so far.
    airspeed: Option<Airspeed>,
    notes: Notes,
}

/// A plan whose items have all been received.
#[derive(Debug)]
pub struct Finished {
    pub stored: Stored,
    pub plan: Plan,
    /// Differences between the two.
    pub notes: Notes,
}

impl Draft {
    /// Waits for this many items. `place` and `airspeed` are the present ones of the aircraft.
    pub fn new(
        count: u16,
        place: Option<Place>,
        airspeed: Option<Airspeed>,
    ) -> Result<Self, Rejected> {
        if usize::from(count) > ITEMS_MAX {
            return Err(Rejected {
                result: R::MAV_MISSION_NO_SPACE,
                reason: format!("{count} items are more than {ITEMS_MAX}"),
            });
        }
        let (wire, items, notes) = (Vec::new(), Vec::new(), Notes::default());
        Ok(Self { count, wire, items, home: None, place, airspeed, notes })
    }

    /// The item to request next.
    pub fn next(&self) -> u16 {
        u16::try_from(self.items.len()).unwrap_or(u16::MAX)
    }

    /// All items have been received.
    pub fn is_complete(&self) -> bool {
        self.next() >= self.count
    }

    /// Adds the next item. An item 0 that is the home position of a file (`QGC WPL 110`) leads to item 1, so that the
    /// targets of jumps stay right.
    pub fn take(&mut self, item: &MissionItem<i32>, rules: &Rules) -> Result<(), Rejected> {
        let seq = self.next();
        // A plan of one item has nothing behind its home that could be flown.
        let flown = if seq == 0 && self.count > 1 && may_be_home(item) {
            self.home = Some(*item);
            Item { action: Action::Jump { to: 1, times: None }, autocontinue: true }
        } else {
            self.settle_home(item, rules)?;
            self.check(item, seq, rules)?
        };
        self.items.push(flown);
        self.wire.push(*item);
        Ok(())
    }

    /// Decides what item 0 is when the first item that is flown arrives: a waypoint where that item is absolute too and
    /// the altitude could be flown, else home.
    fn settle_home(&mut self, item: &MissionItem<i32>, rules: &Rules) -> Result<(), Rejected> {
        let Some(first) = self.home.take_if(|_| !is_immediate(item)) else { return Ok(()) };
        let is_low = first.z <= 0.0 || f64::from(first.z) < rules.limits.altitude_min_m;
        if !is_absolute(item) || is_low {
            self.notes.add(Note::Home, 0);
            return Ok(());
        }
        let waypoint = self.check(&first, 0, rules)?;
        if let Some(item) = self.items.first_mut() {
            *item = waypoint;
        }
        Ok(())
    }

    /// The item as flown. A delay is flown at the point before it.
    fn check(
        &mut self,
        item: &MissionItem<i32>,
        seq: u16,
        rules: &Rules,
    ) -> Result<Item, Rejected> {
        let mut taken = action(item, rules, &mut |note| self.notes.add(note, seq));
        if let (DELAY, Ok(Action::LoiterTime { circle, .. })) = (item.words.command, &mut taken) {
            circle.centre.place = self.place;
        }
        let taken = taken.and_then(|action| self.follow(&action, rules).map(|()| action));
        let action = taken.map_err(|Rejected { result, reason }| Rejected {
            result,
            reason: format!("item {seq}: {reason}"),
        })?;
        Ok(Item { action, autocontinue: item.words.autocontinue })
    }

    /// Checks an action against the earlier ones, and records what it changes for the later ones.
    fn follow(&mut self, action: &Action, rules: &Rules) -> Result<(), Rejected> {
        match action {
            Action::Waypoint { point, .. } => self.go_to(point.place)?,
            Action::LoiterUnlimited(circle)
            | Action::LoiterToAltitude(circle)
            | Action::LoiterTurns { circle, .. }
            | Action::LoiterTime { circle, .. } => {
                self.go_to(circle.centre.place)?;
                self.circle(circle, rules);
            }
            Action::ChangeSpeed { airspeed } => self.airspeed = Some(*airspeed),
            Action::Jump { to, .. } if *to >= self.count => {
                let last = self.count.saturating_sub(1);
                let reason = format!("jump to item {to} is outside 0 to {last}");
                return Err(Rejected::param(P1, reason));
            }
            Action::ChangeAltitude { .. } | Action::Jump { .. } | Action::Return => {}
        }
        Ok(())
    }

    fn go_to(&mut self, place: Option<Place>) -> Result<(), Rejected> {
        let (Some(from), Some(to)) = (self.place, place) else {
            self.place = place.or(self.place);
            return Ok(());
        };
        let distance_m = Horizon::at(from).offset(&Site::at(to)).norm();
        if distance_m > LEG_MAX_M {
            let (way_km, most_km) = (distance_m / 1.0e3, LEG_MAX_M / 1.0e3);
            let reason = format!("the way there, {way_km:.0} km, is longer than {most_km:.0} km");
            return Err(Rejected::param(X, reason));
        }
        self.place = Some(to);
        Ok(())
    }

    /// A circle that is too small at the airspeed it will have is widened.
    fn circle(&mut self, circle: &Circle, rules: &Rules) {
        let (Some(radius_m), Some(airspeed)) = (circle.radius_m, self.airspeed) else {
            return;
        };
        // Higher up the true airspeed is larger, so the note claims no more than is certain.
        let altitude_m = circle.centre.altitude_m.unwrap_or(rules.limits.altitude_min_m);
        let airspeed_m_s = airspeed.true_m_s(altitude_m);
        let needed_m = rules.smallest_circle_m(airspeed_m_s);
        if radius_m < needed_m {
            self.notes.add(Note::Widened { airspeed_m_s, radius_m: needed_m }, self.next());
        }
    }

    /// The plan, once it is complete.
    pub fn finish(mut self) -> Finished {
        // Nothing behind item 0 was flown, so nothing has shown that it is a waypoint.
        if self.home.is_some() {
            self.notes.add(Note::Home, 0);
        }
        let stored = Stored::new(self.wire);
        let plan = Plan { id: stored.id, items: self.items };
        Finished { stored, plan, notes: self.notes }
    }
}

/// NAV_WAYPOINT; also the command of guided items.
const WAYPOINT: u16 = 16;
const LOITER_UNLIMITED: u16 = 17;
const LOITER_TURNS: u16 = 18;
const LOITER_TIME: u16 = 19;
const RETURN: u16 = 20;
const LAND: u16 = 21;
const TAKEOFF: u16 = 22;
const CHANGE_ALTITUDE: u16 = 30;
const LOITER_TO_ALTITUDE: u16 = 31;
const DELAY: u16 = 93;
const JUMP: u16 = 177;
const CHANGE_SPEED: u16 = 178;
const DO_CHANGE_ALTITUDE: u16 = 186;

/// The aircraft leaves circles with the nose to the next point, whether the item requests it or not.
const HEADING: &str = "heading required";
const AIRSPEED: f64 = 0.0;
const GROUND_SPEED: f64 = 1.0;

/// The action of an item. `note` receives what is flown in another way than the item says.
fn action(
    item: &MissionItem<i32>,
    rules: &Rules,
    note: &mut impl FnMut(Note),
) -> Result<Action, Rejected> {
    let limits = &rules.limits;
    let [p1, p2, p3, p4] = item.params;
    match item.words.command {
        WAYPOINT => waypoint(item, rules, note),
        LOITER_UNLIMITED => Ok(Action::LoiterUnlimited(circle(item, P3, p3, rules)?)),
        LOITER_TURNS => {
            flag(P2, HEADING, p2)?;
            let turns = positive(P1, "number of turns", p1)?;
            Ok(Action::LoiterTurns { circle: circle(item, P3, p3, rules)?, turns })
        }
        LOITER_TIME => {
            flag(P2, HEADING, p2)?;
            let seconds = positive(P1, "time", p1)?;
            let circle = circle(item, P3, p3, rules)?;
            Ok(Action::LoiterTime { circle, seconds })
        }
        LOITER_TO_ALTITUDE => {
            flag(P1, HEADING, p1)?;
            needed_altitude(item, limits)?;
            Ok(Action::LoiterToAltitude(circle(item, P2, p2, rules)?))
        }
        RETURN => Ok(Action::Return),
        TAKEOFF => takeoff(item, rules, note),
        CHANGE_ALTITUDE => {
            // Whether to climb or to descend follows from where the aircraft is.
            let direction = number(P1, "direction", p1)?;
            if direction.is_some_and(|way| ![0.0, 1.0, 2.0].contains(&way)) {
                return Err(Rejected::param(P1, format!("direction {p1} is not 0, 1 or 2")));
            }
            Ok(Action::ChangeAltitude { altitude_m: needed_altitude(item, limits)? })
        }
        DELAY => delay(p1, [p2, p3, p4]),
        JUMP => jump(p1, p2),
        CHANGE_SPEED => change_speed(item.params, rules, note),
        LAND => Err(Rejected::unsupported("there is no landing; end with a circle (17) or 20")),
        DO_CHANGE_ALTITUDE => {
            let reason = "command 186 is not for plans; use NAV_CONTINUE_AND_CHANGE_ALT (30)";
            Err(Rejected::unsupported(reason))
        }
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
    if positive(P1, "hold time", hold)? > 0.0 {
        note(Note::HoldTime);
    }
    none(P3, pass, "only points to fly through, no pass radius")?;
    let acceptance_m = positive(P2, "acceptance radius", acceptance)?;
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
    param: R,
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

/// p1 type, p2 speed, p3 throttle, p4 relative.
fn change_speed(
    [kind, speed, throttle, relative]: [f32; 4],
    rules: &Rules,
    note: &mut impl FnMut(Note),
) -> Result<Action, Rejected> {
    let airspeed: fn(f64) -> Airspeed = match number(P1, "type of speed", kind)? {
        None | Some(AIRSPEED) => Airspeed::Calibrated,
        Some(GROUND_SPEED) => {
            note(Note::GroundSpeed);
            Airspeed::True
        }
        Some(_) => {
            return Err(Rejected::param(P1, format!("type of speed {kind} is not 0 or 1")));
        }
    };
    // 0, -1 and NaN all mean that none is given.
    if throttle > 0.0 {
        return Err(Rejected::param(P3, "there is no throttle reference (p3)"));
    }
    none(P4, relative, "only an absolute speed (p4 = 0)")?;
    let Some(airspeed) = number(P2, "speed", speed)?.map(airspeed) else {
        return Err(Rejected::param(P2, "it needs a speed"));
    };
    let checked = rules.limits.check_airspeed(airspeed);
    checked.map_err(|refusal| Rejected::param(P2, refusal.to_string()))?;
    Ok(Action::ChangeSpeed { airspeed })
}

/// The first item of a file of waypoints (`QGC WPL 110`) is the home position, with this form. A waypoint for PX4 has no
/// yaw (NaN) as its last parameter where nobody has given one.
fn may_be_home(item: &MissionItem<i32>) -> bool {
    item.words.command == WAYPOINT && is_absolute(item) && item.params == [0.0; 4]
}

/// The item is not flown: the next one begins at once.
fn is_immediate(item: &MissionItem<i32>) -> bool {
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
        return Err(Rejected::param(X, "a guided item needs a place"));
    }
    Ok(VehicleCommand::Reposition(Reposition {
        place: point.place,
        altitude_m: point.altitude_m,
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
fn number(param: R, what: &str, value: f32) -> Result<Option<f64>, Rejected> {
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

/// A number that must be 0, 1 or not given.
fn flag(param: R, what: &str, value: f32) -> Result<bool, Rejected> {
    match value {
        1.0 => Ok(true),
        _ if value.is_nan() || value == 0.0 => Ok(false),
        _ => Err(Rejected::param(param, format!("{what} {value} is not 0 or 1"))),
    }
}

/// A whole number of up to 16 bits.
fn word(param: R, what: &str, value: f32) -> Result<u16, Rejected> {
    convert::whole_number(value.into()).ok_or_else(|| {
        Rejected::param(param, format!("{what} {value} is no whole number of 0 to 65535"))
    })
}

/// The place and the altitude of an item; values not given stay unchanged.
fn point(
    item: &MissionItem<i32>,
    zeros: Zeros,
    limits: &ReferenceLimits,
) -> Result<Point, Rejected> {
    Ok(Point { place: place(item, zeros)?, altitude_m: altitude(item, limits)? })
}

/// The altitude of an item above the ellipsoid, m.
fn altitude(item: &MissionItem<i32>, limits: &ReferenceLimits) -> Result<Option<f64>, Rejected> {
    check_frame(item)?;
    let altitude_m = number(Z, "altitude", item.z)?;
    if let Some(altitude_m) = altitude_m {
        let checked = limits.check(Reference::Altitude(altitude_m), altitude_m);
        checked.map_err(|refusal| Rejected::param(Z, refusal.to_string()))?;
    }
    Ok(altitude_m)
}

/// The altitude of an item that requires one.
fn needed_altitude(item: &MissionItem<i32>, limits: &ReferenceLimits) -> Result<f64, Rejected> {
    altitude(item, limits)?.ok_or_else(|| Rejected::param(Z, "it needs an altitude"))
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

/// Whether the altitude is above mean sea level.
fn is_absolute(item: &MissionItem<i32>) -> bool {
    convert::FRAMES_SEA_LEVEL.contains(&item.words.frame)
}

fn check_frame(item: &MissionItem<i32>) -> Result<(), Rejected> {
    let frame = item.words.frame;
    if convert::FRAMES_WITH_ALTITUDE.contains(&frame) {
        return Ok(());
    }
    let reason = format!("frame {frame} is not 0, 3, 5 or 6");
    Err(Rejected { result: R::MAV_MISSION_UNSUPPORTED_FRAME, reason })
}

#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    pub result: R,
    pub reason: String,
}

impl Rejected {
    /// A parameter with a value that cannot be flown, by the result for it.
    fn param(result: R, reason: impl Into<String>) -> Self {
        Self { result, reason: reason.into() }
    }

    fn unsupported(reason: impl Into<String>) -> Self {
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
