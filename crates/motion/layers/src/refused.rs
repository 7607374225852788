//! Why a layer did not take what it was given.

use ambulo_rig::{Pose, Transform};

use crate::Mask;

/// Metres; farther from its parent (a root: from the origin) no joint is, and differences and their
/// speeds stay numbers.
const FARTHEST: f32 = 1e7;

/// What was wrong with the input of a layer, which then changed neither its state nor its output.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum Refused {
    #[error("{got} joints where {expected} were expected")]
    Joints { expected: usize, got: usize },
    #[error(
        "joint {joint}: a number is not finite, a translation is longer than 10,000 km or a \
         rotation is not a unit quaternion"
    )]
    Joint { joint: usize },
    #[error("{0} s is not a time that can be stepped")]
    Time(f32),
    #[error("{0} cannot be used as a weight, a speed or a parameter")]
    Number(f32),
    #[error("{got} numbers where {expected} were expected")]
    Count { expected: usize, got: usize },
}

/// Whether a pose has so many joints, each of which can be calculated with.
pub(crate) fn check(pose: &Pose, joints: usize) -> Result<(), Refused> {
    counted(joints, pose.local.len())?;
    match pose.local.iter().position(|joint| !usable(joint)) {
        Some(joint) => Err(Refused::Joint { joint }),
        None => Ok(()),
    }
}

/// Whether a mask, if there is one, has so many joints.
pub(crate) fn check_mask(mask: Option<&Mask>, joints: usize) -> Result<(), Refused> {
    mask.map_or(Ok(()), |mask| counted(joints, mask.weights().len()))
}

/// Whether a number lies within bounds; NaN does not.
pub(crate) fn check_number(number: f32, least: f32, most: f32) -> Result<(), Refused> {
    if (least..=most).contains(&number) { Ok(()) } else { Err(Refused::Number(number)) }
}

fn counted(expected: usize, got: usize) -> Result<(), Refused> {
    if expected == got { Ok(()) } else { Err(Refused::Joints { expected, got }) }
}

// Written so that NaN fails.
fn usable(joint: &Transform) -> bool {
    joint.translation.abs().cmplt(ambulo_rig::glam::Vec3::splat(FARTHEST)).all()
        && (joint.rotation.length_squared() - 1.0).abs() < 0.01
}

#[cfg(test)]
mod tests {
    use super::*;
    use ambulo_rig::glam::{Quat, Vec3};

    #[test]
    fn broken_joints_are_named() {
        let with = |joint| Pose { local: vec![Transform::IDENTITY, joint] };
        assert_eq!(check(&with(Transform::IDENTITY), 2), Ok(()));
        assert_eq!(
            check(&with(Transform::IDENTITY), 3),
            Err(Refused::Joints { expected: 3, got: 2 })
        );
        for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
            for bad in [
                Transform::new(Vec3::new(0.0, number, 0.0), Quat::IDENTITY),
                Transform::new(Vec3::ZERO, Quat::from_xyzw(0.0, number, 0.0, 1.0)),
                Transform::new(Vec3::ZERO, Quat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
            ] {
                assert_eq!(check(&with(bad), 2), Err(Refused::Joint { joint: 1 }), "{bad:?}");
            }
            assert!(check_number(number, -1.0, 1.0).is_err());
        }
    }
}
