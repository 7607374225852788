//! A script file, field by field.

use serde::{Deserialize, Serialize};

use crate::reading::{self, FileError, Found};
use crate::{Gait, Scene};

/// The version of the file format that this code reads and writes.
pub const SCRIPT_FORMAT: u32 = 1;

/// What a visitor does, one thing after another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Script {
    /// Version of this format: 1.
    pub format: u32,
    /// What people call it.
    pub name: String,
    /// Anything worth knowing.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub about: String,
    /// How visits with a seed are disturbed.
    #[serde(default)]
    pub interruptions: Interruptions,
    /// What is done, 1 to 256.
    #[serde(rename = "do")]
    pub tasks: Vec<Task>,
}

/// How interactions are broken off in visits with a seed; each is then tried again.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Interruptions {
    /// At most so many for each task that uses something, 0 to 10.
    pub most: u32,
    /// Within so many seconds after it has begun to walk there, 0.1 to 60.
    pub within: f32,
}

impl Default for Interruptions {
    fn default() -> Self {
        Self { most: 2, within: 8.0 }
    }
}

/// One thing to do: exactly one of `go`, `use` and `wait`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Task {
    /// Walk to a place (x, z), metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub go: Option<[f32; 2]>,
    /// How to go; walking if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gait: Option<Gait>,
    /// Use an object, by its name.
    #[serde(rename = "use", skip_serializing_if = "Option::is_none")]
    pub using: Option<String>,
    /// Which of its interactions; the first that is on offer if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with: Option<String>,
    /// Seconds of a hold that repeats, 0 to 600.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stay: Option<f32>,
    /// Where to go with what is carried, metres, before it is put down: at most 16 places.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub carry: Vec<[f32; 2]>,
    /// Do nothing, seconds, 0 to 600.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wait: Option<f32>,
}

impl Script {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// Everything that is wrong, each with its path; lines where the text itself is.
    pub fn parse(text: &str) -> Result<Self, FileError> {
        let script: Self = reading::parse(text, SCRIPT_FORMAT)?;
        let mut found = Found::default();
        found.format(script.format, SCRIPT_FORMAT);
        found.name("$.name", &script.name);
        found.about(&script.about);
        found.count("$.do", script.tasks.len(), 1, 256);
        let Interruptions { most, within } = script.interruptions;
        found.number("$.interruptions.most", most as f32, 0.0, 10.0, "");
        found.number("$.interruptions.within", within, 0.1, 60.0, " s");
        for (index, task) in script.tasks.iter().enumerate() {
            task.check(&format!("$.do[{index}]"), &mut found);
        }
        found.finish()?;
        Ok(script)
    }

    /// As a file.
    pub fn to_text(&self) -> String {
        toml::to_string(self).expect("plain numbers and words can be written")
    }

    /// Whether what it uses is there.
    ///
    /// # Errors
    /// Each object that the scene lacks, each interaction that its object does not offer.
    pub fn check_against(&self, scene: &Scene) -> Result<(), FileError> {
        let mut found = Found::default();
        for (index, task) in self.tasks.iter().enumerate() {
            let Some(name) = &task.using else { continue };
            let Some(object) = scene.object(name) else {
                found.add(format!("$.do[{index}].use"), format!("the scene has no '{name}'"));
                continue;
            };
            let offered = &scene.objects[object].interactions;
            let with = task.with.as_ref();
            if let Some(with) = with.filter(|with| !offered.contains(with)) {
                let reason = format!("'{name}' does not offer '{with}'");
                found.add(format!("$.do[{index}].with"), reason);
            }
        }
        found.finish()
    }
}

impl Task {
    fn check(&self, path: &str, found: &mut Found) {
        let kinds = [self.go.is_some(), self.using.is_some(), self.wait.is_some()];
        if kinds.iter().filter(|&&kind| kind).count() != 1 {
            found.add(path, "exactly one of go, use and wait");
        }
        let only = |found: &mut Found, key: &str, given: bool, with: bool, what: &str| {
            if given && !with {
                found.add(format!("{path}.{key}"), format!("goes with {what} only"));
            }
        };
        only(found, "gait", self.gait.is_some(), self.go.is_some(), "go");
        let uses = self.using.is_some();
        only(found, "with", self.with.is_some(), uses, "use");
        only(found, "stay", self.stay.is_some(), uses, "use");
        only(found, "carry", !self.carry.is_empty(), uses, "use");
        found.count(&format!("{path}.carry"), self.carry.len(), 0, 16);
        for (key, seconds) in [("stay", self.stay), ("wait", self.wait)] {
            if let Some(seconds) = seconds {
                found.number(format!("{path}.{key}"), seconds, 0.0, 600.0, " s");
            }
        }
        for place in self.go.iter().chain(&self.carry) {
            found.numbers(path, place, -1000.0, 1000.0, " m");
        }
    }
}
