//! From a manifest to shards.

use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use ambulo_features::{Block, Layout};
use ambulo_rig::{Axes, HeightField, Terrain};
use serde::Serialize;
use serde_json::{Value, json};

use crate::body::Body;
use crate::compare::compare;
use crate::filter::stretches;
use crate::gait::CATEGORIES;
use crate::ground::{Ground, Kind, Soles};
use crate::manifest::{ClipEntry, Manifest, Split, TerrainSource};
use crate::motion::Fitting;
use crate::patches::Patches;
use crate::phase::cycle_starts;
use crate::prepare::{LabelFiles, Ready, Setup, reference_skeleton};
use crate::random::{Random, fingerprint};
use crate::rows::{Encoder, LEADING};
use crate::shard::{Moments, ShardInfo, ShardWriter, file_size, write_whole};
use crate::work::run;
use crate::{DatasetError, Load, Progress};

/// Version of the index.
pub const DATASET_FORMAT: u32 = 1;
/// Part of every shard's key, as the package's version is: another number builds all shards anew.
/// Count it up whenever rows change.
const BUILDER: u32 = 2;
/// Ground is fitted to stretches of at most this long, seconds.
const LONGEST_FIT: f32 = 3.0;
/// Frames around a stretch whose feet count for its ground, as published.
const FIT_PADDING: usize = 60;

/// What came of a build.
#[derive(Clone, Debug, Serialize)]
pub struct Built {
    /// Shards that were written.
    pub written: usize,
    /// Shards that were there already.
    pub kept: usize,
    /// Clips without a row, with the reason.
    pub empty: Vec<String>,
    /// Rows for training and for validation.
    pub rows: [usize; 2],
}

/// Everything that a job needs.
struct Builder<'a> {
    folder: &'a Path,
    manifest: &'a Manifest,
    setup: Setup,
    patches: Option<Patches>,
    load: &'a Load<'a>,
    settings_key: u64,
}

/// One shard to be.
struct Shard {
    name: String,
    entry: usize,
    mirrored: bool,
}

/// Builds what is missing or no longer right in a folder, then writes its index, `dataset.json`.
///
/// # Errors
/// A clip that does not fit (the others stay built), a full disk, or a wish to stop.
pub fn build(
    folder: &Path,
    manifest: &Manifest,
    load: &Load<'_>,
    threads: usize,
    progress: &Progress<'_>,
) -> Result<Built, DatasetError> {
    let shards_folder = folder.join("shards");
    let io_error = |path: &Path| {
        let path = path.to_owned();
        move |error: io::Error| DatasetError::Io(path, error)
    };
    for made in [&shards_folder, &folder.join("labels")] {
        std::fs::create_dir_all(made).map_err(io_error(made))?;
    }
    let setup = setup(folder, manifest, load)?;
    let patches = patches(folder, manifest)?;
    let settings_key = settings_key(folder, manifest, &setup)?;
    let builder = Builder { folder, manifest, setup, patches, load, settings_key };
    let entries: Vec<usize> = (0..manifest.clips.len()).collect();
    let size =
        |entry: &ClipEntry| std::fs::metadata(folder.join(&entry.file)).map_or(1, |d| d.len());
    let weights: Vec<f64> = manifest.clips.iter().map(|entry| size(entry) as f64 + 1.0).collect();
    let built = run(&entries, &weights, threads, progress, |&entry| builder.entry(entry))?;
    let built: Vec<(Shard, ShardInfo, bool)> = built.into_iter().flatten().collect();
    let index = builder.index(&built)?;
    let index_file = folder.join("dataset.json");
    write_whole(&index_file, index.to_string().as_bytes()).map_err(io_error(&index_file))?;
    sweep(&shards_folder, &built).map_err(io_error(&shards_folder))?;
    let rows = |split: Split| {
        let of = built.iter().filter(|(shard, ..)| manifest.clips[shard.entry].split == split);
        of.map(|(_, info, _)| info.rows).sum()
    };
    let written = built.iter().filter(|(.., fresh)| *fresh).count();
    let bare = built.iter().filter(|(_, info, _)| info.rows == 0);
    Ok(Built {
        written,
        kept: built.len() - written,
        empty: bare.map(|(shard, ..)| shard.name.clone()).collect(),
        rows: [rows(Split::Training), rows(Split::Validation)],
    })
}

/// What all clips of a manifest share.
///
/// # Errors
/// A reference clip that is missing or does not have the roles.
pub fn setup(folder: &Path, manifest: &Manifest, load: &Load<'_>) -> Result<Setup, DatasetError> {
    let reference = manifest.clips.iter().find(|clip| clip.name == manifest.reference);
    let reference = reference.or(manifest.clips.first()).ok_or_else(|| {
        DatasetError::Manifest("the manifest names no clip; give motion files to build from".into())
    })?;
    let file = folder.join(&reference.file);
    let clip_error = |reason: String| DatasetError::Clip { file: file.clone(), reason };
    let loaded = load(&file).map_err(clip_error)?;
    let axes = Axes::named(&reference.axes).map_err(|e| clip_error(e.to_string()))?;
    let fitting = Fitting { axes, hips: &manifest.roles.hips, drop: &manifest.drop, fps: 60.0 };
    let skeleton = reference_skeleton(&loaded.clip, &fitting).map_err(clip_error)?;
    Body::new(&manifest.roles, &skeleton).map_err(clip_error)?;
    let layout = Layout::named(&manifest.layout, skeleton.len());
    let layout = layout.map_err(|error| DatasetError::Manifest(error.to_string()))?;
    let heights = <[f32; 4]>::try_from(&manifest.foot_heights[..]);
    Ok(Setup {
        layout,
        skeleton,
        roles: manifest.roles.clone(),
        drop: manifest.drop.clone(),
        foot_heights: heights.unwrap_or([0.09, 0.02, 0.09, 0.02]),
        contacts: manifest.contacts.clone(),
        gaits: manifest.gaits.clone(),
    })
}

fn patches(folder: &Path, manifest: &Manifest) -> Result<Option<Patches>, DatasetError> {
    let terrain = &manifest.terrain;
    match terrain.source {
        TerrainSource::Flat => Ok(None),
        TerrainSource::Noise => Ok(Some(Patches::from_noise(terrain.patches, manifest.seed))),
        TerrainSource::Files => {
            let mut maps = vec![];
            for file in &terrain.files {
                let path = folder.join(file);
                let text = std::fs::read_to_string(&path);
                let text = text.map_err(|error| DatasetError::Io(path.clone(), error))?;
                let map = HeightField::from_text(&text, terrain.cell, terrain.scale);
                maps.push(map.map_err(|error| DatasetError::Clip {
                    file: path,
                    reason: error.to_string(),
                })?);
            }
            let patches = Patches::from_maps(&maps, manifest.seed);
            if patches.is_empty() {
                let why = "terrain.files give no patch: name height maps that are not too steep";
                return Err(DatasetError::Manifest(why.into()));
            }
            Ok(Some(patches))
        }
    }
}

/// Fingerprint of everything that all shards depend on; what only says which shards there are, or
/// what else is written about them, is left out.
fn settings_key(folder: &Path, manifest: &Manifest, setup: &Setup) -> Result<u64, DatasetError> {
    let neutral = Manifest {
        clips: vec![],
        licence: String::new(),
        reference: String::new(),
        axes: String::new(),
        mirror: true,
        validation: 0.0,
        ..manifest.clone()
    };
    let mut text = neutral.to_text()?;
    let version = env!("CARGO_PKG_VERSION");
    text += &format!("{BUILDER} {version} {} {:?}", setup.layout.hash(), setup.skeleton);
    let mut bytes = text.into_bytes();
    for file in &manifest.terrain.files {
        bytes.extend(std::fs::read(folder.join(file)).unwrap_or_default());
    }
    Ok(fingerprint(&bytes))
}

impl Builder<'_> {
    fn mirrors(&self, entry: &ClipEntry) -> bool {
        entry.mirror.unwrap_or(self.manifest.mirror)
    }

    /// Builds the shards of one clip, or finds them built.
    fn entry(&self, index: usize) -> Result<Vec<(Shard, ShardInfo, bool)>, DatasetError> {
        let entry = &self.manifest.clips[index];
        let file = self.folder.join(&entry.file);
        let clip_error = |reason: String| DatasetError::Clip { file: file.clone(), reason };
        let own = self.folder.join("labels").join(format!("{}.txt", entry.name));
        let labels = LabelFiles::read(&file, &own).map_err(clip_error)?;
        let bytes = std::fs::read(&file).map_err(|e| DatasetError::Io(file.clone(), e))?;
        let mut key = fingerprint(&bytes) ^ fingerprint(&labels.bytes).rotate_left(17);
        drop(bytes);
        let neutral = ClipEntry {
            split: Split::Training,
            take: String::new(),
            mirror: None,
            ..entry.clone()
        };
        let described = serde_json::to_string(&neutral).expect("an entry is plain data");
        key ^=
            fingerprint(described.as_bytes()).rotate_left(31) ^ self.settings_key.rotate_left(47);
        let ways = if self.mirrors(entry) { &[false, true][..] } else { &[false][..] };
        let mut shards = vec![];
        let mut fitted = None;
        for &mirrored in ways {
            let name =
                if mirrored { format!("{}.mirrored", entry.name) } else { entry.name.clone() };
            let shard = Shard { name, entry: index, mirrored };
            let key = format!("{:016x}", key ^ u64::from(mirrored));
            if let Some(info) = self.found(&shard, &key) {
                shards.push((shard, without_moments(info), false));
                continue;
            }
            if fitted.is_none() {
                let loaded = (self.load)(&file).map_err(clip_error)?;
                let clip = self.setup.fit(&loaded.clip, &entry.axes, entry.from, entry.to);
                fitted = Some((clip.map_err(clip_error)?, loaded.clip.fps()));
            }
            let (clip, fps) = fitted.as_ref().expect("just fitted");
            let ready = self.setup.label(clip, *fps, mirrored, &labels).map_err(clip_error)?;
            let info = self.write(&shard, key, &ready);
            let info = info.map_err(|e| DatasetError::Io(file.clone(), e))?;
            shards.push((shard, without_moments(info), true));
        }
        Ok(shards)
    }

    fn paths(&self, shard: &Shard) -> [PathBuf; 2] {
        let shards = self.folder.join("shards");
        [".npy", ".json"].map(|end| shards.join(format!("{}{end}", shard.name)))
    }

    /// A shard that is there and still right.
    fn found(&self, shard: &Shard, key: &str) -> Option<ShardInfo> {
        let [rows, info] = self.paths(shard);
        let info: ShardInfo = serde_json::from_slice(&std::fs::read(info).ok()?).ok()?;
        let size = file_size(info.rows, Encoder::width(&self.setup.layout));
        let there = std::fs::metadata(rows).is_ok_and(|data| data.len() == size);
        (info.key == key && there).then_some(info)
    }

    fn write(&self, shard: &Shard, key: String, ready: &Ready) -> io::Result<ShardInfo> {
        let (motion, labels, layout) = (&ready.motion, &ready.labels, &self.setup.layout);
        let entry = &self.manifest.clips[shard.entry];
        let body = Body::new(&self.setup.roles, &self.setup.skeleton).map_err(io::Error::other)?;
        let kind = self.kind(entry, labels.contacts.level);
        let mut encoder = Encoder::new(layout, ready, &body, kind == Kind::Flat);
        let usable = |frame: usize| encoder.reaches(frame) && labels.usable[frame];
        let spans = self.spans(kind, ready, usable);
        let copies = if kind == Kind::Flat && layout.name() != "holden" {
            1
        } else {
            self.manifest.terrain.copies
        };
        let rows = copies * spans.iter().map(Range::len).sum::<usize>();
        let width = Encoder::width(layout);
        let [rows_file, info_file] = self.paths(shard);
        // What speaks of the old rows goes before they do: whoever is stopped from here on finds
        // nothing that claims to be right.
        forget(&self.folder.join("dataset.json"))?;
        forget(&info_file)?;
        let mut writer = ShardWriter::create(&rows_file, rows, width)?;
        let mut info = ShardInfo {
            key,
            rows,
            runs: vec![],
            categories: [0; CATEGORIES.len()],
            frames: motion.frames(),
            unusable: (0..motion.frames()).filter(|&frame| !labels.usable[frame]).count(),
            repeated_steps: labels.repeats,
            contact_confidence: mean(&labels.contacts.confidence),
            gait_confidence: mean(&labels.gaits.confidence),
            ground_gap: 0.0,
            level: kind == Kind::Flat,
            agreement: ready.automatic.as_ref().map(|(auto, what)| compare(labels, auto, *what)),
            moments: Moments::default(),
        };
        let mut row = vec![0.0; width];
        let mut first = 0;
        for span in spans {
            let soles = self.soles(ready, &body, &span);
            let mut random =
                Random::new(self.manifest.seed, &format!("{} {}", shard.name, span.start));
            let grounds = match (kind, &self.patches) {
                // A level floor lies at height zero: the motion was moved there.
                (Kind::Flat, _) if layout.name() != "holden" => vec![Ground::Flat(0.0)],
                (Kind::Flat, _) | (_, None) => vec![Ground::Flat(soles.level()); copies],
                (kind, Some(patches)) => soles.fit(patches, kind, copies, &mut random),
            };
            for ground in &grounds {
                if !matches!(ground, Ground::Flat(_)) {
                    info.ground_gap = info.ground_gap.max(soles.gap(ground));
                }
                for frame in span.clone() {
                    encoder.encode(frame, ground, &mut row);
                    writer.write(&row)?;
                    info.moments.add(&row[LEADING..]);
                    info.categories[usize::from(labels.gaits.categories[frame])] += 1;
                }
                info.runs.push((first, span.len()));
                first += span.len();
            }
        }
        writer.finish()?;
        if !shard.mirrored {
            let file = self.folder.join("labels").join(format!("{}.auto.txt", entry.name));
            let found = ready.automatic.as_ref().map_or(labels, |(automatic, _)| automatic);
            write_whole(&file, found.to_text(motion.fps()).as_bytes())?;
        }
        write_whole(&info_file, &serde_json::to_vec(&info).map_err(io::Error::other)?)?;
        Ok(info)
    }

    fn kind(&self, entry: &ClipEntry, level: bool) -> Kind {
        let found = if level || self.patches.is_none() { Kind::Flat } else { Kind::Rocky };
        let published =
            if self.setup.layout.name() == "holden" { Kind::published(&entry.name) } else { None };
        entry.ground.or(published).unwrap_or(found)
    }

    /// Stretches of usable frames that share one ground: all of them on a level floor, gait cycles
    /// elsewhere.
    fn spans(
        &self,
        kind: Kind,
        ready: &Ready,
        usable: impl Fn(usize) -> bool,
    ) -> Vec<Range<usize>> {
        let frames = ready.motion.frames();
        let whole = stretches(frames, usable);
        if kind == Kind::Flat && self.setup.layout.name() != "holden" {
            return whole;
        }
        let starts = cycle_starts(&ready.labels.phase);
        let longest = (LONGEST_FIT * ready.motion.fps()) as usize;
        let mut spans = vec![];
        for stretch in whole {
            let mut start = stretch.start;
            for frame in stretch.clone().skip(1) {
                if starts.contains(&frame) || frame - start >= longest {
                    spans.push(start..frame);
                    start = frame;
                }
            }
            spans.push(start..stretch.end);
        }
        spans
    }

    fn soles(&self, ready: &Ready, body: &Body, span: &Range<usize>) -> Soles {
        let padded = span.start.saturating_sub(FIT_PADDING)
            ..(span.end + FIT_PADDING).min(ready.motion.frames());
        let (contacts, heights) = (&ready.labels.contacts, self.setup.foot_heights);
        Soles::gather(&ready.motion, contacts, body.soles(), heights, padded, body.hips)
    }

    fn index(&self, built: &[(Shard, ShardInfo, bool)]) -> Result<Value, DatasetError> {
        let layout = &self.setup.layout;
        let table = |blocks: &[Block]| -> Vec<(&str, usize)> {
            blocks.iter().map(|block| (block.name, block.range.len())).collect()
        };
        let mut moments = Moments::default();
        for (shard, info, _) in built {
            if self.manifest.clips[shard.entry].split == Split::Training && info.rows > 0 {
                let gone = || io::Error::other("somebody changed it while the index was written");
                let again = self.found(shard, &info.key).ok_or_else(gone);
                let [rows, _] = self.paths(shard);
                moments.merge(&again.map_err(|e| DatasetError::Io(rows, e))?.moments);
            }
        }
        if moments.rows == 0 {
            return Err(DatasetError::NoClips(
                "  no training clip has a usable row: too short, or no steps were found in it"
                    .into(),
            ));
        }
        let deviations = moments.deviations();
        let (inputs, outputs) = (layout.input_len(), layout.output_len());
        let clips: Vec<Value> = built.iter().map(|built| self.describe(built)).collect();
        let body =
            Body::new(&self.setup.roles, &self.setup.skeleton).map_err(DatasetError::Manifest)?;
        let licence = match self.manifest.licence.trim() {
            "" => "not stated by whoever built the data set",
            licence => licence,
        };
        Ok(json!({
            "format": DATASET_FORMAT,
            "layout": {
                "name": layout.name(),
                "hash": layout.hash(),
                "inputs": table(layout.inputs()),
                "outputs": table(layout.outputs()),
            },
            "fps": layout.fps(),
            "parts": {
                "skeleton": self.setup.skeleton,
                "feet": { "joints": body.soles(), "heights": self.setup.foot_heights },
                "roles": self.setup.roles,
                "labels": {
                    "drop": self.setup.drop,
                    "contacts": self.setup.contacts,
                    "gaits": self.setup.gaits,
                },
            },
            "licence": licence,
            "provenance": { "clips": self.manifest.clips.len().to_string() },
            "categories": CATEGORIES,
            "columns": [
                ["phase", 1], ["category", 1], ["root", 4], ["input", inputs], ["output", outputs],
            ],
            "clips": clips,
            "statistics": {
                "rows": moments.rows,
                "input_mean": moments.mean[..inputs],
                "input_std": deviations[..inputs],
                "output_mean": moments.mean[inputs..],
                "output_std": deviations[inputs..],
            },
        }))
    }

    fn describe(&self, (shard, info, _): &(Shard, ShardInfo, bool)) -> Value {
        let entry = &self.manifest.clips[shard.entry];
        json!({
            "name": shard.name,
            "file": format!("shards/{}.npy", shard.name),
            "source": entry.file,
            "take": entry.take,
            "mirrored": shard.mirrored,
            "split": entry.split,
            "rows": info.rows,
            "runs": info.runs,
            "categories": info.categories,
            "frames": info.frames,
            "unusable": info.unusable,
            "repeated_steps": info.repeated_steps,
            "contact_confidence": info.contact_confidence,
            "gait_confidence": info.gait_confidence,
            "ground_gap": info.ground_gap,
            "level": info.level,
            "agreement": info.agreement,
        })
    }
}

/// Ten kilobytes a shard are too much to keep for all of them: the index reads them once more.
fn without_moments(info: ShardInfo) -> ShardInfo {
    ShardInfo { moments: Moments::default(), ..info }
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len().max(1) as f32
}

/// Removes a file that may not be there.
fn forget(file: &Path) -> io::Result<()> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Removes files of clips that the manifest no longer names, and unfinished ones.
fn sweep(folder: &Path, built: &[(Shard, ShardInfo, bool)]) -> io::Result<()> {
    let known: std::collections::HashSet<String> = built
        .iter()
        .flat_map(|(shard, ..)| [".npy", ".json"].map(|end| format!("{}{end}", shard.name)))
        .collect();
    for file in std::fs::read_dir(folder)? {
        let file = file?;
        let name = file.file_name().to_string_lossy().into_owned();
        let ours = [".npy", ".json", ".part"].iter().any(|end| name.ends_with(end));
        if ours && !known.contains(&name) {
            std::fs::remove_file(file.path())?;
        }
    }
    Ok(())
}

impl Soles {
    /// Largest distance of a standing sole from the ground under it, metres.
    fn gap(&self, ground: &impl Terrain) -> f32 {
        let gap =
            |point: &ambulo_rig::glam::Vec3| (ground.height(point.x, point.z) - point.y).abs();
        self.standing().iter().map(gap).fold(0.0, f32::max)
    }
}
