//! Grade files: the errors of each sensor, read from tables with units in their keys.
//!
//! A grade file and the table `[plant.sensors]` of a scenario have the same form; the latter changes single numbers of the former.

use std::fmt;
use std::sync::LazyLock;

use host_io::problem::{Problem, problem};
use icd::Sensors;
use icd::fault::SensorKind;
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Visitor};

use crate::config;
use crate::sensors::grade::{Grade, GradeName, SensorSettings, keys};

const TACTICAL: &str = include_str!("../sensors/tactical.toml");
const CONSUMER: &str = include_str!("../sensors/consumer.toml");

/// The file of a grade; `None` for the ideal one, which has no errors.
const fn file(grade: GradeName) -> Option<(&'static str, &'static str)> {
    match grade {
        GradeName::Ideal => None,
        GradeName::Tactical => Some(("tactical.toml", TACTICAL)),
        GradeName::Consumer => Some(("consumer.toml", CONSUMER)),
    }
}

/// Sensors of a grade.
pub fn of_grade(name: GradeName) -> SensorSettings {
    let table = SensorsTable { grade: Some(name), ..SensorsTable::default() };
    table.settings().unwrap_or(SensorSettings::IDEAL)
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
    radar_altimeter: RadarAltimeter,
    weight_on_wheels: WeightOnWheels,
    fuel_gauge: FuelGauge,
}

impl SensorsTable {
    /// The settings that the table means.
    pub(crate) fn settings(&self) -> Result<SensorSettings, Problem> {
        let mut settings = SensorSettings::IDEAL;
        let mut grade = Grade::EXACT;
        let of_file = self.grade.and_then(file);
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
