//! Numbers that lead from one unit to another.

use core::f64::consts::PI;

/// Standard acceleration of free fall, m/s² (3rd CGPM, 1901).
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// A thrust below it is shown in N, one from it on in kN.
pub const SMALL_THRUST_N: f64 = 1.0e3;

/// One degree, rad.
pub const DEG: f64 = PI / 180.0;

/// One radian, deg.
pub const DEG_PER_RAD: f64 = 180.0 / PI;
