//! The aircraft on the ground: armed or not, the roll to the takeoff, and the rollout. What the law on the ground is to do follows
//! from it ([`GroundDemand`]).

use core::f64::consts::TAU;

use flight_control::guidance::Horizontal;
use flight_control::{GroundDemand, NavigationState};

use super::geodesy::{Horizon, Site};
use super::request::{Place, VehicleEvent, VehicleRefusal};
use super::rules::Rules;

/// Slower than this the aircraft stands, m/s; after this time standing it is disarmed, s.
const STANDING_M_S: f64 = 0.3;
const DISARM_AFTER_S: f64 = 2.0;
/// Faster than this it is not disarmed, m/s: its brakes would stop it without being steered.
const DISARM_MAX_M_S: f64 = 2.0;
/// A roll that takes longer than this is given up, s.
const ROLL_MAX_S: f64 = 90.0;
/// Wheels that touch again so soon after the lift-off, s, and fast enough for another one, belong to the takeoff.
const BOUNCE_S: f64 = 2.0;
/// One that has become slower than this part of the speed of the rotation does not fly.
const FAST_OVER_ROTATION: f64 = 0.9;
/// An aircraft that points this far off the line of its roll, rad, is not steered any more.
const ASTRAY_RAD: f64 = 1.0;
/// Rollout: the nose comes down to this pitch angle, rad, first, or for this time, s; then the brakes come on over this time, s, to this
/// part.
const NOSE_DOWN_RAD: f64 = 0.03;
const NOSE_DOWN_MAX_S: f64 = 6.0;
const BRAKES_S: f64 = 2.0;
const BRAKES: f64 = 0.7;
/// The centre line is approached over the way of this time, s, but at least over this distance, m, and at most at this angle, rad.
const LINE_S: f64 = 2.5;
const LINE_MIN_M: f64 = 15.0;
const LINE_MAX_RAD: f64 = 0.2;

/// A straight line over the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CentreLine {
    pub through: Site,
    /// Its course, rad from north.
    pub course_rad: f64,
}

impl CentreLine {
    /// Heading that leads to the line and along it, rad from north.
    fn heading_rad(&self, state: &NavigationState) -> f64 {
        let to = Horizon::at(Place::of(state)).offset(&self.through);
        let (sin, cos) = libm::sincos(self.course_rad);
        // Of the line from the aircraft, positive to its right.
        let right_m = Horizontal::new(-sin, cos).dot(&to);
        let speed_m_s = state.velocity.0.xy().norm();
        let along_m = (LINE_S * speed_m_s).max(LINE_MIN_M);
        let towards = libm::atan(right_m / along_m);
        self.course_rad + towards.clamp(-LINE_MAX_RAD, LINE_MAX_RAD)
    }
}

/// What the aircraft does on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum GroundPhase {
    /// It stands with its brakes on, or flies.
    #[default]
    Standing,
    /// It accelerates along a line, or has lifted off so long ago, s.
    Rolling { along: CentreLine, for_s: f64, lifted_off_s: Option<f64> },
    /// It comes to a stop on a line, after a touchdown or an aborted takeoff.
    Stopping { along: CentreLine, for_s: f64, braking_s: f64, standing_s: f64 },
}

/// The ground and the aircraft on it.
#[derive(Debug, Clone, Copy, Default)]
pub struct GroundOperation {
    /// `None` before the first sample: a flight that begins in the air is armed.
    armed: Option<bool>,
    /// The wheels carried it at the last tick.
    on_wheels: bool,
    /// Its speed over the ground there, m/s.
    speed_m_s: f64,
    phase: GroundPhase,
    /// Where the last takeoff began.
    runway: Option<CentreLine>,
    demand: Option<GroundDemand>,
}

impl GroundOperation {
    pub fn is_armed(&self) -> bool {
        self.armed == Some(true)
    }

    pub fn is_on_wheels(&self) -> bool {
        self.on_wheels
    }

    /// It has touched down, or given up a takeoff, and has not stopped yet, whether its wheels touch or not.
    pub fn is_stopping(&self) -> bool {
        matches!(self.phase, GroundPhase::Stopping { .. })
    }

    pub fn runway(&self) -> Option<CentreLine> {
        self.runway
    }

    /// Checks that it may be armed, or disarmed.
    pub fn check(&self, armed: bool) -> Result<(), VehicleRefusal> {
        let m_s = self.speed_m_s;
        match (self.on_wheels, armed) {
            (false, _) => Err(VehicleRefusal::InTheAir),
            (true, false) if m_s > DISARM_MAX_M_S => Err(VehicleRefusal::Moving { m_s }),
            _ => Ok(()),
        }
    }

    pub fn set_armed(&mut self, armed: bool, publish: &mut dyn FnMut(VehicleEvent)) {
        if self.armed.replace(armed) != Some(armed) {
            publish(VehicleEvent::Armed(armed));
        }
    }

    /// Takes from the first state whether the flight begins on the ground.
    pub fn see(&mut self, state: &NavigationState) {
        if self.armed.is_none() {
            (self.armed, self.on_wheels) = (Some(!state.on_wheels), state.on_wheels);
        }
    }

    /// What the law on the ground is to do.
    pub fn demand(&self) -> GroundDemand {
        self.demand.unwrap_or(GroundDemand::STAND)
    }

    /// One tick of `dt_s`. `wants_takeoff`: the mode leads into the air; `along` is the line of the approach that ends now. Whether the
    /// aircraft has just touched down.
    pub fn step(
        &mut self,
        state: &NavigationState,
        rules: &Rules,
        dt_s: f64,
        wants_takeoff: bool,
        along: Option<CentreLine>,
        publish: &mut dyn FnMut(VehicleEvent),
    ) -> bool {
        self.see(state);
        let was_on_wheels = core::mem::replace(&mut self.on_wheels, state.on_wheels);
        let speed_m_s = state.velocity.0.xy().norm();
        self.speed_m_s = speed_m_s;
        if !state.on_wheels {
            if let GroundPhase::Rolling { lifted_off_s, .. } = &mut self.phase {
                if lifted_off_s.is_none() {
                    publish(VehicleEvent::LiftOff);
                }
                let since_s = lifted_off_s.map_or(0.0, |since_s| since_s + dt_s);
                *lifted_off_s = Some(since_s);
                if since_s > BOUNCE_S {
                    self.phase = GroundPhase::Standing;
                }
            }
            return false;
        }
        let measured = if state.valid.airspeed { state.airspeed_m_s } else { speed_m_s };
        let rotation_m_s = rules.rotation_m_s(state.altitude_m);
        let (rotates, is_fast) =
            (measured >= rotation_m_s, measured >= FAST_OVER_ROTATION * rotation_m_s);
        let goes_on = wants_takeoff && is_fast;
        if !was_on_wheels && matches!(self.phase, GroundPhase::Rolling { .. }) && !goes_on {
            self.phase = GroundPhase::Standing;
        }
        let here = |course_rad| CentreLine { through: Site::at(Place::of(state)), course_rad };
        let mut has_touched_down = false;
        if !was_on_wheels && self.phase == GroundPhase::Standing && speed_m_s > STANDING_M_S {
            let course = || here(libm::atan2(state.velocity.0.y, state.velocity.0.x));
            let along = along.unwrap_or_else(course);
            self.phase =
                GroundPhase::Stopping { along, for_s: 0.0, braking_s: 0.0, standing_s: 0.0 };
            has_touched_down = self.is_armed();
        }
        if !self.is_armed() {
            self.phase = GroundPhase::Standing;
            self.demand = Some(GroundDemand::STAND);
            return has_touched_down;
        }
        self.demand = Some(match &mut self.phase {
            GroundPhase::Standing if wants_takeoff => {
                let along = here(state.attitude.psi);
                self.runway = Some(along);
                self.phase = GroundPhase::Rolling { along, for_s: 0.0, lifted_off_s: None };
                GroundDemand { heading_rad: Some(along.course_rad), ..GroundDemand::STAND }
            }
            GroundPhase::Standing => GroundDemand::STAND,
            GroundPhase::Rolling { along, for_s, lifted_off_s } => {
                *for_s += dt_s;
                let along = *along;
                let is_slow = lifted_off_s.is_some() && !is_fast;
                let off_rad = libm::remainder(state.attitude.psi - along.course_rad, TAU);
                let is_astray = off_rad.abs() > ASTRAY_RAD;
                if *for_s > ROLL_MAX_S || !wants_takeoff || is_slow || is_astray {
                    self.phase = GroundPhase::Stopping {
                        along,
                        for_s: 0.0,
                        braking_s: 0.0,
                        standing_s: 0.0,
                    };
                    publish(VehicleEvent::TakeoffAborted);
                }
                GroundDemand {
                    heading_rad: Some(along.heading_rad(state)),
                    pitch_rad: rotates.then_some(rules.takeoff_pitch_rad()),
                    full_thrust: true,
                    brakes: 0.0,
                }
            }
            GroundPhase::Stopping { along, for_s, braking_s, standing_s } => {
                *for_s += dt_s;
                *standing_s = if speed_m_s < STANDING_M_S { *standing_s + dt_s } else { 0.0 };
                let is_up = state.attitude.theta > NOSE_DOWN_RAD && *for_s < NOSE_DOWN_MAX_S;
                *braking_s = if is_up { 0.0 } else { *braking_s + dt_s };
                let (along, brakes) = (*along, BRAKES * (*braking_s / BRAKES_S).min(1.0));
                if *standing_s > DISARM_AFTER_S {
                    self.phase = GroundPhase::Standing;
                    self.set_armed(false, publish);
                }
                GroundDemand {
                    heading_rad: Some(along.heading_rad(state)),
                    // Dropped, it would take the load off the main wheels, which keep the aircraft straight.
                    pitch_rad: is_up.then_some(0.0),
                    full_thrust: false,
                    brakes,
                }
            }
        });
        has_touched_down
    }
}
