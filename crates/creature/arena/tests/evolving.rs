//! What a search may do beside finding a controller: change the body, learn in lessons, be tried under
//! physics that change.

mod common;

use std::time::Duration;

use ambulo_arena::{Arena, Evolution, Learner, Round, Settings, Until};
use ambulo_lanes::Width;
use common::starter;

fn arena(name: &str, settings: &str) -> Arena {
    Arena::new(starter(name), Settings::parse(settings).unwrap()).unwrap()
}

fn refused(name: &str, settings: &str) -> String {
    let made = Settings::parse(settings).and_then(|parsed| Arena::new(starter(name), parsed));
    made.err().expect("it is refused").to_string()
}

fn round(arena: &Arena, steps: u32) -> Round {
    Round { ahead: arena.lessons(), steps, draw: None }
}

const BODIES: &str = r#"{"task": {"name": "run", "grow": [60], "steps": 240}, "seed": 3,
    "body": {"size": [0.7, 1.4]}, "evolution": {"population": 19},
    "search": {"trials": 4}}"#;

/// Individuals of different measures share lanes, and none of them notices.
#[test]
fn bodies_of_one_population_do_not_disturb_each_other() {
    for solver in ["lockstep", "box2d"] {
        let with = BODIES.replacen('{', &format!(r#"{{"world": {{"solver": "{solver}"}}, "#), 1);
        let whole = arena("tetrapod2", &with);
        let genomes = Evolution::new(&whole).unwrap().ask().to_vec();
        let expected = whole.evaluate(&genomes, 120, 2).unwrap();
        let hashes: Vec<_> = genomes.iter().map(|g| whole.body_of(g).unwrap().hash()).collect();
        assert!(hashes[0] != hashes[1] && hashes[0] != whole.body().hash());
        for (genome, expected) in genomes.iter().zip(&expected) {
            let alone = whole.evaluate(std::slice::from_ref(genome), 120, 1).unwrap();
            assert_eq!(alone[0], *expected, "{solver}");
        }
        for width in Width::available() {
            let narrow = arena("tetrapod2", &with).with_width(width);
            assert_eq!(narrow.evaluate(&genomes, 120, 1).unwrap(), expected, "{width:?}");
        }
    }
}

/// The champion with its body is a creature with a controller like any other.
#[test]
fn a_champion_and_its_body_do_the_same_without_the_search() {
    let evolving = arena("tetrapod2", BODIES);
    let mut search = Evolution::new(&evolving).unwrap();
    for _ in 0..4 {
        search.step(&evolving, 2).unwrap();
    }
    let champion = search.champion().unwrap();
    let body = evolving.body_of(&champion.genome).unwrap();
    let pilot = evolving.pilot(&champion.genome).unwrap();
    assert_eq!(pilot.genome().len() + 14, evolving.genes());
    let settings = Settings { body: None, ..evolving.settings().clone() };
    let alone = Arena::new((*body).clone(), settings).unwrap();
    assert_eq!(alone.score(pilot.genome()).unwrap().fitness, champion.fitness);
    let (there, here) = (
        evolving.record(&champion.genome, 300).unwrap(),
        alone.record(pilot.genome(), 300).unwrap(),
    );
    assert_eq!(there, here);
    assert_eq!(evolving.judge(&there), alone.judge(&here));
    assert_eq!(
        evolving.robustness(std::slice::from_ref(&champion.genome), 1).unwrap(),
        alone.robustness(&[pilot.genome().to_vec()], 1).unwrap()
    );
}

#[test]
fn bodies_that_cannot_evolve_are_refused() {
    let told = refused("frog", r#"{"task": {"name": "run"}, "body": {"size": [0.0, 1.0]}}"#);
    assert!(told.starts_with("body.size: [0, 1]"), "{told}");
    let told = refused(
        "frog",
        r#"{"task": {"name": "run"}, "body": {}, "controller": {"kind": "graph"}}"#,
    );
    assert!(told.starts_with("body: it evolves with genomes of one length"), "{told}");
    let evolving = arena("tetrapod2", BODIES);
    let mut genome = vec![0.0; evolving.genes()];
    *genome.last_mut().unwrap() = f32::NAN;
    let told = evolving.evaluate(&[genome], 10, 1).unwrap_err().to_string();
    assert!(told.contains("14 that are finite"), "{told}");
    assert!(evolving.evaluate(&[vec![0.0; 3]], 10, 1).is_err());
}

const LESSONS: &str = r#"{"task": {"name": "hurdles"}, "seed": 2,
    "curriculum": [{"task": "run", "until": "usable"},
                   {"ground": {"hurdles": {}}, "steps": 300, "until": "usable"}],
    "evolution": {"population": 32}}"#;

fn lessons() -> String {
    LESSONS.replace(
        r#"{"hurdles": {}}"#,
        r#"{"kind": "hurdles", "height": 0.02, "width": 0.15, "between": 2.0}"#,
    )
}

#[test]
fn lessons_are_learned_one_after_the_other() {
    let arena = arena("tetrapod2", &lessons());
    assert_eq!(arena.lessons(), 2);
    let settings = |ahead: usize| arena.ahead(ahead).settings().clone();
    assert_eq!(settings(2).task.name, "run");
    assert_eq!(settings(1).task.name, "hurdles");
    assert_eq!(settings(1).task.steps, Some(300));
    assert!(settings(1).world.ground != settings(0).world.ground);
    assert_eq!(settings(2).controller, settings(0).controller, "the same genomes");
    let mut search = Evolution::new(&arena).unwrap();
    let mut learned = Vec::new();
    while search.ahead() > 0 && search.generation() < 200 {
        let before = search.ahead();
        assert_eq!(search.round(&arena).ahead, before);
        let told = search.step(&arena, 2).unwrap();
        assert_eq!(told.ahead, before);
        assert!(!told.crowned && search.champion().is_none(), "no champion before the task itself");
        assert!(!search.has(Until::Usable));
        if told.learned {
            learned.push(search.generation());
            assert_eq!(search.ahead(), before - 1);
        }
    }
    assert_eq!((learned.len(), search.ahead()), (2, 0), "{learned:?}");
    search.step(&arena, 2).unwrap();
    assert!(search.champion().is_some());
    let stored = serde_json::to_string(&search).unwrap();
    let back: Evolution = serde_json::from_str(&stored).unwrap();
    back.check(&arena).unwrap();
    assert_eq!(back, search);
    // Of a search without lessons it is none.
    let mut other = back;
    other.check(&self::arena("tetrapod2", r#"{"task": {"name": "hurdles"}}"#)).unwrap();
    other = Evolution::new(&arena).unwrap();
    assert!(other.check(&self::arena("tetrapod2", r#"{"task": {"name": "hurdles"}}"#)).is_err());
}

/// What is stuck begins anew, with the first lesson.
#[test]
fn a_restart_goes_back_to_the_first_lesson_and_keeps_the_champion() {
    let settings = lessons().replace(r#""steps": 300"#, r#""steps": 60"#).replacen(
        '{',
        r#"{"search": {"patience": 3, "trials": 4}, "#,
        1,
    );
    let arena = arena("tetrapod2", &settings);
    let mut search = Evolution::new(&arena).unwrap();
    let mut seen = 0;
    while seen == 0 && search.generation() < 200 {
        let champion = search.champion().cloned();
        let told = search.step(&arena, 2).unwrap();
        if told.restarted {
            assert_eq!(search.ahead(), 2);
            assert!(told.ahead == 0 || search.champion() == champion.as_ref());
            seen += usize::from(told.ahead == 0);
        }
    }
    assert_eq!(seen, 1, "a restart in the task itself");
    assert!(search.champion().is_some());
}

#[test]
fn lessons_that_cannot_be_are_refused_by_their_place() {
    let told = refused(
        "frog",
        r#"{"task": {"name": "run"}, "curriculum": [{"until": "usable"},
            {"task": "fly", "until": "usable"}]}"#,
    );
    assert!(told.starts_with("curriculum[1]: task.name: no task is called 'fly'"), "{told}");
    let told = refused("frog", r#"{"task": {"name": "run"}, "curriculum": [{"task": "run"}]}"#);
    assert!(told.contains("curriculum[0]") && told.contains("until"), "{told}");
    let told = refused(
        "frog",
        r#"{"task": {"name": "run"}, "curriculum": [{"until": "good"}], "search": {"trials": 0}}"#,
    );
    assert!(told.starts_with("curriculum: its lessons end by champions"), "{told}");
}

const RANDOM: &str = r#"{"task": {"name": "run", "grow": [60], "steps": 200}, "seed": 5,
    "search": {"randomise": true, "trials": 4}, "evolution": {"population": 20}}"#;

#[test]
fn the_worse_of_calm_and_drawn_physics_counts() {
    let arena = arena("tetrapod2", RANDOM);
    let search = Evolution::new(&arena).unwrap();
    let calm = arena.evaluate(search.ask(), 200, 1).unwrap();
    let drawn = Round { steps: 200, ..search.round(&arena) };
    assert!(drawn.draw.is_some());
    let scores = arena.try_round(search.ask(), drawn, 2).unwrap();
    let worse = calm.iter().zip(&scores);
    assert!(worse.clone().all(|(calm, score)| score.fitness <= calm.fitness));
    let differ = worse.filter(|(calm, score)| score.fitness < calm.fitness).count();
    assert!((5..20).contains(&differ), "{differ} of 20");
    // Another draw is another result; the same one is the same, however it is tried.
    let other = Round { draw: Some(1), ..drawn };
    assert_ne!(arena.try_round(search.ask(), other, 1).unwrap(), scores);
    for (genome, score) in search.ask().iter().zip(&scores) {
        assert_eq!(arena.try_round(std::slice::from_ref(genome), drawn, 1).unwrap()[0], *score);
    }
    assert_eq!(arena.evaluate(search.ask(), 200, 1).unwrap(), calm);
}

/// Physics at the ends of their ranges can be varied no further, and are not refused.
#[test]
fn physics_at_the_end_of_their_ranges_are_varied_as_far_as_they_go() {
    for world in [r#""rate": 10, "mass_scale": 0.1"#, r#""rate": 1000, "friction_scale": 10"#] {
        let settings =
            RANDOM.replacen('{', &format!(r#"{{"world": {{{world}, "solver": "lockstep"}}, "#), 1);
        let arena = arena("biped1", &settings);
        let search = Evolution::new(&arena).unwrap();
        arena.try_round(search.ask(), search.round(&arena), 2).unwrap();
        arena.robustness(&search.ask()[..1], 1).unwrap();
    }
}

#[test]
fn portions_bring_the_same_search_with_lessons_bodies_and_draws() {
    let settings = r#"{"seed": 5, "task": {"name": "run", "grow": [60], "steps": 200},
        "curriculum": [{"steps": 100, "until": "usable"}], "body": {},
        "evolution": {"population": 20}, "search": {"trials": 5, "randomise": true}}"#;
    let whole_arena = arena("tetrapod1", settings);
    let mut whole = Evolution::new(&whole_arena).unwrap();
    let mut learner = Learner::new(arena("tetrapod1", settings)).unwrap();
    for generation in 1..=10 {
        let expected = whole.step(&whole_arena, 2).unwrap();
        let told = loop {
            let budget = Duration::from_secs(if generation % 3 == 0 { 100 } else { 0 });
            if let Some(told) = learner.work(budget).unwrap() {
                break told;
            }
        };
        assert_eq!(told, expected);
        assert_eq!(learner.evolution(), &whole);
    }
    assert!(whole.ahead() == 0 && whole.champion().is_some(), "a test of those, too");
    assert_eq!(round(&whole_arena, 1).ahead, 1);
}
