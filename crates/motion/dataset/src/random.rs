//! Random numbers from a seed.

/// SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014): tiny,
/// and the same on every machine.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A stream of its own for every seed and name.
    pub fn new(seed: u64, name: &str) -> Self {
        Self(seed ^ fingerprint(name.as_bytes()))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * ((self.next() >> 40) as f32 / (1u64 << 24) as f32)
    }

    /// Standard normal (Box–Muller).
    pub fn normal(&mut self) -> f32 {
        let (u, v) = (self.uniform(f32::EPSILON, 1.0), self.uniform(0.0, std::f32::consts::TAU));
        (-2.0 * u.ln()).sqrt() * v.cos()
    }
}

/// FNV-1a over eight bytes at a time: tells whether something changed, nothing more.
pub fn fingerprint(bytes: &[u8]) -> u64 {
    let mix = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(23);
    let words = bytes.chunks(8).map(|chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        u64::from_le_bytes(word)
    });
    let hash = words.fold(0xcbf2_9ce4_8422_2325, mix);
    mix(hash, bytes.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_their_own_and_even() {
        let mut random = Random::new(1, "a");
        let numbers: Vec<f32> = (0..10_000).map(|_| random.uniform(-1.0, 1.0)).collect();
        assert!(numbers.iter().all(|n| (-1.0..1.0).contains(n)));
        assert!((numbers.iter().sum::<f32>() / 10_000.0).abs() < 0.02);
        let square: f32 = (0..10_000).map(|_| random.normal().powi(2)).sum::<f32>() / 10_000.0;
        assert!((square - 1.0).abs() < 0.05);
        assert_ne!(Random::new(1, "a").next(), Random::new(1, "b").next());
        assert_eq!(Random::new(7, "a").next(), Random::new(7, "a").next());
        assert_ne!(fingerprint(b"ab"), fingerprint(b"ab\0"));
    }
}
