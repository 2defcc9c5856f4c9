//! USER_3: starting and stopping scripts.

use super::fields::{flag, word};
use super::{Asking, Decision};
use crate::codec::CommandMessage;
use crate::refused::Refused;
use flight_management::command::ScriptCommand;

/// MAV_CMD_USER_3.
pub const USER_3: u16 = 31_012;

/// USER_3: p1 1 starts the script with the number p2 in the sorted list of files (0: the one that was uploaded last,
/// or the scenario's), p1 0 stops the one that runs.
pub fn order(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [start, number, ..] = command.params;
    if !flag("p1", start)? {
        return Ok(Decision::ask(ScriptCommand::Stop));
    }
    let number = word("p2", number)?.unwrap_or(0);
    let script = asking.ctx.scripts.start(number, asking.ctx.parameters)?;
    Ok(Decision::ask(ScriptCommand::Run(script)))
}
