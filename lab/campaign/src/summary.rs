//! The table `summary`: for each aircraft and law how many flights were lost, with intervals, and the medians of the measures;
//! against the first law, on the same flights.

use std::fmt::Write as _;
use std::ops::Range;

use lab_judges::metrics::wilson_95;
use lab_tables::{Cell, Column, Table, cells, columns};
use rand_chacha::rand_core::Rng;

use crate::draw;
use crate::plan::Plan;
use crate::results::{Results, median};
use crate::store::RunEnd;

/// Resamples of a paired bootstrap.
pub const RESAMPLES: usize = 1_000;

/// Flights of one aircraft with one law.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Place of the aircraft.
    pub airframe: usize,
    /// Place of the law.
    pub law: usize,
    /// Flights that could be flown.
    pub flown: u32,
    /// Of these, lost ones.
    pub lost: u32,
    /// Flights that could not be flown.
    pub failed: u32,
    /// Wilson's 95 % interval of the fraction lost.
    pub interval: (f64, f64),
    /// Fraction lost minus that of the first law, with its interval.
    pub difference: Option<LossDifference>,
    /// Median of each named measure over the flights that were kept.
    pub medians: Vec<Option<f64>>,
    /// Mean of each named measure minus that of the first law, over the flights that both kept.
    pub differences: Vec<Option<LossDifference>>,
}

impl Group {
    /// Lost flights among those that could be flown; NaN if there are none.
    pub fn fraction_lost(&self) -> f64 {
        f64::from(self.lost) / f64::from(self.flown)
    }
}

/// A mean difference on the same flights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossDifference {
    pub mean: f64,
    /// 95 % interval by paired bootstrap.
    pub interval: (f64, f64),
}

/// All groups, aircraft by aircraft.
pub fn groups(plan: &Plan, results: &Results) -> Vec<Group> {
    let mut groups = Vec::new();
    for airframe in 0..plan.aircraft.len() {
        let flights = plan.flights_of(airframe);
        for law in 0..plan.laws().len() {
            groups.push(group(plan, results, airframe, law, flights.clone()));
        }
    }
    groups
}

fn group(
    plan: &Plan,
    results: &Results,
    airframe: usize,
    law: usize,
    flights: Range<usize>,
) -> Group {
    let of = |end: RunEnd| {
        let count = flights.clone().filter(|flight| results.end(*flight, law) == end).count();
        u32::try_from(count).unwrap_or(u32::MAX)
    };
    let (kept, lost, failed) = (of(RunEnd::Kept), of(RunEnd::Lost), of(RunEnd::Failed));
    let flown = kept + lost;
    let both = |end: fn(RunEnd) -> bool| {
        flights.clone().filter(move |flight| {
            // The first law is what the others are compared with.
            law > 0 && end(results.end(*flight, law)) && end(results.end(*flight, 0))
        })
    };
    let loss = |flight: usize, law| f64::from(u8::from(results.end(flight, law) == RunEnd::Lost));
    let names = &plan.file.spec.measures;
    let is_kept = |end: RunEnd| end == RunEnd::Kept;
    let seed = plan.file.spec.seed;
    let compare = |name: &str, differences: Vec<f64>| {
        let name = format!("bootstrap {airframe} {law} {name}");
        LossDifference::of(&differences, seed, &name)
    };
    let difference = compare(
        "lost",
        both(|end| end != RunEnd::Failed).map(|f| loss(f, law) - loss(f, 0)).collect(),
    );
    let medians = (0..names.len()).map(|place| {
        let kept = flights.clone().filter(|flight| is_kept(results.end(*flight, law)));
        median(kept.map(|flight| results.measure(place, flight, law)))
    });
    let differences = (0..names.len()).map(|place| {
        let value = |flight, law| results.measure(place, flight, law);
        let pairs = both(is_kept).map(|flight| value(flight, law) - value(flight, 0));
        compare(&names[place], pairs.filter(|difference| difference.is_finite()).collect())
    });
    Group {
        airframe,
        law,
        flown,
        lost,
        failed,
        interval: wilson_95(lost, flown),
        difference,
        medians: medians.collect(),
        differences: differences.collect(),
    }
}

impl LossDifference {
    /// The mean of differences, with the 2.5 and the 97.5 percentile of the means of resamples; `None` of nothing.
    fn of(differences: &[f64], seed: u64, name: &str) -> Option<Self> {
        let count = u32::try_from(differences.len()).ok().filter(|count| *count > 0)?;
        let mean = |sum: f64| sum / f64::from(count);
        let resample = |index: usize| {
            let mut generator = draw::stream(seed, name, index as u64);
            let sum = (0..count).map(|_| {
                // The upper bits of a product: uniform below the count but for 1 part in 2^32 / count.
                let place = (u64::from(generator.next_u32()) * u64::from(count)) >> 32;
                differences[usize::try_from(place).unwrap_or(0)]
            });
            mean(sum.sum())
        };
        let mut means: Vec<f64> = (0..RESAMPLES).map(resample).collect();
        means.sort_by(f64::total_cmp);
        // At either end a fortieth, 2.5 %, is left out.
        let interval = (means[RESAMPLES / 40], means[RESAMPLES - 1 - RESAMPLES / 40]);
        Some(Self { mean: mean(differences.iter().sum()), interval })
    }
}

pub fn table(plan: &Plan, groups: &[Group]) -> Table {
    let mut columns = columns![
        airframe: Text, law: Text, flights: Integer, kept: Integer, lost: Integer, failed: Integer,
        lost_percent: Number, lost_low_percent: Number, lost_high_percent: Number,
        lost_difference_percent: Number, lost_difference_low_percent: Number,
        lost_difference_high_percent: Number
    ];
    for name in &plan.file.spec.measures {
        let of = ["median_", "difference_", "difference_low_", "difference_high_"];
        let column = |of| Column::with_unit(format!("{of}{name}"), plan.unit_of(name));
        columns.extend(of.map(column));
    }
    let mut table = Table::new("summary", columns);
    for group in groups {
        let Group { flown, lost, failed, interval: (low, high), .. } = group;
        let (name, law) = (&plan.aircraft[group.airframe].name, plan.laws()[group.law]);
        let mut row = cells![name, law, flown + failed, flown - lost, *lost, *failed];
        let parts = [group.fraction_lost(), *low, *high];
        row.extend(parts.map(|part| (*flown > 0).then_some(100.0 * part).into()));
        row.extend(cells_of(group.difference, 100.0));
        for (median, difference) in group.medians.iter().zip(&group.differences) {
            row.push((*median).into());
            row.extend(cells_of(*difference, 1.0));
        }
        table.rows.push(row);
    }
    table
}

fn cells_of(difference: Option<LossDifference>, scale: f64) -> [Cell; 3] {
    let values = difference.map(|LossDifference { mean, interval: (low, high) }| [mean, low, high]);
    [0, 1, 2].map(|place| values.map(|values| scale * values[place]).into())
}

/// A table for the terminal.
pub fn shown(plan: &Plan, groups: &[Group]) -> String {
    let laws = plan.laws();
    let width = laws.iter().map(|law| law.chars().count()).max().unwrap_or(0).max(3);
    let mut text = String::new();
    for (place, aircraft) in plan.aircraft.iter().enumerate() {
        let _ = writeln!(text, "{}, {} flights:", aircraft.name, plan.flights_of(place).len());
        for group in groups.iter().filter(|group| group.airframe == place) {
            let Group { law, flown, lost, failed, interval: (low, high), .. } = group;
            let _ = write!(text, "  {:width$}  {lost} of {flown} lost", laws[*law]);
            if *flown > 0 {
                let [percent, low, high] = [group.fraction_lost(), *low, *high].map(|p| 100.0 * p);
                let _ = write!(text, ": {percent:.1} %, {low:.1} to {high:.1} % (95 %, Wilson)");
            }
            if let Some(LossDifference { mean, interval: (low, high) }) = group.difference {
                let _ = write!(
                    text,
                    "; {:+.1} points against {}, {:+.1} to {:+.1}",
                    100.0 * mean,
                    laws[0],
                    100.0 * low,
                    100.0 * high
                );
            }
            if *failed > 0 {
                let _ = write!(text, "; {failed} could not be flown");
            }
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bootstrap_interval_is_that_of_the_mean() {
        // 400 draws of mean 0.25 and deviation 0.433: the mean is known to 0.0217, its interval is 1.96 times as wide.
        let differences: Vec<f64> = (0..400).map(|k| f64::from(u8::from(k % 4 == 0))).collect();
        let LossDifference { mean, interval: (low, high) } =
            LossDifference::of(&differences, 1, "test").expect("there are some");
        assert_eq!(mean, 0.25);
        assert!((mean - low - 0.0424).abs() < 0.006 && (high - mean - 0.0424).abs() < 0.006);
        assert_eq!(LossDifference::of(&[], 1, "test"), None);
    }

    #[test]
    fn a_median_leaves_out_what_is_missing() {
        assert_eq!(median([3.0, f64::NAN, 1.0].into_iter()), Some(2.0));
        assert_eq!(median([3.0, 1.0, 9.0].into_iter()), Some(3.0));
        assert_eq!(median(std::iter::empty()), None);
    }
}
