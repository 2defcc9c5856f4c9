//! Flight termination: the commands of the effectors in place of those of the laws.
//!
//! The engine is commanded to no thrust (it stays at idle), the nozzle is straight, and the surfaces go to their
//! stops: elevators pitch up, rudder yaws right, ailerons roll right. The shipped aircraft departs and comes
//! down spinning to the right, about one kilometre from the point of termination. The laws keep running, so
//! that their signals stay readable; only the commands are replaced, after the mixer. Signs are those of the
//! interface (`icd`).

use flight_control::AircraftModel;
use flight_control::aircraft_model::EffectorModel;
use icd::{EffectorKind, PerEffector};

/// Commands of a terminated flight: rad; thrust N.
pub fn commands(model: &AircraftModel) -> PerEffector<f64> {
    let EffectorModel { list, servos, gains, .. } = &model.effectors;
    PerEffector::from_fn(|effector| {
        let is_surface = list.kind(effector).is_some_and(EffectorKind::is_surface);
        // Negative aileron, elevator and rudder commands roll right, pitch up and yaw right.
        let direction = gains[effector].of([-1.0, -1.0, -1.0, 0.0]);
        let servo = &servos[effector];
        if !is_surface || direction == 0.0 {
            0.0
        } else if direction > 0.0 {
            servo.max
        } else {
            servo.min
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::configuration;
    use aircraft::DEFAULT_MODEL;
    use icd::{Effector, tvc_jet};

    #[test]
    fn the_surfaces_stand_at_their_stops_for_a_spin_to_the_right_without_thrust() {
        let model = configuration::aircraft_model("model", DEFAULT_MODEL).unwrap();
        let commands = commands(&model);
        // The sign of a moment is that of the control derivatives times the commands.
        let moment = |derivatives: &PerEffector<f64>, surfaces: &[Effector]| -> f64 {
            surfaces.iter().map(|surface| derivatives[*surface] * commands[*surface]).sum()
        };
        let effectors = &model.effectors;
        assert!(moment(&effectors.c_roll, &tvc_jet::ALL[..2]) > 0.0, "ailerons roll right");
        assert!(moment(&effectors.c_pitch, &tvc_jet::ALL[..5]) > 0.0, "pitches up");
        assert!(moment(&effectors.c_yaw, &tvc_jet::ALL[..5]) > 0.0, "yaws right");
        assert_eq!(commands[tvc_jet::ENGINE], 0.0);
    }
}
