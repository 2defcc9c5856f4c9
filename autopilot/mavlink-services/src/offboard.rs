//! Setpoints of an offboard stream: SET_ATTITUDE_TARGET, SET_POSITION_TARGET_GLOBAL_INT and
//! SET_POSITION_TARGET_LOCAL_NED. What is read of them is in [`setpoints`].
//!
//! The stream must not pause for longer than `COM_OF_LOSS_T` of wall time, since the sender's clock is a
//! wall clock; a paused simulation changes nothing about that. Without a flying aircraft setpoints are
//! ignored. Each system has a stream of its own: Offboard is entered on the stream of the system that asks for
//! it, and then the setpoints of the system that has control count ([`super::control`]).

use core::time::Duration;
use flight_management::command::VehicleCommand;

use ::mavlink::dialects::common::MavSeverity;

use super::aircraft::Aircraft;
use super::codec::Message;
use super::context::{Context, From};
use super::control::Control;
use super::fall_back::FallBack;
use crate::wall_time::WallTime;
use flight_management::command::Outcome;
use flight_management::parameters::Parameters;
use flight_management::vehicle::{Mode, Setpoint};

pub mod setpoints;

use setpoints::{Read, Unusable};

/// The vehicle gets at most one setpoint in this time, however fast they come.
const INTERVAL: Duration = Duration::from_millis(10);

/// Systems whose setpoints are followed; the one that was silent for the longest makes room.
const STREAMS_MAX: usize = 4;

/// The setpoints of one system.
#[derive(Debug, Default)]
struct Stream {
    system: u8,
    /// Latest usable setpoint and when it came.
    latest: Option<(WallTime, Read)>,
    /// It has not been passed on yet.
    is_new: bool,
    /// It was unusable, and that has been said.
    reported_unusable: bool,
    /// It comes without control, and that has been said.
    reported_uncontrolled: bool,
}

impl Stream {
    fn is_fresh(&self, now: WallTime, parameters: &Parameters) -> bool {
        self.latest.is_some_and(|(at, _)| now.since(at) <= setpoint_timeout(parameters))
    }
}

/// Follows the streams of setpoints.
#[derive(Debug, Default)]
pub struct Offboard {
    /// In the order of hearing.
    streams: Vec<Stream>,
    passed_on: Option<WallTime>,
    /// Number of the oldest intent with a setpoint whose outcome is open.
    number: Option<u32>,
    /// What has been said since Offboard began.
    reported: Reported,
    /// Hold was requested.
    fall_back: FallBack,
}

#[derive(Debug, Default)]
struct Reported {
    refused: bool,
    limited: bool,
    unused: bool,
}

impl Offboard {
    /// A usable setpoint of this system came a moment ago.
    #[must_use]
    pub fn is_fresh(&self, system: u8, now: WallTime, parameters: &Parameters) -> bool {
        self.stream(system).is_some_and(|stream| stream.is_fresh(now, parameters))
    }

    /// Takes an attitude, a position or a velocity.
    pub fn handle(&mut self, from: From, message: &Message, now: WallTime, ctx: &mut Context) {
        let read = match message {
            Message::SetAttitudeTarget(data) => setpoints::of_attitude(data, ctx.parameters),
            Message::SetPositionGlobal(target) => setpoints::of_global(target, ctx.parameters),
            Message::SetPositionLocal(target) => {
                let heading_rad = ctx.aircraft.snapshot().map(|state| state.motion().attitude.psi);
                setpoints::of_local(target, heading_rad, ctx.parameters)
            }
            _ => return,
        };
        let system = from.sender.system;
        let counts = ctx.control.holder() == Some(system);
        let is_stranger = ctx.aircraft.flies_offboard() && !counts;
        let stream = self.heard(system);
        if is_stranger && !core::mem::replace(&mut stream.reported_uncontrolled, true) {
            let text = format!("Setpoints of system {system} refused: it has no control");
            ctx.texts.refuse(now, text);
        }
        match read {
            Ok(read) => {
                stream.latest = Some((now, read));
                stream.is_new = true;
                stream.reported_unusable = false;
                self.pass_on(now, ctx);
            }
            Err(Unusable(reason)) if !is_stranger && !stream.reported_unusable => {
                stream.reported_unusable = true;
                ctx.texts.refuse(now, format!("Setpoint refused: {reason}"));
            }
            Err(_) => {}
        }
    }

    fn stream(&self, system: u8) -> Option<&Stream> {
        self.streams.iter().find(|stream| stream.system == system)
    }

    /// The stream of a system that was heard just now.
    fn heard(&mut self, system: u8) -> &mut Stream {
        let known = self.streams.iter().position(|stream| stream.system == system);
        let stream = match known {
            Some(place) => self.streams.remove(place),
            None => Stream { system, ..Stream::default() },
        };
        if self.streams.len() >= STREAMS_MAX {
            self.streams.remove(0);
        }
        self.streams.push(stream);
        let last = self.streams.len() - 1;
        &mut self.streams[last]
    }

    /// The setpoints that count: those of the system that has control.
    fn counting(&self, control: &Control) -> Option<&Stream> {
        self.stream(control.holder()?)
    }

    /// Offboard began: the latest setpoint counts at once.
    pub fn begin(&mut self, now: WallTime, ctx: &mut Context) {
        for stream in &mut self.streams {
            stream.is_new = true;
            stream.reported_unusable = false;
            stream.reported_uncontrolled = false;
        }
        self.fall_back.forget();
        self.reported = Reported::default();
        self.number = None;
        self.pass_on(now, ctx);
    }

    /// Takes the outcome of an intent: reports a setpoint that the vehicle refuses once.
    pub fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        ctx: &mut Context,
    ) {
        if self.number != Some(number) {
            return;
        }
        self.number = None;
        if !ctx.aircraft.flies_offboard() {
            return;
        }
        match outcome {
            Outcome::Refused(refusal) if !self.reported.refused => {
                self.reported.refused = true;
                ctx.texts.refuse(now, format!("Setpoint refused: {refusal}"));
            }
            Outcome::Done => self.reported.refused = false,
            _ => {}
        }
    }

    fn pass_on(&mut self, now: WallTime, ctx: &mut Context) {
        let is_early = self.passed_on.is_some_and(|at| now.since(at) < INTERVAL);
        if !ctx.aircraft.flies_offboard() || is_early {
            return;
        }
        let holder = ctx.control.holder();
        let stream = self.streams.iter_mut().find(|stream| Some(stream.system) == holder);
        let due = stream.filter(|stream| stream.is_new && stream.is_fresh(now, ctx.parameters));
        let Some((stream, (_, read))) = due.and_then(|s| s.latest.map(|latest| (s, latest))) else {
            return;
        };
        let number = ctx.intents.push(VehicleCommand::Setpoint(read.setpoint));
        if number.is_some() {
            stream.is_new = false;
            // The outcome of an older one is not to be missed.
            self.number = self.number.or(number);
            self.passed_on = Some(now);
            self.report(&read, now, ctx);
        }
    }

    /// Says once what of a setpoint is not flown as it was asked for.
    fn report(&mut self, read: &Read, now: WallTime, ctx: &mut Context) {
        if let Some(limit) = read.limited.filter(|_| !self.reported.limited) {
            self.reported.limited = true;
            ctx.texts.refuse(now, format!("Setpoint limited: {limit}"));
        }
        if matches!(read.setpoint, Setpoint::Roll(_)) && !self.reported.unused {
            self.reported.unused = true;
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
        let is_waiting = self.fall_back.is_under_way(now);
        let stream = self.counting(ctx.control);
        if is_waiting || stream.is_some_and(|stream| stream.is_fresh(now, ctx.parameters)) {
            return;
        }
        self.fall_back.to(Mode::Hold, "Offboard setpoints stopped: back to Hold", now, ctx);
    }

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(
        &self,
        aircraft: &Aircraft,
        control: &Control,
        parameters: &Parameters,
    ) -> Option<WallTime> {
        if !aircraft.flies_offboard() {
            return None;
        }
        if let Some(at) = self.fall_back.next_deadline() {
            return Some(at);
        }
        let latest = self.counting(control).and_then(|stream| Some((stream, stream.latest?)));
        let Some((stream, (at, _))) = latest else { return Some(WallTime::ZERO) };
        let early = self.passed_on.filter(|_| stream.is_new).map(|at| at + INTERVAL);
        // One microsecond beyond the last instant at which the setpoint counts.
        let stale = at + setpoint_timeout(parameters) + Duration::from_micros(1);
        Some(early.map_or(stale, |early| early.min(stale)))
    }
}

fn setpoint_timeout(parameters: &Parameters) -> Duration {
    Duration::try_from_secs_f64(parameters.link.offboard_loss_s).unwrap_or(Duration::ZERO)
}
