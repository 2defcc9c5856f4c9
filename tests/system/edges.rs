//! Real programs at the edges of a machine: a limit of file sizes, a home that cannot be written, a shell that stops a job, a
//! process killed at once.

use crate::ground;
use crate::programs;

use std::fs;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use ground::Ground;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use programs::{Program, TIMEOUT, autopilot, free_port, program};
use ulog::reader::Log;

/// What an autopilot needs besides its folder of logs, to disturb nothing on this machine.
const APART: [&str; 6] = [
    "--plant-link=127.0.0.1:0",
    "--status",
    "--gcs-udp-server=none",
    "--gcs-tcp=none",
    "--parameter-file=none",
    "--signing-key=none",
];

/// Starts a program from a shell, after these commands.
fn after(commands: &str, name: &str, arguments: &[&str]) -> Program {
    let program = program(name);
    let line = format!("{commands}; exec \"$0\" \"$@\"");
    let words = ["-c", &line, program.to_str().expect("a path")];
    Program::start("/bin/sh", &[&words[..], arguments].concat())
}

/// An autopilot that was started in this way, and its address for a plant.
fn autopilot_after(commands: &str, gcs: &Ground, arguments: &[&str]) -> (Program, String) {
    let gcs = gcs.address().to_string();
    let autopilot =
        after(commands, "autopilot", &[&APART[..], &["--gcs", &gcs], arguments].concat());
    let line = autopilot.wait_for("\"listening\"");
    let listening: serde_json::Value = serde_json::from_str(&line).expect("JSON");
    (autopilot, listening["plant_link"].as_str().expect("an address").to_owned())
}

fn flight_log(folder: &Path) -> Option<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).find(|path| path.extension().is_some_and(|e| e == "ulg"))
}

#[test]
fn a_limit_of_file_sizes_ends_the_log_and_not_the_flight() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = format!("--log-dir={}", folder.path().display());
    let mut ground = Ground::new();
    let (mut autopilot, link) =
        autopilot_after("ulimit -f 1000", &ground, &[&logs, "--log-rate=full"]);
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    autopilot.wait_for("the flight log ends here");
    ground.listen_until("the flight to be heard", |ground| ground.time_s > 0.0);
    let ended_s = ground.time_s;
    ground.listen_until("the flight to go on", |ground| ground.time_s > ended_s + 1.0);
    assert!(!autopilot.has_ended());
    let log = Log::open(&flight_log(folder.path()).expect("a log")).expect("whole messages");
    assert!(log.info_text("plant_header").is_some());
}

#[test]
fn a_file_that_does_not_fit_is_not_there_under_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let out = out.to_str().expect("a path");
    // The parts have room, the table of the runs has not: it is more than 100 kB long.
    let mut campaign = after("ulimit -f 100", "sitl", &["campaign", "run", "smoke", "--out", out]);
    assert_eq!(campaign.end(), Some(1));
    campaign.wait_for("runs.parquet: External: File too large");
    let mut names: Vec<String> = fs::read_dir(out)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("text"))
        .collect();
    names.sort();
    assert_eq!(names, ["campaign.toml", "parts"]);
}

#[test]
fn a_home_that_cannot_be_written_costs_the_log_and_nothing_else() {
    let mut ground = Ground::new();
    let gcs = ground.address().to_string();
    let home = "export HOME=/dev/null; unset XDG_DATA_HOME";
    // Without the options that name files: all three stand in the user's data folder.
    let arguments = [&APART[..4], &["--gcs", &gcs]].concat();
    let autopilot = after(home, "autopilot", &arguments);
    let line = autopilot.wait_for("\"listening\"");
    let listening: serde_json::Value = serde_json::from_str(&line).expect("JSON");
    let link = listening["plant_link"].as_str().expect("an address");
    let _plant = Program::start("plant-sim", &["--autopilot", link]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    assert!(autopilot.printed().contains("no flight logs: "), "{}", autopilot.printed());
    // What an option asks for is refused.
    let logs = ["--plant-link=127.0.0.1:0", "--no-gcs", "--log-dir=/dev/null/logs"];
    let mut refused = Program::start("autopilot", &logs);
    assert_eq!(refused.end(), Some(1));
    refused.wait_for("--log-dir /dev/null/logs: Not a directory");
}

#[test]
fn the_log_of_a_process_that_is_killed_at_once_is_replayed_as_far_as_it_goes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut ground = Ground::new();
    let option = folder.path().to_str().expect("a path");
    let (mut autopilot, link) = autopilot(ground.address(), &["--log-dir", option]);
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.0);
    let until = Instant::now() + TIMEOUT;
    let log = loop {
        let log = flight_log(folder.path())
            .filter(|log| Log::open(log).is_ok_and(|log| log.info_text("plant_header").is_some()));
        if let Some(log) = log {
            break log;
        }
        assert!(Instant::now() < until, "no header in the log");
        thread::sleep(Duration::from_millis(1));
    };
    autopilot.signal(9);
    autopilot.end();
    let mut replay = Program::start("sitl", &["replay", log.to_str().expect("a path")]);
    assert_eq!(replay.end(), Some(0), "{}", replay.printed());
    replay.wait_for("the same flight bit for bit");
}

/// `sitl` as a shell starts a job: in a process group of its own, whose parent is in another one. Killed when dropped.
struct Job(Child);

impl Job {
    fn start(ground: &Ground) -> Self {
        let link = format!("127.0.0.1:{}", free_port());
        let mut command = Command::new(program("sitl"));
        command.args([
            "--plant-link",
            &link,
            "--gcs",
            &ground.address().to_string(),
            "--log-dir",
            "none",
        ]);
        command.args(&APART[2..]);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        Self(command.process_group(0).spawn().expect("a built program starts"))
    }

    fn signal(&self, signal: Signal) {
        let number = i32::try_from(self.0.id()).expect("a number");
        kill(Pid::from_raw(number), signal).expect("it runs");
    }

    /// States of the process and its two children, as in /proc: T is stopped.
    fn states(&self) -> Vec<char> {
        let all = fs::read_dir("/proc").expect("a list of processes").flatten();
        let stats = all.filter_map(|entry| fs::read_to_string(entry.path().join("stat")).ok());
        let own = self.0.id().to_string();
        let of = |stat: String| {
            let number = stat.split(' ').next()? == own;
            let mut rest = stat.rsplit(") ").next()?.split(' ');
            let state = rest.next()?.chars().next()?;
            (number || rest.next()? == own).then_some(state)
        };
        stats.filter_map(of).collect()
    }

    fn wait_for_states(&self, what: &str, is_it: impl Fn(char) -> bool) {
        let until = Instant::now() + TIMEOUT;
        while self.states().len() != 3 || !self.states().into_iter().all(&is_it) {
            assert!(Instant::now() < until, "{what}: {:?}", self.states());
            thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        // Its children end when their standard input ends.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_flight_that_the_shell_stops_stands_still_in_all_its_processes_and_goes_on() {
    let mut ground = Ground::new();
    let job = Job::start(&ground);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    for _ in 0..2 {
        job.signal(Signal::SIGTSTP);
        job.wait_for_states("stopped", |state| state == 'T');
        job.signal(Signal::SIGCONT);
        job.wait_for_states("going on", |state| state != 'T');
        let time_s = ground.time_s;
        ground.listen_until("the flight to go on", |ground| ground.time_s > time_s + 1.0);
    }
    assert_eq!(ground.texts.iter().filter(|text| text.contains("Flight began")).count(), 1);
    // It ends as always.
    job.signal(Signal::SIGTERM);
    let mut job = job;
    let until = Instant::now() + TIMEOUT;
    while job.0.try_wait().expect("a child can be waited for").is_none() {
        assert!(Instant::now() < until, "it does not end");
        thread::sleep(Duration::from_millis(5));
    }
}
