//! How the files of this room are read: everything that is wrong is said at once, with its place.

use std::fmt;

use serde::de::DeserializeOwned;

/// Bytes of the longest file that is read.
const MOST_BYTES: usize = 1 << 18;
/// Characters of a reason that are kept; a file can put names of any length into one.
const MOST_REASON: usize = 300;

/// Something wrong at a place of the document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Where, as a path: `$.target[1].weight[0]`; `$` is the whole document.
    pub path: String,
    /// What is wrong and what was expected; the line, too, where the reader knows it.
    pub reason: String,
}

impl Problem {
    /// Names from the file stand in both; what would break the line is escaped.
    fn new(path: impl Into<String>, reason: impl Into<String>) -> Self {
        let escaped = |c: char| match c.is_control() {
            true => c.escape_default().collect(),
            false => String::from(c),
        };
        let line = |text: String| text.chars().take(MOST_REASON).map(escaped).collect();
        Self { path: line(path.into()), reason: line(reason.into()) }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path, self.reason)
    }
}

/// Why an interaction or a scene is refused; each problem is a line of its text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum FileError {
    #[error("$: such a file has at most {MOST_BYTES} bytes, this one {0}")]
    TooLong(usize),
    /// Not TOML.
    #[error("{0}")]
    Toml(Problem),
    /// A field that is unknown, missing or of another type.
    #[error("{0}")]
    Shape(Problem),
    #[error("$.format: this is format {found}, this version reads {read}: update Ambulo")]
    Version { found: i64, read: u32 },
    #[error("{}", .0.iter().map(Problem::to_string).collect::<Vec<_>>().join("\n"))]
    Invalid(Vec<Problem>),
}

impl FileError {
    /// Each thing that is wrong and where.
    pub fn problems(&self) -> Vec<Problem> {
        match self {
            FileError::Invalid(problems) => problems.clone(),
            FileError::Toml(problem) | FileError::Shape(problem) => vec![problem.clone()],
            other => {
                let text = other.to_string();
                let (path, reason) = text.split_once(": ").expect("each text begins with a path");
                vec![Problem::new(path, reason)]
            }
        }
    }
}

/// TOML to a description; its numbers are not checked yet. `format` is the version that is read.
pub(crate) fn parse<T: DeserializeOwned>(text: &str, format: u32) -> Result<T, FileError> {
    if text.len() > MOST_BYTES {
        return Err(FileError::TooLong(text.len()));
    }
    let syntax = |error: toml::de::Error| FileError::Toml(Problem::new("$", at_line(text, &error)));
    let table: toml::Table = toml::from_str(text).map_err(syntax)?;
    // The version first: a later format may have fields that this one does not know.
    if let Some(found) = table.get("format").and_then(toml::Value::as_integer)
        && found != i64::from(format)
    {
        return Err(FileError::Version { found, read: format });
    }
    let reader = toml::Deserializer::parse(text).map_err(syntax)?;
    serde_path_to_error::deserialize(reader).map_err(|error| {
        let path = error.path().to_string();
        let path = if path == "." { "$".into() } else { format!("$.{path}") };
        FileError::Shape(Problem::new(path, at_line(text, error.inner())))
    })
}

/// The reader's words with line and column, both from 1.
fn at_line(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().trim().replace('\n', ", ");
    let Some(before) = error.span().and_then(|span| text.get(..span.start)) else { return message };
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    format!("line {line}, column {column}: {message}")
}

/// What was found wrong so far.
#[derive(Default)]
pub(crate) struct Found(pub Vec<Problem>);

impl Found {
    pub fn add(&mut self, path: impl Into<String>, reason: impl Into<String>) {
        self.0.push(Problem::new(path, reason));
    }

    /// Nothing wrong, or all of it.
    pub fn finish(self) -> Result<(), FileError> {
        if self.0.is_empty() { Ok(()) } else { Err(FileError::Invalid(self.0)) }
    }

    /// Finite and within `low..=high`.
    pub fn number(&mut self, path: impl Into<String>, value: f32, low: f32, high: f32, unit: &str) {
        if !(low..=high).contains(&value) {
            self.add(path, format!("{value} is not {low} to {high}{unit}"));
        }
    }

    /// Each number of a point or an extent.
    pub fn numbers(&mut self, path: &str, values: &[f32], low: f32, high: f32, unit: &str) {
        for (axis, &value) in values.iter().enumerate() {
            self.number(format!("{path}[{axis}]"), value, low, high, unit);
        }
    }

    pub fn count(&mut self, path: &str, count: usize, low: usize, high: usize) {
        if !(low..=high).contains(&count) {
            self.add(path, format!("{count} entries; {low} to {high} are allowed"));
        }
    }

    /// Two numbers, the lower first, both within `low..=high`, 0 between them.
    pub fn limits(&mut self, path: &str, limits: [f32; 2], low: f32, high: f32, unit: &str) {
        let before = self.0.len();
        self.numbers(path, &limits, low, high, unit);
        let [least, most] = limits;
        if self.0.len() > before {
            return;
        }
        if least >= most {
            self.add(path, format!("[{least}, {most}]: the lower limit comes first"));
        } else if least > 0.0 || most < 0.0 {
            self.add(path, format!("[{least}, {most}] leaves 0, where it starts, outside"));
        }
    }

    pub fn format(&mut self, found: u32, read: u32) {
        if found != read {
            self.add("$.format", format!("{found} is not {read}"));
        }
    }

    pub fn name(&mut self, path: impl Into<String>, name: &str) {
        let plain = |c: char| !c.is_control();
        if name.trim().is_empty() || name.chars().count() > 80 || !name.chars().all(plain) {
            self.add(path, "a name is 1 to 80 characters, none of them a control character");
        }
    }

    pub fn about(&mut self, about: &str) {
        if about.len() > 4000 {
            self.add("$.about", format!("{} bytes; at most 4000", about.len()));
        }
    }

    /// A file's name without any folder: nothing may lead out of where the files lie.
    pub fn file(&mut self, path: impl Into<String>, file: &str, endings: &[&str]) {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.+".contains(c);
        let ending = endings.iter().any(|ending| file.ends_with(ending));
        let known = file.len() <= 120 && !file.starts_with('.') && file.chars().all(plain);
        if !(known && ending) {
            let endings = endings.join(", ");
            self.add(
                path,
                format!(
                    "'{file}': a file's name is ASCII letters, digits, '-', '_', '.', '+', without \
                     a folder, and ends in one of {endings}"
                ),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Small {
        format: u32,
        size: [f32; 2],
    }

    fn said(text: &str) -> String {
        parse::<Small>(text, 1).unwrap_err().to_string()
    }

    #[test]
    fn the_line_is_named_in_syntax_and_shape() {
        assert!(
            said("format = 1\nsize = [1, 2").starts_with("$: line 2, column "),
            "{}",
            said("a")
        );
        let error = said("format = 1\nsize = [1, \"ä\"]\n");
        assert!(error.starts_with("$.size[1]: line 2, column 12: invalid type: string"), "{error}");
        let error = said("format = 1\nsize = [1, 2]\n\ncolour = 3\n");
        assert!(error.starts_with("$.colour: line 4, column 1: unknown field `colour`"), "{error}");
        assert!(said("format = 1").contains("missing field `size`"));
    }

    #[test]
    fn a_later_format_is_told_apart_from_a_mistake() {
        let error = said("format = 2\ncolour = 3");
        assert_eq!(error, "$.format: this is format 2, this version reads 1: update Ambulo");
        let long = "#".repeat(MOST_BYTES + 1);
        assert_eq!(parse::<Small>(&long, 1).unwrap_err(), FileError::TooLong(MOST_BYTES + 1));
    }

    #[test]
    fn file_names_lead_nowhere() {
        let bad = |name: &str| {
            let mut found = Found::default();
            found.file("$", name, &[".toml"]);
            !found.0.is_empty()
        };
        assert!(!bad("open_door.toml") && !bad("a-b+c.1.toml"));
        for name in
            ["../a.toml", "/a.toml", "a\\b.toml", ".toml", "a.bvh", "", "ä.toml", "a b.toml"]
        {
            assert!(bad(name), "{name}");
        }
    }
}
