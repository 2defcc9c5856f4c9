//! Modes, arming, the end of a flight, and commands that do not apply to a jet in flight.

use ::mavlink::dialects::common::MavResult;

use crate::aircraft::{Aircraft, Phase};
use crate::codec::{CommandError, CommandMessage};
use crate::command::fields::{byte, flag};
use crate::command::{Caller, Decision, check_not_over};
use crate::modes;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::{Mode, VehicleRefusal};

/// p2 of COMPONENT_ARM_DISARM that forces it: a forced disarm in the air ends the flight.
const FORCE: f32 = 21_196.0;

/// QGroundControl offers this command as *Reboot Vehicle*.
const RESTART: &str = "reboot the vehicle";

/// DO_SET_MODE: p1 base mode, p2 main mode, p3 sub mode.
pub fn set_mode(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    check_not_over(caller.shared)?;
    let [base, main, sub, ..] = command.params;
    let has_custom_flag = byte("base mode p1", base)? & 1 != 0;
    let main = byte("main mode p2", main)?;
    // A main mode without sub modes needs no sub mode.
    let sub = if sub.is_nan() { 0 } else { byte("sub mode p3", sub)? };
    let mode = modes::requested(has_custom_flag, main, sub, caller.shared.streams)?;
    Ok(Decision::pass_on(VehicleCommand::Mode(mode)))
}

/// DO_SET_STANDARD_MODE: p1 MAV_STANDARD_MODE.
pub fn set_standard_mode(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let standard_mode = byte("standard mode p1", command.params[0])?;
    let mode = modes::requested_standard(standard_mode, caller.shared.streams)?;
    Ok(Decision::pass_on(VehicleCommand::Mode(mode)))
}

pub fn return_home(_: &CommandMessage, _: &mut Caller) -> Result<Decision, CommandError> {
    Ok(Decision::pass_on(VehicleCommand::Mode(Mode::Return)))
}

/// COMPONENT_ARM_DISARM: p1 1 arms, 0 disarms, p2 21196 also in the air.
pub fn arm_or_disarm(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [arm, force, ..] = command.params;
    let aircraft = &caller.shared.aircraft;
    if flag("p1", arm)? {
        return match not_ready(aircraft) {
            None => Ok(Decision::accept()),
            Some(reason) => Err(CommandError::temporary(format!("PreArm: {reason}"))),
        };
    }
    match aircraft.phase() {
        Phase::OnGround | Phase::NoFlight => Ok(Decision::accept()),
        Phase::Flying | Phase::Lost if force == FORCE => {
            Ok(Decision::pass_on(VehicleCommand::Terminate)
                .with_note("Disarmed by force in the air: the flight is terminated".to_owned()))
        }
        Phase::Flying | Phase::Lost => Err(CommandError::temporary(
            "Disarming refused: the aircraft is in the air (p2 = 21196 terminates the flight)",
        )),
    }
}

/// Obstacles to arming and flying.
fn not_ready(aircraft: &Aircraft) -> Option<String> {
    match aircraft.phase() {
        Phase::Flying if aircraft.is_terminated() => Some(format!("flight terminated, {RESTART}")),
        Phase::Flying => None,
        Phase::OnGround => Some(VehicleRefusal::FlightOver.to_string()),
        Phase::NoFlight => Some("no aircraft is connected".into()),
        Phase::Lost => Some("the plant link is lost".into()),
    }
}

/// RUN_PREARM_CHECKS. An armed aircraft must answer "temporarily rejected".
/// QGroundControl sends it at each connect, so the text is not a warning.
pub fn prearm_checks(_: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    match not_ready(&caller.shared.aircraft) {
        None => {
            let text = "No check: the aircraft is armed and in the air";
            caller.shared.texts.inform(caller.now, text);
            Err(CommandError::without_text(MavResult::MAV_RESULT_TEMPORARILY_REJECTED))
        }
        Some(reason) => Ok(Decision::accept().with_note(format!("PreArm: {reason}"))),
    }
}

/// PREFLIGHT_CALIBRATION: all zero stops a calibration, as QGroundControl does when its radio page opens. No
/// calibration ever runs, so stopping succeeds; starting one is refused, since nothing can be calibrated.
pub fn calibrate(command: &CommandMessage, _: &mut Caller) -> Result<Decision, CommandError> {
    if command.params.iter().all(|param| *param == 0.0) {
        return Ok(Decision::accept());
    }
    Err(CommandError::unsupported("Calibration refused: the sensors need none"))
}

/// DO_FLIGHTTERMINATION: p1 above 0.5 terminates; the protocol requires FAILED for anything less.
pub fn terminate(command: &CommandMessage, _: &mut Caller) -> Result<Decision, CommandError> {
    let [terminate, ..] = command.params;
    if !terminate.is_finite() {
        return Err(CommandError::denied("Termination refused: p1 is not finite"));
    }
    if terminate > 0.5 {
        return Ok(Decision::pass_on(VehicleCommand::Terminate));
    }
    Err(CommandError::failed("Not terminated: p1 is not above 0.5"))
}

/// NAV_TAKEOFF: a flight begins in the air.
pub fn take_off(_: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    check_not_over(caller.shared)?;
    let reason = match not_ready(&caller.shared.aircraft) {
        None => "the aircraft is in the air already".to_owned(),
        Some(reason) => reason,
    };
    Err(CommandError::temporary(format!("Takeoff refused: {reason}")))
}

/// NAV_LAND, DO_LAND_START.
pub fn land(_: &CommandMessage, _: &mut Caller) -> Result<Decision, CommandError> {
    Err(CommandError::unsupported(
        "Landing refused: this aircraft has no landing gear and no runway",
    ))
}
