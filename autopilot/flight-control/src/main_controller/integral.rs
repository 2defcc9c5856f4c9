//! The integral part of a law; it knows nothing about aircraft.

/// A clamped integral.
///
/// Stored already multiplied by its gain, so that a gain change in flight causes no step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Integral(f64);

impl Integral {
    /// Adds one step, clamped to `max` either way.
    pub fn add(&mut self, increment: f64, max: f64) {
        self.0 = (self.0 + increment).clamp(-max, max);
    }

    /// Starts from `value`, as far as `max` either way allows.
    pub fn start(&mut self, value: f64, max: f64) {
        self.0 = value.clamp(-max, max);
    }

    /// One that starts from `value`.
    pub fn starting(value: f64) -> Self {
        Self(value)
    }

    /// The integral itself, for [`super::Law::states`].
    pub fn state(&mut self) -> &mut f64 {
        &mut self.0
    }

    /// Contribution to the command.
    pub fn value(self) -> f64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::Integral;

    #[test]
    fn the_integral_stops_at_its_limit_and_comes_back_at_once() {
        let mut integral = Integral::default();
        for _ in 0..100 {
            integral.add(0.1, 0.5);
        }
        assert_eq!(integral.value(), 0.5);
        integral.add(-0.1, 0.5);
        assert!((integral.value() - 0.4).abs() < 1.0e-15);
    }
}
