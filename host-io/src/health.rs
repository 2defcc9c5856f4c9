//! A file whose age shows that the process is healthy, for a container engine or a service manager.
//!
//! A process that hangs, or waits for the other program, does not touch the file, so its age grows.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::file::{FileProblem, OwnFile};
use crate::problem::{At as _, Problem};

/// Interval of touching the file in normal operation.
pub const EVERY: Duration = Duration::from_secs(1);

/// Content of the file.
const CONTENT: &[u8] = b"well\n";

#[derive(Debug)]
pub struct HealthFile {
    file: OwnFile,
    touched: Option<Instant>,
}

impl HealthFile {
    /// Creates no file yet: that happens on the first report. Removes the file of an earlier process.
    pub fn new(path: &Path) -> Result<Self, Problem> {
        let is_own = |content: &[u8]| content == CONTENT;
        // The control loop does not wait for a disk.
        let file = OwnFile::new(path, CONTENT.len() as u64, is_own).without_sync();
        file.remove().at(format!("--health-file {}", path.display()))?;
        Ok(Self { file, touched: None })
    }

    /// Reports normal operation at `now`; writes the file when [`EVERY`] has passed since the last time.
    pub fn all_is_well(&mut self, now: Instant) -> Result<(), FileProblem> {
        if self.touched.is_some_and(|touched| now.saturating_duration_since(touched) < EVERY) {
            return Ok(());
        }
        // Also if the write fails: then it is tried again after a second, not in the next tick.
        self.touched = Some(now);
        self.file.replace(CONTENT)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::clock;

    #[test]
    fn the_file_is_written_once_a_second_and_taken_away_at_the_start() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("health");
        fs::write(&path, CONTENT).unwrap();
        let mut file = HealthFile::new(&path).unwrap();
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
    fn a_file_of_another_program_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("diary");
        fs::write(&path, "well, well\n").unwrap();
        let error = HealthFile::new(&path).unwrap_err().to_string();
        assert!(error.contains("--health-file") && error.contains("is not replaced"), "{error}");
        fs::remove_file(&path).unwrap();
        let mut file = HealthFile::new(&path).unwrap();
        fs::write(&path, "well, well\n").unwrap();
        assert!(matches!(file.all_is_well(clock::now()), Err(FileProblem::Foreign)));
        assert_eq!(fs::read_to_string(&path).unwrap(), "well, well\n");
    }
}
