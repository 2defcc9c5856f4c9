//! Sensor data from the aircraft to the flight computer: a sample of each sensor in every control period.
//!
//! An ideal sensor has a new, valid sample in every control period. A sensor with a lower rate repeats its last sample, with
//! the time of measurement, until it has a new one.

use serde::{Deserialize, Serialize};

use crate::frames::{Attitude, Body, Ned};
use crate::time::SimTime;

/// Sensors that an aircraft can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum SensorKind {
    /// Body rates.
    Gyro = 0,
    /// Specific force.
    Accelerometer = 1,
    /// Attitude of the inertial navigation.
    Attitude = 2,
    /// Position and velocity.
    Gnss = 3,
    /// Static pressure, as altitude.
    Barometer = 4,
    /// Dynamic pressure, as airspeed.
    Pitot = 5,
    /// Angle of attack and sideslip.
    Vanes = 6,
    /// Thrust.
    EngineMonitor = 7,
    /// Magnetic field.
    Magnetometer = 8,
}

impl SensorKind {
    /// All sensors, in the order of their numbers.
    pub const ALL: [Self; 9] = [
        Self::Gyro,
        Self::Accelerometer,
        Self::Attitude,
        Self::Gnss,
        Self::Barometer,
        Self::Pitot,
        Self::Vanes,
        Self::EngineMonitor,
        Self::Magnetometer,
    ];

    /// Name in texts and scripts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::EngineMonitor => "engine monitor",
            other => other.key(),
        }
    }

    /// Name in scenario files.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Gyro => "gyro",
            Self::Accelerometer => "accelerometer",
            Self::Attitude => "attitude",
            Self::Gnss => "gnss",
            Self::Barometer => "barometer",
            Self::Magnetometer => "magnetometer",
            Self::Pitot => "pitot",
            Self::Vanes => "vanes",
            Self::EngineMonitor => "engine_monitor",
        }
    }

    /// The sensor with this name, in scenario files or in texts.
    pub fn by_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|sensor| sensor.key() == key || sensor.name() == key)
    }
}

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

/// The latest sample of each sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sensors {
    /// Body rates p, q, r relative to inertial space, rad/s.
    pub gyro: Sample<Body>,
    /// Specific force, m/s²: (0, 0, -g) at rest on the ground.
    pub accelerometer: Sample<Body>,
    /// Attitude relative to the local NED axes (inertial navigation unit).
    pub attitude: Sample<Attitude>,
    /// Position and velocity.
    pub gnss: Sample<GnssFix>,
    /// Static pressure and the altitude by it.
    pub barometer: Sample<StaticPressure>,
    /// Impact pressure and the true airspeed by it.
    pub pitot: Sample<ImpactPressure>,
    /// Angle of attack and sideslip.
    pub vanes: Sample<FlowAngles>,
    /// Thrust by the engine monitor, N.
    pub engine_n: Sample<f64>,
    /// Magnetic field, nT, body axes.
    pub magnetometer_nt: Sample<Body>,
}

impl<T> Sample<T> {
    /// A valid sample, measured at `time`.
    pub const fn at(time: SimTime, value: T) -> Self {
        Self { time, valid: true, value }
    }

    fn stamped(Stamp { time, valid }: Stamp, value: T) -> Self {
        Self { time, valid, value }
    }

    const fn stamp(&self) -> Stamp {
        Stamp { time: self.time, valid: self.valid }
    }
}

impl Sensors {
    /// Number of sensors: all of [`SensorKind::ALL`].
    pub const SENSORS: usize = SensorKind::ALL.len();

    /// Number of scalar values of all samples together.
    pub const COUNT: usize = 30;

    /// Names of the scalar values in the order of [`Sensors::to_array`].
    pub const NAMES: [&'static str; Self::COUNT] = [
        "body_rate_p_rad_s",
        "body_rate_q_rad_s",
        "body_rate_r_rad_s",
        "specific_force_x_m_s2",
        "specific_force_y_m_s2",
        "specific_force_z_m_s2",
        "attitude_w",
        "attitude_x",
        "attitude_y",
        "attitude_z",
        "velocity_north_m_s",
        "velocity_east_m_s",
        "velocity_down_m_s",
        "position_north_m",
        "position_east_m",
        "position_down_m",
        "latitude_rad",
        "longitude_rad",
        "altitude_m",
        "airspeed_m_s",
        "angle_of_attack_rad",
        "sideslip_rad",
        "thrust_n",
        "gnss_altitude_m",
        "decimal_year",
        "static_pressure_pa",
        "impact_pressure_pa",
        "magnetic_field_x_nt",
        "magnetic_field_y_nt",
        "magnetic_field_z_nt",
    ];

    /// Names of the samples' times in the order of [`Sensors::stamps`].
    pub const TIMES: [&'static str; Self::SENSORS] = [
        "gyro_time_us",
        "accelerometer_time_us",
        "attitude_time_us",
        "gnss_time_us",
        "barometer_time_us",
        "pitot_time_us",
        "vanes_time_us",
        "engine_monitor_time_us",
        "magnetometer_time_us",
    ];

    /// Names of the samples' validity in the order of [`Sensors::stamps`].
    pub const VALID: [&'static str; Self::SENSORS] = [
        "gyro_valid",
        "accelerometer_valid",
        "attitude_valid",
        "gnss_valid",
        "barometer_valid",
        "pitot_valid",
        "vanes_valid",
        "engine_monitor_valid",
        "magnetometer_valid",
    ];

    /// The scalar values in wire order.
    pub fn to_array(&self) -> [f64; Self::COUNT] {
        let (rates, force) = (&self.gyro.value.0, &self.accelerometer.value.0);
        let [w, x, y, z] = self.attitude.value.wxyz();
        let GnssFix { velocity, position, latitude_rad, longitude_rad, altitude_m, decimal_year } =
            &self.gnss.value;
        let (velocity, position) = (&velocity.0, &position.0);
        let (barometer, pitot) = (&self.barometer.value, &self.pitot.value);
        let field = &self.magnetometer_nt.value.0;
        let FlowAngles { angle_of_attack_rad, sideslip_rad } = self.vanes.value;
        [
            rates.x,
            rates.y,
            rates.z,
            force.x,
            force.y,
            force.z,
            w,
            x,
            y,
            z,
            velocity.x,
            velocity.y,
            velocity.z,
            position.x,
            position.y,
            position.z,
            *latitude_rad,
            *longitude_rad,
            barometer.altitude_m,
            pitot.airspeed_m_s,
            angle_of_attack_rad,
            sideslip_rad,
            self.engine_n.value,
            *altitude_m,
            *decimal_year,
            barometer.pressure_pa,
            pitot.impact_pa,
            field.x,
            field.y,
            field.z,
        ]
    }

    /// Time and validity of each sample, in the order of [`SensorKind::ALL`].
    pub fn stamps(&self) -> [Stamp; Self::SENSORS] {
        [
            self.gyro.stamp(),
            self.accelerometer.stamp(),
            self.attitude.stamp(),
            self.gnss.stamp(),
            self.barometer.stamp(),
            self.pitot.stamp(),
            self.vanes.stamp(),
            self.engine_n.stamp(),
            self.magnetometer_nt.stamp(),
        ]
    }

    /// Declares the samples of these sensors invalid.
    pub fn invalidate(&mut self, is_meant: impl Fn(SensorKind) -> bool) {
        let flags = [
            &mut self.gyro.valid,
            &mut self.accelerometer.valid,
            &mut self.attitude.valid,
            &mut self.gnss.valid,
            &mut self.barometer.valid,
            &mut self.pitot.valid,
            &mut self.vanes.valid,
            &mut self.engine_n.valid,
            &mut self.magnetometer_nt.valid,
        ];
        for (sensor, valid) in SensorKind::ALL.into_iter().zip(flags) {
            *valid &= !is_meant(sensor);
        }
    }

    /// From the scalar values in wire order, bit for bit: this does not normalise the quaternion.
    pub fn new(stamps: &[Stamp; Self::SENSORS], v: &[f64; Self::COUNT]) -> Self {
        let fix = GnssFix {
            velocity: Ned::new(v[10], v[11], v[12]),
            position: Ned::new(v[13], v[14], v[15]),
            latitude_rad: v[16],
            longitude_rad: v[17],
            altitude_m: v[23],
            decimal_year: v[24],
        };
        let barometer = StaticPressure { pressure_pa: v[25], altitude_m: v[18] };
        let pitot = ImpactPressure { impact_pa: v[26], airspeed_m_s: v[19] };
        let angles = FlowAngles { angle_of_attack_rad: v[20], sideslip_rad: v[21] };
        let attitude = Attitude::from_unit_wxyz([v[6], v[7], v[8], v[9]]);
        Self {
            gyro: Sample::stamped(stamps[0], Body::new(v[0], v[1], v[2])),
            accelerometer: Sample::stamped(stamps[1], Body::new(v[3], v[4], v[5])),
            attitude: Sample::stamped(stamps[2], attitude),
            gnss: Sample::stamped(stamps[3], fix),
            barometer: Sample::stamped(stamps[4], barometer),
            pitot: Sample::stamped(stamps[5], pitot),
            vanes: Sample::stamped(stamps[6], angles),
            engine_n: Sample::stamped(stamps[7], v[22]),
            magnetometer_nt: Sample::stamped(stamps[8], Body::new(v[27], v[28], v[29])),
        }
    }

    /// The same with every sample valid and measured at `time`.
    pub fn at(time: SimTime, values: &[f64; Self::COUNT]) -> Self {
        Self::new(&[Stamp { time, valid: true }; Self::SENSORS], values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_validity_are_named_as_their_sensors() {
        let names = SensorKind::ALL.into_iter().zip(Sensors::TIMES).zip(Sensors::VALID);
        for ((kind, time), valid) in names {
            assert_eq!(time.strip_suffix("_time_us"), Some(kind.key()));
            assert_eq!(valid.strip_suffix("_valid"), Some(kind.key()));
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
        assert_eq!(sensors.vanes.value.sideslip_rad, values[21]);
    }
}
