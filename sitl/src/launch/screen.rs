//! What the operator sees: on a terminal one screen that follows the flight, elsewhere plain lines.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use autopilot::io::status::Listening;
use autopilot::io::status::{PlantState, StatusLine};

use super::keys;
use super::pace::Passing;

mod connect;
mod plain;
mod terminal;
mod view;
mod wrap;

use terminal::Terminal;
use view::State;

/// Time between two lines where the output is no terminal.
const PLAIN_EVERY: Duration = Duration::from_secs(10);
/// Time between two drawings of the screen.
const DRAW_EVERY: Duration = Duration::from_millis(50);
/// Warnings that are repeated as plain lines after the flight.
const WARNINGS_MAX: usize = 10;

/// The operator's screen, or the file that stands for it.
pub(super) struct Screen {
    state: State,
    /// `None`: plain lines.
    terminal: Option<Terminal>,
    drawn: Option<Instant>,
    /// The last plain line, and when that was.
    shown: Option<(Instant, Change)>,
    /// Wall time and simulation time when the speed was measured last.
    measured: Option<(Instant, f64)>,
    /// Log of the present flight.
    log: Option<PathBuf>,
}

/// What makes a plain line worth printing before its time.
#[derive(Clone, PartialEq)]
struct Change {
    compensator_active: bool,
    plant: PlantState,
    passing: Passing,
    faults: Vec<String>,
}

impl Screen {
    pub(super) fn new(passing: Passing) -> Self {
        let (state, terminal) = (State::new(passing), Terminal::open());
        Self { state, terminal, drawn: None, shown: None, measured: None, log: None }
    }

    /// A message of one of the processes or about them.
    pub(super) fn say(&mut self, line: &str) -> io::Result<()> {
        self.state.message(line);
        if self.terminal.is_some() { Ok(()) } else { print(line) }
    }

    /// Where to connect and how to break something, and what the keys do if there are some.
    pub(super) fn introduce(
        &mut self,
        ground_stations: &Listening,
        has_keys: bool,
    ) -> io::Result<()> {
        self.state.stations = Some(ground_stations.clone());
        self.state.keys = has_keys;
        if self.terminal.is_some() {
            return Ok(());
        }
        connect::plain(ground_stations).iter().try_for_each(|line| print(line))?;
        if has_keys { print(&keys::HELP.join(", ")) } else { Ok(()) }
    }

    /// What the autopilot reports.
    pub(super) fn status(&mut self, status: StatusLine, now: Instant) -> io::Result<()> {
        match status {
            StatusLine::Flight(flight) => {
                self.follow_pace(flight.t_s, now);
                self.state.flight = Some(*flight);
                if self.terminal.is_some() { Ok(()) } else { self.plain_line(now) }
            }
            StatusLine::FlightLog { path } => {
                let said = self.say(&plain::flight_log(&path));
                self.log = Some(path);
                said
            }
            StatusLine::Listening { .. } | StatusLine::NoPlant => Ok(()),
        }
    }

    /// Draws the screen if it is time to.
    pub(super) fn refresh(&mut self, now: Instant) -> io::Result<()> {
        let Some(terminal) = self.terminal.as_mut() else { return Ok(()) };
        if self.drawn.is_some_and(|drawn| now - drawn < DRAW_EVERY) {
            return Ok(());
        }
        self.drawn = Some(now);
        let (width, height) = terminal.size();
        terminal.draw(self.state.lines(width, height))
    }

    /// A line for the file, if it is time for one or something has changed.
    fn plain_line(&mut self, now: Instant) -> io::Result<()> {
        let Some(flight) = &self.state.flight else { return Ok(()) };
        let change = Change {
            compensator_active: flight.compensator_active,
            plant: flight.plant,
            passing: self.state.passing,
            faults: flight.faults.iter().map(view::fault_words).collect(),
        };
        let due = self.shown.as_ref();
        if due.is_some_and(|(when, last)| *last == change && now - *when < PLAIN_EVERY) {
            return Ok(());
        }
        self.shown = Some((now, change));
        print(&plain::line(flight, self.state.passing, self.state.achieved))
    }

    /// Simulation time passes like this from here on.
    pub(super) fn pass(&mut self, passing: Passing) {
        if self.state.passing != passing {
            self.state.passing = passing;
            self.measured = None;
            self.state.achieved = None;
        }
    }

    /// How simulation time passes.
    pub(super) fn passing(&self) -> Passing {
        self.state.passing
    }

    /// Simulation time per wall time over the last second or so, once it is known.
    pub(super) fn achieved(&self) -> Option<f64> {
        self.state.achieved
    }

    /// Measures simulation time per wall time about once a second.
    fn follow_pace(&mut self, t_s: f64, now: Instant) {
        let (then, then_s) = *self.measured.get_or_insert((now, t_s));
        let wall_s = (now - then).as_secs_f64();
        if t_s < then_s {
            self.measured = Some((now, t_s));
        } else if wall_s >= 1.0 {
            self.state.achieved = Some((t_s - then_s) / wall_s);
            self.measured = Some((now, t_s));
        }
    }

    /// Gives the terminal to others; the next [`Screen::refresh`] takes it again.
    pub(super) fn leave(&mut self) {
        if let Some(terminal) = self.terminal.as_mut() {
            terminal.leave();
        }
    }

    /// Gives the terminal back and leaves plain lines: what became of the flight, and where its log is. `program` is
    /// the name by which this one was called.
    pub(super) fn end(mut self, program: &Path) -> io::Result<()> {
        if let Some(terminal) = self.terminal.take() {
            drop(terminal);
            if !terminal::takes_output(&io::stdout()) {
                return Ok(());
            }
            let is_warning = |line: &&str| line.contains("WARN") || line.contains("ERROR");
            let warnings: Vec<&str> = self.state.messages().filter(is_warning).collect();
            let first = warnings.len().saturating_sub(WARNINGS_MAX);
            warnings.iter().skip(first).try_for_each(|line| print(line))?;
        }
        if let Some(flight) = &self.state.flight {
            plain::outcome(flight).iter().try_for_each(|line| print(line))?;
        }
        if let Some(path) = &self.log {
            print(&plain::flight_log(path))?;
            print(&plain::how_to_draw(path, program))?;
        }
        Ok(())
    }
}

fn print(line: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{line}")?;
    out.flush()
}
