//! Acclaim's ASF (skeleton) and AMC (motion), as CMU's motion capture library has them.
//!
//! A bone turns about its own axes, R = C·M·C⁻¹ with C the bone's `axis` and M its degrees of
//! freedom, each list turning first what it names first. The clip's frames are parallel to the
//! world's at rest, as everywhere here; a joint sits where its parent's bone ends, and a bone
//! without children ends in a tip.
//!
//! Lengths are the file's divided by its `length` unit, which makes them inches.

mod asf;
mod motion;

use ambulo_rig::Clip;

pub use asf::Asf;

use crate::{Note, ReadError, ReadOptions};

/// What a pair of files holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Amc {
    /// In inches where the skeleton has a unit of length, Y up.
    pub clip: Clip,
    /// 0.0254 where the skeleton has a unit of length.
    pub metres_per_unit: Option<f64>,
    /// What was odd or mended.
    pub notes: Vec<Note>,
}

/// Reads a motion on the skeleton that it was recorded with.
///
/// The format stores no frame rate: [`ReadOptions::fps`] is taken, with a note, unless the file
/// has the line `:SAMPLES-PER-SECOND`.
///
/// # Errors
/// A file that is not AMC, not whole or not of that skeleton, with line and column.
/// [`ReadOptions::repair`] cuts an incomplete end.
pub fn read(skeleton: &Asf, amc: &[u8], options: &ReadOptions) -> Result<Amc, ReadError> {
    motion::read(skeleton, amc, options)
}
