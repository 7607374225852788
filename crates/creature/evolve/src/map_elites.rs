//! MAP-Elites: not the best motion, but the best of every kind.
//!
//! Mouret and Clune, "Illuminating search spaces by mapping elites", 2015, figure 2: an archive with a
//! cell for each kind of behaviour; a cell keeps the best of its kind, and whoever is kept may have
//! children. Variation is iso+line: Vassiliades and Mouret, "Discovering the elite hypervolume by
//! leveraging interspecies correlation", 2018: x + σ₁ N(0, I) + σ₂ (y − x) N(0, 1).

use serde::{Deserialize, Serialize};

use crate::common::{as_many, countable, fit, gene, in_range, scattered, some_genes, state};
use crate::{EvolveError, Outcome, Random, Strategy};

/// Settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct MapElitesSettings {
    /// Genomes of a generation, 1 to 100000.
    pub population: usize,
    /// How many cells for each number of a behaviour: 1 to 8 numbers, 100000 cells in all at most.
    pub cells: Vec<usize>,
    /// Genes of the first generation are uniform within ± this, 0 to 100.
    pub start: f32,
    /// Standard deviation of a gene's own change, σ₁, 0 to 100.
    pub iso: f64,
    /// Standard deviation of the change along the line to another elite, σ₂, as a share of the
    /// distance, 0 to 10. The paper's: 0.2.
    pub line: f64,
}

impl Default for MapElitesSettings {
    fn default() -> Self {
        Self { population: 64, cells: vec![8, 8], start: 1.0, iso: 0.1, line: 0.2 }
    }
}

impl MapElitesSettings {
    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), EvolveError> {
        let numbers = self.cells.len() as f64;
        let cells: f64 = self.cells.iter().map(|&cells| cells as f64).product();
        in_range(&[
            ("population", self.population as f64, 1.0, 1e5, "1 to 100000"),
            ("cells", numbers, 1.0, 8.0, "a list of 1 to 8 numbers"),
            ("cells", cells, 1.0, 1e5, "1 to 100000 cells in all"),
            ("start", f64::from(self.start), 0.0, 100.0, "0 to 100"),
            ("iso", self.iso, 0.0, 100.0, "0 to 100"),
            ("line", self.line, 0.0, 10.0, "0 to 10"),
        ])
    }
}

/// The best of its kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Elite {
    /// Which cell along each number of its behaviour.
    cell: Vec<usize>,
    fitness: f64,
    genome: Vec<f32>,
}

/// The strategy and its whole state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapElites {
    settings: MapElitesSettings,
    genes: usize,
    /// Generations that were told.
    generation: u64,
    random: Random,
    /// Cells that are taken, in their order.
    archive: Vec<Elite>,
    genomes: Vec<Vec<f32>>,
}

impl MapElites {
    /// The first generation: genomes of `genes` numbers.
    ///
    /// # Errors
    /// Settings out of range, no genes.
    pub fn new(settings: MapElitesSettings, genes: usize, seed: u64) -> Result<Self, EvolveError> {
        settings.check()?;
        some_genes(genes)?;
        let (random, archive, genomes) = (Random::new(seed), vec![], vec![]);
        let mut search = Self { settings, genes, generation: 0, random, archive, genomes };
        search.draw();
        Ok(search)
    }

    /// Its settings.
    pub fn settings(&self) -> &MapElitesSettings {
        &self.settings
    }

    /// What there is to choose from: the cell along each number of the behaviour, the fitness and the
    /// genome of each elite, in the order of the cells.
    pub fn archive(&self) -> impl ExactSizeIterator<Item = (&[usize], f64, &[f32])> {
        self.archive.iter().map(|elite| (&elite.cell[..], elite.fitness, &elite.genome[..]))
    }

    /// Children of elites; as long as there are none, random genomes.
    fn draw(&mut self) {
        let (settings, archive, random) = (&self.settings, &self.archive, &mut self.random);
        let mut child = || {
            if archive.is_empty() {
                return scattered(self.genes, settings.start, random);
            }
            let mut one = || &archive[random.below(archive.len())].genome;
            let (x, y) = (one(), one());
            let along = settings.line * random.normal();
            let mut vary = |(&x, &y): (&f32, &f32)| {
                let (x, y) = (f64::from(x), f64::from(y));
                gene(x + settings.iso * random.normal() + along * (y - x))
            };
            x.iter().zip(y).map(&mut vary).collect()
        };
        self.genomes = (0..settings.population).map(|_| child()).collect();
    }

    fn cell(&self, behaviour: &[f64]) -> Vec<usize> {
        let cell = |(&number, &cells): (&f64, &usize)| {
            ((number * cells as f64).max(0.0) as usize).min(cells - 1)
        };
        behaviour.iter().zip(&self.settings.cells).map(cell).collect()
    }
}

impl Strategy for MapElites {
    fn generation(&self) -> u64 {
        self.generation
    }

    fn ask(&self) -> &[Vec<f32>] {
        &self.genomes
    }

    /// A cell changes hands for more fitness only. What is not finite gets no cell, and its behaviour
    /// may be empty; numbers of a behaviour beyond 0 to 1 count as the nearest.
    fn tell(&mut self, outcomes: &[Outcome]) -> Result<(), EvolveError> {
        as_many(outcomes, &self.genomes)?;
        let expected = self.settings.cells.len();
        let finite = |outcome: &Outcome| {
            outcome.fitness.is_finite() && outcome.behaviour.iter().all(|number| !number.is_nan())
        };
        let sound = outcomes.iter().enumerate().filter(|(_, outcome)| finite(outcome));
        if let Some((_, bad)) = sound.clone().find(|(_, out)| out.behaviour.len() != expected) {
            return Err(EvolveError::Behaviour { got: bad.behaviour.len(), expected });
        }
        for (index, &Outcome { fitness, ref behaviour }) in sound {
            let cell = self.cell(behaviour);
            let place = self.archive.binary_search_by(|elite| elite.cell.cmp(&cell));
            if place.is_ok_and(|at| self.archive[at].fitness >= fitness) {
                continue;
            }
            let elite = Elite { cell, fitness, genome: self.genomes[index].clone() };
            match place {
                Ok(at) => self.archive[at] = elite,
                Err(at) => self.archive.insert(at, elite),
            }
        }
        self.draw();
        self.generation += 1;
        Ok(())
    }

    fn check(&self) -> Result<(), EvolveError> {
        self.settings.check()?;
        countable(self.generation)?;
        fit(&self.genomes, self.settings.population, self.genes)?;
        for elite in &self.archive {
            fit(std::slice::from_ref(&elite.genome), 1, self.genes)?;
            let within = elite.cell.iter().zip(&self.settings.cells).all(|(cell, end)| cell < end);
            let place = elite.cell.len() == self.settings.cells.len() && within;
            state(place && elite.fitness.is_finite(), "an elite that fits no cell")?;
        }
        state(self.archive.is_sorted_by(|a, b| a.cell < b.cell), "elites out of order")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(fitness: f64, behaviour: &[f64]) -> Outcome {
        Outcome { fitness, behaviour: behaviour.to_vec() }
    }

    fn small() -> MapElites {
        let settings = MapElitesSettings { population: 6, cells: vec![4, 2], ..Default::default() };
        MapElites::new(settings, 3, 1).unwrap()
    }

    #[test]
    fn a_cell_keeps_the_best_of_its_kind() {
        let mut search = small();
        let first = search.ask().to_vec();
        let outcomes = [
            outcome(1.0, &[0.9, 0.1]),
            outcome(2.0, &[0.8, 0.4]),
            outcome(5.0, &[0.0, 1.0]),
            outcome(1.5, &[0.76, 0.3]),
            // Beyond the edge counts as the edge; what is no number, as nothing.
            outcome(-3.0, &[7.0, -1.0]),
            outcome(9.0, &[f64::NAN, 0.5]),
        ];
        search.tell(&outcomes).unwrap();
        let kept: Vec<_> = search.archive().collect();
        assert_eq!(kept, [(&[0, 1][..], 5.0, &first[2][..]), (&[3, 0], 2.0, &first[1])]);
        let mut broken = search.clone();
        broken.archive.reverse();
        assert!(search.check().is_ok() && broken.check().is_err());
        // As good is not better.
        search.tell(&vec![outcome(2.0, &[0.8, 0.4]); 6]).unwrap();
        assert_eq!(search.archive().nth(1).unwrap().2, first[1]);
        let second = search.ask().to_vec();
        search.tell(&vec![outcome(2.5, &[0.8, 0.4]); 6]).unwrap();
        assert_eq!(search.archive().nth(1).unwrap(), (&[3, 0][..], 2.5, &second[0][..]));
    }

    #[test]
    fn a_behaviour_of_another_length_is_refused_and_changes_nothing() {
        let mut search = small();
        let before = search.clone();
        let mut outcomes = vec![outcome(1.0, &[0.5, 0.5]); 6];
        outcomes[4].behaviour.pop();
        let error = search.tell(&outcomes).unwrap_err();
        assert_eq!(error, EvolveError::Behaviour { got: 1, expected: 2 });
        assert_eq!(search, before);
        // Whoever came to nothing has no behaviour.
        outcomes[4] = outcome(f64::NAN, &[]);
        search.tell(&outcomes).unwrap();
    }

    /// Children lie around the line through their parents: with σ₁ = 0, on it.
    #[test]
    fn children_vary_along_the_line_between_elites() {
        let mut search = small();
        search.settings.iso = 0.0;
        let mut outcomes = vec![outcome(f64::NAN, &[]); 6];
        (outcomes[0], outcomes[1]) = (outcome(1.0, &[0.0, 0.0]), outcome(1.0, &[1.0, 1.0]));
        let (a, b) = (search.ask()[0].clone(), search.ask()[1].clone());
        search.tell(&outcomes).unwrap();
        for child in search.ask() {
            let along = |i: usize| (child[i] - a[i]) / (b[i] - a[i]);
            assert!((along(0) - along(1)).abs() < 1e-4 && (along(1) - along(2)).abs() < 1e-4);
        }
        assert!(search.ask().iter().any(|child| *child != a && *child != b));
    }

    /// The hill's slope fills cells that the first generation left empty, each better and better.
    #[test]
    fn fills_the_map() {
        let settings = MapElitesSettings { population: 50, ..Default::default() };
        let mut search = MapElites::new(settings, 6, 1).unwrap();
        for _ in 0..200 {
            let told = |genome: &Vec<f32>| {
                let x: Vec<_> = genome.iter().map(|&x| f64::from(x)).collect();
                let cost: f64 = x[2..].iter().map(|x| (x - 1.0) * (x - 1.0)).sum();
                outcome(-cost, &[(x[0] + 3.0) / 6.0, (x[1] + 3.0) / 6.0])
            };
            let outcomes: Vec<_> = search.ask().iter().map(told).collect();
            search.tell(&outcomes).unwrap();
        }
        assert_eq!(search.archive().len(), 64);
        let worst = search.archive().map(|(_, fitness, _)| fitness).fold(0.0, f64::min);
        assert!(worst > -0.5, "{worst}");
    }

    #[test]
    fn cells_are_some_but_not_too_many() {
        for (cells, value, expected) in [
            (vec![], 0.0, "a list of 1 to 8 numbers"),
            (vec![2; 9], 9.0, "a list of 1 to 8 numbers"),
            (vec![8, 0], 0.0, "1 to 100000 cells in all"),
            (vec![1000, 101], 101_000.0, "1 to 100000 cells in all"),
        ] {
            let settings = MapElitesSettings { cells, ..Default::default() };
            let error = EvolveError::Setting { field: "cells", value, expected };
            assert_eq!(settings.check().unwrap_err(), error);
        }
    }
}
