//! One flown tick against the rows of the log, bit for bit.

use core::fmt;

use autopilot::recorder::RunHash;
use icd::SimTime;
use ulog::reader::{Log, Row, Topic};

/// The first place where log and flight differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Control step, from 0.
    pub step: u64,
    /// Simulation time of the step.
    pub time: SimTime,
    pub signal: String,
    /// Value in the log.
    pub logged: String,
    /// Value of the flight.
    pub flown: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { step, time, signal, logged, flown } = self;
        let t_s = time.as_seconds();
        write!(
            f,
            "first difference at control step {step} (t = {t_s:.6} s), signal {signal}:\n  \
             logged {logged}\n  flown  {flown}"
        )
    }
}

/// The rows of one topic, tick by tick.
#[derive(Debug)]
pub struct Rows<'a> {
    name: &'static str,
    topic: Option<Topic<'a>>,
    next: usize,
    is_damaged: bool,
    /// One of so many control steps has a row wherever it is.
    every: u64,
}

impl<'a> Rows<'a> {
    /// Of a topic of this name.
    pub fn new(log: &'a Log, name: &'static str, every: u64) -> Self {
        let is_damaged = !log.damages().is_empty();
        Self { name, topic: log.topic(name), next: 0, is_damaged, every }
    }

    /// The log has a row of this time, or an older one that was not compared.
    pub fn reach(&self, time: SimTime) -> bool {
        let next = self.topic.and_then(|topic| topic.row(self.next));
        next.is_some_and(|row| row.timestamp_us() <= time.as_micros())
    }

    /// Compares the row of this tick, if it has one; signals without a column count as equal.
    pub fn check<'n>(
        &mut self,
        step: u64,
        time: SimTime,
        signals: impl IntoIterator<Item = (&'n str, f64)>,
    ) -> Result<(), Box<Difference>> {
        // Where the log ends there is nothing to compare.
        let us = time.as_micros();
        let Some(topic) = self.topic else { return Ok(()) };
        // A damaged time is behind those that follow.
        while self.is_damaged && topic.row(self.next).is_some_and(|row| row.timestamp_us() < us) {
            self.next += 1;
        }
        let Some(row) = topic.row(self.next) else { return Ok(()) };
        let differ = |name: &str, logged: String, flown: String| {
            let signal = format!("{}.{name}", self.name);
            Err(Box::new(Difference { step, time, signal, logged, flown }))
        };
        if row.timestamp_us() > us && (self.is_damaged || !step.is_multiple_of(self.every)) {
            // The row of this tick is lost, or there was none.
            return Ok(());
        }
        if row.timestamp_us() != us {
            let at = |us: u64| format!("{us} us");
            return differ("timestamp", at(row.timestamp_us()), at(us));
        }
        self.next += 1;
        for (name, flown) in signals {
            if let Some(logged) =
                row.value(name).filter(|logged| !is_same(&row, name, *logged, flown))
            {
                return differ(name, written(logged), written(flown));
            }
        }
        Ok(())
    }
}

/// The run hashes that a log has on its course, by the number of control steps.
#[derive(Debug)]
pub struct Hashes<'a> {
    topic: Option<Topic<'a>>,
    next: usize,
    /// Control steps of the last hash that was the same.
    same: u64,
}

impl<'a> Hashes<'a> {
    /// Of a log; one without the topic has none.
    pub fn new(log: &'a Log) -> Self {
        Self { topic: log.topic("hash"), next: 0, same: 0 }
    }

    /// Compares the hash after so many control steps, if the log has it.
    ///
    /// # Errors
    /// Another hash: the flights differ somewhere since the last one that was the same.
    pub fn check(&mut self, time: SimTime, flown: &RunHash) -> Result<(), Box<Difference>> {
        let steps = flown.steps();
        let Some(topic) = self.topic else { return Ok(()) };
        let number = |row: &Row<'_>| row.unsigned("steps").unwrap_or(0);
        while topic.row(self.next).is_some_and(|row| number(&row) < steps) {
            self.next += 1;
        }
        let Some(row) = topic.row(self.next).filter(|row| number(row) == steps) else {
            return Ok(());
        };
        self.next += 1;
        let logged =
            String::from_utf8_lossy(row.bytes("run_hash").unwrap_or_default()).into_owned();
        let flown = flown.hex();
        if logged == flown {
            self.same = steps;
            return Ok(());
        }
        let step = steps.saturating_sub(1);
        let signal = format!("run hash of the control steps {} to {step}", self.same);
        Err(Box::new(Difference { step, time, signal, logged, flown }))
    }
}

/// Bit for bit; a signal of fewer bits than a double has is compared in its own type.
fn is_same(row: &Row<'_>, name: &str, logged: f64, flown: f64) -> bool {
    let narrow = row.bytes(name).is_some_and(|bytes| bytes.len() < size_of::<f64>());
    if narrow { logged == flown } else { logged.to_bits() == flown.to_bits() }
}

/// A value so that two different ones look different.
fn written(value: f64) -> String {
    let bits = value.to_bits();
    // In full a subnormal number has hundreds of zeros.
    if value.is_subnormal() {
        format!("{value:e} ({bits:016x})")
    } else {
        format!("{value} ({bits:016x})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_near_zero_are_written_short() {
        assert_eq!(written(5.0e-324), "5e-324 (0000000000000001)");
        assert_eq!(written(0.5), "0.5 (3fe0000000000000)");
    }
}
