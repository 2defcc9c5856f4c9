//! A kind of fault as code and numbers, and back.

use super::catalogue::{CATALOGUE, FaultKind};
use super::kind::KindInfo;
use super::target::TargetClass;
use super::text::Described;

/// Most numbers that a kind can have.
pub const NUMBERS_MAX: usize = 2;

/// A kind in parts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parts {
    pub choice: u8,
    pub values: [f64; NUMBERS_MAX],
    pub next: usize,
}

/// A field of a kind.
pub(super) trait Part: Sized {
    fn put(self, parts: &mut Parts);
    fn take(parts: &mut Parts) -> Option<Self>;
}

impl Part for f64 {
    fn put(self, parts: &mut Parts) {
        if let Some(value) = parts.values.get_mut(parts.next) {
            *value = self;
            parts.next += 1;
        }
    }

    fn take(parts: &mut Parts) -> Option<Self> {
        let value = parts.values.get(parts.next).copied();
        parts.next += 1;
        value
    }
}

impl FaultKind {
    /// Number for packets and logs, from 1; 0 stands for no fault.
    #[must_use]
    pub fn code(&self) -> u8 {
        self.info().code + self.parts().choice
    }

    /// The numbers of the kind in the order of its fields; 0 for those it does not have.
    #[must_use]
    pub fn values(&self) -> [f64; NUMBERS_MAX] {
        self.parts().values
    }

    /// The kind with this number and these values; `None` if there is none.
    #[must_use]
    pub fn from_code(code: u8, values: [f64; NUMBERS_MAX]) -> Option<Self> {
        let is_it = |info: &KindInfo| (info.code..info.code + info.alternatives()).contains(&code);
        let place = CATALOGUE.iter().position(is_it)?;
        let choice = code - CATALOGUE[place].code;
        Self::from_parts(place, Parts { choice, values, next: 0 })
    }

    /// It has a size that can grow from nothing, so that a ramp means something.
    #[must_use]
    pub fn has_size(&self) -> bool {
        self.info().has_size()
    }

    /// In the words of scripts, with the units of what has it.
    #[must_use]
    pub const fn described(&self, class: TargetClass) -> Described {
        Described { kind: *self, class }
    }
}
