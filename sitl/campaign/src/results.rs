//! What a campaign needs of its runs for summary and map, without all of their measures.

use crate::plan::Plan;
use crate::store::{Row, RunEnd};

/// Ends of all runs, and the measures that the specification names.
#[derive(Debug)]
pub struct Results {
    laws: usize,
    ends: Vec<RunEnd>,
    /// One list for each named measure; NaN where a flight has none.
    measures: Vec<Vec<f64>>,
    /// For each aircraft, the place of each named measure among its measures.
    places: Vec<Vec<Option<usize>>>,
    /// Number of the first run of each aircraft but the first.
    ends_of_aircraft: Vec<u64>,
}

impl Results {
    /// Nothing is there yet.
    #[must_use]
    pub fn new(plan: &Plan) -> Self {
        let named = &plan.file.spec.measures;
        let place = |measures: &[(String, &str)], name: &String| {
            measures.iter().position(|(known, _)| known == name)
        };
        let of = |aircraft: &crate::plan::Aircraft| {
            named.iter().map(|name| place(&aircraft.measures, name)).collect()
        };
        let laws = plan.laws().len();
        let ends_of_aircraft = plan.aircraft.iter().skip(1);
        Self {
            laws,
            ends: Vec::new(),
            measures: vec![Vec::new(); named.len()],
            places: plan.aircraft.iter().map(of).collect(),
            ends_of_aircraft: ends_of_aircraft
                .map(|aircraft| aircraft.first_flight() * laws as u64)
                .collect(),
        }
    }

    /// Takes the next run.
    pub fn add(&mut self, row: &Row) {
        let airframe = self.ends_of_aircraft.partition_point(|end| *end <= row.run);
        self.ends.push(row.end);
        for (list, place) in self.measures.iter_mut().zip(&self.places[airframe]) {
            let value = place.and_then(|place| row.measures.get(place).copied().flatten());
            list.push(value.unwrap_or(f64::NAN));
        }
    }

    /// How a law ended a flight.
    #[must_use]
    pub fn end(&self, flight: usize, law: usize) -> RunEnd {
        self.ends[flight * self.laws + law]
    }

    /// A named measure, by its place in the specification, of a law on a flight; NaN where there is none.
    #[must_use]
    pub fn measure(&self, place: usize, flight: usize, law: usize) -> f64 {
        self.measures[place][flight * self.laws + law]
    }

    /// Number of flights.
    #[must_use]
    pub fn flights(&self) -> usize {
        self.ends.len() / self.laws
    }
}
