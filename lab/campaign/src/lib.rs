//! Campaigns: many flights drawn from one specification, the same to the byte alone, in parts and on many machines.
//!
//! ```text
//! spec ─> plan (run N) ─> fly ─> store (parts) ─> table (runs.parquet) ─> results ─> summary, limit, map, report
//! ```
//!
//! Every run is a function of the specification and its number: seeds and draws come from named streams
//! ([`draw::stream`]), so a run is the same alone and among a million; with `design = "latin_hypercube"` among as many samples.

use host_io::{print_line, print_text};
use std::io::Write as _;
use std::path::PathBuf;

use autopilot::own_law::OwnLaw;
use clap::{Args, Subcommand};
use host_io::console;
use host_io::folder::OutFolder;
use host_io::problem::Problem;
use lab_engine::configuration::AircraftArgs;
use lab_engine::settings::Setting;
use lab_report::chart::{Figure, write_figure, write_figure_as};
use lab_report::page;
use lab_studies::fly::OneFlight;
use plant_sim::io::whole;

use crate::curves::Curves;
use crate::fly::Shard;
use crate::limit::{Jams, PhysicsLimits, Studied};
use crate::plan::Plan;
use crate::report::{REPORT, Sources};
use crate::results::Results;
use crate::spec::{SAMPLES_MAX, SEED_MAX, SpecFile};
use crate::store::RunStore;
use crate::summary::Group;

pub mod compare;
pub mod curves;
pub mod draw;
pub mod fly;
pub mod limit;
pub mod map;
pub mod plan;
pub mod report;
pub mod results;
pub mod spec;
pub mod store;
pub mod suite;
pub mod summary;
pub mod table;
pub mod tables;
pub mod tune;
pub mod worst;

/// What is done with a campaign.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Fly every run that is not there yet, and write tables and map
    Run(RunArgs),
    /// Take the finished runs of other folders, then as `run`
    Merge(MergeArgs),
    /// Fly one run again, with its log and figures
    Replay(CampaignReplayArgs),
    /// Find the smallest fault, earliest time or weakest gust that each law does not survive, and write the scenarios
    Worst(WorstArgs),
    /// Search the gains of each law by one procedure, on flights of their own
    Tune(TuneArgs),
    /// Fly the suite FTC-1 to FTC-12 with every law, and write the table of what each law lost
    Suite(SuiteArgs),
    /// Compare the results of two folders of one specification, run by run
    Compare(CampaignCompareArgs),
}

/// A specification, and what is changed in it.
#[derive(Debug, Args)]
pub struct SpecArgs {
    #[arg(value_name = "SPEC", help = spec::help())]
    spec: String,
    /// Another aircraft in place of those of the specification; settings of every flight.
    #[command(flatten)]
    aircraft: AircraftArgs,
    /// Draws for each combination of listed values, instead of those of the specification
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1, SAMPLES_MAX))]
    samples: Option<u32>,
    /// Seed of all draws and flights, instead of that of the specification
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(0, SEED_MAX))]
    seed: Option<u64>,
    /// Of a listed variable this value alone, such as sensors=tactical; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = Setting::parse)]
    only: Vec<Setting>,
}

impl SpecArgs {
    /// Reads it, with the laws that the program brings.
    fn file(&self, own: &[OwnLaw]) -> Result<SpecFile, Problem> {
        let mut file = SpecFile::read_with(&self.spec, own, &self.aircraft)?;
        let numbers = [("samples", self.samples.map(u64::from)), ("seed", self.seed)];
        for (option, number) in numbers.into_iter().filter_map(|(o, n)| Some((o, n?))) {
            file.note(option, &number);
        }
        for only in &self.only {
            file.spec.keep_only(only)?;
            file.note("only", only);
        }
        file.spec.samples = self.samples.unwrap_or(file.spec.samples);
        file.spec.seed = self.seed.unwrap_or(file.spec.seed);
        Ok(file)
    }
}

/// Options of `sitl campaign run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    #[command(flatten)]
    spec: SpecArgs,
    /// Folder for the results; a campaign that was interrupted goes on in its folder
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Fly only part K of N of the runs and write no tables, so that several machines share a campaign
    #[arg(long, value_name = "K/N", allow_hyphen_values = true)]
    shard: Option<Shard>,
}

/// Options of `sitl campaign merge`.
#[derive(Debug, Args)]
pub struct MergeArgs {
    #[command(flatten)]
    spec: SpecArgs,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Folders of shards
    #[arg(value_name = "FROM", required = true)]
    from: Vec<PathBuf>,
}

/// Options of `sitl campaign replay`.
#[derive(Debug, Args)]
pub struct CampaignReplayArgs {
    #[command(flatten)]
    spec: SpecArgs,
    /// Number of the run
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    run: i128,
    /// Folder for outcome.json, flight.csv, flight.ulg and flight.html
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Options of `sitl campaign worst`.
#[derive(Debug, Args)]
pub struct WorstArgs {
    #[command(flatten)]
    spec: SpecArgs,
    /// Search over this variable alone, outwards from its mildest value; without it over all drawn variables together
    #[arg(long, value_name = "KEY")]
    over: Option<String>,
    /// Mildest value of that variable [default: the one nearest to zero]
    #[arg(long, value_name = "VALUE", requires = "over", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Folder for the table and the scenarios
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Options of `sitl campaign tune`.
#[derive(Debug, Args)]
pub struct TuneArgs {
    #[command(flatten)]
    spec: SpecArgs,
    /// Folder for a file of gains of each law, and the table; what was interrupted goes on with the next law
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Options of `sitl campaign suite`.
#[derive(Debug, Args)]
pub struct SuiteArgs {
    /// Folder for suite.md and a folder of each campaign
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Aircraft and settings.
    #[command(flatten)]
    aircraft: AircraftArgs,
}

/// Options of `sitl campaign compare`.
#[derive(Debug, Args)]
pub struct CampaignCompareArgs {
    /// Folder of a finished campaign
    #[arg(value_name = "A")]
    one: PathBuf,
    /// Folder of another one, flown from the same or a similar specification
    #[arg(value_name = "B")]
    other: PathBuf,
}

/// Carries out a command, with the laws that the program brings.
pub fn run(command: &Command, own: &[OwnLaw]) -> Result<(), Problem> {
    let plan = |args: &SpecArgs| Plan::new(args.file(own)?);
    match command {
        Command::Run(args) => {
            let plan = plan(&args.spec)?;
            let store = RunStore::open(&plan, &args.out)?;
            let flown = fly::fly(&plan, &store, args.shard)?;
            match args.shard {
                None if flown == 0 && report::is_of(&plan, store.folder()) => {
                    let (name, folder) = (&plan.file.spec.name, store.folder().display());
                    print_line!(
                        "{name}: every run and its tables are there; see {folder}/{REPORT}"
                    );
                    Ok(())
                }
                Some(Shard { number, of }) => {
                    print_line!("shard {number}/{of} of {} is flown", plan.file.spec.name);
                    Ok(())
                }
                None => write(&plan, &store).map(drop),
            }
        }
        Command::Merge(args) => {
            let plan = plan(&args.spec)?;
            let store = RunStore::open(&plan, &args.out)?;
            for folder in &args.from {
                let taken = store.take(folder)?;
                print_line!("{}: {taken} parts taken", folder.display());
            }
            store.check_complete()?;
            write(&plan, &store).map(drop)
        }
        Command::Replay(args) => replay(args, &plan(&args.spec)?),
        Command::Worst(args) => {
            let plan = plan(&args.spec)?;
            worst::run(&plan, args.over.as_deref(), args.from, &args.out)
        }
        Command::Tune(args) => tune::run(&args.spec.file(own)?, &args.out),
        Command::Suite(args) => suite::run(&args.out, &args.aircraft, own),
        Command::Compare(args) => {
            print_text!("{}", compare::folders(&args.one, &args.other)?);
            Ok(())
        }
    }
}

/// Writes tables, scores, maps and the page of a campaign whose runs are all there; gives the losses of each law.
pub fn write(plan: &Plan, store: &RunStore) -> Result<Vec<Group>, Problem> {
    let mut results = Results::new(plan);
    // In one pass, because the rows of a million runs are not read twice.
    table::write(plan, store, &mut |row| results.add(row))?;
    let groups = summary::groups(plan, &results);
    let folder = OutFolder::create(store.folder())?;
    summary::table(plan, &groups).write(folder.path())?;
    print_text!("{}", summary::shown(plan, &groups));
    let tables = tables::markdown(plan, &results);
    if !tables.is_empty() {
        folder.write_markdown("tables.md", tables.trim_start())?;
        tables::all(plan, &results).try_for_each(|table| table.write(folder.path()))?;
        print_text!("{tables}\n");
    }
    let jams = Jams::of(plan);
    let mut studied = Vec::new();
    for airframe in 0..plan.aircraft.len() {
        let limits = jams.map(|_| PhysicsLimits::of(plan, airframe, store.folder()));
        // Without the limits of physics the campaign is still worth its tables.
        if let Some(Err(error)) = &limits {
            let name = &plan.aircraft[airframe].name;
            // Nobody may read any more.
            let _ = writeln!(console::err(), "{name}: no limit of physics: {error}");
        }
        let limits = limits.and_then(Result::ok);
        let scores = match (jams, &limits) {
            (Some(jams), Some(limits)) => limit::scores(plan, &results, jams, limits, airframe),
            _ => Vec::new(),
        };
        if let Some(jams) = jams {
            let figure = map::figure(plan, &results, jams, (airframe, limits.as_ref()), &scores);
            // A name such as "f16, 150 m/s" names no folder.
            let is_plain = |c: char| c.is_alphanumeric() || " _-.,".contains(c);
            let plain = |c| if is_plain(c) { c } else { '-' };
            let prefix: String = plan.aircraft[airframe].name.chars().map(plain).collect();
            let several = plan.aircraft.len() > 1;
            let name = if several { format!("{prefix}-map") } else { "map".to_owned() };
            write_figure_as(&folder, &name, &figure)?;
        }
        studied.push(Studied { limits, scores });
    }
    if jams.is_some() {
        limit::table(plan, &studied).write(folder.path())?;
    }
    let fields = tables::figure(plan, &results);
    let mut figures: Vec<Figure> = fields.iter().cloned().collect();
    let curves: Vec<Curves> = (0..plan.aircraft.len())
        .flat_map(|airframe| curves::of(plan, &results, airframe))
        .collect();
    if !curves.is_empty() {
        curves::table(plan, &curves).write(folder.path())?;
        figures.push(curves::figure(plan, &curves));
    }
    figures.iter().try_for_each(|figure| write_figure(&folder, figure))?;
    let sources = Sources {
        plan,
        results: &results,
        groups: &groups,
        jams,
        curves: &curves,
        studied: &studied,
        tables: &tables,
        fields: fields.as_ref(),
    };
    // The page comes last: `report::is_of` takes it as the sign that everything is there.
    let page = report::page(&sources);
    folder.write_marked(REPORT, page::GENERATOR.as_bytes(), page.as_bytes())?;
    print_line!("wrote {}", folder.path().join(REPORT).display());
    Ok(groups)
}

fn replay(args: &CampaignReplayArgs, plan: &Plan) -> Result<(), Problem> {
    let run = plan.run(plan.number(args.run)?)?;
    let setup = plan.setup(&run)?;
    let name = format!("{}, run {}", plan.file.spec.name, run.number);
    let one = OneFlight {
        scenario: &name,
        aircraft: &plan.args(&run)?,
        setup: &setup,
        // As in the campaign, or the flight would be another one.
        stops_at_loss: true,
        folder: args.out.as_deref(),
        ulog: args.out.is_some(),
        figures: args.out.is_some(),
        mcap: None,
        judges: &plan.file.spec.judges,
    };
    let law = plan.laws()[run.law];
    print_line!("{name}: {}, {law}, seed {}", plan.aircraft[run.airframe].name, run.seed);
    for (variable, value) in plan.variables().iter().zip(&run.values) {
        print_line!("  {} = {}", variable.key, value.shown());
    }
    let outcome = one.fly()?;
    print_line!("{outcome}");
    if let Some(out) = &args.out {
        print_line!("wrote {}", out.display());
    }
    Ok(())
}
