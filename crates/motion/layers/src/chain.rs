//! The end of a spine or a tail to a point, over any number of joints.
//!
//! Source: Aristidou, Lasenby, "FABRIK: A fast, iterative solver for the Inverse Kinematics problem"
//! (Graphical Models 73, 2011). Joints' limits are kept in every forward pass, in which each joint
//! is turned the shortest way from where its pose has it in its parent's frame. Nothing of a pass
//! is left in the next but places, so no twist gathers, within a call or over calls.

use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Pose, Skeleton, Transform};
use serde::{Deserialize, Serialize};

use crate::joint_limit::{JointLimit, Link};
use crate::rotation::shortest;

/// How a chain is solved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ChainSettings {
    /// Most passes, back and forth; at least 1.
    pub iterations: u32,
    /// Near enough, metres.
    pub tolerance: f32,
    /// Which way a straight chain bulges when its end is pushed back along it, in the frame that its
    /// first joint hangs in.
    pub bulges: Vec3,
}

impl Default for ChainSettings {
    fn default() -> Self {
        Self { iterations: 64, tolerance: 1e-4, bulges: Vec3::Z }
    }
}

/// Why joints are not a chain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum ChainError {
    #[error("joint {0} is not a joint of the skeleton")]
    Joint(usize),
    #[error("'{last}' does not hang below '{first}'")]
    Apart { first: String, last: String },
    #[error("{turning} joints turn, but {limits} have limits")]
    Limits { turning: usize, limits: usize },
    #[error("limit {0}: cone and twist must be between 0 and π")]
    Limit(usize),
    #[error("the pose a chain is made from has {got} joints, the skeleton has {expected}")]
    Count { expected: usize, got: usize },
    #[error("'{0}' has no length to its next joint")]
    Length(String),
    #[error("at least 1 iteration, a tolerance above 0 and a finite way to bulge are needed")]
    Settings,
}

/// Joints that hang on each other, the first to the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    links: Vec<Link>,
    last: usize,
    settings: ChainSettings,
}

/// What solving needs besides the pose: kept between calls only to allocate nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainScratch {
    /// Of each joint, the last one included.
    places: Vec<Vec3>,
    /// Local, of the joints that turn.
    rotations: Vec<Quat>,
    lengths: Vec<f32>,
}

impl Chain {
    /// The joints from `first` to `last`, which is the end that is brought to a point and does not
    /// turn. `limits` are one a turning joint, from the first on, or none at all; they are measured
    /// from `rest`.
    ///
    /// # Errors
    /// Joints that do not hang on each other, limits that do not fit, and settings that cannot be
    /// used.
    pub fn new(
        skeleton: &Skeleton,
        [first, last]: [usize; 2],
        rest: &Pose,
        limits: &[JointLimit],
        settings: ChainSettings,
    ) -> Result<Self, ChainError> {
        let usable = settings.tolerance > 0.0 && settings.bulges.is_finite();
        if !usable || settings.iterations == 0 {
            return Err(ChainError::Settings);
        }
        let joints = skeleton.joints();
        if let Some(&wrong) = [first, last].iter().find(|&&joint| joint >= joints.len()) {
            return Err(ChainError::Joint(wrong));
        }
        if rest.local.len() != joints.len() {
            return Err(ChainError::Count { expected: joints.len(), got: rest.local.len() });
        }
        let names = || [first, last].map(|joint| joints[joint].name.clone());
        let apart = || {
            let [first, last] = names();
            ChainError::Apart { first, last }
        };
        let mut links = vec![];
        let mut below = last;
        while below != first {
            let joint = joints[below].parent.ok_or_else(apart)?;
            let bone = rest.local[below].translation.try_normalize();
            let bone = bone.ok_or_else(|| ChainError::Length(joints[joint].name.clone()))?;
            let rest = rest.local[joint].rotation;
            links.push(Link { joint, rest, bone, limit: JointLimit::FREE });
            below = joint;
        }
        links.reverse();
        if links.is_empty() {
            return Err(apart());
        }
        if !limits.is_empty() && limits.len() != links.len() {
            return Err(ChainError::Limits { turning: links.len(), limits: limits.len() });
        }
        let turns = 0.0..=std::f32::consts::PI;
        for (at, (link, limit)) in links.iter_mut().zip(limits).enumerate() {
            if !(turns.contains(&limit.cone) && turns.contains(&limit.twist)) {
                return Err(ChainError::Limit(at));
            }
            link.limit = *limit;
        }
        Ok(Self { links, last, settings })
    }

    /// Buffers for [`Chain::solve`].
    pub fn scratch(&self) -> ChainScratch {
        let turning = self.links.len();
        ChainScratch {
            places: vec![Vec3::ZERO; turning + 1],
            rotations: vec![Quat::IDENTITY; turning],
            lengths: vec![0.0; turning],
        }
    }

    /// Turns the joints so that the last one comes to `target`, or as near as it can; `weight` from
    /// 0 (the pose as it is) to 1 (all the way) is the share of each joint's turn. `global` holds
    /// the pose's transforms in the world and is kept up to date.
    ///
    /// False, and nothing changes, when a number is not finite.
    pub fn solve(
        &self,
        skeleton: &Skeleton,
        scratch: &mut ChainScratch,
        target: Vec3,
        weight: f32,
        pose: &mut Pose,
        global: &mut [Transform],
    ) -> bool {
        let joints = || self.links.iter().map(|link| link.joint).chain([self.last]);
        let finite = joints().all(|j| global[j].is_finite() && pose.local[j].is_finite());
        if !(finite && weight.is_finite() && target.length_squared().is_finite()) {
            return false;
        }
        let weight = weight.clamp(0.0, 1.0);
        if weight == 0.0 {
            return true;
        }
        let first = self.links[0].joint;
        let frame = skeleton.joints()[first].parent.map_or(Transform::IDENTITY, |p| global[p]);
        for (place, joint) in scratch.places.iter_mut().zip(joints()) {
            *place = global[joint].translation;
        }
        for (length, pair) in scratch.lengths.iter_mut().zip(scratch.places.windows(2)) {
            *length = pair[0].distance(pair[1]);
        }
        for (rotation, link) in scratch.rotations.iter_mut().zip(&self.links) {
            *rotation = pose.local[link.joint].rotation;
        }
        let target = self.set_out(scratch, frame, target);
        for _ in 0..self.settings.iterations {
            let end = scratch.places.len() - 1;
            if scratch.places[end].distance(target) < self.settings.tolerance {
                break;
            }
            backward(scratch, target);
            self.forward(scratch, frame, pose);
        }
        self.bend_the_rest(scratch, frame, target, pose);
        for (link, &rotation) in self.links.iter().zip(&scratch.rotations) {
            let local = &mut pose.local[link.joint].rotation;
            *local = local.slerp(rotation, weight).normalize();
        }
        pose.update_global(skeleton, first, global);
        true
    }

    /// Where to begin: along the line to a target that is out of reach, off the line that a straight
    /// chain is on (where no pass would ever bend it), else as it is. Answers the target in reach.
    fn set_out(&self, scratch: &mut ChainScratch, frame: Transform, target: Vec3) -> Vec3 {
        let ChainScratch { places, lengths, .. } = scratch;
        let (base, total) = (places[0], lengths.iter().sum::<f32>());
        let away = target - base;
        let line = away.normalize_or(frame.rotation * self.links[0].bone);
        if away.length() > total * (1.0 - 1e-4) {
            for (at, length) in lengths.iter().enumerate() {
                places[at + 1] = places[at] + line * *length;
            }
            // Not on the target yet: the passes turn the joints to these places.
            places[lengths.len()] += line * self.settings.tolerance * 2.0;
            return base + line * total;
        }
        let off = |place: &Vec3| (*place - base).reject_from_normalized(line).length();
        let bulge = places.iter().map(off).fold(0.0, f32::max);
        let bulges = (frame.rotation * self.settings.bulges).reject_from_normalized(line);
        let side = bulges.normalize_or(line.any_orthonormal_vector());
        // Half a wave that is about as long as the chain.
        let chord = away.length().max(0.3 * total);
        let high = (chord * (total - chord)).max(0.0).sqrt() * std::f32::consts::FRAC_2_PI;
        // What bulges by itself goes on from there.
        let straight = (1.0 - bulge / (0.25 * high).max(1e-9)).clamp(0.0, 1.0);
        let end = lengths.len();
        for (at, place) in places.iter_mut().enumerate().take(end) {
            let t = at as f32 / end as f32;
            let wave = away * t + side * (high * (std::f32::consts::PI * t).sin());
            *place = place.lerp(base + wave, straight);
        }
        target
    }

    /// What passes back and forth cannot reach because limits hold them up, joints bent one by one
    /// can, mostly (cyclic coordinate descent; Wang, Chen 1991): from the last to the first, each
    /// turns the end towards the target as far as it may.
    fn bend_the_rest(
        &self,
        scratch: &mut ChainScratch,
        frame: Transform,
        target: Vec3,
        pose: &Pose,
    ) {
        let ChainScratch { places, rotations, .. } = scratch;
        let end = self.links.len();
        let mut miss = places[end].distance(target);
        for _ in 0..self.settings.iterations {
            if miss < self.settings.tolerance {
                return;
            }
            let mut outer = rotations.iter().fold(frame.rotation, |outer, &own| outer * own);
            for at in (0..end).rev() {
                let own = outer;
                outer *= rotations[at].inverse();
                let turn = shortest(places[end] - places[at], target - places[at]);
                let drawn = pose.local[self.links[at].joint].rotation;
                let wanted = outer.inverse() * turn * own;
                rotations[at] = self.links[at].limited(drawn, wanted).normalize();
                let turned = outer * rotations[at] * own.inverse();
                let place = places[at];
                for after in &mut places[at + 1..] {
                    *after = place + turned * (*after - place);
                }
            }
            let before = std::mem::replace(&mut miss, places[end].distance(target));
            // As near as it gets.
            if before - miss < 0.01 * self.settings.tolerance {
                return;
            }
        }
    }

    /// From the first joint on: each turns towards the next one's place, as far as it may; places
    /// become those of the turned joints.
    fn forward(&self, scratch: &mut ChainScratch, mut frame: Transform, pose: &Pose) {
        let ChainScratch { places, rotations, .. } = scratch;
        for (at, link) in self.links.iter().enumerate() {
            let local = pose.local[link.joint];
            let own = frame * local;
            places[at] = own.translation;
            let next = self.links.get(at + 1).map_or(self.last, |next| next.joint);
            let bone = own.rotation * pose.local[next].translation;
            let turn = shortest(bone, places[at + 1] - own.translation);
            let turned = frame.rotation.inverse() * turn * own.rotation;
            rotations[at] = link.limited(local.rotation, turned).normalize();
            frame = frame * Transform::new(local.translation, rotations[at]);
            places[at + 1] = frame.transform_point(pose.local[next].translation);
        }
    }
}

/// From the target back: bones keep their lengths, the first joint does not keep its place.
fn backward(scratch: &mut ChainScratch, target: Vec3) {
    let ChainScratch { places, lengths, .. } = scratch;
    let end = lengths.len();
    places[end] = target;
    for at in (0..end).rev() {
        let bone = (places[at] - places[at + 1]).normalize_or_zero();
        places[at] = places[at + 1] + bone * lengths[at];
    }
}
