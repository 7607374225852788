//! Feet that stand.

use ambulo_layers::{FeetState, FootError, FootPlacement, FootSettings, Ground};
use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Flat, Joint, Pose, Roles, Skeleton, Terrain, Transform};

const DT: f32 = 1.0 / 60.0;

/// Hips and two legs, standing with knees a little bent on the ground.
fn body() -> (Skeleton, Pose, Vec<Transform>) {
    let joint = |name: &str, parent, offset: [f64; 3]| Joint {
        name: name.into(),
        parent,
        offset: offset.into(),
        tips: vec![],
    };
    let mut joints = vec![joint("hips", None, [0.0, 0.92, 0.0])];
    for (side, x) in [("left", 0.1), ("right", -0.1)] {
        let at = joints.len();
        joints.push(joint(&format!("{side}upleg"), Some(0), [x, 0.0, 0.0]));
        joints.push(joint(&format!("{side}leg"), Some(at), [0.0, -0.42, 0.08]));
        joints.push(joint(&format!("{side}foot"), Some(at + 1), [0.0, -0.42, -0.08]));
        joints.push(joint(&format!("{side}toe"), Some(at + 2), [0.0, -0.06, 0.13]));
    }
    let skeleton = Skeleton::new(joints).unwrap();
    let (pose, mut global) = (skeleton.rest_pose(), vec![Transform::IDENTITY; 9]);
    pose.to_global(&skeleton, &mut global);
    (skeleton, pose, global)
}

fn feet() -> FootPlacement {
    let (skeleton, _, stance) = body();
    let (roles, settings) = (Roles::by_name(&skeleton), FootSettings::default());
    FootPlacement::new(&skeleton, &roles, &stance, 0.0, settings).unwrap()
}

#[test]
fn what_cannot_stand_is_told_by_name() {
    let (skeleton, _, stance) = body();
    let roles = Roles::by_name(&skeleton);
    let new = |roles: Roles, floor, settings| {
        FootPlacement::new(&skeleton, &roles, &stance, floor, settings).unwrap_err()
    };
    let usual = FootSettings::default();
    let missing = |roles| new(roles, 0.0, usual).to_string();
    assert!(missing(Roles { hips: None, ..roles }).contains("hips"));
    assert!(missing(Roles { thighs: None, ..roles }).contains("thighs"));
    assert!(missing(Roles { feet: None, ..roles }).contains("feet"));
    assert!(missing(Roles { toes: None, ..roles }).contains("toes"));
    let crossed = missing(Roles { toes: Some([8, 4]), ..roles });
    assert_eq!(crossed, "the left toe joint must hang on the foot");
    let short = missing(Roles { feet: Some([1, 7]), ..roles });
    assert!(short.starts_with("the left leg: 'leftupleg'"), "{short}");
    assert!(missing(Roles { hips: Some(4), ..roles }).contains("must hang on the hips"));
    assert_eq!(new(roles, f32::NAN, usual), FootError::Stance);
    let leash = FootSettings { leash: f32::NAN, ..usual };
    assert_eq!(new(roles, 0.0, leash), FootError::Setting("leash"));
    let order = FootSettings { hold: 0.3, ..usual };
    assert_eq!(new(roles, 0.0, order), FootError::Setting("order of contacts"));
}

#[test]
fn who_stands_on_flat_ground_stands_as_before() {
    let (skeleton, drawn, mut global) = body();
    let (feet, mut state, mut pose) = (feet(), FeetState::default(), drawn.clone());
    for level in [Some(0.0), None] {
        let ground = Ground { terrain: &Flat(0.0), level };
        pose.clone_from(&drawn);
        pose.to_global(&skeleton, &mut global);
        let contacts = [1.0; 4];
        assert!(feet.step(&skeleton, &mut state, contacts, &ground, 0.1, &mut pose, &mut global));
        for (now, before) in pose.local.iter().zip(&drawn.local) {
            assert!(now.rotation.angle_between(before.rotation) < 2e-3);
            assert!(now.translation.distance(before.translation) < 1e-4);
        }
    }
    assert_eq!(state.held(), [true; 2]);
}

/// One foot on a block, the other on the ground half a metre below it.
#[test]
fn hips_sink_to_the_lower_foot() {
    struct Block;
    impl Terrain for Block {
        fn height(&self, x: f32, _: f32) -> f32 {
            if x > 0.0 { 0.0 } else { -0.25 }
        }
    }
    let (skeleton, drawn, mut global) = body();
    let (feet, mut state, mut pose) = (feet(), FeetState::default(), drawn.clone());
    let ground = Ground { terrain: &Block, level: Some(0.0) };
    for _ in 0..60 {
        pose.clone_from(&drawn);
        pose.to_global(&skeleton, &mut global);
        feet.step(&skeleton, &mut state, [1.0; 4], &ground, DT, &mut pose, &mut global);
    }
    assert!((-0.3..-0.2).contains(&state.hips().y), "{}", state.hips());
    let heights = [4, 8].map(|ball| global[ball].translation.y);
    assert!((heights[0] - 0.02).abs() < 1e-3 && (heights[1] + 0.23).abs() < 1e-3, "{heights:?}");
    assert!(global[2].translation.z > 0.2, "the knee bends: {}", global[2].translation);
}

/// Facing down a slope that the motion knows nothing of.
#[test]
fn heels_rise_where_the_ground_is_higher_behind() {
    struct Down;
    impl Terrain for Down {
        fn height(&self, _: f32, z: f32) -> f32 {
            -0.2 * z
        }
    }
    let (skeleton, drawn, mut global) = body();
    let (feet, mut state, mut pose) = (feet(), FeetState::default(), drawn.clone());
    let ground = Ground { terrain: &Down, level: None };
    for _ in 0..30 {
        pose.clone_from(&drawn);
        pose.to_global(&skeleton, &mut global);
        feet.step(&skeleton, &mut state, [1.0; 4], &ground, DT, &mut pose, &mut global);
    }
    let ball = global[4].translation;
    assert!((ball.y + 0.2 * ball.z - 0.02).abs() < 1e-3, "the ball stays on the ground: {ball}");
    let heel = global[3].transform_point(Vec3::new(0.0, -0.08, -0.039));
    assert!((heel.y + 0.2 * heel.z).abs() < 2e-3, "and so does the heel: {heel}");
}

/// Toes that the motion curls up, of a foot that is surely on the ground, and of one that is not.
#[test]
fn toes_lie_on_the_ground_as_far_as_they_are_in_contact() {
    let (skeleton, mut pose, mut global) = body();
    let (feet, mut state) = (feet(), FeetState::default());
    for toe in [4, 8] {
        pose.local[toe].rotation = Quat::from_rotation_x(-0.4);
    }
    pose.to_global(&skeleton, &mut global);
    let ground = Ground { terrain: &Flat(0.0), level: Some(0.0) };
    let contacts = [1.0, 1.0, 1.0, 0.0];
    feet.step(&skeleton, &mut state, contacts, &ground, DT, &mut pose, &mut global);
    let tips = [4, 8].map(|toe| global[toe].transform_point(Vec3::new(0.0, -0.02, 0.065)).y);
    assert!(tips[0].abs() < 1e-4 && tips[1] > 0.02, "{tips:?}");
}

/// A body that is pushed sideways while both feet are down.
#[test]
fn a_foot_left_behind_is_let_go_without_a_jump() {
    let (skeleton, drawn, mut global) = body();
    let (feet, mut state, mut pose) = (feet(), FeetState::default(), drawn.clone());
    let ground = Ground { terrain: &Flat(0.0), level: Some(0.0) };
    let (mut before, mut most_behind) = (None, 0.0f32);
    for frame in 0..120 {
        pose.clone_from(&drawn);
        pose.local[0].translation.x += 0.004 * frame.min(60) as f32;
        pose.to_global(&skeleton, &mut global);
        let ball = global[4].translation;
        // Held again only after it has been off the ground.
        let contact = if (90..95).contains(&frame) { 0.0 } else { 1.0 };
        feet.step(&skeleton, &mut state, [contact; 4], &ground, DT, &mut pose, &mut global);
        let shown = global[4].translation;
        let expected = !(30..95).contains(&frame);
        assert!((30..40).contains(&frame) || state.held()[0] == expected, "{frame}");
        let moved = before.map_or(0.0, |before: Vec3| shown.distance(before));
        assert!(moved < if state.held()[0] { 0.001 } else { 0.025 }, "{frame}: {moved}");
        (before, most_behind) = (Some(shown), most_behind.max(shown.distance(ball)));
    }
    assert!(most_behind > 0.1 && most_behind < 0.121, "{most_behind}");
    assert!(before.unwrap().distance(global[4].translation) < 1e-6);
}

#[test]
fn whoever_stands_ends_in_the_stance_of_the_motion() {
    let (skeleton, drawn, mut global) = body();
    let (feet, mut state, mut pose) = (feet(), FeetState::default(), drawn.clone());
    let ground = Ground { terrain: &Flat(0.0), level: None };
    let mut behind = |frames: usize, aside: f32| {
        for _ in 0..frames {
            pose.clone_from(&drawn);
            pose.local[0].translation.x += aside;
            pose.to_global(&skeleton, &mut global);
            feet.step(&skeleton, &mut state, [1.0; 4], &ground, DT, &mut pose, &mut global);
        }
        (global[4].translation.x - 0.1 - aside).abs()
    };
    behind(1, 0.0);
    assert!(behind(20, 0.08) > 0.06 && behind(1200, 0.08) < 1e-3);
}

#[test]
fn any_time_is_fine() {
    let (skeleton, drawn, mut global) = body();
    let (feet, mut state, mut pose) = (feet(), FeetState::default(), drawn.clone());
    for (frame, dt) in [0.0, 1e-6, 0.5, 1e6, f32::MAX, 0.0].into_iter().enumerate() {
        pose.clone_from(&drawn);
        pose.local[0].translation.z += 0.02 * frame as f32;
        pose.to_global(&skeleton, &mut global);
        let ground = Ground { terrain: &Flat(0.05), level: Some(0.0) };
        let contacts = [(frame % 2) as f32; 4];
        assert!(feet.step(&skeleton, &mut state, contacts, &ground, dt, &mut pose, &mut global));
        assert!(pose.local.iter().all(|joint| joint.is_finite()), "{dt}");
        assert!((global[4].translation.y - 0.07).abs() < 1e-3, "{dt}: {}", global[4].translation);
    }
}

#[test]
fn bad_numbers_leave_the_pose_alone() {
    let (skeleton, mut pose, mut global) = body();
    let (feet, before) = (feet(), pose.clone());
    let mut state = FeetState::default();
    let mut step = |height, level, contact, dt| {
        let ground = Ground { terrain: &Flat(height), level };
        feet.step(&skeleton, &mut state, [contact; 4], &ground, dt, &mut pose, &mut global)
    };
    assert!(!step(f32::NAN, None, 1.0, 0.1));
    assert!(!step(0.3, Some(f32::NAN), 1.0, 0.1));
    assert!(!step(0.3, None, f32::NAN, 0.1));
    assert!(!step(0.3, None, 1.0, f32::NAN) && !step(0.3, None, 1.0, -0.1));
    assert_eq!((&pose, state), (&before, FeetState::default()));
    global[3].translation.x = f32::NAN;
    let ground = Ground { terrain: &Flat(0.0), level: None };
    assert!(!feet.step(&skeleton, &mut state, [1.0; 4], &ground, 0.1, &mut pose, &mut global));
    assert_eq!(pose, before);
}
