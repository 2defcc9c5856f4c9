//! What came over a connection and was not understood yet: the beginning of a frame, or frames that wait
//! until there is room for their answers.

/// Bytes that may wait: one read, and the beginning of a frame in front of it.
const INBOX_MAX: usize = 4096;

/// The bytes of one connection, in order.
#[derive(Debug, Default)]
pub struct Inbox {
    bytes: Vec<u8>,
    held: bool,
}

impl Inbox {
    /// Appends what was read. Returns how many bytes found no room: none if nothing is read while the
    /// inbox is held.
    pub fn receive(&mut self, bytes: &[u8]) -> usize {
        let fitting = bytes.len().min(INBOX_MAX.saturating_sub(self.bytes.len()));
        self.bytes.extend(bytes.iter().take(fitting));
        bytes.len() - fitting
    }

    /// Takes everything out.
    pub fn take(&mut self) -> Vec<u8> {
        core::mem::take(&mut self.bytes)
    }

    /// Puts `bytes` back without the first `used`. `held` if frames among them wait for room.
    pub fn put_back(&mut self, mut bytes: Vec<u8>, used: usize, held: bool) {
        bytes.drain(..used.min(bytes.len()));
        self.bytes = bytes;
        self.held = held;
    }

    /// Frames wait for room.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.held
    }
}
