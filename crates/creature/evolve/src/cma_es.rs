//! CMA-ES: evolution strategy with covariance matrix adaptation.
//!
//! Hansen, "The CMA evolution strategy: a tutorial", 2016 (arXiv 1604.00772; c_μ as revised in 2023):
//! equations 38 to 47 and the constants 49 to 58, negative weights included; appendix B.2's rare
//! decompositions. Diagonal: Ros and Hansen, "A simple modification in CMA-ES achieving linear time and
//! space complexity", 2008.

mod constants;

use serde::{Deserialize, Serialize};

use crate::common::{
    as_many, countable, finite, fit, gene, in_range, ranking, scattered, some_genes, state,
};
use crate::eigen::eigen;
use crate::{EvolveError, Outcome, Random, Strategy};
use constants::Constants;

/// The step σ stays within these, so that a fitness that says nothing leads nowhere far.
const SIGMA: std::ops::RangeInclusive<f64> = 1e-6..=100.0;

/// More genes than this are too many for a whole matrix, unless it is asked for.
const MOST_FOR_FULL: usize = 64;

/// The shortest axis of the distribution, as a share of the longest, squared.
const FLATTEST: f64 = 1e-14;

/// Which part of the covariance is learnt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Covariance {
    /// `full` up to 64 genes, `diagonal` for more.
    #[default]
    Auto,
    /// Which genes go together, too: squares of the genes in memory and time.
    Full,
    /// Only how far each gene goes; learns it faster.
    Diagonal,
}

/// Settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct CmaEsSettings {
    /// Genomes of a generation, λ, 4 to 100000; 0: 4 + 3 ln(genes) as in the tutorial, but at least 16.
    pub population: usize,
    /// Standard deviation of a gene in the first generation, 0.000001 to 100.
    pub sigma: f64,
    /// The first generation's centre is uniform within ± this, 0 to 100.
    pub start: f32,
    /// Which part of the covariance is learnt.
    pub covariance: Covariance,
    /// Whether bad genomes teach as well, by negative weights.
    pub active: bool,
}

impl Default for CmaEsSettings {
    fn default() -> Self {
        let (population, sigma, start) = (0, 0.5, 0.0);
        Self { population, sigma, start, covariance: Covariance::Auto, active: true }
    }
}

impl CmaEsSettings {
    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), EvolveError> {
        let least = if self.population == 0 { 0.0 } else { 4.0 };
        in_range(&[
            ("population", self.population as f64, least, 1e5, "0 or 4 to 100000"),
            ("sigma", self.sigma, *SIGMA.start(), *SIGMA.end(), "0.000001 to 100"),
            ("start", f64::from(self.start), 0.0, 100.0, "0 to 100"),
        ])
    }

    fn lambda(&self, genes: usize) -> usize {
        let formula = || (4.0 + 3.0 * libm::log(genes as f64)) as usize;
        if self.population == 0 { formula().max(16) } else { self.population }
    }

    fn diagonal(&self, genes: usize) -> bool {
        match self.covariance {
            Covariance::Auto => genes > MOST_FOR_FULL,
            Covariance::Full => false,
            Covariance::Diagonal => true,
        }
    }
}

/// The strategy and its whole state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CmaEs {
    settings: CmaEsSettings,
    /// Generations that were told.
    generation: u64,
    random: Random,
    /// The distribution N(m, σ² C): m, σ, and C row by row or only its diagonal.
    centre: Vec<f32>,
    sigma: f64,
    covariance: Vec<f64>,
    /// C = Bᵀ D² B as it was when `decomposed`: B row by row, nothing if C is diagonal; D.
    basis: Vec<f64>,
    axes: Vec<f64>,
    decomposed: u64,
    /// The evolution paths p_σ and p_c.
    path_sigma: Vec<f64>,
    path: Vec<f64>,
    genomes: Vec<Vec<f32>>,
}

impl CmaEs {
    /// The first generation: genomes of `genes` numbers.
    ///
    /// # Errors
    /// Settings out of range, no genes.
    pub fn new(settings: CmaEsSettings, genes: usize, seed: u64) -> Result<Self, EvolveError> {
        settings.check()?;
        some_genes(genes)?;
        let mut random = Random::new(seed);
        let identity = || (0..genes * genes).map(|at| f64::from(at % (genes + 1) == 0)).collect();
        let diagonal = settings.diagonal(genes);
        let mut search = Self {
            centre: scattered(genes, settings.start, &mut random),
            sigma: settings.sigma,
            covariance: if diagonal { vec![1.0; genes] } else { identity() },
            basis: if diagonal { vec![] } else { identity() },
            axes: vec![1.0; genes],
            decomposed: 0,
            path_sigma: vec![0.0; genes],
            path: vec![0.0; genes],
            genomes: vec![],
            generation: 0,
            random,
            settings,
        };
        search.draw();
        Ok(search)
    }

    /// Its settings.
    pub fn settings(&self) -> &CmaEsSettings {
        &self.settings
    }

    fn genes(&self) -> usize {
        self.centre.len()
    }

    /// Equations 38 to 40: m + σ B D z.
    fn draw(&mut self) {
        let lambda = self.settings.lambda(self.genes());
        self.genomes.clear();
        for _ in 0..lambda {
            let along = self.axes.iter().map(|axis| axis * self.random.normal()).collect();
            let y = self.turned(along);
            let genes = self.centre.iter().zip(&y);
            self.genomes.push(genes.map(|(&m, y)| gene(f64::from(m) + self.sigma * y)).collect());
        }
    }

    /// From the axes of the distribution to genes.
    fn turned(&self, along: Vec<f64>) -> Vec<f64> {
        if self.basis.is_empty() {
            return along;
        }
        let mut y = vec![0.0; along.len()];
        for (axis, length) in self.basis.chunks_exact(y.len()).zip(along) {
            y.iter_mut().zip(axis).for_each(|(y, axis)| *y += length * axis);
        }
        y
    }

    /// From genes to the axes, each to its scale: D⁻¹ Bᵀ y, as long as C^(−½) y.
    fn whitened(&self, y: &[f64]) -> Vec<f64> {
        let along = |(i, axis): (usize, &f64)| {
            let axes = self.basis.chunks_exact(y.len()).nth(i);
            axes.map_or(y[i], |row| row.iter().zip(y).map(|(a, y)| a * y).sum()) / axis
        };
        self.axes.iter().enumerate().map(along).collect()
    }

    /// Equations 41 to 47.
    fn learn(&mut self, order: &[usize], mut constants: Constants, outcomes: &[Outcome]) {
        for (&index, weight) in order.iter().zip(&mut constants.weights) {
            // Nobody follows what is not finite, but it may be avoided.
            if !outcomes[index].fitness.is_finite() {
                *weight = weight.min(0.0);
            }
        }
        let Constants { weights, mu_eff, c_sigma, d_sigma, c_c, c_1, c_mu, chi } = constants;
        let n = self.genes();
        let y = |index: &usize| -> Vec<f64> {
            let genes = self.genomes[*index].iter().zip(&self.centre);
            genes.map(|(&x, &m)| (f64::from(x) - f64::from(m)) / self.sigma).collect()
        };
        let ys: Vec<_> = order.iter().map(y).collect();
        let mut step = vec![0.0; n];
        for (y, weight) in ys.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0) {
            step.iter_mut().zip(y).for_each(|(step, y)| *step += weight * y);
        }
        let normal_step = self.turned(self.whitened(&step));
        let keep = (c_sigma * (2.0 - c_sigma) * mu_eff).sqrt();
        for (path, step) in self.path_sigma.iter_mut().zip(&normal_step) {
            *path = (1.0 - c_sigma) * *path + keep * step;
        }
        let length = length(&self.path_sigma);
        let settled = 1.0 - libm::pow(1.0 - c_sigma, 2.0 * (self.generation + 1) as f64);
        let stall = length / settled.sqrt() >= (1.4 + 2.0 / (n as f64 + 1.0)) * chi;
        let keep = if stall { 0.0 } else { (c_c * (2.0 - c_c) * mu_eff).sqrt() };
        for (path, step) in self.path.iter_mut().zip(&step) {
            *path = (1.0 - c_c) * *path + keep * step;
        }
        // Equation 46, and its scale for what is avoided.
        let rank_mu = ys.iter().zip(&weights).map(|(y, &weight)| {
            let norm = if weight < 0.0 { self::length(&self.whitened(y)) } else { 1.0 };
            c_mu * if weight < 0.0 { weight * n as f64 / (norm * norm).max(1e-300) } else { weight }
        });
        let rank_mu: Vec<_> = rank_mu.collect();
        // Equation 47.
        let missing = if stall { c_1 * c_c * (2.0 - c_c) } else { 0.0 };
        let decay = 1.0 + missing - c_1 - c_mu * weights.iter().sum::<f64>();
        self.covariance.iter_mut().for_each(|c| *c *= decay);
        add(&mut self.covariance, c_1, &self.path);
        ys.iter().zip(rank_mu).for_each(|(y, weight)| add(&mut self.covariance, weight, y));
        for (m, step) in self.centre.iter_mut().zip(step) {
            *m = gene(f64::from(*m) + self.sigma * step);
        }
        let growth = (c_sigma / d_sigma * (length / chi - 1.0)).min(1.0);
        self.sigma = (self.sigma * libm::exp(growth)).clamp(*SIGMA.start(), *SIGMA.end());
        // Rarely enough that it costs no more than the rest: appendix B.2.
        let patience = 1.0 / (10.0 * n as f64 * (c_1 + c_mu));
        if self.basis.is_empty() || (self.generation + 1 - self.decomposed) as f64 > patience {
            self.decompose();
        }
    }

    fn decompose(&mut self) {
        let (mut squares, basis) = match self.basis.is_empty() {
            true => (self.covariance.clone(), vec![]),
            false => eigen(&self.covariance, self.genes()),
        };
        let longest = squares.iter().copied().fold(1e-20, f64::max);
        squares.iter_mut().for_each(|square| *square = square.max(FLATTEST * longest).sqrt());
        (self.axes, self.basis, self.decomposed) = (squares, basis, self.generation + 1);
    }
}

fn length(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Adds weight · y yᵀ to a matrix, or its diagonal to a diagonal.
fn add(matrix: &mut [f64], weight: f64, y: &[f64]) {
    if weight == 0.0 {
        return;
    }
    if matrix.len() == y.len() {
        return matrix.iter_mut().zip(y).for_each(|(c, y)| *c += weight * (y * y));
    }
    for (row, a) in matrix.chunks_exact_mut(y.len()).zip(y) {
        row.iter_mut().zip(y).for_each(|(c, b)| *c += weight * (a * b));
    }
}

impl Strategy for CmaEs {
    fn generation(&self) -> u64 {
        self.generation
    }

    fn ask(&self) -> &[Vec<f32>] {
        &self.genomes
    }

    /// If no fitness is finite, the same distribution is drawn from again.
    fn tell(&mut self, outcomes: &[Outcome]) -> Result<(), EvolveError> {
        as_many(outcomes, &self.genomes)?;
        if outcomes.iter().any(|outcome| outcome.fitness.is_finite()) {
            self.learn(&ranking(outcomes), Constants::new(&self.settings, self.genes()), outcomes);
        }
        self.draw();
        self.generation += 1;
        Ok(())
    }

    fn check(&self) -> Result<(), EvolveError> {
        self.settings.check()?;
        countable(self.generation)?;
        let genes = self.genes();
        fit(&self.genomes, self.settings.lambda(genes), genes)?;
        fit(std::slice::from_ref(&self.centre), 1, genes)?;
        let diagonal = self.settings.diagonal(genes);
        finite(&self.covariance, if diagonal { genes } else { genes * genes })?;
        finite(&self.basis, if diagonal { 0 } else { genes * genes })?;
        for numbers in [&self.axes, &self.path_sigma, &self.path] {
            finite(numbers, genes)?;
        }
        state(SIGMA.contains(&self.sigma), "a step out of its range")?;
        state(self.axes.iter().all(|&axis| axis > 0.0), "an axis of no length")?;
        state(self.decomposed <= self.generation, "a decomposition that is yet to come")
    }

    fn best_guess(&self) -> Option<&[f32]> {
        Some(&self.centre)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_population_is_by_the_formula_and_the_matrix_by_the_genes() {
        let settings = CmaEsSettings::default();
        let sizes = [1, 10, 60, 178].map(|genes| settings.lambda(genes));
        assert_eq!(sizes, [16, 16, 16, 19]);
        assert_eq!([64, 65].map(|genes| settings.diagonal(genes)), [false, true]);
        let three = CmaEsSettings { population: 3, ..settings };
        let error = three.check().unwrap_err().to_string();
        assert_eq!(error, "evolution.population: 3 is not 0 or 4 to 100000");
    }

    /// One that is finite: the centre goes to it alone, by its weight.
    #[test]
    fn only_a_finite_fitness_is_followed() {
        let mut search = CmaEs::new(CmaEsSettings::default(), 3, 1).unwrap();
        let best = search.ask()[9].clone();
        let mut outcomes = vec![Outcome { fitness: f64::NAN, behaviour: vec![] }; 16];
        outcomes[9].fitness = -5.0;
        search.tell(&outcomes).unwrap();
        let weight = Constants::new(&search.settings, 3).weights[0];
        for (m, x) in search.centre.iter().zip(&best) {
            assert!((f64::from(*m) - weight * f64::from(*x)).abs() < 1e-6);
        }
        let distribution = |search: &CmaEs| {
            (search.centre.clone(), search.sigma, search.covariance.clone(), search.path.clone())
        };
        let before = distribution(&search);
        outcomes[9].fitness = f64::INFINITY;
        search.tell(&outcomes).unwrap();
        assert_eq!(distribution(&search), before);
    }

    /// Equation 45: while σ still has to grow, the path of the covariance waits.
    #[test]
    fn a_long_path_stalls_the_other() {
        let mut search = CmaEs::new(CmaEsSettings::default(), 3, 1).unwrap();
        (search.path, search.path_sigma) = (vec![1.0; 3], vec![50.0; 3]);
        let keep = 1.0 - Constants::new(&search.settings, 3).c_c;
        search.tell(&vec![Outcome::default(); 16]).unwrap();
        assert_eq!(search.path, [keep; 3]);
    }

    /// C = Bᵀ D² B, and y as long as it should be in its own measure.
    #[test]
    fn the_axes_are_those_of_the_covariance() {
        let mut search = CmaEs::new(CmaEsSettings::default(), 6, 1).unwrap();
        for _ in 0..60 {
            let cost = |x: &Vec<f32>| -> f32 {
                x.windows(2).map(|p| (p[0] + p[1] - 1.0).powi(2) + 0.01 * p[0].powi(2)).sum()
            };
            let told = |x: &Vec<f32>| Outcome { fitness: -f64::from(cost(x)), behaviour: vec![] };
            let outcomes: Vec<_> = search.ask().iter().map(told).collect();
            search.tell(&outcomes).unwrap();
        }
        search.decompose();
        for i in 0..6 {
            for j in 0..6 {
                let along = search.basis.chunks(6).zip(&search.axes);
                let sum: f64 = along.map(|(b, axis)| axis * axis * b[i] * b[j]).sum();
                assert!(
                    (sum - search.covariance[i * 6 + j]).abs() < 1e-9 * search.axes[0].max(1.0)
                );
            }
        }
        let longest = search.axes.iter().copied().fold(0.0, f64::max);
        let shortest = search.axes.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(longest / shortest > 3.0, "it learnt the valley: {:?}", search.axes);
        let y: Vec<f64> = (0..6).map(|i| f64::from(i) - 2.0).collect();
        let back = search.turned(search.whitened(&y));
        // B is orthogonal: C^(−½) C^(½) is nothing.
        let again = search.basis.chunks(6).map(|b| b.iter().zip(&back).map(|(b, y)| b * y).sum());
        let stretched = again.zip(&search.axes).map(|(along, axis): (f64, _)| along * axis);
        for (found, expected) in search.turned(stretched.collect()).iter().zip(&y) {
            assert!((found - expected).abs() < 1e-9);
        }
    }
}
