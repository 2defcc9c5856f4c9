//! Sensor values from the truth: everything exactly, except white noise on the rate gyros.
//!
//! Vanes and pitot tube are away from the centre of gravity and measure the gust at their places: the part of p_g, q_g and r_g
//! there remains in the air data. The air data computer is assumed to correct for the rotation of the aircraft itself,
//! exactly and with the true rates. So without turbulence the air data are the truth to the bit.

use icd::{Body, Effector, EffectorKind, FlowAngles, GnssFix, Sample, Sensors};
use serde::{Deserialize, Serialize};

use crate::aerodynamics::AirState;
use crate::airframe::{AirData, Airframe};
use crate::dynamics::Motion;
use crate::noise::{Normals, Source};
use crate::range::{RangeError, check_range};
use crate::truth::Truth;
use crate::wind::Gust;

/// Errors of the sensors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SensorSettings {
    /// White noise of each gyro, rad/s rms of the control samples.
    pub gyro_noise_rad_s: f64,
}

impl SensorSettings {
    /// Ideal sensors.
    pub const IDEAL: Self = Self { gyro_noise_rad_s: 0.0 };
}

impl SensorSettings {
    /// Checks every number.
    ///
    /// # Errors
    /// [`RangeError`] if it is invalid.
    pub fn check(&self) -> Result<(), RangeError> {
        let noise_deg_s = self.gyro_noise_rad_s.to_degrees();
        check_range("plant.sensors", "gyro_noise_deg_s", noise_deg_s, 0.0, 100.0)
    }
}

/// The sensors of one flight.
#[derive(Debug, Clone)]
pub struct SensorSet {
    places: AirData,
    engine: Option<Effector>,
    gyro_noise_rad_s: f64,
    gyro: Normals,
}

impl SensorSet {
    /// Air data from the positions in an airframe, gyros with the noise of `settings`; the random stream belongs to seed and run.
    #[must_use]
    pub fn new(airframe: &Airframe, settings: &SensorSettings, seed: u64, run: u64) -> Self {
        let gyro_noise_rad_s = settings.gyro_noise_rad_s;
        let (places, engine) = (airframe.air_data, airframe.effectors.only(EffectorKind::Engine));
        Self { places, engine, gyro_noise_rad_s, gyro: Normals::new(seed, run, Source::Gyro) }
    }

    /// A sample of each sensor, taken now; draws the noise of this tick. `motion` and `gust` are those of `truth`.
    pub fn sense(&mut self, truth: &Truth, motion: &Motion, gust: &Gust) -> Sensors {
        let vanes = air_at(self.places.vanes_m, motion, gust);
        let pitot = air_at(self.places.pitot_m, motion, gust);
        let fix = GnssFix {
            velocity: truth.velocity,
            position: truth.position,
            latitude_rad: truth.latitude_rad,
            longitude_rad: truth.longitude_rad,
        };
        let angles =
            FlowAngles { angle_of_attack_rad: vanes.alpha_rad, sideslip_rad: vanes.beta_rad };
        let thrust_n = self.engine.map_or(0.0, |engine| truth.deflections[engine]);
        let time = truth.time;
        Sensors {
            gyro: Sample::at(time, Body(truth.body_rates.0 + self.gyro_error().0)),
            accelerometer: Sample::at(time, truth.specific_force),
            attitude: Sample::at(time, truth.attitude),
            gnss: Sample::at(time, fix),
            barometer_m: Sample::at(time, truth.altitude_m),
            pitot_m_s: Sample::at(time, pitot.airspeed_m_s),
            vanes: Sample::at(time, angles),
            engine_n: Sample::at(time, thrust_n),
        }
    }

    /// Without noise no random number is drawn: the rates keep their bits.
    fn gyro_error(&mut self) -> Body {
        if self.gyro_noise_rad_s <= 0.0 {
            return Body::zero();
        }
        let mut axis = || self.gyro_noise_rad_s * self.gyro.draw();
        let (p, q, r) = (axis(), axis(), axis());
        Body::new(p, q, r)
    }
}

/// Motion relative to the air at a point, m from the centre of gravity, of an aircraft that does not rotate.
///
/// Where the air does not rotate it is that of the centre of gravity, with its bits.
fn air_at(place_m: [f64; 3], motion: &Motion, gust: &Gust) -> AirState {
    if gust.rates == Body::zero() {
        return motion.air;
    }
    let [x, y, z] = place_m;
    let beyond = gust.at(&Body::new(x, y, z)).0 - gust.velocity.0;
    AirState::new(&Body(motion.velocity.0 - beyond), motion.air.rates)
}
