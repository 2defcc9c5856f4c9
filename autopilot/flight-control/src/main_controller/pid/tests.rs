use super::*;
use crate::design_model::DesignModel;
use crate::design_model::level_turn::LevelTurn;
use crate::gains::{Gains, MainLaw};
use crate::main_controller::{Demand, MainController};
use crate::navigation::NavigationState;
use crate::signals::{Saturation, Side};
use crate::testing;
use icd::ControlPeriod;

fn model() -> DesignModel {
    DesignModel::new(testing::aircraft_model())
}

/// The law under its references.
fn flying(main: MainLaw) -> MainController {
    let mut gains = Gains::REFERENCE;
    gains.selection.main = main;
    MainController::new(&gains, &model(), ControlPeriod::DEFAULT)
}

fn controller() -> MainController {
    flying(MainLaw::Pid)
}

fn saturated_step(
    controller: &mut MainController,
    state: &NavigationState,
    demand: &Demand,
    saturated: &Saturation,
) -> MainCommand {
    let model = model();
    controller.step(state, &model.condition(state), demand, saturated, &model, None)
}

fn step(controller: &mut MainController, state: &NavigationState, demand: &Demand) -> MainCommand {
    saturated_step(controller, state, demand, &Saturation::default())
}

/// What only the integrators ask for, in level flight on the reference.
fn integrals(controller: &MainController) -> &Pid {
    let crate::main_controller::RunningLaw::Pid(pid) = &controller.running else {
        panic!("the PID flies")
    };
    pid
}

#[test]
fn level_flight_on_reference_is_left_at_trim() {
    let command = step(&mut controller(), &testing::level_state(), &testing::level_demand());
    let trim = testing::aircraft_model().trim;
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
    let band = PidGains::REFERENCE.altitude;
    let most = band.k_h * band.error_max_m + band.integral_max_rad;
    assert!(command.elevator_rad >= -most - 1.0e-12, "{} rad", command.elevator_rad);
}

#[test]
fn a_saturated_aileron_freezes_the_roll_integrator_in_the_pushing_direction_only() {
    let mut state = testing::level_state();
    state.attitude.phi = 0.5;
    let run = |side: Side| {
        let mut controller = controller();
        let saturation = Saturation { aileron: side, ..Saturation::default() };
        let demand = testing::level_demand();
        for _ in 0..1000 {
            saturated_step(&mut controller, &state, &demand, &saturation);
        }
        integrals(&controller).roll.value()
    };
    assert_eq!(run(Side::Above), 0.0);
    assert!(run(Side::Below) > 0.0);
    assert!(run(Side::Inside) > 0.0);
}

#[test]
fn the_ganged_nozzle_helps_the_elevator_and_the_fin() {
    let mut state = testing::level_state();
    state.beta = 0.01;
    let demand = Demand { altitude_m: 4_000.0, ..testing::level_demand() };
    let mut controller = flying(MainLaw::PidGangedNozzle);
    let mut command = MainCommand::default();
    for _ in 0..100 {
        command = step(&mut controller, &state, &demand);
    }
    // Elevator down pitches down; so must the nozzle. Wind from the right wants the nose to the right.
    assert!(command.elevator_rad > 0.0 && command.nozzle_pitch_rad < 0.0);
    assert!((command.nozzle_yaw_rad - 0.04).abs() < 1.0e-12);
}

/// Level flight at this airspeed and altitude, trimmed as the model says, with this bank.
fn trimmed(
    airspeed_m_s: f64,
    altitude_m: f64,
    bank_deg: f64,
) -> (NavigationState, LevelTurn, Demand) {
    let model = model();
    let mut state = NavigationState { airspeed_m_s, altitude_m, ..testing::level_state() };
    state.attitude.phi = bank_deg.to_radians();
    let trim = model.trim(&state, &model.condition(&state));
    state.attitude.theta = trim.theta_rad;
    state.rates.y = trim.pitch_rate_rad_s;
    let demand = Demand { altitude_m, roll_rad: state.attitude.phi, airspeed_m_s };
    (state, trim, demand)
}

#[test]
fn away_from_the_design_point_a_trimmed_flight_on_its_reference_is_left_at_its_trim() {
    let design = testing::aircraft_model().trim;
    for (airspeed_m_s, altitude_m, bank_deg) in
        [(180.0, 10_000.0, 0.0), (320.0, 600.0, 0.0), (250.0, 6_000.0, 60.0)]
    {
        let (state, trim, demand) = trimmed(airspeed_m_s, altitude_m, bank_deg);
        let command = step(&mut controller(), &state, &demand);
        assert!((command.elevator_rad - trim.elevator_rad).abs() < 1.0e-12);
        assert!((trim.elevator_rad - design.elevator_rad).abs() > 0.01, "{trim:?}");
    }
}

/// The integrator after 10 s with this error and climb rate.
fn integrated(error_m: f64, climb_rate_m_s: f64, alpha: f64) -> f64 {
    let mut controller = controller();
    let level = testing::level_state();
    let altitude_m = level.altitude_m + error_m;
    // The reference stays where the first step found the aircraft.
    step(&mut controller, &level, &testing::level_demand());
    let velocity = icd::Ned::new(264.0, 0.0, -climb_rate_m_s);
    let state = NavigationState { altitude_m, velocity, alpha, ..level };
    for _ in 0..5_000 {
        step(&mut controller, &state, &testing::level_demand());
    }
    integrals(&controller).altitude.value()
}

#[test]
fn beyond_its_band_the_altitude_integrator_runs_when_the_aircraft_has_stopped_climbing() {
    let alpha = testing::level_state().alpha;
    assert_eq!(integrated(-300.0, 5.0, alpha), 0.0, "a climb");
    // 7 s at 300 m and 0.00008 rad/(m s).
    assert!((integrated(-300.0, 1.0, alpha) + 0.168).abs() < 0.001);
    assert!(integrated(-30.0, 5.0, alpha) < 0.0, "inside the band it always runs");
}

#[test]
fn beyond_the_stall_onset_the_nose_is_pushed_down_and_the_integrator_does_not_pull() {
    let onset = testing::aircraft_model().airframe.stall_onset_rad;
    let command = |alpha| {
        let state = NavigationState { alpha, ..testing::level_state() };
        step(&mut controller(), &state, &testing::level_demand()).elevator_rad
    };
    assert_eq!(command(onset), command(0.0));
    assert!(command(onset + 0.05) > command(onset) + 0.3);
    assert_eq!(integrated(-300.0, 0.0, onset + 0.01), 0.0);
    assert!(integrated(300.0, 0.0, onset + 0.01) > 0.0);
}
