//! Angles that go round.

use std::f32::consts::{PI, TAU};

/// The same angle in [−π, π), radians.
pub fn wrapped(angle: f32) -> f32 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_shorter_way_round() {
        assert_eq!((wrapped(0.0), wrapped(PI), wrapped(-PI)), (0.0, -PI, -PI));
        assert!((wrapped(3.0 * TAU + 0.5) - 0.5).abs() < 1e-5);
        assert!((wrapped(PI + 0.1) + PI - 0.1).abs() < 1e-5);
    }
}
