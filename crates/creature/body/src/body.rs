//! A checked creature and what follows from its description.

use crate::check::{BodyError, parse, problems};
use crate::description::{Description, Joint, Part, Tag};

/// A chain of parts tagged `leg` or `foot`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leg {
    /// Its parts from the body outwards, as indices.
    pub parts: Vec<usize>,
    /// The part that is meant to touch the ground: the one tagged `foot`, else the last.
    pub foot: usize,
    /// Its driven joints, as indices of [`Body::driven`].
    pub joints: Vec<usize>,
}

/// A creature that was checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    description: Description,
    torso: usize,
    /// Parent and joint of each part.
    above: Vec<Option<(usize, usize)>>,
    driven: Vec<usize>,
    legs: Vec<Leg>,
    pairs: Vec<[usize; 2]>,
}

impl Body {
    /// Reads a creature file.
    ///
    /// # Errors
    /// Text that is not such a file, with each place and what was expected there.
    pub fn parse(text: &str) -> Result<Self, BodyError> {
        Self::new(parse(text)?)
    }

    /// Checks a description.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn new(description: Description) -> Result<Self, BodyError> {
        let found = problems(&description);
        if !found.is_empty() {
            return Err(BodyError::Invalid(found));
        }
        let part = |name: &str| description.parts.iter().position(|part| part.name == name);
        let mut above = vec![None; description.parts.len()];
        for (index, joint) in description.joints.iter().enumerate() {
            let (parent, child) = (part(&joint.parent), part(&joint.child));
            above[child.expect("checked")] = Some((parent.expect("checked"), index));
        }
        let is_torso = |part: &Part| part.tags.contains(&Tag::Torso);
        let torso = description.parts.iter().position(is_torso).expect("checked");
        let carried = |joint: &&Joint| {
            let tags = &description.parts[part(&joint.child).expect("checked")].tags;
            [Tag::Hand, Tag::Head, Tag::Ignored].iter().any(|tag| tags.contains(tag))
        };
        let joints = description.joints.iter().enumerate();
        let driven: Vec<_> = joints.filter(|(_, joint)| !carried(joint)).map(|(i, _)| i).collect();
        let joint = |name: &String| description.joints.iter().position(|joint| joint.name == *name);
        let both = |pair: &[String; 2]| {
            let [a, b] = pair.each_ref().map(|name| {
                let joint = joint(name).expect("checked");
                driven.iter().position(|&driven| driven == joint)
            });
            Some([a?, b?])
        };
        let pairs = description.pairs.iter().filter_map(both).collect();
        let legs = legs(&description, &above, &driven);
        Ok(Self { description, torso, above, driven, legs, pairs })
    }

    /// The file's contents.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// As a file: readable JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(&self.description).expect("a description is JSON") + "\n"
    }

    /// Its parts.
    pub fn parts(&self) -> &[Part] {
        &self.description.parts
    }

    /// All joints, driven or held.
    pub fn joints(&self) -> &[Joint] {
        &self.description.joints
    }

    /// Index of the torso among the parts.
    pub fn torso(&self) -> usize {
        self.torso
    }

    /// Parent part and joint of a part; none for the torso.
    pub fn above(&self, part: usize) -> Option<(usize, usize)> {
        self.above[part]
    }

    /// Parent and child of a joint, as indices of parts.
    pub fn ends(&self, joint: usize) -> (usize, usize) {
        let ends = self.above.iter().enumerate();
        let found = ends.filter_map(|(child, above)| above.map(|(parent, j)| (j, parent, child)));
        let (_, parent, child) = found.into_iter().find(|(j, ..)| *j == joint).expect("a joint");
        (parent, child)
    }

    /// Joints that a controller drives, as indices: those whose child is not a hand, a head or
    /// ignored.
    pub fn driven(&self) -> &[usize] {
        &self.driven
    }

    /// Legs, in the order of their first parts.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Pairs as left and right, as indices of [`Body::driven`]; pairs of held joints are left out.
    pub fn pairs(&self) -> &[[usize; 2]] {
        &self.pairs
    }

    /// Kilograms of a part.
    pub fn part_mass(&self, part: usize) -> f32 {
        let part = &self.parts()[part];
        part.density * part.shape.area()
    }

    /// Kilograms.
    pub fn mass(&self) -> f32 {
        (0..self.parts().len()).map(|part| self.part_mass(part)).sum()
    }

    /// Least x, least y, greatest x, greatest y of the start pose as the file has it, metres.
    pub fn bounds(&self) -> [f32; 4] {
        let start = [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];
        self.parts().iter().fold(start, |[l, b, r, t], part| {
            let [pl, pb, pr, pt] = part.shape.bounds(part.position, part.angle);
            [l.min(pl), b.min(pb), r.max(pr), t.max(pt)]
        })
    }

    /// A body length, metres: the longer side of the box around the start pose.
    pub fn length(&self) -> f32 {
        let [l, b, r, t] = self.bounds();
        (r - l).max(t - b)
    }

    /// Height of the torso's centre of mass when the start pose stands on the ground, metres.
    pub fn standing_height(&self) -> f32 {
        let part = &self.parts()[self.torso];
        let ([cx, cy], (sin, cos)) = (part.shape.centre(), libm::sincosf(part.angle));
        part.position[1] + sin * cx + cos * cy - self.bounds()[1]
    }

    /// Fingerprint of everything that moves differently if it changes: all but the names of the
    /// creature and what is told about it. 64 bits of FNV-1a.
    pub fn hash(&self) -> u64 {
        let mut bare = self.description.clone();
        bare.name.clear();
        bare.about.clear();
        let bytes = serde_json::to_vec(&bare).expect("a description is JSON");
        bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
    }
}

fn legs(description: &Description, above: &[Option<(usize, usize)>], driven: &[usize]) -> Vec<Leg> {
    let parts = &description.parts;
    let is_leg =
        |part: usize| parts[part].tags.contains(&Tag::Leg) || parts[part].tags.contains(&Tag::Foot);
    let starts = (0..parts.len())
        .filter(|&part| is_leg(part) && !above[part].is_some_and(|(parent, _)| is_leg(parent)));
    let below = |part: usize| {
        (0..parts.len()).find(|&p| is_leg(p) && above[p].is_some_and(|(parent, _)| parent == part))
    };
    let leg = |start: usize| {
        // Where a leg forks, its first branch is followed.
        let chain: Vec<_> = std::iter::successors(Some(start), |&part| below(part)).collect();
        let tagged = chain.iter().find(|&&part| parts[part].tags.contains(&Tag::Foot));
        let foot = *tagged.unwrap_or(chain.last().expect("a start"));
        let joints = chain.iter().filter_map(|&part| {
            let (_, joint) = above[part]?;
            driven.iter().position(|&d| d == joint)
        });
        Leg { joints: joints.collect(), foot, parts: chain }
    };
    starts.map(leg).collect()
}
