//! How far joints may turn.

use ambulo_rig::glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

use crate::rotation::{angle, at_most, swing_twist};

/// How far a joint may turn from the pose that the chain is made from, radians. A joint that the
/// motion itself turns farther is left there, but goes no farther.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointLimit {
    /// Of the bone from its direction.
    pub cone: f32,
    /// About the bone, either way.
    pub twist: f32,
}

impl JointLimit {
    /// No limit at all.
    pub const FREE: Self = Self { cone: std::f32::consts::PI, twist: std::f32::consts::PI };
}

/// One joint that turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Link {
    pub joint: usize,
    /// Local rotation that the limit is measured from, and the bone's direction in its frame.
    pub rest: Quat,
    pub bone: Vec3,
    pub limit: JointLimit,
}

impl Link {
    /// A local rotation within the limit, or as far as `drawn` has it.
    pub fn limited(&self, drawn: Quat, wanted: Quat) -> Quat {
        let JointLimit { cone, twist } = self.limit;
        if self.limit == JointLimit::FREE {
            return wanted;
        }
        let split = |local: Quat| swing_twist(self.rest.inverse() * local, self.bone);
        let [drawn_swing, drawn_twist] = split(drawn);
        let [swing, turn] = split(wanted);
        let swing = at_most(swing, cone.max(angle(drawn_swing)));
        self.rest * swing * at_most(turn, twist.max(angle(drawn_twist)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn swing_and_twist_are_held_back_on_their_own() {
        let (rest, bone) = (Quat::from_rotation_x(0.9), Vec3::Y);
        let limit = JointLimit { cone: 0.5, twist: 0.2 };
        let link = Link { joint: 0, rest, bone, limit };
        let at = |swing, twist| rest * Quat::from_rotation_z(swing) * Quat::from_rotation_y(twist);
        let same = |a: Quat, b: Quat| angle(a.inverse() * b) < 1e-3;
        assert!(same(link.limited(rest, at(0.4, -0.1)), at(0.4, -0.1)));
        assert!(same(link.limited(rest, at(0.8, -0.1)), at(0.5, -0.1)));
        assert!(same(link.limited(rest, at(0.4, -1.0)), at(0.4, -0.2)));
        assert!(same(link.limited(at(-0.7, 0.0), at(0.8, 0.3)), at(0.7, 0.2)), "as far as drawn");
    }
}
