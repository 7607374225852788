//! The clips that ship with the project: read as any file, with feet that stand where they should.

use std::path::{Path, PathBuf};

use ambulo_formats::ReadOptions;
use ambulo_formats::files::{MotionFile, read_keys, read_path};
use ambulo_formats::keys::{read, write};
use ambulo_rig::Clip;
use ambulo_rig::glam::{DQuat, DVec3};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../starters/clips")
}

fn files() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        entries.filter(|path| path.extension().is_some_and(|suffix| suffix == "keys")).collect();
    files.sort();
    assert!(files.len() >= 6, "{files:?}");
    files
}

fn clip(name: &str) -> MotionFile {
    read_path(&folder().join(format!("{name}.keys")), &ReadOptions::default()).unwrap()
}

/// A point of a joint's frame in the world.
fn point(clip: &Clip, frame: usize, name: &str, point: DVec3) -> DVec3 {
    let joint = clip.skeleton().find(name).unwrap();
    let mut places = vec![];
    clip.positions(frame, &mut places);
    let (mut turn, mut at) = (DQuat::IDENTITY, Some(joint));
    while let Some(joint) = at {
        turn = clip.rotations(frame)[joint] * turn;
        at = clip.skeleton().joints()[joint].parent;
    }
    places[joint] + turn * point
}

fn palm(clip: &Clip, time: f64, side: &str) -> DVec3 {
    let out = if side == "Left" { 0.08 } else { -0.08 };
    let frame = (time * clip.fps()).round() as usize;
    point(clip, frame, &format!("{side}Hand"), DVec3::new(out, -0.02, 0.0))
}

fn event(file: &MotionFile, name: &str) -> f64 {
    let events = &file.marks.as_ref().unwrap().events;
    events.iter().find(|event| event.name == name).unwrap().time
}

#[test]
fn every_clip_is_whole_and_its_phases_follow_one_another() {
    for path in files() {
        let file = read_path(&path, &ReadOptions::default()).unwrap();
        assert_eq!(file.notes, [], "{path:?}");
        assert_eq!((file.clip.fps().round(), file.clip.skeleton().len()), (60.0, 22));
        let phases = file.marks.unwrap().phases;
        let names: Vec<_> = phases.iter().map(|phase| phase.name.as_str()).collect();
        assert_eq!(names, ["enter", "hold", "exit"], "{path:?}");
        assert_eq!(phases[0].start, 0.0);
        assert!(phases.windows(2).all(|pair| pair[0].end == pair[1].start), "{path:?}");
        assert!((phases[2].end - file.clip.duration()).abs() < 1e-9, "{path:?}");
        // They come from standing and go back to it.
        let last = file.clip.frames() - 1;
        for (a, b) in file.clip.rotations(0).iter().zip(file.clip.rotations(last)) {
            assert!(a.angle_between(*b) < 1e-6, "{path:?}");
        }
    }
}

#[test]
fn every_clip_survives_being_written() {
    for path in files() {
        let keys = read_keys(&path).unwrap();
        let beside = |name: &str| std::fs::read(folder().join(name)).map_err(|e| e.to_string());
        let again = read(&write(&keys), &mut beside.clone()).unwrap();
        assert_eq!(again, keys, "{path:?}");
    }
}

#[test]
fn feet_stand_on_the_ground_and_do_not_slide() {
    for path in files() {
        let clip = read_path(&path, &ReadOptions::default()).unwrap().clip;
        for side in ["Left", "Right"] {
            let mut stood: Option<DVec3> = None;
            for frame in 0..clip.frames() {
                let of = |joint: &str, at| point(&clip, frame, &format!("{side}{joint}"), at);
                let ball = of("Foot", DVec3::new(0.0, -0.085, 0.145));
                let heel = of("Foot", DVec3::new(0.0, -0.085, -0.05));
                let tip = of("Toe", DVec3::new(0.0, -0.028, 0.07));
                let low = ball.y.min(heel.y).min(tip.y);
                assert!(low > -0.01, "{path:?}, {side}, frame {frame}: {low} m in the ground");
                if ball.y > 0.01 {
                    stood = None;
                    continue;
                }
                let slid = (*stood.get_or_insert(ball) - ball).with_y(0.0).length();
                assert!(slid < 0.01, "{path:?}, {side}, frame {frame}: slid {slid} m");
            }
        }
    }
}

#[test]
fn hands_are_where_the_objects_are() {
    for (name, event_name, side, at) in [
        ("open_door_right", "grasp", "Right", DVec3::new(-0.3, 1.0, 0.47)),
        ("open_door_left", "grasp", "Left", DVec3::new(0.3, 1.0, 0.47)),
        ("press_button", "press", "Right", DVec3::new(-0.2, 1.185, 0.505)),
        ("carry_box", "grasp", "Left", DVec3::new(0.18, 0.14, 0.36)),
        ("carry_box", "grasp", "Right", DVec3::new(-0.18, 0.14, 0.36)),
        ("carry_box", "set", "Right", DVec3::new(-0.18, 0.14, 0.36)),
        ("push_box", "touch", "Left", DVec3::new(0.18, 1.08, 0.66)),
    ] {
        let file = clip(name);
        let palm = palm(&file.clip, event(&file, event_name), side);
        assert!(palm.distance(at) < 0.005, "{name}, {event_name}: {palm} is not {at}");
    }
}

#[test]
fn who_sits_leans_first_and_then_is_on_the_seat() {
    let file = clip("sit");
    let (clip, seat) = (&file.clip, event(&file, "seat"));
    let hips = |time: f64| clip.translations((time * 60.0).round() as usize)[0];
    let lean = |time: f64| {
        let frame = (time * 60.0).round() as usize;
        let trunk = point(clip, frame, "Neck", DVec3::ZERO) - hips(time);
        trunk.z.atan2(trunk.y).to_degrees()
    };
    assert!(lean(0.45) > 20.0 && hips(0.45).y > 0.9, "{} degrees, {}", lean(0.45), hips(0.45));
    for time in [seat, 2.0, 3.0, 4.0] {
        assert!((0.54..0.57).contains(&hips(time).y), "{time} s: {}", hips(time));
    }
    assert!(lean(event(&file, "leave")) > 25.0, "it leans before it leaves the seat");
}
