//! The table of tunables: name, unit, range, meaning, and where the value lives in [`Gains`].
//!
//! The fields and the values of [`Gains::REFERENCE`] are in the file of each law.

use super::Gains;

/// One tunable gain.
#[derive(Debug, Clone, Copy)]
pub struct Tunable {
    /// Parameter name, at most 16 characters.
    pub name: &'static str,
    /// Unit; `-` for none.
    pub unit: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// What it does.
    pub meaning: &'static str,
    /// Reads it.
    pub get: fn(&Gains) -> f64,
    /// Writes it; check the set with [`Gains::validate`] afterwards.
    pub set: fn(&mut Gains, f64),
}

/// Rows of one block of [`Gains`]: name, unit, range, field, meaning.
macro_rules! rows {
    ($block:ident: $($name:literal, $unit:literal, $min:literal, $max:literal, $($field:ident).+, $meaning:literal;)*) => {
        &[$(Tunable {
            name: $name,
            unit: $unit,
            min: $min,
            max: $max,
            meaning: $meaning,
            get: |gains| gains.$block.$($field).+,
            set: |gains, value| gains.$block.$($field).+ = value,
        }),*]
    };
}

/// The rows of each block, in the order of the parameters.
const BLOCKS: [&[Tunable]; 11] = [
    REFERENCES,
    PID,
    NDI,
    LQR,
    NESO,
    LINEAR_ESO,
    INCREMENTAL,
    ACTIVATION,
    RELIEF,
    ISOLATION,
    ESTIMATOR,
];

const REFERENCES: &[Tunable] = rows! { references:
    "ALT_SLEW", "m/s", 0.1, 1000.0, slew_m_s, "Slew limit of the altitude reference";
    "ROL_LAG", "s", 0.01, 10.0, roll_lag_s, "Time constant of the lag on the roll reference";
};

const PID: &[Tunable] = rows! { pid:
    "ALT_KQ", "s", 0.01, 20.0, altitude.k_q, "Elevator per pitch rate";
    "ALT_KTH", "-", 0.01, 20.0, altitude.k_theta, "Elevator per pitch angle";
    "ALT_KHD", "rad s/m", 1.0e-6, 1.0, altitude.k_hd, "Elevator per climb rate";
    "ALT_KH", "rad/m", 1.0e-7, 1.0, altitude.k_h, "Elevator per altitude error";
    "ALT_KHI", "rad/(m s)", 1.0e-9, 0.1, altitude.k_hi, "Elevator rate per altitude error";
    "ALT_ERR_MAX", "m", 1.0, 5000.0, altitude.error_max_m, "Largest altitude error that the law sees; sets the climb rate";
    "ALT_INT_BAND", "m", 0.1, 5000.0, altitude.integral_band_m, "Altitude integrator runs below this altitude error";
    "ALT_INT_CLIMB", "m/s", 0.0, 100.0, altitude.settled_climb_m_s, "Beyond its band the altitude integrator runs while the climb rate stays below this";
    "ALT_INT_WAIT", "s", 0.1, 600.0, altitude.settled_after_s, "Time that the climb rate must have been below ALT_INT_CLIMB";
    "ALT_INT_MAX", "rad", 0.001, 0.5, altitude.integral_max_rad, "Largest elevator of the altitude integrator";
    "ALT_KALPHA", "-", 0.0, 100.0, altitude.k_alpha, "Elevator per angle of attack beyond the stall onset";
    "ROL_KP", "s", 0.001, 20.0, roll.k_p, "Aileron per roll rate";
    "ROL_KPHI", "-", 0.01, 20.0, roll.k_phi, "Aileron per roll angle error";
    "ROL_KPHII", "1/s", 1.0e-6, 10.0, roll.k_phi_i, "Aileron rate per roll angle error";
    "ROL_INT_MAX", "rad", 0.001, 10.0, roll.integral_max_rad, "Largest aileron of the roll integrator";
    "YAW_KR", "s", 0.001, 20.0, yaw.k_r, "Rudder per yaw rate";
    "SPD_KV", "1/s", 0.001, 10.0, speed.k_v, "Acceleration per speed error";
    "SPD_KVI", "1/s^2", 1.0e-6, 10.0, speed.k_vi, "Acceleration rate per speed error";
};

const NDI: &[Tunable] = rows! { ndi:
    "NDI_KP", "1/s", 0.1, 50.0, k_p, "Bandwidth of the roll rate";
    "NDI_KQ", "1/s", 0.1, 50.0, k_q, "Bandwidth of the pitch rate";
    "NDI_KR", "1/s", 0.1, 50.0, k_r, "Bandwidth of the yaw rate";
    "NDI_KPHI", "1/s", 0.01, 20.0, k_phi, "Bandwidth of the roll angle";
    "NDI_KPHII", "1/s^2", 0.0, 10.0, k_phi_i, "Roll rate rate per roll angle error";
    "NDI_KBETA", "1/s", 0.0, 20.0, k_beta, "Bandwidth of the sideslip";
    "NDI_KALPHA", "1/s", 0.01, 20.0, k_alpha, "Bandwidth of the angle of attack";
    "NDI_KGAMMA", "1/s", 0.01, 20.0, k_gamma, "Bandwidth of the flight-path angle";
    "NDI_KH", "1/s", 0.001, 10.0, k_h, "Bandwidth of the altitude";
    "NDI_KHI", "1/s^2", 0.0, 10.0, k_hi, "Climb rate rate per altitude error";
    "NDI_CLIMB_MAX", "m/s", 0.1, 500.0, climb_max_m_s, "Largest climb rate that an altitude error asks for";
    "NDI_KV", "1/s", 0.001, 10.0, k_v, "Bandwidth of the airspeed";
    "NDI_KVI", "1/s^2", 0.0, 10.0, k_vi, "Acceleration rate per airspeed error";
};

/// Rows of [`super::LqrGains`].
pub const LQR: &[Tunable] = rows! { lqr:
    "LQR_E_CLB", "rad s/m", -1.0, 1.0, elevator.climb, "Elevator per climb rate";
    "LQR_E_V", "rad s/m", -1.0, 1.0, elevator.airspeed, "Elevator per airspeed error";
    "LQR_E_TH", "-", -50.0, 50.0, elevator.theta, "Elevator per pitch angle";
    "LQR_E_Q", "s", -50.0, 50.0, elevator.q, "Elevator per pitch rate";
    "LQR_E_H", "rad/m", -1.0, 1.0, elevator.altitude, "Elevator per altitude error";
    "LQR_E_HI", "rad/(m s)", -1.0, 1.0, elevator.altitude_i, "Elevator per integral of the altitude error";
    "LQR_E_VI", "rad/m", -1.0, 1.0, elevator.airspeed_i, "Elevator per integral of the airspeed error";
    "LQR_T_CLB", "1/s", -50.0, 50.0, thrust.climb, "Thrust per mass and climb rate";
    "LQR_T_V", "1/s", -50.0, 50.0, thrust.airspeed, "Thrust per mass and airspeed error";
    "LQR_T_TH", "m/s^2", -1000.0, 1000.0, thrust.theta, "Thrust per mass and pitch angle";
    "LQR_T_Q", "m/s", -1000.0, 1000.0, thrust.q, "Thrust per mass and pitch rate";
    "LQR_T_H", "1/s^2", -50.0, 50.0, thrust.altitude, "Thrust per mass and altitude error";
    "LQR_T_HI", "1/s^3", -50.0, 50.0, thrust.altitude_i, "Thrust per mass and integral of the altitude error";
    "LQR_T_VI", "1/s^2", -50.0, 50.0, thrust.airspeed_i, "Thrust per mass and integral of the airspeed error";
    "LQR_A_B", "-", -50.0, 50.0, aileron.beta, "Aileron per sideslip";
    "LQR_A_P", "s", -50.0, 50.0, aileron.p, "Aileron per roll rate";
    "LQR_A_R", "s", -50.0, 50.0, aileron.r, "Aileron per yaw rate";
    "LQR_A_PHI", "-", -50.0, 50.0, aileron.phi, "Aileron per roll angle error";
    "LQR_A_PHII", "1/s", -50.0, 50.0, aileron.phi_i, "Aileron per integral of the roll angle error";
    "LQR_R_B", "-", -50.0, 50.0, rudder.beta, "Rudder per sideslip";
    "LQR_R_P", "s", -50.0, 50.0, rudder.p, "Rudder per roll rate";
    "LQR_R_R", "s", -50.0, 50.0, rudder.r, "Rudder per yaw rate";
    "LQR_R_PHI", "-", -50.0, 50.0, rudder.phi, "Rudder per roll angle error";
    "LQR_R_PHII", "1/s", -50.0, 50.0, rudder.phi_i, "Rudder per integral of the roll angle error";
    "LQR_ERR_MAX", "m", 1.0, 5000.0, error_max_m, "Largest altitude error that the regulator sees";
};

const NESO: &[Tunable] = rows! { neso:
    "OBS_W0", "rad/s", 1.0, 500.0, bandwidth, "Observer bandwidth in the linear zone";
    "OBS_KB", "-", 0.1, 20.0, rate_factor, "Observer beta1 as a multiple of the bandwidth";
    "OBS_WIDTH", "rad/s", 1.0e-5, 10.0, fal_width, "Half width of the linear zone of fal";
};

const LINEAR_ESO: &[Tunable] = rows! { linear_eso:
    "LES_W0", "rad/s", 1.0, 500.0, bandwidth, "Bandwidth of the linear observer";
};

const INCREMENTAL: &[Tunable] = rows! { incremental:
    "INC_W0", "rad/s", 1.0, 500.0, bandwidth, "Natural frequency of the filter of the angular acceleration";
    "INC_ZETA", "-", 0.1, 5.0, damping, "Damping of the filter of the angular acceleration";
};

const ACTIVATION: &[Tunable] = rows! { activation:
    "ACT_LVL_P", "rad/s^2", 0.001, 100.0, level_roll, "Roll level of the estimate that wakes the compensator";
    "ACT_LVL_Q", "rad/s^2", 0.001, 100.0, level_pitch, "Pitch level of the estimate that wakes the compensator";
    "ACT_LVL_R", "rad/s^2", 0.001, 100.0, level_yaw, "Yaw level of the estimate that wakes the compensator";
    "ACT_STD", "-", 0.0, 20.0, deviations, "Standard deviations of the modelled acceleration, by those of the flow angles, that add to the levels";
    "ACT_T_ON", "s", 0.001, 10.0, on_dwell_s, "Time above the level before the compensator wakes";
    "ACT_HYST", "-", 0.01, 0.99, hysteresis, "Release below this fraction of the level";
    "ACT_T_OFF", "s", 0.001, 600.0, off_dwell_s, "Time below the release level before it sleeps again";
    "ACT_FADE", "s", 0.001, 10.0, fade_s, "Time in which the compensation fades in and out";
};

const RELIEF: &[Tunable] = rows! { relief:
    "RLF_LAG", "s", 0.05, 20.0, shortage_lag_s, "Lag on the yaw acceleration that is missing";
    "RLF_FULL", "rad/s^2", 0.001, 10.0, shortage_full, "Missing yaw acceleration at which the roll relief is full";
    "RLF_T_UP", "s", 0.005, 10.0, rise_s, "Time constant with which the roll relief comes";
    "RLF_T_DOWN", "s", 0.005, 60.0, fall_s, "Time constant with which the roll relief goes";
    "RLF_LEAD", "s", 0.0, 5.0, lead_s, "Time by which the roll relief leads the sideslip";
    "RLF_LEAD_B", "rad", 0.0, 1.0, lead_beta_rad, "Sideslip from which on the roll relief leads it";
    "RLF_RESERVE", "rad", 0.0, 0.1, reserve_rad, "Nozzle yaw that is kept for what is quicker than RLF_LAG";
    "RLF_BOOST", "-", 0.0, 20.0, boost, "Thrust for a growing yaw shortage, as a multiple of what gives it at 0.2 rad of nozzle";
    "RLF_BOOST_T", "s", 0.05, 60.0, boost_s, "Time over which the growth counts";
    "RLF_BOOST_V", "m/s", 0.1, 200.0, boost_over_m_s, "Airspeed above its reference from which on the boost fades, over the same again";
    "RLF_FLOOR", "-", 0.1, 1.0, floor_use, "Part of the nozzle pitch travel that the thrust floor leaves to a steady demand";
    "RLF_FLOOR_D", "-", 0.0, 2.0, floor_drag, "Largest thrust floor as a part of the drag";
    "RLF_OSC_LVL", "-", 0.01, 100.0, oscillation_level, "Swing of an oscillating estimate that counts, in activation levels";
    "RLF_OSC_N", "-", 2.0, 100.0, oscillation_count, "Half cycles in a row after which the compensator yields";
    "RLF_OSC_LAG", "s", 0.05, 60.0, yield_lag_s, "Lag on the estimate that is still compensated then";
    "RLF_OSC_MAIN", "-", 0.0, 1.0, yield_main, "Part of the aileron command of the main controller that is held back where it oscillates on";
    "RLF_OSC_RETRY", "s", 1.0, 600.0, retry_s, "Time after which it tries again; doubles each time the oscillation is back";
};

const ISOLATION: &[Tunable] = rows! { isolation:
    "ISO_MEMORY", "s", 0.5, 60.0, memory_s, "Time after which what was seen counts e times less";
    "ISO_CORR", "s", 0.02, 5.0, correlation_s, "Time between two samples of the estimate that count as independent";
    "ISO_NOISE", "-", 0.01, 10.0, noise_level, "Deviation of the estimate that needs no explanation, in activation levels";
    "ISO_MODEL", "-", 0.0, 1.0, model_error, "The same as a part of the estimate: how wrong the design model may be";
    "ISO_CONF", "-", 0.5, 0.9999, confidence, "Probability from which on an effector is named";
    "ISO_PERSIST", "s", 0.1, 60.0, persistence_s, "The probability has to be exceeded this long";
    "ISO_TEST", "rad", 0.001, 0.2, test_rad, "Size of a test deflection";
};

const ESTIMATOR: &[Tunable] = rows! { estimator:
    "EST_GYR_N", "deg/s/sqrt(Hz)", 1.0e-5, 1.0, gyro_noise_deg, "White noise of each gyro";
    "EST_GYR_B", "deg/s", 1.0e-5, 10.0, gyro_bias_deg, "Constant error of each gyro at the start";
    "EST_GYR_BW", "deg/s/sqrt(s)", 0.0, 0.1, gyro_walk_deg, "Random walk of that error";
    "EST_GYR_SF", "-", 0.0, 0.1, gyro_scale, "Errors of scale and direction of the gyros, of the rate";
    "EST_ACC_N", "m/s^2/sqrt(Hz)", 1.0e-5, 1.0, force_noise_m_s2, "White noise of each accelerometer";
    "EST_ACC_B", "m/s^2", 1.0e-5, 5.0, force_bias_m_s2, "Constant error of each accelerometer at the start";
    "EST_ACC_BW", "m/s^2/sqrt(s)", 0.0, 0.1, force_walk_m_s2, "Random walk of that error";
    "EST_ACC_SF", "-", 0.0, 0.1, force_scale, "Errors of scale and direction of the accelerometers, of what differs from level flight";
    "EST_GPS_P", "m", 0.01, 100.0, gnss_position_m, "White noise of a GNSS position";
    "EST_GPS_D", "m", 0.0, 100.0, gnss_drift_m, "Error of a GNSS position that wanders too slowly to be averaged";
    "EST_GPS_V", "m/s", 0.001, 10.0, gnss_velocity_m_s, "White noise of a GNSS velocity";
    "EST_GPS_VF", "-", 0.1, 10.0, gnss_vertical, "Vertical over horizontal errors of a GNSS position";
    "EST_BAR_N", "m", 0.01, 100.0, barometer_noise_m, "White noise of the barometer";
    "EST_BAR_B", "m", 0.01, 1000.0, barometer_offset_m, "Offset of the pressure altitude at the start";
    "EST_BAR_BW", "m/sqrt(s)", 0.0, 10.0, barometer_walk_m, "Random walk of that offset";
    "EST_PIT_N", "Pa", 0.1, 10000.0, pitot_noise_pa, "White noise of the impact pressure";
    "EST_PIT_B", "Pa", 0.1, 10000.0, pitot_bias_pa, "Lasting error of the impact pressure";
    "EST_PIT_SF", "-", 1.0e-5, 0.5, pitot_scale, "Error of its scale";
    "EST_VAN_N", "deg", 0.001, 20.0, vane_noise_deg, "White noise of the vanes";
    "EST_VAN_B", "deg", 0.001, 20.0, vane_bias_deg, "Constant error of each vane at the start";
    "EST_VAN_BW", "deg/sqrt(s)", 0.0, 1.0, vane_walk_deg, "Random walk of that error";
    "EST_MAG_N", "nT", 0.1, 50000.0, magnetic_noise_nt, "White noise of the magnetometer";
    "EST_MAG_B", "nT", 0.1, 50000.0, magnetic_bias_nt, "Constant error of each magnetometer axis at the start";
    "EST_MAG_BW", "nT/sqrt(s)", 0.0, 1000.0, magnetic_walk_nt, "Random walk of that error";
    "EST_MAG_SF", "-", 0.0, 0.5, magnetic_scale, "Errors of scale and direction of the magnetometer, of the field";
    "EST_WIND", "m/s", 0.1, 200.0, wind_m_s, "Horizontal wind at the start";
    "EST_WIND_W", "m/s/sqrt(s)", 0.001, 50.0, wind_walk_m_s, "Random walk of the horizontal wind without gusts";
    "EST_GUST", "m/s", 0.01, 50.0, gust_m_s, "Gusts at the start, rms along an axis; later on they are estimated";
    "EST_GUST_L", "m", 1.0, 100000.0, gust_length_m, "Length of the gusts";
    "EST_ALN_TILT", "deg", 0.1, 45.0, tilt_deg, "Error of roll and pitch after the first alignment";
    "EST_ALN_HEAD", "deg", 0.1, 90.0, heading_deg, "Least error of the heading after the first alignment";
    "EST_MDL_L", "-", 0.001, 1.0, lift_scale, "Error of the lift by the design model, used without vanes or pitot tube";
    "EST_MDL_B", "deg", 0.1, 45.0, model_beta_deg, "Error of the sideslip by the design model, used without vanes";
    "EST_GATE", "-", 1.0, 100.0, gate, "Innovations beyond this many standard deviations are rejected";
    "EST_REOPEN", "s", 0.1, 600.0, reopen_s, "A sensor that was rejected for this long is believed again";
};

/// All tunable gains.
pub fn tunables() -> impl Iterator<Item = &'static Tunable> {
    BLOCKS.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_fit_a_mavlink_parameter_and_are_unique() {
        for (i, tunable) in tunables().enumerate() {
            assert!(tunable.name.len() <= 16, "{}", tunable.name);
            assert!(tunables().take(i).all(|other| other.name != tunable.name), "{}", tunable.name);
        }
    }

    #[test]
    fn each_entry_reads_what_it_writes_and_nothing_else() {
        for tunable in tunables() {
            let mut gains = Gains::REFERENCE;
            (tunable.set)(&mut gains, 0.123_456);
            for other in tunables() {
                let expected = if other.name == tunable.name {
                    0.123_456
                } else {
                    (other.get)(&Gains::REFERENCE)
                };
                assert_eq!(
                    (other.get)(&gains),
                    expected,
                    "{} through {}",
                    other.name,
                    tunable.name
                );
            }
        }
    }
}
