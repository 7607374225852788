//! A creature file, field by field.

use serde::{Deserialize, Serialize};

/// The version of the file format that this code reads and writes.
pub const FORMAT_VERSION: u32 = 1;

/// A 2D creature: rigid parts joined by hinges with motors.
///
/// SI units and radians; x to the right, y up. Positions and anchors are points of the start pose;
/// the whole creature is lowered onto the ground before it starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Version of this format: 1.
    pub format: u32,
    /// What people call it.
    pub name: String,
    /// Anything worth knowing: where sizes and strengths come from.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
    /// Its parts, at most 64; drawn in this order, later ones in front. Exactly one is tagged
    /// `torso`, and every other hangs on one joint as its child.
    pub parts: Vec<Part>,
    /// Its joints: a tree with the torso as its root.
    pub joints: Vec<Joint>,
    /// What its controller is told, in this order.
    #[serde(default = "default_sensors")]
    pub sensors: Vec<Sensor>,
    /// Names of joints that belong together as left and right do.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<[String; 2]>,
}

/// A rigid part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Unique among the parts.
    pub name: String,
    /// Its outline, in its own frame.
    pub shape: Shape,
    /// Where its frame is in the start pose, metres, within 100 m of 0.
    pub position: [f32; 2],
    /// How its frame is turned in the start pose, radians.
    #[serde(default)]
    pub angle: f32,
    /// Kilograms a square metre, 0.1 to 10000.
    pub density: f32,
    /// Coulomb friction, 0 to 10; against the ground the geometric mean of both counts.
    #[serde(default = "default_friction")]
    pub friction: f32,
    /// What it is.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tags: Vec<Tag>,
}

/// An outline around the origin of a part's frame; sizes are 0.01 to 20 m, sides of boxes and
/// polygons at least 0.025 m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A rectangle, its sides along the axes.
    Box {
        /// Along x, metres.
        width: f32,
        /// Along y, metres.
        height: f32,
    },
    /// A circle.
    Circle {
        /// Metres.
        radius: f32,
    },
    /// Two half circles and what lies between; upright.
    Capsule {
        /// Between the centres of the half circles, along y, metres.
        length: f32,
        /// Metres.
        radius: f32,
    },
    /// A convex polygon.
    Polygon {
        /// Its 3 to 8 corners in order, either way around, metres.
        points: Vec<[f32; 2]>,
    },
}

/// What a part is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Tag {
    /// The part that all others hang on and that is measured; exactly one.
    Torso,
    /// A segment of a leg; the last of a chain of them is its foot.
    Leg,
    /// The part of a leg that is meant to touch the ground, where that is not its last segment.
    Foot,
    /// Carried along: its joint is held, not driven.
    Hand,
    /// Carried along: its joint is held, not driven.
    Head,
    /// Carried along: its joint is held, not driven.
    Ignored,
}

/// A hinge with a motor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Unique among the joints.
    pub name: String,
    /// The part nearer to the torso.
    pub parent: String,
    /// The part that hangs on it.
    pub child: String,
    /// Where the hinge is in the start pose, metres.
    pub anchor: [f32; 2],
    /// Least and greatest angle of the child against the parent, radians from the start pose,
    /// counter-clockwise; the first is at most 0, the second at least 0.
    pub limits: [f32; 2],
    /// The most that the motor gives, newton metres, above 0 and at most 100000.
    pub torque: f32,
    /// The fastest that the motor turns, radians a second, above 0 and at most 100.
    pub speed: f32,
}

/// Something that a controller is told each step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Sensor {
    /// How far the torso has turned from the start pose. 1 number.
    TorsoRotation,
    /// How far each driven joint has turned from the start pose. A number a joint.
    JointAngles,
    /// How fast each driven joint turns. A number a joint.
    JointSpeeds,
    /// Whether each foot touches the ground. A number a leg.
    FootContacts,
    /// Height of the torso over the ground below it. 1 number.
    Height,
    /// Velocity of the torso, forward and up. 2 numbers.
    Velocity,
    /// How high the ground ahead lies over the ground below the torso, felt along upright rays.
    GroundRays {
        /// How many rays, 1 to 16; as many numbers.
        count: u32,
        /// How far ahead the last one is, metres, 0.1 to 50; the others are spaced evenly.
        reach: f32,
    },
}

fn default_friction() -> f32 {
    0.8
}

fn default_sensors() -> Vec<Sensor> {
    vec![Sensor::TorsoRotation, Sensor::JointAngles]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The schema that other languages read is made from these types. To write it again, run the
    /// test with AMBULO_WRITE_SCHEMA=1.
    #[test]
    fn the_schema_file_is_what_these_types_say() {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../schema/creature.schema.json");
        let made =
            serde_json::to_string_pretty(&schemars::schema_for!(Description)).unwrap() + "\n";
        if std::env::var_os("AMBULO_WRITE_SCHEMA").is_some() {
            std::fs::write(&path, &made).unwrap();
        }
        let there = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            there == made,
            "schema/creature.schema.json has drifted: AMBULO_WRITE_SCHEMA=1 cargo test -p ambulo-body"
        );
    }
}
