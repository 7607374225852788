use super::*;
use crate::motion::Marks;
use ambulo_rig::glam::{DQuat, DVec3};
use ambulo_rig::{Clip, Joint};

fn skeleton(joints: usize) -> Skeleton {
    let joint = |index: usize| Joint {
        name: ["hips", "spine", "arm"][index].into(),
        parent: index.checked_sub(1),
        offset: DVec3::Y,
        tips: vec![],
    };
    Skeleton::new((0..joints).map(joint).collect()).unwrap()
}

fn clips() -> BTreeMap<String, Arc<Motion>> {
    let motion = |joints: usize| {
        let turns = vec![DQuat::IDENTITY; 2 * joints];
        let clip = Clip::new(skeleton(joints), 1.0, vec![], vec![], turns).unwrap();
        Arc::new(Motion::new(&clip, 30.0, Marks::default()).unwrap())
    };
    let named = [("walk", 3), ("run", 3), ("dog", 2)];
    named.map(|(name, joints)| (name.to_string(), motion(joints))).into()
}

fn read(json: &str) -> Node {
    serde_json::from_str(json).unwrap()
}

fn refused(json: &str) -> String {
    BlendTree::new(&read(json), &clips(), &skeleton(3)).unwrap_err().to_string()
}

const TREE: &str = r#"{"overlay": {
    "base": {"blend_1d": {"by": "speed", "samples": [
        {"at": 0, "node": {"clip": {"name": "walk"}}},
        {"at": 1.5, "node": {"blend_2d": {"by": ["turn", "speed"], "samples": [
            {"at": [-1, 1], "node": {"clip": {"name": "walk", "speed": 0.5}}},
            {"at": [1, 1], "node": {"clip": {"name": "run"}}}]}}}]}},
    "over": {"select": {"by": "gesture", "children": [
        {"clip": {"name": "run", "looped": false}},
        {"additive": {"base": {"clip": {"name": "walk"}}, "add": {"clip": {"name": "run"}},
                      "reference": "walk", "weight": -0.5}}]}},
    "weight": "waving", "mask": [{"joint": "arm", "up": 1}]}}"#;

#[test]
fn a_tree_is_read_and_names_its_parameters() {
    let node = read(TREE);
    let tree = BlendTree::new(&node, &clips(), &skeleton(3)).unwrap();
    assert_eq!(tree.parameters(), ["waving", "speed", "turn", "gesture"]);
    assert_eq!((tree.parameter("turn"), tree.parameter("tail")), (Some(2), None));
    assert_eq!(tree.joints(), 3);
    // One clock for the blend spaces and all below, one for each other clip.
    assert_eq!(tree.clocks.len(), 4);
    assert!(matches!(tree.jobs[tree.clocks[0]], Job::Blend { space: Space::Line(..), .. }));
    let again = read(&serde_json::to_string(&node).unwrap());
    assert_eq!(again, node);
}

#[test]
fn what_is_wrong_is_told_by_its_path() {
    let told = |json: &str, path: &str, problem: &str| {
        let error = refused(json);
        assert!(error.starts_with(&format!("{path}: ")), "{error}");
        assert!(error.contains(problem), "{error}");
    };
    told(r#"{"clip": {"name": "swim"}}"#, "clip", "no clip 'swim'");
    told(r#"{"clip": {"name": "dog"}}"#, "clip", "'dog' has 2 joints, the skeleton 3");
    told(r#"{"clip": {"name": "walk", "speed": 0}}"#, "clip", "speed 0");
    told(r#"{"clip": {"name": "walk", "speed": -1}}"#, "clip", "speed -1");
    told(r#"{"select": {"by": "x", "children": []}}"#, "select", "nothing to select");
    told(r#"{"select": {"by": "", "children": []}}"#, "select", "needs a name");
    told(r#"{"blend_1d": {"by": "x", "samples": []}}"#, "blend_1d", "at least one sample");
    let clip = r#"{"clip": {"name": "walk"}}"#;
    told(
        &format!(
            r#"{{"blend_2d": {{"by": ["x", "y"], "samples": [
                {{"at": [0, 1], "node": {clip}}}, {{"at": [0, 1], "node": {clip}}}]}}}}"#
        ),
        "blend_2d",
        "samples 0 and 1",
    );
    let swapped = TREE.replace(r#""at": 1.5"#, r#""at": -1.5"#);
    told(&swapped, "overlay.base.blend_1d", "sample 1 does not come after");
    let once = TREE.replace(r#""speed": 0.5"#, r#""looped": false"#);
    let deep = "overlay.base.blend_1d.samples[1].node.blend_2d.samples[0].node.clip";
    told(&once, deep, "must be looped");
    let lost = TREE.replace(r#""reference": "walk""#, r#""reference": "sit""#);
    told(&lost, "overlay.over.select.children[1].additive", "no clip 'sit'");
    let heavy = TREE.replace("-0.5", "-11");
    told(&heavy, "overlay.over.select.children[1].additive", "weight -11");
    told(&TREE.replace(r#""waving""#, "1.5"), "overlay", "weight 1.5");
    told(&TREE.replace(r#""arm""#, r#""tail""#), "overlay", "no joint 'tail'");
}

#[test]
fn unknown_fields_are_refused() {
    for json in [
        r#"{"clip": {"name": "walk", "loop": true}}"#,
        r#"{"dance": {}}"#,
        r#"{"blend_1d": {"by": "x", "samples": [{"at": 0, "node": {"clip": {"name": "a"}}, "w": 1}]}}"#,
    ] {
        assert!(serde_json::from_str::<Node>(json).is_err(), "{json}");
    }
}

#[test]
fn nodes_are_not_nested_for_ever() {
    let nested = |depth: usize| {
        let clip = Node::Clip { name: "walk".into(), looped: true, speed: 1.0 };
        let select = |child, _| Node::Select { by: "x".into(), children: vec![child] };
        BlendTree::new(&(1..depth).fold(clip, select), &clips(), &skeleton(3))
    };
    assert!(nested(64).is_ok());
    assert_eq!(nested(65).unwrap_err().problem, TreeProblem::TooDeep);
    // Side by side is not inside each other.
    let clip = Node::Clip { name: "walk".into(), looped: true, speed: 1.0 };
    let many = Node::Select { by: "x".into(), children: vec![clip; 100] };
    assert!(BlendTree::new(&many, &clips(), &skeleton(3)).is_ok());
}
