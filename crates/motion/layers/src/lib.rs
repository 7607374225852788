//! Pose to pose: what is laid over a character's motion, one job a file.
//!
//! Every layer takes a pose and makes another one in the caller's buffers; none allocates while a
//! character moves, none keeps anything but its own state, and none feeds back into whoever made the
//! pose. Lengths in metres, times in seconds, angles in radians, rotations as unit quaternions; local
//! transforms as in [`ambulo_rig::Pose`]. Where something decays it is told by its half-life, so that
//! nothing depends on the frame rate.

mod balls;
mod blend;
mod blend_space;
mod blend_tree;
mod chain;
mod foot;
mod foot_hold;
mod foot_placement;
mod foot_step;
mod hips;
mod inertialise;
mod joint_limit;
mod look_at;
mod mask;
mod motion;
mod player;
mod refused;
mod rotation;
mod smooth;
mod tree_builder;
mod tree_state;
mod two_bone;

pub use blend::{Layer, additive, cross_fade, difference, weighted};
pub use blend_space::{BlendSpace1, BlendSpace2, SpaceError};
pub use blend_tree::{Amount, BlendTree, Node, Sample, TreeError, TreeProblem};
pub use chain::{Chain, ChainError, ChainScratch, ChainSettings};
pub use foot_placement::{FeetState, FootError, FootPlacement, FootSettings, Ground};
pub use foot_step::StepSettings;
pub use hips::{Hips, HipsError, HipsSettings, HipsState, MOST_LIMBS, Want};
pub use inertialise::{Decay, Inertialiser};
pub use joint_limit::JointLimit;
pub use look_at::{LookAt, LookError, LookJoint, LookSettings, LookState};
pub use mask::{Mask, MaskError, Part};
pub use motion::{GroundStep, Mark, Marks, Motion, MotionError, Phase};
pub use player::{Playback, Played, Player};
pub use refused::Refused;
pub use tree_state::{TreeState, TreeStep};
pub use two_bone::{Limb, LimbError, LimbSettings, Pole, Reach, Span};
