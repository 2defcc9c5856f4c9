//! The messages of the log service.

use ::mavlink::MessageData;
use ::mavlink::dialects::common::{
    LOG_ERASE_DATA, LOG_REQUEST_DATA_DATA, LOG_REQUEST_END_DATA, LOG_REQUEST_LIST_DATA,
};

use super::{Fields, Message};
use crate::codec::Identity;

/// A request of a ground station to the log service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogRequest {
    /// The entries with these numbers.
    List {
        first: u16,
        /// The last; may be beyond the end.
        last: u16,
    },
    /// Part of one log.
    Data {
        id: u16,
        offset: u32,
        /// Bytes; may be beyond the end.
        count: u32,
    },
    /// End of all requests.
    End,
    /// Removal of all logs.
    Erase,
}

/// The request in a payload and its target; `None` for another message.
pub(super) fn decode(id: u32, payload: &[u8]) -> Option<(Identity, Message)> {
    let f = Fields::<12>::new(payload);
    let (target, request) = match id {
        LOG_REQUEST_LIST_DATA::ID => {
            (f.identity(4), LogRequest::List { first: f.u16(0), last: f.u16(2) })
        }
        LOG_REQUEST_DATA_DATA::ID => {
            let request = LogRequest::Data { id: f.u16(8), offset: f.u32(0), count: f.u32(4) };
            (f.identity(10), request)
        }
        LOG_REQUEST_END_DATA::ID => (f.identity(0), LogRequest::End),
        LOG_ERASE_DATA::ID => (f.identity(0), LogRequest::Erase),
        _ => return None,
    };
    Some((target, Message::Log(request)))
}
