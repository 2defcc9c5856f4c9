//! Many flights that differ in their seed only: all cores, one table.
//!
//! A flight is a function of its setup, and results stand in the order of the seeds, so nothing depends on how many
//! threads there are.

use std::fmt::Write as _;
use std::str::FromStr;

use lab_tables::{Column, Table, cells, columns};

use host_io::problem::Problem;
use lab_judges::closed_loop::FlightSetup;
use lab_judges::flown::{self, Keep};
use lab_judges::metrics::wilson_95;
use lab_judges::outcome::Outcome;
use lab_report::runner;

/// Most flights of one command.
const SEEDS_MAX: u64 = 100_000;
/// Measures that the table on the screen shows, with their headings.
const SHOWN: [(&str, &str); 3] = [
    ("altitude_rmse", "altitude rmse, m"),
    ("roll_rmse", "roll rmse, rad"),
    ("detection_delay", "detected after, s"),
];

/// One seed, or all from one to another, both included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seeds {
    One(u64),
    /// A range of them.
    Range {
        from: u64,
        to: u64,
    },
}

impl FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let max = u64::MAX;
        let number = |word: &str| {
            let refused = || format!("{word} is not a whole number from 0 to {max}");
            word.parse::<u64>().map_err(|_| refused())
        };
        let Some((from, to)) = text.split_once("..") else { return number(text).map(Self::One) };
        let (from, to) = (number(from)?, number(to)?);
        match to.checked_sub(from) {
            None => Err(format!("{from} is above {to}; A..B are the seeds from A to B")),
            Some(more) if more >= SEEDS_MAX => {
                Err(format!("{from}..{to} are more than {SEEDS_MAX} seeds"))
            }
            // Greater ones are no whole numbers of a table.
            Some(_) if i64::try_from(to).is_err() => Err(format!("{to} is above {}", i64::MAX)),
            Some(_) => Ok(Self::Range { from, to }),
        }
    }
}

/// Flies a setup once for each seed, on all cores.
pub fn fly<'a>(
    setup: &FlightSetup,
    from: u64,
    to: u64,
    stops_at_loss: bool,
    keep: impl Fn() -> Keep<'a> + Sync,
) -> Result<Vec<Outcome>, Problem> {
    let seeds: Vec<u64> = (from..=to).collect();
    let one = |seed: &u64| {
        let mut setup = setup.clone();
        setup.plant.seed = *seed;
        flown::fly(&setup, stops_at_loss, keep()).map(|(outcome, _)| outcome)
    };
    runner::map_quietly("seeds", &seeds, one).into_iter().collect()
}

/// The table for people: a line for each seed, and how many were lost.
pub(super) fn shown(outcomes: &[Outcome]) -> String {
    let mut text = format!("{:>10}  {:<5} {:>9}", "seed", "", "end, s");
    for (_, heading) in SHOWN {
        let _ = write!(text, "  {heading:>17}");
    }
    text.push('\n');
    for outcome in outcomes {
        let fate = if outcome.is_kept() { "kept" } else { "lost" };
        let _ = write!(text, "{:>10}  {fate:<5} {:>9.3}", outcome.seed, outcome.end_s);
        for (name, _) in SHOWN {
            let value = outcome.metric(name).map_or("-".to_owned(), |value| format!("{value:.4}"));
            let _ = write!(text, "  {value:>17}");
        }
        if let Some(loss) = outcome.loss {
            let _ = write!(text, "  {}", loss.by);
        }
        text.push('\n');
    }
    let lost = outcomes.iter().filter(|outcome| !outcome.is_kept()).count();
    let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
    let (low, high) = wilson_95(count(lost), count(outcomes.len()));
    let _ = writeln!(
        text,
        "{lost} of {} lost; probability {:.1} to {:.1} % (95 %, Wilson)",
        outcomes.len(),
        100.0 * low,
        100.0 * high
    );
    text
}

/// The table for programs: a row for each seed, a column for each measure.
pub(super) fn table(outcomes: &[Outcome]) -> Table {
    let mut columns = columns![seed: Integer, lost: Integer, lost_at_s: Number, end_s: Number];
    let metrics = outcomes.first().map_or(&[][..], |outcome| &outcome.metrics);
    columns.extend(metrics.iter().map(|metric| Column::with_unit(&metric.name, metric.unit)));
    let mut table = Table::new("seeds", columns);
    for Outcome { seed, loss, end_s, metrics, .. } in outcomes {
        let mut row = cells![*seed, loss.is_some(), loss.map(|loss| loss.at_s), *end_s];
        row.extend(metrics.iter().map(|metric| metric.value.into()));
        table.rows.push(row);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_are_one_number_or_two_with_both_ends_included() {
        assert_eq!("7".parse(), Ok(Seeds::One(7)));
        assert_eq!("1..200".parse(), Ok(Seeds::Range { from: 1, to: 200 }));
        assert_eq!("3..3".parse(), Ok(Seeds::Range { from: 3, to: 3 }));
        for (text, words) in [
            ("", "not a whole number from 0 to 18446744073709551615"),
            ("-1", "-1 is not a whole number"),
            ("5..", "not a whole number"),
            ("1..x", "x is not a whole number"),
            ("9..2", "9 is above 2"),
            ("0..18446744073709551615", "more than 100000 seeds"),
            ("1..100001", "more than 100000"),
            ("9223372036854775807..9223372036854775808", "is above 9223372036854775807"),
        ] {
            let error = text.parse::<Seeds>().unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
        assert!("1..100000".parse::<Seeds>().is_ok());
    }
}
