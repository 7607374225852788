//! The seed's genetic algorithm: conventional neuroevolution.
//!
//! Gegendorfer 2017, sections 2.1.3, 3.1.2 and figure 4.6: fitness-proportionate selection (roulette
//! wheel), one-point crossover, mutation by a rate for each gene and a limit for its change, elites
//! carried over. Where it says nothing this does what is usual, and says so at the setting.

use serde::{Deserialize, Serialize};

use crate::common::{SHARE, as_many, countable, fit, in_range, ranking, scattered, some_genes};
use crate::{EvolveError, Outcome, Random, Strategy};

/// How a fitness becomes a share of the roulette wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Selection {
    /// In proportion to the fitness; negative counts as nothing. If nobody has any, all are equal.
    #[default]
    Proportional,
    /// In proportion to how much better than the worst of the generation.
    Windowed,
}

/// Settings, with the seed's values as defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table of settings")]
pub struct GeneticSettings {
    /// Genomes of a generation, 2 to 100000.
    pub population: usize,
    /// Chance that two parents are crossed; else the first is taken as it is.
    pub crossover: f64,
    /// Chance of each gene to change.
    pub mutation_rate: f64,
    /// A change is uniform within ± this.
    pub mutation_limit: f32,
    /// The best so many go on unchanged. The seed has elites, but not how many: 2.
    pub elites: usize,
    /// Genes of the first generation are uniform within ± this. The seed says nothing: 1.
    pub start: f32,
    /// How fitness becomes a share of the wheel.
    pub selection: Selection,
}

impl Default for GeneticSettings {
    fn default() -> Self {
        Self {
            population: 50,
            crossover: 0.7,
            mutation_rate: 0.1,
            mutation_limit: 0.1,
            elites: 2,
            start: 1.0,
            selection: Selection::Proportional,
        }
    }
}

impl GeneticSettings {
    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), EvolveError> {
        in_range(&[
            ("population", self.population as f64, 2.0, 1e5, "2 to 100000"),
            ("crossover", self.crossover, 0.0, 1.0, SHARE),
            ("mutation_rate", self.mutation_rate, 0.0, 1.0, SHARE),
            ("mutation_limit", f64::from(self.mutation_limit), 0.0, 100.0, "0 to 100"),
            (
                "elites",
                self.elites as f64,
                0.0,
                self.population as f64 - 1.0,
                "0 to less than the population",
            ),
            ("start", f64::from(self.start), 0.0, 100.0, "0 to 100"),
        ])
    }
}

/// The algorithm and its whole state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Genetic {
    settings: GeneticSettings,
    genes: usize,
    /// Generations that were told.
    generation: u64,
    random: Random,
    genomes: Vec<Vec<f32>>,
}

impl Genetic {
    /// The first generation: genomes of `genes` numbers.
    ///
    /// # Errors
    /// Settings out of range, no genes.
    pub fn new(settings: GeneticSettings, genes: usize, seed: u64) -> Result<Self, EvolveError> {
        settings.check()?;
        some_genes(genes)?;
        let mut random = Random::new(seed);
        let genomes = (0..settings.population)
            .map(|_| scattered(genes, settings.start, &mut random))
            .collect();
        Ok(Self { settings, genes, generation: 0, random, genomes })
    }

    /// Its settings.
    pub fn settings(&self) -> &GeneticSettings {
        &self.settings
    }

    fn child(&mut self, wheel: &[f64]) -> Vec<f32> {
        let first = spin(wheel, self.random.unit());
        let second = spin(wheel, self.random.unit());
        let mut child = self.genomes[first].clone();
        if self.random.unit() < self.settings.crossover {
            // From one point on as the second; at least one gene of each where there are two.
            let point = 1 + self.random.below(self.genes.saturating_sub(1).max(1));
            let point = point.min(self.genes);
            child[point..].copy_from_slice(&self.genomes[second][point..]);
        }
        for gene in &mut child {
            if self.random.unit() < self.settings.mutation_rate {
                *gene += self.random.around(self.settings.mutation_limit);
            }
        }
        child
    }
}

impl Strategy for Genetic {
    fn generation(&self) -> u64 {
        self.generation
    }

    fn ask(&self) -> &[Vec<f32>] {
        &self.genomes
    }

    /// A fitness that is not finite has no children.
    fn tell(&mut self, outcomes: &[Outcome]) -> Result<(), EvolveError> {
        as_many(outcomes, &self.genomes)?;
        let wheel = wheel(outcomes, self.settings.selection);
        let mut next: Vec<_> = ranking(outcomes)
            .into_iter()
            .take(self.settings.elites)
            .filter(|&index| outcomes[index].fitness.is_finite())
            .map(|index| self.genomes[index].clone())
            .collect();
        while next.len() < self.settings.population {
            next.push(self.child(&wheel));
        }
        self.genomes = next;
        self.generation += 1;
        Ok(())
    }

    fn check(&self) -> Result<(), EvolveError> {
        self.settings.check()?;
        countable(self.generation)?;
        fit(&self.genomes, self.settings.population, self.genes)
    }
}

/// Where each one's share of the wheel ends; the last is the whole.
fn wheel(outcomes: &[Outcome], selection: Selection) -> Vec<f64> {
    let fitness = || outcomes.iter().map(|outcome| outcome.fitness);
    let finite = || fitness().filter(|value| value.is_finite());
    let floor = match selection {
        Selection::Proportional => 0.0,
        Selection::Windowed => finite().fold(f64::INFINITY, f64::min),
    };
    // A share of the largest, so that no sum overflows.
    let most = finite().map(|value| value - floor).fold(0.0, f64::max);
    let share = |value: f64| {
        if !value.is_finite() {
            0.0
        } else if most > 0.0 {
            ((value - floor) / most).max(0.0)
        } else {
            1.0
        }
    };
    let mut shares: Vec<_> = fitness().map(share).collect();
    if shares.iter().all(|&share| share == 0.0) {
        shares.fill(1.0);
    }
    let mut sum = 0.0;
    for share in &mut shares {
        sum += *share;
        *share = sum;
    }
    shares
}

/// Whose share a turn of the wheel, 0 to 1, stops at.
fn spin(wheel: &[f64], turn: f64) -> usize {
    let stop = turn * wheel[wheel.len() - 1];
    wheel.partition_point(|&end| end <= stop).min(wheel.len() - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::{any, prop, prop_assert, proptest};

    fn told(fitness: &[f64]) -> Vec<Outcome> {
        fitness.iter().map(|&fitness| Outcome { fitness, behaviour: vec![] }).collect()
    }

    #[test]
    fn elites_go_on_unchanged_best_first() {
        let mut search = Genetic::new(GeneticSettings::default(), 4, 1).unwrap();
        let (third, ninth) = (search.ask()[3].clone(), search.ask()[9].clone());
        let mut fitness = vec![1.0; 50];
        (fitness[9], fitness[3]) = (3.0, 2.0);
        search.tell(&told(&fitness)).unwrap();
        assert_eq!(search.ask()[..2], [ninth, third]);
        assert_eq!(search.generation(), 1);
    }

    #[test]
    fn no_elite_is_not_finite() {
        let settings = GeneticSettings { mutation_rate: 0.0, ..GeneticSettings::default() };
        let mut search = Genetic::new(settings, 4, 1).unwrap();
        let only = search.ask()[7].clone();
        let mut fitness = vec![f64::INFINITY; 50];
        fitness[7] = 2.0;
        search.tell(&told(&fitness)).unwrap();
        assert!(search.ask().iter().all(|genome| *genome == only));
    }

    #[test]
    fn the_wheel_is_in_proportion() {
        let ends = wheel(&told(&[1.0, 3.0, -5.0, f64::NAN, 4.0]), Selection::Proportional);
        let mut counts = [0; 5];
        let mut random = Random::new(3);
        for _ in 0..80_000 {
            counts[spin(&ends, random.unit())] += 1;
        }
        for (count, expected) in counts.into_iter().zip([10_000, 30_000, 0, 0, 40_000]) {
            assert!((count as i64 - expected as i64).abs() < 600, "{counts:?}");
        }
        let windowed = wheel(&told(&[-3.0, -1.0, f64::INFINITY]), Selection::Windowed);
        assert_eq!(windowed, [0.0, 1.0, 1.0]);
        for hopeless in [[f64::NAN; 3], [-1.0; 3]] {
            assert_eq!(wheel(&told(&hopeless), Selection::Proportional), [1.0, 2.0, 3.0]);
        }
    }

    /// Without mutation a child is one parent up to a point and another from there on.
    #[test]
    fn crossover_has_one_point() {
        let settings = GeneticSettings {
            mutation_rate: 0.0,
            crossover: 1.0,
            elites: 0,
            ..GeneticSettings::default()
        };
        let mut search = Genetic::new(settings, 12, 5).unwrap();
        let parents = search.ask().to_vec();
        search.tell(&told(&[1.0; 50])).unwrap();
        let mut mixed = 0;
        for child in search.ask() {
            let from: Vec<_> = (0..12)
                .map(|i| parents.iter().position(|parent| parent[i] == child[i]).unwrap())
                .collect();
            let changes = from.windows(2).filter(|pair| pair[0] != pair[1]).count();
            assert!(changes <= 1, "{from:?}");
            mixed += changes;
        }
        assert!(mixed > 40, "two different parents nearly always: {mixed}");
    }

    #[test]
    fn mutation_keeps_its_rate_and_limit() {
        let settings = GeneticSettings { crossover: 0.0, elites: 0, ..GeneticSettings::default() };
        let mut search = Genetic::new(settings, 1000, 5).unwrap();
        let parents = search.ask().to_vec();
        // One parent of all.
        let mut fitness = vec![0.0; 50];
        fitness[0] = 1.0;
        search.tell(&told(&fitness)).unwrap();
        let changes = search.ask().iter().flat_map(|child| {
            child.iter().zip(&parents[0]).map(|(a, b)| (a - b).abs()).filter(|d| *d > 0.0)
        });
        let changes: Vec<_> = changes.collect();
        let (count, most) = (changes.len() as f64, changes.iter().copied().fold(0.0, f32::max));
        assert!((count / 50_000.0 - 0.1).abs() < 0.01, "{count}");
        assert!(most <= 0.1001 && most > 0.095, "{most}");
    }

    #[test]
    fn elites_are_less_than_the_population() {
        let settings = GeneticSettings { elites: 50, ..GeneticSettings::default() };
        let error = Genetic::new(settings, 3, 1).unwrap_err().to_string();
        assert_eq!(error, "evolution.elites: 50 is not 0 to less than the population");
    }

    /// The stream is part of what a seed means: results that were published stay as they are.
    #[test]
    fn the_genomes_of_a_seed_never_change() {
        let mut search = Genetic::new(GeneticSettings::default(), 6, 7).unwrap();
        for _ in 0..20 {
            let sums: Vec<f64> = search
                .ask()
                .iter()
                .map(|genome| genome.iter().map(|&g| f64::from(g)).sum())
                .collect();
            search.tell(&told(&sums)).unwrap();
        }
        let bits = search.ask().iter().flatten().map(|gene| u64::from(gene.to_bits()));
        let hash = bits.fold(0xCBF2_9CE4_8422_2325, |hash: u64, word| {
            (hash ^ word).wrapping_mul(0x0000_0100_0000_01B3)
        });
        assert_eq!(hash, 0x49F7_8862_5CD1_AC87);
    }

    proptest! {
        /// Whatever is told, genomes stay finite and what is not finite never wins.
        #[test]
        fn nothing_that_is_not_finite_wins(
            fitness in prop::collection::vec(prop::num::f64::ANY, 8), seed in any::<u64>(),
        ) {
            let settings = GeneticSettings {
                population: 8, elites: 2, crossover: 0.0, mutation_rate: 0.0,
                ..GeneticSettings::default()
            };
            let mut search = Genetic::new(settings, 3, seed).unwrap();
            let parents = search.ask().to_vec();
            search.tell(&told(&fitness)).unwrap();
            search.check().unwrap();
            if fitness.iter().any(|value| value.is_finite()) {
                for child in search.ask() {
                    let from = parents.iter().position(|parent| parent == child).unwrap();
                    prop_assert!(fitness[from].is_finite());
                }
            }
        }
    }
}
