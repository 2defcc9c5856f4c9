//! The process: the request to end, the parent process at the other end of the standard input, and the core of a thread.

use std::io::{BufRead, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::sys::signal::{SigSet, Signal, raise};
use nix::unistd::Pid;

use crate::problem::{At as _, Problem};

/// The request to end the process: set once, read by every loop.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    pub fn new() -> Self {
        Self::default()
    }

    /// Whether the process should end. One relaxed load.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Requests the end of the process.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Makes SIGINT, SIGTERM and SIGQUIT request the end.
    ///
    /// Call it before the process starts any thread: threads inherit which signals they block.
    pub fn on_signals(&self) -> std::io::Result<()> {
        let stop = self.clone();
        on_signals(&ENDS, move |_| stop.request())
    }

    /// The same, and calls `suspend` where a shell asks the process to stop for a while (Ctrl-Z). [`stop_until_continued`] then
    /// does that.
    pub fn on_signals_and_suspension(
        &self,
        suspend: impl Fn() + Send + 'static,
    ) -> std::io::Result<()> {
        let stop = self.clone();
        let all = [&ENDS[..], &[Signal::SIGTSTP]].concat();
        on_signals(&all, move |signal| match signal {
            Signal::SIGTSTP => suspend(),
            _ => stop.request(),
        })
    }

    /// Makes the end of the standard input request the end: a parent that dies for whatever reason closes it.
    pub fn with_parent(&self) -> std::io::Result<()> {
        listen_to_parent(self.clone(), |_| {})
    }
}

/// Signals that request the end.
const ENDS: [Signal; 3] = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGQUIT];

/// Takes these signals on a thread of its own. One thread takes all of them, since each thread blocks those that it does not take.
fn on_signals(signals: &[Signal], take: impl Fn(Signal) + Send + 'static) -> std::io::Result<()> {
    let signals = SigSet::from_iter(signals.iter().copied());
    // Blocked before the thread begins: it inherits the mask, and alone waits for them.
    signals.thread_block()?;
    let wait = move || {
        while let Ok(signal) = signals.wait() {
            take(signal);
        }
    };
    thread::Builder::new().name("signals".to_owned()).spawn(wait)?;
    Ok(())
}

/// Stops this process until it is continued. Returns at once where no shell could continue it: the system does not stop it then.
pub fn stop_until_continued() -> std::io::Result<()> {
    let signals = SigSet::from_iter([Signal::SIGTSTP]);
    signals.thread_unblock()?;
    // To this thread, so that the one that waits for the signal does not take it.
    let stopped = raise(Signal::SIGTSTP);
    signals.thread_block()?;
    Ok(stopped?)
}

/// Makes a write beyond the limit of file sizes (`ulimit -f`) an error, as on a full disk, and not the end of the process.
///
/// Call it before the process starts any thread: threads inherit which signals they block.
pub fn take_size_limit_as_error() {
    let signals = SigSet::from_iter([Signal::SIGXFSZ]);
    // A mask of known signals is always accepted.
    let _ = signals.thread_block();
}

/// Longest line, bytes; a longer one is split.
const LINE_MAX: u64 = 256;

/// Reads the lines that the parent process writes to the standard input, on a separate thread. The end of the input requests the
/// end of the process: a parent that dies for whatever reason closes it.
pub fn listen_to_parent(
    stop: Stop,
    on_line: impl FnMut(&str) + Send + 'static,
) -> std::io::Result<()> {
    let take = move || {
        each_line(std::io::stdin().lock(), on_line);
        stop.request();
    };
    thread::Builder::new().name("parent".to_owned()).spawn(take)?;
    Ok(())
}

/// Passes on each line without its line end, until the input ends.
fn each_line(mut input: impl BufRead, mut on_line: impl FnMut(&str)) {
    let mut line = Vec::new();
    loop {
        match input.by_ref().take(LINE_MAX).read_until(b'\n', &mut line) {
            // An input that cannot be read has no more requests, like one that has ended.
            Ok(0) | Err(_) => return,
            Ok(_) => {
                // Bytes that are not text cannot be a request; a warning shows them as replacement characters.
                on_line(String::from_utf8_lossy(&line).trim());
                line.clear();
            }
        }
    }
}

/// The calling thread, for the scheduler calls.
const THIS_THREAD: Pid = Pid::from_raw(0);

/// Highest number of a core that the system's masks have.
pub const CORE_MAX: usize = 1023;

/// Keeps the calling thread on one core. Threads that it starts later inherit that; others do not.
pub fn pin_this_thread(cpu: usize) -> Result<(), Problem> {
    let mut set = CpuSet::new();
    let pinned = set.set(cpu).and_then(|()| sched_setaffinity(THIS_THREAD, &set));
    pinned.at(format!("cannot run on core {cpu}"))
}

/// The cores that this thread may run on, in ascending order; empty if the system does not report them.
pub fn allowed_cores() -> Vec<usize> {
    let Ok(set) = sched_getaffinity(THIS_THREAD) else { return Vec::new() };
    (0..CpuSet::count()).filter(|cpu| set.is_set(*cpu) == Ok(true)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(input: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        each_line(input, |line| lines.push(line.to_owned()));
        lines
    }

    #[test]
    fn lines_come_without_their_end_and_the_last_one_needs_none() {
        assert_eq!(lines(b"pause\nstep 3\r\n\nrun"), ["pause", "step 3", "", "run"]);
        assert_eq!(lines(b""), Vec::<String>::new());
        assert_eq!(lines(b"\xff\xfe\n"), ["\u{fffd}\u{fffd}"]);
    }

    #[test]
    fn an_endless_line_does_not_grow() {
        let lines = lines(&[b'x'; 1_000]);
        assert_eq!(lines.len(), 4);
        assert!(lines.iter().all(|line| line.len() as u64 <= LINE_MAX));
    }

    #[test]
    fn a_pinned_thread_has_one_core_and_its_parent_keeps_all() {
        let before = allowed_cores();
        let last = *before.last().unwrap();
        let inside = thread::spawn(move || pin_this_thread(last).map(|()| allowed_cores()));
        assert_eq!(inside.join().unwrap(), Ok(vec![last]));
        assert_eq!(allowed_cores(), before);
    }

    #[test]
    fn a_missing_core_is_named_in_the_error() {
        let error = pin_this_thread(100_000).unwrap_err();
        assert!(error.to_string().contains("core 100000"), "{error}");
    }
}
