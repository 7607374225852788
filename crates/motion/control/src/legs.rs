//! Ankles where the network puts them, on bones of the skeleton's own length.

use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Pose, Skeleton, Transform};

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

/// Sine of the angle between the upper bone and the leg's whole line, below which a bend tells
/// little of where the knee goes: legs are often straight within a network's error, and a knee that
/// is a degree on the wrong side must not be bent on that side when the foot comes nearer.
const STRAIGHT: f32 = 0.1;

impl Leg {
    /// The two bones above a foot; `None` where it has no two. `bent` has the transforms, in the
    /// root's frame, of a pose in which the leg is bent the way it can: knees forward, hocks back.
    /// (Skeletons agree on no axis of the joint's own frame that would tell.)
    pub fn above(skeleton: &Skeleton, foot: usize, bent: &[Transform]) -> Option<Self> {
        let lower = skeleton.joints()[foot].parent?;
        let upper = skeleton.joints()[lower].parent?;
        // The root is not a leg's bone: turning it would turn everything.
        skeleton.joints()[upper].parent?;
        let [a, b, c] = [upper, lower, foot].map(|joint| bent[joint].translation.as_dvec3());
        let across = (c - a).cross(b - a);
        // Bends of less than a degree tell nothing; people's knees bend about their right.
        let clear = across.length() > 0.01 * (c - a).length() * (b - a).length();
        let axis = if clear { across.normalize().as_vec3() } else { Vec3::NEG_X };
        let hinge = bent[lower].rotation.inverse() * axis;
        Some(Self { upper, lower, foot, hinge, sure: clear })
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

/// Turns, in the world, of the upper and the lower bone of a chain a–b–c that bring c to `target`
/// in the plane in which it bends already; `hinge` is the axis to bend about when it is straight,
/// and, if that is `sure`, the more so the nearer to straight it is, or bent the wrong way.
fn two_bone([a, b, c]: [Vec3; 3], target: Vec3, hinge: Vec3, sure: bool) -> [Quat; 2] {
    let (upper, lower) = (a.distance(b), b.distance(c));
    // Written so that NaN is refused too: clamping needs ordered bounds.
    let long = |length: f32| length > 1e-4 && length.is_finite();
    if ![upper, lower, a.distance(target), a.distance(c)].into_iter().all(long) {
        return [Quat::IDENTITY; 2];
    }
    let nearest = (upper - lower).abs() + 1e-4;
    let farthest = (upper + lower) * 0.9995;
    let reach = a.distance(target).clamp(nearest.min(farthest), farthest);
    // Law of cosines: the angles at a and at b, as they are and as they must be.
    let opposite = |side: f32, p: f32, q: f32| {
        ((p * p + q * q - side * side) / (2.0 * p * q)).clamp(-1.0, 1.0).acos()
    };
    let now = a.distance(c);
    let at_a = opposite(lower, reach, upper) - opposite(lower, now, upper);
    let at_b = opposite(reach, upper, lower) - opposite(now, upper, lower);
    let across = (c - a).cross(b - a);
    let straight = across.length() < 1e-3 * upper * now;
    let bend = across.dot(hinge) / (upper * now);
    if sure && !straight && bend < STRAIGHT {
        let drawn = (bend / STRAIGHT).max(0.0);
        let axis = (across / (upper * now) / STRAIGHT).lerp(hinge, 1.0 - drawn);
        return toward([a, b, c], target, reach, axis);
    }
    let axis = if straight { hinge.normalize_or(Vec3::X) } else { across.normalize() };
    let swing = Quat::from_rotation_arc((c - a).normalize(), (target - a).normalize());
    let upper = swing * Quat::from_axis_angle(axis, at_a);
    [upper, upper * Quat::from_axis_angle(axis, at_b)]
}

/// The turns that bring c to `reach` from a, towards `target`, with b on the side that bending
/// about `axis` puts it; the bones twist as little as they can.
fn toward([a, b, c]: [Vec3; 3], target: Vec3, reach: f32, axis: Vec3) -> [Quat; 2] {
    let (upper, lower) = (a.distance(b), b.distance(c));
    let line = (target - a).normalize();
    let pole = axis.cross(line).normalize_or(line.any_orthonormal_vector());
    let along = (upper * upper + reach * reach - lower * lower) / (2.0 * reach);
    let knee = line * along + pole * (upper * upper - along * along).max(0.0).sqrt();
    let first = Quat::from_rotation_arc((b - a) / upper, knee.normalize_or(line));
    let shin = (line * reach - knee).normalize_or(line);
    let second = Quat::from_rotation_arc(first * ((c - b) / lower), shin);
    [first, second * first]
}

#[cfg(test)]
mod tests {
    use super::*;
    use ambulo_rig::Joint;
    use ambulo_rig::glam::DVec3;
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

    #[test]
    fn numbers_that_are_none_leave_the_leg_alone() {
        for bad in [f32::NAN, f32::INFINITY, 1e38] {
            let far = Vec3::splat(bad);
            for chain in [[far; 3], [Vec3::Y, Vec3::ZERO, far]] {
                assert_eq!(two_bone(chain, far, Vec3::X, true), [Quat::IDENTITY; 2]);
            }
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
