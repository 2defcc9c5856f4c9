//! What the aircraft weighs now, and where its centre of gravity is.

use nalgebra::Vector3;

use super::Dynamics;
use crate::damage::PerPart;
use crate::rigid_body::MassProperties;

impl Dynamics {
    /// Present mass and inertia.
    #[inline]
    pub fn mass(&self) -> &MassProperties {
        self.remainder.as_ref().map_or(&self.mass, |remainder| &remainder.mass)
    }

    /// Present centre of gravity from that of the airframe file, m, body axes.
    pub fn shift_m(&self) -> Vector3<f64> {
        self.remainder.as_ref().map_or_else(Vector3::zeros, |remainder| remainder.shift_m)
    }

    /// Takes away parts of the airframe and fuel: the fraction of the span that each part has lost, and what is burnt, kg; of parts
    /// that [`Airframe::parts`](crate::Airframe::parts) lets go.
    pub fn take_away(&mut self, torn_off: &PerPart<f64>, burnt_kg: f64) {
        self.remainder = self.airframe.without(torn_off, burnt_kg).map(Box::new);
    }
}
