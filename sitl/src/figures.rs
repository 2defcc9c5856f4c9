//! Figures 4 to 9 of the paper, the survival curve, and a flown mission, as SVG and PNG.

use std::fmt;

use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::paper::cases::Flown;

pub(crate) mod curve;
mod deflections;
mod estimate;
mod false_alarms;
mod mission;
pub(crate) mod panel;
pub(crate) mod raster;
mod response;
mod survive;

pub use false_alarms::false_alarms;
pub use mission::figure as mission;
pub use survive::survival;

use panel::{DARK, Event, Ink, LABEL_SIZE, Panel, Pattern, TITLE_SIZE, draw_sample, text};

/// Width of a figure, pixels.
const WIDTH: u32 = 1_800;
/// Height of a row of panels, pixels.
const ROW_HEIGHT: u32 = 560;
/// Height of the title, pixels.
const TITLE_HEIGHT: i32 = 66;
/// Height of a line of the legend, pixels.
const LEGEND_HEIGHT: i32 = 46;
/// Width of a letter of the legend, about, pixels.
const LETTER: i32 = 14;
/// Space around title and legend, pixels.
const MARGIN: i32 = 24;
/// Length of a curve's sample in the legend, pixels.
const SAMPLE: i32 = 80;

/// Flight without fault.
const NO_FAULT: Ink = Ink { colour: RGBColor(0, 80, 170), pattern: Pattern::Solid, width: 3 };
/// Flight with the PID only.
const PID_ONLY: Ink = Ink { colour: RGBColor(200, 30, 30), pattern: Pattern::Dashed, width: 3 };
/// Flight with the compensator.
const COMPENSATED: Ink = Ink { colour: RGBColor(0, 125, 55), pattern: Pattern::Dotted, width: 4 };
/// Vertical line at the fault.
const FAULT: Ink = Ink { colour: RGBColor(70, 70, 70), pattern: Pattern::Fine, width: 3 };
/// Vertical line where the flight with the PID only is lost.
const LOST: Ink = Ink { colour: PID_ONLY.colour, pattern: Pattern::Fine, width: 3 };

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
#[derive(Debug, Clone)]
struct Entry {
    ink: Ink,
    name: String,
}

impl Entry {
    fn new(ink: Ink, name: impl Into<String>) -> Self {
        Self { ink, name: name.into() }
    }

    /// About how wide it is with the gap after it, pixels.
    fn width(&self) -> i32 {
        let letters = i32::try_from(self.name.chars().count()).unwrap_or(i32::MAX / 100);
        SAMPLE + 16 + LETTER * letters + 40
    }
}

/// Where each entry of a legend stands: x in pixels, and the line from 0 on.
fn lay_out(legend: &[Entry]) -> Vec<(i32, i32)> {
    let right = i32::try_from(WIDTH).unwrap_or(i32::MAX) - MARGIN;
    let (mut x, mut line) = (MARGIN, 0);
    let place = |entry: &Entry| {
        if x > MARGIN && x + entry.width() > right {
            (x, line) = (MARGIN, line + 1);
        }
        let at = (x, line);
        x += entry.width();
        at
    };
    legend.iter().map(place).collect()
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
    let places = lay_out(legend);
    let lines = places.last().map_or(0, |(_, line)| line + 1);
    let header_height = u32::try_from(TITLE_HEIGHT + LEGEND_HEIGHT * lines + 6).unwrap_or(0);
    let height = header_height + ROW_HEIGHT * u32::try_from(rows).unwrap_or(1);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        root.fill(&WHITE)?;
        let (header, body) = root.split_vertically(header_height);
        let style = text(TITLE_SIZE + 6, DARK).pos(Pos::new(HPos::Left, VPos::Top));
        header.draw(&Text::new(title.to_owned(), (MARGIN, 12), style))?;
        for (entry, place) in legend.iter().zip(places) {
            draw_entry(&header, entry, place)?;
        }
        for (index, area) in body.split_evenly((rows, 2)).iter().enumerate() {
            draw(area, index)?;
        }
        root.present()?;
    }
    Ok(svg)
}

fn draw_entry(
    header: &panel::Area,
    entry: &Entry,
    (x, line): (i32, i32),
) -> Result<(), FigureError> {
    let y = TITLE_HEIGHT + LEGEND_HEIGHT * line + LEGEND_HEIGHT / 2;
    draw_sample(header, x, y, SAMPLE, &entry.ink)?;
    let style = text(LABEL_SIZE + 2, DARK).pos(Pos::new(HPos::Left, VPos::Center));
    header.draw(&Text::new(entry.name.clone(), (x + SAMPLE + 16, y), style))?;
    Ok(())
}

/// The legend's entry of the vertical line at the fault.
fn fault_entry(flown: &Flown) -> Entry {
    Entry::new(FAULT, format!("fault, at {} s", flown.case.fault_s))
}

/// The vertical line at the fault.
fn fault_event(flown: &Flown) -> Event {
    Event { t_s: flown.case.fault_s, ink: FAULT }
}

/// A range around values with room above and below, never narrower than `span_min`.
pub(crate) fn range(values: impl Iterator<Item = f64>, span_min: f64) -> (f64, f64) {
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
                let name = fault.target.name(&case.setup.plant.airframe.effectors);
                write!(f, "{name} jams at {angle:+.0} deg at {} s", case.fault_s)
            }
            None => f.write_str("no fault"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_that_is_too_long_goes_on_in_the_next_line() {
        let entry = |letters: usize| Entry::new(NO_FAULT, "x".repeat(letters));
        let places = lay_out(&[entry(30), entry(30), entry(30), entry(5)]);
        assert_eq!(places.iter().map(|place| place.1).collect::<Vec<_>>(), [0, 0, 0, 1]);
        assert_eq!(places[3].0, MARGIN);
    }

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
