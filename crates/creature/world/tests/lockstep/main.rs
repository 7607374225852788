//! What makes the lockstep solver honest: who shares a register does not matter, energy does not come
//! from nothing, joints and ground hold, and the levels are Box2D's.

#[path = "../common/mod.rs"]
mod common;
mod play;

mod agreement;
mod energy;
mod ground;
mod holding;
mod lying;
mod widths;
