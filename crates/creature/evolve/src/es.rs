//! (μ, λ)-evolution strategy with a step size that adapts itself.
//!
//! Beyer and Schwefel, "Evolution strategies – A comprehensive introduction", 2002: comma selection,
//! intermediate recombination of all μ parents (here weighted by rank) and self-adaptation of the step
//! by a log-normal factor: σ' = σ exp(τ N(0, 1)) with τ = 1/√n for one step a genome, or σᵢ' = σᵢ
//! exp(τ₀ N(0, 1) + τ Nᵢ(0, 1)) with τ₀ = 1/√(2n) and τ = 1/√(2√n) for one a gene. Cheap, quick where
//! generations are few, and at ease with noise.

use serde::{Deserialize, Serialize};

use crate::common::{
    as_many, countable, finite, fit, gene, in_range, log_weights, ranking, scattered, some_genes,
    state,
};
use crate::{EvolveError, Outcome, Random, Strategy};

/// Steps stay within these, so that a fitness that says nothing leads nowhere far.
const STEPS: std::ops::RangeInclusive<f64> = 1e-6..=100.0;

/// Settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct EsSettings {
    /// Genomes of a generation, λ, 4 to 100000.
    pub population: usize,
    /// The best so many are parents, μ, up to half the population; 0: a quarter of it.
    pub parents: usize,
    /// Standard deviation of a gene in the first generation, up to 100; 0: what suits the genes, 0.5
    /// if nothing is known of them.
    pub sigma: f64,
    /// The first generation's centre is uniform within ± this, 0 to 100.
    pub start: f32,
    /// A step for each gene, not one for the genome: learns slower, but which genes matter.
    pub per_gene: bool,
    /// How fast steps change: a factor of τ and τ₀, 0 to 10.
    pub learning: f64,
}

impl Default for EsSettings {
    fn default() -> Self {
        Self { population: 64, parents: 0, sigma: 0.0, start: 0.0, per_gene: false, learning: 1.0 }
    }
}

impl EsSettings {
    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), EvolveError> {
        in_range(&[
            ("population", self.population as f64, 4.0, 1e5, "4 to 100000"),
            (
                "parents",
                self.parents as f64,
                0.0,
                (self.population / 2) as f64,
                "0 to half the population",
            ),
            ("sigma", self.sigma, 0.0, *STEPS.end(), "0 to 100"),
            ("start", f64::from(self.start), 0.0, 100.0, "0 to 100"),
            ("learning", self.learning, 0.0, 10.0, "0 to 10"),
        ])
    }

    fn mu(&self) -> usize {
        if self.parents == 0 { self.population / 4 } else { self.parents }
    }
}

/// The strategy and its whole state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Es {
    settings: EsSettings,
    /// Generations that were told.
    generation: u64,
    random: Random,
    /// What the parents have become: a point, and one step or one for each gene.
    centre: Vec<f32>,
    step: Vec<f64>,
    genomes: Vec<Vec<f32>>,
    /// The steps that made each genome.
    steps: Vec<Vec<f64>>,
}

impl Es {
    /// The first generation: genomes of `genes` numbers.
    ///
    /// # Errors
    /// Settings out of range, no genes.
    pub fn new(settings: EsSettings, genes: usize, seed: u64) -> Result<Self, EvolveError> {
        settings.check()?;
        some_genes(genes)?;
        let mut random = Random::new(seed);
        let centre = scattered(genes, settings.start, &mut random);
        let first = if settings.sigma == 0.0 { 0.5 } else { settings.sigma.max(*STEPS.start()) };
        let step = vec![first; if settings.per_gene { genes } else { 1 }];
        let (genomes, steps) = (vec![], vec![]);
        let mut search = Self { settings, generation: 0, random, centre, step, genomes, steps };
        search.draw();
        Ok(search)
    }

    /// Its settings.
    pub fn settings(&self) -> &EsSettings {
        &self.settings
    }

    /// The step first, then the genome with it, so that a good step is what makes good genomes.
    fn draw(&mut self) {
        let (n, learning) = (self.centre.len() as f64, self.settings.learning);
        let (all, each) = match self.settings.per_gene {
            false => (learning / n.sqrt(), 0.0),
            true => (learning / (2.0 * n).sqrt(), learning / (2.0 * n.sqrt()).sqrt()),
        };
        self.genomes.clear();
        self.steps.clear();
        for _ in 0..self.settings.population {
            let shared = all * self.random.normal();
            let mut change = |step: &f64| {
                let own = if each > 0.0 { each * self.random.normal() } else { 0.0 };
                (step * libm::exp(shared + own)).clamp(*STEPS.start(), *STEPS.end())
            };
            let steps: Vec<_> = self.step.iter().map(&mut change).collect();
            let of = |index: usize| steps[index % steps.len()];
            let genes = self.centre.iter().enumerate();
            let genome = genes.map(|(i, &x)| gene(f64::from(x) + of(i) * self.random.normal()));
            self.genomes.push(genome.collect());
            self.steps.push(steps);
        }
    }
}

impl Strategy for Es {
    fn generation(&self) -> u64 {
        self.generation
    }

    fn ask(&self) -> &[Vec<f32>] {
        &self.genomes
    }

    /// A fitness that is not finite is no parent's; if none is finite, the same distribution is drawn
    /// from again.
    fn tell(&mut self, outcomes: &[Outcome]) -> Result<(), EvolveError> {
        as_many(outcomes, &self.genomes)?;
        let mut parents = ranking(outcomes);
        parents.retain(|&parent| outcomes[parent].fitness.is_finite());
        parents.truncate(self.settings.mu());
        if !parents.is_empty() {
            let weights = log_weights(parents.len());
            let mean = |number: &dyn Fn(usize) -> f64| -> f64 {
                parents.iter().zip(&weights).map(|(&parent, weight)| weight * number(parent)).sum()
            };
            for (i, x) in self.centre.iter_mut().enumerate() {
                *x = gene(mean(&|parent| f64::from(self.genomes[parent][i])));
            }
            // The geometric mean: without selection, steps then neither grow nor shrink.
            for (i, step) in self.step.iter_mut().enumerate() {
                let log = mean(&|parent| libm::log(self.steps[parent][i]));
                *step = libm::exp(log).clamp(*STEPS.start(), *STEPS.end());
            }
        }
        self.draw();
        self.generation += 1;
        Ok(())
    }

    fn check(&self) -> Result<(), EvolveError> {
        self.settings.check()?;
        countable(self.generation)?;
        let (genes, count) = (self.centre.len(), self.settings.population);
        fit(&self.genomes, count, genes)?;
        fit(std::slice::from_ref(&self.centre), 1, genes)?;
        state(self.steps.len() == count, "steps that are not as many as genomes")?;
        for steps in self.steps.iter().chain([&self.step]) {
            finite(steps, if self.settings.per_gene { genes } else { 1 })?;
            state(steps.iter().all(|step| STEPS.contains(step)), "a step out of its range")?;
        }
        Ok(())
    }

    fn best_guess(&self) -> Option<&[f32]> {
        Some(&self.centre)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(settings: EsSettings, generations: usize, fitness: fn(&[f32]) -> f64) -> Es {
        let mut search = Es::new(settings, 5, 1).unwrap();
        for _ in 0..generations {
            let told = |genome: &Vec<f32>| Outcome { fitness: fitness(genome), behaviour: vec![] };
            let outcomes: Vec<_> = search.ask().iter().map(told).collect();
            search.tell(&outcomes).unwrap();
        }
        search
    }

    /// On a slope without end steps grow; around a top they shrink.
    #[test]
    fn the_step_adapts_itself() {
        for per_gene in [false, true] {
            let settings = EsSettings { per_gene, ..EsSettings::default() };
            let slope = after(settings.clone(), 20, |genome| f64::from(genome[0]));
            assert!(slope.step[0] > 2.0, "{:?}", slope.step);
            let top = after(settings, 40, |x| -x.iter().map(|x| f64::from(x * x)).sum::<f64>());
            assert!(top.step.iter().all(|&step| step < 0.01), "{:?}", top.step);
        }
    }

    /// With a step for each gene, those that matter get smaller ones.
    #[test]
    fn genes_have_steps_of_their_own() {
        let settings = EsSettings { per_gene: true, ..EsSettings::default() };
        let search = after(settings, 40, |genome| -f64::from(genome[0] * genome[0]));
        let others = search.step[1..].iter().copied().fold(f64::INFINITY, f64::min);
        assert!(search.step[0] * 5.0 < others, "{:?}", search.step);
    }

    #[test]
    fn the_centre_is_the_weighted_mean_of_the_parents() {
        let settings = EsSettings { population: 8, parents: 2, ..EsSettings::default() };
        let mut search = Es::new(settings, 3, 1).unwrap();
        let (best, second) = (search.ask()[6].clone(), search.ask()[1].clone());
        let mut outcomes = vec![Outcome::default(); 8];
        (outcomes[6].fitness, outcomes[1].fitness) = (9.0, 8.0);
        // Not a parent, though more than any.
        outcomes[3].fitness = f64::INFINITY;
        search.tell(&outcomes).unwrap();
        // ln 2.5 to ln 1.25.
        let share = 0.80416;
        for (i, x) in search.best_guess().unwrap().iter().enumerate() {
            assert!((x - (share * best[i] + (1.0 - share) * second[i])).abs() < 1e-4);
        }
    }

    /// Fewer of them than parents: those that are; none: nobody goes anywhere.
    #[test]
    fn only_a_finite_fitness_makes_a_parent() {
        let mut search = Es::new(EsSettings::default(), 3, 1).unwrap();
        let best = search.ask()[40].clone();
        let mut outcomes = vec![Outcome { fitness: f64::NAN, behaviour: vec![] }; 64];
        outcomes[40].fitness = -5.0;
        search.tell(&outcomes).unwrap();
        assert_eq!(search.centre, best);
        let step = search.step.clone();
        outcomes[40].fitness = f64::INFINITY;
        search.tell(&outcomes).unwrap();
        assert_eq!((search.centre, search.step), (best, step));
    }

    #[test]
    fn parents_are_no_more_than_half() {
        let settings = EsSettings { parents: 33, ..EsSettings::default() };
        let error = Es::new(settings, 3, 1).unwrap_err().to_string();
        assert_eq!(error, "evolution.parents: 33 is not 0 to half the population");
    }
}
