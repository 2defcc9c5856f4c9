//! Where the vehicle is going, for telemetry.

use super::plan::Progress;
use super::request::Place;

/// What the guidance does at one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Navigation {
    /// Point that the aircraft flies to or circles around.
    pub target: Option<Target>,
    /// Course over the ground that the guidance wants, rad from north.
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
