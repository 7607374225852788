//! Blocks of the two vectors, by name and size.

use std::ops::Range;

/// Samples of the trajectory in the input: frames −60, −50, … +50 around now.
pub const SAMPLES: usize = 12;

/// Frames of the trajectory window before now, and after it.
pub const WINDOW: usize = 60;

/// Gaits that a character can be asked for. A layout has inputs for some of them: the published
/// one takes jog and run for one gait, Ambulo's own has no bumping into walls.
pub const GAITS: [&str; 7] = ["stand", "walk", "jog", "run", "crouch", "jump", "bump"];

/// Places of the gaits in [`GAITS`].
#[allow(missing_docs)]
pub mod gait {
    pub const STAND: usize = 0;
    pub const WALK: usize = 1;
    pub const JOG: usize = 2;
    pub const RUN: usize = 3;
    pub const CROUCH: usize = 4;
    pub const JUMP: usize = 5;
    pub const BUMP: usize = 6;
}

/// A named run of numbers within a vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Unique within its vector.
    pub name: &'static str,
    /// Where its numbers lie.
    pub range: Range<usize>,
}

/// Why a layout is not the one that was expected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum LayoutError {
    #[error("layout '{0}' is not known; known: ambulo, holden")]
    Unknown(String),
    #[error("a layout needs between 1 and 1000 joints, not {0}")]
    Joints(usize),
    #[error("{side} block {index} is '{found}', this version expects '{expected}'")]
    Block { side: &'static str, index: usize, expected: String, found: String },
    #[error(
        "the layout's fingerprint is {found}, this version's is {expected}: the meaning of its numbers has changed"
    )]
    Hash { expected: String, found: String },
}

/// What velocities count in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rates {
    /// Per second; turning to the left is positive.
    Second,
    /// Per frame; the published yaw is that of world → root: turning to the right is positive.
    Frame,
}

/// How a rotation is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rotations {
    /// Three numbers: unit axis × half the angle. Jumps where an angle passes a half turn.
    HalfLog,
    /// Six numbers: where the X and the Y axis go. Continuous, hence easier to learn.
    /// Source: Zhou et al., "On the Continuity of Rotation Representations in Neural Networks"
    /// (CVPR 2019).
    TwoAxes,
}

/// What the numbers of a network's two vectors mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    name: &'static str,
    joints: usize,
    fps: f32,
    units_per_metre: f32,
    /// Number of each block of the input that is a gait, with the gaits that it sums.
    pub(crate) gaits: &'static [&'static [usize]],
    pub(crate) rates: Rates,
    pub(crate) rotations: Rotations,
    inputs: Vec<Block>,
    outputs: Vec<Block>,
}

impl Layout {
    /// The layout of that name for a number of joints.
    ///
    /// # Errors
    /// An unknown name, no joint or more than 1000.
    pub fn named(name: &str, joints: usize) -> Result<Self, LayoutError> {
        match name {
            "ambulo" => Self::ambulo(joints),
            "holden" => Self::holden(joints),
            _ => Err(LayoutError::Unknown(name.into())),
        }
    }

    /// Ambulo's own: metres, velocities per second so that they mean the same at any frame rate,
    /// rotations as two axes; 156 + 6·J numbers in and 32 + 12·J out.
    ///
    /// # Errors
    /// No joint or more than 1000.
    pub fn ambulo(joints: usize) -> Result<Self, LayoutError> {
        Self {
            name: "ambulo",
            joints,
            fps: 60.0,
            units_per_metre: 1.0,
            gaits: &[&[0], &[1], &[2], &[3], &[4], &[5]],
            rates: Rates::Second,
            rotations: Rotations::TwoAxes,
            inputs: vec![],
            outputs: vec![],
        }
        .with_blocks(["stand", "walk", "jog", "run", "crouch", "jump"].map(gait_block))
    }

    /// The published layout of the PFNN: centimetres, frames at 60 Hz, 120 + 6·J + 36 numbers in
    /// and 8 + 24 + 9·J out (342 and 311 for its 31 joints).
    ///
    /// Its "right" terrain samples lie at +25 cm on the root's X axis, which is the character's
    /// left; blocks are named after where they are.
    ///
    /// # Errors
    /// No joint or more than 1000.
    pub fn holden(joints: usize) -> Result<Self, LayoutError> {
        Self {
            name: "holden",
            joints,
            fps: 60.0,
            units_per_metre: 100.0,
            gaits: &[&[0], &[1], &[2, 3], &[4], &[5], &[6]],
            rates: Rates::Frame,
            rotations: Rotations::HalfLog,
            inputs: vec![],
            outputs: vec![],
        }
        .with_blocks(["stand", "walk", "jog", "crouch", "jump", "bump"].map(gait_block))
    }

    fn with_blocks(mut self, gaits: [&'static str; 6]) -> Result<Self, LayoutError> {
        let joints = self.joints;
        if !(1..=1000).contains(&joints) {
            return Err(LayoutError::Joints(joints));
        }
        let mut inputs = vec![
            ("trajectory_x", SAMPLES),
            ("trajectory_z", SAMPLES),
            ("direction_x", SAMPLES),
            ("direction_z", SAMPLES),
        ];
        inputs.extend(gaits.map(|gait| (gait, SAMPLES)));
        inputs.extend([
            ("joint_position", 3 * joints),
            ("joint_velocity", 3 * joints),
            ("terrain_left", SAMPLES),
            ("terrain_centre", SAMPLES),
            ("terrain_right", SAMPLES),
        ]);
        let rotation = match self.rotations {
            Rotations::HalfLog => 3,
            Rotations::TwoAxes => 6,
        };
        let outputs = [
            ("root_velocity", 2),
            ("root_yaw", 1),
            ("phase_rate", 1),
            ("contacts", 4),
            ("trajectory_x", SAMPLES / 2),
            ("trajectory_z", SAMPLES / 2),
            ("direction_x", SAMPLES / 2),
            ("direction_z", SAMPLES / 2),
            ("joint_position", 3 * joints),
            ("joint_velocity", 3 * joints),
            ("joint_rotation", rotation * joints),
        ];
        self.inputs = blocks(&inputs);
        self.outputs = blocks(&outputs);
        Ok(self)
    }

    /// Range of the input's or output's block of that name.
    ///
    /// # Panics
    /// When there is none.
    pub fn range(blocks: &[Block], name: &str) -> Range<usize> {
        blocks.iter().find(|block| block.name == name).expect("a block of that name").range.clone()
    }

    /// Name of the family.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Joints of the skeleton.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Frames a second that velocities and windows count in.
    pub fn fps(&self) -> f32 {
        self.fps
    }

    /// Units of length in a metre.
    pub fn units_per_metre(&self) -> f32 {
        self.units_per_metre
    }

    /// Seconds that velocities and rates count in: one, or the time of a frame.
    pub fn rate_time(&self) -> f32 {
        match self.rates {
            Rates::Second => 1.0,
            Rates::Frame => 1.0 / self.fps,
        }
    }

    /// What the yaw's rate is multiplied by to be positive to the character's left.
    pub fn yaw_sign(&self) -> f32 {
        match self.rates {
            Rates::Second => 1.0,
            Rates::Frame => -1.0,
        }
    }

    /// Blocks of the input vector, in order.
    pub fn inputs(&self) -> &[Block] {
        &self.inputs
    }

    /// Blocks of the output vector, in order.
    pub fn outputs(&self) -> &[Block] {
        &self.outputs
    }

    /// Length of the input vector.
    pub fn input_len(&self) -> usize {
        self.inputs.last().map_or(0, |block| block.range.end)
    }

    /// Length of the output vector.
    pub fn output_len(&self) -> usize {
        self.outputs.last().map_or(0, |block| block.range.end)
    }

    /// Fingerprint of everything above: FNV-1a, 64 bits, of the tables as text, in hexadecimal.
    pub fn hash(&self) -> String {
        let mut text = format!("{} {} {} ", self.name, self.fps, self.units_per_metre);
        for (side, blocks) in [("in", &self.inputs), ("out", &self.outputs)] {
            for block in blocks {
                text += &format!("{side} {} {}\n", block.name, block.range.len());
            }
        }
        let fnv = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        format!("{:016x}", text.bytes().fold(0xcbf2_9ce4_8422_2325, fnv))
    }

    /// Holds tables and fingerprint from elsewhere (a bundle) to this layout.
    ///
    /// # Errors
    /// The first block that differs, by name; else a fingerprint that differs.
    pub fn check(
        &self,
        inputs: &[(String, usize)],
        outputs: &[(String, usize)],
        hash: &str,
    ) -> Result<(), LayoutError> {
        let sides = [("input", &self.inputs, inputs), ("output", &self.outputs, outputs)];
        for (side, ours, theirs) in sides {
            for index in 0..ours.len().max(theirs.len()) {
                let table = |entry: Option<(&str, usize)>| {
                    entry.map_or("nothing".into(), |(name, size)| format!("{name} ({size})"))
                };
                let expected = table(ours.get(index).map(|b| (b.name, b.range.len())));
                let found = table(theirs.get(index).map(|(name, size)| (name.as_str(), *size)));
                if expected != found {
                    return Err(LayoutError::Block { side, index, expected, found });
                }
            }
        }
        match self.hash() {
            expected if expected != hash => Err(LayoutError::Hash { expected, found: hash.into() }),
            _ => Ok(()),
        }
    }
}

fn gait_block(gait: &str) -> &'static str {
    const BLOCKS: [&str; GAITS.len()] = [
        "gait_stand",
        "gait_walk",
        "gait_jog",
        "gait_run",
        "gait_crouch",
        "gait_jump",
        "gait_bump",
    ];
    BLOCKS[GAITS.iter().position(|name| *name == gait).expect("a gait")]
}

fn blocks(table: &[(&'static str, usize)]) -> Vec<Block> {
    let mut start = 0;
    let place = |&(name, size)| {
        let range = start..start + size;
        start = range.end;
        Block { name, range }
    };
    table.iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holden_is_the_published_layout() {
        let layout = Layout::holden(31).unwrap();
        assert_eq!((layout.input_len(), layout.output_len()), (342, 311));
        let starts = |blocks: &[Block]| blocks.iter().map(|b| b.range.start).collect::<Vec<_>>();
        assert_eq!(
            starts(layout.inputs()),
            [0, 12, 24, 36, 48, 60, 72, 84, 96, 108, 120, 213, 306, 318, 330]
        );
        assert_eq!(starts(layout.outputs()), [0, 2, 3, 4, 8, 14, 20, 26, 32, 125, 218]);
        let ava = Layout::holden(191).unwrap();
        assert_eq!((ava.input_len(), ava.output_len()), (1302, 1751));
    }

    #[test]
    fn ambulo_has_six_gaits_and_two_axes_a_joint() {
        let layout = Layout::ambulo(22).unwrap();
        assert_eq!((layout.input_len(), layout.output_len()), (288, 296));
        assert_eq!(Layout::range(layout.inputs(), "gait_run"), 84..96);
        assert_eq!(Layout::range(layout.outputs(), "joint_rotation"), 164..296);
        assert_eq!(layout.gaits.len(), 6);
    }

    /// Bundles in the world carry this fingerprint: if it changes, so must the format's version.
    #[test]
    fn the_fingerprint_is_golden() {
        assert_eq!(Layout::ambulo(22).unwrap().hash(), "28f8fdc6c7f8de4e");
        assert_eq!(Layout::holden(31).unwrap().hash(), "219ef9edb0527ecf");
        assert_ne!(Layout::holden(30).unwrap().hash(), Layout::holden(31).unwrap().hash());
    }

    #[test]
    fn names_the_first_block_that_differs() {
        let layout = Layout::holden(31).unwrap();
        let table = |blocks: &[Block]| {
            blocks.iter().map(|b| (b.name.to_owned(), b.range.len())).collect::<Vec<_>>()
        };
        let (inputs, outputs) = (table(layout.inputs()), table(layout.outputs()));
        layout.check(&inputs, &outputs, &layout.hash()).unwrap();
        let mut other = inputs.clone();
        other[10].1 = 66;
        let error = layout.check(&other, &outputs, &layout.hash()).unwrap_err().to_string();
        assert_eq!(
            error,
            "input block 10 is 'joint_position (66)', this version expects 'joint_position (93)'"
        );
        let error = layout.check(&inputs, &outputs[..10], &layout.hash()).unwrap_err().to_string();
        assert!(error.contains("output block 10 is 'nothing'"), "{error}");
        let error = layout.check(&inputs, &outputs, "beef").unwrap_err();
        assert!(matches!(error, LayoutError::Hash { .. }));
        assert!(Layout::holden(0).is_err() && Layout::named("mann", 3).is_err());
    }
}
