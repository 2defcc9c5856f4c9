//! Not in the paper: why the altitude is not held, from the controller's own signals.

use icd::ControlPeriod;
use serde::{Deserialize, Serialize};

use crate::aircraft_model::AircraftModel;
use crate::main_controller::Demand;
use crate::navigation::NavigationState;
use crate::signals::{Saturation, Side};

/// An altitude error inside this is held, m.
const HELD_WITHIN_M: f64 = 10.0;
/// An error that shrinks faster than this is a climb or a descent, m/s.
const CLOSING_M_S: f64 = 0.5;
/// The airspeed may be this far below its reference before the engine counts as what is missing, m/s.
const SLOW_M_S: f64 = 1.0;
/// From this part of the stall onset on the wing counts as what is missing.
const NEAR_STALL: f64 = 0.95;
/// Named when the error has stood at a limit for this long, s. Time without that counts back at a quarter of the
/// rate, so that an oscillation at the limit is named as well.
const NAMED_AFTER_S: f64 = 3.0;
/// Rate at which time without the condition counts back.
const RECOVERY: f64 = 0.25;

icd::named! {
    /// What the aircraft lacks to hold its altitude.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
    AltitudeLimit {
        /// Thrust: it is at its limit and the airspeed is below the reference.
        Engine = "engine",
        /// Travel of the elevators.
        Elevator = "elevator",
        /// Lift: the angle of attack is near the stall onset of the model.
        Wing = "wing",
    }
}

impl AltitudeLimit {
    /// Number in logs, from 1.
    pub const fn code(self) -> u8 {
        self as u8 + 1
    }
}

/// Watches whether the altitude error stands while something is at its limit.
#[derive(Debug, Clone)]
pub struct AltitudeWatch {
    h: f64,
    standing_s: f64,
    limit: Option<AltitudeLimit>,
    named: bool,
}

impl AltitudeWatch {
    /// Nothing is missing.
    pub fn new(period: ControlPeriod) -> Self {
        Self { h: period.as_seconds(), standing_s: 0.0, limit: None, named: false }
    }

    /// As new.
    pub fn reset(&mut self) {
        (self.standing_s, self.limit, self.named) = (0.0, None, false);
    }

    /// One step; `saturated` is that of the same step.
    pub fn step(
        &mut self,
        state: &NavigationState,
        demand: &Demand,
        saturated: &Saturation,
        aircraft: &AircraftModel,
    ) -> Option<AltitudeLimit> {
        let error = state.altitude_m - demand.altitude_m;
        // Positive while the error shrinks, from either side.
        let closing = -libm::copysign(1.0, error) * state.climb_rate_m_s();
        let stands = error.abs() > HELD_WITHIN_M && closing < CLOSING_M_S;
        match missing(state, demand, saturated, aircraft).filter(|_| stands) {
            Some(limit) => {
                self.limit = Some(limit);
                // Not beyond the threshold, so an hour at the limit is forgotten as quickly as three seconds.
                self.standing_s = (self.standing_s + self.h).min(NAMED_AFTER_S);
            }
            None => self.standing_s = (self.standing_s - RECOVERY * self.h).max(0.0),
        }
        if self.standing_s >= NAMED_AFTER_S {
            self.named = true;
        // Between the two the name stays, or an oscillation at the limit would be named again and again.
        } else if self.standing_s <= 0.0 || error.abs() <= HELD_WITHIN_M {
            self.named = false;
        }
        self.limit.filter(|_| self.named)
    }
}

/// What is at its limit; the wing before the elevator that drives it there, both before the engine.
fn missing(
    state: &NavigationState,
    demand: &Demand,
    saturated: &Saturation,
    aircraft: &AircraftModel,
) -> Option<AltitudeLimit> {
    // The wing comes before the elevator that drives it to the stall, and both before the engine.
    if state.alpha > NEAR_STALL * aircraft.airframe.stall_onset_rad {
        Some(AltitudeLimit::Wing)
    } else if saturated.elevator.is_saturated() {
        Some(AltitudeLimit::Elevator)
    } else if saturated.thrust == Side::Above && state.airspeed_m_s < demand.airspeed_m_s - SLOW_M_S
    {
        Some(AltitudeLimit::Engine)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use icd::Ned;

    /// What is named after so many seconds of the same step.
    fn after(
        seconds: f64,
        state: &NavigationState,
        saturated: Saturation,
    ) -> Option<AltitudeLimit> {
        let mut watch = AltitudeWatch::new(ControlPeriod::DEFAULT);
        let mut named = None;
        let mut left_s = seconds;
        while left_s > 0.0 {
            named =
                watch.step(state, &testing::level_demand(), &saturated, &testing::aircraft_model());
            left_s -= watch.h;
        }
        named
    }

    fn low() -> NavigationState {
        NavigationState { altitude_m: 4_900.0, ..testing::level_state() }
    }

    const ELEVATOR: Saturation = Saturation {
        aileron: Side::Inside,
        elevator: Side::Below,
        rudder: Side::Inside,
        nozzle_pitch: Side::Inside,
        nozzle_yaw: Side::Inside,
        thrust: Side::Inside,
    };

    #[test]
    fn an_error_at_a_limit_is_reported_after_three_seconds_with_the_missing_amount() {
        assert_eq!(after(2.9, &low(), ELEVATOR), None);
        assert_eq!(after(3.1, &low(), ELEVATOR), Some(AltitudeLimit::Elevator));
        let stalled = NavigationState { alpha: 0.26, ..low() };
        assert_eq!(after(3.1, &stalled, ELEVATOR), Some(AltitudeLimit::Wing));
        let slow = NavigationState { airspeed_m_s: 250.0, ..low() };
        let full = Saturation { thrust: Side::Above, ..Saturation::default() };
        assert_eq!(after(3.1, &slow, full), Some(AltitudeLimit::Engine));
    }

    #[test]
    fn a_climb_a_small_error_and_an_error_without_a_limit_are_not_named() {
        let climbing = NavigationState { velocity: Ned::new(264.0, 0.0, -5.0), ..low() };
        assert_eq!(after(60.0, &climbing, ELEVATOR), None);
        let close = NavigationState { altitude_m: 4_995.0, ..low() };
        assert_eq!(after(60.0, &close, ELEVATOR), None);
        assert_eq!(after(60.0, &low(), Saturation::default()), None);
    }
}
