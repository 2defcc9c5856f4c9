//! What a campaign needs of its runs for summary and map, without all of their measures.

use std::ops::Range;

use icd::units::DEG_PER_RAD;

use crate::plan::{Aircraft, Plan};
use crate::spec::TableSpec;
use crate::store::{Row, RunEnd};

/// Places of the measures of an aircraft for each column of the scorecard.
fn sources(aircraft: &Aircraft) -> Vec<Vec<usize>> {
    let list = &aircraft.airframe.effectors;
    let is_angle = |name: &str, prefix: &str| {
        name.strip_prefix(prefix).is_some_and(|key| {
            list.all().any(|effector| list.key(effector) == key && list.is_angle(effector))
        })
    };
    let of = |column: &Column| {
        let is_meant = |name: &str| match column.source {
            ColumnSource::Median(measure) | ColumnSource::Mean(measure) => name == measure,
            ColumnSource::Sum(prefix) => is_angle(name, prefix),
            ColumnSource::Largest(prefix) => name.starts_with(prefix),
        };
        let all = aircraft.measures.iter().enumerate();
        all.filter(|(_, (name, _))| is_meant(name)).map(|(place, _)| place).collect()
    };
    SCORECARD.iter().map(of).collect()
}

/// What a column of the scorecard is made of.
#[derive(Debug, Clone, Copy)]
enum ColumnSource {
    /// The median of a measure over the flights that were kept.
    Median(&'static str),
    /// The mean of a measure over all flights.
    Mean(&'static str),
    /// The median of the sum over the effectors with angles.
    Sum(&'static str),
    /// The median of the largest one of all effectors.
    Largest(&'static str),
}

/// A column of the scorecard.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    pub name: &'static str,
    /// Unit of its numbers.
    pub unit: &'static str,
    /// Unit of a measure over the unit of the column.
    factor: f64,
    source: ColumnSource,
}

const fn column(
    name: &'static str,
    unit: &'static str,
    factor: f64,
    source: ColumnSource,
) -> Column {
    Column { name, unit, factor, source }
}

/// What is compared in the report: detection, transient, steady flight, control.
pub const SCORECARD: [Column; 10] = [
    column("detection delay", "s", 1.0, ColumnSource::Median("detection_delay")),
    column("missed faults", "%", 100.0, ColumnSource::Mean("fault_missed")),
    column("false alarms before the fault", "1/h", 1.0, ColumnSource::Mean("false_alarms")),
    column("largest roll error", "deg", DEG_PER_RAD, ColumnSource::Median("peak_roll_error")),
    column("recovery of roll", "s", 1.0, ColumnSource::Median("recovery_time_roll")),
    column("steady roll error", "deg", DEG_PER_RAD, ColumnSource::Median("steady_offset_roll")),
    column("altitude lost", "m", 1.0, ColumnSource::Median("altitude_lost")),
    column("travel", "deg", DEG_PER_RAD, ColumnSource::Sum("travel_")),
    column("reversals", "1/s", 1.0, ColumnSource::Sum("reversals_")),
    column("longest at a limit", "%", 1.0, ColumnSource::Largest("at_limit_")),
];

/// Ends of all runs, the measures that the specification names, and those of the scorecard.
#[derive(Debug)]
pub struct Results {
    laws: usize,
    ends: Vec<RunEnd>,
    /// When each run was lost, s; NaN where it was not.
    lost_at_s: Vec<f64>,
    /// Names of the measures: those of the specification, and then those that only its tables read.
    names: Vec<String>,
    /// One list for each named measure; NaN where a flight has none.
    measures: Vec<Vec<f64>>,
    /// For each aircraft, the place of each named measure among its measures.
    places: Vec<Vec<Option<usize>>>,
    /// One list for each column of the scorecard.
    scores: Vec<Vec<f64>>,
    /// For each aircraft and column the places of its measures.
    sources: Vec<Vec<Vec<usize>>>,
    /// Number of the first run of each aircraft but the first.
    ends_of_aircraft: Vec<u64>,
}

impl Results {
    /// Nothing is there yet.
    pub fn new(plan: &Plan) -> Self {
        let mut names = plan.file.spec.measures.clone();
        for name in plan.file.spec.tables.iter().flat_map(TableSpec::reads) {
            if names.iter().all(|known| known != name) {
                names.push(name.to_owned());
            }
        }
        let named = &names;
        let place = |measures: &[(String, &str)], name: &String| {
            measures.iter().position(|(known, _)| known == name)
        };
        let of = |aircraft: &Aircraft| {
            named.iter().map(|name| place(&aircraft.measures, name)).collect()
        };
        let laws = plan.laws().len();
        let ends_of_aircraft = plan.aircraft.iter().skip(1);
        Self {
            laws,
            ends: Vec::new(),
            lost_at_s: Vec::new(),
            measures: vec![Vec::new(); named.len()],
            scores: vec![Vec::new(); SCORECARD.len()],
            sources: plan.aircraft.iter().map(sources).collect(),
            places: plan.aircraft.iter().map(of).collect(),
            ends_of_aircraft: ends_of_aircraft
                .map(|aircraft| aircraft.first * laws as u64)
                .collect(),
            names,
        }
    }

    /// Takes the next run.
    pub fn add(&mut self, row: &Row) {
        let airframe = self.ends_of_aircraft.partition_point(|end| *end <= row.run);
        self.ends.push(row.end);
        self.lost_at_s.push(row.lost_at_s.unwrap_or(f64::NAN));
        for (list, place) in self.measures.iter_mut().zip(&self.places[airframe]) {
            let value = place.and_then(|place| row.measures.get(place).copied().flatten());
            list.push(value.unwrap_or(f64::NAN));
        }
        for ((list, places), column) in
            self.scores.iter_mut().zip(&self.sources[airframe]).zip(&SCORECARD)
        {
            let values =
                places.iter().filter_map(|place| row.measures.get(*place).copied().flatten());
            let value = match column.source {
                ColumnSource::Largest(_) => values.reduce(f64::max),
                // A median or a mean has one source, which is its own sum.
                _ => values.reduce(|sum, value| sum + value),
            };
            list.push(value.map_or(f64::NAN, |value| value * column.factor));
        }
    }

    /// A column of the scorecard for one law over flights; `None` where no flight has a value.
    pub fn score(&self, place: usize, flights: Range<usize>, law: usize) -> Option<f64> {
        let is_mean = matches!(SCORECARD[place].source, ColumnSource::Mean(_));
        let value = |flight| self.scores[place][flight * self.laws + law];
        let counted = flights.filter(|flight| is_mean || self.end(*flight, law) == RunEnd::Kept);
        let values = counted.map(value).filter(|value| value.is_finite());
        match is_mean {
            false => median(values),
            true => {
                let (sum, count) = values.fold((0.0, 0.0), |(s, n), value| (s + value, n + 1.0));
                (count > 0.0).then_some(sum / count)
            }
        }
    }

    /// How a law ended a flight.
    pub fn end(&self, flight: usize, law: usize) -> RunEnd {
        self.ends[flight * self.laws + law]
    }

    /// A named measure, by its place in the specification, of a law on a flight; NaN where there is none.
    pub fn measure(&self, place: usize, flight: usize, law: usize) -> f64 {
        self.measures[place][flight * self.laws + law]
    }

    /// What a table reads of a run: how it ended, or a measure of a flight that was kept or, with `all`, lost; NaN where there is
    /// none.
    pub(crate) fn value(&self, name: &str, all: bool, run: usize) -> f64 {
        // The first law is the reference.
        let (end, first) = (self.ends[run], self.ends[run - run % self.laws]);
        let is = |holds: bool| f64::from(u8::from(holds));
        match (name, self.names.iter().position(|known| known == name)) {
            ("lost" | "newly_lost" | "newly_kept", _) if end == RunEnd::Failed => f64::NAN,
            ("lost", _) => is(end == RunEnd::Lost),
            ("newly_lost", _) => is(end == RunEnd::Lost && first == RunEnd::Kept),
            ("newly_kept", _) => is(end == RunEnd::Kept && first == RunEnd::Lost),
            ("lost_at_s", _) => self.lost_at_s[run],
            (_, Some(place)) if all || end == RunEnd::Kept => self.measures[place][run],
            _ => f64::NAN,
        }
    }

    pub fn flights(&self) -> usize {
        self.ends.len() / self.laws
    }
}

/// Middle of the values that are numbers; `None` of none.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        even if even % 2 == 0 => Some(0.5 * (values[middle - 1] + values[middle])),
        _ => Some(values[middle]),
    }
}
