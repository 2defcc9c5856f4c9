//! Each fault of each sensor shows in its samples, and in no others.

use super::*;
use crate::SensorSettings;
use icd::fault::{SensorKind, Target};

/// The sensors of two flights with the same commands, a healthy one and one with this fault from 0.1 s on.
fn flights(
    sensor: SensorKind,
    kind: FaultKind,
    settings: SensorSettings,
) -> Vec<(Sensors, Sensors)> {
    let mut setup = flat();
    setup.sensors = settings;
    let (mut healthy, mut faulty) = (plant(&setup), plant(&setup));
    let timing = Timing::at(SimTime::from_micros(100_000));
    let target = Target::from(sensor);
    let reply = faulty.request(&FaultRequest::Inject { target, kind, timing });
    assert!(matches!(reply, FaultReply::Scheduled { .. }), "{sensor:?} {kind:?}: {reply:?}");
    let tick = |_| {
        let samples = (healthy.sense(), faulty.sense());
        coast(&mut healthy, 1);
        coast(&mut faulty, 1);
        samples
    };
    (0..400).map(tick).collect()
}

/// Values and stamp of one sensor; the date of a fix never changes.
fn of(sensor: SensorKind, sensors: &Sensors) -> (Vec<f64>, Stamp) {
    let all = sensors.to_array();
    let values = sensor.places().filter(|place| Sensors::NAMES[*place] != "decimal_year");
    (values.map(|place| all[place]).collect(), sensors.stamps()[sensor as usize])
}

/// The sensors of a flight without a ground.
const SENSORS: [SensorKind; 9] = {
    let mut sensors = [SensorKind::Gyro; 9];
    let mut place = 0;
    while place < sensors.len() {
        sensors[place] = SensorKind::ALL[place];
        place += 1;
    }
    sensors
};

/// First tick with the fault.
const ONSET: usize = 50;

fn each(kind: FaultKind, check: impl Fn(SensorKind, &[(Sensors, Sensors)])) {
    for sensor in SENSORS {
        let flights = flights(sensor, kind, SensorSettings::IDEAL);
        for (tick, (healthy, faulty)) in flights.iter().enumerate() {
            for other in SENSORS {
                let same = of(other, healthy) == of(other, faulty);
                assert!(
                    same || (other == sensor && tick >= ONSET),
                    "{sensor:?}: {other:?}, {tick}"
                );
            }
        }
        check(sensor, &flights);
    }
}

#[test]
fn a_sensor_that_is_off_has_invalid_samples_with_its_last_value() {
    each(FaultKind::Off, |sensor, flights| {
        let last = of(sensor, &flights[ONSET - 1].0);
        for (_, faulty) in &flights[ONSET..] {
            let (values, stamp) = of(sensor, faulty);
            assert_eq!((&values, stamp.valid, stamp.time), (&last.0, false, last.1.time));
        }
    });
}

#[test]
fn a_stuck_sensor_repeats_its_value_with_new_times() {
    each(FaultKind::StuckHere, |sensor, flights| {
        let (last, _) = of(sensor, &flights[ONSET - 1].0);
        for (healthy, faulty) in &flights[ONSET..] {
            let (values, stamp) = of(sensor, faulty);
            assert_eq!((&values, stamp), (&last, healthy.stamps()[sensor as usize]));
        }
    });
}

#[test]
fn a_bias_and_a_drift_change_the_value_by_their_size() {
    let change = |sensor: SensorKind, (healthy, faulty): &(Sensors, Sensors)| match sensor {
        SensorKind::Attitude => {
            let [a, b] = [healthy, faulty].map(|one| one.attitude.value.q_ned_from_body);
            // Turned about three axes alike.
            2.0 * (a.inverse() * b).imag().norm() / 3.0_f64.sqrt()
        }
        SensorKind::Gnss => faulty.gnss.value.position.0.x - healthy.gnss.value.position.0.x,
        _ => of(sensor, faulty).0[0] - of(sensor, healthy).0[0],
    };
    let size = 1.0e-3;
    each(FaultKind::Biased { bias: size }, |sensor, flights| {
        let ours = change(sensor, &flights[200]);
        assert!((ours / size - 1.0).abs() < 1.0e-6, "{sensor:?}: {ours}");
    });
    each(FaultKind::Drifting { rate: size }, |sensor, flights| {
        let (ours, expected) = (change(sensor, &flights[ONSET + 250]), size * 0.5);
        assert!((ours / expected - 1.0).abs() < 1.0e-3, "{sensor:?}: {ours}");
    });
}

#[test]
fn a_position_that_is_off_is_off_in_every_form_and_an_altitude_with_its_pressure() {
    let (healthy, faulty) =
        flights(SensorKind::Gnss, FaultKind::Biased { bias: 100.0 }, SensorSettings::IDEAL)[100];
    let (a, b) = (healthy.gnss.value, faulty.gnss.value);
    assert!(((b.latitude_rad - a.latitude_rad) * 6.371e6 - 100.0).abs() < 0.1);
    assert!((b.altitude_m - a.altitude_m + 100.0).abs() < 1.0e-9 && a.velocity == b.velocity);
    let kind = FaultKind::Biased { bias: 1_000.0 };
    let (healthy, faulty) = flights(SensorKind::Barometer, kind, SensorSettings::IDEAL)[100];
    // 1000 Pa at 5000 m: ρ g is 7.22 Pa/m.
    let change = faulty.barometer.value.altitude_m - healthy.barometer.value.altitude_m;
    assert!((change / -137.5 - 1.0).abs() < 0.01, "{change} m");
    let kind = FaultKind::Biased { bias: -2_000.0 };
    let (healthy, faulty) = flights(SensorKind::Pitot, kind, SensorSettings::IDEAL)[100];
    let change = faulty.pitot.value.airspeed_m_s - healthy.pitot.value.airspeed_m_s;
    assert!(change < -5.0 && change > -15.0, "{change} m/s");
}

#[test]
fn noise_has_its_size_and_is_white() {
    let rms = 1.0e-3;
    each(FaultKind::Noisy { rms }, |sensor, flights| {
        if sensor == SensorKind::Attitude {
            return;
        }
        let place = if sensor == SensorKind::Gnss { 3 } else { 0 };
        let noise = |(healthy, faulty): &(Sensors, Sensors)| {
            of(sensor, faulty).0[place] - of(sensor, healthy).0[place]
        };
        let all: Vec<f64> = flights[ONSET..].iter().map(noise).collect();
        let n = all.len() as f64;
        let ours = (all.iter().map(|x| x * x).sum::<f64>() / n).sqrt();
        let lag = all.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / n / (rms * rms);
        // 350 numbers: 3.8 % and 0.053, four times that.
        assert!((ours / rms - 1.0).abs() < 0.16 && lag.abs() < 0.22, "{sensor:?}: {ours}, {lag}");
    });
}

#[test]
fn a_delayed_sensor_waits_and_then_follows() {
    each(FaultKind::Delayed { delay_s: 0.2 }, |sensor, flights| {
        for tick in ONSET..flights.len() {
            let shown = if tick < ONSET + 100 { ONSET - 1 } else { tick - 100 };
            let (expected, ours) = (of(sensor, &flights[shown].0), of(sensor, &flights[tick].1));
            assert_eq!(ours, expected, "{sensor:?}: tick {tick}");
        }
    });
}

#[test]
fn an_intermittent_sensor_is_off_in_each_gap() {
    each(FaultKind::Intermittent { period_s: 0.1, present: 0.6 }, |sensor, flights| {
        for (tick, (_, faulty)) in flights.iter().enumerate().skip(ONSET) {
            let is_gap = (tick - ONSET) % 50 < 20;
            assert_eq!(of(sensor, faulty).1.valid, !is_gap, "{sensor:?}: tick {tick}");
        }
    });
}

#[test]
fn another_sensor_or_its_fault_changes_no_random_number_of_the_others() {
    let tactical = tactical();
    let noisy = |sensor| flights(sensor, FaultKind::Noisy { rms: 0.01 }, tactical);
    for (healthy, faulty) in noisy(SensorKind::Barometer) {
        for other in SENSORS {
            assert!(other == SensorKind::Barometer || of(other, &healthy) == of(other, &faulty));
        }
    }
}

#[test]
fn real_sensors_have_their_rates_and_delays_and_no_attitude_unit() {
    let settings = tactical();
    let mut setup = flat();
    setup.sensors = settings;
    let mut plant = plant(&setup);
    for tick in 0..500_u64 {
        let (truth, sensors) = (*plant.truth(), plant.sense());
        assert!(!sensors.attitude.valid && sensors.gnss.valid && sensors.gyro.valid);
        assert_eq!(sensors.gyro.time, truth.time);
        // 10 Hz, 120 ms late; 50 Hz, 10 ms late.
        let gnss = tick.saturating_sub(60) / 50 * 50;
        assert_eq!(sensors.gnss.time, SimTime::from_micros(2_000 * gnss), "tick {tick}");
        let vanes = tick.saturating_sub(5) / 10 * 10;
        assert_eq!(sensors.vanes.time, SimTime::from_micros(2_000 * vanes), "tick {tick}");
        let error = sensors.gyro.value.0 - truth.body_rates.0;
        assert!(error.norm() > 0.0 && error.norm() < 0.01, "{error}");
        let altitude_error = sensors.barometer.value.altitude_m - truth.altitude_m;
        assert!(altitude_error.abs() < 30.0, "{altitude_error} m");
        let speed_error = sensors.pitot.value.airspeed_m_s - truth.airspeed_m_s;
        assert!(speed_error.abs() < 3.0, "{speed_error} m/s");
        coast(&mut plant, 1);
    }
}
