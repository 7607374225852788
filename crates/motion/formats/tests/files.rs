//! Paths: which reader, which skeleton, and writing whole files or none.

use std::fs;
use std::path::PathBuf;

use ambulo_formats::ReadOptions;
use ambulo_formats::bvh::WriteOptions;
use ambulo_formats::files::{FileError, Format, read_path, skeleton_of, write_path};

const BVH: &str = "HIERARCHY ROOT a\n{ OFFSET 0 0 0 CHANNELS 1 Xrotation End Site { OFFSET 0 1 0 } }\nMOTION\nFrames: 1\n\
                   Frame Time: 0.1\n90\n";
const ASF: &str = ":units\nlength 1\n:root\norder RX\naxis XYZ\n";
const AMC: &str = ":DEGREES\n1\nroot 90\n";

/// A folder of one test's own, removed with all that is in it.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ambulo-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, text).unwrap();
        path
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<_> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn the_suffix_chooses_the_reader() {
    let folder = Folder::new("suffix");
    let options = ReadOptions::default();
    let bvh = read_path(&folder.file("a.BVH", BVH), &options).unwrap();
    assert_eq!((bvh.format, bvh.metres_per_unit), (Format::Bvh, None));
    assert!(bvh.dialect.is_some());
    folder.file("b.ASF", ASF);
    let amc = read_path(&folder.file("b.amc", AMC), &options).unwrap();
    assert_eq!((amc.format, amc.metres_per_unit), (Format::Amc, Some(0.0254)));
    let error = read_path(&folder.file("c.fbx", ""), &options).unwrap_err();
    assert!(matches!(error, FileError::Suffix { .. }));
    assert!(
        error.to_string().ends_with("not a motion file by its suffix; known: .bvh, .amc, .keys")
    );
}

#[test]
fn errors_begin_with_the_file() {
    let folder = Folder::new("errors");
    let path = folder.file("bad.bvh", &BVH.replace("90", "x"));
    let error = read_path(&path, &ReadOptions::default()).unwrap_err();
    let expected =
        format!("{}: line 6, column 1: expected a finite number, found 'x'", path.display());
    assert_eq!(error.to_string(), expected);
    let missing = folder.0.join("none.bvh");
    let error = read_path(&missing, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.starts_with(&missing.display().to_string()), "{error}");
    // An error in the skeleton names the skeleton.
    folder.file("m.asf", "nothing");
    let error = read_path(&folder.file("m.amc", AMC), &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("m.asf: line 1, column 1"), "{error}");
}

#[test]
fn the_skeleton_is_of_the_same_name_or_of_the_subject_or_the_only_one() {
    let folder = Folder::new("skeleton");
    let amc = folder.file("02_01.amc", AMC);
    let error = skeleton_of(&amc).unwrap_err().to_string();
    assert!(
        error.ends_with("no 02_01.asf, no 02.asf and not exactly one other .asf file beside it")
    );
    let only = folder.file("other.asf", ASF);
    assert_eq!(skeleton_of(&amc).unwrap(), only);
    folder.file("another.asf", ASF);
    assert!(matches!(skeleton_of(&amc), Err(FileError::NoSkeleton { .. })));
    let subject = folder.file("02.asf", ASF);
    assert_eq!(skeleton_of(&amc).unwrap(), subject);
    let same = folder.file("02_01.asf", ASF);
    assert_eq!(skeleton_of(&amc).unwrap(), same);
}

#[test]
fn writing_replaces_a_file_and_leaves_nothing_else() {
    let folder = Folder::new("writing");
    let path = folder.file("a.bvh", BVH);
    let file = read_path(&path, &ReadOptions::default()).unwrap();
    let options = WriteOptions { dialect: file.dialect };
    write_path(&path, &file.clip, &options).unwrap();
    assert_eq!(folder.names(), ["a.bvh"]);
    assert_eq!(read_path(&path, &ReadOptions::default()).unwrap().clip, file.clip);
    let error = write_path(&folder.0.join("a.amc"), &file.clip, &options).unwrap_err();
    assert!(error.to_string().ends_with("known: .bvh"));
}

#[test]
fn a_failed_writing_leaves_nothing() {
    let folder = Folder::new("failed");
    let file = read_path(&folder.file("a.bvh", BVH), &ReadOptions::default()).unwrap();
    // A folder of that name cannot be replaced by a file.
    let taken = folder.0.join("b.bvh");
    fs::create_dir_all(taken.join("inside")).unwrap();
    let error = write_path(&taken, &file.clip, &WriteOptions::default()).unwrap_err();
    assert!(matches!(error, FileError::Io { .. }), "{error}");
    assert_eq!(folder.names(), ["a.bvh", "b.bvh"]);
}
