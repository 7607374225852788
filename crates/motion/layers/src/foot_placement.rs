//! Feet on uneven ground: they land on it, stay where they stand, and never go below it.
//!
//! For each foot, in this order: the height of the ground under it (where the motion was made for
//! flat ground), the hold of the ball, the slope, the heel, the toes. Then the hips sink until both
//! legs reach, and the legs are bent. The ball of a foot is where it is held: its heel may rise and
//! it may turn about the ball, as in a step.

use ambulo_rig::glam::Vec3;
use ambulo_rig::{Pose, Roles, Skeleton, Terrain, Transform};
use serde::{Deserialize, Serialize};

use crate::foot::{Foot, Plan};
use crate::foot_hold::{FootState, Moment};
use crate::foot_step::StepSettings;
use crate::hips::{Hips, HipsError, HipsSettings, HipsState, MOST_LIMBS, Want};
use crate::smooth::smoothstep;
use crate::two_bone::{Limb, LimbError, LimbSettings, Reach};

/// Legs longer than this share of their reach pull the hips down, unless the motion itself stretches
/// them that far.
const COMFORT: f32 = 0.97;

/// How feet meet the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FootSettings {
    /// A foot is held from this contact of its toes on …
    pub hold: f32,
    /// … and let go below this one; in between it stays as it is.
    pub let_go: f32,
    /// A foot that the motion has taken this far from where it is held is let go, metres.
    pub leash: f32,
    /// Of the way back to the motion after a foot is let go, seconds.
    pub release: f32,
    /// Of what is left between a foot and the ground when it is held, seconds.
    pub landing: f32,
    /// Of how the slope and the height of the ground come into a foot, seconds.
    pub ground: f32,
    /// Seconds ahead that a swinging foot sees the ground.
    pub ahead: f32,
    /// Steepest slope that a foot is laid on, radians; what is steeper is an edge, on which it stays
    /// level.
    pub steepest: f32,
    /// Little steps of feet that stand to where the motion has them; without (the default) they only
    /// creep there. With them a held foot keeps its heading, too, not only its place.
    pub steps: Option<StepSettings>,
    /// Of the legs. Their softness is kept small, since what it takes off is missing at the foot.
    pub legs: LimbSettings,
    /// Of the hips.
    pub hips: HipsSettings,
}

impl Default for FootSettings {
    fn default() -> Self {
        Self {
            hold: 0.6,
            let_go: 0.4,
            leash: 0.12,
            release: 0.075,
            landing: 0.03,
            ground: 0.06,
            ahead: 0.15,
            steepest: 0.7,
            steps: None,
            legs: LimbSettings { softness: 0.01, ..LimbSettings::LEG },
            hips: HipsSettings::default(),
        }
    }
}

/// Why feet cannot be placed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum FootError {
    #[error("no joints are known as the {0}")]
    Role(&'static str),
    #[error("the {side} {what} must hang on the {on}")]
    Hangs { side: &'static str, what: &'static str, on: &'static str },
    #[error("the {side} leg: {error}")]
    Leg { side: &'static str, error: LimbError },
    #[error(transparent)]
    Hips(#[from] HipsError),
    #[error("the {0} of the feet cannot be used")]
    Setting(&'static str),
    #[error("the stance is not finite")]
    Stance,
}

/// What a character's feet remember; the default is a foot in the air. Layers with other settings may
/// take it over at any frame, also in the middle of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeetState {
    feet: [FootState; 2],
    hips: HipsState,
}

impl FeetState {
    /// Whether the left and the right foot are held; a foot that takes a step of its own is not.
    pub fn held(&self) -> [bool; 2] {
        self.feet.map(|foot| foot.is_held())
    }

    /// How far the hips are from where the motion has them, metres.
    pub fn hips(&self) -> Vec3 {
        self.hips.offset
    }
}

/// The ground under a character.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    /// Its heights.
    pub terrain: &'a dyn Terrain,
    /// Height of the flat ground that the motion was made for: the feet rise and tilt with the
    /// terrain over it. `None` where the motion follows the terrain already: then feet are held and
    /// kept above the ground only.
    pub level: Option<f32>,
}

/// Both feet of a character.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootPlacement {
    feet: [Foot; 2],
    hips: Hips,
    settings: FootSettings,
}

impl FootPlacement {
    /// Feet by their roles. `stance` has the transforms in the world of a pose that stands with both
    /// feet flat on the ground at height `floor`, faces +Z, and bends its knees the way they bend.
    ///
    /// # Errors
    /// Roles that are missing (by name), thighs that are not below the hips, feet that are not two
    /// bones below their thighs, toes that are not on their feet, and settings that cannot be used.
    pub fn new(
        skeleton: &Skeleton,
        roles: &Roles,
        stance: &[Transform],
        floor: f32,
        settings: FootSettings,
    ) -> Result<Self, FootError> {
        settings.check()?;
        let hips = Hips::new(skeleton, roles, settings.hips)?;
        let thighs = roles.thighs.ok_or(FootError::Role("thighs"))?;
        let ankles = roles.feet.ok_or(FootError::Role("feet"))?;
        let toes = roles.toes.ok_or(FootError::Role("toes"))?;
        let foot = |at: usize, side| -> Result<Foot, FootError> {
            let (ankle, toe) = (ankles[at], toes[at]);
            let leg = Limb::new(skeleton, ankle, stance, settings.legs)
                .map_err(|error| FootError::Leg { side, error })?;
            let hangs = |what, on| FootError::Hangs { side, what, on };
            if leg.joints()[0] != thighs[at] {
                return Err(hangs("foot", "thigh by two bones"));
            }
            let parent = |joint: usize| skeleton.joints().get(joint).and_then(|j| j.parent);
            let above = |&joint: &usize| parent(joint);
            if !std::iter::successors(parent(thighs[at]), above).any(|j| j == hips.joint()) {
                return Err(hangs("thigh", "hips"));
            }
            if parent(toe) != Some(ankle) {
                return Err(hangs("toe joint", "foot"));
            }
            Foot::flat(skeleton, leg, [ankle, toe], stance, floor).ok_or(FootError::Stance)
        };
        Ok(Self { feet: [foot(0, "left")?, foot(1, "right")?], hips, settings })
    }

    /// Places the feet of a pose on the ground, `dt` seconds after the last one. `contacts` says how
    /// surely the left heel, left toes, right heel and right toes are on the ground, 0 to 1.
    /// `global` holds the pose's transforms in the world and is kept up to date.
    ///
    /// False, and nothing changes, when a number is not finite (the terrain's answers are numbers,
    /// too) or `dt` is negative.
    #[allow(clippy::too_many_arguments)] // The caller's buffers, and what is asked.
    pub fn step(
        &self,
        skeleton: &Skeleton,
        state: &mut FeetState,
        contacts: [f32; 4],
        ground: &Ground<'_>,
        dt: f32,
        pose: &mut Pose,
        global: &mut [Transform],
    ) -> bool {
        self.step_reaching(skeleton, state, contacts, ground, &[], dt, pose, global)
    }

    /// The same with hips that also heed what others want of them: hands that are to reach something.
    ///
    /// # Panics
    /// On more than [`MOST_LIMBS`] − 2 others.
    #[allow(clippy::too_many_arguments)] // The caller's buffers, and what is asked.
    pub fn step_reaching(
        &self,
        skeleton: &Skeleton,
        state: &mut FeetState,
        contacts: [f32; 4],
        ground: &Ground<'_>,
        others: &[Want],
        dt: f32,
        pose: &mut Pose,
        global: &mut [Transform],
    ) -> bool {
        let joints =
            |foot: &Foot| [foot.leg.joints()[0], foot.leg.joints()[1], foot.ankle, foot.toe];
        let sound = |joint: usize| global[joint].is_finite() && pose.local[joint].is_finite();
        let finite = self.feet.iter().all(|foot| joints(foot).into_iter().all(sound))
            && contacts.iter().all(|contact| contact.is_finite())
            && ground.level.is_none_or(f32::is_finite);
        if !(finite && sound(self.hips.joint()) && dt >= 0.0 && dt.is_finite()) {
            return false;
        }
        let mut next = *state;
        let lifted = self.lifted(&next.feet, contacts, global);
        let mut planned = |side: usize| {
            let (contact, may_step) = (contacts[2 * side + 1], lifted == Some(side));
            let moment = Moment { ground: *ground, contact, may_step, dt };
            self.feet[side].plan(&mut next.feet[side], &self.settings, &moment, global)
        };
        let (Some(left), Some(right)) = (planned(0), planned(1)) else { return false };
        let plans = [left, right];
        let mut wants = [Want::default(); MOST_LIMBS];
        for (side, plan) in plans.iter().enumerate() {
            wants[side] = self.want(side, plan, contacts, global);
        }
        wants[2..2 + others.len()].copy_from_slice(others);
        let wants = &wants[..2 + others.len()];
        if !self.hips.step(skeleton, &mut next.hips, wants, dt, pose, global) {
            return false;
        }
        for (foot, plan) in self.feet.iter().zip(plans) {
            let rotation = Some(plan.rotation);
            let asked = Reach { rotation, ..Reach::at(plan.ankle) };
            foot.leg.reach(skeleton, &asked, pose, global);
            pose.turn_to(skeleton, foot.toe, plan.toes, global);
            pose.update_range(skeleton, foot.toe + 1..foot.leg.behind(), global);
        }
        *state = next;
        true
    }

    /// Which foot is to be lifted for a little step: the one that is farther off, and only while both
    /// are held and stay in contact.
    fn lifted(
        &self,
        feet: &[FootState; 2],
        contacts: [f32; 4],
        global: &[Transform],
    ) -> Option<usize> {
        let steps = self.settings.steps?;
        let stays = contacts[1].min(contacts[3]) >= self.settings.let_go;
        let off = |side: usize| self.feet[side].off(&feet[side], &steps, global);
        let (left, right) = (off(0)?, off(1)?);
        (stays && left.max(right) >= 1.0).then_some(usize::from(right > left))
    }

    /// What a leg wants of the hips, the more the surer its foot is on the ground.
    fn want(&self, side: usize, plan: &Plan, contacts: [f32; 4], global: &[Transform]) -> Want {
        let foot = &self.feet[side];
        let span = foot.leg.span(global);
        let root = global[foot.leg.joints()[0]].translation;
        let drawn = root.distance(global[foot.ankle].translation);
        let comfort = drawn.max(COMFORT * span.exact).min(span.exact);
        let contact = contacts[2 * side].max(contacts[2 * side + 1]);
        // All of it as long as a foot may be held.
        let weight = smoothstep(0.0, self.settings.let_go, contact);
        Want { root, target: plan.ankle, comfort, reach: span.exact, weight }
    }
}

impl FootSettings {
    fn check(&self) -> Result<(), FootError> {
        let named = [
            ("hold", self.hold),
            ("let_go", self.let_go),
            ("leash", self.leash),
            ("release", self.release),
            ("landing", self.landing),
            ("ground", self.ground),
            ("ahead", self.ahead),
            ("steepest", self.steepest),
        ];
        let bad = named.iter().find(|(_, number)| !(*number >= 0.0 && number.is_finite()));
        let bad = bad.map(|(name, _)| *name);
        let order = (self.let_go > self.hold || self.hold > 1.0).then_some("order of contacts");
        let steep = (self.steepest > 1.2).then_some("steepest");
        let steps = self.steps.and_then(|steps| steps.bad());
        bad.or(order).or(steep).or(steps).map_or(Ok(()), |name| Err(FootError::Setting(name)))
    }
}
