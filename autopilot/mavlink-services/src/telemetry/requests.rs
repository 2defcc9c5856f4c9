//! SET_MESSAGE_INTERVAL, GET_MESSAGE_INTERVAL and REQUEST_MESSAGE: for the peer that sends them, and for no other.

use core::time::Duration;

use ::mavlink::MessageData;
use ::mavlink::dialects::common::{DEBUG_FLOAT_ARRAY_DATA, MESSAGE_INTERVAL_DATA, MavResult};

use crate::codec::Encoded;
use crate::command_error::CommandError;
use crate::peers::Peer;
use crate::telemetry::rates::{PeerRates, Requested, SHORTEST};
use crate::telemetry::registry::{Nothing, Rate, Row};
use crate::telemetry::{View, faults, registry};
use crate::wall_time::WallTime;
use crate::{Shared, heartbeat};

/// Longest interval: what MESSAGE_INTERVAL can hold, us.
const LONGEST_US: f32 = 2.0e9;

/// The interval that stops a stream.
const STOP: f32 = -1.0;
/// The interval that stands for the default.
const DEFAULT: f32 = 0.0;

impl PeerRates {
    /// SET_MESSAGE_INTERVAL of one peer: param1 and param2 of the command. -1 stops, 0 goes back to the
    /// default, else microseconds.
    ///
    /// # Errors
    /// No such message, or an interval that is none, too short or too long.
    pub fn set_interval(
        &mut self,
        peer: Peer,
        message_id: f32,
        interval_us: f32,
    ) -> Result<(), CommandError> {
        let (index, row) = streamed(message_id)?;
        let requested = requested(interval_us)?;
        let defaults = self.defaults;
        self.of(peer).request_row(index, row, requested, &defaults);
        Ok(())
    }

    /// GET_MESSAGE_INTERVAL of one peer: the MESSAGE_INTERVAL that answers it. Its interval is -1 for a
    /// stream that is stopped, and 0 for a message that does not exist here.
    ///
    /// # Errors
    /// `message_id` is no message number.
    pub fn interval(&self, peer: Peer, message_id: f32) -> Result<Encoded, CommandError> {
        let id = whole(message_id)?;
        let interval_us = match registry::find(id) {
            None => 0,
            Some((_, row)) if is_heartbeat(row) => microseconds(heartbeat::INTERVAL),
            Some((_, Row { rate: Rate::Answer, .. })) => -1,
            Some((index, row)) => {
                let own = self.peers.iter().find(|rates| rates.peer() == peer);
                let interval = match own {
                    Some(rates) => rates.interval(index, row, &self.defaults),
                    None => row.default_interval(&self.defaults),
                };
                interval.map_or(-1, microseconds)
            }
        };
        let message_id = u16::try_from(id).unwrap_or(u16::MAX);
        Ok(Encoded::new(&MESSAGE_INTERVAL_DATA { message_id, interval_us }))
    }
}

fn is_heartbeat(row: &Row) -> bool {
    row.id == 0
}

fn microseconds(interval: Duration) -> i32 {
    i32::try_from(interval.as_micros()).unwrap_or(i32::MAX)
}

/// The row of a message that can be streamed.
fn streamed(message_id: f32) -> Result<(usize, &'static Row), CommandError> {
    let id = whole(message_id)?;
    let (index, row) = registry::find(id).ok_or_else(|| {
        CommandError::unsupported(format!("Interval refused: there is no message {id}"))
    })?;
    if is_heartbeat(row) {
        return Err(CommandError::denied("Interval refused: heartbeats come once a second"));
    }
    if row.rate == Rate::Answer {
        let text = format!("Interval refused: {} only answers requests", row.name);
        return Err(CommandError::denied(text));
    }
    Ok((index, row))
}

/// `None`: the default.
fn requested(interval_us: f32) -> Result<Option<Requested>, CommandError> {
    if interval_us == STOP {
        return Ok(Some(Requested::Never));
    }
    if interval_us == DEFAULT {
        return Ok(None);
    }
    let shortest_us = SHORTEST.as_micros();
    if !(0.0..=LONGEST_US).contains(&interval_us) {
        let text =
            format!("Interval refused: {interval_us} us is not -1, 0, or {shortest_us} to 2e9");
        return Err(CommandError::denied(text));
    }
    let interval = Duration::from_secs_f64(f64::from(interval_us) * 1.0e-6);
    if interval < SHORTEST {
        let text = format!("Interval refused: {interval_us} us is shorter than {shortest_us} us");
        return Err(CommandError::denied(text));
    }
    Ok(Some(Requested::Every(interval)))
}

/// A message number that came as a float.
pub(super) fn whole(message_id: f32) -> Result<u32, CommandError> {
    // Message numbers have 24 bits, and so have floats.
    let max = 16_777_215.0;
    if message_id.fract() == 0.0 && (0.0..=max).contains(&message_id) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as just checked"
        )]
        return Ok(message_id as u32);
    }
    Err(CommandError::denied(format!("Refused: {message_id} is no message number")))
}

/// REQUEST_MESSAGE of one peer: param1 and param2 of the command; what answers it. param2 picks one of a
/// list of modes by its number, of the arrays `WHY` or `FAULTS` by its id, and the message whose MESSAGE_INTERVAL is requested.
///
/// # Errors
/// No such message, nothing to send yet, or nothing with this number.
pub fn request(
    shared: &Shared,
    peer: Peer,
    now: WallTime,
    message_id: f32,
    param2: f32,
) -> Result<Vec<Encoded>, CommandError> {
    let id = whole(message_id)?;
    if id == MESSAGE_INTERVAL_DATA::ID {
        return shared.rates.interval(peer, param2).map(|message| vec![message]);
    }
    let unsupported = CommandError::without_text(MavResult::MAV_RESULT_UNSUPPORTED);
    let (_, row) = registry::find(id).ok_or(unsupported)?;
    let index = index(param2)?;
    let is_array = id == DEBUG_FLOAT_ARRAY_DATA::ID;
    if is_array && index > faults::FAULTS_ID {
        return Err(CommandError::without_text(MavResult::MAV_RESULT_DENIED));
    }
    if is_array && index == faults::FAULTS_ID && shared.aircraft.snapshot().is_some() {
        return Ok(faults::messages(shared));
    }
    let view = View { shared, now };
    let mut answer = row.answer(&view, index).map_err(|nothing| {
        CommandError::without_text(match nothing {
            Nothing::Yet => MavResult::MAV_RESULT_TEMPORARILY_REJECTED,
            Nothing::There => MavResult::MAV_RESULT_DENIED,
        })
    })?;
    if is_array && index == 0 {
        answer.extend(faults::messages(shared));
    }
    Ok(answer)
}

/// A number in a list. NaN means "not given", that is all.
fn index(param2: f32) -> Result<u8, CommandError> {
    if param2.is_nan() {
        return Ok(0);
    }
    let number = whole(param2)?;
    u8::try_from(number).map_err(|_| CommandError::without_text(MavResult::MAV_RESULT_DENIED))
}
