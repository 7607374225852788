//! What a scene file must be; each refusal names the place in the document.

use std::collections::HashMap;

use crate::object::{Button, Chair, Door, Kind, Lever, MovableBox, Object};
use crate::reading::Found;
use crate::scene_file::{Ground, GroundKind, SCENE_FORMAT, Scene, Wall};

/// Metres: how far from 0 anything stands at most.
const FAR: f32 = 1000.0;
/// Radians.
const TURN: f32 = 7.0;
/// Metres.
const HIGH: f32 = 100.0;

/// Everything that is wrong with a scene.
pub(crate) fn problems(scene: &Scene) -> Found {
    let mut found = Found::default();
    found.format(scene.format, SCENE_FORMAT);
    found.name("$.name", &scene.name);
    found.about(&scene.about);
    check_place("$.spawn", scene.spawn.place, scene.spawn.yaw, &mut found);
    found.count("$.ground", scene.ground.len(), 1, 64);
    found.count("$.wall", scene.walls.len(), 0, 256);
    found.count("$.object", scene.objects.len(), 0, 256);
    for (index, ground) in scene.ground.iter().enumerate() {
        check_ground(ground, &format!("$.ground[{index}]"), &mut found);
    }
    for (index, wall) in scene.walls.iter().enumerate() {
        check_wall(wall, &format!("$.wall[{index}]"), &mut found);
    }
    let mut names = HashMap::new();
    for (index, object) in scene.objects.iter().enumerate() {
        let path = format!("$.object[{index}]");
        if let Some(other) = names.insert(object.name.as_str(), index) {
            let reason = format!("'{}' is the name of $.object[{other}] already", object.name);
            found.add(format!("{path}.name"), reason);
        }
        check_object(object, &path, &mut found);
    }
    found
}

fn check_place(path: &str, place: [f32; 2], yaw: f32, found: &mut Found) {
    found.numbers(&format!("{path}.place"), &place, -FAR, FAR, " m");
    found.number(format!("{path}.yaw"), yaw, -TURN, TURN, " rad");
}

fn check_ground(ground: &Ground, path: &str, found: &mut Found) {
    check_place(path, ground.place, ground.yaw, found);
    let most = if matches!(ground.kind, GroundKind::Rugged { .. }) { 64.0 } else { 2000.0 };
    found.numbers(&format!("{path}.size"), &ground.size, 0.5, most, " m");
    let path = format!("{path}.kind");
    let mut height = |key: &str, value| {
        found.number(format!("{path}.{key}"), value, -HIGH, HIGH, " m");
    };
    match ground.kind {
        GroundKind::Flat { height: level } => height("flat.height", level),
        GroundKind::Rugged { height: level, rise, wave, .. } => {
            height("rugged.height", level);
            found.number(format!("{path}.rugged.rise"), rise, 0.0, 20.0, " m");
            found.number(format!("{path}.rugged.wave"), wave, 4.0, 100.0, " m");
        }
        GroundKind::Slope { from, to } => {
            height("slope.from", from);
            height("slope.to", to);
        }
        GroundKind::Steps { from, to, count } => {
            height("steps.from", from);
            height("steps.to", to);
            if !(2..=100).contains(&count) {
                found.add(format!("{path}.steps.count"), format!("{count} is not 2 to 100"));
            }
        }
    }
}

fn check_wall(wall: &Wall, path: &str, found: &mut Found) {
    found.numbers(&format!("{path}.start"), &wall.start, -FAR, FAR, " m");
    found.numbers(&format!("{path}.end"), &wall.end, -FAR, FAR, " m");
    found.number(format!("{path}.height"), wall.height, 0.1, 20.0, " m");
    found.number(format!("{path}.thickness"), wall.thickness, 0.02, 5.0, " m");
    let ([ax, az], [bx, bz]) = (wall.start, wall.end);
    if (bx - ax).abs() < 0.01 && (bz - az).abs() < 0.01 {
        found.add(format!("{path}.end"), "at least 1 cm from the start");
    }
}

fn check_object(object: &Object, path: &str, found: &mut Found) {
    found.name(format!("{path}.name"), &object.name);
    check_place(path, object.place, object.yaw, found);
    found.number(format!("{path}.lift"), object.lift, 0.0, 10.0, " m");
    found.count(&format!("{path}.interactions"), object.interactions.len(), 0, 16);
    for (index, file) in object.interactions.iter().enumerate() {
        let path = format!("{path}.interactions[{index}]");
        found.file(path.as_str(), file, &[".toml"]);
        if object.interactions[..index].contains(file) {
            found.add(path, "listed twice");
        }
    }
    let path = format!("{path}.kind.{}", object.kind.kind());
    match &object.kind {
        Kind::Door(door) => check_door(door, &path, found),
        Kind::Chair(chair) => check_chair(chair, &path, found),
        Kind::Box(shape) => check_box(shape, &path, found),
        Kind::Button(button) => check_button(button, &path, found),
        Kind::Lever(lever) => check_lever(lever, &path, found),
    }
}

fn check_door(door: &Door, path: &str, found: &mut Found) {
    let mut number = |key: &str, value, low, high, unit| {
        found.number(format!("{path}.{key}"), value, low, high, unit);
    };
    number("width", door.width, 0.4, 3.0, " m");
    number("height", door.height, 1.0, 4.0, " m");
    number("thickness", door.thickness, 0.01, 0.2, " m");
    number("frame", door.frame, 0.02, 0.5, " m");
    number("handle_height", door.handle_height, 0.3, 2.0, " m");
    number("mass", door.mass, 1.0, 500.0, " kg");
    number("damping", door.damping, 0.01, 1000.0, " N·m·s/rad");
    number("closer", door.closer, 0.0, 1000.0, " N·m/rad");
    if door.handle_height >= door.height {
        found.add(format!("{path}.handle_height"), "the handle is not on the leaf");
    }
    found.limits(&format!("{path}.limits"), door.limits, -2.8, 2.8, " rad");
}

fn check_chair(chair: &Chair, path: &str, found: &mut Found) {
    let mut number = |key: &str, value, low, high| {
        found.number(format!("{path}.{key}"), value, low, high, " m");
    };
    number("seat_height", chair.seat_height, 0.15, 1.2);
    number("seat_depth", chair.seat_depth, 0.2, 1.2);
    number("width", chair.width, 0.2, 4.0);
    number("back_height", chair.back_height, 0.0, 2.0);
    if chair.back_height > 0.0 && chair.back_height < chair.seat_height + 0.05 {
        let reason = "a back rest ends at least 5 cm above the seat; 0 for none";
        found.add(format!("{path}.back_height"), reason);
    }
}

fn check_box(shape: &MovableBox, path: &str, found: &mut Found) {
    found.numbers(&format!("{path}.size"), &shape.size, 0.05, 5.0, " m");
    found.number(format!("{path}.mass"), shape.mass, 0.05, 5000.0, " kg");
    found.number(format!("{path}.friction"), shape.friction, 0.01, 2.0, "");
}

fn check_button(button: &Button, path: &str, found: &mut Found) {
    found.number(format!("{path}.height"), button.height, 0.2, 2.5, " m");
    found.number(format!("{path}.radius"), button.radius, 0.01, 0.3, " m");
    found.number(format!("{path}.travel"), button.travel, 0.002, 0.1, " m");
    found.number(format!("{path}.stiffness"), button.stiffness, 10.0, 1e5, " N/m");
    if button.radius >= button.height {
        found.add(format!("{path}.radius"), "the button reaches into the ground");
    }
}

fn check_lever(lever: &Lever, path: &str, found: &mut Found) {
    found.number(format!("{path}.height"), lever.height, 0.1, 2.0, " m");
    found.number(format!("{path}.length"), lever.length, 0.1, 2.0, " m");
    found.limits(&format!("{path}.limits"), lever.limits, -2.8, 2.8, " rad");
    found.number(format!("{path}.damping"), lever.damping, 0.01, 1000.0, " N·m·s/rad");
    found.number(format!("{path}.closer"), lever.closer, 0.0, 1000.0, " N·m/rad");
}
