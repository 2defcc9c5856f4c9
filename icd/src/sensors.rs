//! Sensor data from the aircraft to the flight computer: a sample of each sensor in every control period.
//!
//! An ideal sensor has a new, valid sample in every control period. A sensor with a lower rate repeats its last sample, with
//! the time of measurement, until it has a new one.

use core::ops::Range;

use serde::{Deserialize, Serialize};

use crate::frames::{Attitude, Body, Ned};
use crate::time::SimTime;

/// The latest sample of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sample<T> {
    /// Time of measurement, not of arrival.
    pub time: SimTime,
    /// Whether the sensor declares the value valid.
    pub valid: bool,
    /// The value; finite even if it is not valid.
    pub value: T,
}

/// Time of measurement of a sample, and whether it is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    /// As [`Sample::time`].
    pub time: SimTime,
    /// As [`Sample::valid`].
    pub valid: bool,
}

/// Output of a satellite receiver.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GnssFix {
    /// Velocity over the ground, m/s.
    pub velocity: Ned,
    /// Position from the start point at altitude zero, m, in the NED axes of that point.
    pub position: Ned,
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// Altitude above the ellipsoid (or the flat ground), m.
    pub altitude_m: f64,
    /// Date, in years: 2025.5 is the middle of 2025.
    pub decimal_year: f64,
}

/// Output of a barometer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StaticPressure {
    /// Static pressure, Pa.
    pub pressure_pa: f64,
    /// Altitude, m. Of the ideal unit the true altitude above the ellipsoid (or the flat ground); of any other unit the pressure
    /// altitude: the geopotential altitude of US-1976 with this pressure.
    pub altitude_m: f64,
}

/// Output of a pitot tube with its air data computer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ImpactPressure {
    /// Impact pressure, total minus static, Pa.
    pub impact_pa: f64,
    /// True airspeed, m/s. Of the ideal unit exactly; of any other unit computed from the measured pressures with the
    /// temperature of US-1976.
    pub airspeed_m_s: f64,
}

/// Direction of the airflow.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FlowAngles {
    /// Angle of attack, rad.
    pub angle_of_attack_rad: f64,
    /// Sideslip, rad, positive with the airflow from the right.
    pub sideslip_rad: f64,
}

/// A value as the numbers of the wire and the log.
trait Measured<const N: usize>: Sized {
    fn numbers(&self) -> [f64; N];
    /// Bit for bit: this does not normalise a quaternion.
    fn of(numbers: [f64; N]) -> Self;
    /// What stands for the value of a sensor that the aircraft lacks.
    fn none() -> Self {
        Self::of([0.0; N])
    }
}

impl Measured<1> for f64 {
    fn numbers(&self) -> [f64; 1] {
        [*self]
    }

    fn of([value]: [f64; 1]) -> Self {
        value
    }
}

impl Measured<3> for Body {
    fn numbers(&self) -> [f64; 3] {
        self.0.into()
    }

    fn of([x, y, z]: [f64; 3]) -> Self {
        Self::new(x, y, z)
    }
}

impl Measured<4> for Attitude {
    fn numbers(&self) -> [f64; 4] {
        self.wxyz()
    }

    fn of(wxyz: [f64; 4]) -> Self {
        Self::from_unit_wxyz(wxyz)
    }

    fn none() -> Self {
        // Zeros would be no rotation.
        Self::of([1.0, 0.0, 0.0, 0.0])
    }
}

impl Measured<10> for GnssFix {
    fn numbers(&self) -> [f64; 10] {
        let ([vn, ve, vd], [n, e, d]) = (self.velocity.0.into(), self.position.0.into());
        let Self { latitude_rad, longitude_rad, altitude_m, decimal_year, .. } = *self;
        [vn, ve, vd, n, e, d, latitude_rad, longitude_rad, altitude_m, decimal_year]
    }

    fn of(numbers: [f64; 10]) -> Self {
        let [vn, ve, vd, n, e, d, latitude_rad, longitude_rad, altitude_m, decimal_year] = numbers;
        let (velocity, position) = (Ned::new(vn, ve, vd), Ned::new(n, e, d));
        Self { velocity, position, latitude_rad, longitude_rad, altitude_m, decimal_year }
    }
}

/// Types whose fields are their numbers.
macro_rules! measured {
    ($($type:ident { $first:ident, $second:ident };)+) => {
        $(impl Measured<2> for $type {
            fn numbers(&self) -> [f64; 2] {
                [self.$first, self.$second]
            }

            fn of([$first, $second]: [f64; 2]) -> Self {
                Self { $first, $second }
            }
        })+
    };
}

measured! {
    StaticPressure { pressure_pa, altitude_m };
    ImpactPressure { impact_pa, airspeed_m_s };
    FlowAngles { angle_of_attack_rad, sideslip_rad };
}

impl<T> Sample<T> {
    /// A valid sample, measured at `time`.
    pub const fn at(time: SimTime, value: T) -> Self {
        Self { time, valid: true, value }
    }
}

/// The table of sensors: number on the wire, key in files (with another name in texts), field of [`Sensors`], type, and the names
/// of its numbers, whose last word is the unit. Everything about the list of sensors follows from it.
macro_rules! sensors {
    ($($(#[$doc:meta])* $kind:ident = $code:literal, $key:literal $(($text:literal))?,
        $field:ident: $type:ty, [$($name:literal),+];)+) => {
        /// Sensors that an aircraft can have.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum SensorKind {
            $($(#[$doc])* $kind = $code,)+
        }

        impl SensorKind {
            /// All sensors, in the order of their numbers.
            pub const ALL: [Self; [$($code),+].len()] = [$(Self::$kind),+];

            /// Name in scenario files.
            pub const fn key(self) -> &'static str {
                match self {
                    $(Self::$kind => $key,)+
                }
            }

            /// Name in texts and scripts.
            pub const fn name(self) -> &'static str {
                match self {
                    $($(Self::$kind => $text,)?)+
                    other => other.key(),
                }
            }

            /// The sensor with this name, in scenario files or in texts.
            pub fn by_key(key: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|sensor| sensor.key() == key || sensor.name() == key)
            }

            /// Names of its numbers; the last word is the unit.
            pub const fn signals(self) -> &'static [&'static str] {
                match self {
                    $(Self::$kind => &[$($name),+],)+
                }
            }

            /// Places of its numbers in [`Sensors::to_array`].
            pub fn places(self) -> Range<usize> {
                FIRST[self as usize]..FIRST[self as usize] + self.signals().len()
            }
        }

        /// The latest sample of each sensor.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        pub struct Sensors {
            $($(#[$doc])* pub $field: Sample<$type>,)+
            /// Which sensors the aircraft has, in the order of [`SensorKind::ALL`]. The sample of another one is never valid and
            /// has no value; it is neither sent nor hashed.
            pub fitted: [bool; SensorKind::ALL.len()],
        }

        impl Sensors {
            /// Number of sensors: all of [`SensorKind::ALL`].
            pub const SENSORS: usize = SensorKind::ALL.len();

            /// Number of scalar values of all samples together.
            pub const COUNT: usize = Self::NAMES.len();

            /// Names of the scalar values in the order of [`Sensors::to_array`].
            pub const NAMES: [&'static str; [$($($name),+),+].len()] = [$($($name),+),+];

            /// Names of the samples' times in the order of [`Sensors::stamps`].
            pub const TIMES: [&'static str; Self::SENSORS] = [$(concat!($key, "_time_us")),+];

            /// Names of the samples' validity in the order of [`Sensors::stamps`].
            pub const VALID: [&'static str; Self::SENSORS] = [$(concat!($key, "_valid")),+];

            /// The scalar values, sensor by sensor.
            pub fn to_array(&self) -> [f64; Self::COUNT] {
                let mut all = [0.0; Self::COUNT];
                let mut left = &mut all[..];
                $(
                    let numbers: [f64; [$($name),+].len()] = self.$field.value.numbers();
                    let (these, others) = left.split_at_mut(numbers.len());
                    these.copy_from_slice(&numbers);
                    left = others;
                )+
                debug_assert!(left.is_empty());
                all
            }

            /// Time and validity of each sample, in the order of [`SensorKind::ALL`].
            pub fn stamps(&self) -> [Stamp; Self::SENSORS] {
                [$(Stamp { time: self.$field.time, valid: self.$field.valid }),+]
            }

            /// From the scalar values, bit for bit, of an aircraft with all sensors.
            pub fn new(stamps: &[Stamp; Self::SENSORS], values: &[f64; Self::COUNT]) -> Self {
                let mut left = &values[..];
                $(
                    let (numbers, others) = left.split_at([$($name),+].len());
                    let mut these = [0.0; [$($name),+].len()];
                    these.copy_from_slice(numbers);
                    let Stamp { time, valid } = stamps[SensorKind::$kind as usize];
                    let $field = Sample { time, valid, value: Measured::of(these) };
                    left = others;
                )+
                debug_assert!(left.is_empty());
                Self { $($field,)+ fitted: [true; Self::SENSORS] }
            }

            /// Leaves these sensors, in the order of [`SensorKind::ALL`]; the aircraft lacks the others.
            pub fn keep(&mut self, fitted: &[bool; Self::SENSORS]) {
                self.fitted = *fitted;
                $(if !fitted[SensorKind::$kind as usize] {
                    self.$field = Sample { time: SimTime::ZERO, valid: false, value: Measured::none() };
                })+
            }

            /// Declares the samples of these sensors invalid.
            pub fn invalidate(&mut self, is_meant: impl Fn(SensorKind) -> bool) {
                $(self.$field.valid &= !is_meant(SensorKind::$kind);)+
            }

            /// Takes the sample of a sensor from others.
            pub fn copy_sample(&mut self, sensor: SensorKind, from: &Self) {
                match sensor {
                    $(SensorKind::$kind => self.$field = from.$field,)+
                }
            }

            /// Takes the value of a sensor from others; its time and validity stay.
            pub fn copy_value(&mut self, sensor: SensorKind, from: &Self) {
                match sensor {
                    $(SensorKind::$kind => self.$field.value = from.$field.value,)+
                }
            }
        }
    };
}

sensors! {
    /// Body rates p, q, r relative to inertial space, rad/s.
    Gyro = 0, "gyro", gyro: Body, ["body_rate_p_rad_s", "body_rate_q_rad_s", "body_rate_r_rad_s"];
    /// Specific force, m/s²: (0, 0, -g) at rest on the ground.
    Accelerometer = 1, "accelerometer", accelerometer: Body,
        ["specific_force_x_m_s2", "specific_force_y_m_s2", "specific_force_z_m_s2"];
    /// Attitude relative to the local NED axes (inertial navigation unit).
    Attitude = 2, "attitude", attitude: Attitude,
        ["attitude_w", "attitude_x", "attitude_y", "attitude_z"];
    /// Position and velocity.
    Gnss = 3, "gnss", gnss: GnssFix, [
        "velocity_north_m_s", "velocity_east_m_s", "velocity_down_m_s",
        "position_north_m", "position_east_m", "position_down_m",
        "latitude_rad", "longitude_rad", "gnss_altitude_m", "decimal_year"
    ];
    /// Static pressure and the altitude by it.
    Barometer = 4, "barometer", barometer: StaticPressure, ["static_pressure_pa", "altitude_m"];
    /// Impact pressure and the true airspeed by it.
    Pitot = 5, "pitot", pitot: ImpactPressure, ["impact_pressure_pa", "airspeed_m_s"];
    /// Angle of attack and sideslip.
    Vanes = 6, "vanes", vanes: FlowAngles, ["angle_of_attack_rad", "sideslip_rad"];
    /// Thrust by the engine monitor, N.
    EngineMonitor = 7, "engine_monitor" ("engine monitor"), engine_n: f64, ["thrust_n"];
    /// Magnetic field, nT, body axes.
    Magnetometer = 8, "magnetometer", magnetometer_nt: Body,
        ["magnetic_field_x_nt", "magnetic_field_y_nt", "magnetic_field_z_nt"];
    /// Height of the lowest contact point above the ground, m. Only over a ground.
    RadarAltimeter = 9, "radar_altimeter" ("radar altimeter"), radar_altimeter_m: f64,
        ["height_above_ground_m"];
    /// Load of all contact points across the ground, N. Only over a ground.
    WeightOnWheels = 10, "weight_on_wheels" ("weight on wheels"), weight_on_wheels_n: f64,
        ["weight_on_wheels_n"];
    /// Fuel in the tank, percent of a full one. Only of an aircraft that burns fuel.
    FuelGauge = 11, "fuel_gauge" ("fuel gauge"), fuel_gauge_pct: f64, ["fuel_pct"];
}

/// Place of each sensor's first number.
const FIRST: [usize; Sensors::SENSORS] = {
    let mut first = [0; Sensors::SENSORS];
    let mut sensor = 1;
    while sensor < first.len() {
        first[sensor] = first[sensor - 1] + SensorKind::ALL[sensor - 1].signals().len();
        sensor += 1;
    }
    first
};

impl Sensors {
    /// The sensors that the aircraft has.
    pub fn present(&self) -> impl Iterator<Item = SensorKind> + use<> {
        let fitted = self.fitted;
        SensorKind::ALL.into_iter().filter(move |sensor| fitted[*sensor as usize])
    }

    /// As [`Sensors::new`] with every sample valid and measured at `time`.
    pub fn at(time: SimTime, values: &[f64; Self::COUNT]) -> Self {
        Self::new(&[Stamp { time, valid: true }; Self::SENSORS], values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_the_sensors_follow_each_other_and_have_names_of_their_own() {
        let mut names = std::collections::BTreeSet::new();
        let mut next = 0;
        for (place, kind) in SensorKind::ALL.into_iter().enumerate() {
            assert_eq!((kind as usize, kind.places().start), (place, next));
            assert_eq!(&Sensors::NAMES[kind.places()], kind.signals());
            assert!(kind.signals().iter().all(|name| names.insert(*name)), "{kind:?}");
            next = kind.places().end;
        }
        assert_eq!(next, Sensors::COUNT);
    }

    #[test]
    fn a_sensor_that_the_aircraft_lacks_has_no_sample() {
        let mut sensors = Sensors::at(SimTime::from_micros(5), &[0.5; Sensors::COUNT]);
        let lacking = [SensorKind::Attitude, SensorKind::Vanes];
        sensors.keep(&SensorKind::ALL.map(|kind| !lacking.contains(&kind)));
        for kind in SensorKind::ALL {
            let stamp = sensors.stamps()[kind as usize];
            assert_eq!(stamp.valid, !lacking.contains(&kind));
            assert_eq!(sensors.present().any(|other| other == kind), stamp.valid);
        }
        assert_eq!(sensors.attitude.value.wxyz(), [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(sensors.vanes.value.sideslip_rad, 0.0);
    }

    #[test]
    fn a_copy_changes_one_sensor() {
        let from = Sensors::at(SimTime::from_micros(5), &[2.0; Sensors::COUNT]);
        let to = Sensors::at(SimTime::ZERO, &[1.0; Sensors::COUNT]);
        for kind in SensorKind::ALL {
            for keeps_time in [false, true] {
                let mut changed = to;
                match keeps_time {
                    false => changed.copy_sample(kind, &from),
                    true => changed.copy_value(kind, &from),
                }
                for (place, value) in changed.to_array().into_iter().enumerate() {
                    assert_eq!(value, if kind.places().contains(&place) { 2.0 } else { 1.0 });
                }
                let copied = if keeps_time { to } else { from };
                assert_eq!(changed.stamps()[kind as usize], copied.stamps()[kind as usize]);
            }
        }
    }

    #[test]
    fn each_sensor_keeps_its_own_stamp_and_its_own_numbers() {
        let stamps = core::array::from_fn(|index| Stamp {
            time: SimTime::from_micros(index as u64),
            valid: index.is_multiple_of(3),
        });
        let values = core::array::from_fn(|index| 1.0 / (1.0 + index as f64));
        let sensors = Sensors::new(&stamps, &values);
        assert_eq!((sensors.stamps(), sensors.to_array()), (stamps, values));
        assert_eq!(sensors.vanes.time, SimTime::from_micros(6));
        assert_eq!(sensors.vanes.value.sideslip_rad, values[25]);
    }
}
