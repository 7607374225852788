//! The scene and the interactions that ship can be read, fit each other, and make sense.

mod common;

use std::collections::HashMap;

use ambulo_rig::Terrain;
use ambulo_rig::glam::{Vec2, Vec3};
use ambulo_scene::{Action, Interaction, Limb, Physics, Scene, When};
use common::playground::playground;

fn interactions() -> HashMap<String, Interaction> {
    common::playground::interactions().into_iter().collect()
}

#[test]
fn all_that_ships_is_read_and_offered() {
    let (scene, all) = (playground(), interactions());
    scene.check_interactions(|file| all.get(file)).unwrap();
    for file in all.keys() {
        let offered = scene.objects.iter().any(|object| object.interactions.contains(file));
        assert!(offered, "nothing offers {file}");
    }
    assert!(all.len() >= 12);
    assert_eq!(Scene::parse(&scene.to_text()).unwrap(), scene);
    for one in all.values() {
        assert_eq!(&Interaction::parse(&one.to_text()).unwrap(), one);
    }
}

/// Who stands where the clip begins is within the trigger, faces what it will touch, and reaches it
/// with the hand of the right side.
#[test]
fn hands_reach_what_they_take() {
    let (scene, all) = (playground(), interactions());
    let physics = Physics::new(&scene).unwrap();
    for (index, object) in scene.objects.iter().enumerate() {
        for file in &object.interactions {
            let one = &all[file];
            let frame = |name: &str| physics.frame(index, name).unwrap();
            let (place, yaw) = one.approach.stand(frame(&one.approach.on));
            let feet = Vec3::new(place.x, physics.height(place.x, place.y), place.y);
            let within = frame(&one.trigger.on).inverse().transform_point(feet);
            assert!(one.trigger.volume.contains(within), "{file}: {within}");
            let (ahead, left) = (Vec2::new(yaw.sin(), yaw.cos()), Vec2::new(yaw.cos(), -yaw.sin()));
            for target in &one.targets {
                let at = (frame(&target.on) * target.place()).translation - feet;
                let flat = Vec2::new(at.x, at.z);
                let side = flat.dot(left);
                match target.limb {
                    // The far hand crosses the body, but not by more than an arm allows.
                    Limb::LeftHand => assert!(side > -0.15, "{file}: left hand at {side}"),
                    Limb::RightHand => assert!(side < 0.15, "{file}: right hand at {side}"),
                    Limb::Hips => assert!(flat.length() < 0.6, "{file}: hips {flat}"),
                    _ => {}
                }
                if matches!(target.limb, Limb::LeftHand | Limb::RightHand) {
                    assert!(flat.dot(ahead) > 0.2 && flat.length() < 0.65, "{file}: {flat}");
                    assert!((0.1..1.4).contains(&at.y), "{file}: {} m high", at.y);
                    // Fingers never point back at who has them.
                    let fingers = frame(&target.on).rotation * target.place().rotation * Vec3::Z;
                    assert!(Vec2::new(fingers.x, fingers.z).dot(ahead) > -0.1, "{file}: {fingers}");
                }
            }
        }
    }
}

/// The door opens away from who pushes it, from either side.
#[test]
fn the_door_opens_away() {
    for (name, one) in interactions() {
        let Some(Action::Hinge { angle, .. }) = one.action else { continue };
        if name.starts_with("open_door_front") {
            assert!(angle < -1.0 && one.exit.place.unwrap()[1] < 0.0, "{name}");
        }
        if name.starts_with("open_door_back") {
            assert!(angle > 1.0 && one.exit.place.unwrap()[1] > 0.0, "{name}");
        }
    }
}

/// Someone who sits can get up again.
#[test]
fn every_hold_can_be_left() {
    for (name, one) in interactions() {
        assert_eq!(one.clip.hold_repeats, one.exit.when != When::ClipEnds, "{name}");
    }
}

/// Left alone, nothing in it moves by more than a box settles.
#[test]
fn the_playground_stays_as_it_was_laid_out() {
    let scene = playground();
    let mut physics = Physics::new(&scene).unwrap();
    let places = |physics: &Physics| -> Vec<Vec3> {
        let all =
            (0..physics.objects()).flat_map(|o| (0..physics.parts(o).len()).map(move |p| (o, p)));
        all.map(|(o, p)| physics.part(o, p).unwrap().translation).collect()
    };
    let before = places(&physics);
    for _ in 0..120 {
        physics.step(1.0 / 60.0).unwrap();
    }
    for (a, b) in before.iter().zip(places(&physics)) {
        assert!(a.distance(b) < 0.01, "{a} → {b}");
    }
}
