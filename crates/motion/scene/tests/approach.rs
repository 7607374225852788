//! Characters that walk to where an interaction begins, by the starter model.

use std::f32::consts::{PI, TAU};
use std::sync::{Arc, OnceLock};

use ambulo_control::{Areas, Controller, Intent, Model, Root, Wall, World};
use ambulo_net::Bundle;
use ambulo_rig::glam::Vec2;
use ambulo_rig::{Flat, wrapped};
use ambulo_scene::{Approach, Gait, Going, Walk, Why};

const DT: f32 = 1.0 / 60.0;

fn model() -> Model {
    static MODEL: OnceLock<Model> = OnceLock::new();
    let read = || {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../starters/human.safetensors");
        let bundle = Bundle::from_bytes(&std::fs::read(path).unwrap()).unwrap();
        Model::new(Arc::new(bundle)).unwrap()
    };
    MODEL.get_or_init(read).clone()
}

fn approach(distance: f32, angle: f32, gait: Gait) -> Approach {
    let (place, facing) = ([0.0, 0.0], 0.0);
    Approach { on: "object".into(), place, facing, gaits: vec![gait], distance, angle }
}

/// Who walks there from the origin, looking along +Z: how it ends, where, after how long, and the
/// farthest that the root moved in a frame.
fn walked(
    approach: &Approach,
    to: (Vec2, f32),
    walls: &[Wall],
    wish: impl Fn(f32) -> Vec2,
) -> (Going, Root, f32, f32) {
    let areas = Areas { walls: walls.to_vec(), ..Areas::default() };
    let world = World { terrain: &Flat(0.0), areas: &areas };
    let model = model();
    let tuning = model.tuning();
    let mut character = Controller::new(model, tuning, Vec2::ZERO, 0.0, &world).unwrap();
    let mut walk = Walk::new(approach, to);
    let mut most = 0.0f32;
    for frame in 0..1800 {
        let (time, root) = (frame as f32 * DT, character.root());
        match walk.step(root, wish(time), DT) {
            Going::On(intent) => {
                assert!(intent.is_valid());
                character.step(DT, &intent, &world);
                most = most.max(character.root().position.distance(root.position));
            }
            end => return (end, root, time, most),
        }
    }
    panic!("it walks for ever");
}

fn nowhere(_: f32) -> Vec2 {
    Vec2::ZERO
}

#[test]
fn it_gets_there_from_everywhere_and_faces_what_it_should() {
    let asked = approach(0.1, 0.2, Gait::Walk);
    for direction in 0..8 {
        for facing in [0.0, 1.5, PI] {
            let bearing = direction as f32 * TAU / 8.0;
            let place = 3.0 * Vec2::new(bearing.sin(), bearing.cos());
            let (end, root, time, most) = walked(&asked, (place, facing), &[], nowhere);
            let which = (direction, facing);
            assert_eq!(end, Going::There, "{which:?} after {time} s");
            let off = place.distance(Vec2::new(root.position.x, root.position.z));
            let turn = wrapped(facing - root.yaw);
            assert!(
                off <= 0.1 && turn.abs() <= 0.2 && time < 12.0,
                "{which:?}: {off} {turn} {time}"
            );
            // By its own steps; who turns about on the spot hops a little, as the network does it.
            assert!(most < 0.065, "{which:?}: {most} m in a frame");
        }
    }
}

/// Whoever may only come running slows down in time.
#[test]
fn it_arrives_in_any_gait() {
    for gait in [Gait::Stand, Gait::Walk, Gait::Jog, Gait::Run, Gait::Crouch] {
        let asked = approach(0.2, 0.3, gait);
        let (end, _, time, _) = walked(&asked, (Vec2::new(1.0, 6.0), 0.5), &[], nowhere);
        assert_eq!(end, Going::There, "{gait:?} after {time} s");
    }
}

#[test]
fn who_is_there_does_not_move() {
    let asked = approach(0.1, 0.2, Gait::Walk);
    let (end, _, time, _) = walked(&asked, (Vec2::new(0.05, 0.0), 0.1), &[], nowhere);
    assert_eq!((end, time), (Going::There, 0.0));
}

#[test]
fn it_gives_up_when_the_way_is_blocked() {
    let wall = Wall { start: Vec2::new(-4.0, 1.5), end: Vec2::new(4.0, 1.5), width: 0.3 };
    let asked = approach(0.1, 0.2, Gait::Walk);
    let (end, root, time, _) = walked(&asked, (Vec2::new(0.0, 3.0), 0.0), &[wall], nowhere);
    assert_eq!(end, Going::GaveUp(Why::Blocked));
    assert!(time < 8.0 && root.position.z < 1.5, "{time} s, {root:?}");
}

#[test]
fn it_gives_up_when_the_player_wants_elsewhere_and_not_before() {
    let asked = approach(0.1, 0.2, Gait::Walk);
    let to = (Vec2::new(0.0, 3.0), 0.0);
    // Along with it, slowly away, or away for a moment: no reason.
    for wish in [Vec2::new(0.0, 1.0), Vec2::new(0.5, 0.5), Vec2::new(0.0, -0.2)] {
        assert_eq!(walked(&asked, to, &[], |_| wish).0, Going::There, "{wish}");
    }
    let twitch = |time: f32| Vec2::new(0.0, if (1.0..1.1).contains(&time) { -1.0 } else { 0.0 });
    assert_eq!(walked(&asked, to, &[], twitch).0, Going::There);
    let back = |time: f32| Vec2::new(0.0, if time > 1.0 { -1.0 } else { 0.0 });
    let (end, _, time, _) = walked(&asked, to, &[], back);
    assert_eq!(end, Going::GaveUp(Why::LedAway));
    assert!((1.15..1.3).contains(&time), "{time}");
}

#[test]
fn numbers_that_are_none_are_given_up_on() {
    let asked = approach(0.1, 0.2, Gait::Walk);
    let mut walk = Walk::new(&asked, (Vec2::new(f32::NAN, 0.0), 0.0));
    let root = Root { position: Default::default(), yaw: 0.0 };
    assert_eq!(walk.step(root, Vec2::ZERO, DT), Going::GaveUp(Why::Lost));
    let mut walk = Walk::new(&asked, (Vec2::new(2.0, 0.0), 0.0));
    assert!(matches!(walk.step(root, Vec2::splat(f32::NAN), DT), Going::On(Intent { .. })));
}
