//! One console: the waiting lines, the running command, and the output not sent yet.

use core::time::Duration;
use std::collections::VecDeque;

use ::mavlink::dialects::common::MavSeverity;
use icd::EffectorList;
use icd::fault::{FaultReply, NO_ANSWER, Target};

use crate::codec::printable;
use crate::peers::From;
use crate::queues::OpenCommand;
use crate::shell::commands::{Answer, Output};
use crate::wall_time::WallTime;
use crate::{Shared, command, failure};
use flight_management::command::Outcome;
use flight_management::vehicle::Mode;

/// Lines that may wait behind a command. More are refused with a text.
const LINES_MAX: usize = 32;
/// Output that may wait before no further line runs, bytes.
const OUTPUT_FULL: usize = 8 * 1024;
/// A command without an answer is given up after this.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);
/// Text to print when a line is done.
pub(super) const PROMPT: &str = "two-step> ";

/// The running command, which waits for the aircraft.
#[derive(Debug)]
struct Running {
    since: WallTime,
    parts: Vec<OpenCommand>,
    /// The text to print when every part is done.
    done: String,
    has_failed: bool,
    /// A fault was removed from the list.
    has_mended: bool,
    /// At least one part had no fault to remove.
    nothing_to_mend: bool,
    steers: bool,
    mode: Option<Mode>,
}

#[derive(Debug)]
pub(super) struct Session {
    pub(super) from: From,
    pub(super) received: WallTime,
    /// The client expects output.
    expects_answers: bool,
    /// The client has received its first prompt.
    is_prompted: bool,
    buffer: LineBuffer,
    lines: VecDeque<String>,
    refused_lines: usize,
    running: Option<Running>,
    output: VecDeque<u8>,
}

impl Session {
    pub(super) fn new(from: From) -> Self {
        Self {
            from,
            received: WallTime::ZERO,
            expects_answers: false,
            is_prompted: false,
            buffer: LineBuffer::default(),
            lines: VecDeque::new(),
            refused_lines: 0,
            running: None,
            output: VecDeque::new(),
        }
    }

    /// Records whether the client expects output. The first time that it does, it gets a prompt: its page has just opened, or
    /// this is its first message.
    pub(super) fn listens(&mut self, expects_answers: bool) {
        self.expects_answers = expects_answers;
        if expects_answers && !self.is_prompted {
            self.is_prompted = true;
            self.print(PROMPT);
        }
    }

    pub(super) fn take(&mut self, typed: &[u8]) {
        for byte in typed {
            match self.buffer.push(*byte) {
                None => {}
                Some(_) if self.lines.len() >= LINES_MAX => self.refused_lines += 1,
                Some(Ok(line)) => self.lines.push_back(line),
                // Answered in its turn: no command has this name.
                Some(Err(error)) => self.lines.push_back(format!("{ERROR_LINE}{error}")),
            }
        }
    }

    /// Whether the next line can run.
    pub(super) fn is_ready(&self) -> bool {
        let has_line = !self.lines.is_empty();
        has_line && self.running.is_none() && self.output.len() < OUTPUT_FULL
    }

    /// The next line to run, after its echo: the echo of a line that waited follows the prompt of the line before it. A line
    /// that is an error already is answered here.
    pub(super) fn next_line(&mut self) -> Option<String> {
        let line = self.lines.pop_front()?;
        let error = line.strip_prefix(ERROR_LINE);
        // Consoles clear the typed line when they send it, and expect its echo.
        self.print(if error.is_some() { "" } else { &line });
        self.print("\n");
        if let Some(error) = error {
            self.finish(&format!("ERROR: {error}\n"));
            return None;
        }
        Some(line)
    }

    /// Handles the result of a command: prints it, or sends its commands to the aircraft.
    pub(super) fn answer(&mut self, answer: Answer, now: WallTime, shared: &mut Shared) {
        match answer {
            Ok(Output { text, commands }) if commands.is_empty() => self.finish(&text),
            Ok(output) => self.pass_on(output, now, shared),
            Err(reason) => self.finish(&format!("ERROR: {reason}\n")),
        }
    }

    fn pass_on(&mut self, output: Output, now: WallTime, shared: &mut Shared) {
        let Output { text, commands } = output;
        if shared.intents.room() < commands.len() {
            return self.finish("ERROR: too many commands are waiting\n");
        }
        let steers =
            commands.iter().any(|command| command::steers(command, shared.aircraft.mode()));
        let mode = commands.iter().find_map(command::mode_of);
        let parts = commands.into_iter().filter_map(|command| shared.intents.open(command));
        let parts = parts.collect();
        self.running = Some(Running {
            since: now,
            parts,
            done: text,
            has_failed: false,
            has_mended: false,
            nothing_to_mend: false,
            steers,
            mode,
        });
    }

    /// Whether the running command waits for this mode.
    pub(super) fn waits_for(&self, mode: Mode) -> bool {
        self.running.as_ref().is_some_and(|running| running.mode == Some(mode))
    }

    /// Handles the outcome of an intent; prints it if it belongs to the running command.
    pub(super) fn handle_outcome(&mut self, number: u32, outcome: &Outcome, shared: &mut Shared) {
        let Some(running) = self.running.as_mut() else { return };
        let Some(place) = running.parts.iter().position(|part| part.number == number) else {
            return;
        };
        let part = running.parts.remove(place);
        if let Outcome::Plant(FaultReply::Cleared { .. }) = outcome {
            // A fault on the list leaves it after this answer.
            let faults = shared.aircraft.faults();
            let is_news = match part.target() {
                Some(target) => faults.names(target),
                None => !faults.entries().is_empty(),
            };
            if !is_news {
                running.nothing_to_mend = true;
                return self.close_if_done(shared);
            }
            running.has_mended = true;
        }
        let (line, has_failed) = line_of(part.target(), outcome, shared.effectors());
        running.has_failed |= has_failed;
        if has_failed {
            // This client reads it here; the others find it in the flight log.
            shared
                .texts
                .log(MavSeverity::MAV_SEVERITY_WARNING, format!("Shell: {}", line.trim_end()));
        }
        self.print(&line);
        self.close_if_done(shared);
    }

    /// Gives up a command that has waited too long for an answer.
    pub(super) fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        let is_over = |running: &&mut Running| now.since(running.since) >= ANSWER_TIMEOUT;
        let Some(running) = self.running.as_mut().filter(is_over) else { return };
        running.has_failed = true;
        let parts = core::mem::take(&mut running.parts);
        for part in parts {
            let (line, _) = line_of(part.target(), &Outcome::NoAnswer, shared.effectors());
            self.print(&line);
        }
        self.close_if_done(shared);
    }

    fn close_if_done(&mut self, shared: &mut Shared) {
        let Some(running) = self.running.take_if(|running| running.parts.is_empty()) else {
            return;
        };
        if running.nothing_to_mend && !running.has_mended {
            self.print("nothing to mend\n");
        }
        if running.has_failed {
            return self.finish("");
        }
        if running.steers {
            shared.control.take(self.from.sender);
        }
        self.finish(&running.done);
    }

    /// When the running command is given up.
    pub(super) fn answer_deadline(&self) -> Option<WallTime> {
        self.running.as_ref().map(|running| running.since + ANSWER_TIMEOUT)
    }

    /// Ends the output of a line, and prints the prompt.
    fn finish(&mut self, text: &str) {
        self.print(text);
        if self.refused_lines > 0 && self.lines.is_empty() {
            let count = core::mem::take(&mut self.refused_lines);
            self.print(&format!(
                "ERROR: {count} lines were not taken, at most {LINES_MAX} may wait\n"
            ));
        }
        self.print(PROMPT);
    }

    /// The tables bound the output of a command, and no line runs while [`OUTPUT_FULL`] bytes wait: so the output is
    /// bounded without dropping anything.
    fn print(&mut self, text: &str) {
        if self.expects_answers {
            let byte = |c| if c == '\n' { b'\n' } else { printable(c) };
            self.output.extend(text.chars().map(byte));
        }
    }

    pub(super) fn has_output(&self) -> bool {
        !self.output.is_empty()
    }

    /// Up to `size` bytes to send.
    pub(super) fn next_chunk(&mut self, size: usize) -> Option<Vec<u8>> {
        let size = size.min(self.output.len());
        (size > 0).then(|| self.output.drain(..size).collect())
    }
}

/// Marks a line that is an error already; no typed line begins with it, since it is not text.
const ERROR_LINE: &str = "\u{1}";

/// Text of the outcome of a part, and whether the part failed.
fn line_of(target: Option<Target>, outcome: &Outcome, effectors: &EffectorList) -> (String, bool) {
    let whose = target.map_or(String::new(), |target| format!("{}: ", target.name(effectors)));
    let failed = |reason: &dyn core::fmt::Display| (format!("ERROR: {whose}{reason}\n"), true);
    match outcome {
        Outcome::Done => (String::new(), false),
        Outcome::Refused(refusal) => failed(refusal),
        Outcome::NoAnswer => failed(&NO_ANSWER),
        Outcome::Plant(FaultReply::Refused(refusal)) => {
            failed(&failure::refused(refusal, target, effectors))
        }
        Outcome::Plant(FaultReply::Applied { at }) => (format!("{whose}acts since {at}\n"), false),
        Outcome::Plant(FaultReply::Scheduled { at }) => (format!("{whose}acts at {at}\n"), false),
        Outcome::Plant(FaultReply::Unchanged { at }) => {
            (format!("{whose}nothing changed, the same fault is there: {at}\n"), false)
        }
        Outcome::Plant(FaultReply::Cleared { at }) => {
            (format!("{whose}healthy since {at}\n"), false)
        }
    }
}

/// Longest line, bytes.
pub(super) const LINE_MAX: usize = 240;

const BACKSPACE: u8 = 0x08;
const DELETE: u8 = 0x7F;
/// Ctrl-C: discards the line.
const INTERRUPT: u8 = 0x03;

/// Why a line does not run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum LineError {
    /// Longer than [`LINE_MAX`].
    #[error("the line has {length} bytes, at most {LINE_MAX} are allowed: nothing was done")]
    TooLong { length: usize },
    #[error("the line has bytes that are no text: nothing was done")]
    NotText,
}

/// A line being typed.
#[derive(Debug, Default)]
pub(super) struct LineBuffer {
    bytes: Vec<u8>,
    /// Bytes beyond the longest line.
    overflow: usize,
    is_garbled: bool,
}

impl LineBuffer {
    /// Adds one byte; returns the line at its last byte. `\r` is ignored, so that `\r\n` ends a line
    /// as `\n` does.
    pub(super) fn push(&mut self, byte: u8) -> Option<Result<String, LineError>> {
        match byte {
            b'\n' => return Some(self.finish()),
            b'\r' | 0 => {}
            BACKSPACE | DELETE => {
                self.bytes.pop();
            }
            INTERRUPT => *self = Self::default(),
            _ if self.bytes.len() >= LINE_MAX => self.overflow = self.overflow.saturating_add(1),
            b'\t' => self.bytes.push(b' '),
            byte => {
                self.is_garbled |= !(b' '..=b'~').contains(&byte);
                self.bytes.push(byte);
            }
        }
        None
    }

    fn finish(&mut self) -> Result<String, LineError> {
        let Self { bytes, overflow, is_garbled } = core::mem::take(self);
        if overflow > 0 {
            return Err(LineError::TooLong { length: bytes.len() + overflow });
        }
        if is_garbled {
            return Err(LineError::NotText);
        }
        String::from_utf8(bytes).map_err(|_| LineError::NotText)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> Vec<Result<String, LineError>> {
        let mut buffer = LineBuffer::default();
        bytes.iter().filter_map(|byte| buffer.push(*byte)).collect()
    }

    #[test]
    fn both_ends_of_a_line_are_understood_and_an_unfinished_line_waits() {
        let expected: Vec<_> = ["one", "two", ""].map(|line| Ok(line.to_owned())).into();
        assert_eq!(lines(b"one\ntwo\r\n\nthr"), expected);
    }

    #[test]
    fn corrections_and_a_line_that_is_taken_back() {
        assert_eq!(
            lines(b"stat\x08\x7Fy\nstatus\x03help\n"),
            [Ok("sty".to_owned()), Ok("help".to_owned())]
        );
    }

    #[test]
    fn a_line_that_is_too_long_is_an_error_and_the_next_one_is_whole() {
        let mut bytes = vec![b'x'; 1_000];
        bytes.extend_from_slice(b"\nhelp\n");
        let expected = [Err(LineError::TooLong { length: 1_000 }), Ok("help".to_owned())];
        assert_eq!(lines(&bytes), expected);
        let longest = "x".repeat(LINE_MAX);
        assert_eq!(lines(format!("{longest}\n").as_bytes()), [Ok(longest)]);
    }

    #[test]
    fn bytes_that_are_no_text_are_an_error_and_the_next_line_is_whole() {
        let expected = [Err(LineError::NotText), Ok("help".to_owned())];
        assert_eq!(lines(b"\xFF\xFE\x01\nhelp\n"), expected);
    }
}
