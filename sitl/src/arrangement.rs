//! Which cores the two processes use and how they wait, measured on this machine.
//!
//! The two never work at the same time, so what counts is how fast one wakes the other. That depends on
//! the machine: sharing a core saves the wake-up between cores, spinning on two saves the sleep.

use std::fmt;
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::{self, JoinHandle};

use host_io::Wait;
use host_io::problem::{At as _, Problem, problem};
use host_io::process::allowed_cores;

/// Time for each arrangement, ms.
const MEASURE_MS: u64 = 30;

/// Where one process runs and how it waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// The core; `None` for any.
    pub cpu: Option<usize>,
    pub wait: Wait,
}

impl Place {
    /// The same as options of a process.
    pub fn options(&self) -> Vec<String> {
        let mut options = vec!["--wait".to_owned(), self.wait.name().to_owned()];
        if let Some(cpu) = self.cpu {
            options.extend(["--cpu".to_owned(), cpu.to_string()]);
        }
        options
    }
}

/// Places of both processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arrangement {
    pub autopilot: Place,
    pub plant: Place,
}

impl Arrangement {
    /// What is used where speed does not matter: any cores, asleep while waiting.
    pub const UNPINNED: Self = {
        let place = Place { cpu: None, wait: Wait::Block };
        Self { autopilot: place, plant: place }
    };

    const fn new(autopilot: Option<usize>, plant: Option<usize>, wait: Wait) -> Self {
        Self { autopilot: Place { cpu: autopilot, wait }, plant: Place { cpu: plant, wait } }
    }
}

impl fmt::Display for Arrangement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.autopilot.cpu, self.plant.cpu) {
            (Some(a), Some(p)) if a == p => write!(f, "both on core {a}")?,
            (Some(a), Some(p)) => write!(f, "autopilot on core {a}, plant on core {p}")?,
            _ => f.write_str("any cores")?,
        }
        match self.autopilot.wait {
            Wait::Block => f.write_str(", asleep while waiting"),
            Wait::Yield => f.write_str(", yielding while waiting"),
            Wait::Spin => f.write_str(", spinning while waiting"),
        }
    }
}

/// An arrangement and what it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredRate {
    pub arrangement: Arrangement,
    /// Bare round trips a second.
    pub round_trips_per_s: f64,
}

/// What is worth trying on these cores.
fn candidates(cores: &[usize]) -> Vec<Arrangement> {
    let mut candidates = vec![Arrangement::UNPINNED];
    // The last cores: interrupts and other processes prefer the first.
    // Where the system does not name its cores, the unpinned arrangement alone is left.
    let Some((&last, others)) = cores.split_last() else { return candidates };
    // Never spinning on one core: the one that waits would keep the other from answering.
    for wait in [Wait::Block, Wait::Yield] {
        candidates.push(Arrangement::new(Some(last), Some(last), wait));
    }
    // A neighbour may share the core's arithmetic or its cache; one far away shares neither.
    let mut partners: Vec<usize> =
        others.last().into_iter().chain(others.first()).copied().collect();
    // With two cores the nearest neighbour is also the farthest.
    partners.dedup();
    for partner in partners {
        candidates.push(Arrangement::new(Some(partner), Some(last), Wait::Spin));
    }
    candidates
}

/// Measures what `program` (the `sitl` executable) can do in each arrangement, fastest first.
///
/// Arrangements that this machine does not allow are left out.
pub fn measure_all(program: &Path) -> Vec<MeasuredRate> {
    let mut measured: Vec<MeasuredRate> = candidates(&allowed_cores())
        .into_iter()
        .filter_map(|arrangement| {
            let rate = echo_rate(program, &arrangement, MEASURE_MS).ok()?;
            Some(MeasuredRate { arrangement, round_trips_per_s: rate })
        })
        .collect();
    measured.sort_by(|a, b| b.round_trips_per_s.total_cmp(&a.round_trips_per_s));
    measured
}

/// The fastest arrangement; unpinned if nothing could be measured.
pub fn fastest(program: &Path) -> MeasuredRate {
    let unknown = MeasuredRate { arrangement: Arrangement::UNPINNED, round_trips_per_s: 0.0 };
    measure_all(program).first().copied().unwrap_or(unknown)
}

/// Bare round trips a second between two processes in this arrangement.
pub fn echo_rate(program: &Path, arrangement: &Arrangement, for_ms: u64) -> Result<f64, Problem> {
    let start = |options: &[String]| {
        let mut command = Command::new(program);
        command.arg("echo").args(options);
        Process::start("echo", command)
    };
    let mut server = start(&arrangement.autopilot.options())?;
    let mut options = arrangement.plant.options();
    options.extend(["--to".to_owned(), server.line()?, format!("--for-ms={for_ms}")]);
    let mut client = start(&options)?;
    let line = client.line()?;
    line.parse().map_err(|_| client.unexpected(&line))
}

const NO_END: &str = "cannot wait for a process";

/// A child process whose standard output is read line by line; killed if it is dropped before its end.
pub(crate) struct Process {
    name: &'static str,
    pub(crate) child: Child,
    output: BufReader<ChildStdout>,
    /// Reads its standard error, so that it never waits for a reader, and gives the last line.
    last_error: Option<JoinHandle<String>>,
}

impl Process {
    pub(crate) fn start(name: &'static str, mut command: Command) -> Result<Self, Problem> {
        // Only warnings: flights come by the dozen.
        command.env("RUST_LOG", "warn");
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().at("cannot start a process")?;
        let output = child.stdout.take().expect("its output is piped");
        let errors = child.stderr.take().expect("its errors are piped");
        // An error is the last thing that is said; warnings of the flight stand before it.
        let last_line = move || {
            let lines = BufReader::new(errors).lines().map_while(Result::ok);
            lines.filter(|line| !line.trim().is_empty()).last().unwrap_or("nothing".to_owned())
        };
        let last_error = thread::Builder::new().name("errors".to_owned()).spawn(last_line);
        let last_error = Some(last_error.at("cannot read from a process")?);
        Ok(Self { name, child, output: BufReader::new(output), last_error })
    }

    /// Next line of its standard output.
    pub(crate) fn line(&mut self) -> Result<String, Problem> {
        let mut line = String::new();
        if self.output.read_line(&mut line).at("cannot read from a process")? == 0 {
            return Err(self.failure());
        }
        Ok(line.trim_end().to_owned())
    }

    /// Ends it, and waits for that.
    pub(crate) fn end(mut self) -> Result<(), Problem> {
        // The end of its input is the request: each of these programs ends with its parent.
        drop(self.child.stdin.take());
        // A process that still prints must not wait for a reader.
        let _ = io::copy(&mut self.output, &mut io::sink());
        let status = self.child.wait().at(NO_END)?;
        if status.success() { Ok(()) } else { Err(self.failure()) }
    }

    /// It has ended, or closed its output; this is why.
    pub(crate) fn failure(&mut self) -> Problem {
        drop(self.child.stdin.take());
        // A reader that panicked has read nothing.
        let message = self.last_error.take().and_then(|reader| reader.join().ok());
        let message = message.unwrap_or("nothing".to_owned());
        match self.child.wait() {
            Ok(status) => problem!("{} ended ({status}): {message}", self.name),
            Err(error) => problem!("{NO_END}: {error}"),
        }
    }

    pub(crate) fn unexpected(&self, line: &str) -> Problem {
        problem!("{} said {line:?}", self.name)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It has ended already, or it ends now; either way nothing is left to do.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_child_that_warns_a_lot_does_not_wait_for_a_reader_and_its_last_line_is_the_reason() {
        let mut shell = Command::new("sh");
        // More than a pipe holds.
        shell.args([
            "-c",
            "yes a warning | head -c 300000 >&2; echo ready; echo no fuel >&2; exit 3",
        ]);
        let mut child = Process::start("shell", shell).unwrap();
        assert_eq!(child.line().unwrap(), "ready");
        let why = child.failure().to_string();
        assert!(why.contains("shell ended") && why.ends_with("no fuel"), "{why}");
    }

    #[test]
    fn one_core_is_shared_and_two_are_also_tried_apart() {
        assert_eq!(candidates(&[]).len(), 1);
        let one = candidates(&[5]);
        assert_eq!(one.len(), 3);
        assert!(one.iter().skip(1).all(|a| a.autopilot.cpu == Some(5) && a.plant.cpu == Some(5)));
        let two = candidates(&[2, 3]);
        assert_eq!(two.last(), Some(&Arrangement::new(Some(2), Some(3), Wait::Spin)));
        assert_eq!(two.len(), 4);
        assert_eq!(candidates(&[0, 1, 2, 3]).len(), 5);
    }

    #[test]
    fn an_arrangement_reads_like_a_sentence() {
        let shared = Arrangement::new(Some(3), Some(3), Wait::Block);
        assert_eq!(shared.to_string(), "both on core 3, asleep while waiting");
        let apart = Arrangement::new(Some(0), Some(3), Wait::Spin);
        assert_eq!(
            apart.to_string(),
            "autopilot on core 0, plant on core 3, spinning while waiting"
        );
    }
}
