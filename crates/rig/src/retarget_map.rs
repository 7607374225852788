//! Which joint of one humanoid turns as which joint of the other does.

use glam::{Quat, Vec3};

use crate::stance::Body;
use crate::{Stance, Transform};

/// From hips to thighs, as a share of the height of the thighs: what is less has no direction.
const PELVIS: f32 = 0.05;

/// How a joint of the target turns: between two of the source, or as one that is named twice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub to: usize,
    /// Joints of the source, each with what undoes its rotation in the stance.
    from: [(usize, Quat); 2],
    share: f32,
    /// What lays the target's bone along the source's, after the target's rotation in its stance.
    rest: Quat,
}

impl Link {
    /// The joint's rotation in the world.
    pub fn turn(&self, source: &[Transform]) -> Quat {
        let [first, last] = self.from;
        let turn = |(joint, undo): (usize, Quat)| source[joint].rotation * undo;
        let own = turn(last);
        let own = if self.share < 1.0 { turn(first).slerp(own, self.share) } else { own };
        (own * self.rest).normalize()
    }
}

/// The links of two stances, in the order of the target's joints.
pub(crate) fn links(from: &Stance<'_>, to: &Stance<'_>, bodies: [&Body; 2]) -> Vec<Link> {
    let mut map = Map { from, to, found: vec![] };
    let [source, target] = bodies;
    if source.hips > 0 && target.hips > 0 {
        map.pair(0, 0, Quat::IDENTITY);
    }
    map.pelvis(bodies);
    for side in 0..2 {
        map.leg(bodies, side);
    }
    map.trunk([source.hips, target.hips]);
    for side in 0..2 {
        map.arm(side);
    }
    let mut links = map.found;
    links.sort_by_key(|link| link.to);
    links.dedup_by_key(|link| link.to);
    links
}

struct Map<'a> {
    from: &'a Stance<'a>,
    to: &'a Stance<'a>,
    found: Vec<Link>,
}

impl Map<'_> {
    fn pair(&mut self, from: usize, to: usize, along: Quat) {
        self.between([from; 2], 1.0, to, along);
    }

    fn between(&mut self, from: [usize; 2], share: f32, to: usize, along: Quat) {
        let from = from.map(|joint| (joint, self.from.global[joint].rotation.inverse()));
        let rest = along * self.to.global[to].rotation;
        self.found.push(Link { to, from, share, rest });
    }

    /// Thighs hang below the hips as they do on the source. Hips that are close to their thighs hang
    /// straight: the direction of a short bone says nothing.
    fn pelvis(&mut self, bodies: [&Body; 2]) {
        let hang = |stance: &Stance<'_>, body: &Body| {
            let [left, right] = body.legs.map(|leg| stance.at(leg[0]));
            let bone = (left.midpoint(right) - stance.at(body.hips)).with_x(0.0);
            if bone.length() > PELVIS * body.stature { bone } else { Vec3::NEG_Y }
        };
        let [theirs, ours] = [hang(self.from, bodies[0]), hang(self.to, bodies[1])];
        let along = aligned(Quat::IDENTITY, ours, theirs);
        self.pair(bodies[0].hips, bodies[1].hips, along);
    }

    /// Lays the target's bone, turned by `before` already, along the source's.
    fn along(&self, from: [usize; 2], to: [usize; 2], before: Quat) -> Quat {
        let bone = |stance: &Stance<'_>, [a, b]: [usize; 2]| stance.at(b) - stance.at(a);
        aligned(before, bone(self.to, to), bone(self.from, from))
    }

    /// Two bones, so that both lie along the source's; returns what the second one is turned by.
    fn limb(&mut self, from: [usize; 3], to: [usize; 3]) -> Quat {
        let upper = self.along([from[0], from[1]], [to[0], to[1]], Quat::IDENTITY);
        let lower = self.along([from[1], from[2]], [to[1], to[2]], upper);
        self.pair(from[0], to[0], upper);
        self.pair(from[1], to[1], lower);
        lower
    }

    /// Feet are flat in both stances: they are only turned to point the same way.
    fn leg(&mut self, [source, target]: [&Body; 2], side: usize) {
        let (from, to) = (source.legs[side], target.legs[side]);
        self.limb(from, to);
        let toes = source.toes.zip(target.toes).map(|(from, to)| (from[side], to[side]));
        let points = |stance: &Stance<'_>, ankle: usize, toe: usize| {
            (stance.at(toe) - stance.at(ankle)).with_y(0.0)
        };
        let along = toes.map_or(Quat::IDENTITY, |(ball, toe)| {
            let (ours, theirs) = (points(self.to, to[2], toe), points(self.from, from[2], ball));
            aligned(Quat::IDENTITY, ours, theirs)
        });
        self.pair(from[2], to[2], along);
        if let Some((ball, toe)) = toes {
            self.pair(ball, toe, along);
        }
    }

    /// Hips to chest, chest to head: each joint turns as the source's trunk does at the same share
    /// of its length.
    fn trunk(&mut self, hips: [usize; 2]) {
        // Where one has no arms to tell the chest, the whole trunk is one chain.
        let arms = self.from.roles.arms.is_some() && self.to.roles.arms.is_some();
        let trunk = |stance: &Stance<'_>, hips: usize| match (stance.trunk(hips), arms) {
            (chains, true) => chains,
            (chains, false) => [chains.concat(), vec![]],
        };
        let (from, to) = (trunk(self.from, hips[0]), trunk(self.to, hips[1]));
        let mut above = hips;
        for (from, to) in from.iter().zip(&to) {
            let ours = self.to.shares(above[1], to);
            let theirs = self.from.shares(above[0], from);
            for (&joint, &share) in to.iter().zip(&ours) {
                let next = theirs.iter().position(|&at| at >= share - 1e-5);
                let Some(next) = next else { continue };
                let before =
                    next.checked_sub(1).map_or((above[0], 0.0), |at| (from[at], theirs[at]));
                let span = theirs[next] - before.1;
                let part = if span > 1e-5 { (share - before.1) / span } else { 1.0 };
                let part = if part > 1.0 - 1e-4 { 1.0 } else { part };
                self.between([before.0, from[next]], part, joint, Quat::IDENTITY);
            }
            let last = |chain: &[usize], above| chain.last().copied().unwrap_or(above);
            above = [last(from, above[0]), last(to, above[1])];
        }
    }

    /// Collar bones keep their own slant: they hang on trunks of other shapes.
    fn arm(&mut self, side: usize) {
        let (Some(from), Some(to)) = (self.from.arm(side), self.to.arm(side)) else { return };
        let collars = self.from.collar(from[0]).zip(self.to.collar(to[0]));
        if let Some((from, to)) = collars {
            self.pair(from, to, Quat::IDENTITY);
        }
        let lower = self.limb(from, to);
        let fingers = self.from.farthest(from[2]).zip(self.to.farthest(to[2]));
        let hand = fingers.map_or(lower, |(theirs, ours)| aligned(lower, ours, theirs));
        self.pair(from[2], to[2], hand);
    }
}

/// `before`, and then the least turn that takes `ours` to where `theirs` points.
fn aligned(before: Quat, ours: Vec3, theirs: Vec3) -> Quat {
    let (ours, theirs) = ((before * ours).try_normalize(), theirs.try_normalize());
    let least = ours.zip(theirs).map(|(ours, theirs)| Quat::from_rotation_arc(ours, theirs));
    (least.unwrap_or(Quat::IDENTITY) * before).normalize()
}
