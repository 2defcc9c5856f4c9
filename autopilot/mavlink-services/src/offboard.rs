//! Setpoints of an offboard stream: SET_ATTITUDE_TARGET, SET_POSITION_TARGET_GLOBAL_INT and
//! SET_POSITION_TARGET_LOCAL_NED. This file reads them.
//!
//! The stream must not pause for longer than `COM_OF_LOSS_T` of wall time, since the sender's clock is a
//! wall clock, even while the simulation is paused. Without a flying aircraft setpoints are
//! ignored. Each system has its own stream: Offboard is entered on the stream of the system that requests
//! it, and then the setpoints of the system that has control count ([`super::control`]).

use core::fmt;
use core::time::Duration;

use ::mavlink::dialects::common::{AttitudeTargetTypemask, SET_ATTITUDE_TARGET_DATA};
use icd::Ned;

use crate::codec::{Message, PositionTarget};
use crate::modes::Fallback;
use crate::peers::From;
use crate::wall_time::WallTime;
use crate::{Service, Shared, convert};
use flight_management::command::{Outcome, VehicleCommand};
use flight_management::event::EventKind;
use flight_management::parameters::Parameters;
use flight_management::vehicle::{Mode, Place, Setpoint, VehicleEvent};

/// Least interval between two setpoints that the vehicle receives, whatever the rate of the messages.
const INTERVAL: Duration = Duration::from_millis(10);

/// Systems whose setpoints are followed; the one silent for the longest makes room.
const STREAMS_MAX: usize = 4;

/// The setpoints of one system.
#[derive(Debug, Default)]
struct Stream {
    system: u8,
    /// Latest usable setpoint and its time.
    latest: Option<(WallTime, Read)>,
    /// It has not been forwarded yet.
    is_new: bool,
    /// The setpoint was unusable, and the station has received a report of it.
    reported_unusable: bool,
    /// The setpoint came without control, and the station has received a report of it.
    reported_uncontrolled: bool,
}

impl Stream {
    fn is_fresh(&self, now: WallTime, parameters: &Parameters) -> bool {
        self.latest.is_some_and(|(at, _)| now.since(at) <= setpoint_timeout(parameters))
    }
}

/// The streams of setpoints, that of the latest sender last.
#[derive(Debug, Default)]
pub struct SetpointStreams(Vec<Stream>);

impl SetpointStreams {
    /// A usable setpoint of this system arrived a moment ago.
    pub fn is_fresh(&self, system: u8, now: WallTime, parameters: &Parameters) -> bool {
        self.of(Some(system)).is_some_and(|stream| stream.is_fresh(now, parameters))
    }

    fn of(&self, system: Option<u8>) -> Option<&Stream> {
        self.0.iter().find(|stream| Some(stream.system) == system)
    }

    /// The stream of a system that has just sent a message.
    fn receive(&mut self, system: u8) -> &mut Stream {
        let known = self.0.iter().position(|stream| stream.system == system);
        let stream = match known {
            Some(place) => self.0.remove(place),
            None => Stream { system, ..Stream::default() },
        };
        if self.0.len() >= STREAMS_MAX {
            self.0.remove(0);
        }
        self.0.push_mut(stream)
    }
}

/// Forwards the setpoints of the station that has control to the vehicle.
#[derive(Debug, Default)]
pub struct Offboard {
    passed_on: Option<WallTime>,
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
        let stream = shared.setpoints.receive(system);
        if lacks_control && !core::mem::replace(&mut stream.reported_uncontrolled, true) {
            let text = format!("Setpoints of system {system} refused: it has no control");
            shared.texts.warn(now, text);
        }
        match read {
            Ok(read) => {
                stream.latest = Some((now, read));
                stream.is_new = true;
                stream.reported_unusable = false;
                self.pass_on(now, shared);
            }
            Err(Unusable(reason)) if !lacks_control && !stream.reported_unusable => {
                stream.reported_unusable = true;
                shared.texts.warn(now, format!("Setpoint refused: {reason}"));
            }
            Err(_) => {}
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
        for stream in &mut shared.setpoints.0 {
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
        let latest = stream.and_then(|stream| Some((stream, stream.latest?)));
        let Some((stream, (at, _))) = latest else { return Some(WallTime::ZERO) };
        let early = self.passed_on.filter(|_| stream.is_new).map(|at| at + INTERVAL);
        // One microsecond beyond the last instant at which the setpoint counts.
        let stale = at + setpoint_timeout(&shared.parameters) + Duration::from_micros(1);
        Some(early.map_or(stale, |early| early.min(stale)))
    }
}

impl Offboard {
    fn pass_on(&mut self, now: WallTime, shared: &mut Shared) {
        let is_early = self.passed_on.is_some_and(|at| now.since(at) < INTERVAL);
        if !shared.aircraft.flies_offboard() || is_early {
            return;
        }
        let holder = shared.control.holder();
        let mut streams = shared.setpoints.0.iter_mut();
        let stream = streams.find(|stream| Some(stream.system) == holder);
        let due = stream.filter(|stream| stream.is_new && stream.is_fresh(now, &shared.parameters));
        let Some((stream, (_, read))) = due.and_then(|s| s.latest.map(|latest| (s, latest))) else {
            return;
        };
        let number = shared.intents.push(VehicleCommand::Setpoint(read.setpoint));
        if number.is_some() {
            stream.is_new = false;
            // The outcome of an older setpoint does not count.
            self.number = self.number.or(number);
            self.passed_on = Some(now);
            self.report(&read, now, shared);
        }
    }

    /// Reports once how the flight differs from the setpoint.
    fn report(&mut self, read: &Read, now: WallTime, shared: &mut Shared) {
        if let Some(limit) = read.limited.filter(|_| !self.reported.limited) {
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
/// MAV_FRAME with the altitude above sea level, above home and above the ground. Home is on the ground, and
/// the ground is at altitude zero, so that they are the same here.
const GLOBAL_FRAMES: [u8; 6] = [0, 3, 5, 6, 10, 11];
const LOCAL_NED: u8 = 1;
/// MAV_FRAME_BODY_NED and MAV_FRAME_BODY_FRD: forward, right and down of a level aircraft with this heading.
const BODY_FRAMES: [u8; 2] = [8, 12];
/// Below this a velocity has no course, m/s.
const STANDING_M_S: f64 = 1.0;
/// Just inside the roll limit, since the vehicle compares in degrees and a conversion there and back rounds.
const INSIDE: f64 = 1.0 - 1.0e-12;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Read {
    /// The setpoint, within the limits.
    pub setpoint: Setpoint,
    /// A requested value that is not followed as sent.
    pub limited: Option<Limited>,
}

/// A value that was limited.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limited {
    what: &'static str,
    unit: &'static str,
    requested: f64,
    flown: f64,
}

impl fmt::Display for Limited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, unit, requested, flown } = self;
        write!(f, "{what} {requested:.1} {unit} is flown as {flown:.1} {unit}")
    }
}

/// Why a setpoint cannot be flown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unusable(pub &'static str);

/// Limits values and remembers the first one that exceeded its limit.
#[derive(Default)]
struct Limiter(Option<Limited>);

impl Limiter {
    fn limit(
        &mut self,
        what: &'static str,
        unit: &'static str,
        requested: f64,
        (min, max): (f64, f64),
    ) -> f64 {
        let flown = requested.max(min).min(max);
        if requested < min || requested > max {
            self.0 = self.0.or(Some(Limited { what, unit, requested, flown }));
        }
        flown
    }

    fn read(self, setpoint: Setpoint) -> Read {
        Read { setpoint, limited: self.0 }
    }
}

pub fn of_attitude(
    data: &SET_ATTITUDE_TARGET_DATA,
    parameters: &Parameters,
) -> Result<Read, Unusable> {
    if data.type_mask.contains(AttitudeTargetTypemask::ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE) {
        return Err(Unusable("the attitude is marked as ignored"));
    }
    let euler = convert::euler_of(data.q).ok_or(Unusable("q is no unit quaternion"))?;
    let mut limiter = Limiter::default();
    let limit_deg = parameters.limits.roll_max_deg;
    limiter.limit("roll", "deg", euler.phi.to_degrees(), (-limit_deg, limit_deg));
    let limit = convert::radians(limit_deg) * INSIDE;
    Ok(limiter.read(Setpoint::Roll(euler.phi.clamp(-limit, limit))))
}

/// SET_POSITION_TARGET_GLOBAL_INT.
///
/// # Errors
/// A frame that is not global, no position and no velocity, or invalid values.
pub fn of_global(
    target: &PositionTarget<i32>,
    altitude_m: f64,
    parameters: &Parameters,
) -> Result<Read, Unusable> {
    if !GLOBAL_FRAMES.contains(&target.frame) {
        return Err(Unusable("the frame is none of 0, 3, 5, 6, 10 and 11"));
    }
    if !uses_position(target.ignored)? {
        return of_velocity(target.velocity, 0.0, target.ignored, altitude_m, parameters);
    }
    let latitude = convert::degrees_of_e7(target.x);
    let longitude = convert::degrees_of_e7(target.y);
    if latitude.abs() > 90.0 || longitude.abs() > 180.0 {
        return Err(Unusable("latitude and longitude are no place on the Earth"));
    }
    let mut limiter = Limiter::default();
    let altitude_m = if target.ignored & Z == 0 {
        let limits = &parameters.limits;
        let range = (limits.altitude_min_m, limits.altitude_max_m);
        Some(limiter.limit("altitude", "m", finite(target.z)?, range))
    } else {
        None
    };
    let place = Place {
        latitude_rad: convert::radians(latitude),
        longitude_rad: convert::radians(longitude),
    };
    Ok(limiter.read(Setpoint::Position { place, altitude_m }))
}

/// SET_POSITION_TARGET_LOCAL_NED, with the heading of the aircraft, rad from north, if it is known.
///
/// # Errors
/// A frame that is neither the local one nor one of the body, a position in a frame of the body, no position and no
/// velocity, or invalid values.
pub fn of_local(
    target: &PositionTarget<f32>,
    heading_rad: Option<f64>,
    altitude_m: f64,
    parameters: &Parameters,
) -> Result<Read, Unusable> {
    let forward_rad = match target.frame {
        LOCAL_NED => 0.0,
        frame if BODY_FRAMES.contains(&frame) => {
            heading_rad.ok_or(Unusable("the heading is not known yet"))?
        }
        _ => return Err(Unusable("the frame is none of 1, 8 and 12")),
    };
    if !uses_position(target.ignored)? {
        return of_velocity(target.velocity, forward_rad, target.ignored, altitude_m, parameters);
    }
    if target.frame != LOCAL_NED {
        return Err(Unusable("a position needs frame 1 (local NED), not one of the body"));
    }
    if target.ignored & Z != 0 {
        return Err(Unusable("a local position needs x, y and z"));
    }
    let position = Ned::new(finite(target.x)?, finite(target.y)?, finite(target.z)?);
    Ok(Limiter::default().read(Setpoint::LocalPosition(position)))
}

/// Whether the setpoint gives a position.
fn uses_position(ignored: u16) -> Result<bool, Unusable> {
    match (ignored & XY, ignored & Z) {
        (0, _) => Ok(true),
        (XY, Z) => Ok(false),
        (XY, _) => Err(Unusable("an altitude needs a place")),
        _ => Err(Unusable("x and y only together")),
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
                return Err(Unusable("a plane cannot stand still"));
            }
            let range = (slowest_m_s, fastest_m_s);
            let speed = limiter.limit("speed", "m/s", speed, range);
            (Some(libm::atan2(east, north)), Some(speed))
        }
        VELOCITY_XY => (None, None),
        _ => return Err(Unusable("velocity north and east only together")),
    };
    let climb_m_s = if ignored & VELOCITY_Z == 0 {
        let limit = parameters.navigation.climb_max_m_s;
        limiter.limit("climb", "m/s", 0.0 - finite(down)?, (-limit, limit))
    } else if course_rad.is_none() {
        return Err(Unusable("neither position nor velocity is given"));
    } else {
        0.0
    };
    Ok(limiter.read(Setpoint::Velocity { course_rad, speed_m_s, climb_m_s }))
}

fn finite(value: f32) -> Result<f64, Unusable> {
    if value.is_finite() { Ok(f64::from(value)) } else { Err(Unusable("a value is not finite")) }
}
