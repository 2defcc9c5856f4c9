//! The aerodynamic derivatives by name: paper letters, configuration key, allowed range, field.
//!
//! Those of surfaces are named by the kind of surface and mean all surfaces of the kind. The reader of the airframe file, its range
//! check, and the campaigns that disperse derivatives share the lists of [`crate::aerodynamics`].
//!
//! An airframe file may let derivatives change with the Mach number.
//! By Prandtl and Glauert the pressures on a thin section grow with 1/√(1 − M²). A wing of finite span follows this
//! in part, a moment whose arm moves follows it more than in full, and a surface behind a shock loses effect. Each
//! named derivative therefore has its own factor:
//!
//! ```text
//! c(M) = c · (1 + k · (G(M)/G(M₀) − 1)),   G(M) = 1/√(1 − min(M, 0.95)²)
//! ```
//!
//! At the design Mach number M₀ every derivative has the value of its table, so the trim there is that of the
//! airframe without Mach effects. Transonic flow is not modelled: above 0.95 the factors stay constant.

use std::collections::BTreeMap;

use host_io::problem::{Problem, problem};
use icd::{EffectorKind, EffectorList, PerEffector};
use serde::{Deserialize, Serialize};

use crate::Airframe;
use crate::aerodynamics::{
    Aero, AirState, Coefficients, Derivative, SurfaceDerivatives, Surfaces, coefficients,
};
use crate::range::check_range;

/// Derivatives are refused beyond this size: ten times the largest that any aircraft has.
const LARGEST: f64 = 1_000.0;

/// Letter of a kind of surface in names of derivatives, as the `e` in `Cmde`.
const LETTERS: [(char, EffectorKind); 8] = [
    ('a', EffectorKind::Aileron),
    ('e', EffectorKind::Elevator),
    ('r', EffectorKind::Rudder),
    ('f', EffectorKind::Flap),
    ('s', EffectorKind::Spoiler),
    ('c', EffectorKind::Canard),
    ('v', EffectorKind::Elevon),
    ('t', EffectorKind::Ruddervator),
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
    /// By the letters (docs/paper.md), as in `Cma` or `Cmde`.
    pub(crate) fn by_name(name: &str) -> Option<Self> {
        // The whole aircraft first: `Cma` ends in the letter of the aileron.
        if let Some(clean) = Aero::DERIVATIVES.iter().position(|d| d.letters == name) {
            return Some(Self::Clean(clean));
        }
        let kind = LETTERS.iter().position(|(letter, _)| name.ends_with(*letter))?;
        let letters = &name[..name.len() - 1];
        let field = SurfaceDerivatives::DERIVATIVES.iter().position(|f| f.letters == letters)?;
        Some(Self::Surfaces(field, kind))
    }

    /// By its key: that of the file, followed by the kind for surfaces, as in `c_pitch_elevator`.
    fn by_key(key: &str) -> Option<Self> {
        if let Some(clean) = Aero::DERIVATIVES.iter().position(|d| d.key == key) {
            return Some(Self::Clean(clean));
        }
        let (coefficient, kind) = key.rsplit_once('_')?;
        let kind = LETTERS.iter().position(|(_, known)| known.key() == kind)?;
        let field = SurfaceDerivatives::DERIVATIVES.iter().position(|f| f.key == coefficient)?;
        Some(Self::Surfaces(field, kind))
    }

    /// The key.
    fn key(self) -> String {
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
    // The lists give mutable access only; on a copy it serves a check too.
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
        // A negative drag would feed energy to the aircraft. A polar with linear terms ends at zero.
        let is_drag = self.key.starts_with("c_drag") && !Aero::LINEAR_DRAG.contains(&self.key);
        let min = if is_drag { 0.0 } else { -LARGEST };
        check_range(section, self.key, *(self.field)(set), min, LARGEST)
    }
}

/// Prandtl and Glauert's rule has no meaning near one, where it grows without bound.
const MACH_MAX: f64 = 0.95;

/// Largest size of a factor.
const FACTOR_MAX: f64 = 3.0;

/// The table `[mach]` of an airframe file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachEffects {
    /// M₀, where the derivatives are those of `[aerodynamics]`.
    pub design_mach: f64,
    /// k of each derivative that changes, by its key in `[aerodynamics]`.
    pub growth: BTreeMap<DerivativeKey, f64>,
}

/// A derivative, in a file by its key in the table `[aerodynamics]`, or for surfaces by the key and their kind, as in
/// `c_pitch_elevator`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct DerivativeKey(Place);

impl TryFrom<String> for DerivativeKey {
    type Error = Problem;

    fn try_from(key: String) -> Result<Self, Problem> {
        Place::by_key(&key).map(Self).ok_or_else(|| problem!("no derivative is called {key}"))
    }
}

impl From<DerivativeKey> for String {
    fn from(key: DerivativeKey) -> Self {
        key.0.key()
    }
}

/// The table, prepared for evaluation.
#[derive(Debug, Clone)]
pub(crate) struct MachTable {
    list: EffectorList,
    aero: Aero,
    surfaces: PerEffector<SurfaceDerivatives>,
    per_design: f64,
    growth: Vec<(Place, f64)>,
}

impl MachEffects {
    pub fn check(&self) -> Result<(), Problem> {
        check_range("mach", "design_mach", self.design_mach, 0.0, MACH_MAX)?;
        for (key, factor) in &self.growth {
            check_range("mach.growth", &key.0.key(), *factor, -FACTOR_MAX, FACTOR_MAX)?;
        }
        Ok(())
    }

    /// For the equations of motion.
    pub(crate) fn table(
        &self,
        list: &EffectorList,
        aero: &Aero,
        surfaces: &PerEffector<SurfaceDerivatives>,
    ) -> MachTable {
        let growth = self.growth.iter().map(|(key, k)| (key.0, *k)).collect();
        let per_design = 1.0 / compression(self.design_mach);
        MachTable { list: *list, aero: aero.clone(), surfaces: *surfaces, per_design, growth }
    }
}

impl MachTable {
    /// The derivatives at a Mach number.
    fn at(&self, mach: f64) -> (Aero, PerEffector<SurfaceDerivatives>) {
        let growth = compression(mach) * self.per_design - 1.0;
        // From the numbers of the file each time, or the factors would pile up.
        let (mut aero, mut surfaces) = (self.aero.clone(), self.surfaces);
        for (place, k) in &self.growth {
            let factor = 1.0 + k * growth;
            place.change(&self.list, &mut aero, &mut surfaces, |value| *value *= factor);
        }
        (aero, surfaces)
    }

    /// Coefficients at a Mach number.
    pub(crate) fn coefficients(
        &self,
        air: &AirState,
        mach: f64,
        deflections: &PerEffector<f64>,
    ) -> Coefficients {
        let (aero, surfaces) = self.at(mach);
        coefficients(&aero, &Surfaces::new(&self.list, &surfaces), air, deflections)
    }
}

/// G(M) of Prandtl and Glauert.
fn compression(mach: f64) -> f64 {
    let mach = mach.min(MACH_MAX);
    1.0 / (1.0 - mach * mach).sqrt()
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
    fn a_polar_with_linear_terms_is_the_published_one_and_never_pushes() {
        let text = |terms: &str| {
            let kept = |line: &&str| {
                !line.starts_with("c_drag_zero") && !line.starts_with("c_drag_induced")
            };
            let lines: Vec<&str> = aircraft::AEROSONDE_AIRFRAME.lines().filter(kept).collect();
            let text = lines.join("\n").replace("c_drag_beta", &format!("{terms}\nc_drag_beta"));
            Airframe::from_toml("polar.toml", &text)
        };
        let polar = text(
            "c_drag_zero = 0.03\nc_drag_alpha = 0.3\nc_drag_lift = -0.02\nc_drag_induced = 0.05",
        )
        .unwrap();
        let aero = polar.aero.derivatives().unwrap();
        let air = AirState {
            airspeed_m_s: 25.0,
            alpha_rad: 0.1,
            beta_rad: 0.0,
            rates: icd::Body::zero(),
        };
        let surfaces = Surfaces::new(&polar.effectors, &polar.surface_derivatives);
        let c = coefficients(aero, &surfaces, &air, &PerEffector::default());
        let expected = 0.03 + 0.3 * 0.1 - 0.02 * c.lift + 0.05 * c.lift * c.lift;
        assert!((c.drag - expected).abs() < 1.0e-15, "{} {expected}", c.drag);
        // A line over the angle of attack alone crosses zero at -0.1 rad.
        let line = text("c_drag_zero = 0.03\nc_drag_alpha = 0.3\nc_drag_induced = 0.0").unwrap();
        let aero = line.aero.derivatives().unwrap();
        for (alpha_rad, drag) in [(0.1, 0.06), (-0.05, 0.015), (-0.1, 0.0), (-0.3, 0.0)] {
            assert!((aero.polar(alpha_rad, 0.0) - drag).abs() < 1.0e-15, "{alpha_rad} rad");
        }
    }

    #[test]
    fn an_unknown_name_finds_nothing() {
        for name in ["Cmx", "Cmd", "", "Cmdf", "Xde"] {
            assert!(!Airframe::paper().change_derivative(name, |value| *value += 1.0), "{name}");
        }
    }
}

#[cfg(test)]
mod mach_tests {
    use super::*;
    use crate::Airframe;
    use crate::atmosphere::Atmosphere;
    use aircraft::{DEFAULT_AIRFRAME, MACH_AIRFRAME};
    use icd::tvc_jet;

    fn table_of(airframe: &Airframe) -> MachTable {
        let aero = airframe.aero.derivatives().unwrap();
        let mach = airframe.mach.as_ref().unwrap();
        mach.table(&airframe.effectors, aero, &airframe.surface_derivatives)
    }

    fn variant() -> Airframe {
        Airframe::from_toml("tvc_jet_mach.toml", MACH_AIRFRAME).unwrap()
    }

    fn refusal(from: &str, to: &str) -> String {
        assert!(MACH_AIRFRAME.contains(from), "the file has no {from}");
        let text = MACH_AIRFRAME.replacen(from, to, 1);
        Airframe::from_toml("jet.toml", &text).unwrap_err().to_string()
    }

    #[test]
    fn the_variant_is_the_jet_with_a_table_more() {
        let data = |text: &str| -> Vec<String> {
            let lines = text.lines().map(|line| line.split('#').next().unwrap_or("").trim());
            lines.filter(|line| !line.is_empty()).map(str::to_owned).collect()
        };
        let (jet, variant) = (data(DEFAULT_AIRFRAME), data(MACH_AIRFRAME));
        let table = variant.iter().position(|line| line == "[mach]").unwrap();
        assert_eq!(jet, variant[..table], "copy tvc_jet.toml into tvc_jet_mach.toml");
    }

    #[test]
    fn at_the_design_point_of_the_jet_every_derivative_is_that_of_the_jet() {
        let airframe = variant();
        let table = table_of(&airframe);
        let (mut at, mut surfaces) = table.at(264.0 / Atmosphere::STANDARD.speed_of_sound(5_000.0));
        let mut jet = Airframe::paper().aero.derivatives().unwrap().clone();
        for d in &Aero::DERIVATIVES {
            let (ours, theirs) = (*(d.field)(&mut at), *(d.field)(&mut jet));
            // The design Mach number stands in the file with ten digits.
            assert!((ours - theirs).abs() <= 1e-8 * theirs.abs(), "{}: {ours} {theirs}", d.key);
        }
        let mut jet = Airframe::paper().surface_derivatives;
        for effector in tvc_jet::ALL {
            for field in &SurfaceDerivatives::DERIVATIVES {
                let ours = *(field.field)(&mut surfaces[effector]);
                let theirs = *(field.field)(&mut jet[effector]);
                assert!((ours - theirs).abs() <= 1e-8 * theirs.abs(), "{}", field.key);
            }
        }
    }

    #[test]
    fn a_derivative_grows_by_its_part_of_prandtl_and_glauerts_factor() {
        let mut airframe = variant();
        let mach = airframe.mach.as_mut().unwrap();
        mach.design_mach = 0.6;
        let key = |key: &str| DerivativeKey::try_from(key.to_owned()).unwrap();
        mach.growth = [(key("c_lift_alpha"), 0.5), (key("c_roll_aileron"), -1.0)].into();
        let table = table_of(&airframe);
        let aero = airframe.aero.derivatives().unwrap();
        let roll =
            |surfaces: &PerEffector<SurfaceDerivatives>| surfaces[tvc_jet::LEFT_AILERON].c_roll;
        // 1/sqrt(1 - 0.36) = 1.25 and 1/sqrt(1 - 0.64) = 1.6667: larger by a third.
        let (faster, surfaces) = table.at(0.8);
        assert!((faster.c_lift_alpha / aero.c_lift_alpha - 7.0 / 6.0).abs() < 1e-12);
        assert!((roll(&surfaces) / roll(&airframe.surface_derivatives) - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(faster.c_yaw_beta, aero.c_yaw_beta, "what is not named does not change");
        let (beyond, at_end) = (table.at(3.0), table.at(MACH_MAX));
        assert_eq!(beyond, at_end, "beyond the range it stays");
    }

    #[test]
    fn the_quick_speed_of_sound_is_that_of_the_atmosphere() {
        for altitude_m in [-6_000.0, 0.0, 5_000.0, 11_000.0, 15_000.0, 25_000.0, f64::NAN] {
            let (quick, full) = (
                Atmosphere::STANDARD.speed_of_sound(altitude_m),
                Atmosphere::STANDARD.air(altitude_m).speed_of_sound,
            );
            assert_eq!(quick.to_bits(), full.to_bits(), "at {altitude_m} m");
        }
    }

    #[test]
    fn a_growth_of_an_unknown_derivative_is_refused_with_its_name() {
        let message = refusal("c_lift_alpha = 0.3", "c_lift_alfa = 0.3");
        assert!(message.contains("jet.toml") && message.contains("c_lift_alfa"), "{message}");
    }

    #[test]
    fn numbers_outside_their_range_are_refused_with_key_and_range() {
        assert_eq!(
            refusal("c_lift_alpha = 0.3", "c_lift_alpha = 30"),
            "jet.toml: [mach.growth] c_lift_alpha = 30 is outside -3 to 3"
        );
        let message = refusal("design_mach = 0.8", "design_mach = 1.8");
        assert!(message.contains("[mach] design_mach = 1.8"), "{message}");
    }
}
