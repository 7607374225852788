//! A humanoid as it stands: which joint is what, its proportions, and where its floor is.

use glam::{Quat, Vec3};

use crate::{Pose, Roles, Skeleton, Transform};

/// Share of a leg's length that the ball of a foot is above the floor where nothing tells.
const SOLE: f32 = 0.033;
/// The same of an ankle, on a skeleton without toes.
const ANKLE: f32 = 0.1;

/// A skeleton as it stands upright: facing +Z, feet flat on level ground, arms in T or A.
#[derive(Clone, Debug)]
pub struct Stance<'a> {
    pub(crate) skeleton: &'a Skeleton,
    pub(crate) roles: Roles,
    pub(crate) global: Vec<Transform>,
    pub(crate) local: Vec<Quat>,
    sole: Option<f32>,
}

impl<'a> Stance<'a> {
    /// The skeleton at rest, its joints found by their names.
    pub fn rest(skeleton: &'a Skeleton) -> Self {
        let mut global = vec![Transform::IDENTITY; skeleton.len()];
        Pose::rest(skeleton).to_global(skeleton, &mut global);
        let local = vec![Quat::IDENTITY; skeleton.len()];
        Self { skeleton, roles: Roles::by_name(skeleton), global, local, sole: None }
    }

    /// For a skeleton whose offsets alone do not stand, or not with flat feet: the rotations of a
    /// pose in which it does. Where that pose is makes no difference.
    ///
    /// # Panics
    /// When the pose has not as many joints as the skeleton.
    pub fn posed(mut self, pose: &Pose) -> Self {
        let mut standing = Pose::rest(self.skeleton);
        assert_eq!(pose.local.len(), standing.local.len(), "pose and skeleton differ in joints");
        for (joint, posed) in standing.local.iter_mut().zip(&pose.local) {
            joint.rotation = posed.rotation.normalize();
        }
        standing.to_global(self.skeleton, &mut self.global);
        self.local = standing.local.iter().map(|joint| joint.rotation).collect();
        self
    }

    /// For names that tell too little.
    ///
    /// # Panics
    /// When a role's joint is none of the skeleton's.
    pub fn with_roles(mut self, roles: Roles) -> Self {
        let Roles { hips, head, thighs, feet, toes, arms, hands } = roles;
        let pairs = [thighs, feet, toes, arms, hands].into_iter().flatten().flatten();
        let last = pairs.chain(hips).chain(head).max();
        assert!(last < Some(self.skeleton.len()), "roles and skeleton differ in joints");
        self.roles = roles;
        self
    }

    /// Metres from the floor up to the balls of the feet (up to the ankles without toes). Else the
    /// floor is where the lowest tip or child of the toes is, or 3.3 % of a leg below their joint.
    pub fn with_sole(mut self, metres: f32) -> Self {
        self.sole = Some(metres);
        self
    }

    pub(crate) fn at(&self, joint: usize) -> Vec3 {
        self.global[joint].translation
    }

    fn name(&self, joint: usize) -> String {
        self.skeleton.joints()[joint].name.to_lowercase()
    }

    /// From just below `above` down to `joint`; `None` when it does not hang there.
    fn chain(&self, above: usize, joint: usize) -> Option<Vec<usize>> {
        let mut chain = vec![];
        let mut at = joint;
        while at != above {
            chain.push(at);
            at = self.skeleton.joints()[at].parent?;
        }
        chain.reverse();
        Some(chain)
    }

    /// Knee or elbow: the joint between by its name, else the one that halves the limb best.
    fn middle(&self, first: usize, last: usize, names: &[&str]) -> Option<usize> {
        let mut between = self.chain(first, last)?;
        between.pop();
        let named = |&&joint: &&usize| {
            let name = self.name(joint);
            let helper = ["twist", "roll", "part"].iter().any(|word| name.contains(word));
            !helper && names.iter().any(|word| name.contains(word))
        };
        let halves = |&joint: &usize| {
            let [a, b, c] = [first, joint, last].map(|joint| self.at(joint));
            a.distance(b).min(b.distance(c))
        };
        let best = between.iter().max_by(|a, b| halves(a).total_cmp(&halves(b)));
        between.iter().find(named).or(best).copied()
    }

    /// Upper bone, lower bone, end.
    pub(crate) fn arm(&self, side: usize) -> Option<[usize; 3]> {
        let (arms, hands) = (self.roles.arms?, self.roles.hands?);
        let elbow =
            self.middle(arms[side], hands[side], &["forearm", "lowerarm", "radius", "elbow"])?;
        Some([arms[side], elbow, hands[side]])
    }

    fn leg(&self, side: usize) -> Option<[usize; 3]> {
        let (thighs, feet) = (self.roles.thighs?, self.roles.feet?);
        let names = ["lowerleg", "shin", "calf", "tibia", "knee", "leg"];
        let knee = self.middle(thighs[side], feet[side], &names)?;
        Some([thighs[side], knee, feet[side]])
    }

    /// The farthest of what a joint carries, in the world, relative to the joint.
    pub(crate) fn farthest(&self, joint: usize) -> Option<Vec3> {
        let below = (joint..self.skeleton.len()).filter(|&at| self.chain(joint, at).is_some());
        let ends = below.flat_map(|at| {
            let tips = self.skeleton.joints()[at].tips.iter();
            let tips = tips.map(move |tip| self.global[at].transform_point(tip.as_vec3()));
            tips.chain([self.at(at)]).map(|end| end - self.at(joint))
        });
        let far = ends.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
        (far.length() > 0.01).then_some(far)
    }

    /// Checks the stance and finds what a humanoid has.
    pub(crate) fn body(&self) -> Result<Body, &'static str> {
        if !self.global.iter().all(|joint| joint.is_finite()) {
            return Err("a stance that is not finite");
        }
        let hips = self.roles.hips.ok_or("no hips")?;
        let legs = [self.leg(0), self.leg(1)];
        let [Some(left), Some(right)] = legs else { return Err("no legs of two bones") };
        let legs = [left, right];
        if legs.iter().any(|leg| self.chain(hips, leg[0]).is_none_or(|chain| chain.is_empty())) {
            return Err("legs that do not hang on the hips");
        }
        let length = |leg: &[usize; 3]| {
            let [a, b, c] = leg.map(|joint| self.at(joint));
            [a.distance(b), b.distance(c)]
        };
        let lengths = legs.each_ref().map(length);
        if lengths.iter().flatten().any(|&length| length < 1e-3) {
            return Err("a leg's bone without length");
        }
        let leg = lengths.map(|[upper, lower]| upper + lower).into_iter().fold(f32::MAX, f32::min);
        let toes = self.roles.toes.filter(|toes| {
            (0..2).all(|side| self.chain(legs[side][2], toes[side]).is_some_and(|c| !c.is_empty()))
        });
        let [hip, ankle] = [0, 2].map(|i| [self.at(legs[0][i]), self.at(legs[1][i])]);
        let upright = (0..2).all(|side| hip[side].y - ankle[side].y > 0.7 * leg);
        let ahead =
            toes.is_none_or(|toes| (0..2).all(|side| self.at(toes[side]).z > ankle[side].z));
        if !(upright && ahead && hip[0].x > hip[1].x) {
            return Err("a stance that is not upright, facing +Z");
        }
        let balls = toes.unwrap_or(legs.map(|leg| leg[2]));
        let under = |joint: usize| {
            let below = |end: Vec3| (-end.y).max(0.0);
            self.farthest(joint).map(below).filter(|_| toes.is_some())
        };
        let usual = if toes.is_some() { SOLE } else { ANKLE } * leg;
        let found = under(balls[0]).zip(under(balls[1])).map(|(a, b)| 0.5 * (a + b));
        let sole = self.sole.or(found.filter(|&height| height > 0.005)).unwrap_or(usual);
        if !(sole.is_finite() && sole >= 0.0) {
            return Err("soles that are not finite or below the floor");
        }
        let above = |side: usize| ankle[side].y - self.at(balls[side]).y;
        let ankle = (0.5 * (above(0) + above(1)) + sole).max(0.0);
        Ok(Body { hips, legs, lengths, toes, sole, ankle, stature: leg + ankle })
    }

    /// From hips to chest (what carries both arms) and from there to the head.
    pub(crate) fn trunk(&self, hips: usize) -> [Vec<usize>; 2] {
        let chain = self.roles.head.and_then(|head| self.chain(hips, head)).unwrap_or_default();
        let arms = self.roles.arms.map(|arms| arms.map(|arm| self.chain(hips, arm)));
        let Some([Some(left), Some(right)]) = arms else { return [chain, vec![]] };
        let both = left.iter().zip(&right).take_while(|(a, b)| a == b).count();
        let neck = chain.iter().zip(&left[..both]).take_while(|(a, b)| a == b).count();
        [left[..both].to_vec(), chain[neck..].to_vec()]
    }

    /// The collar bone: the longest of the bones between what carries both arms and this arm.
    pub(crate) fn collar(&self, arm: usize) -> Option<usize> {
        let hips = self.roles.hips?;
        let chest = self.trunk(hips)[0].last().copied().unwrap_or(hips);
        let chain = self.chain(chest, arm)?;
        let length = |pair: &[usize]| self.at(pair[0]).distance(self.at(pair[1]));
        let longest = chain.windows(2).max_by(|a, b| length(a).total_cmp(&length(b)));
        longest.map(|pair| pair[0])
    }

    /// The share of a chain's length, from `above` to its last joint, at which each joint is; by
    /// count when it has no length.
    pub(crate) fn shares(&self, above: usize, chain: &[usize]) -> Vec<f32> {
        let mut at = above;
        let lengths = chain.iter().map(|&joint| {
            let length = self.at(joint).distance(self.at(at));
            at = joint;
            length
        });
        let mut sum = 0.0;
        let sums: Vec<f32> = lengths
            .map(|length| {
                sum += length;
                sum
            })
            .collect();
        let count = chain.len() as f32;
        let even = |index: usize| (index + 1) as f32 / count;
        let share = |(index, &at): (usize, &f32)| if sum > 1e-4 { at / sum } else { even(index) };
        sums.iter().enumerate().map(share).collect()
    }
}

/// What a stance must have, and its measures in metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    pub hips: usize,
    /// Thigh, shin, foot; left, right.
    pub legs: [[usize; 3]; 2],
    /// Of thigh and shin.
    pub lengths: [[f32; 2]; 2],
    pub toes: Option<[usize; 2]>,
    /// From the floor up to the balls, or to the ankles without toes.
    pub sole: f32,
    /// From the floor up to the ankles.
    pub ankle: f32,
    /// From the floor up to the thighs, with straight legs.
    pub stature: f32,
}
