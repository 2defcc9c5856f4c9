//! A flown mission: plan view, altitude, airspeed and bank.

use std::f64::consts::TAU;

use autopilot::event::EventKind;
use autopilot::vehicle::VehicleEvent;
use autopilot::vehicle::geodesy::{Horizon, Site};
use autopilot::vehicle::plan::{self, Action, Plan};
use autopilot::vehicle::{Mode, Place};

use super::{Flown, TrackPoint};
use crate::chart::axis::range;
use crate::chart::curve::{Point, thin};
use crate::chart::panel::{Curve, Mark, Panel, Shape, Symbol};
use crate::chart::{Figure, Ink, Pattern, sheet};

/// Height of the plan view, in the unit of the chart's width.
const MAP_HEIGHT: f64 = 620.0;
/// Points of a drawn circle.
const CIRCLE_POINTS: u32 = 120;
/// A time stands beside the track this often, s.
const CLOCK_S: f64 = 600.0;

const FIRST: Ink = Ink::new("#0050aa", Pattern::Solid).wide(2.0);
const AGAIN: Ink = Ink::new("#c86e00", Pattern::Dashed).wide(2.5);
const HOME: Ink = Ink::new("#007d37", Pattern::Dotted).wide(2.5);
const LEG: Ink = Ink::new("#969696", Pattern::Fine);
const REFERENCE: Ink = Ink::new("#c81e1e", Pattern::Dashed);
const ITEM: Ink = Ink::new("#bebebe", Pattern::Fine).wide(1.0);
/// Colour of a time beside the track.
const CLOCK: &str = "#282828";

/// The plan as drawn: points with their name, legs, circles. East and north, km.
struct Drawn {
    points: Vec<(String, Point)>,
    legs: Vec<[Point; 2]>,
    circles: Vec<(Point, f64)>,
}

/// Draws a mission that began over `start`.
#[must_use]
pub fn figure(plan: &Plan, start: Place, flown: &Flown) -> Figure {
    let legend = [
        ("legs and circles of the plan", LEG),
        ("flown", FIRST),
        ("flown again after the jump", AGAIN),
        ("return and circle at home", HOME),
        ("reference", REFERENCE),
        ("next item begins", ITEM),
    ];
    let begins = flown.events.iter().filter_map(|(t_s, kind)| match kind {
        EventKind::Vehicle(VehicleEvent::PlanItem(item)) => {
            let label = format!("item {item} begins");
            Some(Mark { x: *t_s, number: None, ink: ITEM, label })
        }
        _ => None,
    });
    let marks: Vec<Mark> = begins.collect();
    let [altitude, airspeed, roll] = panels(flown, &marks);
    let panels = [map(plan, start, flown), altitude, airspeed, roll];
    Figure {
        name: "mission",
        caption: "Legs, circles and track of a mission over the ground, with altitude, airspeed and bank over time."
            .to_owned(),
        svg: sheet("A mission: the plan and how it was flown", &legend, 1, &panels),
    }
}

fn map(plan: &Plan, start: Place, flown: &Flown) -> Panel<'static> {
    let horizon = Horizon::at(start);
    let track: Vec<Point> = flown.track.iter().map(|point| east_north(point, &horizon)).collect();
    let drawn = drawn(plan, &horizon, flown);
    let title = "Plan view: numbers are the items of the plan; a turn begins before its point";
    let legs = drawn.legs.iter().map(|leg| (leg.to_vec(), LEG));
    let circles = drawn.circles.iter().map(|(centre, radius)| (ring(*centre, *radius), LEG));
    let curves = legs.chain(circles).chain(parts(flown, &track));
    let symbol = |at, colour, label| Symbol { at, shape: Shape::Dot, colour, label };
    let points = drawn.points.into_iter().map(|(label, at)| symbol(at, REFERENCE.colour, label));
    let mut symbols: Vec<Symbol> = points.collect();
    symbols.push(symbol((0.0, 0.0), REFERENCE.colour, "home".to_owned()));
    let mut clock_s = CLOCK_S;
    for (point, at) in flown.track.iter().zip(&track) {
        if point.t_s >= clock_s {
            symbols.push(symbol(*at, CLOCK, format!("{:.0} min", clock_s / 60.0)));
            clock_s += CLOCK_S;
        }
    }
    Panel {
        curves: curves.map(|(points, ink)| Curve::unnamed(points, ink)).collect(),
        symbols,
        ..Panel::map(title, MAP_HEIGHT, &track)
    }
}

fn east_north(point: &TrackPoint, horizon: &Horizon) -> Point {
    let (north, east) = point.offset_km(horizon);
    (east, north)
}

/// The plan over the ground. A leg joins the points of two items that follow each other.
fn drawn(flight: &Plan, horizon: &Horizon, flown: &Flown) -> Drawn {
    let mut drawn = Drawn { points: Vec::new(), legs: Vec::new(), circles: Vec::new() };
    let at = |place: Place| {
        let offset = horizon.offset(&Site::at(place)) / 1.0e3;
        (offset.y, offset.x)
    };
    let place_of = |action: &Action| match action {
        Action::Waypoint { point, .. } => point.place,
        Action::LoiterUnlimited(plan::Circle { centre, .. })
        | Action::LoiterToAltitude(plan::Circle { centre, .. })
        | Action::LoiterTurns { circle: plan::Circle { centre, .. }, .. }
        | Action::LoiterTime { circle: plan::Circle { centre, .. }, .. } => centre.place,
        _ => None,
    };
    let mut before = None;
    for (number, item) in (0_u16..).zip(&flight.items) {
        let is_leg = matches!(item.action, Action::Waypoint { .. });
        let target = match item.action {
            Action::Jump { to, .. } => flight.items.get(usize::from(to)).map(|item| item.action),
            action => Some(action),
        };
        let Some(place) = target.as_ref().and_then(place_of) else { continue };
        let here = at(place);
        drawn
            .legs
            .extend(before.filter(|_| is_leg || target != Some(item.action)).map(|b| [b, here]));
        if target == Some(item.action) {
            drawn.points.push((name(number, &item.action), here));
            before = is_leg.then_some(here);
            let radius_m = flown
                .track
                .iter()
                .filter(|point| point.item == number && point.mode == Mode::Mission)
                .find_map(|point| point.radius_m);
            drawn.circles.extend(radius_m.map(|radius_m| (here, radius_m / 1.0e3)));
        }
    }
    let home = flown.track.last().and_then(|point| point.radius_m);
    drawn.circles.extend(home.map(|radius_m| ((0.0, 0.0), radius_m / 1.0e3)));
    drawn
}

fn ring(centre: Point, radius_km: f64) -> Vec<Point> {
    let angle = |k: u32| TAU * f64::from(k) / f64::from(CIRCLE_POINTS);
    let point = |k| {
        let (sin, cos) = libm::sincos(angle(k));
        (centre.0 + radius_km * sin, centre.1 + radius_km * cos)
    };
    (0..=CIRCLE_POINTS).map(point).collect()
}

/// The track in pieces: the first time, again after a jump back, and outside of Mission.
fn parts(flown: &Flown, track: &[Point]) -> Vec<(Vec<Point>, Ink)> {
    let mut highest = 0;
    let mut again = false;
    let mut parts: Vec<(Vec<Point>, Ink)> = Vec::new();
    for (point, at) in flown.track.iter().zip(track) {
        again = point.item < highest || (again && point.item == highest);
        highest = highest.max(point.item);
        let ink = match point.mode {
            Mode::Return | Mode::Hold => HOME,
            _ if again => AGAIN,
            _ => FIRST,
        };
        match parts.last_mut() {
            Some((points, last)) if *last == ink => points.push(*at),
            open => {
                let joint = open.and_then(|(points, _)| points.last().copied());
                parts.push((joint.into_iter().chain([*at]).collect(), ink));
            }
        }
    }
    // What is flown twice is drawn above what it covers.
    parts.sort_by_key(|(_, ink)| *ink != FIRST);
    parts
}

/// What an item is, in a few words.
fn name(number: u16, action: &Action) -> String {
    match action {
        Action::LoiterTurns { turns, .. } => format!("{number}: {turns:.0} turn"),
        Action::LoiterTime { seconds, .. } => format!("{number}: {seconds:.0} s"),
        Action::LoiterToAltitude(circle) => match circle.centre.altitude_m {
            Some(altitude_m) => format!("{number}: to {altitude_m:.0} m"),
            None => number.to_string(),
        },
        _ => number.to_string(),
    }
}

fn panels<'a>(flown: &Flown, marks: &'a [Mark]) -> [Panel<'a>; 3] {
    let panel = |value: fn(&TrackPoint) -> [f64; 2], title: &str, y_label, span_min| {
        let end_s = flown.track.last().map_or(1.0, |point| point.t_s);
        let curve = |which: usize, ink| {
            let points = flown.track.iter().map(|point| (point.t_s, value(point)[which]));
            Curve::unnamed(thin(points, 0.0, end_s), ink)
        };
        Panel {
            title: title.to_owned(),
            y_label,
            x: (0.0, end_s),
            y: range(flown.track.iter().flat_map(value), span_min),
            curves: vec![curve(0, FIRST), curve(1, REFERENCE)],
            marks,
            ..Panel::default()
        }
    };
    [
        panel(|p| p.altitude_m, "Altitude", "altitude, m", 100.0),
        panel(|p| p.airspeed_m_s, "True airspeed", "airspeed, m/s", 20.0),
        panel(|p| p.roll_rad.map(f64::to_degrees), "Roll angle (bank)", "phi, deg", 20.0),
    ]
}
