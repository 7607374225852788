//! What an interaction file must be; each refusal names the place in the document.

use crate::interaction::{
    Action, Approach, Clip, Exit, Hand, INTERACTION_FORMAT, Interaction, Limb, Target, Trigger,
    Volume, When,
};
use crate::object::ObjectKind;
use crate::reading::Found;

/// Metres: how far from its object anything of an interaction lies at most.
const REACH: f32 = 20.0;
/// Radians.
const TURN: f32 = 7.0;
/// Seconds of the longest clip.
const LONGEST: f32 = 600.0;

/// Everything that is wrong with an interaction.
pub(crate) fn problems(interaction: &Interaction) -> Found {
    let mut found = Found::default();
    found.format(interaction.format, INTERACTION_FORMAT);
    found.name("$.name", &interaction.name);
    found.about(&interaction.about);
    let kind = interaction.object;
    check_trigger(&interaction.trigger, kind, &mut found);
    check_approach(&interaction.approach, kind, &mut found);
    let timed = check_clip(&interaction.clip, &mut found);
    let span = timed.then_some((interaction.clip.enter, interaction.clip.end));
    found.count("$.target", interaction.targets.len(), 0, 6);
    for (index, target) in interaction.targets.iter().enumerate() {
        let path = format!("$.target[{index}]");
        check_target(target, &path, kind, span, &mut found);
        if interaction.targets[..index].iter().any(|other| other.limb == target.limb) {
            found.add(format!("{path}.limb"), "led already by a target above");
        }
    }
    if let Some(action) = &interaction.action {
        check_action(action, interaction, span, &mut found);
    }
    check_exit(&interaction.exit, interaction, &mut found);
    found
}

fn check_frame(path: &str, on: &str, kind: ObjectKind, found: &mut Found) {
    let frames = kind.frames();
    if !frames.contains(&on) {
        let known = frames.join(", ");
        found.add(format!("{path}.on"), format!("'{on}': a {kind} has the frames {known}"));
    }
}

fn check_trigger(trigger: &Trigger, kind: ObjectKind, found: &mut Found) {
    check_frame("$.trigger", &trigger.on, kind, found);
    let path = "$.trigger.volume";
    match &trigger.volume {
        Volume::Box { centre, size } => {
            found.numbers(&format!("{path}.box.centre"), centre, -REACH, REACH, " m");
            found.numbers(&format!("{path}.box.size"), size, 0.05, 50.0, " m");
        }
        Volume::Sphere { centre, radius } => {
            found.numbers(&format!("{path}.sphere.centre"), centre, -REACH, REACH, " m");
            found.number(format!("{path}.sphere.radius"), *radius, 0.05, 50.0, " m");
        }
    }
}

fn check_approach(approach: &Approach, kind: ObjectKind, found: &mut Found) {
    check_frame("$.approach", &approach.on, kind, found);
    found.numbers("$.approach.place", &approach.place, -REACH, REACH, " m");
    found.number("$.approach.facing", approach.facing, -TURN, TURN, " rad");
    found.number("$.approach.distance", approach.distance, 0.01, 2.0, " m");
    found.number("$.approach.angle", approach.angle, 0.01, 3.2, " rad");
    found.count("$.approach.gaits", approach.gaits.len(), 1, 5);
    for (index, gait) in approach.gaits.iter().enumerate() {
        if approach.gaits[..index].contains(gait) {
            found.add(format!("$.approach.gaits[{index}]"), "listed twice");
        }
    }
}

/// Whether its times can be held against others.
fn check_clip(clip: &Clip, found: &mut Found) -> bool {
    if let Some(file) = &clip.file {
        found.file("$.clip.file", file, &[".keys", ".bvh", ".amc", ".glb", ".gltf"]);
    }
    if clip.mirror && clip.file.is_none() {
        found.add("$.clip.mirror", "there is no file to mirror");
    }
    let before = found.0.len();
    let times =
        [("enter", clip.enter), ("hold", clip.hold), ("exit", clip.exit), ("end", clip.end)];
    for (key, time) in times {
        found.number(format!("$.clip.{key}"), time, 0.0, LONGEST, " s");
    }
    found.number("$.clip.hold_speed", clip.hold_speed, 0.05, 5.0, "");
    if found.0.len() > before {
        return false;
    }
    let order = [
        ("hold", clip.hold > clip.enter, "after the enter"),
        ("exit", clip.exit >= clip.hold, "at the hold or after it"),
        ("end", clip.end > clip.exit, "after the exit"),
    ];
    for (key, right, expected) in order {
        if !right {
            found.add(format!("$.clip.{key}"), format!("must come {expected}"));
        }
    }
    if clip.hold_repeats && clip.exit - clip.hold < 0.1 {
        found.add("$.clip.hold_repeats", "a hold that repeats lasts at least 0.1 s");
    }
    found.0.len() == before
}

fn check_target(
    target: &Target,
    path: &str,
    kind: ObjectKind,
    span: Option<(f32, f32)>,
    found: &mut Found,
) {
    check_frame(path, &target.on, kind, found);
    found.numbers(&format!("{path}.point"), &target.point, -REACH, REACH, " m");
    if let Some(rotation) = target.rotation {
        let length = rotation.iter().map(|v| v * v).sum::<f32>();
        if target.limb == Limb::Look {
            found.add(format!("{path}.rotation"), "a look has a point only");
        } else if !(0.99..=1.01).contains(&length) {
            let reason = "not a unit quaternion (x, y, z, w): its squares must sum to 1";
            found.add(format!("{path}.rotation"), reason);
        }
    }
    check_weight(&target.weight, &format!("{path}.weight"), span, found);
}

fn check_weight(keys: &[[f32; 2]], path: &str, span: Option<(f32, f32)>, found: &mut Found) {
    found.count(path, keys.len(), 2, 16);
    let mut last = f32::NEG_INFINITY;
    for (index, &[time, value]) in keys.iter().enumerate() {
        let (low, high) = span.unwrap_or((0.0, LONGEST));
        found.number(format!("{path}[{index}][0]"), time, low, high, " s");
        found.number(format!("{path}[{index}][1]"), value, 0.0, 1.0, "");
        // Closer than this, the slope between them is a jump.
        if time < last + 0.01 {
            found.add(format!("{path}[{index}][0]"), "times rise by at least 0.01 s");
        }
        last = time;
    }
    for index in [0, keys.len().saturating_sub(1)] {
        if keys.get(index).is_some_and(|key| key[1] != 0.0) {
            let reason = "the first and the last weight are 0: a limb comes and goes softly";
            found.add(format!("{path}[{index}][1]"), reason);
        }
    }
}

fn check_action(action: &Action, whole: &Interaction, span: Option<(f32, f32)>, found: &mut Found) {
    use ObjectKind as Is;
    let (path, kinds, hands): (_, &[Is], &[Hand]) = match action {
        Action::Hinge { hand, angle, torque, .. } => {
            found.number("$.action.hinge.angle", *angle, -3.1, 3.1, " rad");
            found.number("$.action.hinge.torque", *torque, 0.1, 1000.0, " N·m");
            ("$.action.hinge", &[Is::Door, Is::Lever], std::slice::from_ref(hand))
        }
        Action::Attach { hands, .. } => {
            found.count("$.action.attach.hands", hands.len(), 1, 2);
            if let [one, other] = hands[..]
                && one == other
            {
                found.add("$.action.attach.hands[1]", "listed twice");
            }
            ("$.action.attach", &[Is::Box], hands)
        }
        Action::Push { force, speed, .. } => {
            found.number("$.action.push.force", *force, 1.0, 2000.0, " N");
            found.number("$.action.push.speed", *speed, 0.1, 5.0, " m/s");
            ("$.action.push", &[Is::Box], &[])
        }
        Action::Seat { .. } => {
            if whole.target(Limb::Hips).is_none() {
                found.add("$.action.seat", "no target leads the hips");
            }
            ("$.action.seat", &[Is::Chair], &[])
        }
        Action::Press { hand, depth, force, .. } => {
            found.number("$.action.press.depth", *depth, 0.0, 1.0, "");
            found.number("$.action.press.force", *force, 0.1, 1000.0, " N");
            ("$.action.press", &[Is::Button], std::slice::from_ref(hand))
        }
    };
    if !kinds.contains(&whole.object) {
        found.add(path, format!("a {} does not do that", whole.object));
    }
    if hands.iter().any(|&hand| whole.target(hand.into()).is_none()) {
        found.add(path, "no target leads that hand");
    }
    let (from, until) = action.times();
    let (low, high) = span.unwrap_or((0.0, LONGEST));
    found.number(format!("{path}.from"), from, low, high, " s");
    if let Some(until) = until {
        found.number(format!("{path}.until"), until, low, high, " s");
        if until <= from {
            found.add(format!("{path}.until"), "it ends before it begins");
        }
    }
}

fn check_exit(exit: &Exit, whole: &Interaction, found: &mut Found) {
    check_frame("$.exit", &exit.on, whole.object, found);
    if let Some(place) = exit.place {
        found.numbers("$.exit.place", &place, -REACH, REACH, " m");
    }
    if let Some(facing) = exit.facing {
        found.number("$.exit.facing", facing, -TURN, TURN, " rad");
    }
    match (exit.when, whole.clip.hold_repeats) {
        (When::ClipEnds, true) => {
            found.add("$.exit.when", "the hold repeats, so that the clip never ends by itself");
        }
        (When::ClipEnds, false) | (_, true) => {}
        (_, false) => found.add("$.exit.when", "nothing to leave: $.clip.hold_repeats is not set"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The schemas that other languages read are made from these types. To write them again, run the
    /// test with AMBULO_WRITE_SCHEMA=1.
    #[test]
    fn the_schema_files_are_what_these_types_say() {
        let schemas = [
            ("interaction", schemars::schema_for!(Interaction)),
            ("scene", schemars::schema_for!(crate::Scene)),
            ("script", schemars::schema_for!(crate::Script)),
        ];
        for (name, schema) in schemas {
            let path = format!("../../../schema/{name}.schema.json");
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
            let made = serde_json::to_string_pretty(&schema).unwrap() + "\n";
            if std::env::var_os("AMBULO_WRITE_SCHEMA").is_some() {
                std::fs::write(&path, &made).unwrap();
            }
            let there = std::fs::read_to_string(&path).unwrap_or_default();
            assert!(
                there == made,
                "{name}.schema.json has drifted: AMBULO_WRITE_SCHEMA=1 cargo test -p ambulo-scene"
            );
        }
    }
}
