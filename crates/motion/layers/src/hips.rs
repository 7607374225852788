//! Hips moved by the least that lets hands and feet reach what they are to reach.
//!
//! Each limb allows the hips a ball: those places from which its first joint is near enough to its
//! target. They go to the place in all balls that is nearest to the motion's own.

use ambulo_rig::glam::Vec3;
use ambulo_rig::{Pose, Roles, Skeleton, Transform};
use serde::{Deserialize, Serialize};

use crate::balls::{Ball, nearest};
use crate::smooth::spring;

/// Most limbs that one call looks at.
pub const MOST_LIMBS: usize = 8;

/// How hips follow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HipsSettings {
    /// Of the way to where every limb is comfortable, seconds.
    pub halflife: f32,
    /// Farthest from where the motion has them, metres.
    pub most: f32,
}

impl Default for HipsSettings {
    fn default() -> Self {
        Self { halflife: 0.1, most: 0.4 }
    }
}

/// Why hips cannot be moved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum HipsError {
    #[error("no joint is known as the hips")]
    Role,
    #[error("joint {0} is not a joint of the skeleton")]
    Joint(usize),
    #[error("half-life and most must be finite and not negative, not {0} s and {1} m")]
    Settings(f32, f32),
}

/// What one limb needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Want {
    /// Where the limb's first joint is in the motion's own pose, in the world.
    pub root: Vec3,
    /// Where its end is to be, in the world.
    pub target: Vec3,
    /// Distance between the two up to which it is comfortable; the hips come there smoothly.
    pub comfort: f32,
    /// Distance that it reaches at all; the hips come there at once. Not less than `comfort`.
    pub reach: f32,
    /// How much of either it asks for, 0 to 1.
    pub weight: f32,
}

/// Which joint is moved, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hips {
    joint: usize,
    settings: HipsSettings,
}

/// Where the hips are, relative to the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HipsState {
    /// In the world, metres.
    pub offset: Vec3,
    /// Metres a second.
    pub velocity: Vec3,
}

const NONE: Ball = (Vec3::ZERO, 0.0);

impl Hips {
    /// The hips among the roles.
    ///
    /// # Errors
    /// No hips among them, or settings that cannot be used.
    pub fn new(
        skeleton: &Skeleton,
        roles: &Roles,
        settings: HipsSettings,
    ) -> Result<Self, HipsError> {
        let HipsSettings { halflife, most } = settings;
        let usable = |number: f32| number >= 0.0 && number.is_finite();
        if !(usable(halflife) && usable(most)) {
            return Err(HipsError::Settings(halflife, most));
        }
        let joint = roles.hips.ok_or(HipsError::Role)?;
        if joint >= skeleton.len() {
            return Err(HipsError::Joint(joint));
        }
        Ok(Self { joint, settings })
    }

    /// The joint that is moved.
    pub fn joint(&self) -> usize {
        self.joint
    }

    /// Moves the hips on by `dt` seconds towards where every limb is comfortable, and at once to
    /// where every limb reaches; without wants, back to the motion's own place. `global` holds the
    /// pose's transforms in the world and is kept up to date.
    ///
    /// False, and nothing changes, when a number is not finite or `dt` is negative.
    ///
    /// # Panics
    /// On more wants than [`MOST_LIMBS`].
    pub fn step(
        &self,
        skeleton: &Skeleton,
        state: &mut HipsState,
        wants: &[Want],
        dt: f32,
        pose: &mut Pose,
        global: &mut [Transform],
    ) -> bool {
        assert!(wants.len() <= MOST_LIMBS, "{} limbs want something of the hips", wants.len());
        let finite = wants.iter().all(|want| want.is_finite());
        if !(finite && global[self.joint].is_finite() && dt >= 0.0 && dt.is_finite()) {
            return false;
        }
        let HipsSettings { halflife, most } = self.settings;
        let (mut comfort, mut reach) = ([NONE; MOST_LIMBS], [NONE; MOST_LIMBS]);
        for (at, want) in wants.iter().enumerate() {
            comfort[at] = want.ball(want.comfort);
            reach[at] = want.ball(want.reach.max(want.comfort));
        }
        let count = wants.len();
        let wanted = nearest(Vec3::ZERO, &comfort[..count]).clamp_length_max(most);
        let (offset, velocity) = spring(state.offset, state.velocity, wanted, halflife, dt);
        let offset = nearest(offset, &reach[..count]).clamp_length_max(most);
        *state = HipsState { offset, velocity };
        self.shift(skeleton, offset, pose, global);
        true
    }

    fn shift(&self, skeleton: &Skeleton, offset: Vec3, pose: &mut Pose, global: &mut [Transform]) {
        if offset == Vec3::ZERO {
            return;
        }
        let parent = skeleton.joints()[self.joint].parent.map(|parent| global[parent].rotation);
        let local = parent.map_or(offset, |rotation| rotation.inverse() * offset);
        pose.local[self.joint].translation += local;
        pose.update_global(skeleton, self.joint, global);
    }
}

impl Want {
    /// Where the hips may be, relative to the motion's own place. The less a want weighs, the
    /// larger the ball; at weight 0 it is as large as they are ever moved.
    fn ball(&self, distance: f32) -> Ball {
        let centre = self.target - self.root;
        let short = (centre.length() - distance).max(0.0);
        let radius = distance + (1.0 - self.weight.min(1.0)) * short;
        (centre, if self.weight > 0.0 { radius } else { f32::MAX })
    }

    fn is_finite(&self) -> bool {
        let lengths = self.comfort >= 0.0 && self.comfort.is_finite() && self.reach.is_finite();
        let near = (self.target - self.root).length_squared().is_finite();
        near && lengths && self.weight.is_finite()
    }
}
