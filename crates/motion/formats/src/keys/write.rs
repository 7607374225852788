//! Keys → text.

use std::fmt::Write;

use super::figure::{AT, FACING, Figure, SWIVEL, Track, Turn, WEIGHT, usual_turns};
use super::{Easing, Keys};

/// Writes keys as text; reading it gives the same keys. Comments are not kept.
///
/// What came from a file beside stays there and is named.
pub fn write(keys: &Keys) -> Vec<u8> {
    let mut out = String::from("keys 1\n");
    if let Some(other) = &keys.mirrored {
        line(&mut out, format_args!("mirror {other}"));
        return out.into_bytes();
    }
    let figure = &keys.figure;
    match &figure.file {
        Some((name, _)) => line(&mut out, format_args!("skeleton {name}")),
        None => body(&mut out, figure),
    }
    line(&mut out, format_args!("fps {}", keys.fps));
    for phase in &keys.marks.phases {
        let loops = if phase.loops { " loop" } else { "" };
        let (name, start, end) = (&phase.name, phase.start, phase.end);
        line(&mut out, format_args!("phase {name} {start} {end}{loops}"));
    }
    for event in &keys.marks.events {
        line(&mut out, format_args!("event {} {}", event.name, event.time));
    }
    let shared = figure.file.as_ref().map_or(0, |(_, poses)| *poses);
    for pose in &figure.poses[shared..] {
        line(&mut out, format_args!("\npose {}", pose.name));
        block(&mut out, figure, &pose.sets);
    }
    for key in &keys.keys {
        let mut words = format!("\nkey {}", key.time);
        if key.easing != Easing::Smooth {
            words += " ";
            words += key.easing.name();
        }
        if key.partial {
            words += " partial";
        }
        if let Some(pose) = key.pose {
            words += " pose ";
            words += &figure.poses[pose].name;
        }
        line(&mut out, format_args!("{words}"));
        block(&mut out, figure, &key.sets);
    }
    out.into_bytes()
}

fn line(out: &mut String, text: std::fmt::Arguments) {
    writeln!(out, "{text}").expect("a string takes everything");
}

fn body(out: &mut String, figure: &Figure) {
    let name = |joint: usize| &figure.joints()[joint].name;
    for joint in figure.joints() {
        let parent = joint.parent.map_or("-", |parent| name(parent));
        let [x, y, z] = joint.offset.to_array();
        line(out, format_args!("bone {} {parent} {x} {y} {z}", joint.name));
    }
    for joint in figure.joints() {
        for tip in &joint.tips {
            line(out, format_args!("tip {} {} {} {}", joint.name, tip.x, tip.y, tip.z));
        }
    }
    for (joint, turns) in figure.turns.iter().enumerate() {
        if *turns == usual_turns() {
            continue;
        }
        let axis = |turn: &Turn| {
            let sign = if turn.sign < 0.0 { "-" } else { "" };
            format!(" {} {sign}{}", turn.name, ["x", "y", "z"][turn.axis])
        };
        let words: String = turns.iter().map(axis).collect();
        line(out, format_args!("turns {}{words}", name(joint)));
    }
    for limb in &figure.limbs {
        let [a, b, c] = limb.joints.map(name);
        let [x, y, z] = limb.grip.to_array();
        line(out, format_args!("limb {} {a} {b} {c} grip {x} {y} {z}", limb.name));
    }
}

/// The lines of a pose or a key. Joints that say the same one after another share a line.
fn block(out: &mut String, figure: &Figure, sets: &[(usize, f64)]) {
    let owner = |&(track, _): &(usize, f64)| match figure.track(track) {
        Track::Turn { joint, .. } => (0, joint),
        Track::Root(_) => (0, 0),
        Track::Limb { limb, .. } => (1, limb),
    };
    let mut open: Option<String> = None;
    for sets in sets.chunk_by(|a, b| owner(a) == owner(b)) {
        let words = words(figure, sets);
        let (name, alone) = match owner(&sets[0]) {
            (0, joint) => (&figure.joints()[joint].name, words.starts_with(" at")),
            (_, limb) => (&figure.limbs[limb].name, true),
        };
        if open.as_ref() == Some(&words) {
            out.push(' ');
        } else {
            if let Some(words) = open.take() {
                line(out, format_args!("{words}"));
            }
            out.push_str("  ");
        }
        out.push_str(name);
        if alone {
            line(out, format_args!("{words}"));
        } else {
            open = Some(words);
        }
    }
    if let Some(words) = open {
        line(out, format_args!("{words}"));
    }
}

/// What is set of one joint or limb, each with a blank before.
fn words(figure: &Figure, sets: &[(usize, f64)]) -> String {
    let mut words = String::new();
    let value = |wanted: Track| {
        let set = sets.iter().find(|(track, _)| figure.track(*track) == wanted);
        set.map(|(_, value)| *value)
    };
    for &(track, number) in sets {
        let (word, others) = match figure.track(track) {
            Track::Turn { joint, turn } => {
                words += &format!(" {} {number}", figure.turns[joint][turn].name);
                continue;
            }
            Track::Limb { limb, part: WEIGHT } => {
                let placed = value(Track::Limb { limb, part: AT }).is_some();
                match number {
                    1.0 if placed => {}
                    0.0 if !placed => words += " free",
                    _ => words += &format!(" weight {number}"),
                }
                continue;
            }
            Track::Limb { part: SWIVEL, .. } => {
                words += &format!(" swivel {number}");
                continue;
            }
            Track::Root(0) => ("at", [Track::Root(1), Track::Root(2)]),
            Track::Limb { limb, part: part @ (AT | FACING) } => {
                let word = if part == AT { "at" } else { "facing" };
                (word, [1, 2].map(|n| Track::Limb { limb, part: part + n }))
            }
            // Written with the first of the three.
            Track::Root(_) | Track::Limb { .. } => continue,
        };
        let [b, c] = others.map(|track| value(track).unwrap_or_default());
        words += &format!(" {word} {number} {b} {c}");
    }
    words
}
