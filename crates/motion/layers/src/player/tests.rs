use super::*;
use crate::motion::Marks;
use ambulo_rig::glam::{DQuat, DVec3, Quat, Vec3};
use ambulo_rig::{Clip, Joint, Skeleton};
use proptest::prelude::*;

/// Two seconds: a quarter turn to the left and 3 m along a curve, with events at 0, 0.5 and 2 s.
fn motion() -> Arc<Motion> {
    let root = Joint { name: "hips".into(), parent: None, offset: DVec3::Y, tips: vec![] };
    let frames = 0..=120;
    let at = |frame: i32| f64::from(frame) / 60.0;
    let places =
        frames.clone().map(|f| DVec3::new(0.2 * at(f).powi(2), 1.0, 1.5 * at(f))).collect();
    let turns = frames.map(|f| DQuat::from_rotation_y(0.25 * std::f64::consts::PI * at(f)));
    let skeleton = Skeleton::new(vec![root]).unwrap();
    let clip = Clip::new(skeleton, 1.0 / 60.0, vec![0], places, turns.collect()).unwrap();
    let mark = |name: &str, time| Mark { name: name.into(), time };
    let phase = |name: &str, start, end| Phase { name: name.into(), start, end };
    let marks = Marks {
        phases: vec![phase("enter", 0.0, 0.5), phase("exit", 1.5, 2.0)],
        events: vec![mark("end", 2.0), mark("touch", 0.5), mark("start", 0.0)],
    };
    Arc::new(Motion::new(&clip, 30.0, marks).unwrap())
}

fn player(looped: bool, speed: f32) -> Player {
    Player::new(motion(), Playback { looped, keep_root: false, speed }).unwrap()
}

fn events(player: &mut Player, dt: f32) -> Vec<String> {
    let played = player.step(dt).unwrap();
    played.events(&player.motion).map(|event| event.name.clone()).collect()
}

#[test]
fn events_are_told_by_the_step_that_passes_them() {
    let mut once = player(false, 1.0);
    assert!(events(&mut once, 0.0).is_empty());
    assert_eq!(events(&mut once, 0.25), ["start"]);
    assert_eq!(events(&mut once, 0.25), ["touch"]);
    assert!(events(&mut once, 0.25).is_empty());
    assert_eq!(events(&mut once, 9.0), ["end"]);
    assert!(events(&mut once, 1.0).is_empty(), "held at its end");
    once.set_speed(-1.0).unwrap();
    assert_eq!(events(&mut once, 9.0), ["touch", "start"], "the end was passed before");
    let mut round = player(true, 1.0);
    assert_eq!(events(&mut round, 2.0), ["start", "touch", "end", "start"]);
    assert_eq!(
        events(&mut round, 4.5),
        ["touch", "end", "start", "touch", "end", "start", "touch"]
    );
    round.set_speed(-2.0).unwrap();
    assert_eq!(events(&mut round, 0.5), ["start", "end"]);
    round.seek(0.5).unwrap();
    assert_eq!(events(&mut round, 0.1), ["touch"]);
    let mut back = player(false, -1.0);
    assert_eq!(events(&mut back, 2.0), ["end", "touch", "start"]);
}

/// A round that is played backward starts at its end: a first step of no time took that for the
/// start of the next round and told the events of both.
#[test]
fn a_step_of_no_time_passes_nothing() {
    for (looped, speed) in [(true, -1.0), (true, 1.0), (false, -1.0), (true, 0.0)] {
        let mut player = player(looped, speed);
        let before = player.time();
        for dt in [0.0, 1e-30, 0.0] {
            assert!(events(&mut player, dt).is_empty() || speed * dt > 0.0, "{looped} {speed}");
            assert!((player.time() - before).abs() < 1e-20);
        }
    }
    assert_eq!(events(&mut player(true, -1.0), 0.1), ["end"]);
}

#[test]
fn phases_and_the_end() {
    let mut player = player(false, 1.0);
    let phase = |player: &Player| player.phase().map(|phase| phase.name.clone());
    assert_eq!(phase(&player).as_deref(), Some("enter"));
    assert!(!player.step(1.0).unwrap().ended);
    assert_eq!(phase(&player), None);
    assert!(player.step(1.0).unwrap().ended);
    assert_eq!(phase(&player).as_deref(), Some("exit"));
    player.set_speed(-1.0).unwrap();
    assert!(!player.step(0.1).unwrap().ended);
    assert!(player.step(2.0).unwrap().ended);
    assert_eq!(player.motion().phase("exit").unwrap().start, 1.5);
}

#[test]
fn strides_match() {
    let mut player = player(true, 1.0);
    let own = player.motion().ground_speed();
    let factor = player.match_speed(1.2 * own, [0.7, 1.4]).unwrap();
    assert!((factor - 1.2).abs() < 1e-5);
    let played = player.step(2.0).unwrap();
    let way: f32 = 2.0 * 1.2 * own;
    assert!(played.root.place.length() < way);
    assert_eq!(player.match_speed(9.0, [0.7, 1.4]).unwrap(), 1.4);
    assert_eq!(player.match_speed(0.0, [0.7, 1.4]).unwrap(), 0.7);
    for (asked, range) in
        [(f32::NAN, [0.7, 1.4]), (1.0, [1.4, 0.7]), (1.0, [-1.0, 1.0]), (1.0, [0.5, f32::NAN])]
    {
        assert!(player.match_speed(asked, range).is_err());
    }
    assert_eq!(player.speed(), 0.7, "what is refused changes nothing");
}

#[test]
fn what_cannot_be_stepped_changes_nothing() {
    let mut player = player(true, 1.0);
    for dt in [-0.1, f32::NAN, f32::INFINITY, 4000.0] {
        assert!(player.step(dt).is_err());
    }
    assert!(player.seek(f64::NAN).is_err() && player.set_speed(f32::NAN).is_err());
    assert_eq!((player.time(), player.speed()), (0.0, 1.0));
    assert!(Player::new(motion(), Playback { speed: 101.0, ..Playback::default() }).is_err());
}

proptest! {
    /// The root's steps one after another, and the pose over them, are the clip's own way: for
    /// every round, either direction and however time is cut.
    #[test]
    fn root_steps_add_up(
        cuts in prop::collection::vec(0.0..1.5f32, 1..12), backward in any::<bool>(),
    ) {
        let motion = motion();
        let mut player = player(true, if backward { -1.0 } else { 1.0 });
        let way = cuts.iter().fold(GroundStep::default(), |way, &dt| way.then(player.step(dt).unwrap().root));
        let total: f64 = cuts.iter().map(|&dt| f64::from(dt)).sum();
        let (rounds, rest) = ((total / 2.0).floor() as u64, total % 2.0);
        let whole = motion.way(2.0);
        let expected = match backward {
            false => whole.times(rounds).then(motion.way(rest)),
            true => whole.inverse().times(rounds).then(whole.inverse()).then(motion.way(2.0 - rest)),
        };
        prop_assert!(way.place.distance(expected.place) < 1e-3, "{way:?} {expected:?}");
        prop_assert!((way.yaw - expected.yaw).abs() < 1e-3);
    }

    /// However time is cut, each event is passed as often.
    #[test]
    fn no_event_is_missed_or_doubled(
        cuts in prop::collection::vec(0_u32..90, 1..30), backward in any::<bool>(),
    ) {
        let speed = if backward { -1.0 } else { 1.0 };
        // Halves of frames: steps end on events often.
        let dts = cuts.iter().map(|&cut| cut as f32 / 120.0);
        let mut cut = player(true, speed);
        let all: Vec<_> = dts.clone().flat_map(|dt| events(&mut cut, dt)).collect();
        let total: f64 = dts.map(f64::from).sum();
        let count = |name: &str| all.iter().filter(|event| *event == name).count() as f64;
        let passed = |first: f64| ((total - first + 1e-4) / 2.0).floor() + 1.0;
        // Rounding may put the last step just before or after.
        let near = |got: f64, first: f64| {
            got == passed(first) || got == ((total - first - 1e-4) / 2.0).floor() + 1.0
        };
        let middle = if backward { 1.5 } else { 0.5 };
        prop_assert!(total == 0.0 || near(count("touch"), middle), "{all:?}");
        let [early, late] = if backward { ["end", "start"] } else { ["start", "end"] };
        prop_assert!(total == 0.0 || near(count(early), 0.0), "{all:?}");
        prop_assert!(near(count(late), 2.0), "{all:?}");
    }
}

#[test]
fn poses_with_and_without_the_root() {
    let mut free = player(false, 1.0);
    let mut kept =
        Player::new(motion(), Playback { keep_root: true, ..Playback::default() }).unwrap();
    let (mut a, mut b) = (Pose { local: vec![] }, Pose { local: vec![] });
    let way = free.step(1.0).unwrap().root;
    kept.step(1.0).unwrap();
    free.pose(&mut a);
    kept.pose(&mut b);
    assert!(a.local[0].translation.abs_diff_eq(Vec3::Y, 1e-6));
    assert!(a.local[0].rotation.angle_between(Quat::IDENTITY) < 1e-3);
    assert!(b.local[0].translation.abs_diff_eq(Vec3::new(0.2, 1.0, 1.5), 1e-4));
    let whole = way.transform() * a.local[0];
    assert!(whole.translation.abs_diff_eq(b.local[0].translation, 1e-5));
    assert!(whole.rotation.angle_between(b.local[0].rotation) < 1e-3);
}
