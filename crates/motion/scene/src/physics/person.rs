//! A character's capsule: nothing solid lets it through.

use ambulo_rig::Transform;
use ambulo_rig::glam::{Quat, Vec2, Vec3};
use rapier3d::dynamics::{RigidBodyBuilder, RigidBodyHandle};
use rapier3d::geometry::SharedShape;
use rapier3d::parry::query::details::ShapeCastOptions;
use rapier3d::pipeline::QueryFilter;

use super::build::{capsule, in_the_way, what};
use super::{Physics, Refused, What, from_vector, level, near, to_pose, to_vector};

/// Metres that are kept from everything, so that rounding never counts as touching.
const SKIN: f32 = 0.01;
/// Metres.
const NUDGE: f32 = 1e-4;
/// How often a movement is turned along what it meets.
const TURNS: usize = 4;

/// The capsule.
pub(super) struct Person {
    pub body: RigidBodyHandle,
    shape: SharedShape,
    height: f32,
    /// Where the feet are after the last movement, and at the last fixed step.
    feet: Vec3,
    was: Vec3,
}

/// Where a movement led.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// Where the feet are now.
    pub feet: Vec3,
    /// What was in the way, if anything was.
    pub met: Option<What>,
}

impl Physics {
    /// Puts the character somewhere, whatever is there: an upright capsule over the feet. Radius 0.05
    /// to 1 m, height 0.5 to 3 m and more than two radii.
    ///
    /// # Errors
    /// Numbers that are not finite or out of range.
    pub fn place_character(&mut self, feet: Vec3, radius: f32, height: f32) -> Result<(), Refused> {
        let sizes = (0.05..=1.0).contains(&radius) && (0.5..=3.0).contains(&height);
        if !(near(feet) && sizes && height > 2.0 * radius) {
            return Err(Refused::Number);
        }
        if let Some(person) = self.person.take() {
            self.world.remove_body(person.body);
        }
        let at = Transform::new(feet + Vec3::Y * height * 0.5, Quat::IDENTITY);
        let body = RigidBodyBuilder::kinematic_position_based().pose(to_pose(at));
        let collider = capsule(radius, height).build();
        let shape = collider.shared_shape().clone();
        let (body, _) = self.world.insert(body, collider);
        self.person = Some(Person { body, shape, height, feet, was: feet });
        Ok(())
    }

    /// Moves the character towards a place along the ground, and slides it along what is in the way:
    /// door leaves, boxes, chairs, walls. Its feet take the height that is asked for. What it carries
    /// is not in its way.
    ///
    /// # Errors
    /// Numbers that are not finite or out of range; no character yet.
    pub fn move_character(&mut self, to: Vec3) -> Result<Moved, Refused> {
        if !near(to) {
            return Err(Refused::Number);
        }
        let person = self.person.as_ref().ok_or(Refused::Character)?;
        let (feet, met) = self.slide(person, to);
        let person = self.person.as_mut().ok_or(Refused::Character)?;
        person.feet = feet;
        Ok(Moved { feet, met })
    }

    /// Where the character's feet are after its last movement.
    pub fn character(&self) -> Option<Vec3> {
        self.person.as_ref().map(|person| person.feet)
    }

    /// Straight on until something is met, then along it.
    fn slide(&self, person: &Person, to: Vec3) -> (Vec3, Option<What>) {
        let wanted = level(to - person.feet);
        let (mut at, mut left, mut met) = (level(person.feet), wanted, None);
        for _ in 0..TURNS {
            if left.dot(wanted) <= 1e-12 {
                break;
            }
            let centre = Vec3::new(at.x, to.y + person.height * 0.5, at.y);
            let Some((time, out, hit)) = self.sweep(person, centre, left) else {
                at += left;
                break;
            };
            met = met.or(Some(hit));
            // Facing away from the movement, whichever side the surface counts as outer.
            let against = if out.dot(left) > 0.0 { -out } else { out };
            // A little off it, so that sliding along it does not meet it again at once.
            at += left * time + against * NUDGE;
            left *= 1.0 - time;
            if against == Vec2::ZERO {
                break;
            }
            left -= against * left.dot(against);
        }
        (Vec3::new(at.x, to.y, at.y), met)
    }

    /// How far along a movement something is met, 0 to 1; its normal along the ground, and what it is.
    fn sweep(&self, person: &Person, centre: Vec3, along: Vec2) -> Option<(f32, Vec2, What)> {
        let held = |handle| {
            let mut held = self.things.iter().filter(|thing| thing.held.is_some());
            held.any(|thing| thing.bodies.iter().any(|body| Some(body.handle) == handle))
        };
        let solid = |_, collider: &rapier3d::geometry::Collider| !held(collider.parent());
        let filter = QueryFilter::default()
            .groups(in_the_way())
            .exclude_rigid_body(person.body)
            .predicate(&solid);
        let options = ShapeCastOptions {
            max_time_of_impact: 1.0,
            target_distance: SKIN,
            stop_at_penetration: false,
            compute_impact_geometry_on_penetration: true,
        };
        let at = to_pose(Transform::new(centre, Quat::IDENTITY));
        let along = to_vector(Vec3::new(along.x, 0.0, along.y));
        let (handle, hit) = self.world.cast_shape(&at, along, &*person.shape, options, filter)?;
        let out = level(from_vector(hit.normal1)).normalize_or_zero();
        Some((hit.time_of_impact, out, what(self.world.colliders[handle].user_data)))
    }

    pub(super) fn move_person(&mut self, left: u32) {
        if let Some(person) = &mut self.person {
            person.was = person.was.lerp(person.feet, 1.0 / left as f32);
            let centre = person.was + Vec3::Y * person.height * 0.5;
            self.world.bodies[person.body].set_next_kinematic_translation(to_vector(centre));
        }
    }
}
