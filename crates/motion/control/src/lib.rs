//! From what a player wants to the pose of a character: the run-time loop of the PFNN.
//!
//! A [`Controller`] holds one character. Each [`Controller::step`] takes any `dt`, runs fixed steps
//! inside (the bundle says how many a second) and interpolates between the last two poses, so that
//! a caller at 30, 60 or 144 frames a second sees the same path. The network's own pose stays
//! private; the caller gets a copy, and nothing done to it comes back.
//!
//! Source: Holden, Komura, Saito, "Phase-Functioned Neural Networks for Character Control"
//! (SIGGRAPH 2017), sections 5 and 6, and the behaviour of its published demo.

mod areas;
mod controller;
mod feet;
mod idle;
mod intent;
mod legs;
mod model;
mod stance;
mod trajectory;
mod tuning;

pub use areas::{Areas, CrouchArea, JumpArea, Wall, World};
pub use controller::{Controller, Event, Held, Root, Step};
pub use intent::{Gait, Intent};
pub use model::{ControlError, Feet, Model};
pub use trajectory::{NOW, TrajectoryPoint, WINDOW_POINTS};
pub use tuning::Tuning;
