//! Flight logs that the user names: read whole, if they are ordinary files of sane size.

use std::io;
use std::path::Path;

use host_io::file;
use ulog::reader::{Log, ReadError};

/// Longest log that is read, bytes: that of more than an hour at the full rate. It is read into memory.
const LOG_MAX: u64 = 1 << 32;

/// Reads a log.
///
/// # Errors
/// [`ReadError`] says what is wrong with the file or with its first bytes.
pub fn open(path: &Path) -> Result<Log, ReadError> {
    Log::from_bytes(file::read(path, LOG_MAX).map_err(io::Error::other)?)
}
