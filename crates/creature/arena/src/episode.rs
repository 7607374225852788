//! Individuals in a world, step by step: the one loop that training and recording share.

use ambulo_body::{Body, Sensor};
use ambulo_pilot::{Pilot, PilotScratch, Senses};
use ambulo_world::{World, WorldError};

/// What there is to see of an individual after a step.
pub(crate) struct Moment<'a> {
    /// Seconds a step.
    pub dt: f32,
    /// Centre of the torso, metres.
    pub torso: [f32; 2],
    pub senses: &'a Senses,
    /// What the motors were told, −1 to 1.
    pub commands: &'a [f32],
    /// What they gave, newton metres; empty if not asked for.
    pub torques: &'a [f32],
}

/// One individual on its way.
pub(crate) struct Walker {
    pilot: Pilot,
    scratch: PilotScratch,
    senses: Senses,
    commands: Vec<f32>,
    torques: Vec<f32>,
    torso: [f32; 2],
    /// Its network gave something that is not a number: it does nothing any more.
    pub lost: bool,
}

impl Walker {
    pub fn new(pilot: Pilot, body: &Body) -> Self {
        let (joints, legs) = (body.driven().len(), body.legs().len());
        let rays = pilot.sensors().iter().map(|sensor| match sensor {
            Sensor::GroundRays { count, .. } => *count as usize,
            _ => 0,
        });
        let senses = Senses {
            joint_angles: vec![0.0; joints],
            joint_speeds: vec![0.0; joints],
            foot_contacts: vec![false; legs],
            ground_rays: vec![0.0; rays.sum()],
            ..Senses::default()
        };
        Self {
            scratch: pilot.scratch(),
            senses,
            commands: vec![0.0; joints],
            torques: Vec::new(),
            torso: [0.0; 2],
            lost: false,
            pilot,
        }
    }

    /// Looks at where it is; `moved` says that a step lies behind, so that there are speeds.
    fn sense(&mut self, world: &World, individual: usize, body: &Body, moved: bool) {
        let rate = if moved { 1.0 / world.dt() } else { 0.0 };
        let torso = world.centre(individual, body.torso());
        let senses = &mut self.senses;
        senses.torso_rotation = world.turned(individual, body.torso());
        for (index, &joint) in body.driven().iter().enumerate() {
            let angle = world.joint_angle(individual, joint);
            let turned = crate::measures::wrap(angle - senses.joint_angles[index]);
            senses.joint_speeds[index] = turned * rate;
            senses.joint_angles[index] = angle;
        }
        for (on, leg) in senses.foot_contacts.iter_mut().zip(body.legs()) {
            *on = world.touches(individual, leg.foot);
        }
        senses.velocity = [0, 1].map(|axis| (torso[axis] - self.torso[axis]) * rate);
        for sensor in self.pilot.sensors() {
            match *sensor {
                Sensor::Height => senses.height = torso[1] - world.ground().height(torso[0]),
                Sensor::GroundRays { count, reach } => {
                    let here = world.ground().height(torso[0]);
                    for (ray, height) in senses.ground_rays.iter_mut().enumerate() {
                        let ahead = reach * (ray + 1) as f32 / count as f32;
                        *height = world.ground().height(torso[0] + ahead) - here;
                    }
                }
                _ => {}
            }
        }
        self.torso = torso;
    }

    fn steer(
        &mut self,
        world: &mut World,
        individual: usize,
        body: &Body,
    ) -> Result<(), WorldError> {
        if !self.lost {
            self.pilot.steer(&self.senses, &mut self.commands, &mut self.scratch);
            self.lost = !self.commands.iter().all(|command| command.is_finite());
        }
        if self.lost {
            self.commands.fill(0.0);
        }
        for ((&joint, command), most) in
            body.driven().iter().zip(&self.commands).zip(self.pilot.speeds())
        {
            world.set_motor(individual, joint, command * most)?;
        }
        Ok(())
    }

    fn moment(&self, dt: f32) -> Moment<'_> {
        Moment {
            dt,
            torso: self.torso,
            senses: &self.senses,
            commands: &self.commands,
            torques: &self.torques,
        }
    }
}

/// Steps walkers until `watch` says of all of them that they are done, or for `steps`. Torques are
/// read where `torques` says so. `watch(world, individual, moment)` is called after every step for
/// everyone who is not done, and before the first one with the start pose through `begin`.
pub(crate) fn run(
    world: &mut World,
    body: &Body,
    walkers: &mut [Walker],
    steps: u32,
    torques: bool,
    mut begin: impl FnMut(&World, usize, Moment<'_>),
    mut watch: impl FnMut(&World, usize, Moment<'_>) -> bool,
) -> Result<(), WorldError> {
    let dt = world.dt();
    for (individual, walker) in walkers.iter_mut().enumerate() {
        walker.sense(world, individual, body, false);
        begin(world, individual, walker.moment(dt));
    }
    let mut done = vec![false; walkers.len()];
    for _ in 0..steps {
        for (individual, walker) in walkers.iter_mut().enumerate() {
            walker.steer(world, individual, body)?;
        }
        world.step()?;
        for (individual, walker) in walkers.iter_mut().enumerate() {
            walker.sense(world, individual, body, true);
            if done[individual] {
                continue;
            }
            if torques {
                walker.torques.clear();
                for &joint in body.driven() {
                    walker.torques.push(world.motor_torque(individual, joint)?);
                }
            }
            done[individual] = watch(world, individual, walker.moment(dt));
        }
        if done.iter().all(|&done| done) {
            break;
        }
    }
    Ok(())
}
