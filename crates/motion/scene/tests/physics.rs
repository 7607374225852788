//! Doors, boxes, buttons: what they do is what mechanics says.

mod common;

use std::f32::consts::FRAC_PI_2;

use ambulo_rig::glam::{Quat, Vec2, Vec3};
use ambulo_rig::{Terrain, Transform};
use ambulo_scene::{Kind, Physics, Push, Refused, STEP, What};
use common::{BOX, BUTTON, DOOR, FLAT, LEVER, scene, seconds};

const G: f32 = 9.81;

fn spin(physics: &Physics, object: usize) -> f32 {
    physics.velocity(object).unwrap().1.length()
}

#[test]
fn a_driven_door_swings_to_its_angle_and_stops_at_its_limits() {
    for (wanted, expected) in [(1.0, 1.0_f32), (-0.8, -0.8), (9.0, 1.6), (-9.0, -1.6)] {
        let mut physics = scene(&[DOOR]);
        physics.drive(0, wanted, 60.0).unwrap();
        let mut most = 0.0_f32;
        seconds(&mut physics, 3.0, |physics| most = most.max(physics.joint(0).unwrap().abs()));
        assert!(most < expected.abs() + 0.005, "{wanted}: swung to {most}");
        let angle = physics.joint(0).unwrap();
        assert!((angle - expected).abs() < 0.002, "{wanted}: {angle}");
        // The leaf hangs where it did: 2 mm at its hinge.
        let hinge = physics.part(0, 1).unwrap().translation - Vec3::X * 0.45;
        assert!(hinge.length() < 0.002, "{hinge}");
    }
}

/// I = m w² / 3 about the hinge; a limited torque gives no more than ω = T t / I.
#[test]
fn the_torque_is_limited() {
    let mut physics = scene(&[DOOR]);
    let (torque, time) = (5.0, 0.5);
    physics.drive(0, 1.5, torque).unwrap();
    seconds(&mut physics, time, |_| ());
    let inertia = 20.0 * (0.9 * 0.9 + 0.04 * 0.04) / 3.0;
    let (speed, free) = (spin(&physics, 0), torque * time / inertia);
    assert!(speed < free * 1.05 && speed > free * 0.8, "{speed}, without friction {free}");
    physics.drive(0, 1.5, 0.0).unwrap();
    seconds(&mut physics, 0.1, |_| ());
    assert!(spin(&physics, 0) < speed * 1.001);
}

/// Let go of while it swings, a door slows down as I dω/dt = -c ω says, and never speeds up, not even
/// where it strikes its limit.
#[test]
fn a_passive_door_never_gains_energy() {
    let mut physics = scene(&[DOOR]);
    physics.drive(0, 1.6, 25.0).unwrap();
    seconds(&mut physics, 0.45, |_| ());
    physics.release(0).unwrap();
    seconds(&mut physics, STEP, |_| ());
    let (start, at) = (spin(&physics, 0), physics.joint(0).unwrap());
    assert!(start > 0.8, "{start}");
    let (mut last, mut worst) = (start, 0.0_f32);
    let mut after = None;
    let mut time = 0.0;
    seconds(&mut physics, 4.0, |physics| {
        let now = spin(physics, 0);
        worst = worst.max(now - last);
        last = now;
        time += STEP;
        if time > 0.195 && after.is_none() {
            after = Some((time, now));
        }
    });
    assert!(worst < 1e-3 * start, "gained {worst} rad/s of {start}");
    let inertia = 20.0 * (0.9 * 0.9 + 0.04 * 0.04) / 3.0;
    let (time, speed) = after.unwrap();
    let expected = start * (-2.0 * time / inertia).exp();
    assert!((speed / expected - 1.0).abs() < 0.1, "{speed}, expected {expected} (from {at})");
}

/// A box that slides is slowed by μ g.
#[test]
fn a_sliding_box_is_slowed_by_its_friction() {
    for friction in [0.2, 0.4, 0.8] {
        let mut physics =
            scene(&[&BOX.replace("friction = 0.5", &format!("friction = {friction}"))]);
        seconds(&mut physics, 0.5, |_| ());
        let speed = 3.0;
        physics.push(0, Some(Push { velocity: Vec2::X * speed, force: 1e5 })).unwrap();
        seconds(&mut physics, 0.2, |_| ());
        physics.push(0, None).unwrap();
        let at = |physics: &Physics| physics.part(0, 0).unwrap().translation;
        let (start, began) = (at(&physics), physics.velocity(0).unwrap().0.x);
        assert!((began - speed).abs() < 0.1 * speed, "pushed to {began}");
        seconds(&mut physics, 3.0, |_| ());
        // What is shown at the start is one step older than its velocity.
        let (way, shown) = (at(&physics).x - start.x, began * STEP);
        let expected = shown + began * began / (2.0 * friction * G);
        assert!(
            (way / expected - 1.0).abs() < 0.03,
            "μ = {friction}: {way} m, expected {expected}"
        );
        assert!(physics.velocity(0).unwrap().0.length() < 1e-3);
    }
}

/// It takes μ m g to move a box: a tenth less moves nothing, a tenth more does.
#[test]
fn a_push_must_overcome_friction() {
    let weight = 0.5 * 20.0 * G;
    for (share, moves) in [(0.9, false), (1.1, true)] {
        let mut physics = scene(&[BOX]);
        seconds(&mut physics, 0.5, |_| ());
        physics.push(0, Some(Push { velocity: Vec2::Y, force: weight * share })).unwrap();
        let before = physics.part(0, 0).unwrap().translation;
        seconds(&mut physics, 2.0, |_| ());
        let (velocity, _) = physics.velocity(0).unwrap();
        let way = physics.part(0, 0).unwrap().translation.distance(before);
        assert_eq!(way > 0.1, moves, "{share}: {way} m");
        assert!(!moves || (velocity.z > 0.5 && velocity.z < 1.05), "{velocity}");
    }
    let physics = scene(&[BOX]);
    assert_eq!(physics.ease(0, weight * 0.9), Ok(0.0));
    assert!((physics.ease(0, weight * 2.0).unwrap() - 0.5).abs() < 1e-5);
}

#[test]
fn a_pushed_box_stops_at_a_wall() {
    let wall = "[[wall]]\nstart = [2.0, -3.0]\nend = [2.0, 3.0]\nheight = 2.0\n";
    let mut physics = common::scene_of(&format!("{FLAT}{wall}{BOX}"));
    physics.push(0, Some(Push { velocity: Vec2::X, force: 400.0 })).unwrap();
    seconds(&mut physics, 5.0, |_| ());
    let at = physics.part(0, 0).unwrap().translation;
    assert!((at.x - (2.0 - 0.05 - 0.25)).abs() < 0.02, "{at}");
}

#[test]
fn a_stack_settles_and_stays() {
    let lifted = |lift: f32, name: &str| {
        BOX.replace("name = \"box\"", &format!("name = \"{name}\"\nlift = {lift}"))
    };
    let objects = [BOX.to_owned(), lifted(0.51, "b"), lifted(1.02, "c"), lifted(1.53, "d")];
    let mut physics = scene(&objects.each_ref().map(String::as_str));
    seconds(&mut physics, 4.0, |_| ());
    for (index, _) in objects.iter().enumerate() {
        let at = physics.part(index, 0).unwrap();
        let expected = Vec3::Y * (0.25 + 0.5 * index as f32);
        assert!(at.translation.distance(expected) < 0.02, "{index}: {}", at.translation);
        let (velocity, spin) = physics.velocity(index).unwrap();
        assert!(velocity.length() < 0.01 && spin.length() < 0.01, "{velocity} {spin}");
    }
}

#[test]
fn a_box_stays_on_a_slope_and_on_rugged_ground() {
    let slope = FLAT.replace("flat = { height = 0.0 }", "slope = { from = 0.0, to = 8.0 }");
    let rugged = "[[ground]]\nplace = [0.0, 0.0]\nsize = [20.0, 20.0]\n\
                  kind.rugged = { height = 0.0, rise = 0.6, wave = 8.0, seed = 4 }\n";
    for ground in [slope, format!("{FLAT}{rugged}")] {
        let mut physics = common::scene_of(&format!("{ground}{BOX}"));
        seconds(&mut physics, 4.0, |_| ());
        let at = physics.part(0, 0).unwrap().translation;
        assert!(Vec2::new(at.x, at.z).length() < 0.3, "slid to {at}");
        let over = at.y - physics.height(at.x, at.z);
        assert!((0.15..0.4).contains(&over), "{over} m over the ground");
    }
}

#[test]
fn a_button_goes_in_and_comes_back() {
    let mut physics = scene(&[BUTTON]);
    seconds(&mut physics, 0.5, |_| ());
    assert!(physics.joint(0).unwrap().abs() < 1e-3);
    physics.drive(0, 1.0, 20.0).unwrap();
    seconds(&mut physics, 0.5, |_| ());
    assert!((physics.joint(0).unwrap() - 0.02).abs() < 2e-3, "{:?}", physics.joint(0));
    // 2 N against 400 N/m: 5 mm.
    physics.drive(0, 1.0, 2.0).unwrap();
    seconds(&mut physics, 0.5, |_| ());
    assert!((physics.joint(0).unwrap() - 0.005).abs() < 1e-3, "{:?}", physics.joint(0));
    physics.release(0).unwrap();
    seconds(&mut physics, 0.5, |_| ());
    assert!(physics.joint(0).unwrap().abs() < 1e-3);
}

#[test]
fn a_lever_is_laid_over() {
    let mut physics = scene(&[LEVER]);
    physics.drive(0, 0.6, 30.0).unwrap();
    seconds(&mut physics, 1.0, |_| ());
    assert!((physics.joint(0).unwrap() - 0.6).abs() < 0.02);
    let grip = physics.frame(0, "grip").unwrap().translation;
    assert!(grip.distance(Vec3::new(0.0, 0.8 + 0.4 * 0.825, 0.4 * 0.565)) < 0.02, "{grip}");
}

/// Carried along a line at 1.5 m/s, let go: it flies on at 1.5 m/s, whatever the caller's rate.
#[test]
fn what_is_let_go_keeps_its_velocity() {
    for rate in [30.0, 60.0, 97.0, 144.0] {
        let mut physics = scene(&[BOX]);
        seconds(&mut physics, 0.2, |_| ());
        let shown = physics.part(0, 0).unwrap();
        let start = Transform::new(Vec3::new(0.3, 1.0, 0.2), Quat::from_rotation_y(0.4));
        physics.attach(0, start).unwrap();
        assert_eq!(physics.part(0, 0).unwrap(), shown, "it jumped as it was taken");
        let frames = rate as usize;
        for frame in 1..=frames {
            let time = frame as f32 / rate;
            let place = start.translation + Vec3::new(1.5 * time, 0.5 * time, 0.0);
            physics.carry(0, Transform::new(place, start.rotation)).unwrap();
            physics.step(1.0 / rate).unwrap();
        }
        let (held, wanted) = (physics.part(0, 0).unwrap(), Vec3::new(1.5, 0.5, 0.0));
        assert!(held.translation.distance(shown.translation + wanted) < 1e-3, "{rate} Hz");
        physics.detach(0).unwrap();
        assert!(physics.part(0, 0).unwrap().translation.distance(held.translation) < 1e-4);
        let (velocity, spin) = physics.velocity(0).unwrap();
        assert!(velocity.distance(wanted) < 0.05 && spin.length() < 0.05, "{rate} Hz: {velocity}");
        seconds(&mut physics, 3.0, |_| ());
        let at = physics.part(0, 0).unwrap().translation;
        assert!((at.y - 0.25).abs() < 0.02 && at.x > 1.6, "{at}");
    }
}

/// A holder that jumps across the room does not throw what it holds.
#[test]
fn what_is_let_go_in_a_jump_stays_sane() {
    let mut physics = scene(&[BOX]);
    let far = Transform::new(Vec3::new(50.0, 1.0, 0.0), Quat::from_rotation_x(3.0));
    physics.attach(0, Transform::IDENTITY).unwrap();
    physics.carry(0, far).unwrap();
    physics.step(STEP).unwrap();
    physics.detach(0).unwrap();
    let (velocity, spin) = physics.velocity(0).unwrap();
    assert!(velocity.length() < 10.01 && spin.length() < 15.01, "{velocity} {spin}");
    seconds(&mut physics, 1.0, |_| ());
    assert!(physics.part(0, 0).unwrap().is_finite());
    assert_eq!(physics.detach(0), Err(Refused::NotHeld));
}

/// The same path at every rate of the caller's: 1 mm and 1 mrad after a second.
#[test]
fn the_rate_of_the_caller_does_not_matter() {
    let run = |rate: usize| {
        let mut physics = scene(&[DOOR]);
        physics.drive(0, 1.2, 15.0).unwrap();
        for _ in 0..rate {
            physics.step(1.0 / rate as f32).unwrap();
        }
        physics.joint(0).unwrap()
    };
    let expected = run(60);
    for rate in [20, 30, 144, 240] {
        let angle = run(rate);
        assert!((angle - expected).abs() < 0.02, "{rate} Hz: {angle}, at 60 Hz {expected}");
    }
}

#[test]
fn the_same_calls_give_the_same_bits() {
    let run = |extra: bool| {
        let mut physics = scene(&[DOOR, BOX, BUTTON, LEVER]);
        physics.place_character(Vec3::new(0.0, 0.0, 2.0), 0.25, 1.75).unwrap();
        physics.drive(0, 1.4, 30.0).unwrap();
        physics.push(1, Some(Push { velocity: Vec2::new(0.7, 0.4), force: 300.0 })).unwrap();
        physics.drive(2, 0.01, 10.0).unwrap();
        let mut hashes = vec![];
        for frame in 0..240_u16 {
            let to = Vec3::new(0.0, 0.0, 2.0 - f32::from(frame) * 0.02);
            physics.move_character(to).unwrap();
            physics.step(if frame % 3 == 0 { 0.011 } else { 0.019 }).unwrap();
            hashes.push(physics.hash());
        }
        if extra {
            physics.step(STEP).unwrap();
        }
        (hashes, physics.hash())
    };
    let (first, end) = run(false);
    assert_eq!(run(false).0, first);
    assert_ne!(run(true).1, end);
    let again = std::thread::spawn(move || run(false)).join().unwrap();
    assert_eq!(again.0, first);
}

/// Golden: another machine or build that gives another number is not deterministic.
#[test]
fn a_known_run_has_a_known_hash() {
    let mut physics = scene(&[DOOR, BOX]);
    physics.drive(0, 1.4, 30.0).unwrap();
    physics.push(1, Some(Push { velocity: Vec2::new(0.7, 0.4), force: 300.0 })).unwrap();
    seconds(&mut physics, 2.0, |_| ());
    assert_eq!(physics.hash(), common::GOLDEN, "0x{:016x}", physics.hash());
}

#[test]
fn rays_meet_what_is_there() {
    let mut physics = scene(&[DOOR]);
    // From a character's own eyes: it does not see itself.
    physics.place_character(Vec3::new(0.1, 0.0, 3.0), 0.25, 1.75).unwrap();
    physics.step(STEP).unwrap();
    let hit = physics.ray(Vec3::new(0.1, 1.5, 3.0), Vec3::NEG_Z * 7.0, 10.0).unwrap().unwrap();
    assert_eq!(hit.what, What::Object { object: 0, part: 1 });
    assert!((hit.distance - 2.98).abs() < 1e-3 && (hit.normal - Vec3::Z).length() < 1e-3);
    let hit = physics.ray(Vec3::new(5.0, 3.0, 5.0), Vec3::NEG_Y, 10.0).unwrap().unwrap();
    assert!(hit.what == What::Ground && hit.point.y.abs() < 1e-3);
    assert_eq!(physics.ray(Vec3::new(5.0, 3.0, 5.0), Vec3::NEG_Y, 2.0), Ok(None));
    assert_eq!(physics.ray(Vec3::ZERO, Vec3::ZERO, 2.0), Err(Refused::Number));
}

#[test]
fn frames_move_with_their_parts() {
    let mut physics = scene(&[DOOR]);
    let closed = physics.frame(0, "handle_front").unwrap().translation;
    physics.drive(0, FRAC_PI_2, 100.0).unwrap();
    seconds(&mut physics, 2.0, |_| ());
    let open = physics.frame(0, "handle_front").unwrap().translation;
    assert!(closed.z < 0.1 && open.z > 0.7, "{closed} → {open}");
    assert_eq!(physics.frame(0, "nose"), None);
    assert_eq!(physics.frame(9, "object"), None);
}

/// Everything that a caller hands over may be wrong; nothing changes then.
#[test]
fn what_is_not_a_number_is_refused() {
    let mut physics = scene(&[DOOR, BOX, BUTTON]);
    physics.place_character(Vec3::new(3.0, 0.0, 3.0), 0.25, 1.75).unwrap();
    seconds(&mut physics, 0.5, |_| ());
    let before = physics.hash();
    let kind = Kind::Box(ambulo_scene::MovableBox { size: [1.0; 3], mass: 1.0, friction: 1.0 });
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
        let wild = Transform::new(Vec3::splat(bad), Quat::IDENTITY);
        let turned = Transform::new(Vec3::ZERO, Quat::from_xyzw(bad, 0.0, 0.0, 1.0));
        assert!(bad == 1e30 || physics.step(bad).is_err());
        assert_eq!(physics.drive(0, bad, 1.0), Err(Refused::Number));
        assert_eq!(physics.drive(0, 1.0, bad), Err(Refused::Number));
        let push = |velocity, force| Some(Push { velocity, force });
        assert_eq!(physics.push(1, push(Vec2::splat(bad), 1.0)), Err(Refused::Number));
        assert_eq!(physics.push(1, push(Vec2::X, bad)), Err(Refused::Number));
        assert_eq!(physics.attach(1, wild), Err(Refused::Number));
        assert_eq!(physics.attach(1, turned), Err(Refused::Number));
        assert_eq!(physics.move_character(Vec3::splat(bad)), Err(Refused::Number));
        assert_eq!(physics.place_character(Vec3::splat(bad), 0.3, 1.7), Err(Refused::Number));
        assert_eq!(physics.place_character(Vec3::ZERO, bad, 1.7), Err(Refused::Number));
        assert_eq!(physics.ray(Vec3::splat(bad), Vec3::X, 1.0), Err(Refused::Number));
        assert_eq!(physics.ray(Vec3::ZERO, Vec3::X, bad), Err(Refused::Number));
        assert!(physics.height(bad, bad).is_finite());
    }
    assert_eq!(physics.step(-0.1), Err(Refused::Number));
    assert_eq!(physics.push(0, None), Err(Refused::Kind(ambulo_scene::ObjectKind::Door)));
    assert_eq!(physics.drive(1, 0.0, 1.0), Err(Refused::Kind(kind.kind())));
    assert_eq!(physics.drive(9, 0.0, 1.0), Err(Refused::Object));
    assert_eq!(physics.carry(1, Transform::IDENTITY), Err(Refused::NotHeld));
    assert_eq!(physics.hash(), before);
    let step = physics.step(100.0).unwrap();
    assert!(step.steps <= 16 && step.skipped > 99.0);
}

/// Slowly at the end, so that an engine would take it for asleep; from wherever it was left.
#[test]
fn a_closer_shuts_the_door() {
    let closing = DOOR.replace("damping = 2.0 }", "damping = 3.0, closer = 1.0 }");
    for angle in [1.4, -1.4] {
        let mut physics = scene(&[&closing]);
        physics.drive(0, angle, 60.0).unwrap();
        seconds(&mut physics, 2.0, |_| ());
        assert!((physics.joint(0).unwrap() - angle).abs() < 0.05);
        physics.release(0).unwrap();
        seconds(&mut physics, 3.0, |_| ());
        let left = physics.joint(0).unwrap() / angle;
        assert!((0.2..0.6).contains(&left), "{left} is left after one time constant");
        seconds(&mut physics, 12.0, |_| ());
        assert!(physics.joint(0).unwrap().abs() < 0.02, "{:?}", physics.joint(0));
    }
}
