//! Keys → clip.

use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Clip, Mirror};

use super::figure::{AT, FACING, Figure, LIMB, SWIVEL, Turn, WEIGHT};
use super::limb::{self, Goal};
use super::{Easing, Keys, Phase, Sampled};
use crate::error::Notes;
use crate::euler::turned;

/// A number at a key.
#[derive(Clone, Copy)]
struct Knot {
    time: f64,
    value: f64,
    easing: Easing,
}

/// What a limb may miss its place by before it is told, metres.
const MISSED: f64 = 1e-3;
/// How far the ends of a loop may differ before it is told.
const LOOP_DEGREES: f64 = 0.5;
const LOOP_METRES: f64 = 5e-3;

pub(super) fn sample(keys: &Keys) -> Sampled {
    let figure = &keys.figure;
    let mut curves: Vec<_> = tracks(keys).into_iter().map(Curve::new).collect();
    // The last frame is the last one that is not after the last key.
    let frames = (keys.duration() * keys.fps + 1e-6).floor() as usize + 1;
    let mut rotations = Vec::with_capacity(frames * figure.skeleton.len());
    let mut places = Vec::with_capacity(frames);
    let mut missed = vec![(0.0, 0.0); figure.limbs.len()];
    let mut values = vec![0.0; curves.len()];
    for frame in 0..frames {
        let time = (frame as f64 / keys.fps).min(keys.duration());
        for (value, curve) in values.iter_mut().zip(&mut curves) {
            *value = curve.at(time);
        }
        let root = DVec3::from_slice(&values[figure.root_track()..][..3]);
        let mut local = angles(figure, &values);
        for (limb, missed) in missed.iter_mut().enumerate() {
            let short = place(figure, limb, &values, root, &mut local);
            if short > missed.0 {
                *missed = (short, time);
            }
        }
        rotations.extend(local);
        places.push(root);
    }
    let clip = Clip::new(figure.skeleton.clone(), 1.0 / keys.fps, vec![0], places, rotations);
    let clip = clip.expect("finite numbers, one a joint and frame");
    let mut notes = Notes::default();
    for (limb, (short, time)) in figure.limbs.iter().zip(missed) {
        if short > MISSED {
            let (name, short) = (&limb.name, short * 100.0);
            notes.push(format!("{name} ends {short:.1} cm short of its place at {time:.2} s"));
        }
    }
    for phase in keys.marks.phases.iter().filter(|phase| phase.loops) {
        closed(&clip, phase, &mut notes);
    }
    let mut clip = clip;
    if keys.mirrored.is_some() {
        match Mirror::by_name(&clip, DVec3::X).and_then(|mirror| mirror.apply(&clip)) {
            Ok(mirrored) => clip = mirrored,
            Err(error) => notes.push(format!("it is not mirrored: {error}")),
        }
    }
    Sampled { clip, notes: notes.finish() }
}

// -- tracks -----------------------------------------------------------------------------------

/// The knots of every track: what a key leaves out is held there, unless the key is partial.
fn tracks(keys: &Keys) -> Vec<Vec<Knot>> {
    let figure = &keys.figure;
    let rest: Vec<_> = (0..figure.tracks()).map(|track| figure.at_rest(track)).collect();
    let mut now = rest.clone();
    let mut tracks = vec![vec![]; now.len()];
    for key in &keys.keys {
        if let Some(pose) = key.pose {
            for (now, rest) in now.iter_mut().zip(&rest) {
                *now = rest.or(*now);
            }
            figure.poses[pose].sets.iter().for_each(|&(track, value)| now[track] = Some(value));
        }
        let mut knot = |track: usize, value| {
            let (time, easing) = (key.time, key.easing);
            tracks[track].push(Knot { time, value, easing });
        };
        for &(track, value) in &key.sets {
            now[track] = Some(value);
            if key.partial {
                knot(track, value);
            }
        }
        if !key.partial {
            now.iter().enumerate().for_each(|(track, now)| {
                if let Some(value) = now {
                    knot(track, *value);
                }
            });
        }
    }
    tracks
}

/// A track with its slopes; asked in the order of time.
struct Curve {
    knots: Vec<Knot>,
    slopes: Vec<f64>,
    /// The last knot that is not after the time asked for.
    last: usize,
}

impl Curve {
    fn new(knots: Vec<Knot>) -> Self {
        let slopes = (0..knots.len()).map(|at| slope(&knots, at)).collect();
        Self { knots, slopes, last: 0 }
    }

    /// The value at a time; before the first knot it is the first one's, and 0 without any.
    fn at(&mut self, time: f64) -> f64 {
        while self.knots.get(self.last + 1).is_some_and(|next| next.time <= time) {
            self.last += 1;
        }
        let Some(a) = self.knots.get(self.last) else { return 0.0 };
        let Some(b) = self.knots.get(self.last + 1).filter(|_| time > a.time) else {
            return a.value;
        };
        let (seconds, rise) = (b.time - a.time, b.value - a.value);
        let s = (time - a.time) / seconds;
        if b.easing == Easing::Linear {
            return a.value + rise * s;
        }
        // A quintic without acceleration at either end; least jerk where both are at rest
        // (Flash & Hogan 1985).
        let cubed = s * s * s;
        let risen = cubed * (10.0 + s * (6.0 * s - 15.0));
        let left = s - cubed * (6.0 + s * (3.0 * s - 8.0));
        let arriving = -cubed * (4.0 + s * (3.0 * s - 7.0));
        let (from, to) = (self.slopes[self.last], self.slopes[self.last + 1]);
        a.value + rise * risen + seconds * (from * left + to * arriving)
    }
}

/// The speed at a knot. One that is passed through has the harmonic mean of the speeds before and
/// after, by which no curve swings beyond its knots (Fritsch & Butland 1984).
fn slope(knots: &[Knot], at: usize) -> f64 {
    let secant = |a: usize| {
        let (a, b) = (knots[a], knots[a + 1]);
        (b.value - a.value) / (b.time - a.time)
    };
    match knots[at].easing {
        Easing::Linear if at > 0 => secant(at - 1),
        Easing::Through if at > 0 && at + 1 < knots.len() => {
            let (before, after) = (secant(at - 1), secant(at));
            if before * after <= 0.0 { 0.0 } else { 2.0 * before * after / (before + after) }
        }
        _ => 0.0,
    }
}

// -- poses ------------------------------------------------------------------------------------

/// The local rotations that the joints' angles say.
fn angles(figure: &Figure, values: &[f64]) -> Vec<DQuat> {
    let joint = |(joint, turns): (usize, &Vec<Turn>)| {
        let values = &values[figure.turn_track(joint)..];
        turns.iter().zip(values).fold(DQuat::IDENTITY, |rotation, (turn, degrees)| {
            turned(rotation, turn.axis, turn.sign * degrees)
        })
    };
    figure.turns.iter().enumerate().map(joint).collect()
}

/// Bends a limb to its place; gives by how much it misses.
fn place(figure: &Figure, limb: usize, values: &[f64], root: DVec3, local: &mut [DQuat]) -> f64 {
    let values = &values[figure.limb_track(limb)..][..LIMB];
    let weight = values[WEIGHT];
    if weight <= 0.0 {
        return 0.0;
    }
    let limb = &figure.limbs[limb];
    let facing = &values[FACING..];
    let hinge = figure.turns[limb.joints[1]].first();
    let goal = Goal {
        weight,
        at: DVec3::from_slice(&values[AT..]),
        facing: [1, 2, 0]
            .iter()
            .zip(facing)
            .fold(DQuat::IDENTITY, |q, (&axis, &a)| turned(q, axis, a)),
        swivel: values[SWIVEL].to_radians(),
        hinge: hinge.map_or(DVec3::X, |turn| DVec3::AXES[turn.axis] * turn.sign),
    };
    let joints = figure.joints();
    let mut places: Vec<DVec3> = Vec::with_capacity(joints.len());
    let mut turns: Vec<DQuat> = Vec::with_capacity(joints.len());
    for (joint, own) in joints.iter().zip(local.iter()) {
        let (place, turn) = match joint.parent {
            Some(parent) => (places[parent] + turns[parent] * joint.offset, turns[parent] * *own),
            None => (root, *own),
        };
        places.push(place);
        turns.push(turn);
    }
    limb::place(limb, joints, &goal, &places, &turns, local)
}

/// Notes a loop whose end does not go over into its start.
fn closed(clip: &Clip, phase: &Phase, notes: &mut Notes) {
    let frame = |time: f64| ((time * clip.fps()).round() as usize).min(clip.frames() - 1);
    let (start, end) = (frame(phase.start), frame(phase.end));
    let pairs = clip.rotations(start).iter().zip(clip.rotations(end));
    let apart = pairs.map(|(a, b)| crate::euler::apart(*a, *b));
    let (joint, degrees) =
        apart.enumerate().fold((0, 0.0), |most, one| if one.1 > most.1 { one } else { most });
    let metres = clip.translations(start)[0].distance(clip.translations(end)[0]);
    if degrees > LOOP_DEGREES || metres > LOOP_METRES {
        let joint = &clip.skeleton().joints()[joint].name;
        notes.push(format!(
            "phase '{}' does not close: {joint} is {degrees:.1} degrees and the root {:.1} cm off",
            phase.name,
            metres * 100.0
        ));
    }
}
