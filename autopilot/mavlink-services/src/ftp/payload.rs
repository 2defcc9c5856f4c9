//! The 251 bytes of FILE_TRANSFER_PROTOCOL.

/// Bytes of a message.
pub(super) const LENGTH: usize = 251;
const HEADER: usize = 12;
/// Most data in one message.
pub(super) const DATA_MAX: usize = LENGTH - HEADER;

const ACK: u8 = 128;
const NAK: u8 = 129;
/// "No space left" as Linux numbers it; ground stations show it.
const ENOSPC: u8 = 28;

/// Operations that a client can request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Operation {
    Nothing,
    TerminateSession,
    ResetSessions,
    ListDirectory,
    OpenFileReadOnly,
    ReadFile,
    CalculateCrc32,
    BurstReadFile,
    CreateFile,
    WriteFile,
    RemoveFile,
    OpenFileWriteOnly,
    TruncateFile,
    /// Folder and rename operations: not supported, nothing changes.
    Change,
    Unknown,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Problem {
    /// With an error number of the system: no space left.
    NoSpace = 2,
    InvalidDataSize = 3,
    InvalidSession = 4,
    NoSessionsAvailable = 5,
    EndOfFile = 6,
    UnknownCommand = 7,
    FileProtected = 9,
    FileNotFound = 10,
}

/// A request whose sizes are within the limits of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Request<'a> {
    pub sequence: u16,
    pub session: u8,
    pub opcode: u8,
    /// Bytes of data, or requested bytes of a read.
    pub size: usize,
    pub offset: u32,
    pub data: &'a [u8],
}

impl<'a> Request<'a> {
    /// `None` for an answer: the service never requests anything, and answering an answer would never end.
    pub(super) fn parse(bytes: &'a [u8; LENGTH]) -> Option<Self> {
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

    pub(super) fn operation(&self) -> Operation {
        match self.opcode {
            0 => Operation::Nothing,
            1 => Operation::TerminateSession,
            2 => Operation::ResetSessions,
            3 => Operation::ListDirectory,
            4 => Operation::OpenFileReadOnly,
            5 => Operation::ReadFile,
            6 => Operation::CreateFile,
            7 => Operation::WriteFile,
            8 => Operation::RemoveFile,
            11 => Operation::OpenFileWriteOnly,
            12 => Operation::TruncateFile,
            9 | 10 | 13 => Operation::Change,
            14 => Operation::CalculateCrc32,
            15 => Operation::BurstReadFile,
            _ => Operation::Unknown,
        }
    }

    /// The path in the data, up to a NUL, without surrounding slashes; `None` if it is not text.
    pub(super) fn path(&self) -> Option<&'a str> {
        let text = self.data.split(|byte| *byte == 0).next()?;
        Some(core::str::from_utf8(text).ok()?.trim_matches('/'))
    }

    pub(super) fn ack(&self, data: &[u8]) -> Reply {
        Reply::new(self, ACK).with_data(data)
    }

    pub(super) fn nak(&self, problem: Problem) -> Reply {
        let reply = Reply::new(self, NAK);
        match problem {
            Problem::NoSpace => reply.with_data(&[problem as u8, ENOSPC]),
            _ => reply.with_data(&[problem as u8]),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Reply([u8; LENGTH]);

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
    pub(super) fn of_session(mut self, session: u8) -> Self {
        self.0[2] = session;
        self
    }

    /// The last message of a burst that continues when the client requests more.
    pub(super) fn ending_burst(mut self, ends: bool) -> Self {
        self.0[6] = u8::from(ends);
        self
    }

    pub(super) fn bytes(self) -> [u8; LENGTH] {
        self.0
    }
}
