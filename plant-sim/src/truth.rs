//! What really happens: the judges may look at it, the autopilot may not.

use icd::record::{TRUTH_HEAD, TRUTH_TAIL};
use icd::{Attitude, Body, EulerAngles, Ned, PerEffector, SimTime};
use serde::{Deserialize, Serialize};

mod row;

use crate::atmosphere::STANDARD_GRAVITY;
use crate::dynamics::{Dynamics, Evaluation, State, StepInputs};
use crate::limits::Attained;

/// No number of a flight is anywhere near this, in any unit of the truth; one that is, is no result of physics.
const BOUND: f64 = 1.0e15;

/// The state of the flight at one instant, complete and without error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Simulation time.
    pub time: SimTime,
    /// Body rates p, q, r relative to inertial space, rad/s.
    pub body_rates: Body,
    /// Attitude relative to the local NED axes.
    pub attitude: Attitude,
    /// True airspeed, m/s, gusts included.
    pub airspeed_m_s: f64,
    /// Angle of attack, rad, gusts included.
    pub alpha_rad: f64,
    /// Sideslip, rad, gusts included.
    pub beta_rad: f64,
    /// Altitude above the ellipsoid or the plane, m.
    pub altitude_m: f64,
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// Velocity over the ground, m/s.
    pub velocity: Ned,
    /// Position from the start point at altitude zero, m, in the NED axes of that point.
    pub position: Ned,
    /// Rate of change of the components of `body_rates`, rad/s².
    pub angular_acceleration: Body,
    /// Specific force (all forces but gravity, per mass), m/s².
    pub specific_force: Body,
    /// Normal load factor, g: minus the z component of the specific force over 9.80665 m/s².
    pub normal_load_factor_g: f64,
    /// How many effectors the aircraft has.
    pub effectors: usize,
    /// What acts of each effector after the faults, rad; thrust, N.
    pub deflections: PerEffector<f64>,
    /// Where each effector really is, after the faults and before a loss of effect, rad; thrust, N.
    pub positions: PerEffector<f64>,
    /// Code of the fault that acts on each effector ([`crate::faults::Effects::codes`]); 0 for none.
    pub fault_codes: PerEffector<u8>,
    /// Velocity of the air over the ground, gusts included, m/s, where it blows to.
    pub wind: Ned,
    /// Density of the air, kg/m³.
    pub density_kg_m3: f64,
}

impl Truth {
    /// The attitude as roll, pitch, yaw, rad; worked out for the judge who asks.
    #[must_use]
    pub fn euler(&self) -> EulerAngles {
        self.attitude.euler()
    }

    /// Whether what follows from the state is within [`BOUND`]: forces, accelerations, place and motion in the air.
    #[inline]
    #[must_use]
    pub(crate) fn is_bounded(&self) -> bool {
        // One sum and one look: a sum with an infinite or undefined part is one itself.
        let (f, a, v) = (&self.specific_force.0, &self.angular_acceleration.0, &self.velocity.0);
        let place = self.altitude_m + self.latitude_rad + self.longitude_rad;
        let air = self.airspeed_m_s + self.alpha_rad + self.beta_rad;
        (f.sum() + a.sum() + v.sum() + place + air).abs() < BOUND
    }

    /// Name of the first number that is beyond [`BOUND`], as in the flight log.
    #[must_use]
    pub(crate) fn first_unbounded(&self) -> Option<&'static str> {
        let row = self.to_row(false, false);
        let index = row.iter().position(|value| value.is_nan() || value.abs() >= BOUND);
        // Where only the sum above is beyond it, the forces are the largest part.
        let tail =
            |index: usize| TRUTH_TAIL.get((index + TRUTH_TAIL.len()).checked_sub(row.len())?);
        let name = |index: usize| TRUTH_HEAD.get(index).or_else(|| tail(index)).copied();
        Some(index.map_or("specific_force", |index| name(index).unwrap_or("effector")))
    }

    /// Of a state at `time`, with what is held there and what was found out about it.
    #[must_use]
    pub fn of(
        dynamics: &Dynamics,
        time: SimTime,
        state: &State,
        inputs: &StepInputs,
        e: &Evaluation,
    ) -> Self {
        let mut deflections = dynamics.effective(state, &inputs.effects);
        if let Some(engine) = dynamics.jet().engine() {
            deflections[engine] = e.motion.thrust_n;
        }
        let rigid = &state.rigid;
        let earth = dynamics.earth();
        let here = inputs.slopes.geodetic(earth, &rigid.position, &e.place);
        let attitude = earth.attitude(&e.place, &rigid.q_e_from_body);
        let ned = |v: &Body| Ned(e.place.e_from_ned.tr_mul(&(e.motion.e_from_body * v.0)));
        let specific_force = Body(e.motion.wrench.force.0 * dynamics.mass().per_mass);
        Self {
            time,
            body_rates: rigid.rates,
            attitude,
            airspeed_m_s: e.motion.air.airspeed_m_s,
            alpha_rad: e.motion.air.alpha_rad,
            beta_rad: e.motion.air.beta_rad,
            altitude_m: e.place.altitude_m,
            latitude_rad: here.latitude_rad,
            longitude_rad: here.longitude_rad,
            velocity: ned(&rigid.velocity),
            position: earth.local_position(&rigid.position),
            angular_acceleration: e.motion.derivative.rates,
            specific_force,
            normal_load_factor_g: -specific_force.0.z / STANDARD_GRAVITY,
            effectors: dynamics.airframe().effectors.len(),
            deflections,
            positions: inputs.effects.positions(&state.positions),
            fault_codes: *inputs.effects.codes(),
            wind: Ned(inputs.wind.0 + ned(&inputs.gust.velocity).0),
            density_kg_m3: e.density,
        }
    }
}

impl From<&Truth> for Attained {
    fn from(truth: &Truth) -> Self {
        let attitude = truth.euler();
        Self {
            roll_rad: attitude.phi,
            pitch_rad: attitude.theta,
            alpha_rad: truth.alpha_rad,
            beta_rad: truth.beta_rad,
            altitude_m: truth.altitude_m,
        }
    }
}
