//! The lines that say what moves: bones, their angles, limbs.

use std::collections::HashMap;

use ambulo_rig::glam::DVec3;
use ambulo_rig::{Joint, Skeleton};

use super::figure::{Figure, Limb, Turn, usual_turns};
use super::lines::Line;
use super::read::{LENGTH, RESERVED};
use crate::ReadError;

const MOST_JOINTS: usize = 1000;
const MOST_TURNS: usize = 6;
const MOST_LIMBS: usize = 16;

/// A figure in the making.
#[derive(Default)]
pub(super) struct Body {
    joints: Vec<Joint>,
    turns: Vec<Option<Vec<Turn>>>,
    limbs: Vec<Limb>,
    /// Index of every joint.
    pub by_name: HashMap<String, usize>,
}

impl Body {
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// The figure; names stay known.
    pub fn finish(&mut self) -> Figure {
        let joints = std::mem::take(&mut self.joints);
        let skeleton = Skeleton::new(joints).expect("checked bone by bone");
        let turns = self.turns.drain(..).map(|list| list.unwrap_or_else(usual_turns)).collect();
        Figure::new(skeleton, turns, std::mem::take(&mut self.limbs))
    }

    fn new_name(&mut self, line: &mut Line, expected: &str) -> Result<String, ReadError> {
        let name = line.name(expected, RESERVED)?;
        let limb = self.limbs.iter().any(|limb| limb.name == name);
        if limb || self.by_name.contains_key(&name) {
            return Err(line.wrong("another name"));
        }
        Ok(name)
    }

    pub fn bone(&mut self, line: &mut Line) -> Result<(), ReadError> {
        if self.joints.len() == MOST_JOINTS {
            return Err(line.unexpected(&format!("at most {MOST_JOINTS} bones")));
        }
        let name = self.new_name(line, "a bone's name")?;
        let parent = if self.joints.is_empty() {
            if !line.accept("-") {
                return Err(line.unexpected("- for the parent of the root"));
            }
            None
        } else {
            Some(self.joint(line, "the name of a parent that comes before")?)
        };
        let offset = DVec3::from_array(line.numbers("metres from the parent", LENGTH)?);
        self.by_name.insert(name.clone(), self.joints.len());
        self.joints.push(Joint { name, parent, offset, tips: vec![] });
        self.turns.push(None);
        Ok(())
    }

    fn joint(&mut self, line: &mut Line, expected: &str) -> Result<usize, ReadError> {
        let joint = self.by_name.get(line.word(expected)?);
        joint.copied().ok_or_else(|| line.wrong(expected))
    }

    pub fn tip(&mut self, line: &mut Line) -> Result<(), ReadError> {
        let joint = self.joint(line, "a bone's name")?;
        let tip = DVec3::from_array(line.numbers("metres from the joint", LENGTH)?);
        self.joints[joint].tips.push(tip);
        Ok(())
    }

    pub fn turns(&mut self, line: &mut Line) -> Result<(), ReadError> {
        let joint = self.joint(line, "a bone's name")?;
        if self.turns[joint].is_some() {
            return Err(line.wrong("one line with turns a joint"));
        }
        let mut list: Vec<Turn> = vec![];
        while line.peek().is_some() {
            if list.len() == MOST_TURNS {
                return Err(line.unexpected(&format!("at most {MOST_TURNS} turns")));
            }
            let name = line.name("a turn's name", RESERVED)?;
            if list.iter().any(|turn| turn.name == name) || self.by_name.contains_key(&name) {
                return Err(line.wrong("another name"));
            }
            let (sign, axis) = match line.word("x, y, z, -x, -y or -z")? {
                word if word.starts_with('-') => (-1.0, &word[1..]),
                word => (1.0, word),
            };
            let axis = ["x", "y", "z"].iter().position(|&known| known == axis);
            let axis = axis.ok_or_else(|| line.wrong("x, y, z, -x, -y or -z"))?;
            list.push(Turn { name, axis, sign });
        }
        self.turns[joint] = Some(list);
        Ok(())
    }

    pub fn limb(&mut self, line: &mut Line) -> Result<(), ReadError> {
        if self.limbs.len() == MOST_LIMBS {
            return Err(line.unexpected(&format!("at most {MOST_LIMBS} limbs")));
        }
        let name = self.new_name(line, "a limb's name")?;
        let mut joints = [0; 3];
        for at in 0..3 {
            joints[at] = self.joint(line, "three bones, each the parent of the next")?;
            let joint = &self.joints[joints[at]];
            if at > 0 && (joint.parent != Some(joints[at - 1]) || joint.offset.length() < 1e-3) {
                return Err(line.wrong("a bone of 1 mm or more whose parent is the one before"));
            }
        }
        let grip = match line.accept("grip") {
            true => DVec3::from_array(line.numbers("metres from the last joint", LENGTH)?),
            false => DVec3::ZERO,
        };
        self.limbs.push(Limb { name, joints, grip });
        Ok(())
    }
}
