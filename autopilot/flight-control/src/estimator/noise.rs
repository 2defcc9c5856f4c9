//! The uncertainty at the start, and what the inertial sensors and the air add to it.

use icd::SimTime;
use nalgebra::Vector3;

use super::covariance::{
    ATTITUDE, BAROMETER, CONSIDERED, FORCE_BIAS, GYRO_BIAS, LIFT, MAGNETIC_BIAS, PITOT_BIAS,
    PITOT_SCALE, POSITION, STATES, STEADY_WIND, States, VANES, VELOCITY, WIND,
};
use super::gains::EstimatorGains;
use super::{Estimator, INERTIAL_SILENCE_S};

/// Correlation time of errors that are a part of a rate or a force, s: that of a manoeuvre.
pub(super) const MANOEUVRE_S: f64 = 2.0;
/// Rate and specific force that an aircraft may have while its sensor is away, rad/s and m/s²; they last as long as a manoeuvre.
const UNKNOWN_RATE_RAD_S: f64 = 0.1;
const UNKNOWN_FORCE_M_S2: f64 = 3.0;
/// Correlation time of the slow error of a GNSS position, s; typical.
const GNSS_DRIFT_S: f64 = 300.0;

/// Standard deviations of the error states at the start.
pub(super) fn priors(gains: &EstimatorGains) -> States {
    let mut priors = [0.0; STATES];
    let mut set = |from: usize, values: [f64; 3]| priors[from..from + 3].copy_from_slice(&values);
    let (tilt, heading) = (gains.tilt_deg.to_radians(), gains.heading_deg.to_radians());
    set(ATTITUDE, [tilt, tilt, heading]);
    set(VELOCITY, [2.0 * gains.gnss_velocity_m_s; 3]);
    let position = 2.0 * gains.gnss_position_m;
    set(POSITION, [position, position, position * gains.gnss_vertical]);
    set(GYRO_BIAS, [gains.gyro_bias_deg.to_radians(); 3]);
    set(FORCE_BIAS, [gains.force_bias_m_s2; 3]);
    set(WIND, [gains.wind_m_s, gains.wind_m_s, gains.gust_m_s]);
    set(MAGNETIC_BIAS, [gains.magnetic_bias_nt; 3]);
    priors[BAROMETER] = gains.barometer_offset_m;
    priors[VANES] = gains.vane_bias_deg.to_radians();
    priors[VANES + 1] = priors[VANES];
    priors[STEADY_WIND] = gains.wind_m_s;
    priors[STEADY_WIND + 1] = gains.wind_m_s;
    priors[PITOT_BIAS] = gains.pitot_bias_pa;
    priors[PITOT_SCALE] = gains.pitot_scale;
    priors[LIFT] = gains.lift_scale;
    priors
}

impl Estimator {
    /// Q of the time since the last prediction.
    pub(super) fn process_noise(&self, now: SimTime) -> States {
        let gains = &self.gains;
        let seconds = self.transition.seconds;
        let walk = |density: f64| density * density * seconds;
        // A constant error over this time, as white noise with the same result at its end.
        let lasting = |size: f64| size * size * seconds * MANOEUVRE_S;
        let inertial = self.inertial();
        let mut noise = [0.0; STATES];
        let mut set =
            |from: usize, values: [f64; 3]| noise[from..from + 3].copy_from_slice(&values);

        let is_away = |source: &super::Source| {
            source.silence_s(now) > INERTIAL_SILENCE_S || source.is_stuck(now)
        };
        let white = walk(gains.gyro_noise_deg.to_radians());
        let rate = match is_away(&self.sources.gyro) {
            true => UNKNOWN_RATE_RAD_S,
            false => gains.gyro_scale * inertial.rate.norm(),
        };
        set(ATTITUDE, [white + lasting(rate); 3]);
        let white = walk(gains.force_noise_m_s2);
        let unknown = match is_away(&self.sources.accelerometer) {
            true => lasting(UNKNOWN_FORCE_M_S2),
            false => 0.0,
        };
        set(VELOCITY, [white + unknown; 3]);
        // A Gauss-Markov process, as the random walk that it is over a time much shorter than its own.
        let drift = 2.0 * gains.gnss_drift_m * gains.gnss_drift_m / GNSS_DRIFT_S * seconds;
        set(POSITION, [drift, drift, drift * gains.gnss_vertical * gains.gnss_vertical]);
        set(GYRO_BIAS, [walk(gains.gyro_walk_deg.to_radians()); 3]);
        // Errors of scale and direction look like another bias while the force is another one: a Gauss-Markov process of this size.
        let wrong = gains.force_scale * self.extra_force();
        let other = 2.0 * wrong * wrong / MANOEUVRE_S * seconds;
        set(FORCE_BIAS, [walk(gains.force_walk_m_s2) + other; 3]);
        let factor = self.transition.gust;
        // With the factor of `Transition` this keeps the gusts at their size.
        set(WIND, [self.gusts.square() * (1.0 - factor * factor); 3]);
        // Errors of scale and direction look like another bias after a turn by a radian.
        let part = gains.magnetic_scale * self.field.strength();
        let turning = part * part * inertial.rate.norm() * seconds;
        set(MAGNETIC_BIAS, [walk(gains.magnetic_walk_nt) + turning; 3]);
        noise[BAROMETER] = walk(gains.barometer_walk_m);
        noise[STEADY_WIND] = walk(gains.wind_walk_m_s);
        noise[STEADY_WIND + 1] = noise[STEADY_WIND];
        noise[VANES] = walk(gains.vane_walk_deg.to_radians());
        noise[VANES + 1] = noise[VANES];
        let changed = 1.0 - self.transition.lasting * self.transition.lasting;
        let priors = priors(gains);
        // With the factor of `Transition` their variance stays that of the start, since nothing corrects them.
        for (noise, prior) in noise.iter_mut().zip(&priors).skip(CONSIDERED) {
            *noise = prior * prior * changed;
        }
        noise
    }

    /// Follows the specific force of the manoeuvre. Turbulence, which is faster, leaves a bias as it is.
    pub(super) fn follow_force(&mut self) {
        let force = self.inertial().force;
        let part = 1.0 - libm::exp(-2.0 * self.transition.seconds / MANOEUVRE_S);
        self.steady_force += (force - self.steady_force) * part;
    }

    /// How much the specific force of the manoeuvre differs from that of level flight, m/s²: the errors of scale and direction of
    /// the latter are in the bias.
    fn extra_force(&self) -> f64 {
        let Some(ground) = &self.ground else { return 0.0 };
        (self.steady_force + Vector3::z() * ground.place.gravity.norm()).norm()
    }
}
