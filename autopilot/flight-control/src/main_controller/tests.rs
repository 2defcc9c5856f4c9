use super::*;
use crate::gains::Gains;
use crate::mixer::Side;
use crate::testing;

fn controller() -> MainController {
    MainController::new(&Gains::REFERENCE.main, ControlPeriod::DEFAULT)
}

fn step(controller: &mut MainController, state: &State, demand: &Demand) -> MainCommand {
    let belief = testing::belief();
    let gains = Gains::REFERENCE.main;
    controller.step(state, demand, &Saturation::default(), &gains, MainLaw::Pid, &belief)
}

#[test]
fn level_flight_on_reference_is_left_at_trim() {
    let command = step(&mut controller(), &testing::level_state(), &testing::level_demand());
    let trim = testing::belief().trim;
    assert!(command.aileron_rad.abs() < 1.0e-15 && command.rudder_rad.abs() < 1.0e-15);
    assert!((command.elevator_rad - trim.elevator_rad).abs() < 1.0e-12);
    assert!((command.thrust_n - trim.thrust_n).abs() < 1.0e-9);
}

#[test]
fn a_higher_reference_raises_the_trailing_edges_of_the_elevators() {
    let mut controller = controller();
    let demand = Demand { altitude_m: 6_000.0, ..testing::level_demand() };
    let mut command = MainCommand::default();
    for _ in 0..500 {
        command = step(&mut controller, &testing::level_state(), &demand);
    }
    assert!(command.elevator_rad < -0.05, "{} rad", command.elevator_rad);
}

#[test]
fn a_roll_reference_to_the_right_asks_for_negative_aileron() {
    let mut controller = controller();
    let demand = Demand { roll_rad: 0.26, ..testing::level_demand() };
    let command = step(&mut controller, &testing::level_state(), &demand);
    // Positive aileron rolls left.
    assert!(command.aileron_rad < 0.0);
}

#[test]
fn the_altitude_reference_slews_and_the_error_is_limited() {
    let mut controller = controller();
    let state = testing::level_state();
    let demand = Demand { altitude_m: 9_000.0, ..testing::level_demand() };
    step(&mut controller, &state, &demand);
    let first = controller.references().unwrap().altitude_m;
    assert!((first - 5_000.2).abs() < 1.0e-9, "100 m/s for 2 ms: {first} m");
    for _ in 0..10_000 {
        step(&mut controller, &state, &demand);
    }
    let command = step(&mut controller, &state, &demand);
    // The trim, and 400 m at 0.00125 rad/m; the integrator is outside its band since the first second.
    let band = Gains::REFERENCE.main.altitude;
    let most = band.k_h * band.error_max_m + band.integral_max_rad;
    assert!(command.elevator_rad >= -most - 1.0e-12, "{} rad", command.elevator_rad);
}

#[test]
fn a_saturated_aileron_freezes_the_roll_integrator_in_the_pushing_direction_only() {
    let belief = testing::belief();
    let gains = Gains::REFERENCE.main;
    let mut state = testing::level_state();
    state.attitude.phi = 0.5;
    let run = |side: Side| {
        let mut controller = controller();
        let saturation = Saturation { aileron: side, ..Saturation::default() };
        let demand = testing::level_demand();
        for _ in 0..1000 {
            controller.step(&state, &demand, &saturation, &gains, MainLaw::Pid, &belief);
        }
        controller.roll.value()
    };
    assert_eq!(run(Side::Above), 0.0);
    assert!(run(Side::Below) > 0.0);
    assert!(run(Side::Inside) > 0.0);
}

#[test]
fn the_ganged_nozzle_helps_the_elevator_and_the_fin() {
    let belief = testing::belief();
    let gains = Gains::REFERENCE.main;
    let mut state = testing::level_state();
    state.beta = 0.01;
    let demand = Demand { altitude_m: 4_000.0, ..testing::level_demand() };
    let mut controller = controller();
    let mut command = MainCommand::default();
    for _ in 0..100 {
        command = controller.step(
            &state,
            &demand,
            &Saturation::default(),
            &gains,
            MainLaw::PidGangedNozzle,
            &belief,
        );
    }
    // Elevator down pitches down; so must the nozzle. Wind from the right wants the nose to the right.
    assert!(command.elevator_rad > 0.0 && command.nozzle_pitch_rad < 0.0);
    assert!((command.nozzle_yaw_rad - 0.04).abs() < 1.0e-12);
}
