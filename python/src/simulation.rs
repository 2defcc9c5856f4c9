//! A flight that Python moves on, step by step.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};

use autopilot::command::{Command, Intent, Outcome, VehicleCommand};
use autopilot::event::EventKind;
use autopilot::recorder::{Recorded, command_names, control_names, control_values};
use autopilot::vehicle::Reference;
use icd::fault::{FaultReply, Onset, PlantAction};
use icd::record::truth_fields;
use icd::{Effector, EffectorList, FaultRequest, PerEffector};
use lab_engine::{Flight, FlightSetup, fault_words};
use lab_studies::fly::FlyArgs;
use numpy::{PyArray1, PyArrayMethods as _};
use pyo3::exceptions::{PyAttributeError, PyKeyError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use toml::Value;

use crate::fault;
use crate::law::PythonLaw;
use crate::options::{self, refused};

/// Steps between two looks at Ctrl-C.
const LOOK_EVERY: u64 = 1_000;

/// What `fly` and `Simulation` fly, of their keywords.
pub struct Wanted {
    pub args: FlyArgs,
    pub setup: FlightSetup,
    pub law: Option<PythonLaw>,
}

impl Wanted {
    /// Of a scenario, options of `sitl fly`, faults instead of the scenario's, and a law that is not the program's.
    pub fn of(
        scenario: &Bound<'_, PyAny>,
        [law, compensator]: [Option<Bound<'_, PyAny>>; 2],
        faults: Option<Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
        is_alone: bool,
    ) -> PyResult<Self> {
        let mut words = options::words(options)?;
        let law = unless_named(&mut words, "law", law);
        let compensator = unless_named(&mut words, "compensator", compensator);
        let own = PythonLaw::new(law.as_ref(), compensator.as_ref(), None, &[], is_alone)?;
        words.extend(["--".into(), scenario.extract::<PathBuf>()?.into()]);
        let mut args: FlyArgs = options::parse(words)?;
        if let Some(law) = &own {
            args.options.laws.set_own_law(law.own());
        }
        let mut setup = args.setup().map_err(refused)?;
        if let Some(faults) = faults {
            setup.plant.faults = fault::of_flight(&faults, &setup.plant.airframe.effectors)?;
            setup.plant.check_faults().map_err(refused)?;
        }
        Ok(Self { args, setup, law: own })
    }
}

/// A law of Python; the name of one of the program's is an option.
fn unless_named<'py>(
    words: &mut Vec<OsString>,
    option: &str,
    law: Option<Bound<'py, PyAny>>,
) -> Option<Bound<'py, PyAny>> {
    let law = law?;
    match law.cast::<PyString>() {
        Ok(name) => words.push(format!("--{option}={name}").into()),
        Err(_) => return Some(law),
    }
    None
}

/// Named values of one instant: `signals["altitude_m"]` or `signals.altitude_m`. The last words of a name are its unit; axes and
/// signs are those of the flight log.
#[pyclass(frozen, mapping, module = "two_step")]
pub struct Signals {
    names: Arc<SignalList>,
    values: Vec<f64>,
}

/// Names of signals and their places.
#[derive(Debug)]
struct SignalList {
    names: Vec<String>,
    places: HashMap<String, usize>,
}

impl SignalList {
    fn of<N: AsRef<str>>(names: impl IntoIterator<Item = N>) -> Arc<Self> {
        let names: Vec<String> = names.into_iter().map(|name| name.as_ref().to_owned()).collect();
        let places = names.iter().cloned().zip(0..).collect();
        Arc::new(Self { names, places })
    }
}

impl Signals {
    fn get(&self, name: &str) -> Option<f64> {
        self.names.places.get(name).map(|place| self.values[*place])
    }
}

#[pymethods]
impl Signals {
    fn __getitem__(&self, name: &str) -> PyResult<f64> {
        self.get(name).ok_or_else(|| {
            PyKeyError::new_err(format!("{name:?}; there are {}", self.names.names.join(", ")))
        })
    }

    fn __getattr__(&self, name: &str) -> PyResult<f64> {
        self.get(name).ok_or_else(|| PyAttributeError::new_err(format!("no signal {name:?}")))
    }

    fn __contains__(&self, name: &str) -> bool {
        self.names.places.contains_key(name)
    }

    fn __len__(&self) -> usize {
        self.values.len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyList::new(py, &self.names.names)?.try_iter()?.into_any())
    }

    /// The names, in the order of the values.
    fn keys(&self) -> Vec<String> {
        self.names.names.clone()
    }

    /// The values as an array of numpy.
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.values)
    }

    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, value) in self.names.names.iter().zip(&self.values) {
            all.set_item(name, value)?;
        }
        Ok(all)
    }

    fn __repr__(&self) -> String {
        let all = self.names.names.iter().zip(&self.values);
        let all: Vec<String> = all.map(|(name, value)| format!("{name}={value}")).collect();
        format!("Signals({})", all.join(", "))
    }
}

/// One flight, stepped from Python.
#[pyclass(frozen, module = "two_step")]
pub struct Simulation {
    running: Mutex<Running>,
    names: SignalNames,
    law: Option<PythonLaw>,
}

/// Names of the signals of an aircraft.
#[derive(Clone)]
struct SignalNames {
    state: Arc<SignalList>,
    truth: Arc<SignalList>,
    commands: Arc<SignalList>,
}

struct Running {
    setup: FlightSetup,
    flight: Flight,
    /// Number of the last intent.
    intents: u32,
    is_over: bool,
}

impl Simulation {
    pub fn of(setup: FlightSetup, law: Option<PythonLaw>) -> PyResult<Self> {
        let list = &setup.plant.airframe.effectors;
        let names = SignalNames {
            state: SignalList::of(control_names(list)),
            truth: SignalList::of(truth_fields(list)),
            commands: SignalList::of(command_names(list)),
        };
        let running = Running::begin(setup, law.as_ref())?;
        Ok(Self { running: Mutex::new(running), names, law })
    }

    /// Its own law, which runs while it steps, must not step it.
    fn lock(&self) -> PyResult<MutexGuard<'_, Running>> {
        self.running.try_lock().map_err(|_| {
            PyRuntimeError::new_err(
                "the simulation is in use: by another thread, or by the law that flies it",
            )
        })
    }
}

impl Running {
    /// At the first tick.
    fn begin(setup: FlightSetup, law: Option<&PythonLaw>) -> PyResult<Self> {
        let flight = Flight::new(&setup).map_err(refused)?;
        let mut running = Self { setup, flight, intents: 0, is_over: false };
        running.step(law)?;
        Ok(running)
    }

    fn step(&mut self, law: Option<&PythonLaw>) -> PyResult<()> {
        if self.is_over {
            return Err(PyRuntimeError::new_err("the flight is over; reset() begins another one"));
        }
        self.is_over = self.flight.step([]).is_none();
        if self.flight.failure().is_some() {
            self.is_over = true;
            let raised = law.and_then(PythonLaw::raised);
            return Err(raised.unwrap_or_else(|| PyRuntimeError::new_err("the law has failed")));
        }
        Ok(())
    }

    fn list(&self) -> &EffectorList {
        &self.setup.plant.airframe.effectors
    }

    /// Has autopilot or plant execute a command while time stands still; refuses with their reason.
    fn execute(&mut self, command: Command) -> PyResult<()> {
        if self.is_over {
            return Err(PyRuntimeError::new_err("the flight is over; reset() begins another one"));
        }
        self.intents += 1;
        let (number, mut inputs) =
            (self.intents, vec![Recorded::Intent(Intent { number: self.intents, command })]);
        // The plant answers in the exchange after that in which it was asked.
        for _ in 0..3 {
            let _ = self.flight.hold(inputs.drain(..));
            let mut outcomes = self.flight.events().iter().filter_map(|event| match &event.kind {
                EventKind::Outcome { number: of, outcome } if *of == number => Some(*outcome),
                _ => None,
            });
            return match outcomes.next() {
                None => continue,
                Some(Outcome::Refused(refusal)) => Err(refused(refusal)),
                Some(Outcome::Plant(FaultReply::Refused(refusal))) => {
                    Err(refused(format!("{refusal:?}")))
                }
                Some(Outcome::NoAnswer) => Err(PyRuntimeError::new_err("the plant did not answer")),
                Some(Outcome::Done | Outcome::Plant(_)) => Ok(()),
            };
        }
        Err(PyRuntimeError::new_err("the plant did not answer"))
    }

    fn effector(&self, name: &str) -> PyResult<Effector> {
        let list = self.list();
        let plain = name.trim_end_matches("_rad").trim_end_matches("_n");
        list.by_key(name).or_else(|| list.by_key(plain)).ok_or_else(|| {
            let known: Vec<_> = list.all().map(|effector| list.key(effector)).collect();
            PyKeyError::new_err(format!("{name:?}; the effectors are {}", known.join(", ")))
        })
    }
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scenario, *, law=None, compensator=None, faults=None, **options))]
    fn new(
        scenario: &Bound<'_, PyAny>,
        law: Option<Bound<'_, PyAny>>,
        compensator: Option<Bound<'_, PyAny>>,
        faults: Option<Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let Wanted { setup, law, .. } =
            Wanted::of(scenario, [law, compensator], faults, options, true)?;
        Self::of(setup, law)
    }

    /// Begins the flight anew, at its first tick; with `seed` all random streams have it.
    #[pyo3(signature = (seed=None))]
    fn reset(&self, seed: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let mut running = self.lock()?;
        let mut setup = running.setup.clone();
        if let Some(seed) = seed {
            setup.plant.seed = self::seed(seed)?;
        }
        *running = Running::begin(setup, self.law.as_ref())?;
        Ok(())
    }

    /// Flies `count` control periods, or fewer to the end of the flight. False once the flight is over.
    #[pyo3(signature = (count=1))]
    fn step(&self, py: Python<'_>, count: i64) -> PyResult<bool> {
        if count < 1 {
            return Err(PyValueError::new_err(format!("count = {count}; expected at least 1")));
        }
        let mut running = self.lock()?;
        for step in 1..=count.unsigned_abs() {
            running.step(self.law.as_ref())?;
            if running.is_over {
                break;
            }
            if step % LOOK_EVERY == 0 {
                py.check_signals()?;
            }
        }
        Ok(!running.is_over)
    }

    /// Replaces commands of the control step that was just flown, by name or all of them in order: rad, thrust N. The plant obeys
    /// them in the next step, within its travel.
    fn act(&self, commands: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut running = self.lock()?;
        let Some(mut all) = running.flight.commands().copied() else {
            return Err(PyRuntimeError::new_err("the flight is over; reset() begins another one"));
        };
        let checked = |name: &str, value: f64| match value.is_finite() {
            true => Ok(value),
            false => {
                Err(PyValueError::new_err(format!("{name} = {value}; expected a finite number")))
            }
        };
        if let Ok(named) = commands.cast::<PyDict>() {
            for (name, value) in named {
                let name: String = name.extract()?;
                all[running.effector(&name)?] = checked(&name, value.extract()?)?;
            }
        } else {
            let list = *running.list();
            let values = numbers(commands, "commands")?;
            if values.len() != list.len() {
                let message = format!(
                    "commands: {} numbers; the aircraft has {} effectors",
                    values.len(),
                    list.len()
                );
                return Err(PyValueError::new_err(message));
            }
            for (effector, value) in list.all().zip(values) {
                all[effector] = checked(list.key(effector), value)?;
            }
        }
        running.flight.replace_commands(all);
        Ok(())
    }

    /// Breaks something, by the words of a script, "left elevator stuck at 30 deg", or by keywords: `stuck_deg=30`, or the keys of
    /// a scenario's fault, `kind="partial_loss", remaining_percent=50`. It begins `after_s` from now.
    #[pyo3(signature = (target, *, after_s=0.0, stuck_deg=None, **keys))]
    fn fail(
        &self,
        target: &str,
        after_s: f64,
        stuck_deg: Option<f64>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let mut running = self.lock()?;
        let now = running.flight.end().time;
        let onset =
            icd::SimTime::from_seconds(now.as_seconds() + after_s).filter(|_| after_s >= 0.0);
        let Some(onset) = onset else {
            return Err(PyValueError::new_err(format!("after_s = {after_s}; expected 0 or more")));
        };
        let list = *running.list();
        let mut table = keys.map(fault::table).transpose()?.unwrap_or_default();
        let mut fault = if table.is_empty() && stuck_deg.is_none() {
            fault::of_line(target, &list)?
        } else {
            let (key, name) = fault::target(target, &list);
            let _ = table.insert(key.to_owned(), Value::String(name));
            if let Some(angle_deg) = stuck_deg {
                let _ = table.insert("kind".to_owned(), Value::String("stuck_at".to_owned()));
                let _ = table.insert("angle_deg".to_owned(), Value::Float(angle_deg));
            }
            let _ = table.insert("onset_s".to_owned(), Value::Float(onset.as_seconds()));
            fault::of_keys(table, &list)?
        };
        fault.timing.onset = if after_s == 0.0 { Onset::AtOnce } else { Onset::At(onset) };
        let class = fault.target.class(&list);
        let checked = running.setup.plant.check_fault(&fault);
        checked.map_err(|refusal| {
            refused(format!("{}: {}", fault.described(&list), refusal.described(class)))
        })?;
        let plant_sim::ScheduledFault { target, kind, timing } = fault;
        running.execute(Command::Plant(PlantAction::Fault(FaultRequest::Inject {
            target,
            kind,
            timing,
        })))
    }

    /// Mends an effector, a sensor or a part, or everything, and cancels what is scheduled.
    #[pyo3(signature = (target=None))]
    fn clear(&self, target: Option<&str>) -> PyResult<()> {
        let mut running = self.lock()?;
        let line = format!("clear {}", target.unwrap_or("all"));
        let (_, request) = fault_words::line(&line, running.list()).map_err(refused)?;
        running.execute(Command::Plant(PlantAction::Fault(request)))
    }

    /// Changes references: altitude, m; true airspeed, m/s; roll angle or course over the ground, deg. Each has the limits of a
    /// ground station's command.
    #[pyo3(signature = (*, altitude_m=None, airspeed_m_s=None, roll_deg=None, course_deg=None))]
    fn refer(
        &self,
        altitude_m: Option<f64>,
        airspeed_m_s: Option<f64>,
        roll_deg: Option<f64>,
        course_deg: Option<f64>,
    ) -> PyResult<()> {
        let mut running = self.lock()?;
        let all = [
            altitude_m.map(Reference::Altitude),
            airspeed_m_s.map(Reference::Airspeed),
            roll_deg.map(|deg| Reference::Roll(deg.to_radians())),
            course_deg.map(|deg| Reference::Course(deg.to_radians())),
        ];
        for reference in all.into_iter().flatten() {
            running.execute(Command::Vehicle(VehicleCommand::Refer(reference)))?;
        }
        Ok(())
    }

    /// A simulation that continues from here with the same bits. A law in Python needs `__deepcopy__`.
    fn copy(&self) -> PyResult<Self> {
        let running = self.lock()?;
        let copied = Running {
            setup: running.setup.clone(),
            flight: copy_of(&running.flight)?,
            intents: running.intents,
            is_over: running.is_over,
        };
        Ok(Self { running: Mutex::new(copied), names: self.names.clone(), law: self.law.clone() })
    }

    fn __copy__(&self) -> PyResult<Self> {
        self.copy()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.copy()
    }

    /// Goes back, or over, to what another simulation was when it was copied.
    fn restore(&self, saved: &Self) -> PyResult<()> {
        let copied = saved.copy()?.running.into_inner();
        let copied = copied.map_err(|_| PyRuntimeError::new_err("the copy is broken"))?;
        let mut running = self.lock()?;
        if copied.setup.plant.airframe.name != running.setup.plant.airframe.name {
            return Err(PyValueError::new_err("the saved simulation flies another aircraft"));
        }
        *running = copied;
        Ok(())
    }

    /// Simulation time, s.
    #[getter]
    fn time_s(&self) -> PyResult<f64> {
        Ok(self.lock()?.flight.end().time.as_seconds())
    }

    /// Control steps flown.
    #[getter]
    fn steps(&self) -> PyResult<u64> {
        Ok(self.lock()?.flight.steps())
    }

    /// Whether the flight is over: by its duration, or on the ground.
    #[getter]
    fn is_over(&self) -> PyResult<bool> {
        Ok(self.lock()?.is_over)
    }

    /// Which limit of the aircraft is passed now, or that it is on the ground; None while it is kept.
    #[getter]
    fn loss(&self) -> PyResult<Option<String>> {
        let running = self.lock()?;
        if running.flight.end().on_ground {
            return Ok(Some("on the ground".to_owned()));
        }
        let at = running.flight.plant().truth().into();
        Ok(running.setup.plant.limits().exceeded(&at).map(|limit| limit.to_string()))
    }

    /// Names of the effectors, in the order of the commands.
    #[getter]
    fn effectors(&self) -> PyResult<Vec<String>> {
        let running = self.lock()?;
        let list = running.list();
        Ok(list.all().map(|effector| list.key(effector).to_owned()).collect())
    }

    /// Every signal of the last control step: measured state, references, estimates, commands (topic `control` of the flight log).
    #[getter]
    fn state(&self) -> PyResult<Signals> {
        let running = self.lock()?;
        let log =
            running.flight.log().ok_or_else(|| PyRuntimeError::new_err("no step was flown"))?;
        let values = control_values(log, running.list().len()).to_vec();
        Ok(Signals { names: self.names.state.clone(), values })
    }

    /// What is true at the last control step (topic `truth` of the flight log).
    #[getter]
    fn truth(&self) -> PyResult<Signals> {
        let running = self.lock()?;
        let plant = running.flight.plant();
        let values = plant.truth().to_row(plant.on_ground(), plant.is_broken()).to_vec();
        Ok(Signals { names: self.names.truth.clone(), values })
    }

    /// Commands that the plant obeys in the next step, rad; thrust N.
    #[getter]
    fn commands(&self) -> PyResult<Signals> {
        let running = self.lock()?;
        let none = PerEffector::default();
        let commands = running.flight.commands().unwrap_or(&none);
        let values = commands.first(running.list().len()).to_vec();
        Ok(Signals { names: self.names.commands.clone(), values })
    }

    fn __repr__(&self) -> PyResult<String> {
        let running = self.lock()?;
        let (aircraft, time_s) =
            (running.setup.plant.airframe.name, running.flight.end().time.as_seconds());
        Ok(format!("Simulation of {aircraft} at {time_s} s"))
    }
}

fn copy_of(flight: &Flight) -> PyResult<Flight> {
    flight.copy().map_err(|_| {
        PyTypeError::new_err("the simulation cannot be copied: its law has no __deepcopy__")
    })
}

/// A seed: a whole number of 64 bits.
pub fn seed(value: &Bound<'_, PyAny>) -> PyResult<u64> {
    value.extract().map_err(|_| {
        PyValueError::new_err(format!(
            "seed = {value}; expected a whole number from 0 to {}",
            u64::MAX
        ))
    })
}

/// Numbers of an array, a list or a tuple.
pub fn numbers(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    if let Ok(array) = value.cast::<PyArray1<f64>>() {
        return Ok(array.try_readonly()?.as_array().to_vec());
    }
    value.extract().map_err(|_| {
        PyTypeError::new_err(format!("{name}: expected numbers, not {}", value.get_type()))
    })
}
