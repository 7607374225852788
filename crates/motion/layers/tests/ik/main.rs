//! Layers that bend limbs, spines and hips, on skeletons small enough to see what they must do.

mod chain;
mod hips;
mod look_at;
mod standing;
mod stepping;
mod two_bone;
mod walk;
mod walking;
