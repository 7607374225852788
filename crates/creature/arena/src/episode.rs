//! Individuals in a world, step by step: the one loop that training, judging and recording share.

use ambulo_body::{Body, Sensor};
use ambulo_evolve::Random;
use ambulo_lanes::{Lanes, Mask, Simd};
use ambulo_pilot::{Felt, Pilots};
use ambulo_world::{Stage, WorldError};

use crate::meter::{Look, Meter};
use crate::settings::JUDGED;

/// From one push to the next, seconds, and how fast it would make the whole creature, metres a
/// second.
const PUSH_EVERY: f32 = 2.0;
const PUSH: f32 = 0.3;

/// How an episode goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Plan {
    pub steps: u32,
    /// Whether a fall ends it.
    pub falls: bool,
    /// Whether torques are read, which costs time in Box2D, and whether angles are kept.
    pub torques: bool,
    pub series: bool,
}

impl Plan {
    /// Of replays that are judged: no fall ends one.
    pub const JUDGED: Plan = Plan { steps: JUDGED, falls: false, torques: true, series: false };
}

/// A group of individuals on its way.
pub(crate) struct Crew<S: Simd> {
    pilots: Pilots<S>,
    pub felt: Felt<S>,
    pub touching: Vec<Mask<S>>,
    pub torques: Vec<Lanes<S>>,
    pub torso: [Lanes<S>; 2],
    /// What a push changes, metres a second, and in each lane after how many steps there is one and
    /// who draws its sign.
    push: Lanes<S>,
    pushers: Vec<Option<(u32, Random)>>,
    pub meter: Meter<S>,
    /// Where a controller gave something that is not a number.
    pub lost: Mask<S>,
    done: bool,
}

impl<S: Simd> Crew<S> {
    /// `seeds`: of the pushes in each lane.
    pub fn new(
        simd: S,
        world: &impl Stage<S>,
        group: usize,
        bodies: &[&Body],
        pilots: Pilots<S>,
        seeds: &[Option<u64>],
        plan: Plan,
    ) -> Self {
        let (body, zero) = (bodies[0], Lanes::zero(simd));
        let (joints, legs) = (body.driven().len(), body.legs().len());
        let felt = Felt::nothing(simd, joints, legs, pilots.sensors());
        let never = Mask::never(simd);
        let torso = world.centre(group, body.torso());
        let touching: Vec<_> = (0..body.parts().len()).map(|p| world.touches(group, p)).collect();
        let share = |lane: usize| {
            let body = bodies[lane.min(bodies.len() - 1)];
            PUSH * body.mass() / body.part_mass(body.torso())
        };
        let dt = world.dt();
        let pusher = |(lane, seed): (usize, &Option<u64>)| {
            let every = (PUSH_EVERY / dt.lane(lane)) as u32;
            seed.map(|seed| (every.max(1), Random::new(seed)))
        };
        Self {
            meter: Meter::new(simd, bodies, dt, torso, &touching, plan),
            felt,
            touching,
            torques: vec![zero; if plan.torques { joints } else { 0 }],
            torso,
            push: Lanes::from_fn(simd, share),
            pushers: seeds.iter().enumerate().map(pusher).collect(),
            lost: never,
            done: false,
            pilots,
        }
    }

    /// What the motors were told.
    pub fn commands(&self) -> &[Lanes<S>] {
        self.pilots.commands()
    }

    /// Looks at where it is; `moved` says that a step lies behind, so that there are speeds.
    #[inline(always)]
    fn sense(&mut self, world: &impl Stage<S>, group: usize, body: &Body, moved: bool) {
        let dt = world.dt();
        let zero = dt.like(0.0);
        let rate = if moved { dt.like(1.0) / dt } else { zero };
        let torso = world.centre(group, body.torso());
        self.felt.torso_rotation = world.turned(group, body.torso());
        for index in 0..body.driven().len() {
            let angle = world.joint_angle(group, body.driven()[index]);
            let turned = ambulo_lanes::math::wrap(angle - self.felt.joint_angles[index]);
            self.felt.joint_speeds[index] = turned * rate;
            self.felt.joint_angles[index] = angle;
        }
        for part in 0..self.touching.len() {
            self.touching[part] = world.touches(group, part);
        }
        for leg in 0..body.legs().len() {
            self.felt.foot_contacts[leg] = self.touching[body.legs()[leg].foot].one();
        }
        let [x, y] = self.torso;
        self.felt.velocity = [(torso[0] - x) * rate, (torso[1] - y) * rate];
        self.torso = torso;
        if !self.pilots.sensors().is_empty() {
            self.look_around(world);
        }
    }

    /// Heights of the ground, for those who feel them.
    fn look_around(&mut self, world: &impl Stage<S>) {
        let [x, y] = self.torso;
        let ground = |at: Lanes<S>| {
            let mut heights = [0.0; 16];
            at.store(&mut heights);
            heights.iter_mut().for_each(|value| *value = world.ground().height(*value));
            x.load_like(&heights)
        };
        for sensor in self.pilots.sensors() {
            match *sensor {
                Sensor::Height => self.felt.height = y - ground(x),
                Sensor::GroundRays { count, reach } => {
                    let here = ground(x);
                    for (ray, height) in self.felt.ground_rays.iter_mut().enumerate() {
                        let ahead = reach * (ray + 1) as f32 / count as f32;
                        *height = ground(x + ahead) - here;
                    }
                }
                _ => {}
            }
        }
    }

    #[inline(always)]
    fn steer<W: Stage<S>>(
        &mut self,
        world: &mut W,
        group: usize,
        body: &Body,
    ) -> Result<(), WorldError> {
        self.lost = self.lost | self.pilots.steer(&self.felt);
        for index in 0..body.driven().len() {
            let speed = self.pilots.commands()[index] * self.pilots.speeds()[index];
            world.set_motor(group, body.driven()[index], speed)?;
        }
        Ok(())
    }

    /// The first step from this one on in which somebody is pushed.
    fn next_push(&self, step: u32) -> u32 {
        let nexts = self.pushers.iter().flatten().map(|(every, _)| step.next_multiple_of(*every));
        nexts.min().unwrap_or(u32::MAX)
    }

    fn shove<W: Stage<S>>(
        &mut self,
        world: &mut W,
        group: usize,
        torso: usize,
        step: u32,
    ) -> Result<(), WorldError> {
        let mut signs = [0.0; 16];
        for (sign, pusher) in signs.iter_mut().zip(&mut self.pushers) {
            if let Some((every, random)) = pusher
                && step.is_multiple_of(*every)
            {
                *sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            }
        }
        let change = self.push * self.push.load_like(&signs);
        world.push(group, torso, [change, change.like(0.0)])
    }
}

/// Groups of individuals in their world.
pub(crate) struct Episode<S: Simd, W> {
    pub world: W,
    pub crews: Vec<Crew<S>>,
    plan: Plan,
    step: u32,
    next_push: u32,
}

impl<S: Simd, W: Stage<S>> Episode<S, W> {
    pub fn new(world: W, mut crews: Vec<Crew<S>>, body: &Body, plan: Plan) -> Self {
        for (group, crew) in crews.iter_mut().enumerate() {
            crew.sense(&world, group, body, false);
        }
        let next_push = crews.iter().map(|crew| crew.next_push(1)).min().unwrap_or(u32::MAX);
        Self { world, crews, plan, step: 0, next_push }
    }

    /// Goes on for at most so many steps, and says whether it is over. `watch` is called after every
    /// step of a group that goes on.
    #[inline(always)]
    pub fn advance(
        &mut self,
        body: &Body,
        most: u32,
        mut watch: impl FnMut(&W, usize, &Crew<S>),
    ) -> Result<bool, WorldError> {
        let last = self.plan.steps.min(self.step.saturating_add(most));
        while self.step < last {
            self.step += 1;
            for (group, crew) in self.crews.iter_mut().enumerate() {
                crew.steer(&mut self.world, group, body)?;
                if self.step == self.next_push {
                    crew.shove(&mut self.world, group, body.torso(), self.step)?;
                }
            }
            if self.step == self.next_push {
                let nexts = self.crews.iter().map(|crew| crew.next_push(self.step + 1));
                self.next_push = nexts.min().unwrap_or(u32::MAX);
            }
            self.world.step()?;
            let mut all_done = true;
            for group in 0..self.crews.len() {
                let crew = &mut self.crews[group];
                crew.felt.time = self.world.dt() * self.step as f32;
                crew.sense(&self.world, group, body, true);
                if crew.done {
                    continue;
                }
                for index in 0..crew.torques.len() {
                    let joint = body.driven()[index];
                    crew.torques[index] = self.world.motor_torque(group, joint)?;
                }
                let look = Look {
                    torso: crew.torso,
                    tilt: crew.felt.torso_rotation,
                    angles: &crew.felt.joint_angles,
                    speeds: &crew.felt.joint_speeds,
                    touching: &crew.touching,
                    commands: crew.pilots.commands(),
                    torques: &crew.torques,
                };
                crew.done = !crew.meter.watch(&look).any();
                all_done &= crew.done;
                watch(&self.world, group, crew);
            }
            if all_done {
                return Ok(true);
            }
        }
        Ok(self.step >= self.plan.steps)
    }
}
