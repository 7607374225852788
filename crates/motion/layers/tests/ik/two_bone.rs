//! Arms that reach.

use ambulo_layers::{Limb, LimbError, LimbSettings, Pole, Reach};
use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Joint, Pose, Skeleton, Transform};
use proptest::prelude::*;

/// An arm to the left: straight, and with the elbow bent back by `flexion`.
fn arm(flexion: f32) -> (Skeleton, Pose, Vec<Transform>) {
    let joint = |name: &str, parent, offset: [f64; 3]| Joint {
        name: name.into(),
        parent,
        offset: offset.into(),
        tips: vec![],
    };
    let skeleton = Skeleton::new(vec![
        joint("chest", None, [0.0, 1.3, 0.0]),
        joint("arm", Some(0), [0.15, 0.1, 0.0]),
        joint("forearm", Some(1), [0.3, 0.0, 0.0]),
        joint("hand", Some(2), [0.25, 0.0, 0.0]),
        joint("finger", Some(3), [0.1, 0.0, 0.0]),
    ])
    .unwrap();
    let mut pose = skeleton.rest_pose();
    pose.local[1].rotation = Quat::from_rotation_y(flexion / 2.0);
    pose.local[2].rotation = Quat::from_rotation_y(-flexion);
    let mut global = vec![Transform::IDENTITY; 5];
    pose.to_global(&skeleton, &mut global);
    (skeleton, pose, global)
}

fn flexion(global: &[Transform]) -> f32 {
    let [a, b, c] = [1, 2, 3].map(|joint| global[joint].translation);
    (b - a).angle_between(c - b)
}

#[test]
fn what_is_not_a_limb_is_told() {
    let (skeleton, _, global) = arm(0.5);
    let new = |end, settings| Limb::new(&skeleton, end, &global, settings).unwrap_err();
    let arm = LimbSettings::ARM;
    assert_eq!(new(2, arm), LimbError::Short("forearm".into()), "the chest is no bone of it");
    assert_eq!(new(9, arm), LimbError::Joint(9));
    let flexion = LimbSettings { flexion: [1.0, 0.5], ..arm };
    assert_eq!(new(3, flexion), LimbError::Flexion(1.0, 0.5));
    let softness = LimbSettings { softness: f32::NAN, ..arm };
    assert!(matches!(new(3, softness), LimbError::Softness(_)));
    assert_eq!(new(3, LimbSettings { points: Vec3::ZERO, ..arm }), LimbError::Points);
    let short = Limb::new(&skeleton, 3, &global[1..], arm).unwrap_err();
    assert_eq!(short, LimbError::Count { expected: 5, got: 4 });
}

#[test]
fn a_straight_arm_bends_its_elbow_back_and_fingers_follow() {
    let (skeleton, mut pose, mut global) = arm(0.0);
    let limb = Limb::new(&skeleton, 3, &global, LimbSettings::ARM).unwrap();
    let target = global[1].translation + Vec3::new(0.4, 0.0, 0.0);
    assert!(limb.reach(&skeleton, &Reach::at(target), &mut pose, &mut global));
    assert!(global[2].translation.z < -0.1, "{}", global[2].translation);
    assert!(global[3].translation.distance(target) < 1e-5);
    assert!(global[4].translation.distance(target + Vec3::X * 0.1) < 1e-5);
}

#[test]
fn flexion_stays_within_its_limits() {
    let settings = LimbSettings { flexion: [0.3, 2.0], ..LimbSettings::ARM };
    for (distance, expected) in [(5.0, 0.3), (0.01, 2.0)] {
        let (skeleton, mut pose, mut global) = arm(0.6);
        let limb = Limb::new(&skeleton, 3, &global, settings).unwrap();
        let target = global[1].translation + Vec3::new(0.3, -0.8, 0.1).normalize() * distance;
        limb.reach(&skeleton, &Reach::at(target), &mut pose, &mut global);
        assert!((flexion(&global) - expected).abs() < 2e-3, "{}", flexion(&global));
    }
}

/// A hand drawn away at an even speed past its reach: without softness the elbow snaps.
#[test]
fn an_elbow_does_not_snap_straight() {
    let snap = |softness: f32| {
        let settings = LimbSettings { softness, flexion: [0.0, 2.6], ..LimbSettings::ARM };
        let (skeleton, mut pose, mut global) = arm(1.0);
        let limb = Limb::new(&skeleton, 3, &global, settings).unwrap();
        let (shoulder, mut before, mut most) = (global[1].translation, None, 0.0f32);
        for step in 0..200 {
            let target = shoulder + Vec3::X * (0.4 + 0.001 * step as f32);
            limb.reach(&skeleton, &Reach::at(target), &mut pose, &mut global);
            let now = flexion(&global);
            let turned = before.map_or(0.0, |before: f32| before - now);
            assert!(turned > -5e-3, "it only opens: {turned}");
            (before, most) = (Some(now), most.max(turned));
        }
        most
    };
    assert!(snap(0.03) < 0.02 && snap(0.0) > 0.05, "{} {}", snap(0.03), snap(0.0));
}

#[test]
fn the_elbow_goes_to_its_pole_and_the_more_the_more_it_weighs() {
    let side = |pole, weight: f32| {
        let (skeleton, mut pose, mut global) = arm(1.0);
        let limb = Limb::new(&skeleton, 3, &global, LimbSettings::ARM).unwrap();
        let asked = Reach { pole: Some(pole), weight, ..Reach::at(global[3].translation) };
        let line = (global[3].translation - global[1].translation).normalize();
        limb.reach(&skeleton, &asked, &mut pose, &mut global);
        assert!(global[3].translation.distance(asked.position) < 1e-4, "the hand stays");
        let elbow = global[2].translation - global[1].translation;
        elbow.reject_from_normalized(line).normalize()
    };
    let down = Pole::Direction(Vec3::NEG_Y);
    assert!(side(down, 1.0).abs_diff_eq(Vec3::NEG_Y, 2e-3));
    let half = (Vec3::NEG_Y + Vec3::NEG_Z).normalize();
    assert!(side(down, 0.5).abs_diff_eq(half, 0.05), "{}", side(down, 0.5));
    assert!(side(Pole::Point(Vec3::new(0.3, 4.0, 0.0)), 1.0).y > 0.99);
    let (_, _, global) = arm(1.0);
    let line = Pole::Direction(global[3].translation - global[1].translation);
    assert!(side(line, 1.0).z < -0.98, "on the line it says nothing");
}

#[test]
fn bad_numbers_and_no_weight_leave_the_pose_alone() {
    let (skeleton, mut pose, mut global) = arm(0.7);
    let limb = Limb::new(&skeleton, 3, &global, LimbSettings::ARM).unwrap();
    let before = (pose.clone(), global.clone());
    let good = Reach::at(Vec3::ONE);
    let nan = Some(Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0));
    for (asked, done) in [
        (Reach { weight: 0.0, ..good }, true),
        (Reach { weight: f32::NAN, ..good }, false),
        (Reach { rotation: nan, ..good }, false),
        (Reach { pole: Some(Pole::Point(Vec3::NAN)), ..good }, false),
        (Reach::at(Vec3::splat(1e38)), false),
        (Reach::at(Vec3::NAN), false),
    ] {
        assert_eq!(limb.reach(&skeleton, &asked, &mut pose, &mut global), done, "{asked:?}");
        assert_eq!((&pose, &global), (&before.0, &before.1), "{asked:?}");
    }
}

proptest! {
    #[test]
    fn ends_arrive_and_a_small_change_of_weight_makes_a_small_change(
        swing in prop::array::uniform3(-1.6..1.6f32), far in 0.0..1.0f32,
        bend in 0.1..2.0f32, weight in 0.0..0.99f32, turn in -3.0..3.0f32,
    ) {
        let (skeleton, pose, global) = arm(bend);
        let limb = Limb::new(&skeleton, 3, &global, LimbSettings::ARM).unwrap();
        let span = limb.span(&global);
        let line = global[3].translation - global[1].translation;
        // Straight back through the shoulder the way round is anyone's choice.
        let swing = Quat::from_scaled_axis(Vec3::from_array(swing));
        let far = span.nearest + (span.exact - span.nearest) * far;
        let aside = swing * line.normalize() * far;
        let rotation = Quat::from_rotation_x(turn);
        let solve = |weight: f32| {
            let (mut pose, mut global) = (pose.clone(), global.clone());
            let position = global[1].translation + aside;
            let asked = Reach { rotation: Some(rotation), weight, ..Reach::at(position) };
            assert!(limb.reach(&skeleton, &asked, &mut pose, &mut global));
            let mut again = global.clone();
            pose.to_global(&skeleton, &mut again);
            for (a, b) in again.iter().zip(&global) {
                assert!(a.translation.distance(b.translation) < 1e-5, "kept up to date");
            }
            global
        };
        let all = solve(1.0);
        prop_assert!(all[3].translation.distance(global[1].translation + aside) < 1e-4);
        prop_assert!(all[3].rotation.angle_between(rotation) < 2e-3);
        let (some, more) = (solve(weight), solve(weight + 0.01));
        for joint in 1..4 {
            prop_assert!(some[joint].rotation.angle_between(more[joint].rotation) < 0.15);
        }
    }
}

/// Joints of both arms in turn: what hangs on one is not all in a row.
#[test]
fn whatever_hangs_on_an_arm_is_kept_up_to_date() {
    let joint = |name: &str, parent, offset: [f64; 3]| Joint {
        name: name.into(),
        parent,
        offset: offset.into(),
        tips: vec![],
    };
    let mut joints = vec![joint("chest", None, [0.0, 1.3, 0.0])];
    for (name, length) in [("arm", 0.15), ("forearm", 0.3), ("hand", 0.25), ("finger", 0.1)] {
        for (side, x) in [("left", 1.0), ("right", -1.0)] {
            let parent = joints.len().saturating_sub(2);
            joints.push(joint(&format!("{side}{name}"), Some(parent), [x * length, 0.0, 0.0]));
        }
    }
    joints[2].parent = Some(0);
    let skeleton = Skeleton::new(joints).unwrap();
    let mut pose = skeleton.rest_pose();
    let mut global = vec![Transform::IDENTITY; skeleton.len()];
    pose.to_global(&skeleton, &mut global);
    let limb = Limb::new(&skeleton, 5, &global, LimbSettings::ARM).unwrap();
    let asked = Reach::at(Vec3::new(0.3, 1.1, 0.3));
    assert!(limb.reach(&skeleton, &asked, &mut pose, &mut global));
    let mut again = global.clone();
    pose.to_global(&skeleton, &mut again);
    assert!(global[7].translation.distance(Vec3::new(0.7, 1.3, 0.0)) > 0.1, "the finger moves");
    for (now, again) in global.iter().zip(&again) {
        assert!(now.translation.distance(again.translation) < 1e-5);
    }
}
