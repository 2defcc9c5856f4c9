//! The terminal as a screen of lines: taken over, redrawn where it changed, given back.

use std::io::{self, IsTerminal, Stdout, Write};
use std::os::fd::AsFd;
use std::panic;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossterm::cursor::{Hide, MoveTo, Show};
use crossterm::style::{Attribute, Color, Print, ResetColor, SetAttribute, SetForegroundColor};
use crossterm::terminal::{
    Clear, ClearType, DisableLineWrap, EnableLineWrap, EnterAlternateScreen, LeaveAlternateScreen,
};
use crossterm::{execute, queue};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::unistd::{getpgrp, tcgetpgrp};
use rustix::termios::tcgetwinsize;

use super::view::{Line, Tone};

/// Columns and rows of a terminal that does not say.
const USUAL: (usize, usize) = (80, 24);
/// A terminal that cannot place its cursor.
const DUMB: &str = "dumb";

/// The terminal at the standard output; as it was again when this is dropped, and before a panic is reported.
pub(super) struct Terminal {
    out: Stdout,
    /// It is ours now.
    taken: Arc<AtomicBool>,
    size: (usize, usize),
    shown: Vec<Line>,
}

impl Terminal {
    /// `None` where the output is no terminal, one that knows only lines, or that of a shell that has put this
    /// process into the background.
    pub(super) fn open() -> Option<Self> {
        let out = io::stdout();
        let is_dumb = std::env::var_os("TERM").is_some_and(|name| name == DUMB);
        if !out.is_terminal() || is_dumb || is_in_background(&out) {
            return None;
        }
        let taken = Arc::new(AtomicBool::new(false));
        let mine = Arc::clone(&taken);
        let report = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            give_back(&mine);
            report(panic);
        }));
        Some(Self { out, taken, size: (0, 0), shown: Vec::new() })
    }

    /// Columns and rows now.
    pub(super) fn size(&self) -> (usize, usize) {
        let size = tcgetwinsize(&self.out);
        let size = size.map(|size| (usize::from(size.ws_col), usize::from(size.ws_row)));
        size.ok().filter(|(columns, rows)| *columns > 0 && *rows > 0).unwrap_or(USUAL)
    }

    /// Shows these lines, as many as [`Terminal::size`] has rows at most. Writes only those that have changed, so that
    /// a selection in the others stays. Nothing while a shell has the terminal, or while its output is stopped (Ctrl-S).
    pub(super) fn draw(&mut self, lines: Vec<Line>) -> io::Result<()> {
        if is_in_background(&self.out) || !takes_output(&self.out) {
            return Ok(());
        }
        let mut bytes = Vec::new();
        let size = self.size();
        let is_new = !self.taken.swap(true, Ordering::Relaxed);
        if is_new {
            queue!(bytes, EnterAlternateScreen, Hide, DisableLineWrap)?;
        }
        if is_new || size != self.size {
            self.size = size;
            self.shown.clear();
            queue!(bytes, Clear(ClearType::All))?;
        }
        for (row, line) in lines.iter().enumerate() {
            if self.shown.get(row) != Some(line) {
                put(&mut bytes, row, line)?;
            }
        }
        for row in lines.len()..self.shown.len() {
            queue!(bytes, MoveTo(0, clamp(row)), Clear(ClearType::UntilNewLine))?;
        }
        self.shown = lines;
        self.out.write_all(&bytes)?;
        self.out.flush()
    }

    /// Gives the terminal back. The next [`Terminal::draw`] takes it again.
    pub(super) fn leave(&mut self) {
        give_back(&self.taken);
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.leave();
    }
}

fn give_back(taken: &AtomicBool) {
    let mut out = io::stdout();
    if taken.swap(false, Ordering::Relaxed) && takes_output(&out) {
        // A terminal that has gone needs no restoring.
        let _ = execute!(out, EnableLineWrap, Show, LeaveAlternateScreen);
    }
}

fn put(bytes: &mut Vec<u8>, row: usize, line: &Line) -> io::Result<()> {
    queue!(bytes, MoveTo(0, clamp(row)))?;
    match line.tone {
        Tone::Plain => {}
        Tone::Heading => queue!(bytes, SetAttribute(Attribute::Bold))?,
        Tone::Good => queue!(bytes, SetForegroundColor(Color::DarkGreen))?,
        Tone::Warning => queue!(bytes, SetForegroundColor(Color::DarkYellow))?,
        Tone::Alarm => queue!(bytes, SetForegroundColor(Color::DarkRed))?,
    }
    queue!(bytes, Print(&line.text), SetAttribute(Attribute::Reset), ResetColor)?;
    queue!(bytes, Clear(ClearType::UntilNewLine))
}

/// Rows of a terminal fit into its own type.
fn clamp(row: usize) -> u16 {
    u16::try_from(row).unwrap_or(u16::MAX)
}

/// Whether another process group has the terminal. One that is nobody's is not the background.
fn is_in_background(out: &Stdout) -> bool {
    tcgetpgrp(out).is_ok_and(|foreground| foreground != getpgrp())
}

/// Whether a write returns at once. It does not on a terminal whose output was stopped (Ctrl-S): a write would wait
/// until the user lets it go on, and a request to stop with it. An output that cannot be asked is taken as ready, and
/// the write finds out.
pub(super) fn takes_output(out: &Stdout) -> bool {
    let mut asked = [PollFd::new(out.as_fd(), PollFlags::POLLOUT)];
    poll(&mut asked, PollTimeout::ZERO) != Ok(0)
}
