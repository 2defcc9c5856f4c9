//! Grades: the errors of each sensor, and the keys of a file that have them.

use host_io::problem::Problem;
use icd::fault::SensorKind;
use icd::units::DEG;
use icd::{EffectorKind, Sensors, named};
use serde::{Deserialize, Serialize};

use crate::airframe::Airframe;
use crate::date::Date;
use crate::faults::Fitted;
use crate::range::check_range;

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
pub struct GradeKey {
    pub name: &'static str,
    /// A number with this key times this is in SI units.
    pub to_si: f64,
    min: f64,
    max: f64,
    pub place: fn(&mut Errors) -> &mut f64,
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
const RELATIVE: GradeKey = key!("noise_percent", PERCENT, 0.0, 100.0, relative_noise);
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
static ENGINE_MONITOR: [GradeKey; 6] = in_unit!("n", 1.0, 1.0e6, RELATIVE);
static MAGNETOMETER: [GradeKey; 6] = in_unit!("nt", 1.0, 1.0e5, AXES);
static RADAR_ALTIMETER: [GradeKey; 6] = in_unit!("m", 1.0, 1_000.0, RELATIVE);
static FUEL_GAUGE: [GradeKey; 5] = in_unit!("pct", 1.0, 100.0);
static WEIGHT_ON_WHEELS: [GradeKey; 6] = in_unit!("n", 1.0, 1.0e6, RELATIVE);

/// The keys of a sensor's table.
pub fn keys(sensor: SensorKind) -> impl Iterator<Item = &'static GradeKey> {
    let own: &'static [GradeKey] = match sensor {
        SensorKind::Gyro => &GYRO,
        SensorKind::Accelerometer => &ACCELEROMETER,
        SensorKind::Attitude => &ATTITUDE,
        SensorKind::Gnss => &GNSS,
        SensorKind::Barometer | SensorKind::Pitot => &PRESSURE,
        SensorKind::Vanes => &VANES,
        SensorKind::EngineMonitor => &ENGINE_MONITOR,
        SensorKind::Magnetometer => &MAGNETOMETER,
        SensorKind::RadarAltimeter => &RADAR_ALTIMETER,
        SensorKind::WeightOnWheels => &WEIGHT_ON_WHEELS,
        SensorKind::FuelGauge => &FUEL_GAUGE,
    };
    OF_ALL.iter().chain(own)
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

    /// Checks every number, with the control period in µs.
    pub fn check(&self, period_us: u32) -> Result<(), Problem> {
        let noise_deg_s = self.gyro_noise_rad_s.to_degrees();
        check_range("plant.sensors", "gyro_noise_deg_s", noise_deg_s, 0.0, 100.0)?;
        self.grade.as_ref().map_or(Ok(()), |grade| grade.check(period_us))
    }

    /// Which sensors an aircraft has, and which of its parts can be torn off.
    pub fn fitted_with(&self, airframe: &Airframe, has_ground: bool) -> Fitted {
        Fitted { sensors: self.of(airframe, has_ground), parts: airframe.parts() }
    }

    /// Which sensors an aircraft has, in the order of [`SensorKind::ALL`]; those of the ground only over one.
    pub fn of(&self, airframe: &Airframe, has_ground: bool) -> [bool; Sensors::SENSORS] {
        let mut fitted = self.fitted;
        for sensor in [SensorKind::RadarAltimeter, SensorKind::WeightOnWheels] {
            fitted[sensor as usize] &= has_ground;
        }
        fitted[SensorKind::EngineMonitor as usize] &=
            airframe.effectors.only(EffectorKind::Engine).is_some();
        fitted[SensorKind::FuelGauge as usize] &= airframe.fuel.is_some();
        fitted
    }
}
