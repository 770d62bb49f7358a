//! How far a coarse mesh is from the full-resolution surface: per patch, side and resolution, measured once.
//!
//! # What is measured
//!
//! The error of side `x` at resolution `k` is the largest vertical distance |drawn − full resolution| over everything that
//! the choice of `k` on that side can put on the screen, whatever the other sides choose: the tile itself; the strips at
//! its two ends when the next side has the same resolution; and its half of those strips when the next side is finer or
//! coarser, at every fineness of the diagonal.
//!
//! The difference of two piecewise linear functions is largest at a corner of their overlay: at a sample, or where an edge
//! of the coarse mesh crosses a grid line or a cell's diagonal. Edges along grid lines and cell diagonals meet those only
//! at samples; only the slanted edges of half strips (and of triangles squeezed against the border of the map) add
//! crossings. All corners are visited, so the value is exact up to rounding, which goes up.
//!
//! In a map with holes the lids over them count like the ground: what a triangle that reaches over a hole shows there is
//! bounded too. Where the outline of the holes is, see [`super::coverage`].
//!
//! # Saturation
//!
//! A mesh may have a larger error at a finer resolution. When neighbours are made to agree a side may become finer than it
//! asked for; so that this never breaks a promise, each stored error is the largest of its own and all finer ones of that
//! side.
//!
//! # Cost
//!
//! A patch of w × w cells costs about w² per resolution; each level of the tree visits the map n times, so a map of N
//! samples costs about n · N · log(N)/2 log(R) integer operations. The half strips of small patches are evaluated by
//! stencils, which are worked out once per level. Memory: 4 · n floats per patch.

use super::coverage::Coverage;
use super::height_field::{HeightField, SampleRect, Samples};
use super::hierarchy::{Hierarchy, PatchId};
use super::parts::{Half, Owner, Part, Parts, Side, UnitVertex, fan_triangles, owner};
use super::stencil::Stencil;

/// The vertical errors of all tiles of a tree, in raw units.
///
/// # Example
///
/// ```
/// use seamount::terrain::{Hierarchy, Parts, Resolutions, Side, TileErrors, generate};
///
/// let field = generate(129, 1)?;
/// let resolutions = Resolutions::new(8, 3)?;
/// let tree = Hierarchy::new(field.cells(), resolutions);
/// let errors = TileErrors::new(&field, &tree, &Parts::new(resolutions));
/// let root = tree.roots().next().unwrap();
/// // Errors do not grow with resolution.
/// assert!(errors.get(&tree, root, Side::North, 0) >= errors.get(&tree, root, Side::North, 2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct TileErrors {
    count: usize,
    errors: Vec<f32>,
    coverage: Option<Coverage>,
}

/// For each side and resolution the triangles that can appear along the diagonals at its two ends, beside lattice triangles.
pub(super) type HalfStrips = Vec<Vec<[UnitVertex; 3]>>;

impl TileErrors {
    /// Measures all patches of a tree, on all cores.
    #[must_use]
    pub fn new(field: &HeightField, tree: &Hierarchy, parts: &Parts) -> Self {
        let count = tree.resolutions().count() as usize;
        let half_strips = half_strips(tree);
        let coverage = Coverage::new(field, tree, parts, &half_strips);
        let mut made = Self { count, errors: vec![0.0f32; tree.len() * 4 * count], coverage };
        made.measure(field, tree, parts, &half_strips, |_| true);
        made
    }

    /// Measures the patches anew that have samples in a rectangle, after those have changed. Only for maps without holes, before
    /// and after.
    pub fn update(&mut self, field: &HeightField, tree: &Hierarchy, parts: &Parts, rect: SampleRect) {
        debug_assert!(
            self.coverage.is_none() && !field.has_holes(),
            "outlines of holes reach further than a rectangle"
        );
        self.measure(field, tree, parts, &half_strips(tree), |patch| rect.meets(tree.extent(patch)));
    }

    /// How far the outlines of holes are from where they belong; `None` for a map without holes.
    #[inline]
    #[must_use]
    pub fn coverage(&self) -> Option<&Coverage> {
        self.coverage.as_ref()
    }

    fn measure(
        &mut self,
        field: &HeightField,
        tree: &Hierarchy,
        parts: &Parts,
        half_strips: &HalfStrips,
        of: impl Fn(PatchId) -> bool,
    ) {
        use rayon::prelude::*;
        let stencils: Vec<Vec<Stencil>> =
            (0..=tree.depth()).map(|level| stencils(tree, level, half_strips, field.columns())).collect();
        // In the tree's own order, as the errors.
        let patches = (0..=tree.depth()).flat_map(|level| tree.patches(level));
        let all = self.errors.chunks_mut(4 * self.count).zip(patches);
        let wanted: Vec<(&mut [f32], PatchId)> = all.filter(|&(_, patch)| of(patch)).collect();
        wanted.into_par_iter().with_max_len(4).for_each(|(errors, patch)| {
            let stencils = &stencils[usize::from(patch.level)];
            Measure { field, tree, parts, half_strips, stencils, patch }.run(errors);
        });
    }

    /// The error of a side at a resolution, in raw units, not smaller than that of any finer one.
    #[inline]
    #[must_use]
    pub fn get(&self, tree: &Hierarchy, patch: PatchId, side: Side, resolution: u8) -> f64 {
        let index = (tree.index(patch) * 4 + side as usize) * self.count + usize::from(resolution);
        self.errors.get(index).map_or(f64::INFINITY, |&e| f64::from(e))
    }

    /// Bytes that the errors occupy.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.errors.as_slice()) + self.coverage.as_ref().map_or(0, Coverage::bytes)
    }
}

fn half_strips(tree: &Hierarchy) -> HalfStrips {
    let resolutions = tree.resolutions();
    let n = resolutions.count() as u8;
    let mut all = Vec::new();
    for side in Side::ALL {
        for index in 0..n {
            let mut triangles = Vec::new();
            // The strip after the side, and the one before it (after the side counter-clockwise).
            for strip in [side, side.next().next().next()] {
                for fine in index..n {
                    triangles.extend(fan_triangles(resolutions, strip, side, index, fine));
                }
            }
            all.push(triangles);
        }
    }
    all
}

/// The stencils of the half strips for the patches of one level. None where patches are so large that the stencils would be
/// too, and so few that it does not matter.
fn stencils(tree: &Hierarchy, level: u8, half_strips: &HalfStrips, columns: u32) -> Vec<Stencil> {
    const LARGEST: u32 = 256;
    if tree.size(level) > LARGEST {
        return Vec::new();
    }
    let step = tree.step(level);
    let scaled = |t: &[UnitVertex; 3]| t.map(|corner| corner.map(|x| u32::from(x) * step));
    half_strips.iter().map(|triangles| Stencil::new(triangles.iter().map(scaled), columns)).collect()
}

/// The smallest f32 that is not below.
pub(super) fn round_up(value: f64) -> f32 {
    let rounded = value as f32;
    if f64::from(rounded) < value { rounded.next_up() } else { rounded }
}

struct Measure<'a> {
    field: &'a HeightField,
    tree: &'a Hierarchy,
    parts: &'a Parts,
    half_strips: &'a HalfStrips,
    stencils: &'a [Stencil],
    patch: PatchId,
}

impl Measure<'_> {
    fn run(&self, errors: &mut [f32]) {
        let n = self.tree.resolutions().count() as usize;
        let size = self.tree.size(self.patch.level);
        let [u, v] = self.tree.origin(self.patch);
        let [cells_u, cells_v] = self.tree.cells();
        let whole = u + size <= cells_u && v + size <= cells_v;
        for k in 0..n {
            let resolution = self.tree.resolutions().get(k as u8);
            let (tiles, strips) =
                if whole { self.lattice(resolution, size / resolution) } else { self.clamped(k as u8) };
            for side in 0..4 {
                // The strips after and before the side.
                let mut worst = tiles[side].max(strips[side]).max(strips[(side + 3) % 4]);
                match self.stencils.get(side * n + k) {
                    Some(stencil) if whole => worst = worst.max(self.evaluate(stencil)),
                    _ => {
                        for triangle in &self.half_strips[side * n + k] {
                            worst = worst.max(self.triangle(triangle));
                        }
                    }
                }
                errors[side * n + k] = round_up(worst);
            }
        }
        for side in errors.chunks_mut(n) {
            for k in (1..n).rev() {
                side[k - 1] = side[k - 1].max(side[k]);
            }
        }
    }

    /// Tiles and strips of one resolution in a patch that lies within the map: halves of coarse lattice cells.
    fn lattice(&self, resolution: u32, step: u32) -> ([f64; 4], [f64; 4]) {
        let (mut tiles, mut strips) = ([0.0f64; 4], [0.0f64; 4]);
        if step == 1 {
            return (tiles, strips);
        }
        let [u, v] = self.tree.origin(self.patch);
        for j in 0..resolution {
            for i in 0..resolution {
                let halves = cell_errors(self.field, [u + i * step, v + j * step], step);
                for (half, error) in [Half::Upper, Half::Lower].into_iter().zip(halves) {
                    let target = match owner(i, j, half, resolution) {
                        Owner::Tile(side) => &mut tiles[side as usize],
                        Owner::Strip(side) => &mut strips[side as usize],
                    };
                    *target = target.max(error);
                }
            }
        }
        (tiles, strips)
    }

    /// The same in a patch that crosses the border of the map, triangle by triangle.
    fn clamped(&self, k: u8) -> ([f64; 4], [f64; 4]) {
        let worst = |part| self.parts.triangles(part).iter().map(|t| self.triangle(t)).fold(0.0, f64::max);
        (Side::ALL.map(|side| worst(Part::Tile(side, k))), Side::ALL.map(|side| worst(Part::Strip(side, k, k))))
    }

    /// The stencil at this patch, which lies within the map.
    fn evaluate(&self, stencil: &Stencil) -> f64 {
        let [u, v] = self.tree.origin(self.patch);
        let start = v as usize * self.field.columns() as usize + u as usize;
        match self.field.samples() {
            Samples::U16(samples) => stencil.worst(&samples[start..]),
            Samples::F32(samples) => stencil.worst(&samples[start..]),
        }
    }

    fn triangle(&self, triangle: &[UnitVertex; 3]) -> f64 {
        triangle_error(self.field, place(self.tree, self.patch, *triangle))
    }
}

/// Largest vertical distance of one triangle, given by its corners on the lattice, from the full-resolution surface.
#[must_use]
pub(super) fn triangle_error(field: &HeightField, corners: [[u32; 2]; 3]) -> f64 {
    let mut worst: f64 = 0.0;
    overlay(field, corners, |_, _, surface, drawn| worst = worst.max((surface - drawn).abs()));
    worst
}

/// Points of a part in lattice coordinates, some of them beyond the map where its border cuts the patch.
pub(super) fn unclamped<const N: usize>(tree: &Hierarchy, patch: PatchId, points: [UnitVertex; N]) -> [[u32; 2]; N] {
    let step = tree.step(patch.level);
    let [u, v] = tree.origin(patch);
    points.map(|[a, b]| [u + step * u32::from(a), v + step * u32::from(b)])
}

/// Points of a part in lattice coordinates, clamped to the map: the corners of a triangle, for example.
#[must_use]
pub fn place<const N: usize>(tree: &Hierarchy, patch: PatchId, points: [UnitVertex; N]) -> [[u32; 2]; N] {
    let [cells_u, cells_v] = tree.cells();
    unclamped(tree, patch, points).map(|[u, v]| [u.min(cells_u), v.min(cells_v)])
}

macro_rules! cell_errors {
    ($name:ident, $sample:ty, $number:ty, $times_step:expr) => {
        /// Largest distance of the two halves (upper, lower) of a coarse cell from the samples in it, times `step`.
        fn $name(samples: &[$sample], width: usize, [u, v]: [u32; 2], step: usize) -> [$number; 2] {
            let at = |i: usize, j: usize| -> $number { samples[(v as usize + j) * width + u as usize + i].into() };
            let (h00, h10, h01, h11) = (at(0, 0), at(step, 0), at(0, step), at(step, step));
            let scale = step as $number;
            let (mut upper, mut lower) = (0 as $number, 0 as $number);
            for j in 0..=step {
                let start = (v as usize + j) * width + u as usize;
                let row = &samples[start..=start + step];
                let y = j as $number;
                // Plane of the half, times step: at (i, j) it is step·h00 + slope_u·i + slope_v·j. It is summed up along the
                // row, and integers are shifted instead of multiplied: that runs in vectors on every processor.
                let (slope, mut plane) = (h11 - h01, scale * h00 + (h01 - h00) * y);
                for &h in &row[..=j] {
                    lower = lower.max((plane - $times_step(h.into(), step)).abs());
                    plane += slope;
                }
                let (slope, mut plane) = (h10 - h00, scale * h00 + (h11 - h10) * y + (h10 - h00) * y);
                for &h in &row[j..] {
                    upper = upper.max((plane - $times_step(h.into(), step)).abs());
                    plane += slope;
                }
            }
            [upper, lower]
        }
    };
}

// In i32 the terms stay below 4 · 4096 · 65535 < 2³¹.
cell_errors!(cell_errors_i32, u16, i32, |h: i32, step: usize| h << step.trailing_zeros());
cell_errors!(cell_errors_i64, u16, i64, |h: i64, step: usize| h << step.trailing_zeros());
cell_errors!(cell_errors_f64, f32, f64, |h: f64, step: usize| h * step as f64);

/// The same for cells of 2 × 2, which are most: five samples between others.
fn small_cell_errors<S: Copy + Into<f64>>(samples: &[S], width: usize, [u, v]: [u32; 2]) -> [f64; 2] {
    let start = v as usize * width + u as usize;
    let row = |j: usize| -> [f64; 3] {
        let row = &samples[start + j * width..][..3];
        [row[0].into(), row[1].into(), row[2].into()]
    };
    let (a, b, c) = (row(0), row(1), row(2));
    let off = |h: f64, p: f64, q: f64| (h - 0.5 * (p + q)).abs();
    let middle = off(b[1], a[0], c[2]);
    [
        off(a[1], a[0], a[2]).max(off(b[2], a[2], c[2])).max(middle),
        off(b[0], a[0], c[0]).max(off(c[1], c[0], c[2])).max(middle),
    ]
}

fn cell_errors(field: &HeightField, origin: [u32; 2], step: u32) -> [f64; 2] {
    let width = field.columns() as usize;
    let s = step as usize;
    if step == 2 {
        return match field.samples() {
            Samples::U16(samples) => small_cell_errors(samples, width, origin),
            Samples::F32(samples) => small_cell_errors(samples, width, origin),
        };
    }
    let errors: [f64; 2] = match field.samples() {
        Samples::U16(samples) if step <= 4096 => cell_errors_i32(samples, width, origin, s).map(f64::from),
        Samples::U16(samples) => cell_errors_i64(samples, width, origin, s).map(|e| e as f64),
        Samples::F32(samples) => cell_errors_f64(samples, width, origin, s),
    };
    errors.map(|e| e / f64::from(step))
}

/// Visits the corners of the overlay of one triangle, given by its corners on the lattice, with the full-resolution
/// surface: `visit(u, v, surface, drawn)` with both raw heights at each sample within the triangle and at each place where
/// one of its edges crosses a grid line or a cell's diagonal between samples.
pub fn overlay(field: &HeightField, corners: [[u32; 2]; 3], visit: impl FnMut(f64, f64, f64, f64)) {
    overlay_heights(field, corners, corners.map(|[u, v]| field.raw(u, v)), visit);
}

/// [`overlay`] for a triangle whose corners have these raw heights instead of those of their samples.
pub fn overlay_heights(
    field: &HeightField,
    corners: [[u32; 2]; 3],
    heights: [f64; 3],
    visit: impl FnMut(f64, f64, f64, f64),
) {
    match field.samples() {
        Samples::U16(samples) => Overlay { samples, width: field.columns() as usize, visit }.run(corners, heights),
        Samples::F32(samples) => Overlay { samples, width: field.columns() as usize, visit }.run(corners, heights),
    }
}

struct Overlay<'s, S, F> {
    samples: &'s [S],
    width: usize,
    visit: F,
}

impl<S: Copy + Into<f64>, F: FnMut(f64, f64, f64, f64)> Overlay<'_, S, F> {
    #[inline]
    fn at(&self, u: i64, v: i64) -> f64 {
        self.samples[v as usize * self.width + u as usize].into()
    }

    fn run(&mut self, corners: [[u32; 2]; 3], heights: [f64; 3]) {
        // From north to south.
        let mut order = [0, 1, 2];
        order.sort_unstable_by_key(|&k: &usize| corners[k][1]);
        let p = order.map(|k| corners[k].map(i64::from));
        let w = order.map(|k| heights[k]);
        let area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
        if area == 0 {
            // Flattened against the border of the map: seen from above nothing, from the side a sliver between its edges.
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                let (du, dv) = (p[b][0] - p[a][0], p[b][1] - p[a][1]);
                let steps = du.abs().max(dv.abs());
                for k in 1..steps {
                    let (u, v) = (p[a][0] + du * k / steps, p[a][1] + dv * k / steps);
                    let drawn = w[a] + (w[b] - w[a]) * k as f64 / steps as f64;
                    let surface = self.at(u, v);
                    (self.visit)(u as f64, v as f64, surface, drawn);
                }
            }
            return;
        }
        let (e1, e2) = (w[1] - w[0], w[2] - w[0]);
        let d = |a: usize, axis: usize| (p[a][axis] - p[0][axis]) as f64;
        let slope_u = (e1 * d(2, 1) - e2 * d(1, 1)) / area as f64;
        let slope_v = (e2 * d(1, 0) - e1 * d(2, 0)) / area as f64;

        // Rows between the long edge (first to last corner) and the two short ones, rounded inwards by integers.
        for (a, b) in [(0, 1), (1, 2)] {
            let skip_first = i64::from(a == 1 && p[0][1] != p[1][1]);
            for v in p[a][1] + skip_first..=p[b][1] {
                let long = crossing(p[0], p[2], v);
                let short = if p[a][1] == p[b][1] {
                    [p[a][0].min(p[b][0]), p[a][0].max(p[b][0])]
                } else {
                    crossing(p[a], p[b], v)
                };
                // `crossing` gives [ceiling, floor]: the inner integers when seen from the west and from the east.
                let (first, last) = (long[0].min(short[0]), long[1].max(short[1]));
                if first > last {
                    continue;
                }
                let base = w[0] + slope_v * (v - p[0][1]) as f64 + slope_u * (first - p[0][0]) as f64;
                let start = v as usize * self.width + first as usize;
                for (i, &surface) in self.samples[start..=start + (last - first) as usize].iter().enumerate() {
                    (self.visit)(first as f64 + i as f64, v as f64, surface.into(), base + slope_u * i as f64);
                }
            }
        }

        for (a, b) in [(0, 1), (1, 2), (0, 2)] {
            let (du, dv) = (p[b][0] - p[a][0], p[b][1] - p[a][1]);
            // Along grid lines and cell diagonals there is nothing between samples.
            if du == 0 || dv == 0 || du == dv {
                continue;
            }
            for length in [du, dv, du - dv] {
                let steps = length.abs();
                let scale = 1.0 / steps as f64;
                for k in 1..steps {
                    let s = k as f64 * scale;
                    let (u, v) = (p[a][0] as f64 + s * du as f64, p[a][1] as f64 + s * dv as f64);
                    let surface = self.surface(u, v);
                    (self.visit)(u, v, surface, w[a] + s * (w[b] - w[a]));
                }
            }
        }
    }

    /// The surface at a point of the map that does not lie on its east or south border; see `HeightField::surface`.
    #[inline]
    fn surface(&self, u: f64, v: f64) -> f64 {
        let (c, r) = (u as i64, v as i64);
        let (fu, fv) = (u - c as f64, v - r as f64);
        let (h00, h11) = (self.at(c, r), self.at(c + 1, r + 1));
        if fu >= fv {
            let h10 = self.at(c + 1, r);
            h00 + fu * (h10 - h00) + fv * (h11 - h10)
        } else {
            let h01 = self.at(c, r + 1);
            h00 + fv * (h01 - h00) + fu * (h11 - h01)
        }
    }
}

/// Where row v crosses the edge a–b that climbs in v: the integers just east and just west of it.
fn crossing(a: [i64; 2], b: [i64; 2], v: i64) -> [i64; 2] {
    let (numerator, denominator) = ((b[0] - a[0]) * (v - a[1]), b[1] - a[1]);
    let floor = numerator.div_euclid(denominator);
    [a[0] + floor + i64::from(numerator.rem_euclid(denominator) != 0), a[0] + floor]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stencils against the overlay, triangle by triangle.
    #[test]
    fn stencils_are_the_overlay() {
        let field = generate(129, 5).unwrap();
        for (min, n) in [(2, 3), (4, 2), (8, 3), (2, 5)] {
            let resolutions = Resolutions::new(min, n).unwrap();
            let tree = Hierarchy::new(field.cells(), resolutions);
            let (parts, half_strips) = (Parts::new(resolutions), half_strips(&tree));
            for level in 0..=tree.depth() {
                let stencils = stencils(&tree, level, &half_strips, field.columns());
                for patch in tree.patches(level) {
                    let measure = Measure {
                        field: &field,
                        tree: &tree,
                        parts: &parts,
                        half_strips: &half_strips,
                        stencils: &stencils,
                        patch,
                    };
                    for (stencil, triangles) in stencils.iter().zip(&half_strips) {
                        let expected = triangles.iter().map(|t| measure.triangle(t)).fold(0.0, f64::max);
                        let found = measure.evaluate(stencil);
                        assert!((found - expected).abs() <= 1e-9 * expected, "{patch:?}: {found}, not {expected}");
                    }
                }
            }
        }
    }
    use crate::terrain::{ActivePatch, Resolutions, Voids, generate, parts_of};

    /// The stored error against a scan of the drawn mesh that knows nothing of tiles: every choice of sides in every
    /// patch, at eighths of a cell.
    #[test]
    fn errors_bound_every_mesh_and_are_reached() {
        let mut reached: f64 = 0.0;
        let mut bits = 1u64;
        let noise: Vec<u16> = (0..45 * 38)
            .map(|_| {
                bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (bits >> 48) as u16
            })
            .collect();
        let noise = HeightField::from_u16(45, 38, noise, Voids::default()).unwrap();
        for field in [generate(33, 4).unwrap(), noise] {
            for (min, n) in [(2, 3), (4, 2)] {
                let resolutions = Resolutions::new(min, n).unwrap();
                let tree = Hierarchy::new(field.cells(), resolutions);
                let parts = Parts::new(resolutions);
                let errors = TileErrors::new(&field, &tree, &parts);
                for level in 0..=tree.depth() {
                    for id in tree.patches(level) {
                        for code in 0..n.pow(4) {
                            let sides = [code % n, code / n % n, code / n / n % n, code / n.pow(3)].map(|k| k as u8);
                            let patch = ActivePatch { id, sides };
                            let bound = Side::ALL
                                .iter()
                                .map(|&s| errors.get(&tree, id, s, sides[s as usize]))
                                .fold(0.0, f64::max);
                            let scanned = scan(&field, &tree, &parts, patch);
                            assert!(scanned <= bound * (1.0 + 1e-6) + 1e-6, "{patch:?}: {scanned} beyond {bound}");
                            if bound > 0.0 {
                                reached = reached.max(scanned / bound);
                            }
                        }
                    }
                }
            }
        }
        assert!(reached > 0.99, "{reached}");
    }

    fn scan(field: &HeightField, tree: &Hierarchy, parts: &Parts, patch: ActivePatch) -> f64 {
        let mut worst: f64 = 0.0;
        for part in parts_of(patch.sides) {
            for triangle in parts.triangles(part) {
                let c = place(tree, patch.id, *triangle);
                let [a, b, c] = c.map(|[u, v]| [f64::from(u), f64::from(v), field.raw(u, v)]);
                const N: u32 = 16;
                for i in 0..=N {
                    for j in 0..=N - i {
                        let (s, t) = (f64::from(i) / f64::from(N), f64::from(j) / f64::from(N));
                        let p: [f64; 3] = std::array::from_fn(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]));
                        if let Some(surface) = field.surface(p[0], p[1]) {
                            worst = worst.max((surface - p[2]).abs());
                        }
                    }
                }
            }
        }
        worst
    }

    #[test]
    fn full_resolution_has_no_error() {
        let field = generate(65, 2).unwrap();
        let resolutions = Resolutions::new(4, 2).unwrap();
        let tree = Hierarchy::new(field.cells(), resolutions);
        let parts = Parts::new(resolutions);
        for id in tree.patches(tree.depth()) {
            assert_eq!(scan(&field, &tree, &parts, ActivePatch { id, sides: [1; 4] }), 0.0);
        }
    }
}
