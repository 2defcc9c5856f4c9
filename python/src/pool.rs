//! Threads for many flights at once, which outlive no fork: a child has none of its parent's threads, and would wait for them.

use std::mem;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The threads of the process with this number.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// The threads of this process, one a core.
pub fn pool() -> PyResult<Arc<ThreadPool>> {
    let mut held = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let here = process::id();
    if let Some((of, pool)) = held.as_ref().filter(|(of, _)| *of == here) {
        debug_assert_eq!(*of, here);
        return Ok(pool.clone());
    }
    // Dropped, it would wait for the threads of the parent.
    mem::forget(held.take());
    let built = of_threads(0)?;
    Ok(held.insert((here, Arc::new(built))).1.clone())
}

/// So many threads; 0 for one a core.
pub fn of_threads(count: usize) -> PyResult<ThreadPool> {
    let built = ThreadPoolBuilder::new().num_threads(count).build();
    built.map_err(|error| PyRuntimeError::new_err(error.to_string()))
}
