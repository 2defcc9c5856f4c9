//! One panel of a figure: axes, curves, marks.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::FigureError;
use super::curve::{Point, clip};

/// Where a panel is drawn.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
/// Axes to draw into.
pub type Chart<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<Scale, Scale>>;

/// A linear axis with labels at round numbers; the library's own choice leaves some out.
pub struct Scale {
    inner: RangedCoordf64,
    ticks: Vec<f64>,
}

impl Ranged for Scale {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.inner.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.inner.range()
    }
}

/// The drawing library's sizes are 1.24 times the size in pixels.
pub const TITLE_SIZE: i32 = 40;
/// Size of axis labels and marks.
pub const LABEL_SIZE: i32 = 30;
/// The family: a viewer's own sans serif, or the one that the rasteriser brings along.
pub const FAMILY: &str = "sans-serif";

/// Text and frame.
pub const DARK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(222, 222, 222);
/// More labels than this on one axis would crowd.
const TICKS_MAX: f64 = 7.0;
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
    /// Short dashes: vertical lines.
    Fine,
}

impl Pattern {
    /// Dash and gap, pixels.
    const fn dashes(self) -> (u32, u32) {
        match self {
            Self::Fine => (4, 6),
            _ => (16, 8),
        }
    }
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

/// A vertical line: something that happened. The legend says what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// When, s.
    pub t_s: f64,
    /// How it looks.
    pub ink: Ink,
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
    /// A curve that ends before the panel does: a cross stands there.
    pub ends: Vec<(Point, Ink)>,
}

impl Panel {
    /// Draws it.
    ///
    /// # Errors
    /// [`FigureError`] with what the drawing library says.
    pub fn draw(&self, area: &Area) -> Result<(), FigureError> {
        let mut chart = open(area, &self.title, ["time, s", &self.y_label], self.x, self.y)?;
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
        for (at, ink) in &self.ends {
            if (self.y.0..=self.y.1).contains(&at.1) {
                chart.draw_series([Cross::new(*at, 11, ink.colour.stroke_width(4))])?;
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
        draw_curve(chart, &[(event.t_s, self.y.0), (event.t_s, self.y.1)], &event.ink)
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

/// Opens a panel: title, axes, grid and labels; `names` are those of the axes.
///
/// # Errors
/// [`FigureError`] with what the drawing library says.
pub fn open<'a, 'b>(
    area: &'b Area<'a>,
    title: &str,
    names: [&str; 2],
    x: (f64, f64),
    y: (f64, f64),
) -> Result<Chart<'a, 'b>, FigureError> {
    let (x_ticks, x_decimals) = ticks(x);
    let (y_ticks, y_decimals) = ticks(y);
    let mut chart = ChartBuilder::on(area)
        .caption(title, text(TITLE_SIZE, DARK))
        .margin_top(10)
        .margin_right(34)
        .margin_left(6)
        .x_label_area_size(76)
        .y_label_area_size(126)
        .build_cartesian_2d(
            Scale { inner: (x.0..x.1).into(), ticks: x_ticks },
            Scale { inner: (y.0..y.1).into(), ticks: y_ticks },
        )?;
    chart
        .configure_mesh()
        .x_desc(names[0])
        .y_desc(names[1])
        .x_label_formatter(&|value| number(*value, x_decimals))
        .y_label_formatter(&|value| number(*value, y_decimals))
        .label_style(text(LABEL_SIZE, DARK))
        .axis_desc_style(text(LABEL_SIZE, DARK))
        .axis_style(DARK.stroke_width(2))
        .bold_line_style(GRID.stroke_width(2))
        .light_line_style(TRANSPARENT)
        .draw()?;
    Ok(chart)
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
        Pattern::Dashed | Pattern::Fine => {
            let (dash, gap) = ink.pattern.dashes();
            chart.draw_series(DashedLineSeries::new(points, dash, gap, style)).map(drop)?;
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
        Pattern::Dashed | Pattern::Fine => {
            let (dash, gap) = ink.pattern.dashes();
            area.draw(&DashedPathElement::new(ends, dash, gap, style))?;
        }
        Pattern::Dotted => {
            let step = i32::try_from(3 * ink.width + 2).unwrap_or(i32::MAX);
            for at in (x..=x + length).step_by(usize::try_from(step).unwrap_or(1)) {
                area.draw(&Circle::new((at, y), ink.width, ink.colour.filled()))?;
            }
        }
    }
    Ok(())
}

/// Labels on an axis: multiples of 1, 2 or 5 times a power of ten, and the decimals that they need.
pub fn ticks((low, high): (f64, f64)) -> (Vec<f64>, usize) {
    let span = (high - low).abs().max(f64::MIN_POSITIVE);
    // At least this far apart, so that there are at most TICKS_MAX.
    let coarse = span / TICKS_MAX;
    let power = libm::pow(10.0, libm::floor(libm::log10(coarse)));
    let step = [1.0, 2.0, 5.0].map(|m| m * power).into_iter().find(|step| *step >= coarse);
    let step = step.unwrap_or(10.0 * power);
    let first = libm::ceil(low / step - 1.0e-9);
    // Counted, not only compared: where the step is below the spacing of the numbers, adding it does not get on.
    let count = (0..=TICKS_MAX as u32).map(|k| (first + f64::from(k)) * step);
    let mut ticks: Vec<f64> = count.take_while(|tick| *tick <= high + 1.0e-9 * step).collect();
    ticks.dedup();
    let decimals = (-libm::floor(libm::log10(step * 1.000_001))).max(0.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small whole number"
    )]
    (ticks, decimals as usize)
}

/// A label; a rounded zero has no sign.
pub fn number(value: f64, decimals: usize) -> String {
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
    fn labels_stand_at_round_numbers_with_the_decimals_that_they_need() {
        let labels = |range| -> Vec<String> {
            let (ticks, decimals) = ticks(range);
            ticks.into_iter().map(|tick| number(tick, decimals)).collect()
        };
        assert_eq!(labels((2.8, 3.8)), ["2.8", "3.0", "3.2", "3.4", "3.6", "3.8"]);
        assert_eq!(labels((0.0, 90.0)), ["0", "20", "40", "60", "80"]);
        assert_eq!(
            labels((-0.03, 0.03)),
            ["-0.03", "-0.02", "-0.01", "0.00", "0.01", "0.02", "0.03"]
        );
        assert_eq!(labels((-2.2, 2.4)), ["-2", "-1", "0", "1", "2"]);
    }

    #[test]
    fn labels_are_few_at_any_two_numbers() {
        let large = 1.0e300_f64;
        for range in [
            (large, large),
            (large, large.next_up()),
            (-large, (-large).next_up()),
            (-f64::MAX, f64::MAX),
            (0.0, f64::MIN_POSITIVE),
            (1.0, 1.0),
            (f64::NAN, 1.0),
            (0.0, f64::INFINITY),
        ] {
            let (ticks, decimals) = ticks(range);
            assert!(ticks.len() <= TICKS_MAX as usize + 1, "{range:?}: {}", ticks.len());
            assert!(decimals <= 400, "{range:?}: {decimals}");
        }
    }
}
