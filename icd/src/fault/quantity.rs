//! The numbers of faults: their quantities, the operator's units, and their ranges.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::target::TargetClass;
use crate::sensors::SensorKind;
use crate::units::{DEG, SMALL_THRUST_N};

/// The enum of the quantities, with their names, measures and keys.
macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $title:literal, $measure:expr, $keys:expr;)+) => {
        /// A number of a fault or of its timing.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        #[repr(u8)]
        pub enum Quantity {
            $($(#[$doc])* $name = $code),+
        }

        impl Quantity {
            /// All of them.
            pub const ALL: [Self; [$(Self::$name),+].len()] = [$(Self::$name),+];

            /// Display name.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => $title),+ }
            }

            /// What it measures.
            pub const fn measure(self) -> Measure {
                match self { $(Self::$name => $measure),+ }
            }

            /// Keys in scenario files: of effectors that turn, of engines.
            pub const fn keys(self) -> [&'static str; 2] {
                match self { $(Self::$name => $keys),+ }
            }
        }
    };
}

quantities! {
    /// Fraction of the effect that remains.
    Remaining = 1, "remaining effect", Measure::Fraction, ["remaining_percent"; 2];
    /// Rate limit or drift, rad/s or N/s.
    Rate = 2, "rate", Measure::Speed, ["rate_deg_s", "rate_kn_s"];
    /// Delay, s.
    Delay = 3, "delay", Measure::Milliseconds, ["delay_ms"; 2];
    /// Period of an intermittent fault, s.
    Period = 4, "period", Measure::Seconds, ["period_s"; 2];
    /// Fraction of a period with commands.
    Present = 5, "present fraction", Measure::Fraction, ["present_percent"; 2];
    /// Amplitude, rad or N.
    Amplitude = 6, "amplitude", Measure::Position, ["amplitude_deg", "amplitude_kn"];
    /// Frequency, Hz.
    Frequency = 7, "frequency", Measure::Hertz, ["frequency_hz"; 2];
    /// Bias, rad or N.
    Bias = 8, "bias", Measure::Position, ["bias_deg", "bias_kn"];
    /// Limit of the travel, rad or N.
    Limit = 9, "travel limit", Measure::Position, ["limit_deg", "limit_kn"];
    /// Ramp, s.
    Ramp = 10, "ramp", Measure::Seconds, ["ramp_s"; 2];
    /// Duration, s.
    Duration = 11, "duration", Measure::Seconds, ["duration_s"; 2];
    /// Time from one onset to the next, s.
    Every = 12, "repetition", Measure::Seconds, ["every_s"; 2];
    /// Number of onsets.
    Times = 13, "number of repetitions", Measure::Count, ["times"; 2];
    /// Position at which an effector sticks, rad.
    Angle = 14, "angle", Measure::Angle, ["angle_deg"; 2];
    /// Noise of a sensor, rms.
    Noise = 15, "noise", Measure::Position, ["noise_deg", "noise_kn"];
    /// Fraction of the span of a part that is gone, from its tip.
    Lost = 16, "lost part", Measure::Fraction, ["lost_percent"; 2];
    /// Simulation time of the first onset, s.
    Onset = 17, "onset", Measure::Seconds, ["onset_s"; 2];
    /// Simulation time of the end, s: another way to write the duration.
    End = 18, "end", Measure::Seconds, ["clear_s"; 2];
}

/// The range that a number must be in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// This one, in SI units.
    Fixed([f64; 2]),
    /// The travel of the effector.
    Travel,
    /// From zero to half the travel.
    HalfTravel,
    /// Up to half the travel either way.
    HalfTravelEitherWay,
    /// From zero, of an engine from idle, to the end of the travel.
    UpToTravel,
    /// From a thousandth of the fastest speed to the fastest.
    Speed,
    /// Up to the fastest speed either way.
    SpeedEitherWay,
}

/// Physical dimension of a number, from which its units follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// An angle, of any target: rad.
    Angle,
    /// Position of an effector, rad or N; output of a sensor, in its SI unit.
    Position,
    /// Speed of an effector, rad/s or N/s; rate of a sensor's output.
    Speed,
    /// Fraction of one.
    Fraction,
    /// Time, s.
    Seconds,
    /// Time, s; the operator's unit is the millisecond.
    Milliseconds,
    /// Frequency, Hz.
    Hertz,
    /// Number of times.
    Count,
}

/// A unit for operators: a number in it, times `times` and over `over`, is in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Its symbol.
    pub name: &'static str,
    times: f64,
    over: f64,
}

impl Unit {
    const fn new(name: &'static str, times: f64, over: f64) -> Self {
        Self { name, times, over }
    }

    /// In which small values of this unit are shown.
    pub(super) fn for_small(self) -> Option<Self> {
        match self.name {
            "kN" => Some(Self::new("N", 1.0, 1.0)),
            "kN/s" => Some(Self::new("N/s", 1.0, 1.0)),
            _ => None,
        }
    }

    /// Those of times.
    pub(super) const TIMES: [Self; 3] =
        [Self::new("s", 1.0, 1.0), Self::new("ms", 1.0, 1.0e3), Self::new("min", 60.0, 1.0)];

    /// A number with this unit in SI units.
    pub fn to_si(self, value: f64) -> f64 {
        value * self.times / self.over
    }

    /// A number in SI units with this unit.
    pub fn from_si(self, si: f64) -> f64 {
        si * self.over / self.times
    }
}

impl Measure {
    /// The operator's unit.
    pub const fn unit(self, class: TargetClass) -> Unit {
        match (self, class) {
            (Self::Position, TargetClass::Sensor(sensor)) => sensor.unit(),
            (Self::Speed, TargetClass::Sensor(sensor)) => sensor.unit_of_rate(),
            (Self::Position, TargetClass::Thrust) => Unit::new("kN", 1.0e3, 1.0),
            (Self::Position | Self::Angle, _) => Unit::new("deg", DEG, 1.0),
            (Self::Speed, TargetClass::Thrust) => Unit::new("kN/s", 1.0e3, 1.0),
            (Self::Speed, _) => Unit::new("deg/s", DEG, 1.0),
            (Self::Fraction, _) => Unit::new("%", 1.0, 100.0),
            (Self::Seconds, _) => Unit::new("s", 1.0, 1.0),
            (Self::Milliseconds, _) => Unit::new("ms", 1.0, 1.0e3),
            (Self::Hertz, _) => Unit::new("Hz", 1.0, 1.0),
            (Self::Count, _) => Unit::new("times", 1.0, 1.0),
        }
    }

    /// The unit in which operators read values up to `largest`, in SI units.
    pub fn shown_unit(self, class: TargetClass, largest: f64) -> Unit {
        let unit = self.unit(class);
        unit.for_small().filter(|_| largest < SMALL_THRUST_N).unwrap_or(unit)
    }

    /// Whether it is a value of the target itself, which for an engine can also be given in percent of its largest thrust.
    pub const fn is_own(self) -> bool {
        matches!(self, Self::Position | Self::Speed)
    }
}

impl Range {
    /// Slowest speed that a slow effector can be given, as a fraction of its fastest.
    const SLOWEST: f64 = 1.0e-3;

    /// For an effector with this reach, in SI units.
    pub fn of(self, reach: &Reach) -> [f64; 2] {
        let Reach { min, max, .. } = *reach;
        let half = 0.5 * (max - min);
        let [slowest, fastest] = match reach.fastest {
            Some(fastest) => [Self::SLOWEST * fastest, fastest],
            // No rate is too fast for an effector that names no fastest one.
            None => [f64::MIN_POSITIVE, f64::MAX],
        };
        match self {
            Self::Fixed(range) => range,
            Self::Travel => [min, max],
            Self::HalfTravel => [0.0, half],
            Self::HalfTravelEitherWay => [-half, half],
            Self::UpToTravel => [if reach.is_angle() { 0.0 } else { min }, max],
            Self::Speed => [slowest, fastest],
            Self::SpeedEitherWay => [-fastest, fastest],
        }
    }

    /// For any aircraft, in the operator's unit; a number outside is a typing error.
    pub fn anywhere(self, measure: Measure, class: TargetClass) -> [f64; 2] {
        let largest = match (measure, class) {
            (Measure::Position | Measure::Speed, TargetClass::Sensor(sensor)) => sensor.largest(),
            (Measure::Position, TargetClass::Thrust) | (Measure::Speed, _) => 1_000.0,
            _ => 90.0,
        };
        match self {
            Self::Fixed(range) => range.map(|end| Tidy(measure.unit(class).from_si(end)).rounded()),
            Self::Travel | Self::HalfTravelEitherWay | Self::SpeedEitherWay => [-largest, largest],
            Self::HalfTravel | Self::UpToTravel | Self::Speed => [0.0, largest],
        }
    }
}

impl Quantity {
    /// Those of the times, which every kind has.
    pub const TIMING: [Self; 6] =
        [Self::Onset, Self::End, Self::Ramp, Self::Duration, Self::Every, Self::Times];

    /// Index in a list of all of them.
    pub(super) const fn place(self) -> usize {
        self as usize - 1
    }

    /// The quantity with this number.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| *quantity as u8 == code)
    }

    /// Key in scenario files.
    pub const fn key(self, class: TargetClass) -> &'static str {
        let [angle, thrust] = self.keys();
        match (class, self) {
            (TargetClass::Sensor(sensor), Self::Bias) => sensor.keys()[0],
            (TargetClass::Sensor(sensor), Self::Rate) => sensor.keys()[1],
            (TargetClass::Sensor(sensor), Self::Noise) => sensor.keys()[2],
            (TargetClass::Thrust, _) => thrust,
            _ => angle,
        }
    }
}

/// Travel and rate of a healthy effector; largest errors of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// The class of the target: its values are angles, rad, thrusts, N, or in the SI unit of a sensor.
    pub class: TargetClass,
    /// Lower end of its travel, rad or N.
    pub min: f64,
    /// Upper end of its travel, rad or N.
    pub max: f64,
    /// Largest rate, rad/s or N/s; `None` if unknown, and then the check accepts every rate.
    pub fastest: Option<f64>,
}

impl Reach {
    /// Of a part of the airframe, whose fault has no unit.
    pub const PART: Self = Self { class: TargetClass::Part, min: 0.0, max: 1.0, fastest: None };

    /// The largest errors of a sensor, SI units.
    pub fn of_sensor(sensor: SensorKind) -> Self {
        let largest = sensor.unit().to_si(sensor.largest());
        let class = TargetClass::Sensor(sensor);
        // Half of this "travel" is the largest error.
        Self { class, min: -largest, max: largest, fastest: Some(largest) }
    }

    const fn is_angle(&self) -> bool {
        matches!(self.class, TargetClass::Angle)
    }
}

/// The table of the faults of sensors: unit of the output for operators with its value in SI units, unit of a drift, largest error in
/// the unit, keys of bias, drift and noise in scenario files, and the unit of MAVLink with its name in PX4's shell.
macro_rules! sensor_faults {
    ($($sensor:ident: $unit:literal = $si:expr, $per_second:literal, $largest:literal, $keys:expr, $failure_unit:expr;)+) => {
        impl SensorKind {
            /// The operator's unit of its output.
            pub const fn unit(self) -> Unit {
                match self { $(Self::$sensor => Unit::new($unit, $si, 1.0)),+ }
            }

            /// The operator's unit of a drift of its output.
            pub const fn unit_of_rate(self) -> Unit {
                match self { $(Self::$sensor => Unit::new($per_second, $si, 1.0)),+ }
            }

            /// Largest error that a fault can give its output, in the operator's unit; of a drift, per second.
            pub const fn largest(self) -> f64 {
                match self { $(Self::$sensor => $largest),+ }
            }

            /// Keys of bias, drift and noise in scenario files.
            pub const fn keys(self) -> [&'static str; 3] {
                match self { $(Self::$sensor => $keys),+ }
            }

            /// FAILURE_UNIT of MAVLink and its name in PX4's shell. Sensors without a number in MAVLink have one of this project, from
            /// 1000 on.
            pub const fn failure_unit(self) -> (u16, &'static str) {
                match self { $(Self::$sensor => $failure_unit),+ }
            }
        }
    };
}

sensor_faults! {
    Gyro: "deg/s" = DEG, "deg/s2", 1_000.0, ["bias_deg_s", "rate_deg_s2", "noise_deg_s"], (0, "gyro");
    Accelerometer: "m/s2" = 1.0, "m/s3", 1_000.0, ["bias_m_s2", "rate_m_s3", "noise_m_s2"], (1, "accel");
    Magnetometer: "nT" = 1.0, "nT/s", 100_000.0, ["bias_nt", "rate_nt_s", "noise_nt"], (2, "mag");
    Barometer: "Pa" = 1.0, "Pa/s", 100_000.0, ["bias_pa", "rate_pa_s", "noise_pa"], (3, "baro");
    Gnss: "m" = 1.0, "m/s", 100_000.0, ["bias_m", "rate_m_s", "noise_m"], (4, "gps");
    Pitot: "Pa" = 1.0, "Pa/s", 100_000.0, ["bias_pa", "rate_pa_s", "noise_pa"], (8, "airspeed");
    Attitude: "deg" = DEG, "deg/s", 180.0, ["bias_deg", "rate_deg_s", "noise_deg"], (1_000, "attitude");
    Vanes: "deg" = DEG, "deg/s", 90.0, ["bias_deg", "rate_deg_s", "noise_deg"], (1_001, "vanes");
    EngineMonitor: "kN" = 1.0e3, "kN/s", 1_000.0, ["bias_kn", "rate_kn_s", "noise_kn"], (1_002, "engine_mon");
    RadarAltimeter: "m" = 1.0, "m/s", 10_000.0, ["bias_m", "rate_m_s", "noise_m"], (1_004, "radar_alt");
    WeightOnWheels: "kN" = 1.0e3, "kN/s", 1_000.0, ["bias_kn", "rate_kn_s", "noise_kn"], (1_003, "wheels");
    FuelGauge: "%" = 1.0, "%/s", 100.0, ["bias_pct", "rate_pct_s", "noise_pct"], (1_005, "fuel");
}

/// A number with up to four decimals and no trailing zeros.
pub(super) struct Tidy(pub f64);

impl Tidy {
    pub fn rounded(&self) -> f64 {
        // Adding 0.0 makes -0 a 0.
        libm::round(self.0 * 1.0e4) / 1.0e4 + 0.0
    }
}

impl fmt::Display for Tidy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = self.rounded();
        // A number that would round to zero, and NaN, keep their digits.
        if self.0 != 0.0 && rounded == 0.0 { write!(f, "{:e}", self.0) } else { rounded.fmt(f) }
    }
}
