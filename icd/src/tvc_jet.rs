//! The effectors of `tvc_jet`, the aircraft of the paper, by their places in its files.
//!
//! For tests and for the studies that fly the paper's own cases. No other code names an effector: it finds each one
//! in the list of the aircraft, by kind and side (`tests/architecture.rs`).

use crate::effector_list::{
    Effector, EffectorEntry, EffectorKind, EffectorList, LateralSide, Name,
};
use crate::wire::Aircraft;

const fn place(index: usize) -> Effector {
    match Effector::from_index(index) {
        Some(effector) => effector,
        None => panic!("there are not so many"),
    }
}

/// Left aileron, trailing edge down positive.
pub const LEFT_AILERON: Effector = place(0);
/// Right aileron, trailing edge down positive.
pub const RIGHT_AILERON: Effector = place(1);
/// Left elevator, trailing edge down positive.
pub const LEFT_ELEVATOR: Effector = place(2);
/// Right elevator, trailing edge down positive.
pub const RIGHT_ELEVATOR: Effector = place(3);
/// Rudder, trailing edge left positive.
pub const RUDDER: Effector = place(4);
/// Nozzle pitch angle, positive pitches the nose up.
pub const NOZZLE_PITCH: Effector = place(5);
/// Nozzle yaw angle, positive yaws the nose right.
pub const NOZZLE_YAW: Effector = place(6);
/// Engine, thrust in newton.
pub const ENGINE: Effector = place(7);

/// All of them, in order.
pub const ALL: [Effector; 8] = [
    LEFT_AILERON,
    RIGHT_AILERON,
    LEFT_ELEVATOR,
    RIGHT_ELEVATOR,
    RUDDER,
    NOZZLE_PITCH,
    NOZZLE_YAW,
    ENGINE,
];

/// The list, as in the files of the aircraft.
///
/// # Panics
/// Never: a test builds the list.
pub fn effectors() -> EffectorList {
    use EffectorKind as K;
    use LateralSide::{Centre, Left, Right};
    // All names are shorter than the limit.
    let name = |text: &str| Name::from(text).unwrap_or_default();
    let entry = |text, kind, side, partner: Option<&str>, instance| EffectorEntry {
        name: name(text),
        kind,
        side,
        partner: partner.map(name),
        instance,
    };
    let list = EffectorList::new([
        entry("left aileron", K::Aileron, Left, Some("right aileron"), 1),
        entry("right aileron", K::Aileron, Right, Some("left aileron"), 2),
        entry("left elevator", K::Elevator, Left, Some("right elevator"), 3),
        entry("right elevator", K::Elevator, Right, Some("left elevator"), 4),
        entry("rudder", K::Rudder, Centre, None, 5),
        entry("nozzle pitch", K::NozzlePitch, Centre, None, 6),
        entry("nozzle yaw", K::NozzleYaw, Centre, None, 7),
        entry("engine", K::Engine, Centre, None, 1),
    ]);
    list.unwrap_or_default()
}

/// The aircraft's identity in packets.
pub fn aircraft() -> Aircraft {
    Aircraft::new(Name::from("tvc_jet").unwrap_or_default(), &effectors())
}
