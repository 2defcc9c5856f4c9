//! The flights that come with the project, as texts. Both programs read them and neither owns them: the plant reads the table
//! `plant`, the autopilot the table `autopilot`.
#![no_std]

/// Level flight without commands and without faults.
pub const NOMINAL: &str = include_str!("nominal.toml");
/// The paper's first case: climb with a left elevator that jams at +30 degrees.
pub const CASE1: &str = include_str!("case1.toml");
/// The paper's second case: turn with a rudder that jams at +7 degrees.
pub const CASE2: &str = include_str!("case2.toml");
/// At rest on a runway, for a ground station.
pub const FIELD: &str = include_str!("field.toml");
/// Takeoff and landing there.
pub const CIRCUIT: &str = concat!(include_str!("field.toml"), include_str!("circuit.toml"));
/// A chain of faults.
pub const CHAIN: &str = include_str!("chain.toml");

/// The scenarios that have a name.
pub const SCENARIOS: &[(&str, &str)] = &[
    ("nominal", NOMINAL),
    ("case1", CASE1),
    ("case2", CASE2),
    ("field", FIELD),
    ("circuit", CIRCUIT),
];
