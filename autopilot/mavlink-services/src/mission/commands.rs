//! The commands of plans: their numbers, their names, and those for equipment that is not on board.

use ::mavlink::dialects::common::MavCmd;
use num_traits::FromPrimitive;

/// NAV_WAYPOINT; also the command of guided items.
pub const WAYPOINT: u16 = 16;
pub const LOITER_UNLIMITED: u16 = 17;
pub const LOITER_TURNS: u16 = 18;
pub const LOITER_TIME: u16 = 19;
pub const RETURN: u16 = 20;
pub const LAND: u16 = 21;
pub const TAKEOFF: u16 = 22;
pub const CHANGE_ALTITUDE: u16 = 30;
pub const LOITER_TO_ALTITUDE: u16 = 31;
pub const ARC_WAYPOINT: u16 = 36;
pub const SPLINE_WAYPOINT: u16 = 82;
pub const VTOL_TAKEOFF: u16 = 84;
pub const VTOL_LAND: u16 = 85;
pub const DELAY: u16 = 93;
pub const CONDITION_DELAY: u16 = 112;
pub const CONDITION_DISTANCE: u16 = 114;
pub const CONDITION_YAW: u16 = 115;
pub const JUMP: u16 = 177;
pub const CHANGE_SPEED: u16 = 178;
pub const SET_HOME: u16 = 179;
pub const DO_CHANGE_ALTITUDE: u16 = 186;
pub const RETURN_PATH_START: u16 = 188;
pub const LAND_START: u16 = 189;
pub const FENCE_ENABLE: u16 = 207;
pub const JUMP_TAG: u16 = 600;
pub const DO_JUMP_TAG: u16 = 601;
pub const VTOL_TRANSITION: u16 = 3000;
pub const FENCE_RETURN_POINT: u16 = 5000;
pub const FENCE_POLYGON_INCLUSION: u16 = 5001;
pub const FENCE_POLYGON_EXCLUSION: u16 = 5002;
pub const FENCE_CIRCLE_INCLUSION: u16 = 5003;
pub const FENCE_CIRCLE_EXCLUSION: u16 = 5004;
pub const RALLY_POINT: u16 = 5100;

/// Commands for cameras, gimbals, servos, grippers and other equipment, and for the engine and the autopilots of others. None
/// of them changes the path.
const EQUIPMENT: [u16; 67] = [
    80, 94, 180, 181, 182, 183, 184, 187, 194, 195, 196, 197, 198, 200, 201, 202, 203, 204, 205,
    206, 208, 209, 211, 212, 214, 215, 216, 217, 218, 220, 221, 222, 223, 260, 310, 405, 406, 529,
    530, 531, 532, 533, 534, 1000, 1001, 2000, 2001, 2002, 2003, 2004, 2005, 2010, 2500, 2501,
    2502, 2503, 2504, 2505, 2510, 2511, 2520, 2600, 2800, 10_001, 30_001, 30_002, 42_600,
];

/// Commands of ArduPilot that the common definitions lack.
const OTHERS: [(u16, &str); 7] = [
    (83, "NAV_ALTITUDE_WAIT"),
    (215, "DO_SET_RESUME_REPEAT_DIST"),
    (216, "DO_SPRAYER"),
    (217, "DO_SEND_SCRIPT_MESSAGE"),
    (218, "DO_AUX_FUNCTION"),
    (42_702, "NAV_SCRIPT_TIME"),
    (42_703, "NAV_ATTITUDE_TIME"),
];

/// The command is for equipment that is not on board.
pub fn is_for_equipment(command: u16) -> bool {
    EQUIPMENT.contains(&command)
}

/// Name and number: `NAV_WAYPOINT (16)`.
pub fn named(command: u16) -> String {
    let other = OTHERS.iter().find(|(number, _)| *number == command);
    let common = MavCmd::from_u16(command).map(|known| format!("{known:?}"));
    match other.map(|(_, name)| (*name).to_owned()).or(common) {
        Some(name) => format!("{} ({command})", name.trim_start_matches("MAV_CMD_")),
        None => format!("command {command}"),
    }
}
