//! Parts torn off, fuel that burns, and what the nozzle can do with the thrust that is left.

use super::*;
use crate::damage::Fuel;
use icd::fault::AirframePart;

fn torn(part: AirframePart, lost: f64) -> ScheduledFault {
    ScheduledFault { target: part.into(), kind: FaultKind::TornOff { lost }, timing: Timing::NOW }
}

/// Fuel that is left, kg; `None` for an aircraft whose mass stays.
fn fuel_kg(plant: &Plant) -> Option<f64> {
    let fuel = plant.dynamics.airframe().fuel?;
    Some((fuel.initial_kg - plant.losses.burnt_kg).max(0.0))
}

#[test]
fn damage_takes_mass_and_the_aircraft_flies_on_from_its_new_centre_of_gravity() {
    for part in AirframePart::ALL {
        let mut plant = plant(&flat());
        coast(&mut plant, 100);
        let (before, mass_kg) = (*plant.truth(), plant.dynamics().mass().mass_kg);
        let request = FaultRequest::Inject {
            target: part.into(),
            kind: FaultKind::TornOff { lost: 0.5 },
            timing: Timing::NOW,
        };
        assert!(matches!(plant.request(&request), FaultReply::Applied { .. }), "{part:?}");
        let lost_kg = mass_kg - plant.dynamics().mass().mass_kg;
        assert!((10.0..300.0).contains(&lost_kg), "{part:?}: {lost_kg} kg");
        let shift_m = plant.dynamics().shift_m();
        let moved = (plant.truth().position.0 - before.position.0).norm();
        // The attitude turns lengths and does not change them.
        assert!((moved - shift_m.norm()).abs() < 1.0e-6, "{part:?}: {moved} m, {shift_m:?}");
        assert!(plant.truth().angular_acceleration.0.norm() > 1.0e-3, "{part:?} is felt");
        let clear = FaultRequest::Clear { target: part.into() };
        assert!(matches!(plant.request(&clear), FaultReply::Cleared { .. }));
        assert_eq!(plant.dynamics().mass().mass_kg.to_bits(), mass_kg.to_bits(), "whole again");
    }
}

#[test]
fn a_part_that_goes_slowly_takes_the_ramp_and_several_parts_go_together() {
    let mut setup = flat();
    let half_s = Timing { ramp_s: 0.5, ..Timing::NOW };
    setup.faults = vec![
        ScheduledFault { timing: half_s, ..torn(AirframePart::LeftTail, 1.0) },
        torn(AirframePart::Fin, 0.2),
    ];
    let mut plant = plant(&setup);
    let mut last = plant.dynamics().mass().mass_kg;
    for _ in 0..10 {
        coast(&mut plant, 20);
        let now = plant.dynamics().mass().mass_kg;
        assert!(now < last, "{now} kg");
        last = now;
    }
    coast(&mut plant, 60);
    let gone = setup.airframe.mass.mass_kg - plant.dynamics().mass().mass_kg;
    // All of a tail half, 0.65 % of the mass, and the outer fifth of the span of the fin, which has 1.3 %.
    let fin = 0.013 * 0.2 * (2.0 * 0.44 + 0.56 * 0.2) / 1.44;
    assert!((gone / setup.airframe.mass.mass_kg - 0.0065 - fin).abs() < 1.0e-9, "{gone} kg");
}

#[test]
fn a_part_that_the_airframe_does_not_describe_is_refused() {
    let mut setup = flat();
    setup.airframe.damage.fin = None;
    setup.faults = vec![torn(AirframePart::Fin, 0.2)];
    let error = Plant::new(&setup).unwrap_err().to_string();
    assert!(error.contains("fin, torn off") && error.contains("[damage]"), "{error}");
    // Too light for the loss of all parts: none can go, so that no two of them leave an impossible body.
    let mut light = flat();
    light.airframe.mass.ixx_kg_m2 = 4_000.0;
    assert!(light.airframe.parts().iter().all(|can_go| !can_go));
    setup.faults.clear();
    let mut plant = plant(&setup);
    for (target, kind) in [
        (AirframePart::Fin.into(), FaultKind::TornOff { lost: 0.2 }),
        (AirframePart::LeftWing.into(), FaultKind::StuckHere),
        (AirframePart::LeftWing.into(), FaultKind::TornOff { lost: 1.2 }),
        (AirframePart::LeftWing.into(), FaultKind::TornOff { lost: f64::NAN }),
        (tvc_jet::RUDDER.into(), FaultKind::TornOff { lost: 0.2 }),
    ] {
        let reply = plant.request(&FaultRequest::Inject { target, kind, timing: Timing::NOW });
        assert!(matches!(reply, FaultReply::Refused(_)), "{target:?} {kind:?}: {reply:?}");
    }
}

fn with_fuel(mass_kg: f64) -> PlantSetup {
    let mut setup = flat();
    let fuel = Fuel { initial_kg: mass_kg, at_m: [-1.0, 0.0, 0.2], flow_kg_n_s: 2.0e-5 };
    setup.airframe.fuel = Some(fuel);
    setup
}

#[test]
fn fuel_burns_with_the_thrust_and_takes_mass_inertia_and_the_centre_of_gravity_with_it() {
    let setup = with_fuel(2_000.0);
    let mut plant = plant(&setup);
    let whole = *plant.dynamics().mass();
    coast(&mut plant, 5_000);
    let thrust_n = plant.trim().positions()[tvc_jet::ENGINE];
    let burnt_kg = 2_000.0 - fuel_kg(&plant).expect("it has a tank");
    // The thrust of the trim, held for ten seconds.
    assert!((burnt_kg - 2.0e-5 * thrust_n * 10.0).abs() < 0.02, "{burnt_kg} kg");
    let mass = plant.dynamics().mass();
    assert!((whole.mass_kg - mass.mass_kg - burnt_kg).abs() < 1.0e-9);
    assert!(mass.inertia[(1, 1)] < whole.inertia[(1, 1)]);
    // The tanks are behind: what is left is ahead.
    assert!(plant.dynamics().shift_m().x > 0.0);
    assert_eq!(fuel_kg(&super::plant(&flat())), None, "an aircraft whose mass stays");
}

#[test]
fn without_fuel_the_engine_is_out_and_no_repair_brings_it_back() {
    let mut plant = plant(&with_fuel(1.0));
    coast(&mut plant, 5_000);
    assert_eq!(fuel_kg(&plant), Some(0.0));
    let is_out = |plant: &Plant| {
        matches!(plant.faults.active(tvc_jet::ENGINE), Some((FaultKind::FlameOut, _)))
    };
    assert!(is_out(&plant));
    assert!(plant.truth().deflections[tvc_jet::ENGINE] < 100.0);
    let reports: Vec<PlantReport> = std::iter::from_fn(|| plant.pop_report()).collect();
    let is_flame_out = |report: &PlantReport| matches!(report, PlantReport::Fault(entry) if entry.kind == FaultKind::FlameOut);
    assert!(reports.iter().any(is_flame_out), "{reports:?}");
    plant.request(&FaultRequest::ClearAll);
    coast(&mut plant, 2);
    assert!(is_out(&plant), "the tank is still empty");
}

#[test]
fn a_tank_that_cannot_be_is_refused() {
    for (mass_kg, flow, word) in [
        (9_000.0, 2.0e-5, "initial_kg"),
        (f64::NAN, 2.0e-5, "initial_kg"),
        (100.0, -1.0, "flow_kg_n_s"),
    ] {
        let mut setup = with_fuel(mass_kg);
        setup.airframe.fuel.as_mut().expect("it has one").flow_kg_n_s = flow;
        let error = Plant::new(&setup).unwrap_err().to_string();
        assert!(error.contains("fuel") && error.contains(word), "{error}");
    }
}

#[test]
fn the_nozzle_turns_the_aircraft_in_proportion_to_the_thrust() {
    // Angular acceleration of 0.1 rad of nozzle, in pitch and yaw, with the thrust held.
    let effect = |thrust_n: f64| {
        let of = |pitch: f64, yaw: f64| {
            let mut plant = plant(&flat());
            let mut controls = plant.controls();
            controls.positions[tvc_jet::ENGINE] = thrust_n;
            controls.positions[tvc_jet::NOZZLE_PITCH] = pitch;
            controls.positions[tvc_jet::NOZZLE_YAW] = yaw;
            plant.set_controls(&controls);
            plant.truth().angular_acceleration.0
        };
        let straight = of(0.0, 0.0);
        [(of(0.1, 0.0) - straight).y, (of(0.0, 0.1) - straight).z]
    };
    let (full, half, none) = (effect(40_000.0), effect(20_000.0), effect(0.0));
    for axis in 0..2 {
        assert!(full[axis] > 0.1, "{full:?} rad/s2");
        assert!((half[axis] / full[axis] - 0.5).abs() < 1.0e-9, "{half:?} {full:?}");
        assert!(none[axis].abs() < 1.0e-12, "{none:?}");
    }
}
