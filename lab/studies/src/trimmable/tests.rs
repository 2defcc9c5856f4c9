//! The limits that an independent model of the same aircraft has (SLSQP over the same sets, published parameters).

use super::*;
use plant_sim::ReadAirframe as _;

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
    let air = plant_sim::atmosphere::Atmosphere::STANDARD;
    let density =
        plant_sim::atmosphere::LocalDensity::of(&air, design.altitude_m).at(design.altitude_m);
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

/// Whether a steady flight exists with these two jams, deg, in a set, without or with the margin.
fn leave_a_flight(
    study: &Study,
    (set, margin): (&str, bool),
    [one, other]: [(&str, f64); 2],
) -> bool {
    let set = study.sets.iter().position(|known| known.key == set).unwrap();
    let searches = study.searches();
    let (.., search) = searches.iter().find(|(s, m, _)| (*s, *m) == (set, margin)).unwrap();
    let jams = [one, other].map(|(key, deg)| (place(study, key), deg.to_radians()));
    search.jammed(&jams).find_thoroughly(&[]).is_some()
}

#[test]
fn with_a_jammed_elevator_the_rudder_can_jam_as_far_as_the_independent_model_says() {
    // Left elevator, then the range of the rudder, all deg.
    let known = [
        ("straight_level", false, -30.0, [-18.2, 15.5]),
        ("straight_level", true, -30.0, [-13.3, 10.6]),
        ("straight_level", false, 0.0, [-15.5, 15.7]),
        ("straight_level", true, 0.0, [-10.9, 10.7]),
        ("straight_level", false, 30.0, [-15.1, 18.2]),
        ("straight_level", true, 30.0, [-10.1, 13.8]),
        ("bank_15", false, -30.0, [-20.5, 18.2]),
        ("bank_15", true, -30.0, [-17.0, 10.8]),
        ("bank_15", false, 0.0, [-20.7, 20.8]),
        ("bank_15", true, 0.0, [-16.2, 16.0]),
        ("bank_15", false, 30.0, [-18.4, 20.8]),
        ("bank_15", true, 30.0, [-10.5, 17.4]),
        ("any", true, -30.0, [-30.0, 22.9]),
        ("any", true, 0.0, [-29.6, 30.0]),
        ("any", true, 30.0, [-19.9, 30.0]),
    ];
    // Inside as for the rudder alone. Outside more where a tenth of the authority is left: ours is up to 5 % smaller.
    let tolerances_deg = |margin| [0.35, if margin { 0.7 } else { 0.35 }];
    let study = study();
    let exists = |set, elevator_deg, rudder_deg| {
        leave_a_flight(&study, set, [("left_elevator", elevator_deg), ("rudder", rudder_deg)])
    };
    let wrong = runner::map_quietly("pairs", &known, |&(set, margin, elevator_deg, limits)| {
        let mut wrong = Vec::new();
        for (limit, sign) in limits.into_iter().zip([-1.0, 1.0]) {
            let [below, beyond] = tolerances_deg(margin);
            let (inside, outside) = (limit - sign * below, limit + sign * beyond);
            if !exists((set, margin), elevator_deg, inside) {
                wrong.push(format!("{set} {margin} {elevator_deg}: no flight at {inside} deg"));
            }
            let is_inside = limit.abs() < 29.9;
            if is_inside && exists((set, margin), elevator_deg, outside) {
                wrong.push(format!("{set} {margin} {elevator_deg}: a flight at {outside} deg"));
            }
        }
        wrong
    });
    assert!(wrong.iter().all(Vec::is_empty), "{:#?}", wrong.concat());
}

#[test]
fn two_ailerons_or_two_elevators_leave_a_flight_wherever_the_independent_model_has_one() {
    let study = study();
    for set in ["straight_level", "straight", "bank_15", "any"] {
        for margin in [false, true] {
            for (left, right) in [(25.0, 25.0), (25.0, -25.0), (-25.0, 0.0), (10.0, -25.0)] {
                let jams = [("left_aileron", left), ("right_aileron", right)];
                assert!(leave_a_flight(&study, (set, margin), jams), "{set} {margin}: {jams:?}");
            }
        }
    }
    for at in [-30.0, -20.0, 10.0, 20.0, 30.0] {
        let jams = [("left_elevator", at), ("right_elevator", at)];
        assert!(leave_a_flight(&study, ("straight_level", false), jams), "{at} deg");
    }
}

#[test]
fn other_aircraft_have_limits_too() {
    let text = aircraft::AEROSONDE_AIRFRAME;
    let airframe = Airframe::from_toml("aerosonde.toml", text).unwrap();
    let study = Study::new(airframe, sets::read("sets.toml", sets::SHIPPED).unwrap()).unwrap();
    let limits = limits(&study, "rudder", "any", false);
    assert!(limits[0] < -1.0 && limits[1] > 1.0, "{limits:?}");
}

/// The search finds the engine's end at 8000 m and 230 m/s in a turn of 30 deg a little further with a margin than without.
#[test]
fn no_limit_is_wider_with_a_margin_than_without() {
    let mut airframe = Airframe::paper();
    (airframe.design_point.altitude_m, airframe.design_point.airspeed_m_s) = (8_000.0, 230.0);
    let text = sets::SHIPPED.replace("bank_deg = [15.0, 15.0]", "bank_deg = [30.0, 30.0]");
    let mut sets = sets::read("sets.toml", &text).unwrap();
    sets.retain(|set| set.key == "bank_15");
    let study = Study::new(airframe, sets).unwrap();
    let sweeps = study.singles(10.0);
    let (bare, with_margin) = sweeps.split_at(sweeps.len() / 2);
    for (bare, with_margin) in bare.iter().zip(with_margin) {
        assert_eq!(
            (bare.effector, bare.margin, with_margin.margin),
            (with_margin.effector, false, true)
        );
        let [[low, high], [margin_low, margin_high]] =
            [bare, with_margin].map(|sweep| sweep.limits.unwrap());
        let name = study.effectors()[bare.effector];
        assert!(low <= margin_low && margin_high <= high, "{name:?}: {bare:?}");
    }
}
