//! Where the ground of a map lies in its own shadow under parallel light.
//!
//! The *shadow height* of a point (u, v) is the height below which a ray towards the light meets the ground further on: the
//! largest height of the ground ahead, each less what the ray climbs up to there. A point of the ground lies in shadow if it is
//! lower than that. One sweep over the map, away from the light, finds the shadow heights of all samples: along parallel lines
//! in the light's azimuth, one through each row (or column) of samples, a running maximum over the edges of the triangles that
//! the line crosses. Between two edges a line over the ground is straight, so nothing is missed.
//!
//! Ground nearer than one cell along the longer axis casts no shadow: whether a place is turned away from the light is told by
//! its normal, and a shadow that a slope throws on itself would be a shadow of rounding.
//!
//! The map does not know the triangles that are drawn: shadows stay as they are when detail changes.
//!
//! # Holes
//!
//! An edge casts a shadow if it borders on ground: the lid over a hole casts none. Ground is taken as solid below its surface: light
//! that enters a hill by a hole does not leave it by another.

use glam::DVec3;

use super::height_field::HeightField;

/// Parallel light in the lattice coordinates of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatticeLight {
    /// The way towards the light in columns, rows and raw units; of any length.
    pub towards: DVec3,
    /// Whether larger raw values are higher up.
    pub upwards: bool,
}

/// How deep each sample of a map lies in shadow.
///
/// # Example
///
/// ```
/// use glam::DVec3;
/// use seamount::terrain::{HeightField, LatticeLight, ShadowMap, Voids};
///
/// // A wall of height 3 in the east; light from there, which falls by one unit per cell.
/// let field = HeightField::from_u16(6, 2, [0, 0, 0, 0, 3, 0].repeat(2), Voids::default())?;
/// let shadow = ShadowMap::new(&field, &LatticeLight { towards: DVec3::new(1.0, 0.0, 1.0), upwards: true });
/// assert!(!shadow.is_shadowed(0.5, 0.5));
/// assert!(shadow.is_shadowed(1.5, 0.5));
/// # Ok::<(), seamount::terrain::HeightFieldError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ShadowMap {
    columns: u32,
    rows: u32,
    depths: Vec<f32>,
}

/// A map with its columns or rows turned such that the light is ahead: `i` counts towards it along the longer axis of its
/// azimuth, `j` along the other one.
struct Turned<'a> {
    field: &'a HeightField,
    along_u: bool,
    forward: bool,
    /// 1, or -1 where raw values run down.
    sign: f64,
    size: [usize; 2],
}

impl Turned<'_> {
    fn sample(&self, i: usize, j: usize) -> [u32; 2] {
        let i = if self.forward { i } else { self.size[0] - 1 - i };
        if self.along_u { [i as u32, j as u32] } else { [j as u32, i as u32] }
    }

    fn read(&self, i: usize, heights: &mut Vec<f64>) {
        heights.clear();
        heights.extend((0..self.size[1]).map(|j| {
            let [c, r] = self.sample(i, j);
            self.sign * self.field.raw(c, r)
        }));
    }

    /// Whether the edge between two samples borders on ground.
    fn casts(&self, a: (usize, usize), b: (usize, usize)) -> bool {
        if !self.field.has_holes() {
            return true;
        }
        let (a, b) = (self.sample(a.0, a.1), self.sample(b.0, b.1));
        if a == b {
            return !self.field.is_hole(a[0], a[1]);
        }
        let [c, r] = [a[0].min(b[0]), a[1].min(b[1])];
        let (west, north) = (c.wrapping_sub(1), r.wrapping_sub(1));
        let beside = match (a[0] != b[0], a[1] != b[1]) {
            (true, true) => [([c, r], true), ([c, r], false)],
            (true, false) => [([c, r], true), ([c, north], false)],
            _ => [([c, r], false), ([west, r], true)],
        };
        let [cells_u, cells_v] = self.field.cells();
        beside
            .into_iter()
            .any(|(cell, upper)| cell[0] < cells_u && cell[1] < cells_v && self.field.is_ground(cell, upper))
    }
}

impl ShadowMap {
    /// The shadow of a map on itself. Vertical light, or as good as that, throws none.
    ///
    /// Takes time in proportion to the samples, and 4 bytes for each.
    #[must_use]
    pub fn new(field: &HeightField, light: &LatticeLight) -> Self {
        let (columns, rows) = (field.columns(), field.rows());
        let mut map = Self { columns, rows, depths: vec![-1.0; columns as usize * rows as usize] };
        let DVec3 { x, y, z } = light.towards;
        let along_u = x.abs() >= y.abs();
        let (along, across) = if along_u { (x, y) } else { (y, x) };
        let sign = if light.upwards { 1.0 } else { -1.0 };
        // Per cell along the longer axis: what a ray moves along the other one, and how it climbs.
        let (k, climb) = (across / along.abs(), sign * z / along.abs());
        // As good as vertical: beyond f64 within the map.
        if !(4.0 * climb * f64::from(columns.max(rows))).is_finite() {
            return map;
        }
        let size = if along_u { [columns, rows] } else { [rows, columns] }.map(|n| n as usize);
        let turned = Turned { field, along_u, forward: along > 0.0, sign, size };
        map.sweep(&turned, k, climb);
        map
    }

    fn sweep(&mut self, turned: &Turned<'_>, k: f64, climb: f64) {
        let [n, m] = turned.size;
        let (mut here, mut ahead) = (Vec::with_capacity(m), Vec::with_capacity(m));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..n {
            turned.read(i, &mut here);
            (low, high) = here.iter().fold((low, high), |(low, high), &h| (low.min(h), high.max(h)));
        }
        // Depths are in units of this, so that they are floats whatever the units of the map.
        let unit = high - low + climb.abs();
        let scale = if unit > 0.0 { 1.0 / unit } else { 1.0 };
        // Shadow height where no ground is ahead: below all ground.
        let nothing = low - unit;

        // Line q passes (i, q + k i). The highest ground ahead of it, less `climb` per step from i = 0 on.
        let lean = -k * (n - 1) as f64;
        let first = lean.min(0.0).floor() as i64 - 1;
        let last = lean.max(0.0).ceil() as i64 + m as i64;
        let mut highest = vec![f64::NEG_INFINITY; (last - first + 1) as usize];
        let top = (m - 1) as f64;

        for i in (0..n).rev() {
            turned.read(i, &mut here);
            let step = i as f64;
            let offset = k * step;
            if i + 1 < n {
                // What lines cross on the column ahead is a whole step from here; what they cross before it counts from the
                // next column on.
                let (from, to) = (offset.min(offset + k), offset.max(offset + k));
                let near = ((-to).floor() as i64 - 1).max(first);
                let far = ((-from).ceil() as i64 + m as i64).min(last);
                let slots = near..=far;
                for q in slots.clone() {
                    let y = q as f64 + (offset + k);
                    if !(0.0..=top).contains(&y) {
                        continue;
                    }
                    let j = y as usize;
                    let f = y - j as f64;
                    let next = if f > 0.0 { j + 1 } else { j };
                    if turned.casts((i + 1, j), (i + 1, next)) {
                        let height = ahead[j] + f * (ahead[next] - ahead[j]);
                        let slot = &mut highest[(q - first) as usize];
                        *slot = slot.max(height - climb * (step + 1.0));
                    }
                }
                self.set_column(turned, i, &here, |j| {
                    let q = j as f64 - offset;
                    let f = q - q.floor();
                    let slot = (q.floor() as i64 - first) as usize;
                    let [a, b] = [slot, slot + 1].map(|s| (highest[s] + climb * step).max(nothing));
                    (a + f * (b - a) - here[j]) * scale
                });
                for q in slots {
                    let (y, end) = (q as f64 + offset, q as f64 + (offset + k));
                    let slot = &mut highest[(q - first) as usize];
                    let mut cross = |a: usize, b: usize, share: f64| {
                        // No crossing within the step, or none at all, gives a share beyond it, or NaN.
                        if (0.0..=1.0).contains(&share) && turned.casts((i, a), (i + 1, b)) {
                            let height = here[a] + share * (ahead[b] - here[a]);
                            *slot = slot.max(height - climb * (step + share));
                        }
                    };
                    let cells = [y.floor(), end.floor()];
                    let row = cells[0].max(cells[1]);
                    if cells[0] != cells[1] && (0.0..=top).contains(&row) {
                        cross(row as usize, row as usize, (row - y) / k);
                    }
                    let distinct = if cells[0] == cells[1] { 1 } else { 2 };
                    for cell in cells.into_iter().take(distinct).filter(|cell| (0.0..top).contains(cell)) {
                        let j = cell as usize;
                        // Diagonals run from (c, r) to (c + 1, r + 1).
                        if turned.forward {
                            cross(j, j + 1, (y - cell) / (1.0 - k));
                        } else {
                            cross(j + 1, j, (cell + 1.0 - y) / (1.0 + k));
                        }
                    }
                }
            } else {
                self.set_column(turned, i, &here, |j| (nothing - here[j]) * scale);
            }
            std::mem::swap(&mut here, &mut ahead);
        }
    }

    fn set_column(&mut self, turned: &Turned<'_>, i: usize, here: &[f64], depth: impl Fn(usize) -> f64) {
        for j in 0..here.len() {
            let [c, r] = turned.sample(i, j);
            self.depths[r as usize * self.columns as usize + c as usize] = depth(j) as f32;
        }
    }

    /// How deep the samples lie below their shadow heights, row by row from the north-west corner: above 0 in shadow. In units
    /// of the relief of the map and a step's climb of the light together.
    #[must_use]
    pub fn depths(&self) -> &[f32] {
        &self.depths
    }

    /// Depth of the ground at a place, column and row as real numbers: the shadow heights of the triangle's samples,
    /// interpolated, less the height. Places beyond the map read its border; NaN gives NaN.
    #[must_use]
    pub fn depth(&self, u: f64, v: f64) -> f64 {
        let (u, v) = (u.clamp(0.0, f64::from(self.columns - 1)), v.clamp(0.0, f64::from(self.rows - 1)));
        let (c, r) = ((u as u32).min(self.columns - 2), (v as u32).min(self.rows - 2));
        let (fu, fv) = (u - f64::from(c), v - f64::from(r));
        let at = |c: u32, r: u32| f64::from(self.depths[r as usize * self.columns as usize + c as usize]);
        let beside = if fu >= fv { at(c + 1, r) } else { at(c, r + 1) };
        (1.0 - fu.max(fv)) * at(c, r) + (fu - fv).abs() * beside + fu.min(fv) * at(c + 1, r + 1)
    }

    /// Whether the ground at a place lies in shadow.
    #[must_use]
    pub fn is_shadowed(&self, u: f64, v: f64) -> bool {
        self.depth(u, v) > 0.0
    }
}
