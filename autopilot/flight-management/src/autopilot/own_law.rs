//! A law that the program provides: it flies where `CTL_LAW` is 9 (`--law own`).

use std::fmt;

use flight_control::Law;

use super::Autopilot;

/// Creates the law for each flight.
pub type OwnLaw = fn() -> Box<dyn Law + Send>;

/// The law and its constructor.
pub(crate) struct Brought {
    make: OwnLaw,
    law: Box<dyn Law + Send>,
}

impl Brought {
    /// Ready for a flight.
    pub(crate) fn new(make: OwnLaw) -> Self {
        Self { make, law: make() }
    }

    /// Resets the law to the start of a flight.
    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.make);
    }

    /// The law of this flight.
    pub(crate) fn law(&mut self) -> &mut dyn Law {
        &mut *self.law
    }
}

impl fmt::Debug for Brought {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Brought")
    }
}

impl Autopilot {
    /// Flies `law` where [`flight_control::MainLaw::Own`] is selected.
    #[must_use]
    pub fn with_own_law(mut self, law: Option<OwnLaw>) -> Self {
        self.own_law = law.map(Brought::new);
        self
    }

    /// Creates the law again.
    pub(super) fn reset_own_law(&mut self) {
        if let Some(own) = &mut self.own_law {
            own.reset();
        }
    }
}
