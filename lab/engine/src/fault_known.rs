//! A reference for comparisons: a law that knows the fault.
//!
//! The controller is blind; this reference is not. It stands between the autopilot and the plant of a flight in one process, so
//! there is no way to it from the program `autopilot`: no parameter, no file, no message. The autopilot flies its main
//! controller alone; from the onset of a fault on, the reference replaces the commands to the effectors.
//!
//! It knows, at once and exactly, which effectors are faulty, how, and where they stand ([`Effects`]), and the controller's model
//! for everything else. The travel of each effector becomes that of its *effective* deflection d: a point for one that does not
//! follow its command, a part of the travel for one that lost effect, a shifted one for a bias. Within these bounds the
//! allocation of the law beyond the paper ([`Relief`]) seeks
//!
//! ```text
//! B d = B u_main        u_main: what the main controller demands of healthy effectors, before limits
//! ```
//!
//! with the whole compensation from the first step on, and with a healthy rudder among what is allocated. It does not know the wind,
//! the error of the model, or the future.

use flight_control::allocation::{self, ActiveSet, Settings};
use flight_control::allocator::Columns;
use flight_control::design_model::FlightCondition;
use flight_control::isolation::Known;
use flight_control::mixer::{Mixed, Mixer};
use flight_control::relief::{Relief, ReliefInput};
use flight_control::{AircraftModel, Compensation, DesignModel, Gains, MainCommand, StepLog};
use icd::{ControlPeriod, Effector, EffectorKind, PerEffector};
use nalgebra::Vector3;
use plant_sim::faults::{Effects, FaultEffect};

/// An effector with less than this part of its effect is left out.
const EFFECT_MIN: f64 = 0.01;

/// The reference with what it remembers.
#[derive(Debug, Clone)]
pub struct FaultKnown {
    model: DesignModel,
    mixer: Mixer,
    gains: Gains,
    relief: Relief,
    active: ActiveSet,
}

/// The aircraft as it is with its faults.
struct Failed {
    model: DesignModel,
    mixer: Mixer,
    /// Effectors whose effective deflection is not their command.
    effects: PerEffector<Option<FaultEffect>>,
}

impl FaultKnown {
    /// For a flight with this model and these gains, both validated.
    pub fn new(aircraft: &AircraftModel, gains: &Gains, period: ControlPeriod) -> Self {
        Self {
            model: DesignModel::new(*aircraft),
            mixer: Mixer::new(&aircraft.effectors),
            gains: *gains,
            relief: Relief::new(period),
            active: ActiveSet::default(),
        }
    }

    /// The control step with the commands of the reference; `None` while no effector has a fault, or only one that moves late or
    /// slowly. `log` is the step of the autopilot, `positions` are those of the effectors, rad and N.
    pub fn step(
        &mut self,
        effects: &Effects,
        positions: &PerEffector<f64>,
        log: &StepLog,
    ) -> Option<StepLog> {
        if self.model.adapt(&log.state) {
            self.mixer = Mixer::new(&self.model.aircraft().effectors);
        }
        let Some(failed) = self.failed(effects, positions) else {
            // After a repair the next fault begins anew.
            self.relief.reset();
            self.active = ActiveSet::default();
            return None;
        };
        let at = self.model.condition(&log.state);
        let (main, z2) = self.with_rudder(&failed, &log.main, &at);
        let Gains { activation, relief, .. } = &self.gains;
        // It knows the fault from the first step on, so nothing fades in.
        self.relief.observe(&z2, 1.0, &failed.model, activation, relief);
        let input = ReliefInput {
            state: &log.state,
            at: &at,
            airspeed_reference_m_s: log.airspeed_reference_m_s,
            fade: 1.0,
            main: &main,
            model: &failed.model,
            mixer: &failed.mixer,
            known: &Known::default(),
        };
        let relieved = self.relief.step(&input, relief);
        let Mixed { applied, increments, limited, .. } = relieved.mixed;
        let mut commands = relieved.mixed.commands;
        for (effector, effect) in failed.effects.iter() {
            if let Some(effect) = effect {
                // The allocation gives effective deflections: d = remaining · (command + offset).
                commands[effector] = match is_free(effect) {
                    true => commands[effector] / effect.remaining - effect.offset,
                    // What does not follow has no use for a command of the reference.
                    false => log.commands[effector],
                };
            }
        }
        Some(StepLog {
            compensation: relieved.compensation,
            applied_compensation: applied,
            attained: failed.model.effectors(&at, &increments),
            increments,
            commands,
            limited,
            relief: relieved.log,
            ..*log
        })
    }

    /// The aircraft with its faults; `None` without one.
    fn failed(&self, effects: &Effects, positions: &PerEffector<f64>) -> Option<Failed> {
        let mut aircraft = *self.model.aircraft();
        let list = aircraft.effectors.list;
        let mut changed = PerEffector::from_fn(|_| None);
        for effector in list.all().filter(|effector| list.is_angle(*effector)) {
            let effect = effects.of(effector);
            let servo = &mut aircraft.effectors.servos[effector];
            let limited = |angle: f64| angle.max(effect.low).min(effect.high);
            let ends = match effect.following > 0.0 {
                true => [servo.min, servo.max].map(|end| limited(end + effect.offset)),
                false => [positions[effector]; 2],
            };
            let [min, max] = ends.map(|end| effect.remaining * end);
            if (min, max) != (servo.min, servo.max) {
                (servo.min, servo.max) = (min, max);
                changed[effector] = Some(effect);
            }
        }
        changed.iter().any(|(_, effect)| effect.is_some()).then(|| Failed {
            model: DesignModel::new(aircraft),
            mixer: Mixer::new(&aircraft.effectors),
            effects: changed,
        })
    }

    /// The main command with the rudder where a bounded least squares allocation of all effectors has it, and, as an estimate, the
    /// acceleration that this adds and the others must not follow, rad/s². The law beyond the paper leaves the rudder to the main
    /// controller, because it cannot know whether the rudder is the jammed one.
    fn with_rudder(
        &mut self,
        failed: &Failed,
        main: &MainCommand,
        at: &FlightCondition,
    ) -> (MainCommand, Vector3<f64>) {
        let effectors = &self.model.aircraft().effectors;
        let is_rudder = |effector: Effector| {
            effectors.list.kind(effector) == Some(EffectorKind::Rudder)
                && effectors.gains[effector].yaw != 0.0
                && failed.effects[effector].is_none()
        };
        let mut rudders = effectors.list.all().filter(|effector| is_rudder(*effector));
        // The main command has one rudder, so it can be moved only where there is one.
        let (Some(rudder), None) = (rudders.next(), rudders.next()) else {
            return (*main, Vector3::zeros());
        };
        let demanded = self.mixer.demanded(main, &Compensation::NONE);
        let demand = self.model.effectors(at, &demanded);
        let columns = Columns::whole(&failed.model, at, |effector, column| {
            column.preferred = demanded[effector];
        });
        let allocated =
            allocation::allocate(columns.as_slice(), &demand, &Settings::DEFAULT, &self.active);
        self.active = allocated.active;
        let place = columns.iter().position(|(effector, _)| effector == rudder);
        let rudder_rad = place.map_or(main.rudder_rad, |place| {
            allocated.positions[place] / effectors.gains[rudder].yaw
        });
        let changed = MainCommand { rudder_rad, ..*main };
        let added = self.mixer.demanded(&changed, &Compensation::NONE);
        (changed, self.model.effectors(at, &added) - demand)
    }
}

/// Whether an effector with this fault is still commanded.
fn is_free(effect: &FaultEffect) -> bool {
    effect.following > 0.0 && effect.remaining > EFFECT_MIN
}
