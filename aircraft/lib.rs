//! The aircraft that come with the project, a folder each: `airframe.toml` is the truth, for the plant alone; `model.toml` is what
//! the controller knows; `geometry.toml` is what it looks like. Here they are texts; who reads them is `plant_sim::Airframe`,
//! `flight_management::configuration` and `lab_engine::geometry`.
//!
//! The controller is blind to the truth: nothing under `autopilot/` names an airframe (`tests/architecture/source_rules.rs`).
#![no_std]

/// The aircraft that flies unless another one is named: the paper's jet.
pub const DEFAULT_NAME: &str = "tvc_jet";
pub const DEFAULT_AIRFRAME: &str = include_str!("tvc_jet/airframe.toml");
/// The jet with Mach effects, which the controller's model lacks: for studies of false alarms.
pub const MACH_AIRFRAME: &str = include_str!("tvc_jet_mach/airframe.toml");
/// An aircraft of tables.
pub const F16_AIRFRAME: &str = include_str!("f16/airframe.toml");
pub const AEROSONDE_AIRFRAME: &str = include_str!("aerosonde/airframe.toml");

/// The airframe files by the names of their aircraft.
pub const AIRFRAMES: &[(&str, &str)] = &[
    (DEFAULT_NAME, DEFAULT_AIRFRAME),
    ("tvc_jet_mach", MACH_AIRFRAME),
    ("f16", F16_AIRFRAME),
    ("aerosonde", AEROSONDE_AIRFRAME),
    ("aerosonde_vtail", include_str!("aerosonde_vtail/airframe.toml")),
    ("skywalker_x8", include_str!("skywalker_x8/airframe.toml")),
];

/// Written by `sitl aircraft linearize`, as every model here.
pub const DEFAULT_MODEL: &str = include_str!("tvc_jet/model.toml");
pub const AEROSONDE_MODEL: &str = include_str!("aerosonde/model.toml");

/// The model files by the names of their aircraft. The jet with Mach effects has the jet's model, which lacks them.
pub const MODELS: &[(&str, &str)] = &[
    (DEFAULT_NAME, DEFAULT_MODEL),
    ("tvc_jet_mach", DEFAULT_MODEL),
    ("f16", include_str!("f16/model.toml")),
    ("aerosonde", AEROSONDE_MODEL),
    ("aerosonde_vtail", include_str!("aerosonde_vtail/model.toml")),
    ("skywalker_x8", include_str!("skywalker_x8/model.toml")),
];

/// The geometry files by the names of their aircraft. The jet with Mach effects looks like the jet.
pub const GEOMETRIES: &[(&str, &str)] = &[
    (DEFAULT_NAME, JET_GEOMETRY),
    ("tvc_jet_mach", JET_GEOMETRY),
    ("f16", include_str!("f16/geometry.toml")),
    ("aerosonde", include_str!("aerosonde/geometry.toml")),
    ("aerosonde_vtail", include_str!("aerosonde_vtail/geometry.toml")),
    ("skywalker_x8", include_str!("skywalker_x8/geometry.toml")),
];
const JET_GEOMETRY: &str = include_str!("tvc_jet/geometry.toml");
