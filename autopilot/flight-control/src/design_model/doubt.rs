//! How wrong the design model may be at a flight condition, and with an estimated state: what the levels of the detector have to know.

use nalgebra::Vector3;

use super::{DesignModel, FlightCondition, atmosphere};
use crate::navigation::NavigationState;

/// Up to this Mach number the rule of Prandtl and Glauert is used; at 1 it has a pole.
const MACH_MAX: f64 = 0.95;
/// Moments larger than at the design point by this part are within its levels, which are those of a whole flight about it.
const GROWTH_FREE: f64 = 1.15;
/// Growth of the errors of the model over that of the moments.
const GROWTH_SLOPE: f64 = 1.2;
/// Growth of the levels over the part by which coefficients below the design Mach number are smaller than the model's.
const SLOWER_SLOPE: f64 = 0.7;

/// Strength of the vertical gusts below 1000 ft in moderate turbulence, m/s rms, and their length from 2000 ft on, m; it shrinks with the
/// height to this one (MIL-F-8785C, 3.7.2 and 3.7.3).
const GUST_M_S: f64 = 1.54;
const GUST_LENGTH_M: f64 = 533.4;
pub(crate) const GUST_LENGTH_MIN_M: f64 = 3.0;
/// Time from a gust to the flow angles that tell of it, s: age of the samples of a vane, and the observer.
const FLOW_LAG_S: f64 = 0.025;

/// How wrong the design model may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelDoubt {
    /// Errors of the model, and moments of gusts that it does not know, over those at the design point; at least 1.
    pub growth: f64,
    /// Standard deviation of the modelled acceleration from that of the flow angles, roll, pitch and yaw, rad/s².
    pub spread: Vector3<f64>,
}

/// What the growth is measured against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reference {
    q_s_b: f64,
    compressibility: f64,
}

impl Reference {
    /// A flight condition.
    pub(super) fn of(state: &NavigationState, at: &FlightCondition) -> Self {
        Self { q_s_b: at.q_s_b, compressibility: compressibility(state) }
    }
}

/// 1/√(1 - M²): the rule of Prandtl and Glauert for the growth of aerodynamic coefficients with the Mach number.
fn compressibility(state: &NavigationState) -> f64 {
    let kelvin = atmosphere::temperature(state.altitude_m);
    let sound_2 = atmosphere::HEAT_RATIO * atmosphere::GAS_CONSTANT * kelvin;
    let mach_2 = state.airspeed_m_s * state.airspeed_m_s / sound_2;
    1.0 / libm::sqrt(1.0 - mach_2.min(MACH_MAX * MACH_MAX))
}

impl DesignModel {
    /// How wrong the model may be at `state`, of which `at` is the condition.
    ///
    /// The coefficients are those of the design point or its schedule. Their errors, and the rolling and turning gusts that no sensor
    /// shows, are parts of the moments, which grow with the dynamic pressure and, as the model does not know, with the Mach number.
    pub fn doubt(&self, state: &NavigationState, at: &FlightCondition) -> ModelDoubt {
        let ratio = compressibility(state) / self.reference.compressibility;
        // An aircraft with smaller coefficients than the model's at low Mach numbers is no reason for lower levels.
        let compressibility = ratio.max(1.0);
        let moments = at.q_s_b / self.reference.q_s_b * compressibility;
        let mut growth = 1.0 + GROWTH_SLOPE * (moments - GROWTH_FREE).max(0.0);
        if state.estimate.is_some() {
            // Nor is the model right there: what the larger flow angles of slow flight make is explained too much. An exact state
            // leaves room for that in the levels; errors of an estimated one have used it up.
            growth += SLOWER_SLOPE * (1.0 - ratio).max(0.0);
        }
        // An exact state has no spread, and without a ground the levels are those of the gains to the bit.
        let [alpha, beta] =
            state.estimate.map_or([0.0; 2], |status| status.flow_rad.map(f64::from));
        let a = &self.aircraft.airframe;
        let moment = Vector3::new(
            at.q_s_b * a.c_roll_beta * beta,
            at.q_s_c * a.c_pitch_alpha * alpha,
            at.q_s_b * a.c_yaw_beta * beta,
        );
        let mut spread = self.inverse_inertia * moment * compressibility;
        if let Some(height_m) = state.rough_height_m {
            let turned = self.inverse_inertia * self.short_gusts(height_m, at);
            spread = spread.zip_map(&turned, libm::hypot);
        }
        ModelDoubt { growth, spread }
    }

    /// Standard deviations of the moments of short gusts near the ground, beyond those that the levels have from high up, N m.
    ///
    /// A gust of the strength σ and the length L turns the air about a wing of the span b by about σ √(1.5 / (L b)) rms: the
    /// spectra of 3.7.5, integrated, give 0.66 to 1.0 of that in pitch and yaw for L from 2 b on, in roll 0.9 to 1.5. While its angle
    /// is measured it changes by σ √(2 τ / (L V)).
    fn short_gusts(&self, height_m: f64, at: &FlightCondition) -> Vector3<f64> {
        let length_m = height_m.clamp(GUST_LENGTH_MIN_M, GUST_LENGTH_M);
        let (a, span_m) = (&self.aircraft.airframe, self.aircraft.geometry.span_m);
        let shorter = GUST_M_S * libm::sqrt(1.0 / length_m - 1.0 / GUST_LENGTH_M);
        let rate = shorter * libm::sqrt(1.5 / span_m);
        // Times √(2 / V), with the time b / 2V.
        let angle = shorter * libm::sqrt(4.0 * FLOW_LAG_S * at.span_time / span_m);
        let (span_rate, chord_rate) = (at.span_time * rate, at.chord_time * rate);
        let root = |parts: [f64; 3]| libm::sqrt(parts.iter().map(|part| part * part).sum());
        Vector3::new(
            at.q_s_b
                * root([a.c_roll_p * span_rate, a.c_roll_r * span_rate, a.c_roll_beta * angle]),
            at.q_s_c * libm::hypot(a.c_pitch_q * chord_rate, a.c_pitch_alpha * angle),
            at.q_s_b * root([a.c_yaw_p * span_rate, a.c_yaw_r * span_rate, a.c_yaw_beta * angle]),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aircraft_model::AircraftModel;
    use crate::estimator_status::EstimatorStatus;
    use crate::gains::Gains;
    use crate::testing;

    fn levels(airspeed_m_s: f64, altitude_m: f64, flow_rad: Option<[f32; 2]>) -> Vector3<f64> {
        let model = DesignModel::new(testing::aircraft_model());
        let estimate = flow_rad.map(|flow_rad| EstimatorStatus { flow_rad, ..Default::default() });
        let state = NavigationState { airspeed_m_s, altitude_m, estimate, ..*model.design_point() };
        let at = model.condition(&state);
        Gains::REFERENCE.activation.levels_with(&model.doubt(&state, &at))
    }

    #[test]
    fn with_an_exact_state_the_levels_about_the_design_point_and_below_are_those_of_the_gains() {
        for (airspeed_m_s, altitude_m) in
            [(264.0, 5_000.0), (270.0, 5_000.0), (200.0, 2_000.0), (270.0, 8_000.0), (0.0, 0.0)]
        {
            let found = levels(airspeed_m_s, altitude_m, None);
            // To the bit: the paper's flights keep theirs.
            assert_eq!(found, Gains::REFERENCE.activation.levels(), "{airspeed_m_s} m/s");
        }
    }

    #[test]
    fn the_levels_grow_with_dynamic_pressure_and_mach_number_up_to_a_bound() {
        let design = levels(264.0, 5_000.0, None);
        // Dynamic pressure times 1/√(1 - M²): 2.32 and 2.08 of the design point's.
        for (altitude_m, growth) in [(2_000.0, 2.40), (5_000.0, 2.12)] {
            let ratio = levels(300.0, altitude_m, None).component_div(&design);
            assert!((ratio - Vector3::repeat(growth)).amax() < 0.02, "{altitude_m} m: {ratio}");
        }
        // At Mach 1 and beyond nothing is infinite.
        for airspeed_m_s in [330.0, 600.0, 5_000.0] {
            assert!(levels(airspeed_m_s, 0.0, None).iter().all(|level| level.is_finite()));
        }
    }

    #[test]
    fn below_the_design_mach_number_the_levels_of_an_estimated_state_grow_and_at_it_they_do_not() {
        let growth = |airspeed_m_s, altitude_m| {
            let [exact, estimated] =
                [None, Some([0.0; 2])].map(|flow| levels(airspeed_m_s, altitude_m, flow));
            estimated.component_div(&exact)
        };
        // 1/√(1 - M²) at Mach 0.60 over that at 0.82 is 0.72.
        for (airspeed_m_s, altitude_m, expected) in [(200.0, 2_000.0, 1.20), (264.0, 5_000.0, 1.0)]
        {
            let found = growth(airspeed_m_s, altitude_m);
            assert!(
                (found - Vector3::repeat(expected)).amax() < 0.01,
                "{airspeed_m_s} m/s: {found}"
            );
        }
    }

    #[test]
    fn what_the_estimator_does_not_know_of_the_flow_raises_the_levels() {
        let [exact, unsure] = [[0.0; 2], [0.01, 0.01]].map(|s| levels(264.0, 5_000.0, Some(s)));
        // C_lβ Q S b / Ixx is 76 /s²: two deviations of 0.01 rad make 1.5 rad/s² of roll. It is 3.3 in pitch and 5.7 in yaw.
        for (axis, added) in [1.5, 0.065, 0.10].into_iter().enumerate() {
            let expected = libm::hypot(exact[axis], added);
            assert!((unsure[axis] / expected - 1.0).abs() < 0.03, "axis {axis}: {unsure}");
        }
    }

    #[test]
    fn short_gusts_near_the_ground_raise_the_levels_of_a_slow_light_aircraft_more_than_those_of_a_jet()
     {
        let ratio = |mut aircraft: AircraftModel, airspeed_m_s: f64, height_m: f64| {
            aircraft.trim.airspeed_m_s = airspeed_m_s;
            let model = DesignModel::new(aircraft);
            let levels = |rough_height_m| {
                let state = NavigationState {
                    airspeed_m_s,
                    altitude_m: 0.0,
                    rough_height_m,
                    ..*model.design_point()
                };
                let at = model.condition(&state);
                Gains::REFERENCE.activation.levels_with(&model.doubt(&state, &at))
            };
            levels(Some(height_m)).component_div(&levels(None))
        };
        let jet = testing::aircraft_model();
        // Half the span and a sixteenth of the mass, so a 64th of the inertia.
        let mut light = jet;
        light.geometry.span_m *= 0.5;
        light.mass.ixx_kg_m2 /= 64.0;
        light.mass.iyy_kg_m2 /= 64.0;
        light.mass.izz_kg_m2 /= 64.0;
        light.mass.ixz_kg_m2 /= 64.0;
        let near = ratio(jet, 100.0, 20.0);
        assert!(near.iter().all(|ratio| (1.0..1.3).contains(ratio)), "{near}");
        assert!((ratio(light, 100.0, 20.0) - near).min() > 0.5);
        // Below 3 m they grow no more, and at the length of gusts high up there is nothing to add.
        assert_eq!(ratio(jet, 100.0, 3.0), ratio(jet, 100.0, -1.0));
        assert_eq!(ratio(jet, 100.0, 600.0), Vector3::repeat(1.0));
    }
}
