//! What moves: the skeleton, its joints' angles by name, its limbs and its poses.
//!
//! Everything that a key can set is a track, a number over time; the figure says which is which.

use ambulo_rig::glam::DVec3;
use ambulo_rig::{Joint, Skeleton};

/// A named angle of a joint.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Turn {
    pub name: String,
    /// 0 to 2.
    pub axis: usize,
    /// 1, or -1 where it turns the other way round.
    pub sign: f64,
}

/// Three joints in a chain, and the point of the last one that can be placed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Limb {
    pub name: String,
    pub joints: [usize; 3],
    pub grip: DVec3,
}

/// The tracks of a limb, after its first.
pub(super) const WEIGHT: usize = 0;
pub(super) const AT: usize = 1;
pub(super) const FACING: usize = 4;
pub(super) const SWIVEL: usize = 7;
/// How many those are.
pub(super) const LIMB: usize = 8;

/// A pose by name: numbers by track.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pose {
    pub name: String,
    pub sets: Vec<(usize, f64)>,
}

/// A skeleton and how it is spoken of.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Figure {
    /// The file that it comes from, and how many of the poses do, too.
    pub file: Option<(String, usize)>,
    pub skeleton: Skeleton,
    /// A list a joint.
    pub turns: Vec<Vec<Turn>>,
    pub limbs: Vec<Limb>,
    pub poses: Vec<Pose>,
    /// The first track of every joint, then that of the root's place.
    first: Vec<usize>,
}

/// What a track sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Track {
    /// A joint's angle.
    Turn { joint: usize, turn: usize },
    /// A coordinate of the root's place.
    Root(usize),
    /// A limb's part: [`WEIGHT`] and on.
    Limb { limb: usize, part: usize },
}

/// The angles of a joint of which nothing is said.
pub(super) fn usual_turns() -> Vec<Turn> {
    [("y", 1), ("x", 0), ("z", 2)]
        .map(|(name, axis)| Turn { name: name.into(), axis, sign: 1.0 })
        .into()
}

impl Figure {
    pub fn new(skeleton: Skeleton, turns: Vec<Vec<Turn>>, limbs: Vec<Limb>) -> Self {
        let mut first = vec![0];
        for list in &turns {
            first.push(first[first.len() - 1] + list.len());
        }
        Self { file: None, skeleton, turns, limbs, poses: vec![], first }
    }

    pub fn joints(&self) -> &[Joint] {
        self.skeleton.joints()
    }

    pub fn find_limb(&self, name: &str) -> Option<usize> {
        self.limbs.iter().position(|limb| limb.name == name)
    }

    pub fn find_pose(&self, name: &str) -> Option<usize> {
        self.poses.iter().position(|pose| pose.name == name)
    }

    /// How many tracks there are.
    pub fn tracks(&self) -> usize {
        self.limb_track(self.limbs.len())
    }

    pub fn turn_track(&self, joint: usize) -> usize {
        self.first[joint]
    }

    pub fn root_track(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    pub fn limb_track(&self, limb: usize) -> usize {
        self.root_track() + 3 + limb * LIMB
    }

    pub fn track(&self, index: usize) -> Track {
        let root = self.root_track();
        if index < root {
            // The last joint that starts here or before; joints without angles take no track.
            let joint = self.first.partition_point(|&first| first <= index) - 1;
            Track::Turn { joint, turn: index - self.first[joint] }
        } else if index < root + 3 {
            Track::Root(index - root)
        } else {
            Track::Limb { limb: (index - root - 3) / LIMB, part: (index - root - 3) % LIMB }
        }
    }

    /// The track's number at rest; `None` for what only counts once it is set.
    pub fn at_rest(&self, index: usize) -> Option<f64> {
        match self.track(index) {
            Track::Turn { .. } => Some(0.0),
            Track::Root(axis) => Some(self.joints()[0].offset[axis]),
            Track::Limb { part, .. } => [WEIGHT, SWIVEL].contains(&part).then_some(0.0),
        }
    }
}
