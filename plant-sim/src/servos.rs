//! Command to position: lag, rate limit, travel. The healthy actuator; what breaks it is in [`crate::faults`].

use icd::PerEffector;
use serde::{Deserialize, Serialize};

/// One actuator: angles in rad, the engine in newton.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Servo {
    /// Time constant of the first-order lag, s.
    pub lag_s: f64,
    /// Largest speed either way, rad/s or N/s; infinite for none.
    pub rate_limit: f64,
    /// Lower end of the travel, rad or N.
    pub min: f64,
    /// Upper end of the travel, rad or N.
    pub max: f64,
}

impl Servo {
    /// The command inside the travel.
    #[inline]
    #[must_use]
    pub fn limited(&self, command: f64) -> f64 {
        // max and min instead of clamp: total, also if someone swapped the ends.
        command.max(self.min).min(self.max)
    }

    /// Speed of the healthy actuator at `position` with this command (inside the travel).
    #[inline]
    #[must_use]
    pub fn rate(&self, command: f64, position: f64) -> f64 {
        let free = (command - position) / self.lag_s;
        // Comparisons instead of max and min: two instructions each, and this runs 32 times a step.
        let above = if free < -self.rate_limit { -self.rate_limit } else { free };
        if above > self.rate_limit { self.rate_limit } else { above }
    }
}

/// Commands inside the travel of each effector.
///
/// A command that is not finite keeps the effector's `held` one: the servo of a real aircraft would do the
/// same with a frame that makes no sense.
#[must_use]
pub fn accepted(
    servos: &PerEffector<Servo>,
    commands: &PerEffector<f64>,
    held: &PerEffector<f64>,
) -> PerEffector<f64> {
    PerEffector::from_fn(|e| {
        if commands[e].is_finite() { servos[e].limited(commands[e]) } else { held[e] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::Effector;

    const SERVO: Servo = Servo { lag_s: 0.05, rate_limit: 1.4, min: -0.5, max: 0.5 };

    #[test]
    fn a_small_step_is_a_first_order_lag() {
        assert_eq!(SERVO.rate(0.01, 0.0), 0.01 / 0.05);
    }

    #[test]
    fn a_large_step_moves_at_the_rate_limit_either_way() {
        assert_eq!(SERVO.rate(0.5, -0.5), 1.4);
        assert_eq!(SERVO.rate(-0.5, 0.5), -1.4);
    }

    #[test]
    fn commands_end_at_the_travel() {
        assert_eq!((SERVO.limited(9.0), SERVO.limited(-9.0), SERVO.limited(0.1)), (0.5, -0.5, 0.1));
    }

    #[test]
    fn a_command_that_is_no_number_holds_only_its_own_effector() {
        let servos = PerEffector::from_fn(|_| SERVO);
        let held = PerEffector::from_fn(|_| 0.2);
        let mut commands = PerEffector::from_fn(|_| 0.3);
        commands[Effector::Rudder] = f64::NAN;
        commands[Effector::Engine] = f64::INFINITY;
        let accepted = accepted(&servos, &commands, &held);
        assert_eq!(accepted[Effector::Rudder], 0.2);
        assert_eq!(accepted[Effector::Engine], 0.2);
        assert_eq!(accepted[Effector::LeftAileron], 0.3);
    }
}
