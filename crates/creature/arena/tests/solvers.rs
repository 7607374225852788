//! The lockstep solver against Box2D, on whole populations, and its widths against each other.

mod common;

use ambulo_arena::{Arena, Settings, Term};
use ambulo_lanes::Width;
use common::{CREATURES, first, starter};

fn arena(name: &str, task: &str, solver: &str, steps: u32, kind: &str) -> Arena {
    let settings = format!(
        r#"{{"preset": "seed", "seed": 7, "controller": {{"kind": "{kind}"}},
            "evolution": {{"population": 48}}, "world": {{"solver": "{solver}"}},
            "task": {{"name": "{task}", "steps": {steps}}}}}"#
    );
    Arena::new(starter(name), Settings::parse(&settings).unwrap()).unwrap()
}

/// Every width, every number of neighbours: the same bits.
#[test]
fn widths_and_neighbours_change_nothing() {
    for name in ["apod", "biped2", "tetrapod2"] {
        for kind in ["network", "oscillator", "phase_network", "oscillator_network", "poses"] {
            let genomes = first(&arena(name, "run", "lockstep", 150, kind));
            let genomes = &genomes[..21];
            let of = |width: Width, threads: usize| {
                let arena = arena(name, "run", "lockstep", 150, kind).with_width(width);
                arena.evaluate(genomes, 150, threads).unwrap()
            };
            let expected = of(Width::One, 1);
            for width in Width::available() {
                assert_eq!(of(width, 1), expected, "{name} {kind} {width:?}");
                assert_eq!(of(width, 3), expected, "{name} {kind} {width:?} on threads");
            }
            let alone = arena(name, "run", "lockstep", 150, kind);
            for (genome, score) in genomes.iter().zip(&expected).step_by(5) {
                assert_eq!(alone.score(genome).unwrap().fitness, score.fitness, "{name} {kind}");
            }
        }
    }
}

/// Levels of a population: the mean of how far (either way) and of how high. Chaos makes single
/// individuals differ; what a solver gives away for nothing, evolution would find.
#[test]
fn populations_reach_what_they_reach_in_box2d() {
    for name in CREATURES {
        let run = ("run", "oscillator", Term::Distance, 300);
        for (task, kind, term, steps) in [run, ("jump", "poses", Term::Height, 200)] {
            let level = |solver: &str| {
                let arena = arena(name, task, solver, steps, kind);
                let scores = arena.evaluate(&first(&arena), steps, 2).unwrap();
                let sum: f64 = scores.iter().map(|score| score.terms[&term].abs()).sum();
                let most = scores.iter().map(|score| score.terms[&term]).fold(0.0, f64::max);
                (sum / scores.len() as f64, most)
            };
            let ((ours, our_most), (theirs, their_most)) = (level("lockstep"), level("box2d"));
            assert!((0.75..1.25).contains(&(ours / theirs)), "{name} {task}: {ours} and {theirs}");
            if task == "jump" {
                assert!(our_most <= 1.15 * their_most, "{name}: {our_most} and {their_most}");
            }
        }
    }
}
