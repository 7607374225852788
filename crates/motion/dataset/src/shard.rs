//! Rows on disk: one NumPy file a clip, and beside it what was found out about the clip.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::compare::Agreement;
use crate::gait::CATEGORIES;

/// Count, mean and sum of squared deviations of every column.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    /// Rows.
    pub rows: u64,
    /// Mean by column.
    pub mean: Vec<f64>,
    /// Sum of squared deviations from the mean, by column.
    pub squares: Vec<f64>,
}

impl Moments {
    /// Takes one more row (Welford, "Note on a method for calculating corrected sums of squares",
    /// 1962).
    pub fn add(&mut self, row: &[f32]) {
        if self.rows == 0 {
            *self = Self { rows: 0, mean: vec![0.0; row.len()], squares: vec![0.0; row.len()] };
        }
        self.rows += 1;
        let share = 1.0 / self.rows as f64;
        for ((value, mean), squares) in row.iter().zip(&mut self.mean).zip(&mut self.squares) {
            let off = f64::from(*value) - *mean;
            *mean += off * share;
            *squares += off * (f64::from(*value) - *mean);
        }
    }

    /// Takes the rows of another (Chan, Golub, LeVeque, 1983).
    pub fn merge(&mut self, other: &Self) {
        if self.rows == 0 {
            *self = other.clone();
            return;
        }
        let (a, b) = (self.rows as f64, other.rows as f64);
        let n = a + b;
        for column in 0..other.mean.len() {
            let off = other.mean[column] - self.mean[column];
            self.mean[column] += off * b / n;
            self.squares[column] += other.squares[column] + off * off * a * b / n;
        }
        self.rows += other.rows;
    }

    /// Standard deviations by column.
    pub fn deviations(&self) -> Vec<f64> {
        let rows = (self.rows as f64).max(1.0);
        self.squares.iter().map(|squares| (squares / rows).sqrt()).collect()
    }
}

/// What is known of a shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShardInfo {
    /// Changes whenever the shard must be built again.
    pub key: String,
    /// Rows.
    pub rows: usize,
    /// First row and number of rows of each run of consecutive frames.
    pub runs: Vec<(usize, usize)>,
    /// Rows of each of [`CATEGORIES`].
    pub categories: [usize; CATEGORIES.len()],
    /// Frames of the clip at the data set's rate.
    pub frames: usize,
    /// Frames left out because their phase is unknown or somebody said so.
    pub unusable: usize,
    /// Share of steps with the same foot as the one before.
    pub repeated_steps: f32,
    /// Mean probability of the contacts that were chosen.
    pub contact_confidence: f32,
    /// Mean confidence of the gaits.
    pub gait_confidence: f32,
    /// Largest distance in metres of a standing sole from the ground under it.
    pub ground_gap: f32,
    /// Whether the clip was found, or said, to be on level ground.
    pub level: bool,
    /// How far automatic labels agree with published ones, where there are any.
    pub agreement: Option<Agreement>,
    /// Over input and output.
    pub moments: Moments,
}

/// Writes rows to a file that appears only when it is whole.
pub struct ShardWriter {
    path: PathBuf,
    part: PathBuf,
    file: BufWriter<File>,
    width: usize,
    rows: usize,
    expected: usize,
}

impl ShardWriter {
    /// Starts a file for a known number of rows.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn create(path: &Path, rows: usize, width: usize) -> io::Result<Self> {
        let part = path.with_extension("part");
        let mut file = BufWriter::with_capacity(1 << 18, File::create(&part)?);
        file.write_all(&npy_header(rows, width))?;
        Ok(Self { path: path.into(), part, file, width, rows: 0, expected: rows })
    }

    /// Writes one row.
    ///
    /// # Errors
    /// When the disk is full.
    ///
    /// # Panics
    /// When the row has another width.
    pub fn write(&mut self, row: &[f32]) -> io::Result<()> {
        assert_eq!(row.len(), self.width, "width of a row");
        self.rows += 1;
        for number in row {
            self.file.write_all(&number.to_le_bytes())?;
        }
        Ok(())
    }

    /// Makes the file appear under its name.
    ///
    /// # Errors
    /// When it cannot be written to the end.
    ///
    /// # Panics
    /// When rows are missing.
    pub fn finish(self) -> io::Result<()> {
        assert_eq!(self.rows, self.expected, "rows of the shard");
        let file = self.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.sync_all()?;
        std::fs::rename(&self.part, &self.path)
    }
}

/// Writes a small file so that it is there whole or not at all.
///
/// # Errors
/// When the folder cannot be written.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    let mut file = File::create(&part)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    std::fs::rename(&part, path)
}

/// NumPy's format, version 1.0: float32, C order.
fn npy_header(rows: usize, width: usize) -> Vec<u8> {
    let dict = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {width}), }}");
    let fixed = 10;
    let padded = (fixed + dict.len() + 1).next_multiple_of(64);
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend(((padded - fixed) as u16).to_le_bytes());
    header.extend(dict.as_bytes());
    header.resize(padded - 1, b' ');
    header.push(b'\n');
    header
}

/// Bytes of a shard's file.
pub fn file_size(rows: usize, width: usize) -> u64 {
    (npy_header(rows, width).len() + 4 * rows * width) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_in_parts_are_those_of_the_whole() {
        let row = |i: usize| [1000.0 + (i % 7) as f32, (i * i % 11) as f32];
        let mut whole = Moments::default();
        (0..100).for_each(|i| whole.add(&row(i)));
        let (mut a, mut b) = (Moments::default(), Moments::default());
        (0..30).for_each(|i| a.add(&row(i)));
        (30..100).for_each(|i| b.add(&row(i)));
        let mut merged = Moments::default();
        merged.merge(&a);
        merged.merge(&b);
        assert_eq!(merged.rows, 100);
        for column in 0..2 {
            assert!((merged.mean[column] - whole.mean[column]).abs() < 1e-9);
            assert!((merged.squares[column] / whole.squares[column] - 1.0).abs() < 1e-9);
        }
        let mean = (0..100).map(|i| f64::from(row(i)[0])).sum::<f64>() / 100.0;
        let variance = (0..100).map(|i| (f64::from(row(i)[0]) - mean).powi(2)).sum::<f64>() / 100.0;
        assert!((whole.deviations()[0] - variance.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn headers_are_aligned() {
        for (rows, width) in [(0, 1), (12, 590), (123_456_789, 3000)] {
            let header = npy_header(rows, width);
            assert_eq!(header.len() % 64, 0);
            assert_eq!(u16::from_le_bytes([header[8], header[9]]) as usize + 10, header.len());
            assert_eq!(header.last(), Some(&b'\n'));
        }
    }
}
