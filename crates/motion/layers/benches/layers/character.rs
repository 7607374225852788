//! All layers of one character.

use std::time::Instant;

use ambulo_layers::{
    Decay, FeetState, FootPlacement, FootSettings, Ground, Hips, HipsSettings, HipsState,
    Inertialiser, Limb, LimbSettings, LookAt, LookJoint, LookSettings, LookState, Reach,
    StepSettings, Want, cross_fade,
};
use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Pose, Roles, Skeleton, Terrain, Transform};

use crate::body::{Loop, stance};

pub const STAGES: [&str; 7] = [
    "cross-fade",
    "inertialiser",
    "forward kinematics",
    "hips, 4 wants",
    "2 hands",
    "look-at, 3 joints",
    "2 feet",
];
const DT: f32 = 1.0 / 60.0;
/// Frames between two switches: less than a transition takes, so that it is always in one.
const SWITCH: usize = 15;

/// Adds up the time of each stage.
pub struct Timer {
    since: Instant,
    stages: [u64; STAGES.len()],
}

impl Timer {
    pub fn new() -> Self {
        Self { since: Instant::now(), stages: [0; STAGES.len()] }
    }

    pub fn start(&mut self) {
        self.since = Instant::now();
    }

    pub fn lap(&mut self, stage: usize) {
        let now = Instant::now();
        self.stages[stage] += (now - self.since).as_nanos() as u64;
        self.since = now;
    }

    pub fn nanoseconds(&self) -> [u64; STAGES.len()] {
        self.stages
    }
}

/// The layers, what they remember, and the buffers that they write.
pub struct Character {
    inertialiser: Inertialiser,
    hips: Hips,
    hips_state: HipsState,
    hands: [Limb; 2],
    legs: [Limb; 2],
    look: LookAt,
    look_state: LookState,
    /// Without and with steps.
    feet: [FootPlacement; 2],
    feet_state: FeetState,
    faded: Pose,
    pose: Pose,
    global: Vec<Transform>,
}

impl Character {
    pub fn new(skeleton: &Skeleton) -> Self {
        let stance = stance(skeleton);
        let roles = Roles::by_name(skeleton);
        let limbs = |ends: Option<[usize; 2]>, settings| {
            let ends = ends.expect("the body has hands and feet");
            ends.map(|end| Limb::new(skeleton, end, &stance, settings).expect("two bones"))
        };
        let joint = |name: &str| {
            skeleton.joints().iter().position(|joint| joint.name == name).expect("it has one")
        };
        let look = ["Spine2", "Neck", "Head"].map(joint);
        let look = look.map(|joint| LookJoint { joint, share: 1.0, limit: [0.6, 0.4] });
        let look = LookAt::new(skeleton, &look, &stance, LookSettings::default());
        let look = look.expect("they hang on each other");
        let feet = [None, Some(StepSettings::default())].map(|steps| {
            let settings = FootSettings { steps, ..FootSettings::default() };
            FootPlacement::new(skeleton, &roles, &stance, 0.0, settings).expect("it has feet")
        });
        Self {
            inertialiser: Inertialiser::new(skeleton.len(), Decay::default()).expect("it decays"),
            hips: Hips::new(skeleton, &roles, HipsSettings::default()).expect("it has hips"),
            hips_state: HipsState::default(),
            hands: limbs(roles.hands, LimbSettings::ARM),
            legs: limbs(roles.feet, LimbSettings::LEG),
            look_state: look.state(),
            look,
            feet,
            feet_state: FeetState::default(),
            faded: skeleton.rest_pose(),
            pose: skeleton.rest_pose(),
            global: stance,
        }
    }

    /// One frame; `timer` is told when a stage is done.
    pub fn frame(
        &mut self,
        motion: &Loop,
        frame: usize,
        terrain: &dyn Terrain,
        mut timer: Option<&mut Timer>,
    ) {
        let mut lap = |stage| {
            if let Some(timer) = &mut timer {
                timer.lap(stage);
            }
        };
        let Loop { skeleton, poses, contacts } = motion;
        let at = frame % contacts.len();
        let blend = 0.5 + 0.4 * (0.05 * frame as f32).sin();
        cross_fade(&poses[0][at], &poses[1][at], blend, None, &mut self.faded).expect("usable");
        lap(0);
        if frame % SWITCH == 1 {
            let from = &poses[1][at];
            self.inertialiser.switch(from, &self.faded, DT).expect("usable");
        }
        self.inertialiser.step(&self.faded, DT, &mut self.pose).expect("usable");
        lap(1);
        // Where the ground is, as a controller would have the root.
        let hips = self.pose.local[0].translation;
        let level = terrain.height(hips.x, hips.z);
        self.pose.local[0].translation.y += level;
        self.pose.to_global(skeleton, &mut self.global);
        lap(2);
        let forward = Quat::from_rotation_y(0.3);
        let in_front = |side: f32| {
            let sway = 0.1 * (0.07 * frame as f32).sin();
            self.global[0].translation + forward * Vec3::new(0.25 * side, 0.25 + sway, 0.5)
        };
        let targets = [in_front(1.0), in_front(-1.0)];
        let want = |limb: &Limb, target: Vec3| {
            let (root, span) = (self.global[limb.joints()[0]].translation, limb.span(&self.global));
            Want { root, target, comfort: 0.9 * span.exact, reach: span.exact, weight: 1.0 }
        };
        let ankle = |side: usize| self.global[self.legs[side].joints()[2]].translation;
        let wants = [
            want(&self.hands[0], targets[0]),
            want(&self.hands[1], targets[1]),
            want(&self.legs[0], ankle(0)),
            want(&self.legs[1], ankle(1)),
        ];
        let (pose, global) = (&mut self.pose, &mut self.global);
        let mut done = self.hips.step(skeleton, &mut self.hips_state, &wants, DT, pose, global);
        lap(3);
        for (hand, target) in self.hands.iter().zip(targets) {
            done &= hand.reach(skeleton, &Reach::at(target), pose, global);
        }
        lap(4);
        let seen = Some(targets[0] + forward * Vec3::new(1.0, 0.2, 1.5));
        done &= self.look.step(skeleton, &mut self.look_state, seen, 1.0, DT, pose, global);
        lap(5);
        let ground = Ground { terrain, level: Some(level) };
        let feet = &self.feet[frame / 300 % 2];
        let state = &mut self.feet_state;
        done &= feet.step(skeleton, state, contacts[at], &ground, DT, pose, global);
        lap(6);
        assert!(done, "every layer takes what it is given");
    }
}
