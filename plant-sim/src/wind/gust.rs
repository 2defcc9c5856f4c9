//! Discrete gusts: one rise of the wind with the shape of a cosine, at a time of its own.

use icd::{Body, SimTime};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::Gust;
use crate::range::{RangeError, check_range};

const SECTION: &str = "plant.gust";

/// A 1-cosine gust, body axes, along the path that the aircraft flies through the air.
///
/// MIL-F-8785C, 3.7.2.3: with the distance x since the onset and the gust length d,
/// v = v_m / 2 (1 - cos(π x / d)) up to d, and v_m from there on. With `returns` it goes back to zero the same way up to
/// 2 d, as the gusts of CS-25.341 do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiscreteGust {
    /// Simulation time at which the aircraft enters it, s.
    pub onset_s: f64,
    /// d: distance over which it rises, m.
    pub length_m: f64,
    /// v_m along x: positive blows from behind, m/s.
    #[serde(default)]
    pub forward_m_s: f64,
    /// v_m along y: positive blows to the right, m/s.
    #[serde(default)]
    pub right_m_s: f64,
    /// v_m along z: positive blows down, m/s.
    #[serde(default)]
    pub down_m_s: f64,
    /// It goes back to zero.
    #[serde(default)]
    pub returns: bool,
}

impl DiscreteGust {
    /// Most gusts of a scenario.
    pub const MAX: usize = 16;

    pub fn check(&self) -> Result<(), RangeError> {
        check_range(SECTION, "onset_s", self.onset_s, 0.0, SimTime::MAX_SECONDS)?;
        check_range(SECTION, "length_m", self.length_m, 1.0, 10_000.0)?;
        check_range(SECTION, "forward_m_s", self.forward_m_s, -50.0, 50.0)?;
        check_range(SECTION, "right_m_s", self.right_m_s, -50.0, 50.0)?;
        check_range(SECTION, "down_m_s", self.down_m_s, -50.0, 50.0)
    }

    /// Part of v_m at a distance in m since the onset, and how it changes with that, 1/m.
    fn part(&self, distance_m: f64) -> (f64, f64) {
        let end = if self.returns { 2.0 } else { 1.0 };
        let x = (distance_m / self.length_m).min(end);
        let (sin, cos) = libm::sincos(core::f64::consts::PI * x);
        // Behind its end it is constant; at the end the slope is zero anyhow.
        let slope = if x < end { sin } else { 0.0 };
        (0.5 * (1.0 - cos), 0.5 * core::f64::consts::PI / self.length_m * slope)
    }
}

/// Checks the gusts of a scenario.
pub fn check(gusts: &[DiscreteGust]) -> Result<(), RangeError> {
    check_range(SECTION, "number of gusts", gusts.len() as f64, 0.0, DiscreteGust::MAX as f64)?;
    gusts.iter().try_for_each(DiscreteGust::check)
}

/// The gusts of a flight, with the way that was flown in each.
#[derive(Debug, Clone)]
pub struct DiscreteGusts {
    /// Each with the distance since its onset, m.
    all: Vec<(DiscreteGust, f64)>,
    period_s: f64,
}

impl DiscreteGusts {
    /// All are still ahead.
    pub fn new(gusts: &[DiscreteGust], period_s: f64) -> Self {
        Self { all: gusts.iter().map(|gust| (*gust, 0.0)).collect(), period_s }
    }

    /// Adds their air to that of the turbulence, for the period from `time` on, with this true airspeed, m/s.
    ///
    /// As a field that lies still in the air it rotates too: q_g = -∂w_g/∂x, r_g = ∂v_g/∂x.
    pub fn step(&mut self, time: SimTime, airspeed_m_s: f64, turbulence: Gust) -> Gust {
        let mut air = turbulence;
        for (gust, distance_m) in &mut self.all {
            if time.as_seconds() < gust.onset_s {
                continue;
            }
            let (part, slope) = gust.part(*distance_m);
            let DiscreteGust { forward_m_s, right_m_s, down_m_s, .. } = *gust;
            air.velocity =
                Body(air.velocity.0 + part * Vector3::new(forward_m_s, right_m_s, down_m_s));
            air.rates = Body(air.rates.0 + slope * Vector3::new(0.0, -down_m_s, right_m_s));
            *distance_m += airspeed_m_s * self.period_s;
        }
        air
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.01;
    const AIRSPEED_M_S: f64 = 100.0;

    /// One value each metre.
    fn air(returns: bool) -> Vec<Gust> {
        let gust = DiscreteGust {
            onset_s: 1.0,
            length_m: 50.0,
            forward_m_s: 1.0,
            right_m_s: 2.0,
            down_m_s: -4.0,
            returns,
        };
        let mut gusts = DiscreteGusts::new(&[gust], PERIOD_S);
        let time = |tick: u32| SimTime::from_seconds(PERIOD_S * f64::from(tick)).unwrap();
        (0..300).map(|tick| gusts.step(time(tick), AIRSPEED_M_S, Gust::none())).collect()
    }

    #[test]
    fn it_rises_over_its_length_and_stays_or_returns() {
        for (returns, end) in [(false, 1.0), (true, 0.0)] {
            let air = air(returns);
            let down = |tick: usize| air[tick].velocity.0.z / -4.0;
            assert_eq!(down(100), 0.0);
            assert!((down(125) - 0.5).abs() < 1.0e-12 && (down(150) - 1.0).abs() < 1.0e-12);
            for tick in [200, 250, 299] {
                assert!((down(tick) - end).abs() < 1.0e-12, "{}", down(tick));
            }
            assert_eq!(air[130].velocity.0.x * 2.0, air[130].velocity.0.y);
        }
    }

    #[test]
    fn its_rotation_is_the_slope_of_its_velocity() {
        let air = air(true);
        for tick in 101..298 {
            let slope = |axis: usize| {
                0.5 * (air[tick + 1].velocity.0[axis] - air[tick - 1].velocity.0[axis])
            };
            let [p, q, r]: [f64; 3] = air[tick].rates.0.into();
            assert_eq!(p, 0.0);
            assert!((q + slope(2)).abs() < 5.0e-3 && (r - slope(1)).abs() < 5.0e-3, "{tick}");
        }
    }

    #[test]
    fn what_cannot_be_is_named() {
        let gust = DiscreteGust {
            onset_s: 1.0,
            length_m: 0.5,
            forward_m_s: 0.0,
            right_m_s: 0.0,
            down_m_s: f64::NAN,
            returns: false,
        };
        let text = |gusts: &[DiscreteGust]| check(gusts).unwrap_err().to_string();
        assert!(
            text(&[gust]).contains("length_m = 0.5 is outside 1 to 10000"),
            "{}",
            text(&[gust])
        );
        let gust = DiscreteGust { length_m: 100.0, ..gust };
        assert!(text(&[gust]).contains("down_m_s = NaN"), "{}", text(&[gust]));
        assert!(text(&[gust; 17]).contains("number of gusts"), "{}", text(&[gust; 17]));
    }
}
