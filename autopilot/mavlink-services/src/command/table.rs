//! Which command does what. PREFLIGHT_STORAGE belongs to the parameters ([`crate::param`]).

use ::mavlink::dialects::common::MavResult;

use super::{
    Asking, Decision, home, messages, mission, places, references, script, simulation, state,
};
use crate::codec::CommandMessage;
use crate::failure;
use crate::refused::Refused;

type Rule = fn(&CommandMessage, &mut Asking) -> Result<Decision, Refused>;

/// Number of each command (MAV_CMD), its name and its rule.
const RULES: [(u16, &str, Rule); 34] = [
    (17, "NAV_LOITER_UNLIM", places::loiter),
    (20, "NAV_RETURN_TO_LAUNCH", state::return_home),
    (21, "NAV_LAND", state::land),
    (22, "NAV_TAKEOFF", state::take_off),
    (31, "NAV_LOITER_TO_ALT", places::loiter_to_altitude),
    (34, "DO_ORBIT", places::orbit),
    (176, "DO_SET_MODE", state::set_mode),
    (178, "DO_CHANGE_SPEED", references::change_speed),
    (179, "DO_SET_HOME", home::set_home),
    (185, "DO_FLIGHTTERMINATION", state::terminate),
    (186, "DO_CHANGE_ALTITUDE", references::change_altitude),
    (189, "DO_LAND_START", state::land),
    (192, "DO_REPOSITION", places::reposition),
    (193, "DO_PAUSE_CONTINUE", places::pause_or_continue),
    (224, "DO_SET_MISSION_CURRENT", mission::set_current),
    (241, "PREFLIGHT_CALIBRATION", state::calibrate),
    (246, "PREFLIGHT_REBOOT_SHUTDOWN", simulation::restart),
    (262, "DO_SET_STANDARD_MODE", state::set_standard_mode),
    (300, "MISSION_START", mission::start),
    (400, "COMPONENT_ARM_DISARM", state::arm_or_disarm),
    (401, "RUN_PREARM_CHECKS", state::prearm_checks),
    (410, "GET_HOME_POSITION", messages::home_position),
    (failure::INJECT_FAILURE, "INJECT_FAILURE", simulation::fault),
    (510, "GET_MESSAGE_INTERVAL", messages::interval),
    (511, "SET_MESSAGE_INTERVAL", messages::set_interval),
    (512, "REQUEST_MESSAGE", messages::request),
    (519, "REQUEST_PROTOCOL_VERSION", messages::protocol_version),
    (520, "REQUEST_AUTOPILOT_CAPABILITIES", messages::capabilities),
    (failure::USER_1, "USER_1", simulation::fault),
    (simulation::USER_2, "USER_2", simulation::pace),
    (script::USER_3, "USER_3", script::order),
    (43_000, "GUIDED_CHANGE_SPEED", references::guided_speed),
    (43_001, "GUIDED_CHANGE_ALTITUDE", references::guided_altitude),
    (43_002, "GUIDED_CHANGE_HEADING", references::guided_heading),
];

/// What a command comes to.
pub(super) fn decide(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    match RULES.iter().find(|(id, ..)| *id == command.id) {
        Some((.., rule)) => rule(command, asking),
        None => Err(Refused::silent(MavResult::MAV_RESULT_UNSUPPORTED)),
    }
}

/// Number and name of each command that is understood.
pub fn known() -> impl Iterator<Item = (u16, &'static str)> {
    RULES.iter().map(|(id, name, _)| (*id, *name))
}
