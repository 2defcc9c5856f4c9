//! How many aircraft survive as the controller's model gets worse.

use super::{COMPENSATED, PID_ONLY};
use crate::chart::panel::{Curve, Panel, Shape, Symbol};
use crate::chart::{Figure, Ink, Pattern, sheet};
use crate::paper::model_error::{CLAIM_DRAWS, CLAIM_WIDTH, SurvivalPoint};

/// With the compensator; points need an unbroken line between them.
const WITH: Ink = Ink::new(COMPENSATED.colour, Pattern::Solid);
/// Half width of the bars of the intervals, percent of dispersion.
const BAR: f64 = 0.4;
/// The two curves stand this far apart, so that their bars do not cover each other, percent of dispersion.
const APART: f64 = 0.25;

/// Share of aircraft that survive, over the half width of the dispersion of all derivatives together.
#[must_use]
pub fn survival(points: &[SurvivalPoint]) -> Figure {
    let draws = points.first().map_or(0, |point| point.draws);
    let title = format!("Survival under model error, {draws} aircraft a point");
    let legend = [("PID and compensator", WITH), ("PID only", PID_ONLY)];
    let panels = [1, 2].map(|case| panel(case, points));
    let svg = sheet(&title, &legend, 2, &panels);
    let caption = format!(
        "{title}. Every aerodynamic derivative multiplied by its own factor, uniform in 1 ± the number on the \
         axis; the controller keeps its nominal model. Bars: Wilson's 95 % interval. Claim 5 looks at the first \
         {CLAIM_DRAWS} aircraft at ± {:.0} %.",
        100.0 * CLAIM_WIDTH
    );
    Figure { name: "survival", caption, svg }
}

/// Share that survived, with its interval.
type Share = fn(&SurvivalPoint) -> (f64, (f64, f64));

fn panel(case: u32, points: &[SurvivalPoint]) -> Panel<'static> {
    let points: Vec<&SurvivalPoint> = points.iter().filter(|point| point.case == case).collect();
    let letter = if case == 1 { 'a' } else { 'b' };
    let mut panel = Panel {
        title: format!("({letter}) Case {case}"),
        x_label: "dispersion of every derivative, ± %",
        y_label: "aircraft that survive, %",
        x: (0.0, 32.0),
        y: (-4.0, 104.0),
        ..Panel::default()
    };
    let runs: [(Ink, f64, Share); 2] = [
        (PID_ONLY, APART, SurvivalPoint::pid_only_share),
        (WITH, -APART, SurvivalPoint::compensated_share),
    ];
    for (ink, aside, share) in runs {
        let place = |point: &SurvivalPoint| 100.0 * point.half_width + aside;
        let curve: Vec<_> = points.iter().map(|p| (place(p), 100.0 * share(p).0)).collect();
        let symbol = |at: &(f64, f64)| Symbol {
            at: *at,
            shape: Shape::Dot,
            colour: ink.colour,
            label: String::new(),
        };
        panel.symbols.extend(curve.iter().map(symbol));
        panel.curves.push(Curve::unnamed(curve, ink));
        let line = Ink::new(ink.colour, Pattern::Solid).wide(1.0);
        for point in &points {
            let (at, (low, high)) = (place(point), share(point).1);
            let (low, high) = (100.0 * low, 100.0 * high);
            let bar = [(at, low), (at, high)];
            let ends = [low, high].map(|y| [(at - BAR, y), (at + BAR, y)]);
            let lines = ends.into_iter().chain([bar]);
            panel.curves.extend(lines.map(|line_of| Curve::unnamed(line_of.to_vec(), line)));
        }
    }
    panel
}
