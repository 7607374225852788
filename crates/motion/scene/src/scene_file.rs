//! A scene file, field by field.

use serde::{Deserialize, Serialize};

use crate::interaction::Interaction;
use crate::object::Object;
use crate::reading::{self, FileError, Found};
use crate::scene_check;

/// The version of the file format that this code reads and writes.
pub const SCENE_FORMAT: u32 = 1;

/// Ground, walls, objects, and where a character starts.
///
/// Metres, radians; places are (x, z), within 1000 m of 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Version of this format: 1.
    pub format: u32,
    /// What people call it.
    pub name: String,
    /// Anything worth knowing.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
    /// Where a character starts.
    pub spawn: Spawn,
    /// Pieces of ground, 1 to 64. Where several lie over each other the highest counts; beyond all of
    /// them the nearest one's border goes on.
    pub ground: Vec<Ground>,
    /// Walls, at most 256.
    #[serde(default, rename = "wall", skip_serializing_if = "Vec::is_empty")]
    pub walls: Vec<Wall>,
    /// Objects, at most 256.
    #[serde(default, rename = "object", skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<Object>,
}

/// Where a character starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Spawn {
    /// Metres.
    pub place: [f32; 2],
    /// Where it faces: 0 along +Z, π/2 along +X.
    #[serde(default)]
    pub yaw: f32,
}

/// A rectangular piece of ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Ground {
    /// Its middle, metres.
    pub place: [f32; 2],
    /// How its axes are turned about +Y, radians.
    #[serde(default)]
    pub yaw: f32,
    /// Along its x and z, metres, each 0.5 to 2000.
    pub size: [f32; 2],
    /// What it is like; heights are -100 to 100 m.
    pub kind: GroundKind,
}

/// What a piece of ground is like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum GroundKind {
    /// The same height everywhere.
    Flat {
        /// Metres.
        height: f32,
    },
    /// Hills made from a seed, falling off to `height` over a tenth of the piece at its border; the
    /// piece is at most 64 m a side.
    Rugged {
        /// Metres: the lowest.
        height: f32,
        /// Metres from the lowest to the highest, 0 to 20.
        rise: f32,
        /// Metres: the length of the longest waves, 4 to 100.
        wave: f32,
        /// Another seed, other hills.
        seed: u32,
    },
    /// Rising evenly along its z.
    Slope {
        /// Height where z is least, metres.
        from: f32,
        /// Height where z is greatest, metres.
        to: f32,
    },
    /// Rising along its z in equal steps.
    Steps {
        /// Height of the first step, metres.
        from: f32,
        /// Height of the last step, metres.
        to: f32,
        /// How many steps, 2 to 100.
        count: u32,
    },
}

/// An upright wall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// One end, metres.
    pub start: [f32; 2],
    /// The other end, at least 1 cm away.
    pub end: [f32; 2],
    /// From the lower of the grounds at its ends to its top, metres, 0.1 to 20.
    pub height: f32,
    /// Metres, 0.02 to 5.
    #[serde(default = "wall_thickness")]
    pub thickness: f32,
}

fn wall_thickness() -> f32 {
    0.1
}

impl Scene {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// Everything that is wrong, each with its path; lines where the text itself is.
    pub fn parse(text: &str) -> Result<Self, FileError> {
        let scene: Self = reading::parse(text, SCENE_FORMAT)?;
        scene.check()?;
        Ok(scene)
    }

    /// Whether it is one that could have been read.
    ///
    /// # Errors
    /// Everything that is wrong, each with its path.
    pub fn check(&self) -> Result<(), FileError> {
        scene_check::problems(self).finish()
    }

    /// As a file.
    pub fn to_text(&self) -> String {
        toml::to_string(self).expect("plain numbers and words can be written")
    }

    /// The object of a name.
    pub fn object(&self, name: &str) -> Option<usize> {
        self.objects.iter().position(|object| object.name == name)
    }

    /// Whether the objects can offer the interactions they name; `find` says what is in a file.
    ///
    /// # Errors
    /// Each file that `find` does not know, and each interaction that is for another kind.
    pub fn check_interactions<'a>(
        &self,
        find: impl Fn(&str) -> Option<&'a Interaction>,
    ) -> Result<(), FileError> {
        let mut found = Found::default();
        for (index, object) in self.objects.iter().enumerate() {
            let kind = object.kind.kind();
            for (which, file) in object.interactions.iter().enumerate() {
                let path = format!("$.object[{index}].interactions[{which}]");
                match find(file) {
                    None => found.add(path, format!("there is no '{file}'")),
                    Some(one) if one.object != kind => {
                        let other = one.object;
                        found.add(path, format!("'{file}' is for a {other}, this is a {kind}"));
                    }
                    Some(_) => {}
                }
            }
        }
        found.finish()
    }
}
