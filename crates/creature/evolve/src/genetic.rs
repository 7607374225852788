//! The seed's genetic algorithm: conventional neuroevolution.
//!
//! Gegendorfer 2017, sections 2.1.3, 3.1.2 and figure 4.6: fitness-proportionate selection (roulette
//! wheel), one-point crossover, mutation by a rate for each gene and a limit for its change, elites
//! carried over. Where it says nothing this does what is usual, and says so at the setting.

use serde::{Deserialize, Serialize};

use crate::{EvolveError, Random};

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
        let share = "0 to 1";
        let fields = [
            ("population", self.population as f64, 2.0, 1e5, "2 to 100000"),
            ("crossover", self.crossover, 0.0, 1.0, share),
            ("mutation_rate", self.mutation_rate, 0.0, 1.0, share),
            ("mutation_limit", f64::from(self.mutation_limit), 0.0, 100.0, "0 to 100"),
            (
                "elites",
                self.elites as f64,
                0.0,
                self.population as f64 - 1.0,
                "0 to less than the population",
            ),
            ("start", f64::from(self.start), 0.0, 100.0, "0 to 100"),
        ];
        let bad =
            fields.into_iter().find(|(_, value, low, high, _)| !(*low..=*high).contains(value));
        match bad {
            Some((field, value, _, _, expected)) => {
                Err(EvolveError::Setting { field, value, expected })
            }
            None => Ok(()),
        }
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
        if genes == 0 {
            return Err(EvolveError::State("genomes of no genes".into()));
        }
        let mut random = Random::new(seed);
        let mut genome = || (0..genes).map(|_| random.around(settings.start)).collect();
        let genomes = (0..settings.population).map(|_| genome()).collect();
        Ok(Self { settings, genes, generation: 0, random, genomes })
    }

    /// Its settings.
    pub fn settings(&self) -> &GeneticSettings {
        &self.settings
    }

    /// How many generations were told.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The genomes whose fitness it wants to know.
    pub fn ask(&self) -> &[Vec<f32>] {
        &self.genomes
    }

    /// Takes a fitness for each genome, more is better, and makes the next generation. A fitness
    /// that is not finite is worse than any that is, and has no children.
    ///
    /// # Errors
    /// Another number of them than genomes.
    pub fn tell(&mut self, fitness: &[f64]) -> Result<(), EvolveError> {
        if fitness.len() != self.genomes.len() {
            let (got, expected) = (fitness.len(), self.genomes.len());
            return Err(EvolveError::Count { got, expected });
        }
        let wheel = wheel(fitness, self.settings.selection);
        let mut next: Vec<_> = ranking(fitness)
            .into_iter()
            .take(self.settings.elites)
            .filter(|&index| fitness[index].is_finite())
            .map(|index| self.genomes[index].clone())
            .collect();
        while next.len() < self.settings.population {
            next.push(self.child(&wheel));
        }
        self.genomes = next;
        self.generation += 1;
        Ok(())
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

    /// Checks a state that was stored.
    ///
    /// # Errors
    /// Settings out of range, genomes that are not what they say.
    pub fn check(&self) -> Result<(), EvolveError> {
        self.settings.check()?;
        let fits = |genome: &Vec<f32>| {
            genome.len() == self.genes && genome.iter().all(|gene| gene.is_finite())
        };
        if self.genes == 0
            || self.genomes.len() != self.settings.population
            || !self.genomes.iter().all(fits)
        {
            return Err(EvolveError::State("genomes that are not as its settings say".into()));
        }
        Ok(())
    }
}

/// Best first; ties by index; what is not finite last.
fn ranking(fitness: &[f64]) -> Vec<usize> {
    let value = |index: usize| {
        if fitness[index].is_finite() { fitness[index] } else { f64::NEG_INFINITY }
    };
    let mut order: Vec<_> = (0..fitness.len()).collect();
    order.sort_by(|&a, &b| value(b).total_cmp(&value(a)).then(a.cmp(&b)));
    order
}

/// Where each one's share of the wheel ends; the last is the whole.
fn wheel(fitness: &[f64], selection: Selection) -> Vec<f64> {
    let finite = || fitness.iter().copied().filter(|value| value.is_finite());
    let floor = match selection {
        Selection::Proportional => 0.0,
        Selection::Windowed => finite().fold(f64::INFINITY, f64::min),
    };
    // A share of the largest, so that no sum overflows.
    let most = finite().map(|value| value - floor).fold(0.0, f64::max);
    let share = |value: &f64| {
        if !value.is_finite() {
            0.0
        } else if most > 0.0 {
            ((value - floor) / most).max(0.0)
        } else {
            1.0
        }
    };
    let mut shares: Vec<_> = fitness.iter().map(share).collect();
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
    use proptest::prelude::*;

    fn sphere(genome: &[f32]) -> f64 {
        1.0 / (1.0 + genome.iter().map(|&g| f64::from(g - 0.5).powi(2)).sum::<f64>())
    }

    fn evolved(seed: u64, generations: usize) -> Genetic {
        let mut search = Genetic::new(GeneticSettings::default(), 6, seed).unwrap();
        for _ in 0..generations {
            let fitness: Vec<_> = search.ask().iter().map(|genome| sphere(genome)).collect();
            search.tell(&fitness).unwrap();
        }
        search
    }

    fn best(search: &Genetic) -> f64 {
        search.ask().iter().map(|genome| sphere(genome)).fold(0.0, f64::max)
    }

    #[test]
    fn finds_the_top_of_a_hill() {
        for seed in 0..3 {
            let (before, after) = (best(&evolved(seed, 0)), best(&evolved(seed, 300)));
            assert!(before < 0.9 && after > 0.97, "seed {seed}: {before} to {after}");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_genomes_and_a_stored_state_goes_on_with_them() {
        assert_eq!(evolved(7, 20), evolved(7, 20));
        assert_ne!(evolved(7, 20), evolved(8, 20));
        let stored = serde_json::to_string(&evolved(7, 10)).unwrap();
        let mut back: Genetic = serde_json::from_str(&stored).unwrap();
        back.check().unwrap();
        for _ in 0..10 {
            let fitness: Vec<_> = back.ask().iter().map(|genome| sphere(genome)).collect();
            back.tell(&fitness).unwrap();
        }
        assert_eq!(back, evolved(7, 20));
    }

    #[test]
    fn elites_go_on_unchanged_best_first() {
        let mut search = Genetic::new(GeneticSettings::default(), 4, 1).unwrap();
        let (third, ninth) = (search.ask()[3].clone(), search.ask()[9].clone());
        let mut fitness = vec![1.0; 50];
        (fitness[9], fitness[3]) = (3.0, 2.0);
        search.tell(&fitness).unwrap();
        assert_eq!(search.ask()[..2], [ninth, third]);
        assert_eq!(search.generation(), 1);
    }

    #[test]
    fn the_wheel_is_in_proportion() {
        let ends = wheel(&[1.0, 3.0, -5.0, f64::NAN, 4.0], Selection::Proportional);
        let mut counts = [0; 5];
        let mut random = Random::new(3);
        for _ in 0..80_000 {
            counts[spin(&ends, random.unit())] += 1;
        }
        for (count, expected) in counts.into_iter().zip([10_000, 30_000, 0, 0, 40_000]) {
            assert!((count as i64 - expected as i64).abs() < 600, "{counts:?}");
        }
        let windowed = wheel(&[-3.0, -1.0, f64::INFINITY], Selection::Windowed);
        assert_eq!(windowed, [0.0, 1.0, 1.0]);
        for hopeless in [[f64::NAN; 3], [-1.0; 3]] {
            assert_eq!(wheel(&hopeless, Selection::Proportional), [1.0, 2.0, 3.0]);
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
        search.tell(&[1.0; 50]).unwrap();
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
        search.tell(&fitness).unwrap();
        let changes = search.ask().iter().flat_map(|child| {
            child.iter().zip(&parents[0]).map(|(a, b)| (a - b).abs()).filter(|d| *d > 0.0)
        });
        let changes: Vec<_> = changes.collect();
        let (count, most) = (changes.len() as f64, changes.iter().copied().fold(0.0, f32::max));
        assert!((count / 50_000.0 - 0.1).abs() < 0.01, "{count}");
        assert!(most <= 0.1001 && most > 0.095, "{most}");
    }

    #[test]
    fn refuses_settings_and_counts() {
        let with = |change: fn(&mut GeneticSettings)| {
            let mut settings = GeneticSettings::default();
            change(&mut settings);
            Genetic::new(settings, 3, 1).unwrap_err().to_string()
        };
        assert_eq!(with(|s| s.population = 1), "evolution.population: 1 is not 2 to 100000");
        assert_eq!(with(|s| s.mutation_rate = 1.5), "evolution.mutation_rate: 1.5 is not 0 to 1");
        assert!(with(|s| s.elites = 50).contains("less than the population"));
        assert!(with(|s| s.start = f32::NAN).contains("evolution.start"));
        let mut search = Genetic::new(GeneticSettings::default(), 3, 1).unwrap();
        assert_eq!(search.tell(&[1.0]).unwrap_err(), EvolveError::Count { got: 1, expected: 50 });
        let mut broken = search.clone();
        broken.genomes[1].pop();
        assert!(broken.check().is_err());
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
            search.tell(&fitness).unwrap();
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
