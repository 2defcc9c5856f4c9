//! MAVLink FTP: read-only files that describe the autopilot, and a writable folder of scripts.
//!
//! A script is written in place: an interrupted upload leaves an incomplete script, which does not start. When two clients
//! write the same file, the one that began later continues and the other loses its session.
//!
//! Each ground station has its own sessions. A session has the number that the client requests, if it is
//! free: QGroundControl and MAVSDK take the number from the answer, MAVProxy insists on its own. The service answers a
//! repeated request with its first answer, unless it requests a list or a checksum.

use core::time::Duration;
use std::sync::Arc;

use ::mavlink::dialects::common::{
    FILE_TRANSFER_PROTOCOL_DATA, MavFtpErr as Problem, MavFtpOpcode as Opcode,
};
use arrayvec::ArrayVec;

use crate::codec::{Encoded, Message};
use crate::component_metadata::crc32;
use crate::peers::{From, Peers};
use crate::scripts::Upload;
use crate::wall_time::WallTime;
use crate::{Service, Shared};

/// Open files of one client.
const SESSIONS_MAX: usize = 4;
/// Clients behind one peer; another one replaces the one that has been silent for longest.
const CLIENTS_OF_A_PEER_MAX: usize = 4;
/// The service forgets a client, with its sessions, after this long a silence.
const SILENCE: Duration = Duration::from_secs(60);
/// A request that is repeated within this time is the same one, whose answer was lost.
const REPEATED_WITHIN: Duration = Duration::from_secs(2);
/// Messages of a burst that are sent together.
const BURST: usize = 4;
/// Time between them: 200 kB/s.
const BURST_INTERVAL: Duration = Duration::from_millis(5);
/// Messages of a burst before the client must request more, so that no burst runs for ever.
const BURST_MAX: usize = 256;
/// A burst waits while a peer has less room than this for answers.
const ROOM_MIN: usize = 96;

#[derive(Debug, Clone)]
struct FtpSession {
    number: u8,
    file: FtpFile,
}

/// Purpose of a session.
#[derive(Debug, Clone)]
enum FtpFile {
    Read(Content),
    Write(Upload),
}

#[derive(Debug)]
struct Burst {
    session: u8,
    content: Content,
    opcode: u8,
    /// Bytes in each message.
    size: usize,
    offset: u32,
    sequence: u16,
    left: usize,
}

/// One client of a ground station.
#[derive(Debug)]
struct FtpClient {
    from: From,
    last_seen: WallTime,
    sessions: ArrayVec<FtpSession, SESSIONS_MAX>,
    burst: Option<Burst>,
    /// The latest request that may be repeated, its answer, and the time of its first copy.
    latest: Option<([u8; LENGTH], Reply, WallTime)>,
}

#[derive(Debug, Default)]
pub struct FtpService {
    clients: Vec<FtpClient>,
    next_burst: WallTime,
}

impl Service for FtpService {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        let Message::Ftp(bytes) = message else { return };
        let Some(request) = Request::parse(bytes) else { return };
        let client = self.client(from, now);
        if let Some((latest, reply, at)) = &client.latest
            && *latest == **bytes
            && now.since(*at) < REPEATED_WITHIN
        {
            return send(&mut shared.peers, from, reply.clone());
        }
        match client.answer(&request, shared) {
            Some(reply) => {
                // To answer these twice does no harm, and the second answer is newer.
                let is_question = [LIST_DIRECTORY, CALCULATE_CRC_32].contains(&request.opcode);
                client.latest = (!is_question).then(|| (**bytes, reply.clone(), now));
                send(&mut shared.peers, from, reply);
            }
            // A burst, which begins with the next poll; a repeated request restarts it.
            None => client.latest = None,
        }
    }

    /// Sends the due part of each burst, and forgets clients that are gone.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        self.clients.retain(|client| {
            shared.peers.knows(client.from.peer) && now.since(client.last_seen) < SILENCE
        });
        if now < self.next_burst {
            return;
        }
        for client in self.clients.iter_mut().filter(|client| client.burst.is_some()) {
            self.next_burst = now + BURST_INTERVAL;
            for _ in 0..BURST {
                if shared.peers.room(client.from.peer) < ROOM_MIN {
                    break;
                }
                let Some(reply) = client.continue_burst() else { break };
                send(&mut shared.peers, client.from, reply);
            }
        }
    }

    fn next_deadline(&self, _: &Shared) -> Option<WallTime> {
        let is_sending = self.clients.iter().any(|client| client.burst.is_some());
        is_sending.then_some(self.next_burst)
    }
}

impl FtpService {
    fn client(&mut self, from: From, now: WallTime) -> &mut FtpClient {
        let known = self.clients.iter().position(|client| client.from == from);
        let place = known.unwrap_or_else(|| {
            let same_peer = |client: &&FtpClient| client.from.peer == from.peer;
            if self.clients.iter().filter(same_peer).count() >= CLIENTS_OF_A_PEER_MAX {
                let oldest =
                    self.clients.iter().filter(same_peer).min_by_key(|client| client.last_seen);
                let oldest = oldest.map(|client| client.from);
                self.clients.retain(|client| Some(client.from) != oldest);
            }
            self.clients.push(FtpClient::new(from));
            self.clients.len() - 1
        });
        let client = &mut self.clients[place];
        client.last_seen = now;
        client
    }
}

impl FtpClient {
    fn new(from: From) -> Self {
        let last_seen = WallTime::ZERO;
        Self { from, last_seen, sessions: ArrayVec::new(), burst: None, latest: None }
    }

    /// `None`: a burst begins.
    fn answer(&mut self, request: &Request<'_>, shared: &mut Shared) -> Option<Reply> {
        let answer = match request.opcode {
            NOTHING => Ok(request.ack(&[])),
            TERMINATE_SESSION => self.terminate(request, shared),
            RESET_SESSIONS => {
                for session in core::mem::take(&mut self.sessions) {
                    session.end(shared);
                }
                self.burst = None;
                Ok(request.ack(&[]))
            }
            LIST_DIRECTORY => list(request, shared),
            OPEN_FILE_READ_ONLY => self.open(request, shared),
            READ_FILE => self.read(request),
            CALCULATE_CRC_32 => {
                find(request, shared).map(|file| request.ack(&crc32(&file).to_le_bytes()))
            }
            BURST_READ_FILE => match self.begin_burst(request) {
                Ok(()) => return None,
                Err(problem) => Err(problem),
            },
            CREATE_FILE => self.create(request, true, shared),
            OPEN_FILE_WRITE_ONLY => self.create(request, false, shared),
            WRITE_FILE => self.write(request, shared),
            TRUNCATE_FILE => writable(request).and_then(|name| {
                shared.scripts.truncate(name, request.offset).map(|()| request.ack(&[]))
            }),
            REMOVE_FILE => writable(request)
                .and_then(|name| shared.scripts.remove(name).map(|()| request.ack(&[]))),
            // Folder and rename operations.
            9 | 10 | 13 => Err(Problem::MAV_FTP_ERR_FILEPROTECTED),
            _ => Err(Problem::MAV_FTP_ERR_UNKNOWNCOMMAND),
        };
        Some(answer.unwrap_or_else(|problem| request.nak(problem)))
    }

    fn session(&self, number: u8) -> Result<&FtpSession, Problem> {
        self.sessions
            .iter()
            .find(|session| session.number == number)
            .ok_or(Problem::MAV_FTP_ERR_INVALIDSESSION)
    }

    /// The file that a session reads.
    fn content(&self, number: u8) -> Result<&Content, Problem> {
        match &self.session(number)?.file {
            FtpFile::Read(content) => Ok(content),
            FtpFile::Write(_) => Err(Problem::MAV_FTP_ERR_INVALIDSESSION),
        }
    }

    fn open(&mut self, request: &Request<'_>, shared: &Shared) -> Result<Reply, Problem> {
        let content = find(request, shared)?;
        let size = u32::try_from(content.len()).unwrap_or(u32::MAX);
        let number = self.begin(request, FtpFile::Read(content))?;
        Ok(request.ack(&size.to_le_bytes()).of_session(number))
    }

    /// Begins to write a script.
    fn create(
        &mut self,
        request: &Request<'_>,
        truncate: bool,
        shared: &mut Shared,
    ) -> Result<Reply, Problem> {
        let name = writable(request)?;
        // An earlier upload by this client ends.
        let is_it = |file: &FtpFile| matches!(file, FtpFile::Write(upload) if upload.name == name);
        self.sessions.retain(|session| !is_it(&session.file));
        if self.sessions.is_full() {
            return Err(Problem::MAV_FTP_ERR_NOSESSIONSAVAILABLE);
        }
        let upload = shared.scripts.open(name, truncate)?;
        let number = self.begin(request, FtpFile::Write(upload))?;
        Ok(request.ack(&[]).of_session(number))
    }

    fn begin(&mut self, request: &Request<'_>, file: FtpFile) -> Result<u8, Problem> {
        let is_free = |number: &u8| self.session(*number).is_err();
        let mut numbers = core::iter::once(request.session).chain(0..=u8::MAX);
        let number = numbers.find(is_free).ok_or(Problem::MAV_FTP_ERR_NOSESSIONSAVAILABLE)?;
        let opened = self.sessions.try_push(FtpSession { number, file });
        opened.map_err(|_| Problem::MAV_FTP_ERR_NOSESSIONSAVAILABLE)?;
        Ok(number)
    }

    fn write(&self, request: &Request<'_>, shared: &mut Shared) -> Result<Reply, Problem> {
        let FtpFile::Write(upload) = &self.session(request.session)?.file else {
            return Err(Problem::MAV_FTP_ERR_INVALIDSESSION);
        };
        if request.size == 0 {
            return Err(Problem::MAV_FTP_ERR_INVALIDDATASIZE);
        }
        shared.scripts.write(upload, request.offset, request.data).map(|()| request.ack(&[]))
    }

    fn terminate(&mut self, request: &Request<'_>, shared: &mut Shared) -> Result<Reply, Problem> {
        let is_it = |session: &FtpSession| session.number == request.session;
        let place =
            self.sessions.iter().position(is_it).ok_or(Problem::MAV_FTP_ERR_INVALIDSESSION)?;
        self.sessions.remove(place).end(shared);
        // The rest of its burst would have a session that the client has closed.
        self.burst.take_if(|burst| burst.session == request.session);
        Ok(request.ack(&[]))
    }

    fn read(&self, request: &Request<'_>) -> Result<Reply, Problem> {
        let content = self.content(request.session)?;
        if request.size == 0 {
            return Err(Problem::MAV_FTP_ERR_INVALIDDATASIZE);
        }
        part(content, request.offset, request.size).map(|data| request.ack(data))
    }

    fn begin_burst(&mut self, request: &Request<'_>) -> Result<(), Problem> {
        let content = self.content(request.session)?.clone();
        self.burst = Some(Burst {
            session: request.session,
            content,
            opcode: request.opcode,
            size: if request.size == 0 { DATA_MAX } else { request.size },
            offset: request.offset,
            sequence: request.sequence,
            left: BURST_MAX,
        });
        Ok(())
    }

    /// The next message of the burst. A file ends with a message that marks its end, as with PX4.
    fn continue_burst(&mut self) -> Option<Reply> {
        let burst = self.burst.as_mut()?;
        let request = Request {
            sequence: burst.sequence,
            session: burst.session,
            opcode: burst.opcode,
            size: burst.size,
            offset: burst.offset,
            data: &[],
        };
        match part(&burst.content, burst.offset, burst.size) {
            Ok(data) => {
                burst.left -= 1;
                burst.sequence = burst.sequence.wrapping_add(1);
                burst.offset += u32::try_from(data.len()).unwrap_or_default();
                let mut reply = request.ack(data);
                if burst.left == 0 {
                    // The last message of a burst that continues when the client requests more.
                    reply.0[6] = 1;
                    self.burst = None;
                }
                Some(reply)
            }
            Err(problem) => {
                self.burst = None;
                Some(request.nak(problem))
            }
        }
    }
}

impl FtpSession {
    /// Checks an uploaded script and reports the result to the operator.
    fn end(self, shared: &mut Shared) {
        if let FtpFile::Write(upload) = self.file {
            shared.scripts.finish(&upload, &mut shared.texts);
        }
    }
}

fn find(request: &Request<'_>, shared: &Shared) -> Result<Content, Problem> {
    let found = request.path().and_then(|path| content_at(path, shared));
    found.ok_or(Problem::MAV_FTP_ERR_FILENOTFOUND)
}

/// Entries of a folder from number `offset` on, as many as fit.
fn list(request: &Request<'_>, shared: &Shared) -> Result<Reply, Problem> {
    let listed = request.path().and_then(|path| listed(path, shared));
    let mut text = Vec::new();
    for entry in
        listed.ok_or(Problem::MAV_FTP_ERR_FILENOTFOUND)?.into_iter().skip(request.offset as usize)
    {
        if text.len() + entry.len() > DATA_MAX {
            break;
        }
        text.extend_from_slice(entry.as_bytes());
    }
    if text.is_empty() { Err(Problem::MAV_FTP_ERR_EOF) } else { Ok(request.ack(&text)) }
}

/// Up to `size` bytes from `offset` on; at least one.
fn part(content: &Content, offset: u32, size: usize) -> Result<&[u8], Problem> {
    let rest = content.get(offset as usize..).filter(|rest| !rest.is_empty());
    let rest = rest.ok_or(Problem::MAV_FTP_ERR_EOF)?;
    Ok(&rest[..rest.len().min(size)])
}

fn send(peers: &mut Peers, from: From, reply: Reply) {
    let message = FILE_TRANSFER_PROTOCOL_DATA {
        target_network: 0,
        target_system: from.sender.system,
        target_component: from.sender.component,
        payload: reply.0,
    };
    peers.answer(from.peer, Encoded::new(&message));
}

/// Name of the folder of the scripts.
const SCRIPTS: &str = "scripts";

/// Content of a file, as it was when opened.
type Content = Arc<[u8]>;

/// The name of a script, if the path has the form of one.
fn script_name(path: &str) -> Option<&str> {
    let (folder, name) = path.split_once('/')?;
    (folder == SCRIPTS).then(|| name.trim_matches('/'))
}

/// The name of the script that a request changes.
fn writable<'a>(request: &Request<'a>) -> Result<&'a str, Problem> {
    request.path().and_then(script_name).ok_or(Problem::MAV_FTP_ERR_FILEPROTECTED)
}

/// The file at `path`, which has no slash around it.
fn content_at(path: &str, shared: &Shared) -> Option<Content> {
    if let Some(name) = script_name(path) {
        return shared.scripts.content(name).map(Content::from);
    }
    let mut files = shared.metadata.files().iter();
    files.find(|(name, _)| *name == path).map(|(_, text)| Arc::clone(text).into())
}

/// The entries of a folder, each as it is sent; `None` if there is no such folder.
fn listed(path: &str, shared: &Shared) -> Option<Vec<String>> {
    let file = |name: &str, size: usize| format!("F{name}\t{size}\0");
    match path {
        "" | "." => {
            let files = shared.metadata.files().iter();
            let files = files.map(|(name, text)| file(name, text.len()));
            Some(files.chain([format!("D{SCRIPTS}\0")]).collect())
        }
        SCRIPTS => Some(shared.scripts.files().map(|(name, size)| file(name, size)).collect()),
        _ => None,
    }
}

/// Bytes of a message.
const LENGTH: usize = 251;
const HEADER: usize = 12;
/// Most data in one message.
const DATA_MAX: usize = LENGTH - HEADER;

const ACK: u8 = Opcode::MAV_FTP_OPCODE_ACK as u8;
const NAK: u8 = Opcode::MAV_FTP_OPCODE_NAK as u8;
/// "No space left" as Linux numbers it; ground stations show it.
const ENOSPC: u8 = 28;

// Operations that a client can request.
const NOTHING: u8 = Opcode::MAV_FTP_OPCODE_NONE as u8;
const TERMINATE_SESSION: u8 = Opcode::MAV_FTP_OPCODE_TERMINATESESSION as u8;
const RESET_SESSIONS: u8 = Opcode::MAV_FTP_OPCODE_RESETSESSION as u8;
const LIST_DIRECTORY: u8 = Opcode::MAV_FTP_OPCODE_LISTDIRECTORY as u8;
const OPEN_FILE_READ_ONLY: u8 = Opcode::MAV_FTP_OPCODE_OPENFILERO as u8;
const READ_FILE: u8 = Opcode::MAV_FTP_OPCODE_READFILE as u8;
const CREATE_FILE: u8 = Opcode::MAV_FTP_OPCODE_CREATEFILE as u8;
const WRITE_FILE: u8 = Opcode::MAV_FTP_OPCODE_WRITEFILE as u8;
const REMOVE_FILE: u8 = Opcode::MAV_FTP_OPCODE_REMOVEFILE as u8;
const OPEN_FILE_WRITE_ONLY: u8 = Opcode::MAV_FTP_OPCODE_OPENFILEWO as u8;
const TRUNCATE_FILE: u8 = Opcode::MAV_FTP_OPCODE_TRUNCATEFILE as u8;
const CALCULATE_CRC_32: u8 = Opcode::MAV_FTP_OPCODE_CALCFILECRC as u8;
const BURST_READ_FILE: u8 = Opcode::MAV_FTP_OPCODE_BURSTREADFILE as u8;

/// A request whose sizes are within the limits of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Request<'a> {
    sequence: u16,
    session: u8,
    opcode: u8,
    /// Bytes of data, or requested bytes of a read.
    size: usize,
    offset: u32,
    data: &'a [u8],
}

impl<'a> Request<'a> {
    /// `None` for an answer: the service never requests anything, and answering an answer would never end.
    fn parse(bytes: &'a [u8; LENGTH]) -> Option<Self> {
        let [s0, s1, session, opcode, size, _, _, _, o0, o1, o2, o3, ..] = *bytes;
        if opcode >= ACK {
            return None;
        }
        let size = usize::from(size).min(DATA_MAX);
        Some(Self {
            sequence: u16::from_le_bytes([s0, s1]),
            session,
            opcode,
            size,
            offset: u32::from_le_bytes([o0, o1, o2, o3]),
            data: &bytes[HEADER..HEADER + size],
        })
    }

    /// The path in the data, up to a NUL, without surrounding slashes; `None` if it is not text.
    fn path(&self) -> Option<&'a str> {
        let text = self.data.split(|byte| *byte == 0).next()?;
        Some(core::str::from_utf8(text).ok()?.trim_matches('/'))
    }

    fn ack(&self, data: &[u8]) -> Reply {
        Reply::new(self, ACK).with_data(data)
    }

    fn nak(&self, problem: Problem) -> Reply {
        let reply = Reply::new(self, NAK);
        match problem {
            // With an error number of the system: no space left.
            Problem::MAV_FTP_ERR_FAILERRNO => reply.with_data(&[problem as u8, ENOSPC]),
            _ => reply.with_data(&[problem as u8]),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Reply([u8; LENGTH]);

impl Reply {
    fn new(request: &Request<'_>, opcode: u8) -> Self {
        let mut bytes = [0; LENGTH];
        bytes[..2].copy_from_slice(&request.sequence.wrapping_add(1).to_le_bytes());
        bytes[2] = request.session;
        bytes[3] = opcode;
        bytes[5] = request.opcode;
        bytes[8..HEADER].copy_from_slice(&request.offset.to_le_bytes());
        Self(bytes)
    }

    fn with_data(mut self, data: &[u8]) -> Self {
        let data = &data[..data.len().min(DATA_MAX)];
        self.0[HEADER..HEADER + data.len()].copy_from_slice(data);
        self.0[4] = u8::try_from(data.len()).expect("DATA_MAX fits a byte");
        self
    }

    /// For a session other than that of the request.
    fn of_session(mut self, session: u8) -> Self {
        self.0[2] = session;
        self
    }
}
