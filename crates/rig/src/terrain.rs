//! Ground that a character walks on.

use glam::Vec3;

/// Ground heights, asked point by point. A game answers from its own physics.
pub trait Terrain {
    /// Height in metres of the ground under (or over) a point.
    fn height(&self, x: f32, z: f32) -> f32;

    /// Unit normal of the ground at a point; by default from heights 5 cm around it.
    fn normal(&self, x: f32, z: f32) -> Vec3 {
        let d = 0.05;
        let dx = self.height(x + d, z) - self.height(x - d, z);
        let dz = self.height(x, z + d) - self.height(x, z - d);
        Vec3::new(-dx, 2.0 * d, -dz).normalize()
    }
}

/// The same height everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flat(
    /// Metres.
    pub f32,
);

impl Terrain for Flat {
    fn height(&self, _: f32, _: f32) -> f32 {
        self.0
    }

    fn normal(&self, _: f32, _: f32) -> Vec3 {
        Vec3::Y
    }
}

/// Why numbers are not a height field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum HeightFieldError {
    #[error("a height field needs at least 2 rows and 2 columns, not {rows} × {columns}")]
    Size { rows: usize, columns: usize },
    #[error("row {row} (from 1) has {got} heights, the first has {expected}")]
    Ragged { row: usize, expected: usize, got: usize },
    #[error("row {row}, column {column} (from 1): '{text}' is not a finite number")]
    Number { row: usize, column: usize, text: String },
    #[error("hills are between 1 and 2048 metres a side, not {0}")]
    Hills(f32),
    #[error("cell and scale must be finite and the cell positive")]
    Scale,
}

/// Heights on a square grid around the origin, bilinear in between, the border's height outside.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    rows: usize,
    columns: usize,
    cell: f32,
    heights: Vec<f32>,
}

impl HeightField {
    /// Takes heights in metres, row by row: columns run along +X, rows along +Z, the middle of the
    /// grid lies at the origin; `cell` is the distance between neighbours in metres.
    ///
    /// # Errors
    /// Fewer than 2 × 2 heights, a number of heights that is not rows × columns, or numbers that
    /// are not finite.
    pub fn new(
        rows: usize,
        columns: usize,
        cell: f32,
        heights: Vec<f32>,
    ) -> Result<Self, HeightFieldError> {
        if rows < 2 || columns < 2 || rows.checked_mul(columns) != Some(heights.len()) {
            return Err(HeightFieldError::Size { rows, columns });
        }
        if !(cell > 0.0 && cell.is_finite()) {
            return Err(HeightFieldError::Scale);
        }
        if let Some(at) = heights.iter().position(|h| !h.is_finite()) {
            let (row, column) = (at / columns + 1, at % columns + 1);
            return Err(HeightFieldError::Number { row, column, text: heights[at].to_string() });
        }
        Ok(Self { rows, columns, cell, heights })
    }

    /// Reads a text grid, one row a line, numbers apart by spaces; heights are multiplied by
    /// `scale` (metres).
    ///
    /// # Errors
    /// As [`HeightField::new`], and rows of different lengths, with the place.
    pub fn from_text(text: &str, cell: f32, scale: f32) -> Result<Self, HeightFieldError> {
        if !scale.is_finite() {
            return Err(HeightFieldError::Scale);
        }
        let (mut heights, mut rows, mut columns) = (Vec::new(), 0, 0);
        for line in text.lines().filter(|line| !line.trim().is_empty()) {
            rows += 1;
            let before = heights.len();
            for (column, word) in line.split_ascii_whitespace().enumerate() {
                let number = word.parse::<f32>().ok().map(|n| n * scale).filter(|n| n.is_finite());
                heights.push(number.ok_or_else(|| HeightFieldError::Number {
                    row: rows,
                    column: column + 1,
                    text: word.chars().take(20).collect(),
                })?);
            }
            let got = heights.len() - before;
            columns = if rows == 1 { got } else { columns };
            if got != columns {
                return Err(HeightFieldError::Ragged { row: rows, expected: columns, got });
            }
        }
        Self::new(rows, columns, cell, heights)
    }

    /// Gentle hills from a seed: three octaves of value noise, `size` metres a side, heights
    /// between 0 and `height` metres, the same on every machine.
    ///
    /// # Errors
    /// A size that is not between 1 and 2048 m, or a height that is not finite.
    pub fn hills(seed: u64, size: f32, height: f32) -> Result<Self, HeightFieldError> {
        let cell = 0.5;
        let side = (size / cell) as usize + 1;
        if !(1.0..=2048.0).contains(&size) {
            return Err(HeightFieldError::Hills(size));
        }
        let mut heights = Vec::with_capacity(side * side);
        for row in 0..side {
            for column in 0..side {
                let (x, z) = (column as f32 * cell, row as f32 * cell);
                // Wavelengths a walker feels as hills, rises and bumps; weights sum to 1.
                let octaves = [(24.0, 0.75), (11.0, 0.2), (4.0, 0.05)];
                let sum = octaves.iter().enumerate().map(|(octave, &(wave, weight))| {
                    weight * value_noise(seed.wrapping_add(octave as u64), x / wave, z / wave)
                });
                heights.push(height * sum.sum::<f32>());
            }
        }
        Self::new(side, side, cell, heights)
    }

    /// Rows (along +Z) and columns (along +X).
    pub fn size(&self) -> (usize, usize) {
        (self.rows, self.columns)
    }

    /// Metres between neighbouring heights.
    pub fn cell(&self) -> f32 {
        self.cell
    }

    /// The heights in metres, row by row.
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }
}

impl Terrain for HeightField {
    fn height(&self, x: f32, z: f32) -> f32 {
        let place = |at: f32, count: usize| {
            let last = (count - 1) as f32;
            // max before min, so that NaN becomes a place too: the height stays finite.
            let at = (at / self.cell + last / 2.0).max(0.0).min(last);
            let index = (at as usize).min(count - 2);
            (index, at - index as f32)
        };
        let (column, u) = place(x, self.columns);
        let (row, v) = place(z, self.rows);
        let at = |row: usize, column: usize| self.heights[row * self.columns + column];
        let near = at(row, column) * (1.0 - u) + at(row, column + 1) * u;
        let far = at(row + 1, column) * (1.0 - u) + at(row + 1, column + 1) * u;
        near * (1.0 - v) + far * v
    }
}

/// Value noise in [0, 1]: random numbers on the integer grid, smooth (quintic) in between.
fn value_noise(seed: u64, x: f32, z: f32) -> f32 {
    let smooth = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (u, v) = (smooth(x - x.floor()), smooth(z - z.floor()));
    let (column, row) = (x.floor() as i64, z.floor() as i64);
    let at = |row: i64, column: i64| hash01(seed, row, column);
    let near = at(row, column) * (1.0 - u) + at(row, column + 1) * u;
    let far = at(row + 1, column) * (1.0 - u) + at(row + 1, column + 1) * u;
    near * (1.0 - v) + far * v
}

/// SplitMix64's finaliser over the place, as a number in [0, 1).
fn hash01(seed: u64, row: i64, column: i64) -> f32 {
    let mut h = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    for part in [row as u64, column as u64] {
        h = (h ^ part).wrapping_add(0x9E37_79B9_7F4A_7C15);
        h = (h ^ (h >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        h = (h ^ (h >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        h ^= h >> 31;
    }
    (h >> 40) as f32 / (1u64 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bilinear_centred_and_held_at_the_border() {
        // Columns run along +X: the height is 1 m per metre of x, whatever z.
        let field = HeightField::new(2, 3, 1.0, vec![-1.0, 0.0, 1.0, -1.0, 0.0, 1.0]).unwrap();
        assert_eq!(field.height(0.0, 0.0), 0.0);
        assert_eq!(field.height(0.25, 0.4), 0.25);
        assert_eq!(field.height(9.0, 9.0), 1.0);
        assert_eq!(field.height(-9.0, 0.0), -1.0);
        assert!(field.height(f32::NAN, f32::INFINITY).is_finite());
        let normal = field.normal(0.3, 0.0);
        assert!(normal.abs_diff_eq(Vec3::new(-1.0, 1.0, 0.0).normalize(), 1e-4));
    }

    #[test]
    fn rows_run_along_z() {
        let field = HeightField::from_text("0 0\n2 2\n", 1.0, 0.5).unwrap();
        assert_eq!(field.height(0.0, 0.5), 1.0);
        assert_eq!(field.height(0.0, -0.5), 0.0);
    }

    #[test]
    fn says_where_a_grid_is_wrong() {
        let error = |text| HeightField::from_text(text, 1.0, 1.0).unwrap_err();
        assert_eq!(error("1 2\n3\n"), HeightFieldError::Ragged { row: 2, expected: 2, got: 1 });
        let number = HeightFieldError::Number { row: 2, column: 2, text: "x".into() };
        assert_eq!(error("1 2\n3 x\n"), number);
        assert!(matches!(error("1 NaN\n3 4\n"), HeightFieldError::Number { row: 1, .. }));
        assert_eq!(error(""), HeightFieldError::Size { rows: 0, columns: 0 });
    }

    #[test]
    fn hills_are_the_seeds_own() {
        let hills = HeightField::hills(7, 40.0, 2.0).unwrap();
        assert_eq!(hills, HeightField::hills(7, 40.0, 2.0).unwrap());
        assert_ne!(hills, HeightField::hills(8, 40.0, 2.0).unwrap());
        assert!(hills.heights().iter().all(|&h| (0.0..=2.0).contains(&h)));
        let rows = hills.heights().chunks(hills.size().1);
        let slope =
            rows.flat_map(|r| r.windows(2)).map(|w| (w[1] - w[0]).abs() / 0.5).fold(0.0, f32::max);
        assert!(slope < 0.6, "steeper than a person walks: {slope}");
        assert!(
            HeightField::hills(1, 1e9, 1.0).is_err() && HeightField::hills(1, 0.1, 1.0).is_err()
        );
    }
}
