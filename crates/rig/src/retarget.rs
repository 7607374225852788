//! The motion of one humanoid on another: other proportions, other counts of joints, other rest.
//!
//! A bone of the target turns in the world as its counterpart does, G = G_s · S⁻¹ · A · T, with S and
//! T the world rotations of source and target in their stances and A what lays the target's bone
//! along the source's there: arms in A meet arms in T. Trunks of unequal counts share the bend by
//! length. The pelvis moves, and the feet are, as the source's times the ratio of the legs; knees are
//! bent so that a foot that stands, stands. Rotations only: no bone changes its length.

use glam::{Quat, Vec3};

use crate::retarget_map::{Link, links};
use crate::stance::Body;
use crate::{Clip, ClipError, Pose, Skeleton, Stance, Transform, two_bone_to};

/// A foot that is this near to where it should be is left as it is, metres.
const THERE: f32 = 1e-5;
/// Most that the hips are lowered for a foot that is out of reach, as a share of the leg.
const MOST_LOWERED: f32 = 0.05;

/// Why motion cannot go from one skeleton to another.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum RetargetError {
    #[error("the skeleton that motion comes from has {0}")]
    From(&'static str),
    #[error("the skeleton that motion goes to has {0}")]
    To(&'static str),
    #[error("the clip's skeleton is not the one that motion comes from")]
    OtherSkeleton,
    #[error("as a pose, the clip has numbers that are not finite: {0}")]
    TooLarge(#[from] ClipError),
}

/// A leg of the target.
#[derive(Clone, Copy, Debug)]
struct Leg {
    /// Thigh, shin, foot.
    joints: [usize; 3],
    lengths: [f32; 2],
    /// From the hips to the thigh, in the frame of the hips.
    thigh: Vec3,
    /// From the ankle to the point that the foot is placed by, in the frame of the foot.
    ball: Vec3,
    /// Which of the links turns the foot.
    link: usize,
    /// The source's thigh, with what undoes its rotation in the stance, and the joint that its foot
    /// is placed by.
    source_thigh: (usize, Quat),
    source_ball: usize,
}

/// Carries poses from one skeleton to another. Its scratch is inside: one for each thread.
#[derive(Clone, Debug)]
pub struct Retarget {
    from: Skeleton,
    to: Skeleton,
    links: Vec<Link>,
    legs: [Leg; 2],
    hips: usize,
    /// Which of the links turns the hips.
    hips_link: usize,
    /// Whether both have a root above the hips.
    roots: bool,
    scale: f32,
    /// From the floor to what a foot that stands is placed by: source, target.
    heights: [f32; 2],
    stance: Vec<Transform>,
    source: Vec<Transform>,
    global: Vec<Transform>,
}

impl Retarget {
    /// Both stances must be humanoids in metres that stand upright and face +Z, with hips and two
    /// legs of two bones each. Trunk, head, arms and toes are carried over where both have them; what
    /// has no counterpart stays as it is in the target's stance, under its parent.
    ///
    /// # Errors
    /// What one of them lacks, or a stance in which it does not stand.
    pub fn new(from: &Stance<'_>, to: &Stance<'_>) -> Result<Self, RetargetError> {
        let source = from.body().map_err(RetargetError::From)?;
        let target = to.body().map_err(RetargetError::To)?;
        let toes = source.toes.is_some() && target.toes.is_some();
        let links = links(from, to, [&source, &target]);
        let stance = to.skeleton.joints().iter().zip(&to.local);
        let stance = stance.map(|(joint, &turn)| Transform::new(joint.offset.as_vec3(), turn));
        let height = |body: &Body| if toes { body.sole } else { body.ankle };
        let link = |joint| links.iter().position(|link| link.to == joint).expect("it is linked");
        let undo = |joint: usize| from.global[joint].rotation.inverse();
        let leg = |side: usize| {
            let (joints, theirs) = (target.legs[side], source.legs[side]);
            let of =
                |body: &Body| body.toes.filter(|_| toes).map_or(body.legs[side][2], |t| t[side]);
            let frame = |joint: usize, point: usize| {
                to.global[joint].rotation.inverse() * (to.at(point) - to.at(joint))
            };
            Leg {
                joints,
                lengths: target.lengths[side],
                thigh: frame(target.hips, joints[0]),
                ball: frame(joints[2], of(&target)),
                link: link(joints[2]),
                source_thigh: (theirs[0], undo(theirs[0])),
                source_ball: of(&source),
            }
        };
        Ok(Self {
            legs: [leg(0), leg(1)],
            hips: target.hips,
            hips_link: link(target.hips),
            roots: source.hips > 0 && target.hips > 0,
            scale: target.stature / source.stature,
            heights: [height(&source), height(&target)],
            stance: stance.collect(),
            source: from.global.clone(),
            global: to.global.clone(),
            from: from.skeleton.clone(),
            to: to.skeleton.clone(),
            links,
        })
    }

    /// What places are multiplied by: the target's height from floor to thighs over the source's.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// The skeleton that poses are made for.
    pub fn skeleton(&self) -> &Skeleton {
        &self.to
    }

    /// Writes the target's pose; allocates nothing when `to` has its joints already.
    ///
    /// Places are multiplied by [`Retarget::scale`] about the origin, which lies on the floor: give
    /// poses of a moving character in a frame on the ground below it.
    ///
    /// # Panics
    /// When `from` has not as many joints as the skeleton that motion comes from.
    pub fn pose(&mut self, from: &Pose, to: &mut Pose) {
        from.to_global(&self.from, &mut self.source);
        let ankles = self.legs.map(|leg| self.ankle(&leg));
        let hips = self.pelvis(ankles);
        to.local.clear();
        to.local.extend_from_slice(&self.stance);
        let mut links = self.links.iter().peekable();
        for (index, joint) in self.to.joints().iter().enumerate() {
            let parent = joint.parent.map_or(Transform::IDENTITY, |parent| self.global[parent]);
            let local = &mut to.local[index];
            if let Some(link) = links.next_if(|link| link.to == index) {
                local.rotation = (parent.rotation.inverse() * link.turn(&self.source)).normalize();
            }
            if index == self.hips {
                local.translation = parent.inverse().transform_point(hips);
            } else if index == 0 && self.roots {
                local.translation = self.source[0].translation * self.scale;
            }
            self.global[index] = parent * *local;
        }
        for (leg, ankle) in self.legs.iter().zip(ankles) {
            leg.place(ankle, &self.to, &self.source, to, &mut self.global);
        }
    }

    /// The whole clip at once, to the precision of [`Pose`].
    ///
    /// # Errors
    /// A clip of another skeleton, or one with numbers that no `f32` holds.
    pub fn clip(&mut self, clip: &Clip) -> Result<Clip, RetargetError> {
        if *clip.skeleton() != self.from {
            return Err(RetargetError::OtherSkeleton);
        }
        let moving = if self.roots { vec![0, self.hips] } else { vec![self.hips] };
        let (mut from, mut to) = (self.from.rest_pose(), self.to.rest_pose());
        let mut rotations = Vec::with_capacity(clip.frames() * self.to.len());
        let mut translations = Vec::with_capacity(clip.frames() * moving.len());
        for frame in 0..clip.frames() {
            clip.frame(frame, &mut from);
            self.pose(&from, &mut to);
            rotations.extend(to.local.iter().map(|joint| joint.rotation.as_dquat()));
            let moved = moving.iter().map(|&joint| to.local[joint].translation.as_dvec3());
            translations.extend(moved);
        }
        let time = clip.frame_time();
        Ok(Clip::new(self.to.clone(), time, moving, translations, rotations)?)
    }

    /// Where an ankle goes, so that the foot stands where the source's does.
    fn ankle(&self, leg: &Leg) -> Vec3 {
        let [theirs, ours] = self.heights;
        let ball = self.source[leg.source_ball].translation;
        let ball = (ball - Vec3::Y * theirs) * self.scale + Vec3::Y * ours;
        ball - self.links[leg.link].turn(&self.source) * leg.ball
    }

    /// Where the hips go: the middle between the thighs is the source's, and lower where a foot
    /// would be out of reach.
    fn pelvis(&self, ankles: [Vec3; 2]) -> Vec3 {
        let middle = |[a, b]: [Vec3; 2]| 0.5 * (a + b);
        let turn = self.links[self.hips_link].turn(&self.source);
        let thighs = self.legs.map(|leg| turn * leg.thigh);
        let theirs = self.legs.map(|leg| self.source[leg.source_thigh.0].translation);
        let hips = middle(theirs) * self.scale - middle(thighs);
        let lowered = |side: usize| {
            let length: f32 = self.legs[side].lengths.iter().sum();
            let down = hips + thighs[side] - ankles[side];
            let across = down.with_y(0.0).length_squared();
            let most = (length * length - across).max(0.0).sqrt();
            // Of rounding alone no hips are lowered.
            let missing = if down.length() > length * (1.0 + 1e-5) { down.y - most } else { 0.0 };
            missing.clamp(0.0, MOST_LOWERED * length)
        };
        hips - Vec3::Y * lowered(0).max(lowered(1))
    }
}

impl Leg {
    /// Bends the knee so that the ankle is there; the foot keeps its rotation in the world.
    fn place(
        &self,
        ankle: Vec3,
        skeleton: &Skeleton,
        source: &[Transform],
        pose: &mut Pose,
        global: &mut [Transform],
    ) {
        let chain = self.joints.map(|joint| global[joint].translation);
        if chain[2].distance(ankle) < THERE {
            return;
        }
        let [upper, lower] = self.lengths;
        let nearest = (upper - lower).abs() + 1e-4;
        let farthest = (upper + lower) * 0.99999;
        let reach = chain[0].distance(ankle).clamp(nearest.min(farthest), farthest);
        let (thigh, undo) = self.source_thigh;
        let hinge = source[thigh].rotation * undo * Vec3::NEG_X;
        let turns = two_bone_to(chain, ankle, reach, hinge, true);
        let turned = self.joints.map(|joint| global[joint].rotation);
        let wanted = [turns[0] * turned[0], turns[1] * turned[1], turned[2]];
        for (&joint, wanted) in self.joints.iter().zip(wanted) {
            pose.turn_to(skeleton, joint, wanted, global);
            pose.update_global(skeleton, joint + 1, global);
        }
    }
}
