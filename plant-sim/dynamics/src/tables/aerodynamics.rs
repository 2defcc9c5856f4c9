//! Aerodynamics as sums of terms over tables: an airframe file can have them instead of derivatives.

use host_io::problem::{Problem, problem};
use icd::Body;
use serde::{Deserialize, Serialize};

use super::lookup::{SumText, Sums};
use super::{TableText, read_all};
use crate::aerodynamics::{AirState, Coefficients, Geometry, SLOWEST_M_S};
use crate::range::check_vector;
use crate::rigid_body::Wrench;

/// Inputs of a term besides the deflections, in SI units.
///
/// `p_span_2v` is the roll rate times span over 2V, `q_chord_2v` the pitch rate times chord over 2V, `r_span_2v` like the
/// first, with the yaw rate.
pub const AIR_INPUTS: [&str; 6] =
    ["alpha_rad", "beta_rad", "mach", "p_span_2v", "q_chord_2v", "r_span_2v"];

/// Most inputs: those of the air and 16 effectors.
const INPUTS_MAX: usize = AIR_INPUTS.len() + 16;

/// The table `[aerodynamics]` of an airframe file that lists tables.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableAero {
    /// Reference area S, m².
    pub area_m2: f64,
    /// Span b, m.
    pub span_m: f64,
    /// Mean chord c, m.
    pub chord_m: f64,
    /// The point about which the moments of the coefficients are taken: from the centre of gravity, body axes, m.
    #[serde(default)]
    pub moment_reference_m: [f64; 3],
    pub sum: CoefficientSums,
    #[serde(default)]
    pub table: Vec<TableText>,
}

/// Each coefficient as a sum of terms; one without a sum is zero.
///
/// Forces in body axes (x forward, y right, z down) or along the airflow, as in the source: both are added.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CoefficientSums {
    pub c_x: Vec<String>,
    /// Force to the right.
    pub c_y: Vec<String>,
    pub c_z: Vec<String>,
    /// Lift, normal to the airflow in the plane of symmetry.
    pub c_lift: Vec<String>,
    /// Drag, along the airflow in the plane of symmetry.
    pub c_drag: Vec<String>,
    /// Drag along the airflow, sideslip included (wind axes): that of a body without a plane of symmetry.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub c_drag_wind: Vec<String>,
    /// Roll moment, reference length span.
    pub c_roll: Vec<String>,
    /// Pitch moment, reference length chord.
    pub c_pitch: Vec<String>,
    /// Yaw moment, reference length span.
    pub c_yaw: Vec<String>,
}

const COEFFICIENTS: usize = 9;

/// Coefficients in the order of [`CoefficientSums`], but for the drag in wind axes, which is the last one.
pub type TableCoefficients = [f64; COEFFICIENTS];

/// The same, prepared for the equations of motion.
#[derive(Debug, Clone)]
pub struct AeroTables {
    sums: Sums,
    geometry: Geometry,
    moment_reference: Body,
    /// Whether there is a drag in wind axes: aircraft have theirs in other axes.
    has_drag_wind: bool,
}

impl TableAero {
    /// Checks the numbers, reads the tables and resolves every name. `effectors` are the inputs after [`AIR_INPUTS`], by
    /// their names in SI units, as in `left_elevator_rad`.
    pub fn build(&self, effectors: &[String]) -> Result<AeroTables, Problem> {
        let Self { area_m2, span_m, chord_m, .. } = *self;
        let geometry = Geometry { area_m2, span_m, chord_m };
        geometry.check()?;
        check_vector("aerodynamics", "moment_reference_m", self.moment_reference_m, 100.0)?;
        let tables = read_all("aerodynamics", &self.table)?;
        let inputs: Vec<String> = AIR_INPUTS
            .iter()
            .map(|name| (*name).to_owned())
            .chain(effectors.iter().take(16).cloned())
            .collect();
        let sums = Sums::new(&tables, &self.sum.texts(), &inputs)
            .map_err(|problem| problem!("[aerodynamics.sum] {problem}"))?;
        let [x, y, z] = self.moment_reference_m;
        Ok(AeroTables {
            sums,
            geometry,
            moment_reference: Body::new(x, y, z),
            has_drag_wind: !self.sum.c_drag_wind.is_empty(),
        })
    }
}

impl CoefficientSums {
    fn texts(&self) -> [SumText<'_>; COEFFICIENTS] {
        [
            ("c_x", &self.c_x),
            ("c_y", &self.c_y),
            ("c_z", &self.c_z),
            ("c_lift", &self.c_lift),
            ("c_drag", &self.c_drag),
            ("c_roll", &self.c_roll),
            ("c_pitch", &self.c_pitch),
            ("c_yaw", &self.c_yaw),
            ("c_drag_wind", &self.c_drag_wind),
        ]
        .map(|(key, terms)| SumText { key, terms })
    }
}

impl AeroTables {
    /// Coefficients at `air`, with `deflections` (rad) in the order of the effectors given to [`TableAero::build`].
    #[inline]
    pub fn coefficients(
        &self,
        air: &AirState,
        mach: f64,
        deflections: &[f64],
    ) -> TableCoefficients {
        let per_two_v = 0.5 / air.airspeed_m_s.max(SLOWEST_M_S);
        let mut inputs = [0.0; INPUTS_MAX];
        inputs[..AIR_INPUTS.len()].copy_from_slice(&[
            air.alpha_rad,
            air.beta_rad,
            mach,
            air.rates.0.x * self.geometry.span_m * per_two_v,
            air.rates.0.y * self.geometry.chord_m * per_two_v,
            air.rates.0.z * self.geometry.span_m * per_two_v,
        ]);
        for (input, deflection) in inputs[AIR_INPUTS.len()..].iter_mut().zip(deflections) {
            *input = *deflection;
        }
        let mut coefficients = [0.0; COEFFICIENTS];
        self.sums.add_to(&mut coefficients, &inputs);
        coefficients
    }

    /// Force and moment about the centre of gravity. `velocity` is that relative to the air (m/s, body axes) and
    /// belongs to `air`; `density` in kg/m³.
    #[inline]
    pub fn wrench(
        &self,
        air: &AirState,
        velocity: &Body,
        density: f64,
        coefficients: &TableCoefficients,
    ) -> Wrench {
        let (u, v, w) = (velocity.0.x, velocity.0.y, velocity.0.z);
        let in_plane = (u * u + w * w).sqrt();
        let direction = if in_plane > 0.0 { [w / in_plane, u / in_plane] } else { [0.0, 1.0] };
        let pressure_area =
            0.5 * density * air.airspeed_m_s * air.airspeed_m_s * self.geometry.area_m2;
        let side = if self.has_drag_wind { v / air.airspeed_m_s.max(SLOWEST_M_S) } else { 0.0 };
        let Wrench { force, moment } = self.per_pressure_area(direction, side, coefficients);
        Wrench { force: Body(force.0 * pressure_area), moment: Body(moment.0 * pressure_area) }
    }

    /// Force and moment about the centre of gravity over dynamic pressure and area: dimensionless, and m. `direction` is sine
    /// and cosine of the angle of attack, `sin_beta` the sine of the sideslip.
    #[inline]
    fn per_pressure_area(
        &self,
        direction: [f64; 2],
        sin_beta: f64,
        coefficients: &TableCoefficients,
    ) -> Wrench {
        let [c_x, c_y, c_z, c_lift, c_drag, c_roll, c_pitch, c_yaw, c_drag_wind] = *coefficients;
        let [sin_alpha, cos_alpha] = direction;
        let mut force = Body::new(
            c_x + c_lift * sin_alpha - c_drag * cos_alpha,
            c_y,
            c_z - c_drag * sin_alpha - c_lift * cos_alpha,
        );
        if self.has_drag_wind {
            // Rounding may put the sine above one.
            let cos_beta = (1.0 - sin_beta * sin_beta).max(0.0).sqrt();
            force.0.x -= c_drag_wind * cos_alpha * cos_beta;
            force.0.y -= c_drag_wind * sin_beta;
            force.0.z -= c_drag_wind * sin_alpha * cos_beta;
        }
        let Geometry { span_m, chord_m, .. } = self.geometry;
        let about_reference = Body::new(span_m * c_roll, chord_m * c_pitch, span_m * c_yaw);
        let moment = Body(about_reference.0 + self.moment_reference.0.cross(&force.0));
        Wrench { force, moment }
    }

    /// The coefficients as those of derivatives: lift and drag, and moments about the centre of gravity.
    pub fn about_centre_of_gravity(
        &self,
        [alpha_rad, beta_rad]: [f64; 2],
        coefficients: &TableCoefficients,
    ) -> Coefficients {
        let (sin, cos) = libm::sincos(alpha_rad);
        let sin_beta = libm::sin(beta_rad);
        let Wrench { force, moment } = self.per_pressure_area([sin, cos], sin_beta, coefficients);
        let (x, z) = (force.0.x, force.0.z);
        Coefficients {
            lift: x * sin - z * cos,
            drag: -x * cos - z * sin,
            side: force.0.y,
            roll: moment.0.x / self.geometry.span_m,
            pitch: moment.0.y / self.geometry.chord_m,
            yaw: moment.0.z / self.geometry.span_m,
        }
    }
}

#[cfg(test)]
mod tests;
