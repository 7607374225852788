//! The part of a BVH file after `MOTION`: the frames.

use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Clip, Joint, Skeleton};

use super::Dialect;
use super::header::{self, Header};
use crate::error::Notes;
use crate::euler::turned;
use crate::text::Cursor;
use crate::{Positions, ReadError, ReadOptions, most_frames};

/// Where a joint finds its numbers in a frame.
struct Program {
    /// First slot and number of the rotations in `axes`.
    first: usize,
    count: usize,
}

/// What turns the numbers of a frame into transforms, made once for all frames.
struct Plan {
    /// Numbers a frame.
    width: usize,
    /// One a joint.
    programs: Vec<Program>,
    /// Slot and axis of every rotation, joint after joint.
    turns: Vec<(usize, usize)>,
    /// Joints with position channels.
    moving: Vec<usize>,
    /// For each of those, where its translation starts from and which slots go into it.
    places: Vec<(DVec3, [Option<usize>; 3])>,
}

impl Plan {
    fn new(joints: &[header::Joint], positions: Positions) -> Self {
        let mut plan = Self {
            width: 0,
            programs: Vec::with_capacity(joints.len()),
            turns: vec![],
            moving: vec![],
            places: vec![],
        };
        for (index, joint) in joints.iter().enumerate() {
            let first = plan.turns.len();
            let mut slots = [None; 3];
            for channel in &joint.channels {
                match channel.is_rotation() {
                    true => plan.turns.push((plan.width, channel.axis())),
                    false => slots[channel.axis()] = Some(plan.width),
                }
                plan.width += 1;
            }
            plan.programs.push(Program { first, count: plan.turns.len() - first });
            if slots != [None; 3] {
                // Replacing an axis is adding to 0.
                let mut base = joint.offset;
                if positions == Positions::Replace {
                    (0..3).filter(|&axis| slots[axis].is_some()).for_each(|axis| base[axis] = 0.0);
                }
                plan.moving.push(index);
                plan.places.push((base, slots));
            }
        }
        plan
    }

    /// Appends a frame's local rotations and translations.
    fn run(&self, numbers: &[f64], rotations: &mut Vec<DQuat>, translations: &mut Vec<DVec3>) {
        rotations.extend(self.programs.iter().map(|program| {
            let turns = &self.turns[program.first..][..program.count];
            turns.iter().fold(DQuat::IDENTITY, |rotation, &(slot, axis)| {
                turned(rotation, axis, numbers[slot])
            })
        }));
        translations.extend(self.places.iter().map(|&(base, slots)| {
            let place = slots.map(|slot| slot.map_or(0.0, |slot| numbers[slot]));
            base + DVec3::from_array(place)
        }));
    }
}

/// Reads from after `MOTION` to the end, and makes a clip of all.
pub(super) fn read(
    header: &mut Header<'_>,
    options: &ReadOptions,
    dialect: &mut Dialect,
) -> Result<Clip, ReadError> {
    let plan = Plan::new(&header.joints, options.positions);
    let cursor = &mut header.cursor;
    let bytes = cursor.bytes;
    if plan.width == 0 {
        return Err(cursor.error("at least one joint with channels", "none"));
    }
    let mut reader = Reader { cursor, repair: options.repair, notes: &mut header.notes };
    let announced = reader.frame_count()?;
    reader.frame_time(dialect)?;
    let most = most_frames(bytes.len(), header.joints.len(), plan.moving.len());
    let (rotations, translations) = reader.frames(&plan, announced, most)?;
    let joints = header.joints.drain(..).map(|joint| Joint {
        name: joint.name,
        parent: joint.parent,
        offset: joint.offset,
        tips: joint.tips,
    });
    let end = |error: String| header.cursor.error("a motion", &error);
    let skeleton = Skeleton::new(joints.collect()).map_err(|error| end(error.to_string()))?;
    let frame_time = dialect.frame_time;
    Clip::new(skeleton, frame_time, plan.moving, translations, rotations)
        .map_err(|error| end(error.to_string()))
}

/// The number of frames that the file says it has, and where it says so.
#[derive(Clone, Copy)]
struct Announced {
    count: usize,
    line_start: usize,
}

struct Reader<'a, 'b> {
    cursor: &'b mut Cursor<'a>,
    repair: bool,
    notes: &'b mut Notes,
}

impl Reader<'_, '_> {
    fn note(&mut self, text: impl Into<String>) {
        self.notes.at(self.cursor.bytes, self.cursor.at, text);
    }

    /// Takes `Frames:`, `Frames :`, `Frame Time:` and the like.
    fn label(&mut self, words: &[&str]) -> bool {
        self.cursor.skip_space();
        let start = self.cursor.at;
        for word in words.iter().copied().chain([":"]) {
            self.cursor.skip_blanks();
            let there = self.cursor.bytes[self.cursor.at..].get(..word.len());
            if !there.is_some_and(|there| there.eq_ignore_ascii_case(word.as_bytes())) {
                self.cursor.at = start;
                return false;
            }
            self.cursor.at += word.len();
        }
        self.cursor.skip_blanks();
        true
    }

    fn frame_count(&mut self) -> Result<Option<Announced>, ReadError> {
        const EXPECTED: &str = "a number of frames, at least 1";
        if !self.label(&["Frames"]) {
            if !self.repair {
                return Err(self.cursor.unexpected("Frames:"));
            }
            self.note("repaired: the number of frames was missing");
            return Ok(None);
        }
        let line_start = self.cursor.at;
        let word = if self.cursor.at_line_end() { &[] } else { self.cursor.peek_word() };
        let count = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        match count.filter(|&count: &usize| count > 0) {
            Some(count) => {
                self.cursor.word();
                Ok(Some(Announced { count, line_start }))
            }
            None if self.repair => {
                self.note("repaired: the number of frames was not one");
                self.cursor.skip_line();
                Ok(None)
            }
            None => Err(self.cursor.unexpected(EXPECTED)),
        }
    }

    fn frame_time(&mut self, dialect: &mut Dialect) -> Result<(), ReadError> {
        let mended = |reader: &mut Self, text: &str, dialect: &mut Dialect| {
            reader.note(format!("repaired: the frame time was {text}; taken for 1/30 s"));
            (dialect.frame_time, dialect.frame_time_text) = (1.0 / 30.0, "0.0333333333".into());
        };
        if !self.label(&["Frame", "Time"]) {
            if !self.repair {
                return Err(self.cursor.unexpected("Frame Time:"));
            }
            mended(self, "missing", dialect);
            return Ok(());
        }
        const EXPECTED: &str = "a frame time between 0.000001 and 1000000 seconds";
        let start = self.cursor.at;
        let seconds = self.cursor.number_here(EXPECTED);
        match seconds {
            Ok(seconds) if (1e-6..=1e6).contains(&seconds) => {
                let text = &self.cursor.bytes[start..self.cursor.at];
                dialect.frame_time_text = String::from_utf8_lossy(text).into_owned();
                dialect.frame_time = snapped(seconds);
            }
            _ if self.repair => {
                mended(self, "not one", dialect);
                self.cursor.skip_line();
            }
            _ => {
                self.cursor.at = start;
                return Err(self.cursor.unexpected(EXPECTED));
            }
        }
        self.cursor.skip_blanks();
        if !self.cursor.at_line_end() {
            return Err(self.cursor.unexpected("the end of the line"));
        }
        Ok(())
    }

    fn frames(
        &mut self,
        plan: &Plan,
        announced: Option<Announced>,
        most: usize,
    ) -> Result<(Vec<DQuat>, Vec<DVec3>), ReadError> {
        // What the file says of itself is believed as far as there are bytes to back it: a number
        // is a digit and a blank or a sign.
        let backed = (self.cursor.bytes.len() - self.cursor.at) / (2 * plan.width) + 1;
        let room = announced.map_or(backed, |announced| announced.count.min(backed)).min(most);
        let mut rotations = Vec::with_capacity(room * plan.programs.len());
        let mut translations = Vec::with_capacity(room * plan.moving.len());
        let mut numbers = vec![0.0; plan.width];
        let mut count = 0;
        let mut glued = None;
        loop {
            self.cursor.skip_space();
            if self.cursor.peek().is_none() {
                break;
            }
            let full = announced.is_some_and(|announced| announced.count == count);
            if full && self.extra(count)? {
                break;
            }
            if count == most {
                let expected =
                    format!("at most {most} frames of so many joints in so small a file");
                return Err(self.cursor.error(&expected, "more"));
            }
            match self.frame(&mut numbers, count, &mut glued) {
                Ok(()) => {}
                Err(error) if self.repair => {
                    self.note(format!("repaired: cut after frame {count}; {error}"));
                    break;
                }
                Err(error) => return Err(error),
            }
            plan.run(&numbers, &mut rotations, &mut translations);
            count += 1;
        }
        if let Some(place) = glued {
            self.notes.at(self.cursor.bytes, place, "numbers without a blank between them");
        }
        self.compare(announced, count)?;
        Ok((rotations, translations))
    }

    /// After the last frame that was announced: refuses what follows, or says that it is dropped.
    fn extra(&mut self, count: usize) -> Result<bool, ReadError> {
        if !self.repair {
            let expected = format!("the end of the file after {count} frames, as announced");
            return Err(self.cursor.unexpected(&expected));
        }
        self.note(format!("repaired: what follows the {count} frames announced was dropped"));
        Ok(true)
    }

    /// Reads one line of numbers.
    #[inline]
    fn frame(
        &mut self,
        numbers: &mut [f64],
        index: usize,
        glued: &mut Option<usize>,
    ) -> Result<(), ReadError> {
        let width = numbers.len();
        for (slot, number) in numbers.iter_mut().enumerate() {
            let end = self.cursor.at;
            self.cursor.skip_blanks();
            if self.cursor.at_line_end() {
                return Err(self.miscounted(width, index, slot));
            }
            if self.cursor.at == end && slot > 0 {
                glued.get_or_insert(end);
            }
            *number = self.cursor.number_here("a finite number")?;
        }
        self.cursor.skip_blanks();
        if self.cursor.at_line_end() {
            return Ok(());
        }
        let start = self.cursor.at;
        let mut found = width;
        while !self.cursor.at_line_end() {
            self.cursor.number_here("a finite number or the end of the line")?;
            found += 1;
            self.cursor.skip_blanks();
        }
        if self.repair {
            let text = format!("repaired: {} numbers too many were dropped", found - width);
            self.note(text);
            return Ok(());
        }
        self.cursor.at = start;
        Err(self.miscounted(width, index, found))
    }

    #[cold]
    fn miscounted(&self, width: usize, index: usize, found: usize) -> ReadError {
        let expected = format!("{width} numbers in frame {}", index + 1);
        self.cursor.error(&expected, &found.to_string())
    }

    /// The number of frames against what was announced.
    fn compare(&mut self, announced: Option<Announced>, count: usize) -> Result<(), ReadError> {
        if count == 0 {
            return Err(self.cursor.error("at least one frame", "none"));
        }
        let Some(announced) = announced.filter(|announced| announced.count != count) else {
            return Ok(());
        };
        if !self.repair {
            let expected = format!("{} frames, as announced", announced.count);
            return Err(self.cursor.error(&expected, &count.to_string()));
        }
        let text = format!("repaired: {} frames were announced, {count} are here", announced.count);
        self.notes.at(self.cursor.bytes, announced.line_start, text);
        Ok(())
    }
}

/// 1/N for times that are meant to be: printed with six decimals, 1/120 s is off by 0.004 %.
fn snapped(seconds: f64) -> f64 {
    let rate = (1.0 / seconds).round();
    // From 1000 on the step from one N to the next gets near the tolerance.
    if (1.0..=1000.0).contains(&rate) && (seconds * rate - 1.0).abs() <= 1e-4 {
        return 1.0 / rate;
    }
    seconds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_times_meant_as_a_rate_are_taken_for_it() {
        for (text, rate) in [
            (0.008333, 120.0),
            (0.0083333, 120.0),
            (0.016667, 60.0),
            (0.0333333, 30.0),
            (0.041667, 24.0),
            (0.001, 1000.0),
        ] {
            assert_eq!(snapped(text), 1.0 / rate);
        }
        for kept in [0.0333667, 0.0166, 0.0001, 2.5] {
            assert_eq!(snapped(kept), kept);
        }
    }
}
