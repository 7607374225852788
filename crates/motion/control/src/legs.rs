//! Ankles where the network puts them, on bones of the skeleton's own length.

use ambulo_rig::glam::Vec3;
use ambulo_rig::{Pose, Skeleton, Transform, bend_axis, two_bone};

/// One leg by joint index, from the hip down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    upper: usize,
    lower: usize,
    foot: usize,
    /// What the leg bends about, in the frame of the lower joint.
    hinge: Vec3,
    /// Whether that is measured, not supposed.
    sure: bool,
}

impl Leg {
    /// The two bones above a foot; `None` where it has no two. `bent` has the transforms, in the
    /// root's frame, of a pose in which the leg is bent the way it can: knees forward, hocks back.
    /// (Skeletons agree on no axis of the joint's own frame that would tell.)
    pub fn above(skeleton: &Skeleton, foot: usize, bent: &[Transform]) -> Option<Self> {
        let lower = skeleton.joints()[foot].parent?;
        let upper = skeleton.joints()[lower].parent?;
        // The root is not a leg's bone: turning it would turn everything.
        skeleton.joints()[upper].parent?;
        let axis = bend_axis([upper, lower, foot].map(|joint| bent[joint].translation));
        // People's knees bend about their right.
        let hinge = bent[lower].rotation.inverse() * axis.unwrap_or(Vec3::NEG_X);
        Some(Self { upper, lower, foot, hinge, sure: axis.is_some() })
    }

    /// Bends the leg so that its foot comes to `ankle`, or as near as it can; the foot keeps its
    /// rotation in the world. `global` holds the pose's transforms and is kept up to date for the
    /// leg's three joints.
    pub fn reach(
        self,
        skeleton: &Skeleton,
        ankle: Vec3,
        pose: &mut Pose,
        global: &mut [Transform],
    ) {
        let place = |joint: usize| global[joint].translation;
        let (hip, knee, foot) = (place(self.upper), place(self.lower), place(self.foot));
        let hinge = global[self.lower].rotation * self.hinge;
        let [upper, lower] = two_bone([hip, knee, foot], ankle, hinge, self.sure);
        global[self.upper].rotation = (upper * global[self.upper].rotation).normalize();
        global[self.lower].rotation = (lower * global[self.lower].rotation).normalize();
        for joint in [self.upper, self.lower, self.foot] {
            let parent = global[skeleton.joints()[joint].parent.expect("legs hang on something")];
            let local = parent.rotation.inverse() * global[joint].rotation;
            pose.local[joint].rotation = local.normalize();
            global[joint].translation = parent.transform_point(pose.local[joint].translation);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ambulo_rig::Joint;
    use ambulo_rig::glam::{DVec3, Quat};
    use proptest::prelude::*;

    fn leg() -> (Skeleton, Leg) {
        let joint = |name: &str, parent, y| Joint {
            name: name.into(),
            parent,
            offset: DVec3::new(0.0, y, 0.0),
            tips: vec![],
        };
        let skeleton = Skeleton::new(vec![
            joint("hips", None, 1.0),
            joint("thigh", Some(0), -0.1),
            joint("shin", Some(1), -0.4),
            joint("foot", Some(2), -0.42),
        ])
        .unwrap();
        let leg = Leg::above(&skeleton, 3, &[Transform::IDENTITY; 4]).unwrap();
        (skeleton, leg)
    }

    #[test]
    fn only_feet_with_two_bones_below_the_root_have_legs() {
        let (skeleton, leg) = leg();
        assert_eq!(leg, Leg { upper: 1, lower: 2, foot: 3, hinge: Vec3::NEG_X, sure: false });
        let pose = [Transform::IDENTITY; 4];
        assert_eq!(Leg::above(&skeleton, 2, &pose), None);
        assert_eq!(Leg::above(&skeleton, 0, &pose), None);
    }

    /// A hind leg whose hock bends backward, on a skeleton whose joints' frames lie anyhow.
    #[test]
    fn a_straight_leg_bends_the_way_it_was_drawn() {
        let (skeleton, _) = leg();
        let turned = Quat::from_rotation_y(1.3) * Quat::from_rotation_z(0.4);
        for back in [-0.1, 0.1] {
            let at = [Vec3::Y, Vec3::new(0.0, 0.9, 0.0), Vec3::new(0.0, 0.5, back), Vec3::ZERO];
            let bent = at.map(|place| Transform::new(place, turned));
            let leg = Leg::above(&skeleton, 3, &bent).unwrap();
            let mut pose = skeleton.rest_pose();
            let mut global = vec![Transform::IDENTITY; 4];
            pose.to_global(&skeleton, &mut global);
            // Straight down, in frames that lie as they did in the bent pose.
            global[1..].iter_mut().for_each(|joint| joint.rotation = turned);
            leg.reach(&skeleton, Vec3::new(0.0, 0.25, 0.0), &mut pose, &mut global);
            // Where the knee went, from the turn of the upper bone.
            let knee = global[1].translation
                + global[1].rotation * turned.inverse() * Vec3::new(0.0, -0.4, 0.0);
            assert!(knee.z * back > 0.01, "{back}: {knee}");
        }
    }

    #[test]
    fn a_straight_leg_bends_its_knee_forward() {
        let (skeleton, leg) = leg();
        let mut pose = skeleton.rest_pose();
        let mut global = vec![Transform::IDENTITY; 4];
        pose.to_global(&skeleton, &mut global);
        leg.reach(&skeleton, Vec3::new(0.0, 0.25, 0.0), &mut pose, &mut global);
        pose.to_global(&skeleton, &mut global);
        assert!(global[2].translation.z > 0.1, "{}", global[2].translation);
        assert!(global[3].translation.abs_diff_eq(Vec3::new(0.0, 0.25, 0.0), 1e-3));
    }

    /// A knee drawn a little too straight, or too far, stays in front when the foot comes nearer.
    #[test]
    fn knees_do_not_bend_backward() {
        let (skeleton, _) = leg();
        let bent = |flex: f32| {
            let mut pose = skeleton.rest_pose();
            pose.local[1].rotation = Quat::from_rotation_x(-flex / 2.0);
            pose.local[2].rotation = Quat::from_rotation_x(flex);
            let mut global = vec![Transform::IDENTITY; 4];
            pose.to_global(&skeleton, &mut global);
            (pose, global)
        };
        let leg = Leg::above(&skeleton, 3, &bent(0.5).1).unwrap();
        let knee = |flex: f32| {
            let (mut pose, mut global) = bent(flex);
            let ankle = Vec3::new(0.02, 0.15, 0.03);
            leg.reach(&skeleton, ankle, &mut pose, &mut global);
            assert!(global[3].translation.abs_diff_eq(ankle, 1e-3), "{flex}: it arrives");
            let thigh = (global[1].rotation, global[2].rotation);
            (global[2].translation, thigh)
        };
        let mut before = knee(0.6);
        for step in 1..80 {
            let flex = 0.6 - 0.01 * step as f32;
            let now = knee(flex);
            assert!(now.0.z > 0.1, "{flex}: {}", now.0);
            // No jump, and no twist, as the drawn leg passes through straight.
            assert!(now.0.distance(before.0) < 0.01, "{flex}");
            for (a, b) in [(before.1.0, now.1.0), (before.1.1, now.1.1)] {
                assert!(a.angle_between(b) < 0.05, "{flex}: {}", a.angle_between(b));
            }
            before = now;
        }
    }

    proptest! {
        #[test]
        fn the_foot_arrives_and_keeps_its_rotation(
            target in prop::array::uniform3(-0.4..0.4f32), bend in 0.1..1.5f32, turn in -3.0..3.0f32,
        ) {
            let (skeleton, leg) = leg();
            let mut pose = skeleton.rest_pose();
            pose.local[0].rotation = Quat::from_rotation_y(turn);
            pose.local[1].rotation = Quat::from_rotation_x(-bend / 2.0);
            pose.local[2].rotation = Quat::from_rotation_x(bend);
            pose.local[3].rotation = Quat::from_rotation_z(0.3);
            let mut global = vec![Transform::IDENTITY; 4];
            pose.to_global(&skeleton, &mut global);
            let foot = global[3].rotation;
            let ankle = Vec3::from_array(target) + Vec3::new(0.0, 0.35, 0.0);
            prop_assume!(ankle.distance(global[1].translation) > 0.05);
            leg.reach(&skeleton, ankle, &mut pose, &mut global);
            let mut again = vec![Transform::IDENTITY; 4];
            pose.to_global(&skeleton, &mut again);
            prop_assert!(again[3].rotation.angle_between(foot) < 2e-3);
            let asked = ankle - global[1].translation;
            let reach = asked.length().min(0.82 * 0.9995);
            let expected = global[1].translation + asked.normalize() * reach;
            prop_assert!(again[3].translation.distance(expected) < 2e-3);
            for (a, b) in again.iter().zip(&global) {
                prop_assert!(a.translation.distance(b.translation) < 1e-4, "kept up to date");
            }
        }
    }
}
