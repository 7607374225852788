//! A character that walks by its network and uses what is around it.
//!
//! Each frame has two halves, the world's own physics between them:
//!
//! 1. [`Actor::step`]: sense, decide, walk. What is in the way becomes walls of the controller, the
//!    player's wish or the interaction's becomes its intent, the network moves on, and the object is
//!    told what is done to it.
//! 2. [`Actor::pose`]: network → clip blend → inertialisation → IK (hips, feet, hands, look) → pose, at
//!    the places where the objects are after the world's step.
//!
//! Nothing of the second half is told to the network: it keeps its own copy of its pose. Every change
//! of what is played is inertialised, so that an interaction may be left at any frame.
//!
//! Source: `interactions` of Silva, Sugahara, Ugarte, "Neuranimation: Reactive Character Animations with
//! Deep Neural Networks" (GRAPP 2022): a clip over the network's motion, limbs led to the object.

mod acting;
mod body;
mod compose;
mod deeds;
mod moves;

use std::sync::Arc;

use ambulo_control::{
    Areas, ControlError, Controller, Gait, Intent, Model, Root, Step, Tuning, World,
};
use ambulo_layers::{Decay, FeetState, Inertialiser, LookState};
use ambulo_rig::glam::Vec2;
use ambulo_rig::{Pose, Transform};

use crate::approach::{Going, Walk, Why};
use crate::exact::{ahead, level};
use crate::interaction::{Action, Limb, Walks};
use crate::surroundings::Surroundings;

use acting::Acting;
pub use acting::Phase;
pub use body::{Body, BodyError};
use deeds::Held;
pub use moves::{Move, MoveError, Moves};

/// Metres that are kept from walls and objects, and at most from what is used.
const KEEP: f32 = 0.35;
const USED: f32 = 0.22;
/// Nearer than the first to what was used it only steps back, at so many metres a second; beyond the
/// second it goes where it wants. Metres.
const ROOM: [f32; 2] = [0.2, 0.32];
const BACK: f32 = 0.7;
/// Metres over which distances are compared.
const STEP: f32 = 0.01;
/// Share of the angle to which a hinge is to be led up to which it counts as not led yet.
const AT_REST: f32 = 0.1;
/// Who is to stand does when slower than this, metres a second; waited for so long, seconds.
const SETTLED: (f32, f32) = (0.15, 1.5);
/// Metres around the character in which there are walls.
const WITHIN: f32 = 2.5;
/// Metres: what is used may be nearer than others, by this much more than it has to …
const SPARE: f32 = 0.05;
/// … but not nearer than this.
const LEAST: f32 = 0.02;

/// What a player wants.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wish {
    /// How to move.
    pub intent: Intent,
    /// What to do about interactions.
    pub act: Option<Act>,
}

/// What a player wants of an interaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// One that is on offer: its object, and which of [`Moves::all`].
    Begin {
        /// As the surroundings have it.
        object: usize,
        /// Index into [`Moves::all`].
        which: usize,
    },
    /// To leave it the way it ends: stand up, put down. What has only begun is broken off.
    Leave,
    /// To break it off in this frame, whatever it is.
    Interrupt,
}

/// What became of an interaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// It walks to where it begins.
    Walks,
    /// The clip begins.
    Enters,
    /// Hands on the handle, hips on the seat.
    Holds,
    /// It leaves.
    Exits,
    /// It is over, and the player has the character again.
    Ended,
    /// It was broken off.
    Broken,
    /// The way to it was given up.
    GaveUp(Why),
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Acted {
    /// Of the controller.
    pub step: Step,
    /// The newest thing to tell, if there is one.
    pub told: Option<Told>,
}

/// A limb on its way to an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Led {
    /// Which.
    pub limb: Limb,
    /// How much it is led, 0 to 1.
    pub weight: f32,
    /// Where it should be, in the world: a palm, the middle of the hips, what is looked at.
    pub wanted: Transform,
    /// Where it is; of a look, where the head is.
    pub reached: Transform,
    /// Whether the rotation is wanted, too.
    pub turned: bool,
    /// Whether a hand slips off in this frame, because what it held goes where it does not reach; the
    /// interaction is broken off in the next.
    pub slips: bool,
}

/// What a character is about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct About {
    /// With which object.
    pub object: usize,
    /// Which of [`Moves::all`].
    pub which: usize,
    /// Phase and second of its clip; none while it walks there.
    pub clip: Option<(Phase, f32)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Free,
    /// On the way to where a move begins, and for how long it has been there.
    Walking {
        object: usize,
        which: usize,
        walk: Walk,
        there: f32,
    },
    Acting(Acting),
}

/// What is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Network,
    /// A move's clip, the whole body.
    Clip(usize),
    /// A move's clip over the network's legs.
    Upper(usize),
}

/// One character.
#[derive(Clone, Debug)]
pub struct Actor {
    controller: Controller,
    body: Arc<Body>,
    moves: Arc<Moves>,
    stage: Stage,
    areas: Areas,
    asked: Intent,
    told: Option<Told>,
    /// What was played in the frame before.
    played: Source,
    /// A jump within the same clip.
    jumped: bool,
    /// What the hands hold.
    holds: Option<Held>,
    /// How quickly the clip goes on: it waits for who does not reach.
    pace: f32,
    /// A hand slipped off what it held.
    slips: bool,
    /// How far the clip went in this frame, seconds.
    tick: f32,
    /// What it uses or has just used, and how near it may come to that, metres.
    near: Option<(usize, f32)>,
    /// Of the root over the last step, (x, z), metres a second.
    velocity: Vec2,
    inertialiser: Inertialiser,
    feet: FeetState,
    look: LookState,
    /// The network's pose in this frame and in the one before.
    network: [Pose; 2],
    source: [Pose; 2],
    clip: Pose,
    shown: Pose,
    global: Vec<Transform>,
    led: Vec<Led>,
}

impl Actor {
    /// A character that stands at a place (x, z) and faces a yaw. It moves by the bundle's own tuning;
    /// one that has none is moved responsively ([`Tuning::responsive`]).
    ///
    /// # Errors
    /// A start that is not finite.
    pub fn new(
        model: &Model,
        body: Arc<Body>,
        moves: Arc<Moves>,
        place: Vec2,
        facing: f32,
        around: &dyn Surroundings,
    ) -> Result<Self, ControlError> {
        // Whoever says nothing starts and turns at once: the last steps to a handle are short ones.
        let own = model.tuning();
        let mut tuning = if own == Tuning::default() { own.responsive() } else { own };
        // The feet's own layer holds them.
        tuning.hold_feet = false;
        let areas = Areas::default();
        let world = World { terrain: around.terrain(), areas: &areas };
        let controller = Controller::new(model.clone(), tuning, place, facing, &world)?;
        let joints = body.skeleton.len();
        let mut pose = body.skeleton.rest_pose();
        controller.pose(&mut pose);
        let mut global = vec![Transform::IDENTITY; joints];
        pose.to_global(&body.skeleton, &mut global);
        let inertialiser = Inertialiser::new(joints, Decay::default()).expect("a good decay");
        Ok(Self {
            controller,
            stage: Stage::Free,
            areas,
            asked: Intent::default(),
            told: None,
            played: Source::Network,
            jumped: false,
            holds: None,
            pace: 1.0,
            slips: false,
            tick: 0.0,
            near: None,
            velocity: Vec2::ZERO,
            inertialiser,
            feet: FeetState::default(),
            look: body.look.state(),
            network: [pose.clone(), pose.clone()],
            source: [pose.clone(), pose.clone()],
            clip: pose.clone(),
            shown: pose,
            global,
            led: Vec::with_capacity(8),
            body,
            moves,
        })
    }

    /// The first half of a frame of `dt` seconds: decides and walks. After it the world's physics
    /// moves on, then [`Actor::pose`] is called. Allocates nothing once the walls around have been
    /// met.
    pub fn step(&mut self, dt: f32, wish: &Wish, around: &mut dyn Surroundings) -> Acted {
        self.told = None;
        self.sense(around);
        let intent = self.decide(dt, wish, around);
        self.asked = intent;
        let world = World { terrain: around.terrain(), areas: &self.areas };
        let before = level(self.controller.root().position);
        let step = self.controller.step(dt, &intent, &world);
        let place = self.controller.root().position;
        if dt > 0.0 {
            self.velocity = (level(place) - before) / dt;
        }
        around.character_at(place);
        self.act(around);
        Acted { step, told: self.told }
    }

    /// Where it is.
    pub fn root(&self) -> Root {
        self.controller.root()
    }

    /// The pose after the last [`Actor::pose`]: local transforms, the root joint's in the world.
    pub fn shown(&self) -> &Pose {
        &self.shown
    }

    /// The same, every joint in the world.
    pub fn global(&self) -> &[Transform] {
        &self.global
    }

    /// Its controller: what the network does, which no layer changes.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// What was asked of the controller in the last [`Actor::step`], and what it was to keep out of.
    pub fn asked(&self) -> (&Intent, &Areas) {
        (&self.asked, &self.areas)
    }

    /// Its body.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// What it can do.
    pub fn moves(&self) -> &Moves {
        &self.moves
    }

    /// Whether left and right foot are held where they stand.
    pub fn stands(&self) -> [bool; 2] {
        self.feet.held()
    }

    /// The limbs that were led in the last [`Actor::pose`].
    pub fn led(&self) -> &[Led] {
        &self.led
    }

    /// What it is about, if that is an interaction.
    pub fn about(&self) -> Option<About> {
        match self.stage {
            Stage::Free => None,
            Stage::Walking { object, which, .. } => Some(About { object, which, clip: None }),
            Stage::Acting(Acting { object, which, phase, time, .. }) => {
                Some(About { object, which, clip: Some((phase, time)) })
            }
        }
    }

    /// What is on offer where it stands: objects and moves, those that win first.
    pub fn offers<'a>(
        &'a self,
        around: &'a dyn Surroundings,
    ) -> impl Iterator<Item = (usize, usize)> + 'a {
        let feet = self.controller.root().position;
        self.moves.offers().iter().copied().filter(move |&(object, which)| {
            let interaction = &self.moves.all()[which].interaction;
            let trigger = &interaction.trigger;
            let within = around.frame(object, &trigger.on).is_some_and(|frame| {
                trigger.volume.contains(frame.inverse().transform_point(feet))
            });
            // A door that is open, or still on its way, is not opened.
            let rests = match interaction.action {
                Some(Action::Hinge { angle, .. }) => {
                    around.turned(object).abs() < AT_REST * angle.abs()
                }
                _ => true,
            };
            within && rests
        })
    }

    /// What is in the way becomes walls of the controller.
    fn sense(&mut self, around: &dyn Surroundings) {
        let place = level(self.controller.root().position);
        if let (Stage::Free, Some((object, room))) = (self.stage, self.near) {
            // Nobody is pushed off what was used: the distance to keep grows as it walks away.
            let room = room.max(around.distance(object, place) - LEAST);
            self.near = (room < KEEP).then_some((object, room));
        }
        self.areas.walls.clear();
        around.walls(place, WITHIN, KEEP, self.near, &mut self.areas.walls);
    }

    /// What to ask of the controller.
    fn decide(&mut self, dt: f32, wish: &Wish, around: &mut dyn Surroundings) -> Intent {
        match (self.stage, wish.act) {
            (Stage::Free, Some(Act::Begin { object, which }))
                if self.begin(object, which, around) =>
            {
                return standing(ahead(self.controller.root().yaw));
            }
            (Stage::Walking { .. }, Some(Act::Leave | Act::Interrupt)) => {
                self.stage = Stage::Free;
                self.told = Some(Told::Broken);
            }
            (Stage::Acting(_), Some(Act::Interrupt)) => self.break_off(around),
            _ => {}
        }
        if let Stage::Walking { object, which, mut walk, there } = self.stage {
            let root = self.controller.root();
            match walk.step(root, wish.intent.velocity, dt) {
                Going::On(intent) => {
                    self.stage = Stage::Walking { object, which, walk, there };
                    return intent;
                }
                Going::There if self.settles(which, there) => {
                    self.stage = Stage::Walking { object, which, walk, there: there + dt };
                    return standing(ahead(root.yaw));
                }
                Going::There => self.enter(object, which, around),
                Going::GaveUp(why) => {
                    self.stage = Stage::Free;
                    self.told = Some(Told::GaveUp(why));
                }
            }
        }
        match self.stage {
            Stage::Acting(_) => self.go_on(dt, wish, around),
            _ => self.around_what_was_used(wish.intent, around),
        }
    }

    /// Who stands close to what was used and wants to go steps back from it before it turns: feet
    /// that swing reach half a metre.
    fn around_what_was_used(&self, intent: Intent, around: &dyn Surroundings) -> Intent {
        let Some((object, room)) = self.near.filter(|_| intent.velocity.length() > SETTLED.0)
        else {
            return intent;
        };
        let root = self.controller.root();
        let place = level(root.position);
        let [here, x, z] = [Vec2::ZERO, Vec2::X * STEP, Vec2::Y * STEP]
            .map(|off| around.distance(object, place + off));
        let out = Vec2::new(x - here, z - here).normalize_or_zero();
        let close = ((ROOM[1] - room) / (ROOM[1] - ROOM[0])).clamp(0.0, 1.0);
        let along = intent.velocity - out * intent.velocity.dot(out).min(0.0);
        let velocity = along.lerp(out * BACK, close);
        if close == 0.0 {
            return Intent { velocity, ..intent };
        }
        let (facing, strafe) = (Some(ahead(root.yaw)), intent.strafe.max(close));
        Intent { velocity, facing, strafe, ..intent }
    }

    /// Whether it must come to rest before a clip that stands.
    fn settles(&self, which: usize, there: f32) -> bool {
        let stands = self.moves.all()[which].interaction.clip.walks != Walks::Always;
        let rests = self.velocity.length() < SETTLED.0 && self.feet.held() == [true; 2];
        stands && !rests && there < SETTLED.1
    }

    /// Whether it is on offer, and it walks there from the next step on.
    fn begin(&mut self, object: usize, which: usize, around: &dyn Surroundings) -> bool {
        let approach = &self.moves.all()[which].interaction.approach;
        let offered = self.offers(around).any(|offer| offer == (object, which));
        let Some(frame) = around.frame(object, &approach.on).filter(|_| offered) else {
            return false;
        };
        let stand = approach.stand(frame);
        let walk = Walk::new(approach, stand);
        let room = (around.distance(object, stand.0) - SPARE).clamp(LEAST, USED);
        self.near = Some((object, room));
        self.stage = Stage::Walking { object, which, walk, there: 0.0 };
        self.told = Some(Told::Walks);
        true
    }
}

/// To stand and look somewhere.
fn standing(facing: Vec2) -> Intent {
    Intent { velocity: Vec2::ZERO, facing: Some(facing), strafe: 1.0, gait: Gait::Walk }
}
