//! A line of text as words with their columns, and a cursor that takes the next word or reports the expected one.

use super::error::{Problem, ScriptError};
use core::fmt;

/// Units of a time, with their factors to seconds.
pub(super) const SECONDS: [(&str, f64); 3] = [("s", 1.0), ("ms", 1.0e-3), ("min", 60.0)];

/// A position in the words of a line.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    words: &'a [Word],
    line: usize,
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(words: &'a [Word], line: usize) -> Self {
        Self { words, line, at: 0 }
    }

    /// Column of the next word, or the one after the last.
    pub(super) fn column(&self) -> usize {
        match (self.words.get(self.at), self.words.last()) {
            (Some(next), _) => next.column,
            (None, Some(last)) => last.column + last.kind.to_string().chars().count(),
            (None, None) => 1,
        }
    }

    pub(super) fn is_at_end(&self) -> bool {
        self.at >= self.words.len()
    }

    /// A problem with the next word.
    pub(super) fn problem(&self, problem: Problem) -> ScriptError {
        problem.at(self.line, self.column())
    }

    /// An error here, with the expected text.
    pub(super) fn expected(&self, expected: impl Into<String>) -> ScriptError {
        let found = self.words.get(self.at);
        let found =
            found.map_or_else(|| "end of the line".to_owned(), |w| quoted(&w.kind.to_string()));
        self.problem(Problem::Unexpected { found, expected: expected.into() })
    }

    /// Takes these words (`a b c`) if they come next.
    pub(super) fn take(&mut self, words: &str) -> bool {
        let mut at = self.at;
        for word in words.split(' ') {
            let is_next = match self.words.get(at).map(|word| &word.kind) {
                Some(Kind::Name(name)) => name == word,
                Some(Kind::Sign(sign)) => word.chars().eq([*sign]),
                Some(Kind::Number(_) | Kind::Text(_)) | None => false,
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
    pub(super) fn need(&mut self, words: &str) -> Result<(), ScriptError> {
        if self.take(words) { Ok(()) } else { Err(self.expected(quoted(words))) }
    }

    /// Takes the first of these that comes next.
    pub(super) fn choose<T: Copy>(&mut self, choices: &[(&str, T)]) -> Option<T> {
        choices.iter().find(|(words, _)| self.take(words)).map(|(_, choice)| *choice)
    }

    /// The same; an error if none of them comes next.
    pub(super) fn need_one<T: Copy>(
        &mut self,
        what: &str,
        choices: &[(&str, T)],
    ) -> Result<T, ScriptError> {
        self.choose(choices).ok_or_else(|| {
            let names: Vec<&str> = choices.iter().map(|(words, _)| *words).collect();
            self.expected(format!("{what}: {}", names.join(", ")))
        })
    }

    /// A number and its unit, one of these with its factor to SI; the number is returned in SI.
    pub(super) fn amount(
        &mut self,
        what: &'static str,
        units: &[(&str, f64)],
    ) -> Result<Amount, ScriptError> {
        let column = self.column();
        let value = self.number(what)?;
        let scale = self.unit(units)?;
        Ok(Amount { what, line: self.line, column, value, scale })
    }

    /// One of these units.
    pub(super) fn unit<T: Copy>(&mut self, units: &[(&str, T)]) -> Result<T, ScriptError> {
        self.choose(units).ok_or_else(|| {
            let names: Vec<&str> = units.iter().map(|(name, _)| unit(name)).collect();
            self.expected(format!("the unit {}", names.join(" or ")))
        })
    }

    pub(super) fn number(&mut self, what: &str) -> Result<f64, ScriptError> {
        match self.words.get(self.at).map(|word| &word.kind) {
            Some(Kind::Number(value)) => {
                self.at += 1;
                Ok(*value)
            }
            _ => Err(self.expected(format!("a number ({what})"))),
        }
    }

    /// A whole number from 1 on.
    pub(super) fn whole(&mut self, what: &'static str, max: u32) -> Result<u32, ScriptError> {
        let (line, column) = (self.line, self.column());
        let value = self.number(what)?;
        if value.fract() == 0.0 && (1.0..=f64::from(max)).contains(&value) {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "whole and in range, as just checked"
            )]
            return Ok(value as u32);
        }
        let (value, min, max) = (value.to_string(), "1".to_owned(), max.to_string());
        Err(Problem::OutOfRange { what, value, min, max, unit: "" }.at(line, column))
    }

    /// Whether a number comes next.
    pub(super) fn is_number(&self) -> bool {
        matches!(self.words.get(self.at).map(|word| &word.kind), Some(Kind::Number(_)))
    }

    /// A name that the author of the script chooses.
    pub(super) fn name(&mut self, what: &str) -> Result<&'a str, ScriptError> {
        let words = self.words;
        match words.get(self.at).map(|word| &word.kind) {
            Some(Kind::Name(name)) => {
                self.at += 1;
                Ok(name)
            }
            _ => Err(self.expected(what)),
        }
    }

    pub(super) fn text(&mut self, what: &str) -> Result<(), ScriptError> {
        match self.words.get(self.at).map(|word| &word.kind) {
            Some(Kind::Text(_)) => {
                self.at += 1;
                Ok(())
            }
            _ => Err(self.expected(what)),
        }
    }

    /// An error unless the line ends here.
    pub(super) fn end(&self) -> Result<(), ScriptError> {
        if self.is_at_end() { Ok(()) } else { Err(self.expected("the end of the line")) }
    }
}

/// A number with its unit, not yet checked.
pub(super) struct Amount {
    what: &'static str,
    line: usize,
    column: usize,
    value: f64,
    scale: f64,
}

impl Amount {
    /// In SI units, if it is inside a range in SI units; `unit` and its factor are those of the message.
    pub(super) fn within(
        self,
        (min, max): (f64, f64),
        unit: (&'static str, f64),
    ) -> Result<f64, ScriptError> {
        let value = self.si();
        if (min..=max).contains(&value) {
            return Ok(value);
        }
        let (unit, scale) = unit;
        let shown = |si: f64| format!("{}", round(si / scale));
        let (value, min, max) = (shown(value), shown(min), shown(max));
        let problem = Problem::OutOfRange { what: self.what, value, min, max, unit };
        Err(problem.at(self.line, self.column))
    }

    pub(super) fn si(&self) -> f64 {
        self.value * self.scale
    }
}

/// For display: without the noise of the last digits.
fn round(value: f64) -> f64 {
    let rounded = (value * 1.0e6).round() / 1.0e6;
    if rounded.is_finite() { rounded } else { value }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Word {
    /// Character of the line, from 1.
    pub column: usize,
    pub kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// Letters, digits, and the characters of units and names; in small letters.
    Name(String),
    Number(f64),
    /// `,`, `:` or `%`.
    Sign(char),
    /// The text after `say`, as written.
    Text(String),
}

impl fmt::Display for Kind {
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
pub(super) fn unit(name: &str) -> &str {
    match name {
        "kn" => "kN",
        "kn/s" => "kN/s",
        "hz" => "Hz",
        other => other,
    }
}

/// The words of a line up to its comment.
pub(super) fn split(line: &str, number: usize) -> Result<Vec<Word>, ScriptError> {
    let chars: Vec<char> = line.chars().collect();
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(first) = chars.get(at).copied().filter(|first| *first != '#') {
        let column = at + 1;
        let run = |part: fn(char) -> bool| {
            let rest = chars[at..].iter().skip(1);
            1 + rest.take_while(|c| part(**c)).count()
        };
        let (length, kind) = match first {
            _ if first.is_whitespace() => {
                at += 1;
                continue;
            }
            ',' | ':' | '%' => (1, Kind::Sign(first)),
            '0'..='9' | '.' | '+' | '-' => {
                let length = run(|c| c.is_ascii_digit() || c == '.');
                let text: String = chars[at..at + length].iter().collect();
                let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
                let value = value.ok_or_else(|| {
                    let expected = "a number such as 10 or -2.5".to_owned();
                    Problem::Unexpected { found: quoted(&text), expected }.at(number, column)
                })?;
                (length, Kind::Number(value))
            }
            _ if first.is_ascii_alphabetic() => {
                let length = run(|c| c.is_ascii_alphanumeric() || "_-'/".contains(c));
                let text: String = chars[at..at + length].iter().collect();
                (length, Kind::Name(text.to_ascii_lowercase()))
            }
            other => return Err(Problem::Character(other).at(number, column)),
        };
        let is_text_next = kind == Kind::Name("say".to_owned());
        words.push(Word { column, kind });
        at += length;
        if is_text_next {
            // Free text: up to the comment, without the spaces around it.
            let blank = chars[at..].iter().take_while(|c| c.is_whitespace()).count();
            let text: String = chars[at + blank..].iter().take_while(|c| **c != '#').collect();
            let text = text.trim_end();
            if !text.is_empty() {
                let kind = Kind::Text(text.to_owned());
                words.push(Word { column: at + blank + 1, kind });
            }
            break;
        }
    }
    Ok(words)
}

/// A word for display in a message.
pub(super) fn quoted(text: &str) -> String {
    format!("`{text}`")
}

/// The words in plain form.
pub(super) fn joined(words: &[Word]) -> String {
    let mut text = String::new();
    for word in words {
        if !text.is_empty() && !matches!(word.kind, Kind::Sign(',' | ':')) {
            text.push(' ');
        }
        text.push_str(&word.kind.to_string());
    }
    text
}
