//! Nothing is allocated while a character moves: an allocator that counts, on this thread.
#![allow(unsafe_code)] // Only an allocator can tell, and only `unsafe` makes one.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::Arc;

use ambulo_layers::*;
use ambulo_rig::glam::{DQuat, DVec3, Vec2};
use ambulo_rig::{Clip, Joint, Pose, Skeleton};

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: the system's allocator does it all; the counter allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn allocations(what: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    what();
    COUNT.with(Cell::get) - before
}

fn skeleton() -> Skeleton {
    let joint = |index: usize| Joint {
        name: format!("joint{index}"),
        parent: index.checked_sub(1),
        offset: DVec3::Y,
        tips: vec![],
    };
    Skeleton::new((0..20).map(joint).collect()).unwrap()
}

fn motion(rate: f64) -> Arc<Motion> {
    let (skeleton, frames) = (skeleton(), 60);
    let turns = (0..frames * 20).map(|i| {
        let (frame, joint) = ((i / 20) as f64, (i % 20) as f64);
        DQuat::from_rotation_x((frame * rate * std::f64::consts::TAU / 59.0 + joint).sin())
    });
    let places = (0..frames).map(|f| DVec3::new(0.0, 1.0, 0.02 * f64::from(f)));
    let clip = Clip::new(skeleton, 1.0 / 60.0, vec![0], places.collect(), turns.collect());
    let mark = |time| Mark { name: "step".into(), time };
    let marks = Marks { events: vec![mark(0.1), mark(0.6)], phases: vec![] };
    Arc::new(Motion::new(&clip.unwrap(), 60.0, marks).unwrap())
}

const TREE: &str = r#"{"overlay": {
    "base": {"select": {"by": "what", "children": [
        {"blend_1d": {"by": "speed", "samples": [
            {"at": 0, "node": {"clip": {"name": "a"}}}, {"at": 2, "node": {"clip": {"name": "b"}}}]}},
        {"blend_2d": {"by": ["speed", "what"], "samples": [
            {"at": [0, 0], "node": {"clip": {"name": "a"}}},
            {"at": [1, 1], "node": {"clip": {"name": "b"}}},
            {"at": [0, 1], "node": {"clip": {"name": "b"}}}]}}]}},
    "over": {"additive": {"base": {"clip": {"name": "a"}}, "add": {"clip": {"name": "b"}},
        "reference": "a", "weight": "much"}},
    "weight": "much", "mask": [{"joint": "joint10", "up": 3}]}}"#;

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![0_u8; 100]))), 1);
}

#[test]
fn nothing_is_allocated_while_a_character_moves() {
    let skeleton = skeleton();
    let clips: BTreeMap<_, _> =
        [("a", 1.0), ("b", 2.0)].map(|(name, rate)| (name.to_string(), motion(rate))).into();
    let looped = Playback { looped: true, ..Playback::default() };
    let mut player = Player::new(clips["a"].clone(), looped).unwrap();
    let node: Node = serde_json::from_str(TREE).unwrap();
    let tree = BlendTree::new(&node, &clips, &skeleton).unwrap();
    let mut state = TreeState::new(&tree);
    let mut layer = Inertialiser::new(20, Decay::default()).unwrap();
    let parts = [Part { joint: "joint5".into(), up: 2, down: Some(3), weight: 1.0 }];
    let mask = Mask::new(&skeleton, &parts).unwrap();
    let space = BlendSpace2::new(vec![Vec2::ZERO, Vec2::X, Vec2::Y]).unwrap();
    let rest = skeleton.rest_pose();
    let [mut a, mut b, mut c, mut d, mut out]: [Pose; 5] = std::array::from_fn(|_| rest.clone());
    let (dt, mut seen) = (1.0 / 60.0, 0);
    let mut weights = [0.0; 3];
    let count = allocations(|| {
        for frame in 0..300 {
            let t = frame as f32 * dt;
            let played = player.step(dt).unwrap();
            seen += played.events(player.motion()).count();
            player.pose(&mut a);
            let parameters = [0.5 * t.sin() + 0.5, (frame / 50) as f32 % 2.0, 1.0 + t.cos()];
            if tree.switches(&mut state, &parameters).unwrap() {
                tree.step(&mut state, &parameters, 0.0, &mut c).unwrap();
                tree.step(&mut state, &parameters, dt, &mut b).unwrap();
                layer.switch(&c, &b, dt).unwrap();
            } else {
                tree.step(&mut state, &parameters, dt, &mut b).unwrap();
            }
            space.weights(Vec2::new(t.sin(), t.cos()), &mut weights).unwrap();
            let poses = [&a, &b, &rest];
            let layers = poses.into_iter().zip(weights);
            let layers = layers.map(|(pose, weight)| Layer { pose, weight, mask: Some(&mask) });
            weighted(layers, &rest, &mut c).unwrap();
            cross_fade(&b, &c, 0.4, Some(&mask), &mut d).unwrap();
            difference(&a, &rest, &mut c).unwrap();
            additive(&d, &c, 0.3, None, &mut a).unwrap();
            layer.step(&a, dt, &mut out).unwrap();
        }
    });
    assert_eq!(count, 0);
    assert!(seen >= 9, "{seen} events in five seconds");
}
