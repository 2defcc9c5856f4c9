//! MANUAL_CONTROL and RC_CHANNELS_OVERRIDE: a pilot's sticks.
//!
//! | stick | MANUAL_CONTROL | RC_CHANNELS_OVERRIDE | wants |
//! |---|---|---|---|
//! | roll | y, 1000 right | channel 1, 2000 us right | roll angle up to REF_ROLL_MAX |
//! | pitch | x, 1000 forward | channel 2, 1000 us forward | descent, back climb |
//! | throttle | z, 0 to 1000 | channel 3, 1000 to 2000 us | airspeed between its limits |
//! | yaw | r | channel 4 | nothing: the turn is coordinated |
//!
//! An axis that is not there (`i16::MAX`, 65535 for a channel that was never given, 0 for a channel that is
//! released) stands in the middle; a throttle that is not there leaves the airspeed as it is. The sticks of
//! the station that has control count ([`super::control`]). When they pause for longer than `COM_RC_LOSS_T` of
//! wall time, Altitude ends as `NAV_RCL_ACT` says; Position goes on with centred sticks.

use core::time::Duration;
use flight_management::command::VehicleCommand;

use ::mavlink::dialects::common::MavSeverity;

use super::aircraft::{Aircraft, Phase};
use super::codec::{ManualControl, Message};
use super::context::{Context, From};
use super::control::Control;
use super::fall_back::FallBack;
use crate::wall_time::WallTime;
use flight_management::parameters::{Parameters, SticksLossAction};
use flight_management::vehicle::{Mode, Sticks};

/// The vehicle gets at most one position in this time, however fast they come.
const INTERVAL: Duration = Duration::from_millis(10);
/// Systems whose sticks are followed; the one that was silent for the longest makes room.
const PILOTS_MAX: usize = 4;
/// Target system that means every vehicle.
const ALL: u8 = 0;
/// Full deflection in MANUAL_CONTROL.
const FULL: f64 = 1000.0;
/// Middle and half width of a channel, us.
const MIDDLE_US: f64 = 1500.0;
const HALF_US: f64 = 500.0;
/// A channel with this value stays as it was.
const IGNORE: u16 = u16::MAX;
/// A channel with this value is given back to a receiver, and there is none.
const RELEASE: u16 = 0;
/// Channels 1 to 3: roll, pitch, throttle.
const CHANNELS: usize = 3;

#[derive(Debug, Clone, Copy)]
struct Pilot {
    system: u8,
    heard: WallTime,
    sticks: Sticks,
    /// Channels that are overridden, us.
    channels: [Option<u16>; CHANNELS],
}

/// Follows the sticks.
#[derive(Debug, Default)]
pub struct Manual {
    pilots: Vec<Pilot>,
    /// The latest position has not been passed on yet.
    is_new: bool,
    passed_on: Option<WallTime>,
    /// Hold was requested.
    fall_back: FallBack,
    /// The vehicle follows sticks in Position and has not been given centred ones since.
    steers: bool,
    /// This system moves its sticks without having control, and that has been said.
    reported_uncontrolled: Option<u8>,
}

impl Manual {
    /// Takes stick positions.
    pub fn handle(&mut self, from: From, message: &Message, now: WallTime, ctx: &mut Context) {
        let system = from.sender.system;
        match message {
            // A joystick moves one aircraft, so "all" is not enough.
            Message::ManualControl(control) if control.target != ALL => {
                let Some(sticks) = of_joystick(control) else { return };
                self.take(system, sticks, [None; CHANNELS], now);
            }
            Message::RcOverride([roll, pitch, throttle, ..]) => {
                let before = self.pilot(system).map_or([None; CHANNELS], |pilot| pilot.channels);
                let given = [*roll, *pitch, *throttle];
                let channels = core::array::from_fn(|i| channel(given[i], before[i]));
                if channels == [None; CHANNELS] {
                    // All released: these are no sticks any more.
                    self.pilots.retain(|pilot| pilot.system != system);
                    return;
                }
                self.take(system, of_channels(channels), channels, now);
            }
            _ => return,
        }
        if ctx.control.holder().is_none() && flies_by_sticks(ctx.aircraft) {
            ctx.control.take(from.sender);
        }
        if ctx.control.holder() == Some(system) {
            self.is_new = true;
            self.pass_on(now, ctx);
        } else {
            self.complain(system, now, ctx);
        }
    }

    fn pilot(&self, system: u8) -> Option<&Pilot> {
        self.pilots.iter().find(|pilot| pilot.system == system)
    }

    fn take(
        &mut self,
        system: u8,
        sticks: Sticks,
        channels: [Option<u16>; CHANNELS],
        now: WallTime,
    ) {
        self.pilots.retain(|pilot| pilot.system != system);
        if self.pilots.len() >= PILOTS_MAX {
            // The order is that of hearing.
            self.pilots.remove(0);
        }
        self.pilots.push(Pilot { system, heard: now, sticks, channels });
    }

    /// Says once that sticks do not count.
    fn complain(&mut self, system: u8, now: WallTime, ctx: &mut Context) {
        if flies_by_sticks(ctx.aircraft) && self.reported_uncontrolled != Some(system) {
            self.reported_uncontrolled = Some(system);
            ctx.texts.refuse(now, format!("Sticks of system {system} refused: it has no control"));
        }
    }

    /// Stick positions of this system came a moment ago.
    #[must_use]
    pub fn is_fresh(&self, system: u8, now: WallTime, parameters: &Parameters) -> bool {
        self.pilot(system).is_some_and(|pilot| now.since(pilot.heard) <= stick_timeout(parameters))
    }

    /// The sticks that count: those of the system that has control.
    fn counting(&self, control: &Control) -> Option<&Pilot> {
        self.pilot(control.holder()?)
    }

    /// A flight, Position or Altitude began: the latest position counts at once.
    pub fn begin(&mut self, now: WallTime, ctx: &mut Context) {
        self.is_new = true;
        self.fall_back.forget();
        self.reported_uncontrolled = None;
        self.pass_on(now, ctx);
    }

    fn pass_on(&mut self, now: WallTime, ctx: &mut Context) {
        let is_early = self.passed_on.is_some_and(|at| now.since(at) < INTERVAL);
        if !flies_by_sticks(ctx.aircraft) || !self.is_new || is_early {
            return;
        }
        let fresh = |pilot: &&Pilot| now.since(pilot.heard) <= stick_timeout(ctx.parameters);
        let Some(sticks) = self.counting(ctx.control).filter(fresh).map(|pilot| pilot.sticks)
        else {
            return;
        };
        if ctx.intents.push(VehicleCommand::Sticks(sticks)).is_some() {
            self.is_new = false;
            self.passed_on = Some(now);
            self.steers = true;
        }
    }

    /// Passes on what came too fast. When nothing comes, leaves Altitude as NAV_RCL_ACT says, and in Position lets
    /// the sticks be centred.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context) {
        if !flies_by_sticks(ctx.aircraft) {
            self.steers = false;
            return;
        }
        self.pass_on(now, ctx);
        let is_fresh = self
            .counting(ctx.control)
            .is_some_and(|pilot| now.since(pilot.heard) <= stick_timeout(ctx.parameters));
        if is_fresh {
            return;
        }
        if ctx.aircraft.mode() == Mode::Altitude {
            let (mode, text) = match ctx.parameters.link.sticks_loss_action {
                SticksLossAction::Hold => (Mode::Hold, "Sticks stopped: back to Hold"),
                SticksLossAction::Return => (Mode::Return, "Sticks stopped: Return"),
            };
            if !self.fall_back.is_under_way(now) {
                self.fall_back.to(mode, text, now, ctx);
            }
            return;
        }
        self.is_new = false;
        if self.steers && ctx.intents.push(VehicleCommand::Sticks(Sticks::CENTRED)).is_some() {
            self.steers = false;
            let text = "Sticks stopped: holding altitude and course";
            ctx.texts.say(MavSeverity::MAV_SEVERITY_WARNING, text);
        }
    }

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(
        &self,
        aircraft: &Aircraft,
        control: &Control,
        parameters: &Parameters,
    ) -> Option<WallTime> {
        if !flies_by_sticks(aircraft) {
            return None;
        }
        if aircraft.mode() == Mode::Position {
            if !self.steers && !self.is_new {
                return None;
            }
        } else if let Some(at) = self.fall_back.next_deadline() {
            return Some(at);
        }
        let Some(pilot) = self.counting(control) else { return Some(WallTime::ZERO) };
        let early = self.passed_on.filter(|_| self.is_new).map(|at| at + INTERVAL);
        // One microsecond beyond the last instant at which the sticks count.
        let stale = pilot.heard + stick_timeout(parameters) + Duration::from_micros(1);
        Some(early.map_or(stale, |early| early.min(stale)))
    }
}

fn flies_by_sticks(aircraft: &Aircraft) -> bool {
    aircraft.phase() == Phase::Flying && matches!(aircraft.mode(), Mode::Position | Mode::Altitude)
}

fn stick_timeout(parameters: &Parameters) -> Duration {
    Duration::try_from_secs_f64(parameters.link.sticks_loss_s).unwrap_or(Duration::ZERO)
}

/// `None` if no axis is there.
fn of_joystick(control: &ManualControl) -> Option<Sticks> {
    let axis = |value: i16| (value != i16::MAX).then(|| (f64::from(value) / FULL).clamp(-1.0, 1.0));
    let (forward, right, thrust) = (axis(control.x), axis(control.y), axis(control.z));
    forward.or(right).or(thrust)?;
    Some(Sticks {
        roll: right.unwrap_or(0.0),
        climb: 0.0 - forward.unwrap_or(0.0),
        throttle: thrust.map(|thrust| thrust.max(0.0)),
    })
}

fn channel(pulse_us: u16, before: Option<u16>) -> Option<u16> {
    match pulse_us {
        IGNORE => before,
        RELEASE => None,
        pulse_us => Some(pulse_us),
    }
}

fn of_channels([roll, pitch, throttle]: [Option<u16>; CHANNELS]) -> Sticks {
    let deflection = |pulse_us: u16| ((f64::from(pulse_us) - MIDDLE_US) / HALF_US).clamp(-1.0, 1.0);
    Sticks {
        roll: roll.map_or(0.0, deflection),
        climb: pitch.map_or(0.0, deflection),
        throttle: throttle.map(|pulse_us| 0.5 * (deflection(pulse_us) + 1.0)),
    }
}
