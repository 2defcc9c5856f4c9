//! MANUAL_CONTROL and RC_CHANNELS_OVERRIDE: a pilot's sticks.
//!
//! | stick | MANUAL_CONTROL | RC_CHANNELS_OVERRIDE | commands |
//! |---|---|---|---|
//! | roll | y, 1000 right | channel 1, 2000 us right | roll angle up to REF_ROLL_MAX |
//! | pitch | x, 1000 forward | channel 2, 1000 us forward | descent, back climb |
//! | throttle | z, 0 to 1000 | channel 3, 1000 to 2000 us | airspeed between its limits |
//! | yaw | r | channel 4 | nothing: the turn is coordinated |
//!
//! An absent axis (`i16::MAX`, 65535 for a channel never given, 0 for a released
//! channel) is centred; an absent throttle leaves the airspeed unchanged. The sticks of
//! the station that has control count ([`super::control`]). When they pause for longer than `COM_RC_LOSS_T` of
//! wall time, Altitude ends with the action `NAV_RCL_ACT`; Position continues with centred sticks.

use core::time::Duration;

use ::mavlink::dialects::common::MavSeverity;

use crate::aircraft::{Aircraft, Phase};
use crate::codec::{ManualControl, Message};
use crate::peers::From;
use crate::streams::{Fallback, Forwarding};
use crate::wall_time::WallTime;
use crate::{Service, Shared};
use flight_management::command::VehicleCommand;
use flight_management::event::EventKind;
use flight_management::parameters::{Parameters, SticksLossAction};
use flight_management::vehicle::{Mode, Sticks, VehicleEvent};

/// Target system that means every vehicle.
const ALL: u8 = 0;
/// Full deflection in MANUAL_CONTROL.
const FULL: f64 = 1000.0;
/// Middle and half width of a channel, us.
const MIDDLE_US: f64 = 1500.0;
const HALF_US: f64 = 500.0;
/// A channel with this value keeps its position.
const IGNORE: u16 = u16::MAX;
/// A channel with this value is released to a receiver, which does not exist here.
const RELEASE: u16 = 0;
/// Channels 1 to 3: roll, pitch, throttle.
const CHANNELS: usize = 3;

/// The latest stick positions of one system.
#[derive(Debug, Clone, Copy)]
pub struct Pilot {
    received: WallTime,
    sticks: Sticks,
    /// Overridden channels, us.
    channels: [Option<u16>; CHANNELS],
}

impl Pilot {
    /// They arrived a moment ago.
    pub fn is_fresh(&self, now: WallTime, parameters: &Parameters) -> bool {
        now.since(self.received) <= stick_timeout(parameters)
    }
}

/// Forwards the sticks of the station that has control to the vehicle.
#[derive(Debug, Default)]
pub struct Manual {
    /// The latest position has not been forwarded yet.
    is_new: bool,
    forwarding: Forwarding,
    fallback: Fallback,
    /// The vehicle follows sticks in Position and has not received centred ones since.
    steers: bool,
    /// This system moves its sticks without having control, and the station has received a report of it.
    reported_uncontrolled: Option<u8>,
}

impl Service for Manual {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        let system = from.sender.system;
        let (sticks, channels) = match message {
            // A joystick moves one aircraft, so "all" is not enough.
            Message::ManualControl(control) if control.target != ALL => {
                let Some(sticks) = of_joystick(control) else { return };
                (sticks, [None; CHANNELS])
            }
            Message::RcOverride([roll, pitch, throttle, ..]) => {
                let before = shared.pilots.of(Some(system));
                let before = before.map_or([None; CHANNELS], |pilot| pilot.channels);
                let given = [*roll, *pitch, *throttle];
                let channels = core::array::from_fn(|i| channel(given[i], before[i]));
                if channels == [None; CHANNELS] {
                    // All channels released: these are no sticks any more.
                    shared.pilots.remove(system);
                    return;
                }
                (of_channels(channels), channels)
            }
            _ => return,
        };
        shared.pilots.replace(system, Pilot { received: now, sticks, channels });
        let flies_by_sticks = flies_by_sticks(&shared.aircraft);
        // Nobody has control yet, so whoever moves the sticks first gets it.
        if shared.control.holder().is_none() && flies_by_sticks {
            shared.control.take(from.sender);
        }
        if shared.control.holder() == Some(system) {
            self.is_new = true;
            self.pass_on(now, shared);
        } else if flies_by_sticks && self.reported_uncontrolled != Some(system) {
            self.reported_uncontrolled = Some(system);
            let text = format!("Sticks of system {system} refused: it has no control");
            shared.texts.warn(now, text);
        }
    }

    /// When a flight, Position or Altitude begins, the latest position counts at once.
    fn handle_event(&mut self, event: &EventKind, now: WallTime, shared: &mut Shared) {
        if let EventKind::FlightBegan { .. }
        | EventKind::Vehicle(VehicleEvent::Mode(Mode::Position | Mode::Altitude)) = event
        {
            self.is_new = true;
            self.fallback.reset();
            self.reported_uncontrolled = None;
            self.pass_on(now, shared);
        }
    }

    /// Forwards positions held back by the rate limit. When none arrive, leaves Altitude by the action NAV_RCL_ACT, and in
    /// Position centres the sticks.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        if !flies_by_sticks(&shared.aircraft) {
            self.steers = false;
            return;
        }
        self.pass_on(now, shared);
        let pilot = shared.pilots.of(shared.control.holder());
        if pilot.is_some_and(|pilot| pilot.is_fresh(now, &shared.parameters)) {
            return;
        }
        if shared.aircraft.mode() == Mode::Altitude {
            let (mode, text) = match shared.parameters.link.sticks_loss_action {
                SticksLossAction::Hold => (Mode::Hold, "Sticks stopped: back to Hold"),
                SticksLossAction::Return => (Mode::Return, "Sticks stopped: Return"),
            };
            return self.fallback.request(mode, text, now, shared);
        }
        // What was held back is out of date now.
        self.is_new = false;
        if self.steers && shared.intents.push(VehicleCommand::Sticks(Sticks::CENTRED)).is_some() {
            self.steers = false;
            let text = "Sticks stopped: holding altitude and course";
            shared.texts.publish(MavSeverity::MAV_SEVERITY_WARNING, text);
        }
    }

    fn next_deadline(&self, shared: &Shared) -> Option<WallTime> {
        if !flies_by_sticks(&shared.aircraft) {
            return None;
        }
        if shared.aircraft.mode() == Mode::Position {
            if !self.steers && !self.is_new {
                return None;
            }
        } else if let Some(at) = self.fallback.next_deadline() {
            return Some(at);
        }
        let pilot = shared.pilots.of(shared.control.holder());
        // Altitude without sticks: the loss is handled at once.
        let Some(pilot) = pilot else { return Some(WallTime::ZERO) };
        let timeout = stick_timeout(&shared.parameters);
        Some(self.forwarding.deadline(pilot.received, timeout, self.is_new))
    }
}

impl Manual {
    fn pass_on(&mut self, now: WallTime, shared: &mut Shared) {
        let is_early = self.forwarding.is_early(now);
        if !flies_by_sticks(&shared.aircraft) || !self.is_new || is_early {
            return;
        }
        let pilot = shared.pilots.of(shared.control.holder());
        let Some(pilot) = pilot.filter(|pilot| pilot.is_fresh(now, &shared.parameters)) else {
            return;
        };
        if shared.intents.push(VehicleCommand::Sticks(pilot.sticks)).is_some() {
            self.is_new = false;
            self.forwarding.passed_on = Some(now);
            self.steers = true;
        }
    }
}

fn flies_by_sticks(aircraft: &Aircraft) -> bool {
    aircraft.phase() == Phase::Flying && matches!(aircraft.mode(), Mode::Position | Mode::Altitude)
}

fn stick_timeout(parameters: &Parameters) -> Duration {
    Duration::try_from_secs_f64(parameters.link.sticks_loss_s).unwrap_or(Duration::ZERO)
}

/// `None` if all axes are absent.
fn of_joystick(control: &ManualControl) -> Option<Sticks> {
    let axis = |value: i16| (value != i16::MAX).then(|| (f64::from(value) / FULL).clamp(-1.0, 1.0));
    let (forward, right, thrust) = (axis(control.x), axis(control.y), axis(control.z));
    forward.or(right).or(thrust)?;
    Some(Sticks {
        roll: right.unwrap_or(0.0),
        // Not `-forward`, which makes minus zero of a centred stick.
        climb: 0.0 - forward.unwrap_or(0.0),
        // MAVLink has negative thrust below zero, which this engine does not have.
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
