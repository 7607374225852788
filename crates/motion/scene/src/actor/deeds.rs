//! What is done to the object.

use ambulo_rig::glam::{Mat3, Quat, Vec2, Vec3};
use ambulo_rig::{Transform, share};

use super::acting::{Acting, Phase};
use super::{Actor, Stage};
use crate::Push;
use crate::exact::ahead;
use crate::interaction::{Action, Hand, Interaction, Limb};
use crate::surroundings::{Deed, Surroundings};

/// Half-life in seconds of the way from where something was taken hold of to where the hands have it.
const COMES: f32 = 0.15;
/// 1/s: how quickly a box makes up for being too near or too far from who pushes it.
const CATCH_UP: f32 = 5.0;

/// Something in the hands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Held {
    pub object: usize,
    /// From where the pose has the hands to where they hold it.
    offset: Transform,
    /// How high over the ground the hands took hold of it, metres.
    height: f32,
}

impl Actor {
    /// Tells the object what is done to it in this frame. What it cannot do it does not: who leads a
    /// hinge that another holds, leads nothing.
    pub(super) fn act(&mut self, around: &mut dyn Surroundings) {
        let Stage::Acting(mut acting) = self.stage else { return };
        let moves = self.moves.clone();
        let interaction = &moves.all()[acting.which].interaction;
        let Some(action) = &interaction.action else { return };
        let (from, until) = action.times();
        let until = until.unwrap_or(interaction.clip.end);
        let repeats = interaction.clip.hold_repeats && acting.phase != Phase::Exit;
        let over = acting.time >= until && !repeats;
        acting.deed = [acting.deed[0] || acting.time >= from, acting.deed[1] || over];
        self.stage = Stage::Acting(acting);
        match acting.deed {
            [true, false] => {}
            [true, true] => return self.let_go(around),
            _ => return,
        }
        let object = acting.object;
        let deed = match *action {
            Action::Hinge { angle, torque, .. } => {
                let t = ((acting.time - from) / (until - from)).clamp(0.0, 1.0);
                let to = angle * t * t * (3.0 - 2.0 * t);
                Deed::Drive { to, most: torque }
            }
            Action::Press { depth, force, .. } => Deed::Press { depth, most: force },
            Action::Push { force, speed, .. } => {
                let push = self.push(&acting, interaction, speed, around);
                Deed::Push(Some(Push { velocity: push, force }))
            }
            // Hands take hold where they are in the pose.
            Action::Attach { .. } | Action::Seat { .. } => return,
        };
        let _ = around.act(object, deed);
    }

    /// How a box should move so that it stays an arm's length ahead.
    fn push(
        &self,
        acting: &Acting,
        interaction: &Interaction,
        most: f32,
        around: &dyn Surroundings,
    ) -> Vec2 {
        let Some(near) = self.face(acting, interaction, around) else { return Vec2::ZERO };
        let short = interaction.approach.place[1] - near;
        let way = ahead(acting.stand.1);
        let forward = self.velocity.dot(way).max(0.0);
        way * (forward + CATCH_UP * short).clamp(0.0, most)
    }

    /// Ends whatever is done to the object.
    pub(super) fn let_go(&mut self, around: &mut dyn Surroundings) {
        let Stage::Acting(acting) = self.stage else { return };
        if let Some(held) = self.holds.take() {
            let _ = around.act(held.object, Deed::Detach);
        }
        let interaction = &self.moves.all()[acting.which].interaction;
        let deed = match interaction.action {
            Some(Action::Hinge { .. } | Action::Press { .. }) => Deed::Release,
            Some(Action::Push { .. }) => Deed::Push(None),
            _ => return,
        };
        if acting.deed[0] {
            let _ = around.act(acting.object, deed);
        }
    }

    /// Takes hold of a box as soon as its time has come, and carries it where the pose has the hands.
    ///
    /// It is held at the frame of the points that the hands are led to. At first that is where it lies;
    /// then it comes to where the clip has the hands, whoever's hands they are.
    pub(super) fn carry(&mut self, dt: f32, around: &mut dyn Surroundings) {
        let Stage::Acting(acting) = self.stage else { return };
        let moves = self.moves.clone();
        let action = &moves.all()[acting.which].interaction.action;
        let Some(Action::Attach { hands, .. }) = action else { return };
        if acting.deed != [true, false] {
            return;
        }
        let holder = held_by(hands, |side| Some(self.palm(side)));
        let Some(holder) = holder else { return };
        let ground = |at: Vec3| around.terrain().height(at.x, at.z);
        if let Some(held) = &mut self.holds {
            held.offset = held.offset.interpolate(Transform::IDENTITY, share(COMES, dt));
            let mut at = holder * held.offset;
            // Not lower than it lay: what is put down comes to lie as it was picked up.
            at.translation.y = at.translation.y.max(ground(at.translation) + held.height);
            let _ = around.act(held.object, Deed::Carry(at));
            return;
        }
        let limbs = [Limb::LeftHand, Limb::RightHand];
        let point = |side: usize| Some(self.wanted(Some(acting), limbs[side], around)?.1);
        let Some(points) = held_by(hands, point) else { return };
        let height = points.translation.y - ground(points.translation);
        let (object, offset) = (acting.object, holder.inverse() * points);
        if around.act(object, Deed::Attach(points)).is_ok() {
            self.holds = Some(Held { object, offset, height });
        }
    }

    /// Where a palm is, 0 the left one.
    pub(crate) fn palm(&self, side: usize) -> Transform {
        self.global[self.body.arms[side].joints()[2]] * self.body.palms[side]
    }
}

/// The frame that a held object hangs on: that of one hand, or between both, upright, its x from the
/// right one to the left.
fn held_by(hands: &[Hand], at: impl Fn(usize) -> Option<Transform>) -> Option<Transform> {
    if let [one] = hands {
        return at(usize::from(*one == Hand::RightHand));
    }
    let [left, right] = [at(0)?, at(1)?];
    let across = left.translation - right.translation;
    let x = Vec3::new(across.x, 0.0, across.z).normalize_or(Vec3::X);
    let turn = Quat::from_mat3(&Mat3::from_cols(x, Vec3::Y, x.cross(Vec3::Y)));
    Some(Transform::new((left.translation + right.translation) * 0.5, turn))
}
