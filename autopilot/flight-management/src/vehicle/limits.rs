//! The parameters of the vehicle: limits of references, and the guidance. Defaults and ranges are in the
//! table of parameters.

use flight_control::design_model::atmosphere;
use serde::{Deserialize, Serialize};

use super::request::Airspeed;
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
    /// Fastest change of a roll reference that the guidance commands, deg/s.
    pub roll_slew_deg_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReferenceLimits {
    /// Lowest altitude, m.
    pub altitude_min_m: f64,
    /// Highest altitude, m.
    pub altitude_max_m: f64,
    /// Lowest calibrated airspeed, m/s.
    pub airspeed_min_m_s: f64,
    /// Highest calibrated airspeed, m/s.
    pub airspeed_max_m_s: f64,
    /// Largest roll angle either way, deg.
    pub roll_max_deg: f64,
}

impl ReferenceLimits {
    /// Lowest and highest true airspeed at an altitude, m/s.
    pub fn airspeeds_m_s(&self, altitude_m: f64) -> [f64; 2] {
        [self.airspeed_min_m_s, self.airspeed_max_m_s]
            .map(|calibrated_m_s| atmosphere::true_airspeed(calibrated_m_s, altitude_m))
    }

    /// Checks an airspeed of a plan, whose altitude is not known yet.
    pub fn check_airspeed(&self, airspeed: Airspeed) -> Result<(), VehicleRefusal> {
        let (what, value, [min, max]) = match airspeed {
            Airspeed::Calibrated(value) => {
                ("calibrated airspeed", value, [self.airspeed_min_m_s, self.airspeed_max_m_s])
            }
            Airspeed::True(value) => {
                let [min, _] = self.airspeeds_m_s(self.altitude_min_m);
                let [_, max] = self.airspeeds_m_s(self.altitude_max_m);
                ("true airspeed", value, [min, max])
            }
        };
        within(what, "m/s", value, min, max)
    }

    /// Checks a reference at an altitude; NaN is outside every range.
    pub fn check(&self, reference: Reference, altitude_m: f64) -> Result<(), VehicleRefusal> {
        let (what, unit, value, min, max) = match reference {
            Reference::Altitude(value) => {
                ("altitude", "m", value, self.altitude_min_m, self.altitude_max_m)
            }
            Reference::Airspeed(value) => {
                let [min, max] = self.airspeeds_m_s(altitude_m);
                ("true airspeed", "m/s", value, min, max)
            }
            Reference::Roll(value) => {
                ("roll", "deg", value.to_degrees(), -self.roll_max_deg, self.roll_max_deg)
            }
            Reference::Course(value) => ("course", "deg", value.to_degrees(), -180.0, 360.0),
        };
        within(what, unit, value, min, max)
    }
}

/// NaN is outside every range.
fn within(
    what: &'static str,
    unit: &'static str,
    value: f64,
    min: f64,
    max: f64,
) -> Result<(), VehicleRefusal> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(VehicleRefusal::OutOfRange { what, unit, value, min, max })
    }
}
