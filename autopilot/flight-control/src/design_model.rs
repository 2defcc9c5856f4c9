//! The design model: what angular acceleration the controller expects of a healthy aircraft.
//!
//! ẇ = f(x) + g(x) u + g_T(x) u_T. It knows only the [`Belief`], never the plant.

use arrayvec::ArrayVec;
use icd::{Effector, EffectorKind, EulerAngles, PerEffector};
use nalgebra::{Matrix2, Matrix3, Vector3};

use crate::belief::{Belief, MassBelief};
use crate::estimator::State;

pub mod atmosphere;

/// Smallest airspeed in the coefficients, m/s: the rates are divided by it.
const AIRSPEED_FLOOR_M_S: f64 = 20.0;

/// The design model with what can be computed once.
#[derive(Debug, Clone)]
pub struct DesignModel {
    belief: Belief,
    inverse_inertia: Matrix3<f64>,
    surfaces: Surfaces,
    nozzle_pitch: Option<Effector>,
    nozzle_yaw: Option<Effector>,
    aileron_pair: (f64, f64),
}

/// The aerodynamic surfaces: left and right ones together, and those that stand alone.
#[derive(Debug, Clone)]
struct Surfaces {
    pairs: ArrayVec<[Effector; 2], { Effector::MAX / 2 }>,
    singles: ArrayVec<Effector, { Effector::MAX }>,
}

/// Moment arms at one flight condition: dynamic pressure times area times length.
#[derive(Debug, Clone, Copy)]
pub struct FlightCondition {
    /// Q S b, N m.
    pub q_s_b: f64,
    /// Q S c, N m.
    pub q_s_c: f64,
    /// b / 2V, s.
    pub span_time: f64,
    /// c / 2V, s.
    pub chord_time: f64,
    /// T x_T, N m per rad of nozzle; T is the measured thrust.
    pub t_x_t: f64,
}

impl DesignModel {
    /// From a validated belief.
    #[must_use]
    pub fn new(belief: Belief) -> Self {
        let effectors = &belief.effectors;
        let list = &effectors.list;
        let is_surface =
            |effector: &Effector| list.kind(*effector).is_some_and(EffectorKind::is_surface);
        let surfaces = Surfaces {
            pairs: list.pairs().filter(|[left, _]| is_surface(left)).collect(),
            singles: list.singles().filter(is_surface).collect(),
        };
        let per_roll = |coefficients| effectors.per_command(coefficients, |gains| gains.roll);
        Self {
            inverse_inertia: inverse_inertia(&belief.mass),
            surfaces,
            nozzle_pitch: list.only(EffectorKind::NozzlePitch),
            nozzle_yaw: list.only(EffectorKind::NozzleYaw),
            aileron_pair: (per_roll(&effectors.c_roll), per_roll(&effectors.c_yaw)),
            belief,
        }
    }

    /// The engine; `None` for a glider.
    #[must_use]
    pub fn engine(&self) -> Option<Effector> {
        self.belief.effectors.list.only(EffectorKind::Engine)
    }

    /// The numbers behind the model.
    #[must_use]
    pub fn belief(&self) -> &Belief {
        &self.belief
    }

    /// Steady level flight at the design point.
    #[must_use]
    pub fn design_point(&self) -> State {
        let trim = &self.belief.trim;
        State {
            attitude: EulerAngles { phi: 0.0, theta: trim.theta_rad, psi: 0.0 },
            alpha: trim.theta_rad,
            airspeed_m_s: trim.airspeed_m_s,
            altitude_m: trim.altitude_m,
            thrust_n: trim.thrust_n,
            ..State::AT_REST
        }
    }

    /// Dynamic pressure and arms at `state`.
    #[must_use]
    pub fn condition(&self, state: &State) -> FlightCondition {
        let g = &self.belief.geometry;
        let v = state.airspeed_m_s.max(AIRSPEED_FLOOR_M_S);
        let q_s = 0.5 * atmosphere::density(state.altitude_m) * v * v * g.wing_area_m2;
        FlightCondition {
            q_s_b: q_s * g.span_m,
            q_s_c: q_s * g.chord_m,
            span_time: g.span_m / (2.0 * v),
            chord_time: g.chord_m / (2.0 * v),
            t_x_t: state.thrust_n * self.belief.nozzle_arm_m(),
        }
    }

    /// f(x): angular acceleration with all effectors at zero, rad/s².
    ///
    /// Implements Eq. (7): M times the aerodynamic moments at zero deflection, plus h(x).
    #[must_use]
    pub fn bare_airframe(&self, state: &State, at: &FlightCondition) -> Vector3<f64> {
        let a = &self.belief.airframe;
        let (p, q, r) = (state.rates.x, state.rates.y, state.rates.z);
        let beta = self.effective_angle(state.beta);
        let alpha = self.effective_angle(state.alpha);
        let c_roll = a.c_roll_beta * beta + (a.c_roll_p * p + a.c_roll_r * r) * at.span_time;
        let c_pitch = a.c_pitch_0 + a.c_pitch_alpha * alpha + a.c_pitch_q * q * at.chord_time;
        let c_yaw = a.c_yaw_beta * beta + (a.c_yaw_p * p + a.c_yaw_r * r) * at.span_time;
        let moment = Vector3::new(at.q_s_b * c_roll, at.q_s_c * c_pitch, at.q_s_b * c_yaw);
        self.inverse_inertia * moment + inertial_coupling(&self.belief.mass, &state.rates)
    }

    /// An aerodynamic angle as it acts: itself up to the stall, then bending towards the ceiling.
    fn effective_angle(&self, angle: f64) -> f64 {
        let onset = self.belief.airframe.stall_onset_rad;
        let magnitude = angle.abs();
        if magnitude <= onset {
            return angle;
        }
        let range = self.belief.airframe.stall_ceiling_rad - onset;
        libm::copysign(onset + range * libm::tanh((magnitude - onset) / range), angle)
    }

    /// g(x) u: angular acceleration of the surfaces, rad/s².
    ///
    /// Implements Eq. (8). `positions` are deflections in rad. Left and right are paired, so that a
    /// mirrored aircraft gives mirrored bits.
    #[must_use]
    pub fn surfaces(&self, at: &FlightCondition, positions: &PerEffector<f64>) -> Vector3<f64> {
        let s = &self.belief.effectors;
        let Surfaces { pairs, singles } = &self.surfaces;
        let sum = |c: &PerEffector<f64>| {
            let of = |e: Effector| c[e] * positions[e];
            let pairs = pairs.iter().map(|[left, right]| of(*left) + of(*right));
            // From minus zero the first term keeps its bits.
            pairs.chain(singles.iter().map(|single| of(*single))).fold(-0.0, |sum, term| sum + term)
        };
        let moment = Vector3::new(
            at.q_s_b * sum(&s.c_roll),
            at.q_s_c * sum(&s.c_pitch),
            at.q_s_b * sum(&s.c_yaw),
        );
        self.inverse_inertia * moment
    }

    /// g_T(x) u_T: angular acceleration of the nozzle, rad/s².
    ///
    /// Implements Eq. (9), in the linear form of Eq. (4): the plant's exact trigonometry differs by 1 %.
    #[must_use]
    pub fn nozzle(&self, at: &FlightCondition, positions: &PerEffector<f64>) -> Vector3<f64> {
        let of =
            |nozzle: Option<Effector>| nozzle.map_or(0.0, |nozzle| at.t_x_t * positions[nozzle]);
        let (pitch, yaw) = (of(self.nozzle_pitch), of(self.nozzle_yaw));
        self.inverse_inertia * Vector3::new(0.0, pitch, yaw)
    }

    /// Angular acceleration that a healthy aircraft would have, rad/s².
    ///
    /// Implements Eq. (10): f + g u + g_c u_cf, with the compensation inside the effector positions. `at` is
    /// the condition of `state`.
    #[must_use]
    pub fn acceleration(
        &self,
        state: &State,
        at: &FlightCondition,
        positions: &PerEffector<f64>,
    ) -> Vector3<f64> {
        self.bare_airframe(state, at) + self.surfaces(at, positions) + self.nozzle(at, positions)
    }

    /// Moment coefficients (roll, yaw) of all that follows the aileron command, per rad of it.
    #[must_use]
    pub fn aileron_pair(&self) -> (f64, f64) {
        self.aileron_pair
    }

    /// g_c(x): angular acceleration per unit of [aileron, nozzle pitch, nozzle yaw], 1/s².
    ///
    /// Implements Eq. (11).
    #[must_use]
    pub fn redundant_effectiveness(&self, at: &FlightCondition) -> Matrix3<f64> {
        let (c_roll, c_yaw) = self.aileron_pair();
        let moments = Matrix3::new(
            at.q_s_b * c_roll,
            0.0,
            0.0,
            0.0,
            at.t_x_t,
            0.0,
            at.q_s_b * c_yaw,
            0.0,
            at.t_x_t,
        );
        self.inverse_inertia * moments
    }
}

/// M: inverse of the inertia matrix, 1/(kg m²).
///
/// Implements Eq. (3).
#[must_use]
pub fn inverse_inertia(mass: &MassBelief) -> Matrix3<f64> {
    let MassBelief { ixx_kg_m2: ixx, iyy_kg_m2: iyy, izz_kg_m2: izz, ixz_kg_m2: ixz, .. } = *mass;
    let gamma = ixx * izz - ixz * ixz;
    let lateral = Matrix2::new(izz, ixz, ixz, ixx) / gamma;
    Matrix3::new(lateral.m11, 0.0, lateral.m12, 0.0, 1.0 / iyy, 0.0, lateral.m21, 0.0, lateral.m22)
}

/// h(x): angular acceleration by inertial coupling, rad/s².
///
/// Implements Eq. (2).
#[must_use]
pub fn inertial_coupling(mass: &MassBelief, rates: &Vector3<f64>) -> Vector3<f64> {
    let MassBelief { ixx_kg_m2: ixx, iyy_kg_m2: iyy, izz_kg_m2: izz, ixz_kg_m2: ixz, .. } = *mass;
    let (p, q, r) = (rates.x, rates.y, rates.z);
    let gamma = ixx * izz - ixz * ixz;
    Vector3::new(
        (-ixz * (iyy - ixx - izz) * p * q - (izz * izz - izz * iyy + ixz * ixz) * q * r) / gamma,
        (-(ixx - izz) * p * r - ixz * (p * p - r * r)) / iyy,
        (-(iyy * ixx - ixx * ixx - ixz * ixz) * p * q - ixz * (izz - iyy + ixx) * q * r) / gamma,
    )
}

#[cfg(test)]
mod tests;
