//! The parent process: its requests about time, one per line (`pause`, `run`, `step 3`, `speed 0.5`), and a line of JSON to it
//! whenever the pace changes.

use std::io::{self, Write};
use std::sync::mpsc::{Receiver, TrySendError, sync_channel};

use host_io::{Stop, console, process};
use icd::SimTime;
use icd::pace::Pace;
use serde::{Deserialize, Serialize};
use tracing::warn;

use super::args::Speed;
use super::pacer::{PaceRequest, Pacer};

/// Requests that wait until the plant reads them, at least 20 times a second.
const WAITING_MAX: usize = 64;

/// A line that is not a request.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
enum LineError {
    /// An unknown word, or too many words.
    #[error("{0:?} is none of pause, run, step [PERIODS], speed FACTOR")]
    Unknown(String),
    /// Not a number, or out of range.
    #[error("{line:?}: the number must be from {min} to {max}")]
    Number { line: String, min: f64, max: f64 },
}

/// The parent process, if it takes part.
#[derive(Debug)]
pub(super) struct Parent {
    requests: Option<Receiver<Pace>>,
    /// Whether it reads the pace.
    reads: bool,
}

impl Parent {
    /// Reads its requests from now on; its end requests the end of the plant.
    pub(super) fn new(writes: bool, reads: bool, stop: &Stop) -> io::Result<Self> {
        let requests = writes.then(|| listen(stop.clone())).transpose()?;
        Ok(Self { requests, reads })
    }

    /// Sends its requests to the pacer, and prints a change of the pace. `time` is now.
    pub(super) fn update(&self, pacer: &mut Pacer, time: SimTime) {
        if let Some(requests) = &self.requests {
            while pacer.has_room()
                && let Ok(pace) = requests.try_recv()
            {
                pacer.request(PaceRequest { request: None, pace }, time);
            }
        }
        if let Some((paused, speed)) = pacer.take_change()
            && self.reads
        {
            // A parent that no longer reads is about to close the input as well.
            let _ = PlantLine::pace(paused, speed).print();
        }
    }
}

fn listen(stop: Stop) -> io::Result<Receiver<Pace>> {
    let (sender, receiver) = sync_channel(WAITING_MAX);
    process::listen_to_parent(stop, move |line| match parse(line) {
        Ok(pace) => {
            if let Err(TrySendError::Full(pace)) = sender.try_send(pace) {
                warn!(?pace, "too many orders at once; this one is dropped");
            }
        }
        Err(error) => warn!("{error}"),
    })?;
    Ok(receiver)
}

fn parse(line: &str) -> Result<Pace, LineError> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (pace, (min, max)) = match words[..] {
        ["pause"] => return Ok(Pace::Pause),
        ["run"] => return Ok(Pace::Run),
        ["step"] => return Ok(Pace::Step(1)),
        ["step", periods] => {
            (periods.parse().ok().map(Pace::Step), (1.0, f64::from(Pace::STEPS_MAX)))
        }
        ["speed", factor] => (factor.parse().ok().map(Pace::Speed), Pace::SPEED),
        _ => return Err(LineError::Unknown(line.to_owned())),
    };
    pace.filter(|pace| pace.is_valid()).ok_or_else(|| LineError::Number {
        line: line.to_owned(),
        min,
        max,
    })
}

/// One line about the pace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum PlantLine {
    /// How simulation time passes from here on.
    Pace {
        paused: bool,
        /// Speed while it runs, as a multiple of wall time; `None`: as fast as possible.
        speed: Option<f64>,
    },
}

impl PlantLine {
    pub(super) fn pace(paused: bool, speed: Speed) -> Self {
        let speed = match speed {
            Speed::Max => None,
            Speed::Times(factor) => Some(factor),
        };
        Self::Pace { paused, speed }
    }

    /// Writes it to the standard output.
    pub(super) fn print(&self) -> io::Result<()> {
        let mut out = console::out();
        writeln!(out, "{}", serde_json::to_string(self)?)?;
        out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_word_and_a_number() {
        for (line, pace) in [
            ("pause", Pace::Pause),
            (" run ", Pace::Run),
            ("step", Pace::Step(1)),
            ("step 100000", Pace::Step(100_000)),
            ("speed  0.25", Pace::Speed(0.25)),
        ] {
            assert_eq!(parse(line), Ok(pace));
        }
    }

    #[test]
    fn another_line_is_refused_with_the_known_words_or_the_range() {
        for (line, words) in [
            ("", "none of pause, run"),
            ("halt", "\"halt\" is none of"),
            ("pause now", "none of"),
            ("step 0", "from 1 to 100000"),
            ("step -1", "from 1 to 100000"),
            ("step 1.5", "from 1 to 100000"),
            ("step 99999999999", "from 1 to 100000"),
            ("speed", "none of"),
            ("speed NaN", "from 0.01 to 1000"),
            ("speed 0", "from 0.01 to 1000"),
        ] {
            let error = parse(line).unwrap_err().to_string();
            assert!(error.contains(words), "{line:?}: {error}");
        }
    }

    #[test]
    fn a_line_has_its_kind_and_reads_back() {
        for (speed, text) in [
            (Speed::Max, r#"{"kind":"pace","paused":true,"speed":null}"#),
            (Speed::Times(0.5), r#"{"kind":"pace","paused":true,"speed":0.5}"#),
        ] {
            let line = PlantLine::pace(true, speed);
            assert_eq!(serde_json::to_string(&line).unwrap(), text);
            assert_eq!(serde_json::from_str::<PlantLine>(text).unwrap(), line);
        }
        let other = r#"{"kind":"flight","paused":true,"speed":0.5}"#;
        assert!(serde_json::from_str::<PlantLine>(other).is_err());
    }
}
