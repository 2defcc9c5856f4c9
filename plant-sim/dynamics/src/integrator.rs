//! Fixed-step integration: the last stage of the signal path before time advances.

/// One step of the classical fourth-order Runge-Kutta method.
///
/// `x` is the state, `step_s` the step in s (any sign), `derivative` gives dx/dt in the units of `x` per
/// second. It depends on the state only: all other inputs are constant during the step. `k1` is the derivative
/// at `x`, which a caller that has just evaluated the state has already. Fourth order if `derivative` is
/// smooth; never fails, non-finite derivatives give a non-finite state.
#[inline]
pub fn rk4<const N: usize>(
    x: &[f64; N],
    k1: &[f64; N],
    step_s: f64,
    derivative: impl Fn(&[f64; N]) -> [f64; N],
) -> [f64; N] {
    let k2 = derivative(&moved(x, k1, 0.5 * step_s));
    let k3 = derivative(&moved(x, &k2, 0.5 * step_s));
    let k4 = derivative(&moved(x, &k3, step_s));
    let mut next = *x;
    for i in 0..N {
        // Another grouping would change the last bits of every recorded flight.
        next[i] += step_s / 6.0 * ((k1[i] + k4[i]) + 2.0 * (k2[i] + k3[i]));
    }
    next
}

#[inline]
fn moved<const N: usize>(x: &[f64; N], rate: &[f64; N], time_s: f64) -> [f64; N] {
    let mut next = *x;
    for i in 0..N {
        next[i] += time_s * rate[i];
    }
    next
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decay_error(steps: u32) -> f64 {
        let h = 1.0 / f64::from(steps);
        let mut x = [1.0];
        for _ in 0..steps {
            x = rk4(&x, &[-x[0]], h, |x| [-x[0]]);
        }
        (x[0] - libm::exp(-1.0)).abs()
    }

    #[test]
    fn halving_the_step_divides_the_error_by_sixteen() {
        let ratio = decay_error(10) / decay_error(20);
        // 16 in the limit of small steps; at h = 0.1 the next order still shows.
        assert!((14.0..19.0).contains(&ratio), "ratio {ratio}");
    }

    #[test]
    fn a_cubic_in_time_is_integrated_exactly() {
        // dx/dt = t^2 * 3 with t as a state: RK4 is exact to rounding for polynomials up to third degree.
        let x = rk4(&[0.0, 0.0], &[1.0, 0.0], 2.0, |x| [1.0, 3.0 * x[0] * x[0]]);
        assert!((x[1] - 8.0).abs() < 1e-14, "x = {} instead of 8", x[1]);
    }
}
