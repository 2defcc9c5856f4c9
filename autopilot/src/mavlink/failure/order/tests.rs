use super::*;
use crate::config::{self, DEFAULT_BELIEF};
use ::mavlink::dialects::common::MavResult;
use icd::SimTime;
use icd::tvc_jet;

fn belief() -> Belief {
    config::belief("belief", DEFAULT_BELIEF).unwrap()
}

fn parameters(settings: &[(&str, f64)]) -> Parameters {
    let mut parameters = Parameters::default();
    parameters.set_all(settings.iter().copied()).unwrap();
    parameters
}

fn order(unit: Unit, failure_type: FailureType) -> FaultOrder {
    FaultOrder::new(unit, failure_type, Instances::One(1))
}

/// Kind and timing of an order for one effector, or the reason.
fn fault(order: &FaultOrder, settings: &[(&str, f64)]) -> Result<(FaultKind, Timing), String> {
    match requests(order, &parameters(settings), &belief()).map(|requests| requests.to_vec()) {
        Ok(requests) => match requests[..] {
            [FaultRequest::Inject { kind, timing, .. }] => Ok((kind, timing)),
            _ => panic!("{requests:?}"),
        },
        Err(refused) => {
            assert_eq!(refused.result, MavResult::MAV_RESULT_DENIED);
            Err(refused.reason.unwrap())
        }
    }
}

fn kind_of(unit: Unit, failure_type: FailureType, settings: &[(&str, f64)]) -> FaultKind {
    fault(&order(unit, failure_type), settings).unwrap().0
}

#[test]
fn what_an_order_leaves_open_comes_from_the_parameters() {
    use FailureType as T;
    let deg = f64::to_radians;
    let travel = Travel::AtActuatorRate;
    let stuck = [("FLT_STUCK_MODE", 1.0), ("FLT_STUCK_DEG", -7.0), ("FLT_STUCK_RATE", 1.0)];
    for (failure_type, settings, kind) in [
        (T::Off, &[][..], FaultKind::Float),
        (T::Float, &[], FaultKind::Float),
        (T::Stuck, &stuck[1..], FaultKind::StuckHere),
        (T::Stuck, &stuck, FaultKind::StuckAt { angle_rad: deg(-7.0), travel }),
        (
            T::Garbage,
            &[("FLT_OSC_DEG", 3.0), ("FLT_OSC_HZ", 1.5)],
            FaultKind::Oscillating { amplitude: deg(3.0), frequency_hz: 1.5 },
        ),
        (T::Oscillate, &[], FaultKind::Oscillating { amplitude: deg(5.0), frequency_hz: 2.0 }),
        (T::Wrong, &[], FaultKind::PartialLoss { remaining: 0.5 }),
        (T::Wrong, &[("FLT_LOE_PCT", 20.0)], FaultKind::PartialLoss { remaining: 0.2 }),
        (
            T::Wrong,
            &[("FLT_WRONG_MODE", 1.0), ("FLT_BIAS_DEG", -4.0)],
            FaultKind::Biased { bias: deg(-4.0) },
        ),
        (T::Wrong, &[("FLT_WRONG_MODE", 2.0)], FaultKind::HardOver { side: Side::Positive }),
        (T::Wrong, &[("FLT_WRONG_MODE", 3.0)], FaultKind::HardOver { side: Side::Negative }),
        (
            T::Wrong,
            &[("FLT_WRONG_MODE", 4.0), ("FLT_LIMIT_DEG", 3.0)],
            FaultKind::LimitedTravel { limit: deg(3.0) },
        ),
        (T::Loss, &[("FLT_WRONG_MODE", 1.0)], FaultKind::PartialLoss { remaining: 0.5 }),
        (T::Bias, &[], FaultKind::Biased { bias: deg(5.0) }),
        (T::Limit, &[], FaultKind::LimitedTravel { limit: deg(5.0) }),
        (T::HardOver, &[], FaultKind::HardOver { side: Side::Positive }),
        (T::Slow, &[("FLT_RATE_DPS", 12.0)], FaultKind::Slow { rate: deg(12.0) }),
        (T::Delayed, &[("FLT_DELAY_MS", 150.0)], FaultKind::Delayed { delay_s: 0.15 }),
        (
            T::Intermittent,
            &[("FLT_DUTY_PCT", 30.0), ("FLT_PERIOD_S", 0.5)],
            FaultKind::Intermittent { period_s: 0.5, present: 0.3 },
        ),
        (T::Drift, &[("FLT_DRIFT_DPS", -2.0)], FaultKind::Drifting { rate: deg(-2.0) }),
    ] {
        assert_eq!(kind_of(Unit::SERVO, failure_type, settings), kind, "{failure_type:?}");
    }
}

#[test]
fn the_engines_sizes_are_percent_of_its_largest_thrust() {
    use FailureType as T;
    let largest = belief().effectors.thrust_range_n()[1];
    let newtons = 0.2 * largest;
    let mode = |mode| [("FLT_ENG_PCT", 20.0), ("FLT_WRONG_MODE", mode)];
    for (failure_type, mode, kind) in [
        (T::Off, mode(0.0), FaultKind::FlameOut),
        (T::FlameOut, mode(0.0), FaultKind::FlameOut),
        (T::Stuck, mode(0.0), FaultKind::StuckHere),
        (T::Garbage, mode(0.0), FaultKind::Oscillating { amplitude: newtons, frequency_hz: 2.0 }),
        (T::Wrong, mode(0.0), FaultKind::PartialLoss { remaining: 0.5 }),
        (T::Wrong, mode(1.0), FaultKind::Biased { bias: newtons }),
        (T::Wrong, mode(4.0), FaultKind::LimitedTravel { limit: newtons }),
        (T::Slow, mode(0.0), FaultKind::Slow { rate: newtons }),
        (T::Drift, mode(0.0), FaultKind::Drifting { rate: newtons }),
    ] {
        assert_eq!(kind_of(Unit::MOTOR, failure_type, &mode), kind, "{failure_type:?}");
    }
    let bias = FaultOrder { value: Some(Value::Bias(-30.0)), ..order(Unit::MOTOR, T::Bias) };
    assert_eq!(fault(&bias, &[]).unwrap().0, FaultKind::Biased { bias: -0.3 * largest });
    // With an angle in the parameters the engine is stuck where it is.
    assert_eq!(kind_of(Unit::MOTOR, T::Stuck, &[("FLT_STUCK_MODE", 1.0)]), FaultKind::StuckHere);
}

#[test]
fn what_an_effector_cannot_have_is_refused_with_its_name() {
    use FailureType as T;
    let none = "this effector has no such fault";
    for (order, settings, reason) in [
        (order(Unit::MOTOR, T::Float), &[][..], none),
        (order(Unit::MOTOR, T::HardOver), &[], none),
        (order(Unit::MOTOR, T::Wrong), &[("FLT_WRONG_MODE", 2.0)], none),
        (order(Unit::SERVO, T::FlameOut), &[], none),
        (FaultOrder { value: Some(Value::Angle(3.0)), ..order(Unit::MOTOR, T::Stuck) }, &[], none),
        (order(Unit::MOTOR, T::Slow), &[("FLT_ENG_PCT", -5.0)], "FLT_ENG_PCT must be above 0"),
    ] {
        let refused = fault(&order, settings).unwrap_err();
        let effector = if order.unit == Unit::SERVO { "left aileron: " } else { "engine: " };
        assert!(refused.contains(reason) && refused.contains(effector), "{refused}");
    }
}

#[test]
fn an_order_says_everything_that_a_fault_can_be() {
    let whole = FaultOrder {
        value: Some(Value::Amplitude(3.0)),
        frequency_hz: Some(4.0),
        onset: Onset::At(SimTime::from_micros(5_000_000)),
        ramp_s: Some(1.0),
        duration_s: Some(10.0),
        every_s: Some(30.0),
        times: Some(3),
        ..order(Unit::SERVO, FailureType::Oscillate)
    };
    let timing = Timing {
        onset: Onset::At(SimTime::from_micros(5_000_000)),
        ramp_s: 1.0,
        duration_s: Some(10.0),
        repeat: Some(Repeat { every_s: 30.0, times: Some(3) }),
    };
    let amplitude = 3.0_f64.to_radians();
    let kind = FaultKind::Oscillating { amplitude, frequency_hz: 4.0 };
    let by_parameters = [("FLT_OSC_HZ", 9.0), ("FLT_RAMP_S", 7.0), ("FLT_DUR_S", 2.0)];
    assert_eq!(fault(&whole, &by_parameters), Ok((kind, timing)));

    let here = order(Unit::SERVO, FailureType::Stuck);
    let here = FaultOrder { value: Some(Value::Here), ..here };
    assert_eq!(fault(&here, &[("FLT_STUCK_MODE", 1.0)]).unwrap().0, FaultKind::StuckHere);
    let travel = Travel::AtActuatorRate;
    let at = FaultOrder { value: Some(Value::Angle(10.0)), travel: Some(travel), ..here };
    let angle_rad = 10.0_f64.to_radians();
    assert_eq!(fault(&at, &[]).unwrap().0, FaultKind::StuckAt { angle_rad, travel });
}

#[test]
fn times_come_from_the_parameters_and_a_ramp_only_where_there_is_a_size() {
    let settings =
        [("FLT_RAMP_S", 2.0), ("FLT_DUR_S", 5.0), ("FLT_RPT_S", 20.0), ("FLT_RPT_N", 4.0)];
    let timing = |failure_type| fault(&order(Unit::SERVO, failure_type), &settings).unwrap().1;
    let repeat = Some(Repeat { every_s: 20.0, times: Some(4) });
    let whole = Timing { onset: Onset::AtOnce, ramp_s: 2.0, duration_s: Some(5.0), repeat };
    for failure_type in [FailureType::Wrong, FailureType::Bias, FailureType::Garbage] {
        assert_eq!(timing(failure_type), whole, "{failure_type:?}");
    }
    for failure_type in [FailureType::Stuck, FailureType::HardOver] {
        assert_eq!(timing(failure_type), Timing { ramp_s: 0.0, ..whole }, "{failure_type:?}");
    }
    let once = [("FLT_DUR_S", 5.0), ("FLT_RPT_S", 20.0), ("FLT_RPT_N", 1.0)];
    let (_, timing) = fault(&order(Unit::SERVO, FailureType::Stuck), &once).unwrap();
    assert_eq!(timing, Timing { duration_s: Some(5.0), ..Timing::NOW });
    let (_, timing) = fault(&order(Unit::SERVO, FailureType::Stuck), &once[..2]).unwrap();
    assert_eq!(timing.repeat, Some(Repeat { every_s: 20.0, times: None }));
}

#[test]
fn times_that_do_not_fit_together_are_refused() {
    let stuck = order(Unit::SERVO, FailureType::Stuck);
    let no_duration = fault(&stuck, &[("FLT_RPT_S", 20.0)]).unwrap_err();
    assert!(no_duration.contains("needs a duration"), "{no_duration}");
    let too_often = fault(&stuck, &[("FLT_RPT_S", 5.0), ("FLT_DUR_S", 5.0)]).unwrap_err();
    assert!(too_often.contains("longer than the duration"), "{too_often}");
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        for order in [
            FaultOrder { ramp_s: Some(bad), ..stuck },
            FaultOrder { duration_s: Some(bad), ..stuck },
            FaultOrder { every_s: Some(bad), ..stuck },
            FaultOrder { period_s: Some(bad), ..stuck },
            FaultOrder { frequency_hz: Some(bad), ..stuck },
        ] {
            assert!(fault(&order, &[]).is_err(), "{order:?}");
        }
    }
    let ramp = FaultOrder { ramp_s: Some(1.0), ..stuck };
    assert!(fault(&ramp, &[]).unwrap_err().contains("no size"));
    let mended_later = FaultOrder { duration_s: Some(1.0), ..order(Unit::SERVO, FailureType::Ok) };
    assert!(fault(&mended_later, &[]).unwrap_err().contains("mended at once"));
}

#[test]
fn with_fault_injection_off_nothing_is_asked() {
    let refused = fault(&order(Unit::SERVO, FailureType::Stuck), &[("SYS_FAILURE_EN", 0.0)]);
    assert!(refused.unwrap_err().contains("SYS_FAILURE_EN 0"));
}

/// Kinds at, just inside and just outside every limit of the plant's aircraft.
fn kinds_near_the_limits(effector: Effector, reach: &Reach) -> Vec<FaultKind> {
    let half = 0.5 * (reach.max - reach.min);
    let fastest = reach.fastest.unwrap();
    let near = |limit: f64| [0.9 * limit, limit, 1.1 * limit, -0.9 * limit, -1.1 * limit];
    let mut kinds = Vec::new();
    for size in near(half).into_iter().chain(near(reach.max)) {
        kinds.push(FaultKind::Oscillating { amplitude: size, frequency_hz: 1.0 });
        kinds.push(FaultKind::Biased { bias: size });
        kinds.push(FaultKind::LimitedTravel { limit: size });
        if tvc_jet::effectors().is_angle(effector) {
            kinds.push(FaultKind::StuckAt { angle_rad: size, travel: Travel::Jump });
        }
    }
    for rate in near(fastest).into_iter().chain(near(1.0e-3 * fastest)) {
        kinds.push(FaultKind::Slow { rate });
        kinds.push(FaultKind::Drifting { rate });
    }
    kinds
}

#[test]
fn what_passes_here_passes_in_the_plant_and_nothing_else_does() {
    let belief = belief();
    let mut refused = 0;
    // The aircraft's own numbers, before they are rounded for the belief.
    for (effector, travel_deg, rate_deg_s) in [
        (tvc_jet::LEFT_AILERON, 25.0_f64, 80.0_f64),
        (tvc_jet::RIGHT_ELEVATOR, 30.0, 80.0),
        (tvc_jet::RUDDER, 30.0, 80.0),
        (tvc_jet::NOZZLE_YAW, 15.0, 60.0),
    ] {
        let max = travel_deg.to_radians();
        let plant =
            Reach { is_angle: true, min: -max, max, fastest: Some(rate_deg_s.to_radians()) };
        for kind in kinds_near_the_limits(effector, &plant) {
            let there = fault::check(&kind, &Timing::NOW, &plant);
            let here = check(effector, &kind, &Timing::NOW, &belief);
            assert_eq!(here.is_ok(), there.is_ok(), "{effector:?} {kind:?}: {here:?} {there:?}");
            refused += usize::from(there.is_err());
        }
    }
    assert!(refused > 100, "{refused}");
}

#[test]
fn times_that_the_plant_refuses_are_refused_for_all() {
    let loss = FaultOrder { instances: Instances::All, ..order(Unit::SERVO, FailureType::Loss) };
    for (order, words) in [
        (FaultOrder { ramp_s: Some(3_601.0), ..loss }, "ramp 3601 is outside 0 to 3600 s"),
        (
            FaultOrder { ramp_s: Some(5.0), duration_s: Some(2.0), ..loss },
            "duration 2 s is outside 5 to",
        ),
        (
            FaultOrder { duration_s: Some(0.02), every_s: Some(0.05), ..loss },
            "repetition 0.05 s is outside 0.1 to",
        ),
        (
            FaultOrder { duration_s: Some(1.0), every_s: Some(2.0), times: Some(1_001), ..loss },
            "number of repetitions 1001 times is outside 2 to 1000 times",
        ),
    ] {
        let refused = fault(&order, &[]).unwrap_err();
        assert!(refused.contains(words), "{refused}");
    }
    let period =
        FaultOrder { period_s: Some(61.0), ..order(Unit::SERVO, FailureType::Intermittent) };
    assert!(fault(&period, &[]).unwrap_err().contains("period 61 is outside 0.02 to 60 s"));
}
