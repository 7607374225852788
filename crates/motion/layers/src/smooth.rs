//! How what a layer adds comes and goes: by half-lives, the same at every frame rate.

use std::f32::consts::LN_2;
use std::ops::{Add, Mul, Sub};

/// Where a critically damped spring that is at `x` and moves at `v` is after `dt`, and how it moves
/// there: as [`ambulo_rig::share`], but without a jump of the speed when the target jumps. It covers half the
/// way from rest in about 1.2 half-lives.
///
/// Source: Holden, "Spring-It-On: The Game Developer's Spring-Roll-Call" (2021),
/// `simple_spring_damper_exact`; exact for any `dt`.
pub(crate) fn spring<T>(x: T, v: T, target: T, halflife: f32, dt: f32) -> (T, T)
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>,
{
    let damping = 2.0 * LN_2 / halflife.max(1e-6);
    // So far on that nothing is left, in which 0 × ∞ must not come up.
    if damping * dt > 80.0 {
        return (target, v * 0.0);
    }
    let away = x - target;
    let rate = v + away * damping;
    let left = (-damping * dt).exp();
    ((away + rate * dt) * left + target, (v - rate * (damping * dt)) * left)
}

/// 0 up to `from`, 1 beyond `to`, smooth in between.
pub(crate) fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from).max(1e-6)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn half_is_left_after_a_half_life() {
        let (half, _) = spring(0.0, 0.0, 1.0, 0.2, 0.242);
        assert!((half - 0.5).abs() < 0.01, "{half}");
    }

    #[test]
    fn any_time_is_fine() {
        assert_eq!(spring(0.3, 2.0, 1.0, 0.2, 0.0), (0.3, 2.0));
        assert_eq!(spring(0.3, 2.0, 1.0, 0.2, f32::MAX), (1.0, 0.0));
        assert_eq!(spring(0.3, 2.0, 1.0, 0.0, 0.01), (1.0, 0.0));
    }

    proptest! {
        #[test]
        fn two_steps_are_one_twice_as_long(
            x in -1.0..1.0f32, v in -3.0..3.0f32, halflife in 0.02..0.5f32, dt in 0.0..0.1f32,
        ) {
            let (once, speed) = spring(x, v, 0.5, halflife, 2.0 * dt);
            let (half, half_speed) = spring(x, v, 0.5, halflife, dt);
            let (twice, twice_speed) = spring(half, half_speed, 0.5, halflife, dt);
            prop_assert!((once - twice).abs() < 1e-4 && (speed - twice_speed).abs() < 1e-2);
        }
    }
}
