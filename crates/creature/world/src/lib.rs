//! The Box2D world of a body: make it, step it, look at it.
//!
//! [`World`] holds one or several individuals of one body on a [`Ground`]. Individuals do not see
//! each other, nor do the parts of one, as in the seed's set-up (Gegendorfer 2017, section 4.2);
//! only the ground is touched. The same calls give the same bits on every run, and what an
//! individual does never depends on who shares its world.
//!
//! Metres, kilograms, seconds, radians; x forward, y up, angles counter-clockwise.

mod ground;
mod physics;
mod world;

pub use ground::{Ground, Outline};
pub use physics::{Physics, PhysicsError};
pub use world::{Pose, Saved, World, WorldError};
