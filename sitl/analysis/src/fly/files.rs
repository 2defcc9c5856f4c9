//! What a flight leaves behind in the folder of `--out`: each file is whole, or is not there.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use host_io::file::{FileProblem, NewFile};
use serde::Serialize;

use super::FlyError;

/// The table of one flight.
pub(super) const TABLE: &str = "flight.csv";
/// What became of it.
pub(super) const OUTCOME: &str = "outcome.json";
/// Its log.
pub(super) const LOG: &str = "flight.ulg";
/// Its figures.
pub(super) const FIGURES: &str = "flight.html";
/// One row for each seed.
pub(super) const SEEDS: &str = "seeds.csv";

/// The folder.
#[derive(Debug, Clone)]
pub(super) struct Folder(PathBuf);

/// A file of it that is being written.
#[derive(Debug)]
pub(super) struct Output {
    file: NewFile,
    path: PathBuf,
}

impl Folder {
    /// Makes the folder if it is not there, before anything is flown.
    pub(super) fn create(path: &Path) -> Result<Self, FlyError> {
        let failed = |source| FlyError::Write { path: path.to_path_buf(), source };
        if fs::metadata(path).is_ok_and(|about| !about.is_dir()) {
            return Err(FlyError::NoFolder { path: path.to_path_buf() });
        }
        fs::create_dir_all(path).map_err(|error| failed(error.into()))?;
        Ok(Self(path.to_path_buf()))
    }

    /// Begins a file that replaces one with this mark in its beginning.
    pub(super) fn begin(&self, name: &str, mark: &[u8]) -> Result<Output, FlyError> {
        let path = self.0.join(name);
        let has_mark = |beginning: &[u8]| beginning.windows(mark.len().max(1)).any(|w| w == mark);
        let file = NewFile::begin(&path, has_mark)
            .map_err(|source| FlyError::Write { path: path.clone(), source })?;
        Ok(Output { file, path })
    }

    /// Writes a whole file that replaces one with this mark in its beginning; gives its path.
    pub(super) fn write(
        &self,
        name: &str,
        mark: &[u8],
        content: &[u8],
    ) -> Result<PathBuf, FlyError> {
        let mut output = self.begin(name, mark)?;
        output.write(content)?;
        output.finish()
    }

    /// Writes a value as JSON.
    pub(super) fn write_json(
        &self,
        name: &str,
        value: &impl Serialize,
    ) -> Result<PathBuf, FlyError> {
        let mut json = serde_json::to_vec_pretty(value).map_err(std::io::Error::from)?;
        json.push(b'\n');
        self.write(name, MARK.as_bytes(), &json)
    }
}

/// How every JSON file of this command begins.
const MARK: &str = "{\n  \"program\": \"Two-Step sitl fly\"";
/// The first key of such a file.
pub(super) const PROGRAM: &str = "Two-Step sitl fly";

impl Output {
    /// Adds bytes.
    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<(), FlyError> {
        let written = self.file.write_all(bytes);
        written.map_err(|error| self.failed(error.into()))
    }

    /// Gives the file its name.
    pub(super) fn finish(self) -> Result<PathBuf, FlyError> {
        let path = self.path;
        match self.file.finish() {
            Ok(()) => Ok(path),
            Err(source) => Err(FlyError::Write { path, source }),
        }
    }

    fn failed(&self, source: FileProblem) -> FlyError {
        FlyError::Write { path: self.path.clone(), source }
    }
}
