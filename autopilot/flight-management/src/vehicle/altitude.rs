//! Altitude references of paths, streams and a pilot's sticks; the mode Altitude, in which the sticks give roll angle, climb
//! and airspeed.

use super::VehicleRefusal;
use super::request::Sticks;
use super::rules::{Checked, Rules, up_to};
use super::situation::Situation;
use flight_control::Demand;

/// The latest stick positions; centred until the first ones come.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pilot {
    sticks: Option<Sticks>,
    climb: ClimbReference,
}

impl Pilot {
    /// Sets the stick positions.
    pub fn take(&mut self, sticks: Sticks) -> Result<(), VehicleRefusal> {
        check(&sticks)?;
        self.sticks = Some(sticks);
        Ok(())
    }

    pub fn fly(&mut self, situation: &Situation, demand: &mut Demand, rules: &Rules) {
        let Some(sticks) = self.sticks else { return };
        demand.roll_rad = sticks.roll * rules.roll_max_rad();
        let climb_m_s = sticks.climb * rules.navigation.climb_max_m_s;
        demand.altitude_m = self.climb.step(demand.altitude_m, climb_m_s, situation, rules);
        if let Some(throttle) = sticks.throttle {
            demand.airspeed_m_s = rules.airspeed_of_throttle(throttle, demand.altitude_m);
        }
    }
}

pub fn check(sticks: &Sticks) -> Result<(), VehicleRefusal> {
    let stick = |what, value| Checked { what, unit: "of 1", value, min: -1.0, max: 1.0 };
    stick("roll stick", sticks.roll).check()?;
    stick("climb stick", sticks.climb).check()?;
    sticks.throttle.map_or(Ok(()), |value| up_to("throttle", "of 1", value, 1.0).check())
}

/// Rate at which a persistent altitude error is added to the demand to the laws, 1/s: slower than the
/// altitude law, which needs about 10 s.
const TRIM_RATE_PER_S: f64 = 0.025;
/// Largest addition, as a fraction of the largest error that the altitude law sees; a larger error is a climb in
/// progress.
const TRIM_MAX: f64 = 0.75;
/// An aircraft that climbs or descends faster than this fraction of `NAV_CLIMB_MAX` has no persistent error.
const STANDING_CLIMB: f64 = 1.0 / 6.0;

/// The altitude demand to the laws in modes that follow a path, a pilot or a stream.
///
/// Differs from the reference in two ways. It moves no faster than `NAV_CLIMB_MAX`, because an aircraft that
/// pushes over has no lift left to turn with. And it is displaced slowly so that no error persists: the altitude
/// law is a deviation from the trim of one airspeed and integrates only near its reference, so away from that
/// airspeed, or steeply banked, it would stay 50 to 200 m beside it. The laws themselves are unchanged;
/// in Position, where a roll reference is flown as given, they get the altitude reference as given too.
#[derive(Debug, Clone, Copy, Default)]
pub struct AltitudeDemand {
    reference_m: Option<f64>,
    added_m: f64,
}

impl AltitudeDemand {
    /// The next tick starts from the aircraft.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// The demand after one tick, m.
    pub fn step(&mut self, reference_m: f64, situation: &Situation, rules: &Rules) -> f64 {
        let Situation { altitude_m, climb_m_s, dt_s, .. } = *situation;
        let sees_m = rules.altitude_error_max_m;
        let seen = || altitude_m + (reference_m - altitude_m).max(-sees_m).min(sees_m);
        let moved = self.reference_m.unwrap_or_else(seen);
        let most = rules.navigation.climb_max_m_s * dt_s;
        let moved = moved + (reference_m - moved).clamp(-most, most);
        self.reference_m = Some(moved);
        let error = moved - altitude_m;
        if error.abs() < sees_m {
            let standing_m_s = STANDING_CLIMB * rules.navigation.climb_max_m_s;
            let standing = (1.0 - climb_m_s.abs() / standing_m_s).max(0.0);
            let change = TRIM_RATE_PER_S * standing * error * dt_s;
            let most = TRIM_MAX * sees_m;
            self.added_m = (self.added_m + change).max(-most).min(most);
        }
        moved + self.added_m
    }
}

/// The reference leads the aircraft by at most the climb during this time, s: about
/// the lag of the altitude law behind a ramp.
const AHEAD_S: f64 = 12.0;
/// When the climb ends the reference is where the aircraft will be after this time, s.
const LEVEL_OFF_S: f64 = 3.0;

/// An altitude reference that is moved by a climb rate.
#[derive(Debug, Clone, Copy, Default)]
pub struct ClimbReference {
    moving: bool,
}

impl ClimbReference {
    /// The reference after one tick, m. At a climb rate of zero it stays constant; when the climb rate
    /// becomes zero it moves to the aircraft, so that releasing the stick ends the climb.
    pub fn step(
        &mut self,
        reference_m: f64,
        climb_m_s: f64,
        situation: &Situation,
        rules: &Rules,
    ) -> f64 {
        let moving = climb_m_s != 0.0;
        let stopped = self.moving && !moving;
        self.moving = moving;
        let reference_m = if stopped {
            situation.altitude_m + situation.climb_m_s * LEVEL_OFF_S
        } else if moving {
            let ahead = climb_m_s.abs() * AHEAD_S;
            (reference_m + climb_m_s * situation.dt_s)
                .clamp(situation.altitude_m - ahead, situation.altitude_m + ahead)
        } else {
            return reference_m;
        };
        rules.nearest_altitude_m(reference_m)
    }
}
