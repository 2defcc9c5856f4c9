//! Nonlinear dynamic inversion: the body rates by inversion of the design model, with outer loops for roll, altitude,
//! sideslip and airspeed.
//!
//! S. A. Snell, D. F. Enns, W. L. Garrard, "Nonlinear Inversion Flight Control for a Supermaneuverable Aircraft",
//! J. Guidance, Control, and Dynamics 15(4), 1992: fast states (p, q, r) inside, slow states (α, β, φ) around them.
//! The flight path around those is this project's.

use icd::units::STANDARD_GRAVITY_M_S2;
use nalgebra::{Matrix3, Vector3};

use super::{Integral, Law, LawInput, MainCommand, Visitor};
use crate::design_model::DesignModel;
use crate::mixer::Mixer;

gain_set! {
    /// Gains of the dynamic inversion; all are bandwidths, 1/s, except where a unit is given.
    ///
    /// Servos of 20 rad/s allow rates of 4 rad/s with a damping of 1.1; each loop around them is two to three
    /// times slower than the one inside.
    NdiGains at ndi {
        /// Roll rate.
        k_p = 4.0, "NDI_KP" "1/s", 0.1 to 50.0, "Bandwidth of the roll rate";
        /// Pitch rate.
        k_q = 4.0, "NDI_KQ" "1/s", 0.1 to 50.0, "Bandwidth of the pitch rate";
        /// Yaw rate.
        k_r = 3.0, "NDI_KR" "1/s", 0.1 to 50.0, "Bandwidth of the yaw rate";
        /// Roll angle.
        k_phi = 1.5, "NDI_KPHI" "1/s", 0.01 to 20.0, "Bandwidth of the roll angle";
        /// Integral of the roll angle error, 1/s².
        k_phi_i = 0.05, "NDI_KPHII" "1/s^2", 0.0 to 10.0, "Roll rate rate per roll angle error";
        /// Sideslip.
        k_beta = 1.0, "NDI_KBETA" "1/s", 0.0 to 20.0, "Bandwidth of the sideslip";
        /// Angle of attack.
        k_alpha = 1.5, "NDI_KALPHA" "1/s", 0.01 to 20.0, "Bandwidth of the angle of attack";
        /// Flight-path angle.
        k_gamma = 0.6, "NDI_KGAMMA" "1/s", 0.01 to 20.0, "Bandwidth of the flight-path angle";
        /// Altitude.
        k_h = 0.2, "NDI_KH" "1/s", 0.001 to 10.0, "Bandwidth of the altitude";
        /// Integral of the altitude error, 1/s².
        k_hi = 0.005, "NDI_KHI" "1/s^2", 0.0 to 10.0, "Climb rate rate per altitude error";
        /// Largest climb rate for an altitude error, m/s.
        climb_max_m_s = 60.0, "NDI_CLIMB_MAX" "m/s", 0.1 to 500.0, "Largest climb rate that an altitude error asks for";
        /// Airspeed.
        k_v = 0.30, "NDI_KV" "1/s", 0.001 to 10.0, "Bandwidth of the airspeed";
        /// Integral of the airspeed error, 1/s².
        k_vi = 0.02, "NDI_KVI" "1/s^2", 0.0 to 10.0, "Acceleration rate per airspeed error";
    }
}

/// Largest roll rate of the roll integrator, rad/s.
const ROLL_INTEGRAL_MAX: f64 = 0.2;
/// The altitude integrator runs while the error asks for less than this part of the largest climb rate.
const ALTITUDE_BAND: f64 = 0.2;
/// Largest demanded flight-path angle, rad.
const GAMMA_MAX: f64 = 0.5;
/// Volume that the columns of the effectiveness span, of unit length each, above which they count as independent.
const INDEPENDENT: f64 = 1.0e-3;
/// Cosine of the bank up to which lift makes up for it, as in [`mod@crate::design_model::level_turn`].
const LEVEL_COSINE: f64 = 0.5;
/// Deflection with which the effectiveness is taken, rad: inside every travel.
const PROBE_RAD: f64 = 0.01;

impl NdiGains {
    /// Largest climb rate of the altitude integrator, m/s.
    fn climb_integral_max_m_s(&self) -> f64 {
        self.climb_max_m_s / 3.0
    }
}

/// The dynamic inversion: gains and three integrators.
#[derive(Debug, Clone)]
pub struct Ndi {
    gains: NdiGains,
    /// From commands to effectors, for the effectiveness of a command.
    mixer: Mixer,
    roll: Integral,
    climb: Integral,
    speed: Integral,
}

impl Ndi {
    /// With empty integrators.
    pub fn new(gains: &NdiGains, model: &DesignModel) -> Self {
        let empty = Integral::default();
        let mixer = Mixer::new(&model.aircraft().effectors);
        Self { gains: *gains, mixer, roll: empty, climb: empty, speed: empty }
    }

    /// Takes new gains; the integrators stay.
    pub fn set_gains(&mut self, gains: &NdiGains) {
        self.gains = *gains;
    }

    /// Pitch rate that brings altitude, flight path and angle of attack to their references, rad/s.
    ///
    /// ḣ_c → γ_c → n_c → α_c by the lift of the model → q_c. α_c stays below the stall onset of the model.
    fn pitch_rate(&mut self, input: &LawInput<'_>) -> f64 {
        let LawInput { state, references, saturated, model, at, h } = *input;
        let (gains, aircraft) = (&self.gains, model.aircraft());
        // By the chord's time, which has the lower limit of the airspeed already: it is divided by.
        let v = aircraft.geometry.chord_m / (2.0 * at.chord_time);
        let error = references.altitude_m - state.altitude_m;
        // Positive elevator lowers the nose.
        let most = gains.climb_max_m_s;
        let demanded = (gains.k_h * error).clamp(-most, most);
        let lasting = if error.abs() < ALTITUDE_BAND * most / gains.k_h {
            error
        } else if state.over_ground {
            let lacking = (demanded - state.climb_rate_m_s()) / gains.k_h;
            // What the engine cannot give is none of it.
            if saturated.thrust.blocks(lacking) { 0.0 } else { lacking }
        } else {
            0.0
        };
        if !saturated.elevator.blocks(-lasting) {
            self.climb.add(gains.k_hi * lasting * h, gains.climb_integral_max_m_s());
        }
        let climb = demanded + self.climb.value();
        let path = |climb: f64| libm::asin((climb / v).clamp(-1.0, 1.0));
        let gamma = path(state.climb_rate_m_s());
        let gamma_c = path(climb).clamp(-GAMMA_MAX, GAMMA_MAX);
        let gamma_rate = gains.k_gamma * (gamma_c - gamma);
        let cos_phi = libm::cos(state.attitude.phi);
        let n_c =
            (libm::cos(gamma) + v * gamma_rate / STANDARD_GRAVITY_M_S2) / cos_phi.max(LEVEL_COSINE);

        // n = lift_0 + lift_alpha α.
        let lift = &aircraft.lift;
        let weight = aircraft.mass.mass_kg * STANDARD_GRAVITY_M_S2;
        let q_s = at.q_s_c / aircraft.geometry.chord_m;
        let per_alpha = (q_s * lift.c_lift_alpha + state.thrust_n.max(0.0)) / weight;
        let zero = q_s * (lift.c_lift_0 + lift.c_lift_q * state.rates.y * at.chord_time) / weight;
        let onset = aircraft.airframe.stall_onset_rad;
        let alpha_c = ((n_c - zero) / per_alpha).clamp(-onset, onset);
        // More angle than this gives no more lift that could be relied on.
        let n = zero + per_alpha * state.alpha.clamp(-onset, onset);
        // α̇ = q - g/V (n - cos γ cos φ).
        let turning = STANDARD_GRAVITY_M_S2 / v * (n - libm::cos(gamma) * cos_phi);
        gains.k_alpha * (alpha_c - state.alpha) + turning
    }

    /// Roll rate that brings the roll angle to its reference, rad/s: φ̇ = p + tan θ (q sin φ + r cos φ).
    fn roll_rate(&mut self, input: &LawInput<'_>) -> f64 {
        let LawInput { state, references, saturated, h, .. } = *input;
        let gains = &self.gains;
        // The tangent has no limit at the vertical.
        let (phi, theta) = (state.attitude.phi, state.attitude.theta.clamp(-GAMMA_MAX, GAMMA_MAX));
        let error = references.roll_rad - phi;
        // Positive aileron rolls left.
        if !saturated.aileron.blocks(-error) {
            self.roll.add(gains.k_phi_i * error * h, ROLL_INTEGRAL_MAX);
        }
        let turn = state.rates.y * libm::sin(phi) + state.rates.z * libm::cos(phi);
        gains.k_phi * error + self.roll.value() - libm::tan(theta) * turn
    }

    /// Yaw rate of a turn without sideslip, and what takes sideslip away, rad/s:
    /// β̇ = p sin α - r cos α + g/V cos θ sin φ.
    fn yaw_rate(&self, input: &LawInput<'_>) -> f64 {
        let LawInput { state, model, at, .. } = *input;
        let v = model.aircraft().geometry.chord_m / (2.0 * at.chord_time);
        let turn = STANDARD_GRAVITY_M_S2 / v
            * libm::cos(state.attitude.theta)
            * libm::sin(state.attitude.phi);
        state.rates.x * libm::sin(state.alpha) + turn + self.gains.k_beta * state.beta
    }

    /// Angular acceleration per rad of aileron, elevator and rudder command, 1/s².
    fn effectiveness(&self, input: &LawInput<'_>) -> Matrix3<f64> {
        let LawInput { model, at, .. } = *input;
        let zero = MainCommand::default();
        let column = |command: &MainCommand| {
            model.surfaces(at, &self.mixer.mix_main_only(command)) / PROBE_RAD
        };
        Matrix3::from_columns(&[
            column(&MainCommand { aileron_rad: PROBE_RAD, ..zero }),
            column(&MainCommand { elevator_rad: PROBE_RAD, ..zero }),
            column(&MainCommand { rudder_rad: PROBE_RAD, ..zero }),
        ])
    }

    /// Thrust that holds the airspeed, N: V̇ = (T - T_trim)/m - g sin γ; the model file has no drag.
    fn thrust(&mut self, input: &LawInput<'_>) -> f64 {
        let LawInput { state, references, saturated, model, at, h } = *input;
        let (gains, aircraft) = (&self.gains, model.aircraft());
        let mass_kg = aircraft.mass.mass_kg;
        let error = references.airspeed_m_s - state.airspeed_m_s;
        if !saturated.thrust.blocks(error) {
            self.speed
                .add(gains.k_vi * error * h, aircraft.effectors.thrust_range_n()[1] / mass_kg);
        }
        let v = aircraft.geometry.chord_m / (2.0 * at.chord_time);
        let climb = STANDARD_GRAVITY_M_S2 * (state.climb_rate_m_s() / v).clamp(-1.0, 1.0);
        aircraft.trim.thrust_n + mass_kg * (gains.k_v * error + self.speed.value() + climb)
    }
}

impl Law for Ndi {
    /// u = g⁻¹ (ν - f(x)) with ν = K (ω_c - ω).
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        let demanded =
            Vector3::new(self.roll_rate(input), self.pitch_rate(input), self.yaw_rate(input));
        let gains = Vector3::new(self.gains.k_p, self.gains.k_q, self.gains.k_r);
        let acceleration = gains.component_mul(&(demanded - input.state.rates));
        let needed = acceleration - input.model.bare_airframe(input.state, input.at);
        let surfaces = inverse_of(self.effectiveness(input)) * needed;
        MainCommand {
            aileron_rad: surfaces.x,
            elevator_rad: surfaces.y,
            rudder_rad: surfaces.z,
            nozzle_pitch_rad: 0.0,
            nozzle_yaw_rad: 0.0,
            thrust_n: self.thrust(input),
        }
    }

    /// Each integrator moves its own effector linearly, so two steps without time give its start.
    fn start_from(&mut self, input: &LawInput<'_>, command: &MainCommand) {
        let input = LawInput { h: 0.0, ..*input };
        let mut probe = Self::new(&self.gains, input.model);
        let zero = probe.step(&input);
        (probe.roll, probe.climb, probe.speed) =
            (Integral::starting(0.01), Integral::starting(0.1), Integral::starting(0.1));
        let one = probe.step(&input);
        let solve = |at: fn(&MainCommand) -> f64, unit: f64| {
            let slope = (at(&one) - at(&zero)) / unit;
            if slope == 0.0 { 0.0 } else { (at(command) - at(&zero)) / slope }
        };
        self.roll.start(solve(|c| c.aileron_rad, 0.01), ROLL_INTEGRAL_MAX);
        self.climb.start(solve(|c| c.elevator_rad, 0.1), self.gains.climb_integral_max_m_s());
        let aircraft = input.model.aircraft();
        let most = aircraft.effectors.thrust_range_n()[1] / aircraft.mass.mass_kg;
        self.speed.start(solve(|c| c.thrust_n, 0.1), most);
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        for integral in [&mut self.roll, &mut self.climb, &mut self.speed] {
            visit(integral.state());
        }
    }
}

/// The inverse. Where the columns are not independent, an axis whose command turns nothing is left to the airframe, else the yaw;
/// where the others depend on each other as well, nothing moves.
fn inverse_of(effectiveness: Matrix3<f64>) -> Matrix3<f64> {
    let inverse = |matrix: Matrix3<f64>| matrix.try_inverse().filter(|_| is_independent(&matrix));
    if let Some(inverse) = inverse(effectiveness) {
        return inverse;
    }
    let turns = |axis: usize| effectiveness.column(axis).amax() > 0.0;
    let all_turn = (0..3).all(turns);
    let is_left = |axis: &usize| if all_turn { *axis == 2 } else { !turns(*axis) };
    let mut completed = effectiveness;
    for axis in (0..3).filter(is_left) {
        completed.column_mut(axis).fill(0.0);
        completed[(axis, axis)] = 1.0;
    }
    let mut inverse = inverse(completed).unwrap_or_else(Matrix3::zeros);
    for axis in (0..3).filter(is_left) {
        inverse.row_mut(axis).fill(0.0);
    }
    inverse
}

/// Whether no column is nearly a sum of the others.
fn is_independent(matrix: &Matrix3<f64>) -> bool {
    let volume = matrix.column_iter().map(|column| column.norm()).product::<f64>();
    matrix.determinant().abs() > INDEPENDENT * volume
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::main_controller::References;
    use crate::signals::Saturation;
    use crate::testing;

    #[test]
    fn its_commands_give_the_demanded_angular_acceleration_by_the_model() {
        let model = DesignModel::new(testing::aircraft_model());
        let mut state = testing::level_state();
        state.attitude.phi = 0.3;
        state.rates = Vector3::new(0.05, -0.02, 0.03);
        (state.beta, state.alpha) = (0.02, 0.08);
        let references =
            References { altitude_m: 5_050.0, roll_rad: 0.2, airspeed_m_s: state.airspeed_m_s };
        let (at, saturated) = (model.condition(&state), Saturation::default());
        let (state, saturated) = (&state, &saturated);
        let (references, at, model) = (&references, &at, &model);
        let input = LawInput { state, references, saturated, model, at, h: 0.002 };
        let mut ndi = Ndi::new(&NdiGains::REFERENCE, model);
        let demanded = {
            let mut twin = ndi.clone();
            Vector3::new(twin.roll_rate(&input), twin.pitch_rate(&input), twin.yaw_rate(&input))
        };
        let command = ndi.step(&input);
        let positions = ndi.mixer.mix_main_only(&command);
        let given = model.acceleration(state, at, &positions);
        let gains = Vector3::new(4.0, 4.0, 3.0);
        let error = given - gains.component_mul(&(demanded - state.rates));
        assert!(error.norm() < 1.0e-12, "{error} rad/s2");
    }

    #[test]
    fn without_a_rudder_roll_and_pitch_are_inverted_and_the_rudder_stays_at_rest() {
        let mut effectiveness = Matrix3::new(-8.0, 0.1, 0.0, 0.2, -5.0, 0.0, -0.5, 0.0, 0.0);
        let commands = inverse_of(effectiveness) * Vector3::new(1.0, 2.0, 3.0);
        let given = effectiveness * commands;
        assert!((given.x - 1.0).abs() < 1.0e-12 && (given.y - 2.0).abs() < 1.0e-12, "{given}");
        assert_eq!(commands.z, 0.0);
        effectiveness.set_column(1, &effectiveness.column(0).clone_owned());
        assert_eq!(inverse_of(effectiveness), Matrix3::zeros());
        // A rudder that also rolls, in place of ailerons.
        let rudder = Vector3::new(0.3, 0.0, -7.0);
        let rolls = Matrix3::from_columns(&[-rudder, Vector3::new(0.0, -5.0, 0.0), rudder]);
        let given = rolls * (inverse_of(rolls) * Vector3::new(1.0, 2.0, 3.0));
        assert!((given.x - 1.0).abs() < 1.0e-12 && (given.y - 2.0).abs() < 1.0e-12, "{given}");
    }
}
