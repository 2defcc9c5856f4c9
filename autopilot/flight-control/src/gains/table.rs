//! The table of tunables: name, unit, range, meaning, and where the value lives in [`Gains`].
//!
//! Each law lists the rows of its own gains beside them; here they come together.

use super::Gains;
use crate::{activation, compensator, main_controller};

/// One tunable gain.
#[derive(Debug, Clone, Copy)]
pub struct Tunable {
    /// Parameter name, at most 16 characters.
    pub name: &'static str,
    /// Unit; `-` for none.
    pub unit: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// What it does.
    pub meaning: &'static str,
    /// Reads it.
    pub get: fn(&Gains) -> f64,
    /// Writes it; check the set with [`Gains::validate`] afterwards.
    pub set: fn(&mut Gains, f64),
}

/// Rows of one block of [`Gains`]: name, unit, range, field, meaning.
macro_rules! rows {
    ($block:ident: $($name:literal, $unit:literal, $min:literal, $max:literal, $($field:ident).+, $meaning:literal;)*) => {
        &[$($crate::gains::Tunable {
            name: $name,
            unit: $unit,
            min: $min,
            max: $max,
            meaning: $meaning,
            get: |gains| gains.$block.$($field).+,
            set: |gains, value| gains.$block.$($field).+ = value,
        }),*]
    };
}
pub(crate) use rows;

/// The rows of each block, in the order of the parameters.
const BLOCKS: [&[Tunable]; 8] = [
    main_controller::TUNABLES,
    main_controller::pid::TUNABLES,
    main_controller::ndi::TUNABLES,
    main_controller::lqr::TUNABLES,
    compensator::neso::TUNABLES,
    compensator::linear_eso::TUNABLES,
    compensator::incremental::TUNABLES,
    activation::TUNABLES,
];

/// All tunable gains.
pub fn tunables() -> impl Iterator<Item = &'static Tunable> {
    BLOCKS.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_fit_a_mavlink_parameter_and_are_unique() {
        for (i, tunable) in tunables().enumerate() {
            assert!(tunable.name.len() <= 16, "{}", tunable.name);
            assert!(tunables().take(i).all(|other| other.name != tunable.name), "{}", tunable.name);
        }
    }

    #[test]
    fn each_entry_reads_what_it_writes_and_nothing_else() {
        for tunable in tunables() {
            let mut gains = Gains::REFERENCE;
            (tunable.set)(&mut gains, 0.123_456);
            for other in tunables() {
                let expected = if other.name == tunable.name {
                    0.123_456
                } else {
                    (other.get)(&Gains::REFERENCE)
                };
                assert_eq!(
                    (other.get)(&gains),
                    expected,
                    "{} through {}",
                    other.name,
                    tunable.name
                );
            }
        }
    }
}
