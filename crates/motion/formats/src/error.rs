//! What readers have to say: refusals and notes.

use std::fmt;

/// Why a file was refused, and where.
///
/// Shown as `walk.bvh: line 412, column 17: expected 96 numbers in frame 38, found 95`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadError {
    /// The file, when the caller named it.
    pub file: Option<String>,
    /// From 1.
    pub line: usize,
    /// From 1, in characters; a tab is one.
    pub column: usize,
    /// What would have been right there.
    pub expected: String,
    /// What is there instead.
    pub found: String,
}

impl ReadError {
    /// An error at a byte of the input.
    pub(crate) fn at(
        bytes: &[u8],
        offset: usize,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        let (line, column) = position(bytes, offset);
        Self { file: None, line, column, expected: expected.into(), found: found.into() }
    }

    /// The same error with the file's name in front.
    #[must_use]
    pub fn with_file(mut self, file: impl Into<String>) -> Self {
        self.file = Some(file.into());
        self
    }
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, column, expected, found } = self;
        if let Some(file) = file {
            write!(f, "{file}: ")?;
        }
        write!(f, "line {line}, column {column}: expected {expected}, found {found}")
    }
}

impl std::error::Error for ReadError {}

/// Something about a file or a conversion that its user should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// Where in the file, from 1; `None` when it concerns all of it.
    pub line: Option<usize>,
    /// One sentence.
    pub text: String,
}

impl Note {
    pub(crate) fn new(text: impl Into<String>) -> Self {
        Self { line: None, text: text.into() }
    }
}

/// The notes of one reading, no more than a person reads.
#[derive(Default)]
pub(crate) struct Notes {
    list: Vec<Note>,
    more: usize,
}

impl Notes {
    const MOST: usize = 50;

    /// A note on the whole file.
    pub fn push(&mut self, text: impl Into<String>) {
        self.add(|| Note::new(text));
    }

    /// A note on the line of a byte.
    pub fn at(&mut self, bytes: &[u8], offset: usize, text: impl Into<String>) {
        self.add(|| Note { line: Some(position(bytes, offset).0), text: text.into() });
    }

    /// Of the many that a strange file gives rise to, the first; finding a line takes time, too.
    fn add(&mut self, note: impl FnOnce() -> Note) {
        if self.list.len() < Self::MOST {
            self.list.push(note());
        } else {
            self.more += 1;
        }
    }

    pub fn finish(mut self) -> Vec<Note> {
        if self.more > 0 {
            self.list.push(Note::new(format!("{} more notes are left out", self.more)));
        }
        self.list
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        f.write_str(&self.text)
    }
}

/// Line and column of a byte. Found by counting from the start, so that reading need not count.
fn position(bytes: &[u8], offset: usize) -> (usize, usize) {
    let before = &bytes[..offset.min(bytes.len())];
    let (mut line, mut start) = (1, 0);
    for (at, &byte) in before.iter().enumerate() {
        // A line ends with LF, CR LF or CR alone.
        if byte == b'\n' || (byte == b'\r' && bytes.get(at + 1) != Some(&b'\n')) {
            line += 1;
            start = at + 1;
        }
    }
    let rest = &before[start..];
    let rest = if start == 0 { rest.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(rest) } else { rest };
    // Continuation bytes of UTF-8 are not characters of their own.
    let column = rest.iter().filter(|&&byte| byte & 0xC0 != 0x80).count() + 1;
    (line, column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_lines_of_every_kind_and_characters() {
        let text = "\u{feff}añb\r\nc\rd\n\ne".as_bytes();
        let at = |needle: u8| position(text, text.iter().position(|&b| b == needle).unwrap());
        assert_eq!(at(b'a'), (1, 1));
        assert_eq!(at(b'b'), (1, 3));
        assert_eq!(at(b'c'), (2, 1));
        assert_eq!(at(b'd'), (3, 1));
        assert_eq!(at(b'e'), (5, 1));
        assert_eq!(position(text, 1000), (5, 2));
    }

    #[test]
    fn an_error_reads_as_a_sentence() {
        let error = ReadError::at(b"a\nbc", 3, "96 numbers in frame 38", "95");
        assert_eq!(
            error.to_string(),
            "line 2, column 2: expected 96 numbers in frame 38, found 95"
        );
        let error = error.with_file("walk.bvh");
        assert!(error.to_string().starts_with("walk.bvh: line 2, column 2: expected"));
        let mut notes = Notes::default();
        notes.at(b"a\nb", 2, "odd");
        (0..99).for_each(|_| notes.push("again"));
        let notes = notes.finish();
        assert_eq!(notes[0].to_string(), "line 2: odd");
        assert_eq!(notes[Notes::MOST].to_string(), "50 more notes are left out");
    }
}
