//! Creatures and arenas that tests share.
#![allow(dead_code)] // Each test file uses some of it.

use ambulo_arena::{Arena, Evolution, Settings};
use ambulo_body::Body;

/// Names of all creatures that ship.
pub const CREATURES: [&str; 9] = [
    "apod",
    "biped1",
    "biped2",
    "tetrapod1",
    "tetrapod2",
    "decapod1",
    "decapod2",
    "frog",
    "raptor",
];

/// A creature that ships, by its file's name.
pub fn starter(name: &str) -> Body {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../starters/creatures");
    let text = std::fs::read_to_string(format!("{folder}/{name}.json")).unwrap();
    Body::parse(&text).unwrap()
}

/// An arena of the seed's protocol with settings as JSON.
pub fn arena(name: &str, settings: &str) -> Arena {
    let mut settings: serde_json::Value = serde_json::from_str(settings).unwrap();
    settings["preset"] = "seed".into();
    Arena::new(starter(name), Settings::parse(&settings.to_string()).unwrap()).unwrap()
}

/// Genomes of an arena's first generation.
pub fn first(arena: &Arena) -> Vec<Vec<f32>> {
    Evolution::new(arena).unwrap().ask().to_vec()
}

/// An arena of a task with so many steps and a small population.
pub fn short(name: &str, task: &str, steps: u32, population: usize) -> Arena {
    let settings = format!(
        r#"{{"seed": 3, "evolution": {{"population": {population}}},
            "task": {{"name": "{task}", "steps": {steps}}}}}"#
    );
    arena(name, &settings)
}
