//! A law that the program brings: what flies where `CTL_LAW` is 9 (`--law own`).

use std::fmt;

use flight_control::Law;

use super::Autopilot;

/// Makes the law anew for each flight.
pub type OwnLaw = fn() -> Box<dyn Law + Send>;

/// The law and how to make it anew.
pub(crate) struct Brought {
    make: OwnLaw,
    law: Box<dyn Law + Send>,
}

impl Brought {
    /// Ready for a flight.
    pub(crate) fn new(make: OwnLaw) -> Self {
        Self { make, law: make() }
    }

    /// Forgets the flight so far.
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

    /// Makes the law anew.
    pub(super) fn reset_own_law(&mut self) {
        if let Some(own) = &mut self.own_law {
            own.reset();
        }
    }
}
