//! What the estimator reports of itself.

use icd::Sensors;
use icd::sensors::SensorKind;
use serde::{Deserialize, Serialize};

/// What became of the samples of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[repr(u8)]
pub enum SourceHealth {
    /// The estimator does not read it, or no sample has come yet.
    #[default]
    Unused = 0,
    /// Used.
    Used = 1,
    /// No valid sample for a while.
    Lost = 2,
    /// New samples repeat one value bit for bit, which no working sensor does.
    Stuck = 3,
    /// The samples contradict the estimate.
    Rejected = 4,
    /// The samples are older than what the estimator remembers.
    Late = 5,
}

impl SourceHealth {
    /// The reason in words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unused => "not used",
            Self::Used => "used",
            Self::Lost => "no valid samples",
            Self::Stuck => "samples do not change",
            Self::Rejected => "samples contradict the estimate",
            Self::Late => "samples are too old",
        }
    }

    /// Whether it was used and is not any more.
    pub const fn is_gone(self) -> bool {
        !matches!(self, Self::Unused | Self::Used)
    }
}

/// State and quality of an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EstimatorStatus {
    /// The first alignment is done.
    pub is_aligned: bool,
    /// What became of the samples of each sensor, in the order of [`SensorKind::ALL`].
    pub sources: [SourceHealth; Sensors::SENSORS],
    /// Largest innovation of the last GNSS velocity, of its gate.
    pub velocity_ratio: f32,
    /// Largest innovation of the last horizontal GNSS position, of its gate.
    pub horizontal_ratio: f32,
    /// Innovation of the last barometer sample, of its gate.
    pub vertical_ratio: f32,
    /// Largest innovation of the last magnetometer sample, of its gate.
    pub magnetic_ratio: f32,
    /// Innovation of the last pitot sample, of its gate.
    pub airspeed_ratio: f32,
    /// Largest innovation of the last sample of the vanes, of its gate.
    pub flow_ratio: f32,
    /// Standard deviation of the attitude: root of the sum of its three variances, rad.
    pub attitude_rad: f32,
    /// The same of the velocity, m/s.
    pub velocity_m_s: f32,
    /// The same of the horizontal position, m, with the slow errors of GNSS.
    pub horizontal_m: f32,
    /// Standard deviation of the altitude, m, with the slow errors of GNSS.
    pub vertical_m: f32,
    /// Standard deviation of the wind: root of the sum of its three variances, m/s.
    pub wind_m_s: f32,
    /// Standard deviation of the airspeed, m/s.
    pub airspeed_m_s: f32,
    /// Standard deviations of angle of attack and sideslip, rad.
    pub flow_rad: [f32; 2],
    /// The same of the biases of the gyros, rad/s.
    pub gyro_bias_rad_s: f32,
    /// The same of the biases of the accelerometers, m/s².
    pub force_bias_m_s2: f32,
    /// The same of the biases of the magnetometer, nT.
    pub magnetic_bias_nt: f32,
    /// Standard deviation of the offset of the pressure altitude, m.
    pub barometer_offset_m: f32,
    /// The same of the biases of the two vanes, rad.
    pub vane_bias_rad: f32,
    /// Samples that were rejected since the start of the flight.
    pub rejected: u32,
    /// GNSS samples that were older than what the estimator remembers.
    pub late: u32,
    /// Alignments after the first one.
    pub realigned: u32,
}

impl EstimatorStatus {
    /// What became of the samples of a sensor.
    pub const fn source(&self, sensor: SensorKind) -> SourceHealth {
        self.sources[sensor as usize]
    }
}
