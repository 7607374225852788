//! Motion: poses at an even rate.

use glam::{DQuat, DVec3};

use crate::axes::Conversion;
use crate::{Pose, Skeleton, Transform};

/// Most rotations of a resampled clip: 3.2 GB of them, a day of a person at 60 Hz.
const MOST_ROTATIONS: f64 = 1e8;

/// Why numbers are not a clip.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum ClipError {
    #[error("frame time must be positive and finite, not {0}")]
    FrameTime(f64),
    #[error("expected {expected} {what}, got {got}")]
    Count { what: &'static str, expected: usize, got: usize },
    #[error("a clip needs at least one frame")]
    Empty,
    #[error("moving joints must be joints of the skeleton, in ascending order")]
    Moving,
    #[error("frame {frame}, joint {joint}: a number is not finite or a rotation is zero")]
    NotFinite { frame: usize, joint: usize },
    #[error("frame rate must be positive and finite, not {0}")]
    Rate(f64),
    #[error("at {fps} frames a second it would be {frames} frames of {joints} joints: too many")]
    TooLong { fps: f64, frames: f64, joints: usize },
}

/// A skeleton's local rotations, and the translations of those joints that have any, frame by
/// frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    skeleton: Skeleton,
    frame_time: f64,
    moving: Vec<usize>,
    translations: Vec<DVec3>,
    rotations: Vec<DQuat>,
}

impl Clip {
    /// Checks and takes the parts of a clip.
    ///
    /// * `frame_time`: seconds from one frame to the next, > 0.
    /// * `moving`: joints whose translation changes, ascending; all others keep their offset.
    /// * `translations`: frames × moving, the local translation (it replaces the offset).
    /// * `rotations`: frames × joints, local, of any length but 0; normalised here.
    ///
    /// # Errors
    /// Counts that do not fit, no frame, a number that is not finite.
    pub fn new(
        skeleton: Skeleton,
        frame_time: f64,
        moving: Vec<usize>,
        translations: Vec<DVec3>,
        mut rotations: Vec<DQuat>,
    ) -> Result<Self, ClipError> {
        if !(frame_time > 0.0 && frame_time.is_finite()) {
            return Err(ClipError::FrameTime(frame_time));
        }
        let joints = skeleton.len();
        let frames = rotations.len() / joints;
        if frames == 0 {
            return Err(ClipError::Empty);
        }
        let counted = |what, expected, got| match expected == got {
            true => Ok(()),
            false => Err(ClipError::Count { what, expected, got }),
        };
        counted("rotations", frames * joints, rotations.len())?;
        counted("translations", frames * moving.len(), translations.len())?;
        if !moving.is_sorted_by(|a, b| a < b) || moving.last().is_some_and(|&j| j >= joints) {
            return Err(ClipError::Moving);
        }
        if let Some(at) = translations.iter().position(|t| !t.is_finite()) {
            let (frame, joint) = (at / moving.len(), moving[at % moving.len()]);
            return Err(ClipError::NotFinite { frame, joint });
        }
        for (at, rotation) in rotations.iter_mut().enumerate() {
            let length = rotation.length();
            if !(length.is_finite() && length > f64::MIN_POSITIVE) {
                return Err(ClipError::NotFinite { frame: at / joints, joint: at % joints });
            }
            // Renormalising what is already unit would only stir the last bits.
            if (length - 1.0).abs() > 1e-15 {
                *rotation *= 1.0 / length;
            }
        }
        Ok(Self { skeleton, frame_time, moving, translations, rotations })
    }

    /// The skeleton that moves.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Number of frames, at least 1.
    pub fn frames(&self) -> usize {
        self.rotations.len() / self.skeleton.len()
    }

    /// Seconds from one frame to the next.
    pub fn frame_time(&self) -> f64 {
        self.frame_time
    }

    /// Frames a second.
    pub fn fps(&self) -> f64 {
        1.0 / self.frame_time
    }

    /// Seconds from the first frame to the last.
    pub fn duration(&self) -> f64 {
        (self.frames() - 1) as f64 * self.frame_time
    }

    /// Joints whose translation is animated, ascending.
    pub fn moving(&self) -> &[usize] {
        &self.moving
    }

    /// Local rotations of one frame, one a joint.
    pub fn rotations(&self, frame: usize) -> &[DQuat] {
        let joints = self.skeleton.len();
        &self.rotations[frame * joints..][..joints]
    }

    /// Local translations of one frame, one for each of [`Clip::moving`].
    pub fn translations(&self, frame: usize) -> &[DVec3] {
        &self.translations[frame * self.moving.len()..][..self.moving.len()]
    }

    /// Writes where every joint is in the world in one frame, without the loss of a [`Pose`]'s
    /// `f32`.
    pub fn positions(&self, frame: usize, positions: &mut Vec<DVec3>) {
        let (local, moved) = (self.rotations(frame), self.translations(frame));
        let mut moved = self.moving.iter().zip(moved).peekable();
        let mut turns: Vec<DQuat> = Vec::with_capacity(local.len());
        positions.clear();
        for (index, joint) in self.skeleton.joints().iter().enumerate() {
            let own = moved.next_if(|(joint, _)| **joint == index);
            let translation = own.map_or(joint.offset, |(_, translation)| *translation);
            let (place, turn) = match joint.parent {
                Some(parent) => {
                    (positions[parent] + turns[parent] * translation, turns[parent] * local[index])
                }
                None => (translation, local[index]),
            };
            positions.push(place);
            turns.push(turn);
        }
    }

    /// Writes the pose of one frame.
    pub fn frame(&self, frame: usize, pose: &mut Pose) {
        self.between(frame, frame, 0.0, pose);
    }

    /// Writes the pose at a time in seconds, held at both ends: quaternions are interpolated along
    /// the great arc, translations linearly.
    pub fn sample(&self, time: f64, pose: &mut Pose) {
        let (frame, next, t) = self.locate(time);
        self.between(frame, next, t, pose);
    }

    /// The same motion at another rate; where an old frame lies on a new one, it is kept as it is.
    ///
    /// The last new frame is the last one that is not after the old end.
    ///
    /// # Errors
    /// A rate that is not positive and finite, or one that makes more than 10⁸ rotations.
    pub fn resampled(&self, fps: f64) -> Result<Self, ClipError> {
        let count = (self.duration() * fps + 1e-6).floor() + 1.0;
        if !(fps > 0.0 && fps.is_finite()) {
            return Err(ClipError::Rate(fps));
        }
        if count * (self.skeleton.len() as f64) > MOST_ROTATIONS {
            return Err(ClipError::TooLong { fps, frames: count, joints: self.skeleton.len() });
        }
        let count = count as usize;
        let mut rotations = Vec::with_capacity(count * self.skeleton.len());
        let mut translations = Vec::with_capacity(count * self.moving.len());
        for index in 0..count {
            let (frame, next, t) = self.locate(index as f64 / fps);
            let pairs = self.rotations(frame).iter().zip(self.rotations(next));
            rotations.extend(pairs.map(|(&a, &b)| if t == 0.0 { a } else { a.slerp(b, t) }));
            let pairs = self.translations(frame).iter().zip(self.translations(next));
            translations.extend(pairs.map(|(a, &b)| a.lerp(b, t)));
        }
        let frame_time = 1.0 / fps;
        Self::new(self.skeleton.clone(), frame_time, self.moving.clone(), translations, rotations)
    }

    /// The frames of a range, `start` included, `end` not.
    ///
    /// # Errors
    /// An empty range or one that reaches past the end.
    pub fn slice(&self, start: usize, end: usize) -> Result<Self, ClipError> {
        if start >= end {
            return Err(ClipError::Empty);
        }
        if end > self.frames() {
            let (expected, got) = (end, self.frames());
            return Err(ClipError::Count { what: "frames", expected, got });
        }
        let (joints, moving) = (self.skeleton.len(), self.moving.len());
        Ok(Self {
            skeleton: self.skeleton.clone(),
            frame_time: self.frame_time,
            moving: self.moving.clone(),
            translations: self.translations[start * moving..end * moving].to_vec(),
            rotations: self.rotations[start * joints..end * joints].to_vec(),
        })
    }

    /// The same motion in other axes and units.
    pub fn converted(&self, conversion: &Conversion) -> Self {
        self.mapped(|v| conversion.point(v), |q| conversion.rotation(q))
    }

    /// Every length (offsets, tips, translations) multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        self.mapped(|v| v * factor, |q| q)
    }

    fn mapped(&self, point: impl Fn(DVec3) -> DVec3, rotation: impl Fn(DQuat) -> DQuat) -> Self {
        Self {
            skeleton: self.skeleton.map_offsets(&point),
            frame_time: self.frame_time,
            moving: self.moving.clone(),
            translations: self.translations.iter().map(|&t| point(t)).collect(),
            rotations: self.rotations.iter().map(|&q| rotation(q)).collect(),
        }
    }

    /// The two frames around a time and how far it lies between them; 0 on a frame.
    fn locate(&self, time: f64) -> (usize, usize, f64) {
        let last = self.frames() - 1;
        let at = (time / self.frame_time).clamp(0.0, last as f64);
        let frame = at.floor() as usize;
        let t = at - frame as f64;
        // Times that are meant to lie on a frame miss it by rounding only.
        if t < 1e-6 {
            (frame, frame, 0.0)
        } else if t > 1.0 - 1e-6 {
            (frame + 1, frame + 1, 0.0)
        } else {
            (frame, frame + 1, t)
        }
    }

    fn between(&self, frame: usize, next: usize, t: f64, pose: &mut Pose) {
        pose.local.clear();
        let offsets = self.skeleton.joints().iter().map(|joint| joint.offset);
        let rotations = self.rotations(frame).iter().zip(self.rotations(next));
        pose.local.extend(offsets.zip(rotations).map(|(offset, (&a, &b))| {
            let rotation = if t == 0.0 { a } else { a.slerp(b, t) };
            Transform::new(offset.as_vec3(), rotation.as_quat())
        }));
        let translations = self.translations(frame).iter().zip(self.translations(next));
        for (&joint, (a, &b)) in self.moving.iter().zip(translations) {
            pose.local[joint].translation = a.lerp(b, t).as_vec3();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Joint;
    use std::f64::consts::PI;

    fn skeleton() -> Skeleton {
        let joint = |name: &str, parent| Joint {
            name: name.into(),
            parent,
            offset: DVec3::Y,
            tips: vec![],
        };
        Skeleton::new(vec![joint("hips", None), joint("spine", Some(0))]).unwrap()
    }

    /// Turns at an even speed, through the seam at ±180°.
    fn turning(frames: usize, fps: f64) -> Clip {
        let angle = |frame: usize| frame as f64 / fps * 2.0 + PI - 0.5;
        let rotations = (0..frames).flat_map(|f| {
            [DQuat::from_rotation_y(angle(f)), DQuat::from_rotation_x(0.1 * f as f64 / fps)]
        });
        let translations = (0..frames).map(|f| DVec3::new(f as f64 / fps, 1.0, 0.0));
        Clip::new(skeleton(), 1.0 / fps, vec![0], translations.collect(), rotations.collect())
            .unwrap()
    }

    #[test]
    fn sampling_crosses_the_seam_at_180_degrees() {
        let clip = turning(11, 10.0);
        let mut pose = clip.skeleton().rest_pose();
        for step in 0..100 {
            let time = f64::from(step) * 0.01;
            clip.sample(time, &mut pose);
            let expected = DQuat::from_rotation_y(time * 2.0 + PI - 0.5).as_quat();
            assert!(pose.local[0].rotation.angle_between(expected) < 1e-3, "at {time} s");
            assert!((f64::from(pose.local[0].translation.x) - time).abs() < 1e-6);
            assert_eq!(pose.local[1].translation, glam::Vec3::Y, "the offset is kept");
        }
    }

    #[test]
    fn positions_are_those_of_the_pose() {
        let clip = turning(11, 10.0);
        let (mut pose, mut places) = (clip.skeleton().rest_pose(), vec![]);
        let mut global = vec![Transform::IDENTITY; 2];
        for frame in 0..clip.frames() {
            clip.positions(frame, &mut places);
            clip.frame(frame, &mut pose);
            pose.to_global(clip.skeleton(), &mut global);
            for (place, global) in places.iter().zip(&global) {
                assert!(place.as_vec3().abs_diff_eq(global.translation, 1e-6), "{place}");
            }
        }
    }

    #[test]
    fn resampling_keeps_frames_and_times() {
        let clip = turning(121, 120.0);
        let half = clip.resampled(60.0).unwrap();
        assert_eq!(half.frames(), 61);
        assert_eq!(half.rotations(30), clip.rotations(60), "kept to the bit");
        let odd = clip.resampled(47.0).unwrap();
        assert_eq!(odd.frames(), 48);
        let angle = odd.rotations(20)[0]
            .angle_between(DQuat::from_rotation_y(20.0 / 47.0 * 2.0 + PI - 0.5));
        assert!(angle < 1e-6, "{angle}");
        let back = half.resampled(120.0).unwrap();
        assert_eq!(back.frames(), clip.frames());
        assert!(clip.resampled(0.0).is_err() && clip.resampled(f64::NAN).is_err());
        assert!(matches!(clip.resampled(1e300), Err(ClipError::TooLong { .. })));
        assert!(matches!(clip.resampled(1e8), Err(ClipError::TooLong { .. })));
    }

    #[test]
    fn refuses_what_does_not_fit() {
        let refused = |moving, translations, rotations| {
            Clip::new(skeleton(), 0.1, moving, translations, rotations).unwrap_err()
        };
        assert_eq!(refused(vec![], vec![], vec![]), ClipError::Empty);
        let three = vec![DQuat::IDENTITY; 3];
        assert!(matches!(refused(vec![], vec![], three), ClipError::Count { .. }));
        let two = || vec![DQuat::IDENTITY; 2];
        assert!(matches!(refused(vec![0], vec![], two()), ClipError::Count { .. }));
        assert_eq!(refused(vec![2], vec![DVec3::ZERO], two()), ClipError::Moving);
        let zero = vec![DQuat::IDENTITY, DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)];
        assert_eq!(refused(vec![], vec![], zero), ClipError::NotFinite { frame: 0, joint: 1 });
        let nan = vec![DVec3::new(f64::NAN, 0.0, 0.0)];
        assert_eq!(refused(vec![1], nan, two()), ClipError::NotFinite { frame: 0, joint: 1 });
    }

    #[test]
    fn slices() {
        let clip = turning(10, 30.0);
        let part = clip.slice(2, 5).unwrap();
        assert_eq!(part.frames(), 3);
        assert_eq!(part.translations(0), clip.translations(2));
        assert_eq!(part.rotations(2), clip.rotations(4));
        assert!(clip.slice(3, 3).is_err() && clip.slice(3, 11).is_err());
    }
}
