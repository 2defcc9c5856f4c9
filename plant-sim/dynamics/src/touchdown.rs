//! What was true when the aircraft touched the ground.

use icd::SimTime;
use serde::{Deserialize, Serialize};

use crate::truth::Truth;

/// A touchdown: the end of the control period in which the first contact point touched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Touchdown {
    #[serde(rename = "time_us")]
    pub time: SimTime,
    /// Rate of descent, m/s.
    pub sink_m_s: f64,
    /// From the threshold of the runway, m.
    pub along_m: f64,
    /// To the right of its centre line, m.
    pub across_m: f64,
    pub roll_rad: f64,
    pub pitch_rad: f64,
    /// The nose to the right of the track over the ground, rad.
    pub crab_rad: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// How often it has touched again after leaving the ground.
    pub bounces: u32,
}

impl Touchdown {
    pub(crate) fn of(truth: &Truth, along_m: f64, across_m: f64) -> Self {
        let (euler, velocity) = (truth.euler(), truth.velocity.0);
        let track_rad = libm::atan2(velocity.y, velocity.x);
        Self {
            time: truth.time,
            sink_m_s: velocity.z,
            along_m,
            across_m,
            roll_rad: euler.phi,
            pitch_rad: euler.theta,
            crab_rad: libm::remainder(euler.psi - track_rad, core::f64::consts::TAU),
            airspeed_m_s: truth.airspeed_m_s,
            bounces: 0,
        }
    }
}
