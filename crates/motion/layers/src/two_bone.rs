//! Hands and feet to a point: elbows and knees bent in closed form.
//!
//! Near full extension the end is slowed down before it gets there, so that a knee does not snap
//! straight: with D the farthest that the flexion allows and s = `softness` × the limb's length, an
//! end asked to be at the distance d > D − s comes to D − s·exp(−(d − (D − s)) / s). That continues
//! d with the same slope and nears D without reaching it (Nicholas, "Soft IK", 2009). An end asked
//! to be at D is s / e short of it.

use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Pose, Skeleton, Transform, bend_axis, two_bone_to};
use serde::{Deserialize, Serialize};

use crate::rotation::shortest;

/// How a limb may bend.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LimbSettings {
    /// Least and greatest angle between the two bones, radians; 0 is straight.
    pub flexion: [f32; 2],
    /// Share of the limb's length over which its end is slowed down; 0: not at all.
    pub softness: f32,
    /// Which way the middle joint points where the pose that the limb is made from does not tell
    /// because it is straight there; in that pose's world.
    pub points: Vec3,
}

impl LimbSettings {
    /// Knees point forward and bend up to 150°.
    pub const LEG: Self = Self { flexion: [0.06, 2.62], softness: 0.03, points: Vec3::Z };
    /// Elbows point back and bend up to 150°.
    pub const ARM: Self = Self { points: Vec3::NEG_Z, ..Self::LEG };
}

impl Default for LimbSettings {
    fn default() -> Self {
        Self::LEG
    }
}

/// Why joints are not a limb.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum LimbError {
    #[error("joint {0} is not a joint of the skeleton")]
    Joint(usize),
    #[error("'{0}' needs two bones above it that hang on another joint")]
    Short(String),
    #[error("the pose a limb is made from has {got} joints, the skeleton has {expected}")]
    Count { expected: usize, got: usize },
    #[error("a bone above '{0}' has no length")]
    Length(String),
    #[error("flexion must go up from 0 or more to π or less, not from {0} to {1}")]
    Flexion(f32, f32),
    #[error("softness must be between 0 and 0.5, not {0}")]
    Softness(f32),
    #[error("the way that the middle joint points must be finite and not zero")]
    Points,
}

/// What the middle joint bends towards, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Pole {
    Point(Vec3),
    Direction(Vec3),
}

/// What is asked of a limb's end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// In the world, metres.
    pub position: Vec3,
    /// In the world; without one the end keeps the rotation that it has in the world.
    pub rotation: Option<Quat>,
    /// Without one the limb stays in the plane in which it bends already. The nearer a pole lies to
    /// the limb's own line, the less it says.
    pub pole: Option<Pole>,
    /// 0 leaves the pose as it is, 1 does all; clamped. In between the end is on the way, about the
    /// limb's first joint.
    pub weight: f32,
}

/// Distances from a limb's first joint to its end, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// At the greatest flexion.
    pub nearest: f32,
    /// The end arrives exactly up to here …
    pub exact: f32,
    /// … and never quite comes here, at the least flexion.
    pub farthest: f32,
}

impl Span {
    /// Where an end that is asked to be at `distance` comes to.
    pub fn reached(&self, distance: f32) -> f32 {
        let soft = self.farthest - self.exact;
        if distance <= self.exact {
            return distance.max(self.nearest);
        }
        self.farthest - soft * (-(distance - self.exact) / soft.max(1e-9)).exp()
    }
}

/// Two bones: shoulder, elbow and wrist, or hip, knee and ankle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limb {
    joints: [usize; 3],
    /// Behind the last joint that hangs on the first one.
    behind: usize,
    /// What it bends about when straight, in the frame of the middle joint.
    hinge: Vec3,
    /// Whether that is measured, not supposed.
    sure: bool,
    settings: LimbSettings,
}

impl Limb {
    /// The two bones above `end`. `bent` has the transforms in the world of a pose in which the limb
    /// is bent the way it can, knees forward, elbows back, on a character that faces +Z.
    ///
    /// # Errors
    /// Joints that are not two bones below another joint, and settings that cannot be used.
    pub fn new(
        skeleton: &Skeleton,
        end: usize,
        bent: &[Transform],
        settings: LimbSettings,
    ) -> Result<Self, LimbError> {
        let [least, most] = settings.flexion;
        if !(0.0 <= least && least < most && most <= std::f32::consts::PI) {
            return Err(LimbError::Flexion(least, most));
        }
        if !(0.0..=0.5).contains(&settings.softness) {
            return Err(LimbError::Softness(settings.softness));
        }
        if !(settings.points.is_finite() && settings.points.length() > 1e-3) {
            return Err(LimbError::Points);
        }
        if bent.len() != skeleton.len() {
            return Err(LimbError::Count { expected: skeleton.len(), got: bent.len() });
        }
        let name = &skeleton.joints().get(end).ok_or(LimbError::Joint(end))?.name;
        let above = |joint: usize| {
            skeleton.joints()[joint].parent.ok_or_else(|| LimbError::Short(name.clone()))
        };
        let lower = above(end)?;
        let upper = above(lower)?;
        // The root is not a limb's bone: turning it would turn everything.
        above(upper)?;
        let [a, b, c] = [upper, lower, end].map(|joint| bent[joint].translation);
        // Asked this way round, NaN is refused as well.
        if !(a.distance(b) > 1e-3 && b.distance(c) > 1e-3) {
            return Err(LimbError::Length(name.clone()));
        }
        let drawn = bend_axis([a, b, c]);
        let supposed = || (c - a).cross(settings.points).normalize_or(Vec3::NEG_X);
        let hinge = bent[lower].rotation.inverse() * drawn.unwrap_or_else(supposed);
        let mut hangs = vec![false; skeleton.len()];
        for (index, joint) in skeleton.joints().iter().enumerate() {
            hangs[index] = index == upper || joint.parent.is_some_and(|parent| hangs[parent]);
        }
        let behind = hangs.iter().rposition(|&hangs| hangs).unwrap_or(upper) + 1;
        Ok(Self { joints: [upper, lower, end], behind, hinge, sure: drawn.is_some(), settings })
    }

    /// Behind the last joint that hangs on the limb.
    pub(crate) fn behind(&self) -> usize {
        self.behind
    }

    /// First, middle and end joint.
    pub fn joints(&self) -> [usize; 3] {
        self.joints
    }

    /// How far the end can be from the first joint on bones as long as they are in `global`.
    pub fn span(&self, global: &[Transform]) -> Span {
        let [a, b, c] = self.joints.map(|joint| global[joint].translation);
        let (upper, lower) = (a.distance(b), b.distance(c));
        let [farthest, nearest] = self.settings.flexion.map(|flexion| {
            let squared = upper * upper + lower * lower + 2.0 * upper * lower * flexion.cos();
            squared.max(0.0).sqrt().max((upper - lower).abs() + 1e-4)
        });
        let exact = (farthest - self.settings.softness * (upper + lower)).max(nearest);
        Span { nearest, exact, farthest }
    }

    /// Bends the limb so that its end comes to where it is asked to be, or as near as it can.
    /// `global` holds the pose's transforms in the world and is kept up to date.
    ///
    /// False, and nothing changes, when a number is not finite.
    pub fn reach(
        &self,
        skeleton: &Skeleton,
        asked: &Reach,
        pose: &mut Pose,
        global: &mut [Transform],
    ) -> bool {
        let chain = self.joints.map(|joint| global[joint].translation);
        if !(chain.iter().all(|place| place.is_finite()) && asked.is_finite()) {
            return false;
        }
        let weight = asked.weight.clamp(0.0, 1.0);
        if weight == 0.0 {
            return true;
        }
        let [upper, lower, end] = self.joints;
        let rotation = asked.rotation.map_or(global[end].rotation, |rotation| {
            global[end].rotation.slerp(rotation.normalize(), weight)
        });
        let turns = self.turns(chain, asked, weight, global);
        let [first, second] =
            [turns[0] * global[upper].rotation, turns[1] * global[lower].rotation];
        pose.turn_to(skeleton, upper, first, global);
        pose.turn_to(skeleton, lower, second, global);
        pose.turn_to(skeleton, end, rotation, global);
        pose.update_range(skeleton, upper + 1..self.behind, global);
        true
    }

    /// Turns in the world of the two bones.
    fn turns(
        &self,
        chain: [Vec3; 3],
        asked: &Reach,
        weight: f32,
        global: &[Transform],
    ) -> [Quat; 2] {
        let [a, b, c] = chain;
        let now = (c - a).normalize_or(Vec3::NEG_Y);
        // A target in the first joint itself lies in no direction: the end stays in its own.
        let wanted = (asked.position - a).try_normalize().unwrap_or(now);
        // Swung first: the plane it bends in comes along, however far that is.
        let swing = Quat::IDENTITY.slerp(shortest(now, wanted), weight);
        let line = (swing * now).normalize();
        let [b, c] = [b, c].map(|place| a + swing * (place - a));
        let hinge = swing * (global[self.joints[1]].rotation * self.hinge);
        let reached = self.span(global).reached(a.distance(asked.position));
        let drawn = a.distance(c);
        let distance = drawn + (reached - drawn) * weight;
        let target = a + line * distance;
        let bent = two_bone_to([a, b, c], target, distance, hinge, self.sure);
        let pole = match asked.pole {
            None => return bent.map(|turn| turn * swing),
            Some(Pole::Point(point)) => point - a,
            Some(Pole::Direction(direction)) => direction,
        };
        let angle = about(line, bent[0] * (b - a), bent[0] * hinge, pole);
        let roll = Quat::from_axis_angle(line, angle * weight);
        bent.map(|turn| roll * turn * swing)
    }
}

/// How far to turn a limb about its unit `line` so that its middle, now at `middle` from its first
/// joint, comes to the side of `pole`. Elbows keep bending about their own hinge that way.
fn about(line: Vec3, middle: Vec3, hinge: Vec3, pole: Vec3) -> f32 {
    let mut now = middle.reject_from_normalized(line);
    if now.length() < 1e-3 * middle.length() {
        now = hinge.cross(line);
    }
    let wanted = pole.normalize_or_zero().reject_from_normalized(line);
    // A pole within 6° of the line fades: right on it, it lies to no side.
    let say = (wanted.length() / 0.1).min(1.0);
    line.dot(now.cross(wanted)).atan2(now.dot(wanted)) * say
}

impl Reach {
    /// An end at a place, with all weight.
    pub fn at(position: Vec3) -> Self {
        Self { position, rotation: None, pole: None, weight: 1.0 }
    }

    fn is_finite(&self) -> bool {
        let pole = match self.pole {
            Some(Pole::Point(v) | Pole::Direction(v)) => v.is_finite(),
            None => true,
        };
        // Squares of what is asked must be finite, too.
        let near = self.position.length_squared().is_finite();
        let turned = self.rotation.is_none_or(|r| r.is_finite() && r.length() > 1e-3);
        near && turned && pole && self.weight.is_finite()
    }
}
