//! Vectors typed by their axes, and the attitude that transforms one into the other.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// A vector in body axes: x forward, y right, z down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Body(pub Vector3<f64>);

/// A vector in north, east, down axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Ned(pub Vector3<f64>);

impl Body {
    /// From components along x (forward), y (right), z (down).
    #[inline]
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self(Vector3::new(x, y, z))
    }

    /// The zero vector.
    #[inline]
    pub const fn zero() -> Self {
        Self::new(0.0, 0.0, 0.0)
    }
}

impl Ned {
    /// From components along north, east, down.
    #[inline]
    pub const fn new(north: f64, east: f64, down: f64) -> Self {
        Self(Vector3::new(north, east, down))
    }

    /// The zero vector.
    #[inline]
    pub const fn zero() -> Self {
        Self::new(0.0, 0.0, 0.0)
    }
}

/// Orientation of the body axes seen from the local NED axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Attitude {
    /// Rotates a body vector into NED.
    pub q_ned_from_body: UnitQuaternion<f64>,
}

/// Roll, pitch and yaw, rad, in the order yaw, pitch, roll from NED to body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EulerAngles {
    /// Roll angle, rad, in (-pi, pi].
    pub phi: f64,
    /// Pitch angle, rad, in [-pi/2, pi/2].
    pub theta: f64,
    /// Yaw angle (heading), rad, in (-pi, pi].
    pub psi: f64,
}

impl Attitude {
    /// Wings level, nose north.
    pub fn identity() -> Self {
        Self { q_ned_from_body: UnitQuaternion::identity() }
    }

    /// From roll, pitch, yaw in rad.
    pub fn from_euler(euler: EulerAngles) -> Self {
        let (sr, cr) = libm::sincos(0.5 * euler.phi);
        let (sp, cp) = libm::sincos(0.5 * euler.theta);
        let (sy, cy) = libm::sincos(0.5 * euler.psi);
        Self::from_quaternion(
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )
    }

    /// From the scalar and vector parts, normalised.
    pub fn from_quaternion(w: f64, x: f64, y: f64, z: f64) -> Self {
        Self { q_ned_from_body: UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)) }
    }

    /// From a quaternion that is already of unit length, bit for bit.
    #[inline]
    pub fn from_unit_wxyz([w, x, y, z]: [f64; 4]) -> Self {
        Self { q_ned_from_body: UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)) }
    }

    /// Scalar part first, as in MAVLink and in the packets.
    #[inline]
    pub fn wxyz(&self) -> [f64; 4] {
        let q = self.q_ned_from_body.quaternion();
        [q.w, q.i, q.j, q.k]
    }

    /// Direction cosine matrix that rotates a body vector into NED.
    #[inline]
    pub fn matrix(&self) -> Matrix3<f64> {
        rotation_matrix(self.wxyz())
    }

    /// Roll, pitch, yaw in rad.
    pub fn euler(&self) -> EulerAngles {
        let [w, x, y, z] = self.wxyz();
        // Rounding can exceed one, where the arc sine is NaN.
        let sin_theta = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0);
        EulerAngles {
            phi: atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            theta: libm::asin(sin_theta),
            psi: atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        }
    }

    /// Transforms a body vector to NED.
    #[inline]
    pub fn to_ned(&self, v: Body) -> Ned {
        Ned(self.matrix() * v.0)
    }

    /// Transforms a NED vector to body axes.
    #[inline]
    pub fn to_body(&self, v: Ned) -> Body {
        Body(self.matrix().tr_mul(&v.0))
    }
}

/// Matrix of the rotation by a unit quaternion (w, x, y, z).
#[inline]
pub fn rotation_matrix([w, x, y, z]: [f64; 4]) -> Matrix3<f64> {
    Matrix3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
}

/// Angle of a direction from the x axis towards the y axis, rad: [`libm::atan2`] to the bit.
///
/// Most angles of a flight are within 45 degrees of ahead. There the function is the arc tangent of the ratio; the library looks
/// for every special case first, which takes as long again.
#[inline]
pub fn atan2(y: f64, x: f64) -> f64 {
    if x > 0.0 && y.abs() <= x && x < f64::INFINITY { libm::atan(y / x) } else { libm::atan2(y, x) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn euler_angles_survive_the_quaternion(phi in -3.1..3.1, theta in -1.5..1.5, psi in -3.1..3.1) {
            let back = Attitude::from_euler(EulerAngles { phi, theta, psi }).euler();
            // 1e-9 rad: pitch loses digits in asin near 90 degrees.
            prop_assert!((back.phi - phi).abs() < 1e-9);
            prop_assert!((back.theta - theta).abs() < 1e-9);
            prop_assert!((back.psi - psi).abs() < 1e-9);
        }

        #[test]
        fn a_vector_turned_there_and_back_is_the_same(phi in -3.1..3.1, theta in -1.5..1.5, psi in -3.1..3.1) {
            let attitude = Attitude::from_euler(EulerAngles { phi, theta, psi });
            let v = Body::new(1.0, -2.0, 3.0);
            prop_assert!((attitude.to_body(attitude.to_ned(v)).0 - v.0).norm() < 1e-12);
        }
    }

    proptest! {
        #[test]
        fn the_angle_of_a_direction_has_the_bits_of_the_library(
            y in -1.0e3..1.0e3, x in -1.0e3..1.0e3, scale in -320_i32..308,
        ) {
            let small = libm::pow(10.0, f64::from(scale));
            for (y, x) in [(y, x), (y * small, x), (y, x * small), (y * small, x * small)] {
                prop_assert_eq!(atan2(y, x).to_bits(), libm::atan2(y, x).to_bits(), "{} {}", y, x);
            }
        }
    }

    #[test]
    fn the_angle_of_a_special_direction_is_that_of_the_library() {
        let numbers = [0.0, -0.0, 1.0, -1.0, 5.0e-324, -5.0e-324, f64::MAX, f64::INFINITY];
        let numbers = numbers.into_iter().chain([f64::NEG_INFINITY, f64::NAN]);
        for y in numbers.clone() {
            for x in numbers.clone() {
                assert_eq!(atan2(y, x).to_bits(), libm::atan2(y, x).to_bits(), "{y} {x}");
            }
        }
    }

    #[test]
    fn nose_up_points_the_x_axis_up() {
        let attitude = Attitude::from_euler(EulerAngles { phi: 0.0, theta: 0.1, psi: 0.0 });
        assert!(attitude.to_ned(Body::new(1.0, 0.0, 0.0)).0.z < 0.0);
    }

    #[test]
    fn right_wing_down_points_the_y_axis_down() {
        let attitude = Attitude::from_euler(EulerAngles { phi: 0.1, theta: 0.0, psi: 0.0 });
        assert!(attitude.to_ned(Body::new(0.0, 1.0, 0.0)).0.z > 0.0);
    }
}
