//! A file's clip as a labelled motion on the data set's skeleton.

use std::path::Path;

use ambulo_features::Layout;
use ambulo_rig::glam::DVec3;
use ambulo_rig::{Axes, Clip, Skeleton};

use crate::body::{Body, RoleNames};
use crate::compare::Judged;
use crate::contacts::{ContactSettings, Contacts};
use crate::gait::GaitSettings;
use crate::given::{Given, Published};
use crate::labels::{Labels, Sources};
use crate::motion::{Fitting, Motion, leg_length, mirrored};

/// Longest label file that is read, bytes.
const LARGEST_LABELS: u64 = 1 << 28;

/// What all clips of a data set share.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Layout of the vectors.
    pub layout: Layout,
    /// In metres; its root's offset is zero.
    pub skeleton: Skeleton,
    /// Joints by role.
    pub roles: RoleNames,
    /// Names of joints that are left out.
    pub drop: Vec<String>,
    /// Heights of the standing soles, metres.
    pub foot_heights: [f32; 4],
    /// How contacts are found.
    pub contacts: ContactSettings,
    /// How gaits are told apart.
    pub gaits: GaitSettings,
}

/// Labels that lie beside a motion file.
#[derive(Clone, Debug, Default)]
pub struct LabelFiles {
    /// In our own text.
    pub given: Option<Given>,
    /// As the PFNN's authors publish them.
    pub published: Option<Published>,
    /// Their bytes, to notice a change.
    pub bytes: Vec<u8>,
}

/// A motion and its labels.
#[derive(Clone, Debug)]
pub struct Ready {
    /// World transforms.
    pub motion: Motion,
    /// What it is labelled with.
    pub labels: Labels,
    /// What was found without the published labels, where there are any.
    pub automatic: Option<(Labels, Judged)>,
}

/// A clip on the data set's joints, before it is mirrored.
#[derive(Clone, Debug)]
pub struct Fitted {
    clip: Clip,
    /// Where it begins in its file, seconds.
    start: f64,
}

impl LabelFiles {
    /// Reads `FILE.phase`, `FILE.gait` and `FILE_footsteps.txt` beside a motion file, and the label
    /// file if there is one.
    ///
    /// # Errors
    /// The file, the line and what was expected there.
    pub fn read(motion: &Path, labels: &Path) -> Result<Self, String> {
        let mut found = Self::default();
        if let Some(text) = found.text(labels)? {
            let given = Given::parse(&text).map_err(|e| format!("{}: {e}", labels.display()))?;
            found.given = Some(given);
        }
        let stem = motion.with_extension("");
        let beside = |end: &str| {
            let mut name = stem.clone().into_os_string();
            name.push(end);
            std::path::PathBuf::from(name)
        };
        let at = |path: &Path, error: String| format!("{}: {error}", path.display());
        let (phase, gait, steps) = (beside(".phase"), beside(".gait"), beside("_footsteps.txt"));
        let mut published = Published::default();
        if let Some(text) = found.text(&phase)? {
            published.phase = Published::parse_phase(&text).map_err(|e| at(&phase, e))?;
        }
        if let Some(text) = found.text(&gait)? {
            published.gaits = Published::parse_gaits(&text).map_err(|e| at(&gait, e))?;
        }
        if let Some(text) = found.text(&steps)? {
            published.cycles = Published::parse_footsteps(&text).map_err(|e| at(&steps, e))?;
        }
        // A phase without its cycles is not known to be right anywhere.
        if published.cycles.is_empty() {
            published.phase.clear();
        }
        found.published = (published != Published::default()).then_some(published);
        Ok(found)
    }

    fn text(&mut self, path: &Path) -> Result<Option<String>, String> {
        let at = |error: std::io::Error| format!("{}: {error}", path.display());
        match std::fs::metadata(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(at(error)),
            Ok(data) if data.len() > LARGEST_LABELS => {
                return Err(format!("{}: too large for labels", path.display()));
            }
            Ok(_) => {}
        }
        let text = std::fs::read_to_string(path).map_err(at)?;
        self.bytes.extend(text.as_bytes());
        Ok(Some(text))
    }
}

impl Setup {
    /// Brings a file's clip to the data set's rate, axes, joints and size; from and to in seconds.
    ///
    /// # Errors
    /// In words, why it does not fit.
    pub fn fit(
        &self,
        clip: &Clip,
        axes: &str,
        from: Option<f64>,
        to: Option<f64>,
    ) -> Result<Fitted, String> {
        let axes = Axes::named(axes).map_err(|e| e.to_string())?;
        let fps = f64::from(self.layout.fps());
        let fitting = Fitting { axes, hips: &self.roles.hips, drop: &self.drop, fps };
        let fitted = fitting.fit(clip)?;
        self.same_joints(fitted.skeleton())?;
        let frame = |seconds: f64| (seconds * fps).round() as usize;
        let start = from.map_or(0, frame);
        let end = to.map_or(usize::MAX, frame).min(fitted.frames());
        let fitted = if (start, end) == (0, fitted.frames()) {
            fitted
        } else {
            let late = |_| format!("the clip is only {:.2} s long", fitted.duration());
            fitted.slice(start, end).map_err(late)?
        };
        let body = Body::new(&self.roles, fitted.skeleton())?;
        let scale = leg_length(&self.skeleton, &body) / leg_length(fitted.skeleton(), &body);
        if !(scale.is_finite() && scale > 0.0) {
            return Err("its legs have no length".into());
        }
        // People of all sizes share the skeleton of the reference.
        let clip = if (scale - 1.0).abs() < 1e-6 { fitted } else { fitted.scaled(scale) };
        Ok(Fitted { clip, start: start as f64 / fps })
    }

    fn same_joints(&self, skeleton: &Skeleton) -> Result<(), String> {
        let tree = |skeleton: &Skeleton| -> Vec<(String, Option<usize>)> {
            skeleton.joints().iter().map(|j| (j.name.clone(), j.parent)).collect()
        };
        let (ours, theirs) = (tree(&self.skeleton), tree(skeleton));
        if ours == theirs {
            return Ok(());
        }
        let named =
            |tree: &[(String, Option<usize>)], name: &str| tree.iter().any(|(n, _)| n == name);
        let missing = ours.iter().find(|(name, _)| !named(&theirs, name));
        let extra = theirs.iter().find(|(name, _)| !named(&ours, name));
        Err(match (missing, extra) {
            (Some((name, _)), _) => {
                format!("its skeleton has no joint '{name}' as the others have")
            }
            (None, Some((name, _))) => {
                format!(
                    "its skeleton has a joint '{name}' that the others do not have; drop = [\"{name}\"] leaves it out"
                )
            }
            (None, None) => "its skeleton hangs together in another way than the others'".into(),
        })
    }

    /// Labels a fitted clip, as it is or as a mirror shows it.
    ///
    /// # Errors
    /// When it cannot be mirrored.
    pub fn label(
        &self,
        fitted: &Fitted,
        file_fps: f64,
        mirror: bool,
        files: &LabelFiles,
    ) -> Result<Ready, String> {
        let body = Body::new(&self.roles, fitted.clip.skeleton())?;
        let clip = if mirror {
            mirrored(&fitted.clip, &body).map_err(|e| {
                format!("cannot be mirrored ({e}): mirror = false leaves the mirror image out")
            })?
        } else {
            fitted.clip.clone()
        };
        let mut motion = Motion::new(&clip, &body);
        let contacts = Contacts::find(&motion, &body, &self.contacts);
        if contacts.level {
            // Recordings disagree on where the floor is, by centimetres: the toes tell.
            let gap = |sole: usize| self.foot_heights[sole] - contacts.floors[sole];
            motion.raise(0.5 * (gap(1) + gap(3)));
        }
        let given = files.given.as_ref().map(|given| given.from(fitted.start));
        let given = given.map(|given| if mirror { given.mirrored() } else { given });
        let published = files.published.as_ref();
        let published = published.map(|published| published.from(fitted.start * file_fps));
        let sources = Sources {
            contacts: &self.contacts,
            gaits: &self.gaits,
            leg: leg_length(&self.skeleton, &body) as f32,
            given: given.as_ref(),
            published: published.as_ref().map(|published| (published, file_fps)),
            mirrored: mirror,
        };
        let labels = Labels::find(&motion, &body, &sources);
        let automatic = sources.published.map(|(published, _)| {
            let found =
                Labels::find(&motion, &body, &Sources { published: None, given: None, ..sources });
            let phase = !published.phase.is_empty();
            (found, Judged { phase, gaits: !published.gaits.is_empty() })
        });
        Ok(Ready { motion, labels, automatic })
    }
}

/// The skeleton that a data set has, from its reference clip.
///
/// # Errors
/// In words, why the clip does not serve.
pub fn reference_skeleton(clip: &Clip, fitting: &Fitting<'_>) -> Result<Skeleton, String> {
    let fitted = fitting.fit(&clip.slice(0, 1).map_err(|e| e.to_string())?)?;
    let mut joints = fitted.skeleton().joints().to_vec();
    joints[0].offset = DVec3::ZERO;
    Skeleton::new(joints).map_err(|e| e.to_string())
}
