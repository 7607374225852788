//! An episode, kept whole.

use ambulo_world::World;

use crate::episode::{Walker, run};
use crate::{Arena, ArenaError};

/// T steps of one individual of P parts and J driven joints; all row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Rollout {
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
    let body = arena.body();
    let mut world = World::new(body, &arena.settings().world, 1)?;
    let mut walkers = [Walker::new(arena.pilot(genome)?, body)];
    let rollout = std::cell::RefCell::new(Rollout {
        dt: world.dt(),
        poses: Vec::new(),
        touching: Vec::new(),
        angles: Vec::new(),
        commands: Vec::new(),
        torques: Vec::new(),
        torso: Vec::new(),
        tilt: Vec::new(),
        ground: world.ground().points().to_vec(),
        hash: 0,
        lost: false,
    });
    let look = |world: &World, moment: &crate::episode::Moment<'_>| {
        let mut rollout = rollout.borrow_mut();
        for part in 0..body.parts().len() {
            let pose = world.pose(0, part);
            rollout.poses.extend([pose.x, pose.y, pose.angle]);
            rollout.touching.push(world.touches(0, part));
        }
        rollout.angles.extend(&moment.senses.joint_angles);
        rollout.torso.push(moment.torso);
        rollout.tilt.push(moment.senses.torso_rotation);
        rollout.hash = world.hash(0, rollout.hash);
    };
    run(
        &mut world,
        body,
        &mut walkers,
        steps,
        true,
        |world, _, moment| look(world, &moment),
        |world, _, moment| {
            look(world, &moment);
            let mut rollout = rollout.borrow_mut();
            rollout.commands.extend(moment.commands);
            rollout.torques.extend(moment.torques);
            false
        },
    )?;
    let mut rollout = rollout.into_inner();
    rollout.lost = walkers[0].lost;
    Ok(rollout)
}
