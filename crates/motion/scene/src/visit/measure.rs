//! What is measured on a visit, frame by frame.

use ambulo_rig::glam::Vec3;
use ambulo_rig::{Terrain, Transform, wrapped};
use serde::Serialize;

use crate::actor::{Actor, Phase, Told};
use crate::interaction::{Action, Limb};
use crate::{Physics, STEP, Scene, What};

/// Seconds after a change in which a jump counts as its own.
const TRANSITION: f32 = 0.6;
/// Seconds after a change from which on a walk counts as plain.
const PLAIN: f32 = 1.5;
/// Seconds that it has walked straight on for that.
const STEADY: f32 = 0.5;
/// A limb whose weight is above this is where it should be.
const WHOLE: f32 = 0.999;
/// Metres that a character walks, and how much of its height its hips regain, to have stood up.
const STOOD: (f32, f32) = (0.25, 0.9);

/// Greatest, mean and count of a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Numbers {
    /// Greatest.
    pub most: f32,
    /// Mean; 0 of none.
    pub mean: f32,
    /// How many.
    pub count: u64,
}

impl Numbers {
    fn add(&mut self, number: f32) {
        self.most = self.most.max(number);
        self.count += 1;
        self.mean += (number - self.mean) / self.count as f32;
    }
}

/// What was measured. Centimetres, degrees, seconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Measured {
    /// Seconds that the visit took.
    pub seconds: f32,
    /// Interactions that were played to their end, and those that were broken off or given up.
    pub ended: u32,
    /// As above.
    pub broken: u32,
    /// Tasks of the script that could not be done.
    pub undone: Vec<usize>,
    /// Palm from where it should be while it holds.
    pub hand_cm: Numbers,
    /// Where that was farthest, and when.
    pub hand_farthest: String,
    /// And how it is turned.
    pub hand_degrees: Numbers,
    /// How often a hand slipped off what it held; such frames do not count above.
    pub slips: u32,
    /// Hips from where they should be while they are seated.
    pub hips_cm: Numbers,
    /// And how they are turned.
    pub hips_degrees: Numbers,
    /// How deep a joint, a palm or the middle of a bone is in an object, a wall or the ground.
    pub penetration_cm: Numbers,
    /// What went deepest, and when.
    pub deepest: String,
    /// Frames in which something was deeper than 1 cm.
    pub deep_frames: u64,
    /// How far the quickest joint goes in a frame, walking straight on at 0.8 to 1.8 m/s.
    pub walking_jump_cm: f32,
    /// What that was, and when.
    pub walking_farthest: String,
    /// And within 0.6 s of a change: of beginning, holding, leaving, ending, breaking off.
    pub transition_jump_cm: f32,
    /// What jumped farthest, and when.
    pub farthest: String,
    /// Along the ground, of the ball of a foot while the feet's layer holds it, a frame.
    pub skate_cm: Numbers,
    /// Sits, and those of them after which it stood up and walked a quarter of a metre.
    pub sits: u32,
    /// As above.
    pub stood_up: u32,
}

/// Somebody who sat, and has not walked away yet.
#[derive(Clone, Copy)]
struct Sat {
    /// Metres walked with the hips up since.
    walked: f32,
}

/// Measures a visit.
pub(super) struct Measure {
    measured: Measured,
    names: Vec<String>,
    objects: Vec<String>,
    parents: Vec<Option<usize>>,
    toes: [usize; 2],
    hips: usize,
    standing: f32,
    before: Vec<Vec3>,
    root: Vec3,
    yaw: f32,
    /// Seconds that it has walked straight.
    straight: f32,
    held: [bool; 2],
    /// Seconds since the last change, and what it was.
    since: f32,
    change: &'static str,
    time: f32,
    sat: Option<Sat>,
}

impl Measure {
    pub fn new(actor: &Actor, scene: &Scene) -> Self {
        let skeleton = actor.body().skeleton();
        let (joints, hips) = (skeleton.joints(), actor.body().hips);
        let places: Vec<_> = actor.global().iter().map(|joint| joint.translation).collect();
        let root = actor.root().position;
        Self {
            measured: Measured::default(),
            names: joints.iter().map(|joint| joint.name.clone()).collect(),
            objects: scene.objects.iter().map(|object| object.name.clone()).collect(),
            parents: joints.iter().map(|joint| joint.parent).collect(),
            toes: actor.body().toes.map(|(toe, _)| toe),
            hips,
            standing: places[hips].y - root.y,
            before: places,
            root,
            yaw: actor.root().yaw,
            straight: 0.0,
            held: [false; 2],
            // The first steps come from nowhere: neither plain walking nor a change.
            since: TRANSITION,
            change: "start",
            time: 0.0,
            sat: None,
        }
    }

    pub fn result(&self, seconds: f32, undone: &[usize]) -> Measured {
        Measured { seconds, undone: undone.into(), ..self.measured.clone() }
    }

    pub fn frame(&mut self, actor: &Actor, world: &Physics, told: Option<Told>) {
        self.time += STEP;
        self.since += STEP;
        self.change(actor, told);
        self.walks_straight(actor);
        self.limbs(actor);
        self.jumps(actor);
        self.feet(actor);
        self.depths(actor, world);
        self.stood(actor, world);
        self.root = actor.root().position;
        self.before.clear();
        self.before.extend(actor.global().iter().map(|joint| joint.translation));
    }

    fn change(&mut self, actor: &Actor, told: Option<Told>) {
        let change = match told {
            None | Some(Told::Walks) => return,
            Some(Told::Enters) => "enters",
            Some(Told::Holds) => "holds",
            Some(Told::Exits) => "exits",
            Some(Told::Ended) => "ended",
            Some(Told::Broken) => "broken",
            Some(Told::GaveUp(_)) => "gave up",
        };
        (self.since, self.change) = (0.0, change);
        match told {
            Some(Told::Ended) => self.measured.ended += 1,
            Some(Told::Broken | Told::GaveUp(_)) => self.measured.broken += 1,
            Some(Told::Holds) => {
                let which = actor.about().map(|about| about.which);
                let action = which.and_then(|w| actor.moves().all()[w].interaction.action.as_ref());
                if let Some(Action::Seat { .. }) = action {
                    self.measured.sits += 1;
                    self.sat = Some(Sat { walked: 0.0 });
                }
            }
            _ => {}
        }
    }

    /// Turns and starts have jumps of their own: plain walking is straight and steady.
    fn walks_straight(&mut self, actor: &Actor) {
        let root = actor.root();
        let speed = root.position.distance(self.root) / STEP;
        let turns = wrapped(root.yaw - self.yaw).abs() / STEP;
        let straight = (0.8..1.8).contains(&speed) && turns < 0.8;
        self.straight = if straight { self.straight + STEP } else { 0.0 };
        self.yaw = root.yaw;
    }

    fn limbs(&mut self, actor: &Actor) {
        let file = actor.about().map(|about| &actor.moves().all()[about.which].file);
        let hold = actor.about().and_then(|about| about.clip).map(|clip| clip.0);
        for led in actor.led().iter().filter(|led| led.weight >= WHOLE) {
            if led.slips {
                self.measured.slips += 1;
                continue;
            }
            let off = 100.0 * led.wanted.translation.distance(led.reached.translation);
            let turned = led.wanted.rotation.angle_between(led.reached.rotation).to_degrees();
            let (way, angle) = match led.limb {
                Limb::LeftHand | Limb::RightHand if hold.is_some() => {
                    (&mut self.measured.hand_cm, &mut self.measured.hand_degrees)
                }
                Limb::Hips if hold == Some(Phase::Hold) => {
                    (&mut self.measured.hips_cm, &mut self.measured.hips_degrees)
                }
                _ => continue,
            };
            if off > way.most && led.limb != Limb::Hips {
                let file = file.map_or("", |file| file);
                self.measured.hand_farthest = format!("{file} at {:.2} s", self.time);
            }
            way.add(off);
            if led.turned {
                angle.add(turned);
            }
        }
    }

    fn jumps(&mut self, actor: &Actor) {
        let plain = actor.about().is_none() && self.since > PLAIN && self.straight > STEADY;
        if !plain && self.since >= TRANSITION {
            return;
        }
        let moved = actor.global().iter().zip(&self.before).enumerate();
        let moved = moved.map(|(joint, (now, &before))| (joint, now.translation.distance(before)));
        let (joint, most) = moved.fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        let most = 100.0 * most;
        if plain && most > self.measured.walking_jump_cm {
            self.measured.walking_jump_cm = most;
            self.measured.walking_farthest = format!("{} at {:.2} s", self.names[joint], self.time);
        } else if !plain && most > self.measured.transition_jump_cm {
            self.measured.transition_jump_cm = most;
            self.measured.farthest = format!(
                "{} at {:.2} s, {:.2} s after {}",
                self.names[joint], self.time, self.since, self.change
            );
        }
    }

    fn feet(&mut self, actor: &Actor) {
        let held = actor.stands();
        for (side, &toe) in self.toes.iter().enumerate() {
            let moved = actor.global()[toe].translation - self.before[toe];
            if held[side] && self.held[side] {
                self.measured.skate_cm.add(100.0 * moved.with_y(0.0).length());
            }
        }
        self.held = held;
    }

    fn depths(&mut self, actor: &Actor, world: &Physics) {
        let global = actor.global();
        let palms = [0, 1].map(|side| (usize::MAX - side, actor.palm(side).translation));
        let joints = global.iter().enumerate().map(|(joint, at)| (joint, at.translation));
        let middle = |(joint, parent): (usize, &Option<usize>)| {
            let parent = (*parent)?;
            Some((joint, global[parent].translation.lerp(global[joint].translation, 0.5)))
        };
        let middles = self.parents.iter().enumerate().filter_map(middle);
        let mut worst = (0.0, 0, String::new());
        for (joint, point) in joints.chain(middles).chain(palms) {
            let (depth, what) = self.depth(point, world);
            if depth > worst.0 {
                worst = (depth, joint, what);
            }
        }
        let (depth, joint, what) = worst;
        let depth = 100.0 * depth;
        if depth > self.measured.penetration_cm.most {
            let name = self.names.get(joint).map_or("palm", |name| name);
            self.measured.deepest = format!("{name} in {what} at {:.2} s", self.time);
        }
        self.measured.penetration_cm.add(depth);
        self.measured.deep_frames += u64::from(depth > 1.0);
    }

    fn depth(&self, point: Vec3, world: &Physics) -> (f32, String) {
        let ground = (world.height(point.x, point.z) - point.y, String::from("the ground"));
        let Some((what, out)) = world.solid_at(point, None) else { return ground };
        if out.length() < ground.0 {
            return ground;
        }
        let what = match what {
            What::Object { object, part } => {
                format!("{}'s {}", self.objects[object], world.parts(object)[part].name)
            }
            _ => "a wall".into(),
        };
        (out.length(), what)
    }

    fn stood(&mut self, actor: &Actor, world: &Physics) {
        let Some(sat) = &mut self.sat else { return };
        let hips: Transform = actor.global()[self.hips];
        let ground = world.height(hips.translation.x, hips.translation.z);
        let up = hips.translation.y - ground > STOOD.1 * self.standing;
        let seated = actor.about().is_some_and(|about| about.clip.is_some());
        if up && !seated {
            let moved = actor.root().position - self.root;
            sat.walked += moved.with_y(0.0).length();
        }
        if sat.walked > STOOD.0 {
            self.measured.stood_up += 1;
            self.sat = None;
        }
    }
}
