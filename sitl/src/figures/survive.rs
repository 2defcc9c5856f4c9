//! How many aircraft survive as the controller's model gets worse.

use plotters::prelude::*;

use super::panel::{Area, Ink, draw_curve, open};
use super::{COMPENSATED, Entry, Figure, FigureError, PID_ONLY, Pattern, framed};
use crate::paper::model_error::{CLAIM_DRAWS, CLAIM_WIDTH, SurvivalPoint};

/// With the compensator; points need an unbroken line between them.
const WITH: Ink = Ink { colour: COMPENSATED.colour, pattern: Pattern::Solid, width: 3 };
/// Half width of the bars of the intervals, percent of dispersion.
const BAR: f64 = 0.4;
/// The two curves stand this far apart, so that their bars do not cover each other, percent of dispersion.
const APART: f64 = 0.25;

/// Share of aircraft that survive, over the half width of the dispersion of all derivatives together.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn survival(points: &[SurvivalPoint]) -> Result<Figure, FigureError> {
    let draws = points.first().map_or(0, |point| point.draws);
    let title = format!("Survival under model error, {draws} aircraft a point");
    let legend = [Entry::new(WITH, "PID and compensator"), Entry::new(PID_ONLY, "PID only")];
    let svg = framed(&title, &legend, 1, |area, index| {
        let case = if index == 0 { 1 } else { 2 };
        let points: Vec<_> = points.iter().filter(|p| p.case == case).copied().collect();
        panel(area, case, &points)
    })?;
    let caption = format!(
        "{title}. Every aerodynamic derivative multiplied by its own factor, uniform in 1 ± the number on the \
         axis; the controller keeps its nominal model. Bars: Wilson's 95 % interval. Claim 5 looks at the first \
         {CLAIM_DRAWS} aircraft at ± {:.0} %.",
        100.0 * CLAIM_WIDTH
    );
    Ok(Figure { name: "survival", caption, svg })
}

/// Share that survived, with its interval.
type Share = fn(&SurvivalPoint) -> (f64, (f64, f64));

fn panel(area: &Area, case: u32, points: &[SurvivalPoint]) -> Result<(), FigureError> {
    let (x, y) = ((0.0, 32.0), (-4.0, 104.0));
    let letter = if case == 1 { 'a' } else { 'b' };
    let names = ["dispersion of every derivative, ± %", "aircraft that survive, %"];
    let mut chart = open(area, &format!("({letter}) Case {case}"), names, x, y)?;
    let curves: [(Ink, f64, Share); 2] = [
        (PID_ONLY, APART, SurvivalPoint::pid_only_share),
        (WITH, -APART, SurvivalPoint::compensated_share),
    ];
    for (ink, aside, share) in curves {
        let place = |p: &SurvivalPoint| 100.0 * p.half_width + aside;
        let curve: Vec<_> = points.iter().map(|p| (place(p), 100.0 * share(p).0)).collect();
        draw_curve(&mut chart, &curve, &ink)?;
        let dots = curve.iter().map(|at| Circle::new(*at, 8, ink.colour.filled()));
        chart.draw_series(dots)?;
        let style = ink.colour.stroke_width(2);
        for point in points {
            let (at, (low, high)) = (place(point), share(point).1);
            let (low, high) = (100.0 * low, 100.0 * high);
            let bars = [
                [(at, low), (at, high)],
                [(at - BAR, low), (at + BAR, low)],
                [(at - BAR, high), (at + BAR, high)],
            ];
            chart.draw_series(bars.map(|ends| PathElement::new(ends, style)))?;
        }
    }
    Ok(())
}
