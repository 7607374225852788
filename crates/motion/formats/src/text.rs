//! Words and numbers in the bytes of a text file.

use std::collections::{HashMap, HashSet};

use crate::ReadError;

/// A place in a text. Blanks are spaces and tabs; space is blanks and line ends.
pub(crate) struct Cursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
}

fn is_line_end(byte: u8) -> bool {
    byte == b'\n' || byte == b'\r'
}

pub(crate) fn is_space(byte: u8) -> bool {
    byte == b' ' || (b'\t'..=b'\r').contains(&byte)
}

impl<'a> Cursor<'a> {
    /// At the start of a text, past a byte order mark.
    ///
    /// # Errors
    /// UTF-16.
    pub fn new(bytes: &'a [u8]) -> Result<Self, ReadError> {
        if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
            return Err(ReadError::at(bytes, 0, "plain or UTF-8 text", "UTF-16"));
        }
        let at = if bytes.starts_with(b"\xEF\xBB\xBF") { 3 } else { 0 };
        Ok(Self { bytes, at })
    }

    pub fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    pub fn skip_blanks(&mut self) {
        while self.peek().is_some_and(|byte| is_space(byte) && !is_line_end(byte)) {
            self.at += 1;
        }
    }

    pub fn skip_space(&mut self) {
        while self.peek().is_some_and(is_space) {
            self.at += 1;
        }
    }

    /// Whether the line or the file ends here.
    pub fn at_line_end(&self) -> bool {
        self.peek().is_none_or(is_line_end)
    }

    pub fn skip_line(&mut self) {
        while !self.at_line_end() {
            self.at += 1;
        }
    }

    /// Past space and comments (`#` to the line's end); false at the end of the file.
    pub fn skip_comments(&mut self) -> bool {
        self.skip_space();
        while self.peek() == Some(b'#') {
            self.skip_line();
            self.skip_space();
        }
        self.peek().is_some()
    }

    /// The next word: a brace, or what stands before the next space or brace. Empty at the end.
    pub fn word(&mut self) -> &'a [u8] {
        self.skip_space();
        let start = self.at;
        while let Some(byte) = self.peek() {
            let brace = byte == b'{' || byte == b'}';
            if is_space(byte) || (brace && self.at > start) {
                break;
            }
            self.at += 1;
            if brace {
                break;
            }
        }
        &self.bytes[start..self.at]
    }

    /// The next word, without taking it.
    pub fn peek_word(&mut self) -> &'a [u8] {
        self.skip_space();
        let start = self.at;
        let word = self.word();
        self.at = start;
        word
    }

    /// Takes the next word if it is this one, in any case.
    pub fn accept(&mut self, word: &str) -> bool {
        self.skip_space();
        let start = self.at;
        let there = self.word().eq_ignore_ascii_case(word.as_bytes());
        if !there {
            self.at = start;
        }
        there
    }

    /// Takes this word, in any case.
    pub fn expect(&mut self, word: &str) -> Result<(), ReadError> {
        if self.accept(word) { Ok(()) } else { Err(self.unexpected(word)) }
    }

    /// The next number, on this line or a later one.
    pub fn number(&mut self, expected: &str) -> Result<f64, ReadError> {
        self.skip_space();
        self.number_here(expected)
    }

    /// The number at this very place.
    #[inline]
    pub fn number_here(&mut self, expected: &str) -> Result<f64, ReadError> {
        match number(self.bytes, self.at) {
            Some((value, end)) if value.is_finite() => {
                self.at = end;
                Ok(value)
            }
            _ => Err(self.unexpected(expected)),
        }
    }

    /// An error at the next word.
    #[cold]
    pub fn unexpected(&mut self, expected: &str) -> ReadError {
        let word = self.peek_word();
        self.error(expected, &quoted(word))
    }

    /// An error at this place.
    #[cold]
    pub fn error(&self, expected: &str, found: &str) -> ReadError {
        ReadError::at(self.bytes, self.at, expected, found)
    }
}

/// A word as it is shown in an error: in quotes, and cut when it is long.
pub(crate) fn quoted(word: &[u8]) -> String {
    const MOST: usize = 40;
    if word.is_empty() {
        return "the end of the file".into();
    }
    let text = String::from_utf8_lossy(&word[..word.len().min(4 * MOST)]);
    let mut shown: String =
        text.chars().take(MOST).map(|c| if c.is_control() { '?' } else { c }).collect();
    if text.chars().count() > MOST {
        shown.push('…');
    }
    format!("'{shown}'")
}

const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// The number that starts at `start`, rounded correctly (it may be infinite), and the place after
/// it. It ends at a space, a brace, the end of the text, or the sign of the next number: some
/// programs print columns without a blank between them (`0.0-7.5`).
#[inline]
pub(crate) fn number(bytes: &[u8], start: usize) -> Option<(f64, usize)> {
    let byte = |at: usize| bytes.get(at).copied().unwrap_or(b' ');
    let mut at = start;
    let negative = byte(at) == b'-';
    if negative || byte(at) == b'+' {
        at += 1;
    }
    let mut mantissa = 0_u64;
    let mut take_digits = |mut at: usize| {
        while byte(at).is_ascii_digit() {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte(at) - b'0'));
            at += 1;
        }
        at
    };
    let whole = at;
    at = take_digits(at);
    let mut digits = at - whole;
    let mut exponent = 0_i64;
    if byte(at) == b'.' {
        let end = take_digits(at + 1);
        let fraction = end - (at + 1);
        digits += fraction;
        exponent = -(fraction as i64);
        at = end;
    }
    if digits == 0 {
        return None;
    }
    if byte(at) | 0x20 == b'e' {
        let (shift, end) = decimal_exponent(bytes, at + 1)?;
        exponent += shift;
        at = end;
    }
    if !(is_space(byte(at)) || matches!(byte(at), b'-' | b'+' | b'}')) {
        return None;
    }
    // Both factors are exact here, so that one operation rounds correctly (Clinger's fast path).
    let value = if digits <= 19 && mantissa <= 1 << 53 && exponent.unsigned_abs() <= 22 {
        let power = POWERS_OF_TEN[exponent.unsigned_abs() as usize];
        let value = mantissa as f64;
        let value = if exponent < 0 { value / power } else { value * power };
        if negative { -value } else { value }
    } else {
        std::str::from_utf8(&bytes[start..at]).ok()?.parse().ok()?
    };
    Some((value, at))
}

/// What follows the `e` of a number, and the place after it.
fn decimal_exponent(bytes: &[u8], start: usize) -> Option<(i64, usize)> {
    let mut at = start;
    let negative = bytes.get(at) == Some(&b'-');
    if negative || bytes.get(at) == Some(&b'+') {
        at += 1;
    }
    let digits = at;
    let mut value = 0_i64;
    while let Some(byte) = bytes.get(at).filter(|byte| byte.is_ascii_digit()) {
        value = (value * 10 + i64::from(byte - b'0')).min(1 << 40);
        at += 1;
    }
    (at > digits).then_some((if negative { -value } else { value }, at))
}

/// Gives out each name once; a second `hand` becomes `hand_2`.
#[derive(Default)]
pub(crate) struct UniqueNames {
    taken: HashSet<String>,
    last: HashMap<String, usize>,
}

impl UniqueNames {
    pub fn take(&mut self, name: &str) -> String {
        let mut unique = name.to_owned();
        while !self.taken.insert(unique.clone()) {
            // The last number of each name is kept, or many equal names would take for ever.
            let number = self.last.entry(name.to_owned()).or_insert(1);
            *number += 1;
            unique = format!("{name}_{number}");
        }
        unique
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn all_of(text: &str) -> Option<f64> {
        number(text.as_bytes(), 0).filter(|&(_, end)| end == text.len()).map(|(value, _)| value)
    }

    #[test]
    fn numbers_in_every_spelling() {
        for (text, value) in [
            ("0", 0.0),
            ("-0", 0.0),
            (".0083", 0.0083),
            ("-.5", -0.5),
            ("5.", 5.0),
            ("+5", 5.0),
            ("1e-5", 1e-5),
            ("7.62852e-016", 7.62852e-16),
            ("1E+05", 1e5),
            ("123456789012345678901234567890", 1.234_567_890_123_456_8e29),
            ("0.1000000000000000055511151231257827", 0.1),
            // 2^64 + 1, which is 1 to a counter of 64 bits.
            ("18446744073709551617", 18_446_744_073_709_551_616.0),
            ("1e999", f64::INFINITY),
            ("1e-999", 0.0),
        ] {
            assert_eq!(all_of(text), Some(value), "{text}");
        }
        assert!(all_of("-0").unwrap().is_sign_negative());
        for text in
            ["", "-", ".", "e5", "1e", "1e+", "nan", "inf", "1.2.3", "0x1", "1,5", "1_0", "--1"]
        {
            assert_eq!(all_of(text), None, "{text}");
        }
    }

    #[test]
    fn numbers_end_at_the_next_sign() {
        let text = b"0.0-7.5+1e-3-2";
        let (mut at, mut values) = (0, vec![]);
        while at < text.len() {
            let (value, end) = number(text, at).unwrap();
            values.push(value);
            at = end;
        }
        assert_eq!(values, [0.0, -7.5, 1e-3, -2.0]);
    }

    #[test]
    fn words_and_braces() {
        let mut cursor = Cursor::new(b"\xEF\xBB\xBFROOT Hips{\tOFFSET}").unwrap();
        let mut words = vec![];
        while !cursor.peek_word().is_empty() {
            words.push(cursor.word());
        }
        assert_eq!(words, [&b"ROOT"[..], b"Hips", b"{", b"OFFSET", b"}"]);
    }

    #[test]
    fn refuses_utf_16() {
        let error = Cursor::new(b"\xFF\xFEH\0").err().unwrap();
        assert_eq!(
            error.to_string(),
            "line 1, column 1: expected plain or UTF-8 text, found UTF-16"
        );
    }

    #[test]
    fn errors_show_a_long_or_binary_word_cut_short() {
        assert_eq!(quoted(b"a\x07b"), "'a?b'");
        assert_eq!(quoted(&[b'x'; 1000]).chars().count(), 43);
    }

    proptest! {
        #[test]
        fn numbers_agree_with_the_standard_library(text in r"[+-]?([0-9]{1,25}\.?[0-9]{0,25}|\.[0-9]{1,25})([eE][+-]?[0-9]{1,4})?") {
            prop_assert_eq!(all_of(&text), Some(text.parse::<f64>().unwrap()), "{}", text);
        }
    }
}
