//! A scene that moves: hinges, springs, boxes, and a character that nothing lets through.
//!
//! Fixed steps of [`STEP`] under any caller's dt; what is read lies between the last two, so that it
//! lags the newest by up to one step. The same calls give the same bits on every machine and in every
//! build: [`Physics::hash`].

mod act;
mod around;
mod build;
mod person;

use ambulo_rig::glam::{Quat, Vec2, Vec3};
use ambulo_rig::{Terrain, Transform};
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::pipeline::{PhysicsWorld, QueryFilter};
use rapier3d::prelude::{ImpulseJointHandle, Ray, RigidBodyHandle};

use crate::exact::{between, compose, inverse, level, vector};
use crate::ground::GroundPieces;
use crate::object::{Kind, ObjectKind};
use crate::parts::{Motion, Part};
use crate::reading::FileError;
use crate::scene_file::Scene;

pub use act::Push;
pub use person::Moved;

/// Seconds of a fixed step.
pub const STEP: f32 = 1.0 / 60.0;
/// Seconds: what is beyond in one call is skipped.
const LONGEST: f32 = 0.25;
/// Metres: farther away nothing is taken from a caller.
const FAR: f32 = 1e4;

/// Why a call was refused; nothing has changed then.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum Refused {
    #[error("a number is not finite or out of range")]
    Number,
    #[error("there is no such object")]
    Object,
    #[error("a {0} cannot do that")]
    Kind(ObjectKind),
    #[error("nothing holds it")]
    NotHeld,
    #[error("it is held already")]
    Held,
    #[error("there is no character yet")]
    Character,
}

/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Fixed steps that were made.
    pub steps: u32,
    /// Seconds that were skipped because the call's dt was too long.
    pub skipped: f32,
}

/// Something in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum What {
    Ground,
    Wall { index: usize },
    Object { object: usize, part: usize },
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// What it is.
    pub what: What,
    /// Metres from the ray's start; 0 where that lies inside.
    pub distance: f32,
    /// Where.
    pub point: Vec3,
    /// Unit normal of the surface; 0 where the start lies inside.
    pub normal: Vec3,
}

/// A scene in motion. Objects go by their index in [`Scene::objects`].
pub struct Physics {
    world: PhysicsWorld,
    ground: GroundPieces,
    things: Vec<Thing>,
    walls: Vec<Upright>,
    person: Option<person::Person>,
    /// Seconds since the last fixed step, in [0, STEP).
    since: f64,
}

/// A wall: from where to where, half its thickness, how high its top is; metres.
struct Upright {
    start: Vec2,
    end: Vec2,
    half: f32,
    top: f32,
}

/// An object.
struct Thing {
    kind: Kind,
    /// Where it was placed.
    at: Transform,
    parts: Vec<Part>,
    bodies: Vec<Body>,
    push: Option<Push>,
    driven: Option<act::Driven>,
    held: Option<act::Held>,
}

/// A part's body in the world of the engine, and where it was at the last two fixed steps.
#[derive(Clone, Copy)]
struct Body {
    handle: RigidBodyHandle,
    joint: Option<ImpulseJointHandle>,
    before: Transform,
    now: Transform,
}

impl Physics {
    /// A scene at rest.
    ///
    /// # Errors
    /// A scene that was not read from a file and could not have been.
    pub fn new(scene: &Scene) -> Result<Self, FileError> {
        scene.check()?;
        Ok(build::build(scene))
    }

    /// Moves on by `dt` seconds.
    ///
    /// # Errors
    /// A dt that is negative or not finite.
    pub fn step(&mut self, dt: f32) -> Result<Step, Refused> {
        if !(dt.is_finite() && dt >= 0.0) {
            return Err(Refused::Number);
        }
        let skipped = dt - dt.min(LONGEST);
        self.since += f64::from(dt.min(LONGEST));
        self.follow_holders(dt);
        // A caller at the very same rate adds up to one step each time but for rounding.
        let step = f64::from(STEP);
        let steps = (self.since / step + 1e-4) as u32;
        self.since = (self.since - step * f64::from(steps)).max(0.0);
        for left in (1..=steps).rev() {
            self.fixed_step(left);
        }
        Ok(Step { steps, skipped })
    }

    /// One of `left` fixed steps that are still to be made in this call, itself included.
    fn fixed_step(&mut self, left: u32) {
        self.apply_drives();
        self.apply_pushes();
        self.move_held(left);
        self.move_person(left);
        self.world.step();
        for thing in &mut self.things {
            for body in &mut thing.bodies {
                body.before = body.now;
                body.now = from_pose(self.world.bodies[body.handle].position());
            }
        }
    }

    /// The ground, to ask for heights.
    pub fn ground(&self) -> &GroundPieces {
        &self.ground
    }

    /// How many objects there are.
    pub fn objects(&self) -> usize {
        self.things.len()
    }

    /// The parts of an object, as it rests; none for an object that is not there.
    pub fn parts(&self, object: usize) -> &[Part] {
        self.things.get(object).map_or(&[], |thing| &thing.parts)
    }

    /// Where a part is at this moment, in the world.
    pub fn part(&self, object: usize, part: usize) -> Option<Transform> {
        let thing = self.things.get(object)?;
        let body = thing.bodies.get(part)?;
        // What is held is where its holder has it, without the lag of a step.
        let held = thing.held.filter(|_| thing.moving() == Some(part)).map(|held| held.target);
        Some(held.unwrap_or_else(|| between(body.before, body.now, self.share())))
    }

    /// Where a named frame of an object is at this moment, in the world.
    pub fn frame(&self, object: usize, name: &str) -> Option<Transform> {
        let thing = self.things.get(object)?;
        let frame = thing.kind.frame(name)?;
        match frame.part {
            Some(part) => Some(self.part(object, part)? * frame.at),
            None => Some(thing.at),
        }
    }

    /// How far a hinge is turned (radians) or a button is pressed (metres) at this moment.
    pub fn joint(&self, object: usize) -> Option<f32> {
        let thing = self.things.get(object)?;
        let moving = thing.moving()?;
        thing.reading(moving, self.part(object, moving)?)
    }

    /// Velocity (m/s) and angular velocity (rad/s) of an object's moving part at the last fixed step.
    pub fn velocity(&self, object: usize) -> Option<(Vec3, Vec3)> {
        let thing = self.things.get(object)?;
        let body = &self.world.bodies[thing.bodies[thing.moving()?].handle];
        Some((from_vector(body.linvel()), from_vector(body.angvel())))
    }

    /// The first thing that a ray meets within `most` metres; it passes through the character.
    ///
    /// # Errors
    /// Numbers that are not finite, a direction without length.
    pub fn ray(&self, from: Vec3, direction: Vec3, most: f32) -> Result<Option<Hit>, Refused> {
        let direction = direction.try_normalize().ok_or(Refused::Number)?;
        if !(near(from) && (0.0..=FAR).contains(&most)) {
            return Err(Refused::Number);
        }
        let ray = Ray::new(to_vector(from), to_vector(direction));
        let exclude_rigid_body = self.person.as_ref().map(|person| person.body);
        let filter = QueryFilter { exclude_rigid_body, ..QueryFilter::default() };
        let found = self.world.cast_ray_and_get_normal(&ray, most, true, filter);
        Ok(found.map(|(handle, hit)| Hit {
            what: build::what(self.world.colliders[handle].user_data),
            distance: hit.time_of_impact,
            point: from + direction * hit.time_of_impact,
            normal: from_vector(hit.normal).normalize_or_zero(),
        }))
    }

    /// A number that differs as soon as any bit of the state does: where everything is and how it
    /// moves.
    pub fn hash(&self) -> u64 {
        let mut hash = 0xCBF2_9CE4_8422_2325_u64;
        let mut add = |bits: u32| hash = (hash ^ u64::from(bits)).wrapping_mul(0x0100_0000_01B3);
        let bodies = self.things.iter().flat_map(|thing| &thing.bodies).map(|body| body.handle);
        for handle in bodies.chain(self.person.iter().map(|person| person.body)) {
            let body = &self.world.bodies[handle];
            let (place, turned) = (body.translation().to_array(), body.rotation().to_array());
            let (moves, turns) = (body.linvel().to_array(), body.angvel().to_array());
            let all = place.iter().chain(&turned).chain(&moves).chain(&turns);
            all.for_each(|number| add(number.to_bits()));
        }
        let since = self.since.to_bits();
        add(since as u32);
        add((since >> 32) as u32);
        hash
    }

    fn thing(&mut self, object: usize) -> Result<&mut Thing, Refused> {
        self.things.get_mut(object).ok_or(Refused::Object)
    }

    /// How far this moment lies between the last two fixed steps.
    fn share(&self) -> f32 {
        (self.since / f64::from(STEP)).clamp(0.0, 1.0) as f32
    }
}

impl Terrain for Physics {
    fn height(&self, x: f32, z: f32) -> f32 {
        self.ground.height(x, z)
    }
}

impl Thing {
    /// The part that moves, if one does.
    fn moving(&self) -> Option<usize> {
        self.parts.iter().position(|part| part.motion != Motion::Fixed)
    }

    /// How far a joint is from its rest, its part being where it is.
    fn reading(&self, part: usize, at: Transform) -> Option<f32> {
        let rest = compose(self.at, self.parts[part].rest);
        let own = compose(inverse(rest), at);
        match self.parts[part].motion {
            Motion::Hinge { axis, .. } => {
                let turned = own.rotation;
                let sine = vector(turned).dot(axis);
                Some(2.0 * libm::atan2f(sine * turned.w.signum(), turned.w.abs()))
            }
            Motion::Slide { axis, .. } => Some(own.translation.dot(axis)),
            Motion::Fixed | Motion::Loose { .. } => None,
        }
    }

    fn refused(&self) -> Refused {
        Refused::Kind(self.kind.kind())
    }
}

/// Finite and not too far away.
fn near(point: Vec3) -> bool {
    point.abs().cmple(Vec3::splat(FAR)).all()
}

fn to_vector(v: Vec3) -> Vector {
    Vector::from_array(v.to_array())
}

fn from_vector(v: Vector) -> Vec3 {
    Vec3::from_array(v.to_array())
}

fn to_pose(at: Transform) -> Pose {
    Pose::from_parts(to_vector(at.translation), Rotation::from_array(at.rotation.to_array()))
}

fn from_pose(pose: &Pose) -> Transform {
    let rotation = Quat::from_array(pose.rotation.to_array());
    Transform::new(from_vector(pose.translation), rotation)
}
