use super::*;

mod saved;

#[test]
fn names_are_unique_and_short_enough_and_defaults_are_inside_their_range() {
    for (i, row) in table().iter().enumerate() {
        assert!(row.name.len() <= 16, "{}", row.name);
        assert!(table()[..i].iter().all(|other| other.name != row.name), "{}", row.name);
        let value = row.value(&Parameters::default());
        assert!((row.min..=row.max).contains(&value), "{} = {value} {}", row.name, row.unit);
    }
}

#[test]
fn every_parameter_reads_what_was_set_and_refuses_what_is_outside() {
    for row in table() {
        let mut parameters = Parameters::default();
        let middle = if row.kind == Kind::Int { row.max } else { 0.5 * (row.min + row.max) };
        if parameters.set(row.name, middle).is_ok() {
            assert!((row.value(&parameters) - middle).abs() < 1e-9, "{}", row.name);
        }
        let before = parameters;
        for bad in [f64::NAN, f64::INFINITY, row.max * 1.01 + 1.0, row.min - 1.0] {
            assert!(parameters.set(row.name, bad).is_err(), "{} = {bad}", row.name);
        }
        assert_eq!(parameters, before);
    }
}

#[test]
fn a_lower_limit_above_its_upper_limit_is_refused() {
    let mut parameters = Parameters::default();
    parameters.set("FW_AIRSPD_MAX", 250.0).unwrap();
    assert!(parameters.set("FW_AIRSPD_MIN", 260.0).is_err());
}

#[test]
fn a_value_that_a_limit_would_change_is_refused_with_the_range() {
    let mut parameters = Parameters::default();
    for (name, value, text) in [
        ("RTL_RETURN_ALT", 60.0, "RTL_RETURN_ALT = 60 is outside 500 to 12000 m"),
        ("RTL_RETURN_ALT", 12_001.0, "RTL_RETURN_ALT = 12001 is outside 500 to 12000 m"),
        ("REF_ALT_MIN", 6_000.0, "RTL_RETURN_ALT = 5000 is outside 6000 to 12000 m"),
        ("NAV_BANK_MAX", 60.0, "NAV_BANK_MAX = 60 is outside 1 to 45 deg"),
        ("FTC_MODE", 7.0, "FTC_MODE = 7 is outside 0 to 2"),
        ("REF_ROLL_MAX", 30.0, "NAV_BANK_MAX = 45 is outside 1 to 30 deg"),
    ] {
        assert_eq!(parameters.set(name, value).unwrap_err().to_string(), text);
    }
    parameters.set_all([("REF_ALT_MIN", 6_000.0), ("RTL_RETURN_ALT", 7_000.0)]).unwrap();
}

#[test]
fn a_fraction_of_a_whole_number_is_refused_with_what_is_allowed() {
    let mut parameters = Parameters::default();
    for row in table().iter().filter(|row| row.kind == Kind::Int) {
        let before = parameters;
        let value = 0.3 * row.min + 0.7 * row.max + 0.05;
        let refused = parameters.set(row.name, value).unwrap_err().to_string();
        assert!(refused.starts_with(&format!("{} = {value} is n", row.name)), "{refused}");
        assert_eq!(parameters, before);
    }
    for (name, value, text) in [
        ("CTL_LAW", 1.5, "CTL_LAW = 1.5 is none of 0, 1, 2, 3, 9"),
        ("MAV_SYS_ID", 1.5, "MAV_SYS_ID = 1.5 is no whole number from 1 to 250 -"),
    ] {
        assert_eq!(parameters.set(name, value).unwrap_err().to_string(), text);
    }
}

#[test]
fn no_name_of_a_group_is_longer_than_the_list_of_a_station() {
    // QGroundControl 5.0 cuts longer ones.
    for name in table().iter().map(|row| row.group).chain([COMPATIBILITY_GROUP]) {
        assert!(name.len() <= 20, "{name}");
    }
}

#[test]
fn a_set_outside_lemma_1_is_accepted_with_a_warning() {
    let mut parameters = Parameters::default();
    assert!(parameters.set("OBS_KB", 1.5).unwrap().is_some());
    assert!((parameters.gains.neso.rate_factor - 1.5).abs() < 1e-12);
}
