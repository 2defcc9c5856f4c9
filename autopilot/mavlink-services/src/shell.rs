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

use ::mavlink::dialects::common::{SERIAL_CONTROL_DATA, SerialControlDev, SerialControlFlag};

use crate::codec::{Encoded, Identity, Message};
use crate::peers::From;
use crate::shell::session::Session;
use crate::wall_time::WallTime;
use crate::{Service, Shared};
use flight_management::command::Outcome;
use flight_management::vehicle::Mode;

mod commands;
mod session;

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
    sessions: Vec<Session>,
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
        let session = self.sessions.iter().find(|session| session.waits_for(mode));
        session.map(|session| session.from.sender)
    }

    /// Runs the lines that are ready, sends the due part of each output, gives up commands without an answer, and forgets
    /// peers that are gone.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        for _ in 0..LINES_AT_ONCE {
            let ready = self.sessions.iter_mut().find(|session| session.is_ready());
            let Some(session) = ready else { break };
            let Some(line) = session.next_line() else { continue };
            shared.note_streams(session.from, now);
            let answer = commands::run(&line, now, shared);
            session.answer(answer, now, shared);
        }
        self.sessions.retain(|session| shared.peers.knows(session.from.peer));
        for session in &mut self.sessions {
            session.poll(now, shared);
        }
        if now < self.next_burst {
            return;
        }
        for session in self.sessions.iter_mut().filter(|session| session.has_output()) {
            self.next_burst = now + BURST_INTERVAL;
            for _ in 0..BURST {
                if shared.peers.room(session.from.peer) < ROOM_MIN {
                    break;
                }
                let Some(chunk) = session.next_chunk(CHUNK) else { break };
                shared.peers.answer(session.from.peer, reply(session.from, &chunk));
            }
        }
    }

    fn next_deadline(&self, _: &Shared) -> Option<WallTime> {
        let of_session = |session: &Session| {
            if session.is_ready() {
                return Some(WallTime::ZERO);
            }
            let output = session.has_output().then_some(self.next_burst);
            [output, session.answer_deadline()].into_iter().flatten().min()
        };
        self.sessions.iter().filter_map(of_session).min()
    }
}

impl ShellService {
    fn session(&mut self, from: From) -> &mut Session {
        let known = self.sessions.iter().position(|session| session.from == from);
        let place = known.unwrap_or_else(|| {
            if self.sessions.len() >= SESSIONS_MAX {
                let silent = self.sessions.iter().enumerate().min_by_key(|(_, s)| s.received);
                if let Some((place, _)) = silent {
                    self.sessions.swap_remove(place);
                }
            }
            self.sessions.push(Session::new(from));
            self.sessions.len() - 1
        });
        &mut self.sessions[place]
    }
}

fn reply(from: From, chunk: &[u8]) -> Encoded {
    let mut data = [0; CHUNK];
    data[..chunk.len()].copy_from_slice(chunk);
    Encoded::new(&SERIAL_CONTROL_DATA {
        baudrate: 0,
        timeout: 0,
        device: SerialControlDev::SERIAL_CONTROL_DEV_SHELL,
        flags: SerialControlFlag::SERIAL_CONTROL_FLAG_REPLY,
        count: u8::try_from(chunk.len()).unwrap_or_default(),
        data,
        target_system: from.sender.system,
        target_component: from.sender.component,
    })
}
