//! Every quirk of a BVH file that the reader promises to understand.

use ambulo_formats::bvh::{Bvh, Channel, WriteOptions, read, write};
use ambulo_formats::{Positions, ReadOptions};
use ambulo_rig::glam::{DQuat, DVec3};

const PLAIN: &str = "\
HIERARCHY
ROOT Hips
{
\tOFFSET 0.0 1.0 0.0
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
\tJOINT Knee
\t{
\t\tOFFSET 0.0 -0.5 0.0
\t\tCHANNELS 3 Zrotation Yrotation Xrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0.0 -0.4 0.1
\t\t}
\t}
}
MOTION
Frames: 2
Frame Time: 0.008333
1.0 2.0 3.0 10 20 30 0 0 0.0083
1.5 2.0 -7.5 10 20 30 0 0 1e-5
";

fn bvh(text: &str) -> Bvh {
    read(text.as_bytes(), &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Reads as the plain file does, and says nothing.
fn same(text: &str) {
    let (plain, other) = (bvh(PLAIN), bvh(text));
    assert_eq!(other.clip, plain.clip, "{text}");
    assert_eq!(other.notes, [], "{text}");
}

fn notes(bvh: &Bvh) -> String {
    bvh.notes.iter().map(|note| format!("{note}\n")).collect()
}

fn close(a: DQuat, b: DQuat) -> bool {
    (a.conjugate() * b).xyz().length() < 1e-12
}

fn turn(x: f64, y: f64, z: f64) -> [DQuat; 3] {
    [
        DQuat::from_rotation_x(x.to_radians()),
        DQuat::from_rotation_y(y.to_radians()),
        DQuat::from_rotation_z(z.to_radians()),
    ]
}

#[test]
fn the_plain_file() {
    let Bvh { clip, dialect, notes } = bvh(PLAIN);
    assert_eq!(notes, []);
    assert_eq!(clip.frames(), 2);
    assert_eq!(clip.fps(), 120.0);
    assert_eq!(clip.moving(), [0]);
    assert_eq!(clip.translations(1), [DVec3::new(1.5, 2.0, -7.5)], "the offset is replaced");
    let [x, y, z] = turn(30.0, 20.0, 10.0);
    assert!(close(clip.rotations(0)[0], z * y * x));
    let joints = clip.skeleton().joints();
    assert_eq!((joints[1].name.as_str(), joints[1].parent), ("Knee", Some(0)));
    assert_eq!(joints[1].offset, DVec3::new(0.0, -0.5, 0.0));
    assert_eq!(joints[1].tips, [DVec3::new(0.0, -0.4, 0.1)]);
    assert_eq!(dialect.frame_time_text, "0.008333");
    assert_eq!(dialect.joints[1].1, [Channel::Zrotation, Channel::Yrotation, Channel::Xrotation]);
}

#[test]
fn line_ends_blanks_and_indents_do_not_matter() {
    same(&PLAIN.replace('\n', "\r\n"));
    same(&PLAIN.replace('\n', "\r"));
    // Half of the lines one way, half the other.
    let mixed: String =
        PLAIN.lines().enumerate().map(|(n, l)| format!("{l}{}", ["\n", "\r\n"][n % 2])).collect();
    same(&mixed);
    same(&PLAIN.replace('\t', " "));
    same(&PLAIN.replace('\t', ""));
    same(&PLAIN.replace(' ', "  \t "));
    same(&PLAIN.replace('\n', " \n"));
    same(&PLAIN.replace('\n', "\n\n"));
    same(PLAIN.trim_end());
    same(&format!("{PLAIN}\n \r\n\t"));
    same(&format!("\u{feff}{PLAIN}"));
    same(&format!("\n\n{PLAIN}"));
}

#[test]
fn braces_may_stand_on_the_line_of_the_name() {
    same(&PLAIN.replace("\n{", " {").replace("\n\t{", "{").replace("\n\t\t{", " {"));
    same(&PLAIN.replace("0.1\n\t\t}\n\t}\n}", "0.1 }}}"));
}

#[test]
fn labels_and_keywords_in_every_spelling() {
    for label in ["Frames :", "Frames:\t", "Frames\t:  ", "FRAMES:", "frames:"] {
        same(&PLAIN.replace("Frames: ", label));
    }
    for label in ["Frame Time :", "Frame Time:\t", "FrameTime:", "FRAME  TIME:", "frame time:"] {
        same(&PLAIN.replace("Frame Time: ", label));
    }
    for word in ["HIERARCHY", "ROOT", "OFFSET", "CHANNELS", "JOINT", "End Site", "MOTION"] {
        same(&PLAIN.replace(word, &word.to_lowercase()));
    }
    same(&PLAIN.replace("Xrotation", "XROTATION").replace("Yposition", "yposition"));
    same(&PLAIN.replace("End Site", "End"));
    same(&PLAIN.replace("End Site", "End Site ankle"));
    same(&PLAIN.replace("-0.4 0.1\n", "-0.4 0.1\n\t\t\tCHANNELS 0\n"));
    same(
        &PLAIN
            .replace("\tOFFSET 0.0 1.0 0.0\n", "")
            .replace("\tJOINT Knee", "\tOFFSET 0.0 1.0 0.0\n\tJOINT Knee"),
    );
}

#[test]
fn numbers_in_every_spelling() {
    same(&PLAIN.replace("0.0083\n", ".0083\n").replace("0.0 -0.5 0.0", "-0 -.5 0."));
    same(&PLAIN.replace("1.0 2.0 3.0", "1 +2.0 30e-1").replace("1e-5", "0.00001"));
}

#[test]
fn numbers_may_be_glued_together_by_their_signs() {
    let glued = bvh(&PLAIN.replace("2.0 -7.5", "2.0-7.5"));
    assert_eq!(glued.clip, bvh(PLAIN).clip);
    assert_eq!(notes(&glued), "line 20: numbers without a blank between them\n");
    same(&PLAIN.replace("0.0 -0.5 0.0", "0.0-0.5 0.0"));
}

#[test]
fn frame_times_are_snapped_and_their_text_is_kept() {
    for (text, rate) in [(".0083333", 120.0), ("0.016667", 60.0), ("0.0333333", 30.0)] {
        let read = bvh(&PLAIN.replace("0.008333", text));
        assert_eq!(read.clip.frame_time(), 1.0 / rate);
        let options = WriteOptions { dialect: Some(read.dialect) };
        let written = String::from_utf8(write(&read.clip, &options).bytes).unwrap();
        assert!(written.contains(&format!("Frame Time: {text}\n")));
        let halved = read.clip.resampled(rate / 2.0).unwrap();
        let written = String::from_utf8(write(&halved, &options).bytes).unwrap();
        assert!(!written.contains(text), "another rate is not written with the old text");
    }
    assert_eq!(bvh(&PLAIN.replace("0.008333", "0.0084")).clip.frame_time(), 0.0084);
}

#[test]
fn rotations_compose_in_the_order_of_each_joint() {
    let text = PLAIN
        .replace("Zrotation Yrotation Xrotation\n\tJOINT", "Yrotation Xrotation Zrotation\n\tJOINT")
        .replace("30 0 0 0.0083", "30 40 50 60");
    let clip = bvh(&text).clip;
    let [x, y, z] = turn(20.0, 10.0, 30.0);
    assert!(close(clip.rotations(0)[0], y * x * z));
    let [x, y, z] = turn(60.0, 50.0, 40.0);
    assert!(close(clip.rotations(0)[1], z * y * x));
}

#[test]
fn rotation_channels_may_come_first_or_in_between() {
    let first = PLAIN
        .replace(
            "Xposition Yposition Zposition Zrotation Yrotation Xrotation",
            "Zrotation Yrotation Xrotation Xposition Yposition Zposition",
        )
        .replace("1.0 2.0 3.0 10 20 30", "10 20 30 1.0 2.0 3.0")
        .replace("1.5 2.0 -7.5 10 20 30", "10 20 30 1.5 2.0 -7.5");
    same(&first);
    let between = PLAIN
        .replace(
            "Xposition Yposition Zposition Zrotation Yrotation Xrotation",
            "Zposition Zrotation Xposition Yrotation Yposition Xrotation",
        )
        .replace("1.0 2.0 3.0 10 20 30", "3.0 10 1.0 20 2.0 30")
        .replace("1.5 2.0 -7.5 10 20 30", "-7.5 10 1.5 20 2.0 30");
    same(&between);
}

#[test]
fn positions_replace_the_offset_or_are_added() {
    let options = ReadOptions { positions: Positions::Add, ..ReadOptions::default() };
    let read = read(PLAIN.as_bytes(), &options).unwrap();
    assert_eq!(read.clip.translations(0), [DVec3::new(1.0, 3.0, 3.0)]);
    let written = write(&read.clip, &WriteOptions { dialect: Some(read.dialect) });
    let text = String::from_utf8(written.bytes).unwrap();
    assert!(text.contains("\n1.000000 2.000000 3.000000 10.000000"), "what is added is written");
    // With one channel the other axes keep the offset.
    let one = PLAIN
        .replace("6 Xposition Yposition Zposition", "4 Xposition")
        .replace("1.0 2.0 3.0", "1.0")
        .replace("1.5 2.0 -7.5", "1.5");
    assert_eq!(bvh(&one).clip.translations(1), [DVec3::new(1.5, 1.0, 0.0)]);
}

#[test]
fn joints_may_have_any_number_of_channels() {
    let text = PLAIN
        .replace("CHANNELS 3 Zrotation Yrotation Xrotation", "CHANNELS 0")
        .replace(" 0 0 0.0083", "")
        .replace(" 0 0 1e-5", "");
    let read = bvh(&text);
    assert_eq!(read.clip.rotations(0)[1], DQuat::IDENTITY);
    assert_eq!(read.dialect.joints[1].1, []);
    let written = write(&read.clip, &WriteOptions { dialect: Some(read.dialect) });
    assert!(String::from_utf8(written.bytes).unwrap().contains("CHANNELS 0\n"));
}

#[test]
fn names_with_end_blanks_and_colons() {
    for name in ["End", "EndSite", "mixamorig:Left Leg", "a  b", "JOINT", "}", "Knie_äöü"] {
        let read = bvh(&PLAIN.replace("Knee", name));
        assert_eq!(read.clip.skeleton().joints()[1].name, name);
        let written = write(&read.clip, &WriteOptions { dialect: Some(read.dialect) });
        assert_eq!(written.notes, []);
        let text = String::from_utf8(written.bytes).unwrap();
        assert_eq!(bvh(&text).clip.skeleton(), read.clip.skeleton());
    }
}

#[test]
fn a_name_that_is_not_text_is_read_with_a_note() {
    for (byte, instead) in [(0xE4, '\u{fffd}'), (0x07, '_'), (b'\t', '_')] {
        let mut bytes = PLAIN.as_bytes().to_vec();
        bytes[PLAIN.find("nee").unwrap()] = byte;
        let read = read(&bytes, &ReadOptions::default()).unwrap();
        let name = format!("K{instead}ee");
        assert_eq!(read.clip.skeleton().joints()[1].name, name);
        let note = format!("line 6: a name that is not plain UTF-8 text is read as '{name}'\n");
        assert_eq!(notes(&read), note);
    }
}

#[test]
fn a_second_joint_of_a_name_gets_another() {
    let read = bvh(&PLAIN.replace("Knee", "Hips"));
    assert_eq!(read.clip.skeleton().joints()[1].name, "Hips_2");
    assert_eq!(notes(&read), "line 6: the name 'Hips' occurs twice: now 'Hips_2'\n");
}

#[test]
fn several_roots_are_put_under_one() {
    let second = "ROOT Prop\n{\nOFFSET 1 2 3\nCHANNELS 1 Yrotation\n}\nMOTION";
    let text = PLAIN
        .replace("MOTION", second)
        .replace("0.0083\n", "0.0083 90\n")
        .replace("1e-5\n", "1e-5 90\n");
    let read = bvh(&text);
    assert_eq!(notes(&read), "2 roots were put under one that is called 'root'\n");
    let joints = read.clip.skeleton().joints();
    let parents: Vec<_> = joints.iter().map(|j| (j.name.as_str(), j.parent)).collect();
    assert_eq!(parents, [("root", None), ("Hips", Some(0)), ("Knee", Some(1)), ("Prop", Some(0))]);
    assert!(close(read.clip.rotations(0)[3], turn(0.0, 90.0, 0.0)[1]));
    let written = write(&read.clip, &WriteOptions { dialect: Some(read.dialect) });
    let text = String::from_utf8(written.bytes).unwrap();
    let six = "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation";
    let start = format!("HIERARCHY\nROOT root\n{{\n\tOFFSET 0.000000 0.000000 0.000000\n\t{six}\n");
    assert!(text.starts_with(&start), "a root that any program can move: {text}");
    let again = bvh(&text);
    assert_eq!(again.notes, []);
    assert_eq!(again.clip.skeleton().find("Prop"), Some(3));
}

#[test]
fn the_root_above_several_has_a_name_of_its_own() {
    let root = |name: &str| format!("ROOT {name} {{ OFFSET 0 0 0 CHANNELS 1 Xrotation }}\n");
    let roots = root("root") + &root("root_");
    let read = bvh(&format!("HIERARCHY\n{roots}MOTION\nFrames: 1\nFrame Time: 1\n0 0\n"));
    let names: Vec<_> = read.clip.skeleton().joints().iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["root__", "root", "root_"]);
}

#[test]
fn decimal_commas_are_read_only_where_nothing_else_works_and_with_a_note() {
    let read = bvh(&PLAIN.replace('.', ","));
    assert_eq!(read.clip, bvh(PLAIN).clip);
    assert_eq!(notes(&read), "numbers are written with a decimal comma\n");
    // A comma that follows no digit is not one of them.
    let named = bvh(&PLAIN.replace('.', ",").replace("Knee", "Knee, left"));
    assert_eq!(named.clip.skeleton().joints()[1].name, "Knee, left");
    // A comma in a name is no reason to look for more of them.
    let named = bvh(&PLAIN.replace("Knee", "Knee1,5"));
    assert_eq!(named.clip.skeleton().joints()[1].name, "Knee1,5");
    assert_eq!(named.notes, []);
}

#[test]
fn commas_that_separate_are_told_from_decimal_ones_by_counting() {
    let text = PLAIN
        .replace("1.0 2.0 3.0 10 20 30 0 0 0.0083", "1,2,3,10,20,30,0,0,0.0083")
        .replace("1.5 2.0 -7.5", "1.5, 2.0, -7.5");
    let read = bvh(&text);
    assert_eq!(read.clip, bvh(PLAIN).clip);
    assert_eq!(notes(&read), "numbers are separated by commas\n");
}
