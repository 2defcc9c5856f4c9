//! Loops over the steps of a flight, for whoever looks at it.

use core::ops::ControlFlow;

use autopilot::command::{Command, Intent};
use autopilot::recorder::Recorded;
use icd::SimTime;

use crate::flight::{End, Flight, FlightSetup, Record, Tick};
use crate::problem::Problem;

/// An operator's command at a time. Such a flight repeats to the bit like any other.
#[derive(Debug, Clone)]
pub struct TimedCommand {
    /// It is taken before the control step of the first tick at or after this time.
    pub at: SimTime,
    pub command: Command,
}

/// Flies a setup to its end, or until `look` breaks.
pub fn watch(
    setup: &FlightSetup,
    look: impl FnMut(&Tick<'_>) -> ControlFlow<()>,
) -> Result<End, Problem> {
    watch_with_commands(setup, &[], look).map(|flight| flight.end())
}

/// The same with commands, in the order of time; the flight as it ended.
pub fn watch_with_commands(
    setup: &FlightSetup,
    commands: &[TimedCommand],
    mut look: impl FnMut(&Tick<'_>) -> ControlFlow<()>,
) -> Result<Flight, Problem> {
    let mut flight = Flight::new(setup)?;
    let mut commands = commands.iter().zip(1..).peekable();
    loop {
        let now = flight.next_time();
        let due = std::iter::from_fn(|| {
            let (timed, number) = commands.next_if(|(timed, _)| timed.at <= now)?;
            Some(Recorded::Intent(Intent { number, command: timed.command.clone() }))
        });
        match flight.step(due) {
            Some(tick) if look(&tick).is_continue() => {}
            Some(_) => return Ok(flight),
            None => break,
        }
    }
    match flight.failure() {
        Some(failure) => Err(failure.into()),
        None => Ok(flight),
    }
}

/// Flies a setup from its start to its end and hands every tick to `sink`.
pub fn fly(setup: &FlightSetup, sink: &mut dyn FnMut(&Record)) -> Result<End, Problem> {
    watch(setup, |tick| {
        sink(&tick.record());
        ControlFlow::Continue(())
    })
}
