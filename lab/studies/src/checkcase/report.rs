//! `sitl study compare-checkcases`: flies check cases and writes how far they are from other simulators, as a table and a picture.

use host_io::{print_line, print_text};
use std::fmt::Write as _;
use std::path::PathBuf;

use host_io::folder::OutFolder;
use lab_tables::{Table, cells, table};
use plant_sim::scenario::case::CheckCase;

use super::reference::{Comparison, Deviation, References};
use super::trajectory::Trajectory;
use super::{CheckcaseArgs, Flight, picture};
use host_io::problem::{At as _, Problem, problem};
use lab_report::chart::write_figure;
use lab_report::runner;

/// Options of `sitl study compare-checkcases`.
#[derive(Debug, Clone, clap::Args)]
pub struct CompareArgs {
    /// What is flown: scenarios with the table `checkcase` and a reference
    #[arg(value_name = "SCENARIO", required = true)]
    scenarios: Vec<PathBuf>,
    /// Folder of the reference data, with manifest.json
    #[arg(long, value_name = "DIR")]
    reference: PathBuf,
    /// Integration steps, ms
    #[arg(long, value_name = "MS", default_values_t = [1.0, 10.0], allow_negative_numbers = true)]
    step_ms: Vec<f64>,
    /// Folder for the tables and the picture
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Flies, compares and writes.
pub fn run(args: &CompareArgs) -> Result<(), Problem> {
    let references = References::open(&args.reference)?;
    let folder = OutFolder::create(&args.out)?;
    let mut cases = Vec::new();
    // All are read before the first is flown: a mistake in the last file shall not cost flights.
    for scenario in &args.scenarios {
        for step_ms in &args.step_ms {
            let case = CheckcaseArgs::of(scenario.clone(), Some(*step_ms)).case()?;
            cases.push((scenario.display().to_string(), case));
        }
    }
    let compared = runner::map_quietly("check cases", &cases, |(name, case)| {
        compare(name, case, &references).at(name)
    });
    let comparisons: Vec<Comparison> = compared.into_iter().collect::<Result<_, _>>()?;
    let table = markdown(&comparisons);
    folder.write_markdown("checkcases.md", &table)?;
    quantities(&comparisons).write(folder.path())?;
    write_figure(&folder, &picture::figure(&comparisons))?;
    print_text!("{table}");
    print_line!("wrote {}", args.out.display());
    // After the files, which show how far.
    let far = comparisons.iter().filter(|one| !one.deviations.iter().all(Deviation::passes));
    let far: Vec<String> = far.map(|one| format!("{} at {} ms", one.case, one.step_ms)).collect();
    match far.is_empty() {
        true => Ok(()),
        false => Err(problem!("farther from the reference than allowed: {}", far.join(", "))),
    }
}

/// Flies a case and compares it with its reference.
pub fn compare(
    name: &str,
    case: &CheckCase,
    references: &References,
) -> Result<Comparison, Problem> {
    let Some(reference_name) = &case.reference else {
        return Err(problem!(
            "[checkcase] reference is missing, expected the case's name in the reference data"
        ));
    };
    let reference = references.case(reference_name)?;
    let mut text = String::new();
    Flight::new(name, case)?.fly(&mut |line| {
        text += line;
        text.push('\n');
        Ok(())
    })?;
    Ok(Comparison {
        case: reference_name.clone(),
        title: reference.title().to_owned(),
        step_ms: f64::from(case.setup.step_us) / 1_000.0,
        deviations: reference.deviations(&Trajectory::read(name, &text)?)?,
    })
}

/// The quantity with the largest part of what is allowed, and that part.
fn worst(
    deviations: &[Deviation],
    part: impl Fn(&Deviation) -> Option<f64>,
) -> Option<(&Deviation, f64)> {
    let parts = deviations.iter().filter_map(|one| part(one).map(|part| (one, part)));
    parts.max_by(|a, b| a.1.total_cmp(&b.1))
}

fn markdown(comparisons: &[Comparison]) -> String {
    let mut text = "| case | step, ms | largest error / allowed | from the finest step / allowed |\n|---|---|---|---|\n".to_owned();
    for one in comparisons {
        let shown = |found: Option<(&Deviation, f64)>| match found {
            Some((of, part)) => format!("{part:.2} ({})", of.quantity.name),
            None => "-".to_owned(),
        };
        let core = worst(&one.deviations, |of| Some(of.error / of.tolerance));
        let tight = worst(&one.deviations, |of| of.tight.map(|(error, allowed)| error / allowed));
        let Comparison { case, title, step_ms, .. } = one;
        let _ =
            writeln!(text, "| {case} {title} | {step_ms} | {} | {} |", shown(core), shown(tight));
    }
    text
}

fn quantities(comparisons: &[Comparison]) -> Table {
    let mut table = table!("checkcases",
        case: Text, step_ms: Number, quantity: Text, unit: Text, error: Number, spread: Number,
        tolerance: Number, error_from_finest: Number, tight_tolerance: Number, passes: Integer);
    for one in comparisons {
        for of in &one.deviations {
            let (finest, tight) = of.tight.unzip();
            let passes = of.passes() && of.passes_tight();
            let (name, unit) = (of.quantity.name, of.quantity.unit);
            let mut row = cells![&one.case, one.step_ms, name, unit, of.error, of.spread];
            row.extend(cells![of.tolerance, finest, tight, passes]);
            table.rows.push(row);
        }
    }
    table
}
