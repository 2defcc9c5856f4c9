//! Position: given references, or a pilot's sticks. Without either the aircraft holds altitude, course
//! and speed. A flight begins in this mode.
//!
//! Like PX4's Position for fixed wing, except that the line is a course over the ground and not a track: it has a
//! direction but no location. An explicit roll reference, including zero, replaces the course until a course
//! reference, the roll stick or a new entry into the mode replaces it.

use flight_control::Demand;
use flight_control::guidance::{Steering, hold_course};

use super::VehicleRefusal;
use super::altitude::ClimbReference;
use super::altitude::check;
use super::circle::Flown;
use super::request::Sticks;
use super::rules::Rules;
use super::situation::Situation;

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

/// State of the mode Position.
#[derive(Debug, Clone, Copy)]
pub struct Position {
    lateral: Lateral,
    sticks: Option<Sticks>,
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

    pub fn take(&mut self, sticks: Sticks) -> Result<(), VehicleRefusal> {
        check(&sticks)?;
        self.sticks = Some(sticks);
        Ok(())
    }

    /// One tick; `None` if the roll reference stays unchanged.
    pub fn fly(
        &mut self,
        situation: &Situation,
        demand: &mut Demand,
        rules: &Rules,
    ) -> Option<Flown> {
        if let Some(sticks) = self.sticks {
            self.follow(&sticks, situation, demand, rules);
            if is_deflected(sticks.roll) {
                demand.roll_rad = sticks.roll * rules.roll_max_rad();
                self.lateral = Lateral::LevelOut(0.0);
                return None;
            }
        }
        if let Lateral::LevelOut(level_s) = &mut self.lateral
            && demand.roll_rad == 0.0
        {
            let is_level = situation.bank_rad.abs() < LEVEL_RAD;
            if is_level || *level_s >= LEVEL_OUT_S {
                self.lateral = Lateral::Course(situation.course_rad());
            } else {
                *level_s += situation.dt_s;
            }
        }
        let steering = match self.lateral {
            Lateral::LevelOut(_) => level(situation),
            Lateral::Course(course_rad) => {
                hold_course(course_rad, &situation.velocity, &rules.guidance())
            }
            Lateral::Roll => return None,
        };
        Some(Flown { steering, target: None })
    }

    /// Climb rate of the pitch stick, airspeed of a throttle stick that has moved.
    fn follow(
        &mut self,
        sticks: &Sticks,
        situation: &Situation,
        demand: &mut Demand,
        rules: &Rules,
    ) {
        let climb = if is_deflected(sticks.climb) { sticks.climb } else { 0.0 };
        let climb_m_s = climb * rules.navigation.climb_max_m_s;
        demand.altitude_m = self.climb.step(demand.altitude_m, climb_m_s, situation, rules);
        let Some(throttle) = sticks.throttle else { return };
        if self.throttle.is_none_or(|before| (throttle - before).abs() > THROTTLE_MOVED) {
            self.throttle = Some(throttle);
            demand.airspeed_m_s = rules.airspeed_of_throttle(throttle, demand.altitude_m);
        }
    }
}

fn is_deflected(stick: f64) -> bool {
    stick.abs() >= CENTRE
}

/// Levels the wings; the course is the present one.
fn level(situation: &Situation) -> Steering {
    Steering { bank_rad: 0.0, course_rad: situation.course_rad(), cross_track_m: 0.0 }
}
