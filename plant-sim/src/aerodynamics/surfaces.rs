//! Coefficients of deflected surfaces: derivatives of each, summed left and right together.

use arrayvec::ArrayVec;
use icd::{Effector, EffectorKind, EffectorList, PerEffector};
use serde::{Deserialize, Serialize};

use super::Coefficients;

/// Derivatives of one effector, 1/rad, and of its drag 1/rad²; zeros if it is not an aerodynamic surface.
///
/// The letter of the kind follows the letters of a derivative (docs/parameter-set.md), as in `Cmde` of an elevator.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SurfaceDerivatives {
    /// CLd, lift.
    pub c_lift: f64,
    /// CDd, drag of the squared deflection.
    pub c_drag: f64,
    /// CYd, side force.
    pub c_side: f64,
    /// Cld, roll.
    pub c_roll: f64,
    /// Cmd, pitch.
    pub c_pitch: f64,
    /// Cnd, yaw, in addition to that by the roll.
    pub c_yaw: f64,
    /// rCnd, yaw for the roll.
    pub yaw_per_roll: f64,
}

/// One field of [`SurfaceDerivatives`].
pub struct SurfaceField {
    /// Letters (docs/parameter-set.md), without that of the kind.
    pub letters: &'static str,
    /// Key in the airframe file.
    pub key: &'static str,
    /// Whether it must not be negative: it would feed energy to the aircraft.
    pub is_drag: bool,
    /// The field.
    pub field: fn(&mut SurfaceDerivatives) -> &mut f64,
}

macro_rules! field {
    ($letters:literal, $field:ident, $is_drag:expr) => {
        SurfaceField {
            letters: $letters,
            key: stringify!($field),
            is_drag: $is_drag,
            field: |derivatives| &mut derivatives.$field,
        }
    };
}

impl SurfaceDerivatives {
    /// All fields.
    pub const FIELDS: [SurfaceField; 7] = [
        field!("CLd", c_lift, false),
        field!("CDd", c_drag, true),
        field!("CYd", c_side, false),
        field!("Cld", c_roll, false),
        field!("Cmd", c_pitch, false),
        field!("Cnd", c_yaw, false),
        field!("rCnd", yaw_per_roll, false),
    ];

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
    pub(super) fn added_to(
        &self,
        clean: Coefficients,
        deflections: &PerEffector<f64>,
    ) -> Coefficients {
        let mut drag = clean.drag;
        // Minus zero is the neutral element of addition, to the bit.
        let mut sum = [-0.0; 5];
        for pair in &self.pairs {
            let (left, right) = (deflections[pair.left], deflections[pair.right]);
            let mut all = [0.0; 5];
            for (all, (together, against)) in
                all.iter_mut().zip(pair.together.iter().zip(&pair.against))
            {
                *all = together * (left + right) + against * (left - right);
            }
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
            if derivatives[left].yaw_per_roll != derivatives[right].yaw_per_roll {
                of.c_yaw += of.yaw_per_roll * of.c_roll;
                of.yaw_per_roll = 0.0;
            }
            of
        };
        let (ours, theirs) = (of(left), of(right));
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
