//! The inner loop: an affine layer at one moment of the cycle.
//!
//! Blending after the products (in activation space) reads every weight once and needs no blended
//! copy. Sums run in eight lanes in a fixed order and products are never fused with sums, so the
//! result is the same to the last bit whatever the machine's vector width.

use crate::CONTROL_POINTS;

const LANES: usize = 8;

/// Weights (rows × 4 × inputs) and biases (rows × 4) of a layer, and the control points' shares.
#[derive(Clone, Copy)]
pub struct Affine<'a> {
    pub weights: &'a [f32],
    pub biases: &'a [f32],
    pub shares: [f32; CONTROL_POINTS],
}

/// Sets `out` (one number a row) to the layer's answer to `x`.
pub fn affine(layer: Affine<'_>, x: &[f32], out: &mut [f32]) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has the feature that the function is compiled for, just asked.
        #[allow(unsafe_code)]
        return unsafe { affine_avx2(layer, x, out) };
    }
    rows(layer, x, out);
}

/// The same code, compiled for vectors of eight.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn affine_avx2(layer: Affine<'_>, x: &[f32], out: &mut [f32]) {
    rows(layer, x, out);
}

// Inlined, so that it is compiled with the features of its caller.
#[inline(always)]
fn rows(layer: Affine<'_>, x: &[f32], out: &mut [f32]) {
    let weights = layer.weights.chunks_exact(CONTROL_POINTS * x.len());
    let rows = weights.zip(layer.biases.chunks_exact(CONTROL_POINTS));
    // A plain loop: closures handed to the standard library are compiled for any machine.
    for (value, (row, bias)) in out.iter_mut().zip(rows) {
        let dots = dot4(row, x);
        let mut blended = [0.0; CONTROL_POINTS];
        for p in 0..CONTROL_POINTS {
            blended[p] = layer.shares[p] * (dots[p] + bias[p]);
        }
        *value = (blended[0] + blended[1]) + (blended[2] + blended[3]);
    }
}

/// The four dot products of a row's control points (4 × inputs, one after the other) with `x`.
#[inline(always)]
fn dot4(row: &[f32], x: &[f32]) -> [f32; CONTROL_POINTS] {
    let inputs = x.len();
    let (w0, rest) = row.split_at(inputs);
    let (w1, rest) = rest.split_at(inputs);
    let (w2, w3) = rest.split_at(inputs);
    let mut sums = [[0.0f32; LANES]; CONTROL_POINTS];
    let body = inputs - inputs % LANES;
    for at in (0..body).step_by(LANES) {
        let x = lanes(x, at);
        let w = [lanes(w0, at), lanes(w1, at), lanes(w2, at), lanes(w3, at)];
        for point in 0..CONTROL_POINTS {
            for lane in 0..LANES {
                sums[point][lane] += w[point][lane] * x[lane];
            }
        }
    }
    let mut totals = [0.0; CONTROL_POINTS];
    for (point, w) in [w0, w1, w2, w3].into_iter().enumerate() {
        let s = sums[point];
        let pairs = [s[0] + s[4], s[1] + s[5], s[2] + s[6], s[3] + s[7]];
        totals[point] = (pairs[0] + pairs[2]) + (pairs[1] + pairs[3]);
        for at in body..inputs {
            totals[point] += w[at] * x[at];
        }
    }
    totals
}

#[inline(always)]
fn lanes(slice: &[f32], at: usize) -> &[f32; LANES] {
    slice[at..at + LANES].try_into().expect("a slice of that length")
}

/// Exponential linear unit; its exponential is the same on every machine.
pub fn elu(x: f32) -> f32 {
    if x > 0.0 { x } else { libm::expm1f(x) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dot4_is_four_dot_products() {
        for inputs in [1, 7, 8, 9, 31, 342] {
            let number = |i: usize| ((i * 37 + 11) % 101) as f32 / 50.0 - 1.0;
            let x: Vec<f32> = (0..inputs).map(number).collect();
            let row: Vec<f32> = (0..inputs * 4).map(|i| number(i + 5)).collect();
            for (point, total) in dot4(&row, &x).into_iter().enumerate() {
                let w = &row[point * inputs..][..inputs];
                let expected: f64 = w.iter().zip(&x).map(|(w, x)| f64::from(w * x)).sum();
                assert!((f64::from(total) - expected).abs() < 1e-4, "{inputs} {point}");
            }
        }
    }

    /// The widths must agree to the last bit: compare with the code as compiled for any machine.
    #[test]
    fn every_width_gives_the_same_bits() {
        let number = |i: usize| ((i * 7919 + 13) % 1009) as f32 / 500.0 - 1.0;
        for inputs in [5, 8, 33, 342] {
            let x: Vec<f32> = (0..inputs).map(number).collect();
            let weights: Vec<f32> = (0..inputs * 4 * 9).map(|i| number(i + 3)).collect();
            let biases: Vec<f32> = (0..4 * 9).map(|i| number(i + 7)).collect();
            let shares = crate::control_weights(0.7);
            let layer = Affine { weights: &weights, biases: &biases, shares };
            let (mut wide, mut plain) = ([0.0; 9], [0.0; 9]);
            affine(layer, &x, &mut wide);
            rows(layer, &x, &mut plain);
            assert_eq!(wide, plain);
            assert!(wide.iter().all(|value| *value != 0.0));
        }
    }

    #[test]
    fn elu_is_smooth_at_zero_and_bounded_below() {
        assert_eq!(elu(2.5), 2.5);
        assert_eq!(elu(0.0), 0.0);
        assert!((elu(-1e-4) + 1e-4).abs() < 1e-8);
        assert_eq!(elu(-200.0), -1.0);
    }
}
