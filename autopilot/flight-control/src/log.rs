//! Every named signal of one step, by value: what recorders, telemetry and judges may read.

use icd::{Actuators, PerEffector};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::altitude_limit::AltitudeLimit;
use crate::authority::Authority;
use crate::isolation::IsolationLog;
use crate::navigation::NavigationState;
use crate::relief::{CompensationHealth, ReliefLog};
use crate::signals::{Compensation, EffectorSet, MainCommand};

/// The signals of one control step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepLog {
    /// The navigation state that the laws used.
    pub state: NavigationState,
    /// Altitude reference after its slew limit, m.
    pub altitude_reference_m: f64,
    /// Roll reference after its lag, rad.
    pub roll_reference_rad: f64,
    /// Airspeed reference, m/s.
    pub airspeed_reference_m_s: f64,
    /// z: estimated body rates, rad/s.
    pub z: Vector3<f64>,
    /// z2: estimated fault acceleration of roll, pitch and yaw, rad/s².
    pub z2: Vector3<f64>,
    /// |z2| of roll, pitch and yaw in units of their activation levels.
    pub levels: Vector3<f64>,
    /// Largest |z2| in units of its activation level.
    pub level: f64,
    /// The detector reports a fault, also where the compensator is off.
    pub compensator_active: bool,
    /// How much of the compensation is let through, 0 to 1.
    pub fade: f64,
    /// Step one's command, before limits.
    pub main: MainCommand,
    /// Step two's demand, before limits.
    pub compensation: Compensation,
    /// The applied part of it, after limits.
    pub applied_compensation: Compensation,
    /// The same by effectors: what of each command is compensation, rad.
    pub increments: PerEffector<f64>,
    /// Angular acceleration that the increments give by the design model, rad/s²; with all of the demand met it is
    /// minus z2.
    pub attained: Vector3<f64>,
    /// Command to each effector, rad; engine N.
    pub commands: PerEffector<f64>,
    /// Wheel brakes, 0 to 1.
    pub brakes: f64,
    /// Effectors whose command was beyond their travel.
    pub limited: EffectorSet,
    /// Where the model of the healthy actuators has each effector at this tick, rad; engine N (measured).
    pub modelled: PerEffector<f64>,
    /// What the compensator has left on each axis.
    pub authority: Authority,
    /// Why the altitude is not held, when it is not and something is at its limit.
    pub altitude_limit: Option<AltitudeLimit>,
    /// f + g u + g_T u_T: angular acceleration that the design model expects, rad/s².
    pub modelled_acceleration: Vector3<f64>,
    /// What the law beyond the paper reports; all zero where another allocation is chosen.
    pub relief: ReliefLog,
    /// Which effector it is.
    pub isolation: IsolationLog,
    /// Flags.
    pub health: Health,
}

impl StepLog {
    /// The commands, as the plant gets them.
    pub const fn actuators(&self) -> Actuators {
        Actuators { commands: self.commands, brakes: self.brakes }
    }
}

/// What was not normal in one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Health {
    /// A part of the navigation state is not valid; its last good value was used.
    pub implausible_input: bool,
    /// A command of the main controller was not finite; its last finite command was used.
    pub implausible_command: bool,
    /// The total aileron demand is beyond the travel.
    pub aileron_saturated: bool,
    /// The elevator demand is beyond the travel.
    pub elevator_saturated: bool,
    /// The rudder demand is beyond the travel.
    pub rudder_saturated: bool,
    /// The nozzle pitch demand is beyond the travel.
    pub nozzle_pitch_saturated: bool,
    /// The nozzle yaw demand is beyond the travel.
    pub nozzle_yaw_saturated: bool,
    /// The thrust demand is beyond the engine's range, or below the thrust floor.
    pub thrust_saturated: bool,
    /// What the allocation beyond the paper reports of itself.
    pub compensation: CompensationHealth,
}
