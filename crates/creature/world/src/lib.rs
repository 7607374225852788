//! The world of a body: make it, step it, look at it. There are two, behind one [`Stage`].
//!
//! [`Lockstep`] steps as many individuals of like bodies as a register has lanes, and is what
//! creatures are evolved in; [`World`] is Box2D's, slower, known to all, and what the first is held
//! against. Individuals do not see each other, nor do the parts of one, as in the seed's set-up
//! (Gegendorfer 2017, section 4.2); only the ground is touched. The same calls give the same bits on
//! every run, and what an individual does never depends on who shares its world.
//!
//! Metres, kilograms, seconds, radians; x forward, y up, angles counter-clockwise.

mod ground;
mod lockstep;
mod physics;
mod stage;
mod world;

pub use ground::{Ground, Outline};
pub use lockstep::Lockstep;
pub use physics::{Physics, PhysicsError, Solver, Water};
pub use stage::Stage;
pub use world::{Pose, Saved, World, WorldError};
