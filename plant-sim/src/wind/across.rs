//! The filter of the gusts across the flight path: two equal lags and a zero.

/// Two lags T in a row, each state scaled to unit variance of the first; the gust is √3 y1 + (1 − √3) y2.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SecondOrder {
    pub y1: f64,
    pub y2: f64,
}

/// How the filters move in one period: transition and Cholesky factor of what the noise adds.
pub(super) struct Transition {
    /// exp(-h/T).
    pub decay: f64,
    /// h/T.
    pub ratio: f64,
    pub l11: f64,
    pub l21: f64,
    pub l22: f64,
}

impl Transition {
    /// Of a double pole at -1/T over h = ratio T. Stationary covariance of (y1, y2): ((1, ½), (½, ½)).
    pub fn new(ratio: f64) -> Self {
        let decay = libm::exp(-ratio);
        let e2 = decay * decay;
        let q11 = 1.0 - e2;
        let q12 = 0.5 - e2 * (ratio + 0.5);
        let q22 = 0.5 - e2 * (ratio * ratio + ratio + 0.5);
        let l11 = q11.sqrt();
        let l21 = q12 / l11;
        // q22 is a small difference of large terms; rounding must not make the root imaginary.
        Self { decay, ratio, l11, l21, l22: (q22 - l21 * l21).max(0.0).sqrt() }
    }
}

impl SecondOrder {
    pub fn step(&mut self, t: &Transition, n1: f64, n2: f64) {
        let (y1, y2) = (self.y1, self.y2);
        self.y1 = t.decay * y1 + t.l11 * n1;
        self.y2 = t.decay * (t.ratio * y1 + y2) + (t.l21 * n1 + t.l22 * n2);
    }

    /// The gust for unit intensity: variance 3 + √3 (1 − √3) + ½ (1 − √3)² = 2 before the scaling.
    pub fn output(&self) -> f64 {
        let [c1, c2] = OUTPUT;
        (c1 * self.y1 + c2 * self.y2) * core::f64::consts::FRAC_1_SQRT_2
    }
}

/// √3.
const ROOT_3: f64 = 1.732_050_807_568_877_2;

/// What of y1 and y2 is in the gust, times √2.
pub(super) const OUTPUT: [f64; 2] = [ROOT_3, 1.0 - ROOT_3];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_output_has_the_bits_of_the_root() {
        assert_eq!(ROOT_3.to_bits(), 3.0_f64.sqrt().to_bits());
    }

    #[test]
    fn two_short_ticks_spread_like_one_long_tick() {
        // Covariance that one tick adds, against that of two half ticks.
        let (one, half) = (Transition::new(0.02), Transition::new(0.01));
        let added = |t: &Transition| [t.l11 * t.l11, t.l11 * t.l21, t.l21 * t.l21 + t.l22 * t.l22];
        let [a, b, c] = added(&half);
        let (e2, r) = (half.decay * half.decay, half.ratio);
        let twice = [a + e2 * a, b + e2 * (r * a + b), c + e2 * (r * r * a + 2.0 * r * b + c)];
        for (two, one) in twice.into_iter().zip(added(&one)) {
            // The last term is 5e-6 as a difference of halves: 1e-16 / 5e-6.
            assert!((two / one - 1.0).abs() < 1e-8, "{two} against {one}");
        }
    }
}
