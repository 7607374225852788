//! Scripts from anyone; what can be read survives being written and can be held to a scene.

#![no_main]

use ambulo_scene::{Scene, Script, place};
use libfuzzer_sys::fuzz_target;

const SCENE: &str = include_str!("../../starters/scenes/playground.toml");

fuzz_target!(|text: &str| {
    let script = match Script::parse(text) {
        Ok(script) => script,
        Err(error) => {
            let problems = error.problems();
            assert!(!problems.is_empty() && problems.iter().all(|one| one.path.starts_with('$')));
            for one in &problems {
                let _ = place(text, &one.path);
            }
            return assert_eq!(error.to_string().split('\n').count(), problems.len());
        }
    };
    assert_eq!(Script::parse(&script.to_text()).expect("what we write is whole"), script);
    let scene = Scene::parse(SCENE).expect("it ships");
    if let Err(error) = script.check_against(&scene) {
        assert_eq!(error.to_string().split('\n').count(), error.problems().len());
    }
});
