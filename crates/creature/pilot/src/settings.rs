//! What kind of controller a creature has.

use ambulo_body::{Body, Sensor};
use ambulo_net::Activation;
use serde::{Deserialize, Serialize};

/// The seed's milestones (section 4.2.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Version {
    /// Foot contacts, 8 hidden neurons, logistic activation, angles in degrees.
    #[serde(rename = "1.0")]
    V1_0,
    /// The same network; another fitness.
    #[serde(rename = "1.1")]
    V1_1,
    /// Everything scaled to −3 to 3, tanh.
    #[serde(rename = "1.2")]
    V1_2,
    /// No foot contacts, 10 hidden neurons.
    #[default]
    #[serde(rename = "2.0")]
    V2_0,
}

/// How numbers become inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scaling {
    /// Angles in degrees, 0 to 360; contacts 0 or 1; outputs less a half. The seed's first way,
    /// kept to show what was wrong with it.
    Degrees,
    /// Everything from −3 to 3, and every layer's output too.
    #[default]
    Three,
}

/// What a controller is made of. Where angles are asked of a joint, its motor follows them as a servo.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The seed's: senses through a network to motor speeds.
    Network,
    /// The same with sine and cosine of a clock among its inputs, the clock's frequency a gene, and
    /// angles for its outputs.
    PhaseNetwork,
    /// Each joint swings: amplitude, phase and offset of its own, one frequency for all.
    Oscillator,
    /// An oscillator whose angles a network corrects.
    OscillatorNetwork,
    /// Four poses, one after the other, each for a time of its own: for what is done once.
    Poses,
    /// The seed's senses and motor speeds with a network whose shape evolves, by NEAT.
    Graph,
}

impl Kind {
    /// All of them.
    pub const ALL: [Kind; 5] =
        [Kind::Network, Kind::PhaseNetwork, Kind::Oscillator, Kind::OscillatorNetwork, Kind::Poses];

    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Network => "network",
            Kind::PhaseNetwork => "phase_network",
            Kind::Oscillator => "oscillator",
            Kind::OscillatorNetwork => "oscillator_network",
            Kind::Poses => "poses",
            Kind::Graph => "graph",
        }
    }

    /// Whether it has a network, and so senses.
    pub fn has_network(self) -> bool {
        !matches!(self, Kind::Oscillator | Kind::Poses)
    }

    /// Whether it has an oscillator for each joint.
    pub fn has_oscillators(self) -> bool {
        matches!(self, Kind::Oscillator | Kind::OscillatorNetwork)
    }
}

/// A controller's make; what is left out is as `version` has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct Settings {
    /// What it is made of; a network if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<Kind>,
    /// Whether paired joints share their genes: in oscillators half a period apart, in poses alike. If
    /// absent: with four legs and more; bipeds need both legs for themselves. A network shares
    /// nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<bool>,
    /// The seed's milestone to start from.
    pub version: Version,
    /// What it is told; as the creature's file says if absent, with foot contacts before 2.0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensors: Option<Vec<Sensor>>,
    /// Neurons of each hidden layer, 1 to 256; at most 8 layers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hidden: Option<Vec<usize>>,
    /// Activation of every layer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub activation: Option<Activation>,
    /// How numbers become inputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scaling: Option<Scaling>,
}

impl Settings {
    /// With everything said: for a body.
    pub fn resolved(&self, body: &Body) -> Self {
        let early = matches!(self.version, Version::V1_0 | Version::V1_1);
        let sensors = self.sensors.clone().unwrap_or_else(|| {
            let mut sensors = body.description().sensors.clone();
            if self.version != Version::V2_0 && !sensors.contains(&Sensor::FootContacts) {
                sensors.push(Sensor::FootContacts);
            }
            sensors
        });
        let neurons = if self.version == Version::V2_0 { 10 } else { 8 };
        let activation = if early { Activation::Logistic } else { Activation::Tanh };
        let scaling = if early { Scaling::Degrees } else { Scaling::Three };
        let kind = self.kind.unwrap_or(Kind::Network);
        let share = match kind {
            Kind::Poses | Kind::Oscillator | Kind::OscillatorNetwork => body.legs().len() >= 4,
            Kind::Network | Kind::PhaseNetwork | Kind::Graph => false,
        };
        Self {
            kind: Some(kind),
            share: Some(self.share.unwrap_or(share)),
            version: self.version,
            sensors: Some(sensors),
            hidden: Some(self.hidden.clone().unwrap_or_else(|| vec![neurons])),
            activation: Some(self.activation.unwrap_or(activation)),
            scaling: Some(self.scaling.unwrap_or(scaling)),
        }
    }
}
