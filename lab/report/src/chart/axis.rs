//! Axes: ranges around values, labels at round numbers.

/// More labels than this on one axis would crowd.
const TICKS_MAX: f64 = 7.0;

/// A range around values with room above and below, never narrower than `span_min`.
pub fn range(values: impl Iterator<Item = f64>, span_min: f64) -> (f64, f64) {
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

/// Labels on an axis: multiples of 1, 2 or 5 times a power of ten, and the decimals that they need.
pub fn ticks((low, high): (f64, f64)) -> (Vec<f64>, usize) {
    let span = (high - low).abs().max(f64::MIN_POSITIVE);
    // At least this far apart, so that there are at most TICKS_MAX.
    let coarse = span / TICKS_MAX;
    let power = libm::pow(10.0, libm::floor(libm::log10(coarse)));
    let step = [1.0, 2.0, 5.0].map(|m| m * power).into_iter().find(|step| *step >= coarse);
    let step = step.unwrap_or(10.0 * power);
    // A label at the very edge must not be lost to rounding.
    let first = libm::ceil(low / step - 1.0e-9);
    // Counted, not only compared: where the step is below the spacing of the numbers, adding it does not get on.
    let count = (0..=TICKS_MAX as u32).map(|k| (first + f64::from(k)) * step);
    let mut ticks: Vec<f64> = count.take_while(|tick| *tick <= high + 1.0e-9 * step).collect();
    ticks.dedup();
    // A step that is a rounding below 0.1 would get a second decimal.
    let decimals = (-libm::floor(libm::log10(step * 1.000_001))).max(0.0);
    // A small whole number.
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
