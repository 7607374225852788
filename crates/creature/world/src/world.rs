//! Individuals of one body on a ground.

use std::collections::HashMap;

use ambulo_body::{Body, Joint, Part};
use ambulo_lanes::{Lanes, Mask, Scalar};
use boxdd::{
    BodyBuilder, BodyId, BodyType, Filter, Foundation, JointId, ShapeDef, ShapeId, Snapshot,
    SurfaceMaterial, WorldBuilder, shapes,
};

use crate::physics::DEPTH;
use crate::{Outline, Physics, PhysicsError, Stage};

const GROUND: u64 = 1;
const PARTS: u64 = 2;

/// Why a world cannot be made or stepped.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum WorldError {
    #[error(transparent)]
    Physics(#[from] PhysicsError),
    #[error("Box2D: {0}")]
    Engine(#[from] boxdd::Error),
}

/// Where a part's frame is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Metres.
    pub x: f32,
    /// Metres.
    pub y: f32,
    /// Radians, −π to π.
    pub angle: f32,
}

/// Individuals of one body on a ground.
pub struct World {
    engine: boxdd::World,
    dt: f32,
    substeps: i32,
    ground: Outline,
    ends: Vec<(usize, usize)>,
    start_angles: Vec<f32>,
    centres: Vec<[f32; 2]>,
    individuals: Vec<Individual>,
    /// Of each part: cosine and sine of its frame in the start pose, how much water slows it along the
    /// frame's axes and in turning, its mass and its moment of inertia. Nothing without water.
    water: Vec<Wet>,
    /// Individual and part of every shape but the ground's.
    owners: HashMap<ShapeId, (usize, usize)>,
}

/// What water does to a part.
struct Wet {
    frame: [f32; 2],
    drag: [f32; 3],
    mass: f32,
    inertia: f32,
}

/// One creature: its handles, and how it was after the last step.
struct Individual {
    bodies: Vec<BodyId>,
    joints: Vec<JointId>,
    state: State,
}

/// What was seen of an individual.
#[derive(Clone)]
struct State {
    /// Of each part's frame.
    position: Vec<[f32; 2]>,
    /// Cosine and sine of how far each part has turned from the start pose.
    rotation: Vec<[f32; 2]>,
    /// How many of the ground's segments each part touches.
    touching: Vec<u32>,
}

/// A world's state, to go back to.
pub struct Saved {
    engine: Snapshot,
    states: Vec<State>,
}

impl World {
    /// `count` individuals in the start pose, lowered until the lowest point touches the ground.
    ///
    /// On flat ground, which is one segment, individuals may share a world, which saves time. On
    /// other ground the engine's order of a part's contacts would depend on who else is there:
    /// there a world holds one.
    ///
    /// # Errors
    /// Physics out of range; a refusal of the engine.
    ///
    /// # Panics
    /// More than one individual on ground of several segments.
    pub fn new(body: &Body, physics: &Physics, count: usize) -> Result<Self, WorldError> {
        physics.check()?;
        let ground = physics.ground.outline();
        let several = ground.points().len() > 2;
        assert!(count == 1 || !several, "one individual a world on such ground");
        let foundation = Foundation::initialize_default()?;
        let definition = WorldBuilder::from(foundation.world_def())
            .gravity([0.0, -physics.weight()])
            // Sleep would reorder bodies; tunnelling through a ground of one line is harmless.
            .enable_sleep(false)
            .enable_continuous(false);
        let mut engine = foundation.create_world(definition.build()?)?;
        add_ground(foundation, &mut engine, &ground, physics)?;
        let joints = 0..body.joints().len();
        let mut world = Self {
            engine,
            dt: physics.dt(),
            substeps: physics.substeps as i32,
            ends: joints.map(|joint| body.ends(joint)).collect(),
            start_angles: body.parts().iter().map(|part| part.angle).collect(),
            centres: body.parts().iter().map(centre).collect(),
            ground,
            water: match physics.water {
                Some(_) => (0..body.parts().len()).map(|part| wet(body, part, physics)).collect(),
                None => vec![],
            },
            individuals: Vec::with_capacity(count),
            owners: HashMap::new(),
        };
        for _ in 0..count {
            world.add(foundation, body, physics)?;
        }
        Ok(world)
    }

    fn add(
        &mut self,
        foundation: &Foundation,
        body: &Body,
        physics: &Physics,
    ) -> Result<(), WorldError> {
        let [left, bottom, right, _] = body.bounds();
        let depth = if physics.water.is_some() { DEPTH } else { 0.0 };
        let lift = self.ground.highest(left, right) - bottom + depth;
        let filter = Filter { category_bits: PARTS, mask_bits: GROUND, group_index: -1 };
        let mut bodies = Vec::with_capacity(body.parts().len());
        let mut position = Vec::with_capacity(body.parts().len());
        for (index, part) in body.parts().iter().enumerate() {
            let at = [part.position[0], part.position[1] + lift];
            let definition = BodyBuilder::from(foundation.body_def())
                .body_type(BodyType::Dynamic)
                .position(at)
                .enable_sleep(false);
            let id = self.engine.create_body(definition.build()?)?;
            let friction = part.friction * physics.friction_scale;
            let shape = ShapeDef::builder()
                .density(part.density * physics.mass_scale)
                .material(SurfaceMaterial::default().with_friction(friction)?)
                .filter(filter)
                .enable_contact_events(true)
                .build()?;
            let shape = add_shape(&mut self.engine, id, part, &shape)?;
            self.owners.insert(shape, (self.individuals.len(), index));
            bodies.push(id);
            position.push(at);
        }
        let mut joints = Vec::with_capacity(body.joints().len());
        for (joint, &(parent, child)) in body.joints().iter().zip(&self.ends) {
            let Joint { anchor: [x, y], limits: [low, high], torque, .. } = *joint;
            let builder = self.engine.revolute(bodies[parent], bodies[child]);
            let builder = builder.anchor_world([x, y + lift]).limit(low, high);
            joints.push(builder.motor(torque * physics.torque_scale, 0.0).build()?);
        }
        let parts = bodies.len();
        let (rotation, touching) = (vec![[1.0, 0.0]; parts], vec![0; parts]);
        let state = State { position, rotation, touching };
        self.individuals.push(Individual { bodies, joints, state });
        Ok(())
    }

    /// How many individuals there are.
    pub fn individuals(&self) -> usize {
        self.individuals.len()
    }

    /// Seconds a step.
    pub fn dt(&self) -> f32 {
        self.dt
    }

    /// The ground's line.
    pub fn ground(&self) -> &Outline {
        &self.ground
    }

    /// Asks a joint's motor for a speed, radians a second; it holds until the next call.
    ///
    /// # Errors
    /// A speed that is not finite.
    pub fn set_motor(
        &mut self,
        individual: usize,
        joint: usize,
        speed: f32,
    ) -> Result<(), WorldError> {
        let id = self.individuals[individual].joints[joint];
        Ok(self.engine.joint(id)?.into_revolute()?.set_motor_speed(speed)?)
    }

    /// What a joint's motor gave in the last step, newton metres.
    ///
    /// # Errors
    /// A refusal of the engine.
    pub fn motor_torque(&mut self, individual: usize, joint: usize) -> Result<f32, WorldError> {
        let id = self.individuals[individual].joints[joint];
        Ok(self.engine.joint(id)?.into_revolute()?.motor_torque()?)
    }

    /// Changes the speed of a part at once, metres a second.
    ///
    /// # Errors
    /// A change that is not finite.
    pub fn push(
        &mut self,
        individual: usize,
        part: usize,
        change: [f32; 2],
    ) -> Result<(), WorldError> {
        let id = self.individuals[individual].bodies[part];
        let mut body = self.engine.body(id)?;
        let mass = body.mass()?;
        Ok(body.apply_linear_impulse_to_center(change.map(|v| v * mass), true)?)
    }

    /// One step.
    ///
    /// # Errors
    /// A state that is no longer finite.
    pub fn step(&mut self) -> Result<(), WorldError> {
        self.wade()?;
        let done = self.engine.step(self.dt, self.substeps)?;
        let moved = done.body_events()?;
        // Nothing sleeps, so every part is told about, in the order in which all were made.
        let parts = self.start_angles.len();
        assert_eq!(moved.len(), parts * self.individuals.len(), "all parts move");
        for (event, slot) in moved.iter().zip(0..) {
            let (individual, part) = (&mut self.individuals[slot / parts], slot % parts);
            assert!(event.body_id == individual.bodies[part], "parts move in order");
            let at = event.transform.position();
            let turned = event.transform.rotation();
            individual.state.position[part] = [at.x, at.y];
            individual.state.rotation[part] = [turned.cosine(), turned.sine()];
        }
        let contacts = done.contact_events()?;
        let owners = &self.owners;
        let owner = |a: &ShapeId, b: &ShapeId| owners.get(a).or_else(|| owners.get(b)).copied();
        for event in contacts.begin() {
            if let Some((individual, part)) = owner(&event.shape_a, &event.shape_b) {
                self.individuals[individual].state.touching[part] += 1;
            }
        }
        for event in contacts.end() {
            if let Some((individual, part)) = owner(&event.shape_a, &event.shape_b) {
                let count = &mut self.individuals[individual].state.touching[part];
                *count = count.saturating_sub(1);
            }
        }
        Ok(())
    }

    /// Slows everything as water does in a step: implicitly, so that nothing turns back.
    fn wade(&mut self) -> Result<(), WorldError> {
        for individual in &self.individuals {
            for (part, wet) in self.water.iter().enumerate() {
                let [cos, sin] = individual.state.rotation[part];
                let [fc, fs] = wet.frame;
                let [c, s] = [cos * fc - sin * fs, sin * fc + cos * fs];
                let mut body = self.engine.body(individual.bodies[part])?;
                let velocity = body.linear_velocity()?;
                let (vx, vy) = (velocity.x, velocity.y);
                let w = body.angular_velocity()?;
                let slowed = |v: f32, drag: f32, mass: f32| v / (1.0 + drag * v.abs() / mass);
                let along = slowed(c * vx + s * vy, wet.drag[0], wet.mass);
                let across = slowed(c * vy - s * vx, wet.drag[1], wet.mass);
                body.set_linear_velocity([c * along - s * across, s * along + c * across])?;
                body.set_angular_velocity(slowed(w, wet.drag[2], wet.inertia))?;
            }
        }
        Ok(())
    }

    /// Where a part's frame is.
    pub fn pose(&self, individual: usize, part: usize) -> Pose {
        let ([x, y], turned) = (self.position(individual, part), self.turned(individual, part));
        let angle = wrapped(turned + self.start_angles[part]);
        Pose { x, y, angle }
    }

    /// Where a part's frame is, metres.
    pub fn position(&self, individual: usize, part: usize) -> [f32; 2] {
        self.individuals[individual].state.position[part]
    }

    /// Where a part's centre of mass is, metres.
    pub fn centre(&self, individual: usize, part: usize) -> [f32; 2] {
        let ([x, y], [cx, cy]) = (self.position(individual, part), self.centres[part]);
        let [cos, sin] = self.individuals[individual].state.rotation[part];
        [x + cos * cx - sin * cy, y + sin * cx + cos * cy]
    }

    /// How far a part has turned from the start pose, radians, −π to π.
    pub fn turned(&self, individual: usize, part: usize) -> f32 {
        let [cos, sin] = self.individuals[individual].state.rotation[part];
        libm::atan2f(sin, cos)
    }

    /// How far a joint has turned from the start pose, radians, −π to π.
    pub fn joint_angle(&self, individual: usize, joint: usize) -> f32 {
        let (parent, child) = self.ends[joint];
        let rotation = &self.individuals[individual].state.rotation;
        let ([ac, a_s], [bc, b_s]) = (rotation[parent], rotation[child]);
        libm::atan2f(ac * b_s - a_s * bc, ac * bc + a_s * b_s)
    }

    /// Whether a part touches the ground.
    pub fn touches(&self, individual: usize, part: usize) -> bool {
        self.individuals[individual].state.touching[part] > 0
    }

    /// Fingerprint of where an individual's parts are, to the last bit: 64 bits of FNV-1a,
    /// continued from `hash` so that a whole path can be told from another. Start with 0.
    pub fn hash(&self, individual: usize, hash: u64) -> u64 {
        let state = &self.individuals[individual].state;
        let numbers = state.position.iter().chain(&state.rotation).flatten();
        numbers.fold(hash ^ 0xcbf2_9ce4_8422_2325, |hash, number| {
            (hash ^ u64::from(number.to_bits())).wrapping_mul(0x0100_0000_01b3)
        })
    }

    /// The state, to go back to with [`World::restore`] on this world.
    ///
    /// # Errors
    /// A refusal of the engine.
    pub fn save(&self) -> Result<Saved, WorldError> {
        let states = self.individuals.iter().map(|individual| individual.state.clone()).collect();
        Ok(Saved { engine: self.engine.snapshot()?, states })
    }

    /// Back to a state of this world; what follows is what followed then, to the last bit.
    ///
    /// # Errors
    /// A state of another world.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), WorldError> {
        let new = self.engine.restore(&saved.engine)?;
        for (individual, state) in self.individuals.iter_mut().zip(&saved.states) {
            for id in &mut individual.bodies {
                *id = new.body_id(*id).expect("bodies are never taken away");
            }
            for id in &mut individual.joints {
                *id = new.joint_id(*id).expect("joints are never taken away");
            }
            individual.state.clone_from(state);
        }
        let owners = std::mem::take(&mut self.owners).into_iter();
        let renewed = owners
            .map(|(id, owner)| (new.shape_id(id).expect("shapes are never taken away"), owner));
        self.owners = renewed.collect();
        Ok(())
    }
}

/// Each individual is a group of one lane.
impl Stage<Scalar> for World {
    fn groups(&self) -> usize {
        self.individuals()
    }

    fn dt(&self) -> Lanes<Scalar> {
        self.dt.into()
    }

    fn ground(&self) -> &Outline {
        &self.ground
    }

    fn set_motor(
        &mut self,
        group: usize,
        joint: usize,
        speed: Lanes<Scalar>,
    ) -> Result<(), WorldError> {
        World::set_motor(self, group, joint, speed.value())
    }

    fn step(&mut self) -> Result<(), WorldError> {
        World::step(self)
    }

    fn centre(&self, group: usize, part: usize) -> [Lanes<Scalar>; 2] {
        World::centre(self, group, part).map(Lanes::from)
    }

    fn turned(&self, group: usize, part: usize) -> Lanes<Scalar> {
        World::turned(self, group, part).into()
    }

    fn joint_angle(&self, group: usize, joint: usize) -> Lanes<Scalar> {
        World::joint_angle(self, group, joint).into()
    }

    fn touches(&self, group: usize, part: usize) -> Mask<Scalar> {
        World::touches(self, group, part).into()
    }

    fn motor_torque(&mut self, group: usize, joint: usize) -> Result<Lanes<Scalar>, WorldError> {
        World::motor_torque(self, group, joint).map(Lanes::from)
    }

    fn push(
        &mut self,
        group: usize,
        part: usize,
        change: [Lanes<Scalar>; 2],
    ) -> Result<(), WorldError> {
        World::push(self, group, part, change.map(Lanes::value))
    }

    fn pose(&self, group: usize, _: usize, part: usize) -> Pose {
        World::pose(self, group, part)
    }

    fn hash(&self, group: usize, _: usize, hash: u64) -> u64 {
        World::hash(self, group, hash)
    }
}

fn wet(body: &Body, index: usize, physics: &Physics) -> Wet {
    let part = &body.parts()[index];
    Wet {
        frame: turn([1.0, 0.0], part.angle),
        drag: physics.drag(part.shape.extent()),
        mass: body.part_mass(index) * physics.mass_scale,
        inertia: part.density * physics.mass_scale * part.shape.second_moment(),
    }
}

/// Centre of mass of a part in the frame that turns with it and was upright in the start pose.
fn centre(part: &Part) -> [f32; 2] {
    turn(part.shape.centre(), part.angle)
}

pub(crate) fn turn([x, y]: [f32; 2], angle: f32) -> [f32; 2] {
    let (sin, cos) = libm::sincosf(angle);
    [cos * x - sin * y, sin * x + cos * y]
}

/// An angle within −π to π.
fn wrapped(angle: f32) -> f32 {
    let (sin, cos) = libm::sincosf(angle);
    libm::atan2f(sin, cos)
}

fn add_ground(
    foundation: &Foundation,
    engine: &mut boxdd::World,
    outline: &Outline,
    physics: &Physics,
) -> Result<(), WorldError> {
    let id = engine.create_body(BodyBuilder::from(foundation.body_def()).build()?)?;
    let friction = physics.ground_friction * physics.friction_scale;
    let material = SurfaceMaterial::default().with_friction(friction)?;
    let filter = Filter { category_bits: GROUND, mask_bits: PARTS, group_index: 0 };
    let shape = ShapeDef::builder().material(material).filter(filter).enable_contact_events(true);
    let shape = shape.build()?;
    // Segments rather than a chain: a chain is smooth at its corners, but needs runs without walls.
    for ends in outline.points().windows(2) {
        let segment = shapes::segment(ends[0], ends[1])?;
        engine.body(id)?.create_segment(&shape, &segment)?;
    }
    Ok(())
}

/// The part's outline, turned as in the start pose: so every body begins with no rotation.
fn add_shape(
    engine: &mut boxdd::World,
    id: BodyId,
    part: &Part,
    definition: &ShapeDef,
) -> Result<ShapeId, WorldError> {
    let (corners, radius) = part.shape.hull();
    let corners: Vec<_> = corners.into_iter().map(|corner| turn(corner, part.angle)).collect();
    let mut body = engine.body(id)?;
    let shape = match corners[..] {
        [centre] => body.create_circle(definition, &shapes::circle(centre, radius)?)?,
        [a, b] => body.create_capsule(definition, &shapes::capsule(a, b, radius)?)?,
        _ => {
            let polygon = shapes::polygon_from_points(corners, radius)?;
            body.create_polygon(definition, &polygon)?
        }
    };
    Ok(shape)
}
