//! Aircraft other than the paper's: without a nozzle, with a single surface without partner, with twelve effectors, without
//! an engine. Each is the paper's jet with other effectors.

use icd::fault::{FaultKind, FaultReply, FaultRequest, Refusal, Timing};
use icd::{Actuators, Effector, EffectorKind, LateralSide, PerEffector};

use crate::tests::nominal;
use crate::{Airframe, EarthModel, Plant, PlantSetup};
use aircraft::DEFAULT_AIRFRAME;
use scenarios::NOMINAL;

/// The text before the first effector, that of each effector, and that after the last one.
fn parts() -> (String, Vec<String>, String) {
    let (before, rest) = DEFAULT_AIRFRAME.split_once("[[effector]]").unwrap();
    let (effectors, behind) = rest.split_once("[nozzle]").unwrap();
    let effectors = effectors.split("[[effector]]").map(|text| format!("[[effector]]{text}"));
    (before.to_owned(), effectors.collect(), format!("[nozzle]{behind}"))
}

fn airframe(effectors: &[String], has_nozzle: bool) -> Airframe {
    let (before, _, behind) = parts();
    let behind = match behind.split_once("# From the centre") {
        Some((_, air_data)) if !has_nozzle => air_data.split_once('\n').unwrap().1.to_owned(),
        _ => behind,
    };
    // The parts that can be torn off have surfaces that it may lack.
    let (nozzle, rest) = behind.split_once("\n[damage.").unwrap();
    let (_, rest) = rest.split_once("[design_point]").unwrap();
    let text = format!("{before}{}{nozzle}\n[design_point]{rest}", effectors.concat());
    Airframe::from_toml("other.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

fn setup(airframe: Airframe) -> PlantSetup {
    PlantSetup { earth: EarthModel::Flat, ..nominal(&airframe, 1_000) }
}

/// Checks that it is trimmed, flies its trim for a second, and follows each effector.
fn flies(airframe: &Airframe) {
    let setup = setup(airframe.clone());
    let mut plant = Plant::new(&setup).unwrap_or_else(|error| panic!("{error}"));
    let trim = plant.trim().positions();
    for _ in 0..500 {
        plant.advance(&Actuators::new(trim));
        let sensors = plant.sense();
        assert!(sensors.to_array().iter().all(|value| value.is_finite()));
    }
    let truth = plant.truth();
    assert!((truth.airspeed_m_s - 264.0).abs() < 1.0e-3, "{} m/s", truth.airspeed_m_s);
    assert!((truth.altitude_m - 5_000.0).abs() < 1.0e-3, "{} m", truth.altitude_m);
    let list = &airframe.effectors;
    for effector in list.all().filter(|effector| list.is_angle(*effector)) {
        let mut plant = Plant::new(&setup).unwrap();
        let mut commands = trim;
        commands[effector] += 0.02;
        for _ in 0..200 {
            plant.advance(&Actuators::new(commands));
        }
        let (moved, still) = (plant.truth(), &truth);
        let name = list.name(effector);
        assert!((moved.positions[effector] - trim[effector] - 0.02).abs() < 1.0e-3, "{name}");
        let turned = (moved.body_rates.0 - still.body_rates.0).norm();
        let lifted = (moved.specific_force.0 - still.specific_force.0).norm();
        assert!(turned > 1.0e-6 || lifted > 1.0e-6, "{name} does nothing");
        for beyond in Effector::first(Effector::MAX).skip(list.len()) {
            assert_eq!((moved.positions[beyond], moved.deflections[beyond]), (0.0, 0.0));
        }
    }
}

/// A surface of no aircraft, by its name.
fn surface(
    name: &str,
    kind: &str,
    side: &str,
    partner: &str,
    instance: usize,
    more: &str,
) -> String {
    let partner =
        if partner.is_empty() { String::new() } else { format!("partner = \"{partner}\"\n") };
    format!(
        "[[effector]]\nname = \"{name}\"\nkind = \"{kind}\"\nside = \"{side}\"\n{partner}instance = {instance}\n\
         lag_s = 0.05\nrate_limit_deg_s = 60.0\ntravel_deg = [-5.0, 30.0]\n{more}\n\n"
    )
}

#[test]
fn an_aircraft_without_a_nozzle_flies_and_its_thrust_is_along_x() {
    let (_, mut effectors, _) = parts();
    effectors.drain(5..7);
    let airframe = airframe(&effectors, false);
    assert_eq!((airframe.effectors.len(), airframe.nozzle), (6, None));
    flies(&airframe);
}

#[test]
fn a_nozzle_without_its_arm_is_refused() {
    let (before, effectors, behind) = parts();
    let (_, air_data) = behind.split_once("# From the centre").unwrap();
    let (_, air_data) = air_data.split_once('\n').unwrap();
    let text = format!("{before}{}{air_data}", effectors.concat());
    assert_eq!(
        Airframe::from_toml("jet.toml", &text).unwrap_err().to_string(),
        "jet.toml: effector `nozzle pitch`: [nozzle] is missing, and a nozzle needs its arm_m and thrust_floor_n"
    );
}

#[test]
fn a_surface_on_one_side_alone_flies_and_turns_the_aircraft() {
    let (_, mut effectors, _) = parts();
    effectors.push(surface(
        "left spoiler",
        "spoiler",
        "left",
        "",
        8,
        "c_lift = -0.05\nc_roll = -0.01\nc_drag = 0.05",
    ));
    let airframe = airframe(&effectors, true);
    let spoiler = airframe.effectors.find(EffectorKind::Spoiler, LateralSide::Left).unwrap();
    assert_eq!(airframe.effectors.mirrored(spoiler), spoiler);
    flies(&airframe);
}

#[test]
fn an_aircraft_with_twelve_effectors_flies() {
    let (_, mut effectors, _) = parts();
    for (side, other, instance, sign) in [("left", "right", 8, ""), ("right", "left", 9, "-")] {
        let more = format!("c_lift = 0.2\nc_roll = {sign}0.02\nc_drag = 0.1");
        effectors.push(surface(
            &format!("{side} flap"),
            "flap",
            side,
            &format!("{other} flap"),
            instance,
            &more,
        ));
    }
    for (side, other, instance, sign) in [("left", "right", 10, ""), ("right", "left", 11, "-")] {
        let more = format!("c_lift = 0.1\nc_pitch = 0.05\nc_roll = {sign}0.005");
        effectors.push(surface(
            &format!("{side} canard"),
            "canard",
            side,
            &format!("{other} canard"),
            instance,
            &more,
        ));
    }
    let airframe = airframe(&effectors, true);
    assert_eq!((airframe.effectors.len(), airframe.effectors.pairs().count()), (12, 4));
    flies(&airframe);
}

#[test]
fn without_ailerons_and_rudder_level_flight_is_found_all_the_same() {
    let (_, effectors, _) = parts();
    let effectors = [effectors[2].clone(), effectors[3].clone(), effectors[7].clone()];
    flies(&airframe(&effectors, false));
}

#[test]
fn a_fault_of_an_effector_that_the_aircraft_lacks_is_refused() {
    let mut plant = Plant::new(&setup(Airframe::paper())).unwrap();
    let effector = Effector::from_index(8).unwrap();
    let inject = FaultRequest::Inject {
        target: effector.into(),
        kind: FaultKind::Float,
        timing: Timing::NOW,
    };
    let refused = FaultReply::Refused(Refusal::NoSuchEffector { count: 8 });
    assert_eq!(plant.request(&inject), refused);
    assert_eq!(plant.request(&FaultRequest::Clear { target: effector.into() }), refused);
    let text = format!(
        "{NOMINAL}\n[[plant.fault]]\neffector = \"left_flap\"\nkind = \"float\"\nonset_s = 1.0\n"
    );
    let error =
        plant_sim::Scenario::from_toml("my.toml", &text, &Airframe::paper().effectors).unwrap_err();
    assert_eq!(
        error.to_string(),
        "my.toml: [[plant.fault]] number 1: effector = `left_flap`, the aircraft has only left_aileron, right_aileron, \
         left_elevator, right_elevator, rudder, nozzle_pitch, nozzle_yaw, engine"
    );
}

#[test]
fn commands_beyond_the_effectors_of_the_aircraft_change_nothing() {
    let fly = |beyond: f64| {
        let mut plant = Plant::new(&setup(Airframe::paper())).unwrap();
        let trim = plant.trim().positions();
        let commands = PerEffector::from_fn(|e| if e.index() < 8 { trim[e] } else { beyond });
        for _ in 0..100 {
            plant.advance(&Actuators::new(commands));
        }
        *plant.truth()
    };
    assert_eq!(fly(0.0), fly(1.0e9));
}
