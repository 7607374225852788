//! ASF and AMC: what they mean, and what they are refused for.

use ambulo_formats::ReadOptions;
use ambulo_formats::amc::{Amc, Asf, read};
use ambulo_rig::glam::{DQuat, DVec3};

const ASF: &str = "\
# a comment
:version 1.10
:name TEST
:units
  mass 1.0
  length 0.5
  angle deg
:documentation
   anything: goes
   begin here
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 1 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name thigh
     direction 0 -1 0
     length 4
     axis 0 0 90  XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
     id 2
     name shin
     direction 0 -1 0
     length 3
     axis 10 20 30 XYZ
    dof rx rz
  end
  begin
     id 3
     name toe
     direction 0 0 1
     length 1
     axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root thigh
    thigh shin
    shin toe
  end
";

const AMC: &str = "\
#!OML:ASF made up
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 10 20 30
thigh 40 0 0
shin 5 6
2
root 1 2 3.5 10 20 30
thigh -40 1 2
shin 5 6
";

fn skeleton() -> Asf {
    Asf::read(ASF.as_bytes()).unwrap()
}

fn amc(text: &str) -> Amc {
    read(&skeleton(), text.as_bytes(), &ReadOptions::default()).unwrap()
}

fn notes(amc: &Amc) -> String {
    amc.notes.iter().map(|note| format!("{note}\n")).collect()
}

fn turn(axis: DVec3, degrees: f64) -> DQuat {
    DQuat::from_axis_angle(axis, degrees.to_radians())
}

fn assert_close(a: DQuat, b: DQuat) {
    assert!((a.conjugate() * b).xyz().length() < 1e-12, "{a} is not {b}");
}

#[test]
fn a_joint_sits_where_its_parents_bone_ends_and_lengths_are_inches() {
    let asf = skeleton();
    let joints = asf.skeleton().joints();
    let list: Vec<_> = joints.iter().map(|j| (j.name.as_str(), j.parent, j.offset)).collect();
    assert_eq!(
        list,
        [
            ("root", None, DVec3::new(0.0, 2.0, 0.0)),
            ("thigh", Some(0), DVec3::ZERO),
            ("shin", Some(1), DVec3::new(0.0, -8.0, 0.0)),
            ("toe", Some(2), DVec3::new(0.0, -6.0, 0.0)),
        ]
    );
    assert_eq!(joints[3].tips, [DVec3::new(0.0, 0.0, 2.0)]);
    assert_eq!(amc(AMC).metres_per_unit, Some(0.0254));
    let unitless = Asf::read(ASF.replace("  length 0.5\n", "").as_bytes()).unwrap();
    assert_eq!(unitless.skeleton().joints()[2].offset, DVec3::new(0.0, -4.0, 0.0));
    let read = read(&unitless, AMC.as_bytes(), &ReadOptions::default()).unwrap();
    assert_eq!(read.metres_per_unit, None);
}

#[test]
fn a_bone_turns_about_its_own_axes_the_first_named_first() {
    let clip = amc(AMC).clip;
    assert_eq!(clip.frames(), 2);
    assert_eq!(clip.moving(), [0]);
    // The root's position is added; both in inches.
    assert_eq!(clip.translations(1), [DVec3::new(2.0, 6.0, 7.0)]);
    let root = turn(DVec3::Z, 30.0) * turn(DVec3::Y, 20.0) * turn(DVec3::X, 10.0);
    assert_close(clip.rotations(0)[0], root);
    // About the thigh's X, which its axis of 90 degrees about Z has turned to the world's Y.
    assert_close(clip.rotations(0)[1], turn(DVec3::Y, 40.0));
    let c = turn(DVec3::Z, 30.0) * turn(DVec3::Y, 20.0) * turn(DVec3::X, 10.0);
    let m = turn(DVec3::Z, 6.0) * turn(DVec3::X, 5.0);
    assert_close(clip.rotations(0)[2], c * m * c.inverse());
    assert_eq!(clip.rotations(0)[3], DQuat::IDENTITY, "no degrees of freedom");
}

#[test]
fn the_roots_order_names_its_numbers_and_its_axis_turns() {
    let other = ASF
        .replace("order TX TY TZ RX RY RZ", "order RZ RY RX TZ TY TX")
        .replace("axis XYZ\n", "axis ZYX\n");
    let asf = Asf::read(other.as_bytes()).unwrap();
    let text = AMC.replace("root 1 2 3 10 20 30", "root 30 20 10 3 2 1");
    let clip = read(&asf, text.as_bytes(), &ReadOptions::default()).unwrap().clip;
    assert_eq!(clip.translations(0), [DVec3::new(2.0, 6.0, 6.0)]);
    let root = turn(DVec3::X, 10.0) * turn(DVec3::Y, 20.0) * turn(DVec3::Z, 30.0);
    assert_close(clip.rotations(0)[0], root);
}

#[test]
fn the_rate_is_the_callers_unless_the_file_has_one() {
    let read_at = |text: &str, fps| {
        let options = ReadOptions { fps, ..ReadOptions::default() };
        read(&skeleton(), text.as_bytes(), &options).unwrap()
    };
    let usual = read_at(AMC, 120.0);
    assert_eq!(usual.clip.frame_time(), 1.0 / 120.0);
    assert_eq!(notes(&usual), "AMC stores no frame rate: taken for 120 frames a second\n");
    assert_eq!(read_at(AMC, 60.0).clip.frame_time(), 1.0 / 60.0);
    let own = read_at(&AMC.replace(":DEGREES", ":DEGREES\n:SAMPLES-PER-SECOND 90.0"), 120.0);
    assert_eq!((own.clip.frame_time(), notes(&own)), (1.0 / 90.0, String::new()));
}

#[test]
fn angles_may_be_radians() {
    let radians = |degrees: f64| degrees.to_radians().to_string();
    let text = AMC
        .replace(":DEGREES", ":RADIANS")
        .replace("thigh 40 0 0", &format!("thigh {} 0 0", radians(40.0)));
    assert_close(amc(&text).clip.rotations(0)[1], turn(DVec3::Y, 40.0));
    let asf = ASF
        .replace("angle deg", "angle rad")
        .replace("axis 0 0 90", &format!("axis 0 0 {}", radians(90.0)));
    let asf = Asf::read(asf.as_bytes()).unwrap();
    let clip = read(&asf, AMC.as_bytes(), &ReadOptions::default()).unwrap().clip;
    assert_close(clip.rotations(0)[1], turn(DVec3::Y, 40.0));
}

#[test]
fn line_ends_comments_and_the_order_of_bones_do_not_matter() {
    let plain = amc(AMC);
    for text in [
        AMC.replace('\n', "\r\n"),
        AMC.replace(' ', "\t  "),
        AMC.trim_end().to_owned(),
        AMC.replace("2\nroot", "# between\n2\n\nroot"),
        AMC.replace("thigh -40 1 2\nshin 5 6", "shin 5 6\nthigh -40 1 2"),
        AMC.replace("shin 5 6\n2", "shin 5 6\ntoe\n2"),
        AMC.replace("1\nroot", "7\nroot").replace("2\nroot", "8\nroot"),
    ] {
        assert_eq!(amc(&text), plain, "{text}");
    }
    assert_eq!(Asf::read(ASF.replace('\n', "\r\n").as_bytes()).unwrap(), skeleton());
}

#[test]
fn bones_that_stretch_are_read_without_it_and_with_a_note() {
    let asf = Asf::read(ASF.replace("dof rx rz", "dof l rx rz").as_bytes()).unwrap();
    let text = AMC.replace("shin 5 6", "shin 9 5 6");
    let read = read(&asf, text.as_bytes(), &ReadOptions::default()).unwrap();
    assert_eq!(read.clip, amc(AMC).clip);
    assert!(notes(&read).contains("bone 'shin' and perhaps others move or stretch: ignored"));
}

fn asf_refused(from: &str, to: &str, message: &str) {
    assert!(ASF.contains(from), "{from}");
    let error = Asf::read(ASF.replacen(from, to, 1).as_bytes()).unwrap_err();
    assert_eq!(error.to_string(), message);
}

#[test]
fn what_a_skeleton_is_refused_for() {
    let section = "expected a section, such as :bonedata";
    asf_refused(ASF, "HIERARCHY", &format!("line 1, column 1: {section}, found 'HIERARCHY'"));
    asf_refused(
        ASF,
        "",
        "line 1, column 1: expected :root with an order, found the end of the file",
    );
    let length = "a length between 0.000001 and 1000000";
    asf_refused(
        "length 0.5",
        "length 0",
        &format!("line 6, column 10: expected {length}, found '0'"),
    );
    asf_refused("length 0.5", "length x", "line 6, column 10: expected a finite number, found 'x'");
    asf_refused("angle deg", "angle turns", "line 7, column 9: expected deg, found 'turns'");
    asf_refused(
        "order TX",
        "order TX TX",
        "line 12, column 13: expected rx, ry, rz, tx, ty, tz or l, each once, found 'TX'",
    );
    asf_refused(
        "axis XYZ",
        "axis XYX",
        "line 13, column 9: expected XYZ or another order, found 'XYX'",
    );
    asf_refused(
        "axis XYZ",
        "axis",
        "line 13, column 8: expected XYZ or another order, found the end of the line",
    );
    asf_refused(
        "0 -1 0",
        "0 -1",
        "line 20, column 20: expected a number, found the end of the line",
    );
    asf_refused("0 -1 0", "0 -1 nan", "line 20, column 21: expected a finite number, found 'nan'");
    asf_refused(
        "     length 4\n",
        "",
        "line 17, column 8: expected name, direction and length of the bone, found not all of them",
    );
    asf_refused(
        "     id 1\n     name thigh",
        "     name",
        "line 18, column 10: expected a bone's name, found the end of the line",
    );
    asf_refused(
        "name shin",
        "name thigh",
        "line 28, column 8: expected another name, found a second 'thigh'",
    );
    asf_refused(
        "name shin",
        "name root",
        "line 28, column 8: expected another name, found a second 'root'",
    );
    asf_refused(
        "id 1",
        "colour 1",
        "line 18, column 6: expected a bone's name, direction, length, axis or dof, found 'colour'",
    );
    asf_refused(
        "thigh shin",
        "thigh calf",
        "line 46, column 11: expected a bone of :bonedata or root, found 'calf'",
    );
    asf_refused(
        "shin toe",
        "shin thigh",
        "line 47, column 10: expected a bone that has no parent yet, found 'thigh'",
    );
    asf_refused(
        "shin toe",
        "shin",
        "line 49, column 1: expected bone 'toe' below the root in :hierarchy, found the end of the file",
    );
    // A ring that hangs on nothing.
    asf_refused(
        "root thigh\n    thigh shin\n    shin toe",
        "thigh shin\n    shin thigh",
        "line 48, column 1: expected bone 'thigh' below the root in :hierarchy, found the end of the file",
    );
    asf_refused(
        ":hierarchy",
        "begin",
        "line 44, column 3: expected a bone's name, direction, length, axis or dof, found 'begin'",
    );
}

fn refused(from: &str, to: &str, message: &str) {
    assert!(AMC.contains(from), "{from}");
    let text = AMC.replacen(from, to, 1);
    let error = read(&skeleton(), text.as_bytes(), &ReadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), message);
}

#[test]
fn what_a_motion_is_refused_for() {
    refused(AMC, ":DEGREES\n", "line 2, column 1: expected at least one frame, found none");
    refused(AMC, "HIERARCHY", "line 1, column 1: expected a frame number, found 'HIERARCHY'");
    refused("2\nroot", "3\nroot", "line 8, column 1: expected frame number 2, found '3'");
    let most = u64::MAX;
    let message = format!("line 4, column 1: expected a frame number, found '{most}'");
    refused("1\nroot", &format!("{most}\nroot"), &message);
    refused(
        "2\nroot",
        "2 x\nroot",
        "line 8, column 3: expected the end of the line after the frame's number, found 'x'",
    );
    refused(
        "thigh 40 0 0",
        "thigh 40 0",
        "line 6, column 11: expected 3 numbers for bone 'thigh' in frame 1, found 2",
    );
    refused(
        "thigh 40 0 0",
        "thigh 40 0 0 1",
        "line 6, column 14: expected 3 numbers for bone 'thigh' in frame 1, found 4",
    );
    refused("thigh 40", "thigh nan", "line 6, column 7: expected a finite number, found 'nan'");
    refused("thigh 40", "thigh 1e999", "line 6, column 7: expected a finite number, found '1e999'");
    refused(
        "thigh 40",
        "calf 40",
        "line 6, column 1: expected a bone of the skeleton or a frame number, found 'calf'",
    );
    refused(
        "thigh 40 0 0",
        "shin 1 2",
        "line 7, column 1: expected each bone once a frame, found 'shin'",
    );
    refused(
        "thigh 40 0 0\n",
        "",
        "line 7, column 1: expected bone 'thigh' in frame 1, found the end of the frame",
    );
    refused(
        ":DEGREES",
        ":SAMPLES-PER-SECOND 0",
        "line 3, column 21: expected a rate between 0.001 and 1000000, found '0'",
    );
}

#[test]
fn a_cut_motion_is_mended_to_its_whole_frames() {
    let options = ReadOptions { repair: true, ..ReadOptions::default() };
    let mend = |text: &str| read(&skeleton(), text.as_bytes(), &options).unwrap();
    let mended = mend(AMC.strip_suffix(" 6\n").unwrap());
    assert_eq!(mended.clip.frames(), 1);
    assert!(notes(&mended).starts_with("line 11: repaired: cut after frame 1; line 11, column 7"));
    let mended = mend(&AMC.replace("2\nroot", "5\nroot"));
    assert_eq!(mended.clip.frames(), 2);
    assert!(notes(&mended).starts_with("line 8: repaired: frame number 2 was 5\n"));
    assert_eq!(mend(AMC), amc(AMC));
}

#[test]
fn bones_without_numbers_cannot_ask_for_any_memory() {
    let mut bones = String::new();
    let mut tree = String::from("root");
    for n in 0..9000 {
        bones += &format!("begin\nname b{n}\ndirection 0 1 0\nlength 1\nend\n");
        tree += &format!(" b{n}");
    }
    let asf = format!(":root\norder TX\n:bonedata\n{bones}:hierarchy\nbegin\n{tree}\nend\n");
    let asf = Asf::read(asf.as_bytes()).unwrap();
    let frames: String = (1..20_000).map(|n| format!("{n}\nroot 0\n")).collect();
    let error = read(&asf, frames.as_bytes(), &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.ends_with("frames in so small a file, found more"), "{error}");
}

mod properties {
    use super::*;
    use proptest::prelude::*;

    fn damaged(text: &'static str) -> impl Strategy<Value = Vec<u8>> {
        let pieces = prop::sample::select(vec![
            "\n", " ", "-", "1e999", "nan", ":", "root", "begin", "end", "dof rx", "#", "2\n",
        ]);
        let pieces = prop_oneof![
            pieces.prop_map(|piece| piece.as_bytes().to_vec()),
            prop::collection::vec(any::<u8>(), 0..4),
        ];
        let change = (any::<prop::sample::Index>(), 0..12_usize, pieces);
        prop::collection::vec(change, 1..4).prop_map(|changes| {
            let mut bytes = text.as_bytes().to_vec();
            for (at, count, instead) in changes {
                let start = at.index(bytes.len() + 1);
                let end = (start + count).min(bytes.len());
                bytes.splice(start..end, instead);
            }
            bytes
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn damaged_pairs_do_no_harm(asf in damaged(ASF), amc in damaged(AMC), repair: bool) {
            let options = ReadOptions { repair, ..ReadOptions::default() };
            let _ = read(&skeleton(), &amc, &options);
            if let Ok(asf) = Asf::read(&asf) {
                let _ = read(&asf, AMC.as_bytes(), &options);
                let _ = read(&asf, &amc, &options);
            }
        }

        #[test]
        fn arbitrary_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = Asf::read(&bytes);
            let _ = read(&skeleton(), &bytes, &ReadOptions::default());
        }
    }
}
