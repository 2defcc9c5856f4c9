//! An aircraft that stands: it turns with the Earth alone, and only the wind blows into its pitot tube.

use icd::{FlowAngles, Sensors, SimTime};

use super::covariance::{GYRO_BIAS, PITOT_BIAS, Row};
use super::updates::IMPACT_MAX_PA;
use super::{Estimator, GroundFix, air};

/// Slower than this an aircraft on the ground stands, m/s.
pub(super) const STANDING_M_S: f64 = 0.5;
/// Wind and engine shake it by this rate, rad/s rms in an update.
const SHAKEN: f64 = 0.01;
/// Wind into the pitot tube of an aircraft that stands, m/s rms.
const WIND_M_S: f64 = 5.0;
/// Impact pressure at rest that is believed, in standard deviations.
const ZERO_DEVIATIONS: f64 = 3.0;
/// Samples of its mean.
const ZERO_SAMPLES: f64 = 1_000.0;

/// What the pitot tube shows at rest.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PitotZero {
    mean_pa: f64,
    samples: f64,
    /// The part of it that is taken for its error, Pa.
    pub(super) offset_pa: f64,
}

impl Estimator {
    /// Whether it stands on the ground.
    pub(super) fn stands(&self) -> bool {
        self.near_ground.on_wheels && self.estimate.velocity.norm() < STANDING_M_S
    }

    /// An aircraft that stands turns with the Earth alone, which shows the biases of the gyros.
    pub(super) fn compare_rest(&mut self, now: SimTime) {
        let Some(GroundFix { earth, .. }) = &self.ground else { return };
        let gyro = &self.sources.gyro;
        let innovation = self.inertial().rate - self.estimate.matrix().tr_mul(&earth.rotation);
        // A faster rotation is one.
        let most = SHAKEN + 3.0 * self.gains.gyro_bias_deg.to_radians();
        if gyro.silence_s(now) > 0.0 || gyro.is_stuck(now) || innovation.amax() > most {
            return;
        }
        for axis in 0..3 {
            let row = Row::empty().with(GYRO_BIAS + axis, 1.0);
            let comparison = self.covariance.compare(&row, innovation[axis], SHAKEN * SHAKEN);
            self.take(&comparison);
        }
    }

    /// Looks at the samples of the air data without using them: they are neither lost nor wrong.
    pub(super) fn pass_over_air(&mut self, now: SimTime, sensors: &Sensors) {
        let (pitot, vanes) = (&sensors.pitot, &sensors.vanes);
        let FlowAngles { angle_of_attack_rad, sideslip_rad } = vanes.value;
        let impact_pa = pitot.value.impact_pa;
        // NaN fails the comparison.
        let is_good = pitot.valid && impact_pa.abs() <= IMPACT_MAX_PA;
        if self.sources.pitot.is_new(now, pitot.time, is_good, &[impact_pa]) {
            self.sources.pitot.believe(0.0);
            if self.stands() {
                self.zero_pitot(impact_pa);
            }
        }
        let angles = [angle_of_attack_rad, sideslip_rad];
        if self.sources.vanes.is_new(now, vanes.time, vanes.valid, &angles) {
            self.sources.vanes.believe(0.0);
        }
        self.sources.pitot.forget_repeats();
        self.sources.vanes.forget_repeats();
    }

    /// Zero of the pitot tube, as before each takeoff of a real aircraft. How much of what it shows is its error, and how much wind
    /// into it, follows from how large both may be.
    fn zero_pitot(&mut self, impact_pa: f64) {
        let Some(pressure_altitude) = self.pressure_altitude_m() else { return };
        let wind_pa = air::impact(WIND_M_S, pressure_altitude);
        let PitotZero { mean_pa, samples, offset_pa } = &mut self.pitot_zero;
        *samples = (*samples + 1.0).min(ZERO_SAMPLES);
        let square = |pa: f64| pa * pa;
        let (wind, bias) = (square(wind_pa), square(self.gains.pitot_bias_pa));
        let noise = square(self.gains.pitot_noise_pa);
        // Each sample, so that a tube which has failed for a moment is no zero of the one that works again.
        let most = ZERO_DEVIATIONS * libm::sqrt(bias + wind + noise);
        *mean_pa += (impact_pa.clamp(-most, most) - *mean_pa) / *samples;
        let share = bias / (bias + wind + noise / *samples);
        *offset_pa = share * *mean_pa;
        self.covariance.lower(PITOT_BIAS, bias * (1.0 - share));
    }
}
