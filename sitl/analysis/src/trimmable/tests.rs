//! The limits that an independent model of the same aircraft has (SLSQP over the same sets, published parameters).

use super::*;

fn study() -> Study {
    Study::new(Airframe::paper(), sets::read("sets.toml", sets::SHIPPED).unwrap()).unwrap()
}

fn place(study: &Study, key: &str) -> usize {
    let list = &study.airframe().effectors;
    study.effectors().iter().position(|effector| list.key(*effector) == key).unwrap()
}

/// Limits of an effector in a set, deg.
fn limits(study: &Study, key: &str, set: &str, margin: bool) -> [f64; 2] {
    let set = study.sets.iter().position(|one| one.key == set).unwrap();
    let searches = study.searches();
    let search = searches.iter().find(|(s, m, _)| (*s, *m) == (set, margin)).unwrap();
    let effector = place(study, key);
    let sweep = study.sweep(set, margin, &search.2, effector, 1.0);
    sweep.limits.unwrap().map(|at| study.shown(effector, at))
}

#[test]
fn the_rudder_of_the_paper_can_jam_as_far_as_an_independent_model_says() {
    let study = study();
    let known = [
        ("straight_level", 18.2, 13.8),
        ("bank_15", 20.9, 17.4),
        ("straight", 27.2, 23.3),
        ("any", 30.0, 30.0),
    ];
    let mut wrong: Vec<String> = Vec::new();
    for (set, bare, margin) in known {
        for (with_margin, known) in [(false, bare), (true, margin)] {
            let limits = limits(&study, "rudder", set, with_margin);
            for (limit, sign) in limits.into_iter().zip([-1.0, 1.0]) {
                if (sign * limit - known).abs() > 0.35 {
                    wrong.push(format!("{set} {with_margin}: {limits:?}, known {known}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_flight_that_is_found_is_steady_and_inside_its_set() {
    let study = study();
    let searches = study.searches();
    let rudder = place(&study, "rudder");
    let (set, _, search) = &searches[0];
    let flight = search.jammed(&[(rudder, 0.2)]).find(&[]).unwrap();
    assert_eq!(study.sets[*set].key, "straight_level");
    assert!((flight.airspeed_m_s - study.airframe().design_point.airspeed_m_s).abs() < 1.0e-9);
    assert_eq!((flight.climb_rad, flight.turn_rate_rad_s), (0.0, 0.0));
    assert!(flight.bank_rad.abs() <= 45.0_f64.to_radians());
    assert_eq!(flight.positions.first(8)[rudder], 0.2);
}

#[test]
fn the_healthy_authority_is_that_of_the_independent_model() {
    // Coefficients .0238, .0459 and .0506 at q = 0.5 rho V^2 of 264 m/s and 5000 m.
    let study = study();
    let design = study.airframe().design_point;
    let searches = study.searches();
    let authority = searches[0].2.authority(&study.trim);
    let density =
        plant_sim::atmosphere::LocalDensity::around(design.altitude_m).at(design.altitude_m);
    let geometry = study.airframe().aero.geometry();
    let qs = 0.5 * density * design.airspeed_m_s.powi(2) * geometry.area_m2;
    let coefficients = [
        authority.x / (qs * geometry.span_m),
        authority.y / (qs * geometry.chord_m),
        authority.z / (qs * geometry.span_m),
    ];
    for (found, known) in coefficients.into_iter().zip([0.0238, 0.0459, 0.0506]) {
        assert!((found / known - 1.0).abs() < 0.05, "{coefficients:?}");
    }
}

#[test]
fn two_jams_at_once_leave_what_the_independent_model_says() {
    // Straight and level with the left elevator at 30 deg: rudder from -15.1 to 18.2 deg.
    let study = study();
    let searches = study.searches();
    let jams = |rudder_deg: f64| {
        let elevator = (place(&study, "left_elevator"), 30.0_f64.to_radians());
        let rudder = (place(&study, "rudder"), rudder_deg.to_radians());
        searches[0].2.jammed(&[elevator, rudder]).find_thoroughly(&[]).is_some()
    };
    assert_eq!([-16.0, -14.5, 17.7, 19.0].map(jams), [false, true, true, false]);
}

#[test]
fn other_aircraft_have_limits_too() {
    let text = include_str!("../../../../plant-sim/airframes/aerosonde.toml");
    let airframe = Airframe::from_toml("aerosonde.toml", text).unwrap();
    let study = Study::new(airframe, sets::read("sets.toml", sets::SHIPPED).unwrap()).unwrap();
    let limits = limits(&study, "rudder", "any", false);
    assert!(limits[0] < -1.0 && limits[1] > 1.0, "{limits:?}");
}
