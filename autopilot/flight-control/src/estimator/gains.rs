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

gain_set! {
    /// Gains of [`super::Estimator`]; rows `EST_*` of the parameter table. Spreads are one standard deviation.
    ///
    /// For sensors of the tactical grade in light to moderate turbulence; docs/estimation.md derives each number.
    EstimatorGains at estimator {
        /// White noise of each gyro, deg/s/√Hz.
        gyro_noise_deg = 0.0015, "EST_GYR_N" "deg/s/sqrt(Hz)", 1.0e-5 to 1.0, "White noise of each gyro";
        /// Constant error of each gyro at the start, deg/s.
        gyro_bias_deg = 0.0028, "EST_GYR_B" "deg/s", 1.0e-5 to 10.0, "Constant error of each gyro at the start";
        /// Its random walk, deg/s/√s.
        gyro_walk_deg = 2.9e-5, "EST_GYR_BW" "deg/s/sqrt(s)", 0.0 to 0.1, "Random walk of that error";
        /// Errors of scale and direction of the gyros, as a part of the rate.
        // Tuned with `sitl study estimator`, as is that of the accelerometers; the other numbers come from the
        // grade's file.
        gyro_scale = 2.7e-4, "EST_GYR_SF" "-", 0.0 to 0.1, "Errors of scale and direction of the gyros, of the rate";
        /// White noise of each accelerometer, m/s²/√Hz.
        force_noise_m_s2 = 0.0005, "EST_ACC_N" "m/s^2/sqrt(Hz)", 1.0e-5 to 1.0, "White noise of each accelerometer";
        /// Constant error of each accelerometer at the start, m/s².
        force_bias_m_s2 = 0.011, "EST_ACC_B" "m/s^2", 1.0e-5 to 5.0, "Constant error of each accelerometer at the start";
        /// Its random walk, m/s²/√s.
        force_walk_m_s2 = 2.9e-5, "EST_ACC_BW" "m/s^2/sqrt(s)", 0.0 to 0.1, "Random walk of that error";
        /// Errors of scale and direction of the accelerometers, as a part of the specific force that differs from level flight's.
        force_scale = 4.6e-4, "EST_ACC_SF" "-", 0.0 to 0.1, "Errors of scale and direction of the accelerometers, of what differs from level flight";
        /// White noise of a GNSS position, m.
        gnss_position_m = 0.3, "EST_GPS_P" "m", 0.01 to 100.0, "White noise of a GNSS position";
        /// Error of the GNSS position that wanders too slowly to be averaged, m.
        gnss_drift_m = 1.0, "EST_GPS_D" "m", 0.0 to 100.0, "Error of a GNSS position that wanders too slowly to be averaged";
        /// White noise of a GNSS velocity, m/s.
        gnss_velocity_m_s = 0.05, "EST_GPS_V" "m/s", 0.001 to 10.0, "White noise of a GNSS velocity";
        /// Vertical over horizontal errors of the GNSS position.
        gnss_vertical = 1.5, "EST_GPS_VF" "-", 0.1 to 10.0, "Vertical over horizontal errors of a GNSS position";
        /// White noise of the barometer, m.
        barometer_noise_m = 0.45, "EST_BAR_N" "m", 0.01 to 100.0, "White noise of the barometer";
        /// Offset of the pressure altitude at the start, m.
        barometer_offset_m = 10.0, "EST_BAR_B" "m", 0.01 to 1000.0, "Offset of the pressure altitude at the start";
        /// Its random walk, m/√s.
        barometer_walk_m = 0.05, "EST_BAR_BW" "m/sqrt(s)", 0.0 to 10.0, "Random walk of that offset";
        /// White noise of the impact pressure, Pa.
        pitot_noise_pa = 15.0, "EST_PIT_N" "Pa", 0.1 to 10000.0, "White noise of the impact pressure";
        /// Its error that lasts, Pa; only considered in flight.
        pitot_bias_pa = 16.0, "EST_PIT_B" "Pa", 0.1 to 10000.0, "Lasting error of the impact pressure";
        /// Error of its scale; only considered.
        pitot_scale = 0.002, "EST_PIT_SF" "-", 1.0e-5 to 0.5, "Error of its scale";
        /// White noise of the vanes, deg.
        vane_noise_deg = 0.1, "EST_VAN_N" "deg", 0.001 to 20.0, "White noise of the vanes";
        /// Constant error of the vanes at the start, deg; only considered without a pitot tube.
        vane_bias_deg = 0.16, "EST_VAN_B" "deg", 0.001 to 20.0, "Constant error of each vane at the start";
        /// Its random walk, deg/√s.
        vane_walk_deg = 0.002, "EST_VAN_BW" "deg/sqrt(s)", 0.0 to 1.0, "Random walk of that error";
        /// The radar altimeter shows no height beyond this, m.
        height_max_m = 1_500.0, "EST_HGT_MAX" "m", 1.0 to 100000.0, "The radar altimeter shows no height beyond this";
        /// White noise of the magnetometer, nT.
        magnetic_noise_nt = 60.0, "EST_MAG_N" "nT", 0.1 to 50000.0, "White noise of the magnetometer";
        /// Constant error of each magnetometer axis at the start, nT.
        magnetic_bias_nt = 170.0, "EST_MAG_B" "nT", 0.1 to 50000.0, "Constant error of each magnetometer axis at the start";
        /// Its random walk, nT/√s.
        magnetic_walk_nt = 1.2, "EST_MAG_BW" "nT/sqrt(s)", 0.0 to 1000.0, "Random walk of that error";
        /// Errors of its scale and direction, as a part of the field; they change with the attitude.
        magnetic_scale = 0.0015, "EST_MAG_SF" "-", 0.0 to 0.5, "Errors of scale and direction of the magnetometer, of the field";
        /// Horizontal wind at the start, m/s.
        wind_m_s = 15.0, "EST_WIND" "m/s", 0.1 to 200.0, "Horizontal wind at the start";
        /// Random walk of the horizontal wind without gusts, m/s/√s.
        wind_walk_m_s = 0.01, "EST_WIND_W" "m/s/sqrt(s)", 0.001 to 50.0, "Random walk of the horizontal wind without gusts";
        /// Gusts at the start, m/s rms along an axis; later on they are estimated.
        gust_m_s = 1.5, "EST_GUST" "m/s", 0.01 to 50.0, "Gusts at the start, rms along an axis; later on they are estimated";
        /// Their length, m.
        gust_length_m = 533.4, "EST_GUST_L" "m", 1.0 to 100000.0, "Length of the gusts";
        /// Error of roll and pitch after the initial alignment, deg.
        tilt_deg = 3.0, "EST_ALN_TILT" "deg", 0.1 to 45.0, "Error of roll and pitch after the first alignment";
        /// Least error of the heading after the initial alignment, deg; by the magnetic field and the track it may be larger.
        heading_deg = 5.0, "EST_ALN_HEAD" "deg", 0.1 to 90.0, "Least error of the heading after the first alignment";
        /// Error of the lift by the design model, as a part of it; only considered, used without vanes or pitot tube.
        lift_scale = 0.05, "EST_MDL_L" "-", 0.001 to 1.0, "Error of the lift by the design model, used without vanes or pitot tube";
        /// Error of the sideslip by the design model, deg; used without vanes.
        model_beta_deg = 2.0, "EST_MDL_B" "deg", 0.1 to 45.0, "Error of the sideslip by the design model, used without vanes";
        /// An innovation beyond this many standard deviations is rejected.
        gate = 5.0, "EST_GATE" "-", 1.0 to 100.0, "Innovations beyond this many standard deviations are rejected";
        /// A sensor that was rejected for this long is believed again, s.
        reopen_s = 3.0, "EST_REOPEN" "s", 0.1 to 600.0, "A sensor that was rejected for this long is believed again";
    }
}

impl EstimatorGains {
    /// For sensors of the consumer grade.
    pub const CONSUMER: Self = Self {
        gyro_noise_deg: 0.01,
        gyro_bias_deg: 0.2,
        gyro_walk_deg: 0.0014,
        // Tuned with `sitl study estimator`, as are `force_scale` and `vane_walk_deg`; the rest comes from
        // `consumer.toml`.
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
        height_max_m: 120.0,
        magnetic_noise_nt: 305.0,
        magnetic_bias_nt: 1_260.0,
        magnetic_walk_nt: 11.5,
        magnetic_scale: 0.0155,
        ..Self::REFERENCE
    };
}
