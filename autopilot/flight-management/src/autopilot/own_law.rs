//! The law that a program brings, as a part of the control side.

use super::Autopilot;
use crate::own_law::{Brought, OwnLaw};

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
