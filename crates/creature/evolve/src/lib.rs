//! Strategies that search: ask for genomes, tell how they did.
//!
//! A strategy sees strings of numbers and an [`Outcome`] for each, never the problem. Its whole state
//! is a value that can be stored and gone on with, randomness included: the same seed and the same
//! outcomes give the same genomes, bit for bit, on every machine.
//!
//! One strategy, one file; [`StrategySettings`] lists them, and what is listed is tested. More fitness
//! is better. A fitness that is not finite is worse than any that is.

mod cma_es;
mod common;
mod eigen;
mod es;
mod genetic;
mod map_elites;
mod neat;
mod openai_es;
mod random;
mod strategies;

pub use cma_es::{CmaEs, CmaEsSettings, Covariance};
pub use es::{Es, EsSettings};
pub use genetic::{Genetic, GeneticSettings, Selection};
pub use map_elites::{MapElites, MapElitesSettings};
pub use neat::{Neat, NeatSettings};
pub use openai_es::{OpenaiEs, OpenaiEsSettings};
pub use random::Random;
pub use strategies::{Search, StrategySettings};

/// How a genome did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// More is better; what is not finite is worst.
    pub fitness: f64,
    /// What kind of motion it is: empty, or numbers of 0 to 1. Only MAP-Elites looks.
    pub behaviour: Vec<f64>,
}

/// What every strategy does, generation after generation.
pub trait Strategy {
    /// How many generations were told.
    fn generation(&self) -> u64;

    /// The genomes of this generation, whose outcome it wants to know.
    fn ask(&self) -> &[Vec<f32>];

    /// Takes an outcome for each genome, in their order, and makes the next generation. What it
    /// refuses changes nothing.
    ///
    /// # Errors
    /// Another number of them than genomes; a behaviour that has not the numbers it needs.
    fn tell(&mut self, outcomes: &[Outcome]) -> Result<(), EvolveError>;

    /// Checks a state that was stored.
    ///
    /// # Errors
    /// Settings out of range, numbers that are not as many as they say, or not finite.
    fn check(&self) -> Result<(), EvolveError>;

    /// The mean of the distribution that genomes are drawn from, where there is one. With a noisy
    /// fitness it is often better than the genome that was luckiest.
    fn best_guess(&self) -> Option<&[f32]> {
        None
    }
}

/// Why a strategy cannot go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum EvolveError {
    #[error("evolution.{field}: {value} is not {expected}")]
    Setting { field: &'static str, value: f64, expected: &'static str },
    #[error("{got} outcomes for {expected} genomes")]
    Count { got: usize, expected: usize },
    #[error("a behaviour of {got} numbers, but evolution.cells has {expected}")]
    Behaviour { got: usize, expected: usize },
    #[error("a genome that is {0}")]
    Genome(String),
    #[error("a stored state: {0}")]
    State(String),
}
