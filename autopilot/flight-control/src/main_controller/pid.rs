//! The paper's main controller: altitude by elevator, roll by aileron, yaw damper, speed hold.

use serde::{Deserialize, Serialize};

use super::{Integral, Law, LawInput, MainCommand, Visitor};
use crate::aircraft_model::TrimModel;
use crate::design_model::atmosphere;

/// Largest factor of the feedback at low speed.
const LOW_SPEED_FACTOR_MAX: f64 = 3.0;

/// Gains of the PID.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PidGains {
    /// Altitude hold by elevator, see Eq. (15).
    pub altitude: AltitudeGains,
    /// Roll by aileron, see Eq. (16).
    pub roll: RollGains,
    /// Yaw damper by rudder, see Eq. (16).
    pub yaw: YawGains,
    /// Speed hold by thrust.
    pub speed: SpeedGains,
}

gain_set! {
    /// Gains of the altitude law.
    AltitudeGains at pid.altitude {
        /// K_q, s: elevator per pitch rate.
        k_q = 1.20, "ALT_KQ" "s", 0.01 to 20.0, "Elevator per pitch rate";
        /// K_θ: elevator per pitch angle.
        k_theta = 2.20, "ALT_KTH" "-", 0.01 to 20.0, "Elevator per pitch angle";
        /// K_hd, rad s/m: elevator per climb rate.
        k_hd = 0.0040, "ALT_KHD" "rad s/m", 1.0e-6 to 1.0, "Elevator per climb rate";
        /// K_h, rad/m: elevator per altitude error.
        k_h = 0.00125, "ALT_KH" "rad/m", 1.0e-7 to 1.0, "Elevator per altitude error";
        /// K_hi, rad/(m s): elevator rate per altitude error.
        k_hi = 0.00008, "ALT_KHI" "rad/(m s)", 1.0e-9 to 0.1, "Elevator rate per altitude error";
        /// Largest altitude error that the law sees, m; sets the climb rate.
        error_max_m = 400.0, "ALT_ERR_MAX" "m", 1.0 to 5000.0, "Largest altitude error that the law sees; sets the climb rate";
        /// The integrator runs while the altitude error is below this, m.
        integral_band_m = 60.0, "ALT_INT_BAND" "m", 0.1 to 5000.0, "Altitude integrator runs below this altitude error";
        /// Beyond the band it runs while the climb rate stays below this either way, m/s.
        settled_climb_m_s = 2.0, "ALT_INT_CLIMB" "m/s", 0.0 to 100.0, "Beyond its band the altitude integrator runs while the climb rate stays below this";
        /// Time that the climb rate must have been below it, s.
        settled_after_s = 3.0, "ALT_INT_WAIT" "s", 0.1 to 600.0, "Time that the climb rate must have been below ALT_INT_CLIMB";
        /// Largest contribution of the integrator, rad.
        integral_max_rad = 0.20, "ALT_INT_MAX" "rad", 0.001 to 0.5, "Largest elevator of the altitude integrator";
        /// K_α: elevator per angle of attack beyond the stall onset of the model.
        k_alpha = 8.0, "ALT_KALPHA" "-", 0.0 to 100.0, "Elevator per angle of attack beyond the stall onset";
    }
}

gain_set! {
    /// Gains of the roll law.
    RollGains at pid.roll {
        /// K_p, s: aileron per roll rate.
        k_p = 0.60, "ROL_KP" "s", 0.001 to 20.0, "Aileron per roll rate";
        /// K_φ: aileron per roll angle error.
        k_phi = 2.2, "ROL_KPHI" "-", 0.01 to 20.0, "Aileron per roll angle error";
        /// K_φi, 1/s: aileron rate per roll angle error; small, so that the integral trims and does not
        /// fight the compensator.
        k_phi_i = 0.005, "ROL_KPHII" "1/s", 1.0e-6 to 10.0, "Aileron rate per roll angle error";
        /// Largest contribution of the integrator, rad.
        integral_max_rad = 9.0, "ROL_INT_MAX" "rad", 0.001 to 10.0, "Largest aileron of the roll integrator";
    }
}

gain_set! {
    /// Gain of the yaw damper.
    YawGains at pid.yaw {
        /// K_r, s: rudder per yaw rate.
        k_r = 0.20, "YAW_KR" "s", 0.001 to 20.0, "Rudder per yaw rate";
    }
}

gain_set! {
    /// Gains of the speed hold.
    SpeedGains at pid.speed {
        /// K_V, 1/s: acceleration per speed error.
        k_v = 0.30, "SPD_KV" "1/s", 0.001 to 10.0, "Acceleration per speed error";
        /// K_Vi, 1/s²: acceleration rate per speed error.
        k_vi = 0.02, "SPD_KVI" "1/s^2", 1.0e-6 to 10.0, "Acceleration rate per speed error";
    }
}

impl PidGains {
    /// The set with which every outcome of the paper occurs; docs/paper.md gives the reasons.
    pub const REFERENCE: Self = Self {
        altitude: AltitudeGains::REFERENCE,
        roll: RollGains::REFERENCE,
        yaw: YawGains::REFERENCE,
        speed: SpeedGains::REFERENCE,
    };
}

/// The PID: gains, three integrators, and the trim about which it flies.
#[derive(Debug, Clone)]
pub struct Pid {
    gains: PidGains,
    /// Without a climb for so long, s.
    settled_s: f64,
    altitude: Integral,
    roll: Integral,
    speed: Integral,
}

impl Pid {
    /// With empty integrators.
    pub fn new(gains: &PidGains) -> Self {
        Self {
            gains: *gains,
            settled_s: 0.0,
            altitude: Integral::default(),
            roll: Integral::default(),
            speed: Integral::default(),
        }
    }

    /// Takes new gains; the integrators stay.
    pub fn set_gains(&mut self, gains: &PidGains) {
        self.gains = *gains;
    }

    /// Elevator that holds the altitude.
    ///
    /// Implements Eq. (15), about the trim of level flight and with a limited altitude error.
    ///
    /// Differs from the paper: q, θ and the law enter as deviations from the trim of level flight at this
    /// dynamic pressure and bank; the altitude error is limited, the reference slews, and the integrator runs
    /// in a band and where the aircraft has stopped climbing, because the paper's law would saturate the
    /// elevators for a step of 1000 m. Beyond the stall onset the angle of attack pushes the nose down.
    fn altitude_law(&mut self, input: &LawInput<'_>) -> f64 {
        let LawInput { state, references, saturated, model, h, .. } = *input;
        let gains = &self.gains.altitude;
        let trim = input.model.trim(input.state, input.at);
        let error = state.altitude_m - references.altitude_m;
        let stall = (state.alpha - model.aircraft().airframe.stall_onset_rad).max(0.0);
        let climbs = state.climb_rate_m_s().abs() >= gains.settled_climb_m_s;
        self.settled_s = if climbs { 0.0 } else { (self.settled_s + h).min(gains.settled_after_s) };
        // In its band alone the integrator left half of the healthy flights beside their altitude for good
        // (docs/decisions/104-altitude-law.md).
        let runs = error.abs() < gains.integral_band_m || self.settled_s >= gains.settled_after_s;
        // A negative error raises the nose.
        let blocked = saturated.elevator.blocks(error) || (stall > 0.0 && error < 0.0);
        let error = error.clamp(-gains.error_max_m, gains.error_max_m);
        let slow = low_speed_factor(input);
        if runs && !blocked {
            self.altitude.add(slow * gains.k_hi * error * h, gains.integral_max_rad);
        }
        // Term by term: without a ground the sum keeps its bits.
        trim.elevator_rad
            + slow * (gains.k_q * (state.rates.y - trim.pitch_rate_rad_s))
            + slow * (gains.k_theta * (state.attitude.theta - trim.theta_rad))
            + slow * (gains.k_hd * state.climb_rate_m_s())
            + slow * (gains.k_h * error)
            + slow * (gains.k_alpha * stall)
            + self.altitude.value()
    }

    /// Aileron that holds the roll angle; the rudder's yaw damper δr_c = K_r r stands in [`Law::step`].
    ///
    /// Implements Eq. (16).
    fn roll_law(&mut self, input: &LawInput<'_>) -> f64 {
        let LawInput { state, references, saturated, h, .. } = *input;
        let gains = &self.gains.roll;
        let error = state.attitude.phi - references.roll_rad;
        if !saturated.aileron.blocks(error) {
            self.roll.add(gains.k_phi_i * error * h, gains.integral_max_rad);
        }
        let feedback = gains.k_p * state.rates.x + gains.k_phi * error;
        low_speed_factor(input) * feedback + self.roll.value()
    }

    /// Thrust that holds the airspeed, N. Not in the paper, which leaves the speed open.
    fn speed_law(&mut self, input: &LawInput<'_>) -> f64 {
        let LawInput { state, references, saturated, model, h, .. } = *input;
        let (gains, aircraft) = (&self.gains.speed, model.aircraft());
        let error = references.airspeed_m_s - state.airspeed_m_s;
        if !saturated.thrust.blocks(error) {
            // Never more than the engine can give.
            let max = model.thrust_range_n()[1] / aircraft.mass.mass_kg;
            self.speed.add(gains.k_vi * error * h, max);
        }
        aircraft.trim.thrust_n + aircraft.mass.mass_kg * (gains.k_v * error + self.speed.value())
    }
}

/// What the feedback to the surfaces is multiplied by: over a ground, where the aircraft flies slower than at its design point, the
/// ratio of the dynamic pressures, so that the loops stay as fast as there. Without a ground the law is that of the paper.
fn low_speed_factor(input: &LawInput<'_>) -> f64 {
    let LawInput { state, model, .. } = *input;
    if !state.over_ground {
        return 1.0;
    }
    let pressure = |airspeed_m_s: f64, altitude_m: f64| {
        0.5 * atmosphere::density(altitude_m) * airspeed_m_s * airspeed_m_s
    };
    let TrimModel { airspeed_m_s, altitude_m, .. } = model.aircraft().trim;
    let here = pressure(state.airspeed_m_s, state.altitude_m).max(1.0);
    (pressure(airspeed_m_s, altitude_m) / here).clamp(1.0, LOW_SPEED_FACTOR_MAX)
}

impl Law for Pid {
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        let elevator_rad = self.altitude_law(input);
        MainCommand {
            aileron_rad: self.roll_law(input),
            elevator_rad,
            rudder_rad: self.gains.yaw.k_r * input.state.rates.z,
            nozzle_pitch_rad: 0.0,
            nozzle_yaw_rad: 0.0,
            thrust_n: self.speed_law(input),
        }
    }

    fn start_from(&mut self, input: &LawInput<'_>, command: &MainCommand) {
        let mut without = Self::new(&self.gains);
        // Without time, so that the integrators of this trial step stay empty.
        let proportional = without.step(&LawInput { h: 0.0, ..*input });
        let aircraft = input.model.aircraft();
        let PidGains { altitude, roll, .. } = &self.gains;
        let elevator = command.elevator_rad - proportional.elevator_rad;
        self.altitude.start(elevator, altitude.integral_max_rad);
        self.roll.start(command.aileron_rad - proportional.aileron_rad, roll.integral_max_rad);
        let mass_kg = aircraft.mass.mass_kg;
        let thrust = (command.thrust_n - proportional.thrust_n) / mass_kg;
        self.speed.start(thrust, aircraft.effectors.thrust_range_n()[1] / mass_kg);
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        for integral in [&mut self.altitude, &mut self.roll, &mut self.speed] {
            visit(integral.state());
        }
    }
}

/// δy per sideslip.
const NOZZLE_YAW_PER_SIDESLIP: f64 = 4.0;
/// δy per yaw rate, s.
const NOZZLE_YAW_PER_YAW_RATE_S: f64 = -0.4;

/// The PID with the nozzle ganged to it.
///
/// Baseline for an honest comparison: the same PID with the nozzle ganged to it, and no observer.
///
/// The paper gives the nozzle to the compensator alone, so part of the compensator's benefit is the
/// nozzle's. This static law shows how much: δz = -(δe - δe_trim), δy = 4 β - 0.4 r.
#[derive(Debug, Clone)]
pub struct PidGangedNozzle(Pid);

impl PidGangedNozzle {
    /// With empty integrators.
    pub fn new(gains: &PidGains) -> Self {
        Self(Pid::new(gains))
    }

    /// Takes new gains; the integrators stay.
    pub fn set_gains(&mut self, gains: &PidGains) {
        self.0.set_gains(gains);
    }
}

impl Law for PidGangedNozzle {
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        let (state, aircraft) = (input.state, input.model.aircraft());
        let mut command = self.0.step(input);
        // The elevator counts as far as it can go.
        let [min, max] = aircraft.effectors.command_range(|gains| gains.pitch);
        let elevator = command.elevator_rad.max(min).min(max);
        command.nozzle_pitch_rad = -(elevator - aircraft.trim.elevator_rad);
        command.nozzle_yaw_rad =
            NOZZLE_YAW_PER_SIDESLIP * state.beta + NOZZLE_YAW_PER_YAW_RATE_S * state.rates.z;
        command
    }

    fn start_from(&mut self, input: &LawInput<'_>, command: &MainCommand) {
        self.0.start_from(input, command);
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        self.0.states(visit);
    }
}

#[cfg(test)]
mod tests;
