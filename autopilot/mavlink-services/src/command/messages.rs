//! Messages on request, and how often they come.

use super::{Asking, Decision};
use crate::codec::CommandMessage;
use crate::refused::Refused;
use crate::telemetry;

/// REQUEST_MESSAGE: p1 message, p2 what the message says it means.
pub fn request(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [id, index, ..] = command.params;
    show(asking, id, index)
}

/// GET_HOME_POSITION.
pub fn home_position(_: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    show(asking, 242.0, 0.0)
}

/// REQUEST_AUTOPILOT_CAPABILITIES: p1 must be 1.
pub fn capabilities(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    show_if_1(command, asking, 148.0)
}

/// REQUEST_PROTOCOL_VERSION: p1 must be 1.
pub fn protocol_version(
    command: &CommandMessage,
    asking: &mut Asking,
) -> Result<Decision, Refused> {
    show_if_1(command, asking, 300.0)
}

fn show_if_1(command: &CommandMessage, asking: &Asking, id: f32) -> Result<Decision, Refused> {
    if command.params[0] == 1.0 {
        return show(asking, id, 0.0);
    }
    Err(Refused::denied("Refused: nothing was asked for (p1 must be 1)"))
}

fn show(asking: &Asking, id: f32, index: f32) -> Result<Decision, Refused> {
    telemetry::request(asking.ctx, asking.from.peer, asking.now, id, index).map(Decision::show)
}

/// SET_MESSAGE_INTERVAL: p1 message, p2 interval in microseconds, -1 never, 0 as by default.
pub fn set_interval(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [id, interval_us, ..] = command.params;
    asking.ctx.telemetry.set_interval(asking.from.peer, id, interval_us)?;
    Ok(Decision::accept())
}

/// GET_MESSAGE_INTERVAL: p1 message.
pub fn interval(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let message = asking.ctx.telemetry.interval(asking.from.peer, command.params[0])?;
    Ok(Decision::show(vec![message]))
}
