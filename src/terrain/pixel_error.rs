//! Detail by the error in pixels: the coarsest mesh whose every visible point lies within τ pixels of where it belongs.
//!
//! # From a vertical error to pixels
//!
//! A point P of the full-resolution surface is drawn at Q = P + δ·a, where δ is the vertical error in raw units and a is
//! the world vector of one raw unit of height. In camera axes (right, up, depth Z; t = the point's right and up over its
//! depth) with a focal length of f pixels the picture of it moves by
//!
//! ```text
//! f · |Q⊥/Z_Q − P⊥/Z_P| = f · δ · |a⊥ − t_P · a_Z| / Z_Q
//! ```
//!
//! exactly: no small angles are assumed. Over a tile, |a⊥ − t·a_Z| is convex in t and so largest at a corner of the
//! rectangle of t that the patch's box covers in the picture; Z_Q is at least the smallest depth of the tile's box, in
//! which both surfaces lie. With L and Z those two,
//!
//! ```text
//! δ ≤ τ · Z / (f · L)
//! ```
//!
//! is enough. An orthographic camera has δ · |a⊥| · pixels per unit, everywhere the same. A box that reaches behind the eye
//! has Z ≤ 0: nothing but an error of zero is enough there. A box outside the view is not visible and needs nothing.
//!
//! # The outlines of holes
//!
//! Where a map has holes, a coarse mesh shows a place P of the patch, in view, as ground or as a hole that it is not. The
//! nearest place Q that is lies at most c cells from it horizontally, in whatever direction, and w raw units vertically, the
//! vertical error included ([`super::coverage`]). With b the 3 × 2 matrix that takes a step in cells to camera axes, the exact
//! formula above bounds the way from P to Q in the picture by
//!
//! ```text
//! f · (c · |b⊥ − t_P b_Z| + w · |a⊥ − t_P · a_Z|) / Z_Q
//! ```
//!
//! where the first |·| is the larger singular value of a 2 × 2 matrix that is linear in t: a norm, so it too is convex and
//! largest at a corner of the rectangle of t. Q may lie beyond the box, but no nearer than Z − c · |b_Z| − w · |a_Z|. So with
//! S and L the largest of the two norms,
//!
//! ```text
//! f · (c · S + w · L) ≤ τ · (Z − c · |b_Z| − w · |a_Z|)
//! ```
//!
//! is enough; for an orthographic camera with b⊥ and a⊥ alone, without the division by depth.

use glam::{DVec2, DVec3, DVec4};

use super::coverage::Displacement;
use super::errors::TileErrors;
use super::frustum::Frustum;
use super::hierarchy::{Hierarchy, PatchId};
use super::parts::Side;
use super::pyramid::MinMaxPyramid;
use super::selection::{ActivePatch, Demand, Metric};

/// A camera in the lattice coordinates of one map: linear functions of (u, v, w, 1).
#[derive(Debug, Clone, PartialEq)]
pub struct LatticeView {
    /// What is in view.
    pub frustum: Frustum,
    /// Coordinate to the right of the eye, in world units.
    pub right: DVec4,
    /// Coordinate above the eye.
    pub up: DVec4,
    /// Depth before the eye.
    pub depth: DVec4,
    /// How depth becomes pixels.
    pub projection: PixelProjection,
}

/// How a camera turns lengths into pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PixelProjection {
    /// Pixels = `focal` · length / depth.
    Perspective {
        /// Focal length in pixels: height of the picture / (2 tan(field of view / 2)).
        focal: f64,
        /// What is seen: least and greatest tangents to the right and up. Both ways the same but for cameras that look beside
        /// the middle of their picture.
        tangents: [DVec2; 2],
    },
    /// Pixels = `scale` · length.
    Orthographic {
        /// Pixels per world unit.
        scale: f64,
    },
}

/// The metric; see the module's documentation.
#[derive(Debug, Clone, Copy)]
pub struct PixelError<'t> {
    /// τ, the error allowed in pixels, from 0 up; 0 means full resolution, infinity the coarsest mesh.
    pub tolerance: f64,
    /// The camera.
    pub view: &'t LatticeView,
    /// Errors of the tiles.
    pub errors: &'t TileErrors,
    /// Smallest and largest heights of the patches.
    pub pyramid: &'t MinMaxPyramid,
}

impl LatticeView {
    /// Pixels by which one raw unit of height moves a picture, times the depth (an orthographic camera has none): the largest
    /// f · |a⊥ − t·a_Z| over a rectangle of t. Each axis is largest at one of its ends, and both at once at a corner.
    pub(super) fn spread(&self, least: DVec2, most: DVec2) -> f64 {
        let rise = DVec2::new(self.right.z, self.up.z);
        match self.projection {
            PixelProjection::Orthographic { scale } => scale * rise.length(),
            PixelProjection::Perspective { focal, .. } => {
                let along = |t: DVec2| (rise - t * self.depth.z).abs();
                focal * along(least).max(along(most)).length()
            }
        }
    }

    /// A bound of the pixels, times the depth, by which a step of one cell in any horizontal direction moves a picture: the root
    /// of the sum of the squares of all elements is not less than the larger singular value of a matrix.
    pub(super) fn spread_of_cells(&self, least: DVec2, most: DVec2) -> f64 {
        let along = |k: usize, t: DVec2| (DVec2::new(self.right[k], self.up[k]) - t * self.depth[k]).abs();
        let squares = |least: DVec2, most: DVec2| {
            [0, 1].map(|k| along(k, least).max(along(k, most)).length_squared()).into_iter().sum::<f64>()
        };
        match self.projection {
            PixelProjection::Orthographic { scale } => scale * squares(DVec2::ZERO, DVec2::ZERO).sqrt(),
            PixelProjection::Perspective { focal, .. } => focal * squares(least, most).sqrt(),
        }
    }
}

impl PixelError<'_> {
    /// Largest vertical errors allowed on the four sides, in raw units.
    fn allowed(&self, tree: &Hierarchy, patch: PatchId, low: DVec3, high: DVec3) -> [f64; 4] {
        let tangents = match self.view.projection {
            PixelProjection::Orthographic { .. } => {
                // A view straight down sees no vertical error: 0/0 there would be NaN, and anything is allowed.
                let pixels = self.view.spread(DVec2::ZERO, DVec2::ZERO);
                return [if pixels > 0.0 { self.tolerance / pixels } else { f64::INFINITY }; 4];
            }
            PixelProjection::Perspective { tangents, .. } => tangents,
        };

        let [least, most] = self.rectangle_in_picture(low, high, tangents);
        let factor = self.tolerance / self.view.spread(least, most);
        self.depths(tree, patch, low, high).map(|z| if z > 0.0 { factor * z } else { 0.0 })
    }

    /// Least and most of the rectangle of t = (right, up) / depth that a box covers, as far as it is in view.
    fn rectangle_in_picture(&self, low: DVec3, high: DVec3, [leftmost, rightmost]: [DVec2; 2]) -> [DVec2; 2] {
        let LatticeView { right, up, depth, .. } = self.view;
        let (mut least, mut most) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for k in 0..8 {
            let corner = DVec4::new(
                if k & 1 == 0 { low.x } else { high.x },
                if k & 2 == 0 { low.y } else { high.y },
                if k & 4 == 0 { low.z } else { high.z },
                1.0,
            );
            let z = depth.dot(corner);
            if z <= 0.0 {
                (least, most) = (leftmost, rightmost);
                break;
            }
            let t = DVec2::new(right.dot(corner), up.dot(corner)) / z;
            (least, most) = (least.min(t), most.max(t));
        }
        [least, most].map(|t| t.clamp(leftmost, rightmost))
    }

    /// Smallest depths on the four sides: of the tile and its half of the strips, in the patch's box.
    fn depths(&self, tree: &Hierarchy, patch: PatchId, low: DVec3, high: DVec3) -> [f64; 4] {
        let depth = self.view.depth;
        // Depths at the corners and the centre; a tile lies between two corners and the centre. Strips reach over the
        // diagonal by at most one coarse step.
        let at = |u: f64, v: f64| depth.x * u + depth.y * v + depth.w;
        let half = f64::from(tree.size(patch.level) / 2);
        let center = at((low.x + half).min(high.x), (low.y + half).min(high.y));
        let corners = [at(low.x, low.y), at(high.x, low.y), at(high.x, high.y), at(low.x, high.y)];
        let step = f64::from(tree.size(patch.level) / tree.resolutions().min());
        let below = (depth.z * low.z).min(depth.z * high.z) - (depth.x.abs() + depth.y.abs()) * step;
        std::array::from_fn(|side| corners[side].min(corners[(side + 1) % 4]).min(center) + below)
    }

    /// How many pixels what is drawn on the four sides of an active patch may be off: the smallest tolerance, up to rounding, with
    /// which [`Metric::demand`] would be content with these resolutions. Infinite where there is no bound; 0 out of view. Does not
    /// depend on [`PixelError::tolerance`].
    #[must_use]
    pub fn pixels(&self, tree: &Hierarchy, patch: ActivePatch) -> [f64; 4] {
        let ActivePatch { id, sides } = patch;
        let [low, high] = self.pyramid.patch_box(tree, id);
        // Every cell is drawn as it is. (What is stored counts the strips to a coarser side too.)
        let finest = id.level == tree.depth() && sides.iter().all(|&k| u32::from(k) + 1 == tree.resolutions().count());
        if finest || self.view.frustum.excludes(low, high) {
            return [0.0; 4];
        }
        let reach = self.reach(tree, id, low, high);
        Side::ALL.map(|side| {
            let k = sides[side as usize];
            let error = self.errors.get(tree, id, side, k);
            let off = self.errors.coverage().map_or(Displacement::default(), |c| c.get(tree, id, side, k));
            let outline =
                if off == Displacement::default() { off } else { Displacement { raw: off.raw + error, ..off } };
            reach.pixels_vertical(side, error).max(reach.pixels(side, outline))
        })
    }

    /// What decides how far a displacement is seen on the four sides of a patch.
    fn reach(&self, tree: &Hierarchy, patch: PatchId, low: DVec3, high: DVec3) -> Reach {
        let LatticeView { right, up, depth, projection, .. } = self.view;
        let columns = |t: DVec2| [0, 1, 2].map(|k| DVec2::new(right[k], up[k]) - t * depth[k]);
        match *projection {
            PixelProjection::Orthographic { scale } => {
                let [u, v, w] = columns(DVec2::ZERO);
                let (per_cell, per_raw) = (scale * largest_singular_value(u, v), scale * w.length());
                Reach { per_cell, per_raw, depths: [1.0; 4], nearer: [0.0; 2] }
            }
            PixelProjection::Perspective { focal, tangents } => {
                let [least, most] = self.rectangle_in_picture(low, high, tangents);
                let corners = [least, most, DVec2::new(least.x, most.y), DVec2::new(most.x, least.y)];
                let at_corner = |t: DVec2| {
                    let [u, v, _] = columns(t);
                    focal * largest_singular_value(u, v)
                };
                let per_cell = corners.into_iter().map(at_corner).fold(0.0, f64::max);
                let per_raw = self.view.spread(least, most);
                let nearer = [DVec2::new(depth.x, depth.y).length(), depth.z.abs()];
                Reach { per_cell, per_raw, depths: self.depths(tree, patch, low, high), nearer }
            }
        }
    }
}

/// Pixels times depth per cell and per raw unit of displacement, the depths of the four sides, and how much nearer the end of
/// a displacement may be, per cell and per raw unit. Without perspective all depths are 1.
struct Reach {
    per_cell: f64,
    per_raw: f64,
    depths: [f64; 4],
    nearer: [f64; 2],
}

impl Reach {
    /// Pixels as which a vertical error is seen at most: both of its ends lie in the box.
    fn pixels_vertical(&self, side: Side, error: f64) -> f64 {
        pixels_of(error * self.per_raw, self.depths[side as usize])
    }

    /// Pixels as which a displacement is seen at most; its end may lie nearer than the box.
    fn pixels(&self, side: Side, Displacement { cells, raw }: Displacement) -> f64 {
        let depth = self.depths[side as usize] - cells * self.nearer[0] - raw * self.nearer[1];
        pixels_of(cells * self.per_cell + raw * self.per_raw, depth)
    }

    /// Whether a displacement is seen as at most `tolerance` pixels.
    fn allows(&self, side: Side, Displacement { cells, raw }: Displacement, tolerance: f64) -> bool {
        let depth = self.depths[side as usize] - cells * self.nearer[0] - raw * self.nearer[1];
        depth > 0.0 && cells * self.per_cell + raw * self.per_raw <= tolerance * depth
    }
}

/// Pixels from pixels times depth, at this depth or further away: no bound beside and behind the eye, but for nothing.
pub(super) fn pixels_of(times_depth: f64, depth: f64) -> f64 {
    match depth > 0.0 {
        _ if times_depth == 0.0 => 0.0,
        true => times_depth / depth,
        false => f64::INFINITY,
    }
}

/// The larger singular value of the matrix with these two columns: σ² = (F + √(F² − 4 det²)) / 2 with F the sum of the
/// squares of its elements.
fn largest_singular_value(u: DVec2, v: DVec2) -> f64 {
    let (squares, det) = (u.length_squared() + v.length_squared(), u.perp_dot(v));
    // What is under the root is (|u|² − |v|²)² + 4 (u·v)², from 0 up but for rounding.
    (0.5 * (squares + (squares * squares - 4.0 * det * det).max(0.0).sqrt())).sqrt()
}

impl Metric for PixelError<'_> {
    fn demand(&self, tree: &Hierarchy, patch: PatchId) -> Demand {
        let [low, high] = self.pyramid.patch_box(tree, patch);
        // Whatever is allowed is kept even where the projection has no bound: beside and behind the eye.
        if self.tolerance == f64::INFINITY || self.view.frustum.excludes(low, high) {
            return Demand::Keep([0; 4]);
        }
        let allowed = self.allowed(tree, patch, low, high);
        // Only patches with an outline ask how far it may be off.
        let mut reach = None;
        let mut outlined = |side: Side, k: u8| {
            let Some(coverage) = self.errors.coverage() else { return true };
            let off = coverage.get(tree, patch, side, k);
            if off == Displacement::default() {
                return true;
            }
            let reach = reach.get_or_insert_with(|| self.reach(tree, patch, low, high));
            let raw = off.raw + self.errors.get(tree, patch, side, k);
            reach.allows(side, Displacement { raw, ..off }, self.tolerance)
        };
        let mut needs = [0; 4];
        for side in Side::ALL {
            let enough = (0..tree.resolutions().count() as u8)
                .find(|&k| self.errors.get(tree, patch, side, k) <= allowed[side as usize] && outlined(side, k));
            match enough {
                Some(k) => needs[side as usize] = k,
                None => return Demand::Split,
            }
        }
        Demand::Keep(needs)
    }
}
