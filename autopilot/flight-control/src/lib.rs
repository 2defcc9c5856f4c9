//! Two-step fault-tolerant flight control for a jet UAV with thrust vectoring.
//!
//! Wang, Chen, Ren, Liu, "Two-Step Robust Fault-Tolerant Controller Design Based on NESO for UAVs with
//! Actuator Faults and Disturbances", Drones 2025, 9(3), 183. Equation numbers in this crate are that
//! paper's; docs/paper.md is the index, docs/symbols.md the dictionary.
//!
//! ```text
//!  Sensors ─> navigation ─> NavigationState (for vehicle, guidance, scripts and telemetry too)
//!                                │
//!                                ├─────────────> main_controller ── u1 ──┐        step one
//!                                │                    ^ saturated        v
//!                                ├─> design_model ─> estimator of the compensator ─> activation
//!                                │      ^ modelled      │ z2                            │ fade
//!                                │      │ positions     v                               v  step two
//!                                └──────┼───────────> compensate ── u_cf ──> mixer ─> Actuators
//!                                       └── healthy_actuators <─────────────────┘
//! ```
//!
//! Exactly two signals run backwards, both one period old: the modelled positions of healthy effectors
//! and the saturation report.
//!
//! | block of the paper | file |
//! |---|---|
//! | Fig. 1 | [`flight_control`] |
//! | the "sensors" of Fig. 1: samples to state | [`navigation`]; from sensors with errors [`estimator`] |
//! | Figs. 2, 3: main controller, step one | [`main_controller`]: the PID and the other laws |
//! | NESO, step two a | [`compensator::neso`] |
//! | automatic activation | [`activation`] |
//! | compensator, step two b | [`mod@compensator`] |
//! | design model f, g, g_T, g_c | [`design_model`] |
//! | actuators as they should move | [`healthy_actuators`] |
//! | allocation to effectors, limits | [`mixer`] |
//! | not in the paper: demand to any number of effectors | [`allocator`], solver [`allocation`] |
//! | not in the paper: more than the paper's command can give | [`relief`], [`oscillation`] |
//! | not in the paper: which effector it is | [`isolation`] |
//! | not in the paper: what the compensator has left | [`mod@authority`] |
//! | not in the paper: trim of level flight and level turns | [`mod@design_model::level_turn`] |
//! | not in the paper: why the altitude is not held | [`altitude_limit`] |
//! | not in the paper: roll reference from a path | [`guidance`] |
//!
//! The crate is pure: no `std`, no allocation, no clock, no randomness, and nothing in a step can fail.
//! Transcendental functions come from `libm`, so the bits do not depend on the host.
//!
//! # A step
//!
//! ```
//! use flight_control::navigation::Validity;
//! use flight_control::{Demand, FlightControl, Gains, NavigationState};
//! use icd::{ControlPeriod, tvc_jet};
//!
//! // The controller's model of the aircraft. The autopilot's process reads the file, the laws only get numbers.
//! let model = toml::from_str(aircraft::DEFAULT_MODEL)?;
//! let mut laws = FlightControl::new(ControlPeriod::DEFAULT, &model, &Gains::REFERENCE);
//!
//! let state = NavigationState {
//!     altitude_m: 5_000.0,
//!     airspeed_m_s: 264.0,
//!     alpha: 0.035,
//!     thrust_n: 27_000.0,
//!     valid: Validity::COMPLETE,
//!     ..NavigationState::at_rest()
//! };
//! // Demand a roll angle to the right: the left aileron goes down.
//! let demand = Demand { altitude_m: 5_000.0, roll_rad: 0.2, airspeed_m_s: 264.0 };
//! let log = (0..100).map(|_| laws.step(&state, &demand)).last().ok_or("no step")?;
//! assert!(log.actuators().commands[tvc_jet::LEFT_AILERON] > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![no_std]
#![warn(missing_docs)]

#[cfg(test)]
extern crate std;

// Its macro states the gains in the files of the laws.
#[macro_use]
pub mod gains;

pub mod activation;
pub mod aircraft_model;
pub mod allocation;
pub mod allocator;
pub mod altitude_limit;
pub mod authority;
pub mod compensator;
pub mod design_model;
pub mod estimator;
pub mod estimator_status;
pub mod flight_control;
pub mod ground_control;
pub mod guidance;
pub mod healthy_actuators;
pub mod isolation;
pub mod log;
pub mod main_controller;
pub mod mixer;
pub mod navigation;
pub mod navigation_source;
pub mod on_wheels;
pub mod oscillation;
pub mod relief;
pub mod signals;

#[cfg(test)]
mod testing;

pub use aircraft_model::AircraftModel;
pub use altitude_limit::AltitudeLimit;
pub use authority::Authority;
pub use design_model::DesignModel;
pub use estimator::{Estimator, EstimatorGains, EstimatorStatus};
pub use flight_control::FlightControl;
pub use gains::{
    AllocationMode, CompensatorLaw, CompensatorMode, Gains, IsolationMode, MainLaw, ObserverMode,
};
pub use ground_control::GroundDemand;
pub use guidance::GuidanceGains;
pub use log::{Health, StepLog};
pub use main_controller::{Demand, Law, LawInput, References};
pub use navigation::{NavigationState, Navigator};
pub use navigation_source::NavigationSource;
pub use signals::{Compensation, MainCommand};

/// Who looks at continuous states, one after the other, always in the same order.
pub type Visitor<'a> = dyn FnMut(&mut f64) + 'a;
