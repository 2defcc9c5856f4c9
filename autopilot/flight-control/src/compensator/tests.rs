use super::*;
use crate::testing;
use proptest::prelude::*;

fn setup() -> (DesignModel, FlightCondition) {
    let model = DesignModel::new(testing::aircraft_model());
    let at = model.condition(&testing::level_state());
    (model, at)
}

proptest! {
    #[test]
    fn the_demand_cancels_the_estimate_through_g_c(p in -5.0..5.0, q in -1.0..1.0, r in -1.0..1.0) {
        let (model, at) = setup();
        let z2 = Vector3::new(p, q, r);
        let u = compensate(&z2, 1.0, &model, &at);
        // See Eq. (19): g_c u_cf = -F.
        let effect = model.redundant_effectiveness(&at)
            * Vector3::new(u.aileron_rad, u.nozzle_pitch_rad, u.nozzle_yaw_rad);
        prop_assert!((effect + z2).norm() < 1.0e-12 * (1.0 + z2.norm()));
    }
}

#[test]
fn asleep_means_exactly_zero() {
    let (model, at) = setup();
    assert_eq!(compensate(&Vector3::new(1.0, 2.0, 3.0), 0.0, &model, &at), Compensation::NONE);
}

#[test]
fn the_demand_stays_finite_without_thrust() {
    let (model, at) = setup();
    let at = FlightCondition { t_x_t: 0.0, ..at };
    let u = compensate(&Vector3::new(1.0, 1.0, 1.0), 1.0, &model, &at);
    assert!(u.nozzle_pitch_rad.is_finite() && u.nozzle_yaw_rad.is_finite());
}

#[test]
fn a_roll_to_the_right_is_met_by_positive_aileron() {
    let (model, at) = setup();
    assert!(compensate(&Vector3::new(1.0, 0.0, 0.0), 1.0, &model, &at).aileron_rad > 0.0);
}

fn selected(law: CompensatorLaw) -> Gains {
    let mut gains = Gains::REFERENCE;
    gains.selection.compensator_law = law;
    gains
}

fn every_estimator() -> impl Iterator<Item = CompensatorLaw> {
    CompensatorLaw::NAMES.iter().map(|(_, law)| *law)
}

/// A turn that is explained by half: rates at tick `k` and the modelled acceleration.
fn flight(k: u32) -> (Vector3<f64>, Vector3<f64>) {
    let f = Vector3::new(0.4, -0.2, 0.1);
    (2.0 * f * 0.002 * f64::from(k), f)
}

#[test]
fn each_estimator_finds_an_unexplained_acceleration_within_a_tenth_of_a_second() {
    for law in every_estimator() {
        let mut compensator = Compensator::new(&selected(law), ControlPeriod::DEFAULT);
        let (y, a) = flight(0);
        assert_eq!(compensator.step(&y, &a), Estimate { z: y, z2: Vector3::zeros() });
        let mut found = compensator.step(&flight(1).0, &a);
        for k in 2..200 {
            found = compensator.step(&flight(k).0, &a);
            if k == 50 {
                assert!((found.z2 - a).norm() < 0.2 * a.norm(), "{law:?} {found:?}");
            }
        }
        assert!((found.z2 - a).norm() < 1.0e-3, "{law:?} {found:?}");
    }
}

#[test]
fn an_estimator_goes_on_where_the_one_before_it_was() {
    for (from, to) in every_estimator().flat_map(|a| every_estimator().map(move |b| (a, b))) {
        let mut compensator = Compensator::new(&selected(from), ControlPeriod::DEFAULT);
        let mut last = compensator.step(&flight(0).0, &flight(0).1);
        for k in 1..300 {
            last = compensator.step(&flight(k).0, &flight(k).1);
        }
        compensator.set_gains(&selected(to));
        for k in 300..400 {
            let (y, a) = flight(k);
            let estimate = compensator.step(&y, &a);
            let jump = (estimate.z2 - last.z2).norm();
            // In steady flight, rad/s^2: a thousandth of the lowest level of the detector.
            assert!(jump < 1.8e-4, "{from:?} to {to:?}, tick {k}: {jump} rad/s2");
            last = estimate;
        }
    }
}
