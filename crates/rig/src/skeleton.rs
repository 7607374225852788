//! A tree of named joints.

use std::collections::HashSet;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::Pose;

/// One joint of a [`Skeleton`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Unique within its skeleton, not empty.
    pub name: String,
    /// Index of the parent, smaller than the joint's own; `None` for the root alone.
    pub parent: Option<usize>,
    /// Rest translation from the parent, in the parent's frame.
    pub offset: DVec3,
    /// Ends of bones that carry no joint (finger tips, toes; BVH's `End Site`), in this joint's
    /// frame.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tips: Vec<DVec3>,
}

/// Why a list of joints is not a skeleton.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum SkeletonError {
    #[error("a skeleton needs at least one joint")]
    Empty,
    #[error("joint {joint} ('{name}') has no name or its name occurs twice")]
    Name { joint: usize, name: String },
    #[error(
        "joint {joint} ('{name}'): its parent must come before it, and only joint 0 is without one"
    )]
    Parent { joint: usize, name: String },
    #[error("joint {joint} ('{name}') has an offset or a tip that is not finite")]
    Offset { joint: usize, name: String },
}

/// Joints in an order in which parents come before their children; joint 0 is the only root.
///
/// In the rest pose every joint's frame is parallel to its parent's (BVH's convention): a bone's
/// direction is its child's offset, not an axis of its frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Joint>", into = "Vec<Joint>")]
pub struct Skeleton {
    joints: Vec<Joint>,
}

impl Skeleton {
    /// Checks and takes a list of joints.
    ///
    /// # Errors
    /// An empty list, a name that is empty or not unique, a parent that does not come first, a
    /// second root, or a number that is not finite.
    pub fn new(joints: Vec<Joint>) -> Result<Self, SkeletonError> {
        if joints.is_empty() {
            return Err(SkeletonError::Empty);
        }
        let mut names = HashSet::with_capacity(joints.len());
        for (index, joint) in joints.iter().enumerate() {
            let name = || joint.name.clone();
            if joint.name.is_empty() || !names.insert(joint.name.as_str()) {
                return Err(SkeletonError::Name { joint: index, name: name() });
            }
            let parent_is_right = match joint.parent {
                Some(parent) => parent < index,
                None => index == 0,
            };
            if !parent_is_right {
                return Err(SkeletonError::Parent { joint: index, name: name() });
            }
            if !joint.offset.is_finite() || joint.tips.iter().any(|tip| !tip.is_finite()) {
                return Err(SkeletonError::Offset { joint: index, name: name() });
            }
        }
        Ok(Self { joints })
    }

    /// Number of joints, at least 1.
    #[allow(clippy::len_without_is_empty)] // It is never empty.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// The joints, parents first.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Index of the joint of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Indices of a joint's children, in order.
    pub fn children(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        (joint + 1..self.joints.len()).filter(move |&j| self.joints[j].parent == Some(joint))
    }

    /// The pose in which nothing is rotated: offsets only.
    pub fn rest_pose(&self) -> Pose {
        Pose::rest(self)
    }

    /// The same skeleton with every length multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        self.map_offsets(|offset| offset * factor)
    }

    pub(crate) fn map_offsets(&self, map: impl Fn(DVec3) -> DVec3) -> Self {
        let mut joints = self.joints.clone();
        for joint in &mut joints {
            joint.offset = map(joint.offset);
            joint.tips.iter_mut().for_each(|tip| *tip = map(*tip));
        }
        Self { joints }
    }
}

impl TryFrom<Vec<Joint>> for Skeleton {
    type Error = SkeletonError;
    fn try_from(joints: Vec<Joint>) -> Result<Self, SkeletonError> {
        Self::new(joints)
    }
}

impl From<Skeleton> for Vec<Joint> {
    fn from(skeleton: Skeleton) -> Self {
        skeleton.joints
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint(name: &str, parent: Option<usize>) -> Joint {
        Joint { name: name.into(), parent, offset: DVec3::Y, tips: vec![] }
    }

    #[test]
    fn refuses_what_is_not_a_tree() {
        let refused = |joints| Skeleton::new(joints).unwrap_err();
        assert_eq!(refused(vec![]), SkeletonError::Empty);
        let two_roots = vec![joint("a", None), joint("b", None)];
        assert!(matches!(refused(two_roots), SkeletonError::Parent { joint: 1, .. }));
        let child_first = vec![joint("a", Some(1)), joint("b", None)];
        assert!(matches!(refused(child_first), SkeletonError::Parent { joint: 0, .. }));
        let own_parent = vec![joint("a", None), joint("b", Some(1))];
        assert!(matches!(refused(own_parent), SkeletonError::Parent { joint: 1, .. }));
        let twice = vec![joint("a", None), joint("a", Some(0))];
        assert!(matches!(refused(twice), SkeletonError::Name { joint: 1, .. }));
        let mut nan = vec![joint("a", None)];
        nan[0].tips.push(DVec3::NAN);
        assert!(matches!(refused(nan), SkeletonError::Offset { joint: 0, .. }));
    }

    #[test]
    fn finds_names_and_children() {
        let joints =
            vec![joint("a", None), joint("b", Some(0)), joint("c", Some(1)), joint("d", Some(0))];
        let skeleton = Skeleton::new(joints).unwrap();
        assert_eq!(skeleton.find("c"), Some(2));
        assert_eq!(skeleton.find("x"), None);
        assert_eq!(skeleton.children(0).collect::<Vec<_>>(), [1, 3]);
    }
}
