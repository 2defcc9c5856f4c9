use super::*;
use crate::testing;
use icd::tvc_jet;
use std::string::{String, ToString};

/// The test model at an airspeed, at 5000 m, with this stiffness in pitch.
fn point(airspeed_m_s: f64, c_pitch_alpha: f64) -> SchedulePoint {
    let aircraft = testing::aircraft_model();
    SchedulePoint {
        airspeed_m_s,
        altitude_m: 5_000.0,
        trim_thrust_n: 20_000.0,
        thrust_n: [1_000.0, 1_000.0 * airspeed_m_s],
        c_lift: aircraft.effectors.c_lift,
        c_roll: aircraft.effectors.c_roll,
        c_pitch: aircraft.effectors.c_pitch,
        c_yaw: aircraft.effectors.c_yaw,
        airframe: AirframeModel { c_pitch_alpha, ..aircraft.airframe },
        lift: aircraft.lift,
    }
}

fn scheduled() -> AircraftModel {
    let schedule = Schedule::new([point(100.0, -0.1), point(200.0, -0.5), point(300.0, -0.3)]);
    AircraftModel { schedule, ..testing::aircraft_model() }
}

fn at(airspeed_m_s: f64) -> AircraftModel {
    let mut aircraft = scheduled();
    let pressure_pa = point(airspeed_m_s, 0.0).pressure_pa();
    assert!(aircraft.schedule.clone().put(pressure_pa, &mut aircraft));
    aircraft
}

#[test]
fn between_points_coefficients_lie_on_lines_over_the_dynamic_pressure_and_beyond_they_stay() {
    for (airspeed_m_s, expected) in
        [(50.0, -0.1), (100.0, -0.1), (200.0, -0.5), (300.0, -0.3), (400.0, -0.3)]
    {
        let found = at(airspeed_m_s).airframe.c_pitch_alpha;
        assert!((found - expected).abs() < 1.0e-12, "{found} at {airspeed_m_s} m/s");
    }
    // 150 squared is 5/12 of the way from 100 squared to 200 squared.
    let found = at(150.0).airframe.c_pitch_alpha;
    assert!((found - (-0.1 - 0.4 * 5.0 / 12.0)).abs() < 1.0e-12, "{found}");
    assert!((at(300.0).effectors.servos[tvc_jet::ENGINE].max - 3.0e5).abs() < 1.0e-6);
}

#[test]
fn a_model_without_points_is_left_alone() {
    let mut aircraft = testing::aircraft_model();
    assert!(!aircraft.schedule.clone().put(1.0e4, &mut aircraft));
    assert_eq!(aircraft, testing::aircraft_model());
}

#[test]
fn a_schedule_comes_through_its_file() {
    let text = toml::to_string(&scheduled()).unwrap();
    assert!(text.contains("[[at]]"));
    let read: AircraftModel = toml::from_str(&text).unwrap();
    assert_eq!(read, scheduled());
    assert_eq!(read.validate(), Ok(()));
    assert!(!toml::to_string(&testing::aircraft_model()).unwrap().contains("at ="));
}

#[test]
fn a_point_that_cannot_be_is_refused_with_its_number_and_key() {
    let refusal = |change: fn(&mut SchedulePoint)| -> String {
        let mut points = [point(100.0, -0.1), point(200.0, -0.5)];
        change(&mut points[1]);
        let aircraft =
            AircraftModel { schedule: Schedule::new(points), ..testing::aircraft_model() };
        aircraft.validate().unwrap_err().to_string()
    };
    assert_eq!(
        refusal(|point| point.airframe.c_roll_p = f64::NAN),
        "[[at]] number 2: airframe.c_roll_p = NaN is outside -100 to 100"
    );
    assert!(refusal(|point| point.airspeed_m_s = 90.0).contains("number 2: airspeed_m_s (dynamic"));
    assert!(
        refusal(|point| point.c_yaw = PerEffector::from_fn(|_| 0.1)).contains("c_yaw = 0.1 is")
    );
    assert!(refusal(|point| point.thrust_n = [5.0, 1.0]).contains("thrust_n (largest) = 1"));
}
