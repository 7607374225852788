//! A walk made for flat ground, whose planted feet slide by centimetres, over slopes, steps and
//! hills: planted balls stay to within 0.1 cm a frame, and nothing is underground.

use crate::walk::{ANKLE, ANKLES, BALL, BALLS, Walker};
use ambulo_layers::{FeetState, FootPlacement, FootSettings, Ground};
use ambulo_rig::glam::Vec3;
use ambulo_rig::{Flat, HeightField, Pose, Terrain, Transform};

struct Shape(fn(f32, f32) -> f32);

impl Terrain for Shape {
    fn height(&self, x: f32, z: f32) -> f32 {
        self.0(x, z)
    }
}

/// Height that a game would move the root at: the ground around it, without its edges.
fn level(terrain: &dyn Terrain, root: Vec3) -> f32 {
    let near = |at: i32| terrain.height(root.x, root.z + 0.01 * at as f32);
    (-40..=40).map(near).sum::<f32>() / 81.0
}

#[derive(Debug, Default)]
struct Measured {
    /// Most that a planted ball moves, on the plane and up or down, metres a frame.
    slid: f32,
    rose: f32,
    /// Most that heel, sole or toes are below the ground, metres.
    below: f32,
    /// Greatest gap below a foot that is held for a tenth of a second, metres.
    gap: f32,
    /// Most that hips move relative to the motion, metres a frame.
    hips: f32,
    /// Most that a joint, and toes, turn more than the motion turns them, radians a frame.
    turned: f32,
    toes: f32,
    /// Share of the frames with sure contact in which the foot is held.
    held: f32,
    /// Most that the motion itself slides.
    drawn: f32,
}

/// One frame, of the motion and of what is shown.
struct Frame {
    held: [bool; 2],
    hips: Vec3,
    drawn: (Pose, Vec<Transform>),
    shown: (Pose, Vec<Transform>),
}

impl Measured {
    /// What is wrong within a frame.
    fn look(&mut self, frame: &Frame, terrain: &dyn Terrain, planted: [bool; 2]) {
        for side in 0..2 {
            let [ankle, toe] = [ANKLES[side], BALLS[side]].map(|joint| frame.shown.1[joint]);
            let heel = ankle.transform_point(Vec3::new(0.0, -ANKLE, -0.039));
            let tip = toe.transform_point(Vec3::new(0.0, -BALL, 0.06));
            let ball = toe.translation - Vec3::Y * BALL;
            let points = [heel, heel.lerp(ball, 0.3), heel.lerp(ball, 0.7), ball, tip];
            let above = points.map(|point| point.y - terrain.height(point.x, point.z));
            let lowest = above.into_iter().fold(f32::MAX, f32::min);
            self.below = self.below.max(-lowest);
            self.gap = if planted[side] { self.gap.max(lowest) } else { self.gap };
        }
    }

    /// What is wrong between two frames.
    fn compare(&mut self, before: &Frame, now: &Frame) {
        self.hips = self.hips.max(now.hips.distance(before.hips));
        for side in (0..2).filter(|&side| before.held[side] && now.held[side]) {
            let moved = |before: &[Transform], now: &[Transform]| {
                now[BALLS[side]].translation - before[BALLS[side]].translation
            };
            let shown = moved(&before.shown.1, &now.shown.1);
            self.slid = self.slid.max(shown.with_y(0.0).length());
            self.rose = self.rose.max(shown.y.abs());
            let drawn = moved(&before.drawn.1, &now.drawn.1);
            self.drawn = self.drawn.max(drawn.with_y(0.0).length());
        }
        for joint in 0..now.shown.0.local.len() {
            let turned = |before: &Pose, now: &Pose| {
                before.local[joint].rotation.angle_between(now.local[joint].rotation)
            };
            let more =
                turned(&before.shown.0, &now.shown.0) - turned(&before.drawn.0, &now.drawn.0);
            let toes = BALLS.contains(&joint);
            let most = if toes { &mut self.toes } else { &mut self.turned };
            *most = most.max(more);
        }
    }
}

fn walk(terrain: &dyn Terrain, walker: &Walker, follows: bool, fps: f32) -> Measured {
    let (mut pose, mut global) = walker.buffers();
    let (skeleton, settings) = (&walker.skeleton, FootSettings::default());
    let feet =
        FootPlacement::new(skeleton, &walker.roles, &walker.stance(), 0.0, settings).unwrap();
    let (mut state, mut measured) = (FeetState::default(), Measured::default());
    let (mut sure, mut held, mut since) = (0, 0, [0; 2]);
    let mut before: Option<Frame> = None;
    for frame in 0..(12.0 * fps) as usize {
        let time = frame as f32 / fps;
        let level = level(terrain, walker.root(time));
        let contacts = walker.pose(time, level, &mut pose, &mut global);
        let drawn = (pose.clone(), global.clone());
        let ground = Ground { terrain, level: (!follows).then_some(level) };
        let dt = 1.0 / fps;
        assert!(feet.step(skeleton, &mut state, contacts, &ground, dt, &mut pose, &mut global));
        let mut again = global.clone();
        pose.to_global(skeleton, &mut again);
        let same =
            again.iter().zip(&global).all(|(a, b)| a.translation.distance(b.translation) < 1e-4);
        assert!(same, "kept up to date");
        for side in 0..2 {
            since[side] = if state.held()[side] { since[side] + 1 } else { 0 };
            if contacts[2 * side + 1] >= settings.hold {
                (sure, held) = (sure + 1, held + u32::from(state.held()[side]));
            }
        }
        let shown = (pose.clone(), global.clone());
        let now = Frame { held: state.held(), hips: state.hips(), drawn, shown };
        measured.look(&now, terrain, since.map(|frames| frames as f32 > 0.1 * fps));
        if let Some(before) = &before {
            measured.compare(before, &now);
        }
        before = Some(now);
    }
    measured.held = held as f32 / sure as f32;
    measured
}

/// Steps of 15 cm every 40 cm, up for eight of them and down again.
fn steps(_: f32, z: f32) -> f32 {
    let step = (z / 0.4).floor();
    0.15 * step.clamp(0.0, 16.0 - step.clamp(8.0, 16.0)).min(8.0)
}

/// `edges`: a foot may hang over one, and is raised by as much as a step at once.
fn check(name: &str, terrain: &dyn Terrain, follows: bool, edges: bool) {
    for (fps, yaw) in [(60.0, 0.0), (30.0, 0.3), (144.0, -0.4)] {
        let walker = Walker::new(yaw, [0.06, -0.02]);
        let measured = walk(terrain, &walker, follows, fps);
        println!("{name} at {fps}: {measured:?}");
        assert!(measured.drawn > 0.09 / fps, "the motion slides: {measured:?}");
        // 0.1 cm a frame at 60 Hz.
        assert!(measured.slid <= 0.06 / fps, "{name} at {fps}: {measured:?}");
        assert!(measured.below <= 0.001, "{name} at {fps}: {measured:?}");
        assert!(measured.held > 0.95, "{name} at {fps}: {measured:?}");
        let sharp = if fps < 60.0 { 0.8 } else { 0.5 };
        let (gap, turned, toes) = if edges { (0.16, sharp, 1.1) } else { (0.01, 0.25, 0.3) };
        assert!(measured.gap < gap, "{name} at {fps}: {measured:?}");
        assert!(measured.hips < 1.5 / fps, "{name} at {fps}: {measured:?}");
        assert!(measured.turned < turned, "{name} at {fps}: {measured:?}");
        assert!(measured.toes < toes, "{name} at {fps}: {measured:?}");
    }
}

#[test]
fn on_flat_ground() {
    check("flat", &Flat(0.3), false, false);
    check("flat, followed", &Flat(0.3), true, false);
}

#[test]
fn on_slopes() {
    check("up", &Shape(|_, z| 0.27 * z), false, false);
    check("down", &Shape(|_, z| -0.27 * z), false, false);
    check("across", &Shape(|x, _| 0.2 * x), false, false);
}

#[test]
fn on_steps() {
    check("steps", &Shape(steps), false, true);
}

#[test]
fn over_hills() {
    let hills = HeightField::hills(7, 60.0, 6.0).unwrap();
    check("hills", &hills, false, false);
    check("hills, followed", &hills, true, false);
}
