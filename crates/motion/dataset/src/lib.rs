//! From clips to rows that a network can learn from: roles, labels, mirroring, terrain, features,
//! shards on disk.
//!
//! Two steps. [`plan`](plan::plan) looks at motion files and writes a [`Manifest`]: which clips, in
//! which axes, with which joints as hips and feet, on which side of the split. [`build`](build::build)
//! turns a manifest into shards. Building again does only what changed; it may be interrupted at
//! any moment; and its bytes do not depend on the number of threads. Feature vectors come from
//! `ambulo-features`, the encoder that the runtime uses too.

mod body;
pub mod build;
mod compare;
mod contacts;
mod filter;
mod gait;
mod given;
mod ground;
mod labels;
mod manifest;
mod motion;
mod patches;
mod phase;
pub mod plan;
pub mod prepare;
mod random;
pub mod rows;
mod shard;
mod work;

pub use body::{Body, RoleNames};
pub use compare::Agreement;
pub use contacts::ContactSettings;
pub use gait::{CATEGORIES, GaitSettings};
pub use given::{Given, Published};
pub use ground::Kind;
pub use manifest::{ClipEntry, Manifest, Split, TerrainSource};
pub use shard::{Moments, ShardInfo};

use std::path::PathBuf;

use ambulo_rig::Clip;

/// Why a data set cannot be built.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum DatasetError {
    #[error("{0}")]
    Manifest(String),
    #[error("{file}: {reason}")]
    Clip { file: PathBuf, reason: String },
    #[error("{0}: {1}")]
    Io(PathBuf, std::io::Error),
    #[error("no clip can be used:\n{0}")]
    NoClips(String),
    #[error("stopped")]
    Stopped,
}

/// A clip as its file has it, and the axes that it seems to be in.
pub struct Loaded {
    /// In the file's own units.
    pub clip: Clip,
    /// Name of the axes, if they could be found out; else why not.
    pub axes: Result<String, String>,
}

/// Reads a motion file: which formats there are is not this crate's business.
pub type Load<'a> = dyn Fn(&std::path::Path) -> Result<Loaded, String> + Sync + 'a;

/// Told how much is done, as a share of 1; answers whether to go on.
pub type Progress<'a> = dyn Fn(f64) -> bool + Sync + 'a;
