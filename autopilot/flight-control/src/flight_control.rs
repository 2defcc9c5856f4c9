//! One control step: the pipeline of the block diagram, nothing else.

use icd::{Actuators, ControlPeriod, PerEffector, Sensors};

use crate::activation::Activation;
use crate::altitude_limit::AltitudeWatch;
use crate::authority::authority;
use crate::belief::Belief;
use crate::compensator::compensate;
use crate::design_model::DesignModel;
use crate::estimator::Estimator;
use crate::gains::{Gains, ObserverMode};
use crate::health::Health;
use crate::healthy_actuators::HealthyActuators;
use crate::log::StepLog;
use crate::main_controller::{Demand, MainCommand, MainController, References};
use crate::mixer::{Mixed, Mixer, Saturation};
use crate::observer::Observer;

/// The flight control: both steps and what they remember.
#[derive(Debug, Clone)]
pub struct FlightControl {
    gains: Gains,
    model: DesignModel,
    estimator: Estimator,
    observer: Observer,
    activation: Activation,
    main_controller: MainController,
    mixer: Mixer,
    watch: AltitudeWatch,
    /// Backward signal one: where healthy effectors are, from what the mixer asked in earlier steps.
    applied: HealthyActuators,
    /// The same without the compensation, for the literal observer.
    main_only: HealthyActuators,
    /// Backward signal two: what the mixer could not give in the last step.
    saturation: Saturation,
}

/// Result of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepOutput {
    /// What the effectors are told.
    pub actuators: Actuators,
    /// Every signal of the step.
    pub log: StepLog,
}

impl FlightControl {
    /// Ready for the first sample. `belief` and `gains` are validated by the caller
    /// ([`Belief::validate`], [`Gains::validate`]).
    #[must_use]
    pub fn new(period: ControlPeriod, belief: &Belief, gains: &Gains) -> Self {
        let actuators = HealthyActuators::new(belief, period);
        let model = DesignModel::new(*belief);
        Self {
            gains: *gains,
            estimator: Estimator::default(),
            observer: Observer::new(&gains.observer, period),
            activation: Activation::new(period),
            main_controller: MainController::new(&gains.main, &model, period),
            model,
            mixer: Mixer::new(&belief.effectors),
            watch: AltitudeWatch::new(period),
            applied: actuators.clone(),
            main_only: actuators,
            saturation: Saturation::default(),
        }
    }

    /// Back to the state before the first sample.
    pub fn reset(&mut self) {
        self.estimator.reset();
        self.observer.reset();
        self.activation.reset();
        self.main_controller.reset();
        self.watch.reset();
        self.applied.reset();
        self.main_only.reset();
        self.saturation = Saturation::default();
    }

    /// Before the first sample: the healthy effectors stand at `positions`, rad, and not at the trim of the
    /// design point. [`FlightControl::reset`] comes back to them.
    pub fn start_at(&mut self, positions: &PerEffector<f64>) {
        self.applied.start_at(positions);
        self.main_only.start_at(positions);
    }

    /// Gains in use.
    #[must_use]
    pub fn gains(&self) -> &Gains {
        &self.gains
    }

    /// Takes a validated set of gains from the next step on; estimates and integrators stay.
    pub fn set_gains(&mut self, gains: &Gains) {
        self.gains = *gains;
        self.observer.set_gains(&gains.observer);
        self.main_controller.set_gains(&gains.main);
    }

    /// The design model.
    #[must_use]
    pub fn model(&self) -> &DesignModel {
        &self.model
    }

    /// One control period: sensors in, commands out. Same state and inputs, same bits.
    ///
    /// The order is: sense, model, observer, activation, compensation, main controller, mixer, and at the
    /// end the model of the healthy actuators moves on.
    pub fn step(&mut self, sensors: &Sensors, demand: &Demand) -> StepOutput {
        let gains = &self.gains;
        let belief = self.model.belief();
        let (state, implausible_input) = self.estimator.step(sensors);

        self.applied.measure_thrust(state.thrust_n);
        self.main_only.measure_thrust(state.thrust_n);
        let modelled = *match gains.selection.observer {
            ObserverMode::Informed => self.applied.positions(),
            ObserverMode::Literal => self.main_only.positions(),
        };
        let at = self.model.condition(&state);
        let modelled_acceleration = self.model.acceleration(&state, &at, &modelled);

        self.observer.step(&state.rates, &modelled_acceleration);
        let z2 = self.observer.z2();
        let wake = self.activation.step(&z2, &gains.activation, gains.selection.compensator);
        let compensation = compensate(&z2, wake.fade, &self.model, &at);

        let law = gains.selection.main;
        let saturation = &self.saturation;
        let main =
            self.main_controller.step(&state, &at, demand, saturation, &gains.main, law, belief);
        let mixed = self.mixer.mix(&main, &compensation);
        let altitude_limit = self.watch.step(&state, demand, &mixed.saturation, belief);
        let authority = authority(&mixed.commands, state.thrust_n, belief);
        let healthy_positions = *self.applied.positions();
        self.finish(&main, &mixed);

        let references = self.main_controller.references();
        let References { altitude_m, roll_rad } =
            references.unwrap_or(References { altitude_m: state.altitude_m, roll_rad: 0.0 });
        let log = StepLog {
            state,
            altitude_reference_m: altitude_m,
            roll_reference_rad: roll_rad,
            airspeed_reference_m_s: demand.airspeed_m_s,
            z: self.observer.z(),
            z2,
            levels: wake.levels,
            level: wake.level,
            compensator_active: wake.active,
            fade: wake.fade,
            main,
            compensation,
            applied_compensation: mixed.applied,
            commands: mixed.commands,
            limited: mixed.limited,
            modelled: healthy_positions,
            authority,
            altitude_limit,
            modelled_acceleration,
            health: health(implausible_input, &mixed.saturation),
        };
        StepOutput { actuators: Actuators { commands: mixed.commands }, log }
    }

    /// Sends the two backward signals on their way to the next step.
    fn finish(&mut self, main: &MainCommand, mixed: &Mixed) {
        self.saturation = mixed.saturation;
        self.applied.advance(&mixed.commands);
        match self.gains.selection.observer {
            ObserverMode::Literal => {
                self.main_only.advance(&self.mixer.mix_main_only(main));
            }
            // Follows along, so that a switch to the literal observer in flight starts from the truth.
            ObserverMode::Informed => self.main_only.clone_from(&self.applied),
        }
    }
}

fn health(implausible_input: bool, saturation: &Saturation) -> Health {
    Health {
        implausible_input,
        aileron_saturated: saturation.aileron.is_saturated(),
        elevator_saturated: saturation.elevator.is_saturated(),
        rudder_saturated: saturation.rudder.is_saturated(),
        nozzle_pitch_saturated: saturation.nozzle_pitch.is_saturated(),
        nozzle_yaw_saturated: saturation.nozzle_yaw.is_saturated(),
        thrust_saturated: saturation.thrust.is_saturated(),
    }
}

#[cfg(test)]
mod tests;
