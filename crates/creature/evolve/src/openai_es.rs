//! The evolution strategy of OpenAI: a gradient, estimated from mirrored samples.
//!
//! Salimans, Ho, Chen, Sidor, Sutskever, "Evolution strategies as a scalable alternative to
//! reinforcement learning", 2017, algorithm 1 and section 2: one fixed step σ, samples in mirrored
//! pairs, fitness shaped to centred ranks, weight decay; Adam (Kingma and Ba 2015, algorithm 1) takes
//! the step uphill. Meant for many weights and many samples; with few it is slow.

use serde::{Deserialize, Serialize};

use crate::common::{
    as_many, countable, finite, fit, gene, in_range, ranking, scattered, some_genes, state,
};
use crate::{EvolveError, Outcome, Random, Strategy};

/// Adam's β₁, β₂ and ε, as its paper has them.
const BETA: (f64, f64) = (0.9, 0.999);
const EPSILON: f64 = 1e-8;

/// Settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct OpenaiEsSettings {
    /// Genomes of a generation, even, 2 to 100000.
    pub population: usize,
    /// Standard deviation of the samples around the centre, 0.0001 to 100.
    pub sigma: f64,
    /// Adam's step: about how far a gene goes in a generation at most, 0 to 10.
    pub learning_rate: f64,
    /// So much of the centre is taken away from the gradient, 0 to 1. The paper's: 0.005.
    pub decay: f64,
    /// The first generation's centre is uniform within ± this, 0 to 100.
    pub start: f32,
}

impl Default for OpenaiEsSettings {
    fn default() -> Self {
        Self { population: 64, sigma: 0.15, learning_rate: 0.1, decay: 0.005, start: 0.0 }
    }
}

impl OpenaiEsSettings {
    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), EvolveError> {
        in_range(&[
            ("population", self.population as f64, 2.0, 1e5, "2 to 100000"),
            ("sigma", self.sigma, 1e-4, 100.0, "0.0001 to 100"),
            ("learning_rate", self.learning_rate, 0.0, 10.0, "0 to 10"),
            ("decay", self.decay, 0.0, 1.0, "0 to 1"),
            ("start", f64::from(self.start), 0.0, 100.0, "0 to 100"),
        ])?;
        if self.population % 2 == 1 {
            let value = self.population as f64;
            let expected = "even, as mirrored pairs need";
            return Err(EvolveError::Setting { field: "population", value, expected });
        }
        Ok(())
    }
}

/// The strategy and its whole state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OpenaiEs {
    settings: OpenaiEsSettings,
    /// Generations that were told.
    generation: u64,
    random: Random,
    centre: Vec<f32>,
    /// Adam's running means of the gradient and of its square.
    gradient: Vec<f64>,
    square: Vec<f64>,
    /// Pair by pair: centre + σε, centre − σε.
    genomes: Vec<Vec<f32>>,
}

impl OpenaiEs {
    /// The first generation: genomes of `genes` numbers.
    ///
    /// # Errors
    /// Settings out of range, no genes.
    pub fn new(settings: OpenaiEsSettings, genes: usize, seed: u64) -> Result<Self, EvolveError> {
        settings.check()?;
        some_genes(genes)?;
        let mut random = Random::new(seed);
        let centre = scattered(genes, settings.start, &mut random);
        let (gradient, square) = (vec![0.0; genes], vec![0.0; genes]);
        let (generation, genomes) = (0, vec![]);
        let mut search = Self { settings, generation, random, centre, gradient, square, genomes };
        search.draw();
        Ok(search)
    }

    /// Its settings.
    pub fn settings(&self) -> &OpenaiEsSettings {
        &self.settings
    }

    fn draw(&mut self) {
        self.genomes.clear();
        for _ in 0..self.settings.population / 2 {
            let noise = self.centre.iter().map(|_| self.settings.sigma * self.random.normal());
            let noise: Vec<_> = noise.collect();
            for sign in [1.0, -1.0] {
                let genes = self.centre.iter().zip(&noise);
                let genome = genes.map(|(&x, noise)| gene(f64::from(x) + sign * noise));
                self.genomes.push(genome.collect());
            }
        }
    }
}

impl Strategy for OpenaiEs {
    fn generation(&self) -> u64 {
        self.generation
    }

    fn ask(&self) -> &[Vec<f32>] {
        &self.genomes
    }

    /// What is not finite shares the last rank; equals share theirs, so that a plateau has no slope.
    fn tell(&mut self, outcomes: &[Outcome]) -> Result<(), EvolveError> {
        as_many(outcomes, &self.genomes)?;
        self.generation += 1;
        let (shaped, settings) = (centred_ranks(outcomes), &self.settings);
        let scale = 1.0 / (shaped.len() as f64 * settings.sigma * settings.sigma);
        let unbias = |beta: f64| 1.0 - libm::pow(beta, self.generation as f64);
        let (first, second) = (unbias(BETA.0), unbias(BETA.1));
        for (i, x) in self.centre.iter_mut().enumerate() {
            let at = f64::from(*x);
            // Algorithm 1: 1/(nσ) Σ F ε, where σε is what became of it in the genome.
            let samples = self.genomes.iter().zip(&shaped);
            let slope: f64 = samples.map(|(genome, f)| f * (f64::from(genome[i]) - at)).sum();
            let slope = scale * slope - settings.decay * at;
            let (m, v) = (&mut self.gradient[i], &mut self.square[i]);
            *m = BETA.0 * *m + (1.0 - BETA.0) * slope;
            *v = BETA.1 * *v + (1.0 - BETA.1) * slope * slope;
            let step = *m / first / ((*v / second).sqrt() + EPSILON);
            *x = gene(at + settings.learning_rate * step);
        }
        self.draw();
        Ok(())
    }

    fn check(&self) -> Result<(), EvolveError> {
        self.settings.check()?;
        countable(self.generation)?;
        let genes = self.centre.len();
        fit(&self.genomes, self.settings.population, genes)?;
        fit(std::slice::from_ref(&self.centre), 1, genes)?;
        finite(&self.gradient, genes)?;
        finite(&self.square, genes)?;
        state(self.square.iter().all(|&square| square >= 0.0), "a square below 0")
    }

    fn best_guess(&self) -> Option<&[f32]> {
        Some(&self.centre)
    }
}

/// −½ for the worst to ½ for the best; equals share the mean of their places.
fn centred_ranks(outcomes: &[Outcome]) -> Vec<f64> {
    let mut order = ranking(outcomes);
    order.reverse();
    let last = (order.len() - 1) as f64;
    let same = |&a: &usize, &b: &usize| {
        let (a, b) = (outcomes[a].fitness, outcomes[b].fitness);
        a == b || !a.is_finite() && !b.is_finite()
    };
    let mut shaped = vec![0.0; order.len()];
    let mut place = 0;
    for equals in order.chunk_by(same) {
        let middle = place as f64 + (equals.len() - 1) as f64 / 2.0;
        equals.iter().for_each(|&index| shaped[index] = middle / last - 0.5);
        place += equals.len();
    }
    shaped
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(fitness: &[f64]) -> Vec<Outcome> {
        fitness.iter().map(|&fitness| Outcome { fitness, behaviour: vec![] }).collect()
    }

    #[test]
    fn ranks_are_centred_and_equals_share_theirs() {
        assert_eq!(centred_ranks(&told(&[3.0, -1.0, 900.0])), [0.0, -0.5, 0.5]);
        assert_eq!(centred_ranks(&told(&[5.0; 4])), [0.0; 4]);
        let odd = [f64::NAN, 2.0, f64::INFINITY, 1.0, 2.0];
        assert_eq!(centred_ranks(&told(&odd)), [-0.375, 0.375, -0.375, 0.0, 0.375]);
    }

    #[test]
    fn samples_come_in_mirrored_pairs() {
        let search = OpenaiEs::new(OpenaiEsSettings { start: 1.0, ..Default::default() }, 4, 1);
        let search = search.unwrap();
        for pair in search.ask().chunks(2) {
            for (i, centre) in search.centre.iter().enumerate() {
                assert!(((pair[0][i] + pair[1][i]) / 2.0 - centre).abs() < 1e-6);
            }
        }
        let settings = OpenaiEsSettings { population: 7, ..Default::default() };
        let error = OpenaiEs::new(settings, 3, 1).unwrap_err().to_string();
        assert_eq!(error, "evolution.population: 7 is not even, as mirrored pairs need");
    }

    /// Adam's first step is the learning rate in every gene, up the slope.
    #[test]
    fn the_first_step_goes_uphill() {
        let settings = OpenaiEsSettings { decay: 0.0, population: 200, ..Default::default() };
        let mut search = OpenaiEs::new(settings, 2, 1).unwrap();
        let value = |genome: &Vec<f32>| f64::from(3.0 * genome[0] - 2.0 * genome[1]);
        let fitness: Vec<_> = search.ask().iter().map(value).collect();
        search.tell(&told(&fitness)).unwrap();
        let guess = search.best_guess().unwrap();
        assert!((guess[0] - 0.1).abs() < 1e-4 && (guess[1] + 0.1).abs() < 1e-4, "{guess:?}");
    }

    /// Without a slope, what is left is the decay.
    #[test]
    fn weights_decay() {
        let settings = OpenaiEsSettings { start: 2.0, ..Default::default() };
        let mut search = OpenaiEs::new(settings, 8, 1).unwrap();
        let before = search.centre.clone();
        search.tell(&told(&[1.0; 64])).unwrap();
        assert!(
            before.iter().zip(&search.centre).all(|(before, after)| after.abs() < before.abs())
        );
    }
}
