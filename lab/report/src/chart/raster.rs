//! SVG to PNG, with the font brought along: a machine may have none. Letters become outlines first, so that nothing
//! has to be built that looks for fonts and sets text.

use std::fmt::Write as _;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use ttf_parser::{Face, OutlineBuilder};

use host_io::problem::{At as _, Problem, problem};

/// Pixels of a PNG for each unit of a drawing.
const SCALE: f32 = 1.7;
/// Size of letters without `font-size`, as [`super::drawing::Drawing`] sets it.
const FONT_SIZE: f32 = 13.0;

/// Attributes of a text that its outline has too; the strokes are the white around a label.
const KEPT: [&str; 5] = ["fill", "stroke", "stroke-width", "stroke-linejoin", "transform"];

/// Draws an SVG into a PNG, on white. Its texts are elements as [`super::drawing::Drawing::text`] writes them.
pub fn png(svg: &str) -> Result<Vec<u8>, Problem> {
    const PLACE: &str = "cannot turn a figure into pixels";
    let face = Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0).at(PLACE)?;
    let tree = Tree::from_str(&outline_texts(svg, &face), &Options::default()).at(PLACE)?;
    let size = tree.size().scale_by(SCALE).map(|size| size.to_int_size());
    let pixmap = size.and_then(|size| Pixmap::new(size.width(), size.height()));
    let mut pixmap = pixmap.ok_or_else(|| problem!("{PLACE}: the drawing has no size"))?;
    pixmap.fill(resvg::tiny_skia::Color::WHITE);
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixmap.as_mut());
    pixmap.encode_png().at(PLACE)
}

/// The SVG with a path in the place of each text.
fn outline_texts(svg: &str, face: &Face<'_>) -> String {
    let mut outlined = String::with_capacity(2 * svg.len());
    let mut rest = svg;
    while let Some((before, element)) = rest.split_once("<text ") {
        outlined.push_str(before);
        let Some((attributes, (text, after))) = element
            .split_once('>')
            .and_then(|(attributes, inner)| Some((attributes, inner.split_once("</text>")?)))
        else {
            // The reader of the SVG will say what is wrong with a text without an end.
            rest = element;
            break;
        };
        let path = outline(attributes, text, face);
        let keep = |name| attribute(attributes, name).map(|value| format!(r#" {name}="{value}""#));
        let kept: String = KEPT.into_iter().filter_map(keep).collect();
        let _ = write!(outlined, r#"<path d="{path}"{kept}/>"#);
        rest = after;
    }
    outlined + rest
}

/// Outlines of the letters of one text, in the units of the drawing.
fn outline(attributes: &str, text: &str, face: &Face<'_>) -> String {
    let number = |name, or| {
        attribute(attributes, name).and_then(|value| value.parse::<f32>().ok()).unwrap_or(or)
    };
    let scale = number("font-size", FONT_SIZE) / f32::from(face.units_per_em());
    // `&amp;` last, or `&amp;lt;` would become a bracket.
    let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    let glyphs: Vec<_> = text.chars().filter_map(|letter| face.glyph_index(letter)).collect();
    let advance = |glyph| f32::from(face.glyph_hor_advance(glyph).unwrap_or(0)) * scale;
    let width: f32 = glyphs.iter().map(|glyph| advance(*glyph)).sum();
    let before_anchor = match attribute(attributes, "text-anchor") {
        Some("middle") => 0.5 * width,
        Some("end") => width,
        _ => 0.0,
    };
    let origin = (number("x", 0.0) - before_anchor, number("y", 0.0));
    let mut pen = Pen { origin, scale, path: String::new() };
    for glyph in glyphs {
        face.outline_glyph(glyph, &mut pen);
        pen.origin.0 += advance(glyph);
    }
    pen.path
}

/// The value of an attribute.
fn attribute<'a>(attributes: &'a str, name: &str) -> Option<&'a str> {
    let (_, value) = attributes.split_once(&format!("{name}=\""))?;
    value.split_once('"').map(|(value, _)| value)
}

/// Writes outlines as an SVG path.
struct Pen {
    /// Where the letter begins on its line.
    origin: (f32, f32),
    /// Units of the drawing for each unit of the font.
    scale: f32,
    path: String,
}

impl Pen {
    fn to(&mut self, command: char, points: &[(f32, f32)]) {
        self.path.push(command);
        for (x, y) in points {
            // The font counts upwards, the drawing downwards.
            let (x, y) = (self.origin.0 + x * self.scale, self.origin.1 - y * self.scale);
            let _ = write!(self.path, "{x:.2} {y:.2} ");
        }
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.to('M', &[(x, y)]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.to('L', &[(x, y)]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.to('Q', &[(x1, y1), (x, y)]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.to('C', &[(x1, y1), (x2, y2), (x, y)]);
    }

    fn close(&mut self) {
        self.path.push('Z');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn svg(body: &str) -> String {
        format!(r#"<svg xmlns="http://www.w3.org/2000/svg" width="60" height="20">{body}</svg>"#)
    }

    #[test]
    fn text_leaves_ink_on_a_machine_without_fonts() {
        let text = r#"<text x="2" y="15" font-family="sans-serif" font-size="14">p, q</text>"#;
        let blank = png(&svg("")).unwrap();
        let written = png(&svg(text)).unwrap();
        assert_eq!(&written[1..4], b"PNG");
        assert_ne!(blank, written, "no glyph was drawn");
    }

    #[test]
    fn the_white_around_a_label_is_in_the_pixels_too() {
        let label = |stroke: &str| {
            let below = r##"<rect width="60" height="20" fill="#000"/>"##;
            let text = format!(r##"{below}<text x="2" y="15" fill="#fff"{stroke}>label</text>"##);
            png(&svg(&text)).unwrap()
        };
        assert_ne!(label(""), label(r##" stroke="#fff" stroke-width="3""##));
    }

    #[test]
    fn letters_stand_where_the_text_is_anchored() {
        let face = Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0).unwrap();
        let x_of = |anchor: &str| -> f32 {
            let path =
                outline(&format!(r#"x="50" y="9" text-anchor="{anchor}""#), "I&amp;I", &face);
            path[1..].split(' ').next().unwrap().parse().unwrap()
        };
        let (start, middle, end) = (x_of("start"), x_of("middle"), x_of("end"));
        assert!(50.0 < start && start < 53.0, "{start}");
        assert!((start - middle - (middle - end)).abs() < 0.03, "{start} {middle} {end}");
        assert!(start - end > 10.0, "three letters are wider: {end}");
    }

    #[test]
    fn a_file_that_is_not_an_svg_is_refused() {
        assert!(png("not a drawing").is_err());
    }
}
