//! What becomes of a flight: [`flown`] looks at every tick, with the measures that every flight has and with judges, each of which gives
//! numbers with units at the end: of `sitl fly --judge NAME` and of a campaign with `judges = ["NAME"]`.
//!
//! ```text
//! FlightSetup ─> lab_engine::Flight ─ every tick ─> flown ─> measures, judges ─> Outcome
//!                                                     └─> rows of flight.csv (trajectory), entries of the flight log
//! ```
//!
//! A judge sees the truth and what the controller made of it, and changes neither. A new one is a file here and a line in [`KINDS`].

use core::fmt;

use flight_control::Estimator;
use flight_control::estimator_status::EstimatorStatus;
use icd::fault::Onset;
use lab_engine::FlightSetup;
use lab_engine::flight::{Exchange, Tick};
use plant_sim::ScheduledFault;

pub mod alarms;
pub mod altitude;
pub mod closed_loop;
pub mod estimate;
pub mod flown;
pub mod landing;
pub mod level;
pub mod loops;
pub mod measures;
pub mod metrics;
pub mod nees;
pub mod outcome;
pub mod row;
pub mod sensor_fault;
pub mod spectrum;
pub mod steady;
pub mod trace;
pub mod trajectory;
pub mod verdict;

/// Looks at a flight.
pub trait Judge: fmt::Debug {
    /// A tick, in the order of time.
    fn look(&mut self, tick: &Tick<'_>);

    /// Its numbers, in the order of the columns of its kind; `None` where the flight gave none.
    fn values(&self) -> Vec<Option<f64>>;
}

/// A kind of judge.
#[derive(Debug, Clone, Copy)]
pub struct JudgeKind {
    /// Name in options and specifications.
    pub name: &'static str,
    /// Names and units of its numbers.
    pub columns: &'static [(&'static str, &'static str)],
    make: fn(&FlightSetup) -> Box<dyn Judge>,
}

impl PartialEq for JudgeKind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

pub const KINDS: [JudgeKind; 8] = [
    JudgeKind {
        name: "altitude",
        columns: &altitude::COLUMNS,
        make: |setup| Box::new(altitude::AltitudeJudge::of(setup)),
    },
    JudgeKind {
        name: "estimate",
        columns: &estimate::COLUMNS,
        make: |setup| Box::new(estimate::EstimateJudge::of(setup)),
    },
    JudgeKind {
        name: "landing",
        columns: &landing::COLUMNS,
        make: |_| Box::new(landing::LandingJudge::default()),
    },
    JudgeKind {
        name: "level",
        columns: &level::COLUMNS,
        make: |setup| Box::new(level::LevelJudge::of(setup)),
    },
    JudgeKind {
        name: "nees",
        columns: &nees::COLUMNS,
        make: |_| Box::new(nees::NeesJudge::default()),
    },
    JudgeKind {
        name: "sensor_fault",
        columns: &sensor_fault::COLUMNS,
        make: |setup| Box::new(sensor_fault::SensorFaultJudge::of(setup)),
    },
    JudgeKind {
        name: "alarms",
        columns: &alarms::COLUMNS,
        make: |setup| Box::new(alarms::AlarmsJudge::of(setup)),
    },
    JudgeKind {
        name: "verdict",
        columns: &verdict::COLUMNS,
        make: |setup| Box::new(verdict::VerdictJudge::of(setup)),
    },
];

/// When a fault of a setup begins, s.
fn onset_s(fault: &ScheduledFault) -> f64 {
    match fault.timing.onset {
        Onset::At(time) => time.as_seconds(),
        Onset::AtOnce => 0.0,
    }
}

/// The estimator and its report, once a second from a time on, s; `None` between, and of flights on the samples of an attitude unit.
fn every_second<'a>(tick: &Tick<'a>, from_s: f64) -> Option<(&'a Estimator, &'a EstimatorStatus)> {
    let is_due = begins_a_second(&tick.exchange);
    let is_settled = tick.exchange.time.as_seconds() >= from_s;
    (is_due && is_settled).then_some(())?;
    Some((tick.estimator?, tick.log.state.estimate.as_ref()?))
}

/// Whether the tick is the first one of a second, also where the period divides no second.
fn begins_a_second(exchange: &Exchange) -> bool {
    let time_us = exchange.time.as_micros();
    let period_us = time_us.checked_div(exchange.step).unwrap_or(1);
    time_us % 1_000_000 < period_us
}

impl JudgeKind {
    /// The names of all of them.
    pub fn names() -> String {
        KINDS.map(|kind| kind.name).join(", ")
    }

    /// The kind of a name.
    pub fn parse(name: &str) -> Result<Self, String> {
        let found = KINDS.into_iter().find(|kind| kind.name == name);
        found.ok_or_else(|| format!("{name:?} is no judge; the judges are {}", Self::names()))
    }

    /// A judge for a flight.
    pub fn judge(&self, setup: &FlightSetup) -> Box<dyn Judge> {
        (self.make)(setup)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use lab_engine::{Flight, SetupOptions};

    use super::*;

    #[test]
    fn each_second_begins_with_one_tick_at_every_control_period() {
        for period in ["1", "1.3", "2", "3", "4"] {
            let period_ms = plant_sim::io::parse_period(period).unwrap();
            let mut options = SetupOptions { period_ms, ..SetupOptions::default() };
            let _ = options.set("plant.duration_s", 10.0);
            let mut flight = Flight::new(&options.setup("nominal").unwrap()).unwrap();
            let mut begun = Vec::new();
            while let Some(tick) = flight.step([]) {
                if begins_a_second(&tick.exchange) {
                    begun.push(tick.exchange.time.as_micros() / 1_000_000);
                }
            }
            let last = begun.last().copied().unwrap();
            assert!(
                last >= 9 && begun.iter().copied().eq(begun[0]..=last) && begun[0] <= 1,
                "{period} ms: {begun:?}"
            );
        }
    }

    #[test]
    fn every_judge_has_a_value_for_each_column_and_no_column_stands_twice() {
        let mut options = SetupOptions::default();
        let _ = options.set("plant.duration_s", 30.0).set("plant.sensors.grade", "tactical");
        for (key, value) in [("effector", "left_elevator"), ("kind", "stuck_at")] {
            let _ = options.set(&format!("plant.fault.1.{key}"), value);
        }
        let _ = options.set("plant.fault.1.onset_s", 12.0).set("plant.fault.1.angle_deg", 15.0);
        let setup = options.setup("nominal").unwrap();
        let mut names = BTreeSet::new();
        for kind in KINDS {
            assert_eq!(JudgeKind::parse(kind.name), Ok(kind));
            let (mut judge, mut flight) = (kind.judge(&setup), Flight::new(&setup).unwrap());
            assert!(judge.values().iter().all(Option::is_none), "{}: before the flight", kind.name);
            while let Some(tick) = flight.step([]) {
                judge.look(&tick);
            }
            let values = judge.values();
            assert_eq!(values.len(), kind.columns.len(), "{}", kind.name);
            // Only the flight in `tests/flown/ground.rs` of the studies has a landing.
            let is_there = |v: &Option<f64>| v.map_or(kind.name == "landing", f64::is_finite);
            assert!(values.iter().all(is_there), "{}: {values:?}", kind.name);
            assert!(kind.columns.iter().all(|(name, _)| names.insert(*name)), "{}", kind.name);
        }
        assert!(JudgeKind::parse("x").unwrap_err().contains("altitude, estimate, landing"));
    }
}
