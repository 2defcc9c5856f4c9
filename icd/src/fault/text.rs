//! A kind of fault in the words of scripts.

use core::fmt;

use super::catalogue::FaultKind;
use super::kind::{NumberInfo, Piece};
use super::parts::Parts;
use super::target::TargetClass;

/// A kind of fault in words.
#[derive(Debug, Clone, Copy)]
pub struct Described {
    pub(super) kind: FaultKind,
    pub(super) class: TargetClass,
}

impl fmt::Display for Described {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (info, Parts { choice, values, .. }) = (self.kind.info(), self.kind.parts());
        let mut before = "";
        for piece in info.phrase.iter().copied() {
            let words = match piece {
                Piece::Words(words) => words.first().copied(),
                Piece::Maybe(word) => Some(word),
                Piece::Choice => info
                    .choice
                    .and_then(|all| all.alternatives.get(usize::from(choice)))
                    .and_then(|one| one.words.first().copied()),
                Piece::Number(quantity) => {
                    let mut numbers = info.numbers.iter().zip(values);
                    if let Some((number, value)) = numbers.find(|(n, _)| n.quantity == quantity) {
                        f.write_str(before)?;
                        write_number(f, number, value, self.class)?;
                        before = " ";
                    }
                    None
                }
            };
            if let Some(words) = words {
                write!(f, "{before}{words}")?;
                before = " ";
            }
        }
        Ok(())
    }
}

fn write_number(
    f: &mut fmt::Formatter<'_>,
    number: &NumberInfo,
    si: f64,
    class: TargetClass,
) -> fmt::Result {
    let unit = number.quantity.measure().unit(class);
    let value = unit.from_si(si);
    match number.decimals {
        Some(decimals) => write!(f, "{value:.*} {}", usize::from(decimals), unit.name),
        None => write!(f, "{} {}", Tidy(value), unit.name),
    }
}

/// A number with the digits that somebody could have typed: up to four decimals, no zeros behind.
pub(super) struct Tidy(pub f64);

impl Tidy {
    pub fn rounded(&self) -> f64 {
        // Adding 0.0 makes -0 a 0.
        libm::round(self.0 * 1.0e4) / 1.0e4 + 0.0
    }
}

impl fmt::Display for Tidy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = self.rounded();
        // What would vanish, and what is no number, is told as it is.
        if self.0 != 0.0 && rounded == 0.0 { write!(f, "{:e}", self.0) } else { rounded.fmt(f) }
    }
}
