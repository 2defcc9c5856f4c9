//! Every command of `sitl`, as a function and as the program itself.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;

use autopilot::own_law::OwnLaw;
use host_io::console;
use host_io::problem::problem;
use lab_logs::replay::open_log;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sitl::cli::{self, Cli};

use crate::law::PythonLaw;
use crate::options::{self, refused};
use crate::table::{Table, Tables};
use crate::work;

/// A law in Python: main controller, compensator or both, its name in tables, and parameters that it flies with in a campaign.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Own<'py> {
    main: Option<Bound<'py, PyAny>>,
    compensator: Option<Bound<'py, PyAny>>,
    name: Option<String>,
    set: Option<BTreeMap<String, f64>>,
}

impl Own<'_> {
    fn law(self) -> PyResult<Option<PythonLaw>> {
        let Self { main, compensator, name, set } = self;
        let settings: Vec<(String, f64)> = set.unwrap_or_default().into_iter().collect();
        PythonLaw::new(main.as_ref(), compensator.as_ref(), name, &settings, false)
    }
}

/// Carries out a command: its words, what stands without an option's name, and options by keyword. Gives the exit status and what it
/// printed.
#[pyfunction]
#[pyo3(signature = (command, arguments, *, own=vec![], **options))]
pub fn command(
    py: Python<'_>,
    command: Vec<OsString>,
    arguments: Vec<OsString>,
    own: Vec<Own<'_>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<(u8, String)> {
    let mut words = vec![OsString::from("sitl")];
    words.extend(command);
    words.extend(options::words(options)?);
    if !arguments.is_empty() {
        words.push("--".into());
        words.extend(arguments);
    }
    let mut cli = Cli::read(words).map_err(|error| options::mistake(&error))?;
    let laws = own.into_iter().filter_map(|own| own.law().transpose());
    let laws = laws.collect::<PyResult<Vec<PythonLaw>>>()?;
    let own: Vec<OwnLaw> = laws.iter().map(|law| law.own().clone()).collect();
    // Only a campaign flies several, and takes them when it runs.
    if let Some(law) = own.first() {
        cli.set_own_law(law);
    }
    // This process is Python itself.
    let scripts = py.import("sysconfig")?.call_method1("get_path", ("scripts",))?;
    let program = scripts.extract::<PathBuf>()?.join("sitl");
    work::run(py, &laws, move || {
        let (ended, text) =
            console::captured(|| cli::run(&cli, &program, &own).map_err(|e| problem!("{e}")));
        ended.map(|status| (status, text))
    })
}

/// The program `sitl` with these words; `program` is what it starts for its two processes. Gives the exit status.
#[pyfunction]
pub fn main(py: Python<'_>, words: Vec<OsString>, program: PathBuf) -> u8 {
    py.detach(|| cli::main_of(words, &program, None))
}

/// What a flight log says of its flight, by key.
type Infos = Vec<(String, String)>;

/// Reads a flight log (ULog): a table for each topic, and what it says of the flight.
#[pyfunction]
pub fn read_log(py: Python<'_>, path: PathBuf) -> PyResult<(Tables, Infos)> {
    let read = move || {
        let log = open_log(&path)?;
        let tables = log.topics().map(|topic| {
            let fields = topic.fields().iter().filter(|field| topic.kind(&field.name).is_some());
            let named =
                fields.filter_map(|field| Some((field.name.clone(), topic.column(&field.name)?)));
            let (names, values): (Vec<_>, Vec<_>) = named.unzip();
            (topic.name().to_owned(), Table::of_numbers(names, values))
        });
        let infos = log
            .infos()
            .iter()
            .filter_map(|info| Some((info.field.name.clone(), info.text()?.to_owned())));
        Ok((tables.collect(), infos.collect()))
    };
    work::run(py, &[], read)
}

/// Reads a TOML file, as JSON.
#[pyfunction]
pub fn read_toml(path: PathBuf) -> PyResult<String> {
    let text = std::fs::read_to_string(&path)?;
    let table: toml::Table = toml::from_str(&text).map_err(refused)?;
    serde_json::to_string(&table).map_err(refused)
}
