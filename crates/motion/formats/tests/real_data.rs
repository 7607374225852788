//! Every motion file of the real recordings: read, write, read again, write again.
//!
//! The recordings are not part of this repository. They are looked for in `$AMBULO_DATA`, else in
//! `../shared/data` beside the repository; without them the test prints so and passes.

use std::path::{Path, PathBuf};

use ambulo_formats::bvh::{self, WriteOptions};
use ambulo_formats::detect::{Detected, PositionsFit, detect};
use ambulo_formats::files::{Format, MotionFile, read_path};
use ambulo_formats::{Positions, ReadOptions};
use ambulo_rig::glam::DQuat;
use ambulo_rig::{Axis, Clip, Handedness};

fn data() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../../shared/data");
    let folder = std::env::var_os("AMBULO_DATA").map_or_else(beside, PathBuf::from);
    if !folder.is_dir() {
        println!("skipped: no recordings at {} (set AMBULO_DATA)", folder.display());
        return None;
    }
    Some(folder)
}

/// The motion files of one folder, in order.
fn files(data: &Path, folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(data.join(folder)).expect("the folder can be listed");
    let paths = entries.map(|entry| entry.expect("the entry can be read").path());
    let mut paths: Vec<_> = paths.filter(|path| Format::of(path).is_some()).collect();
    paths.sort();
    paths
}

fn load(path: &Path) -> MotionFile {
    read_path(path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn degrees_apart(a: DQuat, b: DQuat) -> f64 {
    let between = a.conjugate() * b;
    (2.0 * between.xyz().length().atan2(between.w.abs())).to_degrees()
}

/// Largest differences in degrees and in units; joints are matched by name.
fn differences(a: &Clip, b: &Clip) -> (f64, f64) {
    assert_eq!(a.frames(), b.frames());
    let names = |clip: &Clip| -> Vec<String> {
        clip.skeleton().joints().iter().map(|joint| joint.name.clone()).collect()
    };
    assert_eq!(names(a), names(b));
    let (mut turned, mut moved) = (0.0_f64, 0.0_f64);
    let (mut from, mut to) = (vec![], vec![]);
    for frame in 0..a.frames() {
        for (&p, &q) in a.rotations(frame).iter().zip(b.rotations(frame)) {
            turned = turned.max(degrees_apart(p, q));
        }
        a.positions(frame, &mut from);
        b.positions(frame, &mut to);
        for (p, q) in from.iter().zip(&to) {
            moved = moved.max(p.distance(*q));
        }
    }
    (turned, moved)
}

/// Reads what was written, and writes it again.
fn round_trip(path: &Path, file: &MotionFile) {
    let name = path.display();
    let written = bvh::write(&file.clip, &WriteOptions { dialect: file.dialect.clone() });
    let again = bvh::read(&written.bytes, &ReadOptions::default())
        .unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(again.notes, [], "{name}: what we write is plain");
    let (turned, moved) = differences(&file.clip, &again.clip);
    assert!(turned < 1e-4, "{name}: {turned} degrees off");
    assert!(moved < 1e-4, "{name}: {moved} units off");
    assert_eq!(again.clip.frame_time(), file.clip.frame_time(), "{name}");
    let dialect = Some(again.dialect);
    if let Some(read) = &file.dialect {
        assert_eq!(dialect.as_ref(), Some(read), "{name}: the dialect is kept");
    }
    let second = bvh::write(&again.clip, &WriteOptions { dialect });
    assert!(second.bytes == written.bytes, "{name}: the second writing differs");
}

fn check(folder: &str, expected: impl Fn(&MotionFile, &Detected)) {
    let Some(data) = data() else { return };
    let paths = files(&data, folder);
    let (mut frames, mut seconds) = (0, 0.0);
    for path in &paths {
        let file = load(path);
        round_trip(path, &file);
        expected(&file, &detect(&file.clip, Positions::Replace));
        frames += file.clip.frames();
        seconds += file.clip.frames() as f64 * file.clip.frame_time();
    }
    println!("{folder}: {} files, {frames} frames, {:.1} min", paths.len(), seconds / 60.0);
    assert!(!paths.is_empty());
}

fn unit(detected: &Detected) -> f64 {
    detected.metres_per_unit.unwrap_or(f64::NAN)
}

#[test]
fn lafan1() {
    check("lafan1", |file, detected| {
        assert_eq!(file.clip.skeleton().len(), 23);
        assert_eq!(file.clip.fps(), 60.0);
        assert_eq!(detected.up.map(|up| up.axis), Some(Axis::PosY));
        assert_eq!(unit(detected), 0.01);
        assert_eq!(detected.handedness, Some(Handedness::Right));
    });
}

#[test]
fn holden() {
    check("holden-pfnn", |file, detected| {
        assert_eq!(file.clip.skeleton().len(), 31);
        assert_eq!(detected.up.map(|up| up.axis), Some(Axis::PosY));
        assert_eq!(unit(detected), 0.056444);
        assert_eq!(detected.positions, PositionsFit::Unneeded);
    });
}

#[test]
fn bandai() {
    check("bandai", |file, detected| {
        assert_eq!(file.clip.skeleton().joints()[0].name, "joint_Root");
        assert_eq!(file.clip.fps(), 30.0);
        assert_eq!(detected.up.map(|up| up.axis), Some(Axis::PosY));
        assert_eq!(unit(detected), 0.01);
        assert_eq!(detected.positions, PositionsFit::Replace);
    });
}

#[test]
fn dog() {
    check("mann-dog", |file, detected| {
        assert_eq!(file.clip.fps(), 60.0);
        assert_eq!(detected.up.map(|up| up.axis), Some(Axis::PosY));
        assert_eq!(detected.metres_per_unit, None, "a dog is no person");
    });
}

#[test]
fn cmu() {
    check("cmu", |file, detected| {
        assert_eq!(file.clip.skeleton().len(), 31);
        assert_eq!(file.clip.fps(), 120.0);
        assert_eq!(file.metres_per_unit, Some(0.0254));
        assert_eq!(detected.up.map(|up| up.axis), Some(Axis::PosY));
        assert_eq!(unit(detected), 0.0254);
        assert_eq!(detected.handedness, Some(Handedness::Right));
    });
}

/// The same recording as a BVH conversion has it cannot be had here; but a foot on the ground
/// keeps its place, and legs of one person are as long as each other.
#[test]
fn cmu_feet_stand_still_on_the_ground() {
    let Some(data) = data() else { return };
    let file = load(&data.join("cmu/02_01.amc"));
    let skeleton = file.clip.skeleton();
    let foot = skeleton.find("ltoes").expect("CMU's names");
    let mut places = vec![];
    let track: Vec<_> = (0..file.clip.frames())
        .map(|frame| {
            file.clip.positions(frame, &mut places);
            places[foot]
        })
        .collect();
    let lowest = track.iter().map(|place| place.y).fold(f64::INFINITY, f64::min);
    let speeds: Vec<_> = track
        .windows(2)
        .filter(|pair| pair[0].y < lowest + 0.5)
        .map(|pair| pair[0].distance(pair[1]) * 120.0 * 0.0254)
        .collect();
    assert!(speeds.len() > 20);
    let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
    assert!(mean < 0.3, "the foot on the ground slides at {mean} m/s");
}
