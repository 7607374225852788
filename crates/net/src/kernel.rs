//! The inner loop: four control points of one row against one vector, at once.
//!
//! Blending after the products (in activation space) reads every weight once and needs no blended
//! copy. Sums run in eight lanes in a fixed order, so results do not depend on the machine's
//! vector width.

use crate::CONTROL_POINTS;

const LANES: usize = 8;

/// The four dot products of a row's control points (4 × inputs, one after the other) with `x`.
pub fn dot4(row: &[f32], x: &[f32]) -> [f32; CONTROL_POINTS] {
    let inputs = x.len();
    let (w0, rest) = row.split_at(inputs);
    let (w1, rest) = rest.split_at(inputs);
    let (w2, w3) = rest.split_at(inputs);
    let mut sums = [[0.0f32; LANES]; CONTROL_POINTS];
    let body = inputs - inputs % LANES;
    let lanes = |slice: &[f32], at: usize| -> [f32; LANES] {
        slice[at..at + LANES].try_into().expect("a slice of that length")
    };
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
        let tail = w[body..].iter().zip(&x[body..]).map(|(w, x)| w * x).sum::<f32>();
        let s = sums[point];
        let pairs = [s[0] + s[4], s[1] + s[5], s[2] + s[6], s[3] + s[7]];
        totals[point] = (pairs[0] + pairs[2]) + (pairs[1] + pairs[3]) + tail;
    }
    totals
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

    #[test]
    fn elu_is_smooth_at_zero_and_bounded_below() {
        assert_eq!(elu(2.5), 2.5);
        assert_eq!(elu(0.0), 0.0);
        assert!((elu(-1e-4) + 1e-4).abs() < 1e-8);
        assert_eq!(elu(-200.0), -1.0);
    }
}
