//! The phase of a gait cycle from footsteps: 0 when the right foot comes down, one half when the
//! left does.

use std::collections::BTreeSet;

use crate::contacts::Contacts;
use crate::filter::{gaussian, stretches};

/// A foot comes down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Frames from the clip's start.
    pub frame: f32,
    /// 0 left, 1 right.
    pub side: usize,
}

/// Longest half cycle in seconds of not standing; a longer one is not known to be walking.
const LONGEST: f32 = 1.2;
/// Before the first step of a clip and out of a stand, half a cycle takes this long, seconds.
const USUAL: f32 = 0.5;
/// Whoever has both feet down and hardly moves for this long stands, seconds.
const STANDS: f32 = 0.4;
/// A foot that has landed rests below this speed, m/s.
const RESTS: f32 = 0.12;
/// Steps closer than this are one (both feet land together), seconds.
const TOGETHER: f32 = 0.04;

/// Phase by frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// Cycles, growing along the clip; its fraction is the phase.
    pub cycles: Vec<f64>,
    /// Whether the phase is known there.
    pub known: Vec<bool>,
}

impl Phase {
    /// Radians per frame are no use to anybody: cycles per second at a frame.
    pub fn rate(&self, frame: usize, fps: f32) -> f32 {
        let next = (frame + 1).min(self.cycles.len() - 1);
        ((self.cycles[next] - self.cycles[frame]) * f64::from(fps)) as f32
    }

    /// In [0, 1).
    pub fn at(&self, frame: usize) -> f32 {
        (self.cycles[frame].rem_euclid(1.0) as f32).min(1.0 - f32::EPSILON)
    }
}

/// The moments at which a foot comes down, in order.
pub fn steps(contacts: &Contacts, fps: f32) -> Vec<Step> {
    let mut steps = vec![];
    for side in 0..2 {
        // The ball of the foot, not the heel, and when it has come to rest: that is what people mark
        // who label by hand, and a runner's heel may never touch the ground.
        let toe = |frame: usize| contacts.soles[frame][2 * side + 1];
        let speed = |frame: &usize| contacts.toe_speeds[side][*frame];
        let rest = |down: std::ops::Range<usize>| {
            let slowest = down.clone().min_by(|a, b| speed(a).total_cmp(&speed(b)));
            let mut frames = down;
            frames.find(|frame| speed(frame) < RESTS).or(slowest)
        };
        let down = stretches(contacts.soles.len(), toe).into_iter();
        let landed = down.filter(|stretch| stretch.start > 0).filter_map(rest);
        steps.extend(landed.map(|frame| Step { frame: frame as f32, side }));
    }
    steps.sort_by(|a, b| a.frame.total_cmp(&b.frame).then(a.side.cmp(&b.side)));
    steps.dedup_by(|b, a| b.frame - a.frame < TOGETHER * fps && a.side != b.side);
    steps
}

/// Frames in which the character stands: both feet down and slower than `speed` for a while.
pub fn standing(contacts: &Contacts, speeds: &[f32], speed: f32, fps: f32) -> Vec<bool> {
    let still = |frame: usize| contacts.both(frame) && speeds[frame] < speed;
    let mut standing = vec![false; speeds.len()];
    for stretch in stretches(speeds.len(), still) {
        if stretch.len() as f32 >= STANDS * fps {
            standing[stretch].iter_mut().for_each(|standing| *standing = true);
        }
    }
    standing
}

/// Phase through steps: it advances by half a cycle from one foot to the other and by a whole one
/// from a foot to itself, evenly but for stands, where it rests.
pub fn phase(steps: &[Step], standing: &[bool], fps: f32) -> Phase {
    let frames = standing.len();
    // How fast phase passes, relative to walking: not at all in a stand, softly at its borders.
    let pace: Vec<f32> = standing.iter().map(|&stands| if stands { 0.0 } else { 1.0 }).collect();
    let pace = gaussian(&pace, 0.08 * fps);
    let mut passed = vec![0.0f64; frames + 1];
    for (frame, pace) in pace.iter().enumerate() {
        passed[frame + 1] = passed[frame] + f64::from(pace.max(1e-3));
    }
    let time = |at: f32| {
        let frame = (at as usize).min(frames.saturating_sub(1));
        passed[frame] + f64::from(at - frame as f32) * (passed[frame + 1] - passed[frame])
    };
    let mut anchors: Vec<(f32, f64)> = vec![];
    for (index, step) in steps.iter().enumerate() {
        let first = if step.side == 1 { 1.0 } else { 0.5 };
        let value = match index.checked_sub(1) {
            None => first,
            Some(before) => {
                let advance = if steps[before].side == step.side { 1.0 } else { 0.5 };
                anchors[before].1 + advance
            }
        };
        anchors.push((step.frame, value));
    }
    let (mut cycles, mut known) = (vec![0.0; frames], standing.to_vec());
    let mut next = 0;
    for frame in 0..frames {
        let at = frame as f32;
        while next < anchors.len() && anchors[next].0 <= at {
            next += 1;
        }
        let before = next.checked_sub(1).map(|index| anchors[index]);
        (cycles[frame], known[frame]) = match (before, anchors.get(next)) {
            (Some((a, from)), Some(&(b, to))) => {
                let whole = time(b) - time(a);
                let halves = 2.0 * (to - from);
                let known = whole <= f64::from(LONGEST * fps) * halves;
                (from + (to - from) * (time(at) - time(a)) / whole, known || standing[frame])
            }
            (None, Some(&(b, to))) => {
                let left = (time(b) - time(at)) / f64::from(USUAL * fps);
                (to - 0.5 * left.min(1.0), left <= 1.01 || standing[frame])
            }
            (Some((_, last)), None) => (last, standing[frame]),
            (None, None) => (0.0, standing[frame]),
        };
    }
    Phase { cycles, known }
}

/// Share of steps that repeat the foot before: 0 in clean walking.
pub fn repeats(steps: &[Step]) -> f32 {
    let same = steps.windows(2).filter(|pair| pair[0].side == pair[1].side).count();
    same as f32 / steps.len().saturating_sub(1).max(1) as f32
}

/// Frames at which cycles begin: the right foot comes down.
pub fn cycle_starts(phase: &Phase) -> BTreeSet<usize> {
    let turns = phase.cycles.windows(2).enumerate();
    turns.filter(|(_, w)| w[1].floor() > w[0].floor()).map(|(frame, _)| frame + 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FPS: f32 = 60.0;

    fn walk(from: usize, count: usize, every: usize) -> Vec<Step> {
        let step = |i: usize| Step { frame: (from + i * every) as f32, side: 1 - i % 2 };
        (0..count).map(step).collect()
    }

    #[test]
    fn phase_is_a_line_through_even_steps() {
        let phase = phase(&walk(30, 8, 30), &[false; 300], FPS);
        assert_eq!(phase.cycles[30], 1.0);
        assert!((phase.cycles[45] - 1.25).abs() < 1e-6);
        assert!((phase.cycles[60] - 1.5).abs() < 1e-6, "left at one half");
        assert!((phase.rate(100, FPS) - 1.0).abs() < 1e-3);
        assert!(phase.known[0] && phase.known[239] && !phase.known[260], "mid-air after the end");
        assert_eq!(cycle_starts(&phase).into_iter().collect::<Vec<_>>(), [30, 90, 150, 210]);
    }

    #[test]
    fn a_repeated_foot_is_a_whole_cycle() {
        let mut steps = walk(30, 4, 30);
        steps.remove(1);
        let phase = phase(&steps, &[false; 200], FPS);
        assert_eq!(phase.cycles[90] - phase.cycles[30], 1.0);
        assert!(repeats(&steps) > 0.4);
    }

    #[test]
    fn phase_rests_in_a_stand() {
        let mut steps = walk(30, 4, 30);
        steps.extend(walk(500, 4, 30));
        let mut standing = [false; 700];
        standing[150..470].iter_mut().for_each(|s| *s = true);
        let phase = phase(&steps, &standing, FPS);
        assert!(phase.known[100] && phase.known[300] && phase.known[490]);
        assert!(phase.rate(300, FPS) < 0.02, "{}", phase.rate(300, FPS));
        assert!(phase.rate(485, FPS) > 0.3, "and advances out of it");
        assert!(phase.cycles.windows(2).all(|w| w[1] >= w[0]));
        // The same gap without a stand is not known to be a step.
        let phase = super::phase(&steps, &[false; 700], FPS);
        assert!(!phase.known[300] && phase.known[100]);
    }
}
