//! A command to inject or clear a fault, from a message, the shell or a parameter. From here on
//! all sources are treated alike.
//!
//! Values that the command leaves open come from the parameters FLT_*, read once, on receipt. Everything that can be
//! checked without the plant is checked for all effectors before any request is made, in the same ranges as in the
//! plant: the plant refuses no value that passes here, if the model fits the aircraft.

use arrayvec::ArrayVec;
use flight_control::AircraftModel;
use flight_control::aircraft_model::{EffectorModel, ServoModel};
use icd::fault::{
    Failure, FaultDraft, FaultKind, KindInfo, NumberInfo, Numbers, Quantity, Reach, Refusal,
    SIZE_OPTION, Size, SizedKind, Target, TargetClass, Timing,
};
use icd::{Effector, EffectorList, FaultRequest, fault};

use crate::codec::CommandError;
use crate::convert;
use crate::failure::{Reasons, units};
use flight_management::parameters::{FailureParameters, Parameters};

pub use crate::failure::units::{Targets, Unit};

/// Models come from files with nine digits, and numbers of commands have seven: a value this close to a limit,
/// as a fraction of it, is left for the plant to decide.
const ROUNDING: f64 = 1.0e-6;

/// One request for each target that a command names.
pub type Requests = ArrayVec<FaultRequest, { Target::MAX }>;

/// A fault command. `None` takes a value from its parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaultCommand {
    pub unit: Unit,
    /// The action: clear, or a type of failure.
    pub failure: Failure,
    /// The instances of the unit.
    pub instances: Instances,
    /// Size of the fault.
    pub value: Option<SizedKind>,
    /// Further numbers of the kind, in the operator's units, and times, s; 0 for no ramp, for ever, once only, without end.
    pub numbers: Numbers,
}

/// Instances of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instances {
    All,
    /// This one, from 1.
    One(u32),
    /// As bits, bit 0 for the first.
    Mask(u32),
}

impl FaultCommand {
    /// At once, all other values from the parameters.
    pub const fn new(unit: Unit, failure: Failure, instances: Instances) -> Self {
        Self { unit, failure, instances, value: None, numbers: Numbers::NONE }
    }

    /// The kind has neither size nor time.
    fn is_bare(&self) -> bool {
        *self == Self::new(self.unit, self.failure, self.instances)
    }
}

/// The requests of a command; `model` has the travel of the effectors.
pub fn requests(
    command: &FaultCommand,
    parameters: &Parameters,
    model: &AircraftModel,
) -> Result<Requests, CommandError> {
    let parameters = &parameters.failure;
    if !parameters.enabled {
        return Err(denied("fault injection is off (SYS_FAILURE_EN 0)"));
    }
    let list = &model.effectors.list;
    let targets = chosen(command, list)?;
    if command.failure == Failure::OK {
        if !command.is_bare() {
            return Err(denied("a fault is mended at once, without value, ramp or time"));
        }
        return Ok(targets.into_iter().map(|target| FaultRequest::Clear { target }).collect());
    }
    let mut requests = Requests::new();
    let mut reasons = Reasons::default();
    for target in targets {
        let Some(draft) = draft(command, target, parameters, model)? else {
            reasons.refuse(&Refusal::NotForThisEffector, Some(target), list);
            continue;
        };
        match draft.finish() {
            Ok((kind, timing)) => {
                if let Err(refusal) = check(target, &kind, &timing, model) {
                    reasons.refuse(&refusal, Some(target), list);
                }
                requests.push(FaultRequest::Inject { target, kind, timing });
            }
            Err(error) => reasons.add(error.to_string(), Some(target)),
        }
    }
    if reasons.is_empty() { Ok(requests) } else { Err(denied(reasons.text(list))) }
}

fn denied(reason: impl ToString) -> CommandError {
    CommandError::denied(format!("Fault refused: {}", reason.to_string()))
}

/// The targets that a command names.
fn chosen(command: &FaultCommand, list: &EffectorList) -> Result<Targets, CommandError> {
    let targets = command.unit.check(list)?;
    // The unit "all" has no instances of its own, so they are counted.
    let instance = |place: usize, target: Target| match target {
        _ if command.unit == Unit::EVERYTHING => place + 1,
        target => target.instance(list).into(),
    };
    let bit = |place: usize, target: Target| 1_u32 << (instance(place, target) - 1);
    let bits = || targets.iter().enumerate().map(|(place, target)| bit(place, *target));
    let (all, last) = (bits().sum::<u32>(), bits().max().map_or(0, |bit| bit.ilog2() + 1));
    let bits = match command.instances {
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
    let named = |(place, target): &(usize, &Target)| bits & bit(*place, **target) != 0;
    Ok(targets.iter().enumerate().filter(named).map(|(_, target)| *target).collect())
}

/// The fault of a command for one target; `None` if it has no such fault.
fn draft(
    command: &FaultCommand,
    target: Target,
    parameters: &FailureParameters,
    model: &AircraftModel,
) -> Result<Option<FaultDraft>, CommandError> {
    use Quantity::{Duration, Every, Onset, Ramp, Times};
    let class = target.class(&model.effectors.list);
    let Some((info, alternative)) = entry(command, class, parameters)? else { return Ok(None) };
    let takes = |what: &Quantity| {
        Quantity::TIMING.contains(what) || info.numbers.iter().any(|one| one.quantity == *what)
    };
    if let Some(quantity) = command.numbers.given().find(|what| !takes(what)) {
        let (name, what) = (command.failure.name(), quantity.name());
        return Err(denied(format!("type {name} takes no {what} here")));
    }
    let mut draft = FaultDraft::new(info, class);
    draft.choose(alternative);
    for number in info.numbers {
        let value = self::number(command, number, class, parameters, model)?;
        draft.set_si(number.quantity, value);
    }
    let time = |what, parameter| command.numbers.get(what).unwrap_or(parameter);
    let ramp_s = time(Ramp, if info.has_size() { parameters.ramp_s } else { 0.0 });
    let every_s = time(Every, parameters.every_s);
    // The parameter counts only where there is a repetition; the command's own number needs one.
    let times = time(Times, if every_s == 0.0 { 0.0 } else { parameters.times.into() });
    let once = times == 1.0 && command.numbers.get(Times).is_none();
    let [every_s, times] = if once { [0.0; 2] } else { [every_s, times] };
    let duration_s = time(Duration, parameters.duration_s);
    for (what, time) in [(Ramp, ramp_s), (Duration, duration_s), (Every, every_s), (Times, times)] {
        // Zero of a parameter means that there is none; zero of the command is a number.
        if time != 0.0 || command.numbers.get(what).is_some() {
            draft.set_si(what, time);
        }
    }
    if let Some(onset_s) = command.numbers.get(Onset) {
        draft.set_si(Onset, onset_s);
    }
    Ok(Some(draft))
}

/// The entry of the catalogue that a command means for such an effector, and the alternative within it; `None` if there is
/// none for it.
fn entry(
    command: &FaultCommand,
    class: TargetClass,
    parameters: &FailureParameters,
) -> Result<Option<(&'static KindInfo, u8)>, CommandError> {
    let is_for = |kind: &&KindInfo| kind.targets.allow(class);
    let usual = |kind: &'static KindInfo| {
        let by_parameter = kind.choice.and_then(|choice| choice.parameter);
        let by_parameter = by_parameter.map(|parameter| parameters.choice(parameter.name));
        let default = kind.choice.and_then(|choice| choice.default);
        (kind, by_parameter.or(default).unwrap_or(0))
    };
    if let Some(value) = command.value {
        if command.failure.kinds().all(|kind| kind.code != value.kind.code) {
            let (name, what) = (command.failure.name(), value.name());
            return Err(denied(format!("type {name} takes no value of this kind ({what})")));
        }
        return Ok(Some(value.kind).filter(is_for).map(|kind| match value.size {
            Size::Alternative(alternative) => (kind, alternative),
            _ => usual(kind),
        }));
    }
    let mode = match command.failure {
        Failure::Type(failure_type) => failure_type.mode(),
        Failure::Kind(_) => None,
    };
    let Some(mode) = mode.map(|mode| parameters.choice(mode.name)) else {
        return Ok(command.failure.kinds().find(is_for).map(usual));
    };
    let by_mode = command.failure.kinds().filter(is_for).find_map(|kind| {
        let alternative = mode.checked_sub(kind.mavlink.first_mode)?;
        let is_it = usize::from(alternative) < kind.mavlink.mode.len();
        let (kind, usual) = usual(kind);
        is_it.then_some((kind, if kind.mavlink.mode.len() > 1 { alternative } else { usual }))
    });
    // An engine has no angle: it sticks at its present thrust. A sensor has one kind of each type.
    let bare = |kind: &&KindInfo| {
        let is_bare = kind.numbers.is_empty() && kind.choice.is_none();
        is_bare || matches!(class, TargetClass::Sensor(_))
    };
    let instead = || command.failure.kinds().filter(is_for).find(bare).map(|kind| (kind, 0));
    Ok(by_mode.or_else(instead))
}

/// A number of a kind, SI units: from the command, else from its parameter.
fn number(
    command: &FaultCommand,
    number: &NumberInfo,
    class: TargetClass,
    parameters: &FailureParameters,
    model: &AircraftModel,
) -> Result<f64, CommandError> {
    let measure = number.quantity.measure();
    let engine_n = (class == TargetClass::Thrust).then(|| model.effectors.thrust_range_n()[1]);
    if number.option == SIZE_OPTION {
        match command.value.map(|value| value.size) {
            Some(Size::Number(value)) => return Ok(units::to_si(value, measure, class, engine_n)),
            Some(Size::Si(value)) => return Ok(value),
            Some(Size::None | Size::Alternative(_)) | None => {}
        }
    }
    if let Some(value) = command.numbers.get(number.quantity) {
        return Ok(units::to_si(value, measure, class, engine_n));
    }
    if let (Some(largest_n), true) = (engine_n, measure.is_own()) {
        let is_signed = number.range.anywhere(measure, class)[0] < 0.0;
        if !is_signed && parameters.engine_pct <= 0.0 {
            return Err(denied("engine: FLT_ENG_PCT must be above 0 for this fault"));
        }
        return Ok(convert::fraction(parameters.engine_pct) * largest_n);
    }
    if let (TargetClass::Sensor(_), true) = (class, measure.is_own()) {
        return Ok(measure.unit(class).to_si(parameters.sensor_size()));
    }
    let unit = measure.unit(TargetClass::Angle);
    Ok(unit.to_si(parameters.number(number.parameter.name)))
}

/// Checks a fault as the plant does, with the model's effectors. Models are rounded: a value barely beyond a limit
/// is left for the plant to decide.
fn check(
    target: Target,
    kind: &FaultKind,
    timing: &Timing,
    model: &AircraftModel,
) -> Result<(), Refusal> {
    let effector = match target {
        Target::Effector(effector) => effector,
        Target::Sensor(sensor) => return fault::check(kind, timing, &Reach::of_sensor(sensor)),
        Target::Part(_) => return fault::check(kind, timing, &Reach::PART),
    };
    let check = |factor| fault::check(kind, timing, &reach(effector, model, factor));
    check(1.0).or_else(|refusal| {
        check(1.0 + ROUNDING).or_else(|_| check(1.0 - ROUNDING)).map_err(|_| refusal)
    })
}

/// Travel and rate of an effector, by the model, times a factor. The model has no rate of
/// thrust.
fn reach(effector: Effector, model: &AircraftModel, factor: f64) -> Reach {
    let EffectorModel { list, servos, .. } = &model.effectors;
    let ServoModel { lag_s, rate_limit, min, max } = servos[effector];
    let is_angle = list.is_angle(effector);
    let fastest = is_angle.then(|| factor * rate_limit.min((max - min) / lag_s));
    let class = TargetClass::of(is_angle);
    Reach { class, min: factor * min, max: factor * max, fastest }
}

#[cfg(test)]
mod tests;
