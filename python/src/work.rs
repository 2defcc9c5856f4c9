//! Work of the program under Python: with the interpreter's lock released, and ended by Ctrl-C.

use std::any::Any;
use std::thread;
use std::time::Duration;

use host_io::problem::Problem;
use lab_report::runner::{self, Interrupted};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;

use crate::law::PythonLaw;
use crate::options::refused;
use crate::pool::{of_threads, pool};

/// How often Ctrl-C is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Does `work` on all cores; with laws of Python on one, because there it would wait for the interpreter's lock on the others.
pub fn run<T: Send>(
    py: Python<'_>,
    laws: &[PythonLaw],
    work: impl FnOnce() -> Result<T, Problem> + Send,
) -> PyResult<T> {
    let ended = if laws.is_empty() {
        let pool = pool()?;
        on_thread(py, move || pool.install(work))
    } else {
        let alone = of_threads(1)?;
        on_thread(py, move || alone.install(work))
    };
    match laws.iter().find_map(PythonLaw::raised) {
        Some(raised) => Err(raised),
        None => ended?.map_err(refused),
    }
}

/// Does `work` on a thread of its own while this one looks for signals, which Python gives to its main thread alone.
fn on_thread<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Problem> + Send,
) -> PyResult<Result<T, Problem>> {
    let _active = runner::Interruptible::begin();
    let mut interrupted = None;
    let ended = thread::scope(|scope| {
        let caller = thread::current();
        let worker = scope.spawn(move || {
            let _end = Unpark(caller);
            work()
        });
        while !worker.is_finished() {
            py.detach(|| thread::park_timeout(LOOK_EVERY));
            if let Err(signal) = py.check_signals() {
                interrupted.get_or_insert(signal);
                runner::interrupt();
            }
        }
        py.detach(|| worker.join())
    });
    match (ended, interrupted) {
        (_, Some(signal)) => Err(signal),
        (Ok(result), None) => Ok(result),
        (Err(panic), None) => Err(of_panic(&*panic)),
    }
}

/// Wakes the caller however the work ends.
struct Unpark(thread::Thread);

impl Drop for Unpark {
    fn drop(&mut self) {
        self.0.unpark();
    }
}

fn of_panic(panic: &(dyn Any + Send)) -> PyErr {
    if panic.is::<Interrupted>() {
        return PyKeyboardInterrupt::new_err("interrupted");
    }
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    PyRuntimeError::new_err(format!("an error of the program: {}", text.unwrap_or("unknown")))
}
