//! An order to break or mend something, whoever gives it: a command, the shell or a parameter. From here on
//! they are the same.
//!
//! What the order leaves open comes from the parameters FLT_*, read once, when it is given. Whatever can be
//! checked without the plant is checked for all effectors before any request is made, in the same ranges as in the
//! plant: of the values of an order the plant refuses none that passes here, if the belief fits the aircraft.

use arrayvec::ArrayVec;
use flight_control::Belief;
use flight_control::belief::{EffectorBelief, ServoBelief};
use icd::fault::{FaultKind, Onset, Reach, Refusal, Repeat, Side, Timing, Travel};
use icd::{Effector, EffectorList, FaultRequest, SimTime, fault};

pub use super::value::{Value, ValueError};
pub use super::words::{Effectors, FailureType, Unit};

use super::value::within;
use crate::mavlink::convert;
use crate::mavlink::reasons::Reasons;
use crate::mavlink::refused::Refused;
use crate::parameters::{FailureParameters, Parameters, WrongMode};

/// Beliefs come from files with nine digits, and numbers of commands have seven: what is this close to a limit,
/// as a fraction of it, is left to the plant.
const ROUNDING: f64 = 1.0e-6;

/// One request for each effector that an order names.
pub type Requests = ArrayVec<FaultRequest, { Effector::MAX }>;

/// An order. `None` leaves a value to its parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaultOrder {
    /// What.
    pub unit: Unit,
    /// How.
    pub failure_type: FailureType,
    /// Which of the unit.
    pub instances: Instances,
    /// How much.
    pub value: Option<Value>,
    /// How STUCK comes to its angle.
    pub travel: Option<Travel>,
    /// Frequency of GARBAGE, Hz.
    pub frequency_hz: Option<f64>,
    /// Period of INTERMITTENT, s.
    pub period_s: Option<f64>,
    /// When it acts first.
    pub onset: Onset,
    /// Time from nothing to the whole fault, s. The parameter's is not used for kinds without a size.
    pub ramp_s: Option<f64>,
    /// How long it acts, s; 0 for ever.
    pub duration_s: Option<f64>,
    /// From one onset to the next, s; 0 once only.
    pub every_s: Option<f64>,
    /// How often it acts in all; 0 without end.
    pub times: Option<u32>,
}

/// Which of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instances {
    /// All.
    All,
    /// This one, from 1.
    One(u32),
    /// As bits, bit 0 for the first.
    Mask(u32),
}

impl FaultOrder {
    /// At once, everything else by the parameters.
    #[must_use]
    pub const fn new(unit: Unit, failure_type: FailureType, instances: Instances) -> Self {
        Self {
            unit,
            failure_type,
            instances,
            value: None,
            travel: None,
            frequency_hz: None,
            period_s: None,
            onset: Onset::AtOnce,
            ramp_s: None,
            duration_s: None,
            every_s: None,
            times: None,
        }
    }

    /// It says nothing about size or time.
    fn is_bare(&self) -> bool {
        *self == Self::new(self.unit, self.failure_type, self.instances)
    }
}

/// The requests in an order; `belief` says how far the effectors travel.
///
/// # Errors
/// Why nothing is asked of the plant.
pub fn requests(
    order: &FaultOrder,
    parameters: &Parameters,
    belief: &Belief,
) -> Result<Requests, Refused> {
    let parameters = &parameters.failure;
    if !parameters.enabled {
        return Err(denied("fault injection is off (SYS_FAILURE_EN 0)"));
    }
    let list = &belief.effectors.list;
    let effectors = chosen(order, list)?;
    if order.failure_type == FailureType::Ok {
        if !order.is_bare() {
            return Err(denied("a fault is mended at once, without value, ramp or time"));
        }
        let clear = effectors.into_iter().map(|effector| FaultRequest::Clear { effector });
        return Ok(clear.collect());
    }
    check_numbers(order)?;
    let mut requests = Requests::new();
    let mut reasons = Reasons::default();
    for effector in effectors {
        match kind(order, effector, parameters, belief)? {
            Some(kind) => {
                let timing = timing(order, &kind, parameters)?;
                if let Err(refusal) = check(effector, &kind, &timing, belief) {
                    reasons.refuse(&refusal, Some(effector), list);
                }
                requests.push(FaultRequest::Inject { effector, kind, timing });
            }
            None => reasons.refuse(&Refusal::NotForThisEffector, Some(effector), list),
        }
    }
    if reasons.is_empty() { Ok(requests) } else { Err(denied(reasons.text(list))) }
}

fn denied(reason: impl ToString) -> Refused {
    Refused::denied(format!("Fault refused: {}", reason.to_string()))
}

/// The effectors that an order names.
fn chosen(order: &FaultOrder, list: &EffectorList) -> Result<Effectors, Refused> {
    let effectors = order.unit.check(list)?;
    // Everything has no instances of its own: they are counted.
    let instance = |place: usize, effector: Effector| {
        if order.unit == Unit::EVERYTHING { place + 1 } else { list.instance(effector).into() }
    };
    let bit = |place: usize, effector: Effector| 1_u32 << (instance(place, effector) - 1);
    let bits = || effectors.iter().enumerate().map(|(place, effector)| bit(place, *effector));
    let (all, last) = (bits().sum::<u32>(), bits().max().map_or(0, |bit| bit.ilog2() + 1));
    let bits = match order.instances {
        Instances::All => all,
        Instances::One(number) => {
            let bit = number.checked_sub(1).and_then(|shift| 1_u32.checked_shl(shift));
            match bit.filter(|bit| bit & all != 0) {
                Some(bit) => bit,
                None => {
                    return Err(denied(format!("no instance {number}, there are 1 to {last}")));
                }
            }
        }
        Instances::Mask(bits) if bits != 0 && bits & !all == 0 => bits,
        Instances::Mask(bits) => {
            return Err(denied(format!("mask {bits} names no instances of 1 to {last}")));
        }
    };
    let named = |(place, effector): &(usize, &Effector)| bits & bit(*place, **effector) != 0;
    Ok(effectors.iter().enumerate().filter(named).map(|(_, effector)| *effector).collect())
}

/// Numbers that mean nothing for any effector.
fn check_numbers(order: &FaultOrder) -> Result<(), Refused> {
    if let Some(value) = order.value {
        value.check().map_err(denied)?;
    }
    let numbers = [
        ("frequency", "Hz", order.frequency_hz, fault::FREQUENCY_HZ),
        ("period", "s", order.period_s, fault::PERIOD_S),
        ("ramp", "s", order.ramp_s, [0.0, fault::RAMP_MAX_S]),
        ("duration", "s", order.duration_s, [0.0, SimTime::MAX_SECONDS]),
        ("repetition", "s", order.every_s, [0.0, SimTime::MAX_SECONDS]),
    ];
    for (what, unit, value, [min, max]) in numbers {
        if let Some(value) = value {
            within(what, unit, value, min, max).map_err(denied)?;
        }
    }
    Ok(())
}

/// The kind of fault for one effector; `None` if it has no such fault.
fn kind(
    order: &FaultOrder,
    effector: Effector,
    parameters: &FailureParameters,
    belief: &Belief,
) -> Result<Option<FaultKind>, Refused> {
    use FailureType as T;
    use Value as V;
    let is_angle = belief.effectors.list.is_angle(effector);
    // A size in the effector's own quantity; the parameter that is left to it is one of two.
    let own = |value: f64| {
        if is_angle {
            convert::radians(value)
        } else {
            convert::fraction(value) * belief.effectors.thrust_range_n()[1]
        }
    };
    let by_parameter =
        |value_deg: f64| own(if is_angle { value_deg } else { parameters.engine_pct });
    let travel = order.travel.unwrap_or(if parameters.stuck_travels {
        Travel::AtActuatorRate
    } else {
        Travel::Jump
    });
    let stuck_at = |deg| FaultKind::StuckAt { angle_rad: convert::radians(deg), travel };
    let partial = |pct| FaultKind::PartialLoss { remaining: convert::fraction(pct) };
    let oscillating = |amplitude| FaultKind::Oscillating {
        amplitude,
        frequency_hz: order.frequency_hz.unwrap_or(parameters.oscillation_hz),
    };
    let intermittent = |pct| FaultKind::Intermittent {
        period_s: order.period_s.unwrap_or(parameters.period_s),
        present: convert::fraction(pct),
    };
    let biased = |bias| FaultKind::Biased { bias };
    let limited = |limit| FaultKind::LimitedTravel { limit };
    let kind = match (order.failure_type, order.value) {
        (T::Off | T::FlameOut, None) if !is_angle => FaultKind::FlameOut,
        (T::Off | T::Float, None) if is_angle => FaultKind::Float,
        (T::Float | T::FlameOut, None) => return Ok(None),
        (T::Stuck, Some(V::Here)) => FaultKind::StuckHere,
        (T::Stuck, Some(V::Angle(_))) if !is_angle => return Ok(None),
        (T::Stuck, Some(V::Angle(deg))) => stuck_at(deg),
        // The parameter's angle means nothing for the engine.
        (T::Stuck, None) if parameters.stuck_at_angle && is_angle => stuck_at(parameters.stuck_deg),
        (T::Stuck, None) => FaultKind::StuckHere,
        (T::Garbage | T::Oscillate, Some(V::Amplitude(value))) => oscillating(own(value)),
        (T::Garbage | T::Oscillate, None) => oscillating(by_parameter(parameters.oscillation_deg)),
        (T::Wrong | T::Loss, Some(V::Effect(pct))) => partial(pct),
        (T::Wrong | T::Bias, Some(V::Bias(value))) => biased(own(value)),
        (T::Wrong | T::Limit, Some(V::Limit(value))) => limited(own(value)),
        (T::Wrong | T::HardOver, Some(V::Side(side))) => FaultKind::HardOver { side },
        (T::Wrong, None) => match parameters.wrong {
            WrongMode::Loss => partial(parameters.remaining_pct),
            WrongMode::Bias => biased(by_parameter(parameters.bias_deg)),
            WrongMode::HardOverPositive => FaultKind::HardOver { side: Side::Positive },
            WrongMode::HardOverNegative => FaultKind::HardOver { side: Side::Negative },
            WrongMode::Limit => limited(by_parameter(parameters.limit_deg)),
        },
        (T::Loss, None) => partial(parameters.remaining_pct),
        (T::Bias, None) => biased(by_parameter(parameters.bias_deg)),
        (T::Limit, None) => limited(by_parameter(parameters.limit_deg)),
        (T::HardOver, None) => FaultKind::HardOver { side: Side::Positive },
        (T::Slow, Some(V::Rate(value))) => FaultKind::Slow { rate: own(value) },
        (T::Slow, None) => FaultKind::Slow { rate: by_parameter(parameters.rate_dps) },
        (T::Delayed, Some(V::Delay(delay_s))) => FaultKind::Delayed { delay_s },
        (T::Delayed, None) => FaultKind::Delayed { delay_s: convert::seconds(parameters.delay_ms) },
        (T::Intermittent, Some(V::Present(pct))) => intermittent(pct),
        (T::Intermittent, None) => intermittent(parameters.present_pct),
        (T::Drift, Some(V::Drift(value))) => FaultKind::Drifting { rate: own(value) },
        (T::Drift, None) => FaultKind::Drifting { rate: by_parameter(parameters.drift_dps) },
        (failure_type, Some(value)) => {
            let name = failure_type.name();
            return Err(denied(format!("type {name} takes no value of this kind ({value})")));
        }
        // Every type without a value is above.
        (T::Ok | T::Off, None) => return Ok(None),
    };
    if !is_angle {
        check_engine(&kind, order.value)?;
    }
    Ok(match kind {
        FaultKind::HardOver { .. } if !is_angle => None,
        kind => Some(kind),
    })
}

/// FLT_ENG_PCT can be negative, for a bias and a drift.
fn check_engine(kind: &FaultKind, value: Option<Value>) -> Result<(), Refused> {
    let size = match *kind {
        FaultKind::Slow { rate: size }
        | FaultKind::Oscillating { amplitude: size, .. }
        | FaultKind::LimitedTravel { limit: size } => size,
        _ => return Ok(()),
    };
    if value.is_none() && size <= 0.0 {
        return Err(denied("engine: FLT_ENG_PCT must be above 0 for this fault"));
    }
    Ok(())
}

/// Checks a fault as the plant does, with the belief's effectors. Beliefs are rounded: what is only a hair out of
/// reach is left to the plant.
fn check(
    effector: Effector,
    kind: &FaultKind,
    timing: &Timing,
    belief: &Belief,
) -> Result<(), Refusal> {
    let check = |factor| fault::check(kind, timing, &reach(effector, belief, factor));
    check(1.0).or_else(|refusal| {
        check(1.0 + ROUNDING).or_else(|_| check(1.0 - ROUNDING)).map_err(|_| refusal)
    })
}

/// How far and how fast an effector goes, as the belief has it, times a factor. How fast thrust changes is not in
/// the belief.
fn reach(effector: Effector, belief: &Belief, factor: f64) -> Reach {
    let EffectorBelief { list, servos, .. } = &belief.effectors;
    let ServoBelief { lag_s, rate_limit, min, max } = servos[effector];
    let is_angle = list.is_angle(effector);
    let fastest = is_angle.then(|| factor * rate_limit.min((max - min) / lag_s));
    Reach { is_angle, min: factor * min, max: factor * max, fastest }
}

/// When a kind of fault acts.
fn timing(
    order: &FaultOrder,
    kind: &FaultKind,
    parameters: &FailureParameters,
) -> Result<Timing, Refused> {
    let by_parameter = if kind.has_size() { parameters.ramp_s } else { 0.0 };
    let ramp_s = order.ramp_s.unwrap_or(by_parameter);
    if ramp_s > 0.0 && !kind.has_size() {
        return Err(denied("this fault has no size that a ramp could change"));
    }
    let given = |time_s: f64| (time_s > 0.0).then_some(time_s);
    let duration_s = given(order.duration_s.unwrap_or(parameters.duration_s));
    let every_s = given(order.every_s.unwrap_or(parameters.every_s));
    let times = order.times.unwrap_or(parameters.times);
    let repeat = match (duration_s, every_s, times) {
        (_, None, _) | (_, _, 1) => None,
        (None, Some(_), _) => {
            return Err(denied("a repetition (FLT_RPT_S) needs a duration (FLT_DUR_S)"));
        }
        (Some(duration_s), Some(every_s), _) if every_s <= duration_s => {
            return Err(denied(format!(
                "a repetition each {every_s} s must be longer than the duration of {duration_s} s"
            )));
        }
        (Some(_), Some(every_s), times) => {
            Some(Repeat { every_s, times: (times > 0).then_some(times) })
        }
    };
    Ok(Timing { onset: order.onset, ramp_s, duration_s, repeat })
}

#[cfg(test)]
mod tests;
