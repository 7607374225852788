use std::collections::BTreeMap;
use std::sync::Arc;

use super::*;
use crate::blend_tree::Node;
use crate::motion::{Marks, Motion};
use ambulo_rig::glam::{DQuat, DVec3, Quat, Vec3};
use ambulo_rig::{Clip, Joint, Skeleton, Transform};
use proptest::prelude::*;

fn skeleton() -> Skeleton {
    let joint =
        |name: &str, parent| Joint { name: name.into(), parent, offset: DVec3::Y, tips: vec![] };
    Skeleton::new(vec![joint("hips", None), joint("spine", Some(0)), joint("arm", Some(1))])
        .unwrap()
}

/// One cycle: the root goes `speed` metres a second, the spine swings by `swing`, the arm is held at
/// `held`, all the way around in `duration`.
fn motion(duration: f64, speed: f64, swing: f64, held: f64) -> Arc<Motion> {
    let frames = 61;
    let at = |f: i32| f64::from(f) / f64::from(frames - 1);
    let turns = (0..frames).flat_map(|f| {
        let swing = swing * (std::f64::consts::TAU * at(f)).sin();
        [DQuat::IDENTITY, DQuat::from_rotation_x(swing), DQuat::from_rotation_z(held)]
    });
    let places = (0..frames).map(|f| DVec3::new(0.0, 1.0, speed * duration * at(f)));
    let time = duration / f64::from(frames - 1);
    let clip = Clip::new(skeleton(), time, vec![0], places.collect(), turns.collect()).unwrap();
    Arc::new(Motion::new(&clip, 60.0, Marks::default()).unwrap())
}

fn clips() -> BTreeMap<String, Arc<Motion>> {
    let still = Motion::new(
        &Clip::new(skeleton(), 1.0, vec![], vec![], vec![DQuat::IDENTITY; 3]).unwrap(),
        60.0,
        Marks::default(),
    );
    [
        ("walk", motion(1.0, 1.5, 0.4, 0.0)),
        ("run", motion(0.6, 4.0, 0.8, 0.0)),
        ("wave", motion(0.5, 0.0, 0.0, 1.0)),
        ("still", Arc::new(still.unwrap())),
    ]
    .map(|(name, motion)| (name.to_string(), motion))
    .into()
}

fn tree(json: &str) -> (BlendTree, TreeState) {
    let node: Node = serde_json::from_str(json).unwrap();
    let tree = BlendTree::new(&node, &clips(), &skeleton()).unwrap();
    let state = TreeState::new(&tree);
    (tree, state)
}

fn none() -> Pose {
    Pose { local: vec![] }
}

/// About x, of the spine.
fn spine(pose: &Pose) -> f32 {
    pose.local[1].rotation.to_scaled_axis().x
}

/// About z, of the arm.
fn arm(pose: &Pose) -> f32 {
    pose.local[2].rotation.to_scaled_axis().z
}

const GAITS: &str = r#"{"blend_1d": {"by": "speed", "samples": [
    {"at": 0, "node": {"clip": {"name": "still"}}},
    {"at": 1.5, "node": {"clip": {"name": "walk"}}},
    {"at": 4, "node": {"clip": {"name": "run"}}}]}}"#;

proptest! {
    /// All clips of a blend space are at the same part of their cycle, whatever the speed did.
    #[test]
    fn gaits_stay_in_step(speeds in prop::collection::vec(0.1..4.5f32, 1..20)) {
        let (tree, mut state) = tree(GAITS);
        let mut out = none();
        let mut phase = 0.0_f64;
        for speed in speeds {
            let step = tree.step(&mut state, &[speed], 0.07, &mut out).unwrap();
            let run = f64::from(((speed - 1.5) / 2.5).clamp(0.0, 1.0));
            let by = 0.07_f32 as f64 / (1.0 - 0.4 * run);
            phase = (phase + by) % 1.0;
            let moving = (speed / 1.5).min(1.0);
            let swing = (0.4 + 0.4 * run as f32) * moving * (std::f64::consts::TAU * phase).sin() as f32;
            prop_assert!((spine(&out) - swing).abs() < 0.02, "{} {}", spine(&out), swing);
            // Strides: the mean of the clips' by weight, this part of a cycle.
            let stride = f64::from(moving) * (1.5 + (2.4 - 1.5) * run);
            prop_assert!((f64::from(step.root.place.z) - stride * by).abs() < 1e-3);
            prop_assert!(!step.switched);
        }
    }

    /// No parameter and no time makes a pose that is none, and what is shown changes no farther
    /// than time and parameters do.
    #[test]
    fn any_parameters_give_a_pose(
        parameters in prop::array::uniform3(-1e6..1e6f32), dt in 0.0..100.0f32,
    ) {
        let (tree, mut state) = tree(WAVING);
        let mut out = none();
        for _ in 0..3 {
            tree.step(&mut state, &parameters, dt, &mut out).unwrap();
            crate::refused::check(&out, 3).unwrap();
        }
    }
}

const WAVING: &str = r#"{"overlay": {
    "base": {"select": {"by": "what", "children": [
        {"clip": {"name": "walk"}},
        {"additive": {"base": {"clip": {"name": "still"}}, "add": {"clip": {"name": "walk"}},
            "reference": "walk", "weight": "much"}},
        {"clip": {"name": "run", "looped": false}}]}},
    "over": {"clip": {"name": "wave"}},
    "weight": "waving", "mask": [{"joint": "arm", "up": 1}]}}"#;

/// In the order in which the tree names them: waving, what, much.
fn waving(waving: f32, what: f32, much: f32) -> [f32; 3] {
    [waving, what, much]
}

#[test]
fn an_overlay_takes_what_its_mask_gives() {
    let (tree, mut state) = tree(WAVING);
    assert_eq!(tree.parameters(), ["waving", "what", "much"]);
    let mut out = none();
    let step = tree.step(&mut state, &waving(0.0, 0.0, 0.0), 0.25, &mut out).unwrap();
    assert!((spine(&out) - 0.4).abs() < 1e-3 && arm(&out).abs() < 1e-6);
    assert!((step.root.place.z - 1.5 * 0.25).abs() < 1e-4, "{step:?}");
    tree.step(&mut state, &waving(1.0, 0.0, 0.0), 0.0, &mut out).unwrap();
    assert!((spine(&out) - 0.2).abs() < 1e-3 && (arm(&out) - 1.0).abs() < 1e-3, "{out:?}");
    tree.step(&mut state, &waving(0.5, 0.0, 0.0), 0.0, &mut out).unwrap();
    assert!((spine(&out) - 0.3).abs() < 1e-3 && (arm(&out) - 0.5).abs() < 1e-3, "{out:?}");
}

#[test]
fn an_additive_adds() {
    let (tree, mut state) = tree(WAVING);
    let mut out = none();
    tree.step(&mut state, &waving(0.0, 1.0, 2.0), 0.25, &mut out).unwrap();
    assert!((spine(&out) - 0.8).abs() < 1e-3, "{out:?}");
    tree.step(&mut state, &waving(0.0, 1.0, -1.0), 0.0, &mut out).unwrap();
    assert!((spine(&out) + 0.4).abs() < 1e-3, "{out:?}");
    let mut most = none();
    tree.step(&mut state, &waving(0.0, 1.0, 10.0), 0.0, &mut most).unwrap();
    tree.step(&mut state, &waving(0.0, 1.0, 1e5), 0.0, &mut out).unwrap();
    assert_eq!(out, most, "a parameter is held in range");
}

#[test]
fn what_is_newly_selected_starts_and_is_told() {
    let (tree, mut state) = tree(WAVING);
    let mut out = none();
    let mut step = |what: f32, dt: f32, out: &mut Pose| {
        let parameters = waving(0.0, what, 1.0);
        let told = tree.switches(&mut state, &parameters).unwrap();
        let step = tree.step(&mut state, &parameters, dt, out).unwrap();
        assert_eq!(told, step.switched);
        step
    };
    assert!(!step(0.0, 0.25, &mut out).switched, "the first is no switch");
    assert!(!step(0.4, 0.0, &mut out).switched);
    assert!(step(2.0, 0.15, &mut out).switched);
    assert!((spine(&out) - 0.8).abs() < 1e-3, "a quarter of the run: {}", spine(&out));
    assert!((step(9.0, 5.0, &mut out).root.place.z - 4.0 * 0.45).abs() < 1e-3, "held at its end");
    assert_eq!(step(2.0, 5.0, &mut out).root, GroundStep::default());
    // Where it stopped before was a quarter of its cycle, too: it would be at half of it now.
    assert!(step(-9.0, 0.25, &mut out).switched);
    assert!((spine(&out) - 0.4).abs() < 1e-3, "a quarter of the walk: {}", spine(&out));
}

#[test]
fn what_is_refused_changes_nothing() {
    let (tree, mut state) = tree(WAVING);
    let mut out = none();
    let good = waving(0.3, 0.0, 0.0);
    tree.step(&mut state, &good, 0.1, &mut out).unwrap();
    let (before, mut other) = (out.clone(), state.clone());
    for bad in [f32::NAN, f32::INFINITY, 2e6] {
        for at in 0..3 {
            let mut parameters = good;
            parameters[at] = bad;
            assert!(tree.step(&mut state, &parameters, 0.1, &mut out).is_err());
            assert!(tree.switches(&mut state, &parameters).is_err());
        }
        assert!(tree.step(&mut state, &good, bad, &mut out).is_err());
    }
    assert!(tree.step(&mut state, &good, -0.1, &mut out).is_err());
    assert!(tree.step(&mut state, &good[..2], 0.1, &mut out).is_err());
    let (gaits, _) = self::tree(GAITS);
    assert!(gaits.step(&mut state, &[1.0], 0.1, &mut out).is_err(), "another tree's state");
    assert_eq!(out, before);
    let mut same = none();
    tree.step(&mut state, &good, 0.1, &mut out).unwrap();
    tree.step(&mut other, &good, 0.1, &mut same).unwrap();
    assert_eq!(out, same);
}

/// The same steps twice: the same bits.
#[test]
fn runs_repeat() {
    let run = || {
        let (tree, mut state) = tree(GAITS);
        let mut out = none();
        for frame in 0..200 {
            let speed = 2.0 + 2.0 * (frame as f32 * 0.1).sin();
            tree.step(&mut state, &[speed], 1.0 / 60.0, &mut out).unwrap();
        }
        out
    };
    assert_eq!(run(), run());
    assert_ne!(run().local[1], Transform::new(Vec3::Y, Quat::IDENTITY));
}
