//! What comes nearer and nearer, the same at every frame rate.

use std::f32::consts::LN_2;

/// Share of the way to a target that `dt` covers at a half-life, both in seconds; 1 at half-life 0.
pub fn share(halflife: f32, dt: f32) -> f32 {
    if halflife > 0.0 { 1.0 - (-LN_2 * dt / halflife).exp() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_is_left_after_a_half_life() {
        assert!((share(0.2, 0.2) - 0.5).abs() < 1e-6);
        assert_eq!((share(0.0, 0.0), share(0.2, 0.0)), (1.0, 0.0));
    }
}
