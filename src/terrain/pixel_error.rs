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

use glam::{DVec2, DVec3, DVec4};

use super::errors::TileErrors;
use super::frustum::Frustum;
use super::hierarchy::{Hierarchy, PatchId};
use super::parts::Side;
use super::pyramid::MinMaxPyramid;
use super::selection::{Demand, Metric};

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
        /// Tangents of half the horizontal and vertical field of view.
        tangents: DVec2,
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
}

impl PixelError<'_> {
    /// Largest vertical errors allowed on the four sides, in raw units.
    fn allowed(&self, tree: &Hierarchy, patch: PatchId, low: DVec3, high: DVec3) -> [f64; 4] {
        let LatticeView { right, up, depth, projection, .. } = self.view;
        let tangents = match *projection {
            PixelProjection::Orthographic { .. } => {
                // A view straight down sees no vertical error: 0/0 there would be NaN, and anything is allowed.
                let pixels = self.view.spread(DVec2::ZERO, DVec2::ZERO);
                return [if pixels > 0.0 { self.tolerance / pixels } else { f64::INFINITY }; 4];
            }
            PixelProjection::Perspective { tangents, .. } => tangents,
        };

        // The rectangle of t = (right, up) / depth that the box covers.
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
                (least, most) = (-tangents, tangents);
                break;
            }
            let t = DVec2::new(right.dot(corner), up.dot(corner)) / z;
            (least, most) = (least.min(t), most.max(t));
        }
        let (least, most) = (least.clamp(-tangents, tangents), most.clamp(-tangents, tangents));
        let factor = self.tolerance / self.view.spread(least, most);

        // Depths at the corners and the centre; a tile lies between two corners and the centre. Strips reach over the
        // diagonal by at most one coarse step.
        let at = |u: f64, v: f64| depth.x * u + depth.y * v + depth.w;
        let half = f64::from(tree.size(patch.level) / 2);
        let center = at((low.x + half).min(high.x), (low.y + half).min(high.y));
        let corners = [at(low.x, low.y), at(high.x, low.y), at(high.x, high.y), at(low.x, high.y)];
        let step = f64::from(tree.size(patch.level) / tree.resolutions().min());
        let below = (depth.z * low.z).min(depth.z * high.z) - (depth.x.abs() + depth.y.abs()) * step;
        std::array::from_fn(|side| {
            let z = corners[side].min(corners[(side + 1) % 4]).min(center) + below;
            if z > 0.0 { factor * z } else { 0.0 }
        })
    }
}

impl Metric for PixelError<'_> {
    fn demand(&self, tree: &Hierarchy, patch: PatchId) -> Demand {
        let [[u0, v0], [u1, v1]] = tree.extent(patch);
        let [bottom, top] = self.pyramid.range(tree.size(patch.level), patch.column, patch.row);
        let low = DVec3::new(f64::from(u0), f64::from(v0), bottom);
        let high = DVec3::new(f64::from(u1), f64::from(v1), top);
        // Whatever is allowed is kept even where the projection has no bound: beside and behind the eye.
        if self.tolerance == f64::INFINITY || self.view.frustum.excludes(low, high) {
            return Demand::Keep([0; 4]);
        }
        let allowed = self.allowed(tree, patch, low, high);
        let mut needs = [0; 4];
        for side in Side::ALL {
            let enough = (0..tree.resolutions().count() as u8)
                .find(|&k| self.errors.get(tree, patch, side, k) <= allowed[side as usize]);
            match enough {
                Some(k) => needs[side as usize] = k,
                None => return Demand::Split,
            }
        }
        Demand::Keep(needs)
    }
}
