//! Loss of the position, of the engine, and little fuel.

use super::plane::*;
use crate::vehicle::failsafe::{EngineAction, Failsafe, FuelAction, FuelLevel, Powerplant};
use crate::vehicle::{Mode, VehicleEvent};

fn begins(failsafe: Failsafe) -> VehicleEvent {
    VehicleEvent::Failsafe { failsafe, is_there: true }
}

fn ends(failsafe: Failsafe) -> VehicleEvent {
    VehicleEvent::Failsafe { failsafe, is_there: false }
}

#[test]
fn without_a_position_it_circles_with_a_fixed_bank_until_the_position_is_back() {
    let mut plane = Plane::begin(vec![waypoint(0.0, 300.0, 5_000.0)]);
    plane.fly(300.0);
    plane.valid.position = false;
    plane.fly(4.0);
    // A short gap changes nothing.
    assert!(
        plane.roll.abs() < 0.02
            && plane.events.iter().all(|event| *event != begins(Failsafe::PositionLost))
    );
    plane.fly(10.0);
    assert!(plane.events.contains(&begins(Failsafe::PositionLost)));
    let bank_deg = plane.rules.navigation.lost_bank_deg;
    assert!((plane.roll.to_degrees() - bank_deg).abs() < 0.1, "{}", plane.roll.to_degrees());
    plane.valid.position = true;
    plane.fly(120.0);
    assert!(plane.events.contains(&ends(Failsafe::PositionLost)));
    assert_eq!(plane.vehicle.mode(), Mode::Mission);
    assert!(plane.roll.abs() < 0.1, "on its way again: {}", plane.roll);
}

#[test]
fn a_mode_that_needs_no_position_goes_on_without_one() {
    let mut plane = Plane::flying();
    plane.valid.position = false;
    plane.fly(60.0);
    assert!(plane.events.contains(&begins(Failsafe::PositionLost)));
    assert!(plane.roll.abs() < 0.02, "{}", plane.roll);
}

/// Slow, and with all thrust commanded.
fn without_thrust(mode: Mode, action: EngineAction) -> Plane {
    let mut plane = Plane::flying();
    plane.rules.navigation.engine_action = action;
    plane.rules.stall_m_s = 75.0;
    plane.change(mode).unwrap();
    plane.propulsion.commanded_n = 50_000.0;
    plane.airspeed_m_s = 200.0;
    plane
}

#[test]
fn an_engine_without_thrust_has_failed_but_a_monitor_that_reads_nothing_is_no_engine() {
    let mut plane = without_thrust(Mode::Hold, EngineAction::Return);
    plane.fly(3.0);
    assert_eq!(plane.vehicle.mode(), Mode::Hold);
    plane.airspeed_m_s = 200.0;
    plane.fly(3.0);
    assert!(plane.events.contains(&begins(Failsafe::EngineFailed)), "{:?}", plane.events);
    assert_eq!(plane.vehicle.mode(), Mode::Return);
    plane.thrust_n = 40_000.0;
    plane.fly(5.0);
    assert!(plane.events.contains(&ends(Failsafe::EngineFailed)), "{:?}", plane.events);

    let mut plane = without_thrust(Mode::Hold, EngineAction::Return);
    plane.airspeed_m_s = 264.0;
    plane.fly(60.0);
    assert_eq!(plane.vehicle.mode(), Mode::Hold, "the aircraft holds its airspeed");
    let mut plane = without_thrust(Mode::Hold, EngineAction::Return);
    plane.valid.thrust = false;
    plane.fly(8.0);
    assert_eq!(plane.vehicle.mode(), Mode::Hold, "nobody knows the thrust");
}

#[test]
fn an_aircraft_that_has_landed_without_thrust_flies_again_with_an_engine_that_was_mended() {
    let mut plane = without_thrust(Mode::Hold, EngineAction::Return);
    plane.fly(5.0);
    assert!(plane.events.contains(&begins(Failsafe::EngineFailed)), "{:?}", plane.events);
    // Low enough for the landing straight ahead.
    plane.altitude_m = 20.0;
    plane.fly(2.0);
    (plane.on_wheels, plane.airspeed_m_s) = (true, 0.1);
    plane.tick();
    plane.on_wheels = false;
    (plane.altitude_m, plane.airspeed_m_s, plane.thrust_n) = (500.0, 200.0, 50_000.0);
    plane.change(Mode::Hold).unwrap();
    plane.fly(30.0);
    assert!(plane.roll.abs() > 0.1, "it circles: {}", plane.roll);
}

#[test]
fn the_action_of_a_failed_engine_is_that_of_the_parameter_and_of_the_mode() {
    let mode_of = |mode, action| {
        let mut plane = without_thrust(mode, action);
        plane.fly(8.0);
        assert!(plane.events.contains(&begins(Failsafe::EngineFailed)), "{:?}", plane.events);
        (plane.vehicle.mode(), plane.vehicle.is_terminated())
    };
    assert_eq!(mode_of(Mode::Hold, EngineAction::Return), (Mode::Return, false));
    assert_eq!(mode_of(Mode::Hold, EngineAction::Report), (Mode::Hold, false));
    assert_eq!(mode_of(Mode::Position, EngineAction::Return), (Mode::Position, false));
    assert!(mode_of(Mode::Hold, EngineAction::Terminate).1);
}

#[test]
fn each_level_of_the_fuel_is_reported_once_and_acts_as_its_parameter_says() {
    let burn = |action| {
        let mut plane = Plane::flying();
        plane.rules.navigation.fuel_action = action;
        plane.change(Mode::Hold).unwrap();
        let mut modes = Vec::new();
        // The gauge swings by a percent.
        for (tick, fuel_pct) in [20.0, 14.5, 15.5, 14.0, 6.5, 7.5, 6.0, 4.0].into_iter().enumerate()
        {
            plane.propulsion = Powerplant { fuel_pct: Some(fuel_pct), ..Powerplant::default() };
            plane.tick();
            if [1, 4, 7].contains(&tick) {
                modes.push(plane.vehicle.mode());
            }
        }
        let reported: Vec<_> = plane
            .events
            .iter()
            .filter_map(|event| match event {
                VehicleEvent::Failsafe { failsafe: Failsafe::Fuel(level), is_there } => {
                    Some((*level, *is_there))
                }
                _ => None,
            })
            .collect();
        let levels = [FuelLevel::Low, FuelLevel::Critical, FuelLevel::Emergency];
        assert_eq!(reported, levels.map(|level| (level, true)));
        modes
    };
    assert_eq!(burn(FuelAction::Report), [Mode::Hold; 3]);
    assert_eq!(burn(FuelAction::Return), [Mode::Hold, Mode::Return, Mode::Return]);
    assert_eq!(burn(FuelAction::Land), [Mode::Hold, Mode::Return, Mode::Return]);
}

#[test]
fn without_a_gauge_no_level_is_passed() {
    let mut plane = Plane::flying();
    plane.rules.navigation.fuel_action = FuelAction::Return;
    plane.fly(10.0);
    assert_eq!(plane.events, []);
}
