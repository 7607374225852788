//! Creature files from anyone; what can be read is finite and survives being written.

#![no_main]

use ambulo_body::Body;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let body = match Body::parse(text) {
        Ok(body) => body,
        Err(error) => {
            let problems = error.problems();
            assert!(!problems.is_empty() && problems.iter().all(|one| one.path.starts_with('$')));
            return assert_eq!(error.to_string().split('\n').count(), problems.len());
        }
    };
    let again = Body::parse(&body.to_json()).expect("what we write is whole");
    assert_eq!(again, body);
    assert_eq!(again.hash(), body.hash());
    let facts = [body.mass(), body.length(), body.standing_height()];
    assert!(facts.iter().chain(&body.bounds()).all(|fact| fact.is_finite()));
    assert!(body.mass() > 0.0 && body.length() > 0.0);
    for (index, part) in body.parts().iter().enumerate() {
        assert!(body.part_mass(index) > 0.0 && part.shape.centre().iter().all(|v| v.is_finite()));
    }
    for joint in 0..body.joints().len() {
        let (parent, child) = body.ends(joint);
        assert_eq!(body.above(child), Some((parent, joint)));
    }
    for leg in body.legs() {
        assert!(leg.parts.contains(&leg.foot));
        assert!(leg.joints.iter().all(|&joint| joint < body.driven().len()));
    }
    assert!(body.pairs().iter().flatten().all(|&joint| joint < body.driven().len()));
});
