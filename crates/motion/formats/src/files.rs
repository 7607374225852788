//! Paths → clips and back: the only part that touches the file system.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use ambulo_rig::Clip;

use crate::bvh::{self, Dialect, WriteOptions};
use crate::keys::{self, Keys, Marks};
use crate::{Note, ReadError, ReadOptions, amc};

/// A format by its suffix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `.bvh`
    Bvh,
    /// `.amc`, with an `.asf` beside it.
    Amc,
    /// `.keys`, with what it names beside it.
    Keys,
}

impl Format {
    /// The format of files of that name, by suffix in any case.
    pub fn of(path: &Path) -> Option<Self> {
        let suffix = path.extension()?;
        [Self::Bvh, Self::Amc, Self::Keys]
            .into_iter()
            .find(|format| suffix.eq_ignore_ascii_case(format.suffix()))
    }

    /// In lower case, without a dot.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Amc => "amc",
            Self::Keys => "keys",
        }
    }
}

/// What was read from a path.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionFile {
    /// In the file's own units and axes.
    pub clip: Clip,
    /// By the suffix.
    pub format: Format,
    /// How a BVH file writes the clip.
    pub dialect: Option<Dialect>,
    /// The length of a unit, where the format says it.
    pub metres_per_unit: Option<f64>,
    /// Phases and events, where the format has them.
    pub marks: Option<Marks>,
    /// What was odd or mended.
    pub notes: Vec<Note>,
}

impl MotionFile {
    /// The preset of [`ambulo_rig::Axes`] that the format prescribes; files of the others are in
    /// whatever their makers liked.
    pub fn axes(&self) -> Option<&'static str> {
        (self.format == Format::Keys).then_some("ambulo")
    }
}

/// Why a path could not be read or written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum FileError {
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error("{}: not a motion file by its suffix; known: {known}", path.display())]
    Suffix { path: PathBuf, known: &'static str },
    #[error(
        "{}: found no skeleton for it: no {stem}.asf, no {subject}.asf and not exactly one other \
         .asf file beside it",
        path.display()
    )]
    NoSkeleton { path: PathBuf, stem: String, subject: String },
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> FileError + '_ {
    move |source| FileError::Io { path: path.into(), source }
}

/// Reads a motion file; an AMC file's skeleton is looked for beside it ([`skeleton_of`]).
///
/// # Errors
/// A suffix that is not known, a file that cannot be opened, is not whole, or has no skeleton.
pub fn read_path(path: &Path, options: &ReadOptions) -> Result<MotionFile, FileError> {
    let unknown = || FileError::Suffix { path: path.into(), known: ".bvh, .amc, .keys" };
    let format = Format::of(path).ok_or_else(unknown)?;
    let load = |path: &Path| fs::read(path).map_err(io_error(path));
    let bytes = load(path)?;
    let named = |path: &Path, error: ReadError| error.with_file(path.display().to_string());
    match format {
        Format::Bvh => {
            let bvh = bvh::read(&bytes, options).map_err(|error| named(path, error))?;
            let (clip, dialect, notes) = (bvh.clip, Some(bvh.dialect), bvh.notes);
            Ok(MotionFile { clip, format, dialect, metres_per_unit: None, marks: None, notes })
        }
        Format::Amc => {
            let beside = skeleton_of(path)?;
            let skeleton =
                amc::Asf::read(&load(&beside)?).map_err(|error| named(&beside, error))?;
            let amc = amc::read(&skeleton, &bytes, options).map_err(|error| named(path, error))?;
            let (clip, metres_per_unit, notes) = (amc.clip, amc.metres_per_unit, amc.notes);
            Ok(MotionFile { clip, format, dialect: None, metres_per_unit, marks: None, notes })
        }
        Format::Keys => {
            let keys = parse_keys(path, &bytes)?;
            let (keys::Sampled { clip, notes }, marks) =
                (keys.sample(), Some(keys.marks().clone()));
            Ok(MotionFile { clip, format, dialect: None, metres_per_unit: Some(1.0), marks, notes })
        }
    }
}

/// Reads a `.keys` file's keys, with the files beside it that it names.
///
/// # Errors
/// A file that cannot be opened or is not whole.
pub fn read_keys(path: &Path) -> Result<Keys, FileError> {
    parse_keys(path, &fs::read(path).map_err(io_error(path))?)
}

fn parse_keys(path: &Path, bytes: &[u8]) -> Result<Keys, FileError> {
    let mut beside = |name: &str| {
        let path = path.with_file_name(name);
        fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))
    };
    let keys = keys::read(bytes, &mut beside).map_err(|error| {
        let path = error.file.as_ref().map_or(path.to_owned(), |name| path.with_file_name(name));
        error.with_file(path.display().to_string())
    })?;
    Ok(keys)
}

/// The ASF file beside an AMC file: of the same name (`02_01.asf`), of the subject (`02.asf` for
/// `02_01.amc`), or the only one in the folder.
///
/// # Errors
/// A folder that cannot be listed, or none of these.
pub fn skeleton_of(amc: &Path) -> Result<PathBuf, FileError> {
    let folder = amc.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let mut found = vec![];
    for entry in fs::read_dir(folder).map_err(io_error(folder))? {
        let path = entry.map_err(io_error(folder))?.path();
        if path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("asf")) {
            found.push(path);
        }
    }
    let stem = amc.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let subject = stem.split('_').next().unwrap_or_default().to_owned();
    for name in [&stem, &subject] {
        let same = |path: &&PathBuf| path.file_stem() == Some(OsStr::new(name));
        if let Some(path) = found.iter().find(same) {
            return Ok(path.clone());
        }
    }
    match found.as_slice() {
        [only] => Ok(only.clone()),
        _ => Err(FileError::NoSkeleton { path: amc.into(), stem, subject }),
    }
}

/// Writes a motion file, whole or not at all: a file of another name takes the path's place once
/// it is complete.
///
/// # Errors
/// A suffix other than `.bvh`, a path that cannot be written.
pub fn write_path(
    path: &Path,
    clip: &Clip,
    options: &WriteOptions,
) -> Result<Vec<Note>, FileError> {
    if Format::of(path) != Some(Format::Bvh) {
        return Err(FileError::Suffix { path: path.into(), known: ".bvh" });
    }
    let written = bvh::write(clip, options);
    replace(path, &written.bytes).map_err(io_error(path))?;
    Ok(written.notes)
}

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let unique = COUNT.fetch_add(1, Ordering::Relaxed);
    let mut name = OsStr::new(".").to_owned();
    name.push(path.file_name().ok_or(io::ErrorKind::InvalidInput)?);
    name.push(format!(".{}-{unique}.part", std::process::id()));
    let part = path.with_file_name(name);
    let mut file = fs::OpenOptions::new().write(true).create_new(true).open(&part)?;
    let done = file.write_all(bytes).and_then(|()| file.sync_all());
    drop(file);
    done.and_then(|()| fs::rename(&part, path)).inspect_err(|_| {
        // The first error is the one to tell.
        let _ = fs::remove_file(&part);
    })
}
