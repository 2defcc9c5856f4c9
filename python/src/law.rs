//! A main controller, a compensator, or both, written in Python.
//!
//! Each is called with a [`LawState`] in each control period; a main controller gives a [`Command`], a compensator a [`Compensation`].
//! An exception ends the flight; it is kept, so that the caller of the flight gets it with its traceback.

use std::error::Error;
use std::sync::{Arc, Mutex, PoisonError};

use autopilot::own_law::{Failure, FlightLaw, OwnLaw, OwnRole};
use flight_control::{Law, LawInput, MainCommand};
use lab_report::runner;
use nalgebra::Vector3;
use numpy::PyArray1;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFunction, PyType};

/// What a law is given in one control period.
#[pyclass(frozen, module = "two_step")]
#[derive(Debug, Clone)]
pub struct LawState {
    values: [f64; NAMES.len()],
}

impl Default for LawState {
    fn default() -> Self {
        Self { values: [0.0; NAMES.len()] }
    }
}

macro_rules! inputs {
    ($input:ident, $main:ident, $z2:ident: $($(#[$doc:meta])* $name:ident => $value:expr;)+) => {
        const NAMES: [&str; [$(stringify!($name)),+].len()] = [$(stringify!($name)),+];

        impl LawState {
            pub fn of($input: &LawInput<'_>, $main: &MainCommand, $z2: &Vector3<f64>) -> Self {
                Self { values: [$($value),+] }
            }
        }

        #[derive(Clone, Copy)]
        #[expect(non_camel_case_types, reason = "the names of the signals")]
        enum Place { $($name),+ }

        #[pymethods]
        impl LawState {
            $($(#[$doc])*
            #[getter]
            fn $name(&self) -> f64 {
                self.values[Place::$name as usize]
            })+

            /// All of them by name.
            fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                let all = PyDict::new(py);
                NAMES.iter().zip(self.values).try_for_each(|(name, value)| all.set_item(name, value))?;
                Ok(all)
            }

            /// What the environments of `two_step.gym` observe, as an array of numpy.
            #[pyo3(name = "observation")]
            fn observation_of<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
                PyArray1::from_slice(py, &self.observation())
            }

            fn __repr__(&self) -> String {
                let all = NAMES.iter().zip(self.values).map(|(name, value)| format!("{name}={value}"));
                format!("LawState({})", all.collect::<Vec<_>>().join(", "))
            }
        }
    };
}

inputs! { input, main, z2:
    /// Simulation time, s.
    time_s => input.state.time.as_seconds();
    /// Control period, s.
    period_s => input.h;
    /// Roll rate, rad/s.
    p_rad_s => input.state.rates.x;
    /// Pitch rate, rad/s.
    q_rad_s => input.state.rates.y;
    /// Yaw rate, rad/s.
    r_rad_s => input.state.rates.z;
    /// Roll angle, rad.
    roll_rad => input.state.attitude.phi;
    /// Pitch angle, rad.
    pitch_rad => input.state.attitude.theta;
    /// Yaw angle, rad, from north to the right.
    yaw_rad => input.state.attitude.psi;
    /// Angle of attack, rad.
    alpha_rad => input.state.alpha;
    /// Sideslip, rad, positive with the airflow from the right.
    beta_rad => input.state.beta;
    /// True airspeed, m/s.
    airspeed_m_s => input.state.airspeed_m_s;
    /// Altitude above the ellipsoid or the flat ground, m.
    altitude_m => input.state.altitude_m;
    /// Climb rate, m/s.
    climb_rate_m_s => input.state.climb_rate_m_s();
    /// Thrust, N, measured.
    thrust_n => input.state.thrust_n;
    /// Altitude to hold, m, after its slew limit.
    altitude_reference_m => input.references.altitude_m;
    /// Roll angle to hold, rad, after its lag.
    roll_reference_rad => input.references.roll_rad;
    /// Airspeed to hold, m/s.
    airspeed_reference_m_s => input.references.airspeed_m_s;
    /// Estimated fault acceleration in roll, rad/s²; zero for a main controller.
    z2_roll_rad_s2 => z2.x;
    /// In pitch, rad/s².
    z2_pitch_rad_s2 => z2.y;
    /// In yaw, rad/s².
    z2_yaw_rad_s2 => z2.z;
    /// Aileron command of the main controller, rad; zero for a main controller, as the next ones.
    main_aileron_rad => main.aileron_rad;
    /// Its elevator command, rad.
    main_elevator_rad => main.elevator_rad;
    /// Its rudder command, rad.
    main_rudder_rad => main.rudder_rad;
    /// Its thrust command, N.
    main_thrust_n => main.thrust_n;
    /// Mass in the controller's model, kg.
    mass_kg => input.model.aircraft().mass.mass_kg;
    /// Pitch angle of steady flight at the design point, rad.
    trim_pitch_rad => input.model.aircraft().trim.theta_rad;
    /// Elevator command of steady flight at the design point, rad.
    trim_elevator_rad => input.model.aircraft().trim.elevator_rad;
    /// Thrust of steady flight at the design point, N.
    trim_thrust_n => input.model.aircraft().trim.thrust_n;
}

impl LawState {
    /// Names of the numbers that reinforcement learning observes, and what each is divided by.
    pub const OBSERVED: [(&'static str, f64); 18] = [
        ("p_rad_s", 0.5),
        ("q_rad_s", 0.5),
        ("r_rad_s", 0.5),
        ("roll_rad", 0.5),
        ("pitch_rad", 0.5),
        ("alpha_rad", 0.2),
        ("beta_rad", 0.2),
        ("climb_rate_m_s", 20.0),
        ("altitude_error_m", 100.0),
        ("roll_error_rad", 0.5),
        ("airspeed_error_part", 0.1),
        ("z2_roll_rad_s2", 1.0),
        ("z2_pitch_rad_s2", 1.0),
        ("z2_yaw_rad_s2", 1.0),
        ("main_aileron_rad", 0.5),
        ("main_elevator_rad", 0.5),
        ("main_rudder_rad", 0.5),
        ("main_thrust_part", 1.0),
    ];

    fn altitude_error_m(&self) -> f64 {
        self.altitude_reference_m() - self.altitude_m()
    }

    fn roll_error_rad(&self) -> f64 {
        self.roll_reference_rad() - self.roll_rad()
    }

    /// The numbers of [`Self::OBSERVED`], none beyond 100 times its scale.
    pub fn observation(&self) -> [f32; Self::OBSERVED.len()] {
        // The first steps of a flight may have no reference yet.
        let part = |value: f64, of: f64| if of == 0.0 { 0.0 } else { value / of };
        let airspeed_m_s = self.airspeed_reference_m_s();
        let values = [
            self.p_rad_s(),
            self.q_rad_s(),
            self.r_rad_s(),
            self.roll_rad(),
            self.pitch_rad(),
            self.alpha_rad(),
            self.beta_rad(),
            self.climb_rate_m_s(),
            self.altitude_error_m(),
            self.roll_error_rad(),
            part(airspeed_m_s - self.airspeed_m_s(), airspeed_m_s),
            self.z2_roll_rad_s2(),
            self.z2_pitch_rad_s2(),
            self.z2_yaw_rad_s2(),
            self.main_aileron_rad(),
            self.main_elevator_rad(),
            self.main_rudder_rad(),
            part(self.main_thrust_n(), self.trim_thrust_n()),
        ];
        let mut scaled = [0.0; Self::OBSERVED.len()];
        for ((scaled, value), (_, scale)) in scaled.iter_mut().zip(values).zip(Self::OBSERVED) {
            *scaled = (value / scale).clamp(-100.0, 100.0) as f32;
        }
        scaled
    }

    /// Reward of a second: 1 where the references are held at rest, 0 at 0.5 rad and 100 m from them with 0.5 rad/s.
    pub fn reward_rate(&self) -> f64 {
        let rates =
            [self.p_rad_s(), self.q_rad_s(), self.r_rad_s()].map(|rate| (rate / 0.5).powi(2));
        let roll = (self.roll_error_rad() / 0.5).powi(2).min(1.0);
        let altitude = (self.altitude_error_m() / 100.0).powi(2).min(1.0);
        1.0 - 0.5 * roll - 0.3 * altitude - 0.2 * rates.iter().sum::<f64>().min(1.0)
    }
}

/// Commands of a main controller, rad and N, before limits. Positive aileron rolls left, positive elevator lowers the nose, positive
/// rudder turns the nose left.
#[pyclass(frozen, get_all, module = "two_step")]
#[derive(Debug, Clone, Copy)]
pub struct Command {
    aileron_rad: f64,
    elevator_rad: f64,
    rudder_rad: f64,
    thrust_n: f64,
    nozzle_pitch_rad: f64,
    nozzle_yaw_rad: f64,
}

#[pymethods]
impl Command {
    #[new]
    #[pyo3(signature = (aileron_rad=0.0, elevator_rad=0.0, rudder_rad=0.0, thrust_n=0.0, nozzle_pitch_rad=0.0, nozzle_yaw_rad=0.0))]
    fn new(
        aileron_rad: f64,
        elevator_rad: f64,
        rudder_rad: f64,
        thrust_n: f64,
        nozzle_pitch_rad: f64,
        nozzle_yaw_rad: f64,
    ) -> Self {
        Self { aileron_rad, elevator_rad, rudder_rad, thrust_n, nozzle_pitch_rad, nozzle_yaw_rad }
    }

    fn __repr__(&self) -> String {
        format!("{self:?}")
    }
}

/// Commands of a compensator beside the main controller, rad, before limits: `aileron_rad` adds to the aileron command, the nozzle
/// angles are its own. Positive aileron rolls left; the nozzle's pitch angle pitches the nose up, its yaw angle to the right.
#[pyclass(frozen, get_all, module = "two_step")]
#[derive(Debug, Clone, Copy)]
pub struct Compensation {
    aileron_rad: f64,
    nozzle_pitch_rad: f64,
    nozzle_yaw_rad: f64,
}

#[pymethods]
impl Compensation {
    #[new]
    #[pyo3(signature = (aileron_rad=0.0, nozzle_pitch_rad=0.0, nozzle_yaw_rad=0.0))]
    fn new(aileron_rad: f64, nozzle_pitch_rad: f64, nozzle_yaw_rad: f64) -> Self {
        Self { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad }
    }

    fn __repr__(&self) -> String {
        format!("{self:?}")
    }
}

/// Refuses commands that are not finite.
fn check(commands: &[(&str, f64)]) -> PyResult<()> {
    match commands.iter().find(|(_, value)| !value.is_finite()) {
        Some((name, value)) => Err(PyValueError::new_err(format!(
            "the law returned {name} = {value}; expected a finite number"
        ))),
        None => Ok(()),
    }
}

impl Command {
    fn checked(self) -> PyResult<MainCommand> {
        let Self {
            aileron_rad,
            elevator_rad,
            rudder_rad,
            thrust_n,
            nozzle_pitch_rad,
            nozzle_yaw_rad,
        } = self;
        check(&[
            ("aileron_rad", aileron_rad),
            ("elevator_rad", elevator_rad),
            ("rudder_rad", rudder_rad),
            ("thrust_n", thrust_n),
            ("nozzle_pitch_rad", nozzle_pitch_rad),
            ("nozzle_yaw_rad", nozzle_yaw_rad),
        ])?;
        Ok(MainCommand {
            aileron_rad,
            elevator_rad,
            rudder_rad,
            nozzle_pitch_rad,
            nozzle_yaw_rad,
            thrust_n,
        })
    }
}

impl Compensation {
    fn checked(self) -> PyResult<flight_control::Compensation> {
        let Self { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad } = self;
        check(&[
            ("aileron_rad", aileron_rad),
            ("nozzle_pitch_rad", nozzle_pitch_rad),
            ("nozzle_yaw_rad", nozzle_yaw_rad),
        ])?;
        Ok(flight_control::Compensation { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad })
    }
}

/// Laws of Python as one that the program brings, and the exception that ended its flight.
#[derive(Clone)]
pub struct PythonLaw {
    own: OwnLaw,
    raised: Raised,
}

/// The first exception of a law, for the caller of its flights.
type Raised = Arc<Mutex<Option<PyErr>>>;

impl PythonLaw {
    /// Each of `main` and `compensator` is a callable, or a class whose instances are; one object for both is asked for both.
    /// `is_alone`: there is one flight, so an instance that cannot be copied will do. None where there is neither.
    pub fn new(
        main: Option<&Bound<'_, PyAny>>,
        compensator: Option<&Bound<'_, PyAny>>,
        name: Option<String>,
        settings: &[(String, f64)],
        is_alone: bool,
    ) -> PyResult<Option<Self>> {
        let role = match (main, compensator) {
            (None, None) => return Ok(None),
            (Some(_), None) => OwnRole::Main,
            (None, Some(_)) => OwnRole::Compensator,
            (Some(_), Some(_)) => OwnRole::Both,
        };
        for (role, law) in [("law", main), ("compensator", compensator)] {
            law.map_or(Ok(()), |law| check_callable(role, law, is_alone))?;
        }
        let names: Vec<String> =
            main.into_iter().chain(compensator).map(name_of).collect::<PyResult<_>>()?;
        let name = name.unwrap_or_else(|| names.join(" with "));
        let raised = Raised::default();
        let held = |law: Option<&Bound<'_, PyAny>>| law.map(|law| law.clone().unbind());
        let (makers, slot) = (Arc::new([held(main), held(compensator)]), raised.clone());
        let of_flight = move || {
            let made = Python::attach(|py| {
                let fresh = |law: &Option<Py<PyAny>>| {
                    law.as_ref().map(|law| fresh(law.bind(py))).transpose()
                };
                Ok([fresh(&makers[0])?, fresh(&makers[1])?].map(|law| law.map(Bound::unbind)))
            });
            let (laws, failure) = match made {
                Ok(laws) => (laws, None),
                Err(error) => ([None, None], Some(keep(&slot, error))),
            };
            FlyingLaw { laws, failure, raised: slot.clone(), last: MainCommand::default() }
        };
        Ok(Some(Self { own: OwnLaw::new(&name, of_flight).in_role(role).with(settings), raised }))
    }

    pub fn own(&self) -> &OwnLaw {
        &self.own
    }

    /// The exception that ended a flight, if one did.
    pub fn raised(&self) -> Option<PyErr> {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

fn check_callable(role: &str, law: &Bound<'_, PyAny>, is_alone: bool) -> PyResult<()> {
    if !law.is_callable() {
        let message = format!("{role}: expected a name or a callable, not {}", law.repr()?);
        return Err(PyTypeError::new_err(message));
    }
    let is_class = law.is_instance_of::<PyType>();
    if !is_class && !is_alone && !is_function(law) && !law.hasattr("__deepcopy__")? {
        return Err(PyTypeError::new_err(format!(
            "{role}: each of several flights needs one of its own: give the class, or give its instances __deepcopy__"
        )));
    }
    Ok(())
}

fn name_of(law: &Bound<'_, PyAny>) -> PyResult<String> {
    match law.getattr("__name__") {
        Ok(name) => name.extract(),
        Err(_) => Ok(law.get_type().name()?.to_string()),
    }
}

fn is_function(law: &Bound<'_, PyAny>) -> bool {
    // A bound method has the state of its object.
    law.is_instance_of::<PyFunction>() && !law.hasattr("__self__").unwrap_or(true)
}

/// The law of a flight that begins.
fn fresh<'py>(law: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let law = match () {
        () if law.is_instance_of::<PyType>() => law.call0()?,
        () if !is_function(law) && law.hasattr("__deepcopy__")? => deep_copy(law)?,
        () => law.clone(),
    };
    if law.hasattr("reset")? {
        law.call_method0("reset")?;
    }
    Ok(law)
}

fn deep_copy<'py>(law: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    law.py().import("copy")?.call_method1("deepcopy", (law,))
}

/// Keeps the first exception, and says what it was; the other flights of the call end too, which are all on this thread.
fn keep(raised: &Raised, error: PyErr) -> Failure {
    runner::interrupt_thread();
    let text = error.to_string();
    raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    Failure::from(Box::<dyn Error + Send + Sync>::from(text))
}

/// The laws of one flight. From a failure on the last command is repeated, and the flight ends after that step.
struct FlyingLaw {
    /// Main controller and compensator.
    laws: [Option<Py<PyAny>>; 2],
    failure: Option<Failure>,
    raised: Raised,
    last: MainCommand,
}

impl FlyingLaw {
    fn called<R>(
        &mut self,
        law: usize,
        state: LawState,
        read: fn(&Bound<'_, PyAny>) -> PyResult<R>,
    ) -> Option<R> {
        let law = self.laws[law].as_ref().filter(|_| self.failure.is_none())?;
        let called = Python::attach(|py| read(&law.bind(py).call1((state,))?));
        called.map_err(|error| self.failure = Some(keep(&self.raised, error))).ok()
    }
}

impl Law for FlyingLaw {
    fn step(&mut self, input: &LawInput<'_>) -> MainCommand {
        let state = LawState::of(input, &MainCommand::default(), &Vector3::zeros());
        let read = |answer: &Bound<'_, PyAny>| match answer.cast::<Command>() {
            Ok(command) => command.get().checked(),
            Err(_) => Err(unexpected(answer, "Command")),
        };
        self.last = self.called(0, state, read).unwrap_or(self.last);
        self.last
    }

    fn compensate(
        &mut self,
        input: &LawInput<'_>,
        main: &MainCommand,
        z2: &Vector3<f64>,
    ) -> flight_control::Compensation {
        let read = |answer: &Bound<'_, PyAny>| match answer.cast::<Compensation>() {
            Ok(compensation) => compensation.get().checked(),
            Err(_) => Err(unexpected(answer, "Compensation")),
        };
        self.called(1, LawState::of(input, main, z2), read).unwrap_or_default()
    }
}

fn unexpected(answer: &Bound<'_, PyAny>, expected: &str) -> PyErr {
    match answer.repr() {
        Ok(shown) => PyTypeError::new_err(format!(
            "the law returned {shown}; expected a two_step.{expected}"
        )),
        Err(error) => error,
    }
}

impl FlightLaw for FlyingLaw {
    fn copy(&self) -> Option<Box<dyn FlightLaw>> {
        let copied = |law: &Option<Py<PyAny>>| -> Option<Option<Py<PyAny>>> {
            let Some(law) = law else { return Some(None) };
            Python::attach(|py| {
                let law = law.bind(py);
                if is_function(law) {
                    return Some(Some(law.clone().unbind()));
                }
                let copied = law.hasattr("__deepcopy__").ok()?.then(|| deep_copy(law).ok())??;
                Some(Some(copied.unbind()))
            })
        };
        let laws = [copied(&self.laws[0])?, copied(&self.laws[1])?];
        let (failure, raised) = (self.failure.clone(), self.raised.clone());
        Some(Box::new(Self { laws, failure, raised, last: self.last }))
    }

    fn failure(&self) -> Option<Failure> {
        self.failure.clone()
    }
}
