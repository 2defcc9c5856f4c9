//! Flights as values.

mod flight;
mod unread_verdict;
