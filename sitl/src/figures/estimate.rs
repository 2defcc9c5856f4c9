//! Figures 5 and 8: what the observer finds, against the truth.

use plotters::prelude::RGBColor;

use super::curve::thin;
use super::panel::{Curve, Ink, Panel, Pattern};
use super::{Entry, FaultName, Figure, FigureError, fault_entry, fault_event, range, sheet};
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
const TRUTH: Ink = Ink { colour: RGBColor(250, 170, 90), pattern: Pattern::Solid, width: 9 };
/// z2.
const ESTIMATE: Ink = Ink { colour: RGBColor(0, 60, 140), pattern: Pattern::Solid, width: 3 };

/// The estimate of each axis of the compensated run: the whole run, and close up around the fault.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn figure(name: &'static str, number: &str, flown: &Flown) -> Result<Figure, FigureError> {
    let (fault_s, end_s) = (flown.case.fault_s, flown.case.duration_s());
    let panels: Vec<Panel> = Axis::ALL
        .into_iter()
        .zip(['a', 'b', 'c'])
        .flat_map(|(axis, letter)| {
            [
                panel(flown, axis, letter, (0.0, end_s), ""),
                panel(flown, axis, letter, (fault_s - BEFORE_S, fault_s + AFTER_S), ", close up"),
            ]
        })
        .collect();
    let title = format!("{number}. Case {}: estimate of the fault, compensated", flown.case.number);
    let caption = format!(
        "{title} ({}). Angular acceleration that the model of the healthy aircraft does not explain. Left: \
         the whole run; right: the same around the fault.",
        FaultName(flown)
    );
    let legend = [
        Entry::new(ESTIMATE, "z2, the observer's estimate"),
        Entry::new(TRUTH, "F, the truth of the simulation"),
        fault_entry(flown),
    ];
    Ok(Figure { name, caption, svg: sheet(&title, &legend, &panels)? })
}

fn panel(flown: &Flown, axis: Axis, letter: char, x: (f64, f64), what: &str) -> Panel {
    let run: &Trace = &flown.compensated;
    let curve = |value: fn(Axis, &crate::table::Row) -> f64| {
        thin(run.samples().iter().map(|s| (s.row.t_s, value(axis, &s.row))), x.0, x.1)
    };
    let truth = curve(|axis, row| axis.fault(row));
    let estimate = curve(|axis, row| axis.estimate(row));
    let y = range(truth.iter().chain(&estimate).map(|point| point.1), SPAN_MIN);
    Panel {
        title: format!("({letter}) {}{what}", capital(axis.name())),
        y_label: "rad/s²".to_owned(),
        x,
        y,
        curves: vec![
            Curve { points: truth, ink: TRUTH },
            Curve { points: estimate, ink: ESTIMATE },
        ],
        rules: Vec::new(),
        events: vec![fault_event(flown)],
        ends: Vec::new(),
    }
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
