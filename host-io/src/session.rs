//! The number of a flight on the plant link: random, so that it cannot be guessed, and shown only as a hash.
//!
//! A program that knows the number of a flight and its next sequence number could forge packets of that flight. So the number comes
//! from the random source of the operating system, the only use of that source in the programs, and logs, file
//! names and the screen show [`shown`] instead. No result of a flight depends on it.

use std::io;

use sha2::{Digest, Sha256};

/// Bytes of the hash that are shown: enough to distinguish the flights of one evening.
const SHOWN_BYTES: usize = 4;

/// A new number, from the random source of the operating system.
pub fn draw() -> io::Result<u64> {
    getrandom::u64()
        .map_err(|error| io::Error::other(format!("the system gives no random number: {error}")))
}

/// The session as logs and screens show it: the first eight hexadecimal digits of the SHA-256 of its eight bytes, little endian.
pub fn shown(session: u64) -> String {
    let hash = Sha256::digest(session.to_le_bytes());
    hash.iter().take(SHOWN_BYTES).map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_session_is_shown_as_the_beginning_of_its_sha_256() {
        // printf '\1\0\0\0\0\0\0\0' | sha256sum
        assert_eq!(shown(1), "7c9fa136");
    }

    #[test]
    fn numbers_differ_in_all_their_bytes() {
        // The chance that eight draws agree in a byte is 2^-56.
        let drawn: Vec<[u8; 8]> = (0..8).map(|_| draw().unwrap().to_le_bytes()).collect();
        for byte in 0..8 {
            let differs = drawn.iter().any(|number| number[byte] != drawn[0][byte]);
            assert!(differs, "byte {byte}: {drawn:?}");
        }
    }
}
