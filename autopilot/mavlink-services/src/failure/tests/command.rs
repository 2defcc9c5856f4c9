use super::super::*;
use ::mavlink::dialects::common::MavResult;
use aircraft::DEFAULT_MODEL;
use flight_management::configuration;
use icd::SimTime;
use icd::fault::{CATALOGUE, Onset, Repeat, Side, Travel};
use icd::tvc_jet;

fn model() -> AircraftModel {
    configuration::aircraft_model("model", DEFAULT_MODEL).unwrap()
}

fn parameters(settings: &[(&str, f64)]) -> Parameters {
    let mut parameters = Parameters::default();
    parameters.set_all(settings.iter().copied()).unwrap();
    parameters
}

fn command(unit: Unit, failure: &str) -> FaultCommand {
    FaultCommand::new(unit, Failure::parse(failure).unwrap(), Instances::One(1))
}

/// A size as written in the shell.
fn value(failure: &str, text: &str) -> Option<SizedKind> {
    let class = if text.ends_with('%') { TargetClass::Thrust } else { TargetClass::Angle };
    Some(SizedKind::read(Failure::parse(failure).unwrap(), text, class).unwrap())
}

fn numbers(given: &[(Quantity, f64)]) -> Numbers {
    let mut numbers = Numbers::NONE;
    given.iter().for_each(|(what, value)| numbers.set(*what, *value));
    numbers
}

/// Kind and timing of a command for one effector, or the reason.
fn fault(command: &FaultCommand, settings: &[(&str, f64)]) -> Result<(FaultKind, Timing), String> {
    match requests(command, &parameters(settings), &model()).map(|requests| requests.to_vec()) {
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

fn kind_of(unit: Unit, failure: &str, settings: &[(&str, f64)]) -> FaultKind {
    fault(&command(unit, failure), settings).unwrap().0
}

#[test]
fn values_that_a_command_leaves_open_come_from_the_parameters() {
    let deg = f64::to_radians;
    let travel = Travel::AtActuatorRate;
    let stuck = [("FLT_STUCK_MODE", 1.0), ("FLT_STUCK_DEG", -7.0), ("FLT_STUCK_RATE", 1.0)];
    for (failure_type, settings, kind) in [
        ("off", &[][..], FaultKind::Float),
        ("float", &[], FaultKind::Float),
        ("stuck", &stuck[1..], FaultKind::StuckHere),
        ("stuck", &stuck, FaultKind::StuckAt { angle_rad: deg(-7.0), travel }),
        (
            "garbage",
            &[("FLT_OSC_DEG", 3.0), ("FLT_OSC_HZ", 1.5)],
            FaultKind::Oscillating { amplitude: deg(3.0), frequency_hz: 1.5 },
        ),
        ("oscillate", &[], FaultKind::Oscillating { amplitude: deg(5.0), frequency_hz: 2.0 }),
        ("wrong", &[], FaultKind::PartialLoss { remaining: 0.5 }),
        ("wrong", &[("FLT_LOE_PCT", 20.0)], FaultKind::PartialLoss { remaining: 0.2 }),
        (
            "wrong",
            &[("FLT_WRONG_MODE", 1.0), ("FLT_BIAS_DEG", -4.0)],
            FaultKind::Biased { bias: deg(-4.0) },
        ),
        ("wrong", &[("FLT_WRONG_MODE", 2.0)], FaultKind::HardOver { side: Side::Positive }),
        ("wrong", &[("FLT_WRONG_MODE", 3.0)], FaultKind::HardOver { side: Side::Negative }),
        (
            "wrong",
            &[("FLT_WRONG_MODE", 4.0), ("FLT_LIMIT_DEG", 3.0)],
            FaultKind::LimitedTravel { limit: deg(3.0) },
        ),
        ("loss", &[("FLT_WRONG_MODE", 1.0)], FaultKind::PartialLoss { remaining: 0.5 }),
        ("bias", &[], FaultKind::Biased { bias: deg(5.0) }),
        ("limit", &[], FaultKind::LimitedTravel { limit: deg(5.0) }),
        ("hardover", &[], FaultKind::HardOver { side: Side::Positive }),
        ("slow", &[("FLT_RATE_DPS", 12.0)], FaultKind::Slow { rate: deg(12.0) }),
        ("delayed", &[("FLT_DELAY_MS", 150.0)], FaultKind::Delayed { delay_s: 0.15 }),
        (
            "intermittent",
            &[("FLT_DUTY_PCT", 30.0), ("FLT_PERIOD_S", 0.5)],
            FaultKind::Intermittent { period_s: 0.5, present: 0.3 },
        ),
        ("drift", &[("FLT_DRIFT_DPS", -2.0)], FaultKind::Drifting { rate: deg(-2.0) }),
    ] {
        assert_eq!(kind_of(Unit::SERVO, failure_type, settings), kind, "{failure_type:?}");
    }
}

#[test]
fn the_engines_sizes_are_percent_of_its_largest_thrust() {
    let largest = model().effectors.thrust_range_n()[1];
    let newtons = 0.2 * largest;
    let mode = |mode| [("FLT_ENG_PCT", 20.0), ("FLT_WRONG_MODE", mode)];
    for (failure_type, mode, kind) in [
        ("off", mode(0.0), FaultKind::FlameOut),
        ("flameout", mode(0.0), FaultKind::FlameOut),
        ("stuck", mode(0.0), FaultKind::StuckHere),
        ("garbage", mode(0.0), FaultKind::Oscillating { amplitude: newtons, frequency_hz: 2.0 }),
        ("wrong", mode(0.0), FaultKind::PartialLoss { remaining: 0.5 }),
        ("wrong", mode(1.0), FaultKind::Biased { bias: newtons }),
        ("wrong", mode(4.0), FaultKind::LimitedTravel { limit: newtons }),
        ("slow", mode(0.0), FaultKind::Slow { rate: newtons }),
        ("drift", mode(0.0), FaultKind::Drifting { rate: newtons }),
    ] {
        assert_eq!(kind_of(Unit::MOTOR, failure_type, &mode), kind, "{failure_type:?}");
    }
    let bias = FaultCommand { value: value("bias", "-30%"), ..command(Unit::MOTOR, "bias") };
    assert_eq!(fault(&bias, &[]).unwrap().0, FaultKind::Biased { bias: -0.3 * largest });
    // With an angle in the parameters the engine sticks at its present thrust.
    assert_eq!(kind_of(Unit::MOTOR, "stuck", &[("FLT_STUCK_MODE", 1.0)]), FaultKind::StuckHere);
}

#[test]
fn every_kind_can_be_commanded_by_its_value_its_name_and_the_mode_of_its_type() {
    for info in &CATALOGUE {
        let unit = match info.targets {
            fault::Targets { angles: true, .. } => Unit::SERVO,
            fault::Targets { thrust: true, .. } => Unit::MOTOR,
            fault::Targets { parts: true, .. } => Unit::parse("fin").unwrap(),
            _ => Unit::parse("gps").unwrap(),
        };
        let mavlink = &info.mavlink;
        let failure = Failure::Type(mavlink.failure_type);
        let by_type = FaultCommand::new(unit, failure, Instances::One(1));
        let kind_by = |command: &FaultCommand, settings: &[(&str, f64)]| {
            fault(command, settings).unwrap_or_else(|reason| panic!("{}: {reason}", info.key)).0
        };
        if let Some(code) = mavlink.user_1 {
            let value = Some(SizedKind::of_user_1(code.into(), 1.0).unwrap());
            let kind = kind_by(&FaultCommand { value, ..by_type }, &[]);
            assert_eq!(kind.info().key, info.key, "by its value");
        }
        let by_word = match mavlink.word.and_then(Failure::parse) {
            Some(failure) => FaultCommand { failure, ..by_type },
            None => by_type,
        };
        let usual = kind_by(&by_word, &[]);
        match mavlink.failure_type.mode() {
            Some(mode) => {
                for place in 0..mavlink.mode.len() as u8 {
                    let set = [(mode.name, f64::from(mavlink.first_mode + place))];
                    let kind = kind_by(&by_type, &set);
                    assert_eq!((kind.info().key, kind.code()), (info.key, info.code + place));
                }
            }
            None => assert_eq!(usual.info().key, info.key, "by its word or type"),
        }
        // Another size by each parameter is another fault.
        for number in usual.info().numbers {
            let parameter = number.parameter;
            let other = 0.5 * parameter.default + 0.01 * parameter.max;
            let changed = kind_by(&by_word, &[(parameter.name, other)]);
            assert_ne!(changed, usual, "{}", parameter.name);
        }
    }
}

#[test]
fn a_fault_that_an_effector_cannot_have_is_refused_with_its_name() {
    let none = "this effector has no such fault";
    for (command, settings, reason) in [
        (command(Unit::MOTOR, "float"), &[][..], none),
        (command(Unit::MOTOR, "hardover"), &[], none),
        (command(Unit::MOTOR, "wrong"), &[("FLT_WRONG_MODE", 2.0)], none),
        (command(Unit::SERVO, "flameout"), &[], none),
        (
            FaultCommand { value: value("stuck", "3deg"), ..command(Unit::MOTOR, "stuck") },
            &[],
            none,
        ),
        (command(Unit::MOTOR, "slow"), &[("FLT_ENG_PCT", -5.0)], "FLT_ENG_PCT must be above 0"),
    ] {
        let refused = fault(&command, settings).unwrap_err();
        let effector = if command.unit == Unit::SERVO { "left aileron: " } else { "engine: " };
        assert!(refused.contains(reason) && refused.contains(effector), "{refused}");
    }
}

#[test]
fn a_command_can_describe_every_fault() {
    let whole = FaultCommand {
        value: value("oscillate", "3deg"),
        numbers: numbers(&[
            (Quantity::Frequency, 4.0),
            (Quantity::Onset, 5.0),
            (Quantity::Ramp, 1.0),
            (Quantity::Duration, 10.0),
            (Quantity::Every, 30.0),
            (Quantity::Times, 3.0),
        ]),
        ..command(Unit::SERVO, "oscillate")
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

    let here = command(Unit::SERVO, "stuck");
    let here = FaultCommand { value: value("stuck", "here"), ..here };
    assert_eq!(fault(&here, &[("FLT_STUCK_MODE", 1.0)]).unwrap().0, FaultKind::StuckHere);
    let travel = Travel::AtActuatorRate;
    let at = FaultCommand { value: value("stuck", "10deg"), ..here };
    let angle_rad = 10.0_f64.to_radians();
    let slowly = [("FLT_STUCK_RATE", 1.0)];
    assert_eq!(fault(&at, &slowly).unwrap().0, FaultKind::StuckAt { angle_rad, travel });
}

#[test]
fn times_come_from_the_parameters_and_a_ramp_only_where_there_is_a_size() {
    let settings =
        [("FLT_RAMP_S", 2.0), ("FLT_DUR_S", 5.0), ("FLT_RPT_S", 20.0), ("FLT_RPT_N", 4.0)];
    let timing = |failure_type| fault(&command(Unit::SERVO, failure_type), &settings).unwrap().1;
    let repeat = Some(Repeat { every_s: 20.0, times: Some(4) });
    let whole = Timing { onset: Onset::AtOnce, ramp_s: 2.0, duration_s: Some(5.0), repeat };
    for failure_type in ["wrong", "bias", "garbage"] {
        assert_eq!(timing(failure_type), whole, "{failure_type:?}");
    }
    for failure_type in ["stuck", "hardover"] {
        assert_eq!(timing(failure_type), Timing { ramp_s: 0.0, ..whole }, "{failure_type:?}");
    }
    let once = [("FLT_DUR_S", 5.0), ("FLT_RPT_S", 20.0), ("FLT_RPT_N", 1.0)];
    let (_, timing) = fault(&command(Unit::SERVO, "stuck"), &once).unwrap();
    assert_eq!(timing, Timing { duration_s: Some(5.0), ..Timing::NOW });
    let (_, timing) = fault(&command(Unit::SERVO, "stuck"), &once[..2]).unwrap();
    assert_eq!(timing.repeat, Some(Repeat { every_s: 20.0, times: None }));
}

#[test]
fn times_that_do_not_fit_together_are_refused() {
    let stuck = command(Unit::SERVO, "stuck");
    let (intermittent, garbage) =
        (command(Unit::SERVO, "intermittent"), command(Unit::SERVO, "garbage"));
    let no_duration = fault(&stuck, &[("FLT_RPT_S", 20.0)]).unwrap_err();
    assert!(no_duration.contains("needs a duration"), "{no_duration}");
    let too_often = fault(&stuck, &[("FLT_RPT_S", 5.0), ("FLT_DUR_S", 5.0)]).unwrap_err();
    assert!(too_often.contains("repetition 5 s is outside 5.000001 to"), "{too_often}");
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        for command in [
            FaultCommand { numbers: numbers(&[(Quantity::Ramp, bad)]), ..garbage },
            FaultCommand { numbers: numbers(&[(Quantity::Duration, bad)]), ..stuck },
            FaultCommand { numbers: numbers(&[(Quantity::Every, bad)]), ..stuck },
            FaultCommand { numbers: numbers(&[(Quantity::Times, bad)]), ..stuck },
            FaultCommand { numbers: numbers(&[(Quantity::Onset, bad)]), ..stuck },
            FaultCommand { numbers: numbers(&[(Quantity::Period, bad)]), ..intermittent },
            FaultCommand { numbers: numbers(&[(Quantity::Frequency, bad)]), ..garbage },
        ] {
            assert!(fault(&command, &[]).is_err(), "{command:?}");
        }
    }
    let no_such_number = FaultCommand { numbers: numbers(&[(Quantity::Frequency, 2.0)]), ..stuck };
    assert!(fault(&no_such_number, &[]).unwrap_err().contains("takes no frequency"));
    let ramp = FaultCommand { numbers: numbers(&[(Quantity::Ramp, 1.0)]), ..stuck };
    assert!(fault(&ramp, &[]).unwrap_err().contains("this kind of fault has no ramp"));
    let mended_later = FaultCommand {
        numbers: numbers(&[(Quantity::Duration, 1.0)]),
        ..command(Unit::SERVO, "ok")
    };
    assert!(fault(&mended_later, &[]).unwrap_err().contains("mended at once"));
}

#[test]
fn with_fault_injection_off_nothing_is_requested() {
    let refused = fault(&command(Unit::SERVO, "stuck"), &[("SYS_FAILURE_EN", 0.0)]);
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
fn values_are_accepted_here_exactly_if_the_plant_accepts_them() {
    let model = model();
    let mut refused = 0;
    // The aircraft's own numbers, before they are rounded for the model.
    for (effector, travel_deg, rate_deg_s) in [
        (tvc_jet::LEFT_AILERON, 25.0_f64, 80.0_f64),
        (tvc_jet::RIGHT_ELEVATOR, 30.0, 80.0),
        (tvc_jet::RUDDER, 30.0, 80.0),
        (tvc_jet::NOZZLE_YAW, 15.0, 60.0),
    ] {
        let max = travel_deg.to_radians();
        let fastest = Some(rate_deg_s.to_radians());
        let plant = Reach { class: TargetClass::Angle, min: -max, max, fastest };
        for kind in kinds_near_the_limits(effector, &plant) {
            let there = fault::check(&kind, &Timing::NOW, &plant);
            let here = check(effector.into(), &kind, &Timing::NOW, &model);
            assert_eq!(here.is_ok(), there.is_ok(), "{effector:?} {kind:?}: {here:?} {there:?}");
            refused += usize::from(there.is_err());
        }
    }
    assert!(refused > 100, "{refused}");
}

#[test]
fn times_that_the_plant_refuses_are_refused_for_all() {
    let loss = FaultCommand { instances: Instances::All, ..command(Unit::SERVO, "loss") };
    use Quantity::{Duration, Every, Ramp, Times};
    for (times, words) in [
        (&[(Ramp, 3_601.0)][..], "ramp 3601 s is outside 0 to 3600 s"),
        (&[(Ramp, 5.0), (Duration, 2.0)], "duration 2 s is outside 5 to"),
        (&[(Duration, 0.02), (Every, 0.05)], "repetition 0.05 s is outside 0.1 to"),
        (
            &[(Duration, 1.0), (Every, 2.0), (Times, 1_001.0)],
            "number of repetitions 1001 times is outside 2 to 1000 times",
        ),
        (
            &[(Duration, 1.0), (Every, 2.0), (Times, 2.5)],
            "number of repetitions 2.5 is no whole number",
        ),
    ] {
        let refused = fault(&FaultCommand { numbers: numbers(times), ..loss }, &[]).unwrap_err();
        assert!(refused.contains(words), "{refused}");
    }
    let period = FaultCommand {
        numbers: numbers(&[(Quantity::Period, 61.0)]),
        ..command(Unit::SERVO, "intermittent")
    };
    assert!(fault(&period, &[]).unwrap_err().contains("period 61 s is outside 0.02 to 60 s"));
}
