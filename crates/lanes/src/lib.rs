//! Floats in lockstep: the same arithmetic on 1, 4, 8 or 16 numbers at a time.
//!
//! What is computed in one lane never depends on what is in the others, nor on how many there are:
//! only operations whose result IEEE 754 prescribes are used, products are never fused with sums,
//! and the functions of [`math`] are made of them. So every width gives the same bits.
//!
//! Code that shall run in lanes is generic over [`Simd`], all `#[inline(always)]` from a [`Job`]
//! down, and is started with [`Width::run`], which picks the instructions.

mod lanes;
pub mod math;
mod width;

pub use lanes::{Lanes, Mask};
pub use pulp::{Scalar, Simd, WithSimd as Job};
pub use width::Width;
