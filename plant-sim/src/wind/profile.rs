//! Wind that changes with the altitude: shear.

use icd::Ned;
use serde::{Deserialize, Serialize};

use crate::range::{RangeError, check_range};

const SECTION: &str = "plant.wind.level";

/// The wind at one altitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindLevel {
    /// Altitude above the ellipsoid, the sphere or the plane, m.
    pub altitude_m: f64,
    /// Velocity of the air over the ground, m/s, local NED, where it blows to.
    pub velocity_ned_m_s: [f64; 3],
}

/// Wind over the altitude: linear between its levels, constant below the lowest and above the highest one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct WindProfile {
    levels: Vec<WindLevel>,
}

impl WindProfile {
    pub const LEVELS_MAX: usize = 1_000;

    /// From levels with increasing altitudes.
    pub fn new(levels: Vec<WindLevel>) -> Result<Self, RangeError> {
        let profile = Self { levels };
        profile.check()?;
        Ok(profile)
    }

    pub fn check(&self) -> Result<(), RangeError> {
        let (count, max) = (self.levels.len() as f64, Self::LEVELS_MAX as f64);
        check_range("plant.wind", "number of levels", count, 0.0, max)?;
        let mut least = -5_000.0;
        for level in &self.levels {
            check_range(SECTION, "altitude_m", level.altitude_m, least, 100_000.0)?;
            least = level.altitude_m.next_up();
            for speed in level.velocity_ned_m_s {
                check_range(SECTION, "velocity_ned_m_s", speed, -200.0, 200.0)?;
            }
        }
        Ok(())
    }

    /// Whether there are no levels.
    pub fn is_empty(&self) -> bool {
        self.levels.is_empty()
    }

    /// Velocity of the air at an altitude in m, m/s, local NED; zero without levels.
    pub fn at(&self, altitude_m: f64) -> Ned {
        let above = self.levels.partition_point(|level| level.altitude_m <= altitude_m);
        let below = above.checked_sub(1).and_then(|index| self.levels.get(index));
        let wind = match (below, self.levels.get(above)) {
            (Some(low), Some(high)) => {
                let part = (altitude_m - low.altitude_m) / (high.altitude_m - low.altitude_m);
                std::array::from_fn(|i| {
                    low.velocity_ned_m_s[i]
                        + part * (high.velocity_ned_m_s[i] - low.velocity_ned_m_s[i])
                })
            }
            (Some(end), None) | (None, Some(end)) => end.velocity_ned_m_s,
            (None, None) => [0.0; 3],
        };
        Ned::new(wind[0], wind[1], wind[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(altitude_m: f64, east: f64) -> WindLevel {
        WindLevel { altitude_m, velocity_ned_m_s: [1.0, east, 0.0] }
    }

    #[test]
    fn wind_is_linear_between_levels_and_constant_outside() {
        let profile =
            WindProfile::new(vec![level(0.0, -6.0), level(1_000.0, 4.0), level(3_000.0, 0.0)])
                .unwrap();
        for (altitude_m, east) in [
            (-50.0, -6.0),
            (0.0, -6.0),
            (600.0, 0.0),
            (1_000.0, 4.0),
            (2_000.0, 2.0),
            (3_000.0, 0.0),
            (9_000.0, 0.0),
        ] {
            let wind = profile.at(altitude_m).0;
            assert!((wind.y - east).abs() < 1e-12, "{} m/s at {altitude_m} m", wind.y);
            assert_eq!((wind.x, wind.z), (1.0, 0.0));
        }
        assert_eq!(WindProfile::default().at(100.0), Ned::zero());
        assert!(profile.at(f64::NAN).0.y.is_finite());
    }

    #[test]
    fn levels_out_of_order_or_range_are_refused_with_key_and_value() {
        let message = |levels: Vec<WindLevel>| WindProfile::new(levels).unwrap_err().to_string();
        assert!(
            message(vec![level(10.0, 0.0), level(10.0, 1.0)])
                .starts_with("[plant.wind.level] altitude_m = 10 is outside 10")
        );
        assert!(message(vec![level(f64::NAN, 0.0)]).contains("altitude_m = NaN"));
        assert_eq!(
            message(vec![level(0.0, 300.0)]),
            "[plant.wind.level] velocity_ned_m_s = 300 is outside -200 to 200"
        );
    }
}
