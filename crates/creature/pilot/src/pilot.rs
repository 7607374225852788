//! One controller: from senses to motor speeds.

use ambulo_body::{Body, Sensor};
use ambulo_lanes::{Lanes, Scalar};
use ambulo_net::{Mlp, NetworkError};

use crate::make::{Make, name, width_of};
use crate::pilots::{Felt, Pilots};
use crate::{Kind, Settings};

/// Why a controller cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum PilotError {
    #[error("controller.hidden: {0}")]
    Hidden(String),
    #[error("controller.sensors: {0}")]
    Sensors(String),
    #[error("the genome: {0}")]
    Genome(#[from] NetworkError),
    #[error("the genome: expected {expected} numbers, got {got}")]
    Length { got: usize, expected: usize },
    #[error("the genome: number {index} is {value}, not finite")]
    Gene { index: usize, value: f32 },
    #[error("{name}: {got} numbers, expected {expected}")]
    Senses { name: &'static str, got: usize, expected: usize },
    #[error("{name}: {value} is not a finite number")]
    NotFinite { name: &'static str, value: f32 },
}

/// What a creature feels in a step. Whoever drives the body fills in what its sensors ask for, and
/// for all but plain networks the time and the joints' angles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Senses {
    /// Seconds since the controller began.
    pub time: f32,
    /// How far the torso has turned from the start pose, radians, −π to π.
    pub torso_rotation: f32,
    /// How far each driven joint has turned from the start pose, radians, −π to π.
    pub joint_angles: Vec<f32>,
    /// How fast each driven joint turns, radians a second.
    pub joint_speeds: Vec<f32>,
    /// Whether the foot of each leg touches the ground.
    pub foot_contacts: Vec<bool>,
    /// Height of the torso over the ground below it, metres.
    pub height: f32,
    /// Velocity of the torso, forward and up, metres a second.
    pub velocity: [f32; 2],
    /// Height of the ground at each ray over the ground below the torso, metres.
    pub ground_rays: Vec<f32>,
}

/// A controller of one creature.
#[derive(Clone, Debug, PartialEq)]
pub struct Pilot {
    make: Make,
    body: Body,
    genome: Vec<f32>,
    speeds: Vec<f32>,
}

/// Buffers of one step; make them once.
#[derive(Clone, Debug)]
pub struct PilotScratch {
    pilots: Pilots<Scalar>,
    felt: Felt<Scalar>,
}

impl Pilot {
    /// Widths of the network of a body: inputs, hidden layers, one output a driven joint; nothing
    /// without a network.
    ///
    /// # Errors
    /// Hidden layers that are too many or too wide, sensors that the body has nothing for.
    pub fn widths(body: &Body, settings: &Settings) -> Result<Vec<usize>, PilotError> {
        Ok(Make::new(body, settings)?.widths)
    }

    /// How many numbers a genome has.
    ///
    /// # Errors
    /// As [`Pilot::widths`].
    pub fn genes(body: &Body, settings: &Settings) -> Result<usize, PilotError> {
        Ok(Make::new(body, settings)?.genes())
    }

    /// The controller that a genome means.
    ///
    /// # Errors
    /// As [`Pilot::widths`]; a genome of another length, or one that is not finite.
    pub fn new(body: &Body, settings: &Settings, genome: &[f32]) -> Result<Self, PilotError> {
        let make = Make::new(body, settings)?;
        make.check(genome)?;
        let speeds = body.driven().iter().map(|&joint| body.joints()[joint].speed).collect();
        Ok(Self { make, body: body.clone(), genome: genome.to_vec(), speeds })
    }

    /// Its make, with everything said.
    pub fn settings(&self) -> &Settings {
        &self.make.settings
    }

    /// What it must be told; for all but plain networks the time and the joints' angles, too.
    pub fn sensors(&self) -> &[Sensor] {
        if self.make.widths.is_empty() { &[] } else { &self.make.sensors }
    }

    /// Its numbers.
    pub fn genome(&self) -> &[f32] {
        &self.genome
    }

    /// The creature that it is for.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Its network as one of its own; none unless it is a plain network.
    pub fn network(&self) -> Option<Mlp> {
        let Make { widths, activation, kind, .. } = &self.make;
        let plain = *kind == Kind::Network;
        plain.then(|| {
            let network = Mlp::new(widths, &self.genome, *activation, self.make.gain());
            network.expect("a genome that was checked")
        })
    }

    /// How many joints it drives.
    pub fn joints(&self) -> usize {
        self.make.joints
    }

    /// Buffers for [`Pilot::steer`].
    pub fn scratch(&self) -> PilotScratch {
        let one = [(&self.body, &self.genome[..])];
        let pilots = Pilots::new(Scalar, &self.make.settings, &one).expect("it was checked");
        let Make { joints, legs, .. } = self.make;
        PilotScratch { pilots, felt: Felt::nothing(Scalar, joints, legs, self.sensors()) }
    }

    /// Whether senses bring what the controller asks for.
    ///
    /// # Errors
    /// The first sense that is missing numbers, has too many, or one that is not finite.
    pub fn check(&self, senses: &Senses) -> Result<(), PilotError> {
        let plain = matches!(self.make.kind, Kind::Network | Kind::Graph);
        let servo = (!plain).then_some(Sensor::JointAngles);
        if servo.is_some() && !senses.time.is_finite() {
            return Err(PilotError::NotFinite { name: "time", value: senses.time });
        }
        for sensor in self.sensors().iter().chain(&servo) {
            let on = senses.foot_contacts.iter().map(|_| 0.0);
            let numbers: Vec<f32> = match sensor {
                Sensor::TorsoRotation => vec![senses.torso_rotation],
                Sensor::JointAngles => senses.joint_angles.clone(),
                Sensor::JointSpeeds => senses.joint_speeds.clone(),
                Sensor::FootContacts => on.collect(),
                Sensor::Height => vec![senses.height],
                Sensor::Velocity => senses.velocity.to_vec(),
                Sensor::GroundRays { .. } => senses.ground_rays.clone(),
            };
            let (name, got) = (name(sensor), numbers.len());
            let expected = width_of(sensor, self.make.joints, self.make.legs);
            if got != expected {
                return Err(PilotError::Senses { name, got, expected });
            }
            if let Some(&value) = numbers.iter().find(|value| !value.is_finite()) {
                return Err(PilotError::NotFinite { name, value });
            }
        }
        Ok(())
    }

    /// What each driven motor shall do, as a part of its fastest turn, −1 to 1. Allocates nothing.
    ///
    /// # Panics
    /// When `commands` has not one number a driven joint, or `senses` lacks what the sensors ask.
    pub fn steer(&self, senses: &Senses, commands: &mut [f32], scratch: &mut PilotScratch) {
        assert_eq!(commands.len(), self.make.joints, "a command a driven joint");
        let PilotScratch { pilots, felt } = scratch;
        felt.time = senses.time.into();
        felt.torso_rotation = senses.torso_rotation.into();
        felt.height = senses.height.into();
        felt.velocity = senses.velocity.map(Lanes::from);
        fill(&mut felt.joint_angles, senses.joint_angles.iter().copied());
        fill(&mut felt.joint_speeds, senses.joint_speeds.iter().copied());
        let feet = senses.foot_contacts.iter();
        fill(&mut felt.foot_contacts, feet.map(|&on| if on { 1.0 } else { 0.0 }));
        fill(&mut felt.ground_rays, senses.ground_rays.iter().copied());
        pilots.steer(felt);
        commands.iter_mut().zip(pilots.commands()).for_each(|(to, from)| *to = from.value());
    }

    /// The same as motor speeds, radians a second.
    ///
    /// # Panics
    /// As [`Pilot::steer`].
    pub fn drive(&self, senses: &Senses, speeds: &mut [f32], scratch: &mut PilotScratch) {
        self.steer(senses, speeds, scratch);
        speeds.iter_mut().zip(&self.speeds).for_each(|(speed, most)| *speed *= most);
    }

    /// Fastest turn of each driven joint, radians a second.
    pub fn speeds(&self) -> &[f32] {
        &self.speeds
    }

    /// Name and width of every block of what goes in.
    pub(crate) fn blocks(&self) -> Vec<(String, usize)> {
        self.make.blocks()
    }
}

fn fill(to: &mut Vec<Lanes<Scalar>>, from: impl Iterator<Item = f32>) {
    to.clear();
    to.extend(from.map(Lanes::from));
}
