//! What all controllers of one make have in common.

use ambulo_body::{Body, Sensor};
use ambulo_net::{Activation, Graph, Mlp};

use crate::{Kind, PilotError, Scaling, Settings};

/// Poses of a controller made of them.
pub(crate) const POSES: usize = 4;
/// Full scale of an input and of a layer's output (section 4.2.2, version 1.2).
pub(crate) const THREE: f32 = 3.0;

/// The make of a controller, for a body.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Make {
    pub settings: Settings,
    pub kind: Kind,
    pub sensors: Vec<Sensor>,
    pub scaling: Scaling,
    pub activation: Activation,
    /// Of the network; empty without one.
    pub widths: Vec<usize>,
    pub joints: usize,
    pub legs: usize,
    /// For each driven joint the place of its genes among those of all that have any, and whether it
    /// is the second of a pair that shares them.
    pub genes_of: Vec<(usize, bool)>,
    /// How many joints have genes of their own.
    pub leaders: usize,
}

impl Make {
    pub fn new(body: &Body, settings: &Settings) -> Result<Self, PilotError> {
        let settings = settings.resolved(body);
        let kind = settings.kind.expect("resolved");
        let sensors = settings.sensors.clone().expect("resolved");
        let joints = body.driven().len();
        if joints == 0 {
            return Err(PilotError::Sensors("nothing to drive".into()));
        }
        // What is said of a network must be right even where there is none.
        let mut widths = widths(body, &settings, kind)?;
        if !kind.has_network() {
            widths.clear();
        }
        let mut genes_of = vec![None; joints];
        if settings.share == Some(true) {
            for &[first, second] in body.pairs() {
                if genes_of[first].is_none() && genes_of[second].is_none() && first != second {
                    genes_of[second] = Some((first, true));
                }
            }
        }
        let mut leaders = 0;
        for genes in genes_of.iter_mut().filter(|genes| genes.is_none()) {
            *genes = Some((leaders, false));
            leaders += 1;
        }
        let place = |joint: usize| match genes_of[joint].expect("all are filled") {
            (first, true) => (genes_of[first].expect("a leader").0, true),
            own => own,
        };
        Ok(Self {
            kind,
            sensors,
            scaling: settings.scaling.expect("resolved"),
            activation: settings.activation.expect("resolved"),
            widths,
            joints,
            legs: body.legs().len(),
            genes_of: (0..joints).map(place).collect(),
            leaders,
            settings,
        })
    }

    /// What a layer's activation is multiplied with.
    pub fn gain(&self) -> f32 {
        if self.scaling == Scaling::Three { THREE } else { 1.0 }
    }

    /// The output of the network at which nothing moves.
    pub fn middle(&self) -> f32 {
        if self.activation == Activation::Logistic { 0.5 } else { 0.0 }
    }

    /// Genes before those of the network.
    pub fn genes_before(&self) -> usize {
        match self.kind {
            Kind::Network | Kind::Graph => 0,
            Kind::PhaseNetwork => 1,
            Kind::Oscillator | Kind::OscillatorNetwork => 1 + 3 * self.leaders,
            Kind::Poses => POSES * (1 + self.leaders),
        }
    }

    /// All genes; of a graph those of one without connections, of which a genome may have any number.
    pub fn genes(&self) -> usize {
        if self.kind == Kind::Graph {
            return 1;
        }
        let network = if self.widths.is_empty() { 0 } else { Mlp::genes(&self.widths) };
        self.genes_before() + network
    }

    /// Whether a genome is one of this make.
    pub fn check(&self, genome: &[f32]) -> Result<(), PilotError> {
        if self.kind == Kind::Graph {
            self.graph(genome)?;
            return Ok(());
        }
        let expected = self.genes();
        if genome.len() != expected {
            return Err(PilotError::Length { got: genome.len(), expected });
        }
        match genome.iter().position(|gene| !gene.is_finite()) {
            Some(index) => Err(PilotError::Gene { index, value: genome[index] }),
            None => Ok(()),
        }
    }

    /// The network of a genome whose shape evolves.
    pub fn graph(&self, genome: &[f32]) -> Result<Graph, PilotError> {
        Ok(Graph::parse(genome, self.widths[0], self.joints)?)
    }

    /// Name and width of every sensor's block of the network's input vector.
    pub fn blocks(&self) -> Vec<(String, usize)> {
        if self.widths.is_empty() {
            return vec![("clock".into(), 1)];
        }
        let block = |sensor| (name(sensor).to_owned(), width_of(sensor, self.joints, self.legs));
        let mut blocks: Vec<_> = self.sensors.iter().map(block).collect();
        if self.kind == Kind::PhaseNetwork {
            blocks.push(("clock".into(), 2));
        }
        blocks
    }
}

/// Inputs, hidden layers, one output a driven joint.
fn widths(body: &Body, settings: &Settings, kind: Kind) -> Result<Vec<usize>, PilotError> {
    let hidden = settings.hidden.clone().expect("resolved");
    let sensors = settings.sensors.as_ref().expect("resolved");
    if hidden.len() > 8 || hidden.iter().any(|neurons| !(1..=256).contains(neurons)) {
        return Err(PilotError::Hidden(format!("{hidden:?} is not up to 8 layers of 1 to 256")));
    }
    for (index, sensor) in sensors.iter().enumerate() {
        // By name: there is one list of heights in the senses, so not even rays come twice.
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
    let (joints, legs) = (body.driven().len(), body.legs().len());
    let clock = if kind == Kind::PhaseNetwork { 2 } else { 0 };
    let inputs = clock + sensors.iter().map(|s| width_of(s, joints, legs)).sum::<usize>();
    if inputs == 0 {
        return Err(PilotError::Sensors("nothing to sense".into()));
    }
    let hidden = if kind == Kind::Graph { vec![] } else { hidden };
    Ok([vec![inputs], hidden, vec![joints]].concat())
}

pub(crate) fn width_of(sensor: &Sensor, joints: usize, legs: usize) -> usize {
    match *sensor {
        Sensor::TorsoRotation | Sensor::Height => 1,
        Sensor::JointAngles | Sensor::JointSpeeds => joints,
        Sensor::FootContacts => legs,
        Sensor::Velocity => 2,
        Sensor::GroundRays { count, .. } => count as usize,
    }
}

pub(crate) fn name(sensor: &Sensor) -> &'static str {
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
