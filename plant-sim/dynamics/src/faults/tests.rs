use super::*;
use crate::Airframe;
use icd::fault::{Quantity, Repeat, SensorKind, Side, Travel};
use icd::tvc_jet;

mod flown;
mod timing;

const T0: SimTime = SimTime::from_micros(1_000_000);
const T1: SimTime = SimTime::from_micros(2_000_001);

/// The effectors of the paper's aircraft, read once.
fn servos() -> PerEffector<Servo> {
    static SERVOS: std::sync::OnceLock<PerEffector<Servo>> = std::sync::OnceLock::new();
    *SERVOS.get_or_init(|| Airframe::paper().servos)
}

fn jump(angle_rad: f64) -> FaultKind {
    FaultKind::StuckAt { angle_rad, travel: Travel::Jump }
}

/// All sensors but the vanes, all parts but the fin.
const FITTED: Fitted = Fitted {
    sensors: [true, true, true, true, true, true, false, true, true, true, true, true],
    parts: [true, true, true, true, false],
};

/// Faults with positions that all differ from zero, and the reports.
struct Bench {
    faults: Faults,
    positions: PerEffector<f64>,
    reports: Vec<PlantReport>,
}

impl Bench {
    fn new() -> Self {
        let positions =
            PerEffector::from_values([0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 27_000.0]);
        Self {
            faults: Faults::none(&tvc_jet::effectors(), &servos(), &positions, &FITTED),
            positions,
            reports: Vec::new(),
        }
    }

    fn request(&mut self, now: SimTime, request: FaultRequest) -> FaultReply {
        let Self { faults, positions, reports } = self;
        let report = &mut |report| reports.push(report);
        faults.request(&request, &mut FaultContext { now, positions, report })
    }

    fn inject(&mut self, now: SimTime, effector: Effector, kind: FaultKind) -> FaultReply {
        self.request(
            now,
            FaultRequest::Inject { target: effector.into(), kind, timing: Timing::NOW },
        )
    }

    fn inject_at(&mut self, at: SimTime, effector: Effector, kind: FaultKind) -> FaultReply {
        self.request(
            T0,
            FaultRequest::Inject { target: effector.into(), kind, timing: Timing::at(at) },
        )
    }

    fn act(&mut self, now: SimTime) {
        let Self { faults, positions, reports } = self;
        let report = &mut |report| reports.push(report);
        faults.apply_due(&mut FaultContext { now, positions, report });
    }

    fn states(&self) -> Vec<FaultState> {
        let state = |report: &PlantReport| match report {
            PlantReport::Fault(entry) => entry.state,
            other => panic!("{other:?}"),
        };
        self.reports.iter().map(state).collect()
    }

    fn effective(&self, effector: Effector) -> f64 {
        self.faults.effects().effective_deflection(effector, self.positions[effector])
    }

    /// Speed of an effector whose servo would move at one unit per second.
    fn rate(&self, effector: Effector) -> f64 {
        self.faults.effects().rates(8, &PerEffector::from_fn(|_| 1.0))[effector]
    }
}

/// Every fault that the effector can have, with the effective value and the speed immediately after.
fn kinds(effector: Effector, here: f64) -> Vec<(FaultKind, f64, f64)> {
    let mut kinds = vec![
        (FaultKind::StuckHere, here, 0.0),
        (FaultKind::PartialLoss { remaining: 0.25 }, 0.25 * here, 1.0),
    ];
    if tvc_jet::effectors().is_angle(effector) {
        kinds.push((FaultKind::Float, 0.0, 0.0));
        kinds.push((jump(-0.2), -0.2, 0.0));
        let rate = servos()[effector].rate_limit;
        let travelling = FaultKind::StuckAt { angle_rad: 0.2, travel: Travel::AtActuatorRate };
        kinds.push((travelling, here, rate));
    }
    kinds
}

#[test]
fn each_fault_acts_on_its_own_effector_and_on_no_other() {
    for effector in tvc_jet::ALL {
        let here = Bench::new().positions[effector];
        for (kind, effective, rate) in kinds(effector, here) {
            let mut bench = Bench::new();
            assert_eq!(bench.inject(T0, effector, kind), FaultReply::Applied { at: T0 });
            assert_eq!(bench.effective(effector), effective, "{effector:?} {kind:?}");
            assert_eq!(bench.rate(effector), rate, "{effector:?} {kind:?}");
            for other in tvc_jet::ALL.into_iter().filter(|e| *e != effector) {
                let healthy = Bench::new().positions[other];
                assert_eq!(
                    bench.effective(other),
                    healthy,
                    "{effector:?} {kind:?} moved {other:?}"
                );
                assert_eq!(bench.rate(other), 1.0, "{effector:?} {kind:?} slowed {other:?}");
            }
        }
    }
}

#[test]
fn after_the_repair_every_effector_is_healthy_again() {
    for effector in tvc_jet::ALL {
        for (kind, _, _) in kinds(effector, Bench::new().positions[effector]) {
            let mut bench = Bench::new();
            bench.inject(T0, effector, kind);
            let stuck = bench.positions[effector];
            let reply = bench.request(T1, FaultRequest::Clear { target: effector.into() });
            assert_eq!(reply, FaultReply::Cleared { at: T1 });
            assert_eq!(*bench.faults.effects(), Effects::none(), "{effector:?} {kind:?}");
            assert_eq!(
                bench.positions[effector], stuck,
                "{effector:?} {kind:?}: the repair moved it"
            );
            let ended = FaultState::Ended { at: T1 };
            assert!(matches!(bench.reports[1], PlantReport::Fault(entry) if entry.state == ended));
            assert_eq!(bench.faults.next_event(), None);
        }
    }
}

#[test]
fn an_effector_that_jams_during_a_partial_loss_keeps_its_reduced_deflection() {
    let mut bench = Bench::new();
    bench.inject(T0, tvc_jet::RUDDER, FaultKind::PartialLoss { remaining: 0.5 });
    bench.inject(T0, tvc_jet::RUDDER, FaultKind::StuckHere);
    assert_eq!(bench.effective(tvc_jet::RUDDER), 0.025);
}

#[test]
fn the_same_fault_again_changes_nothing_and_is_answered_with_its_onset() {
    let mut bench = Bench::new();
    bench.inject(T0, tvc_jet::RUDDER, FaultKind::StuckHere);
    bench.positions[tvc_jet::RUDDER] = 0.3;
    let reply = bench.inject(T1, tvc_jet::RUDDER, FaultKind::StuckHere);
    assert_eq!(reply, FaultReply::Unchanged { at: T0 });
    assert_eq!(bench.reports.len(), 1);
}

#[test]
fn another_fault_replaces_the_one_that_is_there() {
    let mut bench = Bench::new();
    bench.inject(T0, tvc_jet::RUDDER, FaultKind::Float);
    assert_eq!(bench.inject(T1, tvc_jet::RUDDER, jump(0.1)), FaultReply::Applied { at: T1 });
    assert_eq!(bench.effective(tvc_jet::RUDDER), 0.1);
    assert_eq!(bench.faults.active(tvc_jet::RUDDER), Some((jump(0.1), T1)));
}

#[test]
fn a_travelling_effector_stops_at_its_angle_at_the_first_microsecond_after_its_way() {
    let mut bench = Bench::new();
    let kind = FaultKind::StuckAt { angle_rad: -0.1, travel: Travel::AtActuatorRate };
    bench.inject(T0, tvc_jet::RUDDER, kind);
    let rate = 80.0_f64.to_radians();
    assert_eq!(bench.rate(tvc_jet::RUDDER), -rate);
    let arrival = bench.faults.next_event().unwrap();
    let way_us = 0.15 / rate * 1.0e6;
    let late_us = (arrival.as_micros() - T0.as_micros()) as f64 - way_us;
    assert!((0.0..=1.0).contains(&late_us), "{late_us} us late");
    bench.act(arrival);
    assert_eq!((bench.effective(tvc_jet::RUDDER), bench.rate(tvc_jet::RUDDER)), (-0.1, 0.0));
    assert_eq!(bench.faults.next_event(), None);
}

#[test]
fn impossible_faults_are_refused_with_the_reason() {
    let mut bench = Bench::new();
    let limit_rad = 30.0_f64.to_radians();
    let what = Quantity::Angle;
    let beyond = Refusal::OutOfRange { what, value: 0.6, min: -limit_rad, max: limit_rad };
    for (effector, kind, refusal) in [
        (tvc_jet::ENGINE, jump(0.1), Refusal::NotForThisEffector),
        (tvc_jet::RUDDER, jump(0.6), beyond),
        (
            tvc_jet::RUDDER,
            FaultKind::PartialLoss { remaining: 1.5 },
            Refusal::OutOfRange { what: Quantity::Remaining, value: 1.5, min: 0.0, max: 1.0 },
        ),
    ] {
        assert_eq!(bench.inject(T0, effector, kind), FaultReply::Refused(refusal));
    }
    let vanes = Target::Sensor(SensorKind::Vanes);
    let refused = FaultReply::Refused(Refusal::NoSuchSensor);
    let (kind, timing) = (FaultKind::StuckHere, Timing::NOW);
    let broken = FaultRequest::Inject { target: vanes, kind, timing };
    assert_eq!(bench.request(T0, broken), refused);
    assert_eq!(bench.request(T0, FaultRequest::Clear { target: vanes }), refused);
    let gyro = Target::Sensor(SensorKind::Gyro);
    let kind = FaultKind::PartialLoss { remaining: 0.5 };
    let broken = FaultRequest::Inject { target: gyro, kind, timing };
    assert_eq!(bench.request(T0, broken), FaultReply::Refused(Refusal::NotForThisEffector));
    let kind = FaultKind::Biased { bias: 20.0 };
    let too_large = bench.request(T0, FaultRequest::Inject { target: gyro, kind, timing });
    assert!(matches!(too_large, FaultReply::Refused(Refusal::OutOfRange { .. })), "{too_large:?}");
    assert_eq!(
        bench.inject(T0, tvc_jet::RUDDER, FaultKind::Off),
        FaultReply::Refused(Refusal::NotForThisEffector)
    );
    let no_number = bench.inject(T0, tvc_jet::RUDDER, jump(f64::NAN));
    assert!(matches!(no_number, FaultReply::Refused(Refusal::OutOfRange { .. })));
    assert_eq!(*bench.faults.effects(), Effects::none());
    assert_eq!(bench.reports, []);
}

#[test]
fn an_onset_in_the_past_is_refused_and_one_now_acts_at_once() {
    let mut bench = Bench::new();
    let onset = SimTime::from_micros(999_999);
    let refusal = Refusal::OnsetInThePast { onset, now: T0 };
    let reply = bench.inject_at(onset, tvc_jet::RUDDER, FaultKind::Float);
    assert_eq!(reply, FaultReply::Refused(refusal));
    let reply = bench.inject_at(T0, tvc_jet::RUDDER, FaultKind::Float);
    assert_eq!(reply, FaultReply::Applied { at: T0 });
}

#[test]
fn a_scheduled_fault_waits_for_its_time() {
    let mut bench = Bench::new();
    let reply = bench.inject_at(T1, tvc_jet::RUDDER, FaultKind::Float);
    assert_eq!(reply, FaultReply::Scheduled { at: T1 });
    let again = bench.inject_at(T1, tvc_jet::RUDDER, FaultKind::Float);
    assert_eq!(again, FaultReply::Unchanged { at: T1 });
    assert_eq!(bench.faults.next_event(), Some(T1));
    bench.act(SimTime::from_micros(2_000_000));
    assert_eq!(bench.states(), [FaultState::Scheduled { at: T1 }]);
    bench.act(T1);
    let states = [FaultState::Scheduled { at: T1 }, FaultState::Active { since: T1 }];
    assert_eq!(bench.states(), states);
}

#[test]
fn clearing_an_effector_cancels_its_scheduled_faults_only() {
    let mut bench = Bench::new();
    bench.inject_at(T1, tvc_jet::RUDDER, FaultKind::Float);
    bench.inject_at(T1, tvc_jet::LEFT_AILERON, FaultKind::Float);
    bench.request(T0, FaultRequest::Clear { target: tvc_jet::RUDDER.into() });
    let waits = FaultState::Scheduled { at: T1 };
    assert_eq!(bench.states(), [waits, waits, FaultState::Cancelled { at: T0 }]);
    bench.act(T1);
    assert_eq!(bench.faults.active(tvc_jet::RUDDER), None);
    assert!(bench.faults.active(tvc_jet::LEFT_AILERON).is_some());
}

#[test]
fn the_end_of_a_fault_does_not_mend_the_one_that_replaced_it() {
    let mut bench = Bench::new();
    let at = |second: u64| SimTime::from_micros(second * 1_000_000);
    let effector = tvc_jet::RUDDER;
    for (kind, from, duration_s) in [(FaultKind::Float, 2, Some(2.0)), (jump(0.1), 3, None)] {
        let timing = Timing { duration_s, ..Timing::at(at(from)) };
        let fault = ScheduledFault { target: effector.into(), kind, timing };
        bench.faults.schedule(&fault, &mut |_| {}).unwrap();
    }
    for second in 2..5 {
        bench.act(at(second));
    }
    assert_eq!(bench.faults.active(effector), Some((jump(0.1), at(3))));
}

#[test]
fn the_schedule_has_a_limit() {
    let mut bench = Bench::new();
    for i in 0..SCHEDULE_MAX as u64 {
        let at = SimTime::from_micros(2_000_000 + i);
        let reply = bench.inject_at(at, tvc_jet::RUDDER, FaultKind::Float);
        assert_eq!(reply, FaultReply::Scheduled { at });
    }
    let reply = bench.inject_at(SimTime::from_micros(9_000_000), tvc_jet::RUDDER, FaultKind::Float);
    assert_eq!(reply, FaultReply::Refused(Refusal::ScheduleFull { capacity: 64 }));
}

#[test]
fn a_scheduled_fault_requested_again_after_its_onset_is_unchanged() {
    let mut bench = Bench::new();
    let (effector, kind) = (tvc_jet::RUDDER, jump(0.1));
    assert_eq!(bench.inject_at(T1, effector, kind), FaultReply::Scheduled { at: T1 });
    bench.act(T1);
    let later = SimTime::from_micros(T1.as_micros() + 500_000);
    let again =
        |kind, at| FaultRequest::Inject { target: effector.into(), kind, timing: Timing::at(at) };
    let reports = bench.reports.len();
    assert_eq!(bench.request(later, again(kind, T1)), FaultReply::Unchanged { at: T1 });
    assert_eq!(bench.reports.len(), reports, "nothing begins twice");
    let other_onset = SimTime::from_micros(T1.as_micros() + 1);
    for (kind, onset) in [(kind, other_onset), (jump(0.2), T1)] {
        let refusal = Refusal::OnsetInThePast { onset, now: later };
        assert_eq!(bench.request(later, again(kind, onset)), FaultReply::Refused(refusal));
    }
    bench.request(later, FaultRequest::Clear { target: effector.into() });
    let refusal = Refusal::OnsetInThePast { onset: T1, now: later };
    assert_eq!(bench.request(later, again(kind, T1)), FaultReply::Refused(refusal), "mended");
}
