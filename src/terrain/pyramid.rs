//! Smallest and largest height of square blocks of cells: exact boxes for culling and for skipping blocks along a ray.
//!
//! Level 0 has blocks of [`MinMaxPyramid::BASE`] × `BASE` cells; each level above doubles the side. A block includes the
//! samples on all four of its sides. Values keep the type of the samples, so that a 16-bit map of N samples needs
//! 4 N / 16 · 4/3 = N/3 bytes, a sixth of the heights themselves.

use glam::DVec3;

use super::height_field::{HeightField, SampleRect, Samples};
use super::hierarchy::{Hierarchy, PatchId};

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
#[derive(Debug, Clone)]
pub struct MinMaxPyramid {
    levels: Levels,
}

/// The levels, finest first, in the type of the samples.
#[derive(Debug, Clone)]
pub(super) enum Levels {
    U16(Vec<Level<u16>>),
    F32(Vec<Level<f32>>),
}

/// Smallest and largest heights apart: a ray above the ground reads the largest only, half of the memory.
#[derive(Debug, Clone)]
pub(super) struct Level<T> {
    pub(super) columns: u32,
    pub(super) rows: u32,
    pub(super) low: Vec<T>,
    pub(super) high: Vec<T>,
}

/// A type of samples.
pub(super) trait Height: Copy + Default + PartialOrd + Into<f64> + Send + Sync {
    /// The value a fraction `s` of 0..=1 from `a` to `b`: never outside of the two, and exactly `a` or `b` at the ends.
    fn between(a: Self, b: Self, s: f64) -> f64;
}

impl Height for u16 {
    #[inline(always)]
    fn between(a: Self, b: Self, s: f64) -> f64 {
        // The difference is exact, and rounding is monotone.
        let (a, b): (f64, f64) = (a.into(), b.into());
        a + s * (b - a)
    }
}

impl Height for f32 {
    #[inline(always)]
    fn between(a: Self, b: Self, s: f64) -> f64 {
        // The difference of floats of very unequal size is rounded: start from the nearer end.
        let (a, b): (f64, f64) = (a.into(), b.into());
        if s < 0.5 { a + s * (b - a) } else { b - (1.0 - s) * (b - a) }
    }
}

#[inline(always)]
pub(super) fn smaller<T: PartialOrd>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

#[inline(always)]
pub(super) fn larger<T: PartialOrd>(a: T, b: T) -> T {
    if b > a { b } else { a }
}

impl<T: Height> Level<T> {
    fn base(field: &HeightField, samples: &[T]) -> Self {
        use rayon::prelude::*;
        const B: usize = MinMaxPyramid::BASE as usize;
        let [cells_u, cells_v] = field.cells().map(|n| n as usize);
        let (columns, rows) = (cells_u.div_ceil(B), cells_v.div_ceil(B));
        let width = cells_u + 1;
        let mut low = vec![samples[0]; columns * rows];
        let mut high = low.clone();
        low.par_chunks_mut(columns).zip(high.par_chunks_mut(columns)).enumerate().for_each_init(
            || (Vec::with_capacity(width), Vec::with_capacity(width)),
            |(lows, highs): &mut (Vec<T>, Vec<T>), (j, (low, high))| {
                // First down the columns of samples, which is one long loop per row, then along.
                let first = &samples[j * B * width..][..width];
                lows.clear();
                highs.clear();
                lows.extend_from_slice(first);
                highs.extend_from_slice(first);
                for v in j * B + 1..=(j * B + B).min(cells_v) {
                    let line = &samples[v * width..][..width];
                    for ((l, h), &s) in lows.iter_mut().zip(highs.iter_mut()).zip(line) {
                        (*l, *h) = (smaller(*l, s), larger(*h, s));
                    }
                }
                for (i, (low, high)) in low.iter_mut().zip(high).enumerate() {
                    let block = i * B..=(i * B + B).min(cells_u);
                    *low = lows[block.clone()].iter().copied().fold(lows[i * B], smaller);
                    *high = highs[block].iter().copied().fold(highs[i * B], larger);
                }
            },
        );
        Self { columns: columns as u32, rows: rows as u32, low, high }
    }

    fn above(&self) -> Self {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let count = columns as usize * rows as usize;
        let (mut low, mut high) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for j in 0..rows {
            for i in 0..columns {
                let range = self.join(i, j);
                low.push(range[0]);
                high.push(range[1]);
            }
        }
        Self { columns, rows, low, high }
    }

    /// The range of block (i, j) of the level above.
    fn join(&self, i: u32, j: u32) -> [T; 2] {
        // Beyond the border `get` answers for the last block, which belongs to this one.
        let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(di, dj)| self.get(2 * i + di, 2 * j + dj));
        [smaller(smaller(a[0], b[0]), smaller(c[0], d[0])), larger(larger(a[1], b[1]), larger(c[1], d[1]))]
    }

    /// Computes the blocks of the smallest level and those above anew that contain samples of a rectangle, which is not
    /// empty; their number.
    fn update(levels: &mut [Self], samples: &[T], [cells_u, cells_v]: [u32; 2], rect: SampleRect) -> u64 {
        const B: u32 = MinMaxPyramid::BASE;
        let width = cells_u as usize + 1;
        let [last_u, last_v] = rect.last();
        let mut count = 0;
        // A sample on the line between two blocks belongs to both.
        let (mut first, mut last) =
            ([rect.column, rect.row].map(|x| x.saturating_sub(1) / B), [last_u, last_v].map(|x| x / B));
        for k in 0..levels.len() {
            let (below, above) = levels.split_at_mut(k);
            let Some(level) = above.first_mut() else { break };
            last = [last[0].min(level.columns - 1), last[1].min(level.rows - 1)];
            for j in first[1]..=last[1] {
                for i in first[0]..=last[0] {
                    let [low, high] = match below.last() {
                        Some(below) => below.join(i, j),
                        None => {
                            let columns = i * B..=(i * B + B).min(cells_u);
                            let rows = j * B..=(j * B + B).min(cells_v);
                            let line = |v: u32| {
                                &samples[v as usize * width..][*columns.start() as usize..=*columns.end() as usize]
                            };
                            let start = line(*rows.start())[0];
                            rows.flat_map(line).fold([start; 2], |[low, high], &s| [smaller(low, s), larger(high, s)])
                        }
                    };
                    let at = j as usize * level.columns as usize + i as usize;
                    (level.low[at], level.high[at]) = (low, high);
                    count += 1;
                }
            }
            (first, last) = (first.map(|x| x / 2), last.map(|x| x / 2));
        }
        count
    }

    fn get(&self, i: u32, j: u32) -> [T; 2] {
        let (i, j) = (i.min(self.columns - 1) as usize, j.min(self.rows - 1) as usize);
        let at = j * self.columns as usize + i;
        [self.low[at], self.high[at]]
    }

    fn bytes(&self) -> usize {
        size_of_val(self.low.as_slice()) + size_of_val(self.high.as_slice())
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
    level.get(i, j).map(Into::into)
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

    /// Makes the tree right after samples of its map within a rectangle have changed: computes the blocks that contain
    /// some of them anew, on each level, and says how many those were. At most
    /// (columns / 4 + 2) · (rows / 4 + 2) on the smallest level and a quarter on each level above, or one.
    ///
    /// ```
    /// use seamount::terrain::{HeightField, MinMaxPyramid, SampleRect, Voids};
    ///
    /// let before = HeightField::from_u16(33, 33, vec![5; 33 * 33], Voids::default())?;
    /// let mut pyramid = MinMaxPyramid::new(&before);
    /// let mut samples = vec![5; 33 * 33];
    /// samples[10 * 33 + 10] = 9;
    /// let after = HeightField::from_u16(33, 33, samples, Voids::default())?;
    /// let changed = SampleRect { column: 10, row: 10, columns: 1, rows: 1 };
    /// assert_eq!(pyramid.update(&after, changed), 4); // of blocks of 4, 8, 16 and 32 cells one each
    /// assert_eq!(pyramid.full_range(), [5.0, 9.0]);
    /// # Ok::<(), seamount::terrain::HeightFieldError>(())
    /// ```
    pub fn update(&mut self, field: &HeightField, rect: SampleRect) -> u64 {
        debug_assert!(rect.is_within(field.columns(), field.rows()), "{rect:?} is beyond the map");
        if rect.is_empty() {
            return 0;
        }
        match (&mut self.levels, field.samples()) {
            (Levels::U16(levels), Samples::U16(samples)) => Level::update(levels, samples, field.cells(), rect),
            (Levels::F32(levels), Samples::F32(samples)) => Level::update(levels, samples, field.cells(), rect),
            // Not the tree of this map.
            _ => {
                *self = Self::new(field);
                u64::MAX
            }
        }
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

    /// The box of a patch in lattice coordinates: its north-west corner with the smallest height, its south-east corner with the
    /// largest. All surfaces of the patch lie in it.
    #[must_use]
    pub fn patch_box(&self, tree: &Hierarchy, patch: PatchId) -> [DVec3; 2] {
        let [[u0, v0], [u1, v1]] = tree.extent(patch);
        let [low, high] = self.range(tree.size(patch.level), patch.column, patch.row);
        [DVec3::new(u0.into(), v0.into(), low), DVec3::new(u1.into(), v1.into(), high)]
    }

    /// Smallest and largest raw height of the whole map.
    #[must_use]
    pub fn full_range(&self) -> [f64; 2] {
        self.range(1 << 30, 0, 0)
    }

    pub(super) fn levels(&self) -> &Levels {
        &self.levels
    }

    /// Bytes that the tree occupies.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match &self.levels {
            Levels::U16(levels) => levels.iter().map(Level::bytes).sum(),
            Levels::F32(levels) => levels.iter().map(Level::bytes).sum(),
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
