//! Phase-functioned neural networks: a file to ship, a check of it, and the forward pass.
//!
//! Floats only: this crate knows no bone. A [`Bundle`] is one safetensors file; its [`Header`]
//! carries what others need to use the network rightly (layout of the vectors, frame rate,
//! licence) and whatever they store of their own beside it (a skeleton).
//!
//! The network is that of Holden, Komura and Saito, "Phase-Functioned Neural Networks for
//! Character Control" (SIGGRAPH 2017): affine layers with ELU in between, whose weights are a
//! closed Catmull-Rom spline through four control points, followed once a cycle. Beside it there is
//! the plain fully connected network that evolution likes, [`Mlp`], [`Graph`] for those whose
//! shape evolves, and [`Genes`] to store those that are no network.

mod bundle;
mod genes;
mod graph;
mod kernel;
mod mlp;
mod network;
mod phase;

pub use bundle::{
    Bundle, BundleError, BundleOf, FORMAT_VERSION, Header, LayoutTable, Precision, Tensor, Tensors,
    Weights,
};
pub use genes::Genes;
pub use graph::{Edge, Graph};
pub use mlp::{Activation, Mlp, MlpScratch, predict_lanes};
pub use network::{Layer, Network, NetworkError, Normalisation, Scratch};
pub use phase::{CONTROL_POINTS, control_weights, spline_shares};
