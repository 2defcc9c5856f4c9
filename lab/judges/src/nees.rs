//! Whether the estimator knows how wrong it is: normalised estimation errors squared.
//!
//! That of a group of three states is eᵀ P⁻¹ e. For a consistent filter it is distributed as χ² with three degrees of freedom: its
//! mean over N flights is 3 within a band that narrows with N (Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking
//! and Navigation, 2001, section 5.4.2).

use flight_control::estimator::covariance::{ATTITUDE, FORCE_BIAS, GYRO_BIAS, VELOCITY, WIND};
use icd::units::{DEG, STANDARD_GRAVITY_M_S2};
use lab_engine::flight::Tick;
use nalgebra::{Matrix3, Vector3};

use crate::estimate::SETTLED_S;
use crate::{Judge, every_second};

/// Numbers of the judge: of each group its mean NEES, the part below the 95 % quantile, rms of the error and of what the filter states.
pub const COLUMNS: [(&str, &str); 28] = [
    ("nees_attitude", "1"),
    ("nees_velocity", "1"),
    ("nees_position", "1"),
    ("nees_gyro_bias", "1"),
    ("nees_accelerometer_bias", "1"),
    ("nees_wind", "1"),
    ("nees_attitude_below", "1"),
    ("nees_velocity_below", "1"),
    ("nees_position_below", "1"),
    ("nees_gyro_bias_below", "1"),
    ("nees_accelerometer_bias_below", "1"),
    ("nees_wind_below", "1"),
    ("attitude_estimate_rms", "rad"),
    ("velocity_estimate_rms", "m/s"),
    ("position_estimate_rms", "m"),
    ("gyro_bias_estimate_rms", "deg/h"),
    ("accelerometer_bias_estimate_rms", "mg"),
    ("wind_estimate_rms", "m/s"),
    ("attitude_stated_rms", "rad"),
    ("velocity_stated_rms", "m/s"),
    ("position_stated_rms", "m"),
    ("gyro_bias_stated_rms", "deg/h"),
    ("accelerometer_bias_stated_rms", "mg"),
    ("wind_stated_rms", "m/s"),
    ("airspeed_error_rms", "m/s"),
    ("alpha_error_rms", "rad"),
    ("beta_error_rms", "rad"),
    ("realigned", "1"),
];

/// Groups of three states.
const GROUPS: usize = 6;
/// SI units of the biases over those of the columns.
const UNITS: [f64; GROUPS] = [1.0, 1.0, 1.0, DEG / 3_600.0, STANDARD_GRAVITY_M_S2 / 1_000.0, 1.0];
/// 95 % quantile of χ² with three degrees of freedom.
const QUANTILE_95: f64 = 7.815;

/// Sums over the seconds after the settling.
#[derive(Debug, Clone, Copy, Default)]
pub struct NeesJudge {
    seconds: f64,
    nees: [f64; GROUPS],
    below: [f64; GROUPS],
    squares: [f64; GROUPS],
    variances: [f64; GROUPS],
    flow: [f64; 3],
    realigned: u32,
}

impl Judge for NeesJudge {
    fn look(&mut self, tick: &Tick<'_>) {
        let Some((estimator, status)) = every_second(tick, SETTLED_S) else { return };
        let (plant, state) = (tick.plant, &tick.log.state);
        let truth = plant.truth();
        let (estimate, covariance) = (estimator.estimate(), estimator.covariance());
        let [gyro, force] = plant.inertial_biases();
        // The covariance is in start axes, which differ from the local ones by less than half a degree in these flights.
        let turned = truth.attitude.q_ned_from_body * state.orientation.q_ned_from_body.inverse();
        let errors: [(Vector3<f64>, Matrix3<f64>); GROUPS] = [
            (turned.scaled_axis(), covariance.block(ATTITUDE)),
            (truth.velocity.0 - state.velocity.0, covariance.block(VELOCITY)),
            (truth.position.0 - state.position.0, estimator.position_covariance()),
            (gyro.0 - estimate.gyro_bias, covariance.block(GYRO_BIAS)),
            (force.0 - estimate.force_bias, covariance.block(FORCE_BIAS)),
            (truth.wind.0 - estimate.wind, covariance.block(WIND)),
        ];
        for (group, (error, block)) in errors.iter().enumerate() {
            // A covariance without inverse states nothing that an error could be compared with: the mean is undefined.
            let nees =
                block.try_inverse().map_or(f64::NAN, |inverse| error.dot(&(inverse * error)));
            self.nees[group] += nees;
            self.below[group] += f64::from(u8::from(nees < QUANTILE_95));
            self.squares[group] += error.norm_squared();
            self.variances[group] += block.trace();
        }
        let flow = [
            truth.airspeed_m_s - state.airspeed_m_s,
            truth.alpha_rad - state.alpha,
            truth.beta_rad - state.beta,
        ];
        self.flow.iter_mut().zip(flow).for_each(|(sum, error)| *sum += error * error);
        self.realigned = status.realigned;
        self.seconds += 1.0;
    }

    fn values(&self) -> Vec<Option<f64>> {
        let mean = |sum: &f64| sum / self.seconds;
        let root = |sum: &f64| mean(sum).sqrt();
        let means = self.nees.iter().chain(&self.below).map(mean);
        let groups = self.squares.iter().chain(&self.variances).map(root);
        let groups = groups.zip(UNITS.iter().cycle()).map(|(root, unit)| root / unit);
        let all = means.chain(groups).chain(self.flow.iter().map(root));
        let all = all.chain([f64::from(self.realigned)]);
        all.map(|value| (self.seconds > 0.0).then_some(value).filter(|value| !value.is_nan()))
            .collect()
    }
}
