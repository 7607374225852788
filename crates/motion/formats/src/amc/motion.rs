//! The motion.

use std::collections::HashMap;

use ambulo_rig::Clip;
use ambulo_rig::glam::{DQuat, DVec3};

use super::Amc;
use super::asf::{Asf, Dof};
use crate::error::Notes;
use crate::euler::turned;
use crate::text::Cursor;
use crate::{ReadError, ReadOptions, most_frames};

struct Reader<'a, 'b> {
    cursor: Cursor<'a>,
    skeleton: &'b Asf,
    by_name: HashMap<&'b str, usize>,
    /// Where each bone's numbers start among those of a frame.
    first: Vec<usize>,
    numbers: Vec<f64>,
    /// The last frame in which each bone was given, from 1.
    seen: Vec<usize>,
    /// Bones in the order of the frame before.
    usual: Vec<usize>,
    radians: bool,
    rate: Option<f64>,
    repair: bool,
    notes: Notes,
}

pub(super) fn read(skeleton: &Asf, bytes: &[u8], options: &ReadOptions) -> Result<Amc, ReadError> {
    let bones = &skeleton.bones;
    let names = bones.iter().enumerate().map(|(index, bone)| (bone.name.as_str(), index));
    let mut width = 0;
    let first = bones.iter().map(|bone| {
        width += bone.dofs.len();
        width - bone.dofs.len()
    });
    let first = first.collect();
    let mut reader = Reader {
        cursor: Cursor::new(bytes)?,
        skeleton,
        by_name: names.collect(),
        first,
        numbers: vec![0.0; width],
        seen: vec![0; bones.len()],
        usual: vec![],
        radians: skeleton.radians,
        rate: None,
        repair: options.repair,
        notes: Notes::default(),
    };
    reader.header()?;
    let (rotations, translations) = reader.frames()?;
    let rate = reader.rate.unwrap_or_else(|| {
        let text = format!("AMC stores no frame rate: taken for {} frames a second", options.fps);
        reader.notes.push(text);
        options.fps
    });
    let clip = Clip::new(skeleton.skeleton.clone(), 1.0 / rate, vec![0], translations, rotations);
    let clip = clip.map_err(|error| reader.cursor.error("a motion", &error.to_string()))?;
    let metres_per_unit = skeleton.has_unit.then_some(0.0254);
    Ok(Amc { clip, metres_per_unit, notes: reader.notes.finish() })
}

impl<'b> Reader<'_, 'b> {
    /// Lines with a colon, before the first frame.
    fn header(&mut self) -> Result<(), ReadError> {
        while self.cursor.skip_comments() && self.cursor.peek() == Some(b':') {
            if self.cursor.accept(":DEGREES") {
                self.radians = false;
            } else if self.cursor.accept(":RADIANS") {
                self.radians = true;
            } else if self.cursor.accept(":SAMPLES-PER-SECOND") {
                const EXPECTED: &str = "a rate between 0.001 and 1000000";
                self.cursor.skip_blanks();
                let start = self.cursor.at;
                let rate = self.cursor.number_here(EXPECTED)?;
                if !(1e-3..=1e6).contains(&rate) {
                    self.cursor.at = start;
                    return Err(self.cursor.unexpected(EXPECTED));
                }
                self.rate = Some(rate);
            }
            self.cursor.skip_line();
        }
        let ignored = |bone: &&super::asf::Bone| {
            bone.name != "root" && bone.dofs.iter().any(|dof| !matches!(dof, Dof::Turn(_)))
        };
        if let Some(bone) = self.skeleton.bones.iter().find(ignored) {
            let text = format!("bone '{}' and perhaps others move or stretch: ignored", bone.name);
            self.notes.push(text);
        }
        Ok(())
    }

    fn frames(&mut self) -> Result<(Vec<DQuat>, Vec<DVec3>), ReadError> {
        let joints = self.skeleton.bones.len();
        let most = most_frames(self.cursor.bytes.len(), joints, 1);
        let (mut rotations, mut translations) = (vec![], vec![]);
        let (mut count, mut number) = (0, None);
        while self.cursor.skip_comments() {
            if count == most {
                let expected = format!("at most {most} frames in so small a file");
                return Err(self.cursor.error(&expected, "more"));
            }
            let frame = self.frame_number(&mut number).and_then(|()| self.frame(count + 1));
            match frame {
                Ok(()) => {}
                Err(error) if self.repair && count > 0 => {
                    let text = format!("repaired: cut after frame {count}; {error}");
                    self.notes.at(self.cursor.bytes, self.cursor.at, text);
                    break;
                }
                Err(error) => return Err(error),
            }
            self.run(&mut rotations, &mut translations);
            count += 1;
        }
        if count == 0 {
            return Err(self.cursor.error("at least one frame", "none"));
        }
        Ok((rotations, translations))
    }

    /// A line with the frame's number, one more than the last.
    fn frame_number(&mut self, last: &mut Option<u64>) -> Result<(), ReadError> {
        let expected = match last {
            Some(last) => format!("frame number {}", *last + 1),
            None => "a frame number".into(),
        };
        let word = self.cursor.peek_word();
        let number = str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        // What cannot be counted on from is not a frame's number.
        let Some(number) = number.filter(|&number: &u64| number < u64::MAX) else {
            return Err(self.cursor.unexpected(&expected));
        };
        if last.is_some_and(|last| last + 1 != number) {
            if !self.repair {
                return Err(self.cursor.unexpected(&expected));
            }
            let text = format!("repaired: {expected} was {number}");
            self.notes.at(self.cursor.bytes, self.cursor.at, text);
        }
        self.cursor.word();
        *last = Some(number);
        self.line_end("the end of the line after the frame's number")
    }

    fn line_end(&mut self, expected: &str) -> Result<(), ReadError> {
        self.cursor.skip_blanks();
        if self.cursor.at_line_end() { Ok(()) } else { Err(self.cursor.unexpected(expected)) }
    }

    /// The bones of a frame, up to the next frame's number.
    fn frame(&mut self, frame: usize) -> Result<(), ReadError> {
        let mut lines = 0;
        while self.cursor.skip_comments()
            && !self.cursor.peek().is_some_and(|byte| byte.is_ascii_digit())
        {
            let bone = self.bone(lines)?;
            if self.seen[bone] == frame {
                return Err(self.cursor.unexpected("each bone once a frame"));
            }
            self.seen[bone] = frame;
            self.cursor.word();
            self.bone_numbers(bone, frame)?;
            lines += 1;
        }
        let bones = self.skeleton.bones.iter().zip(&self.seen);
        let mut missing = bones.filter(|(bone, seen)| !bone.dofs.is_empty() && **seen != frame);
        if let Some((bone, _)) = missing.next() {
            let expected = format!("bone '{}' in frame {frame}", bone.name);
            return Err(self.cursor.error(&expected, "the end of the frame"));
        }
        Ok(())
    }

    /// The bone that this line is about; most often the same as in the frame before.
    fn bone(&mut self, line: usize) -> Result<usize, ReadError> {
        let word = self.cursor.peek_word();
        let usual = self.usual.get(line).copied();
        let usual = usual.filter(|&bone| self.skeleton.bones[bone].name.as_bytes() == word);
        let known = || str::from_utf8(word).ok().and_then(|word| self.by_name.get(word).copied());
        let Some(bone) = usual.or_else(known) else {
            return Err(self.cursor.unexpected("a bone of the skeleton or a frame number"));
        };
        if line < self.usual.len() {
            self.usual[line] = bone;
        } else {
            self.usual.push(bone);
        }
        Ok(bone)
    }

    fn bone_numbers(&mut self, bone: usize, frame: usize) -> Result<(), ReadError> {
        let own: &'b _ = &self.skeleton.bones[bone];
        let miscounted = |cursor: &Cursor<'_>, found: usize| {
            let width = own.dofs.len();
            let expected = format!("{width} numbers for bone '{}' in frame {frame}", own.name);
            cursor.error(&expected, &found.to_string())
        };
        for slot in 0..own.dofs.len() {
            self.cursor.skip_blanks();
            if self.cursor.at_line_end() {
                return Err(miscounted(&self.cursor, slot));
            }
            self.numbers[self.first[bone] + slot] = self.cursor.number_here("a finite number")?;
        }
        self.cursor.skip_blanks();
        let start = self.cursor.at;
        let mut found = own.dofs.len();
        while !self.cursor.at_line_end() {
            self.cursor.number_here("a finite number or the end of the line")?;
            self.cursor.skip_blanks();
            found += 1;
        }
        if found == own.dofs.len() {
            return Ok(());
        }
        self.cursor.at = start;
        Err(miscounted(&self.cursor, found))
    }

    /// Appends the frame's local rotations and the root's place.
    fn run(&self, rotations: &mut Vec<DQuat>, translations: &mut Vec<DVec3>) {
        let unit = if self.radians { 1_f64.to_degrees() } else { 1.0 };
        for (bone, &first) in self.skeleton.bones.iter().zip(&self.first) {
            let turn = |axes, &(slot, axis): &(usize, usize)| {
                turned(axes, axis, self.numbers[first + slot] * unit)
            };
            rotations.push(bone.turns.iter().fold(bone.axis, turn) * bone.axis.conjugate());
        }
        let mut place = self.skeleton.position;
        for (slot, dof) in self.skeleton.bones[0].dofs.iter().enumerate() {
            if let Dof::Move(axis) = *dof {
                place[axis] += self.numbers[self.first[0] + slot];
            }
        }
        translations.push(place * self.skeleton.scale);
    }
}
