//! SET_ATTITUDE_TARGET: the roll reference in Offboard.
//!
//! Only the roll angle of the attitude is used: altitude and airspeed have references of their own. The
//! stream must not pause for longer than [`FRESH`] of wall time, since the sender's clock is a wall clock.
//! Without a flying aircraft setpoints are ignored.

use core::time::Duration;

use ::mavlink::dialects::common::{AttitudeTargetTypemask, MavSeverity, SET_ATTITUDE_TARGET_DATA};

use super::aircraft::Aircraft;
use super::codec::PositionTarget;
use super::context::Context;
use super::convert;
use crate::clock::WallTime;
use crate::event::Wish;
use crate::vehicle::{Mode, Reference};

/// A setpoint counts this long.
pub const FRESH: Duration = Duration::from_millis(500);
/// The vehicle gets at most one roll reference in this time, however fast they come.
const INTERVAL: Duration = Duration::from_millis(10);
/// The wish to go back to Hold is repeated after this time if the mode has not changed.
const REPEAT: Duration = Duration::from_millis(500);

/// Follows the stream of setpoints.
#[derive(Debug, Default)]
pub struct Offboard {
    /// Latest usable setpoint: when it came, roll in rad before the limit.
    setpoint: Option<(WallTime, f64)>,
    /// It has not been passed on yet.
    is_new: bool,
    passed_on: Option<WallTime>,
    /// Unusable setpoints come, and that has been said.
    told_unusable: bool,
    /// Hold was wished for.
    fell_back: Option<WallTime>,
}

impl Offboard {
    /// A usable setpoint came a moment ago.
    #[must_use]
    pub fn is_fresh(&self, now: WallTime) -> bool {
        self.setpoint.is_some_and(|(at, _)| now.since(at) <= FRESH)
    }

    /// Takes a setpoint.
    pub fn handle(&mut self, data: &SET_ATTITUDE_TARGET_DATA, now: WallTime, ctx: &mut Context) {
        if data.type_mask.contains(AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE)
        {
            self.complain("Setpoint refused: the attitude is marked as ignored", now, ctx);
        } else if let Some(euler) = convert::euler_of(data.q) {
            self.setpoint = Some((now, euler.phi));
            self.is_new = true;
            self.told_unusable = false;
            self.pass_on(now, ctx);
        } else {
            self.complain("Setpoint refused: q is no unit quaternion", now, ctx);
        }
    }

    /// Takes a global position or velocity setpoint.
    pub fn handle_global(
        &mut self,
        _target: &PositionTarget<i32>,
        _now: WallTime,
        _ctx: &mut Context,
    ) {
    }

    /// Takes a local position or velocity setpoint.
    pub fn handle_local(
        &mut self,
        _target: &PositionTarget<f32>,
        _now: WallTime,
        _ctx: &mut Context,
    ) {
    }

    fn complain(&mut self, text: &str, now: WallTime, ctx: &mut Context) {
        if !self.told_unusable {
            self.told_unusable = true;
            ctx.texts.refuse(now, text);
        }
    }

    /// Offboard began: the latest setpoint counts at once.
    pub fn begin(&mut self, now: WallTime, ctx: &mut Context) {
        self.is_new = self.is_fresh(now);
        self.fell_back = None;
        self.pass_on(now, ctx);
    }

    fn pass_on(&mut self, now: WallTime, ctx: &mut Context) {
        let is_early = self.passed_on.is_some_and(|at| now.since(at) < INTERVAL);
        let Some((_, roll)) = self.setpoint else { return };
        if !ctx.aircraft.flies_offboard() || !self.is_new || is_early {
            return;
        }
        // A hair inside, since the vehicle compares in degrees and a conversion there and back rounds.
        let limit = convert::radians(ctx.parameters.limits.roll_max_deg) * (1.0 - 1.0e-12);
        let wish = Wish::Refer(Reference::Roll(roll.clamp(-limit, limit)));
        if ctx.intents.push(wish).is_some() {
            self.is_new = false;
            self.passed_on = Some(now);
        }
    }

    /// Passes on what came too fast, and goes back to Hold when nothing comes.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context) {
        if !ctx.aircraft.flies_offboard() {
            return;
        }
        self.pass_on(now, ctx);
        let is_waiting = self.fell_back.is_some_and(|at| now.since(at) < REPEAT);
        if self.is_fresh(now) || is_waiting {
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
    pub fn next_deadline(&self, aircraft: &Aircraft) -> Option<WallTime> {
        if !aircraft.flies_offboard() {
            return None;
        }
        if self.setpoint.is_none() && self.fell_back.is_none() {
            return Some(WallTime::ZERO);
        }
        let early = self.passed_on.filter(|_| self.is_new).map(|at| at + INTERVAL);
        // One microsecond beyond the last instant at which the setpoint counts.
        let stale = self.setpoint.map(|(at, _)| at + FRESH + Duration::from_micros(1));
        let again = self.fell_back.map(|at| at + REPEAT);
        match again {
            Some(again) => Some(again),
            None => early.into_iter().chain(stale).min(),
        }
    }
}
