//! The commands of the flight computer to the effectors.

use serde::{Deserialize, Serialize};

use crate::effector::PerEffector;

/// One command for each effector: rad, and newton for the engine.
///
/// The plant holds the commands for the whole control period.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Actuators {
    /// Commanded deflection, rad; commanded thrust, N.
    pub commands: PerEffector<f64>,
}
