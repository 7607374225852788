//! What the layers need to know of a model's body, found out once.

use ambulo_control::Model;
use ambulo_layers::{
    FootPlacement, FootSettings, Limb as Bones, LimbSettings, LookAt, LookJoint, LookSettings,
    StepSettings,
};
use ambulo_rig::{Roles, Skeleton, Transform};

/// Shares and limits (yaw, pitch, radians) of the joints that look: the head and the two above it in
/// the chain from the hips.
const LOOK: [(f32, [f32; 2]); 3] = [(0.2, [0.25, 0.15]), (0.3, [0.5, 0.3]), (0.5, [0.9, 0.5])];

/// Why a model's body can do nothing with objects.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum BodyError {
    #[error("its network does not stand")]
    Stands,
    #[error("no joints are known as its {0}")]
    Role(&'static str),
    #[error("its {what}: {reason}")]
    Part { what: &'static str, reason: String },
}

/// A model's body by its parts. Pairs are left, right.
#[derive(Clone, Debug)]
pub struct Body {
    pub(crate) skeleton: Skeleton,
    pub(crate) hips: usize,
    pub(crate) arms: [Bones; 2],
    pub(crate) legs: [Bones; 2],
    /// Where a palm is in its wrist's frame: fingers along +Z, back of the hand +Y.
    pub(crate) palms: [Transform; 2],
    /// Feet under the network's motion, and under a clip that stands.
    pub(crate) feet: FootPlacement,
    pub(crate) standing_feet: FootPlacement,
    pub(crate) look: LookAt,
    /// Which joints a clip takes while the legs walk.
    pub(crate) upper: Vec<bool>,
    /// Heights of toes above the ground while in contact, metres.
    pub(crate) toes: [(usize, f32); 2],
}

impl Body {
    /// The body of a model.
    ///
    /// # Errors
    /// A skeleton that is no humanoid: what is missing is named.
    pub fn new(model: &Model) -> Result<Self, BodyError> {
        let skeleton = model.skeleton().clone();
        let roles = Roles::by_name(&skeleton);
        let mut rest = vec![Transform::IDENTITY; skeleton.len()];
        skeleton.rest_pose().to_global(&skeleton, &mut rest);
        let hips = roles.hips.ok_or(BodyError::Role("hips"))?;
        let hands = roles.hands.ok_or(BodyError::Role("hands"))?;
        let head = roles.head.ok_or(BodyError::Role("head"))?;
        let feet = model.feet();
        let stance = model.stance().ok_or(BodyError::Stands)?;
        let part =
            |what, reason: &dyn ToString| BodyError::Part { what, reason: reason.to_string() };
        let limb = |what, end: usize, bent: &[Transform], settings: LimbSettings| {
            Bones::new(&skeleton, end, bent, LimbSettings { softness: 0.01, ..settings })
                .map_err(|error| part(what, &error))
        };
        let arm = |side: usize| limb("arms", hands[side], &rest, LimbSettings::ARM);
        let ankles = roles.feet.ok_or(BodyError::Role("feet"))?;
        let leg = |side: usize| limb("legs", ankles[side], &stance, LimbSettings::LEG);
        let place = |settings| {
            FootPlacement::new(&skeleton, &roles, &stance, 0.0, settings)
                .map_err(|error| part("feet", &error))
        };
        let steps = Some(StepSettings::default());
        let standing = FootSettings { steps, ..FootSettings::default() };
        let (walking_feet, standing_feet) = (place(FootSettings::default())?, place(standing)?);
        let settings = LookSettings::default();
        let look = LookAt::new(&skeleton, &gazers(&skeleton, hips, head), &rest, settings)
            .map_err(|error| part("head", &error))?;
        let palm = |side| ambulo_rig::palm(&skeleton, &roles, side).ok_or(BodyError::Role("arms"));
        let thighs = roles.thighs.ok_or(BodyError::Role("thighs"))?;
        Ok(Self {
            arms: [arm(0)?, arm(1)?],
            legs: [leg(0)?, leg(1)?],
            palms: [palm(0)?, palm(1)?],
            feet: walking_feet,
            standing_feet,
            look,
            upper: upper(&skeleton, hips, thighs),
            toes: [1, 3].map(|toe| (feet.joints[toe], feet.heights[toe])),
            hips,
            skeleton,
        })
    }

    /// Its skeleton.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }
}

/// The head and what carries it, at most three joints below the hips.
fn gazers(skeleton: &Skeleton, hips: usize, head: usize) -> Vec<LookJoint> {
    let parent = |&joint: &usize| skeleton.joints()[joint].parent;
    let chain = std::iter::successors(Some(head), parent).take_while(|&joint| joint != hips);
    // Joints without length turn about the same place as the next: one of them is enough.
    let long = |&joint: &usize| joint == head || skeleton.joints()[joint].offset.length() > 1e-3;
    let mut joints: Vec<_> = chain.filter(long).take(LOOK.len()).collect();
    joints.reverse();
    let of = &LOOK[LOOK.len() - joints.len()..];
    let look = |(joint, &(share, limit))| LookJoint { joint, share, limit };
    joints.into_iter().zip(of).map(look).collect()
}

/// What hangs on the hips but is no leg.
fn upper(skeleton: &Skeleton, hips: usize, thighs: [usize; 2]) -> Vec<bool> {
    let parent = |&joint: &usize| skeleton.joints()[joint].parent;
    let above = |joint: usize| std::iter::successors(Some(joint), parent);
    // A helper between hips and thigh belongs to the leg.
    let leg = |joint: usize| {
        above(joint).any(|j| thighs.contains(&j))
            || thighs
                .iter()
                .any(|&thigh| above(thigh).take_while(|&j| j != hips).any(|j| j == joint))
    };
    let hangs = |joint: usize| joint != hips && above(joint).any(|j| j == hips);
    (0..skeleton.len()).map(|joint| hangs(joint) && !leg(joint)).collect()
}
