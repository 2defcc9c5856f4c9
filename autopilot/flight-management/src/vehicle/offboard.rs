//! Offboard: setpoints of a ground station's stream.
//!
//! Until the first one the references stay unchanged. A roll angle, a place and its altitude are refused
//! outside the limits. A velocity is limited instead: its speed to the airspeed limits, its climb rate to
//! `NAV_CLIMB_MAX`, the resulting altitude to the altitude limits.

use flight_control::Demand;
use flight_control::guidance::hold_course;

use super::VehicleRefusal;
use super::altitude::ClimbReference;
use super::circle::{Flown, Orbit};
use super::geodesy::{LocalAxes, Site};
use super::request::{Airspeed, Reference, Setpoint};
use super::rules::{Checked, Rules};
use super::situation::Situation;

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
                self.circle(Site::at(place));
            }
            Setpoint::LocalPosition(position) => {
                for (what, value) in
                    [("north", position.0.x), ("east", position.0.y), ("down", position.0.z)]
                {
                    let (min, max) = (-LOCAL_MAX_M, LOCAL_MAX_M);
                    Checked { what, unit: "m", value, min, max }.check()?;
                }
                let axes = axes.ok_or(VehicleRefusal::NoFlight)?;
                let (place, altitude_m) = axes.place(position);
                return self.take(
                    Setpoint::Position { place, altitude_m: Some(altitude_m) },
                    None,
                    demand,
                    rules,
                );
            }
            Setpoint::Velocity { course_rad, speed_m_s, climb_m_s } => {
                check_velocity(course_rad, speed_m_s, climb_m_s)?;
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

    fn circle(&mut self, centre: Site) {
        self.guidance = Guidance::Circle(Orbit { centre, radius_m: None, clockwise: true });
    }

    /// One tick; `None` if the roll reference stays unchanged.
    pub fn fly(
        &mut self,
        situation: &Situation,
        demand: &mut Demand,
        rules: &Rules,
    ) -> Option<Flown> {
        match &mut self.guidance {
            Guidance::Roll => None,
            Guidance::Circle(orbit) => Some(orbit.fly(situation, demand, rules)),
            Guidance::Velocity { course_rad, climb_m_s } => {
                let most = rules.navigation.climb_max_m_s;
                let climb_m_s = climb_m_s.clamp(-most, most);
                demand.altitude_m = self.climb.step(demand.altitude_m, climb_m_s, situation, rules);
                let course = *course_rad.get_or_insert_with(|| situation.course_rad());
                let steering = hold_course(course, &situation.velocity, &rules.guidance());
                Some(Flown { steering, target: None })
            }
        }
    }
}

fn check_velocity(
    course_rad: Option<f64>,
    speed_m_s: Option<f64>,
    climb_m_s: f64,
) -> Result<(), VehicleRefusal> {
    let rate = |what, value| Checked {
        what,
        unit: "m/s",
        value,
        min: -VELOCITY_MAX_M_S,
        max: VELOCITY_MAX_M_S,
    };
    let course = course_rad.map(|course_rad| Checked {
        what: "course",
        unit: "deg",
        value: course_rad.to_degrees(),
        min: -360.0,
        max: 360.0,
    });
    let checks = [course, speed_m_s.map(|value| rate("speed", value))];
    for checked in checks.into_iter().flatten() {
        checked.check()?;
    }
    rate("climb rate", climb_m_s).check()
}
