//! Faults, a new flight, the pace of the simulation, and scripts.

use ::mavlink::dialects::common::MavResult;
use icd::fault::PlantAction;
use icd::pace::Pace;

use crate::codec::{CommandError, CommandMessage};
use crate::command::fields::{byte, flag, number, word};
use crate::command::{Caller, Decision};
use crate::failure;
use flight_management::command::ScriptCommand;

/// p1 of USER_2 for a step.
const STEP: u8 = 2;

/// INJECT_FAILURE and USER_1.
pub fn fault(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    if command.id == failure::USER_1 && command.frame.is_some() {
        // In a COMMAND_INT the values would be scaled integers.
        return Err(CommandError::without_text(MavResult::MAV_RESULT_COMMAND_LONG_ONLY));
    }
    let requests = failure::requests(command, &caller.shared.parameters, &caller.shared.model)?;
    let intents = requests.into_iter().map(|request| PlantAction::Fault(request).into()).collect();
    Ok(Decision { intents, ..Decision::default() })
}

/// PREFLIGHT_REBOOT_SHUTDOWN: p1 1 restarts the flight.
pub fn restart(command: &CommandMessage, _: &mut Caller) -> Result<Decision, CommandError> {
    match byte("p1", command.params[0])? {
        0 => Ok(Decision::accept()),
        1 => Ok(Decision::pass_on(PlantAction::Restart)),
        _ => Err(CommandError::denied("Refused: only p1 = 1, start the flight anew")),
    }
}

/// MAV_CMD_USER_2.
pub const USER_2: u16 = 31_011;

/// A step with a number from its sender (p3), by which a repeated copy is recognized.
pub fn is_numbered_step(command: &CommandMessage) -> bool {
    let [action, _, number, ..] = command.params;
    command.id == USER_2 && action == f32::from(STEP) && !number.is_nan() && number != 0.0
}

/// USER_2: p1 0 pause, 1 run, 2 step by p2 control periods (1 without p2), 3 p2 times as fast as wall
/// time, which does not end a pause. p3 may number a step: a step with the number of the one before it is not
/// executed again.
pub fn pace(command: &CommandMessage, _: &mut Caller) -> Result<Decision, CommandError> {
    let [action, value, ..] = command.params;
    let value = number("p2", value)?;
    let pace = match byte("p1", action)? {
        0 => Pace::Pause,
        1 => Pace::Run,
        STEP => Pace::Step(periods(value)?),
        3 => Pace::Speed(value.unwrap_or(0.0)),
        other => {
            return Err(CommandError::denied(format!(
                "Pace refused: p1 = {other} is not 0 pause, 1 run, 2 step or 3 speed"
            )));
        }
    };
    if !pace.is_valid() {
        let (slowest, fastest) = Pace::SPEED;
        return Err(CommandError::denied(format!(
            "Pace refused: p2 is outside {slowest} to {fastest} times wall time"
        )));
    }
    Ok(Decision::pass_on(PlantAction::Pace(pace)))
}

/// Number of whole periods; one if not given.
fn periods(value: Option<f64>) -> Result<u32, CommandError> {
    let periods = value.filter(|periods| *periods != 0.0).unwrap_or(1.0);
    if periods.fract() == 0.0 && (1.0..=f64::from(Pace::STEPS_MAX)).contains(&periods) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as just checked"
        )]
        return Ok(periods as u32);
    }
    Err(CommandError::denied(format!(
        "Pace refused: p2 = {periods} is no whole number of 1 to {} periods",
        Pace::STEPS_MAX
    )))
}

/// MAV_CMD_USER_3.
pub const USER_3: u16 = 31_012;

/// USER_3: p1 1 starts the script with the number p2 in the sorted list of files (0: the latest upload,
/// or the scenario's), p1 0 stops the running one.
pub fn script(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    let [start, number, ..] = command.params;
    if !flag("p1", start)? {
        return Ok(Decision::pass_on(ScriptCommand::Stop));
    }
    let number = word("p2", number)?.unwrap_or(0);
    let script = caller.shared.scripts.start(number, &caller.shared.parameters)?;
    Ok(Decision::pass_on(ScriptCommand::Run(script)))
}
