//! `[plant.sensors]` of a scenario, and what it becomes.

use host_io::problem::{Problem, problem};
use icd::fault::SensorKind;
use icd::{EffectorKind, EffectorList, Sensors};
use serde::{Deserialize, Serialize};

use super::{Grade, GradeName, SensorTable};
use crate::airframe::Airframe;
use crate::config;
use crate::date::Date;
use crate::faults::Fitted;
use crate::range::{RangeError, check_range};

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
        table.settings("").unwrap_or(Self::IDEAL)
    }

    /// Checks every number, with the control period in µs.
    pub fn check(&self, period_us: u32) -> Result<(), RangeError> {
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

/// `[plant.sensors]`, and the file of a grade.
#[derive(Debug, Default, Clone, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorsTable {
    grade: Option<GradeName>,
    gyro_noise_deg_s: Option<f64>,
    gyro: SensorTable<{ SensorKind::Gyro as usize }>,
    accelerometer: SensorTable<{ SensorKind::Accelerometer as usize }>,
    attitude: SensorTable<{ SensorKind::Attitude as usize }>,
    gnss: SensorTable<{ SensorKind::Gnss as usize }>,
    barometer: SensorTable<{ SensorKind::Barometer as usize }>,
    pitot: SensorTable<{ SensorKind::Pitot as usize }>,
    vanes: SensorTable<{ SensorKind::Vanes as usize }>,
    engine_monitor: SensorTable<{ SensorKind::EngineMonitor as usize }>,
    magnetometer: SensorTable<{ SensorKind::Magnetometer as usize }>,
}

impl SensorsTable {
    /// The settings that the table of this scenario file means.
    pub(crate) fn settings(&self, file: &str) -> Result<SensorSettings, Problem> {
        let mut settings = SensorSettings::IDEAL;
        let mut grade = Grade::EXACT;
        let of_file = self.grade.and_then(GradeName::file);
        if let Some((name, text)) = of_file {
            config::parse::<Self>(name, text)?.change(&mut grade, &mut settings.fitted);
        }
        let has_numbers = self.change(&mut grade, &mut settings.fitted);
        let is_real = of_file.is_some() || has_numbers;
        settings.grade = is_real.then_some(grade);
        settings.name = self.grade.unwrap_or_default();
        if let Some(noise_deg_s) = self.gyro_noise_deg_s {
            // The shipped scenarios have a noise of zero.
            if is_real && noise_deg_s != 0.0 {
                return Err(problem!(
                    "{file}: [plant.sensors] gyro_noise_deg_s is of ideal sensors; of others it is gyro.noise_deg_s"
                ));
            }
            settings.gyro_noise_rad_s = noise_deg_s.to_radians();
        }
        Ok(settings)
    }

    /// Changes a grade by the numbers of this table; returns whether there was one.
    fn change(&self, grade: &mut Grade, fitted: &mut [bool; Sensors::SENSORS]) -> bool {
        let mut has_numbers = false;
        macro_rules! each {
            ($($sensor:ident),+) => {
                $(self.$sensor.change(grade, fitted);
                has_numbers |= self.$sensor.has_numbers();)+
            };
        }
        each!(
            gyro,
            accelerometer,
            attitude,
            gnss,
            barometer,
            pitot,
            vanes,
            engine_monitor,
            magnetometer
        );
        has_numbers
    }
}
