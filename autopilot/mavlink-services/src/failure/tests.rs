use super::*;
use ::mavlink::dialects::common::MavResult;
use aircraft::DEFAULT_MODEL;
use flight_management::configuration;
use flight_management::parameters::Parameters;
use icd::fault::{FaultKind, Side, Timing, Travel};
use icd::tvc_jet;
use icd::{FaultRequest, SimTime};

impl Unit {
    const MOTOR: Self = Self(Target::MOTOR.0 as i32);
    /// The actuators that deflect: surfaces and nozzle.
    const SERVO: Self = Self(Target::SERVO.0 as i32);
}

mod command;
mod units;

const NAN: f32 = f32::NAN;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
const UNSUPPORTED: MavResult = MavResult::MAV_RESULT_UNSUPPORTED;

fn requested(id: u16, params: [f32; 7]) -> Result<Vec<FaultRequest>, MavResult> {
    let command = CommandMessage { id, params, frame: None, xy: None };
    let model = configuration::aircraft_model("model", DEFAULT_MODEL).unwrap();
    let fault = parse(&command, &model.effectors.list);
    let requests = fault.and_then(|fault| requests(&fault, &Parameters::default(), &model));
    requests.map(|requests| requests.to_vec()).map_err(|refused| {
        assert!(refused.reason.is_some(), "a refusal has a reason");
        refused.result
    })
}

fn inject(p1: f32, p2: f32, p3: f32, p4: f32) -> Result<Vec<FaultRequest>, MavResult> {
    requested(INJECT_FAILURE, [p1, p2, p3, p4, NAN, NAN, NAN])
}

/// USER_1 for the left elevator.
fn user(p2: f32, p4: f32, p5: f32, p6: f32, p7: f32) -> Result<Vec<FaultRequest>, MavResult> {
    requested(USER_1, [102.0, p2, 3.0, p4, p5, p6, p7])
}

#[test]
fn instances_are_the_documented_effectors() {
    let servos = [
        tvc_jet::LEFT_AILERON,
        tvc_jet::RIGHT_AILERON,
        tvc_jet::LEFT_ELEVATOR,
        tvc_jet::RIGHT_ELEVATOR,
        tvc_jet::RUDDER,
        tvc_jet::NOZZLE_PITCH,
        tvc_jet::NOZZLE_YAW,
    ];
    for (instance, effector) in (1_u8..).zip(servos) {
        let requests = inject(102.0, 2.0, f32::from(instance), 0.0).unwrap();
        let kind = FaultKind::StuckHere;
        assert_eq!(
            requests,
            [FaultRequest::Inject { target: effector.into(), kind, timing: Timing::NOW }]
        );
        let (target, list) = (Target::from(effector), tvc_jet::effectors());
        assert_eq!((target.unit(&list).1, target.instance(&list)), ("servo", instance));
    }
    let requests = inject(101.0, 0.0, 1.0, 0.0).unwrap();
    assert_eq!(requests, [FaultRequest::Clear { target: tvc_jet::ENGINE.into() }]);
}

#[test]
fn zero_is_all_instances_and_a_mask_counts_only_without_an_instance() {
    assert_eq!(inject(102.0, 1.0, 0.0, 0.0).unwrap().len(), 7);
    assert_eq!(inject(102.0, 1.0, 2.0, 127.0).unwrap().len(), 1);
    let requests = inject(102.0, 1.0, NAN, 5.0).unwrap();
    let named: Vec<_> =
        requests.iter().filter_map(|request| request.target()?.effector()).collect();
    assert_eq!(named, [tvc_jet::LEFT_AILERON, tvc_jet::LEFT_ELEVATOR]);
    for mask in [0.0, NAN, 128.0, -1.0, 1.5] {
        assert_eq!(inject(102.0, 1.0, NAN, mask), Err(DENIED), "mask {mask}");
    }
}

#[test]
fn unknown_units_and_types_are_unsupported_and_odd_numbers_denied() {
    for unit in [5.0, 6.0, 7.0, 100.0, 103.0, 104.0, 105.0, 106.0, 107.0, 5_000.0, -3.0] {
        assert_eq!(inject(unit, 2.0, 1.0, 0.0), Err(UNSUPPORTED), "unit {unit}");
    }
    for failure_type in [9.0, 99.0, -1.0] {
        assert_eq!(inject(102.0, failure_type, 1.0, 0.0), Err(UNSUPPORTED), "type {failure_type}");
    }
    for odd in [NAN, f32::INFINITY, 102.5, 1.0e20] {
        assert_eq!(inject(odd, 2.0, 1.0, 0.0), Err(DENIED), "unit {odd}");
        assert_eq!(inject(102.0, odd, 1.0, 0.0), Err(DENIED), "type {odd}");
    }
    for instance in [8.0, -1.0, 1.5, f32::INFINITY] {
        assert_eq!(inject(102.0, 2.0, instance, 0.0), Err(DENIED), "instance {instance}");
    }
    assert_eq!(inject(101.0, 2.0, 2.0, 0.0), Err(DENIED));
}

#[test]
fn every_type_is_a_fault_of_a_servo_and_of_the_engine() {
    for failure_type in 1_u8..=8 {
        for unit in [101.0, 102.0] {
            let requests = inject(unit, failure_type.into(), 1.0, 0.0).unwrap();
            let [FaultRequest::Inject { kind, .. }] = requests[..] else { panic!("{requests:?}") };
            assert_eq!(kind.info().mavlink.failure_type.code(), failure_type, "{kind:?}");
        }
    }
}

#[test]
fn user_1_carries_each_kind_of_value_ramp_and_onset_exactly() {
    let effector = tvc_jet::LEFT_ELEVATOR;
    let deg = f64::to_radians;
    let jump = Travel::Jump;
    for (p2, p4, p5, kind) in [
        (2.0, 1.0, 30.0, FaultKind::StuckAt { angle_rad: deg(30.0), travel: jump }),
        (2.0, 1.0, 0.0, FaultKind::StuckAt { angle_rad: 0.0, travel: jump }),
        (4.0, 2.0, 40.0, FaultKind::PartialLoss { remaining: 0.4 }),
        (4.0, 2.0, 0.0, FaultKind::PartialLoss { remaining: 0.0 }),
        (4.0, 3.0, -2.5, FaultKind::Biased { bias: deg(-2.5) }),
        (5.0, 4.0, 12.0, FaultKind::Slow { rate: deg(12.0) }),
        (6.0, 5.0, 0.15, FaultKind::Delayed { delay_s: 0.15 }),
        (3.0, 6.0, 3.0, FaultKind::Oscillating { amplitude: deg(3.0), frequency_hz: 2.0 }),
        (7.0, 7.0, 20.0, FaultKind::Intermittent { period_s: 1.0, present: 0.2 }),
        (8.0, 8.0, -0.5, FaultKind::Drifting { rate: deg(-0.5) }),
        (4.0, 9.0, 6.0, FaultKind::LimitedTravel { limit: deg(6.0) }),
        (4.0, 10.0, 1.0, FaultKind::HardOver { side: Side::Positive }),
        (4.0, 10.0, -1.0, FaultKind::HardOver { side: Side::Negative }),
    ] {
        let timing = Timing::NOW;
        let expected = FaultRequest::Inject { target: effector.into(), kind, timing };
        assert_eq!(user(p2, p4, p5, 0.0, NAN), Ok(vec![expected]), "kind of value {p4}");
        let timing = Timing::at(SimTime::from_micros(12_300_000));
        let expected = FaultRequest::Inject { target: effector.into(), kind, timing };
        assert_eq!(user(p2, p4, p5, NAN, 12.3), Ok(vec![expected]), "kind of value {p4}, later");
    }
    let timing = Timing { ramp_s: 2.5, ..Timing::NOW };
    let kind = FaultKind::Biased { bias: deg(4.0) };
    let expected = FaultRequest::Inject { target: effector.into(), kind, timing };
    assert_eq!(user(4.0, 3.0, 4.0, 2.5, 0.0), Ok(vec![expected]));
}

#[test]
fn user_1_refuses_what_it_cannot_do() {
    assert_eq!(user(2.0, 1.0, NAN, 0.0, 0.0), Err(DENIED), "angle not finite");
    assert_eq!(user(4.0, 10.0, 1.0, 1.0, 0.0), Err(DENIED), "ramp of a hard over");
    assert_eq!(user(4.0, 3.0, 5.0, -1.0, 0.0), Err(DENIED), "negative ramp");
    assert_eq!(user(4.0, 3.0, 5.0, f32::INFINITY, 0.0), Err(DENIED), "infinite ramp");
    assert_eq!(user(2.0, 0.0, 5.0, 0.0, 0.0), Err(DENIED), "value without kind");
    assert_eq!(user(2.0, 2.0, 50.0, 0.0, 0.0), Err(DENIED), "stuck at percent");
    assert_eq!(user(1.0, 1.0, 5.0, 0.0, 0.0), Err(DENIED), "floating at an angle");
    assert_eq!(user(4.0, 10.0, 0.5, 0.0, 0.0), Err(DENIED), "half over");
    assert_eq!(user(4.0, 2.0, 101.0, 0.0, 0.0), Err(DENIED), "more than all");
    assert_eq!(user(5.0, 4.0, 0.0, 0.0, 0.0), Err(DENIED), "no speed at all");
    assert_eq!(user(6.0, 5.0, 1.5, 0.0, 0.0), Err(DENIED), "too late");
    assert_eq!(user(0.0, 0.0, 0.0, 0.0, 5.0), Err(DENIED), "clear later");
    for kind in [13.0, -1.0, 77.0] {
        assert_eq!(user(2.0, kind, 5.0, 0.0, 0.0), Err(UNSUPPORTED), "kind {kind}");
    }
    for onset in [-1.0, f32::INFINITY, 1.0e9] {
        assert_eq!(user(2.0, 1.0, 5.0, 0.0, onset), Err(DENIED), "onset {onset} s");
    }
    assert_eq!(
        requested(USER_1, [102.0, 2.0, NAN, 1.0, 5.0, 0.0, 0.0]),
        Err(DENIED),
        "no instance"
    );
}
