//! The parent process: its requests about time, one a line (`pause`, `run`, `step 3`, `speed 0.5`), and a line of JSON to it
//! whenever the pace changes.

use std::io::{self, Write};
use std::sync::mpsc::{Receiver, TrySendError, sync_channel};

use host_io::{Stop, process};
use icd::SimTime;
use icd::pace::Pace;
use serde::{Deserialize, Serialize};
use tracing::warn;

use super::args::Speed;
use super::pacer::{Order, Pacer};

/// Orders that wait until the plant looks after them; it looks at least 20 times a second.
const WAITING_MAX: usize = 64;

/// Not an order.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
enum OrderError {
    /// No such word, or words where none belong.
    #[error("{0:?} is none of pause, run, step [PERIODS], speed FACTOR")]
    Unknown(String),
    /// Not a number, or out of range.
    #[error("{line:?}: the number must be from {min} to {max}")]
    Number {
        /// What was said.
        line: String,
        /// Smallest allowed.
        min: f64,
        /// Largest allowed.
        max: f64,
    },
}

/// The parent process, if there is one that takes part.
#[derive(Debug)]
pub(super) struct Parent {
    orders: Option<Receiver<Pace>>,
    /// It wants to know how time passes.
    reads: bool,
}

impl Parent {
    /// From here on its orders are heard, and its end becomes a request to end.
    ///
    /// # Errors
    /// What the system says, if it refuses a thread.
    pub(super) fn new(speaks: bool, reads: bool, stop: &Stop) -> io::Result<Self> {
        let orders = speaks.then(|| listen(stop.clone())).transpose()?;
        Ok(Self { orders, reads })
    }

    /// Hands its orders to the pacer, and tells it how time passes now. It is `time` now.
    pub(super) fn look_after(&self, pacer: &mut Pacer, time: SimTime) {
        if let Some(orders) = &self.orders {
            while pacer.has_room()
                && let Ok(pace) = orders.try_recv()
            {
                pacer.order(Order { request: None, pace }, time);
            }
        }
        if let Some((paused, speed)) = pacer.take_change()
            && self.reads
        {
            // A parent that does not read any more is about to close the input as well.
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

fn parse(line: &str) -> Result<Pace, OrderError> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (pace, (min, max)) = match words[..] {
        ["pause"] => return Ok(Pace::Pause),
        ["run"] => return Ok(Pace::Run),
        ["step"] => return Ok(Pace::Step(1)),
        ["step", periods] => {
            (periods.parse().ok().map(Pace::Step), (1.0, f64::from(Pace::STEPS_MAX)))
        }
        ["speed", factor] => (factor.parse().ok().map(Pace::Speed), Pace::SPEED),
        _ => return Err(OrderError::Unknown(line.to_owned())),
    };
    pace.filter(|pace| pace.is_valid()).ok_or_else(|| OrderError::Number {
        line: line.to_owned(),
        min,
        max,
    })
}

/// One line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum PlantLine {
    /// How simulation time passes from here on.
    Pace {
        /// It stands still.
        paused: bool,
        /// Where it runs, so many times as fast as wall time; `None`: as fast as possible.
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
        let mut out = io::stdout().lock();
        writeln!(out, "{}", serde_json::to_string(self)?)?;
        out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_words_and_numbers() {
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
    fn what_is_no_order_is_told_with_the_words_or_the_range() {
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
    fn the_line_says_its_kind_and_comes_back() {
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
