//! The aerodynamic derivatives by name: paper letters, configuration key, allowed range, field.
//!
//! Those of surfaces are named by the kind of surface and mean all surfaces of the kind. The reader of the airframe file, its range
//! check, and the campaigns that disperse derivatives share the lists of [`crate::aerodynamics`].

use host_io::problem::Problem;
use icd::{EffectorKind, EffectorList, PerEffector};

use crate::Airframe;
use crate::aerodynamics::{Aero, Derivative, SurfaceDerivatives};
use crate::range::check_range;

/// Derivatives are refused beyond this size: ten times the largest that any aircraft has.
const LARGEST: f64 = 1_000.0;

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
    /// Of the aircraft without its surfaces: its index in [`Aero::DERIVATIVES`].
    Clean(usize),
    /// Of a kind of surface: its index in [`SurfaceDerivatives::DERIVATIVES`], and that of the kind in [`LETTERS`].
    Surfaces(usize, usize),
}

impl Place {
    /// By the letters (docs/parameter-set.md), as in `Cma` or `Cmde`.
    pub(crate) fn by_name(name: &str) -> Option<Self> {
        if let Some(clean) = Aero::DERIVATIVES.iter().position(|d| d.letters == name) {
            return Some(Self::Clean(clean));
        }
        let kind = LETTERS.iter().position(|(letter, _)| name.ends_with(*letter))?;
        let letters = &name[..name.len() - 1];
        let field = SurfaceDerivatives::DERIVATIVES.iter().position(|f| f.letters == letters)?;
        Some(Self::Surfaces(field, kind))
    }

    /// By its key: that of the file, followed by the kind for surfaces, as in `c_pitch_elevator`.
    pub(crate) fn by_key(key: &str) -> Option<Self> {
        if let Some(clean) = Aero::DERIVATIVES.iter().position(|d| d.key == key) {
            return Some(Self::Clean(clean));
        }
        let (coefficient, kind) = key.rsplit_once('_')?;
        let kind = LETTERS.iter().position(|(_, known)| known.key() == kind)?;
        let field = SurfaceDerivatives::DERIVATIVES.iter().position(|f| f.key == coefficient)?;
        Some(Self::Surfaces(field, kind))
    }

    /// The key.
    pub(crate) fn key(self) -> String {
        match self {
            Self::Clean(clean) => Aero::DERIVATIVES[clean].key.to_owned(),
            Self::Surfaces(field, kind) => {
                format!("{}_{}", SurfaceDerivatives::DERIVATIVES[field].key, LETTERS[kind].1.key())
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
                change((Aero::DERIVATIVES[place].field)(clean));
                1
            }
            Self::Surfaces(field, kind) => {
                let field = SurfaceDerivatives::DERIVATIVES[field].field;
                let of_kind = list.of_kind(LETTERS[kind].1);
                of_kind.map(|e| change(field(&mut surfaces[e]))).count()
            }
        }
    }
}

/// Checks all derivatives: those of an airframe, and those of its surfaces.
pub fn check(aero: &Aero, airframe: &Airframe) -> Result<(), Problem> {
    let mut aero = aero.clone();
    for derivative in &Aero::DERIVATIVES {
        derivative.check("aerodynamics", &mut aero)?;
    }
    for effector in airframe.effectors.all() {
        let mut of_surface = airframe.surface_derivatives[effector];
        for derivative in &SurfaceDerivatives::DERIVATIVES {
            derivative.check(&airframe.section(effector), &mut of_surface)?;
        }
    }
    Ok(())
}

impl<T> Derivative<T> {
    fn check(&self, section: &str, set: &mut T) -> Result<(), Problem> {
        // A negative drag would feed energy to the aircraft.
        let min = if self.key.starts_with("c_drag") { 0.0 } else { -LARGEST };
        check_range(section, self.key, *(self.field)(set), min, LARGEST)
    }
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
            assert!(changed.change_derivative(name, |value| *value += 1.0), "{name}");
            assert!(changed != nominal && !seen.contains(&changed), "{name} shares a field");
            seen.push(changed);
        }
    }

    #[test]
    fn an_unknown_name_finds_nothing() {
        for name in ["Cmx", "Cmd", "", "Cmdf", "Xde"] {
            assert!(!Airframe::paper().change_derivative(name, |value| *value += 1.0), "{name}");
        }
    }
}
