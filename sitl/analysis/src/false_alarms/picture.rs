//! Detection delay over the rate of false alarms.

use super::detectors::{DWELLS_S, SCALES, scale};
use super::{ALLOWED_PER_H, Shipped, Study, bound_per_h, kind_name};
use crate::chart::curve::Point;
use crate::chart::panel::{Curve, Mark, Panel, Rule, Shape, Symbol};
use crate::chart::{Figure, Ink, Pattern, sheet};

/// The detectors that are drawn: without lag at the shortest and a long dwell, and with two lags.
const DRAWN: [(usize, Ink); 4] = [
    (0, Ink::new("#0050aa", Pattern::Solid)),
    (2, Ink::new("#007d37", Pattern::Dashed)),
    (DWELLS_S.len(), Ink::new("#c81e1e", Pattern::Dotted).wide(2.5)),
    (2 * DWELLS_S.len(), Ink::new("#963ca0", Pattern::Fine)),
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

/// The rate that is allowed.
const ALLOWED: Ink = Ink::new("#8a5a00", Pattern::Dashed).wide(1.0);

/// Rate over level, and delay over rate for three faults.
pub fn figure(study: &Study) -> Figure {
    let all = study.healthy();
    let title = format!(
        "Detection delay over false alarms, {:.0} h of healthy flight",
        all.seconds / 3_600.0
    );
    let rate = |kind: usize, index: usize| {
        libm::log10(bound_per_h(all.alarms[kind][index], all.seconds)).clamp(RATES.0, RATES.1)
    };
    let allowed = libm::log10(ALLOWED_PER_H);
    let label = format!("allowed: {ALLOWED_PER_H} an hour");
    let marks = [Mark { x: allowed, number: None, ink: ALLOWED, label: label.clone() }];
    let delays = FAULTS.map(|(fault, title)| {
        let median_s = study.delays.get(fault).map(|delays| &delays.median_s);
        // Beyond the axis a curve ends; a fault that was not flown has none.
        let at = |kind: usize, index: usize| {
            let delay_s = median_s?[kind][index];
            (delay_s <= DELAY_MAX_S).then(|| (rate(kind, index), delay_s))
        };
        Panel {
            title: title.to_owned(),
            x_label: "log10 of false alarms an hour",
            y_label: "delay, s",
            x: RATES,
            y: (0.0, DELAY_MAX_S),
            marks: &marks,
            ..with_curves(at)
        }
    });
    let [b, c, d] = delays;
    let rates = Panel {
        title: "(a) False alarms".to_owned(),
        x_label: "level over that of the gains",
        y_label: "log10 of false alarms an hour",
        x: (scale(0), scale(SCALES - 1)),
        y: RATES,
        rules: vec![Rule { value: allowed, label: label.clone() }],
        ..with_curves(|kind, index| Some((scale(index), rate(kind, index))))
    };
    let names = DRAWN.map(|(kind, _)| kind_name(kind));
    let curves = names.iter().zip(DRAWN).map(|(name, (_, ink))| (name.as_str(), ink));
    let legend: Vec<_> = curves.chain([(label.as_str(), ALLOWED)]).collect();
    let svg = sheet(&title, &legend, 2, &[rates, b, c, d]);
    let caption = format!(
        "{title}. Each curve is one lag on z2 and one dwell; along it the levels rise from {:.1} to {:.1} of those in the \
         gains. The rate is the upper 95 % bound. The ring is the detector that flies, the thin line the rate that is allowed. Delays \
         are medians in the same air.",
        scale(0),
        scale(SCALES - 1),
    );
    Figure { name: "false-alarms", caption, svg }
}

/// The curve of each drawn detector up to the first level without a point, and the ring of the one that flies.
fn with_curves<'a>(at: impl Fn(usize, usize) -> Option<Point>) -> Panel<'a> {
    let curve = |(kind, ink): (usize, Ink)| {
        Curve::unnamed((0..SCALES).map_while(|index| at(kind, index)).collect(), ink)
    };
    let Shipped { kind, index } = Shipped::find();
    let ring = |at| Symbol { at, shape: Shape::Ring, colour: "#000000", label: String::new() };
    Panel {
        curves: DRAWN.into_iter().map(curve).collect(),
        symbols: at(kind, index).map(ring).into_iter().collect(),
        ..Panel::default()
    }
}
