//! A controller as a bundle: its numbers, its make, and the creature that it belongs to.

use std::collections::BTreeMap;

use ambulo_body::{Body, BodyError, Description};
use ambulo_net::{
    BundleError, BundleOf, FORMAT_VERSION, Genes, Header, LayoutTable, Mlp, Precision, Weights,
};
use serde::{Deserialize, Serialize};

use crate::{Kind, Pilot, PilotError, Settings};

/// The creature that a controller was made for; all of it, so that a controller's file is enough.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CreatureReference {
    /// What people call it.
    pub name: String,
    /// [`Body::hash`] as 16 hexadecimal digits.
    pub hash: String,
    /// Its file.
    pub description: Description,
}

impl CreatureReference {
    fn of(body: &Body) -> Self {
        Self {
            name: body.description().name.clone(),
            hash: format!("{:016x}", body.hash()),
            description: body.description().clone(),
        }
    }
}

/// Why bytes are not a controller.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum PilotFileError {
    #[error(transparent)]
    Bundle(#[from] BundleError),
    #[error("a network, but not a creature's controller: its header has no part '{0}'")]
    NotAController(&'static str),
    #[error("the header's part '{part}': {source}")]
    Part { part: &'static str, source: serde_json::Error },
    #[error("the creature inside: {0}")]
    Creature(#[from] BodyError),
    #[error("the creature inside has the hash {found}, the file says {said}: it was changed")]
    Hash { found: String, said: String },
    #[error(transparent)]
    Pilot(#[from] PilotError),
    #[error(
        "the network has widths {found:?}, but such a controller of this creature {expected:?}"
    )]
    Widths { found: Vec<usize>, expected: Vec<usize> },
    #[error("activation or gain of the network is not what the part 'controller' says")]
    Activation,
    #[error("the header's layout is {found}, but that of such a controller {expected}")]
    Layout { found: String, expected: String },
}

impl Pilot {
    /// A bundle's bytes. `rate`: steps a second; `licence` and `provenance` as in every bundle;
    /// `parts`: whatever else shall be in the header, by name.
    ///
    /// # Errors
    /// A rate that is not positive.
    pub fn to_bytes(
        &self,
        body: &Body,
        rate: f64,
        licence: &str,
        provenance: BTreeMap<String, String>,
        parts: BTreeMap<String, serde_json::Value>,
    ) -> Result<Vec<u8>, PilotFileError> {
        let json = |part, value: Result<_, serde_json::Error>| {
            value.map_err(|source| PilotFileError::Part { part, source })
        };
        let reference = serde_json::to_value(CreatureReference::of(body));
        let settings = serde_json::to_value(self.settings());
        let mut parts = parts;
        parts.insert("creature".into(), json("creature", reference)?);
        parts.insert("controller".into(), json("controller", settings)?);
        let header = |kind: &str, activation: &str| Header {
            format: FORMAT_VERSION,
            kind: kind.into(),
            activation: activation.into(),
            fps: rate,
            layout: layout(self, body),
            licence: licence.into(),
            provenance,
            parts,
        };
        let bytes = match self.network() {
            Some(network) => {
                let header = header(Mlp::KIND, network.activation().name());
                BundleOf::new(header, network)?.to_bytes(Precision::Single)
            }
            None => {
                let inputs = self.blocks().iter().map(|(_, width)| width).sum();
                let genome = self.genome().to_vec();
                let genes = Genes { widths: [inputs, self.joints()], genome };
                BundleOf::new(header(Genes::KIND, "none"), genes)?.to_bytes(Precision::Single)
            }
        };
        Ok(bytes?)
    }

    /// A controller, the creature that it was made for, and the header it came with.
    ///
    /// # Errors
    /// Bytes that are no bundle, no controller, or one whose parts do not belong together.
    pub fn from_bytes(bytes: &[u8]) -> Result<(Self, Body, Header), PilotFileError> {
        let header = Header::from_bytes(bytes)?;
        if header.kind != Genes::KIND {
            // What is of another kind says so before anything is missed in it.
            BundleOf::<Mlp>::from_bytes(bytes)?;
        }
        let reference: CreatureReference = part(&header, "creature")?;
        let settings: Settings = part(&header, "controller")?;
        let body = Body::new(reference.description)?;
        let found = format!("{:016x}", body.hash());
        if found != reference.hash {
            return Err(PilotFileError::Hash { found, said: reference.hash });
        }
        let plain = settings.kind.unwrap_or(Kind::Network) == Kind::Network;
        let (genome, network) = if plain {
            let bundle = BundleOf::<Mlp>::from_bytes(bytes)?;
            (bundle.network().genome().to_vec(), Some(bundle.network().clone()))
        } else {
            (BundleOf::<Genes>::from_bytes(bytes)?.network().genome.clone(), None)
        };
        if let Some(network) = &network {
            let expected = Pilot::widths(&body, &settings)?;
            if network.widths() != expected {
                let found = network.widths().to_vec();
                return Err(PilotFileError::Widths { found, expected });
            }
        }
        let pilot = Pilot::new(&body, &settings, &genome)?;
        if pilot.network() != network {
            return Err(PilotFileError::Activation);
        }
        let (found, expected) = (&header.layout, layout(&pilot, &body));
        if *found != expected {
            let (found, expected) = (format!("{found:?}"), format!("{expected:?}"));
            return Err(PilotFileError::Layout { found, expected });
        }
        Ok((pilot, body, header))
    }
}

/// What the network's numbers are, for whoever reads the header alone.
fn layout(pilot: &Pilot, body: &Body) -> LayoutTable {
    LayoutTable {
        name: "creature".into(),
        hash: format!("{:016x}", body.hash()),
        inputs: pilot.blocks(),
        outputs: vec![("motor_speeds".into(), pilot.joints())],
    }
}

fn part<T: serde::de::DeserializeOwned>(
    header: &Header,
    part: &'static str,
) -> Result<T, PilotFileError> {
    let value = header.parts.get(part).ok_or(PilotFileError::NotAController(part))?;
    serde_json::from_value(value.clone()).map_err(|source| PilotFileError::Part { part, source })
}
