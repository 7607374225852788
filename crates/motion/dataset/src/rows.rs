//! Rows of a data set: what the network is told at a frame, and what it should answer.
//!
//! Source: section 5.1 of the PFNN paper; the meaning of each number is the layout's.

use ambulo_features::gait::CROUCH;
use ambulo_features::{FUTURE, Input, Layout, Output, Point, SAMPLES, WINDOW};
use ambulo_rig::glam::Vec2;
use ambulo_rig::{Flat, Terrain};

use crate::body::Body;
use crate::filter::stretches;

use crate::labels::Labels;
use crate::motion::{Motion, Root, yaw};
use crate::prepare::{Ready, Setup};

/// Frames between samples of the trajectory.
const STRIDE: usize = 2 * WINDOW / SAMPLES;
/// Terrain is sampled this far to both sides, metres.
const SIDE: f32 = 0.25;
/// The published contact test: squared centimetres a frame.
const PUBLISHED_CONTACT: f32 = 0.02;
/// Numbers of a row before input and output: phase, category, and the root's place.
pub const LEADING: usize = 6;

/// Encodes the frames of one motion.
pub struct Encoder<'a> {
    layout: &'a Layout,
    motion: &'a Motion,
    labels: &'a Labels,
    soles: [usize; 4],
    crouching_head: Option<usize>,
    input: Input,
    output: Output,
}

impl<'a> Encoder<'a> {
    /// For a labelled motion; `level` if it was captured on a level floor.
    pub fn new(layout: &'a Layout, ready: &'a Ready, body: &Body, level: bool) -> Self {
        let (motion, labels) = (&ready.motion, &ready.labels);
        let (input, output) = (Input::zero(motion.joints()), Output::zero(motion.joints()));
        let by_head = layout.name() == "holden" && level && labels.published_gaits;
        let crouching_head = body.head.filter(|_| by_head);
        Self { layout, motion, labels, soles: body.soles(), crouching_head, input, output }
    }

    /// Numbers of a row.
    pub fn width(layout: &Layout) -> usize {
        LEADING + layout.input_len() + layout.output_len()
    }

    /// Whether a frame has all the frames around it that its row needs.
    pub fn reaches(&self, frame: usize) -> bool {
        frame >= WINDOW && frame + WINDOW + 1 < self.motion.frames()
    }

    /// Writes a frame's row: phase in cycles, category, root (x, height, z, yaw), input, output.
    pub fn encode(&mut self, frame: usize, ground: &impl Terrain, row: &mut [f32]) {
        let height = self.tell(frame, ground);
        self.answer(frame, height);
        let root = self.motion.root(frame);
        row[0] = self.labels.phase.at(frame);
        row[1] = f32::from(self.labels.gaits.categories[frame]);
        row[2..LEADING].copy_from_slice(&[root.position.x, height, root.position.y, root.yaw()]);
        let (x, y) = row[LEADING..].split_at_mut(self.layout.input_len());
        self.layout.encode_input(&self.input, x);
        self.layout.encode_output(&self.output, y);
    }

    /// Fills the input and returns the root's height: the mean of the terrain along the trajectory.
    fn tell(&mut self, frame: usize, ground: &impl Terrain) -> f32 {
        let (motion, root) = (self.motion, self.motion.root(frame));
        for sample in 0..SAMPLES {
            let at = frame + sample * STRIDE - WINDOW;
            let there = motion.root(at);
            self.input.trajectory[sample] = seen(&root, &there);
            let left = Vec2::new(there.facing.y, -there.facing.x) * SIDE;
            let height = |at: Vec2| ground.height(at.x, at.y);
            let place = there.position;
            self.input.ground[sample].gait = self.labels.gaits.shares[at];
            if let Some(head) = self.crouching_head {
                let height = motion.position(at, head).y;
                self.input.ground[sample].gait[CROUCH] = published_crouch(height);
            }
            self.input.ground[sample].height =
                [height(place + left), height(place), height(place - left)];
        }
        let sum: f32 = self.input.ground.iter().map(|ground| ground.height[1]).sum();
        let mean = sum / SAMPLES as f32;
        for ground in &mut self.input.ground {
            ground.height.iter_mut().for_each(|height| *height -= mean);
        }
        let before = motion.root(frame - 1);
        for joint in 0..motion.joints() {
            self.input.joint_position[joint] = place(motion, frame - 1, joint, &before, mean);
            self.input.joint_velocity[joint] = before.inward3(motion.velocity(frame - 1, joint));
        }
        mean
    }

    fn answer(&mut self, frame: usize, height: f32) {
        let motion = self.motion;
        let (root, next) = (motion.root(frame), motion.root(frame + 1));
        self.output.root_velocity = root.inward(next.position - root.position) * motion.fps();
        self.output.yaw_rate = yaw(root.inward(next.facing)) * motion.fps();
        self.output.phase_rate = self.labels.phase.rate(frame, motion.fps());
        self.output.contacts = self.contacts(frame);
        for sample in 0..FUTURE {
            let there = motion.root(frame + 1 + sample * STRIDE);
            self.output.trajectory[sample] = seen(&next, &there);
        }
        let inward = root.rotation().inverse();
        for joint in 0..motion.joints() {
            self.output.joint_position[joint] = place(motion, frame, joint, &root, height);
            self.output.joint_velocity[joint] = root.inward3(motion.velocity(frame, joint));
            self.output.joint_rotation[joint] = inward * motion.rotation(frame, joint);
        }
    }

    fn contacts(&self, frame: usize) -> [f32; 4] {
        if self.layout.name() != "holden" {
            return self.labels.contacts.soles[frame].map(|on| if on { 1.0 } else { 0.0 });
        }
        self.soles.map(|joint| {
            let moved = self.motion.velocity(frame, joint) * (100.0 / self.motion.fps());
            if moved.length_squared() < PUBLISHED_CONTACT { 1.0 } else { 0.0 }
        })
    }
}

/// The share of crouching that the PFNN's authors give to recordings on a level floor instead of a
/// hand-made one: 0 with the head above 1.3 m, 1 below 0.8 m. It need not sum to 1 with the others.
fn published_crouch(head: f32) -> f32 {
    1.0 - ((head - 0.8) / 0.5).clamp(0.0, 1.0)
}

/// All rows of one clip on level ground, in memory.
#[derive(Clone, Debug)]
pub struct ClipRows {
    /// Rows one after the other.
    pub rows: Vec<f32>,
    /// Numbers of a row.
    pub width: usize,
    /// First row and number of rows of each run of consecutive frames.
    pub runs: Vec<(usize, usize)>,
}

/// Encodes a labelled motion.
///
/// # Errors
/// When roles are missing, or no frame can be used.
pub fn encode_clip(setup: &Setup, ready: &Ready) -> Result<ClipRows, String> {
    let body = Body::new(&setup.roles, &setup.skeleton)?;
    let level = ready.labels.contacts.level;
    let mut encoder = Encoder::new(&setup.layout, ready, &body, level);
    let usable = |frame: usize| encoder.reaches(frame) && ready.labels.usable[frame];
    let spans = stretches(ready.motion.frames(), usable);
    let width = Encoder::width(&setup.layout);
    let mut rows = vec![0.0; width * spans.iter().map(|span| span.len()).sum::<usize>()];
    let mut runs = vec![];
    let mut lines = rows.chunks_mut(width).enumerate();
    for span in spans {
        let length = span.len();
        for (frame, (row, line)) in span.clone().zip(&mut lines) {
            if frame == span.start {
                runs.push((row, length));
            }
            encoder.encode(frame, &Flat(0.0), line);
        }
    }
    if runs.is_empty() {
        return Err("no frame can be used: it is too short, or no steps were found in it".into());
    }
    Ok(ClipRows { rows, width, runs })
}

/// A root as another one sees it.
fn seen(from: &Root, there: &Root) -> Point {
    Point {
        position: from.inward(there.position - from.position),
        direction: from.inward(there.facing),
    }
}

fn place(
    motion: &Motion,
    frame: usize,
    joint: usize,
    root: &Root,
    height: f32,
) -> ambulo_rig::glam::Vec3 {
    let mut place = motion.position(frame, joint);
    place.x -= root.position.x;
    place.y -= height;
    place.z -= root.position.y;
    root.inward3(place)
}
