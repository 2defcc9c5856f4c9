//! A flight in which an operator speaks at given ticks: modes, plans, positions.
//!
//! Inputs are stamped with simulation time, so such a flight is repeated to the bit like any other.

use core::iter::Zip;
use core::ops::{ControlFlow, RangeFrom};
use core::slice;
use std::iter::Peekable;

use autopilot::command::{Command, Intent};
use autopilot::event::{Event, Snapshot};
use autopilot::recorder::Recorded;
use icd::SimTime;
use plant_sim::{SetupError, Truth};

use super::{End, Exchange, FlightSetup, Operator, Tick, run, settings};

/// What an operator wants, and when.
#[derive(Debug, Clone)]
pub struct Spoken {
    /// It is taken before the control step of the first tick at or after this time.
    pub at: SimTime,
    /// What.
    pub command: Command,
}

/// One tick of such a flight.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// The plant's truth at the tick.
    pub truth: &'a Truth,
    /// What the autopilot tells at the tick.
    pub snapshot: &'a Snapshot,
    /// What has happened since the tick before.
    pub events: &'a [Event],
}

/// Flies a setup from its start to its end and hands every tick to `sink`. `spoken` is in the order of time.
///
/// # Errors
/// [`SetupError`] if the plant cannot start.
pub fn fly_spoken(
    setup: &FlightSetup,
    spoken: &[Spoken],
    sink: &mut dyn FnMut(&Moment),
) -> Result<End, SetupError> {
    fly_while(setup, spoken, &mut |moment| {
        sink(moment);
        true
    })
}

/// The same, ended by a `sink` that says false.
///
/// # Errors
/// [`SetupError`] if the plant cannot start.
pub fn fly_while(
    setup: &FlightSetup,
    spoken: &[Spoken],
    sink: &mut dyn FnMut(&Moment) -> bool,
) -> Result<End, SetupError> {
    let mut speaker = Speaker { spoken: spoken.iter().zip(1..).peekable(), sink };
    Ok(run(&setup.plant, &settings(setup), setup.duration, &mut speaker)?.end)
}

struct Speaker<'a> {
    /// With the numbers of their intents.
    spoken: Peekable<Zip<slice::Iter<'a, Spoken>, RangeFrom<u32>>>,
    sink: &'a mut dyn FnMut(&Moment) -> bool,
}

impl Operator for Speaker<'_> {
    type Stop = ();

    fn input(&mut self, exchange: &Exchange) -> Option<Recorded> {
        let (spoken, number) = self.spoken.next_if(|(spoken, _)| spoken.at <= exchange.time)?;
        Some(Recorded::Intent(Intent { number, command: spoken.command.clone() }))
    }

    fn tick(&mut self, tick: &Tick<'_>) -> ControlFlow<()> {
        let snapshot = tick.snapshot;
        let moment = Moment { truth: &tick.plant.truth(), snapshot, events: tick.events };
        if (self.sink)(&moment) { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}
