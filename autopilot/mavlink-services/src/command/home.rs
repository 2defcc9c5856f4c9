//! Where home is.

use super::fields::{flag, number, place};
use super::{Asking, Decision};
use crate::codec::CommandMessage;
use crate::refused::Refused;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Place;

/// DO_SET_HOME: p1 1 for below the aircraft, 0 for p5 and p6. Home is on the ground, whatever p7 says.
pub fn set_home(command: &CommandMessage, asking: &mut Asking) -> Result<Decision, Refused> {
    let [here, _, _, _, _, _, altitude] = command.params;
    if flag("p1", here)? {
        let state = asking.ctx.aircraft.snapshot();
        let state = state.ok_or_else(|| Refused::for_now("Home refused: no position yet"))?;
        return Ok(Decision::ask(VehicleCommand::Home(Place::of(state.motion()))));
    }
    let altitude = number("altitude p7", altitude)?;
    let place = place(command)?
        .ok_or_else(|| Refused::denied("Home refused: no latitude and longitude (p5, p6)"))?;
    let note = altitude
        .filter(|altitude| *altitude != 0.0)
        .map(|altitude| format!("Home is on the ground at altitude 0 m: {altitude} m is not used"));
    Ok(Decision::ask(VehicleCommand::Home(place)).noting(note))
}
