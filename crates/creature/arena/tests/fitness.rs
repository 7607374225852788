//! A fitness depends on the genome alone, and a replay repeats it.

mod common;

use ambulo_arena::{Arena, Evolution, Settings, TASKS, Term};
use common::{CREATURES, arena, first, short, starter};

/// The gate of the whole street: what is recorded alone is what was evolved in company.
#[test]
fn a_replay_equals_its_fitness_to_the_last_bit() {
    for name in CREATURES {
        for task in TASKS {
            let arena = short(name, task.name(), 150, 6);
            let genomes = first(&arena);
            let together = arena.evaluate(&genomes, 150, 2).unwrap();
            for (genome, score) in genomes.iter().zip(&together) {
                let alone = arena.score(genome).unwrap();
                assert_eq!(
                    alone.fitness.to_bits(),
                    score.fitness.to_bits(),
                    "{name} {task:?}",
                    task = task.name()
                );
                let rollout = arena.record(genome, 150).unwrap();
                let x = |step: usize| f64::from(rollout.torso[step][0]);
                let distance = alone.terms[&Term::Distance];
                assert_eq!(distance, x(150) - x(0), "{name} {}", task.name());
            }
        }
    }
}

#[test]
fn threads_and_neighbours_change_nothing() {
    let arena = short("tetrapod2", "run", 200, 13);
    let genomes = first(&arena);
    let expected = arena.evaluate(&genomes, arena.steps(), 1).unwrap();
    for threads in [2, 3, 8, 100] {
        assert_eq!(
            arena.evaluate(&genomes, arena.steps(), threads).unwrap(),
            expected,
            "{threads} threads"
        );
    }
    let mut backward = genomes.clone();
    backward.reverse();
    let mut scores = arena.evaluate(&backward, arena.steps(), 2).unwrap();
    scores.reverse();
    assert_eq!(scores, expected);
    assert_eq!(arena.evaluate(&genomes[4..5], arena.steps(), 2).unwrap(), expected[4..5]);
    assert_eq!(arena.evaluate(&[], arena.steps(), 2).unwrap(), []);
}

#[test]
fn on_rough_ground_too() {
    let settings = r#"{"evolution": {"population": 5}, "task": {"name": "run", "steps": 200},
        "world": {"ground": {"kind": "rough", "height": 0.2, "spacing": 0.5, "seed": 4}}}"#;
    let arena = arena("tetrapod1", settings);
    let genomes = first(&arena);
    let expected = arena.evaluate(&genomes, arena.steps(), 1).unwrap();
    assert_eq!(arena.evaluate(&genomes, arena.steps(), 3).unwrap(), expected);
    // Nobody gets to where it is uneven: on the level the code for any ground does what the code for
    // flat ground does.
    let flat = short("tetrapod1", "run", 200, 5);
    assert_eq!(flat.evaluate(&genomes, 200, 1).unwrap(), expected);
}

/// A search on this creature, bit for bit, whatever computes it.
#[test]
fn a_golden_search() {
    let arena = short("biped1", "run", 120, 10);
    let mut search = Evolution::new(&arena).unwrap();
    for _ in 0..7 {
        search.step(&arena, 2).unwrap();
    }
    let champion = search.champion().unwrap();
    let best = champion.fitness;
    let hash = arena.record(&champion.genome, 120).unwrap().hash;
    assert_eq!(
        (best.to_bits(), hash),
        (GOLDEN.0, GOLDEN.1),
        "{best} {:#x} {hash:#x}",
        best.to_bits()
    );
}

/// Fitness and path of its champion, as bits.
const GOLDEN: (u64, u64) = (0x400f_e2ab_2000_0000, 0x1740_ac7b_1fc5_78c8);

#[test]
fn what_is_not_a_number_has_no_fitness_and_harms_nobody() {
    let arena = short("biped2", "run", 100, 4);
    let mut genomes = first(&arena);
    let expected = arena.evaluate(&genomes, arena.steps(), 1).unwrap();
    // Sums of these overflow: the network gives NaN.
    genomes[1].iter_mut().enumerate().for_each(|(i, g)| *g = if i % 2 == 0 { 3e38 } else { -3e38 });
    let scores = arena.evaluate(&genomes, arena.steps(), 1).unwrap();
    assert!(scores[1].fitness.is_nan());
    for other in [0, 2, 3] {
        assert_eq!(scores[other], expected[other]);
    }
    let judged = arena.judge(&arena.record(&genomes[1], 100).unwrap());
    assert!(!judged.usable && judged.reasons[0].contains("not a number"), "{:?}", judged.reasons);
    genomes[1][0] = f32::NAN;
    let refused = arena.evaluate(&genomes, arena.steps(), 1).unwrap_err().to_string();
    assert_eq!(refused, "the genome: number 0 is NaN, not finite");
    genomes[1].pop();
    assert!(arena.evaluate(&genomes, arena.steps(), 1).is_err());
}

#[test]
fn fitness_is_the_weighted_sum_of_its_terms() {
    let weights: Vec<_> =
        Term::ALL.iter().zip(1..).map(|(t, w)| format!("\"{}\": {w}.5", t.name())).collect();
    let settings = format!(
        r#"{{"evolution": {{"population": 4}}, "task": {{"name": "run", "steps": 240, "weights": {{{}}}}}}}"#,
        weights.join(", ")
    );
    let arena = arena("tetrapod2", &settings);
    let genomes = first(&arena);
    for (genome, score) in genomes.iter().zip(arena.evaluate(&genomes, 240, 2).unwrap()) {
        let sum: f64 =
            Term::ALL.iter().zip(1..).map(|(t, w)| (f64::from(w) + 0.5) * score.terms[t]).sum();
        assert!((sum - score.fitness).abs() < 1e-9 * (1.0 + sum.abs()), "{sum} {score:?}");
        assert_eq!(arena.score(genome).unwrap(), score, "all terms count: all were measured");
        for (term, value) in &score.terms {
            assert!(
                value.is_finite()
                    && (matches!(term, Term::Distance | Term::Natural) || *value >= 0.0),
                "{term:?} {value}"
            );
        }
        for share in [Term::Saturation, Term::LegUse, Term::Symmetry] {
            assert!(score.terms[&share] <= 1.0);
        }
        assert!(score.terms[&Term::Energy] > 0.0);
    }
}

#[test]
fn terms_measure_what_they_say() {
    let arena = short("tetrapod2", "run", 300, 3);
    // All weights 0: the motors hold, nothing happens.
    let still = arena.score(&vec![0.0; arena.genes()]).unwrap().terms;
    for (term, most) in [
        (Term::Distance, 0.01),
        (Term::Height, 0.01),
        (Term::Rollover, 0.01),
        (Term::DirectionChange, 1e-9),
        (Term::Saturation, 1e-9),
        (Term::LegUse, 1e-3),
        (Term::Energy, 0.02),
    ] {
        assert!(still[&term].abs() <= most, "{term:?} {}", still[&term]);
    }
    // Only the outputs' biases, and large: every motor at full speed, against its limit.
    let mut genome = vec![0.0; arena.genes()];
    let last = arena.genes() - 1;
    (0..8).for_each(|output| genome[last - 11 * output] = 9.0);
    let full = arena.score(&genome).unwrap().terms;
    assert!(full[&Term::Saturation] > 0.999 && full[&Term::Energy] > still[&Term::Energy] + 0.05);
}

#[test]
fn an_episode_may_end_at_a_fall() {
    let until = |fall: bool| {
        let settings =
            format!(r#"{{"task": {{"name": "run", "steps": 600, "end_on_fall": {fall}}}}}"#);
        arena("biped2", &settings)
    };
    let (whole, cut) = (until(false), until(true));
    let genomes = first(&whole);
    let (whole_scores, cut_scores) =
        (whole.evaluate(&genomes, 600, 2).unwrap(), cut.evaluate(&genomes, 600, 2).unwrap());
    let mut fell = 0;
    for ((genome, w), c) in genomes.iter().zip(&whole_scores).zip(&cut_scores) {
        let rollout = whole.record(genome, 600).unwrap();
        let parts = whole.body().parts().len();
        let down = (1..=600).find(|&step| {
            rollout.tilt[step].abs() > 1.0 || rollout.touching[step * parts + whole.body().torso()]
        });
        let end = down.unwrap_or(600);
        let distance = f64::from(rollout.torso[end][0]) - f64::from(rollout.torso[0][0]);
        assert_eq!(c.fitness, distance);
        fell += usize::from(down.is_some());
        assert!(down.is_some() || w == c);
    }
    assert!(fell > 10 && fell < 50, "{fell} of 50 fell: a test of both");
}

#[test]
fn every_sensor_can_be_used() {
    let sensors = r#"["torso_rotation", "joint_angles", "joint_speeds", "foot_contacts", "height",
        "velocity", {"ground_rays": {"count": 3, "reach": 2.0}}]"#;
    let settings = format!(
        r#"{{"controller": {{"sensors": {sensors}}}, "task": {{"name": "run", "steps": 200}},
            "world": {{"ground": {{"kind": "steps", "height": 0.1, "length": 0.7}}}},
            "evolution": {{"population": 3}}}}"#
    );
    let arena = arena("tetrapod2", &settings);
    // 1 + 8 + 8 + 4 + 1 + 2 + 3 inputs.
    assert_eq!(arena.genes(), 28 * 10 + 11 * 8);
    for score in arena.evaluate(&first(&arena), 200, 2).unwrap() {
        assert!(score.fitness.is_finite());
    }
}

#[test]
fn every_version_of_the_seed_can_be_tried() {
    for (version, genes) in
        [("1.0", 14 * 8 + 9 * 8), ("1.1", 184), ("1.2", 184), ("2.0", 10 * 10 + 11 * 8)]
    {
        let settings = format!(
            r#"{{"controller": {{"version": "{version}"}}, "task": {{"name": "run", "steps": 100}},
                "evolution": {{"population": 3}}}}"#
        );
        let arena = arena("tetrapod2", &settings);
        assert_eq!(arena.genes(), genes, "{version}");
        assert!(
            arena.evaluate(&first(&arena), 100, 1).unwrap().iter().all(|s| s.fitness.is_finite())
        );
    }
}

#[test]
fn settings_are_refused_by_their_path() {
    let refused = |json: &str| {
        let settings = match Settings::parse(json) {
            Ok(settings) => settings,
            Err(error) => return error.to_string(),
        };
        match Arena::new(starter("biped1"), settings) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("accepted: {json}"),
        }
    };
    for (json, expected) in [
        (
            r#"{"task": {"name": "fly"}}"#,
            "task.name: no task is called 'fly'; there are run, jump, climb, hurdles, holes, rough, \
             keep_upright, swim",
        ),
        (r#"{"task": {"name": "run", "steps": 0}}"#, "task.steps: 0 is not 1 to 1000000"),
        (r#"{"task": {"name": "run"}, "generations": 0}"#, "generations: 0 is not 1 to 10000000"),
        (r#"{"task": {"name": "run"}, "world": {"rate": 1}}"#, "world.rate: 1 is not 10 to 1000"),
        (
            r#"{"preset": "seed", "task": {"name": "run"}, "evolution": {"mutation_rate": 2}}"#,
            "evolution.mutation_rate: 2 is not 0 to 1",
        ),
        (
            r#"{"task": {"name": "run", "grow": [300, 200]}}"#,
            "task.grow: [300, 200] are not up to 100 growing numbers of steps, 1 to 2000",
        ),
    ] {
        assert_eq!(refused(json), expected);
    }
    assert!(refused(r#"{"evolution": {"popluation": 3}}"#).contains("unknown field `popluation`"));
    assert!(refused(r#"{"task": {"weights": {"beauty": 1}}}"#).contains("task.weights"));
    assert!(refused(r#"{"seed": "x"}"#).starts_with("seed: invalid type"));
    assert!(
        refused(r#"{"task": {"name": "run"}, "controller": {"hidden": [0]}}"#)
            .starts_with("controller.hidden")
    );
    assert!(
        refused(r#"{"task": {"name": "run"}, "world": {"ground": {"kind": "rough"}}}"#)
            .contains("world.ground")
    );
}
