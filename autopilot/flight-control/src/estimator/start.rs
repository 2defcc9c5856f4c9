//! The start of the estimate, in flight or at rest: first fix, first attitude, generous covariance.

use core::f64::consts::TAU;

use icd::geomagnetism::field_ned_nt;
use icd::{Attitude, Body, GnssFix, Ned, Sample, Sensors, SimTime};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::covariance::{ATTITUDE, Covariance, POSITION, VELOCITY};
use super::earth::Earth;
use super::gusts::Gusts;
use super::history::{History, Integrals};
use super::noise::priors;
use super::strapdown::Estimate;
use super::{Estimator, GroundFix, air, rest, updates};
use crate::navigation::Validity;

/// Two fixes for an acceleration are at least this far apart, s.
const BETWEEN_FIXES_S: f64 = 0.15;
/// Fixes farther apart than this give no acceleration, s.
const BETWEEN_FIXES_MAX_S: f64 = 2.0;
/// Slower than this the track has no direction, m/s.
const TRACK_MIN_M_S: f64 = 5.0;
/// A first fix may be older than the estimator could look back, s; an older one is waited out.
const FIX_AGE_MAX_S: f64 = 1.0;

/// Error of the heading on a runway, rad: what is printed on charts, and how exactly an aircraft is lined up. It is believed within so many
/// standard deviations of the magnetometer.
const RUNWAY_RAD: f64 = 0.01;
const RUNWAY_DEVIATIONS: f64 = 4.0;
/// Shortest horizontal part of a direction that gives a heading, as a part of its length.
const HORIZONTAL_MIN: f64 = 0.05;

/// A direction that is known in body and in NED axes, for the heading.
#[derive(Debug, Clone, Copy)]
struct Direction {
    /// As measured.
    body: Body,
    /// As it has to be.
    ned: Ned,
}

/// Rotation from body to NED axes in which `force` (specific force, body axes) is along `expected`, and the horizontal
/// part of `direction` points where it has to; `None` if a vector is too short for it.
///
/// The method of two vectors (TRIAD, Black 1964), with the specific force as the first one.
fn align(force: &Body, expected: &Ned, direction: &Direction) -> Option<UnitQuaternion<f64>> {
    let body = frame(&force.0, &direction.body.0)?;
    let ned = frame(&expected.0, &direction.ned.0)?;
    let rotation = Rotation3::from_matrix_unchecked(ned * body.transpose());
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Columns: the first vector's direction, the part of the second one across it, and their product.
fn frame(first: &Vector3<f64>, second: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let a = first.try_normalize(1.0e-6)?;
    let b = second.try_normalize(1.0e-6)?;
    let across = (b - a * a.dot(&b)).try_normalize(HORIZONTAL_MIN)?;
    Some(Matrix3::from_columns(&[a, across, a.cross(&across)]))
}

impl Estimator {
    /// Aligns as soon as there are specific force, a fix, and a direction for the heading.
    ///
    /// A flight begins in steady flight: its specific force is against gravity. Later on the acceleration comes from two fixes.
    pub(super) fn align(&mut self, now: SimTime, sensors: &Sensors) {
        let fix = sensors.gnss;
        if !updates::is_possible(&fix.value) || !fix.valid {
            return;
        }
        let seconds = |from: SimTime, to: SimTime| {
            to.as_micros().saturating_sub(from.as_micros()) as f64 * 1.0e-6
        };
        let age = seconds(fix.time, now);
        // Both new in this tick, because the first attitude takes them as they are.
        let has_force = self.sources.accelerometer.silence_s(now) == 0.0
            && self.sources.gyro.silence_s(now) == 0.0;
        if age > FIX_AGE_MAX_S || !has_force {
            return;
        }
        // Only at time zero is the flight known to be steady. Who joins one, or begins again, has to measure the
        // acceleration first.
        let is_first = self.started == Some(now) && now == SimTime::ZERO;
        let stands = self.near_ground.on_wheels && fix.value.velocity.0.norm() < rest::STANDING_M_S;
        let acceleration = match (is_first || stands, self.fix_before) {
            (true, _) => Vector3::zeros(),
            (false, Some(before)) => {
                let between = seconds(before.time, fix.time);
                if between < BETWEEN_FIXES_S {
                    return;
                }
                self.fix_before = Some(fix);
                if between > BETWEEN_FIXES_MAX_S {
                    return;
                }
                (fix.value.velocity.0 - before.value.velocity.0) / between
            }
            (false, None) => {
                self.fix_before = Some(fix);
                return;
            }
        };
        self.align_with(now, sensors, &fix, age, acceleration);
    }

    fn align_with(
        &mut self,
        now: SimTime,
        sensors: &Sensors,
        fix: &Sample<GnssFix>,
        age: f64,
        acceleration: Vector3<f64>,
    ) {
        let GnssFix { velocity, position, latitude_rad, longitude_rad, altitude_m, decimal_year } =
            fix.value;
        let earth = Earth::through(self.shape, &fix.value);
        let place = earth.place(&position.0);
        // f = v̇ - g + 2 Ω × v, local axes.
        let over_ground = place.start_from_ned * velocity.0;
        let coriolis = earth.rotation.cross(&over_ground) * 2.0;
        let expected = Ned(acceleration + place.ned(&(coriolis - place.gravity)).0);
        // The acceleration between the fix and now, and between two fixes.
        let moved = acceleration.norm() * 0.5;
        let turning = (moved * 0.1).min(0.5);
        let magnetic = sensors.magnetometer_nt;
        let by_magnetometer = (magnetic.valid && updates::is_field(&magnetic.value)).then(|| {
            let ned = field_ned_nt(latitude_rad, longitude_rad, altitude_m, decimal_year);
            (Direction { body: magnetic.value, ned }, self.magnetic_heading_rad(&ned, turning))
        });
        // Along the flow, less the wind across it.
        let speed = libm::hypot(velocity.0.x, velocity.0.y);
        let by_track = (speed > TRACK_MIN_M_S).then(|| {
            let direction = Direction { body: measured_flow(sensors), ned: velocity };
            (direction, libm::atan(self.gains.wind_m_s / speed))
        });
        let better = |one: (Direction, f64), other: (Direction, f64)| match one.1 <= other.1 {
            true => one,
            false => other,
        };
        let to_force = |direction: &Direction| align(&Body(self.force), &expected, direction);
        // A heading of the operator that the magnetometer contradicts is of another runway.
        let is_believed = |heading: &f64| {
            by_magnetometer.is_none_or(|(direction, error)| {
                to_force(&direction).is_none_or(|q_ned_from_body| {
                    let magnetic = Attitude { q_ned_from_body }.euler().psi;
                    libm::remainder(magnetic - heading, TAU).abs() <= RUNWAY_DEVIATIONS * error
                })
            })
        };
        let runway_rad = self.runway_rad.filter(|_| self.near_ground.on_wheels).filter(is_believed);
        let by_runway = runway_rad.map(|heading| {
            let (sin, cos) = libm::sincos(heading);
            let ned = Ned::new(cos, sin, 0.0);
            (Direction { body: Body::new(1.0, 0.0, 0.0), ned }, RUNWAY_RAD)
        });
        let best =
            by_runway.or_else(|| [by_magnetometer, by_track].into_iter().flatten().reduce(better));
        let Some((direction, heading)) = best else { return };
        let Some(attitude) = to_force(&direction) else { return };

        let start_from_ned = Rotation3::from_matrix_unchecked(place.start_from_ned);
        let to_start = UnitQuaternion::from_rotation_matrix(&start_from_ned);
        let speeding = place.start_from_ned * acceleration;
        self.estimate = Estimate {
            start_from_body: to_start * attitude,
            velocity: over_ground + speeding * age,
            position: position.0 + over_ground * age + speeding * (0.5 * age * age),
            ..Estimate::default()
        };
        let mut priors = priors(&self.gains);
        // The worse of both: the heading knows of bias, tilt and wind, the gain does not. On a runway there are none.
        let least = if runway_rad.is_none() { priors[ATTITUDE + 2] } else { 0.0 };
        priors[ATTITUDE + 2] = heading.max(least);
        for axis in 0..3 {
            priors[VELOCITY + axis] += moved * age;
            priors[POSITION + axis] += moved * age * age;
        }
        priors[ATTITUDE] += turning;
        priors[ATTITUDE + 1] += turning;
        self.covariance = Covariance::new(&priors);
        self.gusts = Gusts::new(self.gains.gust_m_s);
        self.forget_gusts();
        (self.transition, self.integrals) = (super::Transition::NONE, Integrals::at(now));
        self.history = History::empty();
        // So that a fix of this very tick finds an entry.
        self.history.remember(&self.integrals);
        // From zero, the weight itself would look like a manoeuvre.
        self.steady_force = self.force;
        self.ground = Some(GroundFix { earth, place });
        self.alignments = self.alignments.saturating_add(1);
        self.find_place();
    }

    /// Error of a heading by the magnetometer in this field (nT), rad: its own errors across the field's horizontal part, and the tilt
    /// that turns a part of the vertical one into it.
    fn magnetic_heading_rad(&self, field: &Ned, turning_rad: f64) -> f64 {
        let gains = &self.gains;
        let horizontal = libm::hypot(field.0.x, field.0.y).max(1.0);
        let scale = gains.magnetic_scale * field.0.norm();
        let own = gains.magnetic_noise_nt * gains.magnetic_noise_nt
            + gains.magnetic_bias_nt * gains.magnetic_bias_nt
            + scale * scale;
        let tilt = gains.force_bias_m_s2 / self.force.norm().max(1.0) + turning_rad;
        let tilted = tilt * field.0.z;
        libm::sqrt(own + tilted * tilted) / horizontal
    }

    /// Before the alignment: what single samples say, with wings level and the flight path along the ground. Nothing of it is valid
    /// but rates, specific force and thrust.
    pub(super) fn write_before_alignment(&mut self, now: SimTime, sensors: &Sensors) {
        // `write_state` has taken the thrust already where it was good.
        let thrust = sensors.engine_n.valid && sensors.engine_n.value == self.state.thrust_n;
        let flow = measured_flow(sensors).0;
        let status = self.status(now);
        let state = &mut self.state;
        if let Some(alpha) = air::angle_of_attack(&flow) {
            state.alpha = alpha.value;
        }
        // Of an estimate that has to begin again the last attitude stays.
        if state.estimate.is_none() {
            let level = icd::EulerAngles { phi: 0.0, theta: state.alpha, psi: 0.0 };
            (state.attitude, state.orientation) = (level, Attitude::from_euler(level));
        }
        let airspeed = sensors.pitot.value.airspeed_m_s;
        if sensors.pitot.valid && (0.0..=updates::SPEED_MAX_M_S).contains(&airspeed) {
            state.airspeed_m_s = airspeed;
        }
        let altitude = sensors.barometer.value.altitude_m;
        if sensors.barometer.valid && altitude.abs() <= updates::ALTITUDE_MAX_M {
            state.altitude_m = altitude;
        }
        let (gyro, force) = (&self.sources.gyro, &self.sources.accelerometer);
        let rates = gyro.silence_s(now) == 0.0;
        let specific_force = force.silence_s(now) == 0.0;
        state.valid = Validity { rates, specific_force, thrust, ..Validity::default() };
        state.estimate = Some(status);
    }
}

/// Direction of the flow by the vanes; along the body's x axis without them.
fn measured_flow(sensors: &Sensors) -> Body {
    let vanes = &sensors.vanes;
    let [alpha, beta] = [vanes.value.angle_of_attack_rad, vanes.value.sideslip_rad];
    if !(vanes.valid && updates::is_flow(&vanes.value)) {
        return Body::new(1.0, 0.0, 0.0);
    }
    let ((sin_alpha, cos_alpha), (sin_beta, cos_beta)) = (libm::sincos(alpha), libm::sincos(beta));
    // Faster than what has no direction.
    Body::new(cos_alpha * cos_beta * 100.0, sin_beta * 100.0, sin_alpha * cos_beta * 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::{Attitude, EulerAngles};

    #[test]
    fn exact_vectors_give_the_attitude() {
        for (phi, theta, psi) in [(0.0, 0.03, 0.0), (0.5, -0.2, 2.0), (-1.0, 0.4, -3.0)] {
            let attitude = Attitude::from_euler(EulerAngles { phi, theta, psi });
            let (down, field) = (Ned::new(0.0, 0.0, -9.8), Ned::new(20_000.0, 3_000.0, 45_000.0));
            let direction = Direction { body: attitude.to_body(field), ned: field };
            let found = align(&attitude.to_body(down), &down, &direction).unwrap();
            assert!(found.angle_to(&attitude.q_ned_from_body) < 1.0e-9);
        }
    }

    #[test]
    fn a_direction_along_the_vertical_gives_none() {
        let down = Ned::new(0.0, 0.0, -9.8);
        let direction = Direction { body: Body::new(0.0, 0.0, 1.0), ned: Ned::new(0.0, 0.0, 1.0) };
        assert!(align(&Body(down.0), &down, &direction).is_none());
    }
}
