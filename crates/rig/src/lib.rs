//! The currency of the motion street: skeletons, poses, clips, axes and terrain.
//!
//! Conventions, everywhere inside Ambulo: right-handed, +Y up, +Z forward (so that a character's
//! left is +X), metres, seconds, radians, quaternions `(x, y, z, w)`. A [`Clip`] may hold a file's
//! own units and axes until it is converted with [`Axes`].
//!
//! Two precisions, on purpose: what comes from and goes to files ([`Skeleton`], [`Clip`]) is
//! `f64`, so that reading and writing again changes nothing; what runs every frame ([`Pose`],
//! [`Terrain`]) is `f32`.

mod angle;
mod axes;
mod clip;
mod halflife;
mod limb;
mod mirror;
mod palm;
mod pose;
mod prune;
mod retarget;
mod retarget_map;
mod roles;
mod skeleton;
mod stance;
mod terrain;

pub use angle::wrapped;
pub use axes::{Axes, AxesError, Axis, Conversion, Handedness};
pub use clip::{Clip, ClipError};
pub use halflife::share;
pub use limb::{bend_axis, two_bone, two_bone_to};
pub use mirror::{Mirror, MirrorError};
pub use palm::palm;
pub use pose::{Pose, Transform};
pub use retarget::{Retarget, RetargetError};
pub use roles::Roles;
pub use skeleton::{Joint, Skeleton, SkeletonError};
pub use stance::Stance;
pub use terrain::{Flat, HeightField, HeightFieldError, Terrain};

pub use glam;
