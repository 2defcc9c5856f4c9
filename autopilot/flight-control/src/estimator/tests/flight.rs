//! A flight on paper: an attitude and a velocity that are given as functions of time, and the sensors that go with them.

use icd::geomagnetism::field_ned_nt;
use icd::{
    Attitude, Body, EulerAngles, FlowAngles, GnssFix, ImpactPressure, Ned, Sample, Sensors,
    SimTime, StaticPressure,
};
use nalgebra::{Matrix3, Vector3};

use crate::design_model::atmosphere;
use crate::estimator::covariance::{ATTITUDE, GYRO_BIAS, VELOCITY, WIND};
use crate::estimator::earth::Earth;
use crate::estimator::{EarthShape, Estimator, air};
use crate::navigation::NavigationState;

const PERIOD_US: u64 = 2_000;
const LATITUDE: f64 = 0.609;
const LONGITUDE: f64 = -2.058;
const YEAR: f64 = 2_026.0;

/// Size of the errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grade {
    /// None.
    Exact,
    /// Those that the reference gains are for.
    Tactical,
}

/// The flight.
pub struct Flight {
    tick: u64,
    earth: Earth,
    position: Vector3<f64>,
    wind: Vector3<f64>,
    gust: Vector3<f64>,
    random: u64,
    scale: f64,
    gyro_bias: Vector3<f64>,
    force_bias: Vector3<f64>,
    magnetic_bias: Vector3<f64>,
    vane_bias: [f64; 2],
    barometer_offset: f64,
    gnss_error: Vector3<f64>,
    fixes: std::collections::VecDeque<Sample<GnssFix>>,
    last: Option<Sensors>,
    pub gnss_delay_s: f64,
    /// Steady until then, s.
    pub turns_from_s: f64,
}

impl Flight {
    pub fn new(grade: Grade, seed: u64) -> Self {
        let fix = GnssFix {
            velocity: Ned::zero(),
            position: Ned::new(0.0, 0.0, -5_000.0),
            latitude_rad: LATITUDE,
            longitude_rad: LONGITUDE,
            altitude_m: 5_000.0,
            decimal_year: YEAR,
        };
        let mut flight = Self {
            tick: 0,
            earth: Earth::through(EarthShape::Wgs84, &fix),
            position: fix.position.0,
            wind: Vector3::new(8.0, -5.0, 0.0),
            gust: Vector3::zeros(),
            random: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1,
            scale: if grade == Grade::Exact { 0.0 } else { 1.0 },
            gyro_bias: Vector3::zeros(),
            force_bias: Vector3::zeros(),
            magnetic_bias: Vector3::zeros(),
            vane_bias: [0.0; 2],
            barometer_offset: 0.0,
            gnss_error: Vector3::zeros(),
            fixes: std::collections::VecDeque::new(),
            last: None,
            gnss_delay_s: if grade == Grade::Exact { 0.0 } else { 0.12 },
            turns_from_s: 5.0,
        };
        flight.gyro_bias = flight.vector(0.003_f64.to_radians());
        flight.force_bias = flight.vector(0.01);
        flight.magnetic_bias = flight.vector(150.0);
        flight.vane_bias = [0.15, 0.15].map(|bias: f64| bias.to_radians() * flight.normal());
        flight.barometer_offset = 5.0 * flight.normal();
        flight.gnss_error = flight.vector(1.0).component_mul(&Vector3::new(1.0, 1.0, 1.5));
        flight
    }

    pub fn tick(&self) -> u64 {
        self.tick
    }

    pub fn time(&self) -> SimTime {
        SimTime::from_micros(self.tick * PERIOD_US)
    }

    pub fn seconds(&self) -> f64 {
        self.time().as_seconds()
    }

    pub fn position(&self) -> Vector3<f64> {
        self.position
    }

    /// Steady at first, then turns to both sides, with pitching.
    fn euler(&self, t: f64) -> EulerAngles {
        let t = (t - self.turns_from_s).max(0.0);
        // Smooth in its first two derivatives.
        let fade = (t / 5.0).min(1.0);
        let fade = fade * fade * fade * (10.0 - 15.0 * fade + 6.0 * fade * fade);
        EulerAngles {
            phi: 0.6 * fade * libm::sin(0.3 * t),
            theta: 0.035 + 0.06 * fade * libm::sin(0.2 * t),
            psi: 0.5 + 0.5 * fade * (1.0 - libm::cos(0.15 * t)),
        }
    }

    fn attitude_at(&self, t: f64) -> Attitude {
        Attitude::from_euler(self.euler(t))
    }

    pub fn attitude(&self) -> Attitude {
        self.attitude_at(self.seconds())
    }

    /// Local NED: the nose's direction less an angle of attack, plus wind.
    fn velocity_at(&self, t: f64) -> Vector3<f64> {
        let EulerAngles { theta, psi, .. } = self.euler(t);
        let climb = theta - 0.035;
        let (sin, cos) = libm::sincos(psi);
        let (up, along) = libm::sincos(climb);
        Vector3::new(along * cos, along * sin, -up) * 264.0 + self.wind
    }

    pub fn velocity(&self) -> Ned {
        Ned(self.velocity_at(self.seconds()))
    }

    fn through_air(&self) -> Vector3<f64> {
        let relative = self.velocity_at(self.seconds()) - self.wind - self.gust;
        self.attitude().to_body(Ned(relative)).0
    }

    /// A number with mean zero and spread one, from a generator of xorshift type.
    fn normal(&mut self) -> f64 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.random ^= self.random << 13;
            self.random ^= self.random >> 7;
            self.random ^= self.random << 17;
            sum += (self.random >> 11) as f64 / (1_u64 << 53) as f64;
        }
        (sum - 6.0) * self.scale
    }

    fn vector(&mut self, spread: f64) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal()) * spread
    }

    pub fn sense(&mut self) -> Sensors {
        let (now, t) = (self.time(), self.seconds());
        let step = 1.0e-3;
        let place = self.earth.place(&self.position);
        let attitude = self.attitude();
        let matrix: Matrix3<f64> = attitude.matrix();
        let velocity = self.velocity_at(t);
        let start = |v: Vector3<f64>| place.start_from_ned * v;
        // Body rates: those of the local axes relative to inertial space, and those of the body in them.
        let turn = |t: f64| {
            let (before, after) = (self.attitude_at(t - step), self.attitude_at(t + step));
            let change = before.q_ned_from_body.inverse() * after.q_ned_from_body;
            change.scaled_axis() / (2.0 * step)
        };
        let ahead = self.earth.place(&(self.position + start(velocity) * 1.0));
        let local = ahead.start_from_ned * place.start_from_ned.transpose();
        let transport = nalgebra::Rotation3::from_matrix_unchecked(local).scaled_axis();
        let rates = turn(t)
            + matrix.tr_mul(&place.start_from_ned.tr_mul(&(self.earth.rotation + transport)));
        // Specific force: acceleration in start axes, whose velocity is that of the local axes turned.
        let slope = (self.velocity_at(t + step) - self.velocity_at(t - step)) / (2.0 * step);
        let moved = start(velocity);
        let acceleration = start(slope) + transport.cross(&moved);
        let coriolis = self.earth.rotation.cross(&moved) * 2.0;
        let force = start_to_body(&matrix, &place, acceleration + coriolis - place.gravity);

        let flow_at = |x: f64| self.through_air() + turn(t).cross(&Vector3::new(x, 0.0, 0.0));
        let (vanes, pitot) = (flow_at(7.0), flow_at(8.0));
        let [latitude_rad, longitude_rad, altitude_m] = place.coordinates(&self.position);
        let altitude = air::geopotential(altitude_m);
        let pressure_pa = atmosphere::pressure(altitude);
        let kelvin = atmosphere::temperature(altitude);
        let mach_2 = pitot.norm_squared() / (1.4 * atmosphere::GAS_CONSTANT * kelvin);
        let impact_pa = pressure_pa * (libm::pow(1.0 + 0.2 * mach_2, 3.5) - 1.0);
        let field = field_ned_nt(latitude_rad, longitude_rad, altitude_m, YEAR);
        let field = attitude.to_body(field).0;
        let angles =
            [air::angle_of_attack(&vanes), air::sideslip(&vanes)].map(|f| f.unwrap().value);
        let scale = self.scale;

        let fix = GnssFix {
            velocity: Ned(velocity + self.vector(0.05)),
            position: Ned(self.position + self.gnss_error + self.vector(0.3)),
            latitude_rad,
            longitude_rad,
            altitude_m: altitude_m - self.gnss_error.z,
            decimal_year: YEAR,
        };
        if self.tick.is_multiple_of(50) {
            self.fixes.push_back(Sample::at(now, fix));
        }
        let due = |fix: &Sample<GnssFix>, delay: f64| {
            fix.time.as_seconds() + delay <= t + 1.0e-9 || fix.time == SimTime::ZERO
        };
        let mut gnss = self.last.map_or(Sample::at(now, fix), |last| last.gnss);
        while self.fixes.front().is_some_and(|fix| due(fix, self.gnss_delay_s)) {
            gnss = self.fixes.pop_front().unwrap();
        }
        // 0.0015 deg/s/√Hz and 0.0005 m/s²/√Hz at 500 Hz.
        let gyro = rates + self.gyro_bias * scale + self.vector(0.0015_f64.to_radians() * 22.4);
        let accelerometer = force + self.force_bias * scale + self.vector(0.0005 * 22.4);
        let offset = atmosphere::pressure(altitude + self.barometer_offset) - pressure_pa;
        let mut sensors = Sensors {
            gyro: Sample::at(now, Body(gyro)),
            accelerometer: Sample::at(now, Body(accelerometer)),
            attitude: Sample { valid: false, ..Sample::at(now, Attitude::identity()) },
            gnss,
            barometer: Sample::at(
                now,
                StaticPressure {
                    pressure_pa: pressure_pa + offset + 3.0 * self.normal(),
                    altitude_m,
                },
            ),
            pitot: Sample::at(
                now,
                ImpactPressure {
                    impact_pa: impact_pa + 15.0 * self.normal(),
                    airspeed_m_s: pitot.norm(),
                },
            ),
            vanes: Sample::at(
                now,
                FlowAngles {
                    angle_of_attack_rad: angles[0]
                        + self.vane_bias[0]
                        + 0.1_f64.to_radians() * self.normal(),
                    sideslip_rad: angles[1]
                        + self.vane_bias[1]
                        + 0.1_f64.to_radians() * self.normal(),
                },
            ),
            engine_n: Sample::at(now, 27_000.0),
            magnetometer_nt: Sample::at(now, Body(field + self.magnetic_bias + self.vector(60.0))),
            radar_altimeter_m: Sample::at(now, 0.0),
            weight_on_wheels_n: Sample::at(now, 0.0),
            fuel_gauge_pct: Sample::at(now, 0.0),
            fitted: [true; Sensors::SENSORS],
        };
        // 50 Hz.
        if let Some(last) = self.last
            && !self.tick.is_multiple_of(10)
        {
            sensors.barometer = last.barometer;
            sensors.pitot = last.pitot;
            sensors.vanes = last.vanes;
            sensors.magnetometer_nt = last.magnetometer_nt;
        }
        self.last = Some(sensors);
        sensors
    }

    /// One tick further, by the rule of Simpson; the gust is a Gauss-Markov process.
    pub fn advance(&mut self) {
        let (t, step) = (self.seconds(), PERIOD_US as f64 * 1.0e-6);
        let place = self.earth.place(&self.position);
        let middle = self.position + place.start_from_ned * self.velocity_at(t) * (0.5 * step);
        let place = self.earth.place(&middle);
        let ends = self.velocity_at(t) + self.velocity_at(t + step);
        let mean = (ends + self.velocity_at(t + 0.5 * step) * 4.0) / 6.0;
        self.position += place.start_from_ned * mean * step;
        let decay = libm::exp(-step / 2.0);
        let kick = 1.0 * libm::sqrt(1.0 - decay * decay);
        self.gust = self.gust * decay + self.vector(kick);
        self.tick += 1;
    }

    /// Normalised squares of the errors of attitude, velocity, gyro bias and wind.
    pub fn nees(&self, estimator: &Estimator, state: &NavigationState) -> [f64; 4] {
        let (estimate, covariance) = (estimator.estimate(), estimator.covariance());
        let place = self.earth.place(&self.position);
        let error = self.attitude().q_ned_from_body * state.orientation.q_ned_from_body.inverse();
        let attitude = place.start_from_ned * error.scaled_axis();
        let velocity = place.start_from_ned * (self.velocity().0 - state.velocity.0);
        [
            (ATTITUDE, attitude),
            (VELOCITY, velocity),
            (GYRO_BIAS, self.gyro_bias - estimate.gyro_bias),
            (WIND, self.wind + self.gust - estimate.wind),
        ]
        .map(|(from, error)| {
            let inverse = covariance.block(from).try_inverse().unwrap();
            error.dot(&(inverse * error))
        })
    }
}

fn start_to_body(
    matrix: &Matrix3<f64>,
    place: &crate::estimator::earth::Place,
    v: Vector3<f64>,
) -> Vector3<f64> {
    matrix.tr_mul(&place.start_from_ned.tr_mul(&v))
}
