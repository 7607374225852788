//! Transforms of joints at one moment.

use glam::{Quat, Vec3};

use crate::Skeleton;

/// A rotation followed by a translation; no scale, no shear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Applied second.
    pub translation: Vec3,
    /// Unit quaternion, applied first.
    pub rotation: Quat,
}

impl Transform {
    /// Leaves everything where it is.
    pub const IDENTITY: Self = Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY };

    /// A rotation followed by a translation.
    pub const fn new(translation: Vec3, rotation: Quat) -> Self {
        Self { translation, rotation }
    }

    /// Where `point`, given in this frame, lies in the frame outside.
    pub fn transform_point(self, point: Vec3) -> Vec3 {
        self.rotation * point + self.translation
    }

    /// The transform that undoes this one.
    pub fn inverse(self) -> Self {
        let rotation = self.rotation.inverse();
        Self { translation: rotation * -self.translation, rotation }
    }

    /// Whether every number is finite.
    pub fn is_finite(self) -> bool {
        self.translation.is_finite() && self.rotation.is_finite()
    }

    /// Between `self` (`t` = 0) and `other` (`t` = 1): straight in translation, the shorter great
    /// arc in rotation.
    pub fn interpolate(self, other: Self, t: f32) -> Self {
        Self {
            translation: self.translation.lerp(other.translation, t),
            rotation: self.rotation.slerp(other.rotation, t),
        }
    }
}

/// `outer * inner`: first `inner`, then `outer`.
impl std::ops::Mul for Transform {
    type Output = Self;
    fn mul(self, inner: Self) -> Self {
        Self {
            translation: self.transform_point(inner.translation),
            rotation: self.rotation * inner.rotation,
        }
    }
}

/// One transform a joint, relative to the joint's parent; the root's is relative to the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// As many as the skeleton has joints, in its order.
    pub local: Vec<Transform>,
}

impl Pose {
    /// Offsets only, nothing rotated.
    pub fn rest(skeleton: &Skeleton) -> Self {
        let local = skeleton.joints().iter();
        Self { local: local.map(|j| Transform::new(j.offset.as_vec3(), Quat::IDENTITY)).collect() }
    }

    /// Forward kinematics: every joint's transform in the world.
    ///
    /// # Panics
    /// When the pose, the skeleton and `global` differ in length.
    pub fn to_global(&self, skeleton: &Skeleton, global: &mut [Transform]) {
        self.update_global(skeleton, 0, global);
    }

    /// [`Pose::to_global`] of the joints from `first` on: all that is needed after changing joints
    /// of which `first` is the foremost.
    ///
    /// # Panics
    /// When the pose, the skeleton and `global` differ in length.
    pub fn update_global(&self, skeleton: &Skeleton, first: usize, global: &mut [Transform]) {
        self.update_range(skeleton, first..skeleton.len(), global);
    }

    /// [`Pose::update_global`] of some joints: all that is needed where none behind them hangs on
    /// what was changed, as none of a leg's does on the other leg.
    ///
    /// # Panics
    /// When the pose, the skeleton and `global` differ in length, or the joints are not among them.
    pub fn update_range(
        &self,
        skeleton: &Skeleton,
        joints: std::ops::Range<usize>,
        global: &mut [Transform],
    ) {
        assert_eq!(self.local.len(), skeleton.len(), "pose and skeleton differ in joints");
        assert_eq!(global.len(), skeleton.len(), "buffer and skeleton differ in joints");
        let first = joints.start;
        for (index, joint) in (first..).zip(&skeleton.joints()[joints]) {
            global[index] = match joint.parent {
                Some(parent) => global[parent] * self.local[index],
                None => self.local[index],
            };
        }
    }

    /// Turns a joint so that its rotation in the world is `rotation`; its own transform in `global`
    /// follows, those of the joints it carries do not ([`Pose::update_global`] sees to them).
    pub fn turn_to(
        &mut self,
        skeleton: &Skeleton,
        joint: usize,
        rotation: Quat,
        global: &mut [Transform],
    ) {
        let parent = skeleton.joints()[joint].parent.map_or(Transform::IDENTITY, |p| global[p]);
        self.local[joint].rotation = (parent.rotation.inverse() * rotation).normalize();
        global[joint] = parent * self.local[joint];
    }

    /// The inverse of [`Pose::to_global`].
    ///
    /// # Panics
    /// When `global` and the skeleton differ in length.
    pub fn from_global(skeleton: &Skeleton, global: &[Transform]) -> Self {
        assert_eq!(global.len(), skeleton.len(), "transforms and skeleton differ in joints");
        let local = skeleton.joints().iter().zip(global);
        Self {
            local: local
                .map(|(joint, &own)| match joint.parent {
                    Some(parent) => global[parent].inverse() * own,
                    None => own,
                })
                .collect(),
        }
    }

    /// Sets `self` to the pose between `a` (`t` = 0) and `b` (`t` = 1), joint by joint; allocates
    /// nothing when the lengths agree.
    pub fn set_interpolated(&mut self, a: &Pose, b: &Pose, t: f32) {
        self.local.clear();
        let pairs = a.local.iter().zip(&b.local);
        self.local.extend(pairs.map(|(&a, &b)| a.interpolate(b, t)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Joint;
    use glam::DVec3;
    use std::f32::consts::FRAC_PI_2;

    fn arm() -> Skeleton {
        let joint =
            |name: &str, parent, offset| Joint { name: name.into(), parent, offset, tips: vec![] };
        Skeleton::new(vec![
            joint("shoulder", None, DVec3::new(0.0, 1.0, 0.0)),
            joint("elbow", Some(0), DVec3::new(1.0, 0.0, 0.0)),
            joint("wrist", Some(1), DVec3::new(1.0, 0.0, 0.0)),
        ])
        .unwrap()
    }

    #[test]
    fn forward_kinematics_turns_children_with_their_parents() {
        let skeleton = arm();
        let mut pose = skeleton.rest_pose();
        pose.local[0].rotation = Quat::from_rotation_z(FRAC_PI_2);
        pose.local[1].rotation = Quat::from_rotation_z(FRAC_PI_2);
        let mut global = vec![Transform::IDENTITY; 3];
        pose.to_global(&skeleton, &mut global);
        // The upper arm points up, the forearm back along -X.
        assert!(global[1].translation.abs_diff_eq(Vec3::new(0.0, 2.0, 0.0), 1e-6));
        assert!(global[2].translation.abs_diff_eq(Vec3::new(-1.0, 2.0, 0.0), 1e-6));
        let back = Pose::from_global(&skeleton, &global);
        for (a, b) in back.local.iter().zip(&pose.local) {
            assert!(a.translation.abs_diff_eq(b.translation, 1e-6));
            assert!(a.rotation.abs_diff_eq(b.rotation, 1e-6));
        }
    }

    #[test]
    fn a_joint_turns_to_a_rotation_of_the_world() {
        let skeleton = arm();
        let mut pose = skeleton.rest_pose();
        pose.local[0].rotation = Quat::from_rotation_z(0.4);
        let mut global = vec![Transform::IDENTITY; 3];
        pose.to_global(&skeleton, &mut global);
        let wanted = Quat::from_rotation_y(1.1);
        pose.turn_to(&skeleton, 1, wanted, &mut global);
        pose.update_global(&skeleton, 2, &mut global);
        let mut again = vec![Transform::IDENTITY; 3];
        pose.to_global(&skeleton, &mut again);
        assert_eq!(again, global);
        assert!(global[1].rotation.abs_diff_eq(wanted, 1e-6));
        let wrist = global[1].translation + wanted * Vec3::X;
        assert!(global[2].translation.abs_diff_eq(wrist, 1e-6));
    }

    #[test]
    fn inverse_undoes() {
        let t = Transform::new(Vec3::new(1.0, 2.0, 3.0), Quat::from_rotation_y(0.7));
        let identity = t.inverse() * t;
        assert!(identity.translation.abs_diff_eq(Vec3::ZERO, 1e-6));
        assert!(identity.rotation.abs_diff_eq(Quat::IDENTITY, 1e-6));
    }

    #[test]
    fn interpolation_takes_the_shorter_arc() {
        let a = Transform::new(Vec3::ZERO, Quat::from_rotation_y(0.1));
        let b = Transform::new(Vec3::X, -Quat::from_rotation_y(0.3)); // The same rotation, other sign.
        let middle = a.interpolate(b, 0.5);
        assert!(middle.rotation.angle_between(Quat::from_rotation_y(0.2)) < 1e-3);
        assert_eq!(middle.translation, Vec3::new(0.5, 0.0, 0.0));
    }
}
