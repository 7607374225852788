//! Bodies that tests share.
#![allow(dead_code)] // Each test file uses some of it.

use ambulo_body::Body;
use ambulo_world::{Physics, World};

/// A creature that ships, by its file's name.
pub fn starter(name: &str) -> Body {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../starters/creatures");
    let text = std::fs::read_to_string(format!("{folder}/{name}.json")).unwrap();
    Body::parse(&text).unwrap()
}

/// A torso and one child, given as JSON.
pub fn two_parts(torso: &str, child: &str, joint: &str) -> Body {
    let text = format!(
        r#"{{"format": 1, "name": "two", "parts": [
            {{"name": "torso", "density": 50, "tags": ["torso"], {torso}}},
            {{"name": "child", "density": 50, {child}}}],
            "joints": [{{"name": "j", "parent": "torso", "child": "child", {joint}}}]}}"#
    );
    Body::parse(&text).unwrap()
}

/// A brick with a small weight glued on by a strong motor: slides as one.
pub fn brick(friction: f32) -> Body {
    two_parts(
        &format!(
            r#""shape": {{"box": {{"width": 1.0, "height": 0.4}}}}, "position": [0, 0.2], "friction": {friction}"#
        ),
        &format!(
            r#""shape": {{"box": {{"width": 0.2, "height": 0.2}}}}, "position": [0, 0.5], "friction": {friction}"#
        ),
        r#""anchor": [0, 0.4], "limits": [-0.1, 0.1], "torque": 1000, "speed": 5"#,
    )
}

/// Some made-up motor speeds that change every step; the same everywhere.
pub fn wave(step: usize, joint: usize) -> f32 {
    let phase = (step * (joint + 2)) % 60;
    (phase as f32 - 30.0) / 6.0
}

/// Steps `world` with [`wave`] for all motors and gives the path's hash of one individual.
pub fn path(world: &mut World, body: &Body, individual: usize, from: usize, steps: usize) -> u64 {
    let mut hash = 0;
    for step in from..from + steps {
        for individual in 0..world.individuals() {
            for joint in 0..body.joints().len() {
                // Everyone else moves otherwise.
                let speed = wave(step + 7 * individual, joint);
                world.set_motor(individual, joint, speed).unwrap();
            }
        }
        world.step().unwrap();
        hash = world.hash(individual, hash);
    }
    hash
}

/// A world of one.
pub fn alone(body: &Body, physics: &Physics) -> World {
    World::new(body, physics, 1).unwrap()
}
