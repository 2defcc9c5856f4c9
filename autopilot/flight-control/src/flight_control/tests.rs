use super::*;
use crate::gains::CompensatorMode;
use crate::navigation::Navigator;
use crate::testing;
use icd::{Sensors, SimTime, tvc_jet};
use nalgebra::Vector3;

fn flight(change: impl FnOnce(&mut Gains)) -> FlightControl {
    let mut gains = Gains::REFERENCE;
    change(&mut gains);
    FlightControl::new(ControlPeriod::DEFAULT, &testing::aircraft_model(), &gains)
}

/// Level flight whose roll rate grows as if something rolled the aircraft with 2 rad/s².
fn rolled(tick: u32) -> NavigationState {
    let p = 2.0 * 0.002 * f64::from(tick);
    NavigationState { rates: Vector3::new(p, 0.0, 0.0), ..testing::level_state() }
}

#[test]
fn level_flight_leaves_the_compensator_exactly_at_zero() {
    let mut flight = flight(|_| {});
    for _ in 0..2000 {
        let out = flight.step(&testing::level_state(), &testing::level_demand());
        assert!(!out.compensator_active);
        assert_eq!(out.compensation, Compensation::NONE);
        assert_eq!(out.actuators().commands[tvc_jet::NOZZLE_PITCH], 0.0);
    }
}

#[test]
fn an_unexplained_roll_wakes_the_compensator_with_positive_aileron() {
    let mut flight = flight(|_| {});
    let mut log = flight.step(&rolled(0), &testing::level_demand());
    for tick in 1..60 {
        log = flight.step(&rolled(tick), &testing::level_demand());
    }
    assert!(log.compensator_active && log.z2.x > 0.7, "z2 {} rad/s2", log.z2.x);
    assert!(log.compensation.aileron_rad > 0.0);
}

/// Compensates the estimated roll acceleration by its own rule, or by one that no effector can follow.
struct OwnCompensator(f64);

impl Law for OwnCompensator {
    fn step(&mut self, _input: &LawInput<'_>) -> MainCommand {
        MainCommand { aileron_rad: f64::NAN, ..MainCommand::default() }
    }

    fn compensate(
        &mut self,
        input: &LawInput<'_>,
        _main: &MainCommand,
        z2: &Vector3<f64>,
    ) -> Compensation {
        assert_eq!(input.h, 0.002);
        Compensation { aileron_rad: self.0 * z2.x, nozzle_yaw_rad: 0.01, ..Compensation::NONE }
    }
}

#[test]
fn a_compensator_of_the_program_acts_when_the_detector_wakes_it_and_its_nonsense_does_not() {
    for gain in [0.05, f64::NAN, f64::INFINITY, 1.0e300] {
        let mut flight = flight(|gains| gains.selection.allocation = AllocationMode::Own);
        let mut own = OwnCompensator(gain);
        for tick in 0..100 {
            let log = flight.step_with(
                &rolled(tick),
                &testing::level_demand(),
                &GroundDemand::STAND,
                Some(&mut own),
            );
            let expected = match gain == 0.05 && log.fade > 0.0 {
                true => log.fade * (0.05 * log.z2.x),
                false => 0.0,
            };
            assert_eq!(log.compensation.aileron_rad, expected, "tick {tick}, gain {gain}");
            assert!(!log.health.implausible_command, "the PID flies");
            assert!(log.fade == 1.0 || tick < 60);
        }
    }
    // Without a law Eq. (25) stands in.
    let mut flights = [AllocationMode::Own, AllocationMode::Paper]
        .map(|a| flight(|g| g.selection.allocation = a));
    for tick in 0..100 {
        let [own, paper] =
            flights.each_mut().map(|f| f.step(&rolled(tick), &testing::level_demand()));
        assert_eq!(own, paper);
    }
}

#[test]
fn switched_off_it_sees_the_same_and_does_nothing() {
    let mut flight = flight(|gains| gains.selection.compensator = CompensatorMode::Off);
    let mut log = flight.step(&rolled(0), &testing::level_demand());
    for tick in 1..60 {
        log = flight.step(&rolled(tick), &testing::level_demand());
    }
    assert!(log.compensator_active);
    assert_eq!(log.compensation, Compensation::NONE);
}

#[test]
fn sensors_that_cannot_be_never_reach_the_commands_and_leave_no_trace() {
    let mut flight = flight(|gains| gains.selection.compensator = CompensatorMode::AlwaysOn);
    let mut navigator = Navigator::default();
    let mut step = |sensors: &Sensors| {
        let state = navigator.step(SimTime::ZERO, sensors);
        flight.step(&state, &testing::level_demand())
    };
    step(&testing::level_sensors());
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.0e308, -1.0e308, 1.0e60, 1.0e6] {
        for index in 0..Sensors::COUNT {
            let mut values = testing::level_sensors().to_array();
            values[index] = bad;
            let out = step(&Sensors::at(SimTime::ZERO, &values));
            // A position of a thousand kilometres can be; the magnetometer is not used, and those of ground and tank decide nothing here.
            let of_ground = ["height_above_ground_m", "weight_on_wheels_n", "fuel_pct"];
            let name = Sensors::NAMES[index];
            let unused = name.starts_with("magnetic_field") || of_ground.contains(&name);
            let flagged = out.health.implausible_input || bad == 1.0e6 || unused;
            assert!(flagged, "{} = {bad}", Sensors::NAMES[index]);
            for (effector, command) in out.actuators().commands.iter() {
                assert!(
                    command.is_finite(),
                    "{effector:?} after {} = {bad}",
                    Sensors::NAMES[index]
                );
            }
        }
    }
    let log = step(&testing::level_sensors());
    assert!(log.z2.iter().all(|z2| z2.is_finite()), "{}", log.z2);
}

#[test]
fn a_reset_flight_control_flies_like_a_new_one() {
    let mut used = flight(|_| {});
    for tick in 0..100 {
        used.step(&rolled(tick), &testing::level_demand());
    }
    used.reset();
    let mut fresh = flight(|_| {});
    for tick in 0..100 {
        let demand = testing::level_demand();
        assert_eq!(used.step(&rolled(tick), &demand), fresh.step(&rolled(tick), &demand));
    }
}

#[test]
fn the_literal_observer_does_not_know_the_compensation() {
    let mut informed = flight(|_| {});
    let mut literal = flight(|gains| gains.selection.observer = ObserverMode::Literal);
    let (mut a, mut b) = (None, None);
    for tick in 0..200 {
        a = Some(informed.step(&rolled(tick), &testing::level_demand()));
        b = Some(literal.step(&rolled(tick), &testing::level_demand()));
    }
    let (a, b) = (a.unwrap(), b.unwrap());
    assert!(a.compensator_active && b.compensator_active);
    // The aileron pushes against the roll that goes on all the same, so the informed observer sees more.
    assert!(a.z2.x > b.z2.x + 0.3, "informed {} literal {} rad/s2", a.z2.x, b.z2.x);
}
