//! A character that uses things: what its network knows, when it may be stopped, what is added by
//! files alone.

mod common;

use std::sync::Arc;

use ambulo_control::{Controller, Intent, Model, World};
use ambulo_formats::keys;

use ambulo_net::Bundle;
use ambulo_rig::glam::{Vec2, Vec3};
use ambulo_scene::{Act, Actor, Body, Interaction, Moves, Phase, Physics, STEP, Scene, Told, Wish};
use common::playground::{Playground, model, starters};

/// A character in front of something of the playground.
struct Visitor {
    place: Playground,
    physics: Physics,
    actor: Actor,
}

impl Visitor {
    fn at(place: Vec2, yaw: f32) -> Self {
        let playground = Playground::read(&model());
        let mut physics = Physics::new(&playground.scene).unwrap();
        physics.place_character(Vec3::new(place.x, 0.0, place.y), 0.2, 1.75).unwrap();
        let (body, moves) = (playground.body.clone(), playground.moves.clone());
        let actor = Actor::new(&playground.model, body, moves, place, yaw, &physics).unwrap();
        Self { place: playground, physics, actor }
    }

    fn step(&mut self, wish: &Wish) -> Option<Told> {
        let told = self.actor.step(STEP, wish, &mut self.physics).told;
        self.physics.step(STEP).unwrap();
        self.actor.pose(STEP, &mut self.physics);
        told
    }

    /// Begins what is on offer with an object.
    fn begin(&mut self, object: &str) {
        let object = self.place.scene.object(object).unwrap();
        let offer = self.actor.offers(&self.physics).find(|&(on, _)| on == object);
        let (object, which) = offer.expect("it is on offer");
        self.step(&Wish { act: Some(Act::Begin { object, which }), ..Wish::default() });
    }

    fn until(&mut self, wanted: Told) {
        for _ in 0..1200 {
            if self.step(&Wish::default()) == Some(wanted) {
                return;
            }
        }
        panic!("{wanted:?} never comes: {:?}", self.actor.about());
    }
}

/// In front of the chair, looking at it.
fn seat() -> Visitor {
    Visitor::at(Vec2::new(-2.4, 1.5), -1.6)
}

/// A controller that is asked for the same, without any layer, has the same bits from the first step
/// on: through the walk there, sitting down, getting up.
#[test]
fn the_network_knows_nothing_of_the_layers() {
    let mut visitor = seat();
    let tuning = ambulo_control::Tuning { hold_feet: false, ..visitor.place.model.tuning() };
    let at = visitor.actor.root().position;
    let areas = Default::default();
    let world = World { terrain: visitor.physics.ground(), areas: &areas };
    let model = visitor.place.model.clone();
    let (start, yaw) = (Vec2::new(at.x, at.z), visitor.actor.root().yaw);
    let mut bare = Controller::new(model, tuning, start, yaw, &world).unwrap();
    let (mut seated, mut pose) = (false, visitor.actor.shown().clone());
    visitor.begin("chair");
    let mut wish = Wish::default();
    for frame in 0..900 {
        if frame > 0 {
            visitor.step(&wish);
        }
        let (intent, areas) = visitor.actor.asked();
        let world = World { terrain: visitor.physics.ground(), areas };
        bare.step(STEP, intent, &world);
        let own = visitor.actor.controller();
        assert_eq!((own.root(), own.phase()), (bare.root(), bare.phase()), "frame {frame}");
        assert_eq!(own.trajectory(), bare.trajectory(), "frame {frame}");
        let mut other = pose.clone();
        own.pose(&mut pose);
        bare.pose(&mut other);
        assert_eq!(pose, other, "frame {frame}");
        let clip = visitor.actor.about().and_then(|about| about.clip);
        if matches!(clip, Some((Phase::Hold, _))) {
            seated = true;
            wish.intent.velocity = Vec2::X;
        }
    }
    assert!(seated && visitor.actor.about().is_none(), "it sat, and got up again");
    assert!(visitor.actor.root().position.x > -2.0, "and walked");
}

/// Broken off at any frame, nothing pops: no joint goes farther in a frame than one that walks does.
#[test]
fn it_may_be_broken_off_at_any_frame() {
    let fastest = |visitor: &mut Visitor, wish: &Wish, frames: usize| {
        let mut most = 0.0f32;
        for _ in 0..frames {
            let before: Vec<_> = visitor.actor.global().iter().map(|j| j.translation).collect();
            visitor.step(wish);
            let moved = visitor.actor.global().iter().zip(before);
            most = moved.map(|(a, b)| a.translation.distance(b)).fold(most, f32::max);
        }
        most
    };
    let mut walker = Visitor::at(Vec2::new(0.0, -8.0), 0.0);
    let ahead = Intent { velocity: Vec2::new(0.0, 1.3), ..Intent::default() };
    let walk = Wish { intent: ahead, act: None };
    fastest(&mut walker, &walk, 60);
    let walking = fastest(&mut walker, &walk, 240);
    let mut visitor = seat();
    visitor.begin("chair");
    visitor.until(Told::Enters);
    let mut frame = 0;
    while visitor.actor.about().is_some() && frame < 360 {
        let mut broken = Visitor { actor: visitor.actor.clone(), ..seat() };
        let act = Wish { act: Some(Act::Interrupt), ..Wish::default() };
        assert_eq!(broken.actor.step(STEP, &act, &mut broken.physics).told, Some(Told::Broken));
        broken.actor.pose(STEP, &mut broken.physics);
        let most = fastest(&mut broken, &Wish::default(), 45);
        assert!(most <= 1.5 * walking, "frame {frame}: {most} m, walking {walking} m");
        let hips = broken.actor.global()[0].translation.y;
        assert!(hips > 0.85, "frame {frame}: it stands again, its hips at {hips} m");
        for _ in 0..17 {
            visitor.step(&Wish::default());
            frame += 1;
        }
    }
    assert!(frame > 300, "it was played");
}

const LEVER: &str = r#"
format = 1
name = "a room with a lever"
spawn = { place = [0.0, 0.0] }
[[ground]]
place = [0.0, 0.0]
size = [20.0, 20.0]
kind.flat = { height = 0.0 }
[[object]]
name = "lever"
place = [0.0, 2.0]
yaw = 3.14159
interactions = ["pull.toml"]
kind.lever = { height = 0.7, length = 0.4, limits = [-0.8, 0.8] }
"#;

/// Not one of those that ship: with a clip, the left hand, another place to stand.
const PULL: &str = r#"
format = 1
name = "pull it down"
object = "lever"
[trigger]
volume.sphere = { centre = [0.0, 0.0, 0.6], radius = 1.0 }
[approach]
place = [0.2, 0.52]
facing = 3.14159
gaits = ["walk"]
distance = 0.1
angle = 0.19
[clip]
file = "pull.keys"
enter = 0.0
hold = 0.6
exit = 1.4
end = 2.0
[[target]]
limb = "left_hand"
on = "grip"
point = [0.0, 0.012, 0.0]
rotation = [0.0, 1.0, 0.0, 0.0]
weight = [[0.1, 0.0], [0.6, 1.0], [1.4, 1.0], [1.9, 0.0]]
[action.hinge]
hand = "left_hand"
angle = 0.5
torque = 30.0
from = 0.65
until = 1.4
[exit]
when = "clip_ends"
"#;

const CLIP: &str = "keys 1
skeleton human.skeleton
fps 60
key 0 pose stand
key 0.6
  Hips at 0 0.94 0.03  turn -4 bend 4
  Spine Spine1 Spine2  turn -2 bend 3
  left_arm at 0.2 1.1 0.45  facing -90 0 0
key 1.4
  Hips at 0 0.93 0.0  turn 2 bend 2
  left_arm at 0.2 1.0 0.35  facing -90 0 0
key 1.5
  left_arm free
key 2.0 pose stand
";

/// The clip of a text that names a skeleton's.
fn clip_of(text: &str, skeleton: &str) -> ambulo_rig::Clip {
    let mut beside = |_: &str| Ok(skeleton.as_bytes().to_vec());
    keys::read(text.as_bytes(), &mut beside).unwrap().sample().clip
}

/// Two files add an interaction: no code, and no bit of the model.
#[test]
fn a_lever_is_added_by_a_file_and_a_clip() {
    let before = std::fs::read(starters().join("human.safetensors")).unwrap();
    let model: Model = model();
    let scene = Scene::parse(LEVER).unwrap();
    let pull = Interaction::parse(PULL).unwrap();
    let skeleton = std::fs::read_to_string(starters().join("clips/human.skeleton")).unwrap();
    let clip = clip_of(CLIP, &skeleton);
    let body = Arc::new(Body::new(&model).unwrap());
    let moves = Moves::new(&body, &scene, &[("pull.toml".into(), pull)], |file| {
        (file == "pull.keys").then_some(&clip)
    });
    let mut physics = Physics::new(&scene).unwrap();
    physics.place_character(Vec3::new(0.0, 0.0, 1.0), 0.2, 1.75).unwrap();
    let moves = Arc::new(moves.unwrap());
    let mut actor = Actor::new(&model, body, moves, Vec2::Y, 0.0, &physics).unwrap();
    let mut wish = Wish { act: Some(Act::Begin { object: 0, which: 0 }), ..Wish::default() };
    let (mut off, mut ended) = (0.0f32, false);
    for _ in 0..900 {
        ended |= actor.step(STEP, &wish, &mut physics).told == Some(Told::Ended);
        physics.step(STEP).unwrap();
        actor.pose(STEP, &mut physics);
        wish.act = None;
        for led in actor.led().iter().filter(|led| led.weight > 0.999) {
            off = off.max(led.wanted.translation.distance(led.reached.translation));
        }
    }
    assert!(ended && (physics.joint(0).unwrap() - 0.5).abs() < 0.05, "{:?}", physics.joint(0));
    assert!(off > 0.0 && off < 0.01, "the hand is {off} m off");
    // Not a bit of the model has changed.
    let bytes = |bundle: &Bundle| bundle.to_bytes(bundle.precision()).unwrap();
    assert_eq!(bytes(model.bundle()), bytes(&Bundle::from_bytes(&before).unwrap()));
}
