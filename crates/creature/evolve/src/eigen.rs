//! Eigenvalues and eigenvectors of a symmetric matrix, the same on every machine: only + − × ÷ √.

/// Steps of the QL iteration for one eigenvalue; two are usual.
const MOST_STEPS: usize = 60;

/// Of a symmetric matrix of `n` rows, row by row: its eigenvalues, in no order, and in the row of the
/// same index the eigenvector of each, of length 1.
///
/// Golub and Van Loan, "Matrix computations", 4th edition: Householder tridiagonalisation (algorithm
/// 8.3.1), then implicit symmetric QL, as the QR of algorithm 8.3.3 but from the other end.
pub(crate) fn eigen(matrix: &[f64], n: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut diagonal, mut beside, mut rows) = tridiagonal(matrix, n);
    for first in 0..n {
        for _ in 0..MOST_STEPS {
            // The block from `first` on that has not fallen apart yet.
            let apart = |&i: &usize| {
                let size = diagonal[i].abs() + diagonal[i + 1].abs();
                beside[i].abs() <= f64::EPSILON * size
            };
            let last = (first..n - 1).find(apart).unwrap_or(n - 1);
            if last == first {
                break;
            }
            ql_step(&mut diagonal, &mut beside, &mut rows, first, last);
        }
    }
    (diagonal, rows)
}

/// One implicit QL step with Wilkinson's shift on the block `first..=last`.
fn ql_step(diagonal: &mut [f64], beside: &mut [f64], rows: &mut [f64], first: usize, last: usize) {
    let n = diagonal.len();
    let half = (diagonal[first + 1] - diagonal[first]) / (2.0 * beside[first]);
    let root = (half * half + 1.0).sqrt();
    let shift = diagonal[first] - beside[first] / (half + if half < 0.0 { -root } else { root });
    // A rotation of the last two rows begins a bulge; the others chase it upwards.
    let (mut sin, mut cos, mut moved) = (1.0, 1.0, 0.0);
    let mut g = diagonal[last] - shift;
    for i in (first..last).rev() {
        let (f, b) = (sin * beside[i], cos * beside[i]);
        let r = (f * f + g * g).sqrt();
        if i + 1 < last {
            beside[i + 1] = r;
        }
        if r == 0.0 {
            // The block fell apart in the middle.
            diagonal[i + 1] -= moved;
            return;
        }
        (sin, cos) = (f / r, g / r);
        g = diagonal[i + 1] - moved;
        let slope = (diagonal[i] - g) * sin + 2.0 * cos * b;
        moved = sin * slope;
        diagonal[i + 1] = g + moved;
        g = cos * slope - b;
        let (above, below) = rows.split_at_mut((i + 1) * n);
        for (x, y) in above[i * n..].iter_mut().zip(&mut below[..n]) {
            (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
        }
    }
    diagonal[first] -= moved;
    beside[first] = g;
}

/// The diagonal and what is beside it of Qᵀ A Q, and Qᵀ row by row.
fn tridiagonal(matrix: &[f64], n: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut a = matrix.to_vec();
    let mut rows = vec![0.0; n * n];
    (0..n).for_each(|i| rows[i * n + i] = 1.0);
    for k in 0..n.saturating_sub(2) {
        // The reflection that leaves of column k only the number beside the diagonal.
        let mut v: Vec<f64> = (0..n).map(|i| if i > k { a[i * n + k] } else { 0.0 }).collect();
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v[k + 1] += if v[k + 1] < 0.0 { -length } else { length };
        let square: f64 = v.iter().map(|x| x * x).sum();
        if square == 0.0 {
            continue;
        }
        let beta = 2.0 / square;
        // A − v wᵀ − w vᵀ, where w = β A v − ½ β² (vᵀ A v) v.
        let dot = |row: &[f64]| row.iter().zip(&v).map(|(x, v)| x * v).sum::<f64>();
        let p: Vec<_> = (0..n).map(|i| beta * dot(&a[i * n..(i + 1) * n])).collect();
        let middle = 0.5 * beta * dot(&p);
        let w: Vec<_> = p.iter().zip(&v).map(|(p, v)| p - middle * v).collect();
        for i in k..n {
            for j in k..n {
                a[i * n + j] -= v[i] * w[j] + w[i] * v[j];
            }
        }
        // Qᵀ becomes (1 − β v vᵀ) Qᵀ.
        let mut sum = vec![0.0; n];
        for (row, v) in rows.chunks_exact(n).zip(&v) {
            sum.iter_mut().zip(row).for_each(|(sum, x)| *sum += v * x);
        }
        for (row, v) in rows.chunks_exact_mut(n).zip(&v) {
            row.iter_mut().zip(&sum).for_each(|(x, sum)| *x -= beta * v * sum);
        }
    }
    let diagonal = (0..n).map(|i| a[i * n + i]).collect();
    let beside = (1..n).map(|i| a[i * n + i - 1]).collect();
    (diagonal, beside, rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Random;

    fn sound(matrix: &[f64], n: usize) -> Vec<f64> {
        let (values, rows) = eigen(matrix, n);
        let size = matrix.iter().map(|x| x.abs()).fold(1e-300, f64::max) * n as f64;
        for (i, (value, vector)) in values.iter().zip(rows.chunks(n)).enumerate() {
            for (row, x) in matrix.chunks(n).zip(vector) {
                let product: f64 = row.iter().zip(vector).map(|(a, b)| a * b).sum();
                assert!((product - value * x).abs() < 1e-13 * size, "A v is not λ v");
            }
            for (j, other) in rows.chunks(n).enumerate() {
                let dot: f64 = vector.iter().zip(other).map(|(a, b)| a * b).sum();
                assert!((dot - f64::from(i == j)).abs() < 1e-12, "{i} and {j}: {dot}");
            }
        }
        let mut values = values;
        values.sort_by(f64::total_cmp);
        values
    }

    #[test]
    fn random_matrices_of_many_sizes() {
        let mut random = Random::new(1);
        for n in (1..12).chain([40, 64]) {
            let mut matrix = vec![0.0; n * n];
            for i in 0..n {
                for j in 0..=i {
                    matrix[i * n + j] = random.normal();
                    matrix[j * n + i] = matrix[i * n + j];
                }
            }
            sound(&matrix, n);
        }
    }

    #[test]
    fn matrices_whose_answer_is_known() {
        assert_eq!(sound(&[0.0; 9], 3), [0.0; 3]);
        assert_eq!(sound(&[3.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0], 3), [1.0, 2.0, 3.0]);
        let two = sound(&[2.0, 1.0, 1.0, 2.0], 2);
        assert!((two[0] - 1.0).abs() < 1e-15 && (two[1] - 3.0).abs() < 1e-15, "{two:?}");
        // Rank 1: all but one are 0, and many are equal.
        let ones = sound(&[1.0; 100], 10);
        assert!((ones[9] - 10.0).abs() < 1e-13 && ones[..9].iter().all(|x| x.abs() < 1e-14));
        // The chain −1 2 −1: 2 − 2 cos(kπ/(n + 1)).
        let n: usize = 30;
        let chain: Vec<f64> = (0..n * n)
            .map(|at| match (at / n).abs_diff(at % n) {
                0 => 2.0,
                1 => -1.0,
                _ => 0.0,
            })
            .collect();
        for (k, value) in sound(&chain, n).into_iter().enumerate() {
            let angle = (k + 1) as f64 * std::f64::consts::PI / (n + 1) as f64;
            assert!((value - (2.0 - 2.0 * angle.cos())).abs() < 1e-13);
        }
        // So small that squares are 0: no answer, but no nonsense.
        let (values, rows) = eigen(&[0.0, 1e-170, 1e-170, 0.0], 2);
        assert!(values.iter().all(|value| value.abs() <= 1e-170) && rows == [1.0, 0.0, 0.0, 1.0]);
        // Fourteen orders of magnitude apart.
        let steep: Vec<f64> =
            (0..9).map(|at| if at % 4 == 0 { [1.0, 1e-7, 1e-14][at / 4] } else { 0.0 }).collect();
        assert_eq!(sound(&steep, 3), [1e-14, 1e-7, 1.0]);
    }
}
