//! An interaction file, field by field.

use ambulo_rig::Transform;
use ambulo_rig::glam::{Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::curve::weight;
use crate::interaction_check;
use crate::object::ObjectKind;
use crate::reading::{self, FileError};

/// The version of the file format that this code reads and writes.
pub const INTERACTION_FORMAT: u32 = 1;

/// What a character can do with an object of a kind: a clip over its motion, limbs on the object.
///
/// Metres, seconds, radians, newtons. Points lie in the frame that `on` names: `object` (its place on
/// the ground, front along +Z, left along +X) or one of those that the kind has. Times are seconds of
/// the clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Interaction {
    /// Version of this format: 1.
    pub format: u32,
    /// What people call it.
    pub name: String,
    /// Anything worth knowing.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
    /// Objects of this kind can offer it.
    pub object: ObjectKind,
    /// Where a character must be for it to be on offer.
    pub trigger: Trigger,
    /// Where it begins.
    pub approach: Approach,
    /// The motion and its phases.
    pub clip: Clip,
    /// Limbs that are led to the object, at most one entry a limb.
    #[serde(default, rename = "target", skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<Target>,
    /// What the object does meanwhile; nothing if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub action: Option<Action>,
    /// How it ends.
    pub exit: Exit,
}

/// Where a character must be: the point on the ground under its hips counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Trigger {
    /// The frame that the volume lies in.
    #[serde(default = "object_frame")]
    pub on: String,
    /// The volume.
    pub volume: Volume,
}

/// A volume, in the frame of its trigger; sizes are 0.05 to 50 m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Volume {
    /// Its sides along the axes.
    Box {
        /// Metres.
        centre: [f32; 3],
        /// Whole extents along x, y and z, metres.
        size: [f32; 3],
    },
    /// A sphere.
    Sphere {
        /// Metres.
        centre: [f32; 3],
        /// Metres.
        radius: f32,
    },
}

/// Where a character stands, and how, when the clip begins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Approach {
    /// The frame that the place lies in, as it is when the clip begins.
    #[serde(default = "object_frame")]
    pub on: String,
    /// Along the frame's x and z, metres; the ground says how high.
    pub place: [f32; 2],
    /// Yaw against the frame: 0 looks along its +Z, π back at it.
    pub facing: f32,
    /// How a character may be moving when it comes; any of them.
    pub gaits: Vec<Gait>,
    /// How far from the place the clip may begin, metres, 0.01 to 2.
    pub distance: f32,
    /// How far from the facing, radians, 0.01 to 3.2.
    pub angle: f32,
}

/// How a character moves when it comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum Gait {
    Stand,
    Walk,
    Jog,
    Run,
    Crouch,
}

/// The clip that is laid over the character's motion, and where its phases begin: enter, hold, exit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Clip {
    /// A motion file (.keys, .bvh, .amc, .glb, .gltf), beside this one or in the folder `clips` beside
    /// its folder; without one only the limbs below are led, over the character's own motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Play it as a mirror shows it.
    #[serde(default)]
    pub mirror: bool,
    /// When the legs go on by themselves, the clip having the upper body only.
    #[serde(default)]
    pub walks: Walks,
    /// When the clip begins to play.
    pub enter: f32,
    /// When the hold begins: hands on the handle, hips on the seat.
    pub hold: f32,
    /// When the exit begins; not before the hold.
    pub exit: f32,
    /// When it is over; at most 600 s.
    pub end: f32,
    /// The hold is played again and again until the interaction is left.
    #[serde(default)]
    pub hold_repeats: bool,
    /// Factor on the clip's own speed during the hold, 0.05 to 5: a door that opens at a walk.
    #[serde(default = "one")]
    pub hold_speed: f32,
}

/// When a character walks while a clip plays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Walks {
    /// It stands where the clip begins, and the whole body is the clip's.
    #[default]
    Never,
    /// During the hold it goes where the player wants: carrying something.
    Hold,
    /// All the time: through a door, behind a box.
    Always,
}

/// A limb that is led to a point of the object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Which.
    pub limb: Limb,
    /// The frame that the point moves with.
    #[serde(default = "object_frame")]
    pub on: String,
    /// Where the limb goes, metres: a palm, a sole, the middle of the hips, what is looked at.
    #[serde(default)]
    pub point: [f32; 3],
    /// How it is turned, a unit quaternion: a hand has its fingers along +Z and its back to +Y, a
    /// foot and the hips look along +Z with +Y up. The limb keeps its own rotation if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<[f32; 4]>,
    /// How much it counts over the clip: 2 to 16 keys [time, 0 to 1], times rising, 0 first and last;
    /// it eases in between.
    pub weight: Vec<[f32; 2]>,
}

/// What is led.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum Limb {
    LeftHand,
    RightHand,
    Hips,
    LeftFoot,
    RightFoot,
    /// The head, turned to look at a point.
    Look,
}

/// A hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum Hand {
    LeftHand,
    RightHand,
}

/// What the object does. It begins at `from` and ends at `until`, seconds of the clip; without
/// `until`, with the clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Action {
    /// A door or a lever turns; the hinge's own limits hold.
    Hinge {
        /// The hand that drives it: one of the targets.
        hand: Hand,
        /// Where to, radians; a positive angle opens towards the object's front.
        angle: f32,
        /// At most this much, newton metres, 0.1 to 1000.
        torque: f32,
        /// Seconds.
        from: f32,
        /// Seconds.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        until: Option<f32>,
    },
    /// A box goes where the hands go; let go at `until`, or when the clip is over.
    Attach {
        /// One, or both: all of them are targets. It hangs on the first.
        hands: Vec<Hand>,
        /// Seconds.
        from: f32,
        /// Seconds.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        until: Option<f32>,
    },
    /// A box is pushed along the ground; its friction slows the character.
    Push {
        /// The most that the character can push with, newtons, 1 to 2000.
        force: f32,
        /// How fast it would walk if nothing resisted, metres a second, 0.1 to 5.
        speed: f32,
        /// Seconds.
        from: f32,
        /// Seconds.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        until: Option<f32>,
    },
    /// A chair bears the hips.
    Seat {
        /// Seconds.
        from: f32,
        /// Seconds.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        until: Option<f32>,
    },
    /// A button goes in.
    Press {
        /// The hand that presses it: one of the targets.
        hand: Hand,
        /// How far of its travel, 0 to 1.
        depth: f32,
        /// At most this much, newtons, 0.1 to 1000.
        force: f32,
        /// Seconds.
        from: f32,
        /// Seconds.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        until: Option<f32>,
    },
}

/// How an interaction ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Exit {
    /// What makes the hold give way to the exit.
    pub when: When,
    /// The frame that the place lies in.
    #[serde(default = "object_frame")]
    pub on: String,
    /// Where the character then stands, along the frame's x and z, metres; where the clip has left it
    /// if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[f32; 2]>,
    /// And how it faces, yaw against the frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facing: Option<f32>,
}

/// What makes a hold give way to the exit; all but the first need a hold that repeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum When {
    /// The clip goes on by itself.
    ClipEnds,
    /// The player wants to go somewhere: getting up from a chair.
    PlayerMoves,
    /// The player no longer wants to go on: letting go of what was pushed.
    PlayerStops,
    /// The player asks for it: putting down what was picked up.
    PlayerAsks,
}

fn one() -> f32 {
    1.0
}

fn object_frame() -> String {
    "object".into()
}

impl Interaction {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// Everything that is wrong, each with its path; lines where the text itself is.
    pub fn parse(text: &str) -> Result<Self, FileError> {
        let interaction: Self = reading::parse(text, INTERACTION_FORMAT)?;
        interaction.check()?;
        Ok(interaction)
    }

    /// Whether it is one that could have been read.
    ///
    /// # Errors
    /// Everything that is wrong, each with its path.
    pub fn check(&self) -> Result<(), FileError> {
        interaction_check::problems(self).finish()
    }

    /// As a file.
    pub fn to_text(&self) -> String {
        toml::to_string(self).expect("plain numbers and words can be written")
    }

    /// The target of a limb.
    pub fn target(&self, limb: Limb) -> Option<&Target> {
        self.targets.iter().find(|target| target.limb == limb)
    }
}

impl Volume {
    /// Whether a point, given in the frame of the trigger, lies inside; one that is not finite never
    /// does.
    pub fn contains(&self, point: Vec3) -> bool {
        match *self {
            Volume::Box { centre, size } => {
                let off = (point - Vec3::from(centre)).abs();
                off.cmple(Vec3::from(size) * 0.5).all()
            }
            Volume::Sphere { centre, radius } => point.distance(centre.into()) <= radius,
        }
    }
}

impl Approach {
    /// Place (x, z) and yaw in the world, the frame being where it is.
    pub fn stand(&self, frame: Transform) -> (Vec2, f32) {
        stand(frame, self.place, self.facing)
    }
}

/// A place and a facing of a frame in the world: (x, z) and yaw.
pub(crate) fn stand(frame: Transform, place: [f32; 2], facing: f32) -> (Vec2, f32) {
    let ahead = frame.rotation * Vec3::Z;
    let yaw = libm::atan2f(ahead.x, ahead.z);
    let at = frame.transform_point(Vec3::new(place[0], 0.0, place[1]));
    (Vec2::new(at.x, at.z), yaw + facing)
}

impl Target {
    /// How much it counts at a second of the clip, 0 to 1.
    pub fn weight(&self, time: f32) -> f32 {
        weight(&self.weight, time)
    }

    /// Where the limb goes, in its frame.
    pub fn place(&self) -> Transform {
        let rotation = self.rotation.map_or(Quat::IDENTITY, Quat::from_array).normalize();
        Transform::new(self.point.into(), rotation)
    }
}

impl From<Hand> for Limb {
    fn from(hand: Hand) -> Limb {
        match hand {
            Hand::LeftHand => Limb::LeftHand,
            Hand::RightHand => Limb::RightHand,
        }
    }
}

impl Action {
    /// When it begins and ends, seconds of the clip.
    pub fn times(&self) -> (f32, Option<f32>) {
        match *self {
            Action::Hinge { from, until, .. }
            | Action::Attach { from, until, .. }
            | Action::Push { from, until, .. }
            | Action::Seat { from, until }
            | Action::Press { from, until, .. } => (from, until),
        }
    }
}
