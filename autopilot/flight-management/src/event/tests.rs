//! Signals that flicker, and the events published for them.

use flight_control::{
    AircraftModel, AltitudeLimit, Authority, FlightControl, Gains, NavigationState,
};

use super::*;
use crate::configuration;
use aircraft::DEFAULT_MODEL;

const PERIOD: ControlPeriod = ControlPeriod::DEFAULT;
const FULL: Authority = Authority {
    roll_pct: 100.0,
    pitch_pct: 100.0,
    yaw_pct: 100.0,
    negative_pct: [100.0; 3],
    positive_pct: [100.0; 3],
};

/// A step of normal flight.
fn calm() -> StepLog {
    let model: AircraftModel = configuration::aircraft_model("model", DEFAULT_MODEL).unwrap();
    let mut flight = FlightControl::new(PERIOD, &model, &Gains::REFERENCE);
    let demand = Demand { altitude_m: 5_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 };
    let mut log = flight.step(&NavigationState::at_rest(), &demand);
    log.health = Health::default();
    log.authority = FULL;
    log.compensator_active = false;
    log
}

/// Events of this many ticks of 2 ms.
fn run(
    transitions: &mut Transitions,
    ticks: u32,
    mut signal: impl FnMut(u32) -> StepLog,
) -> Vec<EventKind> {
    let mut published = Vec::new();
    for tick in 0..ticks {
        let alive = [true; SensorKind::ALL.len()];
        transitions.step(&signal(tick), &alive, PERIOD, |kind| published.push(kind));
    }
    published
}

fn yaw(percent: f64) -> Authority {
    Authority { yaw_pct: percent, ..FULL }
}

#[test]
fn the_compensator_is_reported_with_its_axis_and_what_is_at_its_limit_at_that_moment() {
    let mut log = StepLog { compensator_active: true, ..calm() };
    log.levels = [0.2, 0.1, 1.5].into();
    log.health.nozzle_yaw_saturated = true;
    let published = run(&mut Transitions::default(), 5_000, |_| log);
    let at_limit = Limits::from_fn(|limit| limit == Limit::NozzleYaw);
    assert_eq!(published, [EventKind::CompensatorActive { axis: Axis::Yaw, at_limit }]);
}

#[test]
fn a_flag_that_flickers_is_reported_once_and_its_release_with_the_time() {
    let mut transitions = Transitions::default();
    let (calm, active) = (calm(), StepLog { compensator_active: true, ..calm() });
    // 10 s: it changes every 20 ms, and is never asleep for a second.
    let published =
        run(&mut transitions, 5_000, |tick| if tick / 10 % 2 == 0 { active } else { calm });
    assert!(matches!(published[..], [EventKind::CompensatorActive { .. }]), "{published:?}");
    // It was asleep for the last 10 ticks already.
    let published = run(&mut transitions, 2_000, |_| calm);
    let [EventKind::CompensatorReleased { after }] = published[..] else { panic!("{published:?}") };
    // From the first tick, in which it was published, to the last one of activity.
    assert_eq!(after, Duration::from_millis(2 * (5_000 - 10 - 1)));
}

/// The compensator has just been reported.
fn awake() -> Transitions {
    let mut transitions = Transitions::default();
    let log = StepLog { compensator_active: true, ..calm() };
    assert_eq!(run(&mut transitions, 1, |_| log).len(), 1);
    transitions
}

#[test]
fn an_axis_without_authority_is_reported_after_200_ms_and_again_when_it_has_some_for_2_s() {
    let mut transitions = awake();
    let calm = || StepLog { compensator_active: true, ..calm() };
    let mut log = StepLog { authority: yaw(0.0), ..calm() };
    log.health.nozzle_yaw_saturated = true;
    assert_eq!(run(&mut transitions, 99, |_| log), []);
    let exhausted = EventKind::AuthorityExhausted { axis: Axis::Yaw, by: Limit::NozzleYaw };
    assert_eq!(run(&mut transitions, 1, |_| log), [exhausted]);
    // Between the two thresholds nothing is published.
    let some = StepLog { authority: yaw(9.0), ..calm() };
    assert_eq!(run(&mut transitions, 5_000, |_| some), []);
    assert_eq!(run(&mut transitions, 999, |_| calm()), []);
    assert_eq!(run(&mut transitions, 1, |_| calm()), [EventKind::AuthorityRestored(Axis::Yaw)]);
}

#[test]
fn while_the_compensator_sleeps_an_axis_must_be_without_authority_for_3_s() {
    let log = StepLog { authority: yaw(0.0), ..calm() };
    let mut transitions = Transitions::default();
    assert_eq!(run(&mut transitions, 1_499, |_| log), []);
    assert_eq!(run(&mut transitions, 1, |_| calm()), [], "a moment of authority");
    assert_eq!(run(&mut transitions, 1_499, |_| log), []);
    let by = Limit::Thrust;
    let exhausted = EventKind::AuthorityExhausted { axis: Axis::Yaw, by };
    assert_eq!(run(&mut transitions, 1, |_| log), [exhausted]);
}

#[test]
fn an_authority_that_is_gone_when_the_compensator_wakes_is_reported_at_once() {
    let log = StepLog { authority: yaw(0.0), ..calm() };
    let mut transitions = Transitions::default();
    assert_eq!(run(&mut transitions, 500, |_| log), []);
    let awake = StepLog { compensator_active: true, ..log };
    let published = run(&mut transitions, 1, |_| awake);
    let by = Limit::Thrust;
    let exhausted = EventKind::AuthorityExhausted { axis: Axis::Yaw, by };
    assert!(
        matches!(published[..], [EventKind::CompensatorActive { .. }, last] if last == exhausted)
    );
}

#[test]
fn an_authority_that_flickers_at_its_end_is_reported_once() {
    let mut log = StepLog { authority: yaw(0.0), compensator_active: true, ..calm() };
    log.health.nozzle_yaw_saturated = true;
    let calm = StepLog { compensator_active: true, ..calm() };
    let mut transitions = awake();
    assert_eq!(run(&mut transitions, 100, |_| log).len(), 1);
    let published = run(&mut transitions, 50_000, |tick| if tick % 2 == 0 { log } else { calm });
    assert_eq!(published, [], "100 s of flicker");
    let mut transitions = awake();
    let published = run(&mut transitions, 50_000, |tick| if tick % 50 == 0 { calm } else { log });
    assert_eq!(published, [], "never 200 ms without a break");
}

#[test]
fn a_nozzle_without_thrust_is_reported_as_such() {
    let log = StepLog { authority: Authority { roll_pct: 80.0, ..Authority::NONE }, ..calm() };
    let published = run(&mut Transitions::default(), 5_000, |_| log);
    let by = Limit::Thrust;
    assert_eq!(
        published,
        [Axis::Pitch, Axis::Yaw].map(|axis| EventKind::AuthorityExhausted { axis, by })
    );
}

#[test]
fn the_ailerons_limit_is_reported_once_as_the_end_of_the_roll_authority() {
    let mut log = StepLog { authority: Authority { roll_pct: 0.0, ..FULL }, ..calm() };
    log.health.aileron_saturated = true;
    let published = run(&mut Transitions::default(), 5_000, |_| log);
    assert_eq!(published, [EventKind::AuthorityExhausted { axis: Axis::Roll, by: Limit::Aileron }]);
}

#[test]
fn limits_of_other_effectors_are_reported_as_saturation() {
    let mut log = calm();
    log.health.elevator_saturated = true;
    let mut transitions = Transitions::default();
    assert_eq!(run(&mut transitions, 500, |_| log), [EventKind::Saturated(Limit::Elevator)]);
    let ended = EventKind::SaturationEnded(Limit::Elevator);
    assert_eq!(run(&mut transitions, 5_000, |_| calm()), [ended]);
}

#[test]
fn an_altitude_that_is_not_held_is_reported_with_what_is_at_its_limit_and_so_is_its_end() {
    let mut transitions = Transitions::default();
    let wing = StepLog { altitude_limit: Some(AltitudeLimit::Wing), ..calm() };
    let published = run(&mut transitions, 1_000, |_| wing);
    assert_eq!(published, [EventKind::AltitudeNotHeld(AltitudeLimit::Wing)]);
    // After 2 s without it.
    assert_eq!(run(&mut transitions, 999, |_| calm()), []);
    assert_eq!(run(&mut transitions, 2, |_| calm()), [EventKind::AltitudeHeld]);
}

#[test]
fn a_thrust_floor_and_a_compensator_that_yields_are_reported_with_their_ends() {
    let mut transitions = Transitions::default();
    let mut log = calm();
    log.health.compensation = CompensationHealth { thrust_floor: true, yields: true };
    let published = run(&mut transitions, 500, |_| log);
    assert_eq!(published, [EventKind::CompensatorYields, EventKind::ThrustFloorTaken]);
    // After 2 s without them.
    let published = run(&mut transitions, 1_001, |_| calm());
    assert_eq!(published, [EventKind::ThrustFloorReleased, EventKind::CompensatorResumes]);
}

#[test]
fn a_verdict_is_reported_once_again_when_it_changes_and_its_end_after_a_second() {
    use flight_control::isolation::evidence::Behaviour;
    use icd::tvc_jet;

    let verdict = |behaviour, value| Verdict {
        effectors: [Some(tvc_jet::RUDDER), None],
        behaviour,
        values: [value, 0.0],
        confidence: 0.95,
    };
    let mut transitions = Transitions::default();
    // The angle becomes better with time; that is no news.
    let stuck = |tick: u32| {
        let mut log = calm();
        log.isolation.verdict = Some(verdict(Behaviour::Stuck, 0.1 + 1.0e-4 * f64::from(tick)));
        log
    };
    let published = run(&mut transitions, 500, stuck);
    assert_eq!(published, [EventKind::Isolated(verdict(Behaviour::Stuck, 0.1))]);
    let biased = verdict(Behaviour::Biased, 0.1);
    let other = |_| {
        let mut log = calm();
        log.isolation.verdict = Some(biased);
        log
    };
    assert_eq!(run(&mut transitions, 500, other), [EventKind::Isolated(biased)]);
    assert_eq!(run(&mut transitions, 499, |_| calm()), []);
    assert_eq!(run(&mut transitions, 500, |_| calm()), [EventKind::IsolationWithdrawn]);
}

#[test]
fn the_loss_and_the_return_of_each_sensor_are_reported_once_and_one_that_never_was_is_not() {
    for sensor in SensorKind::ALL {
        let mut transitions = Transitions::default();
        let log = calm();
        let mut published = Vec::new();
        let mut fly = |milliseconds: u32, lost: bool| {
            let alive = SensorKind::ALL.map(|other| other != sensor || !lost);
            for _ in 0..milliseconds / 2 {
                transitions.step(&log, &alive, PERIOD, |kind| published.push(kind));
            }
            core::mem::take(&mut published)
        };
        assert_eq!(fly(5_000, true), [], "{sensor:?}: not fitted");
        assert_eq!(fly(1_000, false), []);
        assert_eq!(fly(400, true), [], "{sensor:?}: a gap");
        assert_eq!(fly(1_000, false), []);
        assert_eq!(fly(5_000, true), [EventKind::SensorLost(sensor)]);
        assert_eq!(fly(5_000, false), [EventKind::SensorBack(sensor)]);
    }
}
