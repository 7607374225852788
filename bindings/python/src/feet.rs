//! Feet placed on the ground by the layer, in the pose that a controller hands out.

use ambulo_control::{Controller, Model, Tuning};
use ambulo_layers::{FeetState, FootPlacement, FootSettings, Ground};
use ambulo_rig::{Pose, Roles, Terrain, Transform};

/// A character's feet and what they remember.
pub struct Feet {
    placement: FootPlacement,
    state: FeetState,
}

impl Feet {
    /// `None` where the skeleton has no legs and feet by name, or its network no stance.
    pub fn new(model: &Model, tuning: &Tuning) -> Option<Self> {
        let (skeleton, stance) = (model.skeleton(), model.stance()?);
        let settings = FootSettings { release: tuning.foot_halflife, ..FootSettings::default() };
        let roles = Roles::by_name(skeleton);
        let placement = FootPlacement::new(skeleton, &roles, &stance, 0.0, settings).ok()?;
        Some(Self { placement, state: FeetState::default() })
    }

    /// Places the feet of the controller's pose, `dt` seconds after the last one; `global` has its
    /// transforms. The network has laid the feet on the terrain itself: they are held, and kept
    /// above it.
    pub fn place(
        &mut self,
        controller: &Controller,
        terrain: &dyn Terrain,
        dt: f32,
        pose: &mut Pose,
        global: &mut [Transform],
    ) {
        let (skeleton, contacts) = (controller.model().skeleton(), controller.contacts());
        let ground = Ground { terrain, level: None };
        self.placement.step(skeleton, &mut self.state, contacts, &ground, dt, pose, global);
    }

    /// Whether the left and the right foot are held.
    pub fn held(&self) -> [bool; 2] {
        self.state.held()
    }
}
