//! Setpoints of an offboard stream: SET_ATTITUDE_TARGET, SET_POSITION_TARGET_GLOBAL_INT and
//! SET_POSITION_TARGET_LOCAL_NED. What is read of them is in [`setpoints`].
//!
//! The stream must not pause for longer than `COM_OF_LOSS_T` of wall time, since the sender's clock is a
//! wall clock; a paused simulation changes nothing about that. Without a flying aircraft setpoints are
//! ignored.

use core::time::Duration;

use ::mavlink::dialects::common::{MavSeverity, SET_ATTITUDE_TARGET_DATA};

use super::aircraft::Aircraft;
use super::codec::PositionTarget;
use super::context::Context;
use crate::clock::WallTime;
use crate::event::{Outcome, Wish};
use crate::parameters::Parameters;
use crate::vehicle::{Mode, Setpoint};

pub mod setpoints;

use setpoints::{Read, Unusable};

/// The vehicle gets at most one setpoint in this time, however fast they come.
const INTERVAL: Duration = Duration::from_millis(10);
/// The wish to go back to Hold is repeated after this time if the mode has not changed.
const REPEAT: Duration = Duration::from_millis(500);

/// Follows the stream of setpoints.
#[derive(Debug, Default)]
pub struct Offboard {
    /// Latest usable setpoint and when it came.
    setpoint: Option<(WallTime, Read)>,
    /// It has not been passed on yet.
    is_new: bool,
    passed_on: Option<WallTime>,
    /// Number of the intent that passed it on.
    number: Option<u32>,
    /// What has been said about the stream since Offboard began or since it was usable.
    told: Told,
    /// Hold was wished for.
    fell_back: Option<WallTime>,
}

#[derive(Debug, Default)]
struct Told {
    unusable: bool,
    refused: bool,
    limited: bool,
    unused: bool,
}

impl Offboard {
    /// A usable setpoint came a moment ago.
    #[must_use]
    pub fn is_fresh(&self, now: WallTime, parameters: &Parameters) -> bool {
        self.setpoint.is_some_and(|(at, _)| now.since(at) <= patience(parameters))
    }

    /// Takes an attitude.
    pub fn handle(&mut self, data: &SET_ATTITUDE_TARGET_DATA, now: WallTime, ctx: &mut Context) {
        self.take(setpoints::of_attitude(data, ctx.parameters), now, ctx);
    }

    /// Takes a global position or velocity.
    pub fn handle_global(
        &mut self,
        target: &PositionTarget<i32>,
        now: WallTime,
        ctx: &mut Context,
    ) {
        self.take(setpoints::of_global(target, ctx.parameters), now, ctx);
    }

    /// Takes a local position or velocity.
    pub fn handle_local(&mut self, target: &PositionTarget<f32>, now: WallTime, ctx: &mut Context) {
        self.take(setpoints::of_local(target, ctx.parameters), now, ctx);
    }

    fn take(&mut self, read: Result<Read, Unusable>, now: WallTime, ctx: &mut Context) {
        match read {
            Ok(read) => {
                self.setpoint = Some((now, read));
                self.is_new = true;
                self.told.unusable = false;
                self.pass_on(now, ctx);
            }
            Err(Unusable(reason)) if !self.told.unusable => {
                self.told.unusable = true;
                ctx.texts.refuse(now, format!("Setpoint refused: {reason}"));
            }
            Err(_) => {}
        }
    }

    /// Offboard began: the latest setpoint counts at once.
    pub fn begin(&mut self, now: WallTime, ctx: &mut Context) {
        self.is_new = self.is_fresh(now, ctx.parameters);
        self.fell_back = None;
        self.told = Told::default();
        self.pass_on(now, ctx);
    }

    /// Takes the outcome of an intent: a setpoint that the vehicle refuses is told of once.
    pub fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        ctx: &mut Context,
    ) {
        if self.number != Some(number) || !ctx.aircraft.flies_offboard() {
            return;
        }
        match outcome {
            Outcome::Refused(refusal) if !self.told.refused => {
                self.told.refused = true;
                ctx.texts.refuse(now, format!("Setpoint refused: {refusal}"));
            }
            Outcome::Done => self.told.refused = false,
            _ => {}
        }
    }

    fn pass_on(&mut self, now: WallTime, ctx: &mut Context) {
        let is_early = self.passed_on.is_some_and(|at| now.since(at) < INTERVAL);
        let Some((_, read)) = self.setpoint else { return };
        if !ctx.aircraft.flies_offboard() || !self.is_new || is_early {
            return;
        }
        let number = ctx.intents.push(Wish::Setpoint(read.setpoint));
        if number.is_some() {
            self.number = number;
            self.is_new = false;
            self.passed_on = Some(now);
            self.tell(&read, now, ctx);
        }
    }

    /// Says once what of a setpoint is not flown as it was asked for.
    fn tell(&mut self, read: &Read, now: WallTime, ctx: &mut Context) {
        if let Some(limit) = read.limited.filter(|_| !self.told.limited) {
            self.told.limited = true;
            ctx.texts.refuse(now, format!("Setpoint limited: {limit}"));
        }
        if matches!(read.setpoint, Setpoint::Roll(_)) && !self.told.unused {
            self.told.unused = true;
            let text = "Offboard attitude: roll is flown; pitch, yaw and thrust are not used";
            ctx.texts.reply(MavSeverity::MAV_SEVERITY_INFO, now, text);
        }
    }

    /// Passes on what came too fast, and goes back to Hold when nothing comes.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context) {
        if !ctx.aircraft.flies_offboard() {
            return;
        }
        self.pass_on(now, ctx);
        let is_waiting = self.fell_back.is_some_and(|at| now.since(at) < REPEAT);
        if self.is_fresh(now, ctx.parameters) || is_waiting {
            return;
        }
        if ctx.intents.push(Wish::Mode(Mode::Hold)).is_some() {
            if self.fell_back.is_none() {
                let text = "Offboard setpoints stopped: back to Hold";
                ctx.texts.say(MavSeverity::MAV_SEVERITY_WARNING, text);
            }
            self.fell_back = Some(now);
        }
    }

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(&self, aircraft: &Aircraft, parameters: &Parameters) -> Option<WallTime> {
        if !aircraft.flies_offboard() {
            return None;
        }
        if self.setpoint.is_none() && self.fell_back.is_none() {
            return Some(WallTime::ZERO);
        }
        let early = self.passed_on.filter(|_| self.is_new).map(|at| at + INTERVAL);
        // One microsecond beyond the last instant at which the setpoint counts.
        let stale =
            self.setpoint.map(|(at, _)| at + patience(parameters) + Duration::from_micros(1));
        match self.fell_back {
            Some(at) => Some(at + REPEAT),
            None => early.into_iter().chain(stale).min(),
        }
    }
}

fn patience(parameters: &Parameters) -> Duration {
    Duration::try_from_secs_f64(parameters.link.offboard_loss_s).unwrap_or(Duration::ZERO)
}
