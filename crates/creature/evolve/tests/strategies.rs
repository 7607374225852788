//! What holds for every strategy: one that is registered is tested here.

mod common;

use ambulo_evolve::{EvolveError, Outcome, Random, Search, StrategySettings};
use common::{NUMBERS, hill, meant, search, settings, started};
use serde_json::{Value, json};

/// Every name, with a search that has climbed for so many generations.
fn climbed(seed: u64, generations: usize) -> impl Iterator<Item = (&'static str, Search)> {
    StrategySettings::NAMES.into_iter().map(move |name| {
        let mut found = started(name, seed);
        let evaluations = generations * found.ask().len();
        search(&mut found, evaluations, |genome| hill(name, genome));
        assert_eq!(found.generation(), generations as u64, "{name}");
        (name, found)
    })
}

#[test]
fn finds_the_top_of_a_hill() {
    for name in StrategySettings::NAMES {
        for seed in 0..3 {
            let mut found = started(name, seed);
            let first = found.ask().len();
            let before = search(&mut found, first, |genome| hill(name, genome));
            let after = search(&mut found, 15_000, |genome| hill(name, genome));
            assert!(before < 0.9 && after > 0.97, "{name}, seed {seed}: {before} to {after}");
            if let Some(guess) = found.best_guess() {
                assert!(hill(name, guess).fitness > 0.97, "{name}, seed {seed}: {guess:?}");
            }
        }
    }
}

#[test]
fn a_seed_means_the_same_genomes_and_another_seed_others() {
    for ((name, one), (_, same)) in climbed(7, 12).zip(climbed(7, 12)) {
        assert_eq!(one, same, "{name}");
        let mut other = started(name, 8);
        assert_ne!(started(name, 7).ask(), other.ask(), "{name}");
        let evaluations = 12 * other.ask().len();
        search(&mut other, evaluations, |genome| hill(name, genome));
        assert_ne!(one.ask(), other.ask(), "{name}");
    }
}

/// Of the genomes after 12 generations of the hill, which is only + − × ÷: the same on every machine
/// and in every build.
#[test]
fn the_genomes_of_a_seed_are_the_same_everywhere() {
    const GOLDEN: [(&str, u64); 6] = [
        ("genetic", 0x5126_F7F0_5E79_713A),
        ("es", 0xF823_739E_94E9_F941),
        ("cma_es", 0x9593_4261_C160_690F),
        ("openai_es", 0x5A97_A1CF_6AA8_606C),
        ("map_elites", 0x95C1_7BAE_A147_5CF9),
        ("neat", 0x8B34_6520_9F13_A5BC),
    ];
    let hash = |(name, search): (&'static str, Search)| {
        let bits = search.ask().iter().flatten().map(|gene| u64::from(gene.to_bits()));
        let fnv = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x0000_0100_0000_01B3);
        (name, bits.fold(0xCBF2_9CE4_8422_2325, fnv))
    };
    let found: Vec<_> = climbed(7, 12).map(hash).collect();
    assert_eq!(found, GOLDEN, "{found:#x?}");
}

#[test]
fn a_stored_state_goes_on_with_the_same_bits() {
    for (name, mut one) in climbed(5, 10) {
        let stored = serde_json::to_string(&one).unwrap();
        assert!(stored.starts_with(&format!(r#"{{"strategy":"{name}""#)), "{stored:.40}");
        let mut back: Search = serde_json::from_str(&stored).unwrap();
        back.check().unwrap();
        assert_eq!(back, one, "{name}");
        assert_eq!(back.settings(), settings(name));
        for _ in 0..10 {
            let outcomes: Vec<_> = one.ask().iter().map(|genome| hill(name, genome)).collect();
            one.tell(&outcomes).unwrap();
            back.tell(&outcomes).unwrap();
        }
        assert_eq!(back, one, "{name}");
    }
}

/// Whatever number in it is another: refused, or still a state that can go on.
#[test]
fn a_stored_state_that_was_tampered_with_breaks_nothing() {
    fn numbers(value: &Value, path: String, found: &mut Vec<String>) {
        match value {
            Value::Number(_) => found.push(path),
            Value::Array(list) => {
                found.push(path.clone());
                // The ends of a list stand for what is between them.
                let ends = [0, list.len().saturating_sub(1)];
                for (index, item) in ends.into_iter().filter_map(|at| Some((at, list.get(at)?))) {
                    numbers(item, format!("{path}/{index}"), found);
                }
            }
            Value::Object(fields) => fields
                .iter()
                .for_each(|(field, value)| numbers(value, format!("{path}/{field}"), found)),
            _ => {}
        }
    }
    for name in StrategySettings::NAMES {
        let mut small = settings(name);
        small.set_population(8);
        let mut small = small.start(NUMBERS, 1).unwrap();
        search(&mut small, 8 * 20, |genome| hill(name, genome));
        let state = serde_json::to_value(&small).unwrap();
        let mut paths = vec![];
        numbers(&state, String::new(), &mut paths);
        let mut refused = 0;
        for path in &paths {
            for other in [json!(0), json!(3), json!(-1.5), json!(1e300), json!(u64::MAX), json!([])]
            {
                let mut broken = state.clone();
                *broken.pointer_mut(path).unwrap() = other;
                let Ok(mut broken) = serde_json::from_value::<Search>(broken) else {
                    refused += 1;
                    continue;
                };
                if broken.check().is_err() {
                    refused += 1;
                    continue;
                }
                for _ in 0..2 {
                    let outcome = |genome: &Vec<f32>| hill(name, genome);
                    let outcomes: Vec<_> = broken.ask().iter().map(outcome).collect();
                    broken.tell(&outcomes).unwrap();
                    let genes = || broken.ask().iter().flatten();
                    assert!(genes().all(|gene| gene.is_finite()), "{name} {path}");
                }
            }
        }
        assert!(refused > paths.len() * 3, "{name}: {refused} of {}", paths.len() * 6);
    }
}

#[test]
fn a_fitness_that_is_not_finite_breaks_nothing() {
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 0.0, -0.0, 1e-310];
    for name in StrategySettings::NAMES {
        let mut random = Random::new(3);
        for (seed, choice) in
            [&odd[..], &odd[..1], &odd[..3], &odd[3..], &odd[5..6]].iter().enumerate()
        {
            let mut found = started(name, seed as u64);
            for _ in 0..60 {
                let mut outcome = |_: &Vec<f32>| {
                    let fitness = choice[random.below(choice.len())];
                    let mut number = || [odd[random.below(8)], random.unit()][random.below(2)];
                    let behaviour =
                        if name == "map_elites" { vec![number(), number()] } else { vec![] };
                    Outcome { fitness, behaviour }
                };
                let outcomes: Vec<_> = found.ask().iter().map(&mut outcome).collect();
                found.tell(&outcomes).unwrap();
                found.check().unwrap_or_else(|error| panic!("{name}: {error}"));
            }
            let stored = serde_json::to_string(&found).unwrap();
            assert_eq!(serde_json::from_str::<Search>(&stored).unwrap(), found, "{name}");
        }
    }
}

/// Half of the country is a hole where fitness is infinite, or no number at all.
#[test]
fn a_fitness_that_is_not_finite_leads_nowhere() {
    for name in StrategySettings::NAMES {
        for hole in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut found = started(name, 2);
            let best = search(&mut found, 15_000, |genome| {
                let out = hill(name, genome);
                let fitness = if meant(name, genome)[0] < 0.1 { hole } else { out.fitness };
                Outcome { fitness, ..out }
            });
            assert!(best > 0.95, "{name}: {best} beside {hole}");
        }
    }
}

/// A fitness that says nothing, for long: nothing grows without end.
#[test]
fn a_plateau_breaks_nothing() {
    for name in StrategySettings::NAMES {
        let mut found = started(name, 4);
        search(&mut found, 400 * 64, |genome| Outcome { fitness: 1.0, ..hill(name, genome) });
        found.check().unwrap();
        let most = found.ask().iter().flatten().map(|gene| gene.abs()).fold(0.0, f32::max);
        assert!(most < 1e4, "{name}: {most}");
    }
}

/// More is better, for ever: no step grows without end.
#[test]
fn an_endless_slope_breaks_nothing() {
    for name in StrategySettings::NAMES {
        let mut found = started(name, 4);
        let best = search(&mut found, 400 * 64, |genome| Outcome {
            fitness: meant(name, genome)[0],
            ..hill(name, genome)
        });
        found.check().unwrap();
        assert!(best > 3.0, "{name}: {best}");
    }
}

#[test]
fn another_number_of_outcomes_is_refused_and_changes_nothing() {
    for (name, mut found) in climbed(1, 2) {
        let before = found.clone();
        let expected = found.ask().len();
        let outcomes: Vec<_> = found.ask().iter().map(|genome| hill(name, genome)).collect();
        for got in [0, 1, expected - 1] {
            let error = found.tell(&outcomes[..got]).unwrap_err();
            assert_eq!(error, EvolveError::Count { got, expected }, "{name}");
        }
        let more = [&outcomes[..], &outcomes[..1]].concat();
        let error = found.tell(&more).unwrap_err().to_string();
        assert_eq!(error, format!("{} outcomes for {expected} genomes", expected + 1));
        assert_eq!(found, before, "{name}");
    }
}

#[test]
fn the_population_is_what_was_asked_for() {
    for name in StrategySettings::NAMES {
        let mut wanted = settings(name);
        assert_eq!(wanted.name(), name);
        for count in [8, 24] {
            wanted.set_population(count);
            assert_eq!(wanted.population(), count);
            let mut found = wanted.start(NUMBERS, 1).unwrap();
            for _ in 0..5 {
                assert_eq!(found.ask().len(), count, "{name}");
                search(&mut found, count, |genome| hill(name, genome));
            }
        }
    }
}

/// Every setting that is a number has a most, and no setting but whole numbers is below 0.
#[test]
fn settings_out_of_range_are_refused_by_name() {
    for name in StrategySettings::NAMES {
        let defaults = serde_json::to_value(settings(name)).unwrap();
        let numbers = defaults.as_object().unwrap().iter().filter(|(_, value)| value.is_number());
        let mut count = 0;
        for (field, default) in numbers {
            let below = default.is_f64().then_some(json!(-0.1));
            for value in below.into_iter().chain([json!(1_000_000_000_u64)]) {
                let mut changed = defaults.clone();
                changed[field] = value;
                let changed: StrategySettings = serde_json::from_value(changed).unwrap();
                for error in [changed.check().unwrap_err(), changed.start(3, 1).unwrap_err()] {
                    let error = error.to_string();
                    assert!(error.starts_with(&format!("evolution.{field}: ")), "{name}: {error}");
                }
                count += 1;
            }
        }
        assert!(count >= 5, "{name}: {count}");
        let mut changed = settings(name);
        changed.set_population(usize::MAX);
        assert!(changed.check().unwrap_err().to_string().contains("evolution.population"));
    }
}

#[test]
fn genomes_have_genes() {
    for name in StrategySettings::NAMES.into_iter().filter(|name| *name != "neat") {
        let error = settings(name).start(0, 1).unwrap_err().to_string();
        assert_eq!(error, "a stored state: genomes of no genes", "{name}");
        for genes in [1, 2, 70] {
            let mut found = settings(name).start(genes, 1).unwrap();
            for _ in 0..3 {
                assert!(found.ask().iter().all(|genome| genome.len() == genes), "{name}");
                let value = |genome: &Vec<f32>| Outcome {
                    fitness: -f64::from(genome[0].abs()),
                    behaviour: vec![0.5; if name == "map_elites" { 2 } else { 0 }],
                };
                let outcomes: Vec<_> = found.ask().iter().map(value).collect();
                found.tell(&outcomes).unwrap();
                found.check().unwrap();
            }
        }
    }
}
