//! When an aircraft counts as lost: limits of its motion, from the table `[limits]` of its airframe file.

use std::f64::consts::PI;
use std::fmt;

use host_io::problem::Problem;
use serde::{Deserialize, Serialize};

use crate::range::check_range;

const SECTION: &str = "limits";

/// Beyond any of these, at any time, the aircraft is lost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FlightLimits {
    /// Largest magnitude of the roll angle, rad.
    pub roll_rad: f64,
    /// Largest magnitude of the pitch angle, rad.
    pub pitch_rad: f64,
    /// Largest magnitude of the angle of attack, rad.
    pub alpha_rad: f64,
    /// Largest magnitude of the sideslip, rad.
    pub beta_rad: f64,
    /// Lowest altitude above the ellipsoid or the plane, m.
    pub altitude_min_m: f64,
}

/// The quantities that [`FlightLimits`] bound.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Attained {
    /// Roll angle, rad.
    pub roll_rad: f64,
    /// Pitch angle, rad.
    pub pitch_rad: f64,
    /// Angle of attack, rad.
    pub alpha_rad: f64,
    /// Sideslip, rad.
    pub beta_rad: f64,
    /// Altitude, m.
    pub altitude_m: f64,
}

/// A limit that the flight has passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exceeded {
    pub quantity: &'static str,
    /// Its value, in `unit`.
    pub value: f64,
    /// The limit, in `unit`; for an angle, of its magnitude.
    pub limit: f64,
    /// deg or m.
    pub unit: &'static str,
}

impl fmt::Display for Exceeded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { quantity, value, limit, unit } = self;
        write!(f, "{quantity} {value:.1} {unit}, limit {limit} {unit}")
    }
}

impl FlightLimits {
    /// For a body that cannot be lost: every angle, down to the ground.
    pub const NONE: Self = Self {
        roll_rad: PI,
        pitch_rad: 0.5 * PI,
        alpha_rad: PI,
        beta_rad: PI,
        altitude_min_m: 0.0,
    };

    /// The same of a flight over a ground, where the limits of the gear take the place of the altitude and an aircraft at rest in wind
    /// has any angle of attack and sideslip.
    #[must_use]
    pub fn over_ground(self) -> Self {
        Self { alpha_rad: PI, beta_rad: PI, altitude_min_m: f64::NEG_INFINITY, ..self }
    }

    /// Whether the aircraft is lost: the one definition of the project. A NaN is beyond every limit.
    pub fn are_exceeded(&self, at: &Attained) -> bool {
        self.exceeded(at).is_some()
    }

    /// The first limit that is passed, for display.
    pub fn exceeded(&self, at: &Attained) -> Option<Exceeded> {
        let angles = [
            ("roll angle", at.roll_rad, self.roll_rad),
            ("angle of attack", at.alpha_rad, self.alpha_rad),
            ("sideslip", at.beta_rad, self.beta_rad),
            ("pitch angle", at.pitch_rad, self.pitch_rad),
        ];
        // No range contains NaN.
        let passed =
            angles.into_iter().find(|(_, value, limit)| !(0.0..=*limit).contains(&value.abs()));
        let angle = passed.map(|(quantity, value, limit)| {
            let (value, limit) = (value.to_degrees(), tidy(limit.to_degrees()));
            Exceeded { quantity, value, limit, unit: "deg" }
        });
        let (value, limit) = (at.altitude_m, self.altitude_min_m);
        let low = Exceeded { quantity: "altitude", value, limit, unit: "m" };
        angle.or((!(limit..).contains(&value)).then_some(low))
    }

    pub fn check(&self) -> Result<(), Problem> {
        for (key, angle, max) in [
            ("roll_deg", self.roll_rad, 180.0),
            ("pitch_deg", self.pitch_rad, 90.0),
            ("angle_of_attack_deg", self.alpha_rad, 180.0),
            ("sideslip_deg", self.beta_rad, 180.0),
        ] {
            // Tidied, since an angle at the end of its range may have gained a digit through
            // radians.
            check_range(SECTION, key, tidy(angle.to_degrees()), 1.0, max)?;
        }
        check_range(SECTION, "altitude_min_m", self.altitude_min_m, 0.0, 25_000.0)
    }
}

/// Degrees that were converted through radians, rounded to the written value.
fn tidy(degrees: f64) -> f64 {
    libm::round(degrees * 1.0e9) / 1.0e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Airframe;

    fn level() -> Attained {
        Attained { altitude_m: 5_000.0, ..Attained::default() }
    }

    #[test]
    fn a_flight_is_lost_beyond_each_limit_and_not_at_it() {
        let limits = Airframe::paper().limits;
        assert!(!limits.are_exceeded(&level()));
        let at_limit = Attained {
            roll_rad: -limits.roll_rad,
            pitch_rad: limits.pitch_rad,
            alpha_rad: limits.alpha_rad,
            beta_rad: -limits.beta_rad,
            altitude_m: limits.altitude_min_m,
        };
        assert!(!limits.are_exceeded(&at_limit));
        let degrees = |angle: f64| angle.to_radians();
        for (beyond, quantity) in [
            (Attained { roll_rad: degrees(-90.1), ..level() }, "roll angle"),
            (Attained { alpha_rad: degrees(25.1), ..level() }, "angle of attack"),
            (Attained { beta_rad: degrees(-20.1), ..level() }, "sideslip"),
            (Attained { pitch_rad: degrees(74.6), ..level() }, "pitch angle"),
            (Attained { altitude_m: 499.9, ..level() }, "altitude"),
            (Attained { alpha_rad: f64::NAN, ..level() }, "angle of attack"),
            (Attained { altitude_m: f64::NAN, ..level() }, "altitude"),
        ] {
            assert!(limits.are_exceeded(&beyond), "{beyond:?}");
            assert_eq!(limits.exceeded(&beyond).map(|e| e.quantity), Some(quantity));
        }
        assert_eq!(limits.exceeded(&at_limit), None);
    }

    #[test]
    fn an_exceeded_limit_is_shown_in_the_units_of_the_file() {
        let limits = Airframe::paper().limits;
        let rolled = Attained { roll_rad: 1.6, ..level() };
        let words = limits.exceeded(&rolled).map(|exceeded| exceeded.to_string());
        assert_eq!(words.as_deref(), Some("roll angle 91.7 deg, limit 90 deg"));
    }

    #[test]
    fn a_limit_that_cannot_be_is_refused_with_key_value_and_range() {
        let limits = FlightLimits { beta_rad: 0.0, ..Airframe::paper().limits };
        let error = limits.check().unwrap_err().to_string();
        assert_eq!(error, "[limits] sideslip_deg = 0 is outside 1 to 180");
    }
}
