//! From senses to motor speeds.

use std::f32::consts::PI;

use ambulo_body::{Body, Sensor};
use ambulo_net::{Activation, Mlp, MlpScratch, NetworkError};

use crate::{Scaling, Settings};

/// Full scale of an input and of a layer's output (section 4.2.2, version 1.2).
const THREE: f32 = 3.0;

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
    #[error("{name}: {got} numbers, expected {expected}")]
    Senses { name: &'static str, got: usize, expected: usize },
    #[error("{name}: {value} is not a finite number")]
    NotFinite { name: &'static str, value: f32 },
}

/// What a creature feels in a step. Whoever drives the body fills in what its sensors ask for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Senses {
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

/// A controller: the network of one creature and how its numbers are meant.
#[derive(Clone, Debug, PartialEq)]
pub struct Pilot {
    settings: Settings,
    sensors: Vec<Sensor>,
    scaling: Scaling,
    joints: usize,
    legs: usize,
    /// Fastest turn of each driven joint, radians a second.
    speeds: Vec<f32>,
    /// Standing height and body length, metres: what heights and velocities are measured in.
    height: f32,
    length: f32,
    network: Mlp,
}

/// Buffers of one step; make them once.
#[derive(Clone, Debug, Default)]
pub struct PilotScratch {
    inputs: Vec<f32>,
    network: MlpScratch,
}

impl Pilot {
    /// Widths of the network of a body: inputs, hidden layers, one output a driven joint.
    ///
    /// # Errors
    /// Hidden layers that are too many or too wide, sensors that the body has nothing for.
    pub fn widths(body: &Body, settings: &Settings) -> Result<Vec<usize>, PilotError> {
        let settings = settings.resolved(body);
        let hidden = settings.hidden.expect("resolved");
        let sensors = settings.sensors.expect("resolved");
        if hidden.len() > 8 || hidden.iter().any(|neurons| !(1..=256).contains(neurons)) {
            return Err(PilotError::Hidden(format!(
                "{hidden:?} is not up to 8 layers of 1 to 256"
            )));
        }
        for (index, sensor) in sensors.iter().enumerate() {
            // By name: there is one list of heights in [`Senses`], so not even rays come twice.
            if sensors[..index].iter().any(|other| name(other) == name(sensor)) {
                return Err(PilotError::Sensors(format!("{} is listed twice", name(sensor))));
            }
            if let Sensor::GroundRays { count, reach } = sensor
                && !((1..=16).contains(count) && (0.1..=50.0).contains(reach))
            {
                return Err(PilotError::Sensors(format!(
                    "ground_rays: {count} within {reach} m; expected 1 to 16 within 0.1 to 50 m"
                )));
            }
        }
        let inputs = sensors.iter().map(|sensor| width(sensor, body)).sum();
        if inputs == 0 || body.driven().is_empty() {
            return Err(PilotError::Sensors("nothing to sense or nothing to drive".into()));
        }
        let ends = [vec![inputs], hidden, vec![body.driven().len()]];
        Ok(ends.concat())
    }

    /// How many numbers a genome has.
    ///
    /// # Errors
    /// As [`Pilot::widths`].
    pub fn genes(body: &Body, settings: &Settings) -> Result<usize, PilotError> {
        Ok(Mlp::genes(&Self::widths(body, settings)?))
    }

    /// The controller that a genome means.
    ///
    /// # Errors
    /// As [`Pilot::widths`]; a genome of another length, or one that is not finite.
    pub fn new(body: &Body, settings: &Settings, genome: &[f32]) -> Result<Self, PilotError> {
        let widths = Self::widths(body, settings)?;
        let settings = settings.resolved(body);
        let activation = settings.activation.expect("resolved");
        let scaling = settings.scaling.expect("resolved");
        let gain = if scaling == Scaling::Three { THREE } else { 1.0 };
        let joints = body.driven();
        Ok(Self {
            sensors: settings.sensors.clone().expect("resolved"),
            scaling,
            joints: joints.len(),
            legs: body.legs().len(),
            speeds: joints.iter().map(|&joint| body.joints()[joint].speed).collect(),
            height: body.standing_height().max(0.01),
            length: body.length(),
            network: Mlp::new(&widths, genome, activation, gain)?,
            settings,
        })
    }

    /// Its make, with everything said.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What it must be told.
    pub fn sensors(&self) -> &[Sensor] {
        &self.sensors
    }

    /// Its network.
    pub fn network(&self) -> &Mlp {
        &self.network
    }

    /// How many joints it drives.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Buffers for [`Pilot::steer`].
    pub fn scratch(&self) -> PilotScratch {
        let inputs = Vec::with_capacity(self.network.widths()[0]);
        PilotScratch { inputs, network: self.network.scratch() }
    }

    /// Whether senses bring what the sensors ask for.
    ///
    /// # Errors
    /// The first sense that is missing numbers, has too many, or one that is not finite.
    pub fn check(&self, senses: &Senses) -> Result<(), PilotError> {
        for sensor in &self.sensors {
            let got = match sensor {
                Sensor::JointAngles => senses.joint_angles.len(),
                Sensor::JointSpeeds => senses.joint_speeds.len(),
                Sensor::FootContacts => senses.foot_contacts.len(),
                Sensor::GroundRays { .. } => senses.ground_rays.len(),
                Sensor::TorsoRotation | Sensor::Height => 1,
                Sensor::Velocity => 2,
            };
            let expected = width_of(sensor, self.joints, self.legs);
            let name = name(sensor);
            if got != expected {
                return Err(PilotError::Senses { name, got, expected });
            }
            let numbers: &[f32] = match sensor {
                Sensor::TorsoRotation => &[senses.torso_rotation],
                Sensor::JointAngles => &senses.joint_angles,
                Sensor::JointSpeeds => &senses.joint_speeds,
                Sensor::FootContacts => &[],
                Sensor::Height => &[senses.height],
                Sensor::Velocity => &senses.velocity,
                Sensor::GroundRays { .. } => &senses.ground_rays,
            };
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
        let PilotScratch { inputs, network } = scratch;
        inputs.clear();
        for sensor in &self.sensors {
            self.sense(sensor, senses, inputs);
        }
        self.network.predict(inputs, commands, network);
        for command in commands {
            *command = match self.scaling {
                Scaling::Degrees => 2.0 * (*command - self.middle()),
                Scaling::Three => *command / THREE,
            };
            *command = command.clamp(-1.0, 1.0);
        }
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

    /// The output at which nothing moves.
    fn middle(&self) -> f32 {
        if self.network.activation() == Activation::Logistic { 0.5 } else { 0.0 }
    }

    fn sense(&self, sensor: &Sensor, senses: &Senses, inputs: &mut Vec<f32>) {
        let before = inputs.len();
        let angle = |radians: f32| match self.scaling {
            // Section 4.2.2, version 1.0: 0° to 360°.
            Scaling::Degrees => {
                let degrees = radians.to_degrees();
                if degrees < 0.0 { degrees + 360.0 } else { degrees }
            }
            Scaling::Three => radians * (THREE / PI),
        };
        let share = |value: f32| match self.scaling {
            Scaling::Degrees => value,
            Scaling::Three => THREE * value.clamp(-1.0, 1.0),
        };
        match *sensor {
            Sensor::TorsoRotation => inputs.push(angle(senses.torso_rotation)),
            Sensor::JointAngles => inputs.extend(senses.joint_angles.iter().map(|&a| angle(a))),
            Sensor::JointSpeeds => {
                let speeds = senses.joint_speeds.iter().zip(&self.speeds);
                inputs.extend(speeds.map(|(speed, most)| share(speed / most)));
            }
            Sensor::FootContacts => {
                let off = if self.scaling == Scaling::Three { -1.0 } else { 0.0 };
                let feet = senses.foot_contacts.iter();
                inputs.extend(feet.map(|&on| share(if on { 1.0 } else { off })));
            }
            Sensor::Height => inputs.push(share(senses.height / self.height - 1.0)),
            Sensor::Velocity => {
                // Full scale is three body lengths a second.
                let full = 3.0 * self.length;
                inputs.extend(senses.velocity.map(|v| share(v / full)));
            }
            Sensor::GroundRays { .. } => {
                inputs.extend(senses.ground_rays.iter().map(|h| share(h / self.height)));
            }
        }
        let expected = width_of(sensor, self.joints, self.legs);
        assert_eq!(inputs.len() - before, expected, "numbers for {sensor:?}");
    }
}

fn width(sensor: &Sensor, body: &Body) -> usize {
    width_of(sensor, body.driven().len(), body.legs().len())
}

fn width_of(sensor: &Sensor, joints: usize, legs: usize) -> usize {
    match *sensor {
        Sensor::TorsoRotation | Sensor::Height => 1,
        Sensor::JointAngles | Sensor::JointSpeeds => joints,
        Sensor::FootContacts => legs,
        Sensor::Velocity => 2,
        Sensor::GroundRays { count, .. } => count as usize,
    }
}

fn name(sensor: &Sensor) -> &'static str {
    match sensor {
        Sensor::TorsoRotation => "torso_rotation",
        Sensor::JointAngles => "joint_angles",
        Sensor::JointSpeeds => "joint_speeds",
        Sensor::FootContacts => "foot_contacts",
        Sensor::Height => "height",
        Sensor::Velocity => "velocity",
        Sensor::GroundRays { .. } => "ground_rays",
    }
}

/// Name and width of every sensor's block of the input vector.
pub(crate) fn blocks(pilot: &Pilot) -> Vec<(String, usize)> {
    let block = |sensor| (name(sensor).to_owned(), width_of(sensor, pilot.joints, pilot.legs));
    pilot.sensors.iter().map(block).collect()
}
