//! A text line by line, a line word by word.

use std::ops::RangeInclusive;

use crate::ReadError;
use crate::text::{Cursor, quoted};

/// Longer names are refused.
const LONGEST_NAME: usize = 80;

/// The words of a line that says something, and the next one to take.
pub(super) struct Line<'a> {
    bytes: &'a [u8],
    words: Vec<(usize, &'a str)>,
    end: usize,
    next: usize,
}

/// The lines that are not blank, without their comments.
pub(super) fn lines<'a>(bytes: &'a [u8]) -> Result<impl Iterator<Item = Line<'a>>, ReadError> {
    let start = Cursor::new(bytes)?.at;
    let text = std::str::from_utf8(&bytes[start..]).map_err(|error| {
        let at = start + error.valid_up_to();
        ReadError::at(bytes, at, "plain or UTF-8 text", "another encoding")
    })?;
    let place = move |part: &str| part.as_ptr() as usize - bytes.as_ptr() as usize;
    let line = move |line: &'a str| {
        let words = line.split_ascii_whitespace().take_while(|word| !word.starts_with('#'));
        let words: Vec<_> = words.map(|word| (place(word), word)).collect();
        let end = words.last().map_or(0, |(at, word)| at + word.len());
        Line { bytes, words, end, next: 0 }
    };
    Ok(text.split(['\n', '\r']).map(line).filter(|line| !line.words.is_empty()))
}

impl<'a> Line<'a> {
    pub fn peek(&self) -> Option<&'a str> {
        self.words.get(self.next).map(|(_, word)| *word)
    }

    /// Byte of the next word, or of the line's end.
    pub fn at(&self) -> usize {
        self.words.get(self.next).map_or(self.end, |(at, _)| *at)
    }

    /// Takes the next word if it is this one.
    pub fn accept(&mut self, word: &str) -> bool {
        let there = self.peek() == Some(word);
        self.next += usize::from(there);
        there
    }

    /// Takes the word that was looked at.
    pub fn next_word(&mut self) {
        self.next += 1;
    }

    pub fn word(&mut self, expected: &str) -> Result<&'a str, ReadError> {
        let word = self.peek().ok_or_else(|| self.unexpected(expected))?;
        self.next += 1;
        Ok(word)
    }

    /// A name of the file's own making.
    pub fn name(&mut self, expected: &str, reserved: &[&str]) -> Result<String, ReadError> {
        match self.peek() {
            Some(word) if word.len() > LONGEST_NAME => {
                Err(self.unexpected(&format!("{expected} of at most {LONGEST_NAME} bytes")))
            }
            Some(word) if reserved.contains(&word) => {
                Err(self.unexpected(&format!("{expected} that is not a word of the format")))
            }
            _ => self.word(expected).map(str::to_owned),
        }
    }

    pub fn number(&mut self, what: &str, range: RangeInclusive<f64>) -> Result<f64, ReadError> {
        let value = self.peek().and_then(|word| word.parse::<f64>().ok());
        let value = value.filter(|value| range.contains(value)).ok_or_else(|| {
            self.unexpected(&format!("{what}, a number from {} to {}", range.start(), range.end()))
        })?;
        self.next += 1;
        Ok(value)
    }

    pub fn numbers(
        &mut self,
        what: &str,
        range: RangeInclusive<f64>,
    ) -> Result<[f64; 3], ReadError> {
        let mut number = || self.number(what, range.clone());
        Ok([number()?, number()?, number()?])
    }

    /// That nothing is left.
    pub fn done(&self) -> Result<(), ReadError> {
        if self.peek().is_some() { Err(self.unexpected("the end of the line")) } else { Ok(()) }
    }

    /// An error at the next word.
    #[cold]
    pub fn unexpected(&self, expected: &str) -> ReadError {
        let found = self.peek().map_or("the end of the line".into(), |w| quoted(w.as_bytes()));
        ReadError::at(self.bytes, self.at(), expected, found)
    }

    /// An error at the word just taken.
    #[cold]
    pub fn wrong(&self, expected: &str) -> ReadError {
        let (at, word) = self.words[self.next.saturating_sub(1)];
        ReadError::at(self.bytes, at, expected, quoted(word.as_bytes()))
    }
}
