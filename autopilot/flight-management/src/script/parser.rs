//! Text to sequences of lines.

use super::cursor::{self, Cursor, SECONDS, Word};
use super::error::{Problem, ScriptError};
use super::quantity::{Condition, Crossing, ROWS};
use super::{Action, LINES_MAX, Line, SEQUENCES_MAX, Sequence, TEXT_MAX, Trigger, fault};
use crate::vehicle::schedule::AIRSPEED_M_S;
use crate::vehicle::{Mode, Reference};
use icd::units::DEG;
use icd::{EffectorList, SimTime};

const METRES: [(&str, f64); 1] = [("m", 1.0)];
const METRES_PER_SECOND: [(&str, f64); 1] = [("m/s", 1.0)];
/// Units of an angle, with their factors to rad.
pub(super) const DEGREES: [(&str, f64); 1] = [("deg", DEG)];
/// The modes that need no stream of a ground station.
const MODES: [(&str, Mode); 4] = [
    ("position", Mode::Position),
    ("hold", Mode::Hold),
    ("mission", Mode::Mission),
    ("return", Mode::Return),
];
const ACTIONS: &str = "an action: fail, clear, altitude, roll, airspeed, course, mode, say, end";

/// Reads a whole text.
pub(super) fn sequences(
    text: &str,
    effectors: &EffectorList,
) -> Result<Vec<Sequence>, ScriptError> {
    if text.len() > TEXT_MAX {
        return Err(Problem::TextTooLong(text.len()).at(1, 1));
    }
    let mut sequences = vec![Sequence { name: None, lines: Vec::new() }];
    let mut count = 0;
    for (line, number) in text.lines().zip(1_u16..) {
        let at = usize::from(number);
        let words = cursor::split(line, at)?;
        let Some(first) = words.first() else { continue };
        let column = first.column;
        let mut cursor = Cursor::new(&words, at);
        if cursor.take("sequence") {
            begin_sequence(&mut cursor, number, &mut sequences)?;
            continue;
        }
        if count == LINES_MAX {
            return Err(Problem::TooManyLines.at(at, column));
        }
        count += 1;
        let line = read(&mut cursor, &words, number, effectors)?;
        if let Some(sequence) = sequences.last_mut() {
            sequence.lines.push(line);
        }
    }
    sequences.retain(|sequence| sequence.name.is_some() || !sequence.lines.is_empty());
    if count == 0 {
        return Err(Problem::Empty.at(1, 1));
    }
    Ok(sequences)
}

fn begin_sequence(
    cursor: &mut Cursor,
    number: u16,
    sequences: &mut Vec<Sequence>,
) -> Result<(), ScriptError> {
    let place = cursor.problem(Problem::TooManySequences);
    let name = cursor.name("the name of the sequence, one word")?.to_owned();
    cursor.end()?;
    let mut names = sequences.iter().filter_map(|sequence| sequence.name.as_ref());
    if names.any(|(_, other)| *other == name) {
        return Err(ScriptError { problem: Box::new(Problem::SameName(name)), ..place });
    }
    // The one without a name counts only if it has a line with an action.
    let count = sequences.len() - usize::from(sequences[0].lines.is_empty());
    if count >= SEQUENCES_MAX {
        return Err(place);
    }
    sequences.push(Sequence { name: Some((number, name)), lines: Vec::new() });
    Ok(())
}

fn read(
    cursor: &mut Cursor,
    words: &[Word],
    number: u16,
    effectors: &EffectorList,
) -> Result<Line, ScriptError> {
    let trigger = trigger(cursor)?;
    let action = action(cursor, effectors)?;
    cursor.end()?;
    Ok(Line { number, text: cursor::joined(words), trigger, action })
}

fn trigger(cursor: &mut Cursor) -> Result<Trigger, ScriptError> {
    let trigger = if cursor.take("at") {
        Trigger::At(micros(cursor)?)
    } else if cursor.take("after") {
        Trigger::After(micros(cursor)?)
    } else if cursor.take("when") {
        Trigger::When(condition(cursor)?)
    } else {
        return Ok(Trigger::AtOnce);
    };
    cursor.need(":")?;
    Ok(trigger)
}

fn micros(cursor: &mut Cursor) -> Result<u64, ScriptError> {
    let time = cursor.amount("the time", &SECONDS)?;
    let seconds = time.within((0.0, SimTime::MAX_SECONDS), ("s", 1.0))?;
    // In range, as just checked.
    Ok(SimTime::from_seconds(seconds).unwrap_or_default().as_micros())
}

fn condition(cursor: &mut Cursor) -> Result<Condition, ScriptError> {
    let row = ROWS.iter().find(|row| cursor.take(row.words)).ok_or_else(|| {
        let names: Vec<&str> = ROWS.iter().map(|row| row.words).collect();
        cursor.expected(format!("a quantity: {}", names.join(", ")))
    })?;
    let crossings = [
        ("passes", Crossing::Passes),
        ("rises above", Crossing::RisesAbove),
        ("falls below", Crossing::FallsBelow),
    ];
    let crossing = cursor.need_one("how it is crossed", &crossings)?;
    let (low, high) = row.range;
    let amount = cursor.amount(row.words, &[(row.unit, row.scale)])?;
    let value = amount.within((low * row.scale, high * row.scale), (row.unit, row.scale))?;
    Ok(Condition { quantity: row.quantity, crossing, value })
}

fn action(cursor: &mut Cursor, effectors: &EffectorList) -> Result<Action, ScriptError> {
    if cursor.take("fail") {
        return fault::fail(cursor, effectors).map(Action::Fault);
    }
    if cursor.take("clear") {
        return fault::clear(cursor, effectors).map(Action::Fault);
    }
    if cursor.take("altitude") {
        let altitude = cursor.amount("altitude", &METRES)?;
        return altitude
            .within((0.0, 20_000.0), ("m", 1.0))
            .map(|m| Action::Refer(Reference::Altitude(m)));
    }
    if cursor.take("airspeed") {
        let airspeed = cursor.amount("airspeed", &METRES_PER_SECOND)?;
        return airspeed
            .within(AIRSPEED_M_S, ("m/s", 1.0))
            .map(|m_s| Action::Refer(Reference::Airspeed(m_s)));
    }
    if cursor.take("roll") {
        return angle(cursor, "roll", (-80.0, 80.0)).map(|rad| Action::Refer(Reference::Roll(rad)));
    }
    if cursor.take("course") {
        return angle(cursor, "course", (0.0, 360.0))
            .map(|rad| Action::Refer(Reference::Course(rad)));
    }
    if cursor.take("mode") {
        return cursor.need_one("a mode", &MODES).map(Action::Mode);
    }
    if cursor.take("say") {
        return cursor.text("the text to say").map(|()| Action::Say);
    }
    if cursor.take("end") {
        return Ok(Action::End);
    }
    Err(cursor.expected(ACTIONS))
}

fn angle(
    cursor: &mut Cursor,
    what: &'static str,
    (min, max): (f64, f64),
) -> Result<f64, ScriptError> {
    let [(unit, deg)] = DEGREES;
    cursor.amount(what, &DEGREES)?.within((min * deg, max * deg), (unit, deg))
}

/// The words after `say` in a line in plain form.
pub(super) fn said_text(line: &str) -> Option<&str> {
    line.split_once("say ").map(|(_, words)| words)
}
