//! The skeleton.

use std::collections::HashMap;

use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Joint, Skeleton};

use crate::euler::turned;
use crate::text::Cursor;
use crate::{MOST_JOINTS, ReadError};

/// One number of a bone in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dof {
    /// About X, Y or Z.
    Turn(usize),
    /// Along X, Y or Z.
    Move(usize),
    /// Of the bone's length.
    Stretch,
}

impl Dof {
    fn named(word: &[u8]) -> Option<Self> {
        Some(match word.to_ascii_lowercase().as_slice() {
            b"rx" => Self::Turn(0),
            b"ry" => Self::Turn(1),
            b"rz" => Self::Turn(2),
            b"tx" => Self::Move(0),
            b"ty" => Self::Move(1),
            b"tz" => Self::Move(2),
            b"l" => Self::Stretch,
            _ => return None,
        })
    }
}

/// A bone, or the root.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bone {
    pub name: String,
    /// From its start to its end at rest; zero for the root.
    pub along: DVec3,
    /// Its axes, C.
    pub axis: DQuat,
    /// Its numbers in a frame, in that order.
    pub dofs: Vec<Dof>,
    /// The rotations among them, the one that turns first last.
    pub turns: Vec<(usize, usize)>,
}

/// A skeleton with its bones' axes, made by [`Asf::read`].
#[derive(Clone, Debug, PartialEq)]
pub struct Asf {
    pub(super) skeleton: Skeleton,
    /// One a joint, in its order.
    pub(super) bones: Vec<Bone>,
    /// Where the root is before its motion is added.
    pub(super) position: DVec3,
    /// What lengths are multiplied with.
    pub(super) scale: f64,
    /// Whether angles are in radians.
    pub(super) radians: bool,
    /// Whether the file has a unit of length.
    pub(super) has_unit: bool,
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    scale: f64,
    has_unit: bool,
    radians: bool,
    position: DVec3,
    /// The root first.
    bones: Vec<Bone>,
    by_name: HashMap<String, usize>,
    children: Vec<Vec<usize>>,
    has_parent: Vec<bool>,
}

impl Asf {
    /// Reads a skeleton.
    ///
    /// # Errors
    /// A file that is not ASF or not whole, with line and column.
    pub fn read(bytes: &[u8]) -> Result<Self, ReadError> {
        let root = Bone {
            name: "root".into(),
            along: DVec3::ZERO,
            axis: DQuat::IDENTITY,
            dofs: vec![],
            turns: vec![],
        };
        let mut reader = Reader {
            cursor: Cursor::new(bytes)?,
            scale: 1.0,
            has_unit: false,
            radians: false,
            position: DVec3::ZERO,
            by_name: HashMap::from([(root.name.clone(), 0)]),
            bones: vec![root],
            children: vec![vec![]],
            has_parent: vec![true],
        };
        while reader.section()? {}
        reader.finish()
    }

    /// The skeleton in the clip's unit, depth first.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }
}

impl<'a> Reader<'a> {
    /// Whether a line of this section follows.
    fn in_section(&mut self) -> bool {
        self.cursor.skip_comments() && self.cursor.peek() != Some(b':')
    }

    fn section(&mut self) -> Result<bool, ReadError> {
        if !self.cursor.skip_comments() {
            return Ok(false);
        }
        if self.cursor.accept(":units") {
            self.units()?;
        } else if self.cursor.accept(":root") {
            self.root()?;
        } else if self.cursor.accept(":bonedata") {
            while self.in_section() {
                self.bone()?;
            }
        } else if self.cursor.accept(":hierarchy") {
            self.hierarchy()?;
        } else if self.cursor.peek() == Some(b':') {
            // Version, name, documentation, skin: nothing that moves.
            self.cursor.skip_line();
            while self.in_section() {
                self.cursor.skip_line();
            }
        } else {
            return Err(self.cursor.unexpected("a section, such as :bonedata"));
        }
        Ok(true)
    }

    fn units(&mut self) -> Result<(), ReadError> {
        while self.in_section() {
            if self.cursor.accept("length") {
                let start = self.cursor.at;
                let length = self.number()?;
                if !(1e-6..=1e6).contains(&length) {
                    self.cursor.at = start;
                    return Err(self.cursor.unexpected("a length between 0.000001 and 1000000"));
                }
                (self.scale, self.has_unit) = (1.0 / length, true);
            } else if self.cursor.accept("angle") {
                self.radians = self.cursor.accept("rad");
                if !self.radians {
                    self.cursor.expect("deg")?;
                }
            }
            self.cursor.skip_line();
        }
        Ok(())
    }

    fn root(&mut self) -> Result<(), ReadError> {
        let mut orientation = DVec3::ZERO;
        let mut axis = [0, 1, 2];
        while self.in_section() {
            if self.cursor.accept("order") {
                self.bones[0].dofs = self.dofs()?;
            } else if self.cursor.accept("axis") {
                axis = self.axis_order()?;
            } else if self.cursor.accept("position") {
                self.position = self.vector()?;
            } else if self.cursor.accept("orientation") {
                orientation = self.vector()?;
            } else {
                return Err(self.cursor.unexpected("order, axis, position or orientation"));
            }
            self.cursor.skip_line();
        }
        let axes = self.axes(orientation, axis);
        let root = &mut self.bones[0];
        // The root's numbers are named by `order`, but they turn it in the order of `axis`.
        let slot = |axis: usize| root.dofs.iter().position(|&dof| dof == Dof::Turn(axis));
        root.turns = axis.iter().rev().filter_map(|&a| slot(a).map(|slot| (slot, a))).collect();
        root.axis = axes;
        Ok(())
    }

    fn bone(&mut self) -> Result<(), ReadError> {
        self.cursor.expect("begin")?;
        let start = self.cursor.at;
        let (mut name, mut direction, mut length, mut axis) = (None, None, None, DQuat::IDENTITY);
        let mut dofs = vec![];
        loop {
            if !self.in_section() {
                return Err(self.cursor.unexpected("end"));
            }
            if self.cursor.accept("end") {
                break;
            } else if self.cursor.accept("name") {
                let word = self.word_of_line("a bone's name")?;
                name = Some(String::from_utf8_lossy(word).into_owned());
            } else if self.cursor.accept("direction") {
                direction = Some(self.vector()?);
            } else if self.cursor.accept("length") {
                length = Some(self.number()?);
            } else if self.cursor.accept("axis") {
                let angles = self.vector()?;
                let order = self.axis_order()?;
                axis = self.axes(angles, order);
            } else if self.cursor.accept("dof") {
                dofs = self.dofs()?;
            } else if !["id", "limits", "bodymass", "cofmass"].iter().any(|w| self.cursor.accept(w))
                && self.cursor.peek() != Some(b'(')
            {
                return Err(self
                    .cursor
                    .unexpected("a bone's name, direction, length, axis or dof"));
            }
            self.cursor.skip_line();
        }
        let (Some(name), Some(direction), Some(length)) = (name, direction, length) else {
            let missing = "name, direction and length of the bone";
            return Err(ReadError::at(self.cursor.bytes, start, missing, "not all of them"));
        };
        if self.bones.len() == MOST_JOINTS {
            return Err(self.cursor.error(&format!("at most {MOST_JOINTS} bones"), "more"));
        }
        if self.by_name.insert(name.clone(), self.bones.len()).is_some() {
            let found = format!("a second '{name}'");
            return Err(ReadError::at(self.cursor.bytes, start, "another name", found));
        }
        let turn = |(slot, dof): (usize, &Dof)| match *dof {
            Dof::Turn(axis) => Some((slot, axis)),
            _ => None,
        };
        let turns = dofs.iter().enumerate().rev().filter_map(turn).collect();
        self.bones.push(Bone { name, along: direction * length, axis, dofs, turns });
        self.children.push(vec![]);
        self.has_parent.push(false);
        Ok(())
    }

    fn hierarchy(&mut self) -> Result<(), ReadError> {
        while self.in_section() {
            if self.cursor.accept("begin") || self.cursor.accept("end") {
                continue;
            }
            let parent = self.bone_of_line()?;
            self.cursor.skip_blanks();
            while !self.cursor.at_line_end() {
                let start = self.cursor.at;
                let child = self.bone_of_line()?;
                if std::mem::replace(&mut self.has_parent[child], true) {
                    self.cursor.at = start;
                    return Err(self.cursor.unexpected("a bone that has no parent yet"));
                }
                self.children[parent].push(child);
                self.cursor.skip_blanks();
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<Asf, ReadError> {
        let (mut order, mut parents) = (vec![], vec![]);
        let mut waiting = vec![(0, None)];
        while let Some((bone, parent)) = waiting.pop() {
            waiting.extend(self.children[bone].iter().rev().map(|&c| (c, Some(order.len()))));
            order.push(bone);
            parents.push(parent);
        }
        if order.len() < self.bones.len() {
            let mut reached = vec![false; self.bones.len()];
            order.iter().for_each(|&bone| reached[bone] = true);
            let lost = reached.iter().position(|&reached| !reached).unwrap_or(0);
            let expected = format!("bone '{}' below the root in :hierarchy", self.bones[lost].name);
            return Err(self.cursor.error(&expected, "the end of the file"));
        }
        if self.bones[0].dofs.is_empty() {
            return Err(self.cursor.error(":root with an order", "the end of the file"));
        }
        let joint = |(&bone, &parent): (&usize, &Option<usize>)| {
            let leaf = self.children[bone].is_empty() && bone != 0;
            let offset = parent.map_or(self.position, |p: usize| self.bones[order[p]].along);
            Joint {
                name: self.bones[bone].name.clone(),
                parent,
                offset: offset * self.scale,
                tips: if leaf { vec![self.bones[bone].along * self.scale] } else { vec![] },
            }
        };
        let skeleton = Skeleton::new(order.iter().zip(&parents).map(joint).collect());
        let skeleton =
            skeleton.map_err(|error| self.cursor.error("a skeleton", &error.to_string()))?;
        Ok(Asf {
            skeleton,
            bones: order.iter().map(|&bone| self.bones[bone].clone()).collect(),
            position: self.position,
            scale: self.scale,
            radians: self.radians,
            has_unit: self.has_unit,
        })
    }

    /// C of three angles, given for X, Y and Z in the order in which they turn.
    fn axes(&self, angles: DVec3, order: [usize; 3]) -> DQuat {
        let angles = if self.radians { angles.map(f64::to_degrees) } else { angles };
        // `angles` follow the letters of the order, as CMU's XYZ has them.
        (0..3).rev().fold(DQuat::IDENTITY, |axes, n| turned(axes, order[n], angles[n]))
    }

    fn number(&mut self) -> Result<f64, ReadError> {
        self.cursor.skip_blanks();
        if self.cursor.at_line_end() {
            return Err(self.cursor.error("a number", "the end of the line"));
        }
        self.cursor.number_here("a finite number")
    }

    fn vector(&mut self) -> Result<DVec3, ReadError> {
        Ok(DVec3::new(self.number()?, self.number()?, self.number()?))
    }

    fn word_of_line(&mut self, expected: &str) -> Result<&'a [u8], ReadError> {
        self.cursor.skip_blanks();
        if self.cursor.at_line_end() {
            return Err(self.cursor.error(expected, "the end of the line"));
        }
        Ok(self.cursor.word())
    }

    fn bone_of_line(&mut self) -> Result<usize, ReadError> {
        let known = str::from_utf8(self.cursor.peek_word()).ok().and_then(|w| self.by_name.get(w));
        match known.copied() {
            Some(bone) => {
                self.cursor.word();
                Ok(bone)
            }
            None => Err(self.cursor.unexpected("a bone of :bonedata or root")),
        }
    }

    /// Three letters, in the order in which they turn.
    fn axis_order(&mut self) -> Result<[usize; 3], ReadError> {
        self.cursor.skip_blanks();
        let start = self.cursor.at;
        let letters = self.word_of_line("XYZ or another order")?.to_ascii_uppercase();
        let axis = |letter: u8| b"XYZ".iter().position(|&l| l == letter);
        let order: Option<Vec<usize>> = letters.iter().map(|&letter| axis(letter)).collect();
        match order.as_deref() {
            Some(&[i, j, k]) if i != j && j != k && k != i => Ok([i, j, k]),
            _ => {
                self.cursor.at = start;
                Err(self.cursor.unexpected("XYZ or another order"))
            }
        }
    }

    /// The rest of a line of degrees of freedom.
    fn dofs(&mut self) -> Result<Vec<Dof>, ReadError> {
        let mut dofs = vec![];
        self.cursor.skip_blanks();
        while !self.cursor.at_line_end() {
            let dof = Dof::named(self.cursor.peek_word()).filter(|dof| !dofs.contains(dof));
            let Some(dof) = dof else {
                return Err(self.cursor.unexpected("rx, ry, rz, tx, ty, tz or l, each once"));
            };
            self.cursor.word();
            dofs.push(dof);
            self.cursor.skip_blanks();
        }
        Ok(dofs)
    }
}
