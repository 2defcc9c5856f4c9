//! Messages on request, and message intervals.

use super::{Caller, Decision};
use crate::codec::{CommandError, CommandMessage};
use crate::telemetry;

/// REQUEST_MESSAGE: p1 message, p2 as the message defines it.
pub fn request(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    let [id, index, ..] = command.params;
    show(caller, id, index)
}

pub fn home_position(_: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    show(caller, 242.0, 0.0)
}

/// REQUEST_AUTOPILOT_CAPABILITIES: p1 must be 1.
pub fn capabilities(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    show_if_1(command, caller, 148.0)
}

/// REQUEST_PROTOCOL_VERSION: p1 must be 1.
pub fn protocol_version(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    show_if_1(command, caller, 300.0)
}

fn show_if_1(command: &CommandMessage, caller: &Caller, id: f32) -> Result<Decision, CommandError> {
    if command.params[0] == 1.0 {
        return show(caller, id, 0.0);
    }
    Err(CommandError::denied("Refused: nothing was asked for (p1 must be 1)"))
}

fn show(caller: &Caller, id: f32, index: f32) -> Result<Decision, CommandError> {
    telemetry::request(caller.shared, caller.from.peer, caller.now, id, index).map(Decision::answer)
}

/// SET_MESSAGE_INTERVAL: p1 message, p2 interval in microseconds, -1 never, 0 as by default.
pub fn set_interval(
    command: &CommandMessage,
    caller: &mut Caller,
) -> Result<Decision, CommandError> {
    let [id, interval_us, ..] = command.params;
    caller.shared.rates.set_interval(caller.from.peer, id, interval_us)?;
    Ok(Decision::accept())
}

/// GET_MESSAGE_INTERVAL: p1 message.
pub fn interval(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    let message = caller.shared.rates.interval(caller.from.peer, command.params[0])?;
    Ok(Decision::answer(vec![message]))
}
