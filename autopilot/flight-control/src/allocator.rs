//! Step two b for any number of effectors: the compensating demand to increments on top of the main command.
//!
//! Not in the paper. Where [`crate::compensator::compensate`] inverts a square g_c, this allocates the same demand,
//! an angular acceleration, to all surfaces and nozzle angles of the design model by [`crate::allocation`]: within
//! what the main command leaves of each travel, roll before pitch before yaw, and no increment where none is needed.
//!
//! The model knows no fault. An effector that does not move is counted on like the others; what it does not give
//! stands in the next estimate, and the demand grows until the others give it.

use arrayvec::ArrayVec;
use icd::{AxisGains, Effector, PerEffector};
use nalgebra::Vector3;

use crate::allocation::{self, ActiveSet, Bound, Column, Settings};
use crate::design_model::{DesignModel, FlightCondition};
use crate::signals::EffectorSet;

/// How much less an effector is used that the main command moves too, in units of its travel. So what is redundant goes
/// first, as in Eq. (25), and an effector that is jammed is not counted on where another one can do it.
const SHARED_WEIGHT: f64 = 10.0;

/// Effectors with their columns, in the same order.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    effectors: ArrayVec<Effector, { Effector::MAX }>,
    columns: ArrayVec<Column, { Effector::MAX }>,
}

/// The allocated compensation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Increments {
    /// What is added to the main command of each effector, rad.
    pub positions: PerEffector<f64>,
    /// Effectors that have no travel left in the direction in which they are needed.
    pub limited: EffectorSet,
}

/// Allocates, and remembers where it was.
#[derive(Debug, Clone, Default)]
pub struct Allocator {
    active: ActiveSet,
}

impl Columns {
    /// All surfaces and nozzle angles of the model at a flight condition, about `origin`, rad: zero is there, the
    /// bounds are what it leaves of the travel. An effector counts by its whole travel, and by whether it is redundant.
    pub fn new(model: &DesignModel, at: &FlightCondition, origin: &PerEffector<f64>) -> Self {
        let gains = &model.aircraft().effectors.gains;
        Self::whole(model, at, |effector, column| {
            let AxisGains { roll, pitch, yaw, .. } = gains[effector];
            if [roll, pitch, yaw].iter().any(|gain| *gain != 0.0) {
                column.weight = SHARED_WEIGHT * 2.0 / (column.max - column.min);
            }
            column.min -= origin[effector];
            column.max -= origin[effector];
        })
    }

    /// The same about zero, without less weight for what the main command moves; `change` has the last word on each.
    pub fn whole(
        model: &DesignModel,
        at: &FlightCondition,
        change: impl Fn(Effector, &mut Column),
    ) -> Self {
        let effectors = &model.aircraft().effectors;
        let mut columns = Self::default();
        for effector in effectors.list.all().filter(|e| effectors.list.is_angle(*e)) {
            let servo = &effectors.servos[effector];
            let mut column = Column {
                effect: model.effect(at, effector),
                min: servo.min,
                max: servo.max,
                preferred: 0.0,
                // Half a travel counts as one, so effectors of different travel share alike.
                weight: 2.0 / (servo.max - servo.min),
            };
            change(effector, &mut column);
            columns.effectors.push(effector);
            columns.columns.push(column);
        }
        columns
    }

    /// The effectors with their columns.
    pub fn iter(&self) -> impl Iterator<Item = (Effector, &Column)> {
        self.effectors.iter().copied().zip(&self.columns)
    }

    /// The columns of the allocation.
    pub fn as_slice(&self) -> &[Column] {
        &self.columns
    }

    /// Values of these effectors, in the order of the columns.
    pub fn pick(&self, values: &PerEffector<f64>) -> ArrayVec<f64, { Effector::MAX }> {
        self.effectors.iter().map(|effector| values[*effector]).collect()
    }
}

impl Allocator {
    /// Forgets the last active set.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Increments on top of `commands`, rad, that cancel the part `fade` of the estimate `z2`, rad/s², as far as the
    /// travel goes. While `fade` is zero they are exactly zero.
    pub fn step(
        &mut self,
        z2: &Vector3<f64>,
        fade: f64,
        model: &DesignModel,
        at: &FlightCondition,
        commands: &PerEffector<f64>,
    ) -> Increments {
        let mut increments = Increments::default();
        if fade == 0.0 {
            // The active set of one fault says nothing about the next.
            self.reset();
            return increments;
        }
        let demand = -fade * z2;
        // The columns are new in each step: what the main command leaves of each travel has changed.
        let Columns { effectors, columns } = Columns::new(model, at, commands);
        let allocated = allocation::allocate(&columns, &demand, &Settings::DEFAULT, &self.active);
        self.active = allocated.active;
        for (index, (effector, column)) in effectors.iter().zip(&columns).enumerate() {
            increments.positions[*effector] = allocated.positions[index];
            // An effector without effect stays wherever it is and gets no increment.
            let is_held =
                allocated.active[index] != Bound::Free && column.effect != Vector3::zeros();
            increments.limited = increments.limited.with(*effector, is_held);
        }
        increments
    }
}

#[cfg(test)]
mod tests;
