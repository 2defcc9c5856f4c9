//! A panel: axes with grid and labels, curves, limits, shades, vertical lines, symbols.

use super::axis::{number, ticks};
use super::curve::{Point, clip};
use super::drawing::{Drawing, LETTER, stroke};
use super::{Ink, Pattern, WIDTH};

/// Space left of the frame, for the labels of the y axis.
pub const LEFT: f64 = 78.0;
/// Space right of the frame.
const RIGHT: f64 = 14.0;
/// Space above the frame, for the title alone.
const TITLE_TOP: f64 = 30.0;
/// Space above the frame: title, legend, numbers of the marks.
const LEGEND_TOP: f64 = 66.0;
/// Where the legend stands.
pub const LEGEND_Y: f64 = 38.0;
/// Space below the frame: labels of the x axis.
const BOTTOM: f64 = 42.0;
/// Numbers of marks stand at least this far apart.
const NUMBER_APART: f64 = 17.0;
/// Lines and shades closer than this are drawn as one.
const APART: f64 = 1.0;
/// Letters of what the mouse shows; a longer text of a damaged log would stand in every drawing.
const TIP_MAX: usize = 200;
/// Half of a symbol's size.
const SYMBOL: f64 = 4.5;
/// Room around a track over the ground, as a factor.
const MAP_ROOM: f64 = 1.25;

#[derive(Debug, Clone)]
pub struct Curve {
    /// Name for the legend above the panel; empty where the sheet has a legend.
    pub name: &'static str,
    pub ink: Ink,
    pub points: Vec<Point>,
}

impl Curve {
    /// A curve that the legend of the sheet names.
    pub const fn unnamed(points: Vec<Point>, ink: Ink) -> Self {
        Self { name: "", ink, points }
    }
}

/// A horizontal line with a name: a limit or a level.
#[derive(Debug, Clone)]
pub struct Rule {
    pub value: f64,
    pub label: String,
}

/// A shaded interval with a name.
#[derive(Debug, Clone)]
pub struct Band {
    /// From and to, in the unit of the x axis.
    pub span: (f64, f64),
    /// Colour as `#rrggbb`.
    pub colour: &'static str,
    /// What is the case there.
    pub label: String,
}

/// A vertical line: an event.
#[derive(Debug, Clone)]
pub struct Mark {
    /// Where on the x axis; s if it is time.
    pub x: f64,
    /// Number in a table of events, if there is one.
    pub number: Option<usize>,
    pub ink: Ink,
    pub label: String,
}

/// What a symbol looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Dot,
    Ring,
    Cross,
}

/// A symbol at a point.
#[derive(Debug, Clone)]
pub struct Symbol {
    pub at: Point,
    /// What it looks like.
    pub shape: Shape,
    /// Colour as `#rrggbb`.
    pub colour: &'static str,
    /// What stands beside it; may be empty.
    pub label: String,
}

#[derive(Debug, Clone)]
pub struct Panel<'a> {
    pub title: String,
    /// What the x axis is, with unit.
    pub x_label: &'static str,
    /// What the values are, with unit; empty for a strip without values.
    pub y_label: &'static str,
    /// First and last value of the x axis.
    pub x: (f64, f64),
    /// Smallest and largest value.
    pub y: (f64, f64),
    /// Height of the frame.
    pub height: f64,
    /// Curves, the last one on top.
    pub curves: Vec<Curve>,
    pub rules: Vec<Rule>,
    pub bands: Vec<Band>,
    pub symbols: Vec<Symbol>,
    pub marks: &'a [Mark],
}

impl Default for Panel<'_> {
    fn default() -> Self {
        Self {
            title: String::new(),
            x_label: "simulation time, s",
            y_label: "",
            x: (0.0, 1.0),
            y: (0.0, 1.0),
            height: 230.0,
            curves: Vec::new(),
            rules: Vec::new(),
            bands: Vec::new(),
            symbols: Vec::new(),
            marks: &[],
        }
    }
}

/// A frame on the page and the values at its edges.
#[derive(Clone, Copy)]
struct PanelFrame {
    x: (f64, f64),
    y: (f64, f64),
    top: f64,
    right: f64,
    bottom: f64,
}

impl PanelFrame {
    fn at_x(&self, x: f64) -> f64 {
        LEFT + (self.right - LEFT) * (x - self.x.0) / (self.x.1 - self.x.0)
    }

    fn at_y(&self, y: f64) -> f64 {
        self.top + (self.bottom - self.top) * (self.y.1 - y) / (self.y.1 - self.y.0)
    }

    fn at(&self, (x, y): Point) -> Point {
        (self.at_x(x), self.at_y(y))
    }

    /// A part of the x axis on the page; `None` outside.
    fn span(&self, (from, to): (f64, f64)) -> Option<(f64, f64)> {
        let (from, to) = (from.max(self.x.0), to.min(self.x.1));
        (from <= to).then(|| (self.at_x(from), self.at_x(to)))
    }
}

impl Panel<'_> {
    /// A panel of the ground around a track of points east and north, km; a kilometre is as long in both directions
    /// where the panel is [`WIDTH`] wide.
    pub fn map(title: &str, height: f64, track: &[Point]) -> Self {
        let bounds = |value: fn(&Point) -> f64| {
            let low = track.iter().map(value).fold(f64::INFINITY, f64::min);
            let high = track.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
            (0.5 * (low + high), (0.5 * (high - low)).max(0.05))
        };
        let ((x, half_x), (y, half_y)) = (bounds(|p| p.0), bounds(|p| p.1));
        let shape = (WIDTH - LEFT - RIGHT) / height;
        let half = MAP_ROOM * half_y.max(half_x / shape);
        Self {
            title: title.to_owned(),
            x_label: "east of the start, km",
            y_label: "north of the start, km",
            x: (x - half * shape, x + half * shape),
            y: (y - half, y + half),
            height,
            ..Self::default()
        }
    }

    /// Height with title and labels.
    pub fn outer_height(&self) -> f64 {
        self.top() + self.height + BOTTOM
    }

    fn top(&self) -> f64 {
        if self.curves.iter().any(|curve| !curve.name.is_empty()) { LEGEND_TOP } else { TITLE_TOP }
    }

    /// Draws it `width` wide with its upper left corner at `corner`.
    pub fn draw(&self, drawing: &mut Drawing, corner: Point, width: f64) {
        let top = self.top();
        let frame = PanelFrame {
            x: self.x,
            y: self.y,
            top,
            right: width - RIGHT,
            bottom: top + self.height,
        };
        drawing.open(corner);
        drawing.text((LEFT, 19.0), "start", r#" font-size="15" font-weight="bold""#, &self.title);
        // Shades first, as the ground of grid and curves.
        let bands = joined(&self.bands, APART * (self.x.1 - self.x.0) / (frame.right - LEFT));
        for band in &bands {
            draw_band(drawing, &frame, band);
        }
        self.draw_axes(drawing, &frame);
        for rule in &self.rules {
            draw_rule(drawing, &frame, rule);
        }
        draw_marks(drawing, &frame, self.marks);
        for curve in &self.curves {
            for piece in clip(&curve.points, self.y.0, self.y.1) {
                drawing.path(piece.into_iter().map(|point| frame.at(point)), &curve.ink);
            }
        }
        // After the curves, which would cover them.
        for band in &bands {
            draw_band_label(drawing, &frame, band);
        }
        draw_symbols(drawing, &frame, &self.symbols);
        // The frame last, over the cut ends of the curves.
        let corners = ((LEFT, frame.top), (frame.right, frame.bottom));
        drawing.rectangle(corners.0, corners.1, r##"fill="none" stroke="#444""##, "");
        drawing.close();
    }

    fn draw_axes(&self, drawing: &mut Drawing, frame: &PanelFrame) {
        const GRID: &str = r##"stroke="#e2e2e2""##;
        let (x_ticks, decimals) = ticks(frame.x);
        for tick in x_ticks {
            let x = frame.at_x(tick);
            drawing.line((x, frame.top), (x, frame.bottom), GRID, "");
            drawing.text((x, frame.bottom + 17.0), "middle", "", &number(tick, decimals));
        }
        if !self.y_label.is_empty() {
            let (y_ticks, decimals) = ticks(frame.y);
            for tick in y_ticks {
                let y = frame.at_y(tick);
                drawing.line((LEFT, y), (frame.right, y), GRID, "");
                drawing.text((LEFT - 6.0, y + 4.0), "end", "", &number(tick, decimals));
            }
        }
        let middle = 0.5 * (LEFT + frame.right);
        drawing.text((middle, frame.bottom + 35.0), "middle", "", self.x_label);
        let (x, y) = (15.0, 0.5 * (frame.top + frame.bottom));
        let turned = format!(r#" transform="rotate(-90 {x:.1} {y:.1})""#);
        drawing.text((x, y), "middle", &turned, self.y_label);
    }
}

fn draw_band(drawing: &mut Drawing, frame: &PanelFrame, band: &Band) {
    let Some((from, to)) = frame.span(band.span) else { return };
    let style = format!(r#"fill="{}" fill-opacity="0.16""#, band.colour);
    // What is short would be too narrow to be seen.
    let right = to.max(from + 1.0);
    drawing.rectangle((from, frame.top), (right, frame.bottom), &style, &band.label);
}

fn draw_band_label(drawing: &mut Drawing, frame: &PanelFrame, band: &Band) {
    let Some((from, to)) = frame.span(band.span) else { return };
    if to - from > LETTER * band.label.chars().count() as f64 + 8.0 {
        // White around the letters keeps them readable above a curve.
        let at = (from + 4.0, frame.top + 15.0);
        let halo = r##" fill="#fff" stroke="#fff" stroke-width="3" stroke-linejoin="round""##;
        drawing.text(at, "start", halo, &band.label);
        drawing.text(at, "start", &format!(r#" fill="{}""#, band.colour), &band.label);
    }
}

/// Draws a limit; its label is on the side of the curves.
fn draw_rule(drawing: &mut Drawing, frame: &PanelFrame, rule: &Rule) {
    if !(frame.y.0..=frame.y.1).contains(&rule.value) {
        return;
    }
    let y = frame.at_y(rule.value);
    let style = r##"stroke="#8a5a00" stroke-dasharray="9 5""##;
    drawing.line((LEFT, y), (frame.right, y), style, "");
    let upper = rule.value >= 0.5 * (frame.y.0 + frame.y.1);
    let y = if upper { y + 14.0 } else { y - 5.0 };
    drawing.text((frame.right - 5.0, y), "end", r##" fill="#8a5a00""##, &rule.label);
}

fn draw_marks(drawing: &mut Drawing, frame: &PanelFrame, marks: &[Mark]) {
    let (mut numbers, mut drawn) = (Vec::new(), Vec::new());
    let is_near = |x: f64, others: &[f64], apart| others.iter().any(|at| (x - at).abs() < apart);
    for mark in marks {
        let Some((x, _)) = frame.span((mark.x, mark.x)) else { continue };
        // A fault that comes and goes a thousand times must not make a thousand lines in one place.
        if is_near(x, &drawn, APART) {
            continue;
        }
        drawn.push(x);
        let tip: String = mark.label.chars().take(TIP_MAX).collect();
        drawing.line((x, frame.top - 4.0), (x, frame.bottom), &stroke(&mark.ink), &tip);
        if let Some(number) = mark.number.filter(|_| !is_near(x, &numbers, NUMBER_APART)) {
            let style = format!(r#" font-size="11" fill="{}""#, mark.ink.colour);
            drawing.text((x, frame.top - 6.0), "middle", &style, &number.to_string());
            numbers.push(x);
        }
    }
}

fn draw_symbols(drawing: &mut Drawing, frame: &PanelFrame, symbols: &[Symbol]) {
    let mut before = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    for symbol in symbols {
        let (x, y) = frame.at(symbol.at);
        if !(frame.top..=frame.bottom).contains(&y) || !(LEFT..=frame.right).contains(&x) {
            continue;
        }
        let line = Ink::new(symbol.colour, Pattern::Solid).wide(2.0);
        match symbol.shape {
            Shape::Dot => {
                let style = format!(r#"fill="{}""#, symbol.colour);
                drawing.circle((x, y), SYMBOL, &style, &symbol.label);
            }
            Shape::Ring => {
                let style = format!(r#"fill="none" {}"#, stroke(&line));
                drawing.circle((x, y), 1.5 * SYMBOL, &style, &symbol.label);
            }
            Shape::Cross => {
                let (far, near) = (1.3 * SYMBOL, -1.3 * SYMBOL);
                for turn in [1.0, -1.0] {
                    drawing.path([(x + near, y + turn * near), (x + far, y + turn * far)], &line);
                }
            }
        }
        if symbol.label.is_empty() {
            continue;
        }
        // Where two labels would cover each other, the second one stands on the other side.
        let is_free = (y - before.1).abs() > 14.0 || (x - before.0).abs() > 140.0;
        let (text_x, anchor) = if is_free { (x + 8.0, "start") } else { (x - 8.0, "end") };
        if is_free {
            before = (x, y);
        }
        let style = format!(r#" fill="{}""#, symbol.colour);
        drawing.text((text_x, y - 6.0), anchor, &style, &symbol.label);
    }
}

/// Shades with the same name and less than `gap` between them become one. Of other shades that would be narrower
/// than `gap` and closer than that to the one before, only the first is left.
fn joined(bands: &[Band], gap: f64) -> Vec<Band> {
    let mut joined: Vec<Band> = Vec::new();
    for band in bands {
        match joined.last_mut() {
            Some(last) if last.label == band.label && band.span.0 - last.span.1 < gap => {
                last.span.1 = last.span.1.max(band.span.1);
            }
            Some(last) if band.span.1 - band.span.0 < gap && band.span.0 - last.span.0 < gap => {}
            _ => joined.push(band.clone()),
        }
    }
    joined
}
