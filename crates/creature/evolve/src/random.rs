//! Random numbers from a seed.

use serde::{Deserialize, Serialize};

/// SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014): one word
/// of state, and the same on every machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Random(u64);

impl Random {
    /// A stream of its own for every seed.
    pub fn new(seed: u64) -> Self {
        let mut stream = Self(seed);
        // Neighbouring seeds would give overlapping streams.
        Self(stream.next() ^ 0x5DEE_CE66_D1A4_B0A5)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1), with 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [−limit, limit).
    pub fn around(&mut self, limit: f32) -> f32 {
        ((2.0 * self.unit() - 1.0) * f64::from(limit)) as f32
    }

    /// Uniform among 0..count.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count.saturating_sub(1))
    }

    /// Normal with mean 0 and variance 1: Box and Muller, "A note on the generation of random normal
    /// deviates", 1958. Takes two uniform numbers and gives one: its sister is thrown away, so that
    /// one word stays the whole state. Never beyond ±8.6.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.unit())).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.unit())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_the_moments_of_the_distribution() {
        let mut random = Random::new(1);
        let numbers: Vec<_> = (0..200_000).map(|_| random.normal()).collect();
        let moment = |power| numbers.iter().map(|x: &f64| x.powi(power)).sum::<f64>() / 200_000.0;
        for (power, expected) in [(1, 0.0), (2, 1.0), (3, 0.0), (4, 3.0)] {
            assert!((moment(power) - expected).abs() < 0.05, "{power}: {}", moment(power));
        }
        let within = numbers.iter().filter(|x| x.abs() < 1.0).count() as f64 / 200_000.0;
        assert!((within - 0.6827).abs() < 0.005, "{within}");
        // Neighbours have nothing to do with each other.
        let product = numbers.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / 200_000.0;
        assert!(product.abs() < 0.01, "{product}");
    }

    /// Whoever stored a state relies on it.
    #[test]
    fn the_stream_of_a_seed_never_changes() {
        let mut random = Random::new(42);
        let found = (random.unit(), random.around(2.0), random.below(1000), random.normal());
        assert_eq!(found, (0.5916724980159815, 1.590406, 722, 0.4943624963765565));
    }
}
