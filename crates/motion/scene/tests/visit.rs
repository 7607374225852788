//! The playground, visited.

mod common;

use std::sync::Arc;

use ambulo_scene::{Script, Visit};
use common::playground::{Playground, model, starters};

#[test]
fn it_does_everything_there_is_to_do() {
    let place = Playground::read(&model());
    let text = std::fs::read_to_string(starters().join("scenes/playground-visit.toml")).unwrap();
    let script = Script::parse(&text).unwrap();
    let (body, moves) = (Arc::clone(&place.body), Arc::clone(&place.moves));
    let mut visit = Visit::new(&place.scene, &script, &place.model, body, moves, 0).unwrap();
    while visit.step() {}
    let measured = visit.measured();
    let uses = script.tasks.iter().filter(|task| task.using.is_some()).count();
    assert_eq!((measured.undone.len(), measured.ended as usize), (0, uses), "{measured:#?}");
    assert_eq!((measured.sits, measured.stood_up), (4, 4));
    assert!(measured.hand_cm.count > 1000 && measured.hips_cm.count > 100);
    let good = [
        measured.hand_cm.most <= 1.0 && measured.hand_degrees.most <= 5.0 && measured.slips == 0,
        measured.hips_cm.most <= 2.0 && measured.hips_degrees.most <= 5.0,
        measured.penetration_cm.most <= 1.0,
        measured.transition_jump_cm <= 1.5 * measured.walking_jump_cm,
        measured.walking_jump_cm > 4.0,
        measured.skate_cm.mean <= 0.1 && measured.skate_cm.count > 5000,
    ];
    assert_eq!(good, [true; 6], "{measured:#?}");
}
