//! Anything that people may write or record: refused or taken, never a panic, never a number that
//! is none.

mod common;

use ambulo_dataset::prepare::LabelFiles;
use ambulo_dataset::rows::encode_clip;
use ambulo_dataset::{ClipEntry, Given, Kind, Manifest, Published, Split, TerrainSource};
use ambulo_rig::Clip;
use ambulo_rig::glam::{DQuat, DVec3};
use common::{Folder, JOINTS, setup, skeleton};
use proptest::prelude::*;

fn words() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        Just("step".to_owned()),
        Just("gait".to_owned()),
        Just("skip".to_owned()),
        Just("left".to_owned()),
        Just("right".to_owned()),
        Just("walk".to_owned()),
        Just("*".to_owned()),
        Just("#".to_owned()),
        Just("\n".to_owned()),
        Just("[terrain]\n".to_owned()),
        Just("[[clip]]\n".to_owned()),
        Just("name =".to_owned()),
        Just("\"a\"\n".to_owned()),
        (-2.0f64..1e7).prop_map(|number| number.to_string()),
        "\\PC{0,6}",
    ];
    prop::collection::vec(word, 0..40).prop_map(|words| words.join(" "))
}

fn entry() -> impl Strategy<Value = ClipEntry> {
    let times = (prop::option::of(0.0..5.0f64), prop::option::of(5.5..99.0f64));
    let ways = (any::<bool>(), prop::option::of(any::<bool>()), 0usize..5);
    ("[a-zA-Z0-9]{1,8}", times, ways).prop_map(|(take, (from, to), (held, mirror, kind))| {
        let kinds = [Kind::Flat, Kind::Rocky, Kind::Jumpy, Kind::Beam];
        ClipEntry {
            name: String::new(),
            file: format!("../{take}.bvh").into(),
            take,
            split: if held { Split::Validation } else { Split::Training },
            axes: "cm".into(),
            from,
            to,
            mirror,
            ground: kinds.get(kind).copied(),
        }
    })
}

fn manifest() -> impl Strategy<Value = Manifest> {
    let numbers = (0u64..1 << 40, 0.0..0.9f64, 0.01..3.0f32, 1usize..9);
    (prop::collection::vec(entry(), 0..6), numbers, "\\PC{0,20}", any::<bool>()).prop_map(
        |(mut clips, (seed, validation, speed, copies), licence, mirror)| {
            for (index, clip) in clips.iter_mut().enumerate() {
                clip.name = format!("{} {index}", clip.take);
                clip.take = clip.name.clone();
            }
            let mut manifest =
                Manifest { clips, seed, validation, licence, mirror, ..Manifest::default() };
            manifest.contacts.speed = speed;
            manifest.terrain.copies = copies;
            manifest.terrain.source = TerrainSource::Flat;
            manifest
        },
    )
}

/// Seconds of random motion: places and turns that need not look like anything.
fn motion() -> impl Strategy<Value = Clip> {
    let frame = prop::collection::vec(-3.0..3.0f64, 3 + 3 * JOINTS);
    let calm = prop_oneof![Just(0.0), Just(0.02), Just(1.0)];
    (prop::collection::vec(frame, 3..9), 30usize..300, calm).prop_map(|(keys, frames, calm)| {
        let (mut translations, mut rotations) = (vec![], vec![]);
        for frame in 0..frames {
            // From key to key, so that it holds still and jumps as recordings do.
            let at = frame as f64 / frames as f64 * (keys.len() - 1) as f64;
            let (key, share) = (at as usize, at.fract() * calm);
            let number = |i: usize| keys[key][i] * (1.0 - share) + keys[key + 1][i] * share;
            translations.push(DVec3::new(number(0), number(1), number(2)));
            for joint in 0..JOINTS {
                let turn = DVec3::new(number(3 + joint), number(4 + joint), number(5 + joint));
                rotations.push(DQuat::from_scaled_axis(turn * calm));
            }
        }
        Clip::new(skeleton(), 1.0 / 60.0, vec![0], translations, rotations).unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn manifests_survive_as_text(manifest in manifest()) {
        let text = manifest.to_text().unwrap();
        prop_assert_eq!(Manifest::parse(&text).unwrap(), manifest);
    }

    #[test]
    fn any_text_is_read_or_refused(text in words()) {
        if let Ok(manifest) = Manifest::parse(&text) {
            prop_assert_eq!(Manifest::parse(&manifest.to_text().unwrap()).unwrap(), manifest);
        }
        if let Ok(given) = Given::parse(&text) {
            let later = given.from(1.0);
            prop_assert!(later.steps.iter().all(|step| step.0 >= 0.0));
            prop_assert_eq!(given.gaits(100, 60.0).len(), 100);
        }
        let _ = Published::parse_phase(&text);
        let _ = Published::parse_gaits(&text);
        let _ = Published::parse_footsteps(&text);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn random_motion_has_finite_rows(clip in motion(), labels in words(), mirror: bool) {
        let files = LabelFiles { given: Given::parse(&labels).ok(), ..LabelFiles::default() };
        for layout in ["ambulo", "holden"] {
            let setup = setup(layout);
            let fitted = setup.fit(&clip, "ambulo", None, None).unwrap();
            let ready = setup.label(&fitted, 60.0, mirror, &files).unwrap();
            if let Ok(rows) = encode_clip(&setup, &ready) {
                prop_assert!(rows.rows.iter().all(|number| number.is_finite()));
                for row in rows.rows.chunks(rows.width) {
                    prop_assert!((0.0..1.0).contains(&row[0]) && (0.0..8.0).contains(&row[1]));
                }
            }
        }
    }

    #[test]
    fn random_motion_is_planned_and_built(clip in motion(), seed in 0u64..100) {
        let mut folder = Folder::new();
        folder.add("random", clip);
        let mut settings = Manifest { seed, validation: 0.0, ..Manifest::default() };
        settings.terrain.patches = 20;
        // Too short, no steps: refused in words. Whatever is built holds numbers.
        let Ok(planned) = folder.plan(&settings) else { return Ok(()) };
        if folder.build(&planned.manifest, 2).is_ok() {
            for shard in ["random", "random.mirrored"] {
                prop_assert!(folder.rows(shard).iter().flatten().all(|number| number.is_finite()));
            }
            prop_assert_eq!(folder.build(&planned.manifest, 1).unwrap().written, 0);
        }
    }
}
