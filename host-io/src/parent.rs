//! The parent process at the other end of the standard input: what it says line by line, and its end.

use std::io::{BufRead, Read};
use std::thread;

use crate::Stop;

/// Longest line that is understood, bytes; a longer one is handed on in pieces.
const LINE_MAX: u64 = 256;

/// Takes the lines of the standard input on a thread of its own. The end of the input becomes a request to
/// end: a parent that dies, however it dies, closes it.
///
/// # Errors
/// What the system says, if it refuses a thread.
pub fn listen(stop: Stop, on_line: impl FnMut(&str) + Send + 'static) -> std::io::Result<()> {
    let take = move || {
        each_line(std::io::stdin().lock(), on_line);
        stop.request();
    };
    thread::Builder::new().name("parent".to_owned()).spawn(take)?;
    Ok(())
}

/// Hands on each line without its end, until there are no more.
fn each_line(mut input: impl BufRead, mut on_line: impl FnMut(&str)) {
    let mut line = Vec::new();
    loop {
        match input.by_ref().take(LINE_MAX).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) => {
                // What is no text is no order either, and is shown as what it looks like.
                on_line(String::from_utf8_lossy(&line).trim());
                line.clear();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(input: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        each_line(input, |line| lines.push(line.to_owned()));
        lines
    }

    #[test]
    fn lines_come_without_their_end_and_the_last_one_needs_none() {
        assert_eq!(lines(b"pause\nstep 3\r\n\nrun"), ["pause", "step 3", "", "run"]);
        assert_eq!(lines(b""), Vec::<String>::new());
        assert_eq!(lines(b"\xff\xfe\n"), ["\u{fffd}\u{fffd}"]);
    }

    #[test]
    fn an_endless_line_does_not_grow() {
        let lines = lines(&[b'x'; 1_000]);
        assert_eq!(lines.len(), 4);
        assert!(lines.iter().all(|line| line.len() as u64 <= LINE_MAX));
    }
}
