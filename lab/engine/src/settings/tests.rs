use super::*;
use crate::configuration::AircraftArgs;

fn setting(text: &str) -> Setting {
    Setting::parse(text).unwrap()
}

#[test]
fn every_key_of_the_shipped_files_is_known() {
    fn leaves(path: &str, value: &Value, found: &mut Vec<String>) {
        match value {
            Value::Table(table) => {
                table
                    .iter()
                    .for_each(|(key, value)| leaves(&format!("{path}.{key}"), value, found));
            }
            Value::Array(list) => {
                let tables = list.iter().filter(|entry| entry.is_table());
                tables.for_each(|entry| leaves(&format!("{path}.1"), entry, found));
                if list.iter().all(|entry| !entry.is_table()) {
                    found.push(path.to_owned());
                }
            }
            _ => found.push(path.to_owned()),
        }
    }
    let mut found = Vec::new();
    for (root, text) in
        [("airframe", aircraft::DEFAULT_AIRFRAME), ("model", aircraft::DEFAULT_MODEL)]
    {
        leaves(root, &Value::Table(toml::from_str(text).unwrap()), &mut found);
    }
    for (_, text) in scenarios::SCENARIOS {
        let table: Table = toml::from_str(text).unwrap();
        table.iter().for_each(|(key, value)| leaves(key, value, &mut found));
    }
    assert!(found.len() > 100, "{} keys", found.len());
    for key in found {
        assert!(keys::all().contains(&keys::pattern(&key)), "{key} is not known");
    }
}

#[test]
fn keys_that_no_shipped_file_has_are_known_too() {
    for key in [
        "plant.start.altitude_m",
        "plant.fault.1.frequency_hz",
        "plant.fault.2.side",
        "autopilot.reference.1.airspeed_m_s",
        "autopilot.script",
        "airframe.mach.design_mach",
        "airframe.mach.growth.c_roll_beta",
    ] {
        assert!(keys::is_known(key), "{key} is not in {:?}", keys::all());
    }
    for key in ["", "plant", "plant.wind", "airframe.mach", "plant.*.x", "plant.fault.1.nothing"] {
        assert!(!keys::is_known(key), "{key}");
    }
}

#[test]
fn an_unknown_key_names_the_nearest_one() {
    for (key, nearest) in [
        ("plant.wind.turbulense_m_s", "plant.wind.turbulence_m_s"),
        ("turbulence_m_s", "plant.wind.turbulence_m_s"),
        ("airframe.mass_kg", "airframe.mass.mass_kg"),
        ("plant.fault.2.angel_deg", "plant.fault.1.angle_deg"),
        ("FTC_MOD", "FTC_MODE"),
        ("ftc_mode", "FTC_MODE"),
    ] {
        let error = setting(&format!("{key}=1")).target().unwrap_err().to_string();
        assert_eq!(error, format!("--set {key}: there is no such key; the nearest is {nearest}"));
    }
}

#[test]
fn an_unknown_key_of_any_length_is_refused_at_once() {
    for known in keys::all() {
        assert!(2 * known.len() <= 128, "{known}");
    }
    let key = "a".repeat(1_000_000);
    let error = setting(&format!("{key}=1")).target().unwrap_err().to_string();
    assert_eq!(error, format!("--set {key}: there is no such key"));
}

#[test]
fn a_command_refuses_settings_of_what_it_does_not_read() {
    let read = |key: &str| {
        let settings = vec![setting(&format!("{key}=1"))];
        let args = AircraftArgs { settings, ..AircraftArgs::default() };
        args.check_read(&[Target::Airframe]).map_err(|error| error.to_string())
    };
    assert_eq!(read("airframe.mass.mass_kg"), Ok(()));
    for key in ["plant.start.airspeed_m_s", "model.mass.mass_kg", "FTC_MODE"] {
        let refused = format!(
            "--set {key} has no effect: of aircraft and flight this command reads the airframe (airframe.…)"
        );
        assert_eq!(read(key), Err(refused));
    }
    let args = AircraftArgs { model: Some("f16".into()), ..AircraftArgs::default() };
    let refused = args.check_read(&[Target::Airframe]).unwrap_err().to_string();
    assert!(refused.starts_with("--model has no effect"), "{refused}");
    assert!(args.check_read(&[Target::Airframe, Target::Model]).is_ok());
}

#[test]
fn a_setting_goes_where_its_key_says() {
    let mut file: Table =
        toml::from_str("[plant]\nseed = 1\n[[plant.fault]]\nangle_deg = 3.0\n").unwrap();
    let settings = [
        "plant.seed=7",
        "plant.wind.speed_m_s=3",
        "plant.fault.1.angle_deg=-5.5",
        "plant.earth=flat",
        "plant.fault.2.kind=float",
    ]
    .map(setting);
    apply(&mut file, "", &settings.iter().collect::<Vec<_>>()).unwrap();
    let expected = "[plant]\nseed = 7\nearth = \"flat\"\n[[plant.fault]]\nangle_deg = -5.5\n[[plant.fault]]\nkind = \"float\"\n\
                    [plant.wind]\nspeed_m_s = 3\n";
    assert_eq!(file, toml::from_str::<Table>(expected).unwrap());
    let error =
        apply(&mut file, "", &[&setting("plant.fault.4.kind=float")]).unwrap_err().to_string();
    assert_eq!(error, "--set plant.fault.4.kind: entry 4 of fault is outside 1 to 3");
    let error = apply(&mut file, "", &[&setting("plant.seed.x=1")]).unwrap_err().to_string();
    assert_eq!(error, "--set plant.seed.x: seed is no table here");
}

#[test]
fn a_value_is_one_value_whatever_is_in_it() {
    assert_eq!(written("1.5"), Value::Float(1.5));
    assert_eq!(written("[1, 2]"), Value::Array(vec![Value::Integer(1), Value::Integer(2)]));
    for text in ["flat", "1\nother = 2", "", "\"", "a = b"] {
        assert_eq!(written(text), Value::String(text.to_owned()));
    }
}

#[test]
fn parameters_are_set_together_and_refused_with_name_value_and_range() {
    let set = |texts: &[&str]| {
        let mut parameters = Parameters::default();
        let settings: Vec<_> = texts.iter().map(|text| setting(text)).collect();
        set_parameters(&mut parameters, &settings).map(|()| parameters).map_err(|e| e.to_string())
    };
    // Each alone would be out of order with the default of the other.
    let limits = set(&["FW_AIRSPD_MIN=350", "FW_AIRSPD_MAX=400"]).unwrap().limits;
    assert_eq!((limits.airspeed_min_m_s, limits.airspeed_max_m_s), (350.0, 400.0));
    let refused = set(&["FTC_MODE=on"]).unwrap_err();
    assert_eq!(refused, "--set FTC_MODE=on: FTC_MODE is a number from 0 to 2 -");
    let refused = set(&["REF_ROLL_MAX=nan"]).unwrap_err();
    assert_eq!(refused, "--set: REF_ROLL_MAX = NaN is outside 1 to 80 deg");
    let fault = setting("FLT_SERVO1=1").target().unwrap_err().to_string();
    assert!(fault.contains("only in flight"), "{fault}");
}
