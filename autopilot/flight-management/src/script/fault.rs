//! `fail` and `clear`: targets, kinds of faults and their timing in words. The words of the kinds are those of the
//! catalogue; [`FaultDraft`] takes what they say.

use core::cmp::Reverse;

use icd::fault::{
    AirframePart, CATALOGUE, Choice, FaultDraft, FaultError, KindInfo, Piece, Quantity, SensorKind,
    Target, TargetClass, Targets,
};
use icd::{EffectorList, FaultRequest};

use super::cursor::Cursor;
use super::error::{Problem, ScriptError};

/// The rest of a line after `fail`.
pub(super) fn fail(
    cursor: &mut Cursor,
    effectors: &EffectorList,
) -> Result<FaultRequest, ScriptError> {
    let target = target(cursor, effectors, &names(effectors))?;
    let mut draft = kind(cursor, target.class(effectors))?;
    let before = cursor.clone();
    timing(cursor, &mut draft)?;
    let (kind, timing) = draft.finish().map_err(|error| refused(&before, &error))?;
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
const UNITS: [(&str, bool); 2] = [(Target::SERVO.1, true), (Target::MOTOR.1, false)];

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

/// A target by its display name, its name in files, or as an effector its name in ground stations. The longest name that fits
/// counts.
fn target(
    cursor: &mut Cursor,
    effectors: &EffectorList,
    expected: &str,
) -> Result<Target, ScriptError> {
    let names =
        |target: Target| [target.name(effectors), target.key(effectors)].map(|name| (name, target));
    let mut all: Vec<(&str, Target)> = Target::all(effectors).flat_map(names).collect();
    all.sort_by_key(|(name, _)| Reverse(name.len()));
    if let Some(target) = cursor.choose(&all) {
        return Ok(target);
    }
    for (unit, is_angle) in UNITS {
        let members = effectors.by_unit(is_angle);
        let instance = |effector| u32::from(effectors.instance(effector));
        let in_one_word = members
            .iter()
            .copied()
            .find(|effector| cursor.take(&format!("{unit}{}", instance(*effector))));
        if let Some(effector) = in_one_word {
            return Ok(effector.into());
        }
        let Some(last) = members.last() else { continue };
        let before = cursor.clone();
        if cursor.take(unit) {
            let number = cursor.whole(unit, instance(*last))?;
            let found = members.iter().find(|effector| instance(**effector) == number);
            return found.copied().map(Target::from).ok_or_else(|| before.expected(expected));
        }
    }
    Err(cursor.expected(expected))
}

/// A kind by its words, of which the longest that fit count, with its numbers.
fn kind(cursor: &mut Cursor, class: TargetClass) -> Result<FaultDraft, ScriptError> {
    let named = |info| first_words(info).iter().map(move |words| (*words, info));
    let mut all: Vec<(&str, &'static KindInfo)> = CATALOGUE.iter().flat_map(named).collect();
    all.sort_by_key(|(words, _)| Reverse(words.len()));
    let before = cursor.clone();
    let begins_with_number = CATALOGUE.iter().find(|info| first_words(info).is_empty());
    let info = cursor.choose(&all).or(begins_with_number.filter(|_| cursor.is_number()));
    let info = info.ok_or_else(|| before.expected(kinds()))?;
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
        return Err(before.problem(Problem::Fault(why)));
    }
    let mut draft = FaultDraft::new(info, class);
    for piece in info.phrase.iter().skip(usize::from(!first_words(info).is_empty())) {
        match *piece {
            Piece::Words(words) => cursor.need(words.first().unwrap_or(&""))?,
            Piece::Optional(word) => drop(cursor.take(word)),
            Piece::Number(quantity) => number(cursor, &mut draft, quantity)?,
            Piece::Choice => {
                let alternative = info.choice.map(|choice| self::choice(cursor, &choice));
                if let Some(alternative) = alternative.transpose()?.flatten() {
                    draft.choose(alternative);
                }
            }
        }
    }
    Ok(draft)
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

/// A number with one of its units.
fn number(
    cursor: &mut Cursor,
    draft: &mut FaultDraft,
    quantity: Quantity,
) -> Result<(), ScriptError> {
    let before = cursor.clone();
    let value = cursor.number(quantity.name())?;
    let units = quantity.measure().units(draft.class);
    let written: Vec<String> = units.iter().map(|unit| unit.name.to_ascii_lowercase()).collect();
    let choices: Vec<_> = written.iter().map(String::as_str).zip(units.iter().copied()).collect();
    let unit = cursor.unit(&choices)?;
    draft.set(quantity, value, unit).map_err(|error| refused(&before, &error))
}

/// A problem with what comes next at the cursor.
fn refused(cursor: &Cursor, error: &FaultError) -> ScriptError {
    cursor.problem(Problem::Fault(error.to_string()))
}

/// An alternative by its words, from 0; `None` for that of a choice without words.
fn choice(cursor: &mut Cursor, choice: &Choice) -> Result<Option<u8>, ScriptError> {
    let all = (0..).zip(choice.alternatives);
    let all: Vec<(&str, u8)> =
        all.flat_map(|(place, one)| one.words.iter().map(move |words| (*words, place))).collect();
    match choice.default {
        Some(_) => Ok(cursor.choose(&all)),
        None => cursor.need_one(choice.title, &all).map(Some),
    }
}

/// `, ramp 1 s, for 5 s, every 10 s, 3 times`, in this order, each part once or not at all.
fn timing(cursor: &mut Cursor, draft: &mut FaultDraft) -> Result<(), ScriptError> {
    use Quantity::{Duration, Every, Ramp, Times};
    let mut is_repeated = false;
    for (words, quantity) in [(", ramp", Ramp), (", for", Duration), (", every", Every)] {
        if cursor.take(words) {
            number(cursor, draft, quantity)?;
            is_repeated = quantity == Every;
        }
    }
    if is_repeated && cursor.take(",") {
        number(cursor, draft, Times)?;
    }
    if cursor.is_at_end() {
        Ok(())
    } else {
        Err(cursor.expected("the end of the line, or `, ramp`, `, for`, `, every` in this order"))
    }
}
