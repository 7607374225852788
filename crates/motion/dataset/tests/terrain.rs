//! Ground under clips that were not captured on a level floor.

mod common;

use ambulo_dataset::{Kind, Manifest, TerrainSource};
use ambulo_features::{Input, Layout};
use common::{Folder, HEEL, JOINTS, ROUGH, STAND, WALK};

fn settings(layout: &str) -> Manifest {
    let mut settings = Manifest { layout: layout.into(), validation: 0.0, ..Manifest::default() };
    settings.terrain.patches = 60;
    settings.foot_heights = vec![0.09, 0.02, 0.09, 0.02];
    settings
}

fn inputs(layout: &str, rows: &[Vec<f32>]) -> Vec<Input> {
    let layout = Layout::named(layout, JOINTS).unwrap();
    let decode = |row: &Vec<f32>| {
        let mut input = Input::zero(JOINTS);
        layout.decode_input(&row[6..][..layout.input_len()], &mut input);
        input
    };
    rows.iter().map(decode).collect()
}

#[test]
fn it_meets_standing_feet() {
    for layout in ["ambulo", "holden"] {
        let folder = Folder::with(&[("rough", ROUGH), ("walk", WALK)]);
        let manifest = folder.manifest(&settings(layout));
        folder.build(&manifest, 2).unwrap();
        let clips = folder.index()["clips"].clone();
        let clip = |name: &str| {
            clips.as_array().unwrap().iter().find(|clip| clip["name"] == name).unwrap().clone()
        };
        let rough = clip("rough");
        assert_eq!(rough["level"], false);
        let gap = rough["ground_gap"].as_f64().unwrap();
        assert!(gap > 0.0 && gap <= 0.01, "{layout}: {gap} m");
        assert_eq!(clip("walk")["level"], true);
        // Every cycle is there once for each copy of its ground.
        let frames = rough["rows"].as_u64().unwrap();
        assert_eq!(frames % manifest.terrain.copies as u64, 0);
    }
}

/// The heights of a row are those of the ground that the walker was made on, near its feet.
#[test]
fn its_heights_are_those_walked_on() {
    let folder = Folder::with(&[("rough", ROUGH)]);
    folder.build(&folder.manifest(&settings("ambulo")), 2).unwrap();
    let rows = folder.rows("rough");
    let mut off = vec![];
    for (row, input) in rows.iter().zip(inputs("ambulo", &rows)) {
        let [x, height, z] = [row[2], row[3], row[4]];
        let ground = (ROUGH.ground)(f64::from(x), f64::from(z)) as f32;
        off.push((height + input.ground[6].height[1] - ground).abs());
        let sum: f32 = input.ground.iter().map(|ground| ground.height[1]).sum();
        assert!(sum.abs() < 1e-3, "heights are counted from their mean");
    }
    off.sort_by(f32::total_cmp);
    let median = off[off.len() / 2];
    assert!(median < 0.05, "the ground under the hips is {median} m off");
}

#[test]
fn level_clips_lie_at_height_zero() {
    let folder = Folder::with(&[("stand", STAND), ("walk", WALK)]);
    folder.build(&folder.manifest(&settings("ambulo")), 2).unwrap();
    for name in ["stand", "walk"] {
        let rows = folder.rows(name);
        assert!(rows.iter().all(|row| row[3] == 0.0));
        let inputs = inputs("ambulo", &rows);
        let lowest = inputs.iter().flat_map(|i| [i.joint_position[3].y, i.joint_position[7].y]);
        let lowest = lowest.fold(f32::INFINITY, f32::min);
        assert!((f64::from(lowest) - HEEL).abs() < 0.01, "{lowest}");
    }
}

#[test]
fn a_clip_may_say_what_it_was_captured_on() {
    let folder = Folder::with(&[("rough", ROUGH), ("walk", WALK)]);
    let mut manifest = folder.manifest(&settings("ambulo"));
    for kind in [Kind::Jumpy, Kind::Beam, Kind::Rocky] {
        manifest.clips[1].ground = Some(kind);
        folder.build(&manifest, 2).unwrap();
        let rows = folder.rows("walk");
        let heights = inputs("ambulo", &rows);
        assert!(heights.iter().any(|input| input.ground[0].height[1].abs() > 0.001), "{kind:?}");
    }
    manifest.terrain.source = TerrainSource::Flat;
    folder.build(&manifest, 2).unwrap();
    assert!(folder.index()["clips"].as_array().unwrap().iter().all(|c| c["ground_gap"] == 0.0));
}

#[test]
fn height_maps_are_cut_or_refused() {
    let folder = Folder::with(&[("rough", ROUGH)]);
    let mut settings = settings("holden");
    settings.terrain.source = TerrainSource::Files;
    settings.terrain.files = vec!["map.txt".into()];
    let manifest = folder.manifest(&settings);
    let map = folder.path.join("map.txt");
    let error = folder.build(&manifest, 1).unwrap_err().to_string();
    assert!(error.contains("map.txt"), "{error}");
    std::fs::write(&map, "1 2\n3 x\n").unwrap();
    let error = folder.build(&manifest, 1).unwrap_err().to_string();
    assert!(error.contains("map.txt") && error.contains("row 2, column 2"), "{error}");
    let line = |r: usize| {
        let height = |c: usize| format!("{:.3}", 5.0 * ((r * c) as f64 * 1e-3).sin());
        (0..120).map(height).collect::<Vec<_>>().join(" ")
    };
    std::fs::write(&map, (0..120).map(line).collect::<Vec<_>>().join("\n")).unwrap();
    let built = folder.build(&manifest, 2).unwrap();
    assert_eq!(built.written, 2);
    let gap = folder.index()["clips"][0]["ground_gap"].as_f64().unwrap();
    assert!(gap > 0.0 && gap <= 0.01, "{gap}");
    // Another map is another ground.
    std::fs::write(&map, (1..121).map(line).collect::<Vec<_>>().join("\n")).unwrap();
    assert_eq!(folder.build(&manifest, 2).unwrap().written, 2);
}
