//! `pause`, `run`, `step` and `speed`: how simulation time passes.

use icd::fault::PlantAction;
use icd::pace::Pace;

use super::{Answer, Asking, Order, number, usage};

pub(super) fn pause(arguments: &[&str], _: &mut Asking) -> Answer {
    match arguments {
        [] => Ok(Order::ask(PlantAction::Pace(Pace::Pause), "Simulation paused\n")),
        _ => Err(usage("pause")),
    }
}

pub(super) fn run(arguments: &[&str], _: &mut Asking) -> Answer {
    match arguments {
        [] => Ok(Order::ask(PlantAction::Pace(Pace::Run), "Simulation runs\n")),
        _ => Err(usage("run")),
    }
}

pub(super) fn step(arguments: &[&str], _: &mut Asking) -> Answer {
    let periods = match arguments {
        [] => 1,
        [periods] => periods
            .parse()
            .map_err(|_| format!("\"{periods}\" is no whole number of control periods"))?,
        _ => return Err(usage("step")),
    };
    // The aircraft says what is too many.
    Ok(Order::ask(PlantAction::Pace(Pace::Step(periods)), format!("Simulation steps: {periods}\n")))
}

pub(super) fn speed(arguments: &[&str], _: &mut Asking) -> Answer {
    let [factor] = arguments else { return Err(usage("speed")) };
    let factor = number("speed", factor, "x")?;
    Ok(Order::ask(PlantAction::Pace(Pace::Speed(factor)), format!("Simulation speed: x{factor}\n")))
}
