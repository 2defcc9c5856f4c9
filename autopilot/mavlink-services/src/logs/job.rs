//! What the log service wants of the log folder, and what it gets. The folder itself is elsewhere.

/// One finished or growing log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogFile {
    /// Name of the file in the log folder.
    pub name: String,
    /// Bytes when it was listed; what does not fit saturates.
    pub size: u32,
    /// When it was begun, seconds since 1970, UTC.
    pub utc_s: u32,
}

/// Something to do, with the number that its outcome will have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogJob {
    /// Never used twice.
    pub number: u64,
    /// What to do.
    pub task: LogTask,
}

/// What to do in the log folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogTask {
    /// List the logs, oldest first.
    List,
    /// Read a piece of one.
    Read {
        /// Name of the file.
        name: String,
        /// First byte.
        offset: u32,
        /// Bytes.
        length: usize,
    },
    /// Remove all logs that nobody is writing.
    Erase,
}

/// What became of a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogDone {
    /// Number of the job.
    pub number: u64,
    /// What came of it, or what the system says.
    pub result: Result<LogOutcome, String>,
}

/// What came of a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogOutcome {
    /// The logs, oldest first.
    Listed(Vec<LogFile>),
    /// The bytes; fewer than asked for where the file ends before.
    Read(Vec<u8>),
    /// How the logs were removed.
    Erased(Erased),
}

/// Logs that were removed, and those that were not.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Erased {
    /// Removed.
    pub removed: usize,
    /// Somebody is writing them.
    pub in_use: usize,
    /// Could not be removed.
    pub failed: usize,
}
