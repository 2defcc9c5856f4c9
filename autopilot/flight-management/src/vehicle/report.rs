//! Reports of the vehicle: its mode, its guidance, and changes.

use super::plan::Progress;
use super::request::{LinkLossAction, Place};
use core::fmt;
use serde::{Deserialize, Serialize};

/// Source of the references.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Given references, or a pilot's sticks; without either the aircraft holds altitude, course and
    /// speed. A flight begins in this mode.
    Position,
    /// The aircraft circles around a point.
    Hold,
    /// The aircraft flies its plan.
    Mission,
    /// The aircraft flies home and circles there.
    Return,
    /// A ground station streams setpoints.
    Offboard,
    /// A pilot's sticks give roll angle, climb and airspeed.
    Altitude,
}

impl Mode {
    /// All modes, in the order in which ground stations list them.
    pub const ALL: [Self; 6] =
        [Self::Position, Self::Hold, Self::Mission, Self::Return, Self::Offboard, Self::Altitude];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "Position",
            Self::Hold => "Hold",
            Self::Mission => "Mission",
            Self::Return => "Return",
            Self::Offboard => "Offboard",
            Self::Altitude => "Altitude",
        }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Guidance at one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Navigation {
    /// Point that the aircraft flies to or circles around.
    pub target: Option<Target>,
    /// Course over the ground of the guidance, rad from north.
    pub course_rad: Option<f64>,
    /// Distance from the path, m, positive to its right.
    pub cross_track_m: f64,
    /// Plan being flown or loaded: its [`super::plan::Plan::id`].
    pub plan_id: u32,
    /// Items of that plan.
    pub items: u16,
    /// Current item of that plan.
    pub item: u16,
    /// Progress of the plan.
    pub progress: Progress,
    /// Home, once there was a first sample.
    pub home: Option<Place>,
}

/// A point that the guidance flies to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    pub place: Place,
    /// Altitude above the ellipsoid, m.
    pub altitude_m: f64,
    /// Horizontal distance to it, m.
    pub distance_m: f64,
    /// Bearing from the aircraft to it, rad from north.
    pub bearing_rad: f64,
    /// Radius of the circle flown around it, m; `None` on a leg.
    pub radius_m: Option<f64>,
}

/// A change in the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VehicleEvent {
    Mode(Mode),
    /// This item of the plan is now the current one.
    PlanItem(u16),
    /// The aircraft has reached this item of the plan.
    ItemReached(u16),
    /// The last item of the plan is done.
    PlanComplete,
    /// Home was moved to here.
    Home(Place),
    /// The flight was terminated.
    Terminated,
    /// The controlling ground station has fallen silent, and this is the reaction.
    LinkLost(LinkLossAction),
    /// It is back, and this mode is restored.
    LinkBack(Mode),
}
