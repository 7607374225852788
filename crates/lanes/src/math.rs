//! Functions that every machine and every width computes to the same bits.

use pulp::{Scalar, Simd};

use crate::Lanes;

const TAU: f32 = std::f32::consts::TAU;

/// Where tanh is 1 to the last bit but one.
const TANH_END: f32 = 8.5;
/// tanh x ≈ x P(x²) / Q(x²) within 1.2e-8 up to the end: a weighted least-squares fit of our own,
/// reweighted until its error was even.
const TANH_P: [f32; 5] = [1.0, 0.134_132_52, 0.003_534_031_8, 2.125_112_2e-5, 1.426_933_15e-8];
const TANH_Q: [f32; 5] = [1.0, 0.467_465_73, 0.026_022_77, 0.000_334_887_27, 8.145_167e-7];

/// sin 2πa ≈ a P(a²) within 5.4e-9 for a up to a quarter turn: a fit of the same kind.
const SIN_P: [f32; 5] = [TAU, -41.341_68, 81.602_234, -76.575_03, 39.711_18];

/// The polynomial with these coefficients, the constant first.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(coefficients: &[f32; N], x: Lanes<S>) -> Lanes<S> {
    let mut sum = x.like(coefficients[N - 1]);
    let mut power = N - 1;
    while power > 0 {
        power -= 1;
        sum = sum * x + coefficients[power];
    }
    sum
}

/// Hyperbolic tangent, within 5e-7.
#[inline(always)]
pub fn tanh<S: Simd>(x: Lanes<S>) -> Lanes<S> {
    // Held this way around, what is not a number stays one.
    let x = x.greater(x.like(TANH_END)).choose(x.like(TANH_END), x);
    let x = x.less(x.like(-TANH_END)).choose(x.like(-TANH_END), x);
    let square = x * x;
    x * polynomial(&TANH_P, square) / polynomial(&TANH_Q, square)
}

/// Logistic function 1 / (1 + exp(−x)), within 3e-7.
#[inline(always)]
pub fn logistic<S: Simd>(x: Lanes<S>) -> Lanes<S> {
    tanh(x * 0.5) * 0.5 + 0.5
}

/// Nearest whole number, for magnitudes below 4 million.
#[inline(always)]
pub fn round<S: Simd>(x: Lanes<S>) -> Lanes<S> {
    // Adding it pushes the fraction out of the number.
    const SHIFT: f32 = 12_582_912.0;
    (x + SHIFT) - SHIFT
}

/// Sine of an angle in turns, within 3e-7.
#[inline(always)]
pub fn sin_turns<S: Simd>(turns: Lanes<S>) -> Lanes<S> {
    let turns = turns - round(turns);
    let size = turns.abs();
    // The second quarter mirrors the first.
    let size = size.min(-(size - 0.5));
    let sine = size * polynomial(&SIN_P, size * size);
    turns.less(turns.like(0.0)).choose(-sine, sine)
}

/// Cosine of an angle in turns.
#[inline(always)]
pub fn cos_turns<S: Simd>(turns: Lanes<S>) -> Lanes<S> {
    sin_turns(turns + 0.25)
}

/// An angle within −π to π.
#[inline(always)]
pub fn wrap<S: Simd>(angle: Lanes<S>) -> Lanes<S> {
    angle - round(angle * (1.0 / TAU)) * TAU
}

/// [`tanh`] of one number.
pub fn tanh1(x: f32) -> f32 {
    tanh(Lanes::<Scalar>::from(x)).value()
}

/// [`logistic`] of one number.
pub fn logistic1(x: f32) -> f32 {
    logistic(Lanes::<Scalar>::from(x)).value()
}
