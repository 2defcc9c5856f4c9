//! Flight termination: what the effectors are told instead of what the laws say.
//!
//! The engine is told to give nothing (it stays at idle), the nozzle is straight, and the surfaces go to their
//! stops: elevators pitch up, rudder yaws right, ailerons roll right. The shipped aircraft departs and comes
//! down spinning to the right, about one kilometre from where it was terminated. The laws run on beside it, so
//! that their signals stay readable; only the commands are replaced, after the mixer. Signs are those of the
//! interface (`icd`).

use flight_control::Belief;
use icd::{Effector, PerEffector};

/// Commands of a terminated flight: rad; thrust N.
#[must_use]
pub fn commands(belief: &Belief) -> PerEffector<f64> {
    let effectors = &belief.effectors;
    PerEffector::from_fn(|effector| match effector {
        Effector::LeftAileron => effectors.aileron.travel_rad,
        Effector::RightAileron => -effectors.aileron.travel_rad,
        // Trailing edges up.
        Effector::LeftElevator | Effector::RightElevator => -effectors.elevator.travel_rad,
        // Trailing edge right.
        Effector::Rudder => -effectors.rudder.travel_rad,
        Effector::NozzlePitch | Effector::NozzleYaw | Effector::Engine => 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{self, DEFAULT_BELIEF};

    #[test]
    fn the_surfaces_stand_at_their_stops_for_a_spin_to_the_right_without_thrust() {
        let belief = config::belief("belief", DEFAULT_BELIEF).unwrap();
        let commands = commands(&belief);
        // The sign of a moment is that of the control derivatives times the commands.
        let moment = |derivatives: &[f64; 5], surfaces: &[Effector]| -> f64 {
            let of = |surface: &Effector| {
                let place = Effector::SURFACES.iter().position(|other| other == surface).unwrap();
                derivatives[place] * commands[*surface]
            };
            surfaces.iter().map(of).sum()
        };
        let ailerons = [Effector::LeftAileron, Effector::RightAileron];
        assert!(moment(&belief.surfaces.c_roll, &ailerons) > 0.0, "ailerons roll right");
        assert!(moment(&belief.surfaces.c_pitch, &Effector::SURFACES) > 0.0, "pitches up");
        assert!(moment(&belief.surfaces.c_yaw, &Effector::SURFACES) > 0.0, "yaws right");
        assert_eq!(commands[Effector::Engine], 0.0);
    }
}
