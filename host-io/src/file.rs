//! Files that a user names: read only if they are ordinary files of sane size, replaced only if the program wrote them.
//!
//! A device may give bytes without end, a pipe may give none for ever, and a name may have been mistyped. So
//! everything that the programs read from a path of the user goes through [`read`], and every file that they write
//! over is an [`OwnFile`]. Symbolic links lead to the file behind them, which has to be an ordinary one; that file is
//! replaced and the link stays.

use std::fs::{self, DirBuilder, File, FileType, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Read as _, Seek as _, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, FileTypeExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::process;

use nix::libc::O_NONBLOCK;

/// Longest configuration, scenario, airframe or model file, bytes: ten times what anybody writes by hand.
pub const TEXT_MAX: u64 = 1 << 20;

/// Bytes at the beginning of a file by which a program recognises what it wrote.
const BEGINNING: u64 = 4096;
/// Of these, bytes that all tables or figures of one kind have in common.
const KIND_BYTES: usize = 12;

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum FileProblem {
    /// The system does not give or take it.
    #[error("{0}")]
    System(#[from] io::Error),
    /// No ordinary file.
    #[error("this is {0}, and an ordinary file is needed")]
    NotOrdinary(&'static str),
    /// Longer than anything that could be meant.
    #[error("{bytes} bytes long, the limit is {limit} bytes")]
    TooLong {
        /// Length of the file; at least so many if it grows.
        bytes: u64,
        /// Longest file that is read.
        limit: u64,
    },
    /// Text was expected.
    #[error("no text: byte {at} (from 0) is not UTF-8")]
    NotText {
        /// Offset of the first byte that cannot be.
        at: usize,
    },
    /// Somebody else's content.
    #[error("not empty and not written by this program, so it is not replaced")]
    Foreign,
}

impl FileProblem {
    /// Whether there is no file at all.
    #[must_use]
    pub fn is_not_found(&self) -> bool {
        matches!(self, Self::System(error) if error.kind() == ErrorKind::NotFound)
    }
}

/// What something is that is no ordinary file.
fn kind(file: FileType) -> Option<&'static str> {
    match file {
        file if file.is_file() => None,
        file if file.is_dir() => Some("a folder"),
        file if file.is_fifo() => Some("a pipe"),
        file if file.is_socket() => Some("a socket"),
        file if file.is_char_device() || file.is_block_device() => Some("a device"),
        _ => Some("something else"),
    }
}

fn check_ordinary(file: FileType) -> Result<(), FileProblem> {
    kind(file).map_or(Ok(()), |kind| Err(FileProblem::NotOrdinary(kind)))
}

/// Opens an ordinary file for reading. Never waits: not for the other end of a pipe, not for a device.
///
/// # Errors
/// [`FileProblem::System`] or [`FileProblem::NotOrdinary`].
pub fn open(path: &Path) -> Result<File, FileProblem> {
    // Before it is opened: a device may do something when it is opened.
    check_ordinary(fs::metadata(path)?.file_type())?;
    let file = OpenOptions::new().read(true).custom_flags(O_NONBLOCK).open(path)?;
    // Of what was opened, whatever the name leads to by now.
    check_ordinary(file.metadata()?.file_type())?;
    Ok(file)
}

/// The content of an ordinary file of at most `limit` bytes.
///
/// # Errors
/// [`FileProblem`] without the path, which the caller knows.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, FileProblem> {
    read_opened(&open(path)?, limit)
}

/// The content of an ordinary file that is open, of at most `limit` bytes.
///
/// # Errors
/// As [`read`].
pub fn read_opened(file: &File, limit: u64) -> Result<Vec<u8>, FileProblem> {
    let about = file.metadata()?;
    check_ordinary(about.file_type())?;
    let check = |bytes| match bytes > limit {
        true => Err(FileProblem::TooLong { bytes, limit }),
        false => Ok(()),
    };
    check(about.len())?;
    let mut content = Vec::new();
    // It may grow, or be a file of the kernel that has no length.
    file.take(limit.saturating_add(1)).read_to_end(&mut content)?;
    check(content.len() as u64)?;
    Ok(content)
}

/// The text of an ordinary file of at most `limit` bytes.
///
/// # Errors
/// As [`read`], and [`FileProblem::NotText`].
pub fn read_text(path: &Path, limit: u64) -> Result<String, FileProblem> {
    let bytes = read(path, limit)?;
    String::from_utf8(bytes)
        .map_err(|error| FileProblem::NotText { at: error.utf8_error().valid_up_to() })
}

/// Opens a file that is written from its beginning on: a new one, or one that is there, is empty or begins as
/// `is_own` accepts, and is emptied.
///
/// # Errors
/// [`FileProblem`]; then nothing has changed.
pub fn create(path: &Path, is_own: impl Fn(&[u8]) -> bool) -> Result<File, FileProblem> {
    match fs::metadata(path) {
        Ok(about) => check_ordinary(about.file_type())?,
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(error.into()),
    }
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false).custom_flags(O_NONBLOCK);
    let mut file = options.open(path)?;
    check_ordinary(file.metadata()?.file_type())?;
    let mut beginning = Vec::new();
    (&file).take(BEGINNING).read_to_end(&mut beginning)?;
    if !beginning.is_empty() && !is_own(&beginning) {
        return Err(FileProblem::Foreign);
    }
    file.set_len(0)?;
    file.rewind()?;
    Ok(file)
}

/// Writes a whole file: a new one, or over one that is empty or has `mark` in its beginning.
///
/// # Errors
/// [`FileProblem`]; what the system refuses in the middle leaves a part of the content.
pub fn write(path: &Path, content: &[u8], mark: &[u8]) -> Result<(), FileProblem> {
    let has_mark = |beginning: &[u8]| beginning.windows(mark.len().max(1)).any(|w| w == mark);
    let mut file = create(path, has_mark)?;
    Ok(file.write_all(content)?)
}

/// The mark of a table or figure whose name is given by the program: what all of its kind begin with.
#[must_use]
pub fn beginning(content: &[u8]) -> &[u8] {
    let line = content.iter().position(|byte| *byte == b'\n').unwrap_or(content.len());
    &content[..line.min(KIND_BYTES)]
}

/// A file that is written beside the one that it replaces, and takes its name when it is complete: what ends before that
/// leaves the old file as it was.
#[derive(Debug)]
pub struct NewFile {
    file: BufWriter<File>,
    /// Name until it is complete; `None` afterwards.
    beside: Option<PathBuf>,
    path: PathBuf,
}

impl NewFile {
    /// Begins a file for a path that is free, or has a file that is empty or begins as `is_own` accepts.
    ///
    /// # Errors
    /// [`FileProblem`]; then nothing has changed.
    pub fn begin(path: &Path, is_own: impl Fn(&[u8]) -> bool) -> Result<Self, FileProblem> {
        // Of a link, the file that it leads to is replaced and not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        match open(&path) {
            Ok(file) => {
                let mut beginning = Vec::new();
                file.take(BEGINNING).read_to_end(&mut beginning)?;
                if !beginning.is_empty() && !is_own(&beginning) {
                    return Err(FileProblem::Foreign);
                }
            }
            Err(problem) if problem.is_not_found() => {}
            Err(problem) => return Err(problem),
        }
        let beside = beside(&path);
        let file = File::create(&beside)?;
        Ok(Self { file: BufWriter::new(file), beside: Some(beside), path })
    }

    /// Gives it its name.
    ///
    /// # Errors
    /// The system's error; then the old file is as it was.
    pub fn finish(mut self) -> Result<(), FileProblem> {
        self.file.flush()?;
        if let Some(beside) = &self.beside {
            fs::rename(beside, &self.path)?;
        }
        self.beside = None;
        Ok(())
    }
}

impl io::Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for NewFile {
    fn drop(&mut self) {
        if let Some(beside) = &self.beside {
            // It was given up; the caller has the error that matters.
            let _ = fs::remove_file(beside);
        }
    }
}

/// Name of a file until it is complete. Two processes with one file do not write into each other's.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.new", process::id()));
    path.with_file_name(name)
}

/// How the content of an own file reaches the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sync {
    /// It is on the disk when the call returns.
    Disk,
    /// The system writes it when it likes; nothing waits for the disk.
    Later,
}

/// A file that a program writes, writes again, and may remove: its content is always whole, and nothing is replaced or
/// removed that the program did not write.
#[derive(Debug, Clone)]
pub struct OwnFile {
    path: PathBuf,
    /// Whether a content was written by the program. An empty file is free for anybody.
    is_own: fn(&[u8]) -> bool,
    /// Longest content that can be the program's own, bytes.
    limit: u64,
    sync: Sync,
    /// Permissions of the file, where they are not left to the system; of folders that are made for it.
    modes: Option<(u32, u32)>,
}

impl OwnFile {
    /// A file at `path`. `is_own` recognises what the program writes there, at most `limit` bytes.
    #[must_use]
    pub fn new(path: &Path, limit: u64, is_own: fn(&[u8]) -> bool) -> Self {
        // Of a link, the file that it leads to is replaced and not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        Self { path, is_own, limit, sync: Sync::Disk, modes: None }
    }

    /// Does not wait for the disk.
    #[must_use]
    pub fn without_sync(mut self) -> Self {
        self.sync = Sync::Later;
        self
    }

    /// With these permissions from the first moment on, the folders made for it with those.
    #[must_use]
    pub fn with_modes(mut self, file: u32, folders: u32) -> Self {
        self.modes = Some((file, folders));
        self
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the path is free or has a file of this program.
    ///
    /// # Errors
    /// [`FileProblem`] names what is there instead.
    pub fn check(&self) -> Result<(), FileProblem> {
        match read(&self.path, self.limit) {
            Ok(content) if content.is_empty() || (self.is_own)(&content) => Ok(()),
            Ok(_) | Err(FileProblem::TooLong { .. }) => Err(FileProblem::Foreign),
            Err(problem) if problem.is_not_found() => {
                // A link that leads nowhere would be replaced itself.
                match fs::symlink_metadata(&self.path) {
                    Ok(_) => Err(FileProblem::NotOrdinary("a link that leads nowhere")),
                    Err(_) => Ok(()),
                }
            }
            Err(problem) => Err(problem),
        }
    }

    /// Gives the file this content, or leaves it as it is: a new file beside it takes its name. Folders that are missing
    /// are made.
    ///
    /// # Errors
    /// [`FileProblem`]; then nothing has changed.
    pub fn replace(&self, content: &[u8]) -> Result<(), FileProblem> {
        self.check()?;
        let folder = self.folder();
        let mut builder = DirBuilder::new();
        builder.recursive(true);
        if let Some((_, mode)) = self.modes {
            builder.mode(mode);
        }
        builder.create(folder)?;
        let new = beside(&self.path);
        let written = self.write_new(&new, content).and_then(|()| fs::rename(&new, &self.path));
        if written.is_err() {
            // It may never have come to be; the error that matters is the one above.
            let _ = fs::remove_file(&new);
        }
        written?;
        Ok(self.sync_folder()?)
    }

    /// Takes the file away, if there is one.
    ///
    /// # Errors
    /// [`FileProblem`]; then it is still there.
    pub fn remove(&self) -> Result<(), FileProblem> {
        self.check()?;
        match fs::remove_file(&self.path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error.into()),
            _ => Ok(self.sync_folder()?),
        }
    }

    fn folder(&self) -> &Path {
        let folder = self.path.parent().filter(|folder| *folder != Path::new(""));
        folder.unwrap_or(Path::new("."))
    }

    fn write_new(&self, path: &Path, content: &[u8]) -> io::Result<()> {
        match fs::remove_file(path) {
            // Left over by a process that had the same number.
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        if let Some((mode, _)) = self.modes {
            options.mode(mode);
        }
        let mut file = options.open(path)?;
        file.write_all(content)?;
        if self.sync == Sync::Disk { file.sync_all() } else { Ok(()) }
    }

    /// The name is on the disk when its folder is. A folder that cannot be opened still has the file.
    fn sync_folder(&self) -> io::Result<()> {
        match self.sync {
            Sync::Disk => File::open(self.folder()).and_then(|folder| folder.sync_all()).or(Ok(())),
            Sync::Later => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
