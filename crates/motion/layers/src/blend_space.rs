//! Weights of samples that lie along a line or in a plane, at any point of it.

use ambulo_rig::glam::Vec2;

use crate::Refused;
use crate::refused::check_number;

/// Samples nearer to each other are one.
const NEAREST: f32 = 1e-4;

/// Greatest coordinate; more is a mistake.
const FARTHEST: f32 = 1e6;

/// Why samples do not make a blend space.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum SpaceError {
    #[error("a blend space needs at least one sample")]
    Empty,
    #[error("sample {sample} does not lie within ±10⁶")]
    Range { sample: usize },
    #[error("sample {sample} does not come after the one before it")]
    Order { sample: usize },
    #[error("samples {a} and {b} lie at the same place")]
    Same { a: usize, b: usize },
}

/// Samples along a line: between two neighbours their weights go linearly, beyond both ends the last
/// one has it all.
#[derive(Clone, Debug, PartialEq)]
pub struct BlendSpace1 {
    samples: Vec<f32>,
}

impl BlendSpace1 {
    /// From samples in ascending order.
    ///
    /// # Errors
    /// No sample, one beyond ±10⁶ or not greater than the one before it.
    pub fn new(samples: Vec<f32>) -> Result<Self, SpaceError> {
        let first = samples.first().ok_or(SpaceError::Empty)?;
        within(*first, 0)?;
        for (index, pair) in samples.windows(2).enumerate() {
            within(pair[1], index + 1)?;
            if pair[1] - pair[0] < NEAREST {
                return Err(SpaceError::Order { sample: index + 1 });
            }
        }
        Ok(Self { samples })
    }

    /// Number of samples, at least 1.
    #[allow(clippy::len_without_is_empty)] // It is never empty.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Writes a weight a sample: 0 to 1, together 1.
    ///
    /// # Errors
    /// A point that is not finite, a buffer of another length; then nothing is written.
    pub fn weights(&self, x: f32, weights: &mut [f32]) -> Result<(), Refused> {
        check_number(x, f32::MIN, f32::MAX)?;
        sized(self.samples.len(), weights)?;
        weights.fill(0.0);
        // The first sample that is not before x.
        let next = self.samples.partition_point(|sample| *sample < x);
        if next == 0 || next == self.samples.len() {
            weights[next.min(self.samples.len() - 1)] = 1.0;
            return Ok(());
        }
        let (a, b) = (self.samples[next - 1], self.samples[next]);
        let t = (x - a) / (b - a);
        (weights[next - 1], weights[next]) = (1.0 - t, t);
        Ok(())
    }
}

/// Samples anywhere in a plane, with weights by gradient bands: no triangulation is needed, weights
/// are continuous, 1 at their own sample and 0 at every other one.
///
/// Source: Johansen, "Automated Semi-Procedural Animation for Character Locomotion" (2009), section
/// 6.3, in Cartesian space: hᵢ(p) = minⱼ clamp(1 − (p − pᵢ)·(pⱼ − pᵢ) / |pⱼ − pᵢ|², 0, 1), normalised.
#[derive(Clone, Debug, PartialEq)]
pub struct BlendSpace2 {
    samples: Vec<Vec2>,
}

impl BlendSpace2 {
    /// From samples in any order.
    ///
    /// # Errors
    /// No sample, one beyond ±10⁶, two at the same place.
    pub fn new(samples: Vec<Vec2>) -> Result<Self, SpaceError> {
        if samples.is_empty() {
            return Err(SpaceError::Empty);
        }
        for (b, sample) in samples.iter().enumerate() {
            within(sample.x, b)?;
            within(sample.y, b)?;
            if let Some(a) = samples[..b].iter().position(|s| s.distance(*sample) < NEAREST) {
                return Err(SpaceError::Same { a, b });
            }
        }
        Ok(Self { samples })
    }

    /// Number of samples, at least 1.
    #[allow(clippy::len_without_is_empty)] // It is never empty.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Writes a weight a sample: 0 to 1, together 1.
    ///
    /// # Errors
    /// A point that is not finite, a buffer of another length; then nothing is written.
    pub fn weights(&self, point: Vec2, weights: &mut [f32]) -> Result<(), Refused> {
        check_number(point.x, f32::MIN, f32::MAX)?;
        check_number(point.y, f32::MIN, f32::MAX)?;
        sized(self.samples.len(), weights)?;
        // Farther out nothing changes that could be told apart, and squares stay finite.
        let point = point.clamp(Vec2::splat(-2.0 * FARTHEST), Vec2::splat(2.0 * FARTHEST));
        for (weight, &own) in weights.iter_mut().zip(&self.samples) {
            *weight = influence(point, own, &self.samples);
        }
        // The nearest sample is on its own side of every band's middle: the sum is 1/2 or more.
        let sum: f32 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
        Ok(())
    }
}

/// How much of a sample there is at a point: falls across the band to each other sample.
fn influence(point: Vec2, own: Vec2, samples: &[Vec2]) -> f32 {
    let bands = samples.iter().filter(|other| **other != own).map(|&other| {
        let across = other - own;
        1.0 - (point - own).dot(across) / across.length_squared()
    });
    bands.fold(1.0, f32::min).max(0.0)
}

fn within(coordinate: f32, sample: usize) -> Result<(), SpaceError> {
    // Written so that NaN fails.
    if coordinate.abs() <= FARTHEST { Ok(()) } else { Err(SpaceError::Range { sample }) }
}

fn sized(expected: usize, weights: &[f32]) -> Result<(), Refused> {
    let got = weights.len();
    if got == expected { Ok(()) } else { Err(Refused::Count { expected, got }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn weights_along_a_line() {
        let space = BlendSpace1::new(vec![0.0, 1.0, 3.0]).unwrap();
        let mut weights = [0.0; 3];
        for (x, expected) in [
            (-5.0, [1.0, 0.0, 0.0]),
            (0.0, [1.0, 0.0, 0.0]),
            (0.25, [0.75, 0.25, 0.0]),
            (1.0, [0.0, 1.0, 0.0]),
            (2.0, [0.0, 0.5, 0.5]),
            (3.0, [0.0, 0.0, 1.0]),
            (f32::MAX, [0.0, 0.0, 1.0]),
        ] {
            space.weights(x, &mut weights).unwrap();
            assert_eq!(weights, expected, "{x}");
        }
        assert!(space.weights(f32::NAN, &mut weights).is_err());
        assert_eq!(space.weights(0.0, &mut [0.0; 2]), Err(Refused::Count { expected: 3, got: 2 }));
        assert_eq!(weights, [0.0, 0.0, 1.0]);
    }

    #[test]
    fn what_is_no_space_is_refused() {
        assert_eq!(BlendSpace1::new(vec![]), Err(SpaceError::Empty));
        assert_eq!(BlendSpace1::new(vec![0.0, 0.0]), Err(SpaceError::Order { sample: 1 }));
        assert_eq!(BlendSpace1::new(vec![0.0, f32::NAN]), Err(SpaceError::Range { sample: 1 }));
        assert_eq!(BlendSpace1::new(vec![f32::INFINITY]), Err(SpaceError::Range { sample: 0 }));
        assert_eq!(BlendSpace2::new(vec![]), Err(SpaceError::Empty));
        let twice = vec![Vec2::ZERO, Vec2::X, Vec2::ZERO];
        assert_eq!(BlendSpace2::new(twice), Err(SpaceError::Same { a: 0, b: 2 }));
        let none = vec![Vec2::X, Vec2::new(0.0, f32::NAN)];
        assert_eq!(BlendSpace2::new(none), Err(SpaceError::Range { sample: 1 }));
    }

    #[test]
    fn two_samples_of_a_plane_are_a_line() {
        let space = BlendSpace2::new(vec![Vec2::new(0.0, 1.0), Vec2::new(0.0, 3.0)]).unwrap();
        let mut weights = [0.0; 2];
        space.weights(Vec2::new(7.0, 1.5), &mut weights).unwrap();
        assert!((weights[0] - 0.75).abs() < 1e-6, "{weights:?}");
        assert!(space.weights(Vec2::NAN, &mut weights).is_err());
    }

    fn samples() -> impl Strategy<Value = Vec<Vec2>> {
        // On a grid, so that they are not too near, shuffled.
        let cells = prop::sample::subsequence((0..25).collect::<Vec<i32>>(), 1..9);
        let place = |cell: i32| Vec2::new((cell % 5 - 2) as f32, (cell / 5 - 2) as f32);
        cells.prop_shuffle().prop_map(move |cells| cells.into_iter().map(place).collect())
    }

    proptest! {
        #[test]
        fn weights_in_a_plane(samples in samples(), x in -1e3..1e3f32, y in -4.0..4.0f32) {
            let space = BlendSpace2::new(samples.clone()).unwrap();
            let mut weights = vec![0.0; space.len()];
            for (index, sample) in samples.iter().enumerate() {
                space.weights(*sample, &mut weights).unwrap();
                for (other, weight) in weights.iter().enumerate() {
                    prop_assert_eq!(*weight, f32::from(u8::from(other == index)), "{:?}", weights);
                }
            }
            for point in [Vec2::new(x, y), Vec2::new(x / 250.0, y), Vec2::splat(x) * 1e35] {
                space.weights(point, &mut weights).unwrap();
                let sum: f32 = weights.iter().sum();
                prop_assert!((sum - 1.0).abs() < 1e-5, "{:?}", weights);
                prop_assert!(weights.iter().all(|weight| (0.0..=1.0).contains(weight)));
                // A short step changes no weight by more than the bands are steep.
                let mut there = weights.clone();
                let step = Vec2::new(1e-3, -1e-3);
                space.weights(point + step, &mut there).unwrap();
                let count = samples.len() as f32;
                for (a, b) in weights.iter().zip(&there) {
                    prop_assert!((a - b).abs() < 1e-3 * 4.0 * (1.0 + count), "{} {}", a, b);
                }
            }
        }
    }
}
