//! How often something rare happens, and how sure one can be.

/// Chance that the true rate lies above the bound.
const RISK: f64 = 0.05;

/// One-sided 95 % upper bound of a mean count, from `events` counted: Poisson.
///
/// It is the mean for which so few events or fewer have a probability of 5 %, which is half the 95 % quantile of the
/// chi-square distribution with 2 (events + 1) degrees of freedom.
#[must_use]
pub fn upper_95(events: u32) -> f64 {
    let n = f64::from(events);
    let (mut low, mut high) = (n, n + 10.0 + 5.0 * n.sqrt());
    // Each step halves the interval; sixty of them reach the last bit.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_most(events, middle) > RISK {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Probability of at most `events` where `mean` are expected; in logarithms, so that large means do not underflow.
fn at_most(events: u32, mean: f64) -> f64 {
    let mut logarithm = -mean;
    let mut sum = libm::exp(logarithm);
    for k in 1..=events {
        logarithm += libm::log(mean / f64::from(k));
        sum += libm::exp(logarithm);
    }
    sum
}

/// The middle one of the values, or the upper one of two; infinity for none.
#[must_use]
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_that_of_published_tables() {
        // Half of the 95 % quantile of chi-square with 2, 4, 22 and 202 degrees of freedom.
        for (events, bound) in [(0, 2.9957), (1, 4.7439), (10, 16.9622), (100, 118.08)] {
            let ours = upper_95(events);
            assert!((ours - bound).abs() < 0.01, "{events}: {ours}");
        }
    }

    #[test]
    fn a_hundred_hours_may_have_at_most_83_alarms_for_one_an_hour() {
        let most = (0..200).take_while(|events| upper_95(*events) <= 100.0).last();
        assert_eq!(most, Some(83));
    }

    #[test]
    fn the_bound_holds_where_a_single_probability_underflows() {
        let bound = upper_95(5_000);
        // Normal approximation: n + 1.645 sqrt(n), some units more for the skew.
        assert!((bound - (5_000.0 + 1.645 * 5_000.0_f64.sqrt())).abs() < 4.0, "{bound}");
    }
}
