//! A hill that every strategy can climb, whatever its genomes mean.
#![allow(dead_code)] // Each test file uses some of it.

use ambulo_evolve::{Outcome, Search, StrategySettings};
use ambulo_net::Graph;
use serde_json::{Value, json};

/// How many numbers the hill has.
pub const NUMBERS: usize = 6;

/// The settings of a strategy, and what whoever starts it fills in.
pub fn json_of(name: &str) -> Value {
    match name {
        "neat" => json!({"strategy": name, "inputs": 1, "outputs": 3}),
        _ => json!({"strategy": name}),
    }
}

pub fn settings(name: &str) -> StrategySettings {
    serde_json::from_value(json_of(name)).unwrap()
}

pub fn started(name: &str, seed: u64) -> Search {
    settings(name).start(NUMBERS, seed).unwrap()
}

/// The numbers that a genome means: itself, or for NEAT what its linear network of one input and three
/// outputs says to −1 and to 1.
pub fn meant(name: &str, genome: &[f32]) -> Vec<f64> {
    if name != "neat" {
        return genome.iter().copied().map(f64::from).collect();
    }
    let graph = Graph::parse(genome, 1, 3).unwrap();
    let mut numbers = [0.0; NUMBERS];
    for (input, outputs) in [-1.0, 1.0].into_iter().zip(numbers.chunks_mut(3)) {
        graph.run(&[input], outputs, &mut vec![], |sum| sum);
    }
    numbers.into_iter().map(f64::from).collect()
}

/// 1 on the top, where all numbers are ½; the behaviour is the first two, from −2 to 2.
pub fn hill(name: &str, genome: &[f32]) -> Outcome {
    let numbers = meant(name, genome);
    let square: f64 = numbers.iter().map(|x| (x - 0.5) * (x - 0.5)).sum();
    let behaviour = match name {
        "map_elites" => numbers[..2].iter().map(|x| (x + 2.0) / 4.0).collect(),
        _ => vec![],
    };
    Outcome { fitness: 1.0 / (1.0 + square), behaviour }
}

/// Tells what a function of the genome says until there were so many evaluations; the best fitness
/// that is a number.
pub fn search(
    search: &mut Search,
    evaluations: usize,
    mut outcome: impl FnMut(&[f32]) -> Outcome,
) -> f64 {
    let (mut best, mut used) = (f64::NEG_INFINITY, 0);
    while used + search.ask().len() <= evaluations {
        let outcomes: Vec<_> = search.ask().iter().map(|genome| outcome(genome)).collect();
        used += outcomes.len();
        let finite = outcomes.iter().map(|outcome| outcome.fitness).filter(|f| f.is_finite());
        best = finite.fold(best, f64::max);
        search.tell(&outcomes).unwrap();
    }
    best
}
