//! Which joints are hips, feet, arms and head: by their names in the dialects that are met, else by
//! the shape of the skeleton.

use glam::DVec3;

use crate::{Clip, Skeleton};

/// Joints by what they are; `None` where nothing was found. Pairs are left, right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Roles {
    /// The joint that carries both legs and the spine.
    pub hips: Option<usize>,
    /// The head, else the neck.
    pub head: Option<usize>,
    /// Where the upper legs hang.
    pub thighs: Option<[usize; 2]>,
    /// Ankles: what a foot turns about.
    pub feet: Option<[usize; 2]>,
    /// Balls of the feet.
    pub toes: Option<[usize; 2]>,
    /// Where the upper arms hang.
    pub arms: Option<[usize; 2]>,
    /// Wrists.
    pub hands: Option<[usize; 2]>,
}

const HIPS: [&str; 4] = ["hips", "hip", "pelvis", "root"];
const HEAD: [&str; 4] = ["head", "neck", "upperneck", "neck1"];
const THIGHS: [&str; 6] = ["upleg", "upperleg", "thigh", "femur", "hip", "leg1"];
const FEET: [&str; 2] = ["foot", "ankle"];
const TOES: [&str; 5] = ["toebase", "toe", "toes", "ball", "toesend"];
const ARMS: [&str; 5] = ["arm", "upperarm", "uparm", "humerus", "shoulder"];
const HANDS: [&str; 2] = ["hand", "wrist"];

impl Roles {
    /// By name, whatever namespace (`mixamorig:`), case, marks and way of telling sides
    /// (`LeftFoot`, `lfoot`, `foot_L`): the names of CMU, the PFNN's authors, LAFAN1, 100STYLE,
    /// Bandai-Namco, Mixamo, Unity and VRM.
    pub fn by_name(skeleton: &Skeleton) -> Self {
        let names: Vec<String> = skeleton.joints().iter().map(|j| plain(&j.name)).collect();
        let middle = |wanted: &[&str]| {
            wanted.iter().find_map(|wanted| names.iter().position(|name| name == wanted))
        };
        let sided = |side: Side, wanted: &[&str]| {
            let parts: Vec<_> = names.iter().map(|name| side.strip(name)).collect();
            wanted.iter().find_map(|wanted| parts.iter().position(|part| *part == Some(wanted)))
        };
        let both =
            |wanted: &[&str]| Some([sided(Side::Left, wanted)?, sided(Side::Right, wanted)?]);
        Self {
            hips: middle(&HIPS),
            head: middle(&HEAD),
            thighs: both(&THIGHS),
            feet: both(&FEET),
            toes: both(&TOES),
            arms: both(&ARMS),
            hands: both(&HANDS),
        }
    }

    /// By shape, from a clip whose up axis is known, in its first frame: legs are the two chains
    /// that end lowest, hips where they part, feet what the two longest bones of a leg end in; the
    /// head is the highest end. Toes tell which way the body faces, and with it left from right; a
    /// leg without them bends its knee forward.
    pub fn by_shape(clip: &Clip, up: DVec3) -> Self {
        Shape::new(clip, up).roles().unwrap_or_default()
    }

    /// What is found here, else what is found there.
    pub fn or(self, other: Self) -> Self {
        Self {
            hips: self.hips.or(other.hips),
            head: self.head.or(other.head),
            thighs: self.thighs.or(other.thighs),
            feet: self.feet.or(other.feet),
            toes: self.toes.or(other.toes),
            arms: self.arms.or(other.arms),
            hands: self.hands.or(other.hands),
        }
    }
}

#[derive(Clone, Copy)]
enum Side {
    Left,
    Right,
}

impl Side {
    /// What is left of a plain name without the mark of this side.
    fn strip(self, name: &str) -> Option<&str> {
        let (word, letter) = match self {
            Self::Left => ("left", "l"),
            Self::Right => ("right", "r"),
        };
        let stripped = |mark| name.strip_prefix(mark).or_else(|| name.strip_suffix(mark));
        stripped(word).or_else(|| stripped(letter))
    }
}

/// A name in lower case, without namespace and marks: `mixamorig:Left_Foot` is `leftfoot`.
fn plain(name: &str) -> String {
    let name = name.rsplit(':').next().unwrap_or(name);
    let letters = name.chars().filter(|c| c.is_alphanumeric());
    letters.collect::<String>().to_lowercase()
}

/// A skeleton in one pose.
struct Shape<'a> {
    skeleton: &'a Skeleton,
    places: Vec<DVec3>,
    up: DVec3,
}

impl<'a> Shape<'a> {
    fn new(clip: &'a Clip, up: DVec3) -> Self {
        let mut places = vec![];
        clip.positions(0, &mut places);
        Self { skeleton: clip.skeleton(), places, up: up.normalize_or(DVec3::Y) }
    }

    fn height(&self, joint: usize) -> f64 {
        self.places[joint].dot(self.up)
    }

    /// From the root down to a joint.
    fn chain(&self, joint: usize) -> Vec<usize> {
        let parent = |&joint: &usize| self.skeleton.joints()[joint].parent;
        let mut chain: Vec<_> = std::iter::successors(Some(joint), parent).collect();
        chain.reverse();
        chain
    }

    fn leaves(&self) -> Vec<usize> {
        let all = 0..self.skeleton.len();
        all.filter(|&joint| self.skeleton.children(joint).next().is_none()).collect()
    }

    fn roles(&self) -> Option<Roles> {
        let mut leaves = self.leaves();
        leaves.sort_by(|&a, &b| self.height(a).total_cmp(&self.height(b)));
        let first = self.chain(*leaves.first()?);
        // The second leg parts from the first one far above its end.
        let parts = |chain: &[usize]| chain.iter().zip(&first).take_while(|(a, b)| a == b).count();
        let second = leaves[1..].iter().map(|&leaf| self.chain(leaf)).find(|chain| {
            let common = parts(chain);
            common >= 1 && first.len() >= common + 2 && chain.len() >= common + 2
        })?;
        let common = parts(&second);
        let hips = first[common - 1];
        let [a, b] = [&first[common..], &second[common..]].map(|chain| self.limb(chain));
        let (a, b) = (a?, b?);
        let ahead = |leg: &Limb| match leg.beyond {
            Some(toe) => self.places[toe] - self.places[leg.end],
            None => {
                let ends = self.places[leg.start].midpoint(self.places[leg.end]);
                self.places[leg.middle] - ends
            }
        };
        let ahead = (ahead(&a) + ahead(&b)).reject_from(self.up);
        let left = self.up.cross(ahead).try_normalize()?;
        let on_left = |joint: usize| (self.places[joint] - self.places[hips]).dot(left);
        let (l, r) = if on_left(a.start) > on_left(b.start) { (a, b) } else { (b, a) };
        let head = *leaves.last()?;
        let arms = self.arms(&leaves, hips, head, on_left);
        Some(Roles {
            hips: Some(hips),
            head: Some(head),
            thighs: Some([l.start, r.start]),
            feet: Some([l.end, r.end]),
            toes: l.beyond.zip(r.beyond).map(|(l, r)| [l, r]),
            arms: arms.map(|[l, r]| [l.start, r.start]),
            hands: arms.map(|[l, r]| [l.end, r.end]),
        })
    }

    /// The chains above the hips that reach farthest to the left and to the right.
    fn arms(
        &self,
        leaves: &[usize],
        hips: usize,
        head: usize,
        on_left: impl Fn(usize) -> f64,
    ) -> Option<[Limb; 2]> {
        let trunk = self.chain(head);
        let above = leaves.iter().copied().filter(|&leaf| leaf != head);
        let above: Vec<_> = above
            .filter_map(|leaf| {
                let chain = self.chain(leaf);
                let common = chain.iter().zip(&trunk).take_while(|(a, b)| a == b).count();
                let from = chain[..common].last().copied()?;
                (from != hips && trunk.contains(&hips)).then(|| (leaf, chain[common..].to_vec()))
            })
            .collect();
        let reach = |&(leaf, _): &(usize, Vec<usize>)| on_left(leaf);
        let left = above.iter().max_by(|a, b| reach(a).total_cmp(&reach(b)))?;
        let right = above.iter().min_by(|a, b| reach(a).total_cmp(&reach(b)))?;
        (left.0 != right.0).then_some(())?;
        Some([self.limb(&left.1)?, self.limb(&right.1)?])
    }

    /// The two longest bones that follow each other in a chain.
    fn limb(&self, chain: &[usize]) -> Option<Limb> {
        let length = |a: usize, b: usize| self.places[a].distance(self.places[b]);
        let both = |w: &[usize]| length(w[0], w[1]) + length(w[1], w[2]);
        let at = (0..chain.len().checked_sub(2)?)
            .max_by(|&a, &b| both(&chain[a..a + 3]).total_cmp(&both(&chain[b..b + 3])))?;
        let [start, middle, end] = [chain[at], chain[at + 1], chain[at + 2]];
        Some(Limb { start, middle, end, beyond: chain.get(at + 3).copied() })
    }
}

#[derive(Clone, Copy)]
struct Limb {
    start: usize,
    middle: usize,
    end: usize,
    beyond: Option<usize>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Joint;
    use glam::DQuat;

    fn person(names: [&str; 16], toes: bool) -> Clip {
        let joints = [
            (None, [0.0, 1.0, 0.0]),
            (Some(0), [0.1, -0.05, 0.0]),
            (Some(1), [0.0, -0.42, 0.02]),
            (Some(2), [0.0, -0.42, -0.02]),
            (Some(3), [0.0, -0.06, 0.15]),
            (Some(0), [-0.1, -0.05, 0.0]),
            (Some(5), [0.0, -0.42, 0.02]),
            (Some(6), [0.0, -0.42, -0.02]),
            (Some(7), [0.0, -0.06, 0.15]),
            (Some(0), [0.0, 0.4, 0.0]),
            (Some(9), [0.0, 0.25, 0.0]),
            (Some(9), [0.2, 0.0, 0.0]),
            (Some(11), [0.28, 0.0, 0.0]),
            (Some(12), [0.25, 0.0, 0.0]),
            (Some(9), [-0.2, 0.0, 0.0]),
            (Some(14), [-0.28, 0.0, 0.0]),
        ];
        let joints =
            joints.iter().zip(names).enumerate().filter(|(i, _)| toes || ![4, 8].contains(i));
        let kept: Vec<usize> = joints.clone().map(|(i, _)| i).collect();
        let joints: Vec<_> = joints
            .map(|(_, ((parent, offset), name))| Joint {
                name: name.into(),
                parent: parent.map(|p| kept.iter().position(|&k| k == p).unwrap()),
                offset: DVec3::from_array(*offset),
                tips: vec![],
            })
            .collect();
        let count = joints.len();
        let skeleton = Skeleton::new(joints).unwrap();
        let mut rotations = vec![DQuat::IDENTITY; count];
        // Turned, so that nothing lies along an axis.
        rotations[0] = DQuat::from_rotation_y(2.0);
        Clip::new(skeleton, 0.1, vec![], vec![], rotations).unwrap()
    }

    const NAMES: [&str; 16] = [
        "Hips",
        "LeftUpLeg",
        "LeftLeg",
        "LeftFoot",
        "LeftToe",
        "RightUpLeg",
        "RightLeg",
        "RightFoot",
        "RightToe",
        "Spine",
        "Head",
        "LeftArm",
        "LeftForeArm",
        "LeftHand",
        "RightArm",
        "RightForeArm",
    ];

    #[test]
    fn names_of_every_dialect() {
        let expected = Roles::by_name(person(NAMES, true).skeleton());
        assert_eq!(expected.hips, Some(0));
        assert_eq!(expected.toes, Some([4, 8]));
        assert_eq!(expected.thighs, Some([1, 5]));
        assert_eq!(expected.arms, Some([11, 14]));
        for (names, toes) in [
            (
                [
                    "joint_Root",
                    "UpperLeg_L",
                    "LowerLeg_L",
                    "Foot_L",
                    "Toes_L",
                    "UpperLeg_R",
                    "LowerLeg_R",
                    "Foot_R",
                    "Toes_R",
                    "Spine",
                    "Head",
                    "UpperArm_L",
                    "LowerArm_L",
                    "Hand_L",
                    "UpperArm_R",
                    "Hand_R",
                ],
                [4, 8],
            ),
            (
                [
                    "m:Hips",
                    "m:LeftUpLeg",
                    "m:LeftLeg",
                    "m:LeftFoot",
                    "m:LeftToeBase",
                    "m:RightUpLeg",
                    "m:RightLeg",
                    "m:RightFoot",
                    "m:RightToeBase",
                    "m:Spine",
                    "m:Head",
                    "m:LeftArm",
                    "m:LeftForeArm",
                    "m:LeftHand",
                    "m:RightArm",
                    "m:RightHand",
                ],
                [4, 8],
            ),
            (
                [
                    "root",
                    "lfemur",
                    "ltibia",
                    "lfoot",
                    "ltoes",
                    "rfemur",
                    "rtibia",
                    "rfoot",
                    "rtoes",
                    "lowerback",
                    "head",
                    "lhumerus",
                    "lradius",
                    "lhand",
                    "rhumerus",
                    "rhand",
                ],
                [4, 8],
            ),
        ] {
            let roles = Roles::by_name(person(names, true).skeleton());
            assert_eq!((roles.thighs, roles.toes), (Some([1, 5]), Some(toes)), "{names:?}");
            assert_eq!((roles.feet, roles.arms), (Some([3, 7]), Some([11, 14])), "{names:?}");
        }
    }

    #[test]
    fn shape_finds_what_names_do_not_tell() {
        let letters =
            ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l", "m", "n", "o", "p"];
        let clip = person(letters, true);
        assert_eq!(Roles::by_name(clip.skeleton()), Roles::default());
        let roles = Roles::by_shape(&clip, DVec3::Y);
        let named = Roles::by_name(person(NAMES, true).skeleton());
        assert_eq!((roles.hips, roles.head), (named.hips, named.head));
        assert_eq!((roles.thighs, roles.feet, roles.toes), (named.thighs, named.feet, named.toes));
        // Without toes the knees tell which way is ahead.
        let roles = Roles::by_shape(&person(letters, false), DVec3::Y);
        assert_eq!((roles.thighs, roles.feet), (Some([1, 4]), Some([3, 6])));
        assert_eq!(roles.toes, None);
        let stick = Joint { name: "a".into(), parent: None, offset: DVec3::ZERO, tips: vec![] };
        let stick = Skeleton::new(vec![stick]).unwrap();
        let clip = Clip::new(stick, 0.1, vec![], vec![], vec![DQuat::IDENTITY]).unwrap();
        assert_eq!(Roles::by_shape(&clip, DVec3::Y), Roles::default());
    }
}
