//! Sensors with rates, delays and errors.

use std::collections::VecDeque;

use icd::fault::SensorKind;
use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{
    Attitude, Body, FlowAngles, GnssFix, ImpactPressure, Ned, Sample, Sensors, SimTime,
    StaticPressure,
};

use super::grade::{Errors, Grade, QUEUE_MAX};
use crate::atmosphere::{Atmosphere, HEAT_RATIO, pressure_altitude_m};
use crate::faults::micros;
use crate::noise::{Normals, Source};

/// Radius that turns an error of a position in m into one of latitude and longitude, m.
const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// Sensors with errors; each has random numbers of its own.
#[derive(Debug, Clone)]
pub(super) struct RealSensors {
    gyro: Sensor<3>,
    accelerometer: Sensor<3>,
    attitude: Sensor<3, Attitude>,
    gnss: Receiver,
    barometer: Sensor<1>,
    pitot: Sensor<1>,
    vanes: Sensor<2>,
    engine_monitor: Sensor<1>,
    magnetometer: Sensor<3>,
    radar_altimeter: Sensor<1>,
    weight_on_wheels: Sensor<1>,
    fuel_gauge: Sensor<1>,
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

/// A sensor with errors of its axes; its samples are their values, or made of them.
#[derive(Debug, Clone)]
struct Sensor<const N: usize, T = [f64; N]> {
    clock: Clock<T>,
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

impl RealSensors {
    /// Draws the constant errors; the random streams belong to seed and run.
    pub fn new(grade: &Grade, period_us: u32, seed: u64, run: u64) -> Self {
        let normals = |sensor| Normals::new(seed, run, Source::Sensor(sensor));
        let errors = |sensor| (grade.of(sensor), period_us, normals(sensor));
        let gnss = grade.of(SensorKind::Gnss);
        let velocity =
            Errors { rate_hz: gnss.rate_hz, noise: gnss.velocity_noise_m_s, ..Errors::NONE };
        Self {
            gyro: Sensor::new(errors(SensorKind::Gyro)),
            accelerometer: Sensor::new(errors(SensorKind::Accelerometer)),
            attitude: Sensor::new(errors(SensorKind::Attitude)),
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
            radar_altimeter: Sensor::new(errors(SensorKind::RadarAltimeter)),
            weight_on_wheels: Sensor::new(errors(SensorKind::WeightOnWheels)),
            fuel_gauge: Sensor::new(errors(SensorKind::FuelGauge)),
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
        let air_data = self.air_data.of(barometer.value[0], pitot.value[0]);
        Sensors {
            gyro: self.gyro.body(now, &exact.gyro.value),
            accelerometer: self.accelerometer.body(now, &exact.accelerometer.value),
            attitude: self.attitude.turned(now, &exact.attitude.value),
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
            engine_n: self.engine_monitor.scalar(now, exact.engine_n.value),
            magnetometer_nt: self.magnetometer.body(now, &exact.magnetometer_nt.value),
            radar_altimeter_m: self.radar_altimeter.scalar(now, exact.radar_altimeter_m.value),
            weight_on_wheels_n: self.weight_on_wheels.scalar(now, exact.weight_on_wheels_n.value),
            fuel_gauge_pct: self.fuel_gauge.scalar(now, exact.fuel_gauge_pct.value),
            fitted: exact.fitted,
        }
    }
}

impl AirDataComputer {
    /// What follows from a static and an impact pressure, Pa. Both sensors are slower than the controller, so usually neither
    /// has changed.
    fn of(&mut self, static_pa: f64, impact_pa: f64) -> Self {
        // By bits, because NaN, which stands for no pressure yet, differs from itself.
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
    mach_2.sqrt() * Atmosphere::STANDARD.speed_of_sound(pressure_altitude_m(static_pa))
}

impl<const N: usize, T: Copy> Sensor<N, T> {
    fn new((errors, period_us, normals): (&Errors, u32, Normals)) -> Self {
        Self { clock: Clock::new(errors), errors: AxisErrors::new(errors, period_us, normals) }
    }
}

impl<const N: usize> Sensor<N> {
    fn step(&mut self, now: SimTime, exact: [f64; N]) -> Sample<[f64; N]> {
        self.clock.step(now, || self.errors.apply(&exact))
    }
}

impl Sensor<1> {
    fn scalar(&mut self, now: SimTime, exact: f64) -> Sample<f64> {
        with(&self.step(now, [exact]), |[value]| value)
    }
}

impl Sensor<3> {
    fn body(&mut self, now: SimTime, exact: &Body) -> Sample<Body> {
        with(&self.step(now, exact.0.into()), |[x, y, z]| Body::new(x, y, z))
    }
}

impl Sensor<3, Attitude> {
    fn turned(&mut self, now: SimTime, exact: &Attitude) -> Sample<Attitude> {
        self.clock.step(now, || turned(exact, self.errors.apply(&[0.0; 3])))
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
    // The bits stay, and half of a zero angle would be a divisor.
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
    // Near a pole a metre to the east is any longitude.
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

/// Time between two changes of an error that wanders, s; its correlation time is much longer.
const WANDER_EVERY_S: f64 = 0.1;

/// Rate and delay of a sensor: keeps its samples until they arrive, and the last one that did.
#[derive(Debug, Clone)]
struct Clock<T> {
    rate_hz: f64,
    delay_us: u64,
    /// Number of the last sample since time zero.
    number: f64,
    queue: VecDeque<Sample<T>>,
    last: Option<Sample<T>>,
}

impl<T: Copy> Clock<T> {
    pub fn new(errors: &Errors) -> Self {
        let queue = VecDeque::with_capacity(QUEUE_MAX + 1);
        let (rate_hz, delay_us) = (errors.rate_hz, micros(errors.delay_s));
        Self { rate_hz, delay_us, number: 0.0, queue, last: None }
    }

    /// The latest sample that has arrived by `now`; `measure` makes a new one where one is due.
    ///
    /// The first sample of a flight arrives at once, because the sensors run since before it.
    pub fn step(&mut self, now: SimTime, measure: impl FnOnce() -> T) -> Sample<T> {
        // A millionth of a sample against rounding.
        let reached = now.as_seconds() * self.rate_hz + 1.0e-6;
        let Some(last) = &mut self.last else {
            self.number = libm::floor(reached);
            return *self.last.insert(Sample::at(now, measure()));
        };
        if reached >= self.number + 1.0 {
            self.number = libm::floor(reached);
            let sample = Sample::at(now, measure());
            if self.delay_us == 0 {
                *last = sample;
                return sample;
            }
            if self.queue.len() > QUEUE_MAX {
                self.queue.pop_front();
            }
            self.queue.push_back(sample);
        }
        let (delay_us, now_us) = (self.delay_us, now.as_micros());
        while let Some(sample) =
            self.queue.pop_front_if(|sample| sample.time.as_micros() + delay_us <= now_us)
        {
            *last = sample;
        }
        *last
    }
}

/// Errors of the axes of a sensor, with their random numbers.
#[derive(Debug, Clone)]
struct AxisErrors<const N: usize> {
    matrix: [[f64; N]; N],
    bias: [f64; N],
    /// The error that wanders now, and how it does.
    wandering: [f64; N],
    decay: f64,
    kick: f64,
    /// Samples between two changes of it, and how many are left.
    every: u32,
    left: u32,
    /// White noise of a sample.
    noise: f64,
    relative_noise: f64,
    resolution: f64,
    range: f64,
    normals: Normals,
}

impl<const N: usize> AxisErrors<N> {
    /// Draws the errors that are constant in a flight; with a control period in µs.
    pub fn new(errors: &Errors, period_us: u32, mut normals: Normals) -> Self {
        let rate_hz = errors.effective_rate_hz(period_us);
        // Only an error that is there draws a number: exact sensors keep their bits.
        let mut spread = |size: f64| if size > 0.0 { size * normals.draw() } else { 0.0 };
        let bias = [(); N].map(|()| spread(errors.bias));
        let wandering = [(); N].map(|()| spread(errors.instability));
        let mut matrix = [[0.0; N]; N];
        for (row, axis) in matrix.iter_mut().enumerate() {
            for (column, part) in axis.iter_mut().enumerate() {
                *part = match row == column {
                    true => 1.0 + spread(errors.scale),
                    false => spread(errors.misalignment_rad),
                };
            }
        }
        // At most a thousand.
        let every = libm::round(WANDER_EVERY_S * rate_hz).max(1.0) as u32;
        let decay = libm::exp(-f64::from(every) / (rate_hz * errors.instability_time_s));
        Self {
            matrix,
            bias,
            wandering,
            decay,
            // With this the variance of the error stays what it was drawn with.
            kick: errors.instability * (1.0 - decay * decay).sqrt(),
            every,
            left: every,
            noise: libm::hypot(errors.noise, errors.density * rate_hz.sqrt()),
            relative_noise: errors.relative_noise,
            resolution: errors.resolution,
            range: errors.range,
            normals,
        }
    }

    /// The output of the next sample of these exact values.
    pub fn apply(&mut self, exact: &[f64; N]) -> [f64; N] {
        self.wander();
        let mut out = [0.0; N];
        for (axis, out) in out.iter_mut().enumerate() {
            let value: f64 = self.matrix[axis].iter().zip(exact).map(|(part, x)| part * x).sum();
            let mut sum = value + self.bias[axis] + self.wandering[axis];
            if self.noise > 0.0 {
                sum += self.noise * self.normals.draw();
            }
            if self.relative_noise > 0.0 {
                sum += self.relative_noise * value * self.normals.draw();
            }
            // After the noise, as a converter rounds what it gets.
            if self.resolution > 0.0 {
                sum = libm::round(sum / self.resolution) * self.resolution;
            }
            *out = sum.max(-self.range).min(self.range);
        }
        out
    }

    /// The error of the present output at these exact values, without noise, resolution and range.
    pub fn systematic(&self, exact: &[f64; N]) -> [f64; N] {
        let mut out = [0.0; N];
        for (axis, out) in out.iter_mut().enumerate() {
            let value: f64 = self.matrix[axis].iter().zip(exact).map(|(part, x)| part * x).sum();
            *out = value - exact[axis] + self.bias[axis] + self.wandering[axis];
        }
        out
    }

    fn wander(&mut self) {
        self.left -= 1;
        if self.left > 0 {
            return;
        }
        self.left = self.every;
        if self.kick > 0.0 {
            for error in &mut self.wandering {
                *error = self.decay * *error + self.kick * self.normals.draw();
            }
        }
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

#[cfg(test)]
mod channel_tests {
    use super::*;
    use crate::noise::Source;
    use icd::fault::SensorKind;

    fn normals() -> Normals {
        Normals::new(1, 0, Source::Sensor(SensorKind::Barometer))
    }

    fn tick(number: u64) -> SimTime {
        SimTime::from_micros(2_000 * number)
    }

    #[test]
    fn a_sample_comes_at_its_rate_and_arrives_after_its_delay() {
        let errors = Errors { rate_hz: 50.0, delay_s: 0.03, ..Errors::NONE };
        let mut clock = Clock::new(&errors);
        for number in 0..1_000 {
            let sample = clock.step(tick(number), || number);
            // Every tenth tick, 15 ticks later; the first one at once.
            let expected = number.saturating_sub(15) / 10 * 10;
            assert_eq!(sample, Sample::at(tick(expected), expected), "tick {number}");
        }
    }

    #[test]
    fn a_rate_above_the_control_rate_gives_a_sample_in_every_period() {
        let mut clock = Clock::new(&Errors { rate_hz: 8_000.0, ..Errors::NONE });
        for number in 0..100 {
            assert_eq!(clock.step(tick(number), || number).value, number);
        }
    }

    #[test]
    fn without_errors_the_value_keeps_its_bits() {
        let mut exact = AxisErrors::<3>::new(&Errors::NONE, 2_000, normals());
        let values = [0.1, -1.0 / 3.0, 1.0e5];
        assert_eq!(exact.apply(&values), values);
    }

    /// Mean and spread of many first samples, each of another flight.
    fn statistics(errors: &Errors, exact: f64) -> [f64; 2] {
        let flights = 4_000;
        let (mut sum, mut square) = (0.0, 0.0);
        for run in 0..flights {
            let normals = Normals::new(1, run, Source::Sensor(SensorKind::Pitot));
            let [value] = AxisErrors::<1>::new(errors, 2_000, normals).apply(&[exact]);
            sum += value;
            square += (value - exact) * (value - exact);
        }
        [sum / flights as f64, (square / flights as f64).sqrt()]
    }

    #[test]
    fn each_error_has_its_size() {
        // The spread of 4000 numbers is known to 1.1 %; five times that is allowed.
        for (errors, exact, spread) in [
            (Errors { bias: 3.0, ..Errors::NONE }, 100.0, 3.0),
            (Errors { noise: 2.0, ..Errors::NONE }, 100.0, 2.0),
            (Errors { instability: 4.0, ..Errors::NONE }, 100.0, 4.0),
            (Errors { scale: 0.02, ..Errors::NONE }, 100.0, 2.0),
            (Errors { relative_noise: 0.05, ..Errors::NONE }, 100.0, 5.0),
            // 500 samples a second: √500.
            (Errors { density: 0.1, ..Errors::NONE }, 0.0, 2.236),
        ] {
            let [mean, ours] = statistics(&errors, exact);
            assert!((ours / spread - 1.0).abs() < 0.056, "{ours} instead of {spread}: {errors:?}");
            assert!((mean - exact).abs() < 0.08 * spread, "{mean}: {errors:?}");
        }
    }

    #[test]
    fn the_output_is_in_steps_and_within_the_range() {
        let errors = Errors { resolution: 0.5, range: 10.0, ..Errors::NONE };
        let mut axis = AxisErrors::<1>::new(&errors, 2_000, normals());
        for (exact, out) in [(0.26, 0.5), (0.24, 0.0), (-3.3, -3.5), (99.0, 10.0), (-99.0, -10.0)] {
            assert_eq!(axis.apply(&[exact]), [out]);
        }
    }

    #[test]
    fn a_misaligned_axis_sees_the_others() {
        let errors = Errors { misalignment_rad: 0.01, ..Errors::NONE };
        let [x, y, z] = AxisErrors::<3>::new(&errors, 2_000, normals()).apply(&[100.0, 0.0, 0.0]);
        assert!(x == 100.0 && y != 0.0 && z != 0.0 && y.abs() < 5.0 && z.abs() < 5.0, "{y} {z}");
    }

    #[test]
    fn an_error_that_wanders_forgets_over_its_correlation_time() {
        let errors =
            Errors { rate_hz: 50.0, instability: 1.0, instability_time_s: 10.0, ..Errors::NONE };
        let mut axis = AxisErrors::<1>::new(&errors, 2_000, normals());
        let values: Vec<f64> = (0..500_000).map(|_| axis.apply(&[0.0])[0]).collect();
        let product = |lag: usize| {
            let pairs = values.iter().zip(&values[lag..]);
            pairs.map(|(a, b)| a * b).sum::<f64>() / (values.len() - lag) as f64
        };
        // 10,000 s are 500 independent values: 0.06; three times that is allowed.
        assert!((product(0) - 1.0).abs() < 0.2, "{}", product(0));
        assert!((product(500) - libm::exp(-1.0)).abs() < 0.2, "{}", product(500));
    }
}
