//! Curves made fit for a drawing: thinned to what the eye can see, and cut at the frame.

/// Columns of pixels that a curve is thinned to; a panel is about this wide.
const COLUMNS: usize = 700;

/// A point: time in s, value in the unit of the panel.
pub type Point = (f64, f64);

/// Keeps the smallest and the largest value of each pixel column, so that no peak is lost.
///
/// `points` are in the order of time; those outside `from` to `to` are left out.
pub fn thin(points: impl IntoIterator<Item = Point>, from: f64, to: f64) -> Vec<Point> {
    let width = (to - from) / COLUMNS as f64;
    let mut thinned = Vec::new();
    let mut column: Option<PixelColumn> = None;
    for point in points {
        if !(from..=to).contains(&point.0) {
            continue;
        }
        // Between zero and COLUMNS.
        let index = ((point.0 - from) / width) as usize;
        match &mut column {
            Some(column) if column.index == index => column.take(point),
            open => {
                if let Some(full) = open.replace(PixelColumn::new(index, point)) {
                    full.give(&mut thinned);
                }
            }
        }
    }
    if let Some(last) = column {
        last.give(&mut thinned);
        // The curve ends at its last point, also where that is no extreme of its column.
        thinned.extend((last.last != *thinned.last().unwrap_or(&last.first)).then_some(last.last));
    }
    thinned
}

/// One column of pixels.
#[derive(Clone, Copy)]
struct PixelColumn {
    index: usize,
    first: Point,
    last: Point,
    low: Point,
    high: Point,
}

impl PixelColumn {
    fn new(index: usize, point: Point) -> Self {
        Self { index, first: point, last: point, low: point, high: point }
    }

    fn take(&mut self, point: Point) {
        self.last = point;
        if point.1 < self.low.1 {
            self.low = point;
        }
        if point.1 > self.high.1 {
            self.high = point;
        }
    }

    fn give(&self, thinned: &mut Vec<Point>) {
        // In the order of time, or the line would run back.
        let (a, b) =
            if self.low.0 <= self.high.0 { (self.low, self.high) } else { (self.high, self.low) };
        thinned.push(a);
        if b != a {
            thinned.push(b);
        }
    }
}

/// Cuts a curve at `low` and `high` into the pieces between them, which end exactly at the frame.
pub fn clip(points: &[Point], low: f64, high: f64) -> Vec<Vec<Point>> {
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    let mut open = false;
    for pair in points.windows(2) {
        let Some((a, b)) = clip_segment(pair[0], pair[1], low, high) else {
            open = false;
            continue;
        };
        match pieces.last_mut() {
            Some(piece) if open => piece.push(b),
            _ => pieces.push(vec![a, b]),
        }
        // What was cut at its end begins anew where the curve comes back.
        open = b == pair[1];
    }
    pieces
}

/// The part of a segment between `low` and `high`.
fn clip_segment(a: Point, b: Point, low: f64, high: f64) -> Option<(Point, Point)> {
    let inside = |y: f64| (low..=high).contains(&y);
    let both_beyond = (a.1 < low && b.1 < low) || (a.1 > high && b.1 > high);
    // What is no number leaves a gap.
    if both_beyond || !a.1.is_finite() || !b.1.is_finite() {
        return None;
    }
    let cut = |from: Point, to: Point| -> Point {
        // Unchanged to the bit: by this `clip` knows that the piece goes on.
        if inside(from.1) {
            return from;
        }
        let edge = if from.1 > high { high } else { low };
        let share = (edge - from.1) / (to.1 - from.1);
        (from.0 + share * (to.0 - from.0), edge)
    };
    Some((cut(a, b), cut(b, a)))
}

/// An angle that runs on where its measure wraps at half a turn; `turn` is a whole turn in its unit.
pub fn unwrap(points: impl IntoIterator<Item = Point>, turn: f64) -> Vec<Point> {
    let mut last: Option<f64> = None;
    let unwrapped = points.into_iter().map(|(t, angle)| {
        let value = last.map_or(angle, |last| last + libm::remainder(angle - last, turn));
        last = Some(value);
        (t, value)
    });
    unwrapped.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_a_peak_of_a_single_sample() {
        let mut points: Vec<Point> = (0..50_000).map(|k| (f64::from(k) * 0.001, 0.0)).collect();
        points[31_234].1 = 7.0;
        let thinned = thin(points.iter().copied(), 0.0, 50.0);
        assert!(thinned.len() <= 2 * COLUMNS + 2, "{}", thinned.len());
        assert!(thinned.contains(&points[31_234]));
        assert!(thinned.is_sorted_by(|a, b| a.0 <= b.0), "time runs backwards");
        assert_eq!(thinned.last(), points.last());
    }

    #[test]
    fn a_curve_that_leaves_and_returns_becomes_two_pieces_that_end_at_the_frame() {
        let points = [(0.0, 0.0), (1.0, 0.5), (2.0, 3.0), (3.0, 3.0), (4.0, -1.0)];
        let pieces = clip(&points, 0.0, 1.0);
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0], [(0.0, 0.0), (1.0, 0.5), (1.2, 1.0)]);
        assert_eq!(pieces[1], [(3.5, 1.0), (3.75, 0.0)]);
    }

    #[test]
    fn a_curve_inside_the_frame_stays_as_it_is() {
        let points = [(0.0, 0.1), (1.0, 0.9), (2.0, 0.5)];
        assert_eq!(clip(&points, 0.0, 1.0), [points.to_vec()]);
    }

    #[test]
    fn a_heading_runs_on_through_its_wrap() {
        let points = unwrap([(0.0, 170.0), (1.0, -170.0), (2.0, -150.0)], 360.0);
        assert_eq!(points, [(0.0, 170.0), (1.0, 190.0), (2.0, 210.0)]);
    }
}
