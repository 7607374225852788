//! Made-up people for the tests: their left is +X, they face +Z, metres.
#![allow(dead_code)] // Each test uses some.

use ambulo_rig::glam::{DVec3, Quat, Vec3};
use ambulo_rig::{Joint, Pose, Skeleton, Transform, two_bone};

type Bone = (&'static str, &'static str, [f64; 3]);

/// The left half is written down, the right half is its mirror image.
fn skeleton(bones: &[Bone]) -> Skeleton {
    let mut joints: Vec<Joint> = vec![];
    let mut add = |name: String, parent: String, offset: [f64; 3]| {
        let parent = joints.iter().position(|joint| joint.name == parent);
        joints.push(Joint { name, parent, offset: DVec3::from_array(offset), tips: vec![] });
    };
    for &(name, parent, offset) in bones {
        add(name.into(), parent.into(), offset);
    }
    for &(name, parent, [x, y, z]) in bones.iter().filter(|bone| bone.0.starts_with("Left")) {
        let [name, parent] = [name, parent].map(|name| name.replace("Left", "Right"));
        add(name, parent, [-x, y, z]);
    }
    Skeleton::new(joints).unwrap()
}

/// 22 joints in T; nothing tells how long hands and toes are.
pub fn plain() -> Skeleton {
    skeleton(&[
        ("Hips", "", [0.0, 0.0, 0.0]),
        ("LeftUpLeg", "Hips", [0.092, -0.02, 0.0]),
        ("LeftLeg", "LeftUpLeg", [0.0, -0.43, 0.0]),
        ("LeftFoot", "LeftLeg", [0.0, -0.42, 0.0]),
        ("LeftToe", "LeftFoot", [0.0, -0.057, 0.145]),
        ("Spine", "Hips", [0.0, 0.085, -0.012]),
        ("Spine1", "Spine", [0.0, 0.115, -0.004]),
        ("Spine2", "Spine1", [0.0, 0.115, -0.002]),
        ("Neck", "Spine2", [0.0, 0.225, -0.004]),
        ("Head", "Neck", [0.0, 0.11, 0.022]),
        ("LeftShoulder", "Spine2", [0.05, 0.165, 0.004]),
        ("LeftArm", "LeftShoulder", [0.125, -0.006, -0.008]),
        ("LeftForeArm", "LeftArm", [0.3, 0.0, 0.0]),
        ("LeftHand", "LeftForeArm", [0.255, 0.0, 0.0]),
    ])
}

/// Legs 20° apart, the hips behind them, joints that are only helpers, a shorter trunk.
pub fn splayed() -> Skeleton {
    skeleton(&[
        ("Hips", "", [0.0, 0.0, 0.0]),
        ("LeftHipJoint", "Hips", [0.0, 0.0, 0.0]),
        ("LeftUpLeg", "LeftHipJoint", [0.08, -0.1, 0.05]),
        ("LeftUpLegTwist", "LeftUpLeg", [0.07, -0.19, 0.0]),
        ("LeftLeg", "LeftUpLegTwist", [0.07, -0.19, 0.0]),
        ("LeftFoot", "LeftLeg", [0.14, -0.38, 0.0]),
        ("LeftToeBase", "LeftFoot", [0.01, -0.026, 0.13]),
        ("LowerBack", "Hips", [0.0, 0.0, 0.0]),
        ("Spine", "LowerBack", [0.0, 0.11, -0.01]),
        ("Spine1", "Spine", [0.0, 0.12, 0.0]),
        ("Neck", "Spine1", [0.0, 0.0, 0.0]),
        ("Neck1", "Neck", [0.0, 0.1, 0.01]),
        ("Head", "Neck1", [0.0, 0.1, -0.01]),
        ("LeftShoulder", "Spine1", [0.0, 0.0, 0.0]),
        ("LeftArm", "LeftShoulder", [0.18, 0.07, -0.02]),
        ("LeftForeArm", "LeftArm", [0.28, 0.0, 0.0]),
        ("LeftForeArmRoll", "LeftForeArm", [0.1, 0.0, 0.0]),
        ("LeftHand", "LeftForeArmRoll", [0.1, 0.0, 0.0]),
        ("LeftFingerBase", "LeftHand", [0.0, 0.0, 0.0]),
        ("LeftHandIndex1", "LeftFingerBase", [0.04, 0.0, 0.0]),
    ])
}

/// Arms in A, a root on the floor, bent knees and elbows at rest, fingers, taller.
pub fn a_pose() -> Skeleton {
    skeleton(&[
        ("Armature", "", [0.0, 0.0, 0.0]),
        ("Hips", "Armature", [0.0, 1.1, 0.0]),
        ("LeftUpperLeg", "Hips", [0.1, -0.04, 0.01]),
        ("LeftLowerLeg", "LeftUpperLeg", [0.02, -0.49, 0.02]),
        ("LeftFoot", "LeftLowerLeg", [0.01, -0.47, -0.03]),
        ("LeftToes", "LeftFoot", [0.03, -0.06, 0.15]),
        ("Spine", "Hips", [0.0, 0.1, 0.0]),
        ("Chest", "Spine", [0.0, 0.15, -0.01]),
        ("UpperChest", "Chest", [0.0, 0.15, 0.01]),
        ("Spine4", "UpperChest", [0.0, 0.05, 0.01]),
        ("Neck", "Spine4", [0.0, 0.12, 0.0]),
        ("Head", "Neck", [0.0, 0.1, 0.02]),
        ("LeftShoulder", "Spine4", [0.04, 0.08, 0.0]),
        ("LeftUpperArm", "LeftShoulder", [0.14, -0.02, 0.0]),
        ("LeftLowerArm", "LeftUpperArm", [0.22, -0.22, 0.0]),
        ("LeftHand", "LeftLowerArm", [0.18, -0.2, 0.04]),
        ("LeftMiddle", "LeftHand", [0.09, -0.1, 0.02]),
    ])
}

pub fn find(skeleton: &Skeleton, name: &str) -> usize {
    skeleton.find(name).unwrap_or_else(|| panic!("no {name}"))
}

pub fn global(skeleton: &Skeleton, pose: &Pose) -> Vec<Transform> {
    let mut global = vec![Transform::IDENTITY; skeleton.len()];
    pose.to_global(skeleton, &mut global);
    global
}

/// The plain person with both feet flat on the floor below the thighs, knees bent by the angles of
/// `bend`, trunk and arms turned.
pub fn standing(bend: f32, trunk: f32, arms: [Quat; 2]) -> Pose {
    let skeleton = plain();
    let mut pose = skeleton.rest_pose();
    let shin = (0.43 / 0.42 * bend.sin()).asin();
    let mut turn = |name: &str, turn: Quat| pose.local[find(&skeleton, name)].rotation = turn;
    for side in ["Left", "Right"] {
        turn(&format!("{side}UpLeg"), Quat::from_rotation_x(-bend));
        turn(&format!("{side}Leg"), Quat::from_rotation_x(bend + shin));
        turn(&format!("{side}Foot"), Quat::from_rotation_x(-shin));
    }
    for name in ["Spine", "Spine1", "Spine2", "Neck", "Head"] {
        turn(name, Quat::from_rotation_x(0.2 * trunk) * Quat::from_rotation_y(0.1 * trunk));
    }
    turn("LeftArm", arms[0]);
    turn("RightArm", arms[1]);
    turn("LeftForeArm", Quat::from_rotation_y(-0.7));
    turn("RightHand", Quat::from_rotation_x(0.4));
    pose.local[0].translation.y = 0.02 + 0.43 * bend.cos() + 0.42 * shin.cos() + SOLE + 0.057;
    pose
}

/// The plain person with its hips there and flat feet on the floor at x, z of `ankles`.
pub fn planted(hips: Vec3, ankles: [[f32; 2]; 2]) -> Pose {
    let skeleton = plain();
    let mut pose = standing(0.3, 0.5, arms(0.5));
    pose.local[0].translation = hips;
    for (side, [x, z]) in ["Left", "Right"].into_iter().zip(ankles) {
        let joints = ["UpLeg", "Leg", "Foot"].map(|bone| find(&skeleton, &format!("{side}{bone}")));
        let mut places = global(&skeleton, &pose);
        let chain = joints.map(|joint| places[joint].translation);
        let target = Vec3::new(x, SOLE + 0.057, z);
        let turns = two_bone(chain, target, Vec3::NEG_X, false);
        let turned = joints.map(|joint| places[joint].rotation);
        let wanted = [turns[0] * turned[0], turns[1] * turned[1], turned[2]];
        for (joint, wanted) in joints.into_iter().zip(wanted) {
            pose.turn_to(&skeleton, joint, wanted, &mut places);
        }
    }
    pose
}

/// From the floor to the plain person's balls, metres.
pub const SOLE: f32 = 0.03;

pub fn arms(raised: f32) -> [Quat; 2] {
    [Quat::from_rotation_z(raised), Quat::from_axis_angle(Vec3::Z, 1.2)]
}
