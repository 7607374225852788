//! The objects of a scene: kinds, sizes, places.

use std::fmt;

use ambulo_rig::Transform;
use ambulo_rig::glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// An object of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Unique among the objects.
    pub name: String,
    /// Where it stands, (x, z), metres, within 1000 m of 0; the ground says how high.
    pub place: [f32; 2],
    /// Where its front looks: 0 along +Z, π/2 along +X; radians.
    #[serde(default)]
    pub yaw: f32,
    /// How far over the ground, metres, 0 to 10: a box on another.
    #[serde(default)]
    pub lift: f32,
    /// Files of the interactions that it offers, at most 16; one that comes first wins over others
    /// that are on offer, too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub interactions: Vec<String>,
    /// What it is.
    pub kind: Kind,
}

/// What an object is, with its sizes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Kind {
    /// Frames: object, leaf, handle_front, handle_back.
    Door(Door),
    /// Frames: object, seat, back.
    Chair(Chair),
    /// Frames: object, box, front, back, left, right, top.
    Box(MovableBox),
    /// Frames: object, cap, face.
    Button(Button),
    /// Frames: object, arm, grip.
    Lever(Lever),
}

/// What an object is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum ObjectKind {
    Door,
    Chair,
    Box,
    Button,
    Lever,
}

/// A side of an object, seen by the object itself: its front is +Z, its left +X.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum Side {
    Left,
    Right,
}

/// A door in its frame; closed at the angle 0, a positive one opens it towards its front.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Door {
    /// Of the leaf, metres, 0.4 to 3.
    pub width: f32,
    /// Of the leaf, metres, 1 to 4.
    pub height: f32,
    /// Of the leaf, metres, 0.01 to 0.2.
    #[serde(default = "door_thickness")]
    pub thickness: f32,
    /// Width of the frame's posts, metres, 0.02 to 0.5.
    #[serde(default = "door_frame")]
    pub frame: f32,
    /// Height of both handles over the ground, metres, 0.3 to 2 and below the top.
    pub handle_height: f32,
    /// Where the hinge is.
    pub hinge: Side,
    /// Least and greatest angle of the leaf, radians, within ±2.8, 0 between them.
    pub limits: [f32; 2],
    /// Of the leaf, kilograms, 1 to 500.
    pub mass: f32,
    /// What slows the leaf, N·m·s/rad, 0.01 to 1000.
    #[serde(default = "door_damping")]
    pub damping: f32,
    /// What shuts it when nobody holds it, N·m/rad, 0 to 1000; 0: it stays as it is.
    #[serde(default)]
    pub closer: f32,
}

/// Something to sit on that does not move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Chair {
    /// Top of the seat over the ground, metres, 0.15 to 1.2.
    pub seat_height: f32,
    /// From the front of the seat to the back rest, metres, 0.2 to 1.2.
    pub seat_depth: f32,
    /// Metres, 0.2 to 4.
    pub width: f32,
    /// Top of the back rest over the ground, metres, at most 2; 0 for none, otherwise above the seat.
    pub back_height: f32,
}

/// A box that can be moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MovableBox {
    /// Along x, y and z, metres, each 0.05 to 5.
    pub size: [f32; 3],
    /// Kilograms, 0.05 to 5000.
    pub mass: f32,
    /// Coulomb friction on the ground, 0.01 to 2; between two boxes the lower one counts.
    pub friction: f32,
}

/// A button on the front of a post.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Button {
    /// Of its middle over the ground, metres, 0.2 to 2.5.
    pub height: f32,
    /// Half its width, metres, 0.01 to 0.3.
    pub radius: f32,
    /// How far it goes in, metres, 0.002 to 0.1.
    pub travel: f32,
    /// Of the spring that brings it back, N/m, 10 to 100000.
    #[serde(default = "button_stiffness")]
    pub stiffness: f32,
}

/// A lever on a post, upright at the angle 0; a positive one lays it over towards its front.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Lever {
    /// Of its pivot over the ground, metres, 0.1 to 2.
    pub height: f32,
    /// From the pivot to the grip, metres, 0.1 to 2.
    pub length: f32,
    /// Least and greatest angle, radians, within ±2.8, 0 between them.
    pub limits: [f32; 2],
    /// What slows it, N·m·s/rad, 0.01 to 1000.
    #[serde(default = "lever_damping")]
    pub damping: f32,
    /// What brings it back upright when nobody holds it, N·m/rad, 0 to 1000; 0: it stays as it is.
    #[serde(default)]
    pub closer: f32,
}

fn door_thickness() -> f32 {
    0.04
}

fn door_frame() -> f32 {
    0.08
}

fn door_damping() -> f32 {
    2.0
}

fn button_stiffness() -> f32 {
    400.0
}

fn lever_damping() -> f32 {
    2.0
}

impl Object {
    /// Its frame in the world, the ground under it being `ground` metres high.
    pub fn transform(&self, ground: f32) -> Transform {
        let place = Vec3::new(self.place[0], ground + self.lift, self.place[1]);
        Transform::new(place, yawed(self.yaw))
    }
}

/// A turn about +Y, the same bits on every machine.
pub(crate) fn yawed(yaw: f32) -> Quat {
    Quat::from_xyzw(0.0, libm::sinf(yaw * 0.5), 0.0, libm::cosf(yaw * 0.5))
}

impl Kind {
    /// Which one.
    pub fn kind(&self) -> ObjectKind {
        match self {
            Kind::Door(_) => ObjectKind::Door,
            Kind::Chair(_) => ObjectKind::Chair,
            Kind::Box(_) => ObjectKind::Box,
            Kind::Button(_) => ObjectKind::Button,
            Kind::Lever(_) => ObjectKind::Lever,
        }
    }
}

impl ObjectKind {
    /// The frames that points of an interaction may lie in.
    pub fn frames(self) -> &'static [&'static str] {
        match self {
            ObjectKind::Door => &["object", "leaf", "handle_front", "handle_back"],
            ObjectKind::Chair => &["object", "seat", "back"],
            ObjectKind::Box => &["object", "box", "front", "back", "left", "right", "top"],
            ObjectKind::Button => &["object", "cap", "face"],
            ObjectKind::Lever => &["object", "arm", "grip"],
        }
    }
}

impl fmt::Display for ObjectKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ObjectKind::Door => "door",
            ObjectKind::Chair => "chair",
            ObjectKind::Box => "box",
            ObjectKind::Button => "button",
            ObjectKind::Lever => "lever",
        })
    }
}
