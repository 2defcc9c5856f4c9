//! Signs, sizes and symmetry of the effectors.

use super::*;

#[test]
fn positive_effectors_turn_the_aircraft_as_the_interface_document_defines() {
    let table = [
        (tvc_jet::LEFT_AILERON, [1.0, 0.0, 1.0]),
        (tvc_jet::RIGHT_AILERON, [-1.0, 0.0, -1.0]),
        (tvc_jet::LEFT_ELEVATOR, [1.0, -1.0, 1.0]),
        (tvc_jet::RIGHT_ELEVATOR, [-1.0, -1.0, -1.0]),
        (tvc_jet::RUDDER, [1.0, 0.0, -1.0]),
        (tvc_jet::NOZZLE_PITCH, [0.0, 1.0, 0.0]),
        (tvc_jet::NOZZLE_YAW, [0.0, 0.0, 1.0]),
    ];
    for (effector, signs) in table {
        let mut setup = flat();
        setup.faults = vec![stuck(effector, 0.1, 0)];
        let acceleration = plant(&setup).truth().angular_acceleration.0;
        for (axis, sign) in signs.into_iter().enumerate() {
            let ours = acceleration[axis];
            if sign == 0.0 {
                // Nozzle yaw rolls a little through the product of inertia; pitch is untouched by the rest.
                assert!(ours.abs() < 0.03, "{effector:?}, axis {axis}: {ours} rad/s2");
            } else {
                assert!(ours * sign > 0.01, "{effector:?}, axis {axis}: {ours} rad/s2");
            }
        }
    }
}

#[test]
fn val_effectiveness_at_the_design_point_is_that_of_the_parameter_set() {
    // docs/paper.md, "Effectiveness at the design point": rad/s2 per rad, printed with three decimals.
    let table = [
        (tvc_jet::LEFT_AILERON, [4.845, 0.0, 0.209]),
        (tvc_jet::LEFT_ELEVATOR, [5.712, -0.847, 0.246]),
        (tvc_jet::RIGHT_ELEVATOR, [-5.712, -0.847, -0.246]),
        (tvc_jet::RUDDER, [13.470, 0.0, -5.751]),
        (tvc_jet::NOZZLE_PITCH, [0.0, 2.329, 0.0]),
        (tvc_jet::NOZZLE_YAW, [0.213, 0.0, 2.064]),
    ];
    for (effector, printed) in table {
        let mut setup = flat();
        // 1 mrad: the nozzle's sine is linear to 2e-7.
        setup.faults = vec![stuck(effector, 0.001, 0)];
        let ours = plant(&setup).truth().angular_acceleration.0 * 1_000.0;
        for axis in 0..3 {
            let (ours, printed) = (ours[axis], printed[axis]);
            assert!(
                (ours - printed).abs() < 1e-3,
                "{effector:?}, axis {axis}: {ours}, not {printed}"
            );
        }
    }
}

#[test]
fn a_mirrored_flight_is_mirrored_to_the_bit() {
    let side = |mirrored: bool| {
        let mut setup = flat();
        let effector = if mirrored { tvc_jet::RIGHT_ELEVATOR } else { tvc_jet::LEFT_ELEVATOR };
        setup.faults = vec![stuck(effector, 0.3, 500_000)];
        let mut plant = plant(&setup);
        fly(&mut plant, 1_000, |time, commands| {
            wiggle(time, commands);
            if mirrored {
                let c = *commands;
                *commands = PerEffector::from_fn(|e| c[tvc_jet::effectors().mirrored(e)]);
                commands[tvc_jet::RUDDER] = -c[tvc_jet::RUDDER];
            }
        });
        *plant.truth()
    };
    let (left, right) = (side(false), side(true));
    let mirror = [-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
    for ((left, right), sign) in numbers(&left).into_iter().zip(numbers(&right)).zip(mirror) {
        assert_eq!(left, sign * right);
    }
    assert!(left.euler().phi > 0.1, "the flight must not be trivial: {} rad", left.euler().phi);
}
