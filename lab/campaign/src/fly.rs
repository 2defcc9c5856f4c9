//! Flies the runs of a campaign on all cores, part by part.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::num::NonZero;
use std::str::FromStr;

use autopilot::config;
use host_io::console;
use host_io::problem::Problem;
use lab_engine::builder::preset_note;
use lab_judges::closed_loop::FlightSetup;
use lab_report::runner::{Progress, check_interrupt};
use rayon::prelude::*;

use crate::plan::Plan;
use crate::store::{Row, RunStore};

/// One of several processes that share a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which one, from 1.
    pub number: u64,
    pub of: NonZero<u64>,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(number, of)| {
            Some((number.parse::<u64>().ok()?, of.parse::<NonZero<u64>>().ok()?))
        });
        match numbers {
            Some((number, of)) if (1..=of.get()).contains(&number) => Ok(Self { number, of }),
            _ => Err(format!("{text}: expected K/N with K from 1 to N, such as 2/8")),
        }
    }
}

impl Shard {
    fn has(self, part: u64) -> bool {
        part % self.of.get() == self.number - 1
    }
}

/// Presets of the estimator that were set against the fitted sensors, and values of the jet that another aircraft has: of the first
/// flight of each aircraft with each law.
fn setup_notes(plan: &Plan) -> BTreeSet<String> {
    let laws = plan.laws().len();
    let first = (0..plan.aircraft.len()).map(|airframe| plan.flights_of(airframe).start * laws);
    let runs = first.flat_map(|first| first..first + laws);
    // A run that cannot be flown has its own message.
    let setups = runs.filter_map(|number| plan.setup(&plan.run(number as u64).ok()?).ok());
    let notes = |setup: FlightSetup| {
        let preset = setup.parameters.gains.selection.estimator;
        let preset = preset_note(preset, &setup.plant.sensors);
        preset.into_iter().chain(config::inherited(&setup.model, &setup.parameters))
    };
    setups.flat_map(notes).collect()
}

/// Flies every part that is not there yet, of the whole campaign or of a shard; gives the number of runs flown.
pub fn fly(plan: &Plan, store: &RunStore, shard: Option<Shard>) -> Result<u64, Problem> {
    let wanted = (0..store.count()).filter(|part| shard.is_none_or(|shard| shard.has(*part)));
    let mut missing = Vec::new();
    let mut all = 0;
    for part in wanted {
        let range = store.range(part);
        all += range.end - range.start;
        if !store.has(part)? {
            missing.push(part);
        }
    }
    let runs: u64 = missing.iter().map(|part| store.range(*part)).map(|r| r.end - r.start).sum();
    if runs < all {
        // Nobody may read any more.
        let _ = writeln!(console::err(), "{} of {all} runs are there already", all - runs);
    }
    for note in setup_notes(plan).into_iter().chain(plan.notes()) {
        let _ = writeln!(console::err(), "{note}");
    }
    let total = usize::try_from(runs).unwrap_or(usize::MAX);
    let progress = Progress::new(&plan.file.spec.name, "runs", total).quiet_at_first();
    // The parts begin in their order, so that what is there after a kill is what came first.
    let next = std::sync::atomic::AtomicUsize::new(0);
    let one = |_| -> Result<(), Problem> {
        let place = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let Some(part) = missing.get(place) else { return Ok(()) };
        let fly = |number| {
            check_interrupt();
            let row = run(plan, number);
            progress.one_done();
            row
        };
        let rows: Vec<Row> = store.range(*part).map(fly).collect();
        // A part must not be of files that have changed while it was flown.
        plan.check_inputs()?;
        store.write(*part, &rows)
    };
    // One part for each task: a thread that took several would leave the others idle at the end.
    (0..missing.len()).into_par_iter().with_max_len(1).try_for_each(one)?;
    progress.finish();
    Ok(runs)
}

/// Flies a run; what keeps it from being flown stands in its row.
pub fn run(plan: &Plan, number: u64) -> Row {
    let flown = plan.run(number).and_then(|run| plan.fly(&run));
    match flown {
        Ok(outcome) => Row::of(number, &outcome),
        Err(error) => Row::failed(number, error.to_string()),
    }
}
