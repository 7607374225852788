//! A bundle that a controller can use: its layout and skeleton are checked once.

use std::cmp::Ordering;
use std::sync::Arc;

use ambulo_features::{Layout, LayoutError, Output};
use ambulo_net::{Bundle, Network};
use ambulo_rig::glam::Vec3;
use ambulo_rig::{Pose, Skeleton, Transform};
use serde::{Deserialize, Serialize};

use crate::Tuning;

/// Metres; more is a skeleton in another unit.
const LONGEST_BONE: f64 = 10.0;

/// Why a bundle cannot control a character.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum ControlError {
    #[error("the bundle has no '{0}' part")]
    Missing(&'static str),
    #[error("the bundle's '{part}' part is broken: {reason}")]
    Broken { part: &'static str, reason: String },
    #[error("the bundle was made for another layout: {0}")]
    Layout(#[from] LayoutError),
    #[error("the bundle runs at {found} steps a second, its layout at {expected}")]
    Rate { expected: f32, found: f64 },
    #[error("the tuning has a number that is not finite or has the wrong sign")]
    Tuning,
    #[error("the start or the ground under it is not finite")]
    Start,
}

/// Which joints stand on the ground, and how high they are then.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feet {
    /// Left heel, left toe, right heel, right toe, as the contacts of the output; joint indices.
    pub joints: [usize; 4],
    /// Height in metres of those joints above the ground while in contact.
    pub heights: [f32; 4],
}

impl Feet {
    /// The left and the right ankle: the heel's joints.
    pub fn ankles(&self) -> [usize; 2] {
        [self.joints[0], self.joints[2]]
    }
}

/// A checked bundle; cheap to clone, shared by many characters.
#[derive(Clone, Debug)]
pub struct Model {
    bundle: Arc<Bundle>,
    layout: Layout,
    skeleton: Arc<Skeleton>,
    feet: Feet,
    in_legs: Arc<[bool]>,
    tuning: Tuning,
}

impl Model {
    /// Checks that this version's layout is the one that the bundle was made for, and that its
    /// skeleton and feet fit it.
    ///
    /// # Errors
    /// A missing or broken part, or a layout that differs: the first block that does is named.
    pub fn new(bundle: Arc<Bundle>) -> Result<Self, ControlError> {
        let header = bundle.header();
        fn read<T: for<'a> Deserialize<'a>>(
            bundle: &Bundle,
            part: &'static str,
        ) -> Result<Option<T>, ControlError> {
            let value = bundle.header().parts.get(part);
            let broken =
                |e: serde_json::Error| ControlError::Broken { part, reason: e.to_string() };
            value.map(T::deserialize).transpose().map_err(broken)
        }
        let missing = ControlError::Missing;
        let skeleton: Skeleton = read(&bundle, "skeleton")?.ok_or(missing("skeleton"))?;
        let feet: Feet = read(&bundle, "feet")?.ok_or(missing("feet"))?;
        let tuning: Tuning = read(&bundle, "tuning")?.unwrap_or_default();
        let table = &header.layout;
        let layout = Layout::named(&table.name, skeleton.len())?;
        layout.check(&table.inputs, &table.outputs, &table.hash)?;
        if header.fps != f64::from(layout.fps()) {
            return Err(ControlError::Rate { expected: layout.fps(), found: header.fps });
        }
        let broken = |part, reason: &str| Err(ControlError::Broken { part, reason: reason.into() });
        let joints = skeleton.joints();
        if joints.iter().any(|joint| joint.offset.length() > LONGEST_BONE) {
            return broken("skeleton", "a bone is longer than 10 m");
        }
        let [a, b, c, d] = feet.joints;
        if feet.joints.iter().any(|&joint| joint >= joints.len()) || a == c || b == d {
            return broken("feet", "a joint that the skeleton does not have, or one foot for both");
        }
        if feet.heights.iter().any(|height| height.abs().partial_cmp(&1.0) != Some(Ordering::Less))
        {
            return broken("feet", "a height of a metre or more");
        }
        if !tuning.is_valid() {
            return broken("tuning", "a number that is out of range");
        }
        let mut in_legs = vec![false; joints.len()];
        for foot in feet.joints {
            let mut joint = foot;
            // All the way up but for the root, which carries the body too.
            while let Some(parent) = joints[joint].parent {
                in_legs[joint] = true;
                joint = parent;
            }
        }
        let in_legs = in_legs.into();
        Ok(Self {
            layout,
            skeleton: Arc::new(skeleton),
            feet,
            in_legs,
            tuning,
            bundle: bundle.clone(),
        })
    }

    /// The bundle as it was loaded.
    pub fn bundle(&self) -> &Bundle {
        &self.bundle
    }

    /// Its network.
    pub fn network(&self) -> &Network {
        self.bundle.network()
    }

    /// Meaning of the network's vectors.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// In metres and Ambulo's axes.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Each joint's offset in metres as the network itself draws it: the mean over a cycle of its
    /// poses at its mean input, by the skeleton's parents.
    ///
    /// Not from its mean output: positions and rotations averaged over a whole data set give bones
    /// that are several percent too short.
    pub fn drawn_offsets(&self) -> Vec<Vec3> {
        const POSES: usize = 64;
        let (network, joints) = (self.network(), self.skeleton.len());
        let (mut y, mut scratch) = (vec![0.0; network.outputs()], network.scratch());
        let mut output = Output::zero(joints);
        let mut offsets = vec![Vec3::ZERO; joints];
        for pose in 0..POSES {
            let phase = std::f32::consts::TAU * pose as f32 / POSES as f32;
            network.predict(&network.normalisation().input_mean, phase, &mut y, &mut scratch);
            self.layout.decode_output(&y, &mut output);
            let drawn = output.joint_position.iter().zip(&output.joint_rotation);
            let global: Vec<_> = drawn.map(|(&p, &r)| Transform::new(p, r)).collect();
            let local = Pose::from_global(&self.skeleton, &global).local;
            for (offset, transform) in offsets.iter_mut().zip(local) {
                *offset += transform.translation / POSES as f32;
            }
        }
        offsets
    }

    /// What the bundle says that it moves best with; the published one where it says nothing.
    pub fn tuning(&self) -> Tuning {
        self.tuning
    }

    /// Whether a joint carries a foot or is one.
    pub(crate) fn in_legs(&self, joint: usize) -> bool {
        self.in_legs[joint]
    }

    /// Heels and toes.
    pub fn feet(&self) -> &Feet {
        &self.feet
    }
}
