//! What every service may read and write beside its own state.

use flight_control::AircraftModel;
use icd::EffectorList;

use super::aircraft::Aircraft;
use super::control::Control;
use super::intents::Intents;
use super::modes::Streams;
pub use super::peers::From;
use super::scripts::Scripts;
use super::statustext::StatusTexts;
use super::telemetry::Telemetry;
use flight_management::parameters::Parameters;

/// What the services share.
#[derive(Debug)]
pub struct Context<'a> {
    /// The authoritative parameters.
    pub parameters: &'a mut Parameters,
    /// Their defaults for this aircraft.
    pub defaults: &'a Parameters,
    /// How far the effectors travel, as far as the autopilot knows.
    pub model: &'a AircraftModel,
    /// What is known about the aircraft.
    pub aircraft: &'a Aircraft,
    /// To the control thread.
    pub intents: &'a mut Intents,
    /// To the operators.
    pub texts: &'a mut StatusTexts,
    /// What is streamed, and every message that can be asked for.
    pub telemetry: &'a mut Telemetry,
    /// The scripts that are here.
    pub scripts: &'a mut Scripts,
    /// Which ground station has control.
    pub control: &'a mut Control,
    /// The sender of the message at hand sent a usable offboard setpoint a moment ago.
    pub setpoint_is_fresh: bool,
    /// Its sticks were heard a moment ago.
    pub sticks_are_fresh: bool,
    /// Items of the plan that the aircraft has taken.
    pub plan_items: u16,
}

impl<'a> Context<'a> {
    /// The effectors of the aircraft, as its model file has them.
    #[must_use]
    pub fn effectors(&self) -> &'a EffectorList {
        &self.model.effectors.list
    }

    /// What streams of the sender are heard just now.
    #[must_use]
    pub fn streams(&self) -> Streams {
        Streams { setpoints: self.setpoint_is_fresh, sticks: self.sticks_are_fresh }
    }
}
