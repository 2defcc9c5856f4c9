//! Numbers that lead from one unit to another.

use core::f64::consts::PI;

/// Standard acceleration of free fall, m/s² (3rd CGPM, 1901).
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// One degree, rad.
pub const DEG: f64 = PI / 180.0;

/// One radian, deg.
pub const DEG_PER_RAD: f64 = 180.0 / PI;
