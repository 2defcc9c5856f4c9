use super::*;
use crate::wind::{LENGTH_M, Turbulence};

const SPAN_M: f64 = 9.144;
const AIRSPEED: f64 = 264.0;

/// Integral of a one-sided spectrum over Ω from 0 to infinity, by Ω = tan(s)/L and the midpoint rule.
fn integral(spectrum: impl Fn(f64) -> f64) -> f64 {
    let n = 2_000_000;
    let h = core::f64::consts::FRAC_PI_2 / f64::from(n);
    (0..n)
        .map(|i| {
            let (sin, cos) = libm::sincos((f64::from(i) + 0.5) * h);
            spectrum(sin / cos / LENGTH_M) * h / (cos * cos * LENGTH_M)
        })
        .sum()
}

/// Φ_w of unit intensity, which is also Φ_v.
fn across(omega: f64) -> f64 {
    let x = LENGTH_M * omega * LENGTH_M * omega;
    LENGTH_M / core::f64::consts::PI * (1.0 + 3.0 * x) / ((1.0 + x) * (1.0 + x))
}

/// Spectra of p_g, q_g, r_g of unit intensity as MIL-F-8785C prints them.
fn spectra(omega: f64) -> [f64; 3] {
    let pi = core::f64::consts::PI;
    let lag = |spans: f64| {
        let x = spans * SPAN_M * omega / pi;
        1.0 / (1.0 + x * x)
    };
    let ratio = pi * LENGTH_M / (4.0 * SPAN_M);
    [
        0.8 * libm::cbrt(ratio) / LENGTH_M * lag(4.0),
        omega * omega * lag(4.0) * across(omega),
        omega * omega * lag(3.0) * across(omega),
    ]
}

/// rms of p_g, q_g, r_g for unit intensity, 1/m, by integrating the spectra.
fn expected_rms() -> [f64; 3] {
    [0, 1, 2].map(|i| integral(|omega| spectra(omega)[i]).sqrt())
}

#[test]
fn stationary_variances_are_the_integrals_of_the_spectra() {
    let [of_v, of_w] = Scales::isotropic(LENGTH_M, 1.0).lags(SPAN_M);
    let [p, q, r] = expected_rms();
    let of = |lag: &Lag| (1.0 - lag.stationary[(2, 2)]).sqrt() * lag.speed / LENGTH_M;
    // E[(g - x)²] = 1 - E[x²], because E[g x] = E[x²]. The midpoint rule is good to 1e-6 at the slow tail of Φ.
    let ours = [roll_rms(of_w.speed, LENGTH_M), of(&of_w), of(&of_v)];
    for ((name, ours), theirs) in ["p", "q", "r"].into_iter().zip(ours).zip([p, q, r]) {
        assert!((ours / theirs - 1.0).abs() < 1e-5, "{name}_g: {ours} against {theirs} 1/m");
    }
    // The figures at 3 m/s, so that a reader has them: 4.6, 2.6 and 3.1 deg/s.
    let deg_s = [p, q, r].map(|rms| (3.0 * rms).to_degrees());
    for (ours, known) in deg_s.into_iter().zip([4.63, 2.64, 3.06]) {
        assert!((ours - known).abs() < 0.01, "{deg_s:?} deg/s");
    }
}

/// Gusts of many ticks of `period_s`, once they are stationary: v, w, p, q, r for unit intensity.
fn flown(period_s: f64, ticks: usize) -> Vec<[f64; 5]> {
    let mut turbulence = Turbulence::new(1.0, SPAN_M, period_s, 3, 0);
    let mut gusts = Vec::with_capacity(ticks);
    for k in 0..ticks + 1_000 {
        let gust = turbulence.step(AIRSPEED);
        if k >= 1_000 {
            let (v, rates) = (gust.velocity.0, gust.rates.0);
            gusts.push([v.y, v.z, rates.x, rates.y, rates.z]);
        }
    }
    gusts
}

fn mean(gusts: &[[f64; 5]], f: impl Fn(&[f64; 5]) -> f64) -> f64 {
    let n = u32::try_from(gusts.len()).map_or(f64::NAN, f64::from);
    gusts.iter().map(f).sum::<f64>() / n
}

#[test]
fn flown_gusts_have_the_rms_of_the_spectra_at_any_period() {
    for period_s in [0.02, 0.2] {
        let gusts = flown(period_s, 200_000);
        for (i, expected) in expected_rms().into_iter().enumerate() {
            let rms = mean(&gusts, |g| g[2 + i] * g[2 + i]).sqrt();
            // At least 1e5 independent samples of a lag of 0.04 s: the rms is good to 0.3 %, five times that allowed.
            assert!((rms / expected - 1.0).abs() < 0.015, "{i}: {rms} against {expected} 1/m");
        }
    }
}

#[test]
fn pitch_gust_belongs_to_the_vertical_one_yaw_gust_to_the_lateral_one_and_roll_gust_to_none() {
    let gusts = flown(0.02, 400_000);
    let correlation = |i: usize, j: usize| {
        let product = mean(&gusts, |g| g[i] * g[j]);
        product / (mean(&gusts, |g| g[i] * g[i]) * mean(&gusts, |g| g[j] * g[j])).sqrt()
    };
    // E[w q_g] = -(1 - E[g x]) k/L, so the coefficient is the root of 1 - E[x²]: 0.18 and 0.16.
    let root = |lag: &Lag| (1.0 - lag.stationary[(2, 2)]).sqrt();
    let [of_v, of_w] = Scales::isotropic(LENGTH_M, 1.0).lags(SPAN_M);
    // 4000 independent samples of the slow gusts: 0.016, three times that allowed.
    assert!((correlation(1, 3) + root(&of_w)).abs() < 0.05, "w and q_g {}", correlation(1, 3));
    assert!((correlation(0, 4) - root(&of_v)).abs() < 0.05, "v and r_g {}", correlation(0, 4));
    for (i, j) in [(0, 2), (1, 2), (2, 3), (2, 4), (0, 3), (1, 4), (3, 4)] {
        assert!(correlation(i, j).abs() < 0.05, "{i} and {j}: {}", correlation(i, j));
    }
}

#[test]
fn pitch_and_yaw_gust_are_the_lagged_slopes_of_the_field_that_is_flown_through() {
    // At 2 ms the gradient of the flown field, passed through the lag of the standard, must be the gust that the
    // filters give: a check of their joint solution and of the signs.
    let period_s = 0.002;
    let gusts = flown(period_s, 100_000);
    for (field, rate, spans, sign) in [(1, 3, 4.0, -1.0), (0, 4, 3.0, 1.0)] {
        let tau = spans * SPAN_M / (core::f64::consts::PI * AIRSPEED);
        let keep = libm::exp(-period_s / tau);
        let (mut lagged, mut error, mut size, mut count) = (0.0, 0.0, 0.0, 0.0);
        for (k, pair) in gusts.windows(2).enumerate() {
            let slope = (pair[1][field] - pair[0][field]) / (AIRSPEED * period_s);
            lagged = keep * lagged + (1.0 - keep) * slope;
            if k > 1_000 {
                error += (sign * pair[1][rate] - lagged).powi(2);
                size += lagged * lagged;
                count += 1.0;
            }
        }
        // The remaining error is the half tick by which the difference is late: h/2τ of the noise, 4 %.
        let relative = f64::sqrt(error / size);
        assert!(relative < 0.06 && count > 90_000.0, "field {field}: {relative} of the rms");
    }
}

#[test]
fn a_long_tick_spreads_like_two_short_ones() {
    // Covariance of x with (y1, y2, x) that one tick adds, against that of two half ticks.
    for lag in [Scales::isotropic(LENGTH_M, 1.0).lags(SPAN_M)[1]].into_iter().chain(
        // Near the ground the lag is as slow as the gust itself, and slower.
        [0.2, 0.499, 0.501, 0.9, 1.0, 1.0 + 1.0e-9, 1.3, 1.499, 1.501, 4.0].map(Lag::new),
    ) {
        check_spread(&lag);
    }
}

fn check_spread(axis: &Lag) {
    let added = |ratio: f64| {
        let t = FilterTransition::new(ratio);
        let row = axis.row(&t);
        let [l31, l32, l33] = axis.spread(&t, &row);
        #[rustfmt::skip]
        let l = Matrix3::new(t.l11, 0.0, 0.0, t.l21, t.l22, 0.0, l31, l32, l33);
        #[rustfmt::skip]
        let transition = Matrix3::new(
            t.decay, 0.0, 0.0,
            t.decay * t.ratio, t.decay, 0.0,
            row.x, row.y, row.z,
        );
        (transition, l * l.transpose())
    };
    let (half, half_added) = added(0.01);
    let (one, one_added) = added(0.02);
    assert!((half * half - one).norm() < 1e-14, "{}", half * half - one);
    let twice = half * half_added * half.transpose() + half_added;
    // Differences of terms of size one: rounding of some 1e-16.
    assert!((twice - one_added).norm() < 1e-14, "{}", twice - one_added);
}

#[test]
fn the_output_has_the_bits_of_the_root() {
    assert_eq!(ROOT_3.to_bits(), 3.0_f64.sqrt().to_bits());
}

#[test]
fn two_short_ticks_spread_like_one_long_tick() {
    // Covariance that one tick adds, against that of two half ticks.
    let (one, half) = (FilterTransition::new(0.02), FilterTransition::new(0.01));
    let added =
        |t: &FilterTransition| [t.l11 * t.l11, t.l11 * t.l21, t.l21 * t.l21 + t.l22 * t.l22];
    let [a, b, c] = added(&half);
    let (e2, r) = (half.decay * half.decay, half.ratio);
    let twice = [a + e2 * a, b + e2 * (r * a + b), c + e2 * (r * r * a + 2.0 * r * b + c)];
    for (two, one) in twice.into_iter().zip(added(&one)) {
        // The last term is 5e-6 as a difference of halves: 1e-16 / 5e-6.
        assert!((two / one - 1.0).abs() < 1e-8, "{two} against {one}");
    }
}
