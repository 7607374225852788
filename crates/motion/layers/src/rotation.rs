//! Rotations taken apart and held back.

use ambulo_rig::glam::{Quat, Vec3};

/// The shortest turn of one direction to another; none where one of them is no direction.
///
/// glam's own takes directions within 0.04° of each other for the same, which is half a millimetre
/// at the end of a leg.
pub(crate) fn shortest(from: Vec3, to: Vec3) -> Quat {
    let (Some(from), Some(to)) = (from.try_normalize(), to.try_normalize()) else {
        return Quat::IDENTITY;
    };
    let w = 1.0 + from.dot(to);
    if w < 1e-3 {
        return Quat::from_rotation_arc(from, to);
    }
    Quat::from_vec4(from.cross(to).extend(w)).normalize()
}

/// A rotation as a swing of an axis, second, and a twist about it, first.
pub(crate) fn swing_twist(rotation: Quat, axis: Vec3) -> [Quat; 2] {
    let along = axis * rotation.xyz().dot(axis);
    let twist = Quat::from_vec4(along.extend(rotation.w));
    // Swung by half a turn any twist would do.
    let twist = if twist.length_squared() > 1e-12 { twist.normalize() } else { Quat::IDENTITY };
    [rotation * twist.inverse(), twist]
}

/// The quaternion of the same rotation that turns by half a turn at most.
pub(crate) fn shorter(rotation: Quat) -> Quat {
    if rotation.w < 0.0 { -rotation } else { rotation }
}

/// Of a rotation, the shorter way round: 0 to π; precise for small ones, too.
pub(crate) fn angle(rotation: Quat) -> f32 {
    2.0 * rotation.xyz().length().atan2(rotation.w.abs())
}

/// A rotation about the same axis, but by no more than `most` radians.
pub(crate) fn at_most(rotation: Quat, most: f32) -> Quat {
    if angle(rotation) <= most {
        return rotation;
    }
    let axis = rotation.xyz() * rotation.w.signum();
    Quat::from_axis_angle(axis.normalize_or(Vec3::X), most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn small_turns_are_turns() {
        for turn in [1e-5, 1e-3, 1.0, 3.0] {
            let to = Quat::from_rotation_z(turn) * Vec3::X;
            let found = shortest(Vec3::X * 0.2, to * 3.0);
            assert!((angle(found) - turn).abs() < 1e-3 * turn, "{turn}");
            assert!((found * Vec3::X).abs_diff_eq(to, 1e-6), "{turn}");
        }
        assert_eq!(shortest(Vec3::ZERO, Vec3::X), Quat::IDENTITY);
        assert!((shortest(Vec3::X, Vec3::NEG_X) * Vec3::X).abs_diff_eq(Vec3::NEG_X, 1e-6));
    }

    proptest! {
        #[test]
        fn swing_and_twist_make_the_rotation_again(
            turn in prop::array::uniform3(-3.0..3.0f32), most in 0.01..3.0f32,
        ) {
            let rotation = Quat::from_scaled_axis(Vec3::from_array(turn));
            let [swing, twist] = swing_twist(rotation, Vec3::Y);
            prop_assert!(angle(rotation.inverse() * (swing * twist)) < 1e-3);
            prop_assert!(swing.xyz().dot(Vec3::Y).abs() < 1e-4);
            prop_assert!((twist * Vec3::Y).abs_diff_eq(Vec3::Y, 1e-5));
            prop_assert!(angle(at_most(rotation, most)) < most + 1e-3);
        }
    }
}
