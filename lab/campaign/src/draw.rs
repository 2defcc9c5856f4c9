//! Numbers of the distributed variables: each a function of seed, key and sample, and for a Latin hypercube of the number of
//! samples too. So a run of a specification is the same alone and with all the others.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use sha2::{Digest, Sha256};

use crate::spec::{Design, Normal};

/// Rounds of the network that shuffles strata.
const ROUNDS: u64 = 6;

/// A stream of random numbers of a campaign, by name.
///
/// ChaCha8 keyed by a hash of the seed and the name; its stream number is `index`.
pub fn stream(seed: u64, name: &str, index: u64) -> ChaCha8Rng {
    let mut hash = Sha256::new();
    // This text is part of every recorded campaign.
    hash.update(b"two-step campaign 1");
    hash.update(seed.to_le_bytes());
    hash.update(name.as_bytes());
    let mut generator = ChaCha8Rng::from_seed(hash.finalize().into());
    generator.set_stream(index);
    generator
}

/// Numbers between two limits for the manoeuvres of a flight, drawn by its seed.
pub fn manoeuvres(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    // And so is this one.
    let mut key = *b"seed------------two-step sitl--4";
    key[..8].copy_from_slice(&seed.to_le_bytes());
    let mut generator = ChaCha8Rng::from_seed(key);
    move |low, high| {
        let unit = f64::from(generator.next_u32()) / (f64::from(u32::MAX) + 1.0);
        low + (high - low) * unit
    }
}

/// Uniform in (0, 1): the middle of one of 2^53 equal parts.
// 53 bits fit a f64 exactly.
pub fn uniform(generator: &mut ChaCha8Rng) -> f64 {
    const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
    ((generator.next_u64() >> 11) as f64 + 0.5) * STEP
}

/// Probability in (0, 1) of sample `index` of `count` of the variable `key`, the `dimension`-th one of its campaign.
pub fn probability(
    design: Design,
    seed: u64,
    (key, dimension): (&str, u32),
    (index, count): (u32, u32),
) -> f64 {
    let within = || uniform(&mut stream(seed, key, u64::from(index)));
    match design {
        Design::Random => within(),
        Design::LatinHypercube => {
            let stratum = shuffled(seed, key, index, count);
            (f64::from(stratum) + within()) / f64::from(count)
        }
        Design::Sobol => {
            // Its first 256 dimensions are scrambled apart; beyond them the seed changes.
            let mut generator = stream(seed, "sobol", u64::from(dimension / 256));
            let point = sobol_burley::sample(index, dimension % 256, generator.next_u32());
            // Points have 24 bits; the middle of the part that each stands for is never 0 or 1.
            f64::from(point) + 0.5 / f64::from(1 << 24)
        }
    }
}

/// Where the permutation of `count` that belongs to seed and key puts `index`.
///
/// A Feistel network over the next larger even power of two, walked until it ends inside: it needs no memory.
fn shuffled(seed: u64, key: &str, index: u32, count: u32) -> u32 {
    let bits = count.next_power_of_two().trailing_zeros().max(2).div_ceil(2);
    let mask = (1_u32 << bits) - 1;
    let mut at = index;
    loop {
        let (mut left, mut right) = (at >> bits, at & mask);
        for round in 0..ROUNDS {
            let number = (round << 32) | u64::from(right);
            let mixed = left ^ (stream(seed, &format!("{key} strata"), number).next_u32() & mask);
            (left, right) = (right, mixed);
        }
        at = (left << bits) | right;
        // The walk ends: a permutation leads back to where it began, which is inside.
        if at < count {
            return at;
        }
    }
}

impl Normal {
    /// The value below which the distribution, within its limits, has this probability.
    pub fn quantile(&self, probability: f64) -> f64 {
        let Self { mean, deviation, min, max } = *self;
        let below = |limit: f64| 0.5 * libm::erfc(-(limit - mean) / deviation / 2.0_f64.sqrt());
        let [low, high] = [min.map_or(0.0, below), max.map_or(1.0, below)];
        // Sum and inverse may miss a limit by their last digits.
        let value = mean + deviation * standard_quantile(low + probability * (high - low));
        value.clamp(min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY))
    }
}

/// Quantile of the standard normal distribution: halving of its distribution function, to the last bit but a few.
fn standard_quantile(probability: f64) -> f64 {
    // No probability of a draw lies beyond nine deviations.
    let (mut low, mut high) = (-9.0_f64, 9.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match 0.5 * libm::erfc(-middle / 2.0_f64.sqrt()) < probability {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (probability, expected) in
            [(0.5, 0.0), (0.975, 1.959_963_985), (0.841_344_746, 1.0), (0.001, -3.090_232_306)]
        {
            assert!((standard_quantile(probability) - expected).abs() < 1.0e-8, "{probability}");
        }
        let cut = Normal { mean: 10.0, deviation: 2.0, min: Some(10.0), max: None };
        // Half of the upper half: the third quartile.
        assert!((cut.quantile(0.5) - (10.0 + 2.0 * 0.674_489_75)).abs() < 1.0e-6);
        assert!(cut.quantile(1.0e-12) >= 10.0);
    }

    #[test]
    fn each_stratum_of_a_latin_hypercube_has_one_sample() {
        for count in [1, 2, 7, 100, 1000] {
            let mut strata: Vec<u32> =
                (0..count).map(|index| shuffled(3, "plant.wind.speed_m_s", index, count)).collect();
            assert!(count < 7 || strata.windows(2).any(|pair| pair[0] > pair[1]), "{strata:?}");
            strata.sort_unstable();
            assert_eq!(strata, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn every_design_covers_the_unit_interval_evenly() {
        for design in [Design::Random, Design::LatinHypercube, Design::Sobol] {
            for dimension in [0, 1, 300] {
                let key = format!("key {dimension}");
                let draw = |index| probability(design, 7, (&key, dimension), (index, 1000));
                let mut draws: Vec<f64> = (0..1000).map(draw).collect();
                draws.sort_by(f64::total_cmp);
                assert!(draws[0] > 0.0 && draws[999] < 1.0);
                let farthest = draws.iter().enumerate().map(|(rank, draw)| {
                    (draw - (f64::from(u32::try_from(rank).unwrap()) + 0.5) / 1000.0).abs()
                });
                let farthest = farthest.fold(0.0, f64::max);
                // Kolmogorov's distance: 1.95/sqrt(n) is passed once in a thousand draws; the other designs are far below.
                let limit = if design == Design::Random { 0.062 } else { 0.01 };
                assert!(farthest < limit, "{design:?} {dimension}: {farthest}");
            }
        }
    }
}
