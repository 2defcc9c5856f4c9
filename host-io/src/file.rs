//! Files that a user names: read only if they are regular files of reasonable size, replaced only if the program wrote them.
//!
//! A device may give bytes without end, a pipe may block for ever, and a name may be mistyped. So
//! the programs read every file from a path of the user through [`read`], and every file that they
//! overwrite is an [`OwnFile`]. Symbolic links are followed to their target, which has to be a regular file; the target is
//! replaced and the link stays.

use std::borrow::Cow;
use std::fs::{self, DirBuilder, File, FileType, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Read as _, Seek as _, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, FileTypeExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::process;

use nix::libc::O_NONBLOCK;

/// Longest configuration, scenario, airframe or model file, bytes: ten times the longest one written by hand.
pub const TEXT_MAX: u64 = 1 << 20;

/// Bytes at the beginning of a file by which a program recognises its own files.
const BEGINNING: u64 = 4096;
/// Names that are tried for a new file beside another one: processes that were killed leave theirs.
const BESIDE_MAX: u32 = 1_000;
/// The part of these bytes that all tables or figures of one kind have in common.
const KIND_BYTES: usize = 12;

/// Why a file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FileProblem {
    #[error("{0}")]
    System(#[from] io::Error),
    /// Neither a name that comes with the program nor a file.
    #[error("{source}; the names that come with the program are {known}")]
    NoSuchName { source: io::Error, known: String },
    /// Something else than a folder.
    #[error("this is no folder")]
    NoFolder,
    /// Not a regular file.
    #[error("this is {0}, and an ordinary file is needed")]
    NotOrdinary(&'static str),
    /// Longer than any valid file.
    #[error("{bytes} bytes long, the limit is {limit} bytes")]
    TooLong {
        /// Length of the file; at least this if it grows.
        bytes: u64,
        limit: u64,
    },
    #[error("no text: byte {at} (from 0) is not UTF-8")]
    NotText {
        /// Offset of the first invalid byte.
        at: usize,
    },
    /// Content that the program did not write.
    #[error("not empty and not written by this program, so it is not replaced")]
    Foreign,
}

impl FileProblem {
    /// Whether the file does not exist, or cannot: what should be its folder is none.
    pub fn is_not_found(&self) -> bool {
        matches!(self, Self::System(error) | Self::NoSuchName { source: error, .. }
            if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory))
    }
}

fn check_ordinary(file: FileType) -> Result<(), FileProblem> {
    Err(FileProblem::NotOrdinary(match file {
        file if file.is_file() => return Ok(()),
        file if file.is_dir() => "a folder",
        file if file.is_fifo() => "a pipe",
        file if file.is_socket() => "a socket",
        file if file.is_char_device() || file.is_block_device() => "a device",
        _ => "something else",
    }))
}

/// Whether an open file is empty or begins as `is_own` accepts.
fn check_own(file: &File, is_own: impl Fn(&[u8]) -> bool) -> Result<(), FileProblem> {
    let mut beginning = Vec::new();
    file.take(BEGINNING).read_to_end(&mut beginning)?;
    if beginning.is_empty() || is_own(&beginning) { Ok(()) } else { Err(FileProblem::Foreign) }
}

/// A name without a file is free, unless it is a dangling link, which would be replaced itself.
fn check_free(path: &Path) -> Result<(), FileProblem> {
    match fs::symlink_metadata(path) {
        Ok(_) => Err(FileProblem::NotOrdinary("a link that leads nowhere")),
        Err(_) => Ok(()),
    }
}

/// Opens a regular file for reading. Never waits: neither for the other end of a pipe, nor for a device.
pub fn open(path: &Path) -> Result<File, FileProblem> {
    // Checked before opening: opening a device may have an effect.
    check_ordinary(fs::metadata(path)?.file_type())?;
    // By now the name may be that of a pipe, which must not be waited for.
    let file = OpenOptions::new().read(true).custom_flags(O_NONBLOCK).open(path)?;
    // Metadata of the opened file, whatever the name refers to by now.
    check_ordinary(file.metadata()?.file_type())?;
    Ok(file)
}

/// The content of a regular file of at most `limit` bytes.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, FileProblem> {
    read_opened(&open(path)?, limit)
}

/// The content of an open regular file of at most `limit` bytes.
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

/// The text of a regular file of at most `limit` bytes.
pub fn read_text(path: &Path, limit: u64) -> Result<String, FileProblem> {
    let bytes = read(path, limit)?;
    String::from_utf8(bytes)
        .map_err(|error| FileProblem::NotText { at: error.utf8_error().valid_up_to() })
}

/// The names of a list, as help and messages have them.
pub fn names<T>(list: &[(&str, T)]) -> String {
    list.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

/// The text that comes with the program under this name, or else that of the file at this path; and what messages call it.
pub fn shipped_or_read(
    name: &Path,
    shipped: &[(&str, &'static str)],
) -> Result<(String, Cow<'static, str>), FileProblem> {
    if let Some((known, text)) = shipped.iter().find(|(known, _)| Path::new(known) == name) {
        return Ok((format!("{known}.toml"), Cow::Borrowed(text)));
    }
    match read_text(name, TEXT_MAX) {
        Ok(text) => Ok((name.display().to_string(), Cow::Owned(text))),
        Err(FileProblem::System(source)) if source.kind() == ErrorKind::NotFound => {
            Err(FileProblem::NoSuchName { source, known: names(shipped) })
        }
        Err(problem) => Err(problem),
    }
}

/// Opens a file for writing from its beginning: a new one, or an existing one that is empty or begins as
/// `is_own` accepts, which is emptied.
pub fn create(path: &Path, is_own: impl Fn(&[u8]) -> bool) -> Result<File, FileProblem> {
    match fs::metadata(path) {
        Ok(about) => check_ordinary(about.file_type())?,
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(error.into()),
    }
    let mut options = OpenOptions::new();
    // Not emptied yet: first comes the look at what is in it.
    options.read(true).write(true).create(true).truncate(false).custom_flags(O_NONBLOCK);
    let mut file = options.open(path)?;
    check_ordinary(file.metadata()?.file_type())?;
    check_own(&file, is_own)?;
    file.set_len(0)?;
    // The look has moved the position.
    file.rewind()?;
    Ok(file)
}

/// Writes a whole file: a new one, or over one that is empty or has `mark` at its beginning.
pub fn write(path: &Path, content: &[u8], mark: &[u8]) -> Result<(), FileProblem> {
    let mut file = NewFile::begin(path, |beginning| has_mark(beginning, mark))?;
    file.write_all(content)?;
    file.finish()
}

/// Whether a file that begins so is of the kind that this mark stands for.
pub(crate) fn has_mark(beginning: &[u8], mark: &[u8]) -> bool {
    // `windows` panics at zero; so an empty mark is found nowhere.
    beginning.windows(mark.len().max(1)).any(|window| window == mark)
}

/// The mark of a table or figure whose name is given by the program: the common beginning of its kind.
pub fn beginning(content: &[u8]) -> &[u8] {
    let line = content.iter().position(|byte| *byte == b'\n').unwrap_or(content.len());
    &content[..line.min(KIND_BYTES)]
}

/// A file that is written next to the one that it replaces, and renamed when it is complete: a program that ends before that
/// leaves the old file unchanged.
#[derive(Debug)]
pub struct NewFile {
    file: BufWriter<File>,
    /// Temporary name; `None` once the file has its final name.
    beside: Option<PathBuf>,
    path: PathBuf,
}

impl NewFile {
    /// Begins a file for a path that is free, or has a file that is empty or begins as `is_own` accepts.
    pub fn begin(path: &Path, is_own: impl Fn(&[u8]) -> bool) -> Result<Self, FileProblem> {
        // A link is followed: its target is replaced and not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        match open(&path) {
            Ok(file) => check_own(&file, is_own)?,
            Err(problem) if problem.is_not_found() => check_free(&path)?,
            Err(problem) => return Err(problem),
        }
        Ok(Self::beside(path, OpenOptions::new().write(true))?)
    }

    /// A new file beside another one. Two writers of the same file use different names, also where several machines share
    /// a folder and processes have the same number.
    fn beside(path: PathBuf, options: &mut OpenOptions) -> io::Result<Self> {
        let mut number = 0;
        loop {
            let mut name = path.file_name().unwrap_or_default().to_os_string();
            name.push(format!(".{}-{number}.new", process::id()));
            let beside = path.with_file_name(name);
            match options.create_new(true).open(&beside) {
                Ok(file) => {
                    return Ok(Self { file: BufWriter::new(file), beside: Some(beside), path });
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists && number < BESIDE_MAX => {
                    number += 1;
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Puts it on the disk and renames it to its final name.
    pub fn finish(self) -> Result<(), FileProblem> {
        self.finish_with(true)
    }

    fn finish_with(mut self, waits_for_disk: bool) -> Result<(), FileProblem> {
        // On the disk before the rename: after a power cut the name must not lead to an empty file.
        if waits_for_disk { self.put_on_disk() } else { self.file.flush() }?;
        if let Some(beside) = &self.beside {
            fs::rename(beside, &self.path)?;
        }
        // It has its name now, so `drop` must not remove it.
        self.beside = None;
        Ok(())
    }

    /// The same if the final name is still free: of several programs that do this at once, one succeeds. False for the others.
    pub fn finish_if_free(mut self) -> Result<bool, FileProblem> {
        self.put_on_disk()?;
        let Some(beside) = &self.beside else { return Ok(false) };
        match fs::hard_link(beside, &self.path) {
            // `drop` removes the other name.
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
            // A file system without links: the last of several programs wins.
            Err(_) => self.finish().map(|()| true),
        }
    }

    fn put_on_disk(&mut self) -> io::Result<()> {
        self.file.flush()?;
        self.file.get_ref().sync_all()
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
            // The file was abandoned; the caller has the important error.
            let _ = fs::remove_file(beside);
        }
    }
}

/// A file that a program writes, rewrites, and may remove: its content is always complete, and files that the
/// program did not write are neither replaced nor removed.
#[derive(Debug, Clone)]
pub struct OwnFile {
    path: PathBuf,
    /// Whether the program wrote a content. An empty file may be used by any program.
    is_own: fn(&[u8]) -> bool,
    /// Longest content that the program writes, bytes.
    limit: u64,
    /// The content is on the disk when a call returns; otherwise when the operating system writes it.
    waits_for_disk: bool,
    /// Permissions of the file, unless the system sets them; of folders created for it.
    modes: Option<(u32, u32)>,
}

impl OwnFile {
    /// A file at `path`. `is_own` recognises what the program writes there, at most `limit` bytes.
    pub fn new(path: &Path, limit: u64, is_own: fn(&[u8]) -> bool) -> Self {
        // A link is followed: its target is replaced and not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        Self { path, is_own, limit, waits_for_disk: true, modes: None }
    }

    /// Does not wait for the disk.
    #[must_use]
    pub fn without_sync(mut self) -> Self {
        self.waits_for_disk = false;
        self
    }

    /// With these permissions from the first moment on; the folders created for it have the others.
    #[must_use]
    pub fn with_modes(mut self, file: u32, folders: u32) -> Self {
        self.modes = Some((file, folders));
        self
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the path is free or has a file of this program.
    pub fn check(&self) -> Result<(), FileProblem> {
        match read(&self.path, self.limit) {
            Ok(content) if content.is_empty() || (self.is_own)(&content) => Ok(()),
            // Longer than anything that the program writes.
            Ok(_) | Err(FileProblem::TooLong { .. }) => Err(FileProblem::Foreign),
            Err(problem) if problem.is_not_found() => check_free(&self.path),
            Err(problem) => Err(problem),
        }
    }

    /// Gives the file this content, or leaves it unchanged: a new file next to it takes its name. Creates missing
    /// folders.
    pub fn replace(&self, content: &[u8]) -> Result<(), FileProblem> {
        // Each time, because another program may have taken the name since.
        self.check()?;
        let folder = self.folder();
        let mut builder = DirBuilder::new();
        builder.recursive(true);
        if let Some((_, mode)) = self.modes {
            builder.mode(mode);
        }
        builder.create(folder)?;
        let mut options = OpenOptions::new();
        options.write(true);
        if let Some((mode, _)) = self.modes {
            options.mode(mode);
        }
        let mut new = NewFile::beside(self.path.clone(), &mut options)?;
        new.write_all(content)?;
        new.finish_with(self.waits_for_disk)?;
        self.sync_folder();
        Ok(())
    }

    /// Removes the file, if it exists.
    pub fn remove(&self) -> Result<(), FileProblem> {
        self.check()?;
        match fs::remove_file(&self.path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error.into()),
            _ => {
                self.sync_folder();
                Ok(())
            }
        }
    }

    fn folder(&self) -> &Path {
        let folder = self.path.parent().filter(|folder| *folder != Path::new(""));
        folder.unwrap_or(Path::new("."))
    }

    /// Syncs the folder, which puts the name on the disk. If the folder cannot be opened, the file still exists.
    fn sync_folder(&self) {
        if self.waits_for_disk {
            let _ = File::open(self.folder()).and_then(|folder| folder.sync_all());
        }
    }
}

#[cfg(test)]
mod tests;
