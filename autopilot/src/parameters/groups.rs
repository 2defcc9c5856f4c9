//! The parameters by what they are about. Defaults are in [`super::Parameters::default`], ranges in the
//! table.

use super::ParameterError;
use crate::vehicle::{LinkLossAction, Reference, VehicleRefusal};
use serde::{Deserialize, Serialize};

/// Parameters of the guidance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NavigationParameters {
    /// Period of the lateral guidance, s.
    pub l1_period_s: f64,
    /// Damping of the lateral guidance.
    pub l1_damping: f64,
    /// Largest bank angle that the guidance asks for, deg.
    pub bank_max_deg: f64,
    /// Radius of circles that have none of their own, m.
    pub loiter_radius_m: f64,
    /// Smallest acceptance radius of waypoints, m.
    pub acceptance_m: f64,
    /// Largest climb rate of stick and offboard references, m/s.
    pub climb_max_m_s: f64,
    /// Altitude of the return, m above the ellipsoid.
    pub return_altitude_m: f64,
    /// Fastest change of a roll reference that the guidance makes, deg/s; logs of before have the default.
    #[serde(default = "roll_slew_deg_s")]
    pub roll_slew_deg_s: f64,
}

/// Default of [`NavigationParameters::roll_slew_deg_s`]: the ailerons of the paper's jet follow it without reaching
/// their stops.
pub(super) fn roll_slew_deg_s() -> f64 {
    20.0
}

/// What silence of ground stations leads to, and when.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LinkParameters {
    /// What happens when the controlling ground station falls silent.
    pub loss_action: LinkLossAction,
    /// Silence after which it happens, wall time, s.
    pub loss_s: f64,
    /// Silence of an offboard stream after which Offboard ends, wall time, s.
    pub offboard_loss_s: f64,
    /// Silence of a pilot's sticks after which Altitude ends, wall time, s.
    pub sticks_loss_s: f64,
    /// The mode that follows then.
    pub sticks_loss_action: SticksLossAction,
    /// MAVLink system id of the vehicle, 1 to 250; what it is at the start of the program counts.
    pub system_id: u8,
}

/// What the aircraft does when a pilot's sticks fall silent, with PX4's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SticksLossAction {
    /// Circles where it is.
    Hold,
    /// Flies home.
    Return,
}

/// Slots of a mode switch, as PX4 has them.
pub const MODE_SLOTS: usize = 6;

/// A switch of a pilot's transmitter that selects flight modes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ModeSwitchParameters {
    /// Channel of RC_CHANNELS_OVERRIDE.
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

/// What a slot of the mode switch selects, with PX4's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SwitchMode {
    /// Nothing: the mode stays.
    Unassigned,
    /// Manual.
    Manual,
    /// Altitude.
    Altitude,
    /// Position.
    Position,
    /// Mission.
    Mission,
    /// Hold.
    Hold,
    /// Return.
    Return,
    /// Acro.
    Acro,
    /// Offboard.
    Offboard,
    /// Stabilized.
    Stabilized,
}

/// Default rates of the streams, Hz of wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StreamParameters {
    /// Attitude.
    pub attitude_hz: f64,
    /// Position and speed.
    pub position_hz: f64,
    /// Commands of the effectors.
    pub actuators_hz: f64,
    /// What the compensator does.
    pub compensator_hz: f64,
}

/// References that are accepted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReferenceLimits {
    /// Lowest altitude, m.
    pub altitude_min_m: f64,
    /// Highest altitude, m.
    pub altitude_max_m: f64,
    /// Lowest true airspeed, m/s.
    pub airspeed_min_m_s: f64,
    /// Highest true airspeed, m/s.
    pub airspeed_max_m_s: f64,
    /// Largest roll angle either way, deg.
    pub roll_max_deg: f64,
}

impl ReferenceLimits {
    /// Checks a reference; NaN is outside every range.
    ///
    /// # Errors
    /// [`VehicleRefusal::OutOfRange`].
    pub fn check(&self, reference: Reference) -> Result<(), VehicleRefusal> {
        let (what, unit, value, min, max) = match reference {
            Reference::Altitude(value) => {
                ("altitude", "m", value, self.altitude_min_m, self.altitude_max_m)
            }
            Reference::Airspeed(value) => {
                ("airspeed", "m/s", value, self.airspeed_min_m_s, self.airspeed_max_m_s)
            }
            Reference::Roll(value) => {
                ("roll", "deg", value.to_degrees(), -self.roll_max_deg, self.roll_max_deg)
            }
            Reference::Course(value) => ("course", "deg", value.to_degrees(), -180.0, 360.0),
        };
        if (min..=max).contains(&value) {
            Ok(())
        } else {
            Err(VehicleRefusal::OutOfRange { what, unit, value, min, max })
        }
    }

    pub(super) fn check_order(&self) -> Result<(), ParameterError> {
        for (lower, low, upper, high, unit) in [
            ("REF_ALT_MIN", self.altitude_min_m, "REF_ALT_MAX", self.altitude_max_m, "m"),
            ("FW_AIRSPD_MIN", self.airspeed_min_m_s, "FW_AIRSPD_MAX", self.airspeed_max_m_s, "m/s"),
        ] {
            if low > high {
                return Err(ParameterError::Order { lower, low, upper, high, unit });
            }
        }
        Ok(())
    }
}
