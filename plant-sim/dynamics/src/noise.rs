//! Random numbers: one stream for each (seed, run, source), so that no source disturbs another.

use icd::fault::SensorKind;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Sources of random numbers. The number of its stream is part of every recorded flight: never reuse one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// White noise of the ideal rate gyros.
    Gyro,
    /// Turbulence: velocity.
    Turbulence,
    /// Turbulence: p_g.
    TurbulenceRoll,
    /// Turbulence: the part of q_g that is independent of w_g.
    TurbulencePitch,
    /// Turbulence: the part of r_g that is independent of v_g.
    TurbulenceYaw,
    /// Velocity of the satellite receiver.
    GnssVelocity,
    /// Errors of a sensor.
    Sensor(SensorKind),
    /// Noise that is a fault of a sensor.
    SensorFault(SensorKind),
}

impl Source {
    /// Number of its stream.
    const fn stream(self) -> u64 {
        match self {
            Self::Gyro => 1,
            Self::Turbulence => 2,
            Self::TurbulenceRoll => 3,
            Self::TurbulencePitch => 4,
            Self::TurbulenceYaw => 5,
            Self::GnssVelocity => 6,
            // Room for 32 sensors in either block.
            Self::Sensor(sensor) => 32 + sensor as u64,
            Self::SensorFault(sensor) => 64 + sensor as u64,
        }
    }
}

/// White, normally distributed numbers.
///
/// ChaCha8 keyed by seed and run, its stream number is the source: streams do not overlap and do not depend on
/// the order in which they are drawn. The normals are Box-Muller pairs made with `libm`: a table method of a
/// library would be faster, but its bits change with the library, and those of `std` with the platform.
#[derive(Debug, Clone)]
pub struct Normals {
    generator: ChaCha8Rng,
    /// The second number of the last pair.
    spare: Option<f64>,
}

impl Normals {
    /// The stream of `source` in one run.
    pub fn new(seed: u64, run: u64, source: Source) -> Self {
        // The text fills the rest of the key. Like the stream numbers it is part of every recorded
        // flight.
        let mut key = *b"........--------two-step plant-1";
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&run.to_le_bytes());
        let mut generator = ChaCha8Rng::from_seed(key);
        generator.set_stream(source.stream());
        Self { generator, spare: None }
    }

    /// The next number: mean 0, standard deviation 1, below 8.6 either way.
    pub fn draw(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        // 1 - uniform is never zero, so the logarithm is finite.
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * self.uniform());
        self.spare = Some(radius * sin);
        radius * cos
    }

    /// Uniform in [0, 1) with 53 bits.
    // 53 bits fit a f64 exactly.
    fn uniform(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
        (self.generator.next_u64() >> 11) as f64 * STEP
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first(seed: u64, run: u64, source: Source) -> [u64; 4] {
        let mut normals = Normals::new(seed, run, source);
        std::array::from_fn(|_| normals.draw().to_bits())
    }

    #[test]
    fn the_same_stream_has_the_same_bits_and_every_other_differs() {
        let one = first(7, 3, Source::Gyro);
        assert_eq!(one, first(7, 3, Source::Gyro));
        for other in
            [first(8, 3, Source::Gyro), first(7, 4, Source::Gyro), first(7, 3, Source::Turbulence)]
        {
            assert_ne!(one, other);
        }
    }

    #[test]
    fn numbers_are_normal_and_white() {
        const N: u32 = 200_000;
        let mut normals = Normals::new(1, 0, Source::Gyro);
        let (mut m1, mut m2, mut m4, mut lag, mut before) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for _ in 0..N {
            let x = normals.draw();
            m1 += x;
            m2 += x * x;
            m4 += x * x * x * x;
            lag += x * before;
            before = x;
        }
        let n = f64::from(N);
        // Five standard errors: 1, sqrt(2), sqrt(96), 1 over sqrt(n) = 0.0022.
        assert!((m1 / n).abs() < 0.011, "mean {}", m1 / n);
        assert!((m2 / n - 1.0).abs() < 0.016, "variance {}", m2 / n);
        assert!((m4 / n - 3.0).abs() < 0.11, "fourth moment {}", m4 / n);
        assert!((lag / n).abs() < 0.011, "correlation of neighbours {}", lag / n);
    }

    #[test]
    fn regress_the_first_number_never_changes() {
        // A new value here would invalidate every recorded noisy flight.
        assert_eq!(Normals::new(1, 0, Source::Gyro).draw().to_bits(), 4_608_993_435_929_095_189);
    }
}
