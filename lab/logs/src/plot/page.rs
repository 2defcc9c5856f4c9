//! The page: header, events, figures, what is missing, and the texts of the autopilot.

use flight_control::gains::{Selection, name_of};
use flight_control::{AllocationMode, CompensatorLaw, CompensatorMode, MainLaw};
use maud::{Markup, PreEscaped, html};
use plant_sim::WindSettings;
use ulog::reader::{Log, ParameterValue};

use super::events::marks;
use super::flight::{Flight, Kind, LogEvent};
use super::panels::{self, Group};
use lab_report::chart::curve::Point;
use lab_report::chart::panel::{Curve, Mark, Panel, Shape, Symbol};
use lab_report::chart::single;
use lab_report::page;

/// Style of this page beside that of every page.
const STYLE: &str = include_str!("style.css");
/// Rows of the table; a log with more says how many there are.
const ROWS_MAX: usize = 500;
/// Places on the track with a time.
const CLOCKS: f64 = 8.0;
/// At most; a rounded step may give one more than wanted.
const CLOCKS_MAX: usize = 10;
/// Damaged places that are named; a log with more says how many there are.
const DAMAGES_MAX: usize = 20;
/// Rows of the table of parameters.
const PARAMETERS_MAX: usize = 5_000;
/// Height of the track's frame.
const MAP_HEIGHT: f64 = 520.0;
/// Letters of a text from the log; longer ones are cut.
const TEXT_MAX: usize = 2_000;

/// The page of a flight.
pub fn page(title: &str, flight: &Flight, own_law: Option<&str>) -> String {
    let marks = marks(&flight.events);
    let title = format!("Flight {title}");
    let body = html! {
        h1 { (title) }
        (verdict(flight))
        (header(flight, own_law))
        h2 { "What happened" }
        (table(&flight.events))
        h2 { "Track and modes" }
        (track(flight))
        @for group in panels::groups(flight) { (figures(group, flight, &marks)) }
        (texts(&flight.log))
        (parameters(&flight.log))
    };
    page::page(&title, STYLE, &body)
}

/// Complete or cut, and what the log does not have.
fn verdict(flight: &Flight) -> Markup {
    let log = &flight.log;
    let is_damaged = !log.damages().is_empty();
    let complete = log.info_text("run_hash").is_some() && !log.is_cut() && !is_damaged;
    let missing = missing(flight);
    let loss = flight.events.iter().find(|what| what.kind == Kind::Loss);
    html! {
        @if let Some(LogEvent { t_s, text, .. }) = loss { p.verdict.bad { (format!("At {t_s:.3} s {text}.")) } }
        p.verdict.good[complete && loss.is_none()].bad[!complete] {
            @if complete { "The log is complete." }
            @else if is_damaged { "The log is damaged. What can be read of it is shown." }
            @else {
                "The log was cut off: its writer ended without its footer. Everything up to there is shown."
            }
        }
        @for damage in log.damages().iter().take(DAMAGES_MAX) { p.bad { "Damaged: " (short(&damage.to_string())) } }
        @if log.damages().len() > DAMAGES_MAX {
            p.bad { (log.damages().len() - DAMAGES_MAX) " more damaged places are not named." }
        }
        @for remark in flight.not_drawn() { p.bad { "Not drawn: " (remark) "." } }
        @if let Some(why) = &flight.unread { p.bad { "The inputs cannot be read: " (short(why)) } }
        @if !missing.is_empty() { p { "Not in this log: " (missing.join("; ")) "." } }
    }
}

/// A text from the log, cut where no writer would have gone on.
fn short(text: &str) -> &str {
    text.char_indices().nth(TEXT_MAX).map_or(text, |(end, _)| &text[..end])
}

fn missing(flight: &Flight) -> Vec<&'static str> {
    let topics = [
        ("truth", "the truth of the plant (true positions, true F)"),
        ("sensors", "sensor values"),
        ("control", "signals of the control laws"),
        ("commands", "commands"),
        ("vehicle", "modes"),
    ];
    let topics = topics.into_iter().filter(|(topic, _)| !flight.has(topic)).map(|(_, what)| what);
    let control =
        flight.control.is_none().then_some("a readable header of the autopilot (levels, model)");
    let plant = flight.plant.is_none().then_some("a readable header of the plant (scenario, seed)");
    topics.chain(control).chain(plant).collect()
}

fn header(flight: &Flight, own_law: Option<&str>) -> Markup {
    let log = &flight.log;
    let (from, to) = flight.span;
    let fact = |name: &str, value: Option<String>| {
        html! {
            @if let Some(value) = value { tr { th { (name) } td { (value) } } }
        }
    };
    let info = |key| log.info_text(key).map(short);
    let setup = flight.plant.as_ref().map(|plant| &plant.setup);
    let selection = flight.control.as_ref().map(|control| &control.settings.gains.selection);
    let seconds =
        format!("{:.3} s of simulation time ({} control steps have rows)", to - from, flight.steps);
    let rate = flight.control.as_ref().map(|control| match control.row_every {
        1 => "every control step".to_owned(),
        n => format!("one of {n} control steps, and all of them around events"),
    });
    html! {
        table {
            (fact("Scenario", flight.plant.as_ref().map(|plant| plant.scenario.clone())))
            (fact("Aircraft", aircraft(flight)))
            (fact("Main law", selection.map(|selection| main_law(selection, own_law))))
            (fact("Compensator", selection.map(|selection| compensator(flight, selection))))
            (fact("Seed, run", setup.map(|setup| format!("{}, {}", setup.seed, setup.run))))
            (fact("Duration", Some(seconds)))
            (fact("Control period", setup.map(|s| format!("{} ms", 1.0e3 * s.period.as_seconds()))))
            (fact("Rows of the log", rate))
            (fact("Turbulence", setup.map(|s| turbulence(&s.wind))))
            (fact("Autopilot", info("ver_sw").map(|v| format!("version {v}"))))
            (fact("Plant", flight.plant.as_ref().map(|plant| format!("version {}", plant.version))))
            (fact("Plant link", log.info_u64("ver_wire").map(|v| format!("version {v}"))))
            (fact("Session", info("session").map(str::to_owned)))
            (fact("Run hash", info("run_hash").map(str::to_owned)))
            (fact("End", info("end").map(str::to_owned)))
        }
    }
}

/// The aircraft, and of which one the controller has the model, if of another.
fn aircraft(flight: &Flight) -> Option<String> {
    let plant = flight.plant.as_ref().map(|plant| plant.setup.airframe.name.to_string());
    let model = flight.control.as_ref().map(|control| control.settings.model.aircraft.to_string());
    match (plant, model) {
        (Some(plant), Some(model)) if plant != model => {
            Some(format!("{plant}, with the controller's model of {model}"))
        }
        (plant, model) => plant.or(model),
    }
}

fn main_law(selection: &Selection, own_law: Option<&str>) -> String {
    let name = name_of(MainLaw::NAMES, selection.main);
    own_law.map_or_else(|| name.to_owned(), |own| format!("{name}: {own}"))
}

/// Estimator, allocation and mode of the compensator.
fn compensator(flight: &Flight, selection: &Selection) -> String {
    let law = name_of(CompensatorLaw::NAMES, selection.compensator_law);
    let allocation = name_of(AllocationMode::NAMES, selection.allocation);
    let modes = flight.compensator_modes().into_iter().map(|(since_s, mode)| {
        let name = name_of(CompensatorMode::NAMES, mode);
        let since =
            if since_s > flight.span.0 { format!(" since {since_s:.3} s") } else { String::new() };
        format!("{name}{since}")
    });
    format!("{} (FTC_MODE), {law}, allocation {allocation}", modes.collect::<Vec<_>>().join(", "))
}

fn table(events: &[LogEvent]) -> Markup {
    let hidden = events.len().saturating_sub(ROWS_MAX);
    html! {
        p { "The numbers stand above the lines in the figures; point at a line to read it there." }
        table.wide.events {
            thead { tr { th.number { "" } th.number { "Time, s" } th { "Kind" } th { "What" } } }
            tbody { @for (what, number) in events.iter().take(ROWS_MAX).zip(1..) {
                tr.first {
                    td.number { (number) }
                    td.number { (format!("{:.3}", what.t_s)) }
                    td style=(format!("color: {}", what.kind.colour())) { (what.kind.name()) }
                    td { (short(&what.text)) }
                }
            } }
        }
        @if hidden > 0 { p { (hidden) " more are not shown." } }
    }
}

fn track(flight: &Flight) -> Markup {
    let modes = panels::modes(flight).map(|panel| single(&panel));
    let map = panels::track(flight).map(|track| {
        let points: Vec<Point> = track.iter().map(|(_, at)| *at).collect();
        let map =
            Panel::map("Track over the ground, seen from above, north up", MAP_HEIGHT, &points);
        single(&Panel {
            symbols: spots(flight, &track),
            curves: vec![Curve::unnamed(points, panels::TRACK)],
            ..map
        })
    });
    html! {
        figure {
            @if let Some(svg) = &map { (PreEscaped(svg)) }
            @if let Some(svg) = &modes { (PreEscaped(svg)) }
            @if map.is_none() && modes.is_none() { p { "Not in this log." } }
            figcaption { "The track in the horizontal axes of the start, with the time and the begin of each fault." }
        }
    }
}

/// Start, times, faults, end.
fn spots(flight: &Flight, track: &[(f64, Point)]) -> Vec<Symbol> {
    let at = |t_s: f64| {
        let place = track.partition_point(|(time, _)| *time < t_s).min(track.len() - 1);
        track[place].1
    };
    let (from, to) = flight.span;
    let spot = |t_s: f64, colour, label| Symbol { at: at(t_s), shape: Shape::Dot, colour, label };
    let step_s = clock_step((to - from) / CLOCKS);
    let clocks = (1..)
        .map(|k| from + f64::from(k) * step_s)
        .take(CLOCKS_MAX)
        // No time right beside the end, which has a label of its own.
        .take_while(|t_s| *t_s < to - 0.3 * step_s)
        .map(|t_s| spot(t_s, "#777777", format!("{t_s:.0} s")));
    // A fault that comes and goes would cover the track with labels.
    let faults = flight.faults.iter().take(20).map(|fault| {
        spot(
            fault.span.0,
            Kind::Fault.colour(),
            format!("{} fails", flight.effectors.name(fault.effector)),
        )
    });
    let ends = [spot(from, "#0a6b2e", "start".to_owned()), spot(to, "#222222", "end".to_owned())];
    clocks.chain(faults).chain(ends).collect()
}

/// A round number of seconds, at least this long.
fn clock_step(least_s: f64) -> f64 {
    const STEPS: [f64; 13] =
        [1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1_800.0, 3_600.0, 7_200.0];
    const DAY: f64 = 86_400.0;
    let days = || DAY * libm::ceil(least_s / DAY);
    STEPS.into_iter().find(|step| *step >= least_s).unwrap_or_else(days)
}

fn figures(group: Group, flight: &Flight, marks: &[Mark]) -> Markup {
    html! {
        h2 { (group.title) }
        figure {
            @if group.panels.is_empty() { p { "Not in this log." } }
            @for panel in group.panels {
                (PreEscaped(single(&Panel { x: flight.span, marks, ..panel })))
            }
            figcaption { (group.caption) }
        }
    }
}

fn texts(log: &Log) -> Markup {
    html! {
        h2 { "Texts of the autopilot" }
        details {
            summary { (log.texts().len()) " lines" }
            table.wide { @for text in log.texts().iter().take(ROWS_MAX) {
                tr.first {
                    td.number { (format!("{:.3}", text.timestamp_us as f64 * 1.0e-6)) }
                    td { (short(&text.text)) }
                }
            } }
            @if log.texts().len() > ROWS_MAX { p { "The rest is not shown." } }
        }
    }
}

fn parameters(log: &Log) -> Markup {
    html! {
        h2 { "Parameters" }
        details {
            summary { (log.parameters().len()) " values and changes" }
            table { @for parameter in log.parameters().iter().take(PARAMETERS_MAX) {
                tr {
                    th { (short(&parameter.name)) }
                    td.number { @match parameter.value {
                        ParameterValue::Integer(value) => (value),
                        ParameterValue::Real(value) => (value),
                    } }
                    td { @if let Some(us) = parameter.after_us {
                        "changed at " (format!("{:.3}", us as f64 * 1.0e-6)) " s"
                    } }
                }
            } }
            @if log.parameters().len() > PARAMETERS_MAX { p { "The rest is not shown." } }
        }
    }
}
/// The turbulence of a flight, in words.
fn turbulence(wind: &WindSettings) -> String {
    match wind.turbulence {
        Some(level) => format!("{level} (MIL-F-8785C)"),
        None => format!("{} m/s rms", wind.turbulence_m_s),
    }
}
