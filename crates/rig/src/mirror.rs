//! Left becomes right: the same motion as a mirror shows it, on the same skeleton.

use glam::{DMat3, DQuat, DVec3};

use crate::{Clip, Pose, Skeleton, Transform};

/// Why a motion cannot be mirrored.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum MirrorError {
    #[error("no joint has a partner by name (Left… / Right…, L… / R…, …_L / …_R)")]
    NoNames,
    #[error("joint '{0}' has no partner on the other side")]
    NoPartner(String),
    #[error("'{0}' and '{1}' are partners, but their parents are not")]
    Parents(String, String),
    #[error("the clip's skeleton is not the one that this mirror was made for")]
    OtherSkeleton,
    #[error("the lateral direction must be finite and not zero")]
    Lateral,
}

/// Which joints are partners, and how each one's frame is reflected.
///
/// The mirror image of a joint's world rotation G is M·G·L: M reflects the world through the plane
/// across the character, L reflects within the joint's own frame so that a rotation comes out.
/// Where rest frames are parallel to the world (most BVH files), L = M. Where a bone lies along an
/// axis of its frame (Bandai-Namco), M would turn it round; L is then the reflection through a
/// coordinate plane that takes the offsets of the children to those of their partners.
#[derive(Clone, Debug)]
pub struct Mirror {
    skeleton: Skeleton,
    partner: Vec<usize>,
    world: DMat3,
    local: Vec<DMat3>,
}

impl Mirror {
    /// Partners by name: `Left`/`Right` anywhere, a leading `L`/`R` or `l`/`r`, a trailing
    /// `_L`/`_R`, `.L`/`.R` or `_l`/`_r`; a joint whose partner's name does not occur is its own.
    ///
    /// `lateral` points to the character's left or right ([`crate::Axes::left`]).
    ///
    /// # Errors
    /// No pair at all, or pairs whose parents are not partners.
    pub fn by_name(clip: &Clip, lateral: DVec3) -> Result<Self, MirrorError> {
        let skeleton = clip.skeleton();
        let partner: Vec<_> =
            (0..skeleton.len()).map(|joint| named_partner(skeleton, joint)).collect();
        if partner.iter().enumerate().all(|(joint, &other)| joint == other) {
            return Err(MirrorError::NoNames);
        }
        Self::new(clip, partner, lateral)
    }

    /// Partners by shape: the joints whose places in the clip's first frame lie opposite each
    /// other across the plane through the root (within a tenth of the skeleton's size).
    ///
    /// # Errors
    /// A joint off the plane with nothing opposite.
    pub fn by_geometry(clip: &Clip, lateral: DVec3) -> Result<Self, MirrorError> {
        Self::new(clip, opposite_partners(clip, lateral)?, lateral)
    }

    /// Partners as given: one index a joint, its own for a joint in the middle.
    ///
    /// # Errors
    /// Partners that do not point at each other, or whose parents are not partners.
    pub fn new(clip: &Clip, partner: Vec<usize>, lateral: DVec3) -> Result<Self, MirrorError> {
        let skeleton = clip.skeleton();
        let name = |joint: usize| skeleton.joints()[joint].name.clone();
        for joint in 0..skeleton.len() {
            let other = partner.get(joint).copied().filter(|&other| other < skeleton.len());
            let other = other.ok_or_else(|| MirrorError::NoPartner(name(joint)))?;
            if partner.get(other) != Some(&joint) {
                return Err(MirrorError::NoPartner(name(joint)));
            }
            let parent = |joint: usize| skeleton.joints()[joint].parent;
            if parent(joint).map(|p| partner[p]) != parent(other) {
                return Err(MirrorError::Parents(name(joint), name(other)));
            }
        }
        let normal = lateral.try_normalize().ok_or(MirrorError::Lateral)?;
        let world = reflection(normal);
        let mut local = vec![world; skeleton.len()];
        for joint in 0..skeleton.len() {
            let parent = skeleton.joints()[joint].parent.map_or(world, |p| local[p]);
            // Partners must share one reflection, or mirroring twice would not be the identity.
            local[joint] = if partner[joint] < joint {
                local[partner[joint]]
            } else {
                local_reflection(clip, &partner, joint, world, parent)
            };
        }
        Ok(Self { skeleton: skeleton.clone(), partner, world, local })
    }

    /// One index a joint: its partner, or itself.
    pub fn partners(&self) -> &[usize] {
        &self.partner
    }

    /// The mirrored clip, on the same skeleton.
    ///
    /// # Errors
    /// A clip of another skeleton.
    pub fn apply(&self, clip: &Clip) -> Result<Clip, MirrorError> {
        if *clip.skeleton() != self.skeleton {
            return Err(MirrorError::OtherSkeleton);
        }
        let joints = self.skeleton.joints();
        let outer = |joint: usize| joints[joint].parent.map_or(self.world, |p| self.local[p]);
        let outers: Vec<_> = (0..joints.len()).map(outer).collect();
        let mut rotations = Vec::with_capacity(clip.frames() * joints.len());
        let mut translations = Vec::with_capacity(clip.frames() * clip.moving().len());
        for frame in 0..clip.frames() {
            let source = clip.rotations(frame);
            rotations.extend((0..joints.len()).map(|joint| {
                sandwich(outers[joint], source[self.partner[joint]], self.local[joint])
            }));
            let moved = clip.translations(frame);
            translations.extend(clip.moving().iter().map(|&joint| {
                let other = self.partner[joint];
                let at = clip.moving().binary_search(&other);
                outers[joint] * at.map_or(joints[other].offset, |at| moved[at])
            }));
        }
        let moving = clip.moving().to_vec();
        let mirrored =
            Clip::new(self.skeleton.clone(), clip.frame_time(), moving, translations, rotations);
        Ok(mirrored.expect("reflecting a clip leaves its counts and its finite numbers"))
    }
}

/// The reflection through the plane with this unit normal.
fn reflection(normal: DVec3) -> DMat3 {
    let outer = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
    DMat3::IDENTITY - outer * 2.0
}

/// The rotation a·q·b of two reflections around a rotation.
fn sandwich(a: DMat3, q: DQuat, b: DMat3) -> DQuat {
    if a == b {
        // A·R(axis, angle)·A turns about the reflected axis the other way round.
        let axis = a * DVec3::new(-q.x, -q.y, -q.z);
        return DQuat::from_xyzw(axis.x, axis.y, axis.z, q.w);
    }
    DQuat::from_mat3(&(a * DMat3::from_quat(q) * b))
}

fn named_partner(skeleton: &Skeleton, joint: usize) -> usize {
    let name = &skeleton.joints()[joint].name;
    let swapped = |from: &str, to: &str| {
        let there = name.contains(from).then(|| name.replace(from, to));
        there.and_then(|name| skeleton.find(&name))
    };
    let prefixed = |from: &str, to: &str| {
        let rest = name.strip_prefix(from)?;
        skeleton.find(&format!("{to}{rest}"))
    };
    let suffixed = |from: &str, to: &str| {
        let rest = name.strip_suffix(from)?;
        skeleton.find(&format!("{rest}{to}"))
    };
    for (left, right) in [("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT")] {
        if let Some(other) = swapped(left, right).or_else(|| swapped(right, left)) {
            return other;
        }
    }
    for (left, right) in [("_L", "_R"), (".L", ".R"), ("_l", "_r"), (".l", ".r"), ("-L", "-R")] {
        if let Some(other) = suffixed(left, right).or_else(|| suffixed(right, left)) {
            return other;
        }
    }
    for (left, right) in [("L", "R"), ("l", "r")] {
        if let Some(other) = prefixed(left, right).or_else(|| prefixed(right, left)) {
            return other;
        }
    }
    joint
}

/// Partners by place, walking down from the root: children of a middle joint are matched among
/// themselves, children of partners across.
fn opposite_partners(clip: &Clip, lateral: DVec3) -> Result<Vec<usize>, MirrorError> {
    let skeleton = clip.skeleton();
    let normal = lateral.try_normalize().ok_or(MirrorError::Lateral)?;
    let mut pose = Pose::rest(skeleton);
    clip.frame(0, &mut pose);
    let mut global = vec![Transform::IDENTITY; skeleton.len()];
    pose.to_global(skeleton, &mut global);
    let place = |joint: usize| (global[joint].translation - global[0].translation).as_dvec3();
    let size = (0..skeleton.len()).map(|j| place(j).length()).fold(0.0, f64::max);
    let mirror = reflection(normal);
    let mut partner = vec![usize::MAX; skeleton.len()];
    partner[0] = 0;
    for joint in 0..skeleton.len() {
        if partner[joint] == usize::MAX {
            return Err(MirrorError::NoPartner(skeleton.joints()[joint].name.clone()));
        }
        let other = partner[joint];
        for child in skeleton.children(joint) {
            if partner[child] != usize::MAX {
                continue;
            }
            let distance = |&candidate: &usize| (mirror * place(child)).distance(place(candidate));
            let free = skeleton.children(other).filter(|&c| partner[c] == usize::MAX);
            let best = free.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let best = best.filter(|best| distance(best) <= 0.1 * size);
            let best =
                best.ok_or_else(|| MirrorError::NoPartner(skeleton.joints()[child].name.clone()))?;
            partner[child] = best;
            partner[best] = child;
        }
    }
    Ok(partner)
}

/// The reflection within a joint's frame: of those that take its children's offsets to their
/// partners' (several do when a bone lies along an axis, all do at the end of a chain), the
/// world's if it keeps the joint near its usual rotation, else the one that does so best.
fn local_reflection(
    clip: &Clip,
    partner: &[usize],
    joint: usize,
    world: DMat3,
    parent: DMat3,
) -> DMat3 {
    let skeleton = clip.skeleton();
    let candidates = [world, reflection(DVec3::X), reflection(DVec3::Y), reflection(DVec3::Z)];
    let offset = |joint: usize| skeleton.joints()[joint].offset;
    let miss = |l: &DMat3| -> f64 {
        let children = skeleton.children(joint).filter(|c| clip.moving().binary_search(c).is_err());
        children.map(|c| (*l * offset(c)).distance(offset(partner[c]))).fold(0.0, f64::max)
    };
    let length = skeleton.children(joint).map(|c| offset(c).length()).fold(0.0, f64::max);
    let least = candidates.iter().map(miss).fold(f64::INFINITY, f64::min);
    let mean = |joint: usize| match skeleton.joints()[joint].parent {
        Some(_) => mean_rotation(clip, joint, |_| DQuat::IDENTITY),
        // The root's rotation without its heading: the choice must not depend on where a clip goes.
        None => mean_rotation(clip, joint, |frame| ahead(clip, partner, world, frame)),
    };
    let (own, other) = (mean(joint), mean(partner[joint]));
    let turn = |l: &DMat3| sandwich(parent, other, *l).angle_between(own);
    let fitting = candidates.iter().filter(|l| miss(l) <= least + 0.05 * length);
    let fitting: Vec<_> = fitting.collect();
    let usual = fitting.iter().find(|l| ***l == world && turn(l) <= std::f64::consts::FRAC_PI_2);
    let best = usual.or_else(|| fitting.iter().min_by(|a, b| turn(a).total_cmp(&turn(b))));
    best.map_or(world, |l| **l)
}

/// The rotation that turns a frame's character so that its partners lie across the mirror's plane.
fn ahead(clip: &Clip, partner: &[usize], world: DMat3, frame: usize) -> DQuat {
    let mut places = vec![];
    clip.positions(frame, &mut places);
    let pairs = partner.iter().enumerate().filter(|(joint, other)| joint < other);
    let across: DVec3 = pairs.map(|(joint, &other)| places[joint] - places[other]).sum();
    // What the reflection turns round is the part of a vector along the plane's normal.
    let normal = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis - world * axis);
    let normal = normal
        .into_iter()
        .fold(DVec3::ZERO, |longest, n| if n.length() > longest.length() { n } else { longest });
    match (across.try_normalize(), normal.try_normalize()) {
        (Some(across), Some(normal)) => {
            DQuat::from_rotation_arc(across, normal * across.dot(normal).signum())
        }
        _ => DQuat::IDENTITY,
    }
}

/// The normalised sum of a joint's rotations, each after a turn of its frame, all on the first
/// one's side.
fn mean_rotation(clip: &Clip, joint: usize, turn: impl Fn(usize) -> DQuat) -> DQuat {
    let rotation = |frame: usize| turn(frame) * clip.rotations(frame)[joint];
    let first = rotation(0);
    // A few dozen frames say as much as all of them.
    let frames = (0..clip.frames()).step_by(clip.frames().div_ceil(64));
    let sum = frames.map(rotation).fold(DQuat::from_array([0.0; 4]), |sum, q| {
        if q.dot(first) < 0.0 { sum - q } else { sum + q }
    });
    if sum.length() > 1e-6 { sum.normalize() } else { first }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Joint;

    fn joint(name: &str, parent: Option<usize>, offset: [f64; 3]) -> Joint {
        Joint { name: name.into(), parent, offset: DVec3::from_array(offset), tips: vec![] }
    }

    fn places(clip: &Clip, frame: usize) -> Vec<DVec3> {
        let mut pose = clip.skeleton().rest_pose();
        clip.frame(frame, &mut pose);
        let mut global = vec![Transform::IDENTITY; clip.skeleton().len()];
        pose.to_global(clip.skeleton(), &mut global);
        global.iter().map(|t| t.translation.as_dvec3()).collect()
    }

    /// Every joint of the mirrored clip stands where a mirror shows its partner.
    fn assert_mirrors(clip: &Clip, mirror: &Mirror, tolerance: f64) {
        let mirrored = mirror.apply(clip).unwrap();
        for frame in 0..clip.frames() {
            let (before, after) = (places(clip, frame), places(&mirrored, frame));
            for (joint, place) in after.iter().enumerate() {
                let expected = before[mirror.partners()[joint]] * DVec3::new(-1.0, 1.0, 1.0);
                let name = &clip.skeleton().joints()[joint].name;
                assert!(place.distance(expected) < tolerance, "{name}: {place} is not {expected}");
            }
        }
        let back = mirror.apply(&mirrored).unwrap();
        for (a, b) in back.rotations(0).iter().zip(clip.rotations(0)) {
            assert!(a.angle_between(*b) < 1e-6, "mirroring twice is the identity");
        }
    }

    fn figure(names: [&str; 7]) -> Clip {
        let [hips, spine, left_arm, left_hand, right_arm, right_hand, head] = names;
        let skeleton = Skeleton::new(vec![
            joint(hips, None, [0.0, 0.0, 0.0]),
            joint(spine, Some(0), [0.0, 0.5, 0.1]),
            joint(left_arm, Some(1), [0.2, 0.1, 0.0]),
            joint(left_hand, Some(2), [0.6, 0.0, 0.1]),
            joint(right_arm, Some(1), [-0.2, 0.1, 0.0]),
            joint(right_hand, Some(4), [-0.6, 0.0, 0.1]),
            joint(head, Some(1), [0.0, 0.3, 0.0]),
        ])
        .unwrap();
        let rotation = |i: usize| {
            let a = i as f64;
            DQuat::from_rotation_y(0.3 * a.sin()) * DQuat::from_rotation_z(0.5 * (a * 1.7).cos())
        };
        let rotations = (0..14).map(rotation).collect();
        let places = vec![DVec3::new(0.3, 1.0, 2.0), DVec3::new(0.5, 1.1, 2.0)];
        Clip::new(skeleton, 0.1, vec![0], places, rotations).unwrap()
    }

    #[test]
    fn mirrors_by_every_way_of_naming_and_by_geometry() {
        for names in [
            ["Hips", "Spine", "LeftArm", "LeftHand", "RightArm", "RightHand", "Head"],
            ["m:Hips", "m:Spine", "m:LeftArm", "m:LeftHand", "m:RightArm", "m:RightHand", "m:Head"],
            ["root", "lowerback", "lhumerus", "lhand", "rhumerus", "rhand", "head"],
            ["Hips", "Spine", "LArm", "LHand", "RArm", "RHand", "Head"],
            ["hips", "spine", "arm_L", "hand_L", "arm_R", "hand_R", "head"],
        ] {
            let clip = figure(names);
            let mirror = Mirror::by_name(&clip, DVec3::X).unwrap();
            assert_eq!(mirror.partners(), [0, 1, 4, 5, 2, 3, 6], "{names:?}");
            assert_mirrors(&clip, &mirror, 1e-6);
        }
        let clip = figure(["a", "b", "c", "d", "e", "f", "g"]);
        assert_eq!(Mirror::by_name(&clip, DVec3::X).unwrap_err(), MirrorError::NoNames);
        let upright =
            Clip::new(clip.skeleton().clone(), 0.1, vec![], vec![], vec![DQuat::IDENTITY; 7])
                .unwrap();
        let mirror = Mirror::by_geometry(&upright, DVec3::X).unwrap();
        assert_eq!(mirror.partners(), [0, 1, 4, 5, 2, 3, 6]);
    }

    /// Bandai-Namco's rest pose: every bone lies along +X of its parent's frame.
    #[test]
    fn mirrors_bones_that_lie_along_their_own_axis() {
        let skeleton = Skeleton::new(vec![
            joint("Hips", None, [0.0, 0.0, 0.0]),
            joint("Spine", Some(0), [0.2, 0.0, 0.0]),
            joint("Arm_L", Some(1), [0.2, 0.0, 0.0]),
            joint("Hand_L", Some(2), [0.6, 0.0, 0.0]),
            joint("Arm_R", Some(1), [0.2, 0.0, 0.0]),
            joint("Hand_R", Some(4), [0.6, 0.0, 0.0]),
        ])
        .unwrap();
        // Spine up (+X to +Y), arms to both sides, each bent a little; all frames' Z forward.
        let q = DQuat::from_rotation_z;
        let half = std::f64::consts::FRAC_PI_2;
        let tilt = DQuat::from_rotation_y(0.2);
        let rotations =
            vec![q(half) * tilt, q(0.1), q(-half) * tilt, q(0.3), q(half - 0.2), q(-0.4)];
        let clip = Clip::new(skeleton, 0.1, vec![0], vec![DVec3::Y], rotations).unwrap();
        let mirror = Mirror::by_name(&clip, DVec3::X).unwrap();
        assert_mirrors(&clip, &mirror, 1e-6);
    }

    /// Hips whose children all lie in their own middle (the PFNN's skeleton) fit any reflection: which
    /// one is taken must not depend on where the character walks, or its hips face backwards.
    #[test]
    fn where_a_clip_walks_changes_nothing() {
        let skeleton = Skeleton::new(vec![
            joint("Hips", None, [0.0, 0.0, 0.0]),
            joint("LeftHip", Some(0), [0.0, 0.0, 0.0]),
            joint("LeftFoot", Some(1), [0.1, -0.9, 0.1]),
            joint("RightHip", Some(0), [0.0, 0.0, 0.0]),
            joint("RightFoot", Some(3), [-0.1, -0.9, 0.0]),
        ])
        .unwrap();
        for heading in 0..12 {
            let heading = f64::from(heading) * std::f64::consts::FRAC_PI_6;
            let mut rotations = vec![DQuat::IDENTITY; 5];
            rotations[0] = DQuat::from_rotation_y(heading);
            let clip = Clip::new(skeleton.clone(), 0.1, vec![], vec![], rotations).unwrap();
            let mirrored = Mirror::by_name(&clip, DVec3::X).unwrap().apply(&clip).unwrap();
            let expected = DQuat::from_rotation_y(-heading);
            let off = mirrored.rotations(0)[0].angle_between(expected);
            assert!(off < 1e-6, "heading {heading}: the mirrored hips are {off} rad off");
        }
    }

    #[test]
    fn refuses_partners_that_do_not_fit() {
        let clip =
            figure(["Hips", "Spine", "LeftArm", "LeftHand", "RightArm", "RightHand", "Head"]);
        let refused = |partner| Mirror::new(&clip, partner, DVec3::X).unwrap_err();
        assert!(matches!(refused(vec![0, 1, 4, 3, 2, 5, 6]), MirrorError::Parents(..)));
        assert!(matches!(refused(vec![0, 1, 4, 5, 4, 3, 6]), MirrorError::NoPartner(_)));
        assert!(matches!(refused(vec![0, 1]), MirrorError::NoPartner(_)));
        let lateral = Mirror::by_name(&clip, DVec3::ZERO).unwrap_err();
        assert_eq!(lateral, MirrorError::Lateral);
    }
}
