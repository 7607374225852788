use std::f32::consts::LN_2;

use super::*;
use proptest::prelude::*;
use std::f32::consts::PI;

const JOINTS: usize = 4;
const DECAYS: [Decay; 2] = [Decay::Quintic { duration: 0.3 }, Decay::Spring { halflife: 0.08 }];

/// A source that moves: a walking root, limbs that swing, each its own way.
#[derive(Clone, Copy, Debug)]
struct Source {
    seed: f32,
    speed: f32,
}

impl Source {
    fn pose(self, t: f32) -> Pose {
        let joint = |index: usize| {
            let own = self.seed * (index + 1) as f32;
            let swing = (self.speed * t * (3.0 + own.sin()) + own).sin();
            let place = Vec3::new(own.cos(), 1.0 + 0.1 * swing, self.speed * t);
            let axis = Vec3::new(own.sin(), own.cos(), 0.5).normalize();
            let turn = Quat::from_axis_angle(axis, 0.8 * swing + own.sin());
            Transform::new(if index == 0 { place } else { Vec3::Y * own.cos() }, turn)
        };
        Pose { local: (0..JOINTS).map(joint).collect() }
    }
}

fn source() -> impl Strategy<Value = Source> {
    (0.0..6.0f32, 0.2..2.0f32).prop_map(|(seed, speed)| Source { seed, speed })
}

fn none() -> Pose {
    Pose { local: vec![] }
}

fn angle(a: Quat, b: Quat) -> f32 {
    shorter(a * b.inverse()).to_scaled_axis().length()
}

/// The greatest step of any joint: metres, radians.
fn jump(a: &Pose, b: &Pose) -> [f32; 2] {
    let pairs = || a.local.iter().zip(&b.local);
    let greatest = |numbers: &mut dyn Iterator<Item = f32>| numbers.fold(0.0, f32::max);
    [
        greatest(&mut pairs().map(|(a, b)| a.translation.distance(b.translation))),
        greatest(&mut pairs().map(|(a, b)| angle(a.rotation, b.rotation))),
    ]
}

/// How fast an offset may go by itself: what its size needs, and the swing back from its velocity.
/// The quintic's greatest slopes are 1.875 x / duration and 0.52 v (and −v, its own, at the start),
/// the spring's y x / e and v / e².
fn needed(decay: Decay, x: f32, v: f32) -> f32 {
    match decay {
        Decay::Quintic { duration } => 1.875 * x / duration + 0.52 * v,
        Decay::Spring { halflife } => 2.0 * LN_2 / halflife * x / 1.0_f32.exp() + 0.14 * v,
    }
}

/// Against the coefficients that Bollo gives for A t⁵ + B t⁴ + C t³ + a/2 t² + v t + x.
#[test]
fn the_quintic_is_the_published_one() {
    for (x, v, duration) in [(0.8, 0.0, 0.5), (0.8, -2.0, 0.5), (0.8, -6.0, 0.5), (0.8, -9.0, 0.5)]
    {
        let t1 = if v < 0.0 { f32::min(duration, -5.0 * x / v) } else { duration };
        let a = f32::max(0.0, (-8.0 * v * t1 - 20.0 * x) / (t1 * t1));
        let c5 = -(a * t1 * t1 + 6.0 * v * t1 + 12.0 * x) / (2.0 * t1.powi(5));
        let c4 = (3.0 * a * t1 * t1 + 16.0 * v * t1 + 30.0 * x) / (2.0 * t1.powi(4));
        let c3 = -(3.0 * a * t1 * t1 + 12.0 * v * t1 + 20.0 * x) / (2.0 * t1.powi(3));
        for t in [0.0, 0.1, 0.25, 0.4, 0.44].into_iter().filter(|t| *t < t1) {
            let published = ((((c5 * t + c4) * t + c3) * t + 0.5 * a) * t + v) * t + x;
            let ours = quintic(Vec3::Z * x, Vec3::Z * v, duration, t);
            assert!(ours.abs_diff_eq(Vec3::Z * published, 1e-5), "{v} {t}: {ours} {published}");
        }
    }
}

proptest! {
    /// The curve along the offset goes straight to 0: it never crosses it, whatever its speed, and
    /// never turns back when it was on its way there.
    #[test]
    fn a_quintic_does_not_overshoot(x in 0.001..3.0f32, v in -40.0..20.0f32, duration in 0.05..1.0f32) {
        let at = |t: f32| quintic(Vec3::X * x, Vec3::X * v, duration, t).x;
        let mut before = x;
        for step in 1..=200 {
            let now = at(duration * step as f32 / 200.0);
            prop_assert!(now >= -1e-6 * x, "{}", now);
            prop_assert!(v > 0.0 || now <= before + 1e-5 * x, "{} {}", before, now);
            before = now;
        }
        prop_assert_eq!(at(duration), 0.0);
    }

    /// Position and velocity start where they were: the finite difference at 0 is v.
    #[test]
    fn decays_start_with_what_they_are_given(
        x in prop::array::uniform3(-1.0..1.0f32), v in prop::array::uniform3(-3.0..3.0f32),
    ) {
        let (x, v) = (Vec3::from_array(x), Vec3::from_array(v));
        prop_assume!(x.length() > 0.05);
        for decay in DECAYS {
            prop_assert!(decay.left(x, v, 0.0).abs_diff_eq(x, 1e-6));
            let h = 1e-3;
            let speed = (decay.left(x, v, h) - x) / h;
            // Accelerations are at most of the order of x / t² and v / t.
            let off = h * (0.5 * x.length() * 400.0 + 60.0 * v.length());
            prop_assert!(speed.distance(v) < off, "{:?} {} {}", decay, speed, v);
            prop_assert_eq!(decay.left(x, v, decay.end()), Vec3::ZERO);
        }
    }

    /// No joint jumps farther than 1.5 times what the sources move in a frame, and what the offset
    /// needs; a switch comes at any frame, also during another one, and at any frame rate.
    #[test]
    fn nothing_pops(
        sources in prop::array::uniform3(source()), fps in 20.0..150.0f32, second in 1..20_usize,
        spring in any::<bool>(),
    ) {
        let decay = DECAYS[usize::from(spring)];
        let dt = 1.0 / fps;
        let mut layer = Inertialiser::new(JOINTS, decay).unwrap();
        let (mut shown, mut last) = (none(), none());
        let (mut moved, mut need) = ([0.0_f32; 2], [0.0_f32; 2]);
        for frame in 0..200 {
            let t = frame as f32 * dt;
            let playing = sources[usize::from(frame >= 30) + usize::from(frame >= 30 + second)];
            let own = jump(&playing.pose(t), &playing.pose(t + dt));
            moved = [0, 1].map(|i| moved[i].max(own[i]));
            if frame == 30 || frame == 30 + second {
                layer.switch(&playing.pose(t - dt), &playing.pose(t), dt).unwrap();
                // A transition that is interrupted leaves what it needed to the next one.
                let most = |needs: &dyn Fn(&Offset) -> [Vec3; 2]| {
                    let needs = layer.offsets.iter().map(needs);
                    needs.map(|[x, v]| needed(decay, x.length(), v.length())).fold(0.0, f32::max)
                };
                need[0] += dt * most(&|offset| [offset.place, offset.place_velocity]);
                need[1] += dt * most(&|offset| [offset.turn, offset.turn_velocity]);
            }
            layer.step(&playing.pose(t), dt, &mut shown).unwrap();
            if frame > 0 {
                let now = jump(&last, &shown);
                for i in [0, 1] {
                    prop_assert!(now[i] <= 1.5 * moved[i] + need[i] + 1e-4,
                        "frame {}: {} of {} and {}", frame, now[i], moved[i], need[i]);
                }
            }
            last.clone_from(&shown);
        }
    }

    /// However time is cut, the same is shown at the same time.
    #[test]
    fn frame_rates_do_not_matter(a in source(), b in source(), cuts in 1..12_usize) {
        for decay in DECAYS {
            let mut one = Inertialiser::new(JOINTS, decay).unwrap();
            let mut out = none();
            one.step(&a.pose(0.0), 0.02, &mut out).unwrap();
            one.step(&a.pose(0.02), 0.02, &mut out).unwrap();
            one.switch(&b.pose(0.02), &b.pose(0.03), 0.01).unwrap();
            let mut many = one.clone();
            one.step(&b.pose(0.14), 0.12, &mut out).unwrap();
            let mut cut = none();
            for step in 1..=cuts {
                let dt = 0.12 / cuts as f32;
                many.step(&b.pose(0.02 + dt * step as f32), dt, &mut cut).unwrap();
            }
            let apart = jump(&out, &cut);
            prop_assert!(apart[0] < 1e-4 && apart[1] < 1e-3, "{:?}", apart);
        }
    }
}

/// The velocity shown just before and just after a switch is the same, but for what accelerations
/// make of it in a frame: a quarter of the frame, a quarter of the difference.
#[test]
fn velocity_is_continuous() {
    let (a, b) = (Source { seed: 1.3, speed: 1.8 }, Source { seed: 4.1, speed: 0.7 });
    for decay in DECAYS {
        let kink = |dt: f32| {
            let mut layer = Inertialiser::new(JOINTS, decay).unwrap();
            let mut shown = [none(), none(), none()];
            // The frame before took twice as long.
            layer.step(&a.pose(0.5 - 2.0 * dt), dt, &mut shown[0]).unwrap();
            layer.step(&a.pose(0.5), 2.0 * dt, &mut shown[1]).unwrap();
            layer.switch(&b.pose(0.5), &b.pose(0.5 + dt), dt).unwrap();
            layer.step(&b.pose(0.5 + dt), dt, &mut shown[2]).unwrap();
            let [x, y, z] = shown;
            let joints = x.local.iter().zip(&y.local).zip(&z.local);
            joints.fold(0.0_f32, |most, ((x, y), z)| {
                let places =
                    0.5 * (y.translation - x.translation) - (z.translation - y.translation);
                let turn = |a: Quat, b: Quat| shorter(b * a.inverse()).to_scaled_axis();
                let turns = 0.5 * turn(x.rotation, y.rotation) - turn(y.rotation, z.rotation);
                most.max(places.length().max(turns.length()) / dt)
            })
        };
        let (coarse, fine) = (kink(1.0 / 60.0), kink(1.0 / 240.0));
        assert!(fine < 0.35 * coarse + 1e-2, "{decay:?}: {coarse} {fine}");
    }
}

/// An offset that passes half a turn goes on the same way round, at its own speed.
#[test]
fn half_a_turn_is_no_seam() {
    let at = |angle: f32| Transform::new(Vec3::ZERO, Quat::from_rotation_y(angle));
    for from in [-0.02, -0.001, 0.001, 0.02].map(|past| PI + past) {
        let offset = Offset::new(at(from), at(from + 0.05), at(0.0), at(0.01), 0.01);
        assert!((offset.turn_velocity.length() - 4.0).abs() < 1e-2, "{from}: {offset:?}");
        assert!(offset.turn.length() < 3.15);
    }
}

#[test]
fn it_ends_with_the_source_itself() {
    let (a, b) = (Source { seed: 0.3, speed: 1.0 }, Source { seed: 2.0, speed: 1.5 });
    for decay in DECAYS {
        let mut layer = Inertialiser::new(JOINTS, decay).unwrap();
        let mut out = none();
        layer.step(&a.pose(0.0), 0.01, &mut out).unwrap();
        assert_eq!(out, a.pose(0.0), "what is shown first is shown as it is");
        layer.switch(&b.pose(0.0), &b.pose(0.1), 0.1).unwrap();
        layer.step(&b.pose(0.001), 0.001, &mut out).unwrap();
        let popped = jump(&out, &a.pose(0.0));
        assert!(layer.is_running() && popped[0] < 0.02 && popped[1] < 0.02, "{popped:?}");
        layer.step(&b.pose(9.0), decay.end(), &mut out).unwrap();
        assert!(!layer.is_running());
        assert_eq!(out, b.pose(9.0));
        layer.switch(&a.pose(0.0), &a.pose(0.1), 0.1).unwrap();
        layer.reset();
        layer.step(&a.pose(0.1), 0.1, &mut out).unwrap();
        assert_eq!(out, a.pose(0.1));
    }
}

#[test]
fn no_time_changes_nothing() {
    let (a, b) = (Source { seed: 0.3, speed: 1.0 }, Source { seed: 2.0, speed: 1.5 });
    let mut layer = Inertialiser::new(JOINTS, Decay::default()).unwrap();
    let (mut out, mut still, mut later) = (none(), none(), none());
    for frame in 0..5 {
        layer.step(&a.pose(0.1 * frame as f32), 0.1, &mut out).unwrap();
    }
    layer.switch(&b.pose(0.4), &b.pose(0.5), 0.1).unwrap();
    layer.step(&b.pose(0.5), 0.1, &mut out).unwrap();
    let mut other = layer.clone();
    for _ in 0..3 {
        layer.step(&b.pose(0.5), 0.0, &mut still).unwrap();
        assert_eq!(still, out);
    }
    layer.switch(&a.pose(0.5), &a.pose(0.6), 0.1).unwrap();
    layer.step(&a.pose(0.5), 0.0, &mut still).unwrap();
    assert_eq!(still, out, "not even when the source changes");
    layer.step(&a.pose(0.6), 0.1, &mut out).unwrap();
    other.switch(&a.pose(0.5), &a.pose(0.6), 0.1).unwrap();
    other.step(&a.pose(0.6), 0.1, &mut later).unwrap();
    assert_eq!(out, later);
}

#[test]
fn broken_input_leaves_the_state() {
    let a = Source { seed: 0.3, speed: 1.0 };
    let mut layer = Inertialiser::new(JOINTS, Decay::default()).unwrap();
    let (mut out, mut same) = (none(), none());
    layer.step(&a.pose(0.0), 0.1, &mut out).unwrap();
    layer.step(&a.pose(0.1), 0.1, &mut out).unwrap();
    let mut other = layer.clone();
    let mut broken = a.pose(0.2);
    broken.local[3].rotation = Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0);
    let (good, before) = (a.pose(0.2), out.clone());
    let refused = Err(Refused::Joint { joint: 3 });
    assert_eq!(layer.step(&broken, 0.1, &mut out), refused);
    assert_eq!(layer.switch(&broken, &good, 0.1), refused);
    assert_eq!(layer.switch(&good, &broken, 0.1), refused);
    assert_eq!(layer.switch(&good, &good, 0.0), Err(Refused::Time(0.0)));
    assert!(layer.step(&good, f32::NAN, &mut out).is_err());
    assert!(layer.step(&good, -0.1, &mut out).is_err());
    assert!(layer.step(&none(), 0.1, &mut out).is_err());
    assert_eq!(out, before);
    layer.step(&good, 0.1, &mut out).unwrap();
    other.step(&good, 0.1, &mut same).unwrap();
    assert_eq!(out, same);
    for bad in [-0.1, f32::NAN, f32::INFINITY, 61.0] {
        assert!(Inertialiser::new(JOINTS, Decay::Quintic { duration: bad }).is_err());
        assert!(layer.set_decay(Decay::Spring { halflife: bad }).is_err());
    }
}

/// Sources at the edge of what is taken, and steps of any size, never make a number that is none.
#[test]
fn the_farthest_poses_stay_finite() {
    let far = |side: f32| Pose {
        local: vec![Transform::new(Vec3::splat(9e6 * side), Quat::from_rotation_x(side)); JOINTS],
    };
    for decay in DECAYS
        .into_iter()
        .chain([Decay::Quintic { duration: 0.0 }, Decay::Spring { halflife: 0.0 }])
    {
        let mut layer = Inertialiser::new(JOINTS, decay).unwrap();
        let mut out = none();
        for dt in [1e-38, 0.016, 1e30, f32::MAX, 1e-45] {
            layer.step(&far(1.0), dt, &mut out).unwrap();
            layer.switch(&far(-1.0), &far(1.0), dt).unwrap();
            layer.step(&far(-1.0), dt, &mut out).unwrap();
            assert!(out.local.iter().all(|joint| joint.is_finite()), "{decay:?} {dt}: {out:?}");
        }
    }
}
