//! PX4 parameters that ground stations look for and that mean nothing here.
//!
//! The heartbeat says PX4, so QGroundControl asks for them at connect and, where one is missing or zero,
//! warns of missing parameters or an unfinished setup. They are read-only. Everything that means something
//! is in [`super::table()`].

use super::Kind;

/// One such parameter.
#[derive(Debug, Clone, Copy)]
pub struct CompatibilityParameter {
    /// Name, at most 16 characters.
    pub name: &'static str,
    /// Wire type.
    pub kind: Kind,
    /// The only value.
    pub value: f64,
    /// Who wants it, and what for.
    pub reason: &'static str,
}

const fn int(name: &'static str, value: i32, reason: &'static str) -> CompatibilityParameter {
    CompatibilityParameter { name, kind: Kind::Int, value: value as f64, reason }
}

const fn real(name: &'static str, value: f64, reason: &'static str) -> CompatibilityParameter {
    CompatibilityParameter { name, kind: Kind::Real, value, reason }
}

/// All of them.
pub const COMPATIBILITY: [CompatibilityParameter; 20] = [
    int("SYS_AUTOSTART", 2100, "QGroundControl: zero means that no airframe is chosen"),
    int("CAL_GYRO0_ID", 1, "QGroundControl: zero means that the gyros are not calibrated"),
    int("CAL_ACC0_ID", 1, "QGroundControl: zero means that the accelerometers are not calibrated"),
    int("CAL_MAG0_ID", 1, "QGroundControl: zero means that the compass is not calibrated"),
    int("SYS_HAS_MAG", 0, "QGroundControl: asks for no compass setup"),
    int("SYS_HAS_NUM_ASPD", 0, "QGroundControl: asks for no airspeed setup"),
    int("COM_RC_IN_MODE", 1, "QGroundControl: no radio setup, joystick instead"),
    int("COM_LOW_BAT_ACT", 0, "QGroundControl, safety page: there is no battery"),
    real("BAT_LOW_THR", 0.15, "QGroundControl, safety page: there is no battery"),
    real("BAT_CRIT_THR", 0.07, "QGroundControl, safety page: there is no battery"),
    real("BAT_EMERGEN_THR", 0.05, "QGroundControl, safety page: there is no battery"),
    int("GF_ACTION", 0, "QGroundControl, safety page: there is no geofence"),
    real("GF_MAX_HOR_DIST", 0.0, "QGroundControl, safety page: there is no geofence"),
    real("GF_MAX_VER_DIST", 0.0, "QGroundControl, safety page: there is no geofence"),
    int("RC_MAP_FLTMODE", 0, "QGroundControl, flight mode page: there is no radio"),
    int("RC_MAP_ROLL", 0, "QGroundControl, summary page: there is no radio"),
    int("RC_MAP_PITCH", 0, "QGroundControl, summary page: there is no radio"),
    int("RC_MAP_YAW", 0, "QGroundControl, summary page: there is no radio"),
    int("RC_MAP_THROTTLE", 0, "QGroundControl, summary page: there is no radio"),
    real("MIS_TAKEOFF_ALT", 100.0, "MAVSDK reads it: a flight begins in the air"),
];

/// The one with this name.
#[must_use]
pub fn compatibility(name: &str) -> Option<&'static CompatibilityParameter> {
    COMPATIBILITY.iter().find(|row| row.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::table;

    #[test]
    fn none_of_them_hides_a_parameter_that_means_something() {
        for row in &COMPATIBILITY {
            assert!(row.name.len() <= 16, "{}", row.name);
            assert!(table().iter().all(|real| real.name != row.name), "{}", row.name);
            let same = COMPATIBILITY.iter().filter(|other| other.name == row.name).count();
            assert_eq!(same, 1, "{}", row.name);
        }
    }
}
