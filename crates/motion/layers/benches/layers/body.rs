//! The starters' body, and a walk of it.

use ambulo_rig::glam::{DVec3, Quat};
use ambulo_rig::{Joint, Pose, Skeleton, Transform};

use crate::walk::{STRIDE, Walker};

const BONES: &str = include_str!("../../../../../starters/clips/human.skeleton");
/// The starters' legs are so much longer than the walk's, metres.
const LONGER: f32 = 0.01;
/// Hands down: the body is in T-pose at rest.
const ARMS: [(&str, f32); 2] = [("LeftArm", -1.3), ("RightArm", 1.3)];

/// Poses of strides at 60 Hz, two of them a little different.
pub struct Loop {
    pub skeleton: Skeleton,
    pub poses: [Vec<Pose>; 2],
    /// Left heel, left toes, right heel, right toes.
    pub contacts: Vec<[f32; 4]>,
}

impl Loop {
    pub fn new() -> Self {
        let skeleton = skeleton();
        let frames = (STRIDE * 60.0) as usize * 4;
        let mut contacts = vec![];
        let mut loop_of = |slides: [f32; 2]| -> Vec<Pose> {
            let walker = Walker::new(0.3, slides);
            let (mut drawn, mut global) = walker.buffers();
            contacts.clear();
            let pose = |frame: usize| {
                let time = frame as f32 / 60.0;
                contacts.push(walker.pose(time, 0.0, &mut drawn, &mut global));
                onto(&skeleton, &walker.skeleton, &drawn)
            };
            (0..frames).map(pose).collect()
        };
        let poses = [loop_of([0.05, 0.0]), loop_of([0.0, -0.03])];
        Self { skeleton, poses, contacts }
    }
}

fn skeleton() -> Skeleton {
    let mut joints: Vec<Joint> = vec![];
    for line in BONES.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let ["bone", name, parent, x, y, z] = words[..] else { continue };
        let number = |word: &str| word.parse().expect("offsets are numbers");
        joints.push(Joint {
            name: name.into(),
            parent: joints.iter().position(|joint| joint.name == parent),
            offset: DVec3::new(number(x), number(y), number(z)),
            tips: vec![],
        });
    }
    Skeleton::new(joints).expect("the starters' bones are a skeleton")
}

/// A pose of the walk on the starters' body, joint by joint.
pub fn onto(skeleton: &Skeleton, from: &Skeleton, drawn: &Pose) -> Pose {
    let mut pose = skeleton.rest_pose();
    for (joint, local) in skeleton.joints().iter().zip(&mut pose.local) {
        let walks = |other: &Joint| other.name.trim_end_matches("Base") == joint.name;
        if let Some(at) = from.joints().iter().position(walks) {
            local.rotation = drawn.local[at].rotation;
        }
        if let Some((_, angle)) = ARMS.iter().find(|(name, _)| *name == joint.name) {
            local.rotation = Quat::from_rotation_z(*angle);
        }
    }
    pose.local[0].translation = drawn.local[0].translation + ambulo_rig::glam::Vec3::Y * LONGER;
    pose
}

/// The body standing with both feet flat on the ground at 0.
pub fn stance(skeleton: &Skeleton) -> Vec<Transform> {
    let walker = Walker::new(0.0, [0.0; 2]);
    let stands = Pose::from_global(&walker.skeleton, &walker.stance());
    let mut global = vec![Transform::IDENTITY; skeleton.len()];
    onto(skeleton, &walker.skeleton, &stands).to_global(skeleton, &mut global);
    global
}
