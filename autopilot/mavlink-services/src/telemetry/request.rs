//! REQUEST_MESSAGE: one message of the table, now, for the peer that asks.

use ::mavlink::MessageData;
use ::mavlink::dialects::common::{DEBUG_FLOAT_ARRAY_DATA, MESSAGE_INTERVAL_DATA, MavResult};

use super::intervals::whole;
use super::registry::{self, Nothing};
use super::{View, faults};
use crate::codec::Encoded;
use crate::context::Context;
use crate::peers::Peer;
use crate::refused::Refused;
use crate::wall_time::WallTime;

/// REQUEST_MESSAGE of one peer: param1 and param2 of the command; what answers it. param2 picks one of a
/// list of modes by its number, of the arrays `WHY` or `FAULTS` by its id, and the message of which MESSAGE_INTERVAL tells.
///
/// # Errors
/// No such message, nothing to tell yet, or nothing with this number.
pub fn request(
    ctx: &Context,
    peer: Peer,
    now: WallTime,
    message_id: f32,
    param2: f32,
) -> Result<Vec<Encoded>, Refused> {
    let telemetry = &*ctx.telemetry;
    let id = whole(message_id)?;
    if id == MESSAGE_INTERVAL_DATA::ID {
        return telemetry.interval(peer, param2).map(|message| vec![message]);
    }
    let unsupported = Refused::silent(MavResult::MAV_RESULT_UNSUPPORTED);
    let (_, row) = registry::find(id).ok_or(unsupported)?;
    let index = index(param2)?;
    let is_array = id == DEBUG_FLOAT_ARRAY_DATA::ID;
    if is_array && index > faults::FAULTS_ID {
        return Err(Refused::silent(MavResult::MAV_RESULT_DENIED));
    }
    if is_array && index == faults::FAULTS_ID && ctx.aircraft.snapshot().is_some() {
        return Ok(faults::messages(ctx.aircraft, ctx.effectors()));
    }
    let (aircraft, model) = (ctx.aircraft, ctx.model);
    let (metadata, host) = (&telemetry.metadata, telemetry.host);
    let view = View { aircraft, model, metadata, host, now };
    let mut answer = row.answer(&view, index).map_err(|nothing| {
        Refused::silent(match nothing {
            Nothing::Yet => MavResult::MAV_RESULT_TEMPORARILY_REJECTED,
            Nothing::There => MavResult::MAV_RESULT_DENIED,
        })
    })?;
    if is_array && index == 0 {
        answer.extend(faults::messages(ctx.aircraft, ctx.effectors()));
    }
    Ok(answer)
}

/// A number in a list. NaN means "not given", that is all.
fn index(param2: f32) -> Result<u8, Refused> {
    if param2.is_nan() {
        return Ok(0);
    }
    let number = whole(param2)?;
    u8::try_from(number).map_err(|_| Refused::silent(MavResult::MAV_RESULT_DENIED))
}
