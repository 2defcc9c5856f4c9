//! The estimator on synthetic sensors: a flight with turns, climbs and wind, whose sensors have errors.

use super::*;
use crate::navigation::NavigationState;
use crate::testing;
use flight::{Flight, Grade};
use icd::Attitude;
use std::vec::Vec;

mod flight;

/// Flies an estimator for so many seconds; `spoil` may change the samples of a tick.
fn fly(
    flight: &mut Flight,
    estimator: &mut Estimator,
    seconds: f64,
    mut spoil: impl FnMut(f64, &mut Sensors),
    mut look: impl FnMut(&Flight, &Estimator, &NavigationState),
) {
    let until = flight.seconds() + seconds;
    while flight.seconds() < until - 1.0e-9 {
        let mut sensors = flight.sense();
        spoil(flight.seconds(), &mut sensors);
        let state = estimator.step(flight.time(), &sensors);
        look(flight, estimator, &state);
        flight.advance();
    }
}

fn estimator() -> Estimator {
    Estimator::new(&testing::aircraft_model(), &EstimatorGains::REFERENCE, EarthShape::Wgs84)
}

fn attitude_error_deg(flight: &Flight, state: &NavigationState) -> f64 {
    let truth: Attitude = flight.attitude();
    truth.q_ned_from_body.angle_to(&state.orientation.q_ned_from_body).to_degrees()
}

/// Root mean squares of attitude, deg, velocity, m/s, and position, m, after the first 20 s.
fn errors(flight: &mut Flight, estimator: &mut Estimator, seconds: f64) -> [f64; 3] {
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    fly(
        flight,
        estimator,
        seconds,
        |_, _| (),
        |flight, _, state| {
            if flight.seconds() > 20.0 {
                let attitude = attitude_error_deg(flight, state);
                sums[0] += attitude * attitude;
                sums[1] += (state.velocity.0 - flight.velocity().0).norm_squared();
                sums[2] += (state.position.0 - flight.position()).norm_squared();
                count += 1.0;
            }
        },
    );
    sums.map(|sum| libm::sqrt(sum / count))
}

#[test]
fn exact_sensors_give_the_exact_state() {
    let (mut flight, mut estimator) = (Flight::new(Grade::Exact, 1), estimator());
    let [attitude, velocity, position] = errors(&mut flight, &mut estimator, 60.0);
    // What the integration with 2 ms leaves, and wind that is a state with noise; a fifth of what tactical sensors give.
    assert!(attitude < 0.03, "{attitude} deg");
    assert!(velocity < 0.01, "{velocity} m/s");
    assert!(position < 0.05, "{position} m");
}

#[test]
fn tactical_sensors_give_a_state_as_good_as_the_covariance_says() {
    let mut sums = [0.0; 4];
    let mut count = 0.0;
    for seed in 1..=8 {
        let (mut flight, mut estimator) = (Flight::new(Grade::Tactical, seed), estimator());
        let [attitude, velocity, position] = errors(&mut flight, &mut estimator, 60.0);
        assert!(attitude < 0.6, "seed {seed}: {attitude} deg");
        assert!(velocity < 0.08, "seed {seed}: {velocity} m/s");
        assert!(position < 4.0, "seed {seed}: {position} m");
        let status = estimator.status(flight.time());
        assert_eq!((status.realigned, status.late), (0, 0), "seed {seed}");
        // The levels of the detector grow with these: no less than the bias of the vanes is known to, and far from a degree.
        assert!(status.flow_rad.iter().all(|rad| (3.0e-4..1.0e-2).contains(rad)), "{status:?}");
        fly(
            &mut flight,
            &mut estimator,
            20.0,
            |_, _| (),
            |flight, estimator, state| {
                if flight.tick().is_multiple_of(250) {
                    for (sum, value) in sums.iter_mut().zip(flight.nees(estimator, state)) {
                        *sum += value;
                    }
                    count += 1.0;
                }
            },
        );
    }
    let mean: Vec<f64> = sums.iter().map(|sum| sum / count).collect();
    std::println!("normalised squares of attitude, velocity, gyro bias, wind: {mean:.2?}");
    for (value, name) in mean.iter().zip(["attitude", "velocity", "gyro bias", "wind"]) {
        // Three for a consistent filter. Eight flights that are correlated in time: a factor of three.
        assert!(*value < 9.0, "{name}: {value}");
    }
}

#[test]
fn each_sensor_may_go_away_and_come_back() {
    type Spoil = fn(&mut Sensors);
    let away: [(SensorKind, Spoil); 7] = [
        (SensorKind::Gyro, |s| s.gyro.valid = false),
        (SensorKind::Accelerometer, |s| s.accelerometer.valid = false),
        (SensorKind::Gnss, |s| s.gnss.valid = false),
        (SensorKind::Barometer, |s| s.barometer.valid = false),
        (SensorKind::Pitot, |s| s.pitot.valid = false),
        (SensorKind::Vanes, |s| s.vanes.valid = false),
        (SensorKind::Magnetometer, |s| s.magnetometer_nt.valid = false),
    ];
    for (sensor, spoil) in away {
        let (mut flight, mut estimator) = (Flight::new(Grade::Tactical, 3), estimator());
        let mut lost = false;
        let spoil_then = |at: f64, sensors: &mut Sensors| {
            if (20.0..25.0).contains(&at) {
                spoil(sensors);
            }
        };
        fly(&mut flight, &mut estimator, 60.0, spoil_then, |flight, _, state| {
            let status = state.estimate.unwrap();
            lost |= status.source(sensor) == SourceHealth::Lost;
            if flight.seconds() > 45.0 {
                assert_eq!(status.source(sensor), SourceHealth::Used, "{sensor:?}");
                let error = attitude_error_deg(flight, state);
                assert!(error < 1.5, "{sensor:?} at {}: {error} deg", flight.seconds());
                let error = (state.position.0 - flight.position()).norm();
                assert!(error < 12.0, "{sensor:?} at {}: {error} m", flight.seconds());
                assert!(state.valid.is_complete(), "{sensor:?} {:?}", state.valid);
            }
        });
        assert!(lost, "{sensor:?}");
    }
}

#[test]
fn garbage_of_any_sensor_leaves_a_finite_state() {
    for bad in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1.0e300, -1.0e6, 0.0] {
        let (mut flight, mut estimator) = (Flight::new(Grade::Tactical, 5), estimator());
        let mut sensor = 0;
        let spoil = |_: f64, sensors: &mut Sensors| {
            // Another number of the samples in each tick.
            let mut values = sensors.to_array();
            values[sensor % Sensors::COUNT] = bad;
            sensor += 7;
            *sensors = Sensors::new(&sensors.stamps(), &values);
        };
        fly(&mut flight, &mut estimator, 10.0, spoil, |_, _, state| assert_finite(state));
        let all = |_: f64, sensors: &mut Sensors| {
            *sensors = Sensors::new(&sensors.stamps(), &[bad; Sensors::COUNT]);
        };
        fly(&mut flight, &mut estimator, 2.0, all, |_, _, state| assert_finite(state));
        // Good samples again.
        fly(&mut flight, &mut estimator, 30.0, |_, _| (), |_, _, state| assert_finite(state));
        let sensors = flight.sense();
        let state = estimator.step(flight.time(), &sensors);
        let error = attitude_error_deg(&flight, &state);
        assert!(error < 3.0, "{bad}: {error} deg");
        assert!(state.valid.is_complete(), "{bad}: {state:?}");
    }
}

fn assert_finite(state: &NavigationState) {
    let vectors = [&state.rates, &state.specific_force.0, &state.velocity.0, &state.position.0];
    assert!(vectors.iter().all(|v| v.iter().all(|x| x.is_finite())), "{state:?}");
    let numbers = [
        state.attitude.phi,
        state.attitude.theta,
        state.attitude.psi,
        state.latitude_rad,
        state.longitude_rad,
        state.altitude_m,
        state.airspeed_m_s,
        state.alpha,
        state.beta,
        state.thrust_n,
    ];
    assert!(numbers.iter().all(|x| x.is_finite()), "{state:?}");
}

#[test]
fn a_jump_of_the_receiver_is_rejected_and_believed_only_when_it_lasts() {
    let (mut flight, mut estimator) = (Flight::new(Grade::Tactical, 7), estimator());
    fly(&mut flight, &mut estimator, 20.0, |_, _| (), |_, _, _| ());
    let jump = |_: f64, sensors: &mut Sensors| sensors.gnss.value.position.0.x += 500.0;
    fly(&mut flight, &mut estimator, 2.0, jump, |flight, _, state| {
        assert!((state.position.0 - flight.position()).norm() < 10.0);
    });
    let status = estimator.status(flight.time());
    assert_eq!(status.source(SensorKind::Gnss), SourceHealth::Rejected);
    assert!(status.horizontal_ratio > 1.0);
    fly(&mut flight, &mut estimator, 3.0, jump, |_, _, _| ());
    let state = estimator.state();
    assert!((state.position.0.x - flight.position().x - 500.0).abs() < 10.0);
    assert_eq!(estimator.status(flight.time()).source(SensorKind::Gnss), SourceHealth::Used);
}

#[test]
fn stuck_vanes_are_left_out() {
    let (mut flight, mut estimator) = (Flight::new(Grade::Tactical, 9), estimator());
    let mut held = None;
    let stick = |at: f64, sensors: &mut Sensors| {
        if at >= 20.0 {
            sensors.vanes.value = *held.get_or_insert(sensors.vanes.value);
        }
    };
    fly(&mut flight, &mut estimator, 40.0, stick, |flight, _, state| {
        if flight.seconds() > 22.0 {
            let status = state.estimate.unwrap();
            assert_eq!(status.source(SensorKind::Vanes), SourceHealth::Stuck);
        }
    });
    // The flight on paper turns at one angle of attack, which no wing does, so the design model is wrong about the air; the
    // attitude does not suffer.
    let error = attitude_error_deg(&flight, &estimator.state());
    assert!(error < 1.5, "{error} deg");
}

#[test]
fn a_fix_that_is_older_than_the_memory_is_counted_and_not_used() {
    let (mut flight, mut estimator) = (Flight::new(Grade::Tactical, 2), estimator());
    flight.gnss_delay_s = 0.9;
    fly(&mut flight, &mut estimator, 10.0, |_, _| (), |_, _, _| ());
    let status = estimator.status(flight.time());
    assert!(status.late > 50, "{status:?}");
    assert_eq!(status.source(SensorKind::Gnss), SourceHealth::Late);
}

/// In straight flight a roll error looks like a bias of the accelerometers, whatever the age of the fixes.
#[test]
fn late_fixes_do_not_tell_roll_from_the_bias_of_the_accelerometers() {
    for gnss_delay_s in [0.0, 0.12, 0.4] {
        let (mut flight, mut estimator) = (Flight::new(Grade::Tactical, 1), estimator());
        (flight.gnss_delay_s, flight.turns_from_s) = (gnss_delay_s, 1.0e9);
        fly(&mut flight, &mut estimator, 120.0, |_, _| (), |_, _, _| ());
        let nose = estimator.estimate().matrix().column(0).into_owned();
        let roll = nose.dot(&(estimator.covariance().block(ATTITUDE) * nose)).sqrt();
        let bias = EstimatorGains::REFERENCE.force_bias_m_s2 / 9.806_65;
        assert!(roll > 0.9 * bias, "{gnss_delay_s} s: {roll} rad, by the bias {bias}");
    }
}

/// The lift of a fast aircraft follows the Mach number, which the design model does not have: with vanes the last good wind is better.
#[test]
fn the_lift_of_a_fast_aircraft_replaces_its_vanes_and_not_its_pitot_tube() {
    let wind = |lost: SensorKind, lift_factor: f64| {
        let mut aircraft = testing::aircraft_model();
        aircraft.lift.c_lift_alpha *= lift_factor;
        let gains = EstimatorGains::REFERENCE;
        let mut estimator = Estimator::new(&aircraft, &gains, EarthShape::Wgs84);
        let mut flight = Flight::new(Grade::Tactical, 1);
        let lose = |at_s: f64, sensors: &mut Sensors| {
            sensors.invalidate(|sensor| sensor == lost && at_s >= 20.0);
        };
        fly(&mut flight, &mut estimator, 60.0, lose, |_, _, _| ());
        estimator.estimate().wind
    };
    assert_eq!(wind(SensorKind::Pitot, 1.0), wind(SensorKind::Pitot, 1.3));
    assert_ne!(wind(SensorKind::Vanes, 1.0), wind(SensorKind::Vanes, 1.3));
}

#[test]
fn a_flight_that_is_joined_in_a_turn_aligns() {
    let mut flight = Flight::new(Grade::Tactical, 4);
    while flight.seconds() < 11.0 {
        flight.sense();
        flight.advance();
    }
    assert!(flight.attitude().euler().phi.abs() > 0.3, "in a turn");
    let mut estimator = estimator();
    fly(&mut flight, &mut estimator, 30.0, |_, _| (), |_, _, _| ());
    let error = attitude_error_deg(&flight, &estimator.state());
    assert!(error < 1.5, "{error} deg");
    assert_eq!(estimator.status(flight.time()).realigned, 0);
}

#[test]
fn the_same_samples_give_the_same_bits() {
    let run = || {
        let (mut flight, mut estimator) = (Flight::new(Grade::Tactical, 6), estimator());
        fly(&mut flight, &mut estimator, 5.0, |_, _| (), |_, _, _| ());
        estimator.state()
    };
    assert_eq!(run(), run());
}

#[test]
fn without_magnetometer_and_vanes_the_track_gives_the_heading() {
    let (mut flight, mut estimator) = (Flight::new(Grade::Tactical, 8), estimator());
    let spoil = |_: f64, sensors: &mut Sensors| {
        sensors.magnetometer_nt.valid = false;
        sensors.vanes.valid = false;
    };
    fly(&mut flight, &mut estimator, 60.0, spoil, |_, _, _| ());
    let error = attitude_error_deg(&flight, &estimator.state());
    assert!(error < 2.0, "{error} deg");
}

/// An aircraft that stands for `seconds`, with a fix every 0.2 s.
fn stand(estimator: &mut Estimator, sensors: &mut Sensors, seconds: u64) -> EstimatorStatus {
    let ground = GroundReading { over_ground: true, height_m: Some(0.0), on_wheels: true };
    sensors.gnss.value.velocity = Ned::zero();
    let first = sensors.gyro.time.as_micros() / 2_000;
    for tick in first + 1..=first + 500 * seconds {
        let time = SimTime::from_micros(2_000 * tick);
        (sensors.gyro.time, sensors.accelerometer.time) = (time, time);
        // Samples that never change are of sensors that stick.
        let shaken = if tick.is_multiple_of(2) { 1.0e-6 } else { -1.0e-6 };
        sensors.gyro.value.0.x += shaken;
        sensors.accelerometer.value.0.x += shaken;
        sensors.gnss.value.velocity.0.x += shaken;
        sensors.magnetometer_nt.value.0.x += 1.0e6 * shaken;
        if tick.is_multiple_of(100) {
            (sensors.gnss.time, sensors.magnetometer_nt.time) = (time, time);
        }
        let _ = estimator.step_over(ground, time, sensors);
    }
    estimator.status(estimator.time())
}

/// Stands for so many seconds while the pitot tube shows this impact pressure, Pa; what is then taken for its zero, Pa.
fn stand_with_pitot(estimator: &mut Estimator, sensors: &mut Sensors, s: u64, pa: f64) -> f64 {
    for _ in 0..20 * s {
        sensors.pitot.time = sensors.gyro.time;
        // Noise, so that it does not seem stuck.
        let noise = if sensors.gyro.time.as_micros().is_multiple_of(100_000) { 1.0 } else { -1.0 };
        sensors.pitot.value.impact_pa = pa + noise;
        let ground = GroundReading { over_ground: true, height_m: Some(0.0), on_wheels: true };
        sensors.gnss.value.velocity = Ned::zero();
        for _ in 0..25 {
            let time = SimTime::from_micros(sensors.gyro.time.as_micros() + 2_000);
            (sensors.gyro.time, sensors.accelerometer.time) = (time, time);
            let _ = estimator.step_over(ground, time, sensors);
        }
        (sensors.gnss.time, sensors.magnetometer_nt.time) = (sensors.gyro.time, sensors.gyro.time);
    }
    estimator.pitot_zero.offset_pa
}

#[test]
fn a_pitot_tube_is_set_to_zero_at_rest_whatever_its_error_and_not_by_a_fault() {
    let gains = EstimatorGains::CONSUMER;
    let small_m_s = 10.0;
    for bias_pa in [54.0, -54.0, 110.0, 0.0] {
        let (mut sensors, mut estimator) = (testing::level_sensors(), estimator());
        estimator.set_gains(&gains);
        // An aircraft so slow that a biased tube shows a flow.
        estimator.stall_m_s = small_m_s;
        let _ = stand(&mut estimator, &mut sensors, 1);
        let zero_pa = stand_with_pitot(&mut estimator, &mut sensors, 10, bias_pa);
        assert!((zero_pa - bias_pa).abs() < 0.15 * bias_pa.abs() + 1.0, "{bias_pa}: {zero_pa} Pa");
        assert!(estimator.covariance.is_sound());
        // A tube that fails for a second.
        let _ = stand_with_pitot(&mut estimator, &mut sensors, 1, -20_000.0);
        let zero_pa = stand_with_pitot(&mut estimator, &mut sensors, 30, bias_pa);
        assert!((zero_pa - bias_pa).abs() < 0.2 * bias_pa.abs() + 6.0, "{bias_pa}: {zero_pa} Pa");
    }
}

#[test]
fn on_a_runway_its_heading_aligns_without_a_magnetometer_and_anew_when_it_is_given() {
    let (mut sensors, mut estimator) = (testing::level_sensors(), estimator());
    sensors.magnetometer_nt.valid = false;
    assert!(!stand(&mut estimator, &mut sensors, 1).is_aligned, "nothing shows the heading");
    for heading in [0.7, 2.0] {
        estimator.set_runway(Some(heading));
        let status = stand(&mut estimator, &mut sensors, 1);
        assert!(status.is_aligned && (estimator.state().attitude.psi - heading).abs() < 0.01);
    }
}

#[test]
fn a_heading_of_the_runway_replaces_that_of_the_magnetometer_unless_it_is_another_runway() {
    let (mut sensors, mut estimator) = (testing::level_sensors(), estimator());
    let _ = stand(&mut estimator, &mut sensors, 1);
    let magnetic = estimator.state().attitude.psi;
    for (runway, found) in
        [(Some(0.02), 0.02), (Some(1.0), 0.0), (Some(-0.02), -0.02), (None, 0.0), (Some(3.1), 0.0)]
    {
        estimator.set_runway(runway.map(|runway| magnetic + runway));
        let _ = stand(&mut estimator, &mut sensors, 2);
        let heading = estimator.state().attitude.psi - magnetic;
        assert!((heading - found).abs() < 0.004, "{runway:?}: {heading}");
    }
}

#[test]
fn in_flight_the_heading_is_as_unsure_as_the_gains_say_and_no_runway_gives_it() {
    let begin = |mut estimator: Estimator| {
        let _ = estimator.step(SimTime::ZERO, &Flight::new(Grade::Tactical, 1).sense());
        (estimator.state(), estimator.covariance().variance(ATTITUDE + 2))
    };
    let (state, variance) = begin(estimator());
    let mut on_runway = estimator();
    on_runway.set_runway(Some(1.0));
    assert_eq!(begin(on_runway), (state, variance));
    let least = EstimatorGains::REFERENCE.heading_deg.to_radians();
    assert!(variance > 0.99 * least * least, "{variance}");
}

#[test]
fn at_rest_the_heading_stays_as_unsure_as_the_magnetometer_and_the_gyros_show_their_biases() {
    let gains = EstimatorGains::CONSUMER;
    let mut estimator = Estimator::new(&testing::aircraft_model(), &gains, EarthShape::Wgs84);
    let mut sensors = testing::level_sensors();
    let bias = Body::new(0.001, -0.001, 0.002);
    sensors.gyro.value = bias;
    let unsure_rad = [1, 60].map(|s| stand(&mut estimator, &mut sensors, s).attitude_rad);
    assert!(unsure_rad[0] > 0.05 && unsure_rad[1] > 0.8 * unsure_rad[0], "{unsure_rad:?}");
    let wrong = estimator.estimate().gyro_bias - bias.0;
    // The Earth turns by 7e-5 rad/s.
    assert!(wrong.norm() < 3.0e-4, "{wrong}");
}
