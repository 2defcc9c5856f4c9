//! Times at which faults act, the reports of them, and refused requests.

use super::*;
use icd::tvc_jet;

fn at(ms: u64) -> SimTime {
    SimTime::from_micros(ms * 1_000)
}

/// The events of the faults up to a time, each at its instant.
fn run(bench: &mut Bench, until: SimTime) {
    while let Some(next) = bench.faults.next_event().filter(|next| *next <= until) {
        bench.act(next);
    }
}

fn inject(bench: &mut Bench, now: SimTime, kind: FaultKind, timing: Timing) -> FaultReply {
    bench.request(now, FaultRequest::Inject { target: tvc_jet::RUDDER.into(), kind, timing })
}

const LOSS: FaultKind = FaultKind::PartialLoss { remaining: 0.5 };

#[test]
fn a_fault_with_a_duration_ends_by_itself_at_its_microsecond() {
    let mut bench = Bench::new();
    let timing = Timing { duration_s: Some(1.5), ..Timing::NOW };
    assert_eq!(inject(&mut bench, T0, LOSS, timing), FaultReply::Applied { at: T0 });
    let end = SimTime::from_micros(2_500_000);
    assert_eq!(bench.faults.next_event(), Some(end));
    run(&mut bench, end);
    assert_eq!(bench.states(), [FaultState::Active { since: T0 }, FaultState::Ended { at: end }]);
    assert_eq!(*bench.faults.effects(), Effects::none());
    assert_eq!(bench.faults.next_event(), None);
}

#[test]
fn a_repeated_fault_acts_and_rests_at_exact_times_and_ends_after_its_number() {
    let mut bench = Bench::new();
    let repeat = Some(Repeat { every_s: 0.3, times: Some(3) });
    let timing = Timing { duration_s: Some(0.1), repeat, ..Timing::at(at(2_000)) };
    assert_eq!(inject(&mut bench, T0, LOSS, timing), FaultReply::Scheduled { at: at(2_000) });
    run(&mut bench, at(60_000));
    let expected = [
        FaultState::Scheduled { at: at(2_000) },
        FaultState::Active { since: at(2_000) },
        FaultState::Resting { since: at(2_100), next: at(2_300) },
        FaultState::Active { since: at(2_300) },
        FaultState::Resting { since: at(2_400), next: at(2_600) },
        FaultState::Active { since: at(2_600) },
        FaultState::Ended { at: at(2_700) },
    ];
    assert_eq!(bench.states(), expected);
    for report in &bench.reports {
        let PlantReport::Fault(entry) = report else { panic!("{report:?}") };
        assert_eq!((entry.id, entry.timing), (1, timing));
    }
}

#[test]
fn a_fault_without_a_number_of_repetitions_goes_on_until_it_is_cleared() {
    let mut bench = Bench::new();
    let repeat = Some(Repeat { every_s: 0.3, times: None });
    inject(&mut bench, T0, LOSS, Timing { duration_s: Some(0.1), repeat, ..Timing::NOW });
    run(&mut bench, at(301_050));
    // The thousandth repetition begins exactly after 300 s: no error accumulates.
    assert_eq!(bench.faults.active(tvc_jet::RUDDER), Some((LOSS, at(301_000))));
    bench.request(at(301_050), FaultRequest::ClearAll);
    assert_eq!(bench.states().last(), Some(&FaultState::Ended { at: at(301_050) }));
    assert_eq!(bench.faults.next_event(), None);
}

#[test]
fn a_resting_fault_is_there_already_and_is_cleared_like_one_that_acts() {
    let mut bench = Bench::new();
    let repeat = Some(Repeat { every_s: 2.0, times: None });
    let timing = Timing { duration_s: Some(0.5), repeat, ..Timing::NOW };
    inject(&mut bench, T0, LOSS, timing);
    run(&mut bench, at(2_000));
    assert_eq!(bench.faults.active(tvc_jet::RUDDER), None, "it rests");
    assert_eq!(bench.faults.effects().codes()[tvc_jet::RUDDER], 0);
    let reply = inject(&mut bench, at(2_000), LOSS, timing);
    assert_eq!(reply, FaultReply::Unchanged { at: at(3_000) });
    bench.request(at(2_000), FaultRequest::Clear { target: tvc_jet::RUDDER.into() });
    assert_eq!(bench.states().last(), Some(&FaultState::Ended { at: at(2_000) }));
    run(&mut bench, at(60_000));
    assert_eq!(bench.faults.active(tvc_jet::RUDDER), None);
}

#[test]
fn another_timing_is_another_fault_and_replaces_the_first() {
    let mut bench = Bench::new();
    inject(&mut bench, T0, LOSS, Timing::NOW);
    let timing = Timing { duration_s: Some(1.0), ..Timing::NOW };
    assert_eq!(inject(&mut bench, T1, LOSS, timing), FaultReply::Applied { at: T1 });
    let expected = [
        FaultState::Active { since: T0 },
        FaultState::Ended { at: T1 },
        FaultState::Active { since: T1 },
    ];
    assert_eq!(bench.states(), expected);
}

#[test]
fn the_list_has_active_pausing_and_scheduled_faults_with_the_numbers_of_the_reports() {
    let mut bench = Bench::new();
    let repeat = Some(Repeat { every_s: 2.0, times: None });
    inject(&mut bench, T0, LOSS, Timing { duration_s: Some(0.5), repeat, ..Timing::NOW });
    bench.inject(T0, tvc_jet::ENGINE, FaultKind::FlameOut);
    bench.inject_at(at(9_000), tvc_jet::RUDDER, FaultKind::Float);
    run(&mut bench, at(2_000));
    let mut listed = Vec::new();
    bench.faults.list(&mut |report| match report {
        PlantReport::Fault(entry) => listed.push(entry),
        other => panic!("{other:?}"),
    });
    let states: Vec<_> = listed
        .iter()
        .map(|e| (e.id, e.target.effector().unwrap(), e.timing.onset, e.state))
        .collect();
    let expected = [
        (
            1,
            tvc_jet::RUDDER,
            Onset::At(T0),
            FaultState::Resting { since: at(1_500), next: at(3_000) },
        ),
        (2, tvc_jet::ENGINE, Onset::At(T0), FaultState::Active { since: T0 }),
        (3, tvc_jet::RUDDER, Onset::At(at(9_000)), FaultState::Scheduled { at: at(9_000) }),
    ];
    assert_eq!(states, expected);
}

#[test]
fn clear_all_ends_active_faults_and_cancels_scheduled_ones() {
    let mut bench = Bench::new();
    for effector in tvc_jet::ALL {
        bench.inject(T0, effector, FaultKind::StuckHere);
        bench.inject_at(T1, effector, LOSS);
    }
    bench.reports.clear();
    bench.request(T0, FaultRequest::ClearAll);
    let (ended, cancelled) = (FaultState::Ended { at: T0 }, FaultState::Cancelled { at: T0 });
    let states = bench.states();
    assert_eq!(states.iter().filter(|state| **state == ended).count(), 8);
    assert_eq!(states.iter().filter(|state| **state == cancelled).count(), 8);
    assert_eq!(*bench.faults.effects(), Effects::none());
    assert_eq!(bench.faults.next_event(), None);
}

#[test]
fn numbers_and_times_out_of_range_are_refused_by_name() {
    let rate = 80.0_f64.to_radians();
    let half = 30.0_f64.to_radians();
    let kinds = [
        (FaultKind::Slow { rate: 2.0 }, Quantity::Rate, 2.0, [1e-3 * rate, rate]),
        (FaultKind::Slow { rate: 0.0 }, Quantity::Rate, 0.0, [1e-3 * rate, rate]),
        (FaultKind::Delayed { delay_s: 1.1 }, Quantity::Delay, 1.1, [0.0, 1.0]),
        (
            FaultKind::Intermittent { period_s: 0.01, present: 0.5 },
            Quantity::Period,
            0.01,
            [0.02, 60.0],
        ),
        (
            FaultKind::Intermittent { period_s: 1.0, present: 1.5 },
            Quantity::Present,
            1.5,
            [0.0, 1.0],
        ),
        (
            FaultKind::Oscillating { amplitude: 0.6, frequency_hz: 1.0 },
            Quantity::Amplitude,
            0.6,
            [0.0, half],
        ),
        (
            FaultKind::Oscillating { amplitude: 0.1, frequency_hz: 21.0 },
            Quantity::Frequency,
            21.0,
            [0.001, 20.0],
        ),
        (FaultKind::Drifting { rate: -2.0 }, Quantity::Rate, -2.0, [-rate, rate]),
        (FaultKind::Biased { bias: -0.6 }, Quantity::Bias, -0.6, [-half, half]),
        (FaultKind::LimitedTravel { limit: -0.1 }, Quantity::Limit, -0.1, [0.0, half]),
    ];
    let mut bench = Bench::new();
    for (kind, what, value, [min, max]) in kinds {
        let refusal = Refusal::OutOfRange { what, value, min, max };
        let reply = inject(&mut bench, T0, kind, Timing::NOW);
        assert_eq!(reply, FaultReply::Refused(refusal));
    }
    let repeat = |every_s, times| Some(Repeat { every_s, times });
    let longest = SimTime::MAX_SECONDS;
    for (timing, what, value, [min, max]) in [
        (Timing { ramp_s: 3_601.0, ..Timing::NOW }, Quantity::Ramp, 3_601.0, [0.0, 3_600.0]),
        (
            Timing { ramp_s: 2.0, duration_s: Some(1.0), ..Timing::NOW },
            Quantity::Duration,
            1.0,
            [2.0, longest],
        ),
        (
            Timing { repeat: repeat(5.0, None), ..Timing::NOW },
            Quantity::Duration,
            0.0,
            [1e-4, longest],
        ),
        (
            Timing { duration_s: Some(5.0), repeat: repeat(5.0, None), ..Timing::NOW },
            Quantity::Every,
            5.0,
            [5.000_001, longest],
        ),
        (
            Timing { duration_s: Some(1.0), repeat: repeat(5.0, Some(1)), ..Timing::NOW },
            Quantity::Times,
            1.0,
            [2.0, 1_000.0],
        ),
    ] {
        let refusal = Refusal::OutOfRange { what, value, min, max };
        assert_eq!(inject(&mut bench, T0, LOSS, timing), FaultReply::Refused(refusal));
    }
    assert_eq!(bench.reports, []);
}

#[test]
fn nan_is_outside_every_range_of_a_fault() {
    let mut bench = Bench::new();
    for code in 0..=u8::MAX {
        for values in [[f64::NAN, 1.0], [0.1, f64::NAN]] {
            let Some(kind) = FaultKind::from_code(code, values) else { continue };
            if kind.values().into_iter().any(f64::is_nan) {
                let reply = inject(&mut bench, T0, kind, Timing::NOW);
                assert!(matches!(reply, FaultReply::Refused(_)), "{kind:?}: {reply:?}");
            }
        }
    }
    let timing = Timing { ramp_s: f64::NAN, ..Timing::NOW };
    assert!(matches!(inject(&mut bench, T0, LOSS, timing), FaultReply::Refused(_)));
}

#[test]
fn a_ramp_of_a_fault_without_a_size_is_refused() {
    let mut bench = Bench::new();
    let timing = Timing { ramp_s: 1.0, ..Timing::NOW };
    let refusal = Refusal::OutOfRange { what: Quantity::Ramp, value: 1.0, min: 0.0, max: 0.0 };
    for (effector, kind) in [
        (tvc_jet::RUDDER, FaultKind::StuckHere),
        (tvc_jet::RUDDER, FaultKind::HardOver { side: Side::Positive }),
        (tvc_jet::ENGINE, FaultKind::FlameOut),
    ] {
        let reply =
            bench.request(T0, FaultRequest::Inject { target: effector.into(), kind, timing });
        assert_eq!(reply, FaultReply::Refused(refusal));
    }
}

#[test]
fn the_engine_and_the_surfaces_refuse_faults_of_the_other_kind() {
    let mut bench = Bench::new();
    let side = Side::Positive;
    for kind in [jump(0.0), FaultKind::HardOver { side }, FaultKind::Float] {
        let reply = bench.inject(T0, tvc_jet::ENGINE, kind);
        assert_eq!(reply, FaultReply::Refused(Refusal::NotForThisEffector), "{kind:?}");
    }
    for effector in tvc_jet::ALL.into_iter().filter(|e| tvc_jet::effectors().is_angle(*e)) {
        let reply = bench.inject(T0, effector, FaultKind::FlameOut);
        assert_eq!(reply, FaultReply::Refused(Refusal::NotForThisEffector), "{effector:?}");
    }
}

#[test]
fn a_stuck_effector_keeps_the_deviation_that_it_had() {
    let mut bench = Bench::new();
    bench.inject(T0, tvc_jet::RUDDER, FaultKind::Biased { bias: 0.1 });
    bench.inject(T1, tvc_jet::RUDDER, FaultKind::StuckHere);
    assert_eq!(bench.effective(tvc_jet::RUDDER), 0.05 + 0.1);
    let mut bench = Bench::new();
    bench.inject(T0, tvc_jet::RUDDER, FaultKind::Biased { bias: 0.1 });
    bench.inject(T1, tvc_jet::RUDDER, FaultKind::Biased { bias: 0.2 });
    assert_eq!(bench.effective(tvc_jet::RUDDER), 0.05 + 0.2, "of the same servo");
    bench.request(T1, FaultRequest::Clear { target: tvc_jet::RUDDER.into() });
    assert_eq!(bench.effective(tvc_jet::RUDDER), 0.05 + 0.2, "the repair does not move it");
}
