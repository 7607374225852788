//! The lockstep solver against Box2D, on whole populations, and its widths against each other.

mod common;

use ambulo_arena::{Arena, Evolution, Settings, Term, Until};
use ambulo_lanes::{Scalar, Width};
use ambulo_world::{Lockstep, Stage};
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

/// What was evolved gets nothing for nothing: over 2000 steps its energy never grows by more than its
/// motors' work since a second ago, 1 % more, and a hundredth of its weight times its length; no joint
/// gapes by 1 cm, and in 99 of 100 steps it is in the ground by less than that (the raptor's jump lands
/// 3 cm deep).
#[test]
fn what_was_evolved_is_audited() {
    for (name, task) in CREATURES.into_iter().flat_map(|name| [(name, "run"), (name, "jump")]) {
        let settings = format!(r#"{{"seed": 4, "task": {{"name": "{task}"}}}}"#);
        let arena = Arena::new(starter(name), Settings::parse(&settings).unwrap()).unwrap();
        let mut search = Evolution::new(&arena).unwrap();
        while search.generation() < 12 && !search.has(Until::Usable) {
            search.step(&arena, 2).unwrap();
        }
        let champion = &search.champion().unwrap().genome;
        let rollout = arena.record(champion, 2000).unwrap();
        let (body, physics) = (arena.body(), arena.settings().world);
        let mut world = Lockstep::new(Scalar, &[(body, &physics)]).unwrap();
        let joints = body.driven().len();
        let mut balance = vec![world.energy(0)];
        let (mut work, mut widest, mut depths) = (0.0, 0.0f32, Vec::new());
        for commands in rollout.commands.chunks(joints) {
            for (&joint, &command) in body.driven().iter().zip(commands) {
                let speed = command * body.joints()[joint].speed;
                Stage::set_motor(&mut world, 0, joint, speed.into()).unwrap();
            }
            Stage::step(&mut world).unwrap();
            work += 1.01 * world.motor_work(0);
            balance.push(world.energy(0) - work);
            widest = widest.max(world.widest_gap(0));
            depths.push(world.deepest(0));
        }
        let [x, _] = Stage::centre(&world, 0, body.torso());
        assert_eq!(x.value(), rollout.torso[2000][0], "{name} {task}: it is the same episode");
        let unit = f64::from(body.mass() * physics.gravity * body.length());
        let gained = (1..balance.len()).map(|at| {
            let before =
                balance[at.saturating_sub(60)..at].iter().copied().fold(f64::MIN, f64::max);
            (balance[at] - before) / unit
        });
        let gained = gained.fold(f64::MIN, f64::max);
        assert!(gained < 0.01, "{name} {task}: {gained} from nothing");
        assert!(widest < 0.01, "{name} {task}: a joint gapes by {widest} m");
        depths.sort_by(f32::total_cmp);
        let [most, worst] = [depths[1980], depths[1999]];
        assert!(most < 0.01 && worst < 0.05, "{name} {task}: {most}, {worst} m in the ground");
    }
}
