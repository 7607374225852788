//! What a character does to objects: turn, press, push, carry.

use ambulo_rig::Transform;
use ambulo_rig::glam::{Vec2, Vec3};
use rapier3d::dynamics::{JointAxis, MotorModel, RigidBodyType};

use super::build::critical;
use super::{Physics, Refused, STEP, Thing, from_vector, level, near, to_pose, to_vector};
use crate::exact::{between, compose, inverse, turn, turned, unit};
use crate::parts::Motion;

/// 1/s: near its angle a hinge is led there at this times what is left.
const APPROACH: f32 = 12.0;
/// Share of the torque that a hinge is braked with before its angle; the rest is for surprises.
const BRAKE: f32 = 0.7;
/// 1/s: how quickly a hinge takes up the speed it is led with.
const GRASP: f32 = 1000.0;
/// 1/s², of what leads a button in.
const SLIDE_STIFFNESS: f32 = 4000.0;
/// Seconds after which half of a holder's earlier velocity is forgotten.
const HELD_HALFLIFE: f32 = 0.03;
/// m/s and rad/s: what is let go moves no faster.
const FASTEST: [f32; 2] = [10.0, 15.0];
/// m/s².
const GRAVITY: f32 = 9.81;

/// How a box is pushed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// How it should move along the ground (x, z), metres a second, at most 20.
    pub velocity: Vec2,
    /// The most that is pushed with, newtons, 0 to 100000. Less than friction moves nothing.
    pub force: f32,
}

/// Where a hinge is led.
#[derive(Clone, Copy)]
pub(super) struct Driven {
    /// Radians, within its limits.
    to: f32,
    /// Newton metres.
    most: f32,
}

/// What something held knows.
#[derive(Clone, Copy)]
pub(super) struct Held {
    /// Where it is in the frame of its holder.
    grip: Transform,
    /// Where it is to be.
    pub target: Transform,
    /// Where it was to be when its velocity was last taken, and how many seconds ago that was.
    last: Transform,
    elapsed: f32,
    /// Of late, m/s and rad/s.
    velocity: Vec3,
    spin: Vec3,
}

impl Physics {
    /// Leads a hinge to an angle (radians, newton metres) or a button in (metres, newtons), with at
    /// most that torque or force, until [`Physics::release`]. It brakes in time, without overshoot;
    /// the joint's own limits hold.
    ///
    /// # Errors
    /// No such object, one without a joint, numbers that are not finite, a negative torque.
    pub fn drive(&mut self, object: usize, to: f32, most: f32) -> Result<(), Refused> {
        if !(to.abs() <= 10.0 && (0.0..=1e5).contains(&most)) {
            return Err(Refused::Number);
        }
        match self.motion(object)? {
            Motion::Hinge { limits: [low, high], .. } => {
                let to = to.clamp(low, high);
                self.thing(object)?.driven = Some(Driven { to, most });
                Ok(())
            }
            Motion::Slide { limits: [low, high], stiffness, .. } => {
                // The spring pushes back: no farther than the force compresses it.
                let to = to.min(most / stiffness).clamp(low, high);
                let axis = JointAxis::LinX;
                self.with_joint(object, |joint| {
                    joint.set_motor_model(axis, MotorModel::AccelerationBased);
                    let damping = critical(SLIDE_STIFFNESS, 1.0);
                    joint.set_motor(axis, to, 0.0, SLIDE_STIFFNESS, damping);
                    joint.set_motor_max_force(axis, most);
                })
            }
            _ => Err(self.things[object].refused()),
        }
    }

    /// Presses a button so far of its way in (0 to 1), with at most that force in newtons, until
    /// [`Physics::release`].
    ///
    /// # Errors
    /// No such object, not a button, numbers that are not finite, a negative force.
    pub fn press(&mut self, object: usize, depth: f32, most: f32) -> Result<(), Refused> {
        match self.motion(object)? {
            Motion::Slide { limits: [_, travel], .. } => self.drive(object, depth * travel, most),
            _ => Err(self.things[object].refused()),
        }
    }

    /// Lets a hinge swing or close by itself, a button come back.
    ///
    /// # Errors
    /// No such object, or one without a joint.
    pub fn release(&mut self, object: usize) -> Result<(), Refused> {
        let (axis, stiffness, damping) = match self.motion(object)? {
            Motion::Hinge { damping, closer, .. } => (JointAxis::AngX, closer, damping),
            Motion::Slide { stiffness, mass, .. } => {
                (JointAxis::LinX, stiffness, critical(stiffness, mass))
            }
            _ => return Err(self.things[object].refused()),
        };
        self.thing(object)?.driven = None;
        self.with_joint(object, |joint| {
            joint.set_motor_model(axis, MotorModel::ForceBased);
            joint.set_motor(axis, 0.0, 0.0, stiffness, damping);
            joint.set_motor_max_force(axis, f32::MAX);
        })
    }

    /// Pushes a box at its middle, in every step until this is called again; `None` ends it.
    ///
    /// # Errors
    /// No such object, not a box, one that is held, numbers that are not finite or out of range.
    pub fn push(&mut self, object: usize, push: Option<Push>) -> Result<(), Refused> {
        let wild =
            |push: Push| !(push.velocity.length() <= 20.0 && (0.0..=1e5).contains(&push.force));
        if push.is_some_and(wild) {
            return Err(Refused::Number);
        }
        let thing = self.loose(object)?;
        if push.is_some() && thing.held.is_some() {
            return Err(Refused::Held);
        }
        thing.push = push;
        Ok(())
    }

    /// How much of a character's own pace is left when it pushes a box with at most `force` newtons,
    /// 0 to 1: friction takes its share, and what is too heavy does not move at all.
    ///
    /// # Errors
    /// No such object, not a box, a force that is not finite.
    pub fn ease(&self, object: usize, force: f32) -> Result<f32, Refused> {
        if !force.is_finite() {
            return Err(Refused::Number);
        }
        match self.motion(object)? {
            Motion::Loose { mass, friction } => {
                Ok((1.0 - friction * mass * GRAVITY / force.max(1e-6)).clamp(0.0, 1.0))
            }
            _ => Err(self.things[object].refused()),
        }
    }

    /// From now on a box goes where its holder goes, as it is in the holder's frame now; walls do not
    /// stop it.
    ///
    /// # Errors
    /// No such object, not a box, one that is held already, a transform that cannot be used.
    pub fn attach(&mut self, object: usize, holder: Transform) -> Result<(), Refused> {
        let holder = usable(holder)?;
        self.loose(object)?;
        let target = self.part(object, 0).ok_or(Refused::Object)?;
        let thing = &mut self.things[object];
        if thing.held.is_some() {
            return Err(Refused::Held);
        }
        let (velocity, spin) = (Vec3::ZERO, Vec3::ZERO);
        let grip = compose(inverse(holder), target);
        thing.held = Some(Held { grip, target, last: target, elapsed: 0.0, velocity, spin });
        thing.push = None;
        let body = &mut self.world.bodies[thing.bodies[0].handle];
        body.reset_forces(true);
        body.set_body_type(RigidBodyType::KinematicPositionBased, true);
        Ok(())
    }

    /// Tells where the holder is; before every [`Physics::step`] while something is held.
    ///
    /// # Errors
    /// No such object, nothing that is held, a transform that cannot be used.
    pub fn carry(&mut self, object: usize, holder: Transform) -> Result<(), Refused> {
        let holder = usable(holder)?;
        let held = self.thing(object)?.held.as_mut().ok_or(Refused::NotHeld)?;
        let target = compose(holder, held.grip);
        held.target = Transform::new(target.translation, unit(target.rotation));
        Ok(())
    }

    /// Lets go. The box keeps the velocity it was carried with, at most 10 m/s and 15 rad/s.
    ///
    /// # Errors
    /// No such object, or nothing that is held.
    pub fn detach(&mut self, object: usize) -> Result<(), Refused> {
        let thing = self.thing(object)?;
        let held = thing.held.take().ok_or(Refused::NotHeld)?;
        let shown = &mut thing.bodies[0];
        (shown.before, shown.now) = (held.target, held.target);
        let handle = shown.handle;
        let body = &mut self.world.bodies[handle];
        body.set_body_type(RigidBodyType::Dynamic, true);
        body.set_position(to_pose(held.target), true);
        body.set_linvel(to_vector(held.velocity.clamp_length_max(FASTEST[0])), true);
        body.set_angvel(to_vector(held.spin.clamp_length_max(FASTEST[1])), true);
        Ok(())
    }

    fn motion(&self, object: usize) -> Result<Motion, Refused> {
        let thing = self.things.get(object).ok_or(Refused::Object)?;
        thing.moving().map(|part| thing.parts[part].motion).ok_or(thing.refused())
    }

    fn loose(&mut self, object: usize) -> Result<&mut Thing, Refused> {
        match self.motion(object)? {
            Motion::Loose { .. } => self.thing(object),
            _ => Err(self.things[object].refused()),
        }
    }

    fn with_joint(
        &mut self,
        object: usize,
        change: impl FnOnce(&mut rapier3d::dynamics::GenericJoint),
    ) -> Result<(), Refused> {
        let thing = self.things.get(object).ok_or(Refused::Object)?;
        let handle = thing.bodies.iter().find_map(|body| body.joint).ok_or(thing.refused())?;
        let joint = self.world.impulse_joints.get_mut(handle, true).ok_or(thing.refused())?;
        change(&mut joint.data);
        Ok(())
    }

    /// Each driven hinge goes no faster than its torque can brake before the angle.
    pub(super) fn apply_drives(&mut self) {
        for object in 0..self.things.len() {
            let thing = &self.things[object];
            let (Some(driven), Some(part)) = (thing.driven, thing.moving()) else { continue };
            let (body, Motion::Hinge { axis, .. }) = (thing.bodies[part], thing.parts[part].motion)
            else {
                continue;
            };
            let Some(angle) = thing.reading(part, body.now) else { continue };
            let spin = from_vector(self.world.bodies[body.handle].angvel());
            let speed = spin.dot(turned(thing.at.rotation, axis));
            let brake = BRAKE * driven.most / thing.parts[part].inertia();
            // Where it will be when the step is over counts.
            let speed = led(driven.to - angle - speed * STEP, brake);
            // Refused only where there is no joint, and what is driven has one.
            let _ = self.with_joint(object, |joint| {
                joint.set_motor_model(JointAxis::AngX, MotorModel::AccelerationBased);
                joint.set_motor_velocity(JointAxis::AngX, speed, GRASP);
                joint.set_motor_max_force(JointAxis::AngX, driven.most);
            });
        }
    }

    /// What has to be pushed with to reach the velocity in one step against friction, but never more
    /// than the push has.
    pub(super) fn apply_pushes(&mut self) {
        for thing in &self.things {
            let (Some(push), Motion::Loose { mass, friction }) =
                (thing.push, thing.parts[0].motion)
            else {
                continue;
            };
            let body = &mut self.world.bodies[thing.bodies[0].handle];
            let short = push.velocity - level(from_vector(body.linvel()));
            let against = push.velocity.normalize_or_zero() * friction * mass * GRAVITY;
            let force = (short * mass / STEP + against).clamp_length_max(push.force);
            // An impulse, not a force: nothing is left of it in the next step.
            let impulse = Vec3::new(force.x, 0.0, force.y) * STEP;
            body.apply_impulse(to_vector(impulse), push.velocity != Vec2::ZERO);
        }
    }

    /// How fast each holder has moved of late: what it carries keeps that when it is let go.
    pub(super) fn follow_holders(&mut self, dt: f32) {
        for held in self.things.iter_mut().filter_map(|thing| thing.held.as_mut()) {
            held.elapsed += dt;
            // Too short a time says nothing of a velocity.
            if held.elapsed < 1e-3 {
                continue;
            }
            let forget = libm::exp2f(-held.elapsed / HELD_HALFLIFE);
            let moved = (held.target.translation - held.last.translation) / held.elapsed;
            let spun = turn(held.last.rotation, held.target.rotation) / held.elapsed;
            held.velocity = moved.lerp(held.velocity, forget);
            held.spin = spun.lerp(held.spin, forget);
            (held.last, held.elapsed) = (held.target, 0.0);
        }
    }

    pub(super) fn move_held(&mut self, left: u32) {
        for thing in &self.things {
            if let Some(held) = thing.held {
                let body = thing.bodies[0];
                let next = between(body.now, held.target, 1.0 / left as f32);
                self.world.bodies[body.handle].set_next_kinematic_position(to_pose(next));
            }
        }
    }
}

/// The speed that still comes to rest after `left`, braked with `brake` (rad, rad/s²): v² = 2 α Δ, and
/// near the end in proportion to what is left, which takes no more than that either.
fn led(left: f32, brake: f32) -> f32 {
    let near = brake / (APPROACH * APPROACH);
    if left.abs() <= near {
        left * APPROACH
    } else {
        (2.0 * brake * (left.abs() - 0.5 * near)).sqrt().copysign(left)
    }
}

fn usable(holder: Transform) -> Result<Transform, Refused> {
    let rotation = holder.rotation;
    if !(near(holder.translation) && (rotation.length_squared() - 1.0).abs() < 0.1) {
        return Err(Refused::Number);
    }
    Ok(Transform::new(holder.translation, unit(rotation)))
}
