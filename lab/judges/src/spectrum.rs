//! Spectra of samples by Welch's method: windowed segments that overlap by half, averaged (P. D. Welch, IEEE Transactions on
//! Audio and Electroacoustics 15, 1967).

use core::f64::consts::{PI, TAU};

/// Bands in a decade of frequencies.
const PER_DECADE: f64 = 10.0;
/// Lowest frequency that counts, as a multiple of the resolution: the window spreads the lower ones.
const LOWEST: usize = 4;
/// Highest one, as a part of the sampling frequency: above it the folded part of the spectrum is no longer small.
const HIGHEST: f64 = 0.05;

/// A spectrum in one band of frequencies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectrumBand {
    /// Its middle, rad/m.
    pub omega_rad_m: f64,
    /// Estimated from the flight, (m/s)²/(rad/m) or (rad/s)²/(rad/m).
    pub estimate: f64,
    /// By the formula of the standard, averaged over the same frequencies.
    pub formula: f64,
    /// Estimates in the average, those of overlapping segments counted by half.
    pub count: f64,
}

/// The estimate of one spectrum, sample by sample.
#[derive(Debug)]
pub struct Welch {
    window: Vec<f64>,
    waiting: Vec<f64>,
    /// Sums of the squared magnitudes.
    power: Vec<f64>,
    segments: u32,
}

impl Welch {
    /// Segments of this length, a power of two.
    pub fn new(segment: usize) -> Self {
        let n = segment as f64;
        let window = (0..segment).map(|k| 0.5 * (1.0 - libm::cos(TAU * k as f64 / n))).collect();
        let (waiting, power) = (Vec::with_capacity(segment), vec![0.0; segment / 2]);
        Self { window, waiting, power, segments: 0 }
    }

    pub fn add(&mut self, value: f64) {
        self.waiting.push(value);
        if self.waiting.len() < self.window.len() {
            return;
        }
        let mut windowed: Vec<(f64, f64)> =
            self.waiting.iter().zip(&self.window).map(|(x, w)| (x * w, 0.0)).collect();
        transform(&mut windowed);
        for (sum, (re, im)) in self.power.iter_mut().zip(&windowed) {
            *sum += re * re + im * im;
        }
        self.segments += 1;
        self.waiting.drain(..self.window.len() / 2);
    }

    /// The one-sided spectrum over the spatial frequency in bands, where two samples are `way_m` apart; beside it `formula`.
    pub fn bands(&self, way_m: f64, formula: impl Fn(f64) -> f64) -> Vec<SpectrumBand> {
        let n = self.window.len();
        let energy: f64 = self.window.iter().map(|w| w * w).sum();
        // Per hertz 2 |X|² h / Σw²; per rad/m over 2π, with the way in place of the time.
        let scale = 2.0 * way_m / (TAU * energy * f64::from(self.segments.max(1)));
        let omega = |k: usize| TAU * k as f64 / (n as f64 * way_m);
        let band_of = |k: usize| libm::floor(PER_DECADE * libm::log10(k as f64));
        let last = (HIGHEST * n as f64) as usize;
        let mut bands = Vec::new();
        let mut from = LOWEST;
        while from < last {
            let to = (from..last).find(|k| band_of(*k) != band_of(from)).unwrap_or(last);
            let lines = (to - from) as f64;
            let mean = |value: &dyn Fn(usize) -> f64| (from..to).map(value).sum::<f64>() / lines;
            bands.push(SpectrumBand {
                omega_rad_m: mean(&|k| omega(k)),
                estimate: mean(&|k| scale * self.power[k]),
                formula: mean(&|k| formula(omega(k))),
                // Overlap and window leave half of the lines and segments independent.
                count: 0.5 * lines * f64::from(self.segments),
            });
            from = to;
        }
        bands
    }
}

/// Discrete Fourier transform in place, radix two; the length is a power of two.
fn transform(x: &mut [(f64, f64)]) {
    let n = x.len();
    let shift = usize::BITS - n.trailing_zeros();
    for i in 1..n {
        let j = i.reverse_bits() >> shift;
        if i < j {
            x.swap(i, j);
        }
    }
    let mut half = 1;
    while half < n {
        // By recurrence: its rounding is far below the scatter of the estimate.
        let (sin, cos) = libm::sincos(-PI / half as f64);
        for start in (0..n).step_by(2 * half) {
            let (mut re, mut im) = (1.0, 0.0);
            for k in start..start + half {
                let (a, b) = (x[k], x[k + half]);
                let turned = (b.0 * re - b.1 * im, b.0 * im + b.1 * re);
                x[k] = (a.0 + turned.0, a.1 + turned.1);
                x[k + half] = (a.0 - turned.0, a.1 - turned.1);
                (re, im) = (re * cos - im * sin, re * sin + im * cos);
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transform_is_the_sum_of_its_definition() {
        let x: Vec<(f64, f64)> = (0..16).map(|k| (libm::sin(f64::from(k * k)), 0.0)).collect();
        let mut ours = x.clone();
        transform(&mut ours);
        for (m, value) in ours.iter().enumerate() {
            let (mut re, mut im) = (0.0, 0.0);
            for (k, x) in x.iter().enumerate() {
                let (sin, cos) = libm::sincos(-TAU * (m * k) as f64 / 16.0);
                re += x.0 * cos;
                im += x.0 * sin;
            }
            assert!((value.0 - re).abs() + (value.1 - im).abs() < 1e-12, "{m}: {value:?}");
        }
    }

    #[test]
    fn the_spectrum_holds_the_variance() {
        // White samples of unit variance: the one-sided spectrum over rad/m is way/π at every frequency.
        let mut normals = plant_sim::noise::Normals::new(1, 0, plant_sim::noise::Source::Gyro);
        let mut welch = Welch::new(1_024);
        for _ in 0..200_000 {
            welch.add(normals.draw());
        }
        for band in welch.bands(0.5, |_| 0.5 / PI) {
            let ratio = band.estimate / band.formula;
            assert!((ratio - 1.0).abs() < 4.0 / band.count.sqrt(), "{ratio}");
        }
    }
}
