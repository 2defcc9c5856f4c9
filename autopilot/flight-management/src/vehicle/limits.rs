//! The parameters of the vehicle: limits of references, and the guidance. Defaults and ranges are in the
//! table of parameters.

use serde::{Deserialize, Serialize};

use super::{Reference, VehicleRefusal};

/// Parameters of the guidance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NavigationParameters {
    /// Period of the lateral guidance, s.
    pub l1_period_s: f64,
    /// Damping of the lateral guidance.
    pub l1_damping: f64,
    /// Largest bank angle of the guidance, deg.
    pub bank_max_deg: f64,
    /// Radius of circles without a given radius, m.
    pub loiter_radius_m: f64,
    /// Smallest acceptance radius of waypoints, m.
    pub acceptance_m: f64,
    /// Largest climb rate of stick and offboard references, m/s.
    pub climb_max_m_s: f64,
    /// Altitude of the return, m above the ellipsoid.
    pub return_altitude_m: f64,
    /// Fastest change of a roll reference that the guidance commands, deg/s; older logs have the default.
    #[serde(default = "roll_slew_deg_s")]
    pub roll_slew_deg_s: f64,
}

/// Default of [`NavigationParameters::roll_slew_deg_s`]: the ailerons of the paper's jet follow it without reaching
/// their stops.
pub(crate) fn roll_slew_deg_s() -> f64 {
    20.0
}

/// Limits of references.
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
}
