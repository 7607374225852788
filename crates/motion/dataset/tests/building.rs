//! Whole data sets in a folder: planned, built, built again, interrupted.

mod common;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use ambulo_dataset::build::build;
use ambulo_dataset::{DatasetError, Kind, Manifest, Split, TerrainSource};
use ambulo_rig::{Clip, Skeleton};
use common::{BACKWARD, Folder, JOG, ROUGH, RUN, STAND, WALK, Walker, skeleton};

fn settings() -> Manifest {
    let mut settings = Manifest { licence: "made by a test".into(), ..Manifest::default() };
    settings.terrain.patches = 40;
    settings
}

/// Four recordings of six clips, one of them on rough ground.
fn folder() -> Folder {
    Folder::with(&[
        ("jog_1", JOG),
        ("jog_2", Walker { heading: 2.0, turn: 0.4, ..JOG }),
        ("rough", ROUGH),
        ("run", Walker { seconds: 5.0, ..RUN }),
        ("walk_1", WALK),
        ("walk_2", Walker { turn: -0.4, ..WALK }),
    ])
}

/// Names of the files that a change wrote anew or removed.
fn changed(before: &[(String, u64)], after: &[(String, u64)]) -> Vec<String> {
    let gone = before.iter().filter(|file| !after.contains(file)).map(|(name, _)| name);
    let new = after.iter().filter(|file| !before.contains(file)).map(|(name, _)| name);
    let mut names: Vec<String> = gone.chain(new).cloned().collect();
    names.sort();
    names.dedup();
    names
}

#[track_caller]
fn assert_same(before: &[(String, u64)], after: &[(String, u64)]) {
    assert_eq!(changed(before, after), Vec::<String>::new(), "these files differ");
}

#[test]
fn bytes_do_not_depend_on_threads_and_nothing_is_written_twice() {
    let folders = [1, 2, 5].map(|threads| {
        let folder = folder();
        let manifest = folder.manifest(&settings());
        let built = folder.build(&manifest, threads).unwrap();
        assert_eq!((built.written, built.kept), (12, 0));
        (folder, manifest)
    });
    let bytes = folders.each_ref().map(|(folder, _)| folder.bytes());
    // A dozen shards with their notes, labels of six clips, the index.
    assert_eq!(bytes[0].len(), 24 + 6 + 1);
    assert_same(&bytes[0], &bytes[1]);
    assert_same(&bytes[0], &bytes[2]);
    let (folder, manifest) = &folders[0];
    let again = folder.build(manifest, 2).unwrap();
    assert_eq!((again.written, again.kept), (0, 12));
    assert_same(&folder.bytes(), &bytes[0]);
}

#[test]
fn the_index_says_what_the_shards_hold() {
    let folder = folder();
    let manifest = Manifest { validation: 0.25, ..settings() };
    let manifest = folder.manifest(&manifest);
    let built = folder.build(&manifest, 2).unwrap();
    let index = folder.index();
    assert_eq!(index["licence"], "made by a test");
    assert_eq!(index["layout"]["name"], "ambulo");
    let mut rows = [0, 0];
    let (mut sum, mut count) = (vec![], 0.0f64);
    for clip in index["clips"].as_array().unwrap() {
        let shard = folder.rows(clip["name"].as_str().unwrap());
        assert_eq!(clip["rows"], shard.len());
        let runs: Vec<(usize, usize)> = serde_json::from_value(clip["runs"].clone()).unwrap();
        assert_eq!(runs.iter().map(|run| run.1).sum::<usize>(), shard.len());
        for (first, length) in runs {
            // Consecutive frames: the phase goes on by at most a fifth of a cycle.
            for pair in shard[first..first + length].windows(2) {
                let on = (pair[1][0] - pair[0][0]).rem_euclid(1.0);
                assert!(on < 0.2, "phase jumps from {} to {}", pair[0][0], pair[1][0]);
            }
        }
        let mut categories = vec![0; 8];
        shard.iter().for_each(|row| categories[row[1] as usize] += 1);
        assert_eq!(clip["categories"], serde_json::json!(categories));
        assert!(shard.iter().flatten().all(|number| number.is_finite()));
        let validation = clip["split"] == "validation";
        rows[usize::from(validation)] += shard.len();
        if !validation {
            sum.resize(shard[0].len() - 6, 0.0f64);
            for row in &shard {
                sum.iter_mut().zip(&row[6..]).for_each(|(s, x)| *s += f64::from(*x));
            }
            count += shard.len() as f64;
        }
    }
    assert_eq!(built.rows, rows);
    assert!(rows[0] > 0 && rows[1] > 0);
    let mean = |side: &str| -> Vec<f64> {
        serde_json::from_value(index["statistics"][side].clone()).unwrap()
    };
    let means: Vec<f64> = [mean("input_mean"), mean("output_mean")].concat();
    assert_eq!(means.len(), sum.len());
    for (mean, sum) in means.iter().zip(&sum) {
        assert!((mean - sum / count).abs() < 1e-6);
    }
}

#[test]
fn a_take_is_on_one_side() {
    let walkers: Vec<(String, Walker)> = (0..24)
        .map(|i| (format!("walk{}_subject{}_{i}", i / 8, i % 4), Walker { seconds: 3.0, ..WALK }))
        .collect();
    let named: Vec<(&str, Walker)> = walkers.iter().map(|(n, w)| (n.as_str(), *w)).collect();
    let mut folder = Folder::with(&named);
    folder.add("walk0_subject0_0_mirror", WALK.clip());
    for seed in 0..20 {
        let settings = Manifest { seed, validation: 0.3, mirror: false, ..settings() };
        let manifest = folder.manifest(&settings);
        let held = |split: Split| manifest.clips.iter().filter(move |clip| clip.split == split);
        assert!(held(Split::Validation).count() >= 2);
        for clip in held(Split::Validation) {
            assert!(held(Split::Training).all(|other| other.take != clip.take));
        }
        assert_eq!(folder.manifest(&settings), manifest, "planning is a matter of the seed alone");
    }
}

#[test]
fn only_what_is_affected_is_built_anew() {
    let folder = folder();
    let manifest = folder.manifest(&settings());
    folder.build(&manifest, 2).unwrap();
    let before = folder.bytes();
    let write = |text: &str| std::fs::write(folder.path.join("labels/jog_1.txt"), text).unwrap();

    write("skip 3 4");
    let built = folder.build(&manifest, 2).unwrap();
    assert_eq!((built.written, built.kept), (2, 10));
    let labelled = folder.bytes();
    let names = changed(&before, &labelled);
    let shards: Vec<_> = names.iter().filter(|name| name.ends_with(".npy")).collect();
    assert_eq!(shards, ["shards/jog_1.mirrored.npy", "shards/jog_1.npy"]);

    // Back to where it was, and the same bytes again.
    std::fs::remove_file(folder.path.join("labels/jog_1.txt")).unwrap();
    assert_eq!(folder.build(&manifest, 2).unwrap().written, 2);
    assert_same(&folder.bytes(), &before);

    let mut cut = manifest.clone();
    cut.clips[0].to = Some(6.0);
    assert_eq!(folder.build(&cut, 2).unwrap().written, 2);
    let mut gaits = cut.clone();
    gaits.gaits.jog = 2.0;
    assert_eq!(folder.build(&gaits, 2).unwrap().written, 12);

    // What says nothing about rows writes none: the other side, the licence, no mirror images.
    let mut said = gaits.clone();
    said.licence = "another".into();
    said.axes = "cm".into();
    said.clips.iter_mut().for_each(|clip| clip.split = Split::Training);
    said.mirror = false;
    let built = folder.build(&said, 2).unwrap();
    assert_eq!((built.written, built.kept), (0, 6));
    assert_eq!(folder.index()["licence"], "another");
    assert!(!folder.path.join("shards/run.mirrored.npy").exists(), "nobody names it any more");
    // A clip that is named no more goes, and the others stay.
    said.clips.pop();
    assert_eq!(folder.build(&said, 2).unwrap().kept, 5);
    assert!(!folder.path.join("shards/walk_2.npy").exists());
}

/// A changed recording, and settings that only the ground depends on.
#[test]
fn recordings_and_grounds_count() {
    let mut folder = folder();
    let manifest = folder.manifest(&settings());
    folder.build(&manifest, 2).unwrap();
    folder.add("run", Walker { seconds: 6.0, ..RUN }.clip());
    assert_eq!(folder.build(&manifest, 2).unwrap().written, 2);
    let mut flat = manifest.clone();
    flat.clips[2].ground = Some(Kind::Flat);
    assert_eq!(folder.build(&flat, 2).unwrap().written, 2);
    flat.terrain.source = TerrainSource::Flat;
    assert!(folder.build(&flat, 2).unwrap().written > 0);
}

/// A shard's description and the index go before its rows do: rows of other settings must never be
/// found under a description that fits the settings of before.
#[test]
fn a_rebuild_that_fails_leaves_nothing_that_claims_to_be_right() {
    let folder = folder();
    let manifest = folder.manifest(&settings());
    folder.build(&manifest, 1).unwrap();
    let wanted = folder.bytes();
    let mut other = manifest.clone();
    other.gaits.walk = 0.4;
    let name = &manifest.clips[0].name;
    let rows = folder.path.join("shards").join(format!("{name}.npy"));
    // Where the new rows should go lies a folder: the build stops in the middle of a shard.
    std::fs::remove_file(&rows).unwrap();
    std::fs::create_dir(&rows).unwrap();
    assert!(folder.build(&other, 1).is_err());
    assert!(!folder.path.join("dataset.json").exists());
    assert!(!rows.with_extension("json").exists());
    std::fs::remove_dir(&rows).unwrap();
    folder.build(&manifest, 1).unwrap();
    assert_same(&folder.bytes(), &wanted);
}

#[test]
fn interrupting_loses_nothing() {
    let whole = folder();
    let manifest = whole.manifest(&settings());
    whole.build(&manifest, 2).unwrap();
    let wanted = whole.bytes();
    for jobs in 1..=6 {
        for threads in [1, 2] {
            let folder = folder();
            let told = AtomicUsize::new(0);
            let progress = |_| told.fetch_add(1, Ordering::Relaxed) + 1 < jobs;
            let load = |path: &Path| folder.load(path);
            let stopped = build(&folder.path, &manifest, &load, threads, &progress);
            match stopped {
                Err(DatasetError::Stopped) => {
                    assert!(!folder.path.join("dataset.json").exists());
                }
                // Told to stop after the last job: there was nothing left to stop.
                other => assert!(other.is_ok() && jobs + threads > 6, "{jobs}, {threads}"),
            }
            let built = folder.build(&manifest, threads).unwrap();
            assert!(built.kept >= 2 * jobs, "{built:?} after {jobs} jobs");
            assert_same(&folder.bytes(), &wanted);
        }
    }
}

/// What a process leaves behind that was killed while it wrote, or a disk that was full.
#[test]
fn broken_shards_are_built_again() {
    let folder = folder();
    let manifest = folder.manifest(&settings());
    folder.build(&manifest, 2).unwrap();
    let wanted = folder.bytes();
    let shard = |name: &str| folder.path.join("shards").join(name);
    let cut = |name: &str| {
        let bytes = std::fs::read(shard(name)).unwrap();
        std::fs::write(shard(name), &bytes[..bytes.len() - 100]).unwrap();
    };
    cut("jog_1.npy");
    cut("run.json");
    std::fs::remove_file(shard("walk_1.npy")).unwrap();
    std::fs::remove_file(shard("walk_2.mirrored.json")).unwrap();
    for stray in ["jog_2.part", "rough.json.part", "nobody.npy", "nobody.json"] {
        std::fs::write(shard(stray), "half a shard").unwrap();
    }
    std::fs::write(folder.path.join("dataset.json.part"), "{").unwrap();
    let built = folder.build(&manifest, 2).unwrap();
    assert_eq!((built.written, built.kept), (4, 8));
    assert_same(&folder.bytes(), &wanted);
}

/// The key of a shard has the builder's number and the package's version in it: what another
/// version wrote is not taken.
#[test]
fn shards_of_another_version_are_built_again() {
    let folder = Folder::with(&[("walk", WALK)]);
    let manifest = folder.manifest(&settings());
    folder.build(&manifest, 1).unwrap();
    let path = folder.path.join("shards/walk.json");
    let mut info: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    info["key"] = "0123456789abcdef".into();
    std::fs::write(&path, info.to_string()).unwrap();
    assert_eq!(folder.build(&manifest, 1).unwrap().written, 1);
}

/// Numbers of a known clip. If rows are meant to change: count `BUILDER` in src/build.rs up, so
/// that nobody keeps old shards, and write the new numbers here.
#[test]
fn rows_change_only_with_the_builders_number() {
    let folder = Folder::with(&[("rough", ROUGH), ("walk", Walker { turn: 0.3, ..WALK })]);
    let told = ["ambulo", "holden"].map(|layout| {
        let settings = Manifest { layout: layout.into(), seed: 5, validation: 0.0, ..settings() };
        let manifest = folder.manifest(&settings);
        folder.build(&manifest, 2).unwrap();
        ["rough", "walk.mirrored"].map(|name| {
            let rows = folder.rows(name);
            // Sizes, not signs: sums over all numbers of one row in fifty.
            let sums = rows.iter().step_by(50).map(|row| row.iter().map(|x| x.abs()).sum::<f32>());
            (rows.len(), sums.sum::<f32>())
        })
    });
    let wanted = GOLDEN;
    for (told, wanted) in told.iter().flatten().zip(wanted.iter().flatten()) {
        assert_eq!(told.0, wanted.0);
        // Other machines' sines differ in their last bits.
        assert!((told.1 / wanted.1 - 1.0).abs() < 1e-4, "{told:?} is not {wanted:?}");
    }
}

const GOLDEN: [[(usize, f32); 2]; 2] =
    [[(718, 2153.9136), (359, 1157.6688)], [(718, 57080.348), (718, 55131.797)]];

#[test]
fn what_does_not_fit_is_named_with_its_reason() {
    let mut folder = folder();
    folder.add("short", Walker { seconds: 1.5, ..WALK }.clip());
    std::fs::write(folder.file("broken"), "HIERARCHI").unwrap();
    let mut joints = skeleton().joints().to_vec();
    joints.pop();
    let other = Skeleton::new(joints).unwrap();
    let walk = WALK.clip();
    let frames = 0..walk.frames();
    let translations = frames.clone().flat_map(|f| walk.translations(f).to_vec()).collect();
    let rotations = frames.flat_map(|f| walk.rotations(f)[..12].to_vec()).collect();
    let headless = Clip::new(other, 1.0 / 60.0, walk.moving().into(), translations, rotations);
    folder.add("headless", headless.unwrap());
    let planned = folder.plan(&settings()).unwrap();
    let said = |name: &str| {
        let found = planned.skipped.iter().find(|(file, _)| file.file_stem().unwrap() == name);
        found.map(|(_, reason)| reason.as_str()).unwrap_or_default()
    };
    assert_eq!(planned.manifest.clips.len(), 6);
    assert!(said("short").starts_with("1.48 s are too short"), "{}", said("short"));
    assert!(said("broken").contains("expected HIERARCHY"));
    assert!(said("headless").contains("not that of most other files"));
    // The same in a manifest that somebody wrote.
    for (name, reason) in [
        ("headless", "no joint 'Head'"),
        ("broken", "expected HIERARCHY"),
        ("missing", "No such file"),
    ] {
        let mut manifest = planned.manifest.clone();
        manifest.clips[1].file = folder.file(name);
        let error = folder.build(&manifest, 2).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(reason), "{error}");
    }
    // Too short for a row, but not wrong.
    let mut manifest = planned.manifest.clone();
    manifest.clips[1].file = folder.file("short");
    assert_eq!(folder.build(&manifest, 2).unwrap().empty, ["jog_2", "jog_2.mirrored"]);
}

#[test]
fn nothing_usable_is_an_error_that_lists_why() {
    let mut folder = Folder::new();
    folder.add("short", Walker { seconds: 1.0, ..WALK }.clip());
    let error = folder.plan(&settings()).unwrap_err().to_string();
    assert!(error.contains("short.bvh: 0.98 s are too short"), "{error}");
    let error = folder.build(&settings(), 1).unwrap_err().to_string();
    assert!(error.contains("names no clip"), "{error}");
}

#[test]
fn names_stay_apart() {
    let mut folder = Folder::with(&[("walk", WALK), ("walk.mirrored", JOG), ("walk.auto", RUN)]);
    folder.add("Walk", STAND.clip());
    folder.add("walk-2", BACKWARD.clip());
    let manifest = folder.manifest(&Manifest { mirror: false, ..settings() });
    let names: Vec<&str> = manifest.clips.iter().map(|clip| clip.name.as_str()).collect();
    assert_eq!(names, ["Walk", "walk-2", "walk_auto", "walk-3", "walk_mirrored"]);
    Manifest::parse(&manifest.to_text().unwrap()).unwrap();
}

/// People of two sizes: all rows are on one skeleton.
#[test]
fn sizes_are_brought_to_the_references() {
    let mut folder = Folder::with(&[("a_grown", WALK)]);
    folder.add("child", WALK.clip().scaled(0.7));
    let manifest = folder.manifest(&settings());
    folder.build(&manifest, 2).unwrap();
    let height = |name: &str| {
        let rows = folder.rows(name);
        let first = 6 + 120 + 36 + 1;
        rows.iter().map(|row| row[first]).sum::<f32>() / rows.len() as f32
    };
    assert!((height("a_grown") - height("child")).abs() < 0.02);
}
