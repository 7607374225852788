//! An episode, kept whole.

use std::sync::Arc;

use ambulo_body::Body;
use ambulo_lanes::{Lanes, Scalar};
use ambulo_world::{Pose, Solver, Stage};

use crate::arena::FIRST_PUSHES;
use crate::episode::{Episode, Plan};
use crate::trials::{Trial, in_lanes, in_world};
use crate::{Arena, ArenaError};

/// T steps of one individual of P parts and J driven joints; all row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Rollout {
    /// Whose it is, with the measures that its genome gave it.
    pub body: Arc<Body>,
    /// Seconds a step.
    pub dt: f32,
    /// (T + 1) × P × 3: x, y in metres and angle in radians of each part's frame, from the start.
    pub poses: Vec<f32>,
    /// (T + 1) × P: whether the part touches the ground.
    pub touching: Vec<bool>,
    /// (T + 1) × J: angles from the start pose, radians.
    pub angles: Vec<f32>,
    /// T × J: what the motors were told, −1 to 1.
    pub commands: Vec<f32>,
    /// T × J: what they gave, newton metres.
    pub torques: Vec<f32>,
    /// (T + 1) × 2: the torso's centre of mass, metres.
    pub torso: Vec<[f32; 2]>,
    /// T + 1: how far the torso has turned, radians, −π to π.
    pub tilt: Vec<f32>,
    /// The ground's line from left to right, metres.
    pub ground: Vec<[f32; 2]>,
    /// Fingerprint of all steps, to the last bit.
    pub hash: u64,
    /// Whether the network gave something that is not a number.
    pub lost: bool,
}

impl Rollout {
    /// T.
    pub fn steps(&self) -> usize {
        self.tilt.len() - 1
    }
}

pub(crate) fn record(arena: &Arena, genome: &[f32], steps: u32) -> Result<Rollout, ArenaError> {
    let physics = arena.settings().world;
    let pushes = arena.task().pushed().then_some(FIRST_PUSHES);
    let individual = arena.individual(genome)?;
    let trial = Trial { individual: &individual, physics, pushes };
    let plan = Plan { steps, falls: false, torques: true, series: false };
    let controller = &arena.settings().controller;
    match physics.solver {
        Solver::Lockstep => {
            watched(in_lanes(Scalar, &[trial], controller, plan)?, &individual.body)
        }
        Solver::Box2d => watched(in_world(&[trial], controller, plan)?, &individual.body),
    }
}

fn watched<W: Stage<Scalar>>(
    mut episode: Episode<Scalar, W>,
    body: &Arc<Body>,
) -> Result<Rollout, ArenaError> {
    let (parts, joints) = (body.parts().len(), body.driven().len());
    let mut rollout = Rollout {
        body: body.clone(),
        dt: episode.world.dt().value(),
        poses: Vec::new(),
        touching: vec![false; parts],
        angles: vec![0.0; joints],
        commands: Vec::new(),
        torques: Vec::new(),
        torso: vec![episode.crews[0].torso.map(Lanes::value)],
        tilt: vec![0.0],
        ground: episode.world.ground().points().to_vec(),
        hash: episode.world.hash(0, 0, 0),
        lost: false,
    };
    rollout.poses.extend((0..parts).flat_map(|part| flat(episode.world.pose(0, 0, part))));
    episode.advance(body, u32::MAX, |world, _, crew| {
        rollout.poses.extend((0..parts).flat_map(|part| flat(world.pose(0, 0, part))));
        rollout.touching.extend(crew.touching.iter().map(|on| on.lane(0)));
        let values = |lanes: &[Lanes<Scalar>]| lanes.iter().map(|v| v.value()).collect::<Vec<_>>();
        rollout.angles.extend(values(&crew.felt.joint_angles));
        rollout.commands.extend(values(crew.commands()));
        rollout.torques.extend(values(&crew.torques));
        rollout.torso.push(crew.torso.map(Lanes::value));
        rollout.tilt.push(crew.felt.torso_rotation.value());
        rollout.hash = world.hash(0, 0, rollout.hash);
        rollout.lost = crew.lost.lane(0);
    })?;
    Ok(rollout)
}

fn flat(pose: Pose) -> [f32; 3] {
    [pose.x, pose.y, pose.angle]
}
