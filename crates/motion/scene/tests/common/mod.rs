//! Small scenes.
#![allow(dead_code)]

pub mod playground;

use ambulo_scene::{Physics, STEP, Scene};

/// Of a known run; written down once, the same on every machine since.
pub const GOLDEN: u64 = 0x6426_4D2C_A056_D36D;

pub const FLAT: &str = r#"
format = 1
name = "test"
spawn = { place = [0.0, 0.0] }
[[ground]]
place = [0.0, 0.0]
size = [40.0, 40.0]
kind.flat = { height = 0.0 }
"#;

pub const DOOR: &str = r#"
[[object]]
name = "door"
place = [0.0, 0.0]
kind.door = { width = 0.9, height = 2.0, handle_height = 1.0, hinge = "left", limits = [-1.6, 1.6], mass = 20.0, damping = 2.0 }
"#;

/// Half a metre, 20 kg, friction 0.5.
pub const BOX: &str = r#"
[[object]]
name = "box"
place = [0.0, 0.0]
kind.box = { size = [0.5, 0.5, 0.5], mass = 20.0, friction = 0.5 }
"#;

pub const BUTTON: &str = r#"
[[object]]
name = "button"
place = [-4.0, -4.0]
kind.button = { height = 1.1, radius = 0.05, travel = 0.02 }
"#;

pub const LEVER: &str = r#"
[[object]]
name = "lever"
place = [0.0, 0.0]
kind.lever = { height = 0.8, length = 0.4, limits = [-0.7, 0.7] }
"#;

/// Flat ground and objects. Several stand 3 m apart along -z, boxes of a stack excepted.
pub fn scene(objects: &[&str]) -> Physics {
    let stack = objects.iter().all(|object| object.contains("kind.box"));
    let spread = objects.iter().enumerate().map(|(index, object)| {
        let place = format!("place = [0.0, {:.1}]", if stack { 0.0 } else { -3.0 * index as f32 });
        object.replace("place = [0.0, 0.0]", &place)
    });
    scene_of(&format!("{FLAT}{}", spread.collect::<String>()))
}

pub fn scene_of(text: &str) -> Physics {
    let scene = Scene::parse(text).unwrap_or_else(|error| panic!("{error}"));
    Physics::new(&scene).unwrap()
}

/// At 60 Hz; `each` sees every step.
pub fn seconds(physics: &mut Physics, time: f32, mut each: impl FnMut(&Physics)) {
    for _ in 0..(time / STEP).round() as usize {
        physics.step(STEP).unwrap();
        each(physics);
    }
}
