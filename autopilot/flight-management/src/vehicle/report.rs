//! What the vehicle publishes: its mode, where it is going, and what has changed.

use super::plan::Progress;
use super::request::{LinkLossAction, Place};
use core::fmt;
use serde::{Deserialize, Serialize};

/// Who gives the references.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// References as they stand, or a pilot's sticks; without either the aircraft holds altitude, course and
    /// speed. A flight begins in it.
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
    /// All of them, in the order in which they are listed to ground stations.
    pub const ALL: [Self; 6] =
        [Self::Position, Self::Hold, Self::Mission, Self::Return, Self::Offboard, Self::Altitude];

    /// Name for people.
    #[must_use]
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

/// What the guidance does at one tick.
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
    /// How far it has come.
    pub progress: Progress,
    /// Home, once there was a first sample.
    pub home: Option<Place>,
}

/// A point that the guidance flies to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Where.
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

/// Something that changed in the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VehicleEvent {
    /// The mode changed.
    Mode(Mode),
    /// This item of the plan is the current one now.
    PlanItem(u16),
    /// This item of the plan has been reached.
    ItemReached(u16),
    /// The last item of the plan is done.
    PlanComplete,
    /// Home was moved to here.
    Home(Place),
    /// The flight was terminated.
    Terminated,
    /// The controlling ground station has fallen silent, and this is done about it.
    LinkLost(LinkLossAction),
    /// It is back, and the mode is this one again.
    LinkBack(Mode),
}
