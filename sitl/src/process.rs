//! Child processes of flights and measurements, and what can go wrong with them.

use std::io::{self, BufRead, BufReader, Read};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};

use host_io::tick_log::LogError;
use icd::SimTime;

/// Why a flight over UDP has no result.
#[derive(Debug, thiserror::Error)]
pub enum UdpFlightError {
    /// A process cannot be started, or a file not be written.
    #[error("{what}: {source}")]
    System {
        what: &'static str,
        /// The error of the system.
        source: io::Error,
    },
    /// A process ended with an error.
    #[error("{process} ended ({status}): {message}")]
    Process {
        process: &'static str,
        status: ExitStatus,
        /// The last line of its standard error.
        message: String,
    },
    /// A setup that cannot be written down.
    #[error("the setup cannot be written: {0}")]
    Setup(#[from] postcard::Error),
    /// A process printed something else than expected.
    #[error("{process} said {line:?}")]
    Unexpected { process: &'static str, line: String },
    /// A log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The two logs do not belong together.
    #[error("tick {tick}: the plant says {plant:?}, the autopilot {autopilot:?}")]
    Tick {
        /// Which tick, from 0.
        tick: u64,
        /// Time in the plant's log, if it has that tick.
        plant: Option<SimTime>,
        /// Time in the autopilot's log, if it has that tick.
        autopilot: Option<SimTime>,
    },
}

/// A child process whose standard output is read line by line; killed if it is dropped before its end.
pub(crate) struct Process {
    name: &'static str,
    pub(crate) child: Child,
    output: BufReader<ChildStdout>,
}

impl Process {
    pub(crate) fn start(name: &'static str, mut command: Command) -> Result<Self, UdpFlightError> {
        let failed = |source| UdpFlightError::System { what: "cannot start a process", source };
        // Only warnings: flights come by the dozen.
        command.env("RUST_LOG", "warn");
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(failed)?;
        let output = child.stdout.take();
        let output = output.ok_or_else(|| failed(io::Error::other("no standard output")))?;
        Ok(Self { name, child, output: BufReader::new(output) })
    }

    /// Next line of its standard output.
    pub(crate) fn line(&mut self) -> Result<String, UdpFlightError> {
        let failed = |source| UdpFlightError::System { what: "cannot read from a process", source };
        let mut line = String::new();
        if self.output.read_line(&mut line).map_err(failed)? == 0 {
            return Err(self.failure());
        }
        Ok(line.trim_end().to_owned())
    }

    /// Ends it, and waits for that.
    pub(crate) fn end(mut self) -> Result<(), UdpFlightError> {
        drop(self.child.stdin.take());
        // A process that still prints must not wait for a reader.
        let _ = io::copy(&mut self.output, &mut io::sink());
        let failed = |source| UdpFlightError::System { what: "cannot wait for a process", source };
        if self.child.wait().map_err(failed)?.success() { Ok(()) } else { Err(self.failure()) }
    }

    /// It has ended, or closed its output; this is why.
    pub(crate) fn failure(&mut self) -> UdpFlightError {
        drop(self.child.stdin.take());
        let mut message = String::new();
        if let Some(mut errors) = self.child.stderr.take() {
            // What cannot be read is not known.
            let _ = errors.read_to_string(&mut message);
        }
        let message = message.trim().lines().last().unwrap_or("nothing").to_owned();
        match self.child.wait() {
            Ok(status) => UdpFlightError::Process { process: self.name, status, message },
            Err(source) => UdpFlightError::System { what: "cannot wait for a process", source },
        }
    }

    pub(crate) fn unexpected(&self, line: String) -> UdpFlightError {
        UdpFlightError::Unexpected { process: self.name, line }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It has ended already, or it ends now; either way nothing is left to do.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
