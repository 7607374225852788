//! A clip made ready: metres, Ambulo's axes, the layout's frame rate, world transforms, and the
//! root on the ground that everything is seen from.

use ambulo_rig::glam::{DQuat, DVec3, Quat, Vec2, Vec3};
use ambulo_rig::{Axes, Clip, Mirror, MirrorError, Pose, Skeleton, Transform};

use crate::body::Body;
use crate::filter::gaussian;

/// Width of the filter over the facing: 20 frames at 60 Hz (PFNN, section 3).
const FACING_SIGMA: f32 = 20.0 / 60.0;

/// Where a character is and where it faces, on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root {
    /// x and z, metres: under the hips.
    pub position: Vec2,
    /// Unit vector along the facing.
    pub facing: Vec2,
}

/// Radians from +Z (the vector's y) towards +X.
pub fn yaw(direction: Vec2) -> f32 {
    direction.x.atan2(direction.y)
}

impl Root {
    /// Radians, 0 along +Z, positive towards +X.
    pub fn yaw(&self) -> f32 {
        yaw(self.facing)
    }

    /// A direction of the world in this root's frame.
    pub fn inward(&self, v: Vec2) -> Vec2 {
        Vec2::new(v.x * self.facing.y - v.y * self.facing.x, v.dot(self.facing))
    }

    /// The same for three dimensions.
    pub fn inward3(&self, v: Vec3) -> Vec3 {
        let ground = self.inward(Vec2::new(v.x, v.z));
        Vec3::new(ground.x, v.y, ground.y)
    }

    /// Turns the root's frame into the world's.
    pub fn rotation(&self) -> Quat {
        Quat::from_rotation_y(self.yaw())
    }
}

/// A clip's world transforms, frame by frame.
#[derive(Clone, Debug)]
pub struct Motion {
    joints: usize,
    fps: f32,
    positions: Vec<Vec3>,
    rotations: Vec<Quat>,
    roots: Vec<Root>,
}

impl Motion {
    /// Takes a clip that is in Ambulo's axes and metres and at the wanted rate.
    pub fn new(clip: &Clip, body: &Body) -> Self {
        let (skeleton, frames) = (clip.skeleton(), clip.frames());
        let mut pose = Pose::rest(skeleton);
        let mut global = vec![Transform::IDENTITY; skeleton.len()];
        let mut positions = Vec::with_capacity(frames * skeleton.len());
        let mut rotations = Vec::with_capacity(frames * skeleton.len());
        let mut places = vec![];
        for frame in 0..frames {
            // Positions in f64: a file in centimetres far from the origin must not lose its feet.
            clip.positions(frame, &mut places);
            clip.frame(frame, &mut pose);
            pose.to_global(skeleton, &mut global);
            positions.extend(places.iter().map(|place| place.as_vec3()));
            rotations.extend(global.iter().map(|transform| transform.rotation));
        }
        let fps = clip.fps() as f32;
        let mut motion = Self { joints: skeleton.len(), fps, positions, rotations, roots: vec![] };
        motion.roots = motion.find_roots(body);
        motion
    }

    fn find_roots(&self, body: &Body) -> Vec<Root> {
        let across = |frame: usize| {
            let across = body.across(|joint| self.position(frame, joint));
            Vec2::new(-across.z, across.x).normalize_or_zero()
        };
        let facings: Vec<Vec2> = (0..self.frames()).map(across).collect();
        let facings = gaussian(&facings, FACING_SIGMA * self.fps);
        let mut before = Vec2::Y;
        let root = |(frame, facing): (usize, Vec2)| {
            before = facing.normalize_or(before);
            let hips = self.position(frame, body.hips);
            Root { position: Vec2::new(hips.x, hips.z), facing: before }
        };
        facings.into_iter().enumerate().map(root).collect()
    }

    /// Frames, at least 1.
    pub fn frames(&self) -> usize {
        self.positions.len() / self.joints
    }

    /// Joints of the skeleton.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Frames a second.
    pub fn fps(&self) -> f32 {
        self.fps
    }

    /// In the world, metres.
    pub fn position(&self, frame: usize, joint: usize) -> Vec3 {
        self.positions[frame * self.joints + joint]
    }

    /// To the next frame (at the last one from the one before), metres a second.
    pub fn velocity(&self, frame: usize, joint: usize) -> Vec3 {
        let from = frame.min(self.frames().saturating_sub(2));
        let to = (from + 1).min(self.frames() - 1);
        (self.position(to, joint) - self.position(from, joint)) * self.fps
    }

    /// In the world.
    pub fn rotation(&self, frame: usize, joint: usize) -> Quat {
        self.rotations[frame * self.joints + joint]
    }

    /// Under the hips.
    pub fn root(&self, frame: usize) -> Root {
        self.roots[frame]
    }

    /// Speed of the root over the ground, metres a second.
    pub fn root_velocity(&self, frame: usize) -> Vec2 {
        let from = frame.min(self.frames().saturating_sub(2));
        let to = (from + 1).min(self.frames() - 1);
        (self.roots[to].position - self.roots[from].position) * self.fps
    }

    /// Moves everything up.
    pub fn raise(&mut self, by: f32) {
        self.positions.iter_mut().for_each(|position| position.y += by);
    }
}

/// How a file's clip becomes one that all of a data set share a skeleton with.
#[derive(Clone, Debug)]
pub struct Fitting<'a> {
    /// What the file is in.
    pub axes: Axes,
    /// Name of the joint that becomes the root.
    pub hips: &'a str,
    /// Names of joints that are left out, with all below them.
    pub drop: &'a [String],
    /// Frames a second.
    pub fps: f64,
}

impl Fitting<'_> {
    /// Metres, Ambulo's axes, hips first, at the wanted rate.
    ///
    /// # Errors
    /// In words: a joint that is missing, a rate that makes too many frames.
    pub fn fit(&self, clip: &Clip) -> Result<Clip, String> {
        let hips = clip.skeleton().find(self.hips);
        let hips = hips.ok_or_else(|| format!("it has no joint '{}' (roles.hips)", self.hips))?;
        let conversion = self.axes.to(Axes::CANONICAL).map_err(|e| e.to_string())?;
        let kept = clip.pruned(hips, |joint| !self.drop.contains(&joint.name));
        let rated = if (kept.fps() / self.fps - 1.0).abs() < 1e-6 {
            kept
        } else {
            kept.resampled(self.fps).map_err(|e| e.to_string())?
        };
        Ok(rated.converted(&conversion))
    }
}

/// Length of a leg from thigh over knee to ankle, in the rest pose; metres.
pub fn leg_length(skeleton: &Skeleton, body: &Body) -> f64 {
    let leg = |side: usize| {
        let mut joint = Some(body.feet[side]);
        let mut length = 0.0;
        while let Some(at) = joint.filter(|&at| at != body.thighs[side]) {
            length += skeleton.joints()[at].offset.length();
            joint = skeleton.joints()[at].parent;
        }
        length
    };
    0.5 * (leg(0) + leg(1))
}

/// The clip as a mirror shows it: partners by name, else by shape.
///
/// # Errors
/// When neither names nor shape tell the partners.
pub fn mirrored(clip: &Clip, body: &Body) -> Result<Clip, MirrorError> {
    let facing = facing_forward(clip, body);
    let mirror = Mirror::by_name(&facing, DVec3::X).or_else(|error| match error {
        MirrorError::NoNames => Mirror::by_geometry(&facing, DVec3::X),
        _ => Err(error),
    })?;
    mirror.apply(clip)
}

/// A few dozen frames of a clip, turned so that all of them face +Z. How a joint's own frame is
/// reflected is chosen by its usual rotation, and partners by shape across the plane of X: neither
/// may depend on where a clip happens to walk, or one data set holds two kinds of mirrored hips.
/// (The mirror itself knows no up axis to take a heading out about; here it is known.)
fn facing_forward(clip: &Clip, body: &Body) -> Clip {
    let (mut translations, mut rotations, mut places) = (vec![], vec![], vec![]);
    for frame in (0..clip.frames()).step_by(clip.frames().div_ceil(64)) {
        clip.positions(frame, &mut places);
        let across = body.across(|joint| places[joint]);
        let first = rotations.len();
        rotations.extend_from_slice(clip.rotations(frame));
        rotations[first] = DQuat::from_rotation_y(across.z.atan2(across.x)) * rotations[first];
        translations.extend_from_slice(clip.translations(frame));
    }
    let moving = clip.moving().to_vec();
    let turned =
        Clip::new(clip.skeleton().clone(), clip.frame_time(), moving, translations, rotations);
    turned.expect("some frames of a clip are one")
}
