//! Who plays the script: wishes, frame by frame, as a player would have them.

use ambulo_control::{Gait as Pace, Intent};
use ambulo_rig::glam::Vec2;

use super::script::{Interruptions, Script, Task};
use crate::actor::{Act, Actor, Moves, Phase, Told, Wish, ahead};
use crate::interaction::{Action, When};
use crate::{Gait, Physics, Scene};

/// Metres from a place to have been there.
const THERE: f32 = 0.35;
/// Metres a second at which a player walks.
const WALK: f32 = 1.3;
/// Seconds for one task; then it is left undone.
const PATIENCE: f32 = 90.0;
/// Seconds of plain walking after each interaction.
const AFTER: f32 = 0.8;

/// SplitMix64 (Steele, Lea, Flood, 2014): every random choice of a visit.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next()
    }
}

/// How an interaction is disturbed.
#[derive(Clone, Copy)]
enum Disturbance {
    Break,
    Leave,
    /// The player pushes the stick backward for half a second.
    Away,
}

/// One that is planned, or under way.
#[derive(Clone, Copy)]
struct Planned {
    /// Seconds since the character walks there.
    at: f32,
    how: Disturbance,
}

/// Plays a script.
pub(super) struct Driver {
    tasks: Vec<Task>,
    /// Object of each task that uses one, and which move.
    uses: Vec<Option<(usize, Option<usize>)>>,
    interruptions: Interruptions,
    disturbed: bool,
    chance: Chance,
    at: usize,
    /// Seconds in this task, and since its interaction has begun and holds.
    spent: f32,
    begun: Option<f32>,
    held: Option<f32>,
    /// Next place of what is carried.
    carried: usize,
    planned: Option<Planned>,
    left: u32,
    /// Seconds and velocity of what the player does for its own sake.
    strolls: (f32, Vec2),
    about: Option<(usize, usize)>,
    asked: bool,
    undone: Vec<usize>,
}

impl Driver {
    pub fn new(script: &Script, scene: &Scene, moves: &Moves, seed: u64) -> Self {
        let using = |task: &Task| {
            let object = scene.object(task.using.as_ref()?)?;
            let named = |file: &String| moves.all().iter().position(|one| one.file == *file);
            Some((object, task.with.as_ref().and_then(named)))
        };
        let mut driver = Self {
            uses: script.tasks.iter().map(using).collect(),
            tasks: script.tasks.clone(),
            interruptions: script.interruptions,
            disturbed: seed != 0,
            chance: Chance(seed),
            at: 0,
            spent: 0.0,
            begun: None,
            held: None,
            carried: 0,
            planned: None,
            left: 0,
            strolls: (0.0, Vec2::ZERO),
            about: None,
            asked: false,
            undone: vec![],
        };
        driver.left = driver.interruptions.most;
        driver
    }

    /// How far from the scene's start a visit with this seed begins, metres and radians.
    pub fn start(&mut self) -> (Vec2, f32) {
        if !self.disturbed {
            return (Vec2::ZERO, 0.0);
        }
        let off = Vec2::new(self.chance.between(-0.5, 0.5), self.chance.between(-0.5, 0.5));
        (off, self.chance.between(-1.0, 1.0))
    }

    pub fn is_over(&self) -> bool {
        self.at >= self.tasks.len()
    }

    /// Tasks that were given up.
    pub fn undone(&self) -> &[usize] {
        &self.undone
    }

    /// The interaction that was begun last.
    pub fn about(&self) -> Option<(usize, usize)> {
        self.about
    }

    /// What the player wishes in the next frame of `dt` seconds.
    pub fn wish(&mut self, actor: &Actor, world: &Physics, dt: f32) -> Wish {
        self.spent += dt;
        for clock in [&mut self.begun, &mut self.held].into_iter().flatten() {
            *clock += dt;
        }
        if self.spent > PATIENCE && actor.about().is_none() {
            self.undone.push(self.at);
            self.next();
        }
        if self.strolls.0 > 0.0 {
            self.strolls.0 -= dt;
            return walk(self.strolls.1, Pace::Walk);
        }
        let Some(task) = self.tasks.get(self.at).cloned() else { return Wish::default() };
        if let Some(wish) = self.disturb(actor) {
            return wish;
        }
        if let Some(place) = task.go {
            let (wish, there) = go(actor, place, task.gait);
            if there {
                self.next();
            }
            return wish;
        }
        if let Some(seconds) = task.wait {
            if self.spent >= seconds {
                self.next();
            }
            return Wish::default();
        }
        match self.uses[self.at] {
            Some(uses) => self.using(&task, uses, actor, world),
            None => Wish::default(),
        }
    }

    fn using(
        &mut self,
        task: &Task,
        (object, which): (usize, Option<usize>),
        actor: &Actor,
        world: &Physics,
    ) -> Wish {
        let Some(about) = actor.about() else {
            // On the way to where it is on offer.
            let mut offers = actor.offers(world);
            let wanted =
                |&(on, one): &(usize, usize)| on == object && which.is_none_or(|w| w == one);
            if let Some((object, which)) = offers.find(wanted) {
                self.about = Some((object, which));
                return Wish { act: Some(Act::Begin { object, which }), ..Wish::default() };
            }
            let of = |&&(on, one): &&(usize, usize)| wanted(&(on, one));
            let offered = actor.moves().offers().iter().find(of);
            let Some(&(_, which)) = offered else { return Wish::default() };
            let approach = &actor.moves().all()[which].interaction.approach;
            let Some(frame) = world.frame(object, &approach.on) else { return Wish::default() };
            let (place, _) = approach.stand(frame);
            return go(actor, place.into(), None).0;
        };
        self.about = Some((about.object, about.which));
        let Some((Phase::Hold, _)) = about.clip else { return Wish::default() };
        self.holding(task, about.which, actor)
    }

    /// What the player does while it holds.
    fn holding(&mut self, task: &Task, which: usize, actor: &Actor) -> Wish {
        let interaction = &actor.moves().all()[which].interaction;
        let held = self.held.unwrap_or(0.0);
        let forward = ahead(actor.root().yaw) * WALK;
        if let Some(&place) = task.carry.get(self.carried) {
            let (wish, there) = go(actor, place, None);
            if there {
                self.carried += 1;
            }
            return wish;
        }
        let over = held >= task.stay.unwrap_or(2.0);
        match (interaction.exit.when, &interaction.action) {
            (When::PlayerStops, Some(Action::Push { .. })) if !over => walk(forward, Pace::Walk),
            (When::PlayerMoves, _) if over => walk(forward, Pace::Walk),
            (When::PlayerAsks, _) if over && !self.asked => {
                self.asked = true;
                Wish { act: Some(Act::Leave), ..Wish::default() }
            }
            _ => Wish::default(),
        }
    }

    /// What the player does to break an interaction off, if it is time to.
    fn disturb(&mut self, actor: &Actor) -> Option<Wish> {
        let planned = self.planned?;
        if self.begun? < planned.at {
            return None;
        }
        self.planned = None;
        let backward = ahead(actor.root().yaw) * -WALK;
        let act = match planned.how {
            Disturbance::Break => Some(Act::Interrupt),
            Disturbance::Leave => Some(Act::Leave),
            Disturbance::Away => {
                self.strolls = (0.5, backward);
                None
            }
        };
        Some(Wish { act, ..walk(backward, Pace::Walk) })
    }

    /// What became of it.
    pub fn hear(&mut self, told: Option<Told>) {
        match told {
            Some(Told::Walks) => {
                (self.begun, self.held, self.carried, self.asked) = (Some(0.0), None, 0, false);
                if self.disturbed && self.left > 0 && self.chance.next() < 0.8 {
                    self.left -= 1;
                    let at = self.chance.between(0.0, self.interruptions.within);
                    let how = match self.chance.next() {
                        x if x < 0.5 => Disturbance::Break,
                        x if x < 0.8 => Disturbance::Leave,
                        _ => Disturbance::Away,
                    };
                    self.planned = Some(Planned { at, how });
                }
            }
            Some(Told::Holds) => self.held = Some(0.0),
            Some(Told::Ended) => {
                // Left early it is done again, whole.
                let whole = self.held.is_some();
                let early = self.tasks.get(self.at).is_some_and(|task| {
                    let stay = task.stay.unwrap_or(0.0);
                    self.carried < task.carry.len() || self.held.unwrap_or(0.0) < stay
                });
                self.free();
                if whole && !early {
                    self.next();
                }
            }
            Some(Told::Broken | Told::GaveUp(_)) => self.free(),
            _ => {}
        }
    }

    /// It goes somewhere before the next thing.
    fn free(&mut self) {
        (self.begun, self.held, self.planned) = (None, None, None);
        let angle = self.chance.between(0.0, std::f32::consts::TAU);
        if self.disturbed {
            let way = Vec2::new(libm::sinf(angle), libm::cosf(angle)) * WALK;
            self.strolls = (AFTER, way);
        }
    }

    fn next(&mut self) {
        self.at += 1;
        (self.spent, self.begun, self.held, self.planned) = (0.0, None, None, None);
        self.left = self.interruptions.most;
    }
}

fn walk(velocity: Vec2, gait: Pace) -> Wish {
    Wish { intent: Intent { velocity, gait, ..Intent::default() }, act: None }
}

/// Towards a place; whether it is there.
fn go(actor: &Actor, place: [f32; 2], gait: Option<Gait>) -> (Wish, bool) {
    let root = actor.root().position;
    let left = Vec2::from(place) - Vec2::new(root.x, root.z);
    let (pace, speed) = match gait.unwrap_or(Gait::Walk) {
        Gait::Stand | Gait::Walk => (Pace::Walk, WALK),
        Gait::Jog => (Pace::Jog, 2.6),
        Gait::Run => (Pace::Run, 4.0),
        Gait::Crouch => (Pace::Crouch, 0.8),
    };
    (walk(left.normalize_or_zero() * speed, pace), left.length() < THERE)
}
