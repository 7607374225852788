//! From a scene to bodies of the engine.

use ambulo_rig::glam::{Vec2, Vec3};
use ambulo_rig::{Terrain, Transform};
use rapier3d::dynamics::{
    CoefficientCombineRule, GenericJoint, IntegrationParameters, MotorModel, PrismaticJointBuilder,
    RevoluteJointBuilder, RigidBodyBuilder,
};
use rapier3d::geometry::{Array2, ColliderBuilder, Group, InteractionGroups, InteractionTestMode};
use rapier3d::pipeline::PhysicsWorld;

use super::{Body, Physics, STEP, Thing, Upright, What, to_pose, to_vector};
use crate::exact::compose;
use crate::ground::{GroundPieces, Piece, step_height};
use crate::object::{Object, yawed};
use crate::parts::{Motion, Part};
use crate::scene_file::{GroundKind, Scene, Wall};

/// Who meets whom: boxes meet everything, the character all but the ground, which it asks for heights.
const GROUND: Group = Group::GROUP_1;
const FIXED: Group = Group::GROUP_2;
const JOINTED: Group = Group::GROUP_3;
const LOOSE: Group = Group::GROUP_4;
const CHARACTER: Group = Group::GROUP_5;

/// Metres of earth under the surface.
const DEPTH: f32 = 1.0;
/// Friction of what is not a box: the lower of two counts, so that a box's own one does.
const ROUGH: f32 = 10.0;

fn groups(own: Group, others: Group) -> InteractionGroups {
    InteractionGroups::new(own, others, InteractionTestMode::And)
}

/// What a character's sweep meets.
pub(super) fn in_the_way() -> InteractionGroups {
    groups(CHARACTER, FIXED | JOINTED | LOOSE)
}

fn mark(what: What) -> u128 {
    let pack = |kind: u128, a: usize, b: usize| (kind << 64) | ((a as u128) << 32) | b as u128;
    match what {
        What::Ground => pack(0, 0, 0),
        What::Wall { index } => pack(1, index, 0),
        What::Object { object, part } => pack(2, object, part),
    }
}

/// What a collider's mark says.
pub(super) fn what(mark: u128) -> What {
    let (a, b) = ((mark >> 32) as u32 as usize, mark as u32 as usize);
    match mark >> 64 {
        0 => What::Ground,
        1 => What::Wall { index: a },
        _ => What::Object { object: a, part: b },
    }
}

/// A scene that was checked.
pub(super) fn build(scene: &Scene) -> Physics {
    let mut world = PhysicsWorld::new();
    world.integration_parameters = IntegrationParameters { dt: STEP, ..Default::default() };
    let ground = GroundPieces::new(&scene.ground);
    for piece in ground.pieces() {
        add_ground(piece, &mut world);
    }
    for (index, wall) in scene.walls.iter().enumerate() {
        add_wall(wall, index, &ground, &mut world);
    }
    let objects = scene.objects.iter().enumerate();
    let things = objects.map(|(index, object)| add_object(object, index, &ground, &mut world));
    let things = things.collect();
    // A step of no time, so that rays and sweeps see it all before the first one. (The engine's
    // `detect_collisions` would take in the bodies, too, but never let them move.)
    world.integration_parameters.dt = 0.0;
    world.step();
    world.integration_parameters.dt = STEP;
    let walls = scene.walls.iter().map(|wall| {
        let (start, end) = (Vec2::from(wall.start), Vec2::from(wall.end));
        let top = foot(wall, &ground) + wall.height;
        Upright { start, end, half: 0.5 * wall.thickness, top }
    });
    let walls = walls.collect();
    Physics { world, ground, things, walls, person: None, since: 0.0 }
}

fn surface(shape: ColliderBuilder, what: What, groups: InteractionGroups) -> ColliderBuilder {
    shape
        .friction(ROUGH)
        .friction_combine_rule(CoefficientCombineRule::Min)
        .collision_groups(groups)
        .user_data(mark(what))
}

/// A box from its least to its greatest corner.
fn block(low: Vec3, high: Vec3) -> ColliderBuilder {
    let half = (high - low) * 0.5;
    let centre = to_vector((low + high) * 0.5);
    ColliderBuilder::cuboid(half.x, half.y, half.z).translation(centre)
}

fn add_ground(piece: &Piece, world: &mut PhysicsWorld) {
    let ground = &piece.ground;
    let half = Vec2::from(ground.size) * 0.5;
    let at = Transform::new(Vec3::new(ground.place[0], 0.0, ground.place[1]), yawed(ground.yaw));
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x * half.x, y, z * half.y);
    let mut shapes = vec![];
    match ground.kind {
        GroundKind::Flat { height } => {
            shapes.push(block(corner(-1.0, height - DEPTH, -1.0), corner(1.0, height, 1.0)));
        }
        GroundKind::Slope { from, to } => {
            let low = from.min(to) - DEPTH;
            let ends = [(-1.0, from), (1.0, to)];
            let upright = |(z, top)| {
                [(-1.0, low), (1.0, low), (-1.0, top), (1.0, top)]
                    .map(|(x, y)| to_vector(corner(x, y, z)))
            };
            let corners = ends.map(upright).concat();
            shapes.extend(ColliderBuilder::convex_hull(&corners));
        }
        GroundKind::Steps { from, to, count } => {
            let low = from.min(to) - DEPTH;
            let edge = |step: u32| 2.0 * step as f32 / count as f32 - 1.0;
            shapes.extend((0..count).map(|step| {
                let top = step_height(from, to, count, step);
                block(corner(-1.0, low, edge(step)), corner(1.0, top, edge(step + 1)))
            }));
        }
        GroundKind::Rugged { height, .. } => shapes.extend(piece.field.as_ref().map(|field| {
            let (rows, columns) = field.size();
            // The engine has its heights column by column.
            let places = (0..columns).flat_map(|x| (0..rows).map(move |z| z * columns + x));
            let heights = places.map(|place| field.heights()[place]).collect();
            let span = |count: usize| (count - 1) as f32 * field.cell();
            let scale = Vec3::new(span(columns), 1.0, span(rows));
            ColliderBuilder::heightfield(Array2::new(rows, columns, heights), to_vector(scale))
                .translation(to_vector(Vec3::Y * height))
        })),
    }
    let body = world.insert_body(RigidBodyBuilder::fixed().pose(to_pose(at)));
    for shape in shapes {
        let shape = surface(shape, What::Ground, groups(GROUND, LOOSE));
        world.insert_collider(shape, Some(body));
    }
}

/// Where a wall begins: the lower of the grounds at its ends.
fn foot(wall: &Wall, ground: &GroundPieces) -> f32 {
    let [start, end] = [wall.start, wall.end];
    ground.height(start[0], start[1]).min(ground.height(end[0], end[1]))
}

fn add_wall(wall: &Wall, index: usize, ground: &GroundPieces, world: &mut PhysicsWorld) {
    let (start, end) = (Vec2::from(wall.start), Vec2::from(wall.end));
    let (along, middle) = (end - start, (start + end) * 0.5);
    let low = foot(wall, ground);
    let yaw = libm::atan2f(along.x, along.y);
    let at = Transform::new(Vec3::new(middle.x, low, middle.y), yawed(yaw));
    let half = Vec3::new(wall.thickness * 0.5, wall.height, along.length() * 0.5);
    let shape = block(Vec3::new(-half.x, -DEPTH, -half.z), half);
    let shape = surface(shape, What::Wall { index }, groups(FIXED, LOOSE | CHARACTER));
    world.insert(RigidBodyBuilder::fixed().pose(to_pose(at)), shape);
}

fn add_object(
    object: &Object,
    index: usize,
    ground: &GroundPieces,
    world: &mut PhysicsWorld,
) -> Thing {
    let at = object.transform(ground.height(object.place[0], object.place[1]));
    let parts = object.kind.parts();
    let mut bodies: Vec<Body> = vec![];
    for (number, part) in parts.iter().enumerate() {
        let what = What::Object { object: index, part: number };
        let place = compose(at, part.rest);
        let handle = add_part(part, place, what, world);
        let joint = bodies
            .first()
            .zip(hang(part))
            .map(|(first, joint)| world.insert_impulse_joint(first.handle, handle, joint));
        bodies.push(Body { handle, joint, before: place, now: place });
    }
    Thing { kind: object.kind, at, parts, bodies, push: None, driven: None, held: None }
}

fn add_part(
    part: &Part,
    place: Transform,
    what: What,
    world: &mut PhysicsWorld,
) -> rapier3d::dynamics::RigidBodyHandle {
    let (body, mass, friction, groups) = match part.motion {
        Motion::Fixed => (RigidBodyBuilder::fixed(), 0.0, ROUGH, groups(FIXED, LOOSE | CHARACTER)),
        Motion::Loose { mass, friction } => {
            let body = RigidBodyBuilder::dynamic().ccd_enabled(true);
            (body, mass, friction, groups(LOOSE, Group::ALL))
        }
        // What hangs on a hinge or a spring is balanced: weight would only wear the hinge.
        Motion::Hinge { mass, .. } | Motion::Slide { mass, .. } => {
            // What shuts by itself does so too slowly for the engine to count it as awake.
            let shuts = matches!(part.motion, Motion::Hinge { closer, .. } if closer > 0.0);
            let body = RigidBodyBuilder::dynamic().gravity_scale(0.0).can_sleep(!shuts);
            (body, mass, 0.3, groups(JOINTED, LOOSE | CHARACTER))
        }
    };
    let handle = world.insert_body(body.pose(to_pose(place)));
    let share = mass / part.solids.len() as f32;
    for solid in &part.solids {
        let shape = block(solid.centre - solid.half, solid.centre + solid.half);
        let shape = surface(shape, what, groups).friction(friction).mass(share);
        world.insert_collider(shape, Some(handle));
    }
    handle
}

/// The joint to the object's first part, whose frame is the object's own.
fn hang(part: &Part) -> Option<GenericJoint> {
    let anchor = to_vector(part.rest.translation);
    match part.motion {
        Motion::Hinge { axis, limits, damping, closer, .. } => {
            let joint = RevoluteJointBuilder::new(to_vector(axis))
                .local_anchor1(anchor)
                .limits(limits)
                .contacts_enabled(false)
                .motor_model(MotorModel::ForceBased)
                .motor_position(0.0, closer, damping);
            Some(joint.into())
        }
        Motion::Slide { axis, limits, stiffness, mass } => {
            let joint = PrismaticJointBuilder::new(to_vector(axis))
                .local_anchor1(anchor)
                .limits(limits)
                .contacts_enabled(false)
                .motor_model(MotorModel::ForceBased)
                .motor_position(0.0, stiffness, critical(stiffness, mass));
            Some(joint.into())
        }
        Motion::Fixed | Motion::Loose { .. } => None,
    }
}

/// The damping that brings a spring back without overshoot, N·s/m.
pub(super) fn critical(stiffness: f32, mass: f32) -> f32 {
    2.0 * (stiffness * mass).sqrt()
}

/// A character's capsule around its centre.
pub(super) fn capsule(radius: f32, height: f32) -> ColliderBuilder {
    ColliderBuilder::capsule_y(height * 0.5 - radius, radius)
        .friction(0.0)
        .friction_combine_rule(CoefficientCombineRule::Min)
        .collision_groups(groups(CHARACTER, JOINTED | LOOSE))
}
