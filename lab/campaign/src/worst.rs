//! `sitl campaign worst`: the smallest fault, the earliest time or the weakest gust that a law does not survive.
//!
//! Over one variable the search goes outwards from its mildest value, in steps and then by halving. Over all drawn variables
//! together it is differential evolution, which minimises how unlikely the draw is that the law does not survive.

use host_io::{print_line, print_text};
use std::path::Path;

use host_io::folder::OutFolder;
use host_io::problem::{Problem, problem};
use lab_judges::outcome::Outcome;
use lab_report::runner;
use lab_tables::{Cell, Table, cells, columns};
use metaheuristics_nature::{Bounded, De, ObjFunc, Solver};
use rand_chacha::rand_core::Rng;

use crate::draw;
use crate::plan::{Plan, Run, Value};
use crate::spec::Variable;
use crate::store::write_new;
use crate::table::of_variable;
use host_io::console::is_shown;

/// Steps from the mildest value to an end of the range.
const STEPS: u32 = 16;
/// Halvings between the last value that was survived and the first that was not.
const HALVINGS: u32 = 8;
/// Individuals and generations of the evolution.
const POPULATION: usize = 24;
const GENERATIONS: u64 = 20;
/// The evolution looks at draws within so many standard deviations of the medians.
const FARTHEST: f64 = 3.0;
/// How every scenario begins.
const MARK: &str = "# Written by `sitl campaign worst`; do not edit.";

/// What is searched for one law in one combination of the other listed values.
#[derive(Debug, Clone)]
struct WorstCase {
    /// Values as the specification has them, drawn ones at their medians.
    run: Run,
    /// End of the range that is searched; `None` in the search over all drawn variables.
    towards: Option<f64>,
}

/// What the search of a case found.
#[derive(Debug)]
struct Found {
    /// The loss, with its run; `None` if everything was survived.
    loss: Option<(Run, Outcome)>,
    /// The value farthest outwards up to which everything was survived, in the unit of the variable; `None` if not even the
    /// mildest one was. In the search over all drawn variables the distance of the loss, standard deviations.
    kept_to: Option<f64>,
}

/// Searches and writes the table and, for each case with a loss, the scenario.
pub fn run(
    plan: &Plan,
    over: Option<&str>,
    from: Option<f64>,
    folder: &Path,
) -> Result<(), Problem> {
    let _ = OutFolder::create(folder)?;
    let place = over.map(|key| one_variable(plan, key)).transpose()?;
    let cases = match place {
        Some(place) => cases_over(plan, place, from)?,
        None if plan.variables().iter().any(Variable::is_drawn) => cases(plan, None)?,
        None => {
            return Err(problem!(
                "no variable of the campaign is drawn: name a listed one by --over KEY"
            ));
        }
    };
    let search = |case: &WorstCase| match (place, case.towards) {
        (Some(place), Some(end)) => outwards(plan, case, place, mildest(plan, place, from), end),
        _ => evolve(plan, case),
    };
    let found = runner::map_quietly("worst", &cases, search);
    let variables = plan.variables().iter().map(|variable| of_variable(plan, variable)).collect();
    let before = columns![airframe: Text, law: Text, towards: Number];
    let after =
        columns![lost_at_s: Number, kept_to: Number, distance_deviations: Number, scenario: Text];
    let mut table = Table::new("worst", [before, variables, after].concat());
    for (number, (case, found)) in cases.iter().zip(found).enumerate() {
        let found = found?;
        let scenario = found.loss.as_ref().map(|_| format!("worst-{number:03}.toml"));
        if let (Some((run, outcome)), Some(name)) = (&found.loss, &scenario) {
            let path = folder.join(name);
            let text = scenario_text(plan, run, outcome, &path)?;
            write_new(&path, text.as_bytes(), MARK.as_bytes())?;
        }
        table.rows.push(row(plan, (case, place), &found, scenario));
    }
    print_text!("{}", table.csv());
    table.write(folder)?;
    print_line!("wrote {}", folder.display());
    Ok(())
}

/// The place of a variable with numbers.
fn one_variable(plan: &Plan, key: &str) -> Result<usize, Problem> {
    let place = plan.variables().iter().position(|variable| variable.key == key);
    let known: Vec<&str> = plan.variables().iter().map(|variable| variable.key.as_str()).collect();
    let refuse =
        |why: &str| Err(problem!("--over {key}: {why}; the variables are {}", known.join(", ")));
    match place {
        None => refuse("the campaign has no such variable"),
        Some(place) if plan.variables()[place].range().is_none() => {
            refuse("it has no range of numbers")
        }
        Some(place) => Ok(place),
    }
}

/// The value that the search begins with: the one nearest to zero, if nothing else is asked for.
fn mildest(plan: &Plan, place: usize, from: Option<f64>) -> f64 {
    let [low, high] = plan.variables()[place].range().unwrap_or_default();
    from.unwrap_or(0.0_f64.clamp(low, high))
}

/// A case for each law, combination and end of the range.
fn cases_over(plan: &Plan, place: usize, from: Option<f64>) -> Result<Vec<WorstCase>, Problem> {
    let [low, high] = plan.variables()[place].range().unwrap_or_default();
    let begin = mildest(plan, place, from);
    if !(low..=high).contains(&begin) {
        return Err(problem!("--from {begin}: expected {low} to {high}"));
    }
    let ends = [low, high].into_iter().filter(|end| (end - begin).abs() > 0.0);
    let all = ends.map(|end| {
        let mut all = cases(plan, Some(place))?;
        all.iter_mut().for_each(|case| case.towards = Some(end));
        Ok::<_, Problem>(all)
    });
    Ok(all.collect::<Result<Vec<_>, _>>()?.concat())
}

/// A case for each law and combination of listed values, without those of `place`.
fn cases(plan: &Plan, place: Option<usize>) -> Result<Vec<WorstCase>, Problem> {
    let samples = u64::from(plan.file.spec.samples);
    let laws = plan.laws().len() as u64;
    let mut cases: Vec<WorstCase> = Vec::new();
    // Samples differ in what is drawn, and that is at its median here.
    for flight in (0..plan.flights()).step_by(usize::try_from(samples)?) {
        for law in 0..laws {
            let mut run = plan.drawn(flight * laws + law)?;
            for (number, (value, variable)) in
                run.values.iter_mut().zip(plan.variables()).enumerate()
            {
                if variable.is_drawn() {
                    *value = Value::Number(variable.quantile(0.5));
                }
                // The same value everywhere, so that cases that differ in nothing else are one.
                if Some(number) == place {
                    *value = Value::Number(0.0);
                }
            }
            let is_same = |other: &WorstCase| {
                let Run { airframe, law, values, .. } = &other.run;
                (*airframe, *law) == (run.airframe, run.law) && *values == run.values
            };
            if !cases.iter().any(is_same) {
                cases.push(WorstCase { run, towards: None });
            }
        }
    }
    Ok(cases)
}

/// Flies the aircraft with these values.
fn flown(plan: &Plan, case: &Run, values: Vec<Value>) -> Result<(Run, Outcome), Problem> {
    let run = plan.translated(Run { values, ..case.clone() })?;
    let outcome = plan.fly(&run)?;
    Ok((run, outcome))
}

/// Steps outwards to the first value that is not survived, and halves the last step.
fn outwards(
    plan: &Plan,
    case: &WorstCase,
    place: usize,
    begin: f64,
    end: f64,
) -> Result<Found, Problem> {
    let at = |value: f64| {
        let mut values = case.run.values.clone();
        values[place] = Value::Number(value);
        flown(plan, &case.run, values)
    };
    let mut kept_to = None;
    for step in 0..=STEPS {
        let part = f64::from(step) / f64::from(STEPS);
        // Written so that both ends are exact.
        let mut next = begin * (1.0 - part) + end * part;
        let (mut run, mut outcome) = at(next)?;
        if outcome.is_kept() {
            kept_to = Some(next);
            continue;
        }
        if let Some(kept) = &mut kept_to {
            for _ in 0..HALVINGS {
                let middle = 0.5 * (*kept + next);
                match at(middle)? {
                    (_, outcome) if outcome.is_kept() => *kept = middle,
                    lost => ((run, outcome), next) = (lost, middle),
                }
            }
        }
        return Ok(Found { loss: Some((run, outcome)), kept_to });
    }
    Ok(Found { loss: None, kept_to })
}

/// The draw that the evolution minimises: its distance from the medians if the law does not survive it, and otherwise more the
/// farther it is from a loss.
struct Likelihood<'a> {
    plan: &'a Plan,
    case: &'a Run,
    bounds: Vec<[f64; 2]>,
}

impl Likelihood<'_> {
    /// Values of a draw, each variable so many standard deviations of a normal distribution from its median.
    fn values(&self, draw: &[f64]) -> Vec<Value> {
        let mut draw = draw.iter();
        let mut values = self.case.values.clone();
        for (value, variable) in values.iter_mut().zip(self.plan.variables()) {
            if variable.is_drawn()
                && let Some(deviations) = draw.next()
            {
                let probability = 0.5 * libm::erfc(-deviations / 2.0_f64.sqrt());
                *value = Value::Number(variable.quantile(probability));
            }
        }
        values
    }
}

fn distance(draw: &[f64]) -> f64 {
    draw.iter().map(|deviations| deviations * deviations).sum::<f64>().sqrt()
}

impl Bounded for Likelihood<'_> {
    fn bound(&self) -> &[[f64; 2]] {
        &self.bounds
    }
}

impl ObjFunc for Likelihood<'_> {
    type Ys = f64;

    fn fitness(&self, draw: &[f64]) -> f64 {
        // Beyond every distance: what is survived comes after what is not.
        let beyond = FARTHEST * (self.bounds.len() as f64).sqrt() + 1.0;
        match flown(self.plan, self.case, self.values(draw)) {
            Ok((_, outcome)) if !outcome.is_kept() => distance(draw),
            Ok((_, outcome)) => {
                let limits = self.plan.aircraft[self.case.airframe].airframe.limits;
                let part = |name: &str, limit: f64| outcome.metric(name).unwrap_or(0.0) / limit;
                let near = part("peak_roll_error", limits.roll_rad)
                    .max(part("peak_sideslip", limits.beta_rad))
                    .max(part("peak_angle_of_attack", limits.alpha_rad));
                // At most 10 beyond, which is less than a draw that cannot be flown gets.
                beyond + 1.0 / (0.1 + near)
            }
            // A draw that cannot be flown is no answer.
            Err(_) => 2.0 * beyond + 10.0,
        }
    }
}

fn evolve(plan: &Plan, case: &WorstCase) -> Result<Found, Problem> {
    let drawn = plan.variables().iter().filter(|variable| variable.is_drawn()).count();
    let likelihood =
        Likelihood { plan, case: &case.run, bounds: vec![[-FARTHEST, FARTHEST]; drawn] };
    let seed = draw::stream(plan.file.spec.seed, "worst", case.run.number).next_u64();
    let solved = Solver::build(De::default(), likelihood)
        .seed(seed)
        .pop_num(POPULATION)
        .task(|context| context.r#gen == GENERATIONS)
        .solve();
    let best = solved.as_best_xs();
    let (run, outcome) = flown(plan, &case.run, solved.func().values(best))?;
    let loss = (!outcome.is_kept()).then_some((run, outcome));
    Ok(Found { kept_to: loss.is_some().then(|| distance(best)), loss })
}

fn row(
    plan: &Plan,
    (case, searched): (&WorstCase, Option<usize>),
    Found { loss, kept_to }: &Found,
    scenario: Option<String>,
) -> Vec<Cell> {
    let run = loss.as_ref().map_or(&case.run, |(run, _)| run);
    let mut row = cells![&plan.aircraft[run.airframe].name, plan.laws()[run.law], case.towards];
    for (place, (value, variable)) in run.values.iter().zip(plan.variables()).enumerate() {
        let is_searched =
            searched.map_or_else(|| variable.is_drawn(), |searched| searched == place);
        // Where no loss was found there is no value of what was searched.
        let is_known = loss.is_some() || !is_searched;
        row.push(is_known.then(|| value.cell(of_variable(plan, variable).kind)).into());
    }
    let lost_at_s = loss.as_ref().and_then(|(_, outcome)| Some(outcome.loss?.at_s));
    let (kept_to, distance) = if searched.is_some() { (*kept_to, None) } else { (None, *kept_to) };
    row.extend(cells![lost_at_s, kept_to, distance, scenario]);
    row
}

fn scenario_text(
    plan: &Plan,
    run: &Run,
    outcome: &Outcome,
    path: &Path,
) -> Result<String, Problem> {
    let (table, options) = plan.scenario_of(run)?;
    let command: Vec<String> = std::iter::once(path.display().to_string())
        .chain(options)
        .map(|word| quoted(&word))
        .collect();
    Ok(format!(
        "{MARK}\n# {}, {}: {outcome}\n# sitl fly {}{}\n\n{}",
        one_line(&plan.file.spec.name),
        one_line(plan.laws()[run.law]),
        command.join(" "),
        if plan.knows_fault(run) { " (without the reference that knows the fault)" } else { "" },
        toml::to_string(&table)?
    ))
}

/// A name in a comment: no character of it ends the line.
fn one_line(name: &str) -> String {
    name.chars().map(|c| if is_shown(c) { c } else { '?' }).collect()
}

/// A word of a command as a shell takes it, on one line.
pub(crate) fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    if word.chars().all(is_shown) {
        return format!("'{}'", word.replace('\'', r"'\''"));
    }
    let letter = |c: char| match c {
        '\'' | '\\' => format!("\\{c}"),
        c if is_shown(c) => c.to_string(),
        c => c.to_string().bytes().map(|byte| format!("\\x{byte:02x}")).collect(),
    };
    format!("$'{}'", word.chars().map(letter).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_of_a_command_is_quoted_where_a_shell_would_change_it() {
        for (word, expected) in [
            ("worst/worst-000.toml", "worst/worst-000.toml"),
            ("my folder/a.toml", "'my folder/a.toml'"),
            ("it's $(x)", r"'it'\''s $(x)'"),
            ("a\n'b\\", r"$'a\x0a\'b\\'"),
            ("", "''"),
        ] {
            assert_eq!(quoted(word), expected);
        }
    }

    #[test]
    fn a_name_in_a_comment_cannot_begin_a_line() {
        assert_eq!(one_line("PID\n# sitl fly other\u{85}\u{2028}"), "PID?# sitl fly other??");
    }
}
