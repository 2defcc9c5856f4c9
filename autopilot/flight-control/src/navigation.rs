//! Samples of the sensors to the navigation state: what everybody on the control side knows of the aircraft.
//!
//! The laws, the vehicle with its guidance, scripts and telemetry read [`NavigationState`]; sensors are read here and in
//! [`crate::estimator`], and by messages about single instruments. The navigator is for an aircraft with an attitude unit: it
//! takes the latest valid sample of each sensor and guards the rest against values that no aircraft has. For a sensor that gives
//! no valid sample the others stand in.

use icd::sensors::SensorKind;
use icd::{
    Attitude, Body, EulerAngles, FlowAngles, GnssFix, ImpactPressure, Ned, Sensors, SimTime,
    StaticPressure,
};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::estimator::earth::metres_per_radian;
use crate::estimator_status::{EstimatorStatus, SourceHealth};

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
    /// The aircraft has sensors of a ground.
    pub over_ground: bool,
    /// Height of the lowest contact point above the ground, m, where it is measured.
    pub height_above_ground_m: Option<f64>,
    /// The same for what needs it roughly, m: where it is not measured, or cannot be right, by the altitude above the last takeoff.
    pub rough_height_m: Option<f64>,
    /// The aircraft stands, rolls or slides on the ground, as [`crate::on_wheels`] finds.
    pub on_wheels: bool,
    /// Which parts come from this tick's samples, or are estimated well enough.
    pub valid: Validity,
    /// State and quality of the estimate; `None` where the parts are samples.
    pub estimate: Option<EstimatorStatus>,
}

/// Which parts of a [`NavigationState`] can be relied on; of the others a value computed from other parts stands in, or the last
/// good one.
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
    pub fn is_complete(&self) -> bool {
        *self == Self::COMPLETE
    }
}

impl NavigationState {
    /// At rest at the start point, nothing valid: stands in before the first good samples of a flight.
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
            over_ground: false,
            height_above_ground_m: None,
            rough_height_m: None,
            on_wheels: false,
            valid: Validity::default(),
            estimate: None,
        }
    }

    /// Ḣ: climb rate, m/s.
    pub fn climb_rate_m_s(&self) -> f64 {
        -self.velocity.0.z
    }

    /// Of which sensors the samples count, in the order of [`SensorKind::ALL`]: the latest is valid, and the estimator, where it flies,
    /// has not lost the sensor.
    pub fn alive(&self, sensors: &Sensors) -> [bool; Sensors::SENSORS] {
        let (valid, stamps) = (&self.valid, sensors.stamps());
        let mut alive = [false; Sensors::SENSORS];
        // A loop: `map` costs three times as many instructions.
        for sensor in SensorKind::ALL {
            let counts = match (&self.estimate, sensor) {
                // Of the airspeed a drift is a loss too; other samples that contradict the estimate are still what the sensor says.
                (Some(estimate), SensorKind::Pitot) => !estimate.source(sensor).is_gone(),
                (Some(estimate), _) => {
                    !matches!(estimate.source(sensor), SourceHealth::Lost | SourceHealth::Stuck)
                }
                (None, SensorKind::Gyro) => valid.rates,
                (None, SensorKind::Accelerometer) => valid.specific_force,
                (None, SensorKind::Attitude) => valid.attitude,
                (None, SensorKind::Gnss) => valid.velocity && valid.position,
                (None, SensorKind::Barometer) => valid.altitude,
                (None, SensorKind::Pitot) => valid.airspeed,
                (None, SensorKind::Vanes) => valid.flow_angles,
                (None, SensorKind::EngineMonitor) => valid.thrust,
                (
                    None,
                    SensorKind::Magnetometer
                    | SensorKind::RadarAltimeter
                    | SensorKind::WeightOnWheels
                    | SensorKind::FuelGauge,
                ) => true,
            };
            alive[sensor as usize] = counts && stamps[sensor as usize].valid;
        }
        alive
    }

    /// Velocity of the air over the ground, m/s, where it blows to: velocity over the ground minus velocity through
    /// the air, the latter from airspeed, flow angles and attitude.
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
/// Longest time between two ticks over which the navigator integrates, s.
const DT_MAX_S: f64 = 0.5;
/// Slower than this a flow has no direction, m/s.
const FLOW_MIN_M_S: f64 = 5.0;

/// Samples to [`NavigationState`].
#[derive(Debug, Clone)]
pub struct Navigator {
    /// Of the step before: holds the last good value of each part.
    state: NavigationState,
    /// The wind when air and ground were last measured both, m/s.
    wind: Ned,
}

impl Default for Navigator {
    fn default() -> Self {
        Self { state: NavigationState::at_rest(), wind: Ned::zero() }
    }
}

impl Navigator {
    /// One tick. A sample that is invalid, or whose value no aircraft has, is not used; [`NavigationState::valid`] says so, and the
    /// other samples give its part where they can.
    pub fn step(&mut self, time: SimTime, sensors: &Sensors) -> NavigationState {
        let before = self.state;
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
        if !s.valid.is_complete() {
            self.stand_in(&before, altitude_m);
        }
        self.state
    }

    /// The parts without a valid sample from those that have one: rates and attitude from each other, air and ground from each other
    /// with the last known wind, the altitude from the satellites. A law cannot bring a value to its reference that never changes.
    fn stand_in(&mut self, before: &NavigationState, gnss_altitude_m: f64) {
        let Self { state: s, wind } = self;
        // Microseconds between two ticks.
        let dt_s = (s.time.micros_since(before.time) as f64 * 1.0e-6).min(DT_MAX_S);
        let (valid, was, turned) = (s.valid, before.valid, before.orientation.q_ned_from_body);
        if !valid.rates && dt_s > 0.0 {
            let turn = turned.inverse() * s.orientation.q_ned_from_body;
            // An attitude that was stood in for is no end of a measured turn.
            let is_seen = valid.attitude && was.attitude;
            s.rates = if is_seen { turn.scaled_axis() / dt_s } else { Vector3::zeros() };
        }
        if !valid.attitude {
            let turn = UnitQuaternion::from_scaled_axis(s.rates * dt_s);
            s.orientation = Attitude { q_ned_from_body: turned * turn };
            s.attitude = s.orientation.euler();
        }
        if !(valid.velocity && valid.airspeed && valid.flow_angles) {
            // Of a tick when all of it was measured: later the values that stand in would only confirm themselves.
            if was.attitude && was.velocity && was.airspeed && was.flow_angles {
                *wind = before.wind();
            }
            let through_air = s.orientation.to_body(Ned(s.velocity.0 - wind.0)).0;
            let speed_m_s = through_air.norm();
            if !valid.airspeed && valid.velocity {
                s.airspeed_m_s = speed_m_s;
            }
            if !valid.flow_angles && valid.velocity && speed_m_s > FLOW_MIN_M_S {
                s.alpha = libm::atan2(through_air.z, through_air.x);
                s.beta = libm::asin((through_air.y / speed_m_s).clamp(-1.0, 1.0));
            }
            if !valid.velocity {
                // A velocity minus the wind that it would mean is the one through the air.
                s.velocity = Ned(s.velocity.0 - s.wind().0 + wind.0);
            }
        }
        if !valid.position {
            let way = s.velocity.0 * dt_s;
            let [north_m, east_m] = metres_per_radian(s.latitude_rad);
            s.position.0 += way;
            s.latitude_rad += way.x / north_m;
            s.longitude_rad += way.y / east_m;
        }
        if !valid.altitude {
            let flown_m = s.altitude_m + s.climb_rate_m_s() * dt_s;
            s.altitude_m = if valid.position { gnss_altitude_m } else { flown_m };
        }
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
    fn a_value_that_cannot_be_is_not_used_for_its_part_and_changes_no_other() {
        let good = testing::level_sensors();
        let mut navigator = Navigator::default();
        let before = navigator.step(SimTime::ZERO, &good);
        assert!(before.valid.is_complete());
        // Everything has changed a little, and one value cannot be.
        let later = Sensors::at(TICK, &good.to_array().map(|value| value * (1.0 + 1.0e-9)));
        let after = Navigator::default().step(TICK, &later);
        let (pitot, angles_at) = (later.pitot.value, later.vanes.value);
        for bad in [f64::NAN, f64::INFINITY, 1.0e200, -1.0e200] {
            let impact = ImpactPressure { airspeed_m_s: bad, ..pitot };
            let sensors = Sensors { pitot: Sample::at(TICK, impact), ..later };
            let NavigationState { airspeed_m_s, .. } = navigator.clone().step(TICK, &sensors);
            assert!((airspeed_m_s - after.airspeed_m_s).abs() < 1.0e-6, "{bad}: {airspeed_m_s}");
            let valid = Validity { airspeed: false, ..after.valid };
            let expected = NavigationState { airspeed_m_s, valid, ..after };
            assert_eq!(navigator.clone().step(TICK, &sensors), expected, "{bad}");
            let angles = FlowAngles { sideslip_rad: bad, ..angles_at };
            let sensors = Sensors { vanes: Sample::at(TICK, angles), ..later };
            let NavigationState { alpha, beta, .. } = navigator.clone().step(TICK, &sensors);
            assert!((alpha - after.alpha).abs() + beta.abs() < 1.0e-6, "{bad}: {alpha} {beta}");
            let valid = Validity { flow_angles: false, ..after.valid };
            let expected = NavigationState { alpha, beta, valid, ..after };
            assert_eq!(navigator.clone().step(TICK, &sensors), expected, "{bad}");
        }
    }

    /// A climbing turn in wind: samples at a tick, from the place before it.
    fn climbing_turn(tick: u64, place: &mut [f64; 3]) -> Sensors {
        let (dt_s, turn, theta, speed_m_s) = (0.002, 0.1, 0.02, 264.0);
        let time = SimTime::from_micros(2_000 * tick);
        let psi = turn * dt_s * tick as f64;
        let orientation = Attitude::from_euler(EulerAngles { phi: 0.0, theta, psi });
        let air = orientation.to_ned(Body::new(speed_m_s, 0.0, 0.0)).0;
        let velocity = air + Vector3::new(10.0, -5.0, 0.5);
        let [north_m, east_m] = metres_per_radian(place[0]);
        if tick > 0 {
            place[0] += velocity.x * dt_s / north_m;
            place[1] += velocity.y * dt_s / east_m;
            place[2] -= velocity.z * dt_s;
        }
        let mut sensors = testing::level_sensors();
        let [sin, cos] = [libm::sin(theta), libm::cos(theta)];
        sensors.gyro = Sample::at(time, Body::new(-turn * sin, 0.0, turn * cos));
        sensors.attitude = Sample::at(time, orientation);
        let [latitude_rad, longitude_rad, altitude_m] = *place;
        let fix = sensors.gnss.value;
        let velocity = Ned(velocity);
        sensors.gnss.value = GnssFix { velocity, latitude_rad, longitude_rad, altitude_m, ..fix };
        sensors.barometer.value.altitude_m = altitude_m;
        sensors.pitot.value.airspeed_m_s = speed_m_s;
        sensors.vanes.value = FlowAngles { angle_of_attack_rad: 0.0, sideslip_rad: 0.0 };
        sensors
    }

    #[test]
    fn the_other_sensors_stand_in_for_one_without_valid_samples() {
        for lost in SensorKind::ALL {
            let (mut navigator, mut all) = (Navigator::default(), Navigator::default());
            let mut place = [0.6, -2.0, 5_000.0];
            let (mut state, mut truth) = (NavigationState::at_rest(), NavigationState::at_rest());
            for tick in 0..5_000 {
                let mut sensors = climbing_turn(tick, &mut place);
                truth = all.step(SimTime::from_micros(2_000 * tick), &sensors);
                sensors.invalidate(|sensor| sensor == lost && tick >= 500);
                state = navigator.step(truth.time, &sensors);
            }
            let lost = lost.name();
            assert!((state.rates - truth.rates).norm() < 1.0e-9, "{lost}: {}", state.rates);
            let turned =
                truth.orientation.q_ned_from_body.angle_to(&state.orientation.q_ned_from_body);
            assert!(turned < 1.0e-9, "{lost}: {turned} rad");
            let apart = (state.velocity.0 - truth.velocity.0).norm();
            assert!(apart < 1.0e-6, "{lost}: {apart} m/s over the ground");
            let apart = state.airspeed_m_s - truth.airspeed_m_s;
            assert!(apart.abs() < 1.0e-6, "{lost}: {apart} m/s through the air");
            assert!(state.alpha.abs() + state.beta.abs() < 1.0e-9, "{lost}");
            assert!((state.altitude_m - truth.altitude_m).abs() < 1.0e-6, "{lost}");
            let apart = (state.latitude_rad - truth.latitude_rad)
                .abs()
                .max((state.longitude_rad - truth.longitude_rad).abs());
            assert!(apart < 1.0e-9, "{lost}: {apart} rad");
        }
    }

    #[test]
    fn a_part_without_its_sensor_is_not_valid() {
        let mut sensors = testing::level_sensors();
        sensors.invalidate(|_| true);
        assert_eq!(Navigator::default().step(TICK, &sensors).valid, Validity::default());
        let without = |lost| {
            let mut sensors = testing::level_sensors();
            sensors.invalidate(|sensor| sensor == lost);
            Navigator::default().step(TICK, &sensors).valid
        };
        let all = Validity::COMPLETE;
        assert_eq!(without(SensorKind::Pitot), Validity { airspeed: false, ..all });
        assert_eq!(without(SensorKind::Gnss), Validity { velocity: false, position: false, ..all });
        assert_eq!(without(SensorKind::Barometer), Validity { altitude: false, ..all });
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
