//! Motion files: bytes → [`Clip`](ambulo_rig::Clip) and back, one module a format.
//!
//! A reader leaves a clip in the file's own units and axes. What those are is reported by
//! [`detect`] and applied by nobody but the caller. A reader that had to bend a rule says so in a
//! [`Note`]; what it cannot read it refuses with a [`ReadError`] that names line and column.
//!
//! Nothing but [`files`] touches the file system. No reader allocates more than a small multiple
//! of its input, and none recurses, whatever the input says of itself.

pub mod amc;
pub mod bvh;
pub mod detect;
mod error;
mod euler;
pub mod files;
pub mod keys;
mod text;

pub use error::{Note, ReadError};

use ambulo_rig::glam::{DQuat, DVec3};

/// How a file is read; every reader takes from it what concerns its format.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// Mend what can be mended without guessing at motion, and say each time what was done. Off,
    /// a file that is not whole is refused.
    pub repair: bool,
    /// What a position channel of a BVH file means; [`detect`] reports which one fits.
    pub positions: Positions,
    /// Frames a second of formats that do not store a rate (AMC).
    pub fps: f64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { repair: false, positions: Positions::Replace, fps: 120.0 }
    }
}

/// What a position channel does to a joint's offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Positions {
    /// It takes the offset's place, as in Blender.
    Replace,
    /// It is added to the offset, as in three.js.
    Add,
}

/// More joints than this are refused; game rigs have hundreds.
const MOST_JOINTS: usize = 10_000;

/// How many frames a reader may hold: 16 MiB and 64 times the size of its input.
///
/// Joints without channels cost memory in every frame and not a byte in the file, so that without
/// this bound a small file could ask for any amount.
fn most_frames(input: usize, joints: usize, moving: usize) -> usize {
    let frame = joints * size_of::<DQuat>() + moving * size_of::<DVec3>();
    ((16 << 20) + input.saturating_mul(64)) / frame.max(1)
}
