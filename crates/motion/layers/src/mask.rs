//! How much of a layer each joint takes.

use ambulo_rig::Skeleton;
use serde::{Deserialize, Serialize};

/// A joint from which a [`Mask`] spreads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Name of the joint that has the whole weight.
    pub joint: String,
    /// So many joints above it, on the way to the root, have some of it: the weight falls evenly
    /// and is 0 on the next one. What else hangs on those joints has none.
    #[serde(default)]
    pub up: usize,
    /// So many joints below it have some of it; `None`: all below have the whole weight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub down: Option<usize>,
    /// The whole weight, 0 to 1.
    #[serde(default = "one")]
    pub weight: f32,
}

fn one() -> f32 {
    1.0
}

/// Why parts or weights are not a mask.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum MaskError {
    #[error("the skeleton has no joint '{0}'")]
    Joint(String),
    #[error("weight {weight} of joint '{joint}' is not between 0 and 1")]
    Weight { joint: String, weight: f32 },
    #[error("{got} weights for {expected} joints")]
    Count { expected: usize, got: usize },
}

/// A weight a joint, 0 to 1, in the skeleton's order.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    weights: Vec<f32>,
}

impl Mask {
    /// Spreads parts over a skeleton; where they meet, the greatest weight counts. No part: no
    /// weight anywhere.
    ///
    /// # Errors
    /// A joint that the skeleton lacks, a weight that is not between 0 and 1.
    pub fn new(skeleton: &Skeleton, parts: &[Part]) -> Result<Self, MaskError> {
        let mut weights = vec![0.0; skeleton.len()];
        for part in parts {
            let joint = skeleton.find(&part.joint).ok_or(MaskError::Joint(part.joint.clone()))?;
            if !(0.0..=1.0).contains(&part.weight) {
                let (joint, weight) = (part.joint.clone(), part.weight);
                return Err(MaskError::Weight { joint, weight });
            }
            spread(skeleton, joint, part, &mut weights);
        }
        Ok(Self { weights })
    }

    /// Weights as they are, one a joint.
    ///
    /// # Errors
    /// More or fewer than joints, or one that is not between 0 and 1.
    pub fn from_weights(skeleton: &Skeleton, weights: Vec<f32>) -> Result<Self, MaskError> {
        if weights.len() != skeleton.len() {
            return Err(MaskError::Count { expected: skeleton.len(), got: weights.len() });
        }
        match weights.iter().position(|weight| !(0.0..=1.0).contains(weight)) {
            Some(at) => {
                let joint = skeleton.joints()[at].name.clone();
                Err(MaskError::Weight { joint, weight: weights[at] })
            }
            None => Ok(Self { weights }),
        }
    }

    /// All that this one leaves.
    #[must_use]
    pub fn inverted(&self) -> Self {
        Self { weights: self.weights.iter().map(|weight| 1.0 - weight).collect() }
    }

    /// One a joint, 0 to 1.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }
}

/// What of a whole of 1 is left so many joints away, when `fade` joints have some of it.
fn left(distance: usize, fade: usize) -> f32 {
    (1.0 - distance as f32 / (fade as f32 + 1.0)).max(0.0)
}

fn spread(skeleton: &Skeleton, joint: usize, part: &Part, weights: &mut [f32]) {
    let mut raise = |joint: usize, share: f32| {
        weights[joint] = f32::max(weights[joint], part.weight * share);
    };
    let parent = |joint: &usize| skeleton.joints()[*joint].parent;
    for (distance, above) in std::iter::successors(Some(joint), parent).enumerate() {
        raise(above, left(distance, part.up));
    }
    for below in joint + 1..skeleton.len() {
        let mut chain = std::iter::successors(Some(below), parent);
        if let Some(distance) = chain.position(|above| above == joint) {
            raise(below, part.down.map_or(1.0, |fade| left(distance, fade)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ambulo_rig::Joint;
    use ambulo_rig::glam::DVec3;
    use proptest::prelude::*;

    /// A spine of four with an arm of three and a head on its last, a leg on its first.
    fn skeleton() -> Skeleton {
        let names = ["hips", "spine", "chest", "neck", "arm", "elbow", "hand", "leg"];
        let parents = [None, Some(0), Some(1), Some(2), Some(2), Some(4), Some(5), Some(0)];
        let joints = names.iter().zip(parents).map(|(name, parent)| Joint {
            name: name.to_string(),
            parent,
            offset: DVec3::Y,
            tips: vec![],
        });
        Skeleton::new(joints.collect()).unwrap()
    }

    fn part(joint: &str, up: usize, down: Option<usize>) -> Part {
        Part { joint: joint.into(), up, down, weight: 1.0 }
    }

    fn weights(parts: &[Part]) -> Vec<f32> {
        Mask::new(&skeleton(), parts).unwrap().weights().to_vec()
    }

    #[test]
    fn fades_towards_the_root() {
        // Hips and spine have a share; the neck and the leg, on other branches, have none.
        let third = 1.0 - 2.0_f32 / 3.0;
        let expected = [0.0, third, 1.0 - 1.0_f32 / 3.0, 0.0, 1.0, 1.0, 1.0, 0.0];
        assert_eq!(weights(&[part("arm", 2, None)]), expected);
        assert_eq!(weights(&[part("arm", 0, None)])[..4], [0.0; 4]);
    }

    #[test]
    fn fades_outward() {
        assert_eq!(weights(&[part("hips", 0, Some(1))]), [1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5]);
        assert_eq!(weights(&[part("hips", 0, None)]), [1.0; 8]);
    }

    #[test]
    fn parts_add_up_to_the_greater() {
        let half = Part { weight: 0.5, ..part("chest", 0, None) };
        let expected = [0.0, 0.0, 0.5, 0.5, 0.5, 1.0, 1.0, 0.0];
        assert_eq!(weights(&[half, part("elbow", 0, None)]), expected);
        assert_eq!(weights(&[]), [0.0; 8]);
    }

    #[test]
    fn what_is_no_mask_is_refused() {
        let refused = |parts: &[Part]| Mask::new(&skeleton(), parts).unwrap_err();
        assert_eq!(refused(&[part("tail", 0, None)]), MaskError::Joint("tail".into()));
        for weight in [-0.1, 1.1, f32::NAN] {
            let bad = refused(&[Part { weight, ..part("arm", 0, None) }]);
            assert!(matches!(bad, MaskError::Weight { joint, .. } if joint == "arm"));
        }
        let skeleton = skeleton();
        let own = |weights| Mask::from_weights(&skeleton, weights);
        assert_eq!(own(vec![0.0; 7]), Err(MaskError::Count { expected: 8, got: 7 }));
        assert!(own(vec![f32::NAN; 8]).is_err());
        assert_eq!(own(vec![0.25; 8]).unwrap().inverted().weights(), [0.75; 8]);
    }

    proptest! {
        #[test]
        fn no_weight_rises_with_the_distance(joint in 0..8_usize, up in 0..9_usize, down in 0..9_usize) {
            let skeleton = skeleton();
            let name = skeleton.joints()[joint].name.clone();
            let weights = weights(&[part(&name, up, Some(down))]);
            prop_assert_eq!(weights[joint], 1.0);
            for (index, other) in skeleton.joints().iter().enumerate() {
                let Some(parent) = other.parent else { continue };
                let above = std::iter::successors(Some(joint), |j| skeleton.joints()[*j].parent);
                let (near, far) =
                    if above.clone().any(|j| j == index) { (index, parent) } else { (parent, index) };
                prop_assert!(weights[near] >= weights[far], "{} {}", near, far);
            }
        }
    }
}
