//! Panels over time, and the ground track, written as SVG. What the mouse points at says what it is.
//!
//! The drawing library of the paper's figures makes an element of each dash; a long noisy flight would become a
//! page that no browser likes. So curves are single paths here.

use std::fmt::Write as _;

use crate::figures::curve::{Point, clip};
use crate::figures::panel::{Ink, Pattern, number, ticks};

/// Width of a drawing.
pub const WIDTH: f64 = 1_060.0;
/// Space left of the frame, for the labels of the y axis.
const LEFT: f64 = 78.0;
/// Space right of the frame.
const RIGHT: f64 = 14.0;
/// Space above the frame: title, legend, numbers of the events.
const TOP: f64 = 66.0;
/// Space below the frame: labels of the x axis.
const BOTTOM: f64 = 42.0;
/// About the width of a letter.
const LETTER: f64 = 6.9;
/// Numbers of events stand at least this far apart.
const NUMBER_APART: f64 = 17.0;
/// Lines and shades closer than this are drawn as one.
const APART: f64 = 1.0;
/// Width of the frame.
pub const FRAME: f64 = WIDTH - LEFT - RIGHT;

/// A curve with a name for the legend.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Name.
    pub name: &'static str,
    /// How it looks.
    pub ink: Ink,
    /// Its points.
    pub points: Vec<Point>,
}

/// A horizontal line with a name: a limit or a level.
#[derive(Debug, Clone)]
pub struct Rule {
    /// Where.
    pub value: f64,
    /// What it is.
    pub label: String,
}

/// A shaded interval with a name.
#[derive(Debug, Clone)]
pub struct Band {
    /// From and to, s.
    pub span: (f64, f64),
    /// Colour as `#rrggbb`.
    pub colour: &'static str,
    /// What is the case there.
    pub label: String,
}

/// A vertical line: something that happened.
#[derive(Debug, Clone)]
pub struct Mark {
    /// When, s.
    pub t_s: f64,
    /// Number in the table.
    pub number: usize,
    /// Colour as `#rrggbb`.
    pub colour: &'static str,
    /// What happened.
    pub label: String,
}

/// A panel over time.
#[derive(Debug, Clone, Default)]
pub struct Panel {
    /// Title.
    pub title: String,
    /// What the values are, with unit; empty for a strip without values.
    pub y_label: &'static str,
    /// Smallest and largest value.
    pub y: (f64, f64),
    /// Height of the frame.
    pub height: f64,
    /// Curves, the last one on top.
    pub curves: Vec<Curve>,
    /// Limits and levels.
    pub rules: Vec<Rule>,
    /// Shaded intervals.
    pub bands: Vec<Band>,
}

/// A frame on the page and the values at its edges.
#[derive(Clone, Copy)]
struct Frame {
    x: (f64, f64),
    y: (f64, f64),
    height: f64,
}

impl Frame {
    fn at_x(&self, x: f64) -> f64 {
        LEFT + FRAME * (x - self.x.0) / (self.x.1 - self.x.0)
    }

    fn at_y(&self, y: f64) -> f64 {
        TOP + self.height * (self.y.1 - y) / (self.y.1 - self.y.0)
    }

    fn bottom(&self) -> f64 {
        TOP + self.height
    }

    /// A part of the x axis in pixels; `None` outside.
    fn span(&self, (from, to): (f64, f64)) -> Option<(f64, f64)> {
        let (from, to) = (from.max(self.x.0), to.min(self.x.1));
        (from <= to).then(|| (self.at_x(from), self.at_x(to)))
    }
}

/// The drawing under construction. Writing into a `String` cannot fail, so results are dropped.
struct Drawing {
    svg: String,
}

impl Drawing {
    fn new(height: f64, title: &str) -> Self {
        let mut drawing = Self { svg: String::new() };
        let _ = write!(
            drawing.svg,
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="13" fill="#222"><rect width="{WIDTH}" height="{height}" fill="#fff"/>"##
        );
        drawing.text((LEFT, 19.0), "start", r#" font-size="15" font-weight="bold""#, title);
        drawing
    }

    fn text(&mut self, (x, y): Point, anchor: &str, more: &str, text: &str) {
        let text = escape(text);
        let _ = write!(
            self.svg,
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}"{more}>{text}</text>"#
        );
    }

    fn line(&mut self, from: Point, to: Point, style: &str) {
        let ((x1, y1), (x2, y2)) = (from, to);
        let _ = write!(
            self.svg,
            r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" {style}/>"#
        );
    }

    fn path(&mut self, points: impl IntoIterator<Item = Point>, ink: &Ink) {
        let mut path = String::new();
        for (index, (x, y)) in points.into_iter().enumerate() {
            let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
        }
        let _ = write!(self.svg, r#"<path d="{path}" fill="none" {}/>"#, stroke(ink));
    }

    /// Grid, labels and frame.
    fn axes(&mut self, frame: &Frame, names: [&str; 2]) {
        const GRID: &str = r##"stroke="#e2e2e2""##;
        let (x_ticks, decimals) = ticks(frame.x);
        for tick in x_ticks {
            let x = frame.at_x(tick);
            self.line((x, TOP), (x, frame.bottom()), GRID);
            self.text((x, frame.bottom() + 17.0), "middle", "", &number(tick, decimals));
        }
        if !names[1].is_empty() {
            let (y_ticks, decimals) = ticks(frame.y);
            for tick in y_ticks {
                let y = frame.at_y(tick);
                self.line((LEFT, y), (LEFT + FRAME, y), GRID);
                self.text((LEFT - 6.0, y + 4.0), "end", "", &number(tick, decimals));
            }
        }
        let middle = LEFT + 0.5 * FRAME;
        self.text((middle, frame.bottom() + 35.0), "middle", "", names[0]);
        let (x, y) = (15.0, TOP + 0.5 * frame.height);
        let turned = format!(r#" transform="rotate(-90 {x:.1} {y:.1})""#);
        self.text((x, y), "middle", &turned, names[1]);
    }

    fn border(&mut self, frame: &Frame) {
        let _ = write!(
            self.svg,
            r##"<rect x="{LEFT}" y="{TOP}" width="{FRAME}" height="{:.1}" fill="none" stroke="#444"/>"##,
            frame.height
        );
    }

    fn band(&mut self, frame: &Frame, band: &Band) {
        let Some((from, to)) = frame.span(band.span) else { return };
        let (width, label) = ((to - from).max(1.0), escape(&band.label));
        let _ = write!(
            self.svg,
            r#"<rect x="{from:.1}" y="{TOP}" width="{width:.1}" height="{:.1}" fill="{}" fill-opacity="0.16"><title>{label}</title></rect>"#,
            frame.height, band.colour
        );
    }

    fn band_label(&mut self, frame: &Frame, band: &Band) {
        let Some((from, to)) = frame.span(band.span) else { return };
        if to - from > LETTER * band.label.chars().count() as f64 + 8.0 {
            // White around the letters keeps them readable above a curve.
            let at = (from + 4.0, TOP + 15.0);
            let halo = r##" fill="#fff" stroke="#fff" stroke-width="3" stroke-linejoin="round""##;
            self.text(at, "start", halo, &band.label);
            self.text(at, "start", &format!(r#" fill="{}""#, band.colour), &band.label);
        }
    }

    /// A limit; the label is on the side of the curves.
    fn rule(&mut self, frame: &Frame, rule: &Rule) {
        if !(frame.y.0..=frame.y.1).contains(&rule.value) {
            return;
        }
        let y = frame.at_y(rule.value);
        let style = r##"stroke="#8a5a00" stroke-dasharray="9 5""##;
        self.line((LEFT, y), (LEFT + FRAME, y), style);
        let upper = rule.value >= 0.5 * (frame.y.0 + frame.y.1);
        let y = if upper { y + 14.0 } else { y - 5.0 };
        self.text((LEFT + FRAME - 5.0, y), "end", r##" fill="#8a5a00""##, &rule.label);
    }

    fn marks(&mut self, frame: &Frame, marks: &[Mark]) {
        let (mut free, mut drawn) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for mark in marks {
            let Some((x, _)) = frame.span((mark.t_s, mark.t_s)) else { continue };
            // A fault that comes and goes a thousand times must not make a thousand lines in one place.
            if x - drawn < APART {
                continue;
            }
            drawn = x;
            let (bottom, label) = (frame.bottom(), escape(&short(&mark.label)));
            let _ = write!(
                self.svg,
                r#"<line x1="{x:.1}" y1="{:.1}" x2="{x:.1}" y2="{bottom:.1}" stroke="{}" stroke-dasharray="3 3"><title>{label}</title></line>"#,
                TOP - 4.0,
                mark.colour
            );
            if x >= free {
                let style = format!(r#" font-size="11" fill="{}""#, mark.colour);
                self.text((x, TOP - 6.0), "middle", &style, &mark.number.to_string());
                free = x + NUMBER_APART;
            }
        }
    }

    fn legend(&mut self, entries: &[(&str, Ink)]) {
        let mut x = LEFT;
        for (name, ink) in entries {
            self.line((x, 38.0), (x + 30.0, 38.0), &stroke(ink));
            self.text((x + 36.0, 42.0), "start", "", name);
            x += 36.0 + LETTER * name.chars().count() as f64 + 22.0;
        }
    }

    fn finish(mut self) -> String {
        self.svg.push_str("</svg>");
        self.svg
    }
}

/// Draws a panel over the times `x`, s.
#[must_use]
pub fn panel(panel: &Panel, x: (f64, f64), marks: &[Mark]) -> String {
    let frame = Frame { x, y: panel.y, height: panel.height };
    let mut drawing = Drawing::new(TOP + panel.height + BOTTOM, &panel.title);
    let bands = joined(&panel.bands, APART * (x.1 - x.0) / FRAME);
    for band in &bands {
        drawing.band(&frame, band);
    }
    drawing.axes(&frame, ["simulation time, s", panel.y_label]);
    for rule in &panel.rules {
        drawing.rule(&frame, rule);
    }
    drawing.marks(&frame, marks);
    for curve in &panel.curves {
        for piece in clip(&curve.points, panel.y.0, panel.y.1) {
            drawing.path(piece.iter().map(|(t, y)| (frame.at_x(*t), frame.at_y(*y))), &curve.ink);
        }
    }
    for band in &bands {
        drawing.band_label(&frame, band);
    }
    drawing.border(&frame);
    let legend: Vec<_> = panel.curves.iter().map(|curve| (curve.name, curve.ink)).collect();
    drawing.legend(&legend);
    drawing.finish()
}

/// Letters of what the mouse shows; a longer text of a damaged log would stand in every drawing.
const LABEL_MAX: usize = 200;

/// A label that is not too long.
fn short(label: &str) -> String {
    label.chars().take(LABEL_MAX).collect()
}

/// Shades with the same name and less than `gap_s` between them become one. Of other shades that would be narrower
/// than `gap_s` and closer than that to the one before, only the first is left.
fn joined(bands: &[Band], gap_s: f64) -> Vec<Band> {
    let mut joined: Vec<Band> = Vec::new();
    for band in bands {
        match joined.last_mut() {
            Some(last) if last.label == band.label && band.span.0 - last.span.1 < gap_s => {
                last.span.1 = last.span.1.max(band.span.1);
            }
            Some(last)
                if band.span.1 - band.span.0 < gap_s && band.span.0 - last.span.0 < gap_s => {}
            _ => joined.push(band.clone()),
        }
    }
    joined
}

/// A place on the ground track.
#[derive(Debug, Clone)]
pub struct Spot {
    /// East and north, km.
    pub at: Point,
    /// Colour as `#rrggbb`.
    pub colour: &'static str,
    /// What is there.
    pub label: String,
}

/// Draws a track over the ground; a kilometre is as long in both directions.
#[must_use]
pub fn map(title: &str, track: &[Point], ink: Ink, spots: &[Spot]) -> String {
    const HEIGHT: f64 = 520.0;
    const ROOM: f64 = 1.25;
    let bounds = |value: fn(&Point) -> f64| {
        let low = track.iter().map(value).fold(f64::INFINITY, f64::min);
        let high = track.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
        (0.5 * (low + high), (0.5 * (high - low)).max(0.05))
    };
    let ((x, half_x), (y, half_y)) = (bounds(|p| p.0), bounds(|p| p.1));
    let shape = FRAME / HEIGHT;
    let half = ROOM * half_y.max(half_x / shape);
    let frame =
        Frame { x: (x - half * shape, x + half * shape), y: (y - half, y + half), height: HEIGHT };
    let mut drawing = Drawing::new(TOP + HEIGHT + BOTTOM, title);
    drawing.axes(&frame, ["east of the start, km", "north of the start, km"]);
    let place = |(x, y): Point| (frame.at_x(x), frame.at_y(y));
    drawing.path(track.iter().copied().map(place), &ink);
    let mut before = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    for spot in spots {
        let ((x, y), label) = (place(spot.at), escape(&spot.label));
        // Where two labels would cover each other, the second one stands on the other side.
        let is_free = (y - before.1).abs() > 14.0 || (x - before.0).abs() > 140.0;
        let (text_x, anchor) = if is_free { (x + 8.0, "start") } else { (x - 8.0, "end") };
        if is_free {
            before = (x, y);
        }
        let _ = write!(
            drawing.svg,
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="4.5" fill="{}"><title>{label}</title></circle>"#,
            spot.colour
        );
        let style = format!(r#" fill="{}""#, spot.colour);
        drawing.text((text_x, y - 6.0), anchor, &style, &spot.label);
    }
    drawing.border(&frame);
    drawing.finish()
}

/// Stroke of an ink.
fn stroke(ink: &Ink) -> String {
    let (r, g, b) = (ink.colour.0, ink.colour.1, ink.colour.2);
    let dashes = match ink.pattern {
        Pattern::Solid => "",
        Pattern::Dashed => r#" stroke-dasharray="8 4""#,
        Pattern::Dotted => r#" stroke-dasharray="2 3""#,
        Pattern::Fine => r#" stroke-dasharray="3 3""#,
    };
    let width = f64::from(ink.width) * 0.5;
    format!(
        r##"stroke="#{r:02x}{g:02x}{b:02x}" stroke-width="{width}" stroke-linejoin="round"{dashes}"##
    )
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
