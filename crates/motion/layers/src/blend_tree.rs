//! Blend trees as data: read with serde, checked once, shared by many characters. What runs one is
//! [`TreeState`](crate::TreeState).

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use ambulo_rig::{Pose, Skeleton};
use serde::{Deserialize, Serialize};

use crate::blend_space::{BlendSpace1, BlendSpace2, SpaceError};
use crate::mask::{Mask, MaskError, Part};
use crate::motion::Motion;
use crate::tree_builder::build;

/// Nodes inside nodes; more is a mistake.
pub(crate) const DEEPEST: usize = 64;

/// Greatest speed of a clip and greatest weight of an additive; more is a mistake.
pub(crate) const MOST: f32 = 10.0;

/// One node of a tree with all below it.
///
/// In JSON: `{"clip": {"name": "walk"}}`,
/// `{"blend_1d": {"by": "speed", "samples": [{"at": 0, "node": …}, {"at": 1.4, "node": …}]}}`.
///
/// All clips below a blend space run at one normalised time, that of the topmost one: a step of
/// walking is blended with the same step of running. Their cycle lasts as long as the weighted mean
/// of theirs. Every other clip has its own time. What has no weight stands still.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Node {
    /// A clip, its root over the origin.
    Clip {
        /// Of the clips that are given beside the tree.
        name: String,
        /// From the end on at the start again, which it must below a blend space; else held.
        #[serde(default = "yes")]
        looped: bool,
        /// Factor on its own speed, over 0 to 10.
        #[serde(default = "one")]
        speed: f32,
    },
    /// Blends neighbours along a line.
    #[serde(rename = "blend_1d")]
    Blend1 {
        /// Parameter that says where on the line.
        by: String,
        /// In ascending order.
        samples: Vec<Sample<f32>>,
    },
    /// Blends by gradient bands in a plane.
    #[serde(rename = "blend_2d")]
    Blend2 {
        /// Parameters that say where in the plane.
        by: [String; 2],
        /// No two at the same place.
        samples: Vec<Sample<[f32; 2]>>,
    },
    /// Adds to one node what another one differs from a pose.
    Additive {
        /// What is added to.
        base: Box<Node>,
        /// What is added.
        add: Box<Node>,
        /// Clip whose first frame is the pose that `add` is compared with.
        reference: String,
        /// Share that is added, −10 to 10; a parameter is held there.
        #[serde(default)]
        weight: Amount,
        /// On which joints; left out: on all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        mask: Option<Vec<Part>>,
    },
    /// Shows another node instead, on some joints or to some degree.
    Overlay {
        /// What is below; the root goes over the ground as this does.
        base: Box<Node>,
        /// What is above.
        over: Box<Node>,
        /// How much of it, 0 to 1; a parameter is held there.
        #[serde(default)]
        weight: Amount,
        /// On which joints; left out: on all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        mask: Option<Vec<Part>>,
    },
    /// Shows one of several, without a transition: that is the inertialiser's. A clip that is newly
    /// shown is at its start, unless its time is that of a blend space.
    Select {
        /// Parameter that is rounded to the number of a child, held to those that there are.
        by: String,
        /// Numbered from 0.
        children: Vec<Node>,
    },
}

/// A node at its place in a blend space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample<At> {
    /// Where it has all the weight.
    pub at: At,
    /// What is there.
    pub node: Node,
}

/// A number, or the name of the parameter that has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Amount {
    /// Always the same.
    Fixed(f32),
    /// As the step is told.
    Parameter(String),
}

impl Default for Amount {
    fn default() -> Self {
        Self::Fixed(1.0)
    }
}

fn yes() -> bool {
    true
}

fn one() -> f32 {
    1.0
}

/// What is wrong with a node.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum TreeProblem {
    #[error("there is no clip '{0}'")]
    NoClip(String),
    #[error("clip '{clip}' has {got} joints, the skeleton {expected}")]
    Joints { clip: String, expected: usize, got: usize },
    #[error("speed {0} is not over 0 and up to 10")]
    Speed(f32),
    #[error("a clip below a blend space must be looped")]
    Once,
    #[error("weight {0} is out of range")]
    Weight(f32),
    #[error("a parameter needs a name")]
    NoName,
    #[error("there is nothing to select")]
    NoChild,
    #[error("more than 64 nodes inside each other")]
    TooDeep,
    #[error("{0}")]
    Mask(#[from] MaskError),
    #[error("{0}")]
    Space(#[from] SpaceError),
}

/// A node that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{path}: {problem}")]
pub struct TreeError {
    /// From the root, as in the data: `overlay.base.blend_1d.samples[1].node.clip`.
    pub path: String,
    /// What is wrong with it.
    pub problem: TreeProblem,
}

/// A [`Node`] ready to run.
#[derive(Clone, Debug)]
pub struct BlendTree {
    pub(crate) rest: Pose,
    pub(crate) parameters: Vec<String>,
    /// Children before their parents; the root is the last.
    pub(crate) jobs: Vec<Job>,
    /// The node whose cycle each clock goes by.
    pub(crate) clocks: Vec<usize>,
    /// How many weights all blend spaces have.
    pub(crate) weights: usize,
}

/// A node by the indices of its children, clock and parameters.
#[derive(Clone, Debug)]
pub(crate) enum Job {
    Clip {
        motion: Arc<Motion>,
        looped: bool,
        speed: f32,
        clock: usize,
    },
    /// `weights` is where those of the children lie among all; the clock may be that of one above.
    Blend {
        space: Space,
        children: Vec<usize>,
        weights: Range<usize>,
        clock: usize,
    },
    Additive {
        base: usize,
        add: usize,
        reference: Pose,
        weight: Number,
        mask: Option<Mask>,
    },
    Overlay {
        base: usize,
        over: usize,
        weight: Number,
        mask: Option<Mask>,
    },
    /// Each child with the clocks that are its own.
    Select {
        by: usize,
        children: Vec<(usize, Range<usize>)>,
    },
}

#[derive(Clone, Debug)]
pub(crate) enum Space {
    Line(BlendSpace1, usize),
    Plane(BlendSpace2, [usize; 2]),
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Number {
    Fixed(f32),
    Parameter(usize),
}

impl Number {
    pub(crate) fn value(self, parameters: &[f32]) -> f32 {
        match self {
            Self::Fixed(number) => number,
            Self::Parameter(index) => parameters[index],
        }
    }
}

impl BlendTree {
    /// Checks a tree and looks up its clips and joints.
    ///
    /// # Errors
    /// The first node that cannot be used, by its path.
    pub fn new(
        root: &Node,
        clips: &BTreeMap<String, Arc<Motion>>,
        skeleton: &Skeleton,
    ) -> Result<Self, TreeError> {
        build(root, clips, skeleton)
    }

    /// Names of the parameters, in the order in which a step takes them: that of the tree.
    pub fn parameters(&self) -> &[String] {
        &self.parameters
    }

    /// Place of a parameter among those that a step takes.
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|parameter| parameter == name)
    }

    /// Joints of the poses.
    pub fn joints(&self) -> usize {
        self.rest.local.len()
    }
}

#[cfg(test)]
mod tests;
