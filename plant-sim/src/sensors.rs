//! What the aircraft reports of the truth: everything exactly, the rate gyros with white noise.

use icd::{Body, Effector, Sensors};

use crate::noise::{Normals, Source};
use crate::truth::Truth;

/// The sensors of one flight.
#[derive(Debug, Clone)]
pub struct SensorSet {
    gyro_noise_rad_s: f64,
    gyro: Normals,
}

impl SensorSet {
    /// Gyros with this noise, rad/s rms of each sample; the random stream belongs to seed and run.
    #[must_use]
    pub fn new(gyro_noise_rad_s: f64, seed: u64, run: u64) -> Self {
        Self { gyro_noise_rad_s, gyro: Normals::new(seed, run, Source::Gyro) }
    }

    /// One set of values; draws the noise of this tick.
    pub fn sense(&mut self, truth: &Truth) -> Sensors {
        Sensors {
            body_rates: Body(truth.body_rates.0 + self.gyro_error().0),
            specific_force: truth.specific_force,
            attitude: truth.attitude,
            velocity: truth.velocity,
            position: truth.position,
            latitude_rad: truth.latitude_rad,
            longitude_rad: truth.longitude_rad,
            altitude_m: truth.altitude_m,
            airspeed_m_s: truth.airspeed_m_s,
            angle_of_attack_rad: truth.alpha_rad,
            sideslip_rad: truth.beta_rad,
            thrust_n: truth.deflections[Effector::Engine],
        }
    }

    /// Nothing is drawn without noise: the rates keep their bits.
    fn gyro_error(&mut self) -> Body {
        if self.gyro_noise_rad_s <= 0.0 {
            return Body::zero();
        }
        let mut axis = || self.gyro_noise_rad_s * self.gyro.draw();
        let (p, q, r) = (axis(), axis(), axis());
        Body::new(p, q, r)
    }
}
