//! A stander laid over a character whose feet stand elsewhere: they get there in little steps.

use crate::walk::{ANKLE, ANKLES, BALL, BALLS, Walker};
use ambulo_layers::{
    FeetState, FootPlacement, FootSettings, Ground, Limb, LimbSettings, Reach, StepSettings,
};
use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Flat, Pose, Terrain, Transform, wrapped};

/// Where the ball of a foot is on the plane, and the way it points, radians.
type Stand = [(Vec3, f32); 2];

/// Side by side, 20 cm apart.
const APART: Stand = [(Vec3::new(0.1, 0.0, 0.1), 0.0), (Vec3::new(-0.1, 0.0, 0.1), 0.0)];

/// All of it turned about where the left foot stands, and moved.
fn moved(stand: Stand, by: Vec3, turn: f32) -> Stand {
    let about = stand[0].0;
    let turned = Quat::from_rotation_y(turn);
    stand.map(|(place, heading)| (about + turned * (place - about) + by, heading + turn))
}

struct Slope(Vec3);

impl Terrain for Slope {
    fn height(&self, x: f32, z: f32) -> f32 {
        self.0.dot(Vec3::new(x, 0.0, z))
    }
}

/// Somebody who stands on flat ground at 0, and a layer that puts the feet on other ground.
struct Stander {
    walker: Walker,
    legs: [Limb; 2],
    /// With steps, and without.
    layers: [FootPlacement; 2],
    state: FeetState,
    pose: Pose,
    global: Vec<Transform>,
}

impl Stander {
    fn new() -> Self {
        let walker = Walker::new(0.0, [0.0; 2]);
        let stance = walker.stance();
        let settings = LimbSettings { softness: 0.0, ..LimbSettings::LEG };
        let leg = |ankle| Limb::new(&walker.skeleton, ankle, &stance, settings).unwrap();
        let layer = |steps| {
            let settings = FootSettings { steps, ..FootSettings::default() };
            FootPlacement::new(&walker.skeleton, &walker.roles, &stance, 0.0, settings).unwrap()
        };
        let layers = [layer(Some(StepSettings::default())), layer(None)];
        let (legs, (pose, global)) = (ANKLES.map(leg), walker.buffers());
        Self { legs, layers, walker, state: FeetState::default(), pose, global }
    }

    /// The pose whose feet stand so, hips over their middle.
    fn draw(&mut self, stand: Stand) {
        let skeleton = &self.walker.skeleton;
        self.pose = skeleton.rest_pose();
        let middle = stand[0].0.midpoint(stand[1].0);
        self.pose.local[0].translation += middle - Vec3::new(0.0, 0.07, 0.08);
        self.pose.to_global(skeleton, &mut self.global);
        for (side, (place, heading)) in stand.into_iter().enumerate() {
            let rotation = Quat::from_rotation_y(heading);
            let ankle = place + rotation * Vec3::new(0.0, ANKLE, -0.13);
            let asked = Reach { rotation: Some(rotation), ..Reach::at(ankle) };
            self.legs[side].reach(skeleton, &asked, &mut self.pose, &mut self.global);
        }
        self.pose.to_global(skeleton, &mut self.global);
    }

    /// Draws and places; `steps` says by which layer.
    fn frame(&mut self, stand: Stand, steps: bool, contacts: [f32; 4], on: &Ground<'_>, dt: f32) {
        self.draw(stand);
        let layer = self.layers[usize::from(!steps)];
        let Self { walker, state, pose, global, .. } = self;
        assert!(layer.step(&walker.skeleton, state, contacts, on, dt, pose, global));
    }

    /// Where the feet are shown.
    fn shown(&self) -> Stand {
        [0, 1].map(|side| {
            let forward = self.global[ANKLES[side]].rotation * Vec3::Z;
            (self.global[BALLS[side]].translation, forward.x.atan2(forward.z))
        })
    }

    /// Most that heel, ball or tip of a foot are below the ground, metres.
    fn below(&self, terrain: &dyn Terrain) -> f32 {
        let foot = |side: usize| {
            let [ankle, toe] = [ANKLES[side], BALLS[side]].map(|joint| self.global[joint]);
            let heel = ankle.transform_point(Vec3::new(0.0, -ANKLE, -0.039));
            let tip = toe.transform_point(Vec3::new(0.0, -BALL, 0.06));
            let points = [heel, toe.translation - Vec3::Y * BALL, tip];
            points.map(|point| terrain.height(point.x, point.z) - point.y)
        };
        [foot(0), foot(1)].into_iter().flatten().fold(f32::MIN, f32::max)
    }
}

/// On the plane, and how far turned.
fn apart(a: (Vec3, f32), b: (Vec3, f32)) -> [f32; 2] {
    [(a.0 - b.0).with_y(0.0).length(), wrapped(a.1 - b.1).abs()]
}

/// Greatest turn of a joint between two poses, radians.
fn turned(a: &Pose, b: &Pose) -> f32 {
    let joints = a.local.iter().zip(&b.local);
    joints.map(|(a, b)| a.rotation.angle_between(b.rotation)).fold(0.0, f32::max)
}

/// Stands for half a second, then for three more by a pose that is 15 cm and 30° off; answers where
/// the feet end.
fn steps_over(terrain: &dyn Terrain, level: Option<f32>, fps: f32) -> Stand {
    let (mut body, dt) = (Stander::new(), 1.0 / fps);
    let off = moved(APART, Vec3::new(0.06, 0.0, 0.13), 0.52);
    let (mut lifts, mut highest) = ([0, 0], [0.0f32; 2]);
    let mut before: Option<(Stand, [bool; 2], Pose)> = None;
    for frame in 0..(3.5 * fps) as usize {
        let start = frame as f32 * dt < 0.5;
        body.frame(if start { APART } else { off }, true, [1.0; 4], &Ground { terrain, level }, dt);
        let (shown, held) = (body.shown(), body.state.held());
        assert!(held != [false; 2] || frame == 0, "{frame}: both feet in the air");
        assert!(body.below(terrain) < 1e-3, "{frame}: {} underground", body.below(terrain));
        if let Some((last, stood, pose)) = &before {
            for side in 0..2 {
                let [slid, turned] = apart(shown[side], last[side]);
                if held[side] && stood[side] {
                    assert!(slid < 0.0005 * 60.0 * dt, "{frame}: foot {side} slides {slid}");
                    assert!(turned < 0.005 * 60.0 * dt, "{frame}: foot {side} turns {turned}");
                }
                assert!(slid < 0.02 * 60.0 * dt, "{frame}: foot {side} jumps {slid}");
                lifts[side] += usize::from(stood[side] && !held[side]);
                let floor = terrain.height(shown[side].0.x, shown[side].0.z) + BALL;
                highest[side] = highest[side].max(shown[side].0.y - floor);
            }
            // The pose itself pops once.
            let most = if start || frame as f32 * dt < 0.5 + 1.5 * dt { 9.0 } else { 12.0 * dt };
            let turned = turned(&body.pose, pose);
            assert!(turned < most, "{frame}: a joint turns by {turned}");
        }
        before = Some((shown, held, body.pose.clone()));
    }
    assert_eq!(lifts, [1, 1], "one step each");
    assert!(highest.iter().all(|&high| (0.045..0.12).contains(&high)), "{highest:?}");
    let shown = body.shown();
    for side in 0..2 {
        let [away, turned] = apart(shown[side], off[side]);
        assert!(away < 0.005 && turned < 0.03, "foot {side} ends {away} m, {turned} rad off");
    }
    shown
}

#[test]
fn two_steps_one_after_the_other_at_any_frame_rate() {
    for level in [None, Some(0.0)] {
        let ends = [30.0, 60.0, 144.0].map(|fps| steps_over(&Flat(0.0), level, fps));
        for end in ends {
            for side in 0..2 {
                let [away, turned] = apart(end[side], ends[0][side]);
                assert!(away < 0.001 && turned < 0.005, "{ends:?}");
            }
        }
    }
}

#[test]
fn on_slopes() {
    for slope in [Vec3::new(0.0, 0.0, 0.25), Vec3::new(0.2, 0.0, -0.15)] {
        steps_over(&Slope(slope), Some(0.0), 60.0);
    }
}

#[test]
fn less_than_a_step_is_left_to_creeping() {
    let mut body = Stander::new();
    let ground = Ground { terrain: &Flat(0.0), level: None };
    body.frame(APART, true, [1.0; 4], &ground, 0.02);
    let off = moved(APART, Vec3::new(0.0, 0.0, 0.03), 0.04);
    for _ in 0..1000 {
        body.frame(off, true, [1.0; 4], &ground, 0.02);
        assert_eq!(body.state.held(), [true; 2]);
    }
    for (shown, off) in body.shown().into_iter().zip(off) {
        let [away, turned] = apart(shown, off);
        assert!(away < 1e-3 && turned < 2e-3, "{away} {turned}");
    }
}

/// A foot waits while the other one is in the air by the motion's own will.
#[test]
fn only_while_the_other_foot_is_held() {
    let mut body = Stander::new();
    let ground = Ground { terrain: &Flat(0.0), level: None };
    body.frame(APART, true, [1.0; 4], &ground, 0.02);
    let off = moved(APART, Vec3::new(0.0, 0.0, 0.1), 0.0);
    for _ in 0..100 {
        body.frame(off, true, [0.0, 0.0, 1.0, 1.0], &ground, 0.02);
        assert_eq!(body.state.held(), [false, true]);
        assert!(apart(body.shown()[1], APART[1])[0] < 1e-4, "it waits where it stands");
    }
    for _ in 0..100 {
        body.frame(off, true, [1.0; 4], &ground, 0.02);
    }
    assert!(apart(body.shown()[1], off[1])[0] < 1e-3, "then it steps");
}

/// Another layer without steps, another pose, or a motion that lifts the foot, at any frame of a
/// step: neither feet nor joints jump.
#[test]
fn a_step_may_be_interrupted_at_any_frame() {
    let (dt, off) = (1.0 / 60.0, moved(APART, Vec3::new(0.06, 0.0, 0.13), 0.52));
    let ground = Ground { terrain: &Flat(0.0), level: None };
    for at in 1..48 {
        for how in 0..3 {
            let mut body = Stander::new();
            body.frame(APART, true, [1.0; 4], &ground, dt);
            let (mut before, mut last): (Option<Pose>, _) = (None, body.shown());
            for frame in 0..240 {
                let late = frame >= at;
                let (stand, steps, contact) = match how {
                    0 => (off, !late, 1.0),
                    // A pose that moves away by 0.6 m/s for half a second, and back.
                    1 => {
                        let t = ((frame as f32 - at as f32) / 60.0).clamp(0.0, 1.0);
                        let by = Vec3::X * 0.6 * t.min(1.0 - t);
                        (moved(off, by, 0.0), true, 1.0)
                    }
                    _ => (off, true, if late { 0.0 } else { 1.0 }),
                };
                body.frame(stand, steps, [contact; 4], &ground, dt);
                assert!(body.below(&Flat(0.0)) < 1e-3, "{how}, {at}, {frame}: underground");
                let shown = body.shown();
                // The pose itself pops in the first frame.
                if let Some(before) = before.filter(|_| frame > 1) {
                    let most = turned(&body.pose, &before);
                    assert!(most < 0.2, "{how}, {at}, {frame}: a joint turns by {most}");
                    for side in 0..2 {
                        let moved = shown[side].0.distance(last[side].0);
                        // Let go 0.23 m away, 14 % of that in the first frame.
                        assert!(moved < 0.04, "{how}, {at}, {frame}: foot {side} by {moved}");
                    }
                }
                (before, last) = (Some(body.pose.clone()), shown);
            }
            for (shown, off) in body.shown().into_iter().zip(off) {
                let [away, turned] = apart(shown, off);
                // Without steps it only creeps.
                let near = if how == 0 { [0.13, 0.03] } else { [0.02, 0.2] };
                assert!(away < near[0] && turned < near[1], "{how}, {at}: {away} m, {turned} rad");
            }
        }
    }
}

#[test]
fn a_ledge_in_between_is_stepped_over() {
    struct Ledge;
    impl Terrain for Ledge {
        fn height(&self, _: f32, z: f32) -> f32 {
            if (0.27..0.31).contains(&z) { 0.1 } else { 0.0 }
        }
    }
    let mut body = Stander::new();
    let ground = Ground { terrain: &Ledge, level: None };
    let before = moved(APART, Vec3::Z * -0.02, 0.0);
    let behind = moved(APART, Vec3::Z * 0.4, 0.0);
    body.frame(before, true, [1.0; 4], &ground, 0.01);
    let mut highest = 0.0f32;
    for _ in 0..200 {
        body.frame(behind, true, [1.0; 4], &ground, 0.01);
        assert!(body.below(&Ledge) < 1e-3, "{}", body.below(&Ledge));
        highest = highest.max(body.shown()[0].0.y);
    }
    assert!(highest > 0.14, "{highest}");
    assert!(apart(body.shown()[0], behind[0])[0] < 1e-3);
}
