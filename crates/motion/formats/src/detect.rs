//! What a clip seems to be in: axes, unit, first frame. Reported, never applied.

use ambulo_rig::glam::DVec3;
use ambulo_rig::{Axes, Axis, Clip, Handedness, Roles};

use crate::Positions;

/// An axis and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// The axis.
    pub axis: Axis,
    /// The share of the frames looked at, 0 to 1, that point to it.
    pub share: f64,
}

/// Which reading of position channels keeps the bones at their lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PositionsFit {
    /// They take the offset's place.
    Replace,
    /// They are added to it.
    Add,
    /// No joint but the root has any.
    Unneeded,
    /// Bones change their lengths both ways.
    Unclear,
}

/// A report on a clip in the units and axes of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Detected {
    /// From the feet to the hips, or along the spine.
    pub up: Option<Guess>,
    /// The way the character faces, over all frames.
    pub forward: Option<Guess>,
    /// Whether left, up and forward (the toes) fit a right-handed system.
    pub handedness: Option<Handedness>,
    /// Length of a unit in metres, if that gives a person's hips a usual height.
    pub metres_per_unit: Option<f64>,
    /// Median height of the hips above the lower foot, in the file's units.
    pub hips_height: Option<f64>,
    /// Whether frame 0 stands with its arms stretched sideways.
    pub t_pose_first_frame: bool,
    /// How position channels fit.
    pub positions: PositionsFit,
    /// What the reader of the report should know.
    pub notes: Vec<String>,
}

impl Detected {
    /// The first of [`Axes::PRESETS`] with this up axis, handedness and unit. Which way an
    /// unturned character faces cannot be told from a recording that wanders about: that part is
    /// the preset's.
    pub fn preset(&self) -> Option<&'static str> {
        let (up, unit) = (self.up?.axis, self.metres_per_unit?);
        let handedness = self.handedness.unwrap_or(Handedness::Right);
        let fits = |axes: &Axes| {
            axes.up == up
                && axes.handedness == handedness
                && (axes.metres_per_unit / unit - 1.0).abs() < 0.01
        };
        Axes::PRESETS.iter().find(|(_, axes)| fits(axes)).map(|(name, _)| *name)
    }
}

/// Units tried, in metres: metre, centimetre, inch, and CMU's 1/0.45 inches.
const UNITS: [f64; 4] = [1.0, 0.01, 0.0254, 0.056444];

/// A grown person's hips above the ground, metres.
const HIPS_HEIGHT: std::ops::RangeInclusive<f64> = 0.7..=1.2;

/// Frames looked at, spread over the clip.
const MOST_FRAMES: usize = 64;

/// Looks at a clip that was read with this meaning of position channels.
pub fn detect(clip: &Clip, positions: Positions) -> Detected {
    let landmarks = Landmarks::find(clip);
    let step = clip.frames().div_ceil(MOST_FRAMES);
    let frames: Vec<Vec<DVec3>> = (0..clip.frames())
        .step_by(step)
        .map(|frame| {
            let mut places = vec![];
            clip.positions(frame, &mut places);
            places
        })
        .collect();
    let mut notes = vec![];
    let up = up(&landmarks, &frames, &mut notes);
    let up_axis = up.map(|up| up.axis.vector());
    let lateral = directions(&frames, |places| landmarks.lateral(places));
    let handedness = up_axis.and_then(|up| handedness(&landmarks, &frames, up));
    let forward = up_axis.and_then(|up| forward(up, &lateral, handedness));
    if handedness == Some(Handedness::Left) {
        notes.push("the toes point backwards: left-handed axes, or left and right swapped".into());
    }
    let hips_height = up_axis.and_then(|up| hips_height(&landmarks, &frames, up));
    let metres_per_unit = hips_height.and_then(unit_of);
    if metres_per_unit.is_none() {
        notes.push(match hips_height {
            Some(height) => format!("hips {height:.3} units high fit no unit: not a grown person?"),
            None => "no hips and feet by name: the unit is unknown".into(),
        });
    }
    let t_pose_first_frame = up_axis.is_some_and(|up| landmarks.t_pose(&frames[0], up));
    let positions = positions_fit(clip, positions, step);
    Detected {
        up,
        forward,
        handedness,
        metres_per_unit,
        hips_height,
        t_pose_first_frame,
        positions,
        notes,
    }
}

/// The unit in which such hips are a grown person's; no two units claim the same height.
fn unit_of(height: f64) -> Option<f64> {
    UNITS.into_iter().find(|unit| HIPS_HEIGHT.contains(&(height * unit)))
}

/// Joints by what they are, where their names tell.
#[derive(Default)]
struct Landmarks {
    hips: Option<usize>,
    head: Option<usize>,
    feet: Vec<usize>,
    /// A foot and the joint of its toes.
    toes: Vec<(usize, usize)>,
    /// Left and right: thighs, upper arms.
    pairs: Vec<(usize, usize)>,
    /// Left and right: upper arm and hand.
    arms: Option<[(usize, usize); 2]>,
}

impl Landmarks {
    fn find(clip: &Clip) -> Self {
        let roles = Roles::by_name(clip.skeleton());
        let list = |pair: Option<[usize; 2]>| pair.map_or(vec![], Vec::from);
        let (feet, toes) = (list(roles.feet), list(roles.toes));
        let pairs = [roles.thighs, roles.arms].into_iter().flatten();
        Self {
            hips: roles.hips,
            head: roles.head,
            toes: feet.iter().copied().zip(toes.iter().copied()).collect(),
            feet: [feet, toes].concat(),
            pairs: pairs.map(|[left, right]| (left, right)).collect(),
            arms: roles.arms.zip(roles.hands).map(|(a, h)| [(a[0], h[0]), (a[1], h[1])]),
        }
    }

    /// To the character's left, along hips and shoulders.
    fn lateral(&self, places: &[DVec3]) -> Option<DVec3> {
        let across = self.pairs.iter().map(|&(left, right)| places[left] - places[right]);
        across.reduce(|a, b| a + b)?.try_normalize()
    }

    fn toes(&self, places: &[DVec3]) -> Option<DVec3> {
        let ahead = self.toes.iter().map(|&(foot, toe)| places[toe] - places[foot]);
        ahead.reduce(|a, b| a + b)?.try_normalize()
    }

    fn spine(&self, places: &[DVec3]) -> Option<DVec3> {
        (places[self.head?] - places[self.hips?]).try_normalize()
    }

    fn legs(&self, places: &[DVec3]) -> Option<DVec3> {
        let feet = self.feet.iter().map(|&foot| places[foot]).reduce(|a, b| a + b)?;
        (places[self.hips?] - feet / self.feet.len() as f64).try_normalize()
    }

    fn t_pose(&self, places: &[DVec3], up: DVec3) -> bool {
        let (Some(arms), Some(lateral)) = (self.arms, self.lateral(places)) else { return false };
        let along = |(shoulder, hand): (usize, usize)| {
            (places[hand] - places[shoulder]).try_normalize().unwrap_or_default()
        };
        let (left, right) = (along(arms[0]), along(arms[1]));
        let level = |arm: DVec3| arm.dot(up).abs() < 0.2;
        let upright = self.legs(places).is_none_or(|legs| legs.dot(up) > 0.95);
        level(left)
            && level(right)
            && upright
            && left.dot(lateral) > 0.9
            && right.dot(lateral) < -0.9
    }
}

/// A direction in every frame that has it.
fn directions(frames: &[Vec<DVec3>], direction: impl Fn(&[DVec3]) -> Option<DVec3>) -> Vec<DVec3> {
    frames.iter().filter_map(|places| direction(places)).collect()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|value| value.is_finite());
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The axis that most directions are nearest to.
fn guess(directions: &[DVec3]) -> Option<Guess> {
    let votes = |axis: Axis| directions.iter().filter(|&&way| Axis::nearest(way) == axis).count();
    let (count, axis) = Axis::ALL
        .into_iter()
        .map(|axis| (votes(axis), axis))
        .reduce(|best, next| if next.0 > best.0 { next } else { best })?;
    (count > 0).then(|| Guess { axis, share: count as f64 / directions.len() as f64 })
}

fn up(landmarks: &Landmarks, frames: &[Vec<DVec3>], notes: &mut Vec<String>) -> Option<Guess> {
    let spine = guess(&directions(frames, |places| landmarks.spine(places)));
    let legs = guess(&directions(frames, |places| landmarks.legs(places)));
    match (spine, legs) {
        (Some(spine), Some(legs)) if spine.axis != legs.axis => {
            notes.push(format!(
                "the spine points to {}, the legs stand along {}: four-footed, or lying?",
                spine.axis, legs.axis
            ));
            Some(legs)
        }
        (None, None) => {
            notes.push("no hips, head or feet by name: the up axis is unknown".into());
            None
        }
        (spine, legs) => spine.or(legs),
    }
}

/// Whether the toes lie where left and up have forward in a right-handed system.
fn handedness(landmarks: &Landmarks, frames: &[Vec<DVec3>], up: DVec3) -> Option<Handedness> {
    let ahead = frames.iter().filter_map(|places| {
        Some(landmarks.lateral(places)?.cross(up).dot(landmarks.toes(places)?))
    });
    let ahead = median(ahead.collect())?;
    // Toes that hang straight down, or sideways, tell nothing.
    (ahead.abs() > 0.2).then_some(if ahead > 0.0 { Handedness::Right } else { Handedness::Left })
}

fn forward(up: DVec3, lateral: &[DVec3], handedness: Option<Handedness>) -> Option<Guess> {
    let sign = if handedness == Some(Handedness::Left) { -1.0 } else { 1.0 };
    let ahead = lateral.iter().filter_map(|left| (left.cross(up) * sign).try_normalize());
    guess(&ahead.collect::<Vec<_>>())
}

fn hips_height(landmarks: &Landmarks, frames: &[Vec<DVec3>], up: DVec3) -> Option<f64> {
    let hips = landmarks.hips?;
    let height = |places: &Vec<DVec3>| {
        let feet = landmarks.feet.iter().map(|&foot| places[foot].dot(up));
        feet.reduce(f64::min).map(|lowest| places[hips].dot(up) - lowest)
    };
    median(frames.iter().filter_map(height).collect())
}

/// Compares the lengths of bones whose start has position channels with their offsets.
fn positions_fit(clip: &Clip, read_as: Positions, step: usize) -> PositionsFit {
    let joints = clip.skeleton().joints();
    let (mut replace, mut add) = (vec![], vec![]);
    for (at, &joint) in clip.moving().iter().enumerate() {
        let offset = joints[joint].offset;
        // The root travels; what has no length fits both ways.
        if joints[joint].parent.is_none() || offset.length() < 1e-6 {
            continue;
        }
        let miss = |base: DVec3| {
            let misses = (0..clip.frames()).step_by(step).map(|frame| {
                let channels = match read_as {
                    Positions::Replace => clip.translations(frame)[at],
                    Positions::Add => clip.translations(frame)[at] - offset,
                };
                ((base + channels).length() / offset.length() - 1.0).abs()
            });
            misses.fold(0.0, f64::max)
        };
        replace.push(miss(DVec3::ZERO));
        add.push(miss(offset));
    }
    let (Some(replace), Some(add)) = (median(replace), median(add)) else {
        return PositionsFit::Unneeded;
    };
    match (replace < 0.1, add < 0.1) {
        (true, false) => PositionsFit::Replace,
        (false, true) => PositionsFit::Add,
        _ => PositionsFit::Unclear,
    }
}
