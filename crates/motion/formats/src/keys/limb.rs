//! Two bones that reach for a place.

use ambulo_rig::Joint;
use ambulo_rig::glam::{DQuat, DVec3};

use super::figure::Limb;

/// Where a limb's end is to be.
pub(super) struct Goal {
    /// 0 leaves the limb as it is, 1 places it.
    pub weight: f64,
    /// Of the grip, in the world.
    pub at: DVec3,
    /// Of the last joint, in the world.
    pub facing: DQuat,
    /// Radians about the line from the limb's start to its end.
    pub swivel: f64,
    /// In the upper joint's frame, about which the middle one bends.
    pub hinge: DVec3,
}

/// Share of the limb's length that it is stretched to at most: a straight limb has no plane.
const STRETCH: f64 = 0.9995;

/// Bends a limb to its goal. `places` and `turns` are in the world and, like `local`, one a joint;
/// only `local` is changed. Gives by how much the end stays away from the goal.
pub(super) fn place(
    limb: &Limb,
    joints: &[Joint],
    goal: &Goal,
    places: &[DVec3],
    turns: &[DQuat],
    local: &mut [DQuat],
) -> f64 {
    let [upper, lower, end] = limb.joints;
    let facing = turns[end].slerp(goal.facing, goal.weight);
    let grip = (places[end] + turns[end] * limb.grip).lerp(goal.at, goal.weight);
    let wanted = grip - facing * limb.grip;

    let start = places[upper];
    let (long, short) = (joints[lower].offset.length(), joints[end].offset.length());
    let away = wanted - start;
    let most = (long + short) * STRETCH;
    let far = away.length().clamp(((long - short).abs() / STRETCH).min(most), most);
    let along = away.try_normalize().unwrap_or(DVec3::NEG_Y);
    let reached = start + along * far;

    // The limb as its angles have it, swung as a whole towards the goal.
    let before = (places[end] - start).try_normalize().unwrap_or(along);
    let swing = DQuat::from_rotation_arc(before, along);
    let twist = DQuat::from_axis_angle(along, goal.swivel * goal.weight);
    let swung = twist * swing;
    let knee = swung * (places[lower] - start);
    let shin = swung * (places[end] - places[lower]);
    let out = knee - along * knee.dot(along);
    let hinge = swung * turns[upper] * goal.hinge;
    let out = if out.length() > 1e-3 * long { out } else { shin.cross(hinge) };
    let out = out - along * out.dot(along);
    let out = out.try_normalize().unwrap_or_else(|| along.any_orthonormal_vector());

    let part = (long * long - short * short + far * far) / (2.0 * far.max(1e-9));
    let bend = (long * long - part * part).max(0.0).sqrt();
    let bent = along * part + out * bend;
    let arc = |from: DVec3, to: DVec3| match (from.try_normalize(), to.try_normalize()) {
        (Some(from), Some(to)) => DQuat::from_rotation_arc(from, to),
        _ => DQuat::IDENTITY,
    };
    let first = arc(knee, bent);
    let upper_turn = first * swung * turns[upper];
    let second = arc(first * shin, reached - start - bent);
    let lower_turn = second * first * swung * turns[lower];

    let outer = joints[upper].parent.map_or(DQuat::IDENTITY, |parent| turns[parent]);
    local[upper] = (outer.inverse() * upper_turn).normalize();
    local[lower] = (upper_turn.inverse() * lower_turn).normalize();
    local[end] = (lower_turn.inverse() * facing).normalize();
    reached.distance(wanted)
}
