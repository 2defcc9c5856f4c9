//! One control step: the pipeline of the block diagram, nothing else.

use icd::{ControlPeriod, PerEffector};
use nalgebra::Vector3;

use crate::Visitor;
use crate::activation::Activation;
use crate::aircraft_model::AircraftModel;
use crate::allocator::Allocator;
use crate::altitude_limit::AltitudeWatch;
use crate::authority::{Authority, AuthorityWatch};
use crate::compensator::{Compensator, compensate};
use crate::design_model::{DesignModel, FlightCondition};
use crate::gains::{AllocationMode, Gains, IsolationMode, ObserverMode};
use crate::ground_control::{GroundControl, GroundDemand, align};
use crate::healthy_actuators::HealthyActuators;
use crate::isolation::{Isolation, IsolationInput, IsolationLog};
use crate::log::{Health, StepLog};
use crate::main_controller::{Demand, Law, LawInput, MainController};
use crate::mixer::{Mixed, Mixer};
use crate::navigation::NavigationState;
use crate::relief::{CompensationHealth, Relief, ReliefInput, ReliefLog, Relieved};
use crate::signals::{Compensation, MainCommand, Saturation};

/// No engine gives more at rest than this times its thrust at the design point.
const STATIC_THRUST: f64 = 4.0;

/// The flight control: both steps and what they remember.
#[derive(Debug, Clone)]
pub struct FlightControl {
    gains: Gains,
    model: DesignModel,
    compensator: Compensator,
    activation: Activation,
    main_controller: MainController,
    allocator: Allocator,
    relief: Relief,
    isolation: Isolation,
    reads_verdict: bool,
    mixer: Mixer,
    watch: AltitudeWatch,
    authority: AuthorityWatch,
    ground: GroundControl,
    /// The command of the last step, if that was on the ground.
    on_ground: Option<MainCommand>,
    /// Backward signal one: where healthy effectors are, from the commands of earlier steps.
    applied: HealthyActuators,
    /// The same without the compensation, for the literal observer.
    main_only: HealthyActuators,
    /// Backward signal two: what the mixer could not give in the last step.
    saturation: Saturation,
}

impl FlightControl {
    /// Ready for the first sample. `aircraft` and `gains` are validated by the caller
    /// ([`AircraftModel::validate`], [`Gains::validate`]).
    pub fn new(period: ControlPeriod, aircraft: &AircraftModel, gains: &Gains) -> Self {
        let actuators = HealthyActuators::new(aircraft, period);
        let model = DesignModel::new(*aircraft);
        Self {
            gains: *gains,
            compensator: Compensator::new(gains, period),
            activation: Activation::new(period),
            main_controller: MainController::new(gains, &model, period),
            model,
            allocator: Allocator::default(),
            relief: Relief::new(period),
            isolation: Isolation::new(period),
            reads_verdict: true,
            mixer: Mixer::new(&aircraft.effectors),
            watch: AltitudeWatch::new(period),
            authority: AuthorityWatch::new(period),
            ground: GroundControl::default(),
            on_ground: None,
            applied: actuators.clone(),
            main_only: actuators,
            saturation: Saturation::default(),
        }
    }

    /// Back to the state before the first sample.
    pub fn reset(&mut self) {
        self.reset_laws();
        self.authority.reset();
        self.applied.reset();
        self.main_only.reset();
        self.on_ground = None;
    }

    /// As before the first sample, but for what is known of the effectors.
    fn reset_laws(&mut self) {
        self.compensator.reset();
        self.activation.reset();
        self.main_controller.reset(&self.model);
        self.allocator.reset();
        self.relief.reset();
        self.isolation.reset();
        self.watch.reset();
        self.ground = GroundControl::default();
        self.saturation = Saturation::default();
    }

    /// Leaves out the isolation where its verdict is only reported: no one reads the report, and no command depends on it.
    pub fn skip_unread_verdict(&mut self) {
        self.reads_verdict = false;
    }

    /// Before the first sample: the healthy effectors stand at `positions`, rad, and not at the trim of the
    /// design point. [`FlightControl::reset`] comes back to them.
    pub fn start_at(&mut self, positions: &PerEffector<f64>) {
        self.applied.start_at(positions);
        self.main_only.start_at(positions);
    }

    /// Gains in use.
    pub fn gains(&self) -> &Gains {
        &self.gains
    }

    /// Takes a validated set of gains from the next step on; estimates and integrators stay. Another law goes on
    /// where the last one was, without a bump.
    pub fn set_gains(&mut self, gains: &Gains) {
        self.gains = *gains;
        self.compensator.set_gains(gains);
        self.main_controller.set_gains(gains);
    }

    /// The design model.
    pub fn model(&self) -> &DesignModel {
        &self.model
    }

    /// Shows the continuous states to a linearisation, which may change them. The modelled positions without the
    /// compensation are states of their own only for the literal observer.
    pub fn states(&mut self, visit: &mut Visitor<'_>) {
        self.compensator.states(visit);
        self.main_controller.states(visit);
        self.applied.states(visit);
        if self.gains.selection.allocation == AllocationMode::Relief {
            self.relief.states(visit);
        }
        if self.gains.selection.observer == ObserverMode::Literal {
            self.main_only.states(visit);
        }
    }

    /// One control period: navigation state in, commands out. Same state and inputs, same bits.
    ///
    /// The order is: model, observer, activation, compensation, main controller, mixer, and at the
    /// end the model of the healthy actuators moves on.
    pub fn step(&mut self, state: &NavigationState, demand: &Demand) -> StepLog {
        self.step_with(state, demand, &GroundDemand::STAND, None)
    }

    /// The same, and what is to be done while the wheels carry the aircraft, and just before; where [`crate::MainLaw::Own`] is selected, `own` is the law that flies, and where [`AllocationMode::Own`] is, the
    /// compensator.
    pub fn step_with(
        &mut self,
        state: &NavigationState,
        demand: &Demand,
        ground: &GroundDemand,
        mut own: Option<&mut dyn Law>,
    ) -> StepLog {
        if self.model.adapt(state) {
            // The ends of its thrust are those of this flight condition.
            self.mixer = Mixer::new(&self.model.aircraft().effectors);
        }
        if state.on_wheels {
            return self.roll(state, demand, ground);
        }
        if let Some(last) = self.on_ground.take() {
            self.reset_laws();
            self.main_controller.take_over_from(last);
        }
        let gains = &self.gains;

        let measured = state.valid.thrust.then_some(state.thrust_n);
        // Without a measurement the last command stands in, here as well as in laws and log.
        let thrust_n = self.applied.take_thrust(measured).unwrap_or(state.thrust_n);
        self.main_only.take_thrust(measured);
        let state = &NavigationState { thrust_n, ..*state };
        let modelled = *match gains.selection.observer {
            ObserverMode::Informed => self.applied.positions(),
            // What Eqs. (21) to (23) print: the observer is not told of the compensation
            // (docs/decisions/016-observer-input.md).
            ObserverMode::Literal => self.main_only.positions(),
        };
        let at = self.model.condition(state);
        let modelled_acceleration = self.model.acceleration(state, &at, &modelled);

        let estimate = self.compensator.step(&state.rates, &modelled_acceleration);
        let z2 = estimate.z2;
        let levels = gains.activation.levels_with(&self.model.doubt(state, &at));
        let mode = gains.selection.compensator;
        let wake = self.activation.step(&z2, &levels, &gains.activation, mode);

        let levels = gains.activation.levels();
        let isolation_input = IsolationInput {
            z2: &z2,
            levels: &levels,
            level: wake.level,
            active: wake.active,
            positions: &modelled,
            bandwidth: gains.bandwidth(),
            model: &self.model,
            at: &at,
        };
        let mut isolation =
            match self.reads_verdict || gains.selection.isolation != IsolationMode::Report {
                true => self.isolation.step(&isolation_input, &gains.isolation),
                false => IsolationLog::default(),
            };

        // Of the step before, because this step's is known only behind the mixer.
        let saturation = &self.saturation;
        let controller = &mut self.main_controller;
        let main = controller.step(state, &at, demand, saturation, &self.model, again(&mut own));
        let main = match ground.heading_rad {
            Some(heading_rad) => {
                align(state, heading_rad, &self.gains.ground, &self.model, &at, main)
            }
            None => main,
        };
        let (fade, airspeed_m_s) = (wake.fade, demand.airspeed_m_s);
        let own = self.own_compensation(own, state, &main, &z2, &at);
        let Relieved { compensation, mut mixed, log: relief, health: compensation_health } =
            self.allocate(state, airspeed_m_s, &main, &z2, fade, &at, own);
        // Last, because it needs to know what the flown commands leave of the travel.
        isolation.test_rad = self.test(&mut mixed, state, &at);
        let attained = match wake.fade == 0.0 {
            true => Vector3::zeros(),
            false => self.model.effectors(&at, &mixed.increments),
        };
        let aircraft = self.model.aircraft();
        let altitude_limit = self.watch.step(state, demand, &mixed.saturation, aircraft);
        let allocation = self.gains.selection.allocation;
        let (commands, thrust_n) = (&mixed.commands, state.thrust_n);
        let authority = self.authority.step(allocation, commands, thrust_n, &self.model, &at);
        // Before `finish` moves them on: the log has the positions of this tick.
        let healthy_positions = *self.applied.positions();
        self.finish(&main, &mixed);

        let references = self.main_controller.references();
        let (altitude_m, roll_rad) = references
            .map_or((state.altitude_m, 0.0), |tracked| (tracked.altitude_m, tracked.roll_rad));
        StepLog {
            state: *state,
            altitude_reference_m: altitude_m,
            roll_reference_rad: roll_rad,
            airspeed_reference_m_s: demand.airspeed_m_s,
            z: estimate.z,
            z2,
            levels: wake.levels,
            level: wake.level,
            compensator_active: wake.active,
            fade: wake.fade,
            main,
            compensation,
            applied_compensation: mixed.applied,
            increments: mixed.increments,
            attained,
            commands: mixed.commands,
            brakes: 0.0,
            limited: mixed.limited,
            modelled: healthy_positions,
            authority,
            altitude_limit,
            modelled_acceleration,
            relief,
            isolation,
            health: health(
                !state.valid.is_complete(),
                self.main_controller.implausible(),
                &mixed.saturation,
                compensation_health,
            ),
        }
    }

    /// One control period on the ground: no compensation, no verdict, nothing is integrated. What the laws remember is of no use
    /// at the next lift-off, so they begin anew there.
    fn roll(&mut self, state: &NavigationState, demand: &Demand, ground: &GroundDemand) -> StepLog {
        let measured = state.valid.thrust.then_some(state.thrust_n);
        let thrust_n = self.applied.take_thrust(measured).unwrap_or(state.thrust_n);
        self.main_only.take_thrust(measured);
        let state = NavigationState { thrust_n, ..*state };
        let (at, h) = (self.model.condition(&state), self.main_controller.h());
        if self.on_ground.is_none() {
            self.ground = GroundControl::default();
        }
        let main = self.ground.step(&state, ground, &self.gains.ground, &self.model, &at, h);
        let mut mixed = self.mixer.mix(&main, &Compensation::NONE);
        if let Some(engine) = self.model.engine() {
            // The ends of the engine are those of the design point: at rest a propeller gives more, and on the ground an engine can
            // idle slower. The engine takes what it can.
            let command = &mut mixed.commands[engine];
            *command = if ground.full_thrust { STATIC_THRUST * *command } else { command.min(0.0) };
        }
        let modelled = *self.applied.positions();
        self.finish(&main, &mixed);
        self.on_ground = Some(main);
        StepLog {
            state,
            altitude_reference_m: state.altitude_m,
            roll_reference_rad: 0.0,
            airspeed_reference_m_s: demand.airspeed_m_s,
            z: state.rates,
            z2: Vector3::zeros(),
            levels: Vector3::zeros(),
            level: 0.0,
            compensator_active: false,
            fade: 0.0,
            main,
            compensation: Compensation::NONE,
            applied_compensation: Compensation::NONE,
            increments: PerEffector::default(),
            attained: Vector3::zeros(),
            commands: mixed.commands,
            brakes: ground.brakes.clamp(0.0, 1.0),
            limited: mixed.limited,
            modelled,
            authority: Authority::FULL,
            altitude_limit: None,
            modelled_acceleration: Vector3::zeros(),
            relief: ReliefLog::default(),
            isolation: IsolationLog::default(),
            health: Health { implausible_input: !state.valid.is_complete(), ..Health::default() },
        }
    }

    /// What the law that the program brings compensates, where that is selected.
    fn own_compensation(
        &self,
        own: Option<&mut dyn Law>,
        state: &NavigationState,
        main: &MainCommand,
        z2: &Vector3<f64>,
        at: &FlightCondition,
    ) -> Option<Compensation> {
        let is_selected = self.gains.selection.allocation == AllocationMode::Own;
        let law = own.filter(|_| is_selected)?;
        let references = self.main_controller.references()?;
        let (saturated, model, h) = (&self.saturation, &self.model, self.main_controller.h());
        let input = LawInput { state, references: &references, saturated, model, at, h };
        Some(law.compensate(&input, main, z2))
    }

    /// Step two b: the demanded compensation, and the commands of both steps together.
    #[expect(clippy::too_many_arguments, reason = "the signals of one step")]
    fn allocate(
        &mut self,
        state: &NavigationState,
        airspeed_reference_m_s: f64,
        main: &MainCommand,
        z2: &Vector3<f64>,
        fade: f64,
        at: &FlightCondition,
        own: Option<Compensation>,
    ) -> Relieved {
        let (compensation, mixed) = match self.gains.selection.allocation {
            AllocationMode::Paper | AllocationMode::Own => {
                let compensation = match own {
                    Some(own) => own.faded(fade),
                    None => compensate(z2, fade, &self.model, at),
                };
                (compensation, self.mixer.mix(main, &compensation))
            }
            AllocationMode::Wls => {
                let main = self.mixer.mix(main, &Compensation::NONE);
                let increments = self.allocator.step(z2, fade, &self.model, at, &main.commands);
                let mixed = self.mixer.add(main, &increments);
                (mixed.applied, mixed)
            }
            AllocationMode::Relief => {
                let (model, mixer) = (&self.model, &self.mixer);
                let Gains { activation, relief, .. } = &self.gains;
                self.relief.observe(z2, fade, model, activation, relief);
                let known = self.isolation.known(self.gains.selection.isolation);
                let input = ReliefInput {
                    state,
                    at,
                    airspeed_reference_m_s,
                    fade,
                    main,
                    model,
                    mixer,
                    known: &known,
                };
                return self.relief.step(&input, &self.gains.relief);
            }
        };
        let (log, health) = (ReliefLog::default(), CompensationHealth::default());
        Relieved { compensation, mixed, log, health }
    }

    /// Adds the test deflection of the isolation to the commands; returns that of the first effector under test, rad.
    fn test(&mut self, mixed: &mut Mixed, state: &NavigationState, at: &FlightCondition) -> f64 {
        if self.gains.selection.isolation == IsolationMode::Report {
            return 0.0;
        }
        let (isolation, rates) = (&mut self.isolation, &state.rates);
        let size_rad = self.gains.isolation.test_rad;
        let added = isolation.test(&mixed.commands, rates, &self.model, at, size_rad);
        for (effector, added) in added.iter() {
            mixed.commands[effector] += added;
        }
        isolation.test_rad()
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
            ObserverMode::Informed => self.main_only.copy_positions(&self.applied),
        }
    }
}

/// The same law once more, for the next block.
fn again<'a>(own: &'a mut Option<&mut dyn Law>) -> Option<&'a mut dyn Law> {
    match own {
        Some(law) => Some(&mut **law),
        None => None,
    }
}

fn health(
    implausible_input: bool,
    implausible_command: bool,
    saturation: &Saturation,
    compensation: CompensationHealth,
) -> Health {
    Health {
        implausible_input,
        implausible_command,
        aileron_saturated: saturation.aileron.is_saturated(),
        elevator_saturated: saturation.elevator.is_saturated(),
        rudder_saturated: saturation.rudder.is_saturated(),
        nozzle_pitch_saturated: saturation.nozzle_pitch.is_saturated(),
        nozzle_yaw_saturated: saturation.nozzle_yaw.is_saturated(),
        thrust_saturated: saturation.thrust.is_saturated(),
        compensation,
    }
}

#[cfg(test)]
mod tests;
