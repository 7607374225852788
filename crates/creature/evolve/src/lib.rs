//! Strategies that search: ask for genomes, tell their fitness.
//!
//! A strategy sees strings of numbers and one number for each, never the problem. Its whole state
//! is a value that can be stored and gone on with, randomness included: the same seed and the same
//! fitness give the same genomes, bit for bit.

mod genetic;
mod random;

pub use genetic::{Genetic, GeneticSettings, Selection};
pub use random::Random;

/// Why a strategy cannot go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum EvolveError {
    #[error("evolution.{field}: {value} is not {expected}")]
    Setting { field: &'static str, value: f64, expected: &'static str },
    #[error("{got} fitness numbers for {expected} genomes")]
    Count { got: usize, expected: usize },
    #[error("a stored state: {0}")]
    State(String),
}
