//! The two forms of aerodynamics in an airframe file, and each of them prepared for flight.

use host_io::problem::Problem;
use icd::{Body, PerEffector};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Aero, AirState, Coefficients, Surfaces, coefficients, wrench};
use crate::airframe::Airframe;
use crate::derivatives::MachTable;
use crate::range::check_range;
use crate::rigid_body::Wrench;
use crate::tables::aerodynamics::{AeroTables, TableAero};
use crate::tables::stored;

/// Aerodynamics as in an airframe file.
#[derive(Debug, Clone, PartialEq)]
pub enum Aerodynamics {
    /// Derivatives, with those of each surface at its effector.
    Derivatives(Aero),
    /// Sums of terms over tables.
    Tables(TableAero),
}

/// Reference lengths of the coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    /// Reference area S, m².
    pub area_m2: f64,
    /// Span b, m.
    pub span_m: f64,
    /// Mean chord c, m.
    pub chord_m: f64,
}

impl Geometry {
    pub(crate) fn check(&self) -> Result<(), Problem> {
        check_range("aerodynamics", "area_m2", self.area_m2, 0.01, 10_000.0)?;
        check_range("aerodynamics", "span_m", self.span_m, 0.1, 200.0)?;
        check_range("aerodynamics", "chord_m", self.chord_m, 0.01, 100.0)
    }
}

impl Aerodynamics {
    pub fn geometry(&self) -> Geometry {
        let (area_m2, span_m, chord_m) = match self {
            Self::Derivatives(aero) => (aero.area_m2, aero.span_m, aero.chord_m),
            Self::Tables(tables) => (tables.area_m2, tables.span_m, tables.chord_m),
        };
        Geometry { area_m2, span_m, chord_m }
    }

    /// The derivatives; `None` for tables.
    pub fn derivatives(&self) -> Option<&Aero> {
        match self {
            Self::Derivatives(aero) => Some(aero),
            Self::Tables(_) => None,
        }
    }
}

/// [`Aerodynamics`] in text files: a table with the keys of one of the forms.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Aerodynamics", untagged)]
enum Readable {
    Derivatives(Aero),
    Tables(TableAero),
}

/// [`Aerodynamics`] in binary files, which have no keys.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Aerodynamics")]
enum Binary {
    Derivatives(Aero),
    Tables(#[serde(with = "stored")] TableAero),
}

impl Serialize for Aerodynamics {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            Readable::serialize(self, serializer)
        } else {
            Binary::serialize(self, serializer)
        }
    }
}

impl<'de> Deserialize<'de> for Aerodynamics {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            Readable::deserialize(deserializer)
        } else {
            Binary::deserialize(deserializer)
        }
    }
}

/// The aerodynamic forces of an aircraft, prepared for the equations of motion.
#[derive(Debug, Clone)]
pub struct AirForces {
    geometry: Geometry,
    effectors: usize,
    form: Form,
}

#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "there is one for an aircraft")]
enum Form {
    Derivatives { aero: Aero, surfaces: Surfaces },
    AtMach(Box<MachTable>),
    Tables(AeroTables),
}

impl AirForces {
    pub fn new(airframe: &Airframe) -> Result<Self, Problem> {
        let list = &airframe.effectors;
        let surfaces = &airframe.surface_derivatives;
        let form = match (&airframe.aero, &airframe.mach) {
            (Aerodynamics::Tables(tables), _) => {
                // Names for the terms, as `left_elevator_rad`.
                let inputs = list.all().map(|e| format!("{}_{}", list.key(e), list.unit(e)));
                Form::Tables(tables.build(&inputs.collect::<Vec<_>>())?)
            }
            (Aerodynamics::Derivatives(aero), Some(mach)) => {
                Form::AtMach(Box::new(mach.table(list, aero, surfaces)))
            }
            (Aerodynamics::Derivatives(aero), None) => {
                let surfaces = Surfaces::new(list, surfaces);
                Form::Derivatives { aero: aero.clone(), surfaces }
            }
        };
        Ok(Self { geometry: airframe.aero.geometry(), effectors: list.len(), form })
    }

    /// Whether the Mach number matters.
    pub fn needs_mach(&self) -> bool {
        !matches!(self.form, Form::Derivatives { .. })
    }

    /// Force and moment about the centre of gravity, body axes. `velocity` is that relative to the air (m/s) and belongs to
    /// `air`; `density` in kg/m³; `effective` deflections in rad. `mach` is read only where [`AirForces::needs_mach`].
    #[inline]
    pub fn wrench(
        &self,
        air: &AirState,
        velocity: &Body,
        density: f64,
        mach: f64,
        effective: &PerEffector<f64>,
    ) -> Wrench {
        if let Form::Tables(tables) = &self.form {
            let c = tables.coefficients(air, mach, effective.first(self.effectors));
            return tables.wrench(air, velocity, density, &c);
        }
        let c = self.coefficients(air, mach, effective);
        wrench(&self.geometry, air, velocity, density, &c)
    }

    /// Coefficients about the centre of gravity at `air`; for tables for linearisation, not for the equations of motion.
    #[inline]
    pub fn coefficients(
        &self,
        air: &AirState,
        mach: f64,
        effective: &PerEffector<f64>,
    ) -> Coefficients {
        match &self.form {
            Form::Derivatives { aero, surfaces } => coefficients(aero, surfaces, air, effective),
            Form::AtMach(table) => table.coefficients(air, mach, effective),
            Form::Tables(tables) => {
                let c = tables.coefficients(air, mach, effective.first(self.effectors));
                tables.about_centre_of_gravity([air.alpha_rad, air.beta_rad], &c)
            }
        }
    }
}
