//! How a model's character stands, for layers that must know what a flat foot is.

use ambulo_rig::glam::{Quat, Vec2};
use ambulo_rig::{Flat, Transform};

use crate::{Areas, Controller, Intent, Model, Tuning, World};

/// Seconds after which a character that starts in its mean pose stands.
const SETTLED: f32 = 1.0;
/// Seconds, and metres a second, of the walk in which feet are looked at.
const WALK: f32 = 2.0;
const SPEED: f32 = 1.2;

impl Model {
    /// Transforms in the world of the skeleton standing with both feet flat on the ground at height
    /// 0, facing +Z; `None` where the network does not stand.
    ///
    /// The network's own stance: a rest pose may have its legs apart or its feet pointed, and in the
    /// mean pose the feet are on tiptoe, for that is what the mean of steps is. Standing, the feet of
    /// some networks sink by a centimetre on bones of fixed length; so each foot is put at the height
    /// at which its toes are while they are in contact in a walk. Three seconds of steps are
    /// computed, which takes some 50 ms.
    pub fn stance(&self) -> Option<Vec<Transform>> {
        let tuning = Tuning { hold_feet: false, ..self.tuning() };
        let areas = Areas::default();
        let world = World { terrain: &Flat(0.0), areas: &areas };
        let mut standing = Controller::new(self.clone(), tuning, Vec2::ZERO, 0.0, &world).ok()?;
        if standing.step(SETTLED, &Intent::default(), &world).event.is_some() {
            return None;
        }
        let (skeleton, root) = (self.skeleton(), standing.root());
        let mut pose = skeleton.rest_pose();
        standing.pose(&mut pose);
        let mut global = vec![Transform::IDENTITY; skeleton.len()];
        pose.to_global(skeleton, &mut global);
        let back = Transform::new(root.position, Quat::from_rotation_y(root.yaw)).inverse();
        global.iter_mut().for_each(|joint| *joint = back * *joint);
        let (feet, heights) = (self.feet(), walked(&mut standing, &world));
        for side in [0, 1] {
            let [heel, toe] = [feet.joints[2 * side], feet.joints[2 * side + 1]];
            let height = heights[side].unwrap_or(feet.heights[2 * side + 1]);
            let up = height - global[toe].translation.y;
            let mut raised = vec![false; skeleton.len()];
            for (joint, of) in skeleton.joints().iter().enumerate() {
                raised[joint] = joint == heel || of.parent.is_some_and(|parent| raised[parent]);
                global[joint].translation.y += if raised[joint] { up } else { 0.0 };
            }
        }
        Some(global)
    }
}

/// Median heights of the left and the right toe joint in contact, in a walk; metres.
fn walked(character: &mut Controller, world: &World<'_>) -> [Option<f32>; 2] {
    let model = character.model().clone();
    let mut pose = model.skeleton().rest_pose();
    let mut global = vec![Transform::IDENTITY; model.skeleton().len()];
    let mut heights = [vec![], vec![]];
    let intent = Intent { velocity: Vec2::new(0.0, SPEED), ..Intent::default() };
    let step = character.step_time();
    for _ in 0..(WALK / step) as usize {
        character.step(step, &intent, world);
        character.pose(&mut pose);
        pose.to_global(model.skeleton(), &mut global);
        let contacts = character.contacts();
        for (side, heights) in heights.iter_mut().enumerate() {
            if contacts[2 * side + 1] > 0.5 {
                heights.push(global[model.feet().joints[2 * side + 1]].translation.y);
            }
        }
    }
    heights.map(|mut heights| {
        heights.sort_by(f32::total_cmp);
        heights.get(heights.len() / 2).copied()
    })
}
