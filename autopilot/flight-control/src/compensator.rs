//! Step two: an estimate of the acceleration that no healthy aircraft would have, and the command of ailerons and
//! nozzle that cancels it.
//!
//! A compensator is an [`Estimator`], one file in the folder of this module with its gains, their rows and its
//! state. What its estimate becomes is the same for all: the command of Eq. (25) here, or increments of any
//! effectors in [`crate::allocator`]. When it acts is the business of [`crate::activation`].

use icd::ControlPeriod;
use nalgebra::Vector3;

use crate::Visitor;
use crate::design_model::{DesignModel, FlightCondition};
use crate::gains::{CompensatorLaw, Gains};
use crate::signals::Compensation;
use incremental::Incremental;
use linear_eso::LinearEso;
use neso::Neso;

pub mod incremental;
pub mod linear_eso;
pub mod neso;

/// What a compensator estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// z: body rates, rad/s.
    pub z: Vector3<f64>,
    /// z2: angular acceleration by faults and disturbances, rad/s².
    pub z2: Vector3<f64>,
}

/// Estimates the angular acceleration that the design model does not explain.
pub trait Estimator {
    /// One control period with measured body rates `y`, rad/s, and modelled acceleration f + U, rad/s².
    ///
    /// The first step only takes the measurement: z = y, z2 = 0.
    fn step(&mut self, y: &Vector3<f64>, modelled_acceleration: &Vector3<f64>) -> Estimate;

    /// Another one has worked so far: goes on where it was.
    fn start_from(&mut self, from: &Handover);

    /// Shows each continuous state to a linearisation, which may change it.
    fn states(&mut self, visit: &mut Visitor<'_>);
}

/// What one estimator leaves to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Handover {
    /// Its last estimate.
    pub estimate: Estimate,
    /// The body rates of its last step, rad/s.
    pub y: Vector3<f64>,
    /// The modelled acceleration of its last step, rad/s².
    pub modelled_acceleration: Vector3<f64>,
}

/// The estimator that works.
#[derive(Debug, Clone)]
enum RunningEstimator {
    Neso(Neso),
    LinearEso(LinearEso),
    Incremental(Incremental),
}

impl RunningEstimator {
    fn new(law: CompensatorLaw, gains: &Gains, period: ControlPeriod) -> Self {
        match law {
            CompensatorLaw::Neso => Self::Neso(Neso::new(&gains.neso, period)),
            CompensatorLaw::LinearEso => Self::LinearEso(LinearEso::new(&gains.linear_eso, period)),
            CompensatorLaw::Incremental => {
                Self::Incremental(Incremental::new(&gains.incremental, period))
            }
        }
    }

    fn set_gains(&mut self, gains: &Gains) {
        match self {
            Self::Neso(law) => law.set_gains(&gains.neso),
            Self::LinearEso(law) => law.set_gains(&gains.linear_eso),
            Self::Incremental(law) => law.set_gains(&gains.incremental),
        }
    }

    fn estimator(&mut self) -> &mut dyn Estimator {
        match self {
            Self::Neso(law) => law,
            Self::LinearEso(law) => law,
            Self::Incremental(law) => law,
        }
    }
}

/// Step two a: steps the chosen estimator, and changes estimators without a jump of the estimate.
#[derive(Debug, Clone)]
pub struct Compensator {
    gains: Gains,
    period: ControlPeriod,
    running: RunningEstimator,
    works: CompensatorLaw,
    last: Option<Handover>,
}

impl Compensator {
    /// Waits for its first measurement.
    pub fn new(gains: &Gains, period: ControlPeriod) -> Self {
        let works = gains.selection.compensator_law;
        let running = RunningEstimator::new(works, gains, period);
        Self { gains: *gains, period, running, works, last: None }
    }

    /// Takes new gains; the estimates stay. Another estimator goes on with them in the next step.
    pub fn set_gains(&mut self, gains: &Gains) {
        self.gains = *gains;
        self.running.set_gains(gains);
    }

    /// Forgets the estimates; the next step starts from its measurement.
    pub fn reset(&mut self) {
        *self = Self::new(&self.gains, self.period);
    }

    /// Shows the continuous states of the estimator.
    pub fn states(&mut self, visit: &mut Visitor<'_>) {
        self.running.estimator().states(visit);
    }

    /// One step with measured body rates `y`, rad/s, and modelled acceleration f + U, rad/s².
    pub fn step(&mut self, y: &Vector3<f64>, modelled_acceleration: &Vector3<f64>) -> Estimate {
        let selected = self.gains.selection.compensator_law;
        if selected != self.works {
            self.running = RunningEstimator::new(selected, &self.gains, self.period);
            self.works = selected;
            if let Some(last) = &self.last {
                // Before its first step nothing is handed over, and the new one starts from its measurement.
                self.running.estimator().start_from(last);
            }
        }
        let estimate = self.running.estimator().step(y, modelled_acceleration);
        let modelled_acceleration = *modelled_acceleration;
        self.last = Some(Handover { estimate, y: *y, modelled_acceleration });
        estimate
    }
}

/// Demand that cancels the estimated fault acceleration, before limits.
///
/// Implements Eq. (25): u_cf = -g_c⁻¹ z2, times `fade`. The inverse is written out: the moment that z2
/// means is taken apart into roll (ailerons), pitch and yaw (nozzle), and the nozzle also takes the yaw
/// of the ailerons. While `fade` is zero the result is exactly zero. An aircraft without nozzle has only its
/// ailerons for it.
pub fn compensate(
    z2: &Vector3<f64>,
    fade: f64,
    model: &DesignModel,
    at: &FlightCondition,
) -> Compensation {
    if fade == 0.0 {
        // Exactly nothing, so a healthy flight has the same bits with the compensator armed and off
        // (docs/decisions/014-activation.md).
        return Compensation::NONE;
    }
    let mass = &model.aircraft().mass;
    let roll = mass.ixx_kg_m2 * z2.x - mass.ixz_kg_m2 * z2.z;
    let pitch = mass.iyy_kg_m2 * z2.y;
    let yaw = -mass.ixz_kg_m2 * z2.x + mass.izz_kg_m2 * z2.z;

    let (c_roll, c_yaw) = model.aileron_pair();
    let aileron_rad = -fade * roll / (at.q_s_b * c_roll);
    let Some(nozzle) = &model.aircraft().nozzle else {
        // Pitch and yaw then have no effector here; the other allocations give them to the surfaces.
        return Compensation { aileron_rad, ..Compensation::NONE };
    };
    // g_c is singular without thrust. Below the floor the nozzle asks for less than it needs, but for something
    // finite.
    let t_x_t = at.t_x_t.max(nozzle.thrust_floor_n * nozzle.arm_m);
    Compensation {
        aileron_rad,
        nozzle_pitch_rad: -fade * pitch / t_x_t,
        nozzle_yaw_rad: -(fade * yaw + at.q_s_b * c_yaw * aileron_rad) / t_x_t,
    }
}

#[cfg(test)]
mod tests;
