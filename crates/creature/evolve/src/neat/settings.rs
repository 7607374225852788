//! Settings of NEAT.

use serde::{Deserialize, Serialize};

use crate::EvolveError;
use crate::common::{SHARE, gene, in_range};

/// Settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct NeatSettings {
    /// Genomes of a generation, 4 to 100000. The paper's: 150.
    pub population: usize,
    /// Inputs of the networks, 1 to 256, without the bias; whoever starts a search fills it in.
    pub inputs: usize,
    /// Outputs of the networks, 1 to 256; whoever starts a search fills it in.
    pub outputs: usize,
    /// c₁ of the distance, for links newer than all of the other, 0 to 100.
    pub excess: f64,
    /// c₂, for other links that only one has, 0 to 100.
    pub disjoint: f64,
    /// c₃, for the mean difference of weights, 0 to 100.
    pub weights: f64,
    /// Within this distance, δₜ, it is the same species, 0 to 100.
    pub threshold: f64,
    /// The threshold moves by a tenth a generation towards so many species, up to 1000; 0: it stays,
    /// as in the paper.
    pub species: usize,
    /// After so many generations without progress a species has no children, 1 to 100000.
    pub stagnation: u64,
    /// The best share of a species may have children, 0 to 1. The paper does not say: 0.2.
    pub survival: f64,
    /// Chance of a child to have two parents, 0 to 1.
    pub crossover: f64,
    /// Chance that the second parent is of any species, 0 to 1.
    pub stray: f64,
    /// Chance of a new node, 0 to 1. The paper's: 0.03.
    pub add_node: f64,
    /// Else, chance of a new link, 0 to 1. The paper's: 0.05.
    pub add_link: f64,
    /// Else, chance that the weights change, 0 to 1. The paper's: 0.8.
    pub change_weights: f64,
    /// Then, chance that all change by little, up to a tenth of `weight_step`, 0 to 1; else about six
    /// do by much. The paper's: 0.
    pub fine: f64,
    /// Standard deviation of a change by much, 0 to 100.
    pub weight_step: f64,
    /// Chance of a weight that changes by much to be drawn anew, 0 to 1. The paper's: 0.1.
    pub new_weight: f64,
    /// Standard deviation of a new weight, 0 to 100.
    pub start: f32,
    /// Weights stay within ± this, 0.001 to 1000.
    pub weight_limit: f64,
    /// The most hidden nodes, 0 to 1000.
    pub most_hidden: usize,
}

impl Default for NeatSettings {
    fn default() -> Self {
        Self {
            population: 100,
            inputs: 0,
            outputs: 0,
            excess: 1.0,
            disjoint: 1.0,
            weights: 0.4,
            threshold: 3.0,
            species: 8,
            stagnation: 15,
            survival: 0.2,
            crossover: 0.75,
            stray: 0.001,
            add_node: 0.03,
            add_link: 0.15,
            change_weights: 0.8,
            fine: 0.5,
            weight_step: 1.5,
            new_weight: 0.1,
            start: 0.5,
            weight_limit: 8.0,
            most_hidden: 100,
        }
    }
}

impl NeatSettings {
    /// # Errors
    /// The first setting that is out of range; inputs and outputs may still be 0.
    pub fn check(&self) -> Result<(), EvolveError> {
        let hundred = "0 to 100";
        in_range(&[
            ("population", self.population as f64, 4.0, 1e5, "4 to 100000"),
            ("inputs", self.inputs as f64, 0.0, 256.0, "1 to 256"),
            ("outputs", self.outputs as f64, 0.0, 256.0, "1 to 256"),
            ("excess", self.excess, 0.0, 100.0, hundred),
            ("disjoint", self.disjoint, 0.0, 100.0, hundred),
            ("weights", self.weights, 0.0, 100.0, hundred),
            ("threshold", self.threshold, 0.0, 100.0, hundred),
            ("species", self.species as f64, 0.0, 1000.0, "0 to 1000"),
            ("stagnation", self.stagnation as f64, 1.0, 1e5, "1 to 100000"),
            ("survival", self.survival, 0.0, 1.0, SHARE),
            ("crossover", self.crossover, 0.0, 1.0, SHARE),
            ("stray", self.stray, 0.0, 1.0, SHARE),
            ("add_node", self.add_node, 0.0, 1.0, SHARE),
            ("add_link", self.add_link, 0.0, 1.0, SHARE),
            ("change_weights", self.change_weights, 0.0, 1.0, SHARE),
            ("fine", self.fine, 0.0, 1.0, SHARE),
            ("weight_step", self.weight_step, 0.0, 100.0, hundred),
            ("new_weight", self.new_weight, 0.0, 1.0, SHARE),
            ("start", f64::from(self.start), 0.0, 100.0, hundred),
            ("weight_limit", self.weight_limit, 0.001, 1000.0, "0.001 to 1000"),
            ("most_hidden", self.most_hidden as f64, 0.0, 1000.0, "0 to 1000"),
        ])
    }

    /// As [`NeatSettings::check`], and inputs and outputs filled in.
    pub(super) fn check_filled(&self) -> Result<(), EvolveError> {
        self.check()?;
        in_range(&[
            ("inputs", self.inputs as f64, 1.0, 256.0, "1 to 256"),
            ("outputs", self.outputs as f64, 1.0, 256.0, "1 to 256"),
        ])
    }

    /// Where the numbers of hidden nodes begin.
    pub(super) fn first_hidden(&self) -> u32 {
        (self.inputs + 1 + self.outputs) as u32
    }

    pub(super) fn limited(&self, weight: f64) -> f32 {
        gene(weight.clamp(-self.weight_limit, self.weight_limit))
    }
}
