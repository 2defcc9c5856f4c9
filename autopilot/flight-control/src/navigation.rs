//! Samples of the sensors to the navigation state: what everybody on the control side knows of the aircraft.
//!
//! The laws, the vehicle with its guidance, scripts and telemetry read [`NavigationState`]; sensors are read here and in
//! [`crate::estimator`], and nowhere else. The navigator is for an aircraft with an attitude unit: it takes the latest valid
//! sample of each sensor and guards the rest against values that no aircraft has.

use icd::{
    Attitude, Body, EulerAngles, FlowAngles, GnssFix, ImpactPressure, Ned, Sensors, SimTime,
    StaticPressure,
};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::estimator_status::EstimatorStatus;

/// What is known of the aircraft at one tick. Every number is finite and one that an aircraft can have.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NavigationState {
    /// Simulation time of the tick.
    pub time: SimTime,
    /// p, q, r: body rates relative to inertial space, rad/s.
    pub rates: Vector3<f64>,
    /// φ, θ, ψ, rad: the angles of `orientation`.
    pub attitude: EulerAngles,
    /// The attitude as a rotation from body to local NED axes.
    pub orientation: Attitude,
    /// Specific force, m/s²: (0, 0, -g) at rest on the ground.
    pub specific_force: Body,
    /// Velocity over the ground, m/s.
    pub velocity: Ned,
    /// Position from the start point at altitude zero, m, in the NED axes of that point.
    pub position: Ned,
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// H: altitude above the ellipsoid (or the flat ground), m.
    pub altitude_m: f64,
    /// V: true airspeed, m/s.
    pub airspeed_m_s: f64,
    /// α: angle of attack, rad, air-relative.
    pub alpha: f64,
    /// β: sideslip, rad, air-relative, positive with the wind from the right.
    pub beta: f64,
    /// T: thrust, N, measured.
    pub thrust_n: f64,
    /// Which parts come from this tick's samples, or are estimated well enough.
    pub valid: Validity,
    /// State and quality of the estimate; `None` where the parts are samples.
    #[serde(default)]
    pub estimate: Option<EstimatorStatus>,
}

/// Which parts of a [`NavigationState`] can be relied on; of the others the last good value stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Validity {
    /// Body rates.
    pub rates: bool,
    /// Attitude, as angles and as rotation.
    pub attitude: bool,
    /// Specific force.
    pub specific_force: bool,
    /// Velocity over the ground.
    pub velocity: bool,
    /// Position, latitude and longitude.
    pub position: bool,
    /// Altitude.
    pub altitude: bool,
    /// Airspeed.
    pub airspeed: bool,
    /// Angle of attack and sideslip.
    pub flow_angles: bool,
    /// Thrust.
    pub thrust: bool,
}

impl Validity {
    /// Every part is valid.
    pub const COMPLETE: Self = Self {
        rates: true,
        attitude: true,
        specific_force: true,
        velocity: true,
        position: true,
        altitude: true,
        airspeed: true,
        flow_angles: true,
        thrust: true,
    };

    /// Whether every part is valid.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        *self == Self::COMPLETE
    }
}

impl NavigationState {
    /// At rest at the start point, nothing valid: stands in before the first good samples of a flight.
    #[must_use]
    pub fn at_rest() -> Self {
        Self {
            time: SimTime::ZERO,
            rates: Vector3::zeros(),
            attitude: EulerAngles { phi: 0.0, theta: 0.0, psi: 0.0 },
            orientation: Attitude::identity(),
            specific_force: Body::zero(),
            velocity: Ned::zero(),
            position: Ned::zero(),
            latitude_rad: 0.0,
            longitude_rad: 0.0,
            altitude_m: 0.0,
            airspeed_m_s: 0.0,
            alpha: 0.0,
            beta: 0.0,
            thrust_n: 0.0,
            valid: Validity::default(),
            estimate: None,
        }
    }

    /// Ḣ: climb rate, m/s.
    #[must_use]
    pub fn climb_rate_m_s(&self) -> f64 {
        -self.velocity.0.z
    }

    /// Velocity of the air over the ground, m/s, where it blows to: velocity over the ground minus velocity through
    /// the air, the latter from airspeed, flow angles and attitude.
    #[must_use]
    pub fn wind(&self) -> Ned {
        let (sin_alpha, cos_alpha) = libm::sincos(self.alpha);
        let (sin_beta, cos_beta) = libm::sincos(self.beta);
        let through_air = Body::new(cos_alpha * cos_beta, sin_beta, sin_alpha * cos_beta);
        Ned(self.velocity.0 - self.orientation.to_ned(through_air).0 * self.airspeed_m_s)
    }
}

/// Largest body rate that the navigator accepts, rad/s: sixteen turns a second.
const RATE_MAX_RAD_S: f64 = 100.0;
/// Largest specific force along an axis that the navigator accepts, m/s²: a thousand g.
const FORCE_MAX_M_S2: f64 = 10_000.0;
/// Largest deviation of the attitude quaternion's squared length from one.
const QUATERNION_TOLERANCE: f64 = 1.0e-6;
/// Largest angle that the navigator accepts, rad: a little more than half a turn.
const ANGLE_MAX_RAD: f64 = 3.2;
/// Largest speed that the navigator accepts, m/s.
const SPEED_MAX_M_S: f64 = 5_000.0;
/// Largest distance from the start point along an axis that the navigator accepts, m: the other side of the Earth.
const DISTANCE_MAX_M: f64 = 2.0e7;
/// Largest altitude either way that the navigator accepts, m.
const ALTITUDE_MAX_M: f64 = 200_000.0;
/// Largest pressure either way that the navigator accepts, Pa: ten atmospheres.
const PRESSURE_MAX_PA: f64 = 1.0e6;
/// Latest year that the navigator accepts.
const YEAR_MAX: f64 = 10_000.0;
/// Largest thrust that the navigator accepts, N.
const THRUST_MAX_N: f64 = 1.0e8;

/// Samples to [`NavigationState`].
#[derive(Debug, Clone)]
pub struct Navigator {
    /// Of the step before: holds the last good value of each part.
    state: NavigationState,
}

impl Default for Navigator {
    fn default() -> Self {
        Self { state: NavigationState::at_rest() }
    }
}

impl Navigator {
    /// One tick. A sample that is invalid, or whose value no aircraft has, leaves the last good value of its part and
    /// says so in [`NavigationState::valid`].
    pub fn step(&mut self, time: SimTime, sensors: &Sensors) -> NavigationState {
        let s = &mut self.state;
        s.time = time;
        let Sensors { gyro, accelerometer, attitude, gnss, vanes, .. } = sensors;
        let Sensors { barometer, pitot, engine_n, .. } = sensors;
        let GnssFix { velocity, position, latitude_rad, longitude_rad, altitude_m, decimal_year } =
            gnss.value;
        let StaticPressure { pressure_pa, altitude_m: pressure_altitude_m } = barometer.value;
        let ImpactPressure { impact_pa, airspeed_m_s } = pitot.value;
        let FlowAngles { angle_of_attack_rad: alpha, sideslip_rad: beta } = vanes.value;
        s.valid = Validity {
            rates: gyro.valid && within(gyro.value.0.as_ref(), RATE_MAX_RAD_S),
            attitude: attitude.valid && is_rotation(&attitude.value),
            specific_force: accelerometer.valid
                && within(accelerometer.value.0.as_ref(), FORCE_MAX_M_S2),
            velocity: gnss.valid && within(velocity.0.as_ref(), SPEED_MAX_M_S),
            position: gnss.valid
                && within(position.0.as_ref(), DISTANCE_MAX_M)
                && within(&[latitude_rad, longitude_rad], ANGLE_MAX_RAD)
                && within(&[altitude_m], ALTITUDE_MAX_M)
                && within(&[decimal_year], YEAR_MAX),
            altitude: barometer.valid
                && within(&[pressure_altitude_m], ALTITUDE_MAX_M)
                && within(&[pressure_pa], PRESSURE_MAX_PA),
            airspeed: pitot.valid
                && within(&[airspeed_m_s], SPEED_MAX_M_S)
                && within(&[impact_pa], PRESSURE_MAX_PA),
            flow_angles: vanes.valid && within(&[alpha, beta], ANGLE_MAX_RAD),
            thrust: engine_n.valid && within(&[engine_n.value], THRUST_MAX_N),
        };
        if s.valid.rates {
            s.rates = gyro.value.0;
        }
        if s.valid.attitude {
            (s.attitude, s.orientation) = (attitude.value.euler(), attitude.value);
        }
        if s.valid.specific_force {
            s.specific_force = accelerometer.value;
        }
        if s.valid.velocity {
            s.velocity = velocity;
        }
        if s.valid.position {
            (s.position, s.latitude_rad, s.longitude_rad) = (position, latitude_rad, longitude_rad);
        }
        if s.valid.altitude {
            s.altitude_m = pressure_altitude_m;
        }
        if s.valid.airspeed {
            s.airspeed_m_s = airspeed_m_s;
        }
        if s.valid.flow_angles {
            (s.alpha, s.beta) = (alpha, beta);
        }
        if s.valid.thrust {
            s.thrust_n = engine_n.value;
        }
        *s
    }
}

/// Every value between minus and plus `max`; NaN and infinity are not.
fn within(values: &[f64], max: f64) -> bool {
    values.iter().all(|value| value.abs() <= max)
}

fn is_rotation(attitude: &Attitude) -> bool {
    let square = attitude.wxyz().iter().map(|part| part * part).sum::<f64>();
    (square - 1.0).abs() <= QUATERNION_TOLERANCE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use icd::Sample;

    const TICK: SimTime = SimTime::from_micros(2_000);

    #[test]
    fn a_value_that_cannot_be_leaves_the_last_good_one_of_its_part_and_no_other() {
        let good = testing::level_sensors();
        let mut navigator = Navigator::default();
        let before = navigator.step(SimTime::ZERO, &good);
        assert!(before.valid.is_complete());
        // Everything has changed a little, and one value cannot be.
        let later = Sensors::at(TICK, &good.to_array().map(|value| value * (1.0 + 1.0e-9)));
        let after = Navigator::default().step(TICK, &later);
        let (pitot, angles_at) = (later.pitot.value, later.vanes.value);
        for bad in [f64::NAN, f64::INFINITY, 1.0e200, -1.0e200] {
            let airspeed = Validity { airspeed: false, ..after.valid };
            assert_eq!(
                navigator.clone().step(
                    TICK,
                    &Sensors {
                        pitot: Sample::at(TICK, ImpactPressure { airspeed_m_s: bad, ..pitot }),
                        ..later
                    }
                ),
                NavigationState { airspeed_m_s: before.airspeed_m_s, valid: airspeed, ..after },
                "{bad}"
            );
            let flow_angles = Validity { flow_angles: false, ..after.valid };
            let (alpha, beta) = (before.alpha, before.beta);
            assert_eq!(
                navigator.step(
                    TICK,
                    &Sensors {
                        vanes: Sample::at(TICK, FlowAngles { sideslip_rad: bad, ..angles_at }),
                        ..later
                    }
                ),
                NavigationState { alpha, beta, valid: flow_angles, ..after },
                "{bad}"
            );
            navigator.step(SimTime::ZERO, &good);
        }
    }

    #[test]
    fn an_invalid_sample_leaves_the_last_good_value_of_its_parts() {
        let good = testing::level_sensors();
        let fly = |change: fn(&mut Sensors)| {
            let mut navigator = Navigator::default();
            navigator.step(SimTime::ZERO, &good);
            let mut later = Sensors::at(TICK, &good.to_array().map(|value| value * (1.0 + 1.0e-9)));
            change(&mut later);
            navigator.step(TICK, &later)
        };
        let (before, after) = (testing::level_state(), fly(|_| {}));
        assert_ne!((before.rates, before.velocity), (after.rates, after.velocity));
        let valid = after.valid;
        assert_eq!(
            fly(|s| s.gyro.valid = false),
            NavigationState {
                rates: before.rates,
                valid: Validity { rates: false, ..valid },
                ..after
            }
        );
        assert_eq!(
            fly(|s| s.attitude.valid = false),
            NavigationState {
                attitude: before.attitude,
                orientation: before.orientation,
                valid: Validity { attitude: false, ..valid },
                ..after
            }
        );
        assert_eq!(
            fly(|s| s.accelerometer.valid = false),
            NavigationState {
                specific_force: before.specific_force,
                valid: Validity { specific_force: false, ..valid },
                ..after
            }
        );
        assert_eq!(
            fly(|s| s.gnss.valid = false),
            NavigationState {
                velocity: before.velocity,
                position: before.position,
                latitude_rad: before.latitude_rad,
                longitude_rad: before.longitude_rad,
                valid: Validity { velocity: false, position: false, ..valid },
                ..after
            }
        );
        assert_eq!(
            fly(|s| s.barometer.valid = false),
            NavigationState {
                altitude_m: before.altitude_m,
                valid: Validity { altitude: false, ..valid },
                ..after
            }
        );
        assert_eq!(
            fly(|s| (s.pitot.valid, s.engine_n.valid) = (false, false)),
            NavigationState {
                airspeed_m_s: before.airspeed_m_s,
                thrust_n: before.thrust_n,
                valid: Validity { airspeed: false, thrust: false, ..valid },
                ..after
            }
        );
        assert_eq!(
            fly(|s| s.vanes.valid = false),
            NavigationState {
                alpha: before.alpha,
                beta: before.beta,
                valid: Validity { flow_angles: false, ..valid },
                ..after
            }
        );
    }

    #[test]
    fn bad_first_samples_give_a_finite_state_in_which_nothing_is_valid() {
        let sensors = Sensors::at(TICK, &[f64::NAN; Sensors::COUNT]);
        let state = Navigator::default().step(TICK, &sensors);
        assert_eq!(state, NavigationState { time: TICK, ..NavigationState::at_rest() });
    }

    #[test]
    fn the_wind_is_the_difference_of_ground_and_air_velocity() {
        let level = testing::level_state();
        // 264 m/s through the air along the ground, 250 m/s north and 10 m/s east over it.
        let state = NavigationState { velocity: Ned::new(250.0, 10.0, 0.0), ..level };
        assert!((state.wind().0 - Vector3::new(-14.0, 10.0, 0.0)).norm() < 1.0e-9);
    }
}
