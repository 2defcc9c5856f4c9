//! The first attitude: where down is by the accelerometers, and where north is by the magnetometer or the track.

use icd::{Body, Ned};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Shortest horizontal part of a direction that gives a heading, as a part of its length.
const HORIZONTAL_MIN: f64 = 0.05;

/// A direction that is known in body and in NED axes, for the heading.
#[derive(Debug, Clone, Copy)]
pub struct Direction {
    /// As measured.
    pub body: Body,
    /// As it has to be.
    pub ned: Ned,
}

/// Rotation from body to NED axes in which `force` (specific force, body axes) is along `expected`, and the horizontal
/// part of `direction` points where it has to; `None` if a vector is too short for it.
///
/// The method of two vectors (TRIAD, Black 1964), with the specific force as the first one.
pub fn align(force: &Body, expected: &Ned, direction: &Direction) -> Option<UnitQuaternion<f64>> {
    let body = frame(&force.0, &direction.body.0)?;
    let ned = frame(&expected.0, &direction.ned.0)?;
    let rotation = Rotation3::from_matrix_unchecked(ned * body.transpose());
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Columns: the first vector's direction, the part of the second one across it, and their product.
fn frame(first: &Vector3<f64>, second: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let a = first.try_normalize(1.0e-6)?;
    let b = second.try_normalize(1.0e-6)?;
    let across = (b - a * a.dot(&b)).try_normalize(HORIZONTAL_MIN)?;
    Some(Matrix3::from_columns(&[a, across, a.cross(&across)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::{Attitude, EulerAngles};

    #[test]
    fn exact_vectors_give_the_attitude() {
        for (phi, theta, psi) in [(0.0, 0.03, 0.0), (0.5, -0.2, 2.0), (-1.0, 0.4, -3.0)] {
            let attitude = Attitude::from_euler(EulerAngles { phi, theta, psi });
            let (down, field) = (Ned::new(0.0, 0.0, -9.8), Ned::new(20_000.0, 3_000.0, 45_000.0));
            let direction = Direction { body: attitude.to_body(field), ned: field };
            let found = align(&attitude.to_body(down), &down, &direction).unwrap();
            assert!(found.angle_to(&attitude.q_ned_from_body) < 1.0e-9);
        }
    }

    #[test]
    fn a_direction_along_the_vertical_gives_none() {
        let down = Ned::new(0.0, 0.0, -9.8);
        let direction = Direction { body: Body::new(0.0, 0.0, 1.0), ned: Ned::new(0.0, 0.0, 1.0) };
        assert!(align(&Body(down.0), &down, &direction).is_none());
    }
}
