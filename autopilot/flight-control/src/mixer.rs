//! Commands of both steps to effectors, inside their travel, with a report of what could not be given.

use icd::{Effector, PerEffector};

use crate::belief::Belief;
use crate::compensator::Compensation;
use crate::main_controller::MainCommand;

/// Side on which a command is beyond its limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Side {
    /// Inside the limits.
    #[default]
    Inside,
    /// Beyond the lower limit.
    Below,
    /// Beyond the upper limit.
    Above,
}

impl Side {
    /// Whether an integrator that grows with `error` would push farther beyond the limit.
    #[must_use]
    pub fn blocks(self, error: f64) -> bool {
        match self {
            Self::Inside => false,
            Self::Below => error < 0.0,
            Self::Above => error > 0.0,
        }
    }

    /// Whether the command was cut.
    #[must_use]
    pub fn is_saturated(self) -> bool {
        self != Self::Inside
    }
}

/// What could not be given in a step; the main controller's anti-windup reads it in the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Saturation {
    /// Aileron pair, both steps together.
    pub aileron: Side,
    /// Elevators.
    pub elevator: Side,
    /// Rudder.
    pub rudder: Side,
    /// Nozzle pitch.
    pub nozzle_pitch: Side,
    /// Nozzle yaw.
    pub nozzle_yaw: Side,
    /// Engine.
    pub thrust: Side,
}

/// What the effectors are told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixed {
    /// One command for each effector, rad; engine N.
    pub commands: PerEffector<f64>,
    /// What of the compensation got through.
    pub applied: Compensation,
    /// What did not.
    pub saturation: Saturation,
}

/// Adds the compensation to the main command and cuts the sum at the travel of the effectors.
///
/// The ailerons are shared: the main command is served first, the compensation gets the rest.
#[must_use]
pub fn mix(main: &MainCommand, compensation: &Compensation, belief: &Belief) -> Mixed {
    let effectors = &belief.effectors;
    let travel = effectors.aileron.travel_rad;
    let (aileron, aileron_side) =
        clip(main.aileron_rad + compensation.aileron_rad, -travel, travel);
    let travel = effectors.elevator.travel_rad;
    let (elevator, elevator_side) = clip(main.elevator_rad, -travel, travel);
    let travel = effectors.rudder.travel_rad;
    let (rudder, rudder_side) = clip(main.rudder_rad, -travel, travel);
    let travel = effectors.nozzle.travel_rad;
    let (nozzle_pitch, nozzle_pitch_side) =
        clip(main.nozzle_pitch_rad + compensation.nozzle_pitch_rad, -travel, travel);
    let (nozzle_yaw, nozzle_yaw_side) =
        clip(main.nozzle_yaw_rad + compensation.nozzle_yaw_rad, -travel, travel);
    let (thrust, thrust_side) = clip(main.thrust_n, effectors.thrust_min_n, effectors.thrust_max_n);

    let mut commands = PerEffector::default();
    commands[Effector::LeftAileron] = -aileron;
    commands[Effector::RightAileron] = aileron;
    commands[Effector::LeftElevator] = elevator;
    commands[Effector::RightElevator] = elevator;
    commands[Effector::Rudder] = rudder;
    commands[Effector::NozzlePitch] = nozzle_pitch;
    commands[Effector::NozzleYaw] = nozzle_yaw;
    commands[Effector::Engine] = thrust;
    Mixed {
        commands,
        applied: Compensation {
            aileron_rad: aileron - main_share(main.aileron_rad, effectors.aileron.travel_rad),
            nozzle_pitch_rad: nozzle_pitch - main_share(main.nozzle_pitch_rad, travel),
            nozzle_yaw_rad: nozzle_yaw - main_share(main.nozzle_yaw_rad, travel),
        },
        saturation: Saturation {
            aileron: aileron_side,
            elevator: elevator_side,
            rudder: rudder_side,
            nozzle_pitch: nozzle_pitch_side,
            nozzle_yaw: nozzle_yaw_side,
            thrust: thrust_side,
        },
    }
}

/// The effectors as the main controller alone would have them.
#[must_use]
pub fn mix_main_only(main: &MainCommand, belief: &Belief) -> PerEffector<f64> {
    mix(main, &Compensation::NONE, belief).commands
}

fn main_share(main: f64, travel: f64) -> f64 {
    main.clamp(-travel, travel)
}

fn clip(value: f64, min: f64, max: f64) -> (f64, Side) {
    if value > max {
        (max, Side::Above)
    } else if value < min {
        (min, Side::Below)
    } else {
        (value, Side::Inside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_command_leaves_the_travel_whatever_is_asked(
            asked in proptest::array::uniform6(-1.0e9..1.0e9_f64), extra in proptest::array::uniform3(-1.0e9..1.0e9_f64),
        ) {
            let belief = testing::belief();
            let [aileron_rad, elevator_rad, rudder_rad, nozzle_pitch_rad, nozzle_yaw_rad, thrust_n] = asked;
            let main = MainCommand { aileron_rad, elevator_rad, rudder_rad, nozzle_pitch_rad, nozzle_yaw_rad, thrust_n };
            let [aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad] = extra;
            let mixed = mix(&main, &Compensation { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad }, &belief);
            for (effector, command) in mixed.commands.iter() {
                match belief.servo(effector) {
                    Some(servo) => prop_assert!(command.abs() <= servo.travel_rad),
                    None => prop_assert!((belief.effectors.thrust_min_n..=belief.effectors.thrust_max_n).contains(command)),
                }
            }
        }
    }

    #[test]
    fn ailerons_move_against_each_other_and_elevators_together() {
        let main = MainCommand {
            aileron_rad: 0.1,
            elevator_rad: 0.2,
            thrust_n: 2.0e4,
            ..MainCommand::default()
        };
        let c = mix(&main, &Compensation::NONE, &testing::belief()).commands;
        assert_eq!((c[Effector::LeftAileron], c[Effector::RightAileron]), (-0.1, 0.1));
        assert_eq!((c[Effector::LeftElevator], c[Effector::RightElevator]), (0.2, 0.2));
    }

    #[test]
    fn a_saturated_side_blocks_only_the_pushing_direction() {
        assert!(Side::Above.blocks(1.0) && !Side::Above.blocks(-1.0));
        assert!(Side::Below.blocks(-1.0) && !Side::Below.blocks(1.0));
        assert!(!Side::Inside.blocks(1.0));
    }
}
