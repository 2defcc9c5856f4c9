//! The procedure that finds every parameter of an aircraft from its plant and its model (docs/decisions/154-aircraft-new.md).
//!
//! ```text
//! trims over airspeed and altitude ─> speeds, climb, ceiling, bank ─> references, radii
//! model ─> authority, damping, lags ─> regulators ─> gains of PID, NDI and LQR, bandwidth of the observers
//! ```

use flight_control::aircraft_model::{AircraftModel, EffectorModel};
use flight_control::main_controller::lqr::LqrGains;
use flight_control::{DesignModel, Gains, NavigationState, gains};
use icd::units::STANDARD_GRAVITY_M_S2 as G_M_S2;
use icd::{AxisGains, ControlPeriod, EffectorKind, Ned};
use nalgebra::Vector3;
use plant_sim::atmosphere::{Atmosphere, LocalDensity};
use plant_sim::dynamics::Dynamics;
use plant_sim::gear::ContactPoint;
use plant_sim::{Start, trim};

use autopilot::parameters::{Parameter, table};
use host_io::problem::{Problem, problem};

use crate::design::{self, Weights};

/// Crossover of a rate loop times lag and delay of its servo: 23 degrees of its phase margin are theirs.
const CROSSOVER: f64 = 0.4;
/// Control periods of delay: sampling, and the hold of the command.
const DELAY_PERIODS: f64 = 1.5;
/// Step of the search over airspeed, and its largest number of steps.
const STEP: f64 = 1.02;
const STEPS_MAX: u32 = 60;
/// Step and end of the search over altitude, m.
const ALTITUDE_STEP_M: f64 = 500.0;
const ALTITUDE_MAX_M: f64 = 20_000.0;
/// Part of the thrust that steady flight may use.
const THRUST_PART: f64 = 0.9;
/// Part of the excess of power that a demanded climb uses.
const CLIMB_PART: f64 = 0.6;
/// Lowest airspeed reference over the lowest that can be flown, and over the stall.
const SLOWEST_OVER_STALL: f64 = 1.25;
/// Bank limits that are ever given, deg.
const BANK_DEG: [f64; 2] = [20.0, 45.0];
/// A rudder command with less effect than this is none, rad/s² per rad.
const RUDDER_MIN: f64 = 0.02;
/// Takeoff climbs for this time, s, but at least so high above the lowest altitude reference, m.
const TAKEOFF_S: f64 = 20.0;
const TAKEOFF_MIN_M: f64 = 30.0;
/// Turn radii are flown with this part of the largest bank.
const BANK_PART: f64 = 0.7;
/// Ratio of neighbouring coefficients of a closed loop, a₁²/(a₀ a₂): the damping optimum of Kessler and Naslin.
const RATIO: f64 = 2.0;
/// Bandwidth of an inner loop over that of the one around it, where that one is not part of the optimum.
const OUTER: f64 = 4.0;
/// With roll reversal: weight of the roll's integral, rad, and period of the guidance, over and times the rate of the divergence.
const REVERSED_INTEGRAL: f64 = 0.15;
const REVERSED_PERIOD: f64 = 40.0;
/// Digits of a parameter.
const DIGITS: usize = 3;

/// What the aircraft can do in level flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Performance {
    /// Lowest true airspeed of level flight at the design altitude, m/s.
    pub slowest_m_s: f64,
    /// Highest one with `THRUST_PART` of the thrust, m/s.
    pub fastest_m_s: f64,
    /// Climb rate with `CLIMB_PART` of the power at the design airspeed, m/s.
    pub climb_m_s: f64,
    /// Sink rate at the design airspeed with the least thrust, m/s.
    pub sink_m_s: f64,
    /// Altitude where `CLIMB_PART` of the power still gives a third of that climb, m.
    pub ceiling_m: f64,
}

/// Parameters by name, and what is weak.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ParameterSet {
    /// Value of each parameter.
    pub values: Vec<(&'static str, f64)>,
    /// What an operator should know.
    pub weak: Vec<String>,
}

/// The aircraft as the procedure sees it.
pub struct Procedure<'a> {
    dynamics: &'a Dynamics,
    start: Start,
    model: DesignModel,
    period: ControlPeriod,
}

/// Level flight at one condition.
struct LevelFlight {
    thrust_n: f64,
    thrust_range_n: [f64; 2],
}

impl<'a> Procedure<'a> {
    /// Of a plant at its design point and the model made of it.
    pub fn new(
        dynamics: &'a Dynamics,
        start: Start,
        model: AircraftModel,
        period: ControlPeriod,
    ) -> Self {
        Self { dynamics, start, model: DesignModel::new(model), period }
    }

    /// Level flight below the stall onset, if there is any.
    fn level(&self, altitude_m: f64, airspeed_m_s: f64) -> Option<LevelFlight> {
        let start = Start { altitude_m, airspeed_m_s, ..self.start };
        let trim = trim::solve(self.dynamics, &start, &Ned::zero()).ok()?;
        let density = LocalDensity::of(&Atmosphere::STANDARD, altitude_m).at(altitude_m);
        let thrust_range_n = self.dynamics.thrust_range_n(airspeed_m_s, density, altitude_m);
        let onset = self.model.aircraft().airframe.stall_onset_rad;
        (trim.alpha_rad <= onset).then_some(LevelFlight { thrust_n: trim.thrust_n, thrust_range_n })
    }

    /// Climb rate with the thrust that is left, m/s.
    fn climb_m_s(&self, level: &LevelFlight, airspeed_m_s: f64) -> f64 {
        let weight = self.model.aircraft().mass.mass_kg * G_M_S2;
        CLIMB_PART * (level.thrust_range_n[1] - level.thrust_n) * airspeed_m_s / weight
    }

    /// Searches along level flights from the design point.
    pub fn performance(&self) -> Result<Performance, Problem> {
        let Start { altitude_m, airspeed_m_s: v, .. } = self.start;
        let design = self
            .level(altitude_m, v)
            .ok_or_else(|| problem!("the design point is beyond the stall onset of the model"))?;
        let last = |step: f64, flies: &dyn Fn(f64) -> bool| {
            (0..STEPS_MAX).map(|i| libm::pow(step, f64::from(i))).take_while(|x| flies(*x)).last()
        };
        let slowest = last(1.0 / STEP, &|x| self.level(altitude_m, v * x).is_some());
        let fastest = last(STEP, &|x| {
            let level = self.level(altitude_m, v * x);
            level.is_some_and(|l| l.thrust_n <= THRUST_PART * l.thrust_range_n[1])
        });
        let climb_m_s = self.climb_m_s(&design, v);
        let density = |altitude_m| Atmosphere::STANDARD.air(altitude_m).density;
        let climbs_at = |height_m: &f64| {
            let v = v * (density(altitude_m) / density(*height_m)).sqrt();
            let level = self.level(*height_m, v);
            level.is_some_and(|level| self.climb_m_s(&level, v) >= climb_m_s / 3.0)
        };
        let heights = (1..=STEPS_MAX).map(|i| altitude_m + ALTITUDE_STEP_M * f64::from(i));
        let ceiling_m = heights.take_while(climbs_at).last().unwrap_or(altitude_m);
        let weight = self.model.aircraft().mass.mass_kg * G_M_S2;
        Ok(Performance {
            slowest_m_s: v * slowest.unwrap_or(1.0),
            fastest_m_s: v * fastest.unwrap_or(1.0),
            climb_m_s,
            sink_m_s: (design.thrust_n - design.thrust_range_n[0]) * v / weight,
            ceiling_m: ceiling_m.min(ALTITUDE_MAX_M),
        })
    }

    /// Longest lag of the effectors that follow a part of the main command, with the delay of the control, s.
    fn lag_s(&self, gain: fn(&AxisGains) -> f64) -> f64 {
        let effectors = &self.model.aircraft().effectors;
        // A wheel does nothing in the air.
        let in_air =
            effectors.list.all().filter(|e| effectors.list.kind(*e) != Some(EffectorKind::Wheel));
        let follows = in_air.filter(|e| gain(&effectors.gains[*e]) != 0.0);
        let lag_s = follows.map(|e| effectors.servos[e].lag_s).fold(0.0, f64::max);
        lag_s + DELAY_PERIODS * self.period.as_seconds()
    }

    /// How far a command can go both ways from its trim, rad.
    fn reach_rad(&self, gain: fn(&AxisGains) -> f64, trim_rad: f64) -> f64 {
        let [low, high] = self.model.aircraft().effectors.command_range(gain);
        (high - trim_rad).min(trim_rad - low).max(0.0)
    }

    /// How far the rudder command goes both ways, rad; zero where nothing that follows it acts in the air.
    fn rudder_rad(&self) -> f64 {
        let [.., yaw] = self.authority();
        if yaw.abs() < RUDDER_MIN { 0.0 } else { self.reach_rad(|g| g.yaw, 0.0) }
    }

    /// Angle of a wheel, positive to the right, over the rudder command; zero for one that the law on the ground does not turn.
    fn steering_ratio(&self, wheel: &ContactPoint) -> f64 {
        let EffectorModel { list, gains, .. } = &self.model.aircraft().effectors;
        wheel.steering.map_or(0.0, |steering| {
            let by = list.all().find(|e| steering.effector.as_str() == list.name(*e));
            by.map_or(0.0, |e| steering.ratio * gains[e].yaw)
        })
    }

    /// The law on the ground.
    fn on_ground(&self, found: &mut ParameterSet) {
        // The rate loop of the attitude has twice its bandwidth.
        let lag_s = self.lag_s(|g| g.roll).max(self.lag_s(|g| g.pitch)).max(self.lag_s(|g| g.yaw));
        found.set("GND_ATT", 0.5 * CROSSOVER / lag_s);
        let contacts = self.dynamics.airframe().gear.iter().flat_map(|gear| &gear.contacts);
        let (steered, rolling): (Vec<&ContactPoint>, Vec<&ContactPoint>) = contacts
            .filter(|contact| contact.is_wheel())
            .partition(|wheel| self.steering_ratio(wheel) != 0.0);
        let Some(wheel) = steered.first() else {
            // The rudder alone acts: it turns about as a wheel at a span's distance would.
            found.set("GND_STEER", self.model.aircraft().geometry.span_m);
            if !rolling.is_empty() {
                found.weak.push("nothing steers its wheels on the ground: none turns with an effector that has a gain in yaw".to_owned());
            }
            return;
        };
        // The others turn the aircraft about the middle of their axles.
        let axle_m =
            rolling.iter().map(|wheel| wheel.at_m[0]).sum::<f64>() / rolling.len().max(1) as f64;
        let base_m = (wheel.at_m[0] - axle_m) / -self.steering_ratio(wheel);
        if base_m <= 0.0 {
            found.weak.push(format!(
                "a rudder command to the left steers `{}` so that the aircraft turns right",
                wheel.name
            ));
        }
        found.set("GND_STEER", base_m.abs());
    }

    /// Weights from authority, speed and lag, cut until each loop is slow enough for its servo.
    fn weights(&self, thrust_m_s2: f64) -> Result<(Weights, LqrGains), Problem> {
        let model = self.model.aircraft();
        let v = model.trim.airspeed_m_s;
        let [roll_s, pitch_s, yaw_s] =
            [self.lag_s(|g| g.roll), self.lag_s(|g| g.pitch), self.lag_s(|g| g.yaw)];
        let engine_s = self.lag_s(|g| g.thrust);
        // Time scales of the two motions: the servo's, with room for the loops around one another.
        let (t, t_roll) = (20.0 * pitch_s, 6.0 * roll_s);
        let climb = 0.1 * v;
        let altitude = 1.2 * t * climb;
        let speed = 0.02 * v;
        let mut weights = Weights {
            longitudinal_states: [
                climb,
                speed,
                0.1,
                0.1 / t,
                altitude,
                17.0 * t * altitude,
                15.0 * t * speed,
            ],
            longitudinal_inputs: [
                0.5 * self.reach_rad(|g| g.pitch, model.trim.elevator_rad),
                thrust_m_s2,
            ],
            lateral_states: [0.2, 0.15 / t_roll, 0.2 / t, 0.15, 66.0 * 0.15 * t],
            lateral_inputs: [
                0.5 * self.reach_rad(|g| g.roll, 0.0),
                // Without a rudder the regulator still needs a weight on it.
                (0.25 * self.rudder_rad()).max(0.01),
            ],
            error_max_m: 3.0 * altitude,
        };
        if let Some(rate) = self.reversal() {
            // Only the integral turns the ailerons over.
            let [.., integral] = &mut weights.lateral_states;
            *integral = integral.min(REVERSED_INTEGRAL / rate);
        }
        let [roll, pitch, yaw] = self.authority();
        for _ in 0..STEPS_MAX {
            let gains = design::design(model, self.period, &weights)?;
            let ([elevator, thrust], [aileron, rudder]) =
                (&mut weights.longitudinal_inputs, &mut weights.lateral_inputs);
            // At the crossover the loop is K B / s.
            let cuts = [
                (gains.elevator.q * pitch * pitch_s, elevator),
                (gains.thrust.airspeed * engine_s, thrust),
                (gains.aileron.p * roll * roll_s, aileron),
                (gains.rudder.r * yaw * yaw_s, rudder),
            ];
            let mut is_cut = false;
            for (crossover, largest) in cuts {
                if crossover.abs() > CROSSOVER {
                    *largest *= 0.8;
                    is_cut = true;
                }
            }
            if !is_cut {
                return Ok((weights, gains));
            }
        }
        Err(problem!("no gains are slow enough for the lags of the actuators"))
    }

    /// Gains of the PID: those of the regulator, with the pitch angle weighted until it stiffens the aircraft, as this law wants it.
    fn pid(&self, mut weights: Weights) -> Result<([f64; 5], [f64; 3]), Problem> {
        let mut gains = design::pid(&self.model, self.period, &weights)?;
        for _ in 0..STEPS_MAX {
            let ([_, k_theta, k_q, ..], _) = gains;
            if k_theta >= k_q {
                break;
            }
            weights.longitudinal_states[2] *= 0.9;
            gains = design::pid(&self.model, self.period, &weights)?;
        }
        Ok(gains)
    }

    /// Angular acceleration about its own axis per rad of aileron, elevator and rudder command, 1/s².
    fn authority(&self) -> [f64; 3] {
        let model = &self.model;
        [
            design::per_command(model, |command, d| command.aileron_rad = d).x,
            design::per_command(model, |command, d| command.elevator_rad = d).y,
            design::per_command(model, |command, d| command.rudder_rad = d).z,
        ]
    }

    /// Rate, 1/s, at which the nose turns away while the ailerons hold the roll angle: the zero from aileron to roll that is not
    /// stable. Their adverse yaw is then stronger than what turns the nose into the wind, and a roll that lasts needs them the other
    /// way (W. F. Phillips, "Mechanics of Flight", Wiley 2010, calls it aileron reversal by adverse yaw). A rudder would hold the nose.
    /// Without the side force, which the model does not have.
    fn reversal(&self) -> Option<f64> {
        let aileron = design::per_command(&self.model, |command, d| command.aileron_rad = d);
        let held = |slope: Vector3<f64>| slope.z - slope.x * aileron.z / aileron.x;
        let beta = held(design::slope(&self.model, |state, d| state.beta += d));
        let r = held(design::slope(&self.model, |state, d| state.rates.z += d));
        // s² - r s + beta.
        let rate = 0.5 * r + (0.25 * r * r - beta).max(0.0).sqrt();
        (self.rudder_rad() == 0.0 && beta < 0.0).then_some(rate)
    }

    /// All parameters but the detector levels, which a flight measures.
    pub fn parameters(&self, able: &Performance) -> Result<ParameterSet, Problem> {
        let mut found = ParameterSet::default();
        let model = self.model.aircraft();
        let v = model.trim.airspeed_m_s;
        let mass_kg = model.mass.mass_kg;
        let [_, thrust_max_n] = model.effectors.thrust_range_n();
        let excess_m_s2 = (THRUST_PART * thrust_max_n - model.trim.thrust_n).max(0.0) / mass_kg;
        let (weights, lqr) = self.weights((0.25 * excess_m_s2).max(0.01))?;
        let ([k_hd, k_theta, k_q, k_h, k_hi], [k_p, k_phi, k_phi_i]) = self.pid(weights)?;
        let climb = able.climb_m_s.min(1.5 * able.sink_m_s).max(0.1);
        // Steady climb of the PID: k_hd h' + k_theta h'/V = k_h e.
        let error_max_m = climb * (k_hd + k_theta / v) / k_h;
        let lqr_error_max_m =
            climb * (lqr.elevator.climb + lqr.elevator.theta / v) / lqr.elevator.altitude;
        let lag = [self.lag_s(|g| g.roll), self.lag_s(|g| g.pitch), self.lag_s(|g| g.yaw)];
        found.pid_gains(self, [k_hd, k_theta, k_q, k_h, k_hi], [k_p, k_phi, k_phi_i], error_max_m);
        let engine_s = self.lag_s(|g| g.thrust);
        let k_v = (0.3 / engine_s).min(excess_m_s2 / (0.1 * v));
        found.set("SPD_KV", k_v);
        found.set("SPD_KVI", 0.2 * k_v * k_v);
        found.ndi_gains(self, climb, k_v);
        let all =
            Gains { lqr: LqrGains { error_max_m: lqr_error_max_m, ..lqr }, ..Gains::REFERENCE };
        for tunable in gains::LQR {
            found.set(tunable.name, (tunable.get)(&all));
        }
        // Two and a half times as fast as the servo: what it estimates is what the servo can still answer.
        let bandwidth = 2.5 / lag[0].max(lag[1]).max(lag[2]);
        for name in ["OBS_W0", "LES_W0", "INC_W0"] {
            found.set(name, bandwidth);
        }
        // All surfaces share the compensation: an aircraft need not have a nozzle.
        found.set("FTC_ALLOC", 1.0);
        self.references(able, climb, k_p / k_phi, lag[0], &mut found);
        if design::slope(&self.model, |state, d| state.beta += d).z <= 0.0 {
            let has_rudder = self.rudder_rad() > 0.0;
            let held = if has_rudder { "the rudder alone does" } else { "no effector yaws" };
            let c_yaw_beta = model.airframe.c_yaw_beta;
            found.weak.push(format!(
                "c_yaw_beta = {c_yaw_beta} does not turn the nose into the wind, and {held}: turns slip"
            ));
        }
        if let Some(rate) = self.reversal() {
            found.weak.push(format!(
                "ailerons that hold the roll turn the nose out of the wind at {rate:.2} 1/s, and no effector yaws: a turn begins the wrong \
                 way and takes {:.0} s",
                2.0 / rate
            ));
        }
        Ok(found)
    }

    /// Limits of references, radii and guidance.
    fn references(
        &self,
        able: &Performance,
        climb: f64,
        roll_s: f64,
        roll_lag_s: f64,
        found: &mut ParameterSet,
    ) {
        let Start { altitude_m, airspeed_m_s: v, .. } = self.start;
        let at = Atmosphere::STANDARD.air(altitude_m).density;
        // References are calibrated airspeeds.
        let calibrated = (at / Atmosphere::STANDARD.air(0.0).density).sqrt();
        let slowest = SLOWEST_OVER_STALL * able.slowest_m_s;
        if slowest > 0.9 * v {
            found.weak.push(format!(
                "the design airspeed is only {:.2} of the lowest one, {:.1} m/s: turns and gusts have little room",
                v / able.slowest_m_s,
                able.slowest_m_s
            ));
        }
        found.set("FW_AIRSPD_MIN", calibrated * slowest.min(0.9 * v));
        let fastest = able.fastest_m_s.min(1.5 * v);
        if fastest < 1.1 * v {
            found.weak.push(format!(
                "{:.0} % of the thrust give {fastest:.1} m/s, hardly more than the design airspeed",
                100.0 * THRUST_PART
            ));
        }
        found.set("FW_AIRSPD_MAX", calibrated * fastest.max(1.05 * v));
        // In a turn the stall is at V sqrt(n); a tenth is left for gusts.
        let load = libm::pow(v / (1.1 * able.slowest_m_s), 2.0).max(1.0);
        let stall_deg = libm::acos(1.0 / load).to_degrees();
        let bank_deg = stall_deg.clamp(BANK_DEG[0], BANK_DEG[1]);
        if stall_deg < BANK_DEG[0] {
            found.weak.push(format!("a turn stalls beyond {stall_deg:.0} deg of bank"));
        }
        found.set("NAV_BANK_MAX", bank_deg);
        found.set("REF_ROLL_MAX", bank_deg);
        let bank = (BANK_PART * bank_deg).to_radians();
        // Room for a wind of a seventh of the airspeed.
        found.set("NAV_LOITER_RAD", 1.3 * v * v / (G_M_S2 * libm::tan(bank)));
        found.set("NAV_ACC_RAD", 0.8 * v);
        found.set("NAV_CLIMB_MAX", climb);
        found.set("ALT_SLEW", climb);
        found.set("ROL_LAG", roll_s);
        let period_s = (24.0 * (2.0 * roll_s + roll_lag_s)).max(5.0);
        let reversed_s = self.reversal().map_or(0.0, |rate| REVERSED_PERIOD / rate);
        found.set("FW_L1_PERIOD", period_s.max(reversed_s));
        let [roll, ..] = self.authority();
        let damping = design::slope(&self.model, |state, d| state.rates.x += d).x;
        // Most of the steady roll rate of half the travel.
        let half = 0.5 * self.reach_rad(|g| g.roll, 0.0);
        let roll_rate = 0.8 * (roll * half / damping.min(-0.1)).abs();
        found.set("FW_PN_R_SLEW_MAX", roll_rate.to_degrees().min(90.0));
        let lowest_m = (self.dynamics.airframe().limits.altitude_min_m + 30.0).min(altitude_m);
        found.set("REF_ALT_MIN", lowest_m);
        found.set("REF_ALT_MAX", able.ceiling_m.max(altitude_m));
        found.set("RTL_RETURN_ALT", altitude_m);
        found.set("MIS_TAKEOFF_ALT", lowest_m + (TAKEOFF_S * climb).max(TAKEOFF_MIN_M));
        self.on_ground(found);
        if climb < 0.03 * v {
            found.weak.push(format!("climbs and descents are limited to {climb:.2} m/s"));
        }
    }
}

impl ParameterSet {
    fn pid_gains(
        &mut self,
        of: &Procedure<'_>,
        [k_hd, k_theta, k_q, k_h, k_hi]: [f64; 5],
        [k_p, k_phi, k_phi_i]: [f64; 3],
        error_max_m: f64,
    ) {
        let aircraft = of.model.aircraft();
        let v = aircraft.trim.airspeed_m_s;
        self.set("ALT_KQ", k_q);
        self.set("ALT_KTH", k_theta);
        self.set("ALT_KHD", k_hd);
        self.set("ALT_KH", k_h);
        self.set("ALT_KHI", k_hi);
        self.set("ALT_ERR_MAX", error_max_m);
        self.set("ALT_INT_BAND", 0.2 * error_max_m);
        self.set("ALT_INT_CLIMB", 0.0076 * v);
        self.set("ALT_INT_WAIT", 60.0 * of.lag_s(|g| g.pitch));
        self.set("ALT_INT_MAX", 0.4 * of.reach_rad(|g| g.pitch, aircraft.trim.elevator_rad));
        self.set("ALT_KALPHA", 2.0 * k_theta);
        self.set("ROL_KP", k_p);
        self.set("ROL_KPHI", k_phi);
        self.set("ROL_KPHII", k_phi_i);
        self.set("ROL_INT_MAX", of.reach_rad(|g| g.roll, 0.0));
        // The rudder brings the Dutch roll to a damping of one half, as far as its lag and the turn rate of the largest bank allow.
        let [.., yaw] = of.authority();
        let stiffness = design::slope(&of.model, |state, d| state.beta += d).z;
        let damping = -design::slope(&of.model, |state, d| state.rates.z += d).z;
        let wanted = (stiffness.max(0.0).sqrt() - damping).max(0.0) / yaw.abs().max(1.0e-6);
        let slow_enough = CROSSOVER / (yaw.abs().max(1.0e-6) * of.lag_s(|g| g.yaw));
        let in_turns = 0.2 * of.rudder_rad() * v / G_M_S2;
        // Without a rudder the gain moves nothing.
        self.set("YAW_KR", wanted.min(slow_enough).min(in_turns).max(0.001));
    }

    /// The rate loop of an inversion is τ s² + (1 + τ d) s + K + τ m with the lag τ, damping d and stiffness m of the airframe, which
    /// it cancels one lag too late; the loops around it follow with the same ratio of coefficients.
    fn ndi_gains(&mut self, of: &Procedure<'_>, climb: f64, k_v: f64) {
        let slope = |change: &dyn Fn(&mut NavigationState, f64)| design::slope(&of.model, change);
        let [roll, pitch, yaw] = [
            (of.lag_s(|g| g.roll), -slope(&|state, d| state.rates.x += d).x, 0.0),
            (
                of.lag_s(|g| g.pitch),
                -slope(&|state, d| state.rates.y += d).y,
                -slope(&|state, d| state.alpha += d).y,
            ),
            (
                of.lag_s(|g| g.yaw),
                -slope(&|state, d| state.rates.z += d).z,
                slope(&|state, d| state.beta += d).z,
            ),
        ]
        .map(|(lag_s, damping, stiffness)| {
            let second = 1.0 + lag_s * damping.max(0.0);
            let first = second * second / (RATIO * lag_s);
            let rate = (first - lag_s * stiffness.max(0.0)).max(0.1 * first);
            let angle = first * first / (RATIO * second);
            // Gains of rate and angle, and the bandwidth that the angle has.
            (rate, angle / rate, angle / first)
        });
        self.set("NDI_KP", roll.0);
        self.set("NDI_KPHI", roll.1);
        self.set("NDI_KPHII", roll.1 * roll.1 / 45.0);
        self.set("NDI_KQ", pitch.0);
        self.set("NDI_KALPHA", pitch.1);
        let path = pitch.2 / OUTER;
        self.set("NDI_KGAMMA", path);
        self.set("NDI_KH", path / OUTER);
        self.set("NDI_KHI", libm::pow(path / OUTER, 2.0) / 8.0);
        let has_rudder = of.rudder_rad() > 0.0;
        self.set("NDI_KR", if has_rudder { yaw.0 } else { 0.1 });
        self.set("NDI_KBETA", if has_rudder { yaw.2 / OUTER } else { 0.0 });
        self.set("NDI_CLIMB_MAX", climb);
        self.set("NDI_KV", k_v);
        self.set("NDI_KVI", 0.2 * k_v * k_v);
    }

    /// Rounded, and inside the range of the parameter; a value that is cut is weak.
    pub fn set(&mut self, name: &'static str, value: f64) {
        let Some(Parameter { min, max, unit, .. }) = table().iter().find(|row| row.name == name)
        else {
            return;
        };
        let rounded = format!("{:.*e}", DIGITS - 1, value).parse().unwrap_or(value);
        if !(*min..=*max).contains(&rounded) {
            self.weak.push(format!("{name} would be {rounded} {unit}; {min} to {max} is allowed"));
        }
        let kept = if rounded.is_nan() { *min } else { rounded.clamp(*min, *max) };
        self.values.retain(|(known, _)| *known != name);
        self.values.push((name, kept));
    }

    /// The table of a model file.
    pub fn table(&self) -> String {
        let heading = "[parameters]\n# By `sitl aircraft new` (docs/airframes.md); change what a flight of yours shows.\n";
        let line = |(name, value): &(&str, f64)| format!("{name} = {value:?}\n");
        heading.to_owned() + &self.values.iter().map(line).collect::<String>()
    }
}
