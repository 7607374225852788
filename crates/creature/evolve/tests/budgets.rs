//! How few evaluations the strategies need, on functions that are known.
//!
//! Beside each line stands the median of nine seeds when it was written; it has room for half as many
//! again, so that a change that makes a strategy slower is seen here. With noise, what it has to stay
//! below is half as much again, too: that was the first time. CMA-ES is as quick as pycma 4.5 with the
//! same settings (sphere, ellipsoid, Rosenbrock; 10 to 178 genes; 1500 and 5000 evaluations).

mod common;

use ambulo_evolve::{Outcome, Random, StrategySettings};

/// Distance from the lowest point, in each gene.
fn apart(genome: &[f32]) -> impl Iterator<Item = f64> {
    let lowest = [1.0, -0.7, 0.4, -1.2, 0.8, -0.3].into_iter().cycle();
    genome.iter().zip(lowest).map(|(&gene, low)| f64::from(gene) - low)
}

fn sphere(genome: &[f32]) -> f64 {
    apart(genome).map(|x| x * x).sum()
}

/// A thousand times as steep along the last gene as along the first.
fn ellipsoid(genome: &[f32]) -> f64 {
    let last = (genome.len() - 1) as f64;
    apart(genome).enumerate().map(|(i, x)| libm::pow(1000.0, i as f64 / last) * x * x).sum()
}

fn rosenbrock(genome: &[f32]) -> f64 {
    let pairs = genome.windows(2).map(|pair| (f64::from(pair[0]), f64::from(pair[1])));
    pairs.map(|(x, y)| 100.0 * (y - x * x) * (y - x * x) + (1.0 - x) * (1.0 - x)).sum()
}

/// A bowl with dents, about one apart.
fn dents(genome: &[f32]) -> f64 {
    apart(genome).map(|x| x * x + 0.5 - 0.5 * libm::cos(6.0 * x)).sum()
}

/// The lowest cost among so many genomes and the mean of what they were drawn from; with noise, the
/// cost of that mean.
fn lowest(
    json: &str,
    cost: fn(&[f32]) -> f64,
    noise: f64,
    evaluations: usize,
    genes: usize,
) -> f64 {
    let settings: StrategySettings = serde_json::from_str(json).unwrap();
    let once = |seed| {
        let (mut search, mut random) = (settings.start(genes, seed).unwrap(), Random::new(seed));
        let best = common::search(&mut search, evaluations, |genome| {
            let fitness = -cost(genome) + noise * random.normal();
            Outcome { fitness, behaviour: vec![] }
        });
        let guess = search.best_guess().map_or(f64::INFINITY, cost);
        if noise > 0.0 { guess } else { guess.min(-best) }
    };
    let mut found: Vec<_> = (1..=5).map(once).collect();
    found.sort_by(f64::total_cmp);
    found[2]
}

#[test]
fn needs_no_more_evaluations_than_it_did() {
    type Line = (&'static str, fn(&[f32]) -> f64, f64, usize, f64, usize);
    const ES: &str = r#"{"strategy": "es"}"#;
    const ES_PER_GENE: &str = r#"{"strategy": "es", "per_gene": true}"#;
    const CMA: &str = r#"{"strategy": "cma_es"}"#;
    const CMA_64: &str = r#"{"strategy": "cma_es", "population": 64}"#;
    const CMA_DIAGONAL: &str = r#"{"strategy": "cma_es", "covariance": "diagonal"}"#;
    const CMA_PASSIVE: &str = r#"{"strategy": "cma_es", "active": false}"#;
    const OPENAI: &str = r#"{"strategy": "openai_es"}"#;
    // Settings, function, noise, genes, below what, within how many evaluations.
    let lines: [Line; 22] = [
        (ES, sphere, 0.0, 10, 0.01, 960),              // 640
        (ES, sphere, 0.0, 30, 0.1, 1800),              // 1158
        (ES, sphere, 0.0, 178, 5.0, 3600),             // 2386
        (ES, dents, 0.0, 10, 0.1, 1100),               // 720
        (ES, sphere, 0.9, 30, 1.5, 1800),              // 1216
        (ES_PER_GENE, sphere, 0.0, 30, 0.1, 2000),     // 1344
        (ES_PER_GENE, ellipsoid, 0.0, 30, 1.0, 6900),  // 4563
        (ES_PER_GENE, dents, 0.0, 30, 1.5, 2700),      // 1792
        (ES_PER_GENE, sphere, 0.9, 30, 1.5, 1250),     // 832
        (CMA, sphere, 0.0, 10, 0.01, 770),             // 511
        (CMA, sphere, 0.0, 30, 0.1, 1350),             // 896
        (CMA, sphere, 0.0, 178, 5.0, 3300),            // 2185
        (CMA, ellipsoid, 0.0, 30, 1.0, 6000),          // 4016
        (CMA, rosenbrock, 0.0, 10, 1.0, 5100),         // 3421
        (CMA, sphere, 0.9, 30, 1.5, 1000),             // 656
        (CMA_64, dents, 0.0, 30, 1.5, 3500),           // 2304
        (CMA_64, rosenbrock, 0.0, 10, 1.0, 9900),      // 6618
        (CMA_DIAGONAL, ellipsoid, 0.0, 30, 1.0, 2600), // 1721
        (CMA_PASSIVE, ellipsoid, 0.0, 30, 1.0, 7500),  // 5000
        (OPENAI, sphere, 0.0, 30, 0.1, 4200),          // 2816
        (OPENAI, sphere, 0.0, 178, 5.0, 3200),         // 2112
        (OPENAI, sphere, 0.9, 30, 1.5, 1450),          // 960
    ];
    for (json, cost, noise, genes, below, evaluations) in lines {
        let found = lowest(json, cost, noise, evaluations, genes);
        assert!(
            found < below,
            "{json}, {genes} genes, {evaluations}: {found} is not below {below}"
        );
    }
}

/// What a whole matrix is for: the same valley, turned, so that no gene alone can follow it.
#[test]
fn a_whole_covariance_does_not_mind_how_a_valley_lies() {
    fn cost(genome: &[f32], turned: bool) -> f64 {
        let mut x: Vec<_> = apart(genome).collect();
        if turned {
            // A reflection: all genes go into all.
            let sum: f64 = x.iter().sum::<f64>() * 2.0 / x.len() as f64;
            x.iter_mut().for_each(|x| *x -= sum);
        }
        let steep = |i| if i % 2 == 0 { 1.0 } else { 1e4 };
        x.iter().enumerate().map(|(i, x)| steep(i) * x * x).sum()
    }
    let of = |covariance: &str, cost: fn(&[f32]) -> f64| {
        let json = format!(r#"{{"strategy": "cma_es", "covariance": "{covariance}"}}"#);
        lowest(&json, cost, 0.0, 4000, 10)
    };
    let (straight, turned) =
        (|genome: &[f32]| cost(genome, false), |genome: &[f32]| cost(genome, true));
    assert!(of("full", straight) < 1e-6 && of("full", turned) < 1e-6);
    assert!(of("diagonal", straight) < 1e-6 && of("diagonal", turned) > 1e-2);
}
