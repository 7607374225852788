//! Where a hand takes hold.

use glam::{Mat3, Quat, Vec3};

use crate::{Roles, Skeleton, Stance, Transform};

/// From the wrist along the fingers, as a share of the hand's length.
const ALONG: f32 = 0.63;
/// From the wrist's height down to the skin of the palm, metres.
const DEPTH: f32 = 0.02;
/// What is shorter is no hand but its first bone, metres.
const LEAST: f32 = 0.05;

/// The palm of a hand (0 left, 1 right) in the frame of its wrist: fingers along +Z, back of the
/// hand +Y, origin on the palm's skin, metres. `None` for a skeleton without such an arm.
///
/// At rest the hand continues the forearm with its back up (T, or as far up as A lets it). A hand is
/// as long as the farthest that the wrist carries is away; where that is less than 5 cm, half as
/// long as the forearm.
///
/// # Panics
/// When `side` is neither, or a role's joint is none of the skeleton's.
pub fn palm(skeleton: &Skeleton, roles: &Roles, side: usize) -> Option<Transform> {
    let stance = Stance::rest(skeleton).with_roles(*roles);
    let [_, elbow, wrist] = stance.arm(side)?;
    let forearm = stance.global[wrist].translation - stance.global[elbow].translation;
    let fingers = forearm.try_normalize()?;
    let far = stance.farthest(wrist).map_or(0.0, Vec3::length);
    let length = if far >= LEAST { far } else { 0.5 * forearm.length() };
    // Of an arm that hangs straight down the back of the hand is outside.
    let out = if side == 0 { Vec3::X } else { Vec3::NEG_X };
    let up = Vec3::Y.reject_from_normalized(fingers);
    let back = if up.length() > 0.1 { up } else { out.reject_from_normalized(fingers) };
    let back = back.normalize();
    let turn = Mat3::from_cols(back.cross(fingers), back, fingers);
    let origin = fingers * (ALONG * length) - back * DEPTH;
    Some(Transform::new(origin, Quat::from_mat3(&turn)))
}
