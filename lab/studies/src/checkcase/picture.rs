//! The picture of the comparison: how far each trajectory is from the mean of the core simulators, over their own spread.

use super::reference::{Comparison, Deviation, SPREADS};
use lab_report::chart::drawing::Drawing;
use lab_report::chart::{Figure, WIDTH};

const LEFT: f64 = 190.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 104.0;
const ROW: f64 = 17.0;
/// Space of a case's title.
const TITLE: f64 = 26.0;
const BOTTOM: f64 = 48.0;
/// Decades of the axis; what is nearer or farther stands at its end.
const DECADES: (f64, f64) = (-5.0, 3.0);
/// Groups of quantities, with their names in the picture.
const GROUPS: [(&str, &str); 5] = [
    ("pos", "position"),
    ("vel", "velocity"),
    ("att", "attitude"),
    ("rate", "body rates"),
    ("env", "gravitation and air"),
];
/// Colours of our steps, in their order; further ones begin again.
const COLOURS: [&str; 4] = ["#0050aa", "#d95f02", "#3a8f5c", "#8c3a6b"];
const CORE: &str = r##"fill="none" stroke="#777" stroke-width="1.3""##;
const OTHER: &str = r##"stroke="#999" stroke-width="1.3""##;

/// The unit of a quantity: the spread, or half of what the printed digits resolve.
fn unit(deviation: &Deviation) -> f64 {
    deviation.tolerance / SPREADS
}

fn x_of(value: f64) -> f64 {
    let decade = value.max(1.0e-300).log10().clamp(DECADES.0, DECADES.1);
    LEFT + (decade - DECADES.0) / (DECADES.1 - DECADES.0) * (WIDTH - LEFT - RIGHT)
}

/// The largest of a group's quantities, each in its unit; `None` if the case has none.
fn largest(of: &Comparison, group: &str, error: impl Fn(&Deviation) -> Option<f64>) -> Option<f64> {
    let quantities = of.deviations.iter().filter(|one| one.quantity.group == group);
    quantities.filter_map(|one| error(one).map(|error| error / unit(one))).reduce(f64::max)
}

/// Names of the simulators that a group has, and whether each sets the tolerance.
fn simulators(of: &Comparison, group: &str) -> Vec<(String, bool)> {
    let mut names: Vec<(String, bool)> = Vec::new();
    for one in of.deviations.iter().filter(|one| one.quantity.group == group) {
        for (name, _, is_core) in &one.simulators {
            if !names.iter().any(|(known, _)| known == name) {
                names.push((name.clone(), *is_core));
            }
        }
    }
    names
}

/// Draws the comparisons, case by case in their order.
pub(super) fn figure(comparisons: &[Comparison]) -> Figure {
    let mut drawing = Drawing::default();
    let mut cases: Vec<Vec<&Comparison>> = Vec::new();
    for one in comparisons {
        match cases.last_mut().filter(|last| last[0].case == one.case) {
            Some(last) => last.push(one),
            None => cases.push(vec![one]),
        }
    }
    let has = |case: &[&Comparison], group: &str| {
        case[0].deviations.iter().any(|one| one.quantity.group == group)
    };
    let groups = |case: &[&Comparison]| GROUPS.iter().filter(|(group, _)| has(case, group)).count();
    draw_title(&mut drawing);
    let mut y = TOP;
    for case in &cases {
        y += TITLE;
        draw_frame(&mut drawing, y - 3.0, y + ROW * groups(case) as f64 - 1.0);
        let title = format!("{}  {}", case[0].case, case[0].title);
        drawing.text((14.0, y - 8.0), "start", r#" font-weight="bold""#, &title);
        for (group, name) in GROUPS.iter().filter(|(group, _)| has(case, group)) {
            drawing.text((LEFT - 10.0, y + 8.0), "end", "", name);
            draw_row(&mut drawing, case, group, y + 4.0);
            y += ROW;
        }
    }
    let steps: Vec<f64> =
        cases.first().map_or(Vec::new(), |case| case.iter().map(|one| one.step_ms).collect());
    draw_legend(&mut drawing, &steps);
    draw_labels(&mut drawing, y);
    let caption =
        "Distance of each simulator from the mean of NASA's core simulators, over their spread"
            .to_owned();
    Figure { name: "checkcases", caption, svg: drawing.finish((WIDTH, y + BOTTOM)) }
}

fn draw_title(drawing: &mut Drawing) {
    let title = "Check cases: how far a trajectory is from the mean of NASA's simulators";
    drawing.text((14.0, 25.0), "start", r#" font-size="20""#, title);
    let about = "Largest distance over the whole case, the worst quantity of each group. One is the largest distance of two of NASA's core simulators from each other.";
    drawing.text((14.0, 46.0), "start", "", about);
    let at = (x_of(SPREADS) + 5.0, TOP + TITLE - 8.0);
    drawing.text(at, "start", r##" fill="#8a5a00""##, "allowed: 2");
}

/// The decades of the axis and where they are.
fn decades() -> impl Iterator<Item = (f64, f64)> {
    let count = (DECADES.1 - DECADES.0) as u32;
    (0..=count).map(|n| {
        let decade = DECADES.0 + f64::from(n);
        (decade, x_of(10.0_f64.powf(decade)))
    })
}

/// The frame of one case.
fn draw_frame(drawing: &mut Drawing, top: f64, bottom: f64) {
    let limit = x_of(SPREADS);
    let inside = r##"fill="#3a8f5c" fill-opacity="0.10""##;
    drawing.rectangle((LEFT, top), (limit, bottom), inside, "");
    for (_, x) in decades() {
        drawing.line((x, top), (x, bottom), r##"stroke="#e2e2e2""##, "");
    }
    let style = r##"stroke="#8a5a00" stroke-dasharray="9 5""##;
    drawing.line((limit, top), (limit, bottom), style, "allowed");
    let frame = r##"fill="none" stroke="#444""##;
    drawing.rectangle((LEFT, top), (WIDTH - RIGHT, bottom), frame, "");
}

/// Labels of the axis, below the last frame.
fn draw_labels(drawing: &mut Drawing, bottom: f64) {
    for (decade, x) in decades() {
        let label = match decade {
            d if d == DECADES.0 => format!("\u{2264} 1e{d}"),
            d if d == DECADES.1 => format!("\u{2265} 1e{d}"),
            0.0 => "1".to_owned(),
            d => format!("1e{d}"),
        };
        drawing.text((x, bottom + 17.0), "middle", "", &label);
    }
    let label = "distance from the mean / spread of the core simulators";
    let middle = 0.5 * (LEFT + WIDTH - RIGHT);
    drawing.text((middle, bottom + 37.0), "middle", "", label);
}

fn draw_row(drawing: &mut Drawing, case: &[&Comparison], group: &str, y: f64) {
    for (name, is_core) in simulators(case[0], group) {
        let of = |one: &Deviation| {
            one.simulators.iter().find(|(other, ..)| *other == name).map(|(_, error, _)| *error)
        };
        let Some(value) = largest(case[0], group, of) else { continue };
        let (x, tip) = (x_of(value), format!("NASA's simulator {name}: {value:.2e}"));
        if is_core {
            drawing.circle((x, y), 4.5, CORE, &tip);
        } else {
            cross(drawing, (x, y), &tip);
        }
    }
    for (place, one) in case.iter().enumerate() {
        let Some(value) = largest(one, group, |of| Some(of.error)) else { continue };
        let tip = format!("Two-Step, {} ms: {value:.2e}", one.step_ms);
        dot(drawing, (x_of(value), y), place, &tip);
    }
}

/// A cross, drawn as two lines.
fn cross(drawing: &mut Drawing, (x, y): (f64, f64), tip: &str) {
    for way in [-1.0, 1.0] {
        drawing.line((x - 4.0, y - 4.0 * way), (x + 4.0, y + 4.0 * way), OTHER, tip);
    }
}

/// Our point with the step of this place: the later one is smaller, so that both are seen where they agree.
fn dot(drawing: &mut Drawing, at: (f64, f64), place: usize, tip: &str) {
    let style = format!(r#"fill="{}""#, COLOURS[place % COLOURS.len()]);
    drawing.circle(at, if place == 0 { 4.5 } else { 2.5 }, &style, tip);
}

fn draw_legend(drawing: &mut Drawing, steps: &[f64]) {
    let (mut x, y) = (20.0, 76.0);
    let mut label = |drawing: &mut Drawing, text: &str| {
        drawing.text((x + 12.0, y + 4.5), "start", "", text);
        x += 40.0 + 6.9 * text.chars().count() as f64;
        x
    };
    let mut at = 20.0;
    for (place, step_ms) in steps.iter().enumerate() {
        dot(drawing, (at, y), place, "");
        at = label(drawing, &format!("Two-Step, step {step_ms} ms"));
    }
    drawing.circle((at, y), 4.5, CORE, "");
    at = label(drawing, "NASA, core simulator");
    cross(drawing, (at, y), "");
    label(drawing, "NASA, other simulator");
}
