//! Limbs of two bones: positions in, rotations out. What the controller bends its legs by, and the
//! layers their arms and legs.

use glam::{Quat, Vec3};

/// Sine of the angle between the upper bone and the limb's whole line, below which a bend tells
/// little of where the middle goes: legs are often straight within a network's error, and a knee
/// that is a degree on the wrong side must not be bent on that side when the foot comes nearer.
const STRAIGHT: f32 = 0.1;

/// What a chain a–b–c bends about, a unit vector: b lies to that side of the line from a to c which
/// turning the line about the axis by a right angle points to. `None` for bends of less than a
/// degree: they tell nothing.
pub fn bend_axis(chain: [Vec3; 3]) -> Option<Vec3> {
    let [a, b, c] = chain.map(Vec3::as_dvec3);
    let across = (c - a).cross(b - a);
    let clear = across.length() > 0.01 * (c - a).length() * (b - a).length();
    clear.then(|| across.normalize().as_vec3())
}

/// Turns, in the world, of the upper and the lower bone of a chain a–b–c that bring c to `target`,
/// or as near as it can, in the plane in which it bends already; `hinge` is the axis to bend about
/// when it is straight, and, if that is `sure`, the more so the nearer to straight it is, or bent
/// the wrong way. Numbers that no limb has turn nothing.
pub fn two_bone(chain: [Vec3; 3], target: Vec3, hinge: Vec3, sure: bool) -> [Quat; 2] {
    let [a, b, c] = chain;
    if !is_limb(chain, target) {
        return [Quat::IDENTITY; 2];
    }
    let (upper, lower) = (a.distance(b), b.distance(c));
    let nearest = (upper - lower).abs() + 1e-4;
    let farthest = (upper + lower) * 0.9995;
    let reach = a.distance(target).clamp(nearest.min(farthest), farthest);
    two_bone_to(chain, target, reach, hinge, sure)
}

/// As [`two_bone`], but c comes to the distance `reach` from a, in the direction of `target`. The
/// caller sees to it that two bones can span it.
pub fn two_bone_to(
    chain: [Vec3; 3],
    target: Vec3,
    reach: f32,
    hinge: Vec3,
    sure: bool,
) -> [Quat; 2] {
    let [a, b, c] = chain;
    if !is_limb(chain, target) {
        return [Quat::IDENTITY; 2];
    }
    let (upper, lower) = (a.distance(b), b.distance(c));
    // Law of cosines: the angles at a and at b, as they are and as they must be.
    let opposite = |side: f32, p: f32, q: f32| {
        ((p * p + q * q - side * side) / (2.0 * p * q)).clamp(-1.0, 1.0).acos()
    };
    let now = a.distance(c);
    let at_a = opposite(lower, reach, upper) - opposite(lower, now, upper);
    let at_b = opposite(reach, upper, lower) - opposite(now, upper, lower);
    let across = (c - a).cross(b - a);
    let straight = across.length() < 1e-3 * upper * now;
    let bend = across.dot(hinge) / (upper * now);
    if sure && !straight && bend < STRAIGHT {
        let drawn = (bend / STRAIGHT).max(0.0);
        let axis = (across / (upper * now) / STRAIGHT).lerp(hinge, 1.0 - drawn);
        return toward([a, b, c], target, reach, axis);
    }
    let axis = if straight { hinge.normalize_or(Vec3::X) } else { across.normalize() };
    let swing = Quat::from_rotation_arc((c - a).normalize(), (target - a).normalize());
    let upper = swing * Quat::from_axis_angle(axis, at_a);
    [upper, upper * Quat::from_axis_angle(axis, at_b)]
}

/// Whether bones and target have lengths that can be divided by. Written so that NaN is refused
/// too: clamping needs ordered bounds.
fn is_limb([a, b, c]: [Vec3; 3], target: Vec3) -> bool {
    let long = |length: f32| length > 1e-4 && length.is_finite();
    [a.distance(b), b.distance(c), a.distance(target), a.distance(c)].into_iter().all(long)
}

/// The turns that bring c to `reach` from a, towards `target`, with b on the side that bending
/// about `axis` puts it; the bones twist as little as they can.
fn toward([a, b, c]: [Vec3; 3], target: Vec3, reach: f32, axis: Vec3) -> [Quat; 2] {
    let (upper, lower) = (a.distance(b), b.distance(c));
    let line = (target - a).normalize();
    let pole = axis.cross(line).normalize_or(line.any_orthonormal_vector());
    let along = (upper * upper + reach * reach - lower * lower) / (2.0 * reach);
    let knee = line * along + pole * (upper * upper - along * along).max(0.0).sqrt();
    let first = Quat::from_rotation_arc((b - a) / upper, knee.normalize_or(line));
    let shin = (line * reach - knee).normalize_or(line);
    let second = Quat::from_rotation_arc(first * ((c - b) / lower), shin);
    [first, second * first]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_bend_has_an_axis_and_a_straight_limb_none() {
        let knee = |z| [Vec3::Y, Vec3::new(0.0, 0.5, z), Vec3::ZERO];
        assert!(bend_axis(knee(0.1)).unwrap().abs_diff_eq(Vec3::NEG_X, 1e-6), "knees forward");
        assert!(bend_axis(knee(-0.1)).unwrap().abs_diff_eq(Vec3::X, 1e-6), "hocks back");
        assert_eq!(bend_axis(knee(0.0)), None);
        assert_eq!(bend_axis([Vec3::NAN; 3]), None);
    }

    #[test]
    fn numbers_that_are_none_turn_nothing() {
        for bad in [f32::NAN, f32::INFINITY, 1e38] {
            let far = Vec3::splat(bad);
            for chain in [[far; 3], [Vec3::Y, Vec3::ZERO, far]] {
                assert_eq!(two_bone(chain, far, Vec3::X, true), [Quat::IDENTITY; 2]);
            }
        }
    }

    proptest! {
        #[test]
        fn the_end_arrives_in_the_plane_of_the_bend(
            target in prop::array::uniform3(-0.5..0.5f32), bend in 0.3..2.0f32, sure: bool,
        ) {
            let knee = Vec3::new(0.0, -(bend / 2.0).cos(), (bend / 2.0).sin()) * 0.4;
            let chain = [Vec3::ZERO, knee, Vec3::new(0.0, 2.0 * knee.y, 0.0)];
            let target = Vec3::from_array(target);
            prop_assume!(target.length() > 0.05);
            let [upper, lower] = two_bone(chain, target, Vec3::NEG_X, sure);
            let end = upper * (chain[1] - chain[0]) + lower * (chain[2] - chain[1]);
            let farthest = target.normalize() * target.length().min(0.8 * 0.9995);
            prop_assert!(end.distance(farthest) < 1e-3, "{end}");
        }
    }
}
