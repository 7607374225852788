//! One foot over the ground: where its ankle goes, and how it and its toes are turned.

use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Skeleton, Terrain, Transform};

use crate::foot_placement::{FootSettings, Ground};
use crate::smooth::{smoothstep, spring};
use crate::two_bone::Limb;
use ambulo_rig::share;

/// How far ahead of a swinging foot the ground is looked at, at most, metres.
const FARTHEST_AHEAD: f32 = 0.5;
/// How far ahead of a foot that starts to swing it is looked at, metres.
const LEAST_AHEAD: f32 = 0.15;
/// A held foot that the motion has this far above or below is let go, metres.
const LEASH_UP: f32 = 0.5;
/// Half-life in seconds by which a held foot creeps to where the motion has it: nothing within a
/// step (0.7 mm a frame at 60 Hz at most), but whoever stands ends in the motion's stance.
const CREEP: f32 = 2.0;
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
    ball: f32,
    /// From ankle to ball along the ground, metres.
    length: f32,
    /// Lowest point of the heel, in the ankle's frame.
    heel: Vec3,
    /// Lowest point at the tip of the toes, in the toes' frame.
    tip: Vec3,
}

/// Whether a foot is held, and where its ball is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Grip {
    #[default]
    Free,
    Held(Vec3),
    /// Left behind while in contact: not held again before it has been off the ground.
    Lost,
}

/// What a foot remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FootState {
    grip: Grip,
    /// From where the motion has the ball, raised with the ground, to where it is shown.
    shift: Vec3,
    /// Of the ground over the level, metres, and its speed.
    lift: f32,
    lift_speed: f32,
    /// How steeply the ground under it rises towards +X and +Z, and its speed.
    slope: Vec3,
    slope_speed: Vec3,
    /// Where the motion had the ball.
    last: Option<Vec3>,
}

impl FootState {
    pub fn is_held(&self) -> bool {
        matches!(self.grip, Grip::Held(_))
    }
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
        contact: f32,
        ground: &Ground<'_>,
        dt: f32,
        global: &[Transform],
    ) -> Option<Plan> {
        let (ankle, toe) = (global[self.ankle], global[self.toe]);
        let ball = toe.translation;
        let along = (ball - ankle.translation).with_y(0.0).normalize_or_zero();
        let first = state.last.is_none();
        let slope = self.slope(settings, ground.terrain, ball + state.shift, along)?;
        let lift = match (ground.level, state.grip) {
            (None, _) => 0.0,
            (Some(level), Grip::Held(place)) => {
                self.support(state, ground.terrain, place, along)? - level
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
        let shown = self.hold(state, settings, ground.terrain, [ball, along], contact, dt)?;
        // A motion that follows the terrain has laid the foot on it itself.
        let up = if ground.level.is_some() { Vec3::Y - state.slope } else { Vec3::Y };
        let tilt = Quat::from_rotation_arc(Vec3::Y, up.normalize());
        let arm = ankle.rotation.inverse() * (ankle.translation - ball);
        let planted = smoothstep(settings.hold, 1.0, contact);
        let drawn = [tilt * ankle.rotation, tilt * toe.rotation];
        self.set_down(ground.terrain, shown, arm, drawn, planted)
    }

    /// Where the ball is shown: held, on its way back to the motion, or there; never underground.
    fn hold(
        &self,
        state: &mut FootState,
        settings: &FootSettings,
        terrain: &dyn Terrain,
        [ball, along]: [Vec3; 2],
        contact: f32,
        dt: f32,
    ) -> Option<Vec3> {
        let drawn = ball + Vec3::Y * state.lift;
        state.shift -= state.shift * share(settings.release, dt);
        let far = |place: Vec3| {
            let away = drawn - place;
            away.with_y(0.0).length() >= settings.leash || away.y.abs() >= LEASH_UP
        };
        state.grip = match state.grip {
            _ if contact < settings.let_go => Grip::Free,
            // Taking hold where the foot is shown, not where the motion has it, leaves no jump.
            Grip::Free if contact >= settings.hold => Grip::Held(drawn + state.shift),
            Grip::Held(place) if far(place) => Grip::Lost,
            Grip::Held(place) => Grip::Held(place + (drawn - place).with_y(0.0) * share(CREEP, dt)),
            grip => grip,
        };
        if let Grip::Held(mut place) = state.grip {
            let floor = self.support(state, terrain, place, along)? + self.ball;
            place.y = floor + (place.y - floor).max(0.0) * (1.0 - share(settings.landing, dt));
            state.shift = place - drawn;
            state.grip = Grip::Held(place);
        }
        let shown = drawn + state.shift;
        Some(shown.with_y(shown.y.max(height(terrain, shown)? + self.ball)))
    }

    /// Height under the ball of the ground that a flat foot at `ball` rests on: the plane of its
    /// slope, raised until neither heel nor toes stick in the ground. On an edge that is the upper
    /// step, over which the rest of the foot hangs.
    fn support(
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
    /// foot is raised. The more a foot is `planted`, the more its toes lie on the ground.
    fn set_down(
        &self,
        terrain: &dyn Terrain,
        mut shown: Vec3,
        arm: Vec3,
        drawn: [Quat; 2],
        planted: f32,
    ) -> Option<Plan> {
        let [mut rotation, mut toes] = drawn;
        let (flat_heel, flat_tip) = (rotation * (arm + self.heel), toes * self.tip);
        // Twice, for where a turned foot ends the ground may be another.
        for _ in 0..2 {
            let floor = height(terrain, shown + rotation * (arm + self.heel))? - shown.y;
            rotation = raise(flat_heel, flat_heel.y.max(floor), MOST_HEEL) * drawn[0];
            let floor = height(terrain, shown + toes * self.tip)? - shown.y;
            let below = floor - flat_tip.y;
            // Over an edge toes stay as they are.
            let down = below * planted * (1.0 - smoothstep(NEAR, 2.0 * NEAR, -below));
            toes = raise(flat_tip, flat_tip.y + below.max(down), MOST_TOES) * drawn[1];
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

fn height(terrain: &dyn Terrain, place: Vec3) -> Option<f32> {
    let height = terrain.height(place.x, place.z);
    height.is_finite().then_some(height)
}

/// The turn about a level axis that brings the end of `arm` to the height `to`, or as near as the
/// angles down and up allow.
fn raise(arm: Vec3, to: f32, [down, up]: [f32; 2]) -> Quat {
    let Some(axis) = arm.cross(Vec3::Y).try_normalize() else { return Quat::IDENTITY };
    let elevation = |y: f32| (y / arm.length()).clamp(-1.0, 1.0).asin();
    Quat::from_axis_angle(axis, (elevation(to) - elevation(arm.y)).clamp(-down, up))
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
