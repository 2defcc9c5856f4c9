//! Grades: the errors of each sensor, read from tables with units in their keys.
//!
//! A grade file and the table `[plant.sensors]` of a scenario have the same form; the latter changes single numbers of the former.

use std::fmt;
use std::sync::LazyLock;

use host_io::problem::{Problem, problem};
use icd::fault::SensorKind;
use icd::units::DEG;
use icd::{EffectorKind, EffectorList, Sensors, named};
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use crate::airframe::Airframe;
use crate::config;
use crate::date::Date;
use crate::faults::Fitted;
use crate::range::check_range;

const TACTICAL: &str = include_str!("../../sensors/tactical.toml");
const CONSUMER: &str = include_str!("../../sensors/consumer.toml");

/// Most samples on their way from a sensor to the flight computer.
pub(super) const QUEUE_MAX: usize = 64;

named! {
    /// The grades that come with the program.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
    GradeName {
        /// Exact, with a new sample in every control period.
        #[default]
        Ideal = "ideal",
        /// Tactical-grade inertial unit, certified air data: `plant-sim/sensors/tactical.toml`.
        Tactical = "tactical",
        /// Parts of a hobby autopilot: `plant-sim/sensors/consumer.toml`.
        Consumer = "consumer",
    }
}

impl GradeName {
    /// Its file; `None` for the ideal grade, which has no errors.
    const fn file(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::Ideal => None,
            Self::Tactical => Some(("tactical.toml", TACTICAL)),
            Self::Consumer => Some(("consumer.toml", CONSUMER)),
        }
    }
}

macro_rules! errors {
    ($($(#[$doc:meta])* $field:ident: $exact:expr,)+) => {
        /// Errors of one sensor in SI units: rad, rad/s, m/s², m, m/s, Pa, nT, N. Spreads are one standard deviation.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        pub struct Errors {
            $($(#[$doc])* pub $field: f64,)+
        }

        impl Errors {
            /// Exact, in every control period.
            pub const NONE: Self = Self { $($field: $exact),+ };
        }
    };
}

errors! {
    /// Samples per second; no more than one in each control period.
    rate_hz: 10_000.0,
    /// Time from measurement to arrival, s.
    delay_s: 0.0,
    /// White noise, density over √Hz.
    density: 0.0,
    /// White noise of each sample.
    noise: 0.0,
    /// White noise of each sample, as a part of its value.
    relative_noise: 0.0,
    /// Constant error of a flight.
    bias: 0.0,
    /// Error that wanders: a first-order Gauss-Markov process.
    instability: 0.0,
    /// Its correlation time, s.
    instability_time_s: 100.0,
    /// Error of the scale, as a part of the value.
    scale: 0.0,
    /// Error of the direction of each axis, rad.
    misalignment_rad: 0.0,
    /// Smallest step of the output.
    resolution: 0.0,
    /// Largest output either way.
    range: 1.0e12,
    /// Vertical errors of a position over horizontal ones.
    vertical_factor: 1.0,
    /// White noise of the velocity over the ground, m/s.
    velocity_noise_m_s: 0.0,
}

impl Errors {
    /// Samples per second with this control period, µs.
    pub fn effective_rate_hz(&self, period_us: u32) -> f64 {
        self.rate_hz.min(1.0e6 / f64::from(period_us))
    }
}

/// Errors of all sensors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grade(pub [Errors; Sensors::SENSORS]);

impl Grade {
    /// Exact sensors.
    pub const EXACT: Self = Self([Errors::NONE; Sensors::SENSORS]);

    /// Errors of one sensor.
    pub const fn of(&self, sensor: SensorKind) -> &Errors {
        &self.0[sensor as usize]
    }

    /// Checks every number; the queue of delayed samples depends on the control period, µs.
    pub fn check(&self, period_us: u32) -> Result<(), Problem> {
        for sensor in SensorKind::ALL {
            let errors = self.of(sensor);
            let section = format!("plant.sensors.{}", sensor.key());
            for key in keys(sensor) {
                let mut copy = *errors;
                // Ranges are in the unit of the key.
                let value = *(key.place)(&mut copy) / key.to_si;
                check_range(&section, key.name, value, key.min, key.max)?;
            }
            // With more delay the queue would drop samples before they arrive.
            let longest_ms = 1.0e3 * QUEUE_MAX as f64 / errors.effective_rate_hz(period_us);
            check_range(&section, "delay_ms", errors.delay_s * 1.0e3, 0.0, longest_ms)?;
        }
        Ok(())
    }
}

/// A key of a sensor's table.
struct GradeKey {
    name: &'static str,
    /// A number with this key times this is in SI units.
    to_si: f64,
    min: f64,
    max: f64,
    place: fn(&mut Errors) -> &mut f64,
}

macro_rules! key {
    ($name:expr, $to_si:expr, $min:expr, $max:expr, $field:ident) => {
        GradeKey {
            name: $name,
            to_si: $to_si,
            min: $min,
            max: $max,
            place: |errors| &mut errors.$field,
        }
    };
}

/// Keys in the unit of a sensor, whose suffix, size in SI units and largest spread are given, and further ones.
macro_rules! in_unit {
    ($unit:literal, $si:expr, $max:expr $(, $more:expr)*) => {
        [
            key!(concat!("noise_", $unit), $si, 0.0, $max, noise),
            key!(concat!("bias_", $unit), $si, 0.0, $max, bias),
            key!(concat!("instability_", $unit), $si, 0.0, $max, instability),
            key!(concat!("resolution_", $unit), $si, 0.0, $max, resolution),
            key!(concat!("range_", $unit), $si, 1.0e-6, 1.0e15, range),
            $($more),*
        ]
    };
}

const PERCENT: f64 = 0.01;

static OF_ALL: [GradeKey; 4] = [
    key!("rate_hz", 1.0, 0.01, 10_000.0, rate_hz),
    key!("delay_ms", 1.0e-3, 0.0, 2_000.0, delay_s),
    key!("instability_time_s", 1.0, 0.1, 1.0e6, instability_time_s),
    key!("scale_percent", PERCENT, 0.0, 50.0, scale),
];
const AXES: GradeKey = key!("misalignment_deg", DEG, 0.0, 20.0, misalignment_rad);

static GYRO: [GradeKey; 7] =
    in_unit!("deg_s", DEG, 100.0, AXES, key!("noise_density_deg_s", DEG, 0.0, 10.0, density));
static ACCELEROMETER: [GradeKey; 7] =
    in_unit!("m_s2", 1.0, 100.0, AXES, key!("noise_density_m_s2", 1.0, 0.0, 10.0, density));
static ATTITUDE: [GradeKey; 5] = in_unit!("deg", DEG, 90.0);
static GNSS: [GradeKey; 7] = in_unit!(
    "m",
    1.0,
    10_000.0,
    key!("vertical_factor", 1.0, 0.0, 100.0, vertical_factor),
    key!("velocity_noise_m_s", 1.0, 0.0, 100.0, velocity_noise_m_s)
);
static PRESSURE: [GradeKey; 5] = in_unit!("pa", 1.0, 50_000.0);
static VANES: [GradeKey; 5] = in_unit!("deg", DEG, 45.0);
static ENGINE_MONITOR: [GradeKey; 6] =
    in_unit!("n", 1.0, 1.0e6, key!("noise_percent", PERCENT, 0.0, 100.0, relative_noise));
static MAGNETOMETER: [GradeKey; 6] = in_unit!("nt", 1.0, 1.0e5, AXES);

/// The keys of a sensor's table.
fn keys(sensor: SensorKind) -> impl Iterator<Item = &'static GradeKey> {
    let own: &'static [GradeKey] = match sensor {
        SensorKind::Gyro => &GYRO,
        SensorKind::Accelerometer => &ACCELEROMETER,
        SensorKind::Attitude => &ATTITUDE,
        SensorKind::Gnss => &GNSS,
        SensorKind::Barometer | SensorKind::Pitot => &PRESSURE,
        SensorKind::Vanes => &VANES,
        SensorKind::EngineMonitor => &ENGINE_MONITOR,
        SensorKind::Magnetometer => &MAGNETOMETER,
    };
    OF_ALL.iter().chain(own)
}

/// Whether the aircraft has the sensor.
const FITTED: &str = "fitted";

/// Names of the keys of each sensor.
static NAMES: LazyLock<[Vec<&'static str>; Sensors::SENSORS]> = LazyLock::new(|| {
    let of = |sensor| std::iter::once(FITTED).chain(keys(sensor).map(|key| key.name)).collect();
    SensorKind::ALL.map(of)
});

/// The table of sensor number `SENSOR` as written: some of its numbers.
#[derive(Debug, Default, Clone)]
pub struct SensorTable<const SENSOR: usize> {
    fitted: Option<bool>,
    numbers: Vec<(&'static str, f64)>,
}

impl<const SENSOR: usize> SensorTable<SENSOR> {
    /// Changes the errors of a grade by the numbers of this table, and says whether the aircraft has the sensor.
    fn change(&self, grade: &mut Grade, fitted: &mut [bool; Sensors::SENSORS]) {
        let sensor = SensorKind::ALL[SENSOR];
        for (name, value) in &self.numbers {
            if let Some(key) = keys(sensor).find(|key| key.name == *name) {
                *(key.place)(&mut grade.0[SENSOR]) = value * key.to_si;
            }
        }
        fitted[SENSOR] = self.fitted.unwrap_or(fitted[SENSOR]);
    }
}

impl<'de, const SENSOR: usize> Deserialize<'de> for SensorTable<SENSOR> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // As a struct with these names, since the search for keys asks for fields.
        deserializer.deserialize_struct("SensorTable", &NAMES[SENSOR], Self::default())
    }
}

impl<'de, const SENSOR: usize> Visitor<'de> for SensorTable<SENSOR> {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a table with the errors of the {}", SensorKind::ALL[SENSOR].name())
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut map: A) -> Result<Self, A::Error> {
        while let Some(name) = map.next_key_seed(Name::<SENSOR>)? {
            if name == FITTED {
                self.fitted = Some(map.next_value()?);
            } else {
                self.numbers.push((name, map.next_value()?));
            }
        }
        Ok(self)
    }
}

/// The name of a key.
struct Name<const SENSOR: usize>;

impl<'de, const SENSOR: usize> DeserializeSeed<'de> for Name<SENSOR> {
    type Value = &'static str;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<&'static str, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl<const SENSOR: usize> Visitor<'_> for Name<SENSOR> {
    type Value = &'static str;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key of a sensor")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<&'static str, E> {
        let names = &NAMES[SENSOR];
        let known = names.iter().find(|name| **name == text).copied();
        known.ok_or_else(|| E::unknown_field(text, names))
    }
}

/// Errors of the sensors of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SensorSettings {
    /// White noise of each gyro, rad/s rms of the control samples; only of ideal sensors.
    pub gyro_noise_rad_s: f64,
    /// Name of their grade, which single numbers beside it do not change.
    pub name: GradeName,
    /// Their errors; `None` for ideal sensors.
    pub grade: Option<Grade>,
    /// Which sensors the aircraft has, in the order of [`SensorKind::ALL`].
    pub fitted: [bool; Sensors::SENSORS],
    /// Date of the flight, for the magnetic field.
    pub date: Date,
}

impl SensorSettings {
    /// Ideal sensors.
    pub const IDEAL: Self = Self {
        gyro_noise_rad_s: 0.0,
        name: GradeName::Ideal,
        grade: None,
        fitted: [true; Sensors::SENSORS],
        date: Date::DEFAULT,
    };

    /// Sensors of a grade.
    pub fn of_grade(name: GradeName) -> Self {
        let table = SensorsTable { grade: Some(name), ..SensorsTable::default() };
        table.settings().unwrap_or(Self::IDEAL)
    }

    /// Checks every number, with the control period in µs.
    pub fn check(&self, period_us: u32) -> Result<(), Problem> {
        let noise_deg_s = self.gyro_noise_rad_s.to_degrees();
        check_range("plant.sensors", "gyro_noise_deg_s", noise_deg_s, 0.0, 100.0)?;
        self.grade.as_ref().map_or(Ok(()), |grade| grade.check(period_us))
    }

    /// Which sensors an aircraft has, and which of its parts can be torn off.
    pub fn fitted_with(&self, airframe: &Airframe) -> Fitted {
        Fitted { sensors: self.of(&airframe.effectors), parts: airframe.parts() }
    }

    /// Which sensors an aircraft with these effectors has, in the order of [`SensorKind::ALL`].
    pub fn of(&self, effectors: &EffectorList) -> [bool; Sensors::SENSORS] {
        let mut fitted = self.fitted;
        fitted[SensorKind::EngineMonitor as usize] &=
            effectors.only(EffectorKind::Engine).is_some();
        fitted
    }
}

/// The table with a table for each sensor, and the changes of all of them.
macro_rules! sensors_table {
    ($($sensor:ident: $kind:ident,)+) => {
        /// `[plant.sensors]`, and the file of a grade.
        #[derive(Debug, Default, Clone, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct SensorsTable {
            grade: Option<GradeName>,
            gyro_noise_deg_s: Option<f64>,
            $($sensor: SensorTable<{ SensorKind::$kind as usize }>,)+
        }

        impl SensorsTable {
            /// Changes a grade by the numbers of this table; returns whether there was one.
            fn change(&self, grade: &mut Grade, fitted: &mut [bool; Sensors::SENSORS]) -> bool {
                $(self.$sensor.change(grade, fitted);)+
                [$(&self.$sensor.numbers),+].iter().any(|numbers| !numbers.is_empty())
            }
        }
    };
}

sensors_table! {
    gyro: Gyro,
    accelerometer: Accelerometer,
    attitude: Attitude,
    gnss: Gnss,
    barometer: Barometer,
    pitot: Pitot,
    vanes: Vanes,
    engine_monitor: EngineMonitor,
    magnetometer: Magnetometer,
}

impl SensorsTable {
    /// The settings that the table means.
    pub(crate) fn settings(&self) -> Result<SensorSettings, Problem> {
        let mut settings = SensorSettings::IDEAL;
        let mut grade = Grade::EXACT;
        let of_file = self.grade.and_then(GradeName::file);
        if let Some((name, text)) = of_file {
            config::parse::<Self>(name, text)?.change(&mut grade, &mut settings.fitted);
        }
        let has_numbers = self.change(&mut grade, &mut settings.fitted);
        // Numbers alone make real sensors too, exact in everything else.
        let is_real = of_file.is_some() || has_numbers;
        settings.grade = is_real.then_some(grade);
        settings.name = self.grade.unwrap_or_default();
        if let Some(noise_deg_s) = self.gyro_noise_deg_s {
            // The shipped scenarios have a noise of zero.
            if is_real && noise_deg_s != 0.0 {
                return Err(problem!(
                    "[plant.sensors] gyro_noise_deg_s is of ideal sensors; of others it is gyro.noise_deg_s"
                ));
            }
            settings.gyro_noise_rad_s = noise_deg_s.to_radians();
        }
        Ok(settings)
    }
}
