//! The request to end: SIGINT, SIGTERM, SIGQUIT, or the end of the standard input that a parent holds open.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use nix::sys::signal::{SigSet, Signal};

/// Set once, looked at everywhere.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Nobody has asked yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Whether the process should end. One relaxed load.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Asks the process to end.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// SIGINT, SIGTERM and SIGQUIT become requests from here on.
    ///
    /// Call it before any other thread is started: threads inherit which signals they leave alone.
    ///
    /// # Errors
    /// What the system says, if it refuses.
    pub fn on_signals(&self) -> std::io::Result<()> {
        let mut signals = SigSet::empty();
        signals.add(Signal::SIGINT);
        signals.add(Signal::SIGTERM);
        signals.add(Signal::SIGQUIT);
        signals.thread_block()?;
        let stop = self.clone();
        let wait = move || {
            while signals.wait().is_ok() {
                stop.request();
            }
        };
        thread::Builder::new().name("signals".to_owned()).spawn(wait)?;
        Ok(())
    }

    /// The end of the standard input becomes a request: a parent that dies, however it dies, closes it.
    ///
    /// # Errors
    /// What the system says, if it refuses a thread.
    pub fn with_parent(&self) -> std::io::Result<()> {
        crate::parent::listen(self.clone(), |_| {})
    }
}
