//! What a [`Player`](crate::Player) plays: a clip's poses at an even rate, apart from how its root
//! goes over the ground, with its phases and events.

use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Clip, Pose, Transform, wrapped};
use serde::{Deserialize, Serialize};

/// Most transforms of a motion: 280 MB of them, more than an hour of a person at 60 Hz.
const MOST_TRANSFORMS: f64 = 1e7;

/// A named span of a clip, such as enter, hold and exit of an interaction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Phase {
    /// Not empty.
    pub name: String,
    /// Seconds, from the clip's start.
    pub start: f64,
    /// Seconds, not before the start.
    pub end: f64,
}

/// A named moment of a clip, such as a hand that touches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mark {
    /// Not empty; may occur more than once.
    pub name: String,
    /// Seconds, from the clip's start.
    pub time: f64,
}

/// What an author writes beside a clip.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Marks {
    /// Where two overlap, the first counts.
    pub phases: Vec<Phase>,
    /// In any order.
    pub events: Vec<Mark>,
}

/// Why a clip with its marks cannot be played.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum MotionError {
    #[error("frame rate must be positive and finite, not {0}")]
    Rate(f64),
    #[error("{frames} frames of {joints} joints are too many")]
    TooLong { frames: f64, joints: usize },
    #[error("frame {frame}: a number is too large")]
    TooLarge { frame: usize },
    #[error("'{name}' at {time} s is not within the clip's {duration} s")]
    Outside { name: String, time: f64, duration: f64 },
    #[error("phase '{name}' ends at {end} s, before its start at {start} s")]
    Backward { name: String, start: f64, end: f64 },
    #[error("a phase or an event has no name")]
    NoName,
}

/// A way over the ground: first along, then about the vertical.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GroundStep {
    /// Metres; y is 0.
    pub place: Vec3,
    /// Radians, positive from +Z towards +X; not wrapped.
    pub yaw: f32,
}

impl GroundStep {
    /// This step and then another, which starts where this one ends.
    #[must_use]
    pub fn then(self, next: Self) -> Self {
        let place = self.place + Quat::from_rotation_y(self.yaw) * next.place;
        Self { place, yaw: self.yaw + next.yaw }
    }

    /// Back again.
    #[must_use]
    pub fn inverse(self) -> Self {
        Self { place: Quat::from_rotation_y(-self.yaw) * -self.place, yaw: -self.yaw }
    }

    /// Taken so many times, one after another.
    #[must_use]
    pub fn times(self, mut count: u64) -> Self {
        let (mut all, mut power) = (Self::default(), self);
        while count > 0 {
            if count & 1 == 1 {
                all = all.then(power);
            }
            power = power.then(power);
            count >>= 1;
        }
        all
    }

    /// As a transform of what stands on the ground.
    pub fn transform(self) -> Transform {
        Transform::new(self.place, Quat::from_rotation_y(self.yaw))
    }

    fn interpolate(self, other: Self, t: f32) -> Self {
        let yaw = self.yaw + (other.yaw - self.yaw) * t;
        Self { place: self.place.lerp(other.place, t), yaw }
    }
}

/// A clip ready to be played; share it among players.
///
/// A clip that is to loop ends in the pose in which it starts, but for its way over the ground: the
/// last frame is the first of the next round.
#[derive(Clone, Debug)]
pub struct Motion {
    joints: usize,
    /// Frames × joints; the root's without its way over the ground.
    transforms: Vec<Transform>,
    /// One a frame, from the first; that is at `start`.
    way: Vec<GroundStep>,
    start: Vec3,
    duration: f64,
    marks: Marks,
}

impl Motion {
    /// Samples a clip (in our axes and metres) at about `fps` frames a second, such that its first
    /// and its last frame are kept. `f32` is what is played.
    ///
    /// # Errors
    /// A rate that is not positive and finite, more than 10⁷ transforms, a number that `f32` cannot
    /// hold, marks without name, outside the clip or that end before they start.
    pub fn new(clip: &Clip, fps: f64, mut marks: Marks) -> Result<Self, MotionError> {
        let (joints, duration) = (clip.skeleton().len(), clip.duration());
        if !(fps > 0.0 && fps.is_finite()) {
            return Err(MotionError::Rate(fps));
        }
        let steps = if duration > 0.0 { (duration * fps).round().max(1.0) } else { 0.0 };
        if (steps + 1.0) * joints as f64 > MOST_TRANSFORMS {
            return Err(MotionError::TooLong { frames: steps + 1.0, joints });
        }
        check(&marks, duration)?;
        marks.events.sort_by(|a, b| a.time.total_cmp(&b.time));
        let mut transforms = Vec::with_capacity((steps as usize + 1) * joints);
        let mut pose = clip.skeleton().rest_pose();
        for frame in 0..=steps as usize {
            clip.sample(duration * frame as f64 / steps.max(1.0), &mut pose);
            crate::refused::check(&pose, joints).map_err(|_| MotionError::TooLarge { frame })?;
            transforms.extend_from_slice(&pose.local);
        }
        let (start, way) = part_root(&mut transforms, joints);
        Ok(Self { joints, transforms, way, start, duration, marks })
    }

    /// Joints of the poses.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Seconds; 0 of a single pose.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Phases as given, events by time.
    pub fn marks(&self) -> &Marks {
        &self.marks
    }

    /// The phase of that name.
    pub fn phase(&self, name: &str) -> Option<&Phase> {
        self.marks.phases.iter().find(|phase| phase.name == name)
    }

    /// The way of the root from the clip's start to a time in seconds, held at both ends: in the
    /// frame that stands under the root at the start, with the world's axes.
    pub fn way(&self, time: f64) -> GroundStep {
        let (frame, next, t) = self.locate(time);
        self.way[frame].interpolate(self.way[next], t)
    }

    /// The way from one time to another that lies so many rounds later (earlier, if negative): in the
    /// frame that stands under the root at the first.
    pub fn way_between(&self, from: f64, to: f64, rounds: i64) -> GroundStep {
        let whole = if rounds == 0 { GroundStep::default() } else { self.way(self.duration) };
        let whole = if rounds < 0 { whole.inverse() } else { whole };
        self.way(from).inverse().then(whole.times(rounds.unsigned_abs())).then(self.way(to))
    }

    /// Mean speed of the root over the ground, metres a second; 0 of a single pose.
    pub fn ground_speed(&self) -> f32 {
        let length: f32 = self.way.windows(2).map(|w| w[0].place.distance(w[1].place)).sum();
        if self.duration > 0.0 { (f64::from(length) / self.duration) as f32 } else { 0.0 }
    }

    /// Writes the pose at a time in seconds, held at both ends. The root stands over the origin,
    /// turned as at the clip's start.
    pub fn in_place(&self, time: f64, out: &mut Pose) {
        let (frame, next, t) = self.locate(time);
        let [a, b] =
            [frame, next].map(|frame| &self.transforms[frame * self.joints..][..self.joints]);
        out.local.clear();
        out.local
            .extend(a.iter().zip(b).map(|(&a, &b)| if t == 0.0 { a } else { a.interpolate(b, t) }));
    }

    /// The same with the root where the clip has it.
    pub fn as_recorded(&self, time: f64, out: &mut Pose) {
        self.in_place(time, out);
        let mut way = self.way(time).transform();
        way.translation += self.start;
        out.local[0] = way * out.local[0];
    }

    /// The two frames around a time and how far it lies between them.
    fn locate(&self, time: f64) -> (usize, usize, f32) {
        let last = self.way.len() - 1;
        if last == 0 {
            return (0, 0, 0.0);
        }
        let at = (time / self.duration * last as f64).clamp(0.0, last as f64);
        let frame = (at.floor() as usize).min(last);
        (frame, (frame + 1).min(last), (at - frame as f64) as f32)
    }
}

fn check(marks: &Marks, duration: f64) -> Result<(), MotionError> {
    let phases = marks.phases.iter();
    let times = phases.flat_map(|phase| [(&phase.name, phase.start), (&phase.name, phase.end)]);
    for (name, time) in times.chain(marks.events.iter().map(|mark| (&mark.name, mark.time))) {
        if name.is_empty() {
            return Err(MotionError::NoName);
        }
        if !(0.0..=duration).contains(&time) {
            return Err(MotionError::Outside { name: name.clone(), time, duration });
        }
    }
    match marks.phases.iter().find(|phase| phase.end < phase.start) {
        Some(Phase { name, start, end }) => {
            Err(MotionError::Backward { name: name.clone(), start: *start, end: *end })
        }
        None => Ok(()),
    }
}

/// Takes the way over the ground off the root's transforms: where it is at the start, and the way
/// from there. The yaw is that of the root's turn since the start, so that a root whose own axes lie
/// anyhow turns no differently.
fn part_root(transforms: &mut [Transform], joints: usize) -> (Vec3, Vec<GroundStep>) {
    let first = transforms[0];
    let level = |v: Vec3| Vec3::new(v.x, 0.0, v.z);
    let start = level(first.translation);
    let mut yaw = 0.0_f32;
    let mut way = Vec::with_capacity(transforms.len() / joints);
    for root in transforms.iter_mut().step_by(joints) {
        let turn = root.rotation * first.rotation.inverse();
        // The twist about the vertical: defined in every pose but upside down.
        let now = 2.0 * turn.y.atan2(turn.w);
        // No frame turns by more than half a turn: the way round is the shorter one.
        yaw += wrapped(now - yaw);
        let step = GroundStep { place: level(root.translation) - start, yaw };
        let back = Quat::from_rotation_y(-yaw);
        let height = Vec3::new(0.0, root.translation.y, 0.0);
        *root = Transform::new(height, (back * root.rotation).normalize());
        way.push(step);
    }
    (start, way)
}

#[cfg(test)]
mod tests;
