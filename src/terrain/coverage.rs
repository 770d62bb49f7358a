//! How far the outline of holes is from where it belongs: per patch, side and resolution, measured once, for maps with holes.
//!
//! # What is promised
//!
//! A coarse triangle is drawn if its three corners are samples of the ground. So a mesh that is not full resolution shows
//! ground over holes that lie between its corners, and leaves out ground beside holes that one of its corners lies in. The
//! promise is: **wherever the picture shows ground there is ground within τ pixels, and wherever it shows a hole there is a
//! hole within τ pixels**. What is kept here says how far away, in the map, the nearest place of the right kind is at most:
//! horizontally in cells, and in raw height. [`super::PixelError`] turns that into pixels.
//!
//! # What is measured
//!
//! The surface with its lids (see [`super::height_field`]) consists of the full-resolution triangles, each ground or hole. For
//! each coarse triangle T and each full-resolution triangle t that shares area with it: if T is drawn and t is a hole, or T is
//! not drawn and t is ground, then the points of t are shown as what they are not. Let g be any sample of the other kind. For
//! p in t the horizontal distance |p − g| and the height |h(p) − h(g)| are convex functions of p (h is linear in t), hence
//! largest at a corner of t:
//!
//! ```text
//! cells = max |y − g|,  raw = max |h(y) − h(g)|   over the corners y of t
//! ```
//!
//! bound both for all of t. For g the samples nearest to the corners of t are tried, and the nearest for all of t kept. So the
//! bound follows the size of the hole, or of the ridge beside it, and not that of T: a void by itself is √2 cells wide whatever
//! is drawn over it.
//!
//! What belongs to a side at a resolution is the same as for vertical errors ([`super::errors`]): its tile, its strips and all
//! its half strips; and as there each value is the largest of its own and all finer ones of that side.
//!
//! # Cost
//!
//! Triangles in whose box all samples are of one kind are right as they are, which 64 samples at a time tell. The others are
//! those at the rims of holes: their cells are visited one by one. (A map of 2049² whose lower third is void, with rims all over
//! it, took six times as long as vertical errors alone; one with a few holes takes hardly longer.) The nearest samples come from a distance transform of two
//! passes (Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", Theory of Computing 8, 2012), linear in
//! the number of samples; it needs 8 bytes per sample while errors are measured. Memory kept: 8 · n floats per patch.

use super::errors::{HalfStrips, place, round_up};
use super::height_field::{BitGrid, HeightField, triangle};
use super::hierarchy::{Hierarchy, PatchId};
use super::parts::{Part, Parts, Side, UnitVertex};

/// How far something is shown from where it is, at most.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Displacement {
    /// Horizontally, in cells, in any direction.
    pub cells: f64,
    /// Vertically, in raw units, up or down.
    pub raw: f64,
}

impl Displacement {
    /// The larger of both, each by itself.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self { cells: self.cells.max(other.cells), raw: self.raw.max(other.raw) }
    }
}

/// The displacements of the outlines of holes for all tiles of a tree.
#[derive(Debug, Clone)]
pub struct Coverage {
    count: usize,
    /// Cells and raw height, rounded up.
    errors: Vec<[f32; 2]>,
}

impl Coverage {
    /// Measures all patches of a tree, on all cores. `None` for a map without holes.
    #[must_use]
    pub(super) fn new(field: &HeightField, tree: &Hierarchy, parts: &Parts, half_strips: &HalfStrips) -> Option<Self> {
        use rayon::prelude::*;
        let holes = field.holes()?;
        let nearest = Nearest::new(field, holes);
        let count = tree.resolutions().count() as usize;
        let patches: Vec<PatchId> = (0..=tree.depth()).flat_map(|level| tree.patches(level)).collect();
        let mut errors = vec![[0.0f32; 2]; patches.len() * 4 * count];
        errors.par_chunks_mut(4 * count).zip(&patches).with_max_len(4).for_each(|(errors, &patch)| {
            if holes.any_in(tree.extent(patch)) {
                Measure { field, holes, nearest: &nearest, tree, parts, half_strips, patch }.run(errors);
            }
        });
        Some(Self { count, errors })
    }

    /// The displacement of a side at a resolution, not smaller than that of any finer one. Zero where the outline is right.
    #[inline]
    #[must_use]
    pub fn get(&self, tree: &Hierarchy, patch: PatchId, side: Side, resolution: u8) -> Displacement {
        let index = (tree.index(patch) * 4 + side as usize) * self.count + usize::from(resolution);
        let [cells, raw] = self.errors.get(index).copied().unwrap_or([f32::INFINITY; 2]);
        Displacement { cells: cells.into(), raw: raw.into() }
    }

    /// Bytes that the displacements occupy.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.errors.as_slice())
    }
}

/// For each sample the nearest one of the other kind: of the ground for those in holes, in a hole for those of the ground.
struct Nearest {
    columns: usize,
    of: Vec<[u32; 2]>,
}

/// Stands for "there is none".
const NOWHERE: [u32; 2] = [u32::MAX; 2];

impl Nearest {
    fn new(field: &HeightField, holes: &BitGrid) -> Self {
        let (columns, rows) = (field.columns() as usize, field.rows() as usize);
        let mut nearest = Self { columns, of: vec![NOWHERE; columns * rows] };
        for of_holes in [false, true] {
            nearest.fill(rows, |c, r| holes.get(c as u32, r as u32) == of_holes);
        }
        nearest
    }

    fn get(&self, [c, r]: [u32; 2]) -> Option<[u32; 2]> {
        let found = self.of.get(r as usize * self.columns + c as usize).copied()?;
        (found != NOWHERE).then_some(found)
    }

    /// Finds for each sample that is not wanted the nearest that is.
    fn fill(&mut self, rows: usize, wanted: impl Fn(usize, usize) -> bool + Sync) {
        use rayon::prelude::*;
        let columns = self.columns;
        // Along the columns: the row of the nearest wanted sample.
        let mut within = vec![u32::MAX; columns * rows];
        for r in 0..rows {
            for c in 0..columns {
                within[r * columns + c] = match r.checked_sub(1) {
                    _ if wanted(c, r) => r as u32,
                    Some(north) => within[north * columns + c],
                    None => u32::MAX,
                };
            }
        }
        for r in (0..rows.saturating_sub(1)).rev() {
            for c in 0..columns {
                let (own, south) = (within[r * columns + c], within[(r + 1) * columns + c]);
                let distance = |row: u32| if row == u32::MAX { usize::MAX } else { r.abs_diff(row as usize) };
                if distance(south) < distance(own) {
                    within[r * columns + c] = south;
                }
            }
        }
        // Along the rows: the lower envelope of the parabolas over the columns.
        self.of.par_chunks_mut(columns).zip(within.par_chunks(columns)).enumerate().for_each_init(
            Vec::new,
            |envelope: &mut Vec<(usize, f64)>, (r, (of, within))| {
                let height = |c: usize| {
                    let d = within[c] as f64 - r as f64;
                    d * d + (c * c) as f64
                };
                envelope.clear();
                for c in (0..columns).filter(|&c| within[c] != u32::MAX) {
                    // From where on this column is nearer than the last of the envelope.
                    let mut from = f64::NEG_INFINITY;
                    while let Some(&(last, since)) = envelope.last() {
                        from = (height(c) - height(last)) / (2.0 * (c - last) as f64);
                        if from > since {
                            break;
                        }
                        envelope.pop();
                        from = f64::NEG_INFINITY;
                    }
                    envelope.push((c, from));
                }
                let mut k = 0;
                for (c, of) in of.iter_mut().enumerate() {
                    while envelope.get(k + 1).is_some_and(|&(_, from)| from <= c as f64) {
                        k += 1;
                    }
                    if let Some(&(nearest, _)) = envelope.get(k)
                        && !wanted(c, r)
                    {
                        *of = [nearest as u32, within[nearest]];
                    }
                }
            },
        );
    }
}

struct Measure<'a> {
    field: &'a HeightField,
    holes: &'a BitGrid,
    nearest: &'a Nearest,
    tree: &'a Hierarchy,
    parts: &'a Parts,
    half_strips: &'a HalfStrips,
    patch: PatchId,
}

impl Measure<'_> {
    fn run(&self, errors: &mut [[f32; 2]]) {
        let n = self.tree.resolutions().count() as usize;
        let worst = |triangles: &[[UnitVertex; 3]]| {
            triangles.iter().map(|t| self.triangle(t)).fold(Displacement::default(), Displacement::max)
        };
        for k in 0..n {
            let index = k as u8;
            let strips = Side::ALL.map(|side| worst(self.parts.triangles(Part::Strip(side, index, index))));
            for side in Side::ALL {
                let at = side as usize;
                // The strips after and before the side.
                let found = worst(self.parts.triangles(Part::Tile(side, index)))
                    .max(strips[at])
                    .max(strips[(at + 3) % 4])
                    .max(worst(&self.half_strips[at * n + k]));
                errors[at * n + k] = [round_up(found.cells), round_up(found.raw)];
            }
        }
        for side in errors.chunks_mut(n) {
            for k in (1..n).rev() {
                side[k - 1] = [0, 1].map(|i| side[k - 1][i].max(side[k][i]));
            }
        }
    }

    /// What one coarse triangle shows as what it is not.
    fn triangle(&self, unit: &[UnitVertex; 3]) -> Displacement {
        let corners = place(self.tree, self.patch, *unit);
        let bound = |axis: usize| {
            let [a, b, c] = corners.map(|corner| corner[axis]);
            [a.min(b).min(c), a.max(b).max(c)]
        };
        let ([u0, u1], [v0, v1]) = (bound(0), bound(1));
        let samples = [[u0, v0], [u1, v1]];
        let mut worst = Displacement::default();
        if u0 == u1 || v0 == v1 || !self.holes.any_in(samples) || self.holes.all_in(samples) {
            return worst;
        }
        let drawn = corners.iter().all(|&[u, v]| !self.holes.get(u, v));
        let overlap = Overlap::new(corners);
        for r in v0..v1 {
            // Between two rows of one kind there are only triangles of that kind.
            let rows = [[u0, r], [u1, r + 1]];
            if if drawn { !self.holes.any_in(rows) } else { self.holes.all_in(rows) } {
                continue;
            }
            let column = |c: u32| [self.holes.get(c, r), self.holes.get(c, r + 1)];
            let mut west = column(u0);
            for c in u0..u1 {
                let east = column(c + 1);
                for (upper, third) in [(true, east[0]), (false, west[1])] {
                    let hole = west[0] || third || east[1];
                    if hole == drawn {
                        let small = triangle([c, r], upper);
                        if overlap.with(small) {
                            worst = worst.max(self.displacement(small, !hole));
                        }
                    }
                }
                west = east;
            }
        }
        worst
    }

    /// How far the nearest place of the other kind is from any point of a full-resolution triangle.
    fn displacement(&self, small: [[u32; 2]; 3], ground: bool) -> Displacement {
        let mut best: Option<(u64, [u32; 2])> = None;
        for corner in small {
            // A hole's triangle may have corners on the ground: they are what is looked for.
            let other = if self.holes.get(corner[0], corner[1]) == ground { Some(corner) } else { None };
            let Some(candidate) = other.or_else(|| self.nearest.get(corner)) else { continue };
            let reach =
                small.iter().map(|&[u, v]| square(u, candidate[0]) + square(v, candidate[1])).max().unwrap_or(0);
            if best.is_none_or(|(least, _)| reach < least) {
                best = Some((reach, candidate));
            }
        }
        // Where nothing of the other kind exists nothing is near it.
        let Some((reach, [u, v])) = best else {
            return Displacement { cells: f64::INFINITY, raw: f64::INFINITY };
        };
        let height = self.field.raw(u, v);
        let raw = small.iter().map(|&[u, v]| (self.field.raw(u, v) - height).abs()).fold(0.0, f64::max);
        Displacement { cells: (reach as f64).sqrt(), raw }
    }
}

fn square(a: u32, b: u32) -> u64 {
    u64::from(a.abs_diff(b)).pow(2)
}

/// Asks which full-resolution triangles share area with a triangle between lattice points. All in integers.
///
/// Two convex polygons share no area if and only if the line through an edge of one of them separates them. The edges of
/// full-resolution triangles lie along u, v and u = v.
struct Overlap {
    /// The corners, so turned that what is inside lies on the positive side of each edge.
    corners: [[i64; 2]; 3],
    /// Least and largest u, v and u − v.
    ranges: [[i64; 2]; 3],
    empty: bool,
}

fn along([u, v]: [i64; 2]) -> [i64; 3] {
    [u, v, u - v]
}

fn ranges(corners: [[i64; 2]; 3]) -> [[i64; 2]; 3] {
    let [a, b, c] = corners.map(along);
    std::array::from_fn(|k| [a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k])])
}

fn cross(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

impl Overlap {
    fn new(corners: [[u32; 2]; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| corner.map(i64::from));
        let area = cross(a, b, c);
        let corners = if area < 0 { [a, c, b] } else { [a, b, c] };
        Self { corners, ranges: ranges(corners), empty: area == 0 }
    }

    fn with(&self, small: [[u32; 2]; 3]) -> bool {
        let small = small.map(|corner| corner.map(i64::from));
        let apart = ranges(small).iter().zip(&self.ranges).any(|(a, b)| a[1] <= b[0] || b[1] <= a[0]);
        let [a, b, c] = self.corners;
        let outside = |from, to| small.iter().all(|&p| cross(from, to, p) <= 0);
        !(self.empty || apart || outside(a, b) || outside(b, c) || outside(c, a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{Resolutions, TileErrors, Voids};

    fn map(columns: u32, rows: u32, percent: u64, seed: u64) -> HeightField {
        let mut bits = seed;
        let mut next = || {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            bits >> 33
        };
        let samples =
            (0..columns * rows).map(|_| if next() % 100 < percent { 0 } else { 1 + (next() % 50) as u16 }).collect();
        HeightField::from_u16(columns, rows, samples, Voids { sample: Some(0.0) }).unwrap().with_holes()
    }

    #[test]
    fn the_nearest_samples_are_those_of_a_scan() {
        for (columns, rows, percent) in [(31, 22, 2), (31, 22, 40), (9, 70, 90), (64, 5, 99), (2, 2, 0), (17, 17, 100)]
        {
            let field = map(columns, rows, percent, u64::from(columns));
            let Some(holes) = field.holes() else { continue };
            let nearest = Nearest::new(&field, holes);
            let all = || (0..rows).flat_map(|r| (0..columns).map(move |c| [c, r]));
            for p in all() {
                let of = holes.get(p[0], p[1]);
                let distance = |q: [u32; 2]| square(p[0], q[0]) + square(p[1], q[1]);
                let wanted = all().filter(|q| holes.get(q[0], q[1]) != of).map(distance).min();
                let found = nearest.get(p);
                assert!(found.is_none_or(|q| holes.get(q[0], q[1]) != of), "{p:?} {found:?}");
                assert_eq!(found.map(distance), wanted, "{p:?} of {columns} × {rows}");
            }
        }
    }

    /// Against clipping in exact fractions: the part of the small triangle on the inner side of all three edges has an area.
    #[test]
    fn triangles_overlap_where_they_share_area() {
        let corners = |n: u32| (0..=n).flat_map(move |v| (0..=n).map(move |u| [u, v]));
        let (mut yes, mut no) = (0, 0);
        for (a, b, c) in corners(3).flat_map(|a| corners(3).flat_map(move |b| corners(3).map(move |c| (a, b, c)))) {
            let overlap = Overlap::new([a, b, c]);
            for [u, v] in corners(2) {
                for upper in [true, false] {
                    let small = triangle([u, v], upper);
                    // Points of the small triangle at 40ths, inside: shared area of lattice triangles this small holds one.
                    let inside = (1..39u32).any(|i| {
                        (1..40 - i).any(|j| {
                            let k = 40 - i - j;
                            let p = [0, 1].map(|x| i64::from(i * small[0][x] + j * small[1][x] + k * small[2][x]));
                            let [a, b, c] = [a, b, c].map(|p| p.map(|x| i64::from(x) * 40));
                            let sides = [cross(a, b, p), cross(b, c, p), cross(c, a, p)];
                            sides.iter().all(|&s| s > 0) || sides.iter().all(|&s| s < 0)
                        })
                    });
                    assert_eq!(overlap.with(small), inside, "{a:?} {b:?} {c:?} with {small:?}");
                    *if inside { &mut yes } else { &mut no } += 1;
                }
            }
        }
        assert!(yes > 10_000 && no > 10_000, "{yes} {no}");
    }

    #[test]
    fn a_void_by_itself_is_as_wide_as_its_own_triangles_whatever_covers_it() {
        let mut samples = vec![100; 129 * 129];
        samples[70 * 129 + 53] = 0;
        let field = HeightField::from_u16(129, 129, samples, Voids { sample: Some(0.0) }).unwrap().with_holes();
        let resolutions = Resolutions::new(4, 2).unwrap();
        let tree = Hierarchy::new(field.cells(), resolutions);
        let errors = TileErrors::new(&field, &tree, &Parts::new(resolutions));
        let coverage = errors.coverage().unwrap();
        for level in 0..=tree.depth() {
            for patch in tree.patches(level) {
                for side in Side::ALL {
                    for k in 0..2 {
                        let off = coverage.get(&tree, patch, side, k);
                        assert!(off.cells <= f64::from(round_up(2f64.sqrt())) && off.raw == 0.0, "{patch:?}: {off:?}");
                    }
                }
            }
        }
        let root = tree.roots().next().unwrap();
        assert!(Side::ALL.iter().any(|&side| coverage.get(&tree, root, side, 0).cells > 1.4));
    }

    #[test]
    fn displacements_do_not_grow_with_resolution_and_maps_without_holes_have_none() {
        let field = map(70, 45, 10, 3);
        let resolutions = Resolutions::new(2, 3).unwrap();
        let tree = Hierarchy::new(field.cells(), resolutions);
        let parts = Parts::new(resolutions);
        let errors = TileErrors::new(&field, &tree, &parts);
        let coverage = errors.coverage().unwrap();
        for patch in (0..=tree.depth()).flat_map(|level| tree.patches(level)) {
            for side in Side::ALL {
                let all = [0, 1, 2].map(|k| coverage.get(&tree, patch, side, k));
                assert!(all.windows(2).all(|w| w[0].cells >= w[1].cells && w[0].raw >= w[1].raw));
            }
        }
        let whole = map(70, 45, 0, 3);
        assert!(TileErrors::new(&whole, &tree, &parts).coverage().is_none());
    }
}
