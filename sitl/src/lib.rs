//! Sees both sides: flies plant and autopilot together and judges the flights.

pub mod arrangement;
pub mod bench;
pub mod cli;
pub mod closed_loop;
pub mod configuration;
pub mod dispersion;
pub mod echo;
pub mod envelope;
pub mod false_alarms;
pub mod figures;
pub mod flight_log;
pub mod fly;
pub mod launch;
pub mod linearize;
pub mod metrics;
pub mod mission;
pub mod paper;
pub mod plot;
pub mod replay;
pub mod report;
pub mod runner;
pub mod settings;
pub mod table;
pub mod udp_flight;
