//! What surrounds a character: ground, walls and objects, what can be done with them, and their
//! physics.
//!
//! An [`Interaction`] and a [`Scene`] are files that people write (`schema/interaction.schema.json`,
//! `schema/scene.schema.json`); a [`Physics`] is a scene that moves. An interaction fits every object
//! of its kind, because its points hang on the named frames of the object (a door's handle, a chair's
//! seat) and not on numbers of one door.
//!
//! Metres, kilograms, seconds, radians, newtons; right-handed, +Y up. An object's front is its +Z, its
//! left +X; a yaw turns +Z towards +X. Unit quaternions as (x, y, z, w).

mod actor;
mod approach;
mod curve;
mod exact;
mod ground;
mod interaction;
mod interaction_check;
mod locate;
mod object;
mod parts;
mod physics;
mod reading;
mod scene_check;
mod scene_file;
mod surroundings;
mod visit;

pub use actor::{
    About, Act, Acted, Actor, Body, BodyError, Led, Move, MoveError, Moves, Phase, Told, Wish,
};
pub use approach::{Going, Walk, Why};
pub use curve::weight;
pub use ground::GroundPieces;
pub use interaction::{
    Action, Approach, Clip, Exit, Gait, Hand, INTERACTION_FORMAT, Interaction, Limb, Target,
    Trigger, Volume, Walks, When,
};
pub use locate::place;
pub use object::{Button, Chair, Door, Kind, Lever, MovableBox, Object, ObjectKind, Side};
pub use parts::{Frame, Motion, Part, Solid};
pub use physics::{Hit, Moved, Physics, Push, Refused, STEP, Step, What};
pub use reading::{FileError, Problem};
pub use scene_file::{Ground, GroundKind, SCENE_FORMAT, Scene, Spawn, Wall};
pub use surroundings::{Deed, Surroundings};
pub use visit::{
    Happened, Interruptions, Measured, SCRIPT_FORMAT, Script, Task, Visit, VisitError,
};
