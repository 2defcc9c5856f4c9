//! The table of tunables: name, unit, range, meaning, and where the value lives in [`Gains`].

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

macro_rules! tunables {
    ($($name:literal, $unit:literal, $min:literal, $max:literal, $($field:ident).+, $meaning:literal;)*) => {
        /// All tunable gains.
        pub const TUNABLES: [Tunable; [$($name),*].len()] = [$(Tunable {
            name: $name,
            unit: $unit,
            min: $min,
            max: $max,
            meaning: $meaning,
            get: |gains| gains.$($field).+,
            set: |gains, value| gains.$($field).+ = value,
        }),*];
    };
}

tunables! {
    "ALT_KQ", "s", 0.01, 20.0, main.altitude.k_q, "Elevator per pitch rate";
    "ALT_KTH", "-", 0.01, 20.0, main.altitude.k_theta, "Elevator per pitch angle";
    "ALT_KHD", "rad s/m", 1.0e-6, 1.0, main.altitude.k_hd, "Elevator per climb rate";
    "ALT_KH", "rad/m", 1.0e-7, 1.0, main.altitude.k_h, "Elevator per altitude error";
    "ALT_KHI", "rad/(m s)", 1.0e-9, 0.1, main.altitude.k_hi, "Elevator rate per altitude error";
    "ALT_ERR_MAX", "m", 1.0, 5000.0, main.altitude.error_max_m, "Largest altitude error that the law sees; sets the climb rate";
    "ALT_SLEW", "m/s", 1.0, 1000.0, main.altitude.slew_m_s, "Slew limit of the altitude reference";
    "ALT_INT_BAND", "m", 1.0, 5000.0, main.altitude.integral_band_m, "Altitude integrator runs below this altitude error";
    "ALT_INT_CLIMB", "m/s", 0.0, 100.0, main.altitude.settled_climb_m_s, "Beyond its band the altitude integrator runs while the climb rate stays below this";
    "ALT_INT_WAIT", "s", 0.1, 600.0, main.altitude.settled_after_s, "Time that the climb rate must have been below ALT_INT_CLIMB";
    "ALT_INT_MAX", "rad", 0.001, 0.5, main.altitude.integral_max_rad, "Largest elevator of the altitude integrator";
    "ALT_KALPHA", "-", 0.0, 100.0, main.altitude.k_alpha, "Elevator per angle of attack beyond the stall onset";
    "ROL_KP", "s", 0.001, 20.0, main.roll.k_p, "Aileron per roll rate";
    "ROL_KPHI", "-", 0.01, 20.0, main.roll.k_phi, "Aileron per roll angle error";
    "ROL_KPHII", "1/s", 1.0e-6, 10.0, main.roll.k_phi_i, "Aileron rate per roll angle error";
    "ROL_INT_MAX", "rad", 0.001, 10.0, main.roll.integral_max_rad, "Largest aileron of the roll integrator";
    "ROL_LAG", "s", 0.01, 10.0, main.roll.reference_lag_s, "Time constant of the lag on the roll reference";
    "YAW_KR", "s", 0.001, 20.0, main.yaw.k_r, "Rudder per yaw rate";
    "SPD_KV", "1/s", 0.001, 10.0, main.speed.k_v, "Acceleration per speed error";
    "SPD_KVI", "1/s^2", 1.0e-6, 10.0, main.speed.k_vi, "Acceleration rate per speed error";
    "OBS_W0", "rad/s", 1.0, 500.0, observer.bandwidth, "Observer bandwidth in the linear zone";
    "OBS_KB", "-", 0.1, 20.0, observer.rate_factor, "Observer beta1 as a multiple of the bandwidth";
    "OBS_WIDTH", "rad/s", 1.0e-5, 10.0, observer.fal_width, "Half width of the linear zone of fal";
    "ACT_LVL_P", "rad/s^2", 0.001, 100.0, activation.level_roll, "Roll level of the estimate that wakes the compensator";
    "ACT_LVL_Q", "rad/s^2", 0.001, 100.0, activation.level_pitch, "Pitch level of the estimate that wakes the compensator";
    "ACT_LVL_R", "rad/s^2", 0.001, 100.0, activation.level_yaw, "Yaw level of the estimate that wakes the compensator";
    "ACT_T_ON", "s", 0.001, 10.0, activation.on_dwell_s, "Time above the level before the compensator wakes";
    "ACT_HYST", "-", 0.01, 0.99, activation.hysteresis, "Release below this fraction of the level";
    "ACT_T_OFF", "s", 0.001, 600.0, activation.off_dwell_s, "Time below the release level before it sleeps again";
    "ACT_FADE", "s", 0.001, 10.0, activation.fade_s, "Time in which the compensation fades in and out";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_fit_a_mavlink_parameter_and_are_unique() {
        for (i, tunable) in TUNABLES.iter().enumerate() {
            assert!(tunable.name.len() <= 16, "{}", tunable.name);
            assert!(
                TUNABLES[..i].iter().all(|other| other.name != tunable.name),
                "{}",
                tunable.name
            );
        }
    }

    #[test]
    fn each_entry_reads_what_it_writes_and_nothing_else() {
        for tunable in &TUNABLES {
            let mut gains = Gains::REFERENCE;
            (tunable.set)(&mut gains, 0.123_456);
            for other in &TUNABLES {
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
