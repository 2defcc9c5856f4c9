//! PX4 parameters that ground stations look for and that have no effect here.
//!
//! The heartbeat says PX4, so QGroundControl asks for them at connect and on every setup page and, where one is
//! missing or zero, warns of missing parameters or an unfinished setup. They are read-only. Each version's list, taken from its
//! source text, is `tests/clients/qgroundcontrol_parameters.csv`. Everything that has an effect is in [`super::table()`].

use super::Kind;

/// Group of the parameters, as ground stations show it.
pub const COMPATIBILITY_GROUP: &str = "Ground station compatibility";

/// One such parameter.
#[derive(Debug, Clone, Copy)]
pub struct CompatibilityParameter {
    /// Name, at most 16 characters.
    pub name: &'static str,
    /// Wire type, as PX4 has it.
    pub kind: Kind,
    /// The only value.
    pub value: f64,
    /// What PX4 calls the value, where it is one of a list; else empty.
    pub label: &'static str,
    /// Who asks for it, and what the value says.
    pub reason: &'static str,
}

/// Rows by page: type, name, value, label of the value (empty for a number), reason.
macro_rules! rows {
    ($($reason:literal: $($kind:ident $name:literal $value:literal $label:literal),+;)*) => {
        &[$($(CompatibilityParameter {
            name: $name,
            kind: Kind::$kind,
            value: $value,
            label: $label,
            reason: $reason,
        }),+),*]
    };
}

/// All of them.
pub const COMPATIBILITY: &[CompatibilityParameter] = rows! {
    "QGroundControl, airframe page: zero would mean that no airframe is chosen":
        Int "SYS_AUTOSTART" 2100.0 "";
    "QGroundControl, airframe page: nothing is configured by itself":
        Int "SYS_AUTOCONFIG" 0.0 "Keep parameters";
    "QGroundControl, sensors page: zero would mean that this sensor is not calibrated":
        Int "CAL_GYRO0_ID" 1.0 "",
        Int "CAL_ACC0_ID" 1.0 "",
        Int "CAL_MAG0_ID" 1.0 "";
    "QGroundControl, sensors page: there is no such compass":
        Int "CAL_MAG1_ID" 0.0 "",
        Int "CAL_MAG2_ID" 0.0 "",
        Int "SYS_HAS_MAG" 0.0 "Disabled";
    "QGroundControl, sensors page: no compass is turned":
        Int "CAL_MAG0_ROT" -1.0 "Internal",
        Int "CAL_MAG1_ROT" -1.0 "Internal",
        Int "CAL_MAG2_ROT" -1.0 "Internal";
    "QGroundControl, sensors page: the board stands along the axes of the body":
        Int "SENS_BOARD_ROT" 0.0 "No rotation",
        Real "SENS_BOARD_X_OFF" 0.0 "",
        Real "SENS_BOARD_Y_OFF" 0.0 "",
        Real "SENS_BOARD_Z_OFF" 0.0 "";
    "QGroundControl, sensors page: the laws use the airspeed":
        Int "FW_ARSP_MODE" 0.0 "Use airspeed in controller";
    "QGroundControl, sensors page: this number asks for no calibration of the airspeed":
        Int "CBRK_AIRSPD_CHK" 162_128.0 "";
    "QGroundControl, sensors page: the airspeed needs no calibration":
        Int "SYS_HAS_NUM_ASPD" 0.0 "",
        Real "SENS_DPRES_OFF" 0.0 "";
    "QGroundControl, radio page: no radio setup, joystick instead":
        Int "COM_RC_IN_MODE" 1.0 "Joystick only";
    "QGroundControl, radio page: there is no radio":
        Int "RC_MAP_ROLL" 0.0 "Unassigned",
        Int "RC_MAP_PITCH" 0.0 "Unassigned",
        Int "RC_MAP_YAW" 0.0 "Unassigned",
        Int "RC_MAP_THROTTLE" 0.0 "Unassigned",
        Int "RC_MAP_FLAPS" 0.0 "Unassigned",
        Int "RC_MAP_AUX1" 0.0 "Unassigned",
        Int "RC_MAP_AUX2" 0.0 "Unassigned",
        Int "RC_MAP_PARAM1" 0.0 "Unassigned",
        Int "RC_MAP_PARAM2" 0.0 "Unassigned",
        Int "RC_MAP_PARAM3" 0.0 "Unassigned";
    "QGroundControl, flight modes page: there is no radio and no such switch":
        Int "RC_MAP_ARM_SW" 0.0 "Unassigned",
        Int "RC_MAP_GEAR_SW" 0.0 "Unassigned",
        Int "RC_MAP_KILL_SW" 0.0 "Unassigned",
        Int "RC_MAP_LOITER_SW" 0.0 "Unassigned",
        Int "RC_MAP_OFFB_SW" 0.0 "Unassigned",
        Int "RC_MAP_RETURN_SW" 0.0 "Unassigned",
        Real "RC_ARMSWITCH_TH" 0.75 "",
        Real "RC_GEAR_TH" 0.75 "",
        Real "RC_KILLSWITCH_TH" 0.75 "",
        Real "RC_LOITER_TH" 0.75 "",
        Real "RC_OFFB_TH" 0.75 "",
        Real "RC_RETURN_TH" 0.75 "";
    "QGroundControl, power page: the supply is one that is always full (7 cells of 4.05 V), as BATTERY_STATUS reports it":
        Int "BAT1_SOURCE" 1.0 "External",
        Int "BAT1_N_CELLS" 7.0 "7 Cells",
        Real "BAT1_V_CHARGED" 4.05 "",
        Real "BAT1_V_EMPTY" 3.6 "",
        Real "BAT1_V_LOAD_DROP" 0.0 "";
    "QGroundControl, safety page: the supply never runs low":
        Int "COM_LOW_BAT_ACT" 0.0 "Warning",
        Real "BAT_LOW_THR" 0.15 "",
        Real "BAT_CRIT_THR" 0.07 "",
        Real "BAT_EMERGEN_THR" 0.05 "";
    "QGroundControl, safety page: there is no geofence":
        Int "GF_ACTION" 0.0 "None",
        Real "GF_MAX_HOR_DIST" 0.0 "",
        Real "GF_MAX_VER_DIST" 0.0 "";
    "QGroundControl, safety page: no obstacle is seen":
        Int "COM_OBS_AVOID" 0.0 "Disabled",
        Real "CP_DIST" -1.0 "";
    "QGroundControl, safety page: Return circles over home and does not land":
        Real "RTL_LAND_DELAY" -1.0 "";
    "QGroundControl, safety page: Return stays at RTL_RETURN_ALT, this is the altitude that it has by default":
        Real "RTL_DESCEND_ALT" 5_000.0 "";
    "QGroundControl, safety page: the aircraft does not land, so it is never disarmed by itself":
        Real "COM_DISARM_LAND" -1.0 "";
    "QGroundControl, safety page: the flight log runs from the first to the last moment":
        Int "SDLOG_MODE" 2.0 "from boot until shutdown";
    "QGroundControl, tuning page: PX4's default of a gain; the gains of these laws are in their own groups":
        Real "FW_R_TC" 0.4 "",
        Real "FW_P_TC" 0.4 "",
        Real "FW_RR_P" 0.05 "",
        Real "FW_RR_I" 0.1 "",
        Real "FW_RR_D" 0.0 "",
        Real "FW_RR_FF" 0.5 "",
        Real "FW_PR_P" 0.08 "",
        Real "FW_PR_I" 0.1 "",
        Real "FW_PR_D" 0.0 "",
        Real "FW_PR_FF" 0.5 "",
        Real "FW_YR_P" 0.05 "",
        Real "FW_YR_I" 0.1 "",
        Real "FW_YR_D" 0.0 "",
        Real "FW_YR_FF" 0.3 "",
        Real "FW_RLL_TO_YAW_FF" 0.0 "",
        Real "FW_T_HRATE_FF" 0.3 "";
    "MAVSDK reads it: a flight begins in the air":
        Real "MIS_TAKEOFF_ALT" 100.0 "";
};

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
    fn none_of_them_hides_a_parameter_that_has_an_effect() {
        for row in COMPATIBILITY {
            assert!(row.name.len() <= 16, "{}", row.name);
            assert!(table().iter().all(|real| real.name != row.name), "{}", row.name);
            let same = COMPATIBILITY.iter().filter(|other| other.name == row.name).count();
            assert_eq!(same, 1, "{}", row.name);
        }
    }
}
