//! A law that may fail, such as one in another language, as a law that never does.
//!
//! A control step is total: no law can end it. So a law that may fail is guarded. From its failure on the guard repeats the last
//! command, and the flight ends after that step ([`crate::Flight::failure`]).

use std::error::Error;
use std::sync::Arc;

use autopilot::own_law::{Failure, FlightLaw, OwnLaw};
use flight_control::{Law, LawInput, MainCommand};

/// A main controller that may fail.
pub trait FallibleLaw: Send {
    /// One control period: the commands, or why there are none, which ends the flight.
    fn step(&mut self, input: &LawInput<'_>) -> Result<MainCommand, Box<dyn Error + Send + Sync>>;

    /// The law with its present state; `None` if it cannot be copied.
    fn copy(&self) -> Option<Box<dyn FallibleLaw>> {
        None
    }
}

/// The failure of a law that ended a flight.
#[derive(Debug, Clone, thiserror::Error)]
#[error("the law has failed: {0}")]
pub struct LawFailure(pub Failure);

struct Guarded {
    law: Box<dyn FallibleLaw>,
    last: MainCommand,
    failure: Option<Failure>,
}

/// A law of one's own that may fail; `make` is called at the start of each flight, on any thread.
pub fn fallible(
    name: &str,
    make: impl Fn() -> Box<dyn FallibleLaw> + Send + Sync + 'static,
) -> OwnLaw {
    let guard = move || Guarded { law: make(), last: MainCommand::default(), failure: None };
    OwnLaw::new(name, guard)
}

impl Law for Guarded {
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        if self.failure.is_none() {
            match self.law.step(input) {
                Ok(command) => self.last = command,
                Err(failure) => self.failure = Some(Arc::from(failure)),
            }
        }
        self.last
    }
}

impl FlightLaw for Guarded {
    fn copy(&self) -> Option<Box<dyn FlightLaw>> {
        let (law, failure) = (self.law.copy()?, self.failure.clone());
        Some(Box::new(Self { law, last: self.last, failure }))
    }

    fn failure(&self) -> Option<Failure> {
        self.failure.clone()
    }
}
