//! `.keys`: motion as a few key poses, written by hand. Metres, seconds, degrees; +Y up, +Z ahead.
//!
//! ```text
//! keys 1                            # the version of the format
//! skeleton human.skeleton           # bones, limbs and poses of a file beside this one
//! fps 60                            # of the clip that it becomes; 60 without it
//! phase enter 0 0.8                 # marked spans, in order; `loop` ends the line of one that loops
//! event grasp 0.6
//!
//! key 0 pose stand                  # a whole pose …
//! key 0.6                           # … and what is changed of it; all else holds its last key
//!   Hips at 0 0.93 0.02  turn -6
//!   Spine Spine1 Spine2 bend 4      # several joints alike
//!   right_arm at -0.2 1 0.5  facing 90 0 0
//! ```
//!
//! A line is a statement, `#` starts a comment, indents mean nothing.
//!
//! * `bone NAME PARENT x y z`, parents first, `-` for the root's; `tip JOINT x y z`.
//! * `turns JOINT flex -y twist x`: the joint's angles by name, each about an axis. They compose
//!   left to right, about the turned axes (R = R₁·R₂). Without such a line they are `y`, `x` and
//!   `z`, in that order. The root has `at x y z`, too.
//! * `limb NAME UPPER LOWER END grip x y z`: three joints in a chain and a point in the last one's
//!   frame. `at x y z` puts that point there in the world, whatever the hips do: the two bones
//!   bend in the plane in which their angles have them, turned by `swivel` degrees about the line
//!   from start to end. Meanwhile the last joint is turned in the world by `facing y z x`, degrees
//!   about those axes in that order: where a hand points, how steeply, and rolled how. `free` gives
//!   the limb back to its angles; `weight` says how much of it is placed.
//! * `pose NAME`: lines as of a key; what they leave out is at rest.
//! * `key TIME`, ascending from 0, then any of: how it is passed (`smooth`, at rest there, which is
//!   the default; `through`, without stopping; `linear`, at an even speed from the key before);
//!   `partial`: what the key leaves out is not held, but moves on as if it were not there;
//!   `pose NAME`: starts from that pose.
//! * `mirror FILE`, with nothing else: the other side's clip.
//!
//! The first place of a limb counts before it, too, so that a hand comes straight from where its
//! angles have it to where it is put.

mod body;
mod figure;
mod limb;
mod lines;
mod read;
mod sample;
mod set;
mod write;

use ambulo_rig::Clip;

pub use write::write;

use crate::{Note, ReadError};
use figure::Figure;

/// A motion by its keys.
#[derive(Clone, Debug, PartialEq)]
pub struct Keys {
    figure: Figure,
    fps: f64,
    marks: Marks,
    keys: Vec<Key>,
    /// The file whose mirror image this is.
    mirrored: Option<String>,
}

/// What a motion is made of, in time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// In order, none over another.
    pub phases: Vec<Phase>,
    /// In the file's order.
    pub events: Vec<Event>,
}

/// A marked span.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// Unique: `enter`, `hold`, `exit` by custom.
    pub name: String,
    /// Seconds.
    pub start: f64,
    /// Seconds, after the start.
    pub end: f64,
    /// Whether its end goes over into its start.
    pub loops: bool,
}

/// A marked moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// What happens, such as `grasp`.
    pub name: String,
    /// Seconds.
    pub time: f64,
}

/// A key and what it sets: numbers by the figure's track.
#[derive(Clone, Debug, PartialEq)]
struct Key {
    time: f64,
    easing: Easing,
    partial: bool,
    pose: Option<usize>,
    sets: Vec<(usize, f64)>,
}

/// How a key is come to and left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Easing {
    Smooth,
    Through,
    Linear,
}

impl Easing {
    const ALL: [Self; 3] = [Self::Smooth, Self::Through, Self::Linear];

    fn name(self) -> &'static str {
        ["smooth", "through", "linear"][self as usize]
    }
}

/// What [`Keys::sample`] makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// In metres, +Y up, +Z ahead; from the first key to the last.
    pub clip: Clip,
    /// Places that a limb does not reach, loops that do not close.
    pub notes: Vec<Note>,
}

/// Reads a `.keys` file.
///
/// `beside` gives the bytes of a file that it names (a skeleton's, a mirrored clip's), or why there
/// are none; the names are plain, without a path. It is asked for at most two files.
///
/// # Errors
/// A file that is not such a text or not whole, with line and column; the error of a file beside
/// carries that file's name.
pub fn read(
    bytes: &[u8],
    beside: &mut dyn FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<Keys, ReadError> {
    read::clip(bytes, beside)
}

impl Keys {
    /// Frames a second of the clip that it becomes.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// Phases and events.
    pub fn marks(&self) -> &Marks {
        &self.marks
    }

    /// Seconds from the first key to the last.
    pub fn duration(&self) -> f64 {
        self.keys.last().map_or(0.0, |key| key.time)
    }

    /// The clip between the keys. Limbs that are placed hold their places in every frame.
    pub fn sample(&self) -> Sampled {
        sample::sample(self)
    }
}
