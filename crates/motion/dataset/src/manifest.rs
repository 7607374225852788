//! What a data set is made from: a text file that people edit.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;

use ambulo_rig::Axes;
use serde::{Deserialize, Serialize};

use crate::DatasetError;
use crate::body::RoleNames;
use crate::contacts::ContactSettings;
use crate::gait::GaitSettings;
use crate::ground::Kind;
use crate::patches::MOST;

/// The version that this code writes and reads.
pub const MANIFEST_FORMAT: u32 = 1;

/// Which ground a clip is put on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TerrainSettings {
    /// `flat`: a level floor under every clip; `noise`: built-in patches under uneven clips;
    /// `files`: patches cut from height maps.
    pub source: TerrainSource,
    /// Height maps (text grids), for `files`; paths relative to the manifest.
    pub files: Vec<PathBuf>,
    /// Metres between their heights; the published maps' by default.
    pub cell: f32,
    /// Metres of height in a unit of theirs.
    pub scale: f32,
    /// Patches made from noise.
    pub patches: usize,
    /// Best patches that each gait cycle is put on.
    pub copies: usize,
}

/// Where patches come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum TerrainSource {
    Flat,
    #[default]
    Noise,
    Files,
}

impl Default for TerrainSettings {
    fn default() -> Self {
        Self {
            source: TerrainSource::Noise,
            files: vec![],
            cell: 0.039_370_08,
            scale: 0.03,
            patches: 400,
            copies: 2,
        }
    }
}

/// Which side of the split a clip is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum Split {
    Training,
    Validation,
}

/// One clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClipEntry {
    /// Unique; its shards are named after it.
    pub name: String,
    /// Relative to the manifest's folder, or absolute.
    pub file: PathBuf,
    /// Recording that it is cut from: clips of one take are on one side of the split.
    pub take: String,
    /// Its side.
    pub split: Split,
    /// Axes and unit of the file, by name.
    pub axes: String,
    /// First second that is used; from the start if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// Second at which use ends; the end if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
    /// Also as a mirror shows it; as the data set says if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mirror: Option<bool>,
    /// What it was captured on; found out if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<Kind>,
}

/// A data set's description; all but the clips may also come from a `--config` file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Manifest {
    /// Version of this file's format.
    pub format: u32,
    /// Layout of the vectors: `ambulo` or `holden`.
    pub layout: String,
    /// Licence of the recordings, in words; models trained from them carry it.
    pub licence: String,
    /// Seed of the split and of the terrain.
    pub seed: u64,
    /// Also use every clip as a mirror shows it.
    pub mirror: bool,
    /// Share of the recordings that is kept for validation.
    pub validation: f64,
    /// Axes and unit of all files, by name; each file's are found out if empty.
    pub axes: String,
    /// Name of the clip whose skeleton the data set has; the commonest if empty.
    pub reference: String,
    /// Names of joints to leave out, with all below them.
    pub drop: Vec<String>,
    /// Height in metres of left heel, left toe, right heel, right toe while they stand; found out
    /// if empty.
    pub foot_heights: Vec<f32>,
    /// Joints by role.
    pub roles: RoleNames,
    /// How contacts are found.
    pub contacts: ContactSettings,
    /// How gaits are told apart.
    pub gaits: GaitSettings,
    /// The ground.
    pub terrain: TerrainSettings,
    /// The clips.
    #[serde(rename = "clip")]
    pub clips: Vec<ClipEntry>,
}

impl Default for Manifest {
    fn default() -> Self {
        Self {
            format: MANIFEST_FORMAT,
            layout: "ambulo".into(),
            licence: String::new(),
            seed: 1,
            mirror: true,
            validation: 0.1,
            axes: String::new(),
            reference: String::new(),
            drop: vec![],
            foot_heights: vec![],
            roles: RoleNames::default(),
            contacts: ContactSettings::default(),
            gaits: GaitSettings::default(),
            terrain: TerrainSettings::default(),
            clips: vec![],
        }
    }
}

impl Manifest {
    /// Reads a manifest, or settings without clips.
    ///
    /// # Errors
    /// Where the text is wrong: line, column and what was expected.
    pub fn parse(text: &str) -> Result<Self, DatasetError> {
        let manifest: Self =
            toml::from_str(text).map_err(|e| DatasetError::Manifest(e.to_string()))?;
        manifest.check()?;
        Ok(manifest)
    }

    /// As text, with a few words on how to use it.
    ///
    /// # Errors
    /// Numbers that TOML cannot hold.
    pub fn to_text(&self) -> Result<String, DatasetError> {
        let body =
            toml::to_string_pretty(self).map_err(|e| DatasetError::Manifest(e.to_string()))?;
        Ok(format!(
            "# What this data set is made from. Edit and build again: only what is affected is\n\
             # built anew. Seconds and metres; every key is explained in docs/datasets.md.\n\n{body}"
        ))
    }

    fn check(&self) -> Result<(), DatasetError> {
        let fail = |message: String| Err(DatasetError::Manifest(message));
        if self.format != MANIFEST_FORMAT {
            return fail(format!("format is {}, expected {MANIFEST_FORMAT}", self.format));
        }
        if !["ambulo", "holden"].contains(&self.layout.as_str()) {
            return fail(format!("layout is '{}', expected ambulo or holden", self.layout));
        }
        if !(0.0..=0.9).contains(&self.validation) {
            return fail(format!(
                "validation is {}, expected a share of 0 to 0.9",
                self.validation
            ));
        }
        let positive = [
            ("contacts.speed", self.contacts.speed),
            ("contacts.height", self.contacts.height),
            ("gaits.walk", self.gaits.walk),
            ("gaits.jog", self.gaits.jog - self.gaits.walk),
            ("gaits.run", self.gaits.run - self.gaits.jog),
            ("gaits.crouch", self.gaits.crouch),
            ("gaits.jump", self.gaits.jump),
            ("terrain.cell", self.terrain.cell),
        ];
        if let Some((key, value)) =
            positive.iter().find(|(_, value)| value.is_nan() || *value <= 0.0)
        {
            return fail(format!(
                "{key} is too small by {value}: it must be positive, and walk < jog < run"
            ));
        }
        if !(0.0..10.0).contains(&self.contacts.dwell) || !self.terrain.scale.is_finite() {
            return fail("contacts.dwell or terrain.scale is out of range".into());
        }
        if !(1..=100).contains(&self.terrain.copies) || self.terrain.patches > MOST {
            return fail(format!(
                "terrain.copies must be 1 to 100, terrain.patches at most {MOST}"
            ));
        }
        if ![0, 4].contains(&self.foot_heights.len())
            || self.foot_heights.iter().any(|h| h.is_nan() || h.abs() >= 1.0)
        {
            return fail("foot_heights must be four heights in metres, or none".into());
        }
        self.check_clips()
    }

    fn check_clips(&self) -> Result<(), DatasetError> {
        let (mut names, mut sides) = (HashSet::new(), HashMap::new());
        for clip in &self.clips {
            let fail = |message: &str| {
                Err(DatasetError::Manifest(format!("clip '{}': {message}", clip.name)))
            };
            let plain = |c: char| c.is_alphanumeric() || "-_. +".contains(c);
            if clip.name.is_empty() || clip.name.starts_with('.') || !clip.name.chars().all(plain) {
                return fail("its name must be letters, digits, '-', '_', '.', '+' or blanks");
            }
            if [".auto", ".mirrored"].iter().any(|end| clip.name.ends_with(end)) {
                return fail("names that end in .auto or .mirrored are given to other files");
            }
            // Not every file system tells capitals from small letters.
            if !names.insert(clip.name.to_lowercase()) {
                return fail("two clips have this name");
            }
            if let Err(error) = Axes::named(&clip.axes) {
                return fail(&error.to_string());
            }
            let (from, to) = (clip.from.unwrap_or(0.0), clip.to.unwrap_or(f64::INFINITY));
            if !(from >= 0.0 && to > from) {
                return fail("it ends before it begins");
            }
            if *sides.entry(&clip.take).or_insert(clip.split) != clip.split {
                return fail(&format!("take '{}' is on both sides of the split", clip.take));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str, take: &str, split: Split) -> ClipEntry {
        ClipEntry {
            name: name.into(),
            file: "a.bvh".into(),
            take: take.into(),
            split,
            axes: "cm".into(),
            from: None,
            to: Some(2.5),
            mirror: None,
            ground: Some(Kind::Flat),
        }
    }

    #[test]
    fn a_manifest_survives_as_text() {
        let clips = vec![entry("a", "t", Split::Training), entry("b", "u", Split::Validation)];
        let manifest = Manifest { clips, licence: "mine".into(), ..Manifest::default() };
        let text = manifest.to_text().unwrap();
        assert_eq!(Manifest::parse(&text).unwrap(), manifest);
        assert_eq!(Manifest::parse("").unwrap(), Manifest::default());
    }

    #[test]
    fn says_what_is_wrong_and_where() {
        let refused = |text: &str| Manifest::parse(text).unwrap_err().to_string();
        let error = refused("mirror = true\nmirorr = 3\n");
        assert!(error.contains("line 2") && error.contains("mirorr"), "{error}");
        assert!(refused("layout = \"mann\"").contains("expected ambulo or holden"));
        assert!(refused("validation = 2.0").contains("0.9"));
        assert!(refused("[gaits]\njog = 9.0").contains("walk < jog < run"));
        let mut manifest = Manifest {
            clips: vec![entry("a", "t", Split::Training), entry("b", "t", Split::Validation)],
            ..Manifest::default()
        };
        assert!(manifest.check().unwrap_err().to_string().contains("both sides"));
        manifest.clips[1] = entry("a", "u", Split::Training);
        assert!(manifest.check().unwrap_err().to_string().contains("two clips"));
        manifest.clips[1] = entry("../up", "u", Split::Training);
        assert!(manifest.check().unwrap_err().to_string().contains("name must be"));
        manifest.clips[1] = entry("A", "u", Split::Training);
        assert!(manifest.check().unwrap_err().to_string().contains("two clips"));
        manifest.clips[1] = entry("a.mirrored", "u", Split::Training);
        assert!(manifest.check().unwrap_err().to_string().contains(".mirrored"));
    }
}
