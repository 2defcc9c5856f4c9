//! Failsafes: what the aircraft does by itself without its position, without thrust, and with little fuel. The silence of a ground
//! station and the fence have theirs in [`super::Vehicle`].

use flight_control::guidance::Horizontal;
use flight_control::{Demand, NavigationState};
use icd::units::STANDARD_GRAVITY_M_S2;

use super::landing::Approach;
use super::modes::Flown;
use super::rules::{NavigationParameters, Rules};
use super::{Mode, Publish, Situation, Vehicle, VehicleEvent};

pub use super::request::{EngineAction, Failsafe, FuelAction, FuelLevel};

/// An unknown position counts as lost after this time, s: until then the guidance goes on by dead reckoning.
const POSITION_LOST_S: f64 = 5.0;
/// An engine has failed when it has given less than this part of its command, and the aircraft is slower than this part of its reference: an
/// engine monitor that reads low is no failed engine. It counts after this time over the airspeed of an approach, s²/m: every aircraft
/// loses its speed at about the same rate, so a slow one has less time, and its engine is quicker.
const ENGINE_FAILED: f64 = 0.2;
const ENGINE_FAILED_S2_M: f64 = 0.04;
const TOO_SLOW: f64 = 0.95;
/// It is back when it gives this part of its command.
const ENGINE_BACK: f64 = 0.5;
/// A state ends when it has been over for this time, s.
const OVER_S: f64 = 3.0;
/// A gauge that swings does not raise the level again: a tank that is filled up passes a level by this, percent.
const REFUELLED_PCT: f64 = 3.0;
/// Airspeed of a glide over that of an approach: the flare is flown without thrust.
const GLIDE_OVER_APPROACH: f64 = 1.15;
/// Time constants over the airspeed of the glide, s²/m: with which airspeed is regained, and the loss of energy is smoothed.
const GLIDE_S2_M: f64 = 0.1;
const LOSS_LAG_S2_M: f64 = 0.05;
/// The altitude law follows a reference that is ahead by this time at the wanted rate of climb, s.
const GLIDE_LEAD_S: f64 = 10.0;
/// A forced landing begins this time above the ground at the present rate of descent, s.
const FORCED_LANDING_S: f64 = 15.0;
/// Its line leads straight ahead this far, as a way of the present speed, s.
const STRAIGHT_AHEAD_S: f64 = 120.0;

/// What the vehicle knows of its propulsion at a tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Powerplant {
    /// Thrust commanded in the last step, N.
    pub commanded_n: f64,
    /// By the gauge, percent of a full tank; `None` without a valid sample.
    pub fuel_pct: Option<f64>,
}

/// A state that counts when it has lasted.
#[derive(Debug, Clone, Copy, Default)]
struct Lasting {
    counts: bool,
    for_s: f64,
}

impl Lasting {
    /// One tick in which the state `is_there`; what counts now, if that has just changed.
    fn step(&mut self, is_there: bool, after_s: f64, dt_s: f64) -> Option<bool> {
        self.for_s = if is_there == self.counts { 0.0 } else { self.for_s + dt_s };
        let needed_s = if self.counts { OVER_S } else { after_s };
        (self.for_s >= needed_s).then(|| {
            *self = Self { counts: !self.counts, for_s: 0.0 };
            self.counts
        })
    }
}

/// The states of a flight.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FailsafeWatch {
    position: Lasting,
    engine: Lasting,
    /// Largest thrust commanded since the engine has failed, N.
    missed_n: f64,
    fuel: FuelLevel,
    glide: Glide,
    /// The end of a glide, straight ahead.
    landing: Option<Approach>,
}

impl FailsafeWatch {
    pub fn is_position_lost(&self) -> bool {
        self.position.counts
    }

    pub fn has_engine_failed(&self) -> bool {
        self.engine.counts
    }

    /// The flare of a forced landing is under way.
    pub fn is_flaring(&self) -> bool {
        self.landing.is_some_and(|landing| landing.is_flaring())
    }

    /// The glide has ended on the ground; the next flight has an engine again, or finds that it has none.
    pub fn rest(&mut self) {
        *self = Self { position: self.position, fuel: self.fuel, ..Self::default() };
    }

    /// One tick in the air. Publishes what begins, and what is over.
    pub fn step(
        &mut self,
        state: &NavigationState,
        demand: &Demand,
        propulsion: &Powerplant,
        rules: &Rules,
        dt_s: f64,
        mut publish: impl FnMut(Failsafe, bool),
    ) {
        if let Some(lost) = self.position.step(!state.valid.position, POSITION_LOST_S, dt_s) {
            publish(Failsafe::PositionLost, lost);
        }
        let Powerplant { commanded_n, fuel_pct } = *propulsion;
        let gives = |part: f64| !state.valid.thrust || state.thrust_n >= part * commanded_n;
        let is_failed = if self.engine.counts {
            self.missed_n = self.missed_n.max(commanded_n);
            // A windmilling engine gives what little is asked for in the flare, and a landing without thrust goes on.
            let is_back = gives(ENGINE_BACK) && state.thrust_n > ENGINE_FAILED * self.missed_n;
            !is_back || self.landing.is_some()
        } else {
            self.missed_n = 0.0;
            !gives(ENGINE_FAILED) && state.airspeed_m_s < TOO_SLOW * demand.airspeed_m_s
        };
        // A power, which flights with an engine do without.
        let after_s = match is_failed {
            true => ENGINE_FAILED_S2_M * rules.approach_m_s(state.altitude_m),
            false => f64::INFINITY,
        };
        if let Some(failed) = self.engine.step(is_failed, after_s, dt_s) {
            (self.glide, self.landing) = (Glide::default(), None);
            publish(Failsafe::EngineFailed, failed);
        }
        let Some(fuel_pct) = fuel_pct else { return };
        let level = |pct: f64| {
            let NavigationParameters { low_fuel, critical_fuel, emergency_fuel, .. } =
                rules.navigation;
            let levels = [low_fuel, critical_fuel, emergency_fuel];
            let below = levels.into_iter().filter(|level| pct < 100.0 * level).count();
            [FuelLevel::Enough, FuelLevel::Low, FuelLevel::Critical, FuelLevel::Emergency][below]
        };
        let now = level(fuel_pct).max(self.fuel.min(level(fuel_pct - REFUELLED_PCT)));
        let before = core::mem::replace(&mut self.fuel, now);
        if now != before {
            publish(Failsafe::Fuel(now.max(before)), now > before);
        }
    }

    /// Guidance of a glide down to the ground: on towards `around`, and near the ground straight ahead with level wings.
    pub fn glide_down(
        &mut self,
        situation: &Situation,
        demand: &mut Demand,
        around: impl FnOnce(&Situation, &mut Demand) -> Option<Flown>,
    ) -> Option<Flown> {
        let rules = situation.rules.near_ground();
        let height_m = situation.height_m.unwrap_or(situation.altitude_m - rules.ground_m);
        let sink_m_s = -situation.climb_m_s;
        if self.landing.is_none() && height_m < FORCED_LANDING_S * sink_m_s {
            let (sin, cos) = libm::sincos(situation.course_rad());
            let ahead = Horizontal::new(cos, sin) * (STRAIGHT_AHEAD_S * situation.speed_m_s);
            let horizon = situation.horizon();
            let slope = sink_m_s / situation.speed_m_s.max(1.0);
            let landing =
                Approach::straight_ahead(horizon.site, horizon.place_at(&ahead), slope, &rules);
            self.landing = Some(landing);
        }
        match &mut self.landing {
            Some(landing) => {
                if !landing.is_flaring() {
                    // The flare goes on from where the altitude law has looked.
                    demand.altitude_m = self.glide.altitude_m;
                }
                landing.fly(&Situation { rules: &rules, ..*situation }, demand)
            }
            None => around(situation, demand),
        }
    }

    /// The altitude demand of a glide, m: no higher than the airspeed allows.
    pub fn limit_altitude(&mut self, altitude_m: f64, situation: &Situation) -> f64 {
        self.glide.step(situation);
        altitude_m.min(self.glide.altitude_m)
    }
}

impl Vehicle {
    /// One tick; `None` if it leaves the roll reference unchanged.
    pub(super) fn fly(
        &mut self,
        situation: &Situation,
        demand: &mut Demand,
        publish: Publish,
    ) -> Option<Flown> {
        let is_piloted = matches!(self.mode, Mode::Position | Mode::Altitude | Mode::Offboard);
        if !self.failsafe.has_engine_failed() || is_piloted || self.is_landing() {
            return self.fly_mode(situation, demand, publish);
        }
        let mut failsafe = self.failsafe;
        let flown = failsafe.glide_down(situation, demand, |situation, demand| {
            self.fly_mode(situation, demand, publish)
        });
        self.failsafe = failsafe;
        flown
    }

    /// The aircraft is on its way down to a place that it knows: also without thrust the best there is.
    pub(super) fn is_landing(&self) -> bool {
        !self.failsafe.is_position_lost() && self.approach().is_some_and(Approach::leads_down)
    }

    /// The mode cannot be flown without a position, and another way of flying is safe.
    pub(super) fn needs_position(&self) -> bool {
        match self.mode {
            Mode::Mission => !self.mission.is_flaring(),
            Mode::Return => !self.returning.is_flaring(),
            Mode::Hold => true,
            Mode::Offboard => self.offboard.needs_position(),
            Mode::Position | Mode::Altitude | Mode::Takeoff => false,
        }
    }

    /// One tick in the air: what is lost has its action.
    pub(super) fn watch_failsafes(
        &mut self,
        state: &NavigationState,
        rules: &Rules,
        propulsion: &Powerplant,
        dt_s: f64,
        publish: Publish,
    ) {
        let Some(demand) = self.demand.filter(|_| self.is_armed()) else { return };
        let mut begun = None;
        let navigation = &rules.navigation;
        self.failsafe.step(state, &demand, propulsion, rules, dt_s, |failsafe, is_there| {
            publish(VehicleEvent::Failsafe { failsafe, is_there });
            if is_there {
                begun = Some(failsafe);
            }
        });
        let wants_return = match begun {
            Some(Failsafe::EngineFailed) => match navigation.engine_action {
                EngineAction::Report => false,
                // The operator flies there, and knows.
                EngineAction::Return => !matches!(self.mode, Mode::Position | Mode::Altitude),
                EngineAction::Terminate => {
                    self.terminate(publish);
                    false
                }
            },
            Some(Failsafe::Fuel(level)) => match navigation.fuel_action {
                FuelAction::Land if level >= FuelLevel::Critical => {
                    self.land(rules, publish).is_err()
                }
                FuelAction::Return if level == FuelLevel::Emergency => {
                    self.land(rules, publish).is_err()
                }
                FuelAction::Return => level == FuelLevel::Critical,
                FuelAction::Report | FuelAction::Land => false,
            },
            Some(Failsafe::PositionLost) | None => false,
        };
        if wants_return && !self.is_landing() {
            self.undo = None;
            self.enter(Mode::Return, rules, publish);
        }
    }
}

/// The descent that holds the airspeed without thrust.
#[derive(Debug, Clone, Copy, Default)]
struct Glide {
    /// Height plus kinetic energy per weight at the last tick, m, and its loss per time, smoothed, m/s.
    energy_m: Option<f64>,
    loss_m_s: f64,
    /// Where the altitude law looks, m.
    altitude_m: f64,
}

impl Glide {
    /// One tick: down as fast as energy is lost and a little faster while the aircraft is too slow, never up.
    fn step(&mut self, situation: &Situation) {
        let Situation { altitude_m, airspeed_m_s, dt_s, rules, .. } = *situation;
        let energy_m = altitude_m + airspeed_m_s * airspeed_m_s / (2.0 * STANDARD_GRAVITY_M_S2);
        let glide_m_s = GLIDE_OVER_APPROACH * rules.approach_m_s(altitude_m);
        let before_m = self.energy_m.replace(energy_m).unwrap_or(energy_m);
        if dt_s > 0.0 {
            let loss_m_s = (before_m - energy_m) / dt_s;
            let lag_s = LOSS_LAG_S2_M * glide_m_s;
            self.loss_m_s += (loss_m_s - self.loss_m_s) * dt_s / (lag_s + dt_s);
        }
        // A speed is gained at the rate of descent times g over the speed.
        let missing_m_s = glide_m_s - airspeed_m_s;
        let sink_m_s = self.loss_m_s + missing_m_s / (STANDARD_GRAVITY_M_S2 * GLIDE_S2_M);
        self.altitude_m = altitude_m - GLIDE_LEAD_S * sink_m_s.max(0.0);
    }
}
