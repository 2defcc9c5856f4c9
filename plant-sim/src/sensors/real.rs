//! Sensors with rates, delays and errors.

use icd::fault::SensorKind;
use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{
    Attitude, Body, FlowAngles, GnssFix, ImpactPressure, Ned, Sample, Sensors, SimTime,
    StaticPressure,
};

use super::channel::{AxisErrors, Clock};
use super::grade::{Errors, Grade};
use crate::atmosphere::{HEAT_RATIO, pressure_altitude_m, speed_of_sound};
use crate::noise::{Normals, Source};

/// Radius that turns an error of a position in m into one of latitude and longitude, m.
const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// Sensors with errors; each has random numbers of its own.
#[derive(Debug, Clone)]
pub(super) struct RealSensors {
    gyro: Sensor<3>,
    accelerometer: Sensor<3>,
    attitude: AttitudeUnit,
    gnss: Receiver,
    barometer: Sensor<1>,
    pitot: Sensor<1>,
    vanes: Sensor<2>,
    engine_monitor: Sensor<1>,
    magnetometer: Sensor<3>,
    air_data: AirDataComputer,
}

/// What an air data computer makes of its pressures: a function of them, kept until one changes.
#[derive(Debug, Clone, Copy)]
struct AirDataComputer {
    static_pa: f64,
    impact_pa: f64,
    /// Pressure altitude, m.
    altitude_m: f64,
    /// True airspeed, m/s.
    airspeed_m_s: f64,
}

/// A sensor with axes.
#[derive(Debug, Clone)]
struct Sensor<const N: usize> {
    clock: Clock<[f64; N]>,
    errors: AxisErrors<N>,
}

#[derive(Debug, Clone)]
struct Receiver {
    clock: Clock<GnssFix>,
    /// Of the position, NED.
    position: AxisErrors<3>,
    velocity: AxisErrors<3>,
    vertical_factor: f64,
}

/// An attitude unit with errors of its angles.
#[derive(Debug, Clone)]
struct AttitudeUnit {
    clock: Clock<Attitude>,
    angles: AxisErrors<3>,
}

impl RealSensors {
    /// Draws the constant errors; the random streams belong to seed and run.
    pub fn new(grade: &Grade, period_us: u32, seed: u64, run: u64) -> Self {
        let normals = |sensor| Normals::new(seed, run, Source::Sensor(sensor));
        let errors = |sensor| (grade.of(sensor), period_us, normals(sensor));
        let gnss = grade.of(SensorKind::Gnss);
        let velocity =
            Errors { rate_hz: gnss.rate_hz, noise: gnss.velocity_noise_m_s, ..Errors::NONE };
        let attitude = grade.of(SensorKind::Attitude);
        Self {
            gyro: Sensor::new(errors(SensorKind::Gyro)),
            accelerometer: Sensor::new(errors(SensorKind::Accelerometer)),
            attitude: AttitudeUnit {
                clock: Clock::new(attitude),
                angles: AxisErrors::new(attitude, period_us, normals(SensorKind::Attitude)),
            },
            gnss: Receiver {
                clock: Clock::new(gnss),
                position: AxisErrors::new(gnss, period_us, normals(SensorKind::Gnss)),
                velocity: AxisErrors::new(
                    &velocity,
                    period_us,
                    Normals::new(seed, run, Source::GnssVelocity),
                ),
                vertical_factor: gnss.vertical_factor,
            },
            barometer: Sensor::new(errors(SensorKind::Barometer)),
            pitot: Sensor::new(errors(SensorKind::Pitot)),
            vanes: Sensor::new(errors(SensorKind::Vanes)),
            engine_monitor: Sensor::new(errors(SensorKind::EngineMonitor)),
            magnetometer: Sensor::new(errors(SensorKind::Magnetometer)),
            // Of no pressures yet.
            air_data: AirDataComputer::new(f64::NAN, f64::NAN),
        }
    }

    /// Errors of the gyros without rotation, rad/s, and of the accelerometers in level flight, m/s², without noise.
    pub fn inertial_biases(&self) -> [Body; 2] {
        let of = |sensor: &Sensor<3>, exact: [f64; 3]| {
            let [x, y, z] = sensor.errors.systematic(&exact);
            Body::new(x, y, z)
        };
        [of(&self.gyro, [0.0; 3]), of(&self.accelerometer, [0.0, 0.0, -STANDARD_GRAVITY_M_S2])]
    }

    /// The samples that have arrived, of exact values of this instant.
    pub fn sense(&mut self, exact: &Sensors) -> Sensors {
        let now = exact.gyro.time;
        let FlowAngles { angle_of_attack_rad, sideslip_rad } = exact.vanes.value;
        let barometer = self.barometer.step(now, [exact.barometer.value.pressure_pa]);
        let pitot = self.pitot.step(now, [exact.pitot.value.impact_pa]);
        let vanes = self.vanes.step(now, [angle_of_attack_rad, sideslip_rad]);
        let engine = self.engine_monitor.step(now, [exact.engine_n.value]);
        let air_data = self.air_data.of(barometer.value[0], pitot.value[0]);
        Sensors {
            gyro: self.gyro.body(now, &exact.gyro.value),
            accelerometer: self.accelerometer.body(now, &exact.accelerometer.value),
            attitude: self.attitude.step(now, &exact.attitude.value),
            gnss: self.gnss.step(now, &exact.gnss.value),
            barometer: with(&barometer, |[pressure_pa]| StaticPressure {
                pressure_pa,
                altitude_m: air_data.altitude_m,
            }),
            pitot: with(&pitot, |[impact_pa]| ImpactPressure {
                impact_pa,
                airspeed_m_s: air_data.airspeed_m_s,
            }),
            vanes: with(&vanes, |[angle_of_attack_rad, sideslip_rad]| FlowAngles {
                angle_of_attack_rad,
                sideslip_rad,
            }),
            engine_n: with(&engine, |[thrust_n]| thrust_n),
            magnetometer_nt: self.magnetometer.body(now, &exact.magnetometer_nt.value),
            fitted: exact.fitted,
        }
    }
}

impl AirDataComputer {
    /// What follows from a static and an impact pressure, Pa. Both sensors are slower than the controller, so usually neither
    /// has changed.
    fn of(&mut self, static_pa: f64, impact_pa: f64) -> Self {
        if [static_pa, impact_pa].map(f64::to_bits)
            != [self.static_pa, self.impact_pa].map(f64::to_bits)
        {
            *self = Self::new(static_pa, impact_pa);
        }
        *self
    }

    fn new(static_pa: f64, impact_pa: f64) -> Self {
        Self {
            static_pa,
            impact_pa,
            altitude_m: pressure_altitude_m(static_pa),
            // The air data computer takes the static pressure that it has.
            airspeed_m_s: airspeed_m_s(impact_pa, static_pa.max(1.0)),
        }
    }
}

/// The same sample with another value.
fn with<T: Copy, U>(sample: &Sample<T>, value: impl FnOnce(T) -> U) -> Sample<U> {
    Sample { time: sample.time, valid: sample.valid, value: value(sample.value) }
}

/// True airspeed, m/s, of an air data computer that takes the temperature of US-1976 at the pressure altitude.
pub(super) fn airspeed_m_s(impact_pa: f64, static_pa: f64) -> f64 {
    let ratio = 1.0 + (impact_pa / static_pa).max(0.0);
    // M² = 5 ((q_c/p + 1)^(2/7) - 1).
    let mach_2 = 2.0 / (HEAT_RATIO - 1.0) * (libm::exp(libm::log(ratio) / 3.5) - 1.0);
    mach_2.sqrt() * speed_of_sound(pressure_altitude_m(static_pa))
}

impl<const N: usize> Sensor<N> {
    fn new((errors, period_us, normals): (&Errors, u32, Normals)) -> Self {
        Self { clock: Clock::new(errors), errors: AxisErrors::new(errors, period_us, normals) }
    }

    fn step(&mut self, now: SimTime, exact: [f64; N]) -> Sample<[f64; N]> {
        self.clock.step(now, || self.errors.apply(&exact))
    }
}

impl Sensor<3> {
    fn body(&mut self, now: SimTime, exact: &Body) -> Sample<Body> {
        with(&self.step(now, exact.0.into()), |[x, y, z]| Body::new(x, y, z))
    }
}

impl AttitudeUnit {
    fn step(&mut self, now: SimTime, exact: &Attitude) -> Sample<Attitude> {
        self.clock.step(now, || {
            let error = self.angles.apply(&[0.0; 3]);
            turned(exact, error)
        })
    }
}

impl Receiver {
    fn step(&mut self, now: SimTime, exact: &GnssFix) -> Sample<GnssFix> {
        self.clock.step(now, || {
            let [north, east, down] = self.position.apply(&[0.0; 3]);
            let velocity = self.velocity.apply(&exact.velocity.0.into());
            moved(exact, [north, east, self.vertical_factor * down], Ned(velocity.into()))
        })
    }
}

/// The attitude turned by these angles, rad, about the body axes.
pub(super) fn turned(attitude: &Attitude, [roll, pitch, yaw]: [f64; 3]) -> Attitude {
    if [roll, pitch, yaw] == [0.0; 3] {
        return *attitude;
    }
    let angle = Body::new(roll, pitch, yaw).0;
    let half = 0.5 * angle.norm();
    let (sin, b) = (libm::sin(half), libm::cos(half));
    let [i, j, k]: [f64; 3] = (angle * (0.5 * sin / half)).into();
    let [w, x, y, z] = attitude.wxyz();
    Attitude::from_quaternion(
        w * b - x * i - y * j - z * k,
        x * b + w * i + y * k - z * j,
        y * b + w * j + z * i - x * k,
        z * b + w * k + x * j - y * i,
    )
}

/// The fix with this error of its position, m, NED, and this velocity.
pub(super) fn moved(fix: &GnssFix, [north, east, down]: [f64; 3], velocity: Ned) -> GnssFix {
    let cosine = libm::cos(fix.latitude_rad).max(1.0e-3);
    GnssFix {
        velocity,
        position: Ned(fix.position.0 + nalgebra::Vector3::new(north, east, down)),
        latitude_rad: fix.latitude_rad + north / EARTH_RADIUS_M,
        longitude_rad: fix.longitude_rad + east / (EARTH_RADIUS_M * cosine),
        altitude_m: fix.altitude_m - down,
        ..*fix
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_data_follow_each_change_of_a_pressure_to_the_bit() {
        let mut computer = AirDataComputer::new(f64::NAN, f64::NAN);
        let (low, high, slow, fast) = (60_000.0, 30_000.0, 500.0, 20_000.0);
        let (broken, zero) = (f64::NAN, 0.0);
        for (static_pa, impact_pa) in [
            (low, slow),
            (low, slow),
            (low, fast),
            (high, fast),
            (broken, fast),
            (broken, broken),
            (zero, -zero),
            (zero, zero),
        ] {
            let AirDataComputer { altitude_m, airspeed_m_s: speed_m_s, .. } =
                computer.of(static_pa, impact_pa);
            let expected =
                [pressure_altitude_m(static_pa), airspeed_m_s(impact_pa, static_pa.max(1.0))];
            assert_eq!([altitude_m, speed_m_s].map(f64::to_bits), expected.map(f64::to_bits));
        }
    }
}
