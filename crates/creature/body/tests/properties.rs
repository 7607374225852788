//! Any creature that is a tree can be read, written and measured; no file does harm.

use ambulo_body::{Body, Description, FORMAT_VERSION, Joint, Part, Sensor, Shape, Tag};
use proptest::prelude::*;
use proptest::sample::Index;
use serde_json::{Value, json};

const STARTERS: [&str; 2] = [
    include_str!("../../../../starters/creatures/raptor.json"),
    include_str!("../../../../starters/creatures/apod.json"),
];

/// Corners on an ellipse, which is convex whatever they are; either way around.
fn polygon() -> impl Strategy<Value = Shape> {
    let jitter = prop::collection::vec(-0.3..0.3_f32, 3..=8);
    (jitter, 0.1..10.0_f32, 0.5..1.0_f32, any::<bool>(), prop::array::uniform2(-0.2..0.2_f32))
        .prop_map(|(jitter, size, flat, clockwise, off)| {
            let step = std::f32::consts::TAU / jitter.len() as f32;
            let turns = jitter.iter().enumerate().map(|(i, jitter)| (i as f32 + jitter) * step);
            let corner =
                |turn: f32| [size * (turn.cos() + off[0]), size * (flat * turn.sin() + off[1])];
            let mut points: Vec<_> = turns.map(corner).collect();
            if clockwise {
                points.reverse();
            }
            Shape::Polygon { points }
        })
}

fn shape() -> impl Strategy<Value = Shape> {
    let side = || prop_oneof![Just(0.025_f32), Just(20.0), 0.025..20.0_f32];
    let size = || prop_oneof![Just(0.01_f32), Just(20.0), 0.01..20.0_f32];
    prop_oneof![
        (side(), side()).prop_map(|(width, height)| Shape::Box { width, height }),
        size().prop_map(|radius| Shape::Circle { radius }),
        (size(), size()).prop_map(|(length, radius)| Shape::Capsule { length, radius }),
        polygon(),
    ]
}

fn place() -> impl Strategy<Value = [f32; 2]> {
    prop::array::uniform2(prop_oneof![Just(0.0), Just(-0.0), Just(100.0), -100.0..100.0_f32])
}

fn name() -> impl Strategy<Value = String> {
    prop_oneof![Just(String::new()), "[ -~]{1,8}", "[äß→\u{1f40e}\"\\\\']{1,5}"]
}

fn tags() -> impl Strategy<Value = Vec<Tag>> {
    prop::sample::subsequence(vec![Tag::Leg, Tag::Foot, Tag::Hand, Tag::Head, Tag::Ignored], 0..3)
}

/// A part without its tags, and a joint whose ends are yet to be found.
fn part() -> impl Strategy<Value = (Part, Index, Joint)> {
    let numbers = (-7.0..=7.0_f32, 0.1..=1e4_f32, 0.0..=10.0_f32);
    let limits = (-3.1..=0.0_f32, 0.001..=3.1_f32);
    let motor = (prop_oneof![Just(f32::MIN_POSITIVE), 1e-6..=1e5_f32], 1e-3..=100.0_f32);
    (name(), shape(), place(), numbers, tags(), (any::<Index>(), place(), limits, motor)).prop_map(
        |(
            name,
            shape,
            position,
            (angle, density, friction),
            tags,
            (above, anchor, limits, motor),
        )| {
            let part = Part { name, shape, position, angle, density, friction, tags };
            let (parent, child) = (String::new(), String::new());
            let (limits, (torque, speed)) = (limits.into(), motor);
            let name = part.name.clone();
            (part, above, Joint { name, parent, child, anchor, limits, torque, speed })
        },
    )
}

fn sensors() -> impl Strategy<Value = Vec<Sensor>> {
    (1..=16_u32, 0.1..=50.0_f32).prop_flat_map(|(count, reach)| {
        let all = vec![
            Sensor::TorsoRotation,
            Sensor::JointAngles,
            Sensor::JointSpeeds,
            Sensor::FootContacts,
            Sensor::Height,
            Sensor::Velocity,
            Sensor::GroundRays { count, reach },
        ];
        (Just(all).prop_shuffle(), 1..=7_usize).prop_map(|(all, count)| all[..count].to_vec())
    })
}

/// A tree: every part hangs on one before it, the first is the torso. Listed in any order.
fn creature() -> impl Strategy<Value = Description> {
    let parts = prop::collection::vec(part(), 2..=12);
    (parts, sensors(), name(), any::<Index>(), 0..4_usize).prop_map(
        |(made, sensors, about, turn, pairs)| {
            let (mut parts, mut joints): (Vec<Part>, Vec<Joint>) = (vec![], vec![]);
            for (i, (mut part, above, mut joint)) in made.into_iter().enumerate() {
                part.name = format!("{i} {}", part.name);
                if i == 0 {
                    part.tags = vec![Tag::Torso];
                } else {
                    joint.name = format!("{i} {}", joint.name);
                    joint.parent = parts[above.index(i)].name.clone();
                    joint.child = part.name.clone();
                    joints.push(joint);
                }
                parts.push(part);
            }
            let names: Vec<_> = joints.iter().map(|joint| joint.name.clone()).collect();
            let pairs = names.chunks_exact(2).take(pairs);
            let pairs = pairs.map(|pair| [pair[0].clone(), pair[1].clone()]).collect();
            let (by, of) = (turn.index(parts.len()), joints.len());
            parts.rotate_left(by);
            joints.rotate_left(by % of);
            let (format, name) = (FORMAT_VERSION, "random".into());
            Description { format, name, about, parts, joints, sensors, pairs }
        },
    )
}

/// What follows from a file is finite and agrees with itself.
fn assert_sound(body: &Body) -> Result<(), TestCaseError> {
    let facts = [body.mass(), body.length(), body.standing_height()];
    for fact in facts.into_iter().chain(body.bounds()) {
        prop_assert!(fact.is_finite(), "{facts:?} {:?}", body.bounds());
    }
    let [left, bottom, right, top] = body.bounds();
    prop_assert!(body.mass() > 0.0 && body.length() > 0.0 && left < right && bottom < top);
    // Room for rounding 100 m away from 0.
    prop_assert!(body.standing_height() > -1e-3, "{} m", body.standing_height());
    for (index, part) in body.parts().iter().enumerate() {
        prop_assert!(body.part_mass(index) > 0.0);
        let (upright, [x, y]) = (part.shape.bounds([0.0; 2], 0.0), part.shape.centre());
        let room = 1e-3 * (upright[2] - upright[0] + upright[3] - upright[1]);
        prop_assert!(x > upright[0] - room && x < upright[2] + room, "{x} {upright:?}");
        prop_assert!(y > upright[1] - room && y < upright[3] + room, "{y} {upright:?}");
    }
    let (driven, parts) = (body.driven().len(), body.parts().len());
    prop_assert!(body.driven().iter().all(|&joint| joint < body.joints().len()));
    prop_assert!(body.pairs().iter().flatten().all(|&joint| joint < driven));
    for leg in body.legs() {
        prop_assert!(leg.parts.contains(&leg.foot) && leg.parts.iter().all(|&part| part < parts));
        prop_assert!(leg.joints.iter().all(|&joint| joint < driven));
    }
    Ok(())
}

/// Read, and the same after writing; or refused, each problem in one line that begins with a path.
fn assert_no_harm(text: &str) -> Result<(), TestCaseError> {
    match Body::parse(text) {
        Ok(body) => {
            assert_sound(&body)?;
            prop_assert_eq!(Body::parse(&body.to_json()).unwrap(), body);
        }
        Err(error) => {
            let problems = error.problems();
            let lines: Vec<_> = problems.iter().map(ToString::to_string).collect();
            prop_assert_eq!(error.to_string(), lines.join("\n"));
            prop_assert!(lines.iter().all(|line| !line.contains('\n')));
            prop_assert!(!problems.is_empty());
            for problem in problems {
                prop_assert!(problem.path.starts_with('$') && !problem.reason.is_empty());
            }
        }
    }
    Ok(())
}

/// Pointers to all values of a document.
fn places(value: &Value, at: String, found: &mut Vec<String>) {
    match value {
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, v)| places(v, format!("{at}/{i}"), found));
        }
        Value::Object(fields) => {
            fields.iter().for_each(|(key, v)| places(v, format!("{at}/{key}"), found));
        }
        _ => {}
    }
    found.push(at);
}

fn number() -> impl Strategy<Value = f64> {
    let edges = vec![0.0, -0.0, 1e-45, 1e-39, 0.01, 20.0, 100.0, 1e38, 1e39, -1e300, 1e308];
    prop_oneof![prop::sample::select(edges), -10.0..10.0, any::<f64>()]
}

fn value() -> impl Strategy<Value = Value> {
    let word =
        prop::sample::select(vec!["", "torso", "leg", "head", "joint_speeds", "a\nb", "neck"]);
    let one = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        number().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        word.prop_map(Value::from),
        Just(json!({"circle": {"radius": 0.1}})),
        Just(json!({"ground_rays": {"count": 3, "reach": 2}})),
    ];
    one.prop_recursive(2, 8, 4, |inner| prop::collection::vec(inner, 0..4).prop_map(Value::from))
}

/// What is done to a value of a document.
#[derive(Clone, Debug)]
enum Edit {
    Replace(Value),
    Remove,
    Double,
}

fn edit() -> impl Strategy<Value = (Index, Edit)> {
    let edit = prop_oneof![
        6 => value().prop_map(Edit::Replace),
        1 => Just(Edit::Remove),
        1 => Just(Edit::Double),
    ];
    (any::<Index>(), edit)
}

fn apply(document: &mut Value, at: &Index, edit: Edit) {
    let mut found = vec![];
    places(document, String::new(), &mut found);
    let pointer = at.get(&found);
    let Some((parent, key)) = pointer.rsplit_once('/') else {
        return if let Edit::Replace(value) = edit {
            *document = value
        };
    };
    match (document.pointer_mut(parent).unwrap(), edit) {
        (parent, Edit::Replace(value)) => *parent.pointer_mut(&format!("/{key}")).unwrap() = value,
        (Value::Object(fields), Edit::Remove) => drop(fields.remove(key)),
        (Value::Object(fields), _) => drop(fields.insert(format!("{key}2"), json!(1))),
        (Value::Array(list), Edit::Remove) => drop(list.remove(key.parse().unwrap())),
        (Value::Array(list), _) => list.push(list[key.parse::<usize>().unwrap()].clone()),
        (other, _) => panic!("{pointer} leads into {other}"),
    }
}

/// What is done to the bytes of a file: where, and what is put there instead of a few.
fn mutation() -> impl Strategy<Value = (Index, usize, Vec<u8>)> {
    let words = ["{", "}", "[", "]", "\"", ",", ":", "1e39", "-", "0", "torso", "\\u0000", "null"];
    let word = prop::sample::select(words.to_vec()).prop_map(|word| word.as_bytes().to_vec());
    let bytes = prop_oneof![word, prop::collection::vec(any::<u8>(), 0..4)];
    (any::<Index>(), 0..6_usize, bytes)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn any_tree_is_read_written_and_measured(creature in creature()) {
        let joints = creature.joints.len();
        let body = Body::new(creature.clone()).map_err(|e| TestCaseError::fail(e.to_string()))?;
        assert_sound(&body)?;
        prop_assert_eq!(body.description(), &creature);
        let again = Body::parse(&body.to_json()).unwrap();
        prop_assert_eq!(again.hash(), body.hash());
        prop_assert_eq!(again.to_json(), body.to_json());
        prop_assert_eq!(&again, &body);
        for joint in 0..joints {
            let (parent, child) = body.ends(joint);
            prop_assert_eq!(body.above(child), Some((parent, joint)));
        }
    }

    /// Any joint that hangs its child on one further down closes a loop.
    #[test]
    fn any_loop_is_found(creature in creature(), at in any::<Index>(), under in any::<Index>()) {
        let mut creature = creature;
        let body = Body::new(creature.clone()).unwrap();
        let joint = at.index(creature.joints.len());
        let (_, top) = body.ends(joint);
        let hangs = |part: usize| {
            std::iter::successors(Some(part), |&p| body.above(p).map(|(parent, _)| parent))
                .any(|p| p == top)
        };
        let below: Vec<_> = (0..creature.parts.len()).filter(|&part| hangs(part)).collect();
        let parent = *under.get(&below);
        creature.joints[joint].parent = creature.parts[parent].name.clone();
        let error = Body::new(creature).unwrap_err();
        let expected = if parent == top { "joins a part to itself" } else { "a loop: " };
        prop_assert!(error.problems()[0].reason.starts_with(expected), "{error}");
    }

    #[test]
    fn changed_values_do_no_harm(
        starter in prop::sample::select(&STARTERS), edits in prop::collection::vec(edit(), 1..4),
    ) {
        let mut document: Value = serde_json::from_str(starter).unwrap();
        for (at, edit) in edits {
            apply(&mut document, &at, edit);
        }
        assert_no_harm(&document.to_string())?;
    }

    #[test]
    fn changed_bytes_do_no_harm(
        starter in prop::sample::select(&STARTERS),
        mutations in prop::collection::vec(mutation(), 1..4),
    ) {
        let mut bytes = starter.as_bytes().to_vec();
        for (at, count, instead) in mutations {
            let start = at.index(bytes.len() + 1);
            let end = (start + count).min(bytes.len());
            bytes.splice(start..end, instead);
        }
        assert_no_harm(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn arbitrary_text_does_no_harm(text in any::<String>(), json in value()) {
        assert_no_harm(&text)?;
        assert_no_harm(&json.to_string())?;
    }

    /// Outlines of any corners: whatever is taken has an area, and its centre within.
    #[test]
    fn outlines_that_are_taken_can_be_measured(
        size in prop::sample::select(vec![0.03_f32, 0.1, 1.0, 20.0]),
        corners in prop::collection::vec(prop::array::uniform2(-1.0..1.0_f32), 3..6),
        far in prop::array::uniform2(prop_oneof![3 => Just(0.0_f32), 1 => -19.0..19.0_f32]),
    ) {
        let mut creature: Description = serde_json::from_str(STARTERS[0]).unwrap();
        let points = corners.iter().map(|corner| [0, 1].map(|i| size * corner[i] + far[i]));
        creature.parts[0].shape = Shape::Polygon { points: points.collect() };
        if let Ok(body) = Body::new(creature) {
            assert_sound(&body)?;
        }
    }
}
