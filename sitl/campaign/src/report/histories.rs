//! The nearest loss of each law, flown again: roll angle, sideslip and altitude over time.

use flight_analysis::closed_loop;
use flight_analysis::paper::trace::Sample;
use flight_analysis::table::Row;
use flight_control::DesignModel;
use maud::{Markup, html};
use serde_json::{Value as Json, json};

use super::charts::{Chart, layout};
use super::{Sources, breakable, list, place};
use crate::curves::COLOURS;
use crate::store::RunEnd;

/// Every so many control steps have a point.
const EVERY: u64 = 25;
/// Panels: title with unit, and what of a row.
type Panel = (&'static str, fn(&Row) -> f64);
const PANELS: [Panel; 3] = [
    ("roll angle, deg", |row| row.phi_rad.to_degrees()),
    ("sideslip, deg", |row| row.beta_rad.to_degrees()),
    ("altitude, m", |row| row.altitude_m),
];

/// A loss that was flown again.
struct History {
    law: usize,
    run: usize,
    time_s: Vec<f64>,
    curves: [Vec<f64>; PANELS.len()],
}

/// The section: which runs, and their curves.
pub(super) fn section(sources: &Sources<'_>, airframe: usize, charts: &mut Vec<Chart>) -> Markup {
    let nearest: Vec<(usize, usize)> = (0..sources.plan.laws().len())
        .filter_map(|law| Some((law, nearest(sources, airframe, law)?)))
        .collect();
    let histories: Vec<History> =
        nearest.iter().filter_map(|(law, flight)| fly(sources, *law, *flight)).collect();
    if histories.is_empty() {
        return html! { p { "No law lost the aircraft." } };
    }
    let by = match sources.jams {
        Some(_) => "the jam with the smallest part of the travel",
        None => "the first of them",
    };
    let laws = sources.plan.laws();
    html! {
        p.note { "Of the flights that each law lost, " (by) ", up to the loss. A click on a law hides it." }
        table {
            tr { th { "law" } th { "run" } @for variable in sources.plan.variables() { th.number { (breakable(&variable.key)) } } th { "flies again by" } }
            @for history in &histories {
                @if let Ok(run) = sources.plan.run(history.run as u64) {
                    tr {
                        td { (laws[history.law]) } td { (history.run) }
                        @for value in &run.values { td.number { (value.shown()) } }
                        td { code { (sources.command(history.run)) } }
                    }
                }
            }
        }
        (place(charts, chart(sources, &histories)))
    }
}

/// The flight with the smallest jam that a law lost, or its first loss.
fn nearest(sources: &Sources<'_>, airframe: usize, law: usize) -> Option<usize> {
    let lost = |flight: &usize| sources.results.end(*flight, law) == RunEnd::Lost;
    let mut lost = sources.plan.flights_of(airframe).filter(lost);
    let Some(jams) = sources.jams else { return lost.next() };
    let size = |flight: usize| {
        let Some((key, deg)) = jams.jam(sources.plan, flight) else { return f64::INFINITY };
        let aircraft = &sources.plan.aircraft[airframe].airframe;
        let list = &aircraft.effectors;
        let servo = list.all().find(|e| list.key(*e) == key).map(|e| &aircraft.servos[e]);
        servo.map_or(f64::INFINITY, |servo| {
            let end = if deg < 0.0 { servo.min } else { servo.max };
            (deg.to_radians() / end).abs()
        })
    };
    lost.map(|flight| (size(flight), flight))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|found| found.1)
}

fn fly(sources: &Sources<'_>, law: usize, flight: usize) -> Option<History> {
    let plan = sources.plan;
    let run = flight * plan.laws().len() + law;
    let drawn = plan.run(run as u64).ok()?;
    let setup = plan.setup(&drawn).ok()?;
    let limits = setup.plant.airframe.limits;
    let model = DesignModel::new(setup.model);
    let mut history = History { law, run, time_s: Vec::new(), curves: Default::default() };
    let (mut steps, mut is_lost) = (0_u64, false);
    let flown = closed_loop::fly(&setup, &mut |record| {
        if is_lost {
            return;
        }
        let row = Sample::of(&model, record).row;
        is_lost = limits.are_exceeded(&(&row).into());
        if steps.is_multiple_of(EVERY) || is_lost {
            history.time_s.push(row.t_s);
            for (curve, (_, of)) in history.curves.iter_mut().zip(PANELS) {
                curve.push(of(&row));
            }
        }
        steps += 1;
    });
    flown.ok().map(|_| history)
}

fn chart(sources: &Sources<'_>, histories: &[History]) -> Chart {
    let laws = sources.plan.laws();
    let mut data = Vec::new();
    for history in histories {
        for (panel, curve) in history.curves.iter().enumerate() {
            let number = if panel == 0 { String::new() } else { (panel + 1).to_string() };
            data.push(json!({
                "type": "scatter", "mode": "lines", "name": laws[history.law],
                "legendgroup": laws[history.law], "showlegend": panel == 0,
                "x": list(history.time_s.iter().copied()), "y": list(curve.iter().copied()),
                "line": {"color": COLOURS[history.law % COLOURS.len()], "width": 1.5},
                "xaxis": "x", "yaxis": format!("y{number}"),
                "hovertemplate": format!("{}: %{{y:.1f}} at %{{x:.2f}} s<extra></extra>", laws[history.law]),
            }));
        }
    }
    let mut axes = serde_json::Map::new();
    for (panel, (title, _)) in PANELS.iter().enumerate() {
        let number = if panel == 0 { String::new() } else { (panel + 1).to_string() };
        let height = 1.0 / PANELS.len() as f64;
        let top = 1.0 - height * panel as f64;
        let _ = axes.insert(
            format!("yaxis{number}"),
            json!({"domain": [top - height + 0.03, top - 0.02], "title": {"text": title}}),
        );
    }
    let last = PANELS.len().to_string();
    let _ = axes.insert(
        "xaxis".to_owned(),
        json!({"title": {"text": "time, s"}, "anchor": format!("y{last}")}),
    );
    let mut layout: Json = layout(&json!({
        "margin": {"l": 80, "r": 30, "t": 30, "b": 50},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
    }));
    if let Some(layout) = layout.as_object_mut() {
        layout.extend(axes);
    }
    Chart { data: Json::from(data), layout, height: 720 }
}
