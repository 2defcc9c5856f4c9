//! Moment demand to more effectors than axes: bounded weighted least squares.
//!
//! Not in the paper, whose Eq. (25) has as many redundant commands as axes. Of all positions u inside their bounds
//! this takes the one that minimises
//!
//! ```text
//! |W_u (u - u_p)|² + γ |W_v (B u - v)|²        min ≤ u ≤ max
//! ```
//!
//! where column i of B is the angular acceleration per unit of effector i, v the demand and u_p the preferred
//! positions: with γ large the demand is met as far as the bounds allow, and what freedom is left over keeps the
//! effectors near u_p. The solver is the active set method of
//!
//! O. Härkegård, "Efficient active set algorithms for solving constrained least squares problems in aircraft control
//! allocation", Proc. 41st IEEE Conference on Decision and Control, 2002, section 4 (`WLS`).
//!
//! Every iterate is inside the bounds, so an early end still gives a command that can be flown. What is particular
//! here is the linear algebra (`active_set`): a subproblem has three unknowns, not one for each effector.
//!
//! [`attainable`] has the set of all B u: how far it reaches in a direction.

use nalgebra::Vector3;

use active_set::Scaled;

mod active_set;
pub mod attainable;
#[cfg(test)]
mod tests;

/// Largest number of effectors; columns beyond it are not used.
pub const COLUMNS_MAX: usize = 16;

/// Largest number of iterations. Of a million random problems with 16 effectors, most of them far beyond what can be attained,
/// the worst needed 55, all together 17 on average. From the active set of the step before it is mostly one.
pub const ITERATIONS_MAX: u32 = 64;

/// An axis on which all effectors together have less than this part of the strongest axis is not controlled: dividing
/// by it would amplify rounding.
const AUTHORITY_MIN: f64 = 1.0e-9;

/// One effector as the allocation sees it: a column of B with its bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Angular acceleration (roll, pitch, yaw) per unit of the effector: rad/s² per rad, or per N.
    pub effect: Vector3<f64>,
    /// Smallest position, rad or N.
    pub min: f64,
    /// Largest position, rad or N.
    pub max: f64,
    /// u_p, where the effector stands if nothing is demanded of it, rad or N.
    pub preferred: f64,
    /// Diagonal element of W_u, 1/rad or 1/N: the larger, the less this effector is used.
    pub weight: f64,
}

/// What the demand is worth, axis by axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Priority of roll, pitch and yaw. An axis is measured by the authority that all effectors together have on it, so
    /// the three numbers compare like with like; W_v is the priority over this authority.
    pub priority: Vector3<f64>,
    /// γ, how much the demand counts more than the preferred positions: 1 to 10⁹, cut there.
    pub demand_over_preference: f64,
}

impl Settings {
    /// Roll before pitch before yaw, each a hundred times (in the square) the next, and demand before preference.
    pub const DEFAULT: Self =
        Self { priority: Vector3::new(100.0, 10.0, 1.0), demand_over_preference: 1.0e6 };
}

/// Which bound an effector is held at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bound {
    /// None.
    #[default]
    Free,
    /// The lower one.
    Min,
    /// The upper one.
    Max,
}

/// The bounds that hold in a solution. That of the last step is a good start for the next one.
pub type ActiveSet = [Bound; COLUMNS_MAX];

/// The result of [`allocate`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allocation {
    /// Positions of the effectors in the order of the columns, rad or N, each inside its bounds.
    pub positions: [f64; COLUMNS_MAX],
    /// B u, rad/s².
    pub attained: Vector3<f64>,
    /// Bounds that hold.
    pub active: ActiveSet,
    /// Iterations that it took.
    pub iterations: u32,
    /// Whether the solution is the optimum; else the iterations ran out, and it is the best one so far.
    pub optimal: bool,
}

/// Distributes `demand` (rad/s²) over the effectors.
///
/// Total. An axis whose demand is not finite is left out. An effector stays at zero if its bounds are not finite or
/// the lower one is above the upper one, and is not counted on if its effect is not finite; a preferred position outside
/// the bounds is moved to the nearer one. `start` speeds the search up and does not change the optimum.
pub fn allocate(
    columns: &[Column],
    demand: &Vector3<f64>,
    settings: &Settings,
    start: &ActiveSet,
) -> Allocation {
    let columns = &columns[..columns.len().min(COLUMNS_MAX)];
    let mut scaled = [Scaled::NONE; COLUMNS_MAX];
    for (scaled, column) in scaled.iter_mut().zip(columns) {
        *scaled = column.usable().scaled();
    }
    let scaled = &scaled[..columns.len()];
    let mut demand = *demand;
    let mut axis_weight = axis_weights(scaled, settings);
    for axis in 0..3 {
        if !demand[axis].is_finite() {
            (demand[axis], axis_weight[axis]) = (0.0, 0.0);
        }
    }
    let mut problem = active_set::Problem::new(scaled, &demand, &axis_weight, settings);
    let (iterations, optimal) = problem.solve(start);

    let mut positions = [0.0; COLUMNS_MAX];
    let mut attained = Vector3::zeros();
    for (i, (column, scaled)) in columns.iter().zip(scaled).enumerate() {
        positions[i] = match problem.active[i] {
            // What is not used has no travel, and stays at zero.
            _ if scaled.min == scaled.max => scaled.preferred,
            // Exactly at the bound; the way back from y would round.
            Bound::Min => column.min,
            Bound::Max => column.max,
            Bound::Free => {
                within(scaled.preferred + problem.y[i] * scaled.per_weight, column.min, column.max)
            }
        };
        attained += scaled.effect * positions[i];
    }
    Allocation { positions, attained, active: problem.active, iterations, optimal }
}

/// Diagonal of W_v: priority over the authority of the axis, zero for an axis without authority.
fn axis_weights(columns: &[Scaled], settings: &Settings) -> Vector3<f64> {
    let mut authority = Vector3::zeros();
    for column in columns {
        authority += column.a.component_mul(&column.a);
    }
    let authority = authority.map(libm::sqrt);
    let floor = AUTHORITY_MIN * authority.max();
    settings.priority.zip_map(&authority, |priority, authority| {
        let weight = priority / authority;
        if authority > floor && weight.is_finite() { weight } else { 0.0 }
    })
}

impl Column {
    /// An effector that does nothing and stays at zero.
    const NONE: Self = Self {
        effect: Vector3::new(0.0, 0.0, 0.0),
        min: 0.0,
        max: 0.0,
        preferred: 0.0,
        weight: 1.0,
    };

    /// The column with every number finite and in order.
    fn usable(&self) -> Self {
        if !(self.min.is_finite() && self.max.is_finite() && self.min <= self.max) {
            return Self::NONE;
        }
        let effect =
            if self.effect.iter().all(|x| x.is_finite()) { self.effect } else { Vector3::zeros() };
        let weight = if self.weight.is_finite() && self.weight > 0.0 { self.weight } else { 1.0 };
        let preferred = within(self.preferred, self.min, self.max);
        Self { effect, preferred, weight, ..*self }
    }

    /// In the unknown y = (u - u_p) · weight.
    fn scaled(&self) -> Scaled {
        let per_weight = 1.0 / self.weight;
        Scaled {
            effect: self.effect,
            preferred: self.preferred,
            per_weight,
            a: self.effect * per_weight,
            min: (self.min - self.preferred) * self.weight,
            max: (self.max - self.preferred) * self.weight,
        }
    }
}

/// `value` inside the bounds; the middle between them for a value that is not a number.
fn within(value: f64, min: f64, max: f64) -> f64 {
    // Halved first: the sum of two large bounds could overflow.
    let value = if value.is_nan() { 0.5 * min + 0.5 * max } else { value };
    // Not `clamp`, which panics when the bounds are out of order or NaN.
    value.max(min).min(max)
}
