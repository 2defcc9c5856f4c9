//! Step two b beyond the paper: the paper's command where that can be flown, and something better where it cannot.
//!
//! Not in the paper. The compensation of Eq. (25) is what this law prefers. Where it does not fit into the travel,
//! bounded weighted least squares ([`crate::allocation`]) take what all surfaces and nozzle angles can give together. What
//! is still missing in yaw is left to the sideslip, and the ailerons hold against its rolling moment at once, not
//! when it has become a roll angle:
//!
//! ```text
//! a  = B u_main - z2 - σ M [Q S b C_lβ (β + x), 0, 0]        demanded angular acceleration
//! u  = argmin |W_v (B u - a)|² + γ⁻¹ |W_u (u - u_p)|²        u_p: main command and Eq. (25), before limits
//! s  = (a - B u)_yaw,  s̄ = s after a lag,  σ -> min(1, |s̄| / s_full)
//! δy = u_δy + (s - s̄) / B_δy
//! ```
//!
//! x leads the sideslip while that grows. The allocation leaves a reserve of the nozzle's yaw travel, which serves
//! what is quicker than the lag. The rudder stays with the main controller: a jammed one that is counted on would be
//! commanded to its end, and the yaw of the others with it. Where it is known to be healthy ([`Known`]) and the nozzle's yaw is
//! not, it gives what the others leave of the yaw, s̄, and no more: its roll is not what it is used for.
//!
//! [`thrust`] has the thrust that the nozzle needs for all that; [`crate::oscillation`] gives the estimate that is
//! compensated. While the compensator sleeps the commands are those of the main controller, to the bit.

use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{ControlPeriod, Effector, PerEffector};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::Visitor;
use crate::activation::ActivationGains;
use crate::allocation::{self, ActiveSet, Bound, Settings};
use crate::allocator::{Columns, Increments};
use crate::compensator::compensate;
use crate::design_model::{DesignModel, FlightCondition};
use crate::isolation::Known;
use crate::mixer::{Mixed, Mixer};
use crate::navigation::NavigationState;
use crate::oscillation::{OscillationWatch, Quiet};
use crate::signals::{Compensation, EffectorSet, MainCommand, Side};
use gains::ReliefGains;
use thrust::Thrust;

pub mod gains;
pub mod thrust;

/// Roll before pitch before yaw, and demand before preference.
const SETTINGS: Settings =
    Settings { priority: Vector3::new(10.0, 5.0, 1.0), demand_over_preference: 1.0e4 };

/// Missing roll and pitch acceleration from which on the integrators of the main controller wait, rad/s².
const WINDUP: [f64; 2] = [0.05, 0.01];

/// Numbers of one step, for logs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ReliefLog {
    /// s̄: yaw acceleration that is missing, after its lag, rad/s².
    pub yaw_shortage: f64,
    /// σ: how much of the rolling moment of the sideslip the ailerons hold against, 0 to 1.
    pub relief: f64,
    /// Thrust added because the yaw shortage grows, N.
    pub boost_n: f64,
    /// Smallest thrust that is commanded, N; zero without a floor.
    pub thrust_floor_n: f64,
    /// How much is held back because the compensation oscillates.
    pub quiet: Quiet,
}

/// What the law reports to the operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CompensationHealth {
    /// The thrust floor is above the thrust that the main controller asks for.
    pub thrust_floor: bool,
    /// The compensation has oscillated, and only the steady part of the estimate is compensated.
    pub yields: bool,
}

/// All that one step is given.
#[derive(Debug, Clone, Copy)]
pub struct ReliefInput<'a> {
    /// What is known of the aircraft.
    pub state: &'a NavigationState,
    /// Dynamic pressure and arms at `state`.
    pub at: &'a FlightCondition,
    /// Airspeed reference, m/s.
    pub airspeed_reference_m_s: f64,
    /// How much of the compensation is let through, 0 to 1.
    pub fade: f64,
    /// Step one's command, before limits.
    pub main: &'a MainCommand,
    /// The model of the healthy aircraft.
    pub model: &'a DesignModel,
    /// Commands to effectors.
    pub mixer: &'a Mixer,
    /// What is known of effectors that are not healthy.
    pub known: &'a Known,
}

/// The commands of both steps, and what is reported of them.
#[derive(Debug, Clone, Copy)]
pub struct Relieved {
    /// The demand of Eq. (25), before limits.
    pub compensation: Compensation,
    /// Commands and what could not be given.
    pub mixed: Mixed,
    /// Numbers.
    pub log: ReliefLog,
    /// What the operator has to know.
    pub health: CompensationHealth,
}

/// The law with what it remembers.
#[derive(Debug, Clone)]
pub struct Relief {
    h: f64,
    awake: AwakeRelief,
    watch: OscillationWatch,
    /// The estimate that is compensated, rad/s².
    z2: Vector3<f64>,
    quiet: Quiet,
}

/// What is forgotten when the compensator sleeps.
#[derive(Debug, Clone, Default)]
struct AwakeRelief {
    active: ActiveSet,
    /// s̄, rad/s².
    shortage: f64,
    /// σ.
    relief: f64,
    /// What a healthy rudder gives of s̄, rad/s².
    rudder: f64,
    thrust: Thrust,
}

impl Relief {
    /// Nothing is missing.
    pub fn new(period: ControlPeriod) -> Self {
        Self {
            h: period.as_seconds(),
            awake: AwakeRelief::default(),
            watch: OscillationWatch::default(),
            z2: Vector3::zeros(),
            quiet: Quiet::default(),
        }
    }

    /// Back to the start.
    pub fn reset(&mut self) {
        self.awake = AwakeRelief::default();
        self.watch.reset();
        (self.z2, self.quiet) = (Vector3::zeros(), Quiet::default());
    }

    /// Shows the continuous states.
    pub fn states(&mut self, visit: &mut Visitor<'_>) {
        visit(&mut self.awake.shortage);
        visit(&mut self.awake.relief);
        self.awake.thrust.states(visit);
        self.watch.states(visit);
    }

    /// Takes the estimate, rad/s², of which `fade` is compensated. Before each [`Relief::step`].
    pub fn observe(
        &mut self,
        z2: &Vector3<f64>,
        fade: f64,
        model: &DesignModel,
        activation: &ActivationGains,
        gains: &ReliefGains,
    ) {
        let one_nozzle = model.nozzle_effectors().iter().all(Option::is_some);
        let levels = activation.levels();
        (self.z2, self.quiet) = self.watch.step(z2, &levels, fade, one_nozzle, gains, self.h);
    }

    /// One control period: the commands of both steps.
    pub fn step(&mut self, input: &ReliefInput<'_>, gains: &ReliefGains) -> Relieved {
        let ReliefInput { at, fade, model, mixer, .. } = *input;
        let mut main = *input.main;
        main.aileron_rad *= 1.0 - fade * gains.yield_main * self.quiet.main_roll;
        let input = &ReliefInput { main: &main, ..*input };
        let compensation = compensate(&self.z2, fade, model, at);
        let mixed = mixer.mix(&main, &Compensation::NONE);
        let log = ReliefLog { quiet: self.quiet, ..ReliefLog::default() };
        if fade == 0.0 {
            self.awake = AwakeRelief::default();
            let health = CompensationHealth::default();
            return Relieved { compensation, mixed, log, health };
        }
        let demand = self.demand(input, gains);
        let preferred = mixer.demanded(&main, &compensation);
        let main = &mixed.commands;
        // First without the rudder, which only gives what the others leave.
        let (mut positions, mut limited) =
            self.allocate(&demand, &preferred, main, 0.0, input, gains);
        let mut missing = demand - model.effectors(at, &positions);
        let quick = self.shortage(missing.z, gains);
        // Taken at once, since s̄ is late itself; given back by and by, since the others have to take it over.
        let left = self.awake.rudder * (1.0 - fraction(self.h, gains.shortage_lag_s));
        let yaw = if stands_in(input) { self.awake.shortage } else { left };
        self.awake.rudder = yaw;
        if yaw != 0.0 {
            (positions, limited) = self.allocate(&demand, &preferred, main, yaw, input, gains);
            missing = demand - model.effectors(at, &positions);
        }
        self.yaw(&mut positions, quick, input);

        let mut increments = Increments { limited, ..Increments::default() };
        for effector in model.aircraft().effectors.list.all() {
            increments.positions[effector] = positions[effector] - mixed.commands[effector];
        }
        let awake = &mut self.awake;
        let (boost_n, thrust_floor_n) = awake.thrust.step(
            &positions,
            missing.y,
            [awake.shortage, awake.relief],
            input,
            gains,
            self.h,
        );
        let mut at_floor = false;
        if let Some(engine) = model.engine() {
            let wanted = mixed.commands[engine] + boost_n;
            at_floor = thrust_floor_n > wanted;
            increments.positions[engine] = wanted.max(thrust_floor_n) - mixed.commands[engine];
        }
        let (yaw_shortage, relief) = (awake.shortage, awake.relief);
        Relieved {
            compensation,
            mixed: saturate(mixer.add(mixed, &increments), &missing, at_floor, model),
            log: ReliefLog { yaw_shortage, relief, boost_n, thrust_floor_n, ..log },
            health: CompensationHealth { thrust_floor: at_floor, yields: self.quiet.any() },
        }
    }

    /// a: the demanded angular acceleration of all effectors, rad/s².
    fn demand(&self, input: &ReliefInput<'_>, gains: &ReliefGains) -> Vector3<f64> {
        let ReliefInput { state, at, fade, main, model, mixer, .. } = *input;
        // Before limits: what the travel cuts off the main command is to be given by other effectors.
        let main = model.effectors(at, &mixer.demanded(main, &Compensation::NONE));
        let beta = model.effective_angle(state.beta) + lead(state, gains);
        let roll = at.q_s_b * model.aircraft().airframe.c_roll_beta * beta;
        let relief = model.angular(&Vector3::new(roll, 0.0, 0.0));
        main - fade * (self.z2 + self.awake.relief * relief)
    }

    /// u: positions of all angles inside their travel, rad, and which are at an end of it. Other entries are those of `main`.
    /// The rudder gives up to `yaw`, rad/s².
    fn allocate(
        &mut self,
        demand: &Vector3<f64>,
        preferred: &PerEffector<f64>,
        main: &PerEffector<f64>,
        yaw: f64,
        input: &ReliefInput<'_>,
        gains: &ReliefGains,
    ) -> (PerEffector<f64>, EffectorSet) {
        let ReliefInput { at, model, .. } = *input;
        let effectors = &model.aircraft().effectors;
        let [_, nozzle_yaw] = model.nozzle_effectors();
        let columns = Columns::whole(model, at, |effector, column| {
            column.preferred = preferred[effector];
            if Some(effector) == nozzle_yaw {
                // At most half of the travel, so that the bounds stay in order.
                let reserve = gains.reserve_rad.min(0.5 * (column.max - column.min));
                column.min += reserve;
                column.max -= reserve;
            }
            // An aircraft without a nozzle has nothing else in yaw.
            if nozzle_yaw.is_some() && effectors.gains[effector].yaw != 0.0 {
                let (at, effect) = (main[effector], column.effect.z);
                let to = if effect == 0.0 { at } else { at + yaw / effect };
                let to = to.max(column.min).min(column.max);
                (column.min, column.max) = (at.min(to), at.max(to));
            }
        });
        let allocated =
            allocation::allocate(columns.as_slice(), demand, &SETTINGS, &self.awake.active);
        self.awake.active = allocated.active;
        let (mut positions, mut limited) = (*main, EffectorSet::default());
        for (index, (effector, column)) in columns.iter().enumerate() {
            positions[effector] = allocated.positions[index];
            // A rudder that is pinned to the main command has not reached its end.
            let is_held = column.min < column.max && allocated.active[index] != Bound::Free;
            limited = limited.with(effector, is_held && column.effect != Vector3::zeros());
        }
        (positions, limited)
    }

    /// s̄ and σ from s; returns the quick part of s.
    fn shortage(&mut self, missing: f64, gains: &ReliefGains) -> f64 {
        let awake = &mut self.awake;
        awake.shortage += (missing - awake.shortage) * fraction(self.h, gains.shortage_lag_s);
        let target = (awake.shortage.abs() / gains.shortage_full).min(1.0);
        let time_s = if target > awake.relief { gains.rise_s } else { gains.fall_s };
        awake.relief += (target - awake.relief) * fraction(self.h, time_s);
        missing - awake.shortage
    }

    /// What the reserve of the nozzle gives of the quick part of s.
    fn yaw(&self, positions: &mut PerEffector<f64>, quick: f64, input: &ReliefInput<'_>) {
        let [_, Some(nozzle)] = input.model.nozzle_effectors() else { return };
        let effect = input.model.effect(input.at, nozzle).z;
        // Without thrust the nozzle gives nothing, and the quotient below has no limit.
        if effect <= 0.0 {
            return;
        }
        // What is quick must not come back through the reserve while the yaw yields.
        let share = input.fade * (1.0 - self.quiet.axes.z);
        let servo = &input.model.aircraft().effectors.servos[nozzle];
        let position = positions[nozzle] + share * quick / effect;
        positions[nozzle] = position.max(servo.min).min(servo.max);
    }
}

/// A healthy rudder does what a nozzle cannot that may be faulty in yaw. Beside a healthy nozzle it stays with the main
/// controller.
fn stands_in(input: &ReliefInput<'_>) -> bool {
    let ReliefInput { model, known, .. } = *input;
    let effectors = &model.aircraft().effectors;
    let [_, nozzle_yaw] = model.nozzle_effectors();
    let mut rudders = effectors.list.all().filter(|effector| effectors.gains[*effector].yaw != 0.0);
    nozzle_yaw.is_some_and(|nozzle| !known.is_cleared(nozzle))
        && rudders.any(|rudder| known.is_cleared(rudder))
}

/// What could not be given, for the integrators of the main controller and for the operator.
fn saturate(
    mut mixed: Mixed,
    missing: &Vector3<f64>,
    at_floor: bool,
    model: &DesignModel,
) -> Mixed {
    // A positive aileron command rolls to the left, a positive elevator command lowers the nose.
    let side = |missing: f64, limit: f64| match missing {
        missing if missing > limit => Side::Below,
        missing if missing < -limit => Side::Above,
        _ => Side::Inside,
    };
    // In place of what the mixer found: a command beyond the travel of its own effector may have been given by
    // others.
    mixed.saturation.aileron = side(missing.x, WINDUP[0]);
    mixed.saturation.elevator = side(missing.y, WINDUP[1]);
    let nozzle = |nozzle: Option<Effector>| match nozzle {
        Some(nozzle) if mixed.limited.contains(nozzle) => {
            if mixed.commands[nozzle] > 0.0 {
                Side::Above
            } else {
                Side::Below
            }
        }
        _ => Side::Inside,
    };
    [mixed.saturation.nozzle_pitch, mixed.saturation.nozzle_yaw] =
        model.nozzle_effectors().map(nozzle);
    if at_floor {
        mixed.saturation.thrust = Side::Below;
    }
    mixed
}

/// x: how far the relief leads the sideslip, rad. Zero for a small sideslip and for one that decreases.
fn lead(state: &NavigationState, gains: &ReliefGains) -> f64 {
    let ahead = gains.lead_s * beta_rate(state);
    let beta = state.beta + ahead;
    let excess = beta.abs() - gains.lead_beta_rad;
    if excess > 0.0 && beta * ahead > 0.0 {
        // At most the excess, so that the lead begins with zero at its threshold.
        libm::copysign(ahead.abs().min(excess), ahead)
    } else {
        0.0
    }
}

/// dβ/dt, rad/s, from specific force, gravity and body rates, for small β.
fn beta_rate(state: &NavigationState) -> f64 {
    let (sin_alpha, cos_alpha) = libm::sincos(state.alpha);
    let gravity =
        STANDARD_GRAVITY_M_S2 * libm::cos(state.attitude.theta) * libm::sin(state.attitude.phi);
    let side = state.specific_force.0.y + gravity;
    side / state.airspeed_m_s.max(1.0) - state.rates.z * cos_alpha + state.rates.x * sin_alpha
}

/// Part of the way of a lag of `time_s` in one period of `h` s.
fn fraction(h: f64, time_s: f64) -> f64 {
    h / (h + time_s)
}

#[cfg(test)]
mod tests;
