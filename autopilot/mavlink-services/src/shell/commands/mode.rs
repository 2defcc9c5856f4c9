//! `mode`: the modes there are, and a change of mode by the checks of a mode command.

use flight_management::command::VehicleCommand;
use std::fmt::Write as _;

use super::{Answer, Asking, Order, usage};
use crate::modes;
use flight_management::vehicle::Mode;

pub(super) fn run(arguments: &[&str], asking: &mut Asking) -> Answer {
    match arguments {
        [] => Ok(Order::say(list(asking.ctx.aircraft.mode()))),
        [name] => {
            let mode = Mode::ALL.into_iter().find(|mode| mode.name().eq_ignore_ascii_case(name));
            let mode = mode.ok_or_else(|| {
                let names = Mode::ALL.map(Mode::name).join(", ");
                format!("there is no mode \"{name}\": there are {names}")
            })?;
            let mode = modes::enterable(mode, asking.ctx.streams())
                .map_err(|refused| refused.reason.unwrap_or_default())?;
            Ok(Order::ask(VehicleCommand::Mode(mode), format!("Mode {mode}\n")))
        }
        _ => Err(usage("mode")),
    }
}

fn list(now: Mode) -> String {
    let mut said = String::new();
    for mode in Mode::ALL {
        let mark = if mode == now { '*' } else { ' ' };
        let _ = writeln!(said, "{mark} {mode}");
    }
    said
}
