//! Whole flights: `two_step.fly`.

use autopilot::recorder::{control_names, control_values};
use flight_control::DesignModel;
use icd::Sensors;
use icd::record::truth_fields;
use lab_engine::FlightSetup;
use lab_engine::flight::Tick;
use lab_judges::flown::{self, Keep};
use lab_judges::outcome::Outcome;
use lab_judges::trace::Sample;
use lab_judges::trajectory::{Columns, ticks_per_row};
use lab_report::runner;
use lab_studies::fly::seeds::{self, Seeds};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::simulation::Wanted;
use crate::table::{Table, Tables};
use crate::work;

/// Flies scenarios to their end. Gives what became of each as JSON, and of one flight its tables by name.
#[pyfunction]
#[pyo3(signature = (scenario, *, law=None, compensator=None, faults=None, rows=true, **options))]
pub fn fly(
    py: Python<'_>,
    scenario: &Bound<'_, PyAny>,
    law: Option<Bound<'_, PyAny>>,
    compensator: Option<Bound<'_, PyAny>>,
    faults: Option<Bound<'_, PyAny>>,
    rows: bool,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<(String, Tables)> {
    let seed = options.and_then(|options| options.get_item("seed").transpose()).transpose()?;
    let is_alone = seed.is_none_or(|seed| seed.extract::<u64>().is_ok());
    let Wanted { args, setup, law } =
        Wanted::of(scenario, [law, compensator], faults, options, is_alone)?;
    work::run(py, law.as_slice(), move || {
        let (stops, judges) = (args.stops_at_loss(), args.judges.as_slice());
        if let Some(Seeds::Range { from, to }) = args.seed {
            let keep = || Keep { judges, ..Keep::default() };
            let all = seeds::fly(&setup, from, to, stops, keep)?;
            return Ok((serde_json::to_string(&all)?, Vec::new()));
        }
        let mut recorder = rows.then(|| SignalRecorder::new(&setup));
        let mut look = |tick: &Tick<'_>| {
            if let Some(recorder) = &mut recorder {
                recorder.look(tick);
            }
        };
        let keep = Keep {
            judges,
            each_tick: Some(&mut look),
            each_second: Some(&runner::check_interrupt),
            ..Keep::default()
        };
        let outcome: Outcome = flown::fly(&setup, stops, keep)?.0;
        let tables = recorder.map(SignalRecorder::tables).unwrap_or_default();
        Ok((serde_json::to_string(&[outcome])?, tables))
    })
}

/// The signals of a flight, at most a hundred times a second.
struct SignalRecorder {
    every: u64,
    model: DesignModel,
    columns: Columns,
    count: usize,
    names: [Vec<String>; 4],
    values: [Vec<Vec<f64>>; 4],
}

/// Names of its tables: that of `flight.csv`, and topics of the flight log.
const TABLES: [&str; 4] = ["flight", "truth", "control", "sensors"];

impl SignalRecorder {
    fn new(setup: &FlightSetup) -> Self {
        let list = &setup.plant.airframe.effectors;
        let columns = Columns::of(list);
        let with_time = |names: Vec<String>| [vec!["t_s".to_owned()], names].concat();
        let names = [
            columns.names().to_vec(),
            with_time(truth_fields(list).map(|name| name.to_string()).collect()),
            with_time(control_names(list).iter().map(ToString::to_string).collect()),
            with_time(Sensors::NAMES.map(ToOwned::to_owned).to_vec()),
        ];
        let values = names.each_ref().map(|names| vec![Vec::new(); names.len()]);
        Self {
            every: ticks_per_row(setup.plant.period) as u64,
            model: DesignModel::new(setup.model),
            count: list.len(),
            columns,
            names,
            values,
        }
    }

    fn look(&mut self, tick: &Tick<'_>) {
        if !tick.exchange.step.is_multiple_of(self.every) {
            return;
        }
        let record = tick.record();
        let plant = tick.plant;
        let sample = Sample::of(&self.model, &record);
        let time = std::iter::once(tick.exchange.time.as_seconds());
        let truth = plant.truth().to_row(plant.on_ground(), plant.is_broken());
        let control = control_values(tick.log, self.count);
        let [first, second, third, fourth] = &mut self.values;
        push(first, self.columns.values(&sample.row, &record.truth, &record.log));
        push(second, time.clone().chain(truth.iter().copied()));
        push(third, time.clone().chain(control));
        push(fourth, time.chain(tick.sensors.to_array()));
    }

    fn tables(self) -> Tables {
        let named = TABLES.into_iter().zip(self.names.into_iter().zip(self.values));
        named
            .map(|(name, (names, values))| (name.to_owned(), Table::of_numbers(names, values)))
            .collect()
    }
}

fn push(columns: &mut [Vec<f64>], row: impl IntoIterator<Item = f64>) {
    columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
}
