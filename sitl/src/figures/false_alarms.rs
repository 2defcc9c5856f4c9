//! Detection delay over the rate of false alarms.

use plotters::prelude::*;

use super::panel::{Area, Chart, Ink, draw_curve, open};
use super::{Entry, Figure, FigureError, Pattern, framed};
use crate::false_alarms::detectors::{DWELLS_S, KINDS, SCALES, scale};
use crate::false_alarms::{ALLOWED_PER_H, Shipped, Study, bound_per_h, kind_name};

/// The detectors that are drawn: without lag at the shortest and a long dwell, and with two lags.
const DRAWN: [(usize, Ink); 4] = [
    (0, ink(RGBColor(0, 80, 170), Pattern::Solid)),
    (2, ink(RGBColor(0, 125, 55), Pattern::Dashed)),
    (DWELLS_S.len(), ink(RGBColor(200, 30, 30), Pattern::Dotted)),
    (2 * DWELLS_S.len(), ink(RGBColor(150, 60, 160), Pattern::Fine)),
];
/// The paper's faults and the two weakest that are noticed, by their place in the list of faults.
const FAULTS: [(usize, &str); 3] = [
    (0, "(b) Case 1, left elevator at +30 deg"),
    (1, "(c) Case 2, rudder at +7 deg"),
    (7, "(d) Rudder at +3 deg"),
];
/// Rates of the axis, powers of ten an hour.
const RATES: (f64, f64) = (-2.0, 3.0);
/// Delays of the axis, s.
const DELAY_MAX_S: f64 = 0.5;

const fn ink(colour: RGBColor, pattern: Pattern) -> Ink {
    Ink { colour, pattern, width: 3 }
}

/// Rate over level, and delay over rate for three faults.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn false_alarms(study: &Study) -> Result<Figure, FigureError> {
    let all = study.healthy();
    let title = format!(
        "Detection delay over false alarms, {:.0} h of healthy flight",
        all.seconds / 3_600.0
    );
    let legend = DRAWN.map(|(kind, ink)| Entry::new(ink, kind_name(kind)));
    let rate = |kind: usize, index: usize| {
        libm::log10(bound_per_h(all.alarms[kind][index], all.seconds)).clamp(RATES.0, RATES.1)
    };
    let svg = framed(&title, &legend, 2, |area, panel| match panel.checked_sub(1) {
        None => rates(area, rate),
        Some(number) => {
            let (fault, title) = FAULTS[number.min(FAULTS.len() - 1)];
            delays(area, title, study, fault, rate)
        }
    })?;
    let caption = format!(
        "{title}. Each curve is one lag on z2 and one dwell; along it the levels rise from {:.1} to {:.1} of those in the \
         gains. The rate is the upper 95 % bound. The ring is the detector that flies, the thin line one alarm an hour. Delays \
         are medians in the same air.",
        scale(0),
        scale(SCALES - 1),
    );
    Ok(Figure { name: "false-alarms", caption, svg })
}

fn rates(area: &Area, rate: impl Fn(usize, usize) -> f64) -> Result<(), FigureError> {
    let x = (scale(0), scale(SCALES - 1));
    let names = ["level over that of the gains", "log10 of false alarms an hour"];
    let mut chart = open(area, "(a) False alarms", names, x, RATES)?;
    let allowed = libm::log10(ALLOWED_PER_H);
    line(&mut chart, [(x.0, allowed), (x.1, allowed)])?;
    for (kind, ink) in DRAWN {
        let points: Vec<_> = (0..SCALES).map(|index| (scale(index), rate(kind, index))).collect();
        draw_curve(&mut chart, &points, &ink)?;
    }
    let Shipped { kind, index } = Shipped::find();
    ring(&mut chart, (scale(index), rate(kind, index)))
}

fn delays(
    area: &Area,
    title: &str,
    study: &Study,
    fault: usize,
    rate: impl Fn(usize, usize) -> f64,
) -> Result<(), FigureError> {
    let names = ["log10 of false alarms an hour", "delay, s"];
    let mut chart = open(area, title, names, RATES, (0.0, DELAY_MAX_S))?;
    let allowed = libm::log10(ALLOWED_PER_H);
    line(&mut chart, [(allowed, 0.0), (allowed, DELAY_MAX_S)])?;
    let Some(delays) = study.delays.get(fault) else { return Ok(()) };
    let place = |kind: usize, index: usize| (rate(kind, index), delays.median_s[kind][index]);
    for (kind, ink) in DRAWN {
        debug_assert!(kind < KINDS, "a detector of the study");
        let inside = |at: &(f64, f64)| at.1 <= DELAY_MAX_S;
        let points: Vec<_> =
            (0..SCALES).map(|index| place(kind, index)).take_while(inside).collect();
        draw_curve(&mut chart, &points, &ink)?;
    }
    let Shipped { kind, index } = Shipped::find();
    let at = place(kind, index);
    if at.1 <= DELAY_MAX_S { ring(&mut chart, at) } else { Ok(()) }
}

fn line(chart: &mut Chart, ends: [(f64, f64); 2]) -> Result<(), FigureError> {
    chart.draw_series([PathElement::new(ends, RGBColor(120, 120, 120).stroke_width(2))])?;
    Ok(())
}

fn ring(chart: &mut Chart, at: (f64, f64)) -> Result<(), FigureError> {
    chart.draw_series([Circle::new(at, 12, BLACK.stroke_width(4))])?;
    Ok(())
}
