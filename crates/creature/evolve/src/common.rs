//! What several strategies do alike.

use crate::{EvolveError, Outcome, Random};

/// The range of a chance, in words.
pub(crate) const SHARE: &str = "0 to 1";

/// A setting's name, its value, the least and the most it may be, and these in words.
pub(crate) type Range = (&'static str, f64, f64, f64, &'static str);

/// The first setting that is out of its range, as an error.
pub(crate) fn in_range(settings: &[Range]) -> Result<(), EvolveError> {
    match settings.iter().find(|(_, value, low, high, _)| !(*low..=*high).contains(value)) {
        Some(&(field, value, _, _, expected)) => {
            Err(EvolveError::Setting { field, value, expected })
        }
        None => Ok(()),
    }
}

/// An outcome for each genome?
pub(crate) fn as_many(outcomes: &[Outcome], genomes: &[Vec<f32>]) -> Result<(), EvolveError> {
    let (got, expected) = (outcomes.len(), genomes.len());
    if got == expected { Ok(()) } else { Err(EvolveError::Count { got, expected }) }
}

/// Genomes have genes?
pub(crate) fn some_genes(genes: usize) -> Result<(), EvolveError> {
    state(genes > 0, "genomes of no genes")
}

/// Stored genomes are as many, as long and as finite as they should be?
pub(crate) fn fit(genomes: &[Vec<f32>], count: usize, genes: usize) -> Result<(), EvolveError> {
    some_genes(genes)?;
    let fits = |genome: &Vec<f32>| genome.len() == genes && genome.iter().all(|g| g.is_finite());
    let all = genomes.len() == count && genomes.iter().all(fits);
    state(all, "genomes that are not as its settings say")
}

/// Stored numbers are as many as they should be, and so finite that their squares are?
pub(crate) fn finite(numbers: &[f64], count: usize) -> Result<(), EvolveError> {
    let all = numbers.len() == count && numbers.iter().all(|number| number.abs() < 1e100);
    state(all, "numbers that are not as its settings say")
}

/// A stored number of generations can still grow?
pub(crate) fn countable(generation: u64) -> Result<(), EvolveError> {
    state(generation < 1 << 53, "more generations than can be")
}

/// An error about a stored state, unless it holds.
pub(crate) fn state(holds: bool, reason: &str) -> Result<(), EvolveError> {
    if holds { Ok(()) } else { Err(EvolveError::State(reason.into())) }
}

/// Best first; ties by index; what is not finite last.
pub(crate) fn ranking(outcomes: &[Outcome]) -> Vec<usize> {
    let value = |index: usize| {
        let fitness = outcomes[index].fitness;
        if fitness.is_finite() { fitness } else { f64::NEG_INFINITY }
    };
    let mut order: Vec<_> = (0..outcomes.len()).collect();
    order.sort_by(|&a, &b| value(b).total_cmp(&value(a)).then(a.cmp(&b)));
    order
}

/// Genes uniform within ± `start`.
pub(crate) fn scattered(genes: usize, start: f32, random: &mut Random) -> Vec<f32> {
    (0..genes).map(|_| random.around(start)).collect()
}

/// A number as a gene. Nobody needs one beyond a million, and squares of them stay finite.
pub(crate) fn gene(value: f64) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-1e6, 1e6) as f32 }
}

/// Weights of the best `count` of parents, which sum to 1: log(count + ½) − log(rank), Hansen 2016,
/// equation 49 with λ = 2 · count.
pub(crate) fn log_weights(count: usize) -> Vec<f64> {
    let raw = (1..=count).map(|rank| libm::log(count as f64 + 0.5) - libm::log(rank as f64));
    let raw: Vec<_> = raw.collect();
    let sum: f64 = raw.iter().sum();
    raw.into_iter().map(|weight| weight / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn genes_are_finite() {
        let found = [f64::NAN, f64::INFINITY, -1e300, 0.5].map(gene);
        assert_eq!(found, [0.0, 1e6, -1e6, 0.5]);
    }

    #[test]
    fn the_best_comes_first_and_what_is_not_finite_last() {
        let fitness = [f64::NAN, 1.0, f64::INFINITY, f64::MIN, 3.0, 1.0, f64::NEG_INFINITY];
        let outcomes = fitness.map(|fitness| Outcome { fitness, behaviour: vec![] });
        assert_eq!(ranking(&outcomes), [4, 1, 5, 3, 0, 2, 6]);
    }
}
