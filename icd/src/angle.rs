//! Sine, cosine and their inverses for angles that are usually small: what attitude and flow are made of.
//!
//! An aircraft in flight has small angles of attack, sideslip and nozzle, and small changes of anything
//! between two ticks. For those one polynomial is enough, without a table and without a reduction of the
//! argument; written where the compiler can put it into the caller's arithmetic, it takes a third of the
//! time of a call. Everything else goes to `libm`.
//!
//! Polynomials and limits are those of `libm` (FreeBSD msun, copyright 1993 Sun Microsystems, freely
//! granted), so the results have the same bits as those of `libm`, at every argument.

/// Up to this |x| the sine and cosine need no reduction: a little below π/4.
const UNREDUCED_RAD: f64 = 0.785;
/// Up to this |tan x| the arc tangent needs no reduction: 7/16.
const UNREDUCED_TANGENT: f64 = 0.4375;
/// Up to this |sin x| the arc sine needs no reduction.
const UNREDUCED_SINE: f64 = 0.5;

/// Sine and cosine of an angle in rad.
#[inline]
#[must_use]
pub fn sincos(x: f64) -> (f64, f64) {
    if x.abs() <= UNREDUCED_RAD { (small_sin(x), small_cos(x)) } else { libm::sincos(x) }
}

/// [`sincos`] of two angles at once: the compiler can then compute both side by side.
#[inline]
#[must_use]
pub fn sincos_pair(x: [f64; 2]) -> [(f64, f64); 2] {
    if x[0].abs() <= UNREDUCED_RAD && x[1].abs() <= UNREDUCED_RAD {
        let (sin, cos) = (x.map(small_sin), x.map(small_cos));
        [(sin[0], cos[0]), (sin[1], cos[1])]
    } else {
        x.map(libm::sincos)
    }
}

/// [`atan2`] of two points at once.
#[inline]
#[must_use]
pub fn atan2_pair(y: [f64; 2], x: [f64; 2]) -> [f64; 2] {
    let t = [(y[0] / x[0]).abs(), (y[1] / x[1]).abs()];
    if x[0] > 0.0 && x[1] > 0.0 && t[0] < UNREDUCED_TANGENT && t[1] < UNREDUCED_TANGENT {
        let angle = t.map(small_atan);
        [libm::copysign(angle[0], y[0]), libm::copysign(angle[1], y[1])]
    } else {
        [libm::atan2(y[0], x[0]), libm::atan2(y[1], x[1])]
    }
}

/// Angle of the point (x, y), rad, in [-π, π].
#[inline]
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    let tangent = (y / x).abs();
    if x > 0.0 && tangent < UNREDUCED_TANGENT {
        libm::copysign(small_atan(tangent), y)
    } else {
        libm::atan2(y, x)
    }
}

/// Angle whose sine is `x`, rad, in [-π/2, π/2].
#[inline]
#[must_use]
pub fn asin(x: f64) -> f64 {
    if x.abs() < UNREDUCED_SINE { small_asin(x) } else { libm::asin(x) }
}

#[inline]
fn small_sin(x: f64) -> f64 {
    let z = x * x;
    let w = z * z;
    let r = 8.333_333_333_322_49e-3
        + z * (-1.984_126_982_985_795e-4 + z * 2.755_731_370_707_006_8e-6)
        + z * w * (-2.505_076_025_340_686_3e-8 + z * 1.589_690_995_211_55e-10);
    let v = z * x;
    // The sum would make a zero of -0.
    libm::copysign(x + v * (-1.666_666_666_666_663_2e-1 + z * r), x)
}

#[inline]
fn small_cos(x: f64) -> f64 {
    let z = x * x;
    let w = z * z;
    let r = z
        * (4.166_666_666_666_66e-2
            + z * (-1.388_888_888_887_411e-3 + z * 2.480_158_728_947_673e-5))
        + w * w
            * (-2.755_731_435_139_066_3e-7
                + z * (2.087_572_321_298_175e-9 + z * -1.135_964_755_778_819_5e-11));
    let half = 0.5 * z;
    let w = 1.0 - half;
    w + (((1.0 - w) - half) + z * r)
}

#[inline]
fn small_atan(x: f64) -> f64 {
    let z = x * x;
    let w = z * z;
    let odd = z
        * (3.333_333_333_333_293e-1
            + w * (1.428_571_427_250_346_6e-1
                + w * (9.090_887_133_436_507e-2
                    + w * (6.661_073_137_387_531e-2
                        + w * (4.976_877_994_615_932_4e-2 + w * 1.628_582_011_536_578_2e-2)))));
    let even = w
        * (-1.999_999_999_987_648_3e-1
            + w * (-1.111_111_040_546_235_6e-1
                + w * (-7.691_876_205_044_83e-2
                    + w * (-5.833_570_133_790_573_5e-2 + w * -3.653_157_274_421_691_6e-2))));
    x - x * (odd + even)
}

#[inline]
fn small_asin(x: f64) -> f64 {
    let z = x * x;
    let p = z
        * (1.666_666_666_666_666_6e-1
            + z * (-3.255_658_186_224_009e-1
                + z * (2.012_125_321_348_629_3e-1
                    + z * (-4.005_553_450_067_941e-2
                        + z * (7.915_349_942_898_145e-4 + z * 3.479_331_075_960_212e-5)))));
    let q = 1.0
        + z * (-2.403_394_911_734_414
            + z * (2.020_945_760_233_505_7
                + z * (-6.882_839_716_054_533e-1 + z * 7.703_815_055_590_194e-2)));
    libm::copysign(x + x * (p / q), x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Zeros, limits and their neighbours, very small, very large and impossible numbers.
    const SPECIAL: [f64; 24] = [
        0.0,
        f64::MIN_POSITIVE,
        5e-324,
        1e-300,
        1e-160,
        1e-17,
        1.1e-8,
        2e-8,
        7.450_580_596_923_828e-9,
        0.437_499_999_999_999_9,
        0.4375,
        0.499_999_999_999_999_94,
        0.5,
        0.784_999_999_999_999_9,
        0.785,
        core::f64::consts::FRAC_PI_4,
        1.0,
        1.000_000_000_000_000_2,
        1.5,
        3.0,
        1e16,
        f64::MAX,
        f64::INFINITY,
        f64::NAN,
    ];

    fn same(ours: f64, libm: f64) -> bool {
        ours.to_bits() == libm.to_bits() || (ours.is_nan() && libm.is_nan())
    }

    fn check(x: f64) {
        let (ours, exact) = (sincos(x), libm::sincos(x));
        assert!(same(ours.0, exact.0) && same(ours.1, exact.1), "{x}: {ours:?}, {exact:?}");
        assert!(same(asin(x), libm::asin(x)), "{x}: {}, {}", asin(x), libm::asin(x));
    }

    fn check_atan2(y: f64, x: f64) {
        let (ours, exact) = (atan2(y, x), libm::atan2(y, x));
        assert!(same(ours, exact), "({x}, {y}): {ours}, {exact}");
    }

    #[test]
    fn val_special_arguments_give_the_bits_of_libm() {
        for (x, y) in SPECIAL.iter().flat_map(|x| SPECIAL.map(|y| (*x, y))) {
            for (x, y) in [(x, y), (x, -y), (-x, y), (-x, -y)] {
                check_atan2(y, x);
                check(x);
            }
        }
    }

    proptest! {
        #[test]
        fn val_any_argument_gives_the_bits_of_libm(
            x in -1.0..1.0_f64, y in -1.0..1.0_f64, scale in -30..30_i32, any: f64,
        ) {
            check(x);
            check(x * libm::exp2(f64::from(scale)));
            check(any);
            check_atan2(y, x);
            check_atan2(y * libm::exp2(f64::from(scale)), x);
            check_atan2(y, any);
        }
    }
}
