//! Conditions of a line: a quantity that a pilot sees, and the value that it crosses.

use core::f64::consts::PI;

use flight_control::NavigationState;
use icd::SimTime;
use icd::units::{DEG, STANDARD_GRAVITY_M_S2};

/// A quantity of the flight, as the sensors report it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Roll angle, rad, positive right wing down.
    Roll,
    /// Pitch angle, rad, positive nose up.
    Pitch,
    /// Heading, rad from north.
    Heading,
    /// Altitude above the ellipsoid, m.
    Altitude,
    /// Climb rate, m/s, positive up.
    ClimbRate,
    /// True airspeed, m/s.
    Airspeed,
    /// Angle of attack, rad.
    Alpha,
    /// Sideslip, rad, positive with the wind from the right.
    Beta,
    /// Body rate p, rad/s.
    RollRate,
    /// Body rate q, rad/s.
    PitchRate,
    /// Body rate r, rad/s.
    YawRate,
    /// Normal load factor, g: 1 in level flight.
    LoadFactor,
    /// Simulation time since the start of the flight, s.
    Time,
}

/// Direction of a crossing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crossing {
    /// Either way, from one side to the other.
    Passes,
    /// From at or below it to above it.
    RisesAbove,
    /// From at or above it to below it.
    FallsBelow,
}

/// A quantity that crosses a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    pub quantity: Quantity,
    pub crossing: Crossing,
    /// The value in the quantity's unit.
    pub value: f64,
}

/// One quantity in the language: its words, its unit with the factor to SI, and its range in that unit.
pub(super) struct Row {
    pub words: &'static str,
    pub quantity: Quantity,
    pub unit: &'static str,
    pub scale: f64,
    pub range: (f64, f64),
}

const fn row(
    words: &'static str,
    quantity: Quantity,
    (unit, scale): (&'static str, f64),
    range: (f64, f64),
) -> Row {
    Row { words, quantity, unit, scale, range }
}

/// All quantities. Of names with the same beginning, the longer one is first.
pub(super) const ROWS: [Row; 13] = [
    row("roll rate", Quantity::RollRate, ("deg/s", DEG), (-720.0, 720.0)),
    row("pitch rate", Quantity::PitchRate, ("deg/s", DEG), (-720.0, 720.0)),
    row("yaw rate", Quantity::YawRate, ("deg/s", DEG), (-720.0, 720.0)),
    row("roll", Quantity::Roll, ("deg", DEG), (-180.0, 180.0)),
    row("pitch", Quantity::Pitch, ("deg", DEG), (-90.0, 90.0)),
    row("heading", Quantity::Heading, ("deg", DEG), (0.0, 360.0)),
    row("altitude", Quantity::Altitude, ("m", 1.0), (0.0, 30_000.0)),
    row("climb rate", Quantity::ClimbRate, ("m/s", 1.0), (-1_000.0, 1_000.0)),
    row("airspeed", Quantity::Airspeed, ("m/s", 1.0), (0.0, 1_000.0)),
    row("alpha", Quantity::Alpha, ("deg", DEG), (-180.0, 180.0)),
    row("beta", Quantity::Beta, ("deg", DEG), (-180.0, 180.0)),
    row("load factor", Quantity::LoadFactor, ("g", 1.0), (-50.0, 50.0)),
    row("time", Quantity::Time, ("s", 1.0), (0.0, SimTime::MAX_SECONDS)),
];

impl Quantity {
    pub fn value(self, state: &NavigationState) -> f64 {
        match self {
            Self::Roll => state.attitude.phi,
            Self::Pitch => state.attitude.theta,
            Self::Heading => state.attitude.psi,
            Self::Altitude => state.altitude_m,
            Self::ClimbRate => state.climb_rate_m_s(),
            Self::Airspeed => state.airspeed_m_s,
            Self::Alpha => state.alpha,
            Self::Beta => state.beta,
            Self::RollRate => state.rates.x,
            Self::PitchRate => state.rates.y,
            Self::YawRate => state.rates.z,
            Self::LoadFactor => -state.specific_force.0.z / STANDARD_GRAVITY_M_S2,
            Self::Time => state.time.as_seconds(),
        }
    }

    /// Angles that wrap around.
    const fn is_circular(self) -> bool {
        matches!(self, Self::Roll | Self::Heading | Self::Alpha | Self::Beta)
    }
}

impl Condition {
    /// How far the quantity exceeds the value now; for an angle the shorter way round.
    pub fn excess(&self, state: &NavigationState) -> f64 {
        let difference = self.quantity.value(state) - self.value;
        if self.quantity.is_circular() { libm::remainder(difference, 2.0 * PI) } else { difference }
    }

    /// The excess to compare with at the next tick. A quantity exactly at the value has not passed it yet.
    pub fn remembered(&self, before: f64, now: f64) -> f64 {
        if self.crossing == Crossing::Passes && now == 0.0 { before } else { now }
    }

    /// Whether the value was crossed between two ticks, by the earlier and the present [`Condition::excess`]. An angle
    /// that wraps around, opposite to the value, has not crossed it.
    pub fn is_crossed(&self, before: f64, now: f64) -> bool {
        if self.quantity.is_circular() && (now - before).abs() > PI {
            return false;
        }
        let rises = before <= 0.0 && now > 0.0;
        let falls = before >= 0.0 && now < 0.0;
        match self.crossing {
            Crossing::Passes => rises && before < 0.0 || falls && before > 0.0,
            Crossing::RisesAbove => rises,
            Crossing::FallsBelow => falls,
        }
    }
}
