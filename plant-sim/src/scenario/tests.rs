//! Reading scenarios, and what is refused.

use super::*;
use crate::airframe_file::ReadAirframe as _;
use crate::wind::TurbulenceLevel;
use icd::fault::{FaultKind, Repeat, SensorKind, Side, TargetClass, Timing, Travel};
use icd::tvc_jet;
use scenarios::{CASE1, CASE2, NOMINAL};

fn refusal(scenario: &str, from: &str, to: &str) -> String {
    assert!(scenario.contains(from), "the file has no {from}");
    let text = scenario.replacen(from, to, 1);
    Scenario::from_toml("my.toml", &text, &tvc_jet::effectors()).unwrap_err().to_string()
}

#[test]
fn the_scenarios_of_the_crate_are_those_of_the_paper() {
    let nominal =
        Scenario::from_toml("nominal.toml", NOMINAL, &tvc_jet::effectors()).unwrap().plant;
    assert_eq!(nominal.faults, []);
    // The flight begins at the design point of whatever airframe flies it.
    assert_eq!((nominal.start, nominal.duration_s), (StartPart::default(), None));

    let case1 = Scenario::from_toml("case1.toml", CASE1, &tvc_jet::effectors()).unwrap().plant;
    let jam = |effector: icd::Effector, degrees: f64, seconds: u64| ScheduledFault {
        target: effector.into(),
        kind: FaultKind::StuckAt { angle_rad: degrees.to_radians(), travel: Travel::Jump },
        timing: Timing::at(SimTime::from_micros(seconds * 1_000_000)),
    };
    assert_eq!(case1.faults, [jam(tvc_jet::LEFT_ELEVATOR, 30.0, 3)]);
    assert_eq!(case1.duration_s, Some(90.0));

    let case2 = Scenario::from_toml("case2.toml", CASE2, &tvc_jet::effectors()).unwrap().plant;
    assert_eq!(case2.faults, [jam(tvc_jet::RUDDER, 7.0, 1)]);
    assert_eq!(case2.duration_s, Some(40.0));
}

#[test]
fn every_kind_of_the_catalogue_is_read_by_its_keys() {
    let list = tvc_jet::effectors();
    for code in 1..=u8::MAX {
        let Some(kind) = FaultKind::from_code(code, [0.5, 0.5]) else { break };
        for (effector, class) in [("rudder", TargetClass::Angle), ("engine", TargetClass::Thrust)] {
            let info = kind.info();
            let mut lines = format!("effector = \"{effector}\"\nkind = \"{}\"\n", info.key);
            for (number, value) in info.numbers.iter().zip(kind.values()) {
                let (key, measure) = (number.quantity.key(class), number.quantity.measure());
                lines += &format!("{key} = {:?}\n", measure.unit(class).from_si(value));
            }
            if let Some(choice) = info.choice {
                let word = choice.alternatives[usize::from(code - info.code)].key;
                lines += &format!("{} = \"{word}\"\n", choice.key);
            }
            let read = with_fault(&lines).unwrap();
            assert_eq!(read.target, list.by_key(effector).unwrap().into());
            assert_eq!(read.kind.code(), code, "{lines}");
            let off = read.kind.values().into_iter().zip(kind.values()).map(|(a, b)| a - b);
            assert!(off.into_iter().all(|off| off.abs() < 1.0e-9), "{lines}: {:?}", read.kind);
        }
    }
}

#[test]
fn every_fault_of_every_sensor_is_read_by_the_keys_of_its_unit() {
    for code in 1..=u8::MAX {
        let Some(kind) = FaultKind::from_code(code, [0.5, 0.5]) else { break };
        for sensor in SensorKind::ALL.into_iter().filter(|_| kind.info().targets.sensors) {
            let class = TargetClass::Sensor(sensor);
            let mut lines =
                format!("sensor = \"{}\"\nkind = \"{}\"\n", sensor.key(), kind.info().key);
            for (number, value) in kind.info().numbers.iter().zip(kind.values()) {
                let (key, measure) = (number.quantity.key(class), number.quantity.measure());
                lines += &format!("{key} = {:?}\n", measure.unit(class).from_si(value));
            }
            let read = with_fault(&lines).unwrap();
            assert_eq!((read.target, read.kind.code()), (sensor.into(), code), "{lines}");
            let off = read.kind.values().into_iter().zip(kind.values()).map(|(a, b)| a - b);
            assert!(off.into_iter().all(|off| off.abs() < 1.0e-9), "{lines}: {:?}", read.kind);
        }
    }
}

#[test]
fn errors_of_sensors_that_cannot_be_are_refused_with_file_key_value_and_range() {
    let with = |lines: &str| {
        let text = format!("[plant]\nseed = 1\n{lines}");
        let read = Scenario::from_toml("my.toml", &text, &tvc_jet::effectors());
        read.map_err(|error| error.to_string()).map(|scenario| scenario.plant)
    };
    let flown = |lines: &str| {
        let airframe = Airframe::paper();
        let setup = with(lines).unwrap().setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
        setup.check().and_then(|()| setup.check_faults()).unwrap_err().to_string()
    };
    for (lines, expected) in [
        (
            "[plant.sensors.gyro]\nrate_hz = -1",
            "my.toml: [plant.sensors.gyro] rate_hz = -1 is outside 0.01 to 10000",
        ),
        (
            "[plant.sensors.gnss]\nnoise_m = -2.0",
            "[plant.sensors.gnss] noise_m = -2 is outside 0 to 10000",
        ),
        (
            "[plant.sensors.vanes]\nbias_deg = nan",
            "[plant.sensors.vanes] bias_deg = NaN is outside 0 to 45",
        ),
        (
            "[plant.sensors.pitot]\nnoise_deg = 1.0",
            "the unit deg does not fit, expected one of noise_pa, noise_kpa, noise_psf",
        ),
        (
            "[plant.sensors]\ngrade = \"best\"",
            "unknown variant `best`, expected one of `ideal`, `tactical`, `consumer`",
        ),
        ("[plant.sensors.radar]\nrate_hz = 1.0", "unknown field `radar`"),
        (
            "[plant.sensors]\ngrade = \"tactical\"\ngyro_noise_deg_s = 0.1",
            "gyro_noise_deg_s is of ideal sensors",
        ),
        (
            "[plant.sensors.gyro]\nrate_hz = 500.0\ndelay_ms = 200.0",
            "[plant.sensors.gyro] delay_ms = 200 is outside 0 to 128",
        ),
        (
            "date = \"2031-01-01\"",
            "my.toml: [plant] date = \"2031-01-01\", expected YYYY-MM-DD from 2025-01-01 to 2029-12-31",
        ),
        ("date = 7", "invalid type"),
    ] {
        let error = with(lines).unwrap_err();
        assert!(error.contains(expected), "{lines}: {error}");
    }
    let lacking = "[plant.sensors.vanes]\nfitted = false\n[[plant.fault]]\nsensor = \"vanes\"\nkind = \"off\"\nonset_s = 1";
    assert!(
        flown(lacking).contains("fault 1 (vanes, off): the aircraft does not have this sensor"),
        "{}",
        flown(lacking)
    );
    let attitude = "[plant.sensors]\ngrade = \"tactical\"\n[[plant.fault]]\nsensor = \"attitude\"\nkind = \"off\"\nonset_s = 1";
    assert!(flown(attitude).contains("does not have this sensor"), "{}", flown(attitude));
    let large =
        "[[plant.fault]]\nsensor = \"gyro\"\nkind = \"biased\"\nbias_deg_s = 2000\nonset_s = 1";
    assert!(
        with(large).unwrap_err().contains("bias_deg_s = 2000 is outside -1000 to 1000"),
        "{large}"
    );
    let plant =
        with("[plant.sensors]\ngrade = \"consumer\"\n[plant.sensors.gnss]\nrate_hz = 1.0").unwrap();
    let grade = plant.sensors.grade.unwrap();
    assert_eq!(grade.of(SensorKind::Gnss).rate_hz, 1.0);
    assert!((grade.of(SensorKind::Gyro).bias - 0.2_f64.to_radians()).abs() < 1.0e-12);
}

#[test]
fn a_fault_of_a_sensor_is_read_and_left_to_the_plant() {
    let table = "sensor = \"gnss\"\nkind = \"stuck_here\"";
    assert_eq!(with_fault(table).unwrap().target, SensorKind::Gnss.into());
    let unknown = with_fault("sensor = \"radar\"\nkind = \"stuck_here\"").unwrap_err();
    assert!(unknown.contains("sensor = `radar`, the aircraft has only gyro,"), "{unknown}");
    let both = format!("effector = \"rudder\"\n{table}");
    assert!(with_fault(&both).unwrap_err().contains("of an effector, of a sensor or of a part"));
    let unknown = with_fault("effector = \"rudder\"\nkind = \"broken\"").unwrap_err();
    assert!(
        unknown.contains("unknown variant `broken`, expected one of `stuck_here`"),
        "{unknown}"
    );
    let key = with_fault("effector = \"rudder\"\nkind = \"float\"\nanglee_deg = 3").unwrap_err();
    assert!(key.contains("unknown field `anglee_deg`, expected one of `effector`"), "{key}");
}

#[test]
fn every_key_of_a_fault_is_known_to_the_search_for_keys() {
    for key in ["effector", "part", "kind", "angle_deg", "travel", "onset_s", "clear_s", "times"] {
        assert!(KNOWN_KEYS.contains(&format!("plant.fault.N.{key}")), "{key}");
    }
}

#[test]
fn every_kind_of_fault_can_be_written() {
    let text = format!(
        "{NOMINAL}\n[[plant.fault]]\neffector = \"rudder\"\nkind = \"stuck_here\"\nonset_s = 1.0\nclear_s = 2.5\n\
         [[plant.fault]]\neffector = \"engine\"\nkind = \"partial_loss\"\nremaining_percent = 40\nonset_s = 2\n\
         [[plant.fault]]\neffector = \"nozzle_yaw\"\nkind = \"float\"\nonset_s = 3\n\
         [[plant.fault]]\neffector = \"left_aileron\"\nkind = \"stuck_at\"\nangle_deg = -5\n\
         travel = \"actuator_rate\"\nonset_s = 4\n"
    );
    let faults = Scenario::from_toml("my.toml", &text, &tvc_jet::effectors()).unwrap().plant.faults;
    assert_eq!(faults[0].timing.duration_s, Some(1.5));
    assert_eq!(faults[1].kind, FaultKind::PartialLoss { remaining: 0.4 });
    assert_eq!(faults[2].kind, FaultKind::Float);
    let angle_rad = (-5.0_f64).to_radians();
    let travel = Travel::AtActuatorRate;
    assert_eq!(faults[3].kind, FaultKind::StuckAt { angle_rad, travel });
}

/// The nominal flight with one fault that has these lines besides its onset at 1 s.
fn with_fault(lines: &str) -> Result<ScheduledFault, String> {
    let text = format!("{NOMINAL}\n[[plant.fault]]\nonset_s = 1\n{lines}\n");
    let scenario = Scenario::from_toml("my.toml", &text, &tvc_jet::effectors())
        .map_err(|error| error.to_string())?;
    Ok(scenario.plant.faults[0])
}

#[test]
fn every_kind_has_its_keys_with_the_units_of_its_effector() {
    use FaultKind as K;
    let degrees = |value: f64| value.to_radians();
    let table = [
        ("rudder", "hard_over", "side = \"negative\"", K::HardOver { side: Side::Negative }),
        ("rudder", "slow", "rate_deg_s = 5", K::Slow { rate: degrees(5.0) }),
        ("engine", "slow", "rate_kn_s = 2.5", K::Slow { rate: 2_500.0 }),
        ("engine", "delayed", "delay_ms = 250", K::Delayed { delay_s: 0.25 }),
        (
            "nozzle_yaw",
            "intermittent",
            "period_s = 0.5\npresent_percent = 50",
            K::Intermittent { period_s: 0.5, present: 0.5 },
        ),
        (
            "left_elevator",
            "oscillating",
            "amplitude_deg = 3\nfrequency_hz = 1.5",
            K::Oscillating { amplitude: degrees(3.0), frequency_hz: 1.5 },
        ),
        ("right_aileron", "drifting", "rate_deg_s = -0.5", K::Drifting { rate: degrees(-0.5) }),
        ("engine", "biased", "bias_kn = -3", K::Biased { bias: -3_000.0 }),
        ("rudder", "limited_travel", "limit_deg = 8", K::LimitedTravel { limit: degrees(8.0) }),
        ("engine", "limited_travel", "limit_kn = 20", K::LimitedTravel { limit: 20_000.0 }),
        ("engine", "flame_out", "", K::FlameOut),
    ];
    for (effector, kind, keys, expected) in table {
        let lines = format!("effector = \"{effector}\"\nkind = \"{kind}\"\n{keys}");
        let fault = with_fault(&lines).unwrap();
        assert_eq!(
            (fault.target, fault.kind),
            (tvc_jet::effectors().by_key(effector).unwrap().into(), expected)
        );
    }
}

#[test]
fn ramp_duration_and_repetition_are_read() {
    let rudder = "effector = \"rudder\"\nkind = \"biased\"\nbias_deg = 2\n";
    let timing = |keys: &str| with_fault(&format!("{rudder}{keys}")).map(|fault| fault.timing);
    let whole = Timing {
        ramp_s: 0.5,
        duration_s: Some(2.0),
        repeat: Some(Repeat { every_s: 5.0, times: Some(3) }),
        ..Timing::at(SimTime::from_micros(1_000_000))
    };
    let keys = "ramp_s = 0.5\nduration_s = 2\nevery_s = 5\ntimes = 3";
    assert_eq!(timing(keys), Ok(whole));
    for (keys, problem) in [
        ("ramp_s = -1", "[plant.fault] ramp_s = -1 is outside 0 to 3600"),
        ("duration_s = 1\nramp_s = 2", "[plant.fault] duration_s = 1 is outside 2 to 2592000"),
        ("duration_s = 2\nevery_s = 1", "[plant.fault] every_s = 1 is outside 2.000001 to 2592000"),
        ("duration_s = 2\nevery_s = 3\ntimes = 1", "[plant.fault] times = 1 is outside 2 to 1000"),
        ("every_s = 3", "[[plant.fault]] number 1, kind biased: duration_s is missing"),
        ("times = 3", "[[plant.fault]] number 1, kind biased: every_s is missing"),
        (
            "clear_s = 3\nduration_s = 1",
            "[[plant.fault]] number 1, kind biased: clear_s excludes duration_s",
        ),
    ] {
        assert_eq!(timing(keys), Err(format!("my.toml: {problem}")));
    }
    assert_eq!(
        with_fault("effector = \"rudder\"\nkind = \"stuck_here\"\nramp_s = 1"),
        Err("my.toml: [plant.fault] ramp_s = 1 is outside 0 to 0".to_owned())
    );
}

#[test]
fn a_number_of_a_fault_in_the_wrong_unit_or_range_is_refused() {
    for (lines, problem) in [
        (
            "effector = \"engine\"\nkind = \"biased\"\nbias_deg = 3",
            "[[plant.fault]] number 1, kind biased: bias_kn is missing",
        ),
        (
            "effector = \"rudder\"\nkind = \"biased\"\nbias_deg = 3\nbias_kn = 3",
            "[[plant.fault]] number 1, kind biased: bias_kn has no meaning here",
        ),
        (
            "effector = \"rudder\"\nkind = \"hard_over\"",
            "[[plant.fault]] number 1, kind hard_over: side is missing",
        ),
        (
            "effector = \"rudder\"\nkind = \"float\"\nside = \"positive\"",
            "[[plant.fault]] number 1, kind float: side has no meaning here",
        ),
        (
            "effector = \"rudder\"\nkind = \"delayed\"\ndelay_ms = 1001",
            "[plant.fault] delay_ms = 1001 is outside 0 to 1000",
        ),
        (
            "effector = \"rudder\"\nkind = \"oscillating\"\namplitude_deg = 1\nfrequency_hz = nan",
            "[plant.fault] frequency_hz = NaN is outside 0.001 to 20",
        ),
    ] {
        assert_eq!(with_fault(lines), Err(format!("my.toml: {problem}")));
    }
}

#[test]
fn a_start_and_a_wind_may_have_only_the_keys_that_differ() {
    let text = NOMINAL.split("[plant.wind]").next().unwrap();
    let text =
        format!("{text}[plant.wind]\nturbulence_m_s = 2.0\n[plant.start]\naltitude_m = 3000.0\n");
    let plant = Scenario::from_toml("my.toml", &text, &tvc_jet::effectors()).unwrap().plant;
    let airframe = Airframe::paper();
    let at = airframe.design_point;
    let start = Start { altitude_m: 3_000.0, ..at };
    let setup = plant.setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
    assert_eq!(setup.start, start);
    assert_eq!(setup.wind, WindSettings { turbulence_m_s: 2.0, ..WindSettings::default() });
}

#[test]
fn the_autopilots_table_is_not_read() {
    let text = format!("{NOMINAL}\n[autopilot.whatever]\nit = \"likes\"\n");
    assert!(Scenario::from_toml("my.toml", &text, &tvc_jet::effectors()).is_ok());
}

#[test]
fn an_unknown_key_is_refused_with_its_line() {
    let message = refusal(NOMINAL, "seed", "sead");
    assert!(message.contains("sead") && message.contains("line"), "{message}");
}

#[test]
fn values_out_of_range_name_key_value_and_range() {
    assert_eq!(
        refusal(CASE1, "altitude_m = 5000.0", "altitude_m = -5.0"),
        "my.toml: [plant.start] altitude_m = -5 is outside 1 to 25000"
    );
    assert_eq!(
        refusal(CASE1, "onset_s = 3.0", "onset_s = -3.0"),
        "my.toml: [plant.fault] onset_s = -3 is outside 0 to 2592000"
    );
    assert_eq!(
        refusal(CASE1, "angle_deg = 30.0", "angle_deg = nan"),
        "my.toml: [plant.fault] angle_deg = NaN is outside -90 to 90"
    );
}

#[test]
fn a_fault_with_too_few_or_too_many_keys_is_refused() {
    assert_eq!(
        refusal(CASE1, "angle_deg = 30.0", ""),
        "my.toml: [[plant.fault]] number 1, kind stuck_at: angle_deg is missing"
    );
    assert_eq!(
        refusal(CASE1, "stuck_at", "float"),
        "my.toml: [[plant.fault]] number 1, kind float: angle_deg has no meaning here"
    );
}

#[test]
fn a_missing_key_is_named_with_its_table_and_the_number_of_its_entry() {
    let fault = "[[plant.fault]]\neffector = \"rudder\"\nkind = \"stuck_here\"\nonset_s = 1\n";
    for (key, problem) in [
        ("effector = \"rudder\"\n", ", kind stuck_here: effector is missing"),
        ("kind = \"stuck_here\"\n", ": kind is missing"),
        ("onset_s = 1\n", ", kind stuck_here: onset_s is missing"),
    ] {
        let text = format!("[plant]\n{fault}{}", fault.replace(key, ""));
        let problem = format!("my.toml: [[plant.fault]] number 2{problem}");
        assert_eq!(refusal(&text, "", ""), problem);
    }
    let gust = "[[plant.gust]]\nonset_s = 1\nlength_m = 9\n";
    let text = format!("[plant]\n{gust}{}", gust.replace("length_m = 9\n", ""));
    let problem = "my.toml: [[plant.gust]] number 2: length_m is missing";
    assert_eq!(refusal(&text, "", ""), problem);
    let table: toml::Table = toml::from_str(&text).unwrap();
    let read = Scenario::from_table("my.toml", table, &tvc_jet::effectors());
    assert_eq!(read.unwrap_err().to_string(), problem);
}

#[test]
fn a_scenario_without_a_seed_has_the_first() {
    let scenario = Scenario::from_toml("my.toml", "[plant]\n", &tvc_jet::effectors()).unwrap();
    assert_eq!(scenario.plant.seed, 1);
}

#[test]
fn a_fault_of_a_role_is_one_of_the_effector_that_has_it() {
    let text = aircraft::AEROSONDE_AIRFRAME.replace("name = \"rudder\"", "name = \"fin flap\"");
    let list = Airframe::from_toml("my.toml", &text).unwrap().effectors;
    let fault = Scenario::from_toml("case2.toml", CASE2, &list).unwrap().plant.faults[0];
    assert_eq!(fault.target.name(&list), "fin flap");
}

#[test]
fn a_fault_that_ends_before_it_begins_is_refused() {
    assert_eq!(
        refusal(CASE1, "onset_s = 3.0", "onset_s = 3.0\nclear_s = 2.0"),
        "my.toml: [plant.fault] clear_s = 2 is outside 3.000001 to 2592000"
    );
}

#[test]
fn the_air_of_a_flight_has_levels_of_turbulence_shear_and_another_temperature() {
    let text = format!(
        "{}\n[[plant.wind.level]]\naltitude_m = 0\nvelocity_ned_m_s = [0, 2, 0]\n\
         [plant.atmosphere]\ntemperature_offset_k = 15\n",
        NOMINAL.replace("turbulence_m_s = 0.0", "turbulence = \"moderate\"\nturbulence_m_s = 0.0")
    );
    let part = |text: &str| Scenario::from_toml("my.toml", text, &Airframe::paper().effectors);
    let plant = part(&text).unwrap().plant;
    assert_eq!(plant.wind.turbulence, Some(TurbulenceLevel::Moderate));
    assert_eq!(plant.profile.at(100.0), icd::Ned::new(0.0, 2.0, 0.0));
    assert_eq!(plant.temperature_offset_k, 15.0);
    let refused = |from: &str, to: &str| part(&text.replace(from, to)).unwrap_err().to_string();
    assert_eq!(
        refused("turbulence_m_s = 0.0", "turbulence_m_s = 1.5"),
        "my.toml: [plant.wind] turbulence_m_s beside turbulence = 1.5 is outside 0 to 0"
    );
    assert_eq!(
        refused("offset_k = 15", "offset_k = 99"),
        "my.toml: [plant.atmosphere] temperature_offset_k = 99 is outside -60 to 60"
    );
    let mild = refused("\"moderate\"", "\"mild\"");
    assert!(mild.contains("`none`, `light`, `moderate`, `severe`"), "{mild}");
    let calm = part(&text.replace("\"moderate\"", "\"none\"")).unwrap().plant;
    assert_eq!(calm.wind.turbulence, None);
}

const GROUND: &str = r#"
[plant.ground]
latitude_deg = 34.9
longitude_deg = -117.9
elevation_m = 700.0
heading_deg = 40.0
length_m = 3000.0
slope_percent = 1.0
start = "parked"
along_m = 50.0
"#;

#[test]
fn the_ground_of_a_scenario_is_read() {
    let read = |text: &str| {
        Scenario::from_toml("my.toml", text, &tvc_jet::effectors()).unwrap().plant.ground
    };
    let ground = read(&format!("{NOMINAL}{GROUND}")).unwrap();
    assert_eq!(ground.start, GroundStart::Parked { along_m: 50.0 });
    assert_eq!((ground.slope, ground.friction), (0.01, 1.0));
    let in_air = GROUND.replace("start = \"parked\"\nalong_m = 50.0\n", "");
    let ground = read(&format!("{NOMINAL}{in_air}")).unwrap();
    assert_eq!(ground.start, GroundStart::Air);
    assert_eq!(read(NOMINAL), None);
}

#[test]
fn a_ground_that_cannot_be_is_refused_with_key_value_and_range() {
    let text = format!("{NOMINAL}{GROUND}");
    for (from, to, refused) in [
        ("latitude_deg = 34.9", "latitude_deg = 95.0", "latitude_deg = 95 is outside -89 to 89"),
        ("slope_percent = 1.0", "slope_percent = 11", "slope_percent = 11 is outside -10 to 10"),
        (
            "elevation_m = 700.0",
            "elevation_m = 1e6",
            "elevation_m = 1000000 is outside -450 to 9000",
        ),
        ("along_m = 50.0", "along_m = 3001", "along_m = 3001 is outside 0 to 3000"),
        ("length_m = 3000.0", "length_m = nan", "length_m = NaN is outside 10 to 20000"),
        ("start = \"parked\"", "start = \"air\"", "along_m has no meaning with this start"),
    ] {
        assert_eq!(refusal(&text, from, to), format!("my.toml: [plant.ground] {refused}"));
    }
    let launch = refusal(&text, "\"parked\"", "\"launched\"");
    assert_eq!(launch, "my.toml: [plant.ground]: height_m is missing");
    let missing = refusal(&text, "heading_deg = 40.0\n", "");
    assert_eq!(missing, "my.toml: [plant.ground]: heading_deg is missing");
    let both = refusal(&text, "[plant.wind]", "[plant.start]\nheading_deg = 1.0\n[plant.wind]");
    assert!(
        both.contains("[plant.start] has no meaning beside the start of [plant.ground]"),
        "{both}"
    );
}
