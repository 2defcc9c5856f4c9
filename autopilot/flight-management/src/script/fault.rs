//! `fail` and `clear`: targets, kinds of faults and their timing in words. The words of the kinds are those of the
//! catalogue.

use core::cmp::Reverse;

use icd::fault::Measure::{Milliseconds, Seconds};
use icd::fault::{
    AirframePart, CATALOGUE, Choice, FaultKind, KindInfo, NUMBERS_MAX, NumberInfo, Onset, Piece,
    Repeat, SensorKind, Target, TargetClass, Targets, Timing,
};
use icd::{Effector, EffectorList, FaultRequest, SimTime};

use super::cursor::{Cursor, SECONDS};
use super::error::{Problem, ScriptError};

/// Largest number of repetitions of a fault.
const TIMES_MAX: u32 = 1_000_000;

/// The rest of a line after `fail`.
pub(super) fn fail(
    cursor: &mut Cursor,
    effectors: &EffectorList,
) -> Result<FaultRequest, ScriptError> {
    let target = target(cursor, effectors, &names(effectors))?;
    let class = target.class(effectors);
    let kind = kind(cursor, class)?;
    let timing = timing(cursor)?;
    Ok(FaultRequest::Inject { target, kind, timing })
}

/// The rest of a line after `clear`.
pub(super) fn clear(
    cursor: &mut Cursor,
    effectors: &EffectorList,
) -> Result<FaultRequest, ScriptError> {
    if cursor.take("all") {
        return Ok(FaultRequest::ClearAll);
    }
    let expected = format!("`all` or {}", names(effectors));
    Ok(FaultRequest::Clear { target: target(cursor, effectors, &expected)? })
}

/// Words of ground stations for servos and motors.
const UNITS: [(&str, bool); 2] = [("servo", true), ("motor", false)];

/// The effectors in messages.
fn names(effectors: &EffectorList) -> String {
    let mut names: Vec<String> =
        effectors.all().map(|effector| effectors.name(effector).to_owned()).collect();
    for (unit, is_angle) in UNITS {
        match effectors.by_unit(is_angle).last().map(|last| effectors.instance(*last)) {
            Some(1) => names.push(format!("{unit} 1")),
            Some(last) => names.push(format!("{unit} 1 to {last}")),
            None => {}
        }
    }
    let sensors = SensorKind::ALL.map(SensorKind::name).join(", ");
    let parts = AirframePart::ALL.map(AirframePart::name).join(", ");
    let names = names.join(", ");
    format!("an effector: {names}, a sensor: {sensors}, or a part of the airframe: {parts}")
}

/// A target: an effector, or a sensor or a part of the airframe by its name.
fn target(
    cursor: &mut Cursor,
    effectors: &EffectorList,
    expected: &str,
) -> Result<Target, ScriptError> {
    let named = |sensor: &SensorKind| cursor.take(sensor.name()) || cursor.take(sensor.key());
    if let Some(sensor) = SensorKind::ALL.into_iter().find(named) {
        return Ok(sensor.into());
    }
    let named = |part: &AirframePart| cursor.take(part.name()) || cursor.take(part.key());
    if let Some(part) = AirframePart::ALL.into_iter().find(named) {
        return Ok(part.into());
    }
    effector(cursor, effectors, expected).map(Target::from)
}

/// An effector by its display name, its name in files, or its name in ground stations. The longest name that fits counts.
fn effector(
    cursor: &mut Cursor,
    effectors: &EffectorList,
    expected: &str,
) -> Result<Effector, ScriptError> {
    let mut all: Vec<Effector> = effectors.all().collect();
    all.sort_by_key(|effector| Reverse(effectors.name(*effector).len()));
    let named = |cursor: &mut Cursor, effector: &Effector| {
        cursor.take(effectors.name(*effector)) || cursor.take(effectors.key(*effector))
    };
    if let Some(effector) = all.iter().find(|effector| named(cursor, effector)) {
        return Ok(*effector);
    }
    for (unit, is_angle) in UNITS {
        let members = effectors.by_unit(is_angle);
        let in_one_word = |cursor: &mut Cursor, effector: &Effector| {
            cursor.take(&format!("{unit}{}", effectors.instance(*effector)))
        };
        if let Some(effector) = members.iter().find(|effector| in_one_word(cursor, effector)) {
            return Ok(*effector);
        }
        let Some(last) = members.last() else { continue };
        let before = cursor.clone();
        if cursor.take(unit) {
            let instance = cursor.whole(unit, effectors.instance(*last).into())?;
            let mut members = members.iter();
            let found =
                members.find(|effector| u32::from(effectors.instance(**effector)) == instance);
            return found.copied().ok_or_else(|| before.expected(expected));
        }
    }
    Err(cursor.expected(expected))
}

/// A kind by its words; the longest that fit count.
fn kind(cursor: &mut Cursor, class: TargetClass) -> Result<FaultKind, ScriptError> {
    let mut all: Vec<&KindInfo> = CATALOGUE.iter().collect();
    all.sort_by_key(|info| Reverse(first_words(info).first().map_or(0, |words| words.len())));
    let before = cursor.clone();
    let begins = |info: &&&KindInfo| match first_words(info) {
        [] => cursor.is_number(),
        words => words.iter().any(|words| cursor.take(words)),
    };
    let info = all.iter().find(begins).ok_or_else(|| before.expected(kinds()))?;
    if !info.targets.allow(class) {
        let why = match (class, info.targets) {
            (TargetClass::Sensor(_), _) => "not for sensors",
            (_, Targets::SENSORS) => "only for sensors",
            (_, Targets::PARTS) => "only for parts of the airframe",
            (TargetClass::Part, _) => "not for parts of the airframe",
            (_, targets) if targets.thrust => "only for the engine",
            _ => "not for the engine",
        };
        let why = format!("`{}` is {why}", words(info));
        return Err(before.problem(Problem::NotForThisTarget(why)));
    }
    let (mut values, mut alternative) = ([0.0; NUMBERS_MAX], 0);
    for piece in info.phrase.iter().skip(usize::from(!first_words(info).is_empty())) {
        match *piece {
            Piece::Words(words) => cursor.need(words.first().unwrap_or(&""))?,
            Piece::Optional(word) => drop(cursor.take(word)),
            Piece::Number(quantity) => {
                let mut numbers = values.iter_mut().zip(info.numbers);
                let place = numbers.find(|(_, number)| number.quantity == quantity);
                if let Some((value, number)) = place {
                    *value = self::number(cursor, number, class)?;
                }
            }
            Piece::Choice => {
                if let Some(choice) = &info.choice {
                    alternative = self::choice(cursor, choice)?;
                }
            }
        }
    }
    info.with(alternative, values).ok_or_else(|| before.expected(kinds()))
}

/// The words that begin a kind; none: it begins with a number.
fn first_words(info: &KindInfo) -> &'static [&'static str] {
    match info.phrase.first() {
        Some(Piece::Words(words)) => words,
        _ => &[],
    }
}

/// Name of a kind in messages.
fn words(info: &KindInfo) -> String {
    if let Some(words) = first_words(info).first() {
        return (*words).to_owned();
    }
    let words = info.phrase.iter().filter_map(|piece| match piece {
        Piece::Words(words) => words.first().copied(),
        Piece::Number(quantity) => Some(quantity.measure().unit(TargetClass::Angle).name),
        Piece::Optional(_) | Piece::Choice => None,
    });
    format!("a number {}", words.collect::<Vec<_>>().join(" "))
}

/// Names of all kinds in messages.
fn kinds() -> String {
    let all: Vec<String> = CATALOGUE.iter().map(words).collect();
    format!("a kind of fault: {}", all.join(", "))
}

/// A number with its unit, in SI units; times accept any unit of time.
fn number(
    cursor: &mut Cursor,
    number: &NumberInfo,
    class: TargetClass,
) -> Result<f64, ScriptError> {
    let (what, measure) = (number.quantity.name(), number.quantity.measure());
    let unit = measure.unit(class);
    let [min, max] = number.range.anywhere(measure, class);
    if matches!(measure, Seconds | Milliseconds) {
        let range = (unit.to_si(min), unit.to_si(max));
        return cursor.amount(what, &SECONDS)?.within(range, ("s", 1.0));
    }
    let amount = cursor.amount(what, &[(&unit.name.to_ascii_lowercase(), 1.0)])?;
    amount.within((min, max), (unit.name, 1.0)).map(|value| unit.to_si(value))
}

/// An alternative by its words, from 0.
fn choice(cursor: &mut Cursor, choice: &Choice) -> Result<u8, ScriptError> {
    let all = (0..).zip(choice.alternatives);
    let all: Vec<(&str, u8)> =
        all.flat_map(|(place, one)| one.words.iter().map(move |words| (*words, place))).collect();
    match choice.default {
        Some(default) => Ok(cursor.choose(&all).unwrap_or(default)),
        None => cursor.need_one(choice.title, &all),
    }
}

/// A positive time, s.
fn duration(cursor: &mut Cursor, what: &'static str) -> Result<f64, ScriptError> {
    let duration = cursor.amount(what, &SECONDS)?;
    duration.within((1.0e-6, SimTime::MAX_SECONDS), ("s", 1.0))
}

/// `, ramp 1 s, for 5 s, every 10 s, 3 times`, in this order, each part once or not at all.
fn timing(cursor: &mut Cursor) -> Result<Timing, ScriptError> {
    let mut timing = Timing::from_onset(Onset::AtOnce);
    if cursor.take(", ramp") {
        timing.ramp_s = duration(cursor, "the ramp")?;
    }
    if cursor.take(", for") {
        timing.duration_s = Some(duration(cursor, "the duration")?);
    }
    if cursor.take(", every") {
        let problem = cursor.problem(Problem::EveryWithoutFor);
        let every_s = duration(cursor, "the repetition")?;
        if timing.duration_s.is_none_or(|duration_s| duration_s >= every_s) {
            return Err(problem);
        }
        let times = if cursor.take(",") {
            let times = cursor.whole_from(2, "how often", TIMES_MAX)?;
            cursor.need("times")?;
            Some(times)
        } else {
            None
        };
        timing.repeat = Some(Repeat { every_s, times });
    }
    if cursor.is_at_end() {
        Ok(timing)
    } else {
        Err(cursor.expected("the end of the line, or `, ramp`, `, for`, `, every` in this order"))
    }
}
