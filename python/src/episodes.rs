//! Episodes for reinforcement learning: flights side by side, each a function of its seed.
//!
//! ```text
//! action, held for a step ─> compensation beside the main controller, or commands of all effectors ─> flight
//! observation <─ what a compensator is given (LawState), scaled
//! ```

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use autopilot::command::{Command, Intent, VehicleCommand};
use autopilot::own_law::{OwnLaw, OwnRole};
use autopilot::recorder::Recorded;
use autopilot::vehicle::Reference;
use flight_control::{AllocationMode, Compensation, CompensatorMode, Law, LawInput, MainCommand};
use icd::fault::{FaultKind, Target, Timing, Travel};
use icd::{Effector, EffectorKind, SimTime};
use lab_campaign::draw;
use lab_engine::{Flight, FlightSetup};
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyReadonlyArray2, PyUntypedArrayMethods as _};
use plant_sim::ScheduledFault;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use rayon::prelude::*;

use crate::law::LawState;
use crate::options::refused;
use crate::pool::pool;
use crate::simulation::Wanted;

/// Longest episode, s.
const EPISODE_MAX_S: f64 = 30.0;
/// Most flights side by side.
const FLIGHTS_MAX: usize = 4_096;
/// A jam begins within these times, s.
const ONSET_S: [f64; 2] = [1.0, 3.0];
/// Time from one change of references to the next, s.
const REFERENCES_EVERY_S: f64 = 8.0;
/// Largest roll angle, rad, and change of altitude, m, that are asked for.
const ROLL_MAX_RAD: f64 = 0.5;
const CLIMB_MAX_M: f64 = 100.0;
/// What the loss of the aircraft costs: ten seconds of perfect flight.
const LOSS: f64 = 10.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Task {
    /// Level flight; a surface jams.
    Jam,
    /// References change; in half of the episodes a surface jams too.
    Track,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ActionKind {
    /// Commands of all effectors, in the place of the autopilot.
    All,
    /// Aileron and nozzle beside the main controller; without a nozzle increments of all surfaces.
    Redundant,
}

/// What the episodes have in common.
struct Common {
    setup: FlightSetup,
    task: Task,
    acts: ActionKind,
    /// Control periods of a step, and steps of an episode.
    periods: u32,
    steps_max: u32,
    /// Which of them jams in an episode.
    jammed: Vec<Effector>,
    /// The effectors that an action moves one by one; none where it is a compensation.
    moved: Vec<Effector>,
    actions: usize,
}

/// What the flight and its environment share: the action that is held, and what the compensator saw last.
#[derive(Debug, Default)]
struct HeldAction {
    compensation: Compensation,
    seen: LawState,
}

/// The compensator that gives the held action.
#[derive(Debug, Clone)]
struct HeldLaw(Arc<Mutex<HeldAction>>);

impl HeldLaw {
    fn held(&self) -> MutexGuard<'_, HeldAction> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Law for HeldLaw {
    fn step(&mut self, _input: &LawInput<'_>) -> MainCommand {
        MainCommand::default()
    }

    fn compensate(
        &mut self,
        input: &LawInput<'_>,
        main: &MainCommand,
        z2: &Vector3<f64>,
    ) -> Compensation {
        let mut held = self.held();
        held.seen = LawState::of(input, main, z2);
        held.compensation
    }
}

/// One of the flights side by side.
struct Lane {
    held: HeldLaw,
    flight: Option<Flight>,
    seed: u64,
    episode: u64,
    steps: u32,
    references: ChaCha8Rng,
    start_m: f64,
    intents: u32,
    is_over: bool,
    fault: String,
}

/// What a step gave.
#[derive(Debug, Clone, Copy, Default)]
struct Gave {
    reward: f64,
    terminated: bool,
    truncated: bool,
}

impl Lane {
    fn new() -> Self {
        Self {
            held: HeldLaw(Arc::default()),
            flight: None,
            seed: 0,
            episode: 0,
            steps: 0,
            references: draw::stream(0, "references", 0),
            start_m: 0.0,
            intents: 0,
            is_over: false,
            fault: String::new(),
        }
    }

    /// Begins the next episode of its seed, at its first tick.
    fn begin(&mut self, common: &Common) -> Result<(), String> {
        let mut setup = common.setup.clone();
        let mut draws = draw::stream(self.seed, "episode", self.episode);
        self.references = draw::stream(self.seed, "references", self.episode);
        self.episode += 1;
        // A file and a table in JSON have whole numbers to 53 bits.
        setup.plant.seed = draws.next_u64() >> 11;
        let fault = common.draw_fault(&mut draws);
        self.fault = fault
            .map_or_else(String::new, |fault| fault.described(&setup.plant.airframe.effectors));
        setup.plant.faults.extend(fault);
        let law = self.held.clone();
        setup.own_law =
            Some(OwnLaw::new("action", move || law.clone()).in_role(OwnRole::Compensator));
        *self.held.held() = HeldAction::default();
        let mut flight = Flight::new(&setup).map_err(|error| error.to_string())?;
        let _ = flight.step([]);
        flight.skip_unread_verdict();
        self.start_m = flight.plant().truth().altitude_m;
        (self.flight, self.steps, self.is_over) = (Some(flight), 0, false);
        Ok(())
    }

    /// Holds an action for a step.
    fn step(&mut self, common: &Common, action: &[f64]) -> Gave {
        let mut gave = Gave::default();
        let references = self.due_references(common);
        let Some(flight) = &mut self.flight else { return gave };
        if common.moved.is_empty() {
            self.held.held().compensation = common.compensation(action);
        }
        let mut inputs = references;
        for _ in 0..common.periods {
            if !common.moved.is_empty()
                && let Some(commands) = flight.commands()
            {
                flight.replace_commands(common.commands(commands, action));
            }
            let is_over = flight.step(inputs.drain(..)).is_none();
            let at = flight.plant().truth().into();
            if is_over || common.setup.plant.limits().are_exceeded(&at) {
                gave.terminated = true;
                break;
            }
        }
        self.steps += 1;
        gave.truncated = !gave.terminated && self.steps >= common.steps_max;
        gave.reward = if gave.terminated {
            -LOSS
        } else {
            self.held.held().seen.reward_rate() * common.step_s()
        };
        self.is_over = gave.terminated || gave.truncated;
        gave
    }

    /// Changes of references that are due.
    fn due_references(&mut self, common: &Common) -> Vec<Recorded> {
        let every = (REFERENCES_EVERY_S / common.step_s()).round() as u32;
        if common.task == Task::Jam || !self.steps.is_multiple_of(every.max(1)) {
            return Vec::new();
        }
        let roll = ROLL_MAX_RAD * signed(&mut self.references);
        let altitude_m = self.start_m + CLIMB_MAX_M * signed(&mut self.references);
        let all = [Reference::Roll(roll), Reference::Altitude(altitude_m)];
        let intent = |reference| {
            self.intents += 1;
            let command = Command::Vehicle(VehicleCommand::Refer(reference));
            Recorded::Intent(Intent { number: self.intents, command })
        };
        all.map(intent).into()
    }
}

/// From 0 to 1.
fn part(draws: &mut ChaCha8Rng) -> f64 {
    // The 53 bits that a number between 0 and 1 has.
    (draws.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// From -1 to 1.
fn signed(draws: &mut ChaCha8Rng) -> f64 {
    2.0 * part(draws) - 1.0
}

impl Common {
    fn step_s(&self) -> f64 {
        f64::from(self.periods) * self.setup.plant.period.as_seconds()
    }

    /// A surface that jams at an angle of its travel.
    fn draw_fault(&self, draws: &mut ChaCha8Rng) -> Option<ScheduledFault> {
        let airframe = &self.setup.plant.airframe;
        // All draws are made, so that an episode is the same whatever becomes of the first.
        let [happens, which, where_, when] = [(); 4].map(|()| part(draws));
        if self.task == Task::Track && happens < 0.5 {
            return None;
        }
        let effector = *self.jammed.get((which * self.jammed.len() as f64) as usize)?;
        let servo = &airframe.servos[effector];
        let angle_rad = servo.min + where_ * (servo.max - servo.min);
        let onset_s = ONSET_S[0] + when * (ONSET_S[1] - ONSET_S[0]);
        Some(ScheduledFault {
            target: Target::Effector(effector),
            kind: FaultKind::StuckAt { angle_rad, travel: Travel::AtActuatorRate },
            timing: Timing::at(SimTime::from_seconds(onset_s)?),
        })
    }

    /// An action as compensation: 1 is the whole travel.
    fn compensation(&self, action: &[f64]) -> Compensation {
        let airframe = &self.setup.plant.airframe;
        let (list, servos) = (&airframe.effectors, &airframe.servos);
        let travel = |effector: Option<Effector>| effector.map_or(0.0, |e| servos[e].max);
        let of = |place: usize, effector| {
            action.get(place).copied().unwrap_or(0.0).clamp(-1.0, 1.0) * travel(effector)
        };
        // Ailerons, or the elevons of an aircraft without them.
        let rolls = list.all().find(|effector| airframe.gains[*effector].roll != 0.0);
        Compensation {
            aileron_rad: of(0, rolls),
            nozzle_pitch_rad: of(1, list.only(EffectorKind::NozzlePitch)),
            nozzle_yaw_rad: of(2, list.only(EffectorKind::NozzleYaw)),
        }
    }

    /// Commands that an action gives, in the place of those of the autopilot or beside them.
    fn commands(&self, commands: &icd::PerEffector<f64>, action: &[f64]) -> icd::PerEffector<f64> {
        let airframe = &self.setup.plant.airframe;
        let mut all = *commands;
        for (effector, value) in self.moved.iter().zip(action) {
            let (servo, value) = (&airframe.servos[*effector], value.clamp(-1.0, 1.0));
            let is_angle = airframe.effectors.is_angle(*effector);
            let moved = match (is_angle, value < 0.0) {
                (true, true) => -value * servo.min,
                (true, false) => value * servo.max,
                // An engine: -1 is its least thrust.
                (false, _) => servo.min + 0.5 * (value + 1.0) * (servo.max - servo.min),
            };
            all[*effector] =
                if self.acts == ActionKind::Redundant { all[*effector] + moved } else { moved };
        }
        all
    }
}

/// Flights side by side, stepped together on all cores. Use it by `two_step.gym`.
#[pyclass(frozen, module = "two_step")]
pub struct Episodes {
    common: Common,
    lanes: Mutex<Vec<Lane>>,
}

impl Episodes {
    fn lock(&self) -> PyResult<MutexGuard<'_, Vec<Lane>>> {
        self.lanes
            .try_lock()
            .map_err(|_| PyRuntimeError::new_err("the episodes are in use by another thread"))
    }
}

#[pymethods]
impl Episodes {
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    #[new]
    #[pyo3(signature = (task, scenario, count, *, action, jams, step_ms, episode_s, **options))]
    fn new(
        task: &str,
        scenario: &Bound<'_, PyAny>,
        count: usize,
        action: &str,
        jams: Option<Vec<String>>,
        step_ms: f64,
        episode_s: f64,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let task = match task {
            "jam" => Task::Jam,
            "track" => Task::Track,
            _ => {
                return Err(PyValueError::new_err(format!(
                    "task = {task:?}; expected \"jam\" or \"track\""
                )));
            }
        };
        let acts = match action {
            "all" => ActionKind::All,
            "redundant" => ActionKind::Redundant,
            _ => {
                let message = format!("action = {action:?}; expected \"all\" or \"redundant\"");
                return Err(PyValueError::new_err(message));
            }
        };
        if !(1..=FLIGHTS_MAX).contains(&count) {
            return Err(PyValueError::new_err(format!(
                "num_envs = {count}; expected 1 to {FLIGHTS_MAX}"
            )));
        }
        let Wanted { mut setup, .. } = Wanted::of(scenario, [None, None], None, options, true)?;
        let period_ms = 1_000.0 * setup.plant.period.as_seconds();
        let periods = step_ms / period_ms;
        if !(1.0..=1_000.0).contains(&periods) || (periods - periods.round()).abs() > 1e-9 {
            return Err(PyValueError::new_err(format!(
                "step_ms = {step_ms}; expected 1 to 1000 control periods of {period_ms} ms"
            )));
        }
        if !(step_ms / 1_000.0..=EPISODE_MAX_S).contains(&episode_s) {
            return Err(PyValueError::new_err(format!(
                "episode_s = {episode_s}; expected one step to {EPISODE_MAX_S}"
            )));
        }
        let selection = &mut setup.parameters.gains.selection;
        (selection.allocation, selection.compensator) =
            (AllocationMode::Own, CompensatorMode::AlwaysOn);
        // The last step is flown to its end.
        setup.duration = SimTime::from_micros((1.0e6 * EPISODE_MAX_S) as u64 * 2);
        let list = &setup.plant.airframe.effectors;
        let has_nozzle = list.only(EffectorKind::NozzlePitch).is_some();
        let moved: Vec<Effector> = match (acts, has_nozzle) {
            (ActionKind::All, _) => list.all().collect(),
            (ActionKind::Redundant, true) => Vec::new(),
            (ActionKind::Redundant, false) => {
                list.all().filter(|effector| list.is_angle(*effector)).collect()
            }
        };
        let is_angle = |effector: &Effector| list.is_angle(*effector);
        let jammed: Vec<Effector> = match jams {
            None => list
                .all()
                .filter(|effector| list.kind(*effector).is_some_and(EffectorKind::is_surface))
                .collect(),
            Some(names) => {
                let known = || {
                    list.all()
                        .filter(is_angle)
                        .map(|effector| list.key(effector))
                        .collect::<Vec<_>>()
                        .join(", ")
                };
                let named = |name: &String| {
                    list.by_key(name).filter(is_angle).ok_or_else(|| {
                        PyValueError::new_err(format!(
                            "jams: {name:?}; expected some of {}",
                            known()
                        ))
                    })
                };
                names.iter().map(named).collect::<PyResult<_>>()?
            }
        };
        if jammed.is_empty() {
            return Err(PyValueError::new_err("jams: expected at least one effector"));
        }
        let actions = if moved.is_empty() { 3 } else { moved.len() };
        let steps_max = (1_000.0 * episode_s / step_ms).round() as u32;
        let common = Common {
            setup,
            task,
            acts,
            periods: periods.round() as u32,
            steps_max,
            jammed,
            moved,
            actions,
        };
        let lanes = (0..count).map(|_| Lane::new()).collect();
        Ok(Self { common, lanes: Mutex::new(lanes) })
    }

    /// Names of the parts of an action.
    #[getter]
    fn action_names(&self) -> Vec<String> {
        let list = &self.common.setup.plant.airframe.effectors;
        if self.common.moved.is_empty() {
            return ["aileron", "nozzle_pitch", "nozzle_yaw"].map(ToOwned::to_owned).into();
        }
        self.common.moved.iter().map(|effector| list.key(*effector).to_owned()).collect()
    }

    /// What 1 in each part of an action is, rad; thrust, N.
    #[getter]
    fn action_travel<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let servos = &self.common.setup.plant.airframe.servos;
        if self.common.moved.is_empty() {
            let Compensation { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad } =
                self.common.compensation(&[1.0; 3]);
            return PyArray1::from_slice(py, &[aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad]);
        }
        PyArray1::from_iter(py, self.common.moved.iter().map(|effector| servos[*effector].max))
    }

    /// Names of the parts of an observation, and what each was divided by.
    #[getter]
    fn observations(&self) -> Vec<(&'static str, f64)> {
        LawState::OBSERVED.to_vec()
    }

    /// Begins an episode in each flight whose seed is given, and the next one of the present seed where `seeds` has None.
    fn reset<'py>(
        &self,
        py: Python<'py>,
        seeds: Vec<Option<u64>>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let mut lanes = self.lock()?;
        if seeds.len() != lanes.len() {
            let message = format!("seed: {} seeds for {} flights", seeds.len(), lanes.len());
            return Err(PyValueError::new_err(message));
        }
        for (lane, seed) in lanes.iter_mut().zip(seeds) {
            if let Some(seed) = seed {
                (lane.seed, lane.episode) = (seed, 0);
            }
        }
        let begin = |lane: &mut Lane| lane.begin(&self.common);
        each(py, &mut lanes, begin)?
            .into_iter()
            .collect::<Result<Vec<()>, _>>()
            .map_err(refused)?;
        Ok(observations(py, &lanes))
    }

    /// Holds the actions, one row for each flight, for a step. Gives observations, rewards, whether each was lost, whether its time was
    /// over. A flight that has ended begins its next episode: never where `autoreset` is None, in the step that ends it where it is
    /// "same" (the last observations come fifth), and in the next step, whose action does not count, where it is "next".
    #[expect(clippy::type_complexity, reason = "the parts of a step in Gymnasium")]
    fn step<'py>(
        &self,
        py: Python<'py>,
        actions: PyReadonlyArray2<'py, f64>,
        autoreset: Option<&str>,
    ) -> PyResult<(
        Bound<'py, PyArray2<f32>>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<bool>>,
        Bound<'py, PyArray1<bool>>,
        Option<Bound<'py, PyArray2<f32>>>,
    )> {
        let mut lanes = self.lock()?;
        let (expected, found) = ([lanes.len(), self.common.actions], actions.shape());
        if found != expected {
            return Err(PyValueError::new_err(format!(
                "action: shape {found:?}; expected {expected:?}"
            )));
        }
        let rows = actions.as_array().to_owned();
        if let Some(value) = rows.iter().find(|value| !value.is_finite()) {
            return Err(PyValueError::new_err(format!("action: {value}; expected finite numbers")));
        }
        let ends = |lane: &Lane| lane.flight.is_none() || lane.is_over && autoreset.is_none();
        if lanes.iter().any(ends) {
            return Err(PyRuntimeError::new_err(
                "an episode is over, or none has begun; reset() begins one",
            ));
        }
        let mut work: Vec<(&mut Lane, &[f64])> = lanes
            .iter_mut()
            .zip(rows.rows())
            .map(|(lane, row)| (lane, row.to_slice().unwrap_or_default()))
            .collect();
        let step = |(lane, action): &mut (&mut Lane, &[f64])| match lane.is_over {
            true => lane.begin(&self.common).map(|()| Gave::default()),
            false => Ok(lane.step(&self.common, action)),
        };
        let gave: Result<Vec<Gave>, _> = each(py, &mut work, step)?.into_iter().collect();
        let gave = gave.map_err(refused)?;
        drop(work);
        let ended = gave.iter().any(|gave| gave.terminated || gave.truncated);
        let last = (autoreset == Some("same") && ended).then(|| observations(py, &lanes));
        if last.is_some() {
            let again =
                |lane: &mut Lane| if lane.is_over { lane.begin(&self.common) } else { Ok(()) };
            each(py, &mut lanes, again)?
                .into_iter()
                .collect::<Result<Vec<()>, _>>()
                .map_err(refused)?;
        }
        Ok((
            observations(py, &lanes),
            PyArray1::from_iter(py, gave.iter().map(|gave| gave.reward)),
            PyArray1::from_iter(py, gave.iter().map(|gave| gave.terminated)),
            PyArray1::from_iter(py, gave.iter().map(|gave| gave.truncated)),
            last,
        ))
    }

    /// What is drawn for the present episode of a flight: its fault, or nothing. No law knows it.
    fn fault(&self, place: usize) -> PyResult<String> {
        let lanes = self.lock()?;
        let lane = lanes
            .get(place)
            .ok_or_else(|| PyValueError::new_err(format!("there is no flight {place}")))?;
        Ok(lane.fault.clone())
    }
}

/// Does something with each flight: one alone on this thread, several on all cores with the interpreter's lock released.
fn each<T: Send, R: Send>(
    py: Python<'_>,
    all: &mut [T],
    work: impl Fn(&mut T) -> R + Sync + Send,
) -> PyResult<Vec<R>> {
    if let [one] = all {
        return Ok(vec![work(one)]);
    }
    let pool = pool()?;
    // Some flights take longer than others, so they are handed out a few at a time.
    Ok(py.detach(|| pool.install(|| all.par_iter_mut().with_max_len(4).map(work).collect())))
}

fn observations<'py>(py: Python<'py>, lanes: &[Lane]) -> Bound<'py, PyArray2<f32>> {
    let rows: Vec<Vec<f32>> =
        lanes.iter().map(|lane| lane.held.held().seen.observation().to_vec()).collect();
    // All rows have one length.
    PyArray2::from_vec2(py, &rows).unwrap_or_else(|_| PyArray2::zeros(py, [0, 0], false))
}
