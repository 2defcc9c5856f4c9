//! Faults from Python: a line of a script, or the keys of a scenario's `[[plant.fault]]`.

use autopilot::script::Trigger;
use icd::fault::Onset;
use icd::sensors::SensorKind;
use icd::{EffectorList, FaultRequest, SimTime};
use lab_engine::fault_words;
use plant_sim::{Scenario, ScheduledFault};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use toml::{Table, Value};

use crate::options::{refused, toml};

/// The faults of a flight: each a line such as `"at 3 s: left elevator stuck at 30 deg"`, or a dict with the keys of a scenario.
pub fn of_flight(faults: &Bound<'_, PyAny>, list: &EffectorList) -> PyResult<Vec<ScheduledFault>> {
    if faults.is_instance_of::<PyString>() || faults.is_instance_of::<PyDict>() {
        return Err(PyTypeError::new_err("faults: expected a list of faults"));
    }
    let one = |fault: PyResult<Bound<'_, PyAny>>| {
        let fault = fault?;
        match fault.cast::<PyDict>() {
            Ok(keys) => of_keys(table(keys)?, list),
            Err(_) => of_line(&fault.extract::<String>()?, list),
        }
    };
    faults.try_iter()?.map(one).collect()
}

/// A line of a script; `fail` may be left out.
pub fn of_line(text: &str, list: &EffectorList) -> PyResult<ScheduledFault> {
    let (trigger, request) = fault_words::line(text, list).map_err(refused)?;
    let FaultRequest::Inject { target, kind, mut timing } = request else {
        return Err(PyValueError::new_err(format!("faults: {text:?} is not one fault")));
    };
    timing.onset = match trigger {
        Trigger::At(us) | Trigger::After(us) => Onset::At(SimTime::from_micros(us)),
        // Of the flight, which begins at zero.
        Trigger::AtOnce | Trigger::When(_) => Onset::At(SimTime::ZERO),
    };
    Ok(ScheduledFault { target, kind, timing })
}

/// The keys of a `[[plant.fault]]`.
pub fn of_keys(fault: Table, list: &EffectorList) -> PyResult<ScheduledFault> {
    let plant = Table::from_iter([("fault".to_owned(), Value::Array(vec![Value::Table(fault)]))]);
    let file = Table::from_iter([("plant".to_owned(), Value::Table(plant))]);
    let scenario = Scenario::from_table("faults", file, list).map_err(refused)?;
    scenario.plant.faults.first().copied().ok_or_else(|| PyValueError::new_err("faults: no fault"))
}

pub fn table(keys: &Bound<'_, PyDict>) -> PyResult<Table> {
    keys.iter().map(|(key, value)| Ok((key.extract()?, toml(&value)?))).collect()
}

/// The key of a scenario for what a name is: an effector, a sensor or a part, and its name there.
pub fn target(name: &str, list: &EffectorList) -> (&'static str, String) {
    let key = name.trim().to_lowercase().replace(' ', "_");
    if list.by_key(&key).is_some() || list.by_key(name).is_some() {
        let effector = list.by_key(&key).or_else(|| list.by_key(name));
        return ("effector", effector.map_or(key, |effector| list.key(effector).to_owned()));
    }
    match SensorKind::by_key(&key).or_else(|| SensorKind::by_key(name)) {
        Some(sensor) => ("sensor", sensor.key().to_owned()),
        None if ["wing", "tail", "fin"].iter().any(|part| key.ends_with(part)) => ("part", key),
        None => ("effector", key),
    }
}
