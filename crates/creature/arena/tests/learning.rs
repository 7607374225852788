//! Searches with the defaults: creatures that nobody tuned for, portions, restarts, stored states.

mod common;

use std::time::Duration;

use ambulo_arena::{Arena, Evolution, Learner, Settings, Until};
use ambulo_body::Body;
use common::starter;

/// An arena with the defaults but for what is said.
fn natural(body: Body, settings: &str) -> Arena {
    Arena::new(body, Settings::parse(settings).unwrap()).unwrap()
}

fn unknown(name: &str) -> Body {
    let path = format!("{}/tests/creatures/{name}.json", env!("CARGO_MANIFEST_DIR"));
    Body::parse(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Seconds are a matter of benches; generations are not. A second is some 60 generations of these.
#[test]
fn creatures_that_no_one_tuned_for_learn_to_run() {
    for name in ["tripod", "hexapod", "hopper"] {
        let arena = natural(unknown(name), r#"{"task": {"name": "run"}}"#);
        let mut search = Evolution::new(&arena).unwrap();
        let usable = |search: &Evolution| search.champion().is_some_and(|c| c.is(Until::Usable));
        while !usable(&search) && search.generation() < 40 {
            search.step(&arena, 2).unwrap();
        }
        let champion = search.champion().unwrap();
        let judged = arena.judge(&arena.record(&champion.genome, 2000).unwrap());
        assert!(judged.usable, "{name}: {:?}", judged.reasons);
    }
}

/// Half of its population falls in the first generation: an episode ends at a fall.
const SMALL: &str = r#"{"seed": 5, "task": {"name": "run", "grow": [60, 120], "steps": 240},
    "evolution": {"population": 20}, "search": {"trials": 5, "patience": 2}}"#;

#[test]
fn portions_bring_the_same_search_as_whole_generations() {
    let arena = || natural(starter("biped2"), SMALL);
    let whole_arena = arena();
    let mut whole = Evolution::new(&whole_arena).unwrap();
    let mut learner = Learner::new(arena()).unwrap();
    let mut portions = 0;
    for generation in 1..=12 {
        let expected = whole.step(&whole_arena, 2).unwrap();
        let told = loop {
            portions += 1;
            // No time at all, or more than enough.
            let budget = Duration::from_secs(if generation % 3 == 0 { 100 } else { 0 });
            if let Some(told) = learner.work(budget).unwrap() {
                break told;
            }
        };
        assert_eq!(told, expected);
        assert_eq!(learner.evolution(), &whole);
    }
    assert!(portions > 100, "{portions}");
    assert!(whole.restarts() > 0 && whole.champion().is_some(), "a test of those, too");
}

#[test]
fn a_stored_search_goes_on_as_if_nothing_had_been() {
    let arena = natural(starter("tetrapod2"), SMALL);
    let mut whole = Evolution::new(&arena).unwrap();
    for _ in 0..4 {
        whole.step(&arena, 1).unwrap();
    }
    let stored = serde_json::to_string(&whole).unwrap();
    let mut back: Evolution = serde_json::from_str(&stored).unwrap();
    back.check(&arena).unwrap();
    assert_eq!(back, whole);
    for threads in 1..=4 {
        assert_eq!(whole.step(&arena, 1).unwrap(), back.step(&arena, threads).unwrap());
    }
    assert_eq!(back, whole);
    let other = natural(starter("biped1"), SMALL);
    assert!(
        back.check(&other).unwrap_err().to_string().contains("another")
            || back.check(&other).is_err()
    );
}

#[test]
fn stages_grow_when_the_best_does_not_fall() {
    let arena = natural(starter("tetrapod2"), &SMALL.replace("\"patience\": 2", "\"patience\": 0"));
    assert_eq!(arena.stages(), [60, 120, 240]);
    let mut search = Evolution::new(&arena).unwrap();
    let mut seen = Vec::new();
    for _ in 0..6 {
        seen.push(search.step(&arena, 2).unwrap().steps);
    }
    assert!(seen.is_sorted() && seen[0] == 60 && seen[5] == 240, "{seen:?}");
}

/// The champion of a search is the one whose replays are best, not the one with the most fitness.
#[test]
fn a_champion_is_judged_on_replays_under_other_physics() {
    let arena = natural(starter("tetrapod1"), r#"{"task": {"name": "run"}}"#);
    let mut search = Evolution::new(&arena).unwrap();
    while !search.champion().is_some_and(|champion| champion.is(Until::Robust)) {
        search.step(&arena, 2).unwrap();
        assert!(search.generation() < 20, "a robust gait of Tetrapod 1 is soon found");
    }
    let champion = search.champion().unwrap().clone();
    let held = arena.robustness(std::slice::from_ref(&champion.genome), 2).unwrap().remove(0);
    assert_eq!(champion.robustness, Some(held));
    assert!(held.is_robust() && held.held() >= 19);
    assert_eq!(arena.score(&champion.genome).unwrap().fitness, champion.fitness);
    // On ice it slips: a different world is a different verdict.
    let ice = natural(
        starter("tetrapod1"),
        r#"{"task": {"name": "run"}, "world": {"friction_scale": 0.02}}"#,
    );
    assert!(!ice.robustness(&[champion.genome], 1).unwrap()[0].is_robust());
}
