//! Who plays the script: wishes, frame by frame, as a player would have them.

use ambulo_control::{Gait as Pace, Intent};
use ambulo_rig::Terrain;
use ambulo_rig::glam::{Vec2, Vec3};

use super::script::{Interruptions, Script, Task};
use crate::actor::{Act, Actor, Moves, Phase, Told, Wish};
use crate::exact::{ahead, level};
use crate::interaction::{Action, Walks, When, stand};
use crate::object::Kind;
use crate::surroundings::Surroundings;
use crate::{Gait, Hit, Physics, Scene, What};

/// Metres from a place to have been there.
const THERE: f32 = 0.35;
/// Metres a second at which a player walks.
const WALK: f32 = 1.3;
/// Seconds for one task; then it is left undone.
const PATIENCE: f32 = 90.0;
/// Seconds of plain walking after each interaction.
const AFTER: f32 = 0.8;

/// A hinge that is turned by more, radians, is waited for, so many metres behind where it begins.
const OPEN: f32 = 0.05;
const CLEAR: f32 = 0.9;
/// Seconds on the way to a place after which it looks for another one.
const LOOKS_ROUND: f32 = 6.0;
/// Metres that a player looks ahead, and the turns to go around what is in the way, radians.
const LOOKS: f32 = 1.2;
const AROUND: [f32; 7] = [0.0, 0.35, 0.7, 1.05, 1.4, 1.75, 2.1];
/// Half of how wide a way must be, metres.
const SHOULDER: f32 = 0.3;

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
    /// Of the scene's objects.
    kinds: Vec<Kind>,
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
    /// What is used is not what the script says, but leads to it.
    detour: bool,
    /// To which side it went around what was in the way.
    side: f32,
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
            kinds: scene.objects.iter().map(|object| object.kind).collect(),
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
            detour: false,
            side: 1.0,
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
        if self.spent > PATIENCE {
            if actor.about().is_some() {
                return Wish { act: Some(Act::Interrupt), ..Wish::default() };
            }
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
        if let Some(to) = task.go {
            let to = to.into();
            if let Some(wish) = self.passing(actor, world, to) {
                return wish;
            }
            let (wish, there) = self.go(actor, world, to, task.gait);
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
        if let Some(about) = actor.about() {
            self.about = Some((about.object, about.which));
            return match about.clip {
                Some((Phase::Hold, _)) => self.holding(task, about.which, actor, world),
                _ => Wish::default(),
            };
        }
        let offered = actor.moves().offers().iter().copied();
        let offered = offered.filter(|&(on, _)| on == object);
        let wanted = |which_: usize| which.is_none_or(|which| which == which_);
        let stands = |which: usize| {
            let approach = &actor.moves().all()[which].interaction.approach;
            Some(approach.stand(world.frame(object, &approach.on)?).0)
        };
        // Whoever is on the wrong side of a door, broken off halfway, goes through it first.
        let from = place(actor);
        let near = |&(_, one): &(usize, usize)| stands(one).is_some_and(|to| sees(world, from, to));
        let one = offered.clone().filter(|&(_, one)| wanted(one)).find(near);
        let other = || offered.clone().filter(|&(_, one)| passes(actor, one)).find(near);
        let one = one.or_else(other).or_else(|| {
            let mut offered = offered.clone();
            offered.find(|&(_, one)| wanted(one))
        });
        let Some((_, one)) = one else { return Wish::default() };
        self.detour = !wanted(one);
        self.begin(actor, world, object, one)
    }

    /// Begins an interaction, or goes where it is on offer.
    fn begin(&mut self, actor: &Actor, world: &Physics, object: usize, which: usize) -> Wish {
        if actor.offers(world).any(|offer| offer == (object, which)) {
            self.about = Some((object, which));
            return Wish { act: Some(Act::Begin { object, which }), ..Wish::default() };
        }
        let approach = &actor.moves().all()[which].interaction.approach;
        let at = world.frame(object, "object").zip(self.kinds[object].frame_at_rest(&approach.on));
        let frame = match at {
            Some((at, rest)) if world.turned(object).abs() > OPEN => Some(at * rest),
            _ => world.frame(object, &approach.on),
        };
        let Some((stand, yaw)) = frame.map(|frame| approach.stand(frame)) else {
            return Wish::default();
        };
        // Where the leaf of a door that shuts does not meet it.
        let open = world.turned(object).abs() > OPEN;
        let to = if open { stand - ahead(yaw) * CLEAR } else { stand };
        let (wish, there) = self.go(actor, world, to, None);
        if there && open { Wish::default() } else { wish }
    }

    /// Through a door, when the place to go to is behind it.
    fn passing(&mut self, actor: &Actor, world: &Physics, to: Vec2) -> Option<Wish> {
        if let Some(about) = actor.about() {
            self.about = Some((about.object, about.which));
            return Some(Wish::default());
        }
        let from = place(actor);
        if self.spent < LOOKS_ROUND || sees(world, from, to) {
            return None;
        }
        let leads = |&(object, which): &(usize, usize)| {
            let interaction = &actor.moves().all()[which].interaction;
            let (approach, exit) = (&interaction.approach, &interaction.exit);
            let (Some(here), Some(there)) =
                (world.frame(object, &approach.on), world.frame(object, &exit.on))
            else {
                return false;
            };
            let here = approach.stand(here).0;
            let (beyond, _) = stand(there, exit.place.unwrap_or_default(), 0.0);
            passes(actor, which) && sees(world, from, here) && sees(world, beyond, to)
        };
        let (object, which) = actor.moves().offers().iter().copied().find(leads)?;
        self.detour = true;
        Some(self.begin(actor, world, object, which))
    }

    /// Towards a place, around what is in the way; whether it is there.
    fn go(&mut self, actor: &Actor, world: &Physics, to: Vec2, gait: Option<Gait>) -> (Wish, bool) {
        let from = place(actor);
        let left = to - from;
        let (pace, speed) = match gait.unwrap_or(Gait::Walk) {
            Gait::Stand | Gait::Walk => (Pace::Walk, WALK),
            Gait::Jog => (Pace::Jog, 2.6),
            Gait::Run => (Pace::Run, 4.0),
            Gait::Crouch => (Pace::Crouch, 0.8),
        };
        let way = left.normalize_or_zero();
        let carries = actor.about().map(|about| about.object);
        // As far as it looks; with both shoulders, so that it does not brush along.
        let far = left.length().min(LOOKS);
        let open = |turn: f32| {
            let way = Vec2::from_angle(turn).rotate(way);
            let aside = way.perp() * SHOULDER;
            let sides = [Vec2::ZERO, aside, -aside];
            sides.into_iter().all(|off| free(world, from + off, way, far, carries) >= far)
        };
        let side = if self.side < 0.0 { -1.0 } else { 1.0 };
        let turns = AROUND.iter().flat_map(|&turn| [turn * side, -turn * side]);
        let turn = turns.into_iter().find(|&turn| open(turn)).unwrap_or(0.0);
        if turn != 0.0 {
            self.side = turn;
        }
        let velocity = Vec2::from_angle(turn).rotate(way) * speed;
        (walk(velocity, pace), left.length() < THERE)
    }

    /// What the player does while it holds.
    fn holding(&mut self, task: &Task, which: usize, actor: &Actor, world: &Physics) -> Wish {
        let interaction = &actor.moves().all()[which].interaction;
        let held = self.held.unwrap_or(0.0);
        let forward = ahead(actor.root().yaw) * WALK;
        if let Some(&to) = task.carry.get(self.carried) {
            let (wish, there) = self.go(actor, world, to.into(), None);
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
                if whole && !early && !self.detour {
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
            let way = ahead(angle) * WALK;
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

/// Whether a move leads through something.
fn passes(actor: &Actor, which: usize) -> bool {
    let interaction = &actor.moves().all()[which].interaction;
    interaction.clip.walks == Walks::Always && interaction.exit.place.is_some()
}

/// (x, z) of where a character is.
fn place(actor: &Actor) -> Vec2 {
    level(actor.root().position)
}

/// Metres that are free in front of somebody at a place, at most `far`, whatever it carries.
fn free(world: &Physics, from: Vec2, way: Vec2, far: f32, carries: Option<usize>) -> f32 {
    let at = |height: f32| Vec3::new(from.x, world.height(from.x, from.y) + height, from.y);
    let along = Vec3::new(way.x, 0.0, way.y);
    // Low things and high ones; a door's leaf and a table's top are both in the way.
    let seen = [0.28, 0.7, 1.1].map(|height| {
        let hit = world.ray(at(height), along, far).ok().flatten();
        let counts = |hit: &Hit| match hit.what {
            What::Ground => false,
            What::Wall { .. } => true,
            What::Object { object, .. } => carries != Some(object),
        };
        hit.filter(counts).map_or(far, |hit| hit.distance)
    });
    seen.into_iter().fold(far, f32::min)
}

/// Whether nothing lies between two places.
fn sees(world: &Physics, from: Vec2, to: Vec2) -> bool {
    let way = to - from;
    let far = way.length();
    far < 0.2 || free(world, from, way / far, far, None) >= far - 0.01
}
