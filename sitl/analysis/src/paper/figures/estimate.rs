//! Figures 5 and 8: what the observer finds, against the truth.

use super::{FAULT, FaultName, fault_mark};
use crate::chart::axis::range;
use crate::chart::curve::thin;
use crate::chart::panel::{Curve, Panel};
use crate::chart::{Figure, Ink, Pattern, sheet};
use crate::paper::cases::Flown;
use crate::paper::estimates::Axis;
use crate::paper::trace::Trace;

/// The close-up begins this long before the fault, s.
const BEFORE_S: f64 = 0.2;
/// The close-up ends this long after the fault, s.
const AFTER_S: f64 = 0.8;
/// Smallest height of a panel, rad/s².
const SPAN_MIN: f64 = 0.02;

/// F: broad and pale, so that the estimate can be seen on top of it.
const TRUTH: Ink = Ink::new("#faaa5a", Pattern::Solid).wide(5.0);
/// z2.
const ESTIMATE: Ink = Ink::new("#003c8c", Pattern::Solid);

/// The estimate of each axis of the compensated run: the whole run, and close up around the fault.
pub fn figure(name: &'static str, number: &str, flown: &Flown) -> Figure {
    let (fault_s, end_s) = (flown.case.fault_s, flown.case.duration_s());
    let marks = [fault_mark(flown)];
    let panels: Vec<Panel<'_>> = Axis::ALL
        .into_iter()
        .zip(['a', 'b', 'c'])
        .flat_map(|(axis, letter)| {
            [
                panel(flown, axis, letter, (0.0, end_s), ""),
                panel(flown, axis, letter, (fault_s - BEFORE_S, fault_s + AFTER_S), ", close up"),
            ]
        })
        .map(|panel| Panel { marks: &marks, ..panel })
        .collect();
    let title = format!("{number}. Case {}: estimate of the fault, compensated", flown.case.number);
    let caption = format!(
        "{title} ({}). Angular acceleration that the model of the healthy aircraft does not explain. Left: \
         the whole run; right: the same around the fault.",
        FaultName(flown)
    );
    let legend = [
        ("z2, the observer's estimate", ESTIMATE),
        ("F, the truth of the simulation", TRUTH),
        (marks[0].label.as_str(), FAULT),
    ];
    Figure { name, caption, svg: sheet(&title, &legend, 2, &panels) }
}

fn panel(flown: &Flown, axis: Axis, letter: char, x: (f64, f64), what: &str) -> Panel<'static> {
    let run: &Trace = &flown.compensated;
    let curve = |value: fn(Axis, &crate::table::Row) -> f64| {
        thin(run.samples().iter().map(|s| (s.row.t_s, value(axis, &s.row))), x.0, x.1)
    };
    let truth = curve(|axis, row| axis.fault(row));
    let estimate = curve(|axis, row| axis.estimate(row));
    let y = range(truth.iter().chain(&estimate).map(|point| point.1), SPAN_MIN);
    Panel {
        title: format!("({letter}) {}{what}", capital(axis.name())),
        y_label: "rad/s²",
        x,
        y,
        curves: vec![Curve::unnamed(truth, TRUTH), Curve::unnamed(estimate, ESTIMATE)],
        ..Panel::default()
    }
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
