//! Pieces of ground that motion may have been captured on.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use ambulo_rig::glam::Vec2;
use ambulo_rig::{HeightField, Terrain};

use crate::random::Random;

/// Heights a side.
const SIDE: usize = 128;
/// Metres between heights of the patches that are made from noise: 10 m a side.
const NOISE_CELL: f32 = 0.08;
/// Most pieces: 0.66 GB of them.
pub const MOST: usize = 10_000;
/// Steepest piece of a height map that is taken, metres from its mean: 50 px of the published maps.
const HIGHEST: f32 = 50.0 * 3.0 * 0.01;

/// Square pieces of ground around the origin, their mean at height zero.
#[derive(Clone, Debug)]
pub struct Patches {
    cell: f32,
    heights: Vec<Vec<f32>>,
}

/// One piece.
#[derive(Clone, Copy, Debug)]
pub struct Patch<'a> {
    cell: f32,
    heights: &'a [f32],
}

impl Patches {
    /// Random cuts of height maps: anywhere, mirrored and turned at random, those that rise too
    /// high left out. One trial for each 225 heights of a map, as long as there are not too many.
    ///
    /// Source: section 4.2 of the PFNN paper and its published procedure; ours draws its cuts from
    /// another random generator and cuts by sampling instead of shifting a reflected copy.
    pub fn from_maps(maps: &[HeightField], seed: u64) -> Self {
        let mut random = Random::new(seed, "patches");
        let mut heights = vec![];
        let cell = maps.first().map_or(NOISE_CELL, HeightField::cell);
        for map in maps {
            let (rows, columns) = map.size();
            for _ in 0..(rows * columns / 225).clamp(1, (MOST / maps.len()).max(1)) {
                let half = Vec2::new(columns as f32, rows as f32) * (0.5 * map.cell());
                let middle =
                    Vec2::new(random.uniform(-half.x, half.x), random.uniform(-half.y, half.y));
                let turn = Vec2::from_angle(random.uniform(-FRAC_PI_2, FRAC_PI_2));
                let flip = Vec2::new(sign(&mut random), sign(&mut random));
                let patch = grid(cell, |at| {
                    let place = reflected(middle + turn.rotate(at * flip), half);
                    map.height(place.x, place.y)
                });
                heights.extend(levelled(patch));
            }
        }
        Self { cell, heights }
    }

    /// Ground that needs no files: slopes, waves, stairs and rough ground in random shares.
    pub fn from_noise(count: usize, seed: u64) -> Self {
        let mut random = Random::new(seed, "noise");
        let patch = |_| {
            let slope = Vec2::from_angle(random.uniform(-PI, PI)) * random.uniform(0.0, 0.3);
            let waves: Vec<(Vec2, f32, f32)> = [(7.0, 0.30), (3.0, 0.15), (1.2, 0.06)]
                .into_iter()
                .map(|(length, height)| {
                    let wave = Vec2::from_angle(random.uniform(-PI, PI)) * (TAU / length);
                    (wave, random.uniform(0.0, TAU), random.uniform(-height, height))
                })
                .collect();
            let along = Vec2::from_angle(random.uniform(-PI, PI));
            let (tread, shift) = (random.uniform(0.3, 1.2), random.uniform(0.0, 1.0));
            let rise = if random.uniform(0.0, 1.0) < 0.4 { random.uniform(-0.2, 0.2) } else { 0.0 };
            let stairs =
                move |at: Vec2| rise * ((at.dot(along) / tread + shift).floor()).clamp(-8.0, 8.0);
            grid(NOISE_CELL, |at| {
                let waves = waves
                    .iter()
                    .map(|(wave, shift, height)| height * (at.dot(*wave) + shift).sin());
                at.dot(slope) + waves.sum::<f32>() + stairs(at)
            })
        };
        let heights = (0..count).map(patch).filter_map(centred).collect();
        Self { cell: NOISE_CELL, heights }
    }

    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.heights.len()
    }

    /// Whether every cut was too high.
    pub fn is_empty(&self) -> bool {
        self.heights.is_empty()
    }

    /// One of them.
    pub fn get(&self, index: usize) -> Patch<'_> {
        Patch { cell: self.cell, heights: &self.heights[index] }
    }
}

impl Patch<'_> {
    /// Bilinear; the border's height outside.
    pub fn height(&self, at: Vec2) -> f32 {
        let place = |at: f32| {
            let at = (at / self.cell + SIDE as f32 / 2.0).clamp(0.0, (SIDE - 1) as f32);
            let index = (at as usize).min(SIDE - 2);
            (index, at - index as f32)
        };
        let ((column, u), (row, v)) = (place(at.x), place(at.y));
        let at = |row: usize, column: usize| self.heights[row * SIDE + column];
        let near = at(row, column) * (1.0 - u) + at(row, column + 1) * u;
        let far = at(row + 1, column) * (1.0 - u) + at(row + 1, column + 1) * u;
        near * (1.0 - v) + far * v
    }
}

fn sign(random: &mut Random) -> f32 {
    if random.uniform(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 }
}

fn grid(cell: f32, height: impl Fn(Vec2) -> f32) -> Vec<f32> {
    let place = |index: usize| (index as f32 - SIDE as f32 / 2.0) * cell;
    let cells = (0..SIDE * SIDE).map(|i| Vec2::new(place(i % SIDE), place(i / SIDE)));
    cells.map(height).collect()
}

/// A place folded back into ±half, as mirrors at the borders would.
fn reflected(at: Vec2, half: Vec2) -> Vec2 {
    let fold = |at: f32, half: f32| {
        let along = (at + half).rem_euclid(4.0 * half);
        (if along > 2.0 * half { 4.0 * half - along } else { along }) - half
    };
    Vec2::new(fold(at.x, half.x), fold(at.y, half.y))
}

fn centred(mut patch: Vec<f32>) -> Option<Vec<f32>> {
    let mean = patch.iter().sum::<f32>() / patch.len() as f32;
    patch.iter_mut().for_each(|height| *height -= mean);
    patch.iter().all(|height| height.is_finite()).then_some(patch)
}

fn levelled(patch: Vec<f32>) -> Option<Vec<f32>> {
    centred(patch).filter(|patch| patch.iter().all(|height| height.abs() <= HIGHEST))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_are_centred_and_the_seeds_own() {
        let patches = Patches::from_noise(20, 3);
        assert_eq!(patches.len(), 20);
        for index in 0..20 {
            let heights = patches.get(index).heights;
            assert!(heights.iter().sum::<f32>().abs() / ((SIDE * SIDE) as f32) < 1e-3);
        }
        assert_eq!(Patches::from_noise(20, 3).heights, patches.heights);
        assert_ne!(Patches::from_noise(20, 4).heights, patches.heights);
    }

    #[test]
    fn maps_are_cut_and_steep_cuts_left_out() {
        let text = |height: f32| {
            let row = |r: usize| {
                (0..60)
                    .map(|c| format!("{} ", height * ((r * 60 + c) % 7) as f32))
                    .collect::<String>()
            };
            (0..60).map(row).collect::<Vec<_>>().join("\n")
        };
        let gentle = HeightField::from_text(&text(0.1), 0.04, 1.0).unwrap();
        let patches = Patches::from_maps(std::slice::from_ref(&gentle), 1);
        assert_eq!(patches.len(), 60 * 60 / 225);
        let steep = HeightField::from_text(&text(1.0), 0.04, 1.0).unwrap();
        assert!(Patches::from_maps(&[steep], 1).is_empty());
        let flat = patches.get(0);
        assert!(flat.height(Vec2::splat(99.0)).is_finite());
        assert!(reflected(Vec2::new(1.5, -3.0), Vec2::ONE).abs_diff_eq(Vec2::new(0.5, 1.0), 1e-6));
    }
}
