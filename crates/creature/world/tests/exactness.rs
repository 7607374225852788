//! The same calls give the same bits: on every run, in every company, on every thread.

mod common;

use ambulo_world::{Ground, Physics, World};
use common::{alone, path, starter};

const CREATURES: [&str; 4] = ["apod", "biped2", "tetrapod2", "decapod2"];

#[test]
fn a_path_does_not_depend_on_who_shares_the_world() {
    for name in CREATURES {
        let body = starter(name);
        let expected = path(&mut alone(&body, &Physics::default()), &body, 0, 0, 400);
        for company in [2, 3, 12] {
            let mut world = World::new(&body, &Physics::default(), company).unwrap();
            let got = path(&mut world, &body, 0, 0, 400);
            assert_eq!(got, expected, "{name} with {} others", company - 1);
        }
    }
}

#[test]
fn a_path_does_not_depend_on_the_place_among_others() {
    let body = starter("tetrapod2");
    let mut last = World::new(&body, &Physics::default(), 5).unwrap();
    let mut hash = 0;
    let mut expected = 0;
    let mut single = alone(&body, &Physics::default());
    for step in 0..300 {
        for joint in 0..body.joints().len() {
            for other in 0..4 {
                last.set_motor(other, joint, common::wave(3 * step + other, joint)).unwrap();
            }
            last.set_motor(4, joint, common::wave(step, joint)).unwrap();
            single.set_motor(0, joint, common::wave(step, joint)).unwrap();
        }
        last.step().unwrap();
        single.step().unwrap();
        (hash, expected) = (last.hash(4, hash), single.hash(0, expected));
    }
    assert_eq!(hash, expected);
}

#[test]
fn a_path_does_not_depend_on_the_thread() {
    let body = starter("tetrapod2");
    let here = path(&mut alone(&body, &Physics::default()), &body, 0, 0, 200);
    std::thread::scope(|scope| {
        let walk = || path(&mut alone(&body, &Physics::default()), &body, 0, 0, 200);
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(walk)).collect();
        for thread in threads {
            assert_eq!(thread.join().unwrap(), here);
        }
    });
}

#[test]
fn a_restored_world_goes_on_as_it_did() {
    let body = starter("tetrapod2");
    for ground in [Ground::Flat, Ground::Rough { height: 0.1, spacing: 0.4, seed: 3 }] {
        let physics = Physics { ground, ..Physics::default() };
        let mut world = alone(&body, &physics);
        path(&mut world, &body, 0, 0, 150);
        let saved = world.save().unwrap();
        let before = world.pose(0, 0);
        let first = path(&mut world, &body, 0, 150, 150);
        assert_ne!(world.pose(0, 0), before);
        world.restore(&saved).unwrap();
        assert_eq!(world.pose(0, 0), before);
        assert_eq!(path(&mut world, &body, 0, 150, 150), first, "{ground:?}");
        // And again from the same state.
        world.restore(&saved).unwrap();
        assert_eq!(path(&mut world, &body, 0, 150, 150), first, "{ground:?}");
    }
}

/// If one of these changes, champions that were saved no longer replay: that is a new format.
#[test]
fn golden_paths() {
    let hilly = Ground::Rough { height: 0.15, spacing: 0.5, seed: 7 };
    let stair = Ground::Steps { height: 0.05, length: 0.6 };
    let golden = [
        ("apod", Ground::Flat, "639381875af5f4c8"),
        ("biped1", Ground::Flat, "5c3afefaaf545e39"),
        ("tetrapod2", Ground::Flat, "ce022443e236a1ae"),
        ("decapod2", Ground::Flat, "52be1ff5c034618e"),
        ("tetrapod2", hilly, "d82da25c33ac2d14"),
        ("raptor", stair, "9b9b964e0f350b00"),
    ];
    let found = golden.map(|(name, ground, _)| {
        let body = starter(name);
        let physics = Physics { ground, ..Physics::default() };
        format!("{:016x}", path(&mut alone(&body, &physics), &body, 0, 0, 600))
    });
    assert_eq!(found, golden.map(|(.., hash)| hash));
}
