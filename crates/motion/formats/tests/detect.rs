//! What is told of a clip's axes, unit and first frame.

use ambulo_formats::Positions;
use ambulo_formats::detect::{Detected, PositionsFit, detect};
use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Axes, Axis, Clip, Handedness, Joint, Skeleton};

/// A person of 1.7 m who stands in a T-pose facing +Z, and then turns and drops the arms.
fn person(names: [&str; 12]) -> Clip {
    let joint = |n: usize, parent: Option<usize>, x: f64, y: f64, z: f64| Joint {
        name: names[n].into(),
        parent,
        offset: DVec3::new(x, y, z),
        tips: vec![],
    };
    let skeleton = Skeleton::new(vec![
        joint(0, None, 0.0, 0.0, 0.0),
        joint(1, Some(0), 0.0, 0.6, 0.0),
        joint(2, Some(0), 0.1, -0.05, 0.0),
        joint(3, Some(2), 0.0, -0.8, 0.0),
        joint(4, Some(3), 0.0, -0.05, 0.15),
        joint(5, Some(0), -0.1, -0.05, 0.0),
        joint(6, Some(5), 0.0, -0.8, 0.0),
        joint(7, Some(6), 0.0, -0.05, 0.15),
        joint(8, Some(0), 0.2, 0.5, 0.0),
        joint(9, Some(8), 0.5, 0.0, 0.0),
        joint(10, Some(0), -0.2, 0.5, 0.0),
        joint(11, Some(10), -0.5, 0.0, 0.0),
    ])
    .unwrap();
    let frames = 100;
    let (mut rotations, mut places) = (vec![], vec![]);
    for frame in 0..frames {
        let t = f64::from(frame) / f64::from(frames);
        let mut pose = vec![DQuat::IDENTITY; 12];
        pose[0] = DQuat::from_rotation_y(0.5 * t);
        pose[8] = DQuat::from_rotation_z(-1.4 * t);
        pose[10] = DQuat::from_rotation_z(1.4 * t);
        rotations.extend(pose);
        places.push(DVec3::new(t, 0.95, 2.0 * t));
    }
    Clip::new(skeleton, 0.01, vec![0], places, rotations).unwrap()
}

const MIXAMO: [&str; 12] = [
    "mixamorig:Hips",
    "mixamorig:Head",
    "mixamorig:LeftUpLeg",
    "mixamorig:LeftFoot",
    "mixamorig:LeftToeBase",
    "mixamorig:RightUpLeg",
    "mixamorig:RightFoot",
    "mixamorig:RightToeBase",
    "mixamorig:LeftArm",
    "mixamorig:LeftHand",
    "mixamorig:RightArm",
    "mixamorig:RightHand",
];
const BANDAI: [&str; 12] = [
    "Hips",
    "Head",
    "UpperLeg_L",
    "Foot_L",
    "Toes_L",
    "UpperLeg_R",
    "Foot_R",
    "Toes_R",
    "UpperArm_L",
    "Hand_L",
    "UpperArm_R",
    "Hand_R",
];
const CMU: [&str; 12] = [
    "root", "head", "lfemur", "lfoot", "ltoes", "rfemur", "rfoot", "rtoes", "lhumerus", "lhand",
    "rhumerus", "rhand",
];
const XSENS: [&str; 12] = [
    "Hips",
    "Head",
    "LeftHip",
    "LeftAnkle",
    "LeftToe",
    "RightHip",
    "RightAnkle",
    "RightToe",
    "LeftShoulder",
    "LeftWrist",
    "RightShoulder",
    "RightWrist",
];

fn told(clip: &Clip) -> Detected {
    detect(clip, Positions::Replace)
}

#[test]
fn axes_unit_and_first_frame_in_every_naming() {
    for names in [MIXAMO, BANDAI, CMU, XSENS] {
        let told = told(&person(names));
        assert_eq!(told.up.map(|up| (up.axis, up.share)), Some((Axis::PosY, 1.0)), "{names:?}");
        assert_eq!(told.forward.map(|ahead| ahead.axis), Some(Axis::PosZ));
        assert_eq!(told.handedness, Some(Handedness::Right));
        assert!((told.hips_height.unwrap() - 0.9).abs() < 1e-9);
        assert_eq!(told.metres_per_unit, Some(1.0));
        assert!(told.t_pose_first_frame);
        assert_eq!(told.notes, [""; 0]);
    }
}

#[test]
fn every_system_is_told_apart() {
    for (name, axes) in Axes::PRESETS {
        let clip = person(MIXAMO).converted(&Axes::CANONICAL.to(axes).unwrap());
        let told = told(&clip);
        assert_eq!(told.up.map(|up| up.axis), Some(axes.up), "{name}");
        assert_eq!(told.forward.map(|ahead| ahead.axis), Some(axes.forward), "{name}");
        assert_eq!(told.handedness, Some(axes.handedness), "{name}");
        let unit = told.metres_per_unit.unwrap();
        assert!((unit / axes.metres_per_unit - 1.0).abs() < 1e-3, "{name}: {unit}");
        let preset = Axes::named(told.preset().unwrap()).unwrap();
        assert_eq!((preset.up, preset.handedness), (axes.up, axes.handedness), "{name}");
        assert!((unit / preset.metres_per_unit - 1.0).abs() < 1e-3, "{name}");
        assert_eq!(told.notes.is_empty(), axes.handedness == Handedness::Right, "{name}");
    }
}

#[test]
fn a_pose_with_hanging_arms_is_no_t_pose() {
    let clip = person(MIXAMO).slice(90, 100).unwrap();
    assert!(!told(&clip).t_pose_first_frame);
}

#[test]
fn one_arm_down_or_both_ahead_is_no_t_pose() {
    let down = |side: f64| DQuat::from_rotation_z(-1.4 * side);
    let ahead = |side: f64| DQuat::from_rotation_y(-1.4 * side);
    let level = |_: f64| DQuat::IDENTITY;
    let sloping = |side: f64| DQuat::from_rotation_z(-0.35 * side);
    let posed = |left: &dyn Fn(f64) -> DQuat, right: &dyn Fn(f64) -> DQuat| {
        let mut rotations = vec![DQuat::IDENTITY; 12];
        (rotations[8], rotations[10]) = (left(1.0), right(-1.0));
        let skeleton = person(MIXAMO).skeleton().clone();
        let clip = Clip::new(skeleton, 0.01, vec![], vec![], rotations).unwrap();
        told(&clip).t_pose_first_frame
    };
    assert!(posed(&level, &level));
    assert!(!posed(&down, &level) && !posed(&level, &down));
    assert!(!posed(&sloping, &level) && !posed(&level, &sloping));
    assert!(!posed(&ahead, &level) && !posed(&level, &ahead) && !posed(&ahead, &ahead));
}

#[test]
fn what_is_no_person_gets_no_unit() {
    let child = told(&person(MIXAMO).scaled(0.5));
    assert_eq!(child.metres_per_unit, None);
    assert_eq!(child.notes, ["hips 0.450 units high fit no unit: not a grown person?"]);
    let names = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l"];
    let nameless = told(&person(names));
    assert_eq!((nameless.up, nameless.forward, nameless.metres_per_unit), (None, None, None));
    assert!(!nameless.t_pose_first_frame);
    assert_eq!(nameless.notes.len(), 2);
}

#[test]
fn a_body_that_lies_along_its_spine_goes_by_its_legs() {
    // On all fours: the head ahead, the feet below.
    let mut joints: Vec<Joint> = person(MIXAMO).skeleton().joints().to_vec();
    joints[1].offset = DVec3::new(0.0, 0.1, 0.6);
    let clip = person(MIXAMO);
    let rotations = (0..clip.frames()).flat_map(|f| clip.rotations(f).to_vec()).collect();
    let places = (0..clip.frames()).flat_map(|f| clip.translations(f).to_vec()).collect();
    let skeleton = Skeleton::new(joints).unwrap();
    let told = told(&Clip::new(skeleton, 0.01, vec![0], places, rotations).unwrap());
    assert_eq!(told.up.map(|up| up.axis), Some(Axis::PosY));
    assert!(told.notes[0].contains("four-footed"), "{:?}", told.notes);
}

#[test]
fn position_channels_are_told_by_the_lengths_of_bones() {
    let with = |channels: &dyn Fn(DVec3, f64) -> DVec3, read_as| {
        let clip = person(MIXAMO);
        let rotations = (0..clip.frames()).flat_map(|f| clip.rotations(f).to_vec()).collect();
        let offset = |joint: usize| clip.skeleton().joints()[joint].offset;
        let places = (0..clip.frames()).flat_map(|f| {
            let t = f as f64 / 100.0;
            // As the reader has it: an added offset is within the translation.
            let base = |joint| if read_as == Positions::Add { offset(joint) } else { DVec3::ZERO };
            [3, 9].map(|joint| base(joint) + channels(offset(joint), t))
        });
        let skeleton = clip.skeleton().clone();
        let places = places.collect();
        let clip = Clip::new(skeleton, 0.01, vec![3, 9], places, rotations).unwrap();
        detect(&clip, read_as).positions
    };
    for read_as in [Positions::Replace, Positions::Add] {
        assert_eq!(with(&|offset, _| offset, read_as), PositionsFit::Replace);
        assert_eq!(with(&|_, _| DVec3::ZERO, read_as), PositionsFit::Add);
        assert_eq!(with(&|offset, t| offset * (1.0 + 3.0 * t), read_as), PositionsFit::Unclear);
    }
    assert_eq!(told(&person(MIXAMO)).positions, PositionsFit::Unneeded);
}
