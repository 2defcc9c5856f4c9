//! Step one: the law of the healthy aircraft. It knows nothing of the compensator.
//!
//! A law is one file in the folder of this module: its gains and their rows, its state, its step. [`Law`] is all
//! that the rest knows of it; a law of one's own implements the same trait (docs/own-law.md).

use icd::ControlPeriod;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::Visitor;
use crate::design_model::{DesignModel, FlightCondition};
use crate::gains::{Gains, MainLaw, ReferenceGains};
use crate::navigation::NavigationState;
use crate::signals::{Compensation, MainCommand, Saturation};
use lqr::Lqr;
use ndi::Ndi;
use pid::{Pid, PidGangedNozzle};

pub mod lqr;
pub mod ndi;
pub mod pid;

/// Time in which the difference between the commands of the old law and the new one fades out after a switch, s.
const TRANSFER_S: f64 = 2.0;

/// The same after the law on the ground, which holds no trim, s.
const LIFT_OFF_S: f64 = 0.5;

/// After a switch: old command minus new one, in what time it fades, and what of that is left, s.
#[derive(Debug, Clone, Copy)]
struct Transfer {
    difference: MainCommand,
    fade_s: f64,
    left_s: f64,
}

/// Demand of the operator or of the guidance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Demand {
    /// H_g: altitude, m.
    pub altitude_m: f64,
    /// φ_g: roll angle, rad.
    pub roll_rad: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
}

/// The references as the laws track them, after slew limit and lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct References {
    /// H_r, m.
    pub altitude_m: f64,
    /// φ_f, rad.
    pub roll_rad: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
}

/// All that a law is given in one step.
#[derive(Debug, Clone, Copy)]
pub struct LawInput<'a> {
    /// What is known of the aircraft.
    pub state: &'a NavigationState,
    /// The references to track.
    pub references: &'a References,
    /// What the effectors could not give in the last step, for integrators.
    pub saturated: &'a Saturation,
    /// The model of the healthy aircraft.
    pub model: &'a DesignModel,
    /// Dynamic pressure and arms of the model at `state`.
    pub at: &'a FlightCondition,
    /// Control period, s.
    pub h: f64,
}

/// A main controller: navigation state and references in, commands out.
///
/// A step cannot fail and must not allocate. A command that is not finite never reaches an effector: the last
/// finite one of the same axis stands in.
pub trait Law {
    /// One control period.
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand;

    /// The compensation beside the command of the main controller, before limits, where [`crate::AllocationMode::Own`] is selected; how much
    /// of it acts is the business of [`crate::activation`]. `z2` is the estimated fault acceleration, rad/s².
    fn compensate(
        &mut self,
        _input: &LawInput<'_>,
        _main: &MainCommand,
        _z2: &Vector3<f64>,
    ) -> Compensation {
        Compensation::NONE
    }

    /// Another law has flown so far and `command` was its last one: integrators start so that the first step of
    /// this law gives the same command. What remains of the difference fades out over two seconds.
    fn start_from(&mut self, _input: &LawInput<'_>, _command: &MainCommand) {}

    /// Shows each continuous state to a linearisation, which may change it. Counters and switches are not among them.
    fn states(&mut self, _visit: &mut Visitor<'_>) {}
}

/// A clamped integral.
///
/// Stored already multiplied by its gain, so that a gain change in flight causes no step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Integral(f64);

impl Integral {
    /// Adds one step, clamped to `max` either way.
    pub fn add(&mut self, increment: f64, max: f64) {
        self.0 = (self.0 + increment).clamp(-max, max);
    }

    /// Starts from `value`, as far as `max` either way allows.
    pub fn start(&mut self, value: f64, max: f64) {
        self.0 = value.clamp(-max, max);
    }

    /// One that starts from `value`.
    pub fn starting(value: f64) -> Self {
        Self(value)
    }

    /// The integral itself, for [`Law::states`].
    pub fn state(&mut self) -> &mut f64 {
        &mut self.0
    }

    /// Contribution to the command.
    pub fn value(self) -> f64 {
        self.0
    }
}

/// The law that flies.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "there is one, and nothing may allocate")]
enum RunningLaw {
    Pid(Pid),
    PidGangedNozzle(PidGangedNozzle),
    Ndi(Ndi),
    Lqr(Lqr),
    /// The caller of [`MainController::step`] brings it.
    Own,
}

impl RunningLaw {
    fn new(law: MainLaw, gains: &Gains, model: &DesignModel) -> Self {
        match law {
            MainLaw::Pid => Self::Pid(Pid::new(&gains.pid)),
            MainLaw::PidGangedNozzle => Self::PidGangedNozzle(PidGangedNozzle::new(&gains.pid)),
            MainLaw::Ndi => Self::Ndi(Ndi::new(&gains.ndi, model)),
            MainLaw::Lqr => Self::Lqr(Lqr::new(&gains.lqr)),
            MainLaw::Own => Self::Own,
        }
    }

    fn set_gains(&mut self, gains: &Gains) {
        match self {
            Self::Pid(law) => law.set_gains(&gains.pid),
            Self::PidGangedNozzle(law) => law.set_gains(&gains.pid),
            Self::Ndi(law) => law.set_gains(&gains.ndi),
            Self::Lqr(law) => law.set_gains(&gains.lqr),
            Self::Own => {}
        }
    }

    /// The law itself; `own` is with the caller.
    fn law<'a, 'b>(
        &'a mut self,
        own: Option<&'a mut (dyn Law + 'b)>,
    ) -> Option<&'a mut (dyn Law + 'b)> {
        match self {
            Self::Pid(law) => Some(law),
            Self::PidGangedNozzle(law) => Some(law),
            Self::Ndi(law) => Some(law),
            Self::Lqr(law) => Some(law),
            Self::Own => own,
        }
    }
}

/// Step one: shapes the references, steps the chosen law, and changes laws without a bump.
#[derive(Debug, Clone)]
pub struct MainController {
    gains: Gains,
    h: f64,
    /// 1 - exp(-h/τ) of the lag on the roll reference.
    lag_fraction: f64,
    references: Option<References>,
    running: RunningLaw,
    flies: MainLaw,
    /// Command of the last step.
    last: Option<MainCommand>,
    /// The next step goes on from `last`, which was not of a law of flight.
    takes_over: bool,
    transfer: Option<Transfer>,
    /// The law's command in the last step was not finite, or beyond 1e9.
    implausible: bool,
}

impl MainController {
    /// With empty integrators.
    pub fn new(gains: &Gains, model: &DesignModel, period: ControlPeriod) -> Self {
        let h = period.as_seconds();
        let flies = gains.selection.main;
        Self {
            gains: *gains,
            h,
            lag_fraction: lag_fraction(&gains.references, h),
            references: None,
            running: RunningLaw::new(flies, gains, model),
            flies,
            last: None,
            takes_over: false,
            transfer: None,
            implausible: false,
        }
    }

    /// Takes new gains; references and integrators stay. Another law takes over in the next step.
    pub fn set_gains(&mut self, gains: &Gains) {
        self.gains = *gains;
        self.lag_fraction = lag_fraction(&gains.references, self.h);
        self.running.set_gains(gains);
    }

    /// Back to the state before the first step; the references start from the state of the next one.
    pub fn reset(&mut self, model: &DesignModel) {
        self.references = None;
        self.flies = self.gains.selection.main;
        self.running = RunningLaw::new(self.flies, &self.gains, model);
        self.last = None;
        self.takes_over = false;
        self.transfer = None;
        self.implausible = false;
    }

    /// Goes on from the command of another law, which fades out: nothing of it is trim.
    pub fn take_over_from(&mut self, command: MainCommand) {
        self.last = Some(command);
        self.takes_over = true;
    }

    /// Shows the continuous states: those of the references that no demand has reached, and those of the law.
    pub fn states(&mut self, visit: &mut Visitor<'_>) {
        if let Some(references) = &mut self.references {
            visit(&mut references.roll_rad);
        }
        if let Some(law) = self.running.law(None) {
            law.states(visit);
        }
    }

    /// The references as tracked in the last step.
    pub fn references(&self) -> Option<References> {
        self.references
    }

    /// Control period, s.
    pub(crate) fn h(&self) -> f64 {
        self.h
    }

    /// Whether the law's command in the last step was one that no effector can follow: not finite, or beyond 1e9.
    pub fn implausible(&self) -> bool {
        self.implausible
    }

    /// One step. `saturated` is what the mixer could not give in the last step, `at` the condition of `state`.
    /// `own` is the law that flies where [`MainLaw::Own`] is selected; without one the PID does.
    pub fn step(
        &mut self,
        state: &NavigationState,
        at: &FlightCondition,
        demand: &Demand,
        saturated: &Saturation,
        model: &DesignModel,
        mut own: Option<&mut dyn Law>,
    ) -> MainCommand {
        let references = self.track(state, demand);
        let input = LawInput { state, references: &references, saturated, model, at, h: self.h };
        let selected = match (self.gains.selection.main, &own) {
            (MainLaw::Own, None) => MainLaw::Pid,
            (selected, _) => selected,
        };
        // Here and not in `set_gains`, because a law starts from the state of a step.
        let switched = selected != self.flies;
        if switched {
            self.running = RunningLaw::new(selected, &self.gains, model);
            self.flies = selected;
            if let Some(last) = &self.last {
                let own: Option<&mut dyn Law> = match &mut own {
                    Some(law) => Some(&mut **law),
                    None => None,
                };
                if let Some(law) = self.running.law(own) {
                    law.start_from(&input, last);
                }
            }
        }
        let last = self.last.unwrap_or_else(|| at_trim(model));
        let raw = self.running.law(own).map_or(last, |law| law.step(&input));
        let finite = raw.finite_or(&last);
        self.implausible = finite != raw;
        // What the integrators could not take over.
        let fade_s = match core::mem::take(&mut self.takes_over) {
            true => Some(LIFT_OFF_S),
            false => switched.then_some(TRANSFER_S),
        };
        if let (Some(fade_s), Some(_)) = (fade_s, self.last) {
            let difference = last.combine(&finite, |old, new| old - new);
            self.transfer = Some(Transfer { difference, fade_s, left_s: fade_s });
        }
        let command = self.fade(finite);
        self.last = Some(command);
        command
    }

    /// Adds what is left of the old law's command.
    fn fade(&mut self, command: MainCommand) -> MainCommand {
        let Some(Transfer { difference, fade_s, left_s }) = self.transfer else { return command };
        let share = left_s / fade_s;
        let left_s = left_s - self.h;
        self.transfer = (left_s > 0.0).then_some(Transfer { difference, fade_s, left_s });
        command.combine(&difference, |command, difference| command + share * difference)
    }

    /// How far the altitude reference begins above an aircraft that climbs over a ground, as behind a catapult, so that the climb goes on;
    /// from its own altitude the law would first end the climb. m.
    fn lead_m(&self, state: &NavigationState, demand: &Demand) -> f64 {
        let left_m = demand.altitude_m - state.altitude_m;
        if !state.over_ground || left_m <= 0.0 {
            return 0.0;
        }
        let response = self.gains.altitude_response();
        let lead_m = response.lag_s(state.airspeed_m_s) * state.climb_rate_m_s();
        lead_m.max(0.0).min(left_m).min(response.error_max_m)
    }

    fn track(&mut self, state: &NavigationState, demand: &Demand) -> References {
        let Demand { airspeed_m_s, .. } = *demand;
        // From where the aircraft is, so the first step asks for nothing sudden.
        let mut references = self.references.unwrap_or_else(|| References {
            altitude_m: state.altitude_m + self.lead_m(state, demand),
            roll_rad: state.attitude.phi,
            airspeed_m_s,
        });
        // A climb or descent that is given up ends at once: near a ground there may be no thrust for the rest of the one, and no room
        // for that of the other. Without a ground the references are those of the paper.
        let is_above = |altitude_m: f64| altitude_m > state.altitude_m;
        if state.over_ground && is_above(references.altitude_m) != is_above(demand.altitude_m) {
            references.altitude_m = state.altitude_m;
        }
        let slew = self.gains.references.slew_m_s * self.h;
        references.altitude_m += (demand.altitude_m - references.altitude_m).clamp(-slew, slew);
        references.roll_rad += self.lag_fraction * (demand.roll_rad - references.roll_rad);
        references.airspeed_m_s = airspeed_m_s;
        self.references = Some(references);
        references
    }
}

/// The effectors of steady level flight at the design point.
fn at_trim(model: &DesignModel) -> MainCommand {
    let trim = &model.aircraft().trim;
    MainCommand {
        elevator_rad: trim.elevator_rad,
        thrust_n: trim.thrust_n,
        ..MainCommand::default()
    }
}

fn lag_fraction(gains: &ReferenceGains, h: f64) -> f64 {
    1.0 - libm::exp(-h / gains.roll_lag_s)
}

#[cfg(test)]
mod tests;
