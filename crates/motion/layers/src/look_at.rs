//! A head that looks at a point, with neck and spine taking their shares of the turn.
//!
//! The turn is a yaw about the body's up axis and a pitch, relative to where the motion looks, so
//! that heads stay level and what the motion does with its head stays on top. Each joint takes its
//! share as far as its limit lets it and leaves the rest to the others. Behind the character the
//! turn fades, and straight above and below it the yaw, since the other way round would be as good.

use ambulo_rig::glam::{Quat, Vec2, Vec3};
use ambulo_rig::{Pose, Skeleton, Transform, wrapped};
use serde::{Deserialize, Serialize};

use crate::smooth::{smoothstep, spring};

/// What one joint contributes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LookJoint {
    /// Index into the skeleton.
    pub joint: usize,
    /// Of the turn, relative to the other joints' shares; above 0.
    pub share: f32,
    /// Greatest yaw and pitch either way that it adds, radians.
    pub limit: [f32; 2],
}

/// How a head turns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LookSettings {
    /// Of the way to the wanted turn, seconds.
    pub halflife: f32,
    /// Angles from straight ahead, radians: the turn fades from the first to the second, beyond
    /// which the head is left to the motion.
    pub behind: [f32; 2],
    /// Where the eyes are, from the last joint, along the character's axes in the pose that the
    /// layer is made from; metres.
    pub eyes: Vec3,
}

impl Default for LookSettings {
    fn default() -> Self {
        Self { halflife: 0.12, behind: [2.1, 2.8], eyes: Vec3::new(0.0, 0.08, 0.08) }
    }
}

/// Why a head cannot be turned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum LookError {
    #[error("no joint is to turn")]
    Empty,
    #[error("joint {0} is not a joint of the skeleton, or the root")]
    Joint(usize),
    #[error("'{below}' does not hang below '{above}'")]
    Apart { above: String, below: String },
    #[error("'{0}': its share must be above 0, its limits from 0 to π")]
    Share(String),
    #[error("the pose the layer is made from has {got} joints, the skeleton has {expected}")]
    Count { expected: usize, got: usize },
    #[error("half-life and eyes must be finite, and 'behind' go up within 0 and π")]
    Settings,
}

/// Joints that look, from the lowest to the head.
#[derive(Clone, Debug, PartialEq)]
pub struct LookAt {
    joints: Vec<LookJoint>,
    /// What the first joint hangs on: the body that "ahead" and "behind" are told from.
    body: usize,
    /// From the frame of that joint to the character's axes.
    upright: Quat,
    /// The character's forward axis and the eyes, in the frame of the last joint.
    gaze: Vec3,
    eyes: Vec3,
    settings: LookSettings,
}

/// How far a head is turned.
#[derive(Clone, Debug, PartialEq)]
pub struct LookState {
    /// Yaw and pitch relative to the motion, radians.
    turn: Vec2,
    /// Radians a second.
    speed: Vec2,
    /// How far the turn itself has moved the eyes, in the character's axes.
    moved: Vec3,
    /// What each joint takes, kept only to allocate nothing.
    taken: Vec<Vec2>,
}

impl LookAt {
    /// Joints that hang on each other (there may be others in between), the head the last. `rest`
    /// has the transforms in the world of a pose in which the character stands upright and looks
    /// straight ahead, along +Z.
    ///
    /// # Errors
    /// Joints that do not hang on each other, shares and settings that cannot be used.
    pub fn new(
        skeleton: &Skeleton,
        joints: &[LookJoint],
        rest: &[Transform],
        settings: LookSettings,
    ) -> Result<Self, LookError> {
        let [fades, gone] = settings.behind;
        let ordered = 0.0 <= fades && fades <= gone && gone <= std::f32::consts::PI;
        let halflife = settings.halflife >= 0.0 && settings.halflife.is_finite();
        if !(ordered && halflife && settings.eyes.is_finite()) {
            return Err(LookError::Settings);
        }
        if rest.len() != skeleton.len() {
            return Err(LookError::Count { expected: skeleton.len(), got: rest.len() });
        }
        let (first, head) = joints.first().zip(joints.last()).ok_or(LookError::Empty)?;
        let parent = |joint: usize| skeleton.joints().get(joint).and_then(|joint| joint.parent);
        let name = |joint: usize| skeleton.joints()[joint].name.clone();
        for look in joints {
            if parent(look.joint).is_none() {
                return Err(LookError::Joint(look.joint));
            }
            let fits = |limit: f32| (0.0..=std::f32::consts::PI).contains(&limit);
            let share = look.share > 0.0 && look.share.is_finite();
            if !(share && look.limit.into_iter().all(fits)) {
                return Err(LookError::Share(name(look.joint)));
            }
        }
        for pair in joints.windows(2) {
            let [above, below] = [pair[0].joint, pair[1].joint];
            if !std::iter::successors(parent(below), |&joint| parent(joint)).any(|j| j == above) {
                return Err(LookError::Apart { above: name(above), below: name(below) });
            }
        }
        let body = parent(first.joint).ok_or(LookError::Joint(first.joint))?;
        let inward = rest[head.joint].rotation.inverse();
        Ok(Self {
            joints: joints.to_vec(),
            body,
            upright: rest[body].rotation.inverse(),
            gaze: inward * Vec3::Z,
            eyes: inward * settings.eyes,
            settings,
        })
    }

    /// A head where the motion has it.
    pub fn state(&self) -> LookState {
        LookState {
            turn: Vec2::ZERO,
            speed: Vec2::ZERO,
            moved: Vec3::ZERO,
            taken: vec![Vec2::ZERO; self.joints.len()],
        }
    }

    /// Turns on by `dt` seconds towards `target`, in the world; without one, back to where the
    /// motion looks. `weight` from 0 to 1 is how much of the turn is wanted. `global` holds the
    /// pose's transforms in the world and is kept up to date.
    ///
    /// False, and nothing changes, when a number is not finite or `dt` is negative.
    #[allow(clippy::too_many_arguments)] // The caller's buffers, and what is asked.
    pub fn step(
        &self,
        skeleton: &Skeleton,
        state: &mut LookState,
        target: Option<Vec3>,
        weight: f32,
        dt: f32,
        pose: &mut Pose,
        global: &mut [Transform],
    ) -> bool {
        let head = global[self.joints[self.joints.len() - 1].joint];
        let finite = head.is_finite()
            && self.joints.iter().all(|look| global[look.joint].is_finite())
            && global[self.body].is_finite()
            && target.is_none_or(|place| place.length_squared().is_finite());
        if !(finite && weight.is_finite() && dt >= 0.0 && dt.is_finite()) {
            return false;
        }
        // From the world to the character's axes: +Y up its body, +Z ahead.
        let outward = global[self.body].rotation * self.upright;
        let inward = outward.inverse();
        let drawn = angles(inward * (head.rotation * self.gaze));
        let eyes = head.transform_point(self.eyes) + outward * state.moved;
        let wanted = target.map_or(Vec2::ZERO, |place| {
            self.wanted(inward * (place - eyes), drawn) * weight.clamp(0.0, 1.0)
        });
        let wanted = self.share_out(wanted, &mut state.taken);
        let LookSettings { halflife, .. } = self.settings;
        (state.turn, state.speed) = spring(state.turn, state.speed, wanted, halflife, dt);
        state.turn = self.share_out(state.turn, &mut state.taken);
        if state.turn.length() < 1e-6 {
            state.moved = Vec3::ZERO;
            return true;
        }
        self.turn(skeleton, &state.taken, [outward, inward], drawn, pose, global);
        let head = global[self.joints[self.joints.len() - 1].joint];
        let seen = head.transform_point(self.eyes);
        state.moved = inward * (seen - (eyes - outward * state.moved));
        true
    }

    /// The turn from where the motion looks to `away`, in the character's axes.
    fn wanted(&self, away: Vec3, drawn: Vec2) -> Vec2 {
        // Nearer than the head is wide, there is nothing to look at.
        let distance = away.length();
        let near = smoothstep(0.05, 0.2, distance);
        let to = angles(away);
        // Right above and below every yaw is as good, and nothing is behind.
        let beside = smoothstep(0.0, 0.5, away.with_y(0.0).length() / distance.max(1e-6));
        let [fades, gone] = self.settings.behind;
        let ahead = 1.0 - smoothstep(fades, gone, to.x.abs()) * beside;
        Vec2::new(wrapped(to.x - drawn.x) * beside, to.y - drawn.y) * (ahead * near)
    }

    /// What each joint takes of a turn, and what they take together: less than all of it where they
    /// are at their limits.
    fn share_out(&self, turn: Vec2, taken: &mut [Vec2]) -> Vec2 {
        let mut left = turn;
        let mut shares: f32 = self.joints.iter().map(|look| look.share).sum();
        for (look, taken) in self.joints.iter().zip(taken.iter_mut()) {
            let limit = Vec2::from_array(look.limit);
            *taken = (left * (look.share / shares)).clamp(-limit, limit);
            left -= *taken;
            shares = (shares - look.share).max(1e-6);
        }
        // What joints at their limit leave, the others take, those near the head first.
        for (look, taken) in self.joints.iter().zip(taken.iter_mut()).rev() {
            let limit = Vec2::from_array(look.limit);
            let more = (*taken + left).clamp(-limit, limit) - *taken;
            *taken += more;
            left -= more;
        }
        turn - left
    }

    fn turn(
        &self,
        skeleton: &Skeleton,
        taken: &[Vec2],
        [outward, inward]: [Quat; 2],
        drawn: Vec2,
        pose: &mut Pose,
        global: &mut [Transform],
    ) {
        let back = facing(drawn).inverse();
        let mut sum = Vec2::ZERO;
        // As much as the joint above is turned already, in the world.
        let mut carried = Quat::IDENTITY;
        for (look, taken) in self.joints.iter().zip(taken) {
            sum += *taken;
            let all = outward * facing(drawn + sum) * back * inward;
            let rotation = all * carried.inverse() * global[look.joint].rotation;
            pose.turn_to(skeleton, look.joint, rotation, global);
            pose.update_global(skeleton, look.joint + 1, global);
            carried = all;
        }
    }
}

/// Yaw (0 along +Z, positive towards +X) and pitch (positive up) of a direction.
fn angles(direction: Vec3) -> Vec2 {
    let flat = direction.with_y(0.0).length();
    Vec2::new(direction.x.atan2(direction.z), direction.y.atan2(flat))
}

/// Turns +Z to a yaw and a pitch, with the horizon level.
fn facing(angles: Vec2) -> Quat {
    Quat::from_rotation_y(angles.x) * Quat::from_rotation_x(-angles.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_joint_cannot_take_the_others_do() {
        let look = |share, yaw| LookJoint { joint: 1, share, limit: [yaw, 0.5] };
        let layer = LookAt {
            joints: vec![look(1.0, 0.3), look(2.0, 0.6), look(3.0, 0.9)],
            body: 0,
            upright: Quat::IDENTITY,
            gaze: Vec3::Z,
            eyes: Vec3::ZERO,
            settings: LookSettings::default(),
        };
        let mut taken = [Vec2::ZERO; 3];
        assert_eq!(layer.share_out(Vec2::new(0.6, 0.0), &mut taken).x, 0.6);
        assert!((taken[0].x - 0.1).abs() < 1e-6 && (taken[2].x - 0.3).abs() < 1e-6);
        let most = layer.share_out(Vec2::new(-1.75, 0.0), &mut taken).x;
        assert!((most + 1.75).abs() < 1e-5, "{most}");
        assert!(layer.share_out(Vec2::new(3.0, 0.0), &mut taken).x < 1.8001);
        // The head's limit is reached last, and those before it are asked again.
        let stiff = LookAt { joints: vec![look(1.0, 0.8), look(1.0, 0.1)], ..layer };
        assert!((stiff.share_out(Vec2::new(0.6, 0.0), &mut taken[..2]).x - 0.6).abs() < 1e-6);
        assert!((taken[0].x - 0.5).abs() < 1e-6);
    }
}
