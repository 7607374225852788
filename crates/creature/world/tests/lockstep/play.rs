//! Individuals with something to do, and what was seen of them.

use std::sync::OnceLock;

use ambulo_body::{Body, Shape};
use ambulo_lanes::{Job, Lanes, Simd, Width, math};
use ambulo_world::{Ground, Lockstep, Physics, Stage};

use crate::common::starter;

pub const STARTERS: [&str; 9] = [
    "apod",
    "biped1",
    "biped2",
    "tetrapod1",
    "tetrapod2",
    "decapod1",
    "decapod2",
    "frog",
    "raptor",
];

/// Each kind of ground but flat.
pub const UNEVEN: [Ground; 7] = [
    Ground::Slope { angle: 0.3 },
    Ground::Steps { height: 0.15, length: 0.7 },
    Ground::Steps { height: -0.15, length: 0.7 },
    Ground::Holes { width: 0.4, between: 0.8 },
    Ground::Hurdles { height: 0.2, width: 0.6, between: 1.0 },
    Ground::Rough { height: 0.1, spacing: 0.4, seed: 3 },
    Ground::Rough { height: 0.4, spacing: 0.4, seed: 4 },
];

pub fn on(ground: Ground) -> Physics {
    Physics { ground, ..Physics::default() }
}

/// Uniform in [-1, 1), the same for the same numbers: SplitMix64 (Steele, Lea, Flood 2014).
pub fn chance(seed: usize, a: usize, b: usize) -> f32 {
    let mut z = ((seed as u64) << 40) ^ ((a as u64) << 20) ^ b as u64;
    for _ in 0..2 {
        z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
    }
    (z >> 40) as f32 / (1u64 << 23) as f32 - 1.0
}

/// A motor's speed over time, as a part of its joint's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// For each joint a sine of random amplitude, phase and frequency, 0.1 to 3 Hz.
    Sine,
    /// Full speed one way or the other, switched at random eight times a second.
    Abrupt,
}

impl Pattern {
    pub fn speed(self, body: &Body, seed: usize, step: usize, joint: usize) -> f32 {
        let own = body.joints()[joint].speed;
        match self {
            Pattern::Sine => {
                let [a, b, c] = [0, 1, 2].map(|what| chance(seed, joint, what));
                let turns: f32 = (1.55 + 1.45 * b) * step as f32 / 60.0 + c;
                own * (0.5 + 0.5 * a) * math::sin_turns(turns.into()).value()
            }
            Pattern::Abrupt => {
                let switches = |step: &usize| chance(seed, joint, *step) > 0.75;
                let last = (0..=step).rev().find(switches).unwrap_or(0);
                own * chance(seed + 1, joint, last).signum()
            }
        }
    }
}

/// Some individuals, what their motors shall do and how they are thrown: by individual, step and joint,
/// and by individual and part as speeds to the right, up, and of turning.
pub struct Play<'a> {
    pub who: &'a [(&'a Body, &'a Physics)],
    pub motors: &'a dyn Fn(usize, usize, usize) -> f32,
    pub throws: Option<&'a dyn Fn(usize, usize) -> [f32; 3]>,
    pub steps: usize,
    /// Whether to look at hashes, or at all the rest.
    pub hashes: bool,
}

/// What was seen of an individual: before the first step and after each, but for work, gaps and depths,
/// which are of the steps.
#[derive(Clone, Default)]
pub struct Seen {
    /// Of the whole path.
    pub hash: u64,
    pub energy: Vec<f64>,
    pub work: Vec<f64>,
    pub gaps: Vec<f32>,
    pub depths: Vec<f32>,
    /// Whether any part touches the ground.
    pub touches: Vec<bool>,
    /// Place and angle of the torso.
    pub torso: Vec<[f32; 3]>,
}

impl Play<'_> {
    /// As many at a time as there are lanes.
    pub fn run(&self, width: Width) -> Vec<Seen> {
        let starts = (0..self.who.len()).step_by(width.lanes());
        starts.flat_map(|first| width.run(Few { play: self, first })).collect()
    }

    /// All at once.
    pub fn go(&self) -> Vec<Seen> {
        self.run(Width::widest())
    }
}

/// Those that fit into the lanes.
struct Few<'a> {
    play: &'a Play<'a>,
    first: usize,
}

impl Job for Few<'_> {
    type Output = Vec<Seen>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<Seen> {
        let Self { play, first } = self;
        let who = &play.who[first..play.who.len().min(first + Lanes::<S>::WIDTH)];
        let (body, parts) = (who[0].0, who[0].0.parts().len());
        // Lanes that are left over repeat the last.
        let ours = |lane: usize| first + lane.min(who.len() - 1);
        let mut world = Lockstep::new(simd, who).unwrap();
        for part in 0..parts {
            if let Some(throws) = play.throws {
                let throws = |lane| throws(ours(lane), part);
                let [x, y, turn] = [0, 1, 2].map(|i| Lanes::from_fn(simd, |lane| throws(lane)[i]));
                world.throw(part, [x, y], turn);
            }
        }
        let mut all = vec![Seen::default(); who.len()];
        for step in 0..=play.steps {
            if step > 0 {
                for joint in 0..body.joints().len() {
                    let speed = |lane: usize| (play.motors)(ours(lane), step - 1, joint);
                    world.set_motor(0, joint, Lanes::from_fn(simd, speed)).unwrap();
                }
                world.step().unwrap();
            }
            let ([x, y], angle) = (world.centre(0, body.torso()), world.turned(0, body.torso()));
            let touches = (0..parts).map(|part| world.touches(0, part));
            let touches = touches.reduce(|a, b| a | b).expect("a part");
            for (lane, seen) in all.iter_mut().enumerate() {
                if play.hashes {
                    seen.hash = world.hash(lane, seen.hash);
                    continue;
                }
                seen.energy.push(world.energy(lane));
                seen.touches.push(touches.lane(lane));
                seen.torso.push([x.lane(lane), y.lane(lane), angle.lane(lane)]);
                if step > 0 {
                    seen.work.push(world.motor_work(lane));
                    seen.gaps.push(world.widest_gap(lane));
                    seen.depths.push(world.deepest(lane));
                }
            }
        }
        all
    }
}

/// A starter that was driven, and what was seen of it.
pub struct Driven {
    pub name: &'static str,
    pub ground: Ground,
    pub pattern: Pattern,
    pub seed: usize,
    pub seen: Seen,
}

/// How long on flat ground; a quarter of it on other.
pub const STEPS: usize = 2000;

/// All starters on all grounds with eight of each pattern, made once for all tests.
pub fn driven() -> &'static [Driven] {
    static ALL: OnceLock<Vec<Driven>> = OnceLock::new();
    let one = |name: &'static str, ground: Ground| {
        let body = if ground == Ground::Flat { starter(name) } else { moved(&starter(name), 6.0) };
        let steps = if ground == Ground::Flat { STEPS } else { STEPS / 4 };
        let does = |who: usize| ([Pattern::Sine, Pattern::Abrupt][who / 8], who % 8);
        let motors = |who: usize, step: usize, joint: usize| {
            let (pattern, seed) = does(who);
            pattern.speed(&body, seed, step, joint)
        };
        let (physics, hashes) = (on(ground), false);
        let who = [(&body, &physics); 16];
        let seen = Play { who: &who, motors: &motors, throws: None, steps, hashes }.go();
        let made = seen.into_iter().enumerate().map(|(who, seen)| {
            let (pattern, seed) = does(who);
            Driven { name, ground, pattern, seed, seen }
        });
        made.collect::<Vec<_>>()
    };
    let grounds = || [Ground::Flat].into_iter().chain(UNEVEN);
    let all = || STARTERS.into_iter().flat_map(|name| grounds().flat_map(move |g| one(name, g)));
    ALL.get_or_init(|| all().collect())
}

/// The same body to the right or left of where its file has it.
pub fn moved(body: &Body, by: f32) -> Body {
    let mut made = body.description().clone();
    made.parts.iter_mut().for_each(|part| part.position[0] += by);
    made.joints.iter_mut().for_each(|joint| joint.anchor[0] += by);
    Body::new(made).unwrap()
}

/// The same body larger or smaller.
pub fn scaled(body: &Body, scale: f32) -> Body {
    let mut made = body.description().clone();
    for part in &mut made.parts {
        part.position = part.position.map(|x| x * scale);
        match &mut part.shape {
            Shape::Box { width: a, height: b } | Shape::Capsule { length: a, radius: b } => {
                (*a, *b) = (*a * scale, *b * scale);
            }
            Shape::Circle { radius } => *radius *= scale,
            Shape::Polygon { points } => {
                points.iter_mut().for_each(|point| *point = point.map(|x| x * scale));
            }
        }
    }
    made.joints.iter_mut().for_each(|joint| joint.anchor = joint.anchor.map(|x| x * scale));
    Body::new(made).unwrap()
}

/// Kilograms times gravity times body lengths, joules: what energies are measured in.
pub fn measure(body: &Body) -> f64 {
    f64::from(body.mass() * 9.81 * body.length())
}

/// What so many of a hundred do not exceed.
pub fn most_of(hundredths: f64, values: impl Iterator<Item = f32>) -> f32 {
    let mut values: Vec<_> = values.collect();
    values.sort_by(f32::total_cmp);
    values[((values.len() - 1) as f64 * hundredths / 100.0) as usize]
}
