//! Step one: the laws of the healthy aircraft. It knows nothing of observer and compensator.

use icd::ControlPeriod;
use serde::{Deserialize, Serialize};

use crate::belief::Belief;
use crate::design_model::{DesignModel, FlightCondition};
use crate::estimator::State;
use crate::gains::{AltitudeGains, MainGains, MainLaw, RollGains, SpeedGains};
use crate::level_turn::{LevelTurn, level_turn};
use crate::mixer::Saturation;
use crate::pid::Integral;

mod ganged_nozzle;

/// What the operator or the guidance wants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Demand {
    /// H_g: altitude, m.
    pub altitude_m: f64,
    /// φ_g: roll angle, rad.
    pub roll_rad: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
}

/// u1: what the main controller asks for, before limits. Rad; thrust N.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct MainCommand {
    /// δa_c: aileron pair, right = this, left = minus this.
    pub aileron_rad: f64,
    /// δe_c: both elevators.
    pub elevator_rad: f64,
    /// δr_c: rudder.
    pub rudder_rad: f64,
    /// Nozzle pitch; zero unless the nozzle is ganged.
    pub nozzle_pitch_rad: f64,
    /// Nozzle yaw; zero unless the nozzle is ganged.
    pub nozzle_yaw_rad: f64,
    /// Thrust, N.
    pub thrust_n: f64,
}

/// The references as the laws track them, after slew limit and lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct References {
    /// H_r, m.
    pub altitude_m: f64,
    /// φ_f, rad.
    pub roll_rad: f64,
}

/// The main controller: altitude, roll, yaw damper, speed hold.
#[derive(Debug, Clone)]
pub struct MainController {
    h: f64,
    /// 1 - exp(-h/τ) of the lag on the roll reference.
    lag_fraction: f64,
    references: Option<References>,
    /// The model's trim of the design point, about which [`Self::trim`] is a difference.
    design: LevelTurn,
    /// Without a climb for so long, s.
    settled_s: f64,
    altitude: Integral,
    roll: Integral,
    speed: Integral,
}

impl MainController {
    /// With empty integrators.
    #[must_use]
    pub fn new(gains: &MainGains, model: &DesignModel, period: ControlPeriod) -> Self {
        let h = period.as_seconds();
        let state = model.design_point();
        Self {
            h,
            lag_fraction: lag_fraction(gains, h),
            references: None,
            design: level_turn(model.belief(), &state, &model.condition(&state)),
            settled_s: 0.0,
            altitude: Integral::default(),
            roll: Integral::default(),
            speed: Integral::default(),
        }
    }

    /// Takes new gains; references and integrators stay.
    pub fn set_gains(&mut self, gains: &MainGains) {
        self.lag_fraction = lag_fraction(gains, self.h);
    }

    /// Empties the integrators; the references start from the state of the next step.
    pub fn reset(&mut self) {
        self.references = None;
        self.settled_s = 0.0;
        self.altitude = Integral::default();
        self.roll = Integral::default();
        self.speed = Integral::default();
    }

    /// The references as tracked in the last step.
    #[must_use]
    pub fn references(&self) -> Option<References> {
        self.references
    }

    /// One step. `saturated` is what the mixer could not give in the last step, `at` the condition of `state`.
    #[expect(clippy::too_many_arguments, reason = "state, inputs, gains and model of one law each")]
    pub fn step(
        &mut self,
        state: &State,
        at: &FlightCondition,
        demand: &Demand,
        saturated: &Saturation,
        gains: &MainGains,
        law: MainLaw,
        belief: &Belief,
    ) -> MainCommand {
        let references = self.track(state, demand, gains);
        let trim = self.trim(state, at, belief);
        let altitude_m = references.altitude_m;
        let elevator_rad =
            self.altitude_law(state, altitude_m, saturated, &gains.altitude, &trim, belief);
        let mut command = MainCommand {
            aileron_rad: self.roll_law(state, references.roll_rad, saturated, &gains.roll),
            elevator_rad,
            rudder_rad: gains.yaw.k_r * state.rates.z,
            nozzle_pitch_rad: 0.0,
            nozzle_yaw_rad: 0.0,
            thrust_n: self.speed_law(state, demand.airspeed_m_s, saturated, &gains.speed, belief),
        };
        if law == MainLaw::PidGangedNozzle {
            ganged_nozzle::gang(&mut command, state, belief);
        }
        command
    }

    fn track(&mut self, state: &State, demand: &Demand, gains: &MainGains) -> References {
        let mut references = self
            .references
            .unwrap_or(References { altitude_m: state.altitude_m, roll_rad: state.attitude.phi });
        let slew = gains.altitude.slew_m_s * self.h;
        references.altitude_m += (demand.altitude_m - references.altitude_m).clamp(-slew, slew);
        references.roll_rad += self.lag_fraction * (demand.roll_rad - references.roll_rad);
        self.references = Some(references);
        references
    }

    /// Trim of level flight at this airspeed, altitude, bank and thrust: that of the model file, plus what the
    /// model says that is different from the design point. At the design point the difference is zero.
    fn trim(&self, state: &State, at: &FlightCondition, belief: &Belief) -> LevelTurn {
        let here = level_turn(belief, state, at);
        LevelTurn {
            theta_rad: belief.trim.theta_rad + (here.theta_rad - self.design.theta_rad),
            elevator_rad: belief.trim.elevator_rad + (here.elevator_rad - self.design.elevator_rad),
            pitch_rate_rad_s: here.pitch_rate_rad_s,
        }
    }

    /// Elevator that holds the altitude.
    ///
    /// Implements Eq. (15), about the trim of level flight and with a limited altitude error.
    ///
    /// Differs from the paper: q, θ and the law enter as deviations from the trim of level flight at this
    /// dynamic pressure and bank; the altitude error is limited, the reference slews, and the integrator runs
    /// in a band and where the aircraft has stopped climbing, because the paper's law would saturate the
    /// elevators for a step of 1000 m. Beyond the stall onset the angle of attack pushes the nose down.
    fn altitude_law(
        &mut self,
        state: &State,
        reference_m: f64,
        saturated: &Saturation,
        gains: &AltitudeGains,
        trim: &LevelTurn,
        belief: &Belief,
    ) -> f64 {
        let error = state.altitude_m - reference_m;
        let stall = (state.alpha - belief.airframe.stall_onset_rad).max(0.0);
        let climbs = state.climb_rate_m_s.abs() >= gains.settled_climb_m_s;
        self.settled_s =
            if climbs { 0.0 } else { (self.settled_s + self.h).min(gains.settled_after_s) };
        let runs = error.abs() < gains.integral_band_m || self.settled_s >= gains.settled_after_s;
        // A negative error raises the nose.
        let blocked = saturated.elevator.blocks(error) || (stall > 0.0 && error < 0.0);
        let error = error.clamp(-gains.error_max_m, gains.error_max_m);
        if runs && !blocked {
            self.altitude.add(gains.k_hi * error * self.h, gains.integral_max_rad);
        }
        trim.elevator_rad
            + gains.k_q * (state.rates.y - trim.pitch_rate_rad_s)
            + gains.k_theta * (state.attitude.theta - trim.theta_rad)
            + gains.k_hd * state.climb_rate_m_s
            + gains.k_h * error
            + gains.k_alpha * stall
            + self.altitude.value()
    }

    /// Aileron that holds the roll angle; the rudder's yaw damper δr_c = K_r r stands in [`Self::step`].
    ///
    /// Implements Eq. (16).
    fn roll_law(
        &mut self,
        state: &State,
        reference_rad: f64,
        saturated: &Saturation,
        gains: &RollGains,
    ) -> f64 {
        let error = state.attitude.phi - reference_rad;
        if !saturated.aileron.blocks(error) {
            self.roll.add(gains.k_phi_i * error * self.h, gains.integral_max_rad);
        }
        gains.k_p * state.rates.x + gains.k_phi * error + self.roll.value()
    }

    /// Thrust that holds the airspeed, N. Not in the paper, which leaves the speed open.
    fn speed_law(
        &mut self,
        state: &State,
        reference_m_s: f64,
        saturated: &Saturation,
        gains: &SpeedGains,
        belief: &Belief,
    ) -> f64 {
        let error = reference_m_s - state.airspeed_m_s;
        if !saturated.thrust.blocks(error) {
            // Never more than the engine can give.
            let max = belief.effectors.thrust_range_n()[1] / belief.mass.mass_kg;
            self.speed.add(gains.k_vi * error * self.h, max);
        }
        belief.trim.thrust_n + belief.mass.mass_kg * (gains.k_v * error + self.speed.value())
    }
}

fn lag_fraction(gains: &MainGains, h: f64) -> f64 {
    1.0 - libm::exp(-h / gains.roll.reference_lag_s)
}

#[cfg(test)]
mod tests;
