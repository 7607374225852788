//! Frames as float vectors, and back: the one encoder that the dataset builder and the runtime
//! controller share.
//!
//! A [`Layout`] is a list of named blocks for each of the two vectors. The structs [`Input`] and
//! [`Output`] hold the same things in Ambulo's own units: metres, seconds, radians, in the frame of
//! the character's root (on the ground under the hips, +Z along the character's facing, +X to its
//! left, +Y up). Only this crate knows a layout's units and the order of its numbers.

mod layout;
mod vectors;

pub use layout::{Block, GAITS, Layout, LayoutError, SAMPLES, WINDOW, gait};
pub use vectors::{FUTURE, Ground, Input, Output, Point};
