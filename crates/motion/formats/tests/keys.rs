//! What keys mean, what is refused, and that any that can be read survive being written.

use ambulo_formats::keys::{Keys, read, write};
use ambulo_rig::Clip;
use ambulo_rig::glam::{DQuat, DVec3};
use proptest::prelude::*;

const FIGURE: &str = "\
bone Hips - 0 1 0
bone LeftLeg Hips 0.1 0 0
bone LeftShin LeftLeg 0 -0.45 0
bone LeftFoot LeftShin 0 -0.45 0
bone RightLeg Hips -0.1 0 0
bone RightShin RightLeg 0 -0.45 0
bone RightFoot RightShin 0 -0.45 0
tip LeftFoot 0 -0.1 0.2
turns Hips turn y pitch x
turns LeftShin flex x
turns RightShin flex x
limb left LeftLeg LeftShin LeftFoot grip 0 -0.1 0.05
limb right RightLeg RightShin RightFoot grip 0 -0.1 0.05
";

fn alone(_: &str) -> Result<Vec<u8>, String> {
    Err("no such file".into())
}

fn text(rest: &str) -> String {
    format!("keys 1\n{FIGURE}{rest}")
}

fn keys(rest: &str) -> Keys {
    read(text(rest).as_bytes(), &mut alone).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(text: &str) -> String {
    read(text.as_bytes(), &mut alone).expect_err(text).to_string()
}

fn joint(clip: &Clip, name: &str) -> usize {
    clip.skeleton().find(name).unwrap()
}

/// A joint's rotation about an axis, in degrees.
fn angle(clip: &Clip, frame: usize, name: &str, axis: DVec3) -> f64 {
    let (turned, angle) = clip.rotations(frame)[joint(clip, name)].to_axis_angle();
    (angle * turned.dot(axis)).to_degrees()
}

fn grip(clip: &Clip, frame: usize, name: &str) -> DVec3 {
    let mut places = vec![];
    clip.positions(frame, &mut places);
    let mut turn = DQuat::IDENTITY;
    let mut at = Some(joint(clip, name));
    while let Some(joint) = at {
        turn = clip.rotations(frame)[joint] * turn;
        at = clip.skeleton().joints()[joint].parent;
    }
    places[joint(clip, name)] + turn * DVec3::new(0.0, -0.1, 0.05)
}

#[test]
fn what_a_key_leaves_out_is_held_until_it_is_set() {
    let clip =
        keys("fps 10\nkey 0\n LeftShin flex 30\nkey 1\nkey 2\n LeftShin flex 50\n").sample().clip;
    assert_eq!((clip.frames(), clip.fps()), (21, 10.0));
    let flex = |frame| angle(&clip, frame, "LeftShin", DVec3::X);
    assert!((0..=10).all(|frame| (flex(frame) - 30.0).abs() < 1e-9));
    assert!((flex(15) - 40.0).abs() < 1e-9 && (flex(20) - 50.0).abs() < 1e-9);
    assert!(flex(11) - 30.0 < 0.2, "it starts from rest");
}

#[test]
fn a_partial_key_lets_all_else_pass() {
    let clip = keys(
        "fps 10\nkey 0\n LeftShin flex 0\nkey 1 partial\n RightShin flex 9\nkey 2\n LeftShin flex 40\n",
    );
    let clip = clip.sample().clip;
    assert!((angle(&clip, 10, "LeftShin", DVec3::X) - 20.0).abs() < 1e-9);
    assert!((angle(&clip, 10, "RightShin", DVec3::X) - 9.0).abs() < 1e-9);
    assert!((angle(&clip, 20, "RightShin", DVec3::X) - 9.0).abs() < 1e-9, "held after it");
}

#[test]
fn a_key_is_passed_at_rest_evenly_or_without_stopping() {
    let clip = |easing: &str| {
        keys(&format!(
            "fps 100\nkey 0\nkey 1 {easing}\n LeftShin flex 20\nkey 2\n LeftShin flex 50\n"
        ))
        .sample()
        .clip
    };
    let speed = |clip: &Clip, frame: usize| {
        let flex = |frame| angle(clip, frame, "LeftShin", DVec3::X);
        (flex(frame + 1) - flex(frame)) * 100.0
    };
    assert!(speed(&clip("smooth"), 99) < 0.1);
    let linear = clip("linear");
    assert!((0..100).all(|frame| (speed(&linear, frame) - 20.0).abs() < 1e-6));
    let through = clip("through");
    // The harmonic mean of 20 and 30.
    assert!((speed(&through, 99) - 24.0).abs() < 0.1 && (speed(&through, 100) - 24.0).abs() < 0.1);
    assert!((0..200).all(|frame| speed(&through, frame) > -1e-9), "it does not swing back");
}

#[test]
fn a_placed_foot_stays_while_the_hips_move() {
    let sampled = keys(
        "key 0\n Hips at 0 0.95 0\n left at 0.1 0 0.05\n right at -0.1 0 0.05 facing 0 0 0\n\
         key 1\n Hips at 0.05 0.7 -0.1 turn 20 pitch 10\n",
    )
    .sample();
    assert_eq!(sampled.notes, []);
    let clip = sampled.clip;
    for frame in 0..clip.frames() {
        for (name, x) in [("LeftFoot", 0.1), ("RightFoot", -0.1)] {
            let at = grip(&clip, frame, name);
            assert!(at.distance(DVec3::new(x, 0.0, 0.05)) < 1e-9, "{name}, frame {frame}: {at}");
        }
    }
    let mut places = vec![];
    clip.positions(60, &mut places);
    let knee = places[joint(&clip, "LeftShin")];
    assert!(knee.z > places[joint(&clip, "LeftLeg")].z, "the knee bends to the front: {knee}");
}

#[test]
fn a_limb_goes_straight_to_its_place_and_back() {
    let clip = keys("key 0\nkey 1\n left at 0.1 0.4 0.5 facing 0 0 90\nkey 2\n left free\n");
    let clip = clip.sample().clip;
    assert!(grip(&clip, 60, "LeftFoot").distance(DVec3::new(0.1, 0.4, 0.5)) < 1e-9);
    assert_eq!(clip.rotations(0), clip.rotations(120), "free again");
    let step =
        (0..120).map(|f| grip(&clip, f, "LeftFoot").distance(grip(&clip, f + 1, "LeftFoot")));
    assert!(step.fold(0.0, f64::max) < 0.03, "no jump");
}

#[test]
fn a_swivel_turns_the_knee_out() {
    let clip =
        keys("key 0\n Hips at 0 0.8 0\n left at 0.1 0 0.05 swivel 40\n right at -0.1 0 0.05\n");
    let mut places = vec![];
    let clip = clip.sample().clip;
    clip.positions(0, &mut places);
    let knee = |name: &str| places[joint(&clip, name)];
    assert!((knee("RightShin").x + 0.1).abs() < 1e-9);
    assert!((knee("LeftShin").x - 0.1).abs() > 0.05);
    assert!(grip(&clip, 0, "LeftFoot").distance(DVec3::new(0.1, 0.0, 0.05)) < 1e-9);
}

#[test]
fn a_place_out_of_reach_and_an_open_loop_are_told() {
    let sampled =
        keys("phase hold 0 1 loop\nkey 0\n left at 0.1 -0.3 0\nkey 1\n Hips pitch 4\n").sample();
    let notes: Vec<_> = sampled.notes.iter().map(ToString::to_string).collect();
    assert!(notes[0].starts_with("left ends 30.") && notes[0].contains("short"), "{notes:?}");
    assert!(notes[1].starts_with("phase 'hold' does not close: Hips is 4.0 degrees"), "{notes:?}");
}

#[test]
fn a_pose_is_whole() {
    let clip = keys(
        "fps 10\npose stand\n Hips at 0 0.9 0\n LeftShin flex 5\n\
         key 0 pose stand\n RightShin flex 60\n left at 0 0.3 0\nkey 1 pose stand\n Hips pitch 3\n",
    );
    let clip = clip.sample().clip;
    assert!(angle(&clip, 10, "RightShin", DVec3::X).abs() < 1e-9, "at rest again");
    assert!((angle(&clip, 10, "LeftShin", DVec3::X) - 5.0).abs() < 1e-9, "free again");
    assert_eq!(clip.translations(10), [DVec3::new(0.0, 0.9, 0.0)]);
}

#[test]
fn phases_and_events() {
    let keys = keys("phase enter 0 0.5\nphase hold 0.5 1 loop\nevent grasp 0.4\nkey 0\nkey 1\n");
    let phases: Vec<_> =
        keys.marks().phases.iter().map(|p| (p.name.as_str(), p.start, p.end, p.loops)).collect();
    assert_eq!(phases, [("enter", 0.0, 0.5, false), ("hold", 0.5, 1.0, true)]);
    assert_eq!((keys.marks().events[0].name.as_str(), keys.marks().events[0].time), ("grasp", 0.4));
}

#[test]
fn files_beside_give_a_skeleton_and_what_is_mirrored() {
    let mut asked = vec![];
    let mut beside = |name: &str| {
        asked.push(name.to_owned());
        match name {
            "a.skeleton" => Ok(text("pose p\n LeftShin flex 30\n").into_bytes()),
            "a.keys" => {
                Ok(b"keys 1\nskeleton a.skeleton\nphase x 0 1\nkey 0 pose p\nkey 1\n".to_vec())
            }
            "bad.skeleton" => Ok(b"keys 1\nbone a b 0 0 0\n".to_vec()),
            _ => Err("no such file".into()),
        }
    };
    let own = read(b"keys 1\nskeleton a.skeleton\nkey 0 pose p\n", &mut beside).unwrap();
    assert!((angle(&own.sample().clip, 0, "LeftShin", DVec3::X) - 30.0).abs() < 1e-9);
    let other = read(b"keys 1\nmirror a.keys\n", &mut beside).unwrap();
    let sampled = other.sample();
    assert_eq!(sampled.notes, []);
    assert!((angle(&sampled.clip, 0, "RightShin", DVec3::X) - 30.0).abs() < 1e-9);
    assert_eq!(other.marks().phases.len(), 1);
    assert_eq!(write(&other), b"keys 1\nmirror a.keys\n");
    let error = read(b"keys 1\nskeleton bad.skeleton\nkey 0\n", &mut beside).unwrap_err();
    assert_eq!(
        error.to_string(),
        "bad.skeleton: line 2, column 8: expected - for the parent of the root, found 'b'"
    );
    for name in ["../a.keys", "/etc/passwd", "a\\b", ".hidden", "c:x"] {
        let error = read(format!("keys 1\nmirror {name}\n").as_bytes(), &mut beside).unwrap_err();
        assert!(error.expected.contains("the name of a file beside"), "{error}");
    }
    assert_eq!(asked, ["a.skeleton", "a.keys", "a.skeleton", "bad.skeleton"]);
}

#[test]
fn refusals_say_where_and_what_was_expected() {
    let line = FIGURE.lines().count() + 2;
    for (rest, expected) in [
        ("key 0.5\n", "column 5: expected the first key at 0, found '0.5'"),
        ("key 0 pose walk\n", "column 12: expected the name of a pose, found 'walk'"),
        ("key 0 soft\n", "column 7: expected the end of the line, found 'soft'"),
        ("key x\n", "column 5: expected the time in seconds, a number from 0 to 3600, found 'x'"),
        (
            "key nan\n",
            "column 5: expected the time in seconds, a number from 0 to 3600, found 'nan'",
        ),
        ("phase a 1 1\n", "column 11: expected an end after 1, found '1'"),
        ("fps 0\n", "column 5: expected frames a second, a number from 1 to 1000, found '0'"),
        ("Hips turn 3\n", "column 1: expected skeleton, mirror, fps, bone"),
        ("turns Hips a x\n", "column 7: expected one line with turns a joint, found 'Hips'"),
        ("turns LeftFoot a w\n", "column 18: expected x, y, z, -x, -y or -z, found 'w'"),
        (
            "bone key Hips 0 0 0\n",
            "column 6: expected a bone's name that is not a word of the format",
        ),
        ("bone left Hips 0 0 0\n", "column 6: expected another name, found 'left'"),
        (
            "bone A B 0 0 0\n",
            "column 8: expected the name of a parent that comes before, found 'B'",
        ),
        ("bone A Hips 0 0\n", "column 16: expected metres from the parent, a number from -1000"),
        (
            "limb arm Hips LeftShin LeftFoot\n",
            "column 15: expected a bone of 1 mm or more whose parent",
        ),
        ("skeleton a.skeleton\n", "column 1: expected one skeleton, before anything that needs it"),
    ] {
        let error = refused(&text(rest));
        assert!(error.starts_with(&format!("line {line}, {expected}")), "{error}");
    }
    for (rest, expected) in [
        ("key 0\nkey 0\n", "column 5: expected a time after 0, found '0'"),
        ("key 0\nHips roll 3\n", "column 6: expected one of turn, pitch, at, found 'roll'"),
        ("key 0\nArm flex 3\n", "column 1: expected a joint, a limb, a pose or a key, found 'Arm'"),
        ("key 0\nLeftShin at 0 0 0\n", "column 10: expected at for the root alone, found 'at'"),
        ("key 0\nLeftShin\n", "column 9: expected a turn's name, found the end of the line"),
        (
            "key 0\nleft\n",
            "column 5: expected at, facing, swivel, weight or free, found the end of",
        ),
        (
            "key 0\nleft at 0 0 0 at 0 0 0\n",
            "column 22: expected each number once in a pose or a key",
        ),
        ("key 0\nLeftShin LeftShin flex 3\n", "column 24: expected each number once"),
        ("key 0\nfps 9 9\n", "column 7: expected the end of the line, found '9'"),
        ("key 0\nbone A Hips 0 0 0\n", "column 1: expected the skeleton's lines before"),
        ("key 0\npose a\n", "column 6: expected a pose of another name, before the first key"),
    ] {
        let error = refused(&text(rest));
        assert!(error.starts_with(&format!("line {}, {expected}", line + 1)), "{error}");
    }
    assert_eq!(refused(""), "line 1, column 1: expected keys 1, found an empty file");
    assert_eq!(refused("HIERARCHY"), "line 1, column 1: expected keys 1, found 'HIERARCHY'");
    let version = "line 1, column 6: expected version 1, the only one so far, found '2'";
    assert_eq!(refused("keys 2\n"), version);
    assert!(refused("keys 1\nkey 0\n").contains("a skeleton before the first key"));
    assert!(refused(&text("")).contains("expected a key, found the end of the file"));
    assert!(refused(&text("event e 2\nkey 0\nkey 1\n")).contains("up to that of the last key, 1"));
    assert!(
        refused("keys 1\nmirror a.keys\nfps 3\n").contains("nothing else in a file that mirrors")
    );
    assert!(refused("keys 1\nmirror a.keys\n").contains("a file beside (no such file)"));
}

#[test]
fn what_would_be_too_much_is_refused() {
    assert!(refused(&text("fps 1000\nkey 0\nkey 3600\n")).contains("frames times joints"));
    let many: String = (0..100_000).map(|n| format!("key {n}e-3\n")).collect();
    assert!(refused(&text(&many)).contains("keys, found"));
    let mut bones = String::from("keys 1\nbone b0 - 0 0 0\n");
    (1..1001).for_each(|n| bones += &format!("bone b{n} b0 0 0 1\n"));
    assert!(refused(&bones).contains("at most 1000 bones"));
    let huge = " ".repeat((4 << 20) + 1);
    assert!(refused(&huge).contains("at most 4194304 bytes"));
}

// -- any file ---------------------------------------------------------------------------------

fn number(range: std::ops::Range<i32>) -> impl Strategy<Value = f64> {
    range.prop_map(|n| f64::from(n) / 64.0)
}

fn setting() -> impl Strategy<Value = String> {
    let degrees = || number(-12_000..12_000);
    let metres = || [number(-200..200), number(-200..200), number(-200..200)];
    let three = |[x, y, z]: [f64; 3]| format!("{x} {y} {z}");
    prop_oneof![
        degrees().prop_map(|a| format!("Hips turn {a}")),
        metres().prop_map(move |at| format!("Hips pitch -1.5 at {}", three(at))),
        (degrees(), degrees()).prop_map(|(a, b)| format!("LeftLeg RightLeg y {a} z {b}")),
        degrees().prop_map(|a| format!("LeftShin RightShin flex {a}")),
        metres().prop_map(move |at| format!("left at {} # there", three(at))),
        (metres(), degrees())
            .prop_map(move |(at, a)| format!("right facing {a} 3 4 at {}", three(at))),
        degrees().prop_map(|a| format!("right swivel {a}")),
        number(0..65).prop_map(|w| format!("left weight {w}")),
        Just("left free".to_owned()),
    ]
}

/// Lines that set different things.
fn settings() -> impl Strategy<Value = String> {
    prop::collection::vec(setting(), 0..5).prop_map(|lines| {
        let mut taken = std::collections::HashSet::new();
        let unique = lines.into_iter().filter(|line| {
            // By joint or limb: coarser than what the format asks, and sure.
            line.split(' ').next().is_some_and(|name| taken.insert(name.to_owned()))
        });
        unique.map(|line| format!("  {line}\n")).collect()
    })
}

fn file() -> impl Strategy<Value = String> {
    let key = (
        1..90_u32,
        prop::sample::select(vec!["", " smooth", " through", " linear"]),
        prop::sample::select(vec!["", " partial", " pose stand", " pose other"]),
        settings(),
    );
    let keys = prop::collection::vec(key, 0..6);
    (settings(), settings(), settings(), keys, prop::bool::ANY).prop_map(
        |(stand, other, first, keys, marked)| {
            let mut rest = format!("fps 30\npose stand\n{stand}pose other\n{other}key 0\n{first}");
            let mut time = 0.0;
            for (step, easing, kind, sets) in keys {
                time += f64::from(step) / 60.0;
                rest += &format!("key {time}{easing}{kind}\n{sets}");
            }
            if marked && time > 0.0 {
                rest += &format!("event e {time}\nphase hold 0 {time} loop\n");
            }
            text(&rest)
        },
    )
}

fn assert_no_harm(bytes: &[u8]) -> Result<(), TestCaseError> {
    let Ok(keys) = read(bytes, &mut alone) else { return Ok(()) };
    let written = write(&keys);
    let again = read(&written, &mut alone);
    let shown = String::from_utf8_lossy(&written).into_owned();
    let again = again.map_err(|error| TestCaseError::fail(format!("{error}\n{shown}")))?;
    prop_assert_eq!(&again, &keys);
    prop_assert_eq!(write(&again), written);
    if keys.duration() * keys.fps() < 1000.0 {
        let clip = keys.sample().clip;
        prop_assert_eq!(clip.frames(), (keys.duration() * keys.fps() + 1e-6) as usize + 1);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn files_survive_being_written(text in file()) {
        prop_assert!(read(text.as_bytes(), &mut alone).is_ok(), "{}", text);
        assert_no_harm(text.as_bytes())?;
    }

    /// At a key that is not partial, every joint has the angles that it was last given.
    #[test]
    fn angles_are_kept_at_their_keys(a in -170.0..170.0_f64, b in -170.0..170.0_f64, frames in 1..40_u32) {
        let time = f64::from(frames) / 60.0;
        let clip = keys(&format!("key 0\nLeftShin flex {a}\nkey {time}\nLeftShin flex {b}\n"));
        let clip = clip.sample().clip;
        prop_assert_eq!(clip.frames(), frames as usize + 1);
        prop_assert!((angle(&clip, 0, "LeftShin", DVec3::X) - a).abs() < 1e-6);
        prop_assert!((angle(&clip, frames as usize, "LeftShin", DVec3::X) - b).abs() < 1e-6);
    }

    /// Wherever the hips and the place are within reach, the grip is where it was put.
    #[test]
    fn a_limb_reaches_what_is_within_reach(
        x in -0.3..0.3_f64, y in -0.75..-0.3_f64, z in -0.3..0.3_f64, turn in -180.0..180.0_f64,
        pitch in -40.0..40.0_f64, swivel in -90.0..90.0_f64, yaw in -60.0..60.0_f64,
    ) {
        let hips = DQuat::from_rotation_y(turn.to_radians()) * DQuat::from_rotation_x(pitch.to_radians());
        let facing = DQuat::from_rotation_y(yaw.to_radians());
        let hip = hips * DVec3::new(0.1, 0.0, 0.0) + DVec3::Y;
        let at = hip + DVec3::new(x, y, z) + facing * DVec3::new(0.0, -0.1, 0.05);
        let rest = format!(
            "key 0\nHips at 0 1 0 turn {turn} pitch {pitch}\nleft at {} {} {} facing {yaw} 0 0 swivel {swivel}\n",
            at.x, at.y, at.z
        );
        let sampled = keys(&rest).sample();
        let there = grip(&sampled.clip, 0, "LeftFoot");
        prop_assert!(there.distance(at) < 1e-6, "{there} is not {at}: {:?}", sampled.notes);
    }

    #[test]
    fn arbitrary_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        assert_no_harm(&bytes)?;
        assert_no_harm(&[text("").into_bytes(), bytes].concat())?;
    }

    #[test]
    fn damaged_files_do_no_harm(
        file in file(),
        mutations in prop::collection::vec(
            (any::<prop::sample::Index>(), 0..9_usize, prop::sample::select(vec![
                "", "\n", " ", "-", "1e999", "nan", "key 1", "key", "pose stand", "at", "free", "#",
                "bone B Hips 0 0 0\n", "left", "loop", "phase hold 0 1 loop\n", "mirror", "\u{feff}",
            ])),
            1..4,
        ),
    ) {
        let mut bytes = file.into_bytes();
        for (at, count, instead) in mutations {
            let start = at.index(bytes.len() + 1);
            let end = (start + count).min(bytes.len());
            bytes.splice(start..end, instead.bytes());
        }
        assert_no_harm(&bytes)?;
    }
}
