//! The study as tables, figure and page.

use std::fmt::Write as _;

use flight_control::Gains;
use plant_sim::GradeName;

use super::detectors::{KINDS, SCALES, scale};
use super::flights::{Condition, SEEDS, WAITED_S, Watched};
use super::{ALLOWED_PER_H, GradeStudy, Options, Shipped, bound_per_h, of_kind};
use crate::chart::curve::Point;
use crate::chart::panel::{Curve, Mark, Panel, Rule, Shape, Symbol};
use crate::chart::{Figure, Ink, Pattern, sheet};

/// One row a detector: alarms at each flight condition and together, with the bound.
pub fn alarms_csv(at: &[Condition], study: &[GradeStudy]) -> String {
    let mut text = String::from("sensors,lag_s,dwell_s,level");
    for condition in at {
        // Writing to a string cannot fail, here and below.
        let _ = write!(text, ",alarms_{condition}");
    }
    text += ",alarms,hours,alarms_per_h,bound_95_per_h\n";
    for of_grade in study {
        let all = of_grade.healthy();
        let hours = all.seconds / 3_600.0;
        for (kind, index) in (0..KINDS).flat_map(|kind| (0..SCALES).map(move |i| (kind, i))) {
            let (lag_s, dwell_s) = of_kind(kind);
            let _ = write!(text, "{},{lag_s},{dwell_s},{:.1}", of_grade.grade.key(), scale(index));
            for at in &of_grade.conditions {
                let _ = write!(text, ",{}", at.alarms[kind][index]);
            }
            let alarms = all.alarms[kind][index];
            let _ = writeln!(
                text,
                ",{alarms},{hours:.3},{:.4},{:.4}",
                f64::from(alarms) / hours,
                bound_per_h(alarms, all.seconds)
            );
        }
    }
    text
}

/// One row a detector and fault.
pub fn delays_csv(study: &[GradeStudy]) -> String {
    let mut text = String::from("sensors,fault,lag_s,dwell_s,level,median_s,longest_s\n");
    let all = study.iter().flat_map(|of| of.delays.iter().map(move |delays| (of.grade, delays)));
    for (grade, delays) in all {
        for kind in 0..KINDS {
            let (lag_s, dwell_s) = of_kind(kind);
            for index in 0..SCALES {
                let (median_s, longest_s) =
                    (delays.median_s[kind][index], delays.longest_s[kind][index]);
                let _ = writeln!(
                    text,
                    "{},\"{}\",{lag_s},{dwell_s},{:.1},{median_s:.3},{longest_s:.3}",
                    grade.key(),
                    delays.fault.name,
                    scale(index)
                );
            }
        }
    }
    text
}

/// What matters, in Markdown.
pub fn summary(options: &Options, at: &[Condition], study: &[GradeStudy]) -> String {
    study.iter().map(|of_grade| summary_of(options, at, of_grade)).collect::<Vec<_>>().join("\n")
}

fn summary_of(options: &Options, at: &[Condition], study: &GradeStudy) -> String {
    let Shipped { kind, index } = Shipped::find();
    let all = study.healthy();
    let hours = all.seconds / 3_600.0;
    let alarms = all.alarms[kind][index];
    let bound = bound_per_h(alarms, all.seconds);
    let gains = Gains::REFERENCE.activation;
    let verdict = if bound <= ALLOWED_PER_H { "holds" } else { "is not shown" };
    let mut text = format!(
        "With {} sensors. Levels {}, {}, {} rad/s2 (roll, pitch, yaw) for {} s: {alarms} alarms in {hours:.1} h of healthy flight, {:.0} % of it in \
         manoeuvres,\nturbulence {} m/s, seed {}. Upper 95 % bound {bound:.2} an hour; \"at most {ALLOWED_PER_H} \
         an hour\" {verdict}.\nThe detector that flies, which stays awake until it is released, woke {} times. Aircraft lost: {}.\n\n",
        study.grade.key(),
        gains.level_roll,
        gains.level_pitch,
        gains.level_yaw,
        gains.on_dwell_s,
        100.0 * all.manoeuvring_s / all.seconds,
        options.turbulence_m_s,
        options.seed,
        all.flown,
        all.lost,
    );
    text += "| flight condition | hours | alarms | rms of z2 over its level: roll, pitch, yaw | largest |\n|---|---|---|---|---|\n";
    for (condition, at) in at.iter().zip(&study.conditions) {
        let (rms, largest) = (at.rms(), at.largest);
        let _ = writeln!(
            text,
            "| {} m/s at {} m | {:.1} | {} | {:.3}, {:.3}, {:.3} | {:.2}, {:.2}, {:.2} |",
            condition.airspeed_m_s,
            condition.altitude_m,
            at.seconds / 3_600.0,
            at.alarms[kind][index],
            rms.x,
            rms.y,
            rms.z,
            largest.x,
            largest.y,
            largest.z
        );
    }
    text += &lowest_levels(study);
    let _ = writeln!(
        text,
        "\n| fault, median of {SEEDS} flights in the same air | delay, s | longest |\n|---|---|---|"
    );
    for delays in &study.delays {
        let seconds =
            |s: f64| if s.is_finite() { format!("{s:.3}") } else { format!("over {WAITED_S}") };
        let (median_s, longest_s) = (delays.median_s[kind][index], delays.longest_s[kind][index]);
        let _ = writeln!(
            text,
            "| {} | {} | {} |",
            delays.fault.name,
            seconds(median_s),
            seconds(longest_s)
        );
    }
    text
}

/// For each lag and dwell the lowest level with which the bound is kept, and the delays that follow.
fn lowest_levels(study: &GradeStudy) -> String {
    let all = study.healthy();
    let mut text = String::from(
        "\n| lag, s | dwell, s | lowest level for the bound | alarms | delay of the first fault, s | of the second, s | faults noticed |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for kind in 0..KINDS {
        let (lag_s, dwell_s) = of_kind(kind);
        let keeps =
            |index: &usize| bound_per_h(all.alarms[kind][*index], all.seconds) <= ALLOWED_PER_H;
        let Some(index) = (0..SCALES).find(keeps) else {
            let _ = writeln!(text, "| {lag_s} | {dwell_s} | none | | | | |");
            continue;
        };
        let of =
            |fault: usize| study.delays.get(fault).map_or(f64::NAN, |d| d.median_s[kind][index]);
        let noticed = study.delays.iter().filter(|d| d.longest_s[kind][index].is_finite()).count();
        let _ = writeln!(
            text,
            "| {lag_s} | {dwell_s} | {:.1} | {} | {:.3} | {:.3} | {noticed} of {} |",
            scale(index),
            all.alarms[kind][index],
            of(0),
            of(1),
            study.delays.len()
        );
    }
    text
}

/// Lines of the grades, in the order of [`GradeName::ALL`].
const DRAWN: [Ink; GradeName::ALL.len()] = [
    Ink::new("#0050aa", Pattern::Solid),
    Ink::new("#007d37", Pattern::Dashed),
    Ink::new("#c81e1e", Pattern::Dotted).wide(2.5),
];
/// The faults of the panels, by their place in the list: of the jet the paper's two, and the rudder at 3 deg.
const DRAWN_FAULTS: [(usize, char); 3] = [(0, 'b'), (1, 'c'), (7, 'd')];
/// Rates of the axis, powers of ten an hour.
const RATES: (f64, f64) = (-2.0, 3.0);
/// Delays of the axis, s.
const DELAY_MAX_S: f64 = 0.5;

/// The rate that is allowed.
const ALLOWED: Ink = Ink::new("#8a5a00", Pattern::Dashed).wide(1.0);

/// Rate over level, and delay over rate for three faults: the detector that flies, its levels changed, with each grade of sensors.
pub fn figure(study: &[GradeStudy]) -> Figure {
    let hours = study.iter().map(|of| of.healthy().seconds).fold(0.0, f64::max) / 3_600.0;
    let title = format!("Detection delay over false alarms, {hours:.0} h of healthy flight");
    let Shipped { kind, index: flies } = Shipped::find();
    let rates: Vec<Vec<f64>> = study.iter().map(|of| rates(&of.healthy(), kind)).collect();
    let allowed = libm::log10(ALLOWED_PER_H);
    let label = format!("allowed: {ALLOWED_PER_H} an hour");
    let marks = [Mark { x: allowed, number: None, ink: ALLOWED, label: label.clone() }];
    let inks: Vec<Ink> = study.iter().map(|of| DRAWN[of.grade as usize]).collect();
    let panel = |at: &dyn Fn(usize, usize) -> Option<Point>| {
        let curve = |(place, ink): (usize, &Ink)| {
            Curve::unnamed((0..SCALES).map_while(|index| at(place, index)).collect(), *ink)
        };
        let ring = |at| Symbol { at, shape: Shape::Ring, colour: "#000000", label: String::new() };
        Panel {
            curves: inks.iter().enumerate().map(curve).collect(),
            symbols: (0..inks.len()).filter_map(|place| at(place, flies)).map(ring).collect(),
            ..Panel::default()
        }
    };
    let delays = DRAWN_FAULTS.map(|(fault, letter)| {
        let name = study.first().and_then(|of| of.delays.get(fault)).map_or("", |d| &d.fault.name);
        // Beyond the axis a curve ends; a fault that was not flown has none.
        let at = |place: usize, index: usize| {
            let delay_s = study[place].delays.get(fault)?.median_s[kind][index];
            (delay_s <= DELAY_MAX_S).then(|| (rates[place][index], delay_s))
        };
        Panel {
            title: format!("({letter}) {name}"),
            x_label: "log10 of false alarms an hour",
            y_label: "delay, s",
            x: RATES,
            y: (0.0, DELAY_MAX_S),
            marks: &marks,
            ..panel(&at)
        }
    });
    let [b, c, d] = delays;
    let a = Panel {
        title: "(a) False alarms".to_owned(),
        x_label: "level over the one that flies",
        y_label: "log10 of false alarms an hour",
        x: (scale(0), scale(SCALES - 1)),
        y: RATES,
        rules: vec![Rule { value: allowed, label: label.clone() }],
        ..panel(&|place, index| Some((scale(index), rates[place][index])))
    };
    let curves = study.iter().zip(&inks).map(|(of, ink)| (of.grade.key(), *ink));
    let legend: Vec<_> = curves.chain([(label.as_str(), ALLOWED)]).collect();
    let svg = sheet(&title, &legend, 2, &[a, b, c, d]);
    let caption = format!(
        "{title} with each grade of sensors. Along a curve the levels rise from {:.1} to {:.1} of those that fly, without lag. The \
         rate is the upper 95 % bound. A ring is the detector that flies, the thin line the rate that is allowed. Delays are medians \
         in the same air.",
        scale(0),
        scale(SCALES - 1),
    );
    Figure { name: "false-alarms", caption, svg }
}

/// Logarithm of the bound of the rate, by level.
fn rates(all: &Watched, kind: usize) -> Vec<f64> {
    let of = |index: usize| libm::log10(bound_per_h(all.alarms[kind][index], all.seconds));
    (0..SCALES).map(|index| of(index).clamp(RATES.0, RATES.1)).collect()
}
