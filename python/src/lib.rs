//! The part of the Python package `two_step` that is Rust: flights, tables, laws and commands. The rest stands beside it in Python,
//! with its documentation.
//!
//! ```text
//! keywords ─> options ─> FlightSetup ─> fly, Simulation, Episodes ─> tables, signals, arrays
//!             └─ the parser of the command line          └─ law: a callable of Python
//! ```

use pyo3::prelude::*;

mod command;
mod episodes;
mod fault;
mod fly;
mod law;
mod options;
mod pool;
mod simulation;
mod table;
mod work;

/// What `two_step` is made of; import that package instead.
#[pymodule]
mod _native {
    use super::*;

    #[pymodule_export]
    use super::command::{command, main, read_log, read_toml};
    #[pymodule_export]
    use super::episodes::Episodes;
    #[pymodule_export]
    use super::fly::fly;
    #[pymodule_export]
    use super::law::{Command, Compensation, LawState};
    #[pymodule_export]
    use super::simulation::{Signals, Simulation};
    #[pymodule_export]
    use super::table::Table;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
