//! Interaction files from anyone; what can be read survives being written and can be asked anything.

#![no_main]

use ambulo_rig::Transform;
use ambulo_rig::glam::Vec3;
use ambulo_scene::Interaction;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let one = match Interaction::parse(text) {
        Ok(one) => one,
        Err(error) => {
            let problems = error.problems();
            assert!(!problems.is_empty() && problems.iter().all(|one| one.path.starts_with('$')));
            return assert_eq!(error.to_string().split('\n').count(), problems.len());
        }
    };
    assert_eq!(Interaction::parse(&one.to_text()).expect("what we write is whole"), one);
    let (place, yaw) = one.approach.stand(Transform::IDENTITY);
    assert!(place.is_finite() && yaw.is_finite());
    one.trigger.volume.contains(Vec3::ZERO);
    for target in &one.targets {
        assert!(target.place().is_finite());
        for tick in 0..32_u8 {
            let time = one.clip.end * f32::from(tick) / 31.0;
            assert!((0.0..=1.0).contains(&target.weight(time)));
        }
    }
});
