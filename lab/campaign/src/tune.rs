//! `sitl campaign tune`: the gains of every law by one procedure, on flights of their own.
//!
//! Each law names the same number of parameters. Each may be between a quarter and four times its value in the specification, in
//! equal steps of its logarithm and within the range of the parameter table. Differential evolution, with the same number of
//! evaluations for each law, minimises the mean cost of the flights:
//!
//! ```text
//! kept:  j = roll_rmse / 5 deg + altitude_rmse / 20 m + airspeed_rmse / 10 m/s + rate / 20 deg/s,  at most 10
//! lost:  j = 10 + 10 (1 - t_lost / T)
//! ```
//!
//! where `rate` is the travel of the commands of all surfaces and nozzle angles per second. Then the gains with the least cost and those of
//! the specification fly a second set, drawn with another seed, which the search has not seen.

use host_io::{print_line, print_text};
use std::fmt::Write as _;
use std::path::Path;

use autopilot::parameters;
use host_io::file::{self, TEXT_MAX};
use host_io::folder::OutFolder;
use host_io::problem::{At as _, Problem, problem};
use lab_judges::flown;
use lab_judges::outcome::Outcome;
use lab_report::runner::Progress;
use lab_tables::{Cell, table};
use metaheuristics_nature::{Bounded, De, ObjFunc, Solver};
use rand_chacha::rand_core::Rng;
use rayon::prelude::*;

use crate::draw;
use crate::plan::Plan;
use crate::spec::{SpecFile, file_name};
use crate::store::{PROGRAM, write_new};

/// A parameter is at most so many times its value in the specification, and at least that over this.
const FACTOR: f64 = 4.0;
/// Individuals and generations of the search.
const POPULATION: usize = 8;
const GENERATIONS: u64 = 5;
/// Evaluations of each law: the gains of the specification, the first individuals, and the generations.
const EVALUATIONS: usize = 1 + POPULATION * (1 + GENERATIONS as usize);
/// What counts as one in the cost: roll, rad; altitude, m; airspeed, m/s; rate of the commands, rad/s.
const ROLL_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
const ALTITUDE_M: f64 = 20.0;
const AIRSPEED_M_S: f64 = 10.0;
const RATE_RAD_S: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Largest cost of a flight that is kept, and the least of one that is lost.
const KEPT_MAX: f64 = 10.0;
/// Cost of gains that the autopilot refuses.
const REFUSED: f64 = 1.0e3;
/// Digits of a tuned value.
const DIGITS: usize = 4;
/// How the table that is printed begins.
const SHOWN: &str = "| law | cost of the searched flights | cost of others |\n|---|---|---|\n";
/// Numbers of a law in the table.
const ROW: usize = 11;
/// How the file of gains of a law begins.
const MARK: &str = "# Written by `sitl campaign tune`; do not edit.";

/// Mean cost of the flights of a set with one set of gains, and how many are lost.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TuneScore {
    cost: f64,
    lost: u32,
}

/// A law with the parameters that are tuned.
struct Tuned<'a> {
    plan: &'a Plan,
    law: usize,
    names: &'a [String],
    /// Values of the specification, and the range of each parameter.
    start: Vec<f64>,
    ranges: Vec<[f64; 2]>,
    bounds: Vec<[f64; 2]>,
    progress: &'a Progress,
}

/// Tunes every law that names parameters, and writes a file of gains for each and a table. A law whose file is there is not
/// tuned again.
pub fn run(file: &SpecFile, folder: &Path) -> Result<(), Problem> {
    let _ = OutFolder::create(folder)?;
    let plan = Plan::new(file.clone())?;
    let others = Plan::new(validation(file))?;
    for note in plan.notes() {
        print_line!("{note}");
    }
    let (laws, fixed): (Vec<usize>, Vec<usize>) =
        (0..plan.laws().len()).partition(|law| !file.spec.law[*law].tune.is_empty());
    for law in &fixed {
        print_line!("{} is not tuned: it names no parameters (tune = [\"…\"])", plan.laws()[*law]);
    }
    if laws.is_empty() {
        return Err(problem!("{}: no law has parameters to tune (tune = [\"…\"])", file.name));
    }
    let mut table = table!("tuning",
        law: Text, flights: Integer, evaluations: Integer, cost_before: Number, cost_after: Number,
        lost_before: Integer, lost_after: Integer, validation_flights: Integer,
        validation_cost_before: Number, validation_cost_after: Number,
        validation_lost_before: Integer, validation_lost_after: Integer, gains: Text);
    let mut shown = String::new();
    for law in laws {
        let name = plan.laws()[law];
        let path = folder.join(format!("{}.toml", file_name(name)));
        let head = format!("{MARK}\n# {name}, {}, program {PROGRAM}\n", plan.fingerprint);
        let text = match file::read_text(&path, TEXT_MAX) {
            Ok(text) => text,
            Err(problem) if problem.is_not_found() => {
                let text = head.clone() + &tune(&plan, &others, law)?;
                // Gains that were found with files that have changed meanwhile are not kept.
                plan.check_inputs()?;
                write_new(&path, text.as_bytes(), MARK.as_bytes())?;
                text
            }
            Err(problem) => return Err(problem).at(path.display()),
        };
        let Some(rest) = text.strip_prefix(&head) else {
            let found = text.lines().nth(1).unwrap_or_default();
            let expected = head.lines().nth(1).unwrap_or_default();
            let path = path.display();
            return Err(problem!(
                "{path}: it has gains of {found:?}, and this search is {expected:?}; take another folder"
            ));
        };
        let row = row_of(rest, &plan.file.spec.law[law].tune).ok_or_else(|| {
            problem!("{}: damaged; remove it and it is made again", path.display())
        })?;
        push_shown(&mut shown, name, row);
        // Costs have a point, counts have none.
        let cell = |text: &str| {
            text.parse().map_or_else(|_| text.parse::<f64>().ok().into(), Cell::Integer)
        };
        let numbers = row.split(',').map(cell);
        let gains = Cell::from(file_name(name));
        table.rows.push([name.into()].into_iter().chain(numbers).chain([gains]).collect());
    }
    print_text!("{SHOWN}{shown}\n");
    table.write(folder)?;
    print_line!("wrote {}", folder.display());
    Ok(())
}

/// Adds the row of a law to the table that is printed.
fn push_shown(shown: &mut String, law: &str, row: &str) {
    let cells: Vec<&str> = row.split(',').collect();
    let at = |place: usize| cells.get(place).copied().unwrap_or_default();
    // Flights, evaluations, and cost and losses before and after: of the flights of the search, then of those it has not seen.
    let half = |flights: usize, first: usize| {
        let [before, after] = [at(first), at(first + 1)];
        let [lost_before, lost_after] = [at(first + 2), at(first + 3)];
        format!("{before} to {after}, {lost_before} to {lost_after} of {} lost", at(flights))
    };
    let _ = writeln!(shown, "| {law} | {} | {} |", half(0, 2), half(6, 7));
}

/// The row of the table in a file of gains that has a finite value of each parameter; `None` of any other text.
fn row_of<'a>(text: &'a str, names: &[String]) -> Option<&'a str> {
    let row = text.lines().find_map(|line| line.strip_prefix("# row: "))?;
    let is_finite = |value: f64| value.is_finite().then_some(());
    row.split(',').try_for_each(|cell| is_finite(cell.parse().ok()?))?;
    let gains: toml::Table = text.parse().ok()?;
    names.iter().try_for_each(|name| is_finite(gains.get(name)?.as_float()?))?;
    (row.split(',').count() == ROW && gains.len() == names.len()).then_some(row)
}

/// The same campaign with another seed: what the search has not seen.
fn validation(file: &SpecFile) -> SpecFile {
    let mut other = file.clone();
    // 53 bits, as every seed of a campaign.
    other.spec.seed = draw::stream(file.spec.seed, "validation", 0).next_u64() >> 11;
    other
}

/// Searches, compares on the other set, and gives the rest of the file of gains.
fn tune(plan: &Plan, others: &Plan, law: usize) -> Result<String, Problem> {
    let flights = plan.flights();
    let total = EVALUATIONS * usize::try_from(flights)?;
    let progress = Progress::new(plan.laws()[law], "flights", total).quiet_at_first();
    let tuned = Tuned::new(plan, law, &progress)?;
    let before = score(plan, law, &[], &progress)?;
    let seed = draw::stream(plan.file.spec.seed, "tune", law as u64).next_u64();
    let names = tuned.names;
    let solved = Solver::build(De::default(), tuned)
        .seed(seed)
        .pop_num(POPULATION)
        .task(|context| context.r#gen == GENERATIONS)
        .solve();
    progress.finish();
    let (best, best_cost) = solved.as_best();
    // The search may find nothing better than what it began with.
    let is_better = *best_cost < before.cost;
    let values = if is_better { solved.func().values(best) } else { solved.func().start.clone() };
    let gains: Vec<(&str, f64)> = names.iter().map(String::as_str).zip(values).collect();
    let quiet =
        Progress::new(plan.laws()[law], "flights", 3 * total / EVALUATIONS).quiet_at_first();
    let after = score(plan, law, &gains, &quiet)?;
    let held_out = [score(others, law, &[], &quiet)?, score(others, law, &gains, &quiet)?];
    quiet.finish();
    let row = format!(
        "{flights},{EVALUATIONS},{:.4},{:.4},{},{},{},{:.4},{:.4},{},{}",
        before.cost,
        after.cost,
        before.lost,
        after.lost,
        others.flights(),
        held_out[0].cost,
        held_out[1].cost,
        held_out[0].lost,
        held_out[1].lost
    );
    let mut text = format!("# row: {row}\n\n");
    for (name, value) in gains {
        let _ = writeln!(text, "{name} = {value:?}");
    }
    Ok(text)
}

/// Flies every flight of a set with a law and these parameters.
fn score(
    plan: &Plan,
    law: usize,
    gains: &[(&str, f64)],
    progress: &Progress,
) -> Result<TuneScore, Problem> {
    let laws = plan.laws().len() as u64;
    let one = |flight: u64| -> Result<(f64, bool), Problem> {
        let run = plan.run(flight * laws + law as u64)?;
        let mut setup = plan.setup(&run)?;
        let set = setup.parameters.set_all(gains.iter().copied());
        set.at(format_args!("law {}", plan.laws()[law]))?;
        let outcome = flown::outcome(&setup, &[])?;
        progress.one_done();
        Ok((cost(plan, run.airframe, &outcome), !outcome.is_kept()))
    };
    // The sum is taken in the order of the flights, so it does not depend on the threads.
    let flown: Vec<(f64, bool)> =
        (0..plan.flights()).into_par_iter().map(one).collect::<Result<_, _>>()?;
    let cost = flown.iter().map(|(cost, _)| cost).sum::<f64>() / flown.len() as f64;
    let lost = flown.iter().filter(|(_, is_lost)| *is_lost).count();
    Ok(TuneScore { cost, lost: u32::try_from(lost).unwrap_or(u32::MAX) })
}

/// Cost of a flight.
fn cost(plan: &Plan, airframe: usize, outcome: &Outcome) -> f64 {
    let duration_s = plan.file.spec.duration_s;
    if let Some(loss) = outcome.loss {
        return KEPT_MAX + KEPT_MAX * (1.0 - loss.at_s / duration_s).clamp(0.0, 1.0);
    }
    let list = &plan.aircraft[airframe].airframe.effectors;
    let angles = list.all().filter(|effector| list.is_angle(*effector));
    // A measure that a flight does not have counts as the worst.
    let of = |name: &str| outcome.metric(name).unwrap_or(f64::INFINITY);
    let travel_rad: f64 =
        angles.map(|effector| of(&format!("travel_{}", list.key(effector)))).sum();
    let sum = of("roll_rmse") / ROLL_RAD
        + of("altitude_rmse") / ALTITUDE_M
        + of("airspeed_rmse") / AIRSPEED_M_S
        + travel_rad / duration_s / RATE_RAD_S;
    sum.min(KEPT_MAX)
}

impl<'a> Tuned<'a> {
    fn new(plan: &'a Plan, law: usize, progress: &'a Progress) -> Result<Self, Problem> {
        let names = &plan.file.spec.law[law].tune;
        let parameters = plan.setup(&plan.run(law as u64)?)?.parameters;
        let (mut start, mut ranges) = (Vec::new(), Vec::new());
        for name in names {
            let row = parameters::table().iter().find(|row| row.name == name);
            let value = row.map_or(0.0, |row| row.value(&parameters));
            let Some(row) = row.filter(|row| row.kind == parameters::Kind::Real && value != 0.0)
            // Zero stays zero under every factor.
            else {
                return Err(problem!(
                    "law {}: tune: {name}: expected a parameter that is no choice and no whole number, and whose value is not zero",
                    plan.laws()[law]
                ));
            };
            start.push(value);
            ranges.push([row.min, row.max]);
        }
        let bounds = vec![[-1.0, 1.0]; names.len()];
        Ok(Self { plan, law, names, start, ranges, bounds, progress })
    }

    /// Parameters at a point of the search, to a few digits.
    fn values(&self, at: &[f64]) -> Vec<f64> {
        let of = |((exponent, start), [min, max]): ((&f64, &f64), &[f64; 2])| {
            let value = (start * libm::pow(FACTOR, *exponent)).clamp(*min, *max);
            // What flies is what the file of gains will say.
            format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
        };
        at.iter().zip(&self.start).zip(&self.ranges).map(of).collect()
    }
}

impl Bounded for Tuned<'_> {
    fn bound(&self) -> &[[f64; 2]] {
        &self.bounds
    }
}

impl ObjFunc for Tuned<'_> {
    type Ys = f64;

    fn fitness(&self, at: &[f64]) -> f64 {
        let values = self.values(at);
        let gains: Vec<(&str, f64)> = self.names.iter().map(String::as_str).zip(values).collect();
        score(self.plan, self.law, &gains, self.progress).map_or(REFUSED, |score| score.cost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_printed_with_both_of_its_sides() {
        let mut shown = String::new();
        push_shown(&mut shown, "PID", "20,49,4.2340,4.1075,2,1,20,5.0508,4.8966,3,2");
        let before_and_after =
            "| PID | 4.2340 to 4.1075, 2 to 1 of 20 lost | 5.0508 to 4.8966, 3 to 2 of 20 lost |\n";
        assert_eq!(shown, before_and_after);
    }
}
