//! Measures of signals, each defined once. When an aircraft is lost stands in its airframe file.
//!
//! Angles in rad, times in s. Every function is total: no values give NaN unless the doc has something else, and a
//! NaN in a signal comes out as NaN. A NaN passes no limit, so neither can hide a failure.

/// Quantile of the normal distribution for a two-sided interval of 95 %.
const NORMAL_95: f64 = 1.959_963_984_540_054;

pub fn max(values: impl IntoIterator<Item = f64>) -> f64 {
    // `f64::max` would drop a NaN, and with it a failure.
    let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
    values.into_iter().reduce(larger).unwrap_or(f64::NAN)
}

pub fn min(values: impl IntoIterator<Item = f64>) -> f64 {
    let smaller = |a: f64, b: f64| if b < a || b.is_nan() { b } else { a };
    values.into_iter().reduce(smaller).unwrap_or(f64::NAN)
}

pub fn max_abs(values: impl IntoIterator<Item = f64>) -> f64 {
    max(values.into_iter().map(f64::abs))
}

pub fn peak_to_peak(values: impl IntoIterator<Item = f64> + Clone) -> f64 {
    max(values.clone()) - min(values)
}

pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / count
}

/// Root of the mean square.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    mean(values.into_iter().map(|v| v * v)).sqrt()
}

/// The value below which this part of the values lies: the nearest one, without interpolation; NaN of none.
pub fn quantile(mut values: Vec<f64>, part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    // A place in a list.
    let place = libm::round(part * values.len().saturating_sub(1) as f64) as usize;
    values.get(place).copied().unwrap_or(f64::NAN)
}

/// Total way travelled, the integral of the magnitude of the rate, in the unit of the signal;
/// zero for no values.
pub fn travel(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut last = None;
    values.into_iter().fold(0.0, |sum, value| {
        let step = last.map_or(0.0, |last: f64| (value - last).abs());
        last = Some(value);
        sum + step
    })
}

/// How far a signal falls below the largest value that it had before; zero for one that only rises.
pub fn drop_below_running_max(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut highest = f64::NEG_INFINITY;
    max(values.into_iter().map(|value| {
        highest = highest.max(value);
        highest - value
    }))
}

/// Change of an angle from the first to the last value, rad, followed through its wraps;
/// zero for no values.
///
/// Right as long as the angle moves by less than half a turn between values.
pub fn turned(angles: impl IntoIterator<Item = f64>) -> f64 {
    let mut last = None;
    angles.into_iter().fold(0.0, |sum, angle| {
        let step = last.map_or(0.0, |last: f64| wrap(angle - last));
        last = Some(angle);
        sum + step
    })
}

/// The same angle in [-pi, pi].
pub fn wrap(angle_rad: f64) -> f64 {
    // Inside it already: the remainder would be the same number.
    if angle_rad.abs() <= std::f64::consts::PI {
        return angle_rad;
    }
    libm::remainder(angle_rad, 2.0 * std::f64::consts::PI)
}

/// Fraction of the values for which `holds` is true.
pub fn fraction(values: impl IntoIterator<Item = f64>, holds: impl Fn(f64) -> bool) -> f64 {
    mean(values.into_iter().map(|value| f64::from(u8::from(holds(value)))))
}

/// Wilson's 95 % interval of a probability, from `hits` in `of` draws; (0, 1) for no draws.
pub fn wilson_95(hits: u32, of: u32) -> (f64, f64) {
    if of == 0 {
        return (0.0, 1.0);
    }
    let (n, share) = (f64::from(of), f64::from(hits) / f64::from(of));
    let z2 = NORMAL_95 * NORMAL_95;
    let centre = share + z2 / (2.0 * n);
    let half = NORMAL_95 * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    let scale = 1.0 + z2 / n;
    (((centre - half) / scale).max(0.0), ((centre + half) / scale).min(1.0))
}

/// One-sided 95 % upper bound of a mean count, from `events` counted: Poisson.
///
/// It is the mean for which so few events or fewer have a probability of 5 %, which is half the 95 % quantile of the
/// chi-square distribution with 2 (events + 1) degrees of freedom.
pub fn upper_95(events: f64) -> f64 {
    // In logarithms, so that large means do not underflow.
    let at_most = |mean: f64| {
        let (mut logarithm, mut sum, mut k) = (-mean, libm::exp(-mean), 1.0);
        while k <= events {
            logarithm += libm::log(mean / k);
            sum += libm::exp(logarithm);
            k += 1.0;
        }
        sum
    };
    let (mut low, mut high) = (events, events + 10.0 + 5.0 * events.sqrt());
    // Each step halves the interval; sixty of them reach the last bit.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_most(middle) > 0.05 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::units::DEG;
    use std::f64::consts::PI;

    #[test]
    fn a_nan_in_a_signal_and_a_signal_without_values_are_never_hidden() {
        for signal in [vec![1.0, f64::NAN, 0.5], vec![f64::NAN, 1.0], vec![]] {
            let measures: [fn(Vec<f64>) -> f64; 6] = [max, min, max_abs, peak_to_peak, mean, rms];
            for (number, measure) in measures.iter().enumerate() {
                assert!(measure(signal.clone()).is_nan(), "measure {number} of {signal:?}");
            }
        }
    }

    #[test]
    fn measures_of_a_sine_are_those_of_the_textbook() {
        let sine = || (0..10_000).map(|k| 2.0 * libm::sin(2.0 * PI * f64::from(k) / 1_000.0));
        // Ten whole periods: sums over whole periods are exact to rounding.
        assert!((rms(sine()) - 2.0_f64.sqrt()).abs() < 1.0e-12, "{}", rms(sine()));
        assert!(mean(sine()).abs() < 1.0e-12);
        assert!((peak_to_peak(sine()) - 4.0).abs() < 1.0e-12);
        // Four amplitudes a period, less the last sample, which is one step short.
        assert!((travel(sine()) - 80.0).abs() < 0.02, "{}", travel(sine()));
    }

    #[test]
    fn quantiles_are_the_nearest_values() {
        let values = vec![5.0, 1.0, 4.0, 2.0, 3.0];
        assert_eq!([0.25, 0.5, 0.75].map(|part| quantile(values.clone(), part)), [2.0, 3.0, 4.0]);
        assert!(quantile(vec![], 0.5).is_nan());
    }

    #[test]
    fn the_drop_is_measured_from_the_highest_value_so_far() {
        assert_eq!(drop_below_running_max([0.0, 1.0, 2.0]), 0.0);
        assert_eq!(drop_below_running_max([0.0, 5.0, 3.0, 4.0, 6.0, 5.5]), 2.0);
    }

    #[test]
    fn a_turn_is_followed_through_the_wrap() {
        let degrees = [170.0, 179.0, -172.0, -163.0];
        let turn = turned(degrees.map(|d: f64| d * DEG));
        assert!((turn - 27.0 * DEG).abs() < 1.0e-12, "{turn} rad");
    }

    #[test]
    fn an_angle_that_needs_no_wrap_keeps_its_bits() {
        for angle in [0.0, -0.0, 1.0, -3.0, PI, -PI, PI + 1e-9, 2.0 * PI, -7.0, f64::NAN] {
            let wrapped = libm::remainder(angle, 2.0 * PI);
            assert_eq!(wrap(angle).to_bits(), wrapped.to_bits(), "{angle} rad");
        }
    }

    #[test]
    fn wilsons_interval_matches_a_published_example() {
        // Newcombe 1998, table I: 81 of 263 gives 0.2553 to 0.3662; 0 of 20 gives 0 to 0.1611.
        let (low, high) = wilson_95(81, 263);
        assert!((low - 0.2553).abs() < 5.0e-5 && (high - 0.3662).abs() < 5.0e-5, "{low} {high}");
        let (low, high) = wilson_95(0, 20);
        assert!(low.abs() < 1.0e-12 && (high - 0.1611).abs() < 5.0e-5, "{low} {high}");
        assert_eq!(wilson_95(0, 0), (0.0, 1.0));
    }

    #[test]
    fn the_bound_of_a_count_is_that_of_published_tables() {
        // Half of the 95 % quantile of chi-square with 2, 4, 22 and 202 degrees of freedom.
        for (events, bound) in [(0.0, 2.9957), (1.0, 4.7439), (10.0, 16.9622), (100.0, 118.08)] {
            let ours = upper_95(events);
            assert!((ours - bound).abs() < 0.01, "{events}: {ours}");
        }
        // A hundred hours may have at most 83 alarms for one an hour.
        assert!(upper_95(83.0) <= 100.0 && upper_95(84.0) > 100.0);
        // Normal approximation where a single probability underflows: n + 1.645 sqrt(n), some units more for the skew.
        let bound = upper_95(5_000.0);
        assert!((bound - (5_000.0 + 1.645 * 5_000.0_f64.sqrt())).abs() < 4.0, "{bound}");
    }
}
