//! How simulation time passes, for the parent process: a line of JSON whenever that changes.

use std::io::{self, Write};

use serde::{Deserialize, Serialize};

use super::speed::Speed;

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
