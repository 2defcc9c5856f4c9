//! The secret that both ends share. It is shown nowhere but in its own file.

use core::fmt;

use sha2::{Digest as _, Sha256};

use super::timestamp::Timestamp;

/// Length of a key, bytes.
pub const KEY: usize = 32;
/// What follows a signed frame: link, timestamp, signature.
pub const TRAILER: usize = LINK + TIME + HASH;
const LINK: usize = 1;
const TIME: usize = 6;
const HASH: usize = 6;

/// A key. Never all zeros, which means "no signing".
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Key([u8; KEY]);

impl fmt::Debug for Key {
    /// Without the key.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key(not shown)")
    }
}

impl Key {
    /// `None` for zeros only.
    #[must_use]
    pub fn new(bytes: [u8; KEY]) -> Option<Self> {
        (bytes != [0; KEY]).then_some(Self(bytes))
    }

    /// From 64 hexadecimal digits; `None` for anything else, and for zeros only.
    #[must_use]
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits: Vec<u8> =
            text.chars().map(|c| c.to_digit(16)?.try_into().ok()).collect::<Option<_>>()?;
        let (pairs, rest) = digits.as_chunks::<2>();
        let bytes: Vec<u8> = pairs.iter().map(|[high, low]| high << 4 | low).collect();
        rest.is_empty().then(|| bytes.try_into().ok()).flatten().and_then(Self::new)
    }

    /// 64 hexadecimal digits, for the key file only.
    #[must_use]
    pub fn to_hex(self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The trailer of a frame that ends with its checksum: `sha256_48(key + frame + link + timestamp)`.
    #[must_use]
    pub fn sign(&self, frame: &[u8], link: u8, at: Timestamp) -> [u8; TRAILER] {
        let [t0, t1, t2, t3, t4, t5] = at.to_bytes();
        let mut hash = Sha256::new();
        hash.update(self.0);
        hash.update(frame);
        hash.update([link, t0, t1, t2, t3, t4, t5]);
        let hash = hash.finalize();
        let mut trailer = [link, t0, t1, t2, t3, t4, t5, 0, 0, 0, 0, 0, 0];
        trailer[LINK + TIME..].copy_from_slice(&hash[..HASH]);
        trailer
    }

    /// Whether this trailer belongs to this frame. Takes the same time wherever they differ.
    #[must_use]
    pub fn is_right(&self, frame: &[u8], trailer: Trailer) -> bool {
        let right = self.sign(frame, trailer.link(), trailer.at());
        let differences = right.iter().zip(trailer.0).fold(0, |sum, (a, b)| sum | (a ^ b));
        differences == 0
    }
}

/// What follows a signed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trailer(pub [u8; TRAILER]);

impl Trailer {
    /// Link of the sender; it means something to the sender only.
    #[must_use]
    pub fn link(self) -> u8 {
        self.0[0]
    }

    /// When it was signed.
    #[must_use]
    pub fn at(self) -> Timestamp {
        let [_, t0, t1, t2, t3, t4, t5, ..] = self.0;
        Timestamp::from_bytes([t0, t1, t2, t3, t4, t5])
    }
}
