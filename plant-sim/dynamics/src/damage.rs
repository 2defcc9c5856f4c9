//! Parts torn off and fuel burnt: what the aircraft has no longer.
//!
//! A part (half a wing, half a tail, the fin) loses its outer end, a fraction λ of its span from the tip. The tables `[damage.…]` of
//! the airframe file give the part as a tapered panel; the lost piece takes with it
//!
//! ```text
//! area, mass   A λ (2 τ + (1 − τ) λ) / (1 + τ)          τ: chord of the tip over that of the root
//! force        lift slope × local angle × local dynamic pressure × area, at the centroid of the piece
//! inertia      of a rod there; the centre of gravity moves by −m r / (m₀ − m)
//! surface      λ / effector_span of the deflection's effect
//! ```
//!
//! The force of the lost piece is subtracted from that of the whole aircraft. Its place and the local flow, with the rates of the
//! aircraft, change lift, drag, damping, stability and the moments of all axes together (B. Etkin, L. Reid, Dynamics of Flight, 3rd
//! edition 1996, chapters 3 and 5: strip theory of the derivatives).

use host_io::problem::Problem;
use icd::fault::AirframePart;
use icd::{Body, Effector, PerEffector};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::faults::Effects;
use crate::range::{check_range, check_vector};
use crate::rigid_body::{MassProperties, Wrench};

/// Local angle beyond which a lost piece would not have had more lift, rad.
const STALL_RAD: f64 = 0.35;
/// Slower than this the flow has no angle, m/s.
const STILL_M_S: f64 = 1.0e-3;

/// One value for each part.
pub type PerPart<T> = [T; AirframePart::ALL.len()];

/// A part of the airframe as a tapered panel; places from the centre of gravity, body axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Aerodynamic centre of its root, m.
    pub root_m: [f64; 3],
    /// Aerodynamic centre of its tip, m.
    pub tip_m: [f64; 3],
    /// Area, m².
    pub area_m2: f64,
    /// Chord of the tip over that of the root.
    pub taper_ratio: f64,
    /// Slope of its lift, of the fin that of its side force, over the local angle, per rad, with its own area.
    pub lift_slope: f64,
    /// Coefficient of its profile drag, with its own area.
    #[serde(default)]
    pub drag: f64,
    /// Its part of the mass of the aircraft, %.
    pub mass_percent: f64,
    /// Name of the surface on it.
    pub effector: Option<icd::effector_list::Name>,
    /// Fraction of the span, from the tip, that the surface covers.
    #[serde(default = "whole")]
    pub effector_span: f64,
}

const fn whole() -> f64 {
    1.0
}

/// The tables `[damage.…]` of an airframe file.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Panels {
    /// Left half of the wing.
    pub left_wing: Option<Panel>,
    /// Right half of the wing.
    pub right_wing: Option<Panel>,
    /// Left half of the horizontal tail.
    pub left_tail: Option<Panel>,
    /// Right half of the horizontal tail.
    pub right_tail: Option<Panel>,
    pub fin: Option<Panel>,
}

/// The table `[fuel]` of an airframe file: fuel in the mass of `[mass]`, which burns in flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fuel {
    /// At the start, kg; a part of the aircraft's mass.
    pub initial_kg: f64,
    /// Centroid of the tanks from the centre of gravity with this fuel, m, body axes.
    #[serde(default)]
    pub at_m: [f64; 3],
    /// Fuel flow over the thrust, kg/(N s).
    #[serde(default = "usual_flow")]
    pub flow_kg_n_s: f64,
}

/// Of a military turbofan without afterburner: 0.7 lb/(lbf h).
const fn usual_flow() -> f64 {
    2.0e-5
}

/// What is gone of a part.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TornPiece {
    part: AirframePart,
    panel: Panel,
    lost: f64,
    area_m2: f64,
    mass_kg: f64,
    centroid_m: Vector3<f64>,
    length_m: f64,
}

/// An aircraft that lacks something.
#[derive(Debug, Clone, PartialEq)]
pub struct Remainder {
    /// Mass, and inertia about the present centre of gravity.
    pub mass: MassProperties,
    /// Present centre of gravity from that of the airframe file, m.
    pub shift_m: Vector3<f64>,
    /// Fraction of the deflection of each effector that still acts.
    pub left: PerEffector<f64>,
    pieces: Vec<TornPiece>,
}

impl Panels {
    /// By the number of the part.
    pub const fn all(&self) -> PerPart<Option<Panel>> {
        [self.left_wing, self.right_wing, self.left_tail, self.right_tail, self.fin]
    }

    pub fn check(&self) -> Result<(), Problem> {
        for (part, panel) in AirframePart::ALL.into_iter().zip(self.all()) {
            let Some(panel) = panel else { continue };
            let section = format!("damage.{}", part.key());
            let check = |key, value, min, max| check_range(&section, key, value, min, max);
            check_vector(&section, "root_m", panel.root_m, 100.0)?;
            check_vector(&section, "tip_m", panel.tip_m, 100.0)?;
            check("area_m2", panel.area_m2, 0.0, 1_000.0)?;
            check("taper_ratio", panel.taper_ratio, 0.0, 1.0)?;
            check("lift_slope", panel.lift_slope, 0.0, 10.0)?;
            check("drag", panel.drag, 0.0, 2.0)?;
            // Five parts of 18 % leave a tenth of the mass.
            check("mass_percent", panel.mass_percent, 0.0, 18.0)?;
            check("effector_span", panel.effector_span, 1.0e-3, 1.0)?;
        }
        Ok(())
    }
}

impl Fuel {
    pub fn check(&self, aircraft_kg: f64) -> Result<(), Problem> {
        check_range("fuel", "initial_kg", self.initial_kg, 0.0, 0.95 * aircraft_kg)?;
        check_vector("fuel", "at_m", self.at_m, 100.0)?;
        check_range("fuel", "flow_kg_n_s", self.flow_kg_n_s, 0.0, 1.0)
    }
}

impl TornPiece {
    /// The outer fraction `lost` of the span of a part of an aircraft with this mass, kg.
    fn of(part: AirframePart, panel: Panel, lost: f64, aircraft_kg: f64) -> Self {
        let [root, tip] = [panel.root_m, panel.tip_m].map(Vector3::from);
        let taper = panel.taper_ratio;
        // Of the chord τ + (1 − τ) s at the distance s from the tip, up to λ.
        let area = lost * (taper + 0.5 * (1.0 - taper) * lost);
        let moment = lost * lost * (0.5 * taper + (1.0 - taper) * lost / 3.0);
        let fraction = 2.0 * area / (1.0 + taper);
        let from_tip = if area > 0.0 { moment / area } else { 0.0 };
        Self {
            part,
            panel,
            lost,
            area_m2: panel.area_m2 * fraction,
            mass_kg: 0.01 * panel.mass_percent * aircraft_kg * fraction,
            centroid_m: tip + (root - tip) * from_tip,
            length_m: lost * (root - tip).norm(),
        }
    }

    /// The force that it would have, N, where the air flows against its place with this velocity (m/s, body axes) and density (kg/m³).
    fn force(&self, flow: &Vector3<f64>, density: f64) -> Vector3<f64> {
        let speed = flow.norm();
        if speed < STILL_M_S {
            return Vector3::zeros();
        }
        let pressure_area = 0.5 * density * speed * speed * self.area_m2;
        let bounded = |angle: f64| angle.clamp(-STALL_RAD, STALL_RAD);
        let drag = flow * (-self.panel.drag * pressure_area / speed);
        let slope = self.panel.lift_slope * pressure_area;
        drag + match self.part {
            AirframePart::Fin => {
                // Along body y, as the side force of the whole aircraft.
                Vector3::new(0.0, -slope * bounded(libm::asin(flow.y / speed)), 0.0)
            }
            _ => {
                // Strip theory: the flow along the span makes no lift.
                let alpha = libm::atan2(flow.z, flow.x);
                let ((sin, cos), lift) = (libm::sincos(alpha), slope * bounded(alpha));
                Vector3::new(lift * sin, 0.0, -lift * cos)
            }
        }
    }

    /// Inertia about the centre of gravity of the airframe file, kg m².
    fn inertia(&self) -> Matrix3<f64> {
        let along = Vector3::from(self.panel.root_m) - Vector3::from(self.panel.tip_m);
        let own = match along.try_normalize(1.0e-9) {
            Some(along) => {
                (Matrix3::identity() - along * along.transpose())
                    * (self.mass_kg * self.length_m * self.length_m / 12.0)
            }
            // Root and tip in one place: only a point mass is left of the rod.
            None => Matrix3::zeros(),
        };
        own + at_distance(self.mass_kg, &self.centroid_m)
    }
}

/// Inertia of a point mass at a place, kg m².
fn at_distance(mass_kg: f64, place: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * place.norm_squared() - place * place.transpose()) * mass_kg
}

impl Remainder {
    /// Of an aircraft whose parts have lost these fractions of their spans, and that has burnt so much fuel (kg) at a place (m).
    ///
    /// `surfaces` has the effector on each part. `None` if nothing is missing, or if nothing would be left.
    pub fn of(
        whole: &MassProperties,
        panels: &Panels,
        surfaces: &PerPart<Option<Effector>>,
        torn_off: &PerPart<f64>,
        (burnt_kg, tanks_m): (f64, &Vector3<f64>),
    ) -> Option<Self> {
        let pieces: Vec<TornPiece> = AirframePart::ALL
            .into_iter()
            .zip(panels.all().into_iter().zip(torn_off))
            .filter_map(|(part, (panel, lost))| {
                panel
                    .filter(|_| *lost > 0.0)
                    .map(|panel| TornPiece::of(part, panel, *lost, whole.mass_kg))
            })
            .collect();
        if pieces.is_empty() && burnt_kg <= 0.0 {
            // An undamaged aircraft then pays one comparison in each evaluation, and keeps its
            // bits.
            return None;
        }
        let gone = || {
            let of_pieces =
                pieces.iter().map(|piece| (piece.mass_kg, piece.centroid_m, piece.inertia()));
            of_pieces.chain([(burnt_kg, *tanks_m, at_distance(burnt_kg, tanks_m))])
        };
        let mass_kg = whole.mass_kg - gone().map(|(mass, ..)| mass).sum::<f64>();
        let moment: Vector3<f64> = gone().map(|(mass, at, _)| at * mass).sum();
        let shift_m = moment * (-1.0 / mass_kg);
        let about_old = whole.inertia - gone().map(|(.., inertia)| inertia).sum::<Matrix3<f64>>();
        // Parallel axes: about the old centre the inertia is larger by that of the rest at the
        // distance of the shift.
        let mass = MassProperties::new(mass_kg, about_old - at_distance(mass_kg, &shift_m))?;
        let mut left = PerEffector::from_fn(|_| 1.0);
        for piece in &pieces {
            if let Some(effector) = surfaces[piece.part as usize] {
                // A product, since two parts may carry the same surface.
                left[effector] *= 1.0 - (piece.lost / piece.panel.effector_span).min(1.0);
            }
        }
        Some(Self { mass, shift_m, left, pieces })
    }

    /// Effective deflections of the first `count` effectors, rad and N, with the effect of the faults.
    #[cold]
    pub fn effective(
        &self,
        count: usize,
        servos: &PerEffector<f64>,
        effects: &Effects,
    ) -> PerEffector<f64> {
        let whole = effects.effective(count, servos);
        PerEffector::first_from_fn(count, |e| self.left[e] * whole[e])
    }

    /// The wrench about the present centre of gravity, from that of the whole aircraft about the one of the airframe file, where the
    /// velocity through the air is `velocity`, m/s, with the rates `rates` against the air, rad/s.
    #[cold]
    pub fn wrench(&self, whole: &Wrench, velocity: &Body, rates: &Body, density: f64) -> Wrench {
        let (mut force, mut moment) = (whole.force.0, whole.moment.0);
        for piece in &self.pieces {
            let at = &piece.centroid_m;
            // With the flow of its own place, so that the loss also takes damping away.
            let lost = piece.force(&(velocity.0 + rates.0.cross(at)), density);
            force -= lost;
            moment -= at.cross(&lost);
        }
        // The sum is about the old centre; from there the shift is the arm of the whole force.
        Wrench { force: Body(force), moment: Body(moment - self.shift_m.cross(&force)) }
    }
}

#[cfg(test)]
mod tests;
