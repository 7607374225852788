//! What a line of a pose or a key sets: numbers by track.

use std::collections::HashMap;
use std::ops::RangeInclusive;

use super::figure::{AT, FACING, Figure, SWIVEL, WEIGHT};
use super::lines::Line;
use super::read::LENGTH;
use crate::ReadError;

const DEGREES: RangeInclusive<f64> = -3600.0..=3600.0;

/// `at x y z`, `facing y z x`, `swivel a`, `weight w` or `free`, at least one of them.
pub(super) fn set_limb(
    line: &mut Line,
    track: usize,
    sets: &mut Vec<(usize, f64)>,
) -> Result<(), ReadError> {
    const EXPECTED: &str = "at, facing, swivel, weight or free";
    // A place without a weight has all of it; the weight stands before it.
    let mut weight = None;
    loop {
        match line.word(EXPECTED)? {
            "at" => {
                if weight.is_none() {
                    weight = Some((sets.len(), false));
                    sets.push((track + WEIGHT, 1.0));
                }
                sets.extend(three(track + AT, line.numbers("metres", LENGTH)?));
            }
            "facing" => {
                let turned = line.numbers("degrees about Y, Z and X", DEGREES)?;
                sets.extend(three(track + FACING, turned));
            }
            "swivel" => sets.push((track + SWIVEL, line.number("degrees", DEGREES)?)),
            word @ ("weight" | "free") if !matches!(weight, Some((_, true))) => {
                let value = if word == "free" { 0.0 } else { line.number("a share", 0.0..=1.0)? };
                let at = weight.map_or(sets.len(), |(at, _)| at);
                match sets.get_mut(at) {
                    Some(set) => set.1 = value,
                    None => sets.push((track + WEIGHT, value)),
                }
                weight = Some((at, true));
            }
            _ => return Err(line.wrong(EXPECTED)),
        }
        if line.peek().is_none() {
            return Ok(());
        }
    }
}

fn three(first: usize, numbers: [f64; 3]) -> impl Iterator<Item = (usize, f64)> {
    numbers.into_iter().enumerate().map(move |(n, number)| (first + n, number))
}

/// Joints, then angles by name that all of them have; `at x y z` for the root alone.
pub(super) fn set_joints(
    line: &mut Line,
    figure: &Figure,
    by_name: &HashMap<String, usize>,
    sets: &mut Vec<(usize, f64)>,
) -> Result<(), ReadError> {
    let mut joints = vec![];
    while let Some(&joint) = line.peek().and_then(|name| by_name.get(name)) {
        joints.push(joint);
        line.next_word();
    }
    if joints.is_empty() {
        return Err(line.unexpected("a joint, a limb, a pose or a key"));
    }
    let mut numbers: Vec<Vec<(usize, f64)>> = vec![vec![]; joints.len()];
    loop {
        let known = || figure.turns[joints[0]].iter().map(|turn| turn.name.as_str());
        let expected =
            || format!("one of {}", known().chain(["at"]).collect::<Vec<_>>().join(", "));
        let name = line.word("a turn's name")?;
        if name == "at" {
            if joints != [0] {
                return Err(line.wrong("at for the root alone"));
            }
            numbers[0].extend(three(figure.root_track(), line.numbers("metres", LENGTH)?));
        } else {
            let mut turns = vec![];
            for &joint in &joints {
                let turn = figure.turns[joint].iter().position(|turn| turn.name == name);
                turns.push(turn.ok_or_else(|| line.wrong(&expected()))?);
            }
            let value = line.number("degrees", DEGREES)?;
            for ((&joint, turn), list) in joints.iter().zip(turns).zip(&mut numbers) {
                list.push((figure.turn_track(joint) + turn, value));
            }
        }
        if line.peek().is_none() {
            break;
        }
    }
    sets.extend(numbers.into_iter().flatten());
    Ok(())
}
