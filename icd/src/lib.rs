//! Interface control document as code: the only vocabulary that the autopilot and the plant share.
//!
//! # Conventions
//!
//! * SI units and radians everywhere. Any other unit is the last word of the name (`_deg`, `_ms`).
//! * Body axes: x forward, y right, z down, origin at the centre of gravity.
//! * NED: north, east, down at the place it is used. Local position is measured in the plane that
//!   touches the Earth at the start point (altitude zero), so it does not follow the curvature.
//! * Altitude is height above the WGS-84 ellipsoid, or above the plane on the flat Earth; the ground is 0 m where a
//!   scenario has no other.
//! * Body rates are relative to inertial space, as gyros measure them.
//! * Angle of attack `alpha = atan2(w, u)` and sideslip `beta = asin(v / V)` of the air-relative velocity.
//!
//! # Signs of the effectors
//!
//! The files of an aircraft list its effectors ([`EffectorList`]). Those of `tvc_jet`, the aircraft of the
//! paper:
//!
//! | effector | positive means | moment of a positive deflection |
//! |---|---|---|
//! | left aileron | trailing edge down | +roll, +yaw |
//! | right aileron | trailing edge down | -roll, -yaw |
//! | left elevator | trailing edge down | +roll, -pitch, +yaw |
//! | right elevator | trailing edge down | -roll, -pitch, -yaw |
//! | rudder | trailing edge left | small +roll, -yaw, +Y force |
//! | nozzle pitch | jet force on the airframe down | +pitch |
//! | nozzle yaw | jet force on the airframe to the left | +yaw |
//! | engine | thrust in newton | none |
//!
//! The ailerons work as a pair: aileron command `a` means right = `a`, left = `-a`.
//!
//! # Signal path
//!
//! The plant sends [`Sensors`], the autopilot answers with [`Actuators`]; [`wire`] encodes both as datagrams, and
//! [`lockstep`] defines which side waits for the other. Fault requests and replies ([`fault`]) travel in the same packets; the
//! control laws never see them.
//!
//! # Where to start
//!
//! Read [`sensors`] and [`effector_list`], then [`wire`]. A [`FaultRequest`] requests a fault from the plant; the kinds are those of
//! [`fault::CATALOGUE`]:
//!
//! ```
//! use icd::fault::{FaultKind, Onset, Timing, Travel};
//! use icd::{FaultRequest, tvc_jet};
//!
//! let request = FaultRequest::Inject {
//!     target: tvc_jet::LEFT_ELEVATOR.into(),
//!     kind: FaultKind::StuckAt { angle_rad: 30_f64.to_radians(), travel: Travel::Jump },
//!     timing: Timing::NOW,
//! };
//! let FaultRequest::Inject { timing, .. } = request else { unreachable!() };
//! assert_eq!(timing.onset, Onset::AtOnce);
//! assert_eq!(tvc_jet::effectors().name(tvc_jet::LEFT_ELEVATOR), "left elevator");
//! ```

#![no_std]
#![warn(missing_docs)]

#[cfg(test)]
extern crate std;

pub mod effector_list;
pub mod fault;
pub mod frames;
pub mod geomagnetism;
pub mod lockstep;
pub mod pace;
pub mod record;
pub mod sensors;
pub mod signals;
pub mod time;
pub mod tvc_jet;
pub mod units;
pub mod wire;

pub use effector_list::{
    Actuators, AxisGains, Effector, EffectorKind, EffectorList, LateralSide, PerEffector,
};
pub use fault::{FaultKind, FaultReply, FaultRequest};
pub use frames::{Attitude, Body, EulerAngles, Ned};
pub use sensors::{FlowAngles, GnssFix, ImpactPressure, Sample, Sensors, Stamp, StaticPressure};
pub use time::{ControlPeriod, SimTime};
