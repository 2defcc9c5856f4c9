//! The design model: what angular acceleration the controller expects of a healthy aircraft.
//!
//! ẇ = f(x) + g(x) u + g_T(x) u_T. It knows only the [`AircraftModel`], never the plant.

use arrayvec::ArrayVec;
use icd::{Effector, EffectorKind, EulerAngles, PerEffector};
use nalgebra::{Matrix2, Matrix3, Vector3};

use crate::aircraft_model::{AircraftModel, EffectorModel, MassModel, Schedule};
use crate::navigation::NavigationState;
use level_turn::{Elevators, LevelTurn, level_turn};

pub mod atmosphere;
pub mod doubt;
pub mod level_turn;

/// Smallest airspeed in the coefficients as a part of that of the design point: the rates are divided by it.
const AIRSPEED_FLOOR: f64 = 0.075;

/// The design model with what can be computed once.
#[derive(Debug, Clone)]
pub struct DesignModel {
    aircraft: AircraftModel,
    schedule: Schedule,
    inverse_inertia: Matrix3<f64>,
    surfaces: SurfaceMoments,
    nozzle_pitch: Option<Effector>,
    nozzle_yaw: Option<Effector>,
    engine: Option<Effector>,
    thrust_range_n: [f64; 2],
    aileron_pair: (f64, f64),
    elevators: Elevators,
    design_point: NavigationState,
    design_turn: LevelTurn,
    reference: doubt::Reference,
}

/// The aerodynamic surfaces: left and right ones together, and those that stand alone.
#[derive(Debug, Clone)]
struct SurfaceMoments {
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
    /// From a validated model.
    pub fn new(aircraft: AircraftModel) -> Self {
        let effectors = &aircraft.effectors;
        let list = &effectors.list;
        let is_surface =
            |effector: &Effector| list.kind(*effector).is_some_and(EffectorKind::is_surface);
        let surfaces = SurfaceMoments {
            pairs: list.pairs().filter(|[left, _]| is_surface(left)).collect(),
            singles: list.singles().filter(is_surface).collect(),
        };
        let design_point = design_point(&aircraft);
        let condition = condition(&aircraft, &design_point);
        let elevators = Elevators::of(effectors);
        Self {
            reference: doubt::Reference::of(&design_point, &condition),
            design_turn: level_turn(&aircraft, &elevators, &design_point, &condition),
            design_point,
            inverse_inertia: inverse_inertia(&aircraft.mass),
            surfaces,
            nozzle_pitch: list.only(EffectorKind::NozzlePitch),
            nozzle_yaw: list.only(EffectorKind::NozzleYaw),
            engine: list.only(EffectorKind::Engine),
            thrust_range_n: effectors.thrust_range_n(),
            aileron_pair: aileron_pair(effectors),
            elevators,
            schedule: aircraft.schedule,
            aircraft,
        }
    }

    /// The engine; `None` for a glider.
    pub fn engine(&self) -> Option<Effector> {
        self.engine
    }

    /// The numbers behind the model.
    pub fn aircraft(&self) -> &AircraftModel {
        &self.aircraft
    }

    /// Steady level flight at the design point.
    pub fn design_point(&self) -> &NavigationState {
        &self.design_point
    }

    /// Trim of level flight at this airspeed, altitude, bank and thrust: that of the model file, plus what the model says
    /// that is different from the design point. At the design point the difference is zero.
    pub fn trim(&self, state: &NavigationState, at: &FlightCondition) -> LevelTurn {
        let (trim, design) = (&self.aircraft.trim, &self.design_turn);
        let here = level_turn(&self.aircraft, &self.elevators, state, at);
        LevelTurn {
            // As a difference: what the formula leaves out of a trim cancels at the design point, where the law is
            // Eq. (15) as printed.
            theta_rad: trim.theta_rad + (here.theta_rad - design.theta_rad),
            elevator_rad: trim.elevator_rad + (here.elevator_rad - design.elevator_rad),
            pitch_rate_rad_s: here.pitch_rate_rad_s,
        }
    }

    /// Takes the coefficients at the condition of `state`; whether the model has any that change.
    pub fn adapt(&mut self, state: &NavigationState) -> bool {
        // A model without points costs nothing and keeps its bits.
        if self.schedule.is_empty() {
            return false;
        }
        let v = state.airspeed_m_s;
        let pressure_pa = 0.5 * atmosphere::density(state.altitude_m) * v * v;
        self.schedule.put(pressure_pa, &mut self.aircraft);
        // The trim stays a difference to the design point of the file, so nothing of that changes here.
        self.aileron_pair = aileron_pair(&self.aircraft.effectors);
        self.elevators = Elevators::of(&self.aircraft.effectors);
        true
    }

    /// The model with the coefficients at the condition of `state`; `None` for one that is the same everywhere.
    pub fn at(&self, state: &NavigationState) -> Option<Self> {
        let mut model = (!self.schedule.is_empty()).then(|| self.clone())?;
        model.adapt(state);
        Some(model)
    }

    /// Dynamic pressure and arms at `state`.
    pub fn condition(&self, state: &NavigationState) -> FlightCondition {
        condition(&self.aircraft, state)
    }

    /// f(x): angular acceleration with all effectors at zero, rad/s².
    ///
    /// Implements Eq. (7): M times the aerodynamic moments at zero deflection, plus h(x).
    pub fn bare_airframe(&self, state: &NavigationState, at: &FlightCondition) -> Vector3<f64> {
        let a = &self.aircraft.airframe;
        let (p, q, r) = (state.rates.x, state.rates.y, state.rates.z);
        let beta = self.effective_angle(state.beta);
        let alpha = self.effective_angle(state.alpha);
        let c_roll = a.c_roll_beta * beta + (a.c_roll_p * p + a.c_roll_r * r) * at.span_time;
        let c_pitch = a.c_pitch_0 + a.c_pitch_alpha * alpha + a.c_pitch_q * q * at.chord_time;
        let c_yaw = a.c_yaw_beta * beta + (a.c_yaw_p * p + a.c_yaw_r * r) * at.span_time;
        let mut moment = Vector3::new(at.q_s_b * c_roll, at.q_s_c * c_pitch, at.q_s_b * c_yaw);
        // Left to the estimate, the torque of a propeller would use up a part of the detector's level that depends
        // on the throttle.
        if let Some(engine) = &self.aircraft.engine {
            moment.x += engine.roll_zero_n_m + engine.roll_per_thrust_m * state.thrust_n;
        }
        self.inverse_inertia * moment + inertial_coupling(&self.aircraft.mass, &state.rates)
    }

    /// An aerodynamic angle as it acts: itself up to the stall, then bending towards the ceiling.
    pub fn effective_angle(&self, angle: f64) -> f64 {
        let onset = self.aircraft.airframe.stall_onset_rad;
        let magnitude = angle.abs();
        if magnitude <= onset {
            return angle;
        }
        let range = self.aircraft.airframe.stall_ceiling_rad - onset;
        libm::copysign(onset + range * libm::tanh((magnitude - onset) / range), angle)
    }

    /// g(x) u: angular acceleration of the surfaces, rad/s².
    ///
    /// Implements Eq. (8). `positions` are deflections in rad. Left and right are paired, so that a
    /// mirrored aircraft gives mirrored bits.
    #[inline]
    pub fn surfaces(&self, at: &FlightCondition, positions: &PerEffector<f64>) -> Vector3<f64> {
        let s = &self.aircraft.effectors;
        let SurfaceMoments { pairs, singles } = &self.surfaces;
        let of = |e: Effector| Vector3::new(s.c_roll[e], s.c_pitch[e], s.c_yaw[e]) * positions[e];
        // From minus zero the first term keeps its bits.
        let mut sum = Vector3::repeat(-0.0);
        for [left, right] in pairs {
            sum += of(*left) + of(*right);
        }
        for single in singles {
            sum += of(*single);
        }
        let moment = Vector3::new(at.q_s_b, at.q_s_c, at.q_s_b).component_mul(&sum);
        self.inverse_inertia * moment
    }

    /// g_T(x) u_T: angular acceleration of the nozzle, rad/s².
    ///
    /// Implements Eq. (9), in the linear form of Eq. (4): the plant's exact trigonometry differs by 1 %.
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
    pub fn acceleration(
        &self,
        state: &NavigationState,
        at: &FlightCondition,
        positions: &PerEffector<f64>,
    ) -> Vector3<f64> {
        self.bare_airframe(state, at) + self.surfaces(at, positions) + self.nozzle(at, positions)
    }

    /// g(x) u + g_T(x) u_T: angular acceleration of all the effectors, rad/s².
    pub fn effectors(&self, at: &FlightCondition, positions: &PerEffector<f64>) -> Vector3<f64> {
        self.surfaces(at, positions) + self.nozzle(at, positions)
    }

    /// One column of g(x) and g_T(x): angular acceleration per rad of a surface or a nozzle angle, rad/s² per rad.
    ///
    /// Zero for an engine and for a place without an effector.
    pub fn effect(&self, at: &FlightCondition, effector: Effector) -> Vector3<f64> {
        let s = &self.aircraft.effectors;
        let moment = match s.list.kind(effector) {
            Some(EffectorKind::NozzlePitch) => Vector3::new(0.0, at.t_x_t, 0.0),
            Some(EffectorKind::NozzleYaw) => Vector3::new(0.0, 0.0, at.t_x_t),
            Some(kind) if kind.is_surface() => Vector3::new(
                at.q_s_b * s.c_roll[effector],
                at.q_s_c * s.c_pitch[effector],
                at.q_s_b * s.c_yaw[effector],
            ),
            _ => return Vector3::zeros(),
        };
        self.inverse_inertia * moment
    }

    /// M times a moment in N m: angular acceleration, rad/s².
    pub fn angular(&self, moment: &Vector3<f64>) -> Vector3<f64> {
        self.inverse_inertia * moment
    }

    /// The angles that turn the jet in pitch and in yaw, where the aircraft has them.
    pub fn nozzle_effectors(&self) -> [Option<Effector>; 2] {
        [self.nozzle_pitch, self.nozzle_yaw]
    }

    /// Smallest and largest thrust, N; zeros without an engine.
    pub fn thrust_range_n(&self) -> [f64; 2] {
        self.thrust_range_n
    }

    /// Moment coefficients (roll, yaw) of all that follows the aileron command, per rad of it.
    pub fn aileron_pair(&self) -> (f64, f64) {
        self.aileron_pair
    }

    /// g_c(x): angular acceleration per unit of [aileron, nozzle pitch, nozzle yaw], 1/s².
    ///
    /// Implements Eq. (11).
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

fn design_point(aircraft: &AircraftModel) -> NavigationState {
    let trim = &aircraft.trim;
    NavigationState {
        attitude: EulerAngles { phi: 0.0, theta: trim.theta_rad, psi: 0.0 },
        // In level flight the flow is horizontal.
        alpha: trim.theta_rad,
        airspeed_m_s: trim.airspeed_m_s,
        altitude_m: trim.altitude_m,
        thrust_n: trim.thrust_n,
        ..NavigationState::at_rest()
    }
}

fn condition(aircraft: &AircraftModel, state: &NavigationState) -> FlightCondition {
    let g = &aircraft.geometry;
    let v = state.airspeed_m_s.max(AIRSPEED_FLOOR * aircraft.trim.airspeed_m_s);
    let q_s = 0.5 * atmosphere::density(state.altitude_m) * v * v * g.wing_area_m2;
    FlightCondition {
        q_s_b: q_s * g.span_m,
        q_s_c: q_s * g.chord_m,
        span_time: g.span_m / (2.0 * v),
        chord_time: g.chord_m / (2.0 * v),
        t_x_t: state.thrust_n * aircraft.nozzle_arm_m(),
    }
}

/// Moment coefficients (roll, yaw) of all that follows the aileron command, per rad of it.
fn aileron_pair(effectors: &EffectorModel) -> (f64, f64) {
    let per_roll = |coefficients| effectors.per_command(coefficients, |gains| gains.roll);
    (per_roll(&effectors.c_roll), per_roll(&effectors.c_yaw))
}

/// M: inverse of the inertia matrix, 1/(kg m²).
///
/// Implements Eq. (3).
pub fn inverse_inertia(mass: &MassModel) -> Matrix3<f64> {
    let MassModel { ixx_kg_m2: ixx, iyy_kg_m2: iyy, izz_kg_m2: izz, ixz_kg_m2: ixz, .. } = *mass;
    let gamma = ixx * izz - ixz * ixz;
    let lateral = Matrix2::new(izz, ixz, ixz, ixx) / gamma;
    Matrix3::new(lateral.m11, 0.0, lateral.m12, 0.0, 1.0 / iyy, 0.0, lateral.m21, 0.0, lateral.m22)
}

/// h(x): angular acceleration by inertial coupling, rad/s².
///
/// Implements Eq. (2).
pub fn inertial_coupling(mass: &MassModel, rates: &Vector3<f64>) -> Vector3<f64> {
    let MassModel { ixx_kg_m2: ixx, iyy_kg_m2: iyy, izz_kg_m2: izz, ixz_kg_m2: ixz, .. } = *mass;
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
