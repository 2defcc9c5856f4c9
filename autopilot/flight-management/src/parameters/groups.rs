//! The parameters by group. Defaults are in [`super::Parameters::default`], ranges in the
//! table.

use crate::vehicle::LinkLossAction;
use serde::{Deserialize, Serialize};

/// Reaction to the silence of ground stations, and its delay.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LinkParameters {
    /// Reaction when the controlling ground station falls silent.
    pub loss_action: LinkLossAction,
    /// Delay of the reaction, wall time, s.
    pub loss_s: f64,
    /// Silence of an offboard stream after which Offboard ends, wall time, s.
    pub offboard_loss_s: f64,
    /// Silence of a pilot's sticks after which Altitude ends, wall time, s.
    pub sticks_loss_s: f64,
    /// The mode after the loss of the sticks.
    pub sticks_loss_action: SticksLossAction,
    /// MAVLink system id of the vehicle, 1 to 250; the value at the start of the program counts.
    pub system_id: u8,
}

/// Reaction of the aircraft when a pilot's sticks fall silent, with PX4's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SticksLossAction {
    /// Circles at its position.
    Hold,
    Return,
}

/// Slots of a mode switch, as in PX4.
pub const MODE_SLOTS: usize = 6;

/// A switch of a pilot's transmitter that selects flight modes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ModeSwitchParameters {
    pub channel: SwitchChannel,
    /// The mode of each slot, from 1000 us to 2000 us.
    pub slots: [SwitchMode; MODE_SLOTS],
}

/// A channel that a mode switch can have: 1 to 4 are the sticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SwitchChannel {
    /// There is no switch.
    None,
    /// Channel 5.
    Five,
    /// Channel 6.
    Six,
    /// Channel 7.
    Seven,
    /// Channel 8.
    Eight,
}

/// Selection of a slot of the mode switch, with PX4's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SwitchMode {
    /// None: the mode stays.
    Unassigned,
    Manual,
    Altitude,
    Position,
    Mission,
    Hold,
    Return,
    Acro,
    Offboard,
    Stabilized,
}

/// Default rates of the streams, Hz of wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StreamParameters {
    pub attitude_hz: f64,
    pub position_hz: f64,
    /// Commands of the effectors.
    pub actuators_hz: f64,
    /// Signals of the compensator.
    pub compensator_hz: f64,
}
