//! Effects of the kinds of fault on moving effectors: flights over the flat Earth.

use super::*;
use crate::tests::nominal;
use crate::{EarthModel, Plant, PlantSetup, Truth};
use icd::Actuators;
use icd::tvc_jet;
use proptest::prelude::*;

const TICK_S: f64 = 0.002;

/// A flight with the commands of the trim plus what a test adds.
struct Flight {
    plant: Plant,
    commands: PerEffector<f64>,
}

impl Flight {
    fn new() -> Self {
        Self::with(Vec::new())
    }

    fn with(faults: Vec<ScheduledFault>) -> Self {
        let setup = nominal(&Airframe::paper(), 1_000);
        let plant = Plant::new(&PlantSetup { earth: EarthModel::Flat, faults, ..setup }).unwrap();
        let commands = plant.trim().positions();
        Self { plant, commands }
    }

    fn break_now(&mut self, effector: Effector, kind: FaultKind) {
        self.inject(effector, kind, Timing::NOW);
    }

    fn inject(&mut self, effector: Effector, kind: FaultKind, timing: Timing) {
        let reply =
            self.plant.request(&FaultRequest::Inject { target: effector.into(), kind, timing });
        assert!(
            matches!(reply, FaultReply::Applied { .. } | FaultReply::Scheduled { .. }),
            "{reply:?}"
        );
    }

    fn fly(&mut self, ticks: u32) -> Truth {
        for _ in 0..ticks {
            self.plant.advance(&Actuators::new(self.commands));
        }
        *self.plant.truth()
    }
}

fn radians(degrees: f64) -> f64 {
    degrees.to_radians()
}

/// A size for each kind that suits the effector: rad, or N for the engine.
fn sized(effector: Effector, fraction: f64) -> f64 {
    let servo = servos()[effector];
    fraction * 0.5 * (servo.max - servo.min)
}

/// Every kind that the effector can have.
fn every_kind(effector: Effector) -> Vec<FaultKind> {
    let mut kinds = vec![
        FaultKind::StuckHere,
        FaultKind::PartialLoss { remaining: 0.5 },
        FaultKind::Slow { rate: sized(effector, 0.1) },
        FaultKind::Delayed { delay_s: 0.1 },
        FaultKind::Intermittent { period_s: 0.1, present: 0.3 },
        FaultKind::Oscillating { amplitude: sized(effector, 0.2), frequency_hz: 3.0 },
        FaultKind::Drifting { rate: sized(effector, 0.1) },
        FaultKind::Biased { bias: sized(effector, 0.2) },
        FaultKind::LimitedTravel { limit: sized(effector, 0.5) },
    ];
    if tvc_jet::effectors().is_angle(effector) {
        kinds.extend([
            jump(sized(effector, 0.4)),
            FaultKind::StuckAt { angle_rad: sized(effector, -0.4), travel: Travel::AtActuatorRate },
            FaultKind::HardOver { side: Side::Positive },
            FaultKind::HardOver { side: Side::Negative },
            FaultKind::Float,
        ]);
    } else {
        kinds.push(FaultKind::FlameOut);
    }
    kinds
}

/// Commands that move every effector far and both ways.
fn wave(flight: &mut Flight, tick: u32) {
    let phase = f64::from(tick) * TICK_S * 4.0;
    let (trim, commands) = (flight.plant.trim().positions(), &mut flight.commands);
    *commands = PerEffector::from_fn(|e| trim[e] + sized(e, 0.9) * libm::sin(phase));
}

#[test]
fn every_kind_moves_its_own_effector_away_from_the_healthy_one_and_no_other() {
    let healthy: Vec<Truth> = {
        let mut flight = Flight::new();
        let step = |tick| {
            wave(&mut flight, tick);
            flight.fly(1)
        };
        (0..150).map(step).collect()
    };
    for effector in tvc_jet::ALL {
        for kind in every_kind(effector) {
            let mut flight = Flight::new();
            flight.break_now(effector, kind);
            let mut apart = 0.0_f64;
            for (tick, healthy) in (0..).zip(&healthy) {
                wave(&mut flight, tick);
                let truth = flight.fly(1);
                for other in tvc_jet::ALL {
                    let by = (truth.deflections[other] - healthy.deflections[other]).abs();
                    if other == effector {
                        apart = apart.max(by);
                    } else {
                        // Steps that an event cuts differ in the last bits.
                        assert!(
                            by <= 1e-9 * sized(other, 1.0),
                            "{effector:?} {kind:?}: {other:?} {by}"
                        );
                        assert_eq!(truth.fault_codes[other], 0);
                    }
                }
                assert_eq!(truth.fault_codes[effector], kind.code());
            }
            assert!(apart > 1e-3 * sized(effector, 1.0), "{effector:?} {kind:?}: {apart} rad or N");
        }
    }
}

#[test]
fn a_hard_over_goes_to_its_side_whatever_the_sign_of_the_command() {
    // A common mistake: the side follows the sign of the command.
    for (side, sign) in [(Side::Positive, 1.0), (Side::Negative, -1.0)] {
        for command in [-0.4, 0.0, 0.4] {
            let mut flight = Flight::new();
            flight.commands[tvc_jet::RUDDER] = command;
            flight.fly(50);
            let before = flight.plant.truth().positions[tvc_jet::RUDDER];
            flight.break_now(tvc_jet::RUDDER, FaultKind::HardOver { side });
            let after = flight.fly(10).positions[tvc_jet::RUDDER];
            let rate = (after - before) / (10.0 * TICK_S);
            assert!((rate - sign * radians(80.0)).abs() < 1e-9, "{rate} rad/s");
            flight.fly(500);
            assert_eq!(flight.plant.truth().positions[tvc_jet::RUDDER], sign * radians(30.0));
        }
    }
}

#[test]
fn stuck_keeps_the_last_value_and_is_not_zero() {
    // A common mistake: a stuck output is zero.
    for effector in tvc_jet::ALL {
        let mut flight = Flight::new();
        flight.commands[effector] += sized(effector, 0.5);
        let here = flight.fly(100).positions[effector];
        assert!(here.abs() > sized(effector, 0.05), "{effector:?} at {here}");
        flight.break_now(effector, FaultKind::StuckHere);
        flight.commands[effector] -= sized(effector, 0.7);
        let truth = flight.fly(200);
        assert_eq!((truth.positions[effector], truth.deflections[effector]), (here, here));
    }
}

#[test]
fn a_repeated_command_does_not_restart_the_clock_of_the_fault() {
    // A common mistake: each copy of the command restarts the ramp.
    let timing = Timing { ramp_s: 1.0, duration_s: Some(3.0), ..Timing::NOW };
    let (effector, kind) = (tvc_jet::RUDDER, FaultKind::PartialLoss { remaining: 0.0 });
    let mut flight = Flight::new();
    flight.commands[effector] = 0.2;
    flight.fly(500);
    let at = flight.plant.time();
    flight.inject(effector, kind, timing);
    for _ in 0..1_000 {
        let again = FaultRequest::Inject { target: effector.into(), kind, timing };
        assert_eq!(flight.plant.request(&again), FaultReply::Unchanged { at });
        flight.fly(1);
    }
    assert_eq!(flight.plant.truth().deflections[effector], 0.0, "the ramp is over after 1 s");
    flight.fly(501);
    assert_eq!(flight.plant.truth().fault_codes[effector], 0, "and the fault after 3 s");
}

#[test]
fn a_slow_effector_moves_at_its_rate_and_a_mended_one_at_the_old() {
    let mut flight = Flight::new();
    flight.break_now(tvc_jet::LEFT_ELEVATOR, FaultKind::Slow { rate: radians(5.0) });
    flight.commands[tvc_jet::LEFT_ELEVATOR] = radians(20.0);
    let at = |truth: &Truth| truth.positions[tvc_jet::LEFT_ELEVATOR];
    let from = at(flight.plant.truth());
    assert!((at(&flight.fly(500)) - from - radians(5.0)).abs() < 1e-9);
    flight.plant.request(&FaultRequest::ClearAll);
    let from = at(flight.plant.truth());
    assert!((at(&flight.fly(10)) - from - radians(1.6)).abs() < 1e-9);
}

#[test]
fn a_delayed_effector_does_the_same_later_and_nothing_twice() {
    let effector = tvc_jet::NOZZLE_PITCH;
    // 37.123 ms: between ticks and steps.
    let (mut healthy, mut delayed) = (Flight::new(), Flight::new());
    healthy.commands[effector] = 0.1;
    delayed.commands[effector] = 0.1;
    healthy.fly(500);
    let before = delayed.fly(500).positions[effector];
    delayed.break_now(effector, FaultKind::Delayed { delay_s: 0.037_123 });
    healthy.commands[effector] = -0.1;
    delayed.commands[effector] = -0.1;
    let waits = delayed.fly(18).positions[effector];
    assert!((waits - before).abs() < 1e-9, "no command is due yet: {waits} after {before} rad");
    let late = delayed.fly(31).positions[effector];
    // 98 ms less the delay, of a servo that moves at its rate limit.
    let moved = radians(60.0) * (0.098 - 0.037_123);
    assert!((before - late - moved).abs() < 1e-9, "{} rad, not {moved}", before - late);
}

#[test]
fn a_growing_delay_lets_commands_through_in_their_order() {
    let effector = tvc_jet::RUDDER;
    let mut flight = Flight::new();
    let timing = Timing { ramp_s: 1.0, ..Timing::NOW };
    flight.inject(effector, FaultKind::Delayed { delay_s: 1.0 }, timing);
    let mut last = flight.plant.truth().positions[effector];
    for tick in 0..1_000 {
        flight.commands[effector] = 0.4 * f64::from(tick) / 1_000.0;
        let here = flight.fly(1).positions[effector];
        assert!(here >= last, "{here} after {last} rad");
        last = here;
    }
    // A command of t comes at 2 t while the delay grows: at 2 s the servo receives that of 1 s.
    assert!((last - 0.2).abs() < 0.02, "{last} rad");
}

#[test]
fn an_intermittent_effector_stands_still_in_the_gap_at_the_begin_of_each_period() {
    let effector = tvc_jet::LEFT_AILERON;
    let mut flight = Flight::new();
    flight.break_now(effector, FaultKind::Intermittent { period_s: 0.1, present: 0.2 });
    flight.commands[effector] = radians(20.0);
    for period in 0..3_u32 {
        let from = flight.plant.truth().positions[effector];
        assert_eq!(flight.fly(40).positions[effector], from, "the gap of period {period}");
        let way = flight.fly(10).positions[effector] - from;
        assert!((way - radians(80.0) * 0.02).abs() < 1e-3 || period == 2, "{way} rad");
        assert!(way > 0.0);
    }
}

#[test]
fn an_oscillating_effector_swings_about_where_it_should_be() {
    let effector = tvc_jet::RUDDER;
    let mut flight = Flight::new();
    flight.commands[effector] = 0.1;
    flight.fly(1_000);
    flight.break_now(effector, FaultKind::Oscillating { amplitude: 0.05, frequency_hz: 2.0 });
    for tick in 1..=500_u32 {
        let here = flight.fly(1).positions[effector];
        let t = f64::from(tick) * TICK_S;
        let expected = 0.1 + 0.05 * libm::sin(core::f64::consts::TAU * 2.0 * t);
        assert!((here - expected).abs() < 1e-6, "{here}, not {expected} rad at {t} s");
    }
}

#[test]
fn a_drift_grows_to_the_end_of_the_travel_and_a_bias_stays() {
    let mut flight = Flight::new();
    let (drifts, biased) = (tvc_jet::RIGHT_ELEVATOR, tvc_jet::NOZZLE_YAW);
    flight.break_now(drifts, FaultKind::Drifting { rate: radians(-10.0) });
    flight.break_now(biased, FaultKind::Biased { bias: radians(4.0) });
    let truth = flight.fly(500);
    let trim = flight.plant.trim().positions();
    assert!((truth.positions[drifts] - trim[drifts] + radians(10.0)).abs() < 1e-9);
    assert_eq!(truth.positions[biased], trim[biased] + radians(4.0));
    flight.fly(2_000);
    assert_eq!(flight.plant.truth().positions[drifts], -radians(30.0));
}

#[test]
fn a_limited_travel_pushes_back_and_lets_nothing_beyond() {
    let effector = tvc_jet::RUDDER;
    let mut flight = Flight::new();
    flight.commands[effector] = -0.4;
    flight.fly(500);
    flight.break_now(effector, FaultKind::LimitedTravel { limit: 0.1 });
    assert_eq!(flight.plant.truth().positions[effector], -0.1);
    flight.commands[effector] = 0.4;
    flight.fly(500);
    let here = flight.plant.truth().positions[effector];
    assert!((here - 0.1).abs() < 1e-6 && here <= 0.1, "{here} rad");
    let mut engine = Flight::new();
    engine.break_now(tvc_jet::ENGINE, FaultKind::LimitedTravel { limit: 12_000.0 });
    assert_eq!(engine.fly(10).deflections[tvc_jet::ENGINE], 12_000.0);
}

#[test]
fn a_flame_out_runs_down_with_the_lag_of_the_engine_and_spools_up_after_the_repair() {
    let mut flight = Flight::new();
    let thrust = flight.plant.truth().deflections[tvc_jet::ENGINE];
    flight.break_now(tvc_jet::ENGINE, FaultKind::FlameOut);
    let ours = flight.fly(1_000).deflections[tvc_jet::ENGINE];
    let expected = thrust * libm::exp(-2.0);
    assert!((ours - expected).abs() < 1e-6 * thrust, "{ours} N, not {expected}");
    assert!(flight.fly(500).deflections[tvc_jet::ENGINE] < servos()[tvc_jet::ENGINE].min);
    let down = flight.plant.truth().deflections[tvc_jet::ENGINE];
    flight.plant.request(&FaultRequest::Clear { target: tvc_jet::ENGINE.into() });
    assert_eq!(flight.plant.truth().deflections[tvc_jet::ENGINE], down, "the repair moves nothing");
    let up = flight.fly(2_500).deflections[tvc_jet::ENGINE];
    assert!(up > 0.99 * thrust && up <= thrust, "{up} N");
}

#[test]
fn a_ramp_brings_each_size_evenly() {
    let timing = Timing { ramp_s: 2.0, ..Timing::NOW };
    let effector = tvc_jet::RUDDER;
    // After half of the ramp: the effect of a command of 0.2 rad.
    for (kind, halfway) in [
        (FaultKind::PartialLoss { remaining: 0.5 }, 0.2 * 0.75),
        (FaultKind::Biased { bias: 0.1 }, 0.25),
        (FaultKind::Drifting { rate: 0.1 }, 0.225),
        (FaultKind::Float, 0.1),
        (jump(-0.2), 0.0),
        (FaultKind::LimitedTravel { limit: 0.0 }, 0.2),
    ] {
        let mut flight = Flight::new();
        flight.commands[effector] = 0.2;
        flight.fly(1_000);
        flight.inject(effector, kind, timing);
        let here = flight.fly(500).deflections[effector];
        assert!((here - halfway).abs() < 1e-4, "{kind:?}: {here}, not {halfway} rad");
    }
}

#[test]
fn several_faults_act_at_the_same_time() {
    let mut flight = Flight::new();
    flight.break_now(tvc_jet::RUDDER, jump(0.1));
    flight.break_now(tvc_jet::LEFT_ELEVATOR, FaultKind::Biased { bias: 0.05 });
    flight.break_now(tvc_jet::ENGINE, FaultKind::FlameOut);
    let truth = flight.fly(100);
    assert_eq!(truth.positions[tvc_jet::RUDDER], 0.1);
    let trim = flight.plant.trim().positions()[tvc_jet::LEFT_ELEVATOR];
    assert_eq!(truth.positions[tvc_jet::LEFT_ELEVATOR], trim + 0.05);
    assert!(truth.deflections[tvc_jet::ENGINE] < flight.plant.trim().thrust_n);
    assert_eq!(truth.fault_codes.as_array().iter().filter(|code| **code != 0).count(), 3);
}

#[test]
fn a_fault_of_the_scenario_and_the_same_on_request_fly_the_same_bits() {
    let at = SimTime::from_micros(123_457);
    for effector in tvc_jet::ALL {
        for kind in every_kind(effector) {
            let timing = Timing { duration_s: Some(0.06), ..Timing::at(at) };
            let mut written =
                Flight::with(vec![ScheduledFault { target: effector.into(), kind, timing }]);
            let mut requested = Flight::new();
            requested.inject(effector, kind, timing);
            for tick in 0..120 {
                wave(&mut written, tick);
                wave(&mut requested, tick);
                assert_eq!(written.fly(1), requested.fly(1), "{effector:?} {kind:?}");
            }
        }
    }
}

fn any_kind() -> impl Strategy<Value = FaultKind> {
    let value = prop_oneof![
        -1.0_f64..1.0,
        -1.0e5..1.0e5_f64,
        Just(0.0),
        Just(f64::NAN),
        Just(f64::INFINITY)
    ];
    (0_u8..=16, [value.clone(), value])
        .prop_filter_map("no such code", |(code, values)| FaultKind::from_code(code, values))
}

fn any_timing() -> impl Strategy<Value = Timing> {
    let seconds = prop_oneof![Just(0.0), 0.0..0.2_f64, Just(f64::NAN), Just(-1.0)];
    let onset = prop_oneof![
        Just(Onset::AtOnce),
        (0_u64..600_000).prop_map(|us| Onset::At(SimTime::from_micros(us)))
    ];
    let repeat = proptest::option::of((0.05..0.4_f64, proptest::option::of(0_u32..4)));
    (onset, seconds.clone(), proptest::option::of(seconds), repeat).prop_map(
        |(onset, ramp_s, duration_s, repeat)| {
            let repeat = repeat.map(|(every_s, times)| Repeat { every_s, times });
            Timing { onset, ramp_s, duration_s, repeat }
        },
    )
}

fn any_request() -> impl Strategy<Value = FaultRequest> {
    let effector = (0..tvc_jet::ALL.len()).prop_map(|i| Effector::from_index(i).unwrap());
    prop_oneof![
        12 => (effector.clone(), any_kind(), any_timing()).prop_map(|(effector, kind, timing)| {
            FaultRequest::Inject { target: effector.into(), kind, timing }
        }),
        12 => effector.clone().prop_flat_map(|effector| {
            (proptest::sample::select(every_kind(effector)), any_timing()).prop_map(
                move |(kind, timing)| FaultRequest::Inject { target: effector.into(), kind, timing },
            )
        }),
        2 => effector.prop_map(|effector| FaultRequest::Clear { target: effector.into() }),
        1 => Just(FaultRequest::ClearAll),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn no_sequence_of_requests_leaves_the_travel_or_a_trace(
        requests in proptest::collection::vec((any_request(), 0_u32..40), 1..30)
    ) {
        let (mut flight, mut twin) = (Flight::new(), Flight::new());
        let mut tick = 0;
        for (request, ticks) in requests {
            flight.plant.request(&request);
            twin.plant.request(&request);
            for _ in 0..ticks {
                wave(&mut flight, tick);
                wave(&mut twin, tick);
                tick += 1;
                let truth = flight.fly(1);
                prop_assert_eq!(truth, twin.fly(1));
                for effector in tvc_jet::ALL {
                    let servo = servos()[effector];
                    let low = if tvc_jet::effectors().is_angle(effector) { servo.min } else { 0.0 };
                    let here = truth.positions[effector];
                    // Rounding of the integration.
                    let slack = 1e-9 * (servo.max - servo.min);
                    prop_assert!(
                        (low - slack..=servo.max + slack).contains(&here),
                        "{:?} at {}", effector, here
                    );
                    prop_assert!(truth.deflections[effector].is_finite());
                }
            }
        }
        flight.plant.request(&FaultRequest::ClearAll);
        let faults = &flight.plant.faults;
        prop_assert_eq!(*faults.effects(), Effects::none());
        prop_assert_eq!(faults.received(), faults.commands());
        prop_assert_eq!(faults.next_event(), None);
        prop_assert!(!faults.varies() && !flight.plant.is_broken());
    }
}
