//! What a tick of a mode makes of the references: sticks, circles, setpoints, and the altitude demand to the laws.

use flight_control::Demand;
use flight_control::guidance::{Horizontal, Steering, follow_circle};

use super::Situation;
use super::geodesy::{LocalAxes, Site};
use super::plan::Circle;
use super::request::{Airspeed, Reference, Reposition, Setpoint, Sticks, Target, VehicleRefusal};
use super::rules::{Rules, within};

/// The circle that Hold flies.
///
/// Without a point the circle touches the present track a roll-in ahead, to the right (or to the left if the
/// request says so): a jet that should stay here begins to turn, instead of flying back over the point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// Known from the first tick on.
    centre: Option<Site>,
    radius_m: Option<f64>,
    clockwise: bool,
}

impl Default for Hold {
    /// At the present position, to the right, with the radius of the parameter.
    fn default() -> Self {
        Self { centre: None, radius_m: None, clockwise: true }
    }
}

impl Hold {
    pub fn around(orbit: Orbit) -> Self {
        Self { centre: Some(orbit.centre), radius_m: orbit.radius_m, clockwise: orbit.clockwise }
    }

    /// Applies the values of a request; the others stay.
    pub fn reposition(&mut self, request: &Reposition) {
        self.centre = request.place.map(Site::at).or(self.centre);
        self.radius_m = request.radius_m.or(self.radius_m);
        self.clockwise = request.clockwise.unwrap_or(self.clockwise);
    }

    pub fn fly(&mut self, situation: &Situation, demand: &Demand) -> Flown {
        let Self { radius_m, clockwise, .. } = *self;
        let here = || Orbit::here(situation, radius_m, clockwise, demand).centre;
        let centre = *self.centre.get_or_insert_with(here);
        Orbit { centre, radius_m, clockwise }.fly(situation, demand)
    }
}

/// A circle around a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orbit {
    pub centre: Site,
    /// Radius of the request, m; `None`: the parameter `NAV_LOITER_RAD`.
    pub radius_m: Option<f64>,
    /// Direction, seen from above.
    pub clockwise: bool,
}

/// A command of the guidance, and its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flown {
    /// For the roll reference.
    pub steering: Steering,
    /// The target, if it is a point.
    pub target: Option<Target>,
}

impl Orbit {
    /// To the right, with the radius of the parameter.
    pub fn around(centre: Site) -> Self {
        Self { centre, radius_m: None, clockwise: true }
    }

    /// That of an item of a plan.
    pub fn of(circle: &Circle, situation: &Situation, demand: &Demand) -> Self {
        let Circle { centre, radius_m, clockwise } = *circle;
        match centre.place {
            Some(place) => Self { centre: Site::at(place), radius_m, clockwise },
            None => Self::here(situation, radius_m, clockwise, demand),
        }
    }

    /// A circle that the present track touches: the aircraft only has to roll in.
    pub fn here(
        situation: &Situation,
        radius_m: Option<f64>,
        clockwise: bool,
        demand: &Demand,
    ) -> Self {
        let circle = Self { centre: situation.horizon().site, radius_m, clockwise };
        let (sin, cos) = libm::sincos(situation.course_rad());
        let ahead = Horizontal::new(cos, sin);
        let side = if clockwise { 1.0 } else { -1.0 };
        let abeam = Horizontal::new(-sin, cos) * side;
        let radius_m = circle.flown_radius_m(situation, demand);
        // The circle begins when the aircraft has rolled in.
        let centre = ahead * (situation.speed_m_s * situation.rules.roll_in_s()) + abeam * radius_m;
        Self { centre: Site::at(situation.horizon().place_at(&centre)), ..circle }
    }

    /// The radius flown, m: that of the request, or the smallest possible one.
    pub fn flown_radius_m(&self, situation: &Situation, demand: &Demand) -> f64 {
        let radius_m = self.radius_m.unwrap_or(situation.rules.navigation.loiter_radius_m);
        // In this wind the aircraft may be as fast over the ground.
        let fastest_m_s = demand.airspeed_m_s + situation.wind_m_s;
        radius_m.max(situation.rules.smallest_circle_m(fastest_m_s))
    }

    /// One tick on the way to the circle or on it.
    pub fn fly(&self, situation: &Situation, demand: &Demand) -> Flown {
        let Situation { velocity, rules, .. } = situation;
        let radius_m = self.flown_radius_m(situation, demand);
        let centre = situation.horizon().offset(&self.centre);
        let guidance = rules.guidance();
        let steering = follow_circle(&centre, radius_m, self.clockwise, velocity, &guidance);
        let target = target(&self.centre, &centre, demand.altitude_m, Some(radius_m));
        Flown { steering, target: Some(target) }
    }
}

/// The target for telemetry.
pub fn target(site: &Site, offset: &Horizontal, altitude_m: f64, radius_m: Option<f64>) -> Target {
    Target {
        place: site.place(),
        altitude_m,
        distance_m: offset.norm(),
        bearing_rad: libm::atan2(offset.y, offset.x),
        radius_m,
    }
}

/// Altitude, in which a pilot's sticks give roll angle, climb and airspeed: the latest stick positions; centred until the first
/// ones come.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pilot {
    pub sticks: Option<Sticks>,
    climb: ClimbReference,
}

impl Pilot {
    pub fn fly(&mut self, situation: &Situation, demand: &mut Demand) {
        let rules = situation.rules;
        let Some(sticks) = self.sticks else { return };
        demand.roll_rad = sticks.roll * rules.roll_max_rad();
        let climb_m_s = sticks.climb * rules.navigation.climb_max_m_s;
        demand.altitude_m = self.climb.step(demand.altitude_m, climb_m_s, situation);
        if let Some(throttle) = sticks.throttle {
            demand.airspeed_m_s = rules.airspeed_of_throttle(throttle, demand.altitude_m);
        }
    }
}

pub fn check_sticks(sticks: &Sticks) -> Result<(), VehicleRefusal> {
    within("roll stick", "of 1", sticks.roll, (-1.0, 1.0))?;
    within("climb stick", "of 1", sticks.climb, (-1.0, 1.0))?;
    sticks.throttle.map_or(Ok(()), |value| within("throttle", "of 1", value, (0.0, 1.0)))
}

/// Rate at which a persistent altitude error is added to the demand to the laws, 1/s: slower than the
/// altitude law, which needs about 10 s.
const TRIM_RATE_PER_S: f64 = 0.025;
/// Largest addition, as a fraction of the largest error that the altitude law sees; a larger error is a climb in
/// progress.
const TRIM_MAX: f64 = 0.75;
/// An aircraft that climbs or descends faster than this fraction of `NAV_CLIMB_MAX` has no persistent error.
const STANDING_CLIMB: f64 = 1.0 / 6.0;

/// The altitude demand to the laws in modes that follow a path, a pilot or a stream. A new one starts from the aircraft.
///
/// Differs from the reference in two ways. It moves no faster than `NAV_CLIMB_MAX`, because an aircraft that
/// pushes over has no lift left to turn with. And it is displaced slowly so that no error persists: the altitude
/// law is a deviation from the trim of one airspeed and integrates only near its reference, so away from that
/// airspeed, or steeply banked, it would stay 50 to 200 m beside it. The laws themselves are unchanged;
/// in Position, where a roll reference is flown as given, they get the altitude reference as given too.
#[derive(Debug, Clone, Copy, Default)]
pub struct AltitudeDemand {
    reference_m: Option<f64>,
    added_m: f64,
}

impl AltitudeDemand {
    /// The demand after one tick, m.
    pub fn step(&mut self, reference_m: f64, situation: &Situation) -> f64 {
        let Situation { altitude_m, climb_m_s, dt_s, rules, .. } = *situation;
        let sees_m = rules.altitude.error_max_m;
        // No farther from the aircraft than the law looks anyway.
        let seen = || altitude_m + (reference_m - altitude_m).max(-sees_m).min(sees_m);
        let moved = self.reference_m.unwrap_or_else(seen);
        let most = rules.navigation.climb_max_m_s * dt_s;
        let moved = moved + (reference_m - moved).clamp(-most, most);
        self.reference_m = Some(moved);
        let error = moved - altitude_m;
        if error.abs() < sees_m {
            let standing_m_s = STANDING_CLIMB * rules.navigation.climb_max_m_s;
            let standing = (1.0 - climb_m_s.abs() / standing_m_s).max(0.0);
            let change = TRIM_RATE_PER_S * standing * error * dt_s;
            let most = TRIM_MAX * sees_m;
            self.added_m = (self.added_m + change).max(-most).min(most);
        }
        moved + self.added_m
    }
}

/// The reference leads the aircraft by at most the climb during this time, s: about
/// the lag of the altitude law behind a ramp.
const AHEAD_S: f64 = 12.0;
/// When the climb ends the reference is where the aircraft will be after this time, s.
const LEVEL_OFF_S: f64 = 3.0;

/// An altitude reference that is moved by a climb rate.
#[derive(Debug, Clone, Copy, Default)]
struct ClimbReference {
    moving: bool,
}

impl ClimbReference {
    /// The reference after one tick, m. At a climb rate of zero it stays constant; when the climb rate
    /// becomes zero it moves to the aircraft, so that releasing the stick ends the climb.
    fn step(&mut self, reference_m: f64, climb_m_s: f64, situation: &Situation) -> f64 {
        let moving = climb_m_s != 0.0;
        let stopped = self.moving && !moving;
        self.moving = moving;
        let reference_m = if stopped {
            situation.altitude_m + situation.climb_m_s * LEVEL_OFF_S
        } else if moving {
            let ahead = climb_m_s.abs() * AHEAD_S;
            (reference_m + climb_m_s * situation.dt_s)
                .clamp(situation.altitude_m - ahead, situation.altitude_m + ahead)
        } else {
            return reference_m;
        };
        situation.rules.nearest_altitude_m(reference_m)
    }
}

/// A stick that is closer to its centre counts as centred, of 1.
const CENTRE: f64 = 0.05;
/// A throttle stick counts as moved when it is this far from its earlier position, of 1. A resting one does not change an
/// airspeed reference of a ground station.
const THROTTLE_MOVED: f64 = 0.01;
/// The course is taken at the moment when the bank angle falls below this, rad (3 deg): at 264 m/s such a bank turns
/// the course by 0.1 deg/s.
const LEVEL_RAD: f64 = 0.052_359_88;
/// The course is taken when the reference has been level for this time, s: a fault can prevent level wings.
const LEVEL_OUT_S: f64 = 3.0;

/// Source of the roll reference.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Lateral {
    /// Wings level, by reference for this many seconds; then the course of that moment.
    LevelOut(f64),
    /// The guidance holds this course, rad from north.
    Course(f64),
    /// The present roll reference.
    Roll,
}

/// State of the mode Position: given references, or a pilot's sticks. Without either the aircraft holds altitude, course
/// and speed. A flight begins in this mode.
///
/// Like PX4's Position for fixed wing, except that the line is a course over the ground and not a track: it has a
/// direction but no location. An explicit roll reference, including zero, replaces the course until a course
/// reference, the roll stick or a new entry into the mode replaces it.
#[derive(Debug, Clone, Copy)]
pub struct Position {
    lateral: Lateral,
    pub sticks: Option<Sticks>,
    throttle: Option<f64>,
    climb: ClimbReference,
}

impl Default for Position {
    /// Levels the wings and then holds the course.
    fn default() -> Self {
        Self {
            lateral: Lateral::LevelOut(0.0),
            sticks: None,
            throttle: None,
            climb: ClimbReference::default(),
        }
    }
}

impl Position {
    /// Holds a course, rad from north.
    pub fn hold(&mut self, course_rad: f64) {
        self.lateral = Lateral::Course(course_rad);
    }

    /// Leaves the roll reference as it was set.
    pub fn release_roll(&mut self) {
        self.lateral = Lateral::Roll;
    }

    /// Whether the laws get given references only.
    pub fn is_as_given(&self) -> bool {
        self.lateral == Lateral::Roll && self.sticks.is_none()
    }

    /// One tick; `None` if the roll reference stays unchanged.
    pub fn fly(&mut self, situation: &Situation, demand: &mut Demand) -> Option<Flown> {
        let rules = situation.rules;
        if let Some(sticks) = self.sticks {
            // Climb rate of the pitch stick, airspeed of a throttle stick that has moved.
            let climb = if is_deflected(sticks.climb) { sticks.climb } else { 0.0 };
            let climb_m_s = climb * rules.navigation.climb_max_m_s;
            demand.altitude_m = self.climb.step(demand.altitude_m, climb_m_s, situation);
            let has_moved = |throttle: &f64| {
                self.throttle.is_none_or(|before| (throttle - before).abs() > THROTTLE_MOVED)
            };
            if let Some(throttle) = sticks.throttle.filter(has_moved) {
                self.throttle = Some(throttle);
                demand.airspeed_m_s = rules.airspeed_of_throttle(throttle, demand.altitude_m);
            }
            if is_deflected(sticks.roll) {
                demand.roll_rad = sticks.roll * rules.roll_max_rad();
                self.lateral = Lateral::LevelOut(0.0);
                return None;
            }
        }
        if let Lateral::LevelOut(level_s) = &mut self.lateral
            // While the slew brings the reference to zero the aircraft still turns.
            && demand.roll_rad == 0.0
        {
            let is_level = situation.bank_rad.abs() < LEVEL_RAD;
            if is_level || *level_s >= LEVEL_OUT_S {
                self.lateral = Lateral::Course(situation.course_rad());
            } else {
                *level_s += situation.dt_s;
            }
        }
        let course_rad = situation.course_rad();
        // Levels the wings; the course is the present one.
        let level = Steering { bank_rad: 0.0, course_rad, cross_track_m: 0.0 };
        match self.lateral {
            Lateral::LevelOut(_) => Some(Flown { steering: level, target: None }),
            Lateral::Course(course_rad) => Some(situation.hold_course(course_rad)),
            Lateral::Roll => None,
        }
    }
}

fn is_deflected(stick: f64) -> bool {
    stick.abs() >= CENTRE
}

/// Largest local coordinate, m.
const LOCAL_MAX_M: f64 = 1_000_000.0;
/// Largest speed or climb rate of a velocity setpoint before it is limited, m/s.
const VELOCITY_MAX_M_S: f64 = 1_000.0;

/// Command of the latest setpoint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Guidance {
    /// The present roll reference.
    #[default]
    Roll,
    /// A circle around a place.
    Circle(Orbit),
    /// A course (rad; `None` until the first tick) and a climb rate.
    Velocity { course_rad: Option<f64>, climb_m_s: f64 },
}

/// Offboard: setpoints of a ground station's stream.
///
/// Until the first one the references stay unchanged. A roll angle, a place and its altitude are refused
/// outside the limits. A velocity is limited instead: its speed to the airspeed limits, its climb rate to
/// `NAV_CLIMB_MAX`, the resulting altitude to the altitude limits.
#[derive(Debug, Clone, Copy, Default)]
pub struct Offboard {
    guidance: Guidance,
    climb: ClimbReference,
}

impl Offboard {
    pub fn take(
        &mut self,
        setpoint: Setpoint,
        axes: Option<&LocalAxes>,
        demand: &mut Demand,
        rules: &Rules,
    ) -> Result<(), VehicleRefusal> {
        match setpoint {
            Setpoint::Roll(roll_rad) => {
                rules.limits.check(Reference::Roll(roll_rad), demand.altitude_m)?;
                demand.roll_rad = roll_rad;
                self.guidance = Guidance::Roll;
            }
            Setpoint::Position { place, altitude_m } => {
                rules.check_some(Some(place), altitude_m)?;
                demand.altitude_m = altitude_m.unwrap_or(demand.altitude_m);
                self.guidance = Guidance::Circle(Orbit::around(Site::at(place)));
            }
            Setpoint::LocalPosition(position) => {
                for (what, value) in
                    [("north", position.0.x), ("east", position.0.y), ("down", position.0.z)]
                {
                    within(what, "m", value, (-LOCAL_MAX_M, LOCAL_MAX_M))?;
                }
                let axes = axes.ok_or(VehicleRefusal::NoFlight)?;
                let (place, altitude_m) = axes.place(position);
                let position = Setpoint::Position { place, altitude_m: Some(altitude_m) };
                return self.take(position, None, demand, rules);
            }
            Setpoint::Velocity { course_rad, speed_m_s, climb_m_s } => {
                let rate =
                    |what, value| within(what, "m/s", value, (-VELOCITY_MAX_M_S, VELOCITY_MAX_M_S));
                let course = |course_rad: f64| {
                    within("course", "deg", course_rad.to_degrees(), (-360.0, 360.0))
                };
                course_rad.map_or(Ok(()), course)?;
                speed_m_s.map_or(Ok(()), |value| rate("speed", value))?;
                rate("climb rate", climb_m_s)?;
                if let Some(speed_m_s) = speed_m_s {
                    let airspeed = Airspeed::True(speed_m_s);
                    demand.airspeed_m_s = rules.nearest_airspeed_m_s(airspeed, demand.altitude_m);
                }
                let course_rad = course_rad.or(match self.guidance {
                    Guidance::Velocity { course_rad, .. } => course_rad,
                    _ => None,
                });
                self.guidance = Guidance::Velocity { course_rad, climb_m_s };
            }
        }
        Ok(())
    }

    /// A place is flown to.
    pub fn needs_position(&self) -> bool {
        matches!(self.guidance, Guidance::Circle(_))
    }

    /// One tick; `None` if the roll reference stays unchanged.
    pub fn fly(&mut self, situation: &Situation, demand: &mut Demand) -> Option<Flown> {
        match &mut self.guidance {
            Guidance::Roll => None,
            Guidance::Circle(orbit) => Some(orbit.fly(situation, demand)),
            Guidance::Velocity { course_rad, climb_m_s } => {
                let most = situation.rules.navigation.climb_max_m_s;
                let climb_m_s = climb_m_s.clamp(-most, most);
                demand.altitude_m = self.climb.step(demand.altitude_m, climb_m_s, situation);
                let course_rad = course_rad.get_or_insert_with(|| situation.course_rad());
                Some(situation.hold_course(*course_rad))
            }
        }
    }
}
