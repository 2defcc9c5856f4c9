//! Curves over a joint level: for each law the fraction of flights lost, with Wilson's interval, and the quartiles of each named
//! measure over the flights that were kept.

use lab_judges::metrics::wilson_95;
use lab_report::chart::panel::{Curve, Panel};
use lab_report::chart::{Figure, Ink, Pattern, sheet};
use lab_tables::{Table, cells, table};

use crate::plan::Plan;
use crate::results::Results;
use crate::spec::{Meaning, Variable};
use crate::store::RunEnd;

/// Colours of the laws; further ones begin again, with another pattern.
pub(crate) const COLOURS: [&str; 10] = [
    "#1f4e8c", "#b23a1e", "#3a8f5c", "#b8860b", "#8c3a6b", "#555555", "#20a0a0", "#d2691e",
    "#6a5acd", "#808000",
];
const PATTERNS: [Pattern; 3] = [Pattern::Solid, Pattern::Dashed, Pattern::Dotted];
/// Name of the fraction of flights lost.
const LOST: &str = "lost";
/// Height of a panel.
const HEIGHT: f64 = 260.0;
/// The intervals of the laws stand beside each other, within this part of the distance between two levels.
const SPREAD: f64 = 0.3;

/// One quantity over the levels.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    pub name: String,
    pub unit: &'static str,
    /// What its intervals are.
    pub interval: &'static str,
    /// For each law a point at each level.
    pub laws: Vec<Vec<Point>>,
}

/// A quantity of one law at one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub level: f64,
    /// Flights that it is of.
    pub flights: u32,
    /// The value; NaN of none.
    pub value: f64,
    /// Ends of its interval: Wilson's at 95 % for the fraction lost, else the quartiles.
    pub interval: (f64, f64),
}

/// The curves of one aircraft over one joint level.
#[derive(Debug, Clone, PartialEq)]
pub struct Curves {
    /// Place of the aircraft.
    pub airframe: usize,
    /// Name of the level.
    pub joint: String,
    /// What the level is, with its unit.
    pub title: String,
    /// The fraction lost, and the named measures.
    pub quantities: Vec<Quantity>,
}

/// The curves of an aircraft over every joint level.
pub fn of(plan: &Plan, results: &Results, airframe: usize) -> Vec<Curves> {
    let variables = plan.variables().iter().enumerate();
    // Cases have names and no place on an axis.
    let is_level = |v: &Variable| v.meaning == Meaning::Level && v.cases.is_empty();
    let levels = variables.filter(|(_, variable)| is_level(variable));
    levels.map(|(place, _)| over(plan, results, airframe, place)).collect()
}

fn over(plan: &Plan, results: &Results, airframe: usize, place: usize) -> Curves {
    let spec = &plan.file.spec;
    let mut levels: Vec<(f64, Vec<usize>)> = Vec::new();
    for flight in plan.flights_of(airframe) {
        // Every law flies the same values, so the run of the first one has them.
        let run = plan.run(flight as u64 * plan.laws().len() as u64);
        let Some(level) = run.ok().and_then(|run| run.values[place].number()) else { continue };
        match levels.binary_search_by(|(known, _)| known.total_cmp(&level)) {
            Ok(at) => levels[at].1.push(flight),
            Err(at) => levels.insert(at, (level, vec![flight])),
        }
    }
    let quantity = |name: &str, unit, of: &dyn Fn(&[usize], usize) -> Point| {
        let law = |law| {
            let point =
                |(level, flights): &(f64, Vec<usize>)| Point { level: *level, ..of(flights, law) };
            levels.iter().map(point).collect()
        };
        let laws = (0..plan.laws().len()).map(law).collect();
        let interval = if name == LOST { "95 % interval" } else { "quartiles" };
        Quantity { name: name.to_owned(), unit, interval, laws }
    };
    let lost = |flights: &[usize], law: usize| {
        let of = |end| flights.iter().filter(|f| results.end(**f, law) == end).count();
        let [lost, kept] =
            [RunEnd::Lost, RunEnd::Kept].map(|end| u32::try_from(of(end)).unwrap_or(u32::MAX));
        let (low, high) = wilson_95(lost, lost + kept);
        let value = 100.0 * f64::from(lost) / f64::from(lost + kept);
        let interval = (100.0 * low, 100.0 * high);
        Point { level: f64::NAN, flights: lost + kept, value, interval }
    };
    let mut quantities = vec![quantity(LOST, "%", &lost)];
    for (measure, name) in spec.measures.iter().enumerate() {
        let (unit, scale) = plan.shown_unit(name);
        let quartiles = |flights: &[usize], law: usize| {
            let kept = flights.iter().filter(|f| results.end(**f, law) == RunEnd::Kept);
            let mut values: Vec<f64> = kept
                .map(|flight| scale * results.measure(measure, *flight, law))
                .filter(|value| value.is_finite())
                .collect();
            values.sort_by(f64::total_cmp);
            let [low, value, high] = [0.25, 0.5, 0.75].map(|part| quantile(&values, part));
            let flights = u32::try_from(values.len()).unwrap_or(u32::MAX);
            Point { level: f64::NAN, flights, value, interval: (low, high) }
        };
        quantities.push(quantity(name, unit, &quartiles));
    }
    let joint = &plan.variables()[place].key;
    let unit = spec.joint.iter().find(|known| known.name == *joint).map_or("", |j| j.unit.as_str());
    let title = if unit.is_empty() { joint.clone() } else { format!("{joint}, {unit}") };
    Curves { airframe, joint: joint.clone(), title, quantities }
}

/// A quantile of sorted values, linear between two of them; NaN of none.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = part * last as f64;
    // A place in a list.
    let below = at.floor() as usize;
    let above = sorted[(below + 1).min(last)];
    sorted[below] + (at - at.floor()) * (above - sorted[below])
}

pub fn table(plan: &Plan, all: &[Curves]) -> Table {
    let mut table = table!("curves",
        airframe: Text, law: Text, joint: Text, level: Number, quantity: Text, unit: Text,
        flights: Integer, value: Number, low: Number, high: Number);
    for Curves { airframe, joint, quantities, .. } in all {
        let airframe = &plan.aircraft[*airframe].name;
        for Quantity { name, unit, laws, .. } in quantities {
            for (points, law) in laws.iter().zip(plan.laws()) {
                for Point { level, flights, value, interval: (low, high) } in points {
                    let mut row = cells![airframe, law, joint, *level, name, *unit, *flights];
                    let is_there = |value: &f64| (*flights > 0).then_some(*value).into();
                    row.extend([value, low, high].map(is_there));
                    table.rows.push(row);
                }
            }
        }
    }
    table
}

/// The curves as a drawing: a panel for each quantity and level.
pub fn figure(plan: &Plan, all: &[Curves]) -> Figure {
    let laws = plan.laws();
    let ink = |law: usize| {
        let pattern = PATTERNS[law / COLOURS.len() % PATTERNS.len()];
        Ink::new(COLOURS[law % COLOURS.len()], pattern).wide(1.8)
    };
    let legend: Vec<(&str, Ink)> =
        laws.iter().enumerate().map(|(n, name)| (*name, ink(n))).collect();
    let mut panels = Vec::new();
    for curves in all {
        for quantity in &curves.quantities {
            panels.push(panel(curves, quantity, &ink));
        }
    }
    let spec = &plan.file.spec;
    let title = format!("{}: {} flights with each law", spec.name, plan.flights());
    let caption = "Fraction lost with its 95 % interval (Wilson), and medians and quartiles of measures over the flights that were kept".to_owned();
    Figure { name: "curves", caption, svg: sheet(&title, &legend, 2, &panels) }
}

fn panel(curves: &Curves, quantity: &Quantity, ink: &dyn Fn(usize) -> Ink) -> Panel<'static> {
    let points = || quantity.laws.iter().flatten();
    let ends = |of: &dyn Fn(&Point) -> [f64; 2]| {
        let all = points().flat_map(of).filter(|value| value.is_finite());
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let (first, last) = ends(&|point| [point.level; 2]);
    // A single level has no distance to the next.
    let count = quantity.laws.first().map_or(0, Vec::len).max(2) - 1;
    let distance = (last - first).max(1.0e-9) / count as f64;
    let (low, high) = match ends(&|point| [point.interval.0, point.interval.1]) {
        (low, high) if low <= high => (low, high),
        _ => (0.0, 1.0),
    };
    let room = 0.05 * (high - low).max(1.0e-6);
    let mut drawn = Vec::new();
    for (law, points) in quantity.laws.iter().enumerate() {
        let beside = SPREAD * distance * ((law as f64 + 0.5) / quantity.laws.len() as f64 - 0.5);
        let shown = points.iter().filter(|point| point.value.is_finite());
        let ends = |point: &Point| {
            let at = point.level + beside;
            vec![(at, point.interval.0), (at, point.interval.1)]
        };
        let thin = ink(law).wide(1.0);
        drawn.extend(shown.clone().map(|p| Curve { name: "", ink: thin, points: ends(p) }));
        let line = shown.map(|point| (point.level + beside, point.value)).collect();
        drawn.push(Curve { name: "", ink: ink(law), points: line });
    }
    Panel {
        title: format!("{} over {} (bars: {})", quantity.name, curves.title, quantity.interval),
        x_label: "level",
        y_label: quantity.unit,
        x: (first - 0.5 * SPREAD * distance, last + 0.5 * SPREAD * distance),
        y: (low - room, high + room),
        height: HEIGHT,
        curves: drawn,
        ..Panel::default()
    }
}
