//! A controller under a network that is simple enough to know what it must do: one affine layer
//! that foresees what it is told, and walks and turns along it.

use std::collections::BTreeMap;
use std::sync::Arc;

use ambulo_control::{
    Areas, ControlError, Controller, Event, Feet, Gait, Held, Intent, Model, Root, Tuning, World,
};
use ambulo_features::{Block, Layout, Output};
use ambulo_net::{Bundle, FORMAT_VERSION, Header, Layer, LayoutTable, Network, Normalisation};
use ambulo_rig::glam::{DVec3, Quat, Vec2, Vec3};
use ambulo_rig::{Flat, Joint, Pose, Skeleton, Terrain, Transform};

const STEP: f32 = 1.0 / 60.0;

fn skeleton() -> Skeleton {
    let joint = |name: &str, parent, offset: [f64; 3]| Joint {
        name: name.into(),
        parent,
        offset: DVec3::from_array(offset),
        tips: vec![],
    };
    Skeleton::new(vec![
        joint("Hips", None, [0.0, 0.0, 0.0]),
        joint("LeftUpLeg", Some(0), [0.1, -0.05, 0.0]),
        joint("LeftLeg", Some(1), [0.0, -0.42, 0.0]),
        joint("LeftFoot", Some(2), [0.0, -0.42, 0.0]),
        joint("LeftToe", Some(3), [0.0, -0.05, 0.13]),
        joint("RightUpLeg", Some(0), [-0.1, -0.05, 0.0]),
        joint("RightLeg", Some(5), [0.0, -0.42, 0.0]),
        joint("RightFoot", Some(6), [0.0, -0.42, 0.0]),
        joint("RightToe", Some(7), [0.0, -0.05, 0.13]),
    ])
    .unwrap()
}

/// What the network draws: a body on knees slightly bent, ankles 9 cm above the ground.
fn stance() -> Output {
    let mut output = Output::zero(9);
    output.phase_rate = 1.0;
    output.contacts = [0.9, 0.8, 0.2, 0.1];
    output.joint_position = vec![
        Vec3::new(0.0, 0.95, 0.0),
        Vec3::new(0.1, 0.9, 0.0),
        Vec3::new(0.1, 0.5, 0.08),
        Vec3::new(0.1, 0.09, 0.0),
        Vec3::new(0.1, 0.04, 0.13),
        Vec3::new(-0.1, 0.9, 0.0),
        Vec3::new(-0.1, 0.5, 0.08),
        Vec3::new(-0.1, 0.09, 0.0),
        Vec3::new(-0.1, 0.04, 0.13),
    ];
    output
}

fn at(blocks: &[Block], name: &str, index: usize) -> usize {
    blocks.iter().find(|block| block.name == name).expect("a block of that name").range.start
        + index
}

/// (weights outputs × inputs, biases) of the layer that follows what it is told.
fn follower(layout: &Layout) -> (Vec<f32>, Vec<f32>) {
    // A tenth of the way to the sample ten frames ahead, in the layout's units and sense.
    let (pace, turn) = if layout.name() == "holden" { (0.1, -0.1) } else { (6.0, 6.0) };
    let (inputs, outputs) = (layout.input_len(), layout.output_len());
    let mut weights = vec![0.0; inputs * outputs];
    let mut link = |out: usize, input: usize, weight: f32| weights[out * inputs + input] = weight;
    let (ins, outs) = (layout.inputs(), layout.outputs());
    for name in ["trajectory_x", "trajectory_z", "direction_x", "direction_z"] {
        for sample in 0..6 {
            link(at(outs, name, sample), at(ins, name, 6 + sample), 1.0);
        }
    }
    link(at(outs, "root_velocity", 0), at(ins, "trajectory_x", 7), pace);
    link(at(outs, "root_velocity", 1), at(ins, "trajectory_z", 7), pace);
    link(at(outs, "root_yaw", 0), at(ins, "direction_x", 7), turn);
    let mut biases = vec![0.0; outputs];
    layout.encode_output(&stance(), &mut biases);
    (weights, biases)
}

fn header(layout: &Layout) -> Header {
    let table = |blocks: &[Block]| blocks.iter().map(|b| (b.name.into(), b.range.len())).collect();
    let feet = Feet { joints: [3, 4, 7, 8], heights: [0.09, 0.04, 0.09, 0.04] };
    Header {
        format: FORMAT_VERSION,
        kind: "pfnn".into(),
        activation: "elu".into(),
        fps: 60.0,
        layout: LayoutTable {
            name: layout.name().into(),
            hash: layout.hash(),
            inputs: table(layout.inputs()),
            outputs: table(layout.outputs()),
        },
        licence: "none: made by a test".into(),
        provenance: BTreeMap::new(),
        parts: BTreeMap::from([
            ("skeleton".into(), serde_json::to_value(skeleton()).unwrap()),
            ("feet".into(), serde_json::to_value(feet).unwrap()),
        ]),
    }
}

fn bundle(change: impl FnOnce(&mut Header, &mut Vec<f32>, &mut Vec<f32>)) -> Bundle {
    bundle_of("holden", change)
}

fn bundle_of(
    layout: &str,
    change: impl FnOnce(&mut Header, &mut Vec<f32>, &mut Vec<f32>),
) -> Bundle {
    let layout = Layout::named(layout, 9).unwrap();
    let (inputs, outputs) = (layout.input_len(), layout.output_len());
    let (mut weights, mut biases) = follower(&layout);
    let mut header = header(&layout);
    change(&mut header, &mut weights, &mut biases);
    let layer = Layer::new(0, inputs, outputs, &weights.repeat(4), &biases.repeat(4)).unwrap();
    let mut output_mean = vec![0.0; outputs];
    layout.encode_output(&stance(), &mut output_mean);
    // The mean is what a character starts in; the layer's own answer is on top of zero.
    let biases: Vec<f32> = biases.iter().zip(&output_mean).map(|(b, m)| b - m).collect();
    let layer = Layer::new(0, inputs, outputs, &layer.weights(), &biases.repeat(4)).unwrap();
    let normalisation = Normalisation {
        input_mean: vec![0.0; inputs],
        input_std: vec![1.0; inputs],
        output_mean,
        output_std: vec![1.0; outputs],
    };
    Bundle::new(header, Network::new(vec![layer], normalisation).unwrap()).unwrap()
}

fn model() -> Model {
    model_of("holden", |_, _, _| {})
}

fn model_of(layout: &str, change: impl FnOnce(&mut Header, &mut Vec<f32>, &mut Vec<f32>)) -> Model {
    Model::new(Arc::new(bundle_of(layout, change))).unwrap()
}

fn stroll(world: &World<'_>) -> Controller {
    Controller::new(model(), Tuning::default(), Vec2::ZERO, 0.0, world).unwrap()
}

/// A wish that changes all the time, as a player's does.
fn wandering(time: f32) -> Intent {
    let angle = 0.8 * (time * 0.7).sin();
    Intent { velocity: Vec2::new(angle.sin(), angle.cos()) * 1.4, ..Intent::default() }
}

fn globals(controller: &Controller) -> Vec<Transform> {
    let skeleton = controller.model().skeleton();
    let mut pose = skeleton.rest_pose();
    controller.pose(&mut pose);
    let mut global = vec![Transform::IDENTITY; skeleton.len()];
    pose.to_global(skeleton, &mut global);
    global
}

#[test]
fn goes_and_faces_where_it_is_asked_to() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.3), areas: &areas };
    let mut character = stroll(&world);
    let intent = Intent { velocity: Vec2::new(1.5, 0.0), ..Intent::default() };
    for _ in 0..300 {
        assert_eq!(character.step(STEP, &intent, &world).steps, 1);
    }
    let before = character.root();
    for _ in 0..60 {
        character.step(STEP, &intent, &world);
    }
    let root = character.root();
    assert!((root.position.x - before.position.x - 1.5).abs() < 0.1, "{root:?}");
    assert!((root.position.z - before.position.z).abs() < 0.1);
    assert!((root.yaw - std::f32::consts::FRAC_PI_2).abs() < 0.05, "faces +X: {}", root.yaw);
    assert!((root.position.y - 0.3).abs() < 1e-5, "on the ground");
    assert_eq!(character.contacts(), [0.9, 0.8, 0.2, 0.1]);
}

#[test]
fn strafing_faces_elsewhere_and_standing_stops() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let mut character = stroll(&world);
    let intent = Intent {
        velocity: Vec2::new(0.0, 1.0),
        facing: Some(Vec2::new(1.0, 0.0)),
        strafe: 1.0,
        gait: Gait::Walk,
    };
    for _ in 0..400 {
        character.step(STEP, &intent, &world);
    }
    assert!((character.root().yaw - std::f32::consts::FRAC_PI_2).abs() < 0.05);
    for _ in 0..600 {
        character.step(STEP, &Intent::default(), &world);
    }
    let before = character.root();
    character.step(STEP, &Intent::default(), &world);
    assert!(character.root().position.distance(before.position) < 1e-3, "stands");
}

/// The published layout has one input for jogging and running.
#[test]
fn running_is_jogging_where_the_layout_has_one_input() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let walk = |gait: Gait| {
        let mut character = stroll(&world);
        for frame in 0..300 {
            let intent = Intent { gait, ..wandering(frame as f32 * STEP) };
            character.step(STEP, &intent, &world);
        }
        (character.root(), globals(&character))
    };
    assert_eq!(walk(Gait::Run), walk(Gait::Jog));
}

/// What a network is told of the gait reaches it in its own input.
#[test]
fn the_ambulo_layout_tells_running_from_jogging() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let layout = Layout::ambulo(9).unwrap();
    let inputs = layout.input_len();
    // The hips rise by 20 cm when jogging, by 40 when running, by 60 when crouching.
    let gaits = [("gait_jog", 0.2), ("gait_run", 0.4), ("gait_crouch", 0.6)];
    let model = model_of("ambulo", |_, weights, _| {
        for (name, rise) in gaits {
            weights[at(layout.outputs(), "joint_position", 1) * inputs
                + at(layout.inputs(), name, 6)] = rise;
        }
    });
    let hips = |gait: Gait, speed: f32| {
        let mut character =
            Controller::new(model.clone(), model.tuning(), Vec2::ZERO, 0.0, &world).unwrap();
        let intent = Intent { velocity: Vec2::new(0.0, speed), gait, ..Intent::default() };
        for _ in 0..180 {
            assert_eq!(character.step(STEP, &intent, &world).event, None);
        }
        globals(&character)[0].translation.y - 0.95
    };
    for (gait, speed, rise) in [
        (Gait::Walk, 1.5, 0.0),
        (Gait::Jog, 3.0, 0.2),
        (Gait::Run, 5.0, 0.4),
        (Gait::Crouch, 1.0, 0.6),
        (Gait::Auto, 1.5, 0.0),
        (Gait::Auto, 2.1, 0.1),
        (Gait::Auto, 3.0, 0.2),
        (Gait::Auto, 3.9, 0.3),
        (Gait::Auto, 5.0, 0.4),
    ] {
        let got = hips(gait, speed);
        assert!((got - rise).abs() < 2e-3, "{gait:?} at {speed} m/s: {got}");
    }
}

/// The ankles of the shown pose are where the network has them, on bones of the skeleton's length.
#[test]
fn feet_are_where_the_network_puts_them() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.25), areas: &areas };
    let character = stroll(&world);
    let global = globals(&character);
    for (joint, x) in [(3, 0.1), (7, -0.1)] {
        let expected = Vec3::new(x, 0.09 + 0.25, 0.0);
        assert!(global[joint].translation.abs_diff_eq(expected, 1e-3), "{:?}", global[joint]);
        let shin = global[joint].translation.distance(global[joint - 1].translation);
        assert!((shin - 0.42).abs() < 1e-4, "the bone keeps its length");
        assert!(global[joint - 1].translation.z > 0.02, "the knee bends forward");
    }
}

/// A foot in contact stands still while the body goes on, and comes after when it is left behind;
/// one in the air goes with the body.
#[test]
fn feet_in_contact_stay_where_they_stand() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    // (how far the root has gone, left toe, right toe), frame by frame.
    let walk = |hold_feet: bool| -> Vec<(f32, Vec3, Vec3)> {
        let tuning = Tuning { hold_feet, ..Tuning::default() };
        let mut character = Controller::new(model(), tuning, Vec2::ZERO, 0.0, &world).unwrap();
        let row = |character: &mut Controller| {
            character.step(STEP, &wandering(0.0), &world);
            let global = globals(character);
            (character.root().position.length(), global[4].translation, global[8].translation)
        };
        (0..240).map(|_| row(&mut character)).collect()
    };
    let (held, loose) = (walk(true), walk(false));
    let at = |rows: &[(f32, Vec3, Vec3)], gone: f32| *rows.iter().find(|r| r.0 >= gone).unwrap();
    let moved = |rows: &[(f32, Vec3, Vec3)], gone: f32| {
        let (_, left, right) = at(rows, gone);
        [left.distance(rows[0].1), right.distance(rows[0].2)]
    };
    let [left, right] = moved(&held, 0.08);
    assert!(left < 0.02 && right > 0.07, "the left is held, the right is not: {left} {right}");
    assert!(moved(&loose, 0.08)[0] > 0.07);
    let last = held.len() - 1;
    assert!(held[last].1.distance(loose[last].1) < 1e-2, "caught up");
    let jump = held.windows(2).map(|w| w[0].1.distance(w[1].1)).fold(0.0, f32::max);
    assert!(jump < 0.09, "without a jump: {jump}");
}

/// Ground that comes up between the samples of the trajectory lifts the foot, not through it.
#[test]
fn feet_stay_above_the_ground() {
    struct Kerb;
    impl Terrain for Kerb {
        fn height(&self, x: f32, _: f32) -> f32 {
            if (0.05..0.15).contains(&x) { 0.1 } else { 0.0 }
        }
    }
    let areas = Areas::default();
    let character = stroll(&World { terrain: &Kerb, areas: &areas });
    let [left, right] = [4, 8].map(|toe| globals(&character)[toe].translation.y);
    assert!((left - 0.12).abs() < 2e-3, "half a foot's thickness above the kerb: {left}");
    assert!((right - 0.04).abs() < 2e-3, "{right}");
}

/// A skeleton whose feet are one joint each: heel and toe are the same.
#[test]
fn feet_without_toes_are_held_and_lifted_too() {
    let areas = Areas::default();
    let toeless = || {
        model_of("holden", |header, _, _| {
            let feet = Feet { joints: [3, 3, 7, 7], heights: [0.09; 4] };
            header.parts.insert("feet".into(), serde_json::to_value(feet).unwrap());
        })
    };
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let mut character =
        Controller::new(toeless(), Tuning::default(), Vec2::ZERO, 0.0, &world).unwrap();
    let start = globals(&character)[3].translation;
    while character.root().position.length() < 0.08 {
        assert_eq!(character.step(STEP, &wandering(0.0), &world).event, None);
    }
    let slid = globals(&character)[3].translation.distance(start);
    assert!(slid < 0.02, "held at the ankle: {slid}");
    // Ground that comes up by more than the network knows lifts the ankle.
    struct Stone(f32);
    impl Terrain for Stone {
        fn height(&self, _: f32, z: f32) -> f32 {
            if (z - self.0).abs() < 0.05 { 0.1 } else { 0.0 }
        }
    }
    let stone = Stone(globals(&character)[3].translation.z);
    let world = World { terrain: &stone, areas: &areas };
    (0..2).for_each(|_| assert_eq!(character.step(STEP, &wandering(0.0), &world).event, None));
    let lifted = globals(&character)[3].translation.y;
    assert!((lifted - 0.1 - 0.045).abs() < 2e-3, "above the stone: {lifted}");
}

/// Feet that hang on the hips themselves have no legs to bend; the pose is the network's own.
#[test]
fn skeletons_without_legs_are_shown_as_they_are() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let model = model_of("holden", |header, _, _| {
        let feet = Feet { joints: [1, 1, 5, 5], heights: [0.1; 4] };
        header.parts.insert("feet".into(), serde_json::to_value(feet).unwrap());
    });
    let mut character = Controller::new(model, Tuning::default(), Vec2::ZERO, 0.0, &world).unwrap();
    for frame in 0..120 {
        let intent = wandering(frame as f32 * STEP);
        assert_eq!(character.step(STEP, &intent, &world).event, None);
    }
    let hips = globals(&character)[0].translation;
    assert!((hips.y - 0.95).abs() < 1e-4 && character.root().position.length() > 1.0);
}

#[test]
fn every_rate_walks_the_same_path() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let walk = |next: &mut dyn FnMut() -> f32| -> Vec<(f32, Root)> {
        let mut character = stroll(&world);
        let mut time = 0.0;
        let mut path = vec![];
        while time < 20.0 {
            let dt = next();
            character.step(dt, &wandering(time), &world);
            time += dt;
            path.push((time, character.root()));
        }
        path
    };
    let reference = walk(&mut || STEP);
    let length: f32 = reference.windows(2).map(|w| w[0].1.position.distance(w[1].1.position)).sum();
    assert!(length > 20.0);
    let mut state = 7u32;
    let mut irregular = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.002 + (state >> 16) as f32 / 65536.0 * 0.05
    };
    for (name, path) in [
        ("30", walk(&mut || 1.0 / 30.0)),
        ("144", walk(&mut || 1.0 / 144.0)),
        ("irregular", walk(&mut irregular)),
    ] {
        for (time, root) in path.iter().filter(|(time, _)| *time > 0.1 && *time < 19.9) {
            let index = (time / STEP - 1.0).round() as usize;
            let away = root.position.distance(reference[index].1.position);
            // Half a frame of walking, and one per cent of the path.
            assert!(away < 0.012 + 0.01 * length, "{name} at {time}: {away}");
        }
        let (time, last) = path.last().unwrap();
        let end = reference.last().unwrap().1;
        assert!(last.position.distance(end.position) < 0.01 * length, "{name} at {time}");
    }
}

#[test]
fn poses_between_steps_are_interpolated() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let mut character = stroll(&world);
    let intent = wandering(0.0);
    for _ in 0..120 {
        character.step(STEP, &intent, &world);
    }
    let turning = Intent { velocity: Vec2::new(-1.0, 0.5), ..intent };
    for _ in 0..6 {
        character.step(STEP, &turning, &world);
    }
    let start = (character.root(), character.phase());
    assert_eq!(character.step(STEP / 4.0, &turning, &world).steps, 0);
    let after = (character.root(), character.phase());
    for _ in 0..3 {
        character.step(STEP / 4.0, &turning, &world);
    }
    let whole = (character.root(), character.phase());
    let way = |at: (Root, f32)| at.0.position.distance(start.0.position);
    assert!((way(after) / way(whole) - 0.25).abs() < 0.02);
    let turn = |at: (Root, f32)| at.0.yaw - start.0.yaw;
    assert!(turn(whole).abs() > 1e-3 && (turn(after) / turn(whole) - 0.25).abs() < 0.02);
    let gone = |at: (Root, f32)| (at.1 - start.1).rem_euclid(std::f32::consts::TAU);
    assert!(gone(whole) > 0.05 && (gone(after) / gone(whole) - 0.25).abs() < 0.02);
}

struct Broken;

impl Terrain for Broken {
    fn height(&self, _: f32, _: f32) -> f32 {
        f32::NAN
    }
}

/// Bad input holds the last good pose, says so, and leaves no trace, at any rate of the caller's.
#[test]
fn bad_input_never_enters_the_state() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let broken = World { terrain: &Broken, areas: &areas };
    let nan = Intent { velocity: Vec2::new(f32::NAN, 0.0), ..Intent::default() };
    let huge = Intent { velocity: Vec2::new(0.0, 1e38), ..Intent::default() };
    let no_facing = Intent { facing: Some(Vec2::ZERO), ..Intent::default() };
    let strafe = Intent { strafe: 2.0, ..Intent::default() };
    let held = |reason| Some(Event::Held(reason));
    for step in [STEP, 1.0 / 144.0, 1.0 / 37.0] {
        let (mut disturbed, mut calm) = (stroll(&world), stroll(&world));
        for frame in 0..240 {
            let intent = wandering(frame as f32 * step);
            let before = globals(&disturbed);
            for bad in [nan, huge, no_facing, strafe] {
                assert_eq!(disturbed.step(step, &bad, &world).event, held(Held::Intent));
            }
            for dt in [f32::NAN, f32::INFINITY, -0.1] {
                assert_eq!(disturbed.step(dt, &intent, &world).event, held(Held::Time));
            }
            if frame == 120 {
                // Long enough for a fixed step, whatever has gathered so far.
                assert_eq!(disturbed.step(STEP, &intent, &broken).event, held(Held::Terrain));
            }
            assert_eq!(globals(&disturbed), before, "the pose is held");
            assert_eq!(disturbed.step(step, &intent, &world).event, None);
            calm.step(step, &intent, &world);
            assert_eq!(disturbed.root(), calm.root());
            assert_eq!(globals(&disturbed), globals(&calm), "as if nothing had happened");
        }
    }
}

#[test]
fn a_network_that_explodes_is_held() {
    let layout = Layout::holden(9).unwrap();
    let head = at(layout.outputs(), "joint_position", 12);
    let wild = at(layout.inputs(), "trajectory_z", 11);
    let inputs = layout.input_len();
    // Walking makes one joint fly off; standing does not.
    let exploding = bundle(|_, weights, _| weights[head * inputs + wild] = 1e3);
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let model = Model::new(Arc::new(exploding)).unwrap();
    let mut character = Controller::new(model, Tuning::default(), Vec2::ZERO, 0.0, &world).unwrap();
    assert_eq!(character.step(STEP, &Intent::default(), &world).event, None);
    let mut reasons = vec![];
    for _ in 0..60 {
        reasons.push(character.step(STEP, &wandering(0.0), &world).event);
        assert!(globals(&character).iter().all(|t| t.is_finite() && t.translation.length() < 10.0));
    }
    assert_eq!(*reasons.last().unwrap(), Some(Event::Held(Held::Network)));
}

#[test]
fn long_pauses_are_cut() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let mut character = stroll(&world);
    let step = character.step(3.0, &wandering(0.0), &world);
    assert_eq!(step.steps, 60);
    assert_eq!(step.event, Some(Event::Skipped(2.0)));
    assert_eq!(character.step(2e7, &wandering(0.0), &world).steps, 60);
    assert_eq!(character.step(0.0, &wandering(0.0), &world).steps, 0);
}

#[test]
fn the_callers_pose_is_a_copy() {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let (mut touched, mut left_alone) = (stroll(&world), stroll(&world));
    let mut pose = Pose { local: vec![] };
    for _ in 0..30 {
        touched.step(STEP, &wandering(1.0), &world);
        left_alone.step(STEP, &wandering(1.0), &world);
        touched.pose(&mut pose);
        pose.local.iter_mut().for_each(|t| t.rotation = Quat::from_rotation_x(1.0));
    }
    assert_eq!(globals(&touched), globals(&left_alone));
}

#[test]
fn refuses_bundles_that_do_not_fit() {
    let refused = |change: fn(&mut Header, &mut Vec<f32>, &mut Vec<f32>)| {
        Model::new(Arc::new(bundle(change))).unwrap_err()
    };
    let swapped = refused(|header, _, _| header.layout.inputs.swap(0, 1));
    assert_eq!(
        swapped.to_string(),
        "the bundle was made for another layout: input block 0 is 'trajectory_z (12)', this \
         version expects 'trajectory_x (12)'"
    );
    let hash = refused(|header, _, _| header.layout.hash = "0".into());
    assert!(matches!(hash, ControlError::Layout(_)));
    let name = refused(|header, _, _| header.layout.name = "mann".into());
    assert!(name.to_string().contains("'mann' is not known"));
    let rate = refused(|header, _, _| header.fps = 30.0);
    assert!(matches!(rate, ControlError::Rate { .. }));
    let bare = refused(|header, _, _| {
        header.parts.remove("skeleton");
    });
    assert!(matches!(bare, ControlError::Missing("skeleton")));
    let feet =
        refused(|header, _, _| header.parts.get_mut("feet").unwrap()["joints"][0] = 99.into());
    assert!(matches!(feet, ControlError::Broken { part: "feet", .. }));
    let tuned = |json: &str| {
        let tuning: serde_json::Value = serde_json::from_str(json).unwrap();
        let with = |header: &mut Header| header.parts.insert("tuning".into(), tuning);
        let made = Model::new(Arc::new(bundle(|header, _, _| {
            with(header);
        })));
        made.map(|model| model.tuning()).map_err(|error| error.to_string())
    };
    assert_eq!(
        tuned(r#"{"stand_freedom": 2}"#).unwrap_err(),
        "the bundle's 'tuning' part is broken: a number that is out of range"
    );
    let unknown = tuned(r#"{"stand_fredom": 1}"#).unwrap_err();
    assert!(unknown.contains("'tuning' part is broken: unknown field `stand_fredom`"), "{unknown}");
    let freer = Tuning { stand_freedom: 1.0, ..Tuning::default() };
    assert_eq!(tuned(r#"{"stand_freedom": 1}"#).unwrap(), freer);
    assert_eq!(model().tuning(), Tuning::default());
    let loops = refused(|header, _, _| {
        header.parts.get_mut("skeleton").unwrap()[1]["parent"] = 5.into();
    });
    assert!(loops.to_string().contains("parent must come before"), "{loops}");
}

#[test]
fn refuses_starts_and_tunings_that_cannot_be_used() {
    let areas = Areas::default();
    let broken = World { terrain: &Broken, areas: &areas };
    let start = Controller::new(model(), Tuning::default(), Vec2::ZERO, 0.0, &broken);
    assert!(matches!(start, Err(ControlError::Start)));
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let tuning = Tuning { pose_halflife: -1.0, ..Tuning::default() };
    let tuned = Controller::new(model(), tuning, Vec2::ZERO, 0.0, &world);
    assert!(matches!(tuned, Err(ControlError::Tuning)));
}

/// The same wishes give the same bits, in every build: this hash changes only with the arithmetic.
/// (Sine, cosine and powers come from the system's mathematics library, hence the one platform.)
#[test]
#[cfg(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu"))]
fn a_walk_has_a_golden_hash() {
    let hills = ambulo_rig::HeightField::hills(11, 60.0, 2.0).unwrap();
    let areas = Areas::default();
    let world = World { terrain: &hills, areas: &areas };
    let mut character = stroll(&world);
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    for frame in 0..900 {
        character.step(STEP, &wandering(frame as f32 * STEP), &world);
        for transform in globals(&character) {
            let numbers = transform.translation.to_array().into_iter();
            for number in numbers.chain(transform.rotation.to_array()) {
                hash = (hash ^ u64::from(number.to_bits())).wrapping_mul(0x0100_0000_01b3);
            }
        }
    }
    assert_eq!(format!("{hash:016x}"), "5de618f7658817c6");
}

fn gone(tuning: Tuning, velocity: Vec2, seconds: u32) -> f32 {
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let mut character = Controller::new(model(), tuning, Vec2::ZERO, 0.0, &world).unwrap();
    let intent = Intent { velocity, ..Intent::default() };
    let mut way = 0.0;
    let mut before = character.root().position;
    for _ in 0..seconds * 60 {
        character.step(STEP, &intent, &world);
        way += character.root().position.distance(before);
        before = character.root().position;
    }
    way
}

/// The follower's feet never leave the ground and slide along with it: driven by them it goes
/// slower, but no slower than the floor that keeps any network going; and asks for more speed.
#[test]
fn planted_feet_hold_the_root_back() {
    let ahead = Vec2::new(0.0, 1.0);
    let free = gone(Tuning::default(), ahead, 6);
    let driven = Tuning { foot_drive: 0.5, ..Tuning::default() };
    let held = gone(driven, ahead, 6);
    assert!(held < 0.75 * free && held > 0.6 * free, "{held} of {free}");
    let corrected = Tuning { speed_limit: [0.7, 1.5], speed_halflife: 0.5, ..driven };
    let reached = gone(corrected, ahead, 12) - gone(corrected, ahead, 6);
    assert!((reached / 6.0 - 1.0).abs() < 0.05, "{reached} m in 6 s");
}

#[test]
fn a_stander_sways_and_stays() {
    let tuning = Tuning { sway: 0.04, stand_freedom: 1.0, ..Tuning::default() };
    let areas = Areas::default();
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let place = Vec2::new(2.0, 3.0);
    let mut character = Controller::new(model(), tuning, place, 0.0, &world).unwrap();
    let mut farthest = 0.0f32;
    for _ in 0..60 * 60 {
        character.step(STEP, &Intent::default(), &world);
        let at = character.root().position;
        farthest = farthest.max(Vec2::new(at.x, at.z).distance(place));
    }
    assert!(farthest > 0.02 && farthest < 0.12, "{farthest} m from its place");
    assert!(gone(Tuning::default(), Vec2::ZERO, 3) < 1e-6, "as published: frozen");
}

#[test]
fn a_model_knows_how_it_stands() {
    let stance = model().stance().unwrap();
    let expected = self::stance();
    assert!(stance[0].translation.abs_diff_eq(expected.joint_position[0], 0.02), "{:?}", stance[0]);
    // The left toes are in contact 4 cm above the ground; the right ones never are, and are put at
    // the height that the bundle says.
    let toes = [4, 8].map(|toe| stance[toe].translation.y);
    assert!((toes[0] - 0.04).abs() < 0.02 && (toes[1] - 0.04).abs() < 0.02, "{toes:?}");
    let thighs = [1, 5].map(|thigh| stance[thigh].translation.x);
    assert!(thighs[0] > 0.05 && thighs[1] < -0.05, "it faces +Z: {thighs:?}");
}
