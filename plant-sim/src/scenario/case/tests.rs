//! Check case files, and what is refused.

use super::*;
use crate::Scenario;
use crate::airframe_file::ReadAirframe as _;
use aircraft::F16_AIRFRAME;
use proptest::prelude::*;

const SPHERE_CASE: &str = include_str!("../../../checkcases/07_sphere_in_wind.toml");
const F16_CASE: &str = include_str!("../../../checkcases/11_f16_subsonic.toml");
const SPHERE: &str = include_str!("../../../checkcases/sphere.toml");

fn read_with(body: &str, text: &str, options: &CaseOptions) -> Result<CheckCase, String> {
    let airframe = Airframe::from_toml("body.toml", body).map_err(|error| error.to_string())?;
    let file = CaseFile::from_toml("cases/my.toml", text).map_err(|error| error.to_string())?;
    file.into_case(airframe, options).map_err(|error| error.to_string())
}

fn read(body: &str, text: &str) -> Result<CheckCase, String> {
    read_with(body, text, &CaseOptions::default())
}

/// The error for a sphere's case with a change.
fn refusal(from: &str, to: &str) -> String {
    assert!(SPHERE_CASE.contains(from), "the file has no {from}");
    read(SPHERE, &SPHERE_CASE.replacen(from, to, 1)).unwrap_err()
}

/// The error for the F-16's case with a change.
fn f16_refusal(from: &str, to: &str) -> String {
    assert!(F16_CASE.contains(from), "the file has no {from}");
    read(F16_AIRFRAME, &F16_CASE.replacen(from, to, 1)).unwrap_err()
}

#[test]
fn a_case_is_read_in_the_units_of_its_source() {
    let case = read(SPHERE, SPHERE_CASE).unwrap();
    assert!((case.setup.wind.speed_m_s - 6.096).abs() < 1e-12);
    assert!((case.setup.airframe.mass.mass_kg - 14.593_902_937).abs() < 1e-9);
    let InitialPosition::Geodetic(here) = case.setup.initial.position else { panic!("geodetic") };
    assert_eq!(here.altitude_m, 9_144.0);
    assert_eq!(case.duration, SimTime::from_micros(30_000_000));
    assert_eq!((case.setup.step_us, case.output_us), (1_000, 50_000));
    assert_eq!(case.reference.as_deref(), Some("07"));
    let file = CaseFile::from_toml("cases/my.toml", SPHERE_CASE).unwrap();
    assert_eq!(file.airframe(), Path::new("cases/sphere.toml"));
    let options = CaseOptions { step_ms: Some(10.0), output_rate_hz: Some(50.0) };
    let case = read_with(SPHERE, SPHERE_CASE, &options).unwrap();
    assert_eq!((case.setup.step_us, case.output_us), (10_000, 20_000));
}

#[test]
fn controls_are_those_of_effectors_of_commands_and_of_the_lever() {
    let frozen = F16_CASE.replace("trim = \"longitudinal\"", "pitch_deg = 2.6");
    let with = |controls: &str| read(F16_AIRFRAME, &format!("{frozen}\n{controls}"));
    let case = with(
        "[plant.controls]\nelevator_deg = -3\nrudder_rad = 0.1\nright_elevator_deg = 1.0\nthrottle_percent = 14\n\
         [[plant.control_step]]\nat_s = 5\ncontrols = { aileron_deg = 2 }\n\
         [[plant.control_step]]\nat_s = 1.5\ncontrols = { aileron_deg = -2, throttle_percent = 1 }",
    )
    .unwrap();
    let list = &case.setup.airframe.effectors;
    let at = |controls: &Controls, name: &str| {
        controls.positions[list.by_key(name).unwrap()].to_degrees()
    };
    let controls = &case.setup.controls;
    for (name, degrees) in
        [("left_elevator", -3.0), ("right_elevator", -2.0), ("rudder", 5.729_577_951_308_232)]
    {
        assert!((at(controls, name) - degrees).abs() < 1e-12, "{name}: {}", at(controls, name));
    }
    assert_eq!(controls.lever, Some(0.14));
    assert_eq!(case.steps[0].at, SimTime::from_micros(1_500_000));
    assert_eq!(case.steps[0].change.lever, Some(0.01));
    assert!((at(&case.steps[1].change, "left_aileron") + 2.0).abs() < 1e-12);
    assert!((at(&case.steps[1].change, "right_aileron") - 2.0).abs() < 1e-12);

    for (controls, problem) in [
        ("", "[plant.controls] throttle_percent is missing, the aircraft has an engine"),
        (
            "[plant.controls]\nthrottle_percent = 1\nfin_deg = 1",
            "[plant.controls] fin_deg is unknown, expected one of left_aileron_deg",
        ),
        (
            "[plant.controls]\nthrottle_percent = 1\nrudder_ft = 1",
            "[plant.controls] rudder_ft is unknown",
        ),
        ("[plant.controls]\nengine_lbf = 100", "[plant.controls] engine_lbf is unknown"),
        (
            "[plant.controls]\nthrottle_percent = 101",
            "[plant.controls] throttle_percent = 101 is outside 0 to 100",
        ),
        (
            "[plant.controls]\nthrottle_percent = 1\nrudder_deg = 31",
            "[plant.controls] rudder_deg = 31 is outside -30",
        ),
        ("[plant.controls]\nthrottle_percent = nan", "[plant.controls] throttle_percent = NaN"),
        (
            "[plant.controls]\nthrottle_percent = 1\n[[plant.control_step]]\nat_s = 0.0005\ncontrols = {}",
            "[plant.control_step] at_s = 0.0005 is no whole number of steps of 1 ms",
        ),
        (
            "[plant.controls]\nthrottle_percent = 1\n[[plant.control_step]]\nat_s = 181\ncontrols = {}",
            "[plant.control_step] at_s = 181 is outside 0 to 180",
        ),
    ] {
        let message = with(controls).unwrap_err();
        assert!(message.starts_with(&format!("cases/my.toml: {problem}")), "{message}");
    }
    let message = read(SPHERE, &format!("{SPHERE_CASE}\n[plant.controls]\nrudder_deg = 1"));
    assert!(
        message.unwrap_err().contains("rudder_deg has no meaning for a body without effectors")
    );
    assert!(
        f16_refusal(
            "[plant.initial_state]",
            "[plant.controls]\nthrottle_percent = 1\n[plant.initial_state]"
        )
        .contains("throttle_percent has no meaning beside trim")
    );
}

#[test]
fn a_unit_that_does_not_fit_its_key_is_refused_with_those_that_do() {
    assert_eq!(
        refusal("altitude_ft", "altitude_slug"),
        "cases/my.toml: plant.initial_state.altitude_slug: the unit slug does not fit, expected one of altitude_m, altitude_ft, \
         altitude_in, altitude_km, altitude_nmi"
    );
    assert_eq!(
        refusal("speed_ft_s", "speed_ft"),
        "cases/my.toml: plant.wind.speed_ft: the unit ft does not fit, expected one of speed_m_s, speed_ft_s, speed_kt, speed_km_h"
    );
    let body = SPHERE.replace("ixx_slug_ft2", "ixx_slug");
    let message = read(&body, SPHERE_CASE).unwrap_err();
    assert!(
        message.contains(
            "body.toml: mass.ixx_slug: the unit slug does not fit, expected one of ixx_kg_m2"
        ),
        "{message}"
    );
}

#[test]
fn what_a_case_needs_and_what_it_cannot_have_is_named() {
    for (from, to, problem) in [
        ("airframe = \"sphere.toml\"", "", "[checkcase]: airframe is missing"),
        ("duration_s = 30.0", "", "[plant] duration_s is missing, a check case needs an end"),
        (
            "duration_s = 30.0",
            "duration_s = 1e9",
            "[plant] duration_s = 1000000000 is outside 0.001 to 86400",
        ),
        (
            "duration_s = 30.0",
            "duration_s = 0.0105",
            "[plant] duration_s = 0.0105 is no whole number of steps of 1 ms",
        ),
        (
            "reference = \"07\"",
            "output_rate_hz = 1000\nreference = \"07\"\n[plant.sensors]\ngyro_noise_deg_s = 0.0",
            "[plant.sensors] has no meaning beside [checkcase]",
        ),
        (
            "[plant]",
            "[plant]\nstart.airspeed_m_s = 100",
            "[plant.start] has no meaning beside [checkcase]",
        ),
        ("reference", "step_ms = 0\nreference", "[checkcase] step_ms = 0 is outside 0.1 to 100"),
        (
            "reference",
            "step_ms = 0.1005\nreference",
            "[checkcase] step_ms = 0.1005 is no whole number of microseconds",
        ),
        (
            "reference",
            "output_rate_hz = -1\nreference",
            "[checkcase] output_rate_hz = -1 is outside 0.001 to 1000",
        ),
        (
            "reference",
            "output_rate_hz = 30\nreference",
            "[checkcase] output_rate_hz = 30 is no whole number of steps of 1 ms from row to row; expected 1000 over a whole number, \
             as 30.303030303030305",
        ),
        ("reference", "colour = 1\nreference", "unknown field `colour`"),
        (
            "altitude_ft = 30_000.0",
            "",
            "[plant.initial_state] altitude_m is missing, expected it or position_ned_m",
        ),
        (
            "altitude_ft = 30_000.0",
            "altitude_ft = 1\nposition_ned_ft = [0, 0, 0]",
            "[plant.initial_state] position_ned_m has no meaning beside altitude_m",
        ),
        ("latitude_deg = 0.0", "", "[plant.initial_state] latitude_deg is missing"),
        (
            "velocity_ned_ft_s = [0.0, 0.0, 0.0]",
            "",
            "[plant.initial_state] velocity_ned_m_s, velocity_body_m_s - none of them for the velocity, expected exactly one",
        ),
        (
            "rates_inertial_deg_s = [0.0, 0.0, 0.0]",
            "rates_inertial_deg_s = [0, 0, 0]\nrates_ned_deg_s = [0, 0, 0]",
            "several of them for the body rates, expected exactly one",
        ),
        ("[0.0, 0.0, 0.0]", "[0.0, 0.0]", "plant.initial_state"),
        (
            "altitude_ft = 30_000.0",
            "altitude_ft = nan",
            "[plant.initial_state] altitude_m = NaN is outside 0 to 80000",
        ),
        (
            "roll_deg = 0.0",
            "roll_deg = inf",
            "[plant.initial_state] roll_deg = inf is outside -360 to 360",
        ),
        ("earth = \"wgs84\"", "earth = \"disc\"", "`wgs84`"),
        (
            "reference",
            "step_ft = 1\nreference",
            "checkcase.step_ft: the unit ft does not fit, expected one of step_s, step_ms, step_min",
        ),
        (
            "reference",
            "flat_gravity_ft_s2 = 32\nreference",
            "[checkcase] flat_gravity_m_s2 has no meaning on this Earth, expected earth = \"flat\"",
        ),
        (
            "towards_deg = 90.0",
            "level = [{ altitude_m = 5, velocity_ned_m_s = [0, 0, 0] }, { altitude_ft = 1, velocity_ned_kt = [0, 0, 0] }]",
            "[plant.wind.level] altitude_m = 0.3048 is outside 5",
        ),
    ] {
        let message = refusal(from, to);
        assert!(message.starts_with("cases/my.toml: "), "{message}");
        assert!(message.contains(problem), "{message}");
    }
    let long = read_with(
        SPHERE,
        &SPHERE_CASE.replace("30.0", "86400"),
        &CaseOptions { output_rate_hz: Some(1_000.0), ..CaseOptions::default() },
    );
    assert_eq!(
        long.unwrap_err(),
        "cases/my.toml: [plant] duration_s = 86400 makes 86400001 rows with output_rate_hz = 1000, expected at most 1000000"
    );
    assert!(
        f16_refusal("yaw_deg", "pitch_deg = 1\nyaw_deg")
            .contains("pitch_deg has no meaning beside trim")
    );
    let body = SPHERE.replace("mass_slug = 1.0", "mass_slug = -1.0");
    let message = read(&body, SPHERE_CASE).unwrap_err();
    assert_eq!(message, "body.toml: [mass] mass_kg = -14.593902937 is outside 1 to 1000000");
}

#[test]
fn a_flight_with_a_controller_refuses_what_only_a_case_has() {
    let effectors = Airframe::paper().effectors;
    let refused =
        |text: &str| Scenario::from_toml("my.toml", text, &effectors).unwrap_err().to_string();
    assert_eq!(
        refused(SPHERE_CASE),
        "my.toml: [checkcase] has no meaning beside an autopilot: `sitl study checkcase` flies it"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    /// Whatever number or word stands in a case, it is refused by its file or it flies without a panic.
    #[test]
    fn a_changed_line_is_refused_with_the_file_or_flies(
        line in 0..60_usize,
        value in prop_oneof![
            any::<f64>().prop_map(|number| format!("{number:?}")),
            (-1.0e5..1.0e5).prop_map(|number: f64| format!("{number:?}")),
            any::<i64>().prop_map(|number| number.to_string()),
            Just("nan".to_owned()),
            Just("[1.0, -2e9, inf]".to_owned()),
            Just("[0, 0, 0]".to_owned()),
            Just("\"longitudinal\"".to_owned()),
            "[a-z\\[\\]{}\"=., ]{0,12}",
        ],
        is_f16 in any::<bool>(),
        suffix in prop_oneof![Just(""), Just("_ft"), Just("_slug"), Just("_rad")],
    ) {
        let (case, body) = if is_f16 { (F16_CASE, F16_AIRFRAME) } else { (SPHERE_CASE, SPHERE) };
        let changed = |text: &str| {
            let lines: Vec<&str> = text.lines().collect();
            let chosen = line % lines.len();
            let new = match lines[chosen].split_once('=') {
                Some((key, _)) if !key.starts_with('#') => format!("{}{suffix} = {value}", key.trim()),
                _ => lines[chosen].to_owned(),
            };
            let mut lines: Vec<String> = lines.into_iter().map(str::to_owned).collect();
            lines[chosen] = new;
            lines.join("\n")
        };
        let body = if is_f16 { body.to_owned() } else { changed(body) };
        match read(&body, &changed(case)) {
            Err(message) => prop_assert!(
                message.starts_with("cases/my.toml: ") || message.starts_with("body.toml: "), "{message}"
            ),
            Ok(case) => {
                let Ok(mut plant) = crate::Plant::release(&case.setup) else { return Ok(()) };
                for _ in 0..20 {
                    plant.advance(&icd::Actuators::new(plant.controls().positions));
                }
                prop_assert!(plant.truth().altitude_m.is_finite());
            }
        }
    }
}
