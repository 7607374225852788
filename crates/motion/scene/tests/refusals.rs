//! What a file is refused for: the place in the document, and what was expected there.

use ambulo_scene::{FileError, Interaction, Scene};

const SIT: &str = include_str!("files/sit.toml");
const DOOR: &str = include_str!("files/open_door.toml");
const CARRY: &str = include_str!("files/pick_up_box.toml");
const SCENE: &str = include_str!("../../../../starters/scenes/playground.toml");

/// The text of the error has one line for each problem: `path: reason`.
fn lines(error: &FileError) -> Vec<String> {
    let lines: Vec<_> = error.to_string().lines().map(str::to_owned).collect();
    let problems: Vec<_> = error.problems().iter().map(ToString::to_string).collect();
    assert_eq!(lines, problems);
    lines
}

fn edited(text: &str, edits: &[(&str, &str)]) -> String {
    edits.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "there is no {from}");
        text.replacen(from, to, 1)
    })
}

/// Each line begins as expected.
fn begins(lines: &[String], expected: &[&str]) {
    assert_eq!(lines.len(), expected.len(), "{lines:#?}");
    for (line, expected) in lines.iter().zip(expected) {
        assert!(line.starts_with(expected), "{line}\nis not\n{expected}");
    }
}

fn interaction(text: &str, edits: &[(&str, &str)], expected: &[&str]) {
    begins(&lines(&Interaction::parse(&edited(text, edits)).unwrap_err()), expected);
}

fn scene(edits: &[(&str, &str)], expected: &[&str]) {
    begins(&lines(&Scene::parse(&edited(SCENE, edits)).unwrap_err()), expected);
}

#[test]
fn what_is_no_toml_is_named_by_its_line() {
    interaction(SIT, &[("format = 1", "format = ")], &["$: line 2, column 10: "]);
    interaction(SIT, &[("[clip]", "[clip")], &["$: line 17, column 6: "]);
    scene(&[("format = 1", "format = 1\nformat = 1")], &["$: line 3, column 1: duplicate key"]);
}

#[test]
fn another_shape_is_named_by_path_and_line() {
    let cases: &[(&str, &str, &str)] = &[
        ("enter = 0.0", "enter = \"now\"", "$.clip.enter: line 18, column 9: invalid type: string"),
        ("hold_repeats", "repeats", "$.clip.repeats: line 22, column 1: unknown field `repeats`"),
        ("object = \"chair\"", "object = \"sofa\"", "$.object: line 4, column 10: unknown variant"),
        ("limb = \"hips\"", "limb = \"nose\"", "$.target[0].limb: line 26, column 8: unknown"),
        ("point = [0.0, 0.1, -0.05]", "point = [0.0, 0.1]", "$.target[0].point: line 28"),
        ("[action.seat]", "[action.sleep]", "$.action: line 32, column 9: unknown variant `sleep`"),
        (
            "until = 1.6",
            "pillow = 1",
            "$.action.seat: line 34, column 1: unexpected keys in table: pillow",
        ),
        ("name = \"sit\"\n", "", "$: line 1, column 1: missing field `name`"),
    ];
    for (from, to, expected) in cases {
        interaction(SIT, &[(from, to)], &[expected]);
    }
}

#[test]
fn all_problems_are_named_at_once() {
    interaction(
        SIT,
        &[
            ("size = [1.0, 1.0, 1.1]", "size = [1.0, 0.0, nan]"),
            ("on = \"seat\"", "on = \"sofa\""),
            ("gaits = [\"stand\", \"walk\"]", "gaits = [\"walk\", \"walk\"]"),
            ("exit = 1.6", "exit = 1.1"),
            ("rotation = [0.0, 0.0, 0.0, 1.0]", "rotation = [0.0, 0.0, 1.0, 1.0]"),
            ("[1.2, 1.0], [1.6, 1.0]", "[1.2, 1.5], [1.1, 1.0]"),
            ("[2.8, 0.0]", "[2.8, 0.3]"),
            ("when = \"player_moves\"", "when = \"clip_ends\""),
        ],
        &[
            "$.trigger.volume.box.size[1]: 0 is not 0.05 to 50 m",
            "$.trigger.volume.box.size[2]: NaN is not 0.05 to 50 m",
            "$.approach.on: 'sofa': a chair has the frames object, seat, back",
            "$.approach.gaits[1]: listed twice",
            "$.clip.exit: must come at the hold or after it",
            "$.clip.hold_repeats: a hold that repeats lasts at least 0.1 s",
            "$.target[0].rotation: not a unit quaternion",
            "$.target[0].weight[1][1]: 1.5 is not 0 to 1",
            "$.target[0].weight[2][0]: times rise by at least 0.01 s",
            "$.target[0].weight[3][1]: the first and the last weight are 0",
            "$.exit.when: the hold repeats",
        ],
    );
}

#[test]
fn actions_are_held_against_the_rest() {
    let hand = ("hand = \"right_hand\"", "hand = \"left_hand\"");
    interaction(DOOR, &[hand], &["$.action.hinge: no target leads that hand"]);
    let other = ("[action.hinge]\nhand = \"right_hand\"\nangle = -1.4\ntorque = 40.0\n", "");
    let seat = ("from = 0.5\nuntil = 1.5", "[action.seat]\nfrom = 1.5\nuntil = 0.5");
    interaction(
        DOOR,
        &[other, seat],
        &[
            "$.action.seat: no target leads the hips",
            "$.action.seat: a door does not do that",
            "$.action.seat.until: it ends before it begins",
        ],
    );
    interaction(
        DOOR,
        &[("angle = -1.4\ntorque = 40.0", "angle = -4\ntorque = 0"), ("until = 1.5", "until = 9")],
        &[
            "$.action.hinge.angle: -4 is not -3.1 to 3.1 rad",
            "$.action.hinge.torque: 0 is not 0.1 to 1000 N·m",
            "$.action.hinge.until: 9 is not 0 to 2 s",
        ],
    );
    let twice = ("[\"right_hand\", \"left_hand\"]", "[\"right_hand\", \"right_hand\"]");
    interaction(CARRY, &[twice], &["$.action.attach.hands[1]: listed twice"]);
    let again = ("limb = \"right_hand\"\non = \"left\"", "limb = \"left_hand\"\non = \"left\"");
    interaction(
        CARRY,
        &[again],
        &[
            "$.target[1].limb: led already by a target above",
            "$.action.attach: no target leads that hand",
        ],
    );
}

#[test]
fn no_file_leads_out_of_its_folder() {
    for file in ["../secret.bvh", "/etc/passwd", "a\\b.bvh", "clip.exe", ".bvh", "a\\nb.bvh"] {
        let file = format!("[clip]\nfile = '{file}'");
        interaction(SIT, &[("[clip]", &file)], &["$.clip.file: '"]);
    }
    Interaction::parse(&edited(SIT, &[("[clip]", "[clip]\nfile = 'sit_down-2.bvh'")])).unwrap();
    scene(&[("\"sit.toml\"", "\"../sit.toml\"")], &["$.object[3].interactions[0]: '../sit.toml'"]);
}

#[test]
fn a_scene_names_all_its_problems() {
    scene(
        &[
            ("place = [0.0, 10.0]", "place = [inf, 10.0]"),
            ("size = [16.0, 24.0]", "size = [16.0, 65.0]"),
            ("count = 7", "count = 1"),
            ("end = [-0.55, 6.0]", "end = [-5.0, 6.0]"),
            ("handle_height = 1.02", "handle_height = 3.0"),
            ("limits = [-1.6, 1.6]", "limits = [0.2, 1.6]"),
            ("name = \"bench\"", "name = \"chair\""),
            (
                "seat_depth = 0.5, width = 1.4, back_height = 0.0",
                "seat_depth = 0.5, width = 1.4, back_height = 0.3",
            ),
            ("mass = 40.0", "mass = -1"),
        ],
        &[
            "$.ground[0].place[0]: inf is not -1000 to 1000 m",
            "$.ground[1].size[1]: 65 is not 0.5 to 64 m",
            "$.ground[4].kind.steps.count: 1 is not 2 to 100",
            "$.wall[0].end: at least 1 cm from the start",
            "$.object[0].kind.door.handle_height: 3 is not 0.3 to 2 m",
            "$.object[0].kind.door.handle_height: the handle is not on the leaf",
            "$.object[0].kind.door.limits: [0.2, 1.6] leaves 0, where it starts, outside",
            "$.object[4].name: 'chair' is the name of $.object[3] already",
            "$.object[4].kind.chair.back_height: a back rest ends at least 5 cm above",
            "$.object[5].kind.box.mass: -1 is not 0.05 to 5000 kg",
        ],
    );
}

#[test]
fn too_much_and_too_little_is_refused() {
    let ground = "[[ground]]\nplace = [0, 0]\nsize = [1, 1]\nkind.flat = { height = 0 }\n";
    let head = "format = 1\nname = \"x\"\nspawn = { place = [0, 0] }\n";
    let none = Scene::parse(&format!("{head}ground = []")).unwrap_err();
    assert_eq!(lines(&none), ["$.ground: 0 entries; 1 to 64 are allowed"]);
    let many = Scene::parse(&format!("{head}{}", ground.repeat(65))).unwrap_err();
    assert_eq!(lines(&many), ["$.ground: 65 entries; 1 to 64 are allowed"]);
    let long = Scene::parse(&format!("{head}{}", "#".repeat(1 << 18))).unwrap_err();
    assert!(matches!(long, FileError::TooLong(_)), "{long}");
    let deep = Scene::parse(&format!("{head}a = {}", "[".repeat(10_000))).unwrap_err();
    assert!(matches!(deep, FileError::Toml(_)), "{deep}");
}

#[test]
fn a_scene_and_its_interactions_are_held_together() {
    let scene = Scene::parse(SCENE).unwrap();
    let sit = Interaction::parse(SIT).unwrap();
    let error = scene.check_interactions(|file| (file != "press_button.toml").then_some(&sit));
    let lines = lines(&error.unwrap_err());
    assert_eq!(
        lines[0],
        "$.object[0].interactions[0]: 'open_door_front_right.toml' is for a chair, this is a door"
    );
    assert!(lines.contains(&"$.object[1].interactions[0]: there is no 'press_button.toml'".into()));
}
