//! Noise, priors and gates of the estimator.

use serde::{Deserialize, Serialize};

/// Where the navigation state comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StateSource {
    /// The samples where the attitude unit is valid in the first control step of a flight, else the estimator.
    #[default]
    Automatic,
    /// The latest samples.
    Samples,
    /// The estimator.
    Estimator,
}

/// The Earth that the estimator assumes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EarthShape {
    /// The rotating WGS-84 ellipsoid.
    #[default]
    Wgs84,
    /// A plane that does not rotate.
    Flat,
}

/// Which numbers the estimator uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EstimatorPreset {
    /// Those of the parameters `EST_*`.
    #[default]
    Parameters,
    /// [`EstimatorGains::CONSUMER`].
    Consumer,
}

/// Gains of [`super::Estimator`]; rows `EST_*` of the parameter table. Spreads are one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EstimatorGains {
    /// White noise of each gyro, deg/s/√Hz.
    pub gyro_noise_deg: f64,
    /// Constant error of each gyro at the start, deg/s.
    pub gyro_bias_deg: f64,
    /// Its random walk, deg/s/√s.
    pub gyro_walk_deg: f64,
    /// Errors of scale and direction of the gyros, as a part of the rate.
    pub gyro_scale: f64,
    /// White noise of each accelerometer, m/s²/√Hz.
    pub force_noise_m_s2: f64,
    /// Constant error of each accelerometer at the start, m/s².
    pub force_bias_m_s2: f64,
    /// Its random walk, m/s²/√s.
    pub force_walk_m_s2: f64,
    /// Errors of scale and direction of the accelerometers, as a part of the specific force that differs from level flight's.
    pub force_scale: f64,
    /// White noise of a GNSS position, m.
    pub gnss_position_m: f64,
    /// Error of the GNSS position that wanders too slowly to be averaged, m.
    pub gnss_drift_m: f64,
    /// White noise of a GNSS velocity, m/s.
    pub gnss_velocity_m_s: f64,
    /// Vertical over horizontal errors of the GNSS position.
    pub gnss_vertical: f64,
    /// White noise of the barometer, m.
    pub barometer_noise_m: f64,
    /// Offset of the pressure altitude at the start, m.
    pub barometer_offset_m: f64,
    /// Its random walk, m/√s.
    pub barometer_walk_m: f64,
    /// White noise of the impact pressure, Pa.
    pub pitot_noise_pa: f64,
    /// Its error that lasts, Pa; only considered.
    pub pitot_bias_pa: f64,
    /// Error of its scale; only considered.
    pub pitot_scale: f64,
    /// White noise of the vanes, deg.
    pub vane_noise_deg: f64,
    /// Constant error of the vanes at the start, deg; only considered without a pitot tube.
    pub vane_bias_deg: f64,
    /// Its random walk, deg/√s.
    pub vane_walk_deg: f64,
    /// White noise of the magnetometer, nT.
    pub magnetic_noise_nt: f64,
    /// Constant error of each magnetometer axis at the start, nT.
    pub magnetic_bias_nt: f64,
    /// Its random walk, nT/√s.
    pub magnetic_walk_nt: f64,
    /// Errors of its scale and direction, as a part of the field; they change with the attitude.
    pub magnetic_scale: f64,
    /// Horizontal wind at the start, m/s.
    pub wind_m_s: f64,
    /// Random walk of the horizontal wind without gusts, m/s/√s.
    pub wind_walk_m_s: f64,
    /// Gusts at the start, m/s rms along an axis; later on they are estimated.
    pub gust_m_s: f64,
    /// Their length, m.
    pub gust_length_m: f64,
    /// Error of roll and pitch after the initial alignment, deg.
    pub tilt_deg: f64,
    /// Least error of the heading after the initial alignment, deg; by the magnetic field and the track it may be larger.
    pub heading_deg: f64,
    /// Error of the lift by the design model, as a part of it; only considered, used without vanes or pitot tube.
    pub lift_scale: f64,
    /// Error of the sideslip by the design model, deg; used without vanes.
    pub model_beta_deg: f64,
    /// An innovation beyond this many standard deviations is rejected.
    pub gate: f64,
    /// A sensor that was rejected for this long is believed again, s.
    pub reopen_s: f64,
}

impl Default for EstimatorGains {
    fn default() -> Self {
        Self::REFERENCE
    }
}

impl EstimatorGains {
    /// For sensors of the tactical grade in light to moderate turbulence; docs/estimator.md derives each number.
    pub const REFERENCE: Self = Self {
        gyro_noise_deg: 0.0015,
        gyro_bias_deg: 0.0028,
        gyro_walk_deg: 2.9e-5,
        gyro_scale: 2.7e-4,
        force_noise_m_s2: 0.0005,
        force_bias_m_s2: 0.011,
        force_walk_m_s2: 2.9e-5,
        force_scale: 4.6e-4,
        gnss_position_m: 0.3,
        gnss_drift_m: 1.0,
        gnss_velocity_m_s: 0.05,
        gnss_vertical: 1.5,
        barometer_noise_m: 0.45,
        barometer_offset_m: 10.0,
        barometer_walk_m: 0.05,
        pitot_noise_pa: 15.0,
        pitot_bias_pa: 16.0,
        pitot_scale: 0.002,
        vane_noise_deg: 0.1,
        vane_bias_deg: 0.16,
        vane_walk_deg: 0.002,
        magnetic_noise_nt: 60.0,
        magnetic_bias_nt: 170.0,
        magnetic_walk_nt: 1.2,
        magnetic_scale: 0.0015,
        wind_m_s: 15.0,
        wind_walk_m_s: 0.01,
        gust_m_s: 1.5,
        gust_length_m: 533.4,
        tilt_deg: 3.0,
        heading_deg: 5.0,
        lift_scale: 0.05,
        model_beta_deg: 2.0,
        gate: 5.0,
        reopen_s: 3.0,
    };

    /// For sensors of the consumer grade.
    pub const CONSUMER: Self = Self {
        gyro_noise_deg: 0.01,
        gyro_bias_deg: 0.2,
        gyro_walk_deg: 0.0014,
        gyro_scale: 0.0085,
        force_noise_m_s2: 0.003,
        force_bias_m_s2: 0.21,
        force_walk_m_s2: 7.0e-4,
        force_scale: 0.007,
        gnss_position_m: 0.8,
        gnss_drift_m: 2.0,
        gnss_velocity_m_s: 0.1,
        barometer_noise_m: 0.45,
        barometer_walk_m: 0.16,
        pitot_noise_pa: 30.0,
        pitot_bias_pa: 54.0,
        pitot_scale: 0.01,
        vane_noise_deg: 0.3,
        vane_bias_deg: 0.54,
        vane_walk_deg: 0.03,
        magnetic_noise_nt: 305.0,
        magnetic_bias_nt: 1_260.0,
        magnetic_walk_nt: 11.5,
        magnetic_scale: 0.0155,
        ..Self::REFERENCE
    };
}
