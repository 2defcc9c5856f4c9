//! Faults on request: any source yields a [`FaultCommand`], which becomes the requests to the plant.
//!
//! ```text
//!  INJECT_FAILURE (420), USER_1 (31010) ─> parse ─┐
//!  shell ─────────────────────────────────────────┼─> FaultCommand ─> requests ─> plant
//!  parameters FLT_SERVO1.., FLT_MOTOR1 ───────────┘                      ^          ^
//!                                                    FLT_*, model ───────┘          │
//!  shell, words of scripts ─> FaultRequest ─> checked ──────────────────────────────┘
//! ```
//!
//! | | INJECT_FAILURE (420) | USER_1 (31010) |
//! |---|---|---|
//! | p1 | unit: 102 servo, 101 motor | the same |
//! | p2 | type: [`icd::fault::FailureType`] | the same |
//! | p3 | instance, 0 all; NaN: see p4 | instance, 0 all |
//! | p4 | instances as bits, bit 0 the first | what p5 is, by the catalogue; 0 or NaN: as 420 |
//! | p5 | - | value |
//! | p6 | - | ramp, s; 0 or NaN: as 420 |
//! | p7 | - | onset in seconds of simulation time; 0 or NaN: at once |
//!
//! [`icd::fault::CATALOGUE`] lists the kinds of each type, their values and parameters; docs/commands.md shows them as
//! tables. For the engine, deg means percent of the largest thrust. Instances are those of the model file.
//! Values that 420 has no room for come from the parameters FLT_*, read when the command arrives. A command that
//! one of its effectors cannot take is refused as a whole; otherwise the requests go to the plant, one for each
//! effector, and the plant decides.
//!
//! Everything that can be checked without the plant is checked for all effectors before any request is made, in the same
//! ranges as in the plant: the plant refuses no value that passes here, if the model fits the aircraft.
//!
//! Units and types are integers on the wire, and some are newer than any library, so they are not read as the library's enums.

use core::fmt;

use arrayvec::ArrayVec;
use flight_control::AircraftModel;
use flight_control::aircraft_model::{EffectorModel, ServoModel};
use icd::fault::{
    Failure, FailureType, FaultDraft, FaultKind, KindInfo, Measure, NumberInfo, Numbers, Quantity,
    Reach, Refusal, SIZE_OPTION, Size, SizeError, SizedKind, Target, TargetClass, Timing,
};
use icd::{Effector, EffectorList, FaultRequest, fault};

use crate::codec::{CommandError, CommandMessage};
use crate::convert;
use flight_management::parameters::{FailureParameters, Parameters};

pub const INJECT_FAILURE: u16 = 420;
/// MAV_CMD_USER_1.
pub const USER_1: u16 = 31_010;

/// A refusal of the plant, in the units of its target.
pub fn refused(refusal: &Refusal, target: Option<Target>, effectors: &EffectorList) -> String {
    refusal.described(TargetClass::of_request(target, effectors)).to_string()
}

/// Names of the targets; all servos together have one name.
pub fn names(some: &[Target], effectors: &EffectorList) -> String {
    let servos = effectors.by_unit(true);
    let is_servo = |one: &Target| one.effector().is_some_and(|one| servos.contains(&one));
    if some.len() == servos.len() && some.iter().all(is_servo) {
        return "all servos".to_owned();
    }
    some.iter().map(|target| target.name(effectors)).collect::<Vec<_>>().join(", ")
}

/// Reasons, each with the targets that it applies to.
#[derive(Debug, Default)]
pub struct Reasons(Vec<(String, Vec<Target>)>);

impl Reasons {
    /// Adds a reason with the name of its target; without targets the reason stands alone.
    pub fn add(&mut self, reason: String, target: Option<Target>) {
        match self.0.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, targets)) => targets.extend(target),
            None => self.0.push((reason, target.into_iter().collect())),
        }
    }

    /// Adds a refusal, in the units of its target.
    pub fn refuse(&mut self, refusal: &Refusal, target: Option<Target>, effectors: &EffectorList) {
        self.add(refused(refusal, target, effectors), target);
    }

    /// Whether the reasons name their targets.
    pub fn names_targets(&self) -> bool {
        self.0.iter().any(|(_, targets)| !targets.is_empty())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them as one text.
    pub fn text(&self, all: &EffectorList) -> String {
        let of = |(reason, targets): &(String, Vec<Target>)| {
            if targets.is_empty() {
                reason.clone()
            } else {
                format!("{}: {reason}", names(targets, all))
            }
        };
        self.0.iter().map(of).collect::<Vec<_>>().join("; ")
    }
}

/// The fault command in a message, for an aircraft with these effectors.
pub fn parse(
    command: &CommandMessage,
    effectors: &EffectorList,
) -> Result<FaultCommand, CommandError> {
    let [unit, failure_type, ..] = command.params;
    let unit = Unit(integer("unit", unit)?);
    let code = integer("type", failure_type)?;
    unit.check(effectors)?;
    let failure = FailureType::from_code(code).map(Failure::Type).ok_or_else(|| {
        let last = FailureType::ALL.len() - 1;
        let reason = format!("Fault refused: no failures of type {code}, there are 0 to {last}");
        CommandError::unsupported(reason)
    })?;
    let instances = instances(command)?;
    if unit == Unit::EVERYTHING && command.id != USER_1 {
        let reason = "Fault refused: unit -1 is only known to USER_1 (31010)";
        return Err(CommandError::unsupported(reason));
    }
    if unit == Unit::EVERYTHING && (failure != Failure::OK || instances != Instances::All) {
        return Err(denied("unit -1 mends everything, with type 0 and instance 0"));
    }
    let fault = FaultCommand::new(unit, failure, instances);
    if command.id == USER_1 { with_numbers(fault, command) } else { Ok(fault) }
}

/// The parameters of USER_1 that 420 does not have.
fn with_numbers(
    fault: FaultCommand,
    command: &CommandMessage,
) -> Result<FaultCommand, CommandError> {
    let [_, _, _, kind, value, ramp, onset] = command.params;
    let mut numbers = Numbers::NONE;
    for (what, number) in [(Quantity::Ramp, ramp), (Quantity::Onset, onset)] {
        if is_given(number) {
            numbers.set(what, convert::decimal(number));
        }
    }
    let value = if is_given(kind) {
        let code = integer("kind of value", kind)?;
        let number = convert::decimal(value);
        if !number.is_finite() {
            return Err(denied("the value p5 is not finite"));
        }
        Some(SizedKind::of_user_1(code, number).map_err(|error| match error {
            SizeError::NoKind { .. } => {
                CommandError::unsupported(format!("Fault refused: {error}"))
            }
            _ => denied(error),
        })?)
    } else if is_given(value) {
        return Err(denied("p5 has a value, but p4 no kind"));
    } else {
        None
    };
    Ok(FaultCommand { value, numbers, ..fault })
}

/// p3 takes precedence over p4, which counts only where p3 is NaN.
fn instances(command: &CommandMessage) -> Result<Instances, CommandError> {
    let [_, _, instance, mask, ..] = command.params;
    if !instance.is_nan() {
        let number = integer("instance", instance)?;
        let number = u32::try_from(number).map_err(|_| denied(format!("no instance {number}")))?;
        return Ok(if number == 0 { Instances::All } else { Instances::One(number) });
    }
    if command.id == USER_1 {
        return Err(denied("instance p3 is not given"));
    }
    let bits = integer("mask of instances", mask)?;
    let bits = u32::try_from(bits).map_err(|_| denied(format!("mask {bits} names no instances")));
    bits.map(Instances::Mask)
}

/// Both zero and NaN mean "not given" in p4 to p7.
fn is_given(value: f32) -> bool {
    !value.is_nan() && value != 0.0
}

/// A parameter that encodes a whole number.
fn integer(what: &str, value: f32) -> Result<i32, CommandError> {
    let value = f64::from(value);
    convert::whole_number(value).ok_or_else(|| denied(format!("{what} {value} is no whole number")))
}
/// Models come from files with nine digits, and numbers of commands have seven: a value this close to a limit,
/// as a fraction of it, is left for the plant to decide.
const ROUNDING: f64 = 1.0e-6;

/// Some effectors, sensors and parts of the airframe.
pub type Targets = ArrayVec<Target, { Target::MAX }>;
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
}

/// The requests of a command; `model` has the travel of the effectors.
pub fn requests(
    command: &FaultCommand,
    parameters: &Parameters,
    model: &AircraftModel,
) -> Result<Requests, CommandError> {
    let parameters = enabled(parameters)?;
    let list = &model.effectors.list;
    let targets = chosen(command, list)?;
    if command.failure == Failure::OK {
        // Whatever else the command gives would be ignored without a word.
        if *command != FaultCommand::new(command.unit, command.failure, command.instances) {
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

/// A request that is complete, as in the words of scripts, if the plant can be expected to accept it.
pub fn checked(
    request: FaultRequest,
    parameters: &Parameters,
    model: &AircraftModel,
) -> Result<FaultRequest, CommandError> {
    enabled(parameters)?;
    if let FaultRequest::Inject { target, kind, timing } = &request
        && let Err(refusal) = check(*target, kind, timing, model)
    {
        let list = &model.effectors.list;
        let reason = refused(&refusal, Some(*target), list);
        return Err(denied(format!("{}: {reason}", target.name(list))));
    }
    Ok(request)
}

/// The parameters of faults, if there may be any.
fn enabled(parameters: &Parameters) -> Result<&FailureParameters, CommandError> {
    if parameters.failure.enabled {
        Ok(&parameters.failure)
    } else {
        Err(denied("fault injection is off (SYS_FAILURE_EN 0)"))
    }
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
                None => return Err(denied(format!("no instance {number}, there are 1 to {last}"))),
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
            Some(Size::Number(value)) => return Ok(to_si(value, measure, class, engine_n)),
            Some(Size::Si(value)) => return Ok(value),
            Some(Size::None | Size::Alternative(_)) | None => {}
        }
    }
    if let Some(value) = command.numbers.get(number.quantity) {
        return Ok(to_si(value, measure, class, engine_n));
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
    // A first-order servo is never faster than its travel over its lag.
    let fastest = is_angle.then(|| factor * rate_limit.min((max - min) / lag_s));
    let class = TargetClass::of(is_angle);
    Reach { class, min: factor * min, max: factor * max, fastest }
}
/// FAILURE_UNIT: what can fail, on this vehicle or others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit(i32);

impl Unit {
    /// Every effector, sensor and part of the airframe, only to clear faults and only in MAV_CMD_USER_1, so that a button of a ground station needs one command.
    pub const EVERYTHING: Self = Self(-1);

    /// Those that cannot fail here: number, name, and why.
    const TABLE: [(Self, &'static str, &'static str); 9] = [
        (Self(5), "optical_flow", "there is no such sensor"),
        (Self(6), "vio", "there is no such sensor"),
        (Self(7), "distance_sensor", "there is no such sensor"),
        (Self(100), "battery", "there is no battery"),
        (Self(103), "avoidance", "there is no obstacle avoidance"),
        (Self(104), "rc_signal", "there is no radio, switch the joystick off instead"),
        (Self(105), "mavlink_signal", "stop the ground station instead"),
        (Self(106), "esc", "there are no speed controllers, the engine is motor 1"),
        (Self(107), "traffic_avoidance", "there is no traffic avoidance"),
    ];

    /// The unit with this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::all().find(|(_, known)| *known == name).map(|(unit, _)| unit)
    }

    /// The unit of a target.
    pub fn of(target: Target, effectors: &EffectorList) -> Self {
        Self(target.unit(effectors).0.into())
    }

    /// Name, if it has one.
    pub fn name(self) -> Option<&'static str> {
        Self::all().find(|(unit, _)| *unit == self).map(|(_, name)| name)
    }

    /// Names of all units, including those that cannot fail here.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::all().map(|(_, name)| name)
    }

    fn all() -> impl Iterator<Item = (Self, &'static str)> {
        let others = Self::TABLE.iter().map(|(unit, name, _)| (*unit, *name));
        let all = others.chain(Target::units().map(|(code, name)| (Self(code.into()), name)));
        let mut all: Vec<_> = all.collect();
        all.sort_unstable_by_key(|(unit, _)| unit.0);
        all.into_iter()
    }

    /// The class of its targets, which determines the units of a size.
    pub fn class(self, all: &EffectorList) -> TargetClass {
        TargetClass::of_request(self.targets(all).first().copied(), all)
    }

    /// Its targets, by instance. Empty if the unit cannot fail here.
    pub fn targets(self, all: &EffectorList) -> Targets {
        let is_meant = |target: &Target| self == Self::EVERYTHING || Self::of(*target, all) == self;
        let mut targets: Targets = Target::all(all).filter(is_meant).collect();
        if self != Self::EVERYTHING {
            targets.sort_by_key(|target| target.instance(all));
        }
        targets
    }

    pub fn check(self, all: &EffectorList) -> Result<Targets, CommandError> {
        let targets = self.targets(all);
        if !targets.is_empty() {
            return Ok(targets);
        }
        let row = Self::TABLE.iter().find(|(unit, ..)| *unit == self);
        let why = match (row, self.name()) {
            (Some((.., why)), _) => why,
            (None, Some(_)) => "this aircraft has none",
            (None, None) => "it is not known",
        };
        Err(CommandError::unsupported(format!("Fault refused: no failures of unit {self}: {why}")))
    }
}

/// `GPS (4)`; the bare number if there is no name.
impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{} ({})", name.to_ascii_uppercase(), self.0),
            None => self.0.fmt(f),
        }
    }
}

/// A number of a command or of the shell in SI units; for an engine with this largest thrust, N, percent of it.
fn to_si(number: f64, measure: Measure, class: TargetClass, engine_n: Option<f64>) -> f64 {
    match (measure, engine_n) {
        (measure, Some(largest_n)) if measure.is_own() => convert::fraction(number) * largest_n,
        // Parameters and texts use milliseconds, commands seconds.
        (Measure::Milliseconds, _) => number,
        (measure, _) => measure.unit(class).to_si(number),
    }
}

#[cfg(test)]
mod tests;
