//! Looking at motion files before anything is built: a manifest that a person can read and edit.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use ambulo_features::Layout;
use ambulo_rig::{Axes, Clip, Roles};

use crate::body::{Body, RoleNames};
use crate::contacts::Contacts;
use crate::filter::quantile;
use crate::manifest::{ClipEntry, Manifest, Split};
use crate::motion::{Fitting, Motion};
use crate::random::fingerprint;
use crate::work::run;
use crate::{DatasetError, Load, Progress};

/// A stander's ankle and ball of the foot, where a recording does not tell; metres.
const USUAL_HEIGHTS: [f32; 4] = [0.09, 0.02, 0.09, 0.02];
/// What the PFNN's authors take both for; their layout means ground that lies so far below.
const PUBLISHED_HEIGHTS: [f32; 4] = [0.05, 0.04, 0.05, 0.04];
/// What mirrored files are called, beside the ones that they mirror.
const MIRRORED: [&str; 2] = ["_mirrored", "_mirror"];

/// A manifest, and what should be said about it.
#[derive(Clone, Debug)]
pub struct Planned {
    /// To be written and edited.
    pub manifest: Manifest,
    /// Files that are left out, each with the reason and what to do.
    pub skipped: Vec<(PathBuf, String)>,
}

/// What one file is found to be.
struct Seen {
    axes: String,
    tree: u64,
    seconds: f64,
    roles: RoleNames,
    level: bool,
    floors: [f32; 4],
}

/// Looks at files and describes a data set of them; `settings` is a manifest without clips.
///
/// Names of clips are the files' own; paths are relative to `folder` where they can be.
///
/// # Errors
/// No file that can be used (why, file by file), or a wish to stop.
pub fn plan(
    files: &[PathBuf],
    folder: &Path,
    settings: &Manifest,
    load: &Load<'_>,
    threads: usize,
    progress: &Progress<'_>,
) -> Result<Planned, DatasetError> {
    let mut manifest = settings.clone();
    let fps = Layout::named(&settings.layout, 1).map_or(60.0, |layout| f64::from(layout.fps()));
    let (files, mut skipped) = without_mirrors(files, settings.mirror);
    let weights: Vec<f64> = files.iter().map(|file| size(file)).collect();
    let look = |file: &PathBuf| Ok(look(file, settings, fps, load));
    let seen = run(&files, &weights, threads, progress, look)?;
    let mut usable: Vec<(&PathBuf, Seen)> = vec![];
    for (file, seen) in files.iter().zip(seen) {
        match seen {
            Ok(seen) => usable.push((file, seen)),
            Err(reason) => skipped.push((file.clone(), reason)),
        }
    }
    // The skeleton that most of the recorded time has.
    let mut time: HashMap<u64, f64> = HashMap::new();
    usable.iter().for_each(|(_, seen)| *time.entry(seen.tree).or_default() += seen.seconds);
    let named = |(file, _): &&(&PathBuf, Seen)| stem(file) == settings.reference;
    let wanted = usable.iter().find(named).map(|(_, seen)| seen.tree);
    let commonest = || {
        let first = |tree: &u64| usable.iter().position(|(_, seen)| seen.tree == *tree);
        let longer = |a: &(&u64, &f64), b: &(&u64, &f64)| {
            a.1.total_cmp(b.1).then(first(b.0).cmp(&first(a.0)))
        };
        time.iter().max_by(longer).map(|(tree, _)| *tree)
    };
    let tree = wanted.or_else(commonest);
    let (kept, others): (Vec<_>, Vec<_>) =
        usable.into_iter().partition(|(_, seen)| Some(seen.tree) == tree);
    let reason =
        "its skeleton is not that of most other files: build a data set of its own from it";
    skipped.extend(others.iter().map(|(file, _)| ((*file).clone(), reason.to_owned())));
    skipped.sort();
    let Some((first, seen)) = kept.first() else {
        return Err(DatasetError::NoClips(listed(&skipped)));
    };
    manifest.roles = seen.roles.clone();
    if manifest.reference.is_empty() {
        manifest.reference = stem(first);
    }
    if manifest.foot_heights.is_empty() {
        let published = settings.layout == "holden";
        let heights = if published { PUBLISHED_HEIGHTS } else { foot_heights(&kept) };
        manifest.foot_heights = heights.to_vec();
    }
    manifest.clips = entries(&kept, folder, &manifest);
    Ok(Planned { manifest, skipped })
}

/// Files that are another one mirrored go, if every clip is mirrored anyway.
fn without_mirrors(files: &[PathBuf], mirror: bool) -> (Vec<PathBuf>, Vec<(PathBuf, String)>) {
    let (mut kept, mut skipped) = (vec![], vec![]);
    for file in files {
        let name = stem(file);
        let base = MIRRORED.iter().find_map(|end| name.strip_suffix(end));
        match base.filter(|base| mirror && files.iter().any(|other| stem(other) == *base)) {
            Some(base) => skipped.push((file.clone(), format!("{base} is mirrored already"))),
            None => kept.push(file.clone()),
        }
    }
    (kept, skipped)
}

/// Reasons, one a line.
pub fn listed(skipped: &[(PathBuf, String)]) -> String {
    let line = |(file, reason): &(PathBuf, String)| format!("  {}: {reason}", file.display());
    skipped.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn size(file: &Path) -> f64 {
    std::fs::metadata(file).map_or(1.0, |data| data.len() as f64 + 1.0)
}

/// A file's name without its ending.
fn stem(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |c: char| if c.is_alphanumeric() || "-_. +".contains(c) { c } else { '_' };
    let mut name: String = stem.trim_start_matches('.').chars().map(plain).collect();
    // These endings are given to other files of the data set.
    if let Some(at) = name.rfind('.').filter(|&at| [".auto", ".mirrored"].contains(&&name[at..])) {
        name.replace_range(at..=at, "_");
    }
    if name.is_empty() { "clip".into() } else { name }
}

fn look(file: &Path, settings: &Manifest, fps: f64, load: &Load<'_>) -> Result<Seen, String> {
    let loaded = load(file)?;
    let axes = if settings.axes.is_empty() {
        loaded.axes.map_err(|why| {
            format!(
                "{why}; if you know better, name its axes in a --config file: axes = \"ambulo\" \
                 (metres, Y up, Z ahead), \"cm\" or another that `motion convert --help` lists"
            )
        })?
    } else {
        settings.axes.clone()
    };
    let clip = loaded.clip;
    let up = Axes::named(&axes).map_err(|e| e.to_string())?;
    let found = settings.roles.found_in(clip.skeleton());
    let by_name = Roles::by_name(clip.skeleton());
    let found = found.or(by_name).or(Roles::by_shape(&clip, up.up.vector()));
    let roles = RoleNames::of(&hips_below_roots(found, &clip), clip.skeleton())?;
    let fitting = Fitting { axes: up, hips: &roles.hips, drop: &settings.drop, fps };
    let fitted = fitting.fit(&clip)?;
    if fitted.frames() < 2 * ambulo_features::WINDOW + 2 {
        let seconds = fitted.duration();
        return Err(format!(
            "{seconds:.2} s are too short: a row needs a second before and after it"
        ));
    }
    let body = Body::new(&roles, fitted.skeleton())?;
    let motion = Motion::new(&fitted, &body);
    let contacts = Contacts::find(&motion, &body, &settings.contacts);
    let (tree, seconds) = (tree_of(&fitted), clip.duration());
    Ok(Seen { axes, tree, seconds, roles, level: contacts.level, floors: contacts.floors })
}

/// The joint called root is not the hips if the legs hang on a joint below it.
fn hips_below_roots(mut roles: Roles, clip: &Clip) -> Roles {
    let Some([left, right]) = roles.thighs else { return roles };
    let joints = clip.skeleton().joints();
    let above = |joint: usize| {
        let parent = |&joint: &usize| joints[joint].parent;
        std::iter::successors(Some(joint), parent).skip(1).collect::<Vec<_>>()
    };
    let (left, right) = (above(left), above(right));
    let common = left.iter().copied().find(|joint| right.contains(joint));
    let named_below = roles.hips.is_some_and(|hips| common.is_some_and(|c| hips > c));
    if !named_below && common.is_some_and(|common| Some(common) != roles.hips) {
        roles.hips = common;
    }
    roles
}

fn tree_of(clip: &Clip) -> u64 {
    let joints = clip.skeleton().joints().iter();
    let text: String = joints.map(|j| format!("{}<{:?};", j.name, j.parent)).collect();
    fingerprint(text.as_bytes())
}

/// Medians over the clips on level ground.
fn foot_heights(kept: &[(&PathBuf, Seen)]) -> [f32; 4] {
    std::array::from_fn(|sole| {
        let level = kept.iter().filter(|(_, seen)| seen.level);
        let median = quantile(level.map(|(_, seen)| seen.floors[sole]).collect(), 0.5);
        let height = median.filter(|height| (0.0..0.25).contains(height));
        (height.unwrap_or(USUAL_HEIGHTS[sole]) * 1000.0).round() / 1000.0
    })
}

/// Recording that a file is cut from, by its name: up to a `subject` or `take` with its number, else
/// without trailing numbers. Its mirror image is of the same recording.
fn take(name: &str) -> String {
    let name = MIRRORED.iter().find_map(|end| name.strip_suffix(end)).unwrap_or(name);
    let lower = name.to_ascii_lowercase();
    for mark in ["subject", "take"] {
        if let Some(end) = lower.find(mark).map(|at| at + mark.len()) {
            let digits = lower[end..].bytes().take_while(u8::is_ascii_digit).count();
            if digits > 0 {
                return name[..end + digits].into();
            }
        }
    }
    let base = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let base = base.trim_end_matches(['_', '-', ' ', '.']);
    // Names that are numbers only ('02_01'): every file is a take.
    if base.chars().any(char::is_alphabetic) { base.into() } else { name.into() }
}

fn entries(kept: &[(&PathBuf, Seen)], folder: &Path, manifest: &Manifest) -> Vec<ClipEntry> {
    let takes: Vec<String> = kept.iter().map(|(file, _)| take(&stem(file))).collect();
    let held = validation(&takes, kept, manifest);
    let mut used = HashSet::new();
    let mut unused = |name: String| {
        let numbered = (2..).map(|number| format!("{name}-{number}"));
        let mut names = std::iter::once(name.clone()).chain(numbered);
        names.find(|name| used.insert(name.to_lowercase())).expect("numbers do not end")
    };
    let entry = |((file, seen), take): (&(&PathBuf, Seen), &String)| {
        let name = unused(stem(file));
        let split = if held.contains(take) { Split::Validation } else { Split::Training };
        let (take, axes) = (take.clone(), seen.axes.clone());
        let file = relative(file, folder);
        ClipEntry {
            name,
            file,
            take,
            split,
            axes,
            from: None,
            to: None,
            mirror: None,
            ground: None,
        }
    };
    kept.iter().zip(&takes).map(entry).collect()
}

/// Takes for validation: in an order that the seed decides, as long as they fit into the share.
fn validation(takes: &[String], kept: &[(&PathBuf, Seen)], manifest: &Manifest) -> Vec<String> {
    // In an order of its own: a sum must not depend on chance.
    let mut seconds: BTreeMap<&String, f64> = BTreeMap::new();
    for (take, (_, seen)) in takes.iter().zip(kept) {
        *seconds.entry(take).or_default() += seen.seconds;
    }
    let wanted = manifest.validation * seconds.values().sum::<f64>();
    let place = |take: &String| fingerprint(format!("{} {take}", manifest.seed).as_bytes());
    let mut order: Vec<(&String, f64)> = seconds.into_iter().collect();
    order.sort_by_key(|(take, _)| (place(take), (*take).clone()));
    let (mut held, mut sum, count) = (vec![], 0.0, order.len());
    for (take, seconds) in order {
        if held.len() + 1 < count && sum + seconds <= 1.25 * wanted && sum < wanted {
            sum += seconds;
            held.push(take.clone());
        }
    }
    held
}

/// A path as seen from a folder, if they share a beginning.
fn relative(file: &Path, folder: &Path) -> PathBuf {
    let absolute = |path: &Path| {
        let found = path.canonicalize().or_else(|_| std::path::absolute(path));
        found.unwrap_or_else(|_| path.into())
    };
    let (file, folder) = (absolute(file), absolute(folder));
    let shared = file.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    // Nothing but the root in common: a relative path would be longer and say less.
    if shared <= 1 {
        return file;
    }
    let up = folder.components().skip(shared).map(|_| "..");
    up.map(PathBuf::from)
        .chain(file.components().skip(shared).map(|c| PathBuf::from(c.as_os_str())))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_by_name() {
        for (name, expected) in [
            ("walk1_subject1_walk2", "walk1_subject1"),
            ("pushAndFall1_subject4_stand", "pushAndFall1_subject4"),
            // Trailing numbers go once: the recording's own number stays.
            ("LocomotionFlat04_000", "LocomotionFlat04"),
            ("dataset-2_walk-turn-left_normal_001", "dataset-2_walk-turn-left_normal"),
            ("02_01", "02_01"),
            ("dog", "dog"),
            ("LocomotionFlat04_000_mirror", "LocomotionFlat04"),
            ("größe_Subject2_b", "größe_Subject2"),
            ("mistake_by_a_subject_03", "mistake_by_a_subject"),
        ] {
            assert_eq!(take(name), expected, "{name}");
        }
    }

    #[test]
    fn paths_are_seen_from_the_manifest() {
        let seen = |file: &str, folder: &str| relative(Path::new(file), Path::new(folder));
        assert_eq!(seen("/a/b/c.bvh", "/a/d"), Path::new("../b/c.bvh"));
        assert_eq!(seen("/a/c.bvh", "/a"), Path::new("c.bvh"));
        assert_eq!(seen("/x/c.bvh", "/a"), Path::new("/x/c.bvh"));
    }
}
