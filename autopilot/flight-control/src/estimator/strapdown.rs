//! Inertial navigation: attitude, velocity and position from angular rate and specific force, in start axes.

use icd::SimTime;
use icd::frames::rotation_matrix;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::covariance::{
    ATTITUDE, BAROMETER, FORCE_BIAS, GYRO_BIAS, MAGNETIC_BIAS, POSITION, STEADY_WIND, States,
    Transition, VANES, VELOCITY, WIND,
};
use super::history::Integrals;

/// The estimate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Estimate {
    /// Turns body axes into start axes.
    pub start_from_body: UnitQuaternion<f64>,
    /// Velocity over the ground, m/s, start axes.
    pub velocity: Vector3<f64>,
    /// Position, m, start axes.
    pub position: Vector3<f64>,
    /// Bias of the gyros, rad/s.
    pub gyro_bias: Vector3<f64>,
    /// Bias of the accelerometers, m/s².
    pub force_bias: Vector3<f64>,
    /// Wind with its gusts, m/s, local NED.
    pub wind: Vector3<f64>,
    /// The same without gusts.
    pub steady_wind: Vector3<f64>,
    /// Bias of the magnetometer, nT, body axes.
    pub magnetic_bias: Vector3<f64>,
    /// Pressure altitude minus geopotential altitude, m.
    pub barometer_offset: f64,
    /// Biases of the vanes of angle of attack and sideslip, rad.
    pub vane_bias: [f64; 2],
}

/// What the inertial sensors measure, corrected: angular rate relative to inertial space, rad/s, and specific force, m/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// Angular rate.
    pub rate: Vector3<f64>,
    /// Specific force.
    pub force: Vector3<f64>,
}

/// Forces of the place, in start axes.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// Gravity, m/s².
    pub gravity: Vector3<f64>,
    /// Rotation of the Earth, rad/s.
    pub rotation: Vector3<f64>,
}

impl Estimate {
    /// Matrix from body to start axes.
    pub fn matrix(&self) -> Matrix3<f64> {
        let q = self.start_from_body.quaternion();
        rotation_matrix([q.w, q.i, q.j, q.k])
    }

    /// One step of the inertial navigation; adds what it did to `transition` and `integrals`.
    ///
    /// q̇ = ½ q ω - ½ Ω q; v̇ = C f + g - 2 Ω × v; ṗ = v. The specific force is turned by half of the rotation of the step.
    pub fn advance(
        &mut self,
        inertial: &Inertial,
        field: &Field,
        seconds: f64,
        transition: &mut Transition,
        integrals: &mut Integrals,
    ) {
        let matrix = self.matrix();
        let relative = inertial.rate - matrix.tr_mul(&field.rotation);
        let turn = relative * seconds;
        let force = matrix * (inertial.force + turn.cross(&inertial.force) * 0.5);
        let coriolis = field.rotation.cross(&self.velocity) * 2.0;
        let gained = (force + field.gravity - coriolis) * seconds;
        self.position += (self.velocity + gained * 0.5) * seconds;
        self.velocity += gained;
        self.start_from_body = normal(self.start_from_body.quaternion() * turned_by(&turn));
        transition.seconds += seconds;
        transition.turned += matrix * seconds;
        transition.force += force * seconds;
        integrals.position += (integrals.velocity + gained * 0.5) * seconds;
        integrals.velocity += gained;
        let micros = libm::round(seconds * 1.0e6) as u64;
        integrals.time = SimTime::from_micros(integrals.time.as_micros() + micros);
    }

    /// Adds a correction of the error state.
    pub fn correct(&mut self, x: &States) {
        let at = |from: usize| Vector3::new(x[from], x[from + 1], x[from + 2]);
        let turn = turned_by(&at(ATTITUDE));
        // From the left: the error of the attitude is one in start axes.
        self.start_from_body = normal(turn * self.start_from_body.quaternion());
        self.velocity += at(VELOCITY);
        self.position += at(POSITION);
        self.gyro_bias += at(GYRO_BIAS);
        self.force_bias += at(FORCE_BIAS);
        self.wind += at(WIND);
        self.magnetic_bias += at(MAGNETIC_BIAS);
        self.barometer_offset += x[BAROMETER];
        self.vane_bias[0] += x[VANES];
        self.vane_bias[1] += x[VANES + 1];
        self.steady_wind.x += x[STEADY_WIND];
        self.steady_wind.y += x[STEADY_WIND + 1];
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let vectors = [
            &self.velocity,
            &self.position,
            &self.gyro_bias,
            &self.force_bias,
            &self.wind,
            &self.steady_wind,
            &self.magnetic_bias,
        ];
        let mut numbers = vectors.iter().flat_map(|vector| vector.iter());
        let q = self.start_from_body.coords;
        numbers.all(|x| x.is_finite())
            && q.iter().all(|x| x.is_finite())
            && self.barometer_offset.is_finite()
            && self.vane_bias.iter().all(|x| x.is_finite())
    }
}

/// Quaternion of a rotation vector, rad: to the fourth order of half its length, 1e-9 at 0.2 rad; normalised by the caller.
fn turned_by(turn: &Vector3<f64>) -> Quaternion<f64> {
    let half_2 = 0.25 * turn.norm_squared();
    // A correction can be large; the series is for small turns.
    let (sine_ratio, cosine) = if half_2 < 0.01 {
        (
            0.5 * (1.0 - half_2 / 6.0 * (1.0 - half_2 / 20.0)),
            1.0 - 0.5 * half_2 * (1.0 - half_2 / 12.0),
        )
    } else {
        let half = libm::sqrt(half_2);
        (0.5 * libm::sin(half) / half, libm::cos(half))
    };
    let v = turn * sine_ratio;
    Quaternion::new(cosine, v.x, v.y, v.z)
}

/// Of unit length: one step of Newton is exact to rounding for a quaternion that is almost so.
fn normal(q: Quaternion<f64>) -> UnitQuaternion<f64> {
    let square = q.norm_squared();
    let scale = match libm::fabs(square - 1.0) < 1.0e-8 {
        true => 1.5 - 0.5 * square,
        false => 1.0 / libm::sqrt(square),
    };
    UnitQuaternion::new_unchecked(q * scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::covariance::STATES;

    #[test]
    fn a_steady_turn_comes_back_to_its_start() {
        // 20 deg/s about the vertical at 100 m/s: a circle of 286 m in 18 s.
        let rate = 20_f64.to_radians();
        let field = Field { gravity: Vector3::new(0.0, 0.0, 9.8), rotation: Vector3::zeros() };
        let velocity = Vector3::new(100.0, 0.0, 0.0);
        let mut estimate = Estimate { velocity, ..Estimate::default() };
        // Towards the centre, on the right.
        let force = Vector3::new(0.0, 100.0 * rate, -9.8);
        let inertial = Inertial { rate: Vector3::new(0.0, 0.0, rate), force };
        let (mut transition, mut integrals) = (Transition::NONE, Integrals::at(SimTime::ZERO));
        for _ in 0..9_000 {
            estimate.advance(&inertial, &field, 0.002, &mut transition, &mut integrals);
        }
        assert!(estimate.position.norm() < 0.01, "{}", estimate.position);
        assert!((estimate.velocity - velocity).norm() < 1.0e-3, "{}", estimate.velocity);
        assert_eq!(integrals.time, SimTime::from_micros(18_000_000));
        assert!((integrals.velocity + velocity - estimate.velocity).norm() < 1.0e-9);
        assert!((transition.seconds - 18.0).abs() < 1.0e-9);
    }

    #[test]
    fn a_correction_turns_in_start_axes() {
        let start_from_body =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), core::f64::consts::FRAC_PI_2);
        let mut estimate = Estimate { start_from_body, ..Estimate::default() };
        let mut x = [0.0; STATES];
        x[ATTITUDE] = 0.01;
        let before = estimate.matrix();
        estimate.correct(&x);
        // C_true = (I + [θ ×]) C.
        let expected = before + Vector3::new(0.01, 0.0, 0.0).cross_matrix() * before;
        assert!((estimate.matrix() - expected).amax() < 1.0e-4);
        assert!((estimate.start_from_body.norm() - 1.0).abs() < 1.0e-12);
    }
}
