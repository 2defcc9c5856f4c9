//! The fence: areas to stay in or out of, and altitude limits; and rally points, where a return may end. Areas are checked when
//! they are made, so a fence in force is never in doubt.

use flight_control::guidance::Horizontal;
use icd::SimTime;
use serde::{Deserialize, Serialize};

use super::Situation;
use super::geodesy::{Horizon, Site};
pub use super::request::{Breach, FenceAction, FenceChange, FenceStatus};
use super::request::{Place, VehicleRefusal};
use super::rules::{RADIUS_MAX_M, check_place, within};

/// Vertices and circles that a fence may have in all.
pub const VERTICES_MAX: usize = 200;
/// Rally points that a list may have.
pub const RALLY_MAX: usize = 50;
/// Smallest polygon.
const VERTICES_MIN: usize = 3;
/// Vertices closer to each other are one point, m.
const SAME_M: f64 = 0.1;
/// A breach is over after this long inside, s.
const BACK_AFTER_S: f64 = 5.0;
/// The fence is looked at this often, s: a jet has flown 30 m.
const EVERY_S: f64 = 0.1;

/// An area of a fence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Area {
    /// To stay in; otherwise out.
    pub inclusion: bool,
    pub shape: AreaShape,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum AreaShape {
    /// Its vertices, the last beside the first.
    Polygon(Vec<Place>),
    Circle {
        centre: Place,
        radius_m: f64,
    },
}

/// Areas that have been checked.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Fence(Vec<Area>);

/// A place where a return may end, and its altitude, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RallyPoint {
    pub place: Place,
    pub altitude_m: f64,
}

/// What is wrong with an item of a fence: a vertex of a polygon or a circle, counted from 0 through all areas.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FenceProblem {
    #[error("the polygon has {vertices} vertices; expected {VERTICES_MIN} to {VERTICES_MAX}")]
    Count { vertices: usize },
    #[error("the fence has {vertices} vertices and circles; expected 1 to {VERTICES_MAX}")]
    TooMany { vertices: usize },
    #[error("same place as vertex {other} of its polygon, 0.1 m or less between them")]
    Same { other: usize },
    #[error("its edge to the next vertex crosses that from vertex {other} of its polygon")]
    Crossing { other: usize },
    #[error("it lies on the edge from vertex {other} of its polygon, 0.1 m or less from it")]
    OnEdge { other: usize },
    #[error(transparent)]
    Range(#[from] VehicleRefusal),
}

impl Fence {
    /// A fence of these areas, or all that is wrong with them, by item.
    pub fn new(areas: Vec<Area>) -> Result<Self, Vec<(usize, FenceProblem)>> {
        let vertices = areas.iter().map(Area::items).sum();
        if vertices > VERTICES_MAX {
            return Err(vec![(0, FenceProblem::TooMany { vertices })]);
        }
        let (mut problems, mut first) = (Vec::new(), 0);
        for area in &areas {
            area.check(&mut |item, problem| problems.push((first + item, problem)));
            first += area.items();
        }
        if problems.is_empty() { Ok(Self(areas)) } else { Err(problems) }
    }

    pub fn areas(&self) -> &[Area] {
        &self.0
    }

    /// Why the fence keeps a place out; `None` where it does not.
    pub fn breach(&self, place: Place) -> Option<Breach> {
        let inside = |inclusion: bool| {
            let mut areas = self.0.iter().filter(move |area| area.inclusion == inclusion);
            areas.any(|area| area.contains(place))
        };
        if inside(false) {
            Some(Breach::Exclusion)
        } else if self.0.iter().any(|area| area.inclusion) && !inside(true) {
            Some(Breach::Outside)
        } else {
            None
        }
    }
}

impl Area {
    /// Number of its items.
    pub fn items(&self) -> usize {
        match &self.shape {
            AreaShape::Polygon(vertices) => vertices.len(),
            AreaShape::Circle { .. } => 1,
        }
    }

    fn check(&self, problem: &mut dyn FnMut(usize, FenceProblem)) {
        let vertices = match &self.shape {
            AreaShape::Polygon(vertices) => vertices,
            AreaShape::Circle { centre, radius_m } => {
                let radius = || within("radius", "m", *radius_m, (1.0, RADIUS_MAX_M));
                if let Err(refusal) = check_place(*centre).and_then(|()| radius()) {
                    problem(0, refusal.into());
                }
                return;
            }
        };
        if vertices.len() < VERTICES_MIN {
            return problem(0, FenceProblem::Count { vertices: vertices.len() });
        }
        for (at, place) in vertices.iter().enumerate() {
            if let Err(refusal) = check_place(*place) {
                return problem(at, refusal.into());
            }
        }
        let corners = corners(vertices);
        let count = corners.len();
        for (at, corner) in corners.iter().enumerate() {
            let before = corners.iter().take(at);
            if let Some(other) = before.clone().position(|other| (corner - other).norm() <= SAME_M)
            {
                return problem(at, FenceProblem::Same { other });
            }
        }
        for (at, corner) in corners.iter().enumerate() {
            let edge = (*corner, next(&corners, at));
            let crosses = |other: &usize| {
                let is_neighbour = (other + 1) % count == at || (at + 1) % count == *other;
                let from = corners.get(*other).copied().unwrap_or_default();
                !is_neighbour && cross(edge, (from, next(&corners, *other)))
            };
            if let Some(other) = (0..at).find(crosses) {
                return problem(at, FenceProblem::Crossing { other });
            }
            // Also a polygon that is only a line has such a vertex.
            let lies_on = |other: &usize| {
                let from = corners.get(*other).copied().unwrap_or_default();
                let is_end = *other == at || (other + 1) % count == at;
                !is_end && distance_m(corner, (from, next(&corners, *other))) <= SAME_M
            };
            if let Some(other) = (0..count).find(lies_on) {
                return problem(at, FenceProblem::OnEdge { other });
            }
        }
    }

    fn contains(&self, place: Place) -> bool {
        match &self.shape {
            AreaShape::Circle { centre, radius_m } => {
                Horizon::at(*centre).offset(&Site::at(place)).norm() <= *radius_m
            }
            AreaShape::Polygon(vertices) => {
                // The parity of the edges east of the place.
                let horizon = Horizon::at(place);
                let seen = |place: &Place| horizon.offset(&Site::at(*place));
                let ends = vertices.iter().zip(vertices.iter().cycle().skip(1));
                let is_east = |(a, b): &(&Place, &Place)| {
                    let (a, b) = (seen(a), seen(b));
                    (a.x > 0.0) != (b.x > 0.0) && a.y - a.x * (b.y - a.y) / (b.x - a.x) > 0.0
                };
                ends.filter(is_east).count() % 2 == 1
            }
        }
    }
}

/// The vertices as seen from the first, m.
fn corners(vertices: &[Place]) -> Vec<Horizontal> {
    let Some(first) = vertices.first() else { return Vec::new() };
    let horizon = Horizon::at(*first);
    vertices.iter().map(|place| horizon.offset(&Site::at(*place))).collect()
}

/// The corner behind this one.
fn next(corners: &[Horizontal], at: usize) -> Horizontal {
    corners.get(at + 1).or(corners.first()).copied().unwrap_or_default()
}

/// Whether two edges cross.
fn cross((a, b): (Horizontal, Horizontal), (c, d): (Horizontal, Horizontal)) -> bool {
    let side = |p: &Horizontal, q: &Horizontal, r: &Horizontal| (q - p).perp(&(r - p));
    side(&a, &b, &c) * side(&a, &b, &d) < 0.0 && side(&c, &d, &a) * side(&c, &d, &b) < 0.0
}

/// Distance of a point from an edge, m.
fn distance_m(point: &Horizontal, (a, b): (Horizontal, Horizontal)) -> f64 {
    let along = b - a;
    let part = (point - a).dot(&along) / along.norm_squared();
    (a + along * part.clamp(0.0, 1.0) - point).norm()
}

/// Watches the fence in flight.
#[derive(Debug, Clone, Default)]
pub struct FenceWatch {
    /// Switched off by DO_FENCE_ENABLE.
    pub is_off: bool,
    breach: Option<Breach>,
    breaches: u16,
    last: Option<(Breach, SimTime)>,
    inside_s: f64,
    waited_s: f64,
    /// It has been above the lower limit since its start or lift-off; before, that does not count.
    was_above: bool,
}

impl FenceWatch {
    pub(super) fn status(&self, fence: &Fence) -> FenceStatus {
        let Self { is_off, breach, breaches, last, .. } = *self;
        FenceStatus { has_areas: !fence.areas().is_empty(), is_off, breach, breaches, last }
    }

    /// Watches another fence from now on; the breaches still count.
    pub(super) fn restart(&mut self) {
        let Self { breaches, last, was_above, .. } = *self;
        *self = Self { breaches, last, was_above, ..Self::default() };
    }

    /// One tick on the ground.
    pub(super) fn rest(&mut self) {
        self.was_above = false;
    }

    /// One tick. The lower limit is not for an aircraft that lands; one that was below it before still is.
    pub(super) fn step(
        &mut self,
        fence: &Fence,
        situation: &Situation<'_>,
        lands: bool,
        time: SimTime,
    ) -> Option<FenceChange> {
        let navigation = &situation.rules.navigation;
        let height_m = situation.altitude_m - situation.rules.ground_m;
        let is_below = height_m < navigation.fence_min_m;
        self.was_above |= !is_below;
        if self.is_off || navigation.fence_action == FenceAction::Nothing {
            self.breach = None;
            return None;
        }
        self.waited_s += situation.dt_s;
        if self.waited_s < EVERY_S {
            return None;
        }
        let dt_s = core::mem::take(&mut self.waited_s);
        let most_m = navigation.fence_max_m;
        let is_low = is_below && self.was_above && (!lands || self.breach == Some(Breach::Low));
        let breach = match fence.breach(situation.place) {
            None if most_m > 0.0 && height_m > most_m => Some(Breach::High),
            None if navigation.fence_min_m > 0.0 && is_low => Some(Breach::Low),
            breach => breach,
        };
        match (self.breach, breach) {
            (None, Some(breach)) => {
                (self.breach, self.inside_s) = (Some(breach), 0.0);
                (self.breaches, self.last) =
                    (self.breaches.saturating_add(1), Some((breach, time)));
                Some(FenceChange::Breached(breach))
            }
            (Some(_), None) => {
                self.inside_s += dt_s;
                if self.inside_s < BACK_AFTER_S {
                    return None;
                }
                self.breach = None;
                Some(FenceChange::Back)
            }
            (Some(_), Some(_)) => {
                self.inside_s = 0.0;
                None
            }
            (None, None) => None,
        }
    }
}
