//! The part of a BVH file before its frames: the joints.

use ambulo_rig::glam::DVec3;

use super::Channel;
use crate::error::Notes;
use crate::text::{Cursor, UniqueNames};
use crate::{MOST_JOINTS, ReadError};

/// Deeper nesting is refused: the file would be mostly indent.
const DEEPEST: usize = 1000;

/// A joint as the file has it; its name made unique.
pub(super) struct Joint {
    pub name: String,
    pub parent: Option<usize>,
    pub offset: DVec3,
    pub channels: Vec<Channel>,
    pub tips: Vec<DVec3>,
}

/// All that stands before `MOTION`, and the place after it.
pub(super) struct Header<'a> {
    pub cursor: Cursor<'a>,
    pub joints: Vec<Joint>,
    /// Whether joint 0 was put above several roots.
    pub merged: bool,
    pub notes: Notes,
}

/// A joint whose block may still be open.
struct Building {
    start: usize,
    name: String,
    parent: Option<usize>,
    offset: Option<DVec3>,
    channels: Option<Vec<Channel>>,
    tips: Vec<DVec3>,
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    repair: bool,
    joints: Vec<Building>,
    open: Vec<usize>,
    notes: Notes,
}

/// Reads up to and with the word `MOTION`.
pub(super) fn read(bytes: &[u8], repair: bool) -> Result<Header<'_>, ReadError> {
    let cursor = Cursor::new(bytes)?;
    let mut reader =
        Reader { cursor, repair, joints: vec![], open: vec![], notes: Notes::default() };
    reader.cursor.expect("HIERARCHY")?;
    while !reader.statement()? {}
    reader.finish()
}

impl<'a> Reader<'a> {
    /// Reads one statement; true after `MOTION`.
    fn statement(&mut self) -> Result<bool, ReadError> {
        let Some(&joint) = self.open.last() else { return self.top_level() };
        if self.cursor.accept("OFFSET") {
            if self.joints[joint].offset.is_some() {
                return Err(self.twice("OFFSET"));
            }
            self.joints[joint].offset = Some(self.offset()?);
        } else if self.cursor.accept("CHANNELS") {
            if self.joints[joint].channels.is_some() {
                return Err(self.twice("CHANNELS"));
            }
            self.joints[joint].channels = Some(self.channels()?);
        } else if self.cursor.accept("JOINT") {
            self.begin_joint(Some(joint))?;
        } else if self.cursor.accept("End") {
            let tip = self.end_site()?;
            self.joints[joint].tips.push(tip);
        } else if self.cursor.accept("}") {
            self.close(joint)?;
        } else if self.repair && self.cursor.accept("MOTION") {
            self.note("repaired: closing braces were missing");
            while let Some(&joint) = self.open.last() {
                self.close(joint)?;
            }
            return Ok(true);
        } else {
            return Err(self.cursor.unexpected("OFFSET, CHANNELS, JOINT, End Site or }"));
        }
        Ok(false)
    }

    fn top_level(&mut self) -> Result<bool, ReadError> {
        if self.cursor.accept("ROOT") {
            self.begin_joint(None)?;
            Ok(false)
        } else if !self.joints.is_empty() && self.cursor.accept("MOTION") {
            Ok(true)
        } else {
            let expected = if self.joints.is_empty() { "ROOT" } else { "ROOT or MOTION" };
            Err(self.cursor.unexpected(expected))
        }
    }

    fn note(&mut self, text: &str) {
        self.notes.at(self.cursor.bytes, self.cursor.at, text);
    }

    fn twice(&self, what: &str) -> ReadError {
        self.cursor.error(&format!("one {what} a joint"), "a second one")
    }

    fn begin_joint(&mut self, parent: Option<usize>) -> Result<(), ReadError> {
        let start = self.cursor.at;
        if self.joints.len() == MOST_JOINTS {
            return Err(self.cursor.error(&format!("at most {MOST_JOINTS} joints"), "more"));
        }
        if self.open.len() == DEEPEST {
            return Err(self.cursor.error(&format!("at most {DEEPEST} joints nested"), "more"));
        }
        let name = self.name()?;
        self.cursor.expect("{")?;
        self.open.push(self.joints.len());
        let (offset, channels, tips) = (None, None, vec![]);
        self.joints.push(Building { start, name, parent, offset, channels, tips });
        Ok(())
    }

    /// The rest of the line, up to a brace; names may hold blanks and colons.
    fn name(&mut self) -> Result<String, ReadError> {
        self.cursor.skip_blanks();
        let start = self.cursor.at;
        while !self.cursor.at_line_end() && self.cursor.peek() != Some(b'{') {
            self.cursor.at += 1;
        }
        let bytes = self.cursor.bytes[start..self.cursor.at].trim_ascii();
        let text = String::from_utf8_lossy(bytes);
        if text.is_empty() {
            if !self.repair {
                return Err(self.cursor.unexpected("the joint's name"));
            }
            self.note("repaired: a joint without a name is called 'joint'");
            return Ok("joint".into());
        }
        let name = text.replace(|c: char| c.is_ascii_control(), "_");
        if name.as_bytes() != bytes {
            self.note(&format!("a name that is not plain UTF-8 text is read as '{name}'"));
        }
        Ok(name)
    }

    fn offset(&mut self) -> Result<DVec3, ReadError> {
        let mut number = || self.cursor.number("three numbers after OFFSET");
        Ok(DVec3::new(number()?, number()?, number()?))
    }

    fn channels(&mut self) -> Result<Vec<Channel>, ReadError> {
        let count = std::str::from_utf8(self.cursor.peek_word()).ok();
        let count = count.and_then(|word| word.parse().ok()).filter(|&count: &usize| count <= 6);
        let Some(count) = count else {
            return Err(self.cursor.unexpected("a number of channels from 0 to 6"));
        };
        self.cursor.word();
        let mut channels = Vec::with_capacity(count);
        while channels.len() < count {
            let channel = Channel::named(self.cursor.peek_word());
            let Some(channel) = channel.filter(|channel| !channels.contains(channel)) else {
                let expected = format!(
                    "{count} different channels out of Xposition … Zposition, Xrotation … Zrotation"
                );
                return Err(self.cursor.unexpected(&expected));
            };
            channels.push(channel);
            self.cursor.word();
        }
        Ok(channels)
    }

    /// The block after `End`; whatever else stands on its first line is a name that nobody needs.
    fn end_site(&mut self) -> Result<DVec3, ReadError> {
        while !self.cursor.at_line_end() && self.cursor.peek() != Some(b'{') {
            self.cursor.at += 1;
        }
        self.cursor.expect("{")?;
        let mut tip = None;
        loop {
            if tip.is_none() && self.cursor.accept("OFFSET") {
                tip = Some(self.offset()?);
            } else if self.cursor.accept("CHANNELS") {
                // Some exporters treat an end as a joint; it must not have numbers in the frames.
                let start = self.cursor.at;
                if !self.channels()?.is_empty() {
                    self.cursor.at = start;
                    return Err(self.cursor.unexpected("no channels in an End Site"));
                }
            } else if let Some(tip) = tip
                && self.cursor.accept("}")
            {
                return Ok(tip);
            } else {
                let expected = if tip.is_some() { "}" } else { "OFFSET" };
                return Err(self.cursor.unexpected(expected));
            }
        }
    }

    /// Ends a joint's block; what it lacks is refused or mended.
    fn close(&mut self, joint: usize) -> Result<(), ReadError> {
        self.open.pop();
        let building = &mut self.joints[joint];
        let lacks = match (building.offset, &building.channels) {
            (Some(_), Some(_)) => return Ok(()),
            (None, _) => "OFFSET",
            _ => "CHANNELS",
        };
        let place = format!("the end of joint '{}'", building.name);
        if !self.repair {
            let end = self.cursor.at.saturating_sub(1);
            return Err(ReadError::at(self.cursor.bytes, end, lacks, place));
        }
        building.offset.get_or_insert_default();
        building.channels.get_or_insert_default();
        let text = format!("repaired: joint '{}' had no {lacks}", building.name);
        self.notes.at(self.cursor.bytes, building.start, text);
        Ok(())
    }

    fn finish(mut self) -> Result<Header<'a>, ReadError> {
        self.make_names_unique();
        let roots = self.joints.iter().filter(|joint| joint.parent.is_none()).count();
        let merged = roots > 1;
        let mut joints = Vec::with_capacity(self.joints.len() + 1);
        if merged {
            let mut name = "root".to_owned();
            while self.joints.iter().any(|joint| joint.name == name) {
                name.push('_');
            }
            let text = format!("{roots} roots were put under one that is called '{name}'");
            self.notes.push(text);
            let (offset, channels, tips) = (DVec3::ZERO, vec![], vec![]);
            joints.push(Joint { name, parent: None, offset, channels, tips });
        }
        joints.extend(self.joints.into_iter().map(|building| Joint {
            name: building.name,
            parent: match building.parent {
                Some(parent) => Some(parent + usize::from(merged)),
                None => merged.then_some(0),
            },
            offset: building.offset.unwrap_or_default(),
            channels: building.channels.unwrap_or_default(),
            tips: building.tips,
        }));
        Ok(Header { cursor: self.cursor, joints, merged, notes: self.notes })
    }

    fn make_names_unique(&mut self) {
        let mut names = UniqueNames::default();
        for joint in &mut self.joints {
            let name = names.take(&joint.name);
            if name != joint.name {
                let text = format!("the name '{}' occurs twice: now '{name}'", joint.name);
                self.notes.at(self.cursor.bytes, joint.start, text);
                joint.name = name;
            }
        }
    }
}
