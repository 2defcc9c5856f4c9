use super::*;
use icd::tvc_jet;

fn refusal(from: &str, to: &str) -> String {
    assert!(aircraft::DEFAULT_AIRFRAME.contains(from), "the file has no {from}");
    let text = aircraft::DEFAULT_AIRFRAME.replacen(from, to, 1);
    Airframe::from_toml("jet.toml", &text).unwrap_err().to_string()
}

#[test]
fn the_airframe_file_of_the_crate_is_good() {
    let airframe = Airframe::from_toml("tvc_jet.toml", aircraft::DEFAULT_AIRFRAME).unwrap();
    assert_eq!(airframe.mass.mass_kg, 9_295.0);
    assert_eq!(airframe.inertia()[(0, 2)], -1_331.0);
    assert_eq!(airframe.servos[tvc_jet::ENGINE].max, 60_000.0);
}

#[test]
fn a_negative_mass_is_refused_with_file_key_value_and_range() {
    assert_eq!(
        refusal("mass_kg = 9295.0", "mass_kg = -1"),
        "jet.toml: [mass] mass_kg = -1 is outside 1 to 1000000"
    );
}

#[test]
fn a_value_that_is_no_number_is_refused() {
    let message = refusal("c_pitch_q = -5.245", "c_pitch_q = nan");
    assert_eq!(message, "jet.toml: [aerodynamics] c_pitch_q = NaN is outside -1000 to 1000");
}

#[test]
fn a_moment_of_inertia_beyond_the_other_two_together_is_refused() {
    assert_eq!(
        refusal("izz_kg_m2 = 85552.0", "izz_kg_m2 = 90000"),
        "jet.toml: [mass] izz_kg_m2 = 90000 is outside 0.001 to 88549"
    );
}

#[test]
fn an_impossible_product_of_inertia_is_refused() {
    assert!(refusal("ixz_kg_m2 = 1331.0", "ixz_kg_m2 = 40000").contains("ixz_kg_m2 = 40000 is"));
}

#[test]
fn a_vane_far_outside_the_aircraft_is_refused() {
    assert_eq!(
        refusal("vanes_m = [7.0,", "vanes_m = [700.0,"),
        "jet.toml: [air_data] vanes_m = 700 is outside -100 to 100"
    );
}

#[test]
fn a_number_of_an_actuator_that_cannot_be_is_refused_with_effector_key_value_and_range() {
    for (key, range) in [
        ("delay_s = 1.5", "delay_s = 1.5 is outside 0 to 1"),
        ("delay_s = nan", "delay_s = NaN is outside 0 to 1"),
        ("deadband_deg = -1", "deadband_deg = -1 is outside 0 to 30"),
        ("hysteresis_deg = 31", "hysteresis_deg = 31 is outside 0 to 30"),
        ("bias_deg = inf", "bias_deg = inf is outside -30 to 30"),
        ("stall_dynamic_pressure_pa = 0", "stall_dynamic_pressure_pa = 0 is outside 1 to 10000000"),
        ("natural_frequency_rad_s = 500", "natural_frequency_rad_s = 500 is outside 0.5 to 200"),
        ("natural_frequency_hz = 5\ndamping_ratio = 0", "damping_ratio = 0 is outside 0.1 to 1.5"),
    ] {
        let message = refusal("name = \"rudder\"", &format!("name = \"rudder\"\n{key}"));
        assert_eq!(message, format!("jet.toml: [effector.rudder] {range}"));
    }
}

#[test]
fn a_key_of_an_actuator_that_has_no_meaning_is_refused() {
    let with = |name: &str, key: &str| {
        refusal(&format!("name = \"{name}\""), &format!("name = \"{name}\"\n{key}"))
    };
    for (name, key) in [
        ("engine", "deadband_deg"),
        ("engine", "hysteresis_deg"),
        ("engine", "bias_deg"),
        ("engine", "stall_dynamic_pressure_pa"),
        ("nozzle pitch", "stall_dynamic_pressure_pa"),
    ] {
        assert_eq!(
            with(name, &format!("{key} = 1.0")),
            format!("jet.toml: effector `{name}`: {key} has no meaning for this kind")
        );
    }
    assert_eq!(
        with("rudder", "damping_ratio = 0.7"),
        "jet.toml: effector `rudder`: damping_ratio has no meaning without natural_frequency_rad_s"
    );
    assert_eq!(
        with("rudder", "natural_frequency_m = 3"),
        "jet.toml: effector.5.natural_frequency_m: the unit m does not fit, expected one of \
         natural_frequency_deg_s, natural_frequency_rad_s, natural_frequency_hz"
    );
    let without = aircraft::DEFAULT_AIRFRAME.replacen("lag_s = 0.05", "", 1);
    assert_eq!(
        Airframe::from_toml("jet.toml", &without).unwrap_err().to_string(),
        "jet.toml: effector `left aileron`: lag_s or natural_frequency_rad_s is missing"
    );
}

#[test]
fn a_second_order_takes_the_place_of_the_lag_with_the_same_delay_of_slow_commands() {
    let text = aircraft::DEFAULT_AIRFRAME.replacen("lag_s = 0.05", "natural_frequency_hz = 5", 1);
    let servo = Airframe::from_toml("jet.toml", &text).unwrap().servos[tvc_jet::LEFT_AILERON];
    let order = servo.second_order.unwrap();
    assert!((order.natural_frequency_rad_s - 31.415_926_535_9).abs() < 1.0e-9);
    assert_eq!(order.damping_ratio, 0.7);
    assert_eq!(servo.lag_s, 2.0 * 0.7 / order.natural_frequency_rad_s);
}

#[test]
fn a_misspelt_key_is_refused_with_its_line() {
    let message = refusal("span_m", "spann_m");
    assert!(message.contains("jet.toml") && message.contains("line"), "{message}");
    assert!(message.contains("spann_m"), "{message}");
}

#[test]
fn a_missing_key_is_named() {
    let message = refusal("c_yaw_beta = 0.075", "");
    assert!(message.contains("c_yaw_beta"), "{message}");
}

#[test]
fn the_effectors_of_the_file_are_those_that_tests_and_studies_name() {
    assert_eq!(Airframe::paper().effectors, tvc_jet::effectors());
    assert_eq!(Airframe::paper().aircraft(), tvc_jet::aircraft());
}

#[test]
fn a_number_of_an_effector_is_refused_with_its_name() {
    assert_eq!(
        refusal("travel_deg = [-25.0, 25.0]", "travel_deg = [-25.0, 250.0]"),
        "jet.toml: [effector.left_aileron] travel_deg (upper end) = 250 is outside 0 to 90"
    );
    assert_eq!(
        refusal("c_drag = 0.015", "c_drag = -1"),
        "jet.toml: [effector.left_aileron] c_drag = -1 is outside 0 to 1000"
    );
}

#[test]
fn a_list_that_cannot_be_is_refused_with_the_effector() {
    assert_eq!(
        refusal("partner = \"left aileron\"", "partner = \"left wing\""),
        "jet.toml: effector `left aileron`: partner = `right aileron` does not name this one as its partner"
    );
    let (name, _) = aircraft::DEFAULT_AIRFRAME.split_once("[[effector]]").unwrap();
    let sixteen_and_one: String = (1..=17)
        .map(|n| {
            format!(
                "[[effector]]\nname = \"flap {n}\"\nkind = \"flap\"\ninstance = {n}\nlag_s = 0.1\n\
            rate_limit_deg_s = 60.0\ntravel_deg = [-1.0, 1.0]\n"
            )
        })
        .collect();
    let (_, behind) = aircraft::DEFAULT_AIRFRAME.split_once("[air_data]").unwrap();
    let text = format!("{name}{sixteen_and_one}[air_data]{behind}");
    assert_eq!(
        Airframe::from_toml("jet.toml", &text).unwrap_err().to_string(),
        "jet.toml: there are more than 16 effectors, expected 1 to 16"
    );
}

#[test]
fn a_key_that_the_kind_lacks_or_does_not_have_is_named() {
    assert_eq!(
        refusal("thrust_min_n = 8000.0", "travel_deg = [0.0, 1.0]"),
        "jet.toml: effector `engine`: thrust_min_n is missing"
    );
    assert_eq!(
        refusal("thrust_min_n = 8000.0", "thrust_min_n = 8000.0\nc_roll = 1.0"),
        "jet.toml: effector `engine`: c_roll has no meaning for what is no surface"
    );
    assert_eq!(
        refusal("kind = \"rudder\"", "kind = \"wheel\""),
        "jet.toml: effector `rudder`: c_drag has no meaning for what is no surface"
    );
}

fn f16_refusal(from: &str, to: &str) -> String {
    assert!(aircraft::F16_AIRFRAME.contains(from), "the file has no {from}");
    Airframe::from_toml("f16.toml", &aircraft::F16_AIRFRAME.replacen(from, to, 1))
        .unwrap_err()
        .to_string()
}

#[test]
fn an_airframe_with_tables_comes_through_json_and_binary_files_to_the_bit() {
    for text in [aircraft::DEFAULT_AIRFRAME, aircraft::F16_AIRFRAME] {
        let airframe = Airframe::from_toml("airframe.toml", text).unwrap();
        let binary = postcard::to_stdvec(&airframe).unwrap();
        assert_eq!(postcard::from_bytes::<Airframe>(&binary).unwrap(), airframe);
        let json = serde_json::to_string(&airframe).unwrap();
        let read: Airframe = serde_json::from_str(&json).unwrap();
        assert_eq!(
            (read.aero.geometry(), read.propulsion),
            (airframe.aero.geometry(), airframe.propulsion)
        );
    }
}

#[test]
fn an_error_in_a_table_is_refused_with_file_table_line_and_expected_value() {
    assert_eq!(
        f16_refusal("\n -5,  0.241", "\n -15,  0.241"),
        "f16.toml: [[aerodynamics.table]] number 1: line 3: alpha_deg = -15, expected more than -10: breakpoints increase"
    );
    assert!(
        f16_refusal("  0, 0.2,  3048,    425\n", "")
            .starts_with("f16.toml: [[propulsion.table]] number 1: line")
    );
    assert_eq!(
        f16_refusal("\"-0.02 beta_deg\"", "\"-0.02 flap_deg\"").split(", expected").next().unwrap(),
        "f16.toml: [aerodynamics.sum] c_y: term \"-0.02 flap_deg\" has flap_deg"
    );
}

#[test]
fn keys_of_derivatives_have_no_meaning_beside_tables() {
    assert_eq!(
        f16_refusal("rate_limit_deg_s = 120.0", "rate_limit_deg_s = 120.0\nc_yaw = -0.1"),
        "f16.toml: effector `rudder`: c_yaw has no meaning beside tables in [aerodynamics]"
    );
    assert_eq!(
        f16_refusal("[limits]", "[mach]\ndesign_mach = 0.5\ngrowth = {}\n[limits]"),
        "f16.toml: [mach] has no meaning beside tables in [aerodynamics]: they have the input mach"
    );
    let message = f16_refusal("area_m2 = 27.870912", "area = 27.870912");
    assert!(
        message.contains("f16.toml") && message.contains("line") && message.contains("area"),
        "{message}"
    );
}
