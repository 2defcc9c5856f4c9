//! `sitl` on a terminal: one screen that is redrawn in place, also when the terminal changes its size, and a terminal
//! that is restored however the flight ends.

use crate::programs;

use std::fs::File;
use std::io::{Read, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use nix::pty::{OpenptyResult, Winsize, openpty};
use nix::sys::signal::{Signal, kill};
use nix::sys::termios::{FlowArg, Termios, tcflow, tcgetattr};
use nix::unistd::Pid;
use programs::{TIMEOUT, free_port, program};
use rustix::termios::tcsetwinsize;

/// Sequences that switch the terminal to the screen, and back.
const TAKEN: &str = "\x1b[?1049h";
const GIVEN_BACK: &str = "\x1b[?1049l";
const CURSOR_SHOWN: &str = "\x1b[?25h";

fn size(columns: u16, rows: u16) -> Winsize {
    Winsize { ws_row: rows, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 }
}

/// `sitl` on its own terminal.
struct OnTerminal {
    terminal: OpenptyResult,
    before: Termios,
    screen: File,
    sitl: Child,
    /// Its output so far.
    shown: String,
}

impl OnTerminal {
    fn start() -> Self {
        let terminal = openpty(&size(80, 24), None).expect("the system has terminals");
        let before = tcgetattr(&terminal.slave).expect("a terminal");
        let copy = || Stdio::from(terminal.slave.try_clone().expect("a copy of a descriptor"));
        let link = format!("127.0.0.1:{}", free_port());
        let gcs = format!("127.0.0.1:{}", free_port());
        let mut command = Command::new(program("sitl"));
        command.args(["--plant-link", &link, "--gcs", &gcs, "--gcs-udp-server", "none"]);
        command.args(["--gcs-tcp", "none", "--parameter-file", "none", "--signing-key", "none"]);
        command.args(["--log-dir", "none"]).env("TERM", "xterm").env_remove("NO_COLOR");
        command.stdin(copy()).stdout(copy()).stderr(copy());
        let sitl = command.spawn().expect("a built program starts");
        let screen = File::from(terminal.master.try_clone().expect("a copy of a descriptor"));
        Self { terminal, before, screen, sitl, shown: String::new() }
    }

    /// Reads until `part` appears in new output.
    fn read_until(&mut self, part: &str) {
        let (until, from) = (Instant::now() + TIMEOUT, self.shown.len());
        while !self.shown[from..].contains(part) {
            assert!(Instant::now() < until, "waited for {part:?}; so far:\n{}", self.latest());
            let mut bytes = [0; 4096];
            let count = self.screen.read(&mut bytes).expect("the other end is open");
            self.shown.push_str(&String::from_utf8_lossy(&bytes[..count]));
        }
    }

    /// The last part of the output.
    fn latest(&self) -> String {
        let skipped = self.shown.chars().count().saturating_sub(2_000);
        self.shown.chars().skip(skipped).collect()
    }

    /// Its end, after which the terminal must be as before.
    fn end(mut self) -> (ExitStatus, String) {
        let from = self.shown.rfind(GIVEN_BACK);
        assert_eq!(from, None, "it is given back at the end only");
        self.read_until(GIVEN_BACK);
        let status = self.sitl.wait().expect("a child can be waited for");
        // Output from before its end can still be read.
        self.terminal
            .slave
            .try_clone()
            .map(File::from)
            .expect("a copy")
            .write_all(b"END")
            .expect("written");
        if !self.shown.contains("END") {
            self.read_until("END");
        }
        assert!(self.shown.contains(CURSOR_SHOWN), "the cursor is shown: {}", self.shown);
        let after = tcgetattr(&self.terminal.slave).expect("a terminal");
        assert_eq!(after, self.before, "its settings are as before");
        (status, self.shown)
    }
}

/// The rows and texts between the switch to the screen and the switch back.
fn drawn(shown: &str) -> Vec<(usize, String)> {
    let screen = shown.split_once(TAKEN).expect("it was taken").1;
    let screen = screen.split_once(GIVEN_BACK).map_or(screen, |(screen, _)| screen);
    assert!(!screen.contains('\n'), "nothing scrolls: {screen:?}");
    let mut rows = Vec::new();
    for part in screen.split("\x1b[").skip(1) {
        let end = part.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(0);
        let (code, text) = part.split_at(end);
        let text = text.get(1..).unwrap_or_default();
        if part.as_bytes().get(end) == Some(&b'H') {
            let row = code.split(';').next().and_then(|row| row.parse().ok()).unwrap_or(1);
            rows.push((row, String::new()));
        }
        if let Some((_, row)) = rows.last_mut() {
            row.push_str(text);
        }
    }
    rows
}

#[test]
fn the_screen_is_redrawn_in_place_and_follows_the_size_of_the_terminal() {
    let mut it = OnTerminal::start();
    it.read_until("flying");
    for _ in 0..6 {
        it.read_until("flying");
    }
    let wide = it.shown.len();
    let narrow = rustix::termios::Winsize { ws_row: 20, ws_col: 50, ws_xpixel: 0, ws_ypixel: 0 };
    tcsetwinsize(&it.terminal.master, narrow).expect("a terminal has a size");
    it.read_until("\x1b[2J");
    let resized = wide + it.shown[wide..].find("\x1b[2J").expect("it was cleared");
    it.screen.write_all(b" ").expect("sitl reads its terminal");
    it.read_until("PAUSED");
    let from_here = it.shown.len();
    it.screen.write_all(b"q").expect("sitl reads its terminal");
    let (status, shown) = it.end();
    assert!(status.success(), "{status}: {shown}");

    let rows = drawn(&shown[..resized]);
    assert!(rows.iter().all(|(row, text)| *row <= 24 && text.chars().count() <= 80), "{rows:?}");
    let titles = rows.iter().filter(|(row, _)| *row == 1).count();
    assert!(titles > 5, "the first row was drawn {titles} times");
    let help = rows.iter().filter(|(_, text)| text.starts_with("  mavproxy.py")).count();
    assert!(help <= 3, "what does not change is not drawn again: {help} times");
    let rows = drawn(&format!("{TAKEN}{}", &shown[resized..]));
    assert!(rows.iter().all(|(row, text)| *row <= 20 && text.chars().count() <= 50), "{rows:?}");
    let left = shown[from_here..].split_once(GIVEN_BACK).expect("given back").1;
    assert!(left.contains("ended at ") && left.contains("in the air"), "plain lines stay: {left}");
}

#[test]
fn a_signal_and_the_death_of_the_plant_leave_the_terminal_as_it_was() {
    let mut it = OnTerminal::start();
    it.read_until("flying");
    kill(Pid::from_raw(it.sitl.id().try_into().expect("a number")), Signal::SIGTERM)
        .expect("it runs");
    let (status, shown) = it.end();
    assert!(status.success(), "{status}: {shown}");

    let mut it = OnTerminal::start();
    it.read_until("flying");
    let plant = child_named(it.sitl.id(), "plant-sim");
    kill(Pid::from_raw(plant), Signal::SIGKILL).expect("it runs");
    let (status, shown) = it.end();
    assert!(!status.success());
    let left = shown.split_once(GIVEN_BACK).expect("given back").1;
    assert!(left.contains("plant-sim ended"), "the reason stays: {left}");
}

#[test]
fn a_terminal_whose_output_is_stopped_does_not_keep_a_signal_from_ending_the_flight() {
    let mut it = OnTerminal::start();
    it.read_until("flying");
    tcflow(&it.terminal.slave, FlowArg::TCOOFF).expect("a terminal can be stopped");
    std::thread::sleep(Duration::from_millis(500));
    kill(Pid::from_raw(it.sitl.id().try_into().expect("a number")), Signal::SIGTERM)
        .expect("it runs");
    let until = Instant::now() + TIMEOUT;
    let status = loop {
        if let Some(status) = it.sitl.try_wait().expect("the state of a child") {
            break status;
        }
        assert!(Instant::now() < until, "it waits for its terminal");
        std::thread::sleep(Duration::from_millis(20));
    };
    assert!(status.success(), "{status}");
    tcflow(&it.terminal.slave, FlowArg::TCOON).expect("a terminal can go on");
}

/// Number of the child of `parent` whose command line has this word.
fn child_named(parent: u32, word: &str) -> i32 {
    let processes = std::fs::read_dir("/proc").expect("a list of processes");
    let number =
        |entry: &std::fs::DirEntry| entry.file_name().to_str().and_then(|n| n.parse().ok());
    let is_it = |process: &i32| {
        let read = |file: &str| std::fs::read_to_string(format!("/proc/{process}/{file}"));
        let is_child = read("stat").is_ok_and(|stat| {
            let rest = stat.rsplit(") ").next().unwrap_or_default();
            rest.split(' ').nth(1) == Some(parent.to_string().as_str())
        });
        is_child && read("cmdline").is_ok_and(|line| line.split('\0').any(|part| part == word))
    };
    let found = processes.flatten().filter_map(|entry| number(&entry)).find(is_it);
    found.unwrap_or_else(|| panic!("{parent} has no child {word}"))
}
