//! The closed loop in one process: plant and autopilot take turns, without sockets, threads or clocks.
//!
//! A run is a function of its [`FlightSetup`]; campaigns, tests and the paper's figures share it.

use std::sync::Arc;

use autopilot::autopilot::{Autopilot, Settings};
use autopilot::parameters::Parameters;
use autopilot::script::Script;
use autopilot::vehicle::schedule::ReferenceSchedule;
use flight_control::{Belief, DesignModel, Gains, State, StepLog};
use icd::fault::{PlantAction, PlantReport, PlantRequest};
use icd::{PerEffector, SimTime};
use nalgebra::Vector3;
use plant_sim::{Plant, PlantSetup, SetupError, Truth};
use serde::{Deserialize, Serialize};

/// Everything that defines a flight of both sides.
#[derive(Debug, Clone)]
pub struct FlightSetup {
    /// The aircraft and the world.
    pub plant: PlantSetup,
    /// What the controller believes about the aircraft.
    pub belief: Belief,
    /// Validated gains.
    pub gains: Gains,
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
/// [`SetupError`] if the plant cannot start.
pub fn fly(setup: &FlightSetup, sink: &mut dyn FnMut(&Record)) -> Result<End, SetupError> {
    let mut plant = Plant::new(&setup.plant)?;
    let mut autopilot = Autopilot::new(&settings(setup));
    autopilot.begin_flight(setup.plant.period, plant.time(), false);
    let mut reply = None;
    loop {
        let time = plant.time();
        let sensors = plant.sense();
        report(&mut plant, reply.take(), &mut autopilot);
        let output = autopilot.step(time, &sensors);
        sink(&Record { truth: plant.truth(), log: output.log });
        while autopilot.pop_event().is_some() {}
        if time + setup.plant.period > setup.duration {
            return Ok(End { time, on_ground: false });
        }
        reply = ask(&mut autopilot, &mut plant);
        plant.advance(&output.actuators);
        if plant.on_ground() {
            return Ok(End { time: plant.time(), on_ground: true });
        }
    }
}

/// What the plant tells beside the sensors of a packet.
pub(crate) fn report(plant: &mut Plant, reply: Option<PlantReport>, autopilot: &mut Autopilot) {
    for report in reply.into_iter().chain(std::iter::from_fn(|| plant.pop_report())) {
        autopilot.handle_report(&report);
    }
}

/// What the autopilot asks of the plant leaves with its answer to a packet, and the reply comes with the next one.
pub(crate) fn ask(autopilot: &mut Autopilot, plant: &mut Plant) -> Option<PlantReport> {
    match autopilot.next_request()? {
        PlantRequest { number: request, action: PlantAction::Fault(fault) } => {
            let reply = plant.request(&fault);
            Some(PlantReport::FaultReply { request, reply })
        }
        // Time passes as fast as it can here, and the flight begins once.
        _ => None,
    }
}

/// The control side of a setup.
#[must_use]
pub fn settings(setup: &FlightSetup) -> Settings {
    Settings {
        belief: setup.belief,
        gains: setup.gains,
        limits: Parameters::default().limits,
        navigation: Parameters::default().navigation,
        references: setup.references.clone(),
        script: setup.script.clone(),
        fault_injection: true,
    }
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
    let state = State {
        rates: truth.body_rates.0,
        attitude: truth.euler(),
        alpha: truth.alpha_rad,
        beta: truth.beta_rad,
        airspeed_m_s: truth.airspeed_m_s,
        altitude_m: truth.altitude_m,
        climb_rate_m_s: -truth.velocity.0.z,
        thrust_n: truth.deflections[icd::Effector::Engine],
    };
    beyond_model(model, &state, &truth.angular_acceleration.0, &log.modelled)
}

/// What of a true angular acceleration the design model does not explain, rad/s²: see Eq. (18).
#[must_use]
pub fn beyond_model(
    model: &DesignModel,
    state: &State,
    angular_acceleration: &Vector3<f64>,
    modelled: &PerEffector<f64>,
) -> Vector3<f64> {
    angular_acceleration - model.acceleration(state, &model.condition(state), modelled)
}
