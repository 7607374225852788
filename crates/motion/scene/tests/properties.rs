//! No file does harm, whatever is in it; what can be read can be written and used.

use ambulo_rig::glam::{Vec2, Vec3};
use ambulo_rig::{Terrain, Transform};
use ambulo_scene::{FileError, Interaction, Physics, Push, Scene, Script, place, weight};
use proptest::prelude::*;
use proptest::sample::Index;

const INTERACTIONS: [&str; 4] = [
    include_str!("../../../../starters/interactions/sit.toml"),
    include_str!("../../../../starters/interactions/open_door_back_left.toml"),
    include_str!("../../../../starters/interactions/pick_up_box.toml"),
    include_str!("../../../../starters/interactions/press_button.toml"),
];
const SCENE: &str = include_str!("../../../../starters/scenes/playground.toml");
const SCRIPT: &str = include_str!("../../../../starters/scenes/playground-visit.toml");

fn document(which: usize) -> &'static str {
    INTERACTIONS.into_iter().chain([SCENE, SCRIPT]).nth(which).unwrap()
}

fn one_line_each(text: &str, error: &FileError) -> Result<(), TestCaseError> {
    let problems = error.problems();
    let lines: Vec<_> = problems.iter().map(ToString::to_string).collect();
    prop_assert_eq!(error.to_string(), lines.join("\n"));
    prop_assert!(!problems.is_empty() && lines.iter().all(|line| !line.contains('\n')));
    prop_assert!(problems.iter().all(|one| one.path.starts_with('$') && !one.reason.is_empty()));
    let lines = text.matches('\n').count() + 1;
    let places = problems.iter().filter_map(|one| place(text, &one.path));
    prop_assert!(
        places.into_iter().all(|(line, column)| (1..=lines).contains(&line) && column > 0)
    );
    Ok(())
}

fn assert_no_harm(text: &str) -> Result<(), TestCaseError> {
    match Interaction::parse(text) {
        Ok(one) => prop_assert_eq!(Interaction::parse(&one.to_text()).unwrap(), one),
        Err(error) => one_line_each(text, &error)?,
    }
    match Scene::parse(text) {
        Ok(scene) => prop_assert_eq!(Scene::parse(&scene.to_text()).unwrap(), scene),
        Err(error) => one_line_each(text, &error)?,
    }
    match Script::parse(text) {
        Ok(script) => prop_assert_eq!(Script::parse(&script.to_text()).unwrap(), script),
        Err(error) => one_line_each(text, &error)?,
    }
    Ok(())
}

/// What is done to the bytes of a file: where, and what is put there instead of a few.
fn mutation() -> impl Strategy<Value = (Index, usize, Vec<u8>)> {
    let words = [
        "{",
        "}",
        "[",
        "]",
        "\"",
        ",",
        "=",
        "1e39",
        "-",
        "0",
        "nan",
        "inf",
        "\\u0000",
        "true",
        "\n",
        "[[target]]",
        "object",
        "kind.box",
        "'''",
        ".",
    ];
    let word = prop::sample::select(words.to_vec()).prop_map(|word| word.as_bytes().to_vec());
    let bytes = prop_oneof![word, prop::collection::vec(any::<u8>(), 0..4)];
    (any::<Index>(), 0..6_usize, bytes)
}

/// Numbers of a file are exchanged for others.
fn renumbered(text: &str, changes: &[(Index, f64)]) -> String {
    let numbers = |text: &str| -> Vec<(usize, usize)> {
        let bytes = text.as_bytes();
        let digit = |i: usize| bytes[i].is_ascii_digit() || bytes[i] == b'.' || bytes[i] == b'-';
        let starts = (1..bytes.len()).filter(|&i| digit(i) && b" [".contains(&bytes[i - 1]));
        starts.map(|i| (i, (i..bytes.len()).find(|&j| !digit(j)).unwrap_or(bytes.len()))).collect()
    };
    let mut text = text.to_owned();
    for (at, number) in changes {
        let places = numbers(&text);
        let (from, to) = *at.get(&places);
        text.replace_range(from..to, &format!("{number:?}"));
    }
    text
}

fn number() -> impl Strategy<Value = f64> {
    let edges = vec![0.0, -0.0, 1e-45, 0.01, 1.0, 3.0, 64.0, 1000.0, 1e38, 1e39, -1e300];
    prop_oneof![prop::sample::select(edges), -2.0..2.0, any::<f64>()]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn changed_bytes_do_no_harm(
        which in 0..6_usize, mutations in prop::collection::vec(mutation(), 1..4),
    ) {
        let text = document(which);
        let mut bytes = text.as_bytes().to_vec();
        for (at, count, instead) in mutations {
            let start = at.index(bytes.len() + 1);
            let end = (start + count).min(bytes.len());
            bytes.splice(start..end, instead);
        }
        assert_no_harm(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn changed_numbers_do_no_harm(
        which in 0..6_usize,
        changes in prop::collection::vec((any::<Index>(), number()), 1..4),
    ) {
        let text = document(which);
        assert_no_harm(&renumbered(text, &changes))?;
    }

    #[test]
    fn arbitrary_text_does_no_harm(text in any::<String>()) {
        assert_no_harm(&text)?;
    }

    /// Between its keys a weight stays between their values, and it does not jump.
    #[test]
    fn weights_stay_within_their_keys(
        steps in prop::collection::vec((0.01..2.0_f32, 0.0..=1.0_f32), 1..16),
        share in 0.0..1.0_f32,
    ) {
        let mut time = 0.0;
        let keys: Vec<_> = steps.iter().map(|&(step, value)| { time += step; [time, value] }).collect();
        let at = time * share;
        let value = weight(&keys, at);
        let (low, high) = keys.iter().fold((1.0_f32, 0.0_f32), |(l, h), k| (l.min(k[1]), h.max(k[1])));
        prop_assert!((low..=high).contains(&value), "{value}");
        prop_assert!((weight(&keys, at + 1e-4) - value).abs() < 0.03);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Any scene that is read can be stepped, with anything done to it: all stays finite.
    #[test]
    fn any_scene_stays_finite(
        changes in prop::collection::vec((any::<Index>(), -4.0..4.0_f64), 0..6),
        deeds in prop::collection::vec((0..6_u8, any::<Index>(), -3.0..3.0_f32, 0.0..200.0_f32), 1..12),
    ) {
        let Ok(scene) = Scene::parse(&renumbered(SCENE, &changes)) else { return Ok(()) };
        let mut physics = Physics::new(&scene).unwrap();
        physics.place_character(Vec3::ZERO, 0.25, 1.7).unwrap();
        for (deed, object, a, b) in deeds {
            let object = object.index(physics.objects());
            let holder = Transform::new(Vec3::new(a, 1.0, b * 0.01), ambulo_rig::glam::Quat::IDENTITY);
            // Each may be refused; none may panic.
            let _ = match deed {
                0 => physics.drive(object, a, b),
                1 => physics.release(object),
                2 => physics.push(object, Some(Push { velocity: Vec2::new(a, 1.0), force: b })),
                3 => physics.attach(object, holder).and_then(|()| physics.carry(object, holder)),
                4 => physics.detach(object),
                _ => physics.move_character(Vec3::new(a, 0.0, b * 0.02)).map(|_| ()),
            };
            physics.step(b * 0.001).unwrap();
            for object in 0..physics.objects() {
                for part in 0..physics.parts(object).len() {
                    prop_assert!(physics.part(object, part).unwrap().is_finite());
                }
            }
            prop_assert!(physics.character().unwrap().is_finite());
            prop_assert!(physics.height(a * 10.0, b).is_finite());
        }
    }
}
