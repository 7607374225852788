//! What a BVH file is refused for, with line and column, and what `repair` makes of it.

use ambulo_formats::ReadOptions;
use ambulo_formats::bvh::{Bvh, read};

const PLAIN: &str = "\
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 3 Zrotation Yrotation Xrotation
  End Site
  {
    OFFSET 0 1 0
  }
}
MOTION
Frames: 3
Frame Time: 0.05
1 2 3
4 5 6
7 8 9
";

fn refusal(text: &str) -> String {
    match read(text.as_bytes(), &ReadOptions::default()) {
        Ok(_) => panic!("this was not refused:\n{text}"),
        Err(error) => error.to_string(),
    }
}

fn refused(from: &str, to: &str, message: &str) {
    assert!(PLAIN.contains(from), "{from}");
    assert_eq!(refusal(&PLAIN.replacen(from, to, 1)), message);
}

fn mended(text: &str) -> (Bvh, String) {
    refusal(text);
    let options = ReadOptions { repair: true, ..ReadOptions::default() };
    let bvh = read(text.as_bytes(), &options).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let notes = bvh.notes.iter().map(|note| format!("{note}\n")).collect();
    (bvh, notes)
}

/// Not even repair reads this.
fn hopeless(text: &str) {
    let options = ReadOptions { repair: true, ..ReadOptions::default() };
    assert!(read(text.as_bytes(), &options).is_err(), "{text}");
}

#[test]
fn the_plain_file_is_not_refused() {
    assert!(read(PLAIN.as_bytes(), &ReadOptions::default()).is_ok());
}

#[test]
fn what_is_no_bvh_file() {
    assert_eq!(refusal(""), "line 1, column 1: expected HIERARCHY, found the end of the file");
    assert_eq!(refusal("\n{\"a\""), "line 2, column 1: expected HIERARCHY, found '{'");
    assert_eq!(refusal("\u{feff} RIFF"), "line 1, column 2: expected HIERARCHY, found 'RIFF'");
    hopeless("");
    hopeless("HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 1\n\n");
}

#[test]
fn errors_in_the_hierarchy() {
    refused("ROOT", "ROOTS", "line 2, column 1: expected ROOT, found 'ROOTS'");
    refused("ROOT Hips\n", "", "line 2, column 1: expected ROOT, found '{'");
    refused("Hips", "", "line 3, column 1: expected the joint's name, found '{'");
    refused("{\n  OFFSET", "OFFSET", "line 3, column 1: expected {, found 'OFFSET'");
    refused(
        "OFFSET 0 0 0",
        "",
        "line 10, column 1: expected OFFSET, found the end of joint 'Hips'",
    );
    refused(
        "OFFSET 0 0 0",
        "OFFSET 0 0",
        "line 5, column 3: expected three numbers after OFFSET, found 'CHANNELS'",
    );
    refused(
        "OFFSET 0 0 0",
        "OFFSET 0 0 0 7",
        "line 4, column 16: expected OFFSET, CHANNELS, JOINT, End Site or }, found '7'",
    );
    refused(
        "OFFSET 0 0 0",
        "OFFSET 0 nan 0",
        "line 4, column 12: expected three numbers after OFFSET, found 'nan'",
    );
    refused(
        "OFFSET 0 0 0",
        "OFFSET 0 0 0 OFFSET 1 1 1",
        "line 4, column 22: expected one OFFSET a joint, found a second one",
    );
    refused("OFFSET 0 1 0", "", "line 9, column 3: expected OFFSET, found '}'");
    refused(
        "}\nMOTION",
        "MOTION",
        "line 10, column 1: expected OFFSET, CHANNELS, JOINT, End Site or }, found 'MOTION'",
    );
    refused("}\nMOTION", "}}\nMOTION", "line 10, column 2: expected ROOT or MOTION, found '}'");
}

#[test]
fn errors_in_channels() {
    let list = "CHANNELS 3 Zrotation Yrotation Xrotation";
    refused(list, "", "line 10, column 1: expected CHANNELS, found the end of joint 'Hips'");
    let count = "expected a number of channels from 0 to 6";
    refused("CHANNELS 3", "CHANNELS", &format!("line 5, column 12: {count}, found 'Zrotation'"));
    refused("CHANNELS 3", "CHANNELS 7", &format!("line 5, column 12: {count}, found '7'"));
    refused("CHANNELS 3", "CHANNELS -1", &format!("line 5, column 12: {count}, found '-1'"));
    let some = |n: usize| {
        format!(
            "expected {n} different channels out of Xposition … Zposition, Xrotation … Zrotation"
        )
    };
    refused(" Xrotation", "", &format!("line 6, column 3: {}, found 'End'", some(3)));
    refused("Yrotation", "Yscale", &format!("line 5, column 24: {}, found 'Yscale'", some(3)));
    refused(
        "Yrotation",
        "Zrotation",
        &format!("line 5, column 24: {}, found 'Zrotation'", some(3)),
    );
    refused(
        "CHANNELS 3",
        "CHANNELS 2",
        "line 5, column 34: expected OFFSET, CHANNELS, JOINT, End Site or }, found 'Xrotation'",
    );
    refused(
        list,
        "CHANNELS 0",
        "line 11, column 7: expected at least one joint with channels, found none",
    );
    refused(
        "OFFSET 0 1 0",
        "OFFSET 0 1 0 CHANNELS 1 Xrotation",
        "line 8, column 27: expected no channels in an End Site, found '1'",
    );
}

#[test]
fn errors_in_the_frame_count_and_the_frame_time() {
    let frames = "expected a number of frames, at least 1";
    refused("Frames: 3\n", "", "line 12, column 1: expected Frames:, found 'Frame'");
    for wrong in ["0", "-3", "3.5", "many", "99999999999999999999999"] {
        let message = format!("line 12, column 9: {frames}, found '{wrong}'");
        refused("Frames: 3", &format!("Frames: {wrong}"), &message);
    }
    let time = "expected a frame time between 0.000001 and 1000000 seconds";
    refused("Frame Time: 0.05\n", "", "line 13, column 1: expected Frame Time:, found '1'");
    for wrong in ["0", "-0.05", "nan", "1e999", "1e-400", "1e-9", "1e9", "0,,5"] {
        let message = format!("line 13, column 13: {time}, found '{wrong}'");
        refused("Time: 0.05", &format!("Time: {wrong}"), &message);
    }
    refused("0.05", "0.05 s", "line 13, column 18: expected the end of the line, found 's'");
}

#[test]
fn errors_in_frames() {
    refused("4 5 6", "4 5", "line 15, column 4: expected 3 numbers in frame 2, found 2");
    refused("4 5 6", "4 5 6  7 8", "line 15, column 8: expected 3 numbers in frame 2, found 5");
    for wrong in ["nan", "-inf", "1e999", "-1e999", "x", "5.5.5", "0x5"] {
        let message = format!("line 15, column 3: expected a finite number, found '{wrong}'");
        refused("4 5 6", &format!("4 {wrong} 6"), &message);
    }
    refused(
        "4 5 6",
        "4 5 6 x",
        "line 15, column 7: expected a finite number or the end of the line, found 'x'",
    );
    refused(
        "Frames: 3",
        "Frames: 4",
        "line 17, column 1: expected 4 frames, as announced, found 3",
    );
    refused(
        "Frames: 3",
        "Frames: 1000000000",
        "line 17, column 1: expected 1000000000 frames, as announced, found 3",
    );
    refused(
        "Frames: 3",
        "Frames: 2",
        "line 16, column 1: expected the end of the file after 2 frames, as announced, found '7'",
    );
    refused(
        "1 2 3\n4 5 6\n7 8 9\n",
        "",
        "line 14, column 1: expected at least one frame, found none",
    );
    refused(
        "7 8 9\n",
        "7 8 9\n\nrubbish",
        "line 18, column 1: expected the end of the file after 3 frames, as announced, found 'rubbish'",
    );
}

#[test]
fn too_many_or_too_deeply_nested_joints() {
    let joints = |count: usize, close: bool| {
        let mut text = String::from("HIERARCHY\nROOT r {\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n");
        for n in 1..count {
            let end = if close { "}" } else { "" };
            text += &format!("JOINT j{n} {{ OFFSET 0 0 0 CHANNELS 1 Xrotation {end}\n");
        }
        text + &"}".repeat(if close { 1 } else { count })
            + "\nMOTION\nFrames: 1\nFrame Time: 1\n"
            + &"0 ".repeat(count)
    };
    let ok = |text: &str| read(text.as_bytes(), &ReadOptions::default()).is_ok();
    assert!(ok(&joints(10_000, true)));
    assert!(ok(&joints(1000, false)));
    assert!(refusal(&joints(10_001, true)).ends_with("expected at most 10000 joints, found more"));
    let deep = refusal(&joints(200_000, false));
    assert_eq!(deep, "line 1004, column 6: expected at most 1000 joints nested, found more");
}

#[test]
fn a_cut_file_is_mended_to_its_whole_frames() {
    let (bvh, notes) = mended(PLAIN.strip_suffix(" 9\n").unwrap());
    assert_eq!(bvh.clip.frames(), 2);
    assert_eq!(
        notes,
        "line 16: repaired: cut after frame 2; line 16, column 4: expected 3 numbers in frame 3, \
         found 2\nline 12: repaired: 3 frames were announced, 2 are here\n"
    );
    let (bvh, _) = mended(PLAIN.strip_suffix("7 8 9\n").unwrap());
    assert_eq!(bvh.clip.frames(), 2);
    let (bvh, notes) = mended(&PLAIN.replace("4 5 6", "4 nan 6"));
    assert_eq!(bvh.clip.frames(), 1);
    assert!(notes.contains("found 'nan'"), "{notes}");
    hopeless(&PLAIN.replace("1 2 3", "1 nan 3"));
}

#[test]
fn extra_numbers_and_frames_are_dropped_on_repair() {
    let (bvh, notes) = mended(&PLAIN.replace("4 5 6", "4 5 6 7 8"));
    assert_eq!(bvh.clip.frames(), 3);
    assert_eq!(notes, "line 15: repaired: 2 numbers too many were dropped\n");
    let (bvh, notes) = mended(&PLAIN.replace("Frames: 3", "Frames: 2"));
    assert_eq!(bvh.clip.frames(), 2);
    assert_eq!(notes, "line 16: repaired: what follows the 2 frames announced was dropped\n");
    let (bvh, notes) = mended(&format!("{PLAIN}rubbish"));
    assert_eq!(bvh.clip.frames(), 3);
    assert_eq!(notes, "line 17: repaired: what follows the 3 frames announced was dropped\n");
}

#[test]
fn missing_parts_are_mended_with_a_note_each() {
    for (from, to, note) in [
        ("Frames: 3\n", "", "line 12: repaired: the number of frames was missing\n"),
        ("Frames: 3", "Frames: x", "line 12: repaired: the number of frames was not one\n"),
        (
            "Frame Time: 0.05\n",
            "",
            "line 13: repaired: the frame time was missing; taken for 1/30 s\n",
        ),
        ("0.05", "-1", "line 13: repaired: the frame time was not one; taken for 1/30 s\n"),
        ("}\nMOTION", "MOTION", "line 10: repaired: closing braces were missing\n"),
        ("OFFSET 0 0 0", "", "line 2: repaired: joint 'Hips' had no OFFSET\n"),
        ("Hips", "", "line 2: repaired: a joint without a name is called 'joint'\n"),
    ] {
        let (bvh, notes) = mended(&PLAIN.replacen(from, to, 1));
        assert_eq!(bvh.clip.frames(), 3);
        assert_eq!(notes, note);
    }
    let joint = "JOINT a { OFFSET 1 1 1 }\n  End Site";
    let (bvh, notes) = mended(&PLAIN.replace("End Site", joint));
    assert_eq!(bvh.clip.skeleton().len(), 2);
    assert_eq!(notes, "line 6: repaired: joint 'a' had no CHANNELS\n");
}

#[test]
fn a_whole_file_is_read_alike_with_repair() {
    let options = ReadOptions { repair: true, ..ReadOptions::default() };
    let with = read(PLAIN.as_bytes(), &options).unwrap();
    assert_eq!(with, read(PLAIN.as_bytes(), &ReadOptions::default()).unwrap());
}

#[test]
fn joints_without_numbers_cannot_ask_for_any_memory() {
    // 9000 joints cost 288 kB a frame in memory, and in this file two bytes.
    let mut text = String::from("HIERARCHY\nROOT r {\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n");
    for n in 1..9000 {
        text += &format!("JOINT j{n} {{ OFFSET 0 0 0 CHANNELS 0 }}\n");
    }
    text += "}\nMOTION\nFrames: 100000\nFrame Time: 1\n";
    text += &"0\n".repeat(100_000);
    let refused = refusal(&text);
    assert!(
        refused.contains("frames of so many joints in so small a file, found more"),
        "{refused}"
    );
}
