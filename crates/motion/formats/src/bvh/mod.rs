//! BVH, in every dialect that we have met.
//!
//! * Rotation channels compose in the order listed, left to right, about the turned axes:
//!   `Zrotation Yrotation Xrotation` is R = Rz·Ry·Rx. The order is each joint's own.
//! * Position channels replace the joint's offset, or are added to it
//!   ([`ReadOptions::positions`]).
//! * Frames are lines. Line ends, blanks and indents do not matter; `Frames :`, glued numbers
//!   (`0.0-7.5`), names with blanks or colons, and joints without channels are understood.
//! * A frame time within 0.01 % of 1/N seconds is taken for 1/N.

mod header;
mod motion;
mod write;

use ambulo_rig::Clip;

pub use write::{WriteOptions, Written, write};

use crate::{Note, Positions, ReadError, ReadOptions};

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Bvh {
    /// In the file's own units and axes.
    pub clip: Clip,
    /// How the file writes it.
    pub dialect: Dialect,
    /// What was odd or mended.
    pub notes: Vec<Note>,
}

/// What it takes to write a clip the way a file had it.
#[derive(Clone, Debug, PartialEq)]
pub struct Dialect {
    /// Joints by name with their channels, in the file's order.
    pub joints: Vec<(String, Vec<Channel>)>,
    /// Seconds a frame, as the reader took it.
    pub frame_time: f64,
    /// The same as the file spells it (`.0083333`).
    pub frame_time_text: String,
    /// What position channels do.
    pub positions: Positions,
}

/// One number of a joint in a frame: a length in the file's unit, or an angle in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Channel {
    Xposition,
    Yposition,
    Zposition,
    Xrotation,
    Yrotation,
    Zrotation,
}

impl Channel {
    /// Positions, then rotations, in the order X, Y, Z.
    pub const ALL: [Self; 6] = [
        Self::Xposition,
        Self::Yposition,
        Self::Zposition,
        Self::Xrotation,
        Self::Yrotation,
        Self::Zrotation,
    ];

    /// As BVH spells it.
    pub fn name(self) -> &'static str {
        ["Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation"]
            [self as usize]
    }

    /// The channel of that name, in any case.
    pub fn named(name: &[u8]) -> Option<Self> {
        Self::ALL.into_iter().find(|channel| name.eq_ignore_ascii_case(channel.name().as_bytes()))
    }

    /// Whether it is an angle.
    pub fn is_rotation(self) -> bool {
        self as usize >= 3
    }

    /// 0 for X, 1 for Y, 2 for Z.
    pub fn axis(self) -> usize {
        self as usize % 3
    }
}

/// The channels that most programs understand: three for a joint, six for one that moves.
pub(crate) fn usual_channels(moves: bool) -> Vec<Channel> {
    use Channel::{Xposition, Xrotation, Yposition, Yrotation, Zposition, Zrotation};
    let mut channels = if moves { vec![Xposition, Yposition, Zposition] } else { vec![] };
    channels.extend([Zrotation, Yrotation, Xrotation]);
    channels
}

/// Reads a BVH file.
///
/// Commas are looked at only when the file cannot be read without: first as decimal commas, then
/// as separators, each with a note.
///
/// # Errors
/// A file that is not BVH or not whole, with line and column. [`ReadOptions::repair`] mends some
/// of it.
pub fn read(bytes: &[u8], options: &ReadOptions) -> Result<Bvh, ReadError> {
    let whole = ReadOptions { repair: false, ..options.clone() };
    let refusal = match read_once(bytes, &whole) {
        Ok(bvh) => return Ok(bvh),
        Err(refusal) => refusal,
    };
    let decimal = without_commas(bytes, b'.');
    let separated = without_commas(bytes, b' ');
    let others = [
        (&decimal, "numbers are written with a decimal comma"),
        (&separated, "numbers are separated by commas"),
    ];
    let attempts = if options.repair { &[false, true][..] } else { &[false] };
    for &repair in attempts {
        let options = ReadOptions { repair, ..options.clone() };
        if repair && let Ok(bvh) = read_once(bytes, &options) {
            return Ok(bvh);
        }
        for (text, note) in &others {
            if let Some(text) = text
                && let Ok(mut bvh) = read_once(text, &options)
            {
                bvh.notes.insert(0, Note::new(*note));
                return Ok(bvh);
            }
        }
    }
    Err(refusal)
}

fn read_once(bytes: &[u8], options: &ReadOptions) -> Result<Bvh, ReadError> {
    let mut header = header::read(bytes, options.repair)?;
    let mut dialect = Dialect {
        joints: header.joints.iter().map(|j| (j.name.clone(), j.channels.clone())).collect(),
        frame_time: 0.0,
        frame_time_text: String::new(),
        positions: options.positions,
    };
    if header.merged {
        // So that the one root that is written can be moved in any program.
        dialect.joints[0].1 = usual_channels(true);
    }
    let clip = motion::read(&mut header, options, &mut dialect)?;
    Ok(Bvh { clip, dialect, notes: header.notes.finish() })
}

/// The same text with another byte for every comma after a digit; places stay the same. `None`
/// where there is no such comma.
fn without_commas(bytes: &[u8], instead: u8) -> Option<Vec<u8>> {
    let follows_digit = |pair: &[u8]| pair[0].is_ascii_digit() && pair[1] == b',';
    if !bytes.windows(2).any(follows_digit) {
        return None;
    }
    let mut text = bytes.to_vec();
    for at in 1..text.len() {
        if follows_digit(&bytes[at - 1..=at]) {
            text[at] = instead;
        }
    }
    Some(text)
}
