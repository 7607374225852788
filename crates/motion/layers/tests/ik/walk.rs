//! A procedural walk on flat ground: no motion capture, but heel strikes, toes that roll off, and
//! planted feet that slide as badly as one likes.

#![allow(dead_code)] // Each test program uses its own part.

use ambulo_layers::{Limb, LimbSettings, Reach};
use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Joint, Pose, Roles, Skeleton, Transform};

/// Metres a second, seconds a stride, share of it on the ground.
pub const SPEED: f32 = 1.0;
pub const STRIDE: f32 = 0.9;
pub const STANCE: f32 = 0.6;
/// Heights of ankle and ball above the sole.
pub const ANKLE: f32 = 0.08;
pub const BALL: f32 = 0.02;

/// Indices of ankles and balls, left and right.
pub const ANKLES: [usize; 2] = [3, 7];
pub const BALLS: [usize; 2] = [4, 8];

pub fn skeleton() -> Skeleton {
    let joint = |name: &str, parent, offset: [f64; 3], tips: Vec<[f64; 3]>| Joint {
        name: name.into(),
        parent,
        offset: offset.into(),
        tips: tips.into_iter().map(Into::into).collect(),
    };
    let mut joints = vec![joint("Hips", None, [0.0, 0.9, 0.0], vec![])];
    for (side, x) in [("Left", 0.1), ("Right", -0.1)] {
        let at = joints.len();
        joints.push(joint(&format!("{side}UpLeg"), Some(0), [x, -0.05, 0.0], vec![]));
        joints.push(joint(&format!("{side}Leg"), Some(at), [0.0, -0.42, 0.0], vec![]));
        joints.push(joint(&format!("{side}Foot"), Some(at + 1), [0.0, -0.42, 0.0], vec![]));
        let tip = vec![[0.0, -0.01, 0.06]];
        joints.push(joint(&format!("{side}ToeBase"), Some(at + 2), [0.0, -0.06, 0.13], tip));
    }
    joints.push(joint("Spine", Some(0), [0.0, 0.2, 0.0], vec![]));
    joints.push(joint("Neck", Some(9), [0.0, 0.35, 0.0], vec![]));
    joints.push(joint("Head", Some(10), [0.0, 0.12, 0.0], vec![]));
    Skeleton::new(joints).unwrap()
}

/// Someone who walks along +Z turned by `yaw`.
pub struct Walker {
    pub skeleton: Skeleton,
    pub roles: Roles,
    legs: [Limb; 2],
    pub yaw: f32,
    /// How far a planted foot slides forward and to the side while it is planted, metres.
    pub slides: [f32; 2],
}

impl Walker {
    pub fn new(yaw: f32, slides: [f32; 2]) -> Self {
        let skeleton = skeleton();
        let mut rest = vec![Transform::IDENTITY; skeleton.len()];
        skeleton.rest_pose().to_global(&skeleton, &mut rest);
        let settings = LimbSettings { softness: 0.0, ..LimbSettings::LEG };
        let legs = ANKLES.map(|ankle| Limb::new(&skeleton, ankle, &rest, settings).unwrap());
        Self { roles: Roles::by_name(&skeleton), skeleton, legs, yaw, slides }
    }

    /// Standing with both feet flat on the ground at height 0.
    pub fn stance(&self) -> Vec<Transform> {
        let (mut pose, mut global) = self.buffers();
        for (side, leg) in self.legs.iter().enumerate() {
            let ankle = Vec3::new(if side == 0 { 0.1 } else { -0.1 }, ANKLE, 0.0);
            leg.reach(&self.skeleton, &Reach::at(ankle), &mut pose, &mut global);
        }
        global
    }

    pub fn buffers(&self) -> (Pose, Vec<Transform>) {
        let pose = self.skeleton.rest_pose();
        let mut global = vec![Transform::IDENTITY; self.skeleton.len()];
        pose.to_global(&self.skeleton, &mut global);
        (pose, global)
    }

    /// Where the hips are over the ground after `time` seconds.
    pub fn root(&self, time: f32) -> Vec3 {
        Quat::from_rotation_y(self.yaw) * Vec3::Z * (SPEED * time)
    }

    /// Writes the pose and its global transforms on flat ground at height `level`; answers the
    /// contacts.
    pub fn pose(
        &self,
        time: f32,
        level: f32,
        pose: &mut Pose,
        global: &mut [Transform],
    ) -> [f32; 4] {
        let turn = Quat::from_rotation_y(self.yaw);
        for (local, joint) in pose.local.iter_mut().zip(self.skeleton.joints()) {
            *local = Transform::new(joint.offset.as_vec3(), Quat::IDENTITY);
        }
        let bob = 0.015 * (4.0 * std::f32::consts::PI * time / STRIDE).cos();
        let hips = self.root(time) + Vec3::Y * (0.9 + level + bob);
        pose.local[0] = Transform::new(hips, turn);
        pose.to_global(&self.skeleton, global);
        let mut contacts = [0.0; 4];
        for side in 0..2 {
            let foot = self.foot(side, time);
            let place = |v: Vec3| turn * v + Vec3::Y * level;
            let rotation = turn * Quat::from_rotation_x(foot.pitch);
            let arm = pose.local[BALLS[side]].translation;
            let ankle = place(foot.ball) - rotation * arm;
            let asked = Reach { rotation: Some(rotation), ..Reach::at(ankle) };
            self.legs[side].reach(&self.skeleton, &asked, pose, global);
            let toes = turn * Quat::from_rotation_x(foot.toes);
            pose.turn_to(&self.skeleton, BALLS[side], toes, global);
            contacts[2 * side..2 * side + 2].copy_from_slice(&foot.contacts);
        }
        pose.to_global(&self.skeleton, global);
        contacts
    }

    /// A foot in the frame of the walk: along +Z, on ground at 0.
    fn foot(&self, side: usize, time: f32) -> Step {
        let cycles = time / STRIDE + 0.5 * side as f32 + 10.0;
        let (p, x) = (cycles.fract(), if side == 0 { 0.1 } else { -0.1 });
        // Where the hips are in the middle of this stance.
        let middle = SPEED * (time - (p - 0.5 * STANCE) * STRIDE);
        let [ahead, aside] = self.slides;
        let stand = |p: f32| {
            let slid = p / STANCE - 0.5;
            Vec3::new(x + aside * slid, BALL, middle + 0.06 + ahead * slid)
        };
        let ramp = |from: f32, to: f32, p: f32| ((p - from) / (to - from)).clamp(0.0, 1.0);
        if p < STANCE {
            // Down on the heel, flat, then up on the ball.
            let pitch = -0.3 * (1.0 - ramp(0.0, 0.08, p)) + 0.7 * ramp(0.4, STANCE, p).powi(2);
            let mut ball = stand(p);
            ball.y += 0.15 * (-pitch).max(0.0).sin();
            let toe = ramp(0.06, 0.1, p) * (1.0 - ramp(0.56, 0.6, p));
            let heel = ramp(0.0, 0.03, p) * (1.0 - ramp(0.38, 0.44, p));
            return Step { ball, pitch, toes: pitch.min(0.0), contacts: [heel, toe] };
        }
        let s = (p - STANCE) / (1.0 - STANCE);
        let eased = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
        let mut ball = stand(STANCE).lerp(stand(0.0) + Vec3::Z * (SPEED * STRIDE), eased);
        ball.y += 0.07 * (std::f32::consts::PI * s).sin().powi(2) + 0.15 * 0.3f32.sin() * eased;
        let pitch = 0.7 + (-0.3 - 0.7) * eased;
        Step { ball, pitch, toes: -0.3 * eased, contacts: [0.0; 2] }
    }
}

struct Step {
    ball: Vec3,
    /// Of the foot and of its toes, positive with the heel up.
    pitch: f32,
    toes: f32,
    contacts: [f32; 2],
}
