//! Controllers of one make, one in each lane.

use std::f32::consts::PI;

use ambulo_body::{Body, Sensor};
use ambulo_lanes::{Lanes, Mask, Simd, math};
use ambulo_net::{Graph, predict_lanes};

use crate::make::{Make, POSES, THREE, width_of};
use crate::{Kind, PilotError, Scaling, Settings};

/// How fast a servo turns for each radian that its joint is off, a second.
const SERVO: f32 = 15.0;

/// What creatures feel in a step, one in each lane.
#[derive(Clone, Debug)]
pub struct Felt<S: Simd> {
    /// Seconds since the controller began.
    pub time: Lanes<S>,
    /// How far the torso has turned from the start pose, radians, −π to π.
    pub torso_rotation: Lanes<S>,
    /// How far each driven joint has turned from the start pose, radians, −π to π.
    pub joint_angles: Vec<Lanes<S>>,
    /// How fast each driven joint turns, radians a second.
    pub joint_speeds: Vec<Lanes<S>>,
    /// Whether the foot of each leg touches the ground: 1 or 0.
    pub foot_contacts: Vec<Lanes<S>>,
    /// Height of the torso over the ground below it, metres.
    pub height: Lanes<S>,
    /// Velocity of the torso, forward and up, metres a second.
    pub velocity: [Lanes<S>; 2],
    /// Height of the ground at each ray over the ground below the torso, metres.
    pub ground_rays: Vec<Lanes<S>>,
}

impl<S: Simd> Felt<S> {
    /// Nothing felt, with room for what `sensors` ask.
    pub fn nothing(simd: S, joints: usize, legs: usize, sensors: &[Sensor]) -> Self {
        let zero = Lanes::zero(simd);
        let rays = sensors.iter().map(|sensor| match sensor {
            Sensor::GroundRays { count, .. } => *count as usize,
            _ => 0,
        });
        Self {
            time: zero,
            torso_rotation: zero,
            joint_angles: vec![zero; joints],
            joint_speeds: vec![zero; joints],
            foot_contacts: vec![zero; legs],
            height: zero,
            velocity: [zero; 2],
            ground_rays: vec![zero; rays.sum()],
        }
    }
}

/// A swing: angle = offset + amplitude · sin 2π(t · frequency + phase), phase in turns.
#[derive(Clone, Copy, Debug)]
struct Swing<S: Simd> {
    amplitude: Lanes<S>,
    phase: Lanes<S>,
    offset: Lanes<S>,
}

/// Controllers of one make, one in each lane.
#[derive(Clone, Debug)]
pub struct Pilots<S: Simd> {
    make: Make,
    /// Hertz, of those with a clock.
    frequency: Lanes<S>,
    swings: Vec<Swing<S>>,
    /// When each pose ends, seconds; and the angle of each joint, pose by pose.
    ends: [Lanes<S>; POSES],
    poses: Vec<Lanes<S>>,
    network: Vec<Lanes<S>>,
    /// Networks whose shape evolves, one in each lane.
    graphs: Vec<Graph>,
    limits: Vec<[Lanes<S>; 2]>,
    /// Fastest turn of each driven joint, radians a second.
    speeds: Vec<Lanes<S>>,
    height: Lanes<S>,
    length: Lanes<S>,
    values: Vec<Lanes<S>>,
    spare: Vec<Lanes<S>>,
    commands: Vec<Lanes<S>>,
}

impl<S: Simd> Pilots<S> {
    /// The controllers that genomes mean; lanes that are left over repeat the last.
    ///
    /// # Errors
    /// A make that cannot be; a genome of another length, or one that is not finite.
    ///
    /// # Panics
    /// No individual, or more than lanes.
    pub fn new(
        simd: S,
        settings: &Settings,
        individuals: &[(&Body, &[f32])],
    ) -> Result<Self, PilotError> {
        let count = individuals.len();
        assert!((1..=Lanes::<S>::WIDTH).contains(&count), "an individual a lane");
        let make = Make::new(individuals[0].0, settings)?;
        for (_, genome) in individuals {
            make.check(genome)?;
        }
        let who = |lane: usize| individuals[lane.min(count - 1)];
        let gene = |index: usize, of: &dyn Fn(f32) -> f32| {
            Lanes::from_fn(simd, |lane| of(who(lane).1[index]))
        };
        let of_body = |value: &dyn Fn(&Body) -> f32| Lanes::from_fn(simd, |l| value(who(l).0));
        let joint = |body: &Body, joint: usize| body.joints()[body.driven()[joint]].clone();
        let limits: Vec<_> = (0..make.joints)
            .map(|j| [0, 1].map(|side| of_body(&|body| joint(body, j).limits[side])))
            .collect();
        let half = |j: usize| (limits[j][1] - limits[j][0]) * 0.5;
        let zero = Lanes::zero(simd);
        let swing = |j: usize| {
            let (place, second) = make.genes_of[j];
            let at = 1 + 3 * place;
            Swing {
                amplitude: half(j) * gene(at, &|g| (0.5 + 0.5 * g).clamp(0.0, 1.0)),
                phase: gene(at + 1, &|g| g) + if second { 0.5 } else { 0.0 },
                offset: half(j) * gene(at + 2, &|g| 0.4 * g),
            }
        };
        let pose = |at: usize| {
            let (pose, j) = (at / make.joints, at % make.joints);
            let angle = half(j) * gene(POSES + pose * make.leaders + make.genes_of[j].0, &|g| g);
            angle.clamp(limits[j][0], limits[j][1])
        };
        let of_oscillators = if make.kind.has_oscillators() { make.joints } else { 0 };
        let is_poses = make.kind == Kind::Poses;
        let mut ends = [zero; POSES];
        let mut end = zero;
        for (index, at) in ends.iter_mut().enumerate().filter(|_| is_poses) {
            end += gene(index, &|g| 0.25 * libm::exp2f((1.5 * g).clamp(-3.0, 2.0)));
            *at = end;
        }
        let has_clock = make.kind == Kind::PhaseNetwork || make.kind.has_oscillators();
        Ok(Self {
            frequency: if has_clock {
                gene(0, &|g| 1.6 * libm::exp2f(g.clamp(-2.0, 1.3)))
            } else {
                zero
            },
            swings: (0..of_oscillators).map(swing).collect(),
            ends,
            poses: (0..if is_poses { POSES * make.joints } else { 0 }).map(pose).collect(),
            network: match make.kind {
                Kind::Graph => vec![],
                _ => (make.genes_before()..make.genes()).map(|g| gene(g, &|g| g)).collect(),
            },
            graphs: match make.kind {
                Kind::Graph => (0..Lanes::<S>::WIDTH)
                    .map(|lane| make.graph(who(lane).1))
                    .collect::<Result<_, _>>()?,
                _ => vec![],
            },
            speeds: (0..make.joints).map(|j| of_body(&|body| joint(body, j).speed)).collect(),
            height: of_body(&|body| body.standing_height().max(0.01)),
            length: of_body(&Body::length),
            values: Vec::with_capacity(64),
            spare: Vec::with_capacity(64),
            commands: vec![zero; make.joints],
            limits,
            make,
        })
    }

    /// What they must be told; nothing beside the joints' angles and the time without a network.
    pub fn sensors(&self) -> &[Sensor] {
        if self.make.widths.is_empty() { &[] } else { &self.make.sensors }
    }

    /// Fastest turn of each driven joint, radians a second.
    pub fn speeds(&self) -> &[Lanes<S>] {
        &self.speeds
    }

    /// What each driven motor was told last, as a part of its fastest turn, −1 to 1.
    pub fn commands(&self) -> &[Lanes<S>] {
        &self.commands
    }

    /// Decides what each driven motor shall do, and says where something that is not a number came
    /// out; there it does nothing. Allocates nothing after the first time.
    #[inline(always)]
    pub fn steer(&mut self, felt: &Felt<S>) -> Mask<S> {
        let zero = self.height.like(0.0);
        let mut lost = zero.less(zero);
        let turns = felt.time * self.frequency;
        if self.make.kind.has_network() {
            self.think(felt, turns);
        }
        for joint in 0..self.make.joints {
            let command = match self.make.kind {
                Kind::Network | Kind::Graph => match self.make.scaling {
                    Scaling::Degrees => (self.values[joint] - self.make.middle()) * 2.0,
                    Scaling::Three => self.values[joint] * (1.0 / THREE),
                },
                _ => {
                    let angle = self.wanted(joint, felt.time, turns);
                    let [low, high] = self.limits[joint];
                    // What is not a number is not to be held within limits.
                    lost = lost | !angle.finite();
                    let off = angle.clamp(low, high) - felt.joint_angles[joint];
                    off * SERVO / self.speeds[joint]
                }
            };
            let bad = lost | !command.finite();
            lost = bad;
            let one = zero.like(1.0);
            self.commands[joint] = bad.choose(zero, command.clamp(-one, one));
        }
        lost
    }

    /// The angle that a joint shall have, radians; outside of its limits maybe.
    #[inline(always)]
    fn wanted(&self, joint: usize, time: Lanes<S>, turns: Lanes<S>) -> Lanes<S> {
        let [low, high] = self.limits[joint];
        let share = |value: Lanes<S>| match self.make.scaling {
            Scaling::Degrees => (value - self.make.middle()) * 2.0,
            Scaling::Three => value * (1.0 / THREE),
        };
        match self.make.kind {
            Kind::Poses => {
                let of = |pose: usize| self.poses[pose * self.make.joints + joint];
                let mut angle = of(POSES - 1);
                for pose in (0..POSES - 1).rev() {
                    angle = time.less(self.ends[pose]).choose(of(pose), angle);
                }
                angle
            }
            // Its outputs span the limits.
            Kind::Network | Kind::Graph | Kind::PhaseNetwork => {
                (low + high) * 0.5 + (high - low) * 0.5 * share(self.values[joint])
            }
            Kind::Oscillator | Kind::OscillatorNetwork => {
                let swing = &self.swings[joint];
                let angle = swing.offset + swing.amplitude * math::sin_turns(turns + swing.phase);
                if self.make.kind == Kind::OscillatorNetwork {
                    // The network may move it by a quarter of what the limits leave.
                    angle + (high - low) * 0.25 * share(self.values[joint])
                } else {
                    angle
                }
            }
        }
    }

    /// Senses through the network.
    #[inline(always)]
    fn think(&mut self, felt: &Felt<S>, turns: Lanes<S>) {
        self.values.clear();
        for sensor in 0..self.make.sensors.len() {
            self.sense(sensor, felt);
        }
        if self.make.kind == Kind::PhaseNetwork {
            self.values.push(math::sin_turns(turns) * THREE);
            self.values.push(math::cos_turns(turns) * THREE);
        }
        let (activation, gain) = (self.make.activation, self.make.gain());
        if self.make.kind == Kind::Graph {
            self.run_graphs();
            return;
        }
        let (values, spare) = (&mut self.values, &mut self.spare);
        predict_lanes(&self.make.widths, &self.network, activation, gain, values, spare);
    }

    /// Every lane's network on its own: no two have one shape.
    fn run_graphs(&mut self) {
        let (zero, gain) = (self.height.like(0.0), self.make.gain());
        let mut told = vec![[0.0; 16]; self.make.joints];
        let (mut outputs, mut scratch) = (vec![0.0; self.make.joints], Vec::new());
        for (lane, graph) in self.graphs.iter().enumerate() {
            let inputs: Vec<f32> = self.values.iter().map(|value| value.lane(lane)).collect();
            let activation = |sum: f32| gain * self.make.activation.of(sum);
            graph.run(&inputs, &mut outputs, &mut scratch, activation);
            for (told, output) in told.iter_mut().zip(&outputs) {
                told[lane] = *output;
            }
        }
        self.values.clear();
        self.values.extend(told.iter().map(|lanes| zero.load_like(lanes)));
    }

    #[inline(always)]
    fn angle(&self, radians: Lanes<S>) -> Lanes<S> {
        match self.make.scaling {
            // Section 4.2.2, version 1.0: 0° to 360°.
            Scaling::Degrees => {
                let degrees = radians * (180.0 / PI);
                degrees.less(degrees.like(0.0)).choose(degrees + 360.0, degrees)
            }
            Scaling::Three => radians * (THREE / PI),
        }
    }

    #[inline(always)]
    fn share(&self, value: Lanes<S>) -> Lanes<S> {
        match self.make.scaling {
            Scaling::Degrees => value,
            Scaling::Three => value.clamp(value.like(-1.0), value.like(1.0)) * THREE,
        }
    }

    #[inline(always)]
    fn sense(&mut self, sensor: usize, felt: &Felt<S>) {
        let before = self.values.len();
        let sensor = self.make.sensors[sensor];
        match sensor {
            Sensor::TorsoRotation => self.values.push(self.angle(felt.torso_rotation)),
            Sensor::JointAngles => {
                for angle in &felt.joint_angles {
                    self.values.push(self.angle(*angle));
                }
            }
            Sensor::JointSpeeds => {
                for joint in 0..felt.joint_speeds.len() {
                    self.values.push(self.share(felt.joint_speeds[joint] / self.speeds[joint]));
                }
            }
            Sensor::FootContacts => {
                for on in &felt.foot_contacts {
                    // 1 or −1; in the first versions 1 or 0.
                    let on =
                        if self.make.scaling == Scaling::Three { *on * 2.0 - 1.0 } else { *on };
                    self.values.push(self.share(on));
                }
            }
            Sensor::Height => self.values.push(self.share(felt.height / self.height - 1.0)),
            Sensor::Velocity => {
                // Full scale is three body lengths a second.
                for axis in 0..2 {
                    self.values.push(self.share(felt.velocity[axis] / (self.length * 3.0)));
                }
            }
            Sensor::GroundRays { .. } => {
                for height in &felt.ground_rays {
                    self.values.push(self.share(*height / self.height));
                }
            }
        }
        let expected = width_of(&sensor, self.make.joints, self.make.legs);
        assert_eq!(self.values.len() - before, expected, "numbers for {sensor:?}");
    }
}
