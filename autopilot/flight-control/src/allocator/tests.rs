use super::*;
use crate::NavigationState;
use crate::mixer::Mixer;
use crate::testing;
use icd::tvc_jet;
use proptest::prelude::*;

fn jet() -> (DesignModel, FlightCondition) {
    let model = DesignModel::new(testing::aircraft_model());
    let at = model.condition(&testing::level_state());
    (model, at)
}

/// An aircraft without nozzle.
fn aerosonde() -> (DesignModel, FlightCondition, PerEffector<f64>) {
    let model = DesignModel::new(testing::aerosonde());
    let at = model.condition(model.design_point());
    let trim = model.aircraft().trim_positions();
    (model, at, trim)
}

fn effect(model: &DesignModel, at: &FlightCondition, positions: &PerEffector<f64>) -> Vector3<f64> {
    model.surfaces(at, positions) + model.nozzle(at, positions)
}

#[test]
fn the_columns_are_those_of_the_design_model() {
    let (model, at) = jet();
    for effector in tvc_jet::ALL {
        let mut positions = PerEffector::default();
        positions[effector] = 0.01;
        let (column, whole) = (model.effect(&at, effector), effect(&model, &at, &positions));
        let engine = effector == tvc_jet::ENGINE;
        assert!((0.01 * column - whole).norm() < 1.0e-14, "{effector:?}");
        assert_eq!(column == Vector3::zeros(), engine, "{effector:?}");
    }
}

proptest! {
    #[test]
    fn a_small_demand_is_met_on_all_axes_also_without_a_nozzle(
        p in -1.0..1.0_f64, q in -1.0..1.0_f64, r in -0.1..0.1_f64, fade in 0.01..1.0_f64,
    ) {
        let z2 = Vector3::new(p, q, r);
        let (model, at, trim) = aerosonde();
        let increments = Allocator::default().step(&z2, fade, &model, &at, &trim);
        let rest = effect(&model, &at, &increments.positions) + fade * z2;
        prop_assert!(rest.norm() < 1.0e-3 * fade * z2.norm(), "{rest}");
    }

    #[test]
    fn no_command_leaves_the_travel_whatever_is_estimated(
        z2 in proptest::array::uniform3(-1.0e3..1.0e3_f64),
        commands in proptest::array::uniform3(-1.0..1.0_f64),
    ) {
        let (model, at) = jet();
        let mixer = Mixer::new(&model.aircraft().effectors);
        let [aileron_rad, elevator_rad, nozzle_pitch_rad] = commands;
        let command = crate::MainCommand { aileron_rad, elevator_rad, nozzle_pitch_rad, ..Default::default() };
        let main = mixer.mix(&command, &crate::Compensation::NONE);
        let mut allocator = Allocator::default();
        let increments = allocator.step(&Vector3::from(z2), 1.0, &model, &at, &main.commands);
        let mixed = mixer.add(main, &increments);
        for effector in tvc_jet::ALL {
            let servo = &model.aircraft().effectors.servos[effector];
            prop_assert!((servo.min..=servo.max).contains(&mixed.commands[effector]));
        }
    }
}

#[test]
fn asleep_means_exactly_zero_and_a_fresh_start() {
    let (model, at) = jet();
    let mut allocator = Allocator::default();
    let z2 = Vector3::new(50.0, 20.0, 10.0);
    allocator.step(&z2, 1.0, &model, &at, &PerEffector::default());
    let asleep = allocator.step(&z2, 0.0, &model, &at, &PerEffector::default());
    assert_eq!(asleep, Increments::default());
    assert_eq!(allocator.active, ActiveSet::default());
}

#[test]
fn a_demand_beyond_the_travel_gives_roll_before_yaw_and_names_the_effectors_at_their_ends() {
    let (model, at, trim) = aerosonde();
    let z2 = Vector3::new(5.0, 0.0, 20.0);
    let increments = Allocator::default().step(&z2, 1.0, &model, &at, &trim);
    let rest = effect(&model, &at, &increments.positions) + z2;
    assert!(rest.x.abs() < 0.1 && rest.z > 5.0, "{rest}");
    let list = &model.aircraft().effectors.list;
    let limited = list.all().filter(|e| increments.limited.contains(*e)).map(|e| list.name(e));
    assert!(
        limited.clone().any(|name| name == "rudder"),
        "{:?}",
        limited.collect::<std::vec::Vec<_>>()
    );
}

#[test]
fn without_thrust_the_nozzle_is_left_alone() {
    let (model, _) = jet();
    let still = NavigationState { thrust_n: 0.0, ..testing::level_state() };
    let at = model.condition(&still);
    let z2 = Vector3::new(1.0, 0.3, 0.2);
    let increments = Allocator::default().step(&z2, 1.0, &model, &at, &PerEffector::default());
    assert_eq!(increments.positions[tvc_jet::NOZZLE_PITCH], 0.0);
    assert!(increments.positions[tvc_jet::LEFT_ELEVATOR] > 0.0, "the elevators do it");
}
