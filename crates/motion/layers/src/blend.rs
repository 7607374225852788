//! One pose out of several.
//!
//! All of these work joint by joint on local transforms; the root's translation is one like any
//! other. Weights of a mask multiply those of its pose. What is not finite is refused and leaves
//! `out` as it was. Nothing is allocated when `out` has the joints already.

use ambulo_rig::glam::{Quat, Vec3, Vec4};
use ambulo_rig::{Pose, Transform};

use crate::refused::{check, check_mask, check_number};
use crate::rotation::shorter;
use crate::{Mask, Refused};

/// A weight below counts as none: sums and their normalisation stay within what `f32` can hold.
const LEAST: f32 = 1e-6;

/// Greatest weight; more is a mistake.
const MOST: f32 = 1e6;

/// A pose that takes part in [`weighted`].
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// What it adds.
    pub pose: &'a Pose,
    /// 0 to 10⁶, relative to those of the others; below 10⁻⁶ is none.
    pub weight: f32,
    /// On which joints; `None`: on all.
    pub mask: Option<&'a Mask>,
}

/// From `a` (`t` = 0 or less, or outside the mask) to `b` (`t` = 1 or more): straight in
/// translation, the shorter great arc in rotation. Both ends are exact.
///
/// # Errors
/// Poses or a mask that differ in joints, a number that is not finite.
pub fn cross_fade(
    a: &Pose,
    b: &Pose,
    t: f32,
    mask: Option<&Mask>,
    out: &mut Pose,
) -> Result<(), Refused> {
    let joints = a.local.len();
    check(a, joints)?;
    check(b, joints)?;
    check_mask(mask, joints)?;
    check_number(t, f32::MIN, f32::MAX)?;
    let t = t.clamp(0.0, 1.0);
    let pairs = a.local.iter().zip(&b.local).enumerate();
    out.local.clear();
    out.local.extend(pairs.map(|(joint, (&a, &b))| match t * share(mask, joint) {
        0.0 => a,
        1.0 => b,
        t => a.interpolate(b, t),
    }));
    Ok(())
}

/// The mean of any number of poses by their weights, which need not add up to 1; a joint on which
/// no weight lies takes that of `rest`, one on which a single pose has weight is exactly that pose's.
///
/// Rotations are added up as quaternions, each with the sign that turns it to the side of the sum
/// so far (so that the sum never shrinks), and normalised: the first step towards their mean on the
/// sphere (Markley et al., "Averaging Quaternions", 2007), good to a few percent of the angle for
/// rotations less than a quarter turn apart.
///
/// # Errors
/// Poses or masks that differ in joints from `rest`, a weight out of range, a number that is not
/// finite.
pub fn weighted<'a, L>(layers: L, rest: &Pose, out: &mut Pose) -> Result<(), Refused>
where
    L: IntoIterator<Item = Layer<'a>>,
    L::IntoIter: Clone,
{
    let layers = layers.into_iter();
    let joints = rest.local.len();
    check(rest, joints)?;
    for layer in layers.clone() {
        check(layer.pose, joints)?;
        check_mask(layer.mask, joints)?;
        check_number(layer.weight, 0.0, MOST)?;
    }
    out.local.clear();
    out.local.extend(rest.local.iter().enumerate().map(|(joint, &rest)| {
        let own = layers.clone();
        mean(own.map(|l| (l.pose.local[joint], l.weight * share(l.mask, joint)))).unwrap_or(rest)
    }));
    Ok(())
}

/// What must be added to `reference` to get `pose`: translations in the parent's frame, rotations
/// in the joint's own, so that a nod stays a nod on a head that is turned.
///
/// # Errors
/// Poses that differ in joints, a number that is not finite.
pub fn difference(pose: &Pose, reference: &Pose, out: &mut Pose) -> Result<(), Refused> {
    let joints = reference.local.len();
    check(reference, joints)?;
    check(pose, joints)?;
    let pairs = pose.local.iter().zip(&reference.local);
    out.local.clear();
    out.local.extend(pairs.map(|(pose, reference)| Transform {
        translation: pose.translation - reference.translation,
        rotation: (reference.rotation.inverse() * pose.rotation).normalize(),
    }));
    Ok(())
}

/// Adds a share of a [`difference`] to `base`; a weight of 1 adds it as it is, more exaggerates it
/// and less than 0 turns it around.
///
/// # Errors
/// Poses or a mask that differ in joints, a weight beyond ±10⁶, a number that is not finite.
pub fn additive(
    base: &Pose,
    difference: &Pose,
    weight: f32,
    mask: Option<&Mask>,
    out: &mut Pose,
) -> Result<(), Refused> {
    let joints = base.local.len();
    check(base, joints)?;
    check(difference, joints)?;
    check_mask(mask, joints)?;
    check_number(weight, -MOST, MOST)?;
    let pairs = base.local.iter().zip(&difference.local).enumerate();
    out.local.clear();
    out.local.extend(pairs.map(|(joint, (&base, &more))| {
        let weight = weight * share(mask, joint);
        if weight == 0.0 { base } else { added(base, more, weight) }
    }));
    Ok(())
}

fn added(base: Transform, more: Transform, weight: f32) -> Transform {
    let turn = match weight {
        1.0 => more.rotation,
        _ => Quat::from_scaled_axis(shorter(more.rotation).to_scaled_axis() * weight),
    };
    Transform {
        translation: base.translation + more.translation * weight,
        rotation: (base.rotation * turn).normalize(),
    }
}

fn mean(weighted: impl Iterator<Item = (Transform, f32)>) -> Option<Transform> {
    let (mut place, mut turn, mut total) = (Vec3::ZERO, Vec4::ZERO, 0.0);
    let mut single = None;
    for (joint, weight) in weighted.filter(|(_, weight)| *weight >= LEAST) {
        single = (total == 0.0).then_some(joint);
        let rotation = Vec4::from(joint.rotation);
        let side = if turn.dot(rotation) < 0.0 { -weight } else { weight };
        turn += rotation * side;
        place += joint.translation * weight;
        total += weight;
    }
    let mean = || Transform::new(place / total, Quat::from_vec4(turn).normalize());
    (total > 0.0).then(|| single.unwrap_or_else(mean))
}

fn share(mask: Option<&Mask>, joint: usize) -> f32 {
    mask.map_or(1.0, |mask| mask.weights()[joint])
}

#[cfg(test)]
mod tests;
