//! The second half of a frame: from the network's pose to the one that is shown.

use ambulo_layers::{Ground, Limb as Bones, Pole, Reach, Want};
use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Pose, Transform};

use super::acting::{Acting, Phase, placed};
use super::{Actor, Led, Source, Stage};
use crate::interaction::{Limb, Target, Walks};
use crate::object::yawed;
use crate::surroundings::Surroundings;

/// A hand within this share of the farthest that it reaches slows the clip, which stops there.
const STRETCH: f32 = 0.04;
/// Arms longer than this share of their reach pull the hips.
const COMFORT: f32 = 0.98;
/// A hand that is farther than this from what it holds has slipped off, metres.
const SLIP: f32 = 0.008;
/// From this weight on a hand is expected at its target.
const DUE: f32 = 0.85;

impl Actor {
    /// The second half of a frame of `dt` seconds, after the world has moved on: makes the pose.
    /// Allocates nothing.
    pub fn pose(&mut self, dt: f32, around: &mut dyn Surroundings) -> &Pose {
        self.network.swap(0, 1);
        self.controller.pose(&mut self.network[0]);
        self.blend(dt, around);
        self.shown.to_global(&self.body.skeleton, &mut self.global);
        self.led.clear();
        let acting = match self.stage {
            Stage::Acting(acting) => Some(acting),
            _ => None,
        };
        self.lead_hips(acting, around);
        // What is shown when something else is played: without what the feet's own layer remembers.
        self.clip.local.clone_from(&self.shown.local);
        self.place_feet(acting, dt, around);
        self.carry(dt, around);
        self.lead_hands(acting, around);
        self.keep_out(around);
        self.turn_head(acting, dt, around);
        for (joint, upper) in self.body.upper.iter().enumerate() {
            if *upper {
                self.clip.local[joint] = self.shown.local[joint];
            }
        }
        let _ = self.inertialiser.shown_instead(&self.clip);
        &self.shown
    }

    /// Clip over network, and what is left of the transition.
    fn blend(&mut self, dt: f32, around: &dyn Surroundings) {
        let (source, time) = match self.stage {
            Stage::Acting(acting) => (self.source_of(&acting), acting.time),
            _ => (Source::Network, 0.0),
        };
        // Taken out and put back: an empty pose allocates nothing.
        let none = || Pose { local: vec![] };
        let [mut now, mut before] = std::mem::replace(&mut self.source, [none(), none()]);
        self.write_source(source, time, 0, around, &mut now);
        if (source != self.played || self.jumped) && dt > 0.0 {
            self.write_source(source, time - self.tick, 1, around, &mut before);
            // Refused only for numbers that are not finite, which no pose here has.
            let _ = self.inertialiser.switch(&before, &now, dt);
        }
        (self.played, self.jumped) = (source, false);
        let _ = self.inertialiser.step(&now, dt, &mut self.shown);
        self.source = [now, before];
    }

    fn source_of(&self, acting: &Acting) -> Source {
        let one = &self.moves.all()[acting.which];
        if one.motion.is_none() {
            return Source::Network;
        }
        let clip = &one.interaction.clip;
        if acting.time >= clip.end {
            return Source::Network;
        }
        match (clip.walks, acting.phase) {
            (Walks::Always, _) | (Walks::Hold, Phase::Hold) => Source::Upper(acting.which),
            _ => Source::Clip(acting.which),
        }
    }

    /// A source at a second of its clip; `network`: 0 for this frame's pose, 1 for the one before.
    fn write_source(
        &self,
        source: Source,
        time: f32,
        network: usize,
        around: &dyn Surroundings,
        out: &mut Pose,
    ) {
        let walking = &self.network[network];
        let (Source::Clip(which) | Source::Upper(which)) = source else {
            out.local.clone_from(&walking.local);
            return;
        };
        let one = &self.moves.all()[which];
        let (Some(motion), Stage::Acting(acting)) = (&one.motion, self.stage) else {
            out.local.clone_from(&walking.local);
            return;
        };
        motion.as_recorded(f64::from(time), out);
        let root = self.controller.root();
        if let Source::Clip(_) = source {
            let (place, yaw) = acting.anchor(&one.interaction, root, time);
            let height = around.terrain().height(place.x, place.y);
            out.local[0] = placed((place, yaw), height) * out.local[0];
            return;
        }
        self.lay_over(walking, yawed(root.yaw), out);
    }

    /// Puts the legs of a walking pose under a clip, whose upper body stays as it is in the
    /// character's frame.
    fn lay_over(&self, walking: &Pose, turn: Quat, out: &mut Pose) {
        let joints = self.body.skeleton.joints();
        let rotation = |pose: &Pose, joint: usize| {
            let parents = std::iter::successors(Some(joint), |&joint| joints[joint].parent);
            parents.fold(Quat::IDENTITY, |turn, joint| pose.local[joint].rotation * turn)
        };
        for (joint, own) in joints.iter().enumerate() {
            let Some(parent) = own.parent else { continue };
            if self.body.upper[joint] && !self.body.upper[parent] {
                let wanted = turn * rotation(out, joint);
                let local = rotation(walking, parent).inverse() * wanted;
                out.local[joint].rotation = local.normalize();
            }
        }
        for joint in (0..joints.len()).filter(|&joint| !self.body.upper[joint]) {
            out.local[joint] = walking.local[joint];
        }
    }

    /// Where a target is to be, if the acting leads that limb now.
    pub(super) fn wanted(
        &self,
        acting: Option<Acting>,
        limb: Limb,
        around: &dyn Surroundings,
    ) -> Option<(f32, Transform, bool)> {
        let acting = acting?;
        let target: &Target = self.moves.all()[acting.which].interaction.target(limb)?;
        let weight = target.weight(acting.time);
        let frame = around.frame(acting.object, &target.on)?;
        (weight > 0.0).then(|| (weight, frame * target.place(), target.rotation.is_some()))
    }

    fn lead_hips(&mut self, acting: Option<Acting>, around: &dyn Surroundings) {
        let Some((weight, wanted, turned)) = self.wanted(acting, Limb::Hips, around) else {
            return;
        };
        let hips = self.body.hips;
        let parent = self.body.skeleton.joints()[hips].parent;
        let parent = parent.map_or(Transform::IDENTITY, |parent| self.global[parent]);
        let own = self.global[hips];
        let to = if turned { wanted } else { Transform::new(wanted.translation, own.rotation) };
        self.shown.local[hips] = parent.inverse() * own.interpolate(to, weight);
        self.shown.update_global(&self.body.skeleton, hips, &mut self.global);
        let reached = self.global[hips];
        let limb = Limb::Hips;
        self.led.push(Led { limb, weight, wanted, reached, turned, slips: false });
    }

    fn place_feet(&mut self, acting: Option<Acting>, dt: f32, around: &dyn Surroundings) {
        let root = self.controller.root();
        let clip = match (self.played, acting) {
            (Source::Clip(which), Some(acting)) => Some((which, acting)),
            _ => None,
        };
        let terrain = around.terrain();
        let (feet, contacts, level) = match clip {
            Some((which, acting)) => {
                let one = &self.moves.all()[which];
                let (place, _) = acting.anchor(&one.interaction, root, acting.time);
                let level = Some(terrain.height(place.x, place.y));
                (&self.body.standing_feet, one.contacts(acting.time), level)
            }
            None => (&self.body.feet, self.controller.contacts(), None),
        };
        let ground = Ground { terrain, level };
        let hands = [Limb::LeftHand, Limb::RightHand];
        let wants = [0, 1].map(|side| self.hand_wants(acting, hands[side], side, around));
        // Hips that are led themselves heed nobody.
        let led = self.led.iter().any(|led| led.limb == Limb::Hips);
        let wants = if led { &[][..] } else { &wants[..] };
        let skeleton = &self.body.skeleton;
        let (state, pose, global) = (&mut self.feet, &mut self.shown, &mut self.global);
        feet.step_reaching(skeleton, state, contacts, &ground, wants, dt, pose, global);
    }

    /// What an arm wants of the hips so that its hand reaches.
    fn hand_wants(
        &self,
        acting: Option<Acting>,
        limb: Limb,
        side: usize,
        around: &dyn Surroundings,
    ) -> Want {
        // What is held comes along: there is nothing to bend down to.
        let wanted = self.wanted(acting, limb, around).filter(|_| self.holds.is_none());
        let Some((weight, wanted, _)) = wanted else { return Want::default() };
        let arm = self.body.arms[side];
        let root = self.global[arm.joints()[0]].translation;
        let target = (wanted * self.body.palms[side].inverse()).translation;
        let reach = arm.span(&self.global).exact;
        Want { root, target, comfort: COMFORT * reach, reach, weight }
    }

    fn lead_hands(&mut self, acting: Option<Acting>, around: &dyn Surroundings) {
        (self.pace, self.slips) = (1.0, false);
        for (side, limb) in [Limb::LeftHand, Limb::RightHand].into_iter().enumerate() {
            let Some((weight, wanted, turned)) = self.wanted(acting, limb, around) else {
                continue;
            };
            let arm = self.body.arms[side];
            let [shoulder, _, wrist] = arm.joints();
            let own = self.palm(side);
            let palm =
                if turned { wanted } else { Transform::new(wanted.translation, own.rotation) };
            let goal = palm * self.body.palms[side].inverse();
            let asked = Reach {
                position: goal.translation,
                rotation: turned.then_some(goal.rotation),
                pole: None,
                weight,
            };
            let distance = self.global[shoulder].translation.distance(goal.translation);
            let most = arm.span(&self.global).exact;
            let leaves = acting.is_some_and(|acting| acting.phase == Phase::Exit);
            if !leaves && self.holds.is_none() {
                // Only who should be there already: a hand on its way may be far from it.
                let due = ((weight - DUE) / (1.0 - DUE)).clamp(0.0, 1.0);
                let over = (distance / most - 1.0 + STRETCH) / STRETCH * due;
                self.pace = self.pace.min((1.0 - over).clamp(0.0, 1.0));
            }
            arm.reach(&self.body.skeleton, &asked, &mut self.shown, &mut self.global);
            let reached = self.global[wrist] * self.body.palms[side];
            let off = reached.translation.distance(wanted.translation);
            let slips = weight > 0.999 && off > SLIP && !leaves;
            self.slips |= slips;
            self.led.push(Led { limb, weight, wanted, reached, turned, slips });
        }
    }

    /// Hands that are led nowhere and feet stay out of what is solid.
    fn keep_out(&mut self, around: &dyn Surroundings) {
        let held = self.holds.map(|held| held.object);
        for side in [0, 1] {
            let hand = [Limb::LeftHand, Limb::RightHand][side];
            let free = !self.led.iter().any(|led| led.limb == hand);
            let (arm, leg, (toe, _)) =
                (self.body.arms[side], self.body.legs[side], self.body.toes[side]);
            // Twice: what leads out of one thing may lead into another.
            for _ in 0..2 {
                if free {
                    let wrist = self.global[arm.joints()[2]].translation;
                    self.take_out(arm, [self.palm(side).translation, wrist], held, around);
                }
                let ankle = self.global[leg.joints()[2]].translation;
                let toe = self.global[toe].translation;
                // Arms may lie on what they carry, knees keep out of that, too.
                self.take_out(leg, [toe, ankle], None, around);
                self.take_out(leg, [toe.lerp(ankle, 0.5); 2], None, around);
                self.swing_out(arm, held, around);
                self.swing_out(leg, None, around);
            }
        }
    }

    /// Swings a limb about the line from its first joint to its end until its elbow or knee, and what
    /// is halfway to it, is out of what is solid, as far as that leads out.
    fn swing_out(&mut self, limb: Bones, held: Option<usize>, around: &dyn Surroundings) {
        let [first, middle, end] = limb.joints();
        let at = self.global[middle].translation;
        let half = at.lerp(self.global[first].translation, 0.5);
        let half = around.way_out(half, held).map(|out| out * 2.0);
        if let Some(out) = around.way_out(at, held).or(half) {
            let asked = Reach {
                pole: Some(Pole::Point(at + out)),
                ..Reach::at(self.global[end].translation)
            };
            limb.reach(&self.body.skeleton, &asked, &mut self.shown, &mut self.global);
        }
    }

    /// Moves a limb's end by the way out of whichever of two points is deeper in something.
    fn take_out(
        &mut self,
        limb: Bones,
        points: [Vec3; 2],
        held: Option<usize>,
        around: &dyn Surroundings,
    ) {
        let [a, b] = points.map(|point| around.way_out(point, held).unwrap_or(Vec3::ZERO));
        let out = if b.length_squared() > a.length_squared() { b } else { a };
        if out != Vec3::ZERO {
            let asked = Reach::at(self.global[limb.joints()[2]].translation + out);
            limb.reach(&self.body.skeleton, &asked, &mut self.shown, &mut self.global);
        }
    }

    fn turn_head(&mut self, acting: Option<Acting>, dt: f32, around: &dyn Surroundings) {
        let look = self.wanted(acting, Limb::Look, around);
        let target = look.map(|(_, wanted, _)| wanted.translation);
        let weight = look.map_or(0.0, |(weight, ..)| weight);
        let (skeleton, pose) = (&self.body.skeleton, &mut self.shown);
        let (state, global) = (&mut self.look, &mut self.global);
        self.body.look.step(skeleton, state, target, weight, dt, pose, global);
    }
}
