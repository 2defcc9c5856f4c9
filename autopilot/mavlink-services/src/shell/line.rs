//! Bytes to lines. A line may come in several pieces, and several lines in one piece.

/// Longest line, bytes.
pub(super) const LINE_MAX: usize = 240;

const BACKSPACE: u8 = 0x08;
const DELETE: u8 = 0x7F;
/// Ctrl-C: the line is not meant.
const INTERRUPT: u8 = 0x03;

/// Why a line is not run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum LineError {
    /// Longer than [`LINE_MAX`].
    #[error("the line has {length} bytes, at most {LINE_MAX} are allowed: nothing was done")]
    TooLong {
        /// How long it is.
        length: usize,
    },
    /// Not ASCII.
    #[error("the line has bytes that are no text: nothing was done")]
    NotText,
}

/// A line under way.
#[derive(Debug, Default)]
pub(super) struct LineBuffer {
    bytes: Vec<u8>,
    /// Bytes beyond the longest line.
    overflow: usize,
    is_garbled: bool,
}

impl LineBuffer {
    /// Takes one byte; a line when it was the last one of it. `\r` counts for nothing, so that `\r\n` ends a line
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
