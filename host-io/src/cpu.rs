//! Which core a thread runs on.

use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;

/// The calling thread, for the scheduler calls.
const THIS_THREAD: Pid = Pid::from_raw(0);

/// The system refuses to pin a thread to a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cannot run on core {cpu}: {source}")]
pub struct PinError {
    /// The core.
    pub cpu: usize,
    /// What the system says.
    pub source: nix::Error,
}

/// Keeps the calling thread on one core. Threads that it starts later inherit that; others do not.
///
/// # Errors
/// [`PinError`] if there is no such core, or this process may not use it.
pub fn pin_this_thread(cpu: usize) -> Result<(), PinError> {
    let mut set = CpuSet::new();
    set.set(cpu)
        .and_then(|()| sched_setaffinity(THIS_THREAD, &set))
        .map_err(|source| PinError { cpu, source })
}

/// The cores that this thread may run on, in ascending order; empty if the system does not say.
#[must_use]
pub fn allowed() -> Vec<usize> {
    let Ok(set) = sched_getaffinity(THIS_THREAD) else { return Vec::new() };
    (0..CpuSet::count()).filter(|cpu| set.is_set(*cpu) == Ok(true)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pinned_thread_has_one_core_and_its_maker_keeps_all() {
        let before = allowed();
        let last = *before.last().unwrap();
        let inside = std::thread::spawn(move || pin_this_thread(last).map(|()| allowed()));
        assert_eq!(inside.join().unwrap(), Ok(vec![last]));
        assert_eq!(allowed(), before);
    }

    #[test]
    fn a_core_that_is_not_there_is_named() {
        let error = pin_this_thread(100_000).unwrap_err();
        assert!(error.to_string().contains("core 100000"), "{error}");
    }
}
