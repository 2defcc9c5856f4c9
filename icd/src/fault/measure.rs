//! What the numbers of faults measure: units for people, and where the numbers must lie.

use super::allowed::Reach;
use super::catalogue::Quantity;
use super::target::TargetClass;
use super::text::Tidy;

/// Where a number must lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Here, SI units.
    Fixed([f64; 2]),
    /// In the travel of the effector.
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

/// What a number measures, from which its units follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// An angle, whatever has it: rad.
    Angle,
    /// Where an effector is: rad or N.
    Position,
    /// How fast it moves: rad/s or N/s.
    Speed,
    /// Part of one.
    Fraction,
    /// Time, s.
    Seconds,
    /// Time, s, that people give in milliseconds.
    Milliseconds,
    /// Frequency, Hz.
    Hertz,
    /// How often.
    Count,
}

/// A unit for people: a number with it, times `times` and over `over`, is in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// As it is written.
    pub name: &'static str,
    times: f64,
    over: f64,
}

impl Unit {
    const fn new(name: &'static str, times: f64, over: f64) -> Self {
        Self { name, times, over }
    }

    /// A number with this unit in SI units.
    #[must_use]
    pub fn to_si(self, value: f64) -> f64 {
        value * self.times / self.over
    }

    /// A number in SI units with this unit.
    #[must_use]
    pub fn from_si(self, si: f64) -> f64 {
        si * self.over / self.times
    }
}

impl Measure {
    /// Its unit for people.
    #[must_use]
    pub const fn unit(self, class: TargetClass) -> Unit {
        const DEG: f64 = 1.0_f64.to_radians();
        match (self, class) {
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

    /// Whether it is one of an effector's own values: an engine's come as percent of its largest thrust too.
    #[must_use]
    pub const fn is_own(self) -> bool {
        matches!(self, Self::Position | Self::Speed)
    }
}

impl Range {
    /// Slowest speed that a slow effector can be given, as a fraction of its fastest.
    const SLOWEST: f64 = 1.0e-3;

    /// For an effector that goes so far and so fast, SI units.
    #[must_use]
    pub fn of(self, reach: &Reach) -> [f64; 2] {
        let Reach { min, max, .. } = *reach;
        let half = 0.5 * (max - min);
        let [slowest, fastest] = match reach.fastest {
            Some(fastest) => [Self::SLOWEST * fastest, fastest],
            None => [f64::MIN_POSITIVE, f64::MAX],
        };
        match self {
            Self::Fixed(range) => range,
            Self::Travel => [min, max],
            Self::HalfTravel => [0.0, half],
            Self::HalfTravelEitherWay => [-half, half],
            Self::UpToTravel => [if reach.is_angle { 0.0 } else { min }, max],
            Self::Speed => [slowest, fastest],
            Self::SpeedEitherWay => [-fastest, fastest],
        }
    }

    /// For any aircraft, in the unit for people: what is outside is no slip of the aircraft but of the hand.
    #[must_use]
    pub fn anywhere(self, measure: Measure, class: TargetClass) -> [f64; 2] {
        let largest = match (measure, class) {
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
    /// The one with this number.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| *quantity as u8 == code)
    }

    /// Key in scenario files.
    #[must_use]
    pub const fn key(self, class: TargetClass) -> &'static str {
        let [angle, thrust] = self.keys();
        if matches!(class, TargetClass::Thrust) { thrust } else { angle }
    }
}
