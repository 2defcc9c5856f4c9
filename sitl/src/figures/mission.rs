//! A flown mission: plan view, altitude, airspeed and bank.

use std::f64::consts::TAU;

use autopilot::event::EventKind;
use autopilot::vehicle::geodesy::{Horizon, Site};
use autopilot::vehicle::plan::{self, Action, Plan};
use autopilot::vehicle::{Mode, Place};
use plotters::element::Circle;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::curve::{Point, clip, thin};
use super::panel::{
    Area, Chart, Curve, DARK, Event, Ink, LABEL_SIZE, Panel, Pattern, TITLE_SIZE, draw_curve, open,
    text,
};
use super::{
    Entry, Figure, FigureError, LEGEND_HEIGHT, MARGIN, ROW_HEIGHT, TITLE_HEIGHT, WIDTH, draw_entry,
    lay_out, range,
};
use crate::mission::{Flown, TrackPoint};

/// Height of the plan view without its axes, pixels, and its width: what the frame leaves.
const MAP_HEIGHT: u32 = 1_100;
const MAP_WIDTH: u32 = WIDTH - 166;
/// Height of title and axis labels of a panel, pixels.
const AXES_HEIGHT: u32 = 140;
/// Room around the track, km.
const ROOM_KM: f64 = 8.0;
/// Points of a drawn circle.
const CIRCLE_POINTS: u32 = 120;
/// A time stands beside the track this often, s.
const CLOCK_S: f64 = 600.0;

const FIRST: Ink = Ink { colour: RGBColor(0, 80, 170), pattern: Pattern::Solid, width: 4 };
const AGAIN: Ink = Ink { colour: RGBColor(200, 110, 0), pattern: Pattern::Dashed, width: 5 };
const HOME: Ink = Ink { colour: RGBColor(0, 125, 55), pattern: Pattern::Dotted, width: 4 };
const LEG: Ink = Ink { colour: RGBColor(150, 150, 150), pattern: Pattern::Fine, width: 3 };
const WANTED: Ink = Ink { colour: RGBColor(200, 30, 30), pattern: Pattern::Dashed, width: 3 };
const ITEM: Ink = Ink { colour: RGBColor(190, 190, 190), pattern: Pattern::Fine, width: 2 };

/// The plan as drawn: points with their name, legs, circles. East and north, km.
struct Drawn {
    points: Vec<(String, Point)>,
    legs: Vec<[Point; 2]>,
    circles: Vec<(Point, f64)>,
}

/// Draws a mission that began over `start`.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn figure(plan: &Plan, start: Place, flown: &Flown) -> Result<Figure, FigureError> {
    let legend = [
        Entry::new(LEG, "legs and circles of the plan"),
        Entry::new(FIRST, "flown"),
        Entry::new(AGAIN, "flown again after the jump"),
        Entry::new(HOME, "return and circle at home"),
        Entry::new(WANTED, "reference"),
        Entry::new(ITEM, "next item begins"),
    ];
    let places = lay_out(&legend);
    let lines = places.last().map_or(1, |(_, line)| line + 1);
    let header = u32::try_from(TITLE_HEIGHT + LEGEND_HEIGHT * lines + 6).unwrap_or(0);
    let map = MAP_HEIGHT + AXES_HEIGHT;
    let mut svg = String::new();
    {
        let height = header + map + 3 * ROW_HEIGHT;
        let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        root.fill(&WHITE)?;
        let (top, rest) = root.split_vertically(header);
        let style = text(TITLE_SIZE + 6, DARK).pos(Pos::new(HPos::Left, VPos::Top));
        top.draw(&Text::new("A mission: the plan and how it was flown", (MARGIN, 12), style))?;
        for (entry, place) in legend.iter().zip(places) {
            draw_entry(&top, entry, place)?;
        }
        let (upper, lower) = rest.split_vertically(map);
        draw_map(&upper, plan, start, flown)?;
        for (area, panel) in lower.split_evenly((3, 1)).iter().zip(panels(flown)) {
            panel.draw(area)?;
        }
        root.present()?;
    }
    let caption =
        "Legs, circles and track of a mission over the ground, with altitude, airspeed and \
                   bank over time."
            .to_owned();
    Ok(Figure { name: "mission", caption, svg })
}

fn draw_map(area: &Area, plan: &Plan, start: Place, flown: &Flown) -> Result<(), FigureError> {
    let horizon = Horizon::at(start);
    let track: Vec<Point> = flown.track.iter().map(|point| east_north(point, &horizon)).collect();
    let (x, y) = frame(&track);
    let drawn = drawn(plan, &horizon, flown);
    let title = "Plan view: numbers are the items of the plan; a turn begins before its point";
    let names = ["east of the start, km", "north of the start, km"];
    let mut chart = open(area, title, names, x, y)?;
    for leg in &drawn.legs {
        draw_curve(&mut chart, leg, &LEG)?;
    }
    for (centre, radius_km) in &drawn.circles {
        draw_curve(&mut chart, &ring(*centre, *radius_km), &LEG)?;
    }
    for (points, ink) in parts(flown, &track) {
        draw_curve(&mut chart, &points, &ink)?;
    }
    for (label, at) in &drawn.points {
        mark(&mut chart, *at, label, POINT)?;
    }
    mark(&mut chart, (0.0, 0.0), "home", START)?;
    let mut clock_s = CLOCK_S;
    for (point, at) in flown.track.iter().zip(&track) {
        if point.t_s >= clock_s {
            mark(&mut chart, *at, &format!("{:.0} min", clock_s / 60.0), CLOCK)?;
            clock_s += CLOCK_S;
        }
    }
    Ok(())
}

fn east_north(point: &TrackPoint, horizon: &Horizon) -> Point {
    let (north, east) = point.offset_km(horizon);
    (east, north)
}

/// A frame around the track in which a kilometre is as long in both directions.
fn frame(track: &[Point]) -> ((f64, f64), (f64, f64)) {
    let bounds = |value: fn(&Point) -> f64| {
        let low = track.iter().map(value).fold(f64::INFINITY, f64::min);
        let high = track.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
        (0.5 * (low + high), 0.5 * (high - low) + ROOM_KM)
    };
    let ((x, half_x), (y, half_y)) = (bounds(|p| p.0), bounds(|p| p.1));
    let shape = f64::from(MAP_WIDTH) / f64::from(MAP_HEIGHT);
    let half = half_y.max(half_x / shape);
    ((x - half * shape, x + half * shape), (y - half, y + half))
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

/// How a dot and its text look.
#[derive(Clone, Copy)]
struct Mark {
    radius: i32,
    colour: RGBColor,
    size: i32,
    /// From the dot to the text, pixels.
    shift: (i32, i32),
    side: HPos,
}

/// A point of the plan.
const POINT: Mark = Mark {
    radius: 9,
    colour: WANTED.colour,
    size: LABEL_SIZE + 2,
    shift: (14, -18),
    side: HPos::Left,
};
/// The start.
const START: Mark = Mark { shift: (-14, 20), side: HPos::Right, ..POINT };
/// A time beside the track.
const CLOCK: Mark =
    Mark { radius: 6, colour: DARK, size: LABEL_SIZE - 4, shift: (-10, 18), side: HPos::Right };

/// A dot with a text.
fn mark(chart: &mut Chart, at: Point, label: &str, mark: Mark) -> Result<(), FigureError> {
    let style = text(mark.size, mark.colour).pos(Pos::new(mark.side, VPos::Center));
    let dot = EmptyElement::at(at)
        + Circle::new((0, 0), mark.radius, mark.colour.filled())
        + Text::new(label.to_owned(), mark.shift, style);
    chart.draw_series([dot])?;
    Ok(())
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

fn panels(flown: &Flown) -> [Panel; 3] {
    let signal = |value: fn(&TrackPoint) -> [f64; 2], title: &str, y_label: &str, span_min: f64| {
        panel(flown, value, title, y_label, span_min)
    };
    [
        signal(|p| p.altitude_m, "Altitude", "altitude, m", 100.0),
        signal(|p| p.airspeed_m_s, "True airspeed", "airspeed, m/s", 20.0),
        signal(|p| p.roll_rad.map(f64::to_degrees), "Roll angle (bank)", "phi, deg", 20.0),
    ]
}

fn panel(
    flown: &Flown,
    value: fn(&TrackPoint) -> [f64; 2],
    title: &str,
    y_label: &str,
    span_min: f64,
) -> Panel {
    let end_s = flown.track.last().map_or(1.0, |point| point.t_s);
    let y = range(flown.track.iter().flat_map(value), span_min);
    let series = |which: usize| {
        let points = flown.track.iter().map(|point| (point.t_s, value(point)[which]));
        let points = thin(points, 0.0, end_s);
        clip(&points, y.0, y.1).into_iter().flatten().collect()
    };
    let curves =
        vec![Curve { points: series(0), ink: FIRST }, Curve { points: series(1), ink: WANTED }];
    let begins = flown.events.iter().filter(|(_, kind)| matches!(kind, EventKind::PlanItem(_)));
    let events = begins.map(|(t_s, _)| Event { t_s: *t_s, ink: ITEM }).collect();
    Panel {
        title: title.to_owned(),
        y_label: y_label.to_owned(),
        x: (0.0, end_s),
        y,
        curves,
        rules: Vec::new(),
        events,
        ends: Vec::new(),
    }
}
