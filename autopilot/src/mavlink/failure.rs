//! Fault requests from MAV_CMD_INJECT_FAILURE and MAV_CMD_USER_1.
//!
//! | | INJECT_FAILURE (420) | USER_1 (31010) |
//! |---|---|---|
//! | p1 | unit: 102 servo, 101 motor | the same |
//! | p2 | type: 0 ok, 1 off, 2 stuck, 4 wrong | the same |
//! | p3 | instance, 0 all; NaN: see p4 | instance, 0 all |
//! | p4 | instances as bits, bit 0 the first | what p5 is: 1 angle in deg, 2 effect left in percent; 0 or NaN: as 420 |
//! | p5 | - | value |
//! | p6 | - | ramp, must be 0 or NaN |
//! | p7 | - | onset in seconds of simulation time; 0 or NaN: at once |
//!
//! Servo instances are 1 left aileron, 2 right aileron, 3 left elevator, 4 right elevator, 5 rudder,
//! 6 nozzle pitch, 7 nozzle yaw; motor 1 is the engine. What 420 has no room for comes from the parameters
//! FLT_*, read when the command arrives. A command that names an angle beyond the travel of any of its
//! effectors is refused as a whole; else the requests go to the plant, which has the last word.

use arrayvec::ArrayVec;
use flight_control::Belief;
use icd::fault::{Onset, Refusal, Timing, Travel};
use icd::{Effector, FaultKind, FaultRequest, SimTime};

use super::codec::Command;
use super::convert;
use super::reasons::Reasons;
use super::refused::Refused;
use crate::parameters::{FailureParameters, Parameters};

/// MAV_CMD_INJECT_FAILURE.
pub const INJECT_FAILURE: u16 = 420;
/// MAV_CMD_USER_1.
pub const USER_1: u16 = 31_010;

const UNIT_MOTOR: i32 = 101;
const UNIT_SERVO: i32 = 102;
const TYPE_OK: i32 = 0;
const TYPE_OFF: i32 = 1;
const TYPE_STUCK: i32 = 2;
const TYPE_WRONG: i32 = 4;
const VALUE_ANGLE: i32 = 1;
const VALUE_EFFECT: i32 = 2;
/// Beliefs come from files with nine digits: an angle this close to the limit is left to the plant.
const TRAVEL_ROUNDING_RAD: f64 = 1.0e-6;

const SERVOS: [Effector; 7] = [
    Effector::LeftAileron,
    Effector::RightAileron,
    Effector::LeftElevator,
    Effector::RightElevator,
    Effector::Rudder,
    Effector::NozzlePitch,
    Effector::NozzleYaw,
];
const MOTORS: [Effector; 1] = [Effector::Engine];

/// One request for each effector that a command names.
pub type Requests = ArrayVec<FaultRequest, { Effector::COUNT }>;

/// Unit and instance of an effector, in PX4's words.
#[must_use]
pub fn unit_and_instance(effector: Effector) -> (&'static str, usize) {
    match SERVOS.iter().position(|servo| *servo == effector) {
        Some(index) => ("servo", index + 1),
        None => ("motor", 1),
    }
}

/// Unit and instances of effectors of one kind.
#[must_use]
pub fn unit_and_instances(effectors: &[Effector]) -> (&'static str, String) {
    let unit = effectors.first().map_or("effector", |first| unit_and_instance(*first).0);
    let instances = effectors.iter().map(|effector| unit_and_instance(*effector).1.to_string());
    (unit, instances.collect::<Vec<_>>().join(", "))
}

/// The requests in a fault command; `belief` says how far the effectors travel.
///
/// # Errors
/// Why nothing is asked of the plant.
pub fn requests(
    command: &Command,
    parameters: &Parameters,
    belief: &Belief,
) -> Result<Requests, Refused> {
    if !parameters.failure.enabled {
        return Err(Refused::denied("Fault refused: fault injection is off (SYS_FAILURE_EN 0)"));
    }
    let [unit, failure_type, ..] = command.params;
    let effectors = match integer("unit", unit)? {
        UNIT_SERVO => &SERVOS[..],
        UNIT_MOTOR => &MOTORS[..],
        other => {
            return Err(Refused::unsupported(format!(
                "Fault refused: no failures of unit {other}"
            )));
        }
    };
    let failure_type = integer("type", failure_type)?;
    let magnitude = Magnitude::of(command)?;
    let chosen = chosen(command, effectors)?;
    let mut requests = Requests::new();
    for effector in chosen {
        requests.push(request(effector, failure_type, magnitude, &parameters.failure)?);
    }
    check_travel(&requests, belief)?;
    Ok(requests)
}

/// All or nothing: one effector that cannot take its angle, and none is asked for.
fn check_travel(requests: &Requests, belief: &Belief) -> Result<(), Refused> {
    let mut reasons = Reasons::default();
    for request in requests {
        let FaultRequest::Inject { effector, kind: FaultKind::StuckAt { angle_rad, .. }, .. } =
            *request
        else {
            continue;
        };
        // An engine without a travel is refused by the plant.
        let Some(limit_rad) = travel_rad(effector, belief) else { continue };
        if angle_rad.abs() > limit_rad + TRAVEL_ROUNDING_RAD {
            let refusal = Refusal::AngleOutOfTravel { angle_rad, limit_rad };
            reasons.add(refusal.to_string(), Some(effector));
        }
    }
    if reasons.is_empty() {
        return Ok(());
    }
    Err(Refused::denied(format!("Fault refused: {reasons}")))
}

fn travel_rad(effector: Effector, belief: &Belief) -> Option<f64> {
    let effectors = &belief.effectors;
    Some(match effector {
        Effector::LeftAileron | Effector::RightAileron => effectors.aileron.travel_rad,
        Effector::LeftElevator | Effector::RightElevator => effectors.elevator.travel_rad,
        Effector::Rudder => effectors.rudder.travel_rad,
        Effector::NozzlePitch | Effector::NozzleYaw => effectors.nozzle.travel_rad,
        Effector::Engine => return None,
    })
}

/// What USER_1 says beyond 420.
#[derive(Debug, Clone, Copy)]
struct Magnitude {
    value: Option<Value>,
    onset: Onset,
}

#[derive(Debug, Clone, Copy)]
enum Value {
    Angle { deg: f64 },
    Effect { pct: f64 },
}

impl Magnitude {
    fn of(command: &Command) -> Result<Self, Refused> {
        if command.id != USER_1 {
            return Ok(Self { value: None, onset: Onset::AtOnce });
        }
        let [_, _, _, kind, value, ramp, onset] = command.params;
        if is_given(ramp) {
            return Err(Refused::denied("Fault refused: no ramps yet, p6 must be 0"));
        }
        let onset = if is_given(onset) {
            let seconds = convert::decimal(onset);
            let at = SimTime::from_seconds(seconds).ok_or_else(|| {
                Refused::denied(format!("Fault refused: onset p7 = {seconds} s is no time"))
            })?;
            Onset::At(at)
        } else {
            Onset::AtOnce
        };
        let value = if is_given(kind) {
            let number = convert::decimal(value);
            let value = match integer("kind of value", kind)? {
                VALUE_ANGLE => Value::Angle { deg: number },
                VALUE_EFFECT => Value::Effect { pct: number },
                other => {
                    let reason = format!("Fault refused: no value of kind {other}, p4 is 1 or 2");
                    return Err(Refused::unsupported(reason));
                }
            };
            if !number.is_finite() {
                return Err(Refused::denied("Fault refused: the value p5 is not finite"));
            }
            Some(value)
        } else if is_given(value) {
            return Err(Refused::denied("Fault refused: p5 has a value, but p4 no kind"));
        } else {
            None
        };
        Ok(Self { value, onset })
    }
}

/// Both zero and NaN mean "not given" in p4 to p7.
fn is_given(value: f32) -> bool {
    !value.is_nan() && value != 0.0
}

/// A parameter that stands for a whole number.
fn integer(what: &str, value: f32) -> Result<i32, Refused> {
    let value = f64::from(value);
    if value.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&value) {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "whole and in range, as just checked"
        )]
        return Ok(value as i32);
    }
    Err(Refused::denied(format!("Fault refused: {what} {value} is no whole number")))
}

fn chosen(
    command: &Command,
    effectors: &[Effector],
) -> Result<ArrayVec<Effector, { Effector::COUNT }>, Refused> {
    let [_, _, instance, mask, ..] = command.params;
    let count = effectors.len();
    let of_bits = |bits: u32| {
        let named = effectors.iter().enumerate().filter(move |(bit, _)| bits & (1 << bit) != 0);
        named.map(|(_, effector)| *effector).collect()
    };
    let all = (1_u32 << count) - 1;
    if !instance.is_nan() {
        return match usize::try_from(integer("instance", instance)?) {
            Ok(0) => Ok(of_bits(all)),
            Ok(number) if number <= count => Ok(of_bits(1 << (number - 1))),
            _ => Err(Refused::denied(format!(
                "Fault refused: no instance {instance}, there are 1 to {count}"
            ))),
        };
    }
    if command.id == USER_1 {
        return Err(Refused::denied("Fault refused: instance p3 is not given"));
    }
    match u32::try_from(integer("mask of instances", mask)?) {
        Ok(bits @ 1..) if bits & !all == 0 => Ok(of_bits(bits)),
        _ => Err(Refused::denied(format!(
            "Fault refused: mask {mask} names no instances of 1 to {count}"
        ))),
    }
}

fn request(
    effector: Effector,
    failure_type: i32,
    Magnitude { value, onset }: Magnitude,
    parameters: &FailureParameters,
) -> Result<FaultRequest, Refused> {
    let travel = if parameters.stuck_travels { Travel::AtActuatorRate } else { Travel::Jump };
    let stuck_at = |deg| FaultKind::StuckAt { angle_rad: convert::radians(deg), travel };
    let partial = |pct| FaultKind::PartialLoss { remaining: convert::fraction(pct) };
    let kind = match (failure_type, value) {
        (TYPE_OK, None) if onset == Onset::AtOnce => return Ok(FaultRequest::Clear { effector }),
        (TYPE_OK, None) => {
            return Err(Refused::denied("Fault refused: a fault is cleared at once, p7 must be 0"));
        }
        (TYPE_OFF, None) => FaultKind::Float,
        (TYPE_STUCK, Some(Value::Angle { deg })) => stuck_at(deg),
        // The parameter's angle means nothing for the engine.
        (TYPE_STUCK, None) if parameters.stuck_at_angle && effector.is_angle() => {
            stuck_at(parameters.stuck_deg)
        }
        (TYPE_STUCK, None) => FaultKind::StuckHere,
        (TYPE_WRONG, Some(Value::Effect { pct })) => partial(pct),
        (TYPE_WRONG, None) => partial(parameters.remaining_pct),
        (TYPE_OK | TYPE_OFF | TYPE_STUCK | TYPE_WRONG, Some(_)) => {
            return Err(Refused::denied("Fault refused: this type has no such value (p4)"));
        }
        (other, _) => {
            return Err(Refused::unsupported(format!(
                "Fault refused: no failures of type {other}"
            )));
        }
    };
    Ok(FaultRequest::Inject { effector, kind, timing: Timing::from_onset(onset) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{self, DEFAULT_BELIEF};
    use ::mavlink::dialects::common::MavResult;

    const NAN: f32 = f32::NAN;

    fn ask(id: u16, params: [f32; 7]) -> Result<Vec<FaultRequest>, MavResult> {
        let command = Command { id, params, frame: None, xy: None };
        requests(&command, &Parameters::default(), &belief())
            .map(|requests| requests.to_vec())
            .map_err(|refused| refused.result)
    }

    fn belief() -> Belief {
        config::belief("belief", DEFAULT_BELIEF).unwrap()
    }

    fn inject(p1: f32, p2: f32, p3: f32, p4: f32) -> Result<Vec<FaultRequest>, MavResult> {
        ask(INJECT_FAILURE, [p1, p2, p3, p4, NAN, NAN, NAN])
    }

    fn user(p2: f32, p4: f32, p5: f32, p6: f32, p7: f32) -> Result<Vec<FaultRequest>, MavResult> {
        ask(USER_1, [102.0, p2, 3.0, p4, p5, p6, p7])
    }

    const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
    const UNSUPPORTED: MavResult = MavResult::MAV_RESULT_UNSUPPORTED;

    #[test]
    fn instances_are_the_documented_effectors() {
        for (instance, effector) in (1_u8..).zip(SERVOS) {
            let asked = inject(102.0, 2.0, f32::from(instance), 0.0).unwrap();
            let kind = FaultKind::StuckHere;
            assert_eq!(asked, [FaultRequest::Inject { effector, kind, timing: Timing::NOW }]);
            assert_eq!(unit_and_instance(effector), ("servo", usize::from(instance)));
        }
        let asked = inject(101.0, 0.0, 1.0, 0.0).unwrap();
        assert_eq!(asked, [FaultRequest::Clear { effector: Effector::Engine }]);
    }

    #[test]
    fn zero_is_all_instances_and_a_mask_counts_only_without_an_instance() {
        assert_eq!(inject(102.0, 1.0, 0.0, 0.0).unwrap().len(), 7);
        assert_eq!(inject(102.0, 1.0, 2.0, 127.0).unwrap().len(), 1);
        let asked = inject(102.0, 1.0, NAN, 5.0).unwrap();
        let named: Vec<_> = asked.iter().filter_map(FaultRequest::effector).collect();
        assert_eq!(named, [Effector::LeftAileron, Effector::LeftElevator]);
        for mask in [0.0, NAN, 128.0, -1.0, 1.5] {
            assert_eq!(inject(102.0, 1.0, NAN, mask), Err(DENIED), "mask {mask}");
        }
    }

    #[test]
    fn unknown_units_and_types_are_unsupported_and_odd_numbers_denied() {
        for unit in [0.0, 100.0, 106.0, 5_000.0, -3.0] {
            assert_eq!(inject(unit, 2.0, 1.0, 0.0), Err(UNSUPPORTED), "unit {unit}");
        }
        for failure_type in [3.0, 5.0, 6.0, 7.0, 8.0, 99.0] {
            assert_eq!(
                inject(102.0, failure_type, 1.0, 0.0),
                Err(UNSUPPORTED),
                "type {failure_type}"
            );
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
    fn user_1_carries_angle_effect_and_onset_exactly() {
        let onset = Onset::At(SimTime::from_micros(12_300_000));
        let effector = Effector::LeftElevator;
        let kind = FaultKind::StuckAt { angle_rad: 30.0_f64.to_radians(), travel: Travel::Jump };
        assert_eq!(
            user(2.0, 1.0, 30.0, NAN, 12.3),
            Ok(vec![FaultRequest::Inject { effector, kind, timing: Timing::from_onset(onset) }])
        );
        let kind = FaultKind::PartialLoss { remaining: 0.4 };
        assert_eq!(
            user(4.0, 2.0, 40.0, 0.0, 0.0),
            Ok(vec![FaultRequest::Inject { effector, kind, timing: Timing::NOW }])
        );
    }

    #[test]
    fn user_1_refuses_what_it_cannot_do() {
        assert_eq!(user(2.0, 1.0, NAN, 0.0, 0.0), Err(DENIED), "angle not finite");
        assert_eq!(user(2.0, 1.0, 5.0, 1.0, 0.0), Err(DENIED), "ramp");
        assert_eq!(user(2.0, 0.0, 5.0, 0.0, 0.0), Err(DENIED), "value without kind");
        assert_eq!(user(2.0, 2.0, 50.0, 0.0, 0.0), Err(DENIED), "stuck at percent");
        assert_eq!(user(1.0, 1.0, 5.0, 0.0, 0.0), Err(DENIED), "floating at an angle");
        assert_eq!(user(0.0, 0.0, 0.0, 0.0, 5.0), Err(DENIED), "clear later");
        for kind in [3.0, 4.0, 5.0, 77.0] {
            assert_eq!(user(2.0, kind, 5.0, 0.0, 0.0), Err(UNSUPPORTED), "kind {kind}");
        }
        for onset in [-1.0, f32::INFINITY, 1.0e9] {
            assert_eq!(user(2.0, 1.0, 5.0, 0.0, onset), Err(DENIED), "onset {onset} s");
        }
        assert_eq!(ask(USER_1, [102.0, 2.0, NAN, 1.0, 5.0, 0.0, 0.0]), Err(DENIED), "no instance");
    }

    #[test]
    fn magnitudes_of_420_come_from_the_parameters() {
        let mut parameters = Parameters::default();
        for (name, value) in
            [("FLT_STUCK_MODE", 1.0), ("FLT_STUCK_DEG", -7.0), ("FLT_STUCK_RATE", 1.0)]
        {
            parameters.set(name, value).unwrap();
        }
        let command = |unit, failure_type| {
            let params = [unit, failure_type, 1.0, NAN, NAN, NAN, NAN];
            Command { id: INJECT_FAILURE, params, frame: None, xy: None }
        };
        let kind_of = |command: &Command, parameters: &Parameters| match requests(
            command,
            parameters,
            &belief(),
        )
        .unwrap()[0]
        {
            FaultRequest::Inject { kind, .. } => kind,
            FaultRequest::Clear { .. } | FaultRequest::ClearAll => panic!("a fault was asked for"),
        };
        let travel = Travel::AtActuatorRate;
        let at = FaultKind::StuckAt { angle_rad: (-7.0_f64).to_radians(), travel };
        assert_eq!(kind_of(&command(102.0, 2.0), &parameters), at);
        assert_eq!(kind_of(&command(101.0, 2.0), &parameters), FaultKind::StuckHere);
        let half = FaultKind::PartialLoss { remaining: 0.5 };
        assert_eq!(kind_of(&command(102.0, 4.0), &parameters), half);
        parameters.set("SYS_FAILURE_EN", 0.0).unwrap();
        let refused = requests(&command(102.0, 2.0), &parameters, &belief()).unwrap_err();
        assert_eq!(refused.result, DENIED);
    }
}
