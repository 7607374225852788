//! When a foot is on the ground.
//!
//! Each sole joint (heel and toe of both feet) has, in every frame, log-odds of being on the ground
//! from its speed and, where the ground is level, from its height above where it usually rests. The
//! likeliest sequence of on and off is found over the whole clip (Viterbi, with a cost for every
//! change), and stretches shorter than a minimum dwell go. No single frame decides anything, which
//! is what thresholds get wrong (Mourot et al., "UnderPressure", 2022).

use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::filter::{gaussian, quantile, stretches};
use crate::motion::Motion;

/// How contacts are told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ContactSettings {
    /// Speed in m/s at which a sole is as likely on the ground as off it.
    pub speed: f32,
    /// Height in metres above its resting height at which it is, on level ground.
    pub height: f32,
    /// Shortest contact, and shortest time off the ground, seconds.
    pub dwell: f32,
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self { speed: 0.45, height: 0.05, dwell: 0.07 }
    }
}

/// Log-odds of one frame are bounded: no frame is beyond doubt.
const MOST: f32 = 4.0;
/// Log-odds that a change between on and off costs.
const CHANGE: f32 = 6.0;
/// Resting heights that differ by less than this are level ground, metres.
const LEVEL: f32 = 0.06;

/// Contacts of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct Contacts {
    /// Left heel, left toe, right heel, right toe, by frame.
    pub soles: Vec<[bool; 4]>,
    /// How sure each frame is, 0.5 to 1: the mean over the soles of the chosen side's probability.
    pub confidence: Vec<f32>,
    /// Speed of the balls of both feet, m/s, by frame.
    pub toe_speeds: [Vec<f32>; 2],
    /// Height at which each sole rests, metres; on uneven ground the lowest tenth.
    pub floors: [f32; 4],
    /// Whether all rests of each sole are about as high.
    pub level: bool,
}

impl Contacts {
    /// Finds the contacts of a motion.
    pub fn find(motion: &Motion, body: &Body, settings: &ContactSettings) -> Self {
        let soles = body.soles();
        let speeds = soles.map(|joint| speeds(motion, joint));
        let by_speed = |sole: usize, frame: usize| {
            (MOST * (1.0 - speeds[sole][frame] / settings.speed)).clamp(-MOST, MOST)
        };
        let dwell = (settings.dwell * motion.fps()).round() as usize;
        let odds: [Vec<f32>; 4] = std::array::from_fn(|sole| {
            (0..motion.frames()).map(|frame| by_speed(sole, frame)).collect()
        });
        let first: [Vec<bool>; 4] = std::array::from_fn(|sole| likeliest(&odds[sole], dwell));
        let rests: [Vec<f32>; 4] =
            std::array::from_fn(|sole| rests(motion, soles[sole], &first[sole], &speeds[sole]));
        let spread = |sole: usize| {
            let at = |share| quantile(rests[sole].clone(), share).unwrap_or_default();
            at(0.9) - at(0.1)
        };
        let level = (0..4).all(|sole| spread(sole) < LEVEL);
        let share = if level { 0.5 } else { 0.1 };
        let floors = std::array::from_fn(|sole| {
            quantile(rests[sole].clone(), share).unwrap_or_else(|| lowest(motion, soles[sole]))
        });
        let odds: [Vec<f32>; 4] = std::array::from_fn(|sole| {
            let joint = soles[sole];
            let height = |frame: usize| {
                let above = motion.position(frame, joint).y - floors[sole];
                // Being low does not say that a foot rests; being high says that it does not.
                (MOST * (1.0 - above / settings.height)).clamp(-MOST, 1.0)
            };
            let height = |frame| if level { height(frame) } else { 0.0 };
            let sum = |(frame, odds): (usize, &f32)| (odds + height(frame)).clamp(-MOST, MOST);
            odds[sole].iter().enumerate().map(sum).collect()
        });
        let on: [Vec<bool>; 4] = std::array::from_fn(|sole| likeliest(&odds[sole], dwell));
        let frames = 0..motion.frames();
        let sure = |frame: usize| {
            let chosen =
                (0..4).map(|s| if on[s][frame] { odds[s][frame] } else { -odds[s][frame] });
            chosen.map(|odds| 1.0 / (1.0 + (-odds).exp())).sum::<f32>() / 4.0
        };
        Self {
            soles: frames.clone().map(|frame| std::array::from_fn(|s| on[s][frame])).collect(),
            confidence: frames.map(sure).collect(),
            toe_speeds: [speeds[1].clone(), speeds[3].clone()],
            floors,
            level,
        }
    }

    /// Whether a foot (0 left, 1 right) touches the ground, with heel or toe.
    pub fn foot(&self, frame: usize, side: usize) -> bool {
        self.soles[frame][2 * side] || self.soles[frame][2 * side + 1]
    }

    /// Whether both feet touch the ground.
    pub fn both(&self, frame: usize) -> bool {
        self.foot(frame, 0) && self.foot(frame, 1)
    }
}

fn speeds(motion: &Motion, joint: usize) -> Vec<f32> {
    let speeds: Vec<f32> =
        (0..motion.frames()).map(|frame| motion.velocity(frame, joint).length()).collect();
    gaussian(&speeds, motion.fps() / 60.0)
}

/// Heights of a sole, one for each time that it rests.
fn rests(motion: &Motion, joint: usize, on: &[bool], speeds: &[f32]) -> Vec<f32> {
    let rest = |stretch: std::ops::Range<usize>| {
        let slowest = stretch.min_by(|&a, &b| speeds[a].total_cmp(&speeds[b]));
        slowest.map(|frame| motion.position(frame, joint).y)
    };
    stretches(on.len(), |frame| on[frame]).into_iter().filter_map(rest).collect()
}

fn lowest(motion: &Motion, joint: usize) -> f32 {
    (0..motion.frames()).map(|f| motion.position(f, joint).y).fold(f32::INFINITY, f32::min)
}

/// The likeliest sequence of on and off for log-odds of being on, without stretches under `dwell`.
fn likeliest(odds: &[f32], dwell: usize) -> Vec<bool> {
    let mut scores = [0.0f32; 2];
    let mut from = Vec::with_capacity(odds.len());
    for &on in odds {
        let best = |state: usize| {
            let stay = scores[state];
            let change = scores[1 - state] - CHANGE;
            if change > stay { (change, 1 - state) } else { (stay, state) }
        };
        let (off, on_state) = (best(0), best(1));
        from.push([off.1, on_state.1]);
        scores = [off.0, on_state.0 + on];
    }
    let mut state = usize::from(scores[1] > scores[0]);
    let mut on = vec![false; odds.len()];
    for frame in (0..odds.len()).rev() {
        on[frame] = state == 1;
        state = from[frame][state];
    }
    drop_short(&mut on, dwell);
    on
}

/// Flips stretches shorter than `dwell` frames, the shortest first; those at the ends stay.
fn drop_short(on: &mut [bool], dwell: usize) {
    loop {
        let all = [true, false].into_iter().flat_map(|state| {
            let on = &on;
            stretches(on.len(), move |frame| on[frame] == state)
        });
        let inner = all.filter(|s| s.start > 0 && s.end < on.len() && s.len() < dwell);
        let Some(short) = inner.min_by_key(|s| (s.len(), s.start)) else { return };
        on[short].iter_mut().for_each(|on| *on = !*on);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flicker_is_no_step() {
        let mut odds = vec![3.0; 60];
        odds[20..40].iter_mut().for_each(|o| *o = -3.0);
        odds[10] = -3.0;
        odds[30] = 3.0;
        let on = likeliest(&odds, 4);
        assert_eq!(stretches(60, |f| on[f]), [0..20, 40..60]);
        let mut bits = vec![true, true, false, true, true, true, false, false, false, true];
        drop_short(&mut bits, 3);
        assert_eq!(stretches(10, |f| bits[f]), [0..6, 9..10]);
        assert!(likeliest(&[], 3).is_empty());
    }
}
