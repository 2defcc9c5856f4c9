//! What turns an exact value into that of a sensor: rate and delay, and the errors of its axes.

use std::collections::VecDeque;

use icd::{Sample, SimTime};

use super::grade::{Errors, QUEUE_MAX};
use crate::noise::Normals;

/// Time between two changes of an error that wanders, s; its correlation time is much longer.
const WANDER_EVERY_S: f64 = 0.1;

/// Rate and delay of a sensor: keeps its samples until they arrive, and the last one that did.
#[derive(Debug, Clone)]
pub(super) struct Clock<T> {
    rate_hz: f64,
    delay_us: u64,
    /// Number of the last sample since time zero.
    number: f64,
    queue: VecDeque<Sample<T>>,
    last: Option<Sample<T>>,
}

impl<T: Copy> Clock<T> {
    pub fn new(errors: &Errors) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked: 0 to 2 s"
        )]
        let delay_us = libm::round(errors.delay_s * 1.0e6) as u64;
        let queue = VecDeque::with_capacity(QUEUE_MAX + 1);
        Self { rate_hz: errors.rate_hz, delay_us, number: 0.0, queue, last: None }
    }

    /// The latest sample that has arrived by `now`; `measure` makes a new one where one is due.
    ///
    /// The first sample of a flight arrives at once, because the sensors run since before it.
    pub fn step(&mut self, now: SimTime, measure: impl FnOnce() -> T) -> Sample<T> {
        // A millionth of a sample against rounding.
        let reached = now.as_seconds() * self.rate_hz + 1.0e-6;
        let Some(last) = &mut self.last else {
            self.number = libm::floor(reached);
            return *self.last.insert(Sample::at(now, measure()));
        };
        if reached >= self.number + 1.0 {
            self.number = libm::floor(reached);
            let sample = Sample::at(now, measure());
            if self.delay_us == 0 {
                *last = sample;
                return sample;
            }
            if self.queue.len() > QUEUE_MAX {
                self.queue.pop_front();
            }
            self.queue.push_back(sample);
        }
        let (delay_us, now_us) = (self.delay_us, now.as_micros());
        while let Some(sample) =
            self.queue.pop_front_if(|sample| sample.time.as_micros() + delay_us <= now_us)
        {
            *last = sample;
        }
        *last
    }
}

/// Errors of the axes of a sensor, with their random numbers.
#[derive(Debug, Clone)]
pub(super) struct AxisErrors<const N: usize> {
    matrix: [[f64; N]; N],
    bias: [f64; N],
    /// The error that wanders now, and how it does.
    wandering: [f64; N],
    decay: f64,
    kick: f64,
    /// Samples between two changes of it, and how many are left.
    every: u32,
    left: u32,
    /// White noise of a sample.
    noise: f64,
    relative_noise: f64,
    resolution: f64,
    range: f64,
    normals: Normals,
}

impl<const N: usize> AxisErrors<N> {
    /// Draws the errors that are constant in a flight; with a control period in µs.
    pub fn new(errors: &Errors, period_us: u32, mut normals: Normals) -> Self {
        let rate_hz = errors.effective_rate_hz(period_us);
        let mut spread = |size: f64| if size > 0.0 { size * normals.draw() } else { 0.0 };
        let bias = [(); N].map(|()| spread(errors.bias));
        let wandering = [(); N].map(|()| spread(errors.instability));
        let mut matrix = [[0.0; N]; N];
        for (row, axis) in matrix.iter_mut().enumerate() {
            for (column, part) in axis.iter_mut().enumerate() {
                *part = match row == column {
                    true => 1.0 + spread(errors.scale),
                    false => spread(errors.misalignment_rad),
                };
            }
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most a thousand"
        )]
        let every = libm::round(WANDER_EVERY_S * rate_hz).max(1.0) as u32;
        let decay = libm::exp(-f64::from(every) / (rate_hz * errors.instability_time_s));
        Self {
            matrix,
            bias,
            wandering,
            decay,
            kick: errors.instability * (1.0 - decay * decay).sqrt(),
            every,
            left: every,
            noise: libm::hypot(errors.noise, errors.density * rate_hz.sqrt()),
            relative_noise: errors.relative_noise,
            resolution: errors.resolution,
            range: errors.range,
            normals,
        }
    }

    /// The output of the next sample of these exact values.
    pub fn apply(&mut self, exact: &[f64; N]) -> [f64; N] {
        self.wander();
        let mut out = [0.0; N];
        for (axis, out) in out.iter_mut().enumerate() {
            let value: f64 = self.matrix[axis].iter().zip(exact).map(|(part, x)| part * x).sum();
            let mut sum = value + self.bias[axis] + self.wandering[axis];
            if self.noise > 0.0 {
                sum += self.noise * self.normals.draw();
            }
            if self.relative_noise > 0.0 {
                sum += self.relative_noise * value * self.normals.draw();
            }
            *out = quantised(sum, self.resolution).max(-self.range).min(self.range);
        }
        out
    }

    /// The error of the present output at these exact values, without noise, resolution and range.
    pub fn systematic(&self, exact: &[f64; N]) -> [f64; N] {
        let mut out = [0.0; N];
        for (axis, out) in out.iter_mut().enumerate() {
            let value: f64 = self.matrix[axis].iter().zip(exact).map(|(part, x)| part * x).sum();
            *out = value - exact[axis] + self.bias[axis] + self.wandering[axis];
        }
        out
    }

    fn wander(&mut self) {
        self.left -= 1;
        if self.left > 0 {
            return;
        }
        self.left = self.every;
        if self.kick > 0.0 {
            for error in &mut self.wandering {
                *error = self.decay * *error + self.kick * self.normals.draw();
            }
        }
    }
}

fn quantised(value: f64, resolution: f64) -> f64 {
    if resolution > 0.0 { libm::round(value / resolution) * resolution } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Source;
    use icd::fault::SensorKind;

    fn normals() -> Normals {
        Normals::new(1, 0, Source::Sensor(SensorKind::Barometer))
    }

    fn tick(number: u64) -> SimTime {
        SimTime::from_micros(2_000 * number)
    }

    #[test]
    fn a_sample_comes_at_its_rate_and_arrives_after_its_delay() {
        let errors = Errors { rate_hz: 50.0, delay_s: 0.03, ..Errors::NONE };
        let mut clock = Clock::new(&errors);
        for number in 0..1_000 {
            let sample = clock.step(tick(number), || number);
            // Every tenth tick, 15 ticks later; the first one at once.
            let expected = number.saturating_sub(15) / 10 * 10;
            assert_eq!(sample, Sample::at(tick(expected), expected), "tick {number}");
        }
    }

    #[test]
    fn a_rate_above_the_control_rate_gives_a_sample_in_every_period() {
        let mut clock = Clock::new(&Errors { rate_hz: 8_000.0, ..Errors::NONE });
        for number in 0..100 {
            assert_eq!(clock.step(tick(number), || number).value, number);
        }
    }

    #[test]
    fn without_errors_the_value_keeps_its_bits() {
        let mut exact = AxisErrors::<3>::new(&Errors::NONE, 2_000, normals());
        let values = [0.1, -1.0 / 3.0, 1.0e5];
        assert_eq!(exact.apply(&values), values);
    }

    /// Mean and spread of many first samples, each of another flight.
    fn statistics(errors: &Errors, exact: f64) -> [f64; 2] {
        let flights = 4_000;
        let (mut sum, mut square) = (0.0, 0.0);
        for run in 0..flights {
            let normals = Normals::new(1, run, Source::Sensor(SensorKind::Pitot));
            let [value] = AxisErrors::<1>::new(errors, 2_000, normals).apply(&[exact]);
            sum += value;
            square += (value - exact) * (value - exact);
        }
        [sum / flights as f64, (square / flights as f64).sqrt()]
    }

    #[test]
    fn each_error_has_its_size() {
        // The spread of 4000 numbers is known to 1.1 %; five times that is allowed.
        for (errors, exact, spread) in [
            (Errors { bias: 3.0, ..Errors::NONE }, 100.0, 3.0),
            (Errors { noise: 2.0, ..Errors::NONE }, 100.0, 2.0),
            (Errors { instability: 4.0, ..Errors::NONE }, 100.0, 4.0),
            (Errors { scale: 0.02, ..Errors::NONE }, 100.0, 2.0),
            (Errors { relative_noise: 0.05, ..Errors::NONE }, 100.0, 5.0),
            // 500 samples a second: √500.
            (Errors { density: 0.1, ..Errors::NONE }, 0.0, 2.236),
        ] {
            let [mean, ours] = statistics(&errors, exact);
            assert!((ours / spread - 1.0).abs() < 0.056, "{ours} instead of {spread}: {errors:?}");
            assert!((mean - exact).abs() < 0.08 * spread, "{mean}: {errors:?}");
        }
    }

    #[test]
    fn the_output_is_in_steps_and_within_the_range() {
        let errors = Errors { resolution: 0.5, range: 10.0, ..Errors::NONE };
        let mut axis = AxisErrors::<1>::new(&errors, 2_000, normals());
        for (exact, out) in [(0.26, 0.5), (0.24, 0.0), (-3.3, -3.5), (99.0, 10.0), (-99.0, -10.0)] {
            assert_eq!(axis.apply(&[exact]), [out]);
        }
    }

    #[test]
    fn a_misaligned_axis_sees_the_others() {
        let errors = Errors { misalignment_rad: 0.01, ..Errors::NONE };
        let [x, y, z] = AxisErrors::<3>::new(&errors, 2_000, normals()).apply(&[100.0, 0.0, 0.0]);
        assert!(x == 100.0 && y != 0.0 && z != 0.0 && y.abs() < 5.0 && z.abs() < 5.0, "{y} {z}");
    }

    #[test]
    fn an_error_that_wanders_forgets_over_its_correlation_time() {
        let errors =
            Errors { rate_hz: 50.0, instability: 1.0, instability_time_s: 10.0, ..Errors::NONE };
        let mut axis = AxisErrors::<1>::new(&errors, 2_000, normals());
        let values: Vec<f64> = (0..500_000).map(|_| axis.apply(&[0.0])[0]).collect();
        let product = |lag: usize| {
            let pairs = values.iter().zip(&values[lag..]);
            pairs.map(|(a, b)| a * b).sum::<f64>() / (values.len() - lag) as f64
        };
        // 10,000 s are 500 independent values: 0.06; three times that is allowed.
        assert!((product(0) - 1.0).abs() < 0.2, "{}", product(0));
        assert!((product(500) - libm::exp(-1.0)).abs() < 0.2, "{}", product(500));
    }
}
