//! A flight in one process in which an operator speaks at given ticks: modes, plans, positions.
//!
//! Wishes are part of the setup, stamped with simulation time, so such a flight is repeated to the bit like any
//! other.

use autopilot::autopilot::Autopilot;
use autopilot::event::{Event, Intent, Snapshot, Wish};
use icd::SimTime;
use plant_sim::{Plant, SetupError, Truth};

use crate::closed_loop::{End, FlightSetup, ask, report, settings};

/// What an operator wants, and when.
#[derive(Debug, Clone)]
pub struct Spoken {
    /// The wish is taken before the control step of the first tick at or after this time.
    pub at: SimTime,
    /// What.
    pub wish: Wish,
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
pub fn fly(
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
    let mut plant = Plant::new(&setup.plant)?;
    let mut autopilot = Autopilot::new(&settings(setup));
    let mut wishes = spoken.iter().zip(1..).peekable();
    let mut events = Vec::new();
    let mut reply = None;
    autopilot.begin_flight(setup.plant.period, plant.time(), false);
    loop {
        let time = plant.time();
        let sensors = plant.sense();
        report(&mut plant, reply.take(), &mut autopilot);
        while let Some((spoken, number)) = wishes.next_if(|(spoken, _)| spoken.at <= time) {
            autopilot.handle_intent(Intent { number, wish: spoken.wish.clone() });
        }
        let output = autopilot.step(time, &sensors);
        events.clear();
        events.extend(std::iter::from_fn(|| autopilot.pop_event()));
        let goes_on = autopilot.snapshot().is_none_or(|snapshot| {
            sink(&Moment { truth: &plant.truth(), snapshot, events: &events })
        });
        if !goes_on || time + setup.plant.period > setup.duration {
            return Ok(End { time, on_ground: false });
        }
        reply = ask(&mut autopilot, &mut plant);
        plant.advance(&output.actuators);
        if plant.on_ground() {
            return Ok(End { time: plant.time(), on_ground: true });
        }
    }
}
