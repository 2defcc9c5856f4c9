//! How far an estimate is behind the truth.

use std::cmp::Ordering;

/// Shifts whose sums are added up side by side, each in its own order.
const LANES: usize = 8;
/// After so many ticks, shifts that are already worse than the best one are given up.
const TICKS_OF_A_CHECK: usize = 64;

/// The shift in ticks, up to `longest`, with which `truth` looks most like `estimate` (least squares, every shift over the same
/// ticks of the estimate), the smallest of equal ones; `None` if there are no more ticks than twice `longest`.
///
/// Sums of squares only grow, so a shift whose sum has passed the best one cannot become the best.
pub(super) fn best_shift(estimate: &[f64], truth: &[f64], longest: usize) -> Option<usize> {
    let judged = estimate.get(longest..).filter(|judged| judged.len() > longest)?;
    let last_block = longest.checked_sub(LANES - 1)?;
    // A sum with an undefined term does not grow.
    let gives_up = estimate.iter().chain(truth).all(|value| value.is_finite());
    let mut best: Option<(usize, f64)> = None;
    for first in (0..=longest).step_by(LANES) {
        // The last block begins earlier, so that it is full.
        let first = first.min(last_block);
        let limit = best.filter(|_| gives_up).map_or(f64::INFINITY, |(_, misfit)| misfit);
        let Some(sums) = misfits(judged, &truth[last_block - first..], limit) else { continue };
        // The largest shift of the block has the earliest truth.
        for (shift, misfit) in (first..).zip(sums.into_iter().rev()) {
            if best.is_none_or(|(_, least)| misfit.total_cmp(&least) == Ordering::Less) {
                best = Some((shift, misfit));
            }
        }
    }
    best.map(|(shift, _)| shift)
}

/// Sums of squared differences between the estimate and the truth from each of the first places on; `None` where all of them
/// pass `limit`.
fn misfits(judged: &[f64], truth: &[f64], limit: f64) -> Option<[f64; LANES]> {
    let mut sums = [0.0; LANES];
    let mut places = truth.windows(LANES);
    for ticks in judged.chunks(TICKS_OF_A_CHECK) {
        for (estimate, truths) in ticks.iter().zip(&mut places) {
            for (sum, truth) in sums.iter_mut().zip(truths) {
                let difference = estimate - truth;
                *sum += difference * difference;
            }
        }
        if sums.iter().all(|sum| *sum > limit) {
            return None;
        }
    }
    Some(sums)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// By its definition, shift by shift.
    fn plain(estimate: &[f64], truth: &[f64], longest: usize) -> Option<usize> {
        let judged = estimate.get(longest..).filter(|judged| judged.len() > longest)?;
        let misfit = |shift: usize| -> f64 {
            judged.iter().zip(&truth[longest - shift..]).map(|(z2, f)| (z2 - f).powi(2)).sum()
        };
        let all = (0..=longest).map(|shift| (shift, misfit(shift)));
        all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(shift, _)| shift)
    }

    proptest! {
        #[test]
        fn the_quick_search_finds_what_the_definition_finds(
            values in proptest::collection::vec((-1.0..1.0, -1.0..1.0), 0..600),
            longest in 7_usize..40, delay in 0_usize..40, share in 0.0..1.0, gap in 0_usize..3_000,
        ) {
            let truth: Vec<f64> = values.iter().map(|(truth, _)| *truth).collect();
            let mut estimate: Vec<f64> = values
                .iter()
                .enumerate()
                .map(|(at, (_, noise))| {
                    share * noise + at.checked_sub(delay).map_or(0.0, |at| truth[at])
                })
                .collect();
            // Rarely one that is undefined.
            if let Some(value) = estimate.get_mut(gap) {
                *value = f64::NAN;
            }
            prop_assert_eq!(
                best_shift(&estimate, &truth, longest),
                plain(&estimate, &truth, longest)
            );
        }
    }

    #[test]
    fn a_delayed_copy_is_found_at_its_delay_and_of_equal_shifts_the_smallest() {
        let truth: Vec<f64> = (0..200).map(|k| libm::sin(f64::from(k) * 0.3)).collect();
        let late: Vec<f64> = (0..200).map(|k| libm::sin(f64::from(k - 9) * 0.3)).collect();
        assert_eq!(best_shift(&late, &truth, 15), Some(9));
        assert_eq!(best_shift(&[1.0; 100], &[1.0; 100], 20), Some(0));
        assert_eq!(best_shift(&[1.0; 40], &[1.0; 40], 20), None, "too short");
    }
}
