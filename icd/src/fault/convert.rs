//! A kind of fault as code and numbers, and as text; and back.

use core::fmt;

use super::catalogue::{CATALOGUE, FaultKind};
use super::kind::{KindInfo, NumberInfo, Piece};
use super::parts::{NUMBERS_MAX, Parts};
use super::quantity::Tidy;
use super::target::TargetClass;

impl FaultKind {
    /// Number in packets and logs, from 1; 0 stands for no fault.
    pub fn code(&self) -> u8 {
        self.info().code + self.parts().choice
    }

    /// The numbers of the kind in the order of its fields; 0 for those it does not have.
    pub fn values(&self) -> [f64; NUMBERS_MAX] {
        self.parts().values
    }

    /// The kind with this number and these values; `None` if there is none.
    pub fn from_code(code: u8, values: [f64; NUMBERS_MAX]) -> Option<Self> {
        let is_it = |info: &KindInfo| (info.code..info.code + info.alternatives()).contains(&code);
        let place = CATALOGUE.iter().position(is_it)?;
        let choice = code - CATALOGUE[place].code;
        Self::from_parts(place, Parts { choice, values, next: 0 })
    }

    /// Whether it has a size, which a ramp can increase from nothing.
    pub fn has_size(&self) -> bool {
        self.info().has_size()
    }

    /// As a phrase of the script language, with the units of the target's class.
    pub const fn described(&self, class: TargetClass) -> Described {
        Described { kind: *self, class }
    }
}

impl KindInfo {
    /// The kind with this alternative (from 0) and these numbers, SI units; `None` without such an alternative.
    pub fn with(&self, alternative: u8, values: [f64; NUMBERS_MAX]) -> Option<FaultKind> {
        let code = self.code.checked_add(alternative)?;
        FaultKind::from_code(code, values).filter(|kind| kind.info().code == self.code)
    }

    /// The entry with this name in scenario files.
    pub fn by_key(key: &str) -> Option<&'static Self> {
        CATALOGUE.iter().find(|info| info.key == key)
    }
}

/// A kind of fault as a phrase of the script language.
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
                Piece::Optional(word) => Some(word),
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
