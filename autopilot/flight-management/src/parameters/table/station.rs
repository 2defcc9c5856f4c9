//! Rows of how ground stations see the vehicle.

use super::{Get, Kind, Parameter, Set};

/// Largest system id, as PX4 has it; above are ground stations.
const SYSTEM_ID_MAX: f64 = 250.0;

/// In the order of their index on the wire.
pub(super) const ROWS: &[Parameter] = &[Parameter {
    name: "MAV_SYS_ID",
    group: "Ground stations",
    kind: Kind::Int,
    unit: "-",
    min: 1.0,
    max: SYSTEM_ID_MAX,
    meaning: "MAVLink system id of the vehicle",
    choices: &[],
    at_restart: true,
    get: Get::Own(|p| f64::from(p.link.system_id)),
    set: Set::Own(|p, value| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as checked before"
        )]
        let system_id = value as u8;
        p.link.system_id = system_id;
    }),
}];
