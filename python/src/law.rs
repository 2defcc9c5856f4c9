//! A main controller written in Python.
//!
//! It is called with a [`LawState`] in each control period and gives a command. An exception ends the flight; it is kept, so that the
//! caller of the flight gets it with its traceback.

use std::error::Error;
use std::sync::{Arc, Mutex, PoisonError};

use autopilot::own_law::OwnLaw;
use flight_control::{LawInput, MainCommand};
use lab_engine::law::{FallibleLaw, fallible};
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFunction, PyType};

/// What a law is given in one control period.
#[pyclass(frozen, module = "two_step")]
pub struct LawState {
    values: [f64; NAMES.len()],
}

macro_rules! inputs {
    ($input:ident: $($(#[$doc:meta])* $name:ident => $value:expr;)+) => {
        const NAMES: [&str; [$(stringify!($name)),+].len()] = [$(stringify!($name)),+];

        impl LawState {
            fn of($input: &LawInput<'_>) -> Self {
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

            fn __repr__(&self) -> String {
                let all = NAMES.iter().zip(self.values).map(|(name, value)| format!("{name}={value}"));
                format!("LawState({})", all.collect::<Vec<_>>().join(", "))
            }
        }
    };
}

inputs! { input:
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
    /// Mass in the controller's model, kg.
    mass_kg => input.model.aircraft().mass.mass_kg;
    /// Pitch angle of steady flight at the design point, rad.
    trim_pitch_rad => input.model.aircraft().trim.theta_rad;
    /// Elevator command of steady flight at the design point, rad.
    trim_elevator_rad => input.model.aircraft().trim.elevator_rad;
    /// Thrust of steady flight at the design point, N.
    trim_thrust_n => input.model.aircraft().trim.thrust_n;
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
        let all = [
            ("aileron_rad", aileron_rad),
            ("elevator_rad", elevator_rad),
            ("rudder_rad", rudder_rad),
            ("thrust_n", thrust_n),
            ("nozzle_pitch_rad", nozzle_pitch_rad),
            ("nozzle_yaw_rad", nozzle_yaw_rad),
        ];
        if let Some((name, value)) = all.iter().find(|(_, value)| !value.is_finite()) {
            return Err(PyValueError::new_err(format!(
                "the law returned {name} = {value}; expected a finite number"
            )));
        }
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

/// A law of Python as one that the program brings, and the exception that ended its flight.
#[derive(Clone)]
pub struct PythonLaw {
    own: OwnLaw,
    raised: Raised,
}

/// The first exception of a law, for the caller of its flights.
type Raised = Arc<Mutex<Option<PyErr>>>;

impl PythonLaw {
    /// `law` is a callable, or a class whose instances are. `is_alone`: there is one flight, so an instance that cannot be copied will do.
    pub fn new(law: &Bound<'_, PyAny>, name: Option<String>, is_alone: bool) -> PyResult<Self> {
        let is_class = law.is_instance_of::<PyType>();
        if !law.is_callable() {
            let message = format!("law: expected a name or a callable, not {}", law.repr()?);
            return Err(PyTypeError::new_err(message));
        }
        if !is_class && !is_alone && !is_function(law) && !law.hasattr("__deepcopy__")? {
            return Err(PyTypeError::new_err(
                "law: each of several flights needs a law of its own: give the class, or give its instances __deepcopy__",
            ));
        }
        let of_type = || law.get_type().name().map(|name| name.to_string());
        let own_name = law.getattr("__name__").and_then(|name| name.extract());
        let name = name.map_or_else(|| own_name.or_else(|_: PyErr| of_type()), Ok)?;
        let raised = Raised::default();
        let (make, slot) = (Arc::new(law.clone().unbind()), raised.clone());
        let of_flight = move || -> Box<dyn FallibleLaw> {
            let law = Python::attach(|py| fresh(make.bind(py)).map(Bound::unbind));
            Box::new(FlyingLaw {
                law: law.map_err(|error| keep(&slot, error)).ok(),
                raised: slot.clone(),
            })
        };
        Ok(Self { own: fallible(&name, of_flight), raised })
    }

    pub fn own(&self) -> &OwnLaw {
        &self.own
    }

    /// The exception that ended a flight, if one did.
    pub fn raised(&self) -> Option<PyErr> {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).take()
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

/// Keeps the first exception, and says what it was.
fn keep(raised: &Raised, error: PyErr) -> String {
    let text = error.to_string();
    raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    text
}

/// The law of one flight; none if it could not be made.
struct FlyingLaw {
    law: Option<Py<PyAny>>,
    raised: Raised,
}

impl FallibleLaw for FlyingLaw {
    fn step(&mut self, input: &LawInput<'_>) -> Result<MainCommand, Box<dyn Error + Send + Sync>> {
        let Some(law) = &self.law else { return Err("the law could not be made".into()) };
        let called = Python::attach(|py| {
            let command = law.bind(py).call1((LawState::of(input),))?;
            match command.cast::<Command>() {
                Ok(command) => command.get().checked(),
                Err(_) => Err(PyTypeError::new_err(format!(
                    "the law returned {}; expected a two_step.Command",
                    command.repr()?
                ))),
            }
        });
        called.map_err(|error| keep(&self.raised, error).into())
    }

    fn copy(&self) -> Option<Box<dyn FallibleLaw>> {
        let law = self.law.as_ref()?;
        let copied = Python::attach(|py| {
            let law = law.bind(py);
            match is_function(law) {
                true => Ok(law.clone().unbind()),
                false if law.hasattr("__deepcopy__")? => deep_copy(law).map(Bound::unbind),
                false => Err(PyRuntimeError::new_err("it has no __deepcopy__")),
            }
        });
        Some(Box::new(Self { law: Some(copied.ok()?), raised: self.raised.clone() }))
    }
}
