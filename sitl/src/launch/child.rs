//! One of the two processes, as the launcher sees it.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::SocketAddr;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{self, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use autopilot::io::status::Listening;
use autopilot::io::status::StatusLine;
use host_io::clock;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plant_sim::io::PlantLine;

use super::LaunchError;
use super::keys::{Key, PaceState};
use super::screen::Screen;

/// Lines that wait to be shown.
const REPORTS_MAX: usize = 256;
/// How often an ending child is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// Time for the last lines of a child that has ended.
const LAST_LINES: Duration = Duration::from_millis(200);

/// What a child reports.
#[derive(Debug)]
pub(super) enum Report {
    /// The autopilot waits for plants and ground stations.
    Listening { plant_link: SocketAddr, ground_stations: Listening },
    /// The flight goes on.
    Status(StatusLine),
    /// Simulation time passes like this from here on.
    PaceState(PaceState),
    /// The shell asks the job to stop for a while.
    Suspended,
    /// The operator has pressed a key.
    Pressed(Key),
    /// A line for the operator.
    Line { process: &'static str, line: String },
}

/// Where the reports of both children arrive.
pub(super) struct Reports {
    sender: SyncSender<Report>,
    receiver: Receiver<Report>,
}

impl Reports {
    pub(super) fn channel() -> Self {
        let (sender, receiver) = sync_channel(REPORTS_MAX);
        Self { sender, receiver }
    }

    /// For another thread that has something to report.
    pub(super) fn sender(&self) -> ReportSender {
        ReportSender(self.sender.clone())
    }

    /// Next report; `None` if none comes in time.
    pub(super) fn next(&self, timeout: Duration) -> Option<Report> {
        self.receiver.recv_timeout(timeout).ok()
    }
}

pub(super) struct ReportSender(SyncSender<Report>);

impl ReportSender {
    /// Never waits: a full channel means that the operator's screen has stopped, and drops the report.
    /// False if nobody reads any more.
    pub(super) fn send(&self, report: Report) -> bool {
        !matches!(self.0.try_send(report), Err(TrySendError::Disconnected(_)))
    }
}

/// A running process; killed if it is dropped before its end.
pub(super) struct Child {
    name: &'static str,
    process: process::Child,
    /// Open as long as the child should run.
    input: Option<ChildStdin>,
    last_line: String,
}

impl Child {
    /// Starts `program` with these options. Its standard output is status, its standard error is for people.
    pub(super) fn start(
        name: &'static str,
        program: &Path,
        words: &[String],
        reports: &Reports,
    ) -> Result<Self, LaunchError> {
        let failed = |source| LaunchError::Start { process: name, source };
        let mut process = Command::new(program)
            .args(words)
            .arg("--with-parent")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // Ctrl-C reaches the launcher only, which then ends both in order.
            .process_group(0)
            .spawn()
            .map_err(failed)?;
        let input = process.stdin.take();
        if let Some(output) = process.stdout.take() {
            forward(output, reports.sender(), move |line| status(name, line)).map_err(failed)?;
        }
        if let Some(errors) = process.stderr.take() {
            let line_of = move |line| Report::Line { process: name, line };
            forward(errors, reports.sender(), line_of).map_err(failed)?;
        }
        Ok(Self { name, process, input, last_line: "nothing".to_owned() })
    }

    /// Says a line to it. One that has ended is noticed elsewhere.
    pub(super) fn send_line(&mut self, line: &str) {
        if let Some(input) = self.input.as_mut() {
            let _ = writeln!(input, "{line}").and_then(|()| input.flush());
        }
    }

    /// Sends it a signal. One that has ended is noticed elsewhere.
    pub(super) fn signal(&self, signal: Signal) {
        let _ = kill(Pid::from_raw(self.process.id().cast_signed()), signal);
    }

    /// Remembers its last line.
    pub(super) fn remember(&mut self, process: &str, line: &str) {
        if process == self.name {
            line.trim().clone_into(&mut self.last_line);
        }
    }

    /// If the process has ended: why, after its last lines have been shown.
    pub(super) fn ended(&mut self, reports: &Reports, screen: &mut Screen) -> Option<LaunchError> {
        let status = match self.process.try_wait() {
            Ok(None) => return None,
            Ok(Some(status)) => status,
            Err(source) => return Some(source.into()),
        };
        // The other child may go on talking.
        let deadline = clock::now() + LAST_LINES;
        while clock::now() < deadline {
            if let Some(Report::Line { process, line }) = reports.next(LAST_LINES) {
                self.remember(process, &line);
                // Where the operator cannot read any more, the error below still says why.
                let _ = screen.message(&format!("{process}: {line}"));
            }
        }
        let (process, message) = (self.name, std::mem::take(&mut self.last_line));
        Some(LaunchError::Ended { process, status, message })
    }

    /// Tells the process to end, and makes sure that it has by `deadline`.
    pub(super) fn end(&mut self, deadline: Instant) {
        self.input = None;
        while let Ok(None) = self.process.try_wait() {
            if clock::now() > deadline {
                return;
            }
            clock::sleep(LOOK_EVERY);
        }
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        // It has ended already, or it ends now; either way nothing is left to do.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn status(process: &'static str, line: String) -> Report {
    match serde_json::from_str(&line) {
        Ok(StatusLine::Listening { plant_link, ground_stations }) => {
            Report::Listening { plant_link, ground_stations }
        }
        Ok(status) => Report::Status(status),
        Err(_) => match serde_json::from_str(&line) {
            Ok(PlantLine::Pace { paused, speed }) => Report::PaceState(PaceState { paused, speed }),
            Err(_) => Report::Line { process, line },
        },
    }
}

fn forward(
    stream: impl Read + Send + 'static,
    reports: ReportSender,
    report: impl Fn(String) -> Report + Send + 'static,
) -> std::io::Result<()> {
    let read = move || {
        for line in BufReader::new(stream).lines().map_while(Result::ok) {
            // Better lose lines than stop the child.
            if !reports.send(report(line)) {
                return;
            }
        }
    };
    thread::Builder::new().name("child".to_owned()).spawn(read).map(|_| ())
}
