//! PX4 parameters that ground stations look for and that have no effect here.
//!
//! The heartbeat says PX4, so QGroundControl requests them at connect and on every setup page and, where one is
//! missing or zero, warns of missing parameters or an unfinished setup. They are read-only. Each version's list, taken from its
//! source text, is `tests/clients/qgroundcontrol_parameters.csv`. Every parameter with an effect is in [`super::table()`].

use super::{Kind, Parameter, Parameters, table};

/// Group of the parameters, as ground stations show it.
pub const COMPATIBILITY_GROUP: &str = "Compatibility";

/// One such parameter.
#[derive(Debug, Clone, Copy)]
pub struct CompatibilityParameter {
    /// Name, at most 16 characters.
    pub name: &'static str,
    /// Wire type, as PX4 has it.
    pub kind: Kind,
    /// Title, in a few words: QGroundControl prints it as the label of some of its setup pages.
    pub title: &'static str,
    /// The only value, where it stands for nothing here.
    pub value: f64,
    /// The parameter here that it is another name of; else empty.
    pub stands_for: &'static str,
    /// PX4's name of the value, if it is one of a list; else empty.
    pub label: &'static str,
    /// Clients that request it, and the meaning of the value.
    pub reason: &'static str,
}

impl CompatibilityParameter {
    /// The parameter that it is another name of.
    pub fn meant(&self) -> Option<&'static Parameter> {
        table().iter().find(|row| row.name == self.stands_for)
    }

    /// Its value in a set of parameters.
    pub fn value_in(&self, parameters: &Parameters) -> f64 {
        self.meant().map_or(self.value, |row| row.value(parameters))
    }
}

/// Rows by page: type, name, value, label of the value (empty for a number), title, then the parameter that it stands for.
macro_rules! rows {
    ($($reason:literal: $($kind:ident $name:literal $value:literal $label:literal $title:literal $($own:literal)?),+;)*) => {
        &[$($(CompatibilityParameter {
            name: $name,
            kind: Kind::$kind,
            title: $title,
            value: $value,
            stands_for: [$($own,)? ""][0],
            label: $label,
            reason: $reason,
        }),+),*]
    };
}

/// All of them.
pub const COMPATIBILITY: &[CompatibilityParameter] = rows! {
    "QGroundControl, airframe page: zero would mean that no airframe is chosen":
        Int "SYS_AUTOSTART" 2100.0 "" "Airframe number";
    "QGroundControl, airframe page: nothing is configured by itself":
        Int "SYS_AUTOCONFIG" 0.0 "Keep parameters" "Automatic configuration";
    "QGroundControl, sensors page: zero would mean that this sensor is not calibrated":
        Int "CAL_GYRO0_ID" 1.0 "" "Gyro 1 device",
        Int "CAL_ACC0_ID" 1.0 "" "Accelerometer 1 device",
        Int "CAL_MAG0_ID" 1.0 "" "Compass 1 device";
    "QGroundControl, sensors page: there is no such compass":
        Int "CAL_MAG1_ID" 0.0 "" "Compass 2 device",
        Int "CAL_MAG2_ID" 0.0 "" "Compass 3 device",
        Int "SYS_HAS_MAG" 0.0 "Disabled" "Compass fitted";
    "QGroundControl, sensors page: no compass is turned":
        Int "CAL_MAG0_ROT" -1.0 "Internal" "Compass 1 rotation",
        Int "CAL_MAG1_ROT" -1.0 "Internal" "Compass 2 rotation",
        Int "CAL_MAG2_ROT" -1.0 "Internal" "Compass 3 rotation";
    "QGroundControl, sensors page: the board stands along the axes of the body":
        Int "SENS_BOARD_ROT" 0.0 "No rotation" "Board rotation",
        Real "SENS_BOARD_X_OFF" 0.0 "" "Board roll offset",
        Real "SENS_BOARD_Y_OFF" 0.0 "" "Board pitch offset",
        Real "SENS_BOARD_Z_OFF" 0.0 "" "Board yaw offset";
    "QGroundControl, sensors page: the laws use the airspeed":
        Int "FW_ARSP_MODE" 0.0 "Use airspeed in controller" "Airspeed use";
    "QGroundControl, sensors page: this number asks for no calibration of the airspeed":
        Int "CBRK_AIRSPD_CHK" 162_128.0 "" "Airspeed check off";
    "QGroundControl, sensors page: the airspeed needs no calibration":
        Int "SYS_HAS_NUM_ASPD" 0.0 "" "Airspeed sensors to calibrate",
        Real "SENS_DPRES_OFF" 0.0 "" "Differential pressure offset";
    "QGroundControl, radio page: no radio setup, joystick instead":
        Int "COM_RC_IN_MODE" 1.0 "Joystick only" "Source of pilot input";
    "QGroundControl, radio page: there is no radio":
        Int "RC_MAP_ROLL" 0.0 "Unassigned" "Roll channel",
        Int "RC_MAP_PITCH" 0.0 "Unassigned" "Pitch channel",
        Int "RC_MAP_YAW" 0.0 "Unassigned" "Yaw channel",
        Int "RC_MAP_THROTTLE" 0.0 "Unassigned" "Throttle channel",
        Int "RC_MAP_FLAPS" 0.0 "Unassigned" "Flaps channel",
        Int "RC_MAP_AUX1" 0.0 "Unassigned" "AUX1 channel",
        Int "RC_MAP_AUX2" 0.0 "Unassigned" "AUX2 channel",
        Int "RC_MAP_PARAM1" 0.0 "Unassigned" "Parameter 1 channel",
        Int "RC_MAP_PARAM2" 0.0 "Unassigned" "Parameter 2 channel",
        Int "RC_MAP_PARAM3" 0.0 "Unassigned" "Parameter 3 channel";
    "QGroundControl, flight modes page: there is no radio and no such switch":
        Int "RC_MAP_ARM_SW" 0.0 "Unassigned" "Arm switch channel",
        Int "RC_MAP_GEAR_SW" 0.0 "Unassigned" "Landing gear switch channel",
        Int "RC_MAP_KILL_SW" 0.0 "Unassigned" "Emergency stop switch channel",
        Int "RC_MAP_LOITER_SW" 0.0 "Unassigned" "Hold switch channel",
        Int "RC_MAP_OFFB_SW" 0.0 "Unassigned" "Offboard switch channel",
        Int "RC_MAP_RETURN_SW" 0.0 "Unassigned" "Return switch channel",
        Real "RC_ARMSWITCH_TH" 0.75 "" "Arm switch threshold",
        Real "RC_GEAR_TH" 0.75 "" "Landing gear switch threshold",
        Real "RC_KILLSWITCH_TH" 0.75 "" "Emergency stop switch threshold",
        Real "RC_LOITER_TH" 0.75 "" "Hold switch threshold",
        Real "RC_OFFB_TH" 0.75 "" "Offboard switch threshold",
        Real "RC_RETURN_TH" 0.75 "" "Return switch threshold";
    "QGroundControl, power page: the supply is one that is always full (7 cells of 4.05 V), as BATTERY_STATUS reports it":
        Int "BAT1_SOURCE" 1.0 "External" "Battery data source",
        Int "BAT1_N_CELLS" 7.0 "7 Cells" "Cells in series",
        Real "BAT1_V_CHARGED" 4.05 "" "Full cell voltage",
        Real "BAT1_V_EMPTY" 3.6 "" "Empty cell voltage",
        Real "BAT1_V_LOAD_DROP" 0.0 "" "Voltage drop per cell at full throttle";
    "QGroundControl, safety page: there is no fence around home":
        Real "GF_MAX_HOR_DIST" 0.0 "" "Geofence radius";
    "QGroundControl, safety page: no obstacle is seen":
        Int "COM_OBS_AVOID" 0.0 "Disabled" "Obstacle avoidance",
        Real "CP_DIST" -1.0 "" "Collision prevention distance";
    "QGroundControl, safety page: Return circles over home, or lands at once where the aircraft took off":
        Real "RTL_LAND_DELAY" -1.0 "" "Return: time until landing";
    "QGroundControl, safety page: Return stays at RTL_RETURN_ALT, this is the altitude that it has by default":
        Real "RTL_DESCEND_ALT" 5_000.0 "" "Return: loiter altitude";
    "QGroundControl, safety page: an aircraft that has landed disarms itself 2 s after it has stopped":
        Real "COM_DISARM_LAND" 2.0 "" "Time from landing to disarming";
    "QGroundControl, safety page: the flight log runs from the first to the last moment":
        Int "SDLOG_MODE" 2.0 "from boot until shutdown" "Logging mode";
    "QGroundControl, tuning page: a second name of this gain of the PID, in its unit":
        Real "FW_RR_P" 0.0 "" "Roll rate P gain" "ROL_KP",
        Real "FW_PR_P" 0.0 "" "Pitch rate P gain" "ALT_KQ",
        Real "FW_YR_P" 0.0 "" "Yaw rate P gain" "YAW_KR";
    "QGroundControl, tuning page: PX4's default of a gain that these laws do not have":
        Real "FW_R_TC" 0.4 "" "Roll time constant",
        Real "FW_P_TC" 0.4 "" "Pitch time constant",
        Real "FW_RR_I" 0.1 "" "Roll rate I gain",
        Real "FW_RR_D" 0.0 "" "Roll rate D gain",
        Real "FW_RR_FF" 0.5 "" "Roll rate feed-forward",
        Real "FW_PR_I" 0.1 "" "Pitch rate I gain",
        Real "FW_PR_D" 0.0 "" "Pitch rate D gain",
        Real "FW_PR_FF" 0.5 "" "Pitch rate feed-forward",
        Real "FW_YR_I" 0.1 "" "Yaw rate I gain",
        Real "FW_YR_D" 0.0 "" "Yaw rate D gain",
        Real "FW_YR_FF" 0.3 "" "Yaw rate feed-forward",
        Real "FW_RLL_TO_YAW_FF" 0.0 "" "Roll to yaw feed-forward",
        Real "FW_T_HRATE_FF" 0.3 "" "Climb rate feed-forward";
};

/// The one with this name.
pub fn compatibility(name: &str) -> Option<&'static CompatibilityParameter> {
    COMPATIBILITY.iter().find(|row| row.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::table;

    #[test]
    fn none_of_them_hides_a_parameter_that_has_an_effect() {
        for row in COMPATIBILITY {
            assert!(row.name.len() <= 16, "{}", row.name);
            assert!(!row.title.is_empty(), "{}", row.name);
            assert!(table().iter().all(|real| real.name != row.name), "{}", row.name);
            let same = COMPATIBILITY.iter().filter(|other| other.name == row.name).count();
            assert_eq!(same, 1, "{}", row.name);
            assert_eq!(row.meant().is_some(), !row.stands_for.is_empty(), "{}", row.name);
        }
    }

    #[test]
    fn the_gains_of_the_tuning_page_are_those_of_the_law() {
        let mut parameters = Parameters::default();
        for (name, meant) in [("FW_RR_P", "ROL_KP"), ("FW_PR_P", "ALT_KQ"), ("FW_YR_P", "YAW_KR")] {
            let value = |parameters: &Parameters| {
                let row = table().iter().find(|row| row.name == meant).unwrap();
                assert_eq!(
                    compatibility(name).unwrap().value_in(parameters),
                    row.value(parameters)
                );
                row.value(parameters)
            };
            let changed = 1.25 * value(&parameters);
            parameters.set(name, changed).unwrap();
            assert_eq!(value(&parameters), changed, "{name}");
        }
    }
}
