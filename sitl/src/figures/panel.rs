//! One panel of a figure: axes, curves, marks.

use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::FigureError;
use super::curve::{Point, clip};

/// Where a panel is drawn.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Chart<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// The drawing library's sizes are 1.24 times the size in pixels.
pub const TITLE_SIZE: i32 = 40;
/// Size of axis labels and marks.
pub const LABEL_SIZE: i32 = 30;
/// The family: a viewer's own sans serif, or the one that the rasteriser brings along.
pub const FAMILY: &str = "sans-serif";

/// Text and frame.
pub const DARK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(222, 222, 222);
const RULE: RGBColor = RGBColor(120, 120, 120);

/// How a curve looks. The pattern differs too, so that a greyscale print can be read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ink {
    /// Colour.
    pub colour: RGBColor,
    /// Pattern.
    pub pattern: Pattern,
    /// Width, pixels.
    pub width: u32,
}

/// Pattern of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Unbroken.
    Solid,
    /// Long dashes.
    Dashed,
    /// Dots.
    Dotted,
}

/// A curve.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Its points in the order of time.
    pub points: Vec<Point>,
    /// How it looks.
    pub ink: Ink,
}

/// A horizontal line with a name: a limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Where.
    pub value: f64,
    /// What it is.
    pub label: String,
}

/// A vertical line with a name: something that happened.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// When, s.
    pub t_s: f64,
    /// What.
    pub label: String,
    /// Colour.
    pub colour: RGBColor,
    /// The name stands at the bottom of the panel, not at the top.
    pub at_bottom: bool,
}

/// A panel.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Title, with the letter of the paper.
    pub title: String,
    /// What the values are, with unit.
    pub y_label: String,
    /// First and last time, s.
    pub x: (f64, f64),
    /// Smallest and largest value.
    pub y: (f64, f64),
    /// The curves, the last one on top.
    pub curves: Vec<Curve>,
    /// Limits.
    pub rules: Vec<Rule>,
    /// What happened.
    pub events: Vec<Event>,
}

impl Panel {
    /// Draws it.
    ///
    /// # Errors
    /// [`FigureError`] with what the drawing library says.
    pub fn draw(&self, area: &Area) -> Result<(), FigureError> {
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, text(TITLE_SIZE, DARK))
            .margin_top(10)
            .margin_right(34)
            .margin_left(6)
            .x_label_area_size(76)
            .y_label_area_size(126)
            .build_cartesian_2d(self.x.0..self.x.1, self.y.0..self.y.1)?;
        axes(&mut chart, "time, s", &self.y_label, self.x, self.y)?;
        for rule in &self.rules {
            self.rule(&mut chart, rule)?;
        }
        for event in &self.events {
            self.event(&mut chart, event)?;
        }
        for curve in &self.curves {
            for piece in clip(&curve.points, self.y.0, self.y.1) {
                draw_curve(&mut chart, &piece, &curve.ink)?;
            }
        }
        Ok(())
    }

    fn rule(&self, chart: &mut Chart, rule: &Rule) -> Result<(), FigureError> {
        if !(self.y.0..=self.y.1).contains(&rule.value) {
            return Ok(());
        }
        let ends = [(self.x.0, rule.value), (self.x.1, rule.value)];
        chart.draw_series(DashedLineSeries::new(ends, 14, 8, RULE.stroke_width(2)))?;
        // Below an upper limit, above a lower one: on the side of the curves.
        let (v_pos, shift) = if rule.value > 0.0 { (VPos::Top, 6) } else { (VPos::Bottom, -6) };
        let style = text(LABEL_SIZE, RULE).pos(Pos::new(HPos::Right, v_pos));
        let at = EmptyElement::at(ends[1]) + Text::new(rule.label.clone(), (-8, shift), style);
        chart.draw_series([at])?;
        Ok(())
    }

    fn event(&self, chart: &mut Chart, event: &Event) -> Result<(), FigureError> {
        if !(self.x.0..=self.x.1).contains(&event.t_s) {
            return Ok(());
        }
        let ends = [(event.t_s, self.y.0), (event.t_s, self.y.1)];
        chart.draw_series(DashedLineSeries::new(ends, 4, 6, event.colour.stroke_width(2)))?;
        let (end, v_pos, shift) =
            if event.at_bottom { (ends[0], VPos::Bottom, -8) } else { (ends[1], VPos::Top, 6) };
        // Beside the line, on the side with more room.
        let is_late = event.t_s > 0.6 * self.x.1 + 0.4 * self.x.0;
        let (h_pos, aside) = if is_late { (HPos::Right, -10) } else { (HPos::Left, 10) };
        let style = text(LABEL_SIZE, event.colour).pos(Pos::new(h_pos, v_pos));
        let at = EmptyElement::at(end) + Text::new(event.label.clone(), (aside, shift), style);
        chart.draw_series([at])?;
        Ok(())
    }
}

/// Text of a size and colour.
pub fn text(size: i32, colour: RGBColor) -> TextStyle<'static> {
    TextStyle {
        font: FontDesc::from((FAMILY, size)),
        color: colour.to_backend_color(),
        pos: Pos::default(),
    }
}

/// Draws axes, grid and labels.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn axes(
    chart: &mut Chart,
    x_label: &str,
    y_label: &str,
    x: (f64, f64),
    y: (f64, f64),
) -> Result<(), FigureError> {
    let (x_decimals, y_decimals) = (decimals(x), decimals(y));
    chart
        .configure_mesh()
        .x_desc(x_label)
        .y_desc(y_label)
        .x_labels(7)
        .y_labels(7)
        .x_label_formatter(&|value| number(*value, x_decimals))
        .y_label_formatter(&|value| number(*value, y_decimals))
        .label_style(text(LABEL_SIZE, DARK))
        .axis_desc_style(text(LABEL_SIZE, DARK))
        .axis_style(DARK.stroke_width(2))
        .bold_line_style(GRID.stroke_width(2))
        .light_line_style(TRANSPARENT)
        .draw()?;
    Ok(())
}

/// Draws points as a curve; they must lie inside the frame.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn draw_curve(chart: &mut Chart, points: &[Point], ink: &Ink) -> Result<(), FigureError> {
    let style = ink.colour.stroke_width(ink.width);
    let points = points.iter().copied();
    match ink.pattern {
        Pattern::Solid => chart.draw_series(LineSeries::new(points, style)).map(drop)?,
        Pattern::Dashed => {
            chart.draw_series(DashedLineSeries::new(points, 16, 8, style)).map(drop)?;
        }
        Pattern::Dotted => {
            let (radius, colour) = (ink.width, ink.colour);
            let dot = move |at| Circle::new(at, radius, colour.filled());
            // Dots need a line with length: one of a single point has none.
            let series = DottedLineSeries::new(points, 0, 3 * radius + 2, dot);
            chart.draw_series(series).map(drop)?;
        }
    }
    Ok(())
}

/// Draws a short sample of a curve for the legend, from `(x, y)` to the right, in pixels.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn draw_sample(area: &Area, x: i32, y: i32, length: i32, ink: &Ink) -> Result<(), FigureError> {
    let style = ink.colour.stroke_width(ink.width);
    let ends = [(x, y), (x + length, y)];
    match ink.pattern {
        Pattern::Solid => area.draw(&PathElement::new(ends, style))?,
        Pattern::Dashed => area.draw(&DashedPathElement::new(ends, 16, 8, style))?,
        Pattern::Dotted => {
            let step = i32::try_from(3 * ink.width + 2).unwrap_or(i32::MAX);
            for at in (x..=x + length).step_by(usize::try_from(step).unwrap_or(1)) {
                area.draw(&Circle::new((at, y), ink.width, ink.colour.filled()))?;
            }
        }
    }
    Ok(())
}

/// Decimals that seven labels over a range need.
fn decimals((low, high): (f64, f64)) -> usize {
    match (high - low).abs() {
        span if span >= 12.0 => 0,
        span if span >= 1.2 => 1,
        span if span >= 0.12 => 2,
        _ => 3,
    }
}

/// A label; a rounded zero has no sign.
fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_the_decimals_that_tell_them_apart() {
        assert_eq!(number(0.05, decimals((0.0, 0.5))), "0.05");
        assert_eq!(number(20.0, decimals((0.0, 90.0))), "20");
        assert_eq!(number(-0.0, 1), "0.0");
        assert_eq!(number(-1.5, 1), "-1.5");
    }
}
