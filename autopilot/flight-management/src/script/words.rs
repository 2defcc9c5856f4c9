//! A line of text as words with their columns.

use core::fmt;

use super::error::{Problem, ScriptError};

/// One word.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Word {
    /// Character of the line, from 1.
    pub column: usize,
    pub kind: Kind,
}

/// Kinds of words.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// Letters, digits, and what units and names have; in small letters.
    Name(String),
    /// A finite number.
    Number(f64),
    /// `,`, `:` or `%`.
    Sign(char),
    /// What stands behind `say`, as it was written.
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

/// Units have capital letters for people.
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
                    let wanted = "a number such as 10 or -2.5".to_owned();
                    Problem::Unexpected { found: quoted(&text), wanted }.at(number, column)
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
        let speaks = kind == Kind::Name("say".to_owned());
        words.push(Word { column, kind });
        at += length;
        if speaks {
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

/// A word as it is shown in a message.
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
