//! What a creature file is refused for: the place in the document, and what was expected there.

use ambulo_body::{Body, BodyError, Description, MOST_PARTS};
use serde_json::{Value, json};

/// One of everything: a box, capsules, a circle, a polygon, a leg of two parts, a head, a pair.
const PLAIN: &str = r#"{
  "format": 1,
  "name": "Plain",
  "parts": [
    {"name": "torso", "shape": {"box": {"width": 1.0, "height": 0.4}}, "position": [0.0, 1.0],
     "density": 40.0, "tags": ["torso"]},
    {"name": "thigh", "shape": {"capsule": {"length": 0.3, "radius": 0.05}},
     "position": [0.0, 0.65], "angle": 0.1, "density": 40.0, "friction": 0.9, "tags": ["leg"]},
    {"name": "shin", "shape": {"capsule": {"length": 0.3, "radius": 0.05}},
     "position": [0.0, 0.3], "density": 40.0, "tags": ["leg"]},
    {"name": "head", "shape": {"circle": {"radius": 0.2}}, "position": [0.6, 1.2],
     "density": 20.0, "tags": ["head"]},
    {"name": "tail", "shape": {"polygon": {"points": [[0, -0.1], [0, 0.1], [-0.8, 0.0]]}},
     "position": [-0.5, 1.0], "density": 20.0}
  ],
  "joints": [
    {"name": "hip", "parent": "torso", "child": "thigh", "anchor": [0.0, 0.8],
     "limits": [-1.0, 1.0], "torque": 100.0, "speed": 8.0},
    {"name": "knee", "parent": "thigh", "child": "shin", "anchor": [0.0, 0.5],
     "limits": [-1.2, 0.0], "torque": 80.0, "speed": 8.0},
    {"name": "neck", "parent": "torso", "child": "head", "anchor": [0.5, 1.1],
     "limits": [-0.3, 0.3], "torque": 20.0, "speed": 4.0},
    {"name": "tail", "parent": "torso", "child": "tail", "anchor": [-0.5, 1.0],
     "limits": [-0.5, 0.5], "torque": 20.0, "speed": 4.0}
  ],
  "sensors": ["torso_rotation", "joint_angles", {"ground_rays": {"count": 3, "reach": 4.0}}],
  "pairs": [["hip", "tail"]]
}"#;

const POINTS: &str = "/parts/4/shape/polygon/points";
const POINTS_PATH: &str = "$.parts[4].shape.polygon.points";

type Edit<'a> = (&'a str, Value);

fn plain() -> Value {
    serde_json::from_str(PLAIN).unwrap()
}

/// Puts a value at a JSON pointer; `-` is the end of a list.
fn put(creature: &mut Value, pointer: &str, value: Value) {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    match creature.pointer_mut(parent).unwrap() {
        Value::Object(fields) => drop(fields.insert(key.into(), value)),
        Value::Array(list) if key == "-" => list.push(value),
        Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
        other => panic!("{pointer} leads into {other}"),
    }
}

fn edited(edits: &[Edit]) -> String {
    let mut creature = plain();
    edits.iter().for_each(|(pointer, value)| put(&mut creature, pointer, value.clone()));
    creature.to_string()
}

fn error(text: &str) -> BodyError {
    match Body::parse(text) {
        Ok(_) => panic!("this was not refused:\n{text}"),
        Err(error) => error,
    }
}

/// The text of the error has one line for each problem: `path: reason`.
fn lines(text: &str) -> Vec<String> {
    let error = error(text);
    let lines: Vec<_> = error.to_string().lines().map(str::to_owned).collect();
    let problems: Vec<_> = error.problems().iter().map(ToString::to_string).collect();
    assert_eq!(lines, problems);
    lines
}

fn refused(edits: &[Edit], expected: &[&str]) {
    assert_eq!(lines(&edited(edits)), expected);
}

/// A change of one number, with the path that names it.
fn number(pointer: &str, value: f64, expected: &str) {
    refused(&[(pointer, json!(value))], &[expected]);
}

/// A tail of other corners.
fn corners(points: &Value, expected: &str) {
    refused(&[(POINTS, points.clone())], &[&format!("{POINTS_PATH}{expected}")]);
}

#[test]
fn the_plain_creature_is_not_refused() {
    let body = Body::parse(PLAIN).unwrap();
    assert_eq!(
        (body.parts().len(), body.driven(), body.pairs()),
        (5, &[0, 1, 3][..], &[[0, 2]][..])
    );
}

#[test]
fn what_is_no_json() {
    let not =
        |text: &str, reason: &str| assert_eq!(lines(text), [format!("$: not JSON: {reason}")]);
    not("", "EOF while parsing a value at line 1 column 0");
    not("{\n  \"format\": 1,\n}", "trailing comma at line 3 column 1");
    not(&PLAIN.replacen("40.0", "NaN", 1), "expected value at line 6 column 17");
    not(&PLAIN.replacen("40.0", "1e999", 1), "number out of range at line 6 column 21");
    not(&"[".repeat(200), "recursion limit exceeded at line 1 column 128");
    assert!(matches!(error(&format!("{PLAIN} {PLAIN}")), BodyError::Json(_)));
}

#[test]
fn a_file_that_is_too_long_is_not_even_read() {
    let text = format!("{PLAIN}{}", " ".repeat(1 << 20));
    let expected = format!("$: a creature file has at most 1048576 bytes, this one {}", text.len());
    assert_eq!(lines(&text), [expected]);
}

/// How the JSON reader words it is its own affair; the path and what is wrong are ours.
fn shaped(pointer: &str, value: Value, expected: &str) {
    let found = lines(&edited(&[(pointer, value)]));
    assert!(found.len() == 1 && found[0].starts_with(expected), "{found:?} is not {expected}");
}

#[test]
fn another_type_is_named_by_its_path() {
    assert_eq!(lines("{}"), ["$: missing field `format`"]);
    assert!(lines("5")[0].starts_with("$: invalid type: integer `5`, expected "));
    shaped("/name", json!(5), "$.name: invalid type: integer `5`, expected a string");
    shaped("/format", json!(1.5), "$.format: invalid type: floating point `1.5`");
    shaped("/format", json!(-1), "$.format: invalid value: integer `-1`");
    shaped("/parts", json!({}), "$.parts: invalid type: map, expected a sequence");
    shaped("/parts/1/density", json!("40"), "$.parts[1].density: invalid type: string \"40\"");
    shaped("/parts/1/density", Value::Null, "$.parts[1].density: invalid type: null");
    shaped("/parts/2/position/1", json!([]), "$.parts[2].position[1]: invalid type: sequence");
    shaped("/joints/1/limits", json!([0.0]), "$.joints[1].limits: invalid length 1");
    shaped("/pairs/0", json!(["hip", "tail", "neck"]), "$.pairs[0]: invalid length 3");
    shaped("/parts/3/tags/0", json!("Torso"), "$.parts[3].tags[0]: unknown variant `Torso`");
    shaped("/parts/3/shape", json!({"ball": {}}), "$.parts[3].shape: unknown variant `ball`");
    shaped("/parts/3/shape", json!({}), "$.parts[3].shape: ");
    shaped("/sensors/1", json!("smell"), "$.sensors[1]: unknown variant `smell`");
}

#[test]
fn a_field_that_is_unknown_or_missing_is_named_by_its_path() {
    shaped("/colour", json!(1), "$.colour: unknown field `colour`, expected one of `format`");
    shaped("/parts/3/colour", json!(1), "$.parts[3].colour: unknown field `colour`");
    shaped("/joints/0/motor", json!(1), "$.joints[0].motor: unknown field `motor`");
    let circle = "/parts/3/shape/circle/width";
    shaped(circle, json!(1), "$.parts[3].shape.circle.width: unknown field `width`");
    shaped("/parts/3", json!({"name": "head"}), "$.parts[3]: missing field `shape`");
    let rays = json!({"ground_rays": {"count": 3}});
    shaped("/sensors/2", rays, "$.sensors[2].ground_rays: missing field `reach`");
}

#[test]
fn another_version_comes_before_all_else() {
    let newer = "$.format: this is format 2, this version reads 1: update Ambulo";
    refused(&[("/format", json!(2)), ("/gravity", json!(3))], &[newer]);
    assert!(matches!(error(r#"{"format": 7}"#), BodyError::Version { found: 7 }));
    let mut description: Description = serde_json::from_str(PLAIN).unwrap();
    description.format = 2;
    assert_eq!(Body::new(description).unwrap_err().to_string(), "$.format: 2 is not 1");
}

#[test]
fn exactly_one_part_is_the_torso() {
    let none = "$.parts: no part has the tag torso; exactly one must";
    refused(&[("/parts/0/tags", json!([]))], &[none]);
    let two = "$.parts[3].tags: a second torso beside $.parts[0]; exactly one part is the torso";
    let hangs = "$.joints[2].child: the torso hangs on nothing: let it be the parent";
    refused(&[("/parts/3/tags", json!(["torso"]))], &[two, hangs]);
}

#[test]
fn the_torso_is_nobodys_child() {
    refused(
        &[("/joints/2/parent", json!("head")), ("/joints/2/child", json!("torso"))],
        &[
            "$.joints[2].child: the torso hangs on nothing: let it be the parent",
            "$.parts[3]: 'head' hangs on nothing: no joint has it as its child",
        ],
    );
}

#[test]
fn every_part_hangs_on_the_torso() {
    let mut creature = plain();
    creature["joints"].as_array_mut().unwrap().remove(0);
    creature["pairs"] = json!([]);
    // The shin hangs on the thigh: only the thigh is to blame.
    let thigh = "$.parts[1]: 'thigh' hangs on nothing: no joint has it as its child";
    assert_eq!(lines(&creature.to_string()), [thigh]);
}

#[test]
fn a_loop_is_refused_of_any_kind() {
    let endless = |part: usize, name| {
        format!("$.parts[{part}]: a loop: following '{name}' upwards never ends")
    };
    refused(&[("/joints/0/parent", json!("shin"))], &[&endless(1, "thigh"), &endless(2, "shin")]);
    refused(
        &[("/joints/2/parent", json!("head"))],
        &[
            "$.joints[2]: joins a part to itself",
            "$.parts[3]: 'head' hangs on nothing: no joint has it as its child",
        ],
    );
    let twice = json!({"name": "bar", "parent": "head", "child": "shin", "anchor": [0, 0],
        "limits": [-1, 1], "torque": 1, "speed": 1});
    let shin = "$.joints[4].child: a loop: 'shin' already hangs on $.joints[1]";
    refused(&[("/joints/-", twice)], &[shin]);
}

#[test]
fn ends_of_joints_are_parts() {
    refused(
        &[("/joints/1/parent", json!("thig"))],
        &[
            "$.joints[1].parent: no part is called 'thig'",
            "$.parts[2]: 'shin' hangs on nothing: no joint has it as its child",
        ],
    );
    let found = lines(&edited(&[("/joints/1/child", json!(""))]));
    assert_eq!(found[0], "$.joints[1].child: no part is called ''");
}

#[test]
fn limits_are_in_order_around_the_start_pose_and_not_too_wide() {
    let limits = |pair: Value, expected: &str| {
        refused(&[("/joints/1/limits", pair)], &[&format!("$.joints[1].limits: {expected}")]);
    };
    limits(json!([0.5, -0.5]), "[0.5, -0.5] is the wrong way round: the lower limit comes first");
    limits(json!([0.0, 0.0]), "[0, 0] is the wrong way round: the lower limit comes first");
    limits(json!([0.1, 0.5]), "[0.1, 0.5] leaves the start pose, 0, outside");
    limits(json!([-0.5, -0.1]), "[-0.5, -0.1] leaves the start pose, 0, outside");
    limits(json!([-3.2, 0.5]), "[-3.2, 0.5] is not within -3.1 to 3.1 rad");
    limits(json!([-0.5, 180]), "[-0.5, 180] is not within -3.1 to 3.1 rad");
    limits(json!([-1e39, 0.5]), "[-inf, 0.5] is not finite");
    limits(json!([-0.5, 1e39]), "[-0.5, inf] is not finite");
    for good in [json!([0.0, 0.5]), json!([-0.5, 0.0]), json!([-3.1, 3.1])] {
        assert!(Body::parse(&edited(&[("/joints/1/limits", good)])).is_ok());
    }
}

#[test]
fn not_a_number_is_refused_where_no_file_could_hold_it() {
    let mut description: Description = serde_json::from_str(PLAIN).unwrap();
    description.parts[1].angle = f32::NAN;
    description.joints[1].limits[0] = f32::NAN;
    description.joints[2].torque = f32::NAN;
    assert_eq!(
        Body::new(description).unwrap_err().to_string(),
        "$.parts[1].angle: NaN is not -7 to 7 rad\n\
         $.joints[1].limits: [NaN, 0] is not finite\n\
         $.joints[2].torque: NaN is not above 0 and at most 100000 N·m"
    );
}

#[test]
fn a_polygon_is_convex() {
    let concave = ": not convex; split the part, or join two convex ones by a joint";
    corners(&json!([[0, 0], [1, 0], [0.2, 0.2], [0, 1]]), concave);
    let turns = (0..5).map(|i| f64::from(i) * 0.8 * std::f64::consts::PI);
    let star: Vec<_> = turns.map(|turn| [turn.cos(), turn.sin()]).collect();
    corners(&json!(star), concave);
    corners(&json!([[0, 0], [1, 1], [1, 0], [0, 1]]), concave);
    let straight = ": the outline does not turn here";
    corners(&json!([[0, 0], [0.5, 0], [1, 0], [0, 1]]), &format!("[1]{straight}"));
    corners(&json!([[0.5, 0], [1, 0], [0, 1], [0, 0]]), &format!("[0]{straight}"));
    corners(&json!([[0, 0], [1, 0], [0.5, 0]]), &format!("[1]{straight}"));
}

#[test]
fn a_polygon_has_3_to_8_corners_apart_from_each_other() {
    corners(&json!([]), ": 0 corners; a polygon has 3 to 8");
    corners(&json!([[0, 0], [1, 0]]), ": 2 corners; a polygon has 3 to 8");
    let round = |count: i32| {
        let turns = (0..count).map(|i| f64::from(i) / f64::from(count) * std::f64::consts::TAU);
        json!(turns.map(|turn| [turn.cos(), turn.sin()]).collect::<Vec<_>>())
    };
    corners(&round(9), ": 9 corners; a polygon has 3 to 8");
    let short = "[3]: the edge from here is 0.02 m long; at least 0.025 m";
    corners(&json!([[0, 0], [1, 0], [1, 1], [0, 0.02]]), short);
    let same = "[1]: the edge from here is 0 m long; at least 0.025 m";
    corners(&json!([[0, 0], [1, 0], [1, 0], [0, 1]]), same);
    for count in 3..=8 {
        assert!(Body::parse(&edited(&[(POINTS, round(count))])).is_ok(), "{count} corners");
    }
}

#[test]
fn corners_are_within_20_m_and_finite() {
    let far = json!([[0, 0], [21, 0], [0, 1e39]]);
    let expected = ["[1][0]: 21 is not -20 to 20 m", "[2][1]: inf is not -20 to 20 m"];
    let expected = expected.map(|tail| format!("{POINTS_PATH}{tail}"));
    refused(&[(POINTS, far)], &[&expected[0], &expected[1]]);
}

/// Box2D welds corners that are within 2 cm: such outlines were taken, and then no world could be
/// made of them, so that every fitness of a search came out as not a number.
#[test]
fn outlines_that_the_engine_would_weld_are_refused() {
    let side = "0.02 is not 0.025 to 20 m";
    number("/parts/0/shape/box/width", 0.02, &format!("$.parts[0].shape.box.width: {side}"));
    number("/parts/0/shape/box/height", 0.02, &format!("$.parts[0].shape.box.height: {side}"));
    let thin = ": 0.02 m across; at least 0.025 m";
    corners(&json!([[0, 0], [1, 0], [1.5, 0.02], [0.5, 0.02]]), thin);
}

/// The corner of 5 cm, 28 m away from its part's origin: its centre of mass came out 12 cm beside
/// it, for want of digits.
#[test]
fn an_outline_far_from_its_origin_is_refused() {
    let far = "too small for its distance from 0, the origin of its part: move it there";
    corners(&json!([[20, 20], [19.95, 20], [20, 19.95]]), &format!(": {far}"));
}

#[test]
fn numbers_of_a_part_have_ranges() {
    number("/parts/1/density", 0.0, "$.parts[1].density: 0 is not 0.1 to 10000 kg/m²");
    number("/parts/1/density", -40.0, "$.parts[1].density: -40 is not 0.1 to 10000 kg/m²");
    number("/parts/1/density", 1e39, "$.parts[1].density: inf is not 0.1 to 10000 kg/m²");
    number("/parts/1/friction", -0.1, "$.parts[1].friction: -0.1 is not 0 to 10");
    number("/parts/1/angle", 90.0, "$.parts[1].angle: 90 is not -7 to 7 rad");
    number("/parts/1/position/0", 101.0, "$.parts[1].position[0]: 101 is not -100 to 100 m");
    number("/parts/1/position/1", -1e39, "$.parts[1].position[1]: -inf is not -100 to 100 m");
}

#[test]
fn sizes_have_ranges() {
    let size = |part: usize, size: &str, value: f64, expected: &str| {
        let pointer = format!("/parts/{part}/shape/{size}");
        let path = pointer.replace("/parts/", "").replacen('/', "].", 1).replace('/', ".");
        number(&pointer, value, &format!("$.parts[{path}: {expected}"));
    };
    size(0, "box/width", 0.0, "0 is not 0.025 to 20 m");
    size(0, "box/height", 21.0, "21 is not 0.025 to 20 m");
    size(1, "capsule/length", 0.005, "0.005 is not 0.01 to 20 m");
    size(1, "capsule/radius", 1e39, "inf is not 0.01 to 20 m");
    size(3, "circle/radius", -1.0, "-1 is not 0.01 to 20 m");
}

#[test]
fn numbers_of_a_joint_have_ranges() {
    number("/joints/0/torque", 0.0, "$.joints[0].torque: 0 is not above 0 and at most 100000 N·m");
    let torque = "$.joints[0].torque: 100001 is not above 0 and at most 100000 N·m";
    number("/joints/0/torque", 100_001.0, torque);
    number(
        "/joints/0/torque",
        1e39,
        "$.joints[0].torque: inf is not above 0 and at most 100000 N·m",
    );
    number("/joints/0/speed", -8.0, "$.joints[0].speed: -8 is not above 0 and at most 100 rad/s");
    number("/joints/0/speed", 101.0, "$.joints[0].speed: 101 is not above 0 and at most 100 rad/s");
    number("/joints/0/anchor/1", 200.0, "$.joints[0].anchor[1]: 200 is not -100 to 100 m");
}

#[test]
fn names_are_unique_and_can_be_shown() {
    let short = "a name is 1 to 80 characters, none of them a control character";
    for name in ["", "  ", "a\nb", "a\u{7f}", &"x".repeat(81)] {
        refused(&[("/name", json!(name))], &[&format!("$.name: {short}")]);
    }
    assert!(Body::parse(&edited(&[("/name", json!("ü".repeat(80)))])).is_ok());
    let pairs = ("/pairs", json!([]));
    refused(
        &[("/joints/3/name", json!("neck")), pairs],
        &["$.joints[3].name: a second joint 'neck'"],
    );
    let found = lines(&edited(&[("/parts/4/name", json!("head"))]));
    assert_eq!(found[0], "$.parts[4].name: a second part 'head'");
}

/// A name with a line break made two lines of one problem.
#[test]
fn a_problem_is_one_line_whatever_the_names_are() {
    let found = lines(&edited(&[("/joints/1/parent", json!("a\nb\u{1b}[31m"))]));
    assert_eq!(found[0], "$.joints[1].parent: no part is called 'a\\nb\\u{1b}[31m'");
    shaped("/parts/0/a\nb", json!(1), "$.parts[0].a\\nb: unknown field `a\\nb`");
}

#[test]
fn pairs_are_of_joints_each_in_one_of_them() {
    let pairs = |value: Value, expected: &str| refused(&[("/pairs", value)], &[expected]);
    pairs(json!([["hip", "wing"]]), "$.pairs[0][1]: no joint is called 'wing'");
    pairs(json!([["hip", "torso"]]), "$.pairs[0][1]: no joint is called 'torso'");
    pairs(json!([["hip", "hip"]]), "$.pairs[0][1]: 'hip' is in $.pairs[0] already");
    let twice = json!([["hip", "knee"], ["knee", "tail"]]);
    pairs(twice, "$.pairs[1][0]: 'knee' is in $.pairs[0] already");
}

#[test]
fn sensors_are_told_apart_and_there_is_one() {
    let sensors = |value: Value, expected: &str| refused(&[("/sensors", value)], &[expected]);
    sensors(json!([]), "$.sensors: none; a controller must be told something");
    sensors(json!(["height", "velocity", "height"]), "$.sensors[2]: listed twice");
    let rays = |count: i64, reach: f64| json!({"ground_rays": {"count": count, "reach": reach}});
    sensors(json!([rays(2, 3.0), rays(5, 9.0)]), "$.sensors[1]: listed twice");
    for count in [0, 17] {
        let expected = format!("$.sensors[0].ground_rays.count: {count} is not 1 to 16");
        sensors(json!([rays(count, 3.0)]), &expected);
    }
    for (reach, shown) in [(0.05, "0.05"), (51.0, "51"), (1e39, "inf")] {
        let expected = format!("$.sensors[0].ground_rays.reach: {shown} is not 0.1 to 50 m");
        sensors(json!([rays(3, reach)]), &expected);
    }
}

/// A torso and so many circles around it.
fn crowd(circles: usize) -> String {
    let mut creature = plain();
    creature["pairs"] = json!([]);
    creature["parts"].as_array_mut().unwrap().truncate(1);
    creature["joints"] = json!([]);
    for index in 0..circles {
        let name = format!("c{index}");
        let part = json!({"name": name, "shape": {"circle": {"radius": 0.1}}, "position": [0, 0],
            "density": 1});
        let joint = json!({"name": name, "parent": "torso", "child": name, "anchor": [0, 0],
            "limits": [-1, 1], "torque": 1, "speed": 1});
        put(&mut creature, "/parts/-", part);
        put(&mut creature, "/joints/-", joint);
    }
    creature.to_string()
}

#[test]
fn a_creature_has_2_to_64_parts() {
    assert_eq!(lines(&crowd(0)), ["$.parts: 1 parts; a creature has 2 to 64"]);
    assert!(Body::parse(&crowd(1)).is_ok());
    assert!(Body::parse(&crowd(MOST_PARTS - 1)).is_ok());
    assert_eq!(lines(&crowd(MOST_PARTS)), ["$.parts: 65 parts; a creature has 2 to 64"]);
    let found = lines(&edited(&[("/parts", json!([]))]));
    assert_eq!(
        found[..2],
        [
            "$.parts: 0 parts; a creature has 2 to 64",
            "$.parts: no part has the tag torso; exactly one must"
        ]
    );
}

#[test]
fn everything_that_is_wrong_is_said_at_once() {
    refused(
        &[
            ("/name", json!("")),
            ("/parts/0/tags", json!([])),
            ("/parts/1/density", json!(0)),
            ("/parts/3/shape/circle/radius", json!(1e39)),
            ("/joints/0/limits", json!([1, -1])),
            ("/joints/1/speed", json!(0)),
            ("/sensors/-", json!("joint_angles")),
            ("/pairs/0/0", json!("wing")),
        ],
        &[
            "$.name: a name is 1 to 80 characters, none of them a control character",
            "$.parts: no part has the tag torso; exactly one must",
            "$.parts[1].density: 0 is not 0.1 to 10000 kg/m²",
            "$.parts[3].shape.circle.radius: inf is not 0.01 to 20 m",
            "$.joints[0].limits: [1, -1] is the wrong way round: the lower limit comes first",
            "$.joints[1].speed: 0 is not above 0 and at most 100 rad/s",
            "$.sensors[3]: listed twice",
            "$.pairs[0][0]: no joint is called 'wing'",
        ],
    );
}
