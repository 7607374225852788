//! Heads that look.

use ambulo_layers::{LookAt, LookError, LookJoint, LookSettings, LookState};
use ambulo_rig::glam::{EulerRot, Quat, Vec3};
use ambulo_rig::{Joint, Pose, Skeleton, Transform};
use proptest::prelude::*;

const DT: f32 = 1.0 / 60.0;

fn look(joint: usize, share: f32, yaw: f32) -> LookJoint {
    LookJoint { joint, share, limit: [yaw, 0.5] }
}

fn odd() -> Quat {
    Quat::from_euler(EulerRot::XYZ, 0.4, 1.9, -0.7)
}

/// Hips, spine, chest, neck and head, in frames that lie anyhow.
fn body() -> (Skeleton, Pose, Vec<Transform>) {
    let joint = |name: &str, parent: Option<usize>| Joint {
        name: name.into(),
        parent,
        offset: [0.0, 0.2, 0.0].into(),
        tips: vec![],
    };
    let names = ["hips", "spine", "chest", "neck", "head", "hair"];
    let joints = names.iter().enumerate().map(|(at, name)| joint(name, at.checked_sub(1)));
    let skeleton = Skeleton::new(joints.collect()).unwrap();
    let pose = skeleton.rest_pose();
    let mut global = vec![Transform::IDENTITY; 6];
    pose.to_global(&skeleton, &mut global);
    // The same places, other frames.
    global.iter_mut().for_each(|joint| joint.rotation = odd());
    let pose = Pose::from_global(&skeleton, &global);
    (skeleton, pose, global)
}

fn layer() -> LookAt {
    let (skeleton, _, global) = body();
    let joints = [look(1, 1.0, 0.3), look(3, 2.0, 0.6), look(4, 3.0, 0.9)];
    LookAt::new(&skeleton, &joints, &global, LookSettings::default()).unwrap()
}

/// Angle between the gaze and a target after so many frames, and where the head is.
fn after(frames: usize, target: Option<Vec3>, state: &mut LookState) -> (f32, Transform) {
    let (skeleton, drawn, world) = body();
    let (layer, mut global) = (layer(), world.clone());
    for _ in 0..frames {
        let mut pose = drawn.clone();
        global.clone_from(&world);
        assert!(layer.step(&skeleton, state, target, 1.0, DT, &mut pose, &mut global));
        let mut again = global.clone();
        pose.to_global(&skeleton, &mut again);
        for (a, b) in again.iter().zip(&global) {
            assert!(a.translation.distance(b.translation) < 1e-5, "kept up to date");
        }
    }
    let (head, inward) = (global[4], odd().inverse());
    let eyes = head.transform_point(inward * LookSettings::default().eyes);
    let away = target.unwrap_or(Vec3::Z) - eyes;
    (away.angle_between(head.rotation * inward * Vec3::Z), head)
}

#[test]
fn what_cannot_look_is_told() {
    let (skeleton, _, global) = body();
    let new = |joints: &[LookJoint], settings| {
        LookAt::new(&skeleton, joints, &global, settings).unwrap_err()
    };
    let usual = LookSettings::default();
    assert_eq!(new(&[], usual), LookError::Empty);
    assert_eq!(new(&[look(0, 1.0, 1.0)], usual), LookError::Joint(0), "the root");
    assert_eq!(new(&[look(9, 1.0, 1.0)], usual), LookError::Joint(9));
    let apart = LookError::Apart { above: "head".into(), below: "neck".into() };
    assert_eq!(new(&[look(4, 1.0, 1.0), look(3, 1.0, 1.0)], usual), apart);
    assert_eq!(new(&[look(3, 0.0, 1.0)], usual), LookError::Share("neck".into()));
    assert_eq!(new(&[look(3, 1.0, -1.0)], usual), LookError::Share("neck".into()));
    let behind = LookSettings { behind: [2.0, 1.0], ..usual };
    assert_eq!(new(&[look(3, 1.0, 1.0)], behind), LookError::Settings);
}

#[test]
fn it_looks_level_comes_smoothly_and_goes_back() {
    let mut state = layer().state();
    let target = Vec3::new(1.0, 1.4, 1.2);
    let (first, _) = after(1, Some(target), &mut state);
    let (there, head) = after(120, Some(target), &mut state);
    assert!(first > 0.5 && there < 2e-3, "{first} {there}");
    let (_, rest) = after(0, None, &mut layer().state());
    let left = head.rotation * rest.rotation.inverse() * Vec3::X;
    assert!(left.y.abs() < 1e-3, "the head does not tilt: {left}");
    let (_, back) = after(120, None, &mut state);
    assert!(back.rotation.angle_between(rest.rotation) < 2e-3);
}

/// A target that goes once around: the head never jumps, and behind it looks ahead.
#[test]
fn behind_it_eases_out() {
    let mut state = layer().state();
    let mut before = after(1, Some(Vec3::Z), &mut state).1;
    for step in 0..720 {
        let angle = (step as f32).to_radians();
        let target = Vec3::new(2.0 * angle.sin(), 1.0, 2.0 * angle.cos());
        let (miss, head) = after(1, Some(target), &mut state);
        let turned = head.rotation.angle_between(before.rotation);
        assert!(turned < 0.12, "{step}: {turned}");
        let aside = head.rotation.angle_between(odd());
        assert!(step % 360 != 180 || aside < 0.3, "{step}: {aside}");
        assert!(step % 360 > 60 || step < 300 || miss < 0.4, "{step}: {miss}");
        before = head;
    }
}

/// A fly that goes over the head from front to back: its yaw turns round at once, the head does not.
#[test]
fn overhead_it_does_not_spin() {
    let mut state = layer().state();
    let fly = |step: usize| Some(Vec3::new(0.02, 2.0, 1.0 - 0.01 * step as f32));
    let (mut before, mut most) = (after(60, fly(0), &mut state).1, 0.0f32);
    for step in 1..200 {
        let head = after(1, fly(step), &mut state).1;
        most = most.max(head.rotation.angle_between(before.rotation));
        before = head;
    }
    assert!(most < 0.095, "{most}");
}

#[test]
fn bad_numbers_leave_the_pose_alone() {
    let (skeleton, mut pose, mut global) = body();
    let (layer, before) = (layer(), pose.clone());
    let mut state = layer.state();
    let target = Some(Vec3::ONE);
    for (target, weight, dt) in
        [(Some(Vec3::NAN), 1.0, DT), (target, f32::NAN, DT), (target, 1.0, -DT)]
    {
        let done = layer.step(&skeleton, &mut state, target, weight, dt, &mut pose, &mut global);
        assert!(!done);
    }
    assert!(layer.step(&skeleton, &mut state, target, 0.0, DT, &mut pose, &mut global));
    assert_eq!((pose, state), (before, layer.state()));
}

proptest! {
    #[test]
    fn gaze_comes_to_whatever_is_in_front(
        x in -1.5..1.5f32, y in 0.5..1.4f32, z in 1.0..3.0f32,
    ) {
        let (miss, _) = after(150, Some(Vec3::new(x, y, z)), &mut layer().state());
        prop_assert!(miss < 5e-3, "{miss}");
    }
}
