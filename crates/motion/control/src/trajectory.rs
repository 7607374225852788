//! The path around a character: where it was, where it is, where it means to go.

use ambulo_features::gait::{CROUCH, JOG, JUMP, RUN, STAND, WALK};
use ambulo_features::{FUTURE, GAITS, Ground, Output, Point, SAMPLES, WINDOW};
use ambulo_rig::glam::{Quat, Vec2, Vec3};

use crate::idle::{Idle, Wish};
use crate::{Areas, Gait, Intent, Tuning, World};
use ambulo_rig::share;

/// Points of the window: one a frame, a second each way.
pub const WINDOW_POINTS: usize = 2 * WINDOW;

/// Index of the present among them.
pub const NOW: usize = WINDOW;

/// Frames from one of the network's samples to the next.
const STRIDE: usize = WINDOW_POINTS / SAMPLES;

/// Distance of the side samples of the ground from the path.
const SIDE: f32 = 0.25;

// Metres a second between which `Gait::Auto` goes from walking to jogging, and on to running.
const TO_JOG: [f32; 2] = [1.9, 2.3];
const TO_RUN: [f32; 2] = [3.6, 4.2];

/// Below this asked speed (metres a second; 0.1 cm a frame at 60 Hz) a character stands.
const STANDING: f32 = 0.06;

/// Half-life in seconds of what the feet take off the root's movement.
const CARRY_HALFLIFE: f32 = 0.02;

/// One moment of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrajectoryPoint {
    /// On the ground, metres.
    pub position: Vec3,
    /// Facing on the ground plane (x, z), a unit vector.
    pub direction: Vec2,
    /// Shares of the gaits, in the order of [`GAITS`].
    pub gait: [f32; GAITS.len()],
    /// Mean height of the ground along the window when this was the present.
    pub height: f32,
}

impl TrajectoryPoint {
    /// The place on the ground plane (x, z), metres.
    pub fn ground(&self) -> Vec2 {
        Vec2::new(self.position.x, self.position.z)
    }

    /// Where a root here stands: the place, at the window's mean height.
    pub fn root(&self) -> Vec3 {
        Vec3::new(self.position.x, self.height, self.position.z)
    }

    /// From the frame of a root here to the world.
    pub fn rotation(&self) -> Quat {
        Quat::from_rotation_y(yaw(self.direction))
    }

    fn set_ground(&mut self, ground: Vec2) {
        (self.position.x, self.position.z) = (ground.x, ground.y);
    }

    /// A direction or an offset (x left, y forward) of this frame, in the world.
    fn outward(&self, inner: Vec2) -> Vec2 {
        let forward = self.direction;
        Vec2::new(forward.y, -forward.x) * inner.x + forward * inner.y
    }

    /// The inverse of `outward`.
    fn inward(&self, outer: Vec2) -> Vec2 {
        let forward = self.direction;
        Vec2::new(Vec2::new(forward.y, -forward.x).dot(outer), forward.dot(outer))
    }
}

/// Yaw of a direction on the ground plane: 0 along +Z, positive towards +X.
pub fn yaw(direction: Vec2) -> f32 {
    direction.x.atan2(direction.y)
}

/// The direction that lies `t` of the way from one to the other, the shorter way round.
fn turn(from: Vec2, to: Vec2, t: f32) -> Vec2 {
    from.rotate(Vec2::from_angle(from.angle_to(to) * t)).normalize_or(to)
}

#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    points: [TrajectoryPoint; WINDOW_POINTS],
    velocity: Vec2,
    facing: Vec2,
    strafe: f32,
    crouch: f32,
    /// Of the last step, metres a second.
    moved: Vec2,
    /// What the feet added to it.
    carried: Vec2,
    idle: Idle,
    sway: Option<Wish>,
    speed: SpeedGain,
}

/// A clamped integrator that makes up for a network which moves slower or faster than its
/// trajectory asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SpeedGain {
    /// On the asked velocity.
    factor: f32,
    /// Asked one step ago: what the last step could answer to.
    told: Vec2,
    /// Velocities, metres a second, smoothed alike so that a start is not taken for a lag.
    asked: Vec2,
    reached: Vec2,
}

impl SpeedGain {
    const STANDING: Self =
        Self { factor: 1.0, told: Vec2::ZERO, asked: Vec2::ZERO, reached: Vec2::ZERO };

    fn follow(&mut self, asked: Vec2, moved: Vec2, tuning: &Tuning, dt: f32) {
        // Four times quicker than the integrator: the loop of both is critically damped.
        let smooth = share(tuning.speed_halflife / 4.0, dt);
        self.asked = self.asked.lerp(self.told, smooth);
        self.told = asked;
        self.reached = self.reached.lerp(moved, smooth);
        let speed = self.asked.length();
        if asked.length() < STANDING || speed < STANDING {
            self.factor = 1.0;
            return;
        }
        // In a steady turn the movement trails the wish; that is no lack of speed.
        let along = self.reached.dot(self.asked) > 0.0;
        let lag = 1.0 - if along { self.reached.length() / speed } else { 0.0 };
        let [least, most] = tuning.speed_limit;
        self.factor = (self.factor + lag * share(tuning.speed_halflife, dt)).clamp(least, most);
    }
}

impl Trajectory {
    /// Standing still for a second at a place, facing a unit vector.
    pub fn standing(place: Vec2, facing: Vec2, world: &World<'_>) -> Self {
        let height = world.terrain.height(place.x, place.y);
        let mut gait = [0.0; GAITS.len()];
        gait[STAND] = 1.0;
        let position = Vec3::new(place.x, height, place.y);
        let point = TrajectoryPoint { position, direction: facing, gait, height };
        let points = [point; WINDOW_POINTS];
        Self {
            points,
            velocity: Vec2::ZERO,
            facing,
            strafe: 0.0,
            crouch: 0.0,
            moved: Vec2::ZERO,
            carried: Vec2::ZERO,
            idle: Idle::default(),
            sway: None,
            speed: SpeedGain::STANDING,
        }
    }

    /// How the character is asked to stand, if it is.
    pub fn sway(&self) -> Option<Wish> {
        self.sway
    }

    pub fn points(&self) -> &[TrajectoryPoint; WINDOW_POINTS] {
        &self.points
    }

    pub fn now(&self) -> &TrajectoryPoint {
        &self.points[NOW]
    }

    /// The moment before now, in whose frame the joints are told to the network.
    pub fn before(&self) -> &TrajectoryPoint {
        &self.points[NOW - 1]
    }

    /// Follows an intent by one step of `dt`: smooths the wishes, sets the gait, bends the future.
    pub fn follow(&mut self, intent: &Intent, tuning: &Tuning, world: &World<'_>, dt: f32) {
        self.smooth(intent, tuning, dt);
        self.speed.follow(self.velocity, self.moved, tuning, dt);
        self.set_gait(intent.gait, share(tuning.gait_halflife, dt));
        self.bend_future(tuning, world.areas, dt);
        self.enter_areas(world.areas);
        self.drop_to_ground(world);
    }

    fn smooth(&mut self, intent: &Intent, tuning: &Tuning, dt: f32) {
        self.velocity = self.velocity.lerp(intent.velocity, share(tuning.velocity_halflife, dt));
        self.strafe += (intent.strafe - self.strafe) * share(tuning.strafe_halflife, dt);
        let crouch = if intent.gait == Gait::Crouch { 1.0 } else { 0.0 };
        self.crouch += (crouch - self.crouch) * share(tuning.crouch_halflife, dt);
        let moving = self.velocity.length() > 1e-5;
        let along = if moving { self.velocity.normalize() } else { self.facing };
        let asked = intent.facing.map_or(along, |facing| facing.normalize());
        let goal = turn(along, asked, self.strafe);
        self.facing = turn(self.facing, goal, share(tuning.facing_halflife, dt));
    }

    fn set_gait(&mut self, gait: Gait, share: f32) {
        let mut goal = [0.0; GAITS.len()];
        let speed = self.velocity.length();
        if speed < STANDING {
            goal[STAND] = 1.0 - speed / STANDING;
        } else if self.crouch > 0.1 {
            goal[CROUCH] = self.crouch;
        } else {
            [goal[WALK], goal[JOG], goal[RUN]] = paces(gait, speed);
        }
        for (value, goal) in self.points[NOW].gait.iter_mut().zip(goal) {
            *value += (goal - *value) * share;
        }
    }

    /// Mixes what the network foresaw with what is asked, more of the latter the farther ahead.
    fn bend_future(&mut self, tuning: &Tuning, areas: &Areas, dt: f32) {
        let mix = |[plain, strafing]: [f32; 2]| plain + (strafing - plain) * self.strafe;
        let (position_bias, facing_bias) = (mix(tuning.position_bias), mix(tuning.facing_bias));
        let velocity = self.velocity * (self.speed.factor * dt);
        let (facing, gait) = (self.facing, self.points[NOW].gait);
        let mut foreseen = self.points[NOW].ground();
        let stands = gait[STAND] > 0.5;
        let direction = self.points[NOW].direction;
        self.sway = self.idle.follow(stands, foreseen, direction, tuning.sway, dt);
        for index in NOW + 1..WINDOW_POINTS {
            let t = (index - NOW) as f32 / WINDOW as f32;
            let toward = |bias: f32| 1.0 - (1.0 - t).powf(bias);
            let before = self.points[index - 1].ground();
            let point = &mut self.points[index];
            let step = point.ground() - foreseen;
            foreseen = point.ground();
            let wished = match self.sway {
                Some(wish) => velocity + wish.velocity((index - NOW) as f32 * dt) * dt,
                None => velocity,
            };
            let place = before + step.lerp(wished, toward(position_bias));
            point.set_ground(areas.keep_out(place));
            point.direction = turn(point.direction, facing, toward(facing_bias));
            point.gait = gait;
        }
    }

    fn enter_areas(&mut self, areas: &Areas) {
        for point in &mut self.points[NOW..] {
            point.gait[JUMP] = areas.jump(point.position);
            let crouch = areas.crouch(point.ground());
            if crouch > 0.0 {
                let rest = 1.0 - crouch;
                point.gait[..CROUCH].iter_mut().for_each(|share| *share *= rest);
                point.gait[CROUCH] = point.gait[CROUCH].max(crouch);
            }
        }
    }

    fn drop_to_ground(&mut self, world: &World<'_>) {
        for point in &mut self.points[NOW..] {
            point.position.y = world.terrain.height(point.position.x, point.position.z);
        }
        let samples = self.points.iter().step_by(STRIDE);
        let height = samples.map(|point| point.position.y).sum::<f32>() / SAMPLES as f32;
        self.points[NOW..].iter_mut().for_each(|point| point.height = height);
    }

    /// The network's samples, seen from the present root.
    pub fn sample(
        &self,
        world: &World<'_>,
        trajectory: &mut [Point; SAMPLES],
        ground: &mut [Ground; SAMPLES],
    ) {
        let now = self.now();
        for (sample, point) in self.points.iter().step_by(STRIDE).enumerate() {
            trajectory[sample] = Point {
                position: now.inward(point.ground() - now.ground()),
                direction: now.inward(point.direction),
            };
            let left = point.outward(Vec2::new(SIDE, 0.0));
            let height = |ground: Vec2| world.terrain.height(ground.x, ground.y) - now.height;
            let centre = point.position.y - now.height;
            let [left, right] = [point.ground() + left, point.ground() - left].map(height);
            let mut gait = point.gait;
            // The published demo feeds nothing here either; its network learned it as zero.
            gait[GAITS.len() - 1] = 0.0;
            ground[sample] = Ground { gait, height: [left, centre, right] };
        }
    }

    /// What roots may turn and move by, 0 to 1: nothing while standing, unless the tuning lets them.
    pub fn freedom(&self, tuning: &Tuning) -> f32 {
        let published = (1.0 - self.now().gait[STAND]).clamp(0.0, 1.0).powf(0.25);
        published + (1.0 - published) * tuning.stand_freedom
    }

    /// Of the root in the step before, as the network has it, metres a second.
    pub fn speed(&self) -> f32 {
        (self.moved - self.carried).length()
    }

    /// Moves the present and the future by what the feet say; part of the step that came before.
    pub fn carry(&mut self, shift: Vec2, areas: &Areas, dt: f32) {
        // Softly: contacts come and go within a frame or two, and a root that follows them jerks.
        self.carried = self.carried.lerp(shift / dt, share(CARRY_HALFLIFE, dt));
        if self.carried == Vec2::ZERO {
            return;
        }
        let shift = self.carried * dt;
        let before = self.now().ground();
        for point in &mut self.points[NOW..] {
            point.set_ground(areas.keep_out(point.ground() + shift));
        }
        // A wall may have had the last word.
        self.carried = (self.now().ground() - before) / dt;
    }

    /// Moves on by one step: the past shifts, the root goes where the network sends it, and the
    /// future becomes what the network foresees.
    pub fn advance(&mut self, output: &Output, tuning: &Tuning, areas: &Areas, dt: f32) {
        let freedom = self.freedom(tuning);
        self.points.copy_within(1..=NOW, 0);
        let now = &mut self.points[NOW];
        let step = now.outward(output.root_velocity * (dt * freedom));
        // A stander's root is led, not only asked: its network has little to say about standing.
        let stands = now.gait[STAND];
        let step = self.sway.map_or(step, |wish| step.lerp(wish.velocity(0.0) * dt, stands));
        let moved = now.ground() + step;
        let before = now.ground();
        now.set_ground(areas.keep_out(moved));
        self.moved = (now.ground() - before) / dt + self.carried;
        let turned = yaw(now.direction) + output.yaw_rate * dt * freedom;
        now.direction = Vec2::new(turned.sin(), turned.cos());
        let now = *now;
        for (ahead, point) in self.points[NOW + 1..].iter_mut().enumerate() {
            let at = (ahead + 1) as f32 / STRIDE as f32;
            // Past the last sample the last two go on.
            let sample = (at as usize).min(FUTURE - 2);
            let t = at - sample as f32;
            let (a, b) = (output.trajectory[sample], output.trajectory[sample + 1]);
            point.set_ground(now.ground() + now.outward(a.position.lerp(b.position, t)));
            let direction = a.direction.lerp(b.direction, t);
            point.direction = now.outward(direction).normalize_or(now.direction);
        }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let points = self.points.iter();
        let mut finite = points.map(|p| p.position.is_finite() && p.direction.is_finite());
        finite.all(|finite| finite)
            && self.velocity.is_finite()
            && self.facing.is_finite()
            && self.moved.is_finite()
            && self.speed.reached.is_finite()
    }
}

/// Shares of walking, jogging and running at a speed in metres a second.
fn paces(gait: Gait, speed: f32) -> [f32; 3] {
    let past = |[from, to]: [f32; 2]| ((speed - from) / (to - from)).clamp(0.0, 1.0);
    match gait {
        Gait::Walk | Gait::Crouch => [1.0, 0.0, 0.0],
        Gait::Jog => [0.0, 1.0, 0.0],
        Gait::Run => [0.0, 0.0, 1.0],
        Gait::Auto => {
            let (jog, run) = (past(TO_JOG), past(TO_RUN));
            [1.0 - jog, jog - run, run]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ambulo_rig::{Flat, Terrain};

    const DT: f32 = 1.0 / 60.0;

    fn standing(areas: &Areas) -> Trajectory {
        Trajectory::standing(Vec2::new(1.0, 2.0), Vec2::Y, &World { terrain: &Flat(0.5), areas })
    }

    #[test]
    fn frames_keep_left_on_the_left() {
        // Facing +X: the left is −Z.
        let point = TrajectoryPoint { direction: Vec2::X, ..Default::default() };
        assert!(point.outward(Vec2::X).abs_diff_eq(Vec2::new(0.0, -1.0), 1e-6));
        assert!(
            point.inward(point.outward(Vec2::new(0.3, 0.7))).abs_diff_eq(Vec2::new(0.3, 0.7), 1e-6)
        );
        let rotated = point.rotation() * Vec3::X;
        assert!(rotated.abs_diff_eq(Vec3::NEG_Z, 1e-6), "the quaternion agrees");
        assert!(turn(Vec2::Y, Vec2::X, 0.5).abs_diff_eq(Vec2::splat(0.5f32.sqrt()), 1e-6));
    }

    #[test]
    fn the_future_bends_to_what_is_asked() {
        let areas = Areas::default();
        let world = World { terrain: &Flat(0.5), areas: &areas };
        let mut trajectory = standing(&areas);
        let intent = Intent { velocity: Vec2::new(1.5, 0.0), ..Intent::default() };
        for _ in 0..60 {
            trajectory.follow(&intent, &Tuning::default(), &world, DT);
        }
        let last = trajectory.points()[WINDOW_POINTS - 1];
        assert!(last.position.x > 1.9, "goes along +X: {}", last.position);
        assert!((last.position.z - 2.0).abs() < 1e-3);
        assert!(last.direction.abs_diff_eq(Vec2::X, 1e-3), "faces where it goes");
        assert!(trajectory.now().gait[WALK] > 0.95 && trajectory.now().gait[STAND] < 0.05);
        assert_eq!(trajectory.now().ground(), Vec2::new(1.0, 2.0), "the present does not move");
        assert_eq!(trajectory.now().height, 0.5);
        let backwards = Intent { facing: Some(Vec2::NEG_X), strafe: 1.0, ..intent };
        for _ in 0..60 {
            trajectory.follow(&backwards, &Tuning::default(), &world, DT);
        }
        let last = trajectory.points()[WINDOW_POINTS - 1];
        assert!(last.direction.abs_diff_eq(Vec2::NEG_X, 1e-3) && last.position.x > 1.9);
    }

    #[test]
    fn the_future_keeps_out_of_walls_and_enters_areas() {
        let wall = crate::Wall { start: Vec2::new(2.0, 0.0), end: Vec2::new(2.0, 4.0), width: 0.2 };
        let jump = crate::JumpArea { centre: Vec3::new(1.8, 0.5, 2.0), radius: 0.1, falloff: 0.2 };
        let areas = Areas { walls: vec![wall], jumps: vec![jump], crouches: vec![] };
        let world = World { terrain: &Flat(0.5), areas: &areas };
        let mut trajectory = standing(&areas);
        let intent = Intent { velocity: Vec2::new(1.5, 0.0), ..Intent::default() };
        for _ in 0..60 {
            trajectory.follow(&intent, &Tuning::default(), &world, DT);
        }
        let nearest = trajectory.points().iter().map(|p| p.position.x).fold(0.0, f32::max);
        assert!((nearest - 1.8).abs() < 1e-4, "{nearest}");
        assert!(trajectory.points()[WINDOW_POINTS - 1].gait[JUMP] > 0.9);
        assert_eq!(trajectory.now().gait[JUMP], 0.0);
    }

    #[test]
    fn each_gait_has_its_input() {
        let areas = Areas::default();
        let world = World { terrain: &Flat(0.0), areas: &areas };
        for (gait, speed, expected) in [
            (Gait::Walk, 1.0, WALK),
            (Gait::Jog, 1.0, JOG),
            (Gait::Run, 1.0, RUN),
            (Gait::Auto, 1.5, WALK),
            (Gait::Auto, 3.0, JOG),
            (Gait::Auto, 5.0, RUN),
            (Gait::Auto, 0.0, STAND),
            (Gait::Crouch, 1.0, CROUCH),
            (Gait::Jog, 0.0, STAND),
        ] {
            let mut trajectory = standing(&areas);
            let intent = Intent { velocity: Vec2::new(0.0, speed), gait, ..Intent::default() };
            for _ in 0..90 {
                trajectory.follow(&intent, &Tuning::default(), &world, DT);
            }
            for (index, share) in trajectory.now().gait.into_iter().enumerate() {
                let wanted = if index == expected { 1.0 } else { 0.0 };
                assert!((share - wanted).abs() < 1e-3, "{gait:?}: input {index} is {share}");
            }
        }
    }

    #[test]
    fn paces_meet_softly() {
        let near = |speed, expected: [f32; 3]| {
            let got = paces(Gait::Auto, speed);
            let close = got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5);
            assert!(close, "{speed}: {got:?}");
        };
        near(1.9, [1.0, 0.0, 0.0]);
        near(2.1, [0.5, 0.5, 0.0]);
        near(2.3, [0.0, 1.0, 0.0]);
        near(3.6, [0.0, 1.0, 0.0]);
        near(3.75, [0.0, 0.75, 0.25]);
        near(4.2, [0.0, 0.0, 1.0]);
    }

    /// A root that reaches a fixed share of the trajectory's speed ends at the asked one, whatever
    /// the rate of the steps, within the limits and without them not at all.
    #[test]
    fn the_speed_that_is_asked_is_reached() {
        let tuning = Tuning { speed_limit: [0.8, 1.3], ..Tuning::default() };
        let reached = |tuning: &Tuning, ability: f32, rate: u32, seconds: f32| {
            let (dt, asked) = (1.0 / rate as f32, Vec2::new(0.0, 2.0));
            let (mut gain, mut moved, mut most) = (SpeedGain::STANDING, Vec2::ZERO, 0.0f32);
            for _ in 0..(seconds * rate as f32) as usize {
                gain.follow(asked, moved, tuning, dt);
                moved = asked * gain.factor * ability;
                most = most.max(moved.y / asked.y);
            }
            (moved.y / asked.y, most)
        };
        for ability in [0.85, 1.2] {
            for rate in [30, 60, 144] {
                let (late, most) = reached(&tuning, ability, rate, 10.0);
                assert!((late - 1.0).abs() < 0.01, "{ability} at {rate}: {late}");
                assert!(most < 1.05f32.max(1.01 * ability), "overshoots: {most}");
            }
            let at = |rate| reached(&tuning, ability, rate, 1.5).0;
            assert!((at(30) - at(144)).abs() < 0.01, "{ability}: {} {}", at(30), at(144));
            assert_eq!(reached(&Tuning::default(), ability, 60, 10.0).0, ability);
        }
        assert!((reached(&tuning, 0.5, 60, 30.0).0 - 0.65).abs() < 1e-3, "clamped");
        // A movement that trails a turning wish by 30°, at its speed.
        let (mut gain, way) = (SpeedGain::STANDING, |angle: f32| Vec2::from_angle(angle) * 1.5);
        for step in 0..600 {
            let angle = 1.57 * step as f32 * DT;
            gain.follow(way(angle), way(angle - 0.52) * gain.factor, &tuning, DT);
        }
        assert!((gain.factor - 1.0).abs() < 0.02, "{}", gain.factor);
        let mut gain = SpeedGain { factor: 1.2, ..SpeedGain::STANDING };
        gain.follow(Vec2::ZERO, Vec2::Y, &tuning, DT);
        assert_eq!(gain.factor, 1.0, "who stands starts anew");
    }

    #[test]
    fn who_may_stand_freely_moves_as_foreseen() {
        let areas = Areas::default();
        let mut output = Output::zero(1);
        output.root_velocity = Vec2::new(0.06, 0.0);
        output.yaw_rate = 0.3;
        for (stand_freedom, moved) in [(0.0, 0.0), (0.5, 0.0005), (1.0, 0.001)] {
            let mut trajectory = standing(&areas);
            let tuning = Tuning { stand_freedom, ..Tuning::default() };
            trajectory.advance(&output, &tuning, &areas, DT);
            let gone = trajectory.now().ground() - trajectory.before().ground();
            assert!((gone.x - moved).abs() < 1e-6, "{stand_freedom}: {gone}");
            assert!((yaw(trajectory.now().direction) - 5.0 * moved).abs() < 1e-6);
        }
    }

    #[test]
    fn crouch_areas_crouch() {
        let low = crate::CrouchArea {
            centre: Vec2::new(1.0, 3.0),
            half_size: Vec2::splat(0.2),
            amount: 1.0,
            falloff: 0.3,
        };
        let areas = Areas { crouches: vec![low], ..Areas::default() };
        let world = World { terrain: &Flat(0.5), areas: &areas };
        let mut trajectory = standing(&areas);
        let intent = Intent { velocity: Vec2::new(0.0, 1.5), ..Intent::default() };
        for _ in 0..90 {
            trajectory.follow(&intent, &Tuning::default(), &world, DT);
        }
        let inside = trajectory.points().iter().find(|p| (p.ground().y - 3.0).abs() < 0.1).unwrap();
        assert!(inside.gait[CROUCH] > 0.99 && inside.gait[WALK] < 0.01, "{:?}", inside.gait);
        assert!(trajectory.now().gait[CROUCH] < 0.01);
    }

    #[test]
    fn strafing_bends_the_path_sooner() {
        let areas = Areas::default();
        let world = World { terrain: &Flat(0.0), areas: &areas };
        let reach = |strafe: f32| {
            let mut trajectory = standing(&areas);
            let facing = Some(Vec2::Y);
            let velocity = Vec2::new(0.0, 1.5);
            let intent = Intent { velocity, facing, strafe, ..Intent::default() };
            (0..3).for_each(|_| trajectory.follow(&intent, &Tuning::default(), &world, DT));
            trajectory.points()[WINDOW_POINTS - 1].ground().y
        };
        assert!(reach(1.0) > reach(0.0) + 0.05, "{} {}", reach(1.0), reach(0.0));
    }

    #[test]
    fn advancing_shifts_the_past_and_follows_the_network() {
        let areas = Areas::default();
        let world = World { terrain: &Flat(0.0), areas: &areas };
        let mut trajectory = standing(&areas);
        let intent = Intent { velocity: Vec2::new(0.0, 1.0), ..Intent::default() };
        for _ in 0..100 {
            trajectory.follow(&intent, &Tuning::default(), &world, DT);
        }
        let mut output = Output::zero(1);
        output.root_velocity = Vec2::new(0.0, 1.2);
        output.yaw_rate = 0.6;
        for (i, point) in output.trajectory.iter_mut().enumerate() {
            *point = Point { position: Vec2::new(0.0, i as f32 * 0.2), direction: Vec2::Y };
        }
        let before = trajectory.now().ground();
        trajectory.advance(&output, &Tuning::default(), &areas, DT);
        assert_eq!(trajectory.before().ground(), before);
        let now = *trajectory.now();
        assert!((now.ground() - before).abs_diff_eq(Vec2::new(0.0, 0.02), 1e-4));
        assert!((yaw(now.direction) - 0.01).abs() < 1e-4, "turns to its left");
        let last = trajectory.points()[WINDOW_POINTS - 1].ground() - now.ground();
        assert!((last.length() - 1.18).abs() < 1e-4, "59 of 60 steps of 2 cm: {}", last.length());
    }

    #[test]
    fn samples_see_slopes_on_their_own_side() {
        struct Slope;
        impl Terrain for Slope {
            fn height(&self, x: f32, _: f32) -> f32 {
                x
            }
        }
        let areas = Areas::default();
        let world = World { terrain: &Slope, areas: &areas };
        let trajectory = Trajectory::standing(Vec2::ZERO, Vec2::Y, &world);
        let mut points = [Point::default(); SAMPLES];
        let mut ground = [Ground::default(); SAMPLES];
        trajectory.sample(&world, &mut points, &mut ground);
        // Facing +Z, the left is +X: uphill.
        for (height, expected) in ground[6].height.into_iter().zip([0.25, 0.0, -0.25]) {
            assert!((height - expected).abs() < 1e-6);
        }
        assert!(points[0].direction.abs_diff_eq(Vec2::Y, 1e-6));
    }
}
