//! Altitude: a pilot's sticks give roll angle, climb and airspeed.

use flight_control::Demand;

use super::VehicleRefusal;
use super::altitude::ClimbReference;
use super::request::Sticks;
use super::rules::{Checked, Rules, up_to};
use super::situation::Situation;

/// The latest stick positions; centred until the first ones come.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pilot {
    sticks: Option<Sticks>,
    climb: ClimbReference,
}

impl Pilot {
    /// Takes stick positions.
    ///
    /// # Errors
    /// A position beyond its stop, or no number.
    pub fn take(&mut self, sticks: Sticks) -> Result<(), VehicleRefusal> {
        check(&sticks)?;
        self.sticks = Some(sticks);
        Ok(())
    }

    /// One tick.
    pub fn fly(&mut self, situation: &Situation, demand: &mut Demand, rules: &Rules) {
        let Some(sticks) = self.sticks else { return };
        demand.roll_rad = sticks.roll * rules.roll_max_rad();
        let climb_m_s = sticks.climb * rules.navigation.climb_max_m_s;
        demand.altitude_m = self.climb.step(demand.altitude_m, climb_m_s, situation, rules);
        if let Some(throttle) = sticks.throttle {
            demand.airspeed_m_s = rules.airspeed_of_throttle(throttle);
        }
    }
}

/// Checks stick positions.
///
/// # Errors
/// A position beyond its stop, or no number.
pub fn check(sticks: &Sticks) -> Result<(), VehicleRefusal> {
    let stick = |what, value| Checked { what, unit: "of 1", value, min: -1.0, max: 1.0 };
    stick("roll stick", sticks.roll).check()?;
    stick("climb stick", sticks.climb).check()?;
    sticks.throttle.map_or(Ok(()), |value| up_to("throttle", "of 1", value, 1.0).check())
}
