//! Which gait a frame is: from speed, from the height of the hips, and from time off the ground.

use ambulo_features::GAITS;
use ambulo_features::gait::{CROUCH, JOG, JUMP, RUN, STAND, WALK};
use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::contacts::Contacts;
use crate::filter::{gaussian, quantile, stretches};
use crate::motion::Motion;
use crate::phase::steps;

/// Borders between gaits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GaitSettings {
    /// Slower is standing, m/s.
    pub walk: f32,
    /// Faster is jogging, m/s, for a leg of 85 cm: the speeds of other bodies go with the root of
    /// leg length (equal Froude numbers).
    pub jog: f32,
    /// Faster is running.
    pub run: f32,
    /// Hips lower than this share of their standing height are crouching.
    pub crouch: f32,
    /// Both feet off the ground for longer is a jump, seconds.
    pub jump: f32,
}

impl Default for GaitSettings {
    fn default() -> Self {
        Self { walk: 0.2, jog: 2.1, run: 3.8, crouch: 0.84, jump: 0.32 }
    }
}

/// Kinds of motion that a data set is balanced by: the gaits, and two ways of moving.
pub const CATEGORIES: [&str; 8] =
    ["stand", "walk", "jog", "run", "crouch", "jump", "backward", "sideways"];
const BACKWARD: u8 = 6;
const SIDEWAYS: u8 = 7;

/// A frame with this much more flight than double support (its inverse) is surely jogging.
const AERIAL: f32 = 20.0;

/// A gait lasts this long at least, seconds; jumps excepted.
const DWELL: f32 = 0.4;
/// Nobody jogs with fewer steps a second.
const CADENCE: f32 = 2.2;

/// Leg that the borders are for, metres.
const LEG: f32 = 0.85;

/// Gaits of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaits {
    /// Shares in the order of [`GAITS`], summing to 1, by frame; they cross-fade over a third of a
    /// second.
    pub shares: Vec<[f32; GAITS.len()]>,
    /// How far each frame is from the nearest border, 0.5 (on it) to 1.
    pub confidence: Vec<f32>,
    /// Index into [`CATEGORIES`], by frame.
    pub categories: Vec<u8>,
}

/// Root speeds, smoothed so that the sway of a step does not count.
pub fn speeds(motion: &Motion) -> Vec<f32> {
    let velocities: Vec<_> = (0..motion.frames()).map(|f| motion.root_velocity(f)).collect();
    gaussian(&velocities, 0.2 * motion.fps()).iter().map(|v| v.length()).collect()
}

impl Gaits {
    /// Finds the gaits of a motion whose legs are `leg` metres long.
    pub fn find(
        motion: &Motion,
        body: &Body,
        contacts: &Contacts,
        leg: f32,
        settings: &GaitSettings,
    ) -> Self {
        let fps = motion.fps();
        let scale = (leg / LEG).sqrt();
        let speeds = speeds(motion);
        let heights = hip_heights(motion, body, contacts, leg);
        let aerial = aerial(contacts, fps);
        let cadence = cadence(contacts, fps);
        let aloft = aloft(motion, body, contacts, settings.jump);
        let one = |frame: usize| {
            let speed = speeds[frame] / scale;
            let (gait, sure) = if aloft[frame] {
                (JUMP, 1.0)
            } else if heights[frame] < settings.crouch {
                (CROUCH, (settings.crouch - heights[frame]) / 0.05)
            } else {
                by_speed(speed, aerial[frame].min(0.1 * (cadence[frame] - CADENCE)), settings)
            };
            (gait, 1.0 / (1.0 + (-3.0 * sure).exp()))
        };
        let (mut gaits, confidence): (Vec<usize>, Vec<f32>) = (0..motion.frames()).map(one).unzip();
        drop_short(&mut gaits, (DWELL * fps) as usize);
        let categories = categories(motion, &gaits);
        Self { shares: shares(&gaits, 0.12 * fps), confidence, categories }
    }

    /// The same with some frames' gaits given by hand, `None` elsewhere.
    pub fn with_given(mut self, given: &[Option<usize>], motion: &Motion) -> Self {
        let found = self.shares.iter().map(strongest);
        let gaits: Vec<usize> =
            given.iter().zip(found).map(|(given, found)| given.unwrap_or(found)).collect();
        self.shares = shares(&gaits, 0.12 * motion.fps());
        self.categories = categories(motion, &gaits);
        for (confidence, given) in self.confidence.iter_mut().zip(given) {
            *confidence = if given.is_some() { 1.0 } else { *confidence };
        }
        self
    }

    /// Shares by frame from elsewhere, with categories of their own motion.
    pub fn given(shares: Vec<[f32; GAITS.len()]>, motion: &Motion) -> Self {
        let gaits: Vec<usize> = shares.iter().map(strongest).collect();
        let confidence = vec![1.0; shares.len()];
        Self { shares, confidence, categories: categories(motion, &gaits) }
    }
}

/// The gait with the largest share.
pub fn strongest(shares: &[f32; GAITS.len()]) -> usize {
    (0..GAITS.len()).max_by(|&a, &b| shares[a].total_cmp(&shares[b]).then(b.cmp(&a))).unwrap_or(0)
}

/// Gait by speed and flight, and how far from the nearest border (1 at a tenth beyond).
///
/// Walking has both feet down at times, jogging neither: that parts them, however slow the jog. At
/// speeds that nobody walks the feet need not tell.
fn by_speed(speed: f32, aerial: f32, settings: &GaitSettings) -> (usize, f32) {
    let beyond = |border: f32| (speed - border) / (0.1 * border);
    if speed < settings.walk {
        return (STAND, -beyond(settings.walk));
    }
    if speed >= settings.run {
        return (RUN, beyond(settings.run));
    }
    let jogs = (AERIAL * aerial)
        .max(beyond(1.3 * settings.jog))
        .max(beyond(settings.jog).min(1.0 + AERIAL * aerial));
    let sure = beyond(settings.walk).min(-beyond(settings.run)).min(jogs.abs());
    (if jogs > 0.0 { JOG } else { WALK }, sure)
}

/// How much more often neither foot is down than both, around each frame: −1 to 1.
fn aerial(contacts: &Contacts, fps: f32) -> Vec<f32> {
    let one = |frame: usize| match (contacts.foot(frame, 0), contacts.foot(frame, 1)) {
        (true, true) => -1.0,
        (false, false) => 1.0,
        _ => 0.0,
    };
    let all: Vec<f32> = (0..contacts.soles.len()).map(one).collect();
    gaussian(&all, 0.4 * fps)
}

/// Steps a second around each frame.
fn cadence(contacts: &Contacts, fps: f32) -> Vec<f32> {
    let mut landings = vec![0.0; contacts.soles.len()];
    for step in steps(contacts, fps) {
        landings[step.frame as usize] += fps;
    }
    gaussian(&landings, 0.4 * fps)
}

/// Heights of the hips above the lower foot's rest, as shares of their standing height.
fn hip_heights(motion: &Motion, body: &Body, contacts: &Contacts, leg: f32) -> Vec<f32> {
    let [left, right] = body.feet;
    let above = |frame: usize| {
        let lower = motion.position(frame, left).y.min(motion.position(frame, right).y);
        // On level ground the ground is known; elsewhere the lower foot is the best there is.
        let ground =
            if contacts.level { contacts.floors[0].min(contacts.floors[2]) } else { lower };
        motion.position(frame, body.hips).y - ground
    };
    let heights: Vec<f32> = (0..motion.frames()).map(above).collect();
    let upright = quantile(heights.clone(), 0.9).unwrap_or(leg);
    // A clip that crouches throughout has no upright height of its own: its legs tell.
    let upright = upright.clamp(0.98 * leg, 1.2 * leg);
    let shares: Vec<f32> = heights.iter().map(|height| height / upright).collect();
    gaussian(&shares, 0.15 * motion.fps())
}

/// Frames of a jump: nothing on the ground for long, and a little before and after.
fn aloft(motion: &Motion, body: &Body, contacts: &Contacts, least: f32) -> Vec<bool> {
    let mut aloft = vec![false; motion.frames()];
    let pad = (0.15 * motion.fps()) as usize;
    let free = |frame: usize| !contacts.foot(frame, 0) && !contacts.foot(frame, 1);
    for flight in stretches(motion.frames(), free) {
        let height = |frame: usize| motion.position(frame, body.hips).y;
        let top = flight.clone().map(height).fold(f32::MIN, f32::max);
        let ends = height(flight.start).min(height(flight.end - 1));
        // A body that is aloft for t falls by g·(t/2)²/2; a slide or a missed contact does not.
        let seconds = flight.len() as f32 / motion.fps();
        if seconds >= least && top - ends > 0.3 * 9.81 / 8.0 * seconds * seconds {
            let padded = flight.start.saturating_sub(pad)..(flight.end + pad).min(aloft.len());
            aloft[padded].iter_mut().for_each(|aloft| *aloft = true);
        }
    }
    aloft
}

/// Gives stretches shorter than `dwell` frames to the longer of their neighbours, the shortest first.
fn drop_short(gaits: &mut [usize], dwell: usize) {
    loop {
        let mut runs: Vec<std::ops::Range<usize>> = vec![];
        for frame in 0..gaits.len() {
            match runs.last_mut() {
                Some(run) if gaits[run.start] == gaits[frame] => run.end = frame + 1,
                _ => runs.push(frame..frame + 1),
            }
        }
        let short = |index: &usize| gaits[runs[*index].start] != JUMP && runs[*index].len() < dwell;
        let inner = (1..runs.len().saturating_sub(1)).filter(short);
        let Some(index) = inner.min_by_key(|&i| (runs[i].len(), i)) else { return };
        let (before, after) = (&runs[index - 1], &runs[index + 1]);
        let gait = gaits[if after.len() > before.len() { after.start } else { before.start }];
        gaits[runs[index].clone()].iter_mut().for_each(|g| *g = gait);
    }
}

/// One-hot shares, cross-faded.
fn shares(gaits: &[usize], sigma: f32) -> Vec<[f32; GAITS.len()]> {
    let mut shares = vec![[0.0; GAITS.len()]; gaits.len()];
    for gait in 0..GAITS.len() {
        let is: Vec<f32> = gaits.iter().map(|&g| if g == gait { 1.0 } else { 0.0 }).collect();
        let smooth = gaussian(&is, sigma);
        shares.iter_mut().zip(smooth).for_each(|(shares, share)| shares[gait] = share);
    }
    shares
}

fn categories(motion: &Motion, gaits: &[usize]) -> Vec<u8> {
    let along = |frame: usize| {
        let root = motion.root(frame);
        root.inward(motion.root_velocity(frame))
    };
    let local: Vec<_> = (0..motion.frames()).map(along).collect();
    let local = gaussian(&local, 0.2 * motion.fps());
    let category = |(frame, &gait): (usize, &usize)| {
        let velocity = local[frame];
        match gait {
            WALK | JOG | RUN if velocity.y < -0.5 * velocity.length() => BACKWARD,
            WALK | JOG | RUN if velocity.y < 0.5 * velocity.length() => SIDEWAYS,
            // Bumping into things is walking here.
            6.. => WALK as u8,
            gait => gait as u8,
        }
    };
    gaits.iter().enumerate().map(category).collect()
}
