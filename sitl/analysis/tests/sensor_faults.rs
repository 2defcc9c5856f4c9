//! Every fault of every sensor in closed loop on estimated states, with tactical sensors; docs/sensors.md has the table.

use flight_analysis::configuration::AircraftArgs;
use flight_analysis::estimator::flights;
use flight_analysis::sensor_faults::{Options, SENSORS, fly_without, kinds, losses, study};
use flight_analysis::study::StudyOptions;
use flight_control::CompensatorMode;
use flight_control::estimator_status::SourceHealth;
use icd::fault::FaultKind;
use icd::sensors::SensorKind;
use plant_sim::GradeName;

/// Seeds that chose no number of the estimator.
const SEED: u64 = 70_001;

/// Straight flights and turns, in still air and in turbulence, for 600 s without a pitot tube.
#[test]
fn without_a_pitot_tube_the_airspeed_stays_that_of_ground_speed_and_the_last_wind() {
    for airframe in [None, Some("f16")] {
        let aircraft =
            AircraftArgs { airframe: airframe.map(Into::into), ..AircraftArgs::default() };
        let grade = GradeName::Tactical;
        let options = Options {
            study: StudyOptions::of(aircraft),
            grade,
            sensors: Vec::new(),
            flights: 4,
            seed: SEED,
        };
        let rows =
            losses(&options, &options.sides().expect("an aircraft"), &[Some(SensorKind::Pitot)])
                .expect("the flights begin");
        assert_eq!(rows.len(), 6);
        for (_, turbulence_m_s, turns, flights) in &rows {
            let what = format!("{airframe:?} {turbulence_m_s} m/s, turns {turns}: {flights:?}");
            let mean =
                |place: usize| flights.iter().map(|flown| flown.airspeed[place]).sum::<f64>() / 4.0;
            let [error, stated] = [mean(0).sqrt(), mean(1).sqrt()];
            assert!(flights.iter().all(|flown| flown.lost_at_s.is_none()), "{what}");
            assert!(flights.iter().all(|flown| flown.largest[1] < 100.0), "altitude, {what}");
            assert!(flights.iter().all(|flown| flown.reported == SourceHealth::Lost), "{what}");
            // Gusts along the flight, which nothing shows any more, and what the wind was not known by before.
            assert!(error < 1.0 + 1.2 * turbulence_m_s, "{error} m/s, {what}");
            assert!(stated > error && stated < 1.5 + 1.5 * turbulence_m_s, "{stated} m/s, {what}");
            let nees = flights.iter().map(|flown| flown.wind_nees).sum::<f64>() / 4.0;
            assert!(nees < 6.0, "{nees}, {what}");
        }
    }
}

/// It flies at 25 m/s: gusts turn the flow by 20 deg, and errors that last are large against what the sensors show.
#[test]
fn an_aerosonde_is_kept_in_3_m_s_with_and_without_a_pitot_tube() {
    let aircraft = AircraftArgs { airframe: Some("aerosonde".into()), ..AircraftArgs::default() };
    for grade in [GradeName::Tactical, GradeName::Consumer] {
        let options = Options {
            study: StudyOptions::of(aircraft.clone()),
            grade,
            sensors: Vec::new(),
            flights: 4,
            seed: 1,
        };
        let rows = losses(
            &options,
            &options.sides().expect("an aircraft"),
            &[None, Some(SensorKind::Pitot)],
        )
        .expect("the flights begin");
        for (sensor, turbulence_m_s, turns, flights) in &rows {
            let what = format!(
                "{} {sensor:?} {turbulence_m_s} m/s, turns {turns}: {flights:?}",
                grade.key()
            );
            assert!(flights.iter().all(|flown| flown.lost_at_s.is_none()), "{what}");
            let mean =
                |place: usize| flights.iter().map(|flown| flown.airspeed[place]).sum::<f64>() / 4.0;
            let [error, stated] = [mean(0).sqrt(), mean(1).sqrt()];
            assert!(error < 2.5, "{error} m/s, {what}");
            // What the pitot tube is wrong by is known too well in straight flight: docs/estimator.md.
            if sensor.is_some() {
                assert!(stated > 0.75 * error && stated < 3.0 * error, "{stated} m/s, {what}");
            }
        }
    }
}

/// Wind and gusts follow a drift of 0.1 m/s² unseen; lift does not.
#[test]
fn a_slow_drift_of_the_pitot_tube_is_found_by_the_lift() {
    let aircraft = AircraftArgs { airframe: Some("aerosonde".into()), ..AircraftArgs::default() };
    let study = StudyOptions::of(aircraft);
    let sides = flights::sides(&study, CompensatorMode::Armed, &[]).expect("the aircraft is there");
    for rate in [3.0, -3.0] {
        let fault = Some((SensorKind::Pitot, FaultKind::Drifting { rate }));
        let flown = fly_without(&sides, GradeName::Tactical, 1.5, false, fault, SEED)
            .expect("the flight begins");
        assert_eq!(flown.lost_at_s, None, "{rate} Pa/s: {flown:?}");
        assert_eq!(flown.reported, SourceHealth::Rejected, "{rate} Pa/s: {flown:?}");
        assert!(flown.largest[0] < 3.0 + 3.0 * 1.5, "{rate} Pa/s: {flown:?}");
    }
}

#[test]
fn each_fault_of_each_sensor_has_the_outcome_of_the_document() {
    let aircraft = AircraftArgs::default();
    let options = Options {
        study: StudyOptions::of(aircraft),
        grade: GradeName::Tactical,
        sensors: Vec::new(),
        flights: 4,
        seed: 1,
    };
    let rows = study(&options, &options.sides().expect("an aircraft")).expect("the flights begin");
    assert_eq!(rows.len(), 1 + SENSORS.len() * kinds(SensorKind::Gyro).len());
    let (_, healthy) = rows[0];
    assert_eq!((healthy.lost_at_s, healthy.active), (None, 0.0));
    for (fault, flown) in &rows[1..] {
        let (sensor, kind) = fault.expect("all but the first have one");
        let what = format!("{} {}: {flown:?}", sensor.name(), kind.info().key);
        // Nothing stands in for rates; a slow error of the vanes is taken for sideslip.
        let is_lost = match sensor {
            SensorKind::Gyro => matches!(
                kind,
                FaultKind::Off
                    | FaultKind::StuckHere
                    | FaultKind::Delayed { .. }
                    | FaultKind::Intermittent { .. }
            ),
            SensorKind::Vanes => matches!(kind, FaultKind::Drifting { .. }),
            _ => false,
        };
        assert_eq!(flown.lost_at_s.is_some(), is_lost, "{what}");
        if is_lost {
            continue;
        }
        let [attitude, airspeed, altitude] = flown.errors_after;
        assert!(attitude < 7.0 && airspeed < 3.0 && altitude < 3.0, "after the repair, {what}");
        // The estimator reads all but the engine monitor, and sees what is not there or does not change.
        let expected = match kind {
            _ if sensor == SensorKind::EngineMonitor => SourceHealth::Unused,
            FaultKind::Off | FaultKind::Intermittent { .. } => SourceHealth::Lost,
            FaultKind::StuckHere => SourceHealth::Stuck,
            _ => continue,
        };
        assert_eq!(flown.reported, expected, "{what}");
    }
    // Faults that the estimator cannot see are felt.
    let felt = |sensor: SensorKind, place: usize, least: f64| {
        let of_sensor = rows.iter().filter(|(fault, _)| fault.is_some_and(|f| f.0 == sensor));
        let worst = of_sensor.map(|(_, flown)| flown.errors[place]).fold(0.0, f64::max);
        assert!(worst > healthy.errors[place] + least, "{}: {worst}", sensor.name());
    };
    felt(SensorKind::Gyro, 0, 10.0);
    felt(SensorKind::Accelerometer, 0, 10.0);
    felt(SensorKind::Gnss, 2, 100.0);
    felt(SensorKind::Barometer, 1, 5.0);
    felt(SensorKind::Pitot, 1, 10.0);
    felt(SensorKind::Magnetometer, 0, 0.1);
    // A wrong sideslip looks like a fault of an effector, also where the aircraft is kept.
    let of_vanes = rows.iter().filter(|(fault, flown)| {
        fault.is_some_and(|f| f.0 == SensorKind::Vanes) && flown.lost_at_s.is_none()
    });
    let awake = of_vanes.map(|(_, flown)| flown.active).fold(0.0, f64::max);
    assert!(awake > 0.4, "the compensator is active for {awake} of the flight");
}
