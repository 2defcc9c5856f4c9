//! The survivability map: for each effector a row of each law over the angle of the jam, with the physical limit over it.

use std::collections::BTreeMap;

use lab_report::chart::drawing::Drawing;
use lab_report::chart::{Figure, Ink, Pattern, WIDTH, axis};

use crate::limit::{Jams, PhysicsLimits, ROUNDING_DEG, Score};
use crate::plan::Plan;
use crate::results::Results;
use crate::store::RunEnd;

/// Space left of the cells, for names.
const LEFT: f64 = 190.0;
/// Space right of them.
const RIGHT: f64 = 24.0;
/// Height of the row of a law.
const ROW: f64 = 15.0;
/// Height of the bar of a limit.
const BAR: f64 = 7.0;
/// Space for the numbers of an axis, and between effectors.
const AXIS: f64 = 20.0;
const GAP: f64 = 16.0;
/// Colours of lost and kept: distinct for readers with colour blindness, and in grey.
const LOST: [f64; 3] = [178.0, 58.0, 30.0];
const KEPT: [f64; 3] = [168.0, 205.0, 232.0];
/// Sets that are drawn, by key, with the pattern of their lines: the headline, and the flight that was asked for.
const DRAWN: [(&str, Pattern); 2] = [("any", Pattern::Solid), ("straight_level", Pattern::Fine)];

/// Jams of one effector: for each angle the flights.
pub(crate) type Angles = Vec<(f64, Vec<usize>)>;

/// Draws the map of an aircraft.
pub fn figure(
    plan: &Plan,
    results: &Results,
    jams: Jams,
    (airframe, limits): (usize, Option<&PhysicsLimits>),
    scores: &[Score],
) -> Figure {
    let aircraft = &plan.aircraft[airframe];
    let mut drawing = Drawing::default();
    let title = format!("Which law survives which jam: {}", aircraft.name);
    drawing.text((14.0, 25.0), "start", r#" font-size="20""#, &title);
    drawing.text((14.0, 46.0), "start", "", &about(plan, jams, airframe));
    legend(&mut drawing, limits);
    let mut y = 104.0;
    let laws = plan.laws();
    for (effector, angles) in grouped(plan, jams, airframe) {
        let name = shown_name(plan, airframe, &effector);
        let edges = edges(&angles);
        let (Some(first), Some(last)) = (edges.first(), edges.last()) else { continue };
        let range = (*first, *last);
        let x_of = |deg: f64| LEFT + (deg - range.0) / (range.1 - range.0) * (WIDTH - LEFT - RIGHT);
        let style = r#" font-weight="bold""#;
        drawing.text((14.0, y + 11.0), "start", style, &format!("{name} jammed at, deg"));
        y += 16.0;
        let top = y;
        for (law, law_name) in laws.iter().enumerate() {
            drawing.text((LEFT - 8.0, y + ROW - 4.0), "end", r#" font-size="12""#, law_name);
            for (place, (deg, flights)) in angles.iter().enumerate() {
                let (left, right) = (x_of(edges[place]), x_of(edges[place + 1]));
                let kept = flights.iter().filter(|f| results.end(**f, law) == RunEnd::Kept).count();
                let part = kept as f64 / flights.len() as f64;
                let tip = format!(
                    "{law_name}, {name} at {deg:+.1} deg: {kept} of {} kept; run {}",
                    flights.len(),
                    flights[0] * laws.len() + law
                );
                let style = format!(r#"fill="{}""#, colour(part));
                drawing.rectangle((left, y), (right, y + ROW - 2.0), &style, &tip);
            }
            y += ROW;
        }
        if let Some(limits) = limits {
            y = draw_limits(&mut drawing, limits, &effector, (range, &x_of), (top, y));
        }
        let (ticks, decimals) = axis::ticks(range);
        for tick in ticks {
            let x = x_of(tick);
            drawing.line((x, y), (x, y + 4.0), r##"stroke="#222""##, "");
            let number = axis::number(tick, decimals);
            drawing.text((x, y + 16.0), "middle", r#" font-size="11""#, &number);
        }
        y += AXIS + GAP;
    }
    if let Some(limits) = limits {
        y = draw_scores(&mut drawing, plan, limits, scores, y);
    }
    let caption =
        "Share of the flights that each law survives, over the angle of the jam".to_owned();
    Figure { name: "map", caption, svg: drawing.finish((WIDTH, y)) }
}

/// What the flights have in common, and over what a cell counts.
fn about(plan: &Plan, jams: Jams, airframe: usize) -> String {
    let spec = &plan.file.spec;
    let others = plan.variables().iter().enumerate().filter(|(place, _)| jams.is_other(*place));
    let others: Vec<&str> = others.map(|(_, variable)| variable.key.as_str()).collect();
    let over = match (others.is_empty(), spec.samples) {
        (true, 1) => String::new(),
        (true, samples) => format!("; a cell counts {samples} draws"),
        (false, _) => format!("; a cell counts flights over {}", others.join(", ")),
    };
    format!(
        "{}, flights of {} s in scenario {}, {} flights of each law{over}.",
        spec.name,
        spec.duration_s,
        spec.scenario,
        plan.flights_of(airframe).len()
    )
}

fn legend(drawing: &mut Drawing, limits: Option<&PhysicsLimits>) {
    let mut x = 14.0;
    for (part, name) in [(1.0, "all kept"), (0.5, "half lost"), (0.0, "all lost")] {
        let style = format!(r#"fill="{}""#, colour(part));
        drawing.rectangle((x, 60.0), (x + 22.0, 73.0), &style, "");
        drawing.text((x + 28.0, 71.5), "start", "", name);
        x += 110.0;
    }
    let Some(limits) = limits else { return };
    for (key, pattern) in DRAWN {
        let Some(set) = limits.sets.iter().find(|set| set.key == key) else { continue };
        drawing.path([(x, 67.0), (x + 26.0, 67.0)], &ink(pattern));
        let text = format!("limit of physics: {}", set.name);
        drawing.text((x + 32.0, 71.5), "start", "", &text);
        x += 44.0 + 6.6 * text.chars().count() as f64;
    }
}

fn ink(pattern: Pattern) -> Ink {
    Ink::new("#111111", pattern).wide(2.0)
}

/// A line from the lower to the upper limit of each drawn set, and down both ends through the rows of the laws. An end that
/// lies beyond the flown angles is open.
fn draw_limits(
    drawing: &mut Drawing,
    limits: &PhysicsLimits,
    effector: &str,
    (range, x_of): ((f64, f64), &dyn Fn(f64) -> f64),
    (top, mut y): (f64, f64),
) -> f64 {
    for (key, pattern) in DRAWN {
        let Some(set) = limits.sets.iter().position(|set| set.key == key) else { continue };
        if let Some([low, high]) = limits.range_deg(set, false, effector) {
            let at = y + 0.5 * BAR;
            let end = |deg: f64, edge: f64| {
                let x = x_of(if is_flown(deg, range) { deg } else { edge });
                let top = if is_flown(deg, range) { top } else { at };
                [(x, top), (x, at)]
            };
            let ([left, right], [last, top]) = (end(low, range.0), end(high, range.1));
            if low <= range.1 && high >= range.0 {
                drawing.path([left, right, top, last], &ink(pattern));
            }
        }
        y += BAR;
    }
    y + 2.0
}

/// For each law the share of the trimmable jams that it survives, one number for each set.
fn draw_scores(
    drawing: &mut Drawing,
    plan: &Plan,
    limits: &PhysicsLimits,
    scores: &[Score],
    mut y: f64,
) -> f64 {
    let style = r#" font-weight="bold""#;
    let title =
        "Share of the flights that survive, among the jams that leave a steady flight at all, %";
    drawing.text((14.0, y + 12.0), "start", style, title);
    y += 32.0;
    let width = (WIDTH - LEFT - RIGHT) / limits.sets.len().max(1) as f64;
    let x_of = |set: usize| LEFT + width * (set as f64 + 1.0) - 8.0;
    for (place, set) in limits.sets.iter().enumerate() {
        drawing.text((x_of(place), y), "end", r#" font-size="11""#, &set.name);
    }
    y += 18.0;
    for (law, name) in plan.laws().iter().enumerate() {
        drawing.text((LEFT - 8.0, y), "end", r#" font-size="12""#, name);
        for score in scores.iter().filter(|score| score.law == law && !score.margin) {
            let text = score.percent().map_or("-".to_owned(), |percent| format!("{percent:.1}"));
            let is_headline = limits.sets[score.set].key == DRAWN[0].0;
            let style = if is_headline { r#" font-weight="bold""# } else { "" };
            drawing.text((x_of(score.set), y), "end", style, &text);
        }
        y += 18.0;
    }
    y + 6.0
}

/// The flights of each effector, in the order in which they are flown, by angle.
pub(crate) fn grouped(plan: &Plan, jams: Jams, airframe: usize) -> Vec<(String, Angles)> {
    let mut names: Vec<String> = Vec::new();
    // Angles are those of files, so equal ones have equal bits.
    let mut by_effector: BTreeMap<usize, Angles> = BTreeMap::new();
    for flight in plan.flights_of(airframe) {
        let Some((effector, deg)) = jams.jam(plan, flight) else { continue };
        let place = names.iter().position(|name| *name == effector).unwrap_or_else(|| {
            names.push(effector);
            names.len() - 1
        });
        let angles = by_effector.entry(place).or_default();
        match angles.binary_search_by(|(known, _)| known.total_cmp(&deg)) {
            Ok(at) => angles[at].1.push(flight),
            Err(at) => angles.insert(at, (deg, vec![flight])),
        }
    }
    names.into_iter().zip(by_effector.into_values()).collect()
}

/// Ends of the cells of these angles: halfway to the next one; nothing is known beyond the outermost flights.
pub(crate) fn edges(angles: &Angles) -> Vec<f64> {
    match angles[..] {
        [] => Vec::new(),
        [(only, _)] => vec![only - 0.5, only + 0.5],
        [(first, _), .., (last, _)] => {
            let between = angles.windows(2).map(|pair| 0.5 * (pair[0].0 + pair[1].0));
            [first].into_iter().chain(between).chain([last]).collect()
        }
    }
}

/// Whether an angle lies within the flown ones; those of files are rounded.
pub(crate) fn is_flown(deg: f64, (first, last): (f64, f64)) -> bool {
    (first - ROUNDING_DEG..=last + ROUNDING_DEG).contains(&deg)
}

/// Name of an effector for people.
pub(crate) fn shown_name(plan: &Plan, airframe: usize, key: &str) -> String {
    let list = &plan.aircraft[airframe].airframe.effectors;
    list.by_key(key).map_or_else(|| key.to_owned(), |effector| list.name(effector).to_owned())
}

/// Colour of a share of kept flights.
fn colour(kept: f64) -> String {
    let mix = |place: usize| (LOST[place] + kept * (KEPT[place] - LOST[place])).round();
    format!("rgb({},{},{})", mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_reaches_beyond_the_flown_angles() {
        let angles = |all: &[f64]| all.iter().map(|deg| (*deg, Vec::new())).collect();
        assert_eq!(edges(&angles(&[-4.0, 0.0, 2.0])), [-4.0, -2.0, 1.0, 2.0]);
        assert_eq!(edges(&angles(&[3.0])), [2.5, 3.5]);
    }
}
