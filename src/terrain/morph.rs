//! Heights that blend between levels as the camera moves, instead of jumping from one mesh to the next.
//!
//! # Two resolutions
//!
//! With n = 2 resolutions every patch P has exactly one refinement: from r_min (lattice step 2s) to r_max (step s). P at
//! r_max is the same lattice as its children at r_min, so splitting P into such children shows nothing. One number per
//! patch, its **weight** w from 0 to 1, therefore says all: how much of its refinement is there. With more resolutions a
//! patch would have several refinements whose sides could differ by more than one step, and one number would not do.
//!
//! # Heights
//!
//! A vertex that is new at P's refinement (an odd multiple of s along a row or column) is drawn at
//!
//! ```text
//! H = (1 − w) · S + w · h
//! ```
//!
//! h being its sample and S the height of the coarse surface there: that of the lattice of step 2s, clamped to the map, whose
//! cells are split like those of the map. All other vertices are drawn at their samples. w is that of P inside of P, and on a
//! side the larger of the weights of the two patches that share it: both use the same number. So drawn heights are a function
//! of the place and the camera alone, whichever mesh asks for them.
//!
//! Where all new vertices have weight 0 the fine mesh *is* the coarse one, fans of strips included: their triangles lie within
//! halves of coarse cells (test `fine_meshes_without_weight_are_the_coarse_surface`). So a mesh may become finer without a jump
//! before its weights rise. The exception are cells of the coarse lattice that the east or south border of the map cuts: they
//! are not square, their diagonal does not run through the fine lattice, and there the mesh does jump; see below.
//!
//! # Which weights
//!
//! Let e say how far P is from being good enough at r_min, 1 being where its refinement has to be complete ([`Urgency`]). Then
//! w = clamp(2e − 1, 0, 1): nothing of the refinement up to e = 1/2, all of it from e = 1 on. [`MorphErrors`] and the boxes over
//! which they are projected are saturated so that e is at least twice that of every patch of the next level that touches P, be
//! it in a corner. So if a patch has any weight, all the patches of the level above that it touches have weight 1: they are
//! complete, and may be split. No rounding can break this: boxes are nested, every operation on the way from a box to e is
//! monotone in floats as well, and doubling is exact. (The test against the view is not, by a few ulp; a box that is taken for
//! out of view is. At worst a patch out of view has weight beside one that was left coarse, which is then split, as for any
//! other metric.) A box reaches so far around its patch that what is seen of the patch, up to the triangles on both sides of its
//! sides, is within the boxes of both neighbours: weights do not jump where a patch comes into view.
//!
//! # What is promised
//!
//! **The error.** M, the error of P, counts every mixture of weights at its new vertices. All weights in P and on its sides are at
//! least w, so the drawn surface is a mean of the complete refinement, with weight w, and of some mixture, with weight 1 − w. The
//! complete refinement is the children at r_min, whose errors are at most half as large as P's saturated one. So the error is at
//! most M · ((1 − w) + w / 2), and with w = 2e − 1 that is e · (3/2 − e) of the error that stands for e = 1: at most 9/16 of it.
//! Where e ≥ 1 the patch is complete and the question passes to its children; complete leaves are exact. So e = 1 may stand for
//! 16/9 of the error allowed; it stands for 7/4 of it, and the 1.6 % in between are more than all rounding to f32 on the way.
//!
//! **The outlines of holes.** Which triangles are drawn depends on the mesh and not on weights. A patch is drawn at r_min only
//! where e ≤ 1/2, so e is also at least half of what its outline at r_min is off (see [`super::coverage`]) over τ; with more
//! refinement it is drawn as its children are at r_min, and the question passes to them. Both are saturated alike.
//!
//! **A jump between two frames.** Let the camera move by Δ without turning, Z be the smallest depth of the boxes of a patch and
//! of those beside it, r the longest ray to it per unit of depth, θ the largest angle between such a ray and the vertical. The
//! error in pixels is proportional to L/Z (see [`super::pixel_error`]). A ray changes by at most r · Δ/Z, so L by at most |a|
//! times that, and L ≥ |a| · sin θ: e changes by at most e · κ · Δ/Z, κ = 1 + r / sin θ, and w by twice as much. What
//! weights move is at most the whole width of the mixture, 2 · e · 7/4 · τ pixels, and what is displaced already, by τ at most,
//! changes by τ · κ · Δ/Z. With e ≤ 1 (beyond it the weight is 1 and stays there) a drawn point moves by at most
//!
//! ```text
//! (7 + 1) · τ · κ · Δ/Z   pixels
//! ```
//!
//! more than the full-resolution surface does, in proportion to the step of the camera; without morphing it is up to 2τ however
//! slowly the camera moves. (To first order in Δ/Z; with Z the smallest depth on the way it holds for any step.)
//!
//! **At the border of the map** the exception above is left: a jump is at most the error of the mesh before and of that after,
//! at e ≤ 1/2: twice 7/8 of τ. `docs/morph.md` has measurements of all this.

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, DVec4};

use super::coverage::{Coverage, Displacement};
use super::errors::{overlay_heights, place, round_up};
use super::height_field::{HeightField, Samples};
use super::hierarchy::{Hierarchy, PatchId};
use super::parts::{Parts, Side, UnitVertex};
use super::pixel_error::{LatticeView, PixelProjection, pixels_of};
use super::selection::{Demand, LodEye, Metric, Precision};

/// How much of the refinement of a patch is drawn, 0 to 1: at its sides and inside of it.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PatchWeights {
    /// On the north, east, south and west side.
    pub sides: [f32; 4],
    /// Everywhere else.
    pub inside: f32,
}

impl PatchWeights {
    /// The weight at a place in the patch; `last` is r_max. Corners are vertices of every mesh and have no use for one.
    #[must_use]
    pub(super) fn at(&self, [a, b]: UnitVertex, last: u32) -> f32 {
        let [n, e, s, w] = self.sides;
        if b == 0 {
            n
        } else if u32::from(a) == last {
            e
        } else if u32::from(b) == last {
            s
        } else if a == 0 {
            w
        } else {
            self.inside
        }
    }
}

/// Along which axes a vertex of the lattice of step `step` is new at its patch's refinement: at odd multiples of the step. Places
/// clamped to the border are vertices of every mesh.
pub(super) fn is_new(place: [u32; 2], step: u32, cells: [u32; 2]) -> [bool; 2] {
    [0, 1].map(|k| (place[k] / step) % 2 == 1 && place[k] != cells[k])
}

/// Height at a vertex of the lattice of step `step`, new along these axes, of the surface of twice the step.
pub(super) fn coarse_height(field: &HeightField, place: [u32; 2], new: [bool; 2], step: u32) -> f64 {
    let cells = field.cells();
    let low = [0, 1].map(|k| if new[k] { place[k] - step } else { place[k] });
    let high = [0, 1].map(|k| if new[k] { (place[k] + step).min(cells[k]) } else { place[k] });
    let [fu, fv] = [0, 1].map(|k| if new[k] { f64::from(step) / f64::from(high[k] - low[k]) } else { 0.0 });
    let (h00, h11) = (field.raw(low[0], low[1]), field.raw(high[0], high[1]));
    if fu >= fv {
        let h10 = field.raw(high[0], low[1]);
        h00 + fu * (h10 - h00) + fv * (h11 - h10)
    } else {
        let h01 = field.raw(low[0], high[1]);
        h00 + fv * (h01 - h00) + fu * (h11 - h01)
    }
}

/// Height of a vertex as it is drawn: what the vertex shader computes in f32.
pub(super) fn morphed_height(field: &HeightField, place: [u32; 2], step: u32, weight: f32) -> f64 {
    let height = field.raw(place[0], place[1]);
    let weight = f64::from(weight);
    if weight >= 1.0 {
        return height;
    }
    let new = is_new(place, step, field.cells());
    if new == [false; 2] {
        return height;
    }
    let coarse = coarse_height(field, place, new, step);
    coarse + weight * (height - coarse)
}

/// Says how far a patch is from being good enough at its smallest resolution.
pub trait Urgency {
    /// e: 1 where the refinement has to be complete, up to 1/2 where nothing of it is needed. From 0 to infinity, never NaN, and
    /// at least twice that of every patch of the next level that touches this one.
    fn urgency(&self, tree: &Hierarchy, patch: PatchId) -> f64;
}

/// The weight of a patch: 0 up to e = 1/2, 1 from e = 1 on.
pub(super) fn weight(urgency: f64) -> f32 {
    (2.0 * urgency - 1.0).clamp(0.0, 1.0) as f32
}

/// What weights ask of the patches: those that touch a patch of the next level with any weight are split; otherwise all six
/// triangles around a vertex with weight have to be there. Around one on a side they lie in the tile across it and in the
/// strips at its ends, which are lattice triangles if the two sides next to it are fine too.
pub(super) struct Graded<'w> {
    pub(super) weights: &'w [f32],
}

impl Graded<'_> {
    fn weight(&self, tree: &Hierarchy, patch: PatchId) -> f32 {
        self.weights.get(tree.index(patch)).copied().unwrap_or(0.0)
    }
}

impl Metric for Graded<'_> {
    fn demand(&self, tree: &Hierarchy, patch: PatchId) -> Demand {
        let own = self.weight(tree, patch);
        if own >= 1.0 && tree.touching_below(patch).any(|finer| self.weight(tree, finer) > 0.0) {
            return Demand::Split;
        }
        if own > 0.0 {
            return Demand::Keep([1; 4]);
        }
        let across = Side::ALL
            .map(|side| tree.neighbour(patch, side).is_some_and(|neighbour| self.weight(tree, neighbour) > 0.0));
        Demand::Keep(Side::ALL.map(|side| {
            let beside = across[side.next() as usize] || across[side.next().opposite() as usize];
            u8::from(across[side as usize] || beside)
        }))
    }
}

/// What is known of one patch, saturated; all in raw units.
#[derive(Debug, Clone, Copy, Default)]
struct Bound {
    /// Largest vertical error.
    error: f32,
    /// Smallest and largest height of the box.
    low: f32,
    high: f32,
}

/// The vertical errors of the patches of a tree whose new vertices may have any weight, saturated for [`Urgency`].
///
/// The error of a patch is the largest vertical distance |drawn − full resolution| over it, whatever weights from 0 to 1 its
/// new vertices have. Over a triangle of the fine lattice the drawn height is linear in each vertex's, so it lies between
/// two planes: through the larger of h and S at each corner and through the smaller. Their distances from the samples are the
/// error. Where the border cuts a patch every part that can be drawn is measured, with the same two planes and all crossings.
///
/// The stored error is the largest of the patch's own and twice those of the patches of the next level that touch it.
/// Memory: three floats per patch.
///
/// # Example
///
/// ```
/// use seamount::terrain::{Hierarchy, MorphErrors, Parts, Resolutions, generate};
///
/// let field = generate(129, 1)?;
/// let resolutions = Resolutions::new(8, 2)?;
/// let tree = Hierarchy::new(field.cells(), resolutions);
/// let errors = MorphErrors::new(&field, &tree, &Parts::new(resolutions));
/// let root = tree.roots().next().unwrap();
/// for child in tree.children(root) {
///     assert!(errors.get(&tree, root) >= 2.0 * errors.get(&tree, child));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct MorphErrors {
    bounds: Vec<Bound>,
    /// How far the outlines of holes are off at r_min, saturated like the errors: cells and raw height. For maps with holes.
    outlines: Option<Vec<[f32; 2]>>,
}

impl MorphErrors {
    /// Measures all patches of a tree, on all cores. Only trees of two resolutions can be morphed; for others the errors are
    /// those of the finest two.
    #[must_use]
    pub fn new(field: &HeightField, tree: &Hierarchy, parts: &Parts) -> Self {
        use rayon::prelude::*;
        let mut bounds = vec![Bound::default(); tree.len()];
        for level in (0..=tree.depth()).rev() {
            let [columns, rows] = tree.grid(level).map(|n| n as usize);
            let first = tree.index(PatchId { level, column: 0, row: 0 });
            let (coarser, finer) = bounds.split_at_mut(first + columns * rows);
            let finer = &*finer;
            coarser[first..].par_chunks_mut(columns).enumerate().for_each(|(row, bounds)| {
                for (column, bound) in bounds.iter_mut().enumerate() {
                    let patch = PatchId { level, column: column as u32, row: row as u32 };
                    let below = tree.touching_below(patch).map(|id| finer[tree.index(id) - first - columns * rows]);
                    *bound = below.fold(own_bound(field, tree, parts, patch), |bound, below| Bound {
                        error: bound.error.max(2.0 * below.error),
                        low: bound.low.min(below.low),
                        high: bound.high.max(below.high),
                    });
                }
            });
        }
        Self { bounds, outlines: None }
    }

    /// The same for a map with holes, whose outlines are off by so much.
    #[must_use]
    pub(super) fn with_outlines(mut self, tree: &Hierarchy, coverage: &Coverage) -> Self {
        let mut outlines = vec![[0.0f32; 2]; tree.len()];
        for level in (0..=tree.depth()).rev() {
            for patch in tree.patches(level) {
                // Nothing of the refinement is drawn: r_min on all sides.
                let own = Side::ALL
                    .map(|side| coverage.get(tree, patch, side, 0))
                    .into_iter()
                    .fold(Displacement::default(), Displacement::max);
                let own = [round_up(own.cells), round_up(own.raw)];
                let below = tree.touching_below(patch).map(|id| outlines[tree.index(id)]);
                outlines[tree.index(patch)] =
                    below.fold(own, |own, below| std::array::from_fn(|k| own[k].max(2.0 * below[k])));
            }
        }
        self.outlines = Some(outlines);
        self
    }

    /// How far the outlines of holes are off at most in a patch that is drawn at r_min.
    fn outline(&self, tree: &Hierarchy, patch: PatchId) -> Displacement {
        let [cells, raw] = self.outlines.as_ref().map_or([0.0; 2], |outlines| outlines[tree.index(patch)]);
        Displacement { cells: cells.into(), raw: raw.into() }
    }

    /// The saturated error of a patch, in raw units.
    #[inline]
    #[must_use]
    pub fn get(&self, tree: &Hierarchy, patch: PatchId) -> f64 {
        f64::from(self.bounds[tree.index(patch)].error)
    }

    /// Bounds of how many pixels a patch is off as seen from a camera, whatever of its refinement is drawn: by its vertical error,
    /// and, drawn at r_min, by the outlines of holes. Infinite where there is no bound; 0 out of view. For boxes that are nested the
    /// order is kept, rounding included.
    fn pixels(&self, tree: &Hierarchy, patch: PatchId, view: &LatticeView) -> [f64; 2] {
        let error = self.get(tree, patch);
        let outline = self.outline(tree, patch);
        let [low, high] = self.hull(tree, patch);
        let perfect = error == 0.0 && outline == Displacement::default();
        if perfect || view.frustum.excludes(low, high) {
            return [0.0; 2];
        }
        let (near, least, most) = match view.projection {
            PixelProjection::Orthographic { .. } => (1.0, DVec2::ZERO, DVec2::ZERO),
            PixelProjection::Perspective { tangents: [leftmost, rightmost], .. } => {
                // Sums of the smallest and of the largest terms, so that rounding keeps the order of nested boxes.
                let range = |f: DVec4| {
                    let [x, y, z] = [(f.x, low.x, high.x), (f.y, low.y, high.y), (f.z, low.z, high.z)]
                        .map(|(n, a, b)| ((n * a).min(n * b), (n * a).max(n * b)));
                    [x.0 + y.0 + z.0 + f.w, x.1 + y.1 + z.1 + f.w]
                };
                let [near, far] = range(view.depth);
                if near <= 0.0 {
                    return [f64::INFINITY; 2];
                }
                let tangent = |f: DVec4| {
                    let [least, most] = range(f);
                    [least / if least > 0.0 { far } else { near }, most / if most > 0.0 { near } else { far }]
                };
                let ([x0, x1], [y0, y1]) = (tangent(view.right), tangent(view.up));
                let [least, most] = [DVec2::new(x0, y0), DVec2::new(x1, y1)].map(|t| t.clamp(leftmost, rightmost));
                (near, least, most)
            }
        };
        let spread = view.spread(least, most);
        let vertical = pixels_of(error * spread, near);
        if outline == Displacement::default() {
            return [vertical, 0.0];
        }
        let raw = outline.raw + error;
        let nearer = match view.projection {
            PixelProjection::Orthographic { .. } => 0.0,
            PixelProjection::Perspective { .. } => {
                let depth = view.depth;
                outline.cells * depth.x.hypot(depth.y) + raw * depth.z.abs()
            }
        };
        [vertical, pixels_of(outline.cells * view.spread_of_cells(least, most) + raw * spread, near - nearer)]
    }

    /// A bound of how many pixels what is drawn of a patch with these weights is off as seen from a camera, by the promise of
    /// the module's documentation: M · ((1 − w) + w / 2) for a patch that is on its way, that of its children at r_min for a
    /// complete one, and nothing for a complete leaf. Infinite where there is no bound; 0 out of view.
    #[must_use]
    pub fn pixels_drawn(&self, tree: &Hierarchy, patch: PatchId, weights: &PatchWeights, view: &LatticeView) -> f64 {
        let w = f64::from(weights.inside);
        let own = || self.pixels(tree, patch, view);
        // With any weight its mesh is that of its children at r_min, and so are the outlines.
        let children = || {
            let children = tree.children(patch).map(|child| self.pixels(tree, child, view));
            children.fold([0.0f64; 2], |worst, pixels| [0, 1].map(|k| worst[k].max(pixels[k])))
        };
        let [error, outline] = match patch.level < tree.depth() {
            _ if w <= 0.0 => own(),
            true if w >= 1.0 => children(),
            true => [own()[0] * (1.0 - 0.5 * w), children()[1]],
            false if w >= 1.0 => [0.0; 2],
            false => [own()[0] * (1.0 - w), 0.0],
        };
        error.max(outline)
    }

    /// A bound of the vertical error of what is drawn of a patch with these weights, in raw units. A complete patch is its
    /// children at r_min, whose errors are at most half of its own; complete leaves are exact. Where the border of the map cuts a
    /// patch its slivers are counted.
    #[must_use]
    pub fn drawn(&self, tree: &Hierarchy, patch: PatchId, weights: &PatchWeights) -> f64 {
        let [[u0, v0], [u1, v1]] = tree.extent(patch);
        let size = tree.size(patch.level);
        let whole = u1 - u0 == size && v1 - v0 == size;
        let complete = weights.inside >= 1.0 && weights.sides.iter().all(|&weight| weight >= 1.0);
        match whole && complete {
            true if patch.level == tree.depth() => 0.0,
            true => 0.5 * self.get(tree, patch),
            false => self.get(tree, patch),
        }
    }

    /// The box over which the error of a patch is projected, in lattice coordinates: south-east and upwards from `low` to
    /// `high`. It holds the boxes of all patches of the next level that touch the patch.
    #[must_use]
    pub fn hull(&self, tree: &Hierarchy, patch: PatchId) -> [DVec3; 2] {
        let Bound { low, high, .. } = self.bounds[tree.index(patch)];
        let [[u0, v0], [u1, v1]] = widened(tree, patch);
        [DVec3::new(u0.into(), v0.into(), low.into()), DVec3::new(u1.into(), v1.into(), high.into())]
    }

    /// Bytes that the errors occupy.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.bounds.as_slice()) + self.outlines.as_ref().map_or(0, |o| size_of_val(o.as_slice()))
    }
}

/// The extent of a patch with as much around it as the patches of the next level that touch it have around them: a leaf has a
/// cell, and a level adds a child's side. So what is drawn of the patch in view, up to the triangles at its sides, is in view of
/// the patches on both.
fn widened(tree: &Hierarchy, patch: PatchId) -> [[u32; 2]; 2] {
    let around = tree.size(patch.level) - tree.size(tree.depth()) + 1;
    let [low, high] = tree.extent(patch);
    let cells = tree.cells();
    [low.map(|x| x.saturating_sub(around)), [0, 1].map(|k| (high[k] + around).min(cells[k]))]
}

fn own_bound(field: &HeightField, tree: &Hierarchy, parts: &Parts, patch: PatchId) -> Bound {
    let size = tree.size(patch.level);
    let [u, v] = tree.origin(patch);
    let cells = tree.cells();
    let whole = u + size <= cells[0] && v + size <= cells[1];
    let error = if whole {
        match field.samples() {
            Samples::U16(samples) => lattice_error(samples, field, tree, patch),
            Samples::F32(samples) => lattice_error(samples, field, tree, patch),
        }
    } else {
        parts.all_triangles().iter().map(|t| triangle_error(field, tree, patch, t)).fold(0.0, f64::max)
    };
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    if patch.level == tree.depth() {
        let [[u0, v0], [u1, v1]] = widened(tree, patch);
        for (u, v) in (v0..=v1).flat_map(|v| (u0..=u1).map(move |u| (u, v))) {
            let h = field.raw(u, v) as f32;
            (low, high) = (low.min(h), high.max(h));
        }
    }
    Bound { error: round_up(error), low, high }
}

/// A patch within the map: fine cells between the two planes of each half.
fn lattice_error<S: Copy + Into<f64>>(samples: &[S], field: &HeightField, tree: &Hierarchy, patch: PatchId) -> f64 {
    let step = tree.step(patch.level);
    let [u, v] = tree.origin(patch);
    let r = tree.resolutions().max();
    let mut worst: f64 = 0.0;
    for j in (0..r).step_by(2) {
        for i in (0..r).step_by(2) {
            // Smaller and larger of sample and coarse surface at the nine vertices of a coarse cell.
            let range = |a: u32, b: u32| {
                let place = [u + (i + a) * step, v + (j + b) * step];
                let height = field.raw(place[0], place[1]);
                match [a == 1, b == 1] {
                    [false, false] => [height; 2],
                    new => {
                        let coarse = coarse_height(field, place, new, step);
                        [height.min(coarse), height.max(coarse)]
                    }
                }
            };
            let ranges: [[[f64; 2]; 3]; 3] = [0, 1, 2].map(|b| [0, 1, 2].map(|a| range(a, b)));
            if step == 1 {
                worst = ranges.iter().flatten().fold(worst, |worst, [low, high]| worst.max(high - low));
                continue;
            }
            for (b, a) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let corners = [ranges[b][a], ranges[b][a + 1], ranges[b + 1][a], ranges[b + 1][a + 1]];
                let [a, b] = [a as u32, b as u32];
                let start = (v + (j + b) * step) as usize * field.columns() as usize + (u + (i + a) * step) as usize;
                worst = worst.max(cell_error(&samples[start..], field.columns() as usize, step as usize, corners));
            }
        }
    }
    worst
}

/// Largest distance of the samples of a cell from the farther of two surfaces above it, given by their heights (lower, upper)
/// at its north-west, north-east, south-west and south-east corner.
fn cell_error<S: Copy + Into<f64>>(samples: &[S], width: usize, step: usize, corners: [[f64; 2]; 4]) -> f64 {
    let [nw, ne, sw, se] = corners;
    let mut worst: f64 = 0.0;
    let scale = 1.0 / step as f64;
    for j in 0..=step {
        let row = &samples[j * width..][..=step];
        let y = j as f64 * scale;
        let mut along = |row: &[S], start: usize, at_start: [f64; 2], slope: [f64; 2]| {
            for (i, &h) in row.iter().enumerate() {
                let (x, h) = ((start + i) as f64 * scale, h.into());
                let [low, high] = [0, 1].map(|k| at_start[k] + slope[k] * x);
                worst = worst.max((high - h).max(h - low));
            }
        };
        let both = |f: &dyn Fn(usize) -> f64| [f(0), f(1)];
        along(&row[..=j], 0, both(&|k| nw[k] + (sw[k] - nw[k]) * y), both(&|k| se[k] - sw[k]));
        along(&row[j..], j, both(&|k| nw[k] + (se[k] - ne[k]) * y), both(&|k| ne[k] - nw[k]));
    }
    worst
}

/// Any triangle of a part, at every corner of its overlay.
fn triangle_error(field: &HeightField, tree: &Hierarchy, patch: PatchId, triangle: &[UnitVertex; 3]) -> f64 {
    let corners = place(tree, patch, *triangle);
    let step = tree.step(patch.level);
    let ranges: [[f64; 2]; 3] = std::array::from_fn(|k| {
        let height = field.raw(corners[k][0], corners[k][1]);
        match is_new(corners[k], step, tree.cells()) {
            [false, false] => [height; 2],
            new => {
                let coarse = coarse_height(field, corners[k], new, step);
                [height.min(coarse), height.max(coarse)]
            }
        }
    });
    let mut worst: f64 = 0.0;
    for bound in [0, 1] {
        let heights = ranges.map(|range| range[bound]);
        overlay_heights(field, corners, heights, |_, _, surface, drawn| worst = worst.max((surface - drawn).abs()));
    }
    worst
}

/// The error of a patch, in errors allowed, at which its refinement has to be complete; see the module's documentation.
const COMPLETE: f64 = 1.75;

/// Urgency by the error in pixels: e = 1 where the error of the patch, whatever of its refinement is drawn, may be 7/4 of τ.
#[derive(Debug, Clone, Copy)]
pub struct MorphPixelError<'t> {
    /// τ, the error allowed in pixels, from 0 up.
    pub tolerance: f64,
    /// The camera.
    pub view: &'t LatticeView,
    /// Errors of the patches.
    pub errors: &'t MorphErrors,
}

impl Urgency for MorphPixelError<'_> {
    fn urgency(&self, tree: &Hierarchy, patch: PatchId) -> f64 {
        if self.tolerance == f64::INFINITY {
            return 0.0;
        }
        let [error, outline] = self.errors.pixels(tree, patch, self.view);
        // Nothing has no urgency, even at τ = 0.
        let urgent = |pixels: f64, at: f64| if pixels == 0.0 { 0.0 } else { pixels / (at * self.tolerance) };
        // Outlines are those of r_min up to e = 1/2.
        urgent(error, COMPLETE).max(urgent(outline, 2.0))
    }
}

impl Urgency for Precision {
    /// e = 2 ρ · l / d, l being the length of a side and d the distance from the eye to the patch's surroundings: where the
    /// published metric asks for more than r_min, on half its distance, the refinement is complete.
    fn urgency(&self, tree: &Hierarchy, patch: PatchId) -> f64 {
        let squared = match self.eye {
            LodEye::Everywhere { distance } => distance * distance,
            LodEye::Point { u, v, height } => {
                let around = tree.size(patch.level) - tree.size(tree.depth()) + 1;
                let size = f64::from(tree.size(patch.level));
                let outside = |x: f64, origin: u32| {
                    let (low, high) = (f64::from(origin) - f64::from(around), f64::from(origin) + f64::from(around));
                    (low - x).max(x - high - size).max(0.0)
                };
                let [u0, v0] = tree.origin(patch);
                outside(u, u0).powi(2) + outside(v, v0).powi(2) + height * height
            }
        };
        let urgency = 2.0 * self.precision * f64::from(tree.size(patch.level)) / squared.sqrt();
        if urgency.is_nan() { f64::INFINITY } else { urgency }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{Resolutions, Voids, generate, parts_of, random::bits};

    fn noise(columns: u32, rows: u32) -> HeightField {
        let mut state = u64::from(columns * 1000 + rows);
        let samples = (0..columns * rows).map(|_| (bits(&mut state) >> 48) as u16).collect();
        HeightField::from_u16(columns, rows, samples, Voids::default()).unwrap()
    }

    /// The surface of the lattice of twice the step at any place, written down without the code above.
    fn coarse_surface(field: &HeightField, step: u32, u: f64, v: f64) -> f64 {
        let [cu, cv] = field.cells();
        let cell = |x: f64, cells: u32| {
            let low = ((x as u32) / (2 * step) * (2 * step)).min((cells - 1) / (2 * step) * (2 * step));
            let high = (low + 2 * step).min(cells);
            (low, high, (x - f64::from(low)) / f64::from(high - low))
        };
        let ((u0, u1, fu), (v0, v1, fv)) = (cell(u, cu), cell(v, cv));
        let at = |u, v| field.raw(u, v);
        // The diagonal runs from (u0, v0) to (u1, v1).
        if fu >= fv {
            at(u0, v0) * (1.0 - fu) + at(u1, v0) * (fu - fv) + at(u1, v1) * fv
        } else {
            at(u0, v0) * (1.0 - fv) + at(u0, v1) * (fv - fu) + at(u1, v1) * fu
        }
    }

    /// Places of a triangle, in 32nds, with the height of the plane through these corners.
    fn points(corners: [[u32; 2]; 3], heights: [f64; 3]) -> impl Iterator<Item = [f64; 3]> {
        const N: u32 = 32;
        let p: [[f64; 3]; 3] =
            std::array::from_fn(|k| [f64::from(corners[k][0]), f64::from(corners[k][1]), heights[k]]);
        (0..=N).flat_map(|i| (0..=N - i).map(move |j| (i, j))).map(move |(i, j)| {
            let (s, t) = (f64::from(i) / f64::from(N), f64::from(j) / f64::from(N));
            std::array::from_fn(|k| p[0][k] + s * (p[1][k] - p[0][k]) + t * (p[2][k] - p[0][k]))
        })
    }

    #[test]
    fn fine_meshes_without_weight_are_the_coarse_surface() {
        for (min, level) in [(2, 0), (2, 1), (4, 0), (8, 0)] {
            let resolutions = Resolutions::new(min, 2).unwrap();
            let field = noise(4 * min + 1, 4 * min + 1);
            let (tree, parts) = (Hierarchy::new(field.cells(), resolutions), Parts::new(resolutions));
            for id in tree.patches(level) {
                let step = tree.step(level);
                for code in 0..16u8 {
                    for part in parts_of([code & 1, code >> 1 & 1, code >> 2 & 1, code >> 3]) {
                        for triangle in parts.triangles(part) {
                            let corners = place(&tree, id, *triangle);
                            let heights = std::array::from_fn(|k| morphed_height(&field, corners[k], step, 0.0));
                            for [u, v, drawn] in points(corners, heights) {
                                let coarse = coarse_surface(&field, step, u, v);
                                assert!((drawn - coarse).abs() < 1e-6, "{part:?} {triangle:?} at ({u}, {v})");
                            }
                        }
                    }
                }
            }
        }
    }

    /// At vertices of cells that the border cuts as well.
    #[test]
    fn coarse_heights_lie_on_the_coarse_surface() {
        for (columns, rows) in [(34, 19), (20, 35), (8, 6), (2, 2), (3, 5)] {
            let field = noise(columns, rows);
            let resolutions = Resolutions::new(2, 2).unwrap();
            let tree = Hierarchy::new(field.cells(), resolutions);
            let parts = Parts::new(resolutions);
            for level in 0..=tree.depth() {
                let step = tree.step(level);
                for id in tree.patches(level) {
                    for unit in parts.all_triangles().iter().flatten() {
                        let [[u, v]] = place(&tree, id, [*unit]);
                        let new = is_new([u, v], step, tree.cells());
                        let expected = coarse_surface(&field, step, f64::from(u), f64::from(v));
                        let found = coarse_height(&field, [u, v], new, step);
                        assert!((found - expected).abs() < 1e-6, "({u}, {v}) at step {step}: {found}, not {expected}");
                        if new == [false; 2] {
                            assert_eq!(found, field.raw(u, v));
                        }
                    }
                }
            }
        }
    }

    /// The error of each patch against a scan with random weights at each vertex, none and all among them.
    #[test]
    fn errors_bound_every_mixture_and_are_reached() {
        let mut state = 5;
        let mut reached: f64 = 0.0;
        for field in [generate(33, 4).unwrap(), noise(45, 38), noise(33, 33)] {
            for min in [2, 4] {
                let resolutions = Resolutions::new(min, 2).unwrap();
                let (tree, parts) = (Hierarchy::new(field.cells(), resolutions), Parts::new(resolutions));
                let last = resolutions.max();
                for level in 0..=tree.depth() {
                    let (size, step) = (tree.size(level), tree.step(level));
                    for id in tree.patches(level) {
                        let bound = own_bound(&field, &tree, &parts, id);
                        let [u, v] = tree.origin(id);
                        let whole = u + size <= tree.cells()[0] && v + size <= tree.cells()[1];
                        let mut worst: f64 = 0.0;
                        for run in 0..8 {
                            let weights: Vec<f32> = (0..(last + 1) * (last + 1))
                                .map(|_| match run {
                                    0 => 0.0,
                                    1 => 1.0,
                                    _ => (bits(&mut state) % 3) as f32 / 2.0,
                                })
                                .collect();
                            // Fans may cut across lattice triangles with weights only in patches that the border cuts.
                            let code = if whole { 15 } else { (bits(&mut state) % 16) as u8 };
                            for part in parts_of([code & 1, code >> 1 & 1, code >> 2 & 1, code >> 3]) {
                                for triangle in parts.triangles(part) {
                                    let corners = place(&tree, id, *triangle);
                                    let heights = std::array::from_fn(|k: usize| {
                                        // The vertices that are clamped to one place have one weight.
                                        let at = [0, 1].map(|a| (corners[k][a] - [u, v][a]).div_ceil(step));
                                        let weight = weights[(at[1] * (last + 1) + at[0]) as usize];
                                        morphed_height(&field, corners[k], step, weight)
                                    });
                                    for [u, v, drawn] in points(corners, heights) {
                                        let surface = field.surface(u, v).unwrap();
                                        worst = worst.max((drawn - surface).abs());
                                    }
                                }
                            }
                        }
                        let bound = f64::from(bound.error);
                        assert!(worst <= bound + 1e-6 * (1.0 + bound), "{id:?} of {min}: {worst} beyond {bound}");
                        if bound > 0.0 {
                            reached = reached.max(worst / bound);
                        }
                    }
                }
            }
        }
        assert!(reached > 0.99, "{reached}");
    }

    #[test]
    fn weights_are_exact_at_their_ends() {
        assert_eq!([0.0, 0.5, 1.0, 1e300, f64::INFINITY].map(weight), [0.0, 0.0, 1.0, 1.0, 1.0]);
        assert!(weight(0.5f64.next_up()) > 0.0);
        assert!(weight(1.0f64.next_down()) <= 1.0);
    }
}
