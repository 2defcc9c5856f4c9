//! A flight without a controller, from any state: a body that is dropped or thrown, an aircraft with prescribed controls.
//!
//! [`crate::Plant::release`] begins it. Equations, air and integration are those of every other flight.

use host_io::problem::Problem;
use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{Attitude, Body, EulerAngles, Ned, PerEffector};
use nalgebra::Vector3;

use crate::airframe::Airframe;
use crate::atmosphere::Atmosphere;
use crate::earth::{Earth, EarthModel};
use crate::faults::ScheduledFault;
use crate::geodesy::Geodetic;
use crate::range::{check_range, check_vector};
use crate::rigid_body::RigidState;
use crate::wind::{DiscreteGust, WindProfile, WindSettings, check_gusts};

/// Table of a scenario that has the initial state.
const SECTION: &str = "plant.initial_state";

/// Shortest and longest step of the integration, µs.
pub const STEP_RANGE_US: [u32; 2] = [100, 100_000];

/// Everything that defines such a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct ReleaseSetup {
    /// The aircraft, or a body without effectors.
    pub airframe: Airframe,
    pub earth: EarthModel,
    /// Gravity of a flat Earth that stands for a place, m/s²; `None` for standard gravity and its air ([`Earth::tangent`]).
    pub flat_gravity: Option<f64>,
    /// Steady wind and turbulence.
    pub wind: WindSettings,
    pub gusts: Vec<DiscreteGust>,
    /// Wind over the altitude, added to the steady one.
    pub profile: WindProfile,
    /// How much warmer the air is than the standard, K.
    pub temperature_offset_k: f64,
    /// The state at time zero.
    pub initial: InitialState,
    /// The controls at time zero; a trim adds its own.
    pub controls: Controls,
    pub faults: Vec<ScheduledFault>,
    /// Seed of the random streams.
    pub seed: u64,
    /// Step of the integration, µs.
    pub step_us: u32,
}

/// The state at time zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialState {
    pub position: InitialPosition,
    /// Velocity over the ground.
    pub velocity: InitialVelocity,
    /// Attitude relative to local NED: roll, pitch, yaw.
    pub attitude: EulerAngles,
    pub rates: InitialRates,
    /// Search pitch angle, elevator and thrust of a steady flight with this velocity, roll and yaw.
    pub is_trimmed: bool,
}

/// Position at time zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialPosition {
    /// Geodetic coordinates; geocentric ones on a sphere.
    Geodetic(Geodetic),
    /// Metres north, east and down of the point at altitude zero below these coordinates.
    Local {
        /// The point; its altitude does not count.
        origin: Geodetic,
        /// The position in its NED axes, m.
        position: Ned,
    },
}

/// Velocity over the ground at time zero, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialVelocity {
    /// In local NED axes.
    Ned(Ned),
    Body(Body),
}

/// Body rates p, q, r at time zero, rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialRates {
    /// Relative to inertial space.
    Inertial(Body),
    /// Relative to the Earth, which may rotate.
    Earth(Body),
    /// Relative to the local NED axes, which turn with the Earth and with the motion around it.
    Ned(Body),
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Controls {
    /// Positions of the effectors, rad; thrust of an engine without lever, N.
    pub positions: PerEffector<f64>,
    /// Lever of the engine, 0 to 1; `None` without a lever, or where the trim finds it.
    pub lever: Option<f64>,
}

impl ReleaseSetup {
    /// Checks all that can be checked without flying.
    pub fn check(&self) -> Result<(), Problem> {
        self.airframe.check()?;
        self.wind.check()?;
        self.profile.check()?;
        Atmosphere::check(self.temperature_offset_k)?;
        check_gusts(&self.gusts)?;
        self.initial.check()?;
        let gravity = self.flat_gravity.unwrap_or(STANDARD_GRAVITY_M_S2);
        check_range("checkcase", "flat_gravity_m_s2", gravity, 0.1, 30.0)?;
        self.check_controls(&self.controls)?;
        let [least, most] = STEP_RANGE_US.map(|step_us| f64::from(step_us) / 1_000.0);
        check_range("checkcase", "step_ms", f64::from(self.step_us) / 1_000.0, least, most)
    }

    /// Checks that the effectors can be where these controls put them.
    pub fn check_controls(&self, controls: &Controls) -> Result<(), Problem> {
        let Airframe { effectors, servos, .. } = &self.airframe;
        for effector in effectors.all() {
            let servo = &servos[effector];
            let (unit, scale) = if effectors.is_angle(effector) {
                ("deg", 1.0_f64.to_degrees())
            } else {
                ("n", 1.0)
            };
            // The thrust of a lever follows the air.
            if unit == "n" && self.airframe.propulsion.is_some() {
                continue;
            }
            let key = format!("{}_{unit}", effectors.key(effector));
            let value = controls.positions[effector] * scale;
            // A value in degrees at the end of the travel may have been rounded on its way.
            let slack = 1.0e-9 * (servo.max - servo.min) * scale;
            let range = [servo.min * scale - slack, servo.max * scale + slack];
            check_range("plant.controls", &key, value, range[0], range[1])?;
        }
        let percent = controls.lever.unwrap_or(0.0) * 100.0;
        check_range("plant.controls", "throttle_percent", percent, 0.0, 100.0)
    }
}

impl InitialState {
    /// The point in whose NED axes local positions count.
    pub fn origin(&self) -> Geodetic {
        match self.position {
            InitialPosition::Geodetic(here) => here,
            InitialPosition::Local { origin, .. } => origin,
        }
    }

    fn check(&self) -> Result<(), Problem> {
        let here = self.origin();
        check_range(SECTION, "latitude_deg", here.latitude_rad.to_degrees(), -90.0, 90.0)?;
        check_range(SECTION, "longitude_deg", here.longitude_rad.to_degrees(), -360.0, 360.0)?;
        match self.position {
            InitialPosition::Geodetic(at) => {
                check_range(SECTION, "altitude_m", at.altitude_m, 0.0, 80_000.0)?;
            }
            InitialPosition::Local { position, .. } => {
                check_vector(SECTION, "position_ned_m", position.0.iter().copied(), 1.0e6)?;
                // From the ground to well below the top of the model of the air.
                check_range(SECTION, "position_ned_m", position.0.z, -80_000.0, 0.0)?;
            }
        }
        let (key, velocity) = match self.velocity {
            InitialVelocity::Ned(v) => ("velocity_ned_m_s", v.0),
            InitialVelocity::Body(v) => ("velocity_body_m_s", v.0),
        };
        check_vector(SECTION, key, velocity.iter().copied(), 10_000.0)?;
        for (key, angle, most) in [
            ("roll_deg", self.attitude.phi, 360.0),
            ("pitch_deg", self.attitude.theta, 90.0),
            ("yaw_deg", self.attitude.psi, 360.0),
        ] {
            check_range(SECTION, key, angle.to_degrees(), -most, most)?;
        }
        let (key, rates) = match self.rates {
            InitialRates::Inertial(rates) => ("rates_inertial_deg_s", rates.0),
            InitialRates::Earth(rates) => ("rates_earth_deg_s", rates.0),
            InitialRates::Ned(rates) => ("rates_ned_deg_s", rates.0),
        };
        check_vector(SECTION, key, rates.iter().map(|rate| rate.to_degrees()), 3_600.0)
    }

    /// Position of the body, m, frame E.
    pub fn place(&self, earth: &Earth) -> Vector3<f64> {
        match self.position {
            InitialPosition::Geodetic(here) => earth.position(&here),
            InitialPosition::Local { position, .. } => earth.position_of_local(&position),
        }
    }

    /// The body in this state, with another pitch angle (rad).
    pub fn rigid(&self, earth: &Earth, pitch_rad: f64) -> RigidState {
        let position = self.place(earth);
        let here = match self.position {
            // What the file says, and not what a way through coordinates has left of it.
            InitialPosition::Geodetic(here) => here,
            InitialPosition::Local { .. } => earth.geodetic(&position),
        };
        let attitude = Attitude::from_euler(EulerAngles { theta: pitch_rad, ..self.attitude });
        let (velocity, ground) = match self.velocity {
            InitialVelocity::Ned(ned) => (attitude.to_body(ned), ned),
            InitialVelocity::Body(body) => (body, attitude.to_ned(body)),
        };
        let e_from_ned = earth.place(&position).e_from_ned;
        let of_earth = e_from_ned.tr_mul(&earth.rotation());
        let in_body = |ned: Vector3<f64>| attitude.to_body(Ned(ned)).0;
        let rates = match self.rates {
            InitialRates::Inertial(rates) => rates.0,
            InitialRates::Earth(rates) => rates.0 + in_body(of_earth),
            InitialRates::Ned(rates) => {
                rates.0 + in_body(of_earth + earth.transport_rate(&here, &ground))
            }
        };
        RigidState {
            position,
            q_e_from_body: earth.q_e_from_body(&here, &attitude),
            velocity,
            rates: Body(rates),
        }
    }
}

impl Controls {
    /// These controls with the changes of `other` added.
    pub fn plus(&self, other: &Self) -> Self {
        let positions =
            PerEffector::from_fn(|effector| self.positions[effector] + other.positions[effector]);
        let lever = self.lever.map(|lever| lever + other.lever.unwrap_or(0.0));
        Self { positions, lever }
    }
}

#[cfg(test)]
mod tests;
