//! What came into a flight from outside of the loop, in order: what a replay needs beside the headers.

use icd::fault::PlantRequest;
use icd::wire::Phase;
use serde::{Deserialize, Serialize};

use flight_management::command::Intent;

/// One entry of the topic `recorded`, as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Recorded {
    /// An operator's command, taken before the step of its exchange.
    Intent(Intent),
    /// What left for the plant with the answer of its exchange.
    Request(PlantRequest),
    /// The plant had been silent for too long.
    PlantLost,
    /// The plant goes on with the same flight.
    PlantBack,
}

/// Where in the flight something happened, beside the number of control steps flown before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// In the exchange of a control step.
    Step,
    /// In an exchange while time stands still.
    Holding,
    /// In an exchange on the ground.
    OnGround,
    /// Between two exchanges.
    Between,
}

impl Moment {
    /// Number in logs.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The one with this number.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        [Self::Step, Self::Holding, Self::OnGround, Self::Between]
            .into_iter()
            .find(|moment| moment.code() == code)
    }
}

impl From<Phase> for Moment {
    fn from(phase: Phase) -> Self {
        match phase {
            Phase::Flying => Self::Step,
            Phase::Holding => Self::Holding,
            Phase::OnGround => Self::OnGround,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_moment_comes_back_from_its_number() {
        for code in 0..4 {
            assert_eq!(Moment::from_code(code).map(Moment::code), Some(code));
        }
        assert_eq!(Moment::from_code(4), None);
    }
}
