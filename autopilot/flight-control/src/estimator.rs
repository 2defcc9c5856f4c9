//! The navigation state from sensors with errors: an error-state Kalman filter with 26 states and three errors that it considers.
//!
//! ```text
//!  gyro, accelerometer ─> strapdown ─> estimate ──────────────────────────────> NavigationState
//!        every tick                       ^   │ expected
//!                                         │   v
//!  GNSS, barometer, pitot, vanes, ─> source ─> compare, gate, correct <── covariance
//!  magnetometer, lift                          every 10 ms
//! ```
//!
//! The states are errors of attitude, velocity and position, biases of gyros and accelerometers, wind with its gusts and
//! without, bias of the magnetometer, offset of the barometer and biases of the two vanes. Bias and scale of the pitot tube and the
//! error of the modelled lift count in every variance and are not corrected in flight; without a pitot tube the biases of the vanes
//! too ([`covariance`] has their order). The inertial navigation runs in every control step, in axes that are fixed to the Earth at the
//! start point ([`earth`]); the covariance and the measurements follow every 10 ms. A measurement is compared at its own time: a late
//! GNSS fix through the integrals of [`history`], air data and magnetic field through the rates. Each number is a measurement of its
//! own, so nothing is inverted.
//!
//! Sources: P. Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems (2nd edition, 2013), chapters
//! 3, 5 and 14; J. Sola, Quaternion kinematics for the error-state Kalman filter (arXiv:1711.02508), section 7 with the global
//! error.

use icd::sensors::SensorKind;
use icd::{Body, Ned, Sample, Sensors, SimTime};
use nalgebra::{Matrix3, Vector3};

use crate::aircraft_model::AircraftModel;
use crate::design_model::level_turn::stall_airspeed_m_s;
use crate::navigation::{NavigationState, Validity};
use crate::on_wheels::GroundReading;
use air::AirModel;
use covariance::{
    ATTITUDE, BAROMETER, Covariance, FORCE_BIAS, GYRO_BIAS, MAGNETIC_BIAS, POSITION, Transition,
    VANES, VELOCITY, WIND,
};
use earth::{Earth, Place};
use gusts::Gusts;
use history::{History, Integrals};
use source::Source;
use strapdown::{Estimate, Field, Inertial};
use updates::MagneticField;

mod air;
pub mod covariance;
pub mod earth;
pub mod gains;
mod gusts;
pub mod history;
mod lift;
mod noise;
mod rest;
mod source;
mod start;
pub mod strapdown;
mod updates;

pub use crate::estimator_status::{EstimatorStatus, SourceHealth};
pub use gains::{EarthShape, EstimatorGains, EstimatorPreset, StateSource};

/// The covariance and the measurements follow after this time, µs.
const UPDATE_EVERY_US: u64 = 10_000;
/// A longer step of time than this begins a new alignment, µs.
const GAP_MAX_US: u64 = 500_000;
/// Without samples for this long the inertial sensors count as away, s.
const INERTIAL_SILENCE_S: f64 = 0.1;
/// Largest body rate that is believed, rad/s.
const RATE_MAX_RAD_S: f64 = 100.0;
/// Largest specific force along an axis that is believed, m/s².
const FORCE_MAX_M_S2: f64 = 1_000.0;
/// Largest thrust that is believed, N.
const THRUST_MAX_N: f64 = 1.0e8;
/// Correlation time of the errors that are only considered, s: half an hour of flight.
const LASTING_S: f64 = 1_800.0;
/// Largest errors with which a part of the state counts as valid.
const VALID_ATTITUDE_RAD: f64 = 0.1;
const VALID_VELOCITY_M_S: f64 = 5.0;
const VALID_POSITION_M: f64 = 200.0;
const VALID_ALTITUDE_M: f64 = 50.0;
/// Of the airspeed; the flow angles have this over the airspeed.
const VALID_WIND_M_S: f64 = 15.0;

/// Sensors to [`NavigationState`], by an error-state Kalman filter.
#[derive(Debug, Clone)]
pub struct Estimator {
    gains: EstimatorGains,
    shape: EarthShape,
    air: AirModel,
    /// Calibrated airspeed of the stall, m/s.
    stall_m_s: f64,
    near_ground: GroundReading,
    /// Heading before the takeoff, rad from north, where the operator knows it.
    runway_rad: Option<f64>,
    state: NavigationState,
    estimate: Estimate,
    covariance: Covariance,
    /// What happened since the last prediction of the covariance.
    transition: Transition,
    integrals: Integrals,
    history: History,
    /// `None` before the first alignment.
    ground: Option<GroundFix>,
    sources: EstimatorSources,
    /// Last believed samples of the inertial sensors.
    rate: Vector3<f64>,
    force: Vector3<f64>,
    /// Specific force without its bias, without what is faster than a manoeuvre, m/s².
    steady_force: Vector3<f64>,
    started: Option<SimTime>,
    fix_before: Option<Sample<icd::GnssFix>>,
    field: MagneticField,
    gusts: Gusts,
    model_due: SimTime,
    lift: lift::Mean,
    pitot_zero: rest::PitotZero,
    vertical_ratio: f64,
    velocity_ratio: f64,
    late: u32,
    alignments: u32,
}

/// The Earth, and the place where the aircraft was at the last update.
#[derive(Debug, Clone)]
struct GroundFix {
    earth: Earth,
    place: Place,
}

/// The samples of each sensor that the estimator reads.
#[derive(Debug, Clone, Default)]
struct EstimatorSources {
    gyro: Source,
    accelerometer: Source,
    gnss: Source,
    gnss_velocity: Source,
    barometer: Source,
    pitot: Source,
    vanes: Source,
    magnetometer: Source,
}

impl EstimatorSources {
    /// All of them with the sensor that they watch.
    fn all(&self) -> [(SensorKind, &Source); 8] {
        [
            (SensorKind::Gyro, &self.gyro),
            (SensorKind::Accelerometer, &self.accelerometer),
            (SensorKind::Gnss, &self.gnss_velocity),
            (SensorKind::Gnss, &self.gnss),
            (SensorKind::Barometer, &self.barometer),
            (SensorKind::Pitot, &self.pitot),
            (SensorKind::Vanes, &self.vanes),
            (SensorKind::Magnetometer, &self.magnetometer),
        ]
    }
}

impl Estimator {
    /// Before the first samples of a flight. `aircraft` and `gains` are validated by the caller.
    pub fn new(aircraft: &AircraftModel, gains: &EstimatorGains, shape: EarthShape) -> Self {
        Self {
            gains: *gains,
            shape,
            air: AirModel::new(aircraft),
            stall_m_s: stall_airspeed_m_s(aircraft),
            near_ground: GroundReading::default(),
            runway_rad: None,
            state: NavigationState::at_rest(),
            estimate: Estimate::default(),
            covariance: Covariance::new(&noise::priors(gains)),
            transition: Transition::NONE,
            integrals: Integrals::at(SimTime::ZERO),
            history: History::empty(),
            ground: None,
            sources: EstimatorSources::default(),
            rate: Vector3::zeros(),
            force: Vector3::zeros(),
            steady_force: Vector3::zeros(),
            started: None,
            fix_before: None,
            field: MagneticField::default(),
            gusts: Gusts::new(gains.gust_m_s),
            model_due: SimTime::ZERO,
            lift: lift::Mean::default(),
            pitot_zero: rest::PitotZero::default(),
            vertical_ratio: 0.0,
            velocity_ratio: 0.0,
            late: 0,
            alignments: 0,
        }
    }

    /// Takes other gains from the next step on.
    pub fn set_gains(&mut self, gains: &EstimatorGains) {
        self.gains = *gains;
    }

    /// Takes the heading before the takeoff, rad from north, where it is known. An aircraft that stands is aligned anew with it.
    pub fn set_runway(&mut self, runway_rad: Option<f64>) {
        if self.runway_rad != runway_rad && self.stands() {
            self.begin_again();
        }
        self.runway_rad = runway_rad;
    }

    /// Time of the last step.
    pub fn time(&self) -> SimTime {
        self.state.time
    }

    /// The state of the last step.
    pub fn state(&self) -> NavigationState {
        self.state
    }

    /// The estimate.
    pub fn estimate(&self) -> &Estimate {
        &self.estimate
    }

    /// Covariance of its errors.
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// Covariance of the position, m², local NED axes to a degree, with the slow errors of GNSS that no filter can average.
    pub fn position_covariance(&self) -> Matrix3<f64> {
        let horizontal = self.gains.gnss_drift_m;
        let vertical = horizontal * self.gains.gnss_vertical;
        let slow = Vector3::new(horizontal, horizontal, vertical);
        self.covariance.block(POSITION) + Matrix3::from_diagonal(&slow.component_mul(&slow))
    }

    /// The same of an aircraft over a ground. On it the flow says nothing of the motion before the aircraft is fast, and forces are
    /// not those of the air; near it gusts are short.
    pub fn step_over(
        &mut self,
        ground: GroundReading,
        time: SimTime,
        sensors: &Sensors,
    ) -> NavigationState {
        self.near_ground = ground;
        self.step(time, sensors)
    }

    /// One tick: samples in, state out. Total: whatever the samples are, every number of the state is finite.
    pub fn step(&mut self, time: SimTime, sensors: &Sensors) -> NavigationState {
        let gap_us = time.as_micros().saturating_sub(self.state.time.as_micros());
        // While time stands still the same tick comes again.
        if self.started.is_some() && gap_us == 0 {
            return self.state;
        }
        let before = [self.rate, self.force];
        self.take_inertial(time, sensors);
        if self.ground.is_some() && gap_us > GAP_MAX_US {
            self.begin_again();
        }
        self.started.get_or_insert(time);
        self.state.time = time;
        match self.ground.is_some() {
            true => {
                self.advance(time, gap_us, &before);
                // A sum of seconds; without rounding ten steps of 1 ms could be a hair short, and the update a step
                // late.
                if libm::round(self.transition.seconds * 1.0e6) as u64 >= UPDATE_EVERY_US {
                    self.update(time, sensors);
                }
            }
            false => self.align(time, sensors),
        }
        if !self.estimate.is_finite() {
            self.begin_again();
        }
        self.write_state(time, sensors);
        self.state
    }

    /// Everything from new, at the next samples that allow it; what the sources have done is kept.
    fn begin_again(&mut self) {
        self.ground = None;
        self.fix_before = None;
        self.estimate = Estimate::default();
        self.covariance = Covariance::new(&noise::priors(&self.gains));
        self.history = History::empty();
        self.transition = Transition::NONE;
    }

    /// Takes the samples of the inertial sensors where they are new and possible; without them it goes on with the last ones
    /// for a moment, and then as if the aircraft flew straight.
    fn take_inertial(&mut self, time: SimTime, sensors: &Sensors) {
        let Sensors { gyro, accelerometer, .. } = sensors;
        let sources = &mut self.sources;
        let (rate, force) = (gyro.value.0, accelerometer.value.0);
        if is_new(&mut sources.gyro, time, gyro, rate.as_ref(), RATE_MAX_RAD_S) {
            self.rate = rate;
        // With this the rate without its bias is zero.
        } else if sources.gyro.silence_s(time) > INERTIAL_SILENCE_S || sources.gyro.is_stuck(time) {
            self.rate = self.estimate.gyro_bias;
        }
        if is_new(&mut sources.accelerometer, time, accelerometer, force.as_ref(), FORCE_MAX_M_S2) {
            self.force = force;
        } else if let Some(ground) = &self.ground
            && (sources.accelerometer.silence_s(time) > INERTIAL_SILENCE_S
                || sources.accelerometer.is_stuck(time))
        {
            // The force that carries the aircraft in its present attitude.
            let held = self.estimate.matrix().tr_mul(&-ground.place.gravity);
            self.force = held + self.estimate.force_bias;
        }
    }

    /// What the inertial sensors measure, without their biases.
    fn inertial(&self) -> Inertial {
        Inertial {
            rate: self.rate - self.estimate.gyro_bias,
            force: self.force - self.estimate.force_bias,
        }
    }

    /// Inertial navigation since the last step.
    fn advance(&mut self, time: SimTime, gap_us: u64, before: &[Vector3<f64>; 2]) {
        // A sample is of its own instant, so the mean of both ends stands for the time between them. The later one
        // alone would be half a step ahead: 8 mm/s in a turn with 8 m/s².
        let inertial = Inertial {
            rate: (before[0] + self.rate) * 0.5 - self.estimate.gyro_bias,
            force: (before[1] + self.force) * 0.5 - self.estimate.force_bias,
        };
        let Some(ground) = &self.ground else { return };
        let field = Field { gravity: ground.place.gravity, rotation: ground.earth.rotation };
        let seconds = gap_us as f64 * 1.0e-6;
        let Self { estimate, transition, integrals, .. } = self;
        estimate.advance(&inertial, &field, seconds, transition, integrals);
        integrals.time = time;
        self.history.remember(&self.integrals);
    }

    /// The covariance, the place, and all measurements that are new.
    fn update(&mut self, time: SimTime, sensors: &Sensors) {
        // First, because the process noise reads the force of the manoeuvre.
        self.follow_force();
        self.transition.gust = libm::exp(-self.transition.seconds / self.gust_s());
        self.transition.lasting = libm::exp(-self.transition.seconds / LASTING_S);
        let noise = self.process_noise(time);
        let Estimate { wind, steady_wind, .. } = &mut self.estimate;
        // The mean of a Gauss-Markov process decays as `Transition` lets its covariance decay.
        *wind = *steady_wind + (*wind - *steady_wind) * self.transition.gust;
        self.covariance.predict(&self.transition, &noise);
        self.transition = Transition::NONE;
        self.find_place();
        let before = self.estimate.matrix();
        self.measure(time, sensors);
        self.covariance.turn_attitude(&(self.estimate.matrix() * before.transpose()));
        self.follow_gusts(time);
        // Of a covariance that is not positive every correction would be wrong, and none would repair it.
        if !self.covariance.is_sound() {
            self.begin_again();
        }
    }

    fn find_place(&mut self) {
        let Self { ground, estimate, .. } = self;
        if let Some(ground) = ground {
            ground.place = ground.earth.place(&estimate.position);
        }
    }

    /// Velocity of the aircraft through the air, m/s, body axes.
    fn through_air(&self, ground: &GroundFix) -> Vector3<f64> {
        let wind = ground.place.start_from_ned * self.estimate.wind;
        self.estimate.matrix().tr_mul(&(self.estimate.velocity - wind))
    }

    /// The navigation state of this tick, from the estimate where there is one.
    fn write_state(&mut self, time: SimTime, sensors: &Sensors) {
        let inertial = self.inertial();
        self.state.rates = inertial.rate;
        self.state.specific_force = Body(inertial.force);
        let engine = &sensors.engine_n;
        let thrust = engine.valid && engine.value.abs() <= THRUST_MAX_N;
        if thrust {
            self.state.thrust_n = engine.value;
        }
        let Some(ground) = &self.ground else { return self.write_before_alignment(time, sensors) };
        let through_air = self.through_air(ground);
        let Self { estimate, state, .. } = self;
        let orientation = ground.place.attitude(&estimate.start_from_body);
        (state.orientation, state.attitude) = (orientation, orientation.euler());
        state.velocity = ground.place.ned(&estimate.velocity);
        state.position = Ned(estimate.position);
        let [latitude, longitude, altitude] = ground.place.coordinates(&estimate.position);
        (state.latitude_rad, state.longitude_rad, state.altitude_m) =
            (latitude, longitude, altitude);
        // Too slow for a flow: the speed is zero, and the angles stay as they were.
        state.airspeed_m_s = air::speed(&through_air).map_or(0.0, |flow| flow.value);
        if let Some(flow) = air::angle_of_attack(&through_air) {
            state.alpha = flow.value;
        }
        if let Some(flow) = air::sideslip(&through_air) {
            state.beta = flow.value;
        }
        self.write_quality(time, thrust);
    }

    /// Validity and status.
    fn write_quality(&mut self, time: SimTime, thrust: bool) {
        let status = self.status(time);
        let Self { sources, state, .. } = self;
        let within = |value: f32, limit: f64| f64::from(value) <= limit;
        let air = within(status.wind_m_s, VALID_WIND_M_S);
        state.valid = Validity {
            rates: sources.gyro.silence_s(time) <= INERTIAL_SILENCE_S
                && !sources.gyro.is_stuck(time),
            attitude: within(status.attitude_rad, VALID_ATTITUDE_RAD),
            specific_force: sources.accelerometer.silence_s(time) <= INERTIAL_SILENCE_S
                && !sources.accelerometer.is_stuck(time),
            velocity: within(status.velocity_m_s, VALID_VELOCITY_M_S),
            position: within(status.horizontal_m, VALID_POSITION_M),
            altitude: within(status.vertical_m, VALID_ALTITUDE_M),
            airspeed: air,
            flow_angles: air,
            thrust,
        };
        state.estimate = Some(status);
    }

    /// State and quality of the estimate.
    pub fn status(&self, time: SimTime) -> EstimatorStatus {
        let mut status =
            EstimatorStatus { is_aligned: self.ground.is_some(), ..Default::default() };
        for (sensor, source) in self.sources.all() {
            let health = source.health(time);
            let place = &mut status.sources[sensor as usize];
            // Velocity and position of GNSS are watched on their own; what is gone counts.
            if !place.is_gone() {
                *place = health;
            }
            status.rejected = status.rejected.saturating_add(source.rejections);
        }
        let covariance = &self.covariance;
        let root = |sum: f64| libm::sqrt(sum) as f32;
        // The filter averages what is fast. The slow error of GNSS is not in its covariance, so it is added to what
        // is reported.
        let (drift, factor) = (self.gains.gnss_drift_m, self.gains.gnss_vertical);
        let present = self.present();
        let flow = |of| present.as_ref().map_or(0.0, |present| self.flow_variance(present, of));
        let position = |axis: usize| covariance.variance(POSITION + axis);
        let vertical = position(2) + drift * drift * factor * factor;
        EstimatorStatus {
            velocity_ratio: self.velocity_ratio as f32,
            horizontal_ratio: self.sources.gnss.ratio as f32,
            vertical_ratio: self.vertical_ratio as f32,
            magnetic_ratio: self.sources.magnetometer.ratio as f32,
            airspeed_ratio: self.sources.pitot.ratio as f32,
            flow_ratio: self.sources.vanes.ratio as f32,
            attitude_rad: root(covariance.sum_of_three(ATTITUDE)),
            velocity_m_s: root(covariance.sum_of_three(VELOCITY)),
            horizontal_m: root(position(0) + position(1) + 2.0 * drift * drift),
            vertical_m: root(vertical),
            wind_m_s: root(covariance.sum_of_three(WIND)),
            airspeed_m_s: root(flow(air::speed)),
            flow_rad: [air::angle_of_attack, air::sideslip].map(|of| root(flow(of))),
            gyro_bias_rad_s: root(covariance.sum_of_three(GYRO_BIAS)),
            force_bias_m_s2: root(covariance.sum_of_three(FORCE_BIAS)),
            magnetic_bias_nt: root(covariance.sum_of_three(MAGNETIC_BIAS)),
            barometer_offset_m: root(covariance.variance(BAROMETER)),
            vane_bias_rad: root(covariance.variance(VANES) + covariance.variance(VANES + 1)),
            late: self.late,
            realigned: self.alignments.saturating_sub(1),
            ..status
        }
    }

    /// Biases of gyros and accelerometers may be anything again that they may be at the start.
    fn doubt_inertial(&mut self) {
        let gains = &self.gains;
        let (tilt, heading) = (gains.tilt_deg.to_radians(), gains.heading_deg.to_radians());
        let bias = 3.0 * gains.gyro_bias_deg.to_radians();
        let force = 3.0 * gains.force_bias_m_s2;
        for axis in 0..3 {
            let angle = if axis < 2 { tilt } else { heading };
            self.covariance.raise(ATTITUDE + axis, angle * angle);
            self.covariance.raise(GYRO_BIAS + axis, bias * bias);
            self.covariance.raise(FORCE_BIAS + axis, force * force);
        }
    }
}

/// Whether a sample of an inertial sensor is new and possible.
fn is_new(
    source: &mut Source,
    now: SimTime,
    sample: &Sample<Body>,
    values: &[f64; 3],
    max: f64,
) -> bool {
    // NaN fails the comparison.
    let good = sample.valid && values.iter().all(|value| value.abs() <= max);
    source.is_new(now, sample.time, good, values)
}

#[cfg(test)]
mod tests;
