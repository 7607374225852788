//! Settings of a search from anyone; those that are taken resolve to themselves.

#![no_main]

use std::sync::LazyLock;

use ambulo_arena::{Arena, Settings};
use ambulo_body::Body;
use libfuzzer_sys::fuzz_target;

static BODY: LazyLock<Body> = LazyLock::new(|| {
    Body::parse(include_str!("../seeds/creature/leg.json")).expect("the seed is whole")
});

fuzz_target!(|text: &str| {
    let Ok(settings) = Settings::parse(text) else { return };
    // No episode is run: how long one may take is for whoever asks for it.
    let Ok(arena) = Arena::new(BODY.clone(), settings) else { return };
    let resolved = arena.settings();
    let again = Arena::new(BODY.clone(), resolved.clone()).expect("what was taken is taken again");
    assert_eq!(again.settings(), resolved);
    assert_eq!(again.genes(), arena.genes());
    let json = serde_json::to_string(resolved).expect("settings are JSON");
    assert_eq!(&Settings::parse(&json).expect("what we write is whole"), resolved);
    let pilot = arena.pilot(&vec![0.5; arena.genes()]).expect("a genome of the right length");
    assert_eq!(pilot.settings(), &resolved.controller);
});
