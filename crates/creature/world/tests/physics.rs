//! Things fall, swing, slide and stand as they should.

mod common;

use ambulo_world::{Ground, Physics, World, WorldError};
use common::{alone, brick, starter, two_parts};

fn steps(world: &mut World, count: usize) {
    for _ in 0..count {
        world.step().unwrap();
    }
}

#[test]
fn creatures_start_on_the_ground_and_stand() {
    for name in ["apod", "biped1", "biped2", "tetrapod1", "tetrapod2", "decapod1", "decapod2"] {
        let body = starter(name);
        let mut world = alone(&body, &Physics::default());
        let before = world.centre(0, body.torso());
        assert!((before[1] - body.standing_height()).abs() < 1e-4, "{name}");
        steps(&mut world, 240);
        let after = world.centre(0, body.torso());
        assert!((after[1] - before[1]).abs() < 0.03, "{name} sank from {before:?} to {after:?}");
        assert!((after[0] - before[0]).abs() < 0.03, "{name} slid from {before:?} to {after:?}");
        assert!(world.turned(0, body.torso()).abs() < 0.05, "{name} tilted");
        let feet: Vec<_> = body.legs().iter().map(|leg| leg.foot).collect();
        assert!(feet.iter().all(|&foot| world.touches(0, foot)), "{name} has a foot in the air");
        assert!(feet.is_empty() || !world.touches(0, body.torso()), "{name} lies on its torso");
    }
}

#[test]
fn what_falls_gains_a_half_g_t_squared() {
    // Pushed up, it flies; nothing touches it for a while.
    let body = brick(0.8);
    let mut world = alone(&body, &Physics::default());
    for part in 0..2 {
        world.push(0, part, [1.0, 6.0]).unwrap();
    }
    let start = world.centre(0, 0);
    steps(&mut world, 60);
    let [x, y] = world.centre(0, 0);
    // A second: 6 m/s up, 1 m/s ahead. Box2D steps velocities first: half a sub-step's worth off.
    assert!((x - start[0] - 1.0).abs() < 1e-3, "{x}");
    assert!((y - start[1] - (6.0 - 0.5 * 9.81)).abs() < 0.03, "{y}");
    assert!(!world.touches(0, 0) && !world.touches(0, 1));
}

#[test]
fn a_pendulum_keeps_its_period() {
    // A light rod on a heavy block, its motor as weak as can be.
    let body = two_parts(
        r#""shape": {"box": {"width": 6.0, "height": 6.0}}, "position": [0, 3]"#,
        r#""shape": {"box": {"width": 0.04, "height": 1.2}}, "position": [0.26, 9.28], "angle": 0.2"#,
        r#""anchor": [0.379, 8.692], "limits": [-3, 3], "torque": 1e-3, "speed": 1"#,
    );
    // The anchor is at the rod's lower end and hangs in the air 2.7 m above the block.
    let mut world = alone(&body, &Physics::default());
    // A rod that stands on its lower end falls over and swings through: by energy, at the bottom it
    // turns at sqrt(3 g (1 + cos a) / L), a from the upright.
    let (mut fastest, mut last) = (0.0f32, world.joint_angle(0, 0));
    for _ in 0..240 {
        world.step().unwrap();
        let now = world.joint_angle(0, 0);
        let turn = (now - last).abs();
        last = now;
        if turn < 1.0 {
            fastest = fastest.max(turn * 60.0);
        }
    }
    let expected = (3.0f32 * 9.81 * (1.0 + 0.2f32.cos()) / 1.2).sqrt();
    assert!((fastest / expected - 1.0).abs() < 0.05, "{fastest} {expected}");
}

#[test]
fn friction_stops_a_slider_where_it_should() {
    for (friction, scale) in [(0.8, 1.0), (0.8, 0.5), (0.2, 1.0)] {
        let body = brick(friction);
        let physics = Physics { friction_scale: scale, ..Physics::default() };
        let mut world = alone(&body, &physics);
        steps(&mut world, 30);
        let start = world.centre(0, 0)[0];
        for part in 0..2 {
            world.push(0, part, [2.0, 0.0]).unwrap();
        }
        steps(&mut world, 240);
        let slid = world.centre(0, 0)[0] - start;
        // v² / (2 µ g), µ the geometric mean with the ground's.
        let mu = scale * (friction * 0.8f32).sqrt();
        let expected = 4.0 / (2.0 * mu * 9.81);
        assert!((slid / expected - 1.0).abs() < 0.08, "µ {mu}: {slid} for {expected}");
    }
}

#[test]
fn motors_turn_at_their_speed_and_stop_at_the_limit() {
    // A light arm on a heavy block, clear of the ground.
    let body = two_parts(
        r#""shape": {"box": {"width": 3.0, "height": 2.0}}, "position": [0, 1]"#,
        r#""shape": {"capsule": {"length": 0.5, "radius": 0.05}}, "position": [0, 2.25]"#,
        r#""anchor": [0, 2.0], "limits": [-1.5, 0.7], "torque": 100, "speed": 2"#,
    );
    let mut world = alone(&body, &Physics::default());
    world.set_motor(0, 0, 2.0).unwrap();
    steps(&mut world, 15);
    let quarter = world.joint_angle(0, 0);
    assert!((quarter - 0.5).abs() < 0.02, "half a radian in a quarter second: {quarter}");
    steps(&mut world, 60);
    assert!((world.joint_angle(0, 0) - 0.7).abs() < 0.02, "{}", world.joint_angle(0, 0));
    assert!(world.motor_torque(0, 0).unwrap() > 50.0, "it pushes against its limit");
    world.set_motor(0, 0, -2.0).unwrap();
    steps(&mut world, 150);
    assert!((world.joint_angle(0, 0) + 1.5).abs() < 0.02);
    assert!(matches!(world.set_motor(0, 0, f32::NAN), Err(WorldError::Engine(_))));
}

#[test]
fn scales_do_what_they_say() {
    let body = starter("tetrapod2");
    let hold = |physics: Physics| {
        let mut world = alone(&body, &physics);
        steps(&mut world, 120);
        (0..8).map(|joint| world.motor_torque(0, joint).unwrap().abs()).sum::<f32>()
    };
    let base = hold(Physics::default());
    let light = hold(Physics { gravity: 4.905, ..Physics::default() });
    let heavy = hold(Physics { mass_scale: 2.0, ..Physics::default() });
    assert!(light < base && heavy > base, "{light} {base} {heavy}");
    // Without torque nothing holds it up.
    let mut limp = alone(&body, &Physics { torque_scale: 0.0, ..Physics::default() });
    limp.push(0, body.torso(), [0.3, 0.0]).unwrap();
    steps(&mut limp, 240);
    assert!(limp.centre(0, body.torso())[1] < 0.8 * body.standing_height());
}

#[test]
fn ground_of_every_kind_carries() {
    let kinds = [
        (Ground::Slope { angle: -0.3 }, 3.5, -0.155),
        (Ground::Steps { height: 0.1, length: 1.0 }, 3.5, 0.1),
        (Ground::Rough { height: 0.3, spacing: 0.7, seed: 5 }, 6.1, f32::NAN),
    ];
    for (ground, x, height) in kinds {
        let outline = ground.outline();
        assert!(height.is_nan() || (outline.height(x) - height).abs() < 1e-3, "{ground:?}");
        // A ball dropped there ends up on the line, somewhere to its right or left.
        let body = two_parts(
            &format!(r#""shape": {{"circle": {{"radius": 0.2}}}}, "position": [{x}, 2.0]"#),
            &format!(r#""shape": {{"circle": {{"radius": 0.1}}}}, "position": [{x}, 2.0]"#),
            &format!(r#""anchor": [{x}, 2.0], "limits": [-1, 1], "torque": 50, "speed": 5"#),
        );
        let mut world = alone(&body, &Physics { ground, ..Physics::default() });
        assert!((world.centre(0, 0)[1] - 0.2 - outline.highest(x - 0.2, x + 0.2)).abs() < 1e-3);
        steps(&mut world, 90);
        let [x, y] = world.centre(0, 0);
        let above = y - outline.height(x);
        assert!(above > 0.1 && above < 0.6, "{ground:?}: {above} above the ground at {x}");
    }
}

#[test]
fn a_hole_is_fallen_into() {
    let body = two_parts(
        r#""shape": {"circle": {"radius": 0.1}}, "position": [3.3, 1.0]"#,
        r#""shape": {"circle": {"radius": 0.05}}, "position": [3.3, 1.0]"#,
        r#""anchor": [3.3, 1.0], "limits": [-1, 1], "torque": 50, "speed": 5"#,
    );
    let ground = Ground::Holes { width: 0.6, between: 3.0 };
    let mut world = alone(&body, &Physics { ground, ..Physics::default() });
    steps(&mut world, 120);
    assert!(world.centre(0, 0)[1] < -4.5, "{:?}", world.centre(0, 0));
}

#[test]
fn the_left_of_a_drawing_is_the_left_of_the_world() {
    // Raised on the left in the file, it is on the left in the world, and angles count the same way.
    let body = two_parts(
        r#""shape": {"box": {"width": 2.0, "height": 0.4}}, "position": [0, 0.2]"#,
        r#""shape": {"capsule": {"length": 0.6, "radius": 0.05}}, "position": [-0.8, 0.7]"#,
        r#""anchor": [-0.8, 0.4], "limits": [-1, 1], "torque": 200, "speed": 3"#,
    );
    let mut world = alone(&body, &Physics::default());
    assert!(world.centre(0, 1)[0] < -0.7 && world.centre(0, 1)[1] > 0.6);
    world.set_motor(0, 0, 3.0).unwrap();
    steps(&mut world, 20);
    // Counter-clockwise: the raised arm leans to the left.
    assert!(world.joint_angle(0, 0) > 0.5 && world.centre(0, 1)[0] < -0.85);
}

#[test]
fn physics_out_of_range_is_refused_by_name() {
    let body = brick(0.5);
    let refused = |physics: Physics| match World::new(&body, &physics, 1) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("accepted"),
    };
    let message = refused(Physics { substeps: 0, ..Physics::default() });
    assert_eq!(message, "substeps: 0 is not 1 to 32");
    assert!(refused(Physics { gravity: f32::NAN, ..Physics::default() }).contains("gravity"));
    let ground = Ground::Steps { height: 2.0, length: 1.0 };
    assert!(refused(Physics { ground, ..Physics::default() }).contains("ground.height"));
}
