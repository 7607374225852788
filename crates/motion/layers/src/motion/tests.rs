use super::*;
use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Joint, Skeleton};
use proptest::prelude::*;

/// Walks a circle: turns left a quarter turn a second at 1.5 m/s, from where it starts, its hips
/// pitched forward and its spine swinging.
fn circle(frames: usize, fps: f64, from: DVec3, facing: f64) -> Clip {
    let joint =
        |name: &str, parent| Joint { name: name.into(), parent, offset: DVec3::Y, tips: vec![] };
    let skeleton = Skeleton::new(vec![joint("hips", None), joint("spine", Some(0))]).unwrap();
    let rate = std::f64::consts::FRAC_PI_2;
    let yaw = |frame: usize| facing + rate * frame as f64 / fps;
    let place = |frame: usize| {
        let (radius, a, b) = (1.5 / rate, yaw(frame), facing);
        from + DVec3::new(-a.cos() + b.cos(), 0.0, a.sin() - b.sin()) * radius
    };
    let turns = (0..frames).flat_map(|f| {
        let spine = DQuat::from_rotation_z(0.3 * (3.0 * f as f64 / fps).sin());
        [DQuat::from_rotation_y(yaw(f)) * DQuat::from_rotation_x(0.3), spine]
    });
    let (places, turns) = ((0..frames).map(place).collect(), turns.collect());
    Clip::new(skeleton, 1.0 / fps, vec![0], places, turns).unwrap()
}

fn motion(clip: &Clip) -> Motion {
    Motion::new(clip, 60.0, Marks::default()).unwrap()
}

proptest! {
    #[test]
    fn what_is_taken_apart_is_the_clip(
        from in prop::array::uniform3(-5.0..5.0f64), facing in -3.0..3.0f64, time in 0.0..9.9f64,
    ) {
        // Two turns and more: the yaw passes every seam.
        let clip = circle(601, 60.0, DVec3::from_array(from), facing);
        let motion = motion(&clip);
        let mut expected = clip.skeleton().rest_pose();
        let (mut whole, mut in_place) = (expected.clone(), expected.clone());
        clip.sample(time, &mut expected);
        motion.as_recorded(time, &mut whole);
        motion.in_place(time, &mut in_place);
        for (a, b) in expected.local.iter().zip(&whole.local) {
            prop_assert!(a.translation.abs_diff_eq(b.translation, 1e-3), "{a:?} {b:?}");
            prop_assert!(a.rotation.angle_between(b.rotation) < 2e-3, "{a:?} {b:?}");
        }
        let way = motion.way(time);
        prop_assert!((f64::from(way.yaw) - time * std::f64::consts::FRAC_PI_2).abs() < 1e-3);
        let root = in_place.local[0];
        prop_assert!(root.translation.x == 0.0 && root.translation.z == 0.0);
        prop_assert!((root.translation.y - from[1] as f32).abs() < 1e-5);
        let start = Quat::from_rotation_y(facing as f32) * Quat::from_rotation_x(0.3);
        prop_assert!(root.rotation.angle_between(start) < 2e-3);
    }

    #[test]
    fn steps_undo_and_repeat(x in -2.0..2.0f32, z in -2.0..2.0f32, yaw in -3.0..3.0f32, n in 0..20_u64) {
        let step = GroundStep { place: Vec3::new(x, 0.0, z), yaw };
        let none = step.then(step.inverse());
        prop_assert!(none.place.length() < 1e-5 && none.yaw == 0.0);
        let one_by_one = (0..n).fold(GroundStep::default(), |all, _| all.then(step));
        let at_once = step.times(n);
        prop_assert!(at_once.place.distance(one_by_one.place) < 1e-3);
        prop_assert!((at_once.yaw - one_by_one.yaw).abs() < 1e-3);
    }
}

#[test]
fn both_ends_are_kept_at_any_rate() {
    let clip = circle(31, 30.0, DVec3::Y, 0.0);
    for fps in [7.0, 29.97, 30.0, 240.0, 0.1] {
        let motion = Motion::new(&clip, fps, Marks::default()).unwrap();
        assert_eq!(motion.duration(), 1.0);
        assert!((motion.way(1.0).yaw - std::f32::consts::FRAC_PI_2).abs() < 1e-4, "{fps}");
        assert_eq!(motion.way(-1.0), GroundStep::default());
    }
    assert!((motion(&clip).ground_speed() - 1.5).abs() < 1e-2);
    let still = motion(&circle(1, 30.0, DVec3::Y, 0.0));
    assert_eq!((still.duration(), still.ground_speed()), (0.0, 0.0));
}

#[test]
fn what_cannot_be_played_is_refused() {
    let clip = circle(31, 30.0, DVec3::Y, 0.0);
    let refused = |fps, marks: Marks| Motion::new(&clip, fps, marks).unwrap_err();
    assert_eq!(refused(0.0, Marks::default()), MotionError::Rate(0.0));
    assert!(matches!(refused(f64::NAN, Marks::default()), MotionError::Rate(_)));
    assert!(matches!(refused(1e9, Marks::default()), MotionError::TooLong { .. }));
    let event = |name: &str, time| Marks {
        events: vec![Mark { name: name.into(), time }],
        ..Marks::default()
    };
    assert_eq!(refused(30.0, event("", 0.0)), MotionError::NoName);
    for time in [-0.1, 1.1, f64::NAN] {
        assert!(matches!(refused(30.0, event("a", time)), MotionError::Outside { .. }));
    }
    let phase = Phase { name: "a".into(), start: 0.5, end: 0.4 };
    let marks = Marks { phases: vec![phase], ..Marks::default() };
    assert!(matches!(refused(30.0, marks), MotionError::Backward { .. }));
    let far = circle(2, 30.0, DVec3::splat(1e9), 0.0);
    let far = Motion::new(&far, 30.0, Marks::default()).unwrap_err();
    assert_eq!(far, MotionError::TooLarge { frame: 0 });
}
