//! Units, types and sizes of failures: numbers of MAVLink, names of PX4's shell, and sizes of faults in the operator's units:
//! degrees, percent, seconds. The engine has no degrees; its size is in percent of its largest thrust.
//!
//! Units and types are integers on the wire, and some are newer than any library, so they are not read as the library's enums.

use core::fmt;

use arrayvec::ArrayVec;
use icd::EffectorList;
use icd::fault::{
    AirframePart, CATALOGUE, FailureType, KindInfo, Measure, SensorKind, Target, TargetClass,
};

use crate::codec::CommandError;
use crate::convert;
use flight_management::parameters::targets;

/// FAILURE_UNIT: what can fail, on this vehicle or others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit(i32);

impl Unit {
    pub const MOTOR: Self = Self(101);
    /// The actuators that deflect: surfaces and nozzle.
    pub const SERVO: Self = Self(102);
    /// Every effector, sensor and part of the airframe, only to clear faults and only in MAV_CMD_USER_1, so that a button of a ground station needs one command.
    pub const EVERYTHING: Self = Self(-1);

    /// Number, name, and why it cannot fail here.
    const TABLE: [(Self, &'static str, &'static str); 11] = [
        (Self::MOTOR, "motor", ""),
        (Self::SERVO, "servo", ""),
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

    /// The unit with this number, known or not.
    pub const fn of_code(code: i32) -> Self {
        Self(code)
    }

    /// The unit with this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::all().find(|(_, known)| *known == name).map(|(unit, _)| unit)
    }

    /// The unit of a target.
    pub fn of(target: Target, effectors: &EffectorList) -> Self {
        match target {
            Target::Effector(effector) if effectors.is_angle(effector) => Self::SERVO,
            Target::Effector(_) => Self::MOTOR,
            Target::Sensor(sensor) => Self(sensor.failure_unit().0.into()),
            Target::Part(part) => Self(part.failure_unit().into()),
        }
    }

    /// The sensor that it is.
    pub fn sensor(self) -> Option<SensorKind> {
        let is_it = |sensor: &SensorKind| i32::from(sensor.failure_unit().0) == self.0;
        SensorKind::ALL.into_iter().find(is_it)
    }

    /// The part of the airframe that it is.
    pub fn part(self) -> Option<AirframePart> {
        AirframePart::ALL.into_iter().find(|part| i32::from(part.failure_unit()) == self.0)
    }

    pub const fn code(self) -> i32 {
        self.0
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
        let sensors = SensorKind::ALL.into_iter().map(SensorKind::failure_unit);
        let others = Self::TABLE.iter().map(|(unit, name, _)| (*unit, *name));
        let parts = AirframePart::ALL.into_iter().map(|part| (part.failure_unit(), part.key()));
        let all = others.chain(sensors.chain(parts).map(|(code, name)| (Self(code.into()), name)));
        let mut all: Vec<_> = all.collect();
        all.sort_unstable_by_key(|(unit, _)| unit.0);
        all.into_iter()
    }

    /// Its targets, by instance. Empty if the unit cannot fail here.
    pub fn targets(self, all: &EffectorList) -> Targets {
        match self {
            Self::SERVO | Self::MOTOR => {
                all.by_unit(self == Self::SERVO).iter().copied().map(Target::from).collect()
            }
            Self::EVERYTHING => targets(all).collect(),
            _ => {
                let sensor = self.sensor().map(Target::from);
                sensor.or_else(|| self.part().map(Target::from)).into_iter().collect()
            }
        }
    }

    pub fn check(self, all: &EffectorList) -> Result<Targets, CommandError> {
        let targets = self.targets(all);
        if !targets.is_empty() {
            return Ok(targets);
        }
        let row = Self::TABLE.iter().find(|(unit, ..)| *unit == self);
        let why = row.map_or("it is not known", |(.., why)| *why);
        let why = if why.is_empty() { "this aircraft has none" } else { why };
        Err(CommandError::unsupported(format!("Fault refused: no failures of unit {self}: {why}")))
    }
}

/// Some effectors, sensors and parts of the airframe.
pub type Targets = ArrayVec<Target, { Target::MAX }>;

/// `GPS (4)`; the bare number if there is no name.
impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{} ({})", name.to_ascii_uppercase(), self.0),
            None => self.0.fmt(f),
        }
    }
}

/// Action of a command on its targets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Failure {
    /// A type of MAVLink: clears, or is one of its kinds, selected by the value or by the mode parameter of the type.
    Type(FailureType),
    /// This kind and no other of its type.
    Kind(&'static KindInfo),
}

impl Failure {
    pub const OK: Self = Self::Type(FailureType::Ok);

    /// The one with this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::all().find(|failure| failure.name() == name)
    }

    /// The types of MAVLink by number, then those that mean one kind.
    pub fn all() -> impl Iterator<Item = Self> {
        let kinds = CATALOGUE.iter().filter(|kind| kind.mavlink.word.is_some());
        FailureType::ALL.into_iter().map(Self::Type).chain(kinds.map(Self::Kind))
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Type(failure_type) => failure_type.name(),
            Self::Kind(kind) => kind.mavlink.word.unwrap_or(kind.key),
        }
    }

    /// The kinds it can be, in the order of the mode parameter.
    pub fn kinds(self) -> impl Iterator<Item = &'static KindInfo> {
        let mut kinds: Vec<&KindInfo> = Vec::new();
        kinds.extend(CATALOGUE.iter().filter(|kind| match self {
            Self::Type(failure_type) => kind.mavlink.failure_type == failure_type,
            Self::Kind(this) => kind.code == this.code,
        }));
        kinds.sort_by_key(|kind| kind.mavlink.first_mode);
        kinds.into_iter()
    }
}

/// Size of a fault, and with it the kind of its type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    pub kind: &'static KindInfo,
    pub size: Size,
}

/// Size of a fault of a kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// No size: stuck at its present position, whatever the value of FLT_STUCK_MODE.
    None,
    /// In the unit of deflecting effectors; for an engine "deg" is percent of the largest thrust.
    Number(f64),
    Si(f64),
    /// One of its alternatives, from 0.
    Alternative(u8),
}

/// Why a text or a number is not a valid value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ValueError {
    /// The type has no size, or another one.
    #[error("type {failure} takes no value \"{text}\"")]
    NoValue { failure: &'static str, text: String },
    /// The type has no size; signs select its kinds.
    #[error("type {failure} takes {allowed}, not \"{text}\"")]
    NoSign { failure: &'static str, allowed: String, text: String },
    #[error(
        "\"{text}\" is no number with deg, deg/s, %, %/s, kN, kN/s, s or ms, and none of +, -, here"
    )]
    NotANumber { text: String },
    /// No value kind has this number.
    #[error("no value of kind {code}, p4 is 1 to {last}")]
    NoKind {
        code: i32,
        /// The last valid one.
        last: u8,
    },
    /// No alternative has this number.
    #[error("p5 of {kind} is {allowed}")]
    NoAlternative { kind: &'static str, allowed: String },
}

impl Value {
    /// Reads a value as operators write it: `5deg`, `-3`, `40%`, `10deg/s`, `200ms`, `20kN`, `here`; `+` and `-` are the ends
    /// of the travel. It means the first kind of the type that accepts it: for WRONG, percent are an effect left, degrees a
    /// bias and a sign a hard over.
    pub fn parse(failure: Failure, text: &str) -> Result<Self, ValueError> {
        Self::parse_for(failure, text, None)
    }

    /// The same for a sensor, in the unit of its output: `5deg/s`, `50m`, `200Pa`, `3` without a unit.
    pub fn parse_for(
        failure: Failure,
        text: &str,
        sensor: Option<SensorKind>,
    ) -> Result<Self, ValueError> {
        let class = sensor.map(TargetClass::Sensor);
        let kinds = || {
            let kinds = failure.kinds();
            kinds.filter(move |kind| class.is_none_or(|class| kind.targets.allow(class)))
        };
        let has_size = kinds().any(|kind| kind.size().is_some());
        let no_value = || {
            let (failure, text) = (failure.name(), text.to_owned());
            let signs = kinds().flat_map(signs).filter(|_| !has_size);
            let (words, numbers): (Vec<_>, Vec<_>) =
                signs.map(|(word, number)| (word, number.to_string())).unzip();
            if words.is_empty() {
                return ValueError::NoValue { failure, text };
            }
            let allowed = format!("{}, {}", words.join(", "), numbers.join(" or "));
            ValueError::NoSign { failure, allowed, text }
        };
        if let Some(value) = kinds().find_map(|kind| alternative(kind, |(word, _)| word == text)) {
            return Ok(value);
        }
        if text == "here" {
            let bare = kinds().find(|kind| kind.numbers.is_empty() && kind.choice.is_none());
            // Where a target has the choice between its place and a size.
            let has_choice = |bare: &&'static KindInfo| {
                kinds().any(|kind| kind.size().is_some() && kind.targets.overlap(bare.targets))
            };
            let bare = bare.filter(has_choice).ok_or_else(no_value)?;
            return Ok(Self { kind: bare, size: Size::None });
        }
        let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c)));
        let (number, suffix) = text.split_at(end.unwrap_or(text.len()));
        let number: f64 =
            number.parse().map_err(|_| ValueError::NotANumber { text: text.to_owned() })?;
        let sized = kinds().find_map(|kind| {
            let size = match class {
                Some(class) => size_for(kind, number, suffix, class),
                None => size(kind, number, suffix),
            }?;
            Some(Self { kind, size })
        });
        let named = || {
            let is_it = |(_, one): (&str, f64)| suffix.is_empty() && one == number;
            kinds().filter(|_| !has_size).find_map(|kind| alternative(kind, is_it))
        };
        sized.or_else(named).ok_or_else(no_value)
    }

    /// The value with this number (p4) in USER_1.
    pub fn of_user_1(code: i32, number: f64) -> Result<Self, ValueError> {
        let kinds = CATALOGUE.iter();
        let mut known = kinds.filter_map(|kind| Some((kind, kind.mavlink.user_1?)));
        let last = known.clone().map(|(_, known)| known).max().unwrap_or(0);
        let (kind, _) = known
            .find(|(_, known)| i32::from(*known) == code)
            .ok_or(ValueError::NoKind { code, last })?;
        if kind.size().is_some() {
            return Ok(Self { kind, size: Size::Number(number) });
        }
        alternative(kind, |(_, one)| one == number).ok_or_else(|| {
            let numbers: Vec<_> = signs(kind).map(|(_, number)| number.to_string()).collect();
            let allowed = numbers.join(" or ");
            ValueError::NoAlternative { kind: kind.key, allowed }
        })
    }

    /// Name of the value kind, for refusals.
    pub fn name(&self) -> &'static str {
        let choice = self.kind.choice.map(|choice| choice.key);
        let size = self.kind.size().map(|(_, number)| number.quantity.name());
        size.or(choice).unwrap_or("place")
    }
}

/// Words and numbers for the alternatives of a kind.
fn signs(kind: &'static KindInfo) -> impl Iterator<Item = (&'static str, f64)> {
    let alternatives = kind.choice.map_or(&[][..], |choice| choice.alternatives);
    alternatives.iter().filter_map(|one| one.value)
}

fn alternative(
    kind: &'static KindInfo,
    is_it: impl Fn((&'static str, f64)) -> bool,
) -> Option<Value> {
    let alternatives = kind.choice?.alternatives;
    let place = alternatives.iter().position(|one| one.value.is_some_and(&is_it))?;
    Some(Value { kind, size: Size::Alternative(u8::try_from(place).ok()?) })
}

/// A number with this suffix as the size of a kind; `None` if the suffix is not one of its units. A bare number is always valid.
fn size(kind: &KindInfo, number: f64, suffix: &str) -> Option<Size> {
    let (_, info) = kind.size()?;
    let measure = info.quantity.measure();
    // Percent and thrust are valid for engines.
    let of_engine = kind.targets.thrust && measure.is_own();
    let per_second = if measure == Measure::Speed { "/s" } else { "" };
    let is = |unit: &str| suffix.strip_suffix(per_second) == Some(unit);
    match measure {
        _ if suffix.is_empty() => Some(Size::Number(number)),
        _ if of_engine && is("%") => Some(Size::Number(number)),
        _ if of_engine && is("kN") => Some(Size::Si(1.0e3 * number)),
        Measure::Angle | Measure::Position | Measure::Speed => {
            is("deg").then_some(Size::Number(number))
        }
        Measure::Milliseconds | Measure::Seconds if suffix == "ms" => {
            Some(Size::Number(convert::seconds(number)))
        }
        Measure::Milliseconds => (suffix == "s").then_some(Size::Number(number)),
        other => (suffix == other.unit(TargetClass::Angle).name).then_some(Size::Number(number)),
    }
}

/// A number with this suffix as the size of a fault of a sensor.
fn size_for(kind: &KindInfo, number: f64, suffix: &str, class: TargetClass) -> Option<Size> {
    let (_, info) = kind.size()?;
    let measure = info.quantity.measure();
    if !measure.is_own() {
        return size(kind, number, suffix);
    }
    let unit = measure.unit(class);
    (suffix.is_empty() || suffix == unit.name).then(|| Size::Si(unit.to_si(number)))
}

/// A number of a command or of the shell in SI units; for an engine with this largest thrust, N, percent of it.
pub(super) fn to_si(
    number: f64,
    measure: Measure,
    class: TargetClass,
    engine_n: Option<f64>,
) -> f64 {
    match (measure, engine_n) {
        (measure, Some(largest_n)) if measure.is_own() => convert::fraction(number) * largest_n,
        // Parameters and texts use milliseconds, commands seconds.
        (Measure::Milliseconds, _) => number,
        (measure, _) => measure.unit(class).to_si(number),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::fault::CATALOGUE;
    use icd::tvc_jet;

    #[test]
    fn every_name_and_number_comes_back() {
        let all = tvc_jet::effectors();
        for name in Unit::names() {
            let unit = Unit::parse(name).unwrap();
            assert_eq!(unit.name(), Some(name));
            assert_eq!(Unit::of_code(unit.code()), unit);
            assert_eq!(unit.check(&all).is_ok(), !unit.targets(&all).is_empty(), "{name}");
        }
        for failure in Failure::all() {
            assert_eq!(Failure::parse(failure.name()), Some(failure));
            let kinds = failure.kinds().count();
            assert!((failure == Failure::OK) == (kinds == 0), "{}: {kinds} kinds", failure.name());
        }
        assert_eq!((Unit::parse("GPS"), Failure::parse("broken")), (None, None));
        assert_eq!((FailureType::from_code(9), FailureType::from_code(-1)), (None, None));
    }

    #[test]
    fn a_unit_that_does_not_fail_is_refused_by_name_and_number_with_the_reason() {
        let text =
            |code| Unit::of_code(code).check(&tvc_jet::effectors()).unwrap_err().reason.unwrap();
        assert_eq!(
            text(5),
            "Fault refused: no failures of unit OPTICAL_FLOW (5): there is no such sensor"
        );
        assert_eq!(text(77), "Fault refused: no failures of unit 77: it is not known");
    }

    fn failure(name: &str) -> Failure {
        Failure::parse(name).unwrap()
    }

    #[test]
    fn values_are_read_as_people_write_them() {
        use Size::{Alternative, None, Number, Si};
        for (name, text, kind, size) in [
            ("stuck", "5deg", "stuck_at", Number(5.0)),
            ("stuck", "-5.5", "stuck_at", Number(-5.5)),
            ("stuck", "here", "stuck_here", None),
            ("wrong", "40%", "partial_loss", Number(40.0)),
            ("wrong", "40", "partial_loss", Number(40.0)),
            ("wrong", "3deg", "biased", Number(3.0)),
            ("wrong", "-", "hard_over", Alternative(1)),
            ("hardover", "+", "hard_over", Alternative(0)),
            ("hardover", "-1", "hard_over", Alternative(1)),
            ("hardover", "1", "hard_over", Alternative(0)),
            ("slow", "10deg/s", "slow", Number(10.0)),
            ("slow", "10%/s", "slow", Number(10.0)),
            ("slow", "2kN/s", "slow", Si(2_000.0)),
            ("delayed", "200ms", "delayed", Number(0.2)),
            ("delayed", "0.2s", "delayed", Number(0.2)),
            ("intermittent", "30%", "intermittent", Number(30.0)),
            ("garbage", "2deg", "oscillating", Number(2.0)),
            ("drift", "-1", "drifting", Number(-1.0)),
            ("bias", "+4deg", "biased", Number(4.0)),
            ("bias", "-4%", "biased", Number(-4.0)),
            ("limit", "6deg", "limited_travel", Number(6.0)),
            ("limit", "20kN", "limited_travel", Si(20_000.0)),
        ] {
            let kind = KindInfo::by_key(kind).unwrap();
            assert_eq!(
                Value::parse(failure(name), text),
                Ok(Value { kind, size }),
                "{name} {text}"
            );
        }
    }

    #[test]
    fn a_value_that_is_not_of_the_type_is_refused() {
        for (name, text) in [
            ("stuck", "5%"),
            ("stuck", "5kN"),
            ("slow", "5deg"),
            ("slow", "5kN"),
            ("delayed", "5deg"),
            ("ok", "1"),
            ("off", "5deg"),
            ("off", "here"),
            ("stuck", ""),
            ("stuck", "deg"),
            ("stuck", "1.2.3"),
            ("stuck", "nan"),
            ("hardover", "3deg"),
            ("hardover", "5"),
            ("hardover", "-0"),
            ("hardover", "0"),
            ("hardover", "-1deg"),
        ] {
            assert!(Value::parse(failure(name), text).is_err(), "{name} {text}");
        }
    }

    #[test]
    fn each_kind_with_a_size_has_a_number_in_user_1() {
        for kind in &CATALOGUE {
            let has_value = kind.size().is_some() || kind.choice.is_some();
            assert_eq!(kind.mavlink.user_1.is_some(), has_value, "{}", kind.key);
            let Some(code) = kind.mavlink.user_1 else { continue };
            assert_eq!(Value::of_user_1(code.into(), 1.0).map(|value| value.kind), Ok(kind));
        }
    }
}
