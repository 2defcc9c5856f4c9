//! Flags that are raised where other code would return an error: the laws never fail.

use serde::{Deserialize, Serialize};

/// What was not normal in one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Health {
    /// A part of the navigation state is not valid; its last good value was used.
    pub implausible_input: bool,
    /// The main controller asked for something that is not finite; its last finite command was used.
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
    /// The thrust demand is beyond the engine's range.
    pub thrust_saturated: bool,
}
