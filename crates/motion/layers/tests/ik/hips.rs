//! Hips that give way.

use ambulo_layers::{Hips, HipsError, HipsSettings, HipsState, Want};
use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Joint, Pose, Roles, Skeleton, Transform};

fn body() -> (Skeleton, Pose, Vec<Transform>) {
    let joint = |name: &str, parent| Joint {
        name: name.into(),
        parent,
        offset: [0.0, 0.5, 0.0].into(),
        tips: vec![],
    };
    let joints = vec![joint("root", None), joint("hips", Some(0)), joint("spine", Some(1))];
    let skeleton = Skeleton::new(joints).unwrap();
    let mut pose = skeleton.rest_pose();
    pose.local[0].rotation = Quat::from_rotation_x(0.8);
    let mut global = vec![Transform::IDENTITY; 3];
    pose.to_global(&skeleton, &mut global);
    (skeleton, pose, global)
}

fn hips(settings: HipsSettings) -> Result<Hips, HipsError> {
    let (skeleton, ..) = body();
    Hips::new(&skeleton, &Roles::by_name(&skeleton), settings)
}

const LOW: Want = Want {
    root: Vec3::new(0.0, 0.9, 0.0),
    target: Vec3::new(0.0, -0.1, 0.0),
    comfort: 0.8,
    reach: 0.9,
    weight: 1.0,
};

#[test]
fn what_cannot_be_moved_is_told() {
    let (skeleton, ..) = body();
    let usual = HipsSettings::default();
    assert_eq!(Hips::new(&skeleton, &Roles::default(), usual), Err(HipsError::Role));
    assert_eq!(hips(HipsSettings { most: -1.0, ..usual }), Err(HipsError::Settings(0.1, -1.0)));
    let away = Roles { hips: Some(7), ..Roles::default() };
    assert_eq!(Hips::new(&skeleton, &away, usual), Err(HipsError::Joint(7)));
}

#[test]
fn hips_sink_at_once_as_far_as_they_must_and_smoothly_as_far_as_they_should() {
    let hips = hips(HipsSettings::default()).unwrap();
    let mut state = HipsState::default();
    let (skeleton, drawn, world) = body();
    let mut lowest = 0.0;
    for frame in 0..120 {
        let (mut pose, mut global) = (drawn.clone(), world.clone());
        let wants = if frame < 60 { &[LOW][..] } else { &[] };
        assert!(hips.step(&skeleton, &mut state, wants, 1.0 / 60.0, &mut pose, &mut global));
        let moved = global[2].translation - world[2].translation;
        assert!(moved.abs_diff_eq(state.offset, 1e-5), "what hangs on them follows");
        assert!(pose.local[0] == drawn.local[0]);
        assert!(frame >= 60 || moved.y < -0.0999, "it reaches: {moved}");
        assert!(frame != 0 || moved.y > -0.12, "no farther at once: {moved}");
        lowest = moved.y.min(lowest);
    }
    assert!((lowest + 0.2).abs() < 1e-3, "{lowest}");
    assert!(state.offset.length() < 1e-3, "and back: {}", state.offset);
}

#[test]
fn hips_go_no_farther_than_most_and_not_for_what_weighs_nothing() {
    let hips = hips(HipsSettings { halflife: 0.0, most: 0.15 }).unwrap();
    let (skeleton, mut pose, mut global) = body();
    let mut offset = |weight| {
        let (mut state, want) = (HipsState::default(), Want { weight, ..LOW });
        hips.step(&skeleton, &mut state, &[want], 0.1, &mut pose, &mut global);
        state.offset
    };
    assert_eq!(offset(0.0), Vec3::ZERO);
    assert!((offset(0.5).y + 0.1).abs() < 1e-4 && (offset(1.0).y + 0.15).abs() < 1e-4);
}

#[test]
fn bad_numbers_leave_the_pose_alone() {
    let hips = hips(HipsSettings::default()).unwrap();
    let (skeleton, mut pose, mut global) = body();
    let (before, mut state) = (pose.clone(), HipsState::default());
    let nan = Want { target: Vec3::NAN, ..LOW };
    let weightless = Want { weight: f32::NAN, ..LOW };
    for (want, dt) in [(nan, 0.1), (weightless, 0.1), (LOW, f32::NAN), (LOW, -0.1)] {
        assert!(!hips.step(&skeleton, &mut state, &[want], dt, &mut pose, &mut global));
    }
    assert_eq!((pose, state), (before, HipsState::default()));
}
