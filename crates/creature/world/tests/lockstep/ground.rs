//! Uneven ground carries, stops and lets fall.

use ambulo_body::Body;
use ambulo_lanes::Scalar;
use ambulo_world::{Ground, Lockstep, Physics, Stage};

use crate::common::two_parts;
use crate::play::on;

/// A brick of 1.0 × 0.4 m with a weight on it, the middle of its underside at a place, tilted.
fn block([x, y]: [f32; 2], angle: f32, friction: f32) -> Body {
    let (sin, cos) = angle.sin_cos();
    let up = |height: f32| [x - sin * height, y + cos * height];
    let part = |[width, height]: [f32; 2], at: [f32; 2]| {
        let shape = format!(r#"{{"box": {{"width": {width}, "height": {height}}}}}"#);
        format!(r#""shape": {shape}, "position": {at:?}, "angle": {angle}, "friction": {friction}"#)
    };
    two_parts(
        &part([1.0, 0.4], up(0.2)),
        &part([0.2, 0.2], up(0.5)),
        &format!(r#""anchor": {:?}, "limits": [-0.1, 0.1], "torque": 1000, "speed": 5"#, up(0.4)),
    )
}

fn world(body: &Body, ground: Ground) -> Lockstep<Scalar> {
    Lockstep::new(Scalar, &[(body, &on(ground))]).unwrap()
}

fn steps(world: &mut Lockstep<Scalar>, count: usize) {
    (0..count).for_each(|_| world.step().unwrap());
}

fn push(world: &mut Lockstep<Scalar>, right: f32) {
    for part in 0..2 {
        world.push(0, part, [right.into(), 0.0.into()]).unwrap();
    }
}

fn place(world: &Lockstep<Scalar>) -> [f32; 2] {
    world.centre(0, 0).map(|value| value.value())
}

/// Friction angles of 38.7° and 11.3°: within 1e-4 of g (sin θ − µ cos θ), and 0 below.
#[test]
fn a_slope_holds_up_to_the_friction_angle_and_lets_slide_above() {
    for (angle, friction) in
        [(0.3, 0.8), (-0.3, 0.8), (0.6, 0.8), (0.9, 0.8), (-0.9, 0.8), (0.3, 0.05), (-0.3, 0.05)]
    {
        let (sin, cos) = f32::sin_cos(angle);
        let body = block([9.0, 6.0 * angle.tan()], angle, friction);
        let mut world = world(&body, Ground::Slope { angle });
        // It falls a little first.
        steps(&mut world, 60);
        let mut along = |count: usize| {
            let [x, y] = place(&world);
            steps(&mut world, count);
            x * cos + y * sin
        };
        let mu = (friction * 0.8).sqrt();
        let pull = 9.81 * (sin.abs() - mu * cos);
        if pull > 0.0 {
            let [a, b, c] = [15, 15, 15].map(along);
            let gained = (a - 2.0 * b + c).abs() * 16.0;
            assert!((gained / pull - 1.0).abs() < 0.01, "{angle} µ {mu}: {gained} for {pull} m/s²");
        } else {
            let drift = (along(180) - along(0)).abs();
            assert!(drift < 1e-4, "{angle} µ {mu}: it drifted by {drift} m");
        }
        assert!(world.deepest(0) < 0.001);
    }
}

/// Once what lay on a step was pushed off by the riser beside it, and what stood at one was lifted.
#[test]
fn what_lies_beside_an_edge_stays() {
    let (up, down) =
        (Ground::Steps { height: 0.1, length: 2.0 }, Ground::Steps { height: -0.1, length: 2.0 });
    let [narrow, wide] = [0.5, 1.4].map(|width| Ground::Holes { width, between: 5.0 });
    for (ground, x, y) in [
        (up, 3.6, 0.1),
        // At the next riser.
        (up, 4.499, 0.1),
        (down, 4.4, -0.1),
        (down, 3.501, -0.1),
        (narrow, 4.1, 0.0),
        // In a hole, by its left wall and by its right one.
        (wide, 3.501, -5.0),
        (wide, 3.899, -5.0),
    ] {
        let mut world = world(&block([x, 0.0], 0.0, 0.8), ground);
        steps(&mut world, 180);
        let [dx, dy] = [place(&world)[0] - x, place(&world)[1] - y - 0.2];
        assert!(dx.abs() < 1e-3 && dy.abs() < 1e-3, "{ground:?} {x}: moved by {dx} m, {dy} m");
    }
}

/// Fast, and then pushed for two seconds with more than its friction.
#[test]
fn a_riser_stops() {
    for (height, speed) in [(0.5, 3.0), (0.5, 6.0), (1.0, 12.0)] {
        let mut world = world(&block([1.5, 0.0], 0.0, 0.1), Ground::Steps { height, length: 2.0 });
        push(&mut world, speed);
        for step in 0..240 {
            world.step().unwrap();
            if step > 120 {
                push(&mut world, 0.06);
            }
            let [x, y] = place(&world);
            let deep = world.deepest(0);
            assert!(x < 2.51 && deep < 0.01, "{speed} m/s: at {x} m, {y} m, {deep} m deep");
        }
        assert!((place(&world)[0] - 2.5).abs() < 0.01 && (place(&world)[1] - 0.2).abs() < 0.01);
    }
}

#[test]
fn a_hole_is_fallen_into() {
    let mut world = world(&block([2.0, 0.0], 0.0, 0.1), Ground::Holes { width: 3.0, between: 5.0 });
    push(&mut world, 3.0);
    let mut depths = Vec::new();
    for _ in 0..300 {
        world.step().unwrap();
        depths.push(world.deepest(0));
    }
    // In the one step in which it lands at 10 m/s 6 cm.
    depths.sort_by(f32::total_cmp);
    assert!(depths[298] < 0.01 && depths[299] < 0.1, "{:?}", &depths[295..]);
    // On its side or on end.
    let ([x, y], down) = (place(&world), |up: f32| (place(&world)[1] + 5.0 - up).abs() < 0.001);
    assert!((down(0.2) || down(0.5)) && (3.1..5.9).contains(&x), "{x} {y}");
}

/// Faster than 18 m/s, past all that was once looked at.
#[test]
fn what_falls_from_high_does_not_fall_through() {
    for ground in [Ground::Flat, Ground::Rough { height: 0.2, spacing: 0.5, seed: 2 }] {
        let body = two_parts(
            r#""shape": {"circle": {"radius": 0.2}}, "position": [8.2, 2.0]"#,
            r#""shape": {"box": {"width": 0.1, "height": 0.1}}, "position": [8.2, 2.0]"#,
            r#""anchor": [8.2, 2.0], "limits": [-1, 1], "torque": 50, "speed": 5"#,
        );
        let heavy = Physics { gravity: 80.0, ..on(ground) };
        let mut world = Lockstep::new(Scalar, &[(&body, &heavy)]).unwrap();
        for part in 0..2 {
            world.push(0, part, [0.0.into(), 40.0.into()]).unwrap();
        }
        let mut fastest = 0.0f32;
        for _ in 0..90 {
            let before = place(&world)[1];
            world.step().unwrap();
            fastest = fastest.max((before - place(&world)[1]) * 60.0);
            assert!(world.deepest(0) < 0.01, "{ground:?}: {} m", world.deepest(0));
        }
        assert!(fastest > 30.0, "{fastest} m/s");
    }
}
