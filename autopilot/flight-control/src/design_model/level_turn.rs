//! Not in the paper: the trim of steady level flight, straight or banked, away from the design point.
//!
//! The paper's altitude law is written about one trim. At another dynamic pressure, or in a bank, the aircraft
//! needs another pitch angle, elevator and pitch rate; what the law does not know of that ends as an altitude
//! error that stays.

use super::FlightCondition;
use super::atmosphere;
use crate::aircraft_model::{AircraftModel, AirframeModel, EffectorModel, LiftModel};
use crate::navigation::NavigationState;
use icd::units::STANDARD_GRAVITY_M_S2;

/// Cosine of the bank up to which the turn is level; beyond 60° the demanded lift decreases again.
const LEVEL_COSINE: f64 = 0.5;

/// What a steady level flight needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelTurn {
    /// θ: pitch angle, rad.
    pub theta_rad: f64,
    /// δe: both elevators, rad.
    pub elevator_rad: f64,
    /// q: pitch rate of the turn, rad/s.
    pub pitch_rate_rad_s: f64,
}

/// Coefficients of all effectors that follow the elevator command, per rad of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elevators {
    /// C_Lδ.
    pub c_lift: f64,
    /// C_mδ.
    pub c_pitch: f64,
}

impl Elevators {
    /// Of these effectors.
    pub fn of(effectors: &EffectorModel) -> Self {
        let per_pitch = |coefficients| effectors.per_command(coefficients, |gains| gains.pitch);
        Self { c_lift: per_pitch(&effectors.c_lift), c_pitch: per_pitch(&effectors.c_pitch) }
    }
}

/// Lift in units of the weight at a bank of this cosine.
///
/// 1/cos φ up to 60°. Beyond, 1 + 2 cos φ, and 1 from 90° on: more lift would not point up any more.
fn load_factor(cos_phi: f64) -> f64 {
    if cos_phi >= LEVEL_COSINE { 1.0 / cos_phi } else { 1.0 + 2.0 * cos_phi.max(0.0) }
}

/// Steady level flight at the airspeed, altitude, bank and thrust of `state`, by the controller's model; `at` is
/// the condition of `state`.
///
/// With n = 1/cos φ, q = g (n - 1/n) / V, and τ = T/QS of the measured thrust T:
///
/// * lift: C_L0 + C_Lα α + C_Lq q c/2V + C_Lδ δe + τ α = n m g / QS
/// * pitch: C_m0 + C_mα α + C_mq q c/2V + C_mδ δe = 0
/// * tan θ = tan α / n
///
/// C_Lδ and C_mδ are those of all effectors that follow the elevator command δe. The jet's sin α is written as α. The angle of attack is cut at the stall onset of the model: beyond it more
/// angle gives no more lift that could be relied on.
pub fn level_turn(
    aircraft: &AircraftModel,
    elevators: &Elevators,
    state: &NavigationState,
    at: &FlightCondition,
) -> LevelTurn {
    let AircraftModel { mass, geometry, airframe, lift, .. } = aircraft;
    let q_s = at.q_s_c / geometry.chord_m;
    let v = geometry.chord_m / (2.0 * at.chord_time);
    let n = load_factor(libm::cos(state.attitude.phi));
    let pitch_rate_rad_s = STANDARD_GRAVITY_M_S2 * (n - 1.0 / n) / v;
    let rate = pitch_rate_rad_s * at.chord_time;

    // δe = at_zero + per_alpha α balances the pitching moment.
    let Elevators { c_lift, c_pitch } = *elevators;
    let at_zero = -(airframe.c_pitch_0 + airframe.c_pitch_q * rate) / c_pitch;
    let per_alpha = -airframe.c_pitch_alpha / c_pitch;
    let needed = n * mass.mass_kg * STANDARD_GRAVITY_M_S2 / q_s
        - (lift.c_lift_0 + lift.c_lift_q * rate + c_lift * at_zero);
    // The model was checked without thrust: a negative one could make the slope vanish.
    let slope = lift.c_lift_alpha + c_lift * per_alpha + state.thrust_n.max(0.0) / q_s;
    let onset = airframe.stall_onset_rad;
    let alpha = (needed / slope).clamp(-onset, onset);
    LevelTurn {
        theta_rad: libm::atan(libm::tan(alpha) / n),
        elevator_rad: at_zero + per_alpha * alpha,
        pitch_rate_rad_s,
    }
}

/// Smallest calibrated airspeed of level flight, m/s: at the stall onset, or with the elevators at their end where that comes
/// first. V² = 2 m g / (ρ0 S C_L).
pub fn stall_airspeed_m_s(aircraft: &AircraftModel) -> f64 {
    let LiftModel { c_lift_0, c_lift_alpha, .. } = aircraft.lift;
    let AirframeModel { c_pitch_0, c_pitch_alpha, stall_onset_rad, .. } = aircraft.airframe;
    let Elevators { c_lift, c_pitch } = Elevators::of(&aircraft.effectors);
    let [low, high] = aircraft.effectors.command_range(|gains| gains.pitch);
    // The end that raises the nose.
    let end = if c_pitch < 0.0 { low } else { high };
    let balanced = match c_pitch_alpha < 0.0 {
        true => -(c_pitch_0 + c_pitch * end) / c_pitch_alpha,
        false => stall_onset_rad,
    };
    let alpha = balanced.min(stall_onset_rad);
    let elevator = -(c_pitch_0 + c_pitch_alpha * alpha) / c_pitch;
    let lift = (c_lift_0 + c_lift_alpha * alpha + c_lift * elevator).max(0.1);
    let weight_n = aircraft.mass.mass_kg * STANDARD_GRAVITY_M_S2;
    let pressure_area = 0.5 * atmosphere::density(0.0) * aircraft.geometry.wing_area_m2;
    libm::sqrt(weight_n / (pressure_area * lift))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design_model::DesignModel;
    use crate::testing;
    use proptest::prelude::*;

    fn at(airspeed_m_s: f64, altitude_m: f64, bank_deg: f64, thrust_n: f64) -> LevelTurn {
        let mut state =
            NavigationState { airspeed_m_s, altitude_m, thrust_n, ..testing::level_state() };
        state.attitude.phi = bank_deg.to_radians();
        let model = DesignModel::new(testing::aircraft_model());
        level_turn(
            model.aircraft(),
            &Elevators::of(&model.aircraft().effectors),
            &state,
            &model.condition(&state),
        )
    }

    #[test]
    fn at_the_design_point_it_is_the_trim_of_the_model_file() {
        let trim = testing::aircraft_model().trim;
        let found = at(264.0, 5_000.0, 0.0, trim.thrust_n);
        // The file has the plant's own trim over the round and turning Earth, where 0.4 % less lift is needed; the
        // elevator is two times as sensitive to the angle of attack.
        assert!((found.theta_rad / trim.theta_rad - 1.0).abs() < 0.005, "{found:?}");
        assert!(
            (found.elevator_rad - trim.elevator_rad).abs() < 0.01 * trim.theta_rad,
            "{found:?}"
        );
        assert_eq!(found.pitch_rate_rad_s, 0.0);
    }

    #[test]
    fn a_turn_of_60_degrees_needs_twice_the_lift_and_turns_with_q_of_the_textbook() {
        let (level, turn) = (at(264.0, 5_000.0, 0.0, 0.0), at(264.0, 5_000.0, 60.0, 0.0));
        // q = g tan φ sin φ / V.
        let expected =
            STANDARD_GRAVITY_M_S2 * libm::tan(60_f64.to_radians()) * libm::sin(60_f64.to_radians())
                / 264.0;
        assert!((turn.pitch_rate_rad_s - expected).abs() < 1.0e-12);
        // The nose is as high as half the angle of attack, which is nearly twice that of level flight.
        assert!((turn.theta_rad / level.theta_rad - 1.0).abs() < 0.1, "{turn:?} {level:?}");
        assert!(turn.elevator_rad < level.elevator_rad - 0.05);
    }

    #[test]
    fn left_and_right_are_the_same_to_the_bit_and_beyond_90_degrees_it_is_level_flight() {
        assert_eq!(at(200.0, 8_000.0, -35.0, 2.0e4), at(200.0, 8_000.0, 35.0, 2.0e4));
        assert_eq!(at(200.0, 8_000.0, 170.0, 2.0e4), at(200.0, 8_000.0, 0.0, 2.0e4));
    }

    proptest! {
        #[test]
        fn whatever_is_measured_it_is_finite_and_below_the_stall_onset(
            airspeed_m_s in 0.0..5_000.0, altitude_m in -2.0e5..2.0e5, bank_deg in -180.0..180.0,
            thrust_n in -1.0e8..1.0e8,
        ) {
            let found = at(airspeed_m_s, altitude_m, bank_deg, thrust_n);
            let onset = testing::aircraft_model().airframe.stall_onset_rad;
            prop_assert!(found.theta_rad.abs() <= onset + 1.0e-12, "{found:?}");
            prop_assert!(found.elevator_rad.is_finite() && found.pitch_rate_rad_s.is_finite());
        }
    }
}
