//! `report.html`: a campaign for people, in one page that opens without a network.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use host_io::file;
use lab_report::chart::Figure;
use lab_report::page;
use lab_tables::MAGIC;
use maud::{Markup, PreEscaped, html};

use crate::curves::{self, Curves};
use crate::limit::{Jams, Score, Studied};
use crate::map;
use crate::plan::{Plan, Run};
use crate::results::{Results, SCORECARD};
use crate::spec::SpecFile;
use crate::store::{PROGRAM, RunEnd};
use crate::summary::Group;
use crate::table::RUNS;
use crate::worst::quoted;

mod charts;
mod histories;

/// Name of the file.
pub const REPORT: &str = "report.html";
/// Style of this page beside that of every page.
const STYLE: &str = include_str!("report/style.css");
/// What the browser allows the page: nothing from anywhere else, so that it cannot ask for anything.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'";
/// A longer page is not read again, bytes.
const PAGE_MAX: u64 = 1 << 26;
/// Lost runs of a law that are listed at most.
const LISTED: usize = 200;

/// What a report is made of.
#[derive(Debug, Clone, Copy)]
pub struct Sources<'a> {
    pub plan: &'a Plan,
    /// What became of its runs.
    pub results: &'a Results,
    pub groups: &'a [Group],
    /// Where a campaign of jams has effector and angle.
    pub jams: Option<Jams>,
    /// Curves over joint levels.
    pub curves: &'a [Curves],
    pub studied: &'a [Studied],
    /// Its tables, in Markdown.
    pub tables: &'a str,
    /// The first of them that has fields, drawn.
    pub fields: Option<&'a Figure>,
}

impl Sources<'_> {
    fn of(&self, airframe: usize) -> impl Iterator<Item = &Group> {
        self.groups.iter().filter(move |group| group.airframe == airframe)
    }

    /// The share of the jams with any steady flight that a law survives, percent.
    fn headline(&self, airframe: usize, law: usize) -> Option<f64> {
        let Studied { limits, scores } = &self.studied[airframe];
        let set = limits.as_ref()?.sets.iter().position(|set| set.key == "any")?;
        let is_it = |s: &&Score| s.law == law && s.set == set && !s.margin;
        scores.iter().find(is_it).and_then(Score::percent)
    }

    /// The command that flies a run again.
    fn command(&self, run: usize) -> String {
        let SpecFile { name, options, .. } = &self.plan.file;
        let words: Vec<_> = [name].into_iter().chain(options).map(|word| quoted(word)).collect();
        format!("sitl campaign replay {} --run {run} --out run{run}", words.join(" "))
    }
}

/// Whether a folder has the page of this plan by this program; it is written last, so the tables are whole if they are there.
pub fn is_of(plan: &Plan, folder: &Path) -> bool {
    let begins = |name: &str, with: &[u8]| {
        let mut bytes = vec![0; with.len()];
        let read = File::open(folder.join(name)).and_then(|mut file| file.read_exact(&mut bytes));
        read.is_ok() && bytes == *with
    };
    let is_table = |name: &str, heading: &str| {
        begins(&format!("{name}.csv"), heading.as_bytes())
            && begins(&format!("{name}.parquet"), MAGIC)
    };
    let page = file::read_text(&folder.join(REPORT), PAGE_MAX);
    page.is_ok_and(|page| page.contains(&plan.fingerprint) && page.contains(PROGRAM))
        && begins(RUNS, MAGIC)
        && is_table("columns", "column,unit,meaning\n")
        && is_table("summary", "airframe,law,flights,kept,")
}

pub fn page(sources: &Sources<'_>) -> String {
    let Sources { plan, .. } = sources;
    let spec = &plan.file.spec;
    let title = format!("Campaign {}", spec.name);
    let body = html! {
        h1 { (title) }
        p { (spec.about) }
        @for note in plan.notes() { p { (note) "." } }
        @if let Some(figure) = sources.fields { figure { (PreEscaped(&figure.svg)) } }
        (page::markdown(sources.tables))
        @for airframe in 0..plan.aircraft.len() { (of_aircraft(sources, airframe)) }
        h2 { "How it was flown" }
        (header(sources))
    };
    let head = html! { meta http-equiv="Content-Security-Policy" content=(POLICY); };
    page::page_with_head(&title, STYLE, &head, &body)
}

fn of_aircraft(sources: &Sources<'_>, airframe: usize) -> Markup {
    let Sources { plan, jams, .. } = sources;
    let name = &plan.aircraft[airframe].name;
    let reference = plan.laws()[0];
    html! {
        h2 { "What was survived: " (name) }
        (in_short(sources, airframe))
        figure { (PreEscaped(charts::survived(sources, airframe))) }
        p.note {
            "Bars: share of all flights that ended with the aircraft inside its limits; lines: 95 % interval (Wilson)."
            @if sources.headline(airframe, 0).is_some() {
                " Diamonds: the same among the flights whose jam leaves a steady turn, climb or descent at all, which no law can do without."
            }
        }
        @if plan.file.spec.law.iter().any(|law| !law.about.is_empty()) {
            table {
                @for law in &plan.file.spec.law { tr { td { strong { (law.name) } } td { (law.about) } } }
            }
        }
        @if let Some(jams) = jams {
            h2 { "Which law survives which jam" }
            p.note {
                "Each row is a law, each cell an angle at which the effector jammed: blue was survived, red was lost. The black lines are the limits of physics; "
                "one that lies beyond the flown angles is not drawn. Between them a steady flight exists (solid: any turn, climb or descent; dotted: straight and "
                "level at the speed of the design point), outside them none: an aircraft that is kept there has not left its limits within "
                (plan.file.spec.duration_s) " s. The mouse shows the number of a run of each cell. The same map as files: map.svg, map.png."
            }
            @let Studied { limits, scores } = &sources.studied[airframe];
            @let at = (airframe, limits.as_ref());
            figure { (PreEscaped(map::figure(plan, sources.results, *jams, at, scores).svg)) }
        }
        @if plan.laws().len() > 1 {
            h2 { "Against " (reference) ", on the same flights" }
            p.note {
                "Points of loss fraction more or less than " (reference) "; every law flew the same flights with the same seeds. Lines: 95 % interval of the "
                "paired bootstrap. A line that crosses zero shows no difference."
            }
            figure { (PreEscaped(charts::differences(sources, airframe))) }
        }
        @for curves in sources.curves.iter().filter(|curves| curves.airframe == airframe) {
            h2 { "Over " (curves.title) }
            p.note {
                "Fraction lost with its 95 % interval (Wilson), then medians and quartiles of measures over the flights that were kept. A measure of a law that loses "
                "many flights is of those that were easy enough for it."
            }
            figure { (PreEscaped(curves::figure(plan, std::slice::from_ref(curves)).svg)) }
        }
        h2 { "Scorecard" }
        (scorecard(sources, airframe))
        h2 { @if jams.is_some() { "The nearest losses" } @else { "The first losses" } }
        (histories::section(sources, airframe))
        h2 { "Runs that were lost" }
        (lost(sources, airframe))
    }
}

/// Two or three sentences that a stranger understands.
fn in_short(sources: &Sources<'_>, airframe: usize) -> Markup {
    let Sources { plan, results, .. } = sources;
    let flights = plan.flights_of(airframe).len();
    let laws = plan.laws();
    let kept = |group: &Group| 1.0 - group.fraction_lost();
    // The reference is no law that could fly.
    let is_reference = |group: &Group| plan.file.spec.law[group.law].fault_known;
    let flown: Vec<&Group> =
        sources.of(airframe).filter(|group| group.flown > 0 && !is_reference(group)).collect();
    let most = flown.iter().map(|group| kept(group)).fold(f64::NEG_INFINITY, f64::max);
    let best: Vec<&str> =
        flown.iter().filter(|group| kept(group) >= most).map(|group| laws[group.law]).collect();
    let first = flown.first().filter(|group| kept(group) < most);
    let failed = plan
        .flights_of(airframe)
        .flat_map(|flight| (0..laws.len()).map(move |law| (flight, law)))
        .filter(|(flight, law)| results.end(*flight, *law) == RunEnd::Failed)
        .count();
    html! {
        p.verdict {
            (flights) " flights of " (plan.file.spec.duration_s) " s, each flown by " (laws.len()) " control laws on the same aircraft, faults and seeds. "
            "A flight is survived if the aircraft stays inside the limits of its airframe file to the end. "
            @if !best.is_empty() {
                strong { (best.join("; ")) } @if best.len() > 1 { " survive most, each " } @else { " survives most: " } (percent(most))
                @if let Some(first) = first { "; " (laws[first.law]) " survives " (percent(kept(first))) }
                ". "
            }
            @if failed > 0 { (failed) " runs could not be flown; runs.parquet has the reasons." }
        }
    }
}

/// A key that a narrow column may break behind its dots and underscores.
fn breakable(key: &str) -> String {
    key.replace('.', ".\u{200b}").replace('_', "_\u{200b}")
}

/// A number of a table; a dash where there is none.
fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() { format!("{value:.decimals$}") } else { "-".to_owned() }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn scorecard(sources: &Sources<'_>, airframe: usize) -> Markup {
    let Sources { plan, results, .. } = sources;
    let flights = plan.flights_of(airframe);
    html! {
        table {
            tr {
                th { "law" } th.number { "lost" } th.number { "lost, %" } th.number { "95 %" }
                @for row in &SCORECARD { th.number { (row.name) @if !row.unit.is_empty() { ", " (row.unit) } } }
            }
            @for group in sources.of(airframe) {
                @let (low, high) = group.interval;
                tr {
                    td { (plan.laws()[group.law]) }
                    td.number { (group.lost) " of " (group.flown) }
                    td.number { (number(100.0 * group.fraction_lost(), 1)) }
                    td.number { (number(100.0 * low, 1)) " to " (number(100.0 * high, 1)) }
                    @for place in 0..SCORECARD.len() {
                        @let value = results.score(place, flights.clone(), group.law);
                        td.number { (number(value.unwrap_or(f64::NAN), 3)) }
                    }
                }
            }
        }
        p.note {
            "Medians over the flights that were kept; missed faults and false alarms are means over all flights. Travel and reversals are sums over all surfaces and nozzle "
            "angles, the time at a limit is that of the effector with most of it. docs/fly.md defines each measure; runs.parquet has all of them for every run."
        }
    }
}

/// For each law the runs that it lost.
fn lost(sources: &Sources<'_>, airframe: usize) -> Markup {
    let Sources { plan, results, .. } = sources;
    let laws = plan.laws().len();
    let of = |law: usize| -> Vec<usize> {
        let lost = plan.flights_of(airframe);
        let lost = lost.filter(move |flight| results.end(*flight, law) == RunEnd::Lost);
        lost.map(|flight| flight * laws + law).collect()
    };
    html! {
        p { "Every run flies again alone, with its table, log and figures, by " code { (sources.command(0)) } ", with its number in place of 0." }
        @for (law, name) in plan.laws().iter().enumerate() {
            @let runs = of(law);
            details {
                summary { (name) ": " (runs.len()) }
                table {
                    tr { th { "run" } @for variable in plan.variables() { th.number { (breakable(&variable.key)) } } }
                    @for run in runs.iter().take(LISTED).filter_map(|run| plan.run(*run as u64).ok()) {
                        (row(&run))
                    }
                }
                @if runs.len() > LISTED { p.note { (runs.len() - LISTED) " more stand in runs.parquet." } }
            }
        }
    }
}

fn row(run: &Run) -> Markup {
    html! {
        tr { td { (run.number) } @for value in &run.values { td.number { (value.shown()) } } }
    }
}

fn header(sources: &Sources<'_>) -> Markup {
    let Sources { plan, .. } = sources;
    let spec = &plan.file.spec;
    let rows = [
        ("program", format!("Two-Step {PROGRAM}")),
        ("specification", plan.file.name.clone()),
        ("fingerprint (SHA-256)", plan.fingerprint.clone()),
        ("scenario", spec.scenario.clone()),
        (
            "runs",
            format!("{}, {} flights with {} laws", plan.runs(), plan.flights(), plan.laws().len()),
        ),
        (
            "seed",
            format!("{}; each flight has its own, in the column seed of runs.parquet", spec.seed),
        ),
    ];
    html! {
        table { @for (name, value) in rows { tr { td { (name) } td { (value) } } } }
        details { summary { "The specification" } pre { (plan.file.text) } }
        p.note {
            "Intervals: Wilson for fractions, paired bootstrap with 1,000 resamples for differences, both 95 %. "
            "docs/campaigns.md describes the specification and the files."
        }
    }
}
