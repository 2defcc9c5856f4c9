//! A file whose age says that the process is well, for whoever looks after it from outside: a container
//! engine, a service manager.
//!
//! A process that hangs, or waits for its other half, does not touch the file, so its age tells.

use std::fs;
use std::io;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// The file is touched this often while all is well.
pub const EVERY: Duration = Duration::from_secs(1);

/// The file.
#[derive(Debug)]
pub struct HealthFile {
    path: PathBuf,
    touched: Option<Instant>,
}

impl HealthFile {
    /// Touched when all is well for the first time; what an earlier process left is taken away.
    ///
    /// # Errors
    /// What the system says about the path.
    pub fn new(path: PathBuf) -> io::Result<Self> {
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        Ok(Self { path, touched: None })
    }

    /// All is well at `now`; the file is written when [`EVERY`] has passed since the last time.
    ///
    /// # Errors
    /// What the system says; the next call after [`EVERY`] tries again.
    pub fn all_is_well(&mut self, now: Instant) -> io::Result<()> {
        if self.touched.is_some_and(|touched| now.saturating_duration_since(touched) < EVERY) {
            return Ok(());
        }
        self.touched = Some(now);
        fs::write(&self.path, "well\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock;

    #[test]
    fn the_file_is_written_once_a_second_and_taken_away_at_the_start() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("health");
        fs::write(&path, "old").unwrap();
        let mut file = HealthFile::new(path.clone()).unwrap();
        assert!(!path.exists(), "an old process is not this one");
        let start = clock::now();
        file.all_is_well(start).unwrap();
        assert!(path.exists());
        fs::remove_file(&path).unwrap();
        file.all_is_well(start + Duration::from_millis(999)).unwrap();
        assert!(!path.exists());
        file.all_is_well(start + EVERY).unwrap();
        assert!(path.exists());
    }

    #[test]
    fn a_folder_that_is_not_there_is_an_error_and_no_end() {
        let mut file = HealthFile::new(PathBuf::from("/nowhere/health")).unwrap();
        assert!(file.all_is_well(clock::now()).is_err());
    }
}
