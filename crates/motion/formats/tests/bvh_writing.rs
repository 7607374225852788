//! What is written where nobody said how, and where what was said does not do.

use ambulo_formats::Positions;
use ambulo_formats::ReadOptions;
use ambulo_formats::bvh::{Channel, Dialect, WriteOptions, read, write};
use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Clip, Joint, Skeleton};

fn joint(name: &str, parent: Option<usize>, y: f64, tips: &[f64]) -> Joint {
    let tips = tips.iter().map(|&y| DVec3::new(0.0, y, 0.0)).collect();
    Joint { name: name.into(), parent, offset: DVec3::new(0.0, y, 0.0), tips }
}

/// Two arms on a body; the arms come first in the list of joints, the hands after both.
fn clip(rotations: &[DQuat]) -> Clip {
    let skeleton = Skeleton::new(vec![
        joint("body", None, 0.0, &[]),
        joint("arm 1", Some(0), 1.0, &[]),
        joint("arm:2", Some(0), -1.0, &[-0.5]),
        joint("hand", Some(1), 0.25, &[0.1, 0.2]),
    ])
    .unwrap();
    let frames = rotations.len() / 4;
    let places = (0..frames).map(|frame| DVec3::new(frame as f64, 2.0, -0.000_000_3));
    Clip::new(skeleton, 1.0 / 60.0, vec![0], places.collect(), rotations.to_vec()).unwrap()
}

fn still() -> Clip {
    clip(&[DQuat::IDENTITY; 8])
}

fn dialect(channels: [&[Channel]; 4]) -> WriteOptions {
    let names = ["body", "arm 1", "arm:2", "hand"];
    let joints = names.iter().zip(channels).map(|(name, list)| ((*name).into(), list.to_vec()));
    WriteOptions {
        dialect: Some(Dialect {
            joints: joints.collect(),
            frame_time: 1.0 / 60.0,
            frame_time_text: ".016667".into(),
            positions: Positions::Replace,
        }),
    }
}

fn written(clip: &Clip, options: &WriteOptions) -> (String, Vec<String>) {
    let written = write(clip, options);
    let notes = written.notes.iter().map(ToString::to_string).collect();
    (String::from_utf8(written.bytes).unwrap(), notes)
}

#[test]
fn the_usual_dialect() {
    let (text, notes) = written(&still(), &WriteOptions::default());
    assert_eq!(notes, [""; 0]);
    let expected = "\
HIERARCHY
ROOT body
{
\tOFFSET 0.000000 0.000000 0.000000
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
\tJOINT arm 1
\t{
\t\tOFFSET 0.000000 1.000000 0.000000
\t\tCHANNELS 3 Zrotation Yrotation Xrotation
\t\tJOINT hand
\t\t{
\t\t\tOFFSET 0.000000 0.250000 0.000000
\t\t\tCHANNELS 3 Zrotation Yrotation Xrotation
\t\t\tEnd Site
\t\t\t{
\t\t\t\tOFFSET 0.000000 0.100000 0.000000
\t\t\t}
\t\t\tEnd Site
\t\t\t{
\t\t\t\tOFFSET 0.000000 0.200000 0.000000
\t\t\t}
\t\t}
\t}
\tJOINT arm:2
\t{
\t\tOFFSET 0.000000 -1.000000 0.000000
\t\tCHANNELS 3 Zrotation Yrotation Xrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0.000000 -0.500000 0.000000
\t\t}
\t}
}
MOTION
Frames: 2
Frame Time: 0.01666666667
0.000000 2.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000
1.000000 2.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000
";
    assert_eq!(text, expected);
}

#[test]
fn a_dialect_is_kept_where_it_does() {
    use Channel::{Xposition, Xrotation, Yposition, Yrotation, Zposition};
    let root = [Xrotation, Zposition, Yposition, Xposition];
    let options = dialect([&root, &[], &[Yrotation], &[]]);
    let mut rotations = [DQuat::IDENTITY; 8];
    rotations[2] = DQuat::from_rotation_y(-1.0);
    rotations[4] = DQuat::from_rotation_x(3.0);
    let (text, notes) = written(&clip(&rotations), &options);
    assert_eq!(notes, [""; 0]);
    assert!(text.contains("\tCHANNELS 4 Xrotation Zposition Yposition Xposition\n"));
    assert!(text.contains("\t\t\tCHANNELS 0\n"));
    assert!(text.ends_with(
        "\nFrame Time: .016667\n\
         0.000000 0.000000 2.000000 0.000000 -57.295780\n\
         171.887339 0.000000 2.000000 1.000000 0.000000\n"
    ));
}

#[test]
fn a_joint_gets_the_channels_that_it_needs() {
    use Channel::{Xposition, Xrotation, Yrotation, Zrotation};
    let options = dialect([&[Xposition], &[Xrotation, Zrotation], &[Yrotation], &[]]);
    let mut rotations = [DQuat::IDENTITY; 8];
    // As two channels can have it; about another axis than the one channel; about any.
    rotations[5] = DQuat::from_rotation_x(1.0) * DQuat::from_rotation_z(2.0);
    rotations[6] = DQuat::from_rotation_x(0.5);
    rotations[7] = DQuat::from_rotation_z(0.5);
    let moved = clip(&rotations);
    let (text, notes) = written(&moved, &options);
    assert_eq!(
        notes,
        [
            "joint 'body' moves: it got three position channels",
            "joint 'hand' turns: it got three rotation channels",
            "joint 'arm:2' turns: it got three rotation channels",
        ]
    );
    assert!(text.contains("\tCHANNELS 3 Xposition Yposition Zposition\n"));
    assert!(text.contains("\t\tCHANNELS 2 Xrotation Zrotation\n"));
    assert!(text.contains("\t\tCHANNELS 3 Yrotation Zrotation Xrotation\n"));
    let again = read(text.as_bytes(), &ReadOptions::default()).unwrap().clip;
    // Depth first: body, arm 1, hand, arm:2.
    for (joint, at) in [(1, 5), (2, 7), (3, 6)] {
        let off = again.rotations(1)[joint].conjugate() * rotations[at];
        assert!(off.xyz().length() < 1e-7);
    }
}

#[test]
fn a_joint_that_leaves_its_offset_by_less_than_is_written_has_not_moved() {
    use Channel::{Xposition, Yposition};
    let options = dialect([&[Xposition, Yposition], &[], &[], &[]]);
    assert_eq!(written(&still(), &options).1, [""; 0], "0.0000003 units");
    let far = still().scaled(10.0);
    assert_eq!(written(&far, &options).1, ["joint 'body' moves: it got three position channels"]);
}

#[test]
fn a_leaf_without_an_end_gets_one() {
    let skeleton = Skeleton::new(vec![joint("a", None, 4.0, &[])]).unwrap();
    let clip = Clip::new(skeleton, 0.1, vec![], vec![], vec![DQuat::IDENTITY]).unwrap();
    let (text, notes) = written(&clip, &WriteOptions::default());
    assert_eq!(notes, ["bones of 1 leaves without an end are made up, as of 'a'"]);
    assert!(text.contains("\tEnd Site\n\t{\n\t\tOFFSET 0.000000 2.000000 0.000000\n\t}\n"));
}

#[test]
fn names_are_made_such_that_they_can_be_read() {
    let names = ["a{b", " a_b", "\n", "ok\ta", "}"];
    let joint = |(index, name): (usize, &&str)| joint(name, index.checked_sub(1), 1.0, &[1.0]);
    let skeleton = Skeleton::new(names.iter().enumerate().map(joint).collect()).unwrap();
    let clip = Clip::new(skeleton, 0.1, vec![], vec![], vec![DQuat::IDENTITY; 5]).unwrap();
    let (text, notes) = written(&clip, &WriteOptions::default());
    assert_eq!(
        notes,
        [
            "joint 'a{b' is written as 'a_b'",
            "joint ' a_b' is written as 'a_b_2'",
            "joint '\\n' is written as '_'",
            "joint 'ok\\ta' is written as 'ok_a'",
        ]
    );
    let again = read(text.as_bytes(), &ReadOptions::default()).unwrap();
    let read: Vec<_> = again.clip.skeleton().joints().iter().map(|j| j.name.as_str()).collect();
    assert_eq!(read, ["a_b", "a_b_2", "_", "ok_a", "}"]);
    assert_eq!(again.notes, []);
}

/// Found by a property test: frames without a number are empty lines, which nobody can count.
#[test]
fn a_motion_in_which_nothing_has_a_channel_gets_some() {
    let skeleton = Skeleton::new(vec![joint("body", None, 0.0, &[1.0])]).unwrap();
    let clip = Clip::new(skeleton, 0.1, vec![], vec![], vec![DQuat::IDENTITY; 2]).unwrap();
    let (text, notes) = written(&clip, &dialect([&[], &[], &[], &[]]));
    assert_eq!(notes, ["nothing moves: the root got channels nevertheless"]);
    assert_eq!(read(text.as_bytes(), &ReadOptions::default()).unwrap().clip.frames(), 2);
}

/// -180 and 180 degrees are one rotation; its text must not depend on how the last bit fell.
#[test]
fn half_a_turn_is_written_one_way() {
    let row = |text: &str| {
        let file = format!(
            "HIERARCHY ROOT a\n{{ OFFSET 0 0 0 CHANNELS 3 Zrotation Yrotation Xrotation \
             End Site {{ OFFSET 0 1 0 }} }}\nMOTION\nFrames: 1\nFrame Time: 1\n{text}\n"
        );
        let bvh = read(file.as_bytes(), &ReadOptions::default()).unwrap();
        let (text, _) = written(&bvh.clip, &WriteOptions { dialect: Some(bvh.dialect) });
        text.lines().last().unwrap().to_owned()
    };
    for text in ["180 0 0", "-180 0 0", "-180.0000001 0 0", "179.9999999 0 0", "540 0 0"] {
        assert_eq!(row(text), "180.000000 0.000000 0.000000", "{text}");
    }
    // Gimbal lock: the first takes what the third had.
    assert_eq!(row("10 90 30"), "-20.000000 90.000000 0.000000");
    assert_eq!(row("10 -90 30"), "40.000000 -90.000000 0.000000");
}
