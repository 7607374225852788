//! Scene files from anyone; what can be read survives being written, has ground everywhere, and moves.

#![no_main]

use ambulo_rig::Terrain;
use ambulo_scene::{Physics, Scene};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let scene = match Scene::parse(text) {
        Ok(scene) => scene,
        Err(error) => {
            let problems = error.problems();
            assert!(!problems.is_empty() && problems.iter().all(|one| one.path.starts_with('$')));
            return assert_eq!(error.to_string().split('\n').count(), problems.len());
        }
    };
    assert_eq!(Scene::parse(&scene.to_text()).expect("what we write is whole"), scene);
    let mut physics = Physics::new(&scene).expect("a scene that was checked");
    for at in [-1e9, -3.0, 0.0, 0.7, f32::NAN] {
        assert!(physics.height(at, -at).is_finite());
    }
    for object in 0..physics.objects() {
        let _ = physics.drive(object, 1.0, 50.0);
    }
    physics.step(0.1).expect("a plain dt");
    for object in 0..physics.objects() {
        for part in 0..physics.parts(object).len() {
            assert!(physics.part(object, part).expect("it is there").is_finite());
        }
    }
});
