//! Everything that a clip is labelled with, from whatever source.

use std::fmt::Write as _;

use ambulo_features::GAITS;

use crate::body::Body;
use crate::contacts::{ContactSettings, Contacts};
use crate::filter::stretches;
use crate::gait::{GaitSettings, Gaits, speeds, strongest};
use crate::given::{Given, Published};
use crate::motion::Motion;
use crate::phase::{Phase, phase, repeats, standing, steps};

/// Labels by frame.
#[derive(Clone, Debug)]
pub struct Labels {
    /// When feet are on the ground.
    pub contacts: Contacts,
    /// Where in the gait cycle.
    pub phase: Phase,
    /// Which gait.
    pub gaits: Gaits,
    /// Whether a frame may be learned from.
    pub usable: Vec<bool>,
    /// Whether the gaits are published ones.
    pub published_gaits: bool,
    /// Share of steps with the same foot as the one before.
    pub repeats: f32,
    /// Found or given: seconds and side (0 left, 1 right).
    steps: Vec<(f32, usize)>,
}

/// What labels are found by, and what people say about the clip.
#[derive(Clone, Copy, Debug)]
pub struct Sources<'a> {
    /// Borders of contacts.
    pub contacts: &'a ContactSettings,
    /// Borders of gaits.
    pub gaits: &'a GaitSettings,
    /// Length of a leg, metres.
    pub leg: f32,
    /// A label file, of this clip (mirrored as the clip is).
    pub given: Option<&'a Given>,
    /// Published labels, with the rate of their file.
    pub published: Option<(&'a Published, f64)>,
    /// Whether the motion is the mirrored one.
    pub mirrored: bool,
}

impl Labels {
    /// Labels a motion.
    pub fn find(motion: &Motion, body: &Body, sources: &Sources<'_>) -> Self {
        let fps = motion.fps();
        let contacts = Contacts::find(motion, body, sources.contacts);
        let mut found = steps(&contacts, fps);
        if let Some(given) = sources.given {
            found = given.steps(found, fps);
        }
        let stands = standing(&contacts, &speeds(motion), sources.gaits.walk, fps);
        let mut phase = phase(&found, &stands, fps);
        let mut gaits = Gaits::find(motion, body, &contacts, sources.leg, sources.gaits);
        let mut published_gaits = false;
        if let Some((published, rate)) = sources.published {
            // Steps of one's own say that the published ones are not what is wanted.
            let own = sources.given.is_some_and(|given| !given.steps.is_empty());
            if !published.phase.is_empty() && !own {
                phase = published.phase(motion.frames(), fps, rate, sources.mirrored);
            }
            if !published.gaits.is_empty() {
                gaits = published.gaits(motion, rate);
                published_gaits = true;
            }
        }
        let mut usable = phase.known.clone();
        if let Some(given) = sources.given {
            gaits = gaits.with_given(&given.gaits(motion.frames(), fps), motion);
            let skipped = |(frame, usable): (usize, &mut bool)| *usable &= !given.skips(frame, fps);
            usable.iter_mut().enumerate().for_each(skipped);
        }
        let repeats = repeats(&found);
        let steps = found.iter().map(|step| (step.frame / fps, step.side)).collect();
        Self { contacts, phase, gaits, usable, published_gaits, repeats, steps }
    }

    /// The labels as a file that [`Given`] reads: to look at, and to copy from.
    pub fn to_text(&self, fps: f32) -> String {
        let mut text = String::from(
            "# Found automatically. To correct: copy lines into a file of the same name without\n\
             # '.auto', change them there and build again.\n",
        );
        for (seconds, side) in &self.steps {
            let _ = writeln!(text, "step {} {seconds:.3}", ["left", "right"][*side]);
        }
        let gaits: Vec<usize> = self.gaits.shares.iter().map(strongest).collect();
        for (gait, name) in GAITS.iter().enumerate() {
            for span in stretches(gaits.len(), |frame| gaits[frame] == gait) {
                let sure: f32 = self.gaits.confidence[span.clone()].iter().sum();
                let (from, to) = (span.start as f32 / fps, span.end as f32 / fps);
                let sure = 100.0 * sure / span.len() as f32;
                let _ = writeln!(text, "gait {name} {from:.3} {to:.3}  # {sure:.0} % sure");
            }
        }
        for span in stretches(self.usable.len(), |frame| !self.usable[frame]) {
            let (from, to) = (span.start as f32 / fps, span.end as f32 / fps);
            let _ = writeln!(text, "# phase unknown, not used: {from:.3} to {to:.3}");
        }
        text
    }
}
