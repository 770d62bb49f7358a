//! How far a mesh is from full resolution on the screen, measured: the judge of what the metrics promise.

use glam::{DMat3, DVec2, DVec3};

use super::drawn::DrawnSurface;
use super::errors::overlay_heights;
use super::pixel_error::{LatticeView, PixelProjection};
use super::selection::ActivePatch;

/// The distances on the screen between where points of the full-resolution surface are and where a mesh shows them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ScreenError {
    /// Largest distance in pixels.
    pub max: f64,
    /// Root of the mean of the squares, over samples and crossings alike.
    pub rms: f64,
    /// Points that were looked at: those in view.
    pub points: u64,
}

impl LatticeView {
    /// Where a lattice point is in the picture, in pixels from the middle, right and up.
    #[must_use]
    pub fn pixel(&self, p: DVec3) -> DVec2 {
        let p = p.extend(1.0);
        let across = DVec2::new(self.right.dot(p), self.up.dot(p));
        match self.projection {
            PixelProjection::Perspective { focal, .. } => across * (focal / self.depth.dot(p)),
            PixelProjection::Orthographic { scale } => across * scale,
        }
    }
}

/// Measures these patches of a mesh: at every sample of the map, and wherever an edge of the mesh crosses a grid line or a cell's diagonal,
/// the picture of the full-resolution surface is compared with that of the mesh. A point counts if one of the two is in
/// view. What hides what is not asked: hidden points count too.
///
/// The distance of two piecewise linear surfaces is largest at these points, and so, but for the perspective within a single
/// triangle, is its picture.
#[must_use]
pub fn screen_error(mesh: &DrawnSurface<'_>, patches: &[ActivePatch], view: &LatticeView) -> ScreenError {
    use rayon::prelude::*;
    let of_patches: Vec<(f64, f64, u64)> = patches
        .par_iter()
        .map(|patch| {
            let (mut max, mut squares, mut points) = (0.0f64, 0.0f64, 0u64);
            for triangle in mesh.triangles(*patch) {
                overlay_heights(mesh.field, triangle.corners, triangle.heights, |u, v, surface, drawn| {
                    let (p, q) = (DVec3::new(u, v, surface), DVec3::new(u, v, drawn));
                    if view.frustum.contains(p) || view.frustum.contains(q) {
                        let distance = view.pixel(p).distance(view.pixel(q));
                        max = max.max(distance);
                        squares += distance * distance;
                        points += 1;
                    }
                });
            }
            (max, squares, points)
        })
        .collect();
    // Added up in the order of the patches, so that the sum has the same bits however the work was shared out.
    let add = |a: (f64, f64, u64), b: (f64, f64, u64)| (a.0.max(b.0), a.1 + b.1, a.2 + b.2);
    let (max, squares, points) = of_patches.into_iter().fold((0.0, 0.0, 0), add);
    ScreenError { max, rms: if points > 0 { (squares / points as f64).sqrt() } else { 0.0 }, points }
}

/// How many triangles of these patches turn their back to the eye, or stand on edge: those that back-face culling on the device leaves
/// out. Triangles without area, clamped to the border of the map, are among them.
#[must_use]
pub fn facing_away(mesh: &DrawnSurface<'_>, patches: &[ActivePatch], view: &LatticeView) -> u64 {
    use rayon::prelude::*;
    // Where the eye is, or for parallel rays which way they go, from the planes in which it lies.
    let normals = DMat3::from_cols(view.right.truncate(), view.up.truncate(), view.depth.truncate()).transpose();
    let eye = normals.inverse() * -DVec3::new(view.right.w, view.up.w, view.depth.w);
    let across = view.right.truncate().cross(view.up.truncate());
    let forward = across * across.dot(view.depth.truncate()).signum();
    let faces = |corners: [[u32; 2]; 3], heights: [f64; 3]| {
        let [a, b, c] = [0, 1, 2].map(|k| DVec3::new(f64::from(corners[k][0]), f64::from(corners[k][1]), heights[k]));
        let normal = (b - a).cross(c - a);
        // Upwards, whichever way round the corners go.
        let normal = normal * normal.z.signum();
        normal.z != 0.0
            && match view.projection {
                PixelProjection::Perspective { .. } => normal.dot(eye - a) > 0.0,
                PixelProjection::Orthographic { .. } => normal.dot(forward) < 0.0,
            }
    };
    let of_patch = |patch: &ActivePatch| mesh.triangles(*patch).filter(|t| !faces(t.corners, t.heights)).count() as u64;
    patches.par_iter().map(of_patch).sum()
}
