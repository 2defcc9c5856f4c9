//! The doors to the terminal: standard output, standard error, and log lines on the latter. No control character of a name, a
//! file or a packet passes them; `tests/architecture.rs` checks that nothing is printed elsewhere.

use std::borrow::Cow;
use std::cell::RefCell;
use std::fmt::Display;
use std::io::{self, Stderr, Stdout, Write};
use std::sync::{Mutex, PoisonError};

use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

/// Prints a text. Where nobody reads any more, as behind `| head`, it is dropped: results are in files.
#[macro_export]
macro_rules! print_text {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = write!($crate::console::out(), $($text)*);
    }};
}

/// The same with a line feed.
#[macro_export]
macro_rules! print_line {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!($crate::console::out(), $($text)*);
    }};
}

/// The environment variable that selects the lines, for example `debug` or `info,autopilot=trace`.
const VARIABLE: &str = "RUST_LOG";

/// Stands for a character that is not shown.
const HIDDEN: char = '?';

/// Whether a terminal shows the character and does nothing else: no control character, no separator of lines, and none that
/// changes the direction of writing or has no width.
pub fn is_shown(c: char) -> bool {
    let is_invisible = matches!(c,
        '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}');
    !c.is_control() && !is_invisible
}

/// The text with `?` for each character that a terminal does not show. Line feeds and tabs stay.
pub fn shown(text: &str) -> Cow<'_, str> {
    let passes = |c: char| is_shown(c) || matches!(c, '\n' | '\t');
    if text.chars().all(passes) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.chars().map(|c| if passes(c) { c } else { HIDDEN }).collect())
}

/// An output that writes what [`shown`] leaves.
#[derive(Debug)]
pub struct Shown<W>(W);

impl<W: Write> Write for Shown<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write_all(shown(&String::from_utf8_lossy(bytes)).as_bytes())?;
        // All bytes of the caller are used up, however many have been written for them.
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// The standard output, which remembers that it could not be written.
#[derive(Debug)]
pub struct Out(Stdout);

/// The first error of the standard output, except that nobody reads any more, as behind `| head`.
static FAILED: Mutex<Option<io::Error>> = Mutex::new(None);

fn remembered<T>(result: io::Result<T>) -> io::Result<T> {
    if let Err(error) = &result
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        // The value is good even if a thread that held it has panicked.
        let mut failed = FAILED.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = failed.get_or_insert_with(|| io::Error::new(error.kind(), error.to_string()));
    }
    result
}

impl Write for Out {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let keep = |text: &mut Option<Vec<u8>>| {
            text.as_mut().map(|text| text.extend_from_slice(bytes)).is_some()
        };
        if CAPTURED.with_borrow_mut(keep) {
            return Ok(bytes.len());
        }
        remembered(self.0.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        remembered(self.0.flush())
    }
}

thread_local! {
    /// What this thread prints, where its caller wants it.
    static CAPTURED: RefCell<Option<Vec<u8>>> = const { RefCell::new(None) };
}

/// Does `work`, and gives what its thread has printed on the standard output instead of printing it.
pub fn captured<T>(work: impl FnOnce() -> T) -> (T, String) {
    let outer = CAPTURED.replace(Some(Vec::new()));
    let done = work();
    let text = CAPTURED.replace(outer).unwrap_or_default();
    (done, String::from_utf8_lossy(&text).into_owned())
}

pub fn out() -> Shown<Out> {
    Shown(Out(io::stdout()))
}

/// Puts out what waits, and says whether everything could be written: a program that ends with success has shown its results.
pub fn finish() -> io::Result<()> {
    // Remembered with those before it.
    let _ = out().flush();
    FAILED.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
}

pub fn err() -> Shown<Stderr> {
    Shown(io::stderr())
}

/// Ends the process after saying why its command line is refused.
pub fn refuse(why: &impl Display, code: i32) -> ! {
    // The reader may be gone.
    let _ = write!(err(), "{why}");
    std::process::exit(code)
}

/// Shows `info` and above; the environment variable `RUST_LOG` changes that.
///
/// A second call changes nothing.
pub fn show() {
    let directives = std::env::var(VARIABLE).unwrap_or_default();
    let (shown, problem) = match targets(&directives) {
        Ok(targets) => (targets, None),
        Err(problem) => (Targets::new().with_default(LevelFilter::INFO), Some(problem)),
    };
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(err)
        // Colours would be control characters among those of others.
        .with_ansi(false)
        .with_target(false)
        .without_time()
        // If the reader is gone, the flight continues.
        .log_internal_errors(false);
    // An error means that a logger is installed already.
    let is_first = tracing_subscriber::registry().with(shown).with(lines).try_init().is_ok();
    if let (Some(problem), true) = (problem, is_first) {
        tracing::warn!("{VARIABLE}: {directives:?} is not used: {problem}");
    }
}

/// Targets and their levels; a target without a level shows `info` and above.
fn targets(directives: &str) -> Result<Targets, tracing_subscriber::filter::ParseError> {
    let targets = match directives.trim() {
        "" => Targets::new(),
        directives => directives.parse()?,
    };
    Ok(match targets.default_level() {
        Some(_) => targets,
        None => targets.with_default(LevelFilter::INFO),
    })
}

#[cfg(test)]
mod tests {
    use tracing::Level;

    use super::*;

    #[test]
    fn nothing_that_moves_the_cursor_rings_or_turns_the_text_passes() {
        let mut written = Vec::new();
        let hostile = "a\u{1b}]0;x\u{7}b\rc\u{9b}2Jd\u{7f}e\u{202e}f\u{2028}g\u{feff}h";
        write!(Shown(&mut written), "{hostile}\n\tGröße 滑走路").unwrap();
        let shown = String::from_utf8(written).unwrap();
        assert_eq!(shown, "a?]0;x?b?c?2Jd?e?f?g?h\n\tGröße 滑走路");
        // Not text at all: of a byte that is not UTF-8 no part stays.
        let mut written = Vec::new();
        Shown(&mut written).write_all(b"\x9b2J\xff").unwrap();
        assert_eq!(written, "\u{fffd}2J\u{fffd}".as_bytes());
        for c in (0..0xa0).filter_map(char::from_u32) {
            let is_control = u32::from(c) < 0x20 || (0x7f..0xa0).contains(&u32::from(c));
            assert_eq!(is_shown(c), !is_control, "{c:?}");
        }
    }

    #[test]
    fn lines_are_shown_from_info_on_unless_the_variable_sets_another_level() {
        let shows = |directives: &str, target, level| {
            targets(directives).unwrap().would_enable(target, &level)
        };
        assert!(shows("", "any", Level::INFO));
        assert!(!shows("", "any", Level::DEBUG));
        assert!(shows("debug", "any", Level::DEBUG));
        assert!(shows("autopilot=trace", "autopilot::run", Level::TRACE));
        assert!(shows("autopilot=trace", "plant_sim", Level::INFO));
        assert!(!shows("autopilot=off", "autopilot", Level::ERROR));
        assert!(targets("autopilot=loud").is_err());
    }
}
