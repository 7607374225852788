//! Tails that reach.

use ambulo_layers::{Chain, ChainError, ChainSettings, JointLimit};
use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Joint, Pose, Skeleton, Transform};
use proptest::prelude::*;

const LIMIT: JointLimit = JointLimit { cone: 0.7, twist: 0.2 };

/// A root and a tail of so many bones of 10 cm, along -Z.
fn tail(bones: usize) -> (Skeleton, Pose, Vec<Transform>) {
    let joint = |at: usize| Joint {
        name: format!("tail{at}"),
        parent: at.checked_sub(1),
        offset: if at < 2 { [0.0, 0.4, 0.0] } else { [0.0, 0.0, -0.1] }.into(),
        tips: vec![],
    };
    let skeleton = Skeleton::new((0..bones + 2).map(joint).collect()).unwrap();
    let (pose, mut global) = (skeleton.rest_pose(), vec![Transform::IDENTITY; bones + 2]);
    pose.to_global(&skeleton, &mut global);
    (skeleton, pose, global)
}

/// Bends every joint of a tail by an angle about an axis.
fn bend_all(skeleton: &Skeleton, pose: &mut Pose, global: &mut [Transform], turn: Quat) {
    let last = skeleton.len() - 1;
    pose.local[1..last].iter_mut().for_each(|joint| joint.rotation = turn);
    pose.to_global(skeleton, global);
}

/// How far a tail's joint is swung, and twisted about its bone, radians.
fn swing_twist(rotation: Quat) -> [f32; 2] {
    let swing = (rotation * Vec3::NEG_Z).angle_between(Vec3::NEG_Z);
    [swing, 2.0 * (rotation.z / rotation.w).atan().abs()]
}

fn chain(skeleton: &Skeleton, limits: &[JointLimit]) -> Chain {
    let ends = [1, skeleton.len() - 1];
    Chain::new(skeleton, ends, &skeleton.rest_pose(), limits, ChainSettings::default()).unwrap()
}

#[test]
fn what_is_not_a_chain_is_told() {
    let (skeleton, pose, _) = tail(3);
    let new = |ends, limits: &[JointLimit], settings| {
        Chain::new(&skeleton, ends, &pose, limits, settings).unwrap_err()
    };
    let usual = ChainSettings::default();
    let apart = ChainError::Apart { first: "tail3".into(), last: "tail2".into() };
    assert_eq!(new([3, 2], &[], usual), apart);
    assert!(matches!(new([3, 3], &[], usual), ChainError::Apart { .. }));
    assert_eq!(new([1, 9], &[], usual), ChainError::Joint(9));
    let limits = ChainError::Limits { turning: 3, limits: 1 };
    assert_eq!(new([1, 4], &[JointLimit::FREE], usual), limits);
    let nan = JointLimit { cone: f32::NAN, twist: 0.0 };
    assert_eq!(new([3, 4], &[nan], usual), ChainError::Limit(0));
    let none = ChainSettings { iterations: 0, ..usual };
    assert_eq!(new([1, 4], &[], none), ChainError::Settings);
}

#[test]
fn a_straight_tail_bulges_when_it_is_pushed() {
    let (skeleton, mut pose, mut global) = tail(6);
    let bulges = ChainSettings { bulges: Vec3::Y, ..ChainSettings::default() };
    let chain = Chain::new(&skeleton, [1, 7], &pose, &[], bulges).unwrap();
    let target = global[1].translation + Vec3::NEG_Z * 0.4;
    assert!(chain.solve(&skeleton, &mut chain.scratch(), target, 1.0, &mut pose, &mut global));
    assert!(global[7].translation.distance(target) < 1e-3, "{}", global[7].translation);
    let highest = global.iter().map(|joint| joint.translation.y).fold(0.0, f32::max);
    assert!(highest > 0.9, "{highest}");
}

#[test]
fn out_of_reach_it_points_there() {
    let (skeleton, mut pose, mut global) = tail(5);
    let chain = chain(&skeleton, &[]);
    let away = Vec3::new(1.0, 2.0, -2.0);
    let target = global[1].translation + away;
    chain.solve(&skeleton, &mut chain.scratch(), target, 1.0, &mut pose, &mut global);
    let farthest = global[1].translation + away.normalize() * 0.5;
    assert!(global[6].translation.distance(farthest) < 1e-3, "{}", global[6].translation);
}

/// Places that a tail within its limits is at are found again by most from a pose far off, and
/// the limits hold everywhere.
#[test]
fn limits_hold_and_what_they_allow_is_mostly_reached() {
    let (skeleton, rest, _) = tail(6);
    let chain = chain(&skeleton, &[LIMIT; 6]);
    let mut scratch = chain.scratch();
    let (mut seed, mut missed, mut worst) = (1u32, 0, 0.0f32);
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    for _ in 0..1000 {
        let (mut pose, mut global) = (rest.clone(), vec![Transform::IDENTITY; 8]);
        for joint in 1..7 {
            let turn = Vec3::new(random(), random(), 0.0) * 0.45;
            pose.local[joint].rotation = Quat::from_scaled_axis(turn);
        }
        pose.to_global(&skeleton, &mut global);
        let target = global[7].translation;
        pose.clone_from(&rest);
        pose.to_global(&skeleton, &mut global);
        chain.solve(&skeleton, &mut scratch, target, 1.0, &mut pose, &mut global);
        let miss = global[7].translation.distance(target);
        missed += u32::from(miss > 1e-3);
        worst = worst.max(miss);
        for joint in 1..7 {
            let [swing, twist] = swing_twist(pose.local[joint].rotation);
            assert!(swing < LIMIT.cone + 1e-3 && twist < LIMIT.twist + 1e-3);
        }
    }
    println!("{missed} of 1000 missed by more than 1 mm, the worst by {worst} m");
    assert!(missed < 20 && worst < 0.02, "{missed} missed, {worst} m");
}

#[test]
fn a_joint_drawn_past_its_limit_is_left_there() {
    let (skeleton, mut pose, mut global) = tail(3);
    let chain = chain(&skeleton, &[LIMIT; 3]);
    bend_all(&skeleton, &mut pose, &mut global, Quat::from_rotation_x(1.2));
    let before = pose.clone();
    let target = global[4].translation;
    chain.solve(&skeleton, &mut chain.scratch(), target, 1.0, &mut pose, &mut global);
    for (a, b) in pose.local.iter().zip(&before.local) {
        assert!(a.rotation.angle_between(b.rotation) < 1e-3);
    }
}

/// A spine that leans to a side goes on leaning there, however straight it is.
#[test]
fn what_is_nearly_straight_stays_where_it_is() {
    for bend in [0.0, 0.003, 0.01, 0.03, 0.1] {
        let (skeleton, mut pose, mut global) = tail(6);
        let chain = chain(&skeleton, &[]);
        bend_all(&skeleton, &mut pose, &mut global, Quat::from_rotation_y(bend));
        let (before, near) = (pose.clone(), Vec3::new(0.0, 5e-4, 0.0));
        let target = global[7].translation + near;
        chain.solve(&skeleton, &mut chain.scratch(), target, 1.0, &mut pose, &mut global);
        assert!(global[7].translation.distance(target) < 2e-4);
        for (now, before) in pose.local.iter().zip(&before.local) {
            let turned = (now.rotation * Vec3::NEG_Z).distance(before.rotation * Vec3::NEG_Z);
            assert!(turned < 0.02, "{bend}: {turned}");
        }
    }
}

#[test]
fn bad_numbers_and_no_weight_leave_the_pose_alone() {
    let (skeleton, mut pose, mut global) = tail(4);
    let chain = chain(&skeleton, &[]);
    let (before, mut scratch) = (pose.clone(), chain.scratch());
    let mut solve = |target, weight| {
        chain.solve(&skeleton, &mut scratch, target, weight, &mut pose, &mut global)
    };
    let (asked, far) = (Vec3::ONE, Vec3::splat(1e38));
    assert!(!solve(Vec3::NAN, 1.0) && !solve(far, 1.0) && !solve(asked, f32::NAN));
    assert!(solve(asked, 0.0));
    assert_eq!(pose, before);
}

proptest! {
    #[test]
    fn the_end_arrives_within_a_millimetre_and_nothing_twists(
        bones in 2..12usize, far in 0.2..0.98f32, to in prop::array::uniform3(-1.0..1.0f32),
        bent in -0.4..0.4f32,
    ) {
        let (skeleton, mut pose, mut global) = tail(bones);
        bend_all(&skeleton, &mut pose, &mut global, Quat::from_rotation_x(bent));
        let chain = chain(&skeleton, &[]);
        prop_assume!(Vec3::from_array(to).length() > 0.1);
        let away = Vec3::from_array(to).normalize() * (far * 0.1 * bones as f32);
        let target = global[1].translation + away;
        let mut scratch = chain.scratch();
        chain.solve(&skeleton, &mut scratch, target, 1.0, &mut pose, &mut global);
        let end = global[bones + 1].translation;
        prop_assert!(end.distance(target) < 1e-3, "{}", end.distance(target));
        let mut again = global.clone();
        pose.to_global(&skeleton, &mut again);
        prop_assert_eq!(again, global, "kept up to date");
    }

    #[test]
    fn nothing_twists(to in prop::array::uniform3(-0.5..0.5f32)) {
        let (skeleton, mut pose, mut global) = tail(6);
        let chain = chain(&skeleton, &[]);
        let target = global[1].translation + Vec3::from_array(to);
        let mut scratch = chain.scratch();
        chain.solve(&skeleton, &mut scratch, target, 1.0, &mut pose, &mut global);
        for joint in 1..7 {
            let [swing, twist] = swing_twist(pose.local[joint].rotation);
            prop_assert!(twist < 2e-3 || swing > 3.0, "{joint}");
        }
    }
}
