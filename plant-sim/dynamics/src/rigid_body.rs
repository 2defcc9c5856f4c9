//! Six degrees of freedom: force and moment to motion, over any [`crate::earth::Earth`].
//!
//! Independent of the aircraft: any vehicle with a mass, an inertia, a force and a moment can fly it.

use icd::Body;
use icd::frames::rotation_matrix;
use nalgebra::{Matrix3, Vector3};

/// Number of values of the state.
pub const STATES: usize = 13;

/// Position and motion of the body, relative to the Earth-fixed frame E of [`crate::earth::Earth`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidState {
    /// Position in E, m.
    pub position: Vector3<f64>,
    /// Unit quaternion (w, x, y, z) that turns body axes into E.
    pub q_e_from_body: [f64; 4],
    /// Velocity relative to E, m/s, body axes.
    pub velocity: Body,
    /// Rates relative to inertial space, rad/s, body axes.
    pub rates: Body,
}

/// The rates of change of [`RigidState`], in its units per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidDerivative {
    /// Of the position, m/s, frame E.
    pub position: Vector3<f64>,
    /// Of the quaternion, 1/s.
    pub q_e_from_body: [f64; 4],
    /// Of the components of the velocity, m/s², body axes.
    pub velocity: Body,
    /// Of the components of the inertial rates, rad/s², body axes.
    pub rates: Body,
}

/// Mass and inertia about the centre of gravity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass_kg: f64,
    pub per_mass: f64,
    /// Inertia tensor I, kg m², body axes: off-diagonal terms are minus the products of inertia.
    pub inertia: Matrix3<f64>,
    pub inertia_inverse: Matrix3<f64>,
}

impl MassProperties {
    /// From mass (kg) and tensor (kg m²); `None` if one of them is not positive definite.
    pub fn new(mass_kg: f64, inertia: Matrix3<f64>) -> Option<Self> {
        // Sylvester's criterion: all leading minors are positive.
        let positive = mass_kg > 0.0
            && inertia[(0, 0)] > 0.0
            && inertia.fixed_view::<2, 2>(0, 0).determinant() > 0.0
            && inertia.determinant() > 0.0;
        let inertia_inverse = inertia.try_inverse().filter(|_| positive)?;
        Some(Self { mass_kg, per_mass: 1.0 / mass_kg, inertia, inertia_inverse })
    }
}

/// Force and moment about the centre of gravity, without gravity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench {
    /// Force, N.
    pub force: Body,
    /// Moment, N m.
    pub moment: Body,
}

impl Wrench {
    #[inline]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            force: Body(self.force.0 + other.force.0),
            moment: Body(self.moment.0 + other.moment.0),
        }
    }
}

/// Forces at points of the body that keep their direction in frame E during a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HeldForces {
    /// Their sum, N, frame E.
    force: Vector3<f64>,
    /// Sum of the products of place (m, body axes, from the centre of gravity) and force (N, frame E).
    levers: Matrix3<f64>,
}

impl HeldForces {
    /// Adds a force, N, frame E, at a place from the centre of gravity, m, body axes.
    pub fn add(&mut self, at: &Vector3<f64>, force: &Vector3<f64>) {
        self.force += force;
        self.levers += at * force.transpose();
    }

    /// Force and moment on a body in this attitude.
    #[inline]
    pub fn wrench(&self, e_from_body: &Matrix3<f64>) -> Wrench {
        // Of every product r x f the matrix has the terms r_i f_j, once f is in body axes.
        let m = self.levers * e_from_body;
        Wrench {
            force: Body(e_from_body.tr_mul(&self.force)),
            moment: Body::new(m.m23 - m.m32, m.m31 - m.m13, m.m12 - m.m21),
        }
    }
}

impl RigidDerivative {
    /// Adds what more forces and moments do.
    #[inline]
    pub fn add(&mut self, mass: &MassProperties, more: &Wrench) {
        self.velocity.0 += more.force.0 * mass.per_mass;
        self.rates.0 += mass.inertia_inverse * more.moment.0;
    }
}

impl RigidState {
    /// The values in a row for the integrator: position, quaternion, velocity, rates.
    #[inline]
    pub fn to_array(&self) -> [f64; STATES] {
        let (r, q, v, w) = (&self.position, &self.q_e_from_body, &self.velocity.0, &self.rates.0);
        [r.x, r.y, r.z, q[0], q[1], q[2], q[3], v.x, v.y, v.z, w.x, w.y, w.z]
    }

    /// From the values in the order of [`RigidState::to_array`].
    #[inline]
    pub fn from_array(x: &[f64; STATES]) -> Self {
        Self {
            position: Vector3::new(x[0], x[1], x[2]),
            q_e_from_body: [x[3], x[4], x[5], x[6]],
            velocity: Body::new(x[7], x[8], x[9]),
            rates: Body::new(x[10], x[11], x[12]),
        }
    }

    /// The same attitude with a quaternion of length one: integration lets the length drift.
    #[inline]
    #[must_use]
    pub fn normalised(mut self) -> Self {
        let [w, x, y, z] = self.q_e_from_body;
        let scale = 1.0 / ((w * w + x * x) + (y * y + z * z)).sqrt();
        self.q_e_from_body = [w * scale, x * scale, y * scale, z * scale];
        self
    }

    /// Matrix that turns body axes into E.
    #[inline]
    pub fn e_from_body(&self) -> Matrix3<f64> {
        rotation_matrix(self.q_e_from_body)
    }
}

impl RigidDerivative {
    /// The values in the order of [`RigidState::to_array`].
    #[inline]
    pub fn to_array(&self) -> [f64; STATES] {
        let (r, q, v, w) = (&self.position, &self.q_e_from_body, &self.velocity.0, &self.rates.0);
        [r.x, r.y, r.z, q[0], q[1], q[2], q[3], v.x, v.y, v.z, w.x, w.y, w.z]
    }
}

/// Equations of motion of a rigid body over a rotating Earth.
///
/// With the rate ω of the body and Ω of the Earth, both in body axes, and the velocity v relative to the Earth:
/// v̇ = F/m + g − (ω + Ω)×v, where g holds gravitation and −Ω×(Ω×r).
///
/// Implements Eq. (1) as ω̇ = I⁻¹(M − ω×Iω) with the moments of air and jet together in M; see Eq. (2) and
/// Eq. (3) for the paper's form.
/// Implements Eq. (13): the position moves with v turned into E.
/// Implements Eq. (14) with the quaternion in the place of the Euler angles; attitude turns with ω − Ω.
///
/// `e_from_body`, the rate of the Earth (rad/s, body axes) and `gravity` (m/s², frame E, [`crate::earth::Place`])
/// belong to `state`; the caller has them already.
#[inline]
pub fn derivative(
    state: &RigidState,
    e_from_body: &Matrix3<f64>,
    mass: &MassProperties,
    wrench: &Wrench,
    earth_rate: &Body,
    gravity: &Vector3<f64>,
) -> RigidDerivative {
    let (v, w, earth_rate) = (&state.velocity.0, &state.rates.0, &earth_rate.0);
    let gravity = e_from_body.tr_mul(gravity);
    let relative = w - earth_rate;
    let momentum = mass.inertia * w;
    let [qw, qx, qy, qz] = state.q_e_from_body;
    let (p, q, r) = (0.5 * relative.x, 0.5 * relative.y, 0.5 * relative.z);
    RigidDerivative {
        position: e_from_body * v,
        q_e_from_body: [
            -(qx * p + qy * q + qz * r),
            qw * p + qy * r - qz * q,
            qw * q + qz * p - qx * r,
            qw * r + qx * q - qy * p,
        ],
        velocity: Body(wrench.force.0 * mass.per_mass + gravity - (w + earth_rate).cross(v)),
        rates: Body(mass.inertia_inverse * (wrench.moment.0 - w.cross(&momentum))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::earth::{Earth, EarthModel, ROTATION_RAD_S};
    use crate::geodesy::Geodetic;
    use crate::integrator::rk4;

    const START: Geodetic =
        Geodetic { latitude_rad: 0.6, longitude_rad: -1.3, altitude_m: 9_144.0 };

    const FREE: Wrench = Wrench { force: Body::zero(), moment: Body::zero() };

    fn brick() -> MassProperties {
        let inertia = Matrix3::new(2.6, 0.0, -0.4, 0.0, 8.4, 0.0, -0.4, 0.0, 9.8) * 1e-3;
        MassProperties::new(2.27, inertia).unwrap()
    }

    fn motion(
        state: &RigidState,
        mass: &MassProperties,
        wrench: &Wrench,
        earth: &Earth,
    ) -> RigidDerivative {
        let e_from_body = state.e_from_body();
        let gravity = earth.place(&state.position).gravity;
        derivative(state, &e_from_body, mass, wrench, &earth.rotation_in(&e_from_body), &gravity)
    }

    fn fly(mut state: RigidState, earth: &Earth, steps: u32, h: f64) -> RigidState {
        let mass = brick();
        for _ in 0..steps {
            let slope = |x: &[f64; STATES]| {
                motion(&RigidState::from_array(x), &mass, &FREE, earth).to_array()
            };
            let x = state.to_array();
            let x = rk4(&x, &slope(&x), h, slope);
            state = RigidState::from_array(&x).normalised();
        }
        state
    }

    fn start(earth: &Earth, geodetic: &Geodetic, rates: Body) -> RigidState {
        RigidState {
            position: earth.position(geodetic),
            q_e_from_body: earth.q_e_from_body(geodetic, &icd::Attitude::identity()),
            velocity: Body::zero(),
            rates,
        }
    }

    /// Angular momentum in inertial axes: E has turned by `angle` about z since the start.
    fn inertial_momentum(state: &RigidState, angle: f64) -> Vector3<f64> {
        let (s, c) = libm::sincos(angle);
        let i_from_e = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        i_from_e * state.e_from_body() * brick().inertia * state.rates.0
    }

    #[test]
    fn torque_free_spin_keeps_angular_momentum_and_energy() {
        for model in [EarthModel::Flat, EarthModel::Wgs84] {
            let earth = Earth::new(model, START);
            let first = start(&earth, &START, Body::new(0.17, 0.35, 0.52));
            let last = fly(first, &earth, 3_000, 0.01);
            let turned = earth.rotation().z * 30.0;
            let before = inertial_momentum(&first, 0.0);
            let change = (inertial_momentum(&last, turned) - before).norm() / before.norm();
            // RK4 at 10 ms and 0.6 rad/s: (0.006)^5 per step, 3000 steps, and rounding.
            assert!(change < 1e-9, "{model:?}: momentum changed by {change}");
            let energy = |s: &RigidState| s.rates.0.dot(&(brick().inertia * s.rates.0));
            let change = energy(&last) / energy(&first) - 1.0;
            assert!(change.abs() < 1e-9, "{model:?}: energy changed by {change}");
        }
    }

    #[test]
    fn free_fall_on_the_flat_earth_is_a_parabola() {
        let earth = Earth::new(EarthModel::Flat, START);
        let mut first = start(&earth, &START, Body::new(0.3, -0.2, 0.1));
        first.velocity = Body::new(100.0, 0.0, 0.0);
        let last = fly(first, &earth, 1_000, 0.01);
        let expected = Vector3::new(1_000.0, 0.0, -9_144.0 + 0.5 * 9.806_65 * 100.0);
        // RK4 turns the velocity with the tumbling body: 1e-9 of 1 km.
        assert!((last.position - expected).norm() < 1e-6, "{}", (last.position - expected).norm());
    }

    #[test]
    fn free_fall_at_the_equator_follows_the_kepler_orbit() {
        // An independent calculation: the same fall in inertial axes with its own integration of gravitation alone.
        let here = Geodetic { latitude_rad: 0.0, longitude_rad: 0.0, altitude_m: 9_144.0 };
        let earth = Earth::new(EarthModel::Wgs84, here);
        let first = start(&earth, &here, Body::zero());
        let last = fly(first, &earth, 1_000, 0.03);
        let mut x = [first.position.x, 0.0, 0.0, ROTATION_RAD_S * first.position.x];
        let slope = |x: &[f64; 4]| {
            let g = crate::earth::gravitation(&Vector3::new(x[0], x[1], 0.0));
            [x[2], x[3], g.x, g.y]
        };
        for _ in 0..1_000 {
            x = rk4(&x, &slope(&x), 0.03, slope);
        }
        let (s, c) = libm::sincos(ROTATION_RAD_S * 30.0);
        let expected = Vector3::new(c * x[0] + s * x[1], c * x[1] - s * x[0], 0.0);
        // 1e-7 m: a thousand roundings of 6.4e6 m numbers.
        let error = (last.position - expected).norm();
        assert!(error < 1e-6, "{error} m apart after 30 s");
        // And it falls 4.4 km, a little to the east (Coriolis): 2/3 w g t^3 ... about 6 m.
        assert!(earth.geodetic(&last.position).longitude_rad > 0.0);
    }

    #[test]
    fn at_rest_on_the_rotating_earth_needs_exactly_weight_as_support() {
        let earth = Earth::new(EarthModel::Wgs84, START);
        let mass = brick();
        let mut state = start(&earth, &START, Body::zero());
        let e_from_body = state.e_from_body();
        state.rates = Body(e_from_body.tr_mul(&earth.rotation()));
        let place = earth.place(&state.position);
        let support = Body(e_from_body.tr_mul(&place.gravity) * -mass.mass_kg);
        let wrench = Wrench { force: support, moment: Body::zero() };
        let d = motion(&state, &mass, &wrench, &earth);
        assert!(d.velocity.0.norm() < 1e-14, "{} m/s2", d.velocity.0.norm());
        assert!(d.q_e_from_body.iter().all(|x| x.abs() < 1e-19), "attitude turns");
    }

    #[test]
    fn product_of_inertia_couples_roll_into_yaw_with_the_sign_of_the_reference() {
        // Eq. (3): a pure roll moment L gives r' = Ixz L / G with Ixz = + integral of xz dm.
        let earth = Earth::new(EarthModel::Flat, START);
        let state = start(&earth, &START, Body::zero());
        let wrench = Wrench { force: Body::zero(), moment: Body::new(1.0, 0.0, 0.0) };
        let d = motion(&state, &brick(), &wrench, &earth);
        let g = 2.6e-3 * 9.8e-3 - 0.4e-3 * 0.4e-3;
        assert!((d.rates.0.z - 0.4e-3 / g).abs() < 1e-9, "r' = {} rad/s2", d.rates.0.z);
        assert!((d.rates.0.x - 9.8e-3 / g).abs() < 1e-9, "p' = {} rad/s2", d.rates.0.x);
    }

    #[test]
    fn impossible_inertia_is_refused() {
        assert!(MassProperties::new(-1.0, Matrix3::identity()).is_none());
        assert!(MassProperties::new(1.0, -Matrix3::identity()).is_none());
        assert!(MassProperties::new(1.0, Matrix3::zeros()).is_none());
    }
}
