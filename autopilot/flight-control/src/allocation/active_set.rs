//! The active set method in the scaled unknowns y = W_u (u - u_p).
//!
//! With A = W_v B W_u⁻¹ and c = W_v (v - B u_p) the problem is to minimise |y|² + γ |A y - c|² inside bounds. Let F be the
//! effectors that are free and y_C the others, each at a bound. The minimum over y_F is
//!
//! ```text
//! y_F = A_Fᵀ λ,    (I/γ + A_F A_Fᵀ) λ = c - A_C y_C
//! ```
//!
//! by the matrix inversion lemma, so every subproblem is one symmetric 3 x 3 system, which has a solution whatever A is.
//! λ is γ times what is left of the demand, so the gradient of an effector at a bound is y_i - a_iᵀ λ, without a
//! difference of large numbers: at the optimum it is not negative at a lower bound, not positive at an upper one.

use nalgebra::Vector3;

use super::{ActiveSet, Bound, COLUMNS_MAX, ITERATIONS_MAX, Settings};

/// Range of γ: beyond it the smallest pivot of a subproblem would drown in rounding.
const GAMMA_RANGE: (f64, f64) = (1.0, 1.0e9);

/// A gradient counts as zero below this part of the numbers that it is the difference of.
const GRADIENT_TOLERANCE: f64 = 1.0e-10;

/// A column whose numbers are finite and in order, in the unknown y.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scaled {
    /// Column of B.
    pub effect: Vector3<f64>,
    /// u_p.
    pub preferred: f64,
    /// 1 over the element of W_u.
    pub per_weight: f64,
    /// Column of B W_u⁻¹.
    pub a: Vector3<f64>,
    /// Smallest y.
    pub min: f64,
    /// Largest y.
    pub max: f64,
}

impl Scaled {
    /// An effector that does nothing and stays at zero.
    pub const NONE: Self = Self {
        effect: Vector3::new(0.0, 0.0, 0.0),
        preferred: 0.0,
        per_weight: 1.0,
        a: Vector3::new(0.0, 0.0, 0.0),
        min: 0.0,
        max: 0.0,
    };
}

/// The scaled problem and the present iterate.
pub(super) struct Problem {
    count: usize,
    /// Columns of A.
    a: [Vector3<f64>; COLUMNS_MAX],
    min: [f64; COLUMNS_MAX],
    max: [f64; COLUMNS_MAX],
    c: Vector3<f64>,
    per_gamma: f64,
    /// The iterate, always inside the bounds.
    pub y: [f64; COLUMNS_MAX],
    /// Bounds that hold; the y of these effectors is exactly at the bound.
    pub active: ActiveSet,
}

impl Problem {
    /// With the diagonal of W_v.
    pub fn new(
        columns: &[Scaled],
        demand: &Vector3<f64>,
        axis_weight: &Vector3<f64>,
        settings: &Settings,
    ) -> Self {
        // `max` first: it turns NaN into the lower end.
        let gamma = settings.demand_over_preference.max(GAMMA_RANGE.0).min(GAMMA_RANGE.1);
        let mut problem = Self {
            count: columns.len(),
            a: [Vector3::zeros(); COLUMNS_MAX],
            min: [0.0; COLUMNS_MAX],
            max: [0.0; COLUMNS_MAX],
            c: *demand,
            per_gamma: 1.0 / gamma,
            y: [0.0; COLUMNS_MAX],
            active: [Bound::Free; COLUMNS_MAX],
        };
        for (i, column) in columns.iter().enumerate() {
            problem.a[i] = column.a.component_mul(axis_weight);
            (problem.min[i], problem.max[i]) = (column.min, column.max);
            problem.c -= column.effect * column.preferred;
        }
        problem.c.component_mul_assign(axis_weight);
        problem
    }

    /// Searches the optimum; returns the iterations and whether it was found.
    pub fn solve(&mut self, start: &ActiveSet) -> (u32, bool) {
        for (i, bound) in start.iter().enumerate().take(self.count) {
            // Without travel an effector is always held: if it were free it would block every step at once.
            self.hold(i, if self.min[i] < self.max[i] { *bound } else { Bound::Min });
        }
        let lambda = self.multipliers();
        let inside = self.cut(&lambda);
        // From the active set of the step before this is mostly the optimum already.
        if inside && self.wrongly_held(&lambda).is_none() {
            // Comparisons with NaN are all false, so nothing had to be cut and nothing was held wrongly.
            return (1, lambda.iter().all(|x| x.is_finite()));
        }
        for iteration in 2..=ITERATIONS_MAX {
            let lambda = self.multipliers();
            if self.advance(&lambda) {
                match self.wrongly_held(&lambda) {
                    // Its y stays at the bound, and the next step goes on from there.
                    Some(i) => self.active[i] = Bound::Free,
                    None => return (iteration, true),
                }
            }
        }
        // The last iterate is inside the bounds and can be flown.
        (ITERATIONS_MAX, false)
    }

    /// Holds effector i at a bound, or lets it go.
    fn hold(&mut self, i: usize, bound: Bound) {
        self.active[i] = bound;
        match bound {
            Bound::Free => {}
            Bound::Min => self.y[i] = self.min[i],
            Bound::Max => self.y[i] = self.max[i],
        }
    }

    /// First iterate: the minimum with the bounds of the start, cut at the other bounds, which then hold as well. Returns
    /// whether nothing had to be cut.
    fn cut(&mut self, lambda: &Vector3<f64>) -> bool {
        let mut inside = true;
        for i in 0..self.count {
            if self.active[i] != Bound::Free {
                continue;
            }
            let target = self.a[i].dot(lambda);
            if target > self.max[i] {
                self.hold(i, Bound::Max);
                inside = false;
            } else if target < self.min[i] {
                self.hold(i, Bound::Min);
                inside = false;
            } else if !target.is_nan() {
                // Else it stays at the preferred position, which is inside.
                self.y[i] = target;
            }
        }
        inside
    }

    /// λ of the subproblem with the present active set.
    fn multipliers(&self) -> Vector3<f64> {
        let (mut s, mut rest) = (Symmetric::diagonal(self.per_gamma), self.c);
        for i in 0..self.count {
            match self.active[i] {
                Bound::Free => s.add_square(&self.a[i]),
                Bound::Min | Bound::Max => rest -= self.a[i] * self.y[i],
            }
        }
        s.solve(&rest)
    }

    /// Goes from the iterate to the minimum of the subproblem, or to the first bound on the way, which then holds.
    /// Returns whether the minimum was reached.
    fn advance(&mut self, lambda: &Vector3<f64>) -> bool {
        let mut targets = [0.0; COLUMNS_MAX];
        let (mut step, mut blocking) = (1.0, None);
        for (i, target) in targets.iter_mut().enumerate().take(self.count) {
            if self.active[i] != Bound::Free {
                continue;
            }
            *target = self.a[i].dot(lambda);
            let bound = if *target > self.max[i] {
                (self.max[i], Bound::Max)
            } else if *target < self.min[i] {
                (self.min[i], Bound::Min)
            } else {
                continue;
            };
            // Never zero over zero: the target is beyond the bound and y is not.
            let way = (bound.0 - self.y[i]) / (*target - self.y[i]);
            if way < step {
                (step, blocking) = (way, Some((i, bound)));
            }
        }
        for (i, target) in targets.iter().enumerate().take(self.count) {
            if self.active[i] == Bound::Free {
                let y = self.y[i] + step * (target - self.y[i]);
                // Rounding must not carry the iterate beyond a bound.
                self.y[i] = y.max(self.min[i]).min(self.max[i]);
            }
        }
        if let Some((i, (value, bound))) = blocking {
            // Exactly at the bound, which the sum above may miss by its last bit.
            (self.y[i], self.active[i]) = (value, bound);
        }
        blocking.is_none()
    }

    /// The effector that a bound holds back most although the optimum is inside; `None` if there is none.
    fn wrongly_held(&self, lambda: &Vector3<f64>) -> Option<usize> {
        let (mut worst, mut found) = (0.0, None);
        for i in 0..self.count {
            let target = self.a[i].dot(lambda);
            let inwards = match self.active[i] {
                Bound::Free => continue,
                Bound::Min => target - self.y[i],
                Bound::Max => self.y[i] - target,
            };
            let tolerance = GRADIENT_TOLERANCE * (target.abs() + self.y[i].abs());
            // Without travel there is nothing to win inside.
            if self.min[i] < self.max[i] && inwards > tolerance && inwards > worst {
                (worst, found) = (inwards, Some(i));
            }
        }
        found
    }
}

/// A symmetric positive definite matrix: its lower triangle.
struct Symmetric {
    xx: f64,
    xy: f64,
    xz: f64,
    yy: f64,
    yz: f64,
    zz: f64,
}

impl Symmetric {
    fn diagonal(value: f64) -> Self {
        Self { xx: value, xy: 0.0, xz: 0.0, yy: value, yz: 0.0, zz: value }
    }

    /// Adds a aᵀ.
    #[inline]
    fn add_square(&mut self, a: &Vector3<f64>) {
        self.xx += a.x * a.x;
        self.xy += a.x * a.y;
        self.xz += a.x * a.z;
        self.yy += a.y * a.y;
        self.yz += a.y * a.z;
        self.zz += a.z * a.z;
    }

    /// Solution x of `self` x = b, by L D Lᵀ.
    #[inline]
    fn solve(&self, b: &Vector3<f64>) -> Vector3<f64> {
        // Without pivoting: the matrix is the identity over γ plus squares, so no pivot is smaller than 1/γ.
        let per_d1 = 1.0 / self.xx;
        let (l21, l31) = (self.xy * per_d1, self.xz * per_d1);
        let per_d2 = 1.0 / (self.yy - l21 * self.xy);
        let d2_l32 = self.yz - l21 * self.xz;
        let l32 = d2_l32 * per_d2;
        let per_d3 = 1.0 / (self.zz - l31 * self.xz - l32 * d2_l32);
        let y = b.y - l21 * b.x;
        let z = (b.z - l31 * b.x - l32 * y) * per_d3;
        let y = y * per_d2 - l32 * z;
        Vector3::new(b.x * per_d1 - l21 * y - l31 * z, y, z)
    }
}
