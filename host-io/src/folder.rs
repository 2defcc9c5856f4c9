//! The folder of `--out`: made and tried before the work whose results it takes.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::file::{self, FileProblem, NewFile};
use crate::problem::{At as _, Problem};

/// Adds what could not be written: the folder, or a file in it.
fn unwritten<T>(path: &Path, result: Result<T, FileProblem>) -> Result<T, Problem> {
    result.at(format!("--out: cannot write {}", path.display()))
}

/// First line of a text in Markdown.
const MARKDOWN: &str = "<!-- Written by sitl; do not edit. -->";

/// A folder that takes files.
#[derive(Debug, Clone)]
pub struct OutFolder(PathBuf);

/// A file of it that is being written.
#[derive(Debug)]
pub struct OutFile {
    file: NewFile,
    path: PathBuf,
}

impl OutFolder {
    /// Makes the folder if it is not there, and tries whether it takes a file.
    pub fn create(path: &Path) -> Result<Self, Problem> {
        let make = || {
            // `create_dir_all` would only say that the file exists.
            if fs::metadata(path).is_ok_and(|about| !about.is_dir()) {
                return Err(FileProblem::NoFolder);
            }
            fs::create_dir_all(path)?;
            // Given up at once, so nothing stays.
            NewFile::begin(&path.join("written"), |_| true).map(drop)
        };
        unwritten(path, make())?;
        Ok(Self(path.to_path_buf()))
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Begins a file that replaces one with this mark in its beginning.
    pub fn begin(&self, name: &str, mark: &[u8]) -> Result<OutFile, Problem> {
        let path = self.0.join(name);
        let file = NewFile::begin(&path, |beginning| file::has_mark(beginning, mark));
        Ok(OutFile { file: unwritten(&path, file)?, path })
    }

    /// Writes a whole file that replaces one with this mark in its beginning.
    pub fn write_marked(&self, name: &str, mark: &[u8], content: &[u8]) -> Result<(), Problem> {
        let mut output = self.begin(name, mark)?;
        output.write(content)?;
        output.finish()
    }

    /// Writes text in Markdown, which may begin with anything, after a line by which it is known again.
    pub fn write_markdown(&self, name: &str, text: &str) -> Result<(), Problem> {
        self.write_marked(name, MARKDOWN.as_bytes(), format!("{MARKDOWN}\n\n{text}").as_bytes())
    }

    /// Writes a whole table or picture that replaces one of its kind.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), Problem> {
        self.write_marked(name, file::beginning(content), content)
    }
}

impl OutFile {
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Problem> {
        unwritten(&self.path, self.file.write_all(bytes).map_err(FileProblem::from))
    }

    /// Gives the file its name.
    pub fn finish(self) -> Result<(), Problem> {
        unwritten(&self.path, self.file.finish())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_cannot_take_files_is_found_before_the_work() {
        let home = tempfile::tempdir().unwrap();
        let folder = OutFolder::create(&home.path().join("a/b")).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "the trial leaves nothing");
        folder.write("t.csv", b"a,b\n1,2\n").unwrap();
        let path = folder.path().join("t.csv");
        let inside = OutFolder::create(&path.join("x")).unwrap_err().to_string();
        assert!(inside.starts_with("--out: cannot write ") && inside.contains("t.csv"), "{inside}");
        let no_folder = OutFolder::create(&path).unwrap_err().to_string();
        assert!(no_folder.ends_with("this is no folder"), "{no_folder}");
        let foreign = folder.write("t.csv", b"other\n").unwrap_err().to_string();
        assert!(foreign.contains("not written by this program"), "{foreign}");
        // Files of the kernel take none, whoever asks.
        let kernel = OutFolder::create(Path::new("/proc/self")).unwrap_err().to_string();
        assert!(kernel.starts_with("--out: cannot write /proc/self: "), "{kernel}");
    }
}
