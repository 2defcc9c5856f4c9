//! `sitl` without a subcommand: starts the two processes, shows the flight, ends both.
//!
//! Where there is a terminal, keys let simulation time stand still, step, run, and run at another speed: they
//! become lines on the plant's standard input.
//! The children end when their standard input ends, so they do not outlive this process, however it ends.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::SocketAddr;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{self, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use autopilot::io::status::{Listening, PlantState, StatusLine};
use host_io::problem::{At as _, Problem, problem};
use host_io::process::stop_until_continued;
use host_io::{Stop, clock};
use nix::sys::signal::{Signal, kill, killpg};
use nix::unistd::{Pid, getpgrp};
use plant_sim::io::PlantLine;

use crate::arrangement::{self, Arrangement};

mod args;
mod keys;
mod screen;

pub use args::LaunchArgs;
use keys::{Key, Keys, PaceState};
use screen::Screen;

/// How often the children are looked after.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Time for the autopilot to say where it listens.
const START_MAX: Duration = Duration::from_secs(10);
/// Time for the autopilot to notice that the plant has ended: it waits a second for a packet.
const NOTICE_MAX: Duration = Duration::from_secs(3);
/// Time for a child to end on request.
const END_MAX: Duration = Duration::from_secs(2);

/// Place of what the system refuses: signals or output.
const HERE: &str = "sitl";

/// Flies until the operator ends it, or the scenario's `duration_s`. `program` is the `sitl` executable.
///
/// Call it before the process starts any thread: it changes how the process takes signals.
pub fn run(args: &LaunchArgs, program: &Path) -> Result<(), Problem> {
    let stop = Stop::new();
    let (sender, receiver) = sync_channel(REPORTS_MAX);
    let reports = ChildReports { sender: ReportSender(sender), receiver };
    let suspensions = reports.sender.clone();
    let suspend = move || {
        suspensions.send(ChildReport::Suspended);
    };
    // Before any thread starts: one that did not block these signals would take them in the usual
    // way.
    stop.on_signals_and_suspension(suspend).at(HERE)?;
    let options = args.check()?;
    let mut screen = Screen::new(args.pace(), options.advice.clone());
    for note in options.note.iter().chain(&options.inherited) {
        screen.message(note).at(HERE)?;
    }
    let arrangement = if args.is_as_fast_as_possible() {
        // Before the two processes start, which would disturb the measurement.
        let fastest = arrangement::fastest(program);
        let note = format!(
            "fastest here: {}, {:.0} bare round trips/s",
            fastest.arrangement, fastest.round_trips_per_s
        );
        screen.message(&note).at(HERE)?;
        fastest.arrangement
    } else {
        Arrangement::UNPINNED
    };
    // The terminal is switched back when this goes, however this function ends.
    let keys = {
        let sender = reports.sender.clone();
        Keys::listen(move |key| sender.send(ChildReport::Pressed(key))).at(HERE)?
    };
    let mut words = vec!["autopilot".to_owned(), "--status".to_owned()];
    words.extend(options.autopilot);
    words.extend(arrangement.autopilot.options());
    // The autopilot is first, because the plant is told the address at which it listens.
    let autopilot = Child::start("autopilot", program, &words, &reports)?;
    let start_plant = |plant_link: SocketAddr| {
        let mut words = vec!["plant-sim".to_owned(), "--status".to_owned()];
        words.extend(["--autopilot".to_owned(), plant_link.to_string()]);
        words.extend(options.plant.clone());
        words.extend(arrangement.plant.options());
        Child::start("plant-sim", program, &words, &reports)
    };
    let mut flight = LiveFlight { autopilot, plant: None, screen, stop: &stop, keys };
    let result = flight.watch(&reports, start_plant);
    // Without `?` before it: children and screen are ended in order after an error too.
    flight.end(program);
    result
}

/// Both processes and the operator's screen and keys.
struct LiveFlight<'a> {
    autopilot: Child,
    /// Started once the autopilot listens.
    plant: Option<Child>,
    screen: Screen,
    stop: &'a Stop,
    keys: Option<Keys>,
}

impl LiveFlight<'_> {
    /// Starts the plant once the autopilot listens, and watches both until something ends the flight.
    fn watch(
        &mut self,
        reports: &ChildReports,
        start_plant: impl Fn(SocketAddr) -> Result<Child, Problem>,
    ) -> Result<(), Problem> {
        let began = clock::now();
        while !self.stop.is_requested() {
            if let Some(report) = reports.next(LOOK_EVERY) {
                self.take(report, &start_plant)?;
            }
            if let Some(keys) = &self.keys {
                keys.keep();
            }
            self.screen.refresh(clock::now()).at(HERE)?;
            if let Some((_, why)) = self.autopilot.ended(reports, &mut self.screen)? {
                return Err(why);
            }
            if let Some(plant) = self.plant.as_mut()
                && let Some((status, why)) = plant.ended(reports, &mut self.screen)?
            {
                self.await_notice(reports);
                // The plant ends in order at the scenario's duration_s.
                return if status.success() { Ok(()) } else { Err(why) };
            }
            if self.plant.is_none() && clock::now() - began > START_MAX {
                return Err(problem!("the autopilot has not started after {START_MAX:?}"));
            }
        }
        Ok(())
    }

    /// The plant has ended by itself: the autopilot runs on until it has noticed, so that it can inform the ground
    /// stations.
    fn await_notice(&self, reports: &ChildReports) {
        let deadline = clock::now() + NOTICE_MAX;
        while clock::now() < deadline && !self.stop.is_requested() {
            if let Some(ChildReport::Status(StatusLine::Flight(flight))) = reports.next(LOOK_EVERY)
                && flight.plant == PlantState::Lost
            {
                return;
            }
        }
    }

    fn take(
        &mut self,
        report: ChildReport,
        start_plant: impl Fn(SocketAddr) -> Result<Child, Problem>,
    ) -> Result<(), Problem> {
        match report {
            ChildReport::Listening { plant_link, ground_stations } => {
                self.plant = Some(start_plant(plant_link)?);
                self.screen.introduce(&ground_stations, self.keys.is_some()).at(HERE)?;
            }
            ChildReport::Status(status) => self.screen.status(status, clock::now()).at(HERE)?,
            ChildReport::PaceState(pace) => self.screen.set_pace(pace),
            ChildReport::Pressed(Key::Quit) => self.stop.request(),
            // To the whole job, as the terminal does where Ctrl-Z is no key; this process takes it as the report below.
            ChildReport::Pressed(Key::Suspend) => {
                killpg(getpgrp(), Signal::SIGTSTP).map_err(io::Error::from).at(HERE)?;
            }
            ChildReport::Suspended => self.suspend()?,
            ChildReport::Pressed(key) => self.press(key),
            ChildReport::Line { process, line } => {
                let message = format!("{process}: {}", line.trim_start());
                self.screen.message(&message).at(HERE)?;
                for child in self.plant.iter_mut().chain([&mut self.autopilot]) {
                    child.remember(process, &line);
                }
            }
        }
        Ok(())
    }

    /// Gives the terminal back and stops both children and this process, until the shell lets the job go on.
    fn suspend(&mut self) -> Result<(), Problem> {
        self.screen.leave();
        if let Some(keys) = &self.keys {
            // The shell expects the terminal as it was, before the job stops.
            keys.restore();
        }
        // Each child has a process group of its own, so no signal of the terminal reaches it.
        let signal_all = |signal| {
            // The plant is continued before the autopilot, which waits for its packets.
            for child in self.plant.iter().chain([&self.autopilot]) {
                child.signal(signal);
            }
        };
        signal_all(Signal::SIGSTOP);
        let stopped = stop_until_continued();
        signal_all(Signal::SIGCONT);
        if let Some(keys) = &self.keys {
            keys.keep();
        }
        stopped.at(HERE)
    }

    /// A key that is about time: what it leads to is shown at once, and again when the plant says so.
    fn press(&mut self, key: Key) {
        let Some(plant) = self.plant.as_mut() else { return };
        let mut pace = self.screen.pace();
        if let Some(command) = pace.command(key, self.screen.achieved()) {
            plant.send_line(&command);
            self.screen.set_pace(pace);
        }
    }

    fn end(mut self, program: &Path) {
        let deadline: Instant = clock::now() + END_MAX;
        for child in self.plant.iter_mut().chain([&mut self.autopilot]) {
            child.end(deadline);
        }
        // The terminal is in lines again before lines are written.
        drop(self.keys.take());
        // As the operator has typed it, unless an interpreter started the program.
        let typed = std::env::args_os().next().map(PathBuf::from);
        let typed = typed.filter(|typed| typed.file_name() == program.file_name());
        // Where the operator cannot read any more, nobody misses it.
        let _ = self.screen.end(typed.as_deref().unwrap_or(program));
    }
}

/// Lines that wait to be shown.
const REPORTS_MAX: usize = 256;
/// How often an ending child is looked at.
const END_LOOK_EVERY: Duration = Duration::from_millis(5);
/// Time for the last lines of a child that has ended.
const LAST_LINES: Duration = Duration::from_millis(200);

/// What a child reports.
#[derive(Debug)]
enum ChildReport {
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
struct ChildReports {
    sender: ReportSender,
    receiver: Receiver<ChildReport>,
}

impl ChildReports {
    /// Next report; `None` if none comes in time.
    fn next(&self, timeout: Duration) -> Option<ChildReport> {
        self.receiver.recv_timeout(timeout).ok()
    }
}

/// For another thread that has something to report.
#[derive(Clone)]
struct ReportSender(SyncSender<ChildReport>);

impl ReportSender {
    /// Never waits: a full channel means that the operator's screen has stopped, and drops the report.
    /// False if nobody reads any more.
    fn send(&self, report: ChildReport) -> bool {
        !matches!(self.0.try_send(report), Err(TrySendError::Disconnected(_)))
    }
}

/// A running process; killed if it is dropped before its end.
struct Child {
    name: &'static str,
    process: process::Child,
    /// Open as long as the child should run.
    input: Option<ChildStdin>,
    last_line: String,
}

impl Child {
    /// Starts `program` with these options. Its standard output is status, its standard error is for people.
    fn start(
        name: &'static str,
        program: &Path,
        words: &[String],
        reports: &ChildReports,
    ) -> Result<Self, Problem> {
        let failed = format!("cannot start {name}");
        let mut process = Command::new(program)
            .args(words)
            .arg("--with-parent")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // Ctrl-C reaches the launcher only, which then ends both in order.
            .process_group(0)
            .spawn()
            .at(&failed)?;
        let input = process.stdin.take();
        if let Some(output) = process.stdout.take() {
            forward(output, reports.sender.clone(), move |line| status(name, line)).at(&failed)?;
        }
        if let Some(errors) = process.stderr.take() {
            let line_of = move |line| ChildReport::Line { process: name, line };
            forward(errors, reports.sender.clone(), line_of).at(&failed)?;
        }
        Ok(Self { name, process, input, last_line: "nothing".to_owned() })
    }

    /// Says a line to it. One that has ended is noticed elsewhere.
    fn send_line(&mut self, line: &str) {
        if let Some(input) = self.input.as_mut() {
            let _ = writeln!(input, "{line}").and_then(|()| input.flush());
        }
    }

    /// Sends it a signal. One that has ended is noticed elsewhere.
    fn signal(&self, signal: Signal) {
        let _ = kill(Pid::from_raw(self.process.id().cast_signed()), signal);
    }

    /// Remembers its last line.
    fn remember(&mut self, process: &str, line: &str) {
        if process == self.name {
            line.trim().clone_into(&mut self.last_line);
        }
    }

    /// If the process has ended: how and why, after its last lines have been shown.
    fn ended(
        &mut self,
        reports: &ChildReports,
        screen: &mut Screen,
    ) -> Result<Option<(ExitStatus, Problem)>, Problem> {
        let Some(status) = self.process.try_wait().at(HERE)? else { return Ok(None) };
        // The other child may go on talking, and nothing reports the last line of this one: only the
        // time ends this wait.
        let deadline = clock::now() + LAST_LINES;
        while clock::now() < deadline {
            if let Some(ChildReport::Line { process, line }) = reports.next(LAST_LINES) {
                self.remember(process, &line);
                // Where the operator cannot read any more, the error below still says why.
                let _ = screen.message(&format!("{process}: {line}"));
            }
        }
        let Self { name, last_line, .. } = self;
        let why = problem!("{name} ended ({status}); the last thing it said: {last_line}");
        Ok(Some((status, why)))
    }

    /// Tells the process to end, and makes sure that it has by `deadline`.
    fn end(&mut self, deadline: Instant) {
        self.input = None;
        while let Ok(None) = self.process.try_wait() {
            if clock::now() > deadline {
                // `drop` kills it.
                return;
            }
            clock::sleep(END_LOOK_EVERY);
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

fn status(process: &'static str, line: String) -> ChildReport {
    match serde_json::from_str(&line) {
        Ok(StatusLine::Listening { plant_link, ground_stations }) => {
            ChildReport::Listening { plant_link, ground_stations }
        }
        Ok(status) => ChildReport::Status(status),
        Err(_) => match serde_json::from_str(&line) {
            Ok(PlantLine::Pace { paused, speed, .. }) => {
                ChildReport::PaceState(PaceState { paused, speed })
            }
            Err(_) => ChildReport::Line { process, line },
        },
    }
}

fn forward(
    stream: impl Read + Send + 'static,
    reports: ReportSender,
    report: impl Fn(String) -> ChildReport + Send + 'static,
) -> io::Result<()> {
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
