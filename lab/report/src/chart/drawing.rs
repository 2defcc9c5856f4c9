//! Lines, letters and shapes as SVG text. Writing into a `String` cannot fail, so results are dropped.

use std::fmt::Write as _;

use super::curve::Point;
use super::{Ink, Pattern};

/// About the width of a letter of the usual size.
pub const LETTER: f64 = 6.9;

/// A drawing under construction.
#[derive(Debug, Default)]
pub struct Drawing {
    body: String,
}

impl Drawing {
    /// What follows is drawn with its zero at `(x, y)`, up to [`Self::close`].
    pub fn open(&mut self, (x, y): Point) {
        let _ = write!(self.body, r#"<g transform="translate({x:.1} {y:.1})">"#);
    }

    /// The end of what [`Self::open`] began.
    pub fn close(&mut self) {
        self.body.push_str("</g>");
    }

    /// A text; `anchor` is `start`, `middle` or `end`, `more` are attributes with a space before each.
    pub fn text(&mut self, (x, y): Point, anchor: &str, more: &str, text: &str) {
        let text = escape(text);
        let _ = write!(
            self.body,
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}"{more}>{text}</text>"#
        );
    }

    /// A straight line; `style` are attributes, `tip` is shown to the mouse.
    pub fn line(&mut self, from: Point, to: Point, style: &str, tip: &str) {
        let ((x1, y1), (x2, y2)) = (from, to);
        let shape = format!(r#"line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" {style}"#);
        self.shape(&shape, tip);
    }

    /// A rectangle between two corners; `style` are attributes, `tip` is shown to the mouse.
    pub fn rectangle(&mut self, (x, y): Point, (right, bottom): Point, style: &str, tip: &str) {
        let (width, height) = (right - x, bottom - y);
        let shape = format!(
            r#"rect x="{x:.1}" y="{y:.1}" width="{width:.1}" height="{height:.1}" {style}"#
        );
        self.shape(&shape, tip);
    }

    /// A shape between corners; `style` are attributes, `tip` is shown to the mouse.
    pub fn polygon(&mut self, corners: impl IntoIterator<Item = Point>, style: &str, tip: &str) {
        let corners: Vec<_> = corners.into_iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        self.shape(&format!(r#"polygon points="{}" {style}"#, corners.join(" ")), tip);
    }

    /// A circle; `style` are attributes, `tip` is shown to the mouse.
    pub fn circle(&mut self, (x, y): Point, radius: f64, style: &str, tip: &str) {
        self.shape(&format!(r#"circle cx="{x:.1}" cy="{y:.1}" r="{radius}" {style}"#), tip);
    }

    fn shape(&mut self, shape: &str, tip: &str) {
        let _ = match tip {
            "" => write!(self.body, "<{shape}/>"),
            tip => {
                let name = shape.split(' ').next().unwrap_or_default();
                write!(self.body, "<{shape}><title>{}</title></{name}>", escape(tip))
            }
        };
    }

    /// A curve through points.
    pub fn path(&mut self, points: impl IntoIterator<Item = Point>, ink: &Ink) {
        let mut path = String::new();
        for (index, (x, y)) in points.into_iter().enumerate() {
            let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
        }
        let _ = write!(self.body, r#"<path d="{path}" fill="none" {}/>"#, stroke(ink));
    }

    /// The SVG, of a width and a height.
    pub fn finish(self, (width, height): (f64, f64)) -> String {
        let body = self.body;
        format!(
            r##"<svg width="{width:.0}" height="{height:.0}" viewBox="0 0 {width:.0} {height:.0}" xmlns="http://www.w3.org/2000/svg" font-family="sans-serif" font-size="13" fill="#222"><rect width="{width:.0}" height="{height:.0}" fill="#fff"/>{body}</svg>"##
        )
    }
}

/// Stroke of an ink, as attributes.
pub fn stroke(Ink { colour, pattern, width }: &Ink) -> String {
    let dashes = match pattern {
        Pattern::Solid => String::new(),
        Pattern::Dashed => r#" stroke-dasharray="9 4""#.to_owned(),
        // Round caps make a dot of a dash without length.
        Pattern::Dotted => {
            format!(r#" stroke-linecap="round" stroke-dasharray="0 {:.1}""#, 2.0 * width)
        }
        Pattern::Fine => r#" stroke-dasharray="3 3""#.to_owned(),
    };
    format!(r#"stroke="{colour}" stroke-width="{width}" stroke-linejoin="round"{dashes}"#)
}

fn escape(text: &str) -> String {
    // XML has no control characters, not even written as numbers.
    let text = text.replace(char::is_control, "\u{fffd}");
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
