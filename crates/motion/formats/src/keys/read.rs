//! Text → keys.

use std::collections::HashSet;
use std::ops::RangeInclusive;

use super::body::Body;
use super::figure::{Figure, Pose};
use super::lines::{Line, lines};
use super::set::{set_joints, set_limb};
use super::{Easing, Event, Key, Keys, Marks, Phase};
use crate::ReadError;

const VERSION: f64 = 1.0;
const MOST_BYTES: usize = 4 << 20;
const MOST_POSES: usize = 200;
const MOST_PHASES: usize = 1000;
/// Of a figure's tracks times the keys: what a key leaves out costs memory and not a byte.
const MOST_NUMBERS: usize = 1 << 20;
/// A clip may hold so many frames times joints, 32 MB.
const MOST_ROTATIONS: f64 = 1e6;
const USUAL_FPS: f64 = 60.0;

pub(super) const LENGTH: RangeInclusive<f64> = -1000.0..=1000.0;
const SECONDS: RangeInclusive<f64> = 0.0..=3600.0;
const FPS: RangeInclusive<f64> = 1.0..=1000.0;

/// Names that a file may not give.
pub(super) const RESERVED: &[&str] = &[
    "keys", "skeleton", "mirror", "fps", "bone", "tip", "turns", "limb", "grip", "pose", "key",
    "phase", "event", "at", "facing", "swivel", "weight", "free", "partial", "loop", "smooth",
    "through", "linear", "-",
];

type Beside<'a> = &'a mut dyn FnMut(&str) -> Result<Vec<u8>, String>;

/// A file with keys, or one that mirrors such a file.
pub(super) fn clip(bytes: &[u8], beside: Beside) -> Result<Keys, ReadError> {
    if let Some(name) = mirrored(bytes)? {
        let (name, other) = name.load(&mut *beside)?;
        let inner = |error: ReadError| match error.file {
            None => error.with_file(&name),
            Some(_) => error,
        };
        let keys = Reader::read(&other, Some(beside)).and_then(|reader| reader.keys(&other));
        return Ok(Keys { mirrored: Some(name.clone()), ..keys.map_err(inner)? });
    }
    Reader::read(bytes, Some(beside))?.keys(bytes)
}

/// The name of a file beside, and where it stands.
struct FileName<'a> {
    line: Line<'a>,
    name: &'a str,
}

impl<'a> FileName<'a> {
    fn new(mut line: Line<'a>) -> Result<Self, ReadError> {
        const EXPECTED: &str = "the name of a file beside this one";
        let name = line.word(EXPECTED)?;
        if name.starts_with('.') || name.contains(['/', '\\', ':', '\0']) || name.len() > 200 {
            return Err(line.wrong(EXPECTED));
        }
        line.done()?;
        Ok(Self { line, name })
    }

    fn load(self, beside: Beside) -> Result<(String, Vec<u8>), ReadError> {
        let bytes = beside(self.name);
        let bytes = bytes.map_err(|why| self.line.wrong(&format!("a file beside ({why})")))?;
        Ok((self.name.to_owned(), bytes))
    }
}

/// The file that this one mirrors, which is then all that it says.
fn mirrored(bytes: &[u8]) -> Result<Option<FileName<'_>>, ReadError> {
    let mut lines = checked_lines(bytes)?;
    let Some(mut line) = lines.next() else { return Ok(None) };
    if !line.accept("mirror") {
        return Ok(None);
    }
    let name = FileName::new(line)?;
    match lines.next() {
        Some(line) => Err(line.unexpected("nothing else in a file that mirrors another")),
        None => Ok(Some(name)),
    }
}

/// The lines after the first one, which names the format.
fn checked_lines(bytes: &[u8]) -> Result<impl Iterator<Item = Line<'_>>, ReadError> {
    if bytes.len() > MOST_BYTES {
        return Err(ReadError::at(bytes, 0, format!("at most {MOST_BYTES} bytes"), "more"));
    }
    let mut lines = lines(bytes)?;
    let Some(mut first) = lines.next() else {
        return Err(ReadError::at(bytes, 0, "keys 1", "an empty file"));
    };
    if !first.accept("keys") {
        return Err(first.unexpected("keys 1"));
    }
    if first.number("the version", 0.0..=1e9)? != VERSION {
        return Err(first.wrong("version 1, the only one so far"));
    }
    first.done()?;
    Ok(lines)
}

/// What is being filled in by the lines that follow.
enum Block {
    None,
    Pose,
    Key,
}

struct Reader<'b> {
    /// Gives files beside; a skeleton's file has none, and no keys.
    beside: Option<Beside<'b>>,
    body: Body,
    /// Once the first pose, key or skeleton's file has come.
    figure: Option<Figure>,
    fps: Option<f64>,
    marks: Marks,
    /// Where the last phase, the last event end; they must lie within the keys.
    latest: (f64, usize),
    block: Block,
    /// Tracks that the block has set.
    taken: HashSet<usize>,
    keys: Vec<Key>,
}

impl<'b> Reader<'b> {
    fn read(bytes: &[u8], beside: Option<Beside<'b>>) -> Result<Self, ReadError> {
        let mut reader = Self {
            beside,
            body: Body::default(),
            figure: None,
            fps: None,
            marks: Marks::default(),
            latest: (0.0, 0),
            block: Block::None,
            taken: HashSet::new(),
            keys: vec![],
        };
        for line in checked_lines(bytes)? {
            reader.statement(line)?;
        }
        Ok(reader)
    }

    fn keys(self, bytes: &[u8]) -> Result<Keys, ReadError> {
        let Some(last) = self.keys.last() else {
            return Err(ReadError::at(bytes, bytes.len(), "a key", "the end of the file"));
        };
        if self.latest.0 > last.time {
            let expected = format!("a time up to that of the last key, {}", last.time);
            return Err(ReadError::at(bytes, self.latest.1, expected, self.latest.0.to_string()));
        }
        let figure = self.figure.expect("a key asks for it");
        let fps = self.fps.unwrap_or(USUAL_FPS);
        let rotations = (last.time * fps + 1.0) * figure.skeleton.len() as f64;
        if rotations > MOST_ROTATIONS {
            let expected = format!("a clip of at most {MOST_ROTATIONS} frames times joints");
            return Err(ReadError::at(bytes, bytes.len(), expected, rotations.to_string()));
        }
        Ok(Keys { figure, fps, marks: self.marks, keys: self.keys, mirrored: None })
    }

    fn statement(&mut self, mut line: Line) -> Result<(), ReadError> {
        match line.peek() {
            Some("bone") => self.body_line(line, Body::bone),
            Some("tip") => self.body_line(line, Body::tip),
            Some("turns") => self.body_line(line, Body::turns),
            Some("limb") => self.body_line(line, Body::limb),
            Some("pose") => self.pose(line),
            Some("skeleton" | "mirror" | "fps" | "phase" | "event" | "key")
                if self.beside.is_none() =>
            {
                Err(line.unexpected("bone, tip, turns, limb or pose in a skeleton's file"))
            }
            Some("mirror") => Err(line.unexpected("mirror as all that a file says")),
            Some("skeleton") => self.skeleton(line),
            Some("fps") => {
                if self.fps.is_some() {
                    return Err(line.unexpected("one line with fps"));
                }
                line.next_word();
                self.fps = Some(line.number("frames a second", FPS)?);
                line.done()
            }
            Some("phase") => self.phase(line),
            Some("event") => self.event(line),
            Some("key") => self.key(line),
            _ if !matches!(self.block, Block::None) => self.set(line),
            _ => Err(line.unexpected(
                "skeleton, mirror, fps, bone, tip, turns, limb, pose, phase, event or key",
            )),
        }
    }

    // -- the body ---------------------------------------------------------------------------------

    fn skeleton(&mut self, mut line: Line) -> Result<(), ReadError> {
        if self.figure.is_some() || !self.body.is_empty() {
            return Err(line.unexpected("one skeleton, before anything that needs it"));
        }
        line.next_word();
        let file = FileName::new(line)?;
        let beside = self.beside.as_mut().expect("refused in a skeleton's file");
        let (name, bytes) = file.load(&mut **beside)?;
        let inner = |error: ReadError| error.with_file(&name);
        let mut reader = Reader::read(&bytes, None).map_err(inner)?;
        let mut figure = reader.figure_at(&bytes).map_err(inner)?;
        figure.file = Some((name.clone(), figure.poses.len()));
        self.body.by_name = reader.body.by_name;
        self.figure = Some(figure);
        Ok(())
    }

    /// The figure at the end of its file.
    fn figure_at(&mut self, bytes: &[u8]) -> Result<Figure, ReadError> {
        self.complete(|| ReadError::at(bytes, bytes.len(), "a bone", "the end of the file"))?;
        Ok(self.figure.take().expect("complete"))
    }

    /// After this no bone can come.
    fn complete(&mut self, no_bone: impl FnOnce() -> ReadError) -> Result<(), ReadError> {
        if self.figure.is_some() {
            return Ok(());
        }
        if self.body.is_empty() {
            return Err(no_bone());
        }
        self.figure = Some(self.body.finish());
        Ok(())
    }

    fn body_line(
        &mut self,
        mut line: Line,
        read: fn(&mut Body, &mut Line) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        if self.figure.is_some() {
            return Err(line.unexpected("the skeleton's lines before the first pose or key"));
        }
        line.next_word();
        read(&mut self.body, &mut line)?;
        line.done()
    }

    // -- time -------------------------------------------------------------------------------------

    fn mark(&mut self, time: f64, at: usize) {
        if time > self.latest.0 {
            self.latest = (time, at);
        }
    }

    fn phase(&mut self, mut line: Line) -> Result<(), ReadError> {
        line.next_word();
        let name = line.name("a phase's name", RESERVED)?;
        if self.marks.phases.iter().any(|phase| phase.name == name) {
            return Err(line.wrong("another name"));
        }
        if self.marks.phases.len() == MOST_PHASES {
            return Err(line.wrong(&format!("at most {MOST_PHASES} phases")));
        }
        let before = self.marks.phases.last().map_or(0.0, |phase| phase.end);
        let start = line.number("the start in seconds", SECONDS)?;
        if start < before {
            return Err(line.wrong(&format!("{before} or later, after the phase before")));
        }
        let at = line.at();
        let end = line.number("the end in seconds", SECONDS)?;
        if end <= start {
            return Err(line.wrong(&format!("an end after {start}")));
        }
        self.mark(end, at);
        let loops = line.accept("loop");
        self.marks.phases.push(Phase { name, start, end, loops });
        line.done()
    }

    fn event(&mut self, mut line: Line) -> Result<(), ReadError> {
        line.next_word();
        let name = line.name("an event's name", RESERVED)?;
        let at = line.at();
        let time = line.number("the time in seconds", SECONDS)?;
        self.mark(time, at);
        self.marks.events.push(Event { name, time });
        line.done()
    }

    fn pose(&mut self, mut line: Line) -> Result<(), ReadError> {
        self.complete(|| line.unexpected("a skeleton before the first pose"))?;
        line.next_word();
        let name = line.name("a pose's name", RESERVED)?;
        let figure = self.figure.as_mut().expect("complete");
        if !self.keys.is_empty() || figure.find_pose(&name).is_some() {
            return Err(line.wrong("a pose of another name, before the first key"));
        }
        if figure.poses.len() == MOST_POSES {
            return Err(line.wrong(&format!("at most {MOST_POSES} poses")));
        }
        figure.poses.push(Pose { name, sets: vec![] });
        self.block = Block::Pose;
        self.taken.clear();
        line.done()
    }

    fn key(&mut self, mut line: Line) -> Result<(), ReadError> {
        self.complete(|| line.unexpected("a skeleton before the first key"))?;
        line.next_word();
        let figure = self.figure.as_ref().expect("complete");
        let time = line.number("the time in seconds", SECONDS)?;
        match self.keys.last() {
            None if time != 0.0 => return Err(line.wrong("the first key at 0")),
            Some(before) if time <= before.time => {
                return Err(line.wrong(&format!("a time after {}", before.time)));
            }
            _ => {}
        }
        if (self.keys.len() + 1) * figure.tracks() > MOST_NUMBERS {
            return Err(line.wrong(&format!("at most {} keys", self.keys.len())));
        }
        let given = |easing: &Easing| line.peek() == Some(easing.name());
        let easing = Easing::ALL.into_iter().find(given);
        if easing.is_some() {
            line.next_word();
        }
        let (easing, partial) = (easing.unwrap_or(Easing::Smooth), line.accept("partial"));
        let pose = if !partial && line.accept("pose") {
            let found = figure.find_pose(line.word("a pose's name")?);
            Some(found.ok_or_else(|| line.wrong("the name of a pose"))?)
        } else {
            None
        };
        self.keys.push(Key { time, easing, partial, pose, sets: vec![] });
        self.block = Block::Key;
        self.taken.clear();
        line.done()
    }

    // -- what a pose or a key sets ----------------------------------------------------------------

    fn set(&mut self, mut line: Line) -> Result<(), ReadError> {
        let figure = self.figure.as_ref().expect("a block has one");
        let mut sets = vec![];
        let limb = line.peek().and_then(|name| figure.find_limb(name));
        if let Some(limb) = limb {
            line.next_word();
            set_limb(&mut line, figure.limb_track(limb), &mut sets)?;
        } else {
            set_joints(&mut line, figure, &self.body.by_name, &mut sets)?;
        }
        if !sets.iter().all(|(track, _)| self.taken.insert(*track)) {
            return Err(line.wrong("each number once in a pose or a key"));
        }
        let block = match self.block {
            Block::Key => &mut self.keys.last_mut().expect("a key is open").sets,
            _ => {
                let figure = self.figure.as_mut().expect("a block has one");
                &mut figure.poses.last_mut().expect("a pose is open").sets
            }
        };
        block.extend(sets);
        Ok(())
    }
}
