//! From senses to motor speeds, and controllers as files.

use std::collections::BTreeMap;
use std::f32::consts::{FRAC_PI_2, PI};

use ambulo_body::{Body, Sensor};
use ambulo_net::{Activation, Bundle, BundleOf, Header, Layer, Mlp, Network, Normalisation};
use ambulo_net::{Precision, Weights};
use ambulo_pilot::{Pilot, PilotError, PilotFileError, Scaling, Senses, Settings, Version};
use serde_json::{Value, json};

const TETRAPOD: &str = include_str!("../../../../starters/creatures/tetrapod2.json");
const VERSIONS: [Version; 4] = [Version::V1_0, Version::V1_1, Version::V1_2, Version::V2_0];

/// A torso of 1 × 0.4 m on two legs of one part: 1 m long and 1 m high, its centre 0.8 m up.
fn biped() -> Body {
    let leg = |name: &str, x: f32| {
        json!({"name": name, "shape": {"capsule": {"length": 0.6, "radius": 0.1}},
            "position": [x, 0.4], "density": 40, "tags": ["leg"]})
    };
    let hip = |name: &str, x: f32, speed: f32| {
        json!({"name": name, "parent": "torso", "child": name, "anchor": [x, 0.7],
            "limits": [-1, 1], "torque": 100, "speed": speed})
    };
    let torso = json!({"name": "torso", "shape": {"box": {"width": 1, "height": 0.4}},
        "position": [0, 0.8], "density": 40, "tags": ["torso"]});
    let creature = json!({"format": 1, "name": "Biped",
        "parts": [torso, leg("a", -0.3), leg("b", 0.3)],
        "joints": [hip("a", -0.3, 8.0), hip("b", 0.3, 4.0)]});
    Body::parse(&creature.to_string()).unwrap()
}

fn tetrapod() -> Body {
    Body::parse(TETRAPOD).unwrap()
}

fn settings(json: Value) -> Settings {
    serde_json::from_value(json).unwrap()
}

fn version(version: Version) -> Settings {
    Settings { version, ..Settings::default() }
}

/// Genes in (-1, 1) that look random and are the same everywhere.
fn genome(count: usize) -> Vec<f32> {
    let mut state = 7_u32;
    let next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    std::iter::repeat_with(next).take(count).collect()
}

fn pilot(body: &Body, settings: &Settings) -> Pilot {
    Pilot::new(body, settings, &genome(Pilot::genes(body, settings).unwrap())).unwrap()
}

fn senses(body: &Body) -> Senses {
    Senses {
        time: 0.0,
        torso_rotation: 0.3,
        joint_angles: (0..body.driven().len()).map(|i| 0.2 * i as f32 - 0.7).collect(),
        joint_speeds: (0..body.driven().len()).map(|i| 3.0 - i as f32).collect(),
        foot_contacts: (0..body.legs().len()).map(|i| i % 2 == 0).collect(),
        height: 0.9,
        velocity: [1.2, -0.4],
        ground_rays: vec![0.1, 0.0, -0.2],
    }
}

fn steer(pilot: &Pilot, senses: &Senses) -> Vec<f32> {
    pilot.check(senses).unwrap();
    let mut commands = vec![f32::NAN; pilot.joints()];
    pilot.steer(senses, &mut commands, &mut pilot.scratch());
    commands
}

/// What the network is given: a layer that looks at one input after the other, undone.
fn inputs(body: &Body, settings: &Value, senses: &Senses) -> Vec<f32> {
    let weight = 1e-3;
    let mut settings = settings.clone();
    settings["hidden"] = json!([]);
    let settings = self::settings(settings);
    let width = Pilot::widths(body, &settings).unwrap()[0];
    let look = |input: usize| {
        let mut genome = vec![0.0; Pilot::genes(body, &settings).unwrap()];
        genome[input] = weight;
        let pilot = Pilot::new(body, &settings, &genome).unwrap();
        let sum = steer(&pilot, senses)[0].atanh();
        // 2 (logistic(a) - 1/2) = tanh(a/2).
        let half =
            if pilot.network().unwrap().activation() == Activation::Logistic { 2.0 } else { 1.0 };
        half * sum / weight
    };
    (0..width).map(look).collect()
}

#[track_caller]
fn assert_near(found: &[f32], expected: &[f32]) {
    let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(found.len() == expected.len() && off < 1e-3, "{found:?} is not {expected:?}");
}

#[test]
fn angles_are_scaled_from_half_a_turn_to_three() {
    let mut senses = senses(&biped());
    (senses.torso_rotation, senses.joint_angles) = (-FRAC_PI_2, vec![PI, -PI / 3.0]);
    assert_near(&inputs(&biped(), &json!({}), &senses), &[-1.5, 3.0, -1.0]);
}

#[test]
fn angles_of_the_first_version_are_0_to_360_degrees() {
    let mut senses = senses(&biped());
    (senses.torso_rotation, senses.joint_angles) = (-FRAC_PI_2, vec![PI, -PI / 180.0]);
    senses.foot_contacts = vec![true, false];
    for version in ["1.0", "1.1"] {
        let found = inputs(&biped(), &json!({"version": version}), &senses);
        assert_near(&found, &[270.0, 180.0, 359.0, 1.0, 0.0]);
    }
    (senses.torso_rotation, senses.joint_angles) = (0.0, vec![-0.0, FRAC_PI_2]);
    assert_near(&inputs(&biped(), &json!({"version": "1.0"}), &senses)[..3], &[0.0, 0.0, 90.0]);
}

#[test]
fn foot_contacts_are_plus_or_minus_three() {
    let mut senses = senses(&biped());
    let feet = json!({"sensors": ["foot_contacts"]});
    for (contacts, expected) in [([true, false], [3.0, -3.0]), ([false, true], [-3.0, 3.0])] {
        senses.foot_contacts = contacts.to_vec();
        assert_near(&inputs(&biped(), &feet, &senses), &expected);
    }
}

#[test]
fn other_senses_are_scaled_by_the_creature_and_held_within_three() {
    let mut senses = senses(&biped());
    let all = json!({"sensors": ["joint_speeds", "height", "velocity",
        {"ground_rays": {"count": 3, "reach": 2.0}}]});
    // Half of 8 rad/s, a quarter of 4; half its standing height up; a body length a second.
    senses.joint_speeds = vec![4.0, -1.0];
    (senses.height, senses.velocity) = (1.2, [1.0, -1.5]);
    senses.ground_rays = vec![0.4, -0.2, 0.0];
    let expected = [1.5, -0.75, 1.5, 1.0, -1.5, 1.5, -0.75, 0.0];
    assert_near(&inputs(&biped(), &all, &senses), &expected);
    senses.joint_speeds = vec![9.0, -40.0];
    (senses.height, senses.velocity) = (-7.0, [3.1, -1e30]);
    senses.ground_rays = vec![5.0, -5.0, 1e30];
    let expected = [3.0, -3.0, -3.0, 3.0, -3.0, 3.0, -3.0, 3.0];
    assert_near(&inputs(&biped(), &all, &senses), &expected);
}

#[test]
fn other_senses_in_degrees_are_plain_shares() {
    let mut senses = senses(&biped());
    (senses.joint_speeds, senses.height, senses.velocity) = (vec![4.0, -8.0], 1.6, [6.0, 0.0]);
    let some = json!({"version": "1.0", "sensors": ["velocity", "height", "joint_speeds"]});
    assert_near(&inputs(&biped(), &some, &senses), &[2.0, 0.0, 1.0, 0.5, -2.0]);
}

#[test]
fn versions_are_the_milestones_of_the_seed() {
    let cases: [(Version, &[usize], Activation, Scaling); 4] = [
        (Version::V1_0, &[13, 8, 8], Activation::Logistic, Scaling::Degrees),
        (Version::V1_1, &[13, 8, 8], Activation::Logistic, Scaling::Degrees),
        (Version::V1_2, &[13, 8, 8], Activation::Tanh, Scaling::Three),
        (Version::V2_0, &[9, 10, 8], Activation::Tanh, Scaling::Three),
    ];
    for (at, widths, activation, scaling) in cases {
        assert_eq!(Pilot::widths(&tetrapod(), &version(at)).unwrap(), widths, "{at:?}");
        let pilot = pilot(&tetrapod(), &version(at));
        assert_eq!(pilot.network().unwrap().activation(), activation, "{at:?}");
        assert_eq!(pilot.settings().scaling, Some(scaling), "{at:?}");
        let gain = if scaling == Scaling::Three { 3.0 } else { 1.0 };
        assert_eq!(pilot.network().unwrap().gain(), gain, "{at:?}");
    }
    assert_eq!(Settings::default().version, Version::V2_0);
}

#[test]
fn settings_override_the_version_one_by_one() {
    let json = json!({"version": "1.0", "hidden": [5, 6], "activation": "cheap_tanh",
        "sensors": ["height", "joint_angles"]});
    let pilot = pilot(&tetrapod(), &settings(json));
    assert_eq!(pilot.network().unwrap().widths(), [9, 5, 6, 8]);
    assert_eq!(pilot.network().unwrap().activation(), Activation::CheapTanh);
    assert_eq!(pilot.settings().scaling, Some(Scaling::Degrees));
    assert_eq!(pilot.sensors(), [Sensor::Height, Sensor::JointAngles]);
    // With everything said, it is the same controller.
    assert_eq!(&pilot.settings().resolved(&biped()), pilot.settings());
}

#[test]
fn early_versions_feel_their_feet_once() {
    let mut description = tetrapod().description().clone();
    description.sensors = vec![Sensor::FootContacts, Sensor::JointAngles];
    let body = Body::new(description).unwrap();
    assert_eq!(Pilot::widths(&body, &version(Version::V1_0)).unwrap(), [12, 8, 8]);
    assert_eq!(Pilot::widths(&body, &version(Version::V2_0)).unwrap(), [12, 10, 8]);
}

#[test]
fn commands_are_within_full_speed_whatever_the_genome() {
    let body = tetrapod();
    for json in [
        json!({"version": "1.0"}),
        json!({}),
        json!({"activation": "cheap_tanh"}),
        json!({"activation": "tanh", "scaling": "degrees"}),
        json!({"activation": "logistic"}),
    ] {
        let settings = settings(json);
        for scale in [0.1, 1.0, 100.0, 1e6] {
            let genes = genome(Pilot::genes(&body, &settings).unwrap());
            let genes: Vec<_> = genes.iter().map(|gene| gene * scale).collect();
            let pilot = Pilot::new(&body, &settings, &genes).unwrap();
            for command in steer(&pilot, &senses(&body)) {
                assert!((-1.0..=1.0).contains(&command), "{settings:?} {scale}: {command}");
            }
        }
    }
}

#[test]
fn a_genome_of_zeros_moves_nothing() {
    for at in VERSIONS {
        let zeros = vec![0.0; Pilot::genes(&tetrapod(), &version(at)).unwrap()];
        let pilot = Pilot::new(&tetrapod(), &version(at), &zeros).unwrap();
        // A logistic neuron gives a half: that is the middle.
        assert_eq!(steer(&pilot, &senses(&tetrapod())), [0.0; 8], "{at:?}");
    }
}

#[test]
fn logistic_outputs_reach_full_speed_both_ways() {
    let settings = settings(json!({"version": "1.0", "hidden": [], "sensors": ["height"]}));
    let pilot = Pilot::new(&biped(), &settings, &[0.0, 50.0, 0.0, -50.0]).unwrap();
    assert_near(&steer(&pilot, &senses(&biped())), &[1.0, -1.0]);
}

#[test]
fn driving_is_steering_times_the_fastest_turn_of_each_joint() {
    let body = biped();
    let pilot = pilot(&body, &Settings::default());
    assert_eq!(pilot.speeds(), [8.0, 4.0]);
    let commands = steer(&pilot, &senses(&body));
    let mut speeds = vec![0.0; 2];
    pilot.drive(&senses(&body), &mut speeds, &mut pilot.scratch());
    assert_eq!(speeds, [8.0 * commands[0], 4.0 * commands[1]]);
    assert!(commands[0] != commands[1] && commands.iter().all(|&command| command != 0.0));
}

#[test]
fn what_was_steered_before_does_not_count() {
    let (body, mut other) = (tetrapod(), senses(&tetrapod()));
    let pilot = pilot(&body, &Settings::default());
    other.torso_rotation = -2.0;
    let mut scratch = pilot.scratch();
    let mut commands = vec![0.0; 8];
    pilot.steer(&other, &mut commands, &mut scratch);
    pilot.steer(&senses(&body), &mut commands, &mut scratch);
    assert_eq!(commands, steer(&pilot, &senses(&body)));
}

#[test]
fn senses_that_lack_numbers_are_named() {
    let body = biped();
    let sensors = json!({"sensors": ["joint_angles", "joint_speeds", "foot_contacts", "height",
        {"ground_rays": {"count": 3, "reach": 2.0}}]});
    let pilot = pilot(&body, &settings(sensors));
    let refused = |change: fn(&mut Senses), expected: &str| {
        let mut senses = senses(&biped());
        change(&mut senses);
        assert_eq!(pilot.check(&senses).unwrap_err().to_string(), expected);
    };
    refused(|s| s.joint_angles.clear(), "joint_angles: 0 numbers, expected 2");
    refused(|s| s.joint_speeds.push(0.0), "joint_speeds: 3 numbers, expected 2");
    refused(|s| s.foot_contacts.truncate(1), "foot_contacts: 1 numbers, expected 2");
    refused(|s| s.ground_rays.truncate(2), "ground_rays: 2 numbers, expected 3");
    refused(|s| *s = Senses::default(), "joint_angles: 0 numbers, expected 2");
    assert_eq!(pilot.check(&senses(&body)), Ok(()));
    // What no sensor asks for may be missing.
    let angles = self::pilot(&body, &settings(json!({"sensors": ["joint_angles"]})));
    assert_eq!(angles.check(&Senses { joint_angles: vec![0.0; 2], ..Senses::default() }), Ok(()));
}

#[test]
fn controllers_that_cannot_be_made_are_refused() {
    let refused = |json: Value, expected: &str| {
        let error = Pilot::widths(&biped(), &settings(json)).unwrap_err();
        assert_eq!(error.to_string(), expected);
    };
    refused(json!({"hidden": [0]}), "controller.hidden: [0] is not up to 8 layers of 1 to 256");
    refused(json!({"hidden": [257]}), "controller.hidden: [257] is not up to 8 layers of 1 to 256");
    let nine = "controller.hidden: [1, 1, 1, 1, 1, 1, 1, 1, 1] is not up to 8 layers of 1 to 256";
    refused(json!({"hidden": [1, 1, 1, 1, 1, 1, 1, 1, 1]}), nine);
    let twice = json!({"sensors": ["foot_contacts", "height", "foot_contacts"]});
    refused(twice, "controller.sensors: foot_contacts is listed twice");
    let nothing = "controller.sensors: nothing to sense";
    refused(json!({"sensors": []}), nothing);
    let rays = |count: u32, reach: f32| json!({"ground_rays": {"count": count, "reach": reach}});
    for (count, reach, shown) in [(0, 1.0, "1"), (17, 1.0, "1"), (3, 0.0, "0"), (3, 51.0, "51")] {
        let rest = "expected 1 to 16 within 0.1 to 50 m";
        let expected = format!("controller.sensors: ground_rays: {count} within {shown} m; {rest}");
        refused(json!({"sensors": [rays(count, reach)]}), &expected);
    }
    assert!(serde_json::from_value::<Settings>(json!({"neurons": 3})).is_err());
    assert!(serde_json::from_value::<Settings>(json!({"version": "3.0"})).is_err());
}

/// Two lots of rays were taken where they differed, and then `steer` panicked: there is one list of
/// heights for both.
#[test]
fn rays_are_listed_once_however_they_differ() {
    let rays = |count: u32| Sensor::GroundRays { count, reach: 2.0 };
    let sensors = Some(vec![rays(3), rays(5)]);
    let error = Pilot::widths(&biped(), &Settings { sensors, ..Settings::default() }).unwrap_err();
    assert_eq!(error.to_string(), "controller.sensors: ground_rays is listed twice");
}

#[test]
fn a_creature_without_legs_or_driven_joints_is_told_so() {
    let mut description = biped().description().clone();
    description.parts[1..].iter_mut().for_each(|part| part.tags.clear());
    let apod = Body::new(description.clone()).unwrap();
    assert_eq!(Pilot::widths(&apod, &version(Version::V1_0)).unwrap(), [3, 8, 2]);
    let feet = Settings { sensors: Some(vec![Sensor::FootContacts]), ..Settings::default() };
    let nothing = |what: &str| Err(PilotError::Sensors(format!("nothing to {what}")));
    assert_eq!(Pilot::widths(&apod, &feet), nothing("sense"));
    description.parts[1..].iter_mut().for_each(|part| part.tags.push(ambulo_body::Tag::Ignored));
    let statue = Body::new(description).unwrap();
    assert_eq!(Pilot::widths(&statue, &Settings::default()), nothing("drive"));
}

#[test]
fn genomes_are_of_the_right_length_and_finite() {
    let refused = |genome: &[f32]| {
        Pilot::new(&biped(), &Settings::default(), genome).unwrap_err().to_string()
    };
    let mut genes = genome(Pilot::genes(&biped(), &Settings::default()).unwrap());
    assert_eq!(genes.len(), (3 + 1) * 10 + (10 + 1) * 2);
    assert_eq!(refused(&genes[1..]), "the genome: expected 62 numbers, got 61");
    genes[17] = f32::NAN;
    assert_eq!(refused(&genes), "the genome: number 17 is NaN, not finite");
}

fn words() -> BTreeMap<String, String> {
    BTreeMap::from([("tool".into(), "a test".into())])
}

fn bytes(pilot: &Pilot, body: &Body) -> Vec<u8> {
    let parts = BTreeMap::from([("search".into(), json!({"generations": 3}))]);
    pilot.to_bytes(body, 60.0, "CC0", words(), parts).unwrap()
}

#[test]
fn a_controller_survives_as_bytes() {
    for body in [biped(), tetrapod()] {
        for at in VERSIONS {
            let pilot = pilot(&body, &version(at));
            let bytes = bytes(&pilot, &body);
            let (again, same, header) = Pilot::from_bytes(&bytes).unwrap();
            assert_eq!((&again, &same), (&pilot, &body));
            assert_eq!((header.fps, header.licence.as_str()), (60.0, "CC0"));
            assert_eq!(
                (&header.provenance, &header.parts["search"]["generations"]),
                (&words(), &json!(3))
            );
            let bits = |pilot| steer(pilot, &senses(&body)).iter().map(|c| c.to_bits()).collect();
            let (before, after): (Vec<_>, Vec<_>) = (bits(&pilot), bits(&again));
            assert_eq!(before, after);
            let (provenance, parts) = (header.provenance, header.parts);
            let second = again.to_bytes(&same, header.fps, &header.licence, provenance, parts);
            assert_eq!(second.unwrap(), bytes);
        }
    }
}

#[test]
fn a_file_says_what_its_numbers_are() {
    let body = tetrapod();
    let (_, _, header) =
        Pilot::from_bytes(&bytes(&pilot(&body, &version(Version::V1_2)), &body)).unwrap();
    let blocks: Vec<_> = header.layout.inputs.iter().map(|(n, size)| (n.as_str(), *size)).collect();
    assert_eq!(blocks, [("torso_rotation", 1), ("joint_angles", 8), ("foot_contacts", 4)]);
    assert_eq!(header.layout.outputs, [("motor_speeds".into(), 8)]);
    assert_eq!(header.layout.hash, format!("{:016x}", body.hash()));
    assert_eq!(header.kind, "mlp");
}

#[test]
fn a_rate_that_is_none_cannot_be_written() {
    let pilot = pilot(&biped(), &Settings::default());
    for rate in [0.0, -60.0, f64::NAN] {
        let written = pilot.to_bytes(&biped(), rate, "", BTreeMap::new(), BTreeMap::new());
        assert_eq!(
            written.unwrap_err().to_string(),
            format!("fps must be positive and finite, not {rate}")
        );
    }
}

/// A controller's file with another header.
fn tampered(change: impl FnOnce(&mut Header)) -> Vec<u8> {
    let bytes = bytes(&pilot(&biped(), &Settings::default()), &biped());
    let bundle = BundleOf::<Mlp>::from_bytes(&bytes).unwrap();
    let mut header = bundle.header().clone();
    change(&mut header);
    let network = bundle.network().clone();
    BundleOf::new(header, network).unwrap().to_bytes(Precision::Single).unwrap()
}

fn refusal(change: impl FnOnce(&mut Header)) -> PilotFileError {
    Pilot::from_bytes(&tampered(change)).unwrap_err()
}

/// A value of a part of the header.
fn at<'a>(header: &'a mut Header, part: &str, pointer: &str) -> &'a mut Value {
    header.parts.get_mut(part).unwrap().pointer_mut(pointer).unwrap()
}

#[test]
fn the_file_is_read_when_nothing_is_changed() {
    assert!(Pilot::from_bytes(&tampered(|_| {})).is_ok());
}

#[test]
fn a_network_without_a_creature_is_no_controller() {
    for part in ["creature", "controller"] {
        let error = refusal(|header| drop(header.parts.remove(part)));
        let expected =
            format!("a network, but not a creature's controller: its header has no part '{part}'");
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn parts_of_another_shape_are_refused_by_name() {
    let error = refusal(|header| at(header, "controller", "")["extra"] = json!(1));
    assert!(error.to_string().starts_with("the header's part 'controller': unknown field `extra`"));
    let error = refusal(|header| *at(header, "creature", "/description/parts") = json!(7));
    assert!(error.to_string().starts_with("the header's part 'creature': invalid type"));
}

#[test]
fn a_creature_that_was_changed_is_refused() {
    let said = format!("{:016x}", biped().hash());
    let error = refusal(|h| *at(h, "creature", "/description/parts/1/density") = json!(41));
    let text = error.to_string();
    assert!(text.ends_with(&format!("the file says {said}: it was changed")), "{text}");
    assert!(
        matches!(error, PilotFileError::Hash { found, .. } if found != said && found.len() == 16)
    );
    let error = refusal(|h| *at(h, "creature", "/hash") = json!("0123"));
    assert!(matches!(error, PilotFileError::Hash { said, .. } if said == "0123"));
    // Another name is no other creature.
    let renamed = tampered(|h| *at(h, "creature", "/description/name") = json!("Ann"));
    assert_eq!(Pilot::from_bytes(&renamed).unwrap().1.description().name, "Ann");
}

#[test]
fn a_creature_that_is_none_is_refused_with_its_path() {
    let error = refusal(|h| *at(h, "creature", "/description/joints/0/torque") = json!(0));
    let path = "$.joints[0].torque: 0 is not above 0 and at most 100000 N·m";
    assert_eq!(error.to_string(), format!("the creature inside: {path}"));
}

#[test]
fn a_network_of_other_widths_is_refused() {
    let error = refusal(|h| *at(h, "controller", "/hidden") = json!([9]));
    let text =
        "the network has widths [3, 10, 2], but such a controller of this creature [3, 9, 2]";
    assert_eq!(error.to_string(), text);
    let error =
        refusal(|h| *at(h, "controller", "/sensors") = json!(["height", "velocity", "height"]));
    assert_eq!(error.to_string(), "controller.sensors: height is listed twice");
}

#[test]
fn another_activation_or_gain_is_refused() {
    for (setting, value) in [("activation", "cheap_tanh"), ("scaling", "degrees")] {
        let error = refusal(|h| at(h, "controller", "")[setting] = json!(value));
        assert!(matches!(error, PilotFileError::Activation), "{setting}: {error}");
    }
}

/// Names and order of the blocks were not looked at as long as their sizes summed up.
#[test]
fn a_layout_of_another_order_is_refused() {
    let error = refusal(|header| header.layout.inputs.reverse());
    assert!(matches!(error, PilotFileError::Layout { .. }), "{error}");
    let error = refusal(|header| header.layout.hash = "0".into());
    assert!(matches!(error, PilotFileError::Layout { .. }), "{error}");
    let same = refusal(|h| *at(h, "controller", "/sensors") = json!(["joint_angles", "height"]));
    assert!(matches!(same, PilotFileError::Layout { .. }), "{same}");
}

/// The header of a controller on a network of another kind.
fn of_another_kind() -> Vec<u8> {
    let mut header = Pilot::from_bytes(&tampered(|_| {})).unwrap().2;
    (header.kind, header.activation) = ("pfnn".into(), "elu".into());
    let (inputs, outputs) = (3, 2);
    let layer = Layer::new(0, inputs, outputs, &[0.5; 24], &[0.5; 8]).unwrap();
    let normalisation = Normalisation {
        input_mean: vec![0.0; inputs],
        input_std: vec![1.0; inputs],
        output_mean: vec![0.0; outputs],
        output_std: vec![1.0; outputs],
    };
    let network = Network::new(vec![layer], normalisation).unwrap();
    Bundle::new(header, network).unwrap().to_bytes(Precision::Single).unwrap()
}

#[test]
fn other_files_are_no_controllers() {
    let refused = |bytes: &[u8]| Pilot::from_bytes(bytes).unwrap_err().to_string();
    assert_eq!(refused(&of_another_kind()), "kind 'pfnn' is not known; expected 'mlp'");
    assert!(refused(b"").starts_with("not a safetensors file: "));
    assert!(refused(TETRAPOD.as_bytes()).starts_with("not a safetensors file: "));
    let whole = tampered(|_| {});
    assert!(refused(&whole[..whole.len() - 1]).starts_with("not a safetensors file: "));
    assert_eq!(Mlp::KIND, "mlp");
}

#[test]
fn bytes_that_are_nearly_right_do_no_harm() {
    let whole = tampered(|_| {});
    for index in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[index] ^= 1 << (index % 8);
        if let Ok((pilot, body, _)) = Pilot::from_bytes(&bytes) {
            steer(&pilot, &senses(&body));
        }
    }
}

/// A champion replays exactly only where these bits are the same on every machine.
#[test]
fn commands_are_the_same_bits_everywhere() {
    let all = json!(["torso_rotation", "joint_angles", "joint_speeds", "foot_contacts", "height",
        "velocity", {"ground_rays": {"count": 3, "reach": 2.0}}]);
    let golden = [
        (json!({"version": "1.0"}), [0xbe31_d06c, 0x3d8c_20b0]),
        (json!({"version": "1.2"}), [0xbf2d_082e, 0x3ec3_9443]),
        (json!({"version": "2.0"}), [0x3e22_8df0, 0x3e92_49cc]),
        (
            json!({"sensors": all, "hidden": [7, 5], "activation": "cheap_tanh"}),
            [0xbe70_31e8, 0xbef5_2804],
        ),
    ];
    for (make, expected) in golden {
        let settings = settings(make.clone());
        let genome = genome(Pilot::genes(&biped(), &settings).unwrap());
        // Small, so that no neuron is at its end, where bits no longer differ.
        let genome: Vec<_> = genome.iter().map(|gene| 0.25 * gene).collect();
        let pilot = Pilot::new(&biped(), &settings, &genome).unwrap();
        let commands = steer(&pilot, &senses(&biped()));
        let bits: Vec<_> = commands.iter().map(|command| command.to_bits()).collect();
        assert_eq!(bits, expected, "{make}: {commands:?} {bits:x?}");
    }
}
