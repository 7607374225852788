//! Clip → BVH.

use std::collections::HashMap;

use ambulo_rig::Clip;
use ambulo_rig::glam::DVec3;

use super::{Channel, Dialect, usual_channels};
use crate::error::Notes;
use crate::euler::{angles, apart, composed};
use crate::text::UniqueNames;
use crate::{Note, Positions};

/// How a clip is written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WriteOptions {
    /// Channels, frame time and position rule of a file that was read; joints are found by name.
    /// Without one: `Zrotation Yrotation Xrotation`, with positions for the root and for every
    /// joint that moves.
    pub dialect: Option<Dialect>,
}

/// A file in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// ASCII but for the names; LF, tabs, six decimals, one newline at the end.
    pub bytes: Vec<u8>,
    /// Where the file differs from what was asked for.
    pub notes: Vec<Note>,
}

/// Degrees that a joint may lose by keeping fewer than three rotation channels.
const EXPRESSIBLE: f64 = 5e-5;

/// How one joint is written.
struct Plan {
    joint: usize,
    channels: Vec<Channel>,
    /// Axes of the rotation channels.
    axes: Vec<usize>,
    /// Where the joint's translations are within a frame.
    moving: Option<usize>,
    /// The offset as it will be read back.
    offset: DVec3,
}

/// Writes a BVH file.
///
/// Reading it gives rotations within 1e-4 degrees and lengths within 1e-6 units, and writing what
/// was read, with its dialect, gives the same bytes. Joints come depth first.
pub fn write(clip: &Clip, options: &WriteOptions) -> Written {
    let mut notes = Notes::default();
    let positions = options.dialect.as_ref().map_or(Positions::Replace, |d| d.positions);
    let (order, children) = depth_first(clip);
    let names = names(clip, &order, &mut notes);
    let mut plans = plans(clip, &order, options.dialect.as_ref(), &mut notes);
    if positions == Positions::Replace {
        plans.iter_mut().for_each(|plan| plan.offset = DVec3::ZERO);
    }
    let mut out = Vec::new();
    hierarchy(&mut out, clip, &plans, &names, &children, &mut notes);
    out.extend_from_slice(b"MOTION\n");
    out.extend_from_slice(format!("Frames: {}\n", clip.frames()).as_bytes());
    let time = match &options.dialect {
        Some(dialect) if dialect.frame_time == clip.frame_time() => dialect.frame_time_text.clone(),
        _ => ten_digits(clip.frame_time()),
    };
    out.extend_from_slice(format!("Frame Time: {time}\n").as_bytes());
    for frame in 0..clip.frames() {
        write_frame(&mut out, clip, frame, &plans);
    }
    Written { bytes: out, notes: notes.finish() }
}

/// Joints in the order in which a file nests them, and every joint's children.
fn depth_first(clip: &Clip) -> (Vec<usize>, Vec<Vec<usize>>) {
    let joints = clip.skeleton().joints();
    let mut children = vec![vec![]; joints.len()];
    for (index, joint) in joints.iter().enumerate() {
        if let Some(parent) = joint.parent {
            children[parent].push(index);
        }
    }
    let (mut order, mut waiting) = (Vec::with_capacity(joints.len()), vec![0]);
    while let Some(joint) = waiting.pop() {
        order.push(joint);
        waiting.extend(children[joint].iter().rev());
    }
    (order, children)
}

/// Names that a reader takes for the same names.
fn names(clip: &Clip, order: &[usize], notes: &mut Notes) -> Vec<String> {
    let mut unique = UniqueNames::default();
    let mut names = vec![String::new(); order.len()];
    for &index in order {
        let name = &clip.skeleton().joints()[index].name;
        let safe = name.replace(|c: char| c.is_ascii_control() || c == '{', "_");
        let safe = safe.trim_matches(|c: char| c.is_ascii_whitespace());
        names[index] = unique.take(if safe.is_empty() { "joint" } else { safe });
        if names[index] != *name {
            let shown = name.escape_debug();
            notes.push(format!("joint '{shown}' is written as '{}'", names[index]));
        }
    }
    names
}

fn plans(clip: &Clip, order: &[usize], dialect: Option<&Dialect>, notes: &mut Notes) -> Vec<Plan> {
    let known: HashMap<&str, &Vec<Channel>> = dialect
        .map(|dialect| dialect.joints.iter().map(|(name, list)| (name.as_str(), list)).collect())
        .unwrap_or_default();
    let plan = |&index: &usize| {
        let joint = &clip.skeleton().joints()[index];
        let moving = clip.moving().binary_search(&index).ok();
        let mut channels = match known.get(joint.name.as_str()) {
            Some(channels) => (*channels).clone(),
            None => usual_channels(moving.is_some() || index == 0),
        };
        if let Some(at) = moving
            && !positions_suffice(clip, at, joint.offset, &channels)
        {
            channels.retain(|channel| channel.is_rotation());
            channels.splice(0..0, usual_channels(true).into_iter().take(3));
            notes.push(format!("joint '{}' moves: it got three position channels", joint.name));
        }
        if !rotations_suffice(clip, index, &axes_of(&channels)) {
            let missing = usual_channels(false).into_iter().filter(|c| !channels.contains(c));
            let missing: Vec<_> = missing.collect();
            channels.extend(missing);
            notes.push(format!("joint '{}' turns: it got three rotation channels", joint.name));
        }
        let offset = joint.offset.map(as_read_back);
        Plan { joint: index, axes: axes_of(&channels), channels, moving, offset }
    };
    let mut plans: Vec<Plan> = order.iter().map(plan).collect();
    if plans.iter().all(|plan| plan.channels.is_empty()) {
        // Frames without numbers cannot be counted.
        notes.push("nothing moves: the root got channels nevertheless");
        plans[0].channels = usual_channels(true);
        plans[0].axes = axes_of(&plans[0].channels);
    }
    plans
}

fn axes_of(channels: &[Channel]) -> Vec<usize> {
    channels.iter().filter(|channel| channel.is_rotation()).map(|channel| channel.axis()).collect()
}

/// Whether a joint keeps to its offset on every axis without a channel.
fn positions_suffice(clip: &Clip, at: usize, offset: DVec3, channels: &[Channel]) -> bool {
    let has = |axis| channels.iter().any(|c| !c.is_rotation() && c.axis() == axis);
    let missing: Vec<_> = (0..3).filter(|&axis| !has(axis)).collect();
    // Half of the sixth decimal is what writing costs anyway.
    let keeps = |frame| {
        let place: DVec3 = clip.translations(frame)[at];
        missing.iter().all(|&axis| (place[axis] - offset[axis]).abs() <= 5e-7)
    };
    missing.is_empty() || (0..clip.frames()).all(keeps)
}

fn rotations_suffice(clip: &Clip, joint: usize, axes: &[usize]) -> bool {
    let expressible = |frame| {
        let rotation = clip.rotations(frame)[joint];
        apart(composed(angles(rotation, axes), axes), rotation) <= EXPRESSIBLE
    };
    axes.len() == 3 || (0..clip.frames()).all(expressible)
}

fn hierarchy(
    out: &mut Vec<u8>,
    clip: &Clip,
    plans: &[Plan],
    names: &[String],
    children: &[Vec<usize>],
    notes: &mut Notes,
) {
    let joints = clip.skeleton().joints();
    out.extend_from_slice(b"HIERARCHY\n");
    let (mut open, mut made_up) = (Vec::<usize>::new(), vec![]);
    for plan in plans {
        let joint = &joints[plan.joint];
        while open.last().copied() != joint.parent {
            open.pop();
            line(out, open.len(), "}");
        }
        let keyword = if joint.parent.is_none() { "ROOT" } else { "JOINT" };
        line(out, open.len(), &format!("{keyword} {}", names[plan.joint]));
        line(out, open.len(), "{");
        open.push(plan.joint);
        offset(out, open.len(), joint.offset);
        let mut text = format!("CHANNELS {}", plan.channels.len());
        for channel in &plan.channels {
            text.push(' ');
            text.push_str(channel.name());
        }
        line(out, open.len(), &text);
        for &tip in &joint.tips {
            end_site(out, open.len(), tip);
        }
        if joint.tips.is_empty() && children[plan.joint].is_empty() {
            // The format wants an end on every leaf; a bone is half as long as the one before.
            end_site(out, open.len(), joint.offset * 0.5);
            made_up.push(joint.name.as_str());
        }
    }
    while open.pop().is_some() {
        line(out, open.len(), "}");
    }
    if let Some(first) = made_up.first() {
        let count = made_up.len();
        notes.push(format!("bones of {count} leaves without an end are made up, as of '{first}'"));
    }
}

fn end_site(out: &mut Vec<u8>, depth: usize, tip: DVec3) {
    line(out, depth, "End Site");
    line(out, depth, "{");
    offset(out, depth + 1, tip);
    line(out, depth, "}");
}

fn line(out: &mut Vec<u8>, depth: usize, text: &str) {
    out.resize(out.len() + depth, b'\t');
    out.extend_from_slice(text.as_bytes());
    out.push(b'\n');
}

fn offset(out: &mut Vec<u8>, depth: usize, offset: DVec3) {
    out.resize(out.len() + depth, b'\t');
    out.extend_from_slice(b"OFFSET");
    for number in offset.to_array() {
        out.push(b' ');
        length(out, number);
    }
    out.push(b'\n');
}

fn write_frame(out: &mut Vec<u8>, clip: &Clip, frame: usize, plans: &[Plan]) {
    let (rotations, translations) = (clip.rotations(frame), clip.translations(frame));
    let joints = clip.skeleton().joints();
    for plan in plans {
        let found = angles(rotations[plan.joint], &plan.axes);
        let place = plan.moving.map_or(joints[plan.joint].offset, |at| translations[at]);
        let place = place - plan.offset;
        let mut turn = 0;
        for channel in &plan.channels {
            if channel.is_rotation() {
                millionths(out, found[turn]);
                turn += 1;
            } else {
                length(out, place[channel.axis()]);
            }
            out.push(b' ');
        }
    }
    // A blank stands behind every number; the last one makes room for the line's end.
    if out.last() == Some(&b' ') {
        out.pop();
    }
    out.push(b'\n');
}

/// A length with six decimals, never `-0.000000`.
fn length(out: &mut Vec<u8>, value: f64) {
    if value.abs() < 1e9 {
        millionths(out, (value * 1e6).round() as i64);
    } else {
        out.extend_from_slice(format!("{value:.6}").as_bytes());
    }
}

/// What [`length`] leaves of a number.
fn as_read_back(value: f64) -> f64 {
    if value.abs() < 1e9 { (value * 1e6).round() / 1e6 } else { value }
}

fn millionths(out: &mut Vec<u8>, value: i64) {
    let mut digits = [0_u8; 20];
    let mut at = digits.len();
    let mut rest = value.unsigned_abs();
    let mut put = |byte: u8| {
        at -= 1;
        digits[at] = byte;
    };
    for place in 0.. {
        if place == 6 {
            put(b'.');
        }
        put(b'0' + (rest % 10) as u8);
        rest /= 10;
        if place >= 6 && rest == 0 {
            break;
        }
    }
    if value < 0 {
        put(b'-');
    }
    out.extend_from_slice(&digits[at..]);
}

/// As C's `%.10g` prints it, in any locale.
fn ten_digits(value: f64) -> String {
    let scientific = format!("{value:.9e}");
    let (digits, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trimmed = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    if (-4..10).contains(&exponent) {
        return trimmed(&format!("{value:.*}", (9 - exponent).max(0) as usize));
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{}e{sign}{:02}", trimmed(digits), exponent.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_plain_and_never_minus_zero() {
        let text = |value| {
            let mut out = vec![];
            length(&mut out, value);
            String::from_utf8(out).unwrap()
        };
        assert_eq!(text(-0.000_000_4), "0.000000");
        assert_eq!(text(-0.0), "0.000000");
        assert_eq!(text(-0.5), "-0.500000");
        assert_eq!(text(12.000_001), "12.000001");
        assert_eq!(text(-180.0), "-180.000000");
        assert_eq!(text(999_999_999.999_999_9), "1000000000.000000");
        assert_eq!(text(-1e12), "-1000000000000.000000");
    }

    #[test]
    fn ten_digits_are_those_of_c() {
        for (value, text) in [
            (1.0 / 120.0, "0.008333333333"),
            (1.0 / 60.0, "0.01666666667"),
            (1.0 / 30.0, "0.03333333333"),
            (0.04, "0.04"),
            (1.0, "1"),
            (100.0, "100"),
            (1e-6, "1e-06"),
            (0.000_012_345_678_912_3, "1.234567891e-05"),
            (123_456.0, "123456"),
            (1.5e12, "1.5e+12"),
        ] {
            assert_eq!(ten_digits(value), text);
        }
    }
}
