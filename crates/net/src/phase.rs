//! The phase function: how much of each control point a moment of the cycle takes.

use std::f64::consts::TAU;

/// Control points of the closed spline.
pub const CONTROL_POINTS: usize = 4;

/// Shares of the four control points at a phase in radians; they sum to 1. Any finite phase is
/// taken modulo 2π.
pub fn control_weights(phase: f32) -> [f32; CONTROL_POINTS] {
    spline_shares(f64::from(phase).rem_euclid(TAU) / TAU).map(|share| share as f32)
}

/// The same at a phase in cycles, in f64: what solving for control points needs.
///
/// A closed Catmull-Rom cubic (paper, equation 7): with p = 4·phase, k = ⌊p⌋ and μ = p − k, the
/// neighbours are k−1, k, k+1, k+2 (mod 4). Control point i lies at phase i/4. Any finite phase is
/// taken modulo 1.
pub fn spline_shares(cycles: f64) -> [f64; CONTROL_POINTS] {
    let at = cycles.rem_euclid(1.0) * CONTROL_POINTS as f64;
    let k = (at as usize) % CONTROL_POINTS;
    let m = at - at.floor();
    let (m2, m3) = (m * m, m * m * m);
    let neighbours = [
        -0.5 * m + m2 - 0.5 * m3,
        1.0 - 2.5 * m2 + 1.5 * m3,
        0.5 * m + 2.0 * m2 - 1.5 * m3,
        -0.5 * m2 + 0.5 * m3,
    ];
    let mut shares = [0.0; CONTROL_POINTS];
    for (neighbour, share) in neighbours.into_iter().enumerate() {
        shares[(k + neighbour + CONTROL_POINTS - 1) % CONTROL_POINTS] = share;
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    #[test]
    fn passes_through_its_control_points() {
        for i in 0..CONTROL_POINTS {
            let weights = control_weights(i as f32 * TAU / 4.0);
            for (j, weight) in weights.into_iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((weight - expected).abs() < 1e-6, "{i} {j} {weight}");
            }
        }
    }

    #[test]
    fn half_way_is_nine_sixteenths_of_both_neighbours() {
        let weights = control_weights(TAU / 8.0);
        assert!((weights[0] - 0.5625).abs() < 1e-6 && (weights[1] - 0.5625).abs() < 1e-6);
        assert!((weights[2] + 0.0625).abs() < 1e-6 && (weights[3] + 0.0625).abs() < 1e-6);
    }

    #[test]
    fn is_closed_and_sums_to_one() {
        for step in -200..200 {
            let phase = step as f32 * 0.17;
            let weights = control_weights(phase);
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            for (a, b) in weights.iter().zip(control_weights(phase + TAU)) {
                assert!((a - b).abs() < 1e-4, "{phase}");
            }
        }
    }
}
