//! The picture of the limits: a row for each effector, a bar for each set of steady flights.

use super::{Study, Sweep};
use lab_report::chart::drawing::Drawing;
use lab_report::chart::{Figure, Ink, Pattern, WIDTH};

/// Space left of the bars, for names and numbers.
const LEFT: f64 = 230.0;
const RIGHT: f64 = 70.0;
const TOP: f64 = 92.0;
const BAR: f64 = 11.0;
const ROW_GAP: f64 = 18.0;
/// Colours of the sets, in their order; further sets begin again.
const COLOURS: [&str; 6] = ["#1f4e8c", "#3a8f5c", "#b8860b", "#8c3a6b", "#555555", "#a0522d"];

pub fn figure(study: &Study, sweeps: &[Sweep]) -> Figure {
    let airframe = study.airframe();
    let sets = study.sets();
    let mut drawing = Drawing::default();
    let title = format!("Jams of {} that leave a steady flight", airframe.name);
    drawing.text((14.0, 25.0), "start", r#" font-size="20""#, &title);
    let about = "Filled: a tenth of the healthy authority left on every axis. Outline: a steady flight exists. Ends of the line: the travel.";
    drawing.text((14.0, 46.0), "start", "", about);
    let width = (WIDTH - 28.0) / sets.len().max(1) as f64;
    for (place, set) in sets.iter().enumerate() {
        let x = 14.0 + width * place as f64;
        let style = format!(r#"fill="{}""#, COLOURS[place % COLOURS.len()]);
        drawing.rectangle((x, 60.0), (x + 14.0, 71.0), &style, "");
        drawing.text((x + 20.0, 70.0), "start", r#" font-size="11""#, &set.name);
    }
    let mut y = TOP;
    for (effector, name) in study.effectors().into_iter().enumerate() {
        let servo = &airframe.servos[name];
        let range = [servo.min, servo.max].map(|at| study.shown(effector, at));
        let x_of = |at: f64| {
            let part = (at - range[0]) / (range[1] - range[0]);
            LEFT + part * (WIDTH - LEFT - RIGHT)
        };
        let height = BAR * sets.len() as f64;
        let middle = y + 0.5 * height + 4.0;
        drawing.text(
            (14.0, middle),
            "start",
            r#" font-weight="bold""#,
            airframe.effectors.name(name),
        );
        let (_, unit) = airframe.effectors.shown_unit(name, servo.max);
        let labels = range.map(|at| format!("{at:.0}"));
        drawing.text((LEFT - 8.0, middle), "end", "", &labels[0]);
        let last = format!("{} {unit}", labels[1]);
        drawing.text((WIDTH - RIGHT + 8.0, middle), "start", "", &last);
        for set in 0..sets.len() {
            let top = y + BAR * set as f64;
            let colour = COLOURS[set % COLOURS.len()];
            let line = Ink::new("#bbbbbb", Pattern::Solid).wide(1.0);
            let centre = top + 0.5 * BAR;
            drawing.path([(LEFT, centre), (WIDTH - RIGHT, centre)], &line);
            for sweep in sweeps.iter().filter(|s| s.effector == effector && s.set == set) {
                let Some(limits) = sweep.limits else { continue };
                let [low, high] = limits.map(|at| study.shown(effector, at));
                let tip = format!("{}: {low:.1} to {high:.1} {unit}", sets[set].name);
                let style = match sweep.margin {
                    true => format!(r#"fill="{colour}""#),
                    false => format!(r#"fill="{colour}" fill-opacity="0.15" stroke="{colour}""#),
                };
                let corner = (x_of(high), top + BAR - 1.5);
                drawing.rectangle((x_of(low), top + 1.5), corner, &style, &tip);
            }
        }
        y += height + ROW_GAP;
    }
    let caption = "Largest jam of each effector with a steady flight, by set".to_owned();
    Figure { name: "trimmable", caption, svg: drawing.finish((WIDTH, y)) }
}
