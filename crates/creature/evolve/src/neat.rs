//! NEAT: networks that grow, from none but inputs and outputs to what the problem needs.
//!
//! Stanley and Miikkulainen, "Evolving neural networks through augmenting topologies", 2002: historical
//! markings and crossover by them (section 3.2), species by a distance (equation 1) with fitness shared
//! among them (equation 2), structure only as it is invented (section 3.4). Networks are feed-forward.
//! A genome is asked for as [`Graph`](ambulo_net::Graph) describes it.
//!
//! Not as in the paper, and why: the threshold of the distance may move, because one that suits a few
//! links makes one species of many; a child has one kind of mutation, so that what is new is tried as
//! it is; equals do not mix their structure, which could make circles; and weights change in two ways,
//! because all of them changed by much is a new network where there are a hundred. The defaults suit
//! such; XOR, small and deceptive, wants `fine` 0 and `weight_step` 2.5.

mod genome;
mod inventions;
mod settings;

use serde::{Deserialize, Serialize};

use crate::common::{as_many, countable, ranking, state};
use crate::{EvolveError, Outcome, Random, Strategy};
use genome::Genome;
use inventions::Inventions;
pub use settings::NeatSettings;

/// Genomes that are alike, as they were in the last generation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Species {
    /// Whoever is near to this one belongs to it.
    example: Genome,
    /// The best fitness that it ever had, and when it came.
    best: f64,
    improved: u64,
}

/// The strategy and its whole state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Neat {
    settings: NeatSettings,
    /// Generations that were told.
    generation: u64,
    random: Random,
    made: Inventions,
    threshold: f64,
    species: Vec<Species>,
    population: Vec<Genome>,
    /// The same as numbers.
    genomes: Vec<Vec<f32>>,
}

impl Neat {
    /// The first generation. How many numbers a genome has is for NEAT to say: `_genes` is ignored.
    ///
    /// # Errors
    /// Settings out of range; inputs and outputs that are not filled in.
    pub fn new(settings: NeatSettings, _genes: usize, seed: u64) -> Result<Self, EvolveError> {
        settings.check_filled()?;
        let mut random = Random::new(seed);
        let minimal = |_| Genome::minimal(&settings, &mut random);
        let population: Vec<_> = (0..settings.population).map(minimal).collect();
        let mut search = Self {
            made: Inventions::new(&settings),
            threshold: settings.threshold,
            species: vec![],
            genomes: vec![],
            generation: 0,
            population,
            random,
            settings,
        };
        search.encode();
        Ok(search)
    }

    /// Its settings.
    pub fn settings(&self) -> &NeatSettings {
        &self.settings
    }

    /// How many species the last generation that was told had.
    pub fn species(&self) -> usize {
        self.species.len()
    }

    fn encode(&mut self) {
        let encoded = |genome: &Genome| genome.encoded(&self.settings);
        self.genomes = self.population.iter().map(encoded).collect();
    }

    /// Who is of which species, best first; makes new species and forgets those without members.
    fn speciate(&mut self, order: &[usize]) -> Vec<Vec<usize>> {
        let mut members = vec![vec![]; self.species.len()];
        for &index in order {
            let genome = &self.population[index];
            let near = |species: &Species| {
                genome.distance(&species.example, &self.settings) < self.threshold
            };
            match self.species.iter().position(near) {
                Some(at) => members[at].push(index),
                None => {
                    let (example, best) = (genome.clone(), f64::MIN);
                    self.species.push(Species { example, best, improved: self.generation });
                    members.push(vec![index]);
                }
            }
        }
        let mut filled = members.iter().map(|members| !members.is_empty());
        self.species.retain(|_| filled.next().unwrap_or(false));
        members.retain(|members| !members.is_empty());
        members
    }

    /// How many children each species has, equation 2: in proportion to the mean fitness of its
    /// members, counted from the worst of all.
    fn shares(&mut self, members: &[Vec<usize>], outcomes: &[Outcome]) -> Vec<usize> {
        let fitness = |&index: &usize| Some(outcomes[index].fitness).filter(|f| f.is_finite());
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in (0..outcomes.len()).filter_map(|index| fitness(&index)) {
            (low, high) = (low.min(value), high.max(value));
        }
        let range = Some(high / 2.0 - low / 2.0).filter(|&range| range > 0.0);
        // Halves, so that no difference overflows.
        let share = |index: &usize| match (fitness(index), range) {
            (Some(value), Some(range)) => (value / 2.0 - low / 2.0) / range,
            (Some(_), None) => 1.0,
            (None, _) => 0.0,
        };
        let mut means = vec![];
        for (species, members) in self.species.iter_mut().zip(members) {
            // Its best comes first.
            let best = fitness(&members[0]).unwrap_or(f64::MIN);
            if best > species.best {
                (species.best, species.improved) = (best, self.generation);
            }
            let stale = self.generation - species.improved >= self.settings.stagnation;
            let keep = !stale || best >= high;
            let mean = members.iter().map(share).sum::<f64>() / members.len() as f64;
            means.push(if keep { mean } else { 0.0 });
        }
        apportioned(&means, self.settings.population)
    }

    /// Children of a species: its champion unchanged where it has more than five members, then
    /// crossed and mutated ones.
    fn breed(&mut self, members: &[usize], all: &[usize], count: usize, next: &mut Vec<Genome>) {
        let settings = &self.settings;
        let end = next.len() + count;
        if members.len() > 5 && count > 0 {
            next.push(self.population[members[0]].clone());
        }
        let parents = (members.len() as f64 * settings.survival).ceil().max(1.0) as usize;
        while next.len() < end {
            // Best first: of two places, the lower is the fitter's.
            let random = &mut self.random;
            let first = random.below(parents);
            let mut child = if random.unit() >= settings.crossover {
                self.population[members[first]].clone()
            } else if random.unit() < settings.stray {
                let (own, other) = (members[first], all[random.below(all.len())]);
                let place = |index| all.iter().position(|&at| at == index);
                let (fitter, other) =
                    if place(own) <= place(other) { (own, other) } else { (other, own) };
                Genome::crossed(&self.population[fitter], &self.population[other], random)
            } else {
                let second = random.below(parents);
                let (fitter, other) = (members[first.min(second)], members[first.max(second)]);
                Genome::crossed(&self.population[fitter], &self.population[other], random)
            };
            child.mutate(settings, &mut self.made, random);
            next.push(child);
        }
    }
}

impl Strategy for Neat {
    fn generation(&self) -> u64 {
        self.generation
    }

    fn ask(&self) -> &[Vec<f32>] {
        &self.genomes
    }

    /// A fitness that is not finite counts as no better than the worst.
    fn tell(&mut self, outcomes: &[Outcome]) -> Result<(), EvolveError> {
        as_many(outcomes, &self.genomes)?;
        let order = ranking(outcomes);
        let members = self.speciate(&order);
        let shares = self.shares(&members, outcomes);
        let mut next = Vec::with_capacity(self.population.len());
        for (members, count) in members.iter().zip(shares) {
            self.breed(members, &order, count, &mut next);
        }
        for (species, members) in self.species.iter_mut().zip(&members) {
            species.example = self.population[members[self.random.below(members.len())]].clone();
        }
        if self.settings.species > 0 {
            let factor = match self.species.len().cmp(&self.settings.species) {
                std::cmp::Ordering::Less => 1.0 / 1.1,
                std::cmp::Ordering::Equal => 1.0,
                std::cmp::Ordering::Greater => 1.1,
            };
            self.threshold = (self.threshold * factor).clamp(0.01, 100.0);
        }
        self.made.end_generation();
        self.population = next;
        self.encode();
        self.generation += 1;
        Ok(())
    }

    fn check(&self) -> Result<(), EvolveError> {
        self.settings.check_filled()?;
        countable(self.generation)?;
        self.made.check(&self.settings)?;
        state(self.population.len() == self.settings.population, "genomes that are not as many")?;
        for genome in self.population.iter().chain(self.species.iter().map(|s| &s.example)) {
            genome.check(&self.settings, &self.made)?;
        }
        let same =
            |(genome, numbers): (&Genome, &Vec<f32>)| genome.encoded(&self.settings) == *numbers;
        let mut pairs = self.population.iter().zip(&self.genomes);
        state(
            self.genomes.len() == self.population.len() && pairs.all(same),
            "genomes that are not what their links say",
        )?;
        let sound =
            |species: &Species| species.best.is_finite() && species.improved <= self.generation;
        state(self.species.iter().all(sound), "a species that cannot be")?;
        state((0.0..=100.0).contains(&self.threshold), "a threshold out of its range")
    }
}

/// `count` divided in proportion, the largest remainders rounded up; equally if all are nothing.
fn apportioned(parts: &[f64], count: usize) -> Vec<usize> {
    let sum: f64 = parts.iter().sum();
    let exact = |part: &f64| match sum > 0.0 {
        true => part / sum * count as f64,
        false => count as f64 / parts.len() as f64,
    };
    let exact: Vec<_> = parts.iter().map(exact).collect();
    let mut whole: Vec<_> = exact.iter().map(|exact| exact.floor() as usize).collect();
    let mut order: Vec<_> = (0..parts.len()).collect();
    order.sort_by(|&a, &b| exact[b].fract().total_cmp(&exact[a].fract()).then(a.cmp(&b)));
    let missing = count.saturating_sub(whole.iter().sum());
    order.iter().cycle().take(missing).for_each(|&at| whole[at] += 1);
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_are_apportioned_to_the_last() {
        assert_eq!(apportioned(&[1.0, 1.0, 2.0], 100), [25, 25, 50]);
        assert_eq!(apportioned(&[1.0, 1.0, 1.0], 10), [4, 3, 3]);
        assert_eq!(apportioned(&[0.0, 0.0], 5), [3, 2]);
        assert_eq!(apportioned(&[0.0, 1e-300, 0.0], 7), [0, 7, 0]);
    }

    /// A species that makes no progress has no children, unless nobody is better.
    #[test]
    fn what_stagnates_dies() {
        let settings = NeatSettings { inputs: 1, outputs: 1, stagnation: 3, ..Default::default() };
        let mut search = Neat::new(settings, 0, 1).unwrap();
        let example = search.population[0].clone();
        let species = |best, improved| Species { example: example.clone(), best, improved };
        search.generation = 10;
        search.species = vec![species(5.0, 7), species(5.0, 8), species(9.0, 1)];
        let mut outcomes = vec![Outcome { fitness: 1.0, behaviour: vec![] }; 100];
        (outcomes[0].fitness, outcomes[1].fitness, outcomes[2].fitness) = (4.0, 4.0, 9.0);
        let members = [vec![0], vec![1], vec![2]];
        let shares = search.shares(&members, &outcomes);
        assert!(shares[0] == 0 && shares[1] > 20 && shares[2] > 50, "{shares:?}");
        assert_eq!(shares.iter().sum::<usize>(), 100);
        // Progress, just in time.
        outcomes[0].fitness = 6.0;
        assert!(search.shares(&members, &outcomes)[0] > 20);
        assert_eq!((search.species[0].best, search.species[0].improved), (6.0, 10));
    }
}
