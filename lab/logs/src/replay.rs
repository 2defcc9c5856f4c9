//! Flies the flight of a log again, in one process, and compares it with the log bit for bit.
//!
//! ```text
//! log ─> headers ─> plant, autopilot ─> fly: the inputs of the log at their control steps ─┐
//!  └──────────────> rows, run hash ────────────────────────────> first difference <────────┘
//! ```

use host_io::print_line;
use std::io;
use std::path::{Path, PathBuf};

use autopilot::own_law::OwnLaw;
use clap::Args;
use host_io::file;
use ulog::reader::{Log, ReadError};

mod compare;
mod fly;
mod recording;

pub use compare::Difference;
pub use fly::{Outcome, ReplayVerdict, fly};
pub use recording::{Input, Recording, inputs};

use host_io::problem::Problem;
use lab_report::runner::Progress;

/// Exit code of a flight that is the same to the bit.
const SAME: u8 = 0;
/// Exit code of a flight that differs.
const DIFFERENT: u8 = 1;
/// Exit code of a flight that could not be flown again.
const CANNOT_FLY: u8 = 2;
/// Exit code of a damaged log of which all that can be read is the same.
const DAMAGED: u8 = 3;

/// Longest log that is read, bytes: that of more than an hour at the full rate. It is read into memory.
const LOG_MAX: u64 = 1 << 32;

/// Options of `sitl log replay`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The flight log (.ulg)
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// The law of a log with `CTL_LAW` 9; a program brings it, no option.
    #[arg(skip)]
    own: Option<OwnLaw>,
}

impl ReplayArgs {
    /// Takes a law that the program brings; it flies where the log has one.
    pub fn set_own_law(&mut self, own: &OwnLaw) {
        self.own = Some(own.clone());
    }
}

/// Reads a flight log that the user names, whole, if it is an ordinary file of sane size.
pub fn open_log(path: &Path) -> Result<Log, ReadError> {
    Log::from_bytes(file::read(path, LOG_MAX).map_err(io::Error::other)?)
}

/// Flies the log again. Exit code 0: the same flight; 1: another one; 2: it could not be flown, or
/// whether it is the same is unknown; 3: the log is damaged, and the same flight where it can be read.
pub fn run(args: &ReplayArgs) -> u8 {
    let log = open_log(&args.log).map_err(Problem::from);
    let recording = match log.and_then(|log| Recording::with_law(log, args.own.clone())) {
        Ok(recording) => recording,
        Err(reason) => return cannot(args, &reason),
    };
    print_line!("{}", recording.title());
    for remark in recording.remarks() {
        print_line!("note: {remark}");
    }
    let steps = usize::try_from(recording.steps()).unwrap_or(usize::MAX);
    let progress = Progress::new("replay", "control steps", steps);
    let verdict = match fly(&recording, &mut |_| progress.one_done()) {
        Ok(verdict) => verdict,
        Err(reason) => return cannot(args, &reason),
    };
    progress.finish();
    print_line!("{verdict}");
    match verdict.outcome() {
        Outcome::Same => SAME,
        Outcome::SameWhereReadable => DAMAGED,
        Outcome::Different => DIFFERENT,
        Outcome::Unknown => CANNOT_FLY,
    }
}

/// Flies the bytes of a file again, whatever they are, for `steps_max` control steps at most.
pub fn of_bytes(bytes: Vec<u8>, steps_max: u64) -> Result<ReplayVerdict, Problem> {
    let recording = Recording::of(Log::from_bytes(bytes)?)?.up_to(steps_max);
    fly(&recording, &mut |_| {})
}

fn cannot(args: &ReplayArgs, reason: &Problem) -> u8 {
    print_line!("{} cannot be flown again: {reason}", args.log.display());
    CANNOT_FLY
}

#[cfg(test)]
pub(crate) mod tests;
