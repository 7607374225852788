//! Interactions, made ready for a body.

use ambulo_layers::{Marks, Motion, MotionError};
use ambulo_rig::glam::DVec3;
use ambulo_rig::{Clip, Joint, Mirror, Pose, Retarget, Stance, Transform};

use super::body::Body;
use crate::{Interaction, Scene};

/// Frames a second that clips are sampled at.
const FPS: f64 = 60.0;
/// A toe stands when it is no higher over its height on the ground, metres, and no faster, metres a
/// second.
const STANDS: [f32; 2] = [0.03, 0.15];
/// A clip may be so much shorter than its interaction says, seconds.
const SHORT: f64 = 0.02;

/// Why an interaction cannot be played.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum MoveError {
    #[error("{file}: $.clip.file: there is no '{clip}'")]
    Missing { file: String, clip: String },
    #[error("{file}: $.clip.end: the clip '{clip}' is over at {duration:.2} s already")]
    Short { file: String, clip: String, duration: f64 },
    #[error("{file}: $.clip.file: '{clip}' cannot be played: {reason}")]
    Clip { file: String, clip: String, reason: String },
    #[error("object '{object}' offers '{file}', which is not there")]
    Offer { object: String, file: String },
}

/// One interaction.
#[derive(Clone, Debug)]
pub struct Move {
    /// The file that it was read from.
    pub file: String,
    /// What it says.
    pub interaction: Interaction,
    pub(super) motion: Option<Motion>,
    /// Whether left and right toes stand, a frame of the motion each.
    stands: Vec<[bool; 2]>,
}

/// What a scene's objects offer a body.
#[derive(Clone, Debug, Default)]
pub struct Moves {
    all: Vec<Move>,
    /// Object and move, by object, in the order in which they win.
    offers: Vec<(usize, usize)>,
}

impl Moves {
    /// The interactions (file name and content) that a scene's objects name, on a body. `clip` gives
    /// the motion of a file, in our axes and metres.
    ///
    /// # Errors
    /// An interaction or a clip that is not there, a clip that is too short or of a skeleton that
    /// is not this body's.
    pub fn new<'a>(
        body: &Body,
        scene: &Scene,
        interactions: &[(String, Interaction)],
        clip: impl Fn(&str) -> Option<&'a Clip>,
    ) -> Result<Self, MoveError> {
        let ready =
            |(file, interaction): &(String, Interaction)| Move::new(body, file, interaction, &clip);
        let all = interactions.iter().map(ready).collect::<Result<Vec<_>, _>>()?;
        let mut offers = vec![];
        for (index, object) in scene.objects.iter().enumerate() {
            for file in &object.interactions {
                let found = all.iter().position(|one| one.file == *file);
                let (object, file) = (object.name.clone(), file.clone());
                offers.push((index, found.ok_or(MoveError::Offer { object, file })?));
            }
        }
        Ok(Self { all, offers })
    }

    /// All of them.
    pub fn all(&self) -> &[Move] {
        &self.all
    }

    /// Which object offers which of them.
    pub fn offers(&self) -> &[(usize, usize)] {
        &self.offers
    }
}

impl Move {
    fn new<'a>(
        body: &Body,
        file: &str,
        interaction: &Interaction,
        clip: impl Fn(&str) -> Option<&'a Clip>,
    ) -> Result<Self, MoveError> {
        let (name, end) = (interaction.clip.file.clone(), f64::from(interaction.clip.end));
        let file = String::from(file);
        let ready = |motion, stands| Move {
            file: file.clone(),
            interaction: interaction.clone(),
            motion,
            stands,
        };
        let Some(name) = name else { return Ok(ready(None, vec![])) };
        let source =
            clip(&name).ok_or(MoveError::Missing { file: file.clone(), clip: name.clone() })?;
        let refused =
            |reason: String| MoveError::Clip { file: file.clone(), clip: name.clone(), reason };
        if source.duration() + SHORT < end {
            let duration = source.duration();
            return Err(MoveError::Short { file, clip: name, duration });
        }
        let clip = fit(body, source, interaction.clip.mirror).map_err(refused)?;
        let motion = Motion::new(&clip, FPS, Marks::default())
            .map_err(|error: MotionError| refused(error.to_string()))?;
        let stands = stands(body, &motion);
        Ok(ready(Some(motion), stands))
    }

    /// How surely heels and toes stand at a second of the clip, as a controller's contacts.
    pub(super) fn contacts(&self, time: f32) -> [f32; 4] {
        let last = self.stands.len().saturating_sub(1);
        let frame = ((f64::from(time) * FPS) as usize).min(last);
        let [left, right] = self
            .stands
            .get(frame)
            .map_or([1.0; 2], |stands| stands.map(|stands| if stands { 1.0 } else { 0.0 }));
        [left, left, right, right]
    }
}

/// A clip on a body's own skeleton, mirrored if asked.
fn fit(body: &Body, clip: &Clip, mirror: bool) -> Result<Clip, String> {
    let mirrored = match mirror {
        true => Mirror::by_name(clip, DVec3::X).and_then(|mirror| mirror.apply(clip)).map(Some),
        false => Ok(None),
    };
    let mirrored = mirrored.map_err(|error| error.to_string())?;
    let clip = mirrored.as_ref().unwrap_or(clip);
    let (own, its) = (body.skeleton(), clip.skeleton());
    let same = |a: &Joint, b: &Joint| a.name == b.name && a.offset.abs_diff_eq(b.offset, 1e-3);
    if own.len() == its.len() && own.joints().iter().zip(its.joints()).all(|(a, b)| same(a, b)) {
        return Ok(clip.clone());
    }
    let fitted = Retarget::new(&Stance::rest(its), &Stance::rest(own))
        .and_then(|mut retarget| retarget.clip(clip));
    fitted.map_err(|error| error.to_string())
}

fn stands(body: &Body, motion: &Motion) -> Vec<[bool; 2]> {
    let frames = (motion.duration() * FPS).round() as usize;
    let mut pose = body.skeleton.rest_pose();
    let mut global = vec![Transform::IDENTITY; body.skeleton.len()];
    let mut toes = |frame: usize, pose: &mut Pose| {
        motion.as_recorded(frame as f64 / FPS, pose);
        pose.to_global(&body.skeleton, &mut global);
        body.toes.map(|(joint, _)| global[joint].translation)
    };
    let places: Vec<_> = (0..=frames).map(|frame| toes(frame, &mut pose)).collect();
    let stands = |frame: usize| {
        let after = places[(frame + 1).min(frames)];
        [0, 1].map(|side| {
            let (place, high) = (places[frame][side], body.toes[side].1);
            let moved = place.distance(after[side]) * FPS as f32;
            place.y < high + STANDS[0] && moved < STANDS[1]
        })
    };
    (0..=frames).map(stands).collect()
}
