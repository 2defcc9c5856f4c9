//! A command line over SERIAL_CONTROL: the MAVLink console of QGroundControl, the shell of MAVSDK.
//!
//! ```text
//!  SERIAL_CONTROL ─> line ─> session ─> commands ─> intents ─> control thread
//!   (device 10)                ^            │ at once
//!        outcomes ─────────────┘            v
//!                           output ─> SERIAL_CONTROL, REPLY, to the sender alone
//! ```
//!
//! Each system and component behind each link has its own session. One command runs at a time; output that depends
//! on the aircraft is printed when the aircraft has answered, and the prompt follows.

use core::time::Duration;
use std::collections::VecDeque;

use ::mavlink::dialects::common::{
    MavSeverity, SERIAL_CONTROL_DATA, SerialControlDev, SerialControlFlag,
};
use icd::EffectorList;
use icd::fault::{FaultReply, NO_ANSWER, Target};

use crate::codec::{Encoded, Identity, Message, printable};
use crate::peers::From;
use crate::queues::OpenCommand;
use crate::shell::commands::{Answer, Output};
use crate::wall_time::WallTime;
use crate::{Service, Shared, command, failure};
use flight_management::command::Outcome;
use flight_management::vehicle::Mode;

mod commands;

const DEVICE_SHELL: u8 = 10;
/// The message is an answer.
const FLAG_REPLY: u8 = 1;
/// The sender expects answers.
const FLAG_RESPOND: u8 = 2;
/// Bytes of one message.
const CHUNK: usize = 70;
/// Sessions at the same time; another one replaces the one that has been silent for longest.
const SESSIONS_MAX: usize = 24;
/// Lines that one poll runs.
const LINES_AT_ONCE: usize = 32;
/// Messages of one session that are sent together.
const BURST: usize = 5;
/// Time between two bursts.
const BURST_INTERVAL: Duration = Duration::from_millis(10);
/// Output waits while a peer has less room than this for answers.
const ROOM_MIN: usize = 96;

#[derive(Debug, Default)]
pub struct ShellService {
    sessions: Vec<ShellSession>,
    next_burst: WallTime,
}

impl Service for ShellService {
    /// Handles typed input; other devices and answers are ignored.
    fn handle(&mut self, from: From, message: &Message, now: WallTime, _: &mut Shared) {
        let Message::SerialControl(data) = message else { return };
        if data.device != DEVICE_SHELL || data.flags & FLAG_REPLY != 0 {
            return;
        }
        let expects_answers = data.flags & FLAG_RESPOND != 0;
        if data.typed.is_empty() && !expects_answers {
            // The console was closed.
            return self.sessions.retain(|session| session.from != from);
        }
        let session = self.session(from);
        session.received = now;
        session.listens(expects_answers);
        session.take(&data.typed);
    }

    fn handle_outcome(&mut self, number: u32, outcome: &Outcome, _: WallTime, shared: &mut Shared) {
        for session in &mut self.sessions {
            session.handle_outcome(number, outcome, shared);
        }
    }

    fn requester_of(&self, mode: Mode) -> Option<Identity> {
        let waits = |running: &RunningCommand| running.mode == Some(mode);
        let session = self.sessions.iter().find(|one| one.running.as_ref().is_some_and(waits));
        session.map(|session| session.from.sender)
    }

    /// Runs the lines that are ready, sends the due part of each output, gives up commands without an answer, and forgets
    /// peers that are gone.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        for _ in 0..LINES_AT_ONCE {
            let ready = self.sessions.iter_mut().find(|session| session.is_ready());
            let Some(session) = ready else { break };
            let Some(line) = session.next_line() else { continue };
            // A line may ask for a mode that needs a stream of its sender.
            shared.note_streams(session.from, now);
            let answer = commands::run(&line, now, shared);
            session.answer(answer, now, shared);
        }
        // Behind the lines: the answer to a peer that is gone is dropped with it.
        self.sessions.retain(|session| shared.peers.knows(session.from.peer));
        for session in &mut self.sessions {
            session.poll(now, shared);
        }
        if now < self.next_burst {
            return;
        }
        for session in self.sessions.iter_mut().filter(|session| !session.output.is_empty()) {
            self.next_burst = now + BURST_INTERVAL;
            for _ in 0..BURST {
                if shared.peers.room(session.from.peer) < ROOM_MIN {
                    break;
                }
                let Some(message) = session.next_message() else { break };
                shared.peers.answer(session.from.peer, message);
            }
        }
    }

    fn next_deadline(&self, _: &Shared) -> Option<WallTime> {
        let of_session = |session: &ShellSession| {
            if session.is_ready() {
                return Some(WallTime::ZERO);
            }
            let output = (!session.output.is_empty()).then_some(self.next_burst);
            let running = session.running.as_ref().map(|running| running.since + ANSWER_TIMEOUT);
            [output, running].into_iter().flatten().min()
        };
        self.sessions.iter().filter_map(of_session).min()
    }
}

impl ShellService {
    fn session(&mut self, from: From) -> &mut ShellSession {
        let known = self.sessions.iter().position(|session| session.from == from);
        let place = known.unwrap_or_else(|| {
            if self.sessions.len() >= SESSIONS_MAX {
                let silent = self.sessions.iter().enumerate().min_by_key(|(_, s)| s.received);
                if let Some((place, _)) = silent {
                    self.sessions.swap_remove(place);
                }
            }
            self.sessions.push(ShellSession::new(from));
            self.sessions.len() - 1
        });
        &mut self.sessions[place]
    }
}

/// Lines that may wait behind a command. More are refused with a text.
const LINES_MAX: usize = 32;
/// Output that may wait before no further line runs, bytes.
const OUTPUT_FULL: usize = 8 * 1024;
/// A command without an answer is given up after this.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);
/// Text to print when a line is done.
const PROMPT: &str = "two-step> ";

/// The running command, which waits for the aircraft.
#[derive(Debug)]
struct RunningCommand {
    since: WallTime,
    parts: Vec<OpenCommand>,
    /// The text to print when every part is done.
    done: String,
    has_failed: bool,
    /// A fault was removed from the list.
    has_cleared: bool,
    /// At least one part had no fault to remove.
    no_active_fault: bool,
    steers: bool,
    mode: Option<Mode>,
}

#[derive(Debug)]
struct ShellSession {
    from: From,
    received: WallTime,
    /// The client expects output.
    expects_answers: bool,
    /// The client has received its first prompt.
    is_prompted: bool,
    buffer: LineBuffer,
    lines: VecDeque<String>,
    refused_lines: usize,
    running: Option<RunningCommand>,
    output: VecDeque<u8>,
}

impl ShellSession {
    fn new(from: From) -> Self {
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
    fn listens(&mut self, expects_answers: bool) {
        self.expects_answers = expects_answers;
        if expects_answers && !self.is_prompted {
            self.is_prompted = true;
            self.print(PROMPT);
        }
    }

    fn take(&mut self, typed: &[u8]) {
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
    fn is_ready(&self) -> bool {
        let has_line = !self.lines.is_empty();
        has_line && self.running.is_none() && self.output.len() < OUTPUT_FULL
    }

    /// The next line to run, after its echo: the echo of a line that waited follows the prompt of the line before it. A line
    /// that is an error already is answered here.
    fn next_line(&mut self) -> Option<String> {
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
    fn answer(&mut self, answer: Answer, now: WallTime, shared: &mut Shared) {
        let (text, commands) = match answer {
            Ok(Output { text, commands }) if commands.is_empty() => return self.finish(&text),
            Ok(Output { text, commands }) => (text, commands),
            Err(reason) => return self.finish(&format!("ERROR: {reason}\n")),
        };
        // All commands of a line or none: half of a line could not be undone.
        if shared.intents.room() < commands.len() {
            return self.finish("ERROR: too many commands are waiting\n");
        }
        let now_mode = shared.aircraft.mode();
        let steers = commands.iter().any(|command| command::steers(command, now_mode));
        let mode = commands.iter().find_map(command::mode_of);
        let parts = commands.into_iter().filter_map(|command| shared.intents.open(command));
        self.running = Some(RunningCommand {
            since: now,
            parts: parts.collect(),
            done: text,
            has_failed: false,
            has_cleared: false,
            no_active_fault: false,
            steers,
            mode,
        });
    }

    /// Handles the outcome of an intent; prints it if it belongs to the running command.
    fn handle_outcome(&mut self, number: u32, outcome: &Outcome, shared: &mut Shared) {
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
                running.no_active_fault = true;
                return self.close_if_done(shared);
            }
            running.has_cleared = true;
        }
        let (line, has_failed) = line_of(part.target(), outcome, shared.effectors());
        running.has_failed |= has_failed;
        if has_failed {
            // This client reads it here; the others find it in the flight log.
            let text = format!("Shell: {}", line.trim_end());
            shared.texts.log(MavSeverity::MAV_SEVERITY_WARNING, text);
        }
        self.print(&line);
        self.close_if_done(shared);
    }

    /// Gives up a command that has waited too long for an answer.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        let is_over = |running: &&mut RunningCommand| now.since(running.since) >= ANSWER_TIMEOUT;
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
        // With another part mended, the line has its answer already.
        if running.no_active_fault && !running.has_cleared {
            self.print("no active fault\n");
        }
        if running.has_failed {
            return self.finish("");
        }
        if running.steers {
            shared.control.take(self.from.sender);
        }
        self.finish(&running.done);
    }

    /// Ends the output of a line, and prints the prompt.
    fn finish(&mut self, text: &str) {
        self.print(text);
        if self.refused_lines > 0 && self.lines.is_empty() {
            let count = core::mem::take(&mut self.refused_lines);
            let error = format!("{count} lines were not taken, at most {LINES_MAX} may wait");
            self.print(&format!("ERROR: {error}\n"));
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

    /// The next message with output, if there is any.
    fn next_message(&mut self) -> Option<Encoded> {
        let size = CHUNK.min(self.output.len());
        if size == 0 {
            return None;
        }
        let mut data = [0; CHUNK];
        for (place, byte) in data.iter_mut().zip(self.output.drain(..size)) {
            *place = byte;
        }
        Some(Encoded::new(&SERIAL_CONTROL_DATA {
            device: SerialControlDev::SERIAL_CONTROL_DEV_SHELL,
            flags: SerialControlFlag::SERIAL_CONTROL_FLAG_REPLY,
            count: u8::try_from(size).unwrap_or_default(),
            data,
            target_system: self.from.sender.system,
            target_component: self.from.sender.component,
            ..SERIAL_CONTROL_DATA::DEFAULT
        }))
    }
}

/// Marks a line that is an error already; no typed line begins with it, since it is not text.
const ERROR_LINE: &str = "\u{1}";

/// Text of the outcome of a part, and whether the part failed.
fn line_of(target: Option<Target>, outcome: &Outcome, effectors: &EffectorList) -> (String, bool) {
    let whose = target.map_or(String::new(), |target| format!("{}: ", target.name(effectors)));
    let failed = |reason: &dyn core::fmt::Display| (format!("ERROR: {whose}{reason}\n"), true);
    let done = |what: &str, at| (format!("{whose}{what} {at}\n"), false);
    match outcome {
        Outcome::Done => (String::new(), false),
        Outcome::Refused(refusal) => failed(refusal),
        Outcome::NoAnswer => failed(&NO_ANSWER),
        Outcome::Plant(FaultReply::Refused(refusal)) => {
            failed(&failure::refused(refusal, target, effectors))
        }
        Outcome::Plant(FaultReply::Applied { at }) => done("acts since", at),
        Outcome::Plant(FaultReply::Scheduled { at }) => done("acts at", at),
        Outcome::Plant(FaultReply::Unchanged { at }) => {
            done("nothing changed, the same fault is there:", at)
        }
        Outcome::Plant(FaultReply::Cleared { at }) => done("healthy since", at),
    }
}

/// Longest line, bytes.
const LINE_MAX: usize = 240;

const BACKSPACE: u8 = 0x08;
const DELETE: u8 = 0x7F;
/// Ctrl-C: discards the line.
const INTERRUPT: u8 = 0x03;

/// A line being typed.
#[derive(Debug, Default)]
struct LineBuffer {
    bytes: Vec<u8>,
    /// Bytes beyond the longest line.
    overflow: usize,
    is_garbled: bool,
}

impl LineBuffer {
    /// Adds one byte; returns the line at its last byte. `\r` is ignored, so that `\r\n` ends a line
    /// as `\n` does.
    fn push(&mut self, byte: u8) -> Option<Result<String, String>> {
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
                // Kept all the same, so that a backspace can still take it away and the length is right.
                self.is_garbled |= !(b' '..=b'~').contains(&byte);
                self.bytes.push(byte);
            }
        }
        None
    }

    fn finish(&mut self) -> Result<String, String> {
        let Self { bytes, overflow, is_garbled } = core::mem::take(self);
        if overflow > 0 {
            let length = bytes.len() + overflow;
            return Err(format!(
                "the line has {length} bytes, at most {LINE_MAX} are allowed: nothing was done"
            ));
        }
        let text = String::from_utf8(bytes).ok().filter(|_| !is_garbled);
        text.ok_or_else(|| "the line has bytes that are no text: nothing was done".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> Vec<Result<String, String>> {
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
        let error = "the line has 1000 bytes, at most 240 are allowed: nothing was done";
        let expected = [Err(error.to_owned()), Ok("help".to_owned())];
        assert_eq!(lines(&bytes), expected);
        let longest = "x".repeat(LINE_MAX);
        assert_eq!(lines(format!("{longest}\n").as_bytes()), [Ok(longest)]);
    }

    #[test]
    fn bytes_that_are_no_text_are_an_error_and_the_next_line_is_whole() {
        let error = "the line has bytes that are no text: nothing was done";
        let expected = [Err(error.to_owned()), Ok("help".to_owned())];
        assert_eq!(lines(b"\xFF\xFE\x01\nhelp\n"), expected);
    }
}
