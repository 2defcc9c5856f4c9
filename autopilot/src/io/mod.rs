//! Sockets and waiting: everything of the autopilot that touches the outside.

pub mod channels;
