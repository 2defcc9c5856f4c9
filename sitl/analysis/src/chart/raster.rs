//! SVG to PNG, with the font brought along: a machine may have none.

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

/// Pixels of a PNG for each unit of a drawing.
const SCALE: f32 = 1.7;

/// Why a drawing could not be turned into pixels.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot turn a figure into pixels: {0}")]
pub struct RasterError(String);

/// Family name inside [`epaint_default_fonts::UBUNTU_LIGHT`].
const FONT_FAMILY: &str = "Ubuntu";

/// Draws an SVG into a PNG, on white.
///
/// # Errors
/// [`RasterError`] if the text is not an SVG, or has no size.
pub fn png(svg: &str) -> Result<Vec<u8>, RasterError> {
    let mut options = Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    fonts.set_sans_serif_family(FONT_FAMILY);
    let tree = Tree::from_str(svg, &options).map_err(|e| RasterError(e.to_string()))?;
    let size = tree
        .size()
        .scale_by(SCALE)
        .ok_or_else(|| RasterError("the drawing has no size".to_owned()))?
        .to_int_size();
    let mut pixmap = Pixmap::new(size.width(), size.height())
        .ok_or_else(|| RasterError("the drawing has no size".to_owned()))?;
    pixmap.fill(resvg::tiny_skia::Color::WHITE);
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|e| RasterError(e.to_string()))
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
    fn what_is_not_an_svg_is_refused() {
        assert!(png("not a drawing").is_err());
    }
}
