//! The map of heights: samples on an integer lattice at the depth of their file, and the surface they span.
//!
//! # Lattice coordinates
//!
//! Everything in [`crate::terrain`] speaks *lattice coordinates* `(u, v, w)`:
//!
//! * `u` counts columns eastward, `v` counts rows **southward**: sample `(c, r)` lies at `u = c`, `v = r`;
//! * `w` is the *raw* sample value (0..65535 for 16-bit maps, the number itself for maps of floats).
//!
//! [`LatticeFrame`] maps them to the local frame of a node. Integers stay integers as long as possible: two patches
//! that speak of one lattice point speak of the same bits.
//!
//! # The surface
//!
//! Cell `(c, r)` lies between samples `(c, r)` and `(c + 1, r + 1)` and is split along the diagonal that joins those
//! two. This piecewise linear surface is what full detail draws, what an exact pick hits and what every error is
//! measured against.
//!
//! # Holes
//!
//! Voids are filled when a map is made, so the surface reaches everywhere. [`HeightField::with_holes`] says that they are
//! holes all the same: then the *ground* is the part of the surface whose triangles have no void for a corner, and what is
//! filled in is a lid over the hole that nobody sees. The lid keeps everything continuous: which side of the surface a ray
//! is on is known over a hole as well, and only what it crosses there does not count.
//!
//! A valid sample all of whose triangles touch a void is as good as a void: no triangle of the ground has it for a corner.
//! It counts as part of the hole, so that each sample of the ground is a corner of the ground at full detail.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DAffine3, DMat3, DVec3};
use thiserror::Error;

/// Why a map of heights could not be made.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum HeightFieldError {
    /// A surface needs at least one cell, that is 2 × 2 samples.
    #[error("a height map needs at least 2 × 2 samples, this one has {columns} × {rows}")]
    TooSmall {
        /// Samples from west to east.
        columns: u32,
        /// Samples from north to south.
        rows: u32,
    },
    /// Lattice indices have to fit f32's integers on the GPU.
    #[error(
        "a height map may have up to {limit} samples a side, this one has {columns} × {rows}",
        limit = HeightField::MAX_SIDE
    )]
    TooLarge {
        /// Samples from west to east.
        columns: u32,
        /// Samples from north to south.
        rows: u32,
    },
    /// The number of values is not columns × rows.
    #[error("{columns} × {rows} samples were announced, but {given} values were given")]
    WrongCount {
        /// Samples from west to east.
        columns: u32,
        /// Samples from north to south.
        rows: u32,
        /// Number of values that came.
        given: usize,
    },
}

/// The samples of a map at the depth they came in, row by row from the north-west corner.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// 16-bit intensities; 65535 is intensity 1.
    U16(Vec<u16>),
    /// Intensities as 32-bit floats, within ±10³⁸; 1.0 is intensity 1, values outside 0..1 are allowed.
    F32(Vec<f32>),
}

impl Samples {
    fn len(&self) -> usize {
        match self {
            Samples::U16(s) => s.len(),
            Samples::F32(s) => s.len(),
        }
    }

    /// Factor from a raw sample to an intensity: 1/65535 for 16-bit samples, 1 for floats.
    #[must_use]
    pub fn intensity_scale(&self) -> f64 {
        match self {
            Samples::U16(_) => 1.0 / 65535.0,
            Samples::F32(_) => 1.0,
        }
    }

    /// Bytes that the samples occupy.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match self {
            Samples::U16(s) => size_of_val(s.as_slice()),
            Samples::F32(s) => size_of_val(s.as_slice()),
        }
    }
}

/// A rectangle of samples of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SampleRect {
    /// Samples west of it.
    pub column: u32,
    /// Samples north of it.
    pub row: u32,
    /// Samples from west to east; with 0 it is empty.
    pub columns: u32,
    /// Samples from north to south.
    pub rows: u32,
}

impl SampleRect {
    /// Whether it has no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns == 0 || self.rows == 0
    }

    /// Whether it lies within a map of so many samples.
    #[must_use]
    pub fn is_within(&self, columns: u32, rows: u32) -> bool {
        let fits = |start: u32, count: u32, limit: u32| start.checked_add(count).is_some_and(|end| end <= limit);
        fits(self.column, self.columns, columns) && fits(self.row, self.rows, rows)
    }

    /// Its last column and row; those before the first if it is empty.
    pub(crate) fn last(&self) -> [u32; 2] {
        [(self.column + self.columns).saturating_sub(1), (self.row + self.rows).saturating_sub(1)]
    }

    /// Whether it has samples in a block, its borders included, given by the first and last samples of the block.
    pub(crate) fn meets(&self, [[u0, v0], [u1, v1]]: [[u32; 2]; 2]) -> bool {
        let [last_u, last_v] = self.last();
        !self.is_empty() && self.column <= u1 && last_u >= u0 && self.row <= v1 && last_v >= v0
    }
}

/// A rectangular map of heights with at least 2 × 2 samples. Immutable once made; clones are cheap only through `Arc`.
///
/// # Example
///
/// ```
/// use seamount::terrain::{HeightField, Voids};
///
/// let field = HeightField::from_u16(3, 2, vec![0, 10, 20, 10, 20, 0], Voids::default())?;
/// assert_eq!((field.columns(), field.rows()), (3, 2));
/// assert_eq!(field.raw(1, 0), 10.0);
/// // Half way along the diagonal of cell (0, 0), from sample (0, 0) to sample (1, 1):
/// assert_eq!(field.surface(0.5, 0.5), Some(10.0));
/// # Ok::<(), seamount::terrain::HeightFieldError>(())
/// ```
#[derive(Debug)]
pub struct HeightField {
    columns: u32,
    rows: u32,
    samples: Samples,
    voids: Option<BitGrid>,
    /// The samples that no triangle of the ground has for a corner, if voids are holes and there are any.
    holes: Option<BitGrid>,
    id: u64,
}

/// Which samples of a source map carry no height.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Voids {
    /// The raw value that marks a void, in units of the samples given. Samples that are NaN, infinite or beyond ±10³⁸ are
    /// void whatever is said here.
    pub sample: Option<f64>,
}

/// A bit per sample.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BitGrid {
    columns: u32,
    words: Vec<u64>,
}

impl BitGrid {
    pub(crate) fn new(columns: u32, rows: u32) -> Self {
        let bits = columns as usize * rows as usize;
        Self { columns, words: vec![0; bits.div_ceil(64)] }
    }

    fn index(&self, c: u32, r: u32) -> usize {
        r as usize * self.columns as usize + c as usize
    }

    pub(crate) fn set(&mut self, c: u32, r: u32) {
        let i = self.index(c, r);
        if let Some(word) = self.words.get_mut(i / 64) {
            *word |= 1 << (i % 64);
        }
    }

    pub(crate) fn get(&self, c: u32, r: u32) -> bool {
        let i = self.index(c, r);
        self.words.get(i / 64).is_some_and(|word| word >> (i % 64) & 1 == 1)
    }

    pub(crate) fn count(&self) -> u64 {
        self.words.iter().map(|w| u64::from(w.count_ones())).sum()
    }

    /// Words with the bits of columns `from..=to` of a row, the others zero.
    fn row(&self, r: u32, from: u32, to: u32) -> impl Iterator<Item = u64> + '_ {
        let (first, last) = (self.index(from, r), self.index(to, r));
        (first / 64..=last / 64).map(move |i| {
            let word = self.words.get(i).copied().unwrap_or(0);
            let word = if i == first / 64 { word & u64::MAX << (first % 64) } else { word };
            if i == last / 64 { word & u64::MAX >> (63 - last % 64) } else { word }
        })
    }

    /// Whether any bit is set from one corner to the other, both included.
    pub(crate) fn any_in(&self, [[c0, r0], [c1, r1]]: [[u32; 2]; 2]) -> bool {
        (r0..=r1).any(|r| self.row(r, c0, c1).any(|word| word != 0))
    }

    /// Whether all bits are set from one corner to the other, both included.
    pub(crate) fn all_in(&self, [[c0, r0], [c1, r1]]: [[u32; 2]; 2]) -> bool {
        (r0..=r1).all(|r| self.row(r, c0, c1).map(u64::count_ones).sum::<u32>() == c1 - c0 + 1)
    }
}

/// The void among samples of a type: for floats whatever is no height too.
fn is_void(samples: &Samples, voids: Voids) -> impl Fn(f64) -> bool + use<> {
    let floats = matches!(samples, Samples::F32(_));
    move |raw| voids.sample == Some(raw) || floats && (raw.is_nan() || raw.abs() > HeightField::MAX_FLOAT)
}

/// Identities are never reused, so that what is derived from a map (trees, GPU textures) can be kept by identity.
static NEXT_ID: AtomicU64 = AtomicU64::new(1);

impl HeightField {
    /// Largest number of samples along a side: 2²⁴, the integers that f32 holds exactly on the GPU.
    pub const MAX_SIDE: u32 = 1 << 24;

    /// Largest absolute value of a float sample; what is beyond is void.
    const MAX_FLOAT: f64 = 1e38;

    /// A map of 16-bit intensities, row by row from the north-west corner. Voids are filled smoothly from their border.
    ///
    /// # Errors
    ///
    /// [`HeightFieldError`] when there are fewer than 2 × 2 samples, too many, or the count does not match.
    pub fn from_u16(columns: u32, rows: u32, samples: Vec<u16>, voids: Voids) -> Result<Self, HeightFieldError> {
        Self::new(columns, rows, Samples::U16(samples), voids)
    }

    /// A map of intensities as floats, row by row from the north-west corner. NaN and infinite samples are voids, and so
    /// are samples beyond ±10³⁸: differences of such heights overflow, and −3.4·10³⁸ is the customary mark of a void.
    ///
    /// With `max_height` 1 and `base_height` 0 on the node the values are heights in the node's own units.
    ///
    /// # Errors
    ///
    /// As for [`HeightField::from_u16`].
    pub fn from_f32(columns: u32, rows: u32, samples: Vec<f32>, voids: Voids) -> Result<Self, HeightFieldError> {
        Self::new(columns, rows, Samples::F32(samples), voids)
    }

    pub(crate) fn new(columns: u32, rows: u32, samples: Samples, voids: Voids) -> Result<Self, HeightFieldError> {
        if columns < 2 || rows < 2 {
            return Err(HeightFieldError::TooSmall { columns, rows });
        }
        if columns > Self::MAX_SIDE || rows > Self::MAX_SIDE {
            return Err(HeightFieldError::TooLarge { columns, rows });
        }
        if samples.len() as u64 != u64::from(columns) * u64::from(rows) {
            return Err(HeightFieldError::WrongCount { columns, rows, given: samples.len() });
        }
        let is_void = is_void(&samples, voids);
        let mut field =
            Self { columns, rows, samples, voids: None, holes: None, id: NEXT_ID.fetch_add(1, Ordering::Relaxed) };
        let mut mask: Option<BitGrid> = None;
        for r in 0..rows {
            for c in 0..columns {
                if is_void(field.raw(c, r)) {
                    mask.get_or_insert_with(|| BitGrid::new(columns, rows)).set(c, r);
                }
            }
        }
        if let Some(mask) = mask {
            super::fill::fill(columns, rows, &mut field.samples, &mask);
            field.voids = Some(mask);
        }
        Ok(field)
    }

    /// The same map with its voids as holes: no triangle has a void for a corner. The heights filled in stay, as a lid that
    /// is neither drawn nor picked. A map without voids stays as it is.
    ///
    /// ```
    /// use seamount::terrain::{HeightField, Voids};
    ///
    /// let mut samples = vec![7; 5 * 5];
    /// samples[12] = 0; // the middle
    /// let field = HeightField::from_u16(5, 5, samples, Voids { sample: Some(0.0) })?.with_holes();
    /// assert_eq!(field.surface(0.5, 0.5), Some(7.0));
    /// assert_eq!(field.surface(2.0, 2.0), None);
    /// assert_eq!(field.filled_surface(2.0, 2.0), Some(7.0));
    /// # Ok::<(), seamount::terrain::HeightFieldError>(())
    /// ```
    #[must_use]
    pub fn with_holes(mut self) -> Self {
        let Some(voids) = &self.voids else { return self };
        let mut holes = voids.clone();
        let [cells_u, cells_v] = self.cells();
        for r in 0..self.rows {
            for c in 0..self.columns {
                if voids.get(c, r) {
                    continue;
                }
                // The six triangles around a sample, by the cell and the half, as far as they are on the map.
                let around = [(0, 0, true), (0, 0, false), (1, 0, true), (0, 1, false), (1, 1, true), (1, 1, false)];
                let whole = around.into_iter().any(|(west, north, upper)| {
                    let (Some(c), Some(r)) = (c.checked_sub(west), r.checked_sub(north)) else { return false };
                    c < cells_u && r < cells_v && triangle([c, r], upper).iter().all(|&[c, r]| !voids.get(c, r))
                });
                if !whole {
                    holes.set(c, r);
                }
            }
        }
        self.holes = Some(holes);
        self
    }

    /// Whether there are holes: voids that are not filled.
    #[inline]
    #[must_use]
    pub fn has_holes(&self) -> bool {
        self.holes.is_some()
    }

    /// Whether sample `(c, r)` lies in a hole: a void, or as good as one, since no triangle without a void has it for a
    /// corner. Never where voids are filled.
    #[inline]
    #[must_use]
    pub fn is_hole(&self, c: u32, r: u32) -> bool {
        self.holes.as_ref().is_some_and(|holes| holes.get(c, r))
    }

    pub(super) fn holes(&self) -> Option<&BitGrid> {
        self.holes.as_ref()
    }

    /// Whether a triangle of the full-resolution surface is ground: none of its corners lies in a hole. `upper` is the
    /// north-east half of cell `(c, r)`, otherwise the south-west one.
    #[must_use]
    pub fn is_ground(&self, cell: [u32; 2], upper: bool) -> bool {
        triangle(cell, upper).iter().all(|&[c, r]| !self.is_hole(c, r))
    }

    /// A triangle of the ground that a point lies in or on the border of: its cell and whether it is the upper one. `None` in
    /// a hole, outside the map and for NaN.
    #[must_use]
    pub fn ground_at(&self, u: f64, v: f64) -> Option<([u32; 2], bool)> {
        let [cells_u, cells_v] = self.cells();
        if !(u >= 0.0 && v >= 0.0 && u <= f64::from(cells_u) && v <= f64::from(cells_v)) {
            return None;
        }
        let (c, r) = ((u as u32).min(cells_u - 1), (v as u32).min(cells_v - 1));
        let (fu, fv) = (u - f64::from(c), v - f64::from(r));
        let own = fu >= fv;
        if self.holes.is_none() || self.is_ground([c, r], own) {
            return Some(([c, r], own));
        }
        // On a line the point belongs to the triangles on both sides. A line further on is where it would be at 0 of the
        // next cell, so there only those behind are left to look at.
        let behind = |i: u32, f: f64| (f == 0.0).then(|| i.checked_sub(1)).flatten();
        let columns = [Some(c), behind(c, fu)];
        let rows = [Some(r), behind(r, fv)];
        rows.into_iter().flatten().flat_map(|r| columns.into_iter().flatten().map(move |c| [c, r])).find_map(|cell| {
            let (fu, fv) = (u - f64::from(cell[0]), v - f64::from(cell[1]));
            let on = [(fu >= fv, true), (fu <= fv, false)];
            on.into_iter()
                .find(|&(inside, upper)| inside && self.is_ground(cell, upper))
                .map(|(_, upper)| (cell, upper))
        })
    }

    /// The map with other samples in a rectangle of it, row by row from its north-west corner: a new map, in the memory of
    /// this one unless somebody else holds it too. `Err` gives the map back as it was if voids are concerned, in the map or
    /// in the samples (what they are filled with depends on heights far away), or the samples are of another type or number.
    pub(crate) fn overwritten(
        self: Arc<Self>,
        rect: SampleRect,
        with: &Samples,
        voids: Voids,
    ) -> Result<Self, Arc<Self>> {
        fn copy<T: Copy>(map: &mut [T], width: usize, rect: SampleRect, with: &[T]) {
            let (column, columns) = (rect.column as usize, rect.columns as usize);
            for (line, row) in with.chunks_exact(columns.max(1)).zip(rect.row as usize..) {
                map[row * width + column..][..columns].copy_from_slice(line);
            }
        }
        let is_void = is_void(with, voids);
        let heights = match with {
            Samples::U16(s) => !s.iter().any(|&raw| is_void(raw.into())),
            Samples::F32(s) => !s.iter().any(|&raw| is_void(raw.into())),
        };
        let same_type =
            matches!((&self.samples, with), (Samples::U16(_), Samples::U16(_)) | (Samples::F32(_), Samples::F32(_)));
        let fits = rect.is_within(self.columns, self.rows)
            && with.len() as u64 == u64::from(rect.columns) * u64::from(rect.rows);
        if self.voids.is_some() || !heights || !same_type || !fits {
            return Err(self);
        }
        let mut field = Arc::try_unwrap(self).unwrap_or_else(|shared| Self {
            samples: shared.samples.clone(),
            voids: None,
            holes: None,
            ..*shared
        });
        field.id = NEXT_ID.fetch_add(1, Ordering::Relaxed);
        let width = field.columns as usize;
        match (&mut field.samples, with) {
            (Samples::U16(map), Samples::U16(with)) => copy(map, width, rect, with),
            (Samples::F32(map), Samples::F32(with)) => copy(map, width, rect, with),
            _ => {}
        }
        Ok(field)
    }

    /// The smallest rectangle that holds all samples whose heights differ from those of another map of the same size; empty
    /// if none does.
    pub(crate) fn difference(&self, other: &Self) -> SampleRect {
        fn rows_of<T: PartialEq>(a: &[T], b: &[T], width: usize) -> [usize; 4] {
            let mut found = [usize::MAX, usize::MAX, 0, 0];
            for (row, (a, b)) in a.chunks(width).zip(b.chunks(width)).enumerate() {
                let differs = |(a, b): (&T, &T)| a != b;
                if let Some(first) = a.iter().zip(b).position(differs) {
                    let last = a.iter().zip(b).rposition(differs).unwrap_or(first);
                    let [u0, v0, u1, _] = found;
                    found = [u0.min(first), v0.min(row), u1.max(last), row];
                }
            }
            found
        }
        let width = self.columns as usize;
        let [u0, v0, u1, v1] = match (&self.samples, &other.samples) {
            (Samples::U16(a), Samples::U16(b)) => rows_of(a, b, width),
            (Samples::F32(a), Samples::F32(b)) => rows_of(a, b, width),
            _ => [0, 0, width - 1, self.rows as usize - 1],
        };
        if u0 == usize::MAX {
            return SampleRect { column: 0, row: 0, columns: 0, rows: 0 };
        }
        let [column, row] = [u0, v0].map(|i| i as u32);
        SampleRect { column, row, columns: u1 as u32 + 1 - column, rows: v1 as u32 + 1 - row }
    }

    /// Samples from west to east, at least 2.
    #[must_use]
    pub fn columns(&self) -> u32 {
        self.columns
    }

    /// Samples from north to south, at least 2.
    #[must_use]
    pub fn rows(&self) -> u32 {
        self.rows
    }

    /// Cells along u and v: one less than the samples.
    #[must_use]
    pub fn cells(&self) -> [u32; 2] {
        [self.columns - 1, self.rows - 1]
    }

    /// The samples, voids filled.
    #[must_use]
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// An identity that no other map of this process has or will have.
    #[must_use]
    pub fn id(&self) -> u64 {
        self.id
    }

    /// How many samples of the source were void.
    #[must_use]
    pub fn void_count(&self) -> u64 {
        self.voids.as_ref().map_or(0, BitGrid::count)
    }

    /// Whether sample `(c, r)` was void in the source (its height is then an interpolation).
    #[must_use]
    pub fn is_void(&self, c: u32, r: u32) -> bool {
        c < self.columns && r < self.rows && self.voids.as_ref().is_some_and(|v| v.get(c, r))
    }

    /// Raw value of sample `(c, r)`; indices beyond the map read its border.
    #[inline]
    #[must_use]
    pub fn raw(&self, c: u32, r: u32) -> f64 {
        let c = c.min(self.columns - 1) as usize;
        let r = r.min(self.rows - 1) as usize;
        let i = r * self.columns as usize + c;
        match &self.samples {
            Samples::U16(s) => s.get(i).map_or(0.0, |&v| f64::from(v)),
            Samples::F32(s) => s.get(i).map_or(0.0, |&v| f64::from(v)),
        }
    }

    /// Raw height of the full-resolution surface at `(u, v)`, or `None` in a hole, outside the map and for NaN. The border of
    /// a hole belongs to the ground.
    #[must_use]
    pub fn surface(&self, u: f64, v: f64) -> Option<f64> {
        if self.has_holes() {
            self.ground_at(u, v)?;
        }
        self.filled_surface(u, v)
    }

    /// Raw height of the full-resolution surface at `(u, v)` with the lids over holes, or `None` outside the map (or for NaN).
    #[must_use]
    pub fn filled_surface(&self, u: f64, v: f64) -> Option<f64> {
        let [cells_u, cells_v] = self.cells();
        if !(u >= 0.0 && v >= 0.0 && u <= f64::from(cells_u) && v <= f64::from(cells_v)) {
            return None;
        }
        let c = (u as u32).min(cells_u - 1);
        let r = (v as u32).min(cells_v - 1);
        let (fu, fv) = (u - f64::from(c), v - f64::from(r));
        let (h00, h11) = (self.raw(c, r), self.raw(c + 1, r + 1));
        Some(if fu >= fv {
            let h10 = self.raw(c + 1, r);
            h00 + fu * (h10 - h00) + fv * (h11 - h10)
        } else {
            let h01 = self.raw(c, r + 1);
            h00 + fv * (h01 - h00) + fu * (h11 - h01)
        })
    }

    /// Gradient of the raw heights at sample `(c, r)` by central differences (one-sided on the border), per cell along
    /// u and v. Normals for shading come from it, so that they do not depend on the detail drawn.
    #[must_use]
    pub fn gradient(&self, c: u32, r: u32) -> [f64; 2] {
        let (c, r) = (c.min(self.columns - 1), r.min(self.rows - 1));
        let (w, e) = (c.saturating_sub(1), (c + 1).min(self.columns - 1));
        let (n, s) = (r.saturating_sub(1), (r + 1).min(self.rows - 1));
        [(self.raw(e, r) - self.raw(w, r)) / f64::from(e - w), (self.raw(c, s) - self.raw(c, n)) / f64::from(s - n)]
    }
}

/// The corners of half a cell: the north-east half (`upper`) or the south-west one.
#[inline]
pub(super) fn triangle([c, r]: [u32; 2], upper: bool) -> [[u32; 2]; 3] {
    [[c, r], if upper { [c + 1, r] } else { [c, r + 1] }, [c + 1, r + 1]]
}

/// Where a map lies in the local frame of its node: x east along columns, y north (row 0 has the largest y), z up, the
/// origin at the south-west corner.
///
/// # Example
///
/// ```
/// use glam::DVec3;
/// use seamount::terrain::LatticeFrame;
///
/// // 3 × 2 samples, 16-bit, cells of 10 × 20 units, heights in units above -1000.
/// let frame = LatticeFrame { cells: [2, 1], cell_size: [10.0, 20.0], base: -1000.0, z_step: 1.0 };
/// assert_eq!(frame.local(DVec3::new(0.0, 0.0, 1500.0)), DVec3::new(0.0, 20.0, 500.0));
/// assert_eq!(frame.lattice(DVec3::new(20.0, 0.0, 500.0)), DVec3::new(2.0, 1.0, 1500.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatticeFrame {
    /// Cells along u and v.
    pub cells: [u32; 2],
    /// Size of a cell along x and y, in local units; positive and finite.
    pub cell_size: [f64; 2],
    /// Local z of raw value 0.
    pub base: f64,
    /// Local z per raw unit; may be zero or negative.
    pub z_step: f64,
}

impl LatticeFrame {
    /// The affine map from lattice coordinates (u, v, w) to local coordinates (x, y, z).
    #[must_use]
    pub fn to_local(&self) -> DAffine3 {
        let [dx, dy] = self.cell_size;
        DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::new(dx, -dy, self.z_step)),
            translation: DVec3::new(0.0, f64::from(self.cells[1]) * dy, self.base),
        }
    }

    /// Local coordinates of a lattice point. A lattice point gets the same bits whoever asks.
    #[inline]
    #[must_use]
    pub fn local(&self, lattice: DVec3) -> DVec3 {
        let [dx, dy] = self.cell_size;
        DVec3::new(lattice.x * dx, (f64::from(self.cells[1]) - lattice.y) * dy, self.base + lattice.z * self.z_step)
    }

    /// Lattice coordinates of a local point; w is 0 where the map is flat by construction (`z_step` 0).
    #[inline]
    #[must_use]
    pub fn lattice(&self, local: DVec3) -> DVec3 {
        let [dx, dy] = self.cell_size;
        let w = if self.z_step == 0.0 { 0.0 } else { (local.z - self.base) / self.z_step };
        DVec3::new(local.x / dx, f64::from(self.cells[1]) - local.y / dy, w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_of_bits_are_those_of_a_scan() {
        for (columns, rows, stride) in [(5u32, 7u32, 3u32), (64, 4, 5), (130, 3, 7), (67, 5, 64), (200, 2, 1)] {
            let mut grid = BitGrid::new(columns, rows);
            for i in (0..columns * rows).filter(|i| i % stride == 0 || i / 40 == 3) {
                grid.set(i % columns, i / columns);
            }
            let columns = || (0..columns).flat_map(|a| (a..columns).step_by(3).map(move |b| (a, b)));
            for (c0, c1) in columns() {
                for (r0, r1) in (0..rows).flat_map(|a| (a..rows).map(move |b| (a, b))) {
                    let mut all = (r0..=r1).flat_map(|r| (c0..=c1).map(move |c| (c, r)));
                    let any = all.clone().any(|(c, r)| grid.get(c, r));
                    assert_eq!(grid.any_in([[c0, r0], [c1, r1]]), any);
                    assert_eq!(grid.all_in([[c0, r0], [c1, r1]]), all.all(|(c, r)| grid.get(c, r)));
                }
            }
        }
    }

    /// On a grid of quarters of a cell: by the definition, over all triangles.
    #[test]
    fn ground_is_where_a_closed_triangle_without_void_is() {
        let (n, mut voids) = (7u32, Vec::new());
        for seed in 0..40u32 {
            voids.clear();
            voids.extend(
                (0..n * n).map(|i| i.wrapping_mul(2_654_435_761).wrapping_add(seed * 97_777_777) >> 24 < 6 * seed),
            );
            let samples = voids.iter().map(|&void| if void { 0 } else { 9 }).collect();
            let field = HeightField::from_u16(n, n, samples, Voids { sample: Some(0.0) }).unwrap().with_holes();
            let void = |[c, r]: [u32; 2]| voids[(r * n + c) as usize];
            for (i, j) in (0..=4 * (n - 1)).flat_map(|j| (0..=4 * (n - 1)).map(move |i| (i, j))) {
                let mut wanted = false;
                for (c, r) in (0..n - 1).flat_map(|r| (0..n - 1).map(move |c| (c, r))) {
                    let (x, y) = (i as i32 - 4 * c as i32, j as i32 - 4 * r as i32);
                    let inside = (0..=4).contains(&x) && (0..=4).contains(&y);
                    for upper in [true, false] {
                        let half = if upper { x >= y } else { x <= y };
                        wanted |= inside && half && !triangle([c, r], upper).into_iter().any(void);
                    }
                }
                let (u, v) = (f64::from(i) / 4.0, f64::from(j) / 4.0);
                assert_eq!(field.surface(u, v).is_some(), wanted, "({u}, {v})");
                if let Some((cell, upper)) = field.ground_at(u, v) {
                    assert!(field.is_ground(cell, upper) && !triangle(cell, upper).into_iter().any(void));
                }
            }
            assert_eq!(field.ground_at(f64::NAN, 1.0), None);
            assert_eq!(field.ground_at(-0.1, 1.0), None);
        }
    }
}
