//! The operator's keys, where the standard input is a terminal, and the commands to the plant that they become.

use std::io::{self, ErrorKind, IsTerminal, Read, Stdin};
use std::os::fd::AsFd;
use std::thread;
use std::time::Duration;

use host_io::clock;
use icd::pace::Pace;
use nix::sys::signal::{SigSet, Signal};
use nix::sys::termios::{
    _POSIX_VDISABLE, LocalFlags, SetArg, SpecialCharacterIndices, Termios, tcgetattr, tcsetattr,
};
use nix::unistd::{getpgrp, tcgetpgrp};
use plant_sim::io::Speed;

/// What the keys do, for the operator.
pub(super) const HELP: [&str; 7] =
    ["space pause", "s step", "S 100 steps", "- slower", "+ faster", "1 real time", "q quit"];
/// Periods of a long step.
const LONG_STEP: u32 = 100;
/// A key that cannot be read now (the process is in the background) is tried again after this.
const AGAIN: Duration = Duration::from_millis(200);
/// First byte of what cursor and function keys send.
const ESCAPE: u8 = 0x1b;
// Ctrl-Z.
const SUSPEND: u8 = 0x1a;

/// What the operator wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    /// Let time stand still if it runs, and run if it stands still.
    PauseOrRun,
    /// Let this many control periods pass.
    Step(u32),
    Slower,
    Faster,
    /// As fast as the wall clock.
    RealTime,
    Quit,
    /// Stop the flight until the shell lets it go on.
    Suspend,
}

impl Key {
    fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            b' ' => Some(Self::PauseOrRun),
            b's' | b'.' => Some(Self::Step(1)),
            b'S' => Some(Self::Step(LONG_STEP)),
            b'-' => Some(Self::Slower),
            // The key of the plus sign, without shift.
            b'+' | b'=' => Some(Self::Faster),
            b'1' => Some(Self::RealTime),
            b'q' => Some(Self::Quit),
            SUSPEND => Some(Self::Suspend),
            _ => None,
        }
    }
}

/// The terminal, switched to single keys without echo; as it was again when this is dropped.
pub(super) struct Keys {
    terminal: Stdin,
    before: Termios,
}

impl Keys {
    /// Switches the terminal and sends each key to `take`, which says false when nobody reads any more. `None` where there is no terminal to read from.
    ///
    /// Ctrl-C and Ctrl-\ remain signals. Ctrl-Z becomes a key, since the screen is given back before the process stops.
    pub(super) fn listen(take: impl Fn(Key) -> bool + Send + 'static) -> io::Result<Option<Self>> {
        let terminal = io::stdin();
        // Of `sitl &` the terminal is the shell's, and switching it from the background stops the
        // process.
        if !terminal.is_terminal() || is_in_background(&terminal) {
            return Ok(None);
        }
        let before = tcgetattr(&terminal)?;
        let keys = Self { terminal, before };
        keys.switch()?;
        thread::Builder::new().name("keys".to_owned()).spawn(move || read(&take))?;
        Ok(Some(keys))
    }

    fn switch(&self) -> nix::Result<()> {
        let mut single = self.before.clone();
        single.local_flags.remove(LocalFlags::ICANON | LocalFlags::ECHO);
        // Set, because some systems keep the characters of EOF and EOL in these places while lines
        // are read.
        single.control_chars[SpecialCharacterIndices::VMIN as usize] = 1;
        single.control_chars[SpecialCharacterIndices::VTIME as usize] = 0;
        single.control_chars[SpecialCharacterIndices::VSUSP as usize] = _POSIX_VDISABLE;
        tcsetattr(&self.terminal, SetArg::TCSANOW, &single)
    }

    /// Gives the terminal back.
    pub(super) fn restore(&self) {
        // In the background the terminal is the shell's.
        if !is_in_background(&self.terminal) {
            // A terminal that has gone needs no restoring.
            let _ = tcsetattr(&self.terminal, SetArg::TCSANOW, &self.before);
        }
    }

    /// Switches again after a stay in the background, where a shell had the terminal in its own way.
    pub(super) fn keep(&self) {
        let lines = |now: Termios| now.local_flags.contains(LocalFlags::ICANON);
        if !is_in_background(&self.terminal) && tcgetattr(&self.terminal).is_ok_and(lines) {
            // Without it the keys need Enter; nothing else is wrong.
            let _ = self.switch();
        }
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        self.restore();
    }
}

/// Whether another process group has the terminal. One that is nobody's is not the background.
pub(super) fn is_in_background(terminal: impl AsFd) -> bool {
    tcgetpgrp(terminal).is_ok_and(|foreground| foreground != getpgrp())
}

fn read(take: &impl Fn(Key) -> bool) {
    // So that reading in the background is an error, and does not stop the process.
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGTTIN);
    if signals.thread_block().is_err() {
        return;
    }
    let mut input = io::stdin().lock();
    let mut bytes = [0; 64];
    loop {
        match input.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => {
                let typed = bytes.get(..count).unwrap_or_default();
                for key in keys(typed) {
                    if !take(key) {
                        return;
                    }
                }
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(_) => clock::sleep(AGAIN),
        }
    }
}

/// The keys in what was typed; what begins with an escape is one key that means nothing here.
fn keys(typed: &[u8]) -> impl Iterator<Item = Key> {
    // The bytes of a cursor key arrive in one read; none of them may be taken as a letter that was
    // typed.
    let typed = if typed.first() == Some(&ESCAPE) { &[] } else { typed };
    typed.iter().filter_map(|byte| Key::from_byte(*byte))
}

/// Below this part of the speed that was asked for, both are shown.
const KEEPS_UP: f64 = 0.9;

/// Standing still, and speed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct PaceState {
    pub(super) paused: bool,
    /// Where it runs, so many times as fast as wall time; `None`: as fast as possible.
    pub(super) speed: Option<f64>,
}

impl PaceState {
    pub(super) fn new(paused: bool, speed: Speed) -> Self {
        match speed {
            Speed::Max => Self { paused, speed: None },
            Speed::Times(factor) => Self { paused, speed: Some(factor) },
        }
    }

    /// The order to the plant that a key stands for, in the words that the plant takes from its parent.
    ///
    /// What it leads to is assumed here, so that the next key means the right thing; the plant then says
    /// what is true. `achieved` is the speed of the last second, if it is known.
    pub(super) fn command(&mut self, key: Key, achieved: Option<f64>) -> Option<String> {
        match key {
            Key::PauseOrRun => {
                self.paused = !self.paused;
                Some(if self.paused { "pause" } else { "run" }.to_owned())
            }
            Key::Step(periods) => {
                self.paused = true;
                Some(format!("step {periods}"))
            }
            // At `max` halving begins at what is achieved, or the key would do nothing that can be
            // seen.
            Key::Slower => Some(self.at(self.speed.unwrap_or_else(|| round(achieved)) / 2.0)),
            // At `max` there is nothing faster.
            Key::Faster => self.speed.map(|speed| self.at(speed * 2.0)),
            Key::RealTime => Some(self.at(1.0)),
            Key::Quit | Key::Suspend => None,
        }
    }

    fn at(&mut self, speed: f64) -> String {
        let (slowest, fastest) = Pace::SPEED;
        let speed = speed.clamp(slowest, fastest);
        self.speed = Some(speed);
        format!("speed {speed}")
    }

    /// For the operator, with what is achieved if that is known.
    pub(super) fn text(&self, achieved: Option<f64>) -> String {
        match (self.paused, self.speed, achieved) {
            (true, _, _) => "PAUSED".to_owned(),
            (false, None, None) => "max".to_owned(),
            (false, None, Some(achieved)) => format!("max {}", factor(achieved)),
            (false, Some(wanted), None) => factor(wanted),
            (false, Some(wanted), Some(achieved)) if achieved < KEEPS_UP * wanted => {
                format!("{} of {}", factor(achieved), factor(wanted))
            }
            (false, Some(_), Some(achieved)) => factor(achieved),
        }
    }
}

/// The power of two below a speed, so that halving gives numbers that can be read.
fn round(achieved: Option<f64>) -> f64 {
    achieved.filter(|speed| *speed >= 1.0).map_or(1.0, |speed| speed.log2().floor().exp2())
}

fn factor(speed: f64) -> String {
    // The limits are where the form with more digits would round up to the next power of ten.
    match speed {
        ..0.0995 => format!("x{speed:.3}"),
        ..0.995 => format!("x{speed:.2}"),
        _ => format!("x{speed:.1}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_do_what_the_help_lists() {
        let typed: Vec<Key> = keys(b" sS-+1q.\x1a").collect();
        let expected = [
            Key::PauseOrRun,
            Key::Step(1),
            Key::Step(100),
            Key::Slower,
            Key::Faster,
            Key::RealTime,
            Key::Quit,
            Key::Step(1),
            Key::Suspend,
        ];
        assert_eq!(typed, expected);
    }

    #[test]
    fn a_cursor_key_is_not_the_letters_that_it_sends() {
        assert_eq!(keys(b"\x1b[1;5C").next(), None);
        assert_eq!(keys(b"xyz\n\xff").next(), None);
    }

    #[test]
    fn space_pauses_and_runs_and_a_step_pauses() {
        let mut time = PaceState::new(false, Speed::REAL_TIME);
        let mut press = |key| time.command(key, None);
        assert_eq!(press(Key::PauseOrRun).as_deref(), Some("pause"));
        assert_eq!(press(Key::PauseOrRun).as_deref(), Some("run"));
        assert_eq!(press(Key::Step(100)).as_deref(), Some("step 100"));
        assert_eq!(press(Key::PauseOrRun).as_deref(), Some("run"));
        assert_eq!(press(Key::Quit), None);
    }

    #[test]
    fn speeds_halve_and_double_inside_the_limits() {
        let mut time = PaceState::new(false, Speed::REAL_TIME);
        assert_eq!(time.command(Key::Slower, None).as_deref(), Some("speed 0.5"));
        assert_eq!(time.command(Key::Faster, None).as_deref(), Some("speed 1"));
        for _ in 0..20 {
            time.command(Key::Slower, None);
        }
        assert_eq!(time.speed, Some(0.01));
        for _ in 0..20 {
            time.command(Key::Faster, None);
        }
        assert_eq!(time.speed, Some(1_000.0));
        assert_eq!(time.command(Key::RealTime, None).as_deref(), Some("speed 1"));
    }

    #[test]
    fn from_as_fast_as_possible_it_goes_to_half_of_what_was_achieved() {
        let mut time = PaceState::new(false, Speed::Max);
        assert_eq!(time.command(Key::Faster, Some(40.0)), None);
        assert_eq!(time.command(Key::Slower, Some(40.0)).as_deref(), Some("speed 16"));
        let mut time = PaceState::new(false, Speed::Max);
        assert_eq!(time.command(Key::Slower, None).as_deref(), Some("speed 0.5"));
    }

    #[test]
    fn the_requested_speed_is_shown_until_the_achieved_one_is_known() {
        let words = |paused, speed, achieved| PaceState { paused, speed }.text(achieved);
        assert_eq!(words(true, Some(1.0), Some(1.0)), "PAUSED");
        assert_eq!(words(false, None, None), "max");
        assert_eq!(words(false, None, Some(35.21)), "max x35.2");
        assert_eq!(words(false, Some(0.25), None), "x0.25");
        assert_eq!(words(false, Some(0.02), Some(0.02)), "x0.020");
        assert_eq!(words(false, Some(1.0), Some(0.999)), "x1.0");
        assert_eq!(words(false, Some(100.0), Some(35.0)), "x35.0 of x100.0");
    }
}
