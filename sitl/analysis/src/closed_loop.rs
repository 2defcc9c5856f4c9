//! The closed loop in one process: plant and autopilot take turns, without sockets, threads or clocks.
//!
//! A run is a function of its [`FlightSetup`] and of what operators put in; commands, campaigns, tests and the paper's
//! figures share it.
//!
//! ```text
//! FlightSetup ─> flight::run ─ every tick ─> Operator ─ inputs ─> flight::run
//!                                │
//!                                └─> fly (records), fly_with_commands (by time), replay (a log), fly command (outcome)
//! ```

use core::convert::Infallible;
use core::ops::ControlFlow;
use std::sync::Arc;

use autopilot::autopilot::Settings;
use autopilot::parameters::Parameters;
use autopilot::script::Script;
use autopilot::vehicle::schedule::ReferenceSchedule;
use flight_control::{AircraftModel, DesignModel, NavigationState, StepLog};
use icd::{EulerAngles, PerEffector, SimTime};
use nalgebra::Vector3;
use plant_sim::{Plant, PlantSetup, SetupError, Truth};
use serde::{Deserialize, Serialize};

use crate::fault_known::FaultKnown;

mod flight;

pub use flight::{
    Exchange, Flown, Observation, Operator, Tick, TimedCommand, fly_while, fly_with_commands, run,
};

/// Everything that defines a flight of both sides.
#[derive(Debug, Clone)]
pub struct FlightSetup {
    /// The aircraft and the world.
    pub plant: PlantSetup,
    /// The controller's model of the aircraft.
    pub model: AircraftModel,
    /// Validated parameters of the autopilot.
    pub parameters: Parameters,
    /// References by time.
    pub references: ReferenceSchedule,
    /// What begins with the flight.
    pub script: Option<Arc<Script>>,
    /// The flight ends at this time, or on the ground.
    pub duration: SimTime,
}

/// One control tick: what was true, and what the controller made of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The plant's truth at the tick.
    pub truth: Truth,
    /// The signals of the control step at the tick.
    pub log: StepLog,
}

/// How a flight ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct End {
    /// Time of the last tick.
    pub time: SimTime,
    /// The aircraft touched the ground.
    pub on_ground: bool,
}

/// Flies a setup from its start to its end and hands every tick to `sink`.
///
/// # Errors
/// [`SetupError`] if the plant cannot start, or the model is of another aircraft.
pub fn fly(setup: &FlightSetup, sink: &mut dyn FnMut(&Record)) -> Result<End, SetupError> {
    fly_knowing(setup, None, sink)
}

/// The same, with the reference that knows the fault if there is one.
///
/// # Errors
/// As [`fly`].
pub fn fly_knowing(
    setup: &FlightSetup,
    fault_known: Option<FaultKnown>,
    sink: &mut dyn FnMut(&Record),
) -> Result<End, SetupError> {
    let mut watcher = Watcher { sink, fault_known };
    Ok(run(&setup.plant, &settings(setup), setup.duration, &mut watcher)?.end)
}

/// Looks at every tick and puts nothing in.
struct Watcher<'a> {
    sink: &'a mut dyn FnMut(&Record),
    fault_known: Option<FaultKnown>,
}

impl Operator for Watcher<'_> {
    type Stop = Infallible;

    fn tick(&mut self, tick: &Tick<'_>) -> ControlFlow<Infallible> {
        (self.sink)(&tick.record());
        ControlFlow::Continue(())
    }

    fn reallocates(&mut self, plant: &Plant, log: &StepLog) -> Option<StepLog> {
        self.fault_known.as_mut()?.step(plant.fault_effects(), &plant.truth().positions, log)
    }
}

/// The control side of a setup.
#[must_use]
pub fn settings(setup: &FlightSetup) -> Settings {
    let Parameters { gains, limits, navigation, failure, .. } = setup.parameters;
    Settings {
        model: setup.model,
        gains,
        limits,
        navigation,
        references: setup.references.clone(),
        script: setup.script.clone(),
        fault_injection: failure.enabled,
    }
}

/// The reference that knows the fault, for a flight of this setup.
#[must_use]
pub fn fault_known(setup: &FlightSetup) -> FaultKnown {
    FaultKnown::new(&setup.model, &setup.parameters.gains, setup.plant.period)
}

/// F: the truth that z2 estimates, rad/s².
///
/// True angular acceleration minus what the design model gives at the true state for healthy effectors
/// at their modelled positions.
///
/// Implements Eq. (17): faults and disturbances as one acceleration, F = g u_f + Δ.
/// Implements Eq. (18), solved for F, with the compensation inside the modelled positions.
#[must_use]
pub fn fault_acceleration(model: &DesignModel, record: &Record) -> Vector3<f64> {
    let Record { truth, log } = record;
    let expected = expected_acceleration(model, truth, &truth.euler(), &log.modelled);
    truth.angular_acceleration.0 - expected
}

/// What the design model expects at the true state, with `attitude` as angles, for healthy effectors at their modelled
/// positions, rad/s².
#[must_use]
pub fn expected_acceleration(
    model: &DesignModel,
    truth: &Truth,
    attitude: &EulerAngles,
    modelled: &PerEffector<f64>,
) -> Vector3<f64> {
    let state = NavigationState {
        rates: truth.body_rates.0,
        attitude: *attitude,
        alpha: truth.alpha_rad,
        beta: truth.beta_rad,
        airspeed_m_s: truth.airspeed_m_s,
        altitude_m: truth.altitude_m,
        thrust_n: model.engine().map_or(0.0, |engine| truth.deflections[engine]),
        ..NavigationState::at_rest()
    };
    expected_at(model, &state, modelled)
}

/// What of a true angular acceleration the design model does not explain, rad/s²: see Eq. (18).
#[must_use]
pub fn beyond_model(
    model: &DesignModel,
    state: &NavigationState,
    angular_acceleration: &Vector3<f64>,
    modelled: &PerEffector<f64>,
) -> Vector3<f64> {
    angular_acceleration - expected_at(model, state, modelled)
}

fn expected_at(
    model: &DesignModel,
    state: &NavigationState,
    modelled: &PerEffector<f64>,
) -> Vector3<f64> {
    let adapted = model.at(state);
    let model = adapted.as_ref().unwrap_or(model);
    model.acceleration(state, &model.condition(state), modelled)
}
