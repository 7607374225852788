//! Every width gives the same bits, and the functions are what they are called.

use ambulo_lanes::{Job, Lanes, Simd, Width, math};
use proptest::prelude::*;

/// All that lanes can do, for each of some numbers, with a neighbour as the other operand.
struct Everything<'a>(&'a [f32]);

impl Job for Everything<'_> {
    type Output = Vec<[u32; 18]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let numbers = self.0;
        let other = |i: usize| numbers[(i + 1) % numbers.len()];
        let mut all = Vec::new();
        for start in (0..numbers.len()).step_by(Lanes::<S>::WIDTH) {
            let many = (numbers.len() - start).min(Lanes::<S>::WIDTH);
            let a = Lanes::load(simd, &numbers[start..]);
            let others: Vec<f32> = (start..start + many).map(other).collect();
            let b = Lanes::load(simd, &others);
            let results = [
                a + b,
                a - b,
                a * b,
                a / b,
                -a,
                a.abs(),
                a.abs().sqrt(),
                a.min(b),
                a.max(b),
                a.less(b).choose(a, b),
                a.greater(b).keep(a),
                (!a.less(b)).one(),
                math::tanh(a),
                math::logistic(a),
                math::sin_turns(a),
                math::cos_turns(a),
                math::wrap(a),
                (a.less(b) | b.less(a)).one() * (a.less(b) & b.less(a)).one(),
            ]; // fmt: skip
            all.extend((0..many).map(|lane| results.map(|result| bits(result.lane(lane)))));
        }
        all
    }
}

/// One pattern for all that is not a number: its bits are the one thing IEEE 754 leaves open.
fn bits(value: f32) -> u32 {
    if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() }
}

proptest! {
    #[test]
    fn every_width_gives_the_same_bits(
        numbers in prop::collection::vec(prop_oneof![prop::num::f32::ANY, -10f32..10.0], 1..50),
    ) {
        let expected = Width::One.run(Everything(&numbers));
        for width in Width::available() {
            prop_assert_eq!(&width.run(Everything(&numbers)), &expected, "{:?}", width);
        }
    }

    #[test]
    fn functions_are_what_they_are_called(x in -12f32..12.0) {
        let wide = f64::from(x);
        prop_assert!((f64::from(math::tanh1(x)) - wide.tanh()).abs() < 5e-7);
        prop_assert!((f64::from(math::logistic1(x)) - 1.0 / (1.0 + (-wide).exp())).abs() < 3e-7);
        let sine = math::sin_turns(Lanes::from(x)).value();
        prop_assert!((f64::from(sine) - (std::f64::consts::TAU * wide).sin()).abs() < 3e-6, "{sine}");
        let turned = math::wrap(Lanes::from(x)).value();
        prop_assert!(turned.abs() < 3.15 && (f64::from(turned).sin() - wide.sin()).abs() < 2e-6);
    }
}

#[test]
fn what_is_not_a_number_stays_so_and_ends_are_ends() {
    assert!(math::tanh1(f32::NAN).is_nan());
    assert!((math::tanh1(f32::INFINITY) - 1.0).abs() < 2e-7);
    assert!((math::tanh1(f32::NEG_INFINITY) + 1.0).abs() < 2e-7);
    assert_eq!(math::tanh1(0.0), 0.0);
    assert!((math::tanh1(1e-3) - 1e-3).abs() < 1e-9);
}

#[test]
fn any_sees_every_lane() {
    struct Sees(usize);
    impl Job for Sees {
        type Output = [bool; 2];
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> [bool; 2] {
            let one = Lanes::from_fn(simd, |lane| if lane == self.0 { 1.0 } else { 0.0 });
            let none = Lanes::zero(simd);
            [one.greater(none).any(), none.greater(none).any()]
        }
    }
    for width in Width::available() {
        for lane in 0..width.lanes() {
            assert_eq!(width.run(Sees(lane)), [true, false], "{width:?} {lane}");
        }
    }
}
