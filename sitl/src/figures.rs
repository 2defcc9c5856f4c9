//! Figures 4 to 9 of the paper, and the survival curve, as SVG and PNG.

use std::fmt;

use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::paper::cases::Flown;

mod curve;
mod deflections;
mod estimate;
mod panel;
mod raster;
mod response;
mod survive;

pub use survive::survival;

use panel::{DARK, Ink, LABEL_SIZE, Panel, Pattern, TITLE_SIZE, draw_sample, text};

/// Width of a figure, pixels.
const WIDTH: u32 = 1_800;
/// Height of a row of panels, pixels.
const ROW_HEIGHT: u32 = 560;
/// Height of title and legend, pixels.
const HEADER_HEIGHT: u32 = 124;
/// Length of a curve's sample in the legend, pixels.
const SAMPLE: i32 = 80;

/// Flight without fault.
const NO_FAULT: Ink =
    Ink { colour: RGBColor(0, 80, 170), pattern: Pattern::Solid, width: 3 };
/// Flight with the PID only.
const PID_ONLY: Ink =
    Ink { colour: RGBColor(200, 30, 30), pattern: Pattern::Dashed, width: 3 };
/// Flight with the compensator.
const COMPENSATED: Ink =
    Ink { colour: RGBColor(0, 125, 55), pattern: Pattern::Dotted, width: 4 };
/// Vertical lines and names of faults.
const FAULT: RGBColor = RGBColor(70, 70, 70);

/// A drawn figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of its files, without extension.
    pub name: &'static str,
    /// What it shows, in a sentence or two.
    pub caption: String,
    /// The drawing.
    pub svg: String,
}

/// Why a figure could not be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FigureError {
    /// The drawing library.
    #[error("cannot draw a figure: {0}")]
    Drawing(String),
    /// The rasteriser.
    #[error("cannot turn a figure into pixels: {0}")]
    Raster(String),
}

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for FigureError {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Self::Drawing(error.to_string())
    }
}

impl Figure {
    /// The drawing in pixels.
    ///
    /// # Errors
    /// [`FigureError`] if the rasteriser does not understand the drawing.
    pub fn png(&self) -> Result<Vec<u8>, FigureError> {
        raster::png(&self.svg)
    }
}

/// Figures 4 to 9.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn of_the_paper(case1: &Flown, case2: &Flown) -> Result<Vec<Figure>, FigureError> {
    Ok(vec![
        response::figure_4(case1)?,
        estimate::figure("fig5", "Figure 5", case1)?,
        deflections::figure("fig6", "Figure 6", case1)?,
        response::figure_7(case2)?,
        estimate::figure("fig8", "Figure 8", case2)?,
        deflections::figure("fig9", "Figure 9", case2)?,
    ])
}

/// A legend's entry.
struct Entry {
    ink: Ink,
    name: &'static str,
}

/// Draws panels in two columns under a title and a legend.
fn sheet(title: &str, legend: &[Entry], panels: &[Panel]) -> Result<String, FigureError> {
    let rows = panels.len().div_ceil(2);
    let draw = |area: &panel::Area, index: usize| match panels.get(index) {
        Some(panel) => panel.draw(area),
        None => Ok(()),
    };
    framed(title, legend, rows, draw)
}

/// Draws title and legend and hands out `2 * rows` areas below, row by row.
fn framed(
    title: &str,
    legend: &[Entry],
    rows: usize,
    mut draw: impl FnMut(&panel::Area, usize) -> Result<(), FigureError>,
) -> Result<String, FigureError> {
    let height = HEADER_HEIGHT + ROW_HEIGHT * u32::try_from(rows).unwrap_or(1);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        root.fill(&WHITE)?;
        let (header, body) = root.split_vertically(HEADER_HEIGHT);
        draw_header(&header, title, legend)?;
        for (index, area) in body.split_evenly((rows, 2)).iter().enumerate() {
            draw(area, index)?;
        }
        root.present()?;
    }
    Ok(svg)
}

fn draw_header(area: &panel::Area, title: &str, legend: &[Entry]) -> Result<(), FigureError> {
    let title_style = text(TITLE_SIZE + 6, DARK).pos(Pos::new(HPos::Left, VPos::Top));
    area.draw(&Text::new(title.to_owned(), (24, 12), title_style))?;
    let style = text(LABEL_SIZE + 4, DARK).pos(Pos::new(HPos::Left, VPos::Center));
    let width = i32::try_from(WIDTH).unwrap_or(i32::MAX) - 48;
    let step = width / i32::try_from(legend.len().max(3)).unwrap_or(1);
    for (x, entry) in (24..).step_by(usize::try_from(step).unwrap_or(1)).zip(legend) {
        draw_sample(area, x, 92, SAMPLE, &entry.ink)?;
        area.draw(&Text::new(entry.name, (x + SAMPLE + 16, 92), style.clone()))?;
    }
    Ok(())
}

/// A range around values with room above and below, never narrower than `span_min`.
fn range(values: impl Iterator<Item = f64>, span_min: f64) -> (f64, f64) {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return (-0.5 * span_min, 0.5 * span_min);
    }
    let half = (0.5 * (high - low)).max(0.5 * span_min) * 1.16;
    let middle = 0.5 * (low + high);
    (middle - half, middle + half)
}

/// What breaks in a case, for titles.
struct FaultName<'a>(&'a Flown);

impl fmt::Display for FaultName<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let case = &self.0.case;
        match case.setup.plant.faults.first() {
            Some(fault) => {
                let angle = case.jam_rad.to_degrees();
                write!(f, "{} jams at {angle:+.0} deg at {} s", fault.effector, case.fault_s)
            }
            None => f.write_str("no fault"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_has_room_around_the_values_and_never_collapses() {
        let (low, high) = range([1.0, 3.0].into_iter(), 0.5);
        assert!(low < 1.0 && high > 3.0);
        let (low, high) = range([2.0, 2.0].into_iter(), 0.5);
        assert!((high - low - 0.58).abs() < 1.0e-12, "{low} {high}");
        let (low, high) = range(std::iter::empty(), 2.0);
        assert_eq!((low, high), (-1.0, 1.0));
        let (low, high) = range([f64::NAN, 1.0].into_iter(), 2.0);
        assert!(low.is_finite() && high.is_finite());
    }
}
