//! What the operator sees: on a terminal one screen that follows the flight, elsewhere plain lines. The terminal is a screen of
//! lines: taken over, redrawn where it changed, given back.

use std::io::{self, IsTerminal, Stdout, Write};
use std::os::fd::AsFd;
use std::panic;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use autopilot::io::status::{FlightStatus, Listening, PlantState, StatusLine};
use crossterm::cursor::{Hide, MoveTo, Show};
use crossterm::style::{Attribute, Color, Print, ResetColor, SetAttribute, SetForegroundColor};
use crossterm::terminal::{
    Clear, ClearType, DisableLineWrap, EnableLineWrap, EnterAlternateScreen, LeaveAlternateScreen,
};
use crossterm::{execute, queue};
use host_io::console;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use rustix::termios::tcgetwinsize;

use super::keys::{self, PaceState, is_in_background};

mod view;

pub(super) use view::Advice;
use view::{Line, ScreenState, Tone, compensator_text, fault_text, plain_lines};

/// Time between two lines where the output is no terminal.
const PLAIN_EVERY: Duration = Duration::from_secs(10);
/// Time between two drawings of the screen.
const DRAW_EVERY: Duration = Duration::from_millis(50);
/// Warnings that are repeated as plain lines after the flight.
const WARNINGS_MAX: usize = 10;

/// The operator's screen, or the file that stands for it.
pub(super) struct Screen {
    state: ScreenState,
    /// `None`: plain lines.
    terminal: Option<Terminal>,
    drawn: Option<Instant>,
    /// The last plain line, and when that was.
    shown: Option<(Instant, ScreenChange)>,
    /// Wall time and simulation time when the speed was measured last.
    measured: Option<(Instant, f64)>,
    /// Log of the present flight.
    log: Option<PathBuf>,
}

/// What makes a plain line worth printing before its time.
#[derive(Clone, PartialEq)]
struct ScreenChange {
    compensator_active: bool,
    plant: PlantState,
    pace: PaceState,
    faults: Vec<String>,
}

impl Screen {
    pub(super) fn new(pace: PaceState, advice: Option<Advice>) -> Self {
        let (mut state, terminal) = (ScreenState::new(pace), Terminal::open());
        state.advice = advice;
        Self { state, terminal, drawn: None, shown: None, measured: None, log: None }
    }

    /// A message of one of the processes or about them.
    pub(super) fn message(&mut self, line: &str) -> io::Result<()> {
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
        plain_lines(ground_stations, self.state.advice.as_ref())
            .iter()
            .try_for_each(|line| print(line))?;
        if has_keys { print(&keys::HELP.join(", ")) } else { Ok(()) }
    }

    /// What the autopilot reports.
    pub(super) fn status(&mut self, status: StatusLine, now: Instant) -> io::Result<()> {
        match status {
            StatusLine::Flight(flight) => {
                self.follow_pace(flight.t_s, now);
                self.state.flight = Some(*flight);
                if self.terminal.is_some() { Ok(()) } else { self.print_plain_line(now) }
            }
            StatusLine::FlightLog { path } => {
                let printed = self.message(&flight_log(&path));
                self.log = Some(path);
                printed
            }
            // The launcher has made a report of its own of `Listening`; without a plant nothing has
            // changed.
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
    fn print_plain_line(&mut self, now: Instant) -> io::Result<()> {
        let Some(flight) = &self.state.flight else { return Ok(()) };
        let change = ScreenChange {
            compensator_active: flight.compensator_active,
            plant: flight.plant,
            pace: self.state.pace,
            faults: flight.faults.iter().map(fault_text).collect(),
        };
        let due = self.shown.as_ref();
        if due.is_some_and(|(when, last)| *last == change && now - *when < PLAIN_EVERY) {
            return Ok(());
        }
        self.shown = Some((now, change));
        print(&plain_line(flight, self.state.pace, self.state.achieved))
    }

    /// Simulation time passes like this from here on.
    pub(super) fn set_pace(&mut self, pace: PaceState) {
        if self.state.pace != pace {
            self.state.pace = pace;
            // What was measured at the old pace says nothing about the new one.
            self.measured = None;
            self.state.achieved = None;
        }
    }

    /// How simulation time passes.
    pub(super) fn pace(&self) -> PaceState {
        self.state.pace
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
            // A new flight has begun.
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
            // The lines below are to stay when the process has ended, so the usual screen comes
            // back first.
            drop(terminal);
            // Where Ctrl-S holds the output back, writing would keep the process from ending.
            if !takes_output(&io::stdout()) {
                return Ok(());
            }
            let is_warning = |line: &&str| line.contains("WARN") || line.contains("ERROR");
            let warnings: Vec<&str> = self.state.messages().filter(is_warning).collect();
            let first = warnings.len().saturating_sub(WARNINGS_MAX);
            warnings.iter().skip(first).try_for_each(|line| print(line))?;
        }
        if let Some(flight) = &self.state.flight {
            outcome(flight).iter().try_for_each(|line| print(line))?;
        }
        if let Some(path) = &self.log {
            print(&flight_log(path))?;
            print(&plot_hint(path, program))?;
        }
        Ok(())
    }
}

fn print(line: &str) -> io::Result<()> {
    let mut out = console::out();
    writeln!(out, "{line}")?;
    out.flush()
}

fn plain_line(flight: &FlightStatus, pace: PaceState, achieved: Option<f64>) -> String {
    let FlightStatus { plant, t_s, altitude_m, airspeed_m_s, roll_deg, mode, .. } = flight;
    let speed = pace.text(achieved);
    // Single steps are to be seen.
    let time = if pace.paused { format!("{t_s:11.3}") } else { format!("{t_s:9.1}") };
    let (_, compensator) = compensator_text(flight);
    let plant = match plant {
        PlantState::Flying => "",
        PlantState::Terminated => "   FLIGHT TERMINATED",
        PlantState::OnGround => "   ON THE GROUND",
        PlantState::Lost => "   PLANT LOST",
    };
    let faults = flight.faults.iter().map(|fault| format!("   fault: {}", fault_text(fault)));
    let faults: String = faults.collect();
    format!(
        "t {time} s   altitude {altitude_m:6.0} m   speed {airspeed_m_s:6.1} m/s   roll {roll_deg:6.1} deg   \
         compensator {compensator}   {mode}   {speed}{plant}{faults}"
    )
}

/// What became of the flight, as far as it was reported.
fn outcome(flight: &FlightStatus) -> Vec<String> {
    let FlightStatus { plant, t_s, altitude_m, airspeed_m_s, .. } = flight;
    let state = match plant {
        PlantState::Flying => format!("in the air, {altitude_m:.0} m, {airspeed_m_s:.1} m/s"),
        PlantState::Terminated => format!("terminated, at {altitude_m:.0} m"),
        PlantState::OnGround => "on the ground: the flight is over".to_owned(),
        PlantState::Lost => format!("the plant was lost in the air, at {altitude_m:.0} m"),
    };
    let (_, compensator) = compensator_text(flight);
    let mut lines = vec![format!("ended at {t_s:.1} s   {state}   compensator {compensator}")];
    lines.extend(
        flight.faults.iter().map(|fault| format!("fault            {}", fault_text(fault))),
    );
    if flight.more_faults > 0 {
        lines.push(format!("                 and {} more", flight.more_faults));
    }
    lines
}

/// Where the log of the flight is.
fn flight_log(path: &Path) -> String {
    format!("flight log       {}", path.display())
}

/// How to look at the log.
fn plot_hint(path: &Path, program: &Path) -> String {
    format!("draw it          {} log plot '{}'", program.display(), path.display())
}

/// Columns and rows of a terminal that does not say.
const USUAL: (usize, usize) = (80, 24);
/// A terminal that cannot place its cursor.
const DUMB: &str = "dumb";

/// The terminal at the standard output; as it was again when this is dropped, and before a panic is reported.
struct Terminal {
    out: Stdout,
    /// It is ours now.
    taken: Arc<AtomicBool>,
    size: (usize, usize),
    shown: Vec<Line>,
}

impl Terminal {
    /// `None` where the output is no terminal, one that knows only lines, or that of a shell that has put this
    /// process into the background.
    fn open() -> Option<Self> {
        let out = io::stdout();
        let is_dumb = std::env::var_os("TERM").is_some_and(|name| name == DUMB);
        if !out.is_terminal() || is_dumb || is_in_background(&out) {
            return None;
        }
        let taken = Arc::new(AtomicBool::new(false));
        let mine = Arc::clone(&taken);
        // A panic's message on the alternate screen would vanish with it, so the screen is given
        // back first.
        let report = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            restore_terminal(&mine);
            report(panic);
        }));
        Some(Self { out, taken, size: (0, 0), shown: Vec::new() })
    }

    /// Columns and rows now.
    fn size(&self) -> (usize, usize) {
        let size = tcgetwinsize(&self.out);
        let size = size.map(|size| (usize::from(size.ws_col), usize::from(size.ws_row)));
        // A serial line or a new pseudo-terminal says zero columns.
        size.ok().filter(|(columns, rows)| *columns > 0 && *rows > 0).unwrap_or(USUAL)
    }

    /// Shows these lines, as many as [`Terminal::size`] has rows at most. Writes only those that have changed, so that
    /// a selection in the others stays. Nothing while a shell has the terminal, or while its output is stopped (Ctrl-S).
    fn draw(&mut self, lines: Vec<Line>) -> io::Result<()> {
        if is_in_background(&self.out) || !takes_output(&self.out) {
            return Ok(());
        }
        let mut bytes = Vec::new();
        let size = self.size();
        // Marked before the first byte goes out, so that a failure halfway still gives the terminal
        // back.
        let is_new = !self.taken.swap(true, Ordering::Relaxed);
        if is_new {
            // A line that the terminal finds wider than we do would wrap, and shift all rows below
            // it.
            queue!(bytes, EnterAlternateScreen, Hide, DisableLineWrap)?;
        }
        if is_new || size != self.size {
            // A terminal rearranges its lines in its own way when its size changes: what is known
            // of them is void.
            self.size = size;
            self.shown.clear();
            queue!(bytes, Clear(ClearType::All))?;
        }
        for (row, line) in lines.iter().enumerate() {
            if self.shown.get(row) != Some(line) {
                put(&mut bytes, row, line)?;
            }
        }
        for row in lines.len()..self.shown.len() {
            queue!(bytes, MoveTo(0, clamp(row)), Clear(ClearType::UntilNewLine))?;
        }
        self.shown = lines;
        self.out.write_all(&bytes)?;
        self.out.flush()
    }

    /// Gives the terminal back. The next [`Terminal::draw`] takes it again.
    fn leave(&mut self) {
        restore_terminal(&self.taken);
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.leave();
    }
}

fn restore_terminal(taken: &AtomicBool) {
    let mut out = io::stdout();
    if taken.swap(false, Ordering::Relaxed) && takes_output(&out) {
        // A terminal that has gone needs no restoring.
        let _ = execute!(out, EnableLineWrap, Show, LeaveAlternateScreen);
    }
}

fn put(bytes: &mut Vec<u8>, row: usize, line: &Line) -> io::Result<()> {
    queue!(bytes, MoveTo(0, clamp(row)))?;
    match line.tone {
        Tone::Plain => {}
        Tone::Heading => queue!(bytes, SetAttribute(Attribute::Bold))?,
        Tone::Good => queue!(bytes, SetForegroundColor(Color::DarkGreen))?,
        Tone::Warning => queue!(bytes, SetForegroundColor(Color::DarkYellow))?,
        Tone::Alarm => queue!(bytes, SetForegroundColor(Color::DarkRed))?,
    }
    queue!(bytes, Print(&line.text), SetAttribute(Attribute::Reset), ResetColor)?;
    queue!(bytes, Clear(ClearType::UntilNewLine))
}

/// Rows of a terminal fit into its own type.
fn clamp(row: usize) -> u16 {
    u16::try_from(row).unwrap_or(u16::MAX)
}

/// Whether a write returns at once. It does not on a terminal whose output was stopped (Ctrl-S): a write would wait
/// until the user lets it go on, and a request to stop with it.
fn takes_output(out: &Stdout) -> bool {
    let mut asked = [PollFd::new(out.as_fd(), PollFlags::POLLOUT)];
    // An output that cannot be asked is taken as ready, and the write finds out.
    poll(&mut asked, PollTimeout::ZERO) != Ok(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use view::tests::flight;

    #[test]
    fn the_line_tells_a_switched_off_compensator_from_a_sleeping_one() {
        let mut flight = flight();
        let expected = "t      12.3 s   altitude   5000 m   speed  264.0 m/s   roll   -0.2 deg   \
                        compensator asleep   Hold   x1.0";
        let running = PaceState { paused: false, speed: Some(1.0) };
        assert_eq!(plain_line(&flight, running, None), expected);
        flight.compensator_off = true;
        assert!(plain_line(&flight, running, None).contains("compensator off "));
        flight.compensator_active = true;
        assert!(plain_line(&flight, running, None).contains("compensator fault seen, off"));
        flight.fade = 0.5;
        assert!(plain_line(&flight, running, None).contains("compensator ACTIVE 50 %"));
        let paused = plain_line(&flight, PaceState { paused: true, speed: None }, None);
        assert!(paused.starts_with("t      12.340 s ") && paused.ends_with("PAUSED"), "{paused}");
    }

    #[test]
    fn after_the_flight_its_end_and_its_faults_are_printed() {
        let mut flight = flight();
        flight.faults = view::tests::faults(1);
        let lines = outcome(&flight);
        assert!(lines[0].starts_with("ended at 12.3 s   in the air, 5000 m"), "{lines:?}");
        assert!(lines[1].ends_with("left elevator stuck at 30.0 deg, since 3.0 s"), "{lines:?}");
        flight.plant = PlantState::OnGround;
        assert!(outcome(&flight)[0].contains("on the ground"));
        flight.plant = PlantState::Terminated;
        assert!(outcome(&flight)[0].contains("terminated, at 5000 m"));
        let running = PaceState { paused: false, speed: Some(1.0) };
        assert!(plain_line(&flight, running, None).contains("x1.0   FLIGHT TERMINATED"));
        flight.plant = PlantState::Lost;
        assert!(outcome(&flight)[0].contains("the plant was lost in the air"));
    }
}
