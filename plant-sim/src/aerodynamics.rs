//! Motion through the air and effective deflections to force and moment, body axes.
//!
//! Here are the derivatives of the aircraft without its surfaces, in [`surfaces`] what the surfaces add, and in [`forms`] the
//! choice between derivatives and tables. Every sum keeps left and right
//! together, so that a mirrored flight gets mirrored bits.

use icd::frames::atan2;
use icd::{Body, PerEffector};
use serde::{Deserialize, Serialize};

use crate::rigid_body::Wrench;

pub mod forms;
pub mod surfaces;

pub use forms::{Aerodynamics, AirForces, Geometry};
pub use surfaces::{SurfaceDerivatives, Surfaces};

/// Airspeed below which the rate terms of the coefficients grow no further, m/s: it only prevents a division by
/// zero.
pub const SLOWEST_M_S: f64 = 0.1;

/// Aerodynamic derivatives of the aircraft without its surfaces, and reference geometry. Derivatives are per radian, of rates per `rate length / 2V`.
///
/// Each field gives the letter of the paper's parameter set, by which [`crate::derivatives`] finds
/// it.
///
/// Read from the `[aerodynamics]` table of the airframe file, key by key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aero {
    /// Reference area S, m².
    pub area_m2: f64,
    /// Span b, m.
    pub span_m: f64,
    /// Mean chord c, m.
    pub chord_m: f64,
    /// Angle of attack up to which the coefficients are linear, rad.
    #[serde(rename = "alpha_linear_deg", with = "degrees")]
    pub alpha_linear_rad: f64,
    /// Limit of the effective angle of attack beyond that, rad.
    #[serde(rename = "alpha_max_deg", with = "degrees")]
    pub alpha_max_rad: f64,
    /// Sideslip up to which the coefficients are linear, rad.
    #[serde(rename = "beta_linear_deg", with = "degrees")]
    pub beta_linear_rad: f64,
    /// Limit of the effective sideslip beyond that, rad.
    #[serde(rename = "beta_max_deg", with = "degrees")]
    pub beta_max_rad: f64,
    /// CL0, lift at zero angle of attack.
    pub c_lift_zero: f64,
    /// CLa, lift, 1/rad.
    pub c_lift_alpha: f64,
    /// CLq, lift of the pitch rate.
    pub c_lift_q: f64,
    /// CD0, drag without lift.
    pub c_drag_zero: f64,
    /// kCD, drag for the square of the lift without the elevators.
    pub c_drag_induced: f64,
    /// CDb, drag of the squared sideslip, 1/rad².
    pub c_drag_beta: f64,
    /// CDst, flat-plate drag beyond the linear range.
    pub c_drag_stall: f64,
    /// CYb, side force of the sideslip, 1/rad.
    pub c_side_beta: f64,
    /// CYp, side force of the roll rate.
    pub c_side_p: f64,
    /// CYr, side force of the yaw rate.
    pub c_side_r: f64,
    /// Clb, roll of the sideslip (dihedral), 1/rad.
    pub c_roll_beta: f64,
    /// Clp, roll damping.
    pub c_roll_p: f64,
    /// Clr, roll of the yaw rate.
    pub c_roll_r: f64,
    /// Cm0, pitch at zero angle of attack.
    pub c_pitch_zero: f64,
    /// Cma, pitch stiffness, 1/rad: negative is stable.
    pub c_pitch_alpha: f64,
    /// Cmq, pitch damping.
    pub c_pitch_q: f64,
    /// Cnb, yaw stiffness, 1/rad: positive is stable.
    pub c_yaw_beta: f64,
    /// Cnp, yaw of the roll rate.
    pub c_yaw_p: f64,
    /// Cnr, yaw damping.
    pub c_yaw_r: f64,
}

/// An angle that text files store in degrees, and binary ones unchanged in radians.
mod degrees {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(angle_rad: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            angle_rad.to_degrees().serialize(serializer)
        } else {
            angle_rad.serialize(serializer)
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        let for_people = deserializer.is_human_readable();
        let angle = f64::deserialize(deserializer)?;
        Ok(if for_people { angle.to_radians() } else { angle })
    }
}

/// Motion relative to the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirState {
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Angle of attack, rad, in (-pi, pi].
    pub alpha_rad: f64,
    /// Sideslip, rad, in [-pi/2, pi/2].
    pub beta_rad: f64,
    /// Body rates relative to the air (not to inertial space), rad/s: it turns with the Earth and with the gust.
    pub rates: Body,
}

/// Coefficients of force (lift, drag along the velocity in the plane of symmetry; side force along y) and of
/// moment (body axes).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    pub lift: f64,
    pub drag: f64,
    /// Side force C_Y, along body y.
    pub side: f64,
    /// Roll moment, reference length span.
    pub roll: f64,
    /// Pitch moment, reference length chord.
    pub pitch: f64,
    /// Yaw moment, reference length span.
    pub yaw: f64,
}

impl AirState {
    /// From the velocity relative to the air (m/s, body axes) and the rates relative to it.
    ///
    /// Without any velocity both angles are zero.
    #[inline]
    pub fn new(velocity: &Body, rates: Body) -> Self {
        let (u, v, w) = (velocity.0.x, velocity.0.y, velocity.0.z);
        let in_plane = (u * u + w * w).sqrt();
        // The sideslip is asin(v / V), by a length that the forces need too.
        let (alpha_rad, beta_rad) = (atan2(w, u), atan2(v, in_plane));
        Self { airspeed_m_s: (u * u + v * v + w * w).sqrt(), alpha_rad, beta_rad, rates }
    }
}

/// The linear angle, bent at its end: s(x) = x up to `linear`, then a tanh towards `max`; odd, once
/// differentiable. 15 and 25 degrees for `tvc_jet` (docs/parameter-set.md, section 2).
#[inline]
pub fn bent(angle: f64, linear: f64, max: f64) -> f64 {
    let size = angle.abs();
    if size <= linear {
        angle
    } else {
        let span = max - linear;
        libm::copysign(linear + span * libm::tanh((size - linear) / span), angle)
    }
}

/// Square of the sine of how far the angle is beyond its linear range: what stall adds to the drag.
#[inline]
fn stalled(angle: f64, linear: f64) -> f64 {
    if angle.abs() <= linear {
        0.0
    } else {
        let sine = libm::sin(angle.abs() - linear);
        sine * sine
    }
}

/// Coefficients at `air` with these effective deflections, rad; those of effectors other than surfaces are ignored.
///
/// The moments are those of Eq. (7) and Eq. (8), the forces those listed next to them in the parameter
/// set. Total: finite input gives finite coefficients, also at rest.
#[inline]
pub fn coefficients(
    aero: &Aero,
    surfaces: &Surfaces,
    air: &AirState,
    deflections: &PerEffector<f64>,
) -> Coefficients {
    let a = aero;
    let per_two_v = 0.5 / air.airspeed_m_s.max(SLOWEST_M_S);
    let p = air.rates.0.x * a.span_m * per_two_v;
    let q = air.rates.0.y * a.chord_m * per_two_v;
    let r = air.rates.0.z * a.span_m * per_two_v;
    let alpha = bent(air.alpha_rad, a.alpha_linear_rad, a.alpha_max_rad);
    let beta = bent(air.beta_rad, a.beta_linear_rad, a.beta_max_rad);

    let lift = a.c_lift_zero + a.c_lift_alpha * alpha + a.c_lift_q * q;
    let stall =
        stalled(air.alpha_rad, a.alpha_linear_rad) + stalled(air.beta_rad, a.beta_linear_rad);

    let clean = Coefficients {
        lift,
        drag: a.c_drag_zero
            + a.c_drag_induced * lift * lift
            + a.c_drag_beta * beta * beta
            + a.c_drag_stall * stall,
        side: a.c_side_beta * beta + (a.c_side_p * p + a.c_side_r * r),
        roll: a.c_roll_beta * beta + (a.c_roll_p * p + a.c_roll_r * r),
        pitch: a.c_pitch_zero + a.c_pitch_alpha * alpha + a.c_pitch_q * q,
        yaw: a.c_yaw_beta * beta + (a.c_yaw_p * p + a.c_yaw_r * r),
    };
    surfaces.added_to(clean, deflections)
}

/// Aerodynamic force and moment about the centre of gravity.
///
/// `velocity` is that relative to the air (m/s, body axes) and belongs to `air`; `density` in kg/m³.
#[inline]
pub fn wrench(
    geometry: &Geometry,
    air: &AirState,
    velocity: &Body,
    density: f64,
    c: &Coefficients,
) -> Wrench {
    let (u, w) = (velocity.0.x, velocity.0.z);
    let in_plane = (u * u + w * w).sqrt();
    let (cos_alpha, sin_alpha) =
        if in_plane > 0.0 { (u / in_plane, w / in_plane) } else { (1.0, 0.0) };
    let pressure_area = 0.5 * density * air.airspeed_m_s * air.airspeed_m_s * geometry.area_m2;
    Wrench {
        force: Body::new(
            pressure_area * (c.lift * sin_alpha - c.drag * cos_alpha),
            pressure_area * c.side,
            -pressure_area * (c.drag * sin_alpha + c.lift * cos_alpha),
        ),
        moment: Body::new(
            pressure_area * geometry.span_m * c.roll,
            pressure_area * geometry.chord_m * c.pitch,
            pressure_area * geometry.span_m * c.yaw,
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Airframe;
    use icd::{Effector, tvc_jet};
    use proptest::prelude::*;

    fn aero() -> Aero {
        Airframe::paper().aero.derivatives().unwrap().clone()
    }

    fn geometry() -> Geometry {
        Airframe::paper().aero.geometry()
    }

    fn coefficients(air: &AirState, deflections: &PerEffector<f64>) -> Coefficients {
        let Airframe { effectors, surface_derivatives, .. } = Airframe::paper();
        let surfaces = Surfaces::new(&effectors, &surface_derivatives);
        super::coefficients(&aero(), &surfaces, air, deflections)
    }

    fn level() -> AirState {
        AirState { airspeed_m_s: 264.0, alpha_rad: 0.035, beta_rad: 0.0, rates: Body::zero() }
    }

    /// Change of the coefficients from one degree of one effector.
    fn effect(effector: Effector) -> Coefficients {
        let clean = coefficients(&level(), &PerEffector::default());
        let mut deflections = PerEffector::default();
        deflections[effector] = 1.0_f64.to_radians();
        let c = coefficients(&level(), &deflections);
        Coefficients {
            lift: c.lift - clean.lift,
            drag: c.drag - clean.drag,
            side: c.side - clean.side,
            roll: c.roll - clean.roll,
            pitch: c.pitch - clean.pitch,
            yaw: c.yaw - clean.yaw,
        }
    }

    #[test]
    fn signs_of_the_surfaces_are_those_of_the_interface_document() {
        // (effector, roll, pitch, yaw): the table at the top of icd.
        let table = [
            (tvc_jet::LEFT_AILERON, 1.0, 0.0, 1.0),
            (tvc_jet::RIGHT_AILERON, -1.0, 0.0, -1.0),
            (tvc_jet::LEFT_ELEVATOR, 1.0, -1.0, 1.0),
            (tvc_jet::RIGHT_ELEVATOR, -1.0, -1.0, -1.0),
            (tvc_jet::RUDDER, 1.0, 0.0, -1.0),
        ];
        for (effector, roll, pitch, yaw) in table {
            let c = effect(effector);
            for (axis, ours, sign) in
                [("roll", c.roll, roll), ("pitch", c.pitch, pitch), ("yaw", c.yaw, yaw)]
            {
                let agrees = if sign == 0.0 { ours == 0.0 } else { ours * sign > 1e-6 };
                assert!(agrees, "{effector:?}: {axis} coefficient changed by {ours}");
            }
        }
        assert!(effect(tvc_jet::RUDDER).side > 0.0, "rudder: +Y force");
    }

    #[test]
    fn nozzle_and_engine_are_not_aerodynamic() {
        for effector in [tvc_jet::NOZZLE_PITCH, tvc_jet::NOZZLE_YAW, tvc_jet::ENGINE] {
            let c = effect(effector);
            assert_eq!([c.lift, c.drag, c.side, c.roll, c.pitch, c.yaw], [0.0; 6], "{effector:?}");
        }
    }

    proptest! {
        #[test]
        fn a_mirrored_flight_has_mirrored_coefficients_to_the_bit(
            alpha_rad in -1.0..1.0, beta_rad in -1.0..1.0, airspeed_m_s in 0.0..400.0,
            rates in proptest::array::uniform3(-3.0..3.0),
            d in proptest::array::uniform8(-0.5..0.5),
        ) {
            let [p, q, r]: [f64; 3] = rates;
            let air = AirState { airspeed_m_s, alpha_rad, beta_rad, rates: Body::new(p, q, r) };
            let other =
                AirState { airspeed_m_s, alpha_rad, beta_rad: -beta_rad, rates: Body::new(-p, q, -r) };
            let list = tvc_jet::effectors();
            let deflections = PerEffector::<f64>::from_values(d);
            let mut mirrored = PerEffector::<f64>::from_fn(|e| deflections[list.mirrored(e)]);
            mirrored[tvc_jet::RUDDER] = -deflections[tvc_jet::RUDDER];
            let c = coefficients(&air, &deflections);
            let m = coefficients(&other, &mirrored);
            prop_assert_eq!(
                [c.lift, c.drag, -c.side, -c.roll, c.pitch, -c.yaw],
                [m.lift, m.drag, m.side, m.roll, m.pitch, m.yaw]
            );
        }

        #[test]
        fn force_and_moment_are_finite_at_any_attitude_and_speed(
            u in -400.0..400.0, v in -400.0..400.0, w in -400.0..400.0,
        ) {
            let velocity = Body::new(u, v, w);
            let air = AirState::new(&velocity, Body::new(1.0, -1.0, 1.0));
            let c = coefficients(&air, &PerEffector::default());
            let wrench = wrench(&geometry(), &air, &velocity, 1.2, &c);
            prop_assert!(wrench.force.0.iter().chain(wrench.moment.0.iter()).all(|x| x.is_finite()));
        }
    }

    #[test]
    fn at_rest_in_the_air_nothing_acts_and_nothing_divides_by_zero() {
        let velocity = Body::zero();
        let air = AirState::new(&velocity, Body::new(0.1, 0.2, 0.3));
        let c = coefficients(&air, &PerEffector::default());
        let wrench = wrench(&geometry(), &air, &velocity, 1.2, &c);
        assert_eq!(wrench.force.0.norm() + wrench.moment.0.norm(), 0.0);
    }

    #[test]
    fn the_bent_angle_is_smooth_at_its_knee_and_ends_at_its_maximum() {
        let (linear, max) = (0.26, 0.43);
        let slope = (bent(linear + 1e-6, linear, max) - linear) / 1e-6;
        // tanh' = 1 at zero, curvature zero: 1e-6 rad beyond the knee the slope is one to 1e-9.
        assert!((slope - 1.0).abs() < 1e-9, "slope {slope}");
        assert!((bent(3.0, linear, max) - max).abs() < 1e-9);
        assert_eq!(bent(-1.0, linear, max), -bent(1.0, linear, max));
    }

    #[test]
    fn lift_points_up_and_drag_backwards() {
        let velocity = Body::new(264.0, 0.0, 9.0);
        let air = AirState::new(&velocity, Body::zero());
        let c = coefficients(&air, &PerEffector::default());
        let wrench = wrench(&geometry(), &air, &velocity, 0.736, &c);
        assert!(wrench.force.0.z < 0.0, "z force {} N", wrench.force.0.z);
        assert!(wrench.force.0.dot(&velocity.0) < 0.0, "drag must take power");
    }
}
