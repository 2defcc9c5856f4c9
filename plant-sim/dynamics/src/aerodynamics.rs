//! Motion through the air and effective deflections to force and moment, body axes.
//!
//! Here are the derivatives of the aircraft without its surfaces and what the surfaces add, in [`forms`] the choice between
//! derivatives and tables. Every sum keeps left and right together, so that a mirrored flight gets mirrored bits.

use core::f64::consts::FRAC_PI_4;

use arrayvec::ArrayVec;
use icd::frames::atan2;
use icd::{Body, Effector, EffectorKind, EffectorList, PerEffector};
use serde::{Deserialize, Serialize};

use crate::rigid_body::Wrench;

pub mod forms;

pub use forms::{Aerodynamics, AirForces, Geometry};

/// Airspeed below which the rate terms of the coefficients grow no further, m/s: it only prevents a division by
/// zero.
pub const SLOWEST_M_S: f64 = 0.1;

/// A derivative in a set of them.
pub struct Derivative<T: 'static> {
    /// Letters (docs/paper.md), as in `Cma`; of surfaces without that of the kind.
    pub letters: &'static str,
    /// Key in the airframe file. That of a drag term begins with `c_drag`.
    pub key: &'static str,
    pub field: fn(&mut T) -> &mut f64,
}

/// A set of derivatives: the struct, and the list of those of its fields that have letters.
macro_rules! derivatives {
    ($(#[$meta:meta])* $type:ident {
        $($(#[$other_meta:meta])* $other:ident,)*
    } with letters {
        $($(#[$doc:meta])* $field:ident: $letters:literal,)+
    }) => {
        $(#[$meta])*
        pub struct $type {
            $($(#[$other_meta])* pub $other: f64,)*
            $($(#[$doc])* pub $field: f64,)+
        }

        impl $type {
            /// All with letters.
            pub const DERIVATIVES: [Derivative<Self>; [$($letters),+].len()] = [$(Derivative {
                letters: $letters,
                key: stringify!($field),
                field: |set| &mut set.$field,
            }),+];
        }
    };
}

derivatives! {
    /// Aerodynamic derivatives of the aircraft without its surfaces, and reference geometry. Derivatives are per radian, of rates per
    /// `rate length / 2V`; [`crate::derivatives`] finds them by the letters of the paper's parameter set.
    ///
    /// Read from the `[aerodynamics]` table of the airframe file, key by key.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    Aero {
        /// Reference area S, m².
        area_m2,
        /// Span b, m.
        span_m,
        /// Mean chord c, m.
        chord_m,
        /// Angle of attack up to which the coefficients are linear, rad.
        #[serde(rename = "alpha_linear_deg", with = "degrees")]
        alpha_linear_rad,
        /// Limit of the effective angle of attack beyond that, rad.
        #[serde(rename = "alpha_max_deg", with = "degrees")]
        alpha_max_rad,
        /// Sideslip up to which the coefficients are linear, rad.
        #[serde(rename = "beta_linear_deg", with = "degrees")]
        beta_linear_rad,
        /// Limit of the effective sideslip beyond that, rad.
        #[serde(rename = "beta_max_deg", with = "degrees")]
        beta_max_rad,
    } with letters {
        /// Lift at zero angle of attack.
        c_lift_zero: "CL0",
        /// Lift, 1/rad.
        c_lift_alpha: "CLa",
        /// Lift of the pitch rate.
        c_lift_q: "CLq",
        /// Drag without lift.
        c_drag_zero: "CD0",
        /// Drag for the square of the lift without the elevators.
        c_drag_induced: "kCD",
        /// Drag of the angle of attack, 1/rad: the linear term of a polar over it.
        #[serde(default)]
        c_drag_alpha: "CDa",
        /// Drag for the lift without the surfaces: the linear term of a polar over it.
        #[serde(default)]
        c_drag_lift: "CDL",
        /// Drag of the squared sideslip, 1/rad².
        c_drag_beta: "CDb",
        /// Flat-plate drag beyond the linear range.
        c_drag_stall: "CDst",
        /// Side force of the sideslip, 1/rad.
        c_side_beta: "CYb",
        /// Side force of the roll rate.
        c_side_p: "CYp",
        /// Side force of the yaw rate.
        c_side_r: "CYr",
        /// Roll of the sideslip (dihedral), 1/rad.
        c_roll_beta: "Clb",
        /// Roll damping.
        c_roll_p: "Clp",
        /// Roll of the yaw rate.
        c_roll_r: "Clr",
        /// Pitch at zero angle of attack.
        c_pitch_zero: "Cm0",
        /// Pitch stiffness, 1/rad: negative is stable.
        c_pitch_alpha: "Cma",
        /// Pitch damping.
        c_pitch_q: "Cmq",
        /// Yaw stiffness, 1/rad: positive is stable.
        c_yaw_beta: "Cnb",
        /// Yaw of the roll rate.
        c_yaw_p: "Cnp",
        /// Yaw damping.
        c_yaw_r: "Cnr",
    }
}

derivatives! {
    /// Derivatives of one effector, 1/rad, and of its drag 1/rad²; zeros if it is not an aerodynamic surface.
    ///
    /// The letter of the kind follows the letters of a derivative (docs/paper.md), as in `Cmde` of an elevator.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
    SurfaceDerivatives {} with letters {
        /// Lift.
        c_lift: "CLd",
        /// Drag of the squared deflection.
        c_drag: "CDd",
        /// Side force.
        c_side: "CYd",
        /// Roll.
        c_roll: "Cld",
        /// Pitch.
        c_pitch: "Cmd",
        /// Yaw, in addition to that by the roll.
        c_yaw: "Cnd",
        /// Yaw for the roll.
        yaw_per_roll: "rCnd",
    }
}

impl Aero {
    /// Keys of the drag terms that may be negative.
    pub(crate) const LINEAR_DRAG: [&str; 2] = ["c_drag_alpha", "c_drag_lift"];

    /// Drag without sideslip and stall, at a linear angle of attack (rad) and its lift. A published line is for positive angles; where it
    /// would push the aircraft, the drag is zero.
    #[inline]
    pub(crate) fn polar(&self, alpha_rad: f64, lift: f64) -> f64 {
        let drag = self.c_drag_zero
            + self.c_drag_induced * lift * lift
            + (self.c_drag_alpha * alpha_rad + self.c_drag_lift * lift);
        drag.max(0.0)
    }
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
/// differentiable. 15 and 25 degrees for `tvc_jet` (docs/paper.md, "The parameter set").
#[inline]
pub fn bent(angle: f64, linear: f64, max: f64) -> f64 {
    let size = angle.abs();
    if size <= linear {
        angle
    } else {
        // A tanh leaves with slope one, so no coefficient has a kink where its linear range ends.
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
        // The sine starts at zero, so the drag has no step where the linear range ends.
        let sine = libm::sin(angle.abs() - linear);
        sine * sine
    }
}

/// What is left of forces and moments in the plane of symmetry: first of all of them, nothing where the flow comes from the side, then of
/// those of the angle of attack, nothing where it comes from straight behind. Exactly one up to 45 deg of sideslip and 135 deg of angle
/// of attack. Without it an aircraft that stands in such a wind is shaken by an angle of attack that jumps.
#[inline]
fn fades(air: &AirState) -> [f64; 2] {
    let left = |angle: f64, begin: f64| {
        if angle.abs() <= begin {
            return 1.0;
        }
        let sine = libm::sin(2.0 * angle);
        sine * sine
    };
    [left(air.beta_rad, FRAC_PI_4), left(air.alpha_rad, 3.0 * FRAC_PI_4)]
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
    let [across, behind] = fades(air);
    let alpha = behind * bent(air.alpha_rad, a.alpha_linear_rad, a.alpha_max_rad);
    let beta = bent(air.beta_rad, a.beta_linear_rad, a.beta_max_rad);

    let lift = across * (a.c_lift_zero + a.c_lift_alpha * alpha) + a.c_lift_q * q;
    let stall =
        stalled(air.alpha_rad, a.alpha_linear_rad) + stalled(air.beta_rad, a.beta_linear_rad);

    // The order of these sums is part of the bits of every recorded flight.
    let clean = Coefficients {
        lift,
        drag: a.polar(alpha, lift) + a.c_drag_beta * beta * beta + a.c_drag_stall * stall,
        side: a.c_side_beta * beta + (a.c_side_p * p + a.c_side_r * r),
        roll: a.c_roll_beta * beta + (a.c_roll_p * p + a.c_roll_r * r),
        pitch: across * (a.c_pitch_zero + a.c_pitch_alpha * alpha) + a.c_pitch_q * q,
        yaw: a.c_yaw_beta * beta + (a.c_yaw_p * p + a.c_yaw_r * r),
    };
    let c = surfaces.added_to(clean, deflections);
    Coefficients { drag: across * c.drag, ..c }
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
    // The quotients are sine and cosine of the angle of `AirState` without trigonometry. Without
    // flow in the plane of symmetry `atan2` gives zero, hence (1, 0).
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

impl SurfaceDerivatives {
    /// Linear ones: lift, side, roll, pitch, yaw.
    fn linear(&self) -> [f64; 5] {
        [self.c_lift, self.c_side, self.c_roll, self.c_pitch, self.c_yaw]
    }
}

/// Indices of roll and yaw among the linear derivatives.
const ROLL: usize = 2;
const YAW: usize = 4;

/// A left and a right surface: their common and their differential effect.
#[derive(Debug, Clone, Copy)]
struct Pair {
    left: Effector,
    right: Effector,
    /// Of the sum of the deflections.
    together: [f64; 5],
    /// Of left minus right.
    against: [f64; 5],
    /// Of each squared deflection.
    drag: [f64; 2],
    yaw_per_roll: f64,
}

/// A surface without partner.
#[derive(Debug, Clone, Copy)]
struct Single {
    surface: Effector,
    linear: [f64; 5],
    drag: f64,
    yaw_per_roll: f64,
}

/// The surfaces of an aircraft, ready to be evaluated.
#[derive(Debug, Clone)]
pub struct Surfaces {
    pairs: ArrayVec<Pair, { Effector::MAX / 2 }>,
    singles: ArrayVec<Single, { Effector::MAX }>,
}

impl Surfaces {
    /// For effectors with these derivatives.
    pub fn new(list: &EffectorList, derivatives: &PerEffector<SurfaceDerivatives>) -> Self {
        // Nozzles have deflections too, but they act through the jet.
        let is_surface = |e: &Effector| list.kind(*e).is_some_and(EffectorKind::is_surface);
        // From the last pair to the first: drag adds up in this order.
        let mut pairs: ArrayVec<Pair, _> = list
            .pairs()
            .filter(|[left, _]| is_surface(left))
            .map(|[left, right]| Pair::new([left, right], derivatives))
            .collect();
        pairs.reverse();
        let single = |surface| {
            let of = &derivatives[surface];
            let (linear, drag, yaw_per_roll) = (of.linear(), of.c_drag, of.yaw_per_roll);
            Single { surface, linear, drag, yaw_per_roll }
        };
        Self { pairs, singles: list.singles().filter(is_surface).map(single).collect() }
    }

    /// The coefficients with the contribution of the surfaces at these deflections, rad.
    #[inline]
    fn added_to(&self, clean: Coefficients, deflections: &PerEffector<f64>) -> Coefficients {
        let mut drag = clean.drag;
        // Minus zero is the neutral element of addition, to the bit.
        let mut sum = [-0.0; 5];
        for pair in &self.pairs {
            let (left, right) = (deflections[pair.left], deflections[pair.right]);
            let mut all = [0.0; 5];
            for (all, (together, against)) in
                all.iter_mut().zip(pair.together.iter().zip(&pair.against))
            {
                // A mirrored flight swaps left and right: the sum keeps its bits, the difference
                // changes only its sign.
                *all = together * (left + right) + against * (left - right);
            }
            // After the sum over both sides: the file gives this yaw as a ratio to the roll of the
            // pair.
            all[YAW] += pair.yaw_per_roll * all[ROLL];
            for (sum, part) in sum.iter_mut().zip(all) {
                *sum += part;
            }
            // Usually both have equal derivatives, and then mirrored deflections have the same drag to the bit.
            drag += if pair.drag[0] == pair.drag[1] {
                pair.drag[0] * (left * left + right * right)
            } else {
                pair.drag[0] * left * left + pair.drag[1] * right * right
            };
        }
        let Coefficients { lift, side, roll, pitch, yaw, .. } = clean;
        let mut total = [lift, side, roll, pitch, yaw];
        for (total, part) in total.iter_mut().zip(sum) {
            *total += part;
        }
        for single in &self.singles {
            let deflection = deflections[single.surface];
            let mut all = single.linear.map(|derivative| derivative * deflection);
            all[YAW] += single.yaw_per_roll * all[ROLL];
            for (total, part) in total.iter_mut().zip(all) {
                *total += part;
            }
            drag += single.drag * deflection * deflection;
        }
        let [lift, side, roll, pitch, yaw] = total;
        Coefficients { lift, drag, side, roll, pitch, yaw }
    }
}

impl Pair {
    fn new([left, right]: [Effector; 2], derivatives: &PerEffector<SurfaceDerivatives>) -> Self {
        let of = |effector: Effector| {
            let mut of = derivatives[effector];
            // The pair has one ratio. If its surfaces differ, the yaw of each becomes part of its
            // own derivative.
            if derivatives[left].yaw_per_roll != derivatives[right].yaw_per_roll {
                of.c_yaw += of.yaw_per_roll * of.c_roll;
                of.yaw_per_roll = 0.0;
            }
            of
        };
        let (ours, theirs) = (of(left), of(right));
        // a left + b right = (a + b)/2 (left + right) + (a - b)/2 (left - right).
        let both = |mix: fn(f64, f64) -> f64| {
            let (a, b) = (ours.linear(), theirs.linear());
            std::array::from_fn(|i| 0.5 * mix(a[i], b[i]))
        };
        Self {
            left,
            right,
            together: both(|a, b| a + b),
            against: both(|a, b| a - b),
            drag: [ours.c_drag, theirs.c_drag],
            yaw_per_roll: ours.yaw_per_roll,
        }
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
    fn a_flow_from_the_side_or_from_behind_has_no_jump_where_its_angle_of_attack_jumps() {
        let aerosonde = Airframe::from_toml("aerosonde", aircraft::AEROSONDE_AIRFRAME).unwrap();
        for airframe in [Airframe::paper(), aerosonde] {
            let forces = AirForces::new(&airframe).unwrap();
            for (u, v) in [(0.0, 10.0), (0.0, -10.0), (-10.0, 0.0), (-7.0, 7.0)] {
                let [up, down] = [1.0e-3, -1.0e-3].map(|w| {
                    let velocity = Body::new(u, v, w);
                    let air = AirState::new(&velocity, Body::zero());
                    forces.wrench(&air, &velocity, 1.2, 0.0, &PerEffector::default())
                });
                let jumps = [up.force.0 - down.force.0, up.moment.0 - down.moment.0];
                let area_m2 = airframe.aero.geometry().area_m2;
                assert!(
                    jumps.iter().all(|jump| jump.norm() < 0.1 * area_m2),
                    "{u} and {v}: {jumps:?}"
                );
            }
        }
        let at = |u: f64, v: f64, w: f64| {
            let air = AirState::new(&Body::new(u, v, w), Body::zero());
            (air, coefficients(&air, &PerEffector::default()))
        };
        // Where the aircraft flies they are those of the angle.
        for [one, other] in
            [[(10.0, 0.0, 1.0), (10.0, 9.0, 1.0)], [(0.0, 0.0, 10.0), (-5.0, 0.0, 10.0)]]
        {
            let [one, other] = [one, other].map(|(u, v, w)| at(u, v, w).1);
            let changes = [one.lift - other.lift, one.pitch - other.pitch];
            assert!(changes.iter().all(|change| change.abs() < 1.0e-6), "{changes:?}");
        }
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

#[cfg(test)]
mod surfaces_tests {
    use super::*;
    use icd::tvc_jet;

    const CLEAN: Coefficients =
        Coefficients { lift: 0.0, drag: 0.0, side: 0.0, roll: 0.0, pitch: 0.0, yaw: 0.0 };

    #[test]
    fn a_pair_that_is_not_mirrored_acts_as_its_two_surfaces() {
        let mut derivatives = PerEffector::default();
        derivatives[tvc_jet::LEFT_ELEVATOR] = SurfaceDerivatives {
            c_lift: 0.1,
            c_drag: 0.2,
            c_side: 0.3,
            c_roll: 0.4,
            c_pitch: 0.5,
            c_yaw: 0.6,
            yaw_per_roll: 0.5,
        };
        derivatives[tvc_jet::RIGHT_ELEVATOR] =
            SurfaceDerivatives { c_roll: -0.7, c_drag: 1.0, ..SurfaceDerivatives::default() };
        let surfaces = Surfaces::new(&tvc_jet::effectors(), &derivatives);
        let mut at = PerEffector::default();
        (at[tvc_jet::LEFT_ELEVATOR], at[tvc_jet::RIGHT_ELEVATOR]) = (0.5, 0.25);
        let c = surfaces.added_to(CLEAN, &at);
        let expected = [0.05, 0.05 + 0.0625, 0.15, 0.2 - 0.175, 0.25, 0.3 + 0.1];
        for (ours, expected) in
            [c.lift, c.drag, c.side, c.roll, c.pitch, c.yaw].into_iter().zip(expected)
        {
            assert!((ours - expected).abs() < 1.0e-15, "{c:?}");
        }
    }
}
