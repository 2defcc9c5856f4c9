//! Charts: panels of curves over time, over the ground or over anything else, drawn as SVG and turned into PNG.
//!
//! A curve is one path, however many points it has, so that a browser can show the page of a long flight. What the mouse
//! points at shows what it is.

pub mod axis;
pub mod curve;
pub mod drawing;
pub mod panel;
pub mod raster;

use host_io::folder::OutFolder;

use host_io::problem::Problem;

use drawing::{Drawing, LETTER};
use panel::{LEFT, Panel};

/// Width of a drawing; a sheet, a panel of a page and a map are as wide.
pub const WIDTH: f64 = 1_060.0;
/// Height of a sheet's title.
const TITLE_HEIGHT: f64 = 36.0;
/// Height of a line of the legend.
const LEGEND_HEIGHT: f64 = 24.0;
/// Length of a curve's sample in the legend, and the gaps after it and after its name.
const SAMPLE: f64 = 36.0;
const SAMPLE_GAP: f64 = 8.0;
const NAME_GAP: f64 = 24.0;

/// How a curve looks. The pattern differs too, so that a greyscale print can be read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ink {
    /// Colour as `#rrggbb`.
    pub colour: &'static str,
    pub pattern: Pattern,
    /// Width, in the unit of [`WIDTH`].
    pub width: f64,
}

impl Ink {
    /// A curve of the usual width.
    pub const fn new(colour: &'static str, pattern: Pattern) -> Self {
        Self { colour, pattern, width: 1.5 }
    }

    /// The same with another width.
    #[must_use]
    pub const fn wide(self, width: f64) -> Self {
        Self { width, ..self }
    }
}

/// Pattern of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    Solid,
    Dashed,
    Dotted,
    /// Short dashes: vertical lines.
    Fine,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of its files, without extension.
    pub name: &'static str,
    /// What it shows, in a sentence or two.
    pub caption: String,
    pub svg: String,
}

/// Writes a figure into a folder, as SVG and PNG.
pub fn write_figure(folder: &OutFolder, figure: &Figure) -> Result<(), Problem> {
    write_figure_as(folder, figure.name, figure)
}

pub fn write_figure_as(folder: &OutFolder, name: &str, figure: &Figure) -> Result<(), Problem> {
    folder.write(&format!("{name}.svg"), figure.svg.as_bytes())?;
    folder.write(&format!("{name}.png"), &raster::png(&figure.svg)?)
}

/// Draws panels in rows of `columns` under a title and a legend.
pub fn sheet(title: &str, legend: &[(&str, Ink)], columns: usize, panels: &[Panel]) -> String {
    let mut drawing = Drawing::default();
    drawing.text((14.0, 25.0), "start", r#" font-size="20""#, title);
    let lines = draw_legend(&mut drawing, legend, (14.0, TITLE_HEIGHT + 0.5 * LEGEND_HEIGHT));
    let mut y = TITLE_HEIGHT + LEGEND_HEIGHT * f64::from(lines) + 8.0;
    let width = WIDTH / columns as f64;
    for row in panels.chunks(columns) {
        for (column, panel) in row.iter().enumerate() {
            panel.draw(&mut drawing, (width * column as f64, y), width);
        }
        y += row.iter().map(Panel::outer_height).fold(0.0, f64::max);
    }
    drawing.finish((WIDTH, y))
}

/// Draws a panel alone, as wide as a page, with the names of its curves above it.
pub fn single(panel: &Panel) -> String {
    let mut drawing = Drawing::default();
    panel.draw(&mut drawing, (0.0, 0.0), WIDTH);
    let named = panel.curves.iter().filter(|curve| !curve.name.is_empty());
    let named: Vec<_> = named.map(|curve| (curve.name, curve.ink)).collect();
    draw_legend(&mut drawing, &named, (LEFT, panel::LEGEND_Y));
    drawing.finish((WIDTH, panel.outer_height()))
}

/// Draws samples and names from `(x, y)` on; returns the number of lines that they need.
fn draw_legend(drawing: &mut Drawing, legend: &[(&str, Ink)], (x, y): (f64, f64)) -> u32 {
    let places = lay_out(legend, x);
    for ((name, ink), (x, line)) in legend.iter().zip(&places) {
        let (x, y) = (*x, y + LEGEND_HEIGHT * f64::from(*line));
        drawing.path([(x, y), (x + SAMPLE, y)], ink);
        drawing.text((x + SAMPLE + SAMPLE_GAP, y + 4.5), "start", "", name);
    }
    places.last().map_or(0, |(_, line)| line + 1)
}

/// Where each entry of a legend stands: x, and the line from 0 on.
fn lay_out(legend: &[(&str, Ink)], left: f64) -> Vec<(f64, u32)> {
    let (mut x, mut line) = (left, 0);
    let place = |(name, _): &(&str, Ink)| {
        let width = SAMPLE + SAMPLE_GAP + LETTER * name.chars().count() as f64;
        // The first of a line stands there, however long it is.
        if x > left && x + width > WIDTH {
            (x, line) = (left, line + 1);
        }
        let at = (x, line);
        x += width + NAME_GAP;
        at
    };
    legend.iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_that_is_too_long_goes_on_in_the_next_line() {
        let ink = Ink::new("#000000", Pattern::Solid);
        let long = "x".repeat(35);
        let places =
            lay_out(&[(&long, ink), (&long, ink), (&long, ink), (&long, ink), ("x", ink)], 9.0);
        assert_eq!(places.iter().map(|place| place.1).collect::<Vec<_>>(), [0, 0, 0, 1, 1]);
        assert_eq!(places[3].0, 9.0);
    }

    #[test]
    fn panels_of_a_sheet_stand_beside_and_below_each_other_and_become_pixels() {
        let curve = |points: &[(f64, f64)], pattern| panel::Curve {
            name: "",
            ink: Ink::new("#0050aa", pattern),
            points: points.to_vec(),
        };
        let panel = |title: &str, pattern| Panel {
            title: title.to_owned(),
            curves: vec![curve(&[(0.0, 0.0), (1.0, 1.0)], pattern)],
            ..Panel::default()
        };
        let panels = [
            panel("first", Pattern::Solid),
            panel("second", Pattern::Dotted),
            panel("third <&>", Pattern::Dashed),
        ];
        let svg = sheet("a sheet", &[("a curve", Ink::new("#0050aa", Pattern::Fine))], 2, &panels);
        for word in ["a sheet", "a curve", "first", "second", "third &lt;&amp;&gt;"] {
            assert!(svg.contains(word), "{word}");
        }
        assert_eq!(&raster::png(&svg).unwrap()[1..4], b"PNG");
    }
}
