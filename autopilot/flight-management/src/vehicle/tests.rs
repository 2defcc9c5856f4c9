use super::*;
use crate::configuration;
use crate::parameters::Parameters;
use flight_control::navigation::Validity;

mod failsafes;
mod fences;
mod ground;
mod loops;
mod modes;
mod plane;
mod plans;
mod position;

fn level(time: SimTime) -> NavigationState {
    let level = NavigationState { altitude_m: 5_000.0, ..NavigationState::at_rest() };
    NavigationState { time, airspeed_m_s: 264.0, valid: Validity::COMPLETE, ..level }
}

fn seconds(s: f64) -> SimTime {
    SimTime::from_seconds(s).unwrap()
}

fn rules() -> Rules {
    let Parameters { limits, navigation, gains, .. } = Parameters::default();
    Rules::new(limits, navigation, &gains)
}

fn track(vehicle: &mut Vehicle, time: SimTime) -> Demand {
    vehicle.track(&level(time), &rules(), &Powerplant::default(), &mut |_| {})
}

fn change(vehicle: &mut Vehicle, mode: Mode) {
    vehicle.change_mode(mode, &rules(), &mut |_| {}).unwrap();
}

#[test]
fn without_any_word_it_keeps_what_it_has() {
    let mut vehicle = Vehicle::new(ReferenceSchedule::default());
    let demand = track(&mut vehicle, SimTime::ZERO);
    assert_eq!(demand, Demand { altitude_m: 5_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 });
}

#[test]
fn before_anything_is_known_it_asks_for_nothing_and_then_for_what_it_finds() {
    let text = "[[autopilot.reference]]\nat_s = 0.0\nairspeed_m_s = 250.0\n";
    let mut vehicle = Vehicle::new(configuration::references("s.toml", text).unwrap());
    let mut track = |state: &NavigationState| {
        vehicle.track(state, &rules(), &Powerplant::default(), &mut |_| {})
    };
    let nothing = Demand { altitude_m: 0.0, roll_rad: 0.0, airspeed_m_s: 0.0 };
    assert_eq!(track(&NavigationState::at_rest()), nothing);
    // The references of the schedule are not lost.
    let found = Demand { altitude_m: 5_000.0, roll_rad: 0.0, airspeed_m_s: 250.0 };
    assert_eq!(track(&level(seconds(0.1))), found);
}

#[test]
fn scheduled_references_act_at_their_tick_and_an_autopilot_that_joins_late_has_them_too() {
    let text = "[[autopilot.reference]]\nat_s = 0.0\nroll_deg = 0.0\n\
                [[autopilot.reference]]\nat_s = 1.0\naltitude_m = 6000.0\n\
                [[autopilot.reference]]\nat_s = 2.0\nroll_deg = 15.0\n";
    let schedule = configuration::references("s.toml", text).unwrap();
    let mut vehicle = Vehicle::new(schedule.clone());
    assert_eq!(track(&mut vehicle, seconds(0.998)).altitude_m, 5_000.0);
    assert_eq!(track(&mut vehicle, seconds(1.0)).altitude_m, 6_000.0);
    let late = track(&mut Vehicle::new(schedule), seconds(3.0));
    assert_eq!((late.altitude_m, late.roll_rad), (6_000.0, 15.0_f64.to_radians()));
}

#[test]
fn a_roll_reference_needs_position_or_offboard() {
    let mut vehicle = Vehicle::new(ReferenceSchedule::default());
    track(&mut vehicle, SimTime::ZERO);
    let roll = Reference::Roll(0.2);
    for mode in [Mode::Position, Mode::Offboard] {
        change(&mut vehicle, mode);
        assert_eq!(vehicle.refer(roll, &rules()), Ok(()));
        assert_eq!(track(&mut vehicle, seconds(1.0)).roll_rad, 0.2);
    }
    for mode in [Mode::Hold, Mode::Return, Mode::Altitude] {
        change(&mut vehicle, mode);
        assert_eq!(vehicle.refer(roll, &rules()), Err(VehicleRefusal::NoRollHere), "{mode}");
    }
}

#[test]
fn references_outside_the_limits_or_not_finite_change_nothing() {
    let mut vehicle = Vehicle::new(ReferenceSchedule::default());
    track(&mut vehicle, SimTime::ZERO);
    change(&mut vehicle, Mode::Offboard);
    let before = vehicle.demand().copied();
    for bad in [f64::NAN, f64::INFINITY, 1.0e6, -1.0e6] {
        for reference in [Reference::Altitude(bad), Reference::Airspeed(bad), Reference::Roll(bad)]
        {
            assert!(vehicle.refer(reference, &rules()).is_err(), "{reference:?}");
        }
    }
    assert_eq!(vehicle.demand().copied(), before);
}
