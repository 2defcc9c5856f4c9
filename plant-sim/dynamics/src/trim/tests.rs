use super::*;
use crate::atmosphere::Atmosphere;
use crate::earth::{Earth, EarthModel};
use crate::{Airframe, WindSettings, wind};

const START: Start = Start {
    altitude_m: 5_000.0,
    airspeed_m_s: 264.0,
    heading_rad: 0.0,
    latitude_rad: 0.8,
    longitude_rad: 0.1,
};

fn trimmed(model: EarthModel, start: Start, wind: WindSettings) -> (Dynamics, Trim) {
    let earth = Earth::new(model, start.geodetic());
    let dynamics = Dynamics::new(Airframe::paper(), earth).unwrap();
    let trim = solve(&dynamics, &start, &wind::steady(&wind)).unwrap();
    (dynamics, trim)
}

fn crosswind() -> WindSettings {
    WindSettings { speed_m_s: 20.0, towards_rad: 1.2, ..WindSettings::default() }
}

#[test]
fn val_the_design_point_is_that_of_the_parameter_set() {
    let (_, trim) = trimmed(EarthModel::Flat, START, WindSettings::default());
    // Printed as 1.997 deg and 27.12 kN.
    assert!((trim.alpha_rad.to_degrees() - 1.997).abs() < 5e-4, "{} rad", trim.alpha_rad);
    assert!((trim.thrust_n - 27_120.0).abs() < 5.0, "{} N", trim.thrust_n);
    // Cm0 was calibrated with a gas constant that differs in the seventh digit.
    assert!(trim.elevator_rad.abs() < 1e-6, "{} rad", trim.elevator_rad);
    assert_eq!(trim.theta_rad, trim.alpha_rad);
}

#[test]
fn on_the_flat_earth_the_lateral_trim_is_exactly_zero() {
    for (heading_rad, wind) in
        [(0.0, WindSettings::default()), (0.0, crosswind()), (2.0, crosswind())]
    {
        let (_, trim) = trimmed(EarthModel::Flat, Start { heading_rad, ..START }, wind);
        let lateral = [trim.aileron_rad, trim.rudder_rad, trim.turn_rate_rad_s];
        if heading_rad == 0.0 {
            assert_eq!(lateral, [0.0; 3], "wind {wind:?}");
        }
        // At other headings the mirror is turned, and rounding shows.
        assert!(lateral.iter().all(|x| x.abs() < 1e-12), "{lateral:?} at {heading_rad} rad");
    }
}

#[test]
fn on_the_rotating_earth_a_slow_turn_balances_the_coriolis_force() {
    let (_, trim) = trimmed(EarthModel::Wgs84, START, WindSettings::default());
    // Northbound, Coriolis pushes right with 2 W V sin(lat): a turn to the right with 2 W sin(lat).
    let expected = 2.0 * crate::earth::ROTATION_RAD_S * libm::sin(START.latitude_rad);
    let turn = trim.turn_rate_rad_s;
    // The rudder that holds the turn and the yaw damping push sideways a little.
    assert!((turn / expected - 1.0).abs() < 0.01, "{turn} instead of {expected} rad/s");
    assert!(trim.aileron_rad.abs() < 1e-3 && trim.rudder_rad.abs() < 1e-3, "{trim:?}");
}

#[test]
fn trim_flies_level_at_the_airspeed_in_any_steady_wind() {
    for model in [EarthModel::Flat, EarthModel::Wgs84] {
        let updraught = WindSettings { down_m_s: -3.0, ..crosswind() };
        for wind in [WindSettings::default(), crosswind(), updraught] {
            let (dynamics, trim) = trimmed(model, START, wind);
            let state = trim.state();
            let air = wind::steady(&wind);
            let density = LocalDensity::of(&Atmosphere::STANDARD, 5_000.0);
            let (rigid, gust) = (&state.rigid, Gust::none());
            let e = dynamics.evaluate(rigid, &state.positions, &air, &gust, &density);
            let ground = e.place.e_from_ned.tr_mul(&e.motion.derivative.position);
            // On WGS-84 the vertical of the position comes from Bowring's formula, good to 1e-12 rad.
            assert!(ground.z.abs() < 1e-9, "{model:?} sinks with {} m/s", ground.z);
            assert!((e.motion.air.airspeed_m_s - 264.0).abs() < 1e-11);
            assert!(e.motion.air.beta_rad.abs() < 1e-13, "sideslip {} rad", e.motion.air.beta_rad);
            assert!(e.motion.derivative.rates.0.norm() < 1e-10);
        }
    }
}

#[test]
fn a_flight_that_is_too_slow_is_refused_with_the_reason() {
    let start = Start { airspeed_m_s: 60.0, ..START };
    let earth = Earth::new(EarthModel::Flat, start.geodetic());
    let dynamics = Dynamics::new(Airframe::paper(), earth).unwrap();
    let error = solve(&dynamics, &start, &Ned::zero()).unwrap_err().to_string();
    assert!(error.contains("level flight"), "{error}");
    assert!(error.contains("w' = ") || error.contains("is outside"), "{error}");
}

/// The F-16 over the flat Earth at this altitude and airspeed.
fn f16(altitude_m: f64, airspeed_m_s: f64) -> Result<Trim, Problem> {
    let airframe = Airframe::from_toml("f16.toml", aircraft::F16_AIRFRAME).unwrap();
    let start = Start { altitude_m, airspeed_m_s, ..START };
    let earth = Earth::new(EarthModel::Flat, start.geodetic());
    solve(&Dynamics::new(airframe, earth).unwrap(), &start, &Ned::zero())
}

#[test]
fn an_aircraft_of_tables_is_trimmed_where_it_flies() {
    for (altitude_m, airspeed_m_s) in [
        (1_500.0, 150.0),
        (4_000.0, 180.0),
        (8_000.0, 175.0),
        (1_500.0, 90.0),
        (500.0, 200.0),
        (10_000.0, 250.0),
    ] {
        let trim = f16(altitude_m, airspeed_m_s).unwrap();
        assert_eq!([trim.aileron_rad, trim.rudder_rad], [0.0; 2]);
        // The lift of a whole aircraft is near 3.6 per radian; thrust and elevators carry a little.
        let pressure = 0.5 * Atmosphere::STANDARD.air(altitude_m).density * airspeed_m_s.powi(2);
        let alpha = 9_298.6 * 9.81 / (pressure * 27.87 * 3.6);
        assert!((trim.alpha_rad - alpha).abs() < 0.03, "{trim:?}");
    }
}

#[test]
fn a_flight_that_is_not_possible_is_refused_with_the_quantity_that_is_at_its_limit() {
    let refusal = |altitude_m, airspeed_m_s| f16(altitude_m, airspeed_m_s).unwrap_err().to_string();
    // Below the speed of the stall, and without the thrust for it.
    let slow = refusal(1_500.0, 60.0);
    assert!(
        slow.contains("60 m/s and 1500 m needs") && slow.contains("angle_of_attack_deg = "),
        "{slow}"
    );
    let fast = refusal(1_500.0, 700.0);
    assert!(fast.contains("thrust_n = ") && fast.contains(" is outside "), "{fast}");
}

#[test]
fn the_nearest_flight_names_the_limits_and_the_residual() {
    let airframe = Airframe::from_toml("f16.toml", aircraft::F16_AIRFRAME).unwrap();
    let start = Start { altitude_m: 1_500.0, airspeed_m_s: 60.0, ..START };
    let earth = Earth::new(EarthModel::Flat, start.geodetic());
    let dynamics = Dynamics::new(airframe, earth).unwrap().with_any_thrust();
    let search = LevelSearch {
        dynamics: &dynamics,
        start: &start,
        wind: &Ned::zero(),
        total_wind: Ned::zero(),
        climb_rad: 0.0,
        density: LocalDensity::of(&Atmosphere::STANDARD, 1_500.0),
        altitude_m: 1_500.0,
        sideslip_max_rad: 0.0,
    };
    let (_, residual, text) = search.nearest();
    assert!(text.starts_with("the angle of attack is at its limit of 25 deg, and u' = "), "{text}");
    // It sinks: the acceleration down is positive.
    assert!(residual[2] > 0.01, "{text}");
}

/// The Aerosonde, its file changed, at its design point over this Earth.
fn aerosonde(model: EarthModel, change: impl Fn(String) -> String) -> Result<Trim, Problem> {
    let text = change(aircraft::AEROSONDE_AIRFRAME.to_owned());
    let airframe = Airframe::from_toml("changed.toml", &text)?;
    let start = airframe.design_point;
    let earth = Earth::new(model, start.geodetic());
    solve(&Dynamics::new(airframe, earth).unwrap(), &start, &Ned::zero())
}

/// Without the `[[effector]]` of this name.
fn without(text: &str, name: &str) -> String {
    let parts: Vec<&str> = text.split("[[effector]]\n").collect();
    let kept = parts.iter().filter(|part| !part.starts_with(&format!("name = \"{name}\"")));
    kept.copied().collect::<Vec<_>>().join("[[effector]]\n")
}

#[test]
fn without_a_rudder_the_sideslip_balances_the_yaw_and_with_one_there_is_none() {
    for model in [EarthModel::Flat, EarthModel::Wgs84] {
        let whole = aerosonde(model, |text| text).unwrap();
        assert_eq!(whole.beta_rad, 0.0);
        assert!(whole.rudder_rad != 0.0, "it balances the torque of the propeller");
        let trim = aerosonde(model, |text| without(&text, "rudder")).unwrap();
        assert_eq!(trim.rudder_rad, 0.0);
        // The adverse yaw of the aileron that holds the torque, over the weathercock stability: some tenths of a degree.
        let beta_deg = trim.beta_rad.to_degrees().abs();
        assert!((1.0e-3..1.0).contains(&beta_deg), "{beta_deg} deg");
        assert!((trim.thrust_n / whole.thrust_n - 1.0).abs() < 0.01, "{} N", trim.thrust_n);
    }
}

#[test]
fn elevons_a_v_tail_one_elevator_and_a_canard_are_trimmed_like_the_aircraft_with_elevators() {
    let whole = aerosonde(EarthModel::Wgs84, |text| text).unwrap();
    // The ailerons pitch as well, with a tenth of the moment of the elevators, which are gone.
    let elevons = |text: String| {
        let text = without(&without(&without(&text, "rudder"), "left elevator"), "right elevator");
        let text = text.replace("gains = { roll = -1.0 }", "gains = { roll = -1.0, pitch = 1.0 }");
        let text = text.replace("gains = { roll = 1.0 }", "gains = { roll = 1.0, pitch = 1.0 }");
        text.replace("c_side = 0.0375 ", "c_pitch = -0.495\nc_side = 0.0375 ")
            .replace("c_side = -0.0375", "c_pitch = -0.495\nc_side = -0.0375")
    };
    // Each panel has a part of the rudder's moment; both together pitch.
    let v_tail = |text: String| {
        without(&text, "rudder")
            .replacen("gains = { pitch = 1.0 }", "gains = { pitch = 1.0, yaw = 1.0 }", 1)
            .replacen("gains = { pitch = 1.0 }", "gains = { pitch = 1.0, yaw = -1.0 }", 1)
            .replace("c_roll = 0.0045 ", "c_yaw = -0.035\nc_side = 0.1\nc_roll = 0.0045 ")
            .replace("c_roll = -0.0045", "c_yaw = 0.035\nc_side = -0.1\nc_roll = -0.0045")
    };
    let one = |text: String| {
        let text = without(&text, "right elevator").replace("partner = \"right elevator\"\n", "");
        text.replace(
            "name = \"left elevator\"\nkind = \"elevator\"\nside = \"left\"",
            "name = \"elevator\"\nkind = \"elevator\"",
        )
        .replace("c_pitch = -0.495", "c_pitch = -0.99")
    };
    let canard = |text: String| {
        one(text)
            .replace("kind = \"elevator\"", "kind = \"canard\"")
            .replace("gains = { pitch = 1.0 }", "gains = { pitch = -1.0 }")
            .replace("c_pitch = -0.99", "c_pitch = 0.99")
    };
    for (name, change) in [
        ("elevons", &elevons as &dyn Fn(String) -> String),
        ("V-tail", &v_tail),
        ("one elevator", &one),
        ("canard", &canard),
    ] {
        let trim = aerosonde(EarthModel::Wgs84, change).unwrap();
        // The lift of the surfaces differs, that of a canard in its sign: this changes the angle of attack by 0.005 rad at most.
        assert!((trim.elevator_rad - whole.elevator_rad).abs() < 0.015, "{name}: {trim:?}");
        assert!(trim.beta_rad.abs() < 0.02, "{name}: {trim:?}");
        assert_eq!(trim.beta_rad == 0.0, trim.rudder_rad != 0.0, "{name}: {trim:?}");
    }
}

#[test]
fn a_refusal_names_what_the_aircraft_lacks() {
    let refusal = |change: &dyn Fn(String) -> String| {
        aerosonde(EarthModel::Flat, change).unwrap_err().to_string()
    };
    let no_pitch = refusal(&|text| without(&without(&text, "left elevator"), "right elevator"));
    assert!(no_pitch.contains("200 m: no effector pitches, "), "{no_pitch}");
    // The engine's table is the last of the effectors, and that of its propeller goes with it.
    let no_engine = refusal(&|text| {
        let end = text.find("[air_data]").unwrap();
        format!("{}{}", without(&text, "engine"), &text[end..])
    });
    assert!(no_engine.contains("no engine, "), "{no_engine}");
    assert!(!no_engine.contains("singular"), "{no_engine}");
}
