//! One foot over the ground: where its ankle goes, and how it and its toes are turned.

use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Skeleton, Terrain, Transform, share};

use crate::foot_hold::{FootState, Grip, Moment};
use crate::foot_placement::FootSettings;
use crate::smooth::{smoothstep, spring};
use crate::two_bone::Limb;

/// How far ahead of a swinging foot the ground is looked at, at most, metres.
const FARTHEST_AHEAD: f32 = 0.5;
/// How far ahead of a foot that starts to swing it is looked at, metres.
const LEAST_AHEAD: f32 = 0.15;
/// How far the heel is raised off its drawn place, and toes are bent down and up, radians; what is
/// missing then, the whole foot is raised.
const MOST_HEEL: [f32; 2] = [0.0, 0.8];
const MOST_TOES: [f32; 2] = [0.5, 1.0];
/// Ground that toes bend down to is not farther below their tip, metres.
const NEAR: f32 = 0.03;
/// Half the width of a foot over which the slope to its side is measured, metres.
const HALF_WIDTH: f32 = 0.04;

/// A foot as it is when it is flat on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Foot {
    pub leg: Limb,
    pub ankle: usize,
    pub toe: usize,
    /// Height of the ball, the joint that the toes turn about, above the ground.
    pub ball: f32,
    /// The way that it points, in the ankle's frame.
    pub forward: Vec3,
    /// From ankle to ball along the ground, metres.
    length: f32,
    /// Lowest point of the heel, in the ankle's frame.
    heel: Vec3,
    /// Lowest point at the tip of the toes, in the toes' frame.
    tip: Vec3,
}

/// Where a foot is to be, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plan {
    pub ankle: Vec3,
    pub rotation: Quat,
    pub toes: Quat,
}

impl Foot {
    /// The foot of a leg in a pose in which it is flat on the ground at height `floor`.
    pub fn flat(
        skeleton: &Skeleton,
        leg: Limb,
        [ankle, toe]: [usize; 2],
        stance: &[Transform],
        floor: f32,
    ) -> Option<Self> {
        let (at, ball) = (stance[ankle], stance[toe]);
        let along = (ball.translation - at.translation).with_y(0.0);
        // The heel reaches about a third as far back from the ankle as the ball lies ahead of it.
        let heel = (at.translation - along * 0.3).with_y(floor);
        let child = skeleton.children(toe).next().map(|tip| skeleton.joints()[tip].offset);
        let tip = skeleton.joints()[toe].tips.first().copied().or(child);
        let tip = tip.map(|tip| ball.transform_point(tip.as_vec3()));
        // Toes without an end are half as long as what is between ankle and ball.
        let tip = tip.unwrap_or(ball.translation + along * 0.5).with_y(floor);
        let foot = Self {
            leg,
            ankle,
            toe,
            ball: (ball.translation.y - floor).max(0.0),
            forward: at.rotation.inverse() * along.normalize_or_zero(),
            length: along.length(),
            heel: at.rotation.inverse() * (heel - at.translation),
            tip: ball.rotation.inverse() * (tip - ball.translation),
        };
        let finite = floor.is_finite() && at.is_finite() && ball.is_finite();
        (finite && foot.tip.is_finite()).then_some(foot)
    }

    /// Where the foot is to be; `None` where the ground is not finite.
    pub fn plan(
        &self,
        state: &mut FootState,
        settings: &FootSettings,
        moment: &Moment<'_>,
        global: &[Transform],
    ) -> Option<Plan> {
        let &Moment { ground, contact, dt, .. } = moment;
        let (ankle, toe) = (global[self.ankle], global[self.toe]);
        let ball = toe.translation;
        let drawn = (ball - ankle.translation).with_y(0.0).normalize_or_zero();
        let heading = self.heading(ankle.rotation);
        self.turn(state, settings, heading, dt);
        let along = turned(state.turn, drawn);
        let first = state.last.is_none();
        let slope = self.slope(settings, ground.terrain, ball + state.shift, along)?;
        let lift = match (ground.level, state.grip) {
            (None, _) => 0.0,
            (Some(level), Grip::Held(place)) => {
                self.support(state, ground.terrain, place, along)? - level
            }
            // Where it is going to land.
            (Some(level), Grip::Stepping(_)) => {
                self.support(state, ground.terrain, ball, along)? - level
            }
            (Some(level), _) => {
                self.soon(state, settings, ground.terrain, ball, along, dt)? - level
            }
        };
        state.last = Some(ball);
        if first {
            (state.lift, state.slope) = (lift, slope);
        }
        let half = settings.ground;
        (state.lift, state.lift_speed) = spring(state.lift, state.lift_speed, lift, half, dt);
        (state.slope, state.slope_speed) = spring(state.slope, state.slope_speed, slope, half, dt);
        let shown = self.hold(state, settings, moment, [ball, along], heading)?;
        state.heading = heading.map_or(state.heading, |heading| heading + state.turn);
        // A motion that follows the terrain has laid the foot on it itself.
        let up = if ground.level.is_some() { Vec3::Y - state.slope } else { Vec3::Y };
        let tilt = Quat::from_rotation_arc(Vec3::Y, up.normalize());
        let arm = ankle.rotation.inverse() * (ankle.translation - ball);
        let planted = smoothstep(settings.hold, 1.0, contact) * (1.0 - state.airborne);
        let yaw = Quat::from_rotation_y(state.turn);
        let drawn = [ankle, toe].map(|joint| {
            tilt * if state.turn == 0.0 { joint.rotation } else { yaw * joint.rotation }
        });
        // A foot that was never seen has nothing to come from.
        let settled = if first { 1.0 } else { share(settings.landing, dt) };
        self.set_down(ground.terrain, shown, arm, drawn, [planted, settled], &mut state.bend)
    }

    /// Height under the ball of the ground that a flat foot at `ball` rests on: the plane of its
    /// slope, raised until neither heel nor toes stick in the ground. On an edge that is the upper
    /// step, over which the rest of the foot hangs.
    pub fn support(
        &self,
        state: &FootState,
        terrain: &dyn Terrain,
        ball: Vec3,
        along: Vec3,
    ) -> Option<f32> {
        let (heel, tip) = (-1.3 * self.length, self.tip.length());
        let mut highest = height(terrain, ball)?;
        for away in [heel, 0.5 * heel, 0.5 * tip, tip] {
            let away = along * away;
            highest = highest.max(height(terrain, ball + away)? - state.slope.dot(away));
        }
        Some(highest)
    }

    /// The same for a foot that swings: here, or where it will soon be, if that is higher, so that
    /// it clears a step before it is in it.
    fn soon(
        &self,
        state: &FootState,
        settings: &FootSettings,
        terrain: &dyn Terrain,
        ball: Vec3,
        along: Vec3,
        dt: f32,
    ) -> Option<f32> {
        let speed = match state.last {
            Some(last) if dt > 0.0 => (ball - last).with_y(0.0) / dt,
            _ => Vec3::ZERO,
        };
        let here = ball + state.shift;
        // A foot that has only just left the ground will be quicker than it is.
        let way = speed * settings.ahead + speed.clamp_length_max(LEAST_AHEAD * 5.0) / 5.0;
        let way = way.clamp_length_max(FARTHEST_AHEAD);
        let mut highest = self.support(state, terrain, here, along)?;
        for away in [0.5 * way, way] {
            let soon = self.support(state, terrain, here + away, along)?;
            highest = highest.max(soon - state.slope.dot(away));
        }
        Some(highest)
    }

    /// Turns a foot and its toes, whose ball is at `shown` and which are `drawn` like that, about
    /// the ball until heel and tip are not underground, as far as they bend; the rest, the whole
    /// foot is raised. The more a foot is `planted`, the more its toes bend down to lie on the ground;
    /// `settled` is the share of the way there, since a network is sure of a foot from one frame to
    /// the next.
    fn set_down(
        &self,
        terrain: &dyn Terrain,
        mut shown: Vec3,
        arm: Vec3,
        drawn: [Quat; 2],
        [planted, settled]: [f32; 2],
        bend: &mut f32,
    ) -> Option<Plan> {
        let [mut rotation, mut toes] = drawn;
        let (flat_heel, flat_tip) = (rotation * (arm + self.heel), toes * self.tip);
        let before = *bend;
        // Twice, for where a turned foot ends the ground may be another.
        for _ in 0..2 {
            let floor = height(terrain, shown + rotation * (arm + self.heel))? - shown.y;
            rotation = raise(flat_heel, flat_heel.y.max(floor), MOST_HEEL) * drawn[0];
            let floor = height(terrain, shown + toes * self.tip)? - shown.y;
            let below = floor - flat_tip.y;
            // Over an edge toes stay as they are.
            let down = planted * (1.0 - smoothstep(NEAR, 2.0 * NEAR, -below));
            let to_ground = elevation(flat_tip, floor).clamp(-MOST_TOES[0], MOST_TOES[1]);
            let wanted = before + ((-to_ground * down).max(0.0) - before) * settled;
            let wanted = wanted.min((-to_ground).max(0.0));
            *bend = wanted;
            toes = lifted(flat_tip, to_ground.max(-wanted)) * drawn[1];
        }
        // On an edge it is the middle of the sole that is in the way.
        let [heel, ball] = [rotation * (arm + self.heel), Vec3::NEG_Y * self.ball];
        for point in [heel, heel.lerp(ball, 0.3), heel.lerp(ball, 0.7), ball, toes * self.tip] {
            shown.y = shown.y.max(height(terrain, shown + point)? - point.y);
        }
        let ankle = shown + rotation * arm;
        ankle.is_finite().then_some(Plan { ankle, rotation, toes })
    }

    /// How steeply the ground rises towards +X and +Z under a foot that points `along`; edges count
    /// as level.
    fn slope(
        &self,
        settings: &FootSettings,
        terrain: &dyn Terrain,
        ball: Vec3,
        along: Vec3,
    ) -> Option<Vec3> {
        let middle = ball - along * (0.5 * self.length);
        let steep = settings.steepest.tan();
        let rise = |way: Vec3, half: f32| -> Option<Vec3> {
            let [ahead, back] = [middle + way * half, middle - way * half];
            let rise = (height(terrain, ahead)? - height(terrain, back)?) / (2.0 * half);
            Some(way * (rise * (1.0 - smoothstep(steep, 1.5 * steep, rise.abs()))))
        };
        Some(rise(along, 0.5 * self.length.max(0.02))? + rise(Vec3::Y.cross(along), HALF_WIDTH)?)
    }
}

/// A direction turned about the vertical; exactly itself where the angle is 0.
fn turned(angle: f32, direction: Vec3) -> Vec3 {
    if angle == 0.0 { direction } else { Quat::from_rotation_y(angle) * direction }
}

pub(crate) fn height(terrain: &dyn Terrain, place: Vec3) -> Option<f32> {
    let height = terrain.height(place.x, place.z);
    height.is_finite().then_some(height)
}

/// By how much the end of `arm` must go up, as seen from its start, to come to the height `to`,
/// radians.
fn elevation(arm: Vec3, to: f32) -> f32 {
    let elevation = |y: f32| (y / arm.length()).clamp(-1.0, 1.0).asin();
    if arm.length() > 0.0 { elevation(to) - elevation(arm.y) } else { 0.0 }
}

/// The turn about a level axis that lifts the end of `arm` by an angle.
fn lifted(arm: Vec3, angle: f32) -> Quat {
    let axis = arm.cross(Vec3::Y).try_normalize();
    axis.map_or(Quat::IDENTITY, |axis| Quat::from_axis_angle(axis, angle))
}

/// The turn that brings the end of `arm` to the height `to`, or as near as the angles down and up
/// allow.
fn raise(arm: Vec3, to: f32, [down, up]: [f32; 2]) -> Quat {
    lifted(arm, elevation(arm, to).clamp(-down, up))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_is_raised_as_far_as_it_may() {
        let arm = Vec3::new(0.3, 0.0, -0.4);
        let up = raise(arm, 0.25, [0.0, 1.0]) * arm;
        assert!(up.abs_diff_eq(Vec3::new(0.3, 0.0, -0.4) * 0.75f32.sqrt() + Vec3::Y * 0.25, 1e-5));
        assert_eq!(raise(arm, -0.2, [0.0, 1.0]) * arm, arm);
        let most = raise(arm, 0.5, [0.0, 0.3]) * arm;
        assert!((most.y - 0.5 * 0.3f32.sin()).abs() < 1e-5);
        assert_eq!(raise(Vec3::Y, 0.3, [1.0, 1.0]), Quat::IDENTITY, "straight up has no side");
    }
}
