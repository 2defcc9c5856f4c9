//! The attainable set: all angular accelerations B u with u inside its bounds, and how far it reaches.
//!
//! W. C. Durham, "Constrained control allocation", Journal of Guidance, Control, and Dynamics 16(4), 1993: in three axes
//! the set is a convex polyhedron, and two columns span each of its faces. So the normals of all faces are among the cross
//! products of two columns, and in a direction d the set reaches as far as the nearest face:
//!
//! ```text
//! t(d) = min over normals n with n·d > 0 of h(n) / (n·d),    h(n) = max over u of n·B (u - u_0)
//! ```
//!
//! Every vector n gives an upper limit of t, so normals that belong to no face do no harm. The axes count as columns
//! without travel: with their normals a flat set, or a line, is treated like any other.

use nalgebra::Vector3;

use super::{COLUMNS_MAX, Column, within};

/// A direction within this angle (rad) of a face's plane does not meet the face: the quotient would be rounding.
const PARALLEL: f64 = 1.0e-9;

/// Candidates for an edge: the columns and the axes.
const EDGES_MAX: usize = COLUMNS_MAX + 3;

/// How far one axis can be driven both ways, the other two left as they are, rad/s².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reach {
    /// Size of the largest negative change.
    pub negative: f64,
    /// Largest positive change.
    pub positive: f64,
}

/// What is left on each axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxisReach {
    /// Roll.
    pub roll: Reach,
    /// Pitch.
    pub pitch: Reach,
    /// Yaw.
    pub yaw: Reach,
}

/// Largest t for which B (u - `positions`) = t `direction` has a solution inside the bounds.
///
/// `positions` in the order of the columns, cut at the bounds. Total: never negative, zero for a direction that is zero or
/// not finite; columns are taken as [`super::allocate`] takes them.
pub fn largest_scale(columns: &[Column], positions: &[f64], direction: &Vector3<f64>) -> f64 {
    let [scale] = scales(columns, positions, [*direction]);
    scale
}

/// How far each axis can be driven from `positions`, both ways.
pub fn axis_reach(columns: &[Column], positions: &[f64]) -> AxisReach {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let [roll, pitch, yaw, left, down, back] = scales(columns, positions, [x, y, z, -x, -y, -z]);
    AxisReach {
        roll: Reach { negative: left, positive: roll },
        pitch: Reach { negative: down, positive: pitch },
        yaw: Reach { negative: back, positive: yaw },
    }
}

impl AxisReach {
    /// Roll, pitch and yaw.
    pub fn axes(&self) -> [Reach; 3] {
        [self.roll, self.pitch, self.yaw]
    }
}

impl Reach {
    /// What is left of `whole`, the reach from the preferred positions, in the direction that has less, percent.
    ///
    /// Zero on an axis that had no authority to begin with.
    pub fn left_pct(&self, whole: &Self) -> f64 {
        let side = |left: f64, whole: f64| if whole > 0.0 { left / whole } else { 0.0 };
        let left = side(self.negative, whole.negative).min(side(self.positive, whole.positive));
        100.0 * left.clamp(0.0, 1.0)
    }
}

fn scales<const N: usize>(
    columns: &[Column],
    positions: &[f64],
    directions: [Vector3<f64>; N],
) -> [f64; N] {
    let count = columns.len().min(COLUMNS_MAX);
    // Each column times its whole travel, and which part of it lies below and above the present position.
    let mut edges = [Vector3::zeros(); EDGES_MAX];
    let (mut below, mut above) = ([0.0; COLUMNS_MAX], [0.0; COLUMNS_MAX]);
    for (i, column) in columns.iter().take(count).enumerate() {
        let column = column.usable();
        let travel = column.max - column.min;
        let position = positions.get(i).copied().unwrap_or(column.preferred);
        if travel > 0.0 {
            let part = (within(position, column.min, column.max) - column.min) / travel;
            (below[i], above[i]) = (part, 1.0 - part);
            edges[i] = column.effect * travel;
        }
    }
    // Axes in units of what the effectors can do on them; the scale t is a pure number and stays the same.
    let mut unit = Vector3::zeros();
    for edge in &edges[..count] {
        unit += edge.abs();
    }
    let in_units =
        |v: &Vector3<f64>| v.zip_map(&unit, |v, unit| if unit > 0.0 { v / unit } else { v });
    for edge in &mut edges[..count] {
        *edge = in_units(edge);
    }
    let directions = directions.map(|direction| in_units(&direction));
    let lengths = directions.map(|direction| PARALLEL * PARALLEL * direction.norm_squared());
    for axis in 0..3 {
        edges[count + axis] = Vector3::ith(axis, 1.0);
    }

    let mut limits = [f64::INFINITY; N];
    for i in 0..count + 3 {
        // One normal serves two opposite faces: `backwards` is how far the other one is.
        for j in i + 1..count + 3 {
            let normal = edges[i].cross(&edges[j]);
            let (mut forwards, mut backwards) = (0.0, 0.0);
            for k in 0..count {
                let along = normal.dot(&edges[k]);
                let (with, against) =
                    if along > 0.0 { (above[k], below[k]) } else { (below[k], above[k]) };
                forwards += along.abs() * with;
                backwards += along.abs() * against;
            }
            let smallest = normal.norm_squared();
            for ((limit, direction), length) in limits.iter_mut().zip(&directions).zip(lengths) {
                let along = normal.dot(direction);
                // The cosine against `PARALLEL`, squared: normals and directions of length zero fail it without a
                // division.
                if along * along > smallest * length {
                    let reach = if along > 0.0 { forwards } else { backwards };
                    *limit = limit.min(reach / along.abs());
                }
            }
        }
    }
    // No face limits a direction that is zero or not finite.
    limits.map(|limit| if limit.is_finite() { limit } else { 0.0 })
}
