//! Aircraft that differ from the controller's model of it.
//!
//! A draw is a function of (seed, number): draw 731 is the same alone or among 1000.

use plant_sim::Airframe;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The aerodynamic derivatives that are dispersed, by their letters (docs/parameter-set.md).
pub const DERIVATIVES: [&str; 28] = [
    "CLa", "CLq", "CLde", "CD0", "kCD", "CDb", "CDde", "CDda", "CDdr", "CYb", "CYr", "CYdr", "Clb",
    "Clp", "Clr", "Clde", "Clda", "Cldr", "Cm0", "Cma", "Cmq", "Cmde", "Cnb", "Cnp", "Cnr",
    "rCnde", "rCnda", "Cndr",
];

/// A derivative that the airframe does not have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the airframe has no derivative {name}")]
pub struct UnknownDerivative {
    /// The name.
    pub name: String,
}

/// The aircraft with one derivative multiplied by `factor`.
///
/// # Errors
/// [`UnknownDerivative`] if it has none of that name.
pub fn single(nominal: &Airframe, name: &str, factor: f64) -> Result<Airframe, UnknownDerivative> {
    let mut airframe = nominal.clone();
    scale(&mut airframe, name, factor)?;
    Ok(airframe)
}

/// Draw number `draw`: every derivative multiplied by its own factor, uniform in 1 ± `half_width`.
///
/// Draws of the same number but another width have the same directions, so that curves over the width
/// compare like with like.
///
/// # Errors
/// [`UnknownDerivative`] if the airframe lacks one of [`DERIVATIVES`].
pub fn joint(
    nominal: &Airframe,
    half_width: f64,
    seed: u64,
    draw: u64,
) -> Result<Airframe, UnknownDerivative> {
    let mut key = *b"........--------two-step sitl--1";
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&draw.to_le_bytes());
    let mut generator = ChaCha8Rng::from_seed(key);
    let mut airframe = nominal.clone();
    for name in DERIVATIVES {
        let direction = 2.0 * uniform(&mut generator) - 1.0;
        scale(&mut airframe, name, 1.0 + half_width * direction)?;
    }
    Ok(airframe)
}

fn scale(airframe: &mut Airframe, name: &str, factor: f64) -> Result<(), UnknownDerivative> {
    if airframe.change_derivative(name, |value| *value *= factor) {
        Ok(())
    } else {
        Err(UnknownDerivative { name: name.to_owned() })
    }
}

/// Uniform in [0, 1) with 53 bits.
#[expect(clippy::cast_precision_loss, reason = "53 bits fit a f64 exactly")]
fn uniform(generator: &mut ChaCha8Rng) -> f64 {
    const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
    (generator.next_u64() >> 11) as f64 * STEP
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nominal() -> Airframe {
        Airframe::from_toml("tvc_jet.toml", plant_sim::airframe::DEFAULT_AIRFRAME).unwrap()
    }

    fn factors(airframe: &Airframe) -> Vec<f64> {
        let nominal = nominal();
        let factor =
            |name: &&str| airframe.derivative(name).unwrap() / nominal.derivative(name).unwrap();
        DERIVATIVES.iter().map(factor).collect()
    }

    #[test]
    fn a_single_dispersion_changes_one_derivative_and_nothing_else() {
        for (index, name) in DERIVATIVES.iter().enumerate() {
            let airframe = single(&nominal(), name, 1.1).unwrap();
            for (other, factor) in factors(&airframe).into_iter().enumerate() {
                let expected = if other == index { 1.1 } else { 1.0 };
                assert!((factor - expected).abs() < 1.0e-12, "{name}: {other} {factor}");
            }
        }
    }

    #[test]
    fn a_derivative_that_does_not_exist_is_refused_by_name() {
        let error = single(&nominal(), "Cxyz", 1.1).unwrap_err();
        assert_eq!(error.to_string(), "the airframe has no derivative Cxyz");
    }

    #[test]
    fn joint_draws_fill_the_interval_and_keep_their_direction_at_another_width() {
        let mut all = Vec::new();
        for draw in 0..100 {
            let narrow = factors(&joint(&nominal(), 0.05, 1, draw).unwrap());
            let wide = factors(&joint(&nominal(), 0.20, 1, draw).unwrap());
            for (narrow, wide) in narrow.iter().zip(&wide) {
                // Four times the width, to rounding.
                assert!(((wide - 1.0) - 4.0 * (narrow - 1.0)).abs() < 1.0e-12, "{narrow} {wide}");
            }
            all.extend(narrow);
        }
        let (low, high) = all.iter().fold((2.0_f64, 0.0_f64), |(l, h), f| (l.min(*f), h.max(*f)));
        // 2800 uniform draws leave less than 0.1 % of the interval empty at its ends.
        assert!((0.95..0.9502).contains(&low) && (1.0498..1.05).contains(&high), "{low} {high}");
        let mean = all.iter().sum::<f64>() / 2_800.0;
        // Standard error of the mean: 0.05 / sqrt(3 * 2800) = 0.00055; five of them.
        assert!((mean - 1.0).abs() < 0.0028, "{mean}");
    }

    #[test]
    fn a_draw_is_the_same_whenever_it_is_made_and_differs_with_seed_and_number() {
        let draw = |seed, draw| factors(&joint(&nominal(), 0.1, seed, draw).unwrap());
        assert_eq!(draw(3, 7), draw(3, 7));
        assert_ne!(draw(3, 7), draw(3, 8));
        assert_ne!(draw(3, 7), draw(4, 7));
    }
}
