//! One character: fixed steps inside, interpolated poses outside.

use std::f32::consts::TAU;

use ambulo_features::{Input, Output};
use ambulo_net::Scratch;
use ambulo_rig::glam::{Quat, Vec2, Vec3};
use ambulo_rig::{Pose, Transform, share, wrapped};

use crate::feet::Hold;
use crate::legs::Leg;
use crate::trajectory::{Trajectory, yaw};
use crate::{ControlError, Intent, Model, TrajectoryPoint, Tuning, World};

/// Longest time that one call catches up on, seconds.
const LONGEST: f32 = 1.0;

/// Feet take no more than this share off the root's speed: a network that slides along without
/// stepping must still get where it is asked to go.
const MOST_DRIVEN: f32 = 0.35;

/// A joint farther from its root than this is a broken prediction, metres.
const REACH: f32 = 10.0;

/// Why a pose was held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// `dt` is negative or not finite.
    Time,
    /// The intent has a number that is not finite, a facing of length zero, or a strafe outside 0
    /// to 1.
    Intent,
    /// The terrain answered with a height that is not finite.
    Terrain,
    /// The network's answer is not finite or not a body.
    Network,
}

/// Something that the caller may want to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// The pose is held as it was, but for fixed steps that ran before in the same call.
    Held(Held),
    /// `dt` was longer than a second; this much of it was left out, seconds.
    Skipped(f32),
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// Fixed steps that ran.
    pub steps: u32,
    /// At most one.
    pub event: Option<Event>,
}

/// Where a character is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root {
    /// On the ground, metres.
    pub position: Vec3,
    /// Radians, 0 along +Z, positive towards +X.
    pub yaw: f32,
}

/// Everything that one fixed step changes.
#[derive(Clone, Debug)]
struct State {
    trajectory: Trajectory,
    /// Radians, [0, 2π).
    phase: f32,
    /// World frame: what is fed back to the network.
    positions: Vec<Vec3>,
    /// World frame, metres a second.
    velocities: Vec<Vec3>,
    contacts: [f32; 4],
    /// Of the pose; the trajectory is one step ahead of it.
    root: Root,
    /// That the pose was predicted with; `phase` is one step ahead of it.
    pose_phase: f32,
    /// Left and right.
    holds: [Hold; 2],
    pose: Pose,
}

impl State {
    fn copy_from(&mut self, other: &Self) {
        self.trajectory.clone_from(&other.trajectory);
        self.phase = other.phase;
        self.positions.clone_from(&other.positions);
        self.velocities.clone_from(&other.velocities);
        self.contacts = other.contacts;
        self.root = other.root;
        self.pose_phase = other.pose_phase;
        self.holds = other.holds;
        self.pose.local.clone_from(&other.pose.local);
    }

    fn is_finite(&self) -> bool {
        let vectors = self.positions.iter().chain(&self.velocities);
        let pose = self.pose.local.iter();
        self.trajectory.is_finite()
            && self.phase.is_finite()
            && vectors.clone().all(|v| v.is_finite())
            && pose.clone().all(|t| t.is_finite())
    }
}

/// One character under control of a network.
#[derive(Clone, Debug)]
pub struct Controller {
    model: Model,
    tuning: Tuning,
    state: State,
    /// The state one fixed step ago: to interpolate from.
    previous: State,
    /// Where a fixed step is tried out; it becomes the state only if it is good.
    next: State,
    /// Seconds since the last fixed step, in [0, step).
    since: f64,
    input: Input,
    output: Output,
    x: Vec<f32>,
    y: Vec<f32>,
    scratch: Scratch,
    global: Vec<Transform>,
    legs: [Option<Leg>; 2],
}

impl Controller {
    /// A character that stands at a place (x, z) and faces a yaw, in the network's mean pose.
    /// [`Model::tuning`] is the tuning that the bundle asks for.
    ///
    /// # Errors
    /// A tuning or a start with numbers that cannot be used.
    pub fn new(
        model: Model,
        tuning: Tuning,
        place: Vec2,
        facing: f32,
        world: &World<'_>,
    ) -> Result<Self, ControlError> {
        if !tuning.is_valid() {
            return Err(ControlError::Tuning);
        }
        let joints = model.layout().joints();
        let (x, y) = (vec![0.0; model.network().inputs()], vec![0.0; model.network().outputs()]);
        let direction = Vec2::new(facing.sin(), facing.cos());
        let state = State {
            trajectory: Trajectory::standing(place, direction, world),
            phase: 0.0,
            positions: vec![Vec3::ZERO; joints],
            velocities: vec![Vec3::ZERO; joints],
            contacts: [1.0; 4],
            root: Root { position: Vec3::ZERO, yaw: facing },
            pose_phase: 0.0,
            holds: [Hold::default(); 2],
            pose: model.skeleton().rest_pose(),
        };
        let mut controller = Self {
            tuning,
            previous: state.clone(),
            next: state.clone(),
            state,
            since: 0.0,
            input: Input::zero(joints),
            output: Output::zero(joints),
            x,
            y,
            scratch: model.network().scratch(),
            global: vec![Transform::IDENTITY; joints],
            legs: [None; 2],
            model,
        };
        controller.y.copy_from_slice(&controller.model.network().normalisation().output_mean);
        controller.model.layout().decode_output(&controller.y, &mut controller.output);
        controller.find_legs();
        controller.take_pose(1.0);
        controller.show(world, f32::INFINITY);
        // The mean pose is nobody's stance: no foot is held in it.
        controller.next.holds = [Hold::default(); 2];
        if !controller.next.is_finite() {
            return Err(ControlError::Start);
        }
        controller.state.copy_from(&controller.next);
        controller.previous.copy_from(&controller.next);
        Ok(controller)
    }

    /// Seconds of a fixed step.
    pub fn step_time(&self) -> f32 {
        1.0 / self.model.layout().fps()
    }

    /// Moves on by `dt` seconds. Allocates nothing.
    ///
    /// The poses handed out lag the newest fixed step by up to one step: they lie between the last
    /// two. On bad input, a bad answer of the terrain or of the network nothing changes but the
    /// event says so.
    pub fn step(&mut self, dt: f32, intent: &Intent, world: &World<'_>) -> Step {
        let held = |reason| Step { steps: 0, event: Some(Event::Held(reason)) };
        if !(dt.is_finite() && dt >= 0.0) {
            return held(Held::Time);
        }
        if !intent.is_valid() {
            return held(Held::Intent);
        }
        let skipped = dt - dt.min(LONGEST);
        let mut event = (skipped > 0.0).then_some(Event::Skipped(skipped));
        let step = 1.0 / f64::from(self.model.layout().fps());
        let before = self.since;
        self.since += f64::from(dt.min(LONGEST));
        let mut steps = 0;
        // A caller at the very same rate adds up to one step each time but for rounding.
        while self.since > step * (1.0 - 1e-4) {
            self.since = (self.since - step).max(0.0);
            if let Err(reason) = self.fixed_step(intent, world) {
                self.since = before;
                event = Some(Event::Held(reason));
                break;
            }
            steps += 1;
        }
        Step { steps, event }
    }

    fn fixed_step(&mut self, intent: &Intent, world: &World<'_>) -> Result<(), Held> {
        self.next.copy_from(&self.state);
        self.predict(intent, world)?;
        std::mem::swap(&mut self.previous, &mut self.state);
        std::mem::swap(&mut self.state, &mut self.next);
        Ok(())
    }

    fn predict(&mut self, intent: &Intent, world: &World<'_>) -> Result<(), Held> {
        let dt = self.step_time();
        self.next.trajectory.follow(intent, &self.tuning, world, dt);
        self.tell(world);
        let layout = self.model.layout();
        layout.encode_input(&self.input, &mut self.x);
        if !self.x.iter().all(|number| number.is_finite()) {
            return Err(Held::Terrain);
        }
        let network = self.model.network();
        network.predict(&self.x, self.next.phase, &mut self.y, &mut self.scratch);
        layout.decode_output(&self.y, &mut self.output);
        let body = self.output.joint_position.iter().all(|p| p.abs().max_element() < REACH);
        if !body || !self.y.iter().all(|number| number.is_finite()) {
            return Err(Held::Network);
        }
        self.next.trajectory.carry(self.slide(dt), world.areas, dt);
        self.take_pose(share(self.tuning.pose_halflife, dt));
        let fastest = self.tuning.fastest_turn * dt;
        self.show(world, if fastest > 0.0 { fastest } else { f32::INFINITY });
        let freedom = self.next.trajectory.freedom(&self.tuning);
        let cycles = self.output.phase_rate.max(0.0) * dt * (0.9 * freedom + 0.1);
        self.next.phase = (self.next.phase + TAU * cycles).rem_euclid(TAU);
        self.next.trajectory.advance(&self.output, &self.tuning, world.areas, dt);
        if self.next.is_finite() { Ok(()) } else { Err(Held::Network) }
    }

    /// How far the root must go so that the balls of the feet in contact stay where they were, as
    /// far as the tuning wants it: what the root's velocity and the pose disagree on is a slide.
    fn slide(&self, dt: f32) -> Vec2 {
        let drive = self.tuning.foot_drive;
        let now = self.next.trajectory.now();
        let (root, outward, feet) = (now.root(), now.rotation(), self.model.feet());
        let (mut sum, mut weights) = (Vec2::ZERO, 0.0);
        for toe in [1, 3] {
            let joint = feet.joints[toe];
            let place = outward * self.output.joint_position[joint] + root;
            let slid = place - self.next.positions[joint];
            // In contact before and after: a foot that lands or leaves moves by itself.
            let contact = self.next.contacts[toe].min(self.output.contacts[toe]);
            let weight = (2.0 * contact - 1.0).clamp(0.0, 1.0);
            sum += Vec2::new(slid.x, slid.z) * weight;
            weights += weight;
        }
        // Half a foot surely down is enough to go by.
        let shift = sum * (-drive / weights.max(0.5));
        shift.clamp_length_max(MOST_DRIVEN * self.next.trajectory.speed() * dt)
    }

    /// Legs bend the way that the mean pose does: knees never bend backward, so their mean is bent.
    fn find_legs(&mut self) {
        let drawn = self.output.joint_position.iter().zip(&self.output.joint_rotation);
        let mean: Vec<_> = drawn.map(|(&p, &r)| Transform::new(p, r)).collect();
        let skeleton = self.model.skeleton();
        self.legs = self.model.feet().ankles().map(|foot| Leg::above(skeleton, foot, &mean));
    }

    /// Fills the network's input from the state that is tried out.
    fn tell(&mut self, world: &World<'_>) {
        let trajectory = &self.next.trajectory;
        trajectory.sample(world, &mut self.input.trajectory, &mut self.input.ground);
        let before = trajectory.before();
        let (root, inward) = (before.root(), before.rotation().inverse());
        for (told, position) in self.input.joint_position.iter_mut().zip(&self.next.positions) {
            *told = inward * (*position - root);
        }
        if let Some(wish) = trajectory.sway() {
            let joints = self.input.joint_position.iter_mut().enumerate();
            // The feet stay: what stirs is the body over them.
            let upper = joints.filter(|(joint, _)| !self.model.in_legs(*joint));
            upper.for_each(|(joint, told)| *told += wish.stir(joint));
        }
        for (told, velocity) in self.input.joint_velocity.iter_mut().zip(&self.next.velocities) {
            *told = inward * *velocity;
        }
    }

    /// Takes the network's pose into the world. What is fed back goes only `share` of the way from
    /// where its own velocity would have taken it; what is shown is the prediction itself.
    fn take_pose(&mut self, share: f32) {
        let dt = self.step_time();
        let now = *self.next.trajectory.now();
        let (root, outward) = (now.root(), now.rotation());
        self.next.root = Root { position: root, yaw: yaw(now.direction) };
        for joint in 0..self.global.len() {
            let position = outward * self.output.joint_position[joint] + root;
            let velocity = outward * self.output.joint_velocity[joint];
            let rotation = outward * self.output.joint_rotation[joint];
            let carried = self.next.positions[joint] + velocity * dt;
            self.next.positions[joint] = carried.lerp(position, share);
            self.next.velocities[joint] = velocity;
            self.global[joint] = Transform::new(position, rotation);
        }
        self.next.contacts = self.output.contacts.map(|c| c.clamp(0.0, 1.0));
        self.next.pose_phase = self.next.phase;
    }

    /// The shown pose: the network's rotations on the skeleton's own bones, hung from the hips,
    /// with legs bent so that the ankles are where the network has them; no joint turns by more than
    /// `most` radians from the pose before. (Its bones vary in length
    /// with the pose, so rotations alone would leave the feet centimetres off the ground.) None of
    /// it is fed back.
    fn show(&mut self, world: &World<'_>, most: f32) {
        let skeleton = self.model.skeleton();
        for (index, joint) in skeleton.joints().iter().enumerate() {
            let own = self.global[index];
            self.next.pose.local[index] = match joint.parent {
                Some(parent) => {
                    let turned = self.global[parent].rotation.inverse() * own.rotation;
                    let before = self.state.pose.local[index].rotation;
                    let turned = no_snap(before, turned.normalize(), most);
                    Transform::new(joint.offset.as_vec3(), turned)
                }
                None => own,
            };
        }
        let ankles = self.model.feet().ankles().map(|foot| self.global[foot].translation);
        self.next.pose.to_global(skeleton, &mut self.global);
        for (side, ankle) in ankles.into_iter().enumerate() {
            let Some(leg) = self.legs[side] else { continue };
            let shift =
                if self.tuning.hold_feet { self.hold(side, ankle, world) } else { Vec3::ZERO };
            let skeleton = self.model.skeleton();
            leg.reach(skeleton, ankle + shift, &mut self.next.pose, &mut self.global);
        }
    }

    /// How far to move an ankle so that the ball of its foot stays where it stands, above ground.
    fn hold(&mut self, side: usize, ankle: Vec3, world: &World<'_>) -> Vec3 {
        let feet = self.model.feet();
        let (heel, toe) = (feet.joints[2 * side], feet.joints[2 * side + 1]);
        let bone = self.global[toe].translation - self.global[heel].translation;
        let ball = ankle + bone;
        let contact = self.next.contacts[2 * side + 1];
        let dt = self.step_time();
        let hold = &mut self.next.holds[side];
        let shift = hold.shift(Vec2::new(ball.x, ball.z), contact, self.tuning.foot_halflife, dt);
        // In contact the ball is half a foot's thickness above the ground or more.
        let floor = world.terrain.height(ball.x + shift.x, ball.z + shift.y)
            + 0.5 * feet.heights[2 * side + 1];
        Vec3::new(shift.x, (floor - ball.y).max(0.0), shift.y)
    }

    /// Copies the pose at this moment: local transforms, the root joint's in the world.
    pub fn pose(&self, pose: &mut Pose) {
        pose.set_interpolated(&self.previous.pose, &self.state.pose, self.share());
    }

    /// Where the character is at this moment.
    pub fn root(&self) -> Root {
        let (a, b) = (self.previous.root, self.state.root);
        let t = self.share();
        let yaw = a.yaw + wrapped(b.yaw - a.yaw) * t;
        Root { position: a.position.lerp(b.position, t), yaw }
    }

    /// Left heel, left toe, right heel, right toe: how surely each is on the ground at this moment,
    /// 0 to 1.
    pub fn contacts(&self) -> [f32; 4] {
        let (a, b, t) = (self.previous.contacts, self.state.contacts, self.share());
        std::array::from_fn(|foot| a[foot] + (b[foot] - a[foot]) * t)
    }

    /// Of the pose at this moment, radians, [0, 2π): 0 when the right foot comes down, π when the
    /// left does.
    pub fn phase(&self) -> f32 {
        let (a, b) = (self.previous.pose_phase, self.state.pose_phase);
        (a + wrapped(b - a) * self.share()).rem_euclid(TAU)
    }

    /// The window around the newest fixed step, for drawing.
    pub fn trajectory(&self) -> &[TrajectoryPoint] {
        self.state.trajectory.points()
    }

    /// The model that moves it.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// How far this moment lies between the last two fixed steps.
    fn share(&self) -> f32 {
        (self.since * f64::from(self.model.layout().fps())).clamp(0.0, 1.0) as f32
    }
}

/// A rotation, but no farther than `most` radians from the one before.
fn no_snap(before: Quat, now: Quat, most: f32) -> Quat {
    let angle = before.angle_between(now);
    if angle > most { before.slerp(now, most / angle) } else { now }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_is_spread_out() {
        let (from, to) = (Quat::from_rotation_y(0.2), Quat::from_rotation_y(2.2));
        let one = no_snap(from, to, 0.5);
        assert!((one.angle_between(from) - 0.5).abs() < 1e-5);
        assert!((one.angle_between(to) - 1.5).abs() < 1e-5);
        assert_eq!(no_snap(from, to, 2.5), to);
        assert_eq!(no_snap(from, to, f32::INFINITY), to);
    }
}
