//! A part of a skeleton as a skeleton of its own.

use glam::{DQuat, DVec3};

use crate::{Clip, Joint, Skeleton};

impl Clip {
    /// The motion of one joint and those below it: what the joints above did becomes the new
    /// root's own translation and rotation. Joints for which `keep` is false go, with all below.
    ///
    /// # Panics
    /// When `root` is no joint of the skeleton.
    pub fn pruned(&self, root: usize, keep: impl Fn(&Joint) -> bool) -> Self {
        let joints = self.skeleton().joints();
        assert!(root < joints.len(), "a joint of the skeleton");
        let mut place = vec![None; joints.len()];
        let mut kept = vec![];
        for (index, joint) in joints.iter().enumerate().skip(root) {
            let hangs = joint.parent.is_some_and(|parent| place[parent].is_some());
            if index == root || (hangs && keep(joint)) {
                place[index] = Some(kept.len());
                kept.push(index);
            }
        }
        let list = kept.iter().map(|&index| {
            let joint = &joints[index];
            let parent = if index == root { None } else { joint.parent.and_then(|p| place[p]) };
            Joint { parent, ..joint.clone() }
        });
        let skeleton = Skeleton::new(list.collect()).expect("a subtree is a tree");
        let moving: Vec<usize> = kept
            .iter()
            .enumerate()
            .filter(|(new, old)| *new == 0 || self.moving().contains(old))
            .map(|(new, _)| new)
            .collect();
        let mut rotations = Vec::with_capacity(self.frames() * kept.len());
        let mut translations = Vec::with_capacity(self.frames() * moving.len());
        for frame in 0..self.frames() {
            let (local, moved) = (self.rotations(frame), self.translations(frame));
            let (place, turn) = self.world(frame, root);
            rotations.push(turn);
            rotations.extend(kept[1..].iter().map(|&index| local[index]));
            translations.push(place);
            translations.extend(moving[1..].iter().map(|&new| {
                let at = self.moving().binary_search(&kept[new]).expect("a moving joint");
                moved[at]
            }));
        }
        let pruned = Self::new(skeleton, self.frame_time(), moving, translations, rotations);
        pruned.expect("a part of a clip has its counts and its finite numbers")
    }

    /// Where a joint is in the world, and how it is turned.
    fn world(&self, frame: usize, joint: usize) -> (DVec3, DQuat) {
        let (joints, local) = (self.skeleton().joints(), self.rotations(frame));
        let own = |joint: usize| match self.moving().binary_search(&joint) {
            Ok(at) => self.translations(frame)[at],
            Err(_) => joints[joint].offset,
        };
        let (mut place, mut turn, mut at) = (own(joint), local[joint], joints[joint].parent);
        while let Some(parent) = at {
            place = own(parent) + local[parent] * place;
            turn = local[parent] * turn;
            at = joints[parent].parent;
        }
        (place, turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_moves_as_it_did_in_the_whole() {
        let joint = |name: &str, parent, offset: [f64; 3]| Joint {
            name: name.into(),
            parent,
            offset: DVec3::from_array(offset),
            tips: vec![],
        };
        let skeleton = Skeleton::new(vec![
            joint("root", None, [0.0, 0.0, 0.0]),
            joint("hips", Some(0), [0.0, 1.0, 0.0]),
            joint("prop", Some(0), [1.0, 0.0, 0.0]),
            joint("leg", Some(1), [0.1, -0.4, 0.0]),
            joint("twist", Some(3), [0.0, -0.1, 0.0]),
            joint("foot", Some(3), [0.0, -0.4, 0.1]),
        ])
        .unwrap();
        let turn = |i: usize| DQuat::from_euler(glam::EulerRot::XYZ, i as f64, 0.3, 0.7 * i as f64);
        let moved = vec![DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
        let rotations = (0..12).map(turn).collect();
        let clip = Clip::new(skeleton, 0.1, vec![0, 3], moved, rotations).unwrap();
        let part = clip.pruned(1, |joint| joint.name != "twist");
        let names: Vec<_> = part.skeleton().joints().iter().map(|j| j.name.as_str()).collect();
        assert_eq!(names, ["hips", "leg", "foot"]);
        let (mut whole, mut places) = (vec![], vec![]);
        for frame in 0..2 {
            clip.positions(frame, &mut whole);
            part.positions(frame, &mut places);
            for (place, index) in places.iter().zip([1, 3, 5]) {
                assert!(place.abs_diff_eq(whole[index], 1e-12), "{place} {}", whole[index]);
            }
        }
    }
}
