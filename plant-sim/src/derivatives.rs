//! The aerodynamic derivatives by name: paper letters, configuration key, allowed range, field.
//!
//! A table here lists those of the aircraft without its surfaces; those of surfaces are named by the kind of surface
//! and mean all surfaces of the kind. The reader of the airframe file, its range check, and the campaigns that disperse
//! them share one table.

use icd::{EffectorKind, EffectorList, PerEffector};

use crate::Airframe;
use crate::aerodynamics::surfaces::SurfaceField;
use crate::aerodynamics::{Aero, Aerodynamics, SurfaceDerivatives};
use crate::range::{RangeError, check_range};

/// One derivative.
pub struct Derivative {
    /// The letters (docs/parameter-set.md), as in `Cma`.
    pub name: &'static str,
    /// Key in the `[aerodynamics]` table of the airframe file.
    pub key: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// The field.
    pub field: fn(&mut Aero) -> &mut f64,
}

/// Derivatives are refused beyond this size: ten times the largest that any aircraft has.
const LARGEST: f64 = 1_000.0;

macro_rules! derivative {
    ($name:literal, $field:ident, $min:expr) => {
        Derivative {
            name: $name,
            key: stringify!($field),
            min: $min,
            max: LARGEST,
            field: |aero| &mut aero.$field,
        }
    };
}

/// Those of the aircraft without its surfaces. Drag terms must not be negative: they would feed energy to the aircraft.
pub const DERIVATIVES: [Derivative; 19] = [
    derivative!("CL0", c_lift_zero, -LARGEST),
    derivative!("CLa", c_lift_alpha, -LARGEST),
    derivative!("CLq", c_lift_q, -LARGEST),
    derivative!("CD0", c_drag_zero, 0.0),
    derivative!("kCD", c_drag_induced, 0.0),
    derivative!("CDb", c_drag_beta, 0.0),
    derivative!("CDst", c_drag_stall, 0.0),
    derivative!("CYb", c_side_beta, -LARGEST),
    derivative!("CYp", c_side_p, -LARGEST),
    derivative!("CYr", c_side_r, -LARGEST),
    derivative!("Clb", c_roll_beta, -LARGEST),
    derivative!("Clp", c_roll_p, -LARGEST),
    derivative!("Clr", c_roll_r, -LARGEST),
    derivative!("Cm0", c_pitch_zero, -LARGEST),
    derivative!("Cma", c_pitch_alpha, -LARGEST),
    derivative!("Cmq", c_pitch_q, -LARGEST),
    derivative!("Cnb", c_yaw_beta, -LARGEST),
    derivative!("Cnp", c_yaw_p, -LARGEST),
    derivative!("Cnr", c_yaw_r, -LARGEST),
];

/// Letter of a kind of surface in names of derivatives, as the `e` in `Cmde`.
const LETTERS: [(char, EffectorKind); 6] = [
    ('a', EffectorKind::Aileron),
    ('e', EffectorKind::Elevator),
    ('r', EffectorKind::Rudder),
    ('f', EffectorKind::Flap),
    ('s', EffectorKind::Spoiler),
    ('c', EffectorKind::Canard),
];

/// Location of a derivative: one number of the aircraft, or the same one of each surface of a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Place {
    /// Of the aircraft without its surfaces: its index in [`DERIVATIVES`].
    Clean(usize),
    /// Of a kind of surface: its index in [`SurfaceDerivatives::FIELDS`], and that of the kind in [`LETTERS`].
    Surfaces(usize, usize),
}

impl Place {
    /// By the letters (docs/parameter-set.md), as in `Cma` or `Cmde`.
    fn by_name(name: &str) -> Option<Self> {
        if let Some(clean) = DERIVATIVES.iter().position(|d| d.name == name) {
            return Some(Self::Clean(clean));
        }
        let kind = LETTERS.iter().position(|(letter, _)| name.ends_with(*letter))?;
        let letters = &name[..name.len() - 1];
        let field = SurfaceDerivatives::FIELDS.iter().position(|f| f.letters == letters)?;
        Some(Self::Surfaces(field, kind))
    }

    /// By its key: that of the file, followed by the kind for surfaces, as in `c_pitch_elevator`.
    pub(crate) fn by_key(key: &str) -> Option<Self> {
        if let Some(clean) = DERIVATIVES.iter().position(|d| d.key == key) {
            return Some(Self::Clean(clean));
        }
        let (coefficient, kind) = key.rsplit_once('_')?;
        let kind = LETTERS.iter().position(|(_, known)| known.key() == kind)?;
        let field = SurfaceDerivatives::FIELDS.iter().position(|f| f.key == coefficient)?;
        Some(Self::Surfaces(field, kind))
    }

    /// The key.
    pub(crate) fn key(self) -> String {
        match self {
            Self::Clean(clean) => DERIVATIVES[clean].key.to_owned(),
            Self::Surfaces(field, kind) => {
                format!("{}_{}", SurfaceDerivatives::FIELDS[field].key, LETTERS[kind].1.key())
            }
        }
    }

    /// Changes each number at this location; returns how many there were.
    pub(crate) fn change(
        self,
        list: &EffectorList,
        clean: &mut Aero,
        surfaces: &mut PerEffector<SurfaceDerivatives>,
        mut change: impl FnMut(&mut f64),
    ) -> usize {
        match self {
            Self::Clean(place) => {
                change((DERIVATIVES[place].field)(clean));
                1
            }
            Self::Surfaces(field, kind) => {
                let of_kind = list.of_kind(LETTERS[kind].1);
                of_kind
                    .map(|e| change((SurfaceDerivatives::FIELDS[field].field)(&mut surfaces[e])))
                    .count()
            }
        }
    }
}

/// Changes the derivative with these letters, as in `Cma`, for a kind of surface on each of them; false if the
/// aircraft has none, such as one with tables.
pub fn change(airframe: &mut Airframe, name: &str, change: impl FnMut(&mut f64)) -> bool {
    let Airframe { effectors, aero, surface_derivatives, .. } = airframe;
    let Aerodynamics::Derivatives(aero) = aero else { return false };
    let place = Place::by_name(name);
    place.is_some_and(|place| place.change(effectors, aero, surface_derivatives, change) > 0)
}

/// Checks all derivatives: those of an airframe, and those of its surfaces.
pub fn check(aero: &Aero, airframe: &Airframe) -> Result<(), RangeError> {
    let mut aero = aero.clone();
    for d in &DERIVATIVES {
        check_range("aerodynamics", d.key, *(d.field)(&mut aero), d.min, d.max)?;
    }
    for effector in airframe.effectors.all() {
        let mut derivatives = airframe.surface_derivatives[effector];
        for SurfaceField { key, is_drag, field, .. } in &SurfaceDerivatives::FIELDS {
            let min = if *is_drag { 0.0 } else { -LARGEST };
            let section = airframe.section(effector);
            check_range(&section, key, *field(&mut derivatives), min, LARGEST)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The 28 that the robustness claim disperses.
    const DISPERSED: &str = "CLa CLq CLde CD0 kCD CDb CDde CDda CDdr CYb CYr CYdr Clb Clp Clr Clde Clda \
        Cldr Cm0 Cma Cmq Cmde Cnb Cnp Cnr rCnde rCnda Cndr";

    #[test]
    fn every_dispersed_derivative_has_its_own_field() {
        let nominal = Airframe::paper();
        let names: Vec<_> = DISPERSED.split_whitespace().collect();
        assert_eq!(names.len(), 28);
        let mut seen = Vec::new();
        for name in names {
            let mut changed = nominal.clone();
            assert!(change(&mut changed, name, |value| *value += 1.0), "{name}");
            assert!(changed != nominal && !seen.contains(&changed), "{name} shares a field");
            seen.push(changed);
        }
    }

    #[test]
    fn an_unknown_name_finds_nothing() {
        for name in ["Cmx", "Cmd", "", "Cmdf", "Xde"] {
            assert!(!change(&mut Airframe::paper(), name, |value| *value += 1.0), "{name}");
        }
    }
}
