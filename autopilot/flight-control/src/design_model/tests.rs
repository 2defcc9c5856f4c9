use super::*;
use crate::testing;
use icd::tvc_jet;
use proptest::prelude::*;

fn model_and_state() -> (DesignModel, NavigationState) {
    (DesignModel::new(testing::aircraft_model()), testing::level_state())
}

#[test]
fn effectiveness_at_the_design_point_is_that_of_the_reference_model() {
    let (model, state) = model_and_state();
    let at = model.condition(&state);
    // Angular acceleration in rad/s² per rad: docs/paper.md, three decimals.
    let expected = [
        (tvc_jet::LEFT_AILERON, [4.845, 0.0, 0.209]),
        (tvc_jet::RIGHT_AILERON, [-4.845, 0.0, -0.209]),
        (tvc_jet::LEFT_ELEVATOR, [5.712, -0.847, 0.246]),
        (tvc_jet::RIGHT_ELEVATOR, [-5.712, -0.847, -0.246]),
        (tvc_jet::RUDDER, [13.470, 0.0, -5.751]),
    ];
    for (surface, expected) in expected {
        let mut positions = PerEffector::default();
        positions[surface] = 1.0;
        let found = model.surfaces(&at, &positions);
        for axis in 0..3 {
            assert!(
                (found[axis] - expected[axis]).abs() < 2.0e-3,
                "{surface:?} axis {axis}: {}",
                found[axis]
            );
        }
    }
    let g_c = model.redundant_effectiveness(&at);
    let expected = Matrix3::new(-9.690, 0.0, 0.213, 0.0, 2.329, 0.0, -0.418, 0.0, 2.064);
    assert!((g_c - expected).abs().max() < 3.0e-3, "{g_c}");
}

#[test]
fn the_nozzle_turns_the_nose_up_and_right() {
    let (model, state) = model_and_state();
    let at = model.condition(&state);
    let mut positions = PerEffector::default();
    positions[tvc_jet::NOZZLE_PITCH] = 0.1;
    assert!(model.nozzle(&at, &positions).y > 0.0);
    positions = PerEffector::default();
    positions[tvc_jet::NOZZLE_YAW] = 0.1;
    assert!(model.nozzle(&at, &positions).z > 0.0);
}

#[test]
fn the_design_trim_has_no_angular_acceleration() {
    let (model, state) = model_and_state();
    let found =
        model.acceleration(&state, &model.condition(&state), &model.aircraft().trim_positions());
    // The model's trim is rounded to five digits.
    assert!(found.norm() < 1.0e-3, "{found} rad/s2");
}

proptest! {
    #[test]
    fn inertial_coupling_is_euler_s_equation(p in -3.0..3.0, q in -3.0..3.0, r in -3.0..3.0) {
        let mass = testing::aircraft_model().mass;
        let rates = Vector3::new(p, q, r);
        let inertia = Matrix3::new(
            mass.ixx_kg_m2, 0.0, -mass.ixz_kg_m2,
            0.0, mass.iyy_kg_m2, 0.0,
            -mass.ixz_kg_m2, 0.0, mass.izz_kg_m2,
        );
        let expected = -(inverse_inertia(&mass) * rates.cross(&(inertia * rates)));
        prop_assert!((inertial_coupling(&mass, &rates) - expected).norm() < 1.0e-12);
    }

    #[test]
    fn the_mirrored_state_gives_mirrored_acceleration_to_the_bit(
        p in -1.0..1.0, q in -1.0..1.0, r in -1.0..1.0, alpha in -0.5..0.5, beta in -0.5..0.5,
        left in -0.5..0.5, right in -0.5..0.5, rudder in -0.5..0.5, nozzle in -0.2..0.2,
    ) {
        let (model, mut state) = model_and_state();
        state.rates = Vector3::new(p, q, r);
        state.alpha = alpha;
        state.beta = beta;
        let mut mirrored = state;
        mirrored.rates = Vector3::new(-p, q, -r);
        mirrored.beta = -beta;
        let positions = PerEffector::from_values([left, right, right, left, rudder, nozzle, nozzle, 0.0]);
        let other = PerEffector::from_values([right, left, left, right, -rudder, nozzle, -nozzle, 0.0]);
        let a = model.acceleration(&state, &model.condition(&state), &positions);
        let b = model.acceleration(&mirrored, &model.condition(&mirrored), &other);
        prop_assert_eq!((a.x, a.y, a.z), (-b.x, b.y, -b.z));
    }
}
