//! The creatures that ship with the project, and what follows from a creature's file.

use std::path::Path;

use ambulo_body::{Body, Description, Leg, Part, Tag};
use serde_json::{Value, json};

/// How far a hinge may lie outside of a part that it holds, metres.
const NEAR: f32 = 0.02;

/// File, name, legs, driven joints, pairs of them: the pianos of the seed's section 4.1.
const SEED: [(&str, &str, usize, usize, usize); 7] = [
    ("apod", "Apod", 0, 6, 0),
    ("biped1", "Biped 1", 2, 2, 1),
    ("biped2", "Biped 2", 2, 4, 2),
    ("tetrapod1", "Tetrapod 1", 4, 4, 2),
    ("tetrapod2", "Tetrapod 2", 4, 8, 4),
    ("decapod1", "Decapod 1", 10, 10, 5),
    ("decapod2", "Decapod 2", 10, 20, 10),
];

/// File and text of every creature that ships.
fn starters() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../starters/creatures");
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let json = paths.filter(|path| path.extension().is_some_and(|end| end == "json"));
    let read = |path: std::path::PathBuf| {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        (name, std::fs::read_to_string(path).unwrap())
    };
    let mut found: Vec<_> = json.map(read).collect();
    found.sort();
    found
}

fn parse(text: &str) -> Body {
    Body::parse(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Every starter by the name of its file.
fn each(mut check: impl FnMut(&str, &Body)) {
    starters().iter().for_each(|(name, text)| check(name, &parse(text)));
}

fn starter(name: &str) -> Body {
    let found = starters().into_iter().find(|(file, _)| file == name);
    parse(&found.unwrap_or_else(|| panic!("no starter {name}")).1)
}

#[test]
fn the_seven_of_the_seed_are_what_it_describes() {
    for (file, name, legs, driven, pairs) in SEED {
        let body = starter(file);
        assert_eq!(body.description().name, name);
        let facts = (body.legs().len(), body.driven().len(), body.pairs().len());
        assert_eq!(facts, (legs, driven, pairs), "{name}");
        // They have no head, no hand: every joint is driven, and every part but the torso hangs.
        assert_eq!((body.joints().len(), body.parts().len()), (driven, driven + 1), "{name}");
        let each = driven.checked_div(legs).unwrap_or(0);
        assert!(body.legs().iter().all(|leg| leg.joints.len() == each), "{name}");
    }
}

#[test]
fn every_starter_weighs_and_measures_what_a_creature_does() {
    assert!(starters().len() >= SEED.len());
    each(|name, body| {
        assert!((1.0..2000.0).contains(&body.mass()), "{name}: {} kg", body.mass());
        assert!((0.2..5.0).contains(&body.length()), "{name}: {} m", body.length());
        let standing = body.standing_height();
        assert!((0.05..2.0).contains(&standing), "{name}: {standing} m");
        let sum: f32 = (0..body.parts().len()).map(|part| body.part_mass(part)).sum();
        assert_eq!(sum, body.mass(), "{name}");
        assert!(!body.driven().is_empty(), "{name}");
    });
}

#[test]
fn every_starter_stands_on_the_ground() {
    each(|name, body| {
        let [left, bottom, right, _] = body.bounds();
        assert!(bottom.abs() < 0.01, "{name} begins at {bottom} m");
        assert!(left < 0.0 && right > 0.0, "{name} is not at 0, but at {left} to {right} m");
    });
}

#[test]
fn every_foot_of_a_starter_is_at_the_ground() {
    each(|name, body| {
        for leg in body.legs() {
            let foot = &body.parts()[leg.foot];
            let [_, bottom, ..] = foot.shape.bounds(foot.position, foot.angle);
            assert!(bottom.abs() < 0.05, "{name}: {} is at {bottom} m", foot.name);
        }
    });
}

#[test]
fn pairs_of_a_starter_are_alike() {
    each(|name, body| {
        for pair in body.pairs() {
            let [a, b] = pair.map(|joint| &body.joints()[body.driven()[joint]]);
            let make = |joint: &ambulo_body::Joint| (joint.limits, joint.torque, joint.speed);
            assert_eq!(make(a), make(b), "{name}: {} and {}", a.name, b.name);
        }
    });
}

/// How far a point is outside of a part's outline, metres.
fn outside(part: &Part, [x, y]: [f32; 2]) -> f32 {
    let (sin, cos) = part.angle.sin_cos();
    let (x, y) = (x - part.position[0], y - part.position[1]);
    let point = [cos * x + sin * y, cos * y - sin * x];
    let (corners, radius) = part.shape.hull();
    let edges = || (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]));
    let left = |([ax, ay], [bx, by]): ([f32; 2], [f32; 2])| {
        (bx - ax) * (point[1] - ay) >= (by - ay) * (point[0] - ax)
    };
    if corners.len() > 2 && edges().all(left) {
        return 0.0;
    }
    edges().map(|(a, b)| to_segment(point, a, b)).fold(f32::INFINITY, f32::min) - radius
}

fn to_segment([x, y]: [f32; 2], [ax, ay]: [f32; 2], [bx, by]: [f32; 2]) -> f32 {
    let (ex, ey) = (bx - ax, by - ay);
    let long = (ex * ex + ey * ey).max(f32::MIN_POSITIVE);
    let along = (((x - ax) * ex + (y - ay) * ey) / long).clamp(0.0, 1.0);
    (x - ax - along * ex).hypot(y - ay - along * ey)
}

#[test]
fn every_hinge_of_a_starter_is_within_both_parts() {
    each(|name, body| {
        for (index, joint) in body.joints().iter().enumerate() {
            let (parent, child) = body.ends(index);
            for part in [parent, child].map(|part| &body.parts()[part]) {
                let off = outside(part, joint.anchor);
                assert!(off <= NEAR, "{name}: {} is {off} m off {}", joint.name, part.name);
            }
        }
    });
}

#[test]
fn every_starter_is_the_same_after_writing_and_reading() {
    each(|name, body| {
        let text = body.to_json();
        let again = parse(&text);
        assert_eq!(&again, body, "{name}");
        assert_eq!((again.hash(), again.to_json()), (body.hash(), text), "{name}");
    });
}

#[test]
fn joints_and_parts_know_each_other() {
    each(|name, body| {
        assert_eq!(body.above(body.torso()), None, "{name}");
        for (index, joint) in body.joints().iter().enumerate() {
            let (parent, child) = body.ends(index);
            assert_eq!(body.above(child), Some((parent, index)), "{name}");
            let names = [parent, child].map(|part| &body.parts()[part].name);
            assert_eq!(names, [&joint.parent, &joint.child], "{name}");
        }
    });
}

/// Pointers to all numbers of a document but its version.
fn numbers(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(_) if at != "/format" => found.push(at.into()),
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, v)| numbers(v, &format!("{at}/{i}"), found));
        }
        Value::Object(fields) => {
            fields.iter().for_each(|(key, v)| numbers(v, &format!("{at}/{key}"), found));
        }
        _ => {}
    }
}

#[test]
fn the_hash_changes_with_every_number() {
    for name in ["raptor", "tetrapod2"] {
        let body = starter(name);
        let plain = serde_json::to_value(body.description()).unwrap();
        let mut pointers = vec![];
        numbers(&plain, "", &mut pointers);
        assert!(pointers.len() > 100, "{name}");
        let mut seen = vec![body.hash()];
        for pointer in pointers {
            let mut creature = plain.clone();
            let number = creature.pointer_mut(&pointer).unwrap();
            // Inwards, so that limits stay around 0.
            *number = json!(number.as_f64().unwrap() * 0.999 + 1e-6);
            let hash = parse(&creature.to_string()).hash();
            assert!(!seen.contains(&hash), "{name}: {pointer}");
            seen.push(hash);
        }
    }
}

#[test]
fn the_hash_does_not_change_with_what_is_told() {
    let body = starter("tetrapod2");
    let mut description = body.description().clone();
    description.name = "Dog".into();
    description.about = String::new();
    assert_eq!(Body::new(description).unwrap().hash(), body.hash());
}

#[test]
fn the_hash_changes_with_tags_sensors_pairs_and_order() {
    let body = starter("tetrapod2");
    let changes: [fn(&mut Description); 6] = [
        |creature| creature.parts[0].tags.push(Tag::Foot),
        |creature| creature.sensors.truncate(1),
        |creature| creature.sensors.reverse(),
        |creature| drop(creature.pairs.pop()),
        |creature| creature.joints.reverse(),
        |creature| creature.parts.swap(0, 1),
    ];
    let mut seen = vec![body.hash()];
    for change in changes {
        let mut description = body.description().clone();
        change(&mut description);
        let hash = Body::new(description).unwrap().hash();
        assert!(!seen.contains(&hash));
        seen.push(hash);
    }
}

/// The hash is in the files of controllers: if this fails, they are all refused. Change the format's
/// version instead.
#[test]
fn the_hash_is_the_same_in_every_build() {
    assert_eq!(format!("{:016x}", tree(&[("a", "torso", &["leg"])]).hash()), "495ad0015c3f09df");
}

/// A torso and circles: name, what it hangs on, tags. Joints are called as their children.
fn tree(parts: &[(&str, &str, &[&str])]) -> Body {
    let shape = json!({"circle": {"radius": 0.5}});
    let part = |name: &str, tags: Value| json!({"name": name, "shape": shape, "position": [0, 0], "density": 2, "tags": tags});
    let joint = |name: &str, parent: &str| {
        json!({"name": name, "parent": parent, "child": name, "anchor": [0, 0],
            "limits": [-1, 1], "torque": 1, "speed": 1})
    };
    let torso = part("torso", json!(["torso"]));
    let others = parts.iter().map(|(name, _, tags)| part(name, json!(tags)));
    let joints: Vec<_> = parts.iter().map(|(name, parent, _)| joint(name, parent)).collect();
    let creature = json!({"format": 1, "name": "tree", "joints": joints,
        "parts": std::iter::once(torso).chain(others).collect::<Vec<_>>()});
    parse(&creature.to_string())
}

fn leg(parts: &[usize], foot: usize, joints: &[usize]) -> Leg {
    Leg { parts: parts.to_vec(), foot, joints: joints.to_vec() }
}

#[test]
fn what_is_left_out_is_as_the_format_says() {
    let body = tree(&[("a", "torso", &[])]);
    assert_eq!(body.parts()[1].friction, 0.8);
    assert_eq!(body.parts()[1].angle, 0.0);
    let sensors = serde_json::to_value(&body.description().sensors).unwrap();
    assert_eq!(sensors, json!(["torso_rotation", "joint_angles"]));
    let expected = std::f32::consts::PI;
    assert!((body.mass() - expected).abs() < 1e-5, "two circles of half a metre, 2 kg/m²");
    assert_eq!((body.length(), body.standing_height()), (1.0, 0.5));
}

#[test]
fn hands_heads_and_what_is_ignored_are_not_driven() {
    for tag in ["head", "hand", "ignored"] {
        let body = tree(&[("a", "torso", &[]), ("b", "torso", &[tag]), ("c", "b", &[])]);
        // What hangs on such a part is driven, unless it is tagged itself.
        assert_eq!(body.driven(), [0, 2], "{tag}");
    }
    assert_eq!(tree(&[("a", "torso", &["leg"]), ("b", "a", &["foot"])]).driven(), [0, 1]);
}

#[test]
fn pairs_count_among_the_driven_and_held_ones_are_left_out() {
    let parts: [(&str, &str, &[&str]); 5] = [
        ("head", "torso", &["head"]),
        ("a", "torso", &[]),
        ("b", "torso", &[]),
        ("c", "torso", &["hand"]),
        ("d", "torso", &["hand"]),
    ];
    let mut description = tree(&parts).description().clone();
    description.pairs = [["b", "a"], ["c", "d"]].map(|pair| pair.map(String::from)).to_vec();
    let body = Body::new(description).unwrap();
    assert_eq!((body.driven(), body.pairs()), (&[1, 2][..], &[[1, 0]][..]));
}

#[test]
fn a_leg_is_a_chain_and_its_last_part_the_foot() {
    let body = tree(&[
        ("shin", "thigh", &["leg"]),
        ("thigh", "torso", &["leg"]),
        ("tail", "torso", &[]),
        ("stump", "tail", &["leg"]),
    ]);
    assert_eq!(body.legs(), [leg(&[2, 1], 1, &[1, 0]), leg(&[4], 4, &[3])]);
}

#[test]
fn the_tag_foot_names_another_part_of_the_leg_as_foot() {
    let heel: [(&str, &str, &[&str]); 3] =
        [("shin", "torso", &["leg"]), ("heel", "shin", &["foot"]), ("toe", "heel", &["leg"])];
    assert_eq!(tree(&heel).legs(), [leg(&[1, 2, 3], 2, &[0, 1, 2])]);
    // A leg may be a foot only.
    assert_eq!(tree(&[("foot", "torso", &["foot"])]).legs(), [leg(&[1], 1, &[0])]);
}

#[test]
fn a_leg_that_forks_goes_on_as_its_first_branch() {
    let body = tree(&[
        ("thigh", "torso", &["leg"]),
        ("spur", "thigh", &[]),
        ("shin", "thigh", &["leg"]),
        ("other", "thigh", &["leg"]),
        ("end", "other", &["foot"]),
    ]);
    assert_eq!(body.legs(), [leg(&[1, 3], 3, &[0, 2])]);
    assert_eq!(body.driven().len(), 5, "the other branch is driven all the same");
}

#[test]
fn a_held_part_of_a_leg_has_no_driven_joint() {
    let body = tree(&[("shin", "torso", &["leg"]), ("toe", "shin", &["leg", "ignored"])]);
    assert_eq!((body.driven(), body.legs()), (&[0][..], &[leg(&[1, 2], 2, &[0])][..]));
}

#[test]
fn the_frog_and_the_raptor_stand_on_their_feet() {
    let feet = |name: &str| -> Vec<String> {
        let body = starter(name);
        body.legs().iter().map(|leg| body.parts()[leg.foot].name.clone()).collect()
    };
    assert_eq!(feet("raptor"), ["foot far", "foot near"]);
    assert_eq!(feet("frog"), ["foot far", "arm far", "foot near", "arm near"]);
    let raptor = starter("raptor");
    let held: Vec<_> =
        (0..raptor.joints().len()).filter(|j| !raptor.driven().contains(j)).collect();
    let names: Vec<_> = held.iter().map(|&joint| raptor.joints()[joint].name.as_str()).collect();
    assert_eq!(names, ["neck", "head"]);
}
