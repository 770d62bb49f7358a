//! Smallest and largest height of square blocks of cells: exact boxes for culling and for skipping blocks along a ray.
//!
//! Level 0 has blocks of [`MinMaxPyramid::BASE`] × `BASE` cells; each level above doubles the side. A block includes the
//! samples on all four of its sides. Values keep the type of the samples, so that a 16-bit map of N samples needs
//! 4 N / 16 · 4/3 = N/3 bytes, a sixth of the heights themselves.

use super::height_field::{HeightField, Samples};

/// Min/max tree over the cells of a map.
///
/// # Example
///
/// ```
/// use seamount::terrain::{HeightField, MinMaxPyramid, Voids};
///
/// let mut samples = vec![100; 9 * 9];
/// samples[0] = 7; // north-west corner
/// samples[80] = 900; // south-east corner
/// let field = HeightField::from_u16(9, 9, samples, Voids::default())?;
/// let pyramid = MinMaxPyramid::new(&field);
/// assert_eq!(pyramid.range(4, 0, 0), [7.0, 100.0]); // the first block of 4 × 4 cells
/// assert_eq!(pyramid.range(8, 0, 0), [7.0, 900.0]);
/// # Ok::<(), seamount::terrain::HeightFieldError>(())
/// ```
#[derive(Debug)]
pub struct MinMaxPyramid {
    levels: Levels,
}

#[derive(Debug)]
enum Levels {
    U16(Vec<Level<u16>>),
    F32(Vec<Level<f32>>),
}

#[derive(Debug)]
struct Level<T> {
    columns: u32,
    rows: u32,
    blocks: Vec<[T; 2]>,
}

trait Height: Copy + PartialOrd + Into<f64> + Send + Sync {}
impl Height for u16 {}
impl Height for f32 {}

fn merge<T: Height>(a: [T; 2], b: [T; 2]) -> [T; 2] {
    [if b[0] < a[0] { b[0] } else { a[0] }, if b[1] > a[1] { b[1] } else { a[1] }]
}

impl<T: Height> Level<T> {
    fn base(field: &HeightField, samples: &[T]) -> Self {
        use rayon::prelude::*;
        let b = MinMaxPyramid::BASE;
        let [cells_u, cells_v] = field.cells();
        let (columns, rows) = (cells_u.div_ceil(b), cells_v.div_ceil(b));
        let width = field.columns() as usize;
        let blocks = (0..rows)
            .into_par_iter()
            .flat_map_iter(|j| {
                (0..columns).map(move |i| {
                    let (u0, u1) = ((i * b) as usize, (i * b + b).min(cells_u) as usize);
                    let (v0, v1) = ((j * b) as usize, (j * b + b).min(cells_v) as usize);
                    let first = samples[v0 * width + u0];
                    let mut range = [first, first];
                    for v in v0..=v1 {
                        for &s in &samples[v * width + u0..=v * width + u1] {
                            range = merge(range, [s, s]);
                        }
                    }
                    range
                })
            })
            .collect();
        Self { columns, rows, blocks }
    }

    fn above(&self) -> Self {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let mut blocks = Vec::with_capacity(columns as usize * rows as usize);
        for j in 0..rows {
            for i in 0..columns {
                let mut range = self.get(2 * i, 2 * j);
                for (di, dj) in [(1, 0), (0, 1), (1, 1)] {
                    if 2 * i + di < self.columns && 2 * j + dj < self.rows {
                        range = merge(range, self.get(2 * i + di, 2 * j + dj));
                    }
                }
                blocks.push(range);
            }
        }
        Self { columns, rows, blocks }
    }

    fn get(&self, i: u32, j: u32) -> [T; 2] {
        let (i, j) = (i.min(self.columns - 1) as usize, j.min(self.rows - 1) as usize);
        self.blocks[j * self.columns as usize + i]
    }

    fn pyramid(base: Self) -> Vec<Self> {
        let mut levels = vec![base];
        while let Some(last) = levels.last()
            && (last.columns > 1 || last.rows > 1)
        {
            let next = last.above();
            levels.push(next);
        }
        levels
    }
}

fn range_in<T: Height>(levels: &[Level<T>], k: usize, i: u32, j: u32) -> [f64; 2] {
    // Above the top there is one block: that of the top.
    let top = levels.len() - 1;
    let (level, i, j) = if k > top { (&levels[top], 0, 0) } else { (&levels[k], i, j) };
    let [low, high] = level.get(i, j);
    [low.into(), high.into()]
}

impl MinMaxPyramid {
    /// Cells along a side of the smallest blocks.
    pub const BASE: u32 = 4;

    /// Builds the tree in one pass over the samples, on all cores.
    #[must_use]
    pub fn new(field: &HeightField) -> Self {
        let levels = match field.samples() {
            Samples::U16(s) => Levels::U16(Level::pyramid(Level::base(field, s))),
            Samples::F32(s) => Levels::F32(Level::pyramid(Level::base(field, s))),
        };
        Self { levels }
    }

    /// Smallest and largest raw height of the block of `size` × `size` cells number `(i, j)`, borders included. `size` is a
    /// power of two, at least [`MinMaxPyramid::BASE`]; block (i, j) starts at cell (i · size, j · size). Blocks beyond the
    /// map answer for the nearest one.
    #[must_use]
    pub fn range(&self, size: u32, i: u32, j: u32) -> [f64; 2] {
        debug_assert!(size.is_power_of_two() && size >= Self::BASE, "no blocks of {size} cells");
        let k = (size / Self::BASE).trailing_zeros() as usize;
        match &self.levels {
            Levels::U16(levels) => range_in(levels, k, i, j),
            Levels::F32(levels) => range_in(levels, k, i, j),
        }
    }

    /// Smallest and largest raw height of the whole map.
    #[must_use]
    pub fn full_range(&self) -> [f64; 2] {
        self.range(1 << 30, 0, 0)
    }

    /// Bytes that the tree occupies.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match &self.levels {
            Levels::U16(levels) => levels.iter().map(|l| size_of_val(l.blocks.as_slice())).sum(),
            Levels::F32(levels) => levels.iter().map(|l| size_of_val(l.blocks.as_slice())).sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::Voids;

    #[test]
    fn blocks_agree_with_a_scan_of_their_samples() {
        let (columns, rows) = (41u32, 30u32);
        let samples = (0..columns * rows).map(|i| (i.wrapping_mul(2_654_435_761) >> 16) as u16).collect();
        let field = HeightField::from_u16(columns, rows, samples, Voids::default()).unwrap();
        let pyramid = MinMaxPyramid::new(&field);
        for size in [4, 8, 16, 32, 64, 1024] {
            for j in 0..(rows - 1).div_ceil(size) {
                for i in 0..(columns - 1).div_ceil(size) {
                    let mut expected = [f64::INFINITY, f64::NEG_INFINITY];
                    for r in j * size..=((j + 1) * size).min(rows - 1) {
                        for c in i * size..=((i + 1) * size).min(columns - 1) {
                            let h = field.raw(c, r);
                            expected = [expected[0].min(h), expected[1].max(h)];
                        }
                    }
                    assert_eq!(pyramid.range(size, i, j), expected, "block {i}, {j} of {size}");
                }
            }
        }
    }
}
