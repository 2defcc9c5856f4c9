//! Setpoints of an offboard stream: SET_ATTITUDE_TARGET, SET_POSITION_TARGET_GLOBAL_INT and
//! SET_POSITION_TARGET_LOCAL_NED. This file reads them.
//!
//! The stream must not pause for longer than `COM_OF_LOSS_T` of wall time, since the sender's clock is a
//! wall clock, even while the simulation is paused. Without a flying aircraft setpoints are
//! ignored. Each system has its own stream: Offboard is entered on the stream of the system that requests
//! it, and then the setpoints of the system that has control count ([`super::control`]).

use core::time::Duration;

use ::mavlink::dialects::common::{AttitudeTargetTypemask, SET_ATTITUDE_TARGET_DATA};
use icd::Ned;

use crate::codec::{Message, PositionTarget};
use crate::peers::From;
use crate::streams::{Fallback, Forwarding};
use crate::wall_time::WallTime;
use crate::{Service, Shared, convert};
use flight_management::command::{Outcome, VehicleCommand};
use flight_management::event::EventKind;
use flight_management::parameters::Parameters;
use flight_management::vehicle::{Mode, Setpoint, VehicleEvent};

/// The setpoints of one system.
#[derive(Debug, Default)]
pub struct Setpoints {
    /// Latest usable setpoint and its time.
    latest: Option<(WallTime, Read)>,
    /// It has not been forwarded yet.
    is_new: bool,
    /// The setpoint was unusable, and the station has received a report of it.
    reported_unusable: bool,
    /// The setpoint came without control, and the station has received a report of it.
    reported_uncontrolled: bool,
}

impl Setpoints {
    /// A usable setpoint arrived a moment ago.
    pub fn is_fresh(&self, now: WallTime, parameters: &Parameters) -> bool {
        self.latest.as_ref().is_some_and(|(at, _)| now.since(*at) <= setpoint_timeout(parameters))
    }
}

/// Forwards the setpoints of the station that has control to the vehicle.
#[derive(Debug, Default)]
pub struct Offboard {
    forwarding: Forwarding,
    /// Number of the oldest intent with a setpoint whose outcome is open.
    number: Option<u32>,
    /// Reports already made since Offboard began.
    reported: Reported,
    fallback: Fallback,
}

#[derive(Debug, Default)]
struct Reported {
    refused: bool,
    limited: bool,
    unused: bool,
}

impl Service for Offboard {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        let parameters = &shared.parameters;
        let altitude_m = shared.aircraft.altitude_reference_m();
        let read = match message {
            Message::SetAttitudeTarget(data) => of_attitude(data, parameters),
            Message::SetPositionGlobal(target) => of_global(target, altitude_m, parameters),
            Message::SetPositionLocal(target) => {
                let heading_rad =
                    shared.aircraft.snapshot().map(|state| state.motion().attitude.psi);
                of_local(target, heading_rad, altitude_m, parameters)
            }
            _ => return,
        };
        let system = from.sender.system;
        let lacks_control =
            shared.aircraft.flies_offboard() && shared.control.holder() != Some(system);
        let mut stream = shared.setpoints.remove(system).unwrap_or_default();
        if lacks_control && !core::mem::replace(&mut stream.reported_uncontrolled, true) {
            let text = format!("Setpoints of system {system} refused: it has no control");
            shared.texts.warn(now, text);
        }
        let is_usable = read.is_ok();
        match read {
            Ok(read) => {
                stream.latest = Some((now, read));
                stream.is_new = true;
                stream.reported_unusable = false;
            }
            // Who has no control is told only that: what its setpoints say does not matter.
            Err(reason) if !lacks_control && !stream.reported_unusable => {
                stream.reported_unusable = true;
                shared.texts.warn(now, format!("Setpoint refused: {reason}"));
            }
            Err(_) => {}
        }
        shared.setpoints.replace(system, stream);
        if is_usable {
            self.pass_on(now, shared);
        }
    }

    /// Reports once that the vehicle refuses the setpoints.
    fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        shared: &mut Shared,
    ) {
        if self.number.take_if(|own| *own == number).is_none() || !shared.aircraft.flies_offboard()
        {
            return;
        }
        match outcome {
            Outcome::Refused(refusal) if !self.reported.refused => {
                self.reported.refused = true;
                shared.texts.warn(now, format!("Setpoint refused: {refusal}"));
            }
            Outcome::Done => self.reported.refused = false,
            _ => {}
        }
    }

    /// When Offboard begins, the latest setpoint counts at once.
    fn handle_event(&mut self, event: &EventKind, now: WallTime, shared: &mut Shared) {
        if *event != EventKind::Vehicle(VehicleEvent::Mode(Mode::Offboard)) {
            return;
        }
        for stream in shared.setpoints.all_mut() {
            stream.is_new = true;
            stream.reported_unusable = false;
            stream.reported_uncontrolled = false;
        }
        self.fallback.reset();
        self.reported = Reported::default();
        self.number = None;
        self.pass_on(now, shared);
    }

    /// Forwards setpoints held back by the rate limit, and returns to Hold when none arrive.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        if !shared.aircraft.flies_offboard() {
            return;
        }
        self.pass_on(now, shared);
        let stream = shared.setpoints.of(shared.control.holder());
        if !stream.is_some_and(|stream| stream.is_fresh(now, &shared.parameters)) {
            let text = "Offboard setpoints stopped: back to Hold";
            self.fallback.request(Mode::Hold, text, now, shared);
        }
    }

    fn next_deadline(&self, shared: &Shared) -> Option<WallTime> {
        if !shared.aircraft.flies_offboard() {
            return None;
        }
        if let Some(at) = self.fallback.next_deadline() {
            return Some(at);
        }
        let stream = shared.setpoints.of(shared.control.holder());
        let latest = stream.and_then(|stream| Some((stream, stream.latest.as_ref()?.0)));
        // No usable setpoint at all: the fallback is due at once.
        let Some((stream, at)) = latest else { return Some(WallTime::ZERO) };
        let timeout = setpoint_timeout(&shared.parameters);
        Some(self.forwarding.deadline(at, timeout, stream.is_new))
    }
}

impl Offboard {
    fn pass_on(&mut self, now: WallTime, shared: &mut Shared) {
        if !shared.aircraft.flies_offboard() || self.forwarding.is_early(now) {
            return;
        }
        let stream = shared.setpoints.of_mut(shared.control.holder());
        let due = stream.filter(|stream| stream.is_new && stream.is_fresh(now, &shared.parameters));
        let Some(stream) = due else { return };
        let Some((_, read)) = stream.latest.clone() else { return };
        let number = shared.intents.push(VehicleCommand::Setpoint(read.setpoint));
        if number.is_some() {
            stream.is_new = false;
            // The outcome of an older setpoint does not count.
            self.number = self.number.or(number);
            self.forwarding.passed_on = Some(now);
            self.report(&read, now, shared);
        }
    }

    /// Reports once how the flight differs from the setpoint.
    fn report(&mut self, read: &Read, now: WallTime, shared: &mut Shared) {
        if let Some(limit) = read.limited.as_ref().filter(|_| !self.reported.limited) {
            self.reported.limited = true;
            shared.texts.warn(now, format!("Setpoint limited: {limit}"));
        }
        if matches!(read.setpoint, Setpoint::Roll(_)) && !self.reported.unused {
            self.reported.unused = true;
            let text = "Offboard attitude: roll is flown; pitch, yaw and thrust are not used";
            shared.texts.inform(now, text);
        }
    }
}

fn setpoint_timeout(parameters: &Parameters) -> Duration {
    Duration::try_from_secs_f64(parameters.link.offboard_loss_s).unwrap_or(Duration::ZERO)
}

/// POSITION_TARGET_TYPEMASK: ignored fields.
const XY: u16 = 1 | 2;
const Z: u16 = 4;
const VELOCITY_XY: u16 = 8 | 16;
const VELOCITY_Z: u16 = 32;
const LOCAL_NED: u8 = 1;
/// MAV_FRAME_BODY_NED and MAV_FRAME_BODY_FRD: forward, right and down of a level aircraft with this heading.
const BODY_FRAMES: [u8; 2] = [8, 12];
/// Below this a velocity has no course, m/s.
const STANDING_M_S: f64 = 1.0;
/// Just inside the roll limit, since the vehicle compares in degrees and a conversion there and back rounds.
const INSIDE: f64 = 1.0 - 1.0e-12;

#[derive(Debug, Clone, PartialEq)]
struct Read {
    /// The setpoint, within the limits.
    setpoint: Setpoint,
    /// A requested value that is not followed as sent.
    limited: Option<String>,
}

/// Why a setpoint cannot be flown.
type Unusable = &'static str;

/// Limits values and remembers the first one that exceeded its limit.
#[derive(Default)]
struct Limiter(Option<String>);

impl Limiter {
    fn limit(&mut self, what: &str, unit: &str, requested: f64, (min, max): (f64, f64)) -> f64 {
        let flown = requested.max(min).min(max);
        if self.0.is_none() && (requested < min || requested > max) {
            self.0 = Some(format!("{what} {requested:.1} {unit} is flown as {flown:.1} {unit}"));
        }
        flown
    }

    fn read(self, setpoint: Setpoint) -> Read {
        Read { setpoint, limited: self.0 }
    }
}

fn of_attitude(data: &SET_ATTITUDE_TARGET_DATA, parameters: &Parameters) -> Result<Read, Unusable> {
    if data.type_mask.contains(AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE) {
        return Err("the attitude is marked as ignored");
    }
    let euler = convert::euler_of(data.q).ok_or("q is no unit quaternion")?;
    let mut limiter = Limiter::default();
    let limit_deg = parameters.limits.roll_max_deg;
    // Only for the report. The flown angle has a limit of its own below.
    limiter.limit("roll", "deg", euler.phi.to_degrees(), (-limit_deg, limit_deg));
    let limit = convert::radians(limit_deg) * INSIDE;
    Ok(limiter.read(Setpoint::Roll(euler.phi.clamp(-limit, limit))))
}

/// SET_POSITION_TARGET_GLOBAL_INT.
fn of_global(
    target: &PositionTarget<i32>,
    altitude_m: f64,
    parameters: &Parameters,
) -> Result<Read, Unusable> {
    if !convert::GLOBAL_FRAMES.contains(&target.frame) {
        return Err("the frame is none of 0, 3, 5, 6, 10 and 11");
    }
    if !uses_position(target.ignored)? {
        return of_velocity(target.velocity, 0.0, target.ignored, altitude_m, parameters);
    }
    let place = convert::place(convert::degrees_of_e7(target.x), convert::degrees_of_e7(target.y))
        .ok_or("latitude and longitude are no place on the Earth")?;
    let mut limiter = Limiter::default();
    let altitude_m = if target.ignored & Z == 0 {
        let limits = &parameters.limits;
        let range = (limits.altitude_min_m, limits.altitude_max_m);
        Some(limiter.limit("altitude", "m", finite(target.z)?, range))
    } else {
        None
    };
    Ok(limiter.read(Setpoint::Position { place, altitude_m }))
}

/// SET_POSITION_TARGET_LOCAL_NED, with the heading of the aircraft, rad from north, if it is known.
fn of_local(
    target: &PositionTarget<f32>,
    heading_rad: Option<f64>,
    altitude_m: f64,
    parameters: &Parameters,
) -> Result<Read, Unusable> {
    let forward_rad = match target.frame {
        LOCAL_NED => 0.0,
        frame if BODY_FRAMES.contains(&frame) => {
            heading_rad.ok_or("the heading is not known yet")?
        }
        _ => return Err("the frame is none of 1, 8 and 12"),
    };
    if !uses_position(target.ignored)? {
        return of_velocity(target.velocity, forward_rad, target.ignored, altitude_m, parameters);
    }
    if target.frame != LOCAL_NED {
        return Err("a position needs frame 1 (local NED), not one of the body");
    }
    if target.ignored & Z != 0 {
        return Err("a local position needs x, y and z");
    }
    let position = Ned::new(finite(target.x)?, finite(target.y)?, finite(target.z)?);
    Ok(Limiter::default().read(Setpoint::LocalPosition(position)))
}

/// Whether the setpoint gives a position.
fn uses_position(ignored: u16) -> Result<bool, Unusable> {
    match (ignored & XY, ignored & Z) {
        (0, _) => Ok(true),
        (XY, Z) => Ok(false),
        (XY, _) => Err("an altitude needs a place"),
        _ => Err("x and y only together"),
    }
}

/// A velocity forward, right and down, where forward has this angle from north; its limits are those at an altitude.
fn of_velocity(
    [forward, right, down]: [f32; 3],
    forward_rad: f64,
    ignored: u16,
    altitude_m: f64,
    parameters: &Parameters,
) -> Result<Read, Unusable> {
    let mut limiter = Limiter::default();
    let [slowest_m_s, fastest_m_s] = parameters.limits.airspeeds_m_s(altitude_m);
    let (course_rad, speed_m_s) = match ignored & VELOCITY_XY {
        0 => {
            let (forward, right) = (finite(forward)?, finite(right)?);
            let (sin, cos) = libm::sincos(forward_rad);
            let north = forward * cos - right * sin;
            let east = forward * sin + right * cos;
            let speed = libm::hypot(north, east);
            if speed < STANDING_M_S {
                return Err("a plane cannot stand still");
            }
            let speed = limiter.limit("speed", "m/s", speed, (slowest_m_s, fastest_m_s));
            (Some(libm::atan2(east, north)), Some(speed))
        }
        VELOCITY_XY => (None, None),
        _ => return Err("velocity north and east only together"),
    };
    let climb_m_s = if ignored & VELOCITY_Z == 0 {
        let limit = parameters.navigation.climb_max_m_s;
        // Not `-down`, which makes minus zero of level flight.
        limiter.limit("climb", "m/s", 0.0 - finite(down)?, (-limit, limit))
    } else if course_rad.is_none() {
        return Err("neither position nor velocity is given");
    } else {
        0.0
    };
    Ok(limiter.read(Setpoint::Velocity { course_rad, speed_m_s, climb_m_s }))
}

fn finite(value: f32) -> Result<f64, Unusable> {
    if value.is_finite() { Ok(f64::from(value)) } else { Err("a value is not finite") }
}
