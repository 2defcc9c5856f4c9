//! `sitl` without a subcommand: starts the two processes, shows the flight, ends both.
//!
//! Where there is a terminal, keys let simulation time stand still, step, run, and run at another speed: they
//! become lines on the plant's standard input.
//! The children end when their standard input ends, so they do not outlive this process, however it ends.

use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

use autopilot::io::status::{PlantState, StatusLine};
use autopilot::run::RunError;
use host_io::{Stop, clock, process};
use nix::sys::signal::{Signal, killpg};
use nix::unistd::getpgrp;

use crate::arrangement::{self, Arrangement};

mod args;
mod child;
mod keys;
mod screen;

pub use args::LaunchArgs;
use child::{Child, Report, Reports};
use keys::{Key, Keys};
use screen::Screen;

/// How often the children are looked after.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Time for the autopilot to say where it listens.
const START_MAX: Duration = Duration::from_secs(10);
/// Time for the autopilot to notice that the plant has ended: it waits a second for a packet.
const NOTICE_MAX: Duration = Duration::from_secs(3);
/// Time for a child to end on request.
const END_MAX: Duration = Duration::from_secs(2);

/// Why the flight could not go on.
#[derive(Debug, thiserror::Error)]
pub enum LaunchError {
    /// An option or a file that it names is wrong.
    #[error(transparent)]
    Option(#[from] RunError),
    /// A child cannot be started.
    #[error("cannot start {process}: {source}")]
    Start {
        process: &'static str,
        /// The error of the system.
        source: io::Error,
    },
    #[error("{process} ended ({status}); the last thing it said: {message}")]
    Ended { process: &'static str, status: ExitStatus, message: String },
    /// The autopilot does not say where it listens.
    #[error("the autopilot has not started after {START_MAX:?}")]
    Silent,
    /// The system refuses signals or output.
    #[error("sitl: {0}")]
    System(#[from] io::Error),
}

/// Flies until the operator ends it, or the scenario's `duration_s`. `program` is the `sitl` executable.
///
/// Call it before the process starts any thread: it changes how the process takes signals.
pub fn run(args: &LaunchArgs, program: &Path) -> Result<(), LaunchError> {
    let stop = Stop::new();
    let reports = Reports::channel();
    let suspensions = reports.sender();
    stop.on_signals_and_suspension(move || {
        suspensions.send(Report::Suspended);
    })?;
    let options = args.check()?;
    let mut screen = Screen::new(args.pace(), options.advice.clone());
    if let Some(note) = &options.note {
        screen.message(note)?;
    }
    let arrangement = if args.is_as_fast_as_possible() {
        let fastest = arrangement::fastest(program);
        screen.message(&format!(
            "fastest here: {}, {:.0} bare round trips/s",
            fastest.arrangement, fastest.round_trips_per_s
        ))?;
        fastest.arrangement
    } else {
        Arrangement::UNPINNED
    };
    // The terminal is switched back when this goes, however this function ends.
    let keys = {
        let sender = reports.sender();
        Keys::listen(move |key| sender.send(Report::Pressed(key)))?
    };
    let mut words = vec!["autopilot".to_owned(), "--status".to_owned()];
    words.extend(options.autopilot);
    words.extend(arrangement.autopilot.options());
    let autopilot = Child::start("autopilot", program, &words, &reports)?;
    let start_plant = |plant_link: SocketAddr| {
        let mut words = vec!["plant-sim".to_owned(), "--status".to_owned()];
        words.extend(["--autopilot".to_owned(), plant_link.to_string()]);
        words.extend(options.plant.clone());
        words.extend(arrangement.plant.options());
        Child::start("plant-sim", program, &words, &reports)
    };
    let mut flight = Flight { autopilot, plant: None, screen, stop: &stop, keys };
    let result = flight.watch(&reports, start_plant);
    flight.end();
    result
}

/// Both processes and the operator's screen and keys.
struct Flight<'a> {
    autopilot: Child,
    /// Started once the autopilot listens.
    plant: Option<Child>,
    screen: Screen,
    stop: &'a Stop,
    keys: Option<Keys>,
}

impl Flight<'_> {
    /// Starts the plant once the autopilot listens, and watches both until something ends the flight.
    fn watch(
        &mut self,
        reports: &Reports,
        start_plant: impl Fn(SocketAddr) -> Result<Child, LaunchError>,
    ) -> Result<(), LaunchError> {
        let began = clock::now();
        while !self.stop.is_requested() {
            if let Some(report) = reports.next(LOOK_EVERY) {
                self.take(report, &start_plant)?;
            }
            if let Some(keys) = &self.keys {
                keys.keep();
            }
            self.screen.refresh(clock::now())?;
            if let Some(error) = self.autopilot.ended(reports, &mut self.screen) {
                return Err(error);
            }
            let plant = self.plant.as_mut();
            if let Some(error) = plant.and_then(|plant| plant.ended(reports, &mut self.screen)) {
                self.await_notice(reports);
                // The plant ends in order at the scenario's duration_s.
                let LaunchError::Ended { status, .. } = &error else { return Err(error) };
                return if status.success() { Ok(()) } else { Err(error) };
            }
            if self.plant.is_none() && clock::now() - began > START_MAX {
                return Err(LaunchError::Silent);
            }
        }
        Ok(())
    }

    /// The plant has ended by itself: the autopilot runs on until it has noticed, so that it can inform the ground
    /// stations.
    fn await_notice(&self, reports: &Reports) {
        let deadline = clock::now() + NOTICE_MAX;
        while clock::now() < deadline && !self.stop.is_requested() {
            if let Some(Report::Status(StatusLine::Flight(flight))) = reports.next(LOOK_EVERY)
                && flight.plant == PlantState::Lost
            {
                return;
            }
        }
    }

    fn take(
        &mut self,
        report: Report,
        start_plant: impl Fn(SocketAddr) -> Result<Child, LaunchError>,
    ) -> Result<(), LaunchError> {
        match report {
            Report::Listening { plant_link, ground_stations } => {
                self.plant = Some(start_plant(plant_link)?);
                self.screen.introduce(&ground_stations, self.keys.is_some())?;
            }
            Report::Status(status) => self.screen.status(status, clock::now())?,
            Report::PaceState(pace) => self.screen.set_pace(pace),
            Report::Pressed(Key::Quit) => self.stop.request(),
            // To the whole job, as the terminal does where Ctrl-Z is no key; this process takes it as the report below.
            Report::Pressed(Key::Suspend) => {
                killpg(getpgrp(), Signal::SIGTSTP).map_err(io::Error::from)?;
            }
            Report::Suspended => self.suspend()?,
            Report::Pressed(key) => self.press(key),
            Report::Line { process, line } => {
                self.screen.message(&format!("{process}: {}", line.trim_start()))?;
                for child in self.plant.iter_mut().chain([&mut self.autopilot]) {
                    child.remember(process, &line);
                }
            }
        }
        Ok(())
    }

    /// Gives the terminal back and stops both children and this process, until the shell lets the job go on.
    fn suspend(&mut self) -> Result<(), LaunchError> {
        self.screen.leave();
        if let Some(keys) = &self.keys {
            keys.restore();
        }
        let signal_all = |signal| {
            // The plant is continued before the autopilot, which waits for its packets.
            for child in self.plant.iter().chain([&self.autopilot]) {
                child.signal(signal);
            }
        };
        signal_all(Signal::SIGSTOP);
        let stopped = process::stop_until_continued();
        signal_all(Signal::SIGCONT);
        if let Some(keys) = &self.keys {
            keys.keep();
        }
        Ok(stopped?)
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

    fn end(mut self) {
        let deadline: Instant = clock::now() + END_MAX;
        for child in self.plant.iter_mut().chain([&mut self.autopilot]) {
            child.end(deadline);
        }
        // The terminal is in lines again before lines are written.
        drop(self.keys.take());
        let program = std::env::args_os().next().unwrap_or_else(|| "sitl".into());
        // Where the operator cannot read any more, nobody misses it.
        let _ = self.screen.end(Path::new(&program));
    }
}
