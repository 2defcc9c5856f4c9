//! The command line, both programs in lockstep, and laws of a user.
#![expect(clippy::disallowed_methods, reason = "the other side of a real program: a socket")]
#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

mod examples;
mod lockstep;
mod own_law;
mod own_law_everywhere;
mod pages;
mod studies;
mod udp_flight;
