//! The output of a log: whole messages, in large pieces.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

/// One piece, bytes.
const BUFFER_BYTES: usize = 256 * 1024;

/// A log file. Each call of [`Write::write`] is one message; a piece ends between two of them, so that a piece that
/// finds no room can be taken back.
#[derive(Debug)]
pub struct LogFile {
    file: File,
    buffer: Vec<u8>,
    /// Bytes of the file that are whole messages.
    whole: u64,
}

impl LogFile {
    /// Creates a file that is not there yet, and locks it: a locked log is not removed.
    pub fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        // A file system without locks only loses the protection from being removed.
        let _ = file.try_lock();
        Ok(Self { file, buffer: Vec::with_capacity(BUFFER_BYTES), whole: 0 })
    }

    fn pass_on(&mut self) -> io::Result<()> {
        let result = self.file.write_all(&self.buffer);
        match result {
            Ok(()) => self.whole += self.buffer.len() as u64,
            Err(_) => {
                // As far as the system lets us: the file ends with a whole message.
                let _ = self.file.set_len(self.whole);
                let _ = self.file.seek(SeekFrom::Start(self.whole));
            }
        }
        self.buffer.clear();
        result
    }
}

impl Write for LogFile {
    fn write(&mut self, message: &[u8]) -> io::Result<usize> {
        if self.buffer.len() + message.len() > BUFFER_BYTES {
            self.pass_on()?;
        }
        self.buffer.extend_from_slice(message);
        Ok(message.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.buffer.is_empty() { Ok(()) } else { self.pass_on() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_arrive_in_order_and_a_file_is_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let mut file = LogFile::create(&path).unwrap();
        let message = [7; 1000];
        for _ in 0..1000 {
            file.write_all(&message).unwrap();
        }
        file.write_all(b"end").unwrap();
        file.flush().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(bytes.len(), 1_000_003);
        assert_eq!(&bytes[1_000_000..], b"end");
        assert_eq!(LogFile::create(&path).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
    }

    #[test]
    fn a_full_disk_is_an_error_that_leaves_the_output_usable() {
        let file = OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut log = LogFile { file, buffer: Vec::new(), whole: 0 };
        log.write_all(b"message").unwrap();
        assert_eq!(log.flush().unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert!(log.buffer.is_empty());
        assert!(log.flush().is_ok());
    }
}
