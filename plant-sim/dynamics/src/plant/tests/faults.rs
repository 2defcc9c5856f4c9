//! Times and effects of faults in flight, and the reports of them.

use super::*;

#[test]
fn a_fault_due_at_a_tick_shows_at_that_tick() {
    let mut setup = flat();
    setup.faults = vec![stuck(tvc_jet::RUDDER, 0.1, 4_000), stuck(tvc_jet::LEFT_ELEVATOR, 0.2, 0)];
    let mut plant = plant(&setup);
    assert_eq!(plant.truth().deflections[tvc_jet::LEFT_ELEVATOR], 0.2);
    coast(&mut plant, 1);
    assert_eq!(plant.truth().deflections[tvc_jet::RUDDER], 0.0);
    coast(&mut plant, 1);
    assert_eq!(plant.truth().deflections[tvc_jet::RUDDER], 0.1);
    assert!(plant.truth().angular_acceleration.0.z < 0.0, "the force acts at the same instant");
}

#[test]
fn a_fault_between_ticks_acts_at_its_exact_time() {
    // A rudder stuck for 5300.7 us more or less: yaw rate grows linearly with the time it had.
    let yaw_after = |at_us| {
        let mut setup = flat();
        setup.faults = vec![stuck(tvc_jet::RUDDER, 0.1, at_us)];
        let mut plant = plant(&setup);
        coast(&mut plant, 10);
        let reports = std::iter::from_fn(|| plant.pop_report()).collect::<Vec<_>>();
        let at = SimTime::from_micros(at_us);
        let states = [FaultState::Scheduled { at }, FaultState::Active { since: at }];
        assert!(matches!(reports[..],
            [PlantReport::Fault(first), PlantReport::Fault(second)]
                if [first.state, second.state] == states));
        plant.truth().body_rates.0.z
    };
    let (early, late) = (yaw_after(15_000), yaw_after(14_463));
    let ratio = late / early;
    // 5.537 ms against 5 ms; damping in 5 ms is below a percent.
    assert!((ratio - 5.537 / 5.0).abs() < 0.005, "ratio {ratio}");
}

#[test]
fn a_fault_without_effect_splits_a_step_and_leaves_the_grid() {
    // Stuck where it stands in trim: only the split of one step at 3.333 ms remains.
    let healthy = flat();
    let mut split = flat();
    split.faults = vec![ScheduledFault {
        target: tvc_jet::NOZZLE_YAW.into(),
        kind: FaultKind::StuckHere,
        timing: Timing { duration_s: Some(0.000_444), ..Timing::at(SimTime::from_micros(3_333)) },
    }];
    let (mut a, mut b) = (plant(&healthy), plant(&split));
    fly(&mut a, 500, wiggle);
    fly(&mut b, 500, wiggle);
    assert_eq!(a.time(), b.time());
    let error = apart(a.truth(), b.truth());
    // One step of 1 ms cut in three: its own error of some 1e-13, amplified a little.
    assert!(error < 1e-10, "{error} apart");
}

#[test]
fn a_stuck_surface_moves_back_at_its_own_rate_when_it_is_mended() {
    let mut setup = flat();
    setup.faults = vec![ScheduledFault {
        timing: Timing { duration_s: Some(0.02), ..Timing::at(SimTime::ZERO) },
        ..stuck(tvc_jet::RUDDER, 0.3, 0)
    }];
    let mut plant = plant(&setup);
    coast(&mut plant, 10);
    assert_eq!(plant.truth().deflections[tvc_jet::RUDDER], 0.3);
    coast(&mut plant, 5);
    let expected = 0.3 - 80.0_f64.to_radians() * 0.01;
    let ours = plant.truth().deflections[tvc_jet::RUDDER];
    assert!((ours - expected).abs() < 1e-12, "{ours} rad instead of {expected}");
}

#[test]
fn a_travelling_surface_arrives_exactly_and_stays() {
    let mut setup = flat();
    setup.faults = vec![ScheduledFault {
        kind: FaultKind::StuckAt { angle_rad: 0.3, travel: Travel::AtActuatorRate },
        ..stuck(tvc_jet::RUDDER, 0.3, 0)
    }];
    let mut plant = plant(&setup);
    coast(&mut plant, 50);
    let on_the_way = plant.truth().deflections[tvc_jet::RUDDER];
    assert!((on_the_way - 80.0_f64.to_radians() * 0.1).abs() < 1e-12, "{on_the_way} rad");
    coast(&mut plant, 100);
    assert_eq!(plant.truth().deflections[tvc_jet::RUDDER], 0.3);
}

#[test]
fn half_the_engine_gives_half_the_thrust() {
    let mut plant = plant(&flat());
    let request = FaultRequest::Inject {
        target: tvc_jet::ENGINE.into(),
        kind: FaultKind::PartialLoss { remaining: 0.5 },
        timing: Timing::NOW,
    };
    assert_eq!(plant.request(&request), FaultReply::Applied { at: SimTime::ZERO });
    let thrust = plant.trim().thrust_n;
    assert_eq!(plant.truth().deflections[tvc_jet::ENGINE], 0.5 * thrust);
    assert_eq!(plant.sense().engine_n.value, 0.5 * thrust);
}

#[test]
fn reports_are_bounded_and_the_oldest_go_first() {
    let mut plant = plant(&flat());
    let effector = tvc_jet::RUDDER;
    for _ in 0..REPORTS_MAX {
        let (kind, timing) = (FaultKind::Float, Timing::NOW);
        plant.request(&FaultRequest::Inject { target: effector.into(), kind, timing });
        plant.request(&FaultRequest::Clear { target: effector.into() });
    }
    let waiting = std::iter::from_fn(|| plant.pop_report()).count();
    assert_eq!((waiting, plant.reports_dropped()), (REPORTS_MAX, REPORTS_MAX as u64));
}

#[test]
fn the_first_report_is_where_the_healthy_effectors_stand_whatever_is_broken_at_time_zero() {
    let mut healthy = flat();
    healthy.start.altitude_m = 10_000.0;
    healthy.start.airspeed_m_s = 180.0;
    let mut broken = healthy.clone();
    let flame_out = ScheduledFault {
        target: tvc_jet::ENGINE.into(),
        kind: FaultKind::FlameOut,
        timing: Timing::at(SimTime::ZERO),
    };
    broken.faults = vec![stuck(tvc_jet::LEFT_ELEVATOR, 0.1, 0), flame_out];
    let [mut healthy, mut broken] = [healthy, broken].map(|setup| Plant::new(&setup).unwrap());
    assert_ne!(healthy.truth().deflections, broken.truth().deflections, "the faults act");
    let started = healthy.pop_report();
    assert_eq!(broken.pop_report(), started);
    let Some(PlantReport::Started { positions }) = started else { panic!("{started:?}") };
    assert_eq!(positions, healthy.truth().deflections);
    coast(&mut broken, 3);
    let later = std::iter::from_fn(|| broken.pop_report());
    assert!(later.into_iter().all(|report| matches!(report, PlantReport::Fault(_))));
}
