//! Text to sequences of lines: words with their columns, a cursor that takes the next word or reports the expected one, and what
//! the words mean. The words of the kinds of faults are those of the catalogue; [`FaultDraft`] takes what they say.

use core::cmp::Reverse;
use core::fmt;

use icd::fault::{
    AirframePart, CATALOGUE, Choice, FaultDraft, KindInfo, Piece, Quantity, SensorKind, Target,
    TargetClass, Targets,
};
use icd::units::DEG;
use icd::{EffectorKind, EffectorList, FaultRequest, SimTime};

use super::{
    Action, Condition, Crossing, LINES_MAX, Line, QUANTITIES, SEQUENCES_MAX, Sequence, TEXT_MAX,
    Trigger,
};
use crate::TextError;
use crate::vehicle::schedule::{AIRSPEED_M_S, ALTITUDE_M, ROLL_DEG};
use crate::vehicle::{Mode, Reference};

/// Units of a time, with their factors to seconds.
const SECONDS: [Unit; 3] = [("s", 1.0), ("ms", 1.0e-3), ("min", 60.0)];
/// What makes a reference of a number in SI.
type MakeReference = fn(f64) -> Reference;
/// A unit and its factor to SI.
type Unit = (&'static str, f64);
/// References: their words, unit with its factor to SI, and range in that unit.
const REFERENCES: [(&str, Unit, (f64, f64), MakeReference); 4] = [
    ("altitude", ("m", 1.0), ALTITUDE_M, Reference::Altitude),
    ("airspeed", ("m/s", 1.0), AIRSPEED_M_S, Reference::Airspeed),
    ("roll", ("deg", DEG), ROLL_DEG, Reference::Roll),
    ("course", ("deg", DEG), (0.0, 360.0), Reference::Course),
];
/// The modes that need no stream of a ground station.
const MODES: [(&str, Mode); 5] = [
    ("position", Mode::Position),
    ("hold", Mode::Hold),
    ("mission", Mode::Mission),
    ("return", Mode::Return),
    ("takeoff", Mode::Takeoff),
];
const ACTIONS: &str =
    "an action: fail, clear, altitude, roll, airspeed, course, mode, arm, disarm, land, say, end";

/// Reads a whole text.
pub(super) fn sequences(text: &str, effectors: &EffectorList) -> Result<Vec<Sequence>, TextError> {
    if text.len() > TEXT_MAX {
        return Err(too_long(text.len()));
    }
    let mut sequences = vec![Sequence { name: None, lines: Vec::new() }];
    let mut count = 0;
    // At most 16 KiB have fewer lines than u16 has numbers.
    for (line, number) in text.lines().zip(1_u16..) {
        let at = usize::from(number);
        let words = split(line, at)?;
        let Some(first) = words.first() else { continue };
        let mut cursor = Cursor::new(&words, at);
        if cursor.take("sequence") {
            begin_sequence(&mut cursor, number, &mut sequences)?;
            continue;
        }
        if count == LINES_MAX {
            let why = format!("more than {LINES_MAX} lines with an action");
            return Err(problem(at, first.column, why));
        }
        count += 1;
        let trigger = trigger(&mut cursor)?;
        let action = action(&mut cursor, effectors)?;
        cursor.end()?;
        let line = Line { number, text: joined(&words), trigger, action };
        if let Some(sequence) = sequences.last_mut() {
            sequence.lines.push(line);
        }
    }
    sequences.retain(|sequence| sequence.name.is_some() || !sequence.lines.is_empty());
    if count == 0 {
        return Err(problem(1, 1, "no line does anything"));
    }
    Ok(sequences)
}

/// The error for a text of more than [`TEXT_MAX`] bytes, of which `length` were read.
pub(super) fn too_long(length: impl fmt::Display) -> TextError {
    problem(1, 1, format!("the text has {length} bytes or more, at most {TEXT_MAX} are allowed"))
}

/// A problem at a line and a character of it, both from 1.
fn problem(line: usize, column: usize, why: impl fmt::Display) -> TextError {
    TextError(format!("line {line}, column {column}: {why}"))
}

fn begin_sequence(
    cursor: &mut Cursor,
    number: u16,
    sequences: &mut Vec<Sequence>,
) -> Result<(), TextError> {
    let before = cursor.clone();
    let name = cursor.name("the name of the sequence, one word")?.to_owned();
    cursor.end()?;
    let mut names = sequences.iter().filter_map(|sequence| sequence.name.as_ref());
    if names.any(|(_, other)| *other == name) {
        return Err(before.problem(format!("there is a sequence {name} already")));
    }
    // The one without a name counts only if it has a line with an action.
    let count = sequences.len() - usize::from(sequences[0].lines.is_empty());
    if count >= SEQUENCES_MAX {
        return Err(before.problem(format!("more than {SEQUENCES_MAX} sequences")));
    }
    sequences.push(Sequence { name: Some((number, name)), lines: Vec::new() });
    Ok(())
}

fn trigger(cursor: &mut Cursor) -> Result<Trigger, TextError> {
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

fn micros(cursor: &mut Cursor) -> Result<u64, TextError> {
    let seconds = cursor.amount("the time", &SECONDS, (0.0, SimTime::MAX_SECONDS))?;
    // In range, as just checked.
    Ok(SimTime::from_seconds(seconds).unwrap_or_default().as_micros())
}

fn condition(cursor: &mut Cursor) -> Result<Condition, TextError> {
    let quantities = QUANTITIES.each_ref().map(|row| (row.words, row));
    let row = cursor.expect_one_of("a quantity", &quantities)?;
    let crossings = [
        ("passes", Crossing::Passes),
        ("rises above", Crossing::RisesAbove),
        ("falls below", Crossing::FallsBelow),
    ];
    let crossing = cursor.expect_one_of("how it is crossed", &crossings)?;
    let value = cursor.amount(row.words, &[row.unit], row.range)?;
    Ok(Condition { quantity: row.quantity, crossing, value })
}

fn action(cursor: &mut Cursor, effectors: &EffectorList) -> Result<Action, TextError> {
    if cursor.take("fail") {
        return fail(cursor, effectors).map(Action::Fault);
    }
    if cursor.take("clear") {
        return clear(cursor, effectors).map(Action::Fault);
    }
    for (what, unit, range, reference) in REFERENCES {
        if cursor.take(what) {
            let value = cursor.amount(what, &[unit], range)?;
            return Ok(Action::Refer(reference(value)));
        }
    }
    for (word, action) in
        [("arm", Action::Arm(true)), ("disarm", Action::Arm(false)), ("land", Action::Land)]
    {
        if cursor.take(word) {
            return Ok(action);
        }
    }
    if cursor.take("mode") {
        return cursor.expect_one_of("a mode", &MODES).map(Action::Mode);
    }
    if cursor.take("say") {
        return cursor.text("the text to say").map(|()| Action::Say);
    }
    if cursor.take("end") {
        return Ok(Action::End);
    }
    Err(cursor.expected(ACTIONS))
}

/// The words after `say` in a line in plain form.
pub(super) fn said_text(line: &str) -> Option<&str> {
    line.split_once("say ").map(|(_, words)| words)
}

/// The rest of a line after `fail`.
fn fail(cursor: &mut Cursor, effectors: &EffectorList) -> Result<FaultRequest, TextError> {
    let target = target(cursor, effectors, &names(effectors))?;
    let mut draft = kind(cursor, target.class(effectors))?;
    let before = cursor.clone();
    timing(cursor, &mut draft)?;
    let (kind, timing) = draft.finish().map_err(|error| before.problem(error))?;
    Ok(FaultRequest::Inject { target, kind, timing })
}

/// The rest of a line after `clear`.
fn clear(cursor: &mut Cursor, effectors: &EffectorList) -> Result<FaultRequest, TextError> {
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

/// The effectors by their roles, so that a script for one aircraft runs on another whose effectors have other names.
fn roles(effectors: &EffectorList) -> impl Iterator<Item = (String, Target)> {
    let words = ["", "left ", "right "].into_iter().flat_map(|side| {
        EffectorKind::ALL.into_iter().map(move |kind| format!("{side}{}", kind.key()))
    });
    let both = words.flat_map(|role| [role.replace('_', " "), role.replace(' ', "_")]);
    both.filter_map(|role| effectors.by_key(&role).map(|effector| (role, effector.into())))
}

/// A target by its display name, its name in files, its role, or as an effector its name in ground stations. The longest name that fits
/// counts.
fn target(
    cursor: &mut Cursor,
    effectors: &EffectorList,
    expected: &str,
) -> Result<Target, TextError> {
    let names =
        |target: Target| [target.name(effectors), target.key(effectors)].map(|name| (name, target));
    let roles: Vec<(String, Target)> = roles(effectors).collect();
    let of_roles = roles.iter().map(|(role, target)| (role.as_str(), *target));
    let mut all: Vec<(&str, Target)> =
        Target::all(effectors).flat_map(names).chain(of_roles).collect();
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
fn kind(cursor: &mut Cursor, class: TargetClass) -> Result<FaultDraft, TextError> {
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
        return Err(before.problem(why));
    }
    let mut draft = FaultDraft::new(info, class);
    // The words at its beginning are taken already.
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
) -> Result<(), TextError> {
    let before = cursor.clone();
    let value = cursor.number(quantity.name())?;
    let units = quantity.measure().units(draft.class);
    let written: Vec<String> = units.iter().map(|unit| unit.name.to_ascii_lowercase()).collect();
    let choices: Vec<_> = written.iter().map(String::as_str).zip(units.iter().copied()).collect();
    let unit = cursor.unit(&choices)?;
    draft.set(quantity, value, unit).map_err(|error| before.problem(error))
}

/// An alternative by its words, from 0; `None` for that of a choice without words.
fn choice(cursor: &mut Cursor, choice: &Choice) -> Result<Option<u8>, TextError> {
    let all = (0..).zip(choice.alternatives);
    let all: Vec<(&str, u8)> =
        all.flat_map(|(place, one)| one.words.iter().map(move |words| (*words, place))).collect();
    match choice.default {
        Some(_) => Ok(cursor.choose(&all)),
        None => cursor.expect_one_of(choice.title, &all).map(Some),
    }
}

/// `, ramp 1 s, for 5 s, every 10 s, 3 times`, in this order, each part once or not at all.
fn timing(cursor: &mut Cursor, draft: &mut FaultDraft) -> Result<(), TextError> {
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

/// A position in the words of a line.
#[derive(Clone)]
struct Cursor<'a> {
    words: &'a [Word],
    line: usize,
    at: usize,
}

impl<'a> Cursor<'a> {
    fn new(words: &'a [Word], line: usize) -> Self {
        Self { words, line, at: 0 }
    }

    /// Column of the next word, or the one after the last.
    fn column(&self) -> usize {
        match (self.words.get(self.at), self.words.last()) {
            (Some(next), _) => next.column,
            (None, Some(last)) => last.column + last.kind.to_string().chars().count(),
            (None, None) => 1,
        }
    }

    fn is_at_end(&self) -> bool {
        self.at >= self.words.len()
    }

    /// A problem with the next word.
    fn problem(&self, why: impl fmt::Display) -> TextError {
        problem(self.line, self.column(), why)
    }

    fn next(&self) -> Option<&'a WordKind> {
        self.words.get(self.at).map(|word| &word.kind)
    }

    /// An error here, with the expected text.
    fn expected(&self, expected: impl fmt::Display) -> TextError {
        let end = || "end of the line".to_owned();
        let found = self.next().map_or_else(end, |word| quoted(&word.to_string()));
        self.problem(format!("{found} found, expected {expected}"))
    }

    /// Takes these words (`a b c`) if they come next.
    fn take(&mut self, words: &str) -> bool {
        let mut at = self.at;
        for word in words.split(' ') {
            let is_next = match self.words.get(at).map(|word| &word.kind) {
                Some(WordKind::Name(name)) => name == word,
                Some(WordKind::Sign(sign)) => word.chars().eq([*sign]),
                Some(WordKind::Number(_) | WordKind::Text(_)) | None => false,
            };
            if !is_next {
                return false;
            }
            at += 1;
        }
        self.at = at;
        true
    }

    /// Takes these words, or returns an error that expects them.
    fn need(&mut self, words: &str) -> Result<(), TextError> {
        if self.take(words) { Ok(()) } else { Err(self.expected(quoted(words))) }
    }

    /// Takes the first of these that comes next.
    fn choose<T: Copy>(&mut self, choices: &[(&str, T)]) -> Option<T> {
        choices.iter().find(|(words, _)| self.take(words)).map(|(_, choice)| *choice)
    }

    /// The same; an error if none of them comes next.
    fn expect_one_of<T: Copy>(
        &mut self,
        what: &str,
        choices: &[(&str, T)],
    ) -> Result<T, TextError> {
        self.choose(choices).ok_or_else(|| {
            let names: Vec<&str> = choices.iter().map(|(words, _)| *words).collect();
            self.expected(format!("{what}: {}", names.join(", ")))
        })
    }

    /// A number and its unit, one of these with its factor to SI: in SI, if it is inside a range in the first unit.
    fn amount(
        &mut self,
        what: &str,
        units: &[(&str, f64)],
        (low, high): (f64, f64),
    ) -> Result<f64, TextError> {
        let before = self.clone();
        let value = self.number(what)? * self.unit(units)?;
        let (unit, scale) = units.first().copied().unwrap_or(("", 1.0));
        if (low * scale..=high * scale).contains(&value) {
            return Ok(value);
        }
        let (value, low, high) = (round(value / scale), round(low), round(high));
        Err(before.problem(format!("{what} {value} is outside {low} to {high} {unit}")))
    }

    /// One of these units.
    fn unit<T: Copy>(&mut self, units: &[(&str, T)]) -> Result<T, TextError> {
        self.choose(units).ok_or_else(|| {
            let names: Vec<&str> = units.iter().map(|(name, _)| unit(name)).collect();
            self.expected(format!("the unit {}", names.join(" or ")))
        })
    }

    fn number(&mut self, what: &str) -> Result<f64, TextError> {
        let Some(WordKind::Number(value)) = self.next() else {
            return Err(self.expected(format!("a number ({what})")));
        };
        self.at += 1;
        Ok(*value)
    }

    /// A whole number from 1 on.
    fn whole(&mut self, what: &'static str, max: u32) -> Result<u32, TextError> {
        let before = self.clone();
        let value = self.number(what)?;
        if value.fract() == 0.0 && (1.0..=f64::from(max)).contains(&value) {
            // Whole and in range, as just checked.
            return Ok(value as u32);
        }
        Err(before.problem(format!("{what} {value} is outside 1 to {max} ")))
    }

    /// Whether a number comes next.
    fn is_number(&self) -> bool {
        matches!(self.next(), Some(WordKind::Number(_)))
    }

    /// A name that the author of the script chooses.
    fn name(&mut self, what: &str) -> Result<&'a str, TextError> {
        let Some(WordKind::Name(name)) = self.next() else { return Err(self.expected(what)) };
        self.at += 1;
        Ok(name)
    }

    fn text(&mut self, what: &str) -> Result<(), TextError> {
        let Some(WordKind::Text(_)) = self.next() else { return Err(self.expected(what)) };
        self.at += 1;
        Ok(())
    }

    /// An error unless the line ends here.
    fn end(&self) -> Result<(), TextError> {
        if self.is_at_end() { Ok(()) } else { Err(self.expected("the end of the line")) }
    }
}

/// For display: without the noise of the last digits.
fn round(value: f64) -> f64 {
    let rounded = (value * 1.0e6).round() / 1.0e6;
    // Of a huge number the product is infinite.
    if rounded.is_finite() { rounded } else { value }
}

#[derive(Debug, Clone, PartialEq)]
struct Word {
    /// Character of the line, from 1.
    column: usize,
    kind: WordKind,
}

#[derive(Debug, Clone, PartialEq)]
enum WordKind {
    /// Letters, digits, and the characters of units and names; in small letters.
    Name(String),
    Number(f64),
    /// `,`, `:` or `%`.
    Sign(char),
    /// The text after `say`, as written.
    Text(String),
}

impl fmt::Display for WordKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(unit(name)),
            Self::Number(number) => write!(f, "{number}"),
            Self::Sign(sign) => write!(f, "{sign}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// Units for display, some of which have capital letters.
fn unit(name: &str) -> &str {
    match name {
        "kn" => "kN",
        "kn/s" => "kN/s",
        "n" => "N",
        "n/s" => "N/s",
        "hz" => "Hz",
        other => other,
    }
}

/// The words of a line up to its comment.
fn split(line: &str, number: usize) -> Result<Vec<Word>, TextError> {
    let chars: Vec<char> = line.chars().collect();
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(first) = chars.get(at).copied().filter(|first| *first != '#') {
        let column = at + 1;
        let run = |part: fn(char) -> bool| {
            let rest = chars[at..].iter().skip(1);
            // The first character may be a sign, the others may not.
            1 + rest.take_while(|c| part(**c)).count()
        };
        let (length, kind) = match first {
            _ if first.is_whitespace() => {
                at += 1;
                continue;
            }
            ',' | ':' | '%' => (1, WordKind::Sign(first)),
            '0'..='9' | '.' | '+' | '-' => {
                let length = run(|c| c.is_ascii_digit() || c == '.');
                let text: String = chars[at..at + length].iter().collect();
                let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
                let value = value.ok_or_else(|| {
                    let found = quoted(&text);
                    let why = format!("{found} found, expected a number such as 10 or -2.5");
                    problem(number, column, why)
                })?;
                (length, WordKind::Number(value))
            }
            _ if first.is_ascii_alphabetic() => {
                let length = run(|c| c.is_ascii_alphanumeric() || "_-'/".contains(c));
                let text: String = chars[at..at + length].iter().collect();
                (length, WordKind::Name(text.to_ascii_lowercase()))
            }
            other => {
                return Err(problem(number, column, format!("{other:?} belongs to no word")));
            }
        };
        let is_text_next = kind == WordKind::Name("say".to_owned());
        words.push(Word { column, kind });
        at += length;
        if is_text_next {
            // Free text: up to the comment, without the spaces around it.
            let blank = chars[at..].iter().take_while(|c| c.is_whitespace()).count();
            let text: String = chars[at + blank..].iter().take_while(|c| **c != '#').collect();
            let text = text.trim_end();
            if !text.is_empty() {
                let kind = WordKind::Text(text.to_owned());
                words.push(Word { column: at + blank + 1, kind });
            }
            break;
        }
    }
    Ok(words)
}

/// A word for display in a message.
fn quoted(text: &str) -> String {
    format!("`{text}`")
}

/// The words in plain form.
fn joined(words: &[Word]) -> String {
    let mut text = String::new();
    for word in words {
        if !text.is_empty() && !matches!(word.kind, WordKind::Sign(',' | ':')) {
            text.push(' ');
        }
        text.push_str(&word.kind.to_string());
    }
    text
}
