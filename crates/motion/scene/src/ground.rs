//! The ground of a scene: rectangular pieces, asked point by point.

use ambulo_rig::glam::Vec2;
use ambulo_rig::{HeightField, Terrain};

use crate::curve::ease;
use crate::scene_file::{Ground, GroundKind};

/// Metres between the heights of a rugged piece.
const CELL: f32 = 0.25;
/// Metres: the longest waves of [`HeightField::hills`].
const HILLS: f32 = 24.0;

/// Pieces of ground. Where several lie over each other the highest counts; beyond all of them the
/// nearest one's border goes on. Heights are finite for every point, NaN included.
#[derive(Clone, Debug)]
pub struct GroundPieces {
    pieces: Vec<Piece>,
}

/// A piece and what it takes to answer quickly.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub ground: Ground,
    /// Cosine and sine of its yaw.
    turn: Vec2,
    pub field: Option<HeightField>,
}

impl GroundPieces {
    /// The ground of a scene that was checked; hills are made here.
    pub(crate) fn new(ground: &[Ground]) -> Self {
        Self { pieces: ground.iter().map(|&ground| Piece::new(ground)).collect() }
    }

    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }
}

impl Terrain for GroundPieces {
    fn height(&self, x: f32, z: f32) -> f32 {
        // Nothing is farther than a scene may reach; NaN becomes a place, too.
        let inside = |at: f32| if at.is_nan() { 0.0 } else { at.clamp(-1e5, 1e5) };
        let point = Vec2::new(inside(x), inside(z));
        let mut best = (f32::INFINITY, f32::NEG_INFINITY);
        for piece in &self.pieces {
            let (off, height) = piece.answer(point);
            if off < best.0 || (off == best.0 && height > best.1) {
                best = (off, height);
            }
        }
        if best.0.is_finite() { best.1 } else { 0.0 }
    }
}

impl Piece {
    fn new(ground: Ground) -> Self {
        let turn = Vec2::new(libm::cosf(ground.yaw), libm::sinf(ground.yaw));
        let field = match ground.kind {
            GroundKind::Rugged { rise, wave, seed, .. } => {
                Some(hills(ground.size, rise, wave, seed))
            }
            _ => None,
        };
        Self { ground, turn, field }
    }

    /// Squared distance of a point from the piece, and the height at the nearest point of it.
    fn answer(&self, point: Vec2) -> (f32, f32) {
        let off = point - Vec2::from(self.ground.place);
        // A yaw turns +Z towards +X; this turns back.
        let own = Vec2::new(
            off.x * self.turn.x - off.y * self.turn.y,
            off.x * self.turn.y + off.y * self.turn.x,
        );
        let half = Vec2::from(self.ground.size) * 0.5;
        let nearest = own.clamp(-half, half);
        (own.distance_squared(nearest), self.own_height(nearest))
    }

    /// Height at a point of its own frame.
    fn own_height(&self, at: Vec2) -> f32 {
        let along = at.y / self.ground.size[1] + 0.5;
        match self.ground.kind {
            GroundKind::Flat { height } => height,
            GroundKind::Rugged { height, .. } => {
                height + self.field.as_ref().map_or(0.0, |field| field.height(at.x, at.y))
            }
            GroundKind::Slope { from, to } => from + (to - from) * along,
            GroundKind::Steps { from, to, count } => {
                let step = ((along * count as f32) as u32).min(count - 1);
                step_height(from, to, count, step)
            }
        }
    }
}

/// Height of one of `count` steps, from 0.
pub(crate) fn step_height(from: f32, to: f32, count: u32, step: u32) -> f32 {
    from + (to - from) * step as f32 / (count - 1) as f32
}

/// Hills over a rectangle, 0 at its border.
fn hills(size: [f32; 2], rise: f32, wave: f32, seed: u32) -> HeightField {
    let scale = HILLS / wave;
    let side = (size[0].max(size[1]) * scale).clamp(1.0, 2048.0);
    let hills = HeightField::hills(u64::from(seed), side, rise).expect("a size that was checked");
    let [columns, rows] = size.map(|side| (side / CELL) as usize + 2);
    let mut heights = Vec::with_capacity(rows * columns);
    for row in 0..rows {
        for column in 0..columns {
            let place =
                |index: usize, count: usize| (index as f32 - (count - 1) as f32 / 2.0) * CELL;
            let (x, z) = (place(column, columns), place(row, rows));
            let fade = fade(x, size[0]) * fade(z, size[1]);
            heights.push(hills.height(x * scale, z * scale) * fade);
        }
    }
    HeightField::new(rows, columns, CELL, heights).expect("as many finite heights as places")
}

/// 0 from a cell inside the border on, so that the border itself is 0 between the heights, too; 1 from
/// a tenth of the size inward, smooth between.
fn fade(at: f32, size: f32) -> f32 {
    let t = ((0.5 * size - CELL - at.abs()) / (0.1 * size)).clamp(0.0, 1.0);
    ease(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    fn piece(place: [f32; 2], yaw: f32, size: [f32; 2], kind: GroundKind) -> Ground {
        Ground { place, yaw, size, kind }
    }

    #[test]
    fn the_highest_counts_and_the_nearest_goes_on() {
        let slope = GroundKind::Slope { from: 0.0, to: 2.0 };
        let ground = GroundPieces::new(&[
            piece([0.0, 0.0], 0.0, [10.0, 10.0], GroundKind::Flat { height: 0.5 }),
            piece([0.0, 10.0], 0.0, [10.0, 10.0], slope),
            piece([0.0, 0.0], 0.0, [1.0, 1.0], GroundKind::Flat { height: 0.2 }),
        ]);
        assert_eq!(ground.height(0.0, 0.0), 0.5);
        assert_eq!(ground.height(0.0, 10.0), 1.0);
        assert_eq!(ground.height(3.0, 100.0), 2.0);
        assert_eq!(ground.height(-70.0, 0.0), 0.5);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
            assert!(ground.height(bad, bad).is_finite() && ground.normal(bad, 0.0).is_finite());
        }
    }

    /// Turned by π/2, +Z of the piece lies along +X of the world.
    #[test]
    fn a_turned_slope_rises_along_x() {
        let slope = GroundKind::Slope { from: 0.0, to: 2.0 };
        let ground = GroundPieces::new(&[piece([5.0, 0.0], FRAC_PI_2, [4.0, 8.0], slope)]);
        assert!((ground.height(5.0, 1.0) - 1.0).abs() < 1e-5);
        assert!((ground.height(8.0, 0.0) - 1.75).abs() < 1e-5);
        assert!(ground.normal(5.0, 0.0).x < -0.2);
    }

    #[test]
    fn steps_and_hills_keep_to_their_heights() {
        let steps = GroundKind::Steps { from: 0.15, to: 0.6, count: 4 };
        let rugged = GroundKind::Rugged { height: 1.0, rise: 0.8, wave: 6.0, seed: 3 };
        let ground = GroundPieces::new(&[piece([0.0, 0.0], 0.0, [2.0, 4.0], steps)]);
        let heights = [-1.9, -0.9, 0.1, 1.1].map(|z| ground.height(0.0, z));
        for (height, expected) in heights.into_iter().zip([0.15, 0.3, 0.45, 0.6]) {
            assert!((height - expected).abs() < 1e-6);
        }
        let ground = GroundPieces::new(&[piece([0.0, 0.0], 0.3, [12.0, 20.0], rugged)]);
        let mut most = 0.0_f32;
        for i in 0..400 {
            let (x, z) = ((i % 20) as f32 - 10.0, (i / 20) as f32 - 10.0);
            let height = ground.height(x, z);
            assert!((1.0..=1.8).contains(&height), "{height}");
            most = most.max(height);
        }
        assert!(most > 1.3, "{most}");
        assert!((ground.height(90.0, 90.0) - 1.0).abs() < 1e-6);
    }
}
