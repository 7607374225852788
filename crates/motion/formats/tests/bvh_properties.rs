//! Reading and writing BVH, for any skeleton, any channels and any motion.

use std::fmt::Write;

use ambulo_formats::bvh::{Bvh, Channel, WriteOptions, read, write};
use ambulo_formats::{Positions, ReadOptions};
use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Clip, Joint, Skeleton};
use proptest::prelude::*;

#[derive(Clone, Debug)]
struct RandomJoint {
    /// Picks the parent out of the joints before.
    parent: prop::sample::Index,
    offset: [f64; 3],
    tips: Vec<[f64; 3]>,
    channels: Vec<Channel>,
}

#[derive(Clone, Debug)]
struct File {
    joints: Vec<RandomJoint>,
    frame_time: f64,
    /// Taken in turn for every channel of every frame.
    angles: Vec<f64>,
    lengths: Vec<f64>,
    frames: usize,
}

/// Angles where extraction is delicate, and any others.
fn angle() -> impl Strategy<Value = f64> {
    let seam = prop::sample::select(vec![0.0, 90.0, -90.0, 180.0, -180.0, 270.0, 360.0, -360.0]);
    prop_oneof![
        seam.clone(),
        (seam, -80..80_i32).prop_map(|(seam, steps)| seam + f64::from(steps) * 1e-6),
        -400.0..400.0,
    ]
}

fn length() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(-0.0), Just(-4e-7), -500.0..500.0, Just(123_456_789.25)]
}

fn joint() -> impl Strategy<Value = RandomJoint> {
    let three = || [length(), length(), length()];
    let channels = (Just(Channel::ALL.to_vec()).prop_shuffle(), 0..=6_usize)
        .prop_map(|(all, count)| all[..count].to_vec());
    let far = Just([1e9, -123_456_789_012.5, 1e300]);
    let tips = prop::collection::vec(prop_oneof![three(), far], 0..3);
    (any::<prop::sample::Index>(), three(), tips, channels)
        .prop_map(|(parent, offset, tips, channels)| RandomJoint { parent, offset, tips, channels })
}

fn file() -> impl Strategy<Value = File> {
    let numbers = (prop::collection::vec(angle(), 1..40), prop::collection::vec(length(), 1..40));
    let frame_time = prop_oneof![Just(1.0 / 30.0), Just(0.008333), 1e-4..2.0];
    (prop::collection::vec(joint(), 1..9), frame_time, numbers, 1..5_usize)
        .prop_filter("some channel", |(joints, ..)| joints.iter().any(|j| !j.channels.is_empty()))
        .prop_map(|(joints, frame_time, (angles, lengths), frames)| File {
            joints,
            frame_time,
            angles,
            lengths,
            frames,
        })
}

impl File {
    fn parent(&self, joint: usize) -> Option<usize> {
        (joint > 0).then(|| self.joints[joint].parent.index(joint))
    }

    /// The number of a channel; the same whatever is asked before.
    fn number(&self, frame: usize, joint: usize, channel: Channel) -> f64 {
        let at = (frame * 31 + joint) * 6 + channel as usize;
        let list = if channel.is_rotation() { &self.angles } else { &self.lengths };
        list[at % list.len()]
    }

    /// Joint after joint, children within.
    fn order(&self) -> Vec<usize> {
        let (mut order, mut waiting) = (vec![], vec![0]);
        while let Some(joint) = waiting.pop() {
            order.push(joint);
            waiting
                .extend((joint + 1..self.joints.len()).filter(|&j| self.parent(j) == Some(joint)));
        }
        order
    }

    fn text(&self) -> String {
        let mut text = String::from("HIERARCHY\n");
        let mut open: Vec<usize> = vec![];
        let three = |v: [f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
        for index in self.order() {
            while open.last().copied() != self.parent(index) {
                open.pop();
                text += "}\n";
            }
            open.push(index);
            let joint = &self.joints[index];
            let word = if index == 0 { "ROOT" } else { "JOINT" };
            let channels: Vec<_> = joint.channels.iter().map(|c| c.name()).collect();
            write!(text, "{word} j{index}\n{{\nOFFSET {}\n", three(joint.offset)).unwrap();
            writeln!(text, "CHANNELS {} {}", channels.len(), channels.join(" ")).unwrap();
            for &tip in &joint.tips {
                write!(text, "End Site\n{{\nOFFSET {}\n}}\n", three(tip)).unwrap();
            }
        }
        text += &"}\n".repeat(open.len());
        writeln!(text, "MOTION\nFrames: {}\nFrame Time: {}", self.frames, self.frame_time).unwrap();
        for frame in 0..self.frames {
            for joint in self.order() {
                for &channel in &self.joints[joint].channels {
                    write!(text, "{} ", self.number(frame, joint, channel)).unwrap();
                }
            }
            text.push('\n');
        }
        text
    }

    /// What the format says the rotation is, by other means than the reader's.
    fn rotation(&self, frame: usize, joint: usize) -> DQuat {
        let turns = self.joints[joint].channels.iter().filter(|channel| channel.is_rotation());
        turns.fold(DQuat::IDENTITY, |rotation, &channel| {
            let axis = DVec3::AXES[channel.axis()];
            rotation * DQuat::from_axis_angle(axis, self.number(frame, joint, channel).to_radians())
        })
    }

    fn translation(&self, frame: usize, joint: usize, positions: Positions) -> DVec3 {
        let mut place = DVec3::from_array(self.joints[joint].offset);
        for &channel in self.joints[joint].channels.iter().filter(|channel| !channel.is_rotation())
        {
            let number = self.number(frame, joint, channel);
            match positions {
                Positions::Replace => place[channel.axis()] = number,
                Positions::Add => place[channel.axis()] += number,
            }
        }
        place
    }
}

fn degrees_apart(a: DQuat, b: DQuat) -> f64 {
    let between = a.conjugate() * b;
    (2.0 * between.xyz().length().atan2(between.w.abs())).to_degrees()
}

/// A length after writing: rounded once to six decimals, or to a double's precision.
fn written_alike(a: DVec3, b: DVec3) -> bool {
    a.abs_diff_eq(b, 5.5e-7 + 1e-14 * a.abs().max_element())
}

fn translation(clip: &Clip, frame: usize, joint: usize) -> DVec3 {
    match clip.moving().binary_search(&joint) {
        Ok(at) => clip.translations(frame)[at],
        Err(_) => clip.skeleton().joints()[joint].offset,
    }
}

/// Same joints and motion, joints matched by name.
fn assert_alike(a: &Clip, b: &Clip) -> Result<(), TestCaseError> {
    prop_assert_eq!(a.frames(), b.frames());
    prop_assert_eq!(a.skeleton().len(), b.skeleton().len());
    for (i, joint) in a.skeleton().joints().iter().enumerate() {
        let j = b.skeleton().find(&joint.name).expect("the name is kept");
        let other = &b.skeleton().joints()[j];
        let parent = |clip: &Clip, joint: &Joint| {
            joint.parent.map(|parent| clip.skeleton().joints()[parent].name.clone())
        };
        prop_assert_eq!(parent(a, joint), parent(b, other));
        prop_assert!(written_alike(joint.offset, other.offset));
        for (tip, other) in joint.tips.iter().zip(&other.tips) {
            prop_assert!(written_alike(*tip, *other));
        }
        for frame in 0..a.frames() {
            let off = degrees_apart(a.rotations(frame)[i], b.rotations(frame)[j]);
            prop_assert!(off < 1e-4, "joint {}, frame {}: {} degrees off", i, frame, off);
            let (from, to) = (translation(a, frame, i), translation(b, frame, j));
            prop_assert!(written_alike(from, to), "joint {i}, frame {frame}: {from} is not {to}");
        }
    }
    Ok(())
}

/// Writes, reads and writes again.
fn assert_round_trip(
    clip: &Clip,
    options: &WriteOptions,
    read_options: &ReadOptions,
) -> Result<(), TestCaseError> {
    let written = write(clip, options);
    let text = || String::from_utf8_lossy(&written.bytes).into_owned();
    prop_assert!(!text().contains("-0.000000"), "{}", text());
    let again = read(&written.bytes, read_options);
    let again = again.map_err(|error| TestCaseError::fail(format!("{error}\n{}", text())))?;
    prop_assert_eq!(&again.notes, &[]);
    assert_alike(clip, &again.clip)?;
    let second = write(&again.clip, &WriteOptions { dialect: Some(again.dialect) });
    prop_assert_eq!(String::from_utf8_lossy(&second.bytes), text());
    prop_assert_eq!(&second.notes, &[]);
    Ok(())
}

/// Any clip, not only one that a file can hold.
fn clip() -> impl Strategy<Value = Clip> {
    (file(), prop::collection::vec(prop::bool::ANY, 9)).prop_map(|(file, moves)| {
        let count = file.joints.len();
        let joint = |index: usize| Joint {
            name: format!("j{index}"),
            parent: file.parent(index),
            offset: DVec3::from_array(file.joints[index].offset),
            tips: file.joints[index].tips.iter().map(|&tip| DVec3::from_array(tip)).collect(),
        };
        let skeleton = Skeleton::new((0..count).map(joint).collect()).unwrap();
        let moving: Vec<_> = (0..count).filter(|&joint| moves[joint]).collect();
        let number = |frame, joint, n: usize| file.number(frame, joint, Channel::ALL[n]);
        let (mut rotations, mut translations) = (vec![], vec![]);
        for frame in 0..file.frames {
            for joint in 0..count {
                let turn = |n: usize| {
                    let angle = number(frame, joint, 3 + n).to_radians();
                    DQuat::from_axis_angle(DVec3::AXES[n], angle)
                };
                rotations.push(turn(0) * turn(1) * turn(2));
            }
            let place =
                |&joint: &usize| DVec3::from_array([0, 1, 2].map(|n| number(frame, joint, n)));
            translations.extend(moving.iter().map(place));
        }
        Clip::new(skeleton, file.frame_time, moving, translations, rotations).unwrap()
    })
}

/// What is done to the bytes of a file: where, and the bytes put there instead of a few.
type Mutation = (prop::sample::Index, usize, Vec<u8>);

fn mutation() -> impl Strategy<Value = Mutation> {
    let text = prop::sample::select(vec![
        "{",
        "}",
        "\n",
        "\r",
        " ",
        "-",
        "1e999",
        "nan",
        ",",
        "JOINT",
        "End",
        "MOTION",
        "OFFSET",
        "CHANNELS 6",
        "Frames: 9",
        "0",
        "\u{feff}",
        "ROOT a",
    ]);
    let bytes = prop_oneof![
        text.prop_map(|text| text.as_bytes().to_vec()),
        prop::collection::vec(any::<u8>(), 0..4),
    ];
    (any::<prop::sample::Index>(), 0..8_usize, bytes)
}

/// Whatever could be read can be written, and read again as it is.
fn assert_no_harm(bytes: &[u8]) -> Result<(), TestCaseError> {
    for repair in [false, true] {
        for positions in [Positions::Replace, Positions::Add] {
            let options = ReadOptions { repair, positions, ..ReadOptions::default() };
            if let Ok(Bvh { clip, dialect, .. }) = read(bytes, &options) {
                let write_options = WriteOptions { dialect: Some(dialect) };
                // A sum with an offset of any size may have no room for six decimals.
                match positions {
                    Positions::Replace => assert_round_trip(&clip, &write_options, &options)?,
                    Positions::Add => drop(write(&clip, &write_options)),
                }
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn files_mean_what_the_format_says(file in file(), add in prop::bool::ANY) {
        let positions = if add { Positions::Add } else { Positions::Replace };
        let options = ReadOptions { positions, ..ReadOptions::default() };
        let text = file.text();
        let bvh = read(text.as_bytes(), &options).map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
        prop_assert_eq!(&bvh.notes, &[]);
        for (at, &joint) in file.order().iter().enumerate() {
            for frame in 0..file.frames {
                let off = degrees_apart(bvh.clip.rotations(frame)[at], file.rotation(frame, joint));
                prop_assert!(off < 1e-9, "{off} degrees off");
                let expected = file.translation(frame, joint, positions);
                prop_assert_eq!(translation(&bvh.clip, frame, at), expected);
            }
        }
        assert_round_trip(&bvh.clip, &WriteOptions { dialect: Some(bvh.dialect) }, &options)?;
    }

    #[test]
    fn any_clip_survives_the_usual_dialect(clip in clip()) {
        assert_round_trip(&clip, &WriteOptions::default(), &ReadOptions::default())?;
    }

    /// Channels of one file, motion of another: what they cannot hold gets more of them.
    #[test]
    fn any_clip_survives_any_dialect(clip in clip(), file in file(), add in prop::bool::ANY) {
        let positions = if add { Positions::Add } else { Positions::Replace };
        let options = ReadOptions { positions, ..ReadOptions::default() };
        let dialect = read(file.text().as_bytes(), &options).unwrap().dialect;
        assert_round_trip(&clip, &WriteOptions { dialect: Some(dialect) }, &options)?;
    }

    #[test]
    fn arbitrary_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        assert_no_harm(&bytes)?;
    }

    #[test]
    fn damaged_files_do_no_harm(
        file in file(), mutations in prop::collection::vec(mutation(), 1..4),
    ) {
        let mut bytes = file.text().into_bytes();
        for (at, count, instead) in mutations {
            let start = at.index(bytes.len() + 1);
            let end = (start + count).min(bytes.len());
            bytes.splice(start..end, instead);
        }
        assert_no_harm(&bytes)?;
    }

    #[test]
    fn cut_files_do_no_harm(file in file(), end in any::<prop::sample::Index>()) {
        let text = file.text();
        assert_no_harm(&text.as_bytes()[..end.index(text.len())])?;
    }
}
