//! The nearest loss of each law, flown again: roll angle, sideslip and altitude over time.

use flight_control::DesignModel;
use lab_judges::closed_loop;
use lab_judges::trace::Sample;
use lab_judges::trajectory::Row;
use lab_report::chart::axis::range;
use lab_report::chart::curve::Point;
use lab_report::chart::panel::{Curve, Panel};
use lab_report::chart::{Ink, Pattern, sheet};
use maud::{Markup, PreEscaped, html};

use super::{Sources, breakable};
use crate::curves::COLOURS;
use crate::store::RunEnd;

/// Every so many control steps have a point.
const EVERY: u64 = 25;
/// A panel: title with unit, and what of a row.
type HistoryPanel = (&'static str, fn(&Row) -> f64);
const PANELS: [HistoryPanel; 3] = [
    ("roll angle, deg", |row| row.phi_rad.to_degrees()),
    ("sideslip, deg", |row| row.beta_rad.to_degrees()),
    ("altitude, m", |row| row.altitude_m),
];

/// A loss that was flown again.
struct LostFlight {
    law: usize,
    run: usize,
    curves: [Vec<Point>; PANELS.len()],
}

/// The section: which runs, and their curves.
pub(super) fn section(sources: &Sources<'_>, airframe: usize) -> Markup {
    let nearest: Vec<(usize, usize)> = (0..sources.plan.laws().len())
        .filter_map(|law| Some((law, nearest(sources, airframe, law)?)))
        .collect();
    let histories: Vec<LostFlight> =
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
        p.note { "Of the flights that each law lost, " (by) ", up to the loss." }
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
        figure { (PreEscaped(figure(sources, &histories))) }
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
        let servo = list.by_key(&key).map(|effector| &aircraft.servos[effector]);
        servo.map_or(f64::INFINITY, |servo| {
            let end = if deg < 0.0 { servo.min } else { servo.max };
            (deg.to_radians() / end).abs()
        })
    };
    lost.map(|flight| (size(flight), flight))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|found| found.1)
}

fn fly(sources: &Sources<'_>, law: usize, flight: usize) -> Option<LostFlight> {
    let plan = sources.plan;
    let run = flight * plan.laws().len() + law;
    let drawn = plan.run(run as u64).ok()?;
    let setup = plan.setup(&drawn).ok()?;
    let limits = setup.plant.limits();
    let model = DesignModel::new(setup.model);
    let mut history = LostFlight { law, run, curves: Default::default() };
    let (mut steps, mut is_lost) = (0_u64, false);
    let flown = closed_loop::fly(&setup, &mut |record| {
        // The loop goes on to the end of the flight; the history ends with the loss.
        if is_lost {
            return;
        }
        let row = Sample::of(&model, record).row;
        is_lost = limits.are_exceeded(&(&row).into());
        if steps.is_multiple_of(EVERY) || is_lost {
            for (curve, (_, of)) in history.curves.iter_mut().zip(PANELS) {
                curve.push((row.t_s, of(&row)));
            }
        }
        steps += 1;
    });
    flown.ok().map(|_| history)
}

fn figure(sources: &Sources<'_>, histories: &[LostFlight]) -> String {
    let laws = sources.plan.laws();
    let ink = |law: usize| Ink::new(COLOURS[law % COLOURS.len()], Pattern::Solid);
    let legend: Vec<(&str, Ink)> = histories.iter().map(|h| (laws[h.law], ink(h.law))).collect();
    let times = || histories.iter().flat_map(|history| &history.curves[0]).map(|point| point.0);
    let panel = |(place, (y_label, _)): (usize, &HistoryPanel)| {
        let curves = histories.iter().map(|h| Curve::unnamed(h.curves[place].clone(), ink(h.law)));
        let values = histories.iter().flat_map(|h| &h.curves[place]).map(|point| point.1);
        Panel {
            y_label,
            x: (0.0, times().fold(0.0, f64::max)),
            y: range(values, 1.0),
            curves: curves.collect(),
            ..Panel::default()
        }
    };
    let panels: Vec<Panel<'_>> = PANELS.iter().enumerate().map(panel).collect();
    sheet("Up to the loss", &legend, 1, &panels)
}
