//! What a character asks of the world around it, and does to it: what a game answers from its own
//! physics.

use ambulo_control::Wall;
use ambulo_rig::glam::{Vec2, Vec3};
use ambulo_rig::{Terrain, Transform};

use crate::{Push, Refused};

/// Something done to an object. Radians, metres, newtons, newton metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Deed {
    /// Leads a hinge to an angle with at most that torque, until released.
    Drive {
        /// Radians.
        to: f32,
        /// Newton metres.
        most: f32,
    },
    /// Presses a button with at most that force, until released.
    Press {
        /// How far of its way, 0 to 1.
        depth: f32,
        /// Newtons.
        most: f32,
    },
    /// Lets a hinge or a button go.
    Release,
    /// Pushes along the ground until told otherwise; `None` ends it.
    Push(Option<Push>),
    /// From now on it goes where its holder goes.
    Attach(Transform),
    /// Where the holder is: in every frame while it is held.
    Carry(Transform),
    /// Lets go of what is held.
    Detach,
}

/// The world as a character meets it. [`crate::Physics`] answers for a scene; a game answers from its
/// own. Objects go by the index that the game gave them.
pub trait Surroundings {
    /// The ground.
    fn terrain(&self) -> &dyn Terrain;

    /// Adds what a walker keeps out of within `within` metres of a place: its segments, each with the
    /// distance to keep. That is `keep` metres from every surface, but for the object in `nearer`,
    /// which may come as near as the number beside it says.
    fn walls(
        &self,
        place: Vec2,
        within: f32,
        keep: f32,
        nearer: Option<(usize, f32)>,
        out: &mut Vec<Wall>,
    );

    /// How far a place (x, z) is from the nearest side of an object that is in a walker's way, metres;
    /// a large number of one that is not.
    fn distance(&self, object: usize, place: Vec2) -> f32;

    /// The shortest way out of what is solid for a point in it, metres; none for one that is free. The
    /// ground does not count, nor does the object `but`.
    fn way_out(&self, point: Vec3, but: Option<usize>) -> Option<Vec3>;

    /// How far the hinge of an object is turned, radians; 0 of one without.
    fn turned(&self, object: usize) -> f32;

    /// Where a named frame of an object is now, in the world.
    fn frame(&self, object: usize, name: &str) -> Option<Transform>;

    /// Does something to an object.
    ///
    /// # Errors
    /// What the object cannot do.
    fn act(&mut self, object: usize, deed: Deed) -> Result<(), Refused>;

    /// How much of a walker's pace is left when it pushes an object with at most so many newtons, 0
    /// to 1.
    fn ease(&self, object: usize, force: f32) -> f32;

    /// Says where the character's feet are, so that nothing sweeps through it.
    fn character_at(&mut self, feet: Vec3);
}
