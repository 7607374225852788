//! Nothing solid lets a character through.

mod common;

use std::f32::consts::PI;

use ambulo_rig::Transform;
use ambulo_rig::glam::{Quat, Vec3};
use ambulo_scene::{Physics, Refused, STEP, What};
use common::{BOX, DOOR, FLAT, scene, scene_of, seconds};

const RADIUS: f32 = 0.25;
const HEIGHT: f32 = 1.75;

/// Walks at 1.4 m/s towards a place for some seconds; where it gets to and what it met last.
fn walk(physics: &mut Physics, to: Vec3, time: f32) -> (Vec3, Option<What>) {
    let mut met = None;
    for _ in 0..(time / STEP) as usize {
        let at = physics.character().unwrap();
        let next = at + (to - at).clamp_length_max(1.4 * STEP);
        let moved = physics.move_character(next).unwrap();
        met = moved.met.or(met);
        physics.step(STEP).unwrap();
        assert!(moved.feet.is_finite() && moved.feet.y == next.y);
    }
    (physics.character().unwrap(), met)
}

#[test]
fn a_closed_door_stops_it_and_an_open_one_does_not() {
    let mut physics = scene(&[DOOR]);
    // Held shut: 200 N·m towards 0.
    physics.drive(0, 0.0, 200.0).unwrap();
    physics.place_character(Vec3::new(0.0, 0.0, 2.0), RADIUS, HEIGHT).unwrap();
    let (at, met) = walk(&mut physics, Vec3::new(0.0, 0.0, -2.0), 4.0);
    assert!((at.z - (0.02 + RADIUS + 0.01)).abs() < 0.01, "{at}");
    assert_eq!(met, Some(What::Object { object: 0, part: 1 }));
    assert!(physics.joint(0).unwrap().abs() < 0.02);
    physics.drive(0, -1.6, 60.0).unwrap();
    seconds(&mut physics, 2.0, |_| ());
    let (at, _) = walk(&mut physics, Vec3::new(-0.1, 0.0, -2.0), 4.0);
    assert!(at.distance(Vec3::new(-0.1, 0.0, -2.0)) < 0.01, "{at}");
}

/// A leaf that is driven against someone stops there.
#[test]
fn a_door_does_not_sweep_through_it() {
    let mut physics = scene(&[DOOR]);
    physics.place_character(Vec3::new(-0.1, 0.0, 0.45), RADIUS, HEIGHT).unwrap();
    physics.drive(0, 1.5, 30.0).unwrap();
    seconds(&mut physics, 3.0, |_| ());
    let angle = physics.joint(0).unwrap();
    assert!((0.1..0.6).contains(&angle), "{angle}");
    assert_eq!(physics.character(), Some(Vec3::new(-0.1, 0.0, 0.45)));
}

#[test]
fn boxes_chairs_and_walls_stop_it() {
    let chair = "[[object]]\nname = \"chair\"\nplace = [0.0, 0.0]\n\
        kind.chair = { seat_height = 0.45, seat_depth = 0.5, width = 0.5, back_height = 0.9 }\n";
    let wall = "[[wall]]\nstart = [-3.0, 0.0]\nend = [3.0, 0.0]\nheight = 2.0\nthickness = 0.5\n";
    for solid in [BOX, chair, wall] {
        let mut physics = scene_of(&format!("{FLAT}{solid}"));
        physics.place_character(Vec3::new(0.0, 0.0, 2.0), RADIUS, HEIGHT).unwrap();
        let (at, met) = walk(&mut physics, Vec3::new(0.0, 0.0, -2.0), 3.0);
        // Straight on it stops before it: nothing is pushed by walking into it.
        assert!(at.z > 0.25 + RADIUS && at.z < 0.25 + RADIUS + 0.03, "{at}: {solid}");
        assert!(met.is_some() && at.x.abs() < 0.01);
    }
}

/// Along a wall that is met at a slant, at the speed that is left.
#[test]
fn it_slides_along_a_wall() {
    let wall = "[[wall]]\nstart = [-9.0, 0.0]\nend = [9.0, 0.0]\nheight = 2.0\n";
    let mut physics = scene_of(&format!("{FLAT}{wall}"));
    physics.place_character(Vec3::new(0.0, 0.0, 0.5), RADIUS, HEIGHT).unwrap();
    for _ in 0..180 {
        let at = physics.character().unwrap();
        physics.move_character(at + Vec3::new(0.02, 0.0, -0.02)).unwrap();
        physics.step(STEP).unwrap();
    }
    let at = physics.character().unwrap();
    assert!((at.x - 3.6).abs() < 0.15, "{at}");
    assert!(at.z > 0.05 + RADIUS - 0.001 && at.z < 0.05 + RADIUS + 0.03, "{at}");
}

/// Any way into a corner ends in it: no way round, no jitter through.
#[test]
fn a_corner_holds_it() {
    let walls = "[[wall]]\nstart = [-9.0, 0.0]\nend = [9.0, 0.0]\nheight = 2.0\n\
                 [[wall]]\nstart = [2.0, -9.0]\nend = [2.0, 9.0]\nheight = 2.0\n";
    for turn in 1..8 {
        let mut physics = scene_of(&format!("{FLAT}{walls}"));
        physics.place_character(Vec3::new(1.0, 0.0, 1.0), RADIUS, HEIGHT).unwrap();
        let angle = PI / 2.0 * turn as f32 / 8.0;
        for _ in 0..600 {
            let at = physics.character().unwrap();
            physics.move_character(at + Vec3::new(angle.sin(), 0.0, -angle.cos()) * 0.05).unwrap();
            physics.step(STEP).unwrap();
        }
        let at = physics.character().unwrap();
        let room = 0.05 + RADIUS;
        assert!(at.z > room - 0.002 && at.x < 2.0 - room + 0.002, "{turn}: {at}");
        assert!(at.z < room + 0.05 && at.x > 2.0 - room - 0.05, "{turn}: {at}");
    }
}

/// A fast one, 20 m/s, does not tunnel through a leaf of 4 cm.
#[test]
fn nothing_is_tunnelled_through() {
    let mut physics = scene(&[DOOR]);
    physics.drive(0, 0.0, 500.0).unwrap();
    physics.place_character(Vec3::new(0.0, 0.0, 3.0), RADIUS, HEIGHT).unwrap();
    let moved = physics.move_character(Vec3::new(0.0, 0.0, -3.0)).unwrap();
    assert!(moved.feet.z > 0.2, "{}", moved.feet);
}

#[test]
fn what_it_carries_is_not_in_its_way() {
    let mut physics = scene(&[BOX]);
    physics.place_character(Vec3::new(0.0, 0.0, 0.6), RADIUS, HEIGHT).unwrap();
    let hand = |feet: Vec3| Transform::new(feet + Vec3::new(0.0, 1.0, -0.5), Quat::IDENTITY);
    physics.attach(0, hand(Vec3::new(0.0, 0.0, 0.6))).unwrap();
    for frame in 0..120_u8 {
        let feet = Vec3::new(0.0, 0.0, 0.6 - f32::from(frame) * 0.02);
        assert_eq!(physics.move_character(feet).unwrap().met, None);
        physics.carry(0, hand(feet)).unwrap();
        physics.step(STEP).unwrap();
    }
    assert!(physics.part(0, 0).unwrap().translation.z < -2.0);
}

#[test]
fn without_a_character_there_is_none_to_move() {
    let mut physics = scene(&[BOX]);
    assert_eq!(physics.move_character(Vec3::ZERO), Err(Refused::Character));
    assert_eq!(physics.character(), None);
    assert_eq!(physics.place_character(Vec3::ZERO, 0.9, 1.75), Err(Refused::Number));
    physics.place_character(Vec3::X, 0.3, 1.75).unwrap();
    physics.place_character(Vec3::Z * 3.0, 0.25, 1.6).unwrap();
    assert_eq!(physics.character(), Some(Vec3::Z * 3.0));
}
